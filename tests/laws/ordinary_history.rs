//! Ordinary laws with a bond history: relaxation and yielding, compared with closed forms.

use fissure::problem::Field;
use fissure::solver::Simulation;
use fissure::solver::bonds::BondUpdate;
use fissure::solver::observers::{HistoryObserver, Snapshot};

use crate::support::history::{column, row};
use crate::support::simulate;

/// Return the deck of a block whose central point and its neighbours have complete families.
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

/// Strain the body in a step (s); `over` returns the displacement along x per strain.
fn strain<const D: usize>(
    simulation: &mut Simulation<D>,
    strain: f64,
    over: fn([f64; 3]) -> f64,
    step: f64,
) {
    for point in 0..simulation.model.volume.len() {
        let place = simulation.model.position(point);
        simulation.fields.displacement[0][point] = strain * over(place);
    }
    simulation.evaluate(BondUpdate::Step(step));
}

/// Shear the body to γ in a step (s).
fn shear<const D: usize>(simulation: &mut Simulation<D>, gamma: f64, step: f64) {
    strain(simulation, gamma, |[_, y, _]| y, step);
}

/// Return the shear stress (Pa), the strain energy density and the dissipated energy density (J/m³) of the
/// central point.
fn centre<const D: usize>(simulation: &mut Simulation<D>) -> [f64; 3] {
    let ([.., xy, _, _], energies) = whole_centre(simulation);
    [xy, energies[0], energies[1]]
}

/// Return the stress (Pa) of the central point as xx, yy, zz, xy, yz, xz, and its strain energy density and
/// dissipated energy density, J/m³.
fn whole_centre<const D: usize>(simulation: &mut Simulation<D>) -> ([f64; 6], [f64; 2]) {
    let model = &simulation.model;
    let at_origin = |point: &usize| model.position(*point).iter().all(|x| x.abs() < 1e-9);
    let point = (0..model.owned()).find(at_origin).unwrap();
    let snapshot = Snapshot::new(simulation);
    let stress = snapshot.field(simulation, Field::Stress);
    let stored = &snapshot.stored;
    let stress = std::array::from_fn(|k| stress[6 * point + k]);
    (stress, [stored.energy[point], stored.dissipated[point]])
}

const YOUNG: f64 = 5.0;
const RATIO: f64 = 0.3;
const SHEAR: f64 = YOUNG / (2.0 * (1.0 + RATIO));

