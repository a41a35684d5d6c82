//! What it costs to part a body at any angle, by law and criterion, as a share of the fracture energy; a table for
//! `studies/parting/run.py`:
//!
//! ```sh
//! cargo run --release --example parting
//! ```

use std::process::ExitCode;

use fissure::dimension::Dimension;
use fissure::elastic::Isotropic;
use fissure::error::Result;
use fissure::problem::{
    Calibration, Damage, DamageRule, Law, Material, Problem, Sense, Shape, Toughness, WorkMeasure,
    WorkRule,
};
use fissure::solver::calibration::separation_energy_ratio;

/// Horizon over spacing.
const RATIO: f64 = 4.0;

/// To the normal of the cut, degrees: from opening to sliding.
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
    let work = |sense| DamageRule::Energy {
        calibration: Calibration::Energy,
        work: WorkRule {
            sense,
            family_correction: 0.0,
            measure: WorkMeasure::Objective,
        },
    };
    [
        ("stretch", DamageRule::CriticalStretch),
        ("work of pulled bonds", work(Sense::Pulled)),
        ("work", work(Sense::Either)),
    ]
}

/// A body in plane strain whose bonds break at stretches of about 0.02.
pub fn body(law: &str, poisson_ratio: f64, rule: DamageRule) -> Result<Problem> {
    let mut problem = Problem::new(Dimension::PlaneStrain { thickness: 1.0 }, RATIO, 1.0);
    let elastic = Isotropic {
        youngs_modulus: 3e3,
        poisson_ratio,
    };
    let material = Material::new(Law::named(law)?, 1.0, elastic);
    let damage = Damage::new(rule, Toughness::FractureEnergy(2.0));
    // What is parted is a block of its lattice, of a size of its own.
    let cell = Shape::Box {
        lower: [0.0; 3],
        upper: [1.0, 1.0, 0.0],
    };
    problem.add_body("block", material, Some(damage), cell, 1.0);
    Ok(problem)
}
