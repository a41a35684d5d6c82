//! Internal forces: sums over bonds in stages, with messages between them.
//!
//! A force evaluation is a list of stages, made once from the laws in use. Each is a sum over the
//! bonds of every point; what it finds, the next one reads at the own end of bonds or at both. A
//! stage begins with a message where it reads anew what other ranks find: first the displacements,
//! then thresholds or numbers of points. Interior points are worked on while messages are in flight.
//!
//! Bonds break in the first stage of a law that reads them, so that numbers of points and forces know
//! the same bonds.

mod force;
mod grid_points;
mod interaction;
mod kernel;
mod list_points;
mod measures;
mod point_numbers;
mod point_sums;
mod sweep;

use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::comm::{Communicator, Halo};
use crate::damage::Criterion;
use crate::error::Result;
use crate::families::{BlockBonds, Grid, Which};
use crate::lanes::{Instructions, Lanes, Numbers};
use crate::material::bond::stretch_of;
use crate::material::{Law, with_pair};

use super::model::Model;
use grid_points::GridValues;
use kernel::Kernel;
use list_points::Node;
use point_numbers::PointNumbers;
use point_sums::{SmallestStretch, StageSum, WholeSum};
use sweep::{Source, sweep};

pub use force::Evolution;
pub use interaction::{BlockLaws, Interaction};

/// Points handled by one task.
const CHUNK: usize = 4096;

/// Interior points for each thread that are worked on before messages are driven on again: some tenths
/// of a millisecond in space.
const PIECE: usize = 4096;

/// One sum over the bonds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// The smallest stretch of each point, which its threshold follows from.
    SmallestStretch,
    /// The sum of this number of the laws that have one.
    PointSum(usize),
    /// The forces.
    Force,
}

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

/// What a force evaluation changes.
pub struct Acting<'a, const D: usize> {
    /// Displacements of the local points, m; those of ghosts are brought up to date.
    pub displacement: &'a mut [Vec<f64>; D],
    /// Internal force density of the owned points, N/m³; replaced.
    pub force: &'a mut [Vec<f64>; D],
    /// Energy that each owned point's share of bonds has set free by breaking, J; added to.
    pub freed: &'a mut [f64],
}

/// What the bonds of the owned points hold, by column over the points.
#[derive(Debug, Clone, PartialEq)]
pub struct Stored {
    /// Strain energy density W, J/m³.
    pub energy: Vec<f64>,
    /// Volume of the intact neighbours in the point's own family, m³.
    pub volume: Vec<f64>,
    /// Number of intact neighbours, those included that have the point in their family only.
    pub neighbours: Vec<f64>,
    /// Energy density that bonds have dissipated without breaking, J/m³; empty where no law can.
    pub dissipated: Vec<f64>,
}

/// What bonds and energy were at the end of a step, to go back there.
#[derive(Debug, Default)]
pub struct KeptBonds(Vec<(Vec<u8>, Vec<Lanes>)>);

/// The bonds of a rank and what it takes to sum over them.
pub struct Forces<const D: usize> {
    interactions: Vec<Interaction>,
    /// The laws of each block.
    blocks: Vec<BlockLaws>,
    /// The points as lists of bonds read them; empty if there is no list.
    nodes: Vec<Node>,
    /// The points as lattices read them, by grid.
    grids: Vec<GridValues<D>>,
    numbers: PointNumbers,
    /// Threshold of each local point; empty if no damage law needs it.
    thresholds: Vec<f64>,
    /// The stages of a force evaluation.
    stages: Vec<Stage>,
    halo: Halo,
    instructions: Instructions,
    /// Whether any law dissipates energy in intact bonds.
    remembers: bool,
}

