//! Rulers with ticks, the colour bar and the axis triad.

use super::canvas::{INK, Image};
use super::layout::{Bar, Layout};
use super::lettering::{CAPITAL_HEIGHT, Lettering, Running};
use super::points::Colouring;
use super::projection::{Bounds, Projection};
use super::scale::Scale;
use super::scene::Axis;

/// Picture, fonts and text size for drawing rulers, labels and outlines.
pub struct Pen<'a> {
    /// The picture.
    pub image: &'a mut Image,
    /// The fonts.
    pub lettering: &'a Lettering,
    /// Size of the text in pixels.
    pub text: f64,
}

/// A line with ticks, labels and a caption.
pub struct Ruler<'a> {
    /// Position of the end with the low numbers, in pixels.
    pub from: [f64; 2],
    /// Position of the end with the high numbers, in pixels.
    pub to: [f64; 2],
    /// Unit vector towards the side of the labels.
    pub outward: [f64; 2],
    /// The ticks, and the unit of their labels.
    pub scale: &'a Scale,
    /// Name of the quantity.
    pub name: &'a str,
}

/// Return the position at `distance` along `direction`.
fn moved(position: [f64; 2], direction: [f64; 2], distance: f64) -> [f64; 2] {
    [0, 1].map(|axis| position[axis] + distance * direction[axis])
}

/// Return half the extent of a text along a unit vector. The text is given by its width and height.
fn half_extent([width, height]: [f64; 2], direction: [f64; 2]) -> f64 {
    (direction[0].abs() * width + direction[1].abs() * height) / 2.0
}

