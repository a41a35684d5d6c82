//! Wave speeds from simulations: pulses in cubic lattices and standing waves in a bar.
//! `tests/laws/elasticity.rs` compares the forces in such waves with closed forms.

use std::collections::HashMap;

use crate::support::simulate;
use fissure::solver::Simulation;

const DENSITY: f64 = 3.0;
const BULK: f64 = 2.0;

/// Constraint that moves every point as the point of the middle column at the same x. The bar then carries a
/// plane wave as in the infinite lattice, because the middle column has complete families.
struct Plane {
    /// Index in `column` of the point at the same x, for each point.
    leader: Vec<usize>,
    /// Points of the middle column.
    column: Vec<usize>,
}

impl Plane {
    fn new(simulation: &Simulation<3>) -> Self {
        let model = &simulation.model;
        let layer = |point: usize| model.position(point)[0].round() as i64;
        let middle = |point: &usize| {
            let [_, y, z] = model.position(*point);
            y.abs() < 1e-9 && z.abs() < 1e-9
        };
        let column: Vec<usize> = (0..model.owned()).filter(middle).collect();
        let known: HashMap<i64, usize> =
            column.iter().map(|point| (layer(*point), *point)).collect();
        Self {
            leader: (0..model.owned())
                .map(|point| known[&layer(point)])
                .collect(),
            column,
        }
    }

    fn follow(&self, simulation: &mut Simulation<3>) {
        let fields = &mut simulation.fields;
        for (point, leader) in self.leader.iter().copied().enumerate() {
            for d in 0..3 {
                fields.displacement[d][point] = fields.displacement[d][leader];
                fields.velocity[d][point] = fields.velocity[d][leader];
                fields.internal_force[d][point] = fields.internal_force[d][leader];
            }
        }
    }

    /// Return the centroid of the right half of a displacement pulse, m.
    fn centroid(&self, simulation: &Simulation<3>) -> f64 {
        let values = self.column.iter().map(|point| {
            let x = simulation.model.reference[0][*point];
            (x, simulation.fields.displacement[0][*point])
        });
        let right = values.filter(|(x, _)| *x > 0.0);
        let (mut weighted, mut sum) = (0.0, 0.0);
        for (x, u) in right {
            weighted += x * u;
            sum += u;
        }
        weighted / sum
    }
}

/// Return the speed (m/s) of a displacement pulse along an axis of a cubic lattice of unit spacing. `bodies`
/// returns the materials and bodies of a bar with a given half length.
///
/// A Gaussian pulse at rest separates into two halves. Then the centroid of a half moves at the speed of long
/// waves, whatever the dispersion.
fn pulse_speed(horizon: f64, bodies: impl Fn(f64) -> String) -> f64 {
    let expected = (1.8 * BULK / DENSITY).sqrt();
    let [apart, end] = [5.0, 8.5].map(|horizons| horizons * horizon / expected);
    let half = (13.0 * horizon).ceil() + 0.5;
    let text = format!(
        "dimension = '3d'
        [grid]
        volume_correction = 'none'
        spacing = 1
        horizon = {horizon}
        origin = [0.5, 0.5, 0.5]
        {}
        [initial.pulse]
        displacement = ['1e-5*exp(-(x/{})^2)', 0, 0]
        [time]
        end = {end}
        safety = 0.9
        ",
        bodies(half),
        1.5 * horizon
    );
    simulate::<3, _>(&text, |mut simulation| {
        let plane = Plane::new(&simulation);
        plane.follow(&mut simulation);
        let mut start = None;
        while simulation.clock.number() < simulation.clock.last() {
            simulation.advance();
            plane.follow(&mut simulation);
            if simulation.clock.time() >= apart && start.is_none() {
                start = Some((simulation.clock.time(), plane.centroid(&simulation)));
            }
        }
        let (time, place) = start.expect("the run is longer");
        (plane.centroid(&simulation) - place) / (simulation.clock.time() - time)
    })
}

/// Return a function that describes a bar of one law with this half width.
fn uniform(law: &str, width: f64) -> impl Fn(f64) -> String {
    move |half| {
        format!(
            "[material]
            rubber.{law} = {{ density = {DENSITY}, bulk_modulus = {BULK} }}
            [body.bar]
            material = 'rubber'
            shape.box = {{ lower = [-{half}, -{width}, -{width}], upper = [{half}, {width}, {width}] }}
            "
        )
    }
}

fn compare(name: &str, horizon: f64, found: f64, expected: f64) {
    let ratio = found / (1.8 * BULK / DENSITY).sqrt();
    assert!(
        (ratio / expected - 1.0).abs() < 0.005,
        "{name}, m = {horizon}: {ratio} instead of {expected}"
    );
}

