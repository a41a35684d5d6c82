//! Merging of overlay decks into a deck.

use toml::de::DeTable;
use toml_edit::{DocumentMut, Item, TableLike};

use super::source::Source;
use super::toml_error::syntax_error;
use crate::error::Result;

/// Return the text of a deck merged with overlays; later overlays override earlier overlays. Tables are
/// merged key by key. Any other value, including the list of stages, is replaced as a whole. Some tables
/// have a single key that selects an alternative, for example the law of a material. If the overlay has
/// another key in such a table, this key replaces the key of the deck.
///
/// # Errors
/// If the deck or an overlay is not TOML. Without overlays, this function does not parse the deck.
pub fn merge(deck: &Source, overlays: &[Source]) -> Result<String> {
    if overlays.is_empty() {
        return Ok(deck.text.clone());
    }
    let mut merged = document(deck)?;
    for overlay in overlays {
        merge_tables(
            merged.as_table_mut(),
            document(overlay)?.as_table(),
            &mut Vec::new(),
            false,
        );
    }
    Ok(merged.to_string())
}

/// Parse a deck or an overlay into a document that keeps comments and white space.
fn document(source: &Source) -> Result<DocumentMut> {
    // Syntax errors of this parser have the same text as for decks without overlays.
    if let Err(error) = DeTable::parse(&source.text) {
        return Err(syntax_error(source, &error));
    }
    let parsed = source.text.parse::<DocumentMut>();
    parsed.map_err(|error| source.error(error.span().unwrap_or(0..0), error.message()))
}

/// Merge the table `upper` into the table `lower`. Both tables are at `path` in their decks. Keys of `upper`
/// override keys of `lower`. `is_inline` is true if `lower` is an inline table.
fn merge_tables<'k>(
    lower: &mut dyn TableLike,
    upper: &'k dyn TableLike,
    path: &mut Vec<&'k str>,
    is_inline: bool,
) {
    let is_other = upper.iter().all(|(kind, _)| !lower.contains_key(kind));
    if is_choice(path) && !upper.is_empty() && is_other {
        lower.clear();
    }
    for (key, item) in upper.iter() {
        let old = lower.get_mut(key);
        let is_inner_inline = old.as_ref().is_some_and(|old| old.is_inline_table());
        match (old.and_then(Item::as_table_like_mut), item.as_table_like()) {
            (Some(lower), Some(upper)) => {
                path.push(key);
                merge_tables(lower, upper, path, is_inner_inline);
                path.pop();
            }
            _ => {
                let mut item = item.clone();
                forget_positions(&mut item);
                if let (Item::Value(value), true) = (&mut item, is_inline) {
                    // In an inline table, a comment after the value would hide the rest of the line.
                    value.decor_mut().clear();
                }
                lower.insert(key, item);
            }
        }
    }
}

/// Return whether `path` is the path of a table with a single key that names a choice: the law of a material,
/// the kind of a damage law or crack, or a shape.
fn is_choice(path: &[&str]) -> bool {
    matches!(
        path,
        ["material" | "damage" | "crack", _] | ["body" | "set" | "rigid", _, "shape"]
    )
}

