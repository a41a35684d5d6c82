//! Input files of Abaqus: nodes, elements, sets, surfaces, parts, instances and included files.
//!
//! Keywords that generate or move nodes or elements are errors. All other keywords that do not describe the
//! mesh are skipped.

mod assembly;
mod names;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::{Rotation3, Unit, Vector3};
use rustc_hash::FxHashMap;

use super::kind::Kind;
use super::{Mesh, Runs, fault, load, position};
use crate::error::{Error, Result, excerpt};
use assembly::{Instance, MemberKind, Part, Placed, Set};
use names::{GENERATORS, Keyword, kind};

/// Largest nesting depth of included files.
const DEEPEST: usize = 16;

/// Largest number of included files. A file that is included several times counts each time.
const MOST_INCLUDED: usize = 1000;

/// Read a mesh and the files that it includes.
///
/// # Errors
/// If the lines of the files do not follow the format, or an included file cannot be read.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<Mesh> {
    let mut reader = Reader::default();
    reader.mesh.ignores_case = true;
    reader.read(path, bytes, 0)?;
    reader.finish(path)
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

/// Meaning of the data lines below a keyword.
#[derive(Clone, Copy, Default)]
enum Data {
    #[default]
    Skipped,
    /// Nodes, and the index in `Part::sets` of the set to which the nodes are added.
    Nodes(Option<usize>),
    /// Elements, and the index in `Part::sets` of the set to which the elements are added.
    Elements(Kind, Option<usize>),
    Set {
        is_generated: bool,
    },
    Surface,
    /// Names of surfaces.
    Surfaces,
    Position,
}

#[derive(Default)]
struct Reader {
    mesh: Mesh,
    /// Nodes, elements and sets outside of parts and instances.
    model: Part,
    parts: FxHashMap<String, Part>,
    /// Nodes, elements and sets of the part or instance that is being read.
    current: Option<Part>,
    instance: Option<Instance>,
    /// Position of `*ASSEMBLY` while the assembly is being read.
    assembly: Option<Place>,
    placed: Vec<Placed>,
    /// Members of the surfaces in `placed`. The key is the kind of the members and the name of the surface in
    /// capitals, such as `INSTANCE.NAME`.
    surfaces: FxHashMap<(MemberKind, String), Runs>,
    data: Data,
    /// Number of the element that is being read, then the node numbers that are already read for it.
    pending: Vec<u64>,
    included: usize,
    place: Place,
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

