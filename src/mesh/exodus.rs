//! Meshes in Exodus II files: blocks, node sets and side sets.

use std::path::Path;

use super::Fault;
use super::kind::{Between, Form, Kind};
use super::netcdf::Netcdf;
use super::{BLOCK, Group, Members, Mesh, Runs, SIDE_SET, fault, position};
use crate::error::{Result, excerpt};

/// Node orders of Exodus that differ from the orders of [`super::kind`]. An order has one entry for each node
/// that follows the corners. The entry lists the corners between which this node lies.
mod orders {
    use super::Between;

    pub const HEXAHEDRON_20: &[Between] = &[
        &[0, 1],
        &[1, 2],
        &[2, 3],
        &[3, 0],
        &[0, 4],
        &[1, 5],
        &[2, 6],
        &[3, 7],
        &[4, 5],
        &[5, 6],
        &[6, 7],
        &[7, 4],
    ];
    pub const HEXAHEDRON_27: &[Between] = &[
        &[0, 1],
        &[1, 2],
        &[2, 3],
        &[3, 0],
        &[0, 4],
        &[1, 5],
        &[2, 6],
        &[3, 7],
        &[4, 5],
        &[5, 6],
        &[6, 7],
        &[7, 4],
        &[0, 1, 2, 3, 4, 5, 6, 7],
        &[0, 1, 2, 3],
        &[4, 5, 6, 7],
        &[0, 3, 4, 7],
        &[1, 2, 5, 6],
        &[0, 1, 4, 5],
        &[2, 3, 6, 7],
    ];
    pub const WEDGE: &[Between] = &[
        &[0, 1],
        &[1, 2],
        &[2, 0],
        &[0, 3],
        &[1, 4],
        &[2, 5],
        &[3, 4],
        &[4, 5],
        &[5, 3],
    ];
}

/// Return the element type with this name, such as `HEX8` or `TETRA`, and this number of nodes; `None` for an
/// unsupported type.
fn kind(name: &str, nodes: usize) -> Option<Kind> {
    let letters = name
        .trim_end_matches(|c: char| c.is_ascii_digit())
        .to_ascii_uppercase();
    let form = match &letters[..] {
        "SPHERE" | "CIRCLE" | "POINT" | "NODE" => Form::Point,
        "BAR" | "BEAM" | "TRUSS" | "EDGE" | "LINE" => Form::Line,
        "TRI" | "TRIANGLE" | "TRISHELL" => Form::Triangle,
        "SHELL" if nodes == 3 || nodes == 6 => Form::Triangle,
        "QUAD" | "SHELL" => Form::Quadrilateral,
        "TET" | "TETRA" => Form::Tetrahedron,
        "HEX" => Form::Hexahedron,
        "WEDGE" => Form::Wedge,
        "PYRAMID" | "PYRA" | "PYR" => Form::Pyramid,
        _ => return None,
    };
    // The 14th node of a pyramid is the centre of the base. Wedges of 18 nodes have different orders in
    // different writers, so they are not supported.
    let is_known = nodes != 18 && super::kind::KINDS.contains(&Kind::new(form, nodes));
    is_known.then_some(Kind::new(form, nodes))
}

/// For each node in the order of [`super::kind`], return the position of this node in the order of Exodus.
fn order(kind: Kind) -> Vec<usize> {
    kind.permutation(match (kind.form, kind.nodes) {
        (Form::Hexahedron, 20) => orders::HEXAHEDRON_20,
        (Form::Hexahedron, 27) => orders::HEXAHEDRON_27,
        (Form::Wedge, 15) => orders::WEDGE,
        _ => kind.between(),
    })
}

/// Read a mesh.
///
/// # Errors
/// If the bytes do not follow the format.
pub fn parse(path: &Path, bytes: &[u8]) -> Result<Mesh> {
    let words = |message: String| fault(path, 0, message);
    let file = Netcdf::open(path, bytes).map_err(words)?;
    let mut mesh = Mesh::default();
    mesh.elements.continue_in(path);
    read(&file, &mut mesh).map_err(words)?;
    Ok(mesh)
}

