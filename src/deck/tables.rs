//! Tables of a deck: values over time for use in expressions.

use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

use super::grammar::{self, Deck};
use super::number::Number;
use super::parameters;
use super::resolve::Scope;
use crate::deck::spanned::Spanned;
use crate::error::{Error, Result, excerpt};
use crate::expression::{Expression, Table};
use crate::message::{format_number, suggestion};
use crate::points::columns::{BYTE_ORDER_MARK, entries, heading, is_comment};
use crate::problem::{Action, Problem, RigidMotion};

/// Maximum number of rows of a table.
const MAX_ROWS: usize = 100_000;

/// Round-off tolerance of times, as a fraction of the end time of the stage or run.
const ROUNDING: f64 = 1e-9;

/// Maximum size of a file, bytes.
const LONGEST: u64 = 1 << 28;

/// Default names of the column of times; upper and lower case are equivalent.
const TIME: [&str; 2] = ["t", "time"];

/// Read the tables, and store them in the scope.
///
/// # Errors
/// - If the name of a table cannot be used in expressions.
/// - If the name of a table is already the name of a parameter or function.
/// - If a table is invalid.
pub fn read(scope: &mut Scope, deck: &Deck) -> Result<()> {
    for (name, spanned) in &deck.table {
        let key = format!("[table.{name}]");
        if let Some(fault) = parameters::name_fault(name) {
            let message = format!("{key}: not a name for a table; {fault}");
            return Err(scope.error(spanned.span(), message));
        }
        if Expression::is_function(name) || scope.parameters.contains_key(name) {
            let what = if scope.parameters.contains_key(name) {
                "a parameter"
            } else {
                "a function"
            };
            let message =
                format!("{key}: `{name}` is already the name of {what}; take another name");
            return Err(scope.error(spanned.span(), message));
        }
        let table = table(scope, &key, spanned)?;
        scope.tables.insert(name.clone(), Arc::new(table));
    }
    Ok(())
}

fn table(scope: &Scope, key: &str, spanned: &Spanned<grammar::Table>) -> Result<Table> {
    let table = spanned.get_ref();
    let given = [
        ("file", table.file.as_ref().map(Spanned::span)),
        ("values", table.values.as_ref().map(Spanned::span)),
    ];
    let is_inline = scope.exactly_one(spanned.span(), key, &given)? == 1;
    let misplaced = if is_inline {
        [
            ("column", table.column.as_ref().map(Spanned::span)),
            ("time", table.time.as_ref().map(Spanned::span)),
        ]
    } else {
        [
            ("times", table.times.as_ref().map(Spanned::span)),
            ("", None),
        ]
    };
    for (name, span) in misplaced {
        if let Some(span) = span {
            let (of, other) = if is_inline {
                ("file", "values")
            } else {
                ("values", "file")
            };
            let message = format!("{key} {name}: is only for `{of}`, but `{other}` is given");
            return Err(scope.error(span, message));
        }
    }
    match (&table.values, &table.file) {
        (Some(values), _) => inline(scope, key, values, table.times.as_ref()),
        (None, file) => {
            let file = file.as_ref().expect("values or a file are given");
            from_file(scope, key, table, file)
        }
    }
}

/// Return a table whose rows are in the deck.
fn inline(
    scope: &Scope,
    key: &str,
    values: &Spanned<Vec<Number>>,
    times: Option<&Spanned<Vec<Number>>>,
) -> Result<Table> {
    let Some(times) = times else {
        let message = format!("{key} values: needs `times` with the same number of entries");
        return Err(scope.error(values.span(), message));
    };
    let numbers = |list: &Spanned<Vec<Number>>, name: &str| {
        let key = format!("{key} {name}");
        let numbers = list.get_ref().iter();
        numbers
            .map(|number| scope.number(number, &key))
            .collect::<Result<Vec<f64>>>()
    };
    let (written, count) = (times.get_ref(), values.get_ref().len());
    if count > MAX_ROWS {
        let message = format!("{key} values: has more than {MAX_ROWS} rows, the maximum");
        return Err(scope.error(values.span(), message));
    }
    if written.len() != count {
        let message = format!(
            "{key} times: must have as many entries as `values`, {count}, has {}",
            written.len()
        );
        return Err(scope.error(times.span(), message));
    }
    let rows = [numbers(times, "times")?, numbers(values, "values")?];
    let [times_s, values] = rows;
    Table::new(times_s, values).map_err(|(row, message)| {
        let span = written.get(row).map_or(times.span(), Spanned::span);
        scope.error(span, format!("{key} times: {message}"))
    })
}

