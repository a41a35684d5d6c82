//! Bond filters of Peridigm and PeriLab: surfaces that cut bonds. These become pre-cracks.

use super::draft::{Section, Value};
use super::translation::Translation;
use super::tree::Node;
use crate::error::Result;

/// Tolerance for the angle between the `Bottom Unit Vector` and the `Normal` of a rectangle. The two vectors
/// count as perpendicular if |cos| of the angle is at most this value. They count as parallel if the sine of
/// the angle is at most this value.
const SLANT: f64 = 1e-9;

/// Write a pre-crack for each bond filter of a table.
///
/// # Errors
/// If a key is missing or not a number.
pub fn bond_filters(translation: &mut Translation, filters: &Node) -> Result<()> {
    for (name, filter) in filters.tables() {
        let kind = translation.required(filter, "Type", &format!("the bond filter `{name}`"))?;
        let kind_name = translation
            .text(kind, "Type")?
            .to_lowercase()
            .replace('_', " ");
        match kind_name.as_str() {
            "rectangular plane" => plane(translation, name, filter, kind)?,
            "disk" => disc(translation, name, filter, kind)?,
            _ => translation.log.left_out(
                filter,
                "only rectangular planes and discs can be pre-cracks",
            ),
        }
    }
    Ok(())
}

/// Read the components of a vector from three keys. If `key` is `Normal`, the three keys are `Normal X`,
/// `Normal Y` and `Normal Z`. In 2-D the last of them may be missing.
fn vector(translation: &Translation, filter: &Node, key: &str, note: &str) -> Result<[f64; 3]> {
    let mut vector = [0.0; 3];
    for (k, axis) in ["X", "Y", "Z"].iter().enumerate() {
        let key = format!("{key} {axis}");
        let node = match filter.get(&key) {
            None if k >= translation.dimension => continue,
            _ => translation.required(filter, &key, "the bond filter")?,
        };
        vector[k] = translation.number(node, &key)?;
        if k < translation.dimension {
            translation.log.taken(node, note)
        } else {
            translation.log.left_out(node, "the problem has no z")
        }
    }
    Ok(vector)
}

fn length(translation: &Translation, filter: &Node, key: &str, note: &str) -> Result<f64> {
    let node = translation.required(filter, key, "the bond filter")?;
    translation.log.taken(node, note);
    translation.number(node, key)
}

fn scaled(vector: [f64; 3], factor: f64) -> [f64; 3] {
    vector.map(|component| factor * component)
}

/// Scale a vector to length 1; the zero vector is returned unchanged.
fn unit(vector: [f64; 3]) -> [f64; 3] {
    let length = vector.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length > 0.0 {
        scaled(vector, 1.0 / length)
    } else {
        vector
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// Write a rectangle as a pre-crack; in 2-D, write the bottom edge of the rectangle as a segment.
///
/// ub is the bottom unit vector, n the normal, b the bottom length and a the side length. The bottom edge is
/// b·ub and the side edge is a·(ub × n). Both edges start at the corner.
fn plane(translation: &mut Translation, name: &str, filter: &Node, kind: &Node) -> Result<()> {
    let written = translation.name("crack", name);
    let shape = match translation.dimension {
        3 => "rectangle",
        _ => "segment",
    };
    let header = format!("[crack.{written}.{shape}]");
    let normal = unit(vector(translation, filter, "Normal", &header)?);
    let corner = vector(translation, filter, "Lower Left Corner", &header)?;
    let given = unit(vector(translation, filter, "Bottom Unit Vector", &header)?);
    let bottom_length = length(translation, filter, "Bottom Length", &header)?;
    // Peridigm and PeriLab project the position of an intersection on ub and on ub × n. If ub is not in the
    // plane, both edges are therefore longer by the factor 1/|ub_t|, where ub_t is the part of ub in the
    // plane.
    let along: f64 = given.iter().zip(&normal).map(|(g, n)| g * n).sum();
    let (mut bottom, mut stretch) = (given, 1.0);
    if along.abs() > SLANT {
        let part: [f64; 3] = std::array::from_fn(|k| given[k] - along * normal[k]);
        let share = (1.0 - along * along).max(0.0).sqrt();
        if share <= SLANT {
            let note = "the bottom unit vector is parallel to the normal";
            translation.log.left_out(filter, note);
            return Ok(());
        }
        bottom = unit(part);
        stretch = 1.0 / share;
        let note = "the part of the bottom unit vector along the normal is removed, and both lengths are divided by \
                    the length of the rest";
        translation.log.approximated(kind, note);
    }
    let edge = scaled(bottom, stretch * bottom_length);
    translation.log.taken(kind, &header);
    let mut section = Section::new(format!("crack.{written}.{shape}"));
    if translation.dimension == 3 {
        let side_length = length(translation, filter, "Side Length", &header)?;
        let side = scaled(cross(bottom, normal), stretch * side_length);
        section
            .set("corner", Value::numbers(&corner))
            .set("edge_a", Value::numbers(&edge))
            .set("edge_b", Value::numbers(&side));
    } else {
        let end = [corner[0] + edge[0], corner[1] + edge[1]];
        section
            .set("from", Value::numbers(&corner[..2]))
            .set("to", Value::numbers(&end));
        if let Some(side) = filter.get("Side Length") {
            translation.log.left_out(side, "the problem has no z");
        }
    }
    translation.add(section);
    Ok(())
}

/// Write a disc as a pre-crack; in 2-D, write a segment perpendicular to the disc's normal.
fn disc(translation: &mut Translation, name: &str, filter: &Node, kind: &Node) -> Result<()> {
    let written = translation.name("crack", name);
    let shape = match translation.dimension {
        3 => "disc",
        _ => "segment",
    };
    let header = format!("[crack.{written}.{shape}]");
    let centre = vector(translation, filter, "Center", &header)?;
    let normal = unit(vector(translation, filter, "Normal", &header)?);
    let radius = length(translation, filter, "Radius", &header)?;
    translation.log.taken(kind, &header);
    let mut section = Section::new(format!("crack.{written}.{shape}"));
    if translation.dimension == 3 {
        section
            .set("centre", Value::numbers(&centre))
            .set("normal", Value::numbers(&normal))
            .set("radius", Value::number(radius));
    } else {
        let half = [-radius * normal[1], radius * normal[0]];
        let end = |sign: f64| [centre[0] + sign * half[0], centre[1] + sign * half[1]];
        section
            .set("from", Value::numbers(&end(-1.0)))
            .set("to", Value::numbers(&end(1.0)));
    }
    translation.add(section);
    Ok(())
}
