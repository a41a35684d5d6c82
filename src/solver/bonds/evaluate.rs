//! Force evaluation: passes over the bonds, and the halo exchanges between them.

use std::ops::Range;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::comm::Communicator;
use crate::damage::{Criterion, StressMeasure};
use crate::families::{BlockBonds, Which};
use crate::lanes::{Column, LaneTuple, Lanes};
use crate::material::bond::stretch_of;
use crate::material::{Law, MOST, with_law, with_pair};
use crate::solver::model::Model;

use super::breaking::BreakingBonds;
use super::broken::Broken;
use super::force::{BondUpdate, Force};
use super::list_points;
use super::point_numbers::PlasticColumns;
use super::point_stresses::StressInputs;
use super::point_sums::{PassSum, SmallestStretch};
use super::sweep::{PointData, sweep, sweep_and_break};
use super::{Forces, Pass, threshold};

/// Number of points that one task processes.
const CHUNK: usize = 4096;

/// Number of interior points that a thread processes between two calls that advance the messages. In 3-D, the
/// sums over the bonds of these points take a few tenths of a millisecond.
const PIECE: usize = 4096;

/// Maximum number of columns of [`Forces::changing_columns`].
const MAX_HALO_COLUMNS: usize = MOST.point + 4 + StressMeasure::ALL.len();

/// The columns that [`Forces::halo_columns`] returns, and the number of these columns. Further entries of the
/// array are empty.
type HaloColumns<'a> = ([&'a mut [f64]; MAX_HALO_COLUMNS], usize);

/// Point data that a pass receives from other ranks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum HaloContent {
    /// Displacements, and thermal stretches if the run has temperatures.
    Motion,
    /// Failure thresholds, which depend on the smallest stretches.
    Thresholds,
    /// Point numbers, rotations and stress measures that change before each force sum.
    PointNumbers,
    /// Nothing is sent. The point numbers, rotations and stress measures of owned points are copied to the
    /// grids.
    OwnNumbers,
    /// No data are sent or copied.
    None,
}

/// Wall time of the parts of a force evaluation.
#[derive(Debug, Clone, Copy, Default)]
pub struct ForceTimes {
    /// Sums over bonds.
    pub bonds: Duration,
    /// Packing and unpacking of messages, and waiting for messages.
    pub halo: Duration,
}

impl ForceTimes {
    /// Total time.
    pub fn whole(&self) -> Duration {
        self.bonds + self.halo
    }
}

/// Fields that a force evaluation reads and writes.
pub struct Acting<'a, const D: usize> {
    /// Displacements of the local points, m; the evaluation updates the displacements of ghosts.
    pub displacement: &'a mut [Vec<f64>; D],
    /// Thermal stretches of the local points; `None` in runs without temperatures. The evaluation updates the
    /// stretches of ghosts.
    pub thermal_stretch: Option<&'a mut [f64]>,
    /// Internal force density of the owned points, N/m³. The force density must be 0 on entry, because the
    /// evaluation adds the bond forces.
    pub force: &'a mut [Vec<f64>; D],
    /// Plastic state of the owned points. Only [`BondUpdate::Step`] changes this state.
    pub plastic: PlasticColumns<'a>,
}

