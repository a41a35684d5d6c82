//! Painting of points as squares or, in orthographic views, as cubes. Also the mapping of values to colours.

use super::canvas::{Colour, Image};
use super::colours::ColourMap;
use super::cubes::Cubes;
use super::layout::Layout;
use super::projection::Projection;
use super::scene::Mark;

/// Mapping of values to colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Colouring {
    /// The colour map.
    pub map: ColourMap,
    /// Values at the ends of the map; above 0 if the scale is logarithmic.
    pub range: (f64, f64),
    /// Colours follow the logarithm of the value. Values of 0 or less have the colour of points without a
    /// value.
    pub is_logarithmic: bool,
}

impl Colouring {
    /// Return the colour of a value.
    pub fn of(&self, value: f64) -> Colour {
        self.map.colour(self.fraction(value))
    }

    /// Return the position of a value on the scale: 0 at the low end, 1 at the high end, and below 0 or above
    /// 1 beyond the ends. Return NaN if the value has no position.
    pub fn fraction(&self, value: f64) -> f64 {
        let (low, high) = self.range;
        if !self.is_logarithmic {
            (value - low) / (high - low)
        } else if value > 0.0 {
            (value / low).ln() / (high / low).ln()
        } else {
            f64::NAN
        }
    }

    /// Return the value at a position on the scale; the position is from 0 to 1.
    pub fn value(&self, fraction: f64) -> f64 {
        let (low, high) = self.range;
        if self.is_logarithmic {
            low * (high / low).powf(fraction)
        } else {
            low + fraction * (high - low)
        }
    }
}

/// Enlargement of cells on each side in the first pass of [`paint`] over the points, pixels. Without this
/// enlargement, a small strain would open gaps between cells, because their edges are rounded to pixels.
pub const OVERLAP: f64 = 0.5;

/// Enlargement of cells on each side in the second pass of [`paint`] over the points, pixels. This
/// enlargement prevents gaps that result from the round-off of positions and sizes.
const TOLERANCE: f64 = 0.01;

/// Height of the strip that represents a 1-D body, in text sizes.
const STRIP_HEIGHT: f64 = 1.9;

/// Paint the cells of points: squares in flat views, cubes in orthographic views, and rectangles with the
/// height of the strip in 1-D. In orthographic views, a nearer point covers a farther point. In the other
/// views, a later point covers an earlier point.
pub fn paint(
    image: &mut Image,
    marks: impl Iterator<Item = Mark> + Clone,
    colouring: Colouring,
    layout: &Layout,
    projection: Projection,
) {
    if let Projection::Orthographic(camera) = projection {
        let mut cubes = Cubes::new(image, camera);
        // The depth buffer stores 4-byte floats. Depths relative to the first point have enough digits even
        // if the body is far from the origin.
        let mut first = None;
        for mark in marks {
            let depth = camera.depth(mark.position);
            let depth = layout.scale * (depth - *first.get_or_insert(depth));
            let centre = layout.pixel(projection.project(mark.position));
            let colour = colouring.of(mark.value);
            cubes.paint((centre, depth), mark.size * layout.scale, colour);
        }
        cubes.shade();
        return;
    }
    for enlargement in [OVERLAP, TOLERANCE] {
        for mark in marks.clone() {
            let [column, row] = layout.pixel(projection.project(mark.position));
            let width = mark.size * layout.scale;
            let height = match projection {
                Projection::Strip => STRIP_HEIGHT * layout.text,
                Projection::Flat(_) | Projection::Orthographic(_) => width,
            };
            let columns = edges(column, width, enlargement);
            let rows = edges(row, height, enlargement);
            image.fill_rectangle(columns, rows, colouring.of(mark.value));
        }
    }
}

/// Return the first pixel of a cell, and the first pixel after the cell, along one direction. All arguments
/// are in pixels.
///
/// Both edges are rounded in the same way, so the next cell begins where this cell ends.
pub fn edges(centre: f64, width: f64, enlargement: f64) -> [i64; 2] {
    if width + 2.0 * enlargement < 1.0 {
        let pixel = centre.floor() as i64;
        return [pixel, pixel + 1];
    }
    let half = width / 2.0 + enlargement;
    let first = (centre - half).round() as i64;
    [first, ((centre + half).round() as i64).max(first + 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn logarithmic_colours_follow_the_decades() {
        let colouring = Colouring {
            map: ColourMap::Viridis,
            range: (1e-2, 1e4),
            is_logarithmic: true,
        };
        assert!((colouring.fraction(10.0) - 0.5).abs() < 1e-12);
        assert!((colouring.value(0.5) / 10.0 - 1.0).abs() < 1e-12);
        assert_eq!(colouring.of(1e-9), colouring.of(1e-2));
        assert_eq!(colouring.of(f64::INFINITY), colouring.of(1e4));
        for without in [0.0, -1.0, f64::NEG_INFINITY, f64::NAN] {
            assert_eq!(colouring.of(without), ColourMap::Viridis.colour(f64::NAN));
        }
    }

    #[test]
    fn neighbouring_cells_leave_no_gap_whatever_the_resolution() {
        for step in 0..400 {
            let width = 0.3 + f64::from(step) * 0.037;
            let mut reached = None;
            for index in 0..200 {
                let [first, end] = edges(7.3 + f64::from(index) * width, width, TOLERANCE);
                assert!(end > first);
                assert!(reached.is_none_or(|reached| first <= reached && first + 1 >= reached));
                reached = Some(end);
            }
        }
    }

    #[test]
    fn smallest_cells_are_one_pixel_where_the_point_is() {
        assert_eq!(edges(10.7, 0.0, TOLERANCE), [10, 11]);
        assert_eq!(edges(10.2, 0.1, TOLERANCE), [10, 11]);
        assert_eq!(edges(10.5, 3.0, TOLERANCE), [9, 12]);
    }
}
