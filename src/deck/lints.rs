//! Warnings about probable mistakes in a deck:
//!
//! - unused names;
//! - unread columns of files;
//! - sets whose `where` is a number, not a condition;
//! - stages that change the density scale, and with it the mass of moving points.

use std::ops::Range;

use indexmap::IndexSet;
use toml::Value;

use super::grammar::{Deck, NamedTable, Section};
use super::resolve::Scope;
use crate::error::{Error, Result, Warning};
use crate::expression::Expression;
use crate::message::format_number;
use crate::points::{BodyPoints, file};
use crate::problem::{PointSource, Problem, Selector, changes_density_scale};

/// Return a warning for each probable mistake. `scope` must be the scope that was used for the validation:
/// it has recorded the names that the deck uses.
///
/// # Errors
/// If the deck cannot be serialized for the search of unused parameters.
pub fn lints(scope: &Scope, deck: &Deck, problem: &Problem) -> Result<Vec<Warning>> {
    let mut warnings = unused_parameters(deck)?;
    warnings.extend(unused(scope, deck));
    for set in &problem.sets {
        if let Selector::Where(condition) = &set.selector
            && !condition.is_condition()
        {
            let message = format!(
                "[set.{}] where: is a number, not a condition, and selects all points where it is not 0; add a \
                 comparison",
                set.name
            );
            warnings.push(Warning::new(message).at(&set.span));
        }
    }
    let pairs = problem.stages.windows(2).zip(deck.stage.iter().skip(1));
    for (pair, table) in pairs.filter(|(pair, _)| changes_density_scale(pair)) {
        let [before, after] = [0, 1].map(|k| pair[k].time.density_scale);
        let message = format!(
            "[[stage]] density_scale: changes from {} to {} at t = {} s; moving points keep their momentum, so their \
             velocities and their kinetic energy are multiplied by {} (column `density_scale_energy` of the history)",
            format_number(before),
            format_number(after),
            format_number(pair[0].time.end),
            format_number(before / after),
        );
        warnings.push(Warning::new(message).at(&table.span()));
    }
    warnings.extend(ignored_columns(problem));
    warnings.extend(ignored_values(problem));
    Ok(warnings)
}

/// Return a warning for each point file with unread columns.
fn ignored_columns(problem: &Problem) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let bodies = BodyPoints::of(&problem.bodies);
    for (index, body) in problem.bodies.iter().enumerate() {
        let PointSource::File { path, span, .. } = &body.points else {
            continue;
        };
        if file::users(&bodies, path)[0].0 != index {
            continue;
        }
        // The error of an unreadable file is reported when its points are read.
        let layout = file::layout_of(&bodies, problem.dimension.count(), path);
        let Ok(Ok(layout)) = layout else {
            continue;
        };
        let key = format!("[body.{}] points file", body.name);
        warnings.extend(not_read(&key, &layout.columns.ignored(), span));
    }
    warnings
}

/// Return a warning for each file of initial values with unread columns.
fn ignored_values(problem: &Problem) -> impl Iterator<Item = Warning> {
    problem.initials.iter().filter_map(|initial| {
        let file = initial.file.as_ref()?;
        let ignored: Vec<_> = file.columns.ignored.iter().map(String::as_str).collect();
        not_read(
            &format!("[initial.{}] file", initial.name),
            &ignored,
            &file.span,
        )
    })
}

/// Return the warning about unread columns of a file; `None` without such columns.
fn not_read(key: &str, ignored: &[&str], span: &Range<usize>) -> Option<Warning> {
    let warning = || {
        let names = ignored.join(", ");
        Warning::new(format!("{key}: these columns are not read: {names}")).at(span)
    };
    (!ignored.is_empty()).then(warning)
}

/// Return a warning for each unused table. Tables that have an effect even if no other section refers to
/// them, such as bodies, are not checked.
fn unused(scope: &Scope, deck: &Deck) -> Vec<Warning> {
    let used = scope.used.borrow();
    let mut tables = deck.named_tables();
    tables.retain(|table| {
        let section = Section::find(table.section);
        section.is_some_and(|section| section.referred_to)
            && !used.contains(&(table.section, table.name.to_owned()))
    });
    let warning = |table: &NamedTable| {
        let (section, name) = (table.section, table.name);
        let message = format!("[{section}.{name}]: nothing in the deck uses it");
        Warning::new(message).at(&table.span)
    };
    tables.iter().map(warning).collect()
}

fn unused_parameters(deck: &Deck) -> Result<Vec<Warning>> {
    let mut used = IndexSet::new();
    let mut rest = deck.clone();
    // The title is not an expression.
    rest.title.get_mut().clear();
    let written = Value::try_from(&rest)
        .map_err(|error| Error::run(format!("cannot write the deck: {error}")))?;
    names_in(&written, &mut used);
    let unused = deck
        .parameters
        .keys()
        .filter(|name| !used.contains(name.get_ref()));
    let warning = |name: &super::grammar::Text| {
        let message = format!("[parameters] {}: no expression uses it", name.get_ref());
        Warning::new(message).at(&name.span())
    };
    Ok(unused.map(warning).collect())
}

