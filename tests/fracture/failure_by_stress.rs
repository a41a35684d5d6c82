//! Failure by stress: bonds break when the mean von Mises or largest principal stress of their points reaches
//! the strength, and not before.

use std::collections::BTreeSet;

use crate::support::history::{column, row};
use crate::support::{displace, simulate};
use fissure::component::Component;
use fissure::problem::Field;
use fissure::scatter::Weibull;
use fissure::solver::Simulation;
use fissure::solver::observers::{HistoryObserver, Snapshot};

const YOUNG: f64 = 5.0;
const RATIO: f64 = 0.3;

/// Stress at which the bodies of these tests break, Pa.
const STRENGTH: f64 = 1e-3 * YOUNG;

/// Return the deck of a block of one law, with the damage law `weak`.
fn deck(dimension: &str, law: &str, keys: &str, damage: &str) -> String {
    let upper = if dimension == "3d" {
        "[6, 5, 5]"
    } else {
        "[9, 8]"
    };
    let lower = if dimension == "3d" {
        "[0, 0, 0]"
    } else {
        "[0, 0]"
    };
    format!(
        "dimension = '{dimension}'
        grid = {{ spacing = 1, horizon = 2.5, volume_correction = 'exact' }}
        material.m.{law} = {{ density = 2, youngs_modulus = {YOUNG}, poisson_ratio = {RATIO}{keys} }}
        body.block = {{ material = 'm', damage = 'weak', shape.box = {{ lower = {lower}, upper = {upper} }} }}
        damage.weak.stress = {{ {damage} }}
        time = {{ end = 1 }}
        "
    )
}

/// Return the keys of a damage law that breaks bonds in tension and in compression.
fn by(measure: &str, strength: f64) -> String {
    format!("measure = '{measure}', strength = {strength}, tension_only = false")
}

/// Return the number of broken bonds and of all bonds after a homogeneous deformation with this displacement
/// gradient.
fn broken<const D: usize>(text: &str, gradient: [[f64; 3]; 3]) -> (usize, usize) {
    simulate::<D, _>(text, |mut simulation| {
        displace(&mut simulation, |x| {
            std::array::from_fn(|a| x[a] + (0..3).map(|b| gradient[a][b] * x[b]).sum::<f64>())
        });
        let (mut broken, mut intact) = (0, 0);
        simulation.forces.for_each_broken(|_, _| broken += 1);
        simulation.forces.for_each_intact(|_, _| intact += 1);
        (broken, broken + intact)
    })
}

/// Assert that no bond breaks at 0.99 of the strength, and that all bonds break at 1.01. `at` returns the
/// displacement gradient for a stress, Pa.
fn breaks_at_strength(dimension: &str, measure: &str, at: impl Fn(f64) -> [[f64; 3]; 3]) {
    let laws = [
        ("correspondence", ""),
        ("correspondence", ", stress = 'neo-hooke'"),
        (
            "correspondence",
            ", stress = 'willberg2022', zero_energy = 'none'",
        ),
        (
            "correspondence",
            ", zero_energy = 'wan2019', yield_stress = 0.02",
        ),
    ];
    for (law, keys) in laws {
        let text = deck(dimension, law, keys, &by(measure, STRENGTH));
        let count = |share: f64| {
            let gradient = at(share * STRENGTH);
            match dimension {
                "3d" => broken::<3>(&text, gradient),
                _ => broken::<2>(&text, gradient),
            }
        };
        let (below, all) = count(0.99);
        assert_eq!(below, 0, "{dimension} {measure} {keys}");
        assert_eq!(count(1.01), (all, all), "{dimension} {measure} {keys}");
    }
}

fn diagonal(entries: [f64; 3]) -> [[f64; 3]; 3] {
    std::array::from_fn(|a| std::array::from_fn(|b| if a == b { entries[a] } else { 0.0 }))
}

#[test]
fn uniaxial_tension_breaks_at_the_strength_by_both_measures() {
    for measure in ["von_mises", "principal"] {
        breaks_at_strength("plane-stress", measure, |stress| {
            let strain = stress / YOUNG;
            diagonal([strain, -RATIO * strain, 0.0])
        });
        breaks_at_strength("3d", measure, |stress| {
            let strain = stress / YOUNG;
            diagonal([-RATIO * strain, strain, -RATIO * strain])
        });
    }
}

