//! Uses of the laws' declarations: the table of laws in the book, and laws in problems built in Rust.

use fissure::comm::threads;
use fissure::dimension::{Constraint, Dimension};
use fissure::elastic::Isotropic;
use fissure::expression::Expression;
use fissure::material::{Declaration, Key, Kind, declarations};
use fissure::problem::{
    BreakableBonds, Calibration, Damage, DamageRule, Law, Material, Problem, Shape, StepRule,
    Toughness, VolumeCorrection, WorkMeasure, WorkRule,
};
use fissure::solver::Simulation;

fn key(key: &Key) -> String {
    let words = match &key.kind {
        Kind::Word(words) => {
            let words: Vec<String> = (words.iter())
                .map(|word| format!("`\"{}\"`", word.word))
                .collect();
            format!(" ({})", words.join(", "))
        }
        _ => String::new(),
    };
    format!("`{}`{words}", key.name)
}

/// List keys with their meanings; consecutive keys with the same meaning share one entry.
fn keys(all: &[Key]) -> Vec<String> {
    let same = all.chunk_by(|a, b| a.meaning == b.meaning);
    same.map(|keys| {
        let names: Vec<String> = keys.iter().map(key).collect();
        format!("{}: {}", names.join(", "), keys[0].meaning)
    })
    .collect()
}

fn row(law: &Declaration) -> String {
    let mut force = law.force.to_owned();
    if law.any_poisson_ratio {
        force += "; any Poisson's ratio (two constants)";
    }
    if law.no_line.is_some() {
        force += "; 2-D and 3-D";
    }
    force += match (law.critical_stretch, law.breaks_by_energy) {
        (Some(_), _) => "; can break",
        (None, true) => "; can break by energy",
        (None, false) if law.breaks_by_itself() => "; breaks by itself",
        (None, false) => "; cannot break",
    };
    let cells = format!("{force} @ {}", keys(law.keys).join("; "));
    let cells = cells.replace('|', "\\|").replace(" @ ", " | ");
    format!("| `{}` | {cells} |", law.name)
}

#[test]
fn the_reference_has_the_table_of_laws() {
    let rows: Vec<String> = declarations().map(row).collect();
    let table = format!(
        "| law | force | its own keys |\n|---|---|---|\n{}\n",
        rows.join("\n")
    );
    let page = include_str!("../../docs/src/reference/laws.md");
    assert!(
        page.contains(&table),
        "not in docs/src/reference/laws.md:\n{table}"
    );
}

#[test]
fn names_of_laws_and_keys_are_said_once_and_have_a_meaning() {
    let mut names: Vec<&str> = declarations().map(|law| law.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), declarations().count());
    for law in declarations() {
        assert!(!law.force.is_empty() && !law.examples.is_empty(), "{law:?}");
        for key in law.keys {
            assert!(!key.meaning.is_empty(), "{law:?} {key:?}");
            let same = law.keys.iter().filter(|other| other.name == key.name);
            assert_eq!(same.count(), 1, "{law:?} {key:?}");
        }
    }
}

/// Build the problem of a small body with a law.
fn body(dimension: Dimension, law: Law, damage: Option<Damage>) -> Problem {
    let mut problem = Problem::new(dimension, 3.0, 1.0);
    problem.time.step = StepRule::Fixed(0.01);
    problem.volume_correction = VolumeCorrection::Linear;
    let elastic = Isotropic {
        youngs_modulus: 5.0,
        poisson_ratio: 0.25,
    };
    let cube = Shape::Box {
        lower: [0.0; 3],
        upper: [6.0; 3],
    };
    problem.add_body("cube", Material::new(law, 2.0, elastic), damage, cube, 1.0);
    problem
}

/// Return the error of a problem in `D` dimensions.
fn fault<const D: usize>(problem: &Problem) -> Option<String> {
    let comm = threads::alone();
    let made = Simulation::<D>::new(problem, &comm);
    made.err().map(|error| error.message)
}

/// A law without its own keys is either refused with a message or runs, in every dimension.
#[test]
fn laws_without_keys_do_not_panic() {
    let constraints = [Constraint::UniaxialStress, Constraint::UniaxialStrain];
    let lines = constraints.map(|constraint| Dimension::Line {
        cross_section: 1.0,
        constraint,
    });
    for declaration in declarations() {
        let law = || Law::of(declaration);
        let is_refused = |dimension, message: Option<String>| {
            let wanted = law().fault(dimension).is_some();
            assert!(
                message.is_some() || !wanted,
                "{declaration:?} {dimension:?}"
            );
        };
        for line in lines {
            is_refused(line, fault::<1>(&body(line, law(), None)));
        }
        for plane in [
            Dimension::PlaneStress { thickness: 1.0 },
            Dimension::PlaneStrain { thickness: 1.0 },
        ] {
            is_refused(plane, fault::<2>(&body(plane, law(), None)));
        }
        let space = Dimension::Space;
        is_refused(space, fault::<3>(&body(space, law(), None)));
    }
}

#[test]
fn a_law_of_a_problem_in_rust_is_checked_before_the_run() {
    let law = |name| Law::named(name).unwrap();
    let line = Dimension::Line {
        cross_section: 1.0,
        constraint: Constraint::UniaxialStress,
    };
    let space = Dimension::Space;
    let brittle = Damage::new(DamageRule::CriticalStretch, Toughness::FractureEnergy(1.0));
    let found = fault::<3>(&body(space, law("elastic_plastic_pmb"), None));
    assert_eq!(
        found.unwrap(),
        "[body.cube] law `elastic_plastic_pmb`: needs `yield_stretch`: stretch s_y at which a bond yields, in tension \
         and in compression"
    );
    let found = fault::<1>(&body(line, law("ordinary"), None)).unwrap();
    assert!(found.contains("has no 1-D form"), "{found}");
    let work = WorkRule {
        breakable: BreakableBonds::Stretched,
        family_correction: 0.0,
        measure: WorkMeasure::Displacement,
    };
    let calibration = Calibration::Peridigm2021;
    let rule = DamageRule::Energy { calibration, work };
    let of_the_plane = Damage::new(rule, Toughness::FractureEnergy(1.0));
    let found = fault::<3>(&body(space, law("ordinary"), Some(of_the_plane))).unwrap();
    assert!(found.contains("no formula in this dimension"), "{found}");
    let found = fault::<3>(&body(space, law("proportional"), Some(brittle.clone()))).unwrap();
    assert!(found.contains("cannot break"), "{found}");

    let yielding = law("elastic_plastic_pmb").with("yield_stretch", 0.1);
    let printed = law("normalised_pmb").with("form", "diehl2016");
    for law in [yielding.unwrap(), printed.unwrap(), law("ordinary")] {
        assert_eq!(fault::<3>(&body(space, law, Some(brittle.clone()))), None);
    }
    let lambda = Expression::of_length("0.01*exp(-r)").unwrap();
    let linear = law("linear_microelastic").with("lambda", lambda);
    assert_eq!(fault::<3>(&body(space, linear.unwrap(), None)), None);
}
