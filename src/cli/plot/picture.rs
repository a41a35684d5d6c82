//! Pictures of a field at points.

use std::ops;
use std::path::{Path, PathBuf};

use clap::Args;
use fissure::error::{Error, Result};
use fissure::message::suggestion;
use fissure::output::{ResultReader, StoredField};
use fissure::picture::{Axis, Bounds, Image, Scene, View, is_in_slice, render};

use super::paths::{self, Line};
use super::quantity::Quantity;
use super::{PlotArguments, check_ending};
use crate::cli::format::si;
use crate::cli::{Verbosity, file_error, outln, result_file};

/// Largest drawn displacement for `--deform auto`, relative to the body's size.
const AUTOMATIC_DISPLACEMENT: f64 = 0.04;

/// Percentiles at the ends of the automatic range of colours if there are outliers.
const PERCENTILES: [f64; 2] = [0.5, 99.5];

/// Ratio of the full range to the percentile range above which there are outliers.
const OUTLIERS: f64 = 4.0;

/// Largest distance of a requested time from the first or last output, as a fraction of the output interval.
const TIME_REACH: f64 = 0.5;

/// Fields that are drawn by default, in order of preference.
const PREFERRED: [&str; 6] = [
    "damage",
    "von_mises_stress",
    "cauchy_stress",
    "stress",
    "velocity",
    "displacement",
];

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

fn number(text: &str, wanted: &str) -> Result<f64> {
    let value = text
        .trim()
        .parse()
        .ok()
        .filter(|value: &f64| value.is_finite());
    value.ok_or_else(|| Error::input(format!("{wanted}, is `{text}`")))
}

/// Return the indices of the outputs to draw.
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
            let nearest = (0..=last)
                .min_by(|a, b| distance(a).total_cmp(&distance(b)))
                .unwrap_or(last);
            let interval = match nearest {
                0 => times.get(1).map_or(0.0, |next| next - times[0]),
                later => times[later] - times[later - 1],
            };
            let inside = (times[0]..=times[last]).contains(&wanted);
            if inside || distance(&nearest) <= TIME_REACH * interval {
                return Ok(vec![nearest]);
            }
            Err(Error::input(format!(
                "--time {text}: the outputs are between {:e} and {:e} s; the nearest one is at --time {:e}",
                times[0], times[last], times[nearest]
            )))
        }
    }
}

/// Insert a number into a file name: `name.png` becomes `name_0012.png`.
fn numbered(path: &Path, index: usize) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    path.with_file_name(format!("{stem}_{index:04}.png"))
}

/// Requested range of the colours.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Range {
    Automatic,
    All,
    Percentiles([f64; 2]),
    Values((f64, f64)),
}

/// Range of the drawn values. `shown` are the values at the ends of the colour bar; `all` are the smallest
/// and the largest value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    shown: [f64; 2],
    all: [f64; 2],
    /// Percentiles at the ends of the colour bar; `None` if the colour bar covers all values.
    percentiles: Option<[f64; 2]>,
}

impl Limits {
    /// Return the limits of some values for a requested range; `None` without values.
    fn of(mut values: Vec<f64>, range: Range) -> Option<Self> {
        let all = values.iter().fold(None, |ends: Option<[f64; 2]>, value| {
            let [low, high] = ends.unwrap_or([*value; 2]);
            Some([low.min(*value), high.max(*value)])
        })?;
        let wanted = match range {
            Range::Percentiles(wanted) => wanted,
            _ => PERCENTILES,
        };
        let last = (values.len() - 1) as f64;
        let between = wanted.map(|percent| {
            let rank = (percent / 100.0 * last).round() as usize;
            *values.select_nth_unstable_by(rank, f64::total_cmp).1
        });
        let spread = |ends: [f64; 2]| ends[1] - ends[0];
        let uses = match range {
            Range::Percentiles(_) => spread(between) > 0.0,
            Range::Automatic => spread(between) > 0.0 && spread(all) > OUTLIERS * spread(between),
            Range::All | Range::Values(_) => false,
        };
        Some(Self {
            shown: if uses { between } else { all },
            all,
            percentiles: uses.then_some(wanted),
        })
    }

    /// Return limits that enclose those of `self` and `other`.
    pub fn union(self, other: Self) -> Self {
        let union = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Self {
            shown: union(self.shown, other.shown),
            all: union(self.all, other.all),
            percentiles: self.percentiles.or(other.percentiles),
        }
    }

