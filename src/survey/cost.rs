//! What a run takes: memory and space on the disc.

use crate::deck::plan::{Action, FamilyRule, Plan, PointSource, Quadrature};
use crate::solver::Simulation;
use crate::solver::motion::Clock;
use crate::solver::observers::Schedule;

/// Bytes a point that a result holds once: position, id, block, volume.
const FIXED: f64 = 24.0 + 8.0 + 4.0 + 8.0;

/// Bytes of a result or checkpoint that do not depend on the number of points.
const OVERHEAD: f64 = 64.0 * 1024.0;

/// Bytes of a bond in a list: the neighbour's index and a bit.
const LISTED: f64 = 4.0 + 1.0 / 8.0;

/// Bytes of a bond of a lattice: a bit.
const ON_LATTICE: f64 = 1.0 / 8.0;

/// What a run takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Memory of all ranks together in the time loop, without ghosts, bytes.
    pub memory: f64,
    /// Number of outputs.
    pub outputs: u64,
    /// Size of the result at the end, bytes.
    pub result: f64,
    /// Size of one checkpoint, of which two are kept, bytes.
    pub checkpoint: f64,
}

/// Numbers of points and bonds that a cost is found from.
#[derive(Debug, Clone, Copy)]
struct Counts {
    points: f64,
    /// Bytes of the bonds in memory, and of what a checkpoint holds of them.
    bonds: [f64; 2],
    /// Columns of the history.
    columns: f64,
    /// Numbers that a checkpoint holds a point.
    saved: usize,
}

impl Cost {
    /// Of a run that stands ready on one rank, with so many columns in its history.
    pub fn of<const D: usize>(simulation: &Simulation<'_, D>, columns: usize) -> Self {
        let kept = simulation.forces.saved_lengths(simulation.model.owned());
        let kept = kept.iter().map(|length| f64::from(*length)).sum();
        let counts = Counts {
            points: simulation.model.total as f64,
            bonds: [simulation.forces.bytes() as f64, kept],
            columns: columns as f64,
            saved: simulation.saved_width(),
        };
        cost(simulation.plan, counts, &simulation.expected_clock())
    }

    /// Of a run of so many points and bonds, counted from both ends, and such steps, by estimate.
    pub fn estimate(plan: &Plan, points: f64, directed_bonds: f64, clock: &Clock) -> Self {
        let is_lattice = |source: &PointSource| matches!(source, PointSource::Lattice { .. });
        let on_lattice = plan.family != FamilyRule::List
            && plan.quadrature == Quadrature::Midpoint
            && plan.bodies.iter().all(|body| is_lattice(&body.points));
        let bytes = if on_lattice { ON_LATTICE } else { LISTED };
        let counts = Counts {
            points,
            bonds: [bytes * directed_bonds, ON_LATTICE * directed_bonds],
            columns: 16.0,
            saved: saved_width(plan),
        };
        cost(plan, counts, clock)
    }
}

/// Numbers that a checkpoint holds a point: displacement, velocity, energy set free; reactions, work; what
/// damping takes.
fn saved_width(plan: &Plan) -> usize {
    let dimension = plan.dimension.count();
    let is_support =
        |action: &Action| matches!(action, Action::Displacement(_) | Action::Velocity(_));
    let mut actions = plan.conditions.iter().map(|condition| &condition.action);
    let supported = if actions.any(is_support) {
        dimension
    } else {
        0
    };
    let worked = usize::from(!plan.conditions.is_empty());
    let damped = plan.bodies.iter().any(|body| body.material.damping > 0.0);
    let relaxed = if plan.relaxes() {
        2 * dimension + supported
    } else {
        0
    };
    2 * dimension + 1 + supported + worked + usize::from(damped) + relaxed
}

fn cost(plan: &Plan, counts: Counts, clock: &Clock) -> Cost {
    let dimension = plan.dimension.count();
    let count = |every| Schedule(every).count(clock);
    let (outputs, rows) = (count(plan.output.every), count(plan.history.every) as f64);
    let components: usize = plan
        .output
        .fields
        .iter()
        .map(|field| field.components())
        .sum();
    let history = 8.0 * rows * counts.columns;
    let state = 8 * (2 * dimension + 1) + 8 * dimension + 8 * (dimension + 1) + 8 + 2;
    Cost {
        memory: counts.bonds[0] + state as f64 * counts.points,
        outputs,
        result: OVERHEAD
            + counts.points * (FIXED + 8.0 * outputs as f64 * components as f64)
            + history,
        checkpoint: OVERHEAD + counts.points * (8.0 * counts.saved as f64 + 4.0) + counts.bonds[1],
    }
}
