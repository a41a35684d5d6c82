//! Curves in a frame with ticks and a legend, as a raster picture or as SVG.
//!
//! ```
//! # use fissure::picture::chart::{Chart, Label, Series};
//! let chart = Chart {
//!     title: "two points",
//!     x: Label { name: "time", unit: "s" },
//!     y: Label { name: "energy", unit: "J" },
//!     series: &[Series { name: "plate".into(), points: vec![[0.0, 1.0], [1.0, 3.0]] }],
//!     width: 600,
//! };
//! assert_eq!(chart.image().width, 600);
//! assert!(chart.svg().contains("energy (J)"));
//! ```

use std::fmt::Write as _;

use super::canvas::{Colour, INK, Image};
use super::lettering::{CAPITAL_HEIGHT, Lettering, Running};
use super::scale::Scale;

/// Colours of curves, distinguishable with colour blindness (Okabe & Ito 2008).
const COLOURS: [Colour; 7] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [230, 159, 0],
    [86, 180, 233],
    [60, 60, 64],
];

/// Lengths of dash and gap, in line thicknesses; `None` for a solid line. The first seven curves have the
/// first entry, the next seven curves have the second entry, and so on.
const DASHES: [Option<[f64; 2]>; 3] = [None, Some([5.0, 2.5]), Some([1.5, 1.8])];

/// Colour of the grid lines, which cross the frame at the ticks.
const GRID: Colour = [228, 228, 232];

/// White space between the data and the frame, as a fraction of the range.
const MARGIN: f64 = 0.04;

/// Height of the picture, as a fraction of its width.
const HEIGHT: f64 = 0.62;

/// Edge of the square that marks an isolated point, in line thicknesses.
const MARKER: f64 = 5.0;

/// Number of samples on each line between two points of a curve. The samples show which possible places of
/// the legend the curve crosses.
const LINE_SAMPLES: usize = 32;

/// Distance in pixels below which consecutive points of a curve are drawn as one point.
const RESOLUTION: f64 = 0.3;

/// Name and unit of an axis.
#[derive(Debug, Clone, Copy)]
pub struct Label<'a> {
    /// Name of the quantity; may be empty.
    pub name: &'a str,
    /// Unit without prefix; may be empty.
    pub unit: &'a str,
}

/// A curve.
#[derive(Debug, Clone)]
pub struct Series {
    /// Name for the legend.
    pub name: String,
    /// Points of the curve. A point that is not finite breaks the curve into parts. A part with only one
    /// point is drawn as a marker.
    pub points: Vec<[f64; 2]>,
}

/// Curves over a common axis.
#[derive(Debug, Clone, Copy)]
pub struct Chart<'a> {
    /// Line of text above the frame; may be empty.
    pub title: &'a str,
    /// The horizontal axis.
    pub x: Label<'a>,
    /// The vertical axis.
    pub y: Label<'a>,
    /// The curves. A chart with more than one curve has a legend.
    pub series: &'a [Series],
    /// Width of the picture in pixels, from 200 to 16384.
    pub width: u32,
}

/// Alignment of a text relative to its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Anchor {
    Start,
    Middle,
    End,
}

/// An element of the drawing. Positions are pixels, to the right and down from the upper left corner.
enum Shape {
    Polyline {
        points: Vec<[f64; 2]>,
        thickness: f64,
        colour: Colour,
    },
    Rectangle {
        columns: [f64; 2],
        rows: [f64; 2],
        colour: Colour,
    },
    Text {
        text: String,
        at: [f64; 2],
        size: f64,
        anchor: Anchor,
        running: Running,
    },
}

