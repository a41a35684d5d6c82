//! Internal forces: exchange the displacements, break bonds, sum forces.
//!
//! Each pass over the bonds begins with a message that brings what it reads up to date at the ghosts:
//! first the displacements, then what the pass before has found. Interior points are worked on while
//! messages are in flight.

use std::time::{Duration, Instant};

use crate::comm::{Communicator, Halo};
use crate::material::Law;

use super::geometry::{Geometry, Shared};
use super::kernels::{Bonded, Energy, Response, Stored};
use super::laws::{BlockLaws, Bonds, with_laws};
use super::measures::{Constant, Dilatation, Expansion, Stiffness, Stress};
use super::model::Model;
use super::passes::{Passes, sweep_all};

/// The bonds of a rank and what it takes to sum over them.
pub struct Forces<const D: usize> {
    passes: Passes,
    halo: Halo,
}

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
    pub fn new(
        comm: &dyn Communicator,
        model: &Model<D>,
        bonds: Vec<Bonds>,
        halo: Halo,
        blocks: Vec<BlockLaws>,
    ) -> Self {
        let local = model.volume.len();
        let passes = Passes::new(bonds, blocks, model.owned(), local);
        let mut forces = Self { passes, halo };
        if !forces.passes.constants.is_empty() {
            forces.find_constants(comm, model);
        }
        forces
    }

    fn find_constants(&mut self, comm: &dyn Communicator, model: &Model<D>) {
        let Self { passes, halo } = self;
        let owned = model.owned();
        let still = vec![0.0; model.volume.len()];
        let geometry = Geometry {
            reference: components(&model.reference),
            displacement: [&still[..]; D],
            volume: &model.volume,
        };
        for Bonds { list, law, .. } in &mut passes.bonds {
            with_laws!(*law, laws => {
                let law = laws[0];
                sweep_all(list, &mut passes.constants[..owned], &Constant { geometry, law });
            });
        }
        for (constant, block) in passes.constants.iter_mut().zip(&model.block) {
            *constant = passes.blocks[usize::from(*block)].law.constant(*constant);
        }
        halo.pack(&[&passes.constants]);
        halo.exchange(comm, &mut || {});
        halo.unpack(&mut [&mut passes.constants]);
    }

    /// Bonds of the rank's points, each counted from its end here, broken ones included.
    pub fn directed_bonds(&self) -> u64 {
        self.passes
            .bonds
            .iter()
            .map(|bonds| bonds.list.bonds())
            .sum()
    }

    /// Memory of the bonds, bytes.
    pub fn bytes(&self) -> usize {
        self.passes
            .bonds
            .iter()
            .map(|bonds| bonds.list.bytes())
            .sum()
    }

    /// The halo plan.
    pub fn halo(&self) -> &Halo {
        &self.halo
    }

    /// Breaks the bonds for which `crosses` (of the two local indices) holds.
    pub fn cut(&mut self, crosses: impl Fn(usize, usize) -> bool) {
        for bonds in &mut self.passes.bonds {
            bonds.list.cut(&crosses);
        }
    }

    /// Calls `found` with the local indices of both ends of every intact bond of the owned points.
    pub fn for_each_intact(&self, mut found: impl FnMut(usize, usize)) {
        for bonds in &self.passes.bonds {
            bonds.list.for_each_intact(&mut found);
        }
    }

    /// How many bytes of bits the bonds of each owned point take.
    pub fn intact_lengths(&self, owned: usize) -> Vec<u32> {
        let mut lengths = vec![0; owned];
        for (point, row) in self
            .passes
            .bonds
            .iter()
            .flat_map(|bonds| bonds.list.intact_rows())
        {
            lengths[point] += row.len() as u32;
        }
        lengths
    }

    /// The bits of the bonds of all owned points, one after the other.
    pub fn intact(&self, lengths: &[u32]) -> Vec<u8> {
        let (mut next, total) = starts(lengths);
        let mut bytes = vec![0; total];
        for (point, row) in self
            .passes
            .bonds
            .iter()
            .flat_map(|bonds| bonds.list.intact_rows())
        {
            bytes[next[point]..next[point] + row.len()].copy_from_slice(row);
            next[point] += row.len();
        }
        bytes
    }

    /// Puts back what [`Self::intact`] gave.
    pub fn set_intact(&mut self, lengths: &[u32], bytes: &[u8]) {
        let (mut next, _) = starts(lengths);
        for bonds in &mut self.passes.bonds {
            for (point, row) in bonds.list.intact_rows_mut() {
                row.copy_from_slice(&bytes[next[point]..next[point] + row.len()]);
                next[point] += row.len();
            }
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
            bonds.list.protect(|point| protected[point] == 1.0);
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
        for response in responses.iter_mut() {
            response.force = [0.0; D];
        }
        let mut before = None;
        for pass in passes.order.clone() {
            match before.and_then(|pass| passes.found(pass)) {
                None => halo.pack(&components(displacement)),
                Some(found) => halo.pack(&[found]),
            }
            passes.start(pass, owned);
            halo.exchange(comm, &mut || {
                timed(&mut || {
                    let geometry = geometry(model, displacement);
                    passes.run(pass, geometry, 0..model.interior, responses);
                });
            });
            match before.and_then(|pass| passes.found(pass)) {
                None => halo.unpack(&mut components_mut(displacement)),
                Some(found) => halo.unpack(&mut [found]),
            }
            timed(&mut || {
                let geometry = geometry(model, displacement);
                passes.run(pass, geometry, model.interior..owned, responses);
                passes.finish(pass, model, responses);
            });
            before = Some(pass);
        }
        times.bonds += in_bonds;
        times.halo += start.elapsed() - in_bonds;
    }

    /// What the intact bonds of each owned point hold, at displacements whose ghosts are up to date.
    pub fn stored(&mut self, model: &Model<D>, displacement: &[Vec<f64>; D]) -> Vec<Stored> {
        let geometry = geometry(model, displacement);
        let mut stored = self.sum(
            |bonds, shared, stored| {
                with_laws!(bonds.law, laws => {
                    let bonded = Bonded { geometry, shared, laws };
                    sweep_all(&mut bonds.list, stored, &Energy { bonded });
                });
            },
            model,
        );
        for (point, stored) in stored.iter_mut().enumerate() {
            let constant = self.passes.constants.get(point).copied().unwrap_or(0.0);
            let law = self.passes.blocks[usize::from(model.block[point])].law;
            stored.energy += law.point_energy(stored.state_sum, constant);
        }
        stored
    }

    /// Finds the states of the owned points at displacements whose ghosts are up to date, without
    /// breaking bonds.
    pub fn refresh_states(&mut self, model: &Model<D>, displacement: &[Vec<f64>; D]) {
        let stored = self.stored(model, displacement);
        let Passes {
            states,
            constants,
            blocks,
            ..
        } = &mut self.passes;
        for (point, state) in states.iter_mut().enumerate().take(stored.len()) {
            let law = blocks[usize::from(model.block[point])].law;
            *state = law.state(stored[point].state_sum, constants[point]);
        }
    }

    /// D = Σ V C n⊗n of each owned point (N/m⁴): xx, yy, zz, xy, yz, xz.
    pub fn stiffness(&mut self, model: &Model<D>, displacement: &[Vec<f64>; D]) -> Vec<[f64; 6]> {
        let geometry = geometry(model, displacement);
        self.sum(
            |bonds, shared, stiffness| {
                with_laws!(bonds.law, laws => {
                    let bonded = Bonded { geometry, shared, laws };
                    sweep_all(&mut bonds.list, stiffness, &Stiffness { bonded });
                });
            },
            model,
        )
    }

    /// Stress of each owned point (Pa): xx, yy, zz, xy, yz, xz; at the displacements of the last
    /// [evaluation](Self::evaluate).
    pub fn stress(&mut self, model: &Model<D>, displacement: &[Vec<f64>; D]) -> Vec<[f64; 6]> {
        let geometry = geometry(model, displacement);
        self.sum(
            |bonds, shared, stress| {
                with_laws!(bonds.law, laws => {
                    let bonded = Bonded { geometry, shared, laws };
                    sweep_all(&mut bonds.list, stress, &Stress { bonded });
                });
            },
            model,
        )
    }

    /// What gives the dilatation of each owned point, at displacements whose ghosts are up to date.
    pub fn expansion(&mut self, model: &Model<D>, displacement: &[Vec<f64>; D]) -> Vec<Expansion> {
        let geometry = geometry(model, displacement);
        self.sum(
            |bonds, _, expansion| {
                let linear = matches!(bonds.law, super::laws::ListLaw::LinearMicroelastic(_));
                sweep_all(&mut bonds.list, expansion, &Dilatation { geometry, linear });
            },
            model,
        )
    }

    /// Sums over all bonds of the owned points.
    fn sum<T: Default + Clone>(
        &mut self,
        sweep: impl Fn(&mut Bonds, Shared<'_>, &mut [T]),
        model: &Model<D>,
    ) -> Vec<T> {
        let mut sums = vec![T::default(); model.owned()];
        let Passes {
            bonds,
            constants,
            states,
            ..
        } = &mut self.passes;
        let shared = Shared { constants, states };
        for bonds in bonds {
            sweep(bonds, shared, &mut sums);
        }
        sums
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

fn geometry<'a, const D: usize>(
    model: &'a Model<D>,
    displacement: &'a [Vec<f64>; D],
) -> Geometry<'a, D> {
    Geometry {
        reference: components(&model.reference),
        displacement: components(displacement),
        volume: &model.volume,
    }
}
