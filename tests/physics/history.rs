//! History: sums and extremes of fields, fields of probes, strain and angular momentum.

use std::collections::BTreeMap;

use crate::support::datasets::difference;
use crate::support::history::{column, row, rows_to_the_end};
use crate::support::recorded::record;
use crate::support::{displace, problem, simulate};
use fissure::comm::sum::ExactSum;
use fissure::component::Component;
use fissure::problem::Field;
use fissure::solver::observers::{HistoryObserver, Snapshot};

/// Two bodies that rotate and separate. The grid of one body has refined parts, so volumes differ.
const PLATES: &str = "
dimension = 'plane-stress'
thickness = 0.5
grid = { spacing = 1, horizon = 3, volume_correction = 'linear' }
refinement = { levels = 1, region.end.where = 'x < 4' }
material.glass.pmb = { density = 2, youngs_modulus = 5 }
damage.brittle.critical_stretch = { fracture_energy = 0.05 }
body.plate = { material = 'glass', damage = 'brittle', shape.box = { lower = [0, 0], upper = [14, 8] } }
body.block = { material = 'glass', shape.box = { lower = [20, 0], upper = [25, 8] } }
set.upper.where = 'y > 3'
initial.pull.velocity = ['0.05*(x - 7) - 0.02*y', '0.1*(y - 4) + 0.02*x']
time.end = 6
output = { every_steps = 5, fields = ['velocity', 'damage', 'strain_energy_density', 'stress', 'strain', 'broken_bonds'] }
[history]
every_steps = 5
angular_momentum = true
field.speed = { field = 'velocity', set = 'upper', of = ['sum', 'integral', 'mean', 'minimum', 'maximum'] }
field.along = { field = 'velocity', component = 'y', of = ['minimum', 'mean'] }
field.energy = { field = 'strain_energy_density', set = 'plate', of = ['integral'] }
field.energy_of_block = { field = 'strain_energy_density', set = 'block', of = ['integral'] }
field.load = { field = 'stress', component = 'yy', set = 'upper', of = ['mean', 'maximum'] }
field.principal = { field = 'stress', component = 'principal_1', of = ['maximum'] }
field.broken = { field = 'broken_bonds', of = ['sum', 'maximum'] }
field.damage = { field = 'damage', set = 'block', of = ['mean', 'maximum'] }
probe.corner = { at = [0, 0], fields = ['strain', 'damage'] }
";

/// Return the numbers of a dataset of bits.
fn numbers(found: &BTreeMap<String, Vec<u64>>, name: &str) -> Vec<f64> {
    let bits = found.get(name).unwrap_or_else(|| panic!("no `{name}`"));
    bits.iter().map(|bits| f64::from_bits(*bits)).collect()
}

fn exact(terms: impl Iterator<Item = f64>) -> f64 {
    let mut sum = ExactSum::default();
    terms.for_each(|term| sum.add(term));
    sum.value()
}

