//! What a run takes: memory and space on the disc.

use super::Size;
use crate::material::{Law, PlasticState};
use crate::problem::{Action, Block, Body, FamilyRule, PointSource, Problem, Quadrature};
use crate::solver::Simulation;
use crate::solver::assign::block_laws;
use crate::solver::motion::Clock;
use crate::solver::observers::Schedule;
use crate::solver::refinement::may_coarsen;

/// Bytes a point that a result holds once: position, id, block, volume, and the cell that shows it.
const FIXED: f64 = 24.0 + 8.0 + 4.0 + 8.0 + (8.0 + 8.0 + 1.0);

/// Bytes of a result or checkpoint that do not depend on the number of points.
const OVERHEAD: f64 = 64.0 * 1024.0;

/// Bytes of a bond in a list: an eighth of the lowest index and eight distances, and a bit.
const LISTED: f64 = 20.0 / 8.0 + 1.0 / 8.0;

/// Bytes of a bond of a lattice: a bit.
const ON_LATTICE: f64 = 1.0 / 8.0;

/// What a rank takes before it has points, alone and under a launcher (MPI's own buffers), bytes.
const BASE: [f64; 2] = [34.0 * MEBI, 40.0 * MEBI];
const MEBI: f64 = 1048576.0;

/// Bytes of a point, and of a bond of a list, at the peak of the set-up of lists, where it is not measured. The set-up
/// of lattices takes less memory than the time loop.
const LIST_SET_UP: [f64; 2] = [265.0, 11.0];

/// Copies of a field on its way to the result: by point, by id, and what the file takes.
const FIELD_COPIES: f64 = 3.0;

/// Copies of a column on its way to a checkpoint, on one rank and on several: by point, by id, and in messages.
const CHECKPOINT_COPIES: [f64; 2] = [2.0, 3.0];

/// Memory of a process with points beside what it had without, bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// The most during the set-up.
    pub peak: f64,
    /// After it.
    pub kept: f64,
}

/// What a run takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Memory of all ranks together at the fullest moment of the set-up, without ghosts, bytes.
    pub set_up: f64,
    /// Memory of all ranks together in the time loop while files are written, without ghosts, bytes: on one rank, and
    /// on several, which exchange messages.
    pub time_loop: [f64; 2],
    /// Number of outputs.
    pub outputs: u64,
    /// Size of the result at the end, bytes.
    pub result: f64,
    /// Size of one checkpoint, of which two are kept, bytes.
    pub checkpoint: f64,
}

/// LaneTuple of points and bonds that a cost is found from.
#[derive(Debug, Clone, Copy)]
struct Counts {
    points: f64,
    /// The share of the points that the result holds.
    share: f64,
    memory: Measured,
    /// Bytes of a checkpoint that the bonds take.
    bonds: f64,
    /// Columns of the history.
    columns: f64,
    /// LaneTuple that a checkpoint holds a point.
    saved: usize,
}

impl Cost {
    /// The cost of a run that is set up on one rank, with `columns` in its history and `held` points in its result.
    /// Memory that is not measured is estimated.
    pub fn of<const D: usize>(
        simulation: &Simulation<'_, D>,
        columns: usize,
        held: u64,
        measured: Option<Measured>,
    ) -> Self {
        let (problem, model) = (simulation.problem, &simulation.model);
        let points = model.total as f64;
        let kept = simulation.forces.saved_lengths(model.owned());
        let kept = kept.iter().map(|length| f64::from(*length)).sum();
        let bonds = simulation.forces.bytes() as f64;
        let listed = simulation.forces.directed_bonds() - simulation.forces.lattice_bonds();
        let counts = Counts {
            points,
            share: held as f64 / points,
            memory: measured.unwrap_or_else(|| estimated(problem, points, bonds, listed as f64)),
            bonds: kept,
            columns: columns as f64,
            saved: simulation.saved_width(),
        };
        cost(problem, counts, &simulation.expected_clock())
    }

    /// The cost of a run of some size with the steps of a clock, by estimate.
    pub fn estimate(problem: &Problem, size: &Size, clock: &Clock) -> Self {
        let (points, directed_bonds) = (size.all_points(), size.directed_bonds());
        let is_lattice = |source: &PointSource| matches!(source, PointSource::Lattice { .. });
        let on_lattice = problem.family != FamilyRule::List
            && problem.quadrature == Quadrature::Midpoint
            && problem.bodies.iter().all(|body| is_lattice(&body.points));
        let (bytes, listed) = if on_lattice {
            (ON_LATTICE, 0.0)
        } else {
            (LISTED, directed_bonds)
        };
        let bodies = problem.bodies.iter().zip(&size.bonds);
        let history = bodies.map(|(body, bonds)| bonds * history_bytes(problem, body));
        let history: f64 = history.sum();
        let bonds = bytes * directed_bonds + history;
        let counts = Counts {
            points,
            share: size.held / points,
            memory: estimated(problem, points, bonds, listed),
            bonds: ON_LATTICE * directed_bonds + history,
            columns: 16.0,
            saved: saved_width(problem),
        };
        cost(problem, counts, clock)
    }

    /// The most memory that one of so many ranks takes, bytes; `ghosts` as a share of its own points.
    pub fn memory_of_a_rank(&self, ranks: u32, ghosts: f64) -> f64 {
        let several = usize::from(ranks > 1);
        let points = self.set_up.max(self.time_loop[several]) / f64::from(ranks);
        BASE[several] + points * (1.0 + ghosts)
    }
}