impl<const D: usize> Forces<D> {
    /// Puts together the bonds, the halo plan and the blocks' laws, and finds the points' constants
    /// from their whole families; collective.
    ///
    /// # Errors
    /// When the wish for [instructions](Instructions::of_all) is none; the same on all ranks.
    pub fn new(
        comm: &dyn Communicator,
        model: &Model<D>,
        mut interactions: Vec<Interaction>,
        grids: Vec<Arc<Grid>>,
        halo: Halo,
        blocks: Vec<BlockLaws>,
    ) -> Result<Self> {
        let instructions = Instructions::of_all(comm)?;
        // The same on all ranks, whatever bonds they have.
        let kind = |block: &BlockLaws| std::mem::discriminant(&block.law);
        let mixed = blocks.windows(2).any(|pair| kind(&pair[0]) != kind(&pair[1]));
        let numbers = PointNumbers::new(&blocks, mixed, model);
        let with_thresholds =
            (blocks.iter()).any(|block| block.damage.is_some_and(|law| law.alpha > 0.0));
        let mut remembers = false;
        for interaction in &mut interactions {
            fn width<L: Law<D>, const D: usize>(_: &[L; 2]) -> usize {
                2 * L::Memory::COUNT
            }
            let width = with_pair!(&interaction.laws, laws => width::<_, D>(laws));
            remembers |= width > 0;
            interaction.bonds.remember(width);
        }
        let stages = [
            with_thresholds.then_some(Stage::SmallestStretch),
            Some(Stage::Force),
        ];
        let mut stages: Vec<Stage> = stages.into_iter().flatten().collect();
        let force = stages.len() - 1;
        stages.splice(force..force, (0..numbers.stages).map(Stage::PointSum));
        let lists = |i: &Interaction| matches!(i.bonds, BlockBonds::List(_));
        let mut forces = Self {
            nodes: if interactions.iter().any(lists) {
                list_points::nodes(model)
            } else {
                Vec::new()
            },
            grids: grids
                .into_iter()
                .map(|grid| GridValues::new(grid, numbers.read, with_thresholds))
                .collect(),
            thresholds: vec![
                0.0;
                if with_thresholds {
                    model.volume.len()
                } else {
                    0
                }
            ],
            interactions,
            blocks,
            numbers,
            stages,
            halo,
            instructions,
            remembers,
        };
        if forces.numbers.with_constants {
            forces.find_constants(comm, model);
        }
        Ok(forces)
    }

    fn find_constants(&mut self, comm: &dyn Communicator, model: &Model<D>) {
        let mut sums = vec![vec![0.0; model.owned()]; crate::material::MOST.whole_sum];
        self.for_each_interaction(|interaction, source| {
            with_pair!(interaction.laws, laws => {
                let kernel = WholeSum { law: laws[0] };
                sweep_all(&mut interaction.bonds, &mut sums, &kernel, source);
            });
        });
        self.numbers.set_constants(model, &self.blocks, &sums);
        let Self { numbers, halo, .. } = self;
        let read = &mut numbers.columns[..numbers.read];
        halo.pack(read.iter().map(Vec::as_slice));
        halo.exchange(comm, &mut |_| {});
        halo.unpack(read.iter_mut().map(Vec::as_mut_slice));
        for grid in &mut self.grids {
            grid.update_numbers(Which::All, 0, &self.numbers.columns);
        }
    }

