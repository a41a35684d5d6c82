//! The softening law: one bond compared with its closed-form curve; energy compared with work; damage,
//! strength and fracture energy of a plate.

use std::f64::consts::PI;

use crate::support::history::{column, row};
use crate::support::{displace, force, forces, simulate};
use fissure::dimension::{Constraint, Dimension};
use fissure::elastic::Isotropic;
use fissure::lanes::Lanes;
use fissure::material::{AnyLaw, Given, Law, SofteningPmb};
use fissure::problem;
use fissure::solver::Simulation;
use fissure::solver::observers::{HistoryObserver, Snapshot};

/// Young's modulus of the bodies with one bond and of the block, Pa.
const MODULUS: f64 = 5.0;

/// Stretches at which softening begins and at which bonds break, s0 and sc.
const STRENGTH: f64 = 0.02;
const CRITICAL: f64 = 0.1;

fn law(more: &str) -> String {
    format!(
        "softening_pmb = {{ density = 2, youngs_modulus = {MODULUS}, strength_stretch = {STRENGTH}, \
         critical_stretch = {CRITICAL}{more} }}"
    )
}

/// Cross-section of the bar of two points, m². With a spacing of 1 m, this is also the volume of a point in
/// m³.
const SECTION: f64 = 0.5;

/// Horizon of the bar of two points, m.
const HORIZON: f64 = 1.5;

/// c of the bar under uniaxial strain, 12E/(5δ²A), N/m⁶.
const MICROMODULUS: f64 = 12.0 * MODULUS / (5.0 * HORIZON * HORIZON * SECTION);

/// Return the deck of two points 1 m apart with one bond.
fn pair(law: &str) -> String {
    format!(
        "dimension = '1d'
        constraint = 'uniaxial-strain'
        cross_section = {SECTION}
        grid = {{ volume_correction = 'none', spacing = 1, horizon = {HORIZON} }}
        material.concrete.{law}
        body.bar = {{ material = 'concrete', shape.box = {{ lower = [0], upper = [2] }} }}
        time.end = 1
        "
    )
}

/// Stretch the bond, and return the force on the first point, N/m³.
fn pull(simulation: &mut Simulation<1>, stretch: f64) -> f64 {
    displace(simulation, |x| x.map(|x| x * (1.0 + stretch)));
    let [[here], [there]] = [force(simulation, 0), force(simulation, 1)];
    assert_eq!(here, -there);
    here
}

/// Return the energy stored in all bonds and the energy dissipated by them, J.
fn energies<const D: usize>(simulation: &mut Simulation<D>) -> [f64; 2] {
    let stored = simulation.forces.stored(&simulation.model);
    let volume = &simulation.model.volume;
    [stored.energy, stored.dissipated]
        .map(|density| density.iter().zip(volume.iter()).map(|(w, v)| w * v).sum())
}

/// Load a bond, unload it to the origin, compress it, load it again and break it. `path` has the stretches,
/// and the expected forces divided by c V, with the volume V of a point.
fn follow(more: &str, path: &[[f64; 2]]) {
    simulate::<1, _>(&pair(&law(more)), |mut simulation| {
        let (mut before, mut force_before, mut work) = (0.0, 0.0, 0.0);
        let square = MICROMODULUS * SECTION * SECTION;
        for [stretch, expected] in path {
            let parts = 400;
            let mut found = 0.0;
            for part in 1..=parts {
                let now = before + f64::from(part) / f64::from(parts) * (stretch - before);
                found = pull(&mut simulation, now);
                work += 0.5 * (found + force_before) * (stretch - before) / f64::from(parts);
                force_before = found;
            }
            before = *stretch;
            let expected = MICROMODULUS * SECTION * expected;
            let largest = MICROMODULUS * SECTION * STRENGTH;
            assert!(
                (found - expected).abs() < 1e-12 * largest,
                "{more} {stretch}: {found}, {expected}"
            );
            // Unloading is along the secant, so the stored energy is half the force times the stretch.
            let [held, dissipated] = energies(&mut simulation);
            let unit = square * STRENGTH * STRENGTH;
            assert!((held - 0.5 * SECTION * found * stretch).abs() < 1e-12 * unit);
            assert!(
                (held + dissipated - SECTION * work).abs() < 1e-4 * unit,
                "{more} {stretch}: {held} + {dissipated}, {work}"
            );
        }
        // A bond breaks without stored energy.
        let freed: f64 = simulation.fields.freed_energy.iter().flatten().sum();
        assert_eq!(simulation.fields.broken_bonds.as_ref().unwrap(), &[1.0; 2]);
        assert!(freed.abs() < 1e-12 * square * STRENGTH * STRENGTH);
        let broken = energies(&mut simulation);
        pull(&mut simulation, -0.5);
        assert_eq!(energies(&mut simulation), broken);
    });
}

