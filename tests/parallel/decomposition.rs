//! A deck gives equal bits on any number of ranks and threads. Ranks are threads of the test, which avoids
//! starts of MPI. Five decks are also run by the command under `mpirun`.

use std::collections::BTreeMap;
use std::path::PathBuf;

use crate::support::command::{Folder, fissure, succeed};
use crate::support::datasets::{datasets, difference, points_left};
use crate::support::recorded::record;
use fissure::deck;
use fissure::problem::Problem;

/// A plate of two materials: damage with α, a no-failure zone, supports, loads, a notch, probes.
const PLATE: &str = "
dimension = 'plane-strain'
thickness = 0.01
[parameters]
dx = 1e-3
[grid]
volume_correction = 'none'
spacing = 'dx'
horizon = '3*dx'
[material]
glass.pmb = { density = 2440, youngs_modulus = 72e9 }
steel.pmb = { density = 8000, youngs_modulus = 210e9 }
[damage.brittle.critical_stretch]
fracture_energy = 20
alpha = 0.25
no_failure = ['top']
[body.plate]
material = 'glass'
damage = 'brittle'
shape.difference = [
    { box = { lower = [0, -0.012], upper = [0.04, 0.012] } },
    { disc = { centre = [0.03, 0.004], radius = 0.003 } },
]
[body.rim]
material = 'steel'
shape.box = { lower = [0, 0.012], upper = [0.04, 0.016] }
[crack.notch.segment]
from = [-1, 0]
to = [0.012, 0]
[crack.slit.segment]
from = [0.02, -0.008]
to = [0.025, -0.004]
width = 1.2e-3
[set]
top.where = 'y > 0.013'
bottom.where = 'y < -0.012 + dx'
[condition]
pull.set = 'bottom'
pull.traction = ['2e6*sin(1e6*t)', '-20e6*(1 + x)']
hold.set = 'rim'
hold.displacement = ['free', '1e-7*ramp(t, 0, 4e-6)']
[initial.shake]
velocity = ['0.1*sin(400*x)', '0.1*cos(300*y)']
[time]
end = 12e-6
[output]
every_steps = 7
times = [0.6e-6, 1.7e-6]
fields = ['displacement', 'velocity', 'acceleration', 'force_density', 'damage', 'strain_energy_density', 'neighbours', 'newly_broken_bonds']
[history]
every_steps = 3
reactions = ['rim']
angular_momentum = true
field.load = { field = 'stress', component = 'von_mises', set = 'rim', of = ['sum', 'mean', 'maximum'] }
field.strain = { field = 'strain', component = 'yy', of = ['integral', 'minimum'] }
force.slanted = { set = 'rim', direction = [1, 2] }
crack.notch = { from = [0, 0], threshold = 0.2 }
probe.ahead = { at = [0.02, 0], fields = ['stress', 'damage'] }
front.wave = { from = [0.02, -0.012], direction = [0.1, 1], field = 'velocity', threshold = 0.5 }
front.strain = { from = [0, 0], direction = [1, 0], length = 0.03, field = 'strain_energy_density', threshold = 1 }
tip.notch = { from = [0, 0], direction = [1, 0.2], set = 'plate' }
";

/// Blocks with different state-based and bond-based laws and horizons, damped; some of them break.
const LAWS: &str = "
dimension = 'plane-stress'
[grid]
spacing = 1
horizon = 3
volume_correction = 'exact'
[material]
first.ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.4, damping = 0.02 }
second.normalised_pmb = { density = 2, youngs_modulus = 5 }
third.ordinary = { density = 3, youngs_modulus = 8, poisson_ratio = 0.1, influence = 'gaussian' }
[damage.brittle.critical_stretch]
fracture_energy = 0.05
alpha = 0.25
[body.left]
material = 'first'
damage = 'brittle'
shape.box = { lower = [0, 0], upper = [12, 16] }
[body.middle]
material = 'second'
damage = 'brittle'
shape.box = { lower = [12, 0], upper = [22, 16] }
[body.right]
material = 'third'
horizon = 2
spacing = 0.5
shape.box = { lower = [22, 0], upper = [26, 16] }
[initial.burst]
velocity = ['0.02*x', '0.03*(y - 8) + 0.005*sin(x)']
[time]
end = 12
[output]
every_steps = 7
fields = ['displacement', 'damage', 'strain_energy_density', 'dilatation', 'weighted_volume', 'stress']
[history]
every_steps = 3
";

