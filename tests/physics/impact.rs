//! Contact: bodies that collide, stick and slide; momentum, energy and crack faces.

use std::collections::BTreeSet;

use crate::support::history::{column, row};
use crate::support::{largest_force, problem, simulate, simulate_on};
use fissure::comm::threads;
use fissure::solver::Simulation;
use fissure::solver::observers::HistoryObserver;

/// Run a deck, and return rows of the named columns, one per `every` steps.
fn history<const D: usize>(deck: &str, every: u64, names: &[&str]) -> Vec<Vec<f64>> {
    simulate::<D, _>(deck, |mut simulation| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let places: Vec<usize> = names.iter().map(|name| column(&observer, name)).collect();
        let mut rows = Vec::new();
        let mut look = |simulation: &mut Simulation<'_, D>| {
            let values = row(&mut observer, simulation).values;
            rows.push(places.iter().map(|place| values[*place]).collect());
        };
        look(&mut simulation);
        while !simulation.is_over() {
            simulation.advance();
            if simulation.clock.number().is_multiple_of(every) || simulation.is_over() {
                look(&mut simulation);
            }
        }
        simulation.check().unwrap();
        rows
    })
}

/// Return the deck of two equal steel bars, 0.1 m long, that collide at 10 m/s.
fn bars(contact: &str) -> String {
    format!(
        "dimension = '1d'
        grid = {{ spacing = 5e-4, horizon = 1.5075e-3 }}
        material.steel.pmb = {{ density = 8000, youngs_modulus = 200e9 }}
        contact = {{ pair.hit.bodies = ['left', 'right'], {contact} }}
        body.left = {{ material = 'steel', shape.box = {{ lower = [0], upper = [0.1] }} }}
        body.right = {{ material = 'steel', shape.box = {{ lower = [0.1], upper = [0.2] }} }}
        initial.left = {{ set = 'left', velocity = [10] }}
        initial.right = {{ set = 'right', velocity = [-10] }}
        time.end = 60e-6
        "
    )
}

#[test]
fn equal_bars_exchange_their_velocities_in_the_time_of_two_waves() {
    for model in ["penalty", "short-range"] {
        let names = [
            "time",
            "kinetic_energy",
            "energy_error",
            "momentum_x",
            "touching_pairs",
            "contact_hit_force_x",
        ];
        let rows = history::<1>(&bars(&format!("model = '{model}'")), 1, &names);
        // Expected duration of contact: 2 L/c with c = √(E/ρ).
        let touching: Vec<f64> = rows
            .iter()
            .filter(|row| row[4] > 0.0)
            .map(|row| row[0])
            .collect();
        let lasted = touching.last().unwrap() - touching[0];
        assert!((lasted / 40e-6 - 1.0).abs() < 0.02, "{model}: {lasted} s");
        let [first, last] = [&rows[0], rows.last().unwrap()];
        // The missing kinetic energy remains in the bars as vibration, because the lattice disperses the wave
        // front.
        assert!((last[1] / first[1] - 1.0).abs() < 0.02, "{model}: {last:?}");
        assert!((last[2] / first[1]).abs() < 0.01, "{model}: {last:?}");
        let momentum = 0.1 * 8000.0 * 10.0;
        for row in &rows {
            assert!(row[3].abs() < 1e-12 * momentum, "{model}: {row:?}");
            assert!(row[5] <= 0.0, "contact pulls: {row:?}");
        }
    }
}

#[test]
fn damping_takes_what_the_motion_loses() {
    let names = [
        "kinetic_energy",
        "energy_error",
        "contact_damping_energy",
        "friction_energy",
        "momentum_x",
    ];
    let deck = bars("restitution = 0.3") + "time.safety = 0.4\n";
    let rows = history::<1>(&deck, 20, &names);
    let [first, last] = [&rows[0], rows.last().unwrap()];
    assert!(last[2] > 0.005 * first[0], "{last:?}");
    assert_eq!(last[3], 0.0);
    // Contact that opens or closes between two steps changes the energy by some per cent of the contact
    // energy.
    assert!(last[1].abs() < 0.1 * last[2], "{last:?}");
    assert!(last[4].abs() < 1e-9, "{last:?}");
}

