//! Meshes of finite elements in the formats of other programs. Elements become points.
//!
//! A count in a file can be wrong. A reader therefore either reads the counted entries one by one, or
//! compares the count with the size of the file before it allocates memory for the entries. A damaged file
//! needs no more memory than a valid file of the same size.

mod abaqus;
mod exodus;
mod gmsh;
pub mod kind;
pub mod measure;
mod netcdf;
mod runs;
mod vtu;

use std::fmt;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

pub use kind::{Form, Kind};
pub use measure::{Measure, measure};
pub use runs::Runs;

use crate::error::{Error, Result, excerpt};
use crate::message::nearest;
use kind::KINDS;

/// Kind of a group in an Exodus file: elements of one type.
pub const BLOCK: &str = "block";

/// Kind of a group that an Exodus file defines as faces of elements. The mesh stores the elements that have
/// these faces, not the faces.
pub const SIDE_SET: &str = "side set";

/// Largest number of group names that a message lists.
const MOST_LISTED: usize = 8;

/// A file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Gmsh 2.2 and 4.1, text or binary.
    Gmsh,
    /// An input file of Abaqus.
    Abaqus,
    /// An unstructured grid of VTK in XML.
    Vtu,
    /// Exodus II in netCDF.
    Exodus,
}

/// Endings of file names, with their formats.
const ENDINGS: [(&str, Format); 7] = [
    ("msh", Format::Gmsh),
    ("inp", Format::Abaqus),
    ("vtu", Format::Vtu),
    ("exo", Format::Exodus),
    ("ex2", Format::Exodus),
    ("e", Format::Exodus),
    ("g", Format::Exodus),
];

impl Format {
    /// Return the format of a file from the ending of its name; `None` for an unknown ending.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?.to_str()?;
        let same = |(known, _): &&(&str, Format)| known.eq_ignore_ascii_case(ending);
        ENDINGS.iter().find(same).map(|(_, format)| *format)
    }

    /// Return the known endings, for a message.
    pub fn endings() -> String {
        ENDINGS.map(|(ending, _)| format!("`.{ending}`")).join(", ")
    }
}

/// A mesh.
#[derive(Debug, Default)]
pub struct Mesh {
    /// Positions of the nodes, in the units of the file.
    pub nodes: Vec<[f64; 3]>,
    /// The elements, in the order of the file.
    pub elements: Elements,
    /// Volumes that the file gives for single-node elements, by the index of the element, in the units of the
    /// file. For an element without such a volume, the entry is 0. At the end of the list, such entries may
    /// be missing.
    volumes: Vec<f64>,
    /// Named or numbered groups of elements and of nodes.
    pub groups: Vec<Group>,
    /// Whether names of groups are matched without regard to case.
    pub ignores_case: bool,
    /// Names of groups that cannot be read, each with the error message for a deck that uses the group.
    unsupported: Vec<(String, String)>,
}

/// Elements of all types, in the order of the file.
#[derive(Debug, Clone, Default)]
pub struct Elements {
    kinds: Vec<u8>,
    starts: Vec<usize>,
    nodes: Vec<u32>,
    numbers: Vec<u64>,
    /// Line number of each element in its file, from 1. The number is 0 if the reader does not know the line,
    /// as in VTU, Exodus and binary Gmsh files.
    lines: Vec<u32>,
    /// Files of the elements, each with the index of its first element.
    files: Vec<(usize, PathBuf)>,
}

impl Elements {
    /// Append an element. `nodes` are the indices of its nodes, in the order that the module [`kind`]
    /// defines.
    fn push(
        &mut self,
        kind: Kind,
        (number, line): (u64, u64),
        nodes: impl IntoIterator<Item = u32>,
    ) {
        self.kinds.push(kind.index() as u8);
        self.starts.push(self.nodes.len());
        self.nodes.extend(nodes);
        self.numbers.push(number);
        self.lines.push(u32::try_from(line).unwrap_or(0));
    }

