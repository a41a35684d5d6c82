//! Input files of Abaqus: nodes, elements, sets, surfaces, parts, instances and included files.
//!
//! Keywords that would change the mesh are errors. Other keywords are skipped.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::{Rotation3, Unit, Vector3};
use rustc_hash::{FxHashMap, FxHashSet};

use super::kind::{Form, Kind};
use super::{Elements, Group, Members, Mesh, Runs, fault, load, position};
use crate::error::{Error, Result, excerpt};

/// Largest depth of files that include one another.
const DEEPEST: usize = 16;

/// Largest number of included files: files can include one another several times.
const MOST_INCLUDED: usize = 1000;

/// Largest number of nodes, and of elements, of all instances.
const LARGEST: usize = u32::MAX as usize;

/// Keywords that generate or move nodes or elements.
const GENERATORS: [&str; 8] = [
    "NGEN", "NFILL", "NMAP", "NCOPY", "ELGEN", "ELCOPY", "SYSTEM", "SUBMODEL",
];

/// Return the type of an element from its name, such as `C3D8R`.
fn kind(name: &str) -> Option<Kind> {
    const SOLIDS: [&str; 6] = ["C3D", "AC3D", "DC3D", "DCC3D", "Q3D", "SC"];
    const FACES: [&str; 12] = [
        "CPEG", "CPS", "CPE", "DC2D", "AC2D", "SFM3D", "M3D", "R3D", "STRI", "DS", "S", "F3D",
    ];
    const LINES: [&str; 5] = ["T2D", "T3D", "R2D", "DC1D", "AC1D"];
    // A name is a family, the number of nodes, and a suffix of letters and digits.
    let nodes = |families: &[&str]| {
        families.iter().find_map(|family| {
            let rest = name.strip_prefix(family)?;
            let end = rest
                .find(|c: char| !c.is_ascii_digit())
                .unwrap_or(rest.len());
            let is_suffix = rest[end..].chars().all(|c| c.is_ascii_alphanumeric());
            rest[..end].parse::<usize>().ok().filter(|_| is_suffix)
        })
    };
    let of = |form, nodes| Some(Kind::new(form, nodes));
    match name {
        "MASS" | "ROTARYI" => return of(Form::Point, 1),
        "B21" | "B21H" | "B23" | "B23H" | "B31" | "B31H" | "B31OS" | "B33" | "B33H" => {
            return of(Form::Line, 2);
        }
        "B22" | "B22H" | "B32" | "B32H" | "B32OS" => return of(Form::Line, 3),
        _ => {}
    }
    if let Some(count) = nodes(&SOLIDS) {
        return match count {
            4 | 10 => of(Form::Tetrahedron, count),
            5 => of(Form::Pyramid, count),
            6 | 15 => of(Form::Wedge, count),
            8 | 20 => of(Form::Hexahedron, count),
            _ => None,
        };
    }
    if let Some(count) = nodes(&FACES) {
        // `STRI65` has 6 nodes and 5 degrees of freedom each.
        return match count {
            3 | 6 => of(Form::Triangle, count),
            65 => of(Form::Triangle, 6),
            4 | 8 | 9 => of(Form::Quadrilateral, count),
            _ => None,
        };
    }
    match nodes(&LINES) {
        Some(count @ (2 | 3)) => of(Form::Line, count),
        _ => None,
    }
}

/// Read a mesh and the files that it includes.
///
/// # Errors
/// If the lines of the files do not follow the format.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<Mesh> {
    let mut reader = Reader::default();
    reader.mesh.ignores_case = true;
    reader.read(path, bytes, 0)?;
    reader.finish(path)
}

/// Nodes, elements and sets of the model, of a part or of an instance.
#[derive(Clone, Default)]
struct Part {
    name: String,
    nodes: Vec<[f64; 3]>,
    elements: Elements,
    /// Indices of nodes and elements, by the numbers in the file.
    node_indices: FxHashMap<u64, u32>,
    element_indices: FxHashMap<u64, u32>,
    sets: Vec<Set>,
}

/// Kind of the members of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
enum Of {
    Nodes,
    Elements,
}

