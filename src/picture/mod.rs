//! Pictures of point clouds as PNG files, drawn without another program: coloured cells in a frame with
//! ticks, a title and a colour bar.
//!
//! ```
//! # use fissure::picture::{Scene, View, render};
//! let scene = Scene {
//!     dimension: 2,
//!     positions: &[[0.0, 0.0, 0.0], [0.001, 0.0, 0.0]],
//!     sizes: &[0.001, 0.001],
//!     scattered: &[],
//!     values: &[0.0, 0.4],
//!     field: "damage",
//!     unit: "",
//!     colours: None,
//!     is_logarithmic: false,
//!     title: "two points",
//!     range: Some((0.0, 1.0)),
//!     view: View::Plane,
//!     width: 600,
//!     lines: &[],
//!     contours: &[],
//!     vectors: None,
//!     note: "",
//!     bounds: None,
//! };
//! let image = render(&scene)?;
//! assert_eq!(image.width, 600);
//! # Ok::<(), fissure::error::Error>(())
//! ```

mod arrows;
mod axes;
mod canvas;
mod cells;
pub mod chart;
mod colours;
mod contours;
mod cubes;
pub mod film;
mod layout;
mod lettering;
mod points;
mod projection;
mod scale;
mod scene;

pub use arrows::Vectors;
pub use canvas::Image;
pub use colours::{ColourMap, is_damage};
pub use projection::{Bounds, Camera};
pub use scale::takes_prefix;
pub use scene::{Axis, Scene, View, is_in_slice};

use crate::error::Result;
use axes::{Pen, Ruler};
use canvas::{Colour, INK, PALE_INK, clipped};
use layout::Layout;
use lettering::{Lettering, Running};
use projection::Projection;
use scale::Scale;
use scene::{Mark, Marks};

/// Draw the points of a scene with frame, rulers, title and colour bar.
///
/// # Errors
/// If the scene has 2³² points or more.
pub fn render(scene: &Scene) -> Result<Image> {
    let marks = scene.marks()?;
    let projection = Projection::of(scene);
    let bounds = scene.bounds.unwrap_or_else(|| Bounds::of(marks.iter()));
    let width = scene.width.clamp(200, 16_384);
    let layout = Layout::new(
        width,
        bounds.projected(projection),
        projection,
        scene.vectors.is_some(),
    );
    let colouring = scene.colouring(&marks);
    let mut image = Image::new(width, layout.height as u32);
    let lettering = Lettering::new();
    let mut pen = Pen {
        image: &mut image,
        lettering: &lettering,
        text: layout.text,
    };

    if marks.is_empty() {
        pen.outline(layout.columns, layout.rows);
        let centre = [layout.columns, layout.rows].map(|[low, high]| (low + high) / 2.0);
        pen.write("no points", centre, Running::Across);
    } else {
        if let Projection::Orthographic(camera) = projection {
            hidden_edges(&mut pen, &layout, &bounds, camera);
        }
        let are_flat = matches!(projection, Projection::Flat(_));
        let [scattered, others] = [true, false].map(|scattered| {
            let are_cells = move |mark: &Mark| (are_flat && mark.scattered) == scattered;
            marks.iter().filter(are_cells)
        });
        points::paint(pen.image, others, colouring, &layout, projection);
        cells::paint(
            pen.image,
            scattered,
            |mark| scene.depth(mark),
            colouring,
            &layout,
            projection,
        );
        if let Projection::Flat(_) = projection {
            contour_lines(&mut pen, &layout, projection, scene, &marks);
            lines(&mut pen, &layout, projection, scene);
        }
        match projection {
            Projection::Strip => flat_frame(&mut pen, &layout, &[Axis::X]),
            Projection::Flat(axes) => flat_frame(&mut pen, &layout, &axes),
            Projection::Orthographic(camera) => box_rulers(&mut pen, &layout, &bounds, camera),
        }
        if let Some(vectors) = &scene.vectors {
            let longest = vectors
                .longest_arrow
                .unwrap_or_else(|| marks.longest_arrow());
            let arrows = marks.with_vectors(vectors);
            arrows::draw(&mut pen, arrows, vectors, longest, &layout, projection);
        }
    }
    pen.colour_bar(&layout.bar, colouring, scene.field, scene.unit);
    pen.levels(&layout.bar, colouring, scene.contours);
    let rise = if scene.note.is_empty() { 1.5 } else { 2.35 };
    heading(&mut pen, &layout, scene.title, (1.15, rise));
    heading(&mut pen, &layout, scene.note, (0.85, 1.0));
    Ok(image)
}

/// Colours of lines, distinguishable with colour blindness (Okabe & Ito 2008).
const LINE_COLOURS: [Colour; 3] = [[0, 114, 178], [0, 158, 115], [204, 121, 167]];

/// Draw the lines of a scene over its points. Parts of lines outside the frame are not drawn. The index of a
/// line selects its colour.
fn lines(pen: &mut Pen, layout: &Layout, projection: Projection, scene: &Scene) {
    let thickness = 2.0 * pen.thickness();
    for (number, line) in scene.lines {
        let colour = LINE_COLOURS[number % LINE_COLOURS.len()];
        for ends in line.windows(2) {
            let pixel = |place: [f64; 3]| layout.pixel(projection.project(place));
            let (from, to) = (pixel(ends[0]), pixel(ends[1]));
            if let Some([from, to]) = clipped(from, to, layout.columns, layout.rows) {
                pen.image.line(from, to, thickness, colour);
            }
        }
    }
}

