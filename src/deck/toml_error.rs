//! Translation of errors of the TOML parser and of serde into errors about the deck, with the key, the
//! expected value and the given value.

use std::ops::Range;

use serde::de::DeserializeOwned;
use toml::de::{DeTable, DeValue};

use super::from_toml::{Mismatch, NEITHER_NAME_NOR_TABLE, NOT_ONE_KEY, from_name};
use super::grammar::{Crack, Damage, DimensionName, Form, OUTPUT_KEYS, Section, Shape};
use super::source::Source;
use crate::error::Error;
use crate::material::declarations;
use crate::message::suggestion;
use crate::problem::law;

/// Return the error for a text that is not valid TOML.
pub fn syntax_error(source: &Source, error: &toml::de::Error) -> Error {
    let span = error.span().unwrap_or(0..0);
    let message = match double_brackets(source, &span) {
        Some(message) => message.to_owned(),
        None => syntax_message(source, span.clone(), error.message().trim()),
    };
    source.error(span, message)
}

/// Return the message if `span` begins with a header in double brackets that needs single brackets.
fn double_brackets(source: &Source, span: &Range<usize>) -> Option<&'static str> {
    let marked = &source.text[span.start..];
    let is_wrong = marked.starts_with("[[") && !marked.starts_with("[[stage]]");
    is_wrong.then_some("a section has single brackets, as in `[body.plate]`")
}

/// Return the message for a text that is not valid TOML.
fn syntax_message(source: &Source, span: Range<usize>, message: &str) -> String {
    let marked = source.text.get(span.clone()).unwrap_or_default();
    let rest = source.text.get(span.end..).unwrap_or_default();
    if message == "duplicate key" {
        format!("`{marked}` is given twice")
    } else if message.starts_with("string values must be quoted") {
        match marked.trim() {
            "" => "a value is missing".to_owned(),
            word => format!("`{word}` is not a value; names and expressions need quotes"),
        }
    } else if message.starts_with("unexpected key or value, expected newline") {
        let decimal = marked == "," || rest.starts_with(',');
        let advice = if decimal {
            "; decimals are written with a point"
        } else {
            ""
        };
        format!("only a comment may follow a value on its line{advice}")
    } else if let Some((found, expected)) = message.split_once(", expected ") {
        let items = expected.split(", ").map(|item| match item {
            "value" => "a value",
            item => item,
        });
        let items: Vec<&str> = items.collect();
        format!("{found}; expected {}", items.join(" or "))
    } else {
        message.to_owned()
    }
}

