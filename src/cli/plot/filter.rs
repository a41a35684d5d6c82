//! Restriction of a picture to some of the points: half spaces and ranges of values.

use std::path::Path;

use fissure::error::{Error, Result};
use fissure::output::StoredField;
use fissure::picture::Axis;

use super::choice::{axis_named, choose_field, number};
use super::quantity::Quantity;

/// A half space; only the points in this half space are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clip {
    axis: Axis,
    /// True if the half space is below `position`, false if it is above.
    is_below: bool,
    /// Coordinate of the half space's boundary along `axis`, m.
    position: f64,
}

impl Clip {
    /// Read an argument of `--clip`, such as `x<0.01`, for a body of this dimension.
    ///
    /// # Errors
    /// If the text is not AXIS<POSITION or AXIS>POSITION, or the body does not have the axis.
    pub fn new(text: &str, dimension: usize) -> Result<Self> {
        let wanted = "--clip must be AXIS<POSITION or AXIS>POSITION, such as 'x<0.01'";
        let wrong = || Error::input(format!("{wanted}, is `{text}`"));
        let at = text.find(['<', '>']).ok_or_else(wrong)?;
        let axis = axis_named(text[..at].trim()).ok_or_else(wrong)?;
        if axis.index() >= dimension {
            return Err(Error::input(format!(
                "--clip {text}: this result is {dimension}-D and has no coordinate {}",
                axis.letter()
            )));
        }
        Ok(Self {
            axis,
            is_below: text[at..].starts_with('<'),
            position: number(&text[at + 1..], wanted)?,
        })
    }

    /// Test whether a position (m) is in the half space.
    pub fn holds(&self, position: [f64; 3]) -> bool {
        let coordinate = position[self.axis.index()];
        if self.is_below {
            coordinate < self.position
        } else {
            coordinate > self.position
        }
    }
}

/// A range of values; only points with values in this range are drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Threshold {
    low: f64,
    high: f64,
    /// The quantity whose values are compared with the range; `None` for the drawn quantity.
    pub quantity: Option<Quantity>,
}

impl Threshold {
    /// Read the arguments of two options. `text` is the argument of `--threshold`, such as `0.3:1`, `0.3:` or
    /// `:1`. `field` is the argument of `--threshold-field`.
    ///
    /// # Errors
    /// If the text is not LOW:HIGH, if both ends are open, if LOW is above HIGH, or if the field or component
    /// is missing.
    pub fn new(
        text: &str,
        field: Option<&str>,
        path: &Path,
        fields: &[StoredField],
    ) -> Result<Self> {
        let wanted = "--threshold must be LOW:HIGH, LOW: or :HIGH";
        let wrong = || Error::input(format!("{wanted}, is `{text}`"));
        let (low, high) = text.split_once(':').ok_or_else(wrong)?;
        let end = |end: &str, open: f64| match end.trim() {
            "" => Ok(open),
            end => number(end, wanted),
        };
        let (low, high) = (end(low, f64::NEG_INFINITY)?, end(high, f64::INFINITY)?);
        if low == f64::NEG_INFINITY && high == f64::INFINITY {
            return Err(wrong());
        }
        if low > high {
            let message = format!("--threshold {text}: LOW must not be above HIGH");
            return Err(Error::input(message));
        }
        let quantity = field.map(|field| {
            let (name, component) = match field.split_once(':') {
                Some((name, component)) => (name, Some(component)),
                None => (field, None),
            };
            Quantity::new(choose_field(Some(name), path, fields)?, component)
        });
        Ok(Self {
            low,
            high,
            quantity: quantity.transpose()?,
        })
    }

    /// Test whether a value is in the range, which includes its ends.
    pub fn holds(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_spaces_end_at_a_coordinate() {
        let below = Clip::new("x<0.01", 3).unwrap();
        assert!(below.holds([0.0099, 5.0, 5.0]) && !below.holds([0.01, 0.0, 0.0]));
        let above = Clip::new("z > -1e-3", 3).unwrap();
        assert!(above.holds([0.0; 3]) && !above.holds([0.0, 0.0, -2e-3]));
        for wrong in ["x=1", "x", "w<1", "<1", "x<", "x<a", "x<nan", "x<=1"] {
            let message = Clip::new(wrong, 3).unwrap_err().message;
            assert!(
                message.contains("AXIS<POSITION or AXIS>POSITION"),
                "{message}"
            );
        }
        let message = Clip::new("z<1", 2).unwrap_err().message;
        assert!(
            message.contains("is 2-D and has no coordinate z"),
            "{message}"
        );
    }

    #[test]
    fn thresholds_include_their_ends_and_may_be_open() {
        let threshold = |text| Threshold::new(text, None, Path::new(""), &[]);
        let both = threshold("0.2: 0.5").unwrap();
        let held = [0.1, 0.2, 0.5, 0.6, f64::NAN].map(|value| both.holds(value));
        assert_eq!(held, [false, true, true, false, false]);
        assert!(threshold("-3e6:").unwrap().holds(1e300));
        assert!(threshold(":-3e6").unwrap().holds(-1e300));
        for wrong in ["0.2", ":", "", "a:1", "1:b", "0.5:0.2"] {
            assert!(threshold(wrong).is_err(), "{wrong}");
        }
    }
}
