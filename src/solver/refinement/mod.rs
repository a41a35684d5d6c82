//! Refinement during a run: which points are refined or removed, and the state of new points.
//!
//! Three kinds of points trigger refinement: points with much strain energy, points with damage, and points
//! at which a condition of the deck is true. All points within the horizon of such a point are refined
//! (Dipasquale et al. 2014, §2.1). A new point gets the mean state of its parents. The new point takes its
//! volume from the parents in equal parts, so mass and momentum are conserved. Bonds that exist before and
//! after the refinement keep their state. A facet is a face between points that a crack separates. A new bond
//! starts broken if it crosses a pre-crack or a facet. No point is created between points that a crack
//! separates.

use std::cell::OnceCell;

use crate::comm::sum::reduce;
use crate::comm::{self, IdOrder};
use crate::error::{Error, ErrorKind, Result};
use crate::points::{Point, distance_squared};
use crate::problem::StepRule;
use crate::refine::{Grids, NodeKey};

mod facets;
mod past;
mod trigger;

use super::Simulation;
use super::assign::cutoffs;
use super::conditions::trigger_is_finite;
use super::motion::fields::{Birth, plastic_columns};
use super::observers::Snapshot;
use super::observers::history::point_sums;
use super::steps::automatic_step;
use facets::Facets;
use past::{NOWHERE, Past};
pub use trigger::is_possible;

/// Number of points that a refinement has created and removed, over all ranks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Regridded {
    /// Number of points that were created.
    pub created: u64,
    /// Number of points that were removed.
    pub removed: u64,
}

/// Total changes by all refinements since the start; the same on all ranks.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Refined {
    /// Kinetic and strain energy that refinements have added, J; negative if refinements have removed energy.
    pub energy: f64,
    /// Number of intact bonds that refinements have added, minus the number of intact bonds that refinements
    /// have removed. Each bond counts twice.
    pub bonds: i64,
}

impl Refined {
    /// Encode the totals for a checkpoint.
    pub fn words(self) -> [u64; 2] {
        [self.energy.to_bits(), self.bonds as u64]
    }

    /// Decode the totals from [`Self::words`].
    pub fn of_words([energy, bonds]: [u64; 2]) -> Self {
        Self {
            energy: f64::from_bits(energy),
            bonds: bonds as i64,
        }
    }
}

/// State of the points of new grids, computed from the state before the change of grids. Each rank has the
/// points in its range of ids.
struct GridState {
    /// State of the points, one row per point. The last number of a row is the block of the point before the
    /// refinement, or [`NOWHERE`] if the point did not exist.
    rows: Vec<f64>,
    /// Length of a row.
    width: usize,
    /// Number of broken bonds of each point.
    lengths: Vec<u32>,
    /// Ids of the neighbours j of these broken bonds, ascending for each point.
    broken: Vec<u64>,
}

impl<'a, const D: usize> Simulation<'a, D> {
    /// Check that refinement during the run creates no bonds that need a history.
    ///
    /// # Errors
    /// If refinement can add points during the run, and bonds have a history; the error is the same on all
    /// ranks.
    pub(super) fn can_bond_new_points(&self) -> Result<()> {
        let message = "[refinement.trigger]: is not available for laws whose bonds have history variables, because new bonds \
                       would have no history; use [refinement.region], which refines from the start";
        let trigger = self.trigger().filter(|_| self.forces.has_history());
        trigger.map_or(Ok(()), |trigger| {
            Err(Error::input(message).at(&trigger.span))
        })
    }

    /// Whether points are checked for refinement at the present step.
    pub fn is_refinement_due(&self) -> bool {
        self.trigger().is_some_and(|trigger| {
            // At the end of a stage, no check is made, because the first step of the next stage may have
            // another length.
            self.clock.number().is_multiple_of(trigger.every_steps) && !self.is_stage_over()
        })
    }

    /// Refine and coarsen as the trigger of the problem requests. A refined point is coarsened if, for at
    /// least `coarsen_after` (s), it has been outside the horizons of triggering points and of points with
    /// broken bonds. Return the numbers of created and removed points; `None` if the grids do not change.
    /// Collective.
    ///
    /// # Errors
    /// If the conditions of the trigger are not finite at a point. If the points cannot be distributed or
    /// bonded: for example, if METIS fails or if a rank has too little memory for its bonds. The error is the
    /// same on all ranks. The run cannot continue after the error, because its points have been freed from
    /// memory.
    pub fn refine(&mut self) -> Result<Option<Regridded>> {
        let Some(trigger) = self.trigger() else {
            return Ok(None);
        };
        let start = self.times.start();
        let time = self.clock.time();
        let is_finite = trigger_is_finite(self.problem, self.comm, &self.model, time);
        is_finite.map_err(|error| Error {
            kind: ErrorKind::Run,
            ..error
        })?;
        let snapshot = if trigger.energy.is_some() {
            Snapshot::new(self)
        } else {
            Snapshot::without_energies(self)
        };
        let wanted = self.wanted(trigger, &snapshot);
        drop(snapshot);
        if wanted.finer.is_empty() && wanted.coarser.is_empty() {
            return Ok(None);
        }
        let mut grids = self.grids.clone();
        let refined = grids.refine(&wanted.finer);
        let removed = grids.coarsen(&wanted.coarser);
        if !refined && removed.is_empty() {
            return Ok(None);
        }
        let facets = Facets::new(self);
        if !facets.are_none() {
            grids.suppress_separated(&self.grids, &|a, b| {
                facets.lie_between(&facets.near(a), a, b)
            });
        }
        let (energy, bonds) = self.energy_and_bonds();
        let before = self.model.total;
        self.regrid(grids, &removed, &facets)?;
        let (new_energy, new_bonds) = self.energy_and_bonds();
        self.progress.refined.energy += new_energy - energy;
        self.progress.refined.bonds += new_bonds as i64 - bonds as i64;
        let regridding = self.times.since(&start);
        self.times.regridding += regridding;
        let removed = removed.len() as u64;
        Ok(Some(Regridded {
            created: self.model.total + removed - before,
            removed,
        }))
    }

