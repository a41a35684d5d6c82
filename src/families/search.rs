//! Finding the neighbours of every owned point.

use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::material::lanes::WIDTH;
use crate::partition::Domain;
use crate::points::bins::Bins;

use super::list::BondList;

/// A bond as long as the horizon must not depend on rounding: lengths up to δ (1 + 10⁻⁹) count.
const HORIZON_TOLERANCE: f64 = 1e-9;

/// Points searched by one task.
const CHUNK: usize = 1024;

/// Chunks that are searched before their rows are appended; bounds the memory that they take.
const WAVE: usize = 64;

/// The longest bond (m) for a horizon (m).
pub fn cutoff(horizon: f64) -> f64 {
    horizon * (1.0 + HORIZON_TOLERANCE)
}

/// A neighbour on its way into a row: block, global id, local index.
type Found = (u32, u64, u32);

/// The rows that one task found: for each point with neighbours, in order, its local index and how
/// many of the entries are its own.
#[derive(Default)]
struct Chunk {
    rows: Vec<(u32, usize)>,
    entries: Vec<Found>,
}

/// The bond lists of a domain, for blocks 0 … `blocks` − 1; `cutoffs` has the longest bond (m) of each
/// pair of them, row by row, and is symmetric.
///
/// # Errors
/// When two points lie at the same place.
pub fn search(domain: &Domain, blocks: usize, cutoffs: &[f64]) -> Result<Vec<BondList>> {
    let positions: Vec<[f64; 3]> = domain.points.iter().map(|point| point.position).collect();
    let longest = cutoffs.iter().copied().fold(0.0, f64::max);
    let bins = Bins::new(&positions, longest);
    let squares: Vec<f64> = cutoffs.iter().map(|cutoff| cutoff * cutoff).collect();
    let mut lists: Vec<BondList> = (0..blocks * blocks)
        .map(|pair| BondList {
            here: pair / blocks,
            there: pair % blocks,
            starts: vec![0],
            ..BondList::default()
        })
        .collect();
    let chunks = domain.owned.div_ceil(CHUNK);
    for wave in (0..chunks).step_by(WAVE) {
        let found: Vec<Result<Chunk>> = (wave..(wave + WAVE).min(chunks))
            .into_par_iter()
            .map(|chunk| {
                let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(domain.owned);
                search_chunk(domain, &bins, range, blocks, &squares)
            })
            .collect();
        for chunk in found {
            append(&mut lists, domain, blocks, chunk?);
        }
    }
    lists.retain(|list| !list.is_empty());
    for list in &mut lists {
        list.points.shrink_to_fit();
        list.starts.shrink_to_fit();
        list.neighbours.shrink_to_fit();
        list.intact.shrink_to_fit();
        let largest = list.neighbours.iter().flatten().max();
        list.reach = largest.map_or(0, |index| *index as usize + 1);
    }
    Ok(lists)
}

fn search_chunk(
    domain: &Domain,
    bins: &Bins,
    range: std::ops::Range<usize>,
    blocks: usize,
    squares: &[f64],
) -> Result<Chunk> {
    let mut chunk = Chunk::default();
    for index in range {
        let here = &domain.points[index];
        let first = chunk.entries.len();
        let mut coincident = None;
        bins.within(here.position, |other, squared| {
            let there = &domain.points[other as usize];
            if other as usize == index {
                return;
            }
            if squared == 0.0 {
                coincident = Some(there.id);
            }
            if squared > squares[here.block as usize * blocks + there.block as usize] {
                return;
            }
            chunk.entries.push((there.block, there.id, other));
        });
        if let Some(other) = coincident {
            return Err(Error::input(format!(
                "points {} and {other} lie at the same place, {:?} m; do two bodies overlap?",
                here.id.min(other),
                here.position,
            )));
        }
        chunk.entries[first..].sort_unstable();
        chunk.rows.push((index as u32, chunk.entries.len() - first));
    }
    Ok(chunk)
}

fn append(lists: &mut [BondList], domain: &Domain, blocks: usize, chunk: Chunk) {
    let mut entries = &chunk.entries[..];
    for (point, count) in chunk.rows {
        let (row, rest) = entries.split_at(count);
        entries = rest;
        let here = domain.points[point as usize].block as usize;
        for part in row.chunk_by(|a, b| a.0 == b.0) {
            let list = &mut lists[here * blocks + part[0].0 as usize];
            list.points.push(point);
            for group in part.chunks(WIDTH) {
                let mut neighbours = [point; WIDTH];
                for (slot, found) in neighbours.iter_mut().zip(group) {
                    *slot = found.2;
                }
                list.neighbours.push(neighbours);
                list.intact.push((0xff_u16 >> (WIDTH - group.len())) as u8);
            }
            list.starts.push(list.neighbours.len());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use crate::partition::distribute;
    use crate::points::{Point, distance_squared};
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
                    let (there, length) = (list.there, list.len());
                    let mut all_rows = list.rows(0..length);
                    for k in 0..length {
                        let row = all_rows.row(k);
                        let ids: Vec<u64> = row
                            .neighbours
                            .iter()
                            .zip(row.intact.iter())
                            .flat_map(|(group, bits)| {
                                (0..WIDTH).filter(move |k| bits >> k & 1 == 1).map(|k| group[k])
                            })
                            .map(|index| domain.points[index as usize].id)
                            .collect();
                        rows.push((domain.points[row.point].id, there, ids));
                    }
                }
                rows
            });
            let mut found: Vec<_> = rows.into_iter().flatten().collect();
            found.sort();
            let mut expected = Vec::new();
            for here in &all {
                for block in 0..3 {
                    let ids: Vec<u64> = all
                        .iter()
                        .filter(|there| there.id != here.id && there.block == block)
                        .filter(|there| distance_squared(here.position, there.position) <= 1.0)
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
        let error = search(&domain, 1, &[1.0]).unwrap_err();
        assert!(error.message.contains("points 0 and 1"), "{error}");
    }
}
