//! The ghosts and the halo plan of a rank.
//!
//! If a cell of rank p is adjacent to a cell of rank q, rank p sends the points of its cell to rank q. Rank q
//! then requests some of these points as ghosts: those within the cutoff of a point that rank q owns.

use std::collections::BTreeSet;
use std::ops::Range;

use crate::comm::halo::Neighbour;
use crate::comm::{Communicator, Halo};
use crate::points::Point;
use crate::points::bins::Bins;

use super::cells::Cells;
use super::domain::Domain;
use super::graph::NO_OWNER;
use super::received;

/// Number of values per point for which the halo buffers are allocated: the components of a vector. Exchanges
/// of more values per point enlarge the buffers.
const HALO_WIDTH: usize = 3;

/// Find the ghosts, sort the owned points and build the halo plan. Collective.
///
/// `owned` are this rank's points after migration. `owner` is the rank of each cell. `total` is the number of
/// points of all ranks. `cutoff` (m) is slightly longer than the longest bond.
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
    // For each rank q, the ids of the points of q that become ghosts on this rank, and the local indices of
    // these ghosts.
    let mut requests = Vec::new();
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
        requests.push((ids, first..first + candidates.len()));
        ghosts.extend(candidates);
    }

    // Partition the points into interior and border points, without changing the order within each group.
    let mut is_border = border.iter();
    let border_points: Vec<Point> = owned
        .extract_if(.., |_| *is_border.next().expect("one for each point"))
        .collect();
    let interior = owned.len();
    let halo = halo(comm, requests, &border_points, interior);
    owned.extend(border_points);
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

/// For each other rank, select the points of this rank in cells that are adjacent to cells of the other rank.
/// For each rank, return the selected points as bytes. Also return the indices of all points that are
/// selected for at least one rank. Only these points can have ghosts as neighbours. `owned` is sorted by
/// cell.
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
        let adjacent_ranks: BTreeSet<usize> = adjacent
            .map(|(other, _)| owner[other])
            .filter(|other| *other != NO_OWNER)
            .map(|other| other as usize)
            .filter(|other| *other != comm.rank())
            .collect();
        for other in &adjacent_ranks {
            offers[*other].extend_from_slice(bytemuck::cast_slice(points));
        }
        let end = first + points.len() as u32;
        if !adjacent_ranks.is_empty() {
            edge.extend(first..end);
        }
        first = end;
    }
    (offers, edge)
}

/// Build the halo plan. For each rank, `requests` has the ids and local indices of the ghosts that belong to
/// that rank. `border` are the border points; the first of them has the local index `interior`. Collective.
fn halo(
    comm: &dyn Communicator,
    requests: Vec<(Vec<u64>, Range<usize>)>,
    border: &[Point],
    interior: usize,
) -> Halo {
    let mut by_id: Vec<(u64, u32)> = border
        .iter()
        .zip(interior as u32..)
        .map(|(point, index)| (point.id, index))
        .collect();
    by_id.sort_unstable();
    let outgoing = requests
        .iter()
        .map(|(ids, _)| bytemuck::cast_slice(ids).to_vec());
    let incoming = comm.all_to_all(outgoing.collect());
    let neighbours = incoming.iter().zip(requests).enumerate();
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
    let is_used =
        |neighbour: &Neighbour| !neighbour.send.is_empty() || !neighbour.receive.is_empty();
    Halo::new(neighbours.filter(is_used).collect(), HALO_WIDTH)
}