impl<const D: usize> Forces<D> {
    /// Exchange ghost data and sum the internal force density. Call after [`Self::with_bond_inputs`] has
    /// written the data of the owned points. `bond_update` says whether bonds break, and how the bond history
    /// advances. Afterwards, [`Self::broken`] returns the changes caused by bonds that broke in this
    /// evaluation. Collective.
    pub fn evaluate(
        &mut self,
        comm: &dyn Communicator,
        model: &Model<D>,
        acting: Acting<'_, D>,
        bond_update: BondUpdate,
        times: &mut ForceTimes,
    ) {
        let Acting {
            displacement,
            mut thermal_stretch,
            force,
            mut plastic,
        } = acting;
        self.broken.clear();
        let owned = model.owned();
        let piece = PIECE * rayon::current_num_threads();
        let start = Instant::now();
        let mut in_bonds = Duration::ZERO;
        for pass_index in 0..self.passes.len() {
            let pass = self.passes[pass_index];
            let content = self.content(pass_index);
            let mut halo = std::mem::take(&mut self.halo);
            let (columns, count) =
                self.halo_columns(content, displacement, thermal_stretch.as_deref_mut());
            if count > 0 {
                halo.pack(columns[..count].iter().map(|column| &**column));
            }
            self.clear(pass, 0..owned);
            let mut timed = |work: &mut dyn FnMut()| {
                let start = Instant::now();
                work();
                in_bonds += start.elapsed();
            };
            let mut interior = |progress: &mut dyn FnMut() -> bool| {
                timed(&mut || self.update(content, Which::Owned));
                let mut rest = 0..model.interior;
                // Once all messages have arrived, the remaining points are processed in one piece.
                while rest.len() > piece && progress() {
                    let next = self.border(rest.start + piece);
                    let points = rest.start..next;
                    timed(&mut || self.run(pass, points.clone(), force, bond_update));
                    rest.start = next;
                }
                timed(&mut || self.run(pass, rest.clone(), force, bond_update));
            };
            if count == 0 {
                interior(&mut || false);
            } else {
                halo.exchange(comm, &mut interior);
                let (columns, count) =
                    self.halo_columns(content, displacement, thermal_stretch.as_deref_mut());
                halo.unpack(columns.into_iter().take(count));
            }
            self.halo = halo;
            let start = Instant::now();
            if content == HaloContent::Motion {
                self.update_moved_ghosts(model, displacement, thermal_stretch.as_deref());
            }
            self.update(content, Which::Ghosts);
            let border = model.interior..owned;
            self.run(pass, border, force, bond_update);
            self.finish(pass, 0..owned, model, bond_update, &mut plastic);
            // Only evaluations in which bonds can break read the stresses.
            if pass == Pass::PointSum(0) && bond_update.is_stored() {
                let read = StressInputs {
                    model,
                    blocks: &self.blocks,
                    plastic: &plastic,
                    thermal_stretch: thermal_stretch.as_deref(),
                };
                (self.numbers).find_stresses(&read, &mut self.limits.stresses);
            }
            in_bonds += start.elapsed();
        }
        times.bonds += in_bonds;
        times.halo += start.elapsed() - in_bonds;
        if bond_update.is_stored() {
            let acting = Acting {
                displacement,
                thermal_stretch,
                force,
                plastic,
            };
            self.recompute_after_breaking(comm, model, acting, times);
        }
    }

    /// Return the first point, from `from` on, that starts a new lane group. The loop over the interior
    /// points is split only at such points. If a lane group were split, its last points would get their bond
    /// contributions in another order. The round-off of their sums would then depend on when messages arrive.
    pub(super) fn border(&self, from: usize) -> usize {
        let end = self.lane_group(from - 1).end;
        if end == from { from } else { self.border(end) }
    }