/// Return the error for a text that is valid TOML, with the table `tree`, but not a valid deck.
pub fn grammar_error(source: &Source, tree: &DeTable, mismatch: &Mismatch) -> Error {
    let Mismatch { message, span } = mismatch;
    if let Some(message) = double_brackets(source, span) {
        return source.error(span.clone(), message);
    }
    let place = find(tree, span, &mut Vec::new()).unwrap_or_default();
    let mut quoted = message.split('`').skip(1).step_by(2);
    let first = quoted.next().unwrap_or_default();
    let error = |path: &[String], words: String| {
        let key = label(path);
        let colon = if key.is_empty() { "" } else { ": " };
        source.error(span.clone(), format!("{key}{colon}{words}"))
    };
    // An unknown key of [output] is parsed as the name of a further result.
    if let ([section, key], Some(value)) = (&place.path[..], place.value)
        && section == "output"
        && !OUTPUT_KEYS.contains(&key.as_str())
        && value.as_table().is_none()
    {
        let words = format!(
            "unknown key `{key}`{}",
            suggestion(key, OUTPUT_KEYS.into_iter())
        );
        let message = format!("[output]: {words}; a table with this name is a further output");
        return source.error(span.clone(), message);
    }
    if message.starts_with("missing field") {
        return match (&place.path[..], first) {
            ([], "dimension") => {
                let known = kinds::<DimensionName>().join(", ");
                source.error(
                    0..0,
                    format!("the deck needs a `dimension` (one of {known})"),
                )
            }
            ([], section) => {
                let end = source.text.len();
                source.error(end..end, format!("the deck needs a section [{section}]"))
            }
            (path, _) => error(path, format!("needs `{first}`")),
        };
    }
    if message.starts_with("unknown field") {
        let words = format!("unknown key `{first}`{}", suggestion(first, quoted));
        return error(place.parent(), words);
    }
    if message.starts_with("unknown variant") {
        let words = format!("unknown name `{first}`{}", suggestion(first, quoted));
        let is_value = place.value.is_some_and(DeValue::is_str);
        return error(
            if is_value {
                &place.path
            } else {
                place.parent()
            },
            words,
        );
    }
    if let (Some(value), NEITHER_NAME_NOR_TABLE) = (place.value, message.as_str()) {
        let written = source.text.get(span.clone()).unwrap_or_default();
        let words = format!("must be a name in quotes, is {}", given(value, written));
        return error(&place.path, words);
    }
    if message == NOT_ONE_KEY {
        let section = place.path.first().map_or("", String::as_str);
        let kinds = match section {
            "material" => declarations().map(|law| law.name.to_owned()).collect(),
            "damage" => kinds::<Damage>(),
            "crack" => kinds::<Crack>(),
            _ => kinds::<Shape>(),
        };
        let words = format!(
            "must have exactly one key, {} (one of {}), has {}",
            match section {
                "material" => "the name of the law",
                "damage" => "the name of the criterion",
                "crack" => "the kind of the crack",
                _ => "the kind of the shape",
            },
            kinds.join(", "),
            keys(place.value),
        );
        return error(&place.path, words);
    }
    let wrong_value = message.starts_with("invalid type") || message.starts_with("invalid value");
    match (message.split_once(", expected "), place.value) {
        (Some((_, expected)), Some(value)) if wrong_value => {
            let written = source.text.get(span.clone()).unwrap_or_default();
            let wanted = wanted_of_law(&place.path).unwrap_or_else(|| wanted(expected).to_owned());
            let words = format!("must be {wanted}, is {}", given(value, written));
            error(&place.path, words)
        }
        _ => error(&place.path, message.to_owned()),
    }
}

/// A key or value of the deck.
#[derive(Default)]
struct Place<'t> {
    path: Vec<String>,
    value: Option<&'t DeValue<'t>>,
}

impl Place<'_> {
    /// Return the path of the table that contains the key.
    fn parent(&self) -> &[String] {
        self.path.split_last().map_or(&[], |(_, parent)| parent)
    }
}

/// Find the key or value with this span in a table; `path` is the path of the table.
fn find<'t>(
    table: &'t DeTable<'t>,
    span: &Range<usize>,
    path: &mut Vec<String>,
) -> Option<Place<'t>> {
    for (key, value) in table {
        path.push(key.get_ref().to_string());
        let found = if key.span() == *span {
            Some(Place {
                path: path.clone(),
                value: Some(value.get_ref()),
            })
        } else {
            find_value(value.get_ref(), value.span(), span, path)
        };
        if found.is_some() {
            return found;
        }
        path.pop();
    }
    None
}

fn find_value<'t>(
    value: &'t DeValue<'t>,
    own: Range<usize>,
    span: &Range<usize>,
    path: &mut Vec<String>,
) -> Option<Place<'t>> {
    if own == *span {
        return Some(Place {
            path: path.clone(),
            value: Some(value),
        });
    }
    match value {
        DeValue::Table(table) => find(table, span, path),
        DeValue::Array(entries) => entries
            .iter()
            .find_map(|entry| find_value(entry.get_ref(), entry.span(), span, path)),
        _ => None,
    }
}

/// Format a path with section header and keys: `[body.plate] shape box`.
fn label(path: &[String]) -> String {
    let section = Section::containing(path);
    let count = section.map_or(0, |section| section.header_length(path));
    let (header, keys) = path.split_at(count.min(path.len()));
    let header = match header {
        [] => Vec::new(),
        _ if section.is_some_and(|section| section.form == Form::Array) => {
            vec![format!("[[{}]]", header.join("."))]
        }
        _ => vec![format!("[{}]", header.join("."))],
    };
    [header, keys.to_vec()].concat().join(" ")
}

