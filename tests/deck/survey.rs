//! The survey that `check` and the start of a run print: figures of the bodies, and warnings about probable
//! mistakes.

use crate::support::command::Folder;
use crate::support::{problem, simulate, simulate_on};
use fissure::families::VolumeFactors;
use fissure::problem::VolumeCorrection;
use fissure::solver::steps::even_clock;
use fissure::survey::{Cost, Survey, dry_run, interior, size};

/// Return the deck of a plate of 12 × 8 cells, with further lines.
fn plate(extra: &str) -> String {
    format!(
        "dimension = 'plane-stress'
        thickness = 0.5
        grid = {{ volume_correction = 'none', spacing = 1, horizon = 3 }}
        material.glass.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.plate = {{ material = 'glass', shape.box = {{ lower = [0, 0], upper = [12, 8] }} }}
        {extra}
        time.end = 1
        "
    )
}

/// Return the warnings of a plane deck; they must be equal on any number of ranks.
fn warnings(text: &str) -> Vec<String> {
    warnings_in::<2>(text)
}

/// Return the warnings of a deck of a dimension; they must be equal on any number of ranks.
fn warnings_in<const D: usize>(text: &str) -> Vec<String> {
    let alone = simulate::<D, _>(text, |mut simulation| Survey::new(&mut simulation).warnings);
    for ranks in [2, 3] {
        for warnings in simulate_on::<D, _>(ranks, text, |mut simulation| {
            Survey::new(&mut simulation).warnings
        }) {
            assert_eq!(warnings, alone, "{ranks} ranks");
        }
    }
    alone.into_iter().map(|warning| warning.message).collect()
}

#[track_caller]
fn warns(extra: &str, expected: &[&str]) {
    assert_eq!(warnings(&plate(extra)), expected);
}

#[test]
fn nothing_is_wrong_with_a_plain_deck() {
    warns("", &[]);
    warns(
        "crack.notch.segment = { from = [0, 4], to = [6, 4] }
        set.left.where = 'x < 1'
        set.right.where = 'x > 11'
        condition.hold = { set = 'left', displacement = [0, 'free'] }
        condition.pull = { set = 'right', traction = ['t', 0] }
        history.probe.tip.at = [6, 4]",
        &[],
    );
}

#[test]
fn figures_of_bodies_cracks_and_probes() {
    let text = plate(
        "body.block = { material = 'glass', shape.box = { lower = [12, 0], upper = [14, 4] } }
        crack.notch.segment = { from = [-1, 4], to = [1, 4] }
        crack.other.segment = { from = [-1, 4], to = [2, 4] }
        set.left.where = 'x < 3'
        history.probe.near.at = [0.6, 0.4]
        history.reactions = ['left']",
    );
    let survey =
        |ranks| simulate_on::<2, _>(ranks, &text, |mut simulation| Survey::new(&mut simulation));
    let found = &survey(1)[0];
    let [plate, block] = [found.bodies[0], found.bodies[1]];
    assert_eq!((plate.points, block.points), (96, 8));
    assert_eq!((plate.volume, plate.mass), (48.0, 96.0));
    assert_eq!(plate.centre, [6.0, 4.0, 0.0]);
    assert_eq!(block.centre, [13.0, 2.0, 0.0]);
    assert!((plate.shape_volume.unwrap() / 48.0 - 1.0).abs() < 1e-3);
    // Count the bonds between both bodies, and the bonds that cross the crack, without the solver.
    let mut joint = 0;
    let mut cut = [0; 2];
    let all: Vec<[i32; 2]> = (0..8)
        .flat_map(|y| (0..14).map(move |x| [x, y]))
        .filter(|[x, y]| *x < 12 || *y < 4)
        .collect();
    for (k, a) in all.iter().enumerate() {
        for b in &all[k + 1..] {
            let offset = [b[0] - a[0], b[1] - a[1]];
            if offset[0].pow(2) + offset[1].pow(2) > 9 {
                continue;
            }
            joint += u64::from((a[0] < 12) != (b[0] < 12));
            // Position x at which the bond crosses y = 4; centres of cells are at half-integers.
            let [ya, yb] = [a[1], b[1]].map(|y| f64::from(y) + 0.5 - 4.0);
            if ya * yb < 0.0 {
                let x = f64::from(a[0]) + 0.5 + f64::from(offset[0]) * ya / (ya - yb);
                cut[0] += u64::from(x <= 1.0 + 1e-9);
                cut[1] += u64::from(x <= 2.0 + 1e-9);
            }
        }
    }
    assert_eq!(found.bonds_between_bodies, [([0, 1], joint)]);
    assert_eq!(found.cuts, cut);
    assert_eq!(found.probes[0].id, 0);
    assert!((found.probes[0].distance - 0.02_f64.sqrt()).abs() < 1e-15);
    assert_eq!(found.sets, [104, 96, 8, 24]);
    for ranks in [2, 3] {
        for other in survey(ranks) {
            assert_eq!(other.bodies, found.bodies);
            assert_eq!(other.bonds_between_bodies, found.bonds_between_bodies);
            assert_eq!((&other.cuts, &other.sets), (&found.cuts, &found.sets));
            assert_eq!(other.probes[0].id, found.probes[0].id);
        }
    }
}

