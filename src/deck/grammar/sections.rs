//! The sections of a deck: the form of their headers, whether other sections refer to them, and the changes
//! that a restart permits.

use std::ops::Range;

use super::OUTPUT_KEYS;
use super::{Deck, Tables};

/// A section of the deck, or a key outside of all sections.
#[derive(Debug, PartialEq)]
pub struct Section {
    /// Path of the section, such as `grid` or `history.probe`.
    pub path: &'static str,
    /// Form of the header.
    pub form: Form,
    /// Whether a table of the section has an effect only where another section refers to it by name.
    pub referred_to: bool,
    /// Changes that a restart permits.
    pub restart: Restart,
}

/// How the header of a section is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Form {
    /// No header: a key at the top of the deck.
    Key,
    /// `[grid]`
    Table,
    /// `[[stage]]`
    Array,
    /// `[output]` and `[output.NAME]`
    TableAndNamed,
    /// `[body.NAME]`
    Named,
    /// `[material.NAME.KIND]`
    NamedKind,
}

/// Changes of a section that a restart permits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Restart {
    /// No changes.
    Fixed,
    /// No changes. The order of the tables must not change either, because later bodies, initial values and
    /// conditions take precedence over earlier ones.
    FixedOrder,
    /// Tables may be added or removed. A table that is in the old deck and in the new deck must not change.
    WhereUsed,
    /// Any changes.
    Free,
}

use Form::{Array, Key, Named, NamedKind, Table, TableAndNamed};
use Restart::{Fixed, FixedOrder, Free, WhereUsed};

/// All sections.
pub const SECTIONS: [Section; 39] = [
    Section::new("title", Key, Free),
    Section::new("dimension", Key, Fixed),
    Section::new("thickness", Key, Fixed),
    Section::new("cross_section", Key, Fixed),
    Section::new("constraint", Key, Fixed),
    // Parameters may change freely: a restart compares the values that use them.
    Section::new("parameters", Table, Free),
    // `[table.NAME]` may change freely, too: a restart compares the values that use the table.
    Section::new("table", Named, Free).referred_to(),
    Section::new("grid", Table, Fixed),
    Section::new("interface", Table, Fixed),
    Section::new("interface.pair", Named, Fixed),
    Section::new("contact", Table, Fixed),
    Section::new("contact.pair", Named, Fixed),
    Section::new("rigid", Named, FixedOrder),
    Section::new("refinement", Table, Fixed),
    Section::new("refinement.region", Named, Fixed),
    Section::new("refinement.trigger", Table, Fixed),
    Section::new("material", NamedKind, Fixed).referred_to(),
    Section::new("damage", NamedKind, Fixed).referred_to(),
    Section::new("body", Named, FixedOrder),
    Section::new("set", Named, WhereUsed).referred_to(),
    Section::new("crack", NamedKind, Fixed),
    Section::new("initial", Named, FixedOrder),
    Section::new("condition", Named, FixedOrder),
    Section::new("time", Table, Fixed),
    Section::new("time.adaptive", Table, Fixed),
    Section::new("time.relaxation", Table, Fixed),
    Section::new("time.static", Table, Fixed),
    Section::new("stage", Array, Fixed),
    Section::new("output", TableAndNamed, Free),
    // `history_differences` compares the definitions of the columns. The interval of the rows may change
    // freely.
    Section::new("history", Table, Free),
    Section::new("history.force", Named, Fixed),
    Section::new("history.field", Named, Fixed),
    Section::new("history.probe", Named, Fixed),
    Section::new("history.front", Named, Fixed),
    Section::new("history.crack", Named, Fixed),
    Section::new("history.tip", Named, Fixed),
    Section::new("history.j_integral", Named, Fixed),
    Section::new("checkpoint", Table, Free),
    Section::new("balance", Table, Free),
];

impl Section {
    const fn new(path: &'static str, form: Form, restart: Restart) -> Self {
        Self {
            path,
            form,
            referred_to: false,
            restart,
        }
    }

    const fn referred_to(self) -> Self {
        Self {
            referred_to: true,
            ..self
        }
    }

