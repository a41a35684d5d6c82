//! Check that supports hold the loaded pieces of bodies in load steps.

use crate::comm::sum::{ExactSum, reduce};
use crate::component::AXES;
use crate::error::{Error, Result};
use crate::problem::{Method, Relaxation, Static, Time};
use crate::solver::Simulation;
use crate::solver::model::Model;

use super::Fields;
use super::load_step::sums;
use super::pieces::{Piece, Pieces};

/// A sum of loads below this fraction of the sum of their magnitudes is round-off.
const ROUND_OFF: f64 = 1e-9;

/// Torques below this fraction of Σ |arm| |force| are ignored, because they rotate a piece only by a small
/// angle. The arm of a point is its position relative to the centroid of the piece.
const SMALL_TORQUE: f64 = 0.01;

/// For each axis, the two displacement components that a rotation about this axis changes.
pub(super) const PLANES: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

/// Loads on a piece along one axis. No support holds the piece along this axis.
struct UnheldLoad {
    piece: Piece,
    component: usize,
    /// Sum of the loads along the axis, N.
    force: f64,
}

/// Loads that rotate a piece, although no support holds the piece in the plane of the rotation; the same on
/// all ranks.
pub struct UnheldTorque {
    /// Index of the condition with the largest contribution to the torque.
    pub condition: usize,
    /// Description of the piece, the axis and the torque.
    pub description: String,
}

