//! Contact: repulsion, friction and damping between points that no intact bond joins.
//!
//! Every owned point has a list of the points that it may touch before the next search. The list is in
//! ascending order of ids, so the order of the force sum does not depend on the ranks. A pair touches if its
//! distance is below its contact distance. The lists contain the pairs whose gap (present distance minus
//! contact distance) is at most the skin. The lists are rebuilt when points have moved or expanded so far
//! that pairs outside the lists may soon touch. The contact distance never exceeds the reference distance, so
//! an undeformed body has no contact forces. Points on opposite crack faces can touch, because the bonds
//! between them have broken. Contact distances expand with temperature as bonds do, so a body that expands
//! freely has no contact forces either.
//!
//! Rigid bodies repel all points. Every rank integrates the motion of all rigid bodies. The forces and
//! torques of the points on a rigid body are exact sums over all ranks, so the states of the bodies are the
//! same on all ranks.
//!
//! Repulsion follows from the new positions. Friction and damping follow from the velocities half a step
//! earlier. The work of friction and damping in a step is computed by the trapezoidal rule.

mod by_pair;
pub(super) mod cells;
mod ghosts;
mod pair;
mod rigid;
mod rows;
mod search;
mod shape;
mod start;
mod state;

use rayon::prelude::*;

use crate::comm::Communicator;
use crate::comm::sum::{ExactSum, reduce};
use crate::dimension::Dimension;
use crate::error::Result;
use crate::problem::Problem;

use super::bonds::Forces;
use super::model::Model;
use super::motion::Fields;
use super::motion::fictitious_density::stable_density;
use ghosts::Ghosts;
use pair::{ContactPoint, Demand, PairRule, Touch};
use rigid::{RigidBody, WrenchSums};
use rows::Rows;
use start::check_outside;
use state::StepDemand;

pub use by_pair::{ContactNow, contact_now};
pub use pair::short_range_spring;
pub use rigid::RigidState;
use search::MOST_GAP;
pub use start::Coincident;
pub use state::ContactState;

/// Number of points that one task processes.
const CHUNK: usize = 4096;

/// The look-ahead, in units of [`StepEnd::longest`]. Pairs that will touch within this time already limit the
/// step. The step is therefore short when they touch.
const LOOK_AHEAD: f64 = 2.0;

/// Contact on one rank.
pub struct Contact<const D: usize> {
    dimension: Dimension,
    /// Contact rule of each ordered pair of blocks, row-major; `None` for pairs without contact.
    rules: Vec<Option<PairRule>>,
    /// Number of blocks.
    blocks: usize,
    /// Largest contact distance of any two points, m. The change by thermal stretches is not included.
    largest: f64,
    /// Edge of a line segment, square or cube with the volume of the point, for each owned point, m.
    edges: Vec<f64>,
    ghosts: Ghosts<D>,
    rigid: Vec<RigidBody>,
    /// The owned points that touched a rigid body or were going to touch one within the look-ahead. The first
    /// list is from the last evaluation, and the second list is from the evaluation before it.
    at_rigid: [Vec<u32>; 2],
    rows: Rows,
    /// Owned points that may touch at least one point to which they have no intact bond.
    open: Vec<u32>,
    /// For each owned point, whether `open` contains the point.
    is_open: Vec<bool>,
    /// Displacements of the owned points at the last search, m.
    searched: [Vec<f64>; D],
    /// Thermal stretches of the owned points at the last search; empty in runs without temperatures.
    searched_stretch: Vec<f64>,
    /// Whether the lists of pairs must be rebuilt, and also the flags that mark the pairs joined by an intact
    /// bond; the same on all ranks.
    is_stale: bool,
    /// Limits that contact sets for the time step.
    demand: StepDemand,
    /// Largest overlap of two points at the end of the last step, as a fraction of their contact distance.
    /// The same on all ranks.
    deepest: f64,
    /// Sum of the squared forces of rigid bodies on the owned points at the last evaluation, N²; 0 if this
    /// evaluation was not quasi-static.
    rigid_forces: ExactSum,
    /// Buffer of [`Self::add_forces`]: the owned points that may have contact forces.
    active: Vec<u32>,
    /// Buffer of [`Self::add_forces`]: the contact forces on each point of `active`.
    sums: Vec<PointSum<D>>,
}

