//! Neighbour search for list families.

use std::ops::Range;

use rayon::prelude::*;

use crate::lanes::WIDTH;
use crate::memory::check_room;
use crate::partition::Domain;
use crate::points::bins::Bins;
use crate::points::{Point, distance_squared};

use super::fault::{Fault, MOST_NEIGHBOURS};
use super::list::BondList;
use super::neighbours::Neighbours;

/// Relative amount by which the cutoff exceeds the horizon. Without this tolerance, round-off would decide
/// whether two points at a distance of one horizon have a bond.
const HORIZON_TOLERANCE: f64 = 1e-9;

/// Number of points that one task searches.
const CHUNK: usize = 512;

/// Number of chunks that are searched before their rows are appended to the lists. Each of these chunks has a
/// buffer, so this number limits the memory of the buffers.
const WAVE: usize = 32;

/// Return the maximum length (m) of a bond for a horizon (m).
pub fn cutoff(horizon: f64) -> f64 {
    horizon * (1.0 + HORIZON_TOLERANCE)
}

/// The points of a domain, sorted by block, then by global id. The search finds the neighbours of a point
/// separately for each block, as indices into this order. Sorting the indices of one block therefore sorts
/// the neighbours by id.
struct Order {
    /// Local index of the point at each position in this order.
    local: Vec<u32>,
    /// For each block, the position of its first point in this order. The last entry is the number of points.
    first: Vec<u32>,
    /// Bins of the points of each block. In the bins of a block, index k means the point k places after the
    /// first point of the block in this order. Each block has separate bins. Therefore, the neighbour search
    /// of a point skips the blocks that form no bonds with the block of the point.
    bins: Vec<Bins>,
}

impl Order {
    /// Sort the points and build the bins. `cutoffs` is the symmetric `blocks` × `blocks` matrix of maximum
    /// bond lengths, m; 0 for a pair of blocks without bonds.
    fn new(points: &[Point], blocks: usize, cutoffs: &[f64]) -> Self {
        let mut keys: Vec<(u32, u64, u32)> = points
            .iter()
            .zip(0..)
            .map(|(point, index)| (point.block, point.id, index))
            .collect();
        keys.par_sort_unstable();
        let before = |block: u32| keys.partition_point(|key| key.0 < block) as u32;
        let first: Vec<u32> = (0..=blocks as u32).map(before).collect();
        let local: Vec<u32> = keys.iter().map(|key| key.2).collect();
        drop(keys);
        let bins = first.windows(2).enumerate().map(|(block_j, ends)| {
            let cutoffs = cutoffs.iter().skip(block_j).step_by(blocks).copied();
            // The shortest cutoff sets the bin size; searches with longer cutoffs visit more bins.
            let shortest = cutoffs.filter(|cutoff| *cutoff > 0.0).reduce(f64::min);
            let searched = &local[ends[0] as usize..ends[1] as usize];
            let sorted = shortest.map_or(&[][..], |_| searched).iter();
            let positions: Vec<[f64; 3]> = sorted.map(|k| points[*k as usize].position).collect();
            Bins::new(&positions, shortest.unwrap_or(f64::INFINITY))
        });
        Self {
            bins: bins.collect(),
            local,
            first,
        }
    }

    /// Find another point of a block at the same position as the point with local index `index`. If there is
    /// no other point, return the point itself.
    fn other_at(&self, domain: &Domain, block: usize, index: usize) -> Point {
        let sorted = self.first[block] as usize..self.first[block + 1] as usize;
        let points = self.local[sorted].iter().map(|k| *k as usize);
        let position = domain.points[index].position;
        let mut others = points
            .filter(|other| *other != index)
            .map(|k| domain.points[k]);
        let other = others.find(|other| distance_squared(position, other.position) == 0.0);
        other.unwrap_or(domain.points[index])
    }
}

/// The rows that one task found.
#[derive(Default)]
struct Chunk {
    /// For each row: local index of its point, block of the neighbours, and number of groups of bonds.
    rows: Vec<(u32, u32, u32)>,
    neighbours: Neighbours,
    intact: Vec<u8>,
    /// Buffer for the neighbours of one point, as indices in [`Order`].
    sorted: Vec<u32>,
}

