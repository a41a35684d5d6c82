//! Arrows of a vector field, with a legend.

use std::collections::BTreeMap;

use super::axes::Pen;
use super::canvas::{Colour, INK, Image};
use super::layout::Layout;
use super::lettering::Running;
use super::projection::Projection;
use super::scale::prefixed;
use super::scene::Mark;

/// A vector field of a scene.
#[derive(Debug, Clone, Copy)]
pub struct Vectors<'a> {
    /// Vector of each point.
    pub values: &'a [[f64; 3]],
    /// Name of the field, for the legend.
    pub field: &'a str,
    /// Unit of the vectors, such as m, without a metric prefix; empty if dimensionless.
    pub unit: &'a str,
    /// Length, in the drawing plane, of the vector that the longest arrow represents. The arrows of longer
    /// vectors are cut. `None` to choose this length from the drawn points.
    pub longest_arrow: Option<f64>,
}

/// Length of the longest arrow, in text sizes (heights of the text). The middles of arrows are at least this
/// far apart.
const LONGEST_ARROW: f64 = 2.4;

/// Edge of the square cells into which the picture is divided, in text sizes. Each cell has at most one
/// arrow.
const SPACING: f64 = 3.0;

/// Length of the shortest arrow that is drawn, in pixels.
const SHORTEST_ARROW: f64 = 2.0;

/// Length and half width of the head of an arrow, in text sizes.
const HEAD: [f64; 2] = [0.5, 0.2];

const WHITE: Colour = [255; 3];

/// Draw arrows centred at the points, and draw the legend.
///
/// The length of an arrow is proportional to the length of the projected vector. If a projected vector is
/// longer than `longest`, its arrow is cut to the length of the longest arrow. Only some points have arrows,
/// so that arrows do not overlap.
pub fn draw(
    pen: &mut Pen,
    marks: impl Iterator<Item = (Mark, [f64; 3])>,
    vectors: &Vectors,
    longest: f64,
    layout: &Layout,
    projection: Projection,
) {
    let [reach, cell] = [LONGEST_ARROW, SPACING].map(|size| size * layout.text);
    let scale = if longest > 0.0 { reach / longest } else { 0.0 };
    let roots = marks.map(|(mark, vector)| {
        let [across, up] = projection.project(vector);
        let length = across.hypot(up);
        let is_cut = length > longest * (1.0 + 1e-9);
        let scale = if is_cut { reach / length } else { scale };
        Root {
            place: layout.pixel(projection.project(mark.position)),
            arrow: [scale * across, -scale * up],
            is_cut,
            depth: match projection {
                Projection::Orthographic(camera) => camera.depth(mark.position),
                Projection::Strip | Projection::Flat(_) => 0.0,
            },
        }
    });
    let thickness = pen.thickness();
    let mut any_cut = false;
    for root in thinned(roots, cell, reach) {
        arrow(pen.image, root.place, root.arrow, layout.text, thickness);
        any_cut |= root.is_cut;
    }
    legend(pen, vectors, longest, any_cut, layout);
}

/// A candidate for an arrow.
#[derive(Debug, Clone, Copy)]
struct Root {
    /// Pixel of the middle of the arrow.
    place: [f64; 2],
    /// Vector from the tail to the tip of the arrow, in pixels. Components are positive to the right and
    /// downwards.
    arrow: [f64; 2],
    /// Whether the vector is longer than the vector that the longest arrow represents. The arrow is then cut.
    is_cut: bool,
    /// Depth of the point, m; points with a larger depth are nearer to the camera. 0 in flat views.
    depth: f64,
}

/// Return at most one of the candidates for each square cell of the picture. The returned candidates are at
/// least `reach` away from each other. `cell` (the edge of a cell) and `reach` are in pixels. `reach` is at
/// most `cell`.
///
/// In each cell, the candidate nearest to the camera is chosen. Among candidates of equal depth, the
/// candidate nearest to the centre of the cell is chosen. A chosen candidate is left out if it is too close
/// to the chosen candidate of another cell.
fn thinned(roots: impl Iterator<Item = Root>, cell: f64, reach: f64) -> Vec<Root> {
    let rank = |root: &Root, number: [i64; 2]| {
        let offset = [0, 1].map(|k| root.place[k] / cell - number[k] as f64 - 0.5);
        (root.depth, -offset[0].hypot(offset[1]))
    };
    let mut best: BTreeMap<[i64; 2], Root> = BTreeMap::new();
    for root in roots {
        let number = root.place.map(|pixel| (pixel / cell).floor() as i64);
        let own = best.entry(number).or_insert(root);
        if rank(&root, number) > rank(own, number) {
            *own = root;
        }
    }
    let mut kept: BTreeMap<[i64; 2], Root> = BTreeMap::new();
    for (number, root) in best {
        let is_near = |other: &Root| {
            let [across, down] = [0, 1].map(|k| other.place[k] - root.place[k]);
            across.hypot(down) < reach * (1.0 - 1e-9)
        };
        let mut neighbours = (0..9).map(|k| [number[0] + k % 3 - 1, number[1] + k / 3 - 1]);
        if !neighbours.any(|neighbour| kept.get(&neighbour).is_some_and(is_near)) {
            kept.insert(number, root);
        }
    }
    kept.into_values().collect()
}

