//! The combinations of values of a sweep. Each combination is a row of the sweep's table.

use std::collections::HashSet;

use fissure::error::{Error, Result};
use fissure::message::suggestion;

/// Largest length of a folder name that contains the values of a run, bytes.
const LONGEST_NAME: usize = 120;

/// Name of a parameter or key, and its values as texts.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub name: String,
    pub values: Vec<String>,
}

/// Parse `NAME=VALUE,…`.
pub fn axis(text: &str) -> std::result::Result<Axis, String> {
    let wrong = || {
        format!(
            "`{text}` must be NAME=VALUE or NAME=VALUE,VALUE,…, with a name of [parameters] or a key such as \
             time.safety"
        )
    };
    let (name, values) = text.split_once('=').ok_or_else(wrong)?;
    let values = split(values);
    if name.trim().is_empty() || values.iter().any(String::is_empty) {
        return Err(wrong());
    }
    let mut seen = HashSet::new();
    if let Some(twice) = values.iter().find(|value| !seen.insert(*value)) {
        return Err(format!("`{name}` has the value {twice} twice"));
    }
    Ok(Axis {
        name: name.trim().to_owned(),
        values,
    })
}

/// Split a text at commas outside of brackets and quotes.
fn split(text: &str) -> Vec<String> {
    let mut parts = vec![String::new()];
    let (mut depth, mut quote) = (0, None);
    for c in text.chars() {
        match (c, quote) {
            ('"' | '\'', None) => quote = Some(c),
            (_, Some(open)) if c == open => quote = None,
            ('[' | '{' | '(', None) => depth += 1,
            (']' | '}' | ')', None) => depth -= 1,
            (',', None) if depth == 0 => {
                parts.push(String::new());
                continue;
            }
            _ => {}
        }
        if let Some(part) = parts.last_mut() {
            part.push(c);
        }
    }
    parts.iter().map(|part| part.trim().to_owned()).collect()
}

/// Parse a list of rows such as `1-4,7`. Row numbers in the list start at 1; the returned indices start at 0.
/// `count` is the number of rows of the design.
///
/// # Errors
/// If a part of the list is neither a row from 1 to `count` nor a range of such rows.
pub fn rows(list: &str, count: usize) -> Result<Vec<usize>> {
    let mut rows = Vec::new();
    for part in list.split(',').map(str::trim) {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        match (first.trim().parse::<usize>(), last.trim().parse::<usize>()) {
            (Ok(first), Ok(last)) if 1 <= first && first <= last && last <= count => {
                rows.extend(first - 1..last);
            }
            _ => {
                let message = format!(
                    "--rows: `{part}` is not one of the rows 1 to {count}, or a range of them"
                );
                return Err(Error::input(message));
            }
        }
    }
    Ok(rows)
}

/// Combinations of the values of all axes. An axis is a parameter or key with its values.
pub struct Design {
    pub axes: Vec<Axis>,
    /// Each row is one combination. It contains one index per axis, which selects a value of the axis.
    pub rows: Vec<Vec<usize>>,
    zip: bool,
}

impl Design {
    /// Create all combinations of the values; the value of the last axis changes fastest. With `zip`, row k
    /// combines the k-th values of all axes; an axis with one value has this value in all rows.
    ///
    /// # Errors
    /// If a name is given twice. With `zip`, also if two axes with more than one value have different numbers
    /// of values.
    pub fn new(axes: &[Axis], zip: bool) -> Result<Self> {
        for (number, axis) in axes.iter().enumerate() {
            if axes[..number].iter().any(|other| other.name == axis.name) {
                let message = format!(
                    "--set {}: is given twice; list its values with commas",
                    axis.name
                );
                return Err(Error::input(message));
            }
        }
        let rows = if zip {
            let count = axes.iter().map(|axis| axis.values.len()).max().unwrap_or(1);
            for axis in axes {
                if ![1, count].contains(&axis.values.len()) {
                    let has = axis.values.len();
                    return Err(Error::input(format!(
                        "--zip: {} has {has} values, another name has {count}; all must have one value or equally many",
                        axis.name
                    )));
                }
            }
            let index = |k: usize| move |axis: &Axis| k.min(axis.values.len() - 1);
            (0..count)
                .map(|k| axes.iter().map(index(k)).collect())
                .collect()
        } else {
            let mut rows = vec![Vec::new()];
            for axis in axes {
                let longer = |row: Vec<usize>| {
                    (0..axis.values.len()).map(move |value| [&row[..], &[value]].concat())
                };
                rows = rows.into_iter().flat_map(longer).collect();
            }
            rows
        };
        let axes = axes.to_vec();
        Ok(Self { axes, rows, zip })
    }

