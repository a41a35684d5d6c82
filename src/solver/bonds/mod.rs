//! Internal forces: sums over bonds in passes, with halo exchanges between them.
//!
//! A force evaluation runs a list of passes, which is created once from the laws in use. Each pass is a sum
//! over the bonds of every point. For a bond ij, later passes read the results of an earlier pass either of
//! point i only, or of both points. A pass begins with a halo exchange if it reads values that other ranks
//! have changed. The first exchange sends displacements and thermal stretches. Later exchanges send
//! thresholds and point numbers. Point numbers are values, such as the dilatation, that a law computes for a
//! point from sums over the bonds of this point. Interior points are processed while messages are in flight.
//!
//! Bonds that meet their criterion break in the pass that sums the forces. Point numbers and forces that
//! depend on broken bonds are then recomputed, see `broken.rs`.

mod bond_inputs;
mod breaking;
mod broken;
mod broken_moments;
mod evaluate;
mod force;
mod grid_points;
mod interaction;
mod kernel;
mod limit_columns;
mod list_points;
mod measure;
mod measures;
mod point_numbers;
mod point_stresses;
mod point_sums;
mod saved;
mod sweep;

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use crate::comm::{Communicator, Halo};
use crate::error::Result;
use crate::families::{BlockBonds, Fault, Grid, Which};
use crate::lanes::{Instructions, LaneTuple};
use crate::material::{Law, MOST, PlasticState};
use crate::memory::check_room;

use super::model::Model;
use grid_points::GridValues;
use kernel::Kernel;
use limit_columns::{LimitColumns, LimitsRead};
use list_points::Node;
use point_numbers::PointNumbers;
use point_sums::FamilySum;
use sweep::{PointData, sweep_from};

pub use bond_inputs::BondInputs;
pub use broken::Broken;
pub use broken_moments::Moments;
pub use evaluate::{Acting, ForceTimes};
pub use force::BondUpdate;
pub use interaction::{BlockLaws, Interaction, PairReads};
pub use measure::BondSums;
pub use point_numbers::PlasticColumns;
pub use saved::KeptBonds;

/// Number of points for which sums over undeformed families are computed at once, to limit memory. The number
/// is rounded up to whole lane groups.
const FAMILY_SUMS: usize = 1 << 16;

/// A sum over the bonds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Pass {
    /// Smallest stretch of the intact bonds of each point; the threshold of the point follows from this
    /// stretch.
    SmallestStretch,
    /// The sums of one pass of the laws, see [`Law::PASSES`]. The number is the index of this pass. Laws
    /// compute point numbers from these sums. Laws without this pass are skipped.
    PointSum(usize),
    /// The forces.
    Force,
}

/// Number of history values that the laws of an interaction store per bond, for both ends together.
fn history_width<const D: usize>(interaction: &Interaction) -> usize {
    let [i, j] = interaction.laws.laws();
    2 * i
        .counts::<D>()
        .bond_history
        .max(j.counts::<D>().bond_history)
}

/// Check that the bond history fits in memory.
///
/// # Errors
/// If the bond history does not fit. The error names the pair of blocks with the largest bond history.
pub fn history_fits<const D: usize>(
    interactions: &[Interaction],
) -> std::result::Result<(), Fault> {
    let bytes = |interaction: &Interaction| {
        let width = history_width::<D>(interaction);
        interaction.bonds.store().history_bytes(width)
    };
    check_room(interactions.iter().map(bytes).sum()).map_err(|shortage| {
        let largest = interactions.iter().max_by_key(|it| bytes(it));
        let blocks = largest.map_or([0; 2], |it| it.bonds.blocks());
        Fault::TooLittleMemory { blocks, shortage }
    })
}

/// Strength f of each owned point, a random factor on the threshold of the point; empty without scatter.
fn strengths<const D: usize>(blocks: &[BlockLaws], model: &Model<D>) -> Vec<f64> {
    if blocks.iter().all(|block| block.weibull.is_none()) {
        return Vec::new();
    }
    let strength = |point: usize| {
        let weibull = blocks[usize::from(model.block[point])].weibull;
        weibull.map_or(1.0, |weibull| weibull.strength(model.ids[point]))
    };
    (0..model.owned()).into_par_iter().map(strength).collect()
}

