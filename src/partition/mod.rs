//! Domain decomposition: cells, graph partitioning with METIS, migration and ghosts.

mod cells;
mod domain;
mod ghosts;
mod graph;

pub use domain::Domain;

use crate::comm::{Communicator, agree};
use crate::error::Result;
use crate::points::Point;

use cells::{Cells, Loads, max_cells};

/// Partition the points, migrate them to their owners and find the ghosts. Collective.
///
/// `pieces` are this rank's points, `total` is the number of points of all ranks, and `cutoff` (m) is
/// slightly longer than the longest bond.
///
/// # Errors
/// If METIS fails; the error is the same on all ranks.
pub fn distribute(
    comm: &dyn Communicator,
    pieces: Vec<Point>,
    total: u64,
    cutoff: f64,
) -> Result<Domain> {
    distribute_by_time(comm, pieces, total, cutoff, None)
}

/// Same as [`distribute`], with the measured computing time of this rank's points (ns). The weight of a cell
/// is multiplied by the time per bond of the present owner of the cell. Parts are numbered so that few points
/// migrate.
///
/// # Errors
/// Same as for [`distribute`].
pub fn distribute_by_time(
    comm: &dyn Communicator,
    pieces: Vec<Point>,
    total: u64,
    cutoff: f64,
    time: Option<u64>,
) -> Result<Domain> {
    let most = max_cells(comm.size());
    distribute_by_cells(comm, pieces, total, cutoff, most, time)
}

/// Same as [`distribute_by_time`], with at most `most` partition cells.
fn distribute_by_cells(
    comm: &dyn Communicator,
    pieces: Vec<Point>,
    total: u64,
    cutoff: f64,
    most: usize,
    time: Option<u64>,
) -> Result<Domain> {
    let cells = Cells::new(comm, &pieces, total, cutoff, most);
    let occupation = cells.occupation(comm, &pieces);
    let time = time.filter(|_| comm.size() > 1);
    let loads = time.map(|time| cells.loads(comm, &pieces, time));
    let owner = owners(comm, &cells, &occupation, loads.as_ref())?;
    drop(loads);
    drop(occupation);
    let owned = migrate(comm, &cells, &owner, pieces);
    Ok(ghosts::domain(comm, &cells, &owner, owned, total, cutoff))
}

/// The owner of each cell, computed by rank 0 and broadcast.
fn owners(
    comm: &dyn Communicator,
    cells: &Cells,
    occupation: &[u64],
    loads: Option<&Loads>,
) -> Result<Vec<u32>> {
    if comm.size() == 1 {
        return Ok(vec![0; cells.count()]);
    }
    let found = match comm.rank() {
        0 => graph::partition(cells, occupation, loads, comm.size()),
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

/// Decode the points of a message from another rank.
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
        fn every_point_has_one_owner_and_all_its_neighbours(
            seed in prop::collection::vec(prop::array::uniform3(0.0..4.0_f64), 1..120),
            ranks in 1_usize..5,
            most in 1_usize..100,
        ) {
            let all = cloud(&seed);
            let domains = threads::run(ranks, |comm| {
                let start = |rank: usize| all.len() * rank / ranks;
                let piece = all[start(comm.rank())..start(comm.rank() + 1)].to_vec();
                let total = all.len() as u64;
                let mut domain = distribute_by_cells(comm, piece, total, 1.0, most, None).unwrap();
                // Each entry is the id of its point, so the exchange must reproduce the entries of the
                // ghosts.
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
                for (index, i) in domain.points[..domain.owned].iter().enumerate() {
                    for j in &all {
                        if distance_squared(i.position, j.position) <= 1.0 {
                            let local = domain.points.iter().position(|p| p.id == j.id);
                            prop_assert!(local.is_some());
                            prop_assert!(index >= domain.interior || local < Some(domain.owned));
                        }
                    }
                }
            }
            owned.sort_unstable();
            prop_assert_eq!(owned, (0..all.len() as u64).collect::<Vec<_>>());
        }
    }
}