/// Add the names in all strings of a value to `names`. Each string is parsed as an expression; strings that
/// are not expressions are skipped.
fn names_in(value: &Value, names: &mut IndexSet<String>) {
    match value {
        Value::String(text) => names.extend(Expression::names(text).unwrap_or_default()),
        Value::Array(entries) => entries.iter().for_each(|entry| names_in(entry, names)),
        Value::Table(table) => table.values().for_each(|entry| names_in(entry, names)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use crate::deck::{Deck, Source};

    fn lints(extra: &str) -> Vec<String> {
        let text = format!(
            "title = 'dx and height'
dimension = 'plane-stress'
parameters = {{ dx = 0.5, edge = '8*dx', height = 2 }}
grid = {{ spacing = 'dx', horizon = '3*dx' }}
material.glass.pmb = {{ density = 2, youngs_modulus = 5 }}
body.plate = {{ material = 'glass', shape.box = {{ lower = [0, 0], upper = ['edge', 'edge'] }} }}
{extra}
time.end = 1
"
        );
        let deck = Deck::new(Source::new("a.toml", text));
        let deck = deck.unwrap_or_else(|error| panic!("{error}"));
        let problem = deck.problem().unwrap_or_else(|error| panic!("{error}"));
        let warnings = problem.warnings.into_iter();
        let located = warnings.map(|warning| deck.locate_warning(warning).message);
        located.collect()
    }

    #[test]
    fn names_that_nothing_uses() {
        let height = "a.toml:3: [parameters] height: no expression uses it".to_owned();
        assert_eq!(lints(""), std::slice::from_ref(&height));
        let steel = "material.steel.pmb = { density = 2, youngs_modulus = 'height' }";
        let expected = ["a.toml:7: [material.steel]: nothing in the deck uses it"];
        assert_eq!(lints(steel), expected);
        let others = "damage.brittle.critical_stretch = { fracture_energy = 1 }
            set.left.where = 'x < 1'
            set.right.where = 'x > height'
            initial.push = { set = 'right', velocity = [1, 0] }";
        let expected = [
            "a.toml:7: [damage.brittle]: nothing in the deck uses it",
            "a.toml:8: [set.left]: nothing in the deck uses it",
        ];
        assert_eq!(lints(others), expected);
    }

    #[test]
    fn a_set_is_used_wherever_a_deck_may_name_one() {
        let set = "set.some.where = 'x < height'\n";
        let unused = "a.toml:7: [set.some]: nothing in the deck uses it";
        assert_eq!(lints(set), [unused]);
        for use_of_it in [
            "initial.push = { set = 'some', velocity = [1, 0] }",
            "condition.hold = { set = 'some', displacement = [0, 0] }",
            "output.set = 'some'",
            "output.edge.set = 'some'",
            "history.reactions = ['some']",
            "history.force.pull = { set = 'some', direction = [1, 0] }",
            "history.field.pull = { set = 'some', field = 'damage', of = ['mean'] }",
            "history.crack.main = { set = 'some', from = [0, 0] }",
            "history.tip.main = { set = 'some', from = [0, 0], direction = [1, 0] }",
            "damage.d.critical_stretch = { fracture_energy = 1, no_failure = ['some'] }
            body.other = { material = 'glass', damage = 'd', shape.disc = { centre = [9, 9], radius = 3 } }",
            "damage.d.energy = { fracture_energy = 1, no_failure = ['some'] }
            body.other = { material = 'glass', damage = 'd', shape.disc = { centre = [9, 9], radius = 3 } }",
        ] {
            let found = lints(&format!("{set}{use_of_it}"));
            assert_eq!(found, Vec::<String>::new(), "{use_of_it}");
        }
    }

    #[test]
    fn conditions_that_are_none() {
        let of = |condition: &str| {
            let text = format!(
                "set.some.where = '{condition}'
                history.reactions = ['some']"
            );
            let warnings = lints(&text);
            warnings
                .iter()
                .any(|line| line.contains("add a comparison"))
        };
        for condition in [
            "y < 1",
            "not (x > 1 or y > 1)",
            "(x > 1)*(y < 2)",
            "max(x > 1, y > 1)",
            "if(x > 1, y > 1, 0)",
            "step(x - 1)",
            "1",
            "0 || 0",
        ] {
            assert!(!of(condition), "{condition}");
        }
        for condition in [
            "y",
            "x - 1",
            "(x > 1) + (y > 1)",
            "if(x > 1, y, 0)",
            "-(x > 1)",
            "2",
        ] {
            assert!(of(condition), "{condition}");
        }
    }
}