#[test]
fn a_tip_on_another_crack_than_the_one_at_its_start_is_told() {
    let cracks = "set.low.where = 'y < 4'
        history.reactions = ['low']
        crack.left.segment = { from = [-1, 2], to = [4, 2] }
        crack.right.segment = { from = [13, 6], to = [8, 6] }
        ";
    let told = |tip: &str, expected: &[&str]| {
        warns(
            &format!("{cracks}history.tip.notch = {{ {tip} }}"),
            expected,
        );
    };
    told(
        "from = [0, 2], direction = [1, 0]",
        &[
            "[history.tip.notch]: the farthest damage along `direction`, at [11.5, 5.5] m, lies on another crack than \
             the damage at `from`; give a `set` that contains the points of one crack only",
        ],
    );
    told(
        "from = [12, 6], direction = [-1, 0]",
        &[
            "[history.tip.notch]: the farthest damage along `direction`, at [0.5, 0.5] m, lies on another crack than \
             the damage at `from`; give a `set` that contains the points of one crack only",
        ],
    );
    told("from = [0, 2], direction = [1, 0], set = 'low'", &[]);
    // No crack begins at `from`.
    told("from = [0, 7.5], direction = [1, 0]", &[]);
}

#[test]
fn motions_of_which_one_takes_the_place_of_the_other() {
    let sets = "set.left.where = 'x < 1'\nset.low.where = 'y < 1'\n";
    let both = |first: &str, second: &str| {
        format!(
            "{sets}condition.first = {{ set = 'left', {first} }}
            condition.second = {{ set = 'low', {second} }}"
        )
    };
    warns(
        &both("displacement = [0, 0]", "velocity = ['free', 1]"),
        &["[condition.second] velocity: overrides [condition.first] in y at 1 point(s)"],
    );
    warns(
        &both("displacement = [0, 0]", "displacement = ['free', 0]"),
        &[],
    );
    warns(
        &both("displacement = [0, 'free']", "displacement = ['free', 1]"),
        &[],
    );
}

