//! Comparison of the physics of two decks. A restart must not change the physics.

use toml::{Table, Value};

use super::Deck;
use super::grammar::{Restart, Section};
use super::number::Written;
use super::resolve::Scope;
use super::source::Source;
use crate::deck::spanned::Spanned;
use crate::error::{Error, Result};
use crate::expression::{Expression, POSITION_AND_TIME, Variable};
use crate::message::format_number;

/// Keys that a restart may change although their section is fixed.
const FREE_KEYS: [&str; 1] = ["time.end"];

/// Keys of `[history]` that set the interval of rows.
const INTERVAL_KEYS: [&str; 2] = ["every", "every_steps"];

/// Return the differences in the physics of two decks. The result has one line per key that differs, with the
/// old and the new value. It also has one line per section whose tables are in another order in the new deck.
/// A key that only one deck has is compared with the default of the key.
///
/// # Errors
/// If a deck does not follow the grammar, or its parameters or tables are invalid.
pub fn differences(old: &Source, new: &Source) -> Result<Vec<String>> {
    compared(old, new, |comparison, old, new| {
        comparison.compare("", Some(old), Some(new))
    })
}

/// Return the differences in the definitions of the history columns, in the same form as [`differences`]. The
/// interval of rows is ignored.
///
/// # Errors
/// If a deck does not follow the grammar, or its parameters or tables are invalid.
pub fn history_differences(old: &Source, new: &Source) -> Result<Vec<String>> {
    compared(old, new, |comparison, old, new| {
        let keys = |deck: &Value| {
            let table = deck.get("history").and_then(Value::as_table);
            table.cloned().unwrap_or_default()
        };
        let (old, new) = (keys(old), keys(new));
        let added = new.keys().filter(|key| !old.contains_key(*key));
        for key in old.keys().chain(added) {
            if !INTERVAL_KEYS.contains(&key.as_str()) {
                comparison.compare(&format!("history.{key}"), old.get(key), new.get(key));
            }
        }
    })
}

fn compared(
    old: &Source,
    new: &Source,
    compare: impl FnOnce(&mut Comparison<'_>, &Value, &Value),
) -> Result<Vec<String>> {
    let decks = (Deck::new(old.clone())?, Deck::new(new.clone())?);
    let old_scope = Scope::of(old, &decks.0.grammar)?;
    let new_scope = Scope::of(new, &decks.1.grammar)?;
    let table = |text: &str| {
        let parsed = text.parse::<Table>();
        parsed
            .map(Value::Table)
            .map_err(|error| Error::input(error.to_string()))
    };
    let mut comparison = Comparison {
        scopes: [&old_scope, &new_scope],
        lines: Vec::new(),
    };
    let (mut old, mut new) = (table(&old.text)?, table(&new.text)?);
    // A deck from a checkpoint of an earlier version lacks keys that were added later. These keys get their
    // defaults. If defaults cannot be filled in, for example because a file is missing, the deck is compared
    // without defaults.
    if let Ok(explained) = decks.0.explain() {
        complete(&mut old, &table(&explained)?, &new);
    }
    if let Ok(explained) = decks.1.explain() {
        complete(&mut new, &table(&explained)?, &old);
    }
    compare(&mut comparison, &old, &new);
    Ok(comparison.lines)
}

/// Add to `deck` the missing keys that `other` has. The values come from `explained`, which is `deck` with
/// all defaults.
fn complete(deck: &mut Value, explained: &Value, other: &Value) {
    let is_empty = |value: &Value| value.as_table().is_some_and(Table::is_empty);
    match (deck, explained, other) {
        (Value::Table(deck), Value::Table(explained), Value::Table(other)) => {
            for (key, other) in other {
                match (deck.get_mut(key), explained.get(key)) {
                    (Some(own), Some(explained)) => complete(own, explained, other),
                    // A missing table and an empty table are equivalent, so an empty table is only added if
                    // the table of the other deck is empty too.
                    (None, Some(explained)) if !is_empty(explained) || is_empty(other) => {
                        deck.insert(key.clone(), explained.clone());
                    }
                    _ => {}
                }
            }
        }
        (Value::Array(deck), Value::Array(explained), Value::Array(other)) => {
            for ((deck, explained), other) in deck.iter_mut().zip(explained).zip(other) {
                complete(deck, explained, other);
            }
        }
        _ => {}
    }
}

struct Comparison<'a> {
    scopes: [&'a Scope<'a>; 2],
    lines: Vec<String>,
}

