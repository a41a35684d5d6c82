//! The passes over the bonds that a force evaluation is made of.
//!
//! A pass finds one number for each owned point, which the next one reads at both ends of bonds; the
//! last finds the forces. Which passes there are depends on the laws: a damage law with α needs the
//! thresholds, a state-based law the states. Bonds break in the pass that finds the states, else in
//! the last one, so that states and forces know the same bonds.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use crate::families::{Family, Grid, Which};
use crate::material::Law;

use super::cloud::{self, Cloud, Node};
use super::failure::{PerPoint, Uniform};
use super::instructions::Instructions;
use super::kernels::{Force, Kernel, Response, SmallestStretch, State, StateSums};
use super::laws::{BlockLaws, Bonds, FamilyFailure, FamilyLaw, with_laws};
use super::model::Model;
use super::places::Places;
use super::sweep::{Source, sweep};

/// Points handled by one task.
const CHUNK: usize = 4096;

/// One pass over the bonds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pass {
    /// Finds the stretch at which each point's bonds break.
    Thresholds,
    /// Breaks bonds and finds the state of each point.
    States,
    /// Breaks bonds, unless the states have, and sums their forces.
    Forces,
}

/// The bonds of a rank and what they know of their points.
pub struct Passes<const D: usize> {
    /// The bonds.
    pub bonds: Vec<Bonds>,
    /// The points as lists of bonds read them; empty if there is no list.
    nodes: Vec<Node>,
    /// The points as lattices read them, by grid.
    places: Vec<Places<D>>,
    /// The vector instructions of the loops.
    pub instructions: Instructions,
    /// The laws of each block.
    pub blocks: Vec<BlockLaws>,
    /// Constant of each local point; empty if no law reads it.
    pub constants: Vec<f64>,
    /// State of each local point; empty if no law reads it.
    pub states: Vec<f64>,
    /// Threshold of each local point; empty if no damage law needs it.
    pub thresholds: Vec<f64>,
    sums: Vec<StateSums>,
    /// The passes of a force evaluation, in order.
    pub order: Vec<Pass>,
}

impl<const D: usize> Passes<D> {
    /// For the points of a rank, at rest.
    pub fn new(
        bonds: Vec<Bonds>,
        grids: Vec<Arc<Grid>>,
        blocks: Vec<BlockLaws>,
        model: &Model<D>,
        instructions: Instructions,
    ) -> Self {
        let (owned, local) = (model.owned(), model.volume.len());
        let with_constants = blocks.iter().any(|block| block.law.has_constant());
        let with_states = blocks.iter().any(|block| block.law.has_state());
        let with_thresholds =
            (blocks.iter()).any(|block| block.damage.is_some_and(|law| law.alpha > 0.0));
        // `AnyLaw` reads constants and states whether its laws have any or not.
        let any = bonds
            .iter()
            .any(|bonds| matches!(bonds.law, FamilyLaw::Any(_)));
        let order = [
            with_thresholds.then_some(Pass::Thresholds),
            with_states.then_some(Pass::States),
            Some(Pass::Forces),
        ];
        let lists = bonds
            .iter()
            .any(|bonds| matches!(bonds.family, Family::List(_)));
        let zeros = |needed: bool, count: usize| vec![0.0; if needed { count } else { 0 }];
        let mut passes = Self {
            bonds,
            nodes: if lists {
                cloud::nodes(model)
            } else {
                Vec::new()
            },
            places: grids.into_iter().map(Places::new).collect(),
            instructions,
            blocks,
            constants: zeros(with_constants || any, local),
            states: zeros(with_states || any, local),
            thresholds: zeros(with_thresholds, local),
            sums: vec![StateSums::default(); if with_states { owned } else { 0 }],
            order: order.into_iter().flatten().collect(),
        };
        for places in &mut passes.places {
            if !passes.states.is_empty() {
                places.bring_states(Which::All, &passes.states);
            }
            if !passes.thresholds.is_empty() {
                places.bring_thresholds(Which::All, &passes.thresholds);
            }
        }
        passes
    }

