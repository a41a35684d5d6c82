//! Estimated size of a run. The points of lattices are not generated, because they may be too many.

use crate::dimension::Dimension;
use crate::error::Result;
use crate::points::{BodyPoints, LatticeBody, file, mesh, set};
use crate::problem::{PointSource, Problem, Selector};
use crate::solver::assign::cutoffs;

/// Maximum number of lattice cells that are read to count the neighbours of all sampled points of a body.
const MAX_CELLS_READ: f64 = 4e6;

/// Maximum number of points per body at which neighbours are counted.
const SAMPLES: u64 = 400;

/// The estimated size of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Size {
    /// Number of lattice cells that are tested against the shapes.
    pub cells: f64,
    /// Number of points of each body.
    pub points: Vec<f64>,
    /// Number of neighbours summed over all points of each body. The total over all bodies counts each bond
    /// twice.
    pub bonds: Vec<f64>,
    /// Number of points in each result, the main one first.
    pub output_points: Vec<f64>,
}

impl Size {
    /// Return the number of all points.
    pub fn all_points(&self) -> f64 {
        self.points.iter().sum()
    }

    /// Return the number of bonds, counted at both ends.
    pub fn directed_bonds(&self) -> f64 {
        self.bonds.iter().sum()
    }
}

/// Estimate the size of a run.
///
/// # Errors
/// If lattice cells are too far from the origin to be numbered.
pub fn size(problem: &Problem) -> Result<Size> {
    let bodies = (0..problem.bodies.len())
        .map(|body| LatticeBody::new(problem, body))
        .collect::<Result<Vec<_>>>()?;
    let files = from_files(problem);
    let points = |index: usize| match &bodies[index] {
        Some(lattice) => lattice.points(),
        None => files[index].points,
    };
    let mut size = Size {
        cells: bodies
            .iter()
            .flatten()
            .map(|body| body.cells() as f64)
            .sum(),
        points: (0..bodies.len()).map(points).collect(),
        bonds: Vec::new(),
        output_points: Vec::new(),
    };
    let (cutoffs, all) = (cutoffs(problem), size.all_points());
    for (index, body) in bodies.iter().enumerate() {
        let neighbours = match body {
            Some(lattice) => {
                let reach = &cutoffs[index * problem.block_count()..][..bodies.len()];
                neighbours(lattice, &bodies, reach)
            }
            None => {
                let volume = files[index].volume / files[index].points;
                (family_volume(problem, index) / volume).min(all) - 1.0
            }
        };
        // `max` also replaces the NaN of a body without points.
        size.bonds.push(size.points[index] * neighbours.max(0.0));
    }
    let outputs = problem.outputs().enumerate();
    let counted = outputs.map(|(number, output)| {
        let set = output.set.as_ref().map(|(set, _)| *set);
        output_points(problem, (number, set), &bodies, (&files, &size.points))
    });
    size.output_points = counted.collect();
    Ok(size)
}

/// Return the mean number of neighbours that a point of a body has on the lattices of all bodies, from
/// sampled points. `reach` has the length of the longest bond to each of `others`, m.
fn neighbours(body: &LatticeBody, others: &[Option<LatticeBody>], reach: &[f64]) -> f64 {
    let lattices = || {
        let pairs = others.iter().zip(reach);
        pairs.filter_map(|(other, reach)| Some((other.as_ref()?, *reach)))
    };
    let cells: f64 = lattices()
        .map(|(other, reach)| other.cells_within(reach))
        .sum();
    let samples = ((MAX_CELLS_READ / cells) as u64).clamp(1, SAMPLES);
    let centres = body.some_centres(samples);
    if centres.is_empty() {
        return 0.0;
    }
    let mut found = 0;
    for centre in &centres {
        for (other, reach) in lattices() {
            found += other.count_near(*centre, reach);
        }
    }
    // A point is not its own neighbour.
    (found as f64 / centres.len() as f64 - 1.0).max(0.0)
}

/// Figures of a body whose points come from a file or a mesh.
#[derive(Clone, Default)]
struct Rows {
    points: f64,
    /// Volume of all points, m³.
    volume: f64,
    /// Number of points in each result.
    output_points: Vec<f64>,
}

/// Return one entry per body. For a body whose points come from a file or a mesh, the entry has the figures
/// of this body. For any other body, all numbers of the entry are 0.
fn from_files(problem: &Problem) -> Vec<Rows> {
    let none = Rows {
        output_points: vec![0.0; 1 + problem.further_outputs.len()],
        ..Rows::default()
    };
    let mut rows = vec![none; problem.bodies.len()];
    let bodies = BodyPoints::of(&problem.bodies);
    for (index, body) in problem.bodies.iter().enumerate() {
        // Each file is read once, for its first body.
        let sample = match &body.points {
            PointSource::File { path, .. } if file::users(&bodies, path)[0].0 == index => {
                file::sample(problem, path)
            }
            PointSource::Mesh { path, .. } if mesh::first_user(&bodies, path) == index => {
                mesh::read(problem, path)
                    .ok()
                    .map(|found| (found.points, 1.0))
            }
            _ => None,
        };
        let Some((points, weight)) = sample else {
            continue;
        };
        for point in points {
            let body = point.block as usize;
            rows[body].points += weight;
            rows[body].volume += weight * point.volume;
            for (output, count) in problem.outputs().zip(&mut rows[body].output_points) {
                let set = output.set.as_ref().map(|(set, _)| *set);
                let in_result = is_in_result(problem, set, body, point.position);
                *count += weight * f64::from(u8::from(in_result));
            }
        }
    }
    rows
}

/// Return the volume of a complete family of a body, m³.
fn family_volume(problem: &Problem, body: usize) -> f64 {
    let horizon = problem.bodies[body].horizon;
    match problem.dimension {
        Dimension::Space => 4.0 / 3.0 * std::f64::consts::PI * horizon.powi(3),
        Dimension::PlaneStress { thickness } | Dimension::PlaneStrain { thickness } => {
            std::f64::consts::PI * horizon * horizon * thickness
        }
        Dimension::Line { cross_section, .. } => 2.0 * horizon * cross_section,
    }
}

/// Test whether a point is in the set of an output; `None` is the set of all points. For sets of ids, the
/// result is meaningless and not used. If the set is a group of a mesh, the result is true for all points,
/// because the ids of the points of the group are not known yet.
fn is_in_result(problem: &Problem, set: Option<usize>, body: usize, position: [f64; 3]) -> bool {
    set.map(|set| &problem.sets[set]).is_none_or(|set| {
        matches!(set.selector, Selector::Mesh(_))
            || set::contains(set, problem.horizon, 0, position, body)
    })
}

/// Estimate the number of points in the result of an output, from sampled points of each body. `number` is
/// the index of the output, `set` is its set, and `points` has the number of points of each body.
fn output_points(
    problem: &Problem,
    (number, set): (usize, Option<usize>),
    bodies: &[Option<LatticeBody>],
    (files, points): (&[Rows], &[f64]),
) -> f64 {
    let Some(index) = set else {
        return points.iter().sum();
    };
    if let Selector::Ids { ids, .. } = &problem.sets[index].selector {
        return ids.len() as f64;
    }
    let of_body = |(index, body): (usize, &Option<LatticeBody>)| match body {
        None => files[index].output_points[number],
        Some(lattice) => {
            let centres = lattice.some_centres(u64::MAX);
            let selected = centres
                .iter()
                .filter(|centre| is_in_result(problem, set, index, **centre))
                .count();
            points[index] * selected as f64 / centres.len().max(1) as f64
        }
    };
    bodies.iter().enumerate().map(of_body).sum()
}
