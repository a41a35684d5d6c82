//! What it costs to part a body: a block of its lattice is cut along a plane between two layers of points, and
//! its halves move off until no bond joins them.

use crate::comm::threads;
use crate::damage::{CriticalStretch, DamageLaw};
use crate::problem::single_body::{alone, fill};
use crate::problem::{Block, Problem, Toughness};
use crate::solver::Simulation;
use crate::solver::assign::{block_laws, cutoffs, laws_are_possible};
use crate::solver::bonds::BondUpdate;

/// Blocks with more bonds than this are not parted: it would take more than seconds.
const MOST_BONDS: f64 = 1e6;

/// The share by which the way of the halves grows from step to step. Bonds break late by up to as much, which
/// is not counted.
const GROWTH: f64 = 0.01;

/// Way at the start, over that at which the first bond is expected to break.
const START: f64 = 0.02;

/// The block has parted long before so many steps.
const MOST_STEPS: u32 = 1500;

/// The share by which a cutoff that is a multiple of the spacing may be rounded down.
const SLACK: f64 = 1e-9;

/// Steps from one look at the bonds to the next.
const LOOK: u32 = 20;

/// What a unit area costs when the upper half moves off at an angle (rad) to the normal of the cut, as a share of
/// the fracture energy. The normal is along y (in 1-D along x), and what is left of the way is along x. What bonds
/// hold above their criterion when they are seen to break is not counted.
///
/// `None` for a body without a fracture energy, for points from a file, for families so large that it would take
/// long, and for a body that does not part.
pub fn separation_energy_ratio(problem: &Problem, body: usize, angle: f64) -> Option<f64> {
    let (mut block, spacing) = alone(problem, body)?;
    laws_are_possible(&block).ok()?;
    let fracture_energy = fracture_energy(problem, body)?;
    let first = match block_laws(&block, &Block::unrefined(&block.bodies[0])).damage? {
        DamageLaw::CriticalStretch(law) => law.critical,
        DamageLaw::BondEnergy(law) => law.stretch,
    };
    // Families of the middle, and of their neighbours, are whole.
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
        let points = f64::from(problem.quadrature.points(1));
        bonds *= 2.0 * cells * (2.0 * reach + 1.0) * points.powi(2);
    }
    fill(&mut block, [upper.map(|x| -x), upper], spacing, origin);
    if bonds > MOST_BONDS {
        return None;
    }
    let way = Way {
        angle,
        start: START * first * spacing[normal],
        half_cell: spacing.map(|edge| 0.5 * edge),
        height: 2.0 * upper[normal],
    };
    let spent = match dimension {
        1 => way.energy::<1>(&block),
        2 => way.energy::<2>(&block),
        _ => way.energy::<3>(&block),
    };
    spent.map(|energy| energy / fracture_energy)
}

/// Index of the direction of the cut's normal.
fn normal(dimension: usize) -> usize {
    usize::from(dimension > 1)
}

/// G0 of a body, J/m².
fn fracture_energy(problem: &Problem, body: usize) -> Option<f64> {
    let body = &problem.bodies[body];
    let elastic = body.material.elastic;
    match body.damage.as_ref()?.toughness {
        Toughness::FractureEnergy(energy) => Some(energy),
        Toughness::FractureToughness(toughness) => Some(CriticalStretch::energy_from_toughness(
            problem.dimension,
            elastic,
            toughness,
        )),
        Toughness::CriticalStretch(_) => None,
    }
}

/// How the upper half moves off.
struct Way {
    /// To the normal, rad.
    angle: f64,
    /// Of the first step, m.
    start: f64,
    /// Half the edges of a cell, m.
    half_cell: [f64; 3],
    /// Of the block, m.
    height: f64,
}

impl Way {
    /// The energy that a unit area in the middle of the cut takes, J/m².
    fn energy<const D: usize>(&self, block: &Problem) -> Option<f64> {
        let comm = threads::alone();
        let mut simulation = Simulation::<D>::new(block, &comm).ok()?;
        let normal = normal(D);
        let (sin, cos) = self.angle.sin_cos();
        let upper: Vec<bool> = (simulation.model.reference[normal].iter())
            .map(|place| *place > 0.0)
            .collect();
        let in_middle = |place: &[f64; 3]| {
            let mut sides = (0..D).filter(|k| *k != normal);
            sides.all(|k| place[k].abs() < self.half_cell[k])
        };
        let points = 0..simulation.model.owned();
        let middle: Vec<bool> = points
            .map(|point| in_middle(&simulation.model.position(point)))
            .collect();
        let mut size = self.start;
        for step in 1..=MOST_STEPS {
            let fields = &mut simulation.fields.displacement;
            for (point, _) in upper.iter().enumerate().filter(|(_, upper)| **upper) {
                fields[normal][point] = cos * size;
                if D > 1 {
                    fields[0][point] = sin * size;
                }
            }
            simulation.evaluate(BondUpdate::Step(0.0));
            size *= 1.0 + GROWTH;
            if step % LOOK == 0 && is_parted(&simulation, &middle, &upper) {
                return Some(spent(&mut simulation, &middle, self.height));
            }
        }
        None
    }
}

/// Whether no bond of the middle points crosses the cut.
fn is_parted<const D: usize>(
    simulation: &Simulation<'_, D>,
    middle: &[bool],
    upper: &[bool],
) -> bool {
    let mut crossing = 0_u64;
    simulation.forces.for_each_intact(|here, there| {
        crossing += u64::from(middle[here] && upper[here] != upper[there]);
    });
    crossing == 0
}

/// What a unit area of the middle column has taken, whose height is given (m); J/m².
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