impl Chart<'_> {
    /// Test whether there is a point to draw.
    pub fn has_points(&self) -> bool {
        let mut all = self.series.iter().flat_map(|series| &series.points);
        all.any(|point| point.iter().all(|number| number.is_finite()))
    }

    /// Draw the chart as pixels.
    pub fn image(&self) -> Image {
        let lettering = Lettering::new();
        let (width, height) = self.size();
        let mut image = Image::new(width, height);
        for shape in self.shapes(&lettering) {
            match shape {
                Shape::Polyline {
                    points,
                    thickness,
                    colour,
                } => {
                    for ends in points.windows(2) {
                        image.line(ends[0], ends[1], thickness, colour);
                    }
                }
                Shape::Rectangle {
                    columns,
                    rows,
                    colour,
                } => image.fill_rectangle(
                    columns.map(|column| column.round() as i64),
                    rows.map(|row| row.round() as i64),
                    colour,
                ),
                Shape::Text {
                    text,
                    at,
                    size,
                    anchor,
                    running,
                } => {
                    let half = lettering.length(&text, size) / 2.0;
                    let shift = match anchor {
                        Anchor::Start => half,
                        Anchor::Middle => 0.0,
                        Anchor::End => -half,
                    };
                    let centre = match running {
                        Running::Across => [at[0] + shift, at[1]],
                        Running::Upwards => [at[0], at[1] - shift],
                    };
                    lettering.draw(&mut image, &text, size, centre, running, INK);
                }
            }
        }
        image
    }

    /// Return the chart as the text of an SVG file.
    pub fn svg(&self) -> String {
        let (width, height) = self.size();
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" font-family=\"DejaVu Sans, Arial, sans-serif\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        for shape in self.shapes(&Lettering::new()) {
            let _ = match shape {
                Shape::Polyline {
                    points,
                    thickness,
                    colour,
                } => {
                    let places: Vec<String> = points
                        .iter()
                        .map(|[x, y]| format!("{x:.2},{y:.2}"))
                        .collect();
                    let (places, colour) = (places.join(" "), hexadecimal(colour));
                    writeln!(
                        svg,
                        "<polyline fill=\"none\" stroke=\"{colour}\" stroke-width=\"{thickness:.2}\" \
                         stroke-linejoin=\"round\" points=\"{places}\"/>"
                    )
                }
                Shape::Rectangle {
                    columns: [left, right],
                    rows: [top, bottom],
                    colour,
                } => writeln!(
                    svg,
                    "<rect x=\"{left:.2}\" y=\"{top:.2}\" width=\"{:.2}\" height=\"{:.2}\" fill=\"{}\"/>",
                    right - left,
                    bottom - top,
                    hexadecimal(colour)
                ),
                Shape::Text {
                    text,
                    at: [x, y],
                    size,
                    anchor,
                    running,
                } => {
                    let anchor = match anchor {
                        Anchor::Start => "start",
                        Anchor::Middle => "middle",
                        Anchor::End => "end",
                    };
                    let turn = match running {
                        Running::Across => String::new(),
                        Running::Upwards => format!(" transform=\"rotate(-90 {x:.2} {y:.2})\""),
                    };
                    let text = escaped(&text);
                    // Viewers use a wider font than the embedded font, so reduce the size.
                    let size = 0.9 * size;
                    let down = CAPITAL_HEIGHT * size / 2.0;
                    writeln!(
                        svg,
                        "<text x=\"{x:.2}\" y=\"{y:.2}\" dy=\"{down:.2}\" font-size=\"{size:.2}\" \
                         text-anchor=\"{anchor}\"{turn}>{text}</text>"
                    )
                }
            };
        }
        svg + "</svg>\n"
    }

    fn size(&self) -> (u32, u32) {
        let width = self.width.clamp(200, 16_384);
        (width, (HEIGHT * f64::from(width)).round() as u32)
    }

    /// Return all elements of the chart in drawing order.
    fn shapes(&self, lettering: &Lettering) -> Vec<Shape> {
        let (width, height) = self.size();
        let (width, height) = (f64::from(width), f64::from(height));
        let text = (width * 0.0185).max(6.0);
        let thickness = (text / 15.0).max(1.0);
        let ([left, right], [low, high]) = (self.range(0), self.range(1));
        let title = if self.title.is_empty() { 1.2 } else { 2.8 };
        let rows = [title * text, height - 4.2 * text];
        let upright = scale(low, high, self.y.unit, (rows[1] - rows[0]) / (2.6 * text));
        let longest = upright.ticks.iter().fold(0.0, |longest: f64, tick| {
            longest.max(lettering.length(&tick.label, text))
        });
        let columns = [longest + 3.3 * text, width - 1.5 * text].map(f64::round);
        let rows = rows.map(f64::round);
        let across = scale(
            left,
            right,
            self.x.unit,
            (columns[1] - columns[0]) / (5.0 * text),
        );
        let mut shapes = Vec::new();
        let mut line = |from: [f64; 2], to: [f64; 2], colour| {
            shapes.push(Shape::Polyline {
                points: vec![from, to],
                thickness,
                colour,
            });
        };
        let place = |share: [f64; 2]| {
            [
                columns[0] + share[0] * (columns[1] - columns[0]),
                rows[1] - share[1] * (rows[1] - rows[0]),
            ]
        };
        for tick in &across.ticks {
            let [column, _] = place([tick.fraction, 0.0]);
            line([column, rows[0]], [column, rows[1]], GRID);
            line([column, rows[1]], [column, rows[1] + 0.35 * text], INK);
        }
        for tick in &upright.ticks {
            let [_, row] = place([0.0, tick.fraction]);
            line([columns[0], row], [columns[1], row], GRID);
            line([columns[0] - 0.35 * text, row], [columns[0], row], INK);
        }
        let corners = [
            [columns[0], rows[0]],
            [columns[1], rows[0]],
            [columns[1], rows[1]],
            [columns[0], rows[1]],
        ];
        for (from, to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            line(*from, *to, INK);
        }
        let mut write = |words: &str, at, size, anchor, running| {
            shapes.push(Shape::Text {
                text: words.to_owned(),
                at,
                size,
                anchor,
                running,
            });
        };
        for tick in &across.ticks {
            let [column, row] = place([tick.fraction, 0.0]);
            let at = [column, row + 1.1 * text];
            write(&tick.label, at, text, Anchor::Middle, Running::Across);
        }
        for tick in &upright.ticks {
            let [column, row] = place([0.0, tick.fraction]);
            let at = [column - 0.7 * text, row];
            write(&tick.label, at, text, Anchor::End, Running::Across);
        }
        let [column, row] = place([0.5, 0.5]);
        let captions = [(&across, self.x.name), (&upright, self.y.name)];
        let [below, beside] = captions.map(|(scale, name)| match name {
            "" => scale.unit.clone(),
            name => scale.caption(name),
        });
        let at = [column, rows[1] + 2.9 * text];
        write(&below, at, text, Anchor::Middle, Running::Across);
        write(
            &beside,
            [1.2 * text, row],
            text,
            Anchor::Middle,
            Running::Upwards,
        );
        let available = columns[1] - columns[0];
        let size = 1.15 * text;
        let size = size * (available / lettering.length(self.title, size)).min(1.0);
        let at = [column, rows[0] - 1.3 * text];
        write(self.title, at, size, Anchor::Middle, Running::Across);

        let pixel =
            |[x, y]: [f64; 2]| place([(x - left) / (right - left), (y - low) / (high - low)]);
        let curves: Vec<Vec<Vec<[f64; 2]>>> = self
            .series
            .iter()
            .map(|series| reduced(series.points.iter().map(|point| pixel(*point))))
            .collect();
        for (number, parts) in curves.iter().enumerate() {
            for points in parts {
                match points[..] {
                    [point] => mark(&mut shapes, point, number, MARKER * thickness),
                    _ => stroke(&mut shapes, points, number, 1.8 * thickness),
                }
            }
        }
        if self.series.len() > 1 {
            // A line between two distant points can cross a possible place of the legend, so each line is
            // sampled.
            let step = |ends: &[[f64; 2]], k: usize| {
                let share = k as f64 / LINE_SAMPLES as f64;
                [0, 1].map(|axis| ends[0][axis] + share * (ends[1][axis] - ends[0][axis]))
            };
            let mut drawn = Vec::new();
            for points in curves.iter().flatten() {
                for ends in points.windows(2) {
                    drawn.extend((0..LINE_SAMPLES).map(|k| step(ends, k)));
                }
                drawn.extend(points.last());
            }
            self.legend(&mut shapes, lettering, (columns, rows, text), &drawn);
        }
        shapes
    }

    /// Draw the legend in the corner of the frame where the legend covers the fewest samples of the curves.
    /// `drawn` contains these samples. `columns` and `rows` are the edges of the frame, and `text` is the
    /// text size, all in pixels.
    fn legend(
        &self,
        shapes: &mut Vec<Shape>,
        lettering: &Lettering,
        (columns, rows, text): ([f64; 2], [f64; 2], f64),
        drawn: &[[f64; 2]],
    ) {
        let names = self.series.iter().map(|series| &series.name);
        let longest = names.fold(0.0, |longest: f64, name| {
            longest.max(lettering.length(name, text))
        });
        let size = [
            longest + 4.4 * text,
            1.5 * text * self.series.len() as f64 + 0.6 * text,
        ];
        let gap = 0.6 * text;
        let lefts = [columns[0] + gap, columns[1] - gap - size[0]];
        let tops = [rows[0] + gap, rows[1] - gap - size[1]];
        let places = [(1, 0), (0, 0), (1, 1), (0, 1)].map(|(side, end)| [lefts[side], tops[end]]);
        let covered = |place: &[f64; 2]| {
            let inside = |point: &&[f64; 2]| {
                (0..2).all(|axis| (place[axis]..place[axis] + size[axis]).contains(&point[axis]))
            };
            drawn.iter().filter(inside).count()
        };
        let Some([left, top]) = places.into_iter().min_by_key(covered) else {
            return;
        };
        for (grow, colour) in [((text / 15.0).max(1.0), GRID), (0.0, [255; 3])] {
            shapes.push(Shape::Rectangle {
                columns: [left - grow, left + size[0] + grow],
                rows: [top - grow, top + size[1] + grow],
                colour,
            });
        }
        for (number, series) in self.series.iter().enumerate() {
            let row = (top + (1.05 + 1.5 * number as f64) * text).round();
            let ends = [[left + 0.6 * text, row], [left + 3.0 * text, row]];
            stroke(shapes, &ends, number, 1.8 * (text / 15.0).max(1.0));
            shapes.push(Shape::Text {
                text: series.name.clone(),
                at: [left + 3.6 * text, row],
                size: text,
                anchor: Anchor::Start,
                running: Running::Across,
            });
        }
    }

    /// Return the range of the finite points along an axis (0 for x, 1 for y), with a margin.
    fn range(&self, axis: usize) -> [f64; 2] {
        let all = self.series.iter().flat_map(|series| &series.points);
        let usable = all.filter(|point| point.iter().all(|number| number.is_finite()));
        let [low, high] = usable.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], point| {
            [low.min(point[axis]), high.max(point[axis])]
        });
        let size = low.abs().max(high.abs());
        match high - low {
            spread if spread.is_finite() && spread > 1e-12 * size => {
                [low - MARGIN * spread, high + MARGIN * spread]
            }
            spread if spread.is_finite() && size > 0.0 => [low - 0.1 * size, high + 0.1 * size],
            spread if spread.is_finite() => [-1.0, 1.0],
            _ => [0.0, 1.0],
        }
    }
}

