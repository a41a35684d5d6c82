//! Points in lattice cells, made in pieces: one at the centre of each, or at the places of the Gauss
//! rule, ±√3/3 of half the edge by direction (Emmrich & Weckner 2006, §4).

use crate::comm::Communicator;
use crate::error::{Error, Result};
use crate::problem::{Body, PointSource, Problem, Quadrature, Shape};

use super::region::{Region, TOLERANCE};
use super::{MOST_A_RANK, Point, distance_squared, shape};

/// Binary logarithm of the cells that one rank goes through; some minutes' worth.
const CELLS_A_RANK: u32 = 33;

/// Cells looked at to estimate how many of a region belong to a body.
const SAMPLES: u64 = 1 << 17;

/// Consecutive multiples of this share of 1, less whole numbers, fill it evenly: the golden ratio.
const EVENLY: f64 = 0.618_033_988_749_894_9;

/// The same for places in a cube: powers of the root of x⁴ = x + 1 (Roberts 2018).
const EVENLY_IN: [f64; 3] = [
    0.819_172_513_396_164_4,
    0.671_043_606_703_789_2,
    0.549_700_477_901_970_2,
];

/// A body made of lattice cells. A cell belongs to it if its centre lies within its shape; one that also
/// lies in a later lattice body is left to that one.
pub struct LatticeBody<'a> {
    shape: &'a Shape,
    later: Vec<&'a Shape>,
    spacing: [f64; 3],
    origin: [f64; 3],
    dimension: usize,
    tolerance: f64,
    region: Region,
    /// All cells that the shape can touch.
    around: Region,
    quadrature: Quadrature,
    out_of_plane_measure: f64,
}

impl<'a> LatticeBody<'a> {
    /// A body of a problem, by index; `None` if it has its points from a file.
    ///
    /// # Errors
    /// When its cells are too far away to be numbered.
    pub fn new(problem: &'a Problem, body: usize) -> Result<Option<Self>> {
        let lattice = |body: &'a Body| match &body.points {
            PointSource::Lattice {
                shape,
                spacing,
                origin,
            } => Some((shape, *spacing, *origin)),
            PointSource::File { .. } => None,
        };
        let Some((shape, spacing, origin)) = lattice(&problem.bodies[body]) else {
            return Ok(None);
        };
        let dimension = problem.dimension.count();
        let region = |margin| Region::new(shape, spacing, origin, dimension, margin);
        let (Some(region), Some(around)) = (region(0.0), region(0.5)) else {
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
            around,
            quadrature: problem.quadrature,
            out_of_plane_measure: problem.dimension.out_of_plane_measure(),
        }))
    }

    /// Number of cells whose centres can lie within the shape, at most the largest number there is.
    pub fn cells(&self) -> u64 {
        self.region.total()
    }

    /// The centre (m) of one of these cells, if it belongs to the body.
    pub fn centre(&self, index: u64) -> Option<[f64; 3]> {
        self.centre_of(self.region.cell(index))
    }

    /// The centre (m) of a cell, if it belongs to the body.
    fn centre_of(&self, cell: [i64; 3]) -> Option<[f64; 3]> {
        let centre = self.place(cell.map(|x| x as f64));
        self.contains(centre).then_some(centre)
    }

    /// Whether a cell belongs to the body.
    pub fn has_cell(&self, cell: [i64; 3]) -> bool {
        self.centre_of(cell).is_some()
    }

    /// The cell whose centre is at a place (m).
    pub fn cell_at(&self, place: [f64; 3]) -> [i64; 3] {
        self.place_at(place, 1.0)
    }

    /// A place (m) in steps, so many an edge, from the centre of cell 0.
    pub fn place_at(&self, place: [f64; 3], steps: f64) -> [i64; 3] {
        std::array::from_fn(|k| {
            if k < self.dimension {
                (steps * ((place[k] - self.origin[k]) / self.spacing[k] - 0.5)).round() as i64
            } else {
                0
            }
        })
    }

    /// The place (m) that lies so many edges from the centre of cell 0.
    pub fn place(&self, edges: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| {
            if k < self.dimension {
                self.origin[k] + (edges[k] + 0.5) * self.spacing[k]
            } else {
                0.0
            }
        })
    }

    /// Whether a place (m) is within the shape and in no later body.
    fn contains(&self, place: [f64; 3]) -> bool {
        let within = |shape: &Shape| shape::contains(shape, place, self.tolerance);
        within(self.shape) && !self.later.iter().any(|shape| within(shape))
    }

    /// Volume of a cell, m³.
    pub fn cell_volume(&self) -> f64 {
        self.spacing[..self.dimension].iter().product::<f64>() * self.out_of_plane_measure
    }

    /// Number of points of a cell.
    pub fn points_of_cell(&self) -> u64 {
        u64::from(self.quadrature.points(self.dimension))
    }

    /// Number of points; of a large region an estimate from some of its cells.
    pub fn points(&self) -> f64 {
        let belongs = |index: &u64| self.centre(*index).is_some();
        let (cells, all) = (self.cells(), self.cells() as f64);
        let share = if cells <= SAMPLES {
            (0..cells).filter(belongs).count() as f64 / all.max(1.0)
        } else {
            let found = evenly(SAMPLES, cells).filter(belongs).count();
            found as f64 / SAMPLES as f64
        };
        share * all * self.points_of_cell() as f64
    }

    /// The centres (m) of about so many of the body's cells, spread evenly.
    pub fn some_centres(&self, count: u64) -> Vec<[f64; 3]> {
        let centres = evenly(SAMPLES, self.cells()).filter_map(|index| self.centre(index));
        centres.take(count as usize).collect()
    }

    /// Number of cells that are at most a distance (m) from a place, about.
    pub fn cells_within(&self, distance: f64) -> f64 {
        let width = |k: usize| {
            let all = self.region.range(k).count() as f64;
            all.min(2.0 * (distance / self.spacing[k]).floor() + 1.0)
        };
        (0..self.dimension).map(width).product()
    }

    /// Number of the body's points in cells whose centres are at most a distance (m) from a place (m).
    pub fn count_near(&self, place: [f64; 3], distance: f64) -> u64 {
        let range = |k: usize| {
            let all = self.region.range(k);
            if k >= self.dimension {
                return all;
            }
            let cell = |x: f64| (x - self.origin[k]) / self.spacing[k] - 0.5;
            let first = cell(place[k] - distance).ceil() as i64;
            let last = cell(place[k] + distance).floor() as i64;
            first.max(*all.start())..=last.min(*all.end())
        };
        let mut count = 0;
        for z in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let near =
                        |centre: &[f64; 3]| distance_squared(*centre, place) <= distance * distance;
                    let centre = self.centre_of([x, y, z]);
                    count += u64::from(centre.as_ref().is_some_and(near));
                }
            }
        }
        count * self.points_of_cell()
    }

    /// The volume (m³) of the shape less that of later bodies, from places that fill it evenly.
    pub fn shape_volume(&self) -> f64 {
        let (region, all) = (&self.around, self.around.total() as f64);
        let samples = (SAMPLES / region.total().max(1) + 1) * region.total().min(SAMPLES);
        let mut within = 0;
        for k in 0..samples {
            // The same number of places in each cell, or in each of some cells.
            let index = if region.total() <= SAMPLES {
                k % region.total()
            } else {
                ((k as f64 * EVENLY).fract() * all) as u64
            };
            let cell = region.cell(index);
            let mut place = [0.0; 3];
            for d in 0..self.dimension {
                let share = (k as f64 * EVENLY_IN[d]).fract();
                place[d] = self.origin[d] + (cell[d] as f64 + share) * self.spacing[d];
            }
            within += u64::from(self.contains(place));
        }
        within as f64 / samples.max(1) as f64 * all * self.cell_volume()
    }
}

