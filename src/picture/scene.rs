//! The input of a picture: points with values, and the view.

use super::arrows::Vectors;
use super::colours::{ColourMap, is_damage};
use super::points::Colouring;
use super::projection::{Bounds, Camera, Projection};
use crate::error::{Error, Result};

/// A coordinate axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// The first coordinate.
    X,
    /// The second coordinate.
    Y,
    /// The third coordinate.
    Z,
}

impl Axis {
    /// Return the index of this axis in a position: 0 for x, 1 for y, 2 for z.
    pub fn index(self) -> usize {
        self as usize
    }

    /// Return the name of the coordinate.
    pub fn letter(self) -> &'static str {
        ["x", "y", "z"][self.index()]
    }

    /// Return the other two axes, in the order x, y, z.
    pub fn others(self) -> [Self; 2] {
        match self {
            Self::X => [Self::Y, Self::Z],
            Self::Y => [Self::X, Self::Z],
            Self::Z => [Self::X, Self::Y],
        }
    }
}

/// View of a 3-D scene. 1-D scenes are drawn as a strip, 2-D scenes in their plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum View {
    /// View along z onto the x-y plane.
    Plane,
    /// The layer of points at a coordinate of an axis, viewed along this axis.
    Slice {
        /// The normal of the layer.
        axis: Axis,
        /// Coordinate of the layer (m).
        position: f64,
    },
    /// View from a camera at infinity, without perspective.
    Orthographic(Camera),
}

/// A point cloud with values, labels and view.
///
/// The number of points is the length of the shortest of `positions`, `sizes` and `values`. A point is
/// omitted if one of its coordinates is not finite or has an absolute value of 10¹⁰⁰ or more.
#[derive(Debug, Clone, Copy)]
pub struct Scene<'a> {
    /// Dimension of the body: 1, 2 or 3.
    pub dimension: usize,
    /// Deformed positions (m).
    pub positions: &'a [[f64; 3]],
    /// Edge length of the cell of each point (m).
    pub sizes: &'a [f64],
    /// For each point, whether its body has scattered points (points that are not on a lattice); empty if no
    /// body has scattered points. In flat views, scattered points are drawn as Voronoi cells, and other
    /// points as squares.
    pub scattered: &'a [bool],
    /// Value of each point; the value determines the colour. A point whose value is NaN is grey, or pale blue
    /// if the colour map is grey.
    pub values: &'a [f64],
    /// Name of the values, for the colour bar. If the name contains "damage", the colour map of damage and a
    /// range from 0 are the defaults.
    pub field: &'a str,
    /// Unit of the values, without an SI prefix; empty if dimensionless.
    pub unit: &'a str,
    /// The colour map; `None` for the default of the field.
    pub colours: Option<ColourMap>,
    /// The colours have a logarithmic scale.
    pub is_logarithmic: bool,
    /// Title above the frame.
    pub title: &'a str,
    /// Values at the ends of the colour bar. With `None`, these are the smallest and the largest drawn value.
    pub range: Option<(f64, f64)>,
    /// The view of the points.
    pub view: View,
    /// Width of the picture in pixels, from 200 to 16384.
    pub width: u32,
    /// Lines that are drawn over the points of a flat view: index of the colour and positions (m) of each
    /// line.
    pub lines: &'a [(usize, Vec<[f64; 3]>)],
    /// Values of the contour lines that are drawn over the points of a flat view.
    pub contours: &'a [f64],
    /// Vector field that is drawn as arrows.
    pub vectors: Option<Vectors<'a>>,
    /// Line of small text below the title; may be empty.
    pub note: &'a str,
    /// Drawn box, for example a common box of a series of pictures. Points outside the box are omitted.
    /// With `None`, the picture shows the box that contains all drawn points.
    pub bounds: Option<Bounds>,
}

/// A point to draw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mark {
    /// Position (m).
    pub position: [f64; 3],
    /// Edge length of the cell (m); 0 if the given length is negative, too large or NaN.
    pub size: f64,
    /// Value of the point.
    pub value: f64,
    /// The point belongs to a body with scattered points.
    pub scattered: bool,
}

/// Limit of the absolute value of a coordinate, and of the size of a point, m. Points with coordinates beyond
/// this limit are omitted, because they result from a failed run.
const LARGEST_LENGTH: f64 = 1e100;

