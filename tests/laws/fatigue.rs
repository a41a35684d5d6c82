//! The law with fatigue of bonds: the life of one bond, Basquin's line of a plate, Paris' law of a crack, and
//! the energy of bonds that break.

use crate::support::history::{column, row, rows_to_the_end};
use crate::support::{displace, forces, simulate};
use fissure::solver::Simulation;
use fissure::solver::bonds::BondUpdate;
use fissure::solver::observers::HistoryObserver;

/// Young's modulus, Pa.
const MODULUS: f64 = 5.0;

fn law(keys: &str) -> String {
    format!("fatigue_pmb = {{ density = 2, youngs_modulus = {MODULUS}, {keys} }}")
}

/// Return the deck of two points 1 m apart with one bond.
fn pair(law: &str, damage: &str) -> String {
    let of_body = if damage.is_empty() {
        ""
    } else {
        "damage = 'brittle',"
    };
    format!(
        "dimension = '1d'
        grid = {{ volume_correction = 'none', spacing = 1, horizon = 1.5 }}
        material.steel.{law}
        {damage}
        body.bar = {{ material = 'steel', {of_body} shape.box = {{ lower = [0], upper = [2] }} }}
        time.end = 1
        "
    )
}

/// Apply blocks of load cycles of this duration (s) at a stretch. Return the number of blocks until the bond
/// is broken; `None` if `most` blocks do not break it.
fn blocks(simulation: &mut Simulation<1>, stretch: f64, [duration, most]: [f64; 2]) -> Option<f64> {
    displace(simulation, |x| x.map(|x| x * (1.0 + stretch)));
    for block in 1..=most as u64 {
        // Forces of a trial step do not use up life.
        simulation.evaluate(BondUpdate::Trial(1e3 * duration));
        simulation.evaluate(BondUpdate::Step(duration));
        if simulation.fields.broken_bonds.as_ref().unwrap()[0] > 0.0 {
            return Some(block as f64);
        }
    }
    None
}

#[test]
fn a_bond_breaks_after_its_life_within_one_block() {
    for (coefficient, exponent, limit, ratio) in [
        (2e4, 2.0, 0.0, 0.0),
        (3e6, 3.5, 2e-3, 0.0),
        (1e5, 2.5, 1e-3, 0.4),
        (1e5, 3.0, 0.0, -1.0),
    ] {
        let keys = format!(
            "cycles_per_second = 50, fatigue_coefficient = {coefficient}, fatigue_exponent = {exponent}, \
             fatigue_limit = {limit}, load_ratio = {ratio}"
        );
        for stretch in [4e-3, 6e-3, 0.01] {
            simulate::<1, _>(&pair(&law(&keys), ""), |mut simulation| {
                let strain = (1.0 - ratio) * stretch;
                let life = 1.0 / (coefficient * libm::pow(strain - limit, exponent));
                // A block has slightly more than one hundredth of the life, so the bond breaks within the
                // 100th block.
                let cycles = life / 99.5;
                let found = blocks(&mut simulation, stretch, [cycles / 50.0, 200.0]).unwrap();
                assert_eq!(found, 100.0, "{keys} {stretch}");
            });
        }
    }
}

#[test]
fn a_bond_releases_its_energy() {
    let keys = "cycles_per_second = 1, fatigue_coefficient = 1, fatigue_exponent = 1";
    simulate::<1, _>(&pair(&law(keys), ""), |mut simulation| {
        displace(&mut simulation, |x| x.map(|x| x * 1.01));
        let volume = simulation.model.volume[0];
        let stored = simulation.forces.stored(&simulation.model);
        let energy = |density: &[f64]| volume * density.iter().sum::<f64>();
        let before = energy(&stored.energy);
        assert!(before > 0.0);
        assert_eq!(blocks(&mut simulation, 0.01, [200.0, 1.0]), Some(1.0));
        let stored = simulation.forces.stored(&simulation.model);
        let freed: f64 = simulation.fields.freed_energy.iter().flatten().sum();
        assert_eq!(
            [energy(&stored.energy), energy(&stored.dissipated)],
            [0.0; 2]
        );
        assert!((freed / before - 1.0).abs() < 1e-12, "{freed} {before}");
        // A bond that breaks by fatigue has not exceeded a threshold.
        let overshoot = simulation.fields.overshoot_energy.as_ref().unwrap();
        assert_eq!(overshoot, &[0.0; 2]);
    });
}

