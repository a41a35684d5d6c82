//! `fissure check`: what a deck would do.

use std::path::Path;
use std::time::{Duration, Instant};

use fissure::comm::threads;
use fissure::deck::{self, Plan};
use fissure::error::Result;
use fissure::solver::Simulation;
use fissure::solver::assign::cutoffs;
use fissure::solver::motion::Clock;
use fissure::solver::observers::HistoryObserver;
use fissure::solver::size::is_feasible;
use fissure::solver::steps::choose_steps;
use fissure::survey::{
    Cost, Interior, Measured, Size, Survey, calibrated, ghost_share, interior, size,
};

use super::check_report as say;
use super::report::Report;
use super::{CheckArguments, Verbosity, each, launch, memory, print};

/// More lattice cells, points or bonds than these, counted from both ends, are not made to check a deck:
/// it would take more than some seconds and some 2 GB.
const MOST_CELLS: f64 = 2e7;
const MOST_POINTS: f64 = 4e6;
const MOST_BONDS: f64 = 3e8;

/// How long the time loop is tried to know its speed.
const TRIAL: Duration = Duration::from_millis(300);

/// Validates the decks and prints their figures.
///
/// # Errors
/// When a deck is wrong or the output is full.
pub fn check(arguments: &CheckArguments, verbosity: Verbosity) -> Result<()> {
    launch::start_threads(launch::threads(None))?;
    each(&arguments.decks, |deck| {
        check_one(deck, arguments, verbosity)
    })
}

fn check_one(deck: &Path, arguments: &CheckArguments, verbosity: Verbosity) -> Result<()> {
    let plan = deck::read(deck, &arguments.set)?.plan()?;
    let asked = Asked {
        deck,
        ranks: arguments.ranks,
        // Nobody reads the speed of a deck that is only to be right.
        trial: verbosity != Verbosity::Quiet,
    };
    is_feasible(&plan, &cutoffs(&plan), arguments.ranks as usize)?;
    let plan = calibrated(&plan)?;
    let size = size(&plan)?;
    let few = size.cells <= MOST_CELLS
        && size.all_points() <= MOST_POINTS
        && size.directed_bonds <= MOST_BONDS;
    let report = match (few, plan.dimension.count()) {
        (false, _) => estimate(&plan, &asked, &size)?,
        (true, 1) => look::<1>(&plan, &asked)?,
        (true, 2) => look::<2>(&plan, &asked)?,
        (true, _) => look::<3>(&plan, &asked)?,
    };
    if verbosity == Verbosity::Quiet {
        return Ok(());
    }
    print(&report.text)
}

/// What is asked about a deck.
struct Asked<'a> {
    deck: &'a Path,
    ranks: u32,
    /// Whether some steps are made to know their speed.
    trial: bool,
}

/// What a point inside each body is like, where that can be found.
fn interiors(plan: &Plan) -> Vec<Option<Interior>> {
    (0..plan.bodies.len())
        .map(|body| interior(plan, body))
        .collect()
}

/// Makes points and bonds and looks at them.
fn look<const D: usize>(plan: &Plan, asked: &Asked) -> Result<Report> {
    let comm = threads::alone();
    let before = memory::forget_peak();
    let mut simulation = Simulation::<D>::new(plan, &comm)?;
    let after = memory::resident();
    simulation.check()?;
    let columns = HistoryObserver::new(&simulation)?.columns().len();
    let survey = Survey::new(&mut simulation);
    let interiors = interiors(plan);
    let mut report = Report::default();
    say::heading(&mut report, plan, asked.deck);
    for (index, body) in plan.bodies.iter().enumerate() {
        say::body(&mut report, plan, body);
        say::figures(&mut report, body, &survey.bodies[index], D);
        say::interior(&mut report, plan, interiors[index].as_ref());
        if asked.trial {
            say::parting(&mut report, plan, index);
        }
    }
    say::joints(&mut report, plan, &survey);
    say::places(&mut report, plan, &survey, D);
    say::sets(&mut report, plan, &survey);
    report.say("size");
    say::size(
        &mut report,
        plan,
        simulation.model.total,
        simulation.forces.directed_bonds() / 2,
    );
    report.line(
        "of them as lattice",
        super::format::count(simulation.forces.lattice_bonds() / 2),
    );
    let ghosts = ghost_share(&edges(&simulation), plan.horizon, asked.ranks);
    let measured = before.map(|before| Measured {
        peak: after.peak - before,
        kept: after.now - before,
    });
    let cost = Cost::of(&simulation, columns, measured);
    say::cost(&mut report, &cost, asked.ranks, ghosts);
    say::time(&mut report, plan, simulation.scaled_stable_step());
    say::steps(&mut report, &simulation.expected_clock());
    let (steps, relaxes) = (simulation.last_step(), plan.relaxes());
    if asked.trial {
        let seconds = seconds_a_step(&mut simulation);
        if relaxes {
            say::iteration_time(&mut report, seconds, asked.ranks);
        } else {
            say::run_time(&mut report, seconds, steps, asked.ranks);
        }
    }
    for warning in &survey.warnings {
        report.say(format_args!("warning: {warning}"));
    }
    Ok(report)
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
fn seconds_a_step<const D: usize>(simulation: &mut Simulation<'_, D>) -> f64 {
    // The first ones bring everything into the caches.
    simulation.advance();
    let (start, mut steps) = (Instant::now(), 0);
    while start.elapsed() < TRIAL && steps < 1000 {
        simulation.advance();
        steps += 1;
    }
    start.elapsed().as_secs_f64() / f64::from(steps)
}

/// Says by formula what there is too much of to make.
fn estimate(plan: &Plan, asked: &Asked, size: &Size) -> Result<Report> {
    let interiors = interiors(plan);
    let mut report = Report::default();
    say::heading(&mut report, plan, asked.deck);
    for (index, body) in plan.bodies.iter().enumerate() {
        say::body(&mut report, plan, body);
        report.line("points", format_args!("about {:.3e}", size.points[index]));
        say::interior(&mut report, plan, interiors[index].as_ref());
    }
    report.say("size, estimated: there is too much of it to be made here");
    report.line("points", format_args!("{:.3e}", size.all_points()));
    report.line("bonds", format_args!("{:.3e}", 0.5 * size.directed_bonds));
    let stable = interiors
        .iter()
        .flatten()
        .map(|interior| interior.stable_step)
        .fold(f64::INFINITY, f64::min);
    // Where all points come from files nothing is known of the step.
    if stable.is_finite() {
        let steps = choose_steps(plan, stable)?;
        let all: f64 = steps.iter().map(|(_, steps)| steps).sum();
        let clock = Clock::new(plan.time.end / all, plan.time.end);
        let cost = Cost::estimate(plan, size.all_points(), size.directed_bonds, &clock);
        say::cost(&mut report, &cost, asked.ranks, 0.0);
        say::time(&mut report, plan, stable);
        say::steps(&mut report, &clock);
    }
    report.say("sets, cracks and probes are not looked at");
    for warning in &plan.warnings {
        report.say(format_args!("warning: {warning}"));
    }
    Ok(report)
}
