//! Areas and fronts of cracks in 3-D, in the history and in the tables beside the history.

use std::f64::consts::PI;

use fissure::solver::Simulation;
use fissure::solver::observers::{HistoryObserver, Snapshot, Surface};

use crate::support::command::{Folder, fissure, succeed};
use crate::support::history::column;
use crate::support::{simulate, simulate_on};

/// Return the surface of the only crack. Assert that the history has the same area and reach.
fn crack(simulation: &mut Simulation<3>) -> Surface {
    let mut observer = HistoryObserver::new(simulation).unwrap_or_else(|error| panic!("{error}"));
    let snapshot = Snapshot::new(simulation);
    let surface = observer.crack_surfaces(simulation, &snapshot).remove(0).2;
    let row = observer.row(simulation, &snapshot).values;
    let value = |name| row[column(&observer, name)];
    assert_eq!(value("crack_main_area"), surface.area);
    assert_eq!(value("crack_main_reach"), surface.reach);
    surface
}

/// Return the deck of a cube with an edge of 1 m and its centre at the origin. `cells` is the number of cells
/// along an edge; `cuts` are pre-cracks.
fn cube(cells: usize, cuts: &str) -> String {
    format!(
        "dimension = '3d'
        parameters = {{ dx = '1/{cells}' }}
        grid = {{ spacing = 'dx', horizon = '3*dx' }}
        material.glass.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.cube = {{ material = 'glass', shape.box = {{ lower = [-0.5, -0.5, -0.5], upper = [0.5, 0.5, 0.5] }} }}
        history.crack.main = {{ from = [0, 0, 0] }}
        time = {{ end = 1 }}
        {cuts}"
    )
}

/// Return a pre-crack: a disc with its centre at the origin.
fn disc(normal: [f64; 3], radius: f64) -> String {
    format!(
        "crack.main.disc = {{ centre = [0, 0, 0], normal = {normal:?}, radius = {radius:?} }}\n"
    )
}

/// Return the surface of the crack in a cube. Assert that two and three ranks find the same surface.
fn surface(cells: usize, cuts: &str) -> Surface {
    let deck = cube(cells, cuts);
    let surface = simulate::<3, _>(&deck, |mut simulation| crack(&mut simulation));
    for ranks in [2, 3] {
        for other in simulate_on::<3, _>(ranks, &deck, |mut simulation| crack(&mut simulation)) {
            assert_eq!(other, surface, "{cuts} on {ranks} ranks");
        }
    }
    surface
}

/// The horizon of the grid may be that of another body.
#[test]
fn a_crack_is_measured_with_the_horizon_of_its_body() {
    let area = |grid: &str| {
        let deck = cube(12, &disc([0.0, 0.0, 1.0], 0.25))
            .replace("spacing = 'dx', horizon = '3*dx'", grid)
            .replace(
                "material = 'glass', shape",
                "material = 'glass', spacing = 'dx', horizon = '3*dx', shape",
            );
        simulate::<3, _>(&deck, |mut simulation| crack(&mut simulation).area)
    };
    assert_eq!(
        area("spacing = 'dx/4', horizon = '0.75*dx'"),
        area("spacing = 'dx', horizon = '3*dx'")
    );
}

#[test]
fn a_plane_across_a_block_has_its_area_in_each_direction_and_no_front() {
    // Normals of planes through the centre of the cube, and the areas of these sections. The section across
    // the space diagonal is a regular hexagon.
    let planes = [
        ([0.0, 0.0, 1.0], 1.0),
        ([1.0, 0.0, 0.0], 1.0),
        ([1.0, 1.0, 0.0], 2_f64.sqrt()),
        ([1.0, 1.0, 1.0], 0.75 * 3_f64.sqrt()),
        ([1.0, 0.0, 2.0], 1.25_f64.sqrt()),
    ];
    for (normal, area) in planes {
        let errors = [12, 24].map(|cells| {
            let found = surface(cells, &disc(normal, 2.0));
            assert!(found.front.is_empty(), "{normal:?}: {:?}", found.front);
            let error = found.area / area - 1.0;
            println!("plane {normal:?}, {cells} cells: {error:.4}");
            error
        });
        // The error comes from the layers of points at the faces of the block, so a finer grid has a smaller
        // error.
        assert!(errors[0].abs() < 0.05, "{normal:?}: {errors:?}");
        assert!(errors[1].abs() < 0.012, "{normal:?}: {errors:?}");
    }
}

