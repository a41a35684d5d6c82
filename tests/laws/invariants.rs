//! Requirements on the laws in every dimension, except where a law declares otherwise. There is no force at
//! rest or under rigid motion. Forces are equal and opposite, and they are the derivative of the energy. Both
//! ends of a bond break together. Bits are equal on any number of ranks and after restarts.

use crate::support::saved::{state, whole};
use crate::support::{displace, force, forces, largest_force, problem, simulate, simulate_on};
use fissure::dimension::{Constraint, Dimension};
use fissure::material::{Declaration, Invariants, declarations};
use fissure::problem::Body;
use fissure::solver::Simulation;
use fissure::solver::bonds::BondUpdate;
use fissure::solver::motion::{Kept, Saved, SavedBonds, SavedColumn};
use fissure::solver::observers::{HistoryObserver, Snapshot};

/// A law with one of its examples: the keys beside density and Young's modulus.
#[derive(Clone, Copy)]
pub(super) struct Case {
    pub(super) law: &'static Declaration,
    pub(super) example: &'static str,
}

/// Return every law with each of its examples.
pub(super) fn cases() -> impl Iterator<Item = Case> {
    declarations().flat_map(|law| {
        law.examples
            .iter()
            .map(move |example| Case { law, example })
    })
}

impl Case {
    /// Return the table of the law for `[material.rubber]`.
    pub(super) fn table(self) -> String {
        let Self { law, example } = self;
        let comma = if example.is_empty() { "" } else { ", " };
        let name = law.name;
        format!("{name} = {{ density = 2, youngs_modulus = 5{comma}{example} }}")
    }

    /// Return whether the law has a 1-D form.
    pub(super) fn has_line(self) -> bool {
        let problem = problem(&deck("plane-stress", &self.table(), "none", ""));
        let line = Dimension::Line {
            cross_section: 1.0,
            constraint: Constraint::UniaxialStress,
        };
        problem.bodies[0].material.law.fault(line).is_none()
    }

    fn can_break(&self) -> bool {
        !self.damages(0.0).is_empty()
    }

    /// Return the damage laws that the law supports, with this α.
    pub(super) fn damages(&self, alpha: f64) -> Vec<String> {
        let stretch = self.law.critical_stretch.map(|_| damage(alpha));
        // A fracture energy of 0.004 J/m² corresponds to a critical stretch of about 0.02.
        let energy = |fracture_energy: f64, more| {
            let text = format!("fracture_energy = {fracture_energy}, alpha = {alpha}{more}");
            format!("damage.brittle.energy = {{ {text} }}")
        };
        // Damage by work does not support influence functions with volume corrections, so these laws are
        // excluded.
        let influenced = ["influence", "diehl2016"];
        let influenced = influenced.iter().any(|word| self.example.contains(word));
        let by_energy = self.law.breaks_by_energy && !influenced;
        let pulled = by_energy.then(|| energy(0.004, ""));
        // The fracture energy is larger here, because the motions of these tests compress bonds so much that
        // all would break.
        let either = by_energy && self.law.any_poisson_ratio;
        let either = either.then(|| energy(0.02, ", tension_only = false, family_correction = 1"));
        let stress = |measure: &str, more: &str| {
            format!("damage.brittle.stress = {{ measure = '{measure}', strength = 0.11{more} }}")
        };
        let stress = [
            stress("principal", ", tension_only = false"),
            stress("von_mises", ""),
        ];
        let by_stress = stress.into_iter().filter(|_| self.law.breaks_by_stress);
        let by_energy = stretch.into_iter().chain(pulled).chain(either);
        by_energy.chain(by_stress).collect()
    }

    fn invariants(&self) -> Invariants {
        let problem = problem(&deck("plane-stress", &self.table(), "none", ""));
        (self.law.invariants)(&problem.bodies[0].material.law.values)
    }

    pub(super) fn is_conservative(&self) -> bool {
        self.invariants().conservative
    }
}

const CORRECTIONS: [&str; 3] = ["none", "linear", "exact"];

/// A law for tests that do not depend on the law.
const PMB: &str = "pmb = { density = 2, youngs_modulus = 5 }";

/// Return the deck of a body with a law: 40 points in 1-D, and about 400 points otherwise.
pub(super) fn deck(dimension: &str, law: &str, correction: &str, extra: &str) -> String {
    let (upper, thickness) = match dimension {
        "1d" => ("[40]", ""),
        "3d" => ("[8, 7, 6]", ""),
        _ => ("[22, 18]", "thickness = 0.5"),
    };
    let lower = ["[0]", "[0, 0]", "[0, 0, 0]"][upper.matches(',').count()];
    format!(
        "dimension = '{dimension}'
        {thickness}
        grid = {{ spacing = 1, horizon = 3, volume_correction = '{correction}' }}
        material.rubber.{law}
        body.block = {{ material = 'rubber', shape.box = {{ lower = {lower}, upper = {upper} }} {extra} }}
        time = {{ end = 1 }}
        "
    )
}