impl Scene<'_> {
    /// Return the view; in 1-D and 2-D, this is always the plane view.
    pub fn effective_view(&self) -> View {
        if self.dimension < 3 {
            View::Plane
        } else {
            self.view
        }
    }

    /// Return the points to draw, in painting order.
    ///
    /// # Errors
    /// If there are 2³² points or more.
    pub fn marks(&self) -> Result<Marks<'_>> {
        let points = self.positions.len().min(self.sizes.len());
        let points = index_limit(points.min(self.values.len()))?;
        let is_drawn = |point: &u32| {
            let mark = self.mark(*point);
            let usable = |coordinate: &f64| coordinate.abs() < LARGEST_LENGTH;
            mark.position.iter().all(usable)
                && self.bounds.is_none_or(|bounds| bounds.holds(mark.position))
                && self.view_holds(&mark)
        };
        let mut order: Vec<u32> = (0..points).filter(is_drawn).collect();
        let mut sort_by_key = |key: &dyn Fn(&Mark) -> f64| {
            let key = |point: &u32| key(&self.mark(*point));
            order.sort_by(|one, other| key(one).total_cmp(&key(other)));
        };
        match self.effective_view() {
            View::Plane if self.dimension == 3 => sort_by_key(&|mark| mark.position[2]),
            // Where cells overlap or share a pixel, damage must stay visible, so paint points with more
            // damage later. A difference of damage can be negative.
            View::Plane if is_damage(self.field) => {
                sort_by_key(&|mark| mark.value.abs().max(0.0));
            }
            View::Plane => {}
            // Paint the points nearest to the plane of the slice last.
            View::Slice { .. } => sort_by_key(&|mark| -self.depth(mark).abs()),
            // A depth buffer selects the visible cubes, so the order does not matter.
            View::Orthographic(_) => {}
        }
        Ok(Marks { scene: self, order })
    }

    /// Return the point with this index.
    fn mark(&self, point: u32) -> Mark {
        let point = point as usize;
        let size = self.sizes[point];
        Mark {
            scattered: self.scattered.get(point).copied().unwrap_or(false),
            position: self.without_unused(self.positions[point]),
            size: if (0.0..LARGEST_LENGTH).contains(&size) {
                size
            } else {
                0.0
            },
            value: self.values[point],
        }
    }

    /// Test whether the view shows a point. A slice shows the points in its layer; other views show all
    /// points.
    fn view_holds(&self, mark: &Mark) -> bool {
        match self.effective_view() {
            View::Slice { axis, position } => is_in_slice(axis, position, mark.position, mark.size),
            View::Plane | View::Orthographic(_) => true,
        }
    }

    /// Return the signed distance of a point from the plane of the slice, m; 0 without a slice.
    pub fn depth(&self, mark: &Mark) -> f64 {
        match self.effective_view() {
            View::Slice { axis, position } => mark.position[axis.index()] - position,
            View::Plane | View::Orthographic(_) => 0.0,
        }
    }

    /// Return the position, with 0 for the coordinates that a 1-D or 2-D body does not have.
    fn without_unused(&self, mut position: [f64; 3]) -> [f64; 3] {
        for coordinate in position.iter_mut().skip(self.dimension.max(1)) {
            *coordinate = 0.0;
        }
        position
    }

    /// Return the mapping of the values of these points to colours.
    pub fn colouring(&self, marks: &Marks) -> Colouring {
        Colouring {
            map: self.colours.unwrap_or(ColourMap::for_field(self.field)),
            range: self.colour_range(marks),
            is_logarithmic: self.is_logarithmic,
        }
    }

    /// Return `count` values at equal distances on the colour bar, between its ends.
    ///
    /// # Errors
    /// If there are 2³² points or more.
    pub fn levels(&self, count: usize) -> Result<Vec<f64>> {
        let colouring = self.colouring(&self.marks()?);
        let fraction = |number: usize| number as f64 / (count + 1) as f64;
        Ok((1..=count)
            .map(|number| colouring.value(fraction(number)))
            .collect())
    }

    /// Return the values at the ends of the colour bar, the smaller value first.
    fn colour_range(&self, marks: &Marks) -> (f64, f64) {
        let is_usable = |value: &f64| value.is_finite() && (*value > 0.0 || !self.is_logarithmic);
        let given = self
            .range
            .filter(|(low, high)| is_usable(low) && is_usable(high))
            .map(|(low, high)| (low.min(high), low.max(high)));
        let occurring = || {
            let values = marks.iter().map(|mark| mark.value);
            values
                .filter(is_usable)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
                    (low.min(value), high.max(value))
                })
        };
        let (low, high) = given.unwrap_or_else(occurring);
        if self.is_logarithmic {
            return match high / low {
                ratio if ratio.is_nan() || ratio < 0.0 => (0.1, 1.0),
                ratio if ratio > 1.0 + 1e-12 => (low, high),
                _ => (low / 2.0, high * 2.0),
            };
        }
        let is_damage = is_damage(self.field);
        // The range of damage includes 0, so that undamaged points have the colour of the low end in all
        // pictures.
        let (low, high) = match given {
            None if is_damage => (low.min(0.0), high.max(0.0)),
            _ => (low, high),
        };
        widened(low, high, is_damage)
    }
}

