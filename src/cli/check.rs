//! `fissure check`: what a deck would do.

use std::path::Path;

use fissure::deck::{self, Deck};
use fissure::error::Result;
use fissure::problem::Problem;
use fissure::solver::assign::cutoffs;
use fissure::solver::calibration::calibrated;
use fissure::solver::size::is_feasible;
use fissure::solver::steps::{choose_steps, even_clock};
use fissure::survey::{Cost, Interior, Size, dry_run, interior, size};

use super::check_report as say;
use super::report::Report;
use super::{CheckArguments, Verbosity, each, launch, print};

/// More lattice cells, points or bonds than these, counted from both ends, are not made to check a deck:
/// it would take more than some seconds and 1 GB.
const MOST_CELLS: f64 = 1e7;
const MOST_POINTS: f64 = 2e6;
const MOST_BONDS: f64 = 1.5e8;

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

fn check_one(path: &Path, arguments: &CheckArguments, verbosity: Verbosity) -> Result<()> {
    let deck = deck::read(path, &arguments.set)?;
    let asked = Asked {
        path,
        deck: &deck,
        ranks: arguments.ranks,
        // Nobody reads the speed of a deck that is only to be right.
        trial: verbosity != Verbosity::Quiet,
    };
    let report = report(&asked).map_err(|error| deck.locate(error))?;
    if verbosity == Verbosity::Quiet {
        return Ok(());
    }
    print(&report.text)
}

/// What is asked about a deck.
struct Asked<'a> {
    path: &'a Path,
    deck: &'a Deck,
    ranks: u32,
    /// Whether some steps are made to know their speed.
    trial: bool,
}

/// The figures of a deck; errors name places in it by spans.
fn report(asked: &Asked) -> Result<Report> {
    let problem = asked.deck.problem()?;
    let ranks = asked.ranks as usize;
    is_feasible(&problem, &cutoffs(&problem), ranks)?;
    let problem = calibrated(&problem)?;
    let size = size(&problem)?;
    let few = size.cells <= MOST_CELLS
        && size.all_points() <= MOST_POINTS
        && size.directed_bonds() <= MOST_BONDS;
    if few {
        look_at(&problem, asked)
    } else {
        estimate(&problem, asked, &size)
    }
}

/// What a point inside each body is like, where that can be found.
fn interiors(problem: &Problem) -> Vec<Option<Interior>> {
    (0..problem.bodies.len())
        .map(|body| interior(problem, body))
        .collect()
}

/// Makes points and bonds and looks at them.
fn look_at(problem: &Problem, asked: &Asked) -> Result<Report> {
    let run = dry_run(problem, asked.ranks, asked.trial)?;
    let (survey, dimension) = (&run.survey, problem.dimension.count());
    let interiors = interiors(problem);
    let mut report = Report::default();
    say::heading(&mut report, problem, asked.path);
    for (index, body) in problem.bodies.iter().enumerate() {
        say::body(&mut report, problem, body);
        say::figures(&mut report, body, &survey.bodies[index], dimension);
        say::interior(&mut report, problem, interiors[index].as_ref());
        if asked.trial {
            say::parting(&mut report, problem, index);
        }
    }
    say::joints(&mut report, problem, survey);
    say::places(&mut report, problem, survey, dimension);
    say::sets(&mut report, problem, survey);
    report.say("size");
    say::size(&mut report, problem, run.points, run.bonds);
    report.line(
        "of them as lattice",
        super::format::count(run.lattice_bonds),
    );
    say::cost(&mut report, &run.cost, asked.ranks, run.ghosts);
    say::time(&mut report, problem, run.stable_step);
    say::steps(&mut report, problem, &run.steps);
    if let Some(seconds) = run.seconds {
        say::run_time(&mut report, problem, &run.steps, seconds, asked.ranks);
    }
    say::warnings(&mut report, asked.deck, &survey.warnings);
    Ok(report)
}

/// Says by formula what there is too much of to make.
fn estimate(problem: &Problem, asked: &Asked, size: &Size) -> Result<Report> {
    let interiors = interiors(problem);
    let mut report = Report::default();
    say::heading(&mut report, problem, asked.path);
    for (index, body) in problem.bodies.iter().enumerate() {
        say::body(&mut report, problem, body);
        report.line("points", format_args!("about {:.3e}", size.points[index]));
        say::interior(&mut report, problem, interiors[index].as_ref());
    }
    report.say("size, estimated: there is too much of it to be made here");
    report.line("points", format_args!("{:.3e}", size.all_points()));
    report.line("bonds", format_args!("{:.3e}", 0.5 * size.directed_bonds()));
    let stable = interiors
        .iter()
        .flatten()
        .map(|interior| interior.stable_step)
        .fold(f64::INFINITY, f64::min);
    // Where all points come from files nothing is known of the step.
    if stable.is_finite() {
        let steps = choose_steps(problem, stable)?;
        let clock = even_clock(problem, &steps);
        let cost = Cost::estimate(problem, size, &clock);
        say::cost(&mut report, &cost, asked.ranks, 0.0);
        say::time(&mut report, problem, stable);
        say::steps(&mut report, problem, &steps);
    }
    report.say("sets, cracks and probes are not looked at");
    say::warnings(&mut report, asked.deck, &problem.warnings);
    Ok(report)
}
