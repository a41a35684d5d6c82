//! Generation of points, and the geometry of shapes, sets and pre-cracks.
//!
//! Each rank generates its own piece of the points, or reads this piece from a point file. Only rank 0 reads
//! meshes, and sends the other ranks their pieces.

pub mod bins;
pub mod columns;
pub mod crack;
pub(crate) mod file;
pub mod id_file;
pub mod lattice;
pub mod mean_spacing;
pub(crate) mod mesh;
mod polygon;
mod region;
mod rows;
mod same_file;
pub mod set;
pub mod shape;
pub mod value_file;

pub use columns::Columns;
pub use lattice::LatticeBody;
pub use polygon::Polygon;

use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use nalgebra::Vector3;

use crate::comm::{Communicator, agree};
use crate::error::{Error, Result};
use crate::mesh::{Runs, suggestion};
use crate::problem::{Body, IdFile, Jitter, PointSource, Problem, Selector};
use crate::scatter::{Scattered, uniform};

/// Exclusive upper limit on the number of points per rank.
pub const MAX_PER_RANK: f64 = 2_147_483_647.0;

/// A point, in the form in which ranks exchange points.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Point {
    /// Global id, the same for any number of ranks. Without refinement, the ids of the points are 0, 1, 2 …
    /// without gaps.
    pub id: u64,
    /// Reference position, m; components beyond the dimension are 0.
    pub position: [f64; 3],
    /// Volume, m³.
    pub volume: f64,
    /// Index of the block of the point. Before refinement, this is the index of the body.
    pub block: u32,
    /// Explicit padding, as `Pod` requires.
    pub unused: u32,
}

impl Point {
    /// Create a point with its id, reference position (m), volume (m³) and the index of its block.
    pub fn new(id: u64, position: [f64; 3], volume: f64, block: usize) -> Self {
        Self {
            id,
            position,
            volume,
            block: block as u32,
            unused: 0,
        }
    }
}

/// Name of a body and source of its points.
#[derive(Debug, Clone)]
pub struct BodyPoints<'a> {
    /// Name in the deck.
    pub name: &'a str,
    /// Span in the deck.
    pub span: Range<usize>,
    /// Source of the points.
    pub points: &'a PointSource,
}

impl<'a> BodyPoints<'a> {
    /// Return the names of the bodies and the sources of their points.
    pub fn of(bodies: &'a [Body]) -> Vec<Self> {
        let own = |body: &'a Body| Self {
            name: &body.name,
            span: body.span.clone(),
            points: &body.points,
        };
        bodies.iter().map(own).collect()
    }
}

/// Return the squared distance of two positions, m².
pub fn distance_squared(a: [f64; 3], b: [f64; 3]) -> f64 {
    let difference = Vector3::from(b) - Vector3::from(a);
    difference.dot(&difference)
}

/// Generate this rank's piece of the points. Return the piece and the total number of points on all ranks.
/// In a piece, the ids of the points of each body are contiguous. If several bodies share a file or mesh, the
/// ids of all points of this file or mesh are contiguous instead. Collective.
///
/// # Errors
/// If a body has no points, or a rank has too many points. If a file is unreadable or invalid. If a set has
/// an unknown id or mesh group. If cells of a lattice are too far from the origin to be numbered. The error
/// is the same on all ranks.
pub fn generate(problem: &Problem, comm: &dyn Communicator) -> Result<(Vec<Point>, u64)> {
    let bodies = BodyPoints::of(&problem.bodies);
    let mut points = Vec::new();
    let mut total = 0;
    let mut meshes = Vec::new();
    for (index, body) in problem.bodies.iter().enumerate() {
        let mut piece = match &body.points {
            PointSource::Lattice { .. } => lattice::piece(problem, index, comm)?,
            PointSource::File { path, .. } => {
                if file::users(&bodies, path)[0].0 != index {
                    continue;
                }
                let mut piece = Vec::new();
                let dimension = problem.dimension.count();
                file::for_each_point(&bodies, dimension, path, comm, |point| piece.push(point))?;
                piece
            }
            PointSource::Mesh { path, .. } => {
                if mesh::first_user(&bodies, path) != index {
                    continue;
                }
                let mut found = mesh::piece(problem, path, comm)?;
                let piece = std::mem::take(&mut found.points);
                meshes.push((found, total));
                piece
            }
        };
        let (before, all) = crate::comm::scan(comm, piece.len() as u64);
        for (point, id) in piece.iter_mut().zip(total + before..) {
            point.id = id;
        }
        if let (PointSource::Lattice { spacing, .. }, Some(jitter)) = (&body.points, problem.jitter)
        {
            let dimension = problem.dimension.count();
            scatter(&mut piece, jitter, &spacing[..dimension]);
        }
        // The first piece is moved, because appending would copy it. Usually, it is the only piece.
        if points.is_empty() {
            points = piece
        } else {
            points.extend(piece)
        }
        total += all;
    }
    let mut counts = vec![0; bodies.len()];
    for point in &points {
        counts[point.block as usize] += 1;
    }
    comm.sum(&mut counts);
    check_no_empty_body(&bodies, problem.dimension.count(), &counts)?;
    check_set_ids(problem, total)?;
    let resolved = resolve_mesh_sets(problem, &meshes);
    agree(comm, resolved)?;
    let fits = if (points.len() as f64) < MAX_PER_RANK {
        Ok(())
    } else {
        Err(Error::run(
            "too many points for one rank (2.1e9 at most); use more ranks",
        ))
    };
    agree(comm, fits)?;
    Ok((points, total))
}

