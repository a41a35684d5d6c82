//! The local points of a regular grid, line by line: the layout in which the neighbours of adjacent
//! points are adjacent.
//!
//! A line holds the points with the same y and z, x fastest, from the first to the last one here;
//! places without a point are holes. Where no point is near, all lines end and others begin: the
//! grid falls into bands, between which there are no bonds. Lines follow one another without gaps, so
//! a place is one number.

use std::ops::Range;

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::lanes::WIDTH;
use crate::partition::Domain;

use super::fault::Fault;
use super::offset::steps;

/// A block number for holes.
pub(super) const HOLE: u16 = u16::MAX;

/// Places copied by one task.
const CHUNK: usize = 4096;

/// Which blocks lie on a grid, and where the grid lies.
#[derive(Debug, Clone, PartialEq)]
pub struct GridFrame {
    /// Centre of a cell, m.
    pub origin: [f64; 3],
    /// Edges of the cells by direction, m.
    pub spacing: [f64; 3],
    /// Whether each block's points lie on it.
    pub blocks: Vec<bool>,
}

impl GridFrame {
    /// The cell whose centre is at a position (m).
    pub fn cell(&self, position: [f64; 3]) -> [i64; 3] {
        std::array::from_fn(|k| ((position[k] - self.origin[k]) / self.spacing[k]).round() as i64)
    }
}

/// Points that lie in a row both in the grid and among the local points.
#[derive(Debug, Clone, Copy)]
struct Run {
    place: u32,
    point: u32,
    length: u32,
}

/// A line of places.
#[derive(Debug, Clone, Copy)]
pub(super) struct Line {
    /// The band, y and z.
    pub(super) at: [i64; 3],
    /// x of the first place.
    pub(super) first: i64,
    /// The first place.
    pub(super) start: usize,
    /// Number of places.
    pub(super) length: usize,
}

/// The layout of a grid's points on a rank, ghosts included. Before the first and after the last
/// line there are more places without a point: from any place with one, eight can be read where its
/// neighbours on any line of its band would be.
#[derive(Debug)]
pub struct Grid {
    /// The grid.
    pub frame: GridFrame,
    pub(super) lines: Vec<Line>,
    /// Block of the point in each place, or [`HOLE`].
    pub(super) blocks: Vec<u16>,
    /// Owned points and ghosts, and where each chunk's runs start.
    runs: [(Vec<Run>, Vec<u32>); 2],
    /// Those of the owned points by ascending point.
    by_point: Vec<Run>,
    by_line: FxHashMap<[i64; 3], u32>,
}

impl Grid {
    /// Lays out the points of a domain that lie on a grid; `longest` is the length of the longest
    /// bond, m.
    ///
    /// # Errors
    /// When two points lie at the same place, or there are too many holes between them.
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
        // From any line of a band it must be possible to look at the same x on any other.
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
        let places = front as usize + total + back as usize;
        if places > i32::MAX as usize {
            return Err(Fault::TooManyHoles);
        }
        let (mut points, mut blocks) = (vec![0; places], vec![HOLE; places]);
        let chunks = cells.chunk_by(|a, b| line_of(a) == line_of(b));
        for (line, own) in lines.iter_mut().zip(chunks) {
            line.start += front as usize;
            for ([_, _, x], index) in own {
                let place = line.start + (x - line.first) as usize;
                points[place] = *index;
                blocks[place] = domain.points[*index as usize].block as u16;
            }
        }
        let by_line = lines.iter().map(|line| line.at).zip(0..).collect();
        let runs = [true, false].map(|owned| {
            let wanted = |place: usize| {
                blocks[place] != HOLE && ((points[place] as usize) < domain.owned) == owned
            };
            runs(&points, wanted)
        });
        let by_point = by_point(&runs[0].0);
        Ok(Self {
            frame,
            lines,
            blocks,
            runs,
            by_point,
            by_line,
        })
    }

    /// Number of places, those before and after all lines included.
    pub fn places(&self) -> usize {
        self.blocks.len()
    }

    /// The places of the owned points with their local indices, in the order of places.
    pub(super) fn owned(&self) -> impl Iterator<Item = (usize, u32)> {
        let (runs, _) = &self.runs[0];
        runs.iter()
            .flat_map(|run| (0..run.length).map(|k| ((run.place + k) as usize, run.point + k)))
    }

    /// Finds which points places have.
    pub(super) fn lookup(&self) -> Lookup<'_> {
        Lookup {
            grid: self,
            last: Run {
                place: 0,
                point: 0,
                length: 0,
            },
        }
    }

    /// The line in this band with this y and z, if there is one.
    pub(super) fn line(&self, at: [i64; 3]) -> Option<&Line> {
        let index = self.by_line.get(&at)?;
        Some(&self.lines[*index as usize])
    }

    /// Copies the values of the local points, or of the ghosts among them only, to their places.
    pub fn update(&self, which: Which, values: &[f64], places: &mut [f64]) {
        let kinds = match which {
            Which::Owned => 0..1,
            Which::Ghosts => 1..2,
            Which::All => 0..2,
        };
        places
            .par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(chunk, places)| {
                for (runs, starts) in &self.runs[kinds.clone()] {
                    for run in &runs[starts[chunk] as usize..starts[chunk + 1] as usize] {
                        let place = run.place as usize - chunk * CHUNK;
                        let (point, length) = (run.point as usize, run.length as usize);
                        places[place..place + length]
                            .copy_from_slice(&values[point..point + length]);
                    }
                }
            });
    }

    /// Where some of the owned points lie: each first place with the points, by local index, of which it is
    /// that of the first, and after which those of the others follow. No two points have the same place.
    pub fn places_of(&self, points: Range<usize>) -> impl Iterator<Item = (usize, Range<usize>)> {
        let end = |run: &Run| (run.point + run.length) as usize;
        let first = (self.by_point).partition_point(|run| end(run) <= points.start);
        let runs = self.by_point[first..].iter();
        let runs = runs.take_while(move |run| (run.point as usize) < points.end);
        runs.map(move |run| {
            let from = points.start.max(run.point as usize);
            let place = run.place as usize + from - run.point as usize;
            (place, from..points.end.min(end(run)))
        })
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        let by_place: usize = self.runs.iter().map(|(runs, _)| runs.len()).sum();
        let runs = by_place + self.by_point.len();
        self.blocks.len() * 2
            + size_of_val(&self.lines[..])
            + runs * size_of::<Run>()
            + self.by_line.capacity() * 24
    }
}