/// Describe the case of a test for messages.
fn description<const D: usize>(simulation: &Simulation<D>) -> String {
    let problem = simulation.problem;
    let (dimension, correction) = (problem.dimension, problem.volume_correction);
    let Body {
        material, damage, ..
    } = &problem.bodies[0];
    format!("{dimension:?}, {correction:?}, {material:?}, {damage:?}")
}

pub(super) fn damage(alpha: f64) -> String {
    format!("damage.brittle.critical_stretch = {{ critical_stretch = 0.05, alpha = {alpha} }}")
}

/// Apply a check to a simulation of each law, volume correction and dimension.
macro_rules! for_all_laws {
    ($check:ident) => {
        for_all_laws!($check, |_: &Case| true)
    };
    ($check:ident, $chosen:expr) => {
        for case in cases().filter($chosen) {
            for correction in CORRECTIONS {
                let deck = |dimension| deck(dimension, &case.table(), correction, "");
                if case.has_line() {
                    simulate(&deck("1d"), $check::<1>);
                }
                simulate(&deck("plane-stress"), $check::<2>);
                simulate(&deck("plane-strain"), $check::<2>);
                simulate(&deck("3d"), $check::<3>);
            }
        }
    };
}

/// Return the largest force density at 1 % of isotropic or deviatoric strain, a scale for other forces.
fn force_scale<const D: usize>(simulation: &mut Simulation<D>) -> f64 {
    displace(simulation, |x| x.map(|x| 1.01 * x));
    let isotropic = largest_force(simulation);
    displace(simulation, |[x, y, z]| [1.01 * x, 0.99 * y, z]);
    isotropic.max(largest_force(simulation))
}

#[test]
fn nothing_at_rest_and_under_translation() {
    fn check<const D: usize>(mut simulation: Simulation<D>) {
        let scale = force_scale(&mut simulation);
        displace(&mut simulation, |x| x);
        assert_eq!(largest_force(&simulation), 0.0);
        // Positions and these displacements are multiples of 1/4, so their sums have no rounding errors.
        displace(&mut simulation, |x| [x[0] + 0.5, x[1] - 4.25, x[2] + 64.0]);
        assert_eq!(largest_force(&simulation), 0.0);
        displace(&mut simulation, |x| {
            [x[0] + 0.1, x[1] - 7.3, x[2] + 1e3 / 3.0]
        });
        assert!(largest_force(&simulation) < 1e-9 * scale);
    }
    for_all_laws!(check);
}

/// Angles of rotation, rad.
const ANGLES: [f64; 3] = [0.3, 1.0, 2.5];

/// Rotate a position about z, and in 3-D also about x.
fn turn<const D: usize>(angle: f64, x: [f64; 3]) -> [f64; 3] {
    let (sin, cos) = angle.sin_cos();
    let once = [cos * x[0] - sin * x[1], sin * x[0] + cos * x[1], x[2]];
    if D < 3 {
        return once;
    }
    let [x, y, z] = once;
    [x, cos * y - sin * z, sin * y + cos * z]
}

#[test]
fn a_body_that_is_turned_has_its_forces_turned() {
    fn check<const D: usize>(mut simulation: Simulation<D>) {
        // Laws with a bond history must start each rotation from the same history.
        let mut kept = Kept::default();
        simulation.keep(&mut kept);
        displace(&mut simulation, wave);
        let before = forces(&simulation);
        let scale = largest_force(&simulation);
        for angle in ANGLES {
            simulation.undo(&kept);
            displace(&mut simulation, |x| turn::<D>(angle, wave(x)));
            for (before, after) in before.iter().zip(forces(&simulation)) {
                let whole = std::array::from_fn(|d| before.get(d).copied().unwrap_or(0.0));
                let wanted = turn::<D>(angle, whole);
                for (after, wanted) in after.iter().zip(wanted) {
                    let error = (after - wanted).abs();
                    let deck = description(&simulation);
                    assert!(error < 1e-11 * scale, "{after} {wanted}: {deck}");
                }
            }
        }
    }
    let objective = |case: &Case| !case.law.linear && case.invariants().objective;
    for case in cases().filter(objective) {
        for correction in CORRECTIONS {
            let deck = |dimension| deck(dimension, &case.table(), correction, "");
            simulate(&deck("plane-stress"), check::<2>);
            simulate(&deck("plane-strain"), check::<2>);
            simulate(&deck("3d"), check::<3>);
        }
    }
}

