//! Cells of scattered points: each pixel has the colour of the nearest point.
//!
//! These cells are the Voronoi cells of the points. The distance between a point and the border of its cell
//! has an upper limit, which follows from the volume of the point. Therefore the outline, holes and open
//! cracks of a body stay visible. This limit is larger at pixels that have points on all sides, so the cells
//! close the gaps between points. A slice shows the sections of the 3-D Voronoi cells with the plane of the
//! slice.

use super::canvas::{Colour, Image};
use super::layout::Layout;
use super::points::Colouring;
use super::projection::Projection;
use super::scene::Mark;

/// Largest distance between a point and a pixel of its cell, divided by the size of the point. The size is
/// the edge of a cube with the volume of the point. In 2-D, the size is the edge of a square with the area of
/// the point. For comparison, the distance from a lattice point to the border of its square cell is 0.5 to
/// 0.71 times the size.
const REACH: f64 = 0.6;

/// Limit that replaces [`REACH`] at pixels between points. Such a pixel has points on all sides within this
/// larger limit.
const REACH_INSIDE: f64 = 1.9;

/// Paint the cells of points in a flat view. `depth` is the distance of a point from the drawn plane, m.
pub fn paint(
    image: &mut Image,
    marks: impl Iterator<Item = Mark>,
    depth: impl Fn(&Mark) -> f64,
    colouring: Colouring,
    layout: &Layout,
    projection: Projection,
) {
    let mut marks = marks.peekable();
    if marks.peek().is_none() {
        return;
    }
    let ends = [layout.columns, layout.rows];
    let first = ends.map(|[low, _]| low.floor() as i64);
    let last = ends.map(|[_, high]| high.ceil() as i64);
    let mut pixels = Pixels::new(first, [0, 1].map(|k| (last[k] - first[k]).max(0)));
    for mark in marks {
        pixels.add(&Point {
            centre: layout.pixel(projection.project(mark.position)),
            depth: depth(&mark) * layout.scale,
            size: mark.size * layout.scale,
            colour: colouring.of(mark.value),
        });
    }
    for ([column, row], colour) in pixels.painted() {
        image.fill_rectangle([column, column + 1], [row, row + 1], colour);
    }
}

/// A point in the picture; lengths are in pixels.
struct Point {
    /// Column and row of the projected point.
    centre: [f64; 2],
    /// Distance of the point from the drawn plane.
    depth: f64,
    /// Edge of a cube with the volume of the point; in 2-D, edge of a square with the area of the point.
    size: f64,
    colour: Colour,
}

#[derive(Debug, Clone, Copy)]
struct Pixel {
    /// Square of the distance from the nearest point so far, pixels².
    square: f32,
    /// Colour of the nearest point so far.
    colour: Colour,
    /// A point is within [`REACH`] of the pixel.
    is_near: bool,
    /// One bit per eighth of a full turn around the pixel. The bit is set if a point within [`REACH_INSIDE`]
    /// of the pixel lies in this eighth.
    directions: u8,
}

/// The pixels of the frame, row by row.
struct Pixels {
    /// First column and row.
    first: [i64; 2],
    /// Numbers of columns and rows.
    size: [i64; 2],
    pixels: Vec<Pixel>,
}

impl Pixels {
    /// Create pixels without points.
    fn new(first: [i64; 2], size: [i64; 2]) -> Self {
        let pixel = Pixel {
            square: f32::INFINITY,
            colour: [255; 3],
            is_near: false,
            directions: 0,
        };
        Self {
            first,
            size,
            pixels: vec![pixel; (size[0] * size[1]) as usize],
        }
    }

    /// Add a point to the pixels around it.
    fn add(&mut self, point: &Point) {
        // If a point lies in the drawn plane, its cell extends at least to the centre of the pixel that
        // contains the point.
        let least = std::f64::consts::FRAC_1_SQRT_2.max(point.depth.abs());
        let [reach, inside] = [REACH, REACH_INSIDE].map(|reach| (reach * point.size).max(least));
        let range = |k: usize| {
            let low = (point.centre[k] - inside).floor() as i64;
            let high = (point.centre[k] + inside).ceil() as i64;
            let ends = (self.first[k], self.first[k] + self.size[k]);
            low.clamp(ends.0, ends.1)..high.clamp(ends.0, ends.1)
        };
        let (columns, rows) = (range(0), range(1));
        for row in rows {
            let down = point.centre[1] - (row as f64 + 0.5);
            let start = (row - self.first[1]) * self.size[0] - self.first[0];
            for column in columns.clone() {
                let along = point.centre[0] - (column as f64 + 0.5);
                let square = along * along + down * down + point.depth * point.depth;
                if square > inside * inside {
                    continue;
                }
                let pixel = &mut self.pixels[(start + column) as usize];
                pixel.directions |= 1 << eighth(along, down);
                pixel.is_near |= square <= reach * reach;
                if (square as f32) < pixel.square {
                    pixel.square = square as f32;
                    pixel.colour = point.colour;
                }
            }
        }
    }