/// Threshold of an owned point; ∞ for a block without a damage law. See
/// [`DamageLaw::threshold`](crate::damage::DamageLaw::threshold). `smallest` is the smallest stretch of the
/// intact bonds of the point. `strengths` contains the strength f of each point.
fn threshold<const D: usize>(
    blocks: &[BlockLaws],
    model: &Model<D>,
    strengths: &[f64],
    point: usize,
    smallest: f64,
) -> f64 {
    let damage = blocks[usize::from(model.block[point])].damage;
    let strength = strengths.get(point).copied().unwrap_or(1.0);
    damage.map_or(f64::INFINITY, |law| law.threshold(strength, smallest))
}

/// The bonds of a rank and the data for sums over them.
pub struct Forces<const D: usize> {
    interactions: Vec<Interaction>,
    blocks: Vec<BlockLaws>,
    /// Point data that list families read; empty if there is no list.
    nodes: Vec<Node>,
    /// Point data that lattice families read, by grid.
    grids: Vec<GridValues<D>>,
    numbers: PointNumbers,
    /// Point data that failure criteria read.
    limits: LimitColumns,
    /// Strength f of each owned point, a random factor on the threshold of the point; empty without scatter.
    strength: Vec<f64>,
    /// The passes of a force evaluation.
    passes: Vec<Pass>,
    halo: Halo,
    instructions: Instructions,
    /// Whether any law has a bond history; the same on all ranks.
    has_history: bool,
    /// Whether any bonds can break; the same on all ranks.
    breaks: bool,
    /// Whether points have thermal stretches; the same on all ranks.
    is_thermal: bool,
    /// Changes that broken bonds caused at points in the last evaluation, in ascending order of the points.
    broken: Vec<Broken<D>>,
}

impl<const D: usize> Forces<D> {
    /// Create the forces from the bonds, the halo plan and the blocks' laws. `is_thermal` says whether points
    /// have thermal stretches. [`Self::find_constants`] must be called afterwards. Collective.
    ///
    /// # Errors
    /// If no instruction set has the [requested name](Instructions::of_all), or if the processor of a rank
    /// supports none of the sets. The error is the same on all ranks.
    pub fn new(
        comm: &dyn Communicator,
        model: &Model<D>,
        mut interactions: Vec<Interaction>,
        grids: Vec<Arc<Grid>>,
        halo: Halo,
        blocks: Vec<BlockLaws>,
        is_thermal: bool,
    ) -> Result<Self> {
        let instructions = Instructions::of_all(comm)?;
        let numbers = PointNumbers::new(&blocks, model);
        let read = LimitsRead::by::<D>(&blocks);
        let limits = LimitColumns::new::<D>(read, numbers.read, model.volume.len());
        let breaks = blocks.iter().any(BlockLaws::has_breakable_bonds);
        let has_history = (blocks.iter()).any(|block| block.law.counts::<D>().bond_history > 0);
        for interaction in &mut interactions {
            let width = history_width::<D>(interaction);
            interaction.bonds.allocate_history(width);
        }
        let follows = blocks.iter().any(BlockLaws::follows_smallest_stretch);
        let passes = [follows.then_some(Pass::SmallestStretch), Some(Pass::Force)];
        let mut passes: Vec<Pass> = passes.into_iter().flatten().collect();
        let force = passes.len() - 1;
        passes.splice(force..force, (0..numbers.passes).map(Pass::PointSum));
        let lists = |i: &Interaction| matches!(i.bonds, BlockBonds::List(_));
        Ok(Self {
            nodes: if interactions.iter().any(lists) {
                list_points::nodes(model)
            } else {
                Vec::new()
            },
            grids: grids
                .into_iter()
                .map(|grid| GridValues::new(grid, numbers.read, read, is_thermal))
                .collect(),
            limits,
            strength: strengths(&blocks, model),
            interactions,
            blocks,
            numbers,
            passes,
            halo,
            instructions,
            has_history,
            breaks,
            is_thermal,
            broken: Vec::new(),
        })
    }

