//! Node sets of a source deck, defined in the deck, in files or in the mesh.

use super::draft::{Section, Value};
use super::expression::Dialect;
use super::files::PointFile;
use super::log::DROPPED_NUMBERS;
use super::translation::Translation;
use super::tree::{Content, Node, is_key};
use crate::error::{Result, excerpt};

/// A node set that the source deck defines.
struct Defined<'n> {
    name: String,
    node: &'n Node,
    /// Whether Peridigm or PeriLab treats this entry as a node set, because of its name or position.
    is_declared: bool,
    /// Name of the set in the new deck; `None` until the first use.
    written: Option<String>,
    /// Whether a sum of node sets contains this set.
    is_in_sum: bool,
}

/// The points of a node set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Members {
    /// All points.
    All,
    /// The points with these ids, which start at 0. The ids are in ascending order, without duplicates.
    Ids(Vec<u64>),
}

impl Members {
    /// Test whether a point belongs to the set.
    pub fn contains(&self, id: u64) -> bool {
        match self {
            Self::All => true,
            Self::Ids(ids) => ids.binary_search(&id).is_ok(),
        }
    }

    /// Test whether two sets have a point in common.
    pub fn overlap(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::All, _) | (_, Self::All) => true,
            (Self::Ids(ids), other) => ids.iter().any(|id| other.contains(*id)),
        }
    }
}

/// The node sets of a source deck.
pub struct Sets<'n> {
    defined: Vec<Defined<'n>>,
    /// Sets of the mesh: name in the mesh and name in the new deck.
    of_mesh: Vec<(String, String)>,
    /// Sums of node sets: names of the node sets, and name of the sum in the new deck.
    sums: Vec<(Vec<String>, String)>,
    /// Prefix that the new deck needs before the name of a set of the mesh; `None` if the points do not come
    /// from a mesh.
    mesh_prefix: Option<&'static str>,
    /// Names of node sets of the mesh, with the ids of the elements whose nodes are all in the set. `None` if
    /// one node in a set suffices for an element to belong to the set.
    ids_by_name: Option<Vec<(String, Vec<u64>)>>,
    /// Number of the last point, if larger numbers are dropped from node sets, as in PeriLab; `None` if no
    /// numbers are dropped.
    last_number: Option<u64>,
}

impl<'n> Sets<'n> {
    /// Create an empty collection. `mesh_prefix` is the text that the new deck needs before the names of node
    /// sets of the mesh; `None` without a mesh.
    pub fn new(mesh_prefix: Option<&'static str>) -> Self {
        Self {
            defined: Vec::new(),
            of_mesh: Vec::new(),
            sums: Vec::new(),
            mesh_prefix,
            ids_by_name: None,
            last_number: None,
        }
    }

    /// Store the name of each node set of the mesh, with the ids of the points in the set. Call this function
    /// for PeriLab, in which an element belongs to a node set only if all nodes of the element are in the
    /// set. A set that is not in `sets` is written as a set of the mesh and logged as approximated.
    pub fn set_ids_by_name(&mut self, sets: Vec<(String, Vec<u64>)>) {
        self.ids_by_name = Some(sets);
    }

    /// Store the number of the last point. Call this function for PeriLab, which drops larger numbers from
    /// node sets.
    pub fn set_last_number(&mut self, last: u64) {
        self.last_number = Some(last);
    }

    /// Add a node set of the source deck. `is_declared` says whether Peridigm or PeriLab treats the entry as
    /// a node set because of its name or position. Any other entry is a node set only if another entry of the
    /// source deck uses it as one.
    pub fn define(&mut self, name: &str, node: &'n Node, is_declared: bool) {
        self.defined.push(Defined {
            name: name.to_owned(),
            node,
            is_declared,
            written: None,
            is_in_sum: false,
        });
    }