#[test]
fn stress_relaxes_as_that_of_a_standard_linear_solid() {
    let (time, share, gamma) = (0.8, 0.6, 1e-5);
    let law = |correction: &str| {
        format!(
            "ordinary_viscoelastic = {{ density = 1, youngs_modulus = {YOUNG}, poisson_ratio = {RATIO}, \
             relaxation_time = {time}, relaxing_share = {share}, surface_correction = '{correction}' }}"
        )
    };
    fn check<const D: usize>(mut simulation: Simulation<D>, [time, share, gamma, bound]: [f64; 4]) {
        // The shear is applied suddenly and then held.
        shear(&mut simulation, gamma, 0.0);
        let [first, held, _] = centre(&mut simulation);
        assert!((first / (SHEAR * gamma) - 1.0).abs() < bound, "{first}");
        for step in 1..=40 {
            shear(&mut simulation, gamma, 0.05);
            let [stress, energy, dissipated] = centre(&mut simulation);
            let left = (-0.05 * f64::from(step) / time).exp();
            let wanted = 1.0 - share + share * left;
            assert!(
                (stress / first / wanted - 1.0).abs() < 1e-6,
                "{step}: {stress}"
            );
            // The dashpot dissipates the energy that its spring loses.
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
    // On a lattice, the shear modulus differs from that of the solid.
    for (correction, bound) in [("none", 0.01), ("directional", 0.015), ("pals", 0.01)] {
        let (law, numbers) = (law(correction), [time, share, gamma, bound]);
        for dimension in ["plane-strain", "plane-stress"] {
            simulate::<2, _>(&deck(dimension, &law), |s| check(s, numbers));
        }
        simulate::<3, _>(&deck("3d", &law), |s| check(s, numbers));
    }
}

/// Return the deck of a small block without any complete family.
fn small_block(dimension: &str, law: &str) -> String {
    let [lower, upper] = match dimension {
        "3d" => ["[0, 0, 0]", "[4, 4, 4]"],
        _ => ["[0, 0]", "[6, 6]"],
    };
    format!(
        "dimension = '{dimension}'
        grid = {{ spacing = 1, horizon = 3.01, volume_correction = 'exact' }}
        material.solid.{law}
        body.block = {{ material = 'solid', shape.box = {{ lower = {lower}, upper = {upper} }} }}
        time = {{ end = 1 }}
        "
    )
}

/// With `surface_correction = "pals"`, each point has the energy of the solid in shear, also at edges and
/// corners. This holds for the instantaneous and the relaxed response, and at the yield stress.
#[test]
fn with_pals_points_at_surfaces_relax_and_yield_as_the_solid_does() {
    fn energies<const D: usize>(simulation: &mut Simulation<D>) -> Vec<[f64; 2]> {
        let snapshot = Snapshot::new(simulation);
        let stored = &snapshot.stored;
        let pairs = stored.energy.iter().zip(&stored.dissipated);
        pairs.map(|(energy, lost)| [*energy, *lost]).collect()
    }
    fn relax<const D: usize>(mut simulation: Simulation<D>) {
        let gamma = 1e-5;
        let elastic = 0.5 * SHEAR * gamma * gamma;
        shear(&mut simulation, gamma, 0.0);
        for [energy, _] in energies(&mut simulation) {
            assert!((energy / elastic - 1.0).abs() < 1e-4, "{energy} {elastic}");
        }
        // After 40 relaxation times, the relaxing share 0.6 of the energy is dissipated.
        for _ in 0..400 {
            shear(&mut simulation, gamma, 0.1);
        }
        for [energy, lost] in energies(&mut simulation) {
            let left = energy / elastic;
            assert!((left - 0.4).abs() < 1e-4, "{left}");
            // Each step lasts a tenth of the relaxation time and uses the force of the dashpot at the middle
            // of the step. The error is of second order in the step.
            let lost = lost / elastic;
            assert!((lost - 0.6).abs() < 1e-2, "{lost}");
        }
    }
    fn flow<const D: usize>(mut simulation: Simulation<D>, strength: f64) {
        // The shear strain at yield, and the energy density there.
        let yields = strength / 3_f64.sqrt() / SHEAR;
        let limit = strength * strength / (6.0 * SHEAR);
        shear(&mut simulation, 0.999 * yields, 0.1);
        for [energy, lost] in energies(&mut simulation) {
            assert!((energy / limit - 0.998).abs() < 1e-4, "{energy} {limit}");
            assert_eq!(lost, 0.0);
        }
        let end = 4.0;
        for step in 1..=60 {
            let gamma = yields * (1.0 + (end - 1.0) * f64::from(step) / 60.0);
            shear(&mut simulation, gamma, 0.1);
        }
        // The extensions are not linear in the shear strain, which reaches 1.2e-4.
        for [energy, lost] in energies(&mut simulation) {
            assert!((energy / limit - 1.0).abs() < 1e-3, "{energy} {limit}");
            // τ_y times the plastic strain.
            let wanted = 2.0 * limit * (end - 1.0);
            assert!((lost / wanted - 1.0).abs() < 1e-3, "{lost} {wanted}");
        }
    }
    let elastic = format!(
        "density = 1, youngs_modulus = {YOUNG}, poisson_ratio = {RATIO}, surface_correction = 'pals'"
    );
    let relaxing = format!(
        "ordinary_viscoelastic = {{ {elastic}, relaxation_time = 1, relaxing_share = 0.6 }}"
    );
    let strength = 1e-4;
    let plastic = format!("ordinary_plastic = {{ {elastic}, yield_stress = {strength} }}");
    for dimension in ["plane-strain", "plane-stress"] {
        simulate::<2, _>(&small_block(dimension, &relaxing), relax);
        simulate::<2, _>(&small_block(dimension, &plastic), |s| flow(s, strength));
    }
    simulate::<3, _>(&small_block("3d", &relaxing), relax);
    simulate::<3, _>(&small_block("3d", &plastic), |s| flow(s, strength));
}

#[test]
fn a_steady_shear_has_the_closed_form() {
    let (time, share, rate) = (0.8, 0.6, 1e-5);
    let law = format!(
        "ordinary_viscoelastic = {{ density = 1, youngs_modulus = {YOUNG}, poisson_ratio = {RATIO}, \
         relaxation_time = {time}, relaxing_share = {share} }}"
    );
    simulate::<2, _>(&deck("plane-strain", &law), |mut simulation| {
        // The modulus of this lattice, measured before the solid relaxes.
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

/// A strain path, and the scalar stress that is elastic and perfectly plastic along this path.
struct Way {
    /// Displacement along x per strain.
    over: fn([f64; 3]) -> f64,
    /// The scalar stress, from the stress tensor.
    stress: fn(&[f64; 6]) -> f64,
    /// Ratio of the scalar stress to the strain, Pa.
    modulus: f64,
    /// Ratio of the scalar stress at yield to the yield stress.
    limit: f64,
    /// Ratio of the plastic power to the product of scalar stress and plastic strain rate.
    share: f64,
}

#[test]
fn a_cycle_yields_at_the_yield_stress_and_dissipates_its_area() {
    fn check<const D: usize>(
        mut simulation: Simulation<D>,
        way: &Way,
        strength: f64,
        [of_modulus, bound]: [f64; 2],
    ) {
        let limit = strength * way.limit;
        // The modulus of the lattice differs from the modulus of the solid.
        strain(&mut simulation, 1e-3 * limit, way.over, 0.0);
        let modulus = (way.stress)(&whole_centre(&mut simulation).0) / (1e-3 * limit);
        let error = (modulus / way.modulus - 1.0).abs();
        assert!(error < of_modulus, "{modulus} for {}", way.modulus);
        let yields = limit / modulus;
        let (mut plastic, mut wanted, mut before) = (0.0_f64, 0.0, 0.0);
        let mut now = 0.0;
        for target in [3.0, -2.0, 2.5] {
            while now != target {
                let left: f64 = target - now;
                now += left.clamp(-0.1, 0.1);
                strain(&mut simulation, now * yields, way.over, 0.0);
                // The elastic, perfectly plastic model.
                let trial = (now - plastic).clamp(-1.0, 1.0);
                let change = now - trial - plastic;
                plastic += change;
                wanted += way.share * (change * trial).abs() * yields * limit;
                let (stress, [_, dissipated]) = whole_centre(&mut simulation);
                let stress = (way.stress)(&stress);
                let error = (stress / limit - trial).abs();
                assert!(error < bound, "{now}: {stress} of {limit}, {trial}");
                assert!(dissipated >= before, "{now}: {dissipated} {before}");
                before = dissipated;
            }
            assert!(
                (before / wanted - 1.0).abs() < 2.0 * bound,
                "{before} {wanted}"
            );
        }
    }
    // In pure shear, the von Mises stress is √3 τ.
    let of_shear = 1.0 / 3_f64.sqrt();
    let shear = Way {
        over: |[_, y, _]| y,
        stress: |stress| stress[3],
        modulus: SHEAR,
        limit: of_shear,
        share: 1.0,
    };
    // The deviator in the plane is a pure shear at 45°.
    let pull_in_the_plane = Way {
        over: |[x, ..]| x,
        stress: |stress| 0.5 * (stress[0] - stress[1]),
        modulus: SHEAR,
        limit: of_shear,
        share: 1.0,
    };
    // The plastic power is (σ_xx − σ_yy) ė_xx, with the plastic strain e. Because σ_xx − σ_yy = 2G (ε − 3/2
    // e_xx), the plastic strain of the model is 3/2 e_xx, and the share is 2/3.
    let pull = Way {
        over: |[x, ..]| x,
        stress: |stress| stress[0] - stress[1],
        modulus: 2.0 * SHEAR,
        limit: 1.0,
        share: 2.0 / 3.0,
    };
    let strength = 1e-4;
    let law = |more: &str| {
        format!(
            "ordinary_plastic = {{ density = 1, youngs_modulus = {YOUNG}, poisson_ratio = {RATIO}, \
             yield_stress = {strength} {more} }}"
        )
    };
    // The weighted volume of the lattice differs from the weighted volume of a ball by some per cent.
    for (more, bounds) in [
        ("", [0.01, 0.01]),
        (", calibration = 'continuum'", [0.01, 0.05]),
        (", surface_correction = 'directional'", [0.015, 0.02]),
        (", surface_correction = 'pals'", [0.01, 0.01]),
    ] {
        let law = law(more);
        for way in [&shear, &pull_in_the_plane] {
            for dimension in ["plane-strain", "plane-stress"] {
                simulate::<2, _>(&deck(dimension, &law), |s| check(s, way, strength, bounds));
            }
        }
        for way in [&shear, &pull] {
            simulate::<3, _>(&deck("3d", &law), |s| check(s, way, strength, bounds));
        }
    }
}

/// Simulate a notched plate that tears while its bonds yield or relax. Return the largest error of the energy
/// balance and the largest decrease of the released energy between two rows, both divided by the external
/// work.
fn torn(law: &str, safety: f64) -> [f64; 2] {
    let deck = format!(
        "dimension = 'plane-strain'
        grid = {{ spacing = 2e-3, horizon = 4.2e-3 }}
        material.p.{law}
        damage.e.energy.fracture_energy = 200
        body.p = {{ material = 'p', damage = 'e', shape.box = {{ lower = [0, 0], upper = [0.04, 0.024] }} }}
        crack.c.segment = {{ from = [-1, 0.012], to = [0.012, 0.012] }}
        set.top.where = 'y > 0.020'
        set.bottom.where = 'y < 0.004'
        condition.up = {{ set = 'top', velocity = ['free', '8*ramp(t,0,5e-6)'] }}
        condition.hold = {{ set = 'bottom', displacement = [0, 0] }}
        time = {{ end = 90e-6, safety = {safety} }}
        "
    );
    simulate(&deck, |mut simulation: Simulation<2>| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let wanted = [
            "energy_error",
            "external_work",
            "fracture_energy",
            "broken_bonds",
        ];
        let wanted = wanted.map(|name| column(&observer, name));
        let [mut error, mut decrease, mut freed_before] = [0.0_f64; 3];
        let mut last = [0.0; 4];
        while !simulation.is_over() {
            for _ in 0..10 {
                if !simulation.is_over() {
                    simulation.advance();
                }
            }
            let row = row(&mut observer, &mut simulation).values;
            last = wanted.map(|column| row[column]);
            error = error.max(last[0].abs());
            decrease = decrease.max(freed_before - last[2]);
            freed_before = last[2];
        }
        let [_, work, freed, broken] = last;
        assert!(broken > 150.0 && freed > 0.0, "{law}: {last:?}");
        [error / work, decrease / work]
    })
}

#[test]
fn a_plate_that_is_torn_while_it_flows_keeps_its_energy() {
    for law in [
        "ordinary_plastic = { density = 1200, youngs_modulus = 3e9, poisson_ratio = 0.35, yield_stress = 1.5e6 }",
        "ordinary_plastic = { density = 1200, youngs_modulus = 3e9, poisson_ratio = 0.35, yield_stress = 20e6 }",
        "ordinary_viscoelastic = { density = 1200, youngs_modulus = 3e9, poisson_ratio = 0.35, relaxation_time = 1e-5, relaxing_share = 0.8 }",
        "ordinary_plastic = { density = 1200, youngs_modulus = 3e9, poisson_ratio = 0.35, yield_stress = 1.5e6, surface_correction = 'pals' }",
        "ordinary_viscoelastic = { density = 1200, youngs_modulus = 3e9, poisson_ratio = 0.35, relaxation_time = 1e-5, relaxing_share = 0.8, surface_correction = 'pals' }",
        "ordinary_plastic = { density = 1200, youngs_modulus = 3e9, poisson_ratio = 0.35, yield_stress = 1.5e6, surface_correction = 'directional' }",
        "ordinary_viscoelastic = { density = 1200, youngs_modulus = 3e9, poisson_ratio = 0.35, relaxation_time = 1e-5, relaxing_share = 0.8, surface_correction = 'directional' }",
    ] {
        let [coarse, fine] = [0.8, 0.2].map(|safety| torn(law, safety));
        // At long steps, bonds break late, and the released energy may decrease in single rows. With safety
        // factors from 0.5 to 0.9, this happens in few runs, also without a surface correction, by at most
        // 2.7e-4 of the work; with factors up to 0.4 it does not happen.
        assert!(coarse[0] < 0.02 && coarse[1] < 3e-4, "{law}: {coarse:?}");
        assert!(fine[0] < 0.002 && fine[1] == 0.0, "{law}: {fine:?}");
    }
}
