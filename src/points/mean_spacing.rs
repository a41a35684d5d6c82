//! Mean spacing of the points of each body.

use crate::comm::sum::{ExactSum, reduce};
use crate::comm::{Communicator, agree};
use crate::dimension::Dimension;
use crate::error::Result;
use crate::problem::PointSource;

use super::{BodyPoints, Point, check_no_empty_body, file, mesh};

/// Return the mean spacing of each body's points, m; `None` for the bodies that are not `wanted`. Collective.
///
/// The mean spacing of N points from a file or a mesh is (V/N)^(1/D) in D dimensions. V is the total volume
/// of the points, divided in 2-D by the thickness and in 1-D by the cross-section. The mean spacing of a
/// lattice is the edge of a cell, or the geometric mean of the edges if they differ.
///
/// Files and meshes are read, but no points are kept. Each rank reads a part of a file, and rank 0 reads the
/// meshes. The result is the same on any number of ranks.
///
/// # Errors
/// If a file or mesh of a wanted body is unreadable or invalid. If this file or mesh has no points for one of
/// the bodies that use it. The error is the same on all ranks.
pub fn mean_spacings(
    bodies: &[BodyPoints],
    dimension: Dimension,
    wanted: &[bool],
    comm: &dyn Communicator,
) -> Result<Vec<Option<f64>>> {
    let mut volumes = vec![ExactSum::ZERO; bodies.len()];
    let mut counts = vec![0; bodies.len()];
    let mut is_read = vec![false; bodies.len()];
    for index in (0..bodies.len()).filter(|index| wanted[*index]) {
        if is_read[index] {
            continue;
        }
        let add = |point: Point| {
            volumes[point.block as usize].add(point.volume);
            counts[point.block as usize] += 1;
        };
        match bodies[index].points {
            PointSource::Lattice { .. } => {}
            PointSource::File { path, .. } => {
                file::for_each_point(bodies, dimension.count(), path, comm, add)?;
                let users = file::users(bodies, path);
                users.iter().for_each(|(user, _)| is_read[*user] = true);
            }
            PointSource::Mesh { path, .. } => {
                let points = match comm.rank() {
                    0 => mesh::read_points(bodies, dimension, path).map(|found| found.points),
                    _ => Ok(Vec::new()),
                };
                agree(comm, points)?.into_iter().for_each(add);
                let users = mesh::users(bodies, path);
                users.iter().for_each(|user| is_read[user.body] = true);
            }
        }
    }
    comm.sum(&mut counts);
    let volumes = reduce(comm, &mut volumes);
    // The points of bodies whose file or mesh was not read, and of lattices, are not counted. Assume one
    // point for each of these bodies, so that the check accepts them.
    let assumed: Vec<u64> = (counts.iter().zip(&is_read))
        .map(|(count, is_read)| if *is_read { *count } else { 1 })
        .collect();
    check_no_empty_body(bodies, dimension.count(), &assumed)?;
    let mean = |index: usize| match bodies[index].points {
        PointSource::Lattice { spacing, .. } => of_cell(&spacing[..dimension.count()]),
        _ => dimension.edge(volumes[index] / counts[index] as f64),
    };
    let mean = |index: usize| wanted[index].then(|| mean(index));
    Ok((0..bodies.len()).map(mean).collect())
}

/// Return the edge of a lattice cell, m. If the edges differ, return their geometric mean.
fn of_cell(edges: &[f64]) -> f64 {
    if edges.iter().all(|edge| *edge == edges[0]) {
        return edges[0];
    }
    libm::pow(edges.iter().product(), 1.0 / edges.len() as f64)
}