/// Build the bond lists of a domain. `cutoffs` is the symmetric `blocks` × `blocks` matrix of longest bonds,
/// m; 0 for a pair of blocks without bonds.
///
/// # Errors
/// If two points coincide, a point has too many neighbours, or memory is insufficient.
pub fn search(domain: &Domain, blocks: usize, cutoffs: &[f64]) -> Result<Vec<BondList>, Fault> {
    let order = Order::new(&domain.points, blocks, cutoffs);
    let squares: Vec<f64> = cutoffs.iter().map(|cutoff| cutoff * cutoff).collect();
    let mut lists: Vec<BondList> = (0..blocks * blocks)
        .map(|pair| BondList {
            block_i: pair / blocks,
            block_j: pair % blocks,
            starts: vec![0],
            ..BondList::default()
        })
        .collect();
    // The chunks are allocated once and reused.
    let mut wave: Vec<Chunk> = (0..WAVE).map(|_| Chunk::default()).collect();
    for first in (0..domain.owned).step_by(WAVE * CHUNK) {
        wave.par_iter_mut().enumerate().try_for_each(|(k, chunk)| {
            let start = (first + k * CHUNK).min(domain.owned);
            let end = (start + CHUNK).min(domain.owned);
            chunk.search(domain, &order, start..end, &squares)
        })?;
        for chunk in &wave {
            append(&mut lists, domain, blocks, chunk);
        }
        let done = (first + WAVE * CHUNK).min(domain.owned);
        check_memory(&lists, done as f64 / domain.owned as f64)?;
    }
    lists.retain(|list| !list.is_empty());
    for list in &mut lists {
        list.points.shrink_to_fit();
        list.starts.shrink_to_fit();
        list.neighbours.shrink_to_fit();
        list.store.intact.shrink_to_fit();
        let largest = list.neighbours.largest().max(list.points.last().copied());
        list.reach = largest.map_or(0, |index| index as usize + 1);
    }
    Ok(lists)
}

/// Return an error if the lists will not fit in memory. `lists` contains the bonds of the fraction `done` of
/// the points. The memory of the complete lists is extrapolated from this fraction.
fn check_memory(lists: &[BondList], done: f64) -> Result<(), Fault> {
    let bytes: usize = lists.iter().map(BondList::bytes).sum();
    let remaining = bytes as f64 * (1.0 / done - 1.0);
    check_room(remaining as u64).map_err(|shortage| {
        let largest = lists.iter().max_by_key(|list| list.bytes());
        let blocks = largest.map_or([0; 2], |list| [list.block_i, list.block_j]);
        Fault::TooLittleMemory { blocks, shortage }
    })
}

impl Chunk {
    /// Replace the rows of the chunk by the rows of a range of points.
    fn search(
        &mut self,
        domain: &Domain,
        order: &Order,
        range: Range<usize>,
        squares: &[f64],
    ) -> Result<(), Fault> {
        self.rows.clear();
        self.neighbours.clear();
        self.intact.clear();
        let blocks = order.first.len() - 1;
        for index in range {
            let point = &domain.points[index];
            let squares = &squares[point.block as usize * blocks..][..blocks];
            let mut neighbours = 0;
            for (block_j, square) in squares.iter().enumerate() {
                if *square == 0.0 {
                    continue;
                }
                let first = order.first[block_j];
                self.sorted.clear();
                let bins = &order.bins[block_j];
                let coincident = bins.collect(point.position, *square, &mut self.sorted);
                if coincident > usize::from(block_j == point.block as usize) {
                    return Err(Fault::SamePlace([
                        *point,
                        order.other_at(domain, block_j, index),
                    ]));
                }
                neighbours += self.sorted.len();
                if neighbours as f64 > MOST_NEIGHBOURS {
                    return Err(Fault::TooManyNeighbours {
                        blocks: [point.block as usize; 2],
                        neighbours: None,
                        spacings: None,
                    });
                }
                if self.sorted.is_empty() {
                    continue;
                }
                self.sorted.sort_unstable();
                self.sorted
                    .iter_mut()
                    .for_each(|sorted_index| *sorted_index += first);
                let groups = self.sorted.len().div_ceil(WIDTH) as u32;
                self.rows.push((index as u32, block_j as u32, groups));
                for group in self.sorted.chunks(WIDTH) {
                    let mut neighbours = [index as u32; WIDTH];
                    for (slot, sorted_index) in neighbours.iter_mut().zip(group) {
                        *slot = order.local[*sorted_index as usize];
                    }
                    self.neighbours.push(neighbours);
                    self.intact.push((0xff_u16 >> (WIDTH - group.len())) as u8);
                }
            }
        }
        Ok(())
    }
}

