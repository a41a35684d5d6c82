//! Columns of numbers that are read together.

use std::ops::{Deref, DerefMut};

/// Lines of 64 bytes that lie in as many different sets of a first-level cache.
const SETS: usize = 64;

/// Each column starts so many lines after the one before it: of eighteen none is within two lines of another.
const STEP: usize = 27;

/// LaneTuple in a line.
const LINE: usize = 8;

/// One of several columns of numbers that are read at the same index.
///
/// Arrays that the allocator takes from the system one by one (from 1 MB on in the `fissure` command) all lie alike in
/// their first page, so that one index of many such columns falls into the same set of the cache, which keeps eight
/// or twelve lines. Here each begins some lines later than the one before.
#[derive(Debug, Clone, Default)]
pub struct Column {
    values: Vec<f64>,
    lead: usize,
}

impl Column {
    /// The column of a number among those that are read together, with `count` times a value.
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
