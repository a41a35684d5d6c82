//! Names of items. They appear in column names, file names and messages.

use std::collections::HashSet;

use super::wrong;
use crate::error::{Result, excerpt};
use crate::problem::Problem;

/// Largest number of characters of a name.
const LONGEST: usize = 64;

/// Text that marks old result files: a restart renames these files, and their new names contain this text.
/// Names of further results must not contain this text, so that no new result replaces a renamed file.
const SET_ASIDE: &str = "until_step_";

/// Check the title and the names of all items. Two items of the same kind must not have the same name.
///
/// # Errors
/// On a title of several lines, and on the first name that is not allowed or is given twice.
pub fn names(problem: &Problem) -> Result<()> {
    if problem.title.contains(char::is_control) {
        let fault = "must be one line of text, without control characters";
        return Err(wrong("title", fault));
    }
    let refinement = problem.refinement.iter();
    let regions = refinement.flat_map(|refinement| &refinement.regions);
    let contacts = problem.contact.iter().flat_map(|contact| &contact.pairs);
    let history = &problem.history;
    each("body", problem.bodies.iter().map(|body| &body.name))?;
    each("set", problem.sets.iter().map(|set| &set.name))?;
    each("crack", problem.cracks.iter().map(|crack| &crack.name))?;
    each("rigid", problem.rigid.iter().map(|rigid| &rigid.name))?;
    let pairs = problem.interface.pairs.iter();
    each("interface.pair", pairs.map(|pair| &pair.name))?;
    each("contact.pair", contacts.map(|pair| &pair.name))?;
    each("refinement.region", regions.map(|region| &region.name))?;
    let initials = problem.initials.iter();
    each("initial", initials.map(|initial| &initial.name))?;
    let conditions = problem.conditions.iter();
    each("condition", conditions.map(|condition| &condition.name))?;
    let outputs = problem.further_outputs.iter();
    each("output", outputs.filter_map(|output| output.name.as_ref()))?;
    columns(
        "force",
        history.support_forces.iter().map(|force| &force.name),
    )?;
    columns("field", history.statistics.iter().map(|field| &field.name))?;
    columns("probe", history.probes.iter().map(|probe| &probe.name))?;
    columns("front", history.fronts.iter().map(|front| &front.name))?;
    columns("crack", history.cracks.iter().map(|crack| &crack.name))?;
    columns("tip", history.tips.iter().map(|tip| &tip.name))?;
    let integrals = history.j_integrals.iter();
    columns("j_integral", integrals.map(|integral| &integral.name))
}

/// Check the names of the items of a history table; they become parts of column names.
fn columns<'a>(table: &str, names: impl Iterator<Item = &'a String> + Clone) -> Result<()> {
    let section = format!("history.{table}");
    each(&section, names.clone())?;
    for name in names {
        if let Some(fault) = column_fault(name) {
            return Err(wrong(&format!("[{section}.{name}]"), fault));
        }
    }
    Ok(())
}

/// Check the names of the items of a section.
fn each<'a>(section: &str, names: impl Iterator<Item = &'a String>) -> Result<()> {
    let mut known = HashSet::new();
    for name in names {
        if let Some(fault) = name_fault(name) {
            return Err(wrong(&format!("[{section}]"), fault));
        }
        if !known.insert(name) {
            let fault = "this name is given twice; each item needs its own name";
            return Err(wrong(&format!("[{section}.{name}]"), fault));
        }
    }
    Ok(())
}

/// Return the reason why an item cannot have this name; `None` if it can.
pub(crate) fn name_fault(name: &str) -> Option<String> {
    let wrong = |c: char| c.is_control() || matches!(c, '"' | '\'' | '\\');
    let is_wrong = name.is_empty() || name.contains(wrong) || name.chars().nth(LONGEST).is_some();
    is_wrong.then(|| {
        format!(
            "the name {} must have 1 to {LONGEST} characters, and must not contain quotes, backslashes or control \
             characters",
            excerpt(name)
        )
    })
}

/// Return the reason why a name cannot be part of a column name; `None` if it can. The characters `/`, `.`
/// and `,` separate columns, or the parts of a column name.
pub(crate) fn column_fault(name: &str) -> Option<&'static str> {
    let fault = "the name becomes part of column names, so it must not contain `/`, `.` or `,`";
    name.contains(['/', '.', ',']).then_some(fault)
}

/// Return the reason why the name of a further result cannot be part of a file name; `None` if it can.
/// `others` are the names of other further results.
pub(crate) fn file_fault<'a>(
    name: &str,
    mut others: impl Iterator<Item = &'a String>,
) -> Option<String> {
    let is_allowed = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    let words = if !name.chars().all(is_allowed) {
        "so it must have only the letters a to z and A to Z, digits, `_` and `-`".to_owned()
    } else if name.contains(SET_ASIDE) {
        format!("so it must not contain `{SET_ASIDE}`, which marks files of older results")
    } else {
        let other = others.find(|other| other.eq_ignore_ascii_case(name))?;
        format!(
            "and differs from `{other}` only in upper and lower case, which some file systems ignore"
        )
    };
    Some(format!("the name becomes part of a file name, {words}"))
}
