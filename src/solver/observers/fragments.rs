//! Fragments: sets of points that intact bonds connect.

use std::collections::BTreeMap;

use bytemuck::{Pod, Zeroable};

use crate::comm::sum::{ExactSum, reduce};
use crate::comm::{Found, least};
use crate::solver::Simulation;

/// The present fragments; the same on all ranks.
#[derive(Debug, Clone, Default)]
pub struct Fragments {
    /// Number of fragments with two or more points.
    pub count: u64,
    /// Number of points without intact bonds.
    pub loose: u64,
    /// Mass of the largest fragment, kg. The largest fragment is the fragment with the most points; among
    /// several such fragments, the one with the smallest id.
    pub largest_mass: f64,
    /// Momentum of the largest fragment by component, kg m/s.
    pub largest_momentum: Vec<f64>,
}

/// Id of a fragment, and number of its points on one rank.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Share {
    fragment: u64,
    points: u64,
}

impl Fragments {
    /// Find the present fragments of a simulation. Collective.
    pub fn now<const D: usize>(simulation: &mut Simulation<'_, D>) -> Self {
        let ids = simulation.fragment_ids();
        let (comm, model) = (simulation.comm, &simulation.model);
        let mut own: BTreeMap<u64, u64> = BTreeMap::new();
        for id in &ids {
            *own.entry(*id as u64).or_default() += 1;
        }
        // Each fragment is assigned to a rank, which counts the points of the fragment.
        let mut outgoing = vec![Vec::new(); comm.size()];
        for (fragment, points) in own {
            let home = (fragment % comm.size() as u64) as usize;
            outgoing[home].extend_from_slice(bytemuck::bytes_of(&Share { fragment, points }));
        }
        let mut sizes: BTreeMap<u64, u64> = BTreeMap::new();
        for bytes in comm.all_to_all(outgoing) {
            for share in bytemuck::pod_collect_to_vec::<u8, Share>(&bytes) {
                *sizes.entry(share.fragment).or_default() += share.points;
            }
        }
        let loose = sizes.values().filter(|points| **points == 1).count() as u64;
        let mut counts = [sizes.len() as u64 - loose, loose];
        comm.sum(&mut counts);
        let largest = sizes.iter().map(|(fragment, points)| Found {
            key: -(*points as f64),
            ids: [*fragment],
            payload: (),
        });
        let largest = largest.min_by(|a, b| a.key.total_cmp(&b.key).then(a.ids.cmp(&b.ids)));
        let largest = least(comm, largest).map(|found| found.ids[0] as f64);
        // The first sum is the mass; the others are the momentum.
        let mut sums = vec![ExactSum::ZERO; 1 + D];
        let members = ids
            .iter()
            .enumerate()
            .filter(|(_, id)| Some(**id) == largest);
        for (point, _) in members {
            let mass = model.density_of(point) * model.volume[point];
            sums[0].add(mass);
            for (d, sum) in sums[1..].iter_mut().enumerate() {
                sum.add(mass * simulation.fields.velocity[d][point]);
            }
        }
        let sums = reduce(comm, &mut sums);
        Self {
            count: counts[0],
            loose: counts[1],
            largest_mass: sums[0],
            largest_momentum: sums[1..].to_vec(),
        }
    }
}