    /// Return the name that a node set of the source deck has in the new deck. Write the set at its first
    /// use.
    ///
    /// # Errors
    /// If neither the source deck nor the mesh has this set, or its definition is invalid.
    pub fn find(
        &mut self,
        translation: &mut Translation,
        user: &Node,
        name: &str,
    ) -> Result<String> {
        let found = self.defined.iter_mut().find(|set| is_key(&set.name, name));
        if let Some(set) = found {
            if let Some(written) = &set.written {
                return Ok(written.clone());
            }
            let written = define(translation, &set.name, set.node, self.last_number)?;
            if !set.is_declared {
                let note = "a node set by its use; Peridigm wants `Node Set` in its name";
                translation.log.taken(set.node, note);
            }
            set.written = Some(written.clone());
            return Ok(written);
        }
        if let Some((_, written)) = self.of_mesh.iter().find(|(known, _)| known == name) {
            return Ok(written.clone());
        }
        let Some(prefix) = self.mesh_prefix else {
            let mut message = format!("the deck defines no node set {}", excerpt(name));
            let declared = self.defined.iter().filter(|set| set.is_declared);
            let known: Vec<String> = declared.map(|set| excerpt(&set.name)).collect();
            if !known.is_empty() {
                message += &format!("; it has {}", known.join(", "));
            }
            if translation.dialect == Dialect::Peridigm {
                message += "; node sets are parameters of `Boundary Conditions` with `Node Set` in their names";
            }
            return Err(translation.error(user.line, message));
        };
        let written = translation.new_name("set", name);
        let mut section = Section::new(format!("set.{written}"));
        let known = self.ids_by_name.as_ref().map(|sets| {
            let found = sets.iter().find(|(known, _)| known == name);
            found.map(|(_, ids)| ids.clone())
        });
        if let Some(Some(ids)) = known {
            if ids.is_empty() {
                let message = format!(
                    "no element has all its nodes in the node set {}",
                    excerpt(name)
                );
                return Err(translation.error(user.line, message));
            }
            let note = format!("[set.{written}] ids of the elements with all nodes in the set");
            translation.log.taken(user, note);
            section.set("ids", Value::Ids(ids));
        } else {
            if known.is_some() {
                let note = "elements with at least one node in the set; PeriLab takes those with all nodes";
                translation.log.approximated(user, note);
            }
            section.set("mesh", Value::text(format!("{prefix}{name}")));
        }
        translation.add(section);
        self.of_mesh.push((name.to_owned(), written.clone()));
        Ok(written)
    }

    /// Return the name that a sum of node sets has in the new deck. Write the sum at its first use. Return
    /// `None` if the sum has no points, or if the new deck cannot express the sum as one set. The latter is
    /// so if the points of at least one node set are not known, and at least one node set is not given by a
    /// condition.
    pub fn find_sum(
        &mut self,
        translation: &mut Translation,
        user: &Node,
        names: &[&str],
    ) -> Option<String> {
        if let Some((_, written)) = self.sums.iter().find(|(known, _)| known == names) {
            translation.log.taken(user, format!("the set `{written}`"));
            return Some(written.clone());
        }
        let value = match self.members(translation, names) {
            Some(Members::All) => None,
            Some(Members::Ids(ids)) if ids.is_empty() || ids.len() as u64 > MOST_NUMBERS => {
                return None;
            }
            Some(Members::Ids(ids)) => Some(("ids", Value::Ids(ids))),
            None => {
                let conditions = names.iter().map(|name| self.condition(translation, name));
                let conditions: Vec<String> = conditions.collect::<Option<_>>()?;
                Some(("where", Value::text(conditions.join(" || "))))
            }
        };
        let written = match value {
            None => "all".to_owned(),
            Some((key, value)) => {
                let written = translation.new_name("set", &names.join(" "));
                let mut section = Section::new(format!("set.{written}"));
                section.set(key, value);
                translation.add(section);
                written
            }
        };
        let note = format!("the set `{written}`");
        translation.log.taken(user, note.clone());
        let last = self.last_number;
        for set in &mut self.defined {
            if names.iter().any(|name| is_key(&set.name, name)) {
                set.is_in_sum = true;
                translation.log.taken(set.node, note.clone());
                let largest = listed_numbers(translation, set.node)
                    .into_iter()
                    .flatten()
                    .max();
                if last
                    .zip(largest)
                    .is_some_and(|(last, largest)| largest > last)
                {
                    translation.log.taken(set.node, DROPPED_NUMBERS);
                }
            }
        }
        let names = names.iter().map(|name| (*name).to_owned());
        self.sums.push((names.collect(), written.clone()));
        Some(written)
    }

