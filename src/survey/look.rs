//! A run whose points and bonds are made by one rank, to tell what it would be like.

use std::time::{Duration, Instant};

use super::memory;
use super::{Cost, Measured, Survey, ghost_share};
use crate::comm::threads;
use crate::error::Result;
use crate::problem::Problem;
use crate::solver::conditions::output_members;
use crate::solver::observers::HistoryObserver;
use crate::solver::steps::choose_steps;
use crate::solver::{Simulation, Stepper};

/// How long the time loop is tried to know its speed.
const TRIAL: Duration = Duration::from_millis(300);

/// Steps after which it is known well enough.
const MOST_STEPS: u32 = 1000;

/// What a run is found to be like before its first step.
#[derive(Debug, Clone)]
pub struct Look {
    /// Its figures and warnings.
    pub survey: Survey,
    /// Number of points.
    pub points: u64,
    /// Number of bonds.
    pub bonds: u64,
    /// How many of them are kept as a lattice.
    pub lattice_bonds: u64,
    /// Ghosts for a point, on the ranks that were asked for.
    pub ghosts: f64,
    /// Memory and space on the disc.
    pub cost: Cost,
    /// The stable step, with the safety that is asked for, s.
    pub stable_step: f64,
    /// First step (s) of each stage, and the number of its steps if no bond breaks.
    pub steps: Vec<(f64, f64)>,
    /// Wall-clock time of a step on one rank, s, if it was tried.
    pub seconds: Option<f64>,
}

/// Looks at a run that is for so many ranks; `tried` makes some steps of it.
///
/// # Errors
/// As those of a run before its first step.
pub fn look(problem: &Problem, ranks: u32, tried: bool) -> Result<Look> {
    match problem.dimension.count() {
        1 => look_in::<1>(problem, ranks, tried),
        2 => look_in::<2>(problem, ranks, tried),
        _ => look_in::<3>(problem, ranks, tried),
    }
}

fn look_in<const D: usize>(problem: &Problem, ranks: u32, tried: bool) -> Result<Look> {
    let comm = threads::alone();
    let before = memory::forget_peak();
    let mut simulation = Simulation::<D>::new(problem, &comm)?;
    let after = memory::resident();
    simulation.check()?;
    let columns = HistoryObserver::new(&simulation)?.columns().len();
    let total = simulation.model.total;
    let held = output_members(problem, &comm, &simulation.model)?;
    let held = held.map_or(total, |points| points.len() as u64);
    let survey = Survey::new(&mut simulation);
    let measured = before.map(|before| Measured {
        peak: after.peak - before,
        kept: after.now - before,
    });
    Ok(Look {
        survey,
        points: total,
        bonds: simulation.forces.directed_bonds() / 2,
        lattice_bonds: simulation.forces.lattice_bonds() / 2,
        ghosts: ghost_share(&edges(&simulation), problem.horizon, ranks),
        cost: Cost::of(&simulation, columns, held, measured),
        stable_step: simulation.scaled_stable_step(),
        steps: choose_steps(problem, simulation.stable_step)?,
        seconds: tried.then(|| seconds_a_step(simulation)),
    })
}

/// The edges (m) of the box around all points.
fn edges<const D: usize>(simulation: &Simulation<'_, D>) -> [f64; D] {
    simulation.model.reference.each_ref().map(|places| {
        let least = places.iter().copied().fold(f64::INFINITY, f64::min);
        let most = places.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        most - least
    })
}

/// Wall-clock time of a step, from some of them.
fn seconds_a_step<const D: usize>(simulation: Simulation<'_, D>) -> f64 {
    let mut stepper = Stepper::new(simulation);
    // The first ones bring everything into the caches.
    stepper.advance();
    let (start, mut steps) = (Instant::now(), 0);
    while start.elapsed() < TRIAL && steps < MOST_STEPS {
        stepper.advance();
        steps += 1;
    }
    start.elapsed().as_secs_f64() / f64::from(steps)
}