    /// Return the indices of the axes with several values.
    pub fn varied(&self) -> impl Iterator<Item = usize> {
        (0..self.axes.len()).filter(|axis| self.axes[*axis].values.len() > 1)
    }

    /// Return the value of an axis in a row, as text.
    pub fn value(&self, row: &[usize], axis: usize) -> &str {
        &self.axes[axis].values[row[axis]]
    }

    /// Return the name of each axis, with the value of the axis in `row`, as text.
    pub fn assignments(&self, row: &[usize]) -> Vec<(String, String)> {
        let assignment = |axis: usize| {
            (
                self.axes[axis].name.clone(),
                self.value(row, axis).to_owned(),
            )
        };
        (0..self.axes.len()).map(assignment).collect()
    }

    /// Format a row for messages: the names and values of the axes with several values, or of all axes if no
    /// axis has several values.
    pub fn label(&self, row: &[usize]) -> String {
        self.label_without(row, None)
    }

    fn label_without(&self, row: &[usize], left_out: Option<usize>) -> String {
        let mut axes: Vec<usize> = self.varied().collect();
        if axes.is_empty() {
            axes = (0..self.axes.len()).collect();
        }
        axes.retain(|axis| Some(*axis) != left_out);
        let word = |axis: &usize| format!("{}={}", self.axes[*axis].name, self.value(row, *axis));
        axes.iter().map(word).collect::<Vec<_>>().join(", ")
    }

    /// Return the folder name of each row: the label of the row, with `_` instead of special characters.
    /// Return `row_1`, `row_2`, … if these names are not distinct, or if a name has more than
    /// [`LONGEST_NAME`] bytes.
    pub fn folders(&self) -> Vec<String> {
        let safe = |c: char| c.is_ascii_alphanumeric() || "._+-=,".contains(c);
        let name = |row: &Vec<usize>| -> String {
            let label = self.label(row).replace(", ", ",");
            label
                .chars()
                .map(|c| if safe(c) { c } else { '_' })
                .collect()
        };
        let names: Vec<String> = self.rows.iter().map(name).collect();
        let distinct: HashSet<&String> = names.iter().collect();
        if distinct.len() == names.len() && names.iter().all(|name| name.len() <= LONGEST_NAME) {
            return names;
        }
        (1..=names.len())
            .map(|number| format!("row_{number}"))
            .collect()
    }

    /// Return the value of an axis in a row as a number; `None` if the value is not a finite number.
    pub fn number(&self, row: &[usize], axis: usize) -> Option<f64> {
        number(self.value(row, axis))
    }

    /// Return the index of the abscissa. This axis of the sweep is the x axis of the pictures, and its values
    /// are used to compute rates of convergence. With a `name`, the abscissa is the axis of this name.
    /// Without a `name`, it is the first axis with several values that are all numbers; the result is `None`
    /// if no axis has such values.
    ///
    /// # Errors
    /// If the named axis is missing, has one value, or has values that are not numbers.
    pub fn abscissa(&self, name: Option<&str>) -> Result<Option<usize>> {
        let is_number = |axis: &usize| {
            self.axes[*axis]
                .values
                .iter()
                .all(|text| number(text).is_some())
        };
        let Some(name) = name else {
            return Ok(self.varied().find(is_number));
        };
        let wrong = |message: String| Err(Error::input(format!("--x {name}: {message}")));
        let Some(axis) = self.axes.iter().position(|axis| axis.name == name) else {
            let known = self.varied().map(|axis| self.axes[axis].name.as_str());
            return wrong(format!("is not set by --set{}", suggestion(name, known)));
        };
        if self.axes[axis].values.len() < 2 {
            return wrong("has one value only".to_owned());
        }
        if !is_number(&axis) {
            return wrong("has values that are not numbers".to_owned());
        }
        Ok(Some(axis))
    }