/// Bytes of history of each bond of a body's points, which keeps the numbers of both ends.
fn history_bytes(problem: &Problem, body: &Body) -> f64 {
    let law = block_laws(problem, &Block::unrefined(body)).law;
    let numbers = match problem.dimension.count() {
        1 => law.counts::<1>().bond_history,
        2 => law.counts::<2>().bond_history,
        _ => law.counts::<3>().bond_history,
    };
    (2 * size_of::<f64>() * numbers) as f64
}

/// Memory of the set-up and after it, by formula.
fn estimated(problem: &Problem, points: f64, bonds: f64, listed: f64) -> Measured {
    let dimension = problem.dimension.count();
    // Place, displacement, velocity, force; what its bonds have set free; volumes of few different sizes, of the
    // point and its family; id, block.
    let state = 4 * 8 * dimension + 8 + 2 + 8 + 2;
    let kept = bonds + state as f64 * points;
    let peak = if listed > 0.0 {
        kept.max(LIST_SET_UP[0] * points + LIST_SET_UP[1] * listed)
    } else {
        kept
    };
    Measured { peak, kept }
}

/// Ghosts of a rank as a share of its own points, if the bodies fill a box with these edges (m) that is cut
/// across its longest edges.
pub fn ghost_share(edges: &[f64], horizon: f64, ranks: u32) -> f64 {
    let mut parts = vec![1_u32; edges.len()];
    let (mut left, mut factor) = (ranks, 2);
    while left > 1 {
        if !left.is_multiple_of(factor) {
            factor += 1;
            continue;
        }
        left /= factor;
        let edge = |k: usize| edges[k] / f64::from(parts[k]);
        let longest = (0..edges.len()).max_by(|a, b| edge(*a).total_cmp(&edge(*b)));
        parts[longest.unwrap_or(0)] *= factor;
    }
    let grown = edges.iter().zip(parts).map(|(edge, parts)| {
        let (sides, edge) = (f64::from((parts - 1).min(2)), edge.max(horizon));
        1.0 + sides * horizon * f64::from(parts) / edge
    });
    grown.product::<f64>() - 1.0
}

/// LaneTuple that a checkpoint holds a point: displacement, velocity; bonds that broke, and their energies;
/// reactions, work; what damping takes; what plastic flow leaves; when a trigger was last near.
fn saved_width(problem: &Problem) -> usize {
    let dimension = problem.dimension.count();
    let is_support =
        |action: &Action| matches!(action, Action::Displacement(_) | Action::Velocity(_));
    let mut actions = problem.conditions.iter().map(|condition| &condition.action);
    let supported = if actions.any(is_support) {
        dimension
    } else {
        0
    };
    let worked = usize::from(!problem.conditions.is_empty());
    let breaks = problem.bodies.iter().any(|body| body.damage.is_some());
    let broken = if breaks { 4 } else { 0 };
    let damped = problem
        .bodies
        .iter()
        .any(|body| body.material.damping > 0.0);
    let relaxed = if problem.relaxes() {
        2 * dimension + supported
    } else {
        0
    };
    let flows = problem.blocks().any(|block| match dimension {
        2 => Law::<2>::has_plasticity(&block_laws(problem, &block).law),
        3 => Law::<3>::has_plasticity(&block_laws(problem, &block).law),
        _ => false,
    });
    let flowed = if flows { PlasticState::COUNT } else { 0 };
    let seen = usize::from(may_coarsen(problem));
    2 * dimension + broken + supported + worked + usize::from(damped) + relaxed + flowed + seen
}

fn cost(problem: &Problem, counts: Counts, clock: &Clock) -> Cost {
    let count = |every| Schedule(every).count(clock);
    let (outputs, rows) = (
        count(problem.output.every),
        count(problem.row_interval()) as f64,
    );
    let components: usize = problem
        .output
        .fields
        .iter()
        .map(|field| field.components())
        .sum();
    let number = if problem.output.single { 4.0 } else { 8.0 };
    let written = counts.share * (FIXED + number * outputs as f64 * components as f64);
    let saved = 8.0 * counts.saved as f64 + 4.0;
    // While a field is on its way: what is known of the bonds, and its copies.
    let widest = problem.output.fields.iter().map(|field| field.components());
    let widest = widest.max().unwrap_or(0).max(3) as f64;
    let output = counts.points * 8.0 * (5.0 + FIELD_COPIES * widest);
    let bonds = counts.bonds;
    let offsets = counts.points * 24.0;
    let checkpoint =
        CHECKPOINT_COPIES.map(|copies| copies * bonds.max(counts.points * 8.0) + offsets);
    // Read whole; then the bonds are dealt out, whose lengths and places take two numbers more.
    let restart = counts.points * 8.0 * (counts.saved as f64 + 2.0) + 2.0 * bonds;
    Cost {
        set_up: counts.memory.peak,
        time_loop: checkpoint
            .map(|checkpoint| counts.memory.kept + output.max(checkpoint).max(restart)),
        outputs,
        result: OVERHEAD + counts.points * written + 8.0 * rows * counts.columns,
        checkpoint: OVERHEAD + counts.points * saved + bonds,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ghosts_lie_beyond_cuts_only() {
        let share = |ranks| ghost_share(&[4.0, 1.0], 0.1, ranks);
        assert_eq!(share(1), 0.0);
        assert!((share(2) - 0.05).abs() < 1e-12);
        // Three cuts across the long edge: those in the middle have ghosts on both sides.
        assert!((share(4) - 0.2).abs() < 1e-12);
        assert!((ghost_share(&[3.0], 0.1, 3) - 0.2).abs() < 1e-12);
    }
}
