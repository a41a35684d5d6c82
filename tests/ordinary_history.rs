//! Ordinary laws with memory: relaxation and yielding against closed forms.

use fissure::deck::plan::Field;
use fissure::solver::Simulation;
use fissure::solver::bonds::Evolution;
use fissure::solver::observers::Snapshot;

use crate::support::simulate;

/// A block whose central point has a whole family of whole families.
fn deck(dimension: &str, law: &str) -> String {
    let (lower, upper, origin, horizon) = match dimension {
        "3d" => (
            "[-6.5, -6.5, -6.5]",
            "[6.5, 6.5, 6.5]",
            "[0.5, 0.5, 0.5]",
            3,
        ),
        _ => ("[-8.5, -8.5]", "[8.5, 8.5]", "[0.5, 0.5]", 4),
    };
    format!(
        "dimension = '{dimension}'
        grid = {{ spacing = 1, horizon = {horizon}, volume_correction = 'exact', origin = {origin} }}
        material.solid.{law}
        body.block = {{ material = 'solid', shape.box = {{ lower = {lower}, upper = {upper} }} }}
        time = {{ end = 1 }}
        "
    )
}

/// Shears the body to γ in a step (s).
fn shear<const D: usize>(simulation: &mut Simulation<D>, gamma: f64, step: f64) {
    for point in 0..simulation.model.volume.len() {
        let y = simulation.model.position(point)[1];
        simulation.fields.displacement[0][point] = gamma * y;
    }
    simulation.evaluate(Evolution::Step(step));
}

/// The shear stress (Pa) of the central point, its strain energy density and what it has dissipated, J/m³.
fn centre<const D: usize>(simulation: &mut Simulation<D>) -> [f64; 3] {
    let model = &simulation.model;
    let at_origin = |point: &usize| model.position(*point).iter().all(|x| x.abs() < 1e-9);
    let point = (0..model.owned()).find(at_origin).unwrap();
    let snapshot = Snapshot::new(simulation);
    let stress = snapshot.field(simulation, Field::Stress);
    let stored = &snapshot.stored;
    [
        stress[6 * point + 3],
        stored.energy[point],
        stored.dissipated[point],
    ]
}

const YOUNG: f64 = 5.0;
const RATIO: f64 = 0.3;
const SHEAR: f64 = YOUNG / (2.0 * (1.0 + RATIO));

#[test]
fn stress_relaxes_as_that_of_a_standard_linear_solid() {
    let (time, share, gamma) = (0.8, 0.6, 1e-5);
    let law = format!(
        "ordinary_viscoelastic = {{ density = 1, youngs_modulus = {YOUNG}, poisson_ratio = {RATIO}, \
         relaxation_time = {time}, relaxing_share = {share} }}"
    );
    fn check<const D: usize>(mut simulation: Simulation<D>, time: f64, share: f64, gamma: f64) {
        // Held after a sudden shear.
        shear(&mut simulation, gamma, 0.0);
        let [first, held, _] = centre(&mut simulation);
        assert!((first / (SHEAR * gamma) - 1.0).abs() < 0.01, "{first}");
        for step in 1..=40 {
            shear(&mut simulation, gamma, 0.05);
            let [stress, energy, dissipated] = centre(&mut simulation);
            let left = (-0.05 * f64::from(step) / time).exp();
            let wanted = 1.0 - share + share * left;
            assert!(
                (stress / first / wanted - 1.0).abs() < 1e-6,
                "{step}: {stress}"
            );
            // What the spring beside the dashpot loses, the dashpot takes.
            let spring = 1.0 - share + share * left * left;
            assert!(
                (energy / held / spring - 1.0).abs() < 1e-4,
                "{step}: {energy}"
            );
            let taken = share * (1.0 - left * left) * held;
            assert!(
                (dissipated / taken - 1.0).abs() < 1e-2,
                "{step}: {dissipated}"
            );
        }
    }
    for dimension in ["plane-strain", "plane-stress"] {
        simulate::<2, _>(&deck(dimension, &law), |s| check(s, time, share, gamma));
    }
    simulate::<3, _>(&deck("3d", &law), |s| check(s, time, share, gamma));
}