#[test]
fn loads_on_a_layer_of_another_depth() {
    let pulled = |set: &str, depth: &str| {
        format!(
            "set.end.where = '{set}'
            condition.pull = {{ set = 'end', traction = [1, 0]{depth} }}"
        )
    };
    warns(&pulled("x > 11", ""), &[]);
    warns(&pulled("x > 11 && abs(y - 4) < 2", ""), &[]);
    warns(
        &pulled("hypot(x - 6, y - 4) > 3 && hypot(x - 6, y - 4) < 4", ""),
        &[],
    );
    warns(
        &pulled("x > 9", ""),
        &[
            "[condition.pull] traction: acts on a layer about 3.00e0 m thick but is divided by the \
             spacing, 1 m; give the thickness of the layer as `depth`",
        ],
    );
    warns(&pulled("x > 9", ", depth = 3"), &[]);
    let fine = "body.fine = { material = 'glass', spacing = 0.5, shape.box = { lower = [0, 0], upper = [6, 8] } }\n";
    let of_fine = |set: &str| fine.to_owned() + &pulled(set, "");
    warns(&of_fine("x > 11 || x < 0.5"), &[]);
    warns(
        &of_fine("x > 11 || x < 1.5"),
        &[
            "[condition.pull] traction: acts on a layer about 1.50e0 m thick but is divided by the \
             spacing, 0.5 m; give the thickness of the layer as `depth`",
        ],
    );
}

/// Return the thickness (m) that the warning about a loaded layer names; `None` without this warning. The
/// spacing is 1 m. `place` is the condition for the layer.
fn thickness_of_layer<const D: usize>(shape: &str, place: &str) -> Option<f64> {
    let (dimension, traction) = match D {
        2 => ("plane-stress", "['t', 0]"),
        _ => ("3d", "['t', 0, 0]"),
    };
    let text = format!(
        "dimension = '{dimension}'
        grid = {{ spacing = 1, horizon = 2.5 }}
        material.glass.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.b = {{ material = 'glass', shape.{shape} }}
        set.s.where = '{place}'
        condition.pull = {{ set = 's', traction = {traction} }}
        time.end = 10
        "
    );
    let begin = "[condition.pull] traction: acts on a layer about ";
    let found = warnings_in::<D>(&text);
    let rest = found.iter().find_map(|text| text.strip_prefix(begin))?;
    let (number, _) = rest.split_once(" m thick").unwrap();
    Some(number.parse().unwrap())
}

#[track_caller]
fn is_thick(thickness: Option<f64>, wanted: f64) {
    let thickness = thickness.unwrap();
    assert!((thickness / wanted - 1.0).abs() < 0.12, "{thickness}");
}

#[test]
fn layers_along_curved_and_oblique_faces() {
    let ring = "difference = [{ disc = { centre = [0, 0], radius = 24 } }, { disc = { centre = [0, 0], radius = 12 } }]";
    let of_ring = |place| thickness_of_layer::<2>(ring, place);
    assert_eq!(of_ring("hypot(x, y) < 13"), None);
    assert_eq!(of_ring("hypot(x, y) > 23"), None);
    is_thick(of_ring("hypot(x, y) < 14"), 2.0);
    is_thick(of_ring("hypot(x, y) > 21"), 3.0);
    let of_plate =
        |place| thickness_of_layer::<2>("box = { lower = [0, 0], upper = [12, 8] }", place);
    assert_eq!(of_plate("x < 1 && y < 1"), None);
    is_thick(of_plate("x < 2 && y < 2"), 2.0);
    // A face along the diagonal of the cells; two rows of cells lie in a layer one cell thick.
    let triangle = "polygon.vertices = [[0, 0], [20.2, 0], [0, 20.2]]";
    let of_triangle = |place| thickness_of_layer::<2>(triangle, place);
    assert_eq!(of_triangle("x + y > 20.2 - sqrt(2)"), None);
    is_thick(of_triangle("x + y > 20.2 - 2*sqrt(2)"), 2.0);
    let shell = "difference = [{ sphere = { centre = [0, 0, 0], radius = 10 } }, { sphere = { centre = [0, 0, 0], radius = 5 } }]";
    let of_shell = |place| thickness_of_layer::<3>(shell, place);
    assert_eq!(of_shell("hypot(hypot(x, y), z) < 6"), None);
    assert_eq!(of_shell("hypot(hypot(x, y), z) > 9"), None);
    is_thick(of_shell("hypot(hypot(x, y), z) < 7"), 2.0);
    is_thick(of_shell("hypot(hypot(x, y), z) > 7"), 3.0);
}