#[test]
fn a_bond_follows_its_curve_and_unloads_to_the_origin() {
    follow(
        "",
        &[
            [0.01, 0.01],
            [0.02, 0.02],
            [0.06, 0.01],
            [0.03, 0.005],
            [-0.03, -0.03],
            [0.06, 0.01],
            [0.08, 0.005],
            [0.0, 0.0],
            [0.1, 0.0],
        ],
    );
    // The kink is at the stretch 0.02 + 0.25 · 0.08 = 0.04, with the force 0.4 · 0.02.
    follow(
        ", curve = 'trilinear', kink_force = 0.4, kink_stretch = 0.25",
        &[
            [0.02, 0.02],
            [0.03, 0.014],
            [0.015, 0.007],
            [0.04, 0.008],
            [-0.01, -0.01],
            [0.07, 0.004],
            [0.1, 0.0],
        ],
    );
    let exponential = |stretch: f64| {
        let share = libm::pow(0.01, (stretch - STRENGTH) / (CRITICAL - STRENGTH));
        [stretch, STRENGTH * (share - 0.01) / 0.99]
    };
    let unloaded = [0.02, 0.5 * exponential(0.04)[1]];
    follow(
        ", curve = 'exponential'",
        &[
            [0.02, 0.02],
            exponential(0.04),
            unloaded,
            exponential(0.08),
            [-0.01, -0.01],
            [0.1, 0.0],
        ],
    );
}

#[test]
fn damage_counts_the_stiffness_that_is_lost() {
    simulate::<1, _>(&pair(&law("")), |mut simulation| {
        for (stretch, lost) in [
            (0.02, 0.0),
            (0.06, 5.0 / 6.0),
            (0.01, 5.0 / 6.0),
            (0.2, 1.0),
        ] {
            pull(&mut simulation, stretch);
            for snapshot in [
                Snapshot::new(&mut simulation),
                Snapshot::without_energies(&mut simulation),
            ] {
                let found = snapshot.damage(&simulation.undeformed.family_volume, 0);
                assert!((found - lost).abs() < 1e-14, "{stretch}: {found}");
                assert_eq!(snapshot.intact(), if lost < 1.0 { 2 } else { 0 });
            }
        }
    });
}

/// Return the deck of a plane block with a law.
fn block(law: &str) -> String {
    format!(
        "dimension = 'plane-strain'
        grid = {{ spacing = 1, horizon = 3, volume_correction = 'exact' }}
        material.concrete.{law}
        body.block = {{ material = 'concrete', shape.box = {{ lower = [0, 0], upper = [18, 16] }} }}
        time.end = 1
        "
    )
}

#[test]
fn below_the_strength_it_is_the_prototype_law() {
    let pmb = format!("pmb = {{ density = 2, youngs_modulus = {MODULUS} }}");
    for (size, same) in [(0.01, true), (0.05, false)] {
        let [elastic, softening] = [pmb.as_str(), &law("")].map(|law| {
            simulate::<2, _>(&block(law), |mut simulation| {
                displace(&mut simulation, |[x, y, z]| {
                    [x + size * (0.7 * x).sin(), y + size * (0.5 * x).cos(), z]
                });
                forces(&simulation)
            })
        });
        let largest = elastic
            .iter()
            .flatten()
            .fold(0.0_f64, |a, f| a.max(f.abs()));
        let pairs = elastic.iter().flatten().zip(softening.iter().flatten());
        let difference = pairs.fold(0.0_f64, |all, (a, b)| all.max((a - b).abs()));
        assert_eq!(difference < 1e-13 * largest, same, "{difference}");
    }
}