#[test]
fn shear_breaks_by_principal_stress_at_the_strength_and_by_von_mises_at_its_root_of_a_third() {
    for dimension in ["plane-stress", "plane-strain", "3d"] {
        for (measure, share) in [("principal", 1.0), ("von_mises", 3_f64.sqrt().recip())] {
            breaks_at_strength(dimension, measure, |stress| {
                let strain = share * stress * (1.0 + RATIO) / YOUNG;
                let mut gradient = diagonal([0.0; 3]);
                gradient[0][1] = strain;
                gradient[1][0] = strain;
                gradient
            });
        }
    }
}

#[test]
fn von_mises_stress_counts_the_stress_across_in_plane_strain() {
    // σ_xx − σ_yy = 2G ε and σ_yy = σ_zz = λ ε: the von Mises stress is 2G ε.
    breaks_at_strength("plane-strain", "von_mises", |stress| {
        diagonal([stress * (1.0 + RATIO) / YOUNG, 0.0, 0.0])
    });
    // σ_xx = σ_yy = 2 (λ + G) ε and σ_zz = 2 λ ε: the von Mises stress is 2G ε again.
    breaks_at_strength("plane-strain", "von_mises", |stress| {
        let strain = stress * (1.0 + RATIO) / YOUNG;
        diagonal([strain, strain, 0.0])
    });
}

#[test]
fn hydrostatic_compression_breaks_nothing() {
    for measure in ["von_mises", "principal"] {
        let text = deck("3d", "correspondence", "", &by(measure, STRENGTH));
        assert_eq!(broken::<3>(&text, diagonal([-0.02; 3])).0, 0);
    }
    for dimension in ["plane-stress", "plane-strain"] {
        let text = deck(dimension, "correspondence", "", &by("principal", STRENGTH));
        assert_eq!(broken::<2>(&text, diagonal([-0.02, -0.02, 0.0])).0, 0);
    }
}

#[test]
fn only_longer_bonds_break_with_tension_only() {
    let shear = [[0.0, 3e-3, 0.0], [3e-3, 0.0, 0.0], [0.0; 3]];
    let damage = format!("measure = 'von_mises', strength = {STRENGTH}");
    let text = deck("plane-stress", "correspondence", "", &damage);
    simulate::<2, _>(&text, |mut simulation| {
        displace(&mut simulation, |x| {
            std::array::from_fn(|a| x[a] + (0..3).map(|b| shear[a][b] * x[b]).sum::<f64>())
        });
        let model = &simulation.model;
        let product = |a: usize, b: usize| {
            let [i, j] = [a, b].map(|point| model.position(point));
            (j[0] - i[0]) * (j[1] - i[1])
        };
        // Bonds along the axes also become longer, by a term of second order in the shear.
        (simulation.forces).for_each_broken(|a, b| assert!(product(a, b) > -1e-9));
        (simulation.forces).for_each_intact(|a, b| assert!(product(a, b) < -1e-9));
    });
}

/// A smooth motion with strains of some per cent, tensile on average.
fn wave(x: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = x.map(|x| 1.02 * x);
    [
        x + 0.03 * (0.7 * x + 0.3 * y).sin() + 0.002 * z * z,
        y + 0.03 * (0.5 * y - 0.2 * x + 0.4 * z).cos(),
        z + 0.02 * (0.9 * z + 0.1 * x).sin(),
    ]
}

