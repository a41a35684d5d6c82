//! Memory and disk space of a run.

use super::Size;
use crate::material::Law;
use crate::problem::{Block, Body, FamilyRule, Field, Output, Problem};
use crate::solver::Simulation;
use crate::solver::assign::block_laws;
use crate::solver::motion::Clock;
use crate::solver::motion::fields::Needs;
use crate::solver::observers::Schedule;

/// Static bytes per point in a result: position, id, block, volume and VTK cell.
const FIXED: f64 = 24.0 + 8.0 + 4.0 + 8.0 + (8.0 + 8.0 + 1.0);

/// Bytes of a result or checkpoint in addition to the data of the points.
const OVERHEAD: f64 = 64.0 * 1024.0;

/// Bytes of a bond in a list, at each end: a neighbour index and one bit. A compact group of eight neighbour
/// indices takes 20 bytes.
const LISTED: f64 = 20.0 / 8.0 + 1.0 / 8.0;

/// Bytes of a bond in a lattice, at each end: one bit, which is 1/8 byte.
const ON_LATTICE: f64 = 1.0 / 8.0;

/// Memory of a rank without points, bytes. The first entry is for one rank without a launcher. The second
/// entry is for several ranks, which need MPI buffers.
const BASE: [f64; 2] = [34.0 * MEBI, 40.0 * MEBI];
const MEBI: f64 = 1048576.0;

/// Estimated bytes per point, and per end of a bond in a list, at the peak of the set-up. The set-up of
/// lattices needs less memory than the time loop.
const LIST_SET_UP: [f64; 2] = [265.0, 11.0];

/// Estimated bytes per point for contact, from a measurement with a block of 512 000 points without contacts.
const CONTACT: f64 = 280.0;

/// Estimated bytes per point for a repeated contact search, from a measurement with two blocks of 209 000
/// points.
const CONTACT_SEARCH: f64 = 350.0;

/// Number of work vectors of Newton's method, which are allocated in the first iteration.
const NEWTON_VECTORS: usize = 8;

/// Number of copies of a field during its output: one in the order of the points in memory, one in the order
/// of the ids, and one in the file layer.
const FIELD_COPIES: f64 = 3.0;

/// Number of copies of a column during a checkpoint, on one rank and on several ranks. One copy is in the
/// order of the points in memory, and one in the order of the ids. With several ranks, a third copy is in
/// messages.
const CHECKPOINT_COPIES: [f64; 2] = [2.0, 3.0];

/// Memory of the points and bonds of a process, measured or estimated, bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Peak during the set-up.
    pub peak: f64,
    /// Memory after the set-up.
    pub resident: f64,
}

/// Memory and disk space of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Cost {
    /// Total memory of all ranks at the peak of the set-up, without ghosts, bytes.
    pub set_up: f64,
    /// Total memory of all ranks at the peak of the time loop, without ghosts, bytes. The peak occurs during
    /// an output, a checkpoint, a restart or a contact search. The first entry is for runs on one rank, the
    /// second for runs on several ranks.
    pub time_loop: [f64; 2],
    /// Disk space of each result. The first entry is the main result, including the history. The other
    /// entries are the further results.
    pub results: Vec<ResultCost>,
    /// Size of one checkpoint, bytes; a run keeps two checkpoints.
    pub checkpoint: f64,
    /// Number of history rows.
    pub rows: u64,
}

/// Disk space of a result.
#[derive(Debug, Clone, PartialEq)]
pub struct ResultCost {
    /// Name of a further result; `None` for the main result.
    pub name: Option<String>,
    /// Number of outputs.
    pub outputs: u64,
    /// Size at the end, bytes.
    pub bytes: f64,
}

/// Numbers from which the cost is computed.
#[derive(Debug, Clone)]
struct Counts {
    points: f64,
    /// Number of points in each result.
    output_points: Vec<f64>,
    memory: Measured,
    /// Bytes of the bonds in a checkpoint.
    bonds: f64,
    /// Number of columns of the history.
    columns: f64,
    /// Number of saved values per point in a checkpoint.
    saved: usize,
}

