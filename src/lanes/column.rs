//! Columns of numbers that loops read at the same index.

use std::ops::{Deref, DerefMut};

/// Number of sets of a first-level cache; consecutive 64-byte lines lie in different sets.
const SETS: usize = 64;

/// Offset between the starts of consecutive columns, in lines: no two of eighteen columns are within two
/// lines of each other.
const STEP: usize = 27;

/// Numbers in a line.
const LINE: usize = 8;

/// One of several columns of numbers that loops read at the same index.
///
/// The allocator requests large arrays from the system one by one (from 1 MB on in the `fissure` command).
/// All of them start at the same offset within a page. One index of many such columns would fall into the
/// same set of the cache, which contains only eight or twelve lines. Therefore, each column starts some
/// lines later than the previous one.
#[derive(Debug, Clone, Default)]
pub struct Column {
    values: Vec<f64>,
    lead: usize,
}

impl Column {
    /// Create column `number` of those that are read together, with `count` entries of `value`.
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
