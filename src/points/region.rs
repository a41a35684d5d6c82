//! The cells of a lattice whose centres can lie within a shape, in the order of their points: x fastest,
//! then y, z.
//!
//! Where the parts of a union are far apart, the cells between them are left out.

use std::ops::RangeInclusive;

use crate::problem::Shape;

use super::shape;

/// The share of a cell's edge by which a point may lie outside a shape and still count as within.
pub(super) const TOLERANCE: f64 = 1e-9;

/// Cells are numbered by direction with integers that a float holds exactly.
const FARTHEST: f64 = 1e15;

/// More parts than this are not cut apart where they overlap: that would give too many pieces.
const MANY_PARTS: usize = 32;

/// The cells whose centres can lie within a shape.
pub struct Region {
    layers: Vec<Stretch>,
    total: u64,
    /// The first cell by direction, and one more than the last.
    hull: CellBox,
}

/// The cells from `first` to `end` − 1 by direction.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CellBox {
    first: [i64; 3],
    end: [i64; 3],
}

/// Steps along one direction, each with the same cells in the directions before it.
#[derive(Debug)]
struct Stretch {
    first: i64,
    /// Cells of each step.
    each: u64,
    /// Cells of all steps.
    all: u64,
    within: Vec<Stretch>,
}

impl Region {
    /// The cells of a lattice that has a corner of a cell at `origin` (m), and those whose centres lie up
    /// to `margin` edges outside; `None` if some lie too far away to be numbered.
    pub fn new(
        shape: &Shape,
        spacing: [f64; 3],
        origin: [f64; 3],
        dimension: usize,
        margin: f64,
    ) -> Option<Self> {
        let boxes = parts(shape)
            .into_iter()
            .map(|part| cells(shape::bounds(part), spacing, origin, dimension, margin))
            .collect::<Option<Vec<CellBox>>>()?;
        let has_cells = |cells: &&CellBox| (0..3).all(|k| cells.first[k] < cells.end[k]);
        let boxes: Vec<&CellBox> = boxes.iter().filter(has_cells).collect();
        let layers = stretches(&boxes, 2);
        let most = |pick: fn(i64, i64) -> i64, of: fn(&CellBox) -> [i64; 3]| {
            let all = boxes.iter().map(|cells| of(cells));
            all.reduce(|a, b| std::array::from_fn(|k| pick(a[k], b[k])))
        };
        Some(Self {
            total: sum(&layers),
            layers,
            hull: CellBox {
                first: most(i64::min, |cells| cells.first).unwrap_or_default(),
                end: most(i64::max, |cells| cells.end).unwrap_or_default(),
            },
        })
    }

    /// The first and the last of all cells in a direction.
    pub fn range(&self, direction: usize) -> RangeInclusive<i64> {
        self.hull.first[direction]..=self.hull.end[direction] - 1
    }

    /// Number of cells, at most the largest number there is.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// The cell with this number, from 0.
    pub fn cell(&self, index: u64) -> [i64; 3] {
        let mut rest = index;
        let mut stretches = &self.layers;
        let mut cell = [0; 3];
        for entry in cell.iter_mut().rev() {
            let mut at = 0;
            while rest >= stretches[at].all {
                rest -= stretches[at].all;
                at += 1;
            }
            let stretch = &stretches[at];
            *entry = stretch.first + (rest / stretch.each) as i64;
            rest %= stretch.each;
            stretches = &stretch.within;
        }
        cell
    }
}

/// Shapes that together hold all of a shape.
fn parts(shape: &Shape) -> Vec<&Shape> {
    match shape {
        Shape::Union(shapes) => shapes.iter().flat_map(parts).collect(),
        Shape::Difference(shapes) => parts(&shapes[0]),
        _ => vec![shape],
    }
}

/// The cells whose centres can lie within a box (m), or so many edges outside.
fn cells(
    (lower, upper): ([f64; 3], [f64; 3]),
    spacing: [f64; 3],
    origin: [f64; 3],
    dimension: usize,
    margin: f64,
) -> Option<CellBox> {
    let mut cells = CellBox {
        first: [0; 3],
        end: [1; 3],
    };
    for k in 0..dimension {
        let [low, high] = [lower[k], upper[k]].map(|border| (border - origin[k]) / spacing[k]);
        let largest = low.abs().max(high.abs());
        if largest > FARTHEST || largest.is_nan() {
            return None;
        }
        // Twice what counts as within, and what rounding makes of large numbers.
        let slack = margin + 2.0 * TOLERANCE + 4.0 * f64::EPSILON * largest;
        cells.first[k] = (low - 0.5 - slack).ceil() as i64;
        cells.end[k] = (high - 0.5 + slack).floor() as i64 + 1;
    }
    Some(cells)
}