    /// Set the file of the elements that are appended next.
    fn continue_in(&mut self, file: &Path) {
        if self.files.last().is_none_or(|(_, last)| last != file) {
            self.files.push((self.len(), file.to_owned()));
        }
    }

    /// Append all elements of another list. In the combined mesh, the nodes of these elements begin at the
    /// index `first_node`.
    fn append(&mut self, other: &Self, first_node: u32) {
        let (elements, nodes) = (self.len(), self.nodes.len());
        self.kinds.extend_from_slice(&other.kinds);
        self.starts
            .extend(other.starts.iter().map(|start| start + nodes));
        self.nodes
            .extend(other.nodes.iter().map(|node| node + first_node));
        self.numbers.extend_from_slice(&other.numbers);
        self.lines.extend_from_slice(&other.lines);
        let files = other.files.iter();
        self.files
            .extend(files.map(|(first, file)| (first + elements, file.clone())));
    }

    /// Return the number of elements.
    pub fn len(&self) -> usize {
        self.kinds.len()
    }

    /// Test whether there are no elements.
    pub fn is_empty(&self) -> bool {
        self.kinds.is_empty()
    }

    /// Return the type of an element.
    pub fn kind(&self, element: usize) -> Kind {
        KINDS[usize::from(self.kinds[element])]
    }

    /// Return the indices of an element's nodes.
    pub fn nodes(&self, element: usize) -> &[u32] {
        let start = self.starts[element];
        &self.nodes[start..start + self.kind(element).nodes]
    }

    /// Return the number that identifies an element in the file.
    pub fn number(&self, element: usize) -> u64 {
        self.numbers[element]
    }

    /// Return an error about an element, with file, line (if known), number and type.
    pub fn fault(&self, element: usize, message: impl fmt::Display) -> Error {
        let after = self.files.partition_point(|(first, _)| *first <= element);
        let file = self.files[after - 1].1.display();
        let line = match self.lines[element] {
            0 => String::new(),
            line => format!("{line}:"),
        };
        let (number, name) = (self.number(element), self.kind(element).name());
        Error::input(format!(
            "{file}:{line} element {number} ({name}): {message}"
        ))
    }
}

/// A group of elements or nodes.
#[derive(Debug)]
pub struct Group {
    /// Name of the group, if the file gives a name.
    pub name: Option<String>,
    /// Number of the group, if the file gives a number.
    pub number: Option<i64>,
    /// The format's term for this kind of group, such as `side set`.
    pub kind: &'static str,
    /// Whether the group is a geometrical entity. A deck can give a number without the kind of the group. If
    /// both an entity and another kind of group have this number, the number refers to the other kind.
    pub is_entity: bool,
    /// Members of the group.
    pub members: Members,
}

/// The members of a group.
#[derive(Debug)]
pub enum Members {
    /// Indices of elements.
    Elements(Runs),
    /// Indices of nodes.
    Nodes(Runs),
}

/// A name or number by which a deck refers to a group.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum GroupKey {
    /// The name of a group.
    Name(String),
    /// The number of a group.
    Number(i64),
}

impl fmt::Display for GroupKey {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Name(name) => formatter.write_str(&excerpt(name)),
            Self::Number(number) => write!(formatter, "{number}"),
        }
    }
}

impl Mesh {
    /// Return the volume that the file gives for a single-node element; `None` if the file gives no volume,
    /// and for other elements.
    pub fn volume(&self, element: usize) -> Option<f64> {
        self.volumes
            .get(element)
            .copied()
            .filter(|volume| *volume > 0.0 && self.elements.kind(element).form == Form::Point)
    }

    /// Test whether an element becomes a point in a problem with `dimension` dimensions.
    pub fn is_solid(&self, element: usize, dimension: usize) -> bool {
        self.elements.kind(element).dimension() == dimension || self.volume(element).is_some()
    }

