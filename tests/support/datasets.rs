//! Results as bits for comparisons.

use std::collections::BTreeMap;
use std::path::Path;

use fissure::output::ResultReader;

/// Return the bits of every dataset of a result by name, with rows sorted by id.
pub fn datasets(result: &Path) -> BTreeMap<String, Vec<u64>> {
    let reader = ResultReader::open(result).unwrap_or_else(|error| panic!("{error}"));
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect();
    let mut all = BTreeMap::new();
    let times = reader.times().unwrap();
    all.insert("times".to_owned(), bits(&times));
    all.insert("steps".to_owned(), reader.steps().unwrap());
    for step in 0..times.len() {
        let ids = reader.ids(step).unwrap();
        let positions = reader.positions(step).unwrap();
        let name = format!("positions {step}");
        all.insert(name, sorted(&ids, positions.as_flattened()));
        for field in reader.fields().unwrap() {
            let values = reader.field(&field.name, step).unwrap();
            all.insert(format!("{} {step}", field.name), sorted(&ids, &values));
        }
    }
    for column in reader.history().unwrap() {
        all.insert(format!("history {}", column.name), bits(&column.values));
    }
    all
}

/// Return the bits of values of points, with rows sorted by the ids of the points.
pub fn sorted(ids: &[u64], values: &[f64]) -> Vec<u64> {
    let mut order: Vec<usize> = (0..ids.len()).collect();
    order.sort_by_key(|k| ids[*k]);
    let width = values.len() / ids.len();
    let row = |k: &usize| &values[k * width..(k + 1) * width];
    let values = order.iter().flat_map(row);
    values.map(|value| value.to_bits()).collect()
}

/// Return whether the number of points decreases between two rows of the history.
pub fn points_left(found: &BTreeMap<String, Vec<u64>>) -> bool {
    let points: Vec<f64> = found["history points"]
        .iter()
        .map(|bits| f64::from_bits(*bits))
        .collect();
    points.windows(2).any(|pair| pair[1] < pair[0])
}

/// Return the name of the first dataset in which two results differ.
pub fn difference(
    expected: &BTreeMap<String, Vec<u64>>,
    found: &BTreeMap<String, Vec<u64>>,
) -> Option<String> {
    let mut names = expected.keys().chain(found.keys());
    names
        .find(|name| expected.get(*name) != found.get(*name))
        .cloned()
}