#[test]
fn blocks_of_different_strains_add_up() {
    // Miner's rule: 40 % of the life at one strain, then 60 % at another strain.
    let keys = "cycles_per_second = 1, fatigue_coefficient = 1e6, fatigue_exponent = 3";
    simulate::<1, _>(&pair(&law(keys), ""), |mut simulation| {
        let life = |stretch: f64| 1e-6 / stretch.powi(3);
        let [low, high] = [0.005, 0.01];
        let first = blocks(&mut simulation, low, [0.01 * life(low), 40.0]);
        assert_eq!(first, None);
        let second = blocks(&mut simulation, high, [0.01 * life(high), 70.0]).unwrap();
        assert!((59.0..=61.0).contains(&second), "{second}");
    });
}

#[test]
fn a_bond_below_the_limit_or_in_compression_lives_forever() {
    let keys = "cycles_per_second = 1, fatigue_coefficient = 1e9, fatigue_exponent = 1, \
                fatigue_limit = 0.01, load_ratio = 0.5";
    simulate::<1, _>(&pair(&law(keys), ""), |mut simulation| {
        for stretch in [0.0199, -0.3] {
            assert_eq!(blocks(&mut simulation, stretch, [1e9, 5.0]), None);
        }
        assert_eq!(blocks(&mut simulation, 0.0201, [1e9, 5.0]), Some(1.0));
    });
}

#[test]
fn with_reversed_loads_both_signs_use_up_the_same_life() {
    let keys =
        "cycles_per_second = 1, fatigue_coefficient = 1e4, fatigue_exponent = 2, load_ratio = -1";
    let found = [0.01, -0.01].map(|stretch| {
        simulate::<1, _>(&pair(&law(keys), ""), |mut simulation| {
            blocks(&mut simulation, stretch, [0.03, 20.0])
        })
    });
    // A block uses 0.03 · 1e4 · 0.02² = 0.12 of the life.
    assert_eq!(found, [Some(9.0); 2]);
}

#[test]
fn a_step_of_length_zero_uses_up_no_life() {
    // The cyclic strain overflows when it is squared.
    let keys = "cycles_per_second = 1e300, fatigue_coefficient = 1e300, fatigue_exponent = 2, load_ratio = -1e300";
    simulate::<1, _>(&pair(&law(keys), ""), |mut simulation| {
        displace(&mut simulation, |x| x.map(|x| x * 1.01));
        simulation.evaluate(BondUpdate::Step(0.0));
        assert_eq!(simulation.fields.broken_bonds.as_ref().unwrap(), &[0.0; 2]);
        assert_eq!(blocks(&mut simulation, 0.01, [1.0, 3.0]), Some(1.0));
    });
}

#[test]
fn the_damage_law_breaks_bonds_too() {
    let keys = "cycles_per_second = 1, fatigue_coefficient = 1, fatigue_exponent = 1";
    let damage = "damage.brittle.critical_stretch.critical_stretch = 0.05";
    simulate::<1, _>(&pair(&law(keys), damage), |mut simulation| {
        assert_eq!(blocks(&mut simulation, 0.049, [0.0, 5.0]), None);
        displace(&mut simulation, |x| x.map(|x| x * 1.051));
        assert_eq!(simulation.fields.broken_bonds.as_ref().unwrap(), &[1.0; 2]);
    });
}

