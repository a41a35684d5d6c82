//! Pictures of a field at points.

use std::ops;
use std::path::{Path, PathBuf};

use clap::Args;
use fissure::error::{Error, Result};
use fissure::output::ResultReader;
use fissure::picture::{Image, Scene, View, is_in_slice, render};

use super::blocks::{blocks, is_zero, scattered_bodies};
use super::choice::{choose_field, choose_times, number, view};
use super::limits::{Frame, Limits, Range, range};
use super::paths::{self, Line, NearestPoints};
use super::quantity::Quantity;
use super::{PlotArguments, check_ending};
use crate::cli::format::si;
use crate::cli::{Verbosity, file_error, outln, result_file};

/// Largest drawn displacement for `--deform auto`, relative to the body's size.
const AUTOMATIC_DISPLACEMENT: f64 = 0.04;

/// Options of pictures.
#[derive(Args)]
pub struct PictureArguments {
    /// Field to draw [default: damage, or another field if the result has none].
    #[arg(short, long, value_name = "NAME")]
    field: Option<String>,

    /// Component or invariant of a vector or tensor: x, xx, magnitude, von_mises, principal_1, trace, …
    #[arg(short, long, value_name = "NAME")]
    component: Option<String>,

    /// Factor on the drawn displacement, or `auto`.
    #[arg(
        long,
        value_name = "FACTOR",
        default_value = "auto",
        allow_hyphen_values = true
    )]
    deform: String,

    /// Draw only the points of a solid that are nearest to this plane, such as z=0.005.
    #[arg(long, value_name = "AXIS=POSITION")]
    slice: Option<String>,

    /// Draw the lines of a CSV file, such as crack_NAME.csv, over a plane picture. The columns are x and y
    /// (m), and branch if there are several lines. May be repeated.
    #[arg(long, value_name = "FILE.csv")]
    path: Vec<PathBuf>,

    /// Range of the colours: values such as 0,1, percentiles such as 5%,95%, or `all` [default: all, or
    /// 0.5%,99.5% if there are outliers].
    #[arg(long, value_name = "LOW,HIGH", allow_hyphen_values = true)]
    range: Option<String>,

    /// Width of the picture in pixels.
    #[arg(long, value_name = "PIXELS", default_value_t = 1200, value_parser = clap::value_parser!(u32).range(200..=10_000))]
    pub(super) width: u32,
}

/// Draw the last output, the output nearest to a time, or all outputs.
///
/// # Errors
/// If the file is not a result, or the field or component is missing.
pub fn plot(arguments: &PlotArguments, result: &Path, verbosity: Verbosity) -> Result<()> {
    let file = result_file(result);
    let result = ResultReader::open(&file)?;
    let times = result.times()?;
    let chosen = choose_times(&arguments.time, &times)?;
    let last = chosen.last().copied().unwrap_or(0);
    let painter = Painter::new(&arguments.picture, &file, &result, last)?;
    let path = match &arguments.output {
        Some(path) => path.clone(),
        None => beside(&file, &format!("{}.png", painter.name())),
    };
    let hint = "; `--y` draws curves, and `fissure movie` films";
    check_ending(&path, &["png"], hint)?;
    for index in &chosen {
        let path = match chosen.len() {
            1 => path.clone(),
            _ => numbered(&path, *index),
        };
        painter.check_slice(*index)?;
        let image = painter.image(*index, &si(times[*index], "s"), None)?;
        image
            .write_png(&path)
            .map_err(|error| file_error(&path, "write", &error))?;
        if verbosity > Verbosity::Quiet {
            let (time, what) = (si(times[*index], "s"), &painter.quantity.label);
            outln!("wrote {}: {what} at t = {time}", path.display());
        }
    }
    Ok(())
}

