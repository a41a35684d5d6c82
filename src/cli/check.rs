//! `fissure check`: validation of decks, and a report on each deck.

use std::path::Path;

use fissure::deck::{self, Deck};
use fissure::error::Result;
use fissure::problem::Problem;
use fissure::solver::assign::cutoffs;
use fissure::solver::calibration::calibrated;
use fissure::solver::size::is_feasible;
use fissure::solver::steps::{choose_steps, even_clock};
use fissure::survey::{Cost, Interior, Size, dry_run, interior, size};

use super::check_json;
use super::check_report as section;
use super::report::Report;
use super::{CheckArguments, Verbosity, each, launch, print};

/// Largest number of lattice cells for which `check` makes a dry run (the set-up of a run on one rank).
/// If this limit, [`MAX_POINTS`] and [`MAX_BONDS`] are not exceeded, a dry run takes some seconds and needs
/// 1 GB.
const MAX_CELLS: f64 = 1e7;
/// Largest number of points for which `check` makes a dry run.
const MAX_POINTS: f64 = 2e6;
/// Largest number of directed bonds (neighbours, summed over all points) for which `check` makes a dry run.
const MAX_BONDS: f64 = 1.5e8;

/// Validate the decks and print a report on each deck.
///
/// # Errors
/// If a deck is invalid, if the output cannot be written, or if the threads cannot be started.
pub fn check(arguments: &CheckArguments, verbosity: Verbosity) -> Result<()> {
    launch::start_threads(None)?;
    each(&arguments.decks, |deck| {
        check_one(deck, arguments, verbosity)
    })
}

fn check_one(path: &Path, arguments: &CheckArguments, verbosity: Verbosity) -> Result<()> {
    let checked = report_one(path, arguments, verbosity);
    if let (Err(error), true) = (&checked, arguments.json) {
        let report = check_json::invalid(&path.to_string_lossy(), &error.message);
        print(&format!("{report}\n"))?;
    }
    checked
}

fn report_one(path: &Path, arguments: &CheckArguments, verbosity: Verbosity) -> Result<()> {
    let deck = deck::read_with(path, &arguments.with, &arguments.set)?;
    let request = Request {
        path,
        deck: &deck,
        ranks: arguments.ranks,
        // With --quiet, skip the slow measurements. A report as JSON then lacks their results.
        measure: verbosity != Verbosity::Quiet,
        json: arguments.json,
    };
    let report = report(&request).map_err(|error| deck.locate(error))?;
    if verbosity == Verbosity::Quiet && !arguments.json {
        return Ok(());
    }
    print(&report)
}

/// The deck and the options of a check.
pub struct Request<'a> {
    pub path: &'a Path,
    pub deck: &'a Deck,
    pub ranks: u32,
    /// Measure the times of a force evaluation, a history row and the outputs. If the report is text, not
    /// JSON, also compute the separation energy ratios.
    measure: bool,
    /// Print the report as one line of JSON.
    json: bool,
}

/// Steps and cost of a run that is too large for a dry run.
pub struct TimeEstimate {
    /// Stable step (s) of the first stage, for the scaled density of this stage.
    pub stable_step: f64,
    /// For each stage: the first time step (s), and the number of time steps or load steps.
    pub steps: Vec<(f64, f64)>,
    pub cost: Cost,
}

/// Return the report on a deck. An error can have a span (a position in the deck), which the caller converts
/// to file and line.
fn report(request: &Request) -> Result<String> {
    let problem = request.deck.problem()?;
    let ranks = request.ranks as usize;
    is_feasible(&problem, &cutoffs(&problem), ranks)?;
    let problem = calibrated(&problem)?;
    let size = size(&problem)?;
    let few = size.cells <= MAX_CELLS
        && size.all_points() <= MAX_POINTS
        && size.directed_bonds() <= MAX_BONDS;
    if few {
        simulate(&problem, request)
    } else {
        estimate(&problem, request, &size)
    }
}

