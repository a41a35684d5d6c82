//! The candidate cells of a lattice: cells whose centres can lie within a shape. The cells are ordered so
//! that x varies fastest, then y, then z.
//!
//! If the shape is a union of distant parts, the cells between the parts are excluded.

use std::ops::RangeInclusive;

use crate::problem::Shape;

use super::shape;

/// Tolerance of containment, as a fraction of the cell edge.
pub(super) const TOLERANCE: f64 = 1e-9;

/// Largest cell number per direction; integers up to this number are exact in floating point.
const FARTHEST: f64 = 1e15;

/// If a union has more parts than this, the ranges of its parts along a direction are merged where they
/// overlap or touch. This limits the number of spans.
const MANY_PARTS: usize = 32;

/// The cells whose centres can lie within a shape.
pub struct Region {
    layers: Vec<Span>,
    total: u64,
    /// The bounding box of all candidate cells.
    hull: CellBox,
}

/// A box of cells: cells `first` to `end` − 1 in each direction.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CellBox {
    first: [i64; 3],
    end: [i64; 3],
}

/// Consecutive layers of cells along one direction. The layers of a span differ only in position. The
/// outermost spans lie along z, the spans within them along y, and the innermost along x.
#[derive(Debug)]
struct Span {
    first: i64,
    /// Number of cells per layer.
    each: u64,
    /// Number of cells of all layers.
    all: u64,
    /// Spans within each layer. They lie along y if this span lies along z, and along x if this span lies
    /// along y. Empty if this span lies along x.
    within: Vec<Span>,
}

impl Region {
    /// Find the candidate cells of a lattice with a cell corner at `origin` (m). The bounds of the shape are
    /// enlarged by `margin` times the cell edge on each side. `None` if some cells are too far from the
    /// origin to be numbered.
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
        let layers = spans_along(&boxes, 2);
        let extreme = |select: fn(i64, i64) -> i64, of: fn(&CellBox) -> [i64; 3]| {
            let all = boxes.iter().map(|cells| of(cells));
            all.reduce(|a, b| std::array::from_fn(|k| select(a[k], b[k])))
        };
        Some(Self {
            total: sum(&layers),
            layers,
            hull: CellBox {
                first: extreme(i64::min, |cells| cells.first).unwrap_or_default(),
                end: extreme(i64::max, |cells| cells.end).unwrap_or_default(),
            },
        })
    }

    /// Return the first and the last cell in a direction.
    pub fn range(&self, direction: usize) -> RangeInclusive<i64> {
        self.hull.first[direction]..=self.hull.end[direction] - 1
    }

    /// Return the number of cells; saturates at `u64::MAX`.
    pub fn total(&self) -> u64 {
        self.total
    }

    /// Return the cell with a given index, from 0.
    pub fn cell(&self, index: u64) -> [i64; 3] {
        let mut rest = index;
        let mut spans = &self.layers;
        let mut cell = [0; 3];
        for entry in cell.iter_mut().rev() {
            let mut at = 0;
            while rest >= spans[at].all {
                rest -= spans[at].all;
                at += 1;
            }
            let span = &spans[at];
            *entry = span.first + (rest / span.each) as i64;
            rest %= span.each;
            spans = &span.within;
        }
        cell
    }
}

/// Return shapes whose union contains the shape.
fn parts(shape: &Shape) -> Vec<&Shape> {
    match shape {
        Shape::Union(shapes) => shapes.iter().flat_map(parts).collect(),
        Shape::Difference(shapes) => parts(&shapes[0]),
        _ => vec![shape],
    }
}

/// Return the cells whose centres can lie within a box (m). The box is first enlarged by `margin` times the
/// cell edge on each side. `None` if cells are too far from the origin to be numbered.
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
        // Twice the tolerance of containment, and the round-off of large coordinates.
        let slack = margin + 2.0 * TOLERANCE + 4.0 * f64::EPSILON * largest;
        cells.first[k] = (low - 0.5 - slack).ceil() as i64;
        cells.end[k] = (high - 0.5 + slack).floor() as i64 + 1;
    }
    Some(cells)
}

/// Compute the union of boxes as spans along `direction`. Spans along z contain spans along y, and spans
/// along y contain spans along x. With more than [`MANY_PARTS`] boxes, the result may also contain cells
/// outside the boxes.
fn spans_along(boxes: &[&CellBox], direction: usize) -> Vec<Span> {
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
        let touching: Vec<&CellBox> = boxes.iter().filter(touches).copied().collect();
        let within = match direction {
            0 => Vec::new(),
            _ => spans_along(&touching, direction - 1),
        };
        let each = if direction == 0 { 1 } else { sum(&within) };
        (!touching.is_empty()).then_some(Span {
            first: pair[0],
            each,
            all: each.saturating_mul((pair[1] - pair[0]) as u64),
            within,
        })
    });
    between.collect()
}

/// Merge sorted spans that overlap or touch.
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

fn sum(spans: &[Span]) -> u64 {
    let all = spans.iter().map(|span| span.all);
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
    fn cells_between_distant_parts_are_excluded() {
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
        fn every_cell_is_listed_once_and_in_order(
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