/// Draw an arrow with a white border, so that the arrow is visible on all colours. Lengths are in pixels.
fn arrow(image: &mut Image, middle: [f64; 2], vector: [f64; 2], text: f64, thickness: f64) {
    let length = vector[0].hypot(vector[1]);
    if length < SHORTEST_ARROW {
        return;
    }
    let along = vector.map(|component| component / length);
    let at = |ahead: f64, aside: f64| {
        [
            middle[0] + ahead * along[0] - aside * along[1],
            middle[1] + ahead * along[1] + aside * along[0],
        ]
    };
    // Short arrows have smaller heads of the same shape.
    let part = (length / (2.0 * HEAD[0] * text)).min(1.0);
    let [head, width] = HEAD.map(|size| part * size * text);
    let (tail, tip) = (-length / 2.0, length / 2.0);
    for (colour, border) in [(WHITE, 1.0), (INK, 0.0)] {
        image.line(
            at(tail, 0.0),
            at(tip - head, 0.0),
            thickness + 2.0 * border,
            colour,
        );
        let corners = [
            at(tip + 2.0 * border, 0.0),
            at(tip - head - border, width + 1.5 * border),
            at(tip - head - border, -width - 1.5 * border),
        ];
        image.fill_polygon(&corners, colour);
    }
}

/// Draw the legend at the bottom of the picture: name of the field, an arrow, length of the vector that this
/// arrow represents, and a note if arrows are cut.
fn legend(pen: &mut Pen, vectors: &Vectors, longest: f64, any_cut: bool, layout: &Layout) {
    let (length, mut label) = legend_entry(longest, vectors.unit);
    if any_cut {
        label += " (longer arrows are cut)";
    }
    let pixels = LONGEST_ARROW * layout.text * length / longest.max(f64::MIN_POSITIVE);
    let texts = [vectors.field, &label];
    let lengths = texts.map(|text| pen.lettering.length(text, layout.text));
    let gap = 0.6 * layout.text;
    let mut column = (layout.columns[0] + layout.columns[1]
        - (lengths[0] + lengths[1] + pixels + 2.0 * gap))
        / 2.0;
    let row = layout.height - 1.2 * layout.text;
    pen.write(texts[0], [column + lengths[0] / 2.0, row], Running::Across);
    column += lengths[0] + gap;
    let middle = [column + pixels / 2.0, row];
    arrow(
        pen.image,
        middle,
        [pixels, 0.0],
        layout.text,
        pen.thickness(),
    );
    column += pixels + gap;
    pen.write(texts[1], [column + lengths[1] / 2.0, row], Running::Across);
}

/// Return the vector length for the legend, and the text of this length with its unit. The length is the
/// largest number up to `longest` that is 1, 2 or 5 times a power of ten. It is 0 if `longest` is 0 or less.
fn legend_entry(longest: f64, unit: &str) -> (f64, String) {
    if longest <= 0.0 {
        return (0.0, format!("0 {unit}").trim_end().to_owned());
    }
    let power = 10_f64.powf(longest.log10().floor());
    let mut digits = [5.0, 2.0].into_iter();
    let digit = digits.find(|digit| digit * power <= longest * (1.0 + 1e-9));
    let length = digit.unwrap_or(1.0) * power;
    let (exponent, unit) = prefixed(unit, length);
    let number = length * 10_f64.powi(-exponent);
    let digits = format!("{number:.4}");
    let digits = digits.trim_end_matches('0').trim_end_matches('.');
    (length, format!("{digits} {unit}").trim_end().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrows_do_not_overlap_and_those_in_front_are_kept() {
        let lattice = |spacing: f64, depth: f64| {
            (0..10_000).map(move |k| Root {
                place: [f64::from(k % 100) * spacing, f64::from(k / 100) * spacing],
                arrow: [1.0, 0.0],
                is_cut: false,
                depth,
            })
        };
        for spacing in [0.7, 3.1, 11.0, 25.0, 60.0] {
            let all = lattice(spacing, 0.0).chain(lattice(spacing, 1.0));
            let kept = thinned(all, 30.0, 24.0);
            assert!(kept.iter().all(|root| root.depth == 1.0));
            for (k, one) in kept.iter().enumerate() {
                for other in &kept[..k] {
                    let [x, y] = [0, 1].map(|axis| one.place[axis] - other.place[axis]);
                    assert!(x.hypot(y) > 23.9, "{spacing}");
                }
            }
            // At least a quarter of the cells have an arrow. If the points are farther apart than the edge of
            // a cell, all points have an arrow.
            let cells = (99.0 * spacing / 30.0).powi(2).min(10_000.0);
            assert!(kept.len() as f64 > cells / 4.0, "{spacing}: {}", kept.len());
            assert_eq!(kept.len() == 10_000, spacing > 30.0);
        }
    }

    #[test]
    fn legend_has_a_round_length() {
        for (longest, unit, length, text) in [
            (7.3, "m/s", 5.0, "5 m/s"),
            (5.0, "m/s", 5.0, "5 m/s"),
            (4.9, "m/s", 2.0, "2 m/s"),
            (0.0123, "m", 0.01, "10 mm"),
            (1999.0, "", 1000.0, "1000"),
            (0.35, "", 0.2, "0.2"),
        ] {
            let (found, label) = legend_entry(longest, unit);
            assert!((found / length - 1.0).abs() < 1e-9, "{found} {length}");
            assert_eq!(label, text);
        }
        assert_eq!(legend_entry(0.0, "m"), (0.0, "0 m".to_owned()));
    }
}
