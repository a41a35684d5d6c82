//! How large a run is, from its plan: without making its points, of which there may be too many.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use crate::deck::plan::{Plan, PointSource};
use crate::dimension::Dimension;
use crate::error::Result;
use crate::points::LatticeBody;
use crate::solver::assign::cutoffs;

/// Cells looked at, of all samples together, to count neighbours.
const MOST_LOOKS: f64 = 4e6;

/// Points of each body whose neighbours are counted, at most.
const SAMPLES: u64 = 400;

/// Rows of a point file that are read to know the others.
const ROWS: usize = 1000;

/// The size of a run, about.
#[derive(Debug, Clone, PartialEq)]
pub struct Size {
    /// Lattice cells that have to be gone through.
    pub cells: f64,
    /// Number of points of each body.
    pub points: Vec<f64>,
    /// Bonds, each counted from both ends.
    pub directed_bonds: f64,
}

impl Size {
    /// Number of all points.
    pub fn all_points(&self) -> f64 {
        self.points.iter().sum()
    }
}

/// Finds the size of a run.
///
/// # Errors
/// When lattice cells are too far away to be numbered.
pub fn size(plan: &Plan) -> Result<Size> {
    let bodies = (0..plan.bodies.len())
        .map(|body| LatticeBody::new(plan, body))
        .collect::<Result<Vec<_>>>()?;
    let cutoffs = cutoffs(plan);
    let mut size = Size {
        cells: 0.0,
        points: Vec::new(),
        directed_bonds: 0.0,
    };
    for (here, body) in bodies.iter().enumerate() {
        let (points, neighbours) = match body {
            Some(lattice) => {
                size.cells += lattice.cells() as f64;
                let reach = &cutoffs[here * plan.block_count()..][..bodies.len()];
                (lattice.points(), neighbours(lattice, &bodies, reach))
            }
            None => from_file(plan, here),
        };
        size.directed_bonds += points * neighbours;
        size.points.push(points);
    }
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

/// Points of a file, and how many of them lie within a horizon, as if all rows were like the first ones.
fn from_file(plan: &Plan, body: usize) -> (f64, f64) {
    let PointSource::File { path, .. } = &plan.bodies[body].points else {
        return (0.0, 0.0);
    };
    let Some((rows, volume)) = rows(path, plan.dimension.count()) else {
        return (0.0, 0.0);
    };
    let horizon = plan.bodies[body].horizon;
    let ball = match plan.dimension {
        Dimension::Space => 4.0 / 3.0 * std::f64::consts::PI * horizon.powi(3),
        Dimension::PlaneStress { thickness } | Dimension::PlaneStrain { thickness } => {
            std::f64::consts::PI * horizon * horizon * thickness
        }
        Dimension::Line { cross_section, .. } => 2.0 * horizon * cross_section,
    };
    (rows, (ball / volume).min(rows))
}

/// The number of rows of a file and the mean volume of its points (m³), from its beginning and length.
fn rows(path: &Path, dimension: usize) -> Option<(f64, f64)> {
    if !std::fs::metadata(path).ok()?.is_file() {
        return None;
    }
    let file = File::open(path).ok()?;
    let length = file.metadata().ok()?.len() as f64;
    let (mut bytes, mut rows, mut volume) = (0.0, 0.0, 0.0);
    for line in BufReader::new(file).lines().take(ROWS) {
        let line = line.ok()?;
        bytes += line.len() as f64 + 1.0;
        let entries = line
            .split([',', ';', ' ', '\t'])
            .filter(|entry| !entry.is_empty());
        if let Some(Ok(value)) = entries.map(str::parse::<f64>).nth(dimension) {
            rows += 1.0;
            volume += value;
        }
    }
    (rows > 0.0).then(|| (rows * (length / bytes).max(1.0), volume / rows))
}
