//! The PMMA plate of Willberg, Hesse & Heinecke (2022) on a coarse grid. For the crack path on finer grids,
//! see studies/pmma/run.py and docs/src/verification/pmma.md.

use fissure::solver::Simulation;
use fissure::solver::observers::{Branch, HistoryObserver, Snapshot};

use crate::support::history::column;
use crate::support::simulate_input;

const SPACING: f64 = 2e-3;

/// Position of the notch tip, m.
const TIP: [f64; 2] = [64.6e-3, 18.9e-3];

/// Quantities recorded at intervals.
struct Seen {
    /// Displacement of the right side, m.
    displacement: f64,
    /// Force that moves the right side, N.
    force: f64,
    /// Reaction of the left side, N.
    held: f64,
    /// Length of the crack, m.
    length: f64,
    /// Positions of damaged points outside the notch, m.
    damaged: Vec<[f64; 3]>,
    branches: Vec<Branch>,
}

fn look(observer: &mut HistoryObserver, simulation: &mut Simulation<2>, notch: &[usize]) -> Seen {
    let snapshot = Snapshot::new(simulation);
    let row = observer.row(simulation, &snapshot).values;
    let of = |name: &str| row[column(observer, name)];
    let damage = |point: usize| snapshot.damage(&simulation.undeformed.family_volume, point);
    let damaged = (0..simulation.model.owned())
        .filter(|point| damage(*point) > 0.35 && !notch.contains(point))
        .map(|point| simulation.model.position(point))
        .collect();
    Seen {
        displacement: -of("probe_right_displacement_x"),
        force: of("force_push"),
        held: of("force_hold"),
        length: of("crack_main_length"),
        damaged,
        branches: observer.crack_paths(simulation, &snapshot).remove(0).1,
    }
}

#[test]
fn a_coarse_plate_cracks_from_the_tip_of_its_notch() {
    let parameters = [
        ("dx", "2e-3"),
        ("speed", "0.1"),
        ("fracture_energy", "100"),
        ("end_displacement", "0.35e-3"),
    ];
    simulate_input::<2, _>("pmma_mixed_mode", &parameters, |mut simulation| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let snapshot = Snapshot::new(&mut simulation);
        let damage = |point: usize| snapshot.damage(&simulation.undeformed.family_volume, point);
        let points = 0..simulation.model.owned();
        let notch: Vec<usize> = points.filter(|point| damage(*point) > 0.35).collect();
        assert!(notch.len() > 10);
        let mut seen = vec![look(&mut observer, &mut simulation, &notch)];
        while simulation.clock.number() < simulation.clock.last() {
            simulation.advance();
            if simulation.clock.number() % 5 == 0 {
                seen.push(look(&mut observer, &mut simulation, &notch));
            }
        }
        assert_eq!(seen[0].length, 0.0);

        // Before the first bond breaks, the stiffness is that of the uncracked plate, 10.8 kN/mm. The forces
        // on both sides are equal, except for waves.
        let elastic: Vec<&Seen> = seen
            .iter()
            .filter(|seen| (0.1e-3..0.2e-3).contains(&seen.displacement))
            .collect();
        assert!(elastic.len() > 5);
        let mean = |of: fn(&Seen) -> f64| {
            elastic.iter().map(|seen| of(seen)).sum::<f64>() / elastic.len() as f64
        };
        let stiffness = mean(|seen| seen.force / seen.displacement);
        assert!((10.3e6..11.3e6).contains(&stiffness), "{stiffness} N/m");
        let ratio = mean(|seen| seen.held) / mean(|seen| seen.force);
        assert!((ratio - 1.0).abs() < 0.05, "{ratio}");

        // Damage begins within two horizons of the tip, and the crack grows to the left and up.
        let first = seen.iter().find(|seen| !seen.damaged.is_empty()).unwrap();
        for [x, y, _] in &first.damaged {
            let distance = (x - TIP[0]).hypot(y - TIP[1]);
            assert!(distance < 6.0 * SPACING, "damage at {x}, {y}");
        }
        let last = seen.last().unwrap();
        assert!(last.length > 3.0 * SPACING, "{} m long", last.length);
        let tip = last.branches[0].last().unwrap();
        assert!(tip.place[0] < TIP[0] - 2.0 * SPACING, "{tip:?}");
        assert!((tip.along - last.length).abs() < 1e-12 || last.branches.len() > 1);
    });
}
