//! A force evaluation: its stages, with messages between them.

use std::ops::Range;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::comm::Communicator;
use crate::damage::Criterion;
use crate::families::{BlockBonds, Which};
use crate::lanes::{Lanes, Numbers};
use crate::material::bond::stretch_of;
use crate::material::{Law, with_pair};
use crate::solver::model::Model;

use super::force::{Evolution, Force};
use super::interaction::Interaction;
use super::list_points;
use super::point_sums::{SmallestStretch, StageSum};
use super::sweep::{Source, sweep};
use super::{Forces, Stage};

/// Points handled by one task.
const CHUNK: usize = 4096;

/// Interior points for each thread that are worked on before messages are driven on again: some tenths
/// of a millisecond in space.
const PIECE: usize = 4096;

/// What a stage reads anew from other ranks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum News {
    Displacement,
    Thresholds,
    Numbers,
    Nothing,
}

/// Where the time of a force evaluation went.
#[derive(Debug, Clone, Copy, Default)]
pub struct ForceTimes {
    /// Sums over bonds.
    pub bonds: Duration,
    /// Packing, waiting for and unpacking messages.
    pub halo: Duration,
}

impl ForceTimes {
    /// All of it.
    pub fn whole(&self) -> Duration {
        self.bonds + self.halo
    }
}

/// What a force evaluation changes.
pub struct Acting<'a, const D: usize> {
    /// Displacements of the local points, m; those of ghosts are brought up to date.
    pub displacement: &'a mut [Vec<f64>; D],
    /// Internal force density of the owned points, N/m³; replaced.
    pub force: &'a mut [Vec<f64>; D],
    /// Energy that each owned point's share of bonds has set free by breaking, J; added to.
    pub freed: &'a mut [f64],
}

impl<const D: usize> Forces<D> {
    /// Brings the ghosts up to date and replaces the internal force densities. Bonds break and
    /// remember, or nothing changes but forces. Collective.
    pub fn evaluate(
        &mut self,
        comm: &dyn Communicator,
        model: &Model<D>,
        acting: Acting<'_, D>,
        evolution: Evolution,
        times: &mut ForceTimes,
    ) {
        let Acting {
            displacement,
            force,
            freed,
        } = acting;
        let owned = model.owned();
        let piece = PIECE * rayon::current_num_threads();
        let start = Instant::now();
        let mut in_bonds = Duration::ZERO;
        for component in force.iter_mut() {
            component
                .par_chunks_mut(CHUNK)
                .for_each(|part| part.fill(0.0));
        }
        for turn in 0..self.stages.len() {
            let stage = self.stages[turn];
            let news = self.news(turn);
            let mut halo = std::mem::take(&mut self.halo);
            let first = self.numbers.first_changing;
            let changing = first..self.numbers.read.max(first);
            match news {
                News::Displacement => halo.pack(displacement.iter().map(Vec::as_slice)),
                News::Thresholds => halo.pack([&self.thresholds[..]].into_iter()),
                News::Numbers => {
                    let columns = &self.numbers.columns[changing.clone()];
                    halo.pack(columns.iter().map(Vec::as_slice));
                }
                News::Nothing => {}
            }
            self.clear(stage, owned);
            let mut timed = |work: &mut dyn FnMut()| {
                let start = Instant::now();
                work();
                in_bonds += start.elapsed();
            };
            let mut interior = |progress: &mut dyn FnMut() -> bool| {
                timed(&mut || self.update(news, Which::Owned, model, displacement));
                let mut rest = 0..model.interior;
                // Once all messages have arrived the rest is done in one piece.
                while rest.len() > piece && progress() {
                    let next = rest.start + piece;
                    timed(&mut || self.run(stage, rest.start..next, force, freed, evolution));
                    rest.start = next;
                }
                timed(&mut || self.run(stage, rest.clone(), force, freed, evolution));
            };
            if news == News::Nothing {
                interior(&mut || false);
            } else {
                halo.exchange(comm, &mut interior);
            }
            match news {
                News::Displacement => {
                    halo.unpack(displacement.iter_mut().map(Vec::as_mut_slice));
                }
                News::Thresholds => halo.unpack([&mut self.thresholds[..]].into_iter()),
                News::Numbers => {
                    let columns = &mut self.numbers.columns[changing];
                    halo.unpack(columns.iter_mut().map(Vec::as_mut_slice));
                }
                News::Nothing => {}
            }
            self.halo = halo;
            let start = Instant::now();
            self.update(news, Which::Ghosts, model, displacement);
            self.run(stage, model.interior..owned, force, freed, evolution);
            self.finish(stage, model, freed);
            in_bonds += start.elapsed();
        }
        times.bonds += in_bonds;
        times.halo += start.elapsed() - in_bonds;
    }

    /// What a stage reads anew from other ranks.
    fn news(&self, turn: usize) -> News {
        match (
            turn.checked_sub(1).map(|before| self.stages[before]),
            self.stages[turn],
        ) {
            (None, _) => News::Displacement,
            (Some(Stage::SmallestStretch), _) => News::Thresholds,
            (Some(Stage::PointSum(_)), Stage::Force) => News::Numbers,
            _ => News::Nothing,
        }
    }

