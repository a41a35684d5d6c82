//! The discretization of PeriLab: point files, meshes and the dimension.

use crate::error::{Result, excerpt};
use crate::import::draft::Value;
use crate::import::files::PointFile;
use crate::import::log::{SPATIAL_CONSTANTS, UNUSED_COLUMNS};
use crate::import::translation::Translation;
use crate::import::tree::{Node, is_key};
use crate::mesh::{self, BLOCK, Format, Members};

/// Source of the points of the blocks.
pub(super) enum Points {
    File(Value, Option<PointFile>),
    Mesh(Value, MeshBlocks),
}

/// Meaning of the block numbers of a deck with a mesh.
pub(super) enum MeshBlocks {
    /// A block number of the deck is the number of a block of an Exodus mesh.
    Numbers,
    /// A block number of the deck is the number of a group of the mesh. The import does not read the mesh,
    /// which may have no groups. Therefore, if block 1 is the only block of the deck, it has all elements.
    NumbersOrAll,
    /// A block number of the deck is the position of an element set in this list of names. Positions start
    /// from 1. The list is `None` if the mesh cannot be read. If block 1 is the only block of the deck, it
    /// has all elements.
    Sets(Option<Vec<String>>),
}

impl MeshBlocks {
    /// Return the prefix that the new deck needs before the name of a node set of the mesh. For Abaqus
    /// meshes, the prefix is `element set `, because PeriLab uses their element sets as node sets. For other
    /// meshes, the prefix is empty.
    pub(super) fn prefix_of_sets(&self) -> &'static str {
        match self {
            Self::Sets(_) => "element set ",
            _ => "",
        }
    }
}

/// Read the element sets of an Abaqus file. Return the names of the sets that are blocks in PeriLab, in the
/// order of the block numbers. Return `None` if the file cannot be read.
///
/// A set is a block if it has elements that no earlier set has. Sets that conditions use as node sets come
/// last. PeriLab has no fixed order for the other sets. This function takes these sets in the order of the
/// file.
fn blocks_of_abaqus(
    translation: &Translation,
    path: &str,
    conditions: Option<&Node>,
) -> Option<Vec<String>> {
    let path = translation.path(path);
    let bytes = mesh::load(&path).ok()?;
    let mesh = mesh::parse(Format::Abaqus, &path, &bytes).ok()?;
    let used: Vec<&str> = conditions
        .into_iter()
        .flat_map(Node::tables)
        .filter_map(|(_, condition)| condition.get("Node Set")?.text())
        .collect();
    let mut sets = Vec::new();
    for group in &mesh.groups {
        if let (Some(name), Members::Elements(elements), "element set") =
            (&group.name, &group.members, group.kind)
            // A name with a dot, such as `INSTANCE.SET`, is the name of a set of one instance. The name
            // `SET` is that of the set of all instances.
            && !name.contains('.')
        {
            let place = used.iter().position(|used| used == name);
            sets.push((place.map_or(0, |place| place + 1), name, elements));
        }
    }
    sets.sort_by_key(|(place, ..)| *place);
    let mut is_in_block = vec![false; mesh.elements.len()];
    let mut names = Vec::new();
    for (_, name, elements) in sets {
        let mut is_block = false;
        for element in elements.iter() {
            is_block |= !std::mem::replace(&mut is_in_block[element as usize], true);
        }
        if is_block {
            names.push(name.clone());
        }
    }
    Some(names)
}

/// Columns of a point file that hold constants per point. PeriLab uses these constants instead of those of
/// the deck.
const POINTWISE_CONSTANTS: [&str; 5] = [
    "Bulk_Modulus",
    "Young's_Modulus",
    "Poisson's_Ratio",
    "Shear_Modulus",
    "Critical_Value",
];

/// Start of the names of the columns with the angles of the material axes: `Angles` in plane problems,
/// `Anglesx` or `Angles_x` in 3-D.
const ANGLES: &str = "Angles";

/// Largest number of ids that the import writes for a node set; longer lists would make the new deck
/// unreadable.
const MOST_IDS: usize = 1_000_000;

