//! Triggers of refinement: which points are refined during a run, and when.

use crate::comm::all_gather_many;
use crate::error::{Error, Result};
use crate::expression::Expression;
use crate::points::bins::Bins;
use crate::problem::{Action, Problem, Selector, Trigger};
use crate::refine::NodeKey;
use crate::solver::Simulation;
use crate::solver::observers::Snapshot;

/// An owned point or ghost that triggers refinement or has broken bonds. Points within the horizon of a
/// triggering point are refined. Points within the horizon of a triggering point, or of a point with broken
/// bonds, are not coarsened.
struct Source {
    position: [f64; 3],
    horizon: f64,
}

/// The nodes to refine and the nodes to coarsen, over all ranks.
pub struct Wanted {
    /// Nodes at which the grid is refined.
    pub finer: Vec<NodeKey>,
    /// Nodes at which the grid is coarsened.
    pub coarser: Vec<NodeKey>,
}

/// Smallest damage that is not round-off.
const LEAST_DAMAGE: f64 = 1e-9;

/// Maximum number of grid positions in the box that encloses the horizon of a refined point. The search for
/// coarser nodes visits all of these positions.
const MOST_PLACES: f64 = 1e4;

/// Check that a run supports the refinement of its problem.
///
/// # Errors
/// If the horizon contains too many spacings, if initial values are read from a file, or if loads or
/// temperatures act on sets given by ids or by groups of meshes. With a trigger, also if strengths
/// scatter, or if the run has load steps or an adaptive step.
pub fn is_possible(problem: &Problem) -> Result<()> {
    let Some(refinement) = &problem.refinement else {
        return Ok(());
    };
    let dimension = problem.dimension.count();
    for block in problem.blocks().filter(|block| block.level > 0) {
        let Some(edges) = block.spacing() else {
            continue;
        };
        let places = edges[..dimension]
            .iter()
            .map(|edge| 2.0 * (block.horizon / edge).floor() + 1.0);
        if places.product::<f64>() > MOST_PLACES {
            let spacings = block.horizon / edges[0];
            let message = format!(
                "[grid] horizon: the horizon of level {} would be {spacings:.4e} spacings, too many for a refined \
                 grid; check that `horizon` is in metres",
                block.level
            );
            return Err(Error::input(message).at(&problem.spans.horizon));
        }
    }
    let mut initials = problem.initials.iter();
    let of_file = initials.find_map(|initial| Some((initial, initial.file.as_ref()?)));
    if let Some((initial, file)) = of_file {
        let message = format!(
            "[initial.{}] file: is not available with [refinement], whose points have other ids; use expressions",
            initial.name
        );
        return Err(Error::input(message).at(&file.span));
    }
    let mut scattered = (problem.bodies.iter())
        .filter(|body| (body.damage.as_ref()).is_some_and(|damage| damage.weibull.is_some()));
    if let (Some(_), Some(body)) = (&refinement.trigger, scattered.next()) {
        let message = format!(
            "[body.{}] damage: `weibull_modulus` is not available with [refinement.trigger], which gives points new ids; \
             refine regions from the start",
            body.name
        );
        return Err(Error::input(message).at(&body.span));
    }
    let by_new_points = |action: &Action| match action {
        Action::BodyForce(..) | Action::Force(_) => Some("a load"),
        Action::Temperature(_) => Some("a temperature"),
        Action::Displacement(_) | Action::Velocity(_) => None,
    };
    let is_by_ids = |set: usize| {
        let selector = &problem.sets[set].selector;
        matches!(selector, Selector::Ids { .. } | Selector::Mesh(_))
    };
    let mut conditions = problem.conditions.iter();
    let found = conditions.find_map(|condition| {
        let what = by_new_points(&condition.action)?;
        is_by_ids(condition.set).then_some((condition, what))
    });
    if let Some((condition, what)) = found {
        let message = format!(
            "[condition.{}] set: {what} on points given by their ids cannot follow a refined grid; give \
             the set by `where`",
            condition.name
        );
        return Err(Error::input(message).at(&condition.span));
    }
    let Some(trigger) = &refinement.trigger else {
        return Ok(());
    };
    let mut methods = (problem.all_stages().into_iter()).map(|stage| stage.time.method);
    let other = if let Some(method) = methods.find(|method| method.load_steps().is_some()) {
        &format!("method = \"{}\"", method.name())
    } else if problem.adapts() {
        "an adaptive step"
    } else {
        return Ok(());
    };
    let message = format!(
        "[refinement.trigger]: is not available with {other}; refine `[refinement.region]` from the start"
    );
    Err(Error::input(message).at(&trigger.span))
}

