//! Thermal strain in every law: free expansion, forces as the derivative of the energy, equal bits, and
//! closed-form stresses and curvatures.

use super::invariants::{
    Case, cases, check_momentum, check_slope, damage, deck, same_bits, strain_energy,
};
use crate::support::{displace, largest_force, problem, simulate, simulate_on};
use fissure::problem::Field;
use fissure::solver::Simulation;
use fissure::solver::bonds::BondUpdate;
use fissure::solver::observers::Snapshot;

/// Return the deck of a law with prescribed temperatures; α = 1e-4, T₀ = 20.
fn heated(case: &Case, dimension: &str, temperature: &str) -> String {
    let table = case.table();
    let table = table.strip_suffix(" }").expect("a table");
    let table = format!("{table}, thermal_expansion = 1e-4, reference_temperature = 20 }}");
    let body = deck(dimension, &table, "exact", "");
    format!("{body}\ncondition.heat = {{ set = 'all', temperature = {temperature} }}\n")
}

#[test]
fn free_expansion_has_no_force_and_no_energy() {
    fn check<const D: usize>(mut simulation: Simulation<D>) {
        let stretch = {
            let column = simulation.fields.thermal_stretch.as_ref().unwrap();
            assert!(column.iter().all(|stretch| *stretch == column[0]));
            column[0]
        };
        // α (T − T₀) = 0.01. If the strain across is 0, the expansion is larger for a Poisson's ratio above
        // 0, and smaller for a negative one.
        let dimension = simulation.problem.dimension;
        let wanted = if dimension.is_confined() {
            0.006..0.02
        } else {
            0.009999..0.010001
        };
        assert!(wanted.contains(&stretch), "{stretch} in {dimension:?}");
        // Hold the body in its reference configuration.
        displace(&mut simulation, |x| x);
        let (scale, energy) = (largest_force(&simulation), strain_energy(&mut simulation));
        assert!(scale > 0.0 && energy > 0.0);
        displace(&mut simulation, |x| x.map(|x| (1.0 + stretch) * x));
        let law = &simulation.problem.bodies[0].material.law;
        // Positions of up to 40 m have rounding errors of up to 1e-14 m. Divided by a strain of 1 %, the
        // relative error of the forces is some 1e-12, and the relative error of the energy is the square of
        // this.
        assert!(largest_force(&simulation) < 1e-10 * scale, "{law:?}");
        assert!(
            strain_energy(&mut simulation).abs() < 1e-15 * energy,
            "{law:?}"
        );
        // The dilatation contains thermal strain.
        let count = if dimension.is_confined() { D } else { 3 };
        for dilatation in Snapshot::new(&mut simulation).field(&mut simulation, Field::Dilatation) {
            let wanted = count as f64 * stretch;
            assert!(
                (dilatation / wanted - 1.0).abs() < 1e-9,
                "{law:?}: {dilatation} {wanted}"
            );
        }
    }
    for case in cases() {
        if case.has_line() {
            simulate(&heated(&case, "1d", "120"), check::<1>);
        }
        simulate(&heated(&case, "plane-stress", "120"), check::<2>);
        // Laws without a potential are rejected in settings with zero strain across.
        if case.is_conservative() {
            simulate(&heated(&case, "plane-strain", "120"), check::<2>);
        }
        simulate(&heated(&case, "3d", "120"), check::<3>);
    }
}

/// Broken bonds do not reduce the thermal strain in the dilatation.
#[test]
fn the_dilatation_of_a_broken_body_contains_the_thermal_strain() {
    fn check<const D: usize>(mut simulation: Simulation<D>) {
        displace(&mut simulation, |x| {
            if x[1] > 3.0 { x.map(|x| 2.0 * x) } else { x }
        });
        let stretch = simulation.fields.thermal_stretch.as_ref().unwrap()[0];
        displace(&mut simulation, |x| x.map(|x| (1.0 + stretch) * x));
        let law = &simulation.problem.bodies[0].material.law;
        let snapshot = Snapshot::new(&mut simulation);
        let damage = snapshot.field(&mut simulation, Field::Damage);
        assert!(damage.iter().any(|damage| *damage > 0.2), "{law:?}");
        for dilatation in snapshot.field(&mut simulation, Field::Dilatation) {
            let wanted = 3.0 * stretch;
            assert!(
                (dilatation / wanted - 1.0).abs() < 1e-9,
                "{law:?}: {dilatation} {wanted}"
            );
        }
    }
    for case in cases() {
        if case.law.critical_stretch.is_some() && case.is_conservative() {
            let deck = heated(&case, "3d", "120");
            let breaks = deck.replace("shape.box", "damage = 'brittle', shape.box");
            simulate(
                &format!(
                    "{breaks}
{}",
                    damage(0.0)
                ),
                check::<3>,
            );
        }
    }
}