#[test]
fn nothing_under_finite_rotation() {
    fn check<const D: usize>(mut simulation: Simulation<D>) {
        let scale = force_scale(&mut simulation);
        for angle in ANGLES {
            displace(&mut simulation, |x| turn::<D>(angle, x));
            let largest = largest_force(&simulation);
            let deck = description(&simulation);
            assert!(largest < 1e-12 * scale, "{largest} of {scale}: {deck}");
        }
    }
    for case in cases().filter(|case| !case.law.linear) {
        for correction in CORRECTIONS {
            let deck = |dimension| deck(dimension, &case.table(), correction, "");
            simulate(&deck("plane-stress"), check::<2>);
            simulate(&deck("plane-strain"), check::<2>);
            simulate(&deck("3d"), check::<3>);
        }
    }
}

#[test]
fn no_bond_breaks_under_rigid_rotation_of_any_size() {
    fn check<const D: usize>(mut simulation: Simulation<D>) {
        let before = count_intact(&mut simulation);
        // This strain is at most 1/20 of the strain at which bonds break.
        let strained = |[x, y, z]: [f64; 3]| [1.001 * x, 0.9995 * y + 5e-4 * x, 0.9997 * z];
        for angle in [0.0, 0.01, 0.3, 1.0, 2.5, std::f64::consts::PI] {
            displace(&mut simulation, |x| turn::<D>(angle, strained(x)));
            let deck = description(&simulation);
            assert_eq!(simulation.forces.broken().len(), 0, "{angle}: {deck}");
        }
        assert_eq!(count_intact(&mut simulation), before);
    }
    for case in cases().filter(|case| case.can_break() && !case.law.linear) {
        for damage in case.damages(0.0).iter().chain(&case.damages(0.25)) {
            let body = |dimension| deck(dimension, &case.table(), "exact", ", damage = 'brittle'");
            let breakable = |dimension| body(dimension) + damage;
            simulate(&breakable("plane-stress"), check::<2>);
            simulate(&breakable("plane-strain"), check::<2>);
            simulate(&breakable("3d"), check::<3>);
        }
    }
    // Bonds between two laws: forces of `ordinary` are along the bonds, and forces of `correspondence` are
    // not.
    let text = "dimension = 'plane-strain'
        grid = { spacing = 1, horizon = 3 }
        material.soft.correspondence = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }
        material.hard.ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }
        damage.brittle.energy.fracture_energy = 0.004
        body.left = { material = 'soft', damage = 'brittle', shape.box = { lower = [0, 0], upper = [8, 8] } }
        body.right = { material = 'hard', damage = 'brittle', shape.box = { lower = [8, 0], upper = [16, 8] } }
        time = { end = 1 }
        ";
    simulate(text, check::<2>);
}

/// A smooth, non-uniform deformation with strains of several per cent.
fn wave(x: [f64; 3]) -> [f64; 3] {
    let [a, b, c] = x;
    [
        a + 0.1 * (0.7 * a + 0.3 * b).sin() + 0.02 * c * c,
        b + 0.1 * (0.5 * b - 0.2 * a + 0.4 * c).cos(),
        c + 0.05 * (0.9 * c + 0.1 * a).sin(),
    ]
}

/// Return the moments of all forces about the axes, and the sums of their absolute values, N m. Lever arms
/// are the deformed positions, except for linear laws, whose forces act along undeformed bonds.
fn moments<const D: usize>(simulation: &Simulation<D>) -> [[f64; 2]; 3] {
    let bodies = &simulation.problem.bodies;
    let linear = (bodies.iter()).any(|body| body.material.law.declaration.linear);
    let model = &simulation.model;
    let mut sums = [[0.0; 2]; 3];
    for (point, internal) in forces(simulation).into_iter().enumerate() {
        let (mut arm, mut force) = (model.position(point), [0.0; 3]);
        for d in 0..D {
            arm[d] += if linear {
                0.0
            } else {
                simulation.fields.displacement[d][point]
            };
            force[d] = internal[d] * model.volume[point];
        }
        for (axis, [net, gross]) in sums.iter_mut().enumerate() {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            *net += arm[a] * force[b] - arm[b] * force[a];
            *gross += (arm[a] * force[b]).abs() + (arm[b] * force[a]).abs();
        }
    }
    sums
}

