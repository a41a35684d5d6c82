//! Comparison of two results: the largest difference of each field and each column of the history.
//!
//! Outputs and history rows are matched by time, points by id. Values are read in blocks of points, so the
//! memory does not depend on the numbers of points and outputs. Only the history is read as a whole.

use super::read::{ResultReader, StoredColumn};
use crate::error::{Error, Result};
use std::cmp::Ordering;

/// Number of points that are read at once.
const BLOCK: usize = 1 << 16;

/// Largest difference of matched times, as a fraction of the interval between outputs or rows.
const TIME_TOLERANCE: f64 = 1e-6;

/// Largest difference of matched times, as a fraction of the last time: round-off of a sum over many steps.
const ROUND_OFF: f64 = 1e-13;

/// Name of the reference positions among the fields.
const POSITION: &str = "position";

/// Name of the field by which points are matched.
const ID: &str = "id";

/// Name of the column by which rows are matched.
const TIME: &str = "time";

/// Location of the largest difference of a quantity between two results.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Time in the first result, s.
    pub time: f64,
    /// Index of the component of a field; 0 for other quantities.
    pub component: usize,
    /// Point of a field; `None` for a column of the history.
    pub point: Option<PointPlace>,
}

/// A point of the first result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointPlace {
    /// Id of the point.
    pub id: u64,
    /// Reference position of the point, m.
    pub position: [f64; 3],
}

/// Differences of a quantity between two results.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Name of the field or column.
    pub name: String,
    /// Unit of the quantity; empty if dimensionless.
    pub unit: String,
    /// Names of the components; empty for a scalar.
    pub components: &'static [&'static str],
    /// Largest absolute difference; infinite if one of two unequal numbers is not finite.
    pub largest: f64,
    /// Largest finite absolute value in the first result.
    pub scale: f64,
    /// Number of compared values.
    pub values: u64,
    /// Number of compared values that are not bit-identical. All NaNs count as identical.
    pub unequal: u64,
    /// Location of the largest difference; `None` if all values are equal.
    pub place: Option<Place>,
}

impl Difference {
    fn new(name: &str, unit: &str, components: &'static [&'static str]) -> Self {
        Self {
            name: name.to_owned(),
            unit: if unit == "1" { "" } else { unit }.to_owned(),
            components,
            largest: 0.0,
            scale: 0.0,
            values: 0,
            unequal: 0,
            place: None,
        }
    }

    /// Test whether the largest difference is at most `tolerance` times [`Self::scale`]. With a tolerance of
    /// 0, all values must be bit-identical. With an infinite tolerance, any difference is allowed.
    pub fn is_within(&self, tolerance: f64) -> bool {
        self.unequal == 0
            || tolerance > 0.0
                && (self.largest <= tolerance * self.scale || tolerance.is_infinite())
    }

    /// Add a pair of values. Return whether the difference of the two values is the largest so far.
    fn add(&mut self, first: f64, second: f64) -> bool {
        self.values += 1;
        if first.is_finite() {
            self.scale = self.scale.max(first.abs());
        }
        if first.to_bits() == second.to_bits() || first.is_nan() && second.is_nan() {
            return false;
        }
        self.unequal += 1;
        let difference = match first - second {
            difference if difference.is_finite() => difference.abs(),
            _ => f64::INFINITY,
        };
        let is_largest = self.unequal == 1 || difference > self.largest;
        self.largest = self.largest.max(difference);
        is_largest
    }
}

/// Differences of the common parts of two results, and the parts that only one result has.
#[derive(Debug, Clone, Default)]
pub struct Comparison {
    /// Number of pairs of outputs.
    pub outputs: usize,
    /// Times of the outputs of each result that the other result lacks, s.
    pub single_outputs: [Vec<f64>; 2],
    /// Number of pairs of points in all outputs.
    pub points: u64,
    /// Number of points of each result that the other result lacks, in all pairs of outputs.
    pub single_points: [u64; 2],
    /// The common fields.
    pub fields: Vec<Difference>,
    /// Fields of each result that the other result lacks, or has in another unit or shape.
    pub single_fields: [Vec<String>; 2],
    /// Number of pairs of history rows.
    pub rows: usize,
    /// Number of history rows of each result that the other result lacks.
    pub single_rows: [usize; 2],
    /// The common columns of the history.
    pub columns: Vec<Difference>,
    /// Columns of each result that the other result lacks, or has in another unit.
    pub single_columns: [Vec<String>; 2],
}