/// Return the path of a file beside a result. For a further result, such as `result_edge.vtkhdf`, the file
/// name starts with the name of the result. No field name starts with `result_`, so names are unique.
pub fn beside(result: &Path, name: &str) -> PathBuf {
    let stem = result.file_stem().unwrap_or_default().to_string_lossy();
    let further = if stem.starts_with("result_") {
        format!("{stem}_")
    } else {
        String::new()
    };
    result.with_file_name(format!("{further}{name}"))
}

/// Insert a number into a file name: `name.png` becomes `name_0012.png`.
fn numbered(path: &Path, index: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}_{index:04}.png"))
}

/// Settings of all pictures of a result.
pub struct Painter<'a> {
    result: &'a ResultReader,
    arguments: &'a PictureArguments,
    dimension: usize,
    title: String,
    /// Field and component of the drawn values, with label and unit.
    pub quantity: Quantity,
    has_displacement: bool,
    section: f64,
    range: Range,
    view: View,
    factor: f64,
    /// Whether the points of a body are scattered, by index of the body.
    scattered: Vec<bool>,
    /// Lines over the picture, by index of the file.
    paths: Vec<Vec<Line>>,
}

/// The points of an output as they are drawn.
#[derive(Default)]
struct Points {
    positions: Vec<[f64; 3]>,
    sizes: Vec<f64>,
    /// For each point, whether its body has scattered points; empty if no body has scattered points.
    scattered: Vec<bool>,
    values: Vec<f64>,
    lines: Vec<(usize, Vec<[f64; 3]>)>,
}

impl<'a> Painter<'a> {
    /// Create a painter of a result. An automatic displacement factor is chosen for the output `reference`.
    ///
    /// # Errors
    /// If an argument is wrong for this result.
    pub fn new(
        arguments: &'a PictureArguments,
        path: &Path,
        result: &'a ResultReader,
        reference: usize,
    ) -> Result<Self> {
        let attributes = result.attributes()?;
        let attribute = |name: &str| {
            let found = attributes.iter().find(|(known, _)| known == name);
            found.map(|(_, value)| value.clone()).unwrap_or_default()
        };
        let wrong = |name: &str| {
            let (path, value) = (path.display(), attribute(name));
            Error::input(format!(
                "{path}: attribute `{name}` must be a number, is `{value}`; was this written by \
                 another version of Fissure?"
            ))
        };
        let number_of = |name: &str| attribute(name).parse::<f64>().map_err(|_| wrong(name));
        let dimension = number_of("dimension")? as usize;
        let section = number_of("out_of_plane_measure")?;
        let fields = result.fields()?;
        let mut field = choose_field(arguments.field.as_deref(), path, &fields)?;
        if arguments.field.is_none() && field.name == "velocity" {
            // Quasi-static results have a velocity of zero, so draw the displacement instead.
            let displacement = fields.iter().find(|field| field.name == "displacement");
            if let Some(displacement) = displacement
                && is_zero(result, "velocity", reference)?
            {
                field = displacement;
            }
        }
        if dimension != 2 && !arguments.path.is_empty() {
            return Err(Error::input("--path is for results of plane problems"));
        }
        let paths = arguments.path.iter().map(|path| paths::read(path));
        let mut painter = Self {
            title: attribute("title"),
            quantity: Quantity::new(field, arguments.component.as_deref())?,
            has_displacement: fields.iter().any(|field| field.name == "displacement"),
            section,
            range: arguments
                .range
                .as_deref()
                .map_or(Ok(Range::Automatic), range)?,
            view: view(arguments.slice.as_deref(), dimension)?,
            factor: 0.0,
            scattered: scattered_bodies(result, reference, dimension)?,
            paths: paths.collect::<Result<_>>()?,
            result,
            arguments,
            dimension,
        };
        painter.factor = match arguments.deform.as_str() {
            "auto" => painter.automatic_factor(reference)?,
            text => number(text, "--deform must be `auto` or a number")?,
        };
        Ok(painter)
    }

    /// Return the name of the drawn quantity, for file names.
    pub fn name(&self) -> String {
        let field = &self.quantity.field;
        match &self.arguments.component {
            Some(component) => format!("{field}_{component}"),
            None => field.clone(),
        }
    }

