//! Points from the elements of a mesh.
//!
//! Rank 0 reads the file, generates the points, frees the mesh and sends each rank an equal part of the
//! points. The points have the order of the elements, for any number of ranks.

use std::ops::Range;
use std::path::Path;

use crate::comm::{Communicator, agree};
use crate::dimension::Dimension;
use crate::error::{Error, Result, excerpt};
use crate::mesh::{self, Format, Group, GroupKey, Members, Mesh, Runs};
use crate::problem::{PointSource, Problem, Selector};

use super::{BodyPoints, Point};

/// Value for an element that belongs to no body.
const NO_BODY: u16 = u16::MAX;

/// Value for an element without a point.
const NO_POINT: u32 = u32::MAX;

/// End of a message about single-node elements without a volume.
const NO_VOLUME: &str = "only single-node elements without a volume; sphere elements of an Exodus file need the \
                         volume as an attribute with the name `volume`, or as their second attribute";

/// Maximum number of corners of an element.
const MOST_CORNERS: usize = 8;

/// Tolerance for the elements of 2-D and 1-D meshes: largest distance of a node from the plane or line of the
/// mesh, divided by the size of the element.
const PLANE_SLACK: f64 = 1e-6;

/// A body whose points come from a mesh.
pub(super) struct User<'a> {
    pub body: usize,
    block: Option<&'a GroupKey>,
    scale: f64,
    block_span: &'a Range<usize>,
}

/// The points of a mesh, and the ids of the points in each set of the problem.
pub struct PointsAndSets {
    /// The points, with ids from 0.
    pub points: Vec<Point>,
    /// For each set of the problem, the ids of its points; `None` for sets that name no group of the mesh.
    pub sets: Vec<Option<Runs>>,
    /// Names of the groups, on rank 0; empty on the other ranks.
    pub names: Vec<String>,
}

/// Return the index of the first body whose points come from this mesh.
///
/// # Panics
/// If no body uses the mesh.
pub fn first_user(bodies: &[BodyPoints], path: &Path) -> usize {
    let users = users(bodies, path);
    users.first().expect("a body names the mesh").body
}

pub(super) fn users<'a>(bodies: &[BodyPoints<'a>], file: &Path) -> Vec<User<'a>> {
    let bodies = bodies.iter().enumerate();
    let of_file = bodies.filter_map(|(body, description)| match description.points {
        PointSource::Mesh {
            path,
            block,
            scale,
            block_span,
            ..
        } if path == file => Some(User {
            body,
            block: block.as_ref(),
            scale: *scale,
            block_span,
        }),
        _ => None,
    });
    of_file.collect()
}

/// Read a mesh on rank 0. Return this rank's part of the points of all bodies that use the mesh. Collective.
///
/// # Errors
/// Same as for [`read`]; the error is the same on all ranks.
pub(super) fn piece(
    problem: &Problem,
    path: &Path,
    comm: &dyn Communicator,
) -> Result<PointsAndSets> {
    let read = if comm.rank() == 0 {
        read(problem, path).map(Some)
    } else {
        Ok(None)
    };
    let found = agree(comm, read)?;
    let mut outgoing = vec![Vec::new(); comm.size()];
    let mut packed = Vec::new();
    let mut names = Vec::new();
    if let Some(found) = found {
        let border = |rank: usize| found.points.len() * rank / comm.size();
        for (rank, bytes) in outgoing.iter_mut().enumerate() {
            let share = &found.points[border(rank)..border(rank + 1)];
            bytes.extend_from_slice(bytemuck::cast_slice(share));
        }
        packed = pack(&found.sets);
        names = found.names;
    }
    let received = comm.all_to_all(outgoing);
    comm.broadcast(0, &mut packed);
    Ok(PointsAndSets {
        points: bytemuck::pod_collect_to_vec(&received[0]),
        sets: unpack(&packed, problem.sets.len()),
        names,
    })
}

/// Serialize sets: first one count per set, then all ranges. The count is 0 for a missing set, otherwise the
/// number of ranges of the set plus 1.
fn pack(sets: &[Option<Runs>]) -> Vec<u8> {
    let ranges = |set: &Option<Runs>| {
        set.as_ref()
            .map_or(0, |runs| runs.ranges().len() as u64 + 1)
    };
    let counts: Vec<u64> = sets.iter().map(ranges).collect();
    let mut packed = bytemuck::cast_slice(&counts).to_vec();
    for runs in sets.iter().flatten() {
        packed.extend_from_slice(bytemuck::cast_slice(runs.ranges()));
    }
    packed
}

