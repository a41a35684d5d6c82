//! Choice of the output, the field and the view of a picture, according to the arguments of the command.

use std::path::Path;

use fissure::error::{Error, Result};
use fissure::message::suggestion;
use fissure::output::StoredField;
use fissure::picture::{Axis, Camera, ColourMap, View};

use crate::cli::without_output;

/// Largest distance of a requested time from the nearest output, if the time is before the first or after the
/// last output. The distance is given as a fraction of an interval between outputs. Before the first output,
/// this is the interval between the first two outputs. After the last output, it is the interval between the
/// last two outputs.
const TIME_REACH: f64 = 0.5;

/// Candidates for the field to draw if none is requested, in order of preference.
const PREFERRED: [&str; 6] = [
    "damage",
    "von_mises_stress",
    "cauchy_stress",
    "stress",
    "velocity",
    "displacement",
];

/// Read a finite number. The error message starts with `wanted`.
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

/// Return the indices of the outputs to draw. `text` is `all`, or a comma-separated list; each entry of the
/// list is a time (s) or `last`. `path` is the path of the result, for the error message.
///
/// # Errors
/// - If there is no output.
/// - If an entry of `text` is not allowed.
/// - If a time is more than half an output interval before the first output or after the last output.
pub fn choose_times(text: &str, path: &Path, times: &[f64]) -> Result<Vec<usize>> {
    let Some(last) = times.len().checked_sub(1) else {
        return Err(without_output(path));
    };
    if text == "all" {
        return Ok((0..=last).collect());
    }
    let chosen = text.split(',').map(|text| match text.trim() {
        "last" => Ok(last),
        "all" => Err(Error::input(
            "--time: `all` draws every output, so give no other time with it",
        )),
        text => {
            let wanted = number(text, "--time must be `all`, or times in s and `last`")?;
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
                return Ok(nearest);
            }
            Err(Error::input(format!(
                "--time {text}: the outputs are between {:e} and {:e} s; the nearest one is at --time {:e}",
                times[0], times[last], times[nearest]
            )))
        }
    });
    chosen.collect()
}

/// Return the field to draw. If `name` is given, return the field with this name. Otherwise, return the first
/// of these choices that exists:
/// - the field of the result that comes first in [`PREFERRED`],
/// - the first field that is stored for each output and is not `id`,
/// - the first field of the result.
///
/// `path` is the path of the result, for the error message.
///
/// # Errors
/// If the result has no field with this name, or no fields.
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

/// Return the colour map that has the name `name`.
///
/// # Errors
/// If there is no such colour map.
pub fn colour_map(name: &str) -> Result<ColourMap> {
    let mut maps = ColourMap::ALL.into_iter();
    maps.find(|map| map.name() == name).ok_or_else(|| {
        let known = suggestion(name, ColourMap::ALL.map(ColourMap::name));
        Error::input(format!(
            "--colors {name}: there is no such colour map{known}"
        ))
    })
}

/// Return the axis with a name; `None` if there is no such axis.
pub fn axis_named(name: &str) -> Option<Axis> {
    let mut axes = [Axis::X, Axis::Y, Axis::Z].into_iter();
    axes.find(|axis| axis.letter() == name)
}

/// Read the argument of `--camera`, such as `-30,20`.
fn camera_of(text: &str) -> Result<Camera> {
    let wanted = "--camera must be AZIMUTH,ELEVATION in degrees, such as -30,20";
    let wrong = || Error::input(format!("{wanted}, is `{text}`"));
    let (azimuth, elevation) = text.split_once(',').ok_or_else(wrong)?;
    let (azimuth, elevation) = (number(azimuth, wanted)?, number(elevation, wanted)?);
    if elevation.abs() > 90.0 {
        let message = format!("--camera {text}: ELEVATION must be from -90 to 90 degrees");
        return Err(Error::input(message));
    }
    Ok(Camera::new(azimuth, elevation))
}

/// Return the view of a body of this dimension; `slice` and `camera` are the arguments of the options
/// `--slice` and `--camera`.
///
/// # Errors
/// - If the slice is not of the form AXIS=POSITION.
/// - If the camera is not of the form AZIMUTH,ELEVATION, or the elevation is not from -90 to 90 degrees.
/// - If one of these options is given, but the body is not 3-D.
pub fn view(slice: Option<&str>, camera: Option<&str>, dimension: usize) -> Result<View> {
    let wanted = "--slice must be AXIS=POSITION, such as z=0.005";
    let given = camera.is_some();
    let camera = camera.map_or(Ok(Camera::isometric()), camera_of)?;
    if given && dimension != 3 {
        return Err(Error::input(
            "--camera is for solids; this result is not 3-D",
        ));
    }
    let Some(text) = slice else {
        return Ok(if dimension == 3 {
            View::Orthographic(camera)
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
    let axis = axis_named(axis.trim());
    Ok(View::Slice {
        axis: axis.ok_or_else(|| Error::input(format!("{wanted}, is `{text}`")))?,
        position: number(position, wanted)?,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cameras_are_for_solids() {
        let camera = |text, dimension| view(None, Some(text), dimension);
        let expected = View::Orthographic(Camera::new(-30.0, 20.0));
        assert_eq!(camera("-30, 20", 3).unwrap(), expected);
        assert_eq!(view(None, None, 2).unwrap(), View::Plane);
        for (text, dimension, words) in [
            ("30", 3, "must be AZIMUTH,ELEVATION"),
            ("a,1", 3, "must be AZIMUTH,ELEVATION"),
            ("0,91", 3, "ELEVATION must be from -90 to 90"),
            ("0,0", 2, "--camera is for solids"),
        ] {
            let message = camera(text, dimension).unwrap_err().message;
            assert!(message.contains(words), "{message}");
        }
    }

    #[test]
    fn colour_maps_have_names() {
        for map in ColourMap::ALL {
            assert_eq!(colour_map(map.name()).unwrap(), map);
        }
        let message = colour_map("virides").unwrap_err().message;
        assert!(message.contains("did you mean `viridis`?"), "{message}");
        assert!(message.ends_with("(known: viridis, turbo, coolwarm, grey, damage)"));
    }

    #[test]
    fn times_outside_of_the_result_are_rejected() {
        let times = [0.0, 1e-5, 2e-5];
        let choose = |text| choose_times(text, Path::new("a.vtkhdf"), &times);
        let chosen = |text| choose(text).unwrap();
        assert_eq!(chosen("0, last"), [0, times.len() - 1]);
        for wrong in ["0,", "all,last", ","] {
            assert!(choose(wrong).is_err(), "{wrong}");
        }
        assert_eq!(chosen("last"), [2]);
        assert_eq!(chosen("all"), [0, 1, 2]);
        assert_eq!(chosen("1.2e-5"), [1]);
        assert_eq!(chosen("2.4e-5"), [2]);
        assert_eq!(chosen("-4e-6"), [0]);
        for (text, nearest) in [("25", "--time 2e-5"), ("-1e-5", "--time 0e0")] {
            let message = choose(text).unwrap_err().message;
            assert!(message.ends_with(nearest), "{message}");
        }
        let path = Path::new("a.vtkhdf");
        assert!(choose_times("1", path, &[0.5]).is_err());
        let message = choose_times("last", path, &[]).unwrap_err().message;
        assert_eq!(message, "a.vtkhdf: the result holds no output yet");
    }
}