/// Settings of a contact force evaluation.
#[derive(Debug, Clone, Copy)]
pub struct ContactEvaluation {
    /// Whether the evaluation belongs to a quasi-static stage (method `relaxation` or `static`). Velocities
    /// are then 0. In a relaxation, contact also adds to the fictitious density.
    pub is_quasi_static: bool,
    /// Data of the step, if a step ends with this evaluation or a load step has reached equilibrium;
    /// otherwise `None`.
    pub end: Option<StepEnd>,
}

/// Time and step lengths at the end of a step.
#[derive(Debug, Clone, Copy)]
pub struct StepEnd {
    /// Time, s.
    pub time: f64,
    /// Length of this step, s; 0 at the start. If bonds break in a load step, the length is also 0 at all
    /// further equilibria of this load step.
    pub step: f64,
    /// Length that the next step could have without contact, s.
    pub longest: f64,
}

/// The contact forces on a point.
#[derive(Clone, Copy)]
struct PointSum<const D: usize> {
    /// Repulsion, N.
    repulsion: [f64; D],
    /// Damping, N.
    damping: [f64; D],
    /// Friction, N.
    friction: [f64; D],
    /// Part of these forces that comes from rigid bodies, N.
    of_rigid: [f64; D],
    /// Potential energy, J: half of the energy of each contact with a point, and all of the energy of
    /// contacts with rigid bodies.
    energy: f64,
    /// Contribution to the step limits, summed over present contacts and contacts expected within the
    /// look-ahead.
    demand: Demand,
    /// Whether the point touches another point or a rigid body.
    touches: bool,
    /// Largest overlap with another point, as a fraction of the contact distance.
    depth: f64,
}

impl<const D: usize> Contact<D> {
    /// Create the contact of the points with each other and with rigid bodies, if the deck has contact.
    /// Collective.
    ///
    /// # Errors
    /// If a point starts in a rigid body or on its surface; the error is the same on all ranks.
    pub fn new(
        problem: &Problem,
        comm: &dyn Communicator,
        model: &Model<D>,
    ) -> Result<Option<Self>> {
        if !problem.has_contact() {
            return Ok(None);
        }
        let dimension = problem.dimension;
        let blocks: Vec<_> = problem.blocks().collect();
        let pairs = blocks
            .iter()
            .flat_map(|here| blocks.iter().map(move |there| [here, there]));
        let rules: Vec<Option<PairRule>> = pairs
            .map(|[here, there]| {
                let contact = problem.contact.as_ref()?;
                let rule = contact.between(here.body, there.body)?;
                Some(PairRule::new(dimension, &rule, [here, there]))
            })
            .collect();
        let edges: Vec<f64> = (0..model.owned())
            .map(|point| dimension.edge(model.volume[point]))
            .collect();
        let mut largest_edges = vec![0.0_f64; blocks.len()];
        for (block, edge) in model.block.iter().zip(&edges) {
            let largest = &mut largest_edges[usize::from(*block)];
            *largest = largest.max(*edge);
        }
        comm.max(&mut largest_edges);
        let largest = |here: usize, there: usize| {
            let edge = 0.5 * (largest_edges[here] + largest_edges[there]);
            let rule = rules[here * blocks.len() + there].as_ref();
            rule.map_or(0.0, |rule| rule.largest_distance(edge))
        };
        let all =
            (0..blocks.len()).flat_map(|here| (0..blocks.len()).map(move |there| (here, there)));
        let largest = all
            .map(|(here, there)| largest(here, there))
            .fold(0.0, f64::max);
        let rigid = problem.rigid.iter();
        let rigid = rigid.map(|rigid| RigidBody::new(rigid, dimension, &blocks));
        let rigid: Vec<_> = rigid.collect();
        check_outside(problem, comm, model, &rigid)?;
        Ok(Some(Self {
            dimension,
            rigid,
            at_rigid: [Vec::new(), Vec::new()],
            active: Vec::new(),
            blocks: blocks.len(),
            rules,
            largest,
            edges,
            deepest: 0.0,
            ghosts: Ghosts::default(),
            rows: Rows::default(),
            open: Vec::new(),
            is_open: vec![false; model.owned()],
            searched: std::array::from_fn(|_| Vec::new()),
            searched_stretch: Vec::new(),
            is_stale: true,
            demand: StepDemand::default(),
            rigid_forces: ExactSum::ZERO,
            sums: Vec::new(),
        }))
    }