    /// Return the condition of a node set, in parentheses; `None` if the set is not given by a condition.
    fn condition(&self, translation: &Translation, name: &str) -> Option<String> {
        let set = self.defined.iter().find(|set| is_key(&set.name, name))?;
        let text = set_text(set.node).filter(|text| is_condition(text))?;
        let condition = translation.expression(&text, false).ok()?;
        Some(format!("({})", condition.plain()))
    }

    /// Return the points of a sum of node sets. The points are known for the sets passed to
    /// [`Self::set_ids_by_name`], for lists of point numbers in the deck or in a file, and for the set of all
    /// points. Return `None` if the points of another set are asked for.
    pub fn members(&self, translation: &Translation, names: &[&str]) -> Option<Members> {
        let parts = names.iter().map(|name| self.members_of(translation, name));
        let parts: Vec<Members> = parts.collect::<Option<_>>()?;
        let mut all = Vec::new();
        for part in parts {
            match part {
                Members::All => return Some(Members::All),
                Members::Ids(ids) => all.extend(ids),
            }
        }
        all.sort_unstable();
        all.dedup();
        Some(Members::Ids(all))
    }

    fn members_of(&self, translation: &Translation, name: &str) -> Option<Members> {
        let Some(set) = self.defined.iter().find(|set| is_key(&set.name, name)) else {
            let mut of_mesh = self.ids_by_name.iter().flatten();
            let (_, ids) = of_mesh.find(|(known, _)| known == name)?;
            return Some(Members::Ids(ids.clone()));
        };
        if set_text(set.node).is_some_and(|text| is_all(&text)) {
            return Some(Members::All);
        }
        let numbers = listed_numbers(translation, set.node)?.into_iter();
        let exist = numbers.filter(|number| self.has_point(*number));
        // The first point has the number 1.
        let ids: Option<Vec<u64>> = exist.map(|number| number.checked_sub(1)).collect();
        ids.map(Members::Ids)
    }

    /// Test whether a point may have this number.
    fn has_point(&self, number: u64) -> bool {
        self.last_number.is_none_or(|last| number <= last)
    }

    /// Log the declared node sets that nothing uses. An unused entry that is not declared as a node set is
    /// not logged, because such an entry is a node set only if something uses it.
    pub fn finish(&self, translation: &Translation) {
        for set in &self.defined {
            if set.written.is_none() && set.is_declared && !set.is_in_sum {
                translation
                    .log
                    .left_out(set.node, "nothing uses this node set");
            }
        }
    }
}

/// Test whether the text of a node set means all points.
fn is_all(text: &str) -> bool {
    text.eq_ignore_ascii_case("all")
}

/// Test whether the text of a node set is a condition, such as `x>0.5`.
fn is_condition(text: &str) -> bool {
    text.contains(['<', '>', '='])
}

/// Return the numbers of the points of a node set that is given by a list or a file; `None` for other sets,
/// and if the file cannot be read.
fn listed_numbers(translation: &Translation, node: &Node) -> Option<Vec<u64>> {
    let text = set_text(node)?;
    numbers(&text).or_else(|| numbers_of_file(translation, &text))
}

/// Read the point numbers that a file lists; `None` if the file cannot be read.
fn numbers_of_file(translation: &Translation, file: &str) -> Option<Vec<u64>> {
    let mut ids = crate::points::id_file::read(&translation.path(file), 1).ok()?;
    for id in &mut ids {
        *id += 1;
    }
    Some(ids)
}