impl Comparison<'_> {
    fn compare(&mut self, key: &str, old: Option<&Value>, new: Option<&Value>) {
        let restart = Section::find(key).map(|section| section.restart);
        if restart == Some(Restart::Free) || FREE_KEYS.contains(&key) {
            return;
        }
        match (old, new) {
            // Tables that may be added or removed are compared only if both decks have them.
            (None, _) | (_, None) if counts_where_used(key) => {}
            (Some(Value::Table(old)), Some(Value::Table(new))) => {
                let order = |table: &Table| table.keys().cloned().collect::<Vec<_>>();
                let mut sorted = [order(old), order(new)];
                let reordered = sorted[0] != sorted[1];
                sorted.iter_mut().for_each(|keys| keys.sort());
                if restart == Some(Restart::FixedOrder) && reordered && sorted[0] == sorted[1] {
                    self.lines.push(format!("{key}: stands in another order"));
                }
                let added = new.keys().filter(|name| !old.contains_key(*name));
                for name in old.keys().chain(added) {
                    let inner = if key.is_empty() {
                        name.clone()
                    } else {
                        format!("{key}.{name}")
                    };
                    self.compare(&inner, old.get(name), new.get(name));
                }
            }
            (Some(Value::Array(old)), Some(Value::Array(new))) if old.len() == new.len() => {
                for (k, (old, new)) in old.iter().zip(new).enumerate() {
                    self.compare(&format!("{key}[{k}]"), Some(old), Some(new));
                }
            }
            (old, new) => {
                let values = [self.expression(0, old), self.expression(1, new)];
                let same = match &values {
                    // A restart may append rows to a table, because a run with a later end may need them.
                    [Some(old), Some(new)] => new.extends(old),
                    _ => old == new,
                };
                if !same {
                    let old_text = formatted(old, values[0].as_ref());
                    let new_text = formatted(new, values[1].as_ref());
                    self.lines.push(match old.and_then(Value::as_str) {
                        Some(text) if old_text == new_text => {
                            format!("{key}: in {old_text}, {}", self.changes_of_names(text))
                        }
                        _ => format!("{key}: was {old_text}, is {new_text}"),
                    });
                }
            }
        }
    }

    /// Return a value as an expression, with the parameters of its deck inserted. The variables of the
    /// expression are position and time, or the length of a bond. `None` if the value is not an expression.
    /// `deck` is 0 for the old deck and 1 for the new deck.
    fn expression(&self, deck: usize, value: Option<&Value>) -> Option<Expression> {
        let written = match value? {
            Value::Integer(value) => Written::Value(*value as f64),
            Value::Float(value) => Written::Value(*value),
            Value::String(text) => Written::Text(text.clone()),
            _ => return None,
        };
        let number = Spanned::new(0..0, written);
        let parsed = |variables| self.scopes[deck].expression(&number, "", variables).ok();
        parsed(&POSITION_AND_TIME).or_else(|| parsed(&[Variable::R]))
    }

    /// Describe the changes of the parameters and tables that an expression uses. `text` is the expression,
    /// which is the same in both decks.
    fn changes_of_names(&self, text: &str) -> String {
        let [old, new] = self.scopes;
        let change = |name: String| {
            let parameters = [old, new].map(|scope| scope.parameters.get(&name));
            let tables = [old, new].map(|scope| scope.tables.get(&name));
            match (parameters, tables) {
                ([Some(old), Some(new)], _) => (old != new).then(|| {
                    let [old, new] = [old, new].map(|value| format_number(*value));
                    format!("the parameter `{name}` was {old}, is {new}")
                }),
                (_, [Some(old), Some(new)]) => {
                    (!new.extends(old)).then(|| format!("rows of the table `{name}` have changed"))
                }
                ([None, None], [None, None]) => None,
                _ => Some(format!(
                    "`{name}` is a parameter in one deck and a table in the other"
                )),
            }
        };
        let names = Expression::names(text).unwrap_or_default();
        let changes: Vec<String> = names.into_iter().filter_map(change).collect();
        changes.join(", ")
    }
}

/// Return whether a restart may add or remove tables in the section that contains this key, see
/// [`Restart::WhereUsed`].
fn counts_where_used(key: &str) -> bool {
    let section = key.split('.').next().and_then(Section::find);
    section.is_some_and(|section| section.restart == Restart::WhereUsed)
}

