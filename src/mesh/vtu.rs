//! Unstructured grids of VTK in XML: text, inline binary and appended data, uncompressed or compressed by
//! zlib.

use std::io::Read;
use std::path::Path;

use flate2::read::ZlibDecoder;
use indexmap::IndexMap;
use roxmltree::{Document, Node};
use rustc_hash::{FxHashMap, FxHashSet};

use super::kind::{Form, Kind};
use super::{Fault, Group, LARGEST_RATIO, Members, Mesh, Runs, fault, measure, position};
use crate::error::{Result, excerpt};

/// Maximum number of different values of an array. An array with more different values defines no groups.
const MOST_GROUPS: usize = 1000;

/// Return the type of the cells with the VTK cell type `number`. Also return their node order if it differs
/// from the order in [`super::kind`]. Return `None` for an unsupported type.
fn kind(number: i64) -> Option<(Kind, Option<&'static [usize]>)> {
    let (form, nodes) = match number {
        1 => (Form::Point, 1),
        3 => (Form::Line, 2),
        21 => (Form::Line, 3),
        5 => (Form::Triangle, 3),
        22 => (Form::Triangle, 6),
        8 | 9 => (Form::Quadrilateral, 4),
        23 => (Form::Quadrilateral, 8),
        28 => (Form::Quadrilateral, 9),
        10 => (Form::Tetrahedron, 4),
        24 => (Form::Tetrahedron, 10),
        11 | 12 => (Form::Hexahedron, 8),
        25 => (Form::Hexahedron, 20),
        29 => (Form::Hexahedron, 27),
        13 => (Form::Wedge, 6),
        26 => (Form::Wedge, 15),
        32 => (Form::Wedge, 18),
        14 => (Form::Pyramid, 5),
        27 => (Form::Pyramid, 13),
        _ => return None,
    };
    // The nodes of a pixel or voxel are numbered along x, then y and z.
    let order: Option<&[usize]> = match number {
        8 => Some(&[0, 1, 3, 2]),
        11 => Some(&[0, 1, 3, 2, 4, 5, 7, 6]),
        _ => None,
    };
    Some((Kind::new(form, nodes), order))
}

/// Read a mesh.
///
/// # Errors
/// If the bytes do not follow the format.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<Mesh> {
    read(path, bytes).map_err(|message| fault(path, 0, message))
}

fn read(path: &Path, bytes: &[u8]) -> Fault<Mesh> {
    // Raw appended data are not valid XML, so separate the appended data from the XML text.
    let mark = b"<AppendedData";
    let start = bytes.windows(mark.len()).position(|window| window == mark);
    let (text, appended) = match start {
        None => (bytes.to_vec(), None),
        Some(start) => {
            let head = [&bytes[..start], b"</VTKFile>"].concat();
            let tail = &bytes[start..];
            let begin = tail.iter().position(|byte| *byte == b'_');
            let begin = begin.ok_or("its appended data do not begin with `_`")?;
            let is_raw = tail[..begin].windows(5).any(|window| window == b"\"raw\"");
            (head, Some((&tail[begin + 1..], is_raw)))
        }
    };
    let text = String::from_utf8(text).map_err(|_| "is not UTF-8 text")?;
    let document = Document::parse(&text).map_err(|error| format!("is not XML: {error}"))?;
    let root = document.root_element();
    if root.attribute("type") != Some("UnstructuredGrid") {
        return Err("must be a VTKFile of the type UnstructuredGrid".to_owned());
    }
    let compressor = root.attribute("compressor").filter(|name| !name.is_empty());
    if let Some(name) = compressor.filter(|name| *name != "vtkZLibDataCompressor") {
        return Err(format!(
            "is compressed by {}; use zlib or no compression",
            excerpt(name)
        ));
    }
    let file = File {
        is_big: root.attribute("byte_order") == Some("BigEndian"),
        header: if root.attribute("header_type") == Some("UInt64") {
            8
        } else {
            4
        },
        is_compressed: compressor.is_some(),
        appended,
    };
    let mut mesh = Mesh::default();
    mesh.elements.continue_in(path);
    let mut groups = Groups::new();
    let pieces = root.descendants().filter(|node| node.has_tag_name("Piece"));
    for piece in pieces {
        file.read_piece(piece, &mut mesh, &mut groups)?;
    }
    let mut counts: FxHashMap<(bool, String), usize> = FxHashMap::default();
    for (of_nodes, array, _) in groups.keys() {
        *counts.entry((*of_nodes, array.clone())).or_default() += 1;
    }
    groups.retain(|(of_nodes, array, _), _| counts[&(*of_nodes, array.clone())] <= MOST_GROUPS);
    let arrays: FxHashSet<&String> = groups
        .keys()
        .filter(|(of_nodes, ..)| !of_nodes)
        .map(|(_, array, _)| array)
        .collect();
    let is_single = arrays.len() == 1;
    for ((of_nodes, array, value), members) in groups.iter() {
        mesh.groups.push(Group {
            name: Some(format!("{array}={value}")),
            number: Some(*value).filter(|_| is_single && !of_nodes),
            kind: if *of_nodes { "points" } else { "cells" },
            is_entity: false,
            members: if *of_nodes {
                Members::Nodes(members.clone())
            } else {
                Members::Elements(members.clone())
            },
        });
    }
    Ok(mesh)
}

