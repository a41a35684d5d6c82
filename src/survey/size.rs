//! How large a run is, from its problem: without making its points, of which there may be too many.

use crate::dimension::Dimension;
use crate::error::Result;
use crate::points::{LatticeBody, file, set};
use crate::problem::{PointSource, Problem, Selector};
use crate::solver::assign::cutoffs;

/// Cells looked at, of all samples together, to count neighbours.
const MOST_LOOKS: f64 = 4e6;

/// Points of each body whose neighbours are counted, at most.
const SAMPLES: u64 = 400;

/// The size of a run, about.
#[derive(Debug, Clone, PartialEq)]
pub struct Size {
    /// Lattice cells that have to be gone through.
    pub cells: f64,
    /// Number of points of each body.
    pub points: Vec<f64>,
    /// Bonds of the points of each body; those of all bodies count each bond from both ends.
    pub bonds: Vec<f64>,
    /// Number of points of the result.
    pub held: f64,
}

impl Size {
    /// Number of all points.
    pub fn all_points(&self) -> f64 {
        self.points.iter().sum()
    }

    /// Number of all bonds, each counted from both ends.
    pub fn directed_bonds(&self) -> f64 {
        self.bonds.iter().sum()
    }
}

/// Finds the size of a run.
///
/// # Errors
/// When lattice cells are too far away to be numbered.
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
        held: 0.0,
    };
    let (cutoffs, all) = (cutoffs(problem), size.all_points());
    for (here, body) in bodies.iter().enumerate() {
        let neighbours = match body {
            Some(lattice) => {
                let reach = &cutoffs[here * problem.block_count()..][..bodies.len()];
                neighbours(lattice, &bodies, reach)
            }
            None => {
                let volume = files[here].volume / files[here].points;
                (family_volume(problem, here) / volume).min(all) - 1.0
            }
        };
        // A body without points has no mean volume.
        size.bonds.push(size.points[here] * neighbours.max(0.0));
    }
    size.held = held(problem, &bodies, &files, &size.points);
    Ok(size)
}

/// The mean number of neighbours of a body's points on all lattices, from some of them.
fn neighbours(body: &LatticeBody, others: &[Option<LatticeBody>], reach: &[f64]) -> f64 {
    let lattices = || {
        let pairs = others.iter().zip(reach);
        pairs.filter_map(|(other, reach)| Some((other.as_ref()?, *reach)))
    };
    let looks: f64 = lattices()
        .map(|(other, reach)| other.cells_within(reach))
        .sum();
    let samples = ((MOST_LOOKS / looks) as u64).clamp(1, SAMPLES);
    let places = body.some_centres(samples);
    if places.is_empty() {
        return 0.0;
    }
    let mut found = 0;
    for place in &places {
        for (other, reach) in lattices() {
            found += other.count_near(*place, reach);
        }
    }
    // A point is not its own neighbour.
    (found as f64 / places.len() as f64 - 1.0).max(0.0)
}

/// The points of a body from a file.
#[derive(Clone, Copy, Default)]
struct Rows {
    points: f64,
    /// Volume of all points, m³.
    volume: f64,
    /// Number of points that are in the set of the result, if there is one.
    held: f64,
}

/// The points of each body that are rows of a file.
fn from_files(problem: &Problem) -> Vec<Rows> {
    let mut rows = vec![Rows::default(); problem.bodies.len()];
    for (index, body) in problem.bodies.iter().enumerate() {
        let PointSource::File { path, .. } = &body.points else {
            continue;
        };
        // The first body that takes rows of a file counts those of all bodies.
        if file::users(problem, path)[0].0 != index {
            continue;
        }
        let Some((points, weight)) = file::sample(problem, path) else {
            continue;
        };
        for point in points {
            let body = point.block as usize;
            rows[body].points += weight;
            rows[body].volume += weight * point.volume;
            rows[body].held += weight * f64::from(u8::from(is_held(problem, body, point.position)));
        }
    }
    rows
}

/// The volume (m³) within the horizon of a point of a body.
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

/// Whether a point of a body at a position (m) is in the set of the result, which is not one of ids.
fn is_held(problem: &Problem, body: usize, position: [f64; 3]) -> bool {
    let set = problem.output.set.as_ref();
    set.is_none_or(|(set, _)| {
        set::contains(&problem.sets[*set], problem.horizon, 0, position, body)
    })
}

/// The number of points of the result, from some points of each body.
fn held(problem: &Problem, bodies: &[Option<LatticeBody>], files: &[Rows], points: &[f64]) -> f64 {
    let Some((set, _)) = &problem.output.set else {
        return points.iter().sum();
    };
    if let Selector::Ids { ids, .. } = &problem.sets[*set].selector {
        return ids.len() as f64;
    }
    let of_body = |(index, body): (usize, &Option<LatticeBody>)| match body {
        None => files[index].held,
        Some(lattice) => {
            let centres = lattice.some_centres(u64::MAX);
            let held = centres
                .iter()
                .filter(|centre| is_held(problem, index, **centre))
                .count();
            points[index] * held as f64 / centres.len().max(1) as f64
        }
    };
    bodies.iter().enumerate().map(of_body).sum()
}
