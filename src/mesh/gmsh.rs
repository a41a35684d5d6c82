//! Meshes of Gmsh: MSH 2.2 and 4.1, text or binary.
//!
//! Text and binary files of version 4.1 hold the same numbers in the same order, so one reader serves both.
//! In version 2.2, the order of the numbers differs between text and binary files only in the section
//! `$Elements`.

use std::collections::hash_map::Entry;
use std::path::Path;

use rustc_hash::FxHashMap;

use super::kind::{Between, Form, Kind};
use super::{Group, Members, Mesh, Runs, fault, position};
use crate::error::{Error, Result, excerpt};

/// Node orders of Gmsh that differ from those of [`super::kind`]: for each node after the corners, the
/// corners between which the node lies.
mod orders {
    use super::Between;

    pub const TETRAHEDRON_10: &[Between] = &[&[0, 1], &[1, 2], &[0, 2], &[0, 3], &[2, 3], &[1, 3]];
    pub const HEXAHEDRON: &[Between] = &[
        &[0, 1],
        &[0, 3],
        &[0, 4],
        &[1, 2],
        &[1, 5],
        &[2, 3],
        &[2, 6],
        &[3, 7],
        &[4, 5],
        &[4, 7],
        &[5, 6],
        &[6, 7],
        &[0, 1, 2, 3],
        &[0, 1, 4, 5],
        &[0, 3, 4, 7],
        &[1, 2, 5, 6],
        &[2, 3, 6, 7],
        &[4, 5, 6, 7],
        &[0, 1, 2, 3, 4, 5, 6, 7],
    ];
    pub const WEDGE: &[Between] = &[
        &[0, 1],
        &[0, 2],
        &[0, 3],
        &[1, 2],
        &[1, 4],
        &[2, 5],
        &[3, 4],
        &[3, 5],
        &[4, 5],
        &[0, 1, 3, 4],
        &[0, 2, 3, 5],
        &[1, 2, 4, 5],
    ];
    pub const PYRAMID: &[Between] = &[
        &[0, 1],
        &[0, 3],
        &[0, 4],
        &[1, 2],
        &[1, 4],
        &[2, 3],
        &[2, 4],
        &[3, 4],
        &[0, 1, 2, 3],
    ];
}

/// Return the element type that has this number in Gmsh files, and the order of its nodes after the corners.
/// Return `None` for an unsupported type.
fn kind(number: i64) -> Option<(Kind, &'static [Between])> {
    let (form, nodes) = match number {
        15 => (Form::Point, 1),
        1 => (Form::Line, 2),
        8 => (Form::Line, 3),
        2 => (Form::Triangle, 3),
        9 => (Form::Triangle, 6),
        3 => (Form::Quadrilateral, 4),
        16 => (Form::Quadrilateral, 8),
        10 => (Form::Quadrilateral, 9),
        4 => (Form::Tetrahedron, 4),
        11 => (Form::Tetrahedron, 10),
        5 => (Form::Hexahedron, 8),
        17 => (Form::Hexahedron, 20),
        12 => (Form::Hexahedron, 27),
        6 => (Form::Wedge, 6),
        18 => (Form::Wedge, 15),
        13 => (Form::Wedge, 18),
        7 => (Form::Pyramid, 5),
        19 => (Form::Pyramid, 13),
        14 => (Form::Pyramid, 14),
        _ => return None,
    };
    let kind = Kind::new(form, nodes);
    let order = match form {
        Form::Tetrahedron => orders::TETRAHEDRON_10,
        Form::Hexahedron => orders::HEXAHEDRON,
        Form::Wedge => orders::WEDGE,
        Form::Pyramid => orders::PYRAMID,
        _ => kind.between(),
    };
    Some((kind, &order[..kind.between().len()]))
}

