//! Scatter: points displaced from the centres of their cells, and strengths with a Weibull distribution.

use crate::support::simulate;

/// Return the deck of a bar of 20 000 points with bonds between nearest neighbours only. The bar is stretched
/// uniformly by 0.001 per step.
fn bar(damage: &str) -> String {
    format!(
        "dimension = '1d'
        grid = {{ spacing = 1, horizon = 1.5, volume_correction = 'none' }}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
        damage.brittle.critical_stretch = {{ critical_stretch = 0.01, {damage} }}
        body.bar = {{ material = 'rubber', damage = 'brittle', shape.box = {{ lower = [0], upper = [20000] }} }}
        condition.pull = {{ set = 'all', displacement = ['0.001*t*x'] }}
        time = {{ end = 20, step = 1 }}
        "
    )
}

#[test]
fn bonds_break_as_weibull_says() {
    let (modulus, bonds) = (5.0, 10_000.0);
    simulate::<1, _>(&bar("weibull_modulus = 5, seed = 7"), |mut simulation| {
        let mut intermediate = 0;
        while !simulation.is_over() {
            simulation.advance();
            // Count every other bond, because bonds with a common point are not independent.
            let mut broken = 0.0;
            simulation.forces.for_each_broken(|here, there| {
                let [here, there] = [here, there].map(|point| simulation.model.ids[point]);
                if here % 2 == 0 && there == here + 1 {
                    broken += 1.0;
                }
            });
            let stretch = 1e-3 * simulation.clock.time();
            // A bond breaks when its stretch reaches the smaller strength of its two ends.
            let expected = 1.0 - libm::exp(-2.0 * libm::pow(stretch / 0.01, modulus));
            // The difference from the distribution that one in a million samples exceeds (Dvoretzky, Kiefer &
            // Wolfowitz).
            let bound = (libm::log(2e6) / (2.0 * bonds)).sqrt();
            let found = broken / bonds;
            assert!(
                (found - expected).abs() < bound,
                "{stretch}: {found} for {expected}"
            );
            intermediate += u32::from((0.1..0.9).contains(&found));
        }
        assert!(intermediate >= 3, "{intermediate}");
    });
}

#[test]
fn a_high_modulus_is_no_scatter() {
    let broken = |damage: &str, stretch: f64| {
        let deck = bar(damage).replace("0.001*t", &format!("{stretch}*t/20"));
        simulate::<1, _>(&deck, |mut simulation| {
            while !simulation.is_over() {
                simulation.advance();
            }
            let mut broken = 0;
            simulation.forces.for_each_broken(|_, _| broken += 1);
            broken
        })
    };
    // Of 20 000 points, the weakest has a strength of about 20000^(−1/5000) = 0.998, and the strongest
    // 1.0005.
    for (stretch, all) in [(0.00995, 0), (0.01005, 2 * 19_999)] {
        assert_eq!(broken("weibull_modulus = 5000", stretch), all);
        assert_eq!(broken("alpha = 0", stretch), all);
    }
}

/// In a bar of two points, `surface_correction = "energy"` multiplies the stiffness of the bond by (δ/dx)², which
/// is 9/4. The bond must then break at 2/3 of the stretch without correction, however strong its points are.
#[test]
fn surface_corrections_scale_the_strength_of_each_point() {
    let stretch_at_break = |correction: &str, seed: u32| {
        let deck = format!(
            "dimension = '1d'
            grid = {{ spacing = 1, horizon = 1.5, volume_correction = 'none' }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5, surface_correction = '{correction}' }}
            damage.brittle.critical_stretch = {{ fracture_energy = 1e-4, weibull_modulus = 2, seed = {seed} }}
            body.bar = {{ material = 'rubber', damage = 'brittle', shape.box = {{ lower = [0], upper = [2] }} }}
            condition.pull = {{ set = 'all', displacement = ['1e-6*t*x'] }}
            time = {{ end = 20000, step = 1 }}
            "
        );
        simulate::<1, _>(&deck, |mut simulation| {
            while !simulation.is_over() {
                simulation.advance();
                let mut is_broken = false;
                simulation.forces.for_each_broken(|_, _| is_broken = true);
                if is_broken {
                    return 1e-6 * simulation.clock.time();
                }
            }
            panic!("the bond has not broken")
        })
    };
    for seed in 1..=5 {
        let plain = stretch_at_break("none", seed);
        let corrected = stretch_at_break("energy", seed);
        let expected = plain * 2.0 / 3.0;
        assert!(
            (corrected - expected).abs() < 2e-6,
            "{seed}: {corrected}, {expected}"
        );
    }
}

#[test]
fn points_are_moved_by_up_to_the_jitter() {
    let deck = |grid: &str| {
        format!(
            "dimension = '3d'
            grid = {{ spacing = [1, 2, 1], horizon = 4, volume_correction = 'none', {grid} }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            body.block = {{ material = 'rubber', shape.box = {{ lower = [0, 0, 0], upper = [10, 20, 10] }} }}
            time.end = 1
            "
        )
    };
    // Positions of the points, sorted by id.
    let places = |grid: &str| {
        simulate::<3, _>(&deck(grid), |simulation| {
            assert_eq!(simulation.forces.lattice_bonds() > 0, grid.is_empty());
            let model = &simulation.model;
            let mut places: Vec<_> = (0..model.owned())
                .map(|point| (model.ids[point], model.position(point)))
                .collect();
            places.sort_by_key(|(id, _)| *id);
            places
        })
    };
    let centres = places("");
    for (seed, share) in [(0, 0.25), (3, 0.25), (3, 0.49)] {
        let moved = places(&format!("jitter = {share}, seed = {seed}"));
        for d in 0..3 {
            let largest = share * [1.0, 2.0, 1.0][d];
            let shifts = centres.iter().zip(&moved).map(|(centre, moved)| {
                assert_eq!(centre.0, moved.0);
                moved.1[d] - centre.1[d]
            });
            let shifts: Vec<f64> = shifts.collect();
            let farthest = shifts
                .iter()
                .fold(0.0_f64, |most, shift| most.max(shift.abs()));
            // All 1000 shifts are below 0.98 `largest` with a probability of only 0.98¹⁰⁰⁰ = 2e-9.
            assert!(
                farthest <= largest && farthest > 0.98 * largest,
                "{farthest}"
            );
            // The mean of 1000 shifts has a standard deviation of `largest`/√3000.
            let mean = shifts.iter().sum::<f64>() / 1000.0;
            assert!(mean.abs() < 5.0 * largest / 3000.0_f64.sqrt(), "{mean}");
        }
        assert_eq!(places(&format!("jitter = {share}, seed = {seed}")), moved);
    }
    assert_ne!(
        places("jitter = 0.25, seed = 3"),
        places("jitter = 0.25, seed = 4")
    );
}
