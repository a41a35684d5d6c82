//! The simulations of Emmrich & Weckner 2006, section 4: their decks and the expected results.

use std::collections::HashMap;

use crate::support::history::{column, row};
use crate::support::simulate_input;
use fissure::points::distance_squared;
use fissure::problem::Field;
use fissure::solver::Simulation;
use fissure::solver::observers::{HistoryObserver, Snapshot};

/// Points with more damage than this are on a crack.
const CRACKED: f64 = 0.34;

/// Values of the paper: density (kg/m³), Young's modulus (Pa), Poisson's ratio, size (m) and cells of the
/// plate, and horizon (m).
const DENSITY: f64 = 8000.0;
const YOUNG: f64 = 210e9;
const POISSON: f64 = 0.25;
const SIZE: [f64; 2] = [1.0, 0.3];
const CELLS: [u32; 2] = [24, 8];
const HORIZON: f64 = 0.1;

/// Independent implementation of the paper's equations for the plate: eq. 21 with the force of eq. 9, the
/// constant of eq. 10 and the 4-point Gauss rule. Neighbours are found by a check of all pairs; time
/// integration is the classical Runge–Kutta method.
struct Plate {
    places: Vec<[f64; 2]>,
    weight: f64,
    /// Neighbours of each point with their distances, m.
    families: Vec<Vec<(usize, f64)>>,
    /// Displacement (x, y) and velocity (x, y) of each point.
    state: Vec<[f64; 4]>,
}

impl Plate {
    fn new() -> Self {
        let edges = [SIZE[0] / f64::from(CELLS[0]), SIZE[1] / f64::from(CELLS[1])];
        let mut places = Vec::new();
        for row in 0..CELLS[1] {
            for column in 0..CELLS[0] {
                for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
                    let middle = [f64::from(column) + 0.5, f64::from(row) + 0.5];
                    let shift = 3_f64.sqrt() / 3.0 / 2.0;
                    places.push([
                        (middle[0] + a * shift) * edges[0],
                        (middle[1] + b * shift) * edges[1],
                    ]);
                }
            }
        }
        let distance = |i: usize, j: usize| {
            let [a, b]: [[f64; 2]; 2] = [places[i], places[j]];
            ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)).sqrt()
        };
        let count = places.len();
        let family = |i: usize| {
            let others = (0..count).filter(|j| *j != i);
            let near = others.map(|j| (j, distance(i, j)));
            near.filter(|(_, length)| *length <= HORIZON).collect()
        };
        Self {
            families: (0..count).map(family).collect(),
            state: places
                .iter()
                .map(|place| [0.0, 0.0, 10.0 * (place[0] - 0.5), 0.0])
                .collect(),
            weight: edges[0] * edges[1] / 4.0,
            places,
        }
    }

    fn rate(&self, state: &[[f64; 4]]) -> Vec<[f64; 4]> {
        let bulk = YOUNG / (3.0 * (1.0 - 2.0 * POISSON));
        let constant = 72.0 * bulk / (5.0 * std::f64::consts::PI * HORIZON.powi(3));
        let of = |i: usize| {
            let mut force = [0.0; 2];
            for (j, length) in &self.families[i] {
                let bond: [f64; 2] = std::array::from_fn(|d| {
                    (self.places[*j][d] + state[*j][d]) - (self.places[i][d] + state[i][d])
                });
                let deformed = (bond[0] * bond[0] + bond[1] * bond[1]).sqrt();
                let strength = constant * (deformed - length) / length / deformed;
                force[0] += self.weight * strength * bond[0];
                force[1] += self.weight * strength * bond[1];
            }
            [
                state[i][2],
                state[i][3],
                force[0] / DENSITY,
                force[1] / DENSITY,
            ]
        };
        (0..state.len()).map(of).collect()
    }

    fn advance(&mut self, step: f64) {
        let moved = |rate: &[[f64; 4]], step: f64| -> Vec<[f64; 4]> {
            let pairs = self.state.iter().zip(rate);
            pairs
                .map(|(state, rate)| std::array::from_fn(|k| state[k] + step * rate[k]))
                .collect()
        };
        let first = self.rate(&self.state);
        let second = self.rate(&moved(&first, 0.5 * step));
        let third = self.rate(&moved(&second, 0.5 * step));
        let fourth = self.rate(&moved(&third, step));
        let mean: Vec<[f64; 4]> = (0..first.len())
            .map(|i| {
                std::array::from_fn(|k| {
                    (first[i][k] + 2.0 * (second[i][k] + third[i][k]) + fourth[i][k]) / 6.0
                })
            })
            .collect();
        self.state = moved(&mean, step);
    }
}

