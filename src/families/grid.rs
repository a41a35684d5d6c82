//! Memory layout of the local points of a regular grid. Points adjacent along x are adjacent in memory, and
//! so are their neighbours at the same offset.
//!
//! - A slot is an index in this layout. It contains one point or is a hole.
//! - A line is a range of slots with equal y and z and ascending x. The first and the last slot of a line
//!   contain local points. Lines are stored one after the other without gaps.
//! - A band is a range of x. The distance between bands exceeds the longest bond, so no bond joins two bands.
//!   Each line lies within one band, so no line covers the space between bands.

use std::ops::Range;

use rayon::prelude::*;

use crate::lanes::WIDTH;
use crate::partition::Domain;

use super::fault::Fault;
use super::offset::steps;

/// The block number of a hole.
pub(super) const HOLE: u16 = u16::MAX;

/// Number of slots that one task copies.
const CHUNK: usize = 4096;

/// The origin and spacing of a grid and the blocks on it.
#[derive(Debug, Clone, PartialEq)]
pub struct GridFrame {
    /// Centre of a cell, m.
    pub origin: [f64; 3],
    /// Edges of the cells by direction, m.
    pub spacing: [f64; 3],
    /// For each block, whether its points lie on the grid.
    pub blocks: Vec<bool>,
}

impl GridFrame {
    /// Indices of the cell whose centre is nearest to a position (m). The cell at [`Self::origin`] has the
    /// indices 0, 0, 0.
    pub fn cell(&self, position: [f64; 3]) -> [i64; 3] {
        std::array::from_fn(|k| ((position[k] - self.origin[k]) / self.spacing[k]).round() as i64)
    }
}

/// A run: points with consecutive slots and consecutive local indices.
#[derive(Debug, Clone, Copy)]
struct Run {
    slot: u32,
    point: u32,
    length: u32,
}

/// A line of slots.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    /// Number of the band, then the y and z indices of the cells of the line.
    pub(super) at: [i64; 3],
    /// x index of the cell of the first slot.
    pub(super) first: i64,
    /// The first slot.
    pub(super) start: usize,
    /// Number of slots.
    pub(super) length: usize,
}

/// The layout of a grid's local points, including ghosts.
///
/// Holes pad the layout at both ends. Let n be an occupied slot plus the offset of any bond. Because of the
/// holes, the eight slots from n on are in bounds.
#[derive(Debug)]
pub struct Grid {
    /// Origin, spacing and blocks of the grid.
    pub frame: GridFrame,
    /// The lines, sorted by band, then by z, then by y.
    pub(super) lines: Vec<Line>,
    /// Block of the point in each slot, or [`HOLE`].
    pub(super) blocks: Vec<u16>,
    /// Two entries: one for the owned points, one for the ghosts. An entry has two lists. The first list
    /// contains the runs, sorted by slot. The second list contains the index of the first run in each chunk;
    /// a chunk has [`CHUNK`] slots. The second list ends with the number of runs.
    runs: [(Vec<Run>, Vec<u32>); 2],
    /// The runs of the owned points, sorted by local index.
    by_point: Vec<Run>,
}