    /// Compute the constants of the points ([`Law::CONSTANTS`]) from sums over their initial families. Also
    /// set the [truncation factors](Law::truncation_factor) and the thresholds that criteria read. If any
    /// threshold depends on the smallest stretch, force evaluations set all thresholds instead. Call after
    /// pre-cracks are cut and before other bonds break. Collective.
    pub fn find_constants(&mut self, comm: &dyn Communicator, model: &Model<D>) {
        let read = LimitsRead::by::<D>(&self.blocks);
        if read.thresholds && !self.passes.contains(&Pass::SmallestStretch) {
            self.set_thresholds(comm, model);
        }
        if !self.numbers.with_constants && !read.truncation_factors {
            return;
        }
        let mut points = 0..0;
        while points.end < model.owned() {
            let end = points.end + FAMILY_SUMS;
            let end = if end < model.owned() {
                self.border(end)
            } else {
                model.owned()
            };
            points = points.end..end;
            self.find_constants_of(points.clone(), model);
        }
        let Self {
            numbers,
            limits,
            halo,
            ..
        } = self;
        let columns = numbers.columns[..numbers.read].iter_mut();
        let truncation_factors = read
            .truncation_factors
            .then_some(&mut limits.truncation_factors);
        let columns = columns
            .chain(truncation_factors)
            .map(|column| &mut column[..]);
        halo.update_ghosts(comm, &mut columns.collect::<Vec<_>>());
        for grid in &mut self.grids {
            grid.update_numbers(Which::All, 0, &self.numbers.columns);
            if read.truncation_factors {
                grid.update_truncation_factors(&self.limits.truncation_factors);
            }
        }
    }

    /// Compute the constants of a range of points that consists of whole lane groups.
    fn find_constants_of(&mut self, points: Range<usize>, model: &Model<D>) {
        let mut sums = vec![vec![0.0; points.len()]; MOST.reference_sum];
        self.for_each_interaction(|interaction, source| {
            let [law, _] = interaction.laws.laws();
            let count = law.counts::<D>().reference_sum;
            if count > 0 {
                let kernel = FamilySum::<D> { law, count };
                let results = <FamilySum<D> as Kernel<D>>::Sums::columns_mut(&mut sums);
                let (bonds, base) = (&mut interaction.bonds, points.start);
                sweep_from(bonds, points.clone(), base, results, &kernel, source);
            }
        });
        let truncation_factors = &mut self.limits.truncation_factors;
        (self.numbers).set_constants(points, model, &self.blocks, &sums, truncation_factors);
    }

    /// Set the thresholds of the points. Called only if no threshold depends on the smallest stretch of a
    /// family (α = 0 in all damage laws). Collective.
    fn set_thresholds(&mut self, comm: &dyn Communicator, model: &Model<D>) {
        let Self {
            limits,
            strength,
            blocks,
            halo,
            grids,
            ..
        } = self;
        for point in 0..model.owned() {
            limits.thresholds[point] = threshold(blocks, model, strength, point, 0.0);
        }
        halo.update_ghosts(comm, &mut [&mut limits.thresholds[..]]);
        for grid in grids {
            grid.update_thresholds(Which::All, &limits.thresholds);
        }
    }