#[test]
fn loads_without_effect_and_against_the_surface() {
    let sets = "set.end.where = 'x > 11'\n";
    let load = |load: &str| format!("{sets}condition.load = {{ set = 'end', {load} }}");
    let nothing = "is 0 and has no effect";
    warns(
        &load("force = [0, '0*2']"),
        &[&format!("[condition.load] force: {nothing}")],
    );
    let held = "\ncondition.hold = { set = 'end', displacement = [0, 'free'] }";
    warns(
        &(load("body_force = [1, 0]") + held),
        &[
            "[condition.load] body_force: acts only on points with prescribed motion and has no effect",
        ],
    );
    warns(&(load("body_force = [1, 't']") + held), &[]);
    warns(&load("pressure = 1, normal = [1, 0]"), &[]);
    warns(
        &load("pressure = 1, normal = [-1, 0]"),
        &[
            "[condition.load] pressure: `normal` points into the body, so the pressure pulls; give the outward normal",
        ],
    );
}

#[test]
fn cracks_and_probes_far_from_the_points() {
    warns(
        "crack.notch.segment = { from = [20, 4], to = [26, 4] }",
        &["[crack.notch]: cuts no bond"],
    );
    warns(
        "history.probe.tip.at = [12, 14]",
        &["[history.probe.tip] at: the nearest point is 6.519e0 m away, at [11.5, 7.5] m"],
    );
}

#[test]
fn sets_that_hold_next_to_nothing() {
    warns(
        "set.corner.where = 'x < 1 && y < 1'
        initial.push = { set = 'corner', velocity = [1, 0] }",
        &["[set.corner]: has 1 point(s) only"],
    );
    warns(
        "set.corner.ids = [0]
        initial.push = { set = 'corner', velocity = [1, 0] }",
        &[],
    );
}

#[test]
fn numbers_that_no_solid_has() {
    let brittle = |stretch: f64| {
        plate("").replace(
            "material = 'glass',",
            "material = 'glass', damage = 'brittle',",
        ) + &format!("damage.brittle.critical_stretch.critical_stretch = {stretch}\n")
    };
    let expected = "[body.plate] damage: its bonds break at a stretch of 2.500, that is, at 3.500 times \
                    their initial length";
    let timid = brittle(2.5).replace("time.end = 1", "time = { end = 1, safety = 0.7 }");
    assert_eq!(warnings(&timid), [expected]);
    assert!(warnings(&brittle(0.5)).is_empty());
    let bold = brittle(0.5).replace("time.end = 1", "time = { end = 1, safety = 0.95 }");
    let expected = "[body.plate] damage: its bonds break at a stretch of 0.500; at this stretch, the step is stable only with `safety = 0.86` or less, but `safety` is 0.95";
    assert_eq!(warnings(&bold), [expected]);
    let wide = plate("").replace("horizon = 3", "horizon = 9");
    let wide = wide.replace("time.end = 1", "time.end = 10");
    let expected = "[body.plate]: its horizon, 9 m, is 9 spacings; 3 to 6 are usual";
    assert_eq!(warnings(&wide), [expected]);
    let long = plate("").replace("time.end = 1", "time.end = 4e12");
    let found = warnings(&long);
    assert_eq!(found.len(), 1);
    assert!(
        found[0].starts_with("[time] end: the run takes "),
        "{found:?}"
    );
    let fast = plate("").replace("time.end = 1", "time = { end = 10, step = 5 }");
    let found = warnings(&fast);
    assert!(found[0].starts_with("[time] step: 5.0000e0 s is larger than the stable step"));
}

