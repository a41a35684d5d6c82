//! Work on the points of a condition, by several threads.

use rayon::prelude::*;

/// Points handled by one task.
pub const CHUNK: usize = 4096;

/// Calls `work` for each of some ascending points with its place among them, itself and its entries of some
/// columns. Returns whether all calls did.
pub fn for_each_point<const N: usize>(
    points: &[u32],
    mut columns: [&mut [f64]; N],
    work: impl Fn(usize, usize, [&mut f64; N]) -> bool + Sync,
) -> bool {
    let mut first = 0;
    let parts = points.chunks(CHUNK).map(|points| {
        let (from, end) = (first, points[points.len() - 1] as usize + 1);
        first = end;
        let part = columns.each_mut().map(|column| {
            let (part, others) = std::mem::take(column).split_at_mut(end - from);
            *column = others;
            part
        });
        (points, from, part)
    });
    let parts: Vec<_> = parts.collect();
    let parts = parts.into_par_iter().enumerate();
    let done = parts.map(|(number, (points, from, mut part))| {
        let mut all = true;
        for (k, point) in points.iter().enumerate() {
            let point = *point as usize;
            let entries = part.each_mut().map(|column| &mut column[point - from]);
            all &= work(number * CHUNK + k, point, entries);
        }
        all
    });
    done.reduce(|| true, |a, b| a & b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_gets_its_own_entries() {
        let points: Vec<u32> = (0..3 * CHUNK as u32).map(|k| 2 * k + k % 2).collect();
        let count = points[points.len() - 1] as usize + 10;
        let (mut places, mut indices) = (vec![-1.0; count], vec![-1.0; count]);
        let bad = CHUNK + 7;
        let all = for_each_point(&points, [&mut places, &mut indices], |k, point, [a, b]| {
            (*a, *b) = (k as f64, point as f64);
            k != bad
        });
        assert!(!all);
        let mut members = 0;
        for (k, point) in points.iter().enumerate() {
            let point = *point as usize;
            assert_eq!([places[point], indices[point]], [k as f64, point as f64]);
            members += 1;
        }
        assert_eq!(
            places.iter().filter(|place| **place >= 0.0).count(),
            members
        );
        assert!(for_each_point(&[], [&mut places], |_, _, _| false));
    }
}
