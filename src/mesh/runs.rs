//! Sets of whole numbers, stored as ranges, because ids and indices of meshes are mostly consecutive.

/// A set of whole numbers, as sorted ranges with gaps between them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Runs {
    /// First number and end (exclusive) of each range.
    ranges: Vec<[u64; 2]>,
}

impl Runs {
    /// Create a set from numbers in any order.
    pub fn new(mut numbers: Vec<u64>) -> Self {
        numbers.sort_unstable();
        let mut runs = Self::default();
        for number in numbers {
            runs.push(number);
        }
        runs
    }

    /// Add a number, which must be at least as large as the largest number of the set.
    pub fn push(&mut self, number: u64) {
        match self.ranges.last_mut() {
            Some([_, end]) if *end > number => debug_assert_eq!(*end, number + 1),
            Some([_, end]) if *end == number => *end += 1,
            _ => self.ranges.push([number, number + 1]),
        }
    }

    /// Test whether the set contains `number`.
    pub fn contains(&self, number: u64) -> bool {
        let after = self.ranges.partition_point(|[first, _]| *first <= number);
        after > 0 && number < self.ranges[after - 1][1]
    }

    /// Return the numbers in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = u64> + '_ {
        self.ranges.iter().flat_map(|[first, end]| *first..*end)
    }

    /// Return the ranges: first number and end (exclusive).
    pub fn ranges(&self) -> &[[u64; 2]] {
        &self.ranges
    }

    /// Return the union of several sets. Each set is given by its ranges and an offset that is added to its
    /// numbers.
    pub fn union<'a>(sets: impl Iterator<Item = (&'a [[u64; 2]], u64)>) -> Self {
        let raised = sets.flat_map(|(ranges, offset)| {
            ranges
                .iter()
                .map(move |[first, end]| [first + offset, end + offset])
        });
        let mut all: Vec<[u64; 2]> = raised.collect();
        all.sort_unstable();
        let mut ranges: Vec<[u64; 2]> = Vec::new();
        for [first, end] in all {
            match ranges.last_mut() {
                Some(last) if first <= last[1] => last[1] = last[1].max(end),
                _ => ranges.push([first, end]),
            }
        }
        Self { ranges }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_become_ranges() {
        let runs = Runs::new(vec![7, 3, 1, 2, 2, 9, 8]);
        assert_eq!(runs.ranges(), [[1, 4], [7, 10]]);
        assert_eq!(runs.iter().collect::<Vec<_>>(), [1, 2, 3, 7, 8, 9]);
        let members: Vec<u64> = (0..12).filter(|number| runs.contains(*number)).collect();
        assert_eq!(members, [1, 2, 3, 7, 8, 9]);
        let raised = Runs::union([(runs.ranges(), 10), (&[[14, 17], [30, 31]], 0)].into_iter());
        assert_eq!(raised.ranges(), [[11, 20], [30, 31]]);
    }
}