/// Return the largest difference from the paper's equations over the run, m. Also return the displacement (m)
/// and time (s) at which the first Gauss point reverses its motion.
fn difference(step: &str) -> (f64, [f64; 2]) {
    let mut plate = Plate::new();
    assert_eq!(plate.places.len(), 768);
    simulate_input::<2, _>("gauss_plate", &[("step", step)], |mut simulation| {
        let partner = |place: &[f64; 2]| {
            let place = [place[0], place[1], 0.0];
            let at = |k: &usize| distance_squared(simulation.model.position(*k), place) < 1e-18;
            (0..768).find(at).expect("both have the same points")
        };
        let partners: Vec<usize> = plate.places.iter().map(partner).collect();
        let (mut worst, mut turn) = (0.0_f64, [0.0; 2]);
        for moment in 1..=250 {
            let time = 4e-6 * f64::from(moment);
            while simulation.clock.time() < time - 1e-9 {
                simulation.advance();
            }
            (0..4).for_each(|_| plate.advance(1e-6));
            let displacement = &simulation.fields.displacement;
            for (state, partner) in plate.state.iter().zip(&partners) {
                for d in 0..2 {
                    worst = worst.max((displacement[d][*partner] - state[d]).abs());
                }
            }
            let first = displacement[0][partners[0]];
            if time < 200e-6 && first < turn[0] {
                turn = [first, time];
            }
        }
        (worst, turn)
    })
}

#[test]
fn the_plate_moves_as_the_equations_of_the_paper_say() {
    let [(coarse, _), (fine, turn)] = ["2e-6", "1e-6"].map(difference);
    // Displacements reach 0.3 mm.
    assert!(fine < 3e-7, "{fine} m");
    assert!((3.5..4.5).contains(&(coarse / fine)), "{coarse} {fine}");
    // The end of a classical bar of modulus E/(1 − ν²) moves by −5t + 5ct²/L, and reverses at −236 µm after
    // 94.5 µs. Points near edges have incomplete families, so the plate is softer.
    assert!((turn[0] + 262e-6).abs() < 2e-6, "{turn:?}");
    assert!((turn[1] - 100e-6).abs() < 4.1e-6, "{turn:?}");
}

#[test]
fn the_plate_keeps_its_energy_and_symmetry() {
    let largest_error = |step: &str| {
        simulate_input::<2, _>("gauss_plate", &[("step", step)], |mut simulation| {
            let mut observer = HistoryObserver::new(&simulation).unwrap();
            let start = row(&mut observer, &mut simulation).energies.kinetic;
            assert!((start - 10e3).abs() < 1e-8, "{start} J");
            let mut largest = 0.0_f64;
            while simulation.clock.number() < simulation.clock.last() {
                simulation.advance();
                largest = largest.max(row(&mut observer, &mut simulation).energies.error.abs());
            }
            symmetric(&simulation, &[(0, 0.5 * SIZE[0]), (1, 0.5 * SIZE[1])]);
            largest / start
        })
    };
    let [coarse, fine] = ["2e-6", "1e-6"].map(largest_error);
    assert!(fine < 1e-4, "{fine}");
    assert!((3.8..4.2).contains(&(coarse / fine)), "{coarse} {fine}");
}

/// Assert that displacements are symmetric about planes normal to these axes at these positions.
fn symmetric<const D: usize>(simulation: &Simulation<D>, planes: &[(usize, f64)]) {
    let model = &simulation.model;
    let displacement = &simulation.fields.displacement;
    for (axis, centre) in planes.iter().copied() {
        let largest = displacement[axis]
            .iter()
            .fold(0.0_f64, |a, u| a.max(u.abs()));
        // Positions are compared in whole micrometres.
        let key = |x: [f64; 3]| x.map(|x| (x * 1e6).round() as i64);
        let points = 0..model.owned();
        let known: HashMap<[i64; 3], usize> = points.map(|k| (key(model.position(k)), k)).collect();
        for point in 0..model.owned() {
            let mut image = model.position(point);
            image[axis] = 2.0 * centre - image[axis];
            let partner = known[&key(image)];
            for d in 0..D {
                let sign = if d == axis { -1.0 } else { 1.0 };
                let [here, there] = [point, partner].map(|k| displacement[d][k]);
                assert!(
                    (here - sign * there).abs() < 1e-6 * largest,
                    "{here} {there} of {largest}"
                );
            }
        }
    }
}