    /// Calls `work` for all bonds between two blocks after one another.
    fn for_each_interaction(&mut self, mut work: impl FnMut(&mut Interaction, Source<'_, D>)) {
        let source = Source {
            nodes: &self.nodes,
            numbers: &self.numbers.columns,
            thresholds: &self.thresholds,
            grids: &self.grids,
            instructions: self.instructions,
        };
        for interaction in &mut self.interactions {
            work(interaction, source);
        }
    }

    /// Bonds of the rank's points, each counted from its end here, broken ones included.
    pub fn directed_bonds(&self) -> u64 {
        self.interactions.iter().map(|i| i.bonds.bonds()).sum()
    }

    /// Those of [`Self::directed_bonds`] that are kept as lattices.
    pub fn lattice_bonds(&self) -> u64 {
        let all = self.interactions.iter().map(|i| &i.bonds);
        all.filter(|bonds| matches!(bonds, BlockBonds::Lattice(_)))
            .map(BlockBonds::bonds)
            .sum()
    }

    /// The bonds of the rank's points from each block to each, counted from their ends here, broken ones
    /// included.
    pub fn bonds_of_blocks(&self) -> impl Iterator<Item = ([usize; 2], u64)> {
        let all = self.interactions.iter().map(|i| &i.bonds);
        all.map(|bonds| (bonds.blocks(), bonds.bonds()))
    }

    /// Memory of the bonds and of what they read of the points, bytes.
    pub fn bytes(&self) -> usize {
        let bonds: usize = self.interactions.iter().map(|i| i.bonds.bytes()).sum();
        let grids: usize = self.grids.iter().map(GridValues::bytes).sum();
        bonds + size_of_val(&self.nodes[..]) + grids
    }

    /// The vector instructions of the loops.
    pub fn instructions(&self) -> Instructions {
        self.instructions
    }

    /// The halo plan.
    pub fn halo(&self) -> &Halo {
        &self.halo
    }

    /// Breaks the bonds for which `crosses` (of the two local indices) holds.
    pub fn cut(&mut self, crosses: impl Fn(usize, usize) -> bool) {
        for interaction in &mut self.interactions {
            interaction.bonds.cut(&crosses);
        }
    }

    /// Calls `found` with the local indices of both ends of every intact bond of the owned points.
    pub fn for_each_intact(&self, mut found: impl FnMut(usize, usize)) {
        for interaction in &self.interactions {
            interaction.bonds.for_each_intact(&mut found);
        }
    }

    /// How many bytes of a checkpoint the bonds of each owned point take.
    pub fn saved_lengths(&self, owned: usize) -> Vec<u32> {
        let mut lengths = vec![0; owned];
        for interaction in &self.interactions {
            let add = |point: usize, length: usize| lengths[point] += length as u32;
            interaction.bonds.row_lengths(add);
        }
        lengths
    }

    /// What is kept of the bonds of all owned points, one after the other.
    pub fn saved(&self, lengths: &[u32]) -> Vec<u8> {
        let (mut next, total) = starts(lengths);
        let mut bytes = vec![0; total];
        for interaction in &self.interactions {
            interaction.bonds.save(&mut next, &mut bytes);
        }
        bytes
    }

    /// Puts back what [`Self::saved`] gave.
    pub fn restore(&mut self, lengths: &[u32], bytes: &[u8]) {
        let (mut next, _) = starts(lengths);
        for interaction in &mut self.interactions {
            interaction.bonds.restore(&mut next, bytes);
        }
    }

    /// Takes note of the bonds, for [`Self::undo`].
    pub fn keep(&self, kept: &mut KeptBonds) {
        kept.0
            .resize_with(self.interactions.len(), Default::default);
        for (interaction, kept) in self.interactions.iter().zip(&mut kept.0) {
            interaction.bonds.store().keep(kept);
        }
    }

    /// Puts back the bonds that [`Self::keep`] took note of.
    pub fn undo(&mut self, kept: &KeptBonds) {
        for (interaction, kept) in self.interactions.iter_mut().zip(&kept.0) {
            interaction.bonds.store_mut().undo(kept);
        }
    }

    /// Brings the ghosts' displacements up to date.
    pub fn update_ghosts(&mut self, comm: &dyn Communicator, displacement: &mut [Vec<f64>; D]) {
        self.halo.pack(displacement.iter().map(Vec::as_slice));
        self.halo.exchange(comm, &mut |_| {});
        self.halo
            .unpack(displacement.iter_mut().map(Vec::as_mut_slice));
    }

    /// Makes the bonds unbreakable that have an end whose entry is 1; the ghosts' entries are
    /// brought from their owners.
    pub fn protect(&mut self, comm: &dyn Communicator, protected: &mut [f64]) {
        self.halo.pack([&*protected].into_iter());
        self.halo.exchange(comm, &mut |_| {});
        self.halo.unpack([&mut *protected].into_iter());
        for interaction in &mut self.interactions {
            interaction.bonds.protect(|point| protected[point] == 1.0);
        }
    }

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
                    let kernel = force::Force { laws, criterion, evolution };
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

    /// Columns of sums of a kernel over all bonds of the owned points.
    fn measure(
        &mut self,
        owned: usize,
        columns: usize,
        mut sweep: impl FnMut(&mut Interaction, &mut [Vec<f64>], Source<'_, D>),
    ) -> Vec<Vec<f64>> {
        let mut sums = vec![vec![0.0; owned]; columns];
        self.for_each_interaction(|interaction, source| sweep(interaction, &mut sums, source));
        sums
    }

    /// What the bonds of each owned point hold, at the displacements of the last
    /// [evaluation](Self::evaluate).
    pub fn stored(&mut self, model: &Model<D>) -> Stored {
        let columns = self.measure(model.owned(), 4, |interaction, sums, source| {
            with_pair!(interaction.laws, laws => {
                let kernel = measures::Stored { law: laws[0] };
                sweep_all(&mut interaction.bonds, sums, &kernel, source);
            });
        });
        let [mut energy, volume, neighbours, dissipated] =
            columns.try_into().expect("four columns");
        let numbers = &self.numbers.columns;
        if self.numbers.stages > 0 {
            for (point, energy) in energy.iter_mut().enumerate() {
                let law = self.blocks[usize::from(model.block[point])].law;
                let get = |k: usize| numbers.get(k).and_then(|column| column.get(point));
                let own: [f64; point_numbers::NUMBERS] =
                    std::array::from_fn(|k| get(k).copied().unwrap_or(0.0));
                *energy += Law::<D>::point_energy(&law, &own);
            }
        }
        Stored {
            energy,
            volume,
            neighbours,
            dissipated: if self.remembers {
                dissipated
            } else {
                Vec::new()
            },
        }
    }

    /// Volume of the intact neighbours of each owned point, m³.
    pub fn family_volume(&mut self, model: &Model<D>) -> Vec<f64> {
        let mut columns = self.measure(model.owned(), 1, |interaction, sums, source| {
            sweep_all(
                &mut interaction.bonds,
                sums,
                &measures::FamilyVolume,
                source,
            );
        });
        columns.remove(0)
    }

    /// D = Σ V C n⊗n of each owned point (N/m⁴): columns xx, yy, zz, xy, yz, xz.
    pub fn stiffness(&mut self, model: &Model<D>) -> [Vec<f64>; 6] {
        let columns = self.measure(model.owned(), 6, |interaction, sums, source| {
            with_pair!(interaction.laws, laws => {
                let kernel = measures::Stiffness { laws };
                sweep_all(&mut interaction.bonds, sums, &kernel, source);
            });
        });
        columns.try_into().expect("six columns")
    }

    /// Stress of each owned point (Pa): columns xx, yy, zz, xy, yz, xz; at the displacements of the
    /// last [evaluation](Self::evaluate).
    pub fn stress(&mut self, model: &Model<D>) -> [Vec<f64>; 6] {
        let columns = self.measure(model.owned(), 6, |interaction, sums, source| {
            with_pair!(interaction.laws, laws => {
                let kernel = measures::Stress { law: laws[0] };
                sweep_all(&mut interaction.bonds, sums, &kernel, source);
            });
        });
        columns.try_into().expect("six columns")
    }

    /// Weighted volume m (m⁵) and dilatation θ of each owned point, at the displacements of the last
    /// [evaluation](Self::evaluate).
    pub fn dilatation(&mut self, model: &Model<D>) -> [Vec<f64>; 2] {
        let columns = self.measure(model.owned(), 2, |interaction, sums, source| {
            fn is_linear<L: Law<D>, const D: usize>(_: &[L; 2]) -> bool {
                L::LINEAR
            }
            let bonds = &mut interaction.bonds;
            if with_pair!(&interaction.laws, laws => is_linear::<_, D>(laws)) {
                sweep_all(bonds, sums, &measures::Dilatation::<true>, source);
            } else {
                sweep_all(bonds, sums, &measures::Dilatation::<false>, source);
            }
        });
        let [weighted_volume, mut growth] = columns.try_into().expect("two columns");
        for (growth, volume) in growth.iter_mut().zip(&weighted_volume) {
            *growth = if *volume > 0.0 {
                D as f64 * *growth / volume
            } else {
                0.0
            };
        }
        [weighted_volume, growth]
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

/// Runs a kernel over all bonds between two blocks.
fn sweep_all<K: Kernel<D>, const D: usize>(
    bonds: &mut BlockBonds,
    sums: &mut [Vec<f64>],
    kernel: &K,
    source: Source<'_, D>,
) {
    let owned = sums.first().map_or(0, Vec::len);
    let results = <(K::Sums, K::Rare)>::columns_mut(sums);
    sweep(bonds, 0..owned, results, kernel, source);
}

/// Where each point's bytes start, and how many there are in all.
fn starts(lengths: &[u32]) -> (Vec<usize>, usize) {
    let mut end = 0;
    let starts = lengths
        .iter()
        .map(|length| {
            end += *length as usize;
            end - *length as usize
        })
        .collect();
    (starts, end)
}
