//! Layout of a picture: frame, title, labels and colour bar.

use super::projection::{Camera, Projection};
use super::scene::Axis;

/// The arrangement of a picture. Positions are in pixels, measured to the right and down from the upper left
/// corner.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// Width of the whole picture.
    pub width: f64,
    /// Height of the whole picture.
    pub height: f64,
    /// Size of the text; all margins are multiples of this size.
    pub text: f64,
    /// Left and right edge of the frame.
    pub columns: [f64; 2],
    /// Top and bottom edge of the frame.
    pub rows: [f64; 2],
    /// Position of the colour bar.
    pub bar: Bar,
    /// Pixels per metre.
    pub scale: f64,
    /// Position of the lower left corner of the frame in the drawing plane, m.
    origin: [f64; 2],
}

/// The position of the colour bar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bar {
    /// Left and right edge.
    pub columns: [f64; 2],
    /// Top and bottom edge.
    pub rows: [f64; 2],
    /// True for a vertical bar to the right of the frame, false for a horizontal bar below the frame.
    pub upright: bool,
}

/// Margin for the labels on the left of the frame, in text sizes.
const LEFT: f64 = 5.2;
/// Margin for the title, in text sizes.
const TOP: f64 = 3.4;
/// Margin for the labels below the frame, in text sizes.
const BOTTOM: f64 = 4.2;
/// Room for a vertical colour bar and its labels, in text sizes.
const UPRIGHT_BAR: f64 = 8.0;
/// Room for a horizontal colour bar and its labels, in text sizes.
const LYING_BAR: f64 = 5.4;
/// Additional room for a ruler between the frame and the colour bar, in text sizes.
const RIGHT: f64 = 3.0;
/// Height of the arrow legend at the bottom of the picture, in text sizes.
const LEGEND: f64 = 1.5;
/// Margin at a side without labels, in text sizes.
const EMPTY: f64 = 2.2;
/// Least height of the frame in text sizes. The least width is twice the least height.
const LEAST_HEIGHT: f64 = 3.4;
/// Least height of a frame with a vertical bar beside it, in text sizes.
const UPRIGHT_HEIGHT: f64 = 11.0;
/// Largest height of the frame as a fraction of the width of the picture.
const GREATEST_HEIGHT: f64 = 1.1;

impl Layout {
    /// Create the arrangement for a drawing that extends from `low` to `high` in the drawing plane, m.
    /// `has_legend` reserves room for the legend of the arrows at the bottom of the picture.
    pub fn new(
        width: u32,
        [low, high]: [[f64; 2]; 2],
        projection: Projection,
        has_legend: bool,
    ) -> Self {
        let width = f64::from(width);
        let text = (width * 0.0185).max(6.0);
        let left = if projection == Projection::Strip {
            EMPTY
        } else {
            LEFT
        } * text;
        let extent = [0, 1].map(|direction| high[direction] - low[direction]);
        let extent = match projection {
            Projection::Strip => [extent[0], 0.0],
            Projection::Flat(_) | Projection::Orthographic(_) => extent,
        };
        let beside = match projection {
            Projection::Orthographic(camera) if has_ruler_on_the_right(camera) => RIGHT,
            _ => 0.0,
        };
        let scale_beside = |right: f64| {
            let across = (width - left - right * text) / extent[0];
            across.min(GREATEST_HEIGHT * width / extent[1])
        };
        let upright = scale_beside(UPRIGHT_BAR + beside) * extent[1] >= UPRIGHT_HEIGHT * text;
        let right = if upright { UPRIGHT_BAR } else { EMPTY } + beside;
        let scale = scale_beside(right);

        let least = [LEAST_HEIGHT * 2.0 * text, LEAST_HEIGHT * text];
        let size =
            [0, 1].map(|direction| (extent[direction] * scale).max(least[direction]).round());
        let spare = (width - left - right * text - size[0]).max(0.0);
        let columns = [0.0, size[0]].map(|offset| (left + spare / 2.0).round() + offset);
        let rows = [0.0, size[1]].map(|offset| (TOP * text).round() + offset);
        let below = rows[1] + BOTTOM * text;
        let bar = if upright {
            let start = (columns[1] + (1.3 + beside) * text).round();
            Bar {
                columns: [start, start + text.round()],
                rows,
                upright,
            }
        } else {
            let start = (below + 0.4 * text).round();
            Bar {
                columns,
                rows: [start, start + text.round()],
                upright,
            }
        };
        let height = below + if upright { 0.0 } else { LYING_BAR * text };
        let height = height + if has_legend { LEGEND * text } else { 0.0 };
        Self {
            width,
            height: height.ceil(),
            text,
            columns,
            rows,
            bar,
            scale,
            origin: [0, 1].map(|direction| {
                (low[direction] + high[direction] - size[direction] / scale) / 2.0
            }),
        }
    }

