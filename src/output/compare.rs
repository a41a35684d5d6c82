//! Comparison of two results: the largest difference of each field and each column of the history.
//!
//! Outputs and history rows are matched by time, points by id. Values at points are compared for at most
//! `BLOCK` points at a time. The history is read as a whole. If the lists of ids of two outputs differ and at
//! least one list does not ascend, both lists are also read as a whole. This case occurs on refined grids.

use super::read::{ResultReader, StoredColumn};
use crate::error::{Error, Result};
use std::cmp::Ordering;
use std::ops::Range;

/// Number of points that are read at once.
const BLOCK: usize = 1 << 16;

/// Largest allowed difference between two matched times, as a fraction of the interval between outputs or
/// rows.
const TIME_TOLERANCE: f64 = 1e-6;

/// Largest allowed difference between two matched times, as a fraction of the last time. This limit allows
/// for the round-off of a sum over many steps.
const ROUND_OFF: f64 = 1e-13;

/// Name of the field with the reference positions.
const POSITION: &str = "position";

/// Name of the field by which points are matched.
const ID: &str = "id";

/// Name of the column by which rows are matched.
const TIME: &str = "time";

/// Name of the column of the kinetic energy.
const KINETIC_ENERGY: &str = "kinetic_energy";

/// Beginning of the names of the columns with components of momentum.
const MOMENTUM: &str = "momentum_";

/// Beginning of the names of the columns with components of angular momentum.
const ANGULAR_MOMENTUM: &str = "angular_momentum_";

/// Location of the largest difference of a quantity between two results.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Time in the first result, s.
    pub time: f64,
    /// Index of the component of a field; 0 for other quantities.
    pub component: usize,
    /// Point at which the values differ most, if the quantity is a field; `None` for a column of the history.
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
    /// Largest absolute difference; infinite if the values of a pair differ and at least one of them is not
    /// finite.
    pub largest: f64,
    /// Largest finite absolute value in the first result. For momentum and angular momentum, this value can
    /// be round-off, so the scale is raised; see `raise_momentum_scales`.
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
    /// Times of the unmatched outputs of each result, s.
    pub single_outputs: [Vec<f64>; 2],
    /// Number of matched pairs of points, summed over all pairs of outputs.
    pub points: u64,
    /// Whether the number of matched pairs of points is the same for all pairs of outputs.
    pub has_equal_counts: bool,
    /// Number of unmatched points of each result, summed over all pairs of outputs.
    pub single_points: [u64; 2],
    /// The common fields.
    pub fields: Vec<Difference>,
    /// Fields of each result that the other result lacks, or has in another unit or shape.
    pub single_fields: [Vec<String>; 2],
    /// Number of pairs of history rows.
    pub rows: usize,
    /// Number of unmatched history rows of each result.
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

/// Compare two results. After each pair of outputs, `progress` is called with the count of compared pairs,
/// the total count of pairs and the time of the outputs (s).
///
/// # Errors
/// If a file is damaged. If the points of two outputs cannot be matched in order, and one of these outputs
/// has two points with the same id.
pub fn compare(
    first: &ResultReader,
    second: &ResultReader,
    progress: &mut dyn FnMut(usize, usize, f64),
) -> Result<Comparison> {
    let mut comparison = Comparison {
        has_equal_counts: true,
        ..Comparison::default()
    };
    let fields = common_fields(first, second, &mut comparison)?;
    let times = [first.times()?, second.times()?];
    let pairs = Matches::of(&times[0], &times[1]);
    comparison.outputs = pairs.pairs.len();
    comparison.single_outputs = pairs.single(&times);
    let unchanging = !first.is_changing() && !second.is_changing();
    let mut matching = None;
    for (number, [a, b]) in pairs.pairs.iter().copied().enumerate() {
        let pair = OutputPair {
            readers: [first, second],
            indices: [a, b],
            time: times[0][a],
        };
        let known = matching.take().filter(|_| unchanging);
        let found = known.map_or_else(|| pair.matching(), Ok)?;
        // If the points never change, compare static fields only at the first pair of outputs.
        let compared: Vec<usize> = (0..fields.len())
            .filter(|k| number == 0 || fields[*k] || !unchanging)
            .collect();
        pair.compare((number, &found), &compared, &mut comparison)?;
        matching = Some(found);
        progress(number + 1, pairs.pairs.len(), pair.time);
    }
    let histories = [first.history()?, second.history()?];
    compare_histories([&histories[0], &histories[1]], &mut comparison);
    let attributes = first.attributes()?;
    let mass = attributes.iter().find(|(name, _)| name == "mass");
    let mass = mass.and_then(|(_, mass)| mass.parse().ok());
    if let Some(momentum) = momentum_scale(mass, &histories[0]) {
        raise_momentum_scales(momentum, &mut comparison);
    }
    Ok(comparison)
}