/// The union of some boxes along a direction and those before it.
fn stretches(boxes: &[&CellBox], direction: usize) -> Vec<Stretch> {
    let span = |cells: &CellBox| [cells.first[direction], cells.end[direction]];
    let mut spans: Vec<[i64; 2]> = boxes.iter().map(|cells| span(cells)).collect();
    spans.sort_unstable();
    if boxes.len() > MANY_PARTS {
        spans = merged(&spans);
    }
    let mut borders = spans.concat();
    borders.sort_unstable();
    borders.dedup();
    let between = borders.windows(2).filter_map(|pair| {
        let touches = |cells: &&&CellBox| {
            let [first, end] = span(cells);
            first < pair[1] && end > pair[0]
        };
        let here: Vec<&CellBox> = boxes.iter().filter(touches).copied().collect();
        let within = match direction {
            0 => Vec::new(),
            _ => stretches(&here, direction - 1),
        };
        let each = if direction == 0 { 1 } else { sum(&within) };
        (!here.is_empty()).then_some(Stretch {
            first: pair[0],
            each,
            all: each.saturating_mul((pair[1] - pair[0]) as u64),
            within,
        })
    });
    between.collect()
}

/// Sorted spans, with those that overlap or touch made one.
fn merged(spans: &[[i64; 2]]) -> Vec<[i64; 2]> {
    let mut merged: Vec<[i64; 2]> = Vec::new();
    for [first, end] in spans {
        match merged.last_mut() {
            Some(last) if *first <= last[1] => last[1] = last[1].max(*end),
            _ => merged.push([*first, *end]),
        }
    }
    merged
}

fn sum(stretches: &[Stretch]) -> u64 {
    let all = stretches.iter().map(|stretch| stretch.all);
    all.fold(0, u64::saturating_add)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn cube(lower: [f64; 3], edge: f64) -> Shape {
        Shape::Box {
            lower,
            upper: lower.map(|x| x + edge),
        }
    }

    fn all(region: &Region) -> Vec<[i64; 3]> {
        (0..region.total()).map(|k| region.cell(k)).collect()
    }

    #[test]
    fn what_lies_between_the_parts_of_a_union_is_left_out() {
        let apart = Shape::Union(vec![cube([0.0; 3], 2.0), cube([1e6, 1e6, 1.0], 2.0)]);
        let region = Region::new(&apart, [1.0; 3], [0.0; 3], 3, 0.0).unwrap();
        assert_eq!(region.total(), 16);
        assert_eq!(region.cell(0), [0, 0, 0]);
        assert_eq!(region.cell(15), [1_000_001, 1_000_001, 2]);
        let bar = |lower: [f64; 3], upper: [f64; 3]| Shape::Box { lower, upper };
        let frame = Shape::Union(vec![
            bar([0.0; 3], [1e4, 1.0, 1.0]),
            bar([0.0; 3], [1.0, 1e4, 1.0]),
            bar([0.0; 3], [1.0, 1.0, 1e4]),
        ]);
        let region = Region::new(&frame, [1.0; 3], [0.0; 3], 3, 0.0).unwrap();
        assert_eq!(region.total(), 30_000 - 2);
    }

    #[test]
    fn cells_too_far_or_too_many_to_number() {
        let far = cube([1e16, 0.0, 0.0], 1e3);
        assert!(Region::new(&far, [1.0; 3], [0.0; 3], 3, 0.0).is_none());
        let large = cube([0.0; 3], 1e10);
        let region = Region::new(&large, [1.0; 3], [0.0; 3], 3, 0.0).unwrap();
        assert_eq!(region.total(), u64::MAX);
        let infinite = cube([f64::NEG_INFINITY; 3], f64::INFINITY);
        assert!(Region::new(&infinite, [1.0; 3], [0.0; 3], 3, 0.0).is_none());
    }

    proptest! {
        #[test]
        fn every_cell_of_every_part_comes_once_and_in_order(
            parts in prop::collection::vec(
                (prop::array::uniform3(-9..9_i32), 1..5_i32), 1..45,
            ),
        ) {
            let shapes = parts
                .iter()
                .map(|(lower, edge)| cube(lower.map(f64::from), f64::from(*edge)))
                .collect();
            let region = Region::new(&Shape::Union(shapes), [1.0; 3], [0.0; 3], 3, 0.0).unwrap();
            let found = all(&region);
            let key = |cell: &[i64; 3]| [cell[2], cell[1], cell[0]];
            prop_assert!(found.windows(2).all(|pair| key(&pair[0]) < key(&pair[1])));
            for (lower, edge) in &parts {
                for [z, y, x] in (0..edge.pow(3)).map(|k| [k / edge / edge, k / edge % edge, k % edge]) {
                    let cell = [lower[0] + x, lower[1] + y, lower[2] + z].map(i64::from);
                    prop_assert!(found.binary_search_by_key(&key(&cell), key).is_ok());
                }
            }
        }
    }
}