/// Write the definition of a node set; return its name. If `last` is given, drop the point numbers above
/// `last`.
fn define(
    translation: &mut Translation,
    name: &str,
    node: &Node,
    last: Option<u64>,
) -> Result<String> {
    let Some(text) = set_text(node) else {
        let message = format!("`{name}` must be a file, numbers of points or a condition");
        return Err(translation.error(node.line, message));
    };
    if is_all(&text) {
        translation.log.taken(node, "the set `all`");
        return Ok("all".to_owned());
    }
    let written = translation.new_name("set", name);
    let mut section = Section::new(format!("set.{written}"));
    let header = format!("[set.{written}]");
    let is_range = text.contains(':')
        && text
            .chars()
            .all(|c| c.is_ascii_digit() || " :-".contains(c));
    if is_range && numbers(&text).is_none() {
        let message = format!(
            "`{name}`: a range must rise and have at most {MOST_NUMBERS} numbers, is {}",
            excerpt(&text)
        );
        return Err(translation.error(node.line, message));
    }
    let listed = match numbers(&text) {
        Some(numbers) => {
            if let Some(zero) = numbers.iter().position(|number| *number == 0) {
                let message = format!(
                    "`{name}`: number {} is 0, but the first point has the number 1",
                    zero + 1
                );
                return Err(translation.error(node.line, message));
            }
            Some(numbers)
        }
        // The numbers of a file are listed only if some of them are dropped.
        None => last.and_then(|last| {
            let numbers = numbers_of_file(translation, &text)?;
            let is_short = numbers.len() as u64 <= MOST_NUMBERS;
            (is_short && numbers.iter().any(|number| *number > last)).then_some(numbers)
        }),
    };
    if let Some(mut numbers) = listed {
        let count = numbers.len();
        numbers.retain(|number| last.is_none_or(|last| *number <= last));
        if let (Some(last), true) = (last, numbers.is_empty()) {
            let message =
                format!("`{name}`: all its numbers are above {last}, the number of the last point");
            return Err(translation.error(node.line, message));
        }
        let note = format!("{header} ids; the first point has the id 0");
        translation.log.taken(node, note);
        if numbers.len() < count {
            translation.log.taken(node, DROPPED_NUMBERS);
        }
        let ids = numbers.iter().map(|number| number - 1);
        section.set("ids", Value::Ids(ids.collect()));
    } else if is_condition(&text) {
        let condition = translation
            .expression(&text, false)
            .map_err(|message| translation.error(node.line, format!("`{name}`: {message}")))?;
        section.set("where", condition);
        translation.log.taken(node, format!("{header} where"));
    } else {
        section.set("file", translation.file(&text));
        section.set("first_id", Value::Number("1".to_owned()));
        let note = match PointFile::read(&translation.path(&text), &[]) {
            Some(_) => format!("{header} file"),
            None => format!("{header} file, which cannot be read yet"),
        };
        translation.log.taken(node, note);
    }
    translation.add(section);
    Ok(written)
}

/// Return the text of a node set; a list of numbers is joined to one text.
fn set_text(node: &Node) -> Option<String> {
    match &node.content {
        Content::Text(text) => Some(text.trim().to_owned()),
        Content::List(nodes) => {
            let words: Option<Vec<&str>> = nodes.iter().map(Node::text).collect();
            Some(words?.join(" "))
        }
        Content::Table(_) => None,
    }
}

/// Largest number of ids in a range. The new deck lists all ids of a range, so a longer range would make this
/// deck unreadable.
const MOST_NUMBERS: u64 = 1_000_000;

/// Read the numbers of a list `1 2 3`, a range `1:27` or a range with a step `1:2:27`.
fn numbers(text: &str) -> Option<Vec<u64>> {
    if text.contains(':') {
        let parts: Option<Vec<u64>> = text
            .split(':')
            .map(|part| part.trim().parse().ok())
            .collect();
        let (first, step, last) = match parts?[..] {
            [first, last] => (first, 1, last),
            [first, step, last] if step > 0 => (first, step, last),
            _ => return None,
        };
        let is_short = first <= last && (last - first) / step < MOST_NUMBERS;
        return is_short.then(|| (first..=last).step_by(step as usize).collect());
    }
    let words = text
        .split([' ', '\t', '\n', '\r', ','])
        .filter(|word| !word.is_empty());
    let numbers: Option<Vec<u64>> = words.map(|word| word.parse().ok()).collect();
    numbers.filter(|numbers| !numbers.is_empty())
}
