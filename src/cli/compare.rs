//! `fissure compare`: the differences between two results.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use fissure::error::{Error, ErrorKind, Result};
use fissure::message::suggestion;
use fissure::output::ResultReader;
use fissure::output::compare::{Comparison, Difference, Place, compare};

use super::format::{count, si};
use super::progress::Progress;
use super::{Verbosity, outln, print, result_file, without_output};

/// Compare two results, for example of two versions or machines.
///
/// Matches outputs and history rows by time, and points by id. For each field and history column, prints the
/// largest difference with its point and time. Also prints the ratio of this difference to the largest
/// absolute value in A. The terms of a total momentum can cancel. The divisor of momentum is therefore at
/// least √(2 M E), with the mass M and the largest kinetic energy E of A. Does not compare attributes, which
/// describe the run.
#[derive(Args)]
#[command(after_help = "\
Examples:
  fissure compare out/today out/yesterday                  bit-identical?
  fissure compare out/new out/old --tolerance 1e-9         up to round-off?
  fissure compare out/new out/old --tolerance 1e-9 --tolerance damage=0.02
  fissure compare out/a out/b --tolerance rank=inf         do not compare the field `rank`
  fissure compare -q out/new out/old || echo different     in scripts
  fissure plot out/new --minus out/old --field damage      a picture of the difference

Exit codes: 0 equal within the tolerance, 1 different, 2 the arguments are wrong or a file cannot be read.")]
pub struct CompareArguments {
    /// First result: a .vtkhdf file or its folder.
    #[arg(value_name = "A")]
    first: PathBuf,

    /// Second result.
    #[arg(value_name = "B")]
    second: PathBuf,

    /// Allowed difference, as a fraction of the largest absolute value of the field or column in A.
    /// NAME=VALUE applies to the field or column NAME. May be repeated. With a tolerance of 0, values must be
    /// bit-identical [default: 0].
    #[arg(long, value_name = "[NAME=]VALUE", value_parser = tolerance)]
    tolerance: Vec<(Option<String>, f64)>,
}

/// Parse `VALUE` or `NAME=VALUE`.
fn tolerance(text: &str) -> std::result::Result<(Option<String>, f64), String> {
    let (name, value) = match text.rsplit_once('=') {
        Some((name, value)) => (Some(name.trim().to_owned()), value),
        None => (None, text),
    };
    match value.trim().parse::<f64>() {
        Ok(value) if value >= 0.0 => Ok((name, value)),
        _ => Err("must be VALUE or NAME=VALUE with a number of at least 0, or inf".to_owned()),
    }
}

/// Allowed differences of fields and columns, each as a fraction of the largest absolute value of the field
/// or column in the first result.
struct Tolerances<'a> {
    general: f64,
    named: Vec<(&'a str, f64)>,
}

impl<'a> Tolerances<'a> {
    fn new(given: &'a [(Option<String>, f64)]) -> Self {
        let general = given.iter().rfind(|(name, _)| name.is_none());
        let named = given.iter().rev().filter_map(|(name, value)| {
            let name = name.as_deref()?;
            Some((name, *value))
        });
        Self {
            general: general.map_or(0.0, |(_, value)| *value),
            named: named.collect(),
        }
    }

    fn of(&self, name: &str) -> f64 {
        let found = self.named.iter().find(|(known, _)| *known == name);
        found.map_or(self.general, |(_, value)| *value)
    }

    /// Check that every named tolerance refers to a field or a column that both results have.
    fn check(&self, comparison: &Comparison) -> Result<()> {
        let both = || comparison.fields.iter().chain(&comparison.columns);
        for (name, _) in &self.named {
            if !both().any(|difference| difference.name == *name) {
                let known = both().map(|difference| difference.name.as_str());
                return Err(Error::input(format!(
                    "--tolerance {name}: the results have no common field or column `{name}`{}",
                    suggestion(name, known)
                )));
            }
        }
        Ok(())
    }
}

/// Compare two results.
///
/// # Errors
/// If the results differ, the error is of kind `Run`. All other errors are of kind `Input`, for example if a
/// file cannot be read or a tolerance has an unknown name.
pub fn run(arguments: &CompareArguments, verbosity: Verbosity) -> Result<()> {
    let as_input = |error: Error| Error {
        kind: ErrorKind::Input,
        ..error
    };
    let differences = differences(arguments, verbosity).map_err(as_input)?;
    if differences.is_empty() {
        return Ok(());
    }
    let message = format!("the results differ in {}", differences.join(" and "));
    Err(Error::run(message))
}

/// Compare two results and print the comparison. Return the kinds of differences for the error message; the
/// list is empty if the results agree.
fn differences(arguments: &CompareArguments, verbosity: Verbosity) -> Result<Vec<String>> {
    let paths = [&arguments.first, &arguments.second].map(|path| result_file(path));
    let [first, second] = [
        ResultReader::open(&paths[0])?,
        ResultReader::open(&paths[1])?,
    ];
    for (reader, path) in [&first, &second].into_iter().zip(&paths) {
        if reader.times()?.is_empty() {
            return Err(without_output(path));
        }
    }
    let tolerances = Tolerances::new(&arguments.tolerance);
    let all = first.times()?.len() as u64;
    let mut progress = Progress::new(verbosity > Verbosity::Quiet, "output", 0, all);
    let comparison = compare(&first, &second, &mut |done, all, time| {
        progress.update(done as u64, all as u64, time);
    })?;
    progress.finish(true);
    tolerances.check(&comparison)?;
    if verbosity > Verbosity::Quiet {
        let names = paths.map(|path| path.display().to_string());
        print(&report(&comparison, &tolerances, &names, verbosity))?;
    }
    let different = |all: &[Difference]| {
        let outside =
            |difference: &&Difference| !difference.is_within(tolerances.of(&difference.name));
        all.iter().filter(outside).count()
    };
    let (fields, columns) = (
        different(&comparison.fields),
        different(&comparison.columns),
    );
    let mut reasons = Vec::new();
    if fields > 0 {
        let all = comparison.fields.len();
        reasons.push(format!("{fields} of {all} fields"));
    }
    if columns > 0 {
        let all = comparison.columns.len();
        reasons.push(format!("{columns} of {all} columns of the history"));
    }
    if !comparison.is_complete() {
        reasons.push("outputs, points, fields, rows or columns that one of them lacks".to_owned());
    }
    if reasons.is_empty() && verbosity > Verbosity::Quiet {
        let all = comparison.fields.iter().chain(&comparison.columns);
        let unequal = all.into_iter().any(|difference| difference.unequal > 0);
        let within = if unequal { " within the tolerance" } else { "" };
        outln!("the results are equal{within}");
    }
    Ok(reasons)
}

