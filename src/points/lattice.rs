//! Points of lattice bodies: one at the centre of each cell, or one at each Gauss point of the cell. In
//! each direction, a Gauss point lies at ±√3/3 of half the edge from the centre (Emmrich & Weckner 2006, §4).

use crate::comm::Communicator;
use crate::error::{Error, Result};
use crate::problem::{Body, PointSource, Problem, Quadrature, Shape};

use super::region::{Region, TOLERANCE};
use super::{MAX_PER_RANK, Point, distance_squared, shape};

/// Binary logarithm of the maximum number of cells per rank. Testing so many cells takes some minutes.
const LOG2_CELLS_PER_RANK: u32 = 33;

/// Number of candidate cells in a sample. The sample gives an estimate of the fraction of candidate cells
/// that belong to a body.
const SAMPLES: u64 = 1 << 17;

/// Step of a low-discrepancy sequence in [0, 1): the inverse of the golden ratio.
const EVEN_STEP: f64 = 0.618_033_988_749_894_9;

/// Step of a low-discrepancy sequence in [0, 1)³: the powers −1, −2 and −3 of the positive root of x⁴ = x + 1
/// (Roberts 2018).
const EVEN_STEP_3D: [f64; 3] = [
    0.819_172_513_396_164_4,
    0.671_043_606_703_789_2,
    0.549_700_477_901_970_2,
];

/// A body of lattice cells. A cell belongs to the last body whose shape contains its centre.
pub struct LatticeBody<'a> {
    shape: &'a Shape,
    later: Vec<&'a Shape>,
    spacing: [f64; 3],
    origin: [f64; 3],
    dimension: usize,
    tolerance: f64,
    region: Region,
    /// All cells that the shape can overlap.
    overlap: Region,
    quadrature: Quadrature,
    out_of_plane_measure: f64,
}