/// Create a scale with at most n + 1 ticks, where n is `most_intervals` limited to the range from 2 to 9.
fn scale(low: f64, high: f64, unit: &str, most_intervals: f64) -> Scale {
    let magnitude = low.abs().max(high.abs()) / (1.0 + MARGIN);
    Scale::new(
        low,
        high,
        unit,
        magnitude,
        (most_intervals as usize).clamp(2, 9),
    )
}

/// Split a curve at points that are not finite, and leave out points within [`RESOLUTION`] of the previous
/// point. Positions are in pixels.
fn reduced(pixels: impl Iterator<Item = [f64; 2]>) -> Vec<Vec<[f64; 2]>> {
    let mut curves = vec![Vec::new()];
    for pixel in pixels {
        let Some(curve) = curves.last_mut() else {
            break;
        };
        let near = |last: &[f64; 2]| (last[0] - pixel[0]).hypot(last[1] - pixel[1]) < RESOLUTION;
        if !pixel.iter().all(|number| number.is_finite()) {
            curves.push(Vec::new());
        } else if !curve.last().is_some_and(near) {
            curve.push(pixel);
        }
    }
    curves.retain(|curve| !curve.is_empty());
    curves
}

/// Draw a curve. Its number selects its colour and its dashes.
fn stroke(shapes: &mut Vec<Shape>, points: &[[f64; 2]], number: usize, thickness: f64) {
    let colour = COLOURS[number % COLOURS.len()];
    let lines = match DASHES[number / COLOURS.len() % DASHES.len()] {
        None => vec![points.to_vec()],
        Some(dash) => dashed(points, dash.map(|length| length * thickness)),
    };
    shapes.extend(lines.into_iter().map(|points| Shape::Polyline {
        points,
        thickness,
        colour,
    }));
}