#[test]
fn a_steady_shear_has_the_closed_form() {
    let (time, share, rate) = (0.8, 0.6, 1e-5);
    let law = format!(
        "ordinary_viscoelastic = {{ density = 1, youngs_modulus = {YOUNG}, poisson_ratio = {RATIO}, \
         relaxation_time = {time}, relaxing_share = {share} }}"
    );
    simulate::<2, _>(&deck("plane-strain", &law), |mut simulation| {
        // The modulus of this lattice, from a solid that has not relaxed yet.
        shear(&mut simulation, rate, 0.0);
        let modulus = centre(&mut simulation)[0] / rate;
        shear(&mut simulation, 0.0, 0.0);
        for step in 1..=20 {
            let now = 0.1 * f64::from(step);
            shear(&mut simulation, rate * now, 0.1);
            let stress = centre(&mut simulation)[0];
            let relaxed = share * time * (1.0 - (-now / time).exp());
            let wanted = modulus * rate * ((1.0 - share) * now + relaxed);
            assert!(
                (stress / wanted - 1.0).abs() < 1e-6,
                "{step}: {stress} {wanted}"
            );
        }
    });
}

#[test]
fn a_cycle_of_shear_yields_at_the_yield_stress_and_dissipates_its_area() {
    fn check<const D: usize>(mut simulation: Simulation<D>, strength: f64, bound: f64) {
        // In pure shear von Mises' stress is √3 τ.
        let limit = strength / 3_f64.sqrt();
        // With the modulus of the lattice, which is the solid's to one per cent.
        shear(&mut simulation, 1e-3 * limit, 0.0);
        let modulus = centre(&mut simulation)[0] / (1e-3 * limit);
        assert!((modulus / SHEAR - 1.0).abs() < 0.01, "{modulus}");
        let yields = limit / modulus;
        let (mut plastic, mut wanted, mut before) = (0.0_f64, 0.0, 0.0);
        let mut gamma = 0.0;
        for target in [3.0, -2.0, 2.5] {
            while gamma != target {
                let left: f64 = target - gamma;
                gamma += left.clamp(-0.1, 0.1);
                shear(&mut simulation, gamma * yields, 0.0);
                // Elastic, perfectly plastic.
                let trial = (gamma - plastic).clamp(-1.0, 1.0);
                let change = gamma - trial - plastic;
                plastic += change;
                wanted += (change * trial).abs() * yields * limit;
                let [stress, _, dissipated] = centre(&mut simulation);
                let error = (stress / limit - trial).abs();
                assert!(error < bound, "{gamma}: {stress} of {limit}, {trial}");
                assert!(dissipated >= before, "{gamma}: {dissipated} {before}");
                before = dissipated;
            }
            assert!(
                (before / wanted - 1.0).abs() < 2.0 * bound,
                "{before} {wanted}"
            );
        }
    }
    let strength = 1e-4;
    let law = |more: &str| {
        format!(
            "ordinary_plastic = {{ density = 1, youngs_modulus = {YOUNG}, poisson_ratio = {RATIO}, \
             yield_stress = {strength} {more} }}"
        )
    };
    // The weighted volume of the lattice is that of a ball to some per cent only.
    for (more, bound) in [("", 0.01), (", calibration = 'continuum'", 0.05)] {
        let law = law(more);
        simulate::<2, _>(&deck("plane-strain", &law), |s| check(s, strength, bound));
        simulate::<2, _>(&deck("plane-stress", &law), |s| check(s, strength, bound));
        simulate::<3, _>(&deck("3d", &law), |s| check(s, strength, bound));
    }
}