impl<'a> LatticeBody<'a> {
    /// Create the lattice of the body with this index; `None` if its points do not come from a shape.
    ///
    /// # Errors
    /// If cells of the body are too far from the origin to be numbered.
    pub fn new(problem: &'a Problem, body: usize) -> Result<Option<Self>> {
        let lattice = |body: &'a Body| match &body.points {
            PointSource::Lattice {
                shape,
                spacing,
                origin,
                quadrature,
            } => Some((shape, *spacing, *origin, *quadrature)),
            PointSource::File { .. } | PointSource::Mesh { .. } => None,
        };
        let Some((shape, spacing, origin, quadrature)) = lattice(&problem.bodies[body]) else {
            return Ok(None);
        };
        let dimension = problem.dimension.count();
        let region = |margin| Region::new(shape, spacing, origin, dimension, margin);
        let (Some(region), Some(overlap)) = (region(0.0), region(0.5)) else {
            return Err(too_many(problem, body));
        };
        let later = problem.bodies[body + 1..].iter().filter_map(lattice);
        let edges = spacing[..dimension].iter().copied();
        Ok(Some(Self {
            shape,
            later: later.map(|(shape, ..)| shape).collect(),
            spacing,
            origin,
            dimension,
            tolerance: TOLERANCE * edges.fold(f64::INFINITY, f64::min),
            region,
            overlap,
            quadrature,
            out_of_plane_measure: problem.dimension.out_of_plane_measure(),
        }))
    }

    /// Return the number of candidate cells, whose centres can lie within the shape; saturates at `u64::MAX`.
    pub fn cells(&self) -> u64 {
        self.region.total()
    }

    /// Return the centre (m) of the candidate cell with this index; `None` if the cell does not belong to the
    /// body.
    pub fn centre(&self, index: u64) -> Option<[f64; 3]> {
        self.centre_of(self.region.cell(index))
    }

    /// Return the centre (m) of a cell; `None` if the cell does not belong to the body.
    fn centre_of(&self, cell: [i64; 3]) -> Option<[f64; 3]> {
        let centre = self.position(cell.map(|x| x as f64));
        self.contains(centre).then_some(centre)
    }

    /// Test whether a cell belongs to the body.
    pub fn has_cell(&self, cell: [i64; 3]) -> bool {
        self.centre_of(cell).is_some()
    }

    /// Return the cell whose centre is nearest to a position (m).
    pub fn cell_at(&self, position: [f64; 3]) -> [i64; 3] {
        self.index_at(position, 1.0)
    }

    /// Return the grid index of a position (m): the number of steps from the centre of cell 0, in each
    /// direction. A step is the edge of a cell, divided by `steps`.
    pub fn index_at(&self, position: [f64; 3], steps: f64) -> [i64; 3] {
        std::array::from_fn(|k| {
            if k < self.dimension {
                (steps * ((position[k] - self.origin[k]) / self.spacing[k] - 0.5)).round() as i64
            } else {
                0
            }
        })
    }

    /// Return the position (m) at an offset (in cell edges) from the centre of cell 0.
    pub fn position(&self, edges: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| {
            if k < self.dimension {
                self.origin[k] + (edges[k] + 0.5) * self.spacing[k]
            } else {
                0.0
            }
        })
    }

    /// Test whether a position (m) is within the shape, but not within the shape of a later body.
    fn contains(&self, position: [f64; 3]) -> bool {
        let within = |shape: &Shape| shape::contains(shape, position, self.tolerance);
        within(self.shape) && !self.later.iter().any(|shape| within(shape))
    }

    /// Return the volume of a cell, m³.
    pub fn cell_volume(&self) -> f64 {
        self.spacing[..self.dimension].iter().product::<f64>() * self.out_of_plane_measure
    }

    /// Return the number of points per cell.
    pub fn points_of_cell(&self) -> u64 {
        u64::from(self.quadrature.points(self.dimension))
    }

    /// Return the number of points. With many candidate cells, the number is estimated from sampled cells.
    pub fn points(&self) -> f64 {
        let belongs = |index: &u64| self.centre(*index).is_some();
        let (cells, all) = (self.cells(), self.cells() as f64);
        let fraction = if cells <= SAMPLES {
            (0..cells).filter(belongs).count() as f64 / all.max(1.0)
        } else {
            let found = even_samples(SAMPLES, cells).filter(belongs).count();
            found as f64 / SAMPLES as f64
        };
        fraction * all * self.points_of_cell() as f64
    }

    /// Return the centres (m) of at most `count` sampled cells of the body.
    pub fn some_centres(&self, count: u64) -> Vec<[f64; 3]> {
        let centres = even_samples(SAMPLES, self.cells()).filter_map(|index| self.centre(index));
        centres.take(count as usize).collect()
    }

    /// Return an upper bound on the number of cells whose centres are within a distance (m) of the centre of
    /// a cell.
    pub fn cells_within(&self, distance: f64) -> f64 {
        let width = |k: usize| {
            let all = self.region.range(k).count() as f64;
            all.min(2.0 * (distance / self.spacing[k]).floor() + 1.0)
        };
        (0..self.dimension).map(width).product()
    }

    /// Return the number of the body's points near a position (m). All points of a cell count if the centre
    /// of the cell is at most `distance` (m) from the position.
    pub fn count_near(&self, position: [f64; 3], distance: f64) -> u64 {
        let range = |k: usize| {
            let all = self.region.range(k);
            if k >= self.dimension {
                return all;
            }
            let cell = |x: f64| (x - self.origin[k]) / self.spacing[k] - 0.5;
            let first = cell(position[k] - distance).ceil() as i64;
            let last = cell(position[k] + distance).floor() as i64;
            first.max(*all.start())..=last.min(*all.end())
        };
        let mut count = 0;
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let near = |centre: &[f64; 3]| {
                        distance_squared(*centre, position) <= distance * distance
                    };
                    let centre = self.centre_of([x, y, z]);
                    count += u64::from(centre.as_ref().is_some_and(near));
                }
            }
        }
        count * self.points_of_cell()
    }

    /// Estimate the volume (m³) of the shape without the parts that later bodies occupy. The estimate uses
    /// evenly distributed positions.
    pub fn shape_volume(&self) -> f64 {
        let (region, all) = (&self.overlap, self.overlap.total() as f64);
        let samples = (SAMPLES / region.total().max(1) + 1) * region.total().min(SAMPLES);
        let mut within = 0;
        for k in 0..samples {
            // With few cells, sample each cell equally often. With many cells, sample some cells once.
            let index = if region.total() <= SAMPLES {
                k % region.total()
            } else {
                ((k as f64 * EVEN_STEP).fract() * all) as u64
            };
            let cell = region.cell(index);
            let mut position = [0.0; 3];
            for d in 0..self.dimension {
                let fraction = (k as f64 * EVEN_STEP_3D[d]).fract();
                position[d] = self.origin[d] + (cell[d] as f64 + fraction) * self.spacing[d];
            }
            within += u64::from(self.contains(position));
        }
        within as f64 / samples.max(1) as f64 * all * self.cell_volume()
    }
}