    /// Return the columns that change before each force sum, and that laws or criteria read at both ends of a
    /// bond. These columns hold point numbers, rotations and stress measures. Also return the number of these
    /// columns.
    pub(super) fn changing_columns(&mut self) -> HaloColumns<'_> {
        let first = self.numbers.first_changing;
        let changing = first..self.numbers.read.max(first);
        let numbers = self.numbers.columns[changing].iter_mut();
        let columns = numbers.chain(self.limits.kept_changing());
        let mut all = std::array::from_fn(|_| &mut [][..]);
        let mut count = 0;
        for column in columns {
            all[count] = &mut column[..];
            count += 1;
        }
        (all, count)
    }

    /// Return the columns that a halo exchange with this content sends and receives, and the number of these
    /// columns. The columns have one entry per local point.
    fn halo_columns<'a>(
        &'a mut self,
        content: HaloContent,
        displacement: &'a mut [Vec<f64>; D],
        thermal_stretch: Option<&'a mut [f64]>,
    ) -> HaloColumns<'a> {
        let mut all: [&mut [f64]; MAX_HALO_COLUMNS] = std::array::from_fn(|_| &mut [][..]);
        let mut count = 0;
        let mut add = |column: &'a mut [f64]| {
            all[count] = column;
            count += 1;
        };
        match content {
            HaloContent::Motion => {
                let columns = displacement.iter_mut().map(Vec::as_mut_slice);
                columns.chain(thermal_stretch).for_each(add);
            }
            HaloContent::Thresholds => add(&mut self.limits.thresholds),
            HaloContent::PointNumbers => return self.changing_columns(),
            HaloContent::OwnNumbers | HaloContent::None => {}
        }
        (all, count)
    }

    /// Return the name and the number of columns of each halo exchange of a force evaluation. If bonds break,
    /// the point numbers are sent a second time. The result does not contain this second exchange.
    pub fn halo_sizes(&mut self) -> Vec<(&'static str, usize)> {
        let mut sizes = Vec::new();
        for pass_index in 0..self.passes.len() {
            sizes.push(match self.content(pass_index) {
                HaloContent::Motion if self.is_thermal => {
                    ("displacements and thermal stretches", D + 1)
                }
                HaloContent::Motion => ("displacements", D),
                HaloContent::Thresholds => ("thresholds", 1),
                HaloContent::PointNumbers => {
                    let (_, count) = self.changing_columns();
                    ("point numbers, rotations and stresses", count)
                }
                HaloContent::OwnNumbers | HaloContent::None => continue,
            });
        }
        sizes
    }

    /// Return the point data that the pass with index `pass_index` receives from other ranks.
    fn content(&self, pass_index: usize) -> HaloContent {
        match (
            pass_index.checked_sub(1).map(|before| self.passes[before]),
            self.passes[pass_index],
        ) {
            (None, _) => HaloContent::Motion,
            (Some(Pass::SmallestStretch), _) => HaloContent::Thresholds,
            (Some(Pass::PointSum(_)), Pass::Force) => HaloContent::PointNumbers,
            (Some(Pass::PointSum(_)), _) => HaloContent::OwnNumbers,
            _ => HaloContent::None,
        }
    }

    /// Copy computed or received thresholds, point numbers, rotations and stress measures to the grids, where
    /// lattice bonds read these values.
    pub(super) fn update(&mut self, content: HaloContent, which: Which) {
        for grid in &mut self.grids {
            match content {
                HaloContent::Thresholds => grid.update_thresholds(which, &self.limits.thresholds),
                HaloContent::OwnNumbers if which == Which::Ghosts => {}
                HaloContent::PointNumbers | HaloContent::OwnNumbers => {
                    let first = self.numbers.first_changing;
                    grid.update_numbers(which, first, &self.numbers.columns);
                    grid.update_rotations(which, &self.limits.rotations);
                    grid.update_stresses(which, &self.limits.stresses);
                }
                HaloContent::Motion | HaloContent::None => {}
            }
        }
    }

    /// Copy received displacements and thermal stretches of ghosts to the arrays that bonds read.
    /// `BondInputs` has already written the values of owned points.
    fn update_moved_ghosts(
        &mut self,
        model: &Model<D>,
        displacement: &[Vec<f64>; D],
        thermal_stretch: Option<&[f64]>,
    ) {
        for grid in &mut self.grids {
            grid.update_ghosts(displacement, thermal_stretch);
        }
        if !self.nodes.is_empty() {
            let owned = model.owned();
            let ghosts = self.nodes[owned..].par_chunks_mut(CHUNK).enumerate();
            ghosts.for_each(|(chunk, nodes)| {
                let first = owned + chunk * CHUNK;
                list_points::update(
                    nodes,
                    displacement.each_ref().map(|column| &column[first..]),
                    thermal_stretch.map(|column| &column[first..]),
                );
            });
        }
    }

    /// Reset the sums of a pass over a range of points: smallest stretches to ∞ and point sums to 0. Forces
    /// are not reset.
    pub(super) fn clear(&mut self, pass: Pass, points: Range<usize>) {
        match pass {
            Pass::SmallestStretch => self.limits.thresholds[points].fill(f64::INFINITY),
            Pass::PointSum(_) => {
                for sums in &mut self.numbers.sums {
                    sums[points.clone()].fill(0.0);
                }
            }
            Pass::Force => {}
        }
    }

    /// Run a pass over the bonds of a range of owned points, and add the results to the columns of this pass.
    pub(super) fn run(
        &mut self,
        pass: Pass,
        points: Range<usize>,
        force: &mut [Vec<f64>; D],
        bond_update: BondUpdate,
    ) {
        match pass {
            Pass::SmallestStretch => {
                // The column is taken out of `limits` while it is written.
                let mut thresholds = [std::mem::take(&mut self.limits.thresholds)];
                self.for_each_interaction(|interaction, source| {
                    let results = <[Lanes; 1]>::columns_mut(&mut thresholds);
                    let bonds = &mut interaction.bonds;
                    sweep(bonds, points.clone(), results, &SmallestStretch, source);
                });
                [self.limits.thresholds] = thresholds;
            }
            Pass::PointSum(number) => {
                let mut sums = std::mem::take(&mut self.numbers.sums);
                self.for_each_interaction(|interaction, source| {
                    let (bonds, points) = (&mut interaction.bonds, points.clone());
                    with_law!(interaction.laws.laws()[0], law => {
                        sum_pass(number, bonds, points, law, bond_update, &mut sums, source);
                    });
                });
                self.numbers.sums = sums;
            }
            Pass::Force => {
                let mut broken = std::mem::take(&mut self.broken);
                self.for_each_interaction(|interaction, source| {
                    let criterion = if bond_update.is_stored() {
                        interaction.criterion
                    } else {
                        Criterion::Never
                    };
                    let no_volume_correction = interaction.no_volume_correction;
                    let breaking = BreakingBonds {
                        laws: interaction.laws.laws(),
                        criterion,
                        no_volume_correction,
                    };
                    with_pair!(interaction.laws, laws => {
                        let kernel = Force { laws, criterion, no_volume_correction, bond_update };
                        let results = force.each_mut().map(Vec::as_mut_slice);
                        let bonds = &mut interaction.bonds;
                        let points = points.clone();
                        let broken_sums =
                            sweep_and_break(bonds, points, results, &kernel, &breaking, source);
                        broken.extend(broken_sums.iter().map(Broken::new));
                    });
                });
                self.broken = broken;
            }
        }
    }

    /// Compute the results of a pass from its sums, for a range of points. Depending on the pass, the results
    /// are the thresholds, or the point numbers and rotations.
    pub(super) fn finish(
        &mut self,
        pass: Pass,
        points: Range<usize>,
        model: &Model<D>,
        bond_update: BondUpdate,
        plastic: &mut PlasticColumns<'_>,
    ) {
        let blocks = &self.blocks;
        match pass {
            Pass::SmallestStretch => {
                let strength = &self.strength;
                let thresholds = self.limits.thresholds[points.clone()].par_iter_mut();
                thresholds
                    .with_min_len(CHUNK)
                    .zip(points)
                    .for_each(|(value, point)| {
                        // A point without intact bonds has the minimum ∞. The threshold of such a point is
                        // computed for a smallest stretch of 0.
                        let smallest = if value.is_infinite() {
                            0.0
                        } else {
                            stretch_of(*value)
                        };
                        *value = threshold(blocks, model, strength, point, smallest);
                    });
            }
            Pass::PointSum(number) => {
                if number == 0 {
                    let rotations = &mut self.limits.rotations;
                    (self.numbers).find_rotations(points.clone(), model, blocks, rotations);
                }
                self.numbers
                    .finish(number, points, model, blocks, plastic, bond_update);
            }
            Pass::Force => {}
        }
    }
}

/// Run the kernel of a point sum over the bonds, if the law has a point sum with this index.
fn sum_pass<L: Law<D>, const D: usize>(
    number: usize,
    bonds: &mut BlockBonds,
    points: Range<usize>,
    law: L,
    bond_update: BondUpdate,
    sums: &mut [Column],
    source: PointData<'_, D>,
) {
    if number >= law.counts().passes {
        return;
    }
    let results = L::Sum::columns_mut(sums);
    // No law has more than three point sums. Loops are compiled only for the point sums that a law has.
    match number {
        0 if const { L::PASSES > 0 } => {
            let kernel = PassSum::<L, 0> { law, bond_update };
            sweep(bonds, points, results, &kernel, source);
        }
        1 if const { L::PASSES > 1 } => {
            let kernel = PassSum::<L, 1> { law, bond_update };
            sweep(bonds, points, results, &kernel, source);
        }
        2 if const { L::PASSES > 2 } => {
            let kernel = PassSum::<L, 2> { law, bond_update };
            sweep(bonds, points, results, &kernel, source);
        }
        _ => unreachable!("a law with more passes than loops"),
    }
}