/// Return the deck of the plate with two refinement levels across a notch and the border of a body; `rule` is
/// the rule of the horizon.
fn refined(rule: &str) -> String {
    let plate = PLATE.replace("end = 12e-6", "end = 5e-6");
    let plate = plate.replace("fracture_energy = 20", "fracture_energy = 2");
    format!(
        "{plate}
        [refinement]
        levels = 2
        rule = '{rule}'
        [refinement.region]
        tip.where = '(x - 12*dx)^2 + y^2 < (3*dx)^2'
        side = {{ where = 'x > 35*dx', level = 1 }}
        "
    )
}

/// Return the deck [`LAWS`] with one law for all blocks, so that the loops specialised for one law run.
fn with_one_law(law: &str) -> String {
    let mut lines: Vec<String> = LAWS.lines().map(str::to_owned).collect();
    for line in &mut lines {
        for name in ["first", "second", "third"] {
            if line.starts_with(&format!("{name}.")) {
                *line = format!("{name}.{law}");
            }
        }
    }
    lines.join("\n")
}

/// A block of scattered points from a file, which flies apart.
const BLOCK: &str = "
dimension = '3d'
[grid]
volume_correction = 'none'
horizon = 2.2
[material.rubber.pmb]
density = 2
youngs_modulus = 5
[damage.brittle.critical_stretch]
critical_stretch = 0.05
[body.block]
material = 'rubber'
damage = 'brittle'
points.file = 'points.csv'
[initial.burst]
velocity = ['0.03*x', '0.02*y', '-0.02*z + 0.005*x']
[time]
end = 8
[output]
every_steps = 10
";

/// A notched plate that tears in a relaxation and then is released.
const SLOW: &str = "
dimension = 'plane-stress'
grid = { spacing = 1, horizon = 3 }
material.sheet.pmb = { density = 2, youngs_modulus = 5 }
damage.brittle.critical_stretch = { critical_stretch = 0.02, alpha = 0.1 }
body.plate = { material = 'sheet', damage = 'brittle', shape.box = { lower = [0, 0], upper = [24, 16] } }
crack.notch.segment = { from = [-1, 8], to = [8, 8] }
set.top.where = 'y > 13'
set.bottom.where = 'y < 3'
set.right.where = 'x > 22'
condition.down = { set = 'bottom', velocity = [0, '-0.04'] }
condition.up = { set = 'top', displacement = [0, '0.04*t'] }
condition.push = { set = 'right', body_force = ['1e-4*t', 0] }
history.reactions = ['top']
time = { end = 8, density_scale = 4 }
[[stage]]
end = 3
method = 'relaxation'
relaxation = { load_steps = 6, tolerance = 1e-4 }
[[stage]]
on = ['down']
";

/// A rotating block that breaks at another block, with friction and restitution; a rigid wall and a rigid
/// hammer; and a third body beside the path of the fragments.
const COLLISION: &str = "
dimension = 'plane-strain'
contact = { friction = 0.2, static_friction = 0.4, restitution = 0.8, pair.hit = { bodies = ['flying', 'target'], model = 'short-range' } }
grid = { spacing = 1, horizon = 3 }
material.rubber.ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }
material.steel.pmb = { density = 3, youngs_modulus = 9 }
damage.brittle.critical_stretch = { critical_stretch = 0.06 }
body.flying = { material = 'rubber', damage = 'brittle', shape.box = { lower = [0, 0], upper = [10, 8] } }
body.target = { material = 'rubber', damage = 'brittle', shape.box = { lower = [12, -4], upper = [18, 12] } }
rigid.wall = { half_space = { through = [0, -10.5], normal = [0.1, 1] }, friction = 0.1 }
rigid.hammer = { shape.disc = { centre = [17, 14.2], radius = 2 }, mass = 30, velocity = [-0.1, -0.3], angular_velocity = [0.2], friction = 0.5 }
body.beside = { material = 'steel', shape.box = { lower = [19, -2], upper = [24, 5] } }
crack.notch.segment = { from = [3, 4], to = [11, 4] }
initial.throw = { set = 'flying', velocity = ['0.5 - 0.03*(y - 4)', '0.03*(x - 5)'] }
time.end = 20
output = { every_steps = 5, fields = ['displacement', 'velocity', 'damage', 'contact_force_density', 'force_density'] }
history.every_steps = 3
";