/// Draw a square at an isolated point, in the colour of the curve with this number.
fn mark(shapes: &mut Vec<Shape>, point: [f64; 2], number: usize, size: f64) {
    let [columns, rows] = point.map(|centre| [centre - size / 2.0, centre + size / 2.0]);
    shapes.push(Shape::Rectangle {
        columns,
        rows,
        colour: COLOURS[number % COLOURS.len()],
    });
}

/// Split a curve into dashes. `lengths` are the lengths of dash and gap, pixels.
fn dashed(points: &[[f64; 2]], lengths: [f64; 2]) -> Vec<Vec<[f64; 2]>> {
    let (mut dashes, mut phase, mut left) = (Vec::new(), 0, lengths[0]);
    let mut dash: Vec<[f64; 2]> = points.first().copied().into_iter().collect();
    for ends in points.windows(2) {
        let along = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
        let length = along[0].hypot(along[1]);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let at = [0, 1].map(|axis| ends[0][axis] + done / length * along[axis]);
            dash.push(at);
            if phase == 0 {
                dashes.push(std::mem::take(&mut dash));
            }
            phase = 1 - phase;
            left = lengths[phase];
            dash = vec![at];
        }
        left -= length - done;
        dash.push(ends[1]);
    }
    if phase == 0 {
        dashes.push(dash);
    }
    dashes
}