    /// Return the pixel coordinates of a position in the drawing plane (m).
    pub fn pixel(&self, [across, up]: [f64; 2]) -> [f64; 2] {
        [
            self.columns[0] + (across - self.origin[0]) * self.scale,
            self.rows[1] - (up - self.origin[1]) * self.scale,
        ]
    }

    /// Return the position in the drawing plane (m) that has the given pixel coordinates.
    pub fn position(&self, [column, row]: [f64; 2]) -> [f64; 2] {
        [
            self.origin[0] + (column - self.columns[0]) / self.scale,
            self.origin[1] + (self.rows[1] - row) / self.scale,
        ]
    }

    /// Return the lower left and upper right corner of the frame in the drawing plane, m.
    pub fn visible(&self) -> [[f64; 2]; 2] {
        let size = [
            self.columns[1] - self.columns[0],
            self.rows[1] - self.rows[0],
        ];
        let end = [0, 1].map(|direction| self.origin[direction] + size[direction] / self.scale);
        [self.origin, end]
    }
}

/// Test whether a ruler has its labels to the right of the box of the points. Such labels need room beyond
/// the right edge of the frame.
fn has_ruler_on_the_right(camera: Camera) -> bool {
    let mut outward = [Axis::X, Axis::Y, Axis::Z]
        .into_iter()
        .filter_map(|axis| camera.outer_edge(axis));
    outward.any(|(_, [across, _])| across > 0.6)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLANE: Projection = Projection::Flat([Axis::X, Axis::Y]);

    #[test]
    fn frame_keeps_the_shape_of_the_drawing() {
        for extent in [[2.0, 1.0], [1.0, 1.0], [1.0, 3.0]] {
            let layout = Layout::new(1200, [[0.0; 2], extent], PLANE, false);
            let width = layout.columns[1] - layout.columns[0];
            let height = layout.rows[1] - layout.rows[0];
            assert!((width / height - extent[0] / extent[1]).abs() < 0.01);
            assert!(layout.columns[0] > 0.0 && layout.rows[1] < layout.height);
            assert!(layout.bar.upright && layout.bar.columns[1] < layout.width);
        }
    }

    #[test]
    fn thin_drawings_get_a_frame_of_least_height_and_a_lying_bar() {
        for extent in [[1.0, 1e-6], [1.0, 0.0]] {
            let layout = Layout::new(1200, [[0.0; 2], extent], PLANE, false);
            assert!(layout.rows[1] - layout.rows[0] >= LEAST_HEIGHT * layout.text - 1.0);
            assert!(!layout.bar.upright && layout.bar.rows[0] > layout.rows[1]);
        }
    }

    #[test]
    fn middle_of_the_drawing_is_the_middle_of_the_frame() {
        let layout = Layout::new(1000, [[1.0, 2.0], [3.0, 2.5]], PLANE, false);
        let [column, row] = layout.pixel([2.0, 2.25]);
        assert!((column - (layout.columns[0] + layout.columns[1]) / 2.0).abs() < 1e-9);
        assert!((row - (layout.rows[0] + layout.rows[1]) / 2.0).abs() < 1e-9);
        let position = layout.position([column, row]);
        assert!((position[0] - 2.0).abs() < 1e-9 && (position[1] - 2.25).abs() < 1e-9);
        let [low, high] = layout.visible();
        assert!((low[0] + high[0] - 4.0).abs() < 1e-9 && low[1] < high[1]);
    }
}
