//! The discretization of Peridigm: point files, meshes, generated grids.

use crate::error::{Result, excerpt};
use crate::import::bond_filters::bond_filters;
use crate::import::draft::Value;
use crate::import::files::PointFile;
use crate::import::translation::Translation;
use crate::import::tree::{Node, is_key};

/// Columns of a text file without header.
const COLUMNS: [&str; 5] = ["x", "y", "z", "block", "volume"];

/// Source of the blocks' points.
pub(super) enum Points {
    /// A text file, and its summary. The summary is `None` if the file cannot be read.
    File(Value, Option<PointFile>),
    /// A mesh.
    Mesh(Value),
    /// A box that is filled with points at the spacing of `[grid]`.
    Box(Value),
}

/// Read the source of the points, and write the bond filters.
pub(super) fn points(translation: &mut Translation, node: &Node) -> Result<Points> {
    let kind = translation.required(node, "Type", "the discretization")?;
    let name = translation.text(kind, "Type")?.to_owned();
    translation.log.taken(kind, "points of the bodies");
    if let Some(filters) = node.get("Bond Filters") {
        bond_filters(translation, filters)?;
    }
    if let Some(neighbourhood) = node.get("NeighborhoodType") {
        if neighbourhood
            .text()
            .is_some_and(|text| is_key(text, "Spherical"))
        {
            translation.log.taken(neighbourhood, "families are spheres")
        } else {
            translation
                .log
                .approximated(neighbourhood, "families are spheres")
        }
    }
    if is_key(&name, "PdQuickGrid") {
        return quick_grid(translation, node);
    }
    let is_text = is_key(&name, "Text File");
    if !is_text && !is_key(&name, "Exodus") {
        let message = format!(
            "the discretization {} is not read; known are Text File, Exodus and PdQuickGrid",
            excerpt(&name)
        );
        return Err(translation.error(kind.line, message));
    }
    let file = translation.required(node, "Input Mesh File", "the discretization")?;
    let path = translation.text(file, "Input Mesh File")?.to_owned();
    let value = translation.file(&path);
    let grid = translation.draft.section("grid");
    grid.set("volume_correction", Value::text("none"));
    if is_text {
        let known = PointFile::read(&translation.path(&path), &COLUMNS);
        let note = match known {
            Some(_) => "points.file of the bodies",
            None => "points.file of the bodies; it cannot be read yet",
        };
        translation.log.taken(file, note);
        return Ok(Points::File(value, known));
    }
    translation.log.taken(file, "points.mesh of the bodies");
    Ok(Points::Mesh(value))
}

/// Translate the box of a generated grid.
fn quick_grid(translation: &mut Translation, node: &Node) -> Result<Points> {
    let Some(generator) = node.get("TensorProduct3DMeshGenerator") else {
        let message = "PdQuickGrid needs a TensorProduct3DMeshGenerator; cylinders are not read";
        return Err(translation.error(node.line, message));
    };
    if let Some(kind) = generator.get("Type") {
        translation.log.taken(kind, "points of the bodies");
    }
    let (mut lower, mut upper, mut spacing) = (Vec::new(), Vec::new(), Vec::new());
    for axis in ["X", "Y", "Z"] {
        let number = |key: &str| {
            let node = translation.required(generator, key, "the generator")?;
            translation
                .log
                .taken(node, "the box of the body, and [grid] spacing and origin");
            translation.number(node, key)
        };
        let origin = number(&format!("{axis} Origin"))?;
        let length = number(&format!("{axis} Length"))?;
        let key = format!("Number Points {axis}");
        let count = number(&key)?;
        if count < 1.0 || length <= 0.0 {
            let message = format!("`{key}` must be 1 or more, and `{axis} Length` above 0");
            return Err(translation.error(generator.line, message));
        }
        lower.push(origin);
        upper.push(origin + length);
        spacing.push(length / count);
    }
    let dimension = translation.dimension;
    let grid = translation.draft.section("grid");
    let is_cube = spacing[..dimension].iter().all(|edge| *edge == spacing[0]);
    grid.set(
        "spacing",
        if is_cube {
            Value::number(spacing[0])
        } else {
            Value::numbers(&spacing[..dimension])
        },
    );
    grid.set("origin", Value::numbers(&lower[..dimension]));
    grid.set("volume_correction", Value::text("none"));
    Ok(Points::Box(Value::Table(vec![
        ("lower".to_owned(), Value::numbers(&lower[..dimension])),
        ("upper".to_owned(), Value::numbers(&upper[..dimension])),
    ])))
}

/// The influence function of a deck.
pub(super) struct Influence {
    /// Node of the key `Influence Function` in the source deck.
    pub(super) node: Node,
    /// Name of Fissure's influence function; `None` if there is no counterpart.
    pub(super) known: Option<&'static str>,
    /// Value of the key `influence` in the new deck; `None` if it is the default or there is no counterpart.
    pub(super) written: Option<&'static str>,
    /// How the new function differs from Peridigm's; empty if both are equal.
    pub(super) difference: &'static str,
}

/// Read the influence function, which is the same for all materials; `None` if the deck gives none.
pub(super) fn influence(translation: &Translation, node: &Node) -> Result<Option<Influence>> {
    let Some(function) = node.get("Influence Function") else {
        return Ok(None);
    };
    let text = translation.text(function, "Influence Function")?;
    let bare: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    let bare = bare.trim_end_matches(';').trim_start_matches("value=");
    let (known, difference) = match bare {
        "One" => (Some("constant"), ""),
        "1.0/zeta" | "1/zeta" | "horizon/zeta" => (Some("inverse"), ""),
        "1.0-zeta/horizon" | "1-zeta/horizon" => (Some("linear"), ""),
        "Gaussian" => (Some("gaussian"), "exp(−4ξ²/δ²) in place of exp(−6.25ξ²/δ²)"),
        "ParabolicDecay" | "Parabolic_Decay" => {
            (Some("linear"), "in place of a parabola from half a horizon")
        }
        _ => (None, ""),
    };
    Ok(Some(Influence {
        node: function.clone(),
        known,
        written: known.filter(|known| *known != "constant"),
        difference,
    }))
}

/// Read the block number from the name of a block. If the points are in a text file, the name has the
/// form `block_NUMBER`.
pub(super) fn block_number(block: &str) -> Option<u32> {
    block.rsplit('_').next()?.parse().ok()
}

/// Return the key and the value of the new deck that give the points of a block.
pub(super) fn source(
    translation: &Translation,
    points: &Points,
    block: &str,
    line: usize,
) -> Result<(String, Value)> {
    match points {
        Points::Box(shape) => Ok(("shape.box".to_owned(), shape.clone())),
        Points::Mesh(file) => {
            let mut table = vec![("mesh".to_owned(), file.clone())];
            if block != "default" {
                table.push(("block".to_owned(), Value::text(block)));
            }
            Ok(("points".to_owned(), Value::Table(table)))
        }
        Points::File(file, known) => {
            let Some(number) = block_number(block) else {
                let message = format!(
                    "the block {} of a text file must be block_NUMBER",
                    excerpt(block)
                );
                return Err(translation.error(line, message));
            };
            let mut table = vec![
                ("file".to_owned(), file.clone()),
                ("block".to_owned(), Value::Number(number.to_string())),
            ];
            if known.as_ref().is_none_or(|file| file.names.is_none()) {
                let columns = COLUMNS.iter().map(|name| Value::text(*name));
                table.push(("columns".to_owned(), Value::list(columns)));
            }
            Ok(("points".to_owned(), Value::Table(table)))
        }
    }
}
