//! The separation energy of a body. In this file, the block is a rectangular sample of the body's lattice. A
//! plane between two layers of points divides the block into two halves. The centre line of the block runs
//! through the centre of the block, normal to the plane. The middle column contains the points within half a
//! cell of this line. The upper half moves away from the lower half until no intact bond of a point in the
//! middle column crosses the plane.

use crate::comm::threads;
use crate::damage::{CriticalStretch, DamageLaw};
use crate::problem::single_body::{fill, single_body};
use crate::problem::{Block, Problem, Toughness};
use crate::solver::Simulation;
use crate::solver::assign::{block_laws, cutoffs, laws_are_possible};
use crate::solver::bonds::BondUpdate;

/// Maximum number of bonds of the block. With this number of bonds, the computation takes some seconds.
const MAX_BONDS: f64 = 1e6;

/// Relative growth of the separation per step. A small growth limits how far bonds exceed their criterion
/// when they break. The remaining overshoot energy is subtracted from the result.
const GROWTH: f64 = 0.01;

/// Separation of the two halves in the first step, divided by the separation at which the first bond is
/// expected to break.
const START: f64 = 0.02;

/// Maximum number of steps; blocks need far fewer steps to separate.
const MAX_STEPS: u32 = 1500;

/// Relative tolerance of the cutoff. If the cutoff is a multiple of the spacing, round-off could change the
/// number of cells within the cutoff. The tolerance prevents this.
const SLACK: f64 = 1e-9;

/// Steps between checks of the bonds across the plane.
const CHECK_INTERVAL: u32 = 20;

/// Compute the ratio of the separation energy per area to the fracture energy of a body. The upper half of
/// the block moves at an angle (rad) to the normal of the plane.
///
/// The normal is y (in 1-D, x); the tangential part of the motion is along x. The overshoot energy of the
/// broken bonds is subtracted from the separation energy.
///
/// The result is `None` in these cases:
///
/// - a value of the problem is not allowed ([`Problem::check`]), or no body has this index;
/// - the body has no fracture energy, or is on no lattice;
/// - the block cannot have the law or the damage of the body;
/// - bonds break by stress;
/// - the families are too large, so the block would have more than `MAX_BONDS` bonds;
/// - the simulation of the block cannot be set up;
/// - the block does not separate.
pub fn separation_energy_ratio(problem: &Problem, body: usize, angle: f64) -> Option<f64> {
    problem.check().ok()?;
    let (mut block, spacing) = single_body(problem, body)?;
    laws_are_possible(&block).ok()?;
    let fracture_energy = fracture_energy(problem, body, unit(normal(problem.dimension.count())))?;
    let first = match block_laws(&block, &Block::unrefined(&block.bodies[0])).damage? {
        DamageLaw::CriticalStretch(law) => law.critical,
        DamageLaw::BondEnergy(law) => law.stretch,
        DamageLaw::Stress(_) => return None,
    };
    // The block is large enough for complete families of the middle points and of their neighbours.
    let cutoff = cutoffs(&block)[0];
    let dimension = problem.dimension.count();
    let normal = normal(dimension);
    let (mut upper, mut origin, mut bonds) = ([0.0; 3], [0.0; 3], 1.0);
    for k in 0..dimension {
        let reach = (cutoff / spacing[k] * (1.0 + SLACK)).floor();
        let mut cells = 2.0 * reach;
        if k != normal {
            cells += 0.5;
            origin[k] = 0.5 * spacing[k];
        }
        upper[k] = cells * spacing[k];
        let points = f64::from(block.bodies[0].quadrature().points(1));
        bonds *= 2.0 * cells * (2.0 * reach + 1.0) * points.powi(2);
    }
    fill(&mut block, [upper.map(|x| -x), upper], spacing, origin);
    if bonds > MAX_BONDS {
        return None;
    }
    let separation = Separation {
        angle,
        start: START * first * spacing[normal],
        half_cell: spacing.map(|edge| 0.5 * edge),
        height: 2.0 * upper[normal],
    };
    let spent = match dimension {
        1 => separation.energy::<1>(&block),
        2 => separation.energy::<2>(&block),
        _ => separation.energy::<3>(&block),
    };
    spent.map(|energy| energy / fracture_energy)
}

/// Index of the axis of the plane's normal.
fn normal(dimension: usize) -> usize {
    usize::from(dimension > 1)
}

