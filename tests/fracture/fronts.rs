//! Fronts along lines and crack tips in the history.

use crate::support::history::{column, row};
use crate::support::{displace, simulate, simulate_on};
use fissure::solver::Simulation;
use fissure::solver::observers::HistoryObserver;

/// Return the last entries of the current row, which belong to the fronts and tips.
fn last<const D: usize, const N: usize>(simulation: &mut Simulation<D>) -> [f64; N] {
    let mut observer = HistoryObserver::new(simulation).unwrap_or_else(|error| panic!("{error}"));
    let values = row(&mut observer, simulation).values;
    values[values.len() - N..].try_into().unwrap()
}

/// Return the deck of a bar of 20 points at 0.5, 1.5, …, with a front.
fn bar(front: &str) -> String {
    format!(
        "dimension = '1d'
        grid = {{ volume_correction = 'none', spacing = 1, horizon = 3 }}
        material.rubber.proportional = {{ density = 2, youngs_modulus = 5 }}
        body.bar = {{ material = 'rubber', shape.box = {{ lower = [0], upper = [20] }} }}
        history.front.wave = {{ {front} }}
        time = {{ end = 1 }}
        "
    )
}

#[test]
fn a_front_is_where_the_field_crosses_the_threshold_between_two_points() {
    let same = bar("from = [1], direction = [2], field = 'displacement', threshold = 0.43");
    // The body has the spacing and the horizon of before, and those of the grid are smaller.
    let own = (same.replace("spacing = 1, horizon = 3", "spacing = 0.2, horizon = 0.6"))
        .replace("shape.box", "spacing = 1, horizon = 3, shape.box");
    for deck in [same, own] {
        simulate::<1, _>(&deck, |mut simulation| {
            // A field that decreases along the line; the front moves over points and between points.
            for k in 0..150 {
                let reach = 7.0 + 0.1 * f64::from(k);
                displace(&mut simulation, |[x, y, z]| {
                    [x - 0.1 * (reach - x).max(0.0), y, z]
                });
                let [front] = last(&mut simulation);
                let expected = (reach - 4.3).min(19.5) - 1.0;
                assert!((front - expected).abs() < 1e-12, "{front} {expected}");
            }
            // The threshold applies to the absolute value. Without a point above it, the front is NaN.
            displace(&mut simulation, |[x, y, z]| [x + 0.01 * x, y, z]);
            assert!(last::<1, 1>(&mut simulation)[0].is_nan());
        });
    }
}

#[test]
fn a_front_looks_at_the_points_near_its_line() {
    let deck = |radius: &str, component: &str| {
        format!(
            "dimension = '3d'
            grid = {{ volume_correction = 'none', spacing = 1, horizon = 2 }}
            material.rubber.proportional = {{ density = 2, youngs_modulus = 5 }}
            body.block = {{ material = 'rubber', shape.box = {{ lower = [0, 0, 0], upper = [8, 5, 5] }} }}
            history.front.wave = {{ from = [8, 2.5, 2.5], direction = [-1, 0, 0], radius = {radius}, length = 6, field = 'velocity', threshold = 0.5{component} }}
            initial.middle.velocity = ['0.2*step(x - 3)', '0.3*step(x - 3) + if(z < 1, 5, 0)', '0.6*step(x - 3)']
            time = {{ end = 1 }}
            "
        )
    };
    let front = |radius, component| {
        simulate::<3, _>(&deck(radius, component), |mut s| last::<3, 1>(&mut s)[0])
    };
    // Near the line, points at x = 3.5 exceed the threshold, and points at x = 2.5 do not move. The front is
    // measured from x = 8 downwards, so it is at 4.5 + (value − 0.5)/value.
    let length = (0.2_f64.powi(2) + 0.3_f64.powi(2) + 0.6_f64.powi(2)).sqrt();
    assert!((front("0.1", "") - (4.5 + (length - 0.5) / length)).abs() < 1e-12);
    assert!((front("1.5", ", component = 'z'") - (4.5 + 0.1 / 0.6)).abs() < 1e-12);
    assert!(front("1.5", ", component = 'x'").is_nan());
    // With radius 2, the points with z < 1 also count, and all of them exceed the threshold. The front is
    // then at the last point within the length of 6 m, x = 2.5.
    assert!((front("2", "") - 5.5).abs() < 1e-12);
}