fn append(lists: &mut [BondList], domain: &Domain, blocks: usize, chunk: &Chunk) {
    let mut group = 0;
    for (point, block_j, groups) in &chunk.rows {
        let block_i = domain.points[*point as usize].block as usize;
        let list = &mut lists[block_i * blocks + *block_j as usize];
        let groups = group..group + *groups as usize;
        group = groups.end;
        list.points.push(*point);
        (list.neighbours).extend(chunk.neighbours.groups(groups.clone()));
        list.store.intact.extend(&chunk.intact[groups]);
        list.starts.push(list.neighbours.len());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use crate::partition::distribute;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn finds_what_comparing_all_pairs_finds(
            cloud in prop::collection::vec((prop::array::uniform3(0.0..3.0_f64), 0..3_usize), 1..150),
            ranks in 1_usize..4,
        ) {
            let all: Vec<Point> = cloud
                .iter()
                .zip(0..)
                .map(|((position, block), id)| Point::new(id, *position, 1.0, *block))
                .collect();
            let rows = threads::run(ranks, |comm| {
                let piece = if comm.rank() == 0 { all.clone() } else { Vec::new() };
                let domain = distribute(comm, piece, all.len() as u64, cutoff(1.0)).unwrap();
                let mut lists = search(&domain, 3, &[cutoff(1.0); 9]).unwrap();
                let mut rows = Vec::new();
                for list in &mut lists {
                    let (block_j, length) = (list.block_j, list.len());
                    let mut all_rows = list.rows(0..length);
                    for k in 0..length {
                        let row = all_rows.row(k);
                        let ids: Vec<u64> = row
                            .groups
                            .intact
                            .iter()
                            .enumerate()
                            .flat_map(|(group, bits)| {
                                let indices = row.neighbours.group(group).indices();
                                (0..WIDTH).filter(move |k| bits >> k & 1 == 1).map(move |k| indices[k])
                            })
                            .map(|index| domain.points[index as usize].id)
                            .collect();
                        rows.push((domain.points[row.point].id, block_j, ids));
                    }
                }
                rows
            });
            let mut found: Vec<_> = rows.into_iter().flatten().collect();
            found.sort();
            let square = cutoff(1.0) * cutoff(1.0);
            let mut expected = Vec::new();
            for here in &all {
                for block in 0..3 {
                    let ids: Vec<u64> = all
                        .iter()
                        .filter(|there| there.id != here.id && there.block == block)
                        .filter(|there| distance_squared(here.position, there.position) <= square)
                        .map(|there| there.id)
                        .collect();
                    if !ids.is_empty() {
                        expected.push((here.id, block as usize, ids));
                    }
                }
            }
            expected.sort();
            prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn points_at_the_same_place_are_an_error() {
        let points = vec![
            Point::new(0, [1.0; 3], 1.0, 0),
            Point::new(1, [1.0; 3], 1.0, 0),
        ];
        let domain = distribute(&threads::alone(), points, 2, 1.0).unwrap();
        let fault = search(&domain, 1, &[1.0]).unwrap_err();
        let Fault::SamePlace([a, b]) = fault else {
            panic!("{fault:?}");
        };
        assert_eq!(a.id.min(b.id), 0);
        assert_eq!(a.id.max(b.id), 1);
    }

    #[test]
    fn lists_that_will_not_fit_in_memory_are_an_error() {
        let points: Vec<Point> = (0..9)
            .map(|k| Point::new(k, [k as f64, 0.0, 0.0], 1.0, 0))
            .collect();
        let domain = distribute(&threads::alone(), points, 9, 2.0).unwrap();
        let lists = search(&domain, 1, &[2.0]).unwrap();
        assert_eq!(check_memory(&lists, 1e-3), Ok(()));
        let fault = check_memory(&lists, 1e-18).unwrap_err();
        assert!(
            matches!(fault, Fault::TooLittleMemory { blocks: [0, 0], .. }),
            "{fault:?}"
        );
    }

    #[test]
    fn a_horizon_that_holds_too_many_points_is_an_error() {
        let count = MOST_NEIGHBOURS as u64 + 2;
        let points: Vec<Point> = (0..count)
            .map(|k| Point::new(k, [k as f64, 0.0, 0.0], 1.0, 0))
            .collect();
        let cutoff = 1.1 * count as f64;
        let domain = distribute(&threads::alone(), points, count, cutoff).unwrap();
        let fault = search(&domain, 1, &[cutoff]).unwrap_err();
        assert!(
            matches!(fault, Fault::TooManyNeighbours { blocks: [0, 0], .. }),
            "{fault:?}"
        );
    }
}