    /// Read an included file, as if its lines stood in the place of the keyword line that names the file.
    /// `from` is the file with this keyword line, and `input` is the `INPUT` parameter of the line.
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
                let set = set.map(|set| self.begin_set(MemberKind::Nodes, set, keyword));
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
                let set = set.map(|set| self.begin_set(MemberKind::Elements, set, keyword));
                self.data = Data::Elements(kind, set);
            }
            "NSET" | "ELSET" => {
                let of = if name == "NSET" {
                    MemberKind::Nodes
                } else {
                    MemberKind::Elements
                };
                let Some(set) = keyword.get(name) else {
                    return Err(self.fault(format!("*{name}: needs `{name}=name`")));
                };
                self.begin_set(of, set, keyword);
                if let (MemberKind::Nodes, Some(elements)) = (of, keyword.get("ELSET")) {
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
                    "ELEMENT" => MemberKind::Elements,
                    "NODE" => MemberKind::Nodes,
                    _ => return Ok(()),
                };
                let Some(set) = keyword.get("NAME") else {
                    return Ok(());
                };
                self.begin_set(of, set, keyword);
                self.last_set().is_surface = true;
                if keyword.get("CROP").is_some() {
                    let message =
                        "*SURFACE: CROP is not supported; list the elements of the surface";
                    self.leave_out_set(message);
                    return Ok(());
                }
                self.data = match keyword
                    .get("COMBINE")
                    .map(str::to_ascii_uppercase)
                    .as_deref()
                {
                    None => Data::Surface,
                    Some("UNION") => {
                        self.last_set().is_union = true;
                        Data::Surfaces
                    }
                    Some(other) => {
                        let message = format!(
                            "*SURFACE: COMBINE={} is not supported, only COMBINE=UNION is; list the elements of \
                             the surface",
                            excerpt(other).trim_matches('`')
                        );
                        self.leave_out_set(message);
                        Data::Skipped
                    }
                };
            }
            "ASSEMBLY" => {
                if let Some(open) = &self.current {
                    return Err(self.within(name, &open.name));
                }
                if self.assembly.is_some() {
                    return Err(self.fault("*ASSEMBLY within another *ASSEMBLY"));
                }
                self.assembly = Some(self.place.clone());
            }
            "END ASSEMBLY" => {
                if let Some(open) = &self.current {
                    return Err(self.within(name, &open.name));
                }
                if self.assembly.take().is_none() {
                    return Err(self.fault("*END ASSEMBLY without *ASSEMBLY"));
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
                // If the instance has no part, or its part has no mesh, the nodes and elements follow within
                // the instance.
                let part = self.parts.get(&wanted.to_ascii_uppercase()).cloned();
                let missing_part = part.is_none().then(|| wanted.to_owned());
                let part = Part {
                    name: keyword.get("NAME").unwrap_or(wanted).to_owned(),
                    ..part.unwrap_or_default()
                };
                self.begin(part, name)?;
                self.instance = Some(Instance {
                    missing_part,
                    place: self.place.clone(),
                    translation: Vector3::zeros(),
                    rotation: Rotation3::identity(),
                    pivot: Vector3::zeros(),
                    position_lines_read: 0,
                });
                self.data = Data::Position;
            }
            "END INSTANCE" => {
                let (Some(part), Some(instance)) = (self.current.take(), self.instance.take())
                else {
                    return Err(self.fault("*END INSTANCE without *INSTANCE"));
                };
                if let Some(wanted) = instance
                    .missing_part
                    .as_ref()
                    .filter(|_| part.nodes.is_empty())
                {
                    let message = if wanted.is_empty() {
                        "*INSTANCE: has neither `PART=` nor nodes of its own".to_owned()
                    } else {
                        format!(
                            "*INSTANCE: there is no part {}, and the instance has no nodes of its own",
                            excerpt(wanted)
                        )
                    };
                    return Err(instance.place.fault(message));
                }
                self.place_instance(part, &instance)?;
            }
            _ => {}
        }
        Ok(())
    }

    fn begin(&mut self, part: Part, keyword: &str) -> Result<()> {
        if let Some(open) = &self.current {
            return Err(self.within(keyword, &open.name));
        }
        self.current = Some(part);
        Ok(())
    }

    /// Return an error for a keyword within the part or instance `open`.
    fn within(&self, keyword: &str, open: &str) -> Error {
        let open = excerpt(open);
        self.fault(format!("*{keyword} within {open}, which has no end"))
    }

    /// Add an empty set to `Part::sets`, and return its index. The data lines that follow the keyword fill
    /// the set.
    fn begin_set(&mut self, of: MemberKind, name: &str, keyword: &Keyword) -> usize {
        let set = Set {
            of,
            name: name.to_owned(),
            instance: keyword.get("INSTANCE").map(str::to_owned),
            numbers: Vec::new(),
            ranges: Vec::new(),
            names: Vec::new(),
            is_nodes_of_elements: false,
            is_surface: false,
            is_union: false,
            unsupported: None,
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

    /// Skip the remaining data lines of the last set. Store an error with this message, which is reported if
    /// the set is used.
    fn leave_out_set(&mut self, message: impl std::fmt::Display) {
        let error = self.fault(message);
        self.last_set().unsupported = Some(error);
        self.data = Data::Skipped;
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
            Data::Set { .. } | Data::Surfaces => {
                for entry in entries() {
                    self.add_to_set(entry);
                }
            }
            // Only the first entry is used. The second entry names the face, or is an area.
            Data::Surface => match line.split(',').next().map_or("", str::trim) {
                "" => {
                    let message = "*SURFACE: a line must begin with an element, a node or a set; a blank entry, which \
                                   stands for the whole model, is not supported";
                    self.leave_out_set(message);
                }
                entry => self.add_to_set(entry),
            },
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
                "element {number}: node {node} is not defined before this element"
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
        instance.position_lines_read += 1;
        match (instance.position_lines_read, &numbers[..]) {
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
}
