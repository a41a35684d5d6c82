//! Search for nodes of a level that have nodes of coarser levels within a given distance.

use super::grid_index::{GridIndex, around, between};
use super::grid_index_set::{EDGE, GridIndexSet, PER_WORD, join, split};
use super::pattern::Pattern;

/// A test for the nodes of a given level: whether nodes of coarser levels lie within a given distance of a
/// node.
pub struct NearCoarser<'a> {
    pattern: &'a Pattern,
    level: u32,
    /// Grid indices in spacings of `level`. At these indices, the refinement of coarser nodes adds nodes to
    /// the grid of level 0. A node exists at such an index only if [`Pattern::is_possible`] holds there.
    finer: GridIndexSet,
    /// In a word that contains indices of the grid of level 0: the bits of these indices. These bits are the
    /// same in all such words.
    coarsest: u64,
    /// For each bit of a word, the words that contain indices near the index of the bit. An index is near if
    /// it lies within the given distance. Each of these words is stored as two values: its offset from the
    /// word of the bit, and its bits that belong to near indices.
    reach: Vec<Vec<(GridIndex, u64)>>,
}

impl<'a> NearCoarser<'a> {
    /// Create the test for a level above 0. `edges` is the spacing of the level along each axis. `reach` is
    /// the distance within which coarser nodes are sought, in the same unit as `edges`.
    pub fn new(pattern: &'a Pattern, level: u32, edges: [f64; 3], reach: f64) -> Self {
        let dimension = pattern.dimension();
        let mut finer = GridIndexSet::default();
        for (coarse, index) in pattern.refined().filter(|(coarse, _)| *coarse < level) {
            let scale = 1 << (level - coarse - 1);
            around(index, dimension).for_each(|other| finer.insert(other.map(|x| x * scale)));
        }
        let is_coarsest = |bit: &usize| join([0; 3], *bit).iter().all(|x| x % (1 << level) == 0);
        let coarsest = (0..PER_WORD).filter(is_coarsest);
        let steps = |k: usize| {
            if k < dimension {
                (reach / edges[k]).floor() as i64
            } else {
                0
            }
        };
        let high: GridIndex = std::array::from_fn(steps);
        let offsets = between(high.map(|x| -x), high).filter(|offset| {
            let square: f64 = (0..3).map(|k| (offset[k] as f64 * edges[k]).powi(2)).sum();
            square <= reach * reach
        });
        let offsets: Vec<GridIndex> = offsets.collect();
        let words_of = |bit: usize| {
            let centre = join([0; 3], bit);
            let mut words: Vec<(GridIndex, u64)> = Vec::new();
            for offset in &offsets {
                let (word, bit) = split(std::array::from_fn(|k| centre[k] + offset[k]));
                match words.iter_mut().find(|(other, _)| *other == word) {
                    Some((_, bits)) => *bits |= 1 << bit,
                    None => words.push((word, 1 << bit)),
                }
            }
            words
        };
        Self {
            pattern,
            level,
            finer,
            coarsest: coarsest.fold(0, |all, bit| all | 1 << bit),
            reach: (0..PER_WORD).map(words_of).collect(),
        }
    }

    /// Test whether a coarser node lies within the given distance from the node at `index`. The result is
    /// true if, at an index within this distance, a node of the level is possible (see
    /// [`Pattern::is_possible`]) but does not exist.
    ///
    /// `body` tests whether a level-0 cell belongs to the body.
    pub fn has(&self, body: &impl Fn(GridIndex) -> bool, index: GridIndex) -> bool {
        let (centre, bit) = split(index);
        self.reach[bit].iter().any(|(offset, within)| {
            let word = std::array::from_fn(|k| centre[k] + offset[k]);
            let mut missing = within & !self.occupied(word);
            let next = || {
                let bit = (missing != 0).then(|| missing.trailing_zeros() as usize)?;
                missing &= missing - 1;
                Some(join(word, bit))
            };
            std::iter::from_fn(next).any(|other| self.pattern.is_possible(body, self.level, other))
        })
    }

    /// Return one bit for each grid index of a word. A bit is set if a node exists at the grid index of the
    /// bit. Bits of indices at which no node is possible have no meaning.
    fn occupied(&self, word: GridIndex) -> u64 {
        let steps = (1 << self.level).max(EDGE);
        let on_coarsest = word.iter().all(|x| x * EDGE % steps == 0);
        self.finer.word(word) | if on_coarsest { self.coarsest } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Same as [`NearCoarser::has`], one index at a time.
    fn is_near_coarser(
        pattern: &Pattern,
        body: &impl Fn(GridIndex) -> bool,
        (level, centre): (u32, GridIndex),
        reach: i64,
    ) -> bool {
        let high = std::array::from_fn(|k| if k < pattern.dimension() { reach } else { 0 });
        between(high.map(|x| -x), high)
            .filter(|offset| offset.iter().map(|x| x * x).sum::<i64>() <= reach * reach)
            .map(|offset| std::array::from_fn(|k| centre[k] + offset[k]))
            .any(|other| {
                !pattern.exists(body, level, other) && pattern.is_possible(body, level, other)
            })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn bit_masks_agree_with_single_indices(
            selected in prop::collection::vec((0_u32..3, [-20_i64..20, -20_i64..20, 0_i64..1]), 0..12),
            hole in [-3_i64..3, -3_i64..3, 0_i64..1],
            reach in 1_i64..5,
        ) {
            let body = |cell: GridIndex| cell != hole && cell[..2].iter().all(|x| (-5..5).contains(x));
            let mut pattern = Pattern::new(2, 3);
            for (level, index) in selected {
                pattern.refine(&body, level, index);
            }
            for level in 1..=3 {
                let near_coarser = NearCoarser::new(&pattern, level, [1.0; 3], reach as f64);
                let end = 5 << level;
                for index in between([-end, -end, 0], [end, end, 0]) {
                    if pattern.exists(&body, level, index) {
                        let expected = is_near_coarser(&pattern, &body, (level, index), reach);
                        prop_assert_eq!(near_coarser.has(&body, index), expected);
                    }
                }
            }
        }
    }
}