/// Read a mesh.
///
/// # Errors
/// If the bytes do not follow the format.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<Mesh> {
    let mut file = File {
        cursor: Cursor {
            path,
            bytes,
            at: 0,
            line: 1,
            encoding: Encoding::Text,
        },
        version: 0,
        mesh: Mesh::default(),
        indices: FxHashMap::default(),
        names: FxHashMap::default(),
        physical: FxHashMap::default(),
        groups: Grouping::default(),
        entities: Grouping::default(),
    };
    file.mesh.elements.continue_in(path);
    while let Some(section) = file.cursor.section()? {
        file.read_section(section)?;
    }
    file.finish()
}

/// Reader of a file, with the data that have been read.
struct File<'a> {
    cursor: Cursor<'a>,
    /// Major version of the format, 2 or 4; 0 before the version is known.
    version: u32,
    mesh: Mesh,
    /// Indices of nodes by their tags.
    indices: FxHashMap<u64, u32>,
    /// Names of physical groups by dimension and tag.
    names: FxHashMap<(i64, i64), String>,
    /// Tags of the physical groups of an entity, by the dimension and the tag of the entity.
    physical: FxHashMap<(i64, i64), Vec<i64>>,
    /// Elements of physical groups.
    groups: Grouping,
    /// Elements of geometrical entities.
    entities: Grouping,
}

/// Elements grouped by dimension and tag. Groups and elements have the order of the file.
#[derive(Default)]
struct Grouping {
    groups: Vec<((i64, i64), Runs)>,
    indices: FxHashMap<(i64, i64), usize>,
}

impl Grouping {
    fn add(&mut self, dimension: usize, tag: i64, element: u64) {
        let key = (dimension as i64, tag);
        let groups = &mut self.groups;
        let index = *self.indices.entry(key).or_insert_with(|| {
            groups.push((key, Runs::default()));
            groups.len() - 1
        });
        groups[index].1.push(element);
    }
}

