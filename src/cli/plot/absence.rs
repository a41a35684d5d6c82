//! Check that a picture shows points. Otherwise, return an error that gives the reason.

use fissure::error::{Error, Result};
use fissure::picture::{Axis, View};

use super::chunks::chunks;
use super::painter::Painter;

impl Painter<'_> {
    /// Check that the options `--slice`, `--clip` and `--threshold` leave points to draw in at least one of
    /// the outputs `indices`. With `--log`, at least one drawn value must be above 0. For each of these
    /// outputs, also check that the result of `--minus` has an output at the same time with the same number
    /// of points.
    ///
    /// # Errors
    /// If a check fails, or if the result is damaged.
    pub fn check(&self, indices: &[usize]) -> Result<()> {
        if let Some(minus) = &self.minus {
            for index in indices {
                minus.find(self.result, *index)?;
            }
        }
        if !self.is_partial() && !self.arguments.log {
            return Ok(());
        }
        let mut last = None;
        let mut are_drawn = false;
        for index in indices {
            if self.result.points(*index) == 0 {
                continue;
            }
            last = Some(*index);
            let points = self.points(*index)?;
            let scene = self.scene(&points);
            let marks = scene.marks()?;
            are_drawn |= !marks.is_empty();
            if are_drawn && (!self.arguments.log || marks.iter().any(|mark| mark.value > 0.0)) {
                return Ok(());
            }
        }
        match last {
            None => Ok(()),
            Some(_) if are_drawn => Err(Error::input(format!(
                "--log: no drawn value of {} is above 0",
                self.quantity.label
            ))),
            Some(index) => Err(self.nothing_drawn(index)?),
        }
    }

    /// Return the error for an output of which no point is drawn. The options `--clip`, `--slice` and
    /// `--threshold` are applied in this order. The message names the option that leaves no points. It also
    /// describes the points that remained before this option was applied. It gives the range of their
    /// positions or, for `--threshold`, of their values.
    fn nothing_drawn(&self, index: usize) -> Result<Error> {
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let include = |ends: &mut [f64; 2], value: f64| {
            if value.is_finite() {
                *ends = [ends[0].min(value), ends[1].max(value)];
            }
        };
        // Smallest and largest coordinates of all points (`all`), and of the points in the half spaces of
        // `--clip` (`kept`). Smallest and largest value of the points that are also in the slice (`values`).
        let (mut all, mut kept, mut values) = ([none; 3], [none; 3], none);
        let mut nearest: Option<f64> = None;
        let power = 1.0 / self.dimension as f64;
        for points in chunks(self.result.points(index)) {
            let drawn = self.drawn_values(index, points.clone())?;
            let thresholds = self.threshold_values(index, points.clone())?;
            let thresholds = thresholds.unwrap_or(drawn);
            let volumes = self.result.field_of("volume", index, points.clone())?;
            let places = self.result.positions_of(index, points.clone())?;
            let displacements = self.displacements(index, points)?;
            for (k, place) in self.drawn_positions(&places, &displacements).enumerate() {
                (all.iter_mut().zip(place)).for_each(|(ends, at)| include(ends, at));
                if self.is_clipped(place) {
                    continue;
                }
                (kept.iter_mut().zip(place)).for_each(|(ends, at)| include(ends, at));
                if let View::Slice { axis, position } = self.view {
                    let (at, distance) = (place[axis.index()], |at: f64| (at - position).abs());
                    if at.is_finite() && nearest.is_none_or(|old| distance(at) < distance(old)) {
                        nearest = Some(at);
                    }
                }
                if self.is_in_view(place, (volumes[k] / self.out_of_plane_measure).powf(power)) {
                    include(&mut values, thresholds[k]);
                }
            }
        }
        let message = match (self.view, &self.arguments.threshold) {
            _ if kept == [none; 3] && !self.arguments.clip.is_empty() => {
                let between = [Axis::X, Axis::Y, Axis::Z].map(|axis| {
                    let [low, high] = all[axis.index()];
                    format!("{} = {low:.4e} and {high:.4e} m", axis.letter())
                });
                let clips = self
                    .arguments
                    .clip
                    .iter()
                    .map(|clip| format!("--clip {clip}"));
                format!(
                    "{}: no points are drawn there; they are between {}",
                    clips.collect::<Vec<_>>().join(" "),
                    between[..self.dimension].join(", ")
                )
            }
            (_, Some(text)) if values != none => {
                let threshold = self.threshold.as_ref();
                let quantity = threshold.and_then(|threshold| threshold.quantity.as_ref());
                let quantity = quantity.unwrap_or(&self.quantity);
                let [low, high] = values;
                let unit = &quantity.unit;
                format!(
                    "--threshold {text}: no points are drawn; their values of {} are between \
                     {low:.4e} and {high:.4e} {unit}",
                    quantity.label
                )
                .trim_end()
                .to_owned()
            }
            (View::Slice { axis, position }, _) => {
                let name = axis.letter();
                let [low, high] = kept[axis.index()];
                let nearest = nearest.map_or(String::new(), |at| {
                    format!("; the nearest ones are at --slice {name}={at:.4e}")
                });
                format!(
                    "--slice {name}={position}: no points are drawn there; they are between \
                     {name} = {low:.4e} and {high:.4e} m{nearest}"
                )
            }
            _ => "no points are drawn: no position or value is a finite number".to_owned(),
        };
        Ok(Error::input(message))
    }
}