    /// Shows the constants to the families, now that they are known.
    pub fn bring_constants(&mut self) {
        for places in &mut self.places {
            places.bring_constants(&self.constants);
        }
    }

    /// Shows the families what a pass has found of some of the points; before the first pass, their
    /// displacements.
    pub fn bring(
        &mut self,
        before: Option<Pass>,
        which: Which,
        model: &Model<D>,
        displacement: &[Vec<f64>; D],
    ) {
        for places in &mut self.places {
            match before {
                None => places.bring_displacement(which, displacement),
                Some(Pass::Thresholds) => places.bring_thresholds(which, &self.thresholds),
                Some(Pass::States) => places.bring_states(which, &self.states),
                Some(Pass::Forces) => {}
            }
        }
        if before.is_none() && !self.nodes.is_empty() {
            let (owned, local) = (model.owned(), model.volume.len());
            let points = match which {
                Which::Owned => 0..owned,
                Which::Ghosts => owned..local,
                Which::All => 0..local,
            };
            cloud::bring(&mut self.nodes, points, displacement);
        }
    }

    /// Memory of what the families read of the points, bytes.
    pub fn bytes(&self) -> usize {
        let places: usize = self.places.iter().map(Places::bytes).sum();
        size_of_val(&self.nodes[..]) + places
    }

    /// What a pass finds and the next one reads; `None` for the last one.
    pub fn found(&mut self, pass: Pass) -> Option<&mut [f64]> {
        match pass {
            Pass::Thresholds => Some(&mut self.thresholds),
            Pass::States => Some(&mut self.states),
            Pass::Forces => None,
        }
    }

    /// Gets ready for a pass over the owned points.
    pub fn start(&mut self, pass: Pass, owned: usize) {
        match pass {
            Pass::Thresholds => self.thresholds[..owned].fill(f64::INFINITY),
            Pass::States => self.sums.fill(StateSums::default()),
            Pass::Forces => {}
        }
    }

    /// Makes a pass over a range of the owned points.
    pub fn run(&mut self, pass: Pass, points: Range<usize>, responses: &mut [Response<D>]) {
        let broken_already = !self.sums.is_empty();
        let owned = responses.len();
        // Taken out while they are written: no kernel reads what its own pass finds.
        let mut sums = std::mem::take(&mut self.sums);
        let mut thresholds = match pass {
            Pass::Thresholds => std::mem::take(&mut self.thresholds),
            _ => Vec::new(),
        };
        let (all, source) = self.split();
        for bonds in all {
            let (family, failure, points) = (&mut bonds.family, bonds.failure, points.clone());
            match pass {
                Pass::Thresholds => {
                    let found = &mut thresholds[..owned];
                    sweep(family, points, found, &SmallestStretch, source);
                }
                Pass::States => match bonds.law {
                    FamilyLaw::Ordinary(laws) => {
                        sum_states(family, points, laws, failure, &mut sums, source);
                    }
                    FamilyLaw::Any(laws) => {
                        sum_states(family, points, laws, failure, &mut sums, source);
                    }
                    _ => unreachable!("where there are states, other laws are taken as any law"),
                },
                Pass::Forces => with_laws!(bonds.law, laws => {
                    let failure = match broken_already {
                        true => FamilyFailure::Never,
                        false => failure,
                    };
                    sum_forces(family, points, laws, failure, responses, source);
                }),
            }
        }
        self.sums = sums;
        if pass == Pass::Thresholds {
            self.thresholds = thresholds;
        }
    }

    /// The bonds, and what kernels read of the points.
    fn split(&mut self) -> (&mut [Bonds], Source<'_, D>) {
        let source = Source {
            cloud: Cloud {
                nodes: &self.nodes,
                constants: &self.constants,
                states: &self.states,
                thresholds: &self.thresholds,
            },
            places: &self.places,
            instructions: self.instructions,
        };
        (&mut self.bonds, source)
    }

