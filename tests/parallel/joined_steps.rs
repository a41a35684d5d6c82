//! Fused steps, which need one loop over the points per step, give the bits of separate steps.

use crate::support::history::row;
use crate::support::simulate_on;
use fissure::comm::IdOrder;
use fissure::solver::motion::Saved;
use fissure::solver::observers::HistoryObserver;
use fissure::solver::{Simulation, Stepper};

/// Return the deck of two adjacent sheets of different density, with bonds in lattices and a list between
/// them, or all in lists. The number of points is not a multiple of the piece of work of a thread.
fn sheets(family: &str, more: &str) -> String {
    format!(
        "dimension = 'plane-stress'
        grid = {{ volume_correction = 'none', spacing = 1, horizon = 3, family = '{family}' }}
        material.light.pmb = {{ density = 2, youngs_modulus = 5, damping = DAMPING }}
        material.heavy.pmb = {{ density = 7, youngs_modulus = 9 }}
        damage.brittle.critical_stretch = {{ critical_stretch = 0.03, alpha = 0.25 }}
        body.left = {{ material = 'light', damage = 'brittle', shape.box = {{ lower = [0, 0], upper = [37, 40] }} }}
        body.right = {{ material = 'heavy', damage = 'brittle', shape.box = {{ lower = [37, 0], upper = [71, 40] }} }}
        crack.notch.segment = {{ from = [-1, 20], to = [12, 20] }}
        initial.shake.velocity = ['0.04*sin(0.2*x + 0.1*y)', '0.06*tanh(y - 20)']
        {more}
        "
    )
}

/// Loads and supports on parts of the sheets, in two stages.
const CONDITIONS: &str = "
    set.top.where = 'y > 38'
    set.bottom.where = 'y < 2'
    set.edge.where = 'x > 60'
    set.corner.where = 'x < 8 && y < 4'
    set.drop.where = 'hypot(x - 9, y - 9) < 3'
    condition.up = { set = 'top', velocity = ['free', '0.05*ramp(t, 0, 2)'] }
    condition.down = { set = 'bottom', displacement = [0, '-0.02*t*x/71'] }
    condition.push = { set = 'edge', body_force = ['0.01*sin(t)', 0] }
    condition.left_corner = { set = 'corner', displacement = ['0.001*t', 'free'] }
    condition.weight = { set = 'drop', force = [0, '-3'] }
    time = { end = 20, step = 0.2 }
    [[stage]]
    end = 12
    off = ['push']
    [[stage]]
    ";

/// A stage before the others.
const RELAXATION: &str = "[[stage]]
    end = 0.2
    method = 'relaxation'
    relaxation = { load_steps = 1, tolerance = 1e-3 }
    on = ['up', 'down', 'left_corner']
    ";

/// Saved state, bits of the forces, bits of the history row, and number of broken bonds from this row.
type Seen = (Saved, Vec<u64>, Vec<u64>, u64);

/// Run a deck with separate steps (`whole`) or fused steps; return the state after every 25 steps and at the
/// end.
fn run(deck: &str, ranks: usize, whole: bool) -> Vec<Vec<Seen>> {
    simulate_on(ranks, deck, |simulation: Simulation<2>| {
        let owned = simulation.model.owned();
        let (ids, total) = (&simulation.model.ids[..owned], simulation.model.total);
        let order = IdOrder::new(simulation.comm, ids, total);
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let bits = |values: &[f64]| -> Vec<u64> { values.iter().map(|v| v.to_bits()).collect() };
        let mut seen = Vec::new();
        let mut stepper = Stepper::new(simulation);
        let mut step = 0;
        while !stepper.is_over() {
            step += 1;
            stepper.advance();
            if whole {
                stepper.at_full_step();
            }
            if step % 25 == 0 || stepper.is_over() {
                let simulation = stepper.at_full_step();
                let row = row(&mut observer, simulation);
                seen.push((
                    simulation.save(&order),
                    bits(&simulation.fields.internal_force.concat()),
                    bits(&row.values),
                    row.broken,
                ));
            }
        }
        stepper.check().unwrap();
        seen
    })
}

#[test]
fn steps_run_into_one_another() {
    let end = "time = { end = 20, step = 0.2 }";
    let relaxed = CONDITIONS.replacen("[[stage]]", &format!("{RELAXATION}[[stage]]"), 1);
    for family in ["lattice", "list"] {
        for more in [end, CONDITIONS, &relaxed] {
            for damping in ["0", "0.05"] {
                let mut deck = sheets(family, more).replace("DAMPING", damping);
                if more == relaxed {
                    // A run that begins with a relaxation has no initial velocities.
                    deck = deck.replace("initial.shake", "# initial.shake");
                }
                for ranks in [1, 2] {
                    let wanted = run(&deck, ranks, true);
                    let broken = |seen: &Seen| seen.3 > 0;
                    assert!(wanted.iter().flatten().any(broken));
                    assert!(run(&deck, ranks, false) == wanted, "{ranks} ranks: {deck}");
                }
            }
        }
    }
}
