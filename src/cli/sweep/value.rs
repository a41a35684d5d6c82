//! Values picked from histories, and the expected numbers (references) for these values.

use std::path::Path;

use fissure::error::{Error, Result};
use fissure::message::suggestion;

use crate::cli::plot::curves::read_csv;

/// Rule that picks a value from a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pick {
    Last,
    First,
    Max,
    Min,
}

const PICKS: [(&str, Pick); 4] = [
    ("last", Pick::Last),
    ("first", Pick::First),
    ("max", Pick::Max),
    ("min", Pick::Min),
];

/// A column of the history, and the rule that picks a value.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    pub pick: Pick,
    pub name: String,
}

/// Parse `[PICK:]COLUMN`.
pub fn column(text: &str) -> std::result::Result<Column, String> {
    let (pick, name) = text.split_once(':').unwrap_or(("last", text));
    let found = PICKS.iter().find(|(known, _)| *known == pick.trim());
    match (found, name.trim()) {
        (Some((_, pick)), name) if !name.is_empty() => Ok(Column {
            pick: *pick,
            name: name.to_owned(),
        }),
        _ => Err(format!(
            "`{text}` must be COLUMN or PICK:COLUMN, with last, first, max or min as PICK"
        )),
    }
}

/// Expected number for a picked value. `name` identifies this value by its column and its rule. If `name` is
/// `None`, the number belongs to the only picked value of the sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    name: Option<Column>,
    number: f64,
}

/// Parse `[VALUE=]NUMBER`.
pub fn reference(text: &str) -> std::result::Result<Reference, String> {
    let (name, number) = match text.split_once('=') {
        Some((name, number)) => (Some(column(name)?), number),
        None => (None, text),
    };
    match number.trim().parse::<f64>() {
        Ok(number) if number.is_finite() && number != 0.0 => Ok(Reference { name, number }),
        _ => Err(format!("`{}` must be a number, not 0", number.trim())),
    }
}

/// Return the expected number for each value; `None` for a value without a reference.
///
/// # Errors
/// If a reference names an unknown value, if a value has two references, or if a reference names no value
/// and the number of values is not 1.
pub fn references(values: &[Column], references: &[Reference]) -> Result<Vec<Option<f64>>> {
    let mut found = vec![None; values.len()];
    for Reference { name, number } in references {
        let wrong = |message: String| Err(Error::input(format!("--reference: {message}")));
        let index = match name {
            Some(name) => values.iter().position(|value| value == name),
            None if values.len() == 1 => Some(0),
            None if values.is_empty() => None,
            None => {
                return wrong(
                    "there are several values; name one, as max:kinetic_energy=2.5".to_owned(),
                );
            }
        };
        let Some(index) = index else {
            let named = name
                .as_ref()
                .map_or(String::new(), |name| format!(" {}", name.title()));
            return wrong(format!("there is no --value{named}"));
        };
        if found[index].replace(*number).is_some() {
            return wrong(format!("{} has two", values[index].title()));
        }
    }
    Ok(found)
}

impl Column {
    /// Return the text of `--value`, such as `max:damage`.
    pub fn title(&self) -> String {
        format!("{}:{}", self.pick_name(), self.name)
    }

    /// Return the name of the value, such as `max_damage`. The file names of pictures contain this name. The
    /// column names in sweep.csv also contain it.
    pub fn key(&self) -> String {
        format!("{}_{}", self.pick_name(), self.name)
    }

    fn pick_name(&self) -> &'static str {
        let found = PICKS.iter().find(|(_, pick)| *pick == self.pick);
        found.map_or("", |(name, _)| name)
    }

    /// Pick one of the numbers of a column; `None` if the picked number is not finite or there is no number.
    /// `Max` and `Min` ignore numbers that are not finite.
    fn of(&self, numbers: &[f64]) -> Option<f64> {
        let finite = numbers.iter().copied().filter(|number| number.is_finite());
        let picked = match self.pick {
            Pick::Last => numbers.last().copied(),
            Pick::First => numbers.first().copied(),
            Pick::Max => finite.reduce(f64::max),
            Pick::Min => finite.reduce(f64::min),
        };
        picked.filter(|number| number.is_finite())
    }
}

/// Check that a history has all columns that `values` names. `columns` are the names and units of the columns
/// of the history.
///
/// # Errors
/// If the column of a value is missing.
pub fn check(values: &[Column], columns: &[(String, &str)]) -> Result<()> {
    let names = || columns.iter().map(|(name, _)| name.as_str());
    match values
        .iter()
        .find(|value| !names().any(|name| name == value.name))
    {
        None => Ok(()),
        Some(value) => Err(Error::input(format!(
            "--value {}: the history has no column `{}`{}",
            value.title(),
            value.name,
            suggestion(&value.name, names())
        ))),
    }
}

/// Read the picked value of each column, and its unit, from the history in a folder. A value is `None` if it
/// is not finite, or if the history has no rows.
///
/// # Errors
/// If the history cannot be read or lacks a column.
pub fn read(folder: &Path, columns: &[Column]) -> Result<Vec<(Option<f64>, String)>> {
    if columns.is_empty() {
        return Ok(Vec::new());
    }
    let path = folder.join("history.csv");
    let (history, _) = read_csv(&path)?;
    let value = |column: &Column| {
        let found = history.iter().find(|stored| stored.name == column.name);
        let stored = found.ok_or_else(|| {
            let known = suggestion(
                &column.name,
                history.iter().map(|stored| stored.name.as_str()),
            );
            Error::input(format!(
                "--value {}: {} has no column `{}`{known}",
                column.title(),
                path.display(),
                column.name
            ))
        })?;
        let unit = if stored.unit == "1" { "" } else { &stored.unit };
        Ok((column.of(&stored.values), unit.to_owned()))
    };
    columns.iter().map(value).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_picked() {
        let of = |text: &str| column(text).unwrap().of(&[2.0, f64::NAN, 5.0, -1.0]);
        assert_eq!(of("a"), Some(-1.0));
        assert_eq!(of("first:a"), Some(2.0));
        assert_eq!(of("max:a"), Some(5.0));
        assert_eq!(of("min:a"), Some(-1.0));
        assert_eq!(column("a").unwrap().of(&[1.0, f64::NAN]), None);
        assert_eq!(column("max:a").unwrap().of(&[]), None);
        for text in ["mean:a", "max:", "", ":a"] {
            assert!(
                column(text)
                    .unwrap_err()
                    .contains("last, first, max or min"),
                "{text}"
            );
        }
    }

    #[test]
    fn references_belong_to_values() {
        let values = [column("a").unwrap(), column("max:b").unwrap()];
        let find = |texts: &[&str], values: &[Column]| {
            let given: Vec<Reference> = texts.iter().map(|text| reference(text).unwrap()).collect();
            references(values, &given).map_err(|error| error.message)
        };
        assert_eq!(find(&["max:b=2"], &values), Ok(vec![None, Some(2.0)]));
        assert_eq!(find(&["-3.5"], &values[..1]), Ok(vec![Some(-3.5)]));
        for (texts, values, message) in [
            (&["2"][..], &values[..], "several values"),
            (&["min:b=2"], &values, "no --value min:b"),
            (&["2"], &[], "there is no --value"),
            (&["a=1", "last:a=2"], &values, "last:a has two"),
        ] {
            let error = find(texts, values).unwrap_err();
            assert!(error.contains(message), "{error}");
        }
        for text in ["x", "a=", "0", "a=inf"] {
            assert!(
                reference(text)
                    .unwrap_err()
                    .contains("must be a number, not 0"),
                "{text}"
            );
        }
    }
}
