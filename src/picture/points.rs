//! Painting the cells of the points.

use super::canvas::{Colour, Image, spans};
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

/// Edge of a larger cube painted behind each cube, divided by the edge of the cube. A drawn deformation opens
/// gaps between cubes; the larger cubes fill these gaps.
const BACKING: f64 = 1.3;

/// Smallest edge of a cube whose faces are painted, pixels. A smaller cube is painted as a square.
const LEAST_CUBE: f64 = 2.0;

/// Brightness of the top, the left and the right face of a cube.
const BRIGHTNESS: [f64; 3] = [1.0, 0.86, 0.7];

/// Paint the cells of all points. In flat views, a later point covers an earlier point. In the isometric
/// view, a nearer point covers a farther point.
pub fn paint(
    image: &mut Image,
    marks: impl Iterator<Item = Mark> + Clone,
    colouring: Colouring,
    layout: &Layout,
    projection: Projection,
) {
    if projection == Projection::Isometric {
        let mut cubes = Cubes::new(image);
        // The depth buffer stores 4-byte floats. Depths relative to the first point keep their digits far
        // from the origin.
        let mut first = None;
        for mark in marks {
            let [x, y, z] = mark.position;
            let depth = x - y + z;
            let depth = layout.scale * (depth - *first.get_or_insert(depth));
            let centre = layout.pixel(projection.project(mark.position));
            let colour = colouring.of(mark.value);
            cubes.paint((centre, depth), mark.size * layout.scale, colour);
        }
        return;
    }
    for enlargement in [OVERLAP, TOLERANCE] {
        for mark in marks.clone() {
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

/// Painter of cubes in the isometric view, with a depth buffer: each pixel shows the nearest cube.
struct Cubes<'a> {
    image: &'a mut Image,
    /// Depth x − y + z of the surface that each pixel shows, times the scale (pixels per metre). The larger
    /// of two depths is nearer to the viewer.
    depths: Vec<f32>,
}

impl<'a> Cubes<'a> {
    fn new(image: &'a mut Image) -> Self {
        let pixels = image.width as usize * image.height as usize;
        Self {
            image,
            depths: vec![f32::NEG_INFINITY; pixels],
        }
    }

    /// Paint a pixel, unless it shows a nearer surface.
    fn paint_pixel(&mut self, [column, row]: [i64; 2], depth: f64, colour: Colour) {
        let columns = i64::from(self.image.width);
        if !(0..columns).contains(&column) || !(0..i64::from(self.image.height)).contains(&row) {
            return;
        }
        let pixel = (row * columns + column) as usize;
        if depth as f32 > self.depths[pixel] {
            self.depths[pixel] = depth as f32;
            self.image
                .fill_rectangle([column, column + 1], [row, row + 1], colour);
        }
    }

    /// Paint the three visible faces of a cube. `centre` is the pixel position of its centre, `depth` the
    /// depth of its centre, and `edge` its edge in pixels.
    fn paint(&mut self, (centre, depth): ([f64; 2], f64), edge: f64, colour: Colour) {
        if edge < LEAST_CUBE {
            let [columns, rows] = centre.map(|coordinate| edges(coordinate, edge, OVERLAP));
            for row in rows[0]..rows[1] {
                for column in columns[0]..columns[1] {
                    self.paint_pixel([column, row], depth, colour);
                }
            }
            return;
        }
        let overlap = 2.0 * OVERLAP;
        self.paint_faces((centre, depth), edge + overlap, colour);
        // A face that moves outwards by a distance d comes nearer by 3d. Each face of the larger cube is
        // (BACKING − 1)/2 edges farther out, so the growth brings it nearer by 1.5 (BACKING − 1) edges. The
        // shift of 2 (BACKING − 1) edges puts the face behind the face of its own cube. In a gap, it hides
        // the sides of other cubes.
        let behind = depth - 2.0 * (BACKING - 1.0) * edge;
        self.paint_faces((centre, behind), BACKING * edge + overlap, colour);
    }

    fn paint_faces(&mut self, (centre, depth): ([f64; 2], f64), edge: f64, colour: Colour) {
        let [left, right, down] = neighbours(edge);
        let nearest = depth + 1.5 * edge;
        let faces = [(left, right), (left, down), (right, down)];
        for ((one, other), brightness) in faces.into_iter().zip(BRIGHTNESS) {
            let corners = [[0.0; 2], one, [one[0] + other[0], one[1] + other[1]], other];
            let corners = corners.map(|[across, below]| [centre[0] + across, centre[1] + below]);
            let colour = shaded(colour, brightness);
            let area = one[0] * other[1] - one[1] * other[0];
            let [width, height] = [self.image.width, self.image.height].map(i64::from);
            for (row, [first, last]) in spans(&corners, height) {
                for column in first.max(0)..last.min(width) {
                    let offset = [
                        column as f64 + 0.5 - centre[0],
                        row as f64 + 0.5 - centre[1],
                    ];
                    // Fractions of the two edges of the face at this pixel. Along each edge, the depth
                    // decreases by `edge`.
                    let along = (offset[0] * other[1] - offset[1] * other[0]) / area;
                    let beside = (one[0] * offset[1] - one[1] * offset[0]) / area;
                    let depth = nearest - edge * (along + beside);
                    self.paint_pixel([column, row], depth, colour);
                }
            }
        }
    }
}

/// Return three edges of a cube as vectors in the picture, pixels: to the left, to the right and down. They
/// start at the corner nearest to the viewer, which appears in the middle of the cube.
fn neighbours(edge: f64) -> [[f64; 2]; 3] {
    [[-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]].map(|direction| {
        let [across, up] = Projection::Isometric.project(direction);
        [edge * across, -edge * up]
    })
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

    fn paint_cube(image: &mut Image, centre: [f64; 2], edge: f64, colour: Colour) {
        Cubes::new(image).paint((centre, 0.0), edge, colour);
    }

    #[test]
    fn the_nearest_cube_is_seen_in_any_order_and_size() {
        // One small cube lies behind the upper face of a large cube, although the centre of the small cube is
        // nearer. The other small cube lies in front of this face.
        let place = |[x, y, z]: [f64; 3]| {
            let [across, up] = Projection::Isometric.project([x, y, z]);
            ([60.0 + across, 60.0 - up], x - y + z)
        };
        let large = (place([0.0; 3]), 40.0, RED);
        let behind = (place([17.0, -17.0, 10.0]), 4.0, [0, 0, 200]);
        let before = (place([17.0, -17.0, 25.0]), 4.0, [0, 200, 0]);
        let mut pictures = Vec::new();
        for order in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
            let mut image = Image::new(120, 120);
            let mut cubes = Cubes::new(&mut image);
            for cube in order {
                let (centre, edge, colour) = [large, behind, before][cube];
                cubes.paint(centre, edge, colour);
            }
            assert!(
                !image
                    .rgb
                    .chunks(3)
                    .any(|pixel| pixel[2] > 100 && pixel[0] == 0)
            );
            assert!(image.rgb.chunks(3).any(|pixel| pixel[1] == 200));
            pictures.push(image);
        }
        assert!(pictures.windows(2).all(|pair| pair[0] == pair[1]));
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
        let mut cubes = Cubes::new(&mut image);
        for index in 0..20 {
            // The distances of the cubes are stretched by a tenth.
            let y = 1.1 * 7.3 * f64::from(index);
            let [across, up] = Projection::Isometric.project([0.0, y, 0.0]);
            cubes.paint(([20.0 + across, 120.0 - up], -y), 7.3, RED);
        }
        for index in 1..19 {
            let place = [0.0, 1.1 * 7.3 * (f64::from(index) + 0.5), 0.0];
            let [across, up] = Projection::Isometric.project(place);
            let (column, row) = ((20.0 + across) as u32, (120.0 - up) as u32 - 2);
            assert_eq!(image.pixel(column, row), RED);
        }
    }
}