/// Assert that the sum of the forces is zero. For laws that conserve angular momentum, the sum of the moments
/// must also be zero.
pub(super) fn check_momentum<const D: usize>(mut simulation: Simulation<D>) {
    displace(&mut simulation, wave);
    let laws = simulation
        .problem
        .bodies
        .iter()
        .map(|body| &body.material.law);
    let mut kept = laws.map(|law| (law.declaration.invariants)(&law.values));
    let bound = if kept.all(|invariants| invariants.angular_momentum) {
        1e-12
    } else {
        // The bound is the square of the non-uniform part of the strain.
        1e-2
    };
    for [net, gross] in moments(&simulation) {
        assert!(net.abs() <= bound * gross, "moment {net} of {gross}");
    }
    for d in 0..D {
        let (mut net, mut gross) = (0.0_f64, 0.0);
        for (force, volume) in forces(&simulation)
            .iter()
            .zip(simulation.model.volume.iter())
        {
            net += force[d] * volume;
            gross += force[d].abs() * volume;
        }
        assert!(gross > 0.0 && net.abs() < 1e-12 * gross, "{net} of {gross}");
    }
}

#[test]
fn forces_are_equal_and_opposite() {
    for_all_laws!(check_momentum);
    for case in cases().filter(Case::can_break) {
        for alpha in [0.0, 0.25] {
            let deck = deck("3d", &case.table(), "linear", ", damage = 'brittle'");
            for damage in case.damages(alpha) {
                simulate(&format!("{deck}{damage}"), check_momentum::<3>);
            }
        }
    }
    for deck in two_blocks() {
        simulate(&deck, check_momentum::<2>);
    }
}

/// Return decks of two blocks with different materials, horizons and spacings; one block can break.
fn two_blocks() -> Vec<String> {
    let pmb = [
        "pmb = { density = 2, youngs_modulus = 5 }",
        "pmb = { density = 3, youngs_modulus = 50 }",
    ];
    let ordinary = [
        "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.4 }",
        "ordinary = { density = 3, youngs_modulus = 50, poisson_ratio = 0.1, influence = 'inverse' }",
    ];
    let normalised = "normalised_pmb = { density = 3, youngs_modulus = 20 }";
    let mut decks = Vec::new();
    for (correction, [soft, hard], rule) in [
        ("none", pmb, "own"),
        ("linear", pmb, "own"),
        ("exact", pmb, "average"),
        ("none", pmb, "minimum"),
        ("none", ordinary, "own"),
        ("exact", ordinary, "own"),
        ("linear", [ordinary[0], pmb[1]], "own"),
        ("none", [ordinary[0], normalised], "own"),
        ("none", [pmb[0], normalised], "own"),
    ] {
        for right in ["", "horizon = 2.1,", "horizon = 1.6, spacing = 0.5,"] {
            decks.push(format!(
                "dimension = 'plane-stress'
                grid = {{ spacing = 1, horizon = 3, volume_correction = '{correction}' }}
                interface.rule = '{rule}'
                material.soft.{soft}
                material.hard.{hard}
                damage.brittle.critical_stretch = {{ critical_stretch = 0.05, alpha = 0.25 }}
                body.left = {{ material = 'soft', shape.box = {{ lower = [0, 0], upper = [10, 12] }} }}
                body.right = {{ material = 'hard', damage = 'brittle', {right} shape.box = {{ lower = [10, 0], upper = [20, 12] }} }}
                time = {{ end = 1 }}
                "
            ));
        }
    }
    decks
}

/// Return the strain energy of the whole body, J.
pub(super) fn strain_energy<const D: usize>(simulation: &mut Simulation<D>) -> f64 {
    simulation.evaluate(BondUpdate::None);
    let stored = simulation.forces.stored(&simulation.model);
    let energy = stored.energy.iter().zip(simulation.model.volume.iter());
    energy.map(|(density, volume)| density * volume).sum()
}

/// Assert that forces are the negative derivative of the strain energy.
pub(super) fn check_slope<const D: usize>(mut simulation: Simulation<D>) {
    displace(&mut simulation, wave);
    let before = forces(&simulation);
    for point in [0, 7, 31] {
        let volume = simulation.model.volume[point];
        for d in 0..D {
            let force = before[point][d] * volume;
            let place = simulation.fields.displacement[d][point];
            let step = 2e-5;
            simulation.fields.displacement[d][point] = place + step;
            let above = strain_energy(&mut simulation);
            simulation.fields.displacement[d][point] = place - step;
            let below = strain_energy(&mut simulation);
            simulation.fields.displacement[d][point] = place;
            let slope = -(above - below) / (2.0 * step);
            let scale = force.abs().max(1e-3);
            let deck = description(&simulation);
            assert!(
                (force - slope).abs() < 1e-5 * scale,
                "{force} {slope}: {deck}"
            );
        }
    }
}

