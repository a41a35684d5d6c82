//! Edge-on impact on ALON, Diehl & Schweitzer (2016): cheap variants of the deck.
//! docs/src/verification/eoi_alon.md has the fronts at finer spacings.

use crate::support::history::{column, row};
use crate::support::{simulate, simulate_input};
use fissure::solver::Simulation;
use fissure::solver::observers::HistoryObserver;

const DENSITY: f64 = 3690.0;

/// Return the classical wave speed √(1.8 K/ρ), m/s.
fn classical() -> f64 {
    (1.8_f64 * 210e9 / DENSITY).sqrt()
}

/// Return the deck with some texts replaced.
fn deck(changes: &[(&str, &str)]) -> String {
    let mut text = include_str!("../../inputs/eoi_alon.toml").to_owned();
    for (old, new) in changes {
        assert_eq!(text.matches(old).count(), 1, "{old}");
        text = text.replace(old, new);
    }
    text
}

/// Time (s), wave front (m), damage front (m) and length of the farthest crack (m).
type Row = [f64; 4];

/// Return a row for each step.
fn run(deck: &str) -> Vec<Row> {
    simulate::<3, _>(deck, |simulation| {
        rows(
            simulation,
            ["time", "front_wave", "front_damage", "tip_farthest_length"],
        )
    })
}

/// Return columns of the history after each step.
fn rows<const N: usize>(mut simulation: Simulation<'_, 3>, names: [&str; N]) -> Vec<[f64; N]> {
    let mut observer = HistoryObserver::new(&simulation).unwrap();
    let columns = names.map(|name| column(&observer, name));
    let mut rows = Vec::new();
    while !simulation.is_over() {
        simulation.advance();
        let values = row(&mut observer, &mut simulation).values;
        rows.push(columns.map(|column| values[column]));
    }
    rows
}

/// Return the speed (m/s) of the wave or damage front between two positions (m), by least squares.
fn speed(rows: &[Row], front: usize, from: f64, to: f64) -> f64 {
    let inside = rows.iter().filter(|row| (from..to).contains(&row[front]));
    let pairs: Vec<(f64, f64)> = inside.map(|row| (row[0], row[front])).collect();
    assert!(pairs.len() >= 6, "{} rows", pairs.len());
    let count = pairs.len() as f64;
    let mean_time = pairs.iter().map(|pair| pair.0).sum::<f64>() / count;
    let mean_place = pairs.iter().map(|pair| pair.1).sum::<f64>() / count;
    let products = pairs
        .iter()
        .map(|(t, x)| (t - mean_time) * (x - mean_place));
    let squares = pairs.iter().map(|(t, _)| (t - mean_time).powi(2));
    products.sum::<f64>() / squares.sum::<f64>()
}

const WAVE: usize = 1;
const DAMAGE: usize = 2;
const TIP: usize = 3;

#[test]
fn in_the_bulk_the_wave_has_the_speed_of_the_lattice() {
    // A block with a load on a whole side. Waves from the lateral sides, 20 mm from the centre line, start at
    // most one horizon (4 mm at m = 4) inside these sides. When the front is at 22 mm, waves of the same
    // speed have reached at most √(22² − 16²) mm = 15 mm on the centre line.
    for (law, horizon, ratio) in [
        ("pmb", "3", 1.028),
        ("pmb", "4", 0.967),
        ("normalised_pmb", "3", 0.971),
    ] {
        let expected = ratio * classical();
        // The front of a dispersing step has the shape of the integral of the Airy function Ai. At the
        // position of the longest waves, the step has a third of its height p/(ρ c).
        let pressure = 1.267e9;
        let third = pressure / (DENSITY * expected) / 3.0;
        let text = deck(&[
            ("[material.alon.pmb]", &format!("[material.alon.{law}]")),
            ("m = 3 ", &format!("m = {horizon} ")),
            ("length = 0.1 ", "length = 0.027"),
            ("width = 0.1 ", "width = 0.04 "),
            ("thickness = 0.01 ", "thickness = 'width' "),
            ("patch = 0.03 ", "patch = 'width' "),
            ("load = 3.8e5 ", &format!("load = '{pressure}*width^2' ")),
            ("arrival = 1 ", &format!("arrival = {third} ")),
            ("duration = 8.7e-6", "duration = 2.3e-6"),
        ]);
        let found = speed(&run(&text), WAVE, 8e-3, 22e-3);
        // The position of the front is interpolated linearly between points. The error is up to a tenth of a
        // spacing at each end of a path of 14 spacings.
        assert!(
            (found / expected - 1.0).abs() < 0.01,
            "{law}, m = {horizon}: {} of the classical speed",
            found / classical()
        );
    }
}

