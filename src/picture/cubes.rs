//! Cubes in an orthographic view.

use super::canvas::{Colour, Image, spans};
use super::colours::shaded;
use super::points::{OVERLAP, edges};
use super::projection::{Camera, Projection};

/// Edge of the larger cube that is painted behind each cube, divided by the edge of the cube. If a body is
/// deformed, there are gaps between its cubes; the larger cubes fill these gaps.
const BACKING: f64 = 1.3;

/// Smallest edge of a cube whose faces are painted, pixels. A smaller cube is painted as a square.
const LEAST_CUBE: f64 = 2.0;

/// Brightness of the three faces of a cube whose normals are along x, y and z, in this order.
const BRIGHTNESS: [f64; 3] = [0.7, 0.86, 1.0];

/// Smallest edge of a cube with uniform brightness on each face, pixels. For smaller cubes, the brightness of
/// neighbouring pixels is averaged.
const SMALL_CUBE: f64 = 10.0;

/// Largest difference in depth between pixels whose brightness is averaged, divided by the edge of the cube.
const SAME_SURFACE: f32 = 2.0;

/// Limit of the cosine of the angle between the direction of view and the normal of a face. [`BACKING`]
/// defines a larger cube behind each cube. Along a normal whose cosine is below the limit, this larger cube
/// extends less far. The limit is half the cosine in the isometric view.
const STEEP_COSINE: f64 = 0.288_675_134_594_812_9;

/// Smallest cosine of the angle between the direction of view and the normal of a painted face. Faces with a
/// smaller cosine are almost parallel to the direction of view.
const LEAST_COSINE: f64 = 1e-3;

/// Painter of cubes in an orthographic view, with a depth buffer: each pixel shows the nearest cube.
pub struct Cubes<'a> {
    image: &'a mut Image,
    /// Three edges of a unit cube, as vectors in the picture. The components of a vector point to the right
    /// and down. The edges are parallel to x, y and z, and start at the corner nearest to the viewer.
    edges: [[f64; 2]; 3],
    /// Decrease of depth along each of these edges: the cosine of the angle between the direction of view and
    /// the axis.
    cosines: [f64; 3],
    /// A larger cube is painted behind each cube, see [`BACKING`]. Along x, y and z: edge of the larger cube
    /// minus edge of the cube, divided by the edge of the cube.
    growth: [f64; 3],
    /// Surface that each pixel shows.
    surfaces: Vec<Surface>,
}

/// The part of a cube that a pixel shows.
#[derive(Debug, Clone, Copy)]
struct Surface {
    /// Depth times the scale of the picture, pixels. A larger depth is nearer to the viewer.
    depth: f32,
    brightness: f32,
    /// Edge of the cube, pixels.
    edge: f32,
}

impl<'a> Cubes<'a> {
    pub fn new(image: &'a mut Image, camera: Camera) -> Self {
        let pixels = image.width as usize * image.height as usize;
        let to_camera = camera.to_camera();
        let view = Projection::Orthographic(camera);
        let cosines = to_camera.map(f64::abs);
        Self {
            image,
            edges: [0, 1, 2].map(|axis| {
                let mut step = [0.0; 3];
                step[axis] = if to_camera[axis] < 0.0 { 1.0 } else { -1.0 };
                let [across, up] = view.project(step);
                [across, -up]
            }),
            cosines,
            growth: cosines.map(|cosine| {
                // A face that is almost parallel to the direction of view comes nearer by a large distance if
                // it moves outwards, so the larger cube extends less along the normal of this face.
                let is_steep = (LEAST_COSINE..STEEP_COSINE).contains(&cosine);
                let part = if is_steep { cosine / STEEP_COSINE } else { 1.0 };
                part * (BACKING - 1.0)
            }),
            surfaces: vec![
                Surface {
                    depth: f32::NEG_INFINITY,
                    brightness: 1.0,
                    edge: 0.0,
                };
                pixels
            ],
        }
    }