    /// Call `work` for each pair of blocks with bonds, one after the other.
    fn for_each_interaction(&mut self, mut work: impl FnMut(&mut Interaction, PointData<'_, D>)) {
        let source = PointData {
            nodes: &self.nodes,
            // The remaining columns exist only for owned points.
            numbers: &self.numbers.columns[..self.numbers.read],
            limits: &self.limits,
            grids: &self.grids,
            is_thermal: self.is_thermal,
            instructions: self.instructions,
        };
        for interaction in &mut self.interactions {
            work(interaction, source);
        }
    }

    /// Number of bonds of the owned points, including broken ones. A bond between two owned points counts
    /// twice.
    pub fn directed_bonds(&self) -> u64 {
        self.interactions.iter().map(|i| i.bonds.bonds()).sum()
    }

    /// Number of the [`Self::directed_bonds`] that are in lattice families.
    pub fn lattice_bonds(&self) -> u64 {
        let all = self.interactions.iter().map(|i| &i.bonds);
        all.filter(|bonds| matches!(bonds, BlockBonds::Lattice(_)))
            .map(BlockBonds::bonds)
            .sum()
    }

    /// For each pair of blocks with bonds, the number of bonds of the owned points, including broken ones. A
    /// bond between two owned points of one block counts twice.
    pub fn bonds_of_blocks(&self) -> impl Iterator<Item = ([usize; 2], u64)> {
        let all = self.interactions.iter().map(|i| &i.bonds);
        all.map(|bonds| (bonds.blocks(), bonds.bonds()))
    }

    /// Memory of the bonds, of the nodes of list families, and of the grids, bytes.
    pub fn bytes(&self) -> usize {
        let bonds: usize = self.interactions.iter().map(|i| i.bonds.bytes()).sum();
        let grids: usize = self.grids.iter().map(GridValues::bytes).sum();
        bonds + size_of_val(&self.nodes[..]) + grids
    }

    /// Free the memory of the bonds, of the nodes of list families, and of the grids. No evaluation is
    /// possible afterwards.
    pub fn release(&mut self) {
        self.interactions = Vec::new();
        self.nodes = Vec::new();
        self.grids = Vec::new();
    }

    /// The lane group of a point: the range of owned points whose bonds are computed together.
    fn lane_group(&self, point: usize) -> Range<usize> {
        let bonds = self.interactions.iter().map(|it| &it.bonds);
        let together = bonds.map(|bonds| bonds.lane_group(point));
        together.fold(point..point + 1, |all, one| {
            all.start.min(one.start)..all.end.max(one.end)
        })
    }

    /// Whether any law has a plastic state per point; the same on all ranks.
    pub fn has_plasticity(&self) -> bool {
        self.blocks
            .iter()
            .any(|block| Law::<D>::has_plasticity(&block.law))
    }

    /// Correct the plastic states of owned points, some of which are means of the states of other points.
    pub fn correct_means(&self, model: &Model<D>, mut plastic: PlasticColumns<'_>) {
        for (point, block) in model.block.iter().enumerate() {
            let law = &self.blocks[usize::from(*block)].law;
            let mut state = PlasticState::of(plastic.each_ref().map(|column| column[point]));
            Law::<D>::correct_mean(law, &mut state);
            for (column, number) in plastic.iter_mut().zip(state.numbers()) {
                column[point] = number;
            }
        }
    }

    /// Instruction set of the loops.
    pub fn instructions(&self) -> Instructions {
        self.instructions
    }

    /// Plan of the halo exchanges of a force evaluation.
    pub fn halo(&self) -> &Halo {
        &self.halo
    }

    /// Break the bonds ij for which `concerned(i)` and `crosses(i, j)` are true; i and j are local indices.
    pub fn cut(
        &mut self,
        concerned: impl Fn(usize) -> bool,
        crosses: impl Fn(usize, usize) -> bool,
    ) {
        for interaction in &mut self.interactions {
            interaction.bonds.cut(&concerned, &crosses);
        }
    }

    /// Call `found(i, j)` with the local indices of every intact bond, for each owned point i. A bond between
    /// two owned points is visited twice, as (i, j) and (j, i).
    pub fn for_each_intact(&self, mut found: impl FnMut(usize, usize)) {
        for interaction in &self.interactions {
            interaction.bonds.for_each_intact(&mut found);
        }
    }

    /// For each intact bond of an owned point, call `found(j)` with the local index of the neighbour j.
    pub fn for_each_neighbour(&self, point: usize, mut found: impl FnMut(usize)) {
        for interaction in &self.interactions {
            interaction.bonds.for_each_neighbour(point, &mut found);
        }
    }

    /// Whether any law has a bond history; the same on all ranks.
    pub fn has_history(&self) -> bool {
        self.has_history
    }

    /// Call `found(i, j)` with the local indices of every broken bond, for each owned point i. A bond between
    /// two owned points is visited twice, as (i, j) and (j, i).
    pub fn for_each_broken(&self, mut found: impl FnMut(usize, usize)) {
        for interaction in &self.interactions {
            interaction.bonds.for_each_broken(&mut found);
        }
    }

    /// Exchange the ghost values of columns. Each column has one value per local point. Collective.
    pub fn update_ghosts(&mut self, comm: &dyn Communicator, columns: &mut [&mut [f64]]) {
        self.halo.update_ghosts(comm, columns);
    }

    /// Make a bond unbreakable if `between` is true for its two blocks and `protected` is 1 at one of its
    /// ends. `protected` has 1 or 0 for each local point; its ghost entries are exchanged first. `block` has
    /// the block of each owned point. Collective.
    pub fn protect(
        &mut self,
        comm: &dyn Communicator,
        block: &[u16],
        protected: &mut [f64],
        between: impl Fn([usize; 2]) -> bool,
    ) {
        self.update_ghosts(comm, &mut [&mut *protected]);
        let mut in_block = vec![0.0_f64; self.blocks.len()];
        for (block, protected) in block.iter().zip(&*protected) {
            let most = &mut in_block[usize::from(*block)];
            *most = most.max(*protected);
        }
        comm.max(&mut in_block);
        for interaction in &mut self.interactions {
            let blocks = interaction.bonds.blocks();
            if between(blocks) && blocks.into_iter().any(|block| in_block[block] == 1.0) {
                let is_protected = |point: usize| protected[point] == 1.0;
                interaction.bonds.protect(is_protected);
            }
        }
    }
}
