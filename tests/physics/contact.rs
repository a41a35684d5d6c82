//! Bodies without bonds or contact pass through each other. One warning is printed, the same on any number of
//! ranks.

use crate::support::command::{Folder, finish, fissure, text};

/// Return the deck of a ball above a plate; no bond joins them.
fn ball_and_plate(velocity: &str, interface: &str) -> String {
    format!(
        "dimension = 'plane-strain'
        grid = {{ volume_correction = 'none', spacing = 1, horizon = 3 }}
        {interface}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
        [body]
        plate = {{ material = 'rubber', shape.box = {{ lower = [0, 0], upper = [20, 4] }} }}
        far = {{ material = 'rubber', shape.box = {{ lower = [40, 0], upper = [44, 4] }} }}
        ball = {{ material = 'rubber', shape.disc = {{ centre = [10, 12], radius = 3 }} }}
        [initial.fall]
        set = 'ball'
        velocity = {velocity}
        [time]
        step = 0.25
        end = 9
        [history]
        every_steps = 1
        "
    )
}

/// Run a deck, and return its warnings.
fn warnings(ranks: usize, deck: &str) -> Vec<String> {
    let folder = Folder::new("contact");
    let deck = folder.write("deck.toml", deck);
    let mut command = fissure(ranks);
    command.arg("run").arg(&deck).args(["--threads", "1"]);
    command.arg("--output").arg(folder.join("out"));
    let output = finish(&mut command);
    let printed = text(&output);
    assert!(output.status.success(), "{printed}");
    let kinds = ["closer than", "may pass through each other"];
    let lines = printed.lines();
    let lines = lines.filter(|line| kinds.iter().any(|kind| line.contains(kind)));
    lines.map(str::to_owned).collect()
}

#[test]
fn a_collision_that_is_too_fast_for_contact_is_told_once() {
    let deck = |speed: f64| {
        format!(
            "dimension = 'plane-strain'
            grid = {{ spacing = 1, horizon = 3 }}
            contact = {{}}
            material.rubber.pmb = {{ density = 1, youngs_modulus = 1 }}
            [body]
            left = {{ material = 'rubber', shape.box = {{ lower = [0, 0], upper = [12, 6] }} }}
            right = {{ material = 'rubber', shape.box = {{ lower = [14, 3], upper = [26, 9] }} }}
            [initial]
            left = {{ set = 'left', velocity = [{speed}, 0] }}
            right = {{ set = 'right', velocity = [-{speed}, 0] }}
            [time]
            end = 40
            "
        )
    };
    let alone = warnings(1, &deck(0.45));
    assert_eq!(alone.len(), 1, "{alone:?}");
    assert_eq!(warnings(2, &deck(0.45)), alone);
    assert_eq!(warnings(1, &deck(0.1)), [""; 0]);
}

#[test]
fn a_ball_that_goes_through_a_plate_is_told_once() {
    let deck = ball_and_plate("[0, -1]", "");
    let alone = warnings(1, &deck);
    assert_eq!(alone.len(), 1, "{alone:?}");
    // After 5 s the lowest points of the ball, initially at y = 9.5, are one spacing above the highest points
    // of the plate at y = 3.5; then the distance is smaller.
    let expected = "warning: at t = 5.2500e0 s points of `plate` and `ball` are closer";
    assert!(alone[0].starts_with(expected), "{alone:?}");
    let place = alone[0].split(['(', ')']).nth(1).unwrap();
    let place: Vec<f64> = place.split(", ").map(|x| x.parse().unwrap()).collect();
    assert!((7.0..13.0).contains(&place[0]), "{place:?}");
    assert!((place[1] - 3.875).abs() < 1e-3, "{place:?}");
    for ranks in [2, 3] {
        assert_eq!(warnings(ranks, &deck), alone);
    }
}

#[test]
fn bodies_that_stay_apart_or_are_bonded_are_not_told() {
    let apart = ball_and_plate("[0, 1]", "");
    assert_eq!(warnings(2, &apart), [""; 0]);
    // With this horizon, bonds join the ball and the plate.
    let bonded = ball_and_plate("[0, -1]", "").replace("horizon = 3", "horizon = 7");
    assert_eq!(warnings(1, &bonded), [""; 0]);
}

#[test]
fn bodies_kept_apart_by_the_interface_are_watched() {
    // The ball rests on the plate; its points are one spacing above the points of the plate.
    let rest = "interface.rule = 'none'";
    let lying = |velocity| ball_and_plate(velocity, rest).replace("[10, 12]", "[10, 7]");
    assert_eq!(warnings(2, &lying("[0, 0]")), [""; 0]);
    let pressed = warnings(2, &lying("[0, -0.1]"));
    assert_eq!(pressed.len(), 1, "{pressed:?}");
    assert!(pressed[0].contains("`plate` and `ball`"), "{pressed:?}");
}