/// Data lines of one keyword that defines or extends a set.
#[derive(Clone)]
struct Set {
    of: Of,
    name: String,
    instance: Option<String>,
    numbers: Vec<u64>,
    /// Ranges of numbers: first, last and step.
    ranges: Vec<[u64; 3]>,
    /// Names of other sets, which this set includes.
    names: Vec<String>,
    /// The members are all nodes of the element sets in `names`.
    is_nodes_of_elements: bool,
    place: Place,
}

/// Position in a file, for messages.
#[derive(Clone, Default)]
struct Place {
    file: Arc<PathBuf>,
    line: u64,
}

impl Place {
    fn fault(&self, message: impl std::fmt::Display) -> Error {
        fault(&self.file, self.line, message)
    }
}

/// An instance that has been appended to the mesh.
struct Placed {
    name: String,
    node_indices: FxHashMap<u64, u32>,
    element_indices: FxHashMap<u64, u32>,
    first_node: u64,
    first_element: u64,
}

/// Meaning of the data lines below a keyword.
#[derive(Clone, Copy, Default)]
enum Data {
    #[default]
    Skipped,
    /// Nodes, and the index of the set to which they are added.
    Nodes(Option<usize>),
    /// Elements, and the index of the set to which they are added.
    Elements(Kind, Option<usize>),
    Set {
        is_generated: bool,
    },
    Surface,
    Position,
}

/// Position of an instance in the assembly: a translation, then a rotation.
struct Instance {
    translation: Vector3<f64>,
    rotation: Rotation3<f64>,
    /// A point on the axis of rotation.
    pivot: Vector3<f64>,
    lines: usize,
}

#[derive(Default)]
struct Reader {
    mesh: Mesh,
    /// Nodes, elements and sets outside of parts and instances.
    model: Part,
    parts: FxHashMap<String, Part>,
    /// The part or instance that is being read.
    current: Option<Part>,
    instance: Option<Instance>,
    placed: Vec<Placed>,
    data: Data,
    /// Numbers of an element whose nodes continue on the next line.
    pending: Vec<u64>,
    included: usize,
    place: Place,
}

/// If there are more than `limit` numbers, remove repeated ones and raise the limit.
fn compact(numbers: &mut Vec<u64>, limit: &mut usize) {
    if numbers.len() > *limit {
        numbers.sort_unstable();
        numbers.dedup();
        *limit = 1024 + 2 * numbers.len();
    }
}

/// A keyword line.
struct Keyword {
    name: String,
    parameters: Vec<(String, String)>,
}

impl Keyword {
    fn new(line: &str) -> Self {
        let mut entries = line.split(',').map(str::trim);
        let name = entries.next().unwrap_or_default();
        // A name such as `*End  Part` may contain several blanks.
        let name: Vec<&str> = name.split_whitespace().collect();
        let parameter = |entry: &str| {
            let (key, value) = entry.split_once('=').unwrap_or((entry, ""));
            let value = value.trim().trim_matches('"');
            (key.trim().to_ascii_uppercase(), value.to_owned())
        };
        Self {
            name: name.join(" ").to_ascii_uppercase(),
            parameters: entries.map(parameter).collect(),
        }
    }

    fn get(&self, key: &str) -> Option<&str> {
        let found = self.parameters.iter().find(|(name, _)| name == key);
        found.map(|(_, value)| value.as_str())
    }
}

impl Reader {
    fn fault(&self, message: impl std::fmt::Display) -> Error {
        self.place.fault(message)
    }

    /// Read the lines of a file.
    fn read(&mut self, path: &Path, bytes: &[u8], depth: usize) -> Result<()> {
        let file = Arc::new(path.to_owned());
        let mut lines = bytes.split(|byte| *byte == b'\n').zip(1..);
        while let Some((line, number)) = lines.next() {
            self.place = Place {
                file: file.clone(),
                line: number,
            };
            let line = String::from_utf8_lossy(line);
            let line = line.trim();
            if line.is_empty() || line.starts_with("**") {
                continue;
            }
            let Some(keyword) = line.strip_prefix('*') else {
                self.read_data(line)?;
                continue;
            };
            let mut keyword = keyword.to_owned();
            // A keyword line that ends with a comma continues on the next line.
            while keyword.ends_with(',') {
                let Some((next, _)) = lines.next() else { break };
                keyword.push_str(String::from_utf8_lossy(next).trim());
            }
            let keyword = Keyword::new(&keyword);
            if keyword.name == "INCLUDE" {
                let Some(input) = keyword.get("INPUT") else {
                    return Err(self.fault("*INCLUDE: needs `INPUT=file`"));
                };
                self.include(path, input, depth)?;
                continue;
            }
            self.element_is_complete()?;
            self.read_keyword(&keyword)?;
            let has_data = !matches!(self.data, Data::Skipped);
            if let Some(input) = keyword.get("INPUT").filter(|_| has_data) {
                self.include(path, input, depth)?;
            }
        }
        if depth == 0 {
            self.element_is_complete()?;
        }
        Ok(())
    }

