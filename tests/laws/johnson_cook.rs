//! Hardening of Johnson & Cook in whole bodies: balance of energy, equilibria, forces at a fixed state.

use fissure::problem::Field;
use fissure::solver::Simulation;
use fissure::solver::bonds::BondUpdate;
use fissure::solver::observers::{HistoryObserver, Snapshot};

use crate::support::history::row;
use crate::support::{forces, simulate};

const YOUNG: f64 = 5.0;
const YIELD: f64 = 1e-4;
const RATE: f64 = 0.05;
const REFERENCE: f64 = 1e-7;

/// Return the deck of a square with hardening by strain, strain rate and heating.
fn deck(dimension: &str, more: &str) -> String {
    format!(
        "dimension = '{dimension}'
        thickness = 0.5
        grid = {{ spacing = 1, horizon = 2.5, volume_correction = 'linear' }}
        [material.metal.correspondence]
        density = 1
        youngs_modulus = {YOUNG}
        poisson_ratio = 0.3
        yield_stress = {YIELD}
        hardening_modulus = 1e-3
        hardening_exponent = 0.4
        strain_rate_coefficient = {RATE}
        reference_strain_rate = {REFERENCE}
        thermal_softening_exponent = 1.2
        initial_temperature = 300
        melting_temperature = 1300
        volumetric_heat_capacity = 4e-10
        [body.block]
        material = 'metal'
        shape.box = {{ lower = [0, 0], upper = [7, 7] }}
        {more}
        "
    )
}

#[test]
fn the_energy_of_a_body_that_hardens_is_balanced() {
    let error = |safety: f64| {
        let more = format!(
            "[initial.burst]
            velocity = ['4e-5*(x - 3.5)', '2e-5*x*(y - 3)']
            [time]
            end = 30
            safety = {safety}"
        );
        let of = |dimension: &str| {
            simulate::<2, _>(&deck(dimension, &more), |mut simulation| {
                let mut observer = HistoryObserver::new(&simulation).unwrap();
                row(&mut observer, &mut simulation);
                let [mut fastest, mut hottest] = [0.0_f64; 2];
                while !simulation.is_over() {
                    simulation.advance();
                    let change = simulation.fields.yield_change.as_ref().unwrap();
                    for change in change {
                        fastest = fastest.max(*change);
                        hottest = hottest.min(*change);
                    }
                }
                // Rate and temperature change the yield stress.
                assert!(fastest > 0.2 && hottest < -0.05, "{fastest} {hottest}");
                let energies = row(&mut observer, &mut simulation).energies;
                let start = energies.kinetic + energies.strain + energies.dissipated;
                assert!(energies.dissipated > 0.2 * start, "{energies:?}");
                (energies.error / start).abs()
            })
        };
        ["plane-strain", "plane-stress"].map(of)
    };
    let [coarse, fine] = [0.4, 0.1].map(error);
    for (coarse, fine) in coarse.into_iter().zip(fine) {
        assert!(fine < 1e-3 && fine < 0.1 * coarse, "{coarse} {fine}");
    }
}

#[test]
fn in_equilibria_the_rate_is_that_of_the_load_steps() {
    // Without hardening by strain and without heating, a bar that is pulled at a constant rate has a constant
    // stress. The supports are two horizons long.
    let run = |method: &str| {
        let text = format!(
            "dimension = 'plane-stress'
            thickness = 0.5
            grid = {{ spacing = 1, horizon = 2.5, volume_correction = 'linear' }}
            material.metal.correspondence = {{ density = 1, youngs_modulus = {YOUNG}, poisson_ratio = 0.3, yield_stress = {YIELD}, strain_rate_coefficient = {RATE}, reference_strain_rate = {REFERENCE} }}
            body.bar = {{ material = 'metal', shape.box = {{ lower = [-11, 0], upper = [11, 7] }} }}
            set.ends.where = 'abs(x) > 6'
            condition.pull = {{ set = 'ends', displacement = ['1e-5*x*t', 'free'] }}
            [time]
            end = 12
            method = '{method}'
            {method} = {{ load_steps = 12, tolerance = 1e-6 }}
            "
        );
        simulate::<2, _>(&text, |mut simulation| {
            while !simulation.is_over() {
                simulation.advance();
                simulation.check().unwrap();
            }
            let snapshot = Snapshot::new(&mut simulation);
            snapshot.field(&mut simulation, Field::Stress)
        })
    };
    let wanted = YIELD * (1.0 + RATE * f64::ln(1e-5 / REFERENCE));
    for method in ["relaxation", "static"] {
        for stress in run(method).chunks_exact(6) {
            assert!(
                (stress[0] / wanted - 1.0).abs() < 1e-3,
                "{method}: {} for {wanted}",
                stress[0]
            );
            assert!(stress[1].abs() < 1e-3 * wanted, "{method}: {}", stress[1]);
        }
    }
}

#[test]
fn forces_that_are_evaluated_again_do_not_flow_again() {
    let pull = |simulation: &mut Simulation<2>, strain: f64, update: BondUpdate| {
        for point in 0..simulation.model.volume.len() {
            let [x, y, _] = simulation.model.position(point);
            simulation.fields.displacement[0][point] = strain * x;
            simulation.fields.displacement[1][point] = -0.2 * strain * y;
        }
        simulation.evaluate(update);
    };
    for dimension in ["plane-strain", "plane-stress"] {
        let text = deck(dimension, "[time]\nend = 1");
        simulate::<2, _>(&text, |mut simulation| {
            let state = |simulation: &Simulation<2>| {
                let fields = &simulation.fields;
                (
                    fields.plastic_strain.clone(),
                    fields.plastic_strain_equivalent.clone(),
                    fields.yield_change.clone(),
                    fields.plastic_work.clone(),
                )
            };
            let yields = YIELD / YOUNG;
            pull(&mut simulation, 9.0 * yields, BondUpdate::Step(0.01));
            let (before, kept) = (forces(&simulation), state(&simulation));
            let change = kept.2.as_ref().unwrap()[0];
            assert!(change > 0.5, "{change}");
            for update in [
                BondUpdate::None,
                BondUpdate::Trial(0.0),
                BondUpdate::Step(0.0),
            ] {
                pull(&mut simulation, 9.0 * yields, update);
                assert_eq!(forces(&simulation), before);
                assert_eq!(state(&simulation), kept);
            }
            // While time passes at the same strain, the stress relaxes to that of a smaller strain rate.
            pull(&mut simulation, 9.0 * yields, BondUpdate::Trial(1.0));
            assert_ne!(forces(&simulation), before);
            assert_eq!(state(&simulation), kept);
            pull(&mut simulation, 9.0 * yields, BondUpdate::Step(1.0));
            let relaxed = state(&simulation);
            assert!(relaxed.2.unwrap()[0] < change);
            assert!(relaxed.1.unwrap()[0] > kept.1.unwrap()[0]);
        });
    }
}