/// Three points, fewer than the largest number of ranks.
const FEW: &str = "
dimension = '1d'
grid = { volume_correction = 'none', spacing = 1, horizon = 1.5 }
material.rubber.pmb = { density = 2, youngs_modulus = 5, damping = 0.1 }
body.bar = { material = 'rubber', shape.box = { lower = [0], upper = [3] } }
initial.pull.displacement = ['0.01*x']
condition.push = { set = 'all', body_force = ['0.01*x'] }
time = { end = 5 }
";

/// Return a point file with pseudo-random positions.
fn scattered_points() -> String {
    let mut state = 12345_u64;
    let mut random = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut text = String::from("x,y,z,volume,block\n");
    for k in 0..700 {
        let cell = [k % 10, k / 10 % 10, k / 100].map(f64::from);
        let place = cell.map(|c| c + 0.6 * random());
        let volume = 0.8 + 0.4 * random();
        text += &format!("{},{},{},{volume},1\n", place[0], place[1], place[2]);
    }
    text
}

/// Run a deck on all layouts of ranks and threads, with ranks as threads, and compare the bits.
fn same_everywhere(name: &str, text: &str, must_break: bool) {
    let folder = Folder::new(name);
    let problem = deck_in(&folder, text).1;
    let expected = record(&problem, 1, 1).datasets;
    assert_events(&expected, text, must_break);
    for (ranks, threads) in LAYOUTS.into_iter().skip(1) {
        let found = record(&problem, ranks, threads);
        let (moves, moved) = (ranks > 1 && text.contains("[balance]"), found.repartitions);
        assert_eq!(moved > 1, moves, "{moved} repartitions");
        let difference = difference(&expected, &found.datasets);
        assert_eq!(difference, None, "on {ranks} × {threads}");
    }
}

/// Run the command under `mpirun`, and compare the bits with those of one rank in this process.
fn same_under_mpirun(name: &str, text: &str, must_break: bool) {
    let folder = Folder::new(&format!("{name}-mpirun"));
    let (deck, problem) = deck_in(&folder, text);
    let expected = record(&problem, 1, 1).datasets;
    assert_events(&expected, text, must_break);
    let mut repartitions = 0;
    for (ranks, threads) in [(1, 2), (2, 2), (3, 1), (4, 1)] {
        let out = folder.join(format!("{ranks}x{threads}"));
        let mut command = fissure(ranks);
        command.arg("run").arg(&deck).arg("--output").arg(&out);
        let printed = succeed(command.args(["--threads", &threads.to_string(), "-v"]));
        assert!(printed.contains("all writes were collective"), "{printed}");
        repartitions += printed.matches("changed their rank").count();
        let difference = difference(&expected, &datasets(&out.join("result.vtkhdf")));
        assert_eq!(difference, None, "on {ranks} × {threads}");
    }
    // Measured times decide in which layouts points migrate.
    assert_eq!(repartitions > 0, text.contains("[balance]"));
}

/// Numbers of ranks, and of threads per rank.
const LAYOUTS: [(usize, usize); 8] = [
    (1, 1),
    (1, 2),
    (2, 1),
    (2, 2),
    (3, 1),
    (3, 2),
    (4, 1),
    (4, 2),
];

/// Write a deck and its point file into a folder; return its path and its problem.
fn deck_in(folder: &Folder, text: &str) -> (PathBuf, Problem) {
    folder.write("points.csv", &scattered_points());
    let path = folder.write("deck.toml", text);
    let problem = deck::read(&path, &[]).and_then(|deck| deck.problem());
    (path, problem.unwrap_or_else(|error| panic!("{error}")))
}

