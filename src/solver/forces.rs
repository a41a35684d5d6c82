//! Internal forces: exchange the displacements, break bonds, sum forces.
//!
//! Each pass over the bonds begins with a message that brings what it reads up to date at the ghosts:
//! first the displacements, then what the pass before has found. Interior points are worked on while
//! messages are in flight.

use std::sync::Arc;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use crate::comm::{Communicator, Halo};
use crate::error::Result;
use crate::families::{Family, Grid, Which};
use crate::material::Law;

use super::instructions::Instructions;
use super::kernels::{Energy, Response, Stored};
use super::laws::{BlockLaws, Bonds, FamilyLaw, with_laws};
use super::measures::{Constant, Dilatation, Expansion, FamilyVolume, Stiffness, Stress};
use super::model::Model;
use super::passes::{Pass, Passes, sweep_all};

/// The bonds of a rank and what it takes to sum over them.
pub struct Forces<const D: usize> {
    passes: Passes<D>,
    halo: Halo,
}

/// Points handled by one task.
const CHUNK: usize = 4096;

/// Where the time of a force evaluation went.
#[derive(Debug, Clone, Copy, Default)]
pub struct ForceTimes {
    /// Sums over bonds.
    pub bonds: Duration,
    /// Packing, waiting for and unpacking messages.
    pub halo: Duration,
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
        bonds: Vec<Bonds>,
        grids: Vec<Arc<Grid>>,
        halo: Halo,
        blocks: Vec<BlockLaws>,
    ) -> Result<Self> {
        let instructions = Instructions::of_all(comm)?;
        // The same on all ranks, whether they have points or not.
        let with_constants = blocks.iter().any(|block| block.law.has_constant());
        let passes = Passes::new(bonds, grids, blocks, model, instructions);
        let mut forces = Self { passes, halo };
        if with_constants {
            forces.find_constants(comm, model);
        }
        Ok(forces)
    }

    fn find_constants(&mut self, comm: &dyn Communicator, model: &Model<D>) {
        let Self { passes, halo } = self;
        let owned = model.owned();
        let sums = passes.sum(owned, |bonds, sums, source| {
            with_laws!(bonds.law, laws => {
                let kernel = Constant { law: laws[0] };
                sweep_all(&mut bonds.family, sums, &kernel, source);
            });
        });
        for (point, sum) in sums.into_iter().enumerate() {
            let law = passes.blocks[usize::from(model.block[point])].law;
            passes.constants[point] = law.constant(sum);
        }
        halo.pack(&[&passes.constants]);
        halo.exchange(comm, &mut || {});
        halo.unpack(&mut [&mut passes.constants]);
        passes.bring_constants();
    }

    /// Bonds of the rank's points, each counted from its end here, broken ones included.
    pub fn directed_bonds(&self) -> u64 {
        self.passes
            .bonds
            .iter()
            .map(|bonds| bonds.family.bonds())
            .sum()
    }

    /// Those of [`Self::directed_bonds`] that are kept as lattices.
    pub fn lattice_bonds(&self) -> u64 {
        let families = self.passes.bonds.iter().map(|bonds| &bonds.family);
        families
            .filter(|family| matches!(family, Family::Lattice(_)))
            .map(Family::bonds)
            .sum()
    }

    /// The bonds of the rank's points from each block to each, counted from their ends here, broken ones
    /// included.
    pub fn bonds_of_blocks(&self) -> impl Iterator<Item = ([usize; 2], u64)> {
        let families = self.passes.bonds.iter().map(|bonds| &bonds.family);
        families.map(|family| (family.blocks(), family.bonds()))
    }

    /// Memory of the bonds and of what they read of the points, bytes.
    pub fn bytes(&self) -> usize {
        let families = self.passes.bonds.iter().map(|bonds| bonds.family.bytes());
        families.sum::<usize>() + self.passes.bytes()
    }

    /// The vector instructions of the loops.
    pub fn instructions(&self) -> Instructions {
        self.passes.instructions
    }

    /// The halo plan.
    pub fn halo(&self) -> &Halo {
        &self.halo
    }

    /// Breaks the bonds for which `crosses` (of the two local indices) holds.
    pub fn cut(&mut self, crosses: impl Fn(usize, usize) -> bool) {
        for bonds in &mut self.passes.bonds {
            bonds.family.cut(&crosses);
        }
    }

    /// Calls `found` with the local indices of both ends of every intact bond of the owned points.
    pub fn for_each_intact(&self, mut found: impl FnMut(usize, usize)) {
        for bonds in &self.passes.bonds {
            bonds.family.for_each_intact(&mut found);
        }
    }

    /// How many bytes of bits the bonds of each owned point take.
    pub fn intact_lengths(&self, owned: usize) -> Vec<u32> {
        let mut lengths = vec![0; owned];
        for bonds in &self.passes.bonds {
            let add = |point: usize, length: usize| lengths[point] += length as u32;
            bonds.family.row_lengths(add);
        }
        lengths
    }

    /// The bits of the bonds of all owned points, one after the other.
    pub fn intact(&self, lengths: &[u32]) -> Vec<u8> {
        let (mut next, total) = starts(lengths);
        let mut bytes = vec![0; total];
        for bonds in &self.passes.bonds {
            bonds.family.save(&mut next, &mut bytes);
        }
        bytes
    }

    /// Puts back what [`Self::intact`] gave.
    pub fn set_intact(&mut self, lengths: &[u32], bytes: &[u8]) {
        let (mut next, _) = starts(lengths);
        for bonds in &mut self.passes.bonds {
            bonds.family.restore(&mut next, bytes);
        }
    }

    /// Brings the ghosts' displacements up to date.
    pub fn update_ghosts(&mut self, comm: &dyn Communicator, displacement: &mut [Vec<f64>; D]) {
        self.halo.pack(&components(displacement));
        self.halo.exchange(comm, &mut || {});
        self.halo.unpack(&mut components_mut(displacement));
    }

    /// Makes the bonds unbreakable that have an end whose entry is 1; the ghosts' entries are
    /// brought from their owners.
    pub fn protect(&mut self, comm: &dyn Communicator, protected: &mut [f64]) {
        self.halo.pack(&[protected]);
        self.halo.exchange(comm, &mut || {});
        self.halo.unpack(&mut [protected]);
        for bonds in &mut self.passes.bonds {
            bonds.family.protect(|point| protected[point] == 1.0);
        }
    }

    /// Brings the ghosts' displacements up to date, breaks bonds and replaces the force densities.
    pub fn evaluate(
        &mut self,
        comm: &dyn Communicator,
        model: &Model<D>,
        displacement: &mut [Vec<f64>; D],
        responses: &mut [Response<D>],
        times: &mut ForceTimes,
    ) {
        let Self { passes, halo } = self;
        let owned = responses.len();
        let start = Instant::now();
        let mut in_bonds = Duration::ZERO;
        let mut timed = |work: &mut dyn FnMut()| {
            let start = Instant::now();
            work();
            in_bonds += start.elapsed();
        };
        responses
            .par_chunks_mut(CHUNK)
            .flatten_iter()
            .for_each(|response| response.force = [0.0; D]);
        let mut before = None;
        for turn in 0..passes.order.len() {
            let pass = passes.order[turn];
            match before.and_then(|pass| passes.found(pass)) {
                None => halo.pack(&components(displacement)),
                Some(found) => halo.pack(&[found]),
            }
            passes.start(pass, owned);
            halo.exchange(comm, &mut || {
                timed(&mut || {
                    passes.bring(before, Which::Owned, model, displacement);
                    passes.run(pass, 0..model.interior, responses);
                });
            });
            match before.and_then(|pass| passes.found(pass)) {
                None => halo.unpack(&mut components_mut(displacement)),
                Some(found) => halo.unpack(&mut [found]),
            }
            timed(&mut || {
                passes.bring(before, Which::Ghosts, model, displacement);
                passes.run(pass, model.interior..owned, responses);
                passes.finish(pass, model, responses);
            });
            before = Some(pass);
        }
        times.bonds += in_bonds;
        times.halo += start.elapsed() - in_bonds;
    }

    /// What the intact bonds of each owned point hold, at displacements whose ghosts are up to date.
    pub fn stored(&mut self, model: &Model<D>, displacement: &[Vec<f64>; D]) -> Vec<Stored> {
        let passes = &mut self.passes;
        passes.bring(None, Which::All, model, displacement);
        let mut stored: Vec<Stored> = passes.sum(model.owned(), |bonds, stored, source| {
            with_laws!(bonds.law, laws => {
                let kernel = Energy { law: laws[0] };
                sweep_all(&mut bonds.family, stored, &kernel, source);
            });
        });
        for (point, stored) in stored.iter_mut().enumerate() {
            let constant = passes.constants.get(point).copied().unwrap_or(0.0);
            let law = passes.blocks[usize::from(model.block[point])].law;
            stored.energy += law.point_energy(stored.state_sum, constant);
        }
        stored
    }

    /// Finds the states of the owned points at displacements whose ghosts are up to date, without
    /// breaking bonds.
    pub fn refresh_states(&mut self, model: &Model<D>, displacement: &[Vec<f64>; D]) {
        if self.passes.states.is_empty() {
            return;
        }
        let stored = self.stored(model, displacement);
        let passes = &mut self.passes;
        for (point, state) in passes.states.iter_mut().enumerate().take(stored.len()) {
            let law = passes.blocks[usize::from(model.block[point])].law;
            *state = law.state(stored[point].state_sum, passes.constants[point]);
        }
        passes.bring(Some(Pass::States), Which::Owned, model, displacement);
    }

    /// Volume of the intact neighbours of each owned point, m³.
    pub fn family_volume(&mut self, model: &Model<D>) -> Vec<f64> {
        self.passes.sum(model.owned(), |bonds, volume, source| {
            sweep_all(&mut bonds.family, volume, &FamilyVolume, source);
        })
    }

    /// D = Σ V C n⊗n of each owned point (N/m⁴): xx, yy, zz, xy, yz, xz.
    pub fn stiffness(&mut self, model: &Model<D>) -> Vec<[f64; 6]> {
        self.passes.sum(model.owned(), |bonds, stiffness, source| {
            with_laws!(bonds.law, laws => {
                sweep_all(&mut bonds.family, stiffness, &Stiffness { laws }, source);
            });
        })
    }

    /// Stress of each owned point (Pa): xx, yy, zz, xy, yz, xz; at the displacements of the last
    /// [evaluation](Self::evaluate).
    pub fn stress(&mut self, model: &Model<D>, displacement: &[Vec<f64>; D]) -> Vec<[f64; 6]> {
        let passes = &mut self.passes;
        passes.bring(None, Which::All, model, displacement);
        passes.sum(model.owned(), |bonds, stress, source| {
            with_laws!(bonds.law, laws => {
                let kernel = Stress { law: laws[0] };
                sweep_all(&mut bonds.family, stress, &kernel, source);
            });
        })
    }

    /// What gives the dilatation of each owned point, at displacements whose ghosts are up to date.
    pub fn expansion(&mut self, model: &Model<D>, displacement: &[Vec<f64>; D]) -> Vec<Expansion> {
        let passes = &mut self.passes;
        passes.bring(None, Which::All, model, displacement);
        passes.sum(model.owned(), |bonds, expansion, source| {
            let linear = matches!(bonds.law, FamilyLaw::LinearMicroelastic(_));
            sweep_all(&mut bonds.family, expansion, &Dilatation { linear }, source);
        })
    }
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

fn components<const D: usize>(field: &[Vec<f64>; D]) -> [&[f64]; D] {
    field.each_ref().map(Vec::as_slice)
}

fn components_mut<const D: usize>(field: &mut [Vec<f64>; D]) -> [&mut [f64]; D] {
    field.each_mut().map(Vec::as_mut_slice)
}