#[test]
fn volume_that_is_lost() {
    let cut = plate("").replace("upper = [12, 8]", "upper = [12.4, 8]");
    let found = warnings(&cut);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        found[0].starts_with("[body.plate]: the grid does not divide this body evenly"),
        "{found:?}"
    );
    assert!(
        found[0].contains("are 3.22 % too small; choose a spacing"),
        "{found:?}"
    );
    // A finer body overlaps 2.25 rows and columns of the plate.
    let overlap = plate(
        "body.fine = { material = 'glass', spacing = 0.75, shape.box = { lower = [0, 0], upper = [2.25, 2.25] } }",
    );
    let found = warnings(&overlap);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].contains("volume and mass are 1.1"), "{found:?}");
}

#[test]
fn areas_for_volumes() {
    let folder = Folder::new("areas");
    let rows = |volume: f64| {
        let row = |k: i32| format!("{} {} {volume} 1\n", k % 10, k / 10);
        (0..100).map(row).collect::<String>()
    };
    let of = |volume: f64| {
        let file = folder.write("points.txt", &rows(volume));
        warnings(&format!(
            "dimension = 'plane-stress'
            thickness = 1e-3
            grid.horizon = 3
            material.glass.pmb = {{ density = 2, youngs_modulus = 5 }}
            body.plate = {{ material = 'glass', points.file = '{}' }}
            time.end = 10
            ",
            file.display()
        ))
    };
    assert!(of(1e-3).is_empty(), "{:?}", of(1e-3));
    let found = of(1.0);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        found[0].contains("check that volumes are in m³"),
        "{found:?}"
    );
}

#[test]
fn a_point_inside_is_as_stiff_as_the_lattice_makes_it() {
    let body = |dimension: &str, law: &str, corners: &str, grid: &str| {
        problem(&format!(
            "dimension = '{dimension}'
            grid = {{ spacing = 0.1, horizon = 0.3{grid} }}
            material.solid.{law} = {{ density = 2, youngs_modulus = 5 {} }}
            body.block = {{ material = 'solid', shape.box = {{ {corners} }} }}
            time.end = 1
            ",
            if law == "ordinary" {
                ", poisson_ratio = 0.3"
            } else {
                ""
            }
        ))
    };
    let space = "lower = [0, 0, 0], upper = [1, 1, 1]";
    // Expected bulk modulus of `pmb`, divided by the exact one: Σ |ξ| V over the 122 neighbours, divided by
    // the integral over the ball, π δ⁴.
    let mut sum = 0.0;
    for x in -3..=3_i32 {
        for y in -3..=3_i32 {
            for z in -3..=3_i32 {
                let square = f64::from(x * x + y * y + z * z);
                if square <= 9.0 {
                    sum += square.sqrt();
                }
            }
        }
    }
    let expected = sum / (std::f64::consts::PI * 81.0);
    let none = ", volume_correction = 'none'";
    let found = interior(&body("3d", "pmb", space, none), 0).unwrap();
    assert_eq!(found.neighbours, 122);
    assert!((found.exact[0] / (10.0 / 3.0) - 1.0).abs() < 1e-12);
    assert!((found.bulk / found.exact[0] / expected - 1.0).abs() < 1e-6);
    // The ordinary law has the exact bulk modulus, and shear moduli 11 % too high and 16.5 % too low.
    let found = interior(&body("3d", "ordinary", space, none), 0).unwrap();
    assert!((found.bulk / found.exact[0] - 1.0).abs() < 1e-6);
    let shear = found
        .shear
        .unwrap()
        .map(|modulus| modulus / found.exact[1] - 1.0);
    assert!((shear[0] - 0.11).abs() < 5e-3, "{shear:?}");
    assert!((shear[1] + 0.165).abs() < 5e-3, "{shear:?}");
    // With the default volume correction, all moduli are correct within some per cent.
    let plane = "lower = [0, 0], upper = [1, 1]";
    for (dimension, law, corners, most) in [
        ("plane-stress", "pmb", plane, 0.04),
        ("plane-stress", "ordinary", plane, 0.02),
        ("plane-strain", "ordinary", plane, 0.02),
        ("3d", "pmb", space, 0.03),
        ("3d", "ordinary", space, 0.0065),
    ] {
        let found = interior(&body(dimension, law, corners, ""), 0).unwrap();
        let shear = found.shear.unwrap();
        for (modulus, wanted) in [(found.bulk, 0), (shear[0], 1), (shear[1], 1)] {
            let off = modulus / found.exact[wanted] - 1.0;
            assert!(off.abs() < most, "{dimension} {law} {off}");
        }
    }
    for (dimension, corners) in [
        ("1d", "lower = [0], upper = [1]"),
        (
            "1d'\nconstraint = 'uniaxial-strain",
            "lower = [0], upper = [1]",
        ),
        ("plane-stress", "lower = [0, 0], upper = [1, 1]"),
        ("plane-strain", "lower = [0, 0], upper = [1, 1]"),
        ("3d", space),
    ] {
        let exact = body(dimension, "pmb", corners, ", volume_correction = 'exact'");
        let found = interior(&exact, 0).unwrap();
        // Expected bulk modulus, divided by the exact one: Σ |ξ| Ṽ over the family, divided by the integral
        // of |ξ| over the ball, disc or interval of radius δ.
        let count = exact.dimension.count();
        let factors = VolumeFactors::new(VolumeCorrection::Exact, 3.0, 1.0, count);
        let range = |k: usize| if k < count { -5..=5 } else { 0..=0 };
        let mut sum = 0.0;
        for [x, y, z] in range(0)
            .flat_map(|x| range(1).flat_map(move |y| range(2).map(move |z| [x, y, z])))
            .map(|cell: [i32; 3]| cell.map(f64::from))
        {
            sum += (x * x + y * y + z * z).sqrt() * factors.at([x, y, z]);
        }
        let pi = std::f64::consts::PI;
        let whole = [9.0, 18.0 * pi, 81.0 * pi][count - 1];
        let bulk = found.bulk / found.exact[0];
        assert!(
            (bulk / (sum / whole) - 1.0).abs() < 1e-6,
            "{dimension}: {bulk}"
        );
        // In 3-D with m = 3 the sum is 1.8 % above the integral; in 1-D and 2-D the error is smaller.
        assert!((bulk - 1.0).abs() < 0.018, "{dimension}: {bulk}");
    }
}