    /// Shows the bonds what is new of some of the points.
    fn update(&mut self, news: News, which: Which, model: &Model<D>, displacement: &[Vec<f64>; D]) {
        for grid in &mut self.grids {
            match news {
                News::Displacement => grid.update_displacement(which, displacement),
                News::Thresholds => grid.update_thresholds(which, &self.thresholds),
                News::Numbers => {
                    let first = self.numbers.first_changing;
                    grid.update_numbers(which, first, &self.numbers.columns);
                }
                News::Nothing => {}
            }
        }
        if news == News::Displacement && !self.nodes.is_empty() {
            let (owned, local) = (model.owned(), model.volume.len());
            let points = match which {
                Which::Owned => 0..owned,
                Which::Ghosts => owned..local,
                Which::All => 0..local,
            };
            list_points::update(&mut self.nodes, points, displacement);
        }
    }

    /// Gets ready for a stage.
    fn clear(&mut self, stage: Stage, owned: usize) {
        match stage {
            Stage::SmallestStretch => self.thresholds[..owned].fill(f64::INFINITY),
            Stage::PointSum(_) => self.numbers.sums.iter_mut().for_each(|sums| sums.fill(0.0)),
            Stage::Force => {}
        }
    }

    /// Sums over the bonds of a range of the owned points.
    fn run(
        &mut self,
        stage: Stage,
        points: Range<usize>,
        force: &mut [Vec<f64>; D],
        freed: &mut [f64],
        evolution: Evolution,
    ) {
        let criterion = |interaction: &Interaction, here: bool| {
            if here && evolution == Evolution::Step {
                interaction.criterion
            } else {
                Criterion::Never
            }
        };
        match stage {
            Stage::SmallestStretch => {
                // Taken out while it is written.
                let mut thresholds = [std::mem::take(&mut self.thresholds)];
                self.for_each_interaction(|interaction, source| {
                    let results = <([Lanes; 1], [Lanes; 0])>::columns_mut(&mut thresholds);
                    let bonds = &mut interaction.bonds;
                    sweep(bonds, points.clone(), results, &SmallestStretch, source);
                });
                [self.thresholds] = thresholds;
            }
            Stage::PointSum(number) => {
                let mut sums = std::mem::take(&mut self.numbers.sums);
                self.for_each_interaction(|interaction, source| {
                    let criterion = criterion(interaction, number == 0);
                    let points = points.clone();
                    let bonds = &mut interaction.bonds;
                    with_pair!(interaction.laws, laws => {
                        sum_stage(number, bonds, points, laws, criterion, &mut sums, freed, source);
                    });
                });
                self.numbers.sums = sums;
            }
            Stage::Force => self.for_each_interaction(|interaction, source| {
                fn sums_before<L: Law<D>, const D: usize>(_: &[L; 2]) -> bool {
                    L::STAGES > 0
                }
                with_pair!(interaction.laws, laws => {
                    let criterion = criterion(interaction, !sums_before::<_, D>(&laws));
                    let kernel = Force { laws, criterion, evolution };
                    let results = (force.each_mut().map(Vec::as_mut_slice), [&mut *freed]);
                    sweep(&mut interaction.bonds, points.clone(), results, &kernel, source);
                });
            }),
        }
    }

    /// Finds what the points make of the sums of a stage.
    fn finish(&mut self, stage: Stage, model: &Model<D>, freed: &mut [f64]) {
        let blocks = &self.blocks;
        match stage {
            Stage::SmallestStretch => {
                let owned = self.thresholds[..model.owned()].par_iter_mut();
                let owned = owned.with_min_len(CHUNK).zip(&model.block);
                owned.for_each(|(value, block)| {
                    *value = match blocks[usize::from(*block)].damage {
                        // A point without intact bonds has no smallest stretch.
                        Some(law) if value.is_infinite() => law.critical,
                        Some(law) => law.threshold(stretch_of(*value)),
                        None => f64::INFINITY,
                    };
                });
            }
            Stage::PointSum(number) => self.numbers.finish(number, model, blocks, freed),
            Stage::Force => {}
        }
    }
}

/// Runs the kernel of a stage, if the law has so many.
#[expect(clippy::too_many_arguments, reason = "called once, generic in the law")]
fn sum_stage<L: Law<D>, const D: usize>(
    number: usize,
    bonds: &mut BlockBonds,
    points: Range<usize>,
    laws: [L; 2],
    criterion: Criterion,
    sums: &mut [Vec<f64>],
    freed: &mut [f64],
    source: Source<'_, D>,
) {
    if number >= L::STAGES {
        return;
    }
    let half = sums.len() / 2;
    let (left, lost) = sums.split_at_mut(half);
    let results = (
        L::Sum::columns_mut(left),
        (L::Sum::columns_mut(lost), [freed]),
    );
    // No law has more stages, and no loop is compiled for those that a law does not have.
    match number {
        0 if const { L::STAGES > 0 } => {
            let kernel = StageSum::<L, 0> { laws, criterion };
            sweep(bonds, points, results, &kernel, source);
        }
        _ => unreachable!("a law with more stages than loops"),
    }
}