/// Return the number of points as a `u32`, the type of the indices of points. If the number does not fit into
/// a `u32`, return an error.
fn index_limit(points: usize) -> Result<u32> {
    u32::try_from(points).map_err(|_| {
        Error::input(format!(
            "{points} points are too many for a picture, which holds at most {}; draw a slice, or a \
             result with fewer points",
            u32::MAX
        ))
    })
}

/// Fraction of the vectors whose arrows are never cut. These vectors are the shortest ones.
const WHOLE_ARROWS: f64 = 0.995;

/// Largest ratio L/w at which no arrow is cut. L is the length of the longest vector. The arrows of the
/// shortest vectors are never cut (see [`WHOLE_ARROWS`]); w is the length of the longest of these vectors.
const LONG_ARROWS: f64 = 4.0;

/// The drawn points of a scene, in painting order.
pub struct Marks<'a> {
    scene: &'a Scene<'a>,
    /// Indices of the points. Copies of the points would need more than ten times the memory.
    order: Vec<u32>,
}

impl Marks<'_> {
    /// Test whether there is no point to draw.
    pub fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    /// Iterate over the points in painting order.
    pub fn iter(&self) -> impl Iterator<Item = Mark> + Clone {
        self.order.iter().map(|point| self.scene.mark(*point))
    }

    /// Iterate in painting order over the points with finite vectors. Each item is a point and its vector.
    pub fn with_vectors<'b>(
        &'b self,
        vectors: &'b Vectors,
    ) -> impl Iterator<Item = (Mark, [f64; 3])> + 'b {
        let all = self.order.iter().filter_map(|point| {
            let vector = vectors.values.get(*point as usize)?;
            Some((self.scene.mark(*point), *vector))
        });
        all.filter(|(_, vector)| vector.iter().all(|component| component.is_finite()))
    }

    /// Return the length, in the drawing plane, of the vector that the longest arrow represents; 0 without
    /// vectors.
    ///
    /// Usually, this vector is the longest of the projected vectors. However, a few vectors can be much
    /// longer than all others, for example the velocities of splinters. The returned length is then a
    /// percentile of the lengths, and the arrows of longer vectors are cut.
    pub fn longest_arrow(&self) -> f64 {
        let Some(vectors) = &self.scene.vectors else {
            return 0.0;
        };
        let projection = Projection::of(self.scene);
        let lengths = self.with_vectors(vectors).map(|(_, vector)| {
            let [across, up] = projection.project(vector);
            across.hypot(up)
        });
        let mut lengths: Vec<f64> = lengths.collect();
        if lengths.is_empty() {
            return 0.0;
        }
        let largest = lengths.iter().copied().fold(0.0, f64::max);
        let rank = (WHOLE_ARROWS * (lengths.len() - 1) as f64).round() as usize;
        let whole = *lengths.select_nth_unstable_by(rank, f64::total_cmp).1;
        if whole > 0.0 && largest > LONG_ARROWS * whole {
            whole
        } else {
            largest
        }
    }

    /// Return a box that contains the points and their cells, with a margin.
    pub fn extent(&self) -> Bounds {
        Bounds::of(self.iter())
    }

    /// Return the finite values of the points.
    pub fn values(&self) -> Vec<f64> {
        let values = self.iter().map(|mark| mark.value);
        values.filter(|value| value.is_finite()).collect()
    }
}