#[test]
fn in_the_tile_a_wave_runs_ahead_of_damage() {
    // Speeds of long waves of this lattice between free faces, from `long_waves` of studies/eoi/run.py.
    // That function minimises the energy of the tile's layers.
    for (law, long_wave) in [
        ("pmb]", 8925.0),
        ("normalised_pmb]", 9760.0),
        ("normalised_pmb]\nform = 'diehl2016'", 7048.0),
    ] {
        let rows = run(&deck(&[("dx = 1e-3", "dx = 2e-3"), ("pmb]", law)]));
        let wave = speed(&rows, WAVE, 30e-3, 90e-3);
        // The front is where the velocity exceeds 1 m/s. The velocity of the wave is at most p/(ρc) = 35 to
        // 49 m/s, depending on the law. The front has the shape ∫Ai and the width w = (3βct)^⅓, with β =
        // δ²/50 (lattice) + ν²h²/(24 (1 − ν)²) (tile) = 1.2 mm². The velocity of 1 m/s is up to 2.0 w ahead
        // of the longest waves. At ct = 60 mm, w is 6 mm, and this lead grows by up to 2.0 β/w² = 7 % of the
        // path.
        assert!(
            (1.0..1.07).contains(&(wave / long_wave)),
            "{law}: {wave} m/s, long waves {long_wave} m/s"
        );
        let damage = speed(&rows, DAMAGE, 20e-3, 50e-3);
        assert!(
            (0.85..1.0).contains(&(damage / wave)),
            "{law}: damage {damage} m/s, wave {wave} m/s"
        );
        let damaged: Vec<&Row> = rows.iter().filter(|row| row[DAMAGE] > 0.0).collect();
        assert!(damaged.len() > 20);
        for row in &damaged {
            assert!(row[DAMAGE] < row[WAVE], "damage overtakes the wave");
            // The damage front in the middle of a face cannot be ahead of the farthest crack; 2 mm allow for
            // the interpolation.
            assert!(row[DAMAGE] < row[TIP] + 2e-3, "{row:?}");
        }
        for pair in damaged.windows(2) {
            assert!(pair[0][DAMAGE] <= pair[1][DAMAGE], "damage does not heal");
        }
    }
}

#[test]
fn the_constant_of_equation_15_in_the_force_of_equation_4_gives_no_wave() {
    // The constant 27K/(4πδ³) of eq. 15 lacks a division by a length. It is 3δ/8 = 0.00225 (δ in m) times the
    // constant of `pmb`, so long waves would travel only 4 mm. All moving points are within a horizon of the
    // loaded layer, which the load pushes up to 6 mm into the tile.
    let rows = run(&deck(&[
        ("dx = 1e-3", "dx = 2e-3"),
        (
            "bulk_modulus = 210e9 ",
            "bulk_modulus = '210e9*0.375*m*dx' ",
        ),
        ("fracture_toughness = 2e6 ", "critical_stretch = 6e-5 "),
        ("end = \"duration\"", "end = 'duration'\nstep = 2e-7"),
    ]));
    let end = rows.last().unwrap();
    assert!(end[WAVE] < 15e-3, "{end:?}");
    let with_length = run(&deck(&[
        ("dx = 1e-3", "dx = 2e-3"),
        ("pmb]", "normalised_pmb]\nform = 'diehl2016'"),
    ]));
    assert!(with_length.last().unwrap()[WAVE] > 60e-3);
}

#[test]
fn a_projectile_makes_the_fronts_of_the_prescribed_load() {
    let prescribed = run(&deck(&[("dx = 1e-3", "dx = 2e-3")]));
    let speeds = |rows: &[Row]| {
        let damage = speed(rows, DAMAGE, 20e-3, 50e-3);
        [speed(rows, WAVE, 30e-3, 90e-3), damage]
    };
    let wanted = speeds(&prescribed);
    // At 67 m/s the force of the projectile equals the prescribed load; at 380 m/s it is five times as large.
    for (velocity, load) in [("67", 3.8e5), ("380", 1.9e6)] {
        let set = [("dx", "2e-3"), ("shot", "24e-3"), ("speed", velocity)];
        simulate_input::<3, _>("edge_on_impact", &set, |simulation| {
            let names = [
                "time",
                "front_wave",
                "front_damage",
                "tip_farthest_length",
                "contact_impact_force_x",
            ];
            let all = rows(simulation, names);
            let fronts: Vec<Row> = all
                .iter()
                .map(|row| [row[0], row[1], row[2], row[3]])
                .collect();
            let found = speeds(&fronts);
            for (found, wanted) in found.into_iter().zip(wanted) {
                assert!((found / wanted - 1.0).abs() < 0.08, "{found} {wanted}");
            }
            assert!(found[1] < found[0], "{found:?}");
            // Force on the projectile against its motion: the mean after the first microsecond.
            let late: Vec<f64> = all
                .iter()
                .filter(|row| row[0] > 1e-6)
                .map(|row| -row[4])
                .collect();
            let force = late.iter().sum::<f64>() / late.len() as f64;
            assert!((force / load - 1.0).abs() < 0.1, "{force} for {load}");
        });
    }
}
