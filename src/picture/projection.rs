//! Projection of positions to the drawing plane, in metres.

use super::scene::{Axis, Mark, Scene, View};

/// The projection to the drawing plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// The first coordinate only: a 1-D body, drawn as a strip.
    Strip,
    /// Two coordinates: the first axis points to the right of the picture, the second axis up.
    Flat([Axis; 2]),
    /// All three coordinates, without perspective.
    Orthographic(Camera),
}

/// Direction of an orthographic view. The camera is at infinity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Unit vector to the right of the picture.
    across: [f64; 3],
    /// Unit vector towards the top of the picture.
    up: [f64; 3],
    /// Unit vector from the body to the camera.
    to_camera: [f64; 3],
}

/// A unit vector counts as parallel to the direction of view if its projected length is below this limit.
const ALONG_VIEW: f64 = 1e-6;

impl Camera {
    /// Create a camera. The azimuth is the angle of the camera from +x towards +y, and the elevation is the
    /// angle of the camera above the x-y plane, both in degrees. Positive z points up the picture.
    pub fn new(azimuth: f64, elevation: f64) -> Self {
        // Sine and cosine are exact for multiples of 90 degrees, so that an axis parallel to the direction of
        // view has exactly the projected length 0.
        let turn = |degrees: f64| match degrees.rem_euclid(360.0) {
            0.0 => [0.0, 1.0],
            90.0 => [1.0, 0.0],
            180.0 => [0.0, -1.0],
            270.0 => [-1.0, 0.0],
            degrees => degrees.to_radians().sin_cos().into(),
        };
        let ([sin, cos], [rise, level]) = (turn(azimuth), turn(elevation));
        Self {
            across: [-sin, cos, 0.0],
            up: [-rise * cos, -rise * sin, level],
            to_camera: [level * cos, level * sin, rise],
        }
    }

    /// Return the camera of the isometric view, in the direction (1, −1, 1) from the body.
    pub fn isometric() -> Self {
        Self::new(-45.0, 0.5_f64.sqrt().atan().to_degrees())
    }

    /// Return the depth of a position, m; larger values are nearer to the camera.
    pub fn depth(&self, position: [f64; 3]) -> f64 {
        dot(self.to_camera, position)
    }

    /// Find the outer edge of a box along which the ruler of an axis is drawn. Return the corner at the low
    /// end of the edge, and a unit vector in the picture that points away from the box. The corner has one
    /// entry per axis: true at the high end of this axis, false at the low end. The components of the vector
    /// are positive to the right and downwards. `None` if the axis is parallel to the direction of view.
    ///
    /// An outer edge belongs to one face that the camera sees and to one face that the camera does not see.
    /// Of the two outer edges along an axis, the ruler is at the edge that is lower in the picture. If these
    /// edges are vertical, or rise to the right with a slope above 2, the ruler is at the left edge.
    pub fn outer_edge(self, axis: Axis) -> Option<([bool; 3], [f64; 2])> {
        let step = |axis: Axis| {
            let index = axis.index();
            [self.across[index], -self.up[index]]
        };
        let [across, down] = step(axis);
        let length = across.hypot(down);
        if length < ALONG_VIEW {
            return None;
        }
        let normal = [-down / length, across / length];
        let is_preferred = normal[1] - 0.5 * normal[0] > 0.0;
        let outward = normal.map(|x| if is_preferred { x } else { -x });
        // Replace −0 and round-off by 0: the caption of a ruler runs upwards only if the downward component
        // is exactly 0.
        let outward = outward.map(|x| if x.abs() < ALONG_VIEW { 0.0 } else { x });
        let mut start = [false; 3];
        for other in axis.others() {
            let [across, down] = step(other);
            let ahead = across * outward[0] + down * outward[1];
            // If the other axis is parallel to the direction of view, neither end is farther out, so take the
            // end that is farther from the camera.
            start[other.index()] = if ahead.abs() < ALONG_VIEW {
                self.to_camera[other.index()] < 0.0
            } else {
                ahead > 0.0
            };
        }
        Some((start, outward))
    }

    /// Return the components along x, y and z of the unit vector from the body to the camera.
    pub fn to_camera(&self) -> [f64; 3] {
        self.to_camera
    }
}

fn dot(one: [f64; 3], other: [f64; 3]) -> f64 {
    one[0] * other[0] + one[1] * other[1] + one[2] * other[2]
}

impl Projection {
    /// Return the projection of a scene.
    pub fn of(scene: &Scene) -> Self {
        match scene.effective_view() {
            _ if scene.dimension < 2 => Self::Strip,
            View::Plane => Self::Flat([Axis::X, Axis::Y]),
            View::Slice { axis, .. } => Self::Flat(axis.others()),
            View::Orthographic(camera) => Self::Orthographic(camera),
        }
    }