#[test]
fn a_penny_has_its_area_and_its_rim_is_the_front() {
    for normal in [[0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.3, 0.5, 1.0]] {
        let radius = 0.25;
        let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
        let errors = [16, 32].map(|cells| {
            let spacing = 1.0 / cells as f64;
            let Surface { area, reach, front } = surface(cells, &disc(normal, radius));
            let error = area / (PI * radius * radius) - 1.0;
            println!(
                "penny {normal:?}, {cells} cells: {error:.4}, front of {} points",
                front.len()
            );
            assert!((reach - radius).abs() < 1.5 * spacing, "{reach}");
            // Adjacent points of the rim are about one spacing apart. Half of the resulting number is
            // required.
            assert!(front.len() as f64 > PI * radius / spacing, "{front:?}");
            let mut sum = [0.0; 3];
            for place in &front {
                let height: f64 = (0..3).map(|k| place[k] * normal[k]).sum::<f64>() / length;
                assert!(height.abs() < 0.75 * spacing, "{place:?} is {height} above");
                let from_centre = place.iter().map(|x| x * x).sum::<f64>().sqrt();
                let off = from_centre - radius;
                assert!((-2.0 * spacing..spacing).contains(&off), "{place:?}: {off}");
                (0..3).for_each(|k| sum[k] += place[k] / front.len() as f64);
            }
            // The points are evenly distributed along the rim, so their mean is near the centre.
            assert!(sum.iter().all(|x| x.abs() < 0.1 * radius), "{sum:?}");
            error
        });
        // The computed area extends up to 0.08 horizons beyond the rim.
        for (error, cells) in errors.into_iter().zip([16.0, 32.0]) {
            let horizon = 3.0 / cells;
            assert!(
                (0.0..0.16 * horizon / radius).contains(&error),
                "{errors:?}"
            );
        }
        assert!(errors[1] < 0.7 * errors[0], "{errors:?}");
    }
}

#[test]
fn the_front_of_a_notch_is_its_edge_within_the_block() {
    // The notch extends from the left face to x = 0.13, over the whole width along y.
    let cut = |width: f64| {
        format!(
            "crack.main.rectangle = {{ corner = [-1, -1, 0], edge_a = [1.13, 0, 0], edge_b = [0, 2, 0], \
             width = {width:?} }}\nhistory.damage_threshold = 0.3\n"
        )
    };
    for width in [0.0, 0.11] {
        let Surface { area, reach, front } = surface(24, &cut(width));
        // Half of the surface that the cut creates: two faces of 0.63 m², and the end of a notch with a
        // width.
        let half = 0.63 + 0.5 * width;
        assert!((area / half - 1.0).abs() < 0.03, "width {width}: {area}");
        // The corners of the notch at the left face are farthest from the start.
        assert!((reach - 0.5_f64.sqrt()).abs() < 0.04, "{reach}");
        let places = front.iter().map(|place| place[1]);
        assert!(front.len() >= 24, "{front:?}");
        assert!(places.clone().fold(0.0, f64::min) < -0.45 && places.fold(0.0, f64::max) > 0.45);
        for place in &front {
            assert!((0.13 - 2.0 / 24.0..0.15).contains(&place[0]), "{place:?}");
            assert!(place[2].abs() < 0.03, "{place:?}");
        }
    }
}

#[test]
fn a_crack_with_a_width_counts_once_and_another_one_does_not() {
    let slot = |width: f64| {
        format!(
            "crack.main.disc = {{ centre = [0, 0, 0], normal = [0, 0, 1], radius = 2, width = {width:?} }}\n"
        )
    };
    for width in [0.03, 0.14, 0.27] {
        let area = surface(24, &slot(width)).area;
        assert!((area - 1.0).abs() < 0.012, "{width}: {area}");
    }
    let other = "crack.other.rectangle = { corner = [-1, -1, 0.35], edge_a = [2, 0, 0], edge_b = [0, 2, 0] }\n";
    let both = surface(24, &(slot(0.0) + other));
    assert_eq!(both, surface(24, &slot(0.0)));

    let none = surface(12, &other.replace("0.35", "0.4"));
    let expected = Surface {
        area: 0.0,
        reach: 0.0,
        front: Vec::new(),
    };
    assert_eq!(none, expected);
}