fn read(file: &Netcdf, mesh: &mut Mesh) -> Fault<()> {
    read_nodes(file, mesh)?;
    let nodes = mesh.nodes.len();
    let numbers = if file.has("elem_num_map") {
        file.integers("elem_num_map")?
    } else {
        Vec::new()
    };
    for (block, id, name) in entities(file, "eb", "connect", "block")? {
        let variable = format!("connect{block}");
        // A block without elements has no connectivity variable.
        if !file.has(&variable) {
            continue;
        }
        let written = file.attribute(&variable, "elem_type")?;
        let shape = file.shape(&variable)?;
        let [count, each] = shape[..] else {
            return Err(format!(
                "{variable}: must have an entry for each element and node"
            ));
        };
        let Some(kind) = kind(&written, each) else {
            let message = format!(
                "block {name}: elements {} with {each} nodes are not supported",
                excerpt(&written)
            );
            return Err(message);
        };
        let order = order(kind);
        let connectivity = file.integers(&variable)?;
        let first = mesh.elements.len();
        if kind.form == Form::Point {
            let volumes = sphere_volumes(file, block, &name, count)?;
            mesh.volumes.resize(first, 0.0);
            mesh.volumes.extend(volumes);
        }
        for element in connectivity.chunks_exact(each) {
            let index = mesh.elements.len();
            let number = numbers
                .get(index)
                .map_or(index as u64 + 1, |number| *number as u64);
            if let Some(node) = element.iter().find(|node| !is_index(**node, nodes)) {
                return Err(format!("element {number}: there is no node {node}"));
            }
            let indices = order.iter().map(|position| (element[*position] - 1) as u32);
            mesh.elements.push(kind, (number, 0), indices);
        }
        let all = [first as u64, mesh.elements.len() as u64];
        mesh.groups.push(Group {
            name: Some(name),
            number: Some(id),
            kind: BLOCK,
            is_entity: false,
            members: Members::Elements(Runs::union([(&[all][..], 0)].into_iter())),
        });
    }
    let elements = mesh.elements.len();
    for (prefix, variable, count, of_nodes, default) in [
        ("ss", "elem_ss", elements, false, "surface"),
        ("ns", "node_ns", nodes, true, "nodelist"),
    ] {
        for (set, id, name) in entities(file, prefix, variable, default)? {
            let variable = format!("{variable}{set}");
            if !file.has(&variable) {
                continue;
            }
            let members = file.integers(&variable)?;
            if let Some(member) = members.iter().find(|member| !is_index(**member, count)) {
                let what = if of_nodes { "node" } else { "element" };
                return Err(format!("set {name}: there is no {what} {member}"));
            }
            let members = Runs::new(members.iter().map(|member| (member - 1) as u64).collect());
            mesh.groups.push(Group {
                name: Some(name),
                number: Some(id),
                kind: if of_nodes { "node set" } else { SIDE_SET },
                is_entity: false,
                members: if of_nodes {
                    Members::Nodes(members)
                } else {
                    Members::Elements(members)
                },
            });
        }
    }
    Ok(())
}

