//! Which points of other ranks a rank needs, and the order of its own.
//!
//! Ranks first swap the points of cells that touch one another's, then each asks for those that lie
//! within the cut-off of one of its own.

use std::collections::BTreeSet;
use std::ops::Range;

use crate::comm::halo::Neighbour;
use crate::comm::{Communicator, Halo};
use crate::points::Point;
use crate::points::bins::Bins;

use super::cells::Cells;
use super::domain::Domain;
use super::graph::NOBODY;
use super::received;

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
    owned.sort_by_cached_key(|point| (cells.order(point.position), point.id));
    let (offers, edge) = offers(comm, cells, owner, &owned);
    let offered = comm.all_to_all(offers);

    let positions: Vec<[f64; 3]> = edge.iter().map(|k| owned[*k as usize].position).collect();
    let bins = Bins::new(&positions, cutoff);
    let mut border = vec![false; owned.len()];
    let mut ghosts = Vec::new();
    // The ids of the ghosts of each rank, and where they will lie.
    let mut wanted = Vec::new();
    for bytes in offered {
        let mut candidates: Vec<Point> = received(&bytes).collect();
        candidates.retain(|candidate| {
            let mut needed = false;
            bins.within(candidate.position, |index, _| {
                border[edge[index as usize] as usize] = true;
                needed = true;
            });
            needed
        });
        candidates.sort_unstable_by_key(|ghost| ghost.id);
        let first = owned.len() + ghosts.len();
        let ids: Vec<u64> = candidates.iter().map(|ghost| ghost.id).collect();
        wanted.push((ids, first..first + candidates.len()));
        ghosts.extend(candidates);
    }

    // Interior points, then those on the border, each part in the order that it had.
    let mut on_border = border.iter();
    let last: Vec<Point> = owned
        .extract_if(.., |_| *on_border.next().expect("one for each point"))
        .collect();
    let interior = owned.len();
    let halo = halo(comm, wanted, &last, interior);
    owned.extend(last);
    let count = owned.len();
    owned.extend(ghosts);
    Domain {
        points: owned,
        interior,
        owned: count,
        total,
        extent: cells.extent(),
        halo,
    }
}

/// For each rank the points of the cells that touch one of its own, and the indices of all points
/// that are offered to any: no others can have ghosts for neighbours. Points lie cell by cell.
fn offers(
    comm: &dyn Communicator,
    cells: &Cells,
    owner: &[u32],
    owned: &[Point],
) -> (Vec<Vec<u8>>, Vec<u32>) {
    let mut offers = vec![Vec::new(); comm.size()];
    let mut edge = Vec::new();
    let mut first = 0;
    let cell = |point: &Point| cells.of(point.position);
    for points in owned.chunk_by(|a, b| cell(a) == cell(b)) {
        let adjacent = cells.adjacent(cell(&points[0]));
        let touching: BTreeSet<usize> = adjacent
            .map(|(other, _)| owner[other])
            .filter(|other| *other != NOBODY)
            .map(|other| other as usize)
            .filter(|other| *other != comm.rank())
            .collect();
        for other in &touching {
            offers[*other].extend_from_slice(bytemuck::cast_slice(points));
        }
        let end = first + points.len() as u32;
        if !touching.is_empty() {
            edge.extend(first..end);
        }
        first = end;
    }
    (offers, edge)
}

/// The halo plan: what this rank wants of each rank, by id, and where that lies; `border` are the
/// points that others can want, the first of which has the local index `interior`. Collective.
fn halo(
    comm: &dyn Communicator,
    wanted: Vec<(Vec<u64>, Range<usize>)>,
    border: &[Point],
    interior: usize,
) -> Halo {
    let mut by_id: Vec<(u64, u32)> = border
        .iter()
        .zip(interior as u32..)
        .map(|(point, index)| (point.id, index))
        .collect();
    by_id.sort_unstable();
    let requests = wanted
        .iter()
        .map(|(ids, _)| bytemuck::cast_slice(ids).to_vec());
    let requested = comm.all_to_all(requests.collect());
    let neighbours = requested.iter().zip(wanted).enumerate();
    let neighbours = neighbours.map(|(rank, (bytes, (_, receive)))| {
        let index = |id: u64| {
            let found = by_id.binary_search_by_key(&id, |(id, _)| *id);
            by_id[found.expect("distance is symmetric, so a ghost is a border point")].1
        };
        let ids: Vec<u64> = bytemuck::pod_collect_to_vec(bytes);
        Neighbour {
            rank,
            send: ids.into_iter().map(index).collect(),
            receive,
        }
    });
    let talks = |neighbour: &Neighbour| !neighbour.send.is_empty() || !neighbour.receive.is_empty();
    Halo::new(neighbours.filter(talks).collect(), HALO_WIDTH)
}