#[test]
fn pulses_have_the_speeds_of_the_prototype_law() {
    for (horizon, expected) in [(2.52, 1.130), (3.0, 1.028), (4.0, 0.967), (6.0, 1.004)] {
        let width = f64::floor(horizon) + 0.5;
        let found = pulse_speed(horizon, uniform("pmb", width));
        compare("pmb", horizon, found, expected);
    }
}

#[test]
fn pulses_have_the_speeds_of_the_normalised_law() {
    // The bar is so wide that neighbours of the middle column also have complete families, and thus the same
    // constant.
    for (horizon, expected) in [(2.52, 1.001), (3.0, 0.971), (4.0, 0.995)] {
        let width = 2.0 * f64::floor(horizon) + 0.5;
        let found = pulse_speed(horizon, uniform("normalised_pmb", width));
        compare("normalised", horizon, found, expected);
    }
}

#[test]
fn a_pulse_has_the_speed_of_the_normalised_law_in_a_wide_family() {
    // Repeat this for m = 6 in a bar of half the width. The middle column is a body of the normalised law.
    // The other points get the constant of a complete family from another modulus.
    let horizon: f64 = 6.0;
    let mut lengths = 0.0;
    for x in -6..=6 {
        for y in -6..=6 {
            for z in -6..=6 {
                let length = f64::from(x * x + y * y + z * z).sqrt();
                lengths += if length <= horizon { length } else { 0.0 };
            }
        }
    }
    // Modulus that gives the constant 18K/Σ|ξ|V instead of 18K/πδ⁴.
    let bulk = BULK * std::f64::consts::PI * horizon.powi(4) / lengths;
    let bodies = |half: f64| {
        format!(
            "[material]
            rubber.normalised_pmb = {{ density = {DENSITY}, bulk_modulus = {BULK} }}
            around.pmb = {{ density = {DENSITY}, bulk_modulus = {bulk} }}
            [body.around]
            material = 'around'
            shape.box = {{ lower = [-{half}, -6.5, -6.5], upper = [{half}, 6.5, 6.5] }}
            [body.middle]
            material = 'rubber'
            shape.box = {{ lower = [-{half}, -0.5, -0.5], upper = [{half}, 0.5, 0.5] }}
            "
        )
    };
    compare("normalised", horizon, pulse_speed(horizon, bodies), 0.990);
}

#[test]
fn standing_waves_in_a_bar_disperse_as_the_integral_says() {
    // ω² = 4M/(ρδ²) Cin(kδ), with the modulus M of uniaxial strain and Cin(x) = ∫₀ˣ (1 − cos t)/t dt. The
    // displacement in the middle of a long bar is zero at π/2ω, before waves from the ends arrive.
    let (horizon, modulus) = (40.0, 1.2_f64 * 5.0);
    let speed = (modulus / DENSITY).sqrt();
    for (number, expected) in [
        (0.5, 0.9948),
        (1.0, 0.9794),
        (2.0, 0.9205),
        (std::f64::consts::PI, 0.8173),
    ] {
        let wave_number = number / horizon;
        let quarter = 0.5 * std::f64::consts::PI / (wave_number * speed);
        let text = format!(
            "dimension = '1d'
            constraint = 'uniaxial-strain'
            [grid]
            spacing = 1
            horizon = {horizon}
            origin = [0.5]
            volume_correction = 'exact'
            [material]
            rubber.proportional = {{ density = {DENSITY}, youngs_modulus = 5 }}
            [body.bar]
            material = 'rubber'
            shape.box = {{ lower = [-400.5], upper = [400.5] }}
            [initial.wave]
            displacement = ['1e-5*cos({wave_number}*x)']
            [time]
            end = {}
            step = {}
            ",
            1.5 * quarter,
            0.01 * quarter
        );
        simulate::<1, _>(&text, |mut simulation| {
            let middle = (0..801).find(|k| simulation.model.reference[0][*k].abs() < 1e-9);
            let middle = middle.expect("a point in the middle");
            let at = |simulation: &Simulation<1>| simulation.fields.displacement[0][middle];
            let mut before = at(&simulation);
            while at(&simulation) > 0.0 {
                before = at(&simulation);
                simulation.advance();
            }
            let after = at(&simulation);
            let passed =
                simulation.clock.time() - simulation.clock.step() * after / (after - before);
            let found = quarter / passed;
            assert!((found / expected - 1.0).abs() < 0.005, "{number}: {found}");
        });
    }
}
