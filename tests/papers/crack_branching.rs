//! Crack branching of Dipasquale et al. 2014, section 4. The test runs the deck unchanged, and checks its
//! result.

use std::path::Path;

use crate::support::command::{Folder, fissure, succeed};
use fissure::output::ResultReader;

/// Points with more damage than this are on a crack. Points at the face of a straight cut have a damage of
/// 0.4 or more.
const CRACKED: f64 = 0.38;

/// Columns and rows of the deck's lattice.
const COLUMNS: usize = 100;
const ROWS: usize = 40;

/// Rayleigh speed of soda-lime glass as used in branching benchmarks, m/s.
const RAYLEIGH_SPEED: f64 = 3100.0;

/// Return which points are cracked at an output, by column and row; ids run along x first.
fn cracked(reader: &ResultReader, output: usize) -> Vec<Vec<bool>> {
    let damage = reader.field("damage", output).unwrap();
    let mut cracked = vec![vec![false; ROWS]; COLUMNS];
    for (id, damage) in reader.ids(0).unwrap().iter().zip(damage) {
        let id = *id as usize;
        cracked[id % COLUMNS][id / COLUMNS] = damage > CRACKED;
    }
    cracked
}

/// Return the number of separate sequences of cracked points in a column.
fn cracks_in(column: &[bool]) -> usize {
    let starts = column.windows(2).filter(|pair| !pair[0] && pair[1]).count();
    starts + usize::from(column[0])
}

/// Return the column of the foremost cracked point.
fn tip(cracked: &[Vec<bool>]) -> usize {
    cracked
        .iter()
        .rposition(|column| column.contains(&true))
        .unwrap()
}

/// Return the slope of the least-squares line through (time, position) pairs.
fn slope(pairs: &[(f64, f64)]) -> f64 {
    let count = pairs.len() as f64;
    let mean_t = pairs.iter().map(|pair| pair.0).sum::<f64>() / count;
    let mean_x = pairs.iter().map(|pair| pair.1).sum::<f64>() / count;
    let numerator: f64 = pairs.iter().map(|(t, x)| (t - mean_t) * (x - mean_x)).sum();
    let denominator: f64 = pairs.iter().map(|(t, _)| (t - mean_t).powi(2)).sum();
    numerator / denominator
}

#[test]
fn one_crack_runs_straight_then_branches_once() {
    let folder = Folder::new("branching");
    let deck = Path::new(env!("CARGO_MANIFEST_DIR")).join("inputs/crack_branching.toml");
    let mut command = fissure(1);
    command.arg("run").arg(&deck).arg("--output").arg(&folder.0);
    succeed(&mut command);
    let reader = ResultReader::open(&folder.join("result.vtkhdf")).unwrap();
    let times = reader.times().unwrap();
    assert_eq!(times.len(), 51);

    let start = cracked(&reader, 0);
    assert!(
        tip(&start).abs_diff(COLUMNS / 2) <= 2,
        "the notch ends in the middle"
    );

    let end = cracked(&reader, times.len() - 1);
    for (column, points) in end.iter().enumerate() {
        let mirrored: Vec<bool> = points.iter().rev().copied().collect();
        assert_eq!(
            *points, mirrored,
            "column {column} is not symmetric about the mid-plane"
        );
    }
    let counts: Vec<usize> = end.iter().map(|column| cracks_in(column)).collect();
    let branch = counts.iter().rposition(|count| *count == 1).unwrap() + 1;
    assert!(
        (COLUMNS / 2 + 3..COLUMNS - 20).contains(&branch),
        "branches at column {branch}"
    );
    assert!(
        counts[..COLUMNS / 2].iter().all(|count| *count == 1),
        "{counts:?}"
    );
    assert!(
        counts[branch..].iter().all(|count| *count == 2),
        "one branching: {counts:?}"
    );

    // The branches move apart.
    let height = |column: usize| {
        let points = &end[column];
        points.iter().rposition(|cracked| *cracked).unwrap() as isize - ROWS as isize / 2
    };
    assert!(height(90) - height(branch + 2) >= 5);

    let tips: Vec<(f64, f64)> = (0..times.len())
        .map(|output| (times[output], tip(&cracked(&reader, output)) as f64 * 1e-3))
        .filter(|(_, place)| *place < 0.098)
        .collect();
    let first = tips.iter().position(|(_, place)| *place > 0.0501).unwrap();
    let moving = &tips[first..];
    let fastest = moving.windows(10).map(slope).fold(0.0, f64::max);
    assert!(fastest < RAYLEIGH_SPEED, "{fastest} m/s");
    assert!(fastest > 1000.0, "{fastest} m/s");
}
