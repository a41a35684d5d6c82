//! Sets of places that can be asked for many places at once.

use rustc_hash::FxHashMap;

use super::place::Place;

/// Edge of what one word holds, in places.
pub(super) const EDGE: i64 = 4;

/// Places within one word, in each direction of space.
pub(super) const PLACES: usize = (EDGE * EDGE * EDGE) as usize;

/// A set of places, 4 × 4 × 4 to a word.
#[derive(Debug, Clone, Default)]
pub struct PlaceSet {
    words: FxHashMap<Place, u64>,
}

/// The word of a place, and its bit there.
pub(super) fn split(place: Place) -> (Place, usize) {
    let [x, y, z] = place.map(|x| x.rem_euclid(EDGE) as usize);
    let edge = EDGE as usize;
    (place.map(|x| x.div_euclid(EDGE)), x + edge * (y + edge * z))
}

/// The place of a bit of a word.
pub(super) fn join(word: Place, bit: usize) -> Place {
    let edge = EDGE as usize;
    let within = [bit % edge, bit / edge % edge, bit / edge / edge];
    std::array::from_fn(|k| word[k] * EDGE + within[k] as i64)
}

impl PlaceSet {
    /// Adds a place.
    pub fn insert(&mut self, place: Place) {
        let (word, bit) = split(place);
        *self.words.entry(word).or_default() |= 1 << bit;
    }

    /// Whether a place is one of them.
    pub fn contains(&self, place: Place) -> bool {
        let (word, bit) = split(place);
        self.word(word) >> bit & 1 == 1
    }

    /// A bit for each place of a word, which is set for those of the set.
    pub(super) fn word(&self, word: Place) -> u64 {
        self.words.get(&word).copied().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_found_again() {
        let mut set = PlaceSet::default();
        let places = [[0, 0, 0], [-1, 7, 3], [4, -4, 8]];
        places.iter().for_each(|place| set.insert(*place));
        assert!(places.iter().all(|place| set.contains(*place)));
        assert!(!set.contains([1, 0, 0]) && !set.contains([-1, 7, 2]));
        assert_eq!(join([-1, 2, 0], split([-3, 9, 2]).1), [-3, 9, 2]);
    }
}