/// Return the deck of two single points of 2 kg in the plane, at a distance `apart` along x, m.
fn two_points(contact: &str, apart: f64, velocities: [[f64; 2]; 2], end: f64) -> String {
    let [[a, b], [c, d]] = velocities;
    format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 1, horizon = 3, volume_correction = 'none' }}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
        contact = {{ {contact} }}
        body.first = {{ material = 'rubber', shape.box = {{ lower = [0, 0], upper = [1, 1] }} }}
        body.second = {{ material = 'rubber', shape.box = {{ lower = [{apart}, 0], upper = [{}, 1] }} }}
        initial.first = {{ set = 'first', velocity = [{a}, {b}] }}
        initial.second = {{ set = 'second', velocity = [{c}, {d}] }}
        time = {{ end = {end}, step = 1e-3 }}
        history.probe = {{ first.at = [0.5, 0.5], second.at = [{}, 0.5] }}
        ",
        apart + 1.0,
        apart + 0.5
    )
}

#[test]
fn restitution_is_that_of_two_points() {
    for restitution in [1.0, 0.7, 0.2] {
        let deck = two_points(
            &format!("restitution = {restitution}"),
            1.1,
            [[0.1, 0.0], [-0.1, 0.0]],
            8.0,
        );
        let names = [
            "probe_first_velocity_x",
            "probe_second_velocity_x",
            "energy_error",
        ];
        let rows = history::<2>(&deck, 50, &names);
        let last = rows.last().unwrap();
        let after = (last[1] - last[0]) / 0.2;
        assert!((after - restitution).abs() < 2e-3, "{restitution}: {after}");
        assert!(last[2].abs() < 1e-5, "{last:?}");
    }
}

#[test]
fn points_that_stick_move_together() {
    let names = ["probe_first_velocity_y", "friction_energy", "energy_error"];
    let deck = two_points("friction = 50", 1.0, [[0.2, 0.004], [0.0, 0.0]], 4.0);
    let rows = history::<2>(&deck, 1, &names);
    let last = rows.last().unwrap();
    // Without friction, this velocity would be 0.0052 m/s, because the direction of the contact rotates.
    assert!((last[0] / 0.002 - 1.0).abs() < 0.25, "{last:?}");
    assert!(last[1] > 0.0 && last[2].abs() < 1e-2 * last[1], "{last:?}");
}

/// Return the deck of a block on an inclined rigid half space, with gravity 0.01 m/s². `angle` is the slope,
/// `speed` the initial speed down the slope.
fn incline(angle: f64, friction: &str, speed: f64) -> String {
    let (sine, cosine) = (angle.sin(), angle.cos());
    let (x, y) = (2.0 * 0.01 * sine, -2.0 * 0.01 * cosine);
    format!(
        "dimension = 'plane-strain'
        grid = {{ spacing = 1, horizon = 3 }}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
        rigid.slope = {{ half_space = {{ through = [0, 0], normal = [0, 1] }}, {friction}, restitution = 0.2 }}
        body.block = {{ material = 'rubber', shape.box = {{ lower = [0, 0], upper = [8, 4] }} }}
        initial.slide = {{ set = 'block', velocity = [{speed}, 0] }}
        condition.gravity = {{ set = 'block', body_force = [{x}, {y}] }}
        time.end = 100
        "
    )
}

#[test]
fn a_block_on_an_incline_slides_or_sticks() {
    let names = [
        "time",
        "momentum_x",
        "rigid_slope_force_x",
        "energy_error",
        "friction_energy",
    ];
    let mass = 2.0 * 32.0;
    for (angle, friction) in [(0.3_f64, 0.1), (0.5, 0.3), (0.2, 0.0)] {
        let deck = incline(angle, &format!("friction = {friction}"), 0.02);
        let rows = history::<2>(&deck, 10, &names);
        // After half of the time, vibrations of the block have decayed.
        let [middle, last] = [&rows[rows.len() / 2], rows.last().unwrap()];
        let found = (last[1] - middle[1]) / (last[0] - middle[0]) / mass;
        let expected = 0.01 * (angle.sin() - friction * angle.cos());
        assert!(
            (found / expected - 1.0).abs() < 0.02,
            "{angle}: {found} for {expected}"
        );
        assert!(last[3].abs() < 0.01 * (last[4] + 0.02), "{last:?}");
    }
    // The normal load rises before the tangential load, so that the block never leaves the slope; tan 0.2 =
    // 0.203.
    let gently = |friction: &str| {
        let (x, y) = (0.02 * 0.2_f64.sin(), -0.02 * 0.2_f64.cos());
        let deck = incline(0.2, friction, 0.0);
        let ramped = format!("body_force = ['{x}*ramp(t, 40, 80)', '{y}*ramp(t, 0, 30)']");
        let start = deck.find("body_force").unwrap();
        let end = start + deck[start..].find(']').unwrap() + 1;
        deck.replace(&deck[start..end], &ramped).replace(
            "youngs_modulus = 5 }",
            "youngs_modulus = 5, damping = 0.1 }",
        )
    };
    let rows = history::<2>(
        &gently("static_friction = 0.4, friction = 0.15"),
        10,
        &names,
    );
    let last = rows.last().unwrap();
    // Sticking is a viscous drag of √(k m) at each of the eight touching points, with k = 2 E ℓ/δ and m = 2
    // kg. The block therefore creeps with the friction force divided by this drag.
    let creep = last[2] / (8.0 * (2.0 * 5.0 / 3.0 * 2.0_f64).sqrt());
    assert!((last[1] / mass / creep - 1.0).abs() < 0.02, "{last:?}");
    let weight = mass * 0.01 * 0.2_f64.sin();
    let drag = 0.1 * last[1];
    assert!(
        ((last[2] + drag) / weight - 1.0).abs() < 0.02,
        "{last:?} for {weight}"
    );
    let rows = history::<2>(
        &gently("static_friction = 0.15, friction = 0.1"),
        10,
        &names,
    );
    let last = rows.last().unwrap();
    let slides = 0.1 * mass * 0.01 * 0.2_f64.cos();
    assert!(
        (last[2] / slides - 1.0).abs() < 0.02,
        "{last:?} for {slides}"
    );
}