impl Cost {
    /// Compute the cost of a run that is set up on one rank, with `columns` history columns and
    /// `output_points` points in each result. If `measured` is `None`, the memory is estimated.
    pub fn of<const D: usize>(
        simulation: &Simulation<'_, D>,
        columns: usize,
        output_points: &[u64],
        measured: Option<Measured>,
    ) -> Self {
        let (problem, model) = (simulation.problem, &simulation.model);
        let points = model.total as f64;
        let saved = simulation.forces.saved_lengths(model.owned());
        let saved = saved.iter().map(|length| f64::from(*length)).sum();
        let bonds = simulation.forces.bytes() as f64;
        let listed = simulation.forces.directed_bonds() - simulation.forces.lattice_bonds();
        let counts = Counts {
            points,
            output_points: output_points.iter().map(|count| *count as f64).collect(),
            memory: measured.unwrap_or_else(|| estimated(problem, points, bonds, listed as f64)),
            bonds: saved,
            columns: columns as f64,
            saved: simulation.fields.state().count(),
        };
        cost(problem, counts, &simulation.expected_clock())
    }

    /// Estimate the cost of a run from its size, before its points are created. `clock` gives the number of
    /// steps.
    pub fn estimate(problem: &Problem, size: &Size, clock: &Clock) -> Self {
        let (points, directed_bonds) = (size.all_points(), size.directed_bonds());
        let mut bodies = problem.bodies.iter();
        let on_lattice = problem.family != FamilyRule::List
            && bodies.all(|body| body.is_on_lattice(problem.jitter) && !body.has_gauss_points());
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
            output_points: size.output_points.clone(),
            memory: estimated(problem, points, bonds, listed),
            bonds: ON_LATTICE * directed_bonds + history,
            columns: 16.0,
            saved: saved_width(problem),
        };
        cost(problem, counts, clock)
    }

    /// Return the size of all results at the end, bytes.
    pub fn all_results(&self) -> f64 {
        self.results.iter().map(|result| result.bytes).sum()
    }

    /// Return the peak memory of one of `ranks` ranks, bytes. `ghosts` is the number of ghosts per owned
    /// point.
    pub fn memory_of_a_rank(&self, ranks: u32, ghosts: f64) -> f64 {
        let several = usize::from(ranks > 1);
        let points = self.set_up.max(self.time_loop[several]) / f64::from(ranks);
        BASE[several] + points * (1.0 + ghosts)
    }
}

/// Return the bytes of bond history that a body stores at each end of a bond. Each end stores the histories
/// of both ends.
fn history_bytes(problem: &Problem, body: &Body) -> f64 {
    let law = block_laws(problem, &Block::unrefined(body)).law;
    let numbers = match problem.dimension.count() {
        1 => law.counts::<1>().bond_history,
        2 => law.counts::<2>().bond_history,
        _ => law.counts::<3>().bond_history,
    };
    (2 * size_of::<f64>() * numbers) as f64
}

/// Estimate the memory during and after the set-up. `bonds` is the memory of the bonds (bytes), and `listed`
/// is the number of bonds in lists, counted at both ends.
fn estimated(problem: &Problem, points: f64, bonds: f64, listed: f64) -> Measured {
    let dimension = problem.dimension.count();
    // Columns with numbers and energies of broken bonds.
    let damage = if problem.has_damage() { 4 * 8 } else { 0 };
    // Bytes of a point: position, displacement, velocity and force; one byte each for the volumes of the
    // point and of its family, see `PaletteColumn`; 8 for the id, and 2 for the block.
    let state = 4 * 8 * dimension + damage + 2 + 8 + 2;
    let contact = if problem.has_contact() { CONTACT } else { 0.0 };
    let resident = bonds + (state as f64 + contact) * points;
    let peak = if listed > 0.0 {
        resident.max(LIST_SET_UP[0] * points + LIST_SET_UP[1] * listed)
    } else {
        resident
    };
    Measured { peak, resident }
}

