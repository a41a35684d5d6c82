//! Mass, volume and centre of each body, and a check of its volume.

use crate::comm::ExactSum;
use crate::comm::sum::reduce;
use crate::dimension::Dimension;
use crate::error::Warning;
use crate::points::{LatticeBody, distance_squared};
use crate::problem::{Body, PointSource, Problem};
use crate::solver::Simulation;

/// Largest relative difference between the volume of all points and the volume of the shape; a warning is
/// printed for a larger difference.
const VOLUME_SLACK: f64 = 5e-3;

/// Largest factor between the mean volume of the points of a file or mesh and the volume of a reference cell.
/// The edge of this cell is the mean distance to the nearest neighbour. A warning is printed if the mean
/// volume is larger or smaller by more than this factor.
const VOLUME_FACTOR: f64 = 10.0;

/// Number, volume, mass, centre and neighbours of a body's points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyFigures {
    /// Number of points.
    pub points: u64,
    /// Volume, m³.
    pub volume: f64,
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass, m.
    pub centre: [f64; 3],
    /// Volume of the shape without the parts that bodies later in the deck occupy, m³; `None` for points from
    /// a file or mesh.
    pub shape_volume: Option<f64>,
    /// Mean distance to the nearest neighbour for points from a file or mesh, m; 0 if there are no
    /// neighbours.
    pub spacing: f64,
    /// Smallest, median and largest number of neighbours per point; bonds that pre-cracks cut do not count.
    /// `None` for bodies on a lattice.
    pub neighbours: Option<[u64; 3]>,
}

impl BodyFigures {
    /// Return the mean spacing of the points, m: the edge of a cell with the mean volume of a point.
    pub fn mean_spacing(&self, dimension: Dimension) -> f64 {
        dimension.edge(self.volume / self.points as f64)
    }

    /// Test whether the mean volume of points from a file or a mesh equals the volume of a reference cell,
    /// within a factor of `VOLUME_FACTOR`. The edge of this cell is the mean distance to the nearest
    /// neighbour. `None` for points without neighbours.
    pub fn volumes_fit(&self, dimension: Dimension) -> Option<bool> {
        let cell = self.cell(dimension);
        let ratio = self.volume / self.points as f64 / cell;
        (cell > 0.0).then(|| (VOLUME_FACTOR.recip()..=VOLUME_FACTOR).contains(&ratio))
    }

    /// Return the volume of a cell whose edge is the mean distance to the nearest neighbour, m³.
    fn cell(&self, dimension: Dimension) -> f64 {
        self.spacing.powi(dimension.count() as i32) * dimension.out_of_plane_measure()
    }
}

/// Collect the figures of all bodies, with warnings about inconsistent volumes. Collective.
pub fn figures<const D: usize>(
    simulation: &Simulation<'_, D>,
    warnings: &mut Vec<Warning>,
) -> Vec<BodyFigures> {
    let (problem, model) = (simulation.problem, &simulation.model);
    let nearest = nearest_neighbours(simulation);
    let neighbours = neighbours(simulation);
    let mut counts = vec![0; 2 * problem.bodies.len()];
    // Five sums per body: volume, three first moments of volume, and distance to the nearest neighbour.
    let mut sums = vec![ExactSum::ZERO; 5 * problem.bodies.len()];
    for point in 0..model.owned() {
        let body = problem.body_of(usize::from(model.block[point]));
        let (volume, position) = (model.volume[point], model.position(point));
        let sums = &mut sums[5 * body..];
        sums[0].add(volume);
        (0..3).for_each(|k| sums[1 + k].add(volume * position[k]));
        counts[2 * body] += 1;
        if let Some(distance) = nearest.get(point).filter(|distance| distance.is_finite()) {
            sums[4].add(*distance);
            counts[2 * body + 1] += 1;
        }
    }
    simulation.comm.sum(&mut counts);
    let sums = reduce(simulation.comm, &mut sums);
    let bodies = problem.bodies.iter().zip(sums.chunks_exact(5)).enumerate();
    let figures = bodies.map(|(index, (body, sums))| BodyFigures {
        points: counts[2 * index],
        volume: sums[0],
        mass: body.material.density * sums[0],
        centre: std::array::from_fn(|k| sums[1 + k] / sums[0]),
        shape_volume: shape_volume(problem, index),
        spacing: sums[4] / (counts[2 * index + 1].max(1)) as f64,
        neighbours: neighbours[index],
    });
    let figures: Vec<BodyFigures> = figures.collect();
    for (index, body) in figures.iter().enumerate() {
        warnings.extend(volume_warning(problem, index, body));
    }
    figures
}