/// Return the names of all variants of a grammar enum. The names are read from the message of a
/// deserialization error.
fn kinds<T: DeserializeOwned>() -> Vec<String> {
    let message = from_name::<T>("")
        .err()
        .map_or(String::new(), |error| error.message);
    let quoted = message.split('`').skip(3).step_by(2);
    quoted.map(str::to_owned).collect()
}

/// List the keys of a table for an error message.
fn keys(value: Option<&DeValue>) -> String {
    let keys: Vec<String> = value
        .and_then(DeValue::as_table)
        .into_iter()
        .flat_map(|table| table.keys().map(|key| format!("`{}`", key.get_ref())))
        .collect();
    if keys.is_empty() {
        "none".to_owned()
    } else {
        keys.join(", ")
    }
}

/// Translate serde's description of the expected value into deck terms.
fn wanted(expected: &str) -> &str {
    match expected {
        "a sequence" => "a list in brackets",
        "a string" => "text in quotes",
        "u32" => "a whole number, 0 to 4294967295",
        "u64" => "a whole number, 0 or more",
        "a nonzero u64" => "a whole number, 1 or more",
        "a map" | "newtype variant" | "struct variant" => "a table",
        _ if expected.starts_with("struct ") => "a table",
        _ => expected,
    }
}

/// Describe the allowed values of a law's key; `None` if the path does not lead to such a key.
fn wanted_of_law(path: &[String]) -> Option<String> {
    let [section, _, name, key] = path else {
        return None;
    };
    let law = declarations().find(|law| section == "material" && law.name == name);
    law?.key(key).map(law::wanted)
}