/// Young's modulus (Pa), tensile strength (Pa) and fracture energy (J/m²) of the notched concrete plate.
const CONCRETE: [f64; 3] = [30e9, 3e6, 100.0];

/// Area of the ligament of the notched plate, m².
const LIGAMENT: f64 = 0.02;

/// Return the deck of a plate with a notch on each side, between elastic grips that move apart.
fn plate(curve: &str, method: &str) -> String {
    let [modulus, strength, energy] = CONCRETE;
    let elastic = format!("density = 2400, youngs_modulus = {modulus}");
    format!(
        "dimension = 'plane-stress'
        thickness = 0.1
        grid = {{ spacing = 0.02, horizon = 0.06, volume_correction = 'exact' }}
        material.grip.pmb = {{ {elastic} }}
        material.concrete.softening_pmb = {{ {elastic}, tensile_strength = {strength}, fracture_energy = {energy}, curve = '{curve}' }}
        body.one = {{ material = 'grip', shape.box = {{ lower = [0, 0], upper = [0.12, 0.4] }} }}
        body.middle = {{ material = 'concrete', shape.box = {{ lower = [0.12, 0], upper = [0.28, 0.4] }} }}
        body.two = {{ material = 'grip', shape.box = {{ lower = [0.28, 0], upper = [0.4, 0.4] }} }}
        crack.lower.segment = {{ from = [0.2, -1], to = [0.2, 0.1] }}
        crack.upper.segment = {{ from = [0.2, 0.3], to = [0.2, 2] }}
        set.left.where = 'x < 0.1'
        set.right.where = 'x > 0.3'
        condition.left = {{ set = 'left', displacement = [0, 'free'] }}
        condition.right = {{ set = 'right', displacement = ['6e-4*t^2', 'free'] }}
        history = {{ every_steps = 1, reactions = ['right'] }}
        time = {{ end = 1, method = '{method}', {method} = {{ load_steps = 50, tolerance = 1e-4 }} }}
        "
    )
}

/// Separate the notched plate. Return the largest mean stress of the ligament divided by the strength, and
/// the dissipated energy divided by the fracture energy of the ligament.
fn pull_in_two(curve: &str, method: &str) -> [f64; 2] {
    let [_, strength, energy] = CONCRETE;
    simulate::<2, _>(&plate(curve, method), |mut simulation| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let force = column(&observer, "reaction_right_x");
        let mut largest = 0.0_f64;
        let mut last = row(&mut observer, &mut simulation).energies;
        while !simulation.is_over() {
            simulation.advance();
            simulation.check().unwrap_or_else(|error| panic!("{error}"));
            if !simulation.progress.load_step.is_settled {
                continue;
            }
            let row = row(&mut observer, &mut simulation);
            largest = largest.max(row.values[force].abs());
            assert!(row.energies.dissipated >= last.dissipated);
            last = row.energies;
        }
        // The work of each load step follows from the trapezoid rule, which is inaccurate for a jump.
        assert!(last.error.abs() < 0.05 * last.work, "{last:?}");
        let taken = last.dissipated + last.fracture;
        [largest / (strength * LIGAMENT), taken / (energy * LIGAMENT)]
    })
}

#[test]
fn a_plate_that_is_pulled_in_two_bears_its_strength_and_takes_its_fracture_energy() {
    // Computed: 1.015 to 1.024 of the strength, and 1.04 to 1.10 of the energy, because some bonds beside the
    // ligament also soften.
    for curve in CURVES {
        let found = ["static", "relaxation"].map(|method| pull_in_two(curve, method));
        for [stress, energy] in found {
            assert!((stress - 1.0).abs() < 0.04, "{curve}: {found:?}");
            assert!(energy > 1.0 && energy < 1.12, "{curve}: {found:?}");
        }
        let [newton, relaxed] = found;
        assert!((newton[0] - relaxed[0]).abs() < 2e-3, "{curve}: {found:?}");
        assert!((newton[1] - relaxed[1]).abs() < 0.01, "{curve}: {found:?}");
    }
}

const CURVES: [&str; 3] = ["bilinear", "trilinear", "exponential"];