/// Return the name of each node set of an Exodus mesh, with the ids of the points in the set. PeriLab gives
/// the name `Set-N` to the N-th set if this set has no name.
///
/// In PeriLab, an element belongs to a node set if all nodes of the element are in the set. (In Peridigm and
/// Fissure, one node is enough.) The result is empty if the mesh cannot be read, or if some of its elements
/// are in no block of the deck.
pub(super) fn sets_with_all_nodes(
    translation: &Translation,
    discretization: &Node,
    blocks: &Node,
) -> Result<Vec<(String, Vec<u64>)>> {
    let file = translation.required(discretization, "Input Mesh File", "the discretization")?;
    let path = translation.path(translation.text(file, "Input Mesh File")?);
    let bytes = mesh::load(&path).ok();
    let mesh = bytes.and_then(|bytes| mesh::parse(Format::Exodus, &path, &bytes).ok());
    let Some(mesh) = mesh else {
        return Ok(Vec::new());
    };
    let numbers: Vec<i64> = blocks
        .tables()
        .filter_map(|(_, block)| {
            let id = translation.count(block.get("Block ID")?, "Block ID");
            id.ok().map(|id| id as i64)
        })
        .collect();
    let has_number = |number: Option<i64>| number.is_some_and(|number| numbers.contains(&number));
    let mut groups = mesh.groups.iter().filter(|group| group.kind == BLOCK);
    let mut elements = 0..mesh.elements.len();
    // The id of a point is the index of its element only if every element becomes a point.
    if !groups.all(|group| has_number(group.number))
        || !elements.all(|element| mesh.is_solid(element, translation.dimension))
    {
        return Ok(Vec::new());
    }
    let (mut sets, mut number) = (Vec::new(), 0);
    for group in &mesh.groups {
        let Members::Nodes(nodes) = &group.members else {
            continue;
        };
        let mut is_in = vec![false; mesh.nodes.len()];
        for node in nodes.iter() {
            is_in[node as usize] = true;
        }
        let has_all = |element: &usize| {
            let mut nodes = mesh.elements.nodes(*element).iter();
            nodes.all(|node| is_in[*node as usize])
        };
        let elements = (0..mesh.elements.len()).filter(has_all);
        let ids: Vec<u64> = elements.map(|element| element as u64).collect();
        number += 1;
        if ids.len() > MOST_IDS {
            continue;
        }
        // The mesh reader gives this name to a set without a name.
        let default = format!("nodelist_{}", group.number.unwrap_or(0));
        if group.name.as_ref() == Some(&default) {
            sets.push((format!("Set-{number}"), ids.clone()));
        }
        sets.push((group.name.clone().unwrap_or(default), ids));
    }
    Ok(sets)
}

/// Read from the discretization which file or mesh contains the points.
pub(super) fn points(
    translation: &mut Translation,
    node: &Node,
    conditions: Option<&Node>,
) -> Result<Points> {
    let file = translation.required(node, "Input Mesh File", "the discretization")?;
    let path = translation.text(file, "Input Mesh File")?.to_owned();
    let name = match node.get("Type") {
        None => "Text File",
        Some(kind) => {
            translation.log.taken(kind, "points of the bodies");
            translation.text(kind, "Type")?
        }
    };
    let grid = translation.draft.section("grid");
    grid.set("volume_correction", Value::text("none"));
    let value = translation.file(&path);
    if is_key(name, "Text File") {
        let known = PointFile::read(&translation.path(&path), &[]);
        let note = match known {
            Some(_) => "points.file of the bodies, with the columns of its header",
            None => "points.file of the bodies; it cannot be read yet",
        };
        translation.log.taken(file, note);
        let names = known.as_ref().and_then(|file| file.names.clone());
        let mut constants = names.unwrap_or_default();
        constants.retain(|name| {
            POINTWISE_CONSTANTS.contains(&name.as_str()) || name.starts_with(ANGLES)
        });
        if !constants.is_empty() {
            let note = format!("{UNUSED_COLUMNS}: {}", constants.join(", "));
            translation.log.approximated(file, note);
        }
        return Ok(Points::File(value, known));
    }
    if ["Exodus", "Abaqus", "Gmsh"]
        .iter()
        .any(|known| is_key(name, known))
    {
        match Format::of(path.as_ref()) {
            Some(_) => translation.log.taken(file, "points.mesh of the bodies"),
            None => {
                let note = format!(
                    "points.mesh of the bodies; its name must end with one of {}",
                    Format::endings()
                );
                translation.log.approximated(file, note);
            }
        }
        let blocks = if is_key(name, "Abaqus") {
            MeshBlocks::Sets(blocks_of_abaqus(translation, &path, conditions))
        } else if is_key(name, "Gmsh") {
            MeshBlocks::NumbersOrAll
        } else {
            MeshBlocks::Numbers
        };
        return Ok(Points::Mesh(value, blocks));
    }
    let message = format!(
        "the discretization {} is not read; known are Text File, Exodus, Abaqus and Gmsh",
        excerpt(name)
    );
    Err(translation.error(node.line, message))
}