#[test]
fn at_uneven_temperatures_the_force_is_the_slope_of_the_energy() {
    for case in cases().filter(Case::is_conservative) {
        if case.has_line() {
            simulate(
                &heated(&case, "1d", "'80 + 50*sin(0.3*x)'"),
                check_slope::<1>,
            );
        }
        let uneven = "'80 + 50*sin(0.3*x + 0.2*y)'";
        simulate(&heated(&case, "plane-stress", uneven), check_slope::<2>);
        simulate(&heated(&case, "plane-strain", uneven), check_slope::<2>);
        simulate(&heated(&case, "3d", uneven), check_slope::<3>);
        simulate(&heated(&case, "3d", uneven), check_momentum::<3>);
    }
}

#[test]
fn a_heated_body_has_the_same_bits_on_any_ranks_and_after_a_restart() {
    for case in cases() {
        for family in ["lattice", "list"] {
            let shaken = |dimension, temperature: &str, velocity: &str| {
                let deck = heated(&case, dimension, temperature);
                let family = format!("horizon = 3, family = '{family}',");
                let deck = deck.replace("horizon = 3,", &family);
                format!("{deck}initial.shake.velocity = {velocity}\n")
            };
            let warm = "'20 + 40*x*sin(3*t)'";
            let velocity = "['0.3*sin(2*x + y)', '0.2*cos(x - 3*y)']";
            same_bits::<2>(&shaken("plane-stress", warm, velocity));
            let velocity = "['0.3*sin(2*x + y)', '0.2*cos(x - 3*z)', '0.2*sin(x*y)']";
            same_bits::<3>(&shaken("3d", warm, velocity));
        }
    }
}

#[test]
fn temperatures_that_are_those_of_the_reference_change_no_bit() {
    let run = |more: &str| {
        let text = deck(
            "plane-stress",
            "pmb = { density = 2, youngs_modulus = 5, thermal_expansion = 1e-3 }",
            "exact",
            "",
        );
        let text = format!("{text}initial.shake.velocity = ['0.3*sin(2*x)', '0.1*y']\n{more}");
        simulate::<2, _>(&text, |mut simulation| {
            (0..10).for_each(|_| simulation.advance());
            simulation.fields.displacement.clone()
        })
    };
    let heated = run("condition.heat = { set = 'all', temperature = 0 }\n");
    assert!(run("") == heated);
}

/// Return the values of a field at all points after the run.
fn at_the_end<const D: usize>(text: &str, field: Field) -> Vec<f64> {
    simulate::<D, _>(text, |mut simulation| {
        while !simulation.is_over() {
            simulation.advance();
        }
        simulation.check().unwrap();
        simulation.evaluate(BondUpdate::None);
        Snapshot::new(&mut simulation).field(&mut simulation, field)
    })
}

/// A clamped body with E = 200 GPa and α = 1e-6, heated by 100 K.
#[test]
fn a_clamped_body_has_the_stress_of_hookes_law() {
    // This is also Poisson's ratio of `pmb` under uniaxial strain.
    let ratio = 0.25;
    let (young, free) = (200e9_f64, 1e-4);
    let held = |dimension: &str, constraint: &str| {
        let law = if dimension == "1d" {
            "pmb"
        } else {
            "correspondence"
        };
        let components = ["", "[0]", "[0, 0]", "[0, 0, 0]"];
        let count = match dimension {
            "1d" => 1,
            "3d" => 3,
            _ => 2,
        };
        let upper = ["", "[40]", "[16, 16]", "[9, 9, 9]"][count];
        let (lower, zero) = (components[count], components[count]);
        format!(
            "dimension = '{dimension}'
            {constraint}
            grid = {{ spacing = 1, horizon = 3.015 }}
            material.steel.{law} = {{ density = 8000, youngs_modulus = 200e9, poisson_ratio = {ratio}, thermal_expansion = 1e-6, reference_temperature = 20 }}
            body.block = {{ material = 'steel', shape.box = {{ lower = {lower}, upper = {upper} }} }}
            condition.hold = {{ set = 'block', displacement = {zero} }}
            condition.heat = {{ set = 'block', temperature = 120 }}
            time = {{ end = 1e-3, step = 1e-5 }}
            "
        )
    };
    // Check interior points only: points of `pmb` near an end have incomplete families.
    let check = |found: Vec<f64>, wanted: [f64; 3]| {
        let count = found.len() / 6;
        for entries in found.chunks_exact(6).skip(count / 3).take(count / 3) {
            for (found, wanted) in entries.iter().zip(wanted) {
                let error = (found - wanted).abs() / (young * free);
                // With three clamped directions, terms of second order are 3e-4.
                assert!(error < 1e-3, "{entries:?}, wanted {wanted:?}");
            }
        }
    };
    // σ is −E α ΔT times 1, 1/(1 − ν) or 1/(1 − 2ν) for one, two or three clamped directions.
    let [one, two, three] = [1.0, 1.0 - ratio, 1.0 - 2.0 * ratio].map(|part| -young * free / part);
    for field in [Field::Stress, Field::CauchyStress] {
        check(at_the_end::<1>(&held("1d", ""), field), [one, 0.0, 0.0]);
        let confined = held("1d", "constraint = 'uniaxial-strain'");
        check(at_the_end::<1>(&confined, field), [three; 3]);
        check(
            at_the_end::<2>(&held("plane-stress", ""), field),
            [two, two, 0.0],
        );
        check(
            at_the_end::<2>(&held("plane-strain", ""), field),
            [three; 3],
        );
        check(at_the_end::<3>(&held("3d", ""), field), [three; 3]);
    }
}