    /// Read an included file in place of its *INCLUDE line.
    fn include(&mut self, from: &Path, input: &str, depth: usize) -> Result<()> {
        self.included += 1;
        if depth == DEEPEST || self.included > MOST_INCLUDED {
            let message = format!(
                "includes files {DEEPEST} deep or {MOST_INCLUDED} in all; do they include themselves?"
            );
            return Err(self.fault(message));
        }
        let path = from.parent().unwrap_or("".as_ref()).join(input);
        let bytes = load(&path)
            .map_err(|error| self.fault(format!("cannot read {}: {error}", path.display())))?;
        self.read(&path, &bytes, depth + 1)
    }

    /// Return the part or instance that is being read, or else the model.
    fn part(&mut self) -> &mut Part {
        self.current.as_mut().unwrap_or(&mut self.model)
    }

    fn read_keyword(&mut self, keyword: &Keyword) -> Result<()> {
        self.data = Data::Skipped;
        let name = &keyword.name[..];
        if GENERATORS.contains(&name) {
            let message =
                format!("*{name} is not supported; write the mesh with all nodes and elements");
            return Err(self.fault(message));
        }
        match name {
            "NODE" => {
                let system = keyword.get("SYSTEM").unwrap_or("R");
                if !system.eq_ignore_ascii_case("R") {
                    return Err(self.fault("*NODE: coordinates must be Cartesian"));
                }
                let set = keyword.get("NSET");
                let set = set.map(|set| self.begin_set(Of::Nodes, set, keyword));
                self.data = Data::Nodes(set);
            }
            "ELEMENT" => {
                let written = keyword.get("TYPE").unwrap_or_default().to_ascii_uppercase();
                let Some(kind) = kind(&written) else {
                    let message = format!(
                        "element type {} is not supported; use solids, planes, shells or lines of first or \
                         second order",
                        excerpt(&written)
                    );
                    return Err(self.fault(message));
                };
                let set = keyword.get("ELSET");
                let set = set.map(|set| self.begin_set(Of::Elements, set, keyword));
                self.data = Data::Elements(kind, set);
            }
            "NSET" | "ELSET" => {
                let of = if name == "NSET" {
                    Of::Nodes
                } else {
                    Of::Elements
                };
                let Some(set) = keyword.get(name) else {
                    return Err(self.fault(format!("*{name}: needs `{name}=name`")));
                };
                self.begin_set(of, set, keyword);
                if let (Of::Nodes, Some(elements)) = (of, keyword.get("ELSET")) {
                    let set = self.last_set();
                    set.is_nodes_of_elements = true;
                    set.names.push(elements.to_owned());
                } else {
                    self.data = Data::Set {
                        is_generated: keyword.get("GENERATE").is_some(),
                    };
                }
            }
            "SURFACE" => {
                let kind = keyword
                    .get("TYPE")
                    .unwrap_or("ELEMENT")
                    .to_ascii_uppercase();
                let of = match &kind[..] {
                    "ELEMENT" => Of::Elements,
                    "NODE" => Of::Nodes,
                    _ => return Ok(()),
                };
                if let Some(set) = keyword.get("NAME") {
                    self.begin_set(of, set, keyword);
                    self.data = Data::Surface;
                }
            }
            "PART" => {
                let part = Part {
                    name: keyword.get("NAME").unwrap_or_default().to_owned(),
                    ..Part::default()
                };
                self.begin(part, name)?;
            }
            "END PART" => {
                let part = self.current.take().filter(|_| self.instance.is_none());
                let Some(part) = part else {
                    return Err(self.fault("*END PART without *PART"));
                };
                self.parts.insert(part.name.to_ascii_uppercase(), part);
            }
            "INSTANCE" => {
                let wanted = keyword.get("PART").unwrap_or_default();
                let Some(part) = self.parts.get(&wanted.to_ascii_uppercase()) else {
                    let message = format!("*INSTANCE: there is no part {}", excerpt(wanted));
                    return Err(self.fault(message));
                };
                let part = Part {
                    name: keyword.get("NAME").unwrap_or(wanted).to_owned(),
                    ..part.clone()
                };
                self.begin(part, name)?;
                self.instance = Some(Instance {
                    translation: Vector3::zeros(),
                    rotation: Rotation3::identity(),
                    pivot: Vector3::zeros(),
                    lines: 0,
                });
                self.data = Data::Position;
            }
            "END INSTANCE" => {
                let (Some(part), Some(instance)) = (self.current.take(), self.instance.take())
                else {
                    return Err(self.fault("*END INSTANCE without *INSTANCE"));
                };
                self.place_instance(part, &instance)?;
            }
            _ => {}
        }
        Ok(())
    }