/// So many of the numbers below a count, spread evenly.
fn evenly(samples: u64, count: u64) -> impl Iterator<Item = u64> {
    let at = move |k: u64| ((k as f64 * EVENLY).fract() * count as f64) as u64;
    (0..if count == 0 { 0 } else { samples }).map(at)
}

/// This rank's piece of a body's points; ids count from 0 within the piece. Cells are numbered with
/// x fastest, and ranks take consecutive ranges of them.
///
/// # Errors
/// When cells are too far away to be numbered.
pub(super) fn piece(problem: &Problem, body: usize, comm: &dyn Communicator) -> Result<Vec<Point>> {
    let Some(lattice) = LatticeBody::new(problem, body)? else {
        return Ok(Vec::new());
    };
    let total = lattice.cells();
    let (rank, size) = (comm.rank() as u64, comm.size() as u64);
    let share = |rank: u64| (u128::from(total) * u128::from(rank) / u128::from(size)) as u64;
    let count = lattice.points_of_cell();
    let volume = lattice.cell_volume();
    let mut points = Vec::new();
    for index in share(rank)..share(rank + 1) {
        let Some(centre) = lattice.centre(index) else {
            continue;
        };
        if count == 1 {
            points.push(Point::new(0, centre, volume, body));
            continue;
        }
        for corner in 0..count {
            let mut place = centre;
            for k in 0..lattice.dimension {
                let shift = lattice.spacing[k] / 12.0_f64.sqrt();
                place[k] += if corner >> k & 1 == 1 { shift } else { -shift };
            }
            points.push(Point::new(0, place, volume / count as f64, body));
        }
    }
    Ok(points)
}

/// Whether so many ranks can go through a body's cells and hold its points, as far as both are known
/// beforehand.
///
/// # Errors
/// Names the body; the same on all ranks.
pub fn is_feasible(problem: &Problem, body: usize, ranks: usize) -> Result<()> {
    let Some(lattice) = LatticeBody::new(problem, body)? else {
        return Ok(());
    };
    if lattice.cells() > (ranks as u64) << CELLS_A_RANK {
        return Err(too_many(problem, body));
    }
    let most = MOST_A_RANK * ranks as f64;
    if lattice.cells() as f64 > most && lattice.points() > most {
        let message = format!(
            "[body.{}]: about {:.1e} points are too many for {ranks} rank(s), of 2³¹ each at most; \
             use more ranks, or is the spacing not in m?",
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
        "[body.{}]: its lattice has too many cells; is the spacing in m?",
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
    fn points_are_counted_without_being_made() {
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
