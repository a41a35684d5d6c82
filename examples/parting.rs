//! Print the separation energy of a body per area, divided by the fracture energy, for several laws, damage
//! criteria and directions of separation. `studies/parting/run.py` plots this table:
//!
//! ```sh
//! cargo run --release --example parting
//! ```

use std::process::ExitCode;

use fissure::dimension::Dimension;
use fissure::elastic::Isotropic;
use fissure::error::Result;
use fissure::problem::{
    BreakableBonds, Calibration, Damage, DamageRule, Law, Material, Problem, Shape, Toughness,
    WorkMeasure, WorkRule,
};
use fissure::solver::calibration::separation_energy_ratio;

/// m, the ratio of horizon to spacing.
const RATIO: f64 = 4.0;

/// Angles between the relative displacement of the two halves and the normal of the crack, degrees: 0 is
/// opening, 90 is sliding.
const ANGLES: [f64; 7] = [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0];

fn main() -> ExitCode {
    match print_table() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn print_table() -> Result<()> {
    let angles = ANGLES.map(|angle| angle.to_string());
    println!("law,poisson_ratio,criterion,{}", angles.join(","));
    for (law, ratio) in [
        ("ordinary", 0.1),
        ("ordinary", 0.4),
        ("correspondence", 0.3),
        ("bond_associated_correspondence", 0.3),
    ] {
        for (criterion, rule) in rules() {
            if law != "ordinary" && criterion != "work" {
                continue;
            }
            let problem = body(law, ratio, rule)?;
            let costs =
                ANGLES.map(|angle| separation_energy_ratio(&problem, 0, angle.to_radians()));
            let costs = costs.map(|cost| cost.map_or(String::new(), |cost| format!("{cost:.4}")));
            println!("{law},{ratio},{criterion},{}", costs.join(","));
        }
    }
    Ok(())
}

fn rules() -> [(&'static str, DamageRule); 3] {
    let work = |breakable| DamageRule::Energy {
        calibration: Calibration::Energy,
        work: WorkRule {
            breakable,
            family_correction: 0.0,
            measure: WorkMeasure::Objective,
        },
    };
    [
        ("stretch", DamageRule::CriticalStretch),
        ("work of pulled bonds", work(BreakableBonds::Stretched)),
        ("work", work(BreakableBonds::Any)),
    ]
}

/// Return the problem of a body in plane strain whose bonds break at stretches of about 0.02.
pub fn body(law: &str, poisson_ratio: f64, rule: DamageRule) -> Result<Problem> {
    let mut problem = Problem::new(Dimension::PlaneStrain { thickness: 1.0 }, RATIO, 1.0);
    let elastic = Isotropic {
        youngs_modulus: 3e3,
        poisson_ratio,
    };
    let material = Material::new(Law::named(law)?, 1.0, elastic);
    let damage = Damage::new(rule, Toughness::FractureEnergy(2.0));
    // `separation_energy_ratio` creates its own block of lattice points, so the size of this shape has no
    // effect.
    let cell = Shape::Box {
        lower: [0.0; 3],
        upper: [1.0, 1.0, 0.0],
    };
    problem.add_body("block", material, Some(damage), cell, 1.0);
    Ok(problem)
}
