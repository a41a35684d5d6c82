//! The range of the colours, and the settings that all frames of a film share.

use fissure::error::{Error, Result};
use fissure::picture::Bounds;

use super::choice::number;
use crate::cli::format::with_unit;

/// Percentiles at the ends of the automatic range of colours if there are outliers.
const PERCENTILES: [f64; 2] = [0.5, 99.5];

/// Values have outliers if the range of all values exceeds this constant times the range between the
/// [`PERCENTILES`].
const OUTLIERS: f64 = 4.0;

/// Largest number of decades that the automatic range of a logarithmic scale covers. Without this limit, the
/// round-off of values that should be 0 would set the low end.
const DECADES: i32 = 6;

/// Requested range of the colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Range {
    /// All values if there are no outliers; otherwise the values between the two [`PERCENTILES`].
    Automatic,
    /// All values.
    All,
    /// Values between two percentiles.
    Percentiles([f64; 2]),
    /// Values between two numbers.
    Values((f64, f64)),
}

/// Read the argument of `--range`.
///
/// # Errors
/// If the text is neither two values, nor two percentiles from 0 to 100, nor `all`, or if the first number is
/// not below the second number.
pub fn range_of(text: &str) -> Result<Range> {
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

/// Range of the drawn values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Values at the low and the high end of the colour bar.
    pub shown: [f64; 2],
    /// Smallest and largest value before [`Cut`] excludes values.
    all: [f64; 2],
    cut: Cut,
}

/// Rule that excludes values from the colour bar.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Cut {
    Nothing,
    /// Exclude values below the lower percentile and above the upper percentile.
    Percentiles([f64; 2]),
    /// Exclude values that are more than [`DECADES`] decades below the largest value.
    Decades,
}

impl Limits {
    /// Return the limits of `values` for the requested `range`; `None` if `values` is empty. For
    /// [`Range::Values`], the limits are those of all values. The painter later replaces these limits by the
    /// two numbers of [`Range::Values`]. If the values at the low and the high percentile are equal, the
    /// limits for [`Range::Automatic`] and [`Range::Percentiles`] are also those of all values.
    pub fn of(mut values: Vec<f64>, range: Range) -> Option<Self> {
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
            cut: if uses {
                Cut::Percentiles(wanted)
            } else {
                Cut::Nothing
            },
        })
    }

    /// Return the limits of a logarithmic scale for the values above 0; `None` if no value is above 0. The
    /// automatic range covers at most [`DECADES`] decades.
    pub fn logarithmic(mut values: Vec<f64>, asked: Range) -> Option<Self> {
        values.retain(|value| *value > 0.0);
        let range = match asked {
            Range::Automatic => Range::All,
            range => range,
        };
        let mut limits = Self::of(values, range)?;
        let [low, high] = limits.all;
        let least = high * 10_f64.powi(-DECADES);
        if asked == Range::Automatic && low < least {
            limits.shown = [least, high];
            limits.cut = Cut::Decades;
        }
        Some(limits)
    }

    /// Test whether the ends of the colour bar follow from a rule that excludes values.
    pub fn is_cut(&self) -> bool {
        self.cut != Cut::Nothing
    }

    /// Return limits with a colour bar that has 0 in its middle. This colour bar includes all values of the
    /// colour bar of `self`.
    pub fn symmetric(self) -> Self {
        let [low, high] = self.shown;
        let reach = low.abs().max(high.abs());
        Self {
            shown: [-reach, reach],
            ..self
        }
    }

    /// Return limits that enclose those of `self` and `other`.
    pub fn union(self, other: Self) -> Self {
        let union = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        Self {
            shown: union(self.shown, other.shown),
            all: union(self.all, other.all),
            cut: if self.is_cut() { self.cut } else { other.cut },
        }
    }

    /// Format a note that gives the range of all values, and the rule that excludes values from the colour
    /// bar. The note is empty without such a rule.
    pub fn note(&self, unit: &str) -> String {
        let colours = match self.cut {
            Cut::Nothing => return String::new(),
            Cut::Percentiles([low, high]) => format!("from percentile {low} to {high}"),
            Cut::Decades => format!("over {DECADES} decades"),
        };
        let [low, high] = self.all.map(|value| with_unit(value, unit));
        format!("colours {colours}; values from {low} to {high}").replace('-', "−")
    }
}