impl Grid {
    /// Create the layout for the points of `domain` that belong to the blocks of `frame`. `longest` is the
    /// length of the longest bond, m.
    ///
    /// # Errors
    /// If two points coincide, or the layout has too many holes.
    pub fn new(frame: GridFrame, domain: &Domain, longest: f64) -> Result<Self, Fault> {
        let cells: Vec<([i64; 3], u32)> = domain
            .points
            .iter()
            .zip(0..)
            .filter(|(point, _)| frame.blocks[point.block as usize])
            .map(|(point, index)| {
                let [x, y, z] = frame.cell(point.position);
                ([z, y, x], index)
            })
            .collect();
        let reach = steps(longest, frame.spacing[0], domain.extent[0]) + 1;
        let starts = bands(&cells, reach);
        let band = |x: i64| starts.partition_point(|start| *start <= x) as i64;
        let mut cells = cells;
        cells.par_sort_unstable_by_key(|([z, y, x], _)| [band(*x), *z, *y, *x]);
        if let Some(pair) = cells.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            let points = [pair[0].1, pair[1].1].map(|index| domain.points[index as usize]);
            return Err(Fault::SamePlace(points));
        }
        let line_of = |([z, y, x], _): &([i64; 3], u32)| [band(*x), *y, *z];
        let mut lines: Vec<Line> = Vec::new();
        let mut total = 0;
        let mut extents = vec![[i64::MAX, i64::MIN]; starts.len() + 1];
        for line in cells.chunk_by(|a, b| line_of(a) == line_of(b)) {
            let ([_, _, first], _) = line[0];
            let ([_, _, last], _) = line[line.len() - 1];
            let at = line_of(&line[0]);
            let length = (last - first) as usize + 1;
            lines.push(Line {
                at,
                first,
                start: total,
                length,
            });
            total += length;
            let [low, high] = &mut extents[at[0] as usize];
            (*low, *high) = (first.min(*low), last.max(*high));
        }
        // The padding must be wide enough to extend each line to all x of its band, and by the longest bond
        // at both ends.
        let width = WIDTH as i64;
        let beyond = |line: &Line| {
            let [low, high] = extents[line.at[0] as usize];
            let before = reach + line.first - low - line.start as i64;
            let after = line.start as i64 + high - line.first + reach + width - total as i64;
            [before, after]
        };
        let [front, back] = lines.iter().map(beyond).fold([width; 2], |most, next| {
            [most[0].max(next[0]), most[1].max(next[1])]
        });
        let slots = front as usize + total + back as usize;
        if slots > i32::MAX as usize {
            return Err(Fault::TooManyHoles);
        }
        let (mut points, mut blocks) = (vec![0; slots], vec![HOLE; slots]);
        let chunks = cells.chunk_by(|a, b| line_of(a) == line_of(b));
        for (line, own) in lines.iter_mut().zip(chunks) {
            line.start += front as usize;
            for ([_, _, x], index) in own {
                let slot = line.start + (x - line.first) as usize;
                points[slot] = *index;
                blocks[slot] = domain.points[*index as usize].block as u16;
            }
        }
        let runs = [true, false].map(|owned| {
            let selected = |slot: usize| {
                blocks[slot] != HOLE && ((points[slot] as usize) < domain.owned) == owned
            };
            runs(&points, selected)
        });
        let by_point = by_point(&runs[0].0);
        Ok(Self {
            frame,
            lines,
            blocks,
            runs,
            by_point,
        })
    }

    /// Number of slots, including padding.
    pub fn slots(&self) -> usize {
        self.blocks.len()
    }

    /// The slots and local indices of the owned points, in the order of slots.
    pub(super) fn owned(&self) -> impl Iterator<Item = (usize, u32)> {
        let (runs, _) = &self.runs[0];
        runs.iter()
            .flat_map(|run| (0..run.length).map(|k| ((run.slot + k) as usize, run.point + k)))
    }

    /// A cursor that maps slots to local indices.
    pub(super) fn lookup(&self) -> Lookup<'_> {
        Lookup {
            grid: self,
            last: Run {
                slot: 0,
                point: 0,
                length: 0,
            },
        }
    }

    /// Return the line that is displaced from line `index` by these numbers of cells in y and z, within the
    /// same band; `None` if there is no such line.
    ///
    /// The wanted line is close to line `index` in memory, so the search begins at line `index`.
    pub(super) fn line_beside(&self, index: usize, [y, z]: [i64; 2]) -> Option<&Line> {
        let key = |line: &Line| [line.at[0], line.at[2], line.at[1]];
        let [band, own_z, own_y] = key(&self.lines[index]);
        let wanted = [band, own_z + z, own_y + y];
        let mut step = 1;
        let range = if [z, y] >= [0, 0] {
            while (self.lines.get(index + step)).is_some_and(|line| key(line) < wanted) {
                step *= 2;
            }
            index + step / 2..self.lines.len().min(index + step + 1)
        } else {
            while step <= index && key(&self.lines[index - step]) > wanted {
                step *= 2;
            }
            index.saturating_sub(step)..index - step / 2 + 1
        };
        let lines = &self.lines[range];
        let found = lines.binary_search_by_key(&wanted, key).ok()?;
        Some(&lines[found])
    }

    /// Copy the values of the selected local points to their slots.
    pub fn update(&self, which: Which, values: &[f64], slots: &mut [f64]) {
        let kinds = match which {
            Which::Owned => 0..1,
            Which::Ghosts => 1..2,
            Which::All => 0..2,
        };
        slots
            .par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(chunk, slots)| {
                for (runs, starts) in &self.runs[kinds.clone()] {
                    for run in &runs[starts[chunk] as usize..starts[chunk + 1] as usize] {
                        let slot = run.slot as usize - chunk * CHUNK;
                        let (point, length) = (run.point as usize, run.length as usize);
                        slots[slot..slot + length].copy_from_slice(&values[point..point + length]);
                    }
                }
            });
    }

    /// Split a range of owned points into ranges with consecutive slots. Each item has the first slot of such
    /// a range, and the points of the range. Points that are not on the grid are skipped.
    pub fn slots_of(&self, points: Range<usize>) -> impl Iterator<Item = (usize, Range<usize>)> {
        let end = |run: &Run| (run.point + run.length) as usize;
        let first = (self.by_point).partition_point(|run| end(run) <= points.start);
        let runs = self.by_point[first..].iter();
        let runs = runs.take_while(move |run| (run.point as usize) < points.end);
        runs.map(move |run| {
            let from = points.start.max(run.point as usize);
            let slot = run.slot as usize + from - run.point as usize;
            (slot, from..points.end.min(end(run)))
        })
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        let by_slot: usize = self.runs.iter().map(|(runs, _)| runs.len()).sum();
        let runs = by_slot + self.by_point.len();
        self.blocks.len() * 2 + size_of_val(&self.lines[..]) + runs * size_of::<Run>()
    }
}