    /// Return the largest dimension of a group's elements; 0 for a group of nodes.
    pub fn dimension(&self, group: &Group) -> usize {
        match &group.members {
            Members::Nodes(_) => 0,
            Members::Elements(elements) => {
                let each = elements
                    .iter()
                    .map(|k| self.elements.kind(k as usize).dimension());
                each.max().unwrap_or(0)
            }
        }
    }

    /// Find the group that `key` means, among the groups that `is_wanted` accepts.
    ///
    /// A key is a name or a number. The kind of the group may come before the name or number, such as in
    /// `side set 1`. A number without a kind means a geometrical entity only if all groups with this
    /// number are geometrical entities. If the key means several groups of one kind, return the first of
    /// these groups. If the key means no group, return `None`.
    ///
    /// # Errors
    /// If the key means groups of different kinds; the message lists these groups. Also if the key means a
    /// group that cannot be read.
    pub fn find(
        &self,
        key: &GroupKey,
        is_wanted: impl Fn(&Group) -> bool,
    ) -> std::result::Result<Option<&Group>, String> {
        let has_name = |group: &Group, name: &str, ignores_case: bool| {
            group
                .name
                .as_ref()
                .is_some_and(|own| own == name || (ignores_case && own.eq_ignore_ascii_case(name)))
        };
        let has_kind = |group: &Group, text: &str| {
            let rest = text.strip_prefix(group.kind);
            rest.and_then(|rest| rest.strip_prefix(' '))
                .is_some_and(|rest| {
                    let number = rest.parse().ok();
                    has_name(group, rest, self.ignores_case)
                        || (number.is_some() && group.number == number)
                })
        };
        if let GroupKey::Name(name) = key
            && let Some(message) = self.unsupported(name)
        {
            return Err(message.to_owned());
        }
        let all = |refers: &dyn Fn(&Group) -> bool| -> Vec<&Group> {
            let groups = self.groups.iter();
            groups
                .filter(|group| refers(group) && is_wanted(group))
                .collect()
        };
        let candidates = match key {
            GroupKey::Number(number) => {
                let mut found = all(&|group| group.number == Some(*number));
                if found.iter().any(|group| !group.is_entity) {
                    found.retain(|group| !group.is_entity);
                }
                found
            }
            GroupKey::Name(name) => {
                let exact = all(&|group| has_name(group, name, false));
                let exact = if exact.is_empty() && self.ignores_case {
                    all(&|group| has_name(group, name, true))
                } else {
                    exact
                };
                if exact.is_empty() {
                    all(&|group| has_kind(group, name))
                } else {
                    exact
                }
            }
        };
        let Some(first) = candidates.first() else {
            return Ok(None);
        };
        if candidates.iter().all(|group| group.kind == first.kind) {
            return Ok(Some(first));
        }
        let label = match key {
            GroupKey::Number(number) => number.to_string(),
            GroupKey::Name(name) => name.clone(),
        };
        let mut kinds: Vec<&str> = candidates.iter().map(|group| group.kind).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let full: Vec<String> = kinds
            .iter()
            .map(|kind| format!("\"{kind} {label}\""))
            .collect();
        Err(format!(
            "{key} stands for several groups; name one of them: {}",
            full.join(", ")
        ))
    }

    /// If the group `name` cannot be read, return its error message. Return `None` for other names. In
    /// `name`, the kind of the group may come before the name of the group.
    fn unsupported(&self, name: &str) -> Option<&str> {
        let kinds = ["node set ", "element set "];
        let bare = kinds.iter().find_map(|kind| name.strip_prefix(kind));
        let mut all = self.unsupported.iter();
        let found = all.find(|(own, _)| {
            let is_own = |name: &str| own.eq_ignore_ascii_case(name);
            is_own(name) || bare.is_some_and(is_own)
        });
        found.map(|(_, message)| message.as_str())
    }

