//! The log of an import: the outcome of each key of the source deck.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::fmt;

use super::tree::{Content, Node, is_key};
use crate::error::excerpt;

/// Outcome of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// The new deck expresses the key without a change of meaning.
    Taken,
    /// The new deck expresses the key with a similar meaning.
    Approximated,
    /// The new deck does not express the key.
    LeftOut,
}

impl fmt::Display for Fate {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(match self {
            Self::Taken => "taken",
            Self::Approximated => "approximated",
            Self::LeftOut => "left out",
        })
    }
}

/// A key of the source deck and its outcome.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Line, from 1.
    pub line: usize,
    /// Path of keys from the top of the deck, or the name of the command.
    pub key: String,
    /// Value of the key; empty for a table.
    pub value: String,
    /// Outcome of the key.
    pub fate: Fate,
    /// The corresponding key in the new deck, or the reason why the source key is approximated or left out.
    pub note: String,
    /// Whether the key is left out and describes an initial value, a load or a support.
    pub is_lost_load: bool,
}

impl fmt::Display for Entry {
    /// Format the entry on one line.
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            line,
            key,
            value,
            fate,
            note,
            is_lost_load: _,
        } = self;
        write!(formatter, "{line:>5}  {fate:<12}  {key}")?;
        if !value.is_empty() {
            write!(formatter, ": {value}")?;
        }
        write!(formatter, " -> {note}")
    }
}

/// Log note for a damage model that no block uses.
pub(super) const UNUSED_DAMAGE: &str = "no block uses this damage model";

/// Log note for columns of a point file that PeriLab reads in place of constants of the deck.
pub(super) const UNUSED_COLUMNS: &str =
    "the new deck has the constants of the source deck, not those in columns of the file";

/// Log note for a node set with numbers that no point has.
pub(super) const DROPPED_NUMBERS: &str =
    "PeriLab drops the numbers of this node set above the number of the last point";

/// Log note for a key that scales the coordinates in the neighbour search.
pub(super) const UNSCALED_FAMILIES: &str =
    "families are not scaled: a family has the points within the horizon";

/// Log note for a load of Peridigm or PeriLab on points with another load of the same kind.
pub(super) const ADDED_LOADS: &str =
    "only one of several loads acts on a point in the source code; in the new deck, they add up";

/// Log note for initial values of PeriLab at points with several values of the same component.
pub(super) const UNORDERED_INITIALS: &str = "PeriLab applies initial values in no fixed order; in points with several values, the last one counts";

/// Log note for a damage model of PeriLab that also breaks compressed bonds.
pub(super) const INTACT_COMPRESSED: &str =
    "compressed bonds break in PeriLab, but not in the new deck";

/// Log note for the first `run` of a script, if no fix integrates the motion of atoms in this run.
pub(super) const NO_INTEGRATION: &str =
    "no `fix nve` acts in the first run, so no atom moves in LAMMPS; points of the new deck move";

/// Log note for an influence function without a counterpart.
pub(super) const OTHER_INFLUENCE: &str =
    "influence is one of constant, linear, gaussian and inverse; constant is used";

/// Log note for a contact of PeriLab whose points may start within the contact radius.
pub(super) const SHORT_CONTACT: &str = "points of these blocks may start closer to each other than the radius, and \
     begin to touch later than in PeriLab: the contact distance is at most 0.9 of the distance at the start";

/// Log note for a material of PeriLab whose shear stress is twice that of Hooke's law.
pub(super) const DOUBLED_SHEAR: &str =
    "PeriLab 2.2.4 doubles the shear stress of this material, unlike the new deck";

/// Log note for a material of PeriLab whose shear stress is half that of Hooke's law.
pub(super) const HALVED_SHEAR: &str =
    "PeriLab 2.2.4 halves the shear stress of this material, unlike the new deck";

/// Log note for a material of PeriLab without plane stress or plane strain in a plane problem.
pub(super) const SPATIAL_CONSTANTS: &str = "without `Symmetry`, PeriLab uses constants of 3-D, so its bond forces differ from those of the new deck";

/// Log note for PeriLab's correction of bond forces near surfaces.
pub(super) const UNCORRECTED_SURFACE: &str = "bond forces are not multiplied by the factor of this correction, so the \
     stiffness differs from that in PeriLab";

