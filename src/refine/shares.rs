//! Shares of points in what is chosen among those of level 0.

use rustc_hash::FxHashMap;

use super::Grids;
use super::place::Place;

/// Finds with which share points belong to what is chosen: a point of level 0 wholly or not at all, a finer one
/// with the mean of those that it lies between. As it takes its volume from these in equal parts, the volume
/// of what is chosen stays the same, whatever is refined.
pub struct Shares<'a, 'b> {
    grids: &'b Grids<'a>,
    known: FxHashMap<(usize, Place), f64>,
}

impl<'a, 'b> Shares<'a, 'b> {
    /// Of one choice.
    pub fn new(grids: &'b Grids<'a>) -> Self {
        Self {
            grids,
            known: FxHashMap::default(),
        }
    }

    /// The share of a point with this id and reference position (m) in a body; `chosen` says of bodies and
    /// reference positions of level 0 whether they are.
    pub fn of(
        &mut self,
        (body, id, position): (usize, u64, [f64; 3]),
        chosen: &impl Fn(usize, [f64; 3]) -> bool,
    ) -> f64 {
        let place = self.grids.place_at(body, position);
        match place.filter(|_| id >= self.grids.coarsest()) {
            Some(place) => self.at(body, place, chosen),
            None => f64::from(u8::from(chosen(body, position))),
        }
    }

    /// The share of a place in steps of the finest level.
    fn at(&mut self, body: usize, place: Place, chosen: &impl Fn(usize, [f64; 3]) -> bool) -> f64 {
        if let Some(share) = self.known.get(&(body, place)) {
            return *share;
        }
        let share = match self.grids.coarse_position(body, place) {
            Some(position) => f64::from(u8::from(chosen(body, position))),
            None => {
                let parents = self.grids.parents(place);
                let shares = parents.iter().map(|parent| self.at(body, *parent, chosen));
                shares.sum::<f64>() / parents.len() as f64
            }
        };
        self.known.insert((body, place), share);
        share
    }
}