fn unpack(packed: &[u8], sets: usize) -> Vec<Option<Runs>> {
    let words: Vec<u64> = bytemuck::pod_collect_to_vec(packed);
    let (counts, ranges) = words.split_at(sets);
    let mut ranges = bytemuck::cast_slice::<u64, [u64; 2]>(ranges);
    let set = |count: &u64| {
        let own = ranges.split_off(..(*count as usize).checked_sub(1)?);
        Some(Runs::union([(own.unwrap_or_default(), 0)].into_iter()))
    };
    counts.iter().map(set).collect()
}

/// Read a mesh and generate its points, on one rank.
///
/// # Errors
/// If the file name does not have the ending of a mesh format, or the file cannot be read or parsed. If an
/// element is invalid, belongs to two bodies or coincides with another element. If a body's block is not a
/// group with elements of the problem's dimension. If the name of a block or set is ambiguous.
pub fn read(problem: &Problem, path: &Path) -> Result<PointsAndSets> {
    let bodies = BodyPoints::of(&problem.bodies);
    let MeshAndPoints {
        mesh,
        points,
        point_of,
    } = read_points(&bodies, problem.dimension, path)?;
    are_apart(&mesh, &points, &point_of)?;
    let dimension = problem.dimension.count();
    let mut marks = vec![false; mesh.nodes.len()];
    let mut sets = Vec::with_capacity(problem.sets.len());
    for entry in &problem.sets {
        let Selector::Mesh(set) = &entry.selector else {
            sets.push(None);
            continue;
        };
        let group = mesh
            .find(&set.group, |group| mesh.dimension(group) <= dimension)
            .map_err(|message| {
                let message = format!("[set.{}] mesh: {message}", entry.name);
                Error::input(message).at(&set.span)
            })?;
        let ids = |group: &Group| {
            let group = &group.members;
            members(&mesh, group, &point_of, dimension, &mut marks)
        };
        sets.push(group.map(ids));
    }
    Ok(PointsAndSets {
        sets,
        names: mesh.names(|group| mesh.dimension(group) <= dimension),
        points,
    })
}

/// A mesh and the points of its elements.
pub(super) struct MeshAndPoints {
    mesh: Mesh,
    /// The points, with ids from 0.
    pub points: Vec<Point>,
    /// The point of each element, or [`NO_POINT`].
    point_of: Vec<u32>,
}

/// Read a mesh and generate its points, on one rank. Unlike [`read`], this function does not use the sets of
/// the deck.
///
/// # Errors
/// Same as for [`read`], except that coinciding elements and ambiguous names of sets are not detected.
pub(super) fn read_points(
    bodies: &[BodyPoints],
    dimension: Dimension,
    path: &Path,
) -> Result<MeshAndPoints> {
    let users = users(bodies, path);
    let Some(format) = Format::of(path) else {
        let (name, endings) = (path.display(), Format::endings());
        return Err(Error::input(format!(
            "{name}: the name of a mesh must end with one of {endings}"
        )));
    };
    let bytes = mesh::load(path).map_err(|error| {
        let PointSource::Mesh { span, .. } = bodies[users[0].body].points else {
            unreachable!("users are bodies with a mesh");
        };
        let message = format!("cannot read the mesh {}: {error}", path.display());
        Error::input(message).at(span)
    })?;
    let mesh = mesh::parse(format, path, &bytes)?;
    drop(bytes);
    let of_elements = bodies_of_elements(bodies, dimension.count(), &mesh, &users)?;
    let (points, point_of) = points(dimension, &mesh, &users, &of_elements)?;
    Ok(MeshAndPoints {
        mesh,
        points,
        point_of,
    })
}