/// Format the comparison:
/// - the paths of the results,
/// - the numbers of compared outputs, points and rows,
/// - the fields, columns and outputs that only one result has,
/// - the numbers of points and rows that only one result has,
/// - a table of the fields and a table of the columns.
fn report(
    comparison: &Comparison,
    tolerances: &Tolerances,
    names: &[String; 2],
    verbosity: Verbosity,
) -> String {
    let mut text = format!("A {}\nB {}\n", names[0], names[1]);
    let (outputs, rows) = (comparison.outputs, comparison.rows);
    let number = outputs.max(1) as u64;
    let points = if comparison.has_equal_counts {
        format!("of {} points", count(comparison.points / number))
    } else {
        format!("with {} points in all", count(comparison.points))
    };
    let _ = writeln!(
        text,
        "{outputs} outputs {points}, {rows} rows of the history"
    );
    for (side, name) in ["A", "B"].into_iter().enumerate() {
        only(&mut text, name, "fields", &comparison.single_fields[side]);
        only(&mut text, name, "columns", &comparison.single_columns[side]);
        let times: Vec<String> = comparison.single_outputs[side]
            .iter()
            .map(|time| si(*time, "s"))
            .collect();
        only(&mut text, name, "outputs at", &times);
        for (number, what) in [
            (comparison.single_points[side], "points, over all outputs"),
            (comparison.single_rows[side] as u64, "rows of the history"),
        ] {
            if number > 0 {
                let _ = writeln!(text, "only in {name}: {} {what}", count(number));
            }
        }
    }
    table(&mut text, "field", &comparison.fields, tolerances, true);
    let all = verbosity == Verbosity::Verbose;
    table(&mut text, "column", &comparison.columns, tolerances, all);
    text
}

/// Largest number of names in a printed list. A longer list ends with the number of further names.
const LONGEST_LIST: usize = 8;

/// Append a line with the entries of `list`. Only the result `name` (A or B) has these entries. `what` is the
/// kind of the entries, such as `fields`. Append nothing if the list is empty.
fn only(text: &mut String, name: &str, what: &str, list: &[String]) {
    if !list.is_empty() {
        let shown = list[..list.len().min(LONGEST_LIST)].join(", ");
        let rest = match list.len().saturating_sub(LONGEST_LIST) {
            0 => String::new(),
            rest => format!(" and {rest} more"),
        };
        let _ = writeln!(text, "only in {name}: {what} {shown}{rest}");
    }
}

/// Append a table of differences. With `lists_equal`, the table includes equal quantities. Without it, the
/// table omits equal quantities, and a line below the table states their number.
fn table(
    text: &mut String,
    heading: &str,
    differences: &[Difference],
    tolerances: &Tolerances,
    lists_equal: bool,
) {
    let is_listed = |difference: &&Difference| lists_equal || difference.unequal > 0;
    let listed: Vec<&Difference> = differences.iter().filter(is_listed).collect();
    let width = listed.iter().map(|difference| difference.name.len()).max();
    let width = width.unwrap_or(0).max(heading.len());
    if !listed.is_empty() {
        let _ = writeln!(
            text,
            "\n{heading:<width$}  {:<18}{:<10}  where",
            "difference", "relative"
        );
    }
    for difference in &listed {
        let name = &difference.name;
        let Some(place) = difference.place else {
            let _ = writeln!(text, "{name:<width$}  equal");
            continue;
        };
        let relative = difference.largest / difference.scale;
        let mark = if difference.is_within(tolerances.of(name)) {
            "within the tolerance"
        } else {
            "DIFFERENT"
        };
        let size = format!("{:.3e} {}", difference.largest, difference.unit);
        let _ = writeln!(
            text,
            "{name:<width$}  {:<18}{:<10}  {}; {mark}",
            size.trim_end(),
            if relative.is_finite() {
                format!("{relative:.1e}")
            } else {
                "-".to_owned()
            },
            location(difference, &place),
        );
    }
    let equal = differences.len() - listed.len();
    if equal > 0 {
        let _ = writeln!(text, "{equal} {heading}s are equal");
    }
}

/// Format the component, point and time of a difference.
fn location(difference: &Difference, place: &Place) -> String {
    let component = match difference.components.get(place.component) {
        Some(name) => format!("{name}, "),
        None => String::new(),
    };
    let point = place.point.map_or(String::new(), |point| {
        let position = point.position.map(|coordinate| si(coordinate, "m"));
        format!("point {} at ({}), ", point.id, position.join(", "))
    });
    format!("{component}{point}t = {}", si(place.time, "s"))
}