#[test]
fn the_force_is_the_slope_of_the_energy() {
    for_all_laws!(check_slope, Case::is_conservative);
    // Repeat the check with bonds that the deformation breaks.
    let breakable = |case: &Case| case.can_break() && case.is_conservative();
    for case in cases().filter(breakable) {
        let body = |dimension| deck(dimension, &case.table(), "exact", ", damage = 'brittle'");
        for damage in case.damages(0.25) {
            let breaking = |dimension| body(dimension) + &damage;
            simulate(&breaking("plane-stress"), check_slope::<2>);
            simulate(&breaking("3d"), check_slope::<3>);
        }
    }
    for deck in two_blocks() {
        simulate(&deck, check_slope::<2>);
    }
}

/// Laws that dissipate: with a fixed bond history, the force is the derivative of the stored energy.
#[test]
fn with_a_fixed_history_the_force_is_the_slope_of_the_energy() {
    let names = [
        "ordinary_plastic",
        "ordinary_viscoelastic",
        "elastic_plastic_pmb",
        "softening_pmb",
    ];
    for case in cases().filter(|case| names.contains(&case.law.name)) {
        let cut = "crack.notch.segment = { from = [-1, 9], to = [9, 9] }\n";
        let whole = deck("plane-strain", &case.table(), "exact", "");
        simulate(&(whole + "\n" + cut), check_slope_after_loading::<2>);
        for damage in case.damages(0.0) {
            let body = |dimension| deck(dimension, &case.table(), "exact", ", damage = 'brittle'");
            let breaking = |dimension| body(dimension) + &damage;
            simulate(
                &(breaking("plane-strain") + "\n" + cut),
                check_slope_after_loading::<2>,
            );
            simulate(&breaking("plane-stress"), check_slope_after_loading::<2>);
            simulate(&breaking("3d"), check_slope_after_loading::<3>);
        }
    }
}

/// Same as [`check_slope`], after loading to smaller strains, during which bonds yield.
fn check_slope_after_loading<const D: usize>(mut simulation: Simulation<D>) {
    for share in [0.25, 0.5, 0.75] {
        displace(&mut simulation, |x| {
            let moved = wave(x);
            std::array::from_fn(|k| x[k] + share * (moved[k] - x[k]))
        });
        simulation.evaluate(BondUpdate::Step(0.05));
    }
    check_slope(simulation);
}

#[test]
fn anisotropic_solids_keep_momentum_and_follow_their_energy() {
    let plane = "c11 = 9, c12 = 3, c16 = 0.7, c22 = 6, c26 = -0.5, c66 = 2.5, angle_1 = 23";
    let orthotropic = "youngs_modulus_x = 9, youngs_modulus_y = 6, youngs_modulus_z = 5, \
        poisson_ratio_xy = 0.3, poisson_ratio_yz = 0.2, poisson_ratio_xz = 0.25, \
        shear_modulus_xy = 2, shear_modulus_yz = 1.5, shear_modulus_xz = 3, \
        angle_1 = 23, angle_2 = -40, angle_3 = 63";
    for name in ["correspondence", "bond_associated_correspondence"] {
        for correction in CORRECTIONS {
            let deck = |dimension, solid| {
                let law = format!("{name} = {{ density = 2, {solid} }}");
                deck(dimension, &law, correction, "")
            };
            for dimension in ["plane-stress", "plane-strain"] {
                simulate(&deck(dimension, plane), check_momentum::<2>);
                simulate(&deck(dimension, plane), check_slope::<2>);
            }
            simulate(&deck("3d", orthotropic), check_momentum::<3>);
            simulate(&deck("3d", orthotropic), check_slope::<3>);
        }
    }
}

#[test]
fn the_mirror_image_has_the_mirrored_forces() {
    fn check<const D: usize>(mut simulation: Simulation<D>) {
        let upper = simulation.model.reference[0]
            .iter()
            .fold(0.0_f64, |a, x| a.max(*x));
        let mirror = move |x: [f64; 3]| [upper + 0.5 - x[0], x[1], x[2]];
        // Laws with a bond history must start both deformations from the same history.
        let mut kept = Kept::default();
        simulation.keep(&mut kept);
        displace(&mut simulation, wave);
        let before = forces(&simulation);
        simulation.undo(&kept);
        displace(&mut simulation, |x| mirror(wave(mirror(x))));
        let model = &simulation.model;
        let scale = largest_force(&simulation);
        for point in 0..model.owned() {
            let image = mirror(model.position(point));
            let partner = (0..model.owned())
                .find(|k| fissure::points::distance_squared(model.position(*k), image) < 1e-6)
                .expect("the body is symmetric");
            for d in 0..D {
                let sign = if d == 0 { -1.0 } else { 1.0 };
                let mirrored = sign * before[partner][d];
                let found = force(&simulation, point)[d];
                assert!(
                    (found - mirrored).abs() < 1e-12 * scale,
                    "{found} {mirrored}"
                );
            }
        }
    }
    for_all_laws!(check);
}