#[test]
fn the_size_of_a_run_without_making_it() {
    let decks = [
        plate("body.fine = { material = 'glass', spacing = 0.5, shape.disc = { centre = [16, 4], radius = 4 } }"),
        plate("").replace("shape.box = { lower = [0, 0], upper = [12, 8] }", "shape.union = [ { box = { lower = [0, 0], upper = [40, 40] } }, { box = { lower = [1e5, 0], upper = [100040, 40] } } ]"),
    ];
    for text in &decks {
        let estimate = size(&problem(text)).unwrap();
        simulate::<2, _>(text, |simulation| {
            let points = simulation.model.total as f64;
            let bonds = simulation.forces.directed_bonds() as f64;
            assert!(
                (estimate.all_points() / points - 1.0).abs() < 0.01,
                "{estimate:?} {points}"
            );
            assert!(
                (estimate.directed_bonds() / bonds - 1.0).abs() < 0.1,
                "{estimate:?} {bonds}"
            );
        });
    }
    // For a horizon larger than the body, each point is bonded to all other points.
    let wide = plate("").replace("horizon = 3", "horizon = 3e12");
    let found = size(&problem(&wide)).unwrap();
    assert_eq!(found.directed_bonds(), 96.0 * 95.0);
    let large = "dimension = '3d'
        grid = { volume_correction = 'none', spacing = 5e-4, horizon = 1.5e-3 }
        material.glass.pmb = { density = 2, youngs_modulus = 5 }
        body.cube = { material = 'glass', shape.box = { lower = [0, 0, 0], upper = [1, 1, 1] } }
        time.end = 1";
    let found = size(&problem(large)).unwrap();
    assert_eq!(found.all_points(), 8e9);
    assert!(
        (found.directed_bonds() / (122.0 * 8e9) - 1.0).abs() < 0.01,
        "{found:?}"
    );
}