/// Return the volumes of a block of `count` sphere elements; empty if the block has no volumes.
///
/// The volume is the attribute whose name ends with `volume`. In a block without names of attributes, the
/// volume is the second attribute, as in the files of Peridigm. In the files of Peridigm, the first attribute
/// is a radius.
fn sphere_volumes(file: &Netcdf, block: usize, name: &str, count: usize) -> Fault<Vec<f64>> {
    let [variable, names] = ["attrib", "attrib_name"].map(|prefix| format!("{prefix}{block}"));
    if !file.has(&variable) {
        return Ok(Vec::new());
    }
    let shape = file.shape(&variable)?;
    let [rows, each] = shape[..] else {
        let message = format!("{variable}: must have an entry for each element and attribute");
        return Err(message);
    };
    if rows != count {
        return Err(format!(
            "{variable}: has {rows} rows, the block has {count} elements"
        ));
    }
    let names = if file.has(&names) {
        file.texts(&names)?
    } else {
        Vec::new()
    };
    let named = names
        .iter()
        .position(|name| name.to_ascii_lowercase().ends_with("volume"));
    let has_no_names = names.iter().all(String::is_empty);
    let second = (has_no_names && each > 1).then_some(1);
    let Some(column) = named.or(second).filter(|column| *column < each) else {
        return Ok(Vec::new());
    };
    let attributes = file.reals(&variable)?;
    let volumes: Vec<f64> = attributes
        .chunks_exact(each)
        .map(|attributes| attributes[column])
        .collect();
    let wrong = volumes
        .iter()
        .position(|volume| !(*volume > 0.0 && volume.is_finite()));
    match wrong {
        None => Ok(volumes),
        Some(wrong) => Err(format!(
            "block {name}: the volume of sphere {} of the block is {:e}, must be above 0",
            wrong + 1,
            volumes[wrong]
        )),
    }
}

fn is_index(number: i64, count: usize) -> bool {
    number >= 1 && number as u64 <= count as u64
}

fn read_nodes(file: &Netcdf, mesh: &mut Mesh) -> Fault<()> {
    let mut axes = Vec::new();
    if file.has("coord") {
        let shape = file.shape("coord")?;
        let [_, count] = shape[..] else {
            return Err("coord: must have a row for each direction".to_owned());
        };
        let all = file.reals("coord")?;
        axes.extend(all.chunks_exact(count.max(1)).take(3).map(<[f64]>::to_vec));
    } else {
        for name in ["coordx", "coordy", "coordz"] {
            if file.has(name) {
                axes.push(file.reals(name)?);
            }
        }
    }
    let count = axes.first().map_or(0, Vec::len);
    if axes.iter().any(|axis| axis.len() != count) || count > u32::MAX as usize {
        return Err("its coordinates do not have one entry for each node".to_owned());
    }
    for node in 0..count {
        let place = std::array::from_fn(|k| axes.get(k).map_or(0.0, |axis| axis[node]));
        let place = position(place).map_err(|message| format!("node {}: {message}", node + 1))?;
        mesh.nodes.push(place);
    }
    Ok(())
}

/// Return the number (from 1), id and name of each block or set. The ids are in the variable `PREFIX_prop1`,
/// and the names in `PREFIX_names`, where `PREFIX` is `prefix`, such as `eb`. If the file has no ids, there
/// is one block or set for each variable whose name is `variable` and a number from 1, such as `connect1` and
/// `connect2`. The id of each block or set is then its number. A missing name is replaced by `default`, an
/// underscore and the id, such as `block_3`.
fn entities(
    file: &Netcdf,
    prefix: &str,
    variable: &str,
    default: &str,
) -> Fault<Vec<(usize, i64, String)>> {
    let [ids, names] = ["prop1", "names"].map(|suffix| format!("{prefix}_{suffix}"));
    let ids: Vec<i64> = if file.has(&ids) {
        file.integers(&ids)?
    } else {
        let mut known = Vec::new();
        while file.has(&format!("{variable}{}", known.len() + 1)) {
            known.push(known.len() as i64 + 1);
        }
        known
    };
    let names = if file.has(&names) {
        file.texts(&names)?
    } else {
        Vec::new()
    };
    let entity = |(index, id): (usize, i64)| {
        let name = names.get(index).filter(|name| !name.is_empty()).cloned();
        (
            index + 1,
            id,
            name.unwrap_or_else(|| format!("{default}_{id}")),
        )
    };
    Ok(ids.into_iter().enumerate().map(entity).collect())
}
