//! Places on the grids of the levels, and what lies around them.

/// A place in steps of the spacing of some level, from the centre of cell 0.
pub type Place = [i64; 3];

/// The places with components from `low` to `high`.
pub(super) fn between(low: Place, high: Place) -> impl Iterator<Item = Place> {
    let [x, y, z] = std::array::from_fn(|k| low[k]..=high[k]);
    z.flat_map(move |z| {
        let x = x.clone();
        y.clone()
            .flat_map(move |y| x.clone().map(move |x| [x, y, z]))
    })
}

/// The nodes of the next coarser level between which a place lies, in steps of that level: itself, or 2,
/// 4 or 8 by the number of directions in which it lies half-way.
pub(super) fn parents(place: Place) -> impl Iterator<Item = Place> {
    let low = place.map(|x| x.div_euclid(2));
    let high = place.map(|x| (x + 1).div_euclid(2));
    between(low, high)
}

/// The half-spacing places around a place, in steps of the next finer level: 2 in 1-D, 8 in the plane, 26
/// in 3-D.
pub(super) fn around(place: Place, dimension: usize) -> impl Iterator<Item = Place> {
    let middle = place.map(|x| 2 * x);
    let step = |k: usize| i64::from(k < dimension);
    let low = std::array::from_fn(|k| middle[k] - step(k));
    let high = std::array::from_fn(|k| middle[k] + step(k));
    between(low, high).filter(move |other| *other != middle)
}

/// The place with this number in a cell of level 0, in steps of a level; `origin` is that of the cell's
/// centre, which has number 0, and x is fastest.
pub(super) fn numbered(origin: Place, level: u32, number: u64) -> Place {
    let mask = (1 << level) - 1;
    std::array::from_fn(|k| origin[k] + (number >> (k as u32 * level) & mask) as i64)
}

/// In how many directions a place lies half-way between nodes of the next coarser level.
pub(super) fn halves(place: Place) -> u32 {
    place.iter().map(|x| (x & 1) as u32).sum()
}

/// The same place in steps of the coarsest level that has it, and that level.
pub(super) fn canonical(mut level: u32, mut place: Place) -> (u32, Place) {
    while level > 0 && halves(place) == 0 {
        level -= 1;
        place = place.map(|x| x / 2);
    }
    (level, place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_has_as_many_places_around_it_as_the_paper_says() {
        for (dimension, count) in [(1, 2), (2, 8), (3, 26)] {
            assert_eq!(around([3, 0, 0], dimension).count(), count);
        }
    }

    #[test]
    fn places_of_a_cell_are_numbered_with_x_fastest() {
        let places: Vec<Place> = (0..16).map(|k| numbered([8, -4, 0], 2, k)).collect();
        assert_eq!(
            places[..5],
            [[8, -4, 0], [9, -4, 0], [10, -4, 0], [11, -4, 0], [8, -3, 0]]
        );
        assert_eq!(places[15], [11, -1, 0]);
        assert_eq!(numbered([0; 3], 1, 6), [0, 1, 1]);
    }

    #[test]
    fn a_place_lies_between_its_parents() {
        assert_eq!(parents([4, -2, 0]).collect::<Vec<_>>(), [[2, -1, 0]]);
        let pair = [[-2, 1, 0], [-1, 1, 0]];
        assert_eq!(parents([-3, 2, 0]).collect::<Vec<_>>(), pair);
        assert_eq!(parents([1, 1, 1]).count(), 8);
        assert_eq!(canonical(3, [4, -12, 0]), (1, [1, -3, 0]));
        assert_eq!(canonical(3, [8, 16, 0]), (0, [1, 2, 0]));
    }
}