    fn begin(&mut self, part: Part, keyword: &str) -> Result<()> {
        if let Some(open) = &self.current {
            let message = format!(
                "*{keyword} within {}, which has no end",
                excerpt(&open.name)
            );
            return Err(self.fault(message));
        }
        self.current = Some(part);
        Ok(())
    }

    /// Begin the data lines of a set. Return the index of these lines in `sets`.
    fn begin_set(&mut self, of: Of, name: &str, keyword: &Keyword) -> usize {
        let set = Set {
            of,
            name: name.to_owned(),
            instance: keyword.get("INSTANCE").map(str::to_owned),
            numbers: Vec::new(),
            ranges: Vec::new(),
            names: Vec::new(),
            is_nodes_of_elements: false,
            place: self.place.clone(),
        };
        let sets = &mut self.part().sets;
        sets.push(set);
        sets.len() - 1
    }

    fn last_set(&mut self) -> &mut Set {
        let set = self.part().sets.last_mut();
        set.expect("the keyword has begun a set")
    }

    /// Check that the last element has all its nodes.
    fn element_is_complete(&self) -> Result<()> {
        match (&self.pending[..], &self.data) {
            ([number, nodes @ ..], Data::Elements(kind, _)) => {
                let message = format!(
                    "element {number}: has {} nodes before this line, must have {}",
                    nodes.len(),
                    kind.nodes
                );
                Err(self.fault(message))
            }
            _ => Ok(()),
        }
    }

    fn read_data(&mut self, line: &str) -> Result<()> {
        let entries = || {
            line.split(',')
                .map(str::trim)
                .filter(|entry| !entry.is_empty())
        };
        match self.data {
            Data::Skipped => {}
            Data::Nodes(set) => self.read_node(line, set)?,
            Data::Elements(kind, set) => {
                for entry in entries() {
                    if self.pending.len() == kind.nodes + 1 {
                        let message = format!(
                            "element {}: has more than {} nodes",
                            self.pending[0], kind.nodes
                        );
                        return Err(self.fault(message));
                    }
                    let number = self.whole(entry)?;
                    self.pending.push(number);
                }
                if self.pending.len() == kind.nodes + 1 {
                    self.add_element(kind, set)?;
                }
            }
            Data::Set { is_generated: true } => {
                let numbers = entries().map(|entry| self.whole(entry));
                let numbers = numbers.collect::<Result<Vec<u64>>>()?;
                let (first, last, step) = match numbers[..] {
                    [first, last] => (first, last, 1),
                    [first, last, step] => (first, last, step),
                    _ => return Err(self.fault("GENERATE: a line is `first, last, step`")),
                };
                if step == 0 || last < first {
                    return Err(self.fault("GENERATE: needs first ≤ last and a step of at least 1"));
                }
                self.last_set().ranges.push([first, last, step]);
            }
            Data::Set { .. } => {
                for entry in entries() {
                    self.add_to_set(entry);
                }
            }
            // Only the first entry is used. The second entry names the face, or is an area.
            Data::Surface => {
                if let Some(entry) = entries().next() {
                    self.add_to_set(entry);
                }
            }
            Data::Position => self.read_position(line)?,
        }
        Ok(())
    }

    fn add_to_set(&mut self, entry: &str) {
        let set = self.last_set();
        match entry.parse() {
            Ok(number) => set.numbers.push(number),
            Err(_) => set.names.push(entry.trim_matches('"').to_owned()),
        }
    }

