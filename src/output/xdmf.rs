//! The XDMF 3 side-car, with which ParaView before 5.12 opens a result file. As in VTKHDF, the word "step"
//! means an output, not a time step.

use super::field::{FieldDescription, Number};
use super::read::StoredField;
use super::vtkhdf::Contents;
use crate::error::{Error, Result};
use std::fmt::{self, Write as _};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Minimum interval between writes of the side-car, as a multiple of the duration of the last write.
const MIN_INTERVAL: u32 = 100;

/// Component names of a symmetric tensor in storage order.
const SYMMETRIC: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];

/// Render the side-car of a result file.
///
/// `file_name` is the name of the result file without its folder, and `points` is the number of points at
/// each of the `times` (s). If `changing`, each step has its own points.
pub fn render(
    file_name: &str,
    (points, changing): (&[usize], bool),
    fields: &[StoredField],
    times: &[f64],
) -> String {
    let mut text = String::new();
    let written = write_document(&mut text, file_name, (points, changing), fields, times);
    debug_assert!(written.is_ok(), "writing to a string cannot fail");
    text
}

/// The side-car of a growing result. The side-car is written with the first step and updated as the result
/// grows, so it exists even if the process is killed. Only one rank has a side-car.
pub struct SideCar {
    path: PathBuf,
    file_name: String,
    /// Whether each step has its own points.
    changing: bool,
    fields: Vec<StoredField>,
    /// Times of the steps, s.
    times: Vec<f64>,
    /// Number of points of each step.
    points: Vec<usize>,
    /// End and duration of the last write.
    written: Option<(Instant, Duration)>,
}

impl SideCar {
    /// Create the side-car `name.xdmf` of a result `name.vtkhdf`. `past` holds time (s) and number of points
    /// of each existing step.
    pub fn new(result: &Path, contents: &Contents, past: &[(f64, usize)]) -> Self {
        let stored = |field: &FieldDescription, dynamic| StoredField {
            name: field.name.to_owned(),
            unit: field.unit.to_owned(),
            components: match field.components {
                2 => 3,
                others => others,
            },
            number: field.number,
            dynamic,
        };
        let fixed = contents.fixed.iter();
        let fixed = fixed.map(|(field, _)| stored(field, contents.changing));
        let moving = contents.moving.iter();
        let moving = moving.map(|field| stored(field, true));
        let mut fields: Vec<StoredField> = fixed.chain(moving).collect();
        fields.sort_by(|a, b| a.name.cmp(&b.name));
        let name = result.file_name().unwrap_or_default();
        Self {
            path: result.with_extension("xdmf"),
            file_name: name.to_string_lossy().into_owned(),
            changing: contents.changing,
            fields,
            times: past.iter().map(|(time, _)| *time).collect(),
            points: past.iter().map(|(_, points)| *points).collect(),
            written: None,
        }
    }

    /// Add a step with its time (s) and number of points. Write the side-car, unless the last write is too
    /// recent (see `MIN_INTERVAL`).
    ///
    /// # Errors
    /// If the side-car cannot be written.
    pub fn add(&mut self, time: f64, points: u64) -> Result<()> {
        self.times.push(time);
        self.points.push(points as usize);
        let is_cheap = |(when, cost): &(Instant, Duration)| when.elapsed() >= *cost * MIN_INTERVAL;
        if self.written.as_ref().is_none_or(is_cheap) {
            self.write()?;
        }
        Ok(())
    }

    /// Write the final side-car.
    ///
    /// # Errors
    /// If the side-car cannot be written.
    pub fn finish(mut self) -> Result<()> {
        self.write()
    }

    fn write(&mut self) -> Result<()> {
        let start = Instant::now();
        let points = (&self.points[..], self.changing);
        let text = render(&self.file_name, points, &self.fields, &self.times);
        write(&self.path, &text)?;
        self.written = Some((Instant::now(), start.elapsed()));
        Ok(())
    }
}

/// Write a text file atomically: to a temporary file that is then renamed.
fn write(path: &Path, text: &str) -> Result<()> {
    let temporary = path.with_extension("xdmf.part");
    std::fs::write(&temporary, text)
        .and_then(|()| std::fs::rename(&temporary, path))
        .map_err(|error| {
            // Best effort: a leftover file only takes space.
            let _ = std::fs::remove_file(&temporary);
            Error::run(format!(
                "{}: cannot write the file: {error}",
                path.display()
            ))
        })
}