/// Assert that the events that a deck is made for have happened.
fn assert_events(found: &BTreeMap<String, Vec<u64>>, text: &str, must_break: bool) {
    let last = |column: &str| {
        let bits = found[&format!("history {column}")].last();
        f64::from_bits(*bits.unwrap())
    };
    let broken = last("broken_bonds");
    assert_eq!(broken > 0.0, must_break, "{broken} bonds broke");
    if text.contains("[refinement.trigger]") {
        let points = &found["history points"];
        assert!(points.last() > points.first(), "no point was born");
    }
    if text.contains("coarsen_after") {
        assert!(points_left(found), "no point has left");
    }
    if text.contains("yield_str") {
        assert!(last("dissipated_energy") > 0.0, "nothing has yielded");
    }
}

fn listed(deck: &str) -> String {
    deck.replace("[grid]", "[grid]\nfamily = 'list'")
}

/// Run a deck with bonds in lattices and with bonds in lists.
fn same_with_either_family(name: &str, text: &str) {
    same_everywhere(name, text, true);
    same_everywhere(&format!("{name}-listed"), &listed(text), true);
}

#[test]
fn a_plate_of_two_materials() {
    same_everywhere("plate", PLATE, true);
}

#[test]
fn a_plate_of_two_materials_with_listed_bonds() {
    same_everywhere("listed", &listed(PLATE), true);
}

#[test]
fn a_bar_whose_ghosts_lie_far_from_their_neighbours_in_memory() {
    // On up to three ranks, a rank has more than 2^16 points, so that differences of local indices need more
    // than 16 bits.
    let deck = "
        dimension = '1d'
        [grid]
        spacing = 1e-5
        horizon = 3.015e-5
        family = 'list'
        [material]
        bar.pmb = { density = 1, youngs_modulus = 1 }
        [damage.brittle.critical_stretch]
        critical_stretch = 0.01
        [body.bar]
        material = 'bar'
        damage = 'brittle'
        shape.box = { lower = [0], upper = [2.2] }
        [initial.waves]
        velocity = ['0.012*sin(40*x)*sin(3e4*x)']
        [time]
        end = 4e-5
        [output]
        every_steps = 10
        fields = ['displacement', 'damage']
        [history]
        every_steps = 10
        ";
    same_everywhere("bar", deck, true);
}

#[test]
fn bonds_as_long_as_the_volume_correction_reaches() {
    let horizon = "horizon = '2.5*dx'\nvolume_correction = 'linear'";
    let plain = "volume_correction = 'none'\n";
    let deck = PLATE
        .replace(plain, "")
        .replace("horizon = '3*dx'", horizon);
    same_everywhere("tie", &deck, true);
}

#[test]
fn a_plate_with_refined_parts() {
    same_everywhere("refined", &refined("delta"), true);
}

/// Return the deck of a plate that is refined up to twice where it is strained and torn.
fn growing() -> String {
    let plate = PLATE.replace("end = 12e-6", "end = 2e-6");
    let plate = plate.replace("fracture_energy = 20", "fracture_energy = 0.5");
    format!(
        "{plate}
        [refinement]
        levels = 2
        [refinement.region.side]
        where = 'x > 36*dx'
        level = 1
        [refinement.trigger]
        energy = 0.4
        damage = 0.3
        where = 't > 1e-6 && x < 3*dx && y > 0'
        every_steps = 5
        coarsen_after = 3e-7
        [checkpoint]
        every_steps = 9
        {RESTLESS}"
    )
}

#[test]
fn a_plate_that_is_refined_while_it_is_torn_and_dealt_out_anew() {
    same_everywhere("growing", &growing(), true);
}

/// The plate is beside a body without damage.
#[test]
fn a_plate_of_bonds_that_break_by_work_that_is_refined_while_it_is_torn() {
    let deck = growing()
        .replace("glass.pmb = {", "glass.ordinary = { poisson_ratio = 0.3,")
        .replace(
            "brittle.critical_stretch]",
            "brittle.energy]\nfamily_correction = 1",
        );
    same_everywhere("growing-by-work", &deck, true);
}

/// With this limit points are rebalanced at each check, because one rank is always slower than the mean.
const RESTLESS: &str = "[balance]\nevery_steps = 5\nimbalance = 1\n";