#[test]
fn statistics_are_those_of_the_fields_of_the_result() {
    let problem = problem(PLATES);
    let found = record(&problem, 1, 1).datasets;
    let column = |name: &str| numbers(&found, &format!("history {name}"));
    let outputs = numbers(&found, "times").len();
    assert!(outputs > 3, "{outputs}");
    assert_eq!(column("time"), numbers(&found, "times"));
    for output in 0..outputs {
        let field = |name: &str| numbers(&found, &format!("{name} {output}"));
        let (volume, block) = (field("volume"), field("block"));
        let positions = field("positions");
        let points = 0..volume.len();
        assert!(points.clone().any(|k| volume[k] != volume[0]));
        let upper = |k: &usize| positions[3 * k + 1] > 3.0;
        let set = |set: &str| -> Vec<usize> {
            let points = points.clone();
            match set {
                "upper" => points.filter(upper).collect(),
                "plate" => points.filter(|k| block[*k] == 0.0).collect(),
                "block" => points.filter(|k| block[*k] == 1.0).collect(),
                _ => points.collect(),
            }
        };
        let check = |name: &str, members: &str, value: &dyn Fn(usize) -> f64, of: &[&str]| {
            let members = set(members);
            assert!(!members.is_empty());
            let values = || members.iter().map(|k| value(*k));
            let integral = exact(members.iter().map(|k| value(*k) * volume[*k]));
            for of in of {
                let expected = match *of {
                    "sum" => exact(values()),
                    "integral" => integral,
                    "mean" => integral / exact(members.iter().map(|k| volume[*k])),
                    "minimum" => values().fold(f64::INFINITY, f64::min),
                    _ => values().fold(f64::NEG_INFINITY, f64::max),
                };
                let recorded = column(&format!("field_{name}_{of}"))[output];
                assert_eq!(recorded, expected, "{name} {of} at output {output}");
            }
        };
        let (velocity, stress) = (field("velocity"), field("stress"));
        let energy = field("strain_energy_density");
        let (broken, damage) = (field("broken_bonds"), field("damage"));
        let speed = |k: usize| Component::Magnitude.of(&velocity[3 * k..][..3]);
        let all = ["sum", "integral", "mean", "minimum", "maximum"];
        check("speed", "upper", &speed, &all);
        check(
            "along",
            "all",
            &|k| velocity[3 * k + 1],
            &["minimum", "mean"],
        );
        check("energy", "plate", &|k| energy[k], &["integral"]);
        check("energy_of_block", "block", &|k| energy[k], &["integral"]);
        check(
            "load",
            "upper",
            &|k| stress[6 * k + 1],
            &["mean", "maximum"],
        );
        let principal = |k: usize| Component::Principal(0).of(&stress[6 * k..][..6]);
        check("principal", "all", &principal, &["maximum"]);
        check("broken", "all", &|k| broken[k], &["sum", "maximum"]);
        check("damage", "block", &|k| damage[k], &["mean", "maximum"]);

        // The field counts each broken bond at both ends.
        let broken = column("broken_bonds")[output];
        assert_eq!(column("field_broken_sum")[output], 2.0 * broken);
        let whole = column("field_energy_integral")[output]
            + column("field_energy_of_block_integral")[output];
        let strain_energy = column("strain_energy")[output];
        assert!((whole - strain_energy).abs() <= 1e-14 * strain_energy);

        // The probe records the values of the nearest point.
        let distance = |k: &usize| positions[3 * k].hypot(positions[3 * k + 1]);
        let mut nearest = points.clone();
        let nearest = nearest.find(|k| points.clone().all(|other| distance(k) <= distance(&other)));
        let nearest = nearest.unwrap();
        let strain = field("strain");
        for (entry, name) in ["xx", "yy", "zz", "xy"].iter().enumerate() {
            let recorded = column(&format!("probe_corner_strain_{name}"))[output];
            assert_eq!(recorded, strain[6 * nearest + entry], "{name}");
        }
        assert_eq!(column("probe_corner_damage")[output], damage[nearest]);
        let x = column("probe_corner_velocity_x")[output];
        assert_eq!(x, velocity[3 * nearest]);
    }
    assert!(*column("broken_bonds").last().unwrap() > 0.0);
    assert!(*column("field_principal_maximum").last().unwrap() > 0.0);
}

#[test]
fn statistics_have_the_same_bits_on_any_ranks_and_threads() {
    let problem = problem(PLATES);
    let expected = record(&problem, 1, 1).datasets;
    for (ranks, threads) in [(1, 2), (2, 1), (3, 2)] {
        let found = record(&problem, ranks, threads).datasets;
        let difference = difference(&expected, &found);
        assert_eq!(difference, None, "on {ranks} × {threads}");
    }
}

/// Return the step numbers of the outputs of a bar with these keys of `[time]` and `[output]`.
fn steps_of_outputs(time: &str, output: &str) -> Vec<u64> {
    let problem = problem(&format!(
        "dimension = '1d'
        parameters.late = 0.8
        grid = {{ spacing = 1, horizon = 2 }}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.bar = {{ material = 'rubber', shape.box = {{ lower = [0], upper = [8] }} }}
        set = {{ first.where = 'x < 2', last.where = 'x > 6' }}
        condition.hold = {{ set = 'first', displacement = [0] }}
        condition.pull = {{ set = 'last', displacement = ['0.01*t'] }}
        time = {{ end = 1, {time} }}
        output = {{ {output} }}"
    ));
    record(&problem, 1, 1).datasets["steps"].clone()
}

#[test]
fn outputs_are_written_at_given_times() {
    let explicit = |output| steps_of_outputs("step = 0.1", output);
    assert_eq!(explicit("times = [0.33, 'late']"), [0, 4, 8, 10]);
    assert_eq!(
        explicit("every_steps = 5, times = ['late - 0.1', 0.2]"),
        [0, 2, 5, 7, 10]
    );
    let relaxed = "method = 'relaxation', relaxation.load_steps = 4";
    for method in [relaxed, "method = 'static', static.load_steps = 4"] {
        let load_steps = steps_of_outputs(method, "times = [0.3, 0.75]");
        assert_eq!(load_steps, [0, 2, 3, 4], "{method}");
    }
}

/// Return the strain of a point in the middle of a block after a deformation; `setting` gives the dimension.
fn strain<const D: usize>(setting: &str, deformation: impl Fn([f64; 3]) -> [f64; 3]) -> [f64; 6] {
    let (lower, upper) = (vec![0; D], vec![9; D]);
    let deck = format!(
        "{setting}
        grid = {{ spacing = 1, horizon = 2.5 }}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.block = {{ material = 'rubber', shape.box = {{ lower = {lower:?}, upper = {upper:?} }} }}
        time.end = 1"
    );
    simulate::<D, _>(&deck, |mut simulation| {
        displace(&mut simulation, &deformation);
        let snapshot = Snapshot::new(&mut simulation);
        let strain = snapshot.field(&mut simulation, Field::Strain);
        let middle = strain.len() / 12;
        strain[6 * middle..][..6].try_into().unwrap()
    })
}