#[test]
fn both_ends_of_a_bond_break_together() {
    for case in cases().filter(Case::can_break) {
        for alpha in [0.0, 0.25] {
            let body = |dimension| deck(dimension, &case.table(), "linear", ", damage = 'brittle'");
            for damage in case.damages(alpha) {
                let breaking = |dimension| body(dimension) + &damage;
                if case.has_line() {
                    together::<1>(&breaking("1d"));
                }
                together::<2>(&breaking("plane-stress"));
                together::<2>(&breaking("plane-strain"));
                together::<3>(&breaking("3d"));
            }
        }
    }
    for deck in two_blocks() {
        together::<2>(&deck);
    }
}

fn together<const D: usize>(text: &str) {
    let broken = simulate_on::<D, _>(3, text, |mut simulation| {
        let before = intact_bonds(&mut simulation).len();
        displace(&mut simulation, wave);
        (before, intact_bonds(&mut simulation))
    });
    let before: usize = broken.iter().map(|(before, _)| before).sum();
    let mut all: Vec<(u64, u64)> = broken.into_iter().flat_map(|(_, left)| left).collect();
    assert!(all.len() < before, "nothing broke: {text}");
    all.sort_unstable();
    for (here, there) in &all {
        assert!(
            all.binary_search(&(*there, *here)).is_ok(),
            "{here} {there}"
        );
    }
}

/// Number of steps of a run whose bits are compared.
const STEPS: usize = 8;

#[test]
fn the_bits_are_the_same_on_any_ranks_and_after_a_restart() {
    for case in cases() {
        let mut damages = case.damages(0.25);
        let broken = if damages.is_empty() {
            damages.push(String::new());
            ""
        } else {
            ", damage = 'brittle'"
        };
        let families = ["lattice", "list"];
        for (damage, family) in damages
            .iter()
            .flat_map(|it| families.map(|family| (it, family)))
        {
            let shaken = |dimension, velocity: &str| {
                let body = deck(dimension, &case.table(), "exact", broken);
                let body = body.replace(
                    "horizon = 3,",
                    &format!("horizon = 3, family = '{family}',"),
                );
                format!("{body}{damage}\ninitial.shake.velocity = {velocity}\n")
            };
            if case.has_line() {
                same_bits::<1>(&shaken("1d", "['0.3*sin(2*x)']"));
            }
            let velocity = "['0.3*sin(2*x + y)', '0.2*cos(x - 3*y)']";
            same_bits::<2>(&shaken("plane-stress", velocity));
            same_bits::<2>(&shaken("plane-strain", velocity));
            let velocity = "['0.3*sin(2*x + y)', '0.2*cos(x - 3*z)', '0.2*sin(x*y)']";
            same_bits::<3>(&shaken("3d", velocity));
        }
    }
}

pub(super) fn same_bits<const D: usize>(text: &str) {
    let run = |ranks: usize, text: &str, steps: usize| {
        whole(simulate_on::<D, _>(ranks, text, |mut simulation| {
            (0..steps).for_each(|_| simulation.advance());
            state(&simulation).1
        }))
    };
    let wanted = run(1, text, STEPS);
    let (values, ..) = &wanted;
    assert!(values.iter().all(|bits| f64::from_bits(*bits).is_finite()));
    assert!(run(3, text, STEPS) == wanted, "on 3 ranks: {text}");

    let parts = simulate_on::<D, _>(2, text, |mut simulation| {
        (0..STEPS / 2).for_each(|_| simulation.advance());
        state(&simulation).1
    });
    let joined = joined(parts);
    let continued = simulate_on::<D, _>(3, text, |mut simulation| {
        let (order, _) = state(&simulation);
        let own = part(&joined, order.first() as usize, order.count());
        simulation.restore(&order, &own).unwrap();
        (0..STEPS - STEPS / 2).for_each(|_| simulation.advance());
        state(&simulation).1
    });
    assert!(whole(continued) == wanted, "after a restart: {text}");
}