/// Return an error if an attribute of a piece differs from `count`, the number of entries in the arrays. A
/// missing attribute is not an error.
fn has_count(piece: Node, attribute: &str, count: usize) -> Fault<()> {
    match piece.attribute(attribute) {
        Some(given) if given.trim().parse() != Ok(count) => Err(format!(
            "{attribute} of a piece is {}, but its arrays have {count}",
            excerpt(given)
        )),
        _ => Ok(()),
    }
}

/// Members of groups, by kind (true for nodes, false for elements), name of the array, and value.
type Groups = IndexMap<(bool, String, i64), Runs>;

/// Encoding of the arrays of a file.
struct File<'a> {
    is_big: bool,
    /// Size of a number in the header of a binary array, bytes.
    header: usize,
    is_compressed: bool,
    /// Appended data, and whether the data are raw.
    appended: Option<(&'a [u8], bool)>,
}

enum Numbers {
    Whole(Vec<i64>),
    Real(Vec<f64>),
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|child| child.has_tag_name(name))
}

fn arrays<'a, 'i>(node: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    node.children()
        .filter(|child| child.has_tag_name("DataArray"))
}

impl File<'_> {
    fn read_piece(&self, piece: Node, mesh: &mut Mesh, groups: &mut Groups) -> Fault<()> {
        let points = child(piece, "Points").and_then(|points| arrays(points).next());
        let points = match points {
            None => Vec::new(),
            Some(array) => match self.numbers(array)? {
                Numbers::Real(numbers) => numbers,
                Numbers::Whole(numbers) => numbers.iter().map(|x| *x as f64).collect(),
            },
        };
        let (first_node, first_element) = (mesh.nodes.len(), mesh.elements.len());
        if first_node + points.len() / 3 > u32::MAX as usize {
            return Err("has more than 2³² points".to_owned());
        }
        if !points.len().is_multiple_of(3) {
            return Err(format!(
                "its points have {} coordinates, not 3 each",
                points.len()
            ));
        }
        for (place, number) in points.chunks_exact(3).zip(0..) {
            let place = position([place[0], place[1], place[2]]);
            mesh.nodes
                .push(place.map_err(|message| format!("point {number}: {message}"))?);
        }
        let count = points.len() / 3;
        has_count(piece, "NumberOfPoints", count)?;
        let cells = child(piece, "Cells").ok_or("a piece has no Cells")?;
        let named = |name: &str| {
            let array = arrays(cells).find(|array| array.attribute("Name") == Some(name));
            match array.map(|array| self.numbers(array)).transpose()? {
                Some(Numbers::Whole(numbers)) => Ok(numbers),
                _ => Err(format!("Cells: needs whole numbers `{name}`")),
            }
        };
        let (connectivity, offsets, types) =
            (named("connectivity")?, named("offsets")?, named("types")?);
        if offsets.len() != types.len() {
            let message = format!(
                "Cells: has {} offsets and {} types",
                offsets.len(),
                types.len()
            );
            return Err(message);
        }
        has_count(piece, "NumberOfCells", types.len())?;
        let mut start = 0;
        for (cell, (end, number)) in offsets.iter().zip(&types).enumerate() {
            let Some((kind, order)) = kind(*number) else {
                let message = format!(
                    "cell {cell}: VTK cell type {number} is not supported; use first- or second-order cells"
                );
                return Err(message);
            };
            let end = usize::try_from(*end)
                .ok()
                .filter(|end| *end <= connectivity.len());
            let nodes = end.and_then(|end| connectivity.get(start..end));
            let Some(nodes) = nodes.filter(|nodes| nodes.len() == kind.nodes) else {
                let message = format!(
                    "cell {cell}: its entries of `offsets` and `connectivity`, from {start} on, must give {} points",
                    kind.nodes
                );
                return Err(message);
            };
            if let Some(node) = nodes
                .iter()
                .find(|node| usize::try_from(**node).is_ok_and(|node| node >= count) || **node < 0)
            {
                return Err(format!("cell {cell}: there is no point {node}"));
            }
            let index = |k: usize| (first_node as i64 + nodes[k]) as u32;
            let mut indices: Vec<u32> = match order {
                Some(order) => order.iter().map(|k| index(*k)).collect(),
                None => (0..nodes.len()).map(index).collect(),
            };
            // The manual and the programs of VTK disagree on which triangle of a wedge comes first. Swap the
            // triangles if the volume is negative.
            if kind == Kind::new(Form::Wedge, 6) {
                let places: Vec<[f64; 3]> = indices
                    .iter()
                    .map(|node| mesh.nodes[*node as usize])
                    .collect();
                if measure(kind, &places).size < 0.0 {
                    indices.rotate_left(3);
                }
            }
            let number = (first_element + cell) as u64;
            mesh.elements.push(kind, (number, 0), indices);
            start += kind.nodes;
        }
        let counts = [(false, "CellData", types.len()), (true, "PointData", count)];
        for (of_nodes, section, count) in counts {
            let first = if of_nodes { first_node } else { first_element };
            for array in child(piece, section).into_iter().flat_map(arrays) {
                self.add_groups(array, (of_nodes, count, first), groups)?;
            }
        }
        Ok(())
    }

    /// Add a group of cells or points for each distinct value of an array of whole numbers.
    fn add_groups(
        &self,
        array: Node,
        (of_nodes, count, first): (bool, usize, usize),
        groups: &mut Groups,
    ) -> Fault<()> {
        let name = array.attribute("Name").unwrap_or_default();
        let is_whole = array
            .attribute("type")
            .is_some_and(|kind| kind.contains("Int"));
        let is_single = matches!(array.attribute("NumberOfComponents"), None | Some("" | "1"));
        if !is_whole || !is_single {
            return Ok(());
        }
        let Numbers::Whole(values) = self.numbers(array)? else {
            return Ok(());
        };
        if values.len() != count {
            return Err(format!(
                "array {}: has {} values, must have {count}",
                excerpt(name),
                values.len()
            ));
        }
        let mut different = FxHashSet::default();
        for value in &values {
            different.insert(*value);
            if different.len() > MOST_GROUPS {
                // Add an empty group for each of these values. `read` then removes all groups of this array,
                // because their number exceeds the limit.
                for value in different {
                    groups
                        .entry((of_nodes, name.to_owned(), value))
                        .or_default();
                }
                return Ok(());
            }
        }
        for (index, value) in values.iter().enumerate() {
            let key = (of_nodes, name.to_owned(), *value);
            groups.entry(key).or_default().push((first + index) as u64);
        }
        Ok(())
    }

    /// Decode an array: text, binary data in the element, or binary data appended to the file.
    fn numbers(&self, array: Node) -> Fault<Numbers> {
        let name = array.attribute("Name").unwrap_or("Points");
        let words = |message: String| format!("array {}: {message}", excerpt(name));
        let kind = array.attribute("type").unwrap_or_default();
        let text = || array.text().unwrap_or_default();
        let source = match array.attribute("format") {
            Some("ascii") => return text_numbers(kind, text()).map_err(words),
            Some("binary") => Source {
                bytes: text().as_bytes(),
                is_raw: false,
                decoded: Vec::new(),
            },
            Some("appended") => {
                let offset = array
                    .attribute("offset")
                    .and_then(|offset| offset.parse().ok());
                let rest = self.appended.and_then(|(bytes, is_raw)| {
                    let bytes = bytes.get(offset?..)?;
                    let decoded = Vec::new();
                    Some(Source {
                        bytes,
                        is_raw,
                        decoded,
                    })
                });
                rest.ok_or_else(|| words("its offset is not in the appended data".to_owned()))?
            }
            _ => return Err(words("must be ascii, binary or appended".to_owned())),
        };
        let bytes = self.bytes(source).map_err(words)?;
        binary_numbers(kind, &bytes, self.is_big).map_err(words)
    }

    /// Return the decompressed bytes of a binary array, without its header.
    fn bytes(&self, mut source: Source) -> Fault<Vec<u8>> {
        if !self.is_compressed {
            let length = self.header_number(&mut source)?;
            return source.take(length);
        }
        let blocks = self.header_number(&mut source)?;
        let (size, last) = (
            self.header_number(&mut source)?,
            self.header_number(&mut source)?,
        );
        // `blocks` needs no check: the header has a size for each block, so the loop fails at the latest at
        // the end of the data.
        let mut sizes = Vec::new();
        for _ in 0..blocks {
            sizes.push(self.header_number(&mut source)?);
        }
        let mut all = Vec::new();
        for (block, compressed) in sizes.iter().enumerate() {
            let packed = source.take(*compressed)?;
            let is_last = block + 1 == blocks;
            let expected = if is_last && last > 0 { last } else { size };
            if expected > LARGEST_RATIO * (packed.len() + 1) {
                return Err(format!(
                    "a block of {compressed} bytes cannot hold {expected}"
                ));
            }
            let before = all.len();
            let decoder = ZlibDecoder::new(&packed[..]);
            let read = decoder.take(expected as u64 + 1).read_to_end(&mut all);
            read.map_err(|error| format!("its compressed data are damaged: {error}"))?;
            if all.len() - before != expected {
                return Err(format!("a compressed block must hold {expected} bytes"));
            }
        }
        Ok(all)
    }

    fn header_number(&self, source: &mut Source) -> Fault<usize> {
        let bytes = source.take(self.header)?;
        let mut wide = [0; 8];
        if self.is_big {
            wide[8 - bytes.len()..].copy_from_slice(&bytes);
            return usize::try_from(u64::from_be_bytes(wide)).map_err(|error| error.to_string());
        }
        wide[..bytes.len()].copy_from_slice(&bytes);
        usize::try_from(u64::from_le_bytes(wide)).map_err(|error| error.to_string())
    }
}