    /// Paint a pixel, unless it shows a nearer surface.
    fn paint_pixel(&mut self, [column, row]: [i64; 2], surface: Surface, colour: Colour) {
        let columns = i64::from(self.image.width);
        if !(0..columns).contains(&column) || !(0..i64::from(self.image.height)).contains(&row) {
            return;
        }
        let pixel = (row * columns + column) as usize;
        if surface.depth > self.surfaces[pixel].depth {
            self.surfaces[pixel] = surface;
            self.image
                .fill_rectangle([column, column + 1], [row, row + 1], colour);
        }
    }

    /// Paint the visible faces of a cube, and the visible faces of a larger cube behind it. Each of the two
    /// cubes has at most three visible faces. `centre` is the position of the centre of the cube, `depth` the
    /// depth of this centre, and `edge` the edge of the cube, all in pixels. A cube with an edge below
    /// [`LEAST_CUBE`] is painted as a square.
    pub fn paint(&mut self, (centre, depth): ([f64; 2], f64), edge: f64, colour: Colour) {
        if edge < LEAST_CUBE {
            let [columns, rows] = centre.map(|coordinate| edges(coordinate, edge, OVERLAP));
            for row in rows[0]..rows[1] {
                for column in columns[0]..columns[1] {
                    let surface = Surface {
                        depth: depth as f32,
                        brightness: 1.0,
                        edge: edge as f32,
                    };
                    self.paint_pixel([column, row], surface, colour);
                }
            }
            return;
        }
        let overlap = 2.0 * OVERLAP;
        self.paint_box((centre, depth), edge, [edge + overlap; 3], colour);
        // If a face moves outwards by a distance d, its surface at a given pixel comes nearer to the camera
        // by d/c, where c is the cosine of the face. For the larger cube, d is half of the growth. The larger
        // cube is shifted back by 4/3 of the largest d/c, so it lies behind the faces of the cube itself. In
        // a gap, the larger cube hides the sides of other cubes.
        let visible = self
            .visible()
            .map(|axis| self.growth[axis] / self.cosines[axis]);
        let behind = depth - edge * visible.fold(0.0, f64::max) / 1.5;
        let sizes = self.growth.map(|growth| (1.0 + growth) * edge + overlap);
        self.paint_box((centre, behind), edge, sizes, colour);
    }

    /// Return the axes normal to the faces that the camera sees.
    fn visible(&self) -> impl Iterator<Item = usize> + use<> {
        let cosines = self.cosines;
        (0..3).filter(move |axis| cosines[*axis] >= LEAST_COSINE)
    }

    /// Paint the visible faces of a box without shading. The box is a cube, or the larger box that is painted
    /// behind a cube. `centre` is the position of the centre of the box, and `depth` the depth of this
    /// centre. `sizes` are the edges of the box along x, y and z, and `edge` is the edge of the cube, all in
    /// pixels.
    fn paint_box(
        &mut self,
        (centre, depth): ([f64; 2], f64),
        edge: f64,
        sizes: [f64; 3],
        colour: Colour,
    ) {
        let edges: [[f64; 2]; 3] =
            std::array::from_fn(|axis| self.edges[axis].map(|length| sizes[axis] * length));
        let descents: [f64; 3] = std::array::from_fn(|axis| sizes[axis] * self.cosines[axis]);
        let nearest = depth + descents.iter().sum::<f64>() / 2.0;
        let corner =
            [0, 1].map(|k| centre[k] - edges.iter().map(|edge| edge[k]).sum::<f64>() / 2.0);
        let [width, height] = [self.image.width, self.image.height].map(i64::from);
        for normal in self.visible() {
            let axes = [[1, 2], [0, 2], [0, 1]][normal];
            let [one, other] = axes.map(|axis| edges[axis]);
            let corners = [[0.0; 2], one, [one[0] + other[0], one[1] + other[1]], other];
            let corners = corners.map(|[across, below]| [corner[0] + across, corner[1] + below]);
            let area = one[0] * other[1] - one[1] * other[0];
            for (row, [first, last]) in spans(&corners, height) {
                for column in first.max(0)..last.min(width) {
                    let offset = [
                        column as f64 + 0.5 - corner[0],
                        row as f64 + 0.5 - corner[1],
                    ];
                    // Position of the pixel on the face, as fractions of the two edges of the face.
                    let along = (offset[0] * other[1] - offset[1] * other[0]) / area;
                    let beside = (one[0] * offset[1] - one[1] * offset[0]) / area;
                    let descent = along * descents[axes[0]] + beside * descents[axes[1]];
                    let surface = Surface {
                        depth: (nearest - descent) as f32,
                        brightness: BRIGHTNESS[normal] as f32,
                        edge: edge as f32,
                    };
                    self.paint_pixel([column, row], surface, colour);
                }
            }
        }
    }