/// A bond breaks if the mean of an output field at its two points exceeds the strength. Checked in 2-D and
/// 3-D, with plastic flow and temperature.
#[test]
fn the_stress_is_that_of_the_output_fields() {
    fn check<const D: usize>(dimension: &str, keys: &str, measure: &str) {
        let heat = "\ncondition.heat = { set = 'all', temperature = '20' }\n";
        let text =
            |strength: f64| deck(dimension, "correspondence", keys, &by(measure, strength)) + heat;
        let bonds = |simulation: &Simulation<D>| {
            let mut all = Vec::new();
            simulation.forces.for_each_intact(|a, b| all.push((a, b)));
            all
        };
        let means = simulate::<D, _>(&text(1e9), |mut simulation| {
            displace(&mut simulation, wave);
            let snapshot = Snapshot::new(&mut simulation);
            let of_points: Vec<f64> = match measure {
                "von_mises" => snapshot.field(&mut simulation, Field::VonMisesStress),
                _ => {
                    let stress = snapshot.field(&mut simulation, Field::CauchyStress);
                    let largest = |stress: &[f64]| Component::Principal(0).of(stress);
                    stress.chunks_exact(6).map(largest).collect()
                }
            };
            let mean = |(a, b): &(usize, usize)| 0.5 * (of_points[*a] + of_points[*b]);
            let bonds = bonds(&simulation);
            bonds
                .iter()
                .map(|bond| (*bond, mean(bond)))
                .collect::<Vec<_>>()
        });
        let mut sorted: Vec<f64> = means.iter().map(|(_, mean)| *mean).collect();
        sorted.sort_by(f64::total_cmp);
        let strength = sorted[sorted.len() * 4 / 5] * (1.0 + 1e-9);
        let wanted = means.iter().filter(|(_, mean)| *mean < strength);
        let wanted: BTreeSet<_> = wanted.map(|(bond, _)| *bond).collect();
        let left = simulate::<D, _>(&text(strength), |mut simulation| {
            displace(&mut simulation, wave);
            bonds(&simulation).into_iter().collect::<BTreeSet<_>>()
        });
        let differing = left.symmetric_difference(&wanted).count();
        assert_eq!(
            differing,
            0,
            "{dimension} {keys} {measure}: of {}",
            means.len()
        );
    }
    // Without zero-energy control: control adds to the output stress a term of second order in the motion
    // that F does not represent.
    let elastic = ", zero_energy = 'none', thermal_expansion = 1e-4";
    for measure in ["von_mises", "principal"] {
        check::<2>("plane-stress", elastic, measure);
        check::<2>("plane-strain", elastic, measure);
        check::<3>("3d", elastic, measure);
        let neo_hooke = format!("{elastic}, stress = 'neo-hooke'");
        check::<2>("plane-stress", &neo_hooke, measure);
        check::<2>("plane-strain", &neo_hooke, measure);
        let yields = format!("{elastic}, yield_stress = 0.1, hardening_modulus = 0.5");
        check::<2>("plane-stress", &yields, measure);
        check::<3>("3d", &yields, measure);
        let large = format!("{yields}, strain_measure = 'logarithmic'");
        check::<3>("3d", &large, measure);
    }
}

#[test]
fn a_bond_takes_the_smaller_strength_of_scattered_points() {
    let damage = by("principal", STRENGTH) + ", weibull_modulus = 4, seed = 7";
    let text = deck("plane-stress", "correspondence", "", &damage);
    let strain = STRENGTH / YOUNG;
    simulate::<2, _>(&text, |mut simulation| {
        displace(&mut simulation, |[x, y, z]| {
            [x * (1.0 + strain), y * (1.0 - RATIO * strain), z]
        });
        let weibull = Weibull {
            modulus: 4.0,
            seed: 7,
        };
        let weaker = |a: usize, b: usize| {
            let strength = |point: usize| weibull.strength(simulation.model.ids[point]);
            strength(a).min(strength(b))
        };
        let mut counts = [0, 0];
        simulation.forces.for_each_broken(|a, b| {
            counts[0] += 1;
            assert!(weaker(a, b) < 1.01);
        });
        simulation.forces.for_each_intact(|a, b| {
            counts[1] += 1;
            assert!(weaker(a, b) > 0.99);
        });
        assert!(counts.iter().all(|count| *count > 20), "{counts:?}");
    });
}

/// Return the deck of two blocks side by side. The right block has half the stiffness and a shorter horizon.
fn two_blocks(more: &str) -> String {
    format!(
        "dimension = 'plane-strain'
        grid = {{ spacing = 1, horizon = 3.2, volume_correction = 'none' }}
        interface.rule = 'own'
        material.hard.correspondence = {{ density = 2, youngs_modulus = {YOUNG}, poisson_ratio = {RATIO} }}
        material.soft.correspondence = {{ density = 2, youngs_modulus = {}, poisson_ratio = {RATIO} }}
        damage.weak.stress = {{ measure = 'principal', strength = {STRENGTH} }}
        body.left = {{ material = 'hard', damage = 'weak', shape.box = {{ lower = [0, 0], upper = [6, 8] }} }}
        body.right = {{ material = 'soft', damage = 'weak', horizon = 2.2, shape.box = {{ lower = [6, 0], upper = [12, 8] }} }}
        time = {{ end = 1 }}
        {more}
        ",
        0.5 * YOUNG
    )
}

