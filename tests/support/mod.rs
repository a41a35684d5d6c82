//! Helpers shared by several test files.

#![allow(dead_code, reason = "not every test file uses all of it")]

pub mod command;
pub mod datasets;
pub mod equilibria;
pub mod history;
pub mod recorded;
pub mod saved;

use std::path::Path;

use fissure::comm::{Communicator, threads};
use fissure::deck::{self, Source};
use fissure::problem::Problem;
use fissure::solver::Simulation;
use fissure::solver::bonds::BondUpdate;
use fissure::solver::calibration::calibrated;

/// Return the problem of a deck.
pub fn problem(text: &str) -> Problem {
    let source = Source::new("test.toml", text);
    deck::parse(&source).unwrap_or_else(|error| panic!("{error}"))
}

/// Run `body` on one rank without MPI.
pub fn simulate<const D: usize, T>(text: &str, body: impl FnOnce(Simulation<D>) -> T) -> T {
    let problem = problem(text);
    let comm = threads::alone();
    body(Simulation::new(&problem, &comm).unwrap_or_else(|error| panic!("{error}")))
}

/// Run `body` on one rank without MPI, with a deck of `inputs/` and other values of some parameters.
pub fn simulate_input<const D: usize, T>(
    name: &str,
    parameters: &[(&str, &str)],
    body: impl FnOnce(Simulation<D>) -> T,
) -> T {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("inputs/{name}.toml"));
    let set: Vec<(String, String)> = parameters
        .iter()
        .map(|(name, value)| ((*name).to_owned(), (*value).to_owned()))
        .collect();
    let problem = deck::read(&path, &set).and_then(|deck| deck.problem());
    let problem = problem.unwrap_or_else(|error| panic!("{error}"));
    let problem = calibrated(&problem).unwrap_or_else(|error| panic!("{error}"));
    let comm = threads::alone();
    body(Simulation::new(&problem, &comm).unwrap_or_else(|error| panic!("{error}")))
}

/// Run `body` on several ranks, each a thread.
pub fn simulate_on<const D: usize, T: Send>(
    ranks: usize,
    text: &str,
    body: impl Fn(Simulation<D>) -> T + Sync,
) -> Vec<T> {
    let problem = problem(text);
    threads::run(ranks, |comm: &dyn Communicator| {
        body(Simulation::new(&problem, comm).unwrap_or_else(|error| panic!("{error}")))
    })
}

/// Set the displacements of all points, including ghosts, and evaluate the forces.
pub fn displace<const D: usize>(
    simulation: &mut Simulation<D>,
    map: impl Fn([f64; 3]) -> [f64; 3],
) {
    for point in 0..simulation.model.volume.len() {
        let place = map(simulation.model.position(point));
        for d in 0..D {
            simulation.fields.displacement[d][point] =
                place[d] - simulation.model.reference[d][point];
        }
    }
    simulation.evaluate(BondUpdate::Step(0.0));
}

/// Return the internal force density of an owned point, N/m³.
pub fn force<const D: usize>(simulation: &Simulation<D>, point: usize) -> [f64; D] {
    let force = &simulation.fields.internal_force;
    force.each_ref().map(|component| component[point])
}

/// Return the internal force densities of all owned points, N/m³.
pub fn forces<const D: usize>(simulation: &Simulation<D>) -> Vec<[f64; D]> {
    let points = 0..simulation.model.owned();
    points.map(|point| force(simulation, point)).collect()
}

/// Return the largest absolute value of a component of the force density, over all owned points, N/m³.
pub fn largest_force<const D: usize>(simulation: &Simulation<D>) -> f64 {
    let components = forces(simulation).into_iter().flatten();
    components.fold(0.0, |largest, force| force.abs().max(largest))
}
