//! The elastic–plastic law: one bond compared with its closed-form curve; work compared with energy and
//! dissipation.

use crate::support::history::row;
use crate::support::{displace, force, forces, largest_force, simulate};
use fissure::solver::Simulation;
use fissure::solver::motion::Kept;
use fissure::solver::observers::HistoryObserver;

/// Young's modulus (Pa) and yield stretch of all bodies in these tests.
const MODULUS: f64 = 5.0;
const YIELD: f64 = 0.02;

fn law() -> String {
    format!(
        "elastic_plastic_pmb = {{ density = 2, youngs_modulus = {MODULUS}, yield_stretch = {YIELD} }}"
    )
}

/// Cross-section of the bar of two points, m². With a spacing of 1 m, this is also the volume of a point in
/// m³.
const SECTION: f64 = 0.5;

/// Horizon of the bar of two points, m.
const HORIZON: f64 = 1.5;

/// c of the bar under uniaxial strain, 12E/(5δ²A), N/m⁶.
const MICROMODULUS: f64 = 12.0 * MODULUS / (5.0 * HORIZON * HORIZON * SECTION);

/// Return the deck of two points 1 m apart, whose bond breaks at this stretch.
fn pair(critical: f64) -> String {
    format!(
        "dimension = '1d'
        constraint = 'uniaxial-strain'
        cross_section = {SECTION}
        grid = {{ volume_correction = 'none', spacing = 1, horizon = {HORIZON} }}
        material.metal.{}
        damage.ductile.critical_stretch = {{ critical_stretch = {critical}, alpha = 0 }}
        body.bar = {{ material = 'metal', damage = 'ductile', shape.box = {{ lower = [0], upper = [2] }} }}
        time.end = 1
        ",
        law()
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

#[test]
fn a_bond_follows_the_elastic_plastic_curve() {
    // Stretch, s − s_p, and accumulated |Δs_p|: the bond is loaded, unloaded with the elastic slope,
    // compressed until it yields, and so on.
    let path = [
        [0.01, 0.01, 0.0],
        [0.02, 0.02, 0.0],
        [0.05, 0.02, 0.03],
        [0.04, 0.01, 0.03],
        [0.02, -0.01, 0.03],
        [0.01, -0.02, 0.03],
        [-0.03, -0.02, 0.07],
        [-0.02, -0.01, 0.07],
        [0.0, 0.01, 0.07],
        [0.01, 0.02, 0.07],
        [0.06, 0.02, 0.12],
        [0.03, -0.01, 0.12],
        [0.05, 0.01, 0.12],
    ];
    for parts in [1, 7] {
        simulate::<1, _>(&pair(1.0), |mut simulation| {
            let mut before = 0.0;
            for [stretch, elastic, way] in path {
                let mut found = 0.0;
                for part in 1..=parts {
                    let share = f64::from(part) / f64::from(parts);
                    found = pull(&mut simulation, before + share * (stretch - before));
                }
                before = stretch;
                let expected = MICROMODULUS * elastic * SECTION;
                let largest = MICROMODULUS * YIELD * SECTION;
                assert!(
                    (found - expected).abs() < 1e-13 * largest,
                    "{stretch}: {found}"
                );
                let square = MICROMODULUS * SECTION * SECTION;
                let [held, dissipated] = energies(&mut simulation);
                let unit = square * YIELD * YIELD;
                assert!((held - 0.5 * square * elastic * elastic).abs() < 1e-13 * unit);
                assert!((dissipated - square * YIELD * way).abs() < 1e-12 * unit);
            }
        });
    }
}

#[test]
fn a_bond_breaks_at_the_critical_stretch_and_frees_what_it_held() {
    let critical = 0.1;
    simulate::<1, _>(&pair(critical), |mut simulation| {
        let steps = 2000;
        for step in 1..steps {
            let pulled = pull(
                &mut simulation,
                critical * f64::from(step) / f64::from(steps),
            );
            assert!(pulled > 0.0);
        }
        assert_eq!(pull(&mut simulation, critical), 0.0);
        let freed: f64 = simulation.fields.freed_energy.iter().flatten().sum();
        let [held, dissipated] = energies(&mut simulation);
        assert_eq!(held, 0.0);
        let square = MICROMODULUS * SECTION * SECTION;
        let elastic = 0.5 * square * YIELD * YIELD;
        let work = square * YIELD * (critical - 0.5 * YIELD);
        assert!((freed / elastic - 1.0).abs() < 1e-2, "{freed} of {elastic}");
        assert!(((freed + dissipated) / work - 1.0).abs() < 1e-4);
        // A broken bond does not yield.
        pull(&mut simulation, -0.5);
        assert_eq!(energies(&mut simulation), [0.0, dissipated]);
    });
}

/// Return the deck of a block of about 300 points, in the plane or in 3-D.
fn block(dimension: &str, law: &str) -> String {
    let [lower, upper] = match dimension {
        "3d" => ["[0, 0, 0]", "[8, 7, 5]"],
        _ => ["[0, 0]", "[18, 16]"],
    };
    format!(
        "dimension = '{dimension}'
        grid = {{ spacing = 1, horizon = 3, volume_correction = 'exact' }}
        material.metal.{law}
        body.block = {{ material = 'metal', shape.box = {{ lower = {lower}, upper = {upper} }} }}
        time.end = 1
        "
    )
}

/// Return a smooth, non-uniform deformation with strains up to about `size`.
fn wave(size: f64) -> impl Fn([f64; 3]) -> [f64; 3] {
    move |[a, b, c]| {
        [
            a + size * (0.7 * a + 0.3 * b).sin(),
            b + size * (0.5 * b - 0.2 * a + 0.4 * c).cos(),
            c + size * (0.9 * c + 0.1 * a).sin(),
        ]
    }
}

#[test]
fn below_the_yield_stretch_it_is_the_prototype_law_to_the_bit() {
    // Below the yield stretch, forces and energy equal those of `pmb`, so the force is the derivative of the
    // energy. Above the yield stretch, the force is the derivative of the sum of energy and dissipation; the
    // next test checks this.
    let pmb = format!("pmb = {{ density = 2, youngs_modulus = {MODULUS} }}");
    for (size, same) in [(0.01, true), (0.1, false)] {
        let [elastic, yielding] = [pmb.as_str(), &law()].map(|law| {
            simulate::<2, _>(&block("plane-strain", law), |mut simulation| {
                displace(&mut simulation, wave(size));
                (forces(&simulation), energies(&mut simulation)[0])
            })
        });
        assert_eq!(elastic == yielding, same);
    }
}

#[test]
fn work_goes_into_energy_and_dissipation() {
    /// Deform the body by waves of these sizes, one after the other. Near the last state, check that forces
    /// are the negative derivative of the sum of energy and dissipation.
    fn near<const D: usize>(mut simulation: Simulation<D>, sizes: &[f64]) {
        for size in sizes {
            displace(&mut simulation, wave(*size));
        }
        let mut kept = Kept::default();
        simulation.keep(&mut kept);
        let total = |simulation: &mut Simulation<D>| energies(simulation).iter().sum::<f64>();
        assert!(energies(&mut simulation)[1] > 0.0);
        for point in [0, 7, 31, 120] {
            let volume = simulation.model.volume[point];
            for d in 0..D {
                let expected = force(&simulation, point)[d] * volume;
                let size = 1e-6;
                let mut after = |step: f64| {
                    simulation.fields.displacement[d][point] += step;
                    simulation.evaluate(fissure::solver::bonds::BondUpdate::Step(0.0));
                    let after = total(&mut simulation);
                    simulation.undo(&kept);
                    after
                };
                let slope = -(after(size) - after(-size)) / (2.0 * size);
                let scale = largest_force(&simulation) * volume;
                assert!(
                    (slope - expected).abs() < 1e-4 * scale,
                    "{slope} {expected}"
                );
            }
        }
    }
    // Beyond the yield stretch, and after unloading with the elastic slope.
    for sizes in [&[0.1][..], &[0.1, 0.08]] {
        simulate::<2, _>(&block("plane-stress", &law()), |body| near(body, sizes));
        simulate::<3, _>(&block("3d", &law()), |body| near(body, sizes));
    }
}

#[test]
fn a_body_that_has_yielded_turns_with_its_forces() {
    fn check<const D: usize>(mut simulation: Simulation<D>) {
        displace(&mut simulation, wave(0.1));
        let dissipated = energies(&mut simulation)[1];
        displace(&mut simulation, wave(0.0));
        let before = forces(&simulation);
        let largest = largest_force(&simulation);
        assert!(dissipated > 0.0 && largest > 0.0, "it springs back");
        for angle in [0.4_f64, 2.0] {
            let (sin, cos) = angle.sin_cos();
            displace(&mut simulation, |[a, b, c]| {
                [cos * a - sin * b, sin * a + cos * b, c + 3.0]
            });
            for (found, force) in forces(&simulation).iter().zip(&before) {
                let (mut turned, [a, b]) = (*force, [force[0], force[1]]);
                [turned[0], turned[1]] = [cos * a - sin * b, sin * a + cos * b];
                for d in 0..D {
                    assert!((found[d] - turned[d]).abs() < 1e-11 * largest);
                }
            }
        }
    }
    simulate(&block("plane-stress", &law()), check::<2>);
    simulate(&block("3d", &law()), check::<3>);
}

/// Return the deck of a plate that is cyclically stretched and compressed beyond its yield stretch.
fn cycles(step: f64) -> String {
    format!(
        "dimension = 'plane-stress'
        grid = {{ volume_correction = 'none', spacing = 1, horizon = 2.1 }}
        material.metal.{}
        body.plate = {{ material = 'metal', shape.box = {{ lower = [0, 0], upper = [10, 6] }} }}
        set.left.where = 'x < 2'
        set.right.where = 'x > 8'
        condition.hold = {{ set = 'left', displacement = [0, 0] }}
        condition.shake = {{ set = 'right', displacement = ['0.5*sin(0.1*t)', 'free'] }}
        time = {{ end = 150, step = {step} }}
        ",
        law()
    )
}

#[test]
fn energy_is_balanced_over_cycles_to_second_order() {
    let largest_error = |step: f64| {
        simulate::<2, _>(&cycles(step), |mut simulation| {
            let mut observer = HistoryObserver::new(&simulation).unwrap();
            let (mut largest, mut dissipated) = (0.0_f64, 0.0);
            // Errors are relative to the first row, in which the support already moves.
            let start = row(&mut observer, &mut simulation).energies.kinetic;
            while !simulation.clock.is_over() {
                simulation.advance();
                let energies = row(&mut observer, &mut simulation).energies;
                largest = largest.max(energies.error.abs());
                assert!(energies.dissipated >= dissipated, "it never falls");
                dissipated = energies.dissipated;
                assert!(energies.strain >= 0.0 && energies.fracture == 0.0);
                let held = energies.kinetic + energies.strain + dissipated;
                let balance = held - energies.work - start;
                assert!((balance - energies.error).abs() <= 1e-12 * energies.work.abs().max(1.0));
                if simulation.clock.number() == simulation.clock.last() {
                    assert!(dissipated > 5.0 * energies.strain, "{energies:?}");
                }
            }
            largest / dissipated
        })
    };
    let errors = [0.2, 0.1, 0.05].map(largest_error);
    assert!(errors[0] < 1e-2, "{errors:?}");
    for pair in errors.windows(2) {
        let ratio = pair[0] / pair[1];
        assert!(ratio > 3.0 && ratio < 5.0, "{errors:?}");
    }
}