/// Write a point file with rows of ten points, and `count` points in each block.
fn blocks_of_points(folder: &Folder, count: i32, blocks: i32) -> std::path::PathBuf {
    let row = |k: i32| format!("{} {} 1 {}\n", k % 10, k / 10, k / count);
    let rows: String = (0..count * blocks).map(row).collect();
    folder.write("points.txt", &rows)
}

#[test]
fn each_body_counts_its_own_rows_of_a_file() {
    let folder = Folder::new("blocks");
    // The second file is long, so that only parts of it are read.
    for (count, blocks, off) in [(200, 3, 0.0), (120_000, 10, 0.02)] {
        let file = blocks_of_points(&folder, count, blocks);
        let body = |block: i32| {
            let file = file.display();
            format!(
                "body.b{block} = {{ material = 'm', points = {{ file = '{file}', block = {block} }} }}\n"
            )
        };
        let bodies: String = (0..blocks).map(body).collect();
        let text = format!(
            "dimension = 'plane-stress'
            grid.horizon = 3
            material.m.pmb = {{ density = 1, youngs_modulus = 1 }}
            {bodies}
            output.set = 'b1'
            time.end = 1
            "
        );
        let found = size(&problem(&text)).unwrap();
        assert_eq!(found.points.len(), blocks as usize);
        let near = |found: f64, expected: f64, off: f64| (found / expected - 1.0).abs() <= off;
        for points in &found.points {
            assert!(near(*points, f64::from(count), off), "{found:?}");
        }
        assert!(
            near(found.output_points[0], f64::from(count), off),
            "{found:?}"
        );
        // Expected bonds: the area of the family minus the area of the point itself.
        let bonds = found.directed_bonds() / found.all_points();
        assert!(
            (bonds - (9.0 * std::f64::consts::PI - 1.0)).abs() < 1e-9,
            "{bonds}"
        );
    }
}

#[test]
fn the_estimated_result_holds_the_set_of_the_output() {
    for set in [
        "set.some.where = 'x < 10'",
        "set.some.shape.disc = { centre = [20, 20], radius = 8 }",
        "set.some.ids = [1, 2, 3]",
    ] {
        for output in [
            "output.every_steps = 1",
            "output = { every_steps = 1, set = 'some' }",
            "output = { every_steps = 1, set = 'block' }",
            "output = { every_steps = 3, few = { every_steps = 1, fields = ['stress'], set = 'some' } }",
        ] {
            let text = plate(&format!(
                "{set}
                {output}
                history.every_steps = 1000
                history.reactions = ['some']
                body.block = {{ material = 'glass', shape.box = {{ lower = [12, 0], upper = [112, 100] }} }}"
            ));
            let problem = problem(&text);
            let look = dry_run(&problem, 1, false).unwrap_or_else(|error| panic!("{error}"));
            let clock = even_clock(&problem, &look.steps);
            let estimate = Cost::estimate(&problem, &size(&problem).unwrap(), &clock);
            assert_eq!(estimate.results.len(), look.cost.results.len());
            for (estimate, found) in estimate.results.iter().zip(&look.cost.results) {
                assert_eq!(estimate.outputs, found.outputs);
                let off = estimate.bytes / found.bytes - 1.0;
                assert!(off.abs() < 0.02, "{output} {set}: {off}");
            }
        }
    }
}

