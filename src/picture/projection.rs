//! Projection of positions to the drawing plane, in metres.

use super::scene::{Axis, Mark, Scene, View};

/// The projection to the drawing plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Projection {
    /// The first coordinate only: a 1-D body, drawn as a strip.
    Strip,
    /// Two coordinates, across and up.
    Flat([Axis; 2]),
    /// All three coordinates, viewed along the diagonal from +x, −y, +z.
    Isometric,
}

/// Length across the picture of a unit vector along x or y in the isometric view.
const SIDEWAYS: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Length up the picture of a unit vector along z in the isometric view. A unit vector along x points down by
/// half of this length, and a unit vector along y points up by half.
const UPWARDS: f64 = 0.816_496_580_927_726;

impl Projection {
    /// Return the projection of a scene.
    pub fn of(scene: &Scene) -> Self {
        match scene.effective_view() {
            _ if scene.dimension < 2 => Self::Strip,
            View::Plane => Self::Flat([Axis::X, Axis::Y]),
            View::Slice { axis, .. } => Self::Flat(axis.others()),
            View::Orthographic => Self::Isometric,
        }
    }

    /// Return the position in the drawing plane, across and up, m.
    pub fn project(self, position: [f64; 3]) -> [f64; 2] {
        match self {
            Self::Strip => [position[0], 0.0],
            Self::Flat(axes) => axes.map(|axis| position[axis.index()]),
            Self::Isometric => {
                let [x, y, z] = position;
                [SIDEWAYS * (x + y), UPWARDS * (z + (y - x) / 2.0)]
            }
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
    /// Return the box of all cells, with a margin on each side. Without cells, return a box at the origin.
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

    /// Return the largest absolute coordinate along some axes.
    pub fn magnitude(&self, axes: &[Axis]) -> f64 {
        axes.iter().fold(0.0, |largest, axis| {
            let index = axis.index();
            largest
                .max(self.low[index].abs())
                .max(self.high[index].abs())
        })
    }

    /// Return a corner. For each axis, `high` selects the high end.
    pub fn corner(&self, high: [bool; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| {
            if high[axis] {
                self.high[axis]
            } else {
                self.low[axis]
            }
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

    #[test]
    fn isometric_axes_are_equally_long_and_a_third_of_a_turn_apart() {
        let steps = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
            .map(|step| Projection::Isometric.project(step));
        for [across, up] in steps {
            assert!((across.hypot(up) - UPWARDS).abs() < 1e-12);
        }
        assert!((UPWARDS - (2.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert!(steps[0][0] > 0.0 && steps[0][1] < 0.0);
        assert!(steps[1][0] > 0.0 && steps[1][1] > 0.0);
        assert_eq!(steps[2][0], 0.0);
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
