//! Toughness by direction of the bond: opening costs the fracture energy of its direction, and cracks follow
//! the weak direction.

use crate::support::equilibria::same_on_ranks;
use crate::support::{displace, problem, simulate};
use fissure::solver::Simulation;
use fissure::solver::calibration::separation_energy_ratio;

/// Fracture energy of cracks along the direction, J/m².
const ALONG: f64 = 2.0;

/// Return the deck of a block of unit spacing, with a damage rule and the keys of this rule.
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

/// Return the computed energy of an opening along y, divided by the fracture energy of this direction.
fn cost(text: &str) -> f64 {
    separation_energy_ratio(&problem(text), 0, 0.0).expect("the block separates")
}

/// The cost of an opening, divided by the fracture energy of its direction, equals the cost in an isotropic
/// body. The bounds allow for the few directions of the bonds of a lattice.
#[test]
fn opening_costs_the_fracture_energy_of_its_direction() {
    let pmb = "pmb = { density = 2, youngs_modulus = 1e6 }";
    let ordinary = "ordinary = { density = 2, youngs_modulus = 1e6, poisson_ratio = 0.25 }";
    let correspondence =
        "correspondence = { density = 2, youngs_modulus = 1e6, poisson_ratio = 0.3 }";
    for (dimension, horizon, count, axes, bound) in [
        ("plane-stress", 3, 4, &["[0, 1]", "[1, 0]"][..], 0.08),
        ("plane-strain", 4, 3, &["[0, 2]", "[3, 0]"][..], 0.05),
        (
            "3d",
            3,
            1,
            &["[0, 1, 0]", "[1, 0, 0]", "[0, 0, 1]"][..],
            0.08,
        ),
    ] {
        // With correspondence, the energy also depends on the order in which bonds break.
        let laws = [
            (pmb, "critical_stretch", bound),
            (pmb, "energy", bound),
            (ordinary, "energy", bound),
            (correspondence, "energy", 0.1),
        ];
        for (law, rule, bound) in &laws[..count] {
            let isotropic = format!("fracture_energy = {ALONG}");
            let isotropic = cost(&deck(dimension, horizon, law, rule, &isotropic));
            for ratio in [0.7, 1.9] {
                for axis in axes {
                    let keys = directed(ratio, axis);
                    let found = cost(&deck(dimension, horizon, law, rule, &keys)) / isotropic;
                    assert!(
                        (found - 1.0).abs() < *bound,
                        "{dimension} {rule} {ratio} {axis}: {found}, {law}"
                    );
                }
            }
        }
    }
}

/// The breaking strain of a bond, divided by the breaking strain in an isotropic body, is the square root of
/// w_c/w in the direction of the bond.
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
    // At the ratio 1.9, k of docs/src/theory/damage.md is 1, and p has its smallest allowed value, 0.1:
    // w_c = (0.1 + 2.7 (n·a)²) w, with the direction n of the bond, the direction a of the fibres, and the
    // critical work w of the isotropic body.
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
                assert!(strain < 1.0, "no bond along {angle} breaks");
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

/// Two bodies with fibres in different directions are torn apart.
#[test]
fn ranks_change_no_bit() {
    for (law, rule) in [
        (
            "pmb = { density = 2, youngs_modulus = 5 }",
            "critical_stretch",
        ),
        (
            "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }",
            "energy",
        ),
    ] {
        for family in ["lattice", "list"] {
            let keys = "fracture_energy_along = 0.01, fracture_energy_across = 0.019";
            same_on_ranks(&format!(
                "dimension = 'plane-stress'
                grid = {{ spacing = 1, horizon = 3, family = '{family}' }}
                interface.rule = 'own'
                material.m.{law}
                damage.low.{rule} = {{ {keys}, direction = [2, 1] }}
                damage.high.{rule} = {{ {keys}, direction = [-1, 3], alpha = 0.1 }}
                body.low = {{ material = 'm', damage = 'low', shape.box = {{ lower = [0, 0], upper = [16, 8] }} }}
                body.high = {{ material = 'm', damage = 'high', shape.box = {{ lower = [0, 8], upper = [16, 15] }} }}
                initial.tear.velocity = ['0.01*x', '0.02*(y - 8) + 0.02*sin(x)']
                time = {{ end = 12 }}
                "
            ));
        }
    }
}

/// Return the angle to x (degrees) of a crack that grows from a notch along x under tension along y. The
/// angle is a mean over the points, 6 to 14 spacings ahead of the notch, that have lost 40 % of their bonds.
fn angle_of_crack(law: &str, damage: &str) -> f64 {
    let text = format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 1, horizon = 3.01, volume_correction = 'exact' }}
        material.m.{law}
        damage.d.{damage}
        body.plate = {{ material = 'm', damage = 'd', shape.box = {{ lower = [0, 0], upper = [36, 40] }} }}
        crack.notch.segment = {{ from = [-1, 20], to = [12, 20] }}
        set.top.where = 'y > 37'
        set.bottom.where = 'y < 3'
        condition.down = {{ set = 'bottom', velocity = [0, '-2e-3'] }}
        condition.up = {{ set = 'top', velocity = [0, '2e-3'] }}
        time = {{ end = 240, safety = 0.5 }}
        "
    );
    simulate::<2, _>(&text, |mut simulation: Simulation<2>| {
        while !simulation.is_over() {
            simulation.advance();
        }
        let mut bonds = vec![[0.0; 2]; simulation.model.owned()];
        let forces = &simulation.forces;
        forces.for_each_broken(|a, _| bonds[a][0] += 1.0);
        forces.for_each_intact(|a, _| bonds[a][1] += 1.0);
        let (mut slope, mut count) = (0.0, 0.0);
        for (point, [broken, intact]) in bonds.into_iter().enumerate() {
            let [x, y, _] = simulation.model.position(point);
            let ahead = x - 12.0;
            if broken >= 0.4 * (broken + intact) && (6.0..14.0).contains(&ahead) {
                slope += (y - 20.0) / ahead;
                count += 1.0;
            }
        }
        assert!(count >= 8.0, "no crack: {damage}");
        (slope / count).atan().to_degrees()
    })
}

/// Fibres at 30° turn the crack by about 30° or some degrees more, because the thresholds of bonds depend
/// more on the direction than the fracture energy of cracks.
#[test]
fn a_crack_follows_the_weak_direction() {
    let pmb = "pmb = { density = 2, youngs_modulus = 5 }";
    let ordinary = "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }";
    for (law, rule) in [(pmb, "critical_stretch"), (ordinary, "energy")] {
        let isotropic = format!("{rule} = {{ fracture_energy = 0.01 }}");
        let straight = angle_of_crack(law, &isotropic);
        assert!(straight.abs() < 10.0, "{law}: {straight}");
        for sign in [1.0, -1.0] {
            let slope = sign * 30_f64.to_radians().tan();
            let keys = "fracture_energy_along = 0.01, fracture_energy_across = 0.019";
            let oblique = format!("{rule} = {{ {keys}, direction = [1, {slope}] }}");
            let angle = sign * angle_of_crack(law, &oblique);
            assert!((25.0..50.0).contains(&angle), "{law}: {angle}");
        }
    }
}