/// Format a colour as `#rrggbb`.
fn hexadecimal([red, green, blue]: Colour) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Escape a text for XML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(name: &str, points: &[[f64; 2]]) -> Series {
        Series {
            name: name.to_owned(),
            points: points.to_vec(),
        }
    }

    fn chart<'a>(series: &'a [Series]) -> Chart<'a> {
        Chart {
            title: "a < b",
            x: Label {
                name: "time",
                unit: "s",
            },
            y: Label {
                name: "",
                unit: "J",
            },
            series,
            width: 600,
        }
    }

    fn pixels(image: &Image, colour: Colour) -> Vec<[u32; 2]> {
        let rows = 0..image.height;
        let all = rows.flat_map(|row| (0..image.width).map(move |column| [column, row]));
        all.filter(|[column, row]| image.pixel(*column, *row) == colour)
            .collect()
    }

    #[test]
    fn curves_run_where_their_points_are() {
        let series = [
            series("up", &[[0.0, 0.0], [1.0, 1.0], [2.0, 1.0]]),
            series("down", &[[0.0, 1.0], [2.0, 0.0]]),
        ];
        let image = chart(&series).image();
        let first = pixels(&image, COLOURS[0]);
        // The upper half also contains the legend, with a sample of the curve.
        let lower = first.iter().filter(|pixel| pixel[1] > image.height / 2);
        let leftmost = lower.min_by_key(|pixel| pixel[0]).unwrap();
        let lowest = first.iter().map(|pixel| pixel[1]).max().unwrap();
        assert!(leftmost[1].abs_diff(lowest) <= 2, "{leftmost:?} {lowest}");
        assert!(pixels(&image, COLOURS[1]).len() > 50);
        assert!(pixels(&image, COLOURS[2]).is_empty());
    }

    #[test]
    fn svg_has_a_curve_for_each_unbroken_part_and_escapes_text() {
        let series = [
            series(
                "one",
                &[
                    [0.0, 0.0],
                    [1.0, 1e-3],
                    [2.0, f64::NAN],
                    [3.0, 0.0],
                    [4.0, 2e-3],
                ],
            ),
            series("other", &[[0.0, 0.0], [4.0, 0.0]]),
        ];
        let svg = chart(&series).svg();
        let curve = format!("stroke=\"{}\"", hexadecimal(COLOURS[0]));
        // Two parts of the curve, and a sample in the legend.
        assert_eq!(svg.matches(&curve).count(), 3, "{svg}");
        for words in [
            "a &lt; b",
            ">time (s)<",
            ">mJ<",
            ">one<",
            ">other<",
            "rotate(-90 ",
        ] {
            assert!(svg.contains(words), "{words}: {svg}");
        }
        assert!(!chart(&series[..1]).svg().contains(">one<"));
    }

    #[test]
    fn isolated_points_have_markers_and_the_legend_covers_curves() {
        let single = [series("one", &[[1.0, 2.0]])];
        assert!(chart(&single).has_points());
        assert!(pixels(&chart(&single).image(), COLOURS[0]).len() >= 9);
        let none = [series("none", &[[1.0, f64::NAN], [f64::INFINITY, 0.0]])];
        assert!(!chart(&none).has_points());
        // A curve crosses all corners of the frame, so the legend hides a part of the curve.
        let corners = [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0], [0.5, 0.5]];
        let svg = chart(&[series("a", &corners), series("b", &[])]).svg();
        // The legend avoids the corner at the top right, which the line between the two points crosses.
        let line = chart(&[series("a", &[[0.0, 0.0], [1.0, 1.0]]), series("b", &[])]).svg();
        let box_left = |svg: &str| -> f64 {
            let end = svg.rfind("fill=\"#ffffff\"").unwrap();
            let start = svg[..end].rfind("x=\"").unwrap() + 3;
            svg[start..].split('"').next().unwrap().parse().unwrap()
        };
        assert!(box_left(&line) < 300.0, "{line}");
        let curve = svg.find(&hexadecimal(COLOURS[0])).unwrap();
        assert!(svg.rfind("fill=\"#ffffff\"").unwrap() > curve, "{svg}");
    }

    #[test]
    fn ranges_are_never_empty() {
        for (points, range) in [
            (vec![], [0.0, 1.0]),
            (vec![[0.0, 0.0]], [-1.0, 1.0]),
            (vec![[5.0, 1.0]], [4.5, 5.5]),
            (vec![[0.0, 1.0], [1.0, 1.0], [9.0, f64::NAN]], [-0.04, 1.04]),
        ] {
            assert_eq!(chart(&[series("", &points)]).range(0), range);
        }
        assert_eq!(chart(&[]).image().width, 600);
    }

    #[test]
    fn dashes_and_gaps_have_their_lengths() {
        let dashes = dashed(&[[0.0, 0.0], [7.0, 0.0], [7.0, 4.0]], [4.0, 2.0]);
        assert_eq!(
            dashes,
            [
                vec![[0.0, 0.0], [4.0, 0.0]],
                vec![[6.0, 0.0], [7.0, 0.0], [7.0, 3.0]],
            ]
        );
    }

    #[test]
    fn points_on_the_same_pixel_are_drawn_once() {
        let curves = reduced(
            [
                [0.0, 0.0],
                [0.1, 0.1],
                [1.0, 0.0],
                [f64::NAN, 0.0],
                [2.0, 0.0],
            ]
            .into_iter(),
        );
        assert_eq!(curves, [vec![[0.0, 0.0], [1.0, 0.0]], vec![[2.0, 0.0]]]);
    }
}