    fn displacements(&self, index: usize, points: ops::Range<usize>) -> Result<Vec<f64>> {
        if self.has_displacement {
            self.result.field_of("displacement", index, points)
        } else {
            Ok(vec![0.0; 3 * points.len()])
        }
    }

    /// Return a factor of 1, 2 or 5 times a power of ten that makes displacements visible.
    fn automatic_factor(&self, index: usize) -> Result<f64> {
        let mut largest = 0.0_f64;
        let (mut low, mut high) = ([f64::MAX; 3], [f64::MIN; 3]);
        for points in blocks(self.result.points(index)) {
            let values = self.displacements(index, points.clone())?;
            let finite = values.iter().filter(|u| u.is_finite());
            largest = finite.fold(largest, |a, u| a.max(u.abs()));
            for position in self.result.positions_of(index, points)? {
                for d in 0..3 {
                    low[d] = low[d].min(position[d]);
                    high[d] = high[d].max(position[d]);
                }
            }
        }
        let extent = (0..3).map(|d| high[d] - low[d]).fold(0.0, f64::max);
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

    /// Read the points of an output, block by block. If the view is a slice, keep only the points in the
    /// slice.
    fn points(&self, index: usize) -> Result<Points> {
        let mut found = Points::default();
        let count = self.result.points(index);
        if !matches!(self.view, View::Slice { .. }) {
            found.positions.reserve_exact(count);
            found.sizes.reserve_exact(count);
            found.values.reserve_exact(count);
        }
        let mut paths = NearestPoints::new(&self.paths);
        let power = 1.0 / self.dimension as f64;
        for points in blocks(count) {
            let values = self
                .result
                .field_of(&self.quantity.field, index, points.clone())?;
            let values = self.quantity.of(values);
            let volumes = self.result.field_of("volume", index, points.clone())?;
            let scattered = self.are_scattered(index, points.clone())?;
            let places = self.result.positions_of(index, points.clone())?;
            let displacements = self.displacements(index, points)?;
            paths.search(&places, &displacements);
            for (k, position) in self.drawn_positions(&places, &displacements).enumerate() {
                let size = (volumes[k] / self.section).powf(power);
                if let View::Slice { axis, position: at } = self.view
                    && !is_in_slice(axis, at, position, size)
                {
                    continue;
                }
                found.positions.push(position);
                found.sizes.push(size);
                found.values.push(values[k]);
                if let Some(scattered) = scattered.get(k) {
                    found.scattered.push(*scattered);
                }
            }
        }
        found.lines = paths.moved_lines(self.factor);
        Ok(found)
    }

    /// Return the drawn positions, m: reference positions plus displacements times the deformation factor.
    fn drawn_positions<'b>(
        &'b self,
        places: &'b [[f64; 3]],
        displacements: &'b [f64],
    ) -> impl Iterator<Item = [f64; 3]> + 'b {
        let both = places.iter().zip(displacements.chunks_exact(3));
        both.map(|(x, u)| std::array::from_fn(|d| x[d] + self.factor * u[d]))
    }

    fn scene<'b>(&'b self, points: &'b Points) -> Scene<'b> {
        Scene {
            dimension: self.dimension,
            positions: &points.positions,
            sizes: &points.sizes,
            scattered: &points.scattered,
            values: &points.values,
            field: &self.quantity.label,
            unit: &self.quantity.unit,
            title: "",
            range: None,
            view: self.view,
            width: self.arguments.width,
            lines: &points.lines,
            note: "",
            bounds: None,
        }
    }

    /// Return for each of these points whether its body has scattered points; empty if no body has scattered
    /// points.
    fn are_scattered(&self, index: usize, points: ops::Range<usize>) -> Result<Vec<bool>> {
        if !self.scattered.contains(&true) {
            return Ok(Vec::new());
        }
        if !self.scattered.contains(&false) {
            return Ok(vec![true; points.len()]);
        }
        let bodies = self.result.field_of("block", index, points)?;
        let is_scattered = |body: &f64| self.scattered.get(*body as usize) == Some(&true);
        Ok(bodies.iter().map(is_scattered).collect())
    }

    /// Return the limits of the drawn values. An automatic range covers all values of damage, which has no outliers.
    fn limits(&self, values: Vec<f64>) -> Option<Limits> {
        let range = match self.range {
            Range::Automatic if self.quantity.field.contains("damage") => Range::All,
            range => range,
        };
        Limits::of(values, range)
    }

    /// Return the frame that encloses an output; `None` if no point is drawn. A film uses the union of the
    /// frames of its outputs.
    ///
    /// # Errors
    /// If the result is damaged.
    pub fn frame(&self, index: usize) -> Result<Option<Frame>> {
        let points = self.points(index)?;
        let scene = self.scene(&points);
        let marks = scene.marks()?;
        if marks.is_empty() {
            return Ok(None);
        }
        Ok(Some(Frame {
            bounds: marks.extent(),
            limits: self.limits(marks.values()),
        }))
    }

    /// Draw an output; `time` is the text of its time. Box and limits come from `frame`, or from the output
    /// if `frame` is `None`.
    ///
    /// # Errors
    /// If the result is damaged.
    pub fn image(&self, index: usize, time: &str, frame: Option<&Frame>) -> Result<Image> {
        let points = self.points(index)?;
        let scene = self.scene(&points);
        let limits = match frame {
            Some(frame) => frame.limits,
            None => self.limits(scene.marks()?.values()),
        };
        let note = limits.map_or(String::new(), |limits| limits.note(&self.quantity.unit));
        let mut title = format!("{}   t = {time}", self.title);
        if self.has_displacement && self.factor != 0.0 {
            title += &format!("   deformation × {}", self.factor);
        }
        render(&Scene {
            title: title.trim_start(),
            range: match (self.range, limits) {
                (Range::Values(range), _) => Some(range),
                // The colour bar of damage starts at 0 in all pictures.
                (_, Some(limits)) if frame.is_some() || limits.percentiles.is_some() => {
                    let [low, high] = limits.shown;
                    let damage = self.quantity.field.contains("damage");
                    let low = if damage { low.min(0.0) } else { low };
                    (low < high).then_some((low, high))
                }
                _ => None,
            },
            note: &note,
            bounds: frame.map(|frame| frame.bounds),
            ..scene
        })
    }

    /// Check that there are points near the slice.
    ///
    /// # Errors
    /// If the output has points, but none near the slice; the message gives the position of the nearest
    /// point.
    pub fn check_slice(&self, index: usize) -> Result<()> {
        let View::Slice { axis, position } = self.view else {
            return Ok(());
        };
        let count = self.result.points(index);
        if count == 0 || !self.scene(&self.points(index)?).marks()?.is_empty() {
            return Ok(());
        }
        let name = axis.letter();
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        let mut nearest: Option<f64> = None;
        let distance = |at: &f64| (at - position).abs();
        for points in blocks(count) {
            let places = self.result.positions_of(index, points.clone())?;
            let displacements = self.displacements(index, points)?;
            let along = self.drawn_positions(&places, &displacements);
            let along = along.map(|place| place[axis.index()]);
            for at in along.filter(|coordinate| coordinate.is_finite()) {
                ends = [ends[0].min(at), ends[1].max(at)];
                if nearest.is_none_or(|nearest| distance(&at) < distance(&nearest)) {
                    nearest = Some(at);
                }
            }
        }
        let nearest = nearest.map_or(String::new(), |at| {
            format!("; the nearest ones are at --slice {name}={at:.4e}")
        });
        Err(Error::input(format!(
            "--slice {name}={position}: no points are drawn there; they are between {name} = {:.4e} and {:.4e} m{nearest}",
            ends[0], ends[1]
        )))
    }
}