impl Comparison {
    /// Test whether both results have the same outputs, points, fields, rows and columns.
    pub fn is_complete(&self) -> bool {
        let names = self.single_fields.iter().chain(&self.single_columns);
        self.single_outputs.iter().all(Vec::is_empty)
            && self.single_points == [0; 2]
            && self.single_rows == [0; 2]
            && names.into_iter().all(Vec::is_empty)
    }
}

/// Compare two results. After each pair of outputs, `progress` is called with the number of the pair, the
/// number of all pairs and the time (s).
///
/// # Errors
/// If a file is damaged or its points are not in the order of their ids.
pub fn compare(
    first: &ResultReader,
    second: &ResultReader,
    progress: &mut dyn FnMut(usize, usize, f64),
) -> Result<Comparison> {
    let mut comparison = Comparison::default();
    let fields = common_fields(first, second, &mut comparison)?;
    let times = [first.times()?, second.times()?];
    let pairs = Matches::of(&times[0], &times[1]);
    comparison.outputs = pairs.pairs.len();
    comparison.single_outputs = pairs.single(&times);
    let unchanging = !first.is_changing() && !second.is_changing();
    for (number, [a, b]) in pairs.pairs.iter().copied().enumerate() {
        let outputs = Outputs {
            readers: [first, second],
            indices: [a, b],
            time: times[0][a],
        };
        // If the points never change, compare static fields only at the first pair of outputs.
        let compared: Vec<usize> = (0..fields.len())
            .filter(|k| number == 0 || fields[*k] || !unchanging)
            .collect();
        outputs.compare(&compared, &mut comparison)?;
        progress(number + 1, pairs.pairs.len(), outputs.time);
    }
    compare_histories([&first.history()?, &second.history()?], &mut comparison);
    Ok(comparison)
}

/// Add the common fields, and the names of the fields that only one result has, to `comparison`. Return for
/// each common field whether at least one of the results stores values of the field for each output.
fn common_fields(
    first: &ResultReader,
    second: &ResultReader,
    comparison: &mut Comparison,
) -> Result<Vec<bool>> {
    let all = [first.fields()?, second.fields()?];
    let mut dynamic = vec![false];
    comparison.fields = vec![Difference::new(POSITION, "m", &["x", "y", "z"])];
    for side in 0..2 {
        for field in all[side].iter().filter(|field| field.name != ID) {
            let other = all[1 - side].iter().find(|other| {
                (&other.name, &other.unit, other.components)
                    == (&field.name, &field.unit, field.components)
            });
            match other {
                None => comparison.single_fields[side].push(field.name.clone()),
                Some(other) if side == 0 => {
                    let names = field.component_names();
                    let difference = Difference::new(&field.name, &field.unit, names);
                    comparison.fields.push(difference);
                    dynamic.push(field.dynamic || other.dynamic);
                }
                Some(_) => {}
            }
        }
    }
    Ok(dynamic)
}

/// A pair of outputs of the same time.
struct Outputs<'a> {
    readers: [&'a ResultReader; 2],
    indices: [usize; 2],
    time: f64,
}