    /// Index of the first rigid body whose motion is not finite; `None` if the motions of all rigid bodies
    /// are finite.
    pub fn lost_rigid(&self) -> Option<usize> {
        self.rigid.iter().position(|rigid| !rigid.is_finite())
    }

    /// Advance the rigid bodies by a step of length `step` (s), which ends at `time` (s).
    pub fn drift(&mut self, time: f64, step: f64) {
        for rigid in &mut self.rigid {
            rigid.drift(time, step);
        }
    }

    /// Move driven rigid bodies to their positions at a time (s), for the next load step.
    pub fn place_rigid(&mut self, time: f64) {
        for rigid in &mut self.rigid {
            rigid.place(time);
        }
    }

    /// Largest overlap of two points at the end of the last step, as a fraction of their contact distance.
    pub fn deepest(&self) -> f64 {
        self.deepest
    }

    /// Sum of the squared forces of rigid bodies on the owned points at the last evaluation, N²; 0 if this
    /// evaluation was not quasi-static.
    pub fn rigid_forces(&self) -> &ExactSum {
        &self.rigid_forces
    }

    /// Add the contact forces at the present positions to the internal forces. At the end of a step, update
    /// friction and damping from the velocities in the middle of the step, and record the energy that they
    /// dissipate. At the end of a step, also apply the second half kick of rigid bodies. An evaluation that
    /// does not end a step does not change friction and damping. In runs in which points can touch each
    /// other, nothing is added if a position or a thermal stretch is not finite. Collective.
    pub fn add_forces(
        &mut self,
        comm: &dyn Communicator,
        model: &Model<D>,
        forces: &Forces<D>,
        fields: &mut Fields<D>,
        ContactEvaluation {
            is_quasi_static,
            end,
        }: ContactEvaluation,
    ) {
        if self.largest > 0.0 {
            let is_finite = self.search_where_due(comm, model, forces, fields);
            if !is_finite {
                return;
            }
            self.update_bonds(model, forces);
            self.ghosts.update(comm, fields);
        }
        let look_ahead = match end {
            Some(end) if !is_quasi_static => LOOK_AHEAD * end.longest,
            _ => 0.0,
        };
        let mut active = std::mem::take(&mut self.active);
        self.find_active(model, fields, look_ahead, &mut active);
        let mut sums = std::mem::take(&mut self.sums);
        active
            .par_iter()
            .with_min_len(CHUNK / 16)
            .map(|point| self.point_sum(model, fields, *point as usize, look_ahead))
            .collect_into_vec(&mut sums);
        let mut largest = [0.0_f64; 3];
        self.rigid_forces = ExactSum::ZERO;
        for (point, sum) in active.iter().zip(&sums) {
            let point = *point as usize;
            let volume = model.volume[point];
            let mass = model.density_of(point) * volume;
            let Demand { stiffness, damping } = sum.demand;
            largest[0] = largest[0].max(2.0 * stiffness / mass);
            largest[1] = largest[1].max(2.0 * damping / mass);
            largest[2] = largest[2].max(sum.depth);
            let [repulsion, damping, friction] = [sum.repulsion, sum.damping, sum.friction]
                .map(|force| force.map(|component| component / volume));
            if let Some(StepEnd { step, .. }) = end {
                fields.book_dissipation(point, volume, step, [friction, damping]);
            }
            // At a point without contact, adding 0 would change a force of −0 to 0.
            if sum.touches {
                fields.add_contact(point, repulsion, sum.energy);
            } else {
                fields.clear_contact(point);
            }
            if is_quasi_static {
                let square = sum.of_rigid.iter().map(|component| component * component);
                self.rigid_forces.add(square.sum());
                if let Some(density) = &mut fields.contact_density {
                    density[point] = density[point].max(stable_density(stiffness / volume));
                }
            }
        }
        (self.active, self.sums) = (active, sums);
        if let Some(end) = end {
            self.close_step(comm, model, fields, largest, (end, look_ahead));
        }
    }