fn close(found: [f64; 6], expected: [f64; 6]) {
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < 1e-13, "{found} {expected}");
    }
}

#[test]
fn strain_is_that_of_a_uniform_deformation() {
    // F = [[1.02, 0.03, 0], [0.01, 0.99, 0.02], [0, 0, 1.01]], E = (FᵀF − I)/2.
    let map = |[x, y, z]: [f64; 3]| {
        [
            1.02 * x + 0.03 * y,
            0.01 * x + 0.99 * y + 0.02 * z,
            1.01 * z,
        ]
    };
    let half = |square: f64| 0.5 * square;
    let xx = half(1.02_f64.powi(2) + 0.01_f64.powi(2) - 1.0);
    let yy = half(0.03_f64.powi(2) + 0.99_f64.powi(2) - 1.0);
    let xy = half(1.02 * 0.03 + 0.01 * 0.99);
    let expected = [
        xx,
        yy,
        half(0.02_f64.powi(2) + 1.01_f64.powi(2) - 1.0),
        xy,
        half(0.99 * 0.02),
        half(0.01 * 0.02),
    ];
    close(strain::<3>("dimension = '3d'", map), expected);
    let plane = [xx, yy, 0.0, xy, 0.0, 0.0];
    close(strain::<2>("dimension = 'plane-strain'", map), plane);
    // Stretch λ across a plate with ν = 1/3: ln λ = −ν/(1 − ν) ln det F.
    let determinant: f64 = 1.02 * 0.99 - 0.03 * 0.01;
    let zz = half(determinant.powf(-0.5).powi(2) - 1.0);
    let plane = [xx, yy, zz, xy, 0.0, 0.0];
    close(strain::<2>("dimension = 'plane-stress'", map), plane);
    // A bar with ν = 1/4, and a confined bar.
    let stretch = |[x, y, z]: [f64; 3]| [1.02 * x, y, z];
    let xx = half(1.02_f64.powi(2) - 1.0);
    let across = half(1.02_f64.powf(-0.5) - 1.0);
    let bar = [xx, across, across, 0.0, 0.0, 0.0];
    close(strain::<1>("dimension = '1d'", stretch), bar);
    let confined = "dimension = '1d'\nconstraint = 'uniaxial-strain'";
    close(
        strain::<1>(confined, stretch),
        [xx, 0.0, 0.0, 0.0, 0.0, 0.0],
    );
}

#[test]
fn a_turn_is_no_strain() {
    let (sine, cosine) = 0.7_f64.sin_cos();
    let turn = |[x, y, z]: [f64; 3]| [cosine * x - sine * y, sine * x + cosine * y, z];
    close(strain::<2>("dimension = 'plane-stress'", turn), [0.0; 6]);
}

#[test]
fn angular_momentum_of_a_turning_body_stays() {
    let plate = "
        dimension = 'plane-stress'
        thickness = 0.5
        grid = { spacing = 1, horizon = 3 }
        material.glass.pmb = { density = 2, youngs_modulus = 5 }
        body.plate = { material = 'glass', shape.box = { lower = [2, 1], upper = [10, 5] } }
        initial.spin.velocity = ['-0.01*y', '0.01*x']
        history.angular_momentum = true
        time.end = 20";
    simulate::<2, _>(plate, |mut simulation| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let index = column(&observer, "angular_momentum_z");
        // Expected: ω Σ m r² over the points.
        let model = &simulation.model;
        let inertia: f64 = (0..model.owned())
            .map(|k| {
                let [x, y, _] = model.position(k);
                (x * x + y * y) * model.density_of(k) * model.volume[k]
            })
            .sum();
        let rows = rows_to_the_end(&mut observer, &mut simulation);
        assert!(rows.len() > 10, "{}", rows.len());
        for row in &rows {
            let ratio = row[index] / (0.01 * inertia);
            assert!((ratio - 1.0).abs() < 1e-12, "{ratio}");
        }
    });
    let block = "
        dimension = '3d'
        grid = { spacing = 1, horizon = 2 }
        material.glass.pmb = { density = 2, youngs_modulus = 5 }
        body.block = { material = 'glass', shape.box = { lower = [0, 0, 0], upper = [2, 2, 2] } }
        initial.spin.velocity = ['2*z', '0', '0']
        history.angular_momentum = true
        time.end = 1";
    simulate::<3, _>(block, |mut simulation| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let row = row(&mut observer, &mut simulation).values;
        let of = |axis: &str| row[column(&observer, &format!("angular_momentum_{axis}"))];
        // Eight points of 2 kg with coordinates 0.5 and 1.5: L_y = Σ m z·2z, and L_z = −Σ m y·2z.
        let square = 16.0 * (0.25 + 2.25) / 2.0;
        assert_eq!([of("x"), of("y"), of("z")], [0.0, 2.0 * square, -32.0]);
    });
}