fn shape_volume(problem: &Problem, body: usize) -> Option<f64> {
    let lattice = LatticeBody::new(problem, body).ok()??;
    Some(lattice.shape_volume())
}

/// Return the distance (m) of each owned point to its nearest bonded neighbour. The distance of a point
/// without bonds is infinite. The result is empty if no body has points from a file or mesh.
fn nearest_neighbours<const D: usize>(simulation: &Simulation<'_, D>) -> Vec<f64> {
    let (problem, model) = (simulation.problem, &simulation.model);
    if !problem.bodies.iter().any(is_from_file) {
        return Vec::new();
    }
    let mut squares = vec![f64::INFINITY; model.owned()];
    simulation.forces.for_each_intact(|i, j| {
        let square = distance_squared(model.position(i), model.position(j));
        squares[i] = squares[i].min(square);
    });
    squares.into_iter().map(f64::sqrt).collect()
}

/// Test whether a body's points come from a file or a mesh.
fn is_from_file(body: &Body) -> bool {
    !matches!(body.points, PointSource::Lattice { .. })
}

/// Return [`BodyFigures::neighbours`] of each body. Collective.
fn neighbours<const D: usize>(simulation: &Simulation<'_, D>) -> Vec<Option<[u64; 3]>> {
    let (problem, model) = (simulation.problem, &simulation.model);
    let bodies = problem.bodies.iter().enumerate();
    let scattered = bodies
        .filter(|(_, body)| !body.is_on_lattice(problem.jitter))
        .map(|(index, _)| index);
    let scattered: Vec<usize> = scattered.collect();
    let mut found = vec![None; problem.bodies.len()];
    if scattered.is_empty() {
        return found;
    }
    let mut counts = vec![0_usize; model.owned()];
    simulation.forces.for_each_intact(|i, _| counts[i] += 1);
    let mut largest = [counts.iter().copied().max().unwrap_or(0) as f64];
    simulation.comm.max(&mut largest);
    let width = largest[0] as usize + 1;
    // Number of points, by body and by number of neighbours.
    let mut histogram = vec![0; scattered.len() * width];
    for (point, count) in counts.iter().enumerate() {
        let body = problem.body_of(usize::from(model.block[point]));
        if let Ok(row) = scattered.binary_search(&body) {
            histogram[row * width + count] += 1;
        }
    }
    simulation.comm.sum(&mut histogram);
    for (body, row) in scattered.iter().zip(histogram.chunks_exact(width)) {
        let last = row.iter().sum::<u64>().saturating_sub(1);
        // Number of neighbours of the point at `position` in a list of the points sorted by number of
        // neighbours.
        let sorted = |position: u64| {
            let mut below = 0;
            let count = row.iter().position(|points| {
                below += points;
                below > position
            });
            count.unwrap_or(0) as u64
        };
        found[*body] = Some([0, last / 2, last].map(sorted));
    }
    found
}

/// Return a warning if the volume of a body's points does not fit the volume of its shape. For points from a
/// file or mesh, return a warning if their mean volume does not fit their mean distance to the nearest
/// neighbour.
fn volume_warning(problem: &Problem, index: usize, figures: &BodyFigures) -> Option<Warning> {
    let body = &problem.bodies[index];
    let message = if let Some(volume) = figures.shape_volume {
        let excess = figures.volume / volume - 1.0;
        if excess.abs() < VOLUME_SLACK {
            return None;
        }
        let size = if excess > 0.0 { "large" } else { "small" };
        format!(
            "[body.{}]: the grid does not divide this body evenly: its volume and mass are {:.2} % too {size}; choose \
             a spacing that divides its edges",
            body.name,
            100.0 * excess.abs()
        )
    } else {
        if figures.volumes_fit(problem.dimension) != Some(false) {
            return None;
        }
        let cell = figures.cell(problem.dimension);
        let mean = figures.volume / figures.points as f64;
        format!(
            "[body.{}] points: the mean volume is {mean:.3e} m³, but a cell of the mean distance of the points, {:.3e} m, \
             has {cell:.3e} m³; check that volumes are in m³",
            body.name, figures.spacing
        )
    };
    let span = match &body.points {
        PointSource::Lattice { .. } => &body.span,
        PointSource::File { span, .. } | PointSource::Mesh { span, .. } => span,
    };
    Some(Warning::new(message).at(span))
}
