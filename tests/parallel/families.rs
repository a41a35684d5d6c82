//! Bonds in lattices and in lists give the same physics up to rounding. All sets of vector instructions give
//! the same bits.

use std::collections::BTreeMap;

use crate::support::command::{Folder, finish, fissure, succeed, text};
use crate::support::datasets::{datasets, difference};
use crate::support::{problem, simulate_on};
use fissure::problem::Field;
use fissure::solver::Simulation;
use fissure::solver::observers::Snapshot;

/// Two bodies on one grid, with a hole, a crack, a no-failure set and supports. `LAW`, `RATIO`, `GRID` and
/// `ALPHA` are placeholders.
const SOLID: &str = "
dimension = '3d'
[grid]
spacing = 1
GRID
[material]
one.LAW = { density = 2, youngs_modulus = 5 RATIO }
two.LAW = { density = 3, youngs_modulus = 8 RATIO }
[damage.brittle.critical_stretch]
fracture_energy = 0.004
alpha = ALPHA
no_failure = ['end']
[body.left]
material = 'one'
damage = 'brittle'
shape.difference = [
    { box = { lower = [0, 0, 0], upper = [9, 7, 6] } },
    { sphere = { centre = [4, 3, 3], radius = 1.6 } },
]
[body.right]
material = 'two'
damage = 'brittle'
shape.box = { lower = [9, 0, 0], upper = [16, 7, 6] }
[crack.notch.rectangle]
corner = [5, 0, 0]
edge_a = [0, 3, 0]
edge_b = [0, 0, 6]
[set]
end.where = 'x > 14'
start.where = 'x < 1'
[condition.hold]
set = 'start'
displacement = [0, 'free', 0]
[initial.burst]
velocity = ['0.02*x', '0.02*y + 0.003*sin(x)', '0.002*z*x']
[time]
end = 6
";

/// A plane problem: a disc, and a block with a finer grid that does not match the grid of the disc.
const PLANE: &str = "
dimension = 'plane-strain'
[grid]
spacing = 1
GRID
[material]
one.LAW = { density = 2, youngs_modulus = 5 RATIO }
[damage.brittle.critical_stretch]
fracture_energy = 0.01
alpha = ALPHA
[body.disc]
material = 'one'
damage = 'brittle'
shape.disc = { centre = [0.2, 0.1], radius = 9 }
[body.fine]
material = 'one'
spacing = 0.7
damage = 'brittle'
shape.box = { lower = [10, -5], upper = [16, 5] }
[initial.burst]
velocity = ['0.02*x', '0.02*y + 0.003*sin(x)']
[time]
end = 6
";

/// Return fields that depend on bonds, each with its values sorted by global id.
fn measure<const D: usize>(ranks: usize, deck: &str) -> Vec<(Field, Vec<f64>)> {
    let fields = [
        Field::Displacement,
        Field::ForceDensity,
        Field::Damage,
        Field::StrainEnergyDensity,
        Field::Dilatation,
        Field::WeightedVolume,
        Field::Stress,
        Field::Neighbours,
    ];
    let pieces = simulate_on(ranks, deck, |mut simulation: Simulation<D>| {
        while simulation.clock.number() < simulation.clock.last() {
            simulation.advance();
        }
        simulation.check().unwrap();
        let snapshot = Snapshot::new(&mut simulation);
        let families = Snapshot::without_energies(&mut simulation).stored;
        assert_eq!(families.volume, snapshot.stored.volume);
        assert_eq!(families.neighbours, snapshot.stored.neighbours);
        let values = fields.map(|field| snapshot.field(&mut simulation, field));
        (
            simulation.model.ids[..simulation.model.owned()].to_vec(),
            values,
        )
    });
    let order = |k: usize| {
        let mut rows: Vec<(u64, &[f64])> = Vec::new();
        for (ids, values) in &pieces {
            let width = values[k].len() / ids.len().max(1);
            let chunks = values[k].chunks(width.max(1));
            rows.extend(ids.iter().copied().zip(chunks));
        }
        rows.sort_by_key(|row| row.0);
        rows.into_iter().flat_map(|row| row.1.to_vec()).collect()
    };
    (0..fields.len()).map(|k| (fields[k], order(k))).collect()
}

fn compare<const D: usize>(deck: &str) {
    let with = |family: &str| deck.replace("[grid]", &format!("[grid]\nfamily = '{family}'"));
    problem(&with("lattice"));
    let list = measure::<D>(1, &with("list"));
    let lattice = measure::<D>(1, &with("lattice"));
    let broken: f64 = list[2].1.iter().sum();
    assert!(broken > 1.0, "hardly anything broke: {broken}");
    for ((field, list), (_, lattice)) in list.iter().zip(&lattice) {
        assert_eq!(list.len(), lattice.len());
        let largest = list.iter().fold(0.0_f64, |all, value| all.max(value.abs()));
        for (a, b) in list.iter().zip(lattice) {
            let error = (a - b).abs() / largest;
            assert!(error < 1e-9, "{field:?}: {a} {b}");
        }
    }
    // With the grid divided over several ranks, the lattice gives equal bits.
    for ((field, one), (_, three)) in lattice.iter().zip(&measure::<D>(3, &with("lattice"))) {
        assert_eq!(one, three, "{field:?}");
    }
}