impl Pen<'_> {
    /// Return the thickness of lines in pixels.
    pub fn thickness(&self) -> f64 {
        (self.text / 15.0).max(1.0)
    }

    /// Write a line of text centred on a position.
    pub fn write(&mut self, text: &str, centre: [f64; 2], running: Running) {
        self.lettering
            .draw(self.image, text, self.text, centre, running, INK);
    }

    /// Draw the line of a ruler, its ticks with labels, and its caption.
    pub fn ruler(&mut self, ruler: &Ruler) {
        let height = CAPITAL_HEIGHT * self.text;
        let (tick, gap) = (0.35 * self.text, 0.4 * self.text);
        let thickness = self.thickness();
        self.image.line(ruler.from, ruler.to, thickness, INK);
        let mut reach: f64 = 0.0;
        for mark in &ruler.scale.ticks {
            let start = [0, 1]
                .map(|axis| ruler.from[axis] + mark.fraction * (ruler.to[axis] - ruler.from[axis]));
            let end = moved(start, ruler.outward, tick);
            self.image.line(start, end, thickness, INK);
            let size = [self.lettering.length(&mark.label, self.text), height];
            let half = half_extent(size, ruler.outward);
            self.write(
                &mark.label,
                moved(end, ruler.outward, gap + half),
                Running::Across,
            );
            reach = reach.max(2.0 * half);
        }
        let caption = ruler.scale.caption(ruler.name);
        let length = self.lettering.length(&caption, self.text);
        let (running, size) = if ruler.outward[1] == 0.0 {
            (Running::Upwards, [height, length])
        } else {
            (Running::Across, [length, height])
        };
        let middle = [0, 1].map(|axis| (ruler.from[axis] + ruler.to[axis]) / 2.0);
        let distance = tick + 2.2 * gap + reach + half_extent(size, ruler.outward);
        self.write(&caption, moved(middle, ruler.outward, distance), running);
    }

    /// Draw the colour bar with its ruler.
    pub fn colour_bar(&mut self, bar: &Bar, colouring: Colouring, name: &str, unit: &str) {
        let ([left, right], [top, bottom]) = (bar.columns, bar.rows);
        let (low, high) = colouring.range;
        let length = if bar.upright {
            bottom - top
        } else {
            right - left
        };
        for step in 0..length as i64 {
            let colour = colouring.of(colouring.value((step as f64 + 0.5) / length));
            let (columns, rows) = if bar.upright {
                let row = bottom as i64 - 1 - step;
                ([left as i64, right as i64], [row, row + 1])
            } else {
                let column = left as i64 + step;
                ([column, column + 1], [top as i64, bottom as i64])
            };
            self.image.fill_rectangle(columns, rows, colour);
        }
        self.outline(bar.columns, bar.rows);
        let spacing = if bar.upright { 3.0 } else { 6.0 };
        let most_intervals = ((length / (spacing * self.text)) as usize).clamp(2, 8);
        let magnitude = low.abs().max(high.abs());
        let scale = if colouring.is_logarithmic {
            Scale::logarithmic(low, high, unit, most_intervals)
        } else {
            Scale::new(low, high, unit, magnitude, most_intervals)
        };
        let (from, to, outward) = if bar.upright {
            ([right, bottom], [right, top], [1.0, 0.0])
        } else {
            ([left, bottom], [right, bottom], [0.0, 1.0])
        };
        self.ruler(&Ruler {
            from,
            to,
            outward,
            scale: &scale,
            name,
        });
    }

    /// Draw a line across the colour bar at the value of each contour line.
    pub fn levels(&mut self, bar: &Bar, colouring: Colouring, levels: &[f64]) {
        let ([left, right], [top, bottom]) = (bar.columns, bar.rows);
        let fractions = levels.iter().map(|level| colouring.fraction(*level));
        for fraction in fractions.filter(|fraction| (0.0..=1.0).contains(fraction)) {
            let (from, to) = if bar.upright {
                let row = bottom - fraction * (bottom - top);
                ([left, row], [right, row])
            } else {
                let column = left + fraction * (right - left);
                ([column, top], [column, bottom])
            };
            let thickness = self.thickness();
            self.image.line(from, to, 3.0 * thickness, [255; 3]);
            self.image.line(from, to, thickness, INK);
        }
    }

    /// Draw the four sides of a rectangle.
    pub fn outline(&mut self, [left, right]: [f64; 2], [top, bottom]: [f64; 2]) {
        let corners = [[left, top], [right, top], [right, bottom], [left, bottom]];
        for (from, to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            self.image.line(*from, *to, self.thickness(), INK);
        }
    }

    /// Draw the triad of an orthographic view: the directions of the axes x, y and z. The triad lies in the
    /// upper left or upper right corner of the frame. Draw nothing if the box `bounds` covers both corners.
    pub fn triad(&mut self, layout: &Layout, bounds: &Bounds, view: Projection) {
        let length = 2.4 * self.text;
        let axes = [Axis::X, Axis::Y, Axis::Z].map(|axis| {
            let mut step = [0.0; 3];
            step[axis.index()] = 1.0;
            let [across, up] = view.project(step);
            let size = across.hypot(up);
            (axis, (size > 1e-6).then(|| [across / size, -up / size]))
        });
        let ends = [0, 1].map(|k| {
            let along = axes
                .iter()
                .filter_map(|(_, direction)| direction.map(|step| step[k]));
            along.fold([0.0_f64; 2], |[low, high], x| [low.min(x), high.max(x)])
        });
        let row = layout.rows[0] + 0.8 * self.text - length * ends[1][0];
        let margin = self.text;
        let left = layout.columns[0] + margin - length * ends[0][0];
        let right = layout.columns[1] - margin - length * ends[0][1];
        let is_free = |root: &[f64; 2]| {
            let directions = axes.iter().filter_map(|(_, direction)| *direction);
            let labels = directions.map(|step| moved(*root, step, length + 1.1 * margin));
            let mut ends = labels.chain([*root]);
            !ends.any(|end| bounds.covers(layout.position(end), view))
        };
        let Some(root) = [[left, row], [right, row]].into_iter().find(is_free) else {
            return;
        };
        for (axis, direction) in axes {
            let Some(direction) = direction else { continue };
            let tip = moved(root, direction, length);
            self.image.line(root, tip, 1.3 * self.thickness(), INK);
            let aside = [-direction[1], direction[0]];
            let base = moved(tip, direction, -0.55 * self.text);
            let head = [
                moved(tip, direction, 0.1 * self.text),
                moved(base, aside, 0.2 * self.text),
                moved(base, aside, -0.2 * self.text),
            ];
            self.image.fill_polygon(&head, INK);
            let position = moved(tip, direction, 0.65 * self.text);
            self.write(axis.letter(), position, Running::Across);
        }
    }
}