/// Return the index of each element's body, or [`NO_BODY`].
fn bodies_of_elements(
    all: &[BodyPoints],
    dimension: usize,
    mesh: &Mesh,
    users: &[User],
) -> Result<Vec<u16>> {
    let is_solid = |element: usize| mesh.is_solid(element, dimension);
    let mut bodies = vec![NO_BODY; mesh.elements.len()];
    for user in users {
        let Some(block) = user.block else { continue };
        let has_solids = |group: &Group| match &group.members {
            Members::Elements(elements) => {
                elements.iter().any(|element| is_solid(element as usize))
            }
            Members::Nodes(_) => false,
        };
        let ambiguous = |message: String| {
            let body = all[user.body].name;
            let message = format!("[body.{body}] points block: {message}");
            Error::input(message).at(user.block_span)
        };
        let is_block = |group: &Group| group.kind != mesh::SIDE_SET && has_solids(group);
        let group = match mesh.find(block, is_block).map_err(ambiguous)? {
            Some(group) => Some(group),
            None => mesh.find(block, has_solids).map_err(ambiguous)?,
        };
        let Some(group) = group else {
            let body = all[user.body].name;
            let message = if has_single_nodes(mesh, block) {
                format!("[body.{body}] points block: {block} has {NO_VOLUME}")
            } else {
                let known = mesh.names(has_solids);
                let suggestion = mesh::suggestion(block, &known);
                let others = match mesh.find(block, |group| mesh.dimension(group) > 0) {
                    Ok(Some(group)) => format!(
                        "; the elements of {block} are {}-D{}",
                        mesh.dimension(group),
                        if known.is_empty() { "" } else { &suggestion }
                    ),
                    _ => suggestion,
                };
                format!(
                    "[body.{body}] points block: the mesh has no group {block} of {dimension}-D elements{others}"
                )
            };
            return Err(Error::input(message).at(user.block_span));
        };
        let Members::Elements(elements) = &group.members else {
            unreachable!("the group has elements");
        };
        for element in elements.iter().map(|element| element as usize) {
            if !is_solid(element) {
                continue;
            }
            if bodies[element] != NO_BODY {
                let [a, b] = [usize::from(bodies[element]), user.body];
                let message = format!(
                    "belongs to [body.{}] and to [body.{}]; give them blocks without common elements",
                    all[a].name, all[b].name
                );
                return Err(mesh.elements.fault(element, message));
            }
            bodies[element] = user.body as u16;
        }
    }
    if let Some(rest) = users.iter().find(|user| user.block.is_none()) {
        for (element, body) in bodies.iter_mut().enumerate() {
            if *body == NO_BODY && is_solid(element) {
                *body = rest.body as u16;
            }
        }
        if let Some(what) = without_volume(mesh, &bodies, rest.body as u16) {
            let body = all[rest.body].name;
            let message = format!("[body.{body}] points mesh: {what} has {NO_VOLUME}");
            return Err(Error::input(message).at(rest.block_span));
        }
    }
    Ok(bodies)
}

/// Find a part of the mesh that should belong to the body `rest`, but has only single-node elements without a
/// volume. Return the name of the part; `None` if there is no such part. `rest` is the index of the body that
/// selects no block.
///
/// The rest of the mesh consists of the elements that belong to no other body. If all of these elements are
/// single-node elements, the part is the whole rest of the mesh. In files of Exodus, the part may also be a
/// block of spheres that no other body selects. In other files, single-node elements may define sets, so the
/// part can only be the whole rest of the mesh.
fn without_volume(mesh: &Mesh, bodies: &[u16], rest: u16) -> Option<String> {
    let is_left = |element: usize| bodies[element] == NO_BODY;
    let is_single = |element: usize| mesh.elements.kind(element).dimension() == 0;
    let mut left = (0..bodies.len())
        .filter(|element| is_left(*element))
        .peekable();
    if !bodies.contains(&rest) && left.peek().is_some() && left.all(is_single) {
        let is_shared = bodies.iter().any(|body| *body != NO_BODY);
        let what = if is_shared {
            "the rest of the mesh"
        } else {
            "the mesh"
        };
        return Some(what.to_owned());
    }
    let is_lost = |element: u64| is_left(element as usize) && is_single(element as usize);
    let block = mesh.groups.iter().find(|group| match &group.members {
        Members::Elements(elements) => group.kind == mesh::BLOCK && elements.iter().any(is_lost),
        Members::Nodes(_) => false,
    })?;
    let name = block.name.as_deref().unwrap_or_default();
    Some(format!("block {}", excerpt(name)))
}