/// Return the positions of the points on a crack.
fn cracked<const D: usize>(simulation: &mut Simulation<D>) -> Vec<[f64; 3]> {
    let snapshot = Snapshot::new(simulation);
    let damage = snapshot.field(simulation, Field::Damage);
    let points = (0..damage.len()).filter(|k| damage[*k] > CRACKED);
    points.map(|k| simulation.model.position(k)).collect()
}

#[test]
fn the_slit_opens_and_runs() {
    // The steps are four times as long as in the deck.
    let speed_of_sound = (1.2_f64 * 3e6 / 1000.0).sqrt();
    let rayleigh = 0.9194 * (0.4_f64 * 3e6 / 1000.0).sqrt();
    simulate_input::<3, _>("rubber_slit", &[("safety", "0.8")], |mut simulation| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let faces = ["upper", "lower"]
            .map(|face| column(&observer, &format!("probe_{face}_face_displacement_y")));
        let broken = column(&observer, "broken_bonds");
        // Time, half the length of the crack, its largest distance from the mid-plane, and its opening.
        let mut rows = Vec::new();
        while simulation.clock.number() < simulation.clock.last() {
            simulation.advance();
            let values = row(&mut observer, &mut simulation).values;
            let points = cracked(&mut simulation);
            let tip = points.iter().fold(0.0_f64, |tip, x| tip.max(x[0].abs()));
            let off = points.iter().fold(0.0_f64, |off, x| off.max(x[1].abs()));
            rows.push((
                simulation.clock.time(),
                tip,
                off,
                values[faces[0]] - values[faces[1]],
            ));
            if simulation.clock.time() < 0.04 / speed_of_sound {
                assert_eq!(
                    values[broken], 0.0,
                    "no bond breaks before the tension has arrived"
                );
            }
        }
        symmetric(&simulation, &[(0, 0.0), (1, 0.0)]);
        let (first, last) = (rows[0], rows[rows.len() - 1]);
        assert_eq!(first.1, 0.019, "the slit ends at 20 mm, between two points");
        assert_eq!(last.1, 0.049, "it runs to the edges");
        assert!(last.3 > 0.015, "it gapes: {last:?}");
        assert!(
            rows.windows(2).all(|pair| pair[0].3 <= pair[1].3 + 1e-6),
            "{rows:?}"
        );
        // The crack is straight, except where it reaches the edge.
        let inside = rows.iter().filter(|row| row.1 < 0.04);
        assert!(inside.clone().all(|row| row.2 < 0.004), "{rows:?}");
        let running: Vec<_> = inside.filter(|row| row.1 > 0.022).collect();
        let [begin, end] = [running[0], running[running.len() - 1]];
        let speed = (end.1 - begin.1) / (end.0 - begin.0);
        assert!(
            (0.5 * rayleigh..rayleigh).contains(&speed),
            "{speed} of {rayleigh} m/s"
        );
    });
}

#[test]
fn damage_grows_from_the_defect() {
    // 20 × 40 × 20 points; the steps are four times as long as in the deck.
    let coarse = [("dx", "1.5e-3"), ("safety", "0.8")];
    simulate_input::<3, _>("steel_bar_defect", &coarse, |mut simulation| {
        // Time, number of cracked points, and their largest distances from the centre of the defect, in the
        // plane of the defect and normal to this plane.
        let mut rows = Vec::new();
        while simulation.clock.number() < simulation.clock.last() {
            simulation.advance();
            let points = cracked(&mut simulation);
            let radius = points.iter().map(|x| x[0].hypot(x[2])).fold(0.0, f64::max);
            let height = points
                .iter()
                .map(|x| (x[1] - 0.03).abs())
                .fold(0.0, f64::max);
            rows.push((simulation.clock.time(), points.len(), radius, height));
        }
        let (first, last) = (rows[0], rows[rows.len() - 1]);
        assert!(first.2 < 0.0075, "the defect: {first:?}");
        // The tension wave arrives at the defect after 5 µs, and after 15 µs again, doubled by the fixed
        // edge. Then the defect grows.
        let start = rows.iter().find(|row| row.1 > first.1).unwrap();
        assert!((15e-6..25e-6).contains(&start.0), "{start:?}");
        assert!(
            start.2 < 0.0075 + 2.0 * 1.5e-3 && start.3 < 1.5e-3,
            "from its rim: {start:?}"
        );
        assert!(
            rows.windows(2).all(|pair| pair[0].1 <= pair[1].1),
            "{rows:?}"
        );
        assert!(last.2 > 0.02, "to the corners: {last:?}");
        assert!(last.3 < 0.01, "across the middle of the bar: {last:?}");
        symmetric(&simulation, &[(0, 0.0), (2, 0.0)]);
    });
}
