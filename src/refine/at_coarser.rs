//! Which nodes of a level have coarser ones within reach.

use super::pattern::Pattern;
use super::place::{Place, around, between};
use super::place_set::{EDGE, PLACES, PlaceSet, join, split};

/// Tells which nodes of a level have coarser ones within reach.
pub struct AtCoarser<'a> {
    pattern: &'a Pattern,
    level: u32,
    /// Where nodes of the level are that are none of level 0.
    finer: PlaceSet,
    /// What of a word lies on the grid of level 0, where any of it does.
    coarsest: u64,
    /// For each place of a word: which bits of the words around are within reach.
    reach: Vec<Vec<(Place, u64)>>,
}

impl<'a> AtCoarser<'a> {
    /// For a level above 0, whose nodes lie `edges` apart and reach so far, in the same unit of length.
    pub fn new(pattern: &'a Pattern, level: u32, edges: [f64; 3], reach: f64) -> Self {
        let dimension = pattern.dimension();
        let mut finer = PlaceSet::default();
        for (coarse, place) in pattern.refined().filter(|(coarse, _)| *coarse < level) {
            let scale = 1 << (level - coarse - 1);
            around(place, dimension).for_each(|other| finer.insert(other.map(|x| x * scale)));
        }
        let is_coarsest = |bit: &usize| join([0; 3], *bit).iter().all(|x| x % (1 << level) == 0);
        let coarsest = (0..PLACES).filter(is_coarsest);
        let steps = |k: usize| {
            if k < dimension {
                (reach / edges[k]).floor() as i64
            } else {
                0
            }
        };
        let high: Place = std::array::from_fn(steps);
        let offsets = between(high.map(|x| -x), high).filter(|offset| {
            let square: f64 = (0..3).map(|k| (offset[k] as f64 * edges[k]).powi(2)).sum();
            square <= reach * reach
        });
        let offsets: Vec<Place> = offsets.collect();
        let of_place = |bit: usize| {
            let here = join([0; 3], bit);
            let mut words: Vec<(Place, u64)> = Vec::new();
            for offset in &offsets {
                let (word, bit) = split(std::array::from_fn(|k| here[k] + offset[k]));
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
            reach: (0..PLACES).map(of_place).collect(),
        }
    }

    /// Whether there is no node, but could be one, at any place of the level's grid within reach of one, which
    /// is given in steps of the level; `body` says of cells whether they are the body's.
    pub fn has(&self, body: &impl Fn(Place) -> bool, place: Place) -> bool {
        let (here, bit) = split(place);
        self.reach[bit].iter().any(|(offset, within)| {
            let word = std::array::from_fn(|k| here[k] + offset[k]);
            let mut missing = within & !self.taken(word);
            let next = || {
                let bit = (missing != 0).then(|| missing.trailing_zeros() as usize)?;
                missing &= missing - 1;
                Some(join(word, bit))
            };
            std::iter::from_fn(next).any(|other| self.pattern.is_possible(body, self.level, other))
        })
    }

    /// Where nodes of a word are, if there can be any.
    fn taken(&self, word: Place) -> u64 {
        let steps = (1 << self.level).max(EDGE);
        let on_coarsest = word.iter().all(|x| x * EDGE % steps == 0);
        self.finer.word(word) | if on_coarsest { self.coarsest } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// What [`AtCoarser::has`] says, place by place.
    fn is_at_coarser(
        pattern: &Pattern,
        body: &impl Fn(Place) -> bool,
        (level, here): (u32, Place),
        reach: i64,
    ) -> bool {
        let high = std::array::from_fn(|k| if k < pattern.dimension() { reach } else { 0 });
        between(high.map(|x| -x), high)
            .filter(|offset| offset.iter().map(|x| x * x).sum::<i64>() <= reach * reach)
            .map(|offset| std::array::from_fn(|k| here[k] + offset[k]))
            .any(|other| {
                !pattern.exists(body, level, other) && pattern.is_possible(body, level, other)
            })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn many_places_at_once_are_each_by_itself(
            picks in prop::collection::vec((0_u32..3, [-20_i64..20, -20_i64..20, 0_i64..1]), 0..12),
            hole in [-3_i64..3, -3_i64..3, 0_i64..1],
            reach in 1_i64..5,
        ) {
            let body = |cell: Place| cell != hole && cell[..2].iter().all(|x| (-5..5).contains(x));
            let mut pattern = Pattern::new(2, 3);
            for (level, place) in picks {
                pattern.refine(&body, level, place);
            }
            for level in 1..=3 {
                let at_coarser = AtCoarser::new(&pattern, level, [1.0; 3], reach as f64);
                let end = 5 << level;
                for place in between([-end, -end, 0], [end, end, 0]) {
                    if pattern.exists(&body, level, place) {
                        let expected = is_at_coarser(&pattern, &body, (level, place), reach);
                        prop_assert_eq!(at_coarser.has(&body, place), expected);
                    }
                }
            }
        }
    }
}