#[test]
fn with_life_left_it_is_the_prototype_law_to_the_last_bit() {
    let run = |law: &str| {
        let deck = format!(
            "dimension = 'plane-strain'
            grid = {{ spacing = 1, horizon = 3, volume_correction = 'exact' }}
            material.steel.{law}
            damage.brittle.critical_stretch = {{ critical_stretch = 0.03, alpha = 0.2 }}
            body.block = {{ material = 'steel', damage = 'brittle', shape.box = {{ lower = [0, 0], upper = [18, 16] }} }}
            time.end = 1
            "
        );
        simulate::<2, _>(&deck, |mut simulation| {
            displace(&mut simulation, |[x, y, z]| {
                [x + 0.05 * (0.7 * x).sin(), y + 0.05 * (0.5 * x).cos(), z]
            });
            let broken = simulation.fields.broken_bonds.clone().unwrap();
            assert!(broken.iter().any(|count| *count > 0.0));
            (forces(&simulation), broken)
        })
    };
    let keys = "cycles_per_second = 1, fatigue_coefficient = 1, fatigue_exponent = 2";
    let pmb = format!("pmb = {{ density = 2, youngs_modulus = {MODULUS} }}");
    assert!(run(&law(keys)) == run(&pmb));
}

/// Return the deck of two bonded bodies, of which the upper one has fatigue. `bonds` has the settings of the
/// bonds between the bodies.
fn joined(bonds: &str) -> String {
    let keys = "cycles_per_second = 1, fatigue_coefficient = 1, fatigue_exponent = 1";
    format!(
        "dimension = '1d'
        grid = {{ volume_correction = 'none', spacing = 1, horizon = 1.5 }}
        material.steel.{}
        material.grip.pmb = {{ density = 2, youngs_modulus = {MODULUS} }}
        {bonds}
        body.grip = {{ material = 'grip', shape.box = {{ lower = [0], upper = [2] }} }}
        body.bar = {{ material = 'steel', shape.box = {{ lower = [2], upper = [4] }} }}
        time.end = 1
        ",
        law(keys)
    )
}

#[test]
fn bonds_between_bodies_wear_out_unless_they_are_unbreakable() {
    let unbreakable = "interface.pair.joint = { bodies = ['grip', 'bar'], damage = 'none' }";
    for (bonds, expected) in [
        ("", [0.0, 1.0, 2.0, 1.0]),
        (unbreakable, [0.0, 0.0, 1.0, 1.0]),
    ] {
        simulate::<1, _>(&joined(bonds), |mut simulation| {
            displace(&mut simulation, |x| x.map(|x| x * 1.01));
            simulation.evaluate(BondUpdate::Step(1e3));
            let broken = simulation.fields.broken_bonds.as_ref().unwrap();
            assert_eq!(broken, &expected, "{bonds}");
        });
    }
}

/// Number of load steps of the plate.
const STEPS: u32 = 120;

/// Return the deck of a plate that is held at a constant elongation from the end of the first load step on.
/// Load steps have a length of 1 s.
fn plate(keys: &str, strain: f64) -> String {
    format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 1, horizon = 3, volume_correction = 'exact' }}
        material.steel.{}
        body.plate = {{ material = 'steel', shape.box = {{ lower = [0, 0], upper = [10, 24] }} }}
        set.ends.where = 'y < 3 || y > 21'
        condition.pull = {{ set = 'ends', displacement = [0, '{strain}*min(t, 1)*(y - 12)'] }}
        time = {{ end = {STEPS}, method = 'static', static = {{ load_steps = {STEPS}, tolerance = 1e-6 }} }}
        ",
        law(keys)
    )
}

/// Return the numbers of cycles until the plate has its first broken bond, and until it has released half of
/// the fracture energy of the whole run. A bond at a strain of 1e-3 lives 1e5 cycles.
fn lives(exponent: f64, strain: f64) -> [f64; 2] {
    let life = 1e5 * libm::pow(strain / 1e-3, -exponent);
    let (cycles, coefficient) = (life / 60.0, 1e-5 * libm::pow(1e3, exponent));
    let keys = format!(
        "cycles_per_second = {cycles}, fatigue_coefficient = {coefficient}, fatigue_exponent = {exponent}"
    );
    simulate::<2, _>(&plate(&keys, strain), |mut simulation| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let rows = rows_to_the_end(&mut observer, &mut simulation);
        let [time, broken, fracture, error, work] = [
            "time",
            "broken_bonds",
            "fracture_energy",
            "energy_error",
            "external_work",
        ]
        .map(|name| column(&observer, name));
        let last = &rows[rows.len() - 1];
        // Energy is missing only where a real body would radiate waves.
        let missing = -last[error] / last[work];
        assert!(missing > -1e-6 && missing < 1.0, "{last:?}");
        let first = |column: usize, least: f64| {
            let row = rows.iter().find(|row| row[column] > least);
            row.unwrap_or_else(|| panic!("no bond breaks: {strain}"))[time]
        };
        let half = 0.5 * last[fracture];
        [first(broken, 0.0), first(fracture, half)].map(|blocks| blocks * cycles)
    })
}

