//! A dry run creates the points and bonds on one rank, and does not run the time loop. It computes figures
//! for `check`.

use std::time::{Duration, Instant};

use super::memory;
use super::{Cost, Measured, Survey, ghost_share};
use crate::comm::threads;
use crate::error::Result;
use crate::problem::Problem;
use crate::solver::conditions::output_members;
use crate::solver::observers::{HistoryObserver, Snapshot};
use crate::solver::steps::choose_steps;
use crate::solver::{Simulation, Stepper};

/// Duration of the speed measurement.
const MEASUREMENT: Duration = Duration::from_millis(300);

/// Maximum number of steps of the speed measurement.
const MAX_STEPS: u32 = 1000;

/// The results of a dry run.
#[derive(Debug, Clone)]
pub struct DryRun {
    /// Figures and warnings.
    pub survey: Survey,
    /// Number of points.
    pub points: u64,
    /// Number of bonds.
    pub bonds: u64,
    /// Number of bonds in lattice families.
    pub lattice_bonds: u64,
    /// Ghosts per owned point on the requested number of ranks.
    pub ghosts: f64,
    /// Memory and disk space.
    pub cost: Cost,
    /// Stable step (s) of the first stage, for the scaled density of this stage.
    pub stable_step: f64,
    /// For each stage: length of the first time step (s), and number of steps if no bond breaks.
    pub steps: Vec<(f64, f64)>,
    /// Measured times; `None` if they were not measured.
    pub seconds: Option<Seconds>,
}

/// Measured wall-clock times on one rank, s.
#[derive(Debug, Clone, PartialEq)]
pub struct Seconds {
    /// Time of a force evaluation in the first stage. An explicit time step makes one evaluation. An
    /// iteration of a load step makes one or more evaluations.
    pub evaluation: f64,
    /// Time of a row of the history.
    pub row: f64,
    /// For each output of [`Problem::outputs`]: time for computing its fields, without writing them to disk.
    pub outputs: Vec<f64>,
}

/// Set up a problem on one rank, and compute the figures of a run on `ranks` ranks. With `measure`, also
/// measure the times of a force evaluation, a history row and the outputs.
///
/// # Errors
/// The same errors that a run can return before its first step.
pub fn dry_run(problem: &Problem, ranks: u32, measure: bool) -> Result<DryRun> {
    match problem.dimension.count() {
        1 => dry_run_in::<1>(problem, ranks, measure),
        2 => dry_run_in::<2>(problem, ranks, measure),
        _ => dry_run_in::<3>(problem, ranks, measure),
    }
}

fn dry_run_in<const D: usize>(problem: &Problem, ranks: u32, measure: bool) -> Result<DryRun> {
    let comm = threads::alone();
    let before = memory::reset_peak();
    let mut simulation = Simulation::<D>::new(problem, &comm)?;
    let after = memory::resident();
    simulation.check()?;
    let columns = HistoryObserver::new(&simulation)?.columns().len();
    let total = simulation.model.total;
    let of_output = |output| {
        let points = output_members(problem, output, &comm, &simulation.model)?;
        Ok(points.map_or(total, |points| points.len() as u64))
    };
    let output_points = problem.outputs().map(of_output);
    let output_points = output_points.collect::<Result<Vec<_>>>()?;
    let survey = Survey::new(&mut simulation);
    let measured = before.map(|before| Measured {
        peak: after.peak - before,
        resident: after.now - before,
    });
    Ok(DryRun {
        survey,
        points: total,
        bonds: simulation.forces.directed_bonds() / 2,
        lattice_bonds: simulation.forces.lattice_bonds() / 2,
        ghosts: ghost_share(&edges(&simulation), problem.horizon, ranks),
        cost: Cost::of(&simulation, columns, &output_points, measured),
        stable_step: simulation.scaled_stable_step(),
        steps: choose_steps(problem, simulation.undeformed.stable_step)?,
        seconds: measure
            .then(|| measured_times(problem, simulation))
            .transpose()?,
    })
}

/// Return the edge lengths of the bounding box of all points, m.
fn edges<const D: usize>(simulation: &Simulation<'_, D>) -> [f64; D] {
    simulation.model.reference.each_ref().map(|coordinates| {
        let low = coordinates.iter().copied().fold(f64::INFINITY, f64::min);
        let high = coordinates
            .iter()
            .copied()
            .fold(f64::NEG_INFINITY, f64::max);
        high - low
    })
}

/// Measure the wall-clock times of a force evaluation, a history row and the outputs.
fn measured_times<const D: usize>(
    problem: &Problem,
    simulation: Simulation<'_, D>,
) -> Result<Seconds> {
    let mut stepper = Stepper::new(simulation);
    // The first step warms the caches.
    stepper.advance();
    let before = stepper.times().evaluations;
    let (start, mut steps) = (Instant::now(), 0);
    while start.elapsed() < MEASUREMENT && steps < MAX_STEPS {
        stepper.advance();
        steps += 1;
    }
    let evaluations = stepper.times().evaluations - before;
    let evaluation = start.elapsed().as_secs_f64() / evaluations as f64;
    let simulation = stepper.at_full_step();
    let mut observer = HistoryObserver::new(simulation)?;
    let start = Instant::now();
    let snapshot = Snapshot::new(simulation);
    observer.row(simulation, &snapshot);
    let row = start.elapsed().as_secs_f64();
    let outputs = problem.outputs().map(|output| {
        let start = Instant::now();
        let snapshot = Snapshot::for_fields(simulation, output.fields.iter().copied());
        for field in &output.fields {
            snapshot.field(simulation, *field);
        }
        start.elapsed().as_secs_f64()
    });
    let outputs = outputs.collect();
    Ok(Seconds {
        evaluation,
        row,
        outputs,
    })
}