    /// Format a note about values beyond the colour bar; empty if the colour bar covers all values.
    fn note(&self, unit: &str) -> String {
        let Some([low, high]) = self.percentiles else {
            return String::new();
        };
        let ends = self.all.map(|value| si(value, unit));
        format!(
            "colours from percentile {low} to {high}; values from {} to {}",
            ends[0].trim(),
            ends[1].trim()
        )
        .replace('-', "−")
    }
}

/// Settings that all frames of a film share.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Box that all frames show, m.
    pub bounds: Bounds,
    /// Limits of the values; `None` without values.
    pub limits: Option<Limits>,
}

impl Frame {
    /// Return a frame that encloses `self` and `other`.
    pub fn union(self, other: Self) -> Self {
        Self {
            bounds: self.bounds.union(other.bounds),
            limits: match (self.limits, other.limits) {
                (Some(a), Some(b)) => Some(a.union(b)),
                (a, b) => a.or(b),
            },
        }
    }
}

/// Largest difference of coordinates that count as equal, as a fraction of the extent. Points in one row of a
/// lattice differ by round-off.
const SAME_COORDINATE: f64 = 1e-9;

/// Largest number of combinations of coordinates of a lattice with n points, divided by n^1.5. Scattered
/// points have more combinations; see [`scattered_bodies`].
const MOST_COMBINATIONS: f64 = 4.0;

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
            paths.look(&places, &displacements);
            for (k, position) in self.moved(&places, &displacements).enumerate() {
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
        found.lines = paths.moved(self.factor);
        Ok(found)
    }

    /// Return the drawn positions, m: reference positions plus displacements times the deformation factor.
    fn moved<'b>(
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

    /// Return the limits of a scene. An automatic range covers all values of damage, which has no outliers.
    fn limits(&self, scene: &Scene) -> Option<Limits> {
        let range = match self.range {
            Range::Automatic if self.quantity.field.contains("damage") => Range::All,
            range => range,
        };
        Limits::of(scene.drawn_values(), range)
    }

    /// Return the frame that encloses an output; `None` if no point is drawn. A film uses the union of the
    /// frames of its outputs.
    ///
    /// # Errors
    /// If the result is damaged.
    pub fn frame(&self, index: usize) -> Result<Option<Frame>> {
        let points = self.points(index)?;
        let scene = self.scene(&points);
        if scene.marks().is_empty() {
            return Ok(None);
        }
        Ok(Some(Frame {
            bounds: scene.extent(),
            limits: self.limits(&scene),
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
            None => self.limits(&scene),
        };
        let note = limits.map_or(String::new(), |limits| limits.note(&self.quantity.unit));
        let mut title = format!("{}   t = {time}", self.title);
        if self.has_displacement && self.factor != 0.0 {
            title += &format!("   deformation × {}", self.factor);
        }
        Ok(render(&Scene {
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
        }))
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
        if count == 0 || !self.scene(&self.points(index)?).marks().is_empty() {
            return Ok(());
        }
        let name = axis.letter();
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        let mut nearest: Option<f64> = None;
        let distance = |at: &f64| (at - position).abs();
        for points in blocks(count) {
            let places = self.result.positions_of(index, points.clone())?;
            let displacements = self.displacements(index, points)?;
            let along = self.moved(&places, &displacements);
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

/// Search for the point nearest to each vertex of the lines. A vertex is drawn with the displacement of its
/// nearest point.
struct NearestPoints<'a> {
    /// The lines, each with the index of its file.
    lines: Vec<(usize, &'a Line)>,
    /// For each vertex of all lines, in order: distance of the nearest point found so far, and displacement
    /// of this point, m.
    nearest: Vec<(f64, [f64; 2])>,
}

impl<'a> NearestPoints<'a> {
    fn new(files: &'a [Vec<Line>]) -> Self {
        let files = files.iter().enumerate();
        let lines = files.flat_map(|(number, lines)| lines.iter().map(move |line| (number, line)));
        let lines: Vec<_> = lines.collect();
        let vertices = lines.iter().map(|(_, line)| line.len()).sum();
        Self {
            lines,
            nearest: vec![(f64::INFINITY, [0.0; 2]); vertices],
        }
    }

    /// Search a block of points. `displacements` has three components per point, m.
    fn look(&mut self, positions: &[[f64; 3]], displacements: &[f64]) {
        let vertices = self.lines.iter().flat_map(|(_, line)| line.iter());
        for (place, nearest) in vertices.zip(&mut self.nearest) {
            for (point, u) in positions.iter().zip(displacements.chunks_exact(3)) {
                let distance = (point[0] - place[0]).hypot(point[1] - place[1]);
                if distance < nearest.0 {
                    *nearest = (distance, [u[0], u[1]]);
                }
            }
        }
    }

    /// Return the lines to draw, each with the index of its file. Each vertex is moved by the displacement of
    /// its nearest point times `factor`.
    fn moved(&self, factor: f64) -> Vec<(usize, Vec<[f64; 3]>)> {
        let mut nearest = self.nearest.iter();
        let mut moved = |place: &[f64; 2]| {
            let (_, [x, y]) = nearest.next().expect("one for each vertex");
            [place[0] + factor * x, place[1] + factor * y, 0.0]
        };
        let lines = self.lines.iter();
        lines
            .map(|(number, line)| (*number, line.iter().map(&mut moved).collect()))
            .collect()
    }
}

/// Number of points that are read at once; limits the memory of a picture.
const BLOCK: usize = 1 << 18;

/// Divide `points` points into ranges of at most [`BLOCK`] points.
fn blocks(points: usize) -> impl Iterator<Item = ops::Range<usize>> {
    let block = move |first: usize| first..(first + BLOCK).min(points);
    (0..points).step_by(BLOCK).map(block)
}

/// Test whether all values of a field are 0 at an output.
fn is_zero(result: &ResultReader, field: &str, index: usize) -> Result<bool> {
    for points in blocks(result.points(index)) {
        let values = result.field_of(field, index, points)?;
        if values.iter().any(|value| *value != 0.0) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Return for each body whether its points are scattered at an output; empty for bars.
///
/// The number of combinations is the product of the numbers of different x, y and z. For n points of a
/// lattice, it is about n. For n scattered points in the plane, it is n². A body with few points does not
/// count as scattered.
fn scattered_bodies(result: &ResultReader, index: usize, dimension: usize) -> Result<Vec<bool>> {
    if dimension < 2 || result.times()?.is_empty() {
        return Ok(Vec::new());
    }
    // Number of points of each body.
    let mut points_of: Vec<usize> = Vec::new();
    for points in blocks(result.points(index)) {
        for body in result.field_of("block", index, points)? {
            let body = body as usize;
            points_of.resize(points_of.len().max(body + 1), 0);
            points_of[body] += 1;
        }
    }
    let mut combinations = vec![1.0; points_of.len()];
    for d in 0..dimension {
        // Store the coordinates of one direction at a time, to limit the memory.
        let of_body = points_of.iter().map(|points| Vec::with_capacity(*points));
        let mut along: Vec<Vec<f64>> = of_body.collect();
        for points in blocks(result.points(index)) {
            let bodies = result.field_of("block", index, points.clone())?;
            let positions = result.positions_of(index, points)?;
            for (position, body) in positions.iter().zip(&bodies) {
                along[*body as usize].push(position[d]);
            }
        }
        for (along, combinations) in along.iter_mut().zip(&mut combinations) {
            along.sort_unstable_by(f64::total_cmp);
            let ends = along.first().zip(along.last());
            let tolerance = ends.map_or(0.0, |(first, last)| SAME_COORDINATE * (last - first));
            let steps = along
                .windows(2)
                .filter(|pair| pair[1] - pair[0] > tolerance);
            *combinations *= 1.0 + steps.count() as f64;
        }
    }
    let both = combinations.into_iter().zip(points_of);
    let is_scattered = |(combinations, points): (f64, usize)| {
        points > 0 && combinations > MOST_COMBINATIONS * (points as f64).powf(1.5)
    };
    Ok(both.map(is_scattered).collect())
}

/// Return the field to draw: the named field, else the first existing field of [`PREFERRED`], else a field
/// that changes with time.
fn choose_field<'a>(
    name: Option<&str>,
    path: &Path,
    fields: &'a [StoredField],
) -> Result<&'a StoredField> {
    let find = |name: &str| fields.iter().find(|field| field.name == name);
    let found = match name {
        Some(name) => find(name),
        None => {
            let dynamic = fields
                .iter()
                .find(|field| field.dynamic && field.name != "id");
            let preferred = PREFERRED.into_iter().find_map(find);
            preferred.or(dynamic).or(fields.first())
        }
    };
    found.ok_or_else(|| {
        let name = name.unwrap_or("damage");
        let known = fields.iter().map(|field| field.name.as_str());
        let known = suggestion(name, known);
        Error::input(format!("{} has no field `{name}`{known}", path.display()))
    })
}

fn range(text: &str) -> Result<Range> {
    let wanted = "--range must be LOW,HIGH, percentiles such as 5%,95%, or `all`";
    if text == "all" {
        return Ok(Range::All);
    }
    let wrong = || Error::input(format!("{wanted}, is `{text}`"));
    let (low, high) = text.split_once(',').ok_or_else(wrong)?;
    let (low, high) = (low.trim(), high.trim());
    let percent = (low.strip_suffix('%'), high.strip_suffix('%'));
    let percentiles = percent.0.is_some() || percent.1.is_some();
    let (low, high) = match percent {
        (Some(low), Some(high)) => (number(low, wanted)?, number(high, wanted)?),
        _ => (number(low, wanted)?, number(high, wanted)?),
    };
    if low >= high {
        return Err(Error::input(format!(
            "--range {text}: LOW must be below HIGH"
        )));
    }
    if !percentiles {
        return Ok(Range::Values((low, high)));
    }
    if low < 0.0 || high > 100.0 {
        return Err(wrong());
    }
    Ok(Range::Percentiles([low, high]))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_outside_of_the_result_are_rejected() {
        let times = [0.0, 1e-5, 2e-5];
        let chosen = |text| choose_times(text, &times).unwrap();
        assert_eq!(chosen("last"), [2]);
        assert_eq!(chosen("all"), [0, 1, 2]);
        assert_eq!(chosen("1.2e-5"), [1]);
        assert_eq!(chosen("2.4e-5"), [2]);
        assert_eq!(chosen("-4e-6"), [0]);
        for (text, nearest) in [("25", "--time 2e-5"), ("-1e-5", "--time 0e0")] {
            let message = choose_times(text, &times).unwrap_err().message;
            assert!(message.ends_with(nearest), "{message}");
        }
        assert!(choose_times("1", &[0.5]).is_err());
        assert!(choose_times("last", &[]).is_err());
    }

    #[test]
    fn outliers_do_not_set_the_range() {
        let mut values: Vec<f64> = (0..1000).map(f64::from).collect();
        let limits = Limits::of(values.clone(), Range::Automatic).unwrap();
        assert_eq!((limits.shown, limits.percentiles), ([0.0, 999.0], None));
        values[3] = 1e9;
        let limits = Limits::of(values.clone(), Range::Automatic).unwrap();
        assert_eq!((limits.shown, limits.all), ([6.0, 995.0], [0.0, 1e9]));
        let note = limits.note("Pa");
        assert!(note.ends_with("values from 0 Pa to 1.000 GPa"), "{note}");
        let limits = Limits::of(values.clone(), Range::All).unwrap();
        assert_eq!((limits.shown, limits.note("Pa").as_str()), ([0.0, 1e9], ""));
        let limits = Limits::of(values, Range::Percentiles([0.0, 50.0])).unwrap();
        assert_eq!(limits.shown, [0.0, 501.0]);
        // Few values of a pulse differ from the others; the range must include these few.
        let pulse: Vec<f64> = (0..1000).map(|k| f64::from(u8::from(k == 7))).collect();
        let limits = Limits::of(pulse, Range::Automatic).unwrap();
        assert_eq!(limits.percentiles, None);
        assert_eq!(Limits::of(Vec::new(), Range::Automatic), None);
    }

    #[test]
    fn ranges_are_values_or_percentiles() {
        assert_eq!(range("-1,2").unwrap(), Range::Values((-1.0, 2.0)));
        assert_eq!(range("5%, 95%").unwrap(), Range::Percentiles([5.0, 95.0]));
        assert_eq!(range("all").unwrap(), Range::All);
        for wrong in ["1", "2,1", "5%,9", "-1%,50%", "a,b"] {
            assert!(range(wrong).is_err(), "{wrong}");
        }
    }
}