/// Return the numbers of broken and of intact bonds across the interface after a strain along x. In each
/// pair, the first number counts the bonds up to 2.2 m, the second number the longer bonds.
fn across(text: &str, strain: f64) -> [[u32; 2]; 2] {
    simulate::<2, _>(text, |mut simulation| {
        displace(&mut simulation, |[x, y, z]| [x * (1.0 + strain), y, z]);
        let model = &simulation.model;
        let mut counts = [[0; 2]; 2];
        let mut count = |state: usize, a: usize, b: usize| {
            let [i, j] = [a, b].map(|point| model.position(point));
            if (i[0] < 6.0) != (j[0] < 6.0) {
                let is_long = fissure::points::distance_squared(i, j) > 2.2 * 2.2;
                counts[state][usize::from(is_long)] += 1;
            }
        };
        simulation.forces.for_each_broken(|a, b| count(0, a, b));
        simulation.forces.for_each_intact(|a, b| count(1, a, b));
        counts
    })
}

#[test]
fn an_end_whose_horizon_does_not_contain_the_bond_does_not_count() {
    let stiffness = YOUNG * (1.0 - RATIO) / ((1.0 + RATIO) * (1.0 - 2.0 * RATIO));
    let text = two_blocks("");
    // On the left, the stress is 1.2 times the strength; on the right, 0.6 times. The mean is 0.9 times the
    // strength, so bonds up to 2.2 m hold. Longer bonds lie in the horizon of the left end only, so the left
    // stress breaks them.
    let [broken, intact] = across(&text, 1.2 * STRENGTH / stiffness);
    assert!(broken[0] == 0 && intact[0] > 0, "{broken:?} {intact:?}");
    assert!(broken[1] > 0 && intact[1] == 0, "{broken:?} {intact:?}");
    let [broken, intact] = across(&text, 1.35 * STRENGTH / stiffness);
    assert!(broken[0] > 0 && intact == [0, 0], "{broken:?} {intact:?}");
}

#[test]
fn a_pair_of_bodies_breaks_by_its_own_strength() {
    let pair = "interface.pair.glue = { bodies = ['left', 'right'], damage = 'glue' }
        damage.glue.stress = { measure = 'von_mises', strength = 1e-4 }";
    let strain = 1e-4;
    // The von Mises stress is 2G ε: 3.8e-4 Pa on the left, and half of this on the right. No bond inside a
    // block breaks.
    simulate::<2, _>(&two_blocks(pair), |mut simulation| {
        displace(&mut simulation, |[x, y, z]| [x * (1.0 + strain), y, z]);
        let is_left = |point: usize| simulation.model.position(point)[0] < 6.0;
        let mut broken = 0;
        simulation.forces.for_each_broken(|a, b| {
            broken += 1;
            assert_ne!(is_left(a), is_left(b));
        });
        simulation
            .forces
            .for_each_intact(|a, b| assert_eq!(is_left(a), is_left(b)));
        assert!(broken > 0);
    });
}

#[test]
fn a_spinning_square_does_not_break() {
    let spin = "\ninitial.spin.velocity = ['-4e-3*(y - 4)', '4e-3*(x - 4.5)']\n";
    for measure in ["von_mises", "principal"] {
        let text = deck("plane-stress", "correspondence", "", &by(measure, STRENGTH)) + spin;
        let text = text.replace("end = 1", "end = 2000");
        simulate::<2, _>(&text, |mut simulation| {
            while !simulation.is_over() {
                simulation.advance();
            }
            let mut broken = 0;
            simulation.forces.for_each_broken(|_, _| broken += 1);
            assert_eq!(broken, 0, "{measure}");
            // In 2000 s at 4e-3 rad/s, the square makes more than one turn.
            let [x, y] = [0, 1].map(|d| simulation.fields.displacement[d][0]);
            assert!(x.abs().max(y.abs()) > 1.0, "{x} {y}");
        });
    }
}