/// Log note for PeriLab's damping of bonds near damaged points.
pub(super) const UNDAMPED_DAMAGE: &str =
    "the motion of damaged points is not damped, so cracks may grow faster or branch";

/// Log note for a script with periodic boundaries.
pub(super) const NO_PERIODICITY: &str =
    "there are no periodic boundaries; bodies end at the faces of the box";

/// Log note for a command of LAMMPS that chooses or repeats commands.
pub(super) const NO_CONTROL_FLOW: &str =
    "control flow is not followed, so commands that it chooses or repeats are left out";

/// Log note for a command of LAMMPS that changes atoms, materials or bonds and has no counterpart.
pub(super) const OTHER_MODEL: &str =
    "points, materials or bonds of the new deck differ from those of LAMMPS";

/// Log notes for keys whose results in the new deck differ from those of the source deck. A warning repeats
/// these notes with the lines of the keys.
const CONSEQUENCES: [&str; 9] = [
    SHORT_CONTACT,
    DOUBLED_SHEAR,
    HALVED_SHEAR,
    SPATIAL_CONSTANTS,
    UNCORRECTED_SURFACE,
    UNDAMPED_DAMAGE,
    NO_PERIODICITY,
    NO_CONTROL_FLOW,
    OTHER_MODEL,
];

/// Peridigm's key for omitting bonds between blocks.
pub(super) const OMITTED_BONDS: &str = "Omit Bonds Between Blocks";

/// Line numbers of the losses that change the results. A loss is a key that is left out, a file that is read
/// in part, or a command or key with another effect in the new deck.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Losses {
    /// Lines of initial values, loads and supports.
    pub conditions: Vec<usize>,
    /// Lines of damage models that blocks use, and lines of the criteria of these models.
    pub damages: Vec<usize>,
    /// Lines on which `Omit Bonds Between Blocks` has an unknown value.
    pub bonds: Vec<usize>,
    /// Lines of influence functions without a counterpart.
    pub influence: Vec<usize>,
    /// Lines that name a point file with columns of material constants.
    pub columns: Vec<usize>,
    /// Lines of node sets that contain numbers of points that do not exist.
    pub dropped_numbers: Vec<usize>,
    /// Lines of keys that scale the families.
    pub scaled_families: Vec<usize>,
    /// Line of the first `run` of a script, if no fix integrates the motion of atoms in this run.
    pub unmoved: Vec<usize>,
    /// Lines of loads that act in addition to another load in the new deck only.
    pub added_loads: Vec<usize>,
    /// Lines of initial values that have no fixed order in PeriLab.
    pub unordered_initials: Vec<usize>,
    /// Lines of damage models whose compressed bonds do not break in the new deck.
    pub intact_compressed: Vec<usize>,
    /// Notes on keys whose results in the new deck differ, each with the line of its key.
    pub consequences: Vec<(&'static str, usize)>,
}

impl Losses {
    /// Collect the losses of a deck.
    pub(super) fn of(entries: &[Entry]) -> Self {
        let mut losses = Self::default();
        for entry in entries {
            if entry.is_lost_load {
                losses.conditions.push(entry.line);
            }
            for (note, lines) in [
                (UNUSED_COLUMNS, &mut losses.columns),
                (DROPPED_NUMBERS, &mut losses.dropped_numbers),
                (UNSCALED_FAMILIES, &mut losses.scaled_families),
                (NO_INTEGRATION, &mut losses.unmoved),
                (ADDED_LOADS, &mut losses.added_loads),
                (UNORDERED_INITIALS, &mut losses.unordered_initials),
                (INTACT_COMPRESSED, &mut losses.intact_compressed),
            ] {
                if entry.note.contains(note) {
                    lines.push(entry.line);
                }
            }
            let noted = CONSEQUENCES
                .into_iter()
                .filter(|note| entry.note.contains(note));
            losses
                .consequences
                .extend(noted.map(|note| (note, entry.line)));
        }
        let lost = entries
            .iter()
            .filter(|entry| entry.fate == Fate::LeftOut && entry.note != UNUSED_DAMAGE);
        for entry in lost {
            let words: Vec<&str> = entry.key.split(" > ").collect();
            let below = |table: &str| {
                let at = words.iter().position(|word| *word == table)?;
                Some(words.len() - 1 - at)
            };
            let last = words[words.len() - 1];
            let is_criterion = ["Critical Stretch", "Critical Value"].contains(&last);
            match below("Damage Models") {
                Some(1) => losses.damages.push(entry.line),
                Some(2) if is_criterion => losses.damages.push(entry.line),
                _ => {}
            }
            if below("Discretization") == Some(1) && is_key(last, OMITTED_BONDS) {
                losses.bonds.push(entry.line);
            }
            if entry.note == OTHER_INFLUENCE {
                losses.influence.push(entry.line);
            }
        }
        losses
    }