    /// Return column, row and colour of the pixels that belong to cells.
    fn painted(&self) -> impl Iterator<Item = ([i64; 2], Colour)> {
        let all = self.pixels.iter().zip(0..);
        let painted = all.filter(|(pixel, _)| pixel.is_near || is_surrounded(pixel.directions));
        painted.map(|(pixel, number)| {
            let (row, column) = (number / self.size[0], number % self.size[0]);
            ([self.first[0] + column, self.first[1] + row], pixel.colour)
        })
    }
}

/// Divide a full turn into eighths, and return the number (0 to 7) of the eighth that contains a direction in
/// the picture. `along` is the component to the right, `down` the component downwards.
fn eighth(along: f64, down: f64) -> u32 {
    match (along >= 0.0, down >= 0.0, along.abs() >= down.abs()) {
        (true, true, true) => 0,
        (true, true, false) => 1,
        (false, true, false) => 2,
        (false, true, true) => 3,
        (false, false, true) => 4,
        (false, false, false) => 5,
        (true, false, false) => 6,
        (true, false, true) => 7,
    }
}

/// Test whether a pixel has points on all sides. This is true if each group of three adjacent eighths of a
/// full turn contains at least one point. In this case, every half turn also contains a point, because
/// every half turn contains at least three whole adjacent eighths.
fn is_surrounded(directions: u8) -> bool {
    let empty = !directions;
    empty & empty.rotate_left(1) & empty.rotate_left(2) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Return one entry for each pixel of a frame: the number of the point that gives the pixel its colour,
    /// or `None` for a pixel outside of all cells. The points are given by centre, size and depth.
    fn shown(points: &[([f64; 2], f64, f64)]) -> Vec<Option<usize>> {
        let mut pixels = Pixels::new([10, 20], [40, 30]);
        for (number, (centre, size, depth)) in (0..).zip(points) {
            pixels.add(&Point {
                centre: *centre,
                depth: *depth,
                size: *size,
                colour: [number, 0, 0],
            });
        }
        let mut shown = vec![None; 1200];
        for ([column, row], [number, ..]) in pixels.painted() {
            shown[((row - 20) * 40 + column - 10) as usize] = Some(usize::from(number));
        }
        shown
    }

    #[test]
    fn each_pixel_shows_the_nearest_point_within_reach() {
        let points = [
            ([20.3, 30.8], 13.0, 0.0),
            ([27.1, 33.2], 15.0, 0.0),
            ([23.0, 40.0], 12.0, 2.0),
            ([12.0, 21.0], 10.0, 0.0),
        ];
        let mut reversed = points;
        reversed.reverse();
        let reversed = shown(&reversed);
        let mut count = 0;
        for (pixel, found) in shown(&points).into_iter().enumerate() {
            let place = [(pixel % 40) as f64 + 10.5, (pixel / 40) as f64 + 20.5];
            let distance = |k: usize| {
                let (centre, _, depth) = points[k];
                let square = (place[0] - centre[0]).powi(2) + (place[1] - centre[1]).powi(2);
                (square + depth * depth).sqrt()
            };
            let within = |k: &usize| distance(*k) <= REACH * points[*k].1;
            assert_eq!(reversed[pixel].map(|k| points.len() - 1 - k), found);
            if !(0..points.len()).any(|k| within(&k)) {
                continue;
            }
            count += 1;
            let reached = |k: &usize| distance(*k) <= REACH_INSIDE * points[*k].1;
            let all = (0..points.len()).filter(reached);
            let nearest = all.min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
            assert_eq!(found, nearest, "{place:?}");
        }
        assert!(count > 300, "{count}");
    }

    #[test]
    fn gaps_between_points_are_filled_and_borders_are_not() {
        // Points on a ring with centre (30, 35) and radius 9 pixels; the size of each point is 10 pixels.
        let ring = |directions: std::ops::Range<u32>| {
            let point = |k: u32| {
                let (sine, cosine) = (f64::from(k) * std::f64::consts::FRAC_PI_4 + 0.1).sin_cos();
                ([30.0 + 9.0 * cosine, 35.0 + 9.0 * sine], 10.0, 0.0)
            };
            shown(&directions.map(point).collect::<Vec<_>>())
        };
        let middle = 15 * 40 + 20;
        assert!(ring(0..8)[middle].is_some());
        assert!(ring(0..5)[middle].is_none());
        // Points on all sides of a pixel, in a few or in all of the eight directions.
        for directions in [0b0101_0101, 0b1010_1010, 0b1001_0010, u8::MAX] {
            assert!(is_surrounded(directions), "{directions:b}");
        }
        for directions in [0, 0b0001_0001, 0b0000_1111, 0b1110_0001] {
            assert!(!is_surrounded(directions), "{directions:b}");
        }
    }

    #[test]
    fn eighths_of_a_turn_are_numbered_in_turn() {
        for k in 0..8 {
            let angle = (f64::from(k) + 0.5) * std::f64::consts::FRAC_PI_4;
            assert_eq!(eighth(angle.cos(), angle.sin()), k);
        }
    }

    #[test]
    fn the_smallest_cell_has_the_pixel_of_its_point() {
        let found = shown(&[([30.2, 40.9], 0.0, 0.0)]);
        assert!(found.iter().flatten().count() <= 4);
        assert_eq!(found[20 * 40 + 20], Some(0));
    }
}