#[test]
fn a_layer_of_points_has_the_area_of_its_section() {
    let deck = cube(24, "crack.main.rectangle = { corner = [0.01, -1, -1], edge_a = [0, 2, 0], edge_b = [0, 0, 2] }")
        .replace("lower = [-0.5, -0.5, -0.5], upper = [0.5, 0.5, 0.5]", "lower = [-0.5, -0.5, 0], upper = [0.5, 0.5, 'dx']");
    let area = simulate::<3, _>(&deck, |mut simulation| crack(&mut simulation)).area;
    assert!((24.0 * area - 1.0).abs() < 0.02, "{}", 24.0 * area);
}

#[test]
fn a_penny_that_grows_has_equal_bits_on_two_ranks_and_after_a_restart() {
    let folder = Folder::new("crack_surfaces");
    // Remove the section [refinement] and keep the initial grid.
    let deck = include_str!("../../inputs/penny_crack.toml");
    let (start, refinement) = deck.split_once("[refinement]").unwrap();
    let (_, rest) = refinement.split_once("[material").unwrap();
    let deck = format!("{start}[material{rest}\n[history.crack.penny]\nfrom = [0, 0, 0]\n");
    let deck = folder.write("penny.toml", &deck);
    let run = |ranks, out: &str, extra: &[&str]| {
        let mut command = fissure(ranks);
        command
            .arg("run")
            .arg(&deck)
            .args(["--set", "time.step=1e-7"]);
        command.arg("--output").arg(folder.join(out)).args(extra);
        succeed(&mut command);
        ["crack_penny.csv", "history.csv"]
            .map(|file| std::fs::read_to_string(folder.join(out).join(file)).unwrap())
    };
    let whole = run(1, "one", &[]);
    assert_eq!(run(2, "two", &[]), whole, "the bits depend on the ranks");
    run(3, "parts", &["--set", "time.end=7e-6"]);
    assert_eq!(run(1, "parts", &["--restart"]), whole, "after a restart");

    let [front, history] = whole;
    let mut rows = front.lines();
    assert_eq!(rows.next(), Some("x [m],y [m],z [m],distance [m]"));
    assert!(rows.clone().count() > 20, "{front}");
    for row in rows {
        let row: Vec<f64> = row.split(',').map(|value| value.parse().unwrap()).collect();
        let [x, y, z, distance] = row[..] else {
            panic!("{row:?}");
        };
        assert!((distance - (x * x + y * y + z * z).sqrt()).abs() < 1e-15);
        assert!(distance > 6e-3 && z.abs() < 0.75e-3, "{row:?}");
    }
    let mut lines = history.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name| names.iter().position(|other| *other == name).unwrap();
    let [area, reach] = ["crack_penny_area [m^2]", "crack_penny_reach [m]"].map(column);
    let rows: Vec<Vec<f64>> = lines
        .map(|line| {
            line.split(',')
                .map(|value| value.parse().unwrap())
                .collect()
        })
        .collect();
    let (first, last) = (&rows[0], &rows[rows.len() - 1]);
    let penny = PI * 6e-3 * 6e-3;
    // The computed area extends up to 0.08 δ beyond the rim, so the area is at most 0.16 δ/R too large,
    // relative to πR². Here δ = 0.75 R.
    let excess = first[area] / penny - 1.0;
    assert!((0.0..0.16 * 0.75).contains(&excess), "{excess}");
    // The front lies inside the rim, because the damage near the rim is below the threshold of 0.35.
    assert!((4e-3..6e-3).contains(&first[reach]), "{}", first[reach]);
    assert!(last[area] > 3.0 * first[area] && last[reach] > 9e-3);
}
