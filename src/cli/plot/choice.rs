//! The output, the field and the view of a picture, from the arguments of the command.

use std::path::Path;

use fissure::error::{Error, Result};
use fissure::message::suggestion;
use fissure::output::StoredField;
use fissure::picture::{Axis, View};

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

/// Read a finite number. `wanted` starts the error message.
///
/// # Errors
/// If the text is not a finite number.
pub fn number(text: &str, wanted: &str) -> Result<f64> {
    let value = text
        .trim()
        .parse()
        .ok()
        .filter(|value: &f64| value.is_finite());
    value.ok_or_else(|| Error::input(format!("{wanted}, is `{text}`")))
}

/// Return the indices of the outputs to draw.
///
/// # Errors
/// If there is no output, or the time is outside of the result.
pub fn choose_times(text: &str, times: &[f64]) -> Result<Vec<usize>> {
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

/// Return the field to draw: the named field, else the first existing field of [`PREFERRED`], else a field
/// that changes with time.
///
/// # Errors
/// If the result has no such field.
pub fn choose_field<'a>(
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

/// Return the view of a body of this dimension; `slice` is the argument of `--slice`.
///
/// # Errors
/// If the text is not AXIS=POSITION, or the body is not 3-D.
pub fn view(slice: Option<&str>, dimension: usize) -> Result<View> {
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
}