/// Add to `comparison` the common fields, and the names of the fields that only one result has. Return one
/// flag per common field. The flag is true if at least one of the results stores separate values of the field
/// for each output.
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
struct OutputPair<'a> {
    readers: [&'a ResultReader; 2],
    indices: [usize; 2],
    time: f64,
}

/// How the points of two outputs are matched.
enum Matching {
    /// The points are matched in the order of the rows, in blocks of at most [`BLOCK`] points. The ids of
    /// both outputs ascend, or both outputs have the same sequence of ids.
    InOrder,
    /// The points are matched by these pairs of rows. A pair has one row of each output. The pairs are sorted
    /// by the row of the first output.
    Rows(Vec<[usize; 2]>),
}

impl OutputPair<'_> {
    /// Find out how the points are matched.
    ///
    /// # Errors
    /// If an output cannot be read. If the points cannot be matched in order and an output has two points
    /// with the same id.
    fn matching(&self) -> Result<Matching> {
        let counts = self.counts();
        let (mut ascend, mut equal) = (true, counts[0] == counts[1]);
        for start in (0..counts[0].max(counts[1])).step_by(BLOCK) {
            // The first point of the next block is read too, to compare the ids at the border.
            let part = |side: usize| {
                let end = counts[side].min(start + BLOCK + 1);
                self.ids(side, start.min(end)..end)
            };
            let ids = [part(0)?, part(1)?];
            equal &= ids[0] == ids[1];
            ascend &= ids.iter().all(|ids| ids.is_sorted_by(|a, b| a < b));
            if !equal && !ascend {
                let ids = [self.ids(0, 0..counts[0])?, self.ids(1, 0..counts[1])?];
                return match_unordered(&ids)
                    .map(Matching::Rows)
                    .map_err(|repeated| self.repeated_id(repeated));
            }
        }
        Ok(Matching::InOrder)
    }

    /// Compare some of the fields, one block of points at a time. `fields` has the indices of these fields in
    /// `comparison.fields`, and `done` is the number of pairs of outputs that have been compared.
    fn compare(
        &self,
        (done, matching): (usize, &Matching),
        fields: &[usize],
        comparison: &mut Comparison,
    ) -> Result<()> {
        let counts = self.counts();
        let mut matched = 0;
        match matching {
            Matching::InOrder => {
                let mut next = [0; 2];
                while next[0] < counts[0] || next[1] < counts[1] {
                    let end = [0, 1].map(|side| counts[side].min(next[side] + BLOCK));
                    let ids = [self.ids(0, next[0]..end[0])?, self.ids(1, next[1]..end[1])?];
                    let is_last = [0, 1].map(|side| end[side] == counts[side]);
                    let (mut pairs, used) = match_in_order(&ids, is_last);
                    for pair in &mut pairs {
                        *pair = [next[0] + pair[0], next[1] + pair[1]];
                    }
                    self.compare_rows(&pairs, fields, comparison)?;
                    matched += pairs.len();
                    next = [next[0] + used[0], next[1] + used[1]];
                }
            }
            Matching::Rows(pairs) => {
                for pairs in pairs.chunks(BLOCK) {
                    self.compare_rows(pairs, fields, comparison)?;
                }
                matched = pairs.len();
            }
        }
        // If the earlier pairs of outputs have equal counts, this count equals theirs exactly if their sum is
        // `done` times this count.
        comparison.has_equal_counts &= comparison.points == done as u64 * matched as u64;
        comparison.points += matched as u64;
        for side in 0..2 {
            comparison.single_points[side] += (counts[side] - matched) as u64;
        }
        Ok(())
    }

    /// Return the number of points of each output.
    fn counts(&self) -> [usize; 2] {
        [0, 1].map(|side: usize| self.readers[side].points(self.indices[side]))
    }

    /// Read the ids of the points `rows` from the compared output of the result `side`.
    fn ids(&self, side: usize, rows: Range<usize>) -> Result<Vec<u64>> {
        self.readers[side].ids_of(self.indices[side], rows)
    }

    /// Create the error for an output in which two points have the same id.
    fn repeated_id(&self, (side, id): (usize, u64)) -> Error {
        Error::input(format!(
            "{}: two points of the output at t = {} s have the id {id}; \
             compare works on results that Fissure has written",
            self.readers[side].path().display(),
            self.time
        ))
    }

    /// Compare some of the fields at pairs of rows. Each pair has one row of each output.
    fn compare_rows(
        &self,
        pairs: &[[usize; 2]],
        fields: &[usize],
        comparison: &mut Comparison,
    ) -> Result<()> {
        if pairs.is_empty() {
            return Ok(());
        }
        let ranges = [0, 1].map(|side| {
            let rows = || pairs.iter().map(|pair| pair[side]);
            rows().min().unwrap_or(0)..rows().max().map_or(0, |last| last + 1)
        });
        for field in fields {
            self.compare_field(pairs, &ranges, &mut comparison.fields[*field])?;
        }
        Ok(())
    }

    /// Compare a field at pairs of rows. For each output, `ranges` has the range from the smallest to the
    /// largest row index in the pairs.
    fn compare_field(
        &self,
        pairs: &[[usize; 2]],
        ranges: &[Range<usize>; 2],
        field: &mut Difference,
    ) -> Result<()> {
        let mut values = [Vec::new(), Vec::new()];
        for side in 0..2 {
            let (reader, index) = (self.readers[side], self.indices[side]);
            let range = ranges[side].clone();
            values[side] = if field.name == POSITION {
                reader.positions_of(index, range)?.into_flattened()
            } else {
                reader.field_of(&field.name, index, range)?
            };
        }
        let width = field.components.len().max(1);
        let mut largest = None;
        for [a, b] in pairs {
            for component in 0..width {
                if field.add(
                    values[0][(a - ranges[0].start) * width + component],
                    values[1][(b - ranges[1].start) * width + component],
                ) {
                    largest = Some((*a, component));
                }
            }
        }
        if let Some((row, component)) = largest {
            let position = self.readers[0].positions_of(self.indices[0], row..row + 1)?;
            field.place = Some(Place {
                time: self.time,
                component,
                point: Some(PointPlace {
                    id: self.ids(0, row..row + 1)?[0],
                    position: position[0],
                }),
            });
        }
        Ok(())
    }
}

