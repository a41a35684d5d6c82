//! Overlays of a picture: arrows, and lines of equal value.

use std::path::Path;

use fissure::error::{Error, Result};
use fissure::output::StoredField;

use super::choice::{choose_field, number};

/// Argument of `--contours`: the number of contour values, or the contour values themselves.
#[derive(Debug, Clone, PartialEq)]
pub enum Contours {
    /// Number of contour values, which lie at equal distances on the colour bar.
    Count(usize),
    /// Given values.
    Values(Vec<f64>),
}

/// Largest allowed number of lines, if the argument of `--contours` is a number of lines.
const MOST_CONTOURS: usize = 100;

impl Contours {
    /// Read the argument of `--contours`: a whole number is a count, and any other text is a list of values.
    ///
    /// # Errors
    /// - If the text is neither a count nor a list of values.
    /// - If the count is not from 1 to 100.
    /// - If the scale is logarithmic, and a value is not above 0.
    pub fn new(text: &str, is_logarithmic: bool) -> Result<Self> {
        if let Ok(count) = text.trim().parse::<usize>() {
            if (1..=MOST_CONTOURS).contains(&count) {
                return Ok(Self::Count(count));
            }
            return Err(Error::input(format!(
                "--contours {text}: a number of lines must be from 1 to {MOST_CONTOURS}; write one value \
                 with a decimal point, such as {text}.0"
            )));
        }
        let wanted = "--contours must be a number of lines, or values such as 1e6,2e6";
        let values = text.split(',').map(|value| number(value, wanted));
        let values = values.collect::<Result<Vec<f64>>>()?;
        if is_logarithmic && let Some(value) = values.iter().find(|value| **value <= 0.0) {
            return Err(Error::input(format!(
                "--contours: with --log, values must be above 0, one is {value}"
            )));
        }
        Ok(Self::Values(values))
    }
}

/// Return the vector field `name`, for `--vectors`.
///
/// # Errors
/// If the result has no field with this name, or the field is not a vector field.
pub fn vector_field<'a>(
    name: &str,
    path: &Path,
    fields: &'a [StoredField],
) -> Result<&'a StoredField> {
    let field = choose_field(Some(name), path, fields)?;
    if field.components == 3 {
        return Ok(field);
    }
    let vectors = fields.iter().filter(|field| field.components == 3);
    let known: Vec<&str> = vectors.map(|field| field.name.as_str()).collect();
    Err(Error::input(format!(
        "--vectors {name}: must be a field with 3 components, has {} (vector fields: {})",
        field.components,
        known.join(", ")
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fissure::output::Number;

    #[test]
    fn contours_are_a_count_or_values() {
        let contours = |text| Contours::new(text, false);
        assert_eq!(contours("9").unwrap(), Contours::Count(9));
        assert_eq!(contours("5.0").unwrap(), Contours::Values(vec![5.0]));
        assert_eq!(
            contours("-1, 2e6").unwrap(),
            Contours::Values(vec![-1.0, 2e6])
        );
        for wrong in ["0", "101", "a", "1,", "1,nan", ""] {
            assert!(contours(wrong).is_err(), "{wrong}");
        }
        let message = Contours::new("1.5,0", true).unwrap_err().message;
        assert!(message.contains("must be above 0, one is 0"), "{message}");
    }

    #[test]
    fn arrows_need_a_vector_field() {
        let field = |name: &str, components| StoredField {
            name: name.to_owned(),
            unit: "m".to_owned(),
            components,
            number: Number::F64,
            dynamic: true,
        };
        let fields = [
            field("damage", 1),
            field("displacement", 3),
            field("stress", 6),
        ];
        let chosen = |name| vector_field(name, Path::new("result"), &fields);
        assert_eq!(chosen("displacement").unwrap().name, "displacement");
        let message = chosen("stress").unwrap_err().message;
        assert!(message.ends_with("with 3 components, has 6 (vector fields: displacement)"));
        assert!(
            chosen("speed")
                .unwrap_err()
                .message
                .contains("has no field `speed`")
        );
    }
}
