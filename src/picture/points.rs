//! Painting the cells of the points.

use super::canvas::{Colour, Image};
use super::colours::{ColourMap, shaded};
use super::layout::Layout;
use super::projection::Projection;
use super::scene::Mark;

/// Mapping of values to colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Colouring {
    /// The colour map.
    pub map: ColourMap,
    /// Values at the ends of the map.
    pub range: (f64, f64),
}

impl Colouring {
    /// Return the colour of a value.
    pub fn of(&self, value: f64) -> Colour {
        let (low, high) = self.range;
        self.map.colour((value - low) / (high - low))
    }
}

/// Enlargement of cells on each side in a first pass, pixels. Otherwise a small strain would open gaps
/// between rounded edges.
const OVERLAP: f64 = 0.5;

/// Enlargement of cells on each side against round-off of positions and sizes, pixels.
const TOLERANCE: f64 = 0.01;

/// Height of the strip that represents a bar, in text sizes.
const STRIP_HEIGHT: f64 = 1.9;

/// Smallest edge of a cube with distinct faces, pixels.
const LEAST_CUBE: f64 = 2.0;

/// Brightness of the top, the left and the right face of a cube.
const BRIGHTNESS: [f64; 3] = [1.0, 0.86, 0.7];

/// Paint all points in the given order.
pub fn paint(
    image: &mut Image,
    marks: &[&Mark],
    colouring: Colouring,
    layout: &Layout,
    projection: Projection,
) {
    if projection == Projection::Isometric {
        for mark in marks {
            let centre = layout.pixel(projection.project(mark.position));
            let colour = colouring.of(mark.value);
            paint_cube(image, centre, mark.size * layout.scale, colour);
        }
        return;
    }
    for enlargement in [OVERLAP, TOLERANCE] {
        for mark in marks {
            let [column, row] = layout.pixel(projection.project(mark.position));
            let width = mark.size * layout.scale;
            let height = match projection {
                Projection::Strip => STRIP_HEIGHT * layout.text,
                Projection::Flat(_) | Projection::Isometric => width,
            };
            let columns = edges(column, width, enlargement);
            let rows = edges(row, height, enlargement);
            image.fill_rectangle(columns, rows, colouring.of(mark.value));
        }
    }
}

/// Return the first pixel of a cell, and the first pixel after the cell.
///
/// Both edges are rounded in the same way: where one cell ends, the next cell begins.
fn edges(centre: f64, width: f64, enlargement: f64) -> [i64; 2] {
    if width + 2.0 * enlargement < 1.0 {
        let pixel = centre.floor() as i64;
        return [pixel, pixel + 1];
    }
    let half = width / 2.0 + enlargement;
    let first = (centre - half).round() as i64;
    [first, ((centre + half).round() as i64).max(first + 1)]
}

/// Paint the three visible faces of a cube in the isometric view.
fn paint_cube(image: &mut Image, centre: [f64; 2], edge: f64, colour: Colour) {
    if edge < LEAST_CUBE {
        let [columns, rows] = centre.map(|coordinate| edges(coordinate, edge, OVERLAP));
        image.fill_rectangle(columns, rows, colour);
        return;
    }
    // Vectors in the picture from the corner nearest to the eye, in the middle of the drawn cube, to the
    // three neighbouring corners.
    let enlarged = edge + 2.0 * OVERLAP;
    let neighbours = [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]].map(|direction| {
        let [across, up] = Projection::Isometric.project(direction);
        [enlarged * across, -enlarged * up]
    });
    let [left, right, down] = neighbours;
    let faces = [(left, right), (left, down), (right, down)];
    for ((one, other), brightness) in faces.into_iter().zip(BRIGHTNESS) {
        let corners = [[0.0; 2], one, [one[0] + other[0], one[1] + other[1]], other];
        let corners = corners.map(|[across, below]| [centre[0] + across, centre[1] + below]);
        image.fill_polygon(&corners, shaded(colour, brightness));
    }
}

#[cfg(test)]
mod tests {
    const WHITE: [u8; 3] = [255; 3];
    use super::*;

    const RED: Colour = [200, 0, 0];

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

    #[test]
    fn faces_of_a_cube_are_shaded_from_top_to_right() {
        let mut image = Image::new(60, 60);
        paint_cube(&mut image, [30.0, 30.0], 30.0, RED);
        assert_eq!(image.pixel(30, 20), RED);
        assert_eq!(image.pixel(20, 34), shaded(RED, BRIGHTNESS[1]));
        assert_eq!(image.pixel(40, 34), shaded(RED, BRIGHTNESS[2]));
        assert_eq!(image.pixel(2, 2), WHITE);
    }

    #[test]
    fn neighbouring_cubes_show_no_hairlines() {
        let mut image = Image::new(200, 200);
        for index in (0..20).rev() {
            let [across, up] = Projection::Isometric.project([0.0, 7.3 * f64::from(index), 0.0]);
            paint_cube(&mut image, [20.0 + across, 120.0 - up], 7.3, RED);
        }
        for index in 1..19 {
            let place = [0.0, 7.3 * (f64::from(index) + 0.5), 0.0];
            let [across, up] = Projection::Isometric.project(place);
            let (column, row) = ((20.0 + across) as u32, (120.0 - up) as u32 - 2);
            assert_eq!(image.pixel(column, row), RED);
        }
    }
}