/// The largest load of a bar pulled in load steps is the strength times the cross-section. Afterwards, the
/// zone of broken bonds carries a small load.
#[test]
fn a_pulled_bar_carries_the_strength() {
    for (measure, method) in [
        ("von_mises", "static"),
        ("principal", "static"),
        ("principal", "relaxation"),
    ] {
        let text = format!(
            "dimension = 'plane-stress'
            thickness = 1
            grid = {{ spacing = 1, horizon = 3, volume_correction = 'exact' }}
            material.m.correspondence = {{ density = 2, youngs_modulus = {YOUNG}, poisson_ratio = {RATIO} }}
            damage.weak.stress = {{ measure = '{measure}', strength = {STRENGTH}, no_failure = ['grips'] }}
            body.bar = {{ material = 'm', damage = 'weak', shape.box = {{ lower = [0, 0], upper = [30, 8] }} }}
            set.grips.where = 'x < 6 || x > 24'
            set.left.where = 'x < 3'
            set.right.where = 'x > 27'
            condition.hold = {{ set = 'left', displacement = [0, 'free'] }}
            condition.pull = {{ set = 'right', displacement = ['{}*min(4*t, 0.725 + 0.375*t)', 'free'] }}
            time = {{ end = 1, method = '{method}', {method}.load_steps = 75 }}
            history.reactions = ['right']
            ",
            27.0 * STRENGTH / YOUNG,
        );
        let (most, last) = simulate::<2, _>(&text, |mut simulation| {
            let mut history = HistoryObserver::new(&simulation).unwrap();
            let place = column(&history, "reaction_right_x");
            let (mut most, mut last) = (0.0_f64, 0.0);
            while !simulation.is_over() {
                simulation.advance();
                simulation.check().unwrap_or_else(|error| panic!("{error}"));
                if !simulation.progress.load_step.is_settled {
                    continue;
                }
                last = row(&mut history, &mut simulation).values[place].abs();
                most = most.max(last);
            }
            (most, last)
        });
        let wanted = 8.0 * STRENGTH;
        assert!(
            (most / wanted - 1.0).abs() < 0.01,
            "{measure} {method}: {}",
            most / wanted
        );
        assert!(
            last < 0.35 * wanted,
            "{measure} {method}: {}",
            last / wanted
        );
    }
}

/// A notched plate tears: the crack runs from the notch, and the energy balance closes. The fracture energy
/// is never negative. It can decrease slightly, because a breaking bond changes the deformation gradients of
/// its two points.
#[test]
fn a_notched_plate_tears_and_its_energy_balances() {
    let text = format!(
        "dimension = 'plane-strain'
        grid = {{ spacing = 1, horizon = 3, volume_correction = 'exact' }}
        material.m.correspondence = {{ density = 2, youngs_modulus = {YOUNG}, poisson_ratio = {RATIO} }}
        damage.weak.stress = {{ measure = 'principal', strength = 0.1, no_failure = ['top', 'bottom'] }}
        body.plate = {{ material = 'm', damage = 'weak', shape.box = {{ lower = [0, 0], upper = [40, 30] }} }}
        crack.notch.segment = {{ from = [-1, 15], to = [12, 15] }}
        set.top.where = 'y > 25'
        set.bottom.where = 'y < 5'
        condition.down = {{ set = 'bottom', velocity = [0, '-1e-3'] }}
        condition.up = {{ set = 'top', velocity = [0, '1e-3'] }}
        time = {{ end = 500, safety = 0.3 }}
        "
    );
    simulate::<2, _>(&text, |mut simulation| {
        let mut history = HistoryObserver::new(&simulation).unwrap();
        let [fracture, error] =
            ["fracture_energy", "energy_error"].map(|name| column(&history, name));
        let (mut spent, mut fallen, mut steps) = (0.0, 0.0_f64, 0_u32);
        while !simulation.is_over() {
            simulation.advance();
            steps += 1;
            if steps % 20 == 0 {
                let values = row(&mut history, &mut simulation).values;
                assert!(values[fracture] >= 0.0);
                fallen = fallen.max(spent - values[fracture]);
                spent = values[fracture];
                assert!(
                    values[error].abs() <= 0.02 * spent + 1e-6,
                    "{} {spent}",
                    values[error]
                );
            }
        }
        assert!(spent > 0.0 && fallen < 1e-3 * spent, "{fallen} of {spent}");
        // The crack has crossed the plate, and its points lie within a horizon of the notch's plane.
        let values = row(&mut history, &mut simulation).values;
        let end = |name: &str| values[column(&history, name)];
        assert!(end("cracked_upper_x") > 38.0);
        assert!(end("cracked_upper_y") < 18.0 && end("cracked_lower_y") > 12.0);
    });
}
