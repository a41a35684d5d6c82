//! The passes over the bonds that a force evaluation is made of.
//!
//! A pass finds one number for each owned point, which the next one reads at both ends of bonds; the
//! last finds the forces. Which passes there are depends on the laws: a damage law with α needs the
//! thresholds, a state-based law the states. Bonds break in the pass that finds the states, else in
//! the last one, so that states and forces know the same bonds.

use std::ops::Range;

use rayon::prelude::*;

use crate::families::BondList;
use crate::material::Law;

use super::failure::{PerPoint, Uniform};
use super::geometry::{Geometry, Shared};
use super::kernels::{Bonded, Force, Kernel, Response, SmallestStretch, State, StateSums};
use super::laws::{BlockLaws, Bonds, ListFailure, ListLaw, with_laws};
use super::model::Model;
use super::sweep::sweep;

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
pub struct Passes {
    /// The bonds.
    pub bonds: Vec<Bonds>,
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

/// The rows of a list whose points have local indices in a range.
fn rows_of(list: &BondList, points: &Range<usize>) -> Range<usize> {
    list.rows_below(points.start)..list.rows_below(points.end)
}

impl Passes {
    /// For `owned` of `local` points.
    pub fn new(bonds: Vec<Bonds>, blocks: Vec<BlockLaws>, owned: usize, local: usize) -> Self {
        let with_constants = blocks.iter().any(|block| block.law.has_constant());
        let with_states = blocks.iter().any(|block| block.law.has_state());
        let with_thresholds =
            (blocks.iter()).any(|block| block.damage.is_some_and(|law| law.alpha > 0.0));
        // `AnyLaw` reads constants and states whether its laws have any or not.
        let any = bonds
            .iter()
            .any(|bonds| matches!(bonds.law, ListLaw::Any(_)));
        let order = [
            with_thresholds.then_some(Pass::Thresholds),
            with_states.then_some(Pass::States),
            Some(Pass::Forces),
        ];
        let zeros = |needed: bool, count: usize| vec![0.0; if needed { count } else { 0 }];
        Self {
            bonds,
            blocks,
            constants: zeros(with_constants || any, local),
            states: zeros(with_states || any, local),
            thresholds: zeros(with_thresholds, local),
            sums: vec![StateSums::default(); if with_states { owned } else { 0 }],
            order: order.into_iter().flatten().collect(),
        }
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
    pub fn run<const D: usize>(
        &mut self,
        pass: Pass,
        geometry: Geometry<'_, D>,
        points: Range<usize>,
        responses: &mut [Response<D>],
    ) {
        let broken_already = !self.sums.is_empty();
        let Self {
            bonds: all,
            constants,
            states,
            thresholds,
            sums,
            ..
        } = self;
        let shared = Shared { constants, states };
        let owned = responses.len();
        for bonds in all {
            let rows = rows_of(&bonds.list, &points);
            let (list, failure) = (&mut bonds.list, bonds.failure);
            match pass {
                Pass::Thresholds => {
                    let kernel = SmallestStretch { geometry };
                    sweep(list, rows, &mut thresholds[..owned], &kernel);
                }
                Pass::States => match bonds.law {
                    ListLaw::Ordinary(laws) => {
                        let bonded = bonded(geometry, shared, laws);
                        sum_states(list, rows, bonded, failure, thresholds, sums);
                    }
                    ListLaw::Any(laws) => {
                        let bonded = bonded(geometry, shared, laws);
                        sum_states(list, rows, bonded, failure, thresholds, sums);
                    }
                    _ => unreachable!("where there are states, other laws are taken as any law"),
                },
                Pass::Forces => with_laws!(bonds.law, laws => {
                    let bonded = bonded(geometry, shared, laws);
                    let failure = if broken_already { ListFailure::Never } else { failure };
                    sum_forces(list, rows, bonded, failure, thresholds, responses);
                }),
            }
        }
    }

    /// Ends a pass over the owned points.
    pub fn finish<const D: usize>(
        &mut self,
        pass: Pass,
        model: &Model<D>,
        responses: &mut [Response<D>],
    ) {
        let blocks = &self.blocks;
        match pass {
            Pass::Thresholds => {
                let owned = &mut self.thresholds[..responses.len()];
                for (value, block) in owned.iter_mut().zip(&model.block) {
                    *value = match blocks[usize::from(*block)].damage {
                        // A point without intact bonds has no smallest stretch.
                        Some(law) if value.is_infinite() => law.critical,
                        Some(law) => law.threshold(*value),
                        None => f64::INFINITY,
                    };
                }
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

fn bonded<'a, L, const D: usize>(
    geometry: Geometry<'a, D>,
    shared: Shared<'a>,
    laws: [L; 2],
) -> Bonded<'a, L, D> {
    Bonded {
        geometry,
        shared,
        laws,
    }
}

fn sum_states<L: Law, const D: usize>(
    list: &mut BondList,
    rows: Range<usize>,
    bonded: Bonded<'_, L, D>,
    failure: ListFailure,
    thresholds: &[f64],
    sums: &mut [StateSums],
) {
    match failure {
        ListFailure::Never => {
            let failure = Uniform(f64::INFINITY);
            sweep(list, rows, sums, &State { bonded, failure });
        }
        ListFailure::Uniform(critical) => {
            let failure = Uniform(critical);
            sweep(list, rows, sums, &State { bonded, failure });
        }
        ListFailure::PerPoint(critical) => {
            let failure = PerPoint {
                thresholds,
                critical,
            };
            sweep(list, rows, sums, &State { bonded, failure });
        }
    }
}

fn sum_forces<L: Law, const D: usize>(
    list: &mut BondList,
    rows: Range<usize>,
    bonded: Bonded<'_, L, D>,
    failure: ListFailure,
    thresholds: &[f64],
    responses: &mut [Response<D>],
) {
    match failure {
        ListFailure::Never => {
            let failure = None::<Uniform>;
            sweep(list, rows, responses, &Force { bonded, failure });
        }
        ListFailure::Uniform(critical) => {
            let failure = Some(Uniform(critical));
            sweep(list, rows, responses, &Force { bonded, failure });
        }
        ListFailure::PerPoint(critical) => {
            let failure = Some(PerPoint {
                thresholds,
                critical,
            });
            sweep(list, rows, responses, &Force { bonded, failure });
        }
    }
}

/// Runs a kernel over all bonds of one list.
pub fn sweep_all<K: Kernel>(list: &mut BondList, outputs: &mut [K::Output], kernel: &K) {
    let rows = 0..list.len();
    sweep(list, rows, outputs, kernel);
}