/// Test whether a slice shows a point. The slice is at the coordinate `position` (m) of `axis`. The point is
/// at `place` (m), and its cell has the edge `edge` (m). The distance from the slice may be up to 0.75 edges
/// rather than half an edge, because deformed layers can have gaps.
pub fn is_in_slice(axis: Axis, position: f64, place: [f64; 3], edge: f64) -> bool {
    (place[axis.index()] - position).abs() <= 0.75 * edge
}

/// Return the range from `low` to `high`. If both ends are equal up to round-off, return a wider range, which
/// is 0 to 1 for damage. If an end is not finite, return the range from 0 to 1.
fn widened(low: f64, high: f64, is_damage: bool) -> (f64, f64) {
    let size = low.abs().max(high.abs());
    let spread = high - low;
    if spread.is_finite() && spread > 1e-12 * size {
        (low, high)
    } else if !spread.is_finite() || is_damage {
        (0.0, 1.0)
    } else if size > 0.0 {
        (low - 0.1 * size, high + 0.1 * size)
    } else {
        (-1.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZES: [f64; 3] = [1.0; 3];

    fn scene<'a>(positions: &'a [[f64; 3]], values: &'a [f64], view: View) -> Scene<'a> {
        Scene {
            dimension: 3,
            positions,
            sizes: &SIZES,
            scattered: &[],
            values,
            field: "velocity",
            unit: "m/s",
            colours: None,
            is_logarithmic: false,
            title: "",
            range: None,
            view,
            width: 400,
            lines: &[],
            contours: &[],
            vectors: None,
            note: "",
            bounds: None,
        }
    }

    #[test]
    fn slice_keeps_the_layer_and_paints_the_nearest_last() {
        let positions = [[0.0, 0.0, 0.1], [0.0, 0.0, 5.0], [0.0, 0.0, 0.6]];
        let view = View::Slice {
            axis: Axis::Z,
            position: 0.0,
        };
        let scene = scene(&positions, &[1.0, 2.0, 3.0], view);
        assert_eq!(scene.marks().unwrap().values(), [3.0, 1.0]);
    }

    #[test]
    fn points_with_more_damage_are_painted_later() {
        let order = |values: &[f64]| {
            let scene = Scene {
                dimension: 2,
                field: "difference of damage",
                ..scene(&[[0.0; 3]; 3], values, View::Plane)
            };
            scene.marks().unwrap().values()
        };
        assert_eq!(order(&[0.4, 0.1, 0.3]), [0.1, 0.3, 0.4]);
        assert_eq!(order(&[-0.4, 0.1, 0.3]), [0.1, 0.3, -0.4]);
        assert_eq!(order(&[0.4, f64::NAN, 0.0]), [0.0, 0.4]);
    }

    #[test]
    fn given_bounds_leave_out_what_is_beyond_them() {
        let positions = [[0.0; 3], [9.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        let all = scene(&positions, &[1.0, 2.0, f64::NAN], View::Plane);
        let bounds = scene(&positions[..1], &[1.0], View::Plane);
        let bounds = bounds.marks().unwrap().extent();
        assert_eq!(all.marks().unwrap().values(), [1.0, 2.0]);
        let bounds = bounds.union(bounds);
        let some = Scene {
            bounds: Some(bounds),
            ..all
        };
        assert_eq!(some.marks().unwrap().values(), [1.0]);
        let extent = all.marks().unwrap().extent();
        assert_eq!(bounds.union(extent), extent);
    }

    #[test]
    fn points_beyond_the_largest_index_are_an_error() {
        assert_eq!(index_limit(7).unwrap(), 7);
        let message = index_limit(1 << 32).unwrap_err().message;
        assert!(
            message.starts_with("4294967296 points are too many"),
            "{message}"
        );
    }

    #[test]
    fn levels_divide_the_colour_bar() {
        let scene = Scene {
            range: Some((1.0, 16.0)),
            ..scene(&[[0.0; 3]], &[1.0], View::Plane)
        };
        assert_eq!(scene.levels(2).unwrap(), [6.0, 11.0]);
        let scene = Scene {
            is_logarithmic: true,
            ..scene
        };
        let levels = scene.levels(3).unwrap();
        for (level, expected) in levels.iter().zip([2.0, 4.0, 8.0]) {
            assert!((level - expected).abs() < 1e-12, "{levels:?}");
        }
    }

    #[test]
    fn longest_arrow_is_measured_in_the_picture() {
        let positions = [[0.0; 3], [0.0, 0.0, 9.0], [1.0, 0.0, 0.0]];
        let values = [[3.0, 4.0, 9.0], [90.0; 3], [f64::NAN, 0.0, 0.0]];
        let vectors = Vectors {
            values: &values,
            field: "velocity",
            unit: "m/s",
            longest_arrow: None,
        };
        let view = View::Slice {
            axis: Axis::Z,
            position: 0.0,
        };
        let scene = Scene {
            vectors: Some(vectors),
            ..scene(&positions, &[0.0; 3], view)
        };
        // The second point is not in the slice. The z component is parallel to the direction of view.
        assert_eq!(scene.marks().unwrap().longest_arrow(), 5.0);
    }

    #[test]
    fn few_fast_points_do_not_shorten_the_other_arrows() {
        let positions: Vec<[f64; 3]> = (0..1000).map(|k| [f64::from(k), 0.0, 0.0]).collect();
        let longest = |slow: f64, fast: f64| {
            let values: Vec<[f64; 3]> = (0..1000)
                .map(|k| [if k == 500 { fast } else { slow }, 0.0, 0.0])
                .collect();
            let vectors = Vectors {
                values: &values,
                field: "velocity",
                unit: "m/s",
                longest_arrow: None,
            };
            let numbers = vec![1.0; 1000];
            let scene = Scene {
                sizes: &numbers,
                vectors: Some(vectors),
                ..scene(&positions, &numbers, View::Plane)
            };
            scene.marks().unwrap().longest_arrow()
        };
        assert_eq!(longest(2.0, 900.0), 2.0);
        assert_eq!(longest(2.0, 7.0), 7.0);
        // A pulse moves few points. The percentile is then 0, so no arrow is cut.
        assert_eq!(longest(0.0, 900.0), 900.0);
    }

    #[test]
    fn unusable_positions_are_left_out() {
        let positions = [[f64::NAN, 0.0, 0.0], [0.0, f64::INFINITY, 0.0], [0.0; 3]];
        let scene = scene(&positions, &[1.0, 2.0, 3.0], View::Plane);
        assert_eq!(scene.marks().unwrap().values(), [3.0]);
    }

    #[test]
    fn colour_range_is_given_or_occurring_and_never_empty() {
        let range = |values: &[f64], field, range| {
            let scene = Scene {
                field,
                range,
                ..scene(&[[0.0; 3]; 3], values, View::Plane)
            };
            scene.colour_range(&scene.marks().unwrap())
        };
        assert_eq!(range(&[1.0, f64::NAN, 4.0], "speed", None), (1.0, 4.0));
        assert_eq!(
            range(&[1.0, 2.0, 4.0], "speed", Some((9.0, 0.0))),
            (0.0, 9.0)
        );
        assert_eq!(range(&[2.0; 3], "speed", None), (1.8, 2.2));
        assert_eq!(range(&[0.0; 3], "speed", None), (-1.0, 1.0));
        assert_eq!(range(&[f64::NAN; 3], "speed", None), (0.0, 1.0));
        assert_eq!(range(&[0.0; 3], "damage", None), (0.0, 1.0));
        assert_eq!(range(&[0.2, 0.3, 0.4], "damage", None), (0.0, 0.4));
    }

    #[test]
    fn logarithmic_range_leaves_out_values_up_to_zero() {
        let range = |values: &[f64], range| {
            let scene = Scene {
                field: "damage",
                is_logarithmic: true,
                range,
                ..scene(&[[0.0; 3]; 3], values, View::Plane)
            };
            scene.colour_range(&scene.marks().unwrap())
        };
        assert_eq!(range(&[0.0, -3.0, 0.5], None), (0.25, 1.0));
        assert_eq!(range(&[1e-3, 0.0, 0.5], None), (1e-3, 0.5));
        assert_eq!(range(&[0.0, -1.0, f64::NAN], None), (0.1, 1.0));
        assert_eq!(range(&[1.0, 2.0, 3.0], Some((1e-4, 1e2))), (1e-4, 1e2));
    }
}