#[test]
fn a_plate_with_refined_parts_that_is_dealt_out_anew() {
    let deck = refined("delta-m") + RESTLESS;
    same_everywhere("refined-balance", &deck, true);
}

#[test]
fn blocks_of_different_laws_that_are_dealt_out_anew() {
    same_everywhere("laws-balance", &(LAWS.to_owned() + "\n" + RESTLESS), true);
    let law = "elastic_plastic_pmb = { density = 2, youngs_modulus = 5, yield_stretch = 0.01 }";
    same_everywhere(
        "plastic-balance",
        &(with_one_law(law) + "\n" + RESTLESS),
        true,
    );
}

#[test]
fn bodies_that_collide() {
    same_everywhere("collision", COLLISION, true);
    same_everywhere(
        "collision-balance",
        &(COLLISION.to_owned() + RESTLESS),
        true,
    );
    let adaptive = "time = { end = 20, adaptive = { most_broken = 3, stable_broken = 1, steps = 5, reduce = 0.5, raise = 1.5 } }";
    let adaptive = COLLISION.replace("time.end = 20", adaptive);
    same_everywhere("collision-adaptive", &adaptive, true);
}

#[test]
fn bodies_that_collide_under_mpirun() {
    same_under_mpirun("collision", COLLISION, true);
}

#[test]
fn blocks_of_different_laws() {
    same_everywhere("laws", LAWS, true);
}

#[test]
fn blocks_of_different_laws_whose_bonds_break_by_work() {
    let constants = "{ density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }";
    let mut deck = LAWS.replace(
        "brittle.critical_stretch]",
        "brittle.energy]\nfamily_correction = 1",
    );
    for (name, law) in [
        ("first", "ordinary"),
        ("second", "correspondence"),
        ("third", "bond_associated_correspondence"),
    ] {
        let line = LAWS.lines().find(|line| line.starts_with(name)).unwrap();
        deck = deck.replace(line, &format!("{name}.{law} = {constants}"));
    }
    same_everywhere("laws-by-work", &deck, true);
}

#[test]
fn blocks_of_the_ordinary_law() {
    let law = "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }";
    same_everywhere("ordinary", &with_one_law(law), true);
}

#[test]
fn blocks_of_the_position_aware_law() {
    let law = "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3, surface_correction = 'pals' }";
    same_with_either_family("pals", &with_one_law(law));
    let directional = law.replace("pals", "directional");
    same_with_either_family("directional", &with_one_law(&directional));
}

#[test]
fn blocks_of_the_normalised_law() {
    let law = "normalised_pmb = { density = 2, youngs_modulus = 5 }";
    same_everywhere("normalised", &with_one_law(law), true);
}

#[test]
fn blocks_of_bond_associated_correspondence() {
    let law =
        "bond_associated_correspondence = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }";
    let rule = "brittle.energy]\nfamily_correction = 0.5";
    let deck = with_one_law(law).replace("brittle.critical_stretch]", rule);
    same_with_either_family("associated", &deck);
}

#[test]
fn blocks_of_ordinary_laws_whose_bonds_remember() {
    for (name, more) in [
        ("plastic", "yield_stress = 0.05"),
        ("viscoelastic", "relaxing_share = 0.6, relaxation_time = 3"),
    ] {
        let law = format!(
            "ordinary_{name} = {{ density = 2, youngs_modulus = 5, poisson_ratio = 0.3, {more} }}"
        );
        let rule = "brittle.energy]\ntension_only = false\nfamily_correction = 1";
        let deck = with_one_law(&law).replace("brittle.critical_stretch]", rule);
        same_with_either_family(&format!("ordinary-{name}"), &deck);
    }
}

#[test]
fn blocks_of_a_law_whose_points_flow() {
    let law = "correspondence = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3, \
               yield_stress = 0.05, hardening_modulus = 0.2 }";
    flows_alike("flowing", law);
}

#[test]
fn blocks_of_a_law_whose_points_harden_by_rate_and_heat() {
    let law = "correspondence = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3, \
               yield_stress = 0.03, hardening_modulus = 0.2, hardening_exponent = 0.4, \
               strain_rate_coefficient = 0.05, reference_strain_rate = 1e-4, \
               thermal_softening_exponent = 1.1, initial_temperature = 0, melting_temperature = 1, \
               volumetric_heat_capacity = 0.01 }";
    flows_alike("johnson-cook", law);
}

