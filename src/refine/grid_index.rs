//! Grid indices of a level, their parents and their neighbours.

/// A grid index: a position relative to the centre of cell 0, in spacings of a level.
pub type GridIndex = [i64; 3];

/// The indices with components from `low` to `high`, both included.
pub(super) fn between(low: GridIndex, high: GridIndex) -> impl Iterator<Item = GridIndex> {
    let [x, y, z] = std::array::from_fn(|k| low[k]..=high[k]);
    z.flat_map(move |z| {
        let x = x.clone();
        y.clone()
            .flat_map(move |y| x.clone().map(move |x| [x, y, z]))
    })
}

/// The parents of an index. The results are grid indices in spacings of the next coarser level. An index that
/// lies half-way between coarser indices in 0, 1, 2 or 3 directions has 1, 2, 4 or 8 parents, respectively.
pub(super) fn parents(index: GridIndex) -> impl Iterator<Item = GridIndex> {
    let low = index.map(|x| x.div_euclid(2));
    let high = index.map(|x| (x + 1).div_euclid(2));
    between(low, high)
}

/// The positions around a grid index, at a distance of half a spacing along one or several axes: 2 in 1-D,
/// 8 in 2-D, 26 in 3-D. The results are grid indices in spacings of the next finer level.
pub(super) fn around(index: GridIndex, dimension: usize) -> impl Iterator<Item = GridIndex> {
    let middle = index.map(|x| 2 * x);
    let step = |k: usize| i64::from(k < dimension);
    let low = std::array::from_fn(|k| middle[k] - step(k));
    let high = std::array::from_fn(|k| middle[k] + step(k));
    between(low, high).filter(move |other| *other != middle)
}

/// Return the grid index with the number `number` in a level-0 cell. The grid indices of `level` in this cell
/// are numbered from 0, and x varies fastest. Number 0 is `origin`, the index of the centre of the level-0
/// cell. All indices are in spacings of the level.
pub(super) fn numbered(origin: GridIndex, level: u32, number: u64) -> GridIndex {
    let mask = (1 << level) - 1;
    std::array::from_fn(|k| origin[k] + (number >> (k as u32 * level) & mask) as i64)
}

/// Number of directions in which an index lies half-way between indices of the next coarser level.
pub(super) fn halves(index: GridIndex) -> u32 {
    index.iter().map(|x| (x & 1) as u32).sum()
}

/// Return the coarsest level whose grid contains the position of `index`, and the grid index of this position
/// in spacings of that level. `index` is in spacings of `level`.
pub(super) fn canonical(mut level: u32, mut index: GridIndex) -> (u32, GridIndex) {
    while level > 0 && halves(index) == 0 {
        level -= 1;
        index = index.map(|x| x / 2);
    }
    (level, index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_has_the_number_of_neighbours_of_the_paper() {
        for (dimension, count) in [(1, 2), (2, 8), (3, 26)] {
            assert_eq!(around([3, 0, 0], dimension).count(), count);
        }
    }

    #[test]
    fn indices_of_a_cell_are_numbered_with_x_fastest() {
        let indices: Vec<GridIndex> = (0..16).map(|k| numbered([8, -4, 0], 2, k)).collect();
        assert_eq!(
            indices[..5],
            [[8, -4, 0], [9, -4, 0], [10, -4, 0], [11, -4, 0], [8, -3, 0]]
        );
        assert_eq!(indices[15], [11, -1, 0]);
        assert_eq!(numbered([0; 3], 1, 6), [0, 1, 1]);
    }

    #[test]
    fn parents_and_canonical_levels() {
        assert_eq!(parents([4, -2, 0]).collect::<Vec<_>>(), [[2, -1, 0]]);
        let pair = [[-2, 1, 0], [-1, 1, 0]];
        assert_eq!(parents([-3, 2, 0]).collect::<Vec<_>>(), pair);
        assert_eq!(parents([1, 1, 1]).count(), 8);
        assert_eq!(canonical(3, [4, -12, 0]), (1, [1, -3, 0]));
        assert_eq!(canonical(3, [8, 16, 0]), (0, [1, 2, 0]));
    }
}