/// Match two lists of ids, one list of each result. Both lists must ascend, or the lists must be equal.
/// `is_last` is true for a list that ends with the last ids of its result. If the matching reaches the end of
/// such a list, the remaining ids of the other list have no partner. These ids also count as used. Return the
/// pairs of indices of equal ids, and the number of used ids of each list.
fn match_in_order(ids: &[Vec<u64>; 2], is_last: [bool; 2]) -> (Vec<[usize; 2]>, [usize; 2]) {
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
            (Some(_), None) if is_last[1] => used[0] = ids[0].len(),
            (None, Some(_)) if is_last[0] => used[1] = ids[1].len(),
            _ => return (pairs, used),
        }
    }
}

/// Match two lists of ids, which need not be sorted. Return the pairs of indices of equal ids, by ascending
/// index in the first list. If a list contains an id twice, return the index of this list and the id as an
/// error.
fn match_unordered(ids: &[Vec<u64>; 2]) -> std::result::Result<Vec<[usize; 2]>, (usize, u64)> {
    let mut orders = [Vec::new(), Vec::new()];
    let mut sorted = [Vec::new(), Vec::new()];
    for side in 0..2 {
        let id = |row: &usize| ids[side][*row];
        orders[side] = (0..ids[side].len()).collect();
        orders[side].sort_unstable_by_key(id);
        sorted[side] = orders[side].iter().map(id).collect();
        if let Some(twice) = sorted[side].windows(2).find(|pair| pair[0] == pair[1]) {
            return Err((side, twice[0]));
        }
    }
    let (mut pairs, _) = match_in_order(&sorted, [true; 2]);
    for pair in &mut pairs {
        *pair = [orders[0][pair[0]], orders[1][pair[1]]];
    }
    pairs.sort_unstable();
    Ok(pairs)
}

/// Pairs of equal times, as indices into two ascending lists.
struct Matches {
    pairs: Vec<[usize; 2]>,
}

