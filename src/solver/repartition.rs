//! Rebalance during a run, when the computing times of the ranks differ too much.
//!
//! Points migrate as in a restart on another number of ranks. The state is redistributed by id, bonds are
//! found again, and their stored data are restored. The result of the run is therefore bitwise independent of
//! rebalances.

use std::time::{Duration, Instant};

use crate::comm::{self, IdOrder, all_gather};
use crate::error::Result;
use crate::points::Point;
use crate::problem::Balance;

use super::model::Model;
use super::{Simulation, Stepper};

/// Result of a rebalance; the same on all ranks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repartition {
    /// Time that the slowest rank spent on bonds since the previous check, divided by the mean over the
    /// ranks.
    pub imbalance: f64,
    /// Number of points that changed their owner.
    pub moved: u64,
    /// Wall-clock time of the rebalance on the slowest rank, s.
    pub seconds: f64,
}

/// Schedule of the checks that compare the computing times of the ranks. The watch also stores the time
/// that this rank had spent on bonds up to the last check.
pub struct BalanceWatch {
    rule: Option<Balance>,
    seen: Duration,
}

impl BalanceWatch {
    /// Create the watch for a run that starts or continues.
    pub fn new<const D: usize>(simulation: &Simulation<'_, D>) -> Self {
        // A single rank is always balanced.
        let rule = simulation
            .problem
            .balance
            .filter(|_| simulation.comm.size() > 1);
        Self {
            rule,
            seen: simulation.times.forces.bonds,
        }
    }

    /// If a check is due and the computing times of the ranks differ too much, rebalance and return the
    /// result; otherwise return `None`. Collective.
    ///
    /// # Errors
    /// If the points cannot be distributed or bonded: for example, if METIS fails or if a rank has too little
    /// memory for its bonds. The error is the same on all ranks. After an error, the run cannot continue,
    /// because its points have been freed.
    pub fn rebalance_if_due<const D: usize>(
        &mut self,
        stepper: &mut Stepper<'_, D>,
    ) -> Result<Option<Repartition>> {
        let Some(rule) = self.rule else {
            return Ok(None);
        };
        let is_due = stepper.clock().number().is_multiple_of(rule.every_steps);
        // All iterations of a load step have the same step number, so the check is made only after the last
        // iteration.
        if !is_due || !stepper.load_step().is_settled {
            return Ok(None);
        }
        let now = stepper.times().forces.bonds;
        let own = (now - self.seen).as_nanos() as u64;
        self.seen = now;
        let all = all_gather(stepper.comm(), own);
        let most = all.iter().copied().max().unwrap_or(0) as f64;
        let mean = all.iter().sum::<u64>() as f64 / all.len() as f64;
        if most <= rule.imbalance * mean {
            return Ok(None);
        }
        let simulation = stepper.at_full_step();
        let start = Instant::now();
        let moved = simulation.repartition(own)?;
        simulation.times.regridding += start.elapsed();
        self.seen = simulation.times.forces.bonds;
        let mut seconds = [start.elapsed().as_secs_f64()];
        simulation.comm.max(&mut seconds);
        Ok(Some(Repartition {
            imbalance: most / mean,
            moved,
            seconds: seconds[0],
        }))
    }
}

impl<const D: usize> Simulation<'_, D> {
    /// Return the owned points as [`Point`] values, the form in which points migrate.
    pub(super) fn owned_points(&self) -> Vec<Point> {
        let model = &self.model;
        let point = |k: usize| {
            let block = usize::from(model.block[k]);
            Point::new(model.ids[k], model.position(k), model.volume[k], block)
        };
        (0..model.owned()).map(point).collect()
    }

    /// Free the memory of points and bonds before a new distribution.
    pub(super) fn release(&mut self) {
        self.model = Model::empty();
        self.forces.release();
        self.contact = None;
        let columns = self.fields.each_mut().flat_map(|(_, columns)| columns);
        columns.for_each(|column| *column = Vec::new());
    }

    /// Create the exchange plan between owned points and ranges of ids. Collective.
    pub fn id_order(&self) -> IdOrder {
        let model = &self.model;
        IdOrder::new(self.comm, &model.ids[..model.owned()], model.coarsest)
    }

    /// Partition the points again. `time` (ns) is the time that this rank has spent on bonds since the last
    /// check. Return the number of points that changed their owner, over all ranks. Collective.
    ///
    /// # Errors
    /// If the points cannot be distributed or bonded: for example, if METIS fails or if a rank has too little
    /// memory for its bonds. The error is the same on all ranks. After an error, the run cannot continue,
    /// because its points have been freed.
    pub fn repartition(&mut self, time: u64) -> Result<u64> {
        let saved = self.save(&self.id_order());
        let points = self.owned_points();
        let mut before: Vec<u64> = points.iter().map(|point| point.id).collect();
        before.sort_unstable();
        self.release();
        let mut other = Self::of_points(
            self.problem,
            self.comm,
            (points, self.grids.clone()),
            Some(time),
            &mut || Ok(()),
        )?;
        let order = other.id_order();
        other.stages.steps.clone_from(&self.stages.steps);
        other.restore(&order, &saved)?;
        other.take_over(self);
        *self = other;
        let ids = &self.model.ids[..self.model.owned()];
        let came = ids.iter().filter(|id| before.binary_search(id).is_err());
        Ok(comm::total(self.comm, came.count() as u64))
    }
}