/// Timoshenko (1925): two layers of the same thickness and stiffness bend with curvature 3/2 Δα ΔT/h, with
/// the total thickness h.
#[test]
fn a_bimaterial_strip_bends_with_timoshenkos_curvature() {
    let (height, length) = (12.0, 72.0);
    let text = format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 1, horizon = 3.015 }}
        material.passive.correspondence = {{ density = 8000, youngs_modulus = 100e9, poisson_ratio = 0.3 }}
        material.active.correspondence = {{ density = 8000, youngs_modulus = 100e9, poisson_ratio = 0.3, thermal_expansion = 2e-5 }}
        body.below = {{ material = 'active', shape.box = {{ lower = [0, 0], upper = [{length}, 6] }} }}
        body.above = {{ material = 'passive', shape.box = {{ lower = [0, 6], upper = [{length}, {height}] }} }}
        set.left.where = 'x < 3'
        condition.hold = {{ set = 'left', displacement = [0, 0] }}
        condition.heat = {{ set = 'below', temperature = 10 }}
        time = {{ end = 1, method = 'relaxation', relaxation = {{ load_steps = 1, iterations = 50000 }} }}
        "
    );
    let curvature = simulate::<2, _>(&text, |mut simulation| {
        while !simulation.is_over() {
            simulation.advance();
        }
        simulation.check().unwrap();
        // The curvature follows from the second difference of the deflection of the middle rows, away from
        // both ends.
        let deflection = |place: f64| {
            let (mut sum, mut count) = (0.0, 0.0);
            for point in 0..simulation.model.owned() {
                let [x, y, _] = simulation.model.position(point);
                if (x - place).abs() < 0.1 && (y - 0.5 * height).abs() < 1.0 {
                    sum += simulation.fields.displacement[1][point];
                    count += 1.0;
                }
            }
            sum / count
        };
        let (middle, arm) = (40.5, 20.0);
        let ends = deflection(middle - arm) + deflection(middle + arm);
        (ends - 2.0 * deflection(middle)) / (arm * arm)
    });
    let wanted = 1.5 * 2e-4 / height;
    assert!(
        (curvature / wanted - 1.0).abs() < 0.05,
        "{curvature} for {wanted}"
    );
}

/// Without a condition in a stage, points have the reference temperature. Of several conditions, the last one
/// applies.
#[test]
fn temperatures_follow_conditions_and_stages() {
    let text = "dimension = 'plane-stress'
        grid = { spacing = 1, horizon = 3 }
        material.steel.pmb = { density = 1, youngs_modulus = 1, thermal_expansion = 1e-5, reference_temperature = 20 }
        body.block = { material = 'steel', shape.box = { lower = [0, 0], upper = [10, 10] } }
        set.right.where = 'x > 5'
        condition.all = { set = 'all', temperature = '100 + x*t' }
        condition.right = { set = 'right', temperature = 50 }
        time.step = 0.1
        time.end = 2
        [[stage]]
        end = 1
        [[stage]]
        off = ['all']
        ";
    for ranks in [1, 3] {
        simulate_on::<2, _>(ranks, text, |mut simulation| {
            let look = |simulation: &Simulation<2>, left: &dyn Fn(f64) -> f64| {
                for point in 0..simulation.model.owned() {
                    let [x, ..] = simulation.model.position(point);
                    let wanted = if x > 5.0 { 50.0 } else { left(x) };
                    let found = simulation.fields.temperature.as_ref().unwrap()[point];
                    assert!((found - wanted).abs() < 1e-9, "{found} at {x}");
                }
            };
            look(&simulation, &|_| 100.0);
            (0..5).for_each(|_| simulation.advance());
            let time = simulation.clock.time();
            look(&simulation, &|x| 100.0 + x * time);
            while simulation.progress.stage == 0 {
                simulation.advance();
            }
            look(&simulation, &|_| 20.0);
        });
    }
    assert!(problem(text).temperature_changes());
}
