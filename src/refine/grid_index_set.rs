//! Sets of grid indices as bit masks, to test many indices at once.

use rustc_hash::FxHashMap;

use super::grid_index::GridIndex;

/// Edge of the cube of indices that one 64-bit word represents.
pub(super) const EDGE: i64 = 4;

/// Indices per word.
pub(super) const PER_WORD: usize = (EDGE * EDGE * EDGE) as usize;

/// A set of grid indices, 4 × 4 × 4 per word.
#[derive(Debug, Clone, Default)]
pub struct GridIndexSet {
    words: FxHashMap<GridIndex, u64>,
}

/// Return the key of the word that contains an index, and the number of the bit that represents the index.
pub(super) fn split(index: GridIndex) -> (GridIndex, usize) {
    let [x, y, z] = index.map(|x| x.rem_euclid(EDGE) as usize);
    let edge = EDGE as usize;
    (index.map(|x| x.div_euclid(EDGE)), x + edge * (y + edge * z))
}

/// The index that belongs to a bit of a word.
pub(super) fn join(word: GridIndex, bit: usize) -> GridIndex {
    let edge = EDGE as usize;
    let within = [bit % edge, bit / edge % edge, bit / edge / edge];
    std::array::from_fn(|k| word[k] * EDGE + within[k] as i64)
}

impl GridIndexSet {
    /// Insert an index.
    pub fn insert(&mut self, index: GridIndex) {
        let (word, bit) = split(index);
        *self.words.entry(word).or_default() |= 1 << bit;
    }

    /// Test whether an index is in the set.
    pub fn contains(&self, index: GridIndex) -> bool {
        let (word, bit) = split(index);
        self.word(word) >> bit & 1 == 1
    }

    /// The bits of `word`. A bit is 1 if this set contains the grid index that belongs to the bit.
    pub(super) fn word(&self, word: GridIndex) -> u64 {
        self.words.get(&word).copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inserted_indices_are_contained() {
        let mut set = GridIndexSet::default();
        let indices = [[0, 0, 0], [-1, 7, 3], [4, -4, 8]];
        indices.iter().for_each(|index| set.insert(*index));
        assert!(indices.iter().all(|index| set.contains(*index)));
        assert!(!set.contains([1, 0, 0]) && !set.contains([-1, 7, 2]));
        assert_eq!(join([-1, 2, 0], split([-3, 9, 2]).1), [-3, 9, 2]);
    }
}