impl Outputs<'_> {
    /// Compare some of the fields, one block of points at a time. `fields` has the indices of these fields in
    /// `comparison.fields`.
    fn compare(&self, fields: &[usize], comparison: &mut Comparison) -> Result<()> {
        let counts = [0, 1].map(|side: usize| self.readers[side].points(self.indices[side]));
        let mut next = [0; 2];
        while next[0] < counts[0] || next[1] < counts[1] {
            let mut ids = [Vec::new(), Vec::new()];
            for side in 0..2 {
                let end = counts[side].min(next[side] + BLOCK);
                ids[side] = self.readers[side].ids_of(self.indices[side], next[side]..end)?;
                if ids[side].windows(2).any(|pair| pair[0] >= pair[1]) {
                    return Err(Error::input(
                        "the points of a result are not in the order of their ids; \
                         compare works on results that Fissure has written",
                    ));
                }
            }
            let block = Block::of(&ids, [0, 1].map(|side| next[side] + BLOCK >= counts[side]));
            comparison.points += block.pairs.len() as u64;
            for side in 0..2 {
                let single = block.used[side] - block.pairs.len();
                comparison.single_points[side] += single as u64;
            }
            if !block.pairs.is_empty() {
                for field in fields {
                    self.compare_block(&ids[0], next, &block, &mut comparison.fields[*field])?;
                }
            }
            for side in 0..2 {
                next[side] += block.used[side];
            }
        }
        Ok(())
    }

    /// Compare a field at the point pairs of a block. `ids` has the ids of the block's points in the first
    /// result, and `start` the index of the block's first point in each output.
    fn compare_block(
        &self,
        ids: &[u64],
        start: [usize; 2],
        block: &Block,
        field: &mut Difference,
    ) -> Result<()> {
        let mut values = [Vec::new(), Vec::new()];
        for side in 0..2 {
            let points = start[side]..start[side] + block.used[side];
            let (reader, index) = (self.readers[side], self.indices[side]);
            values[side] = if field.name == POSITION {
                reader.positions_of(index, points)?.into_flattened()
            } else {
                reader.field_of(&field.name, index, points)?
            };
        }
        let width = field.components.len().max(1);
        let mut largest = None;
        for [a, b] in &block.pairs {
            for component in 0..width {
                if field.add(
                    values[0][a * width + component],
                    values[1][b * width + component],
                ) {
                    largest = Some((*a, component));
                }
            }
        }
        if let Some((point, component)) = largest {
            let row = start[0] + point;
            let position = self.readers[0].positions_of(self.indices[0], row..row + 1)?;
            field.place = Some(Place {
                time: self.time,
                component,
                point: Some(PointPlace {
                    id: ids[point],
                    position: position[0],
                }),
            });
        }
        Ok(())
    }
}

/// A block of consecutive points of each of two results. `pairs` has the points with equal ids, as indices
/// into the block of each result. `used` is the number of points of each block that need not be considered
/// again.
struct Block {
    pairs: Vec<[usize; 2]>,
    used: [usize; 2],
}

impl Block {
    /// Match two ascending lists of ids, one list of each result. Stop at the end of a list, unless `last`
    /// says that the result has no further ids.
    fn of(ids: &[Vec<u64>; 2], last: [bool; 2]) -> Self {
        let (mut pairs, mut used) = (Vec::new(), [0; 2]);
        loop {
            match (ids[0].get(used[0]), ids[1].get(used[1])) {
                (Some(a), Some(b)) => match a.cmp(b) {
                    Ordering::Less => used[0] += 1,
                    Ordering::Greater => used[1] += 1,
                    Ordering::Equal => {
                        pairs.push(used);
                        used = used.map(|count| count + 1);
                    }
                },
                (Some(_), None) if last[1] => used[0] = ids[0].len(),
                (None, Some(_)) if last[0] => used[1] = ids[1].len(),
                _ => return Self { pairs, used },
            }
        }
    }
}

/// Pairs of equal times, as indices into two ascending lists.
struct Matches {
    pairs: Vec<[usize; 2]>,
}

impl Matches {
    /// Match each time of the first list with the nearest unmatched time of the second list, within the
    /// larger of the tolerances that follow from [`TIME_TOLERANCE`] and [`ROUND_OFF`].
    fn of(first: &[f64], second: &[f64]) -> Self {
        let end = first.iter().fold(0.0_f64, |end, time| end.max(time.abs()));
        let reach = |index: usize, time: f64| {
            let neighbours = [
                index.checked_sub(1).map(|before| first[before]),
                first.get(index + 1).copied(),
            ];
            let gaps = neighbours.into_iter().flatten();
            let gap = gaps
                .map(|neighbour| (neighbour - time).abs())
                .filter(|gap| *gap > 0.0)
                .fold(f64::INFINITY, f64::min);
            let interval = if gap.is_finite() { gap } else { end };
            (TIME_TOLERANCE * interval).max(ROUND_OFF * end)
        };
        let (mut pairs, mut next) = (Vec::new(), 0);
        for (index, time) in first.iter().enumerate() {
            let distance = |k: usize| (second[k] - time).abs();
            while next + 1 < second.len() && distance(next + 1) < distance(next) {
                next += 1;
            }
            if next < second.len() && distance(next) <= reach(index, *time) {
                pairs.push([index, next]);
                next += 1;
            }
        }
        Self { pairs }
    }