/// Unit vector along the axis with this index.
fn unit(axis: usize) -> [f64; 3] {
    std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 })
}

/// Fracture energy of cracks with this normal in a body, J/m²; `None` if the body has no damage with a
/// fracture energy.
fn fracture_energy(problem: &Problem, body: usize, normal: [f64; 3]) -> Option<f64> {
    let body = &problem.bodies[body];
    let elastic = body.material.elastic;
    let damage = body.damage.as_ref()?;
    let cost = damage.direction.map_or(1.0, |direction| {
        direction.relative_fracture_energy(problem.dimension.count(), normal)
    });
    let along =
        match damage.toughness {
            Toughness::FractureEnergy(energy) => Some(energy),
            Toughness::FractureToughness(toughness) => Some(
                CriticalStretch::energy_from_toughness(problem.dimension, elastic, toughness),
            ),
            Toughness::CriticalStretch(_) | Toughness::Strength(_) => None,
        };
    along.map(|along| along * cost)
}

/// The motion of the upper half, and the size of the block.
struct Separation {
    /// Angle between the motion and the normal of the plane, rad.
    angle: f64,
    /// Separation at the first step, m.
    start: f64,
    /// Half the edge lengths of a cell, one per axis, m.
    half_cell: [f64; 3],
    /// Height of the block, m.
    height: f64,
}

impl Separation {
    /// Compute the separation energy per area in the middle of the plane, J/m²; `None` if the block does not
    /// separate.
    fn energy<const D: usize>(&self, block: &Problem) -> Option<f64> {
        let comm = threads::alone();
        let mut simulation = Simulation::<D>::new(block, &comm).ok()?;
        let normal = normal(D);
        let (sin, cos) = self.angle.sin_cos();
        let upper: Vec<bool> = (simulation.model.reference[normal].iter())
            .map(|coordinate| *coordinate > 0.0)
            .collect();
        let in_middle = |position: &[f64; 3]| {
            let mut sides = (0..D).filter(|k| *k != normal);
            sides.all(|k| position[k].abs() < self.half_cell[k])
        };
        let points = 0..simulation.model.owned();
        let middle: Vec<bool> = points
            .map(|point| in_middle(&simulation.model.position(point)))
            .collect();
        let mut size = self.start;
        for step in 1..=MAX_STEPS {
            let fields = &mut simulation.fields.displacement;
            for (point, _) in upper.iter().enumerate().filter(|(_, upper)| **upper) {
                fields[normal][point] = cos * size;
                if D > 1 {
                    fields[0][point] = sin * size;
                }
            }
            simulation.evaluate(BondUpdate::Step(0.0));
            size *= 1.0 + GROWTH;
            if step % CHECK_INTERVAL == 0 && is_separated(&simulation, &middle, &upper) {
                return Some(spent(&mut simulation, &middle, self.height));
            }
        }
        None
    }
}

/// Return true if no intact bond of a point in the middle column crosses the plane. `middle` is true for the
/// points in the middle column, and `upper` is true for the points of the upper half.
fn is_separated<const D: usize>(
    simulation: &Simulation<'_, D>,
    middle: &[bool],
    upper: &[bool],
) -> bool {
    let mut crossing = 0_u64;
    simulation.forces.for_each_intact(|i, j| {
        crossing += u64::from(middle[i] && upper[i] != upper[j]);
    });
    crossing == 0
}

/// Energy (J/m²) that the points of the middle column have dissipated, per area of the plane. The overshoot
/// energy is subtracted. `height` is the height of the column, m.
fn spent<const D: usize>(simulation: &mut Simulation<'_, D>, middle: &[bool], height: f64) -> f64 {
    let dissipated = simulation.forces.stored(&simulation.model).dissipated;
    let (model, fields) = (&simulation.model, &simulation.fields);
    let mut sums = [0.0; 2];
    for (point, _) in middle.iter().enumerate().filter(|(_, middle)| **middle) {
        let of = |field: &Option<Vec<f64>>| field.as_ref().map_or(0.0, |values| values[point]);
        let lost = dissipated.get(point).copied().unwrap_or(0.0) * model.volume[point];
        sums[0] += of(&fields.freed_energy) - of(&fields.overshoot_energy) + lost;
        sums[1] += model.volume[point] / height;
    }
    sums[0] / sums[1]
}
