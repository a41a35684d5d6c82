//! `fissure plot`: a picture of a result.

use crate::cli::outln;
use std::path::{Path, PathBuf};

use fissure::error::{Error, Result};
use fissure::output::ResultReader;
use fissure::picture::{Axis, Scene, View, render};

use super::format::si;
use super::plot_paths::{self, Line};
use super::{PlotArguments, Verbosity, file_error};

/// Largest drawn displacement for `--deform auto`, relative to the body's size.
const AUTOMATIC_DISPLACEMENT: f64 = 0.04;

/// Draw one picture, or one per output.
///
/// # Errors
/// If the file is not a result, or the field or time is missing.
pub fn plot(arguments: &PlotArguments, verbosity: Verbosity) -> Result<()> {
    let result = ResultReader::open(&arguments.result)?;
    let times = result.times()?;
    let chosen = choose_times(&arguments.time, &times)?;
    let path = arguments.output.clone().unwrap_or_else(|| {
        arguments
            .result
            .with_file_name(format!("{}.png", arguments.field))
    });
    let style = PlotStyle::new(arguments, &result)?;
    let factor = match arguments.deform.as_str() {
        "auto" => style.automatic_factor(chosen.last().copied().unwrap_or(0))?,
        text => number(text, "--deform must be `auto` or a number")?,
    };
    for index in &chosen {
        let path = match chosen.len() {
            1 => path.clone(),
            _ => numbered(&path, *index),
        };
        style.draw(*index, times[*index], factor, &path)?;
        if verbosity > Verbosity::Quiet {
            outln!("wrote {}", path.display());
        }
    }
    Ok(())
}

fn number(text: &str, wanted: &str) -> Result<f64> {
    let value = text
        .trim()
        .parse()
        .ok()
        .filter(|value: &f64| value.is_finite());
    value.ok_or_else(|| Error::input(format!("{wanted}, is `{text}`")))
}

/// The indices of the outputs to draw.
fn choose_times(text: &str, times: &[f64]) -> Result<Vec<usize>> {
    let Some(last) = times.len().checked_sub(1) else {
        return Err(Error::input("the result holds no output yet"));
    };
    match text {
        "last" => Ok(vec![last]),
        "all" => Ok((0..=last).collect()),
        text => {
            let wanted = number(text, "--time must be `last`, `all` or a time in s")?;
            let distance = |k: &usize| (times[*k] - wanted).abs();
            let nearest = (0..=last).min_by(|a, b| distance(a).total_cmp(&distance(b)));
            Ok(nearest.into_iter().collect())
        }
    }
}

/// `name.png` → `name_0012.png`.
fn numbered(path: &Path, index: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}_{index:04}.png"))
}

/// Settings of all pictures.
struct PlotStyle<'a> {
    result: &'a ResultReader,
    arguments: &'a PlotArguments,
    dimension: usize,
    title: String,
    unit: String,
    components: usize,
    has_displacement: bool,
    section: f64,
    range: Option<(f64, f64)>,
    view: View,
    /// Lines over the picture, by file.
    paths: Vec<Vec<Line>>,
}

impl<'a> PlotStyle<'a> {
    fn new(arguments: &'a PlotArguments, result: &'a ResultReader) -> Result<Self> {
        let attributes = result.attributes()?;
        let attribute = |name: &str| {
            let found = attributes.iter().find(|(known, _)| known == name);
            found.map(|(_, value)| value.clone()).unwrap_or_default()
        };
        let dimension: usize = attribute("dimension").parse().unwrap_or(3);
        let section: f64 = attribute("out_of_plane_measure").parse().unwrap_or(1.0);
        let fields = result.fields()?;
        let Some(field) = fields.iter().find(|field| field.name == arguments.field) else {
            let names: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
            return Err(Error::input(format!(
                "{} has no field `{}`; it has {}",
                arguments.result.display(),
                arguments.field,
                names.join(", ")
            )));
        };
        if dimension != 2 && !arguments.path.is_empty() {
            return Err(Error::input("--path is for results of plane problems"));
        }
        let paths = arguments.path.iter().map(|path| plot_paths::read(path));
        Ok(Self {
            title: attribute("title"),
            unit: field.unit.clone(),
            components: field.components,
            has_displacement: fields.iter().any(|field| field.name == "displacement"),
            section,
            range: arguments.range.as_deref().map(range).transpose()?,
            view: view(arguments.slice.as_deref(), dimension)?,
            paths: paths.collect::<Result<_>>()?,
            result,
            arguments,
            dimension,
        })
    }

    fn displacements(&self, index: usize) -> Result<Vec<f64>> {
        if self.has_displacement {
            self.result.field("displacement", index)
        } else {
            Ok(vec![0.0; 3 * self.result.points(index)])
        }
    }

