//! Search for pairs that may touch, and for the bonds that exclude pairs from contact.

use rayon::prelude::*;

use crate::comm::Communicator;
use crate::solver::bonds::Forces;
use crate::solver::model::Model;
use crate::solver::motion::Fields;

use super::cells::Cells;
use super::ghosts::{Ghost, Ghosts};
use super::rows::{FoundPair, Rows};
use super::{CHUNK, Contact};

/// Skin as a fraction of the largest contact distance. A search finds the pairs whose gap (present distance
/// minus contact distance) is at most the skin. With penalty contact, this skin is so small that the rows of
/// a lattice at rest contain only nearest neighbours.
const SKIN: f64 = 0.4;

/// Limit of the gap of a pair, as a fraction of the largest contact distance. The look-ahead (`LOOK_AHEAD`)
/// ignores pairs with a larger gap. The last search has found all pairs with gaps up to this limit. Therefore
/// the step limits of contact do not depend on when the last search was made.
pub(super) const MOST_GAP: f64 = 0.1;

/// Distance that a point may move between searches, as a fraction of the largest contact distance. If thermal
/// stretches change the contact distance of two points, half of this change counts as motion of each point.
const MOVED: f64 = 0.5 * (SKIN - MOST_GAP);

impl<const D: usize> Contact<D> {
    /// Repeat the search if the lists are stale, or if points have moved or expanded by more than [`MOVED`]
    /// since the last search. Returns whether all positions and thermal stretches on all ranks are finite. If
    /// one of them is not finite, the search is not repeated. Collective.
    pub(super) fn search_where_due(
        &mut self,
        comm: &dyn Communicator,
        model: &Model<D>,
        forces: &Forces<D>,
        fields: &mut Fields<D>,
    ) -> bool {
        let displacement = &fields.displacement;
        let searched = &self.searched;
        let is_stale = self.is_stale;
        let moved = (0..model.owned())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|point| {
                let square: f64 = (0..D)
                    .map(|d| {
                        let before = if is_stale { 0.0 } else { searched[d][point] };
                        (displacement[d][point] - before).powi(2)
                    })
                    .sum();
                finite_or_infinity(square)
            });
        let moved = moved.reduce(|| 0.0, f64::max);
        let [expanded, stretch] = self.largest_stretches(model, fields);
        let mut largest = [moved, expanded, stretch];
        comm.max(&mut largest);
        let [moved, expanded, stretch] = largest;
        if largest.iter().any(|value| value.is_infinite()) {
            return false;
        }
        // A contact distance without thermal stretch is at most `largest`, so it has changed by at most
        // `largest` times `expanded`.
        let allowed = MOVED - 0.5 * expanded;
        if is_stale || allowed < 0.0 || moved > (allowed * self.largest).powi(2) {
            self.search(comm, model, forces, fields, stretch);
        }
        true
    }

    /// Two values over the owned points: the largest change of the thermal stretch since the last search, and
    /// the largest thermal stretch. A change or stretch that is not finite counts as +∞. Both values are 0 in
    /// runs without temperatures.
    fn largest_stretches(&self, model: &Model<D>, fields: &Fields<D>) -> [f64; 2] {
        let Some(column) = &fields.thermal_stretch else {
            return [0.0; 2];
        };
        let stretches = column[..model.owned()].par_iter().with_min_len(CHUNK);
        let stretch = stretches
            .clone()
            .map(|stretch| finite_or_infinity(*stretch));
        let stretch = stretch.reduce(|| -1.0, f64::max);
        if self.is_stale {
            return [0.0, stretch];
        }
        let changes = stretches.zip(&self.searched_stretch);
        let changes = changes.map(|(now, before)| finite_or_infinity((now - before).abs()));
        [changes.reduce(|| 0.0, f64::max), stretch]
    }

    /// Find the pairs that may touch before the next search. `stretch` is the largest thermal stretch of all
    /// points. Collective.
    fn search(
        &mut self,
        comm: &dyn Communicator,
        model: &Model<D>,
        forces: &Forces<D>,
        fields: &mut Fields<D>,
        stretch: f64,
    ) {
        let (skin, expansion) = (SKIN * self.largest, 1.0 + stretch);
        let reach = self.largest * expansion + skin;
        let mut all: Vec<Ghost> = (0..model.owned())
            .map(|point| Ghost {
                id: model.ids[point],
                index: point as u64,
                block: model.block[point].into(),
                volume: model.volume[point],
                reference: model.position(point),
                position: fields.position(model, point),
            })
            .collect();
        let is_thermal = fields.thermal_stretch.is_some();
        self.ghosts = Ghosts::within(comm, self.dimension, &all, reach, is_thermal);
        all.extend_from_slice(&self.ghosts.points);
        let positions: Vec<[f64; 3]> = all.iter().map(|point| point.position).collect();
        let cells = Cells::new(&positions, reach, D);
        let edge = |index: usize| match index.checked_sub(model.owned()) {
            None => self.edges[index],
            Some(ghost) => self.ghosts.edges[ghost],
        };
        let mut rows = Rows::new(model.owned(), |point, row| {
            let here = &all[point];
            cells.near(here.position, |index| {
                let there = &all[index];
                let rule = &self.rules[here.block as usize * self.blocks + there.block as usize];
                let (Some(rule), true) = (rule, index != point) else {
                    return;
                };
                let apart = |a: &[f64; 3], b: &[f64; 3]| {
                    (0..D).map(|d| (a[d] - b[d]).powi(2)).sum::<f64>().sqrt()
                };
                let reference = apart(&here.reference, &there.reference);
                let distance = rule.distance([edge(point), edge(index)], reference);
                if apart(&here.position, &there.position) <= distance * expansion + skin {
                    row.push(FoundPair {
                        id: there.id,
                        other: index as u32,
                    });
                }
            });
        });
        if self.is_stale {
            forces.for_each_intact(|point, other| {
                if !rows.is_empty(point) {
                    rows.set_bonded(point, model.ids[other]);
                }
            });
        } else {
            for point in rows.inherit(&self.rows) {
                find_bonds(&mut rows, model, forces, point);
            }
        }
        self.rows = rows;
        let before = std::mem::take(&mut self.open);
        for point in 0..model.owned() {
            self.is_open[point] = self.rows.is_open(point);
            if self.is_open[point] {
                self.open.push(point as u32);
            }
        }
        for point in before {
            if !self.is_open[point as usize] {
                fields.clear_contact(point as usize);
            }
        }
        for d in 0..D {
            self.searched[d].clear();
            self.searched[d].extend_from_slice(&fields.displacement[d][..model.owned()]);
        }
        if let Some(column) = &fields.thermal_stretch {
            self.searched_stretch.clear();
            self.searched_stretch
                .extend_from_slice(&column[..model.owned()]);
        }
        self.is_stale = false;
    }

    /// Update the bonded flags of the points with entries in [`Forces::broken`]. Bonds of these points broke
    /// in the last evaluation. If the step has been rolled back since, these bonds are intact again.
    pub(super) fn update_bonds(&mut self, model: &Model<D>, forces: &Forces<D>) {
        if self.rows.is_unused() {
            return;
        }
        for broken in forces.broken() {
            let point = broken.point;
            find_bonds(&mut self.rows, model, forces, point);
            if !self.is_open[point] && self.rows.is_open(point) {
                self.is_open[point] = true;
                self.open.push(point as u32);
            }
        }
    }
}

fn finite_or_infinity(value: f64) -> f64 {
    if value.is_nan() { f64::INFINITY } else { value }
}

/// Set the bonded flags of the pairs of a point.
fn find_bonds<const D: usize>(rows: &mut Rows, model: &Model<D>, forces: &Forces<D>, point: usize) {
    if rows.is_empty(point) {
        return;
    }
    rows.set_unbonded(point);
    forces.for_each_neighbour(point, |other| rows.set_bonded(point, model.ids[other]));
}
