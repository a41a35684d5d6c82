//! Crack paths and their lengths. A crack path consists of the centre lines of the damage that starts at a
//! given position.

use bytemuck::{Pod, Zeroable};

use crate::comm::all_gather_many;
use crate::error::Result;
use crate::problem;
use crate::solver::Simulation;

use super::centre_line::{Branch, Damaged, Reach, branches};
use super::crack_points::{horizon_of, link, points_of, spacings};

/// Lower limit of the connection distance, in spacings. Two damaged points are connected if they are at most
/// the connection distance apart. With this limit, diagonal neighbours are connected for any horizon.
pub(super) const DIAGONAL: f64 = 1.5;

/// A crack whose path is tracked.
pub struct CrackPath {
    rule: problem::CrackPath,
    points: Vec<u32>,
    reach: Reach,
}

/// A point whose damage exceeds the threshold, as sent to all ranks.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Found {
    id: u64,
    place: [f64; 3],
    damage: f64,
}

impl CrackPath {
    /// Find the points of the set in which the crack path is tracked. Collective.
    ///
    /// # Errors
    /// If the set is empty; the error is the same on all ranks.
    pub fn new<const D: usize>(
        simulation: &Simulation<'_, D>,
        rule: &problem::CrackPath,
    ) -> Result<Self> {
        let points = points_of(simulation, rule)?;
        let horizon = horizon_of(simulation, &points);
        let [_, largest] = spacings(simulation);
        let link = link(horizon, DIAGONAL * largest);
        let reach = Reach {
            link,
            section_length: horizon.max(link),
        };
        Ok(Self {
            rule: rule.clone(),
            points,
            reach,
        })
    }

    /// Name of the crack.
    pub fn name(&self) -> &str {
        &self.rule.name
    }

    /// Find the branches of the crack for the given damage of the owned points. The result is bitwise the
    /// same on all ranks, and for any number of ranks. Collective.
    pub fn branches<const D: usize>(
        &self,
        simulation: &Simulation<'_, D>,
        damage: impl Fn(usize) -> f64,
    ) -> Vec<Branch> {
        let (model, comm) = (&simulation.model, simulation.comm);
        let found = |point: &u32| {
            let point = *point as usize;
            let damage = damage(point);
            (damage > self.rule.threshold).then(|| Found {
                id: model.ids[point],
                place: model.position(point),
                damage,
            })
        };
        let own: Vec<Found> = self.points.iter().filter_map(found).collect();
        let mut found = all_gather_many(comm, &own);
        found.sort_unstable_by_key(|found| found.id);
        let damaged: Vec<Damaged> = found
            .into_iter()
            .map(|Found { place, damage, .. }| Damaged {
                place,
                weight: damage,
            })
            .collect();
        branches(self.rule.from, &damaged, self.reach)
    }
}