#[test]
fn the_estimated_checkpoint_holds_the_history_of_bonds() {
    let remembers = "ordinary_viscoelastic = { density = 2, youngs_modulus = 5, poisson_ratio = 0.2, \
                     relaxation_time = 1, relaxing_share = 0.5 }";
    for law in [
        "pmb = { density = 2, youngs_modulus = 5 }",
        "elastic_plastic_pmb = { density = 2, youngs_modulus = 5, yield_stretch = 0.1 }",
        remembers,
    ] {
        let text = plate("")
            .replace("pmb = { density = 2, youngs_modulus = 5 }", law)
            .replace("upper = [12, 8]", "upper = [120, 80]");
        let problem = problem(&text);
        let look = dry_run(&problem, 1, false).unwrap_or_else(|error| panic!("{error}"));
        let clock = even_clock(&problem, &look.steps);
        let estimate = Cost::estimate(&problem, &size(&problem).unwrap(), &clock);
        let off = estimate.checkpoint / look.cost.checkpoint - 1.0;
        assert!(off.abs() < 0.1, "{law}: {off}");
    }
}

#[test]
fn steps_follow_the_limits_of_an_adaptive_step() {
    // The stable step is about 0.4 s; no bond breaks.
    for (step, largest) in [
        ("", 0.011),
        ("step = 0.02, ", 0.11),
        ("step = 0.02, ", 0.02),
    ] {
        let time = format!("time = {{ end = 4, {step}adaptive.largest = {largest} }}");
        let text = plate("").replace("time.end = 1", &time);
        let look = dry_run(&problem(&text), 1, false).unwrap();
        let made = simulate::<2, _>(&text, |mut simulation| {
            while !simulation.is_over() {
                simulation.advance();
            }
            simulation.clock.number()
        });
        assert_eq!(look.steps.len(), 1);
        let (first, steps) = look.steps[0];
        let expected = if step.is_empty() { largest } else { 0.02 };
        assert_eq!((first, steps), (expected, made as f64), "{time}");
    }
}

#[test]
fn loads_that_act_in_no_stage_need_no_depth() {
    let folder = Folder::new("idle-load");
    let path = folder.write("points.csv", "x,y,volume\n0,20,1\n1,20,1\n");
    let text = plate(&format!(
        "body.other = {{ material = 'glass', points.file = '{}' }}
        set.low.where = 'y < 1 || y > 15'
        condition.press = {{ set = 'low', traction = [0, 1] }}
        stage = [{{ end = 0.5, off = ['press'] }}, {{ off = ['press'] }}]",
        path.display()
    ));
    let found = warnings(&text);
    assert!(
        found.iter().all(|text| !text.contains("depth")),
        "{found:?}"
    );
}

#[test]
fn points_of_two_bodies_at_one_position_are_told() {
    let folder = Folder::new("coincident");
    let mut points = String::from("x,y,volume,block\n");
    for block in [1, 2] {
        for k in 0..12 {
            // Three points of the second body coincide with points of the first body.
            let shift = if block == 2 && k > 2 { 0.4 } else { 0.0 };
            let (x, y) = (k % 4, k / 4);
            points += &format!("{x},{},1,{block}\n", f64::from(y) + shift);
        }
    }
    let path = folder.write("points.csv", &points);
    let deck = |contact: &str| {
        let path = path.display();
        format!(
            "dimension = 'plane-strain'
            grid = {{ horizon = 3 }}
            interface.rule = 'none'
            {contact}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            body.first = {{ material = 'rubber', points = {{ file = '{path}', block = 1 }} }}
            body.second = {{ material = 'rubber', points = {{ file = '{path}', block = 2 }} }}
            time.end = 1
            "
        )
    };
    let expected = "[body.second]: 3 pair(s) of points of different bodies lie at the same position and never touch, such as \
                    point 0 of `first` and point 12 of this body; move one of the bodies, or leave these points out of it";
    let about = |warnings: Vec<String>| {
        let mut all = warnings.into_iter();
        all.find(|warning| warning.contains("same position"))
    };
    assert_eq!(
        about(warnings(&deck("contact = {}"))).as_deref(),
        Some(expected)
    );
    assert_eq!(about(warnings(&deck(""))), None);
}
