//! Dealing out points to ranks: cells, METIS, migration, ghosts.

mod cells;
mod domain;
mod ghosts;
mod graph;

pub use domain::Domain;

use crate::comm::{Communicator, agree};
use crate::error::Result;
use crate::points::Point;

use cells::{Cells, Present, most_cells};

/// Moves the pieces that the ranks made to the ranks that will own them, and finds the ghosts.
///
/// `total` counts the points of all ranks, `cutoff` (m) is the length of the longest bond.
///
/// # Errors
/// When METIS fails; the same on all ranks.
pub fn distribute(
    comm: &dyn Communicator,
    pieces: Vec<Point>,
    total: u64,
    cutoff: f64,
) -> Result<Domain> {
    distribute_by_cost(comm, pieces, total, cutoff, None)
}

/// As [`distribute`]. Where the ranks know what their points cost, cells are weighted by that, and as many
/// points as possible stay where they are.
///
/// # Errors
/// As [`distribute`].
pub fn distribute_by_cost(
    comm: &dyn Communicator,
    pieces: Vec<Point>,
    total: u64,
    cutoff: f64,
    cost: Option<Cost>,
) -> Result<Domain> {
    let most = most_cells(comm.size());
    distribute_by_cells(comm, pieces, total, cutoff, most, cost)
}

/// What the points of a rank cost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cost {
    /// Of each of them, ns.
    each: u64,
}

impl Cost {
    /// So many points that took so much time, ns.
    pub fn of(time: u64, points: usize) -> Self {
        Self {
            each: (time / points.max(1) as u64).max(1),
        }
    }
}

/// As [`distribute_by_cost`], with so many cells at most.
fn distribute_by_cells(
    comm: &dyn Communicator,
    pieces: Vec<Point>,
    total: u64,
    cutoff: f64,
    most: usize,
    cost: Option<Cost>,
) -> Result<Domain> {
    let cells = Cells::new(comm, &pieces, total, cutoff, most);
    let occupation = cells.occupation(comm, &pieces);
    let known = cost.filter(|_| comm.size() > 1);
    let known = known.map(|cost| cells.present(comm, &pieces, cost.each));
    let owner = owners(comm, &cells, &occupation, known.as_ref())?;
    drop(known);
    drop(occupation);
    let owned = migrate(comm, &cells, &owner, pieces);
    Ok(ghosts::domain(comm, &cells, &owner, owned, total, cutoff))
}

/// The rank of each cell, from rank 0 to all: 4 bytes a cell.
fn owners(
    comm: &dyn Communicator,
    cells: &Cells,
    occupation: &[u64],
    present: Option<&Present>,
) -> Result<Vec<u32>> {
    if comm.size() == 1 {
        return Ok(vec![0; cells.count()]);
    }
    let found = match comm.rank() {
        0 => graph::partition(cells, occupation, present, comm.size()),
        _ => Ok(Vec::new()),
    };
    let mut bytes = bytemuck::cast_slice(&agree(comm, found)?).to_vec();
    comm.broadcast(0, &mut bytes);
    Ok(bytemuck::pod_collect_to_vec(&bytes))
}

fn migrate(
    comm: &dyn Communicator,
    cells: &Cells,
    owner: &[u32],
    pieces: Vec<Point>,
) -> Vec<Point> {
    if comm.size() == 1 {
        return pieces;
    }
    let mut outgoing = vec![Vec::new(); comm.size()];
    let mut owned = pieces;
    owned.retain(|point| {
        let rank = owner[cells.of(point.position)] as usize;
        if rank != comm.rank() {
            outgoing[rank].extend_from_slice(bytemuck::bytes_of(point));
        }
        rank == comm.rank()
    });
    owned.shrink_to_fit();
    for bytes in comm.all_to_all(outgoing) {
        owned.extend(received(&bytes));
    }
    owned
}

/// The points in a message.
fn received(bytes: &[u8]) -> impl Iterator<Item = Point> {
    let records = bytes.chunks_exact(size_of::<Point>());
    records.map(bytemuck::pod_read_unaligned)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use crate::points::distance_squared;
    use proptest::prelude::*;

    fn cloud(seed: &[[f64; 3]]) -> Vec<Point> {
        seed.iter()
            .zip(0..)
            .map(|(position, id)| Point::new(id, *position, 1.0, 0))
            .collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn every_point_has_one_owner_and_sees_all_its_neighbours(
            seed in prop::collection::vec(prop::array::uniform3(0.0..4.0_f64), 1..120),
            ranks in 1_usize..5,
            most in 1_usize..100,
        ) {
            let all = cloud(&seed);
            let domains = threads::run(ranks, |comm| {
                let share = |rank: usize| all.len() * rank / ranks;
                let piece = all[share(comm.rank())..share(comm.rank() + 1)].to_vec();
                let total = all.len() as u64;
                let mut domain = distribute_by_cells(comm, piece, total, 1.0, most, None).unwrap();
                // The halo must bring each ghost its own id.
                let mut ids: Vec<f64> = domain.points.iter().map(|p| p.id as f64).collect();
                ids[domain.owned..].fill(-1.0);
                domain.halo.pack([&ids[..]].into_iter());
                domain.halo.exchange(comm, &mut |_| {});
                domain.halo.unpack([&mut ids[..]].into_iter());
                (domain, ids)
            });
            let mut owned: Vec<u64> = Vec::new();
            for (domain, ids) in &domains {
                owned.extend(domain.points[..domain.owned].iter().map(|p| p.id));
                for (point, id) in domain.points.iter().zip(ids) {
                    prop_assert_eq!(point.id as f64, *id);
                    prop_assert_eq!(*point, all[point.id as usize]);
                }
                for (index, here) in domain.points[..domain.owned].iter().enumerate() {
                    for there in &all {
                        if distance_squared(here.position, there.position) <= 1.0 {
                            let place = domain.points.iter().position(|p| p.id == there.id);
                            prop_assert!(place.is_some());
                            prop_assert!(index >= domain.interior || place < Some(domain.owned));
                        }
                    }
                }
            }
            owned.sort_unstable();
            prop_assert_eq!(owned, (0..all.len() as u64).collect::<Vec<_>>());
        }
    }
}