    /// Test whether there are no losses.
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}

impl fmt::Display for Losses {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (conditions, damages) = (self.conditions.len(), self.damages.len());
        let counts = [
            (conditions, "load or support", "loads or supports"),
            (damages, "damage model", "damage models"),
        ];
        let counts: Vec<String> = counts
            .into_iter()
            .filter(|(count, ..)| *count > 0)
            .map(|(count, one, several)| match count {
                1 => format!("1 {one}"),
                count => format!("{count} {several}"),
            })
            .collect();
        let mut parts = Vec::new();
        if !counts.is_empty() {
            let mut lines: Vec<usize> = self.conditions.clone();
            lines.extend(&self.damages);
            lines.sort_unstable();
            let lines: Vec<String> = lines.iter().map(usize::to_string).collect();
            let (verb, word) = match lines.len() {
                1 => ("is", "line"),
                _ => ("are", "lines"),
            };
            parts.push(format!(
                "{} {verb} left out: {word} {}",
                counts.join(" and "),
                lines.join(", ")
            ));
        }
        for line in &self.bonds {
            parts.push(format!(
                "the value of `{OMITTED_BONDS}` is not known: line {line}"
            ));
        }
        for line in &self.influence {
            parts.push(format!("the influence function is left out: line {line}"));
        }
        for (note, lines) in [
            (UNUSED_COLUMNS, &self.columns),
            (DROPPED_NUMBERS, &self.dropped_numbers),
            (UNSCALED_FAMILIES, &self.scaled_families),
            (NO_INTEGRATION, &self.unmoved),
            (ADDED_LOADS, &self.added_loads),
            (UNORDERED_INITIALS, &self.unordered_initials),
            (INTACT_COMPRESSED, &self.intact_compressed),
        ] {
            parts.extend(lines.iter().map(|line| format!("{note}: line {line}")));
        }
        let consequences = self.consequences.iter();
        parts.extend(consequences.map(|(note, line)| format!("{note}: line {line}")));
        formatter.write_str(&parts.join("; "))
    }
}

/// Outcomes of the nodes of a tree, by node id.
#[derive(Debug, Default)]
pub(super) struct Log {
    fates: RefCell<HashMap<usize, (Fate, String)>>,
    /// Tables whose outcome holds for all their keys.
    whole_tables: RefCell<HashSet<usize>>,
    /// Initial values, loads and supports that are left out.
    lost_loads: RefCell<HashSet<usize>>,
}

impl Log {
    /// Log the outcome of a node. Notes for the same node are joined. If several outcomes are logged for
    /// the node, the first outcome other than `Taken` is kept.
    pub(super) fn note(&self, node: &Node, fate: Fate, note: impl Into<String>) {
        let mut fates = self.fates.borrow_mut();
        match fates.get_mut(&node.id) {
            Some((known, text)) => {
                let note = note.into();
                if *known == Fate::Taken {
                    *known = fate;
                }
                if !text.split("; ").any(|part| part == note) {
                    *text = format!("{text}; {note}");
                }
            }
            None => {
                fates.insert(node.id, (fate, note.into()));
            }
        }
    }

    /// Test whether an outcome of a node has been logged.
    pub(super) fn is_noted(&self, node: &Node) -> bool {
        self.fates.borrow().contains_key(&node.id)
    }

    /// Log the outcome of a node, and discard the earlier outcome and notes of this node.
    pub(super) fn replace(&self, node: &Node, fate: Fate, note: impl Into<String>) {
        self.fates.borrow_mut().insert(node.id, (fate, note.into()));
    }