    /// Return for each list the times that are in no pair.
    fn single(&self, times: &[Vec<f64>; 2]) -> [Vec<f64>; 2] {
        [0, 1].map(|side| {
            let mut matched = self.pairs.iter().map(|pair| pair[side]).peekable();
            let all = times[side].iter().enumerate();
            let single = all.filter(|(index, _)| matched.next_if_eq(index).is_none());
            single.map(|(_, time)| *time).collect()
        })
    }
}

/// Compare the histories column by column.
fn compare_histories(histories: [&[StoredColumn]; 2], comparison: &mut Comparison) {
    let find = |columns: &[StoredColumn], name: &str, unit: &str| {
        let mut places = columns.iter();
        places.position(|column| column.name == name && column.unit == unit)
    };
    let times = histories.map(|columns| {
        let time = columns.iter().find(|column| column.name == TIME);
        time.map_or(&[][..], |column| &column.values[..])
    });
    let rows = Matches::of(times[0], times[1]).pairs;
    comparison.rows = rows.len();
    comparison.single_rows = [0, 1].map(|side: usize| times[side].len() - rows.len());
    for side in 0..2 {
        for column in histories[side] {
            let other = find(histories[1 - side], &column.name, &column.unit);
            match other {
                None => comparison.single_columns[side].push(column.name.clone()),
                Some(other) if side == 0 => {
                    let mut difference = Difference::new(&column.name, &column.unit, &[]);
                    let other = &histories[1][other];
                    for [a, b] in &rows {
                        if difference.add(column.values[*a], other.values[*b]) {
                            difference.place = Some(Place {
                                time: times[0][*a],
                                component: 0,
                                point: None,
                            });
                        }
                    }
                    comparison.columns.push(difference);
                }
                Some(_) => {}
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_matched_across_blocks() {
        let ids = |first: &[u64], second: &[u64]| [first.to_vec(), second.to_vec()];
        let block = Block::of(&ids(&[1, 3, 4, 9], &[1, 2, 4, 5]), [true, true]);
        assert_eq!(block.pairs, [[0, 0], [2, 2]]);
        assert_eq!(block.used, [4, 4]);
        // The second result has further blocks, one of which may have the id 9.
        let block = Block::of(&ids(&[1, 9], &[1, 2, 4]), [true, false]);
        assert_eq!((block.pairs.len(), block.used), (1, [1, 3]));
        let block = Block::of(&ids(&[], &[7, 8]), [true, true]);
        assert_eq!((block.pairs.len(), block.used), (0, [0, 2]));
    }

    #[test]
    fn times_are_matched_within_the_tolerance() {
        let times = [vec![0.0, 1.0, 2.0, 2.0], vec![0.0, 1.1, 2.0]];
        let matches = Matches::of(&times[0], &times[1]);
        assert_eq!(matches.pairs, [[0, 0], [2, 2]]);
        assert_eq!(matches.single(&times), [vec![1.0, 2.0], vec![1.1]]);
        assert_eq!(Matches::of(&[], &times[1]).pairs.len(), 0);
        assert_eq!(Matches::of(&times[0], &[]).pairs.len(), 0);
        // The nearest time is matched, not the first time within the tolerance.
        let close = [1.0, 1.0 + 5e-7, 2.0];
        assert_eq!(Matches::of(&[0.0, 1.0 + 6e-7], &close).pairs, [[1, 1]]);
        assert_eq!(Matches::of(&[0.0, 1.0], &[0.0, 1.0 + 2e-6]).pairs, [[0, 0]]);
    }

    #[test]
    fn differences_are_relative_to_the_largest_value() {
        let mut difference = Difference::new("a", "", &[]);
        assert!(!difference.add(8.0, 8.0));
        assert!(!difference.add(f64::NAN, -f64::NAN));
        assert!(difference.is_within(0.0));
        assert!(difference.add(0.0, -0.0));
        assert!(!difference.is_within(0.0) && difference.is_within(1e-300));
        assert!(difference.add(1.0, 1.5));
        assert!(!difference.add(2.0, 1.75));
        assert_eq!((difference.largest, difference.unequal), (0.5, 3));
        assert!(difference.is_within(0.0625) && !difference.is_within(0.0624));
        assert!(difference.add(f64::NAN, 1.0));
        assert!(!difference.is_within(1e9) && difference.is_within(f64::INFINITY));
    }
}