    /// Project a position onto the drawing plane. Return the horizontal and the vertical coordinate, m.
    pub fn project(self, position: [f64; 3]) -> [f64; 2] {
        match self {
            Self::Strip => [position[0], 0.0],
            Self::Flat(axes) => axes.map(|axis| position[axis.index()]),
            Self::Orthographic(camera) => [dot(camera.across, position), dot(camera.up, position)],
        }
    }
}

/// A box in space, parallel to the axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The corner with the smallest coordinates.
    pub low: [f64; 3],
    /// The corner with the largest coordinates.
    pub high: [f64; 3],
}

impl Bounds {
    /// Return the box of the cells of all points, with a margin on each side. Without points, return a box at
    /// the origin.
    pub fn of(marks: impl Iterator<Item = Mark>) -> Self {
        let mut low = [f64::INFINITY; 3];
        let mut high = [f64::NEG_INFINITY; 3];
        let mut is_empty = true;
        for mark in marks {
            is_empty = false;
            for axis in 0..3 {
                low[axis] = low[axis].min(mark.position[axis] - mark.size / 2.0);
                high[axis] = high[axis].max(mark.position[axis] + mark.size / 2.0);
            }
        }
        if is_empty {
            (low, high) = ([0.0; 3], [1.0, 0.4, 0.4]);
        }
        let largest = (0..3)
            .map(|axis| high[axis] - low[axis])
            .fold(0.0, f64::max);
        let farthest = low
            .iter()
            .chain(&high)
            .fold(0.0, |farthest: f64, coordinate| {
                farthest.max(coordinate.abs())
            });
        // Coincident points also need a frame of finite width.
        let margin = match largest.max(1e-9 * farthest) {
            0.0 => 0.5,
            extent => 0.025 * extent,
        };
        Self {
            low: low.map(|coordinate| coordinate - margin),
            high: high.map(|coordinate| coordinate + margin),
        }
    }

    /// Return the smallest box that contains `self` and `other`.
    pub fn union(self, other: Self) -> Self {
        Self {
            low: std::array::from_fn(|axis| self.low[axis].min(other.low[axis])),
            high: std::array::from_fn(|axis| self.high[axis].max(other.high[axis])),
        }
    }

    /// Test whether a position is in the box.
    pub fn holds(&self, position: [f64; 3]) -> bool {
        (0..3).all(|axis| (self.low[axis]..=self.high[axis]).contains(&position[axis]))
    }

    /// Return the largest absolute coordinate of the box along the given axes.
    pub fn magnitude(&self, axes: &[Axis]) -> f64 {
        axes.iter().fold(0.0, |largest, axis| {
            let index = axis.index();
            largest
                .max(self.low[index].abs())
                .max(self.high[index].abs())
        })
    }

    /// Return a corner. For each axis, `high` selects the high end (true) or the low end.
    pub fn corner(&self, high: [bool; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| {
            if high[axis] {
                self.high[axis]
            } else {
                self.low[axis]
            }
        })
    }

    /// Test whether the projected box covers a position in the drawing plane.
    pub fn covers(&self, position: [f64; 2], projection: Projection) -> bool {
        let corner = |high| projection.project(self.corner(high));
        let (low, high) = (corner([false; 3]), corner([true; 3]));
        let offset = [0, 1].map(|k| position[k] - (low[k] + high[k]) / 2.0);
        // The outline of the projected box is a hexagon with a centre of symmetry. The sides of the hexagon
        // are parallel to the projected edges of the box.
        let edges = [0, 1, 2].map(|axis| {
            let mut high = [false; 3];
            high[axis] = true;
            let end = corner(high);
            [end[0] - low[0], end[1] - low[1]]
        });
        let across = |one: [f64; 2], other: [f64; 2]| (one[0] * other[1] - one[1] * other[0]).abs();
        edges.iter().all(|side| {
            let half: f64 = edges.iter().map(|edge| across(*edge, *side)).sum();
            across(offset, *side) <= half / 2.0
        })
    }

