//! The state of a run in the order of global ids: what a checkpoint holds.
//!
//! Forces, reactions and work are part of it: to evaluate them again would break bonds a second time
//! or round another way.

use crate::comm::IdOrder;
use crate::error::{Error, Result};

use super::Simulation;

/// The state of the points of this rank's block of ids.
#[derive(Debug, Clone, PartialEq)]
pub struct Saved {
    /// Numbers a point: displacement, velocity and force density by component, energy set free,
    /// with damping the energy it took, and with conditions work and reactions.
    pub width: usize,
    /// Row-major, `width` a point.
    pub values: Vec<f64>,
    /// Bytes of bond bits a point.
    pub lengths: Vec<u32>,
    /// The bond bits of the points, one after the other.
    pub bonds: Vec<u8>,
}

impl<const D: usize> Simulation<'_, D> {
    /// Numbers that are saved a point.
    pub fn saved_width(&self) -> usize {
        let conditions = if self.conditions.are_none() { 0 } else { 1 + D };
        3 * D + 1 + usize::from(self.damping.damped) + conditions
    }

    /// The present state, dealt out by id. Collective.
    pub fn save(&self, order: &IdOrder) -> Saved {
        let (owned, width) = (self.model.owned(), self.saved_width());
        let conditions = self.conditions.save();
        let mut values = Vec::with_capacity(owned * width);
        for point in 0..owned {
            let response = &self.state.responses[point];
            values.extend(self.state.displacement.iter().map(|field| field[point]));
            values.extend(self.state.velocity.iter().map(|field| field[point]));
            values.extend(response.force);
            values.push(response.set_free);
            values.extend(self.damping.dissipated.get(point));
            values.extend(
                conditions
                    .iter()
                    .skip((1 + D) * point)
                    .take(if self.conditions.are_none() { 0 } else { 1 + D }),
            );
        }
        let lengths = self.forces.intact_lengths(owned);
        let bonds = self.forces.intact(&lengths);
        let block_lengths = order.collect(self.comm, &lengths, 1);
        Saved {
            width,
            values: order.collect(self.comm, &values, width),
            bonds: order.collect_ragged(self.comm, &bonds, &lengths, &block_lengths),
            lengths: block_lengths,
        }
    }

    /// Goes back to a saved state, after step `number` of steps of `step` (s). Collective.
    ///
    /// # Errors
    /// When the state is that of other points or bonds; the same on all ranks.
    pub fn restore(
        &mut self,
        order: &IdOrder,
        saved: &Saved,
        number: u64,
        step: f64,
    ) -> Result<()> {
        let (owned, width) = (self.model.owned(), self.saved_width());
        let lengths = self.forces.intact_lengths(owned);
        let expected = order.collect(self.comm, &lengths, 1);
        let fits = saved.width == width && saved.lengths == expected;
        crate::comm::agree(
            self.comm,
            match fits {
                true => Ok(()),
                false => Err(Error::run("the checkpoint is that of other bonds")),
            },
        )?;
        let values = order.spread(self.comm, &saved.values, width);
        let bonds = order.spread_ragged(self.comm, &saved.bonds, &lengths, &saved.lengths);
        self.forces.set_intact(&lengths, &bonds);
        let mut conditions = Vec::new();
        for (point, row) in values.chunks_exact(width).enumerate() {
            let (motion, rest) = row.split_at(3 * D);
            for d in 0..D {
                self.state.displacement[d][point] = motion[d];
                self.state.velocity[d][point] = motion[D + d];
                self.state.responses[point].force[d] = motion[2 * D + d];
            }
            self.state.responses[point].set_free = rest[0];
            let rest = self.damping.restore(point, &rest[1..]);
            conditions.extend_from_slice(rest);
        }
        self.forces
            .update_ghosts(self.comm, &mut self.state.displacement);
        self.damping.after_moving(&self.model, &self.state, 0.0);
        self.forces
            .refresh_states(&self.model, &self.state.displacement);
        self.number = number;
        self.step = step;
        self.last = super::simulation::steps_to(self.plan.time.end, step) as u64;
        self.conditions.restore(&conditions, self.time());
        Ok(())
    }
}
