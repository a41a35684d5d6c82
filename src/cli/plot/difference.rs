//! Difference between the drawn quantity and the same quantity of another result.

use std::ops::Range;
use std::path::{Path, PathBuf};

use fissure::error::{Error, Result};
use fissure::output::ResultReader;

use super::quantity::Quantity;
use crate::cli::result_file;

/// Relative tolerance for the comparison of output times. The times t₁ and t₂ count as equal if |t₁ − t₂| is
/// at most this constant times the larger of |t₁| and |t₂|.
const SAME_TIME: f64 = 1e-9;

/// The result that `--minus` names. Its values are subtracted from the values of the minuend. The minuend is
/// the result that is drawn.
pub struct Subtrahend {
    path: PathBuf,
    result: ResultReader,
    /// For each output of the minuend: its time (s), and the index of the subtrahend's output at this time.
    /// The index is `None` if the subtrahend has no output at this time.
    outputs: Vec<(f64, Option<usize>)>,
}

impl Subtrahend {
    /// Open the result that is subtracted from `minuend`.
    ///
    /// # Errors
    /// If the file is not a result, if it lacks the field of the quantity, or if the numbers of components of
    /// this field and of the quantity differ.
    pub fn open(path: &Path, minuend: &ResultReader, quantity: &Quantity) -> Result<Self> {
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
        let at = |time: f64| {
            let is_same = |own: &f64| (own - time).abs() <= SAME_TIME * time.abs().max(own.abs());
            (time, times.iter().position(is_same))
        };
        let outputs = minuend.times()?.into_iter().map(at).collect();
        Ok(Self {
            path,
            result,
            outputs,
        })
    }

    /// Take the time of output `index` of `minuend`, and return the index of the subtrahend's output at this
    /// time.
    ///
    /// # Errors
    /// If the subtrahend has no output at this time, or if this output and the output of `minuend` have
    /// different numbers of points.
    pub fn find(&self, minuend: &ResultReader, index: usize) -> Result<usize> {
        let (_, own) = self.outputs[index];
        let own = own.ok_or_else(|| self.wrong("has no output", index))?;
        if self.result.points(own) != minuend.points(index) {
            return Err(self.wrong("has other points", index));
        }
        Ok(own)
    }

    /// Subtract the values of the subtrahend from `values`. Before the call, `values` contains the values of
    /// `quantity` at `points` in output `index` of `minuend`.
    ///
    /// # Errors
    /// If the subtrahend has no output at the time of output `index` of `minuend`, if the two outputs have
    /// different points, or if one of the two files is damaged.
    pub fn subtract(
        &self,
        (minuend, index): (&ResultReader, usize),
        points: Range<usize>,
        quantity: &Quantity,
        values: &mut [f64],
    ) -> Result<()> {
        let own = self.find(minuend, index)?;
        if self.result.ids_of(own, points.clone())? != minuend.ids_of(index, points.clone())? {
            return Err(self.wrong("has other points", index));
        }
        let subtracted = self.result.field_of(&quantity.field, own, points)?;
        for (value, subtracted) in values.iter_mut().zip(quantity.of(subtracted)) {
            *value -= subtracted;
        }
        Ok(())
    }

    fn wrong(&self, what: &str, index: usize) -> Error {
        let (path, (time, _)) = (self.path.display(), self.outputs[index]);
        Error::input(format!("--minus {path}: {what} at t = {time:e} s"))
    }
}