    /// Group the rows that differ only in the axis `abscissa`; with `zip`, all rows form one group. Return
    /// the name and the row indices of each group.
    pub fn groups(&self, abscissa: usize) -> Vec<(String, Vec<usize>)> {
        if self.zip {
            return vec![(String::new(), (0..self.rows.len()).collect())];
        }
        let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
        for (number, row) in self.rows.iter().enumerate() {
            let name = self.label_without(row, Some(abscissa));
            match groups.iter_mut().find(|(known, _)| *known == name) {
                Some((_, rows)) => rows.push(number),
                None => groups.push((name, vec![number])),
            }
        }
        groups
    }
}

fn number(text: &str) -> Option<f64> {
    let value: f64 = text.replace('_', "").parse().ok()?;
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn design(texts: &[&str], zip: bool) -> Result<Design> {
        let axes: Vec<Axis> = texts.iter().map(|text| axis(text).unwrap()).collect();
        Design::new(&axes, zip)
    }

    #[test]
    fn values_are_split_at_commas_outside_of_brackets_and_quotes() {
        let values = |text| axis(text).unwrap().values;
        assert_eq!(values("dx=1e-3, 5e-4"), ["1e-3", "5e-4"]);
        assert_eq!(values("a=[1, 2],[3, 4]"), ["[1, 2]", "[3, 4]"]);
        assert_eq!(
            values("a=max(b, 2),'c,d',\"(,\""),
            ["max(b, 2)", "'c,d'", "\"(,\""]
        );
        assert_eq!(values("a==2"), ["=2"]);
        for text in ["dx", "=1", "dx=", "dx=1,", "dx=,1"] {
            assert!(
                axis(text).unwrap_err().contains("must be NAME=VALUE"),
                "{text}"
            );
        }
        assert!(
            axis("dx=1,2,1")
                .unwrap_err()
                .contains("has the value 1 twice")
        );
    }

    #[test]
    fn combinations_are_all_or_those_of_equal_index() -> Result<()> {
        let all = design(&["a=1,2", "b=x", "c=5,6,7"], false)?;
        assert_eq!(all.rows.len(), 6);
        assert_eq!(all.label(&all.rows[4]), "a=2, c=6");
        assert_eq!(
            all.assignments(&all.rows[4])[1],
            ("b".to_owned(), "x".to_owned())
        );
        assert_eq!(all.groups(2)[1], ("a=2".to_owned(), vec![3, 4, 5]));
        let zipped = design(&["a=1,2", "b=x", "c=5,6"], true)?;
        assert_eq!(zipped.rows, [[0, 0, 0], [1, 0, 1]]);
        assert_eq!(zipped.groups(2), [(String::new(), vec![0, 1])]);
        let error = design(&["a=1,2", "c=5,6,7"], true).err().unwrap();
        assert!(
            error.message.contains("a has 2 values, another name has 3"),
            "{error}"
        );
        let error = design(&["a=1", "a=2"], false).err().unwrap();
        assert!(error.message.contains("given twice"), "{error}");
        Ok(())
    }

    #[test]
    fn folders_have_distinct_names() -> Result<()> {
        let names = |texts: &[&str]| design(texts, false).unwrap().folders();
        assert_eq!(
            names(&["grid.spacing=1e-3,5e-4", "m=3"]),
            ["grid.spacing=1e-3", "grid.spacing=5e-4"]
        );
        assert_eq!(names(&["a=x/y,x y"]), ["row_1", "row_2"]);
        assert_eq!(names(&["a=1", "b=2/3"]), ["a=1,b=2_3"]);
        assert_eq!(
            names(&[&format!("a=1,{}", "9".repeat(150))]),
            ["row_1", "row_2"]
        );
        Ok(())
    }

    #[test]
    fn the_abscissa_is_a_number_that_varies() -> Result<()> {
        let design = design(&["a=x,y", "b=1", "c=1_000,2e3"], false)?;
        assert_eq!(design.abscissa(None)?, Some(2));
        assert_eq!(design.number(&design.rows[0], 2), Some(1000.0));
        for (name, message) in [
            ("a", "not numbers"),
            ("b", "one value"),
            ("d", "is not set by --set"),
        ] {
            let error = design.abscissa(Some(name)).unwrap_err();
            assert!(error.message.contains(message), "{error}");
        }
        Ok(())
    }

    #[test]
    fn rows_are_chosen_by_numbers_and_ranges() {
        assert_eq!(rows("1-3, 5", 5).unwrap(), [0, 1, 2, 4]);
        for list in ["0", "6", "3-2", "a", "", "1-"] {
            assert!(
                rows(list, 5).unwrap_err().message.contains("rows 1 to 5"),
                "{list}"
            );
        }
    }
}