    /// Sum kinetic and strain energy (J) over all ranks, and count the intact bonds; each bond counts twice.
    /// Collective.
    fn energy_and_bonds(&mut self) -> (f64, u64) {
        let snapshot = Snapshot::new(self);
        let sums = point_sums(self, &snapshot);
        // Both energies are in one sum, which is rounded once.
        let mut energy = [sums[0].clone()];
        energy[0].merge(&sums[1]);
        let energy = reduce(self.comm, &mut energy)[0];
        (energy, comm::total(self.comm, snapshot.intact()))
    }

    /// Continue the run on the new `grids`, with the state of all points and bonds. `removed` are the nodes
    /// that the new grids no longer contain. Collective.
    ///
    /// # Errors
    /// If the points cannot be distributed or bonded: for example, if METIS fails or if a rank has too little
    /// memory for its bonds. The error is the same on all ranks. After an error, the run cannot continue,
    /// because its points have been freed.
    fn regrid(&mut self, grids: Grids<'a>, removed: &[NodeKey], facets: &Facets) -> Result<()> {
        let comm = self.comm;
        let points = self.points_on(&grids);
        let GridState {
            rows,
            width,
            lengths,
            broken,
        } = self.state_on(&grids, removed, &points);
        self.release();
        let mut other = self.on(grids, points)?;
        let order = other.id_order();
        let rows = order.spread(comm, &rows, width);
        let own_lengths = order.spread(comm, &lengths, 1);
        let broken = order.spread_ragged(comm, &broken, &own_lengths, &lengths);
        other.inherit(&rows, width, (&own_lengths, &broken), facets);
        other.take_rows(&rows, width);
        other.continue_from(&self.progress_words());
        other.take_over(self);
        let (time, rule) = (other.clock.time(), other.time_rule());
        if let StepRule::Automatic(safety) = rule.step {
            let rest = rule.end - time;
            let most = automatic_step(other.problem, &rule, safety, other.undeformed.stable_step);
            other.clock.set_step(rest / (rest / most).ceil());
        }
        other.apply_displacements(time, 0.0);
        other.recompute_derived();
        other.apply_velocities();
        *self = other;
        Ok(())
    }

    /// Create the points of `grids` that lie in the level-0 cells of this rank.
    fn points_on(&self, grids: &Grids<'a>) -> Vec<Point> {
        let coarse = self.owned_points().into_iter();
        let coarse = coarse.filter(|point| point.id < grids.coarsest());
        grids.points(grids.unrefined(coarse))
    }

    /// Create the run on other grids, at time 0. Collective.
    fn on(&self, grids: Grids<'a>, points: Vec<Point>) -> Result<Self> {
        Self::of_points(self.problem, self.comm, (points, grids), None, &mut || {
            Ok(())
        })
    }

    /// Replace this run by a run at time 0 on the grids of a checkpoint. `state` contains the refined and the
    /// suppressed nodes, as in [`Grids::state`]. Collective.
    ///
    /// # Errors
    /// If the points cannot be distributed or bonded: for example, if METIS fails or if a rank has too little
    /// memory for its bonds. The error is the same on all ranks.
    pub fn refine_to(&mut self, state: &[Vec<NodeKey>; 2]) -> Result<()> {
        let mut grids = self.grids.clone();
        if grids.refine_to(state) {
            let points = self.points_on(&grids);
            self.release();
            *self = self.on(grids, points)?;
        } else {
            self.grids = grids;
        }
        Ok(())
    }

