//! Assignments from the command line to keys of a deck, such as `time.safety=0.4`.

use toml_edit::{DocumentMut, Item, Table, TableLike, Value};

use super::source::Source;
use crate::error::{Error, Result, excerpt};

/// Keys outside of all sections.
const TOP_KEYS: [&str; 5] = [
    "title",
    "dimension",
    "thickness",
    "cross_section",
    "constraint",
];

/// Return whether `name` is a key of the deck: a path with dots, or a key outside of all sections. A name
/// without dots that is also the name of a parameter counts as the parameter, so the function returns false.
pub fn is_key(source: &Source, name: &str) -> bool {
    let is_parameter = || {
        let deck = source.text.parse::<DocumentMut>().ok()?;
        deck.get("parameters")?.get(name).map(|_| ())
    };
    name.contains('.') || (TOP_KEYS.contains(&name) && is_parameter().is_none())
}

/// Assign values to keys of a deck, and return the new text of the deck. `assignments` has pairs of a key and
/// the text of its value. Missing keys are added.
///
/// If the text of a value is a TOML value, the value keeps its type. Any other text, such as a bare word or
/// an expression, becomes a string. If the deck is not valid TOML, its text is returned unchanged.
///
/// # Errors
/// If a key is the name of a section, or has an empty part between dots. If a part of a key, except the
/// last part, names a list or a value instead of a section.
pub fn assign(source: &Source, assignments: &[(&str, &str)]) -> Result<String> {
    let mut document: DocumentMut = match source.text.parse() {
        Ok(document) => document,
        // The deck reader reports the error.
        Err(_) => return Ok(source.text.clone()),
    };
    for (key, text) in assignments {
        let wrong = |message: String| Error::input(format!("--set {key}={text}: {message}"));
        let parts: Vec<&str> = key.split('.').map(str::trim).collect();
        if parts.iter().any(|part| part.is_empty()) {
            let message = format!(
                "{} is not a key; write a key with its section, such as time.safety",
                excerpt(key)
            );
            return Err(wrong(message));
        }
        let value: Value = text.parse().unwrap_or_else(|_| Value::from(*text));
        let [sections @ .., name] = &parts[..] else {
            continue;
        };
        let mut table: &mut dyn TableLike = document.as_table_mut();
        for (depth, section) in sections.iter().enumerate() {
            let item = table.entry(section).or_insert_with(|| {
                let mut table = Table::new();
                table.set_implicit(true);
                Item::Table(table)
            });
            let path = parts[..=depth].join(".");
            let kind = item.type_name();
            table = item.as_table_like_mut().ok_or_else(|| {
                let advice = if kind.starts_with("array") {
                    "a list; change its entries in the deck"
                } else {
                    "a value, not a section"
                };
                wrong(format!("`{path}` is {advice}"))
            })?;
        }
        match table.get_mut(name) {
            // Keep the comment beside the value.
            Some(Item::Value(old)) => {
                let decor = old.decor().clone();
                *old = value;
                *old.decor_mut() = decor;
            }
            Some(_) => {
                let message = format!("`{key}` is a section; set one of its keys: {key}.KEY=VALUE");
                return Err(wrong(message));
            }
            None => {
                table.insert(name, Item::Value(value));
            }
        }
    }
    Ok(document.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assigned(text: &str, key: &str, value: &str) -> Result<String> {
        let source = Source::new("deck.toml", text);
        assign(&source, &[(key, value)])
    }

    #[test]
    fn values_are_replaced_or_added_where_they_belong() -> Result<()> {
        let deck = "a = 1\nb = { c = 2, d = 3 } # b\n[e]\nf = 4   # f\n[e.g]\nh.i = 5\n";
        for (key, value, old, new) in [
            ("a", "2.5", "a = 1", "a = 2.5"),
            ("b.d", "[1, 2]", "d = 3", "d = [1, 2]"),
            ("e.f", "1e-3", "f = 4   # f", "f = 1e-3   # f"),
            ("e.f", "2*dx", "f = 4", "f = \"2*dx\""),
            ("e.f", "'true'", "f = 4", "f = 'true'"),
            ("e.g.h.i", "word", "h.i = 5", "h.i = \"word\""),
            ("b.e", "true", "d = 3 }", "d = 3 , e = true}"),
            ("e.k", "1", "f = 4   # f\n", "f = 4   # f\nk = 1\n"),
            ("e.g.h.k", "1", "h.i = 5\n", "h.i = 5\nh.k = 1\n"),
        ] {
            let text = assigned(deck, key, value)?;
            let wanted = deck.replace(old, new);
            let parsed = |text: &str| text.parse::<toml::Table>().unwrap();
            assert_eq!(parsed(&text), parsed(&wanted), "{key}: {text}");
            if key != "b.e" {
                assert_eq!(text, wanted, "{key}");
            }
        }
        let text = assigned(deck, "new.part.k", "7")?;
        let table: toml::Table = text.parse().unwrap();
        assert_eq!(table["new"]["part"]["k"].as_integer(), Some(7), "{text}");
        assert_eq!(text.lines().nth(3), Some("f = 4   # f"));
        Ok(())
    }

    #[test]
    fn names_of_parameters_are_not_keys() {
        let is_key = |text: &str, name: &str| super::is_key(&Source::new("deck.toml", text), name);
        for name in ["thickness", "cross_section", "constraint", "time.end"] {
            assert!(is_key("dimension = '1d'", name), "{name}");
        }
        assert!(!is_key("", "pull"));
        assert!(!is_key("[parameters]\nthickness = 1", "thickness"));
        assert!(is_key("parameters = { pull = 1 }", "thickness"));
    }

    #[test]
    fn assignments_to_sections_lists_and_invalid_keys_are_rejected() {
        let deck = "a = 1\n[[stage]]\nend = 1\n[e]\nf = 4\n";
        for (key, message) in [
            ("a.b", "--set a.b=1: `a` is a value, not a section"),
            ("stage.end", "`stage` is a list; change its entries"),
            ("e", "`e` is a section; set one of its keys: e.KEY=VALUE"),
            ("e..f", "is not a key"),
        ] {
            let error = assigned(deck, key, "1").unwrap_err();
            assert!(error.message.contains(message), "{}", error.message);
        }
        // The deck reader reports text that is not TOML.
        assert_eq!(assigned("a = = 1", "e.f", "1").unwrap(), "a = = 1");
    }
}