/// Reset the positions of the tables in `item`. In the merged deck, these tables then come after the deck's
/// tables of the same section. The order of bodies and conditions matters.
fn forget_positions(item: &mut Item) {
    match item {
        Item::Table(table) => {
            table.set_position(None);
            for (_, inner) in table.iter_mut() {
                forget_positions(inner);
            }
        }
        Item::ArrayOfTables(array) => {
            for table in array.iter_mut() {
                table.set_position(None);
                for (_, inner) in table.iter_mut() {
                    forget_positions(inner);
                }
            }
        }
        Item::Value(_) | Item::None => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use toml::{Table, Value as Plain};

    fn merged(deck: &str, overlay: &str) -> Table {
        let source = |name: &str, text: &str| Source::new(name, text);
        let text = merge(&source("deck.toml", deck), &[source("over.toml", overlay)]);
        let text = text.unwrap_or_else(|error| panic!("{error}"));
        text.parse()
            .unwrap_or_else(|error| panic!("{error}\n{text}"))
    }

    /// Merge two tables key by key. If `lower` and `upper` make different choices, the result contains both
    /// choices, unlike the result of [`merge`]. A test compares the results of the two functions.
    fn over(lower: &mut Table, upper: &Table) {
        for (key, value) in upper {
            match (lower.get_mut(key), value) {
                (Some(Plain::Table(lower)), Plain::Table(upper)) => over(lower, upper),
                _ => {
                    lower.insert(key.clone(), value.clone());
                }
            }
        }
    }

    #[test]
    fn tables_are_merged_however_they_are_written() {
        let decks = [
            "a = 1 # one\n[s]\nb = 2\nc = [1,\n 2]\n[s.t]\nd = 3\n[[stage]]\ne = 1\n[[stage]]\ne = 2\n",
            "a = 1\ns = { b = 2, c = [1, 2], t = { d = 3 } }\nstage = [{ e = 1 }, { e = 2 }]\n",
            "a = 1\ns.b = 2\ns.c = [1, 2]\ns.t.d = 3\n",
            "[s.t]\nd = 3\n[s]\nb = 2\n[u]\nv = 1\n",
            "",
        ];
        let overlays = [
            "a = 2 # two\n[s]\nc = [3] # three\n[s.t]\nnew = 'x'\n[u.w]\nz = 1 # one\n[u.y]\nz = 2\n",
            "s.t = { d = 4, e = { f = 5 } }\ns.g = 1\n",
            "[s.h]\n# A comment.\ni = [\n 1, # one\n 2,\n]\n[[stage]]\ne = 3 # three\n",
            "s = { t.k = 1 }\nu = { v = 2 }\n[x.y.z]\n",
            "s = 1\n",
            "",
        ];
        for deck in decks {
            for overlay in overlays {
                let mut expected: Table = deck.parse().unwrap();
                over(&mut expected, &overlay.parse().unwrap());
                assert_eq!(merged(deck, overlay), expected, "{deck}\nover\n{overlay}");
            }
        }
    }

    #[test]
    fn new_tables_follow_those_that_are_there() {
        let deck =
            "[body.a]\nk = 1\n[condition.hold]\nk = 1\n[time]\nend = 1\n[condition.pull]\nk = 1\n";
        let overlay = "[condition.push]\nk = 1\n[body.b]\nk = 1\n[condition.hold]\nk = 2\n";
        let merged = merged(deck, overlay);
        let names = |section: &str| {
            let table = merged[section].as_table().unwrap();
            table.keys().cloned().collect::<Vec<_>>().join(" ")
        };
        assert_eq!(names("condition"), "hold pull push");
        assert_eq!(names("body"), "a b");
        assert_eq!(merged["condition"]["hold"]["k"].as_integer(), Some(2));
    }

    #[test]
    fn a_choice_replaces_another_one() {
        let deck = "[material.glass.pmb]\ndensity = 1\n[body.plate]\nmaterial = 'glass'\nshape.box = { lower = [0] }\n";
        let overlay =
            "body.plate.shape.disc = { radius = 1 }\nmaterial.glass.ordinary = { density = 2 }\n";
        let merged = merged(deck, overlay);
        let glass = merged["material"]["glass"].as_table().unwrap();
        assert_eq!(glass.keys().collect::<Vec<_>>(), ["ordinary"]);
        let plate = merged["body"]["plate"].as_table().unwrap();
        assert_eq!(plate.keys().collect::<Vec<_>>(), ["material", "shape"]);
        let shape = plate["shape"].as_table().unwrap();
        assert_eq!(shape.keys().collect::<Vec<_>>(), ["disc"]);
        // If both decks name the same choice, the keys of the choice are merged.
        let overlay = "material.glass.pmb.damping = 3";
        let merged = super::tests::merged(deck, overlay);
        let law = merged["material"]["glass"]["pmb"].as_table().unwrap();
        assert_eq!(law.keys().collect::<Vec<_>>(), ["density", "damping"]);
        // An empty table replaces no choice.
        let merged = super::tests::merged(deck, "[material.glass]");
        let glass = merged["material"]["glass"].as_table().unwrap();
        assert_eq!(glass.keys().collect::<Vec<_>>(), ["pmb"]);
    }
}