impl<'a, const D: usize> Simulation<'a, D> {
    pub(super) fn trigger(&self) -> Option<&'a Trigger> {
        self.problem.refinement_trigger()
    }

    /// Whether points may be created during the run.
    pub fn may_refine(&self) -> bool {
        self.trigger().is_some()
    }

    /// For each point within the horizon of a triggering point, select the node to refine. For each refined
    /// point that meets the condition of [`Trigger::coarsen_after`], select the node to coarsen. Collective.
    pub(super) fn wanted(&mut self, trigger: &Trigger, snapshot: &Snapshot) -> Wanted {
        let triggers = self.triggers(trigger, snapshot);
        let sources = self.sources(&triggers);
        let pick = |block, position| self.grids.refining(block, position);
        // Without coarsening, points that cannot be refined further are not checked.
        let matters =
            |block, position| trigger.coarsen_after.is_some() || pick(block, position).is_some();
        let near_trigger = self.near_any(&sources, matters);
        let finer = self.picks(&near_trigger, pick);
        let mut coarser = Vec::new();
        if let Some(limit) = trigger.coarsen_after {
            let is_damaged =
                |point| snapshot.damage(&self.undeformed.family_volume, point) > LEAST_DAMAGE;
            let damaged: Vec<bool> = (0..self.model.owned()).map(is_damaged).collect();
            let sources = self.sources(&damaged);
            let near_damage = self.near_any(&sources, |_, _| true);
            let now = self.clock.time();
            let last = self.fields.last_seen.iter_mut().flatten();
            let to_coarsen = last.zip(near_trigger.iter().zip(near_damage)).map(
                |(last, (near_trigger, near_damage))| {
                    if *near_trigger || near_damage {
                        *last = now;
                    }
                    now - *last >= limit
                },
            );
            let to_coarsen: Vec<bool> = to_coarsen.collect();
            coarser = self.picks(&to_coarsen, |block, position| {
                self.grids.coarsening(self.problem.body_of(block), position)
            });
        }
        Wanted { finer, coarser }
    }

    /// Return the nodes that `pick` selects for the marked points of all ranks. `pick` takes the block and
    /// the position (m) of a point. Collective.
    fn picks(
        &self,
        marked: &[bool],
        pick: impl Fn(usize, [f64; 3]) -> Option<NodeKey>,
    ) -> Vec<NodeKey> {
        let model = &self.model;
        let points = (0..model.owned()).filter(|point| marked[*point]);
        let own = points.filter_map(|k| pick(usize::from(model.block[k]), model.position(k)));
        all_gather_many(self.comm, &own.collect::<Vec<_>>())
    }

    /// Mark the owned points that trigger refinement. Collective.
    fn triggers(&self, trigger: &Trigger, snapshot: &Snapshot) -> Vec<bool> {
        let model = &self.model;
        let least_energy = trigger.energy.map(|share| {
            let mut most = [0.0_f64];
            for energy in &snapshot.stored.energy {
                most[0] = most[0].max(*energy);
            }
            self.comm.max(&mut most);
            share * most[0]
        });
        let time = self.clock.time();
        let holds = |condition: &Expression, point| condition.is_true(model.position(point), time);
        let is_trigger = |point: usize| {
            if trigger
                .only
                .as_ref()
                .is_some_and(|only| !holds(only, point))
            {
                return false;
            }
            let has_energy = |least: f64| {
                let energy = snapshot.stored.energy[point];
                energy >= least && energy > 0.0
            };
            let damage = || snapshot.damage(&self.undeformed.family_volume, point);
            least_energy.is_some_and(has_energy)
                || trigger.damage.is_some_and(|least| damage() >= least)
                || (trigger.condition.as_ref()).is_some_and(|condition| holds(condition, point))
        };
        (0..model.owned()).map(is_trigger).collect()
    }

    /// Return the marked points among the owned points and ghosts, with their horizons. `marked` has an entry
    /// for each owned point. The owned points and ghosts of a rank include all points within the length of
    /// the longest bond from its owned points. The result therefore contains every source whose horizon
    /// includes an owned point. Collective.
    fn sources(&mut self, marked: &[bool]) -> Vec<Source> {
        let model = &self.model;
        // 0 for points that are not marked.
        let mut horizons = vec![0.0; model.volume.len()];
        for (point, horizon) in horizons[..model.owned()].iter_mut().enumerate() {
            if marked[point] {
                *horizon = self.problem.block(usize::from(model.block[point])).horizon;
            }
        }
        self.forces.update_ghosts(self.comm, &mut [&mut horizons]);
        let sources = horizons.into_iter().enumerate();
        let sources = sources.filter(|(_, horizon)| *horizon > 0.0);
        sources
            .map(|(point, horizon)| Source {
                position: self.model.position(point),
                horizon,
            })
            .collect()
    }

    /// Mark the owned points within the horizon of a source. Only points for which `matters(block, position)`
    /// is true are checked.
    fn near_any(&self, sources: &[Source], matters: impl Fn(usize, [f64; 3]) -> bool) -> Vec<bool> {
        let model = &self.model;
        let longest = sources
            .iter()
            .map(|source| source.horizon)
            .fold(0.0, f64::max);
        if longest == 0.0 {
            return vec![false; model.owned()];
        }
        let places: Vec<[f64; 3]> = sources.iter().map(|source| source.position).collect();
        let bins = Bins::new(&places, longest * (1.0 + 1e-9));
        let is_near = |point: usize| {
            let position = model.position(point);
            if !matters(usize::from(model.block[point]), position) {
                return false;
            }
            let mut is_within = false;
            bins.within(position, |source, square| {
                let horizon = sources[source as usize].horizon * (1.0 + 1e-9);
                is_within |= square <= horizon * horizon;
            });
            is_within
        };
        (0..model.owned()).map(is_near).collect()
    }
}