/// Return a table from two columns of a file.
fn from_file(
    scope: &Scope,
    key: &str,
    table: &grammar::Table,
    file: &grammar::Text,
) -> Result<Table> {
    let folder = scope.source.path.parent().unwrap_or(Path::new(""));
    let path = folder.join(file.get_ref());
    let unreadable = |error: std::io::Error| {
        let message = format!("{key} file: cannot read {}: {error}", path.display());
        scope.error(file.span(), message)
    };
    let at =
        |line: u64, message: String| Error::input(format!("{}:{line}: {message}", path.display()));
    let header = heading(&path).map_err(unreadable)?;
    let length = std::fs::metadata(&path).map_err(unreadable)?.len();
    if length > LONGEST {
        let message =
            format!("{key} file: is longer than {LONGEST} bytes; check that this is a table");
        return Err(scope.error(file.span(), message));
    }
    let bytes = std::fs::read(&path).map_err(unreadable)?;
    let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&bytes);
    let Ok(text) = std::str::from_utf8(bytes) else {
        return Err(at(1, "is not UTF-8 text".to_owned()));
    };
    let Some(header) = header else {
        let message = "the first row must name the columns, such as `t,ux`";
        return Err(at(1, message.to_owned()));
    };
    let [time, value] =
        columns(table, &header.names).map_err(|message| at(header.line, message))?;
    let (mut times, mut values, mut lines) = (Vec::new(), Vec::new(), Vec::new());
    for (line, row) in (1..).zip(text.lines()) {
        if line == header.line || is_comment(row) || row.trim().is_empty() {
            continue;
        }
        let entries = entries(row).map_err(|message| at(line, message))?;
        if entries.len() != header.names.len() {
            let message = format!(
                "has {} entries, must have {}: {}",
                entries.len(),
                header.names.len(),
                excerpt(&header.names.join(" "))
            );
            return Err(at(line, message));
        }
        let number = |column: usize| {
            let value = entries[column].parse::<f64>().ok();
            value.filter(|value| value.is_finite()).ok_or_else(|| {
                let (name, entry) = (excerpt(&header.names[column]), excerpt(entries[column]));
                at(line, format!("{name} must be a number, is {entry}"))
            })
        };
        if times.len() == MAX_ROWS {
            let message = format!("has more than {MAX_ROWS} rows, the maximum");
            return Err(at(line, message));
        }
        times.push(number(time)?);
        values.push(number(value)?);
        lines.push(line);
    }
    Table::new(times, values)
        .map_err(|(row, message)| at(lines.get(row).copied().unwrap_or(header.line), message))
}

/// Return the index of the time column and the index of the value column in `names`.
fn columns(table: &grammar::Table, names: &[String]) -> std::result::Result<[usize; 2], String> {
    let find = |wanted: &str| {
        let missing = || {
            let known = names.iter().map(String::as_str);
            format!("has no column `{wanted}`{}", suggestion(wanted, known))
        };
        let found = names.iter().position(|name| name == wanted);
        found.ok_or_else(missing)
    };
    let time = match &table.time {
        Some(name) => find(name.get_ref())?,
        None => {
            let is_time = |name: &String| TIME.iter().any(|time| name.eq_ignore_ascii_case(time));
            names.iter().position(is_time).unwrap_or(0)
        }
    };
    let value = match &table.column {
        Some(name) => find(name.get_ref())?,
        None if names.len() == 2 => 1 - time,
        None if names.len() < 2 => {
            return Err(format!(
                "needs a column of times and one of values, has only {}",
                excerpt(&names.join(" "))
            ));
        }
        None => {
            return Err(format!(
                "has {} columns, {}; name the column of the values with the key `column`",
                names.len(),
                excerpt(&names.join(" "))
            ));
        }
    };
    if time == value {
        return Err(format!(
            "column `{}` cannot be both time and value",
            names[time]
        ));
    }
    Ok([time, value])
}

/// Check that tables cover all times at which the run needs their values.
///
/// # Errors
/// If the rows of a table begin too late or end too early.
pub fn cover_the_run(scope: &Scope, problem: &Problem) -> Result<()> {
    let mut start = 0.0;
    for stage in problem.all_stages() {
        let span = [start, stage.time.end];
        let conditions = problem.conditions.iter().zip(&stage.acting);
        for (condition, _) in conditions.filter(|(_, acts)| **acts) {
            let key = format!("[condition.{}] {}", condition.name, condition.quantity);
            let expressions: Vec<&Expression> = match &condition.action {
                Action::Displacement(values) | Action::Velocity(values) => {
                    values.iter().flatten().collect()
                }
                Action::BodyForce(values, _) | Action::Force(values) => values.iter().collect(),
                Action::Temperature(value) => vec![value],
            };
            covers(scope, &key, &condition.place, expressions, span)?;
        }
        start = stage.time.end;
    }
    let whole = [0.0, start];
    for rigid in &problem.rigid {
        let key = format!("[rigid.{}]", rigid.name);
        let expressions: Vec<&Expression> = match &rigid.motion {
            RigidMotion::Driven(motion) => motion.iter().collect(),
            RigidMotion::Free { force, .. } => force.iter().collect(),
        };
        covers(scope, &key, &rigid.span, expressions, whole)?;
    }
    let refinement = problem.refinement.as_ref();
    if let Some(trigger) = refinement.and_then(|refinement| refinement.trigger.as_ref()) {
        let expressions = trigger.condition.iter().chain(&trigger.only);
        let key = "[refinement.trigger]";
        covers(scope, key, &trigger.span, expressions.collect(), whole)?;
    }
    Ok(())
}

/// Return an error if a table in these expressions does not cover the times from `start` to `end`, s.
fn covers(
    scope: &Scope,
    key: &str,
    place: &Range<usize>,
    expressions: Vec<&Expression>,
    [start, end]: [f64; 2],
) -> Result<()> {
    let tables = expressions.into_iter().flat_map(Expression::tables);
    // Ends of runs and stages are often products with round-off, such as `3*0.1`.
    let slack = ROUNDING * end;
    for table in tables {
        let [first, last] = table.range();
        let (does, at, needed, until) = if first > start + slack {
            ("begins", first, "from", start)
        } else if last < end - slack {
            ("ends", last, "until", end)
        } else {
            continue;
        };
        let message = format!(
            "{key}: the table `{}` {does} at t = {} s but is needed {needed} {} s; add rows",
            scope.table_name(table),
            format_number(at),
            format_number(until)
        );
        return Err(scope.error(place.clone(), message));
    }
    Ok(())
}