/// Format a value for messages: the text in the deck, followed by the number if the text is a constant
/// expression.
fn formatted(value: Option<&Value>, expression: Option<&Expression>) -> String {
    let Some(value) = value else {
        return "not there".to_owned();
    };
    match (value, expression.and_then(Expression::as_constant)) {
        (Value::String(text), Some(number)) => format!("`{text}` = {number}"),
        _ => format!("{value}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(text: &str) -> Source {
        Source::new("deck.toml", text)
    }

    const DECK: &str = "
        dimension = '1d'
        parameters = { dx = 0.5, load = 3, late = 8 }
        grid = { spacing = 'dx', horizon = '3*dx' }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        body.bar = { material = 'rubber', shape.box = { lower = [0], upper = [9] } }
        condition.pull = { set = 'bar', body_force = ['load*x*t'] }
        time = { end = 'late' }
        ";

    fn against(replace: &str, by: &str) -> Vec<String> {
        assert!(DECK.contains(replace));
        differences(&source(DECK), &source(&DECK.replace(replace, by))).unwrap()
    }

    #[test]
    fn what_a_restart_may_change() {
        assert!(against("late = 8", "late = 9, unused = 1").is_empty());
        assert!(against("'late'", "12").is_empty());
        assert!(against("'3*dx'", "1.5").is_empty());
        assert!(
            against(
                "time",
                "set.left.where = 'x < 1'\n history.reactions = ['left']\n time"
            )
            .is_empty()
        );
        assert!(
            against(
                "dimension",
                "title = 'x'\n output.every_steps = 3\n dimension"
            )
            .is_empty()
        );
    }

    #[test]
    fn what_the_columns_of_a_history_mean() {
        let deck = |history: &str| source(&format!("{DECK}\n history = {{ {history} }}"));
        let old = deck("every = 1, damage_threshold = 0.3, probe.end.at = ['2*dx']");
        let against = |history: &str| history_differences(&old, &deck(history)).unwrap();
        let same = "every_steps = 2, damage_threshold = 0.3, probe.end.at = [1.0]";
        assert!(against(same).is_empty());
        let lines = against("every = 1, damage_threshold = 0.3, probe.end.at = [2]");
        assert_eq!(lines, ["history.probe.end.at[0]: was `2*dx` = 1, is 2"]);
        let lines = against("every = 1, damage_threshold = 0.4, probe.end.at = ['2*dx']");
        assert_eq!(lines, ["history.damage_threshold: was 0.3, is 0.4"]);
    }

    #[test]
    fn keys_that_a_checkpoint_lacks_have_their_defaults() {
        let old = source(&format!("{DECK}\n history.probe.end.at = [1.0]"));
        let new = Deck::new(old.clone()).unwrap().explain().unwrap();
        assert!(new.contains("angular_momentum = false"), "{new}");
        let differences = |new: &str| {
            let new = source(new);
            let history = history_differences(&old, &new).unwrap();
            [differences(&old, &new).unwrap(), history].concat()
        };
        assert_eq!(differences(&new), [""; 0]);
        for (default, other, line) in [
            (
                "volume_correction = \"exact\"",
                "volume_correction = \"none\"",
                "grid.volume_correction: was \"exact\", is \"none\"",
            ),
            (
                "fragments = false",
                "fragments = true",
                "history.fragments: was false, is true",
            ),
        ] {
            assert!(new.contains(default), "{new}");
            assert_eq!(differences(&new.replace(default, other)), [line]);
        }
    }

    #[test]
    fn changes_of_the_physics_are_differences() {
        let lines = against("load = 3", "load = 4");
        assert_eq!(
            lines,
            ["condition.pull.body_force[0]: in \"load*x*t\", the parameter `load` was 3, is 4"]
        );
        let with_table = |values: &str| {
            let table = format!("table.load = {{ times = [0, 9], values = {values} }}\n body.bar");
            source(&DECK.replace("load = 3, ", "").replace("body.bar", &table))
        };
        let lines = differences(&with_table("[1, 2]"), &with_table("[1, 3]")).unwrap();
        assert_eq!(
            lines,
            [
                "condition.pull.body_force[0]: in \"load*x*t\", rows of the table `load` have changed"
            ]
        );
        let lines = differences(&with_table("[1, 2]"), &source(DECK)).unwrap();
        assert_eq!(
            lines,
            [
                "condition.pull.body_force[0]: in \"load*x*t\", `load` is a parameter in one deck and a table in the other"
            ]
        );
        let of_length = |width: &str| {
            let deck = DECK.replace("late = 8", &format!("late = 8, width = {width}"));
            let law = "linear_microelastic = { lambda = 'exp(-r/width)', density = 2";
            source(&deck.replace("pmb = { density = 2", law))
        };
        let lines = differences(&of_length("0.5"), &of_length("0.7")).unwrap();
        assert_eq!(
            lines,
            [
                "material.rubber.linear_microelastic.lambda: in \"exp(-r/width)\", the parameter `width` was 0.5, is 0.7"
            ]
        );
        let lines = against("dx = 0.5", "dx = 0.25");
        assert_eq!(lines.len(), 2);
        assert_eq!(lines[0], "grid.spacing: was `dx` = 0.5, is `dx` = 0.25");
        let swapped = DECK.replace(
            "condition.pull",
            "condition.push = { set = 'all', force = [1] }\n condition.pull",
        );
        let other = DECK.replace(
            "time =",
            "condition.push = { set = 'all', force = [1] }\n time =",
        );
        let lines = differences(&source(&swapped), &source(&other)).unwrap();
        assert_eq!(lines, ["condition: stands in another order"]);
        let lines = against("density = 2", "density = 3");
        assert_eq!(lines, ["material.rubber.pmb.density: was 2, is 3"]);
        let glued = |rule: &str| {
            let pair =
                format!("interface.pair.glue = {{ bodies = ['bar', 'rod'], rule = '{rule}' }}");
            source(&DECK.replace("time =", &format!("{pair}\n time =")))
        };
        let lines = differences(&glued("own"), &glued("minimum")).unwrap();
        assert_eq!(
            lines,
            ["interface.pair.glue.rule: was \"own\", is \"minimum\""]
        );
        let lines = against("time", "initial.push.velocity = ['x']\n time");
        assert!(lines[0].starts_with("initial: was not there"), "{lines:?}");
    }
}
