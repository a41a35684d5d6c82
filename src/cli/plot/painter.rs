//! Drawing of the outputs of a result. `Painter` has the settings of all pictures, and `Points` has the drawn
//! points of one output.

use std::ops;
use std::path::Path;

use fissure::error::{Error, Result};
use fissure::output::{ResultReader, StoredField};
use fissure::picture::{ColourMap, Image, Scene, Vectors, View, is_damage, is_in_slice, render};

use super::choice::{choose_field, colour_map, number, view};
use super::chunks::{chunks, is_zero, scattered_bodies};
use super::difference::Subtrahend;
use super::filter::{Clip, Threshold};
use super::limits::{Frame, Limits, Range, range_of};
use super::overlays::{Contours, vector_field};
use super::paths::{self, Line, NearestPoints};
use super::picture::PictureArguments;
use super::quantity::Quantity;

/// Upper limit of the drawn displacement components for `--deform auto`, as a fraction of the longest edge
/// of the bounding box of all points. The automatic factor is at least 1, even if the limit is then exceeded.
const AUTOMATIC_DISPLACEMENT: f64 = 0.04;

/// Settings of all pictures of a result.
pub struct Painter<'a> {
    pub(super) result: &'a ResultReader,
    pub(super) arguments: &'a PictureArguments,
    pub(super) dimension: usize,
    /// Title of the pictures; the time of the output is appended.
    pub(super) title: String,
    /// Field and component of the drawn values, with label and unit.
    pub quantity: Quantity,
    /// Result that is subtracted from the drawn result.
    pub(super) minus: Option<Subtrahend>,
    has_displacement: bool,
    pub(super) out_of_plane_measure: f64,
    range: Range,
    colours: Option<ColourMap>,
    pub(super) view: View,
    clips: Vec<Clip>,
    pub(super) threshold: Option<Threshold>,
    contours: Option<Contours>,
    /// Vector field that is drawn as arrows; `None` without `--vectors`.
    vectors: Option<StoredField>,
    pub(super) factor: f64,
    /// Whether `--deform auto` found displacements other than 0; true if `--deform` gives a factor.
    pub(super) is_displaced: bool,
    /// For each body, whether its points are scattered.
    scattered: Vec<bool>,
    /// For each file of `--path`, the lines that are drawn over the picture.
    paths: Vec<Vec<Line>>,
}

/// The points of an output that are drawn.
#[derive(Default)]
pub(super) struct Points {
    positions: Vec<[f64; 3]>,
    sizes: Vec<f64>,
    /// For each point, whether its body has scattered points; empty if no body has scattered points.
    scattered: Vec<bool>,
    values: Vec<f64>,
    /// Vectors for arrows; empty without arrows.
    vectors: Vec<[f64; 3]>,
    lines: Vec<(usize, Vec<[f64; 3]>)>,
}