/// Return `samples` evenly distributed integers below `count`; none if `count` is 0.
fn even_samples(samples: u64, count: u64) -> impl Iterator<Item = u64> {
    let at = move |k: u64| ((k as f64 * EVEN_STEP).fract() * count as f64) as u64;
    (0..if count == 0 { 0 } else { samples }).map(at)
}

/// Generate this rank's piece of a body's points, all with the id 0. Cells are ordered so that x varies
/// fastest. Each rank generates the points of consecutive cells.
///
/// # Errors
/// If cells are too far from the origin to be numbered.
pub(super) fn piece(problem: &Problem, body: usize, comm: &dyn Communicator) -> Result<Vec<Point>> {
    let Some(lattice) = LatticeBody::new(problem, body)? else {
        return Ok(Vec::new());
    };
    let total = lattice.cells();
    let (rank, size) = (comm.rank() as u64, comm.size() as u64);
    let start = |rank: u64| (u128::from(total) * u128::from(rank) / u128::from(size)) as u64;
    let count = lattice.points_of_cell();
    let volume = lattice.cell_volume();
    let mut points = Vec::new();
    for index in start(rank)..start(rank + 1) {
        let Some(centre) = lattice.centre(index) else {
            continue;
        };
        if count == 1 {
            points.push(Point::new(0, centre, volume, body));
            continue;
        }
        for corner in 0..count {
            let mut position = centre;
            for k in 0..lattice.dimension {
                let shift = lattice.spacing[k] / 12.0_f64.sqrt();
                position[k] += if corner >> k & 1 == 1 { shift } else { -shift };
            }
            points.push(Point::new(0, position, volume / count as f64, body));
        }
    }
    Ok(points)
}

/// Check the number of cells and points of a body against the limits per rank.
///
/// # Errors
/// If there are too many cells or points, or if cells are too far from the origin to be numbered. The message
/// names the body; the error is the same on all ranks.
pub fn is_feasible(problem: &Problem, body: usize, ranks: usize) -> Result<()> {
    let Some(lattice) = LatticeBody::new(problem, body)? else {
        return Ok(());
    };
    if lattice.cells() > (ranks as u64) << LOG2_CELLS_PER_RANK {
        return Err(too_many(problem, body));
    }
    let limit = MAX_PER_RANK * ranks as f64;
    if lattice.cells() as f64 > limit && lattice.points() > limit {
        let message = format!(
            "[body.{}]: about {:.1e} points are too many for {ranks} rank(s); a rank can hold fewer than 2.1e9 points; \
             use more ranks, or check that the spacing is in metres",
            problem.bodies[body].name,
            lattice.points()
        );
        return Err(Error::input(message).at(&problem.bodies[body].span));
    }
    Ok(())
}

fn too_many(problem: &Problem, body: usize) -> Error {
    let body = &problem.bodies[body];
    let message = format!(
        "[body.{}]: its lattice has too many cells; check that the spacing is in metres",
        body.name
    );
    Error::input(message).at(&body.span)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::Dimension;
    use crate::elastic::Isotropic;
    use crate::problem::{Law, Material};

    fn problem(spacing: f64, shape: Shape) -> Problem {
        let mut problem = Problem::new(Dimension::Space, 3.0, 1.0);
        let elastic = Isotropic {
            youngs_modulus: 5.0,
            poisson_ratio: 0.25,
        };
        let glass = Material::new(Law::named("pmb").unwrap(), 2.0, elastic);
        problem.add_body("block", glass, None, shape, spacing);
        problem
    }

    #[test]
    fn the_estimated_number_of_points() {
        let ball = Shape::Ball {
            centre: [0.0; 3],
            radius: 1.0,
        };
        let volume = 4.0 / 3.0 * std::f64::consts::PI;
        for spacing in [0.1_f64, 1e-2, 1e-4] {
            let problem = problem(spacing, ball.clone());
            let found = LatticeBody::new(&problem, 0).unwrap().unwrap().points();
            let expected = volume / spacing.powi(3);
            assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
        }
        let cube = Shape::Box {
            lower: [0.0; 3],
            upper: [1.0; 3],
        };
        let cube = problem(5e-4, cube);
        let cube = LatticeBody::new(&cube, 0).unwrap().unwrap();
        assert_eq!(cube.points(), 8e9);
    }
}