/// Return the number of ghosts per owned point of a rank, for a box with these edges (m). Cuts between ranks
/// are perpendicular to the longest edges.
pub fn ghost_share(edges: &[f64], horizon: f64, ranks: u32) -> f64 {
    let mut parts = vec![1_u32; edges.len()];
    let (mut remaining, mut factor) = (ranks, 2);
    while remaining > 1 {
        if !remaining.is_multiple_of(factor) {
            factor += 1;
            continue;
        }
        remaining /= factor;
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

/// Return the number of values per point in a checkpoint, without the state of the bonds.
fn saved_width(problem: &Problem) -> usize {
    fn width<const D: usize>(problem: &Problem) -> usize {
        let mut blocks = problem.blocks();
        let has_plasticity =
            blocks.any(|block| Law::<D>::has_plasticity(&block_laws(problem, &block).law));
        Needs::new(problem, has_plasticity).state_width::<D>()
    }
    match problem.dimension.count() {
        1 => width::<1>(problem),
        2 => width::<2>(problem),
        _ => width::<3>(problem),
    }
}

fn cost(problem: &Problem, counts: Counts, clock: &Clock) -> Cost {
    let rows = Schedule::every(problem.row_interval()).count(clock);
    let result = |(output, points): (&Output, &f64)| {
        let outputs = Schedule::of_outputs(output).count(clock);
        let bytes_of = |field: &Field| {
            field.components() as f64 * if output.is_single(*field) { 4.0 } else { 8.0 }
        };
        let of_output: f64 = output.fields.iter().map(bytes_of).sum();
        let history = if output.name.is_none() {
            8.0 * rows as f64 * counts.columns
        } else {
            0.0
        };
        ResultCost {
            name: output.name.clone(),
            outputs,
            bytes: OVERHEAD + points * (FIXED + outputs as f64 * of_output) + history,
        }
    };
    let results = problem.outputs().zip(&counts.output_points).map(result);
    let results = results.collect();
    let saved = 8.0 * counts.saved as f64 + 4.0;
    // The output of a field needs sums over bonds, and copies of the field.
    let fields = problem.outputs().flat_map(|output| &output.fields);
    let widest = fields.map(|field| field.components()).max();
    let widest = widest.unwrap_or(0).max(3) as f64;
    let output = counts.points * 8.0 * (5.0 + FIELD_COPIES * widest);
    let bonds = counts.bonds;
    let offsets = counts.points * 24.0;
    let checkpoint =
        CHECKPOINT_COPIES.map(|copies| copies * bonds.max(counts.points * 8.0) + offsets);
    // At a restart, all columns are in memory. Bonds are then redistributed, with two more numbers per point
    // for lengths and offsets.
    let restart = counts.points * 8.0 * (counts.saved as f64 + 2.0) + 2.0 * bonds;
    let vectors = if problem.has_newton() {
        let numbers = NEWTON_VECTORS * problem.dimension.count();
        counts.points * 8.0 * numbers as f64
    } else {
        0.0
    };
    // Rigid bodies alone need no search for pairs of points.
    let search = if problem.contact.is_some() {
        CONTACT_SEARCH * counts.points
    } else {
        0.0
    };
    let largest = output.max(restart).max(search);
    Cost {
        set_up: counts.memory.peak,
        time_loop: checkpoint
            .map(|checkpoint| counts.memory.resident + vectors + largest.max(checkpoint)),
        results,
        checkpoint: OVERHEAD + counts.points * saved + bonds,
        rows,
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
        // With three cuts of the long edge, two of the four ranks have ghosts on both sides.
        assert!((share(4) - 0.2).abs() < 1e-12);
        assert!((ghost_share(&[3.0], 0.1, 3) - 0.2).abs() < 1e-12);
    }
}