#[test]
fn the_lives_of_a_plate_lie_on_a_line_of_basquin() {
    for exponent in [2.0, 4.0] {
        let [low, high] = [5e-4, 2e-3].map(|strain| lives(exponent, strain));
        for (low, high) in low.into_iter().zip(high) {
            let slope = -libm::log(4.0) / libm::log(low / high);
            // A life is a whole number of blocks, about 30 to 60, which limits the accuracy.
            assert!((slope * exponent + 1.0).abs() < 0.02, "{exponent}: {slope}");
        }
    }
}

/// Let a crack grow along the middle of a strip whose edges are moved apart. `strain` is the strain of the
/// strip between the edges. Return the mean J integral (J/m²) during the growth, and the number of broken
/// bonds per load step. J of the strip does not depend on the length of the crack.
fn growth(exponent: f64, strain: f64) -> [f64; 2] {
    // A bond at a strain of 0.01 lives for one load step.
    let coefficient = libm::pow(100.0, exponent);
    let keys = format!(
        "cycles_per_second = 1, fatigue_coefficient = {coefficient}, fatigue_exponent = {exponent}"
    );
    let deck = format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 1, horizon = 3, volume_correction = 'exact' }}
        material.steel.{}
        material.elastic.pmb = {{ density = 2, youngs_modulus = {MODULUS} }}
        body.lower = {{ material = 'elastic', shape.box = {{ lower = [0, -17], upper = [40, -3] }} }}
        body.middle = {{ material = 'steel', shape.box = {{ lower = [0, -3], upper = [40, 3] }} }}
        body.upper = {{ material = 'elastic', shape.box = {{ lower = [0, 3], upper = [40, 17] }} }}
        crack.notch.segment = {{ from = [-1, 0], to = [11, 0] }}
        set.edges.where = 'abs(y) > 14'
        condition.pull = {{ set = 'edges', displacement = [0, '{strain}*min(t, 1)*14*(2*(y > 0) - 1)'] }}
        history.j_integral.tip = {{ lower = [3, -17], upper = [33, 17] }}
        time = {{ end = 400, method = 'static', static = {{ load_steps = 400, tolerance = 1e-6 }} }}
        ",
        law(&keys)
    );
    simulate::<2, _>(&deck, |mut simulation| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let [broken, j_integral] =
            ["broken_bonds", "j_integral_tip"].map(|name| column(&observer, name));
        // When the first bonds break, the bonds ahead of the notch have worn less than those ahead of a
        // growing crack. The measurement therefore begins after a growth of about one horizon.
        let mut start = None;
        let mut sum = 0.0;
        loop {
            simulation.advance();
            simulation.check().unwrap_or_else(|error| panic!("{error}"));
            if !simulation.progress.load_step.is_settled {
                continue;
            }
            let values = row(&mut observer, &mut simulation).values;
            let (time, broken) = (simulation.clock.time(), values[broken]);
            if broken < 80.0 {
                continue;
            }
            let (first, before) = *start.get_or_insert((time, broken));
            sum += values[j_integral];
            if broken >= 180.0 {
                let steps = time - first;
                return [sum / (steps + 1.0), (broken - before) / steps];
            }
        }
    })
}

#[test]
fn a_crack_grows_by_the_law_of_paris() {
    // ΔK is proportional to √J.
    for (exponent, strains) in [(3.0, [1.5e-3, 2.25e-3]), (4.0, [1.8e-3, 2.7e-3])] {
        let [slow, fast] = strains.map(|strain| growth(exponent, strain));
        let slope = libm::log(fast[1] / slow[1]) / libm::log((fast[0] / slow[0]).sqrt());
        // A crack that grows by several bonds per block is a little too slow.
        let error = (slope - exponent).abs();
        assert!(error < 0.08 * exponent, "{exponent}: {slope}");
    }
}