/// Displace points randomly from the centres of their cells. In each direction, the displacement is at most
/// `jitter.largest_shift` times the edge length of a cell. `spacing` has the edge length (m) in each
/// direction.
fn scatter(points: &mut [Point], jitter: Jitter, spacing: &[f64]) {
    for point in points {
        for (k, edge) in spacing.iter().enumerate() {
            let shift = 2.0 * uniform(jitter.seed, Scattered::Position(k), point.id) - 1.0;
            point.position[k] += jitter.largest_shift * edge * shift;
        }
    }
}

/// Store the point ids of the sets that name mesh groups. `meshes` contains the points of each mesh and
/// the id of the first of these points.
///
/// # Errors
/// If no mesh has the group that a set names, or if the points of a set differ from those of an earlier call.
/// The message suggests similar names on rank 0 only, because the other ranks do not know the names of the
/// groups.
fn resolve_mesh_sets(problem: &Problem, meshes: &[(mesh::PointsAndSets, u64)]) -> Result<()> {
    for (index, set) in problem.sets.iter().enumerate() {
        let Selector::Mesh(group) = &set.selector else {
            continue;
        };
        let of_mesh = |(found, first): &'_ (mesh::PointsAndSets, u64)| {
            let ids = found.sets[index].clone()?;
            Some((ids, *first))
        };
        let found: Vec<(Runs, u64)> = meshes.iter().filter_map(of_mesh).collect();
        if found.is_empty() {
            let names = meshes.iter().flat_map(|(found, _)| found.names.clone());
            let message = format!(
                "[set.{}] mesh: no mesh has a group {}{}",
                set.name,
                group.group,
                suggestion(&group.group, &names.collect::<Vec<_>>())
            );
            return Err(Error::input(message).at(&group.span));
        }
        let ids = Runs::union(found.iter().map(|(ids, first)| (ids.ranges(), *first)));
        if !group.resolve(ids) {
            let message = format!(
                "[set.{}] mesh: the mesh has changed since it was read",
                set.name
            );
            return Err(Error::input(message).at(&group.span));
        }
    }
    Ok(())
}

fn check_set_ids(problem: &Problem, total: u64) -> Result<()> {
    for set in &problem.sets {
        if let Selector::Ids { ids, file, largest } = &set.selector
            && let Some(id) = ids.last().filter(|id| **id >= total)
        {
            let message = match file {
                None => format!(
                    "[set.{}] ids: no point has the id {id}; the ids of the {total} points are 0 to {}",
                    set.name,
                    total - 1
                ),
                Some(file) => {
                    let message = wrong_number(file, ids, *id, total);
                    format!("[set.{}] file: {message}", set.name)
                }
            };
            return Err(Error::input(message).at(largest));
        }
    }
    Ok(())
}

/// Create the message for an id that a file lists but no point has.
fn wrong_number(file: &IdFile, ids: &[u64], id: u64, total: u64) -> String {
    let IdFile { path, first } = file;
    let number = id + first;
    let line = id_file::line_of(path, number).map_or(String::new(), |line| format!(":{line}"));
    let last = total - 1 + first;
    // If the smallest number is above 0 and the largest is the number of points, the file probably numbers
    // the points from 1.
    let hint = if *first == 0 && id == total && ids[0] > 0 {
        "; if the first point of the file has the number 1, set `first_id = 1`"
    } else {
        ""
    };
    format!(
        "{}{line}: no point has the number {number}; the numbers of the {total} points are {first} to {last}{hint}",
        path.display()
    )
}

/// Return an error if a body has no points. `counts` has the number of points of each body, over all ranks.
fn check_no_empty_body(bodies: &[BodyPoints], dimension: usize, counts: &[u64]) -> Result<()> {
    match counts.iter().position(|count| *count == 0) {
        None => Ok(()),
        Some(empty) => {
            let body = &bodies[empty];
            let file;
            let why = match &body.points {
                PointSource::Lattice { .. } => {
                    "its shape is smaller than the spacing, or a later body covers it"
                }
                PointSource::File {
                    path,
                    columns: None,
                    ..
                } if matches!(columns::heading(path), Ok(None)) => {
                    let default = Columns::default_order(dimension);
                    file = format!(
                        "no row of its file belongs to it; the file has no header, so its columns are `{}`; \
                         use `points.columns` to name other columns",
                        default.names.join(" ")
                    );
                    &file
                }
                PointSource::File { .. } => "no row of its file belongs to it",
                PointSource::Mesh { .. } => "no element of its mesh belongs to it",
            };
            let message = format!("[body.{}]: has no points; {why}", body.name);
            Err(Error::input(message).at(&body.span))
        }
    }
}