fn deck(template: &str, law: &str, ratio: &str, grid: &str, alpha: &str) -> String {
    template
        .replace("LAW", law)
        .replace("RATIO", ratio)
        .replace("GRID", grid)
        .replace("ALPHA", alpha)
}

#[test]
fn prototype_microelastic_bonds() {
    let grid = "horizon = 3.015\nvolume_correction = 'none'";
    compare::<3>(&deck(SOLID, "pmb", "", grid, "0.25"));
    compare::<2>(&deck(PLANE, "pmb", "", grid, "0"));
}

#[test]
fn position_aware_bonds() {
    let ratio = ", poisson_ratio = 0.3, surface_correction = 'pals'";
    let grid = "horizon = 3\nvolume_correction = 'exact'";
    compare::<3>(&deck(SOLID, "ordinary", ratio, grid, "0"));
    compare::<2>(&deck(PLANE, "ordinary", ratio, grid, "0.25"));
    let ratio = ratio.replace("pals", "directional");
    compare::<3>(&deck(SOLID, "ordinary", &ratio, grid, "0"));
    compare::<2>(&deck(PLANE, "ordinary", &ratio, grid, "0.25"));
}

#[test]
fn ordinary_bonds() {
    let ratio = ", poisson_ratio = 0.3, influence = 'inverse'";
    let grid = "horizon = 2\nvolume_correction = 'exact'";
    compare::<3>(&deck(SOLID, "ordinary", ratio, grid, "0"));
    compare::<2>(&deck(PLANE, "ordinary", ratio, grid, "0.25"));
}

#[test]
fn normalised_bonds() {
    let grid = "horizon = 2.3\nvolume_correction = 'linear'";
    compare::<3>(&deck(SOLID, "normalised_pmb", "", grid, "0"));
    compare::<2>(&deck(PLANE, "normalised_pmb", "", grid, "0.25"));
}

#[test]
fn bonds_of_bond_associated_correspondence() {
    let (law, ratio) = ("bond_associated_correspondence", ", poisson_ratio = 0.3");
    let grid = "horizon = 1.8\nvolume_correction = 'linear'";
    let of = |template| {
        deck(template, law, ratio, grid, "0.25")
            .replace("brittle.critical_stretch", "brittle.energy")
    };
    compare::<3>(&of(SOLID));
    compare::<2>(&of(PLANE));
}

#[test]
fn bonds_that_hold_more_beside_surfaces() {
    let grid = "horizon = 2.3\nvolume_correction = 'linear'";
    for (law, alpha) in [("ordinary", "0.25"), ("correspondence", "0")] {
        let deck = deck(PLANE, law, ", poisson_ratio = 0.3", grid, alpha).replace(
            "brittle.critical_stretch]",
            "brittle.energy]\nfamily_correction = 1",
        );
        compare::<2>(&deck);
    }
}

/// Ranks without points take part in all collective operations.
#[test]
fn ranks_without_points() {
    let two = "
dimension = 'plane-strain'
grid = { spacing = 1, horizon = 2.3 }
material.one.ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }
damage.brittle.energy = { fracture_energy = 0.01, alpha = ALPHA, family_correction = 1 }
body.pair = { material = 'one', damage = 'brittle', shape.box = { lower = [0, 0], upper = [2, 1] } }
initial.pull.velocity = ['0.02*x', 0]
time.end = 6
";
    for alpha in ["0", "0.25"] {
        let deck = two.replace("ALPHA", alpha);
        assert_eq!(measure::<2>(1, &deck), measure::<2>(4, &deck));
    }
}

#[test]
fn bonds_that_remember() {
    let keys = ", yield_stretch = 0.01";
    let grid = "horizon = 2.3\nvolume_correction = 'linear'";
    compare::<3>(&deck(SOLID, "elastic_plastic_pmb", keys, grid, "0"));
    compare::<2>(&deck(PLANE, "elastic_plastic_pmb", keys, grid, "0.25"));
}

#[test]
fn bonds_that_soften() {
    let keys = ", strength_stretch = 0.01, critical_stretch = 0.3, curve = 'exponential'";
    let grid = "horizon = 2.3\nvolume_correction = 'linear'";
    for template in [SOLID, PLANE] {
        let deck = deck(template, "softening_pmb", keys, grid, "0");
        let deck = deck.replace("damage = 'brittle'\n", "");
        if template == SOLID {
            compare::<3>(&deck);
        } else {
            compare::<2>(&deck);
        }
    }
}

#[test]
fn bonds_that_wear_out() {
    let keys = ", cycles_per_second = 1, fatigue_coefficient = 10, fatigue_exponent = 1.7";
    let grid = "horizon = 2.3\nvolume_correction = 'linear'";
    compare::<3>(&deck(SOLID, "fatigue_pmb", keys, grid, "0"));
    compare::<2>(&deck(PLANE, "fatigue_pmb", keys, grid, "0.25"));
}