    /// Find the section with this path.
    pub fn find(path: &str) -> Option<&'static Self> {
        SECTIONS.iter().find(|section| section.path == path)
    }

    /// Find the innermost section that contains the key or table with this path.
    pub fn containing(path: &[String]) -> Option<&'static Self> {
        (1..=path.len().min(2))
            .rev()
            .find_map(|depth| Self::find(&path[..depth].join(".")))
    }

    /// Return how many leading parts of `path` belong to the header of the section.
    pub fn header_length(&self, path: &[String]) -> usize {
        let parts = self.path.split('.').count();
        let is_key = |name: &String| OUTPUT_KEYS.contains(&name.as_str());
        match self.form {
            Key => 0,
            TableAndNamed if path.get(parts).is_none_or(is_key) => parts,
            TableAndNamed => parts + 1,
            Table | Array => parts,
            Named => parts + 1,
            NamedKind => parts + 2,
        }
    }
}

/// A named table of the deck.
pub struct NamedTable<'a> {
    /// Path of the section that contains the table, such as `material` or `history.probe`.
    pub section: &'static str,
    /// Name of the table.
    pub name: &'a str,
    /// Byte range of the table in the deck.
    pub span: Range<usize>,
}

impl Deck {
    /// Return the named tables, section by section.
    pub fn named_tables(&self) -> Vec<NamedTable<'_>> {
        fn add<'a, T>(
            found: &mut Vec<NamedTable<'a>>,
            section: &'static str,
            tables: &'a Tables<T>,
        ) {
            found.extend(tables.iter().map(|(name, table)| NamedTable {
                section,
                name,
                span: table.span(),
            }));
        }
        let mut found = Vec::new();
        add(&mut found, "table", &self.table);
        add(&mut found, "material", &self.material);
        add(&mut found, "damage", &self.damage);
        add(&mut found, "body", &self.body);
        add(&mut found, "set", &self.set);
        add(&mut found, "crack", &self.crack);
        add(&mut found, "initial", &self.initial);
        add(&mut found, "condition", &self.condition);
        add(&mut found, "interface.pair", &self.interface.pair);
        if let Some(contact) = &self.contact {
            add(&mut found, "contact.pair", &contact.get_ref().pair);
        }
        add(&mut found, "output", &self.output.get_ref().further);
        add(&mut found, "rigid", &self.rigid);
        if let Some(refinement) = &self.refinement {
            let region = &refinement.get_ref().region;
            add(&mut found, "refinement.region", region);
        }
        let history = self.history.get_ref();
        add(&mut found, "history.force", &history.force);
        add(&mut found, "history.field", &history.field);
        add(&mut found, "history.probe", &history.probe);
        add(&mut found, "history.front", &history.front);
        add(&mut found, "history.crack", &history.crack);
        add(&mut found, "history.tip", &history.tip);
        add(&mut found, "history.j_integral", &history.j_integral);
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::from_toml::from_text;

    /// Deserialize a deck with an unknown key, and return the allowed keys that the error message lists.
    fn fields(deck: &str) -> Vec<String> {
        let error = from_text::<Deck>(deck).unwrap_err();
        let fields = error.message.split('`').skip(3).step_by(2);
        fields.map(str::to_owned).collect()
    }

    #[test]
    fn every_key_outside_of_sections_and_every_section_is_listed() {
        let mut listed: Vec<&str> = SECTIONS.iter().map(|section| section.path).collect();
        listed.retain(|path| !path.contains('.'));
        assert_eq!(fields("unknown = 1"), listed);
    }

    #[test]
    fn every_section_within_another_is_listed() {
        let example = crate::deck::Source::new("example.toml", crate::deck::EXAMPLE);
        let explained = crate::deck::explain(&example).unwrap();
        let explained: toml::Table = explained.parse().unwrap();
        let mut count = 0;
        for (outer, table) in &explained {
            if Section::find(outer).unwrap().form != Table {
                continue;
            }
            let inner = table.as_table().unwrap().iter();
            for (key, _) in inner.filter(|(_, value)| value.is_table()) {
                let path = format!("{outer}.{key}");
                assert!(Section::find(&path).is_some(), "{path} is not listed");
                count += 1;
            }
        }
        assert!(count >= 5, "{count}");
    }

    #[test]
    fn the_reference_describes_every_section() {
        let page = include_str!("../../../docs/src/reference/deck.md");
        for Section { path, form, .. } in &SECTIONS {
            let row = match form {
                Key => format!("`{path}`"),
                Table => format!("\n| `[{path}]` |"),
                TableAndNamed => format!("\n| `[{path}]`, `[{path}.NAME]` |"),
                Array => format!("\n| `[[{path}]]` |"),
                Named => format!("\n| `[{path}.NAME]` |"),
                NamedKind => format!("\n| `[{path}.NAME."),
            };
            assert!(
                page.contains(&row),
                "not in docs/src/reference/deck.md: {row}"
            );
        }
    }
}
