//! Toughness by direction of the bond: opening costs the fracture energy of its direction, and cracks follow the weak
//! direction.

use crate::support::{displace, problem, simulate};
use fissure::solver::Simulation;
use fissure::solver::calibration::separation_energy_ratio;

/// Fracture energy of cracks along the direction, J/m².
const ALONG: f64 = 2.0;

/// A body of unit spacing that breaks by a rule with these keys.
fn deck(dimension: &str, horizon: u32, law: &str, rule: &str, keys: &str) -> String {
    let corner = if dimension == "3d" { "9, 9, 9" } else { "9, 9" };
    format!(
        "dimension = '{dimension}'
        grid = {{ spacing = 1, horizon = {horizon}, volume_correction = 'exact' }}
        material.m.{law}
        damage.d.{rule} = {{ {keys} }}
        body.block = {{ material = 'm', damage = 'd', shape.box = {{ lower = [{}], upper = [{corner}] }} }}
        time = {{ end = 1 }}
        ",
        corner.replace('9', "0")
    )
}

fn directed(ratio: f64, axis: &str) -> String {
    let across = ratio * ALONG;
    format!(
        "fracture_energy_along = {ALONG}, fracture_energy_across = {across}, direction = {axis}"
    )
}

/// Energy of opening along y, divided by the fracture energy of this direction.
fn cost(text: &str) -> f64 {
    separation_energy_ratio(&problem(text), 0, 0.0).expect("the block separates")
}

/// The cost of opening in units of the fracture energy of its direction is that of an isotropic body within the error that
/// the lattice makes in the directions of bonds.
#[test]
fn opening_costs_the_fracture_energy_of_its_direction() {
    let pmb = "pmb = { density = 2, youngs_modulus = 1e6 }";
    let ordinary = "ordinary = { density = 2, youngs_modulus = 1e6, poisson_ratio = 0.25 }";
    let correspondence =
        "correspondence = { density = 2, youngs_modulus = 1e6, poisson_ratio = 0.3 }";
    for (dimension, horizon, axes, bound) in [
        ("plane-stress", 3, &["[0, 1]", "[1, 0]"][..], 0.08),
        ("plane-strain", 6, &["[0, 2]", "[3, 0]"][..], 0.03),
        ("3d", 3, &["[0, 1, 0]", "[1, 0, 0]", "[0, 0, 1]"][..], 0.08),
    ] {
        let laws = [
            (pmb, "critical_stretch"),
            (pmb, "energy"),
            (ordinary, "energy"),
            (correspondence, "energy"),
        ];
        // The blocks of state-based laws are too large in space, and slow with a large horizon.
        let count = if dimension == "3d" { 2 } else { 4 };
        for (law, rule) in &laws[..count] {
            let isotropic = format!("fracture_energy = {ALONG}");
            let isotropic = cost(&deck(dimension, horizon, law, rule, &isotropic));
            for ratio in [0.7, 1.9] {
                for axis in axes {
                    let keys = directed(ratio, axis);
                    let found = cost(&deck(dimension, horizon, law, rule, &keys)) / isotropic;
                    assert!(
                        (found - 1.0).abs() < bound,
                        "{dimension} {rule} {ratio} {axis}: {found}, {law}"
                    );
                }
            }
        }
    }
}

/// The threshold of each bond has the ratio that its direction says.
#[test]
fn bonds_along_the_direction_break_last() {
    let law = "pmb = { density = 2, youngs_modulus = 1e6 }";
    let text = deck(
        "plane-stress",
        2,
        law,
        "critical_stretch",
        &directed(1.9, "[3, 0]"),
    );
    // The largest ratio with k = 1: w_c = (0.1 + 2.7 (n·a)²) w.
    let isotropic = deck(
        "plane-stress",
        2,
        law,
        "critical_stretch",
        "fracture_energy = 2",
    );
    let first = |text: &str, angle: f64| {
        simulate::<2, _>(text, |mut simulation| {
            let (sine, cosine) = angle.sin_cos();
            let mut strain = 1e-4;
            loop {
                displace(&mut simulation, |[x, y, z]| {
                    let along = strain * (x * cosine + y * sine);
                    [x + along * cosine, y + along * sine, z]
                });
                let mut found = false;
                let model = &simulation.model;
                simulation.forces.for_each_broken(|a, b| {
                    let [i, j] = [a, b].map(|point| model.position(point));
                    let [x, y] = [j[0] - i[0], j[1] - i[1]];
                    found |= (x * sine - y * cosine).abs() < 1e-9;
                });
                if found {
                    return strain;
                }
                strain *= 1.002;
            }
        })
    };
    let share = |angle: f64| first(&text, angle) / first(&isotropic, angle);
    let quarter = std::f64::consts::FRAC_PI_4;
    assert!((share(0.0) - 2.8_f64.sqrt()).abs() < 0.01, "{}", share(0.0));
    assert!(
        (share(quarter) - 1.45_f64.sqrt()).abs() < 0.01,
        "{}",
        share(quarter)
    );
}

/// Angle (degrees) of the crack that grows from a notch along x under tension along y.
fn angle_of_crack(law: &str, damage: &str) -> f64 {
    let text = format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 1, horizon = 3.01, volume_correction = 'exact' }}
        material.m.{law}
        damage.d.{damage}
        body.plate = {{ material = 'm', damage = 'd', shape.box = {{ lower = [0, 0], upper = [50, 60] }} }}
        crack.notch.segment = {{ from = [-1, 30], to = [18, 30] }}
        set.top.where = 'y > 57'
        set.bottom.where = 'y < 3'
        condition.down = {{ set = 'bottom', velocity = [0, '-2e-3'] }}
        condition.up = {{ set = 'top', velocity = [0, '2e-3'] }}
        time = {{ end = 400, safety = 0.5 }}
        "
    );
    simulate::<2, _>(&text, |mut simulation: Simulation<2>| {
        // The mean place of the bonds that break 8 to 14 from the notch.
        let (mut place, mut count) = (0.0, 0.0);
        while !simulation.is_over() && count < 40.0 {
            simulation.advance();
            (place, count) = (0.0, 0.0);
            let model = &simulation.model;
            simulation.forces.for_each_broken(|a, b| {
                let [i, j] = [a, b].map(|point| model.position(point));
                let [x, y] = [0, 1].map(|d| 0.5 * (i[d] + j[d]) - [18.0, 30.0][d]);
                if (8.0..14.0).contains(&x) {
                    place += y / x;
                    count += 1.0;
                }
            });
        }
        assert!(count >= 40.0, "the crack did not grow");
        (place / count).atan().to_degrees()
    })
}

#[test]
fn a_crack_follows_the_weak_direction() {
    let pmb = "pmb = { density = 2, youngs_modulus = 5 }";
    let ordinary = "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }";
    for (law, rule) in [(pmb, "critical_stretch"), (ordinary, "energy")] {
        let isotropic = format!("{rule} = {{ fracture_energy = 0.01 }}");
        assert!(angle_of_crack(law, &isotropic).abs() < 3.0);
        for sign in [1.0, -1.0] {
            let slope = sign * 30_f64.to_radians().tan();
            let keys = "fracture_energy_along = 0.01, fracture_energy_across = 0.033";
            let oblique = format!("{rule} = {{ {keys}, direction = [1, {slope}] }}");
            let angle = sign * angle_of_crack(law, &oblique);
            assert!((15.0..40.0).contains(&angle), "{law}: {angle}");
        }
    }
}
