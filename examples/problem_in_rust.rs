//! Pull apart a glass plate with a notch. The problem is built in Rust, without a deck, and the energies are
//! printed every 50 steps:
//!
//! ```sh
//! cargo run --release --example problem_in_rust
//! ```

use std::process::ExitCode;

use fissure::comm::Communicator;
use fissure::dimension::Dimension;
use fissure::elastic::Isotropic;
use fissure::error::Result;
use fissure::expression::Expression;
use fissure::problem::{
    Action, Crack, Damage, DamageRule, Interval, Law, Material, Problem, Selector, Shape, Toughness,
};
use fissure::run::{Existing, Observer, Options, Row, RunState};

/// Edge of a cell, m.
const SPACING: f64 = 1e-3;

fn main() -> ExitCode {
    match tear(100e-6) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn tear(end: f64) -> Result<()> {
    let world = fissure::run::start_mpi()?;
    let mut options = Options::new("out/problem_in_rust");
    options.existing = Existing::Replace;
    let mut printer = Printer {
        speaks: world.rank() == 0,
    };
    fissure::run(&plate(end)?, &world, options, &mut printer)?;
    Ok(())
}

/// Return the problem of a plate of 60 mm × 30 mm whose upper and lower edges move apart, each at 1 m/s after
/// a ramp of 10 µs. `end` is the end time, s.
pub fn plate(end: f64) -> Result<Problem> {
    let dimension = Dimension::PlaneStress { thickness: 1e-3 };
    let mut problem = Problem::new(dimension, 3.0 * SPACING, end);
    problem.title = "A plate built in Rust".to_owned();
    let glass = Material::new(
        Law::named("pmb")?,
        2440.0,
        Isotropic {
            youngs_modulus: 72e9,
            poisson_ratio: dimension.bond_based_poisson_ratio(),
        },
    );
    let plate = Shape::Box {
        lower: [0.0; 3],
        upper: [0.06, 0.03, 0.0],
    };
    let brittle = Damage::new(
        DamageRule::CriticalStretch,
        Toughness::FractureEnergy(135.0),
    );
    problem.add_body("plate", glass, Some(brittle), plate, SPACING);
    let notch = Crack::Segment {
        from: [0.0, 0.015, 0.0],
        to: [0.02, 0.015, 0.0],
        width: 0.0,
    };
    problem.add_crack("notch", notch);
    for (name, place, velocity) in [
        ("top", "y > 0.027", "ramp(t, 0, 1e-5)"),
        ("bottom", "y < 0.003", "-ramp(t, 0, 1e-5)"),
    ] {
        let set = problem.add_set(name, Selector::Where(Expression::of(place)?));
        let pull = vec![None, Some(Expression::of(velocity)?)];
        problem.add_condition(name, set, Action::Velocity(pull));
    }
    problem.history.every = Some(Interval::Steps(50));
    Ok(problem)
}

/// Observer that prints the energies of each row of the history.
struct Printer {
    speaks: bool,
}

impl Observer for Printer {
    fn row(&mut self, now: &mut dyn RunState, row: &Row) {
        if self.speaks {
            let energies = row.energies();
            println!(
                "step {:5}  t = {:.3e} s  kinetic {:.3e} J  strain {:.3e} J  fracture {:.3e} J",
                now.number(),
                now.time(),
                energies.kinetic,
                energies.strain,
                energies.fracture,
            );
        }
    }
}