#[test]
fn a_rigid_ball_and_a_block_keep_momentum_and_energy() {
    let deck = "
        dimension = '3d'
        grid = { spacing = 1, horizon = 3 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        body.block = { material = 'rubber', shape.box = { lower = [0, 0, 0], upper = [6, 6, 4] } }
        rigid.ball = { shape.sphere = { centre = [3.3, 2.8, 6.2], radius = 2 }, mass = 100, velocity = [0, 0, -0.05], angular_velocity = [0.01, 0.02, 0], friction = 0.3, restitution = 0.7 }
        time = { end = 60, safety = 0.4 }
        ";
    let names = [
        "momentum_z",
        "rigid_ball_velocity_z",
        "energy_error",
        "friction_energy",
        "contact_damping_energy",
        "rigid_ball_kinetic_energy",
        "momentum_x",
        "rigid_ball_velocity_x",
    ];
    let rows = history::<3>(deck, 20, &names);
    let [first, last] = [&rows[0], rows.last().unwrap()];
    assert!(last[1] > -0.03, "it bounces off or slows down: {last:?}");
    assert!(last[3] > 0.0 && last[4] > 0.0, "{last:?}");
    for row in &rows {
        for (of_block, of_ball) in [(row[0] - first[0], row[1] - first[1]), (row[6], row[7])] {
            assert!(
                (of_block + 100.0 * of_ball).abs() < 1e-12 * 5.0 * 100.0,
                "{row:?}"
            );
        }
        assert!(row[2].abs() < 0.005 * first[5], "{row:?}");
    }
}

#[test]
fn a_free_rigid_box_tumbles_with_its_energy() {
    let deck = |step: f64| {
        format!(
            "dimension = '3d'
            grid = {{ spacing = 1, horizon = 3 }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            body.far = {{ material = 'rubber', shape.box = {{ lower = [90, 0, 0], upper = [92, 2, 2] }} }}
            rigid.brick = {{ shape.box = {{ lower = [-1, -2, -3], upper = [1, 2, 3] }}, mass = 5, velocity = [0, 1, 0], angular_velocity = [0.01, 1, 0.02], force = ['5*sin(t)', 0, 0] }}
            time = {{ end = 20, step = {step} }}
            "
        )
    };
    // Rotation about the intermediate axis is unstable, so the brick turns over.
    let error = |step: f64| {
        let names = [
            "energy_error",
            "rigid_brick_velocity_x",
            "rigid_brick_position_y",
        ];
        let rows = history::<3>(&deck(step), 1, &names);
        let last = rows.last().unwrap();
        assert!(
            (last[1] - (1.0 - 20.0_f64.cos())).abs() < step * step,
            "{last:?}"
        );
        assert!((last[2] - 20.0).abs() < 1e-9, "{last:?}");
        rows.iter().map(|row| row[0].abs()).fold(0.0, f64::max)
    };
    let [coarse, fine] = [0.04, 0.02].map(error);
    assert!(
        fine < 0.02 && (3.0..5.0).contains(&(coarse / fine)),
        "{coarse} {fine}"
    );
}

#[test]
fn a_rigid_ball_rolls_down_a_plane_of_points() {
    let (mass, gravity, angle) = (100.0, 0.03, 0.2_f64);
    let (along, down) = (mass * gravity * angle.sin(), -mass * gravity * angle.cos());
    let deck = format!(
        "dimension = '3d'
        grid = {{ spacing = 1, horizon = 1.5 }}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.plane = {{ material = 'rubber', shape.box = {{ lower = [-12, -1.5, -1], upper = [24, 1.5, 0] }} }}
        rigid.ball = {{ shape.sphere = {{ centre = [0.3, 0, 40], radius = 40 }}, mass = {mass}, force = [{along}, 0, {down}], friction = 0.5, restitution = 0.9 }}
        condition.hold = {{ set = 'plane', displacement = [0, 0, 0] }}
        time.end = 90
        "
    );
    let names = [
        "time",
        "rigid_ball_velocity_x",
        "rigid_ball_kinetic_energy",
        "rigid_ball_position_x",
        "energy_error",
        "friction_energy",
    ];
    let rows = history::<3>(&deck, 5, &names);
    // After half of the time the ball rolls. Damping of points that lose contact would slow the ball down.
    let [middle, last] = [&rows[rows.len() / 2], rows.last().unwrap()];
    // Contact begins half a spacing from the surface, which determines the rolling radius.
    let inertia = 0.4 * (40.0_f64 / 40.5).powi(2);
    let expected = gravity * angle.sin() / (1.0 + inertia);
    let found = (last[1] - middle[1]) / (last[0] - middle[0]);
    assert!(
        (found / expected - 1.0).abs() < 0.01,
        "{found} for {expected}"
    );
    let without_overlap = 5.0 / 7.0 * gravity * angle.sin();
    assert!(
        (found / without_overlap - 1.0).abs() < 0.02,
        "{found} for {without_overlap}"
    );
    // The rotation matches rolling.
    let of_spin = last[2] / (0.5 * mass * last[1].powi(2)) - 1.0;
    assert!((of_spin / inertia - 1.0).abs() < 0.05, "{of_spin}");
    assert!(last[3] < 23.0, "it has left the plane: {last:?}");
    assert!(last[4].abs() < 0.01 * last[2], "{last:?}");
    assert!(last[5] < 0.05 * last[2], "it does not slide: {last:?}");
}

#[test]
fn a_point_in_a_rigid_body_is_an_error() {
    let deck = problem(
        "dimension = 'plane-strain'
        grid = { spacing = 1, horizon = 3 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        body.block = { material = 'rubber', shape.box = { lower = [0, 0], upper = [8, 4] } }
        rigid.ball.shape.disc = { centre = [3, 5], radius = 1.6 }
        time.end = 1
        ",
    );
    let comm = threads::alone();
    let error = Simulation::<2>::new(&deck, &comm);
    let message = error.err().unwrap().message;
    assert!(message.starts_with("[rigid.ball]: point "), "{message}");
    assert!(
        message.contains("of [body.block] begins 1.886e-2 m"),
        "{message}"
    );
}

/// Return the deck of a block with a crack through it, whose halves are pressed together.
fn cracked_block(contact: &str) -> String {
    format!(
        "dimension = 'plane-strain'
        grid = {{ spacing = 1, horizon = 3.015 }}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5, damping = 0.3 }}
        {contact}
        body.block = {{ material = 'rubber', shape.box = {{ lower = [0, 0], upper = [10, 20] }} }}
        crack.through.segment = {{ from = [-1, 10], to = [11, 10] }}
        set = {{ top.where = 'y > 18', bottom.where = 'y < 2' }}
        condition.hold = {{ set = 'bottom', displacement = ['free', 0] }}
        condition.push = {{ set = 'top', displacement = ['free', '-0.2*ramp(t, 0, 20)'] }}
        history.force.top = {{ set = 'top', direction = [0, -1] }}
        time.end = 80
        "
    )
}

#[test]
fn a_closed_crack_carries_load() {
    let force = |deck: &str| history::<2>(deck, 100, &["force_top"]).last().unwrap()[0];
    let whole = force(&cracked_block("").replace("crack.through", "#"));
    let closed = force(&cracked_block("contact = {}"));
    let open = force(&cracked_block(""));
    assert!(open.abs() < 0.02 * whole, "{open} of {whole}");
    // The contact layer is in series with the 17 m between the supports. The layer has the thickness δ and
    // the modulus E, and the block has the modulus E/(1 − ν²). The ratio is therefore
    // 17/(17 + 3.015/(1 − 1/16)) = 0.84. Softer surfaces at the crack faces reduce this ratio slightly.
    assert!(
        (0.77..0.84).contains(&(closed / whole)),
        "{closed} of {whole}"
    );
}

#[test]
fn bodies_at_rest_feel_no_contact() {
    // Touching and overlapping bodies, and a crack.
    let deck = "
        dimension = '3d'
        grid = { spacing = 1, horizon = 2.5 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        contact.friction = 0.3
        body.first = { material = 'rubber', shape.box = { lower = [0, 0, 0], upper = [5, 5, 5] } }
        body.second = { material = 'rubber', shape.box = { lower = [5, 0, 0], upper = [9, 5, 5] } }
        body.third = { material = 'rubber', spacing = 0.8, shape.sphere = { centre = [2.5, 2.5, 6.4], radius = 2 } }
        crack.slit.rectangle = { corner = [2.5, -1, -1], edge_a = [0, 7, 0], edge_b = [0, 0, 7] }
        time.end = 1
        ";
    simulate::<3, _>(deck, |mut simulation| {
        assert!(simulation.contact.is_some());
        assert_eq!(largest_force(&simulation), 0.0);
        for _ in 0..5 {
            simulation.advance();
        }
        assert_eq!(largest_force(&simulation), 0.0);
    });
}

#[test]
fn steps_become_shorter_before_stiff_contact_and_longer_again() {
    // The right bar starts at a small distance, so that the approach is detected before contact.
    let deck = bars("stiffness = 8e12").replace("lower = [0.1]", "lower = [0.1005]");
    let deck = deck
        .replace("upper = [0.2]", "upper = [0.2005]")
        .replace("60e-6", "150e-6");
    let names = ["time", "kinetic_energy", "energy_error", "touching_pairs"];
    let rows = history::<1>(&deck, 1, &names);
    let touched = rows.iter().position(|row| row[3] > 0.0).unwrap();
    let steps: Vec<f64> = rows
        .windows(2)
        .map(|pair| pair[1][0] - pair[0][0])
        .collect();
    assert!(
        steps[touched] < 0.5 * steps[0],
        "{} {}",
        steps[touched],
        steps[0]
    );
    assert!(
        steps[steps.len() - 2] > 0.7 * steps[0],
        "{:?}",
        steps.last()
    );
    let last = rows.last().unwrap();
    assert!((last[0] - 150e-6).abs() < 1e-17, "{last:?}");
    // With steps that are too long, colliding points would gain twelve times the energy. At the stability
    // limit, opening and closing contact changes the energy by some per cent.
    assert!((last[2] / rows[0][1]).abs() < 0.05, "{last:?}");
}

#[test]
fn a_rigid_body_whose_motion_is_lost_is_named() {
    let deck = "
        dimension = 'plane-strain'
        grid = { spacing = 1, horizon = 3 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        body.block = { material = 'rubber', shape.box = { lower = [0, 0], upper = [8, 4] } }
        rigid.ball = { shape.disc = { centre = [3, 9], radius = 1.6 }, motion = [0, 'sqrt(1 - t)'] }
        time.end = 4
        ";
    simulate::<2, _>(deck, |mut simulation| {
        while !simulation.is_over() {
            simulation.advance();
        }
        let message = simulation.check().unwrap_err().message;
        assert!(
            message.starts_with("[rigid.ball]: its motion is not finite"),
            "{message}"
        );
    });
}

#[test]
fn fragments_are_counted_and_weighed() {
    // A block that two cracks divide into three parts, and a separate point.
    let deck = "
        dimension = '3d'
        grid = { spacing = 1, horizon = 2, volume_correction = 'none' }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        body.block = { material = 'rubber', shape.box = { lower = [0, 0, 0], upper = [9, 2, 2] } }
        body.alone = { material = 'rubber', shape.box = { lower = [20, 0, 0], upper = [21, 1, 1] } }
        crack.first.rectangle = { corner = [3, -1, -1], edge_a = [0, 4, 0], edge_b = [0, 0, 4] }
        crack.second.rectangle = { corner = [5, -1, -1], edge_a = [0, 4, 0], edge_b = [0, 0, 4] }
        initial.fly.velocity = [0.5, 0, 0]
        history.fragments = true
        time.end = 1
        ";
    let names = [
        "fragments",
        "loose_points",
        "largest_fragment_mass",
        "largest_fragment_momentum_x",
    ];
    for ranks in [1, 2, 3] {
        let found = simulate_on::<3, _>(ranks, deck, |mut simulation| {
            let mut observer = HistoryObserver::new(&simulation).unwrap();
            let values = row(&mut observer, &mut simulation).values;
            let ids = simulation.fragment_ids();
            let pieces: BTreeSet<u64> = ids.into_iter().map(|id| id as u64).collect();
            (names.map(|name| values[column(&observer, name)]), pieces)
        });
        let pieces: BTreeSet<u64> = found
            .iter()
            .flat_map(|(_, pieces)| pieces)
            .copied()
            .collect();
        assert_eq!(pieces.len(), 4, "on {ranks} ranks");
        for (values, _) in found {
            assert_eq!(
                values,
                [3.0, 1.0, 2.0 * 16.0, 2.0 * 16.0 * 0.5],
                "on {ranks} ranks"
            );
        }
    }
}

/// Return the deck of a block that moves towards a floor or, in 1-D, between two walls.
fn falling(dimension: &str, floor: &str, time: &str) -> String {
    let (lower, upper, velocity) = match dimension {
        "1d" => ("[0]", "[4]", "[-0.05]"),
        _ => ("[0, 0]", "[20, 10]", "[0, -0.05]"),
    };
    format!(
        "dimension = '{dimension}'
        grid = {{ spacing = 1, horizon = 3 }}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.block = {{ material = 'rubber', shape.box = {{ lower = {lower}, upper = {upper} }} }}
        initial.fall.velocity = {velocity}
        {floor}
        time = {time}
        "
    )
}

/// Return the largest error of the energy balance in all steps, divided by the energy at the start.
fn largest_error<const D: usize>(deck: &str) -> f64 {
    let rows = history::<D>(deck, 1, &["kinetic_energy", "energy_error"]);
    let errors = rows.iter().map(|row| row[1].abs() / rows[0][0]);
    errors.fold(0.0, f64::max)
}

#[test]
fn adaptive_steps_stay_short_during_stiff_contact() {
    for stiffness in [5, 100, 500] {
        let floor = format!(
            "rigid.floor = {{ half_space = {{ through = [0, -1], normal = [0, 1] }}, stiffness = {stiffness} }}"
        );
        for time in ["{ end = 80 }", "{ end = 80, adaptive = {} }"] {
            // Opening and closing contact at the stability limit changes the energy by some per cent. Steps
            // that ignore the contact create 100 times the energy at a stiffness of 500.
            let error = largest_error::<2>(&falling("plane-strain", &floor, time));
            assert!(error < 0.1, "{stiffness} {time}: {error}");
        }
    }
}

#[test]
fn steps_do_not_grow_into_the_next_contact() {
    for gap in [0.5, 0.7, 0.93, 1.1, 1.1325, 1.3, 1.7] {
        let walls = format!(
            "rigid.left = {{ half_space = {{ through = [-{gap}], normal = [1] }}, stiffness = 2500 }}
            rigid.right = {{ half_space = {{ through = [4 + {gap}], normal = [-1] }}, stiffness = 2500 }}"
        );
        let walls = walls
            .replace("4 + ", "'4 + ")
            .replace("], normal = [-1]", "'], normal = [-1]");
        // The bar vibrates and meets the walls many times. At the stability limit, this changes the energy by
        // up to half. A step that grows into a contact multiplies it by 100 and more.
        let error = largest_error::<1>(&falling("1d", &walls, "{ end = 200 }"));
        assert!(error < 0.6, "{gap}: {error}");
    }
}

/// Without `[contact]`, points touch only the rigid body.
#[test]
fn bonds_break_under_a_rigid_body_in_adaptive_steps() {
    let deck = "
        dimension = 'plane-strain'
        grid = { spacing = 1, horizon = 3 }
        material.glass.pmb = { density = 2, youngs_modulus = 5 }
        damage.brittle.critical_stretch.critical_stretch = 0.03
        body.block = { material = 'glass', damage = 'brittle', shape.box = { lower = [0, 0], upper = [30, 10] } }
        rigid.punch = { shape.disc = { centre = [15, 12.001], radius = 2 }, motion = [0, '-0.1*t'] }
        time = { end = 20, adaptive = {} }
        ";
    let rows = history::<2>(deck, 1, &["broken_bonds", "undone_steps"]);
    let last = rows.last().unwrap();
    assert!(last[0] > 0.0 && last[1] > 0.0, "{last:?}");
}
