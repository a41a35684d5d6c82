//! Points: where they come from, and the geometry that picks them.
//!
//! Every rank makes or reads its own piece; no rank ever holds all points.

pub mod bins;
pub mod crack;
pub(crate) mod file;
pub mod lattice;
mod polygon;
mod region;
pub mod set;
pub mod shape;

pub use lattice::LatticeBody;
pub use polygon::Polygon;

use bytemuck::{Pod, Zeroable};
use nalgebra::Vector3;

use crate::comm::{Communicator, agree};
use crate::error::{Error, Result};
use crate::problem::{PointSource, Problem, Selector};

/// The most points of a rank.
pub const MOST_A_RANK: f64 = 2_147_483_647.0;

/// A point as it travels between ranks.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Point {
    /// Global id, from 0 without gaps, the same on any number of ranks.
    pub id: u64,
    /// Reference position, m; components beyond the dimension are 0.
    pub position: [f64; 3],
    /// Volume, m³.
    pub volume: f64,
    /// Index of its body.
    pub block: u32,
    /// Keeps the record free of padding bytes.
    pub unused: u32,
}

impl Point {
    /// A point; see the fields.
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

/// Squared distance of two positions, m².
pub fn distance_squared(a: [f64; 3], b: [f64; 3]) -> f64 {
    let difference = Vector3::from(b) - Vector3::from(a);
    difference.dot(&difference)
}

/// This rank's piece of the points: a contiguous range of ids, and the total over all ranks.
///
/// # Errors
/// A body without points, an unreadable or wrong point file, a set with an id that no point has, more
/// points than a rank can number; the same on all ranks.
pub fn generate(problem: &Problem, comm: &dyn Communicator) -> Result<(Vec<Point>, u64)> {
    let mut points = Vec::new();
    let mut total = 0;
    for (index, body) in problem.bodies.iter().enumerate() {
        let mut piece = match &body.points {
            PointSource::Lattice { .. } => lattice::piece(problem, index, comm)?,
            PointSource::File { path, .. } => {
                if file::users(problem, path)[0].0 != index {
                    continue;
                }
                file::piece(problem, path, comm)?
            }
        };
        let (before, all) = crate::comm::scan(comm, piece.len() as u64);
        for (point, id) in piece.iter_mut().zip(total + before..) {
            point.id = id;
        }
        // Appending would copy the first piece, which most often is the only one.
        if points.is_empty() {
            points = piece
        } else {
            points.extend(piece)
        }
        total += all;
    }
    no_empty_body(problem, comm, &points)?;
    ids_are_those_of_points(problem, total)?;
    let fits = if (points.len() as f64) < MOST_A_RANK {
        Ok(())
    } else {
        Err(Error::run(
            "too many points for one rank (2³¹ at most); use more ranks",
        ))
    };
    agree(comm, fits)?;
    Ok((points, total))
}

fn ids_are_those_of_points(problem: &Problem, total: u64) -> Result<()> {
    for set in &problem.sets {
        if let Selector::Ids { ids, largest } = &set.selector
            && let Some(id) = ids.last().filter(|id| **id >= total)
        {
            let message = format!(
                "[set.{}] ids: no point has the id {id}; those of the {total} points are 0 to {}",
                set.name,
                total - 1
            );
            return Err(Error::input(message).at(largest));
        }
    }
    Ok(())
}

fn no_empty_body(problem: &Problem, comm: &dyn Communicator, points: &[Point]) -> Result<()> {
    let mut counts = vec![0; problem.bodies.len()];
    for point in points {
        counts[point.block as usize] += 1;
    }
    comm.sum(&mut counts);
    match counts.iter().position(|count| *count == 0) {
        None => Ok(()),
        Some(empty) => {
            let body = &problem.bodies[empty];
            let why = match &body.points {
                PointSource::Lattice { .. } => {
                    "is its shape smaller than the spacing, or covered by a later body?"
                }
                PointSource::File { .. } => "no row of its file is its own",
            };
            let message = format!("[body.{}]: has no points; {why}", body.name);
            Err(Error::input(message).at(&body.span))
        }
    }
}