impl File<'_> {
    fn read_section(&mut self, section: &str) -> Result<()> {
        if section == "MeshFormat" {
            self.read_format()?;
        } else if self.version == 0 {
            return Err(self
                .cursor
                .fault("a mesh of Gmsh starts with `$MeshFormat`"));
        } else {
            match (section, self.version) {
                ("PhysicalNames", _) => self.read_names()?,
                ("Entities", 4) => self.read_entities()?,
                ("PartitionedEntities", _) => {
                    let message = "is partitioned; save the mesh in one piece";
                    return Err(self.cursor.fault(message));
                }
                ("Nodes", 2) => self.read_nodes_2()?,
                ("Nodes", _) => self.read_nodes_4()?,
                ("Elements", 2) => self.read_elements_2()?,
                ("Elements", _) => self.read_elements_4()?,
                _ => return self.cursor.skip_section(section),
            }
        }
        self.cursor.end_of_section(section)
    }

    fn read_format(&mut self) -> Result<()> {
        let version = self.cursor.token()?;
        let [binary, size] = [self.cursor.text_number()?, self.cursor.text_number()?];
        self.version = match version {
            _ if version == "2" || version.starts_with("2.") => 2,
            "4.1" => 4,
            _ => {
                let message = format!(
                    "MSH version {} is not known; save the mesh as version 4.1 or 2.2",
                    excerpt(version)
                );
                return Err(self.cursor.fault(message));
            }
        };
        if size != 8 {
            let message = format!("numbers have {size} bytes, must have 8");
            return Err(self.cursor.fault(message));
        }
        if binary == 1 {
            self.cursor.rest_of_line();
            let mark = self.cursor.take::<4>()?;
            let is_big = match (i32::from_le_bytes(mark), i32::from_be_bytes(mark)) {
                (1, _) => false,
                (_, 1) => true,
                _ => {
                    let message = "the number after the format must be 1 in a binary file; a transfer as text \
                                   damages binary files";
                    return Err(self.cursor.fault(message));
                }
            };
            self.cursor.encoding = Encoding::Binary { is_big };
        }
        Ok(())
    }

    /// Read the names of physical groups. These names are text even in binary files.
    fn read_names(&mut self) -> Result<()> {
        let count = self.cursor.text_number()?;
        for _ in 0..count {
            let [dimension, tag] = [self.cursor.text_number()?, self.cursor.text_number()?];
            let line = self.cursor.line;
            let rest = self.cursor.rest_of_line();
            let name = std::str::from_utf8(rest).ok().and_then(|rest| {
                let quoted = rest.trim().strip_prefix('"')?;
                quoted.strip_suffix('"')
            });
            let Some(name) = name else {
                let message = "a physical name is `dimension tag \"name\"`";
                return Err(fault(self.cursor.path, line, message));
            };
            self.names.insert((dimension, tag), name.to_owned());
        }
        Ok(())
    }

    fn read_entities(&mut self) -> Result<()> {
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = self.cursor.size()?;
        }
        for (dimension, count) in counts.into_iter().enumerate() {
            for _ in 0..count {
                let tag = self.cursor.int()?;
                // The position of a point, or two corners of a bounding box.
                for _ in 0..if dimension == 0 { 3 } else { 6 } {
                    self.cursor.real()?;
                }
                let mut physical = Vec::new();
                for _ in 0..self.cursor.size()? {
                    // The sign is the orientation, which is not needed.
                    physical.push(self.cursor.int()?.abs());
                }
                if dimension > 0 {
                    for _ in 0..self.cursor.size()? {
                        self.cursor.int()?;
                    }
                }
                if !physical.is_empty() {
                    self.physical.insert((dimension as i64, tag), physical);
                }
            }
        }
        Ok(())
    }

    fn add_node(&mut self, tag: u64, place: [f64; 3]) -> Result<()> {
        let index = u32::try_from(self.mesh.nodes.len());
        let Ok(index) = index else {
            return Err(self.cursor.fault("has more than 2³² nodes"));
        };
        if self.indices.insert(tag, index).is_some() {
            return Err(self.cursor.fault(format!("node {tag} is given twice")));
        }
        let place = position(place);
        let place = place.map_err(|message| self.cursor.fault(format!("node {tag}: {message}")))?;
        self.mesh.nodes.push(place);
        Ok(())
    }

    fn read_nodes_2(&mut self) -> Result<()> {
        let count = self.cursor.count_line()?;
        for _ in 0..count {
            let tag = self.cursor.int()? as u64;
            let line = self.cursor.line;
            let place = [
                self.cursor.real()?,
                self.cursor.real()?,
                self.cursor.real()?,
            ];
            self.cursor.is_on_line(line, "node", tag)?;
            self.cursor.end_of_line("node", tag)?;
            self.add_node(tag, place)?;
        }
        Ok(())
    }

    fn read_nodes_4(&mut self) -> Result<()> {
        let blocks = self.cursor.size()?;
        for _ in 0..3 {
            self.cursor.size()?;
        }
        let mut tags = Vec::new();
        for _ in 0..blocks {
            let dimension = self.cursor.int()?;
            self.cursor.int()?;
            let is_parametric = self.cursor.int()? != 0;
            let count = self.cursor.size()?;
            tags.clear();
            for _ in 0..count {
                tags.push(self.cursor.size()?);
            }
            for tag in &tags {
                let x = self.cursor.real()?;
                let line = self.cursor.line;
                let place = [x, self.cursor.real()?, self.cursor.real()?];
                if is_parametric {
                    for _ in 0..dimension {
                        self.cursor.real()?;
                    }
                }
                self.cursor.is_on_line(line, "node", *tag)?;
                self.cursor.end_of_line("node", *tag)?;
                self.add_node(*tag, place)?;
            }
        }
        Ok(())
    }

    /// Return the element type with this number. Also return, for each node in VTK's order (see
    /// [`super::kind`]), the position of this node in Gmsh's order.
    fn kind(&self, number: i64) -> Result<(Kind, Vec<usize>)> {
        let Some((kind, order)) = kind(number) else {
            let message = format!(
                "Gmsh element type {number} is not supported; use first- or second-order elements"
            );
            return Err(self.cursor.fault(message));
        };
        Ok((kind, kind.permutation(order)))
    }

    /// Return the index of a node of an element.
    fn node(&self, element: u64, tag: u64) -> Result<u32> {
        self.indices.get(&tag).copied().ok_or_else(|| {
            let message =
                format!("element {element}: node {tag} is not defined before this element");
            self.cursor.fault(message)
        })
    }

    /// Append an element. `nodes` are the indices of its nodes, in the order of the file.
    fn add_element(&mut self, (kind, order): &(Kind, Vec<usize>), number: u64, nodes: &[u32]) {
        let line = match self.cursor.encoding {
            Encoding::Text => self.cursor.line,
            Encoding::Binary { .. } => 0,
        };
        let nodes = order.iter().map(|position| nodes[*position]);
        self.mesh.elements.push(*kind, (number, line), nodes);
    }

    /// Add the last element to its geometrical entity and to its physical groups. A tag 0 means that there is
    /// no entity or no group.
    fn add_to_groups(&mut self, dimension: usize, entity: i64, physical: &[i64]) {
        let last = self.mesh.elements.len() as u64 - 1;
        if entity != 0 {
            self.entities.add(dimension, entity, last);
        }
        for tag in physical.iter().filter(|tag| **tag != 0) {
            self.groups.add(dimension, *tag, last);
        }
    }

    fn read_elements_2(&mut self) -> Result<()> {
        let count = self.cursor.count_line()?;
        let is_binary = matches!(self.cursor.encoding, Encoding::Binary { .. });
        let mut read = 0;
        let mut nodes = Vec::new();
        let mut types = FxHashMap::default();
        while read < count {
            let mut number = if is_binary { 0 } else { self.cursor.int()? };
            let line = self.cursor.line;
            let type_number = self.cursor.int()?;
            let following = if is_binary { self.cursor.int()? } else { 1 };
            let tags = self.cursor.int()?;
            if following < 1 || tags < 0 {
                let message = format!("elements with {tags} tags in a block of {following}");
                return Err(self.cursor.fault(message));
            }
            let found = &*match types.entry(type_number) {
                Entry::Occupied(known) => known.into_mut(),
                Entry::Vacant(new) => new.insert(self.kind(type_number)?),
            };
            for _ in 0..following {
                if is_binary {
                    number = self.cursor.int()?;
                }
                // The first tag is the physical group, the second tag is the geometrical entity.
                let (mut physical, mut entity) = (0, 0);
                for k in 0..tags {
                    let tag = self.cursor.int()?;
                    match k {
                        0 => physical = tag.abs(),
                        1 => entity = tag.abs(),
                        _ => {}
                    }
                }
                nodes.clear();
                for _ in 0..found.0.nodes {
                    let tag = self.cursor.int()?;
                    self.cursor.is_on_line(line, "element", number as u64)?;
                    nodes.push(self.node(number as u64, tag as u64)?);
                }
                self.cursor.end_of_line("element", number as u64)?;
                if !self.repeats_last_element(found, &nodes) {
                    self.add_element(found, number as u64, &nodes);
                }
                self.add_to_groups(found.0.dimension(), entity, &[physical]);
            }
            read += following;
        }
        Ok(())
    }

    /// Test whether an element repeats the last element. In version 2 of the format, an element with several
    /// physical groups occurs once per group, each time under another number.
    fn repeats_last_element(&self, (kind, order): &(Kind, Vec<usize>), nodes: &[u32]) -> bool {
        let elements = &self.mesh.elements;
        let Some(last) = elements.len().checked_sub(1) else {
            return false;
        };
        let permuted = order.iter().map(|position| nodes[*position]);
        elements.kind(last) == *kind && permuted.eq(elements.nodes(last).iter().copied())
    }

    fn read_elements_4(&mut self) -> Result<()> {
        let blocks = self.cursor.size()?;
        for _ in 0..3 {
            self.cursor.size()?;
        }
        let mut nodes = Vec::new();
        for _ in 0..blocks {
            let [dimension, tag] = [self.cursor.int()?, self.cursor.int()?];
            let found = self.cursor.int()?;
            let found = self.kind(found)?;
            let count = self.cursor.size()?;
            let physical = self.physical.get(&(dimension, tag)).cloned();
            let physical = physical.unwrap_or_default();
            for _ in 0..count {
                let number = self.cursor.size()?;
                let line = self.cursor.line;
                nodes.clear();
                for _ in 0..found.0.nodes {
                    let tag = self.cursor.size()?;
                    self.cursor.is_on_line(line, "element", number)?;
                    nodes.push(self.node(number, tag)?);
                }
                self.cursor.end_of_line("element", number)?;
                self.add_element(&found, number, &nodes);
                self.add_to_groups(found.0.dimension(), tag, &physical);
            }
        }
        Ok(())
    }

    fn finish(mut self) -> Result<Mesh> {
        // In a dimension without physical groups, the geometrical entities become the groups.
        let physical = self.groups.groups;
        let mut has_groups = [false; 4];
        for ((dimension, _), _) in &physical {
            has_groups[*dimension as usize] = true;
        }
        let mut entities = self.entities.groups;
        entities.retain(|((dimension, _), _)| !has_groups[*dimension as usize]);
        let entities = entities.into_iter().map(|group| (true, group));
        let physical = physical.into_iter().map(|group| (false, group));
        for (is_entity, (key, elements)) in entities.chain(physical) {
            // The names in the file are names of physical groups.
            let name = self.names.get(&key).filter(|_| !is_entity);
            self.mesh.groups.push(Group {
                name: name.cloned(),
                number: Some(key.1),
                kind: match key.0 {
                    0 => "point",
                    1 => "curve",
                    2 => "surface",
                    _ => "volume",
                },
                is_entity,
                members: Members::Elements(elements),
            });
        }
        Ok(self.mesh)
    }
}