    /// Shade all pixels, after all cubes have been painted.
    ///
    /// Small cubes on a deformed surface form steps. Without averaging, the sides of these steps would look
    /// like specks. A pixel of a small cube therefore gets the mean brightness of the surface in a square
    /// window around the pixel. The window extends by half the edge of the cube to each side.
    pub fn shade(self) {
        let [width, height] = [self.image.width, self.image.height].map(i64::from);
        for row in 0..height {
            for column in 0..width {
                let own = self.surfaces[(row * width + column) as usize];
                if own.depth == f32::NEG_INFINITY {
                    continue;
                }
                let reach = if own.edge < SMALL_CUBE as f32 {
                    (own.edge / 2.0).round() as i64
                } else {
                    0
                };
                let (mut sum, mut count) = (0.0, 0.0);
                for near_row in (row - reach).max(0)..=(row + reach).min(height - 1) {
                    for near_column in (column - reach).max(0)..=(column + reach).min(width - 1) {
                        let near = self.surfaces[(near_row * width + near_column) as usize];
                        if (near.depth - own.depth).abs() <= SAME_SURFACE * own.edge {
                            sum += near.brightness;
                            count += 1.0;
                        }
                    }
                }
                let colour = self.image.pixel(column as u32, row as u32);
                let colour = shaded(colour, f64::from(sum / count));
                self.image
                    .fill_rectangle([column, column + 1], [row, row + 1], colour);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: [u8; 3] = [255; 3];

    const RED: Colour = [200, 0, 0];

    fn isometric() -> Projection {
        Projection::Orthographic(Camera::isometric())
    }

    fn paint_cube(image: &mut Image, centre: [f64; 2], edge: f64, colour: Colour) {
        let mut cubes = Cubes::new(image, Camera::isometric());
        cubes.paint((centre, 0.0), edge, colour);
        cubes.shade();
    }

    #[test]
    fn the_nearest_cube_is_seen_in_any_order_and_size() {
        // One small cube lies behind the upper face of a large cube, although the centre of the small cube is
        // nearer to the camera than the centre of the large cube. The other small cube lies in front of this
        // face.
        let place = |[x, y, z]: [f64; 3]| {
            let [across, up] = isometric().project([x, y, z]);
            (
                [60.0 + across, 60.0 - up],
                Camera::isometric().depth([x, y, z]),
            )
        };
        let large = (place([0.0; 3]), 40.0, RED);
        let behind = (place([17.0, -17.0, 10.0]), 4.0, [0, 0, 200]);
        let before = (place([17.0, -17.0, 25.0]), 4.0, [0, 200, 0]);
        let mut pictures = Vec::new();
        for order in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
            let mut image = Image::new(120, 120);
            let mut cubes = Cubes::new(&mut image, Camera::isometric());
            for cube in order {
                let (centre, edge, colour) = [large, behind, before][cube];
                cubes.paint(centre, edge, colour);
            }
            cubes.shade();
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
        assert_eq!(image.pixel(40, 34), shaded(RED, BRIGHTNESS[0]));
        assert_eq!(image.pixel(2, 2), WHITE);
    }

    #[test]
    fn a_layer_of_cubes_has_an_even_face_from_any_side() {
        for (azimuth, elevation) in [(-45.0, 35.0), (200.0, -25.0), (10.0, 15.0), (-90.0, 90.0)] {
            let camera = Camera::new(azimuth, elevation);
            let view = Projection::Orthographic(camera);
            let mut image = Image::new(400, 400);
            let mut cubes = Cubes::new(&mut image, camera);
            let edge = 10.3;
            let pixel = |place: [f64; 3]| {
                let [across, up] = view.project(place);
                [200.0 + across, 200.0 - up]
            };
            let centre = |index: i32| edge * f64::from(index % 15 - 7);
            for index in 0..225 {
                let place = [centre(index), centre(index / 15), 0.0];
                cubes.paint((pixel(place), camera.depth(place)), edge, RED);
            }
            cubes.shade();
            let side = f64::signum(elevation) * edge / 2.0;
            for index in 0..120 * 120 {
                let step = |k: i32| f64::from(k % 120) - 60.0;
                let [column, row] = pixel([step(index), step(index / 120), side]);
                let found = image.pixel(column as u32, row as u32);
                assert_eq!(found, RED, "{azimuth} {elevation}: {column} {row}");
            }
        }
    }

    #[test]
    fn a_camera_sees_up_to_three_faces() {
        let faces = |azimuth, elevation| {
            let mut image = Image::new(60, 60);
            let mut cubes = Cubes::new(&mut image, Camera::new(azimuth, elevation));
            cubes.paint(([30.0, 30.0], 0.0), 30.0, RED);
            cubes.shade();
            let mut colours: Vec<Colour> = image
                .rgb
                .chunks(3)
                .map(|pixel| [pixel[0], pixel[1], pixel[2]])
                .filter(|pixel| *pixel != WHITE)
                .collect();
            let pixels = colours.len();
            colours.sort_unstable();
            colours.dedup();
            (colours, pixels)
        };
        let [x, y, z] = BRIGHTNESS.map(|brightness| shaded(RED, brightness));
        // The edge of the larger cube is 1.3 · 30 pixels plus the overlap.
        assert_eq!(faces(0.0, 0.0), (vec![x], 40 * 40));
        assert_eq!(faces(90.0, 0.0), (vec![y], 40 * 40));
        assert_eq!(faces(-90.0, -90.0), (vec![z], 40 * 40));
        assert_eq!(faces(45.0, 0.0).0, [x, y]);
        assert_eq!(faces(200.0, -20.0).0, [x, y, z]);
    }

    #[test]
    fn neighbouring_cubes_show_no_hairlines() {
        let mut image = Image::new(300, 300);
        let mut cubes = Cubes::new(&mut image, Camera::isometric());
        for index in 0..20 {
            // The distances between the cubes are stretched by a tenth.
            let y = 1.1 * 10.3 * f64::from(index);
            let [across, up] = isometric().project([0.0, y, 0.0]);
            let depth = Camera::isometric().depth([0.0, y, 0.0]);
            cubes.paint(([20.0 + across, 120.0 - up], depth), 10.3, RED);
        }
        cubes.shade();
        for index in 1..19 {
            let place = [0.0, 1.1 * 10.3 * (f64::from(index) + 0.5), 0.0];
            let [across, up] = isometric().project(place);
            let (column, row) = ((20.0 + across) as u32, (120.0 - up) as u32 - 2);
            assert_eq!(image.pixel(column, row), RED);
        }
    }

    #[test]
    fn steps_of_a_slope_show_no_specks() {
        let mut image = Image::new(300, 300);
        let mut cubes = Cubes::new(&mut image, Camera::isometric());
        let edge = 4.4;
        for index in 0..60 * 60 {
            let [x, y] = [index % 60 - 30, index / 60 - 30].map(|k| edge * f64::from(k));
            let place = [x, y, 0.1 * x - 0.05 * y];
            let [across, up] = isometric().project(place);
            let depth = Camera::isometric().depth(place);
            cubes.paint(([150.0 + across, 150.0 - up], depth), edge, RED);
        }
        cubes.shade();
        let reds = (130..170).flat_map(|row| (100..200).map(move |column| (column, row)));
        let reds = reds.map(|(column, row)| image.pixel(column, row)[0]);
        let (low, high) = reds.fold((255, 0), |(low, high), red| (red.min(low), red.max(high)));
        // Without averaging, the sides of the steps have 0.7 and 0.86 times the brightness of the tops.
        assert!(high - low <= 20, "{low} to {high}");
    }
}
