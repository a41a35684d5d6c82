//! Columns of numbers that loops read at the same index.

use std::ops::{Deref, DerefMut};

/// Number of sets of a first-level cache. Consecutive cache lines of 64 bytes lie in consecutive sets.
const SETS: usize = 64;

/// Offset between the first entries of consecutive columns, in cache lines. With this offset, the first
/// entries of eighteen columns are at least three lines apart, modulo [`SETS`].
const STEP: usize = 27;

/// Number of values in a cache line.
const LINE: usize = 8;

/// One of several columns of numbers that loops read at the same index.
///
/// The allocator requests each large array separately from the system. In the `fissure` command, an array is
/// large if it has 1 MB or more. All large arrays start at the same offset within a page. If every column
/// began at the start of its array, entries with the same index would lie in the same set of the cache. A set
/// holds only eight or twelve lines. Therefore, each column begins after a different number of unused cache
/// lines at the start of its array.
#[derive(Debug, Clone, Default)]
pub struct Column {
    values: Vec<f64>,
    /// Number of unused values before the first entry.
    lead: usize,
}

impl Column {
    /// Create a column with `count` entries of `value`. `number` is the index of the column among the columns
    /// that loops read together.
    pub fn new(number: usize, count: usize, value: f64) -> Self {
        let lead = number * STEP % SETS * LINE;
        Self {
            values: vec![value; lead + count],
            lead,
        }
    }
}

impl Deref for Column {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.values[self.lead..]
    }
}

impl DerefMut for Column {
    fn deref_mut(&mut self) -> &mut [f64] {
        &mut self.values[self.lead..]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_begin_in_different_sets() {
        let mut sets: Vec<usize> = (0..SETS)
            .map(|number| Column::new(number, 3, 1.0).lead / LINE)
            .collect();
        sets.sort_unstable();
        assert!(sets.iter().copied().eq(0..SETS));
        let mut column = Column::new(5, 3, 1.0);
        column[1] = 2.0;
        assert_eq!(column[..], [1.0, 2.0, 1.0]);
    }
}