/// Raw or base-64 encoded bytes.
struct Source<'a> {
    bytes: &'a [u8],
    is_raw: bool,
    /// Bytes of the last decoded base-64 group, in reverse order, without the bytes that [`Source::take`] has
    /// already returned.
    decoded: Vec<u8>,
}

impl Source<'_> {
    /// Take the next `count` bytes; base-64 text is decoded.
    fn take(&mut self, count: usize) -> Fault<Vec<u8>> {
        let left = if self.is_raw {
            self.bytes.len()
        } else {
            self.bytes.len() / 4 * 3 + 3
        };
        if count > left {
            return Err(format!(
                "must have {count} bytes more, the file has {left} at most"
            ));
        }
        if self.is_raw {
            let (taken, rest) = self.bytes.split_at(count);
            self.bytes = rest;
            return Ok(taken.to_vec());
        }
        let mut taken = Vec::with_capacity(count);
        while taken.len() < count {
            if self.decoded.is_empty() {
                self.decode_group()?;
            }
            taken.extend(self.decoded.pop());
        }
        Ok(taken)
    }

    /// Decode the next four base-64 characters. The last characters may be `=`.
    fn decode_group(&mut self) -> Fault<()> {
        let (mut word, mut digits, mut padding) = (0_u32, 0, 0);
        while digits < 4 {
            let Some((character, rest)) = self.bytes.split_first() else {
                return Err("ends too early".to_owned());
            };
            self.bytes = rest;
            let digit = match character {
                b'A'..=b'Z' => character - b'A',
                b'a'..=b'z' => character - b'a' + 26,
                b'0'..=b'9' => character - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                b'=' if digits > 1 => {
                    padding += 1;
                    0
                }
                space if space.is_ascii_whitespace() => continue,
                _ => return Err("is not base 64".to_owned()),
            };
            word = word << 6 | u32::from(digit);
            digits += 1;
        }
        let bytes = word.to_be_bytes();
        self.decoded.extend(bytes[1..4 - padding].iter().rev());
        Ok(())
    }
}