fn write_document(
    text: &mut String,
    file_name: &str,
    (points, changing): (&[usize], bool),
    fields: &[StoredField],
    times: &[f64],
) -> fmt::Result {
    let file = escaped(file_name);
    writeln!(text, r#"<?xml version="1.0" encoding="utf-8"?>"#)?;
    writeln!(text, r#"<Xdmf Version="3.0">"#)?;
    writeln!(text, "<Domain>")?;
    writeln!(
        text,
        r#"<Grid Name="points" GridType="Collection" CollectionType="Temporal">"#
    )?;
    let all: usize = points.iter().sum();
    let mut first = 0;
    for ((step, time), points) in times.iter().enumerate().zip(points) {
        let rows = StepRows {
            first,
            points: *points,
            all,
        };
        writeln!(text, r#"<Grid Name="step {step}" GridType="Uniform">"#)?;
        writeln!(text, r#"<Time Value="{time:?}"/>"#)?;
        let kind = r#"TopologyType="Polyvertex" NodesPerElement="1""#;
        writeln!(text, r#"<Topology {kind} NumberOfElements="{points}"/>"#)?;
        writeln!(text, r#"<Geometry GeometryType="XYZ">"#)?;
        let dataset = format!("{file}:/VTKHDF/Points");
        if changing {
            writeln!(
                text,
                r#"<DataItem ItemType="HyperSlab" Dimensions="{points} 3">"#
            )?;
            let slab = format!("{first} 0 1 1 {points} 3");
            writeln!(
                text,
                r#"<DataItem Dimensions="3 2" Format="XML">{slab}</DataItem>"#
            )?;
            write_item(text, Number::F64, &format!("{all} 3"), &dataset)?;
            writeln!(text, "</DataItem>")?;
        } else {
            write_item(text, Number::F64, &format!("{points} 3"), &dataset)?;
        }
        writeln!(text, "</Geometry>")?;
        for field in fields {
            write_attribute(text, &file, field, rows)?;
        }
        writeln!(text, "</Grid>")?;
        first += points;
    }
    writeln!(text, "</Grid>\n</Domain>\n</Xdmf>")
}

/// The rows of a step in the datasets of fields that change in time: first row of the step, number of points
/// of the step, and number of rows of all steps.
#[derive(Clone, Copy)]
struct StepRows {
    first: usize,
    points: usize,
    all: usize,
}

/// Write one field of one step. A symmetric tensor becomes six scalars, because readers disagree on
/// XDMF's component order.
fn write_attribute(
    text: &mut String,
    file: &str,
    field: &StoredField,
    StepRows { first, points, all }: StepRows,
) -> fmt::Result {
    let (name, components) = (escaped(&field.name), field.components);
    let dataset = format!("{file}:/VTKHDF/PointData/{name}");
    let (first, rows) = if field.dynamic {
        (first, all)
    } else {
        (0, points)
    };
    let parts: Vec<_> = match components {
        6 => SYMMETRIC
            .iter()
            .map(|part| (format!("{name}_{part}"), "Scalar", 1))
            .collect(),
        3 => vec![(name, "Vector", 3)],
        1 => vec![(name, "Scalar", 1)],
        _ => vec![(name, "Tensor", components)],
    };
    for (column, (name, kind, width)) in parts.iter().enumerate() {
        writeln!(
            text,
            r#"<Attribute Name="{name}" AttributeType="{kind}" Center="Node">"#
        )?;
        let part = shape(points, *width);
        let (axes, slab) = match components {
            1 => (1, format!("{first} 1 {points}")),
            _ => (2, format!("{first} {column} 1 1 {points} {width}")),
        };
        writeln!(
            text,
            r#"<DataItem ItemType="HyperSlab" Dimensions="{part}">"#
        )?;
        writeln!(
            text,
            r#"<DataItem Dimensions="3 {axes}" Format="XML">{slab}</DataItem>"#
        )?;
        write_item(text, field.number, &shape(rows, components), &dataset)?;
        writeln!(text, "</DataItem>\n</Attribute>")?;
    }
    Ok(())
}

fn shape(rows: usize, columns: usize) -> String {
    match columns {
        1 => format!("{rows}"),
        _ => format!("{rows} {columns}"),
    }
}

fn write_item(text: &mut String, number: Number, dimensions: &str, dataset: &str) -> fmt::Result {
    // XDMF has no 8-byte unsigned integers, so ids are declared as signed integers.
    let (kind, precision) = match number {
        Number::F64 => ("Float", 8),
        Number::F32 => ("Float", 4),
        Number::U64 => ("Int", 8),
        Number::U32 => ("UInt", 4),
        Number::U8 => ("UChar", 1),
    };
    let kind = format!(r#"NumberType="{kind}" Precision="{precision}""#);
    writeln!(
        text,
        r#"<DataItem {kind} Dimensions="{dimensions}" Format="HDF">{dataset}</DataItem>"#
    )
}

fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    text.replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(name: &str, components: usize, dynamic: bool) -> StoredField {
        StoredField {
            name: name.to_owned(),
            unit: String::new(),
            components,
            number: if dynamic { Number::F64 } else { Number::U64 },
            dynamic,
        }
    }

    #[test]
    fn a_step_selects_its_own_rows() {
        let fields = [
            field("id", 1, false),
            field("velocity", 3, true),
            field("damage", 1, true),
            field("stress", 6, true),
        ];
        let text = render("a&b.h5", (&[7; 3], false), &fields, &[0.0, 1e-6, 2e-6]);
        assert!(text.contains(">14 0 1 1 7 3</DataItem>"));
        assert!(text.contains(">14 1 7</DataItem>"));
        assert!(text.contains(">14 4 1 1 7 1</DataItem>"));
        assert!(text.contains(r#"Name="stress_yz" AttributeType="Scalar""#));
        assert!(
            text.contains(
                r#"Dimensions="21 3" Format="HDF">a&amp;b.h5:/VTKHDF/PointData/velocity<"#
            )
        );
        assert!(text.contains(r#"NumberType="Int" Precision="8" Dimensions="7" Format="HDF""#));
        assert!(text.contains(r#"<Time Value="1e-6"/>"#));
        // The velocity is the only field that selects these rows. The positions do not change, so they are
        // not selected per output.
        assert_eq!(text.matches(">7 0 1 1 7 3</DataItem>").count(), 1);
        let text = render("a.h5", (&[7, 9], true), &fields[1..2], &[0.0, 1e-6]);
        assert_eq!(text.matches(">7 0 1 1 9 3</DataItem>").count(), 2);
        assert!(text.contains(r#"Dimensions="16 3" Format="HDF">a.h5:/VTKHDF/Points<"#));
        assert_eq!(
            text.matches("<Grid").count(),
            text.matches("</Grid>").count()
        );
    }
}