    /// Find the owned points that may have contact forces now or within the look-ahead, or had contact forces
    /// at the last evaluation.
    fn find_active(
        &mut self,
        model: &Model<D>,
        fields: &Fields<D>,
        look_ahead: f64,
        active: &mut Vec<u32>,
    ) {
        active.clear();
        if !self.rigid.is_empty() {
            self.at_rigid.swap(0, 1);
            let mut now = std::mem::take(&mut self.at_rigid[0]);
            now.clear();
            let all = (0..model.owned()).into_par_iter().with_min_len(CHUNK);
            let touching = all.filter(|index| {
                let (block, point) = self.point(model, fields, *index);
                let mut rigid = self.rigid.iter();
                rigid.any(|rigid| rigid.demand(block, &point, look_ahead).is_some())
            });
            now.par_extend(touching.map(|point| point as u32));
            self.at_rigid[0] = now;
            let both = self.at_rigid.iter().flatten();
            active.extend(both.filter(|point| !self.is_open[**point as usize]));
            active.sort_unstable();
            active.dedup();
        }
        active.extend(&self.open);
    }

    /// Sum the forces of points on rigid bodies, finish the step of the bodies, and compute the step limits
    /// of contact. `largest` contains the largest 2 Σ k/m (1/s²) and 2 Σ c/m (1/s) of the owned points, see
    /// [`StepDemand`], and their largest [`PointSum::depth`]. `look_ahead` is the look-ahead with which
    /// [`Self::find_active`] found the points at the bodies, s. Collective.
    fn close_step(
        &mut self,
        comm: &dyn Communicator,
        model: &Model<D>,
        fields: &Fields<D>,
        mut largest: [f64; 3],
        (end, look_ahead): (StepEnd, f64),
    ) {
        if self.rigid.is_empty() {
            comm.max(&mut largest);
            [self.demand.stiffness, self.demand.damping, self.deepest] = largest;
            return;
        }
        // The entries from the fourth on are one distance per rigid body: the largest distance from the
        // centre to a point that touches the body or will do so within the look-ahead.
        let mut largest = largest.to_vec();
        largest.resize(3 + self.rigid.len(), 0.0);
        let mut sums = Vec::new();
        for (rigid, reach) in self.rigid.iter().zip(&mut largest[3..]) {
            let mut wrench = WrenchSums::new();
            let mut demands = [const { ExactSum::ZERO }; 2];
            for index in &self.at_rigid[0] {
                let (block, point) = self.point(model, fields, *index as usize);
                if let Some(touch) = rigid.touch(block, &point) {
                    rigid.add_opposite(&mut wrench, point.position(), &touch);
                }
                if let Some(demand) = rigid.demand(block, &point, look_ahead) {
                    *reach = reach.max(rigid.arm(point.position()));
                    demands[0].add(demand.stiffness);
                    demands[1].add(demand.damping);
                }
            }
            sums.extend(wrench.flat());
            sums.extend(demands);
        }
        comm.max(&mut largest);
        let (points, reaches) = largest.split_at(3);
        (self.demand.stiffness, self.demand.damping) = (points[0], points[1]);
        self.deepest = points[2];
        let sums = reduce(comm, &mut sums);
        let each = sums.chunks_exact(WrenchSums::COUNT + 2).zip(reaches);
        for (rigid, (sums, reach)) in self.rigid.iter_mut().zip(each) {
            let mobility = 2.0 * rigid.mobility(*reach);
            let [stiffness, damping] = [0, 1].map(|k| mobility * sums[WrenchSums::COUNT + k]);
            self.demand.stiffness = self.demand.stiffness.max(stiffness);
            self.demand.damping = self.demand.damping.max(damping);
            rigid.close_step(sums, end.time, end.step);
        }
    }

    /// Return the block and the data of the point with this index. Ghosts are numbered after the owned
    /// points.
    fn point(
        &self,
        model: &Model<D>,
        fields: &Fields<D>,
        index: usize,
    ) -> (usize, ContactPoint<D>) {
        match index.checked_sub(model.owned()) {
            None => {
                let block = usize::from(model.block[index]);
                let volume = model.volume[index];
                (
                    block,
                    ContactPoint {
                        reference: std::array::from_fn(|d| model.reference[d][index]),
                        displacement: std::array::from_fn(|d| fields.displacement[d][index]),
                        velocity: std::array::from_fn(|d| fields.velocity[d][index]),
                        thermal_stretch: stretch_of(fields.thermal_stretch.as_ref(), index),
                        volume,
                        edge: self.edges[index],
                        mass: model.density[block] * volume,
                    },
                )
            }
            Some(index) => {
                let ghosts = &self.ghosts;
                let point = &ghosts.points[index];
                let block = point.block as usize;
                (
                    block,
                    ContactPoint {
                        reference: std::array::from_fn(|d| point.reference[d]),
                        displacement: std::array::from_fn(|d| ghosts.displacement[d][index]),
                        velocity: std::array::from_fn(|d| ghosts.velocity[d][index]),
                        thermal_stretch: stretch_of(ghosts.thermal_stretch.as_ref(), index),
                        volume: point.volume,
                        edge: ghosts.edges[index],
                        mass: model.density[block] * point.volume,
                    },
                )
            }
        }
    }