impl Matches {
    /// Match each time of the first list with the nearest unmatched time of the second list. The difference
    /// of the times may be at most the larger of two tolerances; see [`TIME_TOLERANCE`] and [`ROUND_OFF`].
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

/// Return √(2 M E), kg m/s, an upper bound of Σ m |u̇|. In contrast to the total momentum, this value does
/// not cancel. M is the mass of the points of the first result, and E the largest kinetic energy in its
/// history. Return `None` if the first result lacks M or E.
fn momentum_scale(mass: Option<f64>, history: &[StoredColumn]) -> Option<f64> {
    let energies = history.iter().find(|column| column.name == KINETIC_ENERGY);
    let energies = energies?.values.iter().copied();
    let energy = energies
        .filter(|energy| energy.is_finite())
        .reduce(f64::max)?;
    Some((2.0 * mass? * energy).sqrt())
}

/// Raise the scales of the columns of momentum to at least `momentum`, kg m/s. In a balanced problem, the
/// terms of the momentum cancel, and its largest value is round-off. For angular momentum, the scale is at
/// least `momentum` times the largest coordinate.
fn raise_momentum_scales(momentum: f64, comparison: &mut Comparison) {
    let positions = comparison.fields.iter();
    let length = positions
        .filter(|field| field.name == POSITION)
        .fold(0.0, |_, field| field.scale);
    for column in &mut comparison.columns {
        if column.name.starts_with(MOMENTUM) {
            column.scale = column.scale.max(momentum);
        } else if column.name.starts_with(ANGULAR_MOMENTUM) {
            column.scale = column.scale.max(momentum * length);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn momentum_is_relative_to_a_sum_without_cancellation() {
        let difference = |name: &str, first: f64, second: f64| {
            let mut difference = Difference::new(name, "", &[]);
            difference.add(first, second);
            difference
        };
        let column = |name: &str, values: &[f64]| StoredColumn {
            name: name.to_owned(),
            unit: String::new(),
            values: values.to_vec(),
        };
        let history = [
            column(TIME, &[0.0, 0.5, 1.0]),
            column(KINETIC_ENERGY, &[0.0, 2.25, 1.0]),
        ];
        assert_eq!(momentum_scale(Some(2.0), &history), Some(3.0));
        assert_eq!(momentum_scale(None, &history), None);
        assert_eq!(momentum_scale(Some(2.0), &history[..1]), None);
        let mut comparison = Comparison {
            fields: vec![difference(POSITION, 2.0, 2.0)],
            columns: vec![
                difference("momentum_x", 1e-19, 2e-19),
                difference("angular_momentum_z", -1e-19, 1e-19),
                difference("momentum_y", 7.0, 7.0),
                difference("energy_error", 1e-19, 2e-19),
            ],
            ..Comparison::default()
        };
        raise_momentum_scales(3.0, &mut comparison);
        let columns = &comparison.columns;
        let scales: Vec<f64> = columns.iter().map(|column| column.scale).collect();
        assert_eq!(scales, [3.0, 6.0, 7.0, 1e-19]);
        assert!(columns[0].is_within(1e-9) && columns[1].is_within(1e-9));
        assert!(!columns[3].is_within(1e-9));
    }

    #[test]
    fn ids_are_matched_across_blocks() {
        let ids = |first: &[u64], second: &[u64]| [first.to_vec(), second.to_vec()];
        let (pairs, used) = match_in_order(&ids(&[1, 3, 4, 9], &[1, 2, 4, 5]), [true, true]);
        assert_eq!(pairs, [[0, 0], [2, 2]]);
        assert_eq!(used, [4, 4]);
        // The second result has further blocks, one of which may have the id 9.
        let (pairs, used) = match_in_order(&ids(&[1, 9], &[1, 2, 4]), [true, false]);
        assert_eq!((pairs.len(), used), (1, [1, 3]));
        let (pairs, used) = match_in_order(&ids(&[], &[7, 8]), [true, true]);
        assert_eq!((pairs.len(), used), (0, [0, 2]));
        // Equal lists need not ascend.
        let (pairs, used) = match_in_order(&ids(&[0, 8, 1], &[0, 8, 1]), [false, false]);
        assert_eq!((pairs, used), (vec![[0, 0], [1, 1], [2, 2]], [3, 3]));
    }

    #[test]
    fn ids_in_any_order_are_matched() {
        let ids = [vec![0, 8, 16, 1, 2], vec![0, 16, 24, 1, 9, 2]];
        let pairs = match_unordered(&ids).unwrap();
        assert_eq!(pairs, [[0, 0], [2, 1], [3, 3], [4, 5]]);
        let twice = match_unordered(&[vec![0, 8, 1], vec![0, 8, 1, 8]]);
        assert_eq!(twice, Err((1, 8)));
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
