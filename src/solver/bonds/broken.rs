//! Consequences of broken bonds.
//!
//! A bond that meets its criterion breaks in the pass that sums the forces. Both ends evaluate the criterion
//! with the same operations, so they get the same result. The force sums exclude the bonds that break. Then
//! point numbers and the forces that depend on them are recomputed, but only at the points that a broken bond
//! affects.

use std::ops::Range;
use std::time::Instant;

use crate::comm::{self, Communicator};
use crate::families::Which;
use crate::solver::model::Model;

use super::breaking::BrokenSums;
use super::evaluate::{Acting, ForceTimes, HaloContent};
use super::force::BondUpdate;
use super::point_numbers::PlasticColumns;
use super::{Forces, Pass};

/// Ranges of points are merged if at most this number of points lies between them.
const GAP: usize = 64;

/// Changes that broken bonds cause at a point in a force evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Broken<const D: usize> {
    /// Local index of the owned point.
    pub point: usize,
    /// Number of bonds that the point loses.
    pub count: u64,
    /// Energy that the point loses, J: its part of the energy of the broken bonds, plus the decrease of its
    /// strain energy when its point numbers change. The part of this decrease that plastic flow dissipates is
    /// not included.
    pub energy: f64,
    /// The point's part of the overshoot energy of the broken bonds, J. The overshoot energy of a bond is its
    /// energy when it breaks, minus the energy at which it meets its criterion.
    pub overshoot: f64,
    /// Force density that the point loses, N/m³: the force sum over the broken bonds of the point, plus the
    /// decrease of the force sum over its other bonds.
    pub force: [f64; D],
}

impl<const D: usize> Broken<D> {
    /// Create the entry of a point from its sums over the breaking bonds.
    pub(super) fn new(broken_sums: &BrokenSums) -> Self {
        let [count, energy, overshoot, force @ ..] = broken_sums.sums;
        Self {
            point: broken_sums.point,
            count: count as u64,
            energy,
            overshoot,
            force: std::array::from_fn(|d| force[d]),
        }
    }

    /// An entry for a point without broken bonds.
    fn none(point: usize) -> Self {
        Self {
            point,
            count: 0,
            energy: 0.0,
            overshoot: 0.0,
            force: [0.0; D],
        }
    }
}

impl<const D: usize> Forces<D> {
    /// Return the changes caused by bonds that broke in the last [evaluation](Self::evaluate). The entries
    /// are in ascending order of their points.
    pub fn broken(&self) -> &[Broken<D>] {
        &self.broken
    }

    /// Merge the entries of [`Self::broken`] that belong to the same point, and recompute the point numbers
    /// and forces that depend on the broken bonds. Called after the force sums. Collective.
    pub(super) fn recompute_after_breaking(
        &mut self,
        comm: &dyn Communicator,
        model: &Model<D>,
        mut acting: Acting<'_, D>,
        times: &mut ForceTimes,
    ) {
        self.merge_broken();
        if self.numbers.passes == 0 || !self.breaks {
            return;
        }
        let mut whole = [f64::from(u8::from(self.broken.is_empty()))];
        comm::min(comm, &mut whole);
        if whole[0] > 0.0 {
            return;
        }
        let start = Instant::now();
        let halo_before = times.halo;
        let own: Vec<usize> = self.broken.iter().map(|broken| broken.point).collect();
        let affected = self.ranges(own.iter().copied());
        self.find_numbers(&affected, model, &mut acting);
        let changed = self.send_numbers(comm, model, own, times);
        for points in self.ranges(changed.into_iter()) {
            self.find_forces(points, acting.force);
        }
        self.merge_broken();
        times.bonds += start.elapsed() - (times.halo - halo_before);
    }

    /// Sort the entries of [`Self::broken`] by point, and merge the entries of the same point.
    fn merge_broken(&mut self) {
        self.broken.sort_by_key(|broken| broken.point);
        self.broken.dedup_by(|later, first| {
            let same = later.point == first.point;
            if same {
                first.count += later.count;
                first.energy += later.energy;
                first.overshoot += later.overshoot;
                for d in 0..D {
                    first.force[d] += later.force[d];
                }
            }
            same
        });
    }