    /// Return the name of each group that `wanted` accepts, or the number of a group without a name.
    pub fn names(&self, wanted: impl Fn(&Group) -> bool) -> Vec<String> {
        let groups = self.groups.iter().filter(|group| wanted(group));
        let name = |group: &Group| match (&group.name, group.number) {
            (Some(name), _) => Some(name.clone()),
            (None, number) => number.map(|number| number.to_string()),
        };
        groups.filter_map(name).collect()
    }
}

/// Return the end of a message about an unknown name: the nearest known name, and some of the known names.
pub fn suggestion(key: &GroupKey, known: &[String]) -> String {
    if known.is_empty() {
        return "; the mesh has no such groups".to_owned();
    }
    let near = match key {
        GroupKey::Name(name) => nearest(name, known.iter().map(String::as_str)),
        GroupKey::Number(_) => None,
    };
    let near = near.map_or(String::new(), |near| {
        format!("; did you mean {}?", excerpt(near))
    });
    let listed: Vec<&str> = known.iter().take(MOST_LISTED).map(String::as_str).collect();
    let more = if known.len() > MOST_LISTED {
        ", …"
    } else {
        ""
    };
    format!("{near} (known: {}{more})", listed.join(", "))
}

/// Read the bytes of a regular file. A pipe is rejected, because opening a pipe blocks until its other end is
/// opened. For an HDF5 file, only the first bytes are read, because the HDF5 library opens the file itself.
///
/// # Errors
/// If the file cannot be read.
pub fn load(path: &Path) -> std::io::Result<Vec<u8>> {
    if !std::fs::metadata(path)?.is_file() {
        return Err(std::io::Error::other("it is not a regular file"));
    }
    let mut file = File::open(path)?;
    let mut bytes = Vec::new();
    let head = netcdf::HDF5_SIGNATURE.len() as u64;
    (&mut file).take(head).read_to_end(&mut bytes)?;
    if bytes != netcdf::HDF5_SIGNATURE {
        file.read_to_end(&mut bytes)?;
    }
    Ok(bytes)
}

/// Read a mesh from the bytes of a file.
///
/// # Errors
/// If the bytes do not follow the format, or the mesh has no elements. The message gives the file, the line
/// (only for Abaqus files and text files of Gmsh) and the expected content.
pub fn parse(format: Format, path: &Path, bytes: &[u8]) -> Result<Mesh> {
    let mesh = match format {
        Format::Gmsh => gmsh::parse(path, bytes),
        Format::Abaqus => abaqus::parse(path, bytes),
        Format::Vtu => vtu::parse(path, bytes),
        Format::Exodus => exodus::parse(path, bytes),
    }?;
    if mesh.elements.is_empty() {
        return Err(fault(path, 0, "has no elements"));
    }
    Ok(mesh)
}

/// Return an error at a line of a file; without a line if `line` is 0.
fn fault(path: &Path, line: u64, message: impl fmt::Display) -> Error {
    let path = path.display();
    Error::input(match line {
        0 => format!("{path}: {message}"),
        line => format!("{path}:{line}: {message}"),
    })
}

/// Return the position of a node, or an error if a coordinate is so large that squared distances or volumes
/// could overflow.
fn position(place: [f64; 3]) -> std::result::Result<[f64; 3], String> {
    let near = |x: &f64| x.abs() <= FARTHEST;
    if place.iter().all(near) {
        return Ok(place);
    }
    let [x, y, z] = place;
    Err(format!(
        "a coordinate must be a number of at most {FARTHEST:e}, is one of {x:e}, {y:e}, {z:e}"
    ))
}

/// Largest allowed absolute value of a coordinate. Up to this value, squared distances stay far from
/// overflow.
const FARTHEST: f64 = 1e30;

/// Result with an error message that does not name the file.
type Fault<T> = std::result::Result<T, String>;

/// Upper limit of zlib's compression ratio: the decompressed content of a file is at most this ratio times
/// the file's size.
const LARGEST_RATIO: usize = 1100;