    /// Call `visit` for each point that may touch an owned point, in ascending order of ids. The arguments
    /// are the owned point, the other point, the block of the other point, and the contact rule of the pair.
    fn for_each_candidate(
        &self,
        model: &Model<D>,
        fields: &Fields<D>,
        point: usize,
        mut visit: impl FnMut(&ContactPoint<D>, &ContactPoint<D>, usize, &PairRule),
    ) {
        if !self.is_open[point] {
            return;
        }
        let (block, here) = self.point(model, fields, point);
        for other in self.rows.touching(point) {
            let (other_block, there) = self.point(model, fields, other);
            if let Some(rule) = &self.rules[block * self.blocks + other_block] {
                visit(&here, &there, other_block, rule);
            }
        }
    }

    /// Call `visit` for each point that touches an owned point, in ascending order of ids. The arguments
    /// are the block of the other point and the contact force on the owned point.
    fn for_each_touch(
        &self,
        model: &Model<D>,
        fields: &Fields<D>,
        point: usize,
        mut visit: impl FnMut(usize, Touch<D>),
    ) {
        self.for_each_candidate(model, fields, point, |here, there, block, rule| {
            if let Some(touch) = rule.touch(here, there) {
                visit(block, touch);
            }
        });
    }

    /// Sum the contact forces on a point. The step limits also include contacts that will begin within the
    /// time `look_ahead` (s).
    fn point_sum(
        &self,
        model: &Model<D>,
        fields: &Fields<D>,
        point: usize,
        look_ahead: f64,
    ) -> PointSum<D> {
        let mut sum = PointSum {
            repulsion: [0.0; D],
            damping: [0.0; D],
            friction: [0.0; D],
            of_rigid: [0.0; D],
            energy: 0.0,
            demand: Demand::default(),
            touches: false,
            depth: 0.0,
        };
        self.for_each_candidate(model, fields, point, |here, there, _, rule| {
            sum.add_demand(rule.demand(here, there, (look_ahead, MOST_GAP * self.largest)));
            if let Some(touch) = rule.touch(here, there) {
                // The sum of the other point contains the other half of the energy.
                sum.add(&touch, 0.5);
                sum.depth = sum.depth.max(touch.depth);
            }
        });
        if !self.rigid.is_empty() {
            let (block, here) = self.point(model, fields, point);
            for rigid in &self.rigid {
                sum.add_demand(rigid.demand(block, &here, look_ahead));
                if let Some(touch) = rigid.touch(block, &here) {
                    sum.add(&touch, 1.0);
                    for d in 0..D {
                        sum.of_rigid[d] +=
                            touch.repulsion[d] + touch.damping[d] + touch.friction[d];
                    }
                }
            }
        }
        sum
    }
}

/// Thermal stretch of the point with this index; 0 in runs without temperatures.
fn stretch_of(thermal_stretch: Option<&Vec<f64>>, index: usize) -> f64 {
    thermal_stretch.map_or(0.0, |column| column[index])
}

impl<const D: usize> PointSum<D> {
    /// Add the force of a contact, and the fraction `share` of the energy of this contact.
    fn add(&mut self, touch: &Touch<D>, share: f64) {
        for d in 0..D {
            self.repulsion[d] += touch.repulsion[d];
            self.damping[d] += touch.damping[d];
            self.friction[d] += touch.friction[d];
        }
        self.energy += share * touch.energy;
        self.touches = true;
    }

    fn add_demand(&mut self, demand: Option<Demand>) {
        if let Some(Demand { stiffness, damping }) = demand {
            self.demand.stiffness += stiffness;
            self.demand.damping += damping;
        }
    }
}