/// Compute the properties of the interior of each body, where families are complete. The entry of a body is
/// `None` if the body has no lattice, or if the computation fails.
fn interiors(problem: &Problem) -> Vec<Option<Interior>> {
    (0..problem.bodies.len())
        .map(|body| interior(problem, body))
        .collect()
}

/// Perform a dry run and return the report.
fn simulate(problem: &Problem, request: &Request) -> Result<String> {
    let run = dry_run(problem, request.ranks, request.measure)?;
    let (survey, dimension) = (&run.survey, problem.dimension.count());
    let interiors = interiors(problem);
    if request.json {
        let report = check_json::simulated(problem, request, &run, &interiors);
        return Ok(format!("{report}\n"));
    }
    let mut report = Report::default();
    section::heading(&mut report, problem, request.path);
    for (index, body) in problem.bodies.iter().enumerate() {
        section::body(&mut report, problem, body);
        section::figures(&mut report, body, &survey.bodies[index], problem.dimension);
        section::interior(&mut report, problem, interiors[index].as_ref());
        if request.measure {
            section::separation_energy(&mut report, problem, index);
        }
    }
    section::bonds_between_bodies(&mut report, problem, survey);
    section::contact(&mut report, problem);
    section::rigid(&mut report, problem);
    section::places(&mut report, problem, survey, dimension);
    section::sets(&mut report, problem, survey);
    report.heading("size");
    section::size(&mut report, problem, run.points, run.bonds);
    report.line(
        "of them as lattice",
        super::format::count(run.lattice_bonds),
    );
    section::cost(&mut report, &run.cost, request.ranks, run.ghosts);
    section::time(&mut report, problem, run.stable_step);
    section::steps(&mut report, problem, &run.steps);
    if let Some(seconds) = &run.seconds {
        let steps = &run.steps;
        section::run_time(
            &mut report,
            problem,
            steps,
            (seconds, &run.cost),
            request.ranks,
        );
    }
    section::warnings(&mut report, request.deck, &survey.warnings);
    Ok(report.text)
}

/// Return a report of estimates for a run that is too large for a dry run.
fn estimate(problem: &Problem, request: &Request, size: &Size) -> Result<String> {
    let interiors = interiors(problem);
    let stable = interiors
        .iter()
        .flatten()
        .map(|interior| interior.stable_step)
        .fold(f64::INFINITY, f64::min);
    // The stable step is known only if the interior of at least one body has been computed.
    let time = if stable.is_finite() {
        let steps = choose_steps(problem, stable)?;
        let first = problem.all_stages()[0].time;
        let clock = even_clock(problem, &steps);
        Some(TimeEstimate {
            stable_step: stable * first.density_scale.sqrt(),
            cost: Cost::estimate(problem, size, &clock),
            steps,
        })
    } else {
        None
    };
    if request.json {
        let report = check_json::estimated(problem, request, size, &interiors, time.as_ref());
        return Ok(format!("{report}\n"));
    }
    let mut report = Report::default();
    section::heading(&mut report, problem, request.path);
    for (index, body) in problem.bodies.iter().enumerate() {
        section::body(&mut report, problem, body);
        report.line("points", format_args!("about {:.3e}", size.points[index]));
        section::interior(&mut report, problem, interiors[index].as_ref());
    }
    report.heading("size, estimated: too large to build here");
    report.line("points", format_args!("{:.3e}", size.all_points()));
    report.line("bonds", format_args!("{:.3e}", 0.5 * size.directed_bonds()));
    if let Some(time) = time {
        section::cost(&mut report, &time.cost, request.ranks, 0.0);
        section::time(&mut report, problem, time.stable_step);
        section::steps(&mut report, problem, &time.steps);
    }
    report.heading("sets, cracks and probes are not checked");
    section::warnings(&mut report, request.deck, &problem.warnings);
    Ok(report.text)
}