/// Settings that all frames of a film share.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// Box that all frames show, m.
    pub bounds: Bounds,
    /// Limits of the values; `None` without values.
    pub limits: Option<Limits>,
    /// Vector length that the longest arrow represents, in the unit of the vectors; 0 without vectors.
    pub longest_arrow: f64,
}

impl Frame {
    /// Return a frame that encloses the frames of several outputs; `None` if no output has a frame.
    ///
    /// # Errors
    /// If an output is damaged.
    pub fn of_all(frames: impl Iterator<Item = Result<Option<Self>>>) -> Result<Option<Self>> {
        let mut all: Option<Self> = None;
        for frame in frames {
            all = match (all, frame?) {
                (Some(all), Some(own)) => Some(all.union(own)),
                (all, own) => all.or(own),
            };
        }
        Ok(all)
    }

    /// Return a frame that encloses `self` and `other`.
    fn union(self, other: Self) -> Self {
        Self {
            bounds: self.bounds.union(other.bounds),
            limits: match (self.limits, other.limits) {
                (Some(a), Some(b)) => Some(a.union(b)),
                (a, b) => a.or(b),
            },
            longest_arrow: self.longest_arrow.max(other.longest_arrow),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outliers_do_not_set_the_range() {
        let mut values: Vec<f64> = (0..1000).map(f64::from).collect();
        let limits = Limits::of(values.clone(), Range::Automatic).unwrap();
        assert_eq!((limits.shown, limits.is_cut()), ([0.0, 999.0], false));
        values[3] = 1e9;
        let limits = Limits::of(values.clone(), Range::Automatic).unwrap();
        assert_eq!((limits.shown, limits.all), ([6.0, 995.0], [0.0, 1e9]));
        let note = limits.note("Pa");
        assert!(note.ends_with("values from 0 Pa to 1.000 GPa"), "{note}");
        let note = limits.note("m^3");
        assert!(note.ends_with("values from 0 m^3 to 1.000e9 m^3"), "{note}");
        let limits = Limits::of(values.clone(), Range::All).unwrap();
        assert_eq!((limits.shown, limits.note("Pa").as_str()), ([0.0, 1e9], ""));
        let limits = Limits::of(values, Range::Percentiles([0.0, 50.0])).unwrap();
        assert_eq!(limits.shown, [0.0, 501.0]);
        // Few values of a pulse differ from the others, and the range must include these few values.
        let pulse: Vec<f64> = (0..1000).map(|k| f64::from(u8::from(k == 7))).collect();
        let limits = Limits::of(pulse, Range::Automatic).unwrap();
        assert!(!limits.is_cut());
        assert_eq!(Limits::of(Vec::new(), Range::Automatic), None);
    }

    #[test]
    fn logarithmic_limits_cover_six_decades_of_values_above_zero() {
        let limits = |values: &[f64], range| Limits::logarithmic(values.to_vec(), range);
        let values = [-7.0, 0.0, 1e-20, 1.0, 1e3];
        let automatic = limits(&values, Range::Automatic).unwrap();
        assert_eq!(
            (automatic.shown, automatic.all),
            ([1e-3, 1e3], [1e-20, 1e3])
        );
        let note = automatic.note("");
        assert!(
            note.starts_with("colours over 6 decades; values from"),
            "{note}"
        );
        let all = limits(&values, Range::All).unwrap();
        assert_eq!((all.shown, all.is_cut()), ([1e-20, 1e3], false));
        let few = limits(&values[3..], Range::Automatic).unwrap();
        assert_eq!((few.shown, few.is_cut()), ([1.0, 1e3], false));
        assert_eq!(limits(&values[..2], Range::Automatic), None);
    }

    #[test]
    fn ranges_are_values_or_percentiles() {
        assert_eq!(range_of("-1,2").unwrap(), Range::Values((-1.0, 2.0)));
        assert_eq!(
            range_of("5%, 95%").unwrap(),
            Range::Percentiles([5.0, 95.0])
        );
        assert_eq!(range_of("all").unwrap(), Range::All);
        for wrong in ["1", "2,1", "5%,9", "-1%,50%", "a,b"] {
            assert!(range_of(wrong).is_err(), "{wrong}");
        }
    }
}