    fn whole(&self, entry: &str) -> Result<u64> {
        let number = entry.parse();
        number.map_err(|_| self.fault(format!("must be a whole number, is {}", excerpt(entry))))
    }

    fn real(&self, entry: &str) -> Result<f64> {
        // Fortran also writes numbers such as `1.D0`.
        let number = entry.replace(['d', 'D'], "e").parse();
        number.map_err(|_| self.fault(format!("must be a number, is {}", excerpt(entry))))
    }

    fn read_node(&mut self, line: &str, set: Option<usize>) -> Result<()> {
        let mut entries = line.split(',').map(str::trim);
        let number = self.whole(entries.next().unwrap_or_default())?;
        let mut place = [0.0; 3];
        for (x, entry) in place.iter_mut().zip(entries) {
            if !entry.is_empty() {
                *x = self.real(entry)?;
            }
        }
        let place =
            position(place).map_err(|message| self.fault(format!("node {number}: {message}")))?;
        let part = self.part();
        let index = part.nodes.len() as u32;
        if part.node_indices.insert(number, index).is_some() {
            return Err(self.fault(format!("node {number} is given twice")));
        }
        part.nodes.push(place);
        if let Some(set) = set {
            part.sets[set].numbers.push(number);
        }
        Ok(())
    }

    fn add_element(&mut self, kind: Kind, set: Option<usize>) -> Result<()> {
        let numbers = std::mem::take(&mut self.pending);
        let place = self.place.clone();
        let number = numbers[0];
        let part = self.part();
        let index = part.elements.len() as u32;
        let node = |number: &u64| part.node_indices.get(number).copied().ok_or(*number);
        let nodes: std::result::Result<Vec<u32>, u64> = numbers[1..].iter().map(node).collect();
        let nodes = nodes.map_err(|node| {
            place.fault(format!(
                "element {number}: there is no node {node} before it"
            ))
        })?;
        if part.element_indices.insert(number, index).is_some() {
            return Err(place.fault(format!("element {number} is given twice")));
        }
        part.elements.continue_in(&place.file);
        part.elements.push(kind, (number, place.line), nodes);
        if let Some(set) = set {
            part.sets[set].numbers.push(number);
        }
        Ok(())
    }

    fn read_position(&mut self, line: &str) -> Result<()> {
        let entries = line
            .split(',')
            .map(str::trim)
            .filter(|entry| !entry.is_empty());
        let numbers = entries.map(|entry| self.real(entry));
        let numbers = numbers.collect::<Result<Vec<f64>>>()?;
        let place = self.place.clone();
        let instance = self.instance.as_mut().expect("an instance is being read");
        instance.lines += 1;
        match (instance.lines, &numbers[..]) {
            (1, all) if all.len() <= 3 => {
                for (k, x) in all.iter().enumerate() {
                    instance.translation[k] = *x;
                }
            }
            (2, [a, b, c, d, e, f, angle]) => {
                let (from, to) = (Vector3::new(*a, *b, *c), Vector3::new(*d, *e, *f));
                let Some(axis) = Unit::try_new(to - from, 0.0) else {
                    return Err(place.fault("*INSTANCE: the axis of rotation has no length"));
                };
                instance.rotation = Rotation3::from_axis_angle(&axis, angle.to_radians());
                instance.pivot = from;
            }
            _ => {
                let message = "*INSTANCE: has a line with the translation `x, y, z`, then one with two points \
                               of an axis and an angle";
                return Err(place.fault(message));
            }
        }
        Ok(())
    }

    /// Move an instance to its position, and append it to the mesh.
    fn place_instance(&mut self, part: Part, instance: &Instance) -> Result<()> {
        let mut part = part;
        for node in &mut part.nodes {
            let moved = Vector3::from(*node) + instance.translation;
            let turned = if instance.lines > 1 {
                instance.rotation * (moved - instance.pivot) + instance.pivot
            } else {
                moved
            };
            *node = position(turned.into()).map_err(|message| self.fault(message))?;
        }
        self.append(part)
    }