/// A cursor that maps slots to local indices. It caches the [`Run`] that contains the slot of the previous
/// call.
pub(super) struct Lookup<'a> {
    grid: &'a Grid,
    last: Run,
}

impl Lookup<'_> {
    /// The local index of the point in an occupied slot.
    pub(super) fn point(&mut self, slot: usize) -> usize {
        let slot = slot as u32;
        let has = |run: &Run| (run.slot..run.slot + run.length).contains(&slot);
        if !has(&self.last) {
            let chunk = slot as usize / CHUNK;
            let last = |(runs, starts): &(Vec<Run>, Vec<u32>)| {
                let runs = &runs[starts[chunk] as usize..starts[chunk + 1] as usize];
                let before = runs
                    .partition_point(|run| run.slot <= slot)
                    .checked_sub(1)?;
                Some(runs[before]).filter(has)
            };
            let run = self.grid.runs.iter().find_map(last);
            self.last = run.expect("the slot has a point");
        }
        (self.last.point + (slot - self.last.slot)) as usize
    }
}

/// A subset of the local points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// Points owned by this rank.
    Owned,
    /// Points owned by other ranks.
    Ghosts,
    /// Owned points and ghosts.
    All,
}

/// Return the index along x at which each band starts. No point lies within `reach` steps before the start of
/// a band.
fn bands(cells: &[([i64; 3], u32)], reach: i64) -> Vec<i64> {
    let mut all: Vec<i64> = cells.iter().map(|([_, _, x], _)| *x).collect();
    all.par_sort_unstable();
    all.dedup();
    let apart = |pair: &[i64]| (pair[1] - pair[0] > reach).then_some(pair[1]);
    all.first()
        .copied()
        .into_iter()
        .chain(all.windows(2).filter_map(apart))
        .collect()
}