    /// Compute the state of the points of new grids from the present state. `points` are the points that this
    /// rank creates on the new grids. `removed` are the present nodes that the new grids no longer have.
    /// Collective.
    fn state_on(&mut self, grids: &Grids<'_>, removed: &[NodeKey], points: &[Point]) -> GridState {
        let comm = self.comm;
        let past = Past::new(self, grids, removed);
        let (ids, rows) = past.rows(self, grids, points);
        let mut all_broken = self.broken();
        let (mut own, mut own_lengths) = (Vec::new(), vec![0; ids.len()]);
        let staying = past.staying(self.model.owned());
        for (length, point) in own_lengths.iter_mut().zip(staying) {
            *length = all_broken[point].len() as u32;
            own.append(&mut all_broken[point]);
        }
        let order = IdOrder::new(comm, &ids, self.model.coarsest);
        let width = past.columns.len();
        let lengths = order.collect(comm, &own_lengths, 1);
        GridState {
            rows: order.collect(comm, &rows, width),
            width,
            broken: order.collect_ragged(comm, &own, &own_lengths, &lengths),
            lengths,
        }
    }

    /// For each owned point, return the ids of the neighbours j of its broken bonds, ascending.
    fn broken(&self) -> Vec<Vec<u64>> {
        let mut broken = vec![Vec::new(); self.model.owned()];
        self.forces
            .for_each_broken(|here, there| broken[here].push(self.model.ids[there]));
        broken.iter_mut().for_each(|ids| ids.sort_unstable());
        broken
    }

    /// Break the bonds that were broken before the refinement, and new bonds that cross facets. `rows` are
    /// the rows of [`GridState`] of the owned points. `broken` contains the ids of the neighbours j of all
    /// broken bonds. `lengths` contains the number of these ids for each owned point. Collective.
    fn inherit(
        &mut self,
        rows: &[f64],
        width: usize,
        (lengths, broken): (&[u32], &[u64]),
        facets: &Facets,
    ) {
        if comm::total(self.comm, broken.len() as u64) == 0 && facets.are_none() {
            return;
        }
        let model = &self.model;
        let mut was: Vec<f64> = rows
            .iter()
            .skip(width - 1)
            .step_by(width)
            .copied()
            .collect();
        let blocks = model.block.iter().map(|block| f64::from(*block));
        let same = was.iter().zip(blocks);
        let mut same: Vec<f64> = same
            .map(|(was, is)| f64::from(u8::from(*was == is)))
            .collect();
        for column in [&mut was, &mut same] {
            column.resize(model.volume.len(), 0.0);
            self.forces.update_ghosts(self.comm, &mut [column]);
        }
        let ends = lengths.iter().scan(0, |end, length| {
            *end += *length as usize;
            Some(*end)
        });
        let starts: Vec<usize> = std::iter::once(0).chain(ends).collect();
        let cutoffs = cutoffs(self.problem);
        let count = self.problem.block_count();
        let near: Vec<OnceCell<Vec<u32>>> = vec![OnceCell::new(); model.owned()];
        let concerned = |point: usize| {
            starts[point] < starts[point + 1] || facets.are_near(model.position(point))
        };
        let concerned: Vec<bool> = (0..model.owned()).map(concerned).collect();
        let was_broken = |here: usize, there: usize| {
            let own = &broken[starts[here]..starts[here + 1]];
            own.binary_search(&model.ids[there]).is_ok()
        };
        let cut = |here: usize, there: usize| {
            // Both points still have their previous blocks, so this bond existed before the refinement.
            if same[here] == 1.0 && same[there] == 1.0 {
                return was_broken(here, there);
            }
            let [a, b] = [here, there].map(|point| model.position(point));
            let [old, other] = [was[here], was[there]];
            if old != NOWHERE && other != NOWHERE {
                let cutoff = cutoffs[old as usize * count + other as usize];
                if distance_squared(a, b) <= cutoff * cutoff {
                    return was_broken(here, there);
                }
            }
            let near = near[here].get_or_init(|| facets.near(a));
            if model.ids[here] < model.ids[there] {
                facets.lie_between(near, a, b)
            } else {
                facets.lie_between(near, b, a)
            }
        };
        self.forces.cut(|point| concerned[point], cut);
    }

    /// Set the state of the owned points from the rows of [`GridState`]. Fields of [`Birth::Shared`] are
    /// multiplied by the volume, because rows contain the densities of these fields. The last number of a row
    /// is the previous block, which is not part of the state. The rows of some points are means over other
    /// points; the laws correct the plastic states of these points.
    fn take_rows(&mut self, rows: &[f64], width: usize) {
        let volume = &self.model.volume;
        let fields = self.fields.each_mut().filter(|(field, _)| field.state);
        let columns =
            fields.flat_map(|(field, columns)| columns.iter_mut().map(move |c| (field, c)));
        for (k, (field, column)) in columns.enumerate() {
            let values = rows.iter().skip(k).step_by(width);
            for ((number, value), volume) in column.iter_mut().zip(values).zip(volume.iter()) {
                *number = match field.birth {
                    Birth::Shared => value * volume,
                    _ => *value,
                };
            }
        }
        if self.forces.has_plasticity() {
            let fields = &mut self.fields;
            let plastic = plastic_columns(
                &mut fields.plastic_strain,
                &mut fields.plastic_strain_equivalent,
                &mut fields.yield_change,
                &mut fields.control_energy,
                &mut fields.plastic_work,
            );
            self.forces.correct_means(&self.model, plastic);
        }
    }
}