/// Finds the local indices of the points at places, those of places near one another fastest.
pub(super) struct Lookup<'a> {
    grid: &'a Grid,
    last: Run,
}

impl Lookup<'_> {
    /// The local index of the point at a place that has one.
    pub(super) fn point(&mut self, place: usize) -> usize {
        let place = place as u32;
        let has = |run: &Run| (run.place..run.place + run.length).contains(&place);
        if !has(&self.last) {
            let chunk = place as usize / CHUNK;
            let last = |(runs, starts): &(Vec<Run>, Vec<u32>)| {
                let runs = &runs[starts[chunk] as usize..starts[chunk + 1] as usize];
                let before = runs
                    .partition_point(|run| run.place <= place)
                    .checked_sub(1)?;
                Some(runs[before]).filter(has)
            };
            let run = self.grid.runs.iter().find_map(last);
            self.last = run.expect("the place has a point");
        }
        (self.last.point + (place - self.last.place)) as usize
    }
}

/// Which of the local points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Which {
    /// Those that the rank owns.
    Owned,
    /// Those of other ranks.
    Ghosts,
    /// Both.
    All,
}

/// The first x of each band: where more than `reach` steps before it there is no point.
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

/// Runs by ascending point, those that follow one another as one.
fn by_point(runs: &[Run]) -> Vec<Run> {
    let mut sorted = runs.to_vec();
    sorted.sort_unstable_by_key(|run| run.point);
    sorted.dedup_by(|later, first| {
        let follows =
            first.point + first.length == later.point && first.place + first.length == later.place;
        if follows {
            first.length += later.length;
        }
        follows
    });
    sorted.shrink_to_fit();
    sorted
}

/// The longest runs of wanted places whose points follow one another, cut at the ends of chunks, and
/// the first of each chunk.
fn runs(points: &[u32], wanted: impl Fn(usize) -> bool) -> (Vec<Run>, Vec<u32>) {
    let mut runs: Vec<Run> = Vec::new();
    let mut starts = Vec::new();
    for place in 0..points.len() {
        if place.is_multiple_of(CHUNK) {
            starts.push(runs.len() as u32);
        }
        if !wanted(place) {
            continue;
        }
        let (point, place) = (points[place], place as u32);
        match runs.last_mut() {
            Some(run)
                if !(place as usize).is_multiple_of(CHUNK)
                    && run.place + run.length == place
                    && run.point + run.length == point =>
            {
                run.length += 1;
            }
            _ => runs.push(Run {
                place,
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

    #[test]
    fn every_point_lies_where_any_range_of_points_says() {
        let place = |k: u64| [k % 9, k / 9 % 9, k / 81].map(|x| x as f64);
        // Holes, and two bands.
        let there = |at: &[f64; 3]| (at[0] - 4.0).abs() > 1.0 && at.iter().sum::<f64>() != 7.0;
        let places: Vec<[f64; 3]> = (0..729).map(place).filter(there).collect();
        let points = (0..).zip(&places);
        let points = points.map(|(k, at)| Point::new(k, *at, 1.0, 0)).collect();
        let count = places.len();
        let domain = distribute(&threads::alone(), points, count as u64, 1.5).unwrap();
        let frame = GridFrame {
            origin: [0.0; 3],
            spacing: [1.0; 3],
            blocks: vec![true],
        };
        let grid = Grid::new(frame, &domain, 1.5).unwrap();
        let mut expected = vec![0; count];
        grid.owned()
            .for_each(|(place, point)| expected[point as usize] = place);
        for step in [1, 7, 100, count] {
            let mut found = vec![0; count];
            for first in (0..count).step_by(step) {
                let points = first..(first + step).min(count);
                for (place, some) in grid.places_of(points.clone()) {
                    assert!(points.start <= some.start && some.end <= points.end);
                    some.clone()
                        .for_each(|point| found[point] = place + point - some.start);
                }
            }
            assert_eq!(found, expected, "{step}");
        }
    }
}