    /// Append a part, or the model, with its sets to the mesh.
    fn append(&mut self, part: Part) -> Result<()> {
        let (first_node, first_element) = (self.mesh.nodes.len(), self.mesh.elements.len());
        if first_node + part.nodes.len() > LARGEST || first_element + part.elements.len() > LARGEST
        {
            return Err(self.fault("has more than 2³² nodes or elements"));
        }
        self.mesh.nodes.extend_from_slice(&part.nodes);
        self.mesh.elements.append(&part.elements, first_node as u32);
        let placed = Placed {
            name: part.name,
            node_indices: part.node_indices,
            element_indices: part.element_indices,
            first_node: first_node as u64,
            first_element: first_element as u64,
        };
        let is_instance = !placed.name.is_empty();
        let count = part.elements.len() as u64;
        if is_instance {
            let all = [placed.first_element, placed.first_element + count];
            let all = Runs::union([(&[all][..], 0)].into_iter());
            self.add_group(&placed.name, "instance", Members::Elements(all));
        }
        self.placed.push(placed);
        let own = self.placed.len() - 1;
        let mut known: FxHashMap<(Of, String), Runs> = FxHashMap::default();
        let mut order = Vec::new();
        for set in &part.sets {
            let members = self.members(set, own, &known)?;
            let key = (set.of, set.name.to_ascii_uppercase());
            if !known.contains_key(&key) {
                order.push((key.clone(), set.name.clone()));
            }
            let all = known.entry(key).or_default();
            *all = Runs::union([&*all, &members].map(|runs| (runs.ranges(), 0)).into_iter());
        }
        for (key, name) in order {
            let members = known.remove(&key).unwrap_or_default();
            let name = if is_instance {
                format!("{}.{name}", self.placed[own].name)
            } else {
                name
            };
            self.add_set(&name, key.0, members);
        }
        Ok(())
    }

    fn add_set(&mut self, name: &str, of: Of, members: Runs) {
        match of {
            Of::Nodes => self.add_group(name, "node set", Members::Nodes(members)),
            Of::Elements => self.add_group(name, "element set", Members::Elements(members)),
        }
    }

    fn add_group(&mut self, name: &str, kind: &'static str, members: Members) {
        self.mesh.groups.push(Group {
            name: Some(name.to_owned()),
            number: None,
            kind,
            members,
        });
    }

    /// Return the indices in the mesh of the members of a set. `known` holds the earlier sets of the part.
    fn members(
        &self,
        set: &Set,
        own: usize,
        known: &FxHashMap<(Of, String), Runs>,
    ) -> Result<Runs> {
        let what = match set.of {
            Of::Nodes => "node",
            Of::Elements => "element",
        };
        let instance = |name: &str| {
            let found = self
                .placed
                .iter()
                .find(|placed| placed.name.eq_ignore_ascii_case(name));
            found.ok_or_else(|| {
                set.place.fault(format!(
                    "set {}: there is no instance {}",
                    excerpt(&set.name),
                    excerpt(name)
                ))
            })
        };
        let home = match &set.instance {
            None => &self.placed[own],
            Some(name) => instance(name)?,
        };
        let index = |placed: &Placed, number: u64| {
            let (indices, first) = match set.of {
                Of::Nodes => (&placed.node_indices, placed.first_node),
                Of::Elements => (&placed.element_indices, placed.first_element),
            };
            indices.get(&number).map(|index| first + u64::from(*index))
        };
        let missing = |name: &dyn std::fmt::Display| {
            set.place.fault(format!(
                "set {}: there is no {what} {name}",
                excerpt(&set.name)
            ))
        };
        let mut members = Vec::new();
        let mut limit = 1024;
        for number in &set.numbers {
            members.push(index(home, *number).ok_or_else(|| missing(number))?);
        }
        let count = match set.of {
            Of::Nodes => home.node_indices.len(),
            Of::Elements => home.element_indices.len(),
        };
        let numbers = || match set.of {
            Of::Nodes => home.node_indices.keys(),
            Of::Elements => home.element_indices.keys(),
        };
        for [first, last, step] in &set.ranges {
            // Numbers without a node or element are skipped, as in Abaqus.
            if (last - first) / step < count as u64 {
                let range = (*first..=*last).step_by(usize::try_from(*step).unwrap_or(usize::MAX));
                members.extend(range.filter_map(|number| index(home, number)));
            } else {
                let chosen = numbers().filter(|number| {
                    (first..=last).contains(number) && (*number - first).is_multiple_of(*step)
                });
                members.extend(chosen.filter_map(|number| index(home, *number)));
            }
            compact(&mut members, &mut limit);
        }
        let of = if set.is_nodes_of_elements {
            Of::Elements
        } else {
            set.of
        };
        for name in &set.names {
            let found = self.find_set(of, name, set.instance.as_deref(), known);
            let qualified = || {
                // The name may be a number in an instance, such as `part-1-1.7`.
                let (name, number) = name.rsplit_once('.')?;
                let placed = instance(name).ok()?;
                index(placed, number.parse().ok()?)
            };
            match found {
                Some(found) if set.is_nodes_of_elements => {
                    for element in found.iter() {
                        let nodes = self.mesh.elements.nodes(element as usize);
                        members.extend(nodes.iter().map(|node| u64::from(*node)));
                    }
                }
                Some(found) => members.extend(found.iter()),
                None => members.push(
                    qualified()
                        .ok_or_else(|| missing(&format!("set {} before it", excerpt(name))))?,
                ),
            }
            compact(&mut members, &mut limit);
        }
        Ok(Runs::new(members))
    }