impl<const D: usize> Simulation<'_, D> {
    /// Check that supports hold the loaded pieces at the first and the last load step of each stage.
    /// Collective.
    ///
    /// # Errors
    /// If a piece is loaded along an axis, but no support holds it along this axis. If there are several such
    /// pieces, the message names the piece that contains the point with the smallest id.
    pub(in crate::solver) fn check_loads_are_held(&mut self) -> Result<()> {
        for stage in 0..self.stages.all.len() {
            let found = self.at_load_steps(stage, |simulation, pieces, time| {
                let unheld = simulation.unheld_load(pieces)?;
                let component = unheld.component;
                let along = |_: usize, force: [f64; D]| force[component];
                let condition = simulation.largest_load(&unheld.piece.points, along);
                Some((condition, time, simulation.describe_unheld_load(&unheld)))
            });
            if let Some((condition, time, text)) = found {
                let condition = &self.problem.conditions[condition];
                let (name, quantity) = (&condition.name, condition.quantity);
                let message = format!("[condition.{name}] {quantity}: at t = {time:.6e} s, {text}");
                return Err(Error::input(message).at(&condition.place));
            }
        }
        Ok(())
    }

    /// Find loads of the first stage that rotate a piece, if no support holds the piece in the plane of the
    /// rotation. Later stages are not checked, because the positions of the points in these stages are not
    /// known yet. The simulation must be at time 0. Collective.
    pub fn unheld_torque(&mut self) -> Option<UnheldTorque> {
        if D == 1 {
            return None;
        }
        self.at_load_steps(0, |simulation, pieces, _| {
            simulation.find_unheld_torque(pieces)
        })
    }

    /// Call `visit` at the first and at the last load step of a stage, until `visit` returns a value. Return
    /// this value. The arguments of `visit` are the simulation with the loads and supports of this load step,
    /// the pieces, and the time, s.
    ///
    /// `visit` is not called for explicit stages and for stages without loads. It is not called in runs with
    /// contact either, because contact can hold pieces. Afterwards, the loads and supports of the first stage
    /// at time 0 act again. Collective.
    fn at_load_steps<T>(
        &mut self,
        stage: usize,
        mut visit: impl FnMut(&Self, &Pieces<D>, f64) -> Option<T>,
    ) -> Option<T> {
        let Time { end, method, .. } = self.stages.all[stage].time;
        let load_steps = method.load_steps().filter(|_| self.contact.is_none())?;
        let begin = stage
            .checked_sub(1)
            .map_or(0.0, |before| self.stages.all[before].time.end);
        let first = begin + (end - begin) / load_steps as f64;
        self.set_stage_loads(stage, first);
        let mut result = None;
        if self.conditions.have_loads() {
            let mut is_unloaded = self.unloaded_points();
            self.set_stage_loads(stage, end);
            let both = is_unloaded.iter_mut().zip(self.unloaded_points());
            for (column, at_end) in both {
                let entries = column.iter_mut().zip(at_end);
                entries.for_each(|(entry, at_end)| *entry = entry.min(at_end));
            }
            let pieces = self.find_pieces(is_unloaded);
            result = [first, end].into_iter().find_map(|time| {
                self.set_stage_loads(stage, time);
                visit(self, &pieces, time)
            });
        }
        self.set_stage_loads(0, 0.0);
        result
    }

    /// Activate the loads and supports of a stage, and compute the loads at a time (s).
    fn set_stage_loads(&mut self, stage: usize, time: f64) {
        let components = self.fields.external_force.iter_mut().flatten();
        components.for_each(|component| component.fill(0.0));
        self.enter(stage);
        self.apply_loads(time, true);
    }

    /// Return an error if a piece is loaded along an axis, but no support holds it along this axis. The
    /// message begins with `failure`. If there are several such pieces, the message names the piece that
    /// contains the point with the smallest id. Collective.
    pub(super) fn check_pieces_are_held(&mut self, failure: &str) -> Result<()> {
        let pieces = self.find_pieces(self.unloaded_points());
        self.unheld_load(&pieces).map_or(Ok(()), |unheld| {
            let text = self.describe_unheld_load(&unheld);
            Err(Error::run(format!("{failure}: {text}")))
        })
    }

    /// Whether a loaded piece without support drifts away. The round-off limit of the forces grows with the
    /// displacements. At large displacements, the unbalanced forces on a drifting piece are below this limit,
    /// so the positions of the piece would count as an equilibrium. Collective.
    pub(super) fn is_drifting(&mut self) -> bool {
        self.progress.load_step.residual == 0.0
            && self.contact.is_none()
            && self.conditions.have_loads()
            && self.check_pieces_are_held("").is_err()
    }

    /// Find a piece that is loaded along an axis, but that no support holds along this axis. Loads within the
    /// tolerance of the stage are ignored. If there are several such pieces, return the one that contains the
    /// point with the smallest id. Collective.
    fn unheld_load(&self, pieces: &Pieces<D>) -> Option<UnheldLoad> {
        let allowed = self.allowed_force();
        let is_suspect = |point: usize, d: usize| {
            pieces.is_free[d][point] == 1.0 && pieces.is_unloaded[d][point] == 0.0
        };
        let any = |point: usize| (0..D).any(|d| is_suspect(point, d));
        self.first_of_pieces(pieces, any, |piece| {
            let mut is_held = [0.0; D];
            let mut sums = [const { ExactSum::ZERO }; 6];
            for point in &piece.points {
                let force = load_on(&self.model, &self.fields, *point);
                for d in 0..D {
                    sums[d].add(force[d]);
                    sums[3 + d].add(force[d].abs());
                    is_held[d] = 1.0 - pieces.is_free[d][*point];
                }
            }
            self.comm.max(&mut is_held);
            let sums = reduce(self.comm, &mut sums);
            // Forces on n points with the sum F have a norm of at least |F|/√n. A sum above √n times the
            // allowed norm can therefore not be within the tolerance.
            let allowed = allowed * (piece.count as f64).sqrt();
            let unbalanced = |d: &usize| {
                let force = sums[*d].abs();
                is_held[*d] == 0.0 && force > allowed && force > ROUND_OFF * sums[3 + d]
            };
            (0..D).find(unbalanced).map(|component| UnheldLoad {
                force: sums[component],
                piece,
                component,
            })
        })
    }

    /// Return the tolerance of the present stage, multiplied by the norm ‖loads‖ (N) of the present loads. If
    /// there are no reactions, this product is the largest allowed norm of the unbalanced forces. Collective.
    fn allowed_force(&self) -> f64 {
        let tolerance = match self.time_rule().method {
            Method::Relaxation(Relaxation { tolerance, .. })
            | Method::Static(Static { tolerance, .. }) => tolerance,
            Method::Explicit => 0.0,
        };
        let (model, fields) = (&self.model, &self.fields);
        let squares = sums(model, fields, &|point, _| {
            let force = load_on(model, fields, point);
            [force.iter().map(|force| force * force).sum()]
        });
        tolerance * reduce(self.comm, &mut { squares })[0].sqrt()
    }

    fn describe_unheld_load(&self, unheld: &UnheldLoad) -> String {
        let (axis, force) = (AXES[unheld.component], unheld.force);
        let [body, size] = self.describe_piece(&unheld.piece);
        format!(
            "loads of {force:.3e} N act along {axis} on a piece of body `{body}` that no support holds along {axis}. \
             {size}. Prescribe its displacement along {axis} at some points, \
             balance its loads, or use `method = \"explicit\"`"
        )
    }

    /// Find a piece that the present loads rotate, and that no support holds in the plane of the rotation. Of
    /// several pieces, return the one with the smallest point id. Collective.
    fn find_unheld_torque(&self, pieces: &Pieces<D>) -> Option<UnheldTorque> {
        let planes = || (0..3).filter(|axis| PLANES[*axis].iter().all(|d| *d < D));
        let is_suspect = |point: usize, axis: usize| {
            let plane = PLANES[axis];
            plane.iter().all(|d| pieces.is_free[*d][point] == 1.0)
                && plane.iter().any(|d| pieces.is_unloaded[*d][point] == 0.0)
        };
        let any = |point: usize| planes().any(|axis| is_suspect(point, axis));
        let position = |point: usize| self.fields.position(&self.model, point);
        self.first_of_pieces(pieces, any, |piece| {
            let mut flags = [0.0; 3];
            let mut moments = [const { ExactSum::ZERO }; 4];
            for point in &piece.points {
                planes().for_each(|axis| flags[axis] = f64::from(is_suspect(*point, axis)));
                let volume = self.model.volume[*point];
                moments[3].add(volume);
                let position = position(*point);
                (0..D).for_each(|d| moments[d].add(volume * position[d]));
            }
            self.comm.max(&mut flags);
            let moments = reduce(self.comm, &mut moments);
            let centroid: [f64; D] = std::array::from_fn(|d| moments[d] / moments[3]);
            let torque = |axis: usize, point: usize, force: [f64; D]| {
                let [a, b] = PLANES[axis];
                let position = position(point);
                (position[a] - centroid[a]) * force[b] - (position[b] - centroid[b]) * force[a]
            };
            let mut sums = [const { ExactSum::ZERO }; 6];
            for point in &piece.points {
                let force = load_on(&self.model, &self.fields, *point);
                let position = position(*point);
                for axis in planes() {
                    let plane = PLANES[axis];
                    let norm = |of: [f64; D]| libm::hypot(of[plane[0]], of[plane[1]]);
                    let arm = std::array::from_fn(|d| position[d] - centroid[d]);
                    sums[axis].add(torque(axis, *point, force));
                    sums[3 + axis].add(norm(arm) * norm(force));
                }
            }
            let sums = reduce(self.comm, &mut sums);
            let turns = |axis: &usize| {
                flags[*axis] == 1.0 && sums[*axis].abs() > SMALL_TORQUE * sums[3 + axis]
            };
            let axis = planes().find(turns)?;
            let about = |point: usize, force: [f64; D]| torque(axis, point, force);
            let [body, size] = self.describe_piece(&piece);
            let (name, torque) = (AXES[axis], sums[axis]);
            Some(UnheldTorque {
                condition: self.largest_load(&piece.points, about),
                description: format!(
                    "loads with a torque of {torque:.3e} N m about {name} act on a piece of body `{body}` that no \
                     support holds perpendicular to {name}; the piece turns until the loads are aligned. {size}"
                ),
            })
        })
    }

    /// Return the index of the condition with the largest load on a set of points. `points` contains the
    /// local indices of these points in ascending order. Loads are compared by the magnitude of the sum of
    /// `weight` over the points. The arguments of `weight` are a point and the force of the load on this
    /// point (N). Collective.
    fn largest_load(&self, points: &[usize], weight: impl Fn(usize, [f64; D]) -> f64) -> usize {
        let (conditions, mut sums) = self.conditions.load_sums(&self.model, points, weight);
        let sums = reduce(self.comm, &mut sums).into_iter();
        let all = conditions.into_iter().zip(sums.map(f64::abs));
        let largest = all.reduce(|a, b| if b.1 > a.1 { b } else { a });
        largest.expect("a loaded piece has loads").0
    }
}

/// Sum of the loads on an owned point, N.
fn load_on<const D: usize>(model: &Model<D>, fields: &Fields<D>, point: usize) -> [f64; D] {
    let (force, volume) = (fields.external_force.as_ref(), model.volume[point]);
    force.map_or([0.0; D], |force| {
        force.each_ref().map(|force| volume * force[point])
    })
}