    /// Runs a kernel, made for the law of each family, over all bonds of `owned` points.
    pub fn sum<T: Default + Clone + Send>(
        &mut self,
        owned: usize,
        sweep: impl Fn(&mut Bonds, &mut [T], Source<'_, D>),
    ) -> Vec<T> {
        let mut sums = vec![T::default(); owned];
        let (all, source) = self.split();
        for bonds in all {
            sweep(bonds, &mut sums, source);
        }
        sums
    }

    /// Ends a pass over the owned points.
    pub fn finish(&mut self, pass: Pass, model: &Model<D>, responses: &mut [Response<D>]) {
        let blocks = &self.blocks;
        match pass {
            Pass::Thresholds => {
                let owned = &mut self.thresholds[..responses.len()];
                let each = owned.par_iter_mut().with_min_len(CHUNK);
                each.zip(&model.block).for_each(|(value, block)| {
                    *value = match blocks[usize::from(*block)].damage {
                        // A point without intact bonds has no smallest stretch.
                        Some(law) if value.is_infinite() => law.critical,
                        Some(law) => law.threshold(*value),
                        None => f64::INFINITY,
                    };
                });
            }
            Pass::States => {
                let owned = responses.len();
                let constants = &self.constants[..owned];
                let sums = self.sums.par_chunks(CHUNK);
                let points = responses.par_chunks_mut(CHUNK).zip(sums);
                let points = points.zip(self.states[..owned].par_chunks_mut(CHUNK));
                points
                    .enumerate()
                    .for_each(|(chunk, ((responses, sums), states))| {
                        for k in 0..sums.len() {
                            let point = chunk * CHUNK + k;
                            let law = blocks[usize::from(model.block[point])].law;
                            let (sums, constant) = (sums[k], constants[point]);
                            let energy = |sum: f64| law.point_energy(sum, constant);
                            states[k] = law.state(sums.after, constant);
                            responses[k].set_free += sums.set_free
                                + model.volume[point] * (energy(sums.before) - energy(sums.after));
                        }
                    });
            }
            Pass::Forces => {}
        }
    }
}

fn sum_states<L: Law, const D: usize>(
    family: &mut Family,
    points: Range<usize>,
    laws: [L; 2],
    failure: FamilyFailure,
    sums: &mut [StateSums],
    source: Source<'_, D>,
) {
    match failure {
        FamilyFailure::Never => {
            let failure = Uniform(f64::INFINITY);
            sweep(family, points, sums, &State { laws, failure }, source);
        }
        FamilyFailure::Uniform(critical) => {
            let failure = Uniform(critical);
            sweep(family, points, sums, &State { laws, failure }, source);
        }
        FamilyFailure::PerPoint(critical) => {
            let failure = PerPoint { critical };
            sweep(family, points, sums, &State { laws, failure }, source);
        }
    }
}

fn sum_forces<L: Law, const D: usize>(
    family: &mut Family,
    points: Range<usize>,
    laws: [L; 2],
    failure: FamilyFailure,
    responses: &mut [Response<D>],
    source: Source<'_, D>,
) {
    match failure {
        FamilyFailure::Never => {
            let failure = None::<Uniform>;
            sweep(family, points, responses, &Force { laws, failure }, source);
        }
        FamilyFailure::Uniform(critical) => {
            let failure = Some(Uniform(critical));
            sweep(family, points, responses, &Force { laws, failure }, source);
        }
        FamilyFailure::PerPoint(critical) => {
            let failure = Some(PerPoint { critical });
            sweep(family, points, responses, &Force { laws, failure }, source);
        }
    }
}

/// Runs a kernel over all bonds of one family.
pub fn sweep_all<K: Kernel<D>, const D: usize>(
    family: &mut Family,
    outputs: &mut [K::Output],
    kernel: &K,
    source: Source<'_, D>,
) {
    let points = 0..outputs.len();
    sweep(family, points, outputs, kernel, source);
}
