//! Run a deck, as a single process or under mpirun, and print the energies at the end:
//!
//! ```sh
//! cargo run --release --example run_deck inputs/crack_branching.toml out/example
//! ```

use std::path::Path;
use std::process::ExitCode;

use fissure::comm::{Communicator, agree};
use fissure::deck;
use fissure::error::{Error, Result};
use fissure::run::{Existing, Options, Outcome, Unobserved};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, deck, folder] = &arguments[..] else {
        eprintln!("run_deck DECK FOLDER");
        return ExitCode::from(2);
    };
    let world = match fissure::run::start_mpi() {
        Ok(world) => world,
        Err(error) => return failed(&error),
    };
    match run_deck(Path::new(deck), Path::new(folder), &world) {
        Ok(outcome) if world.rank() == 0 => print_energies(&outcome),
        Err(error) if world.rank() == 0 => return failed(&error),
        Err(error) => return ExitCode::from(error.exit_code()),
        Ok(_) => {}
    }
    ExitCode::SUCCESS
}

/// Run a deck and write the result into a folder; an earlier result is replaced.
pub fn run_deck(deck: &Path, folder: &Path, comm: &dyn Communicator) -> Result<Outcome> {
    let deck = agree(comm, deck::read(deck, &[]))?;
    let problem = deck.problem_on(comm)?;
    let mut options = Options::new(folder);
    options.existing = Existing::Replace;
    options.deck = Some(deck);
    fissure::run(&problem, comm, options, &mut Unobserved)
}

fn print_energies(outcome: &Outcome) {
    println!("{} steps, {:.4e} s", outcome.number, outcome.time);
    if let Some(row) = &outcome.last_row {
        println!("kinetic   {:.4e} J", row.energies.kinetic);
        println!("strain    {:.4e} J", row.energies.strain);
        println!("fracture  {:.4e} J", row.energies.fracture);
    }
    println!("{}", outcome.files.result.display());
}

fn failed(error: &Error) -> ExitCode {
    eprintln!("error: {error}");
    ExitCode::from(error.exit_code())
}