/// Return the `dimension` of the new deck. The number of dimensions is taken from the header of the point
/// file. For 2-D points, the first material whose `Symmetry` names plane stress or plane strain decides
/// between these two; without such a material, plane stress is used.
///
/// If there is no such header, for example for a mesh, the same material decides; without such a material,
/// the deck is 3-D.
pub(super) fn setting(
    translation: &mut Translation,
    discretization: &Node,
    materials: &Node,
    points: &Points,
) -> &'static str {
    let dimension = match points {
        Points::File(_, Some(file)) => file.dimension(),
        _ => None,
    };
    let mut plane = None;
    for (_, material) in materials.tables() {
        let Some(symmetry) = material.get("Symmetry") else {
            continue;
        };
        let text = symmetry.text().unwrap_or("").to_lowercase();
        let of_text = ["plane stress", "plane strain"]
            .iter()
            .position(|name| text.contains(name));
        plane = plane.or(of_text);
        let known = ["isotropic", "orthotropic", "3d"]
            .iter()
            .any(|name| text.contains(name));
        if !known && of_text.is_none() {
            translation
                .log
                .left_out(symmetry, "unknown, or without a counterpart");
        }
    }
    let filters = discretization.get("Bond Filters");
    let has_z = filters.is_some_and(|filters| {
        filters
            .tables()
            .any(|(_, filter)| filter.get("Side Length").is_some())
    });
    let setting = match (dimension, plane) {
        (Some(3), _) => "3d",
        (Some(1), _) => "1d",
        (Some(_), Some(1)) => "plane-strain",
        (Some(_), _) => "plane-stress",
        (None, Some(0)) => "plane-stress",
        (None, Some(_)) => "plane-strain",
        (None, None) => "3d",
    };
    translation.dimension = match setting {
        "3d" => 3,
        "1d" => 1,
        _ => 2,
    };
    for (_, material) in materials.tables() {
        let Some(symmetry) = material.get("Symmetry") else {
            if translation.dimension == 2 {
                let note = format!("has no `Symmetry`: dimension = \"{setting}\"");
                translation.log.approximated(material, note);
                // PeriLab rejects a correspondence law without `Symmetry`.
                let model = material.get("Material Model").and_then(Node::text);
                if !model.is_some_and(|model| model.to_lowercase().contains("correspondence")) {
                    translation.log.approximated(material, SPATIAL_CONSTANTS);
                }
            }
            continue;
        };
        let text = symmetry.text().unwrap_or("").to_lowercase();
        let agrees = match setting {
            "plane-stress" => text.contains("plane stress"),
            "plane-strain" => text.contains("plane strain"),
            _ => !text.contains("plane"),
        };
        let note = format!("dimension = \"{setting}\"");
        if agrees || (has_z && setting == "3d" && !text.contains("plane")) {
            translation.log.taken(symmetry, note)
        } else {
            translation
                .log
                .approximated(symmetry, note + ": the points have that many coordinates")
        }
    }
    setting
}