/// A pair of bodies has its own damage law, by stretch or by work. The bodies differ in stiffness, horizon
/// and, with lists, in spacing.
#[test]
fn damage_of_a_pair_has_the_same_bits_on_any_ranks_and_after_a_restart() {
    let ordinary = "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }";
    let pmb = "pmb = { density = 2, youngs_modulus = 5 }";
    let correspondence =
        "correspondence = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }";
    for (law, damage) in [
        (pmb, "critical_stretch = { fracture_energy = 2e-4 }"),
        (ordinary, "critical_stretch = { critical_stretch = 4e-3 }"),
        (
            ordinary,
            "energy = { fracture_energy = 2e-4, family_correction = 1 }",
        ),
        (correspondence, "energy = { fracture_energy = 2e-4 }"),
    ] {
        for (family, hard) in [
            ("lattice", "horizon = 2.5"),
            ("list", "spacing = 0.5, horizon = 2"),
        ] {
            let text = format!(
                "dimension = 'plane-stress'
                grid = {{ spacing = 1, horizon = 3, family = 'auto' }}
                interface.pair.glue = {{ bodies = ['low', 'high'], damage = 'glue' }}
                material.soft.{law}
                material.hard.{}
                damage.glue.{damage}
                body.low = {{ material = 'soft', shape.box = {{ lower = [0, 0], upper = [12, 6] }} }}
                body.high = {{ material = 'hard', {hard}, shape.box = {{ lower = [0, 6], upper = [12, 11] }} }}
                initial.shake.velocity = ['0.02*sin(x)', '0.04*(y > 6) + 0.01*cos(y)']
                time = {{ end = 9, step = 0.1 }}
                ",
                law.replace("youngs_modulus = 5", "youngs_modulus = 9")
            )
            .replace("'auto'", &format!("'{}'", if family == "list" { family } else { "auto" }));
            simulate::<2, _>(&text, |mut simulation| {
                (0..STEPS).for_each(|_| simulation.advance());
                let mut broken = 0;
                simulation.forces.for_each_broken(|_, _| broken += 1);
                assert!(broken > 0, "no bond breaks: {text}");
            });
            same_bits::<2>(&text);
        }
    }
}

/// Join the saved states of several ranks to the state of one rank.
fn joined(parts: Vec<Saved>) -> Saved {
    let mut parts = parts.into_iter();
    let first = parts.next().unwrap();
    parts.fold(first, |mut all, part| {
        for (column, more) in all.columns.iter_mut().zip(part.columns) {
            column.values.extend(more.values);
        }
        all.bonds.lengths.extend(part.bonds.lengths);
        all.bonds.bytes.extend(part.bonds.bytes);
        all
    })
}

/// Return the part of a saved state that belongs to a range of points.
fn part(all: &Saved, first: usize, count: usize) -> Saved {
    let SavedBonds { lengths, bytes } = &all.bonds;
    let end = |points: usize| lengths[..points].iter().sum::<u32>() as usize;
    let points = first..first + count;
    let column = |column: &SavedColumn| SavedColumn {
        name: column.name.clone(),
        values: column.values[points.clone()].to_vec(),
    };
    Saved {
        columns: all.columns.iter().map(column).collect(),
        bonds: SavedBonds {
            bytes: bytes[end(points.start)..end(points.end)].to_vec(),
            lengths: lengths[points.clone()].to_vec(),
        },
        progress: all.progress.clone(),
    }
}

fn count_intact<const D: usize>(simulation: &mut Simulation<D>) -> u32 {
    let stored = simulation.forces.stored(&simulation.model);
    stored.neighbours.iter().sum::<f64>() as u32
}

/// Return the ids at both ends of every intact bond of the rank's points.
fn intact_bonds<const D: usize>(simulation: &mut Simulation<D>) -> Vec<(u64, u64)> {
    let mut bonds = Vec::new();
    simulation
        .forces
        .for_each_intact(|here, there| bonds.push((here, there)));
    let id = |local: usize| simulation.model.ids[local];
    bonds
        .iter()
        .map(|(here, there)| (id(*here), id(*there)))
        .collect()
}