/// Return the law of concrete with a horizon of 0.03 m and two given keys.
fn concrete(dimension: Dimension, curve: &str, keys: [(&str, f64); 2]) -> SofteningPmb {
    let mut law = problem::Law::named("softening_pmb").unwrap();
    law = law.with("curve", curve).unwrap();
    for (key, value) in keys {
        law = law.with(key, value).unwrap();
    }
    let given = Given {
        dimension,
        elastic: Isotropic {
            youngs_modulus: CONCRETE[0],
            poisson_ratio: dimension.bond_based_poisson_ratio(),
        },
        horizon: 0.03,
        values: &law.values,
        from_fracture_energy: false,
    };
    match (law.declaration.build)(&given).law {
        AnyLaw::SofteningPmb(law) => law,
        other => panic!("{other:?}"),
    }
}

/// Return every setting, with the modulus in tension along an axis divided by Young's modulus.
fn settings() -> [(Dimension, f64); 5] {
    let line = |constraint| Dimension::Line {
        cross_section: 0.3,
        constraint,
    };
    [
        (Dimension::Space, 1.0),
        (Dimension::PlaneStress { thickness: 0.01 }, 1.0),
        (Dimension::PlaneStrain { thickness: 0.2 }, 16.0 / 15.0),
        (line(Constraint::UniaxialStress), 1.0),
        (line(Constraint::UniaxialStrain), 1.2),
    ]
}

#[test]
fn all_bonds_across_an_area_take_the_fracture_energy_and_the_largest_stress_is_the_strength() {
    let [modulus, strength, energy] = CONCRETE;
    for (dimension, stiffer) in settings() {
        for curve in CURVES {
            let keys = [("tensile_strength", strength), ("fracture_energy", energy)];
            let law = concrete(dimension, curve, keys);
            // Energy that both ends of a bond of length r dissipate, summed over the bonds that cross a unit
            // area.
            let (horizon, cells) = (0.03, 600_u32);
            let step = horizon / f64::from(cells);
            let middle = |k: u32| (f64::from(k) + 0.5) * step;
            let mut taken = 0.0;
            for j in 0..cells {
                let r = middle(j);
                let broken = [Lanes::splat(law.critical_stretch)];
                let of_end = Law::<3>::dissipated(&law, Lanes::splat(r), &broken).0[0];
                for z in (0..j).map(middle) {
                    let crossing = match dimension {
                        Dimension::Space => 2.0 * PI * (1.0 - z / r) * r * r,
                        Dimension::PlaneStress { thickness }
                        | Dimension::PlaneStrain { thickness } => {
                            2.0 * libm::acos(z / r) * r * thickness
                        }
                        Dimension::Line { cross_section, .. } => cross_section,
                    };
                    taken += 2.0 * of_end * crossing * step * step;
                }
            }
            let share = taken / energy;
            assert!(
                (share - 1.0).abs() < 4e-3,
                "{dimension:?} {curve}: energy {share}"
            );
            let largest = law.largest_tension(dimension) * law.strength_stretch;
            let share = stiffer * modulus * largest / strength;
            assert!(
                (share - 1.0).abs() < 1e-5,
                "{dimension:?} {curve}: strength {share}"
            );
        }
    }
}

#[test]
fn how_much_more_than_its_first_bonds_a_body_bears() {
    // The expected values were computed by an independent program with 200 directions.
    let plane = Dimension::PlaneStress { thickness: 1.0 };
    for (dimension, curve, ratio, expected) in [
        (plane, "bilinear", 3.0, 1.070),
        (plane, "bilinear", 10.0, 1.183),
        (plane, "trilinear", 10.0, 1.096),
        (plane, "exponential", 10.0, 1.071),
        (Dimension::Space, "bilinear", 3.0, 1.225),
        (Dimension::Space, "exponential", 10.0, 1.236),
    ] {
        let keys = [
            ("strength_stretch", 1e-3),
            ("critical_stretch", 1e-3 * ratio),
        ];
        let found = concrete(dimension, curve, keys).largest_tension(dimension);
        assert!(
            (found - expected).abs() < 2e-3,
            "{dimension:?} {curve} {ratio}: {found}"
        );
    }
}