    /// Find the members of a set by its name, in `known` or among the groups of the mesh.
    fn find_set(
        &self,
        of: Of,
        name: &str,
        instance: Option<&str>,
        known: &FxHashMap<(Of, String), Runs>,
    ) -> Option<Runs> {
        let qualified = match instance {
            Some(instance) => format!("{instance}.{name}"),
            None => {
                if let Some(members) = known.get(&(of, name.to_ascii_uppercase())) {
                    return Some(members.clone());
                }
                name.to_owned()
            }
        };
        self.mesh.groups.iter().find_map(|group| {
            let same = group.name.as_ref()?.eq_ignore_ascii_case(&qualified);
            match (&group.members, of) {
                (Members::Nodes(members), Of::Nodes) if same => Some(members.clone()),
                (Members::Elements(members), Of::Elements) if same => Some(members.clone()),
                _ => None,
            }
        })
    }

    fn finish(mut self, path: &Path) -> Result<Mesh> {
        if let Some(open) = &self.current {
            let message = format!("part or instance {} has no end", excerpt(&open.name));
            return Err(fault(path, 0, message));
        }
        if self.placed.is_empty() && !self.parts.is_empty() && self.model.elements.is_empty() {
            return Err(fault(path, 0, "has parts but no *INSTANCE of one"));
        }
        let model = std::mem::take(&mut self.model);
        self.append(model)?;
        self.add_bare_names();
        Ok(self.mesh)
    }

    /// Add a group for each set name of the instances, with the members of all instances. A set of the
    /// assembly with this name takes precedence.
    fn add_bare_names(&mut self) {
        let prefixes: FxHashSet<String> = self
            .placed
            .iter()
            .map(|placed| placed.name.to_ascii_uppercase())
            .collect();
        let mut bare: FxHashMap<(Of, String), usize> = FxHashMap::default();
        let mut unions: Vec<(Of, String, Vec<Runs>)> = Vec::new();
        let mut taken: FxHashSet<(Of, String)> = FxHashSet::default();
        for group in &self.mesh.groups {
            let Some(name) = &group.name else { continue };
            let (of, members) = match &group.members {
                Members::Nodes(members) => (Of::Nodes, members),
                Members::Elements(members) => (Of::Elements, members),
            };
            taken.insert((of, name.to_ascii_uppercase()));
            let parts = name
                .match_indices('.')
                .map(|(at, _)| (&name[..at], &name[at + 1..]));
            let mut parts =
                parts.filter(|(prefix, _)| prefixes.contains(&prefix.to_ascii_uppercase()));
            if let Some((_, short)) = parts.next() {
                let index = *bare
                    .entry((of, short.to_ascii_uppercase()))
                    .or_insert_with(|| {
                        unions.push((of, short.to_owned(), Vec::new()));
                        unions.len() - 1
                    });
                unions[index].2.push(members.clone());
            }
        }
        for (of, name, all) in unions {
            if !taken.contains(&(of, name.to_ascii_uppercase())) {
                let members = Runs::union(all.iter().map(|runs| (runs.ranges(), 0)));
                self.add_set(&name, of, members);
            }
        }
    }
}