    /// Recompute the point numbers of ranges of points. Record the energy that points with broken bonds lose
    /// by this change. The energy that plastic flow dissipates is not included.
    fn find_numbers(
        &mut self,
        ranges: &[Range<usize>],
        model: &Model<D>,
        acting: &mut Acting<'_, D>,
    ) {
        // The plastic states of the points have already advanced to the end of the step.
        let bond_update = BondUpdate::Step(0.0);
        let Acting { force, plastic, .. } = acting;
        let before: Vec<Vec<f64>> = ranges
            .iter()
            .map(|points| self.energy_with_plastic_work(model, points.clone(), plastic))
            .collect();
        for pass in (0..self.numbers.passes).map(Pass::PointSum) {
            for points in ranges {
                self.clear(pass, points.clone());
                self.run(pass, points.clone(), force, BondUpdate::None);
                self.finish(pass, points.clone(), model, bond_update, plastic);
            }
            // Lattice bonds read copies of the point numbers in the grids, so update these copies. One update
            // for all ranges is enough, because a point sum reads the point numbers of point i only.
            self.update(HaloContent::OwnNumbers, Which::Owned);
        }
        for (points, before) in ranges.iter().zip(before) {
            let after = self.energy_with_plastic_work(model, points.clone(), plastic);
            let first = (self.broken).partition_point(|broken| broken.point < points.start);
            let of_range = self.broken[first..].iter_mut();
            for broken in of_range.take_while(|broken| broken.point < points.end) {
                let k = broken.point - points.start;
                broken.energy += model.volume[broken.point] * (before[k] - after[k]);
            }
        }
    }

    /// Return the stored energy density plus the energy density that plastic flow has dissipated (J/m³), for
    /// each point of a range.
    fn energy_with_plastic_work(
        &mut self,
        model: &Model<D>,
        points: Range<usize>,
        plastic: &PlasticColumns<'_>,
    ) -> Vec<f64> {
        let mut energy = self.stored_at(model, points.clone()).energy;
        let [.., work] = plastic;
        if !work.is_empty() {
            for (energy, work) in energy.iter_mut().zip(&work[points]) {
                *energy += work;
            }
        }
        energy
    }

    /// Send the new point numbers of owned points to the ranks that have ghosts of these points. `own` are
    /// the owned points with new point numbers. Return the owned points whose forces may change; points may
    /// occur several times. Collective.
    fn send_numbers(
        &mut self,
        comm: &dyn Communicator,
        model: &Model<D>,
        own: Vec<usize>,
        times: &mut ForceTimes,
    ) -> Vec<usize> {
        let start = Instant::now();
        let owned = model.owned();
        let mut flags = vec![0.0; model.volume.len()];
        for point in &own {
            flags[*point] = 1.0;
        }
        let mut halo = std::mem::take(&mut self.halo);
        let (columns, count) = self.changing_columns();
        let columns = columns.into_iter().take(count).chain([&mut flags[..]]);
        halo.update_ghosts(comm, &mut columns.collect::<Vec<_>>());
        self.halo = halo;
        times.halo += start.elapsed();
        // `find_numbers` has already updated the copies of owned points.
        self.update(HaloContent::PointNumbers, Which::Ghosts);
        let mut changed = own.clone();
        for interaction in &self.interactions {
            for point in &own {
                let bonds = &interaction.bonds;
                bonds.for_each_neighbour(*point, &mut |there| changed.push(there));
            }
        }
        changed.retain(|point| *point < owned);
        // A bond to a ghost is stored only at its owned point, so the owned neighbours of a ghost are not
        // known. If any ghost has new point numbers, the forces on all border points are recomputed.
        if flags[owned..].iter().any(|flag| *flag > 0.0) {
            changed.extend(model.interior..owned);
        }
        changed
    }

    /// Recompute the forces on a range of points. Append the changes of the force densities to
    /// [`Self::broken`], as lost forces. The new entries are not yet merged with the other entries.
    fn find_forces(&mut self, points: Range<usize>, force: &mut [Vec<f64>; D]) {
        let before = force
            .each_ref()
            .map(|column| column[points.clone()].to_vec());
        for column in force.iter_mut() {
            column[points.clone()].fill(0.0);
        }
        self.run(Pass::Force, points.clone(), force, BondUpdate::None);
        for (k, point) in points.enumerate() {
            let lost: [f64; D] = std::array::from_fn(|d| before[d][k] - force[d][point]);
            if lost == [0.0; D] {
                continue;
            }
            let mut broken = Broken::none(point);
            for d in 0..D {
                broken.force[d] += lost[d];
            }
            self.broken.push(broken);
        }
    }

    /// Return ascending ranges of points that contain the whole lane group of each of `points`. A range may
    /// also contain other points, see [`GAP`].
    fn ranges(&self, points: impl Iterator<Item = usize>) -> Vec<Range<usize>> {
        let mut ranges: Vec<Range<usize>> = points.map(|point| self.lane_group(point)).collect();
        ranges.sort_unstable_by_key(|range| range.start);
        let mut merged: Vec<Range<usize>> = Vec::new();
        for range in ranges {
            match merged.last_mut() {
                Some(last) if range.start <= last.end + GAP => last.end = last.end.max(range.end),
                _ => merged.push(range),
            }
        }
        merged
    }
}