fn flows_alike(name: &str, law: &str) {
    let rule = "brittle.energy]\nfamily_correction = 1";
    let deck = with_one_law(law).replace("brittle.critical_stretch]", rule);
    let deck = deck.replace("'stress'", "'stress', 'plastic_strain_equivalent'");
    same_with_either_family(name, &deck);
}

#[test]
fn blocks_of_a_law_whose_bonds_remember() {
    let law = "elastic_plastic_pmb = { density = 2, youngs_modulus = 5, yield_stretch = 0.01 }";
    same_with_either_family("plastic", &with_one_law(law));
}

#[test]
fn blocks_of_a_law_whose_bonds_soften() {
    let law = "softening_pmb = { density = 2, youngs_modulus = 5, strength_stretch = 0.01, \
               critical_stretch = 0.03, curve = 'exponential' }";
    let deck = with_one_law(law).replace("damage = 'brittle'", "");
    same_with_either_family("softening", &deck);
    same_everywhere("softening-balance", &(deck + "\n" + RESTLESS), true);
}

#[test]
fn blocks_of_a_law_whose_bonds_wear_out() {
    let law = "fatigue_pmb = { density = 2, youngs_modulus = 5, cycles_per_second = 1, \
               fatigue_coefficient = 1e4, fatigue_exponent = 1.7, fatigue_limit = 0.001 }";
    let deck = with_one_law(law);
    same_with_either_family("fatigue", &deck);
    same_everywhere("fatigue-balance", &(deck + "\n" + RESTLESS), true);
}

#[test]
fn scattered_points_from_a_file() {
    same_everywhere("block", BLOCK, true);
    let law = "[material.rubber.elastic_plastic_pmb]\nyield_stretch = 0.02";
    let deck = BLOCK.replace("[material.rubber.pmb]", law);
    same_everywhere("plastic-block", &deck, true);
}

#[test]
fn a_plate_relaxed_and_let_go() {
    same_everywhere("slow", SLOW, true);
}

#[test]
fn a_plate_of_scattered_strength() {
    let scattered = |alpha: &str| {
        let damage = format!("{alpha}\nweibull_modulus = 6\nseed = 11");
        PLATE.replace("alpha = 0.25", &damage)
    };
    same_everywhere("weibull-alpha", &scattered("alpha = 0.25"), true);
    same_with_either_family("weibull", &scattered("alpha = 0"));
    let jitter = "[grid]\njitter = 0.3\nseed = 5";
    let jittered = scattered("alpha = 0").replace("[grid]", jitter);
    same_everywhere("jitter", &jittered, true);
    let by_work =
        "[damage.brittle.energy]\nfracture_energy = 0.05\nalpha = 0.25\nweibull_modulus = 6";
    let law =
        "[material.rubber.correspondence]\ndensity = 2\nyoungs_modulus = 5\npoisson_ratio = 0.3";
    let deck = format!(
        "dimension = 'plane-strain'
        {by_work}
        {law}
        {jitter}
        spacing = 1
        horizon = 2.5
        [body.plate]
        material = 'rubber'
        damage = 'brittle'
        shape.box = {{ lower = [0, 0], upper = [14, 8] }}
        [initial.burst]
        velocity = ['0.1*(x - 7)', 0]
        [time]
        end = 12
        [history]
        every_steps = 5
        "
    );
    same_everywhere("weibull-work", &deck, true);
}

#[test]
fn fewer_points_than_ranks() {
    same_everywhere("few", FEW, false);
}

#[test]
fn a_plate_of_two_materials_under_mpirun() {
    same_under_mpirun("plate", PLATE, true);
}

#[test]
fn a_plate_that_is_refined_while_it_is_torn_and_dealt_out_anew_under_mpirun() {
    same_under_mpirun("growing", &growing(), true);
}

#[test]
fn scattered_points_from_a_file_under_mpirun() {
    same_under_mpirun("block", BLOCK, true);
}

#[test]
fn fewer_points_than_ranks_under_mpirun() {
    same_under_mpirun("few", FEW, false);
}