    /// A factor of 1, 2 or 5 times a power of ten that makes displacements visible.
    fn automatic_factor(&self, index: usize) -> Result<f64> {
        let positions = self.result.positions(index)?;
        let values = self.displacements(index)?;
        let largest = values
            .iter()
            .filter(|u| u.is_finite())
            .fold(0.0_f64, |a, u| a.max(u.abs()));
        let extent = (0..3)
            .map(|d| {
                let along = || positions.iter().map(|position| position[d]);
                along().fold(f64::MIN, f64::max) - along().fold(f64::MAX, f64::min)
            })
            .fold(0.0, f64::max);
        let wanted = AUTOMATIC_DISPLACEMENT * extent / largest;
        if !wanted.is_finite() || wanted <= 1.0 {
            return Ok(1.0);
        }
        let power = 10_f64.powf(wanted.log10().floor());
        let step = [5.0, 2.0, 1.0]
            .into_iter()
            .find(|step| step * power <= wanted);
        Ok(step.unwrap_or(1.0) * power)
    }

    fn draw(&self, index: usize, time: f64, factor: f64, path: &Path) -> Result<()> {
        let stored = self.result.field(&self.arguments.field, index)?;
        let values: Vec<f64> = match self.components {
            1 => stored,
            n => stored
                .chunks_exact(n)
                .map(|entries| entries.iter().map(|e| e * e).sum::<f64>().sqrt())
                .collect(),
        };
        let displacements = self.displacements(index)?;
        let power = 1.0 / self.dimension as f64;
        let volumes = self.result.field("volume", index)?;
        let edge = |volume: &f64| (volume / self.section).powf(power);
        let sizes: Vec<f64> = volumes.iter().map(edge).collect();
        let places = self.result.positions(index)?;
        let positions: Vec<[f64; 3]> = places
            .iter()
            .zip(displacements.chunks_exact(3))
            .map(|(x, u)| std::array::from_fn(|d| x[d] + factor * u[d]))
            .collect();
        let lines = self.moved_paths(&places, &displacements, factor);
        let title = format!(
            "{}   t = {}   deformation × {factor}",
            self.title,
            si(time, "s")
        );
        let image = render(&Scene {
            dimension: self.dimension,
            positions: &positions,
            sizes: &sizes,
            values: &values,
            field: &self.arguments.field,
            unit: match self.unit.as_str() {
                "1" => "",
                unit => unit,
            },
            title: title.trim_start(),
            range: self.range,
            view: self.view,
            width: self.arguments.width,
            lines: &lines,
        });
        image
            .write_png(path)
            .map_err(|error| file_error(path, "write", &error))
    }
}

impl PlotStyle<'_> {
    /// The lines to draw, with the numbers of their files. Each vertex is displaced with its nearest point.
    fn moved_paths(
        &self,
        positions: &[[f64; 3]],
        displacements: &[f64],
        factor: f64,
    ) -> Vec<(usize, Vec<[f64; 3]>)> {
        let moved = |place: &[f64; 2]| {
            let distance = |point: &[f64; 3]| (point[0] - place[0]).hypot(point[1] - place[1]);
            let points = positions.iter().zip(displacements.chunks_exact(3));
            let nearest = points.min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)));
            let [x, y] = nearest.map_or([0.0; 2], |(_, u)| [u[0], u[1]]);
            [place[0] + factor * x, place[1] + factor * y, 0.0]
        };
        let line = |number: usize, line: &Line| (number, line.iter().map(moved).collect());
        let files = self.paths.iter().enumerate();
        files
            .flat_map(|(number, lines)| lines.iter().map(move |own| line(number, own)))
            .collect()
    }
}

fn range(text: &str) -> Result<(f64, f64)> {
    let wanted = "--range must be two numbers, LOW,HIGH";
    let (low, high) = text
        .split_once(',')
        .ok_or_else(|| Error::input(format!("{wanted}, is `{text}`")))?;
    let (low, high) = (number(low, wanted)?, number(high, wanted)?);
    if low < high {
        Ok((low, high))
    } else {
        Err(Error::input(format!(
            "{wanted} with LOW below HIGH, is `{text}`"
        )))
    }
}

fn view(slice: Option<&str>, dimension: usize) -> Result<View> {
    let wanted = "--slice must be AXIS=POSITION, such as z=0.005";
    let Some(text) = slice else {
        return Ok(if dimension == 3 {
            View::Orthographic
        } else {
            View::Plane
        });
    };
    if dimension != 3 {
        return Err(Error::input(
            "--slice is for solids; this result is not 3-D",
        ));
    }
    let (axis, position) = text
        .split_once('=')
        .ok_or_else(|| Error::input(format!("{wanted}, is `{text}`")))?;
    let axis = match axis.trim() {
        "x" => Axis::X,
        "y" => Axis::Y,
        "z" => Axis::Z,
        _ => return Err(Error::input(format!("{wanted}, is `{text}`"))),
    };
    Ok(View::Slice {
        axis,
        position: number(position, wanted)?,
    })
}