/// Sort runs by local index, and merge runs with consecutive slots and consecutive local indices.
fn by_point(runs: &[Run]) -> Vec<Run> {
    let mut sorted = runs.to_vec();
    sorted.sort_unstable_by_key(|run| run.point);
    sorted.dedup_by(|later, first| {
        let follows =
            first.point + first.length == later.point && first.slot + first.length == later.slot;
        if follows {
            first.length += later.length;
        }
        follows
    });
    sorted.shrink_to_fit();
    sorted
}

/// Split the selected slots into runs. Each run is as long as possible within a chunk of [`CHUNK`] slots.
/// Also return the index of the first run of each chunk, followed by the number of runs.
fn runs(points: &[u32], selected: impl Fn(usize) -> bool) -> (Vec<Run>, Vec<u32>) {
    let mut runs: Vec<Run> = Vec::new();
    let mut starts = Vec::new();
    for slot in 0..points.len() {
        if slot.is_multiple_of(CHUNK) {
            starts.push(runs.len() as u32);
        }
        if !selected(slot) {
            continue;
        }
        let (point, slot) = (points[slot], slot as u32);
        match runs.last_mut() {
            Some(run)
                if !(slot as usize).is_multiple_of(CHUNK)
                    && run.slot + run.length == slot
                    && run.point + run.length == point =>
            {
                run.length += 1;
            }
            _ => runs.push(Run {
                slot,
                point,
                length: 1,
            }),
        }
    }
    starts.push(runs.len() as u32);
    runs.shrink_to_fit();
    (runs, starts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use crate::partition::distribute;
    use crate::points::Point;

    /// Return a grid with two bands and holes, and the number of its points.
    fn grid() -> (Grid, usize) {
        let position = |k: u64| [k % 9, k / 9 % 9, k / 81].map(|x| x as f64);
        // A gap in x creates two bands, and a plane of missing points creates holes.
        let occupied = |at: &[f64; 3]| (at[0] - 4.0).abs() > 1.0 && at.iter().sum::<f64>() != 7.0;
        let positions: Vec<[f64; 3]> = (0..729).map(position).filter(occupied).collect();
        let points = (0..).zip(&positions);
        let points = points.map(|(k, at)| Point::new(k, *at, 1.0, 0)).collect();
        let count = positions.len();
        let domain = distribute(&threads::alone(), points, count as u64, 1.5).unwrap();
        let frame = GridFrame {
            origin: [0.0; 3],
            spacing: [1.0; 3],
            blocks: vec![true],
        };
        (Grid::new(frame, &domain, 1.5).unwrap(), count)
    }

    #[test]
    fn a_line_beside_another_is_found() {
        let (grid, _) = grid();
        for (index, line) in grid.lines.iter().enumerate() {
            for offset in (0..19 * 19).map(|k| [k % 19 - 9, k / 19 - 9]) {
                let at = [line.at[0], line.at[1] + offset[0], line.at[2] + offset[1]];
                let found = grid.line_beside(index, offset).map(|line| line.at);
                let is_there = grid.lines.iter().any(|line| line.at == at);
                assert_eq!(found, is_there.then_some(at), "{:?} {offset:?}", line.at);
            }
        }
    }

    #[test]
    fn slots_of_any_range_are_those_of_its_points() {
        let (grid, count) = grid();
        let mut expected = vec![0; count];
        grid.owned()
            .for_each(|(slot, point)| expected[point as usize] = slot);
        for step in [1, 7, 100, count] {
            let mut found = vec![0; count];
            for first in (0..count).step_by(step) {
                let points = first..(first + step).min(count);
                for (slot, some) in grid.slots_of(points.clone()) {
                    assert!(points.start <= some.start && some.end <= points.end);
                    some.clone()
                        .for_each(|point| found[point] = slot + point - some.start);
                }
            }
            assert_eq!(found, expected, "{step}");
        }
    }
}