/// Test whether all elements of a block are single nodes.
fn has_single_nodes(mesh: &Mesh, block: &GroupKey) -> bool {
    let is_single = |group: &Group| match &group.members {
        Members::Elements(_) => mesh.dimension(group) == 0,
        Members::Nodes(_) => false,
    };
    mesh.find(block, is_single)
        .is_ok_and(|group| group.is_some())
}

/// Generate the points of the elements that belong to bodies. Also return the point of each element;
/// [`NO_POINT`] for an element that belongs to no body.
fn points(
    dimension: Dimension,
    mesh: &Mesh,
    users: &[User],
    bodies: &[u16],
) -> Result<(Vec<Point>, Vec<u32>)> {
    let (kind, dimension) = (dimension, dimension.count());
    let last = users.iter().map(|user| user.body).max().unwrap_or(0);
    let mut scales = vec![1.0; last + 1];
    for user in users {
        scales[user.body] = user.scale;
    }
    let count = bodies.iter().filter(|body| **body != NO_BODY).count();
    let mut points = Vec::with_capacity(count);
    let mut point_of = vec![NO_POINT; bodies.len()];
    let mut nodes = Vec::new();
    let mut plane = None;
    for (element, body) in bodies.iter().enumerate() {
        if *body == NO_BODY {
            continue;
        }
        let scale = scales[usize::from(*body)];
        nodes.clear();
        let indices = mesh.elements.nodes(element).iter();
        nodes.extend(indices.map(|node| mesh.nodes[*node as usize]));
        lies_in_plane(&nodes, dimension, plane.get_or_insert(nodes[0]))
            .map_err(|message| mesh.elements.fault(element, message))?;
        for node in &mut nodes {
            *node = node.map(|x| scale * x);
        }
        let (volume, centroid) = match mesh.volume(element) {
            Some(volume) => (volume * scale.powi(3), nodes[0]),
            None => solid(mesh, element, &nodes, kind)?,
        };
        if !(volume > 0.0 && volume.is_finite()) {
            let message = if volume < 0.0 {
                format!(
                    "has the volume {volume:e} m³; its nodes are in the order of a mirrored element"
                )
            } else {
                format!("has the volume {volume:e} m³, must be above 0")
            };
            return Err(mesh.elements.fault(element, message));
        }
        let mut position = [0.0; 3];
        position[..dimension].copy_from_slice(&centroid[..dimension]);
        point_of[element] = points.len() as u32;
        points.push(Point::new(
            points.len() as u64,
            position,
            volume,
            usize::from(*body),
        ));
    }
    Ok((points, point_of))
}

/// Return volume and centroid of an element. `nodes` are the positions of its nodes, m. The volume is
/// negative if the nodes of a solid element have the order of a mirrored element.
///
/// # Errors
/// If det J changes sign within the element. J is the Jacobian matrix of the map from the reference element
/// to the element.
fn solid(
    mesh: &Mesh,
    element: usize,
    nodes: &[[f64; 3]],
    dimension: Dimension,
) -> Result<(f64, [f64; 3])> {
    let measure = mesh::measure(mesh.elements.kind(element), nodes);
    if measure.is_folded() {
        let message = "det J changes sign; the nodes must be in the order that the format prescribes, and no part of the \
                       element may be inverted";
        return Err(mesh.elements.fault(element, message));
    }
    // A face or a line may have either orientation.
    let size = if dimension.count() == 3 {
        measure.size
    } else {
        measure.size.abs()
    };
    Ok((size * dimension.out_of_plane_measure(), measure.centroid))
}

/// Check that an element lies in the line or plane of the problem. This line or plane contains the position
/// `first`. `nodes` are the positions of the nodes of the element. All positions are in the unit of the mesh.
fn lies_in_plane(
    nodes: &[[f64; 3]],
    dimension: usize,
    first: &[f64; 3],
) -> std::result::Result<(), String> {
    let extent = |k: usize| {
        let along = nodes.iter().map(|node| node[k]);
        let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(x), high.max(x))
        });
        high - low
    };
    let distance = |k: usize| {
        let distances = nodes.iter().map(|node| (node[k] - first[k]).abs());
        distances.fold(0.0, f64::max)
    };
    let size = (0..dimension).map(extent).fold(0.0, f64::max);
    match (dimension..3).find(|k| distance(*k) > PLANE_SLACK * size) {
        None => Ok(()),
        Some(k) => Err(format!(
            "its nodes must have the same {axis} as all other nodes of the mesh, {:e}; a {dimension}-D problem has {} only",
            first[k],
            ["x", "x and y"][dimension - 1],
            axis = ["x", "y", "z"][k],
        )),
    }
}

