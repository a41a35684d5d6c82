//! Difference of the drawn quantity to another result.

use std::ops::Range;
use std::path::{Path, PathBuf};

use fissure::error::{Error, Result};
use fissure::output::ResultReader;

use super::quantity::Quantity;
use crate::cli::result_file;

/// Largest difference of two times that count as equal, as a fraction of the later time.
const SAME_TIME: f64 = 1e-9;

/// The result that `--minus` names.
pub struct Subtrahend {
    path: PathBuf,
    result: ResultReader,
    times: Vec<f64>,
}

impl Subtrahend {
    /// Open the result.
    ///
    /// # Errors
    /// If the file is not a result, or does not have the field of the quantity with the same components.
    pub fn open(path: &Path, quantity: &Quantity) -> Result<Self> {
        let path = result_file(path);
        let result = ResultReader::open(&path)?;
        let fields = result.fields()?;
        let field = fields.iter().find(|field| field.name == quantity.field);
        if field.is_none_or(|field| field.components != quantity.components) {
            let message = format!(
                "--minus {}: has no field `{}` with {} component(s)",
                path.display(),
                quantity.field,
                quantity.components
            );
            return Err(Error::input(message));
        }
        let times = result.times()?;
        Ok(Self {
            path,
            result,
            times,
        })
    }

    /// Return the index of the output that belongs to an output of `minuend`; `time` is the time of this
    /// output, s.
    ///
    /// # Errors
    /// If this result has no output at this time, or another number of points.
    pub fn find(&self, minuend: &ResultReader, index: usize, time: f64) -> Result<usize> {
        let is_same = |other: &f64| (other - time).abs() <= SAME_TIME * time.abs().max(other.abs());
        let Some(own) = self.times.iter().position(is_same) else {
            return Err(self.wrong(&format!("has no output at t = {time:e} s")));
        };
        if self.result.points(own) != minuend.points(index) {
            return Err(self.wrong(&format!("has other points at t = {time:e} s")));
        }
        Ok(own)
    }

    /// Subtract the values of this result from those of consecutive points of an output of `minuend`; `time`
    /// is the time of the output, s.
    ///
    /// # Errors
    /// If this result has no output at this time, or other points, or is damaged.
    pub fn subtract(
        &self,
        (minuend, index, time): (&ResultReader, usize, f64),
        points: Range<usize>,
        quantity: &Quantity,
        values: &mut [f64],
    ) -> Result<()> {
        let own = self.find(minuend, index, time)?;
        if self.result.ids_of(own, points.clone())? != minuend.ids_of(index, points.clone())? {
            return Err(self.wrong(&format!("has other points at t = {time:e} s")));
        }
        let subtracted = self.result.field_of(&quantity.field, own, points)?;
        for (value, subtracted) in values.iter_mut().zip(quantity.of(subtracted)) {
            *value -= subtracted;
        }
        Ok(())
    }

    fn wrong(&self, what: &str) -> Error {
        Error::input(format!("--minus {}: {what}", self.path.display()))
    }
}