    /// Log the outcome of a table and all its keys; the keys are not listed separately.
    pub(super) fn note_whole_table(&self, table: &Node, fate: Fate, note: impl Into<String>) {
        self.note(table, fate, note);
        self.whole_tables.borrow_mut().insert(table.id);
    }

    /// Log that the new deck expresses a key (`node`) without a change of meaning.
    pub(super) fn taken(&self, node: &Node, note: impl Into<String>) {
        self.note(node, Fate::Taken, note);
    }

    /// Log that the new deck expresses a key (`node`) only approximately: the meaning is similar, but not the
    /// same.
    pub(super) fn approximated(&self, node: &Node, note: impl Into<String>) {
        self.note(node, Fate::Approximated, note);
    }

    /// Log that the new deck does not express a key (`node`).
    pub(super) fn left_out(&self, node: &Node, note: impl Into<String>) {
        self.note(node, Fate::LeftOut, note);
    }

    /// Log that the new deck does not express a key (`node`) that sets an initial value, a load or a support.
    pub(super) fn lose_load(&self, node: &Node, note: impl Into<String>) {
        self.left_out(node, note);
        self.lost_loads.borrow_mut().insert(node.id);
    }

    /// Return the outcomes of all keys of a tree, in the order of the text. If a value or an empty table has
    /// no note, its outcome is `LeftOut`. If any other table has no note, only its keys are listed.
    pub(super) fn entries(&self, root: &Node) -> Vec<Entry> {
        let mut entries = Vec::new();
        self.collect(root, "", &mut entries);
        entries
    }

    fn collect(&self, node: &Node, key: &str, entries: &mut Vec<Entry>) {
        let noted = self.fates.borrow().get(&node.id).cloned();
        let children = node.entries();
        let (fate, note) = match noted {
            Some(noted) => noted,
            None if !children.is_empty() || key.is_empty() => {
                for (name, child) in children {
                    let key = match key {
                        "" => name.clone(),
                        key => format!("{key} > {name}"),
                    };
                    self.collect(child, &key, entries);
                }
                return;
            }
            None => (Fate::LeftOut, reason(key).to_owned()),
        };
        entries.push(Entry {
            line: node.line,
            key: key.to_owned(),
            value: value(node),
            fate,
            note,
            is_lost_load: self.lost_loads.borrow().contains(&node.id),
        });
        // A table that is left out completely is one entry.
        if fate != Fate::LeftOut && !self.whole_tables.borrow().contains(&node.id) {
            for (name, child) in children {
                self.collect(child, &format!("{key} > {name}"), entries);
            }
        }
    }
}

/// Words in keys that no translator reads, each with the reason for leaving out such a key.
const REASONS: [(&str, &str); 11] = [
    ("verbose", "concerns what the code prints"),
    ("pre calculation", "what a law needs is computed"),
    ("specific heat", "heat is not conducted"),
    ("thermal", "heat is not conducted"),
    ("temperature", "heat is not conducted"),
    ("additive", "points exist from the start"),
    ("flaw", "a material is the same everywhere"),
    ("fluid", "there are no fluids"),
    ("permeability", "there are no fluids"),
    ("external topology", "there are no finite elements"),
    ("preconditioner", "concerns a solver of linear systems"),
];

/// Return the reason for leaving out a key that no translator reads.
fn reason(key: &str) -> &'static str {
    let key = key.to_lowercase().replace('_', " ");
    let known = REASONS.iter().find(|(word, _)| key.contains(word));
    known.map_or("unknown, or without a counterpart", |(_, reason)| reason)
}

/// Return the value of a node as text, for the printed list of keys.
fn value(node: &Node) -> String {
    match &node.content {
        Content::Text(text) => shown(text),
        Content::List(nodes) => {
            let texts = nodes.iter().filter_map(Node::text).collect::<Vec<_>>();
            shown(&texts.join(", "))
        }
        Content::Table(_) => String::new(),
    }
}

/// Return a value as text on one line. A long text is cut.
fn shown(text: &str) -> String {
    let text = text.trim();
    if text.is_empty() {
        String::new()
    } else {
        excerpt(text).trim_matches('`').to_owned()
    }
}
