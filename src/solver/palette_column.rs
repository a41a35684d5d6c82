//! A column of numbers with few different values, such as volumes on a grid.

use std::ops::Index;

use rustc_hash::FxHashMap;

/// One number per point. With at most 256 different values, a point needs one byte.
#[derive(Debug, Clone)]
pub enum PaletteColumn {
    /// The different values, and the index of each point's value.
    Few(Vec<f64>, Vec<u8>),
    /// One value per point.
    Many(Vec<f64>),
}

impl PaletteColumn {
    /// Create the column from the values of all points.
    pub fn new(numbers: Vec<f64>) -> Self {
        let mut table: Vec<f64> = Vec::new();
        let mut known: FxHashMap<u64, u8> = FxHashMap::default();
        let mut which = Vec::with_capacity(numbers.len());
        for number in &numbers {
            let bits = number.to_bits();
            let entry = known.get(&bits).copied().or_else(|| {
                let entry = u8::try_from(table.len()).ok()?;
                table.push(*number);
                known.insert(bits, entry);
                Some(entry)
            });
            let Some(entry) = entry else {
                return Self::Many(numbers);
            };
            which.push(entry);
        }
        Self::Few(table, which)
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        match self {
            Self::Few(_, which) => which.len(),
            Self::Many(numbers) => numbers.len(),
        }
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The values in the order of the points.
    pub fn iter(&self) -> impl Iterator<Item = f64> {
        (0..self.len()).map(|point| self[point])
    }
}

impl Index<usize> for PaletteColumn {
    type Output = f64;

    fn index(&self, point: usize) -> &f64 {
        match self {
            Self::Few(table, which) => &table[usize::from(which[point])],
            Self::Many(numbers) => &numbers[point],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_whether_few_are_different_or_many() {
        for different in [1, 256, 257] {
            let numbers: Vec<f64> = (0..1000).map(|k| f64::from(k % different) - 0.5).collect();
            let repeated = PaletteColumn::new(numbers.clone());
            assert_eq!(matches!(repeated, PaletteColumn::Few(..)), different <= 256);
            assert_eq!(repeated.iter().collect::<Vec<_>>(), numbers);
        }
    }
}