    /// Return the lower left and upper right corner of the projected box.
    pub fn projected(&self, projection: Projection) -> [[f64; 2]; 2] {
        let mut ends = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for number in 0..8_u8 {
            let high = [number & 1 != 0, number & 2 != 0, number & 4 != 0];
            let place = projection.project(self.corner(high));
            for direction in 0..2 {
                ends[0][direction] = ends[0][direction].min(place[direction]);
                ends[1][direction] = ends[1][direction].max(place[direction]);
            }
        }
        ends
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mark(position: [f64; 3], size: f64) -> Mark {
        Mark {
            position,
            size,
            value: 0.0,
            scattered: false,
        }
    }

    const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    #[test]
    fn isometric_axes_are_equally_long_and_a_third_of_a_turn_apart() {
        let view = Projection::Orthographic(Camera::isometric());
        let steps = AXES.map(|step| view.project(step));
        for [across, up] in steps {
            assert!((across.hypot(up) - (2.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        }
        assert!(steps[0][0] > 0.0 && steps[0][1] < 0.0);
        assert!(steps[1][0] > 0.0 && steps[1][1] > 0.0);
        assert_eq!(steps[2][0], 0.0);
    }

    #[test]
    fn cameras_look_along_the_axes() {
        let view = |azimuth, elevation| {
            let camera = Camera::new(azimuth, elevation);
            let view = Projection::Orthographic(camera);
            (AXES.map(|step| view.project(step)), camera.to_camera())
        };
        // From +x, y points to the right and z up.
        assert_eq!(
            view(0.0, 0.0),
            ([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], AXES[0])
        );
        // From −y, x points to the right.
        let (steps, to_camera) = view(-90.0, 0.0);
        assert_eq!(steps, [[1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]);
        assert_eq!(to_camera, [0.0, -1.0, 0.0]);
        // From above with an azimuth of −90°, x points to the right and y up, as on a map.
        let (steps, to_camera) = view(-90.0, 90.0);
        assert_eq!(steps, [[1.0, 0.0], [0.0, 1.0], [0.0, 0.0]]);
        assert_eq!(to_camera, AXES[2]);
    }

    #[test]
    fn cameras_keep_lengths_across_the_view() {
        for (azimuth, elevation) in [(17.0, 33.0), (200.0, -60.0), (-45.0, 89.0)] {
            let camera = Camera::new(azimuth, elevation);
            let vectors = [camera.across, camera.up, camera.to_camera];
            for (k, one) in vectors.into_iter().enumerate() {
                for (l, other) in vectors.into_iter().enumerate() {
                    let expected = f64::from(u8::from(k == l));
                    assert!((dot(one, other) - expected).abs() < 1e-12);
                }
            }
            // Right-handed: across × up points to the camera.
            let [a, u] = [camera.across, camera.up];
            assert!((a[0] * u[1] - a[1] * u[0] - camera.to_camera[2]).abs() < 1e-12);
        }
    }

    #[test]
    fn bounds_hold_all_cells_with_a_margin() {
        let bounds =
            Bounds::of([mark([0.0, 1.0, 2.0], 2.0), mark([8.0, 1.0, 2.0], 2.0)].into_iter());
        assert!((bounds.low[0] + 1.25).abs() < 1e-12);
        assert!((bounds.high[0] - 9.25).abs() < 1e-12);
        assert!((bounds.high[2] - 3.25).abs() < 1e-12);
    }

    #[test]
    fn rulers_are_at_outer_edges_below_and_on_the_left() {
        let slope = 0.75_f64.sqrt();
        let camera = Camera::isometric();
        for (axis, start, outward) in [
            (Axis::X, [false, false, false], [-0.5, slope]),
            (Axis::Y, [true, false, false], [0.5, slope]),
            (Axis::Z, [false, false, false], [-1.0, 0.0]),
        ] {
            let (found, direction) = camera.outer_edge(axis).unwrap();
            assert_eq!(found, start, "{axis:?}");
            assert!((direction[0] - outward[0]).abs() < 1e-12, "{direction:?}");
            assert!((direction[1] - outward[1]).abs() < 1e-12, "{direction:?}");
        }
        // A map, seen from above: the ruler of x is below, the ruler of y on the left.
        let camera = Camera::new(-90.0, 90.0);
        assert_eq!(camera.outer_edge(Axis::X), Some(([false; 3], [0.0, 1.0])));
        assert_eq!(camera.outer_edge(Axis::Y), Some(([false; 3], [-1.0, 0.0])));
        assert_eq!(camera.outer_edge(Axis::Z), None);
    }

    #[test]
    fn outline_of_a_box_is_a_hexagon() {
        let bounds = Bounds {
            low: [0.0; 3],
            high: [1.0; 3],
        };
        let view = Projection::Orthographic(Camera::isometric());
        let centre = view.project([0.5; 3]);
        let covers =
            |across: f64, up: f64| bounds.covers([centre[0] + across, centre[1] + up], view);
        // The corners are √(2/3) away from the centre, the sides √(1/2).
        assert!(covers(0.0, 0.81) && !covers(0.0, 0.82));
        assert!(covers(0.70, 0.0) && !covers(0.71, 0.0));
        assert!(!covers(0.6, 0.6));
        let view = Projection::Orthographic(Camera::new(0.0, 0.0));
        assert!(bounds.covers([0.99, 0.01], view) && !bounds.covers([0.5, 1.01], view));
    }

    #[test]
    fn bounds_are_never_flat() {
        let places = [vec![], vec![mark([0.0; 3], 0.0)], vec![mark([1e9; 3], 0.0)]];
        for marks in places {
            let bounds = Bounds::of(marks.into_iter());
            assert!((0..3).all(|axis| bounds.high[axis] > bounds.low[axis]));
        }
    }

    #[test]
    fn slices_show_the_two_other_axes() {
        let flat = Projection::Flat(Axis::Y.others());
        assert_eq!(flat.project([1.0, 2.0, 3.0]), [1.0, 3.0]);
        assert_eq!(Projection::Strip.project([1.0, 2.0, 3.0]), [1.0, 0.0]);
    }
}