/// Draw the contour lines of a scene. On each line, the interpolated value equals an entry of
/// `scene.contours`. On a logarithmic scale, the logarithms of the values are interpolated.
fn contour_lines(
    pen: &mut Pen,
    layout: &Layout,
    projection: Projection,
    scene: &Scene,
    marks: &Marks,
) {
    if scene.contours.is_empty() {
        return;
    }
    let colouring = scene.colouring(marks);
    let samples = marks.iter().map(|mark| contours::Sample {
        position: layout.pixel(projection.project(mark.position)),
        size: mark.size * layout.scale,
        value: colouring.fraction(mark.value),
    });
    let mut samples: Vec<contours::Sample> = samples.collect();
    if let View::Slice { .. } = scene.effective_view() {
        samples = contours::uncovered(&samples);
    }
    let levels = scene
        .contours
        .iter()
        .map(|level| colouring.fraction(*level));
    let segments = contours::segments(&samples, &levels.collect::<Vec<_>>());
    let thickness = pen.thickness();
    // White borders make the lines visible on all colours.
    for (thickness, colour) in [(3.0 * thickness, [255; 3]), (thickness, INK)] {
        for [from, to] in &segments {
            pen.image.line(*from, *to, thickness, colour);
        }
    }
}

/// Write a line of text above the frame. If the line is too long, reduce the text size. `size` is the text
/// size, and `rise` is the height of the middle of the text above the frame, both in units of `layout.text`.
fn heading(pen: &mut Pen, layout: &Layout, title: &str, (size, rise): (f64, f64)) {
    let size = size * layout.text;
    let available = layout.width - 2.0 * layout.text;
    let length = pen.lettering.length(title, size);
    let size = size * (available / length).min(1.0);
    let half = (length / 2.0).min(available / 2.0);
    let middle = (layout.columns[0] + layout.columns[1]) / 2.0;
    let middle = middle.clamp(layout.text + half, layout.width - layout.text - half);
    let centre = [middle, layout.rows[0] - rise * layout.text];
    let previous = std::mem::replace(&mut pen.text, size);
    pen.write(title, centre, Running::Across);
    pen.text = previous;
}

/// Return the largest number (2 to 10) of intervals between the ticks of a ruler. `from` and `to` are the
/// ends of the ruler, and `text` is the text size, all in pixels. Each label needs a length of `spacing`
/// times `text` along the ruler.
fn most_intervals_on(from: [f64; 2], to: [f64; 2], spacing: f64, text: f64) -> usize {
    let length = (to[0] - from[0]).hypot(to[1] - from[1]);
    ((length / (spacing * text)) as usize).clamp(2, 10)
}

/// Draw the frame of a flat view, with the ruler of the first axis below the frame. If there is a second
/// axis, draw its ruler on the left.
fn flat_frame(pen: &mut Pen, layout: &Layout, axes: &[Axis]) {
    pen.outline(layout.columns, layout.rows);
    let ([left, right], [top, bottom]) = (layout.columns, layout.rows);
    let [low, high] = layout.visible();
    let used = || (0..axes.len()).flat_map(|direction| [low[direction], high[direction]]);
    let magnitude = used().fold(0.0, |largest: f64, number| largest.max(number.abs()));
    let ends = [
        ([left, bottom], [right, bottom], [0.0, 1.0], 5.0),
        ([left, bottom], [left, top], [-1.0, 0.0], 2.6),
    ];
    for (direction, (axis, (from, to, outward, spacing))) in axes.iter().zip(ends).enumerate() {
        let most_intervals = most_intervals_on(from, to, spacing, layout.text);
        let scale = Scale::new(
            low[direction],
            high[direction],
            "m",
            magnitude,
            most_intervals,
        );
        let name = axis.letter();
        pen.ruler(&Ruler {
            from,
            to,
            outward,
            scale: &scale,
            name,
        });
    }
}

/// Draw the three edges of the box that meet in the corner farthest from the camera.
fn hidden_edges(pen: &mut Pen, layout: &Layout, bounds: &Bounds, camera: Camera) {
    let view = Projection::Orthographic(camera);
    let place = |corner| layout.pixel(view.project(bounds.corner(corner)));
    let hidden = camera.to_camera().map(|component| component < 0.0);
    for axis in 0..3 {
        let mut neighbour = hidden;
        neighbour[axis] = !neighbour[axis];
        let thickness = pen.thickness();
        pen.image
            .line(place(hidden), place(neighbour), thickness, PALE_INK);
    }
}

/// Smallest length of a box edge that gets a ruler, in text sizes. The length is measured in the picture.
const LEAST_RULER: f64 = 3.0;

/// Draw the axis triad. For each axis, draw a ruler along an outer edge of the box. An axis that is almost
/// parallel to the direction of view has no ruler.
fn box_rulers(pen: &mut Pen, layout: &Layout, bounds: &Bounds, camera: Camera) {
    let view = Projection::Orthographic(camera);
    let place = |corner| layout.pixel(view.project(bounds.corner(corner)));
    let magnitude = bounds.magnitude(&[Axis::X, Axis::Y, Axis::Z]);
    for axis in [Axis::X, Axis::Y, Axis::Z] {
        let Some((start, outward)) = camera.outer_edge(axis) else {
            continue;
        };
        let mut end = start;
        end[axis.index()] = true;
        let (from, to) = (place(start), place(end));
        if (to[0] - from[0]).hypot(to[1] - from[1]) < LEAST_RULER * layout.text {
            continue;
        }
        let most_intervals = most_intervals_on(from, to, 3.4, layout.text);
        let index = axis.index();
        let scale = Scale::new(
            bounds.low[index],
            bounds.high[index],
            "m",
            magnitude,
            most_intervals,
        );
        let name = axis.letter();
        pen.ruler(&Ruler {
            from,
            to,
            outward,
            scale: &scale,
            name,
        });
    }
    pen.triad(layout, bounds, view);
}
