//! The fraction of each point that belongs to a set, on refined grids.

use rustc_hash::FxHashMap;

use super::Grids;
use super::grid_index::GridIndex;

/// Calculator that determines which fraction of a point belongs to a set.
///
/// The fraction of a level-0 point is 0 or 1. The fraction of a finer point is the mean of the fractions of
/// its parents. A point takes its volume in equal parts from its parents, so refinement does not change the
/// volume of the set.
pub struct SetFractions<'a, 'b> {
    grids: &'b Grids<'a>,
    cache: FxHashMap<(usize, GridIndex), f64>,
}

impl<'a, 'b> SetFractions<'a, 'b> {
    /// Create a calculator for one set.
    pub fn new(grids: &'b Grids<'a>) -> Self {
        Self {
            grids,
            cache: FxHashMap::default(),
        }
    }

    /// Return the fraction of a point that belongs to the set. The arguments are the body, the id and the
    /// reference position (m) of the point. `selected` tests whether the set contains a body's level-0 point,
    /// given the body and the reference position.
    pub fn of(
        &mut self,
        (body, id, position): (usize, u64, [f64; 3]),
        selected: &impl Fn(usize, [f64; 3]) -> bool,
    ) -> f64 {
        let index = self.grids.index_at(body, position);
        match index.filter(|_| id >= self.grids.coarsest()) {
            Some(index) => self.at(body, index, selected),
            None => f64::from(u8::from(selected(body, position))),
        }
    }

    /// Return the fraction of the point at `index` that belongs to the set. `index` is in spacings of the
    /// finest level.
    fn at(
        &mut self,
        body: usize,
        index: GridIndex,
        selected: &impl Fn(usize, [f64; 3]) -> bool,
    ) -> f64 {
        if let Some(fraction) = self.cache.get(&(body, index)) {
            return *fraction;
        }
        let fraction = match self.grids.coarse_position(body, index) {
            Some(position) => f64::from(u8::from(selected(body, position))),
            None => {
                let parents = self.grids.parents(index);
                let fractions = parents
                    .iter()
                    .map(|parent| self.at(body, *parent, selected));
                fractions.sum::<f64>() / parents.len() as f64
            }
        };
        self.cache.insert((body, index), fraction);
        fraction
    }
}