impl<'a> Painter<'a> {
    /// Create a painter of `result`, whose file is `path`. The output with the index `reference` determines
    /// the default field, the automatic displacement factor, and which bodies have scattered points.
    ///
    /// # Errors
    /// If an argument is wrong for this result, or if a result cannot be read.
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
        let out_of_plane_measure = number_of("out_of_plane_measure")?;
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
        let range = arguments.range.as_deref();
        let range = range.map_or(Ok(Range::Automatic), range_of)?;
        if let Range::Values((low, _)) = range
            && arguments.log
            && low <= 0.0
        {
            let message = format!("--range: with --log, LOW must be above 0, is {low}");
            return Err(Error::input(message));
        }
        let colours = arguments.colors.as_deref().map(colour_map);
        let clips = arguments.clip.iter().map(|clip| Clip::new(clip, dimension));
        let threshold = arguments.threshold.as_deref().map(|text| {
            let field = arguments.threshold_field.as_deref();
            Threshold::new(text, field, path, &fields)
        });
        let contours = arguments.contours.as_deref();
        let contours = contours.map(|text| Contours::new(text, arguments.log));
        if contours.is_some() && dimension != 2 && arguments.slice.is_none() {
            let message = "--contours is for plane problems, and for slices of solids";
            return Err(Error::input(message));
        }
        let vectors = arguments.vectors.as_deref();
        let vectors = vectors.map(|name| vector_field(name, path, &fields));
        if vectors.is_some() && dimension == 1 {
            let message = "--vectors is for plane problems and solids; this result is 1-D";
            return Err(Error::input(message));
        }
        let paths = arguments.path.iter().map(|path| paths::read(path));
        let mut quantity = Quantity::new(field, arguments.component.as_deref())?;
        let minus = arguments.minus.as_deref();
        let minus = minus
            .map(|path| Subtrahend::open(path, result, &quantity))
            .transpose()?;
        if minus.is_some() {
            quantity.label = format!("difference of {}", quantity.label);
        }
        let mut painter = Self {
            title: attribute("title"),
            colours: match colours.transpose()? {
                None if minus.is_some() => Some(ColourMap::Coolwarm),
                colours => colours,
            },
            quantity,
            minus,
            has_displacement: fields.iter().any(|field| field.name == "displacement"),
            out_of_plane_measure,
            range,
            clips: clips.collect::<Result<_>>()?,
            threshold: threshold.transpose()?,
            contours: contours.transpose()?,
            vectors: vectors.transpose()?.cloned(),
            view: view(
                arguments.slice.as_deref(),
                arguments.camera.as_deref(),
                dimension,
            )?,
            factor: 0.0,
            is_displaced: true,
            scattered: scattered_bodies(result, reference, dimension)?,
            paths: paths.collect::<Result<_>>()?,
            result,
            arguments,
            dimension,
        };
        painter.factor = match arguments.deform.as_str() {
            "auto" => {
                let factor = painter.automatic_factor(reference)?;
                painter.is_displaced = factor.is_some();
                factor.unwrap_or(1.0)
            }
            text => {
                let factor = number(text, "--deform must be `auto` or a number")?;
                if factor != 0.0 && !painter.has_displacement {
                    return Err(Error::input(format!(
                        "--deform {text}: {} has no field `displacement`; add it to `fields` of the output, or \
                         leave the option out",
                        path.display()
                    )));
                }
                factor
            }
        };
        Ok(painter)
    }

    /// Return the name of the drawn quantity, for file names.
    pub fn name(&self) -> String {
        let field = &self.quantity.field;
        let mut name = match &self.arguments.component {
            Some(component) => format!("{field}_{component}"),
            None => field.clone(),
        };
        if self.minus.is_some() {
            name += "_difference";
        }
        name
    }

    /// Return the drawn values of consecutive points of output `index`.
    pub(super) fn drawn_values(&self, index: usize, points: ops::Range<usize>) -> Result<Vec<f64>> {
        let values = (self.result).field_of(&self.quantity.field, index, points.clone())?;
        let mut values = self.quantity.of(values);
        if let Some(minus) = &self.minus {
            minus.subtract((self.result, index), points, &self.quantity, &mut values)?;
        }
        Ok(values)
    }

    /// Test whether a colour bar with a linear scale starts at 0. This is true for damage, which is never
    /// negative. The result is false for all other fields, and for a difference of two damage fields.
    fn starts_at_zero(&self) -> bool {
        self.minus.is_none() && is_damage(&self.quantity.field)
    }

    pub(super) fn displacements(
        &self,
        index: usize,
        points: ops::Range<usize>,
    ) -> Result<Vec<f64>> {
        if self.has_displacement {
            self.result.field_of("displacement", index, points)
        } else {
            Ok(vec![0.0; 3 * points.len()])
        }
    }

    /// Return a factor that makes the drawn displacements visible: 1, 2 or 5 times a power of ten, and at
    /// least 1. Return `None` if all displacements of output `index` are 0.
    fn automatic_factor(&self, index: usize) -> Result<Option<f64>> {
        let mut largest = 0.0_f64;
        let (mut low, mut high) = ([f64::MAX; 3], [f64::MIN; 3]);
        for points in chunks(self.result.points(index)) {
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
        if largest == 0.0 {
            return Ok(None);
        }
        let extent = (0..3).map(|d| high[d] - low[d]).fold(0.0, f64::max);
        let wanted = AUTOMATIC_DISPLACEMENT * extent / largest;
        if !wanted.is_finite() || wanted <= 1.0 {
            return Ok(Some(1.0));
        }
        let power = 10_f64.powf(wanted.log10().floor());
        let step = [5.0, 2.0, 1.0]
            .into_iter()
            .find(|step| step * power <= wanted);
        Ok(Some(step.unwrap_or(1.0) * power))
    }

    /// Test whether the slice shows the point at a position (m). If the view is not a slice, the result is
    /// true. `size` is the edge length of the point's cell, m.
    pub(super) fn is_in_view(&self, position: [f64; 3], size: f64) -> bool {
        match self.view {
            View::Slice { axis, position: at } => is_in_slice(axis, at, position, size),
            View::Plane | View::Orthographic(_) => true,
        }
    }

    pub(super) fn is_clipped(&self, position: [f64; 3]) -> bool {
        !self.clips.iter().all(|clip| clip.holds(position))
    }

    /// Test whether a slice, a half space or a threshold may exclude points from the picture.
    pub(super) fn is_partial(&self) -> bool {
        let is_slice = matches!(self.view, View::Slice { .. });
        is_slice || !self.clips.is_empty() || self.threshold.is_some()
    }

    /// Return the values of the field that `--threshold-field` names, for consecutive points of output
    /// `index`. Return `None` without this option, because the threshold then applies to the drawn values.
    pub(super) fn threshold_values(
        &self,
        index: usize,
        points: ops::Range<usize>,
    ) -> Result<Option<Vec<f64>>> {
        let threshold = self.threshold.as_ref();
        let Some(quantity) = threshold.and_then(|threshold| threshold.quantity.as_ref()) else {
            return Ok(None);
        };
        let values = self.result.field_of(&quantity.field, index, points)?;
        Ok(Some(quantity.of(values)))
    }

    /// Read the points of an output, in chunks of consecutive points to limit the memory. Keep only the
    /// points in the slice, in the half spaces and in the range of the threshold.
    pub(super) fn points(&self, index: usize) -> Result<Points> {
        let mut found = Points::default();
        let count = self.result.points(index);
        if !self.is_partial() {
            found.positions.reserve_exact(count);
            found.sizes.reserve_exact(count);
            found.values.reserve_exact(count);
        }
        let mut paths = NearestPoints::new(&self.paths);
        let power = 1.0 / self.dimension as f64;
        for points in chunks(count) {
            let values = self.drawn_values(index, points.clone())?;
            let volumes = self.result.field_of("volume", index, points.clone())?;
            let thresholds = self.threshold_values(index, points.clone())?;
            let scattered = self.are_scattered(index, points.clone())?;
            let vectors = match &self.vectors {
                Some(field) => self.result.field_of(&field.name, index, points.clone())?,
                None => Vec::new(),
            };
            let places = self.result.positions_of(index, points.clone())?;
            let displacements = self.displacements(index, points)?;
            paths.search(&places, &displacements);
            for (k, position) in self.drawn_positions(&places, &displacements).enumerate() {
                let size = (volumes[k] / self.out_of_plane_measure).powf(power);
                let value = thresholds.as_ref().map_or(values[k], |values| values[k]);
                if self.is_clipped(position)
                    || !self.is_in_view(position, size)
                    || self
                        .threshold
                        .as_ref()
                        .is_some_and(|range| !range.holds(value))
                {
                    continue;
                }
                found.positions.push(position);
                found.sizes.push(size);
                found.values.push(values[k]);
                if let Some(vector) = vectors.chunks_exact(3).nth(k) {
                    found.vectors.push([vector[0], vector[1], vector[2]]);
                }
                if let Some(scattered) = scattered.get(k) {
                    found.scattered.push(*scattered);
                }
            }
        }
        found.lines = paths.moved_lines(self.factor);
        Ok(found)
    }

    /// Return the drawn positions, m: reference positions plus displacements times the deformation factor.
    pub(super) fn drawn_positions<'b>(
        &'b self,
        places: &'b [[f64; 3]],
        displacements: &'b [f64],
    ) -> impl Iterator<Item = [f64; 3]> + 'b {
        let both = places.iter().zip(displacements.chunks_exact(3));
        both.map(|(x, u)| std::array::from_fn(|d| x[d] + self.factor * u[d]))
    }

    pub(super) fn scene<'b>(&'b self, points: &'b Points) -> Scene<'b> {
        Scene {
            dimension: self.dimension,
            positions: &points.positions,
            sizes: &points.sizes,
            scattered: &points.scattered,
            values: &points.values,
            field: &self.quantity.label,
            unit: &self.quantity.unit,
            colours: self.colours,
            is_logarithmic: self.arguments.log,
            title: "",
            range: None,
            view: self.view,
            width: self.arguments.width,
            lines: &points.lines,
            contours: &[],
            vectors: self.vectors.as_ref().map(|field| Vectors {
                values: &points.vectors,
                field: &field.name,
                unit: match field.unit.as_str() {
                    "1" => "",
                    unit => unit,
                },
                longest_arrow: None,
            }),
            note: "",
            bounds: None,
        }
    }

    /// Return one flag for each of the points `points` of output `index`. The flag says whether the body of
    /// the point has scattered points. The returned vector is empty if no body has scattered points.
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

    /// Return the limits of the drawn values; `None` if there are no values, or if no value is above 0 on a
    /// logarithmic scale. For damage, the automatic range covers all values, because the few points with
    /// damage are not outliers. For a difference, the middle of the colour bar is 0.
    fn limits(&self, values: Vec<f64>) -> Option<Limits> {
        let limits = match self.range {
            range if self.arguments.log => Limits::logarithmic(values, range),
            Range::Automatic if self.starts_at_zero() => Limits::of(values, Range::All),
            range => Limits::of(values, range),
        };
        if self.minus.is_some() {
            limits.map(Limits::symmetric)
        } else {
            limits
        }
    }

    /// Return the frame of an output: the box of its drawn points, the limits of their values and the longest
    /// arrow; `None` if no point is drawn. A film uses the union of the frames of its outputs.
    ///
    /// # Errors
    /// If the result is damaged, or has too many points for a picture.
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
            longest_arrow: marks.longest_arrow(),
        }))
    }

    /// Draw an output. `time` is the time as text, for the title. The drawn box, the limits of the values and
    /// the length of the arrows come from `frame`, or from the output if `frame` is `None`.
    ///
    /// # Errors
    /// If the result is damaged, or has too many points for a picture.
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
        let scene = Scene {
            title: title.trim_start(),
            range: match (self.range, limits) {
                (Range::Values(range), _) => Some(range),
                // With a linear scale, the colour bar of damage starts at 0 in all pictures.
                (_, Some(limits)) if frame.is_some() || limits.is_cut() || self.minus.is_some() => {
                    let [low, high] = limits.shown;
                    let from_zero = self.starts_at_zero() && !self.arguments.log;
                    let low = if from_zero { low.min(0.0) } else { low };
                    let zero_difference = self.minus.is_some().then_some((-1.0, 1.0));
                    (low < high).then_some((low, high)).or(zero_difference)
                }
                _ => None,
            },
            note: &note,
            bounds: frame.map(|frame| frame.bounds),
            vectors: scene.vectors.map(|vectors| Vectors {
                longest_arrow: frame.map(|frame| frame.longest_arrow),
                ..vectors
            }),
            ..scene
        };
        let contours = match &self.contours {
            None => Vec::new(),
            Some(Contours::Count(count)) => scene.levels(*count)?,
            Some(Contours::Values(values)) => values.clone(),
        };
        render(&Scene {
            contours: &contours,
            ..scene
        })
    }
}