/// Return the deck of a plate with a cut from its centre along `direction`; `length` in spacings.
fn cut(direction: [f64; 2], length: f64) -> String {
    let [x, y] = direction.map(|entry| entry / direction[0].hypot(direction[1]));
    format!(
        "dimension = 'plane-stress'
        grid = {{ volume_correction = 'none', spacing = 1, horizon = 3 }}
        material.glass.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.plate = {{ material = 'glass', shape.box = {{ lower = [-20, -20], upper = [20, 20] }} }}
        crack.cut.segment = {{ from = [{}, {}], to = [{}, {}] }}
        history.tip.cut = {{ from = [0, 0], direction = [{x}, {y}] }}
        time = {{ end = 1 }}
        ",
        -5.0 * x,
        -5.0 * y,
        length * x,
        length * y,
    )
}

#[test]
fn a_tip_follows_a_cut_in_any_direction_on_any_number_of_ranks() {
    for direction in [[1.0, 0.0], [0.0, -1.0], [1.0, 1.0], [-3.0, 2.0]] {
        let mut before = 0.0;
        for k in 0..30 {
            let end = 6.05 + 0.21 * f64::from(k);
            let deck = cut(direction, end);
            let [x, y, length, speed] = simulate::<2, _>(&deck, |mut s| last(&mut s));
            assert!(length >= before, "{direction:?} {end}: {length} {before}");
            // At the tip the cut separates less than half of a family, so the found tip is slightly behind
            // the true tip.
            assert!((end - 1.5..end + 0.5).contains(&length), "{end}: {length}");
            before = length;
            let size = direction[0].hypot(direction[1]);
            let along = (x * direction[0] + y * direction[1]) / size;
            let beside = (x * direction[1] - y * direction[0]) / size;
            assert!((along - length).abs() < 1e-9 && beside.abs() < 1.0);
            assert!(speed.is_nan(), "the first row has none");
            if k % 10 == 0 {
                for ranks in [2, 3, 4] {
                    for found in simulate_on::<2, _>(ranks, &deck, |mut s| last::<2, 3>(&mut s)) {
                        let bits = [y, length, speed].map(f64::to_bits);
                        assert_eq!(found.map(f64::to_bits), bits);
                    }
                }
            }
        }
    }
}

#[test]
fn the_tip_of_a_running_crack() {
    let deck = include_str!("../../inputs/crack_branching.toml").to_owned()
        + "\n[history.tip.crack]\nfrom = [0, 0]\ndirection = [1, 0]\n";
    simulate::<2, _>(&deck, |mut simulation| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let mut rows = Vec::new();
        while simulation.clock.number() < simulation.clock.last() {
            if simulation.clock.number() % 5 == 0 {
                rows.push(row(&mut observer, &mut simulation).values);
            }
            simulation.advance();
        }
        let of = |row: &[f64], name: &str| row[column(&observer, name)];
        for row in &rows {
            // The bounding box of the cracked points has no interpolation, so it ends slightly behind the tip
            // or at it.
            let ahead = of(row, "tip_crack_length") - of(row, "cracked_upper_x");
            assert!((0.0..1e-3).contains(&ahead), "{ahead}");
            assert_eq!(of(row, "tip_crack_x"), of(row, "tip_crack_length"));
        }
        // The tip is at rest until the load has travelled 20 mm. Afterwards the tip is slower than Rayleigh
        // waves, which travel at 3.1 km/s.
        let speeds: Vec<f64> = rows[1..]
            .iter()
            .map(|row| of(row, "tip_crack_speed"))
            .collect();
        let arrival = rows.iter().position(|row| of(row, "time") > 3e-6).unwrap();
        assert!(speeds[..arrival].iter().all(|speed| *speed == 0.0));
        let fastest = speeds.iter().copied().fold(0.0, f64::max);
        assert!((1000.0..3100.0).contains(&fastest), "{fastest} m/s");
        assert!(speeds.iter().all(|speed| *speed >= 0.0), "it never shrinks");
    });
}