/// Describe a wrong value for an error message. `written` is the text of the value in the deck.
fn given(value: &DeValue, written: &str) -> String {
    match value {
        DeValue::Table(_) => "a table".to_owned(),
        DeValue::Array(_) => "a list".to_owned(),
        DeValue::Datetime(_) => "a date".to_owned(),
        DeValue::String(_) => format!("the text {written}"),
        DeValue::Integer(_) | DeValue::Float(_) | DeValue::Boolean(_) => written.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::from_toml::from_text;
    use super::super::grammar::{Deck, SECTIONS};
    use super::*;
    use crate::deck;

    /// A deck with every section of the grammar.
    const DECK: &str = "title = 'all'
dimension = 'plane-stress'
thickness = 1
[parameters]
height = 2
[grid]
spacing = 1
horizon = 3
[interface]
rule = 'own'
[interface.pair.NAME]
bodies = ['plate', 'block']
rule = 'own'
[refinement]
levels = 1
[refinement.region.NAME]
where = 'x < 1'
[refinement.trigger]
energy = 0.5
[material.NAME.pmb]
density = 1
[damage.NAME.energy]
alpha = 0.25
[body.NAME]
material = 'glass'
[set.NAME]
where = 'x < 1'
[crack.NAME.segment]
from = [0, 0]
to = [1, 0]
[initial.NAME]
velocity = [1, 0]
[condition.NAME]
force = [1, 0]
set = 'all'
[time]
end = 1
[time.adaptive]
reduce = 0.5
[time.relaxation]
tolerance = 1e-3
[time.static]
tolerance = 1e-3
[[stage]]
safety = 0.5
[output]
every = 1
[output.NAME]
every = 1
[history]
every = 1
[history.force.NAME]
direction = [1, 0]
set = 'all'
[history.field.NAME]
field = 'damage'
of = ['mean']
[history.probe.NAME]
at = [0, 0]
[history.front.NAME]
threshold = 1
from = [0, 0]
direction = [1, 0]
field = 'damage'
[history.crack.NAME]
from = [0, 0]
[history.tip.NAME]
from = [0, 0]
direction = [1, 0]
[history.j_integral.NAME]
lower = [0, 0]
upper = [1, 1]
[checkpoint]
every_time = 1
[balance]
imbalance = 1.5
[contact]
friction = 0.1
[contact.pair.NAME]
bodies = ['a', 'b']
[rigid.NAME]
mass = 1
[table.NAME]
times = [0, 1]
values = [0, 1]
";

    /// Return the first line of the error of a deck.
    fn error_of(text: String) -> String {
        let source = Source::new("a.toml", text);
        let error = deck::parse(&source).err();
        let error = error.unwrap_or_else(|| panic!("no error: {}", source.text));
        error.message.lines().next().unwrap_or_default().to_owned()
    }

    /// Return [`DECK`] with one line replaced; line numbers start from 0.
    fn with_line(number: usize, other: &str) -> String {
        let lines = DECK.lines().enumerate();
        let lines = lines.map(|(k, line)| if k == number { other } else { line });
        lines.collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn errors_name_the_section_in_brackets() {
        let mut sections: Vec<&str> = SECTIONS
            .iter()
            .filter(|section| section.form != Form::Key)
            .map(|section| section.path)
            .collect();
        let lines: Vec<&str> = DECK.lines().collect();
        for (number, line) in lines.iter().enumerate() {
            let header = line.trim_matches(['[', ']']);
            let path = header.split(".NAME").next().unwrap_or_default();
            sections.retain(|section| *section != path);
            if !line.starts_with('[') {
                continue;
            }
            // Try a value of the wrong type, then an unknown key.
            let key = lines[number + 1].split(' ').next().unwrap_or_default();
            let error = error_of(with_line(number + 1, &format!("{key} = 1979-05-27")));
            assert!(
                error.contains(&format!(": {line} {key}: must be ")),
                "{error}"
            );
            let more = format!("wrong_key = 1979-05-27\n{}", lines[number + 1]);
            let error = error_of(with_line(number + 1, &more));
            let expected = match *line {
                "[parameters]" => ": [parameters] wrong_key: must be ".to_owned(),
                // Keys of a law are checked against its declaration, after the names of tables.
                "[material.NAME.pmb]" => ": [".to_owned(),
                _ => format!(": {line}: unknown key `wrong_key`"),
            };
            assert!(error.contains(&expected), "{line}: {error}");
        }
        assert_eq!(sections, [""; 0]);
    }

    #[test]
    fn names_of_all_sections_are_checked() {
        for (number, line) in DECK.lines().enumerate() {
            if !line.contains("NAME") {
                continue;
            }
            let header = line.replace("NAME", "'a\"b'");
            let section = &line[..line.find(".NAME").unwrap()];
            let error = error_of(with_line(number, &header));
            let expected = format!(": {section}]: the name `a\"b` must have 1 to ");
            assert!(error.contains(&expected), "{line}: {error}");
        }
    }

    /// The messages about wrong decks depend on these words of the TOML parser and of serde.
    #[test]
    fn the_reader_says_what_is_looked_for() {
        let grid = "dimension = 'plane-stress'\ngrid = { spacing = 1, horizon = 3 }\n";
        let mut others = Vec::new();
        for (wrong, said) in [
            (
                "dimension = 'plane-stress'\ndimension = 'plane-stress'",
                "duplicate key",
            ),
            ("dimension = plane", "string values must be quoted"),
            ("dimension =", "string values must be quoted"),
            (
                "dimension = 'plane-stress' 3",
                "unexpected key or value, expected newline",
            ),
            ("", "missing field `dimension`"),
            (
                "dimension = 'plane-stress'\ngrit = 1",
                "unknown field `grit`, expected ",
            ),
            ("dimension = '4d'", "unknown variant `4d`, expected "),
            (
                "[body.plate.shape]\nbox = { lower = [0], upper = [1] }\ndisc = {}",
                NOT_ONE_KEY,
            ),
            (
                "[crack.notch.segment]\nfrom = [0]\nto = [1]\nvia = [2]",
                "unknown field `via`, expected one of `from`, `to`, `width`",
            ),
            ("time = { end = 1, step = [] }", "invalid type: "),
            ("output = { every_steps = 0 }", "invalid value: "),
        ] {
            let deck = if wrong.contains("dimension") || wrong.is_empty() {
                wrong.to_owned()
            } else {
                format!("{grid}{wrong}")
            };
            let message = match DeTable::parse(&deck) {
                Err(error) => error.message().trim().to_owned(),
                Ok(_) => from_text::<Deck>(&deck)
                    .err()
                    .map_or(String::new(), |error| error.message),
            };
            if !message.starts_with(said) {
                others.push(format!("{wrong}: {message}"));
            }
        }
        assert!(others.is_empty(), "{}", others.join("\n"));
    }
}
