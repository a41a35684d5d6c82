//! Steps that are rolled back and repeated give equal bits. The rollback restores broken bonds, the bond
//! history, time, loads, supports and energies.

use crate::support::simulate_on;
use fissure::comm::IdOrder;
use fissure::solver::Simulation;
use fissure::solver::motion::{Kept, Saved};
use fissure::solver::observers::{HistoryObserver, Snapshot};

/// Return the deck of a notched plate that is torn by supports and a load.
fn plate(law: &str, alpha: f64, family: &str) -> String {
    format!(
        "dimension = 'plane-stress'
        grid = {{ volume_correction = 'none', spacing = 1, horizon = 3, family = '{family}' }}
        material.sheet.{law}
        damage.brittle.critical_stretch = {{ critical_stretch = 0.03, alpha = {alpha} }}
        body.plate = {{ material = 'sheet', damage = 'brittle', shape.box = {{ lower = [0, 0], upper = [20, 12] }} }}
        crack.notch.segment = {{ from = [-1, 6], to = [6, 6] }}
        set.top.where = 'y > 10'
        set.bottom.where = 'y < 2'
        set.right.where = 'x > 18'
        condition.up = {{ set = 'top', velocity = ['free', '0.05*ramp(t, 0, 2)'] }}
        condition.down = {{ set = 'bottom', displacement = ['free', '-0.02*t'] }}
        condition.push = {{ set = 'right', body_force = ['0.01*sin(t)', 0] }}
        time = {{ end = 40, step = 0.2 }}
        "
    )
}

/// Observable state of a run: saved state, forces, and the row of the history.
#[derive(Debug, PartialEq)]
struct Seen {
    saved: Saved,
    forces: Vec<u64>,
    row: Vec<u64>,
    clock: (u64, u64),
}

fn see<const D: usize>(
    simulation: &mut Simulation<D>,
    order: &IdOrder,
    observer: &mut HistoryObserver,
) -> Seen {
    let bits = |values: &[f64]| -> Vec<u64> { values.iter().map(|v| v.to_bits()).collect() };
    let snapshot = Snapshot::new(simulation);
    Seen {
        row: bits(&observer.row(simulation, &snapshot).values),
        saved: simulation.save(order),
        forces: bits(&simulation.fields.internal_force.concat()),
        clock: (simulation.clock.number(), simulation.clock.time().to_bits()),
    }
}

/// Assert that steps that are rolled back twice and repeated give equal bits. `happened` checks from the rows
/// before and after the steps that the tested event has occurred.
fn undone_and_made_again(deck: &str, happened: fn(&[f64], &[f64]) -> bool) {
    let ranks = 2;
    let parts = simulate_on(ranks, deck, |mut simulation: Simulation<2>| {
        let owned = simulation.model.owned();
        let (ids, total) = (&simulation.model.ids[..owned], simulation.model.total);
        let order = IdOrder::new(simulation.comm, ids, total);
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        // The count of broken bonds begins with the first row.
        see(&mut simulation, &order, &mut observer);
        let mut steps = |simulation: &mut Simulation<2>, count: usize| {
            for _ in 0..count {
                simulation.advance();
            }
            see(simulation, &order, &mut observer)
        };
        let start = steps(&mut simulation, 120);
        let mut kept = Kept::default();
        simulation.keep(&mut kept);
        let first = steps(&mut simulation, 40);
        for _ in 0..2 {
            simulation.undo(&kept);
            assert_eq!(simulation.save(&order), start.saved);
            assert_eq!(steps(&mut simulation, 40), first);
        }
        // Reuse the buffer for a later state, with steps of another size before the rollback.
        simulation.keep(&mut kept);
        let second = steps(&mut simulation, 20);
        simulation.undo(&kept);
        let size = simulation.clock.step();
        simulation.clock.set_step(0.5 * size);
        let other = steps(&mut simulation, 20);
        assert_ne!(other.saved, second.saved);
        simulation.undo(&kept);
        assert_eq!(steps(&mut simulation, 20), second);
        let numbers = |seen: &Seen| -> Vec<f64> {
            seen.row.iter().map(|bits| f64::from_bits(*bits)).collect()
        };
        happened(&numbers(&start), &numbers(&first))
    });
    assert!(parts.iter().all(|happened| *happened), "{deck}");
}

/// Indices of history columns.
const DISSIPATED: usize = 6;
const BROKEN: usize = 8;

fn breaks(before: &[f64], after: &[f64]) -> bool {
    before[BROKEN] > 0.0 && after[BROKEN] > before[BROKEN]
}

#[test]
fn of_bonds_that_break() {
    let law = "pmb = { density = 2, youngs_modulus = 5, damping = 0.01 }";
    for family in ["lattice", "list"] {
        for alpha in [0.0, 0.25] {
            undone_and_made_again(&plate(law, alpha, family), breaks);
        }
    }
}

#[test]
fn of_points_with_a_dilatation() {
    let law = "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.1 }";
    for family in ["lattice", "list"] {
        undone_and_made_again(&plate(law, 0.25, family), breaks);
    }
}

#[test]
fn of_points_that_flow_while_bonds_break() {
    let law = "correspondence = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3, yield_stress = 0.03, hardening_modulus = 0.2 }";
    let by_rate = ", hardening_exponent = 0.4, strain_rate_coefficient = 0.02, reference_strain_rate = 1e-3 }";
    let stretch = "critical_stretch = { critical_stretch = 0.03";
    let cases = [("lattice", " }"), ("list", " }"), ("lattice", by_rate)];
    for (family, more) in cases {
        let plate = plate(&law.replace(" }", more), 0.0, family).replace(
            stretch,
            "energy = { family_correction = 1, fracture_energy = 0.005",
        );
        undone_and_made_again(&plate, |before, after| {
            breaks(before, after) && after[DISSIPATED] > before[DISSIPATED]
        });
    }
}

#[test]
fn of_bonds_that_yield_and_break() {
    let law = "elastic_plastic_pmb = { density = 2, youngs_modulus = 5, yield_stretch = 0.01 }";
    for family in ["lattice", "list"] {
        undone_and_made_again(&plate(law, 0.0, family), |before, after| {
            breaks(before, after) && after[DISSIPATED] > before[DISSIPATED]
        });
    }
}

#[test]
fn of_bonds_that_soften_and_break() {
    let law = "softening_pmb = { density = 2, youngs_modulus = 5, strength_stretch = 0.01, critical_stretch = 0.03 }";
    for family in ["lattice", "list"] {
        let deck = plate(law, 0.0, family).replace("damage = 'brittle', ", "");
        undone_and_made_again(&deck, |before, after| {
            breaks(before, after) && after[DISSIPATED] > before[DISSIPATED]
        });
    }
}

#[test]
fn of_bonds_that_wear_out_and_break() {
    let law = "fatigue_pmb = { density = 2, youngs_modulus = 5, cycles_per_second = 1, fatigue_coefficient = 1e4, \
               fatigue_exponent = 2 }";
    for family in ["lattice", "list"] {
        let deck = plate(law, 0.0, family).replace("damage = 'brittle', ", "");
        undone_and_made_again(&deck, breaks);
    }
}