/// Check that no two elements with a point have the same corners or the same centroid.
fn are_apart(mesh: &Mesh, points: &[Point], point_of: &[u32]) -> Result<()> {
    let corners = (0..point_of.len())
        .filter(|element| point_of[*element] != NO_POINT)
        .map(|element| {
            let mut key = [u32::MAX; MOST_CORNERS];
            let corners = mesh.elements.kind(element).corners();
            key[..corners].copy_from_slice(&mesh.elements.nodes(element)[..corners]);
            key.sort_unstable();
            key
        });
    let centroids = points.iter().map(|point| point.position.map(f64::to_bits));
    let (pair, shared) = match first_equal(corners) {
        Some(pair) => (pair, "corner nodes"),
        None => match first_equal(centroids) {
            Some(pair) => (pair, "centroid"),
            None => return Ok(()),
        },
    };
    let [first, second] = pair.map(|point| {
        let found = point_of.iter().position(|own| *own == point);
        found.expect("every point has an element")
    });
    let message = format!(
        "has the same {shared} as element {}; remove one of the two",
        mesh.elements.number(first)
    );
    Err(mesh.elements.fault(second, message))
}

/// Find the first point whose key equals the key of an earlier point. Return both indices, the earlier one
/// first.
fn first_equal<Key: Ord>(keys: impl Iterator<Item = Key>) -> Option<[u32; 2]> {
    let mut order: Vec<(Key, u32)> = keys.zip(0..).collect();
    order.sort_unstable();
    let pairs = order.windows(2).filter(|pair| pair[0].0 == pair[1].0);
    let pair = pairs.min_by_key(|pair| pair[1].1)?;
    Some([pair[0].1, pair[1].1])
}

/// Return the ids of the points of a group. A group has the points of
///
/// - the elements of the group;
/// - elements whose nodes include all corners of a face, edge or point element of the group;
/// - elements that have a node of the group.
///
/// `marks` has one entry per node; all entries are false before and after the call.
fn members(
    mesh: &Mesh,
    group: &Members,
    point_of: &[u32],
    dimension: usize,
    marks: &mut [bool],
) -> Runs {
    let mut ids = Vec::new();
    // Sorted corners of each face, edge, point element and node of the group. The first corner is marked in
    // `marks`.
    let mut faces: Vec<Vec<u32>> = Vec::new();
    match group {
        Members::Nodes(nodes) => faces.extend(nodes.iter().map(|node| vec![node as u32])),
        Members::Elements(elements) => {
            for element in elements.iter().map(|element| element as usize) {
                let kind = mesh.elements.kind(element);
                if kind.dimension() < dimension && !mesh.is_solid(element, dimension) {
                    let mut corners = mesh.elements.nodes(element)[..kind.corners()].to_vec();
                    corners.sort_unstable();
                    faces.push(corners);
                } else if point_of[element] != NO_POINT {
                    ids.push(u64::from(point_of[element]));
                }
            }
        }
    }
    faces.sort_unstable();
    for face in &faces {
        marks[face[0] as usize] = true;
    }
    if !faces.is_empty() {
        for (element, point) in point_of
            .iter()
            .enumerate()
            .filter(|(_, point)| **point != NO_POINT)
        {
            let nodes = mesh.elements.nodes(element);
            let has_face = |node: &u32| {
                let first = faces.partition_point(|face| face[0] < *node);
                let own = faces[first..].iter().take_while(|face| face[0] == *node);
                own.into_iter()
                    .any(|face| face.iter().all(|corner| nodes.contains(corner)))
            };
            if nodes
                .iter()
                .any(|node| marks[*node as usize] && has_face(node))
            {
                ids.push(u64::from(*point));
            }
        }
    }
    for face in &faces {
        marks[face[0] as usize] = false;
    }
    Runs::new(ids)
}