/// Encoding of the numbers of a file.
#[derive(Clone, Copy)]
enum Encoding {
    Text,
    Binary { is_big: bool },
}

/// Position in the bytes of a file.
struct Cursor<'a> {
    path: &'a Path,
    bytes: &'a [u8],
    at: usize,
    line: u64,
    encoding: Encoding,
}

impl<'a> Cursor<'a> {
    /// Return an error at the current position.
    fn fault(&self, message: impl std::fmt::Display) -> Error {
        let line = match self.encoding {
            Encoding::Text => self.line,
            Encoding::Binary { .. } => 0,
        };
        fault(self.path, line, message)
    }

    fn skip_space(&mut self) {
        while let Some(byte) = self
            .bytes
            .get(self.at)
            .filter(|byte| byte.is_ascii_whitespace())
        {
            self.line += u64::from(*byte == b'\n');
            self.at += 1;
        }
    }

    /// Read the next word.
    fn token(&mut self) -> Result<&'a str> {
        self.skip_space();
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(u8::is_ascii_whitespace);
        let token = &rest[..end.unwrap_or(rest.len())];
        if token.is_empty() {
            return Err(self.fault("the file ends too early"));
        }
        self.at += token.len();
        std::str::from_utf8(token).map_err(|_| self.fault("is not UTF-8 text"))
    }

    /// Return an error if the last word that was read is not on the line `line`. The node or element `number`
    /// begins on this line. `what` is `"node"` or `"element"`. In binary files, the line number does not
    /// change.
    fn is_on_line(&self, line: u64, what: &str, number: u64) -> Result<()> {
        if self.line == line {
            return Ok(());
        }
        let message = format!("{what} {number}: its line has too few numbers");
        Err(fault(self.path, line, message))
    }

    /// Return an error if further words follow on the line of the node or element `number`. `what` is
    /// `"node"` or `"element"`. Binary files have no lines, so for these files there is no error.
    fn end_of_line(&self, what: &str, number: u64) -> Result<()> {
        let is_text = matches!(self.encoding, Encoding::Text);
        let mut rest = self.bytes[self.at..].iter();
        let next = rest.find(|byte| **byte == b'\n' || !byte.is_ascii_whitespace());
        if is_text && next.is_some_and(|byte| *byte != b'\n') {
            return Err(self.fault(format!("{what} {number}: its line has too many numbers")));
        }
        Ok(())
    }

    /// Read the rest of the line, without the line break.
    fn rest_of_line(&mut self) -> &'a [u8] {
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(|byte| *byte == b'\n');
        self.at += end.map_or(rest.len(), |end| end + 1);
        let line = &rest[..end.unwrap_or(rest.len())];
        self.line += u64::from(end.is_some());
        line
    }

    /// Read the name of the next section; `None` at the end of the file.
    fn section(&mut self) -> Result<Option<&'a str>> {
        self.skip_space();
        if self.at == self.bytes.len() {
            return Ok(None);
        }
        let word = self.token()?;
        match word.strip_prefix('$') {
            Some(name) => {
                self.rest_of_line();
                Ok(Some(name))
            }
            None => {
                let message = format!(
                    "a section such as `$Nodes` must begin here, found {}",
                    excerpt(word)
                );
                Err(self.fault(message))
            }
        }
    }

    fn end_of_section(&mut self, section: &str) -> Result<()> {
        let word = self.token()?;
        if word.strip_prefix("$End") == Some(section) {
            return Ok(());
        }
        let message = format!("must be `$End{section}`, is {}", excerpt(word));
        Err(self.fault(message))
    }

    fn skip_section(&mut self, section: &str) -> Result<()> {
        let end = format!("$End{section}");
        let rest = &self.bytes[self.at..];
        // Search for the first byte of `end`, because comparisons at every byte of the file are slow.
        let mut places = rest.iter().enumerate().filter(|(_, byte)| **byte == b'$');
        let found = places.find(|(at, _)| rest[*at..].starts_with(end.as_bytes()));
        let Some((at, _)) = found else {
            return Err(self.fault(format!("`{end}` is missing")));
        };
        self.line += rest[..at].iter().filter(|byte| **byte == b'\n').count() as u64;
        self.at += at + end.len();
        Ok(())
    }

    /// Read the next N bytes.
    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let bytes = self.bytes[self.at..].first_chunk();
        let bytes = *bytes.ok_or_else(|| self.fault("the file ends too early"))?;
        self.at += N;
        Ok(bytes)
    }

    /// Read an integer that is text even in binary files.
    fn text_number(&mut self) -> Result<i64> {
        let word = self.token()?;
        word.parse()
            .map_err(|_| self.fault(format!("must be a whole number, is {}", excerpt(word))))
    }

    /// Read the number of entries of a section in a file of version 2. The number is text even in binary
    /// files. In binary files, the rest of the line is skipped too.
    fn count_line(&mut self) -> Result<i64> {
        let count = self.text_number()?;
        if matches!(self.encoding, Encoding::Binary { .. }) {
            self.rest_of_line();
        }
        Ok(count)
    }

    /// Read an `int`.
    fn int(&mut self) -> Result<i64> {
        match self.encoding {
            Encoding::Text => self.text_number(),
            Encoding::Binary { is_big } => {
                let bytes = self.take()?;
                let number = if is_big {
                    i32::from_be_bytes(bytes)
                } else {
                    i32::from_le_bytes(bytes)
                };
                Ok(i64::from(number))
            }
        }
    }

    /// Read a `size_t`. If the number is a count of entries, it may be larger than the number of entries in
    /// the file. In this case, reading the entries fails at the end of the file. The end is always reached,
    /// because each entry occupies at least one byte.
    fn size(&mut self) -> Result<u64> {
        match self.encoding {
            Encoding::Text => {
                let number = self.text_number()?;
                u64::try_from(number)
                    .map_err(|_| self.fault(format!("must not be negative, is {number}")))
            }
            Encoding::Binary { is_big } => {
                let bytes = self.take()?;
                Ok(if is_big {
                    u64::from_be_bytes(bytes)
                } else {
                    u64::from_le_bytes(bytes)
                })
            }
        }
    }

    /// Read a `double`.
    fn real(&mut self) -> Result<f64> {
        match self.encoding {
            Encoding::Text => {
                let word = self.token()?;
                word.parse()
                    .map_err(|_| self.fault(format!("must be a number, is {}", excerpt(word))))
            }
            Encoding::Binary { is_big } => {
                let bytes = self.take()?;
                Ok(if is_big {
                    f64::from_be_bytes(bytes)
                } else {
                    f64::from_le_bytes(bytes)
                })
            }
        }
    }
}