#[test]
fn a_bond_breaks_at_the_critical_stretch_and_not_before() {
    // Two points, one bond: 1-D, α = 0.
    let text = "dimension = '1d'
        grid = { volume_correction = 'none', spacing = 1, horizon = 1.5 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        damage.brittle.critical_stretch = { critical_stretch = 0.125, alpha = 0 }
        body.bar = { material = 'rubber', damage = 'brittle', shape.box = { lower = [0], upper = [2] } }
        time = { end = 1 }
        ";
    simulate::<1, _>(text, |mut simulation| {
        displace(&mut simulation, |x| [x[0] * 1.1249999, 0.0, 0.0]);
        assert_eq!(count_intact(&mut simulation), 2);
        let stored = simulation.forces.stored(&simulation.model);
        displace(&mut simulation, |x| [x[0] * 1.125, 0.0, 0.0]);
        assert_eq!(count_intact(&mut simulation), 0);
        assert_eq!(largest_force(&simulation), 0.0);
        // The energy of the bond has been released, half of it at each end.
        let set_free: f64 = simulation.fields.freed_energy.iter().flatten().sum();
        let held: f64 = stored.energy.iter().sum();
        assert!((set_free / held - 1.0).abs() < 1e-5);
        // A broken bond does not heal.
        displace(&mut simulation, |x| x);
        assert_eq!(count_intact(&mut simulation), 0);
    });
}

#[test]
fn compression_of_a_neighbour_bond_raises_the_threshold() {
    // Three points in a row. The left bond is compressed to s = −0.2, and the right bond is stretched.
    let text = |alpha: f64| {
        format!(
            "dimension = '1d'
            grid = {{ volume_correction = 'none', spacing = 1, horizon = 1.5 }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            damage.brittle.critical_stretch = {{ critical_stretch = 0.1, alpha = {alpha} }}
            body.bar = {{ material = 'rubber', damage = 'brittle', shape.box = {{ lower = [0], upper = [3] }} }}
            time = {{ end = 1 }}
            "
        )
    };
    let after = |alpha: f64, stretch: f64| {
        simulate::<1, _>(&text(alpha), |mut simulation| {
            displace(&mut simulation, |x| match x[0] {
                x if x < 1.0 => [x + 0.2, 0.0, 0.0],
                x if x > 2.0 => [x + stretch, 0.0, 0.0],
                x => [x, 0.0, 0.0],
            });
            count_intact(&mut simulation)
        })
    };
    // The right bond has the smaller threshold of its two ends. The right end has no compressed bond, so its
    // threshold is s0 − α·stretch, below s0.
    assert_eq!(after(0.0, 0.099), 4);
    assert_eq!(after(0.0, 0.101), 2);
    assert_eq!(after(0.25, 0.079), 4);
    assert_eq!(after(0.25, 0.081), 2);
}

#[test]
fn bonds_of_a_no_failure_zone_hold() {
    let stretch = "critical_stretch = { critical_stretch = 0.05, alpha = 0.25";
    let energy = "energy = { fracture_energy = 0.004, alpha = 0.25";
    let solid = "{ density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }";
    let [ordinary, correspondence] =
        ["ordinary", "correspondence"].map(|law| format!("{law} = {solid}"));
    let cases = [
        (PMB, stretch),
        (PMB, energy),
        (&ordinary, energy),
        (&correspondence, energy),
    ];
    for ((law, damage), ranks) in cases.iter().flat_map(|case| [(case, 1), (case, 3)]) {
        let text = format!(
            "{}set.left.where = 'x < 8'
            damage.brittle.{damage}, no_failure = ['left'] }}",
            deck("plane-stress", law, "none", ", damage = 'brittle'")
        );
        let parts = simulate_on::<2, _>(ranks, &text, |mut simulation| {
            displace(&mut simulation, |x| x.map(|x| 2.0 * x));
            intact_bonds(&mut simulation)
        });
        let bonds: Vec<_> = parts.into_iter().flatten().collect();
        // x = (id mod 22) + ½. All remaining bonds have an end at x < 8, and the point in the corner has kept
        // all of its bonds.
        let left = |id: u64| id % 22 < 8;
        assert!(bonds.iter().all(|(a, b)| left(*a) || left(*b)));
        let corner = bonds.iter().filter(|(a, _)| *a == 0).count();
        assert_eq!(corner, 10, "a quarter of a family at m = 3");
    }
}

#[test]
fn a_pre_crack_shows_as_damage_and_cuts_forces() {
    let text = format!(
        "{}crack.notch.segment = {{ from = [0, 9], to = [11, 9] }}",
        deck("plane-stress", PMB, "none", "")
    );
    simulate::<2, _>(&text, |mut simulation| {
        let snapshot = Snapshot::new(&mut simulation);
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let row = observer.row(&mut simulation, &snapshot);
        assert_eq!(
            row.broken, 0,
            "bonds that start broken do not count as broken by the run"
        );
        let damage = snapshot.field(&mut simulation, fissure::problem::Field::Damage);
        for (point, damage) in damage.iter().enumerate() {
            let [x, y, _] = simulation.model.position(point);
            match ((y - 9.0).abs(), x) {
                (height, x) if height < 1.0 && x < 8.0 => {
                    assert!(*damage > 0.3, "{x} {y} {damage}")
                }
                (height, x) if height > 3.0 || x > 15.0 => assert_eq!(*damage, 0.0, "{x} {y}"),
                _ => {}
            }
        }
        // Move the upper half up. Beside the crack this stretches no intact bond, so forces act only ahead of
        // the tip.
        displace(&mut simulation, |x| match x {
            [a, b, c] if b > 9.0 => [a, b + 0.5, c],
            same => same,
        });
        let far_left =
            (0..simulation.model.owned()).filter(|k| simulation.model.position(*k)[0] < 7.0);
        let forces: Vec<f64> = far_left.map(|k| force(&simulation, k)[1].abs()).collect();
        assert!(forces.iter().all(|force| *force == 0.0));
        assert!(largest_force(&simulation) > 0.0);
    });
}
