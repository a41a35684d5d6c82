//! Which points of other ranks a rank needs, and the order of its own.
//!
//! Ranks first swap the points of cells that touch one another's, then each asks for those that lie
//! within the cut-off of one of its own.

use std::collections::BTreeSet;

use crate::comm::halo::Neighbour;
use crate::comm::{Communicator, Halo};
use crate::points::Point;
use crate::points::bins::Bins;

use super::cells::Cells;
use super::domain::Domain;

/// The widest message: three components a point.
const HALO_WIDTH: usize = 3;

/// Finds the ghosts, orders the owned points and makes the halo plan.
///
/// `owned` are this rank's points after migration, `owner` the rank of each cell, `cutoff` (m) the
/// longest bond.
pub fn domain(
    comm: &dyn Communicator,
    cells: &Cells,
    owner: &[u32],
    mut owned: Vec<Point>,
    total: u64,
    cutoff: f64,
) -> Domain {
    let rank = comm.rank();
    let mut offers = vec![Vec::new(); comm.size()];
    let mut touching = BTreeSet::new();
    for point in &owned {
        let cell = cells.of(point.position);
        touching.clear();
        touching.extend(
            cells
                .adjacent(cell)
                .map(|(other, _)| owner[other] as usize)
                .filter(|other| *other != rank),
        );
        for other in &touching {
            offers[*other].extend_from_slice(bytemuck::bytes_of(point));
        }
    }
    let offered: Vec<Vec<Point>> = comm
        .all_to_all(offers)
        .iter()
        .map(|bytes| bytemuck::pod_collect_to_vec(bytes))
        .collect();

    let positions: Vec<[f64; 3]> = owned.iter().map(|point| point.position).collect();
    let bins = Bins::new(&positions, cutoff);
    let mut border = vec![false; owned.len()];
    let mut ghosts = Vec::new();
    let mut requests = vec![Vec::new(); comm.size()];
    let mut received_from = Vec::new();
    for (other, mut candidates) in offered.into_iter().enumerate() {
        candidates.retain(|candidate| {
            let mut needed = false;
            bins.within(candidate.position, |index, _| {
                border[index as usize] = true;
                needed = true;
            });
            needed
        });
        if candidates.is_empty() {
            continue;
        }
        candidates.sort_unstable_by_key(|ghost| ghost.id);
        let ids: Vec<u64> = candidates.iter().map(|ghost| ghost.id).collect();
        requests[other] = bytemuck::cast_slice(&ids).to_vec();
        let first = owned.len() + ghosts.len();
        received_from.push((other, first..first + candidates.len()));
        ghosts.extend(candidates);
    }

    let mut order: Vec<u32> = (0..owned.len() as u32).collect();
    order.sort_unstable_by_key(|k| {
        let point = &owned[*k as usize];
        (border[*k as usize], cells.of(point.position), point.id)
    });
    let interior = border.iter().filter(|border| !**border).count();
    owned = order.iter().map(|k| owned[*k as usize]).collect();

    let mut by_id: Vec<(u64, u32)> = owned[interior..]
        .iter()
        .zip(interior as u32..)
        .map(|(point, index)| (point.id, index))
        .collect();
    by_id.sort_unstable();
    let mut neighbours = Vec::new();
    let mut ranges = received_from.into_iter().peekable();
    for (other, bytes) in comm.all_to_all(requests).iter().enumerate() {
        let wanted: Vec<u64> = bytemuck::pod_collect_to_vec(bytes);
        let send: Vec<u32> = wanted
            .iter()
            .map(|id| {
                let found = by_id.binary_search_by_key(id, |(id, _)| *id);
                by_id[found.expect("distance is symmetric, so a ghost is a border point")].1
            })
            .collect();
        let receive = ranges
            .next_if(|(from, _)| *from == other)
            .map_or(0..0, |(_, range)| range);
        if !send.is_empty() || !receive.is_empty() {
            neighbours.push(Neighbour {
                rank: other,
                send,
                receive,
            });
        }
    }
    Domain {
        interior,
        owned: owned.len(),
        total,
        halo: Halo::new(neighbours, HALO_WIDTH),
        points: [owned, ghosts].concat(),
    }
}