/// Parse numbers of a type from text.
fn text_numbers(kind: &str, text: &str) -> Fault<Numbers> {
    let wrong = |word: &str| {
        format!(
            "must have numbers of the type {kind}, has {}",
            excerpt(word)
        )
    };
    let words = text.split_ascii_whitespace();
    if kind.contains("Float") {
        let numbers = words.map(|word| word.parse().map_err(|_| wrong(word)));
        return numbers.collect::<Fault<_>>().map(Numbers::Real);
    }
    let numbers = words.map(|word| word.parse().map_err(|_| wrong(word)));
    numbers.collect::<Fault<_>>().map(Numbers::Whole)
}

/// Convert bytes to numbers of a type.
fn binary_numbers(kind: &str, bytes: &[u8], is_big: bool) -> Fault<Numbers> {
    macro_rules! numbers {
        ($number:ty, $wide:ty) => {{
            let each = bytes.chunks_exact(size_of::<$number>()).map(|bytes| {
                let bytes = bytes.try_into().expect("the chunk has this size");
                let number = if is_big {
                    <$number>::from_be_bytes(bytes)
                } else {
                    <$number>::from_le_bytes(bytes)
                };
                number as $wide
            });
            each.collect()
        }};
    }
    Ok(match kind {
        "Float32" => Numbers::Real(numbers!(f32, f64)),
        "Float64" => Numbers::Real(numbers!(f64, f64)),
        "Int8" => Numbers::Whole(numbers!(i8, i64)),
        "UInt8" => Numbers::Whole(numbers!(u8, i64)),
        "Int16" => Numbers::Whole(numbers!(i16, i64)),
        "UInt16" => Numbers::Whole(numbers!(u16, i64)),
        "Int32" => Numbers::Whole(numbers!(i32, i64)),
        "UInt32" => Numbers::Whole(numbers!(u32, i64)),
        "Int64" => Numbers::Whole(numbers!(i64, i64)),
        "UInt64" => Numbers::Whole(numbers!(u64, i64)),
        _ => return Err(format!("has numbers of the type {}", excerpt(kind))),
    })
}