/// Return a point file of a plate, written with few digits. The points are regular, except for the map
/// `place` of x.
fn plate_from_file(place: impl Fn(f64) -> f64) -> String {
    let mut text = String::from("x y volume block\n");
    for k in 0..600 {
        let [x, y] = [k % 30, k / 30].map(f64::from);
        if (x - 12.0).hypot(y - 9.0) > 3.0 {
            text += &format!("{:.6} {:.6} 0.06 1\n", 0.3 * place(x) + 0.1, 0.2 * y - 0.7);
        }
    }
    text
}

const FROM_FILE: &str = "
dimension = 'plane-stress'
[grid]
volume_correction = 'none'
horizon = 0.95
[material.one.pmb]
density = 2
youngs_modulus = 5
[body.plate]
material = 'one'
points.file = 'points.txt'
[initial.burst]
velocity = ['0.02*x', '0.02*y + 0.003*sin(x)']
[time]
end = 2
";

#[test]
fn a_grid_is_found_in_a_file() {
    let folder = Folder::new("grid-in-a-file");
    let with = |family: &str| {
        let text = FROM_FILE.replace("[grid]", &format!("[grid]\nfamily = '{family}'"));
        folder.write(&format!("{family}.toml"), &text)
    };
    let check = |family: &str| {
        let mut command = fissure(1);
        command.arg("check").arg(with(family));
        finish(&mut command)
    };
    folder.write("points.txt", &plate_from_file(|x| x));
    let count = |checked: &str, name: &str| {
        let mut lines = checked.lines().map(str::trim);
        let number = lines.find_map(|line| line.strip_prefix(name));
        number.unwrap().trim().to_owned()
    };
    let checked = text(&check("auto"));
    let [bonds, kept] = ["bonds", "of them as lattice"].map(|name| count(&checked, name));
    assert_eq!(bonds, kept, "{checked}");
    // Equal bits for any partition of the points of the file, and the same physics as with lists.
    let run = |family: &str, ranks: usize| {
        let out = folder.join(format!("{family}{ranks}"));
        let mut command = fissure(ranks);
        command
            .arg("run")
            .arg(with(family))
            .arg("--output")
            .arg(&out);
        succeed(&mut command);
        datasets(&out.join("result.vtkhdf"))
    };
    let [one, three, list] = [run("lattice", 1), run("auto", 3), run("list", 1)];
    assert_eq!(difference(&one, &three), None);
    let last = |all: &BTreeMap<String, Vec<u64>>| -> Vec<f64> {
        let (_, bits) = all
            .iter()
            .rfind(|(name, _)| name.starts_with("displacement"))
            .unwrap();
        bits.iter().map(|bits| f64::from_bits(*bits)).collect()
    };
    for (a, b) in last(&one).into_iter().zip(last(&list)) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
    // Shift one column of points slightly.
    folder.write(
        "points.txt",
        &plate_from_file(|x| if x == 7.0 { 7.01 } else { x }),
    );
    let wrong = check("lattice");
    assert_eq!(wrong.status.code(), Some(2));
    assert!(
        text(&wrong).contains("needs points of equal volume on a regular grid"),
        "{}",
        text(&wrong)
    );
    assert_eq!(count(&text(&check("auto")), "of them as lattice"), "0");
}

/// Run a deck with limited vector instructions, and return the values of all datasets.
fn run_with(
    instructions: &str,
    folder: &Folder,
    ranks: usize,
    deck: &str,
) -> BTreeMap<String, Vec<u64>> {
    let deck = folder.write(&format!("{instructions}.toml"), deck);
    let out = folder.join(format!("{instructions}{ranks}"));
    let mut command = fissure(ranks);
    command.env("FISSURE_INSTRUCTIONS", instructions);
    succeed(command.arg("run").arg(deck).arg("--output").arg(&out));
    datasets(&out.join("result.vtkhdf"))
}

#[test]
fn all_instructions_agree() {
    let ratio = ", poisson_ratio = 0.3";
    for family in ["list", "lattice"] {
        let folder = Folder::new(&format!("instructions-{family}"));
        let grid = format!("horizon = 2.3\nfamily = '{family}'");
        let deck = deck(PLANE, "ordinary", ratio, &grid, "0.25");
        let best = run_with("avx512", &folder, 1, &deck);
        for ranks in [1, 3] {
            let found = run_with("avx2", &folder, ranks, &deck);
            assert_eq!(difference(&best, &found), None, "{family} {ranks}");
        }
    }
}

#[test]
fn unknown_instructions_are_told() {
    let folder = Folder::new("no-instructions");
    let deck = folder.write("deck.toml", &deck(PLANE, "pmb", "", "horizon = 3", "0"));
    let mut command = fissure(2);
    command.env("FISSURE_INSTRUCTIONS", "sse9");
    let output = finish(command.arg("run").arg(deck));
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output).contains("`sse9` is none of"),
        "{}",
        text(&output)
    );
}
