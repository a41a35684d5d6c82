//! Internal forces: exchange the displacements, break bonds, sum forces.
//!
//! Two passes, of which the first is only made where a damage law needs it: what neighbours must
//! know of a point is computed and exchanged, then the bonds are summed. Interior points are worked
//! on while messages are in flight.

use std::ops::Range;
use std::time::{Duration, Instant};

use crate::comm::{Communicator, Halo};
use crate::damage::CriticalStretch;

use super::kernels::{
    Energy, Force, Geometry, NoFailure, PerPoint, Response, SmallestStretch, Stiffness, Stored,
    Uniform,
};
use super::model::{Bonds, ListFailure, ListLaw, Model};
use super::sweep::sweep;

/// The bonds of a rank and what it takes to sum over them.
pub struct Forces<const D: usize> {
    bonds: Vec<Bonds>,
    halo: Halo,
    /// Damage law of each block.
    damage: Vec<Option<CriticalStretch>>,
    /// Threshold of each local point, where it depends on the point's smallest stretch.
    thresholds: Vec<f64>,
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
    /// Puts together the bonds, the halo plan and the blocks' damage laws.
    pub fn new(
        bonds: Vec<Bonds>,
        halo: Halo,
        damage: Vec<Option<CriticalStretch>>,
        local_points: usize,
    ) -> Self {
        let per_point = bonds
            .iter()
            .any(|bonds| matches!(bonds.failure, ListFailure::PerPoint));
        Self {
            bonds,
            halo,
            damage,
            thresholds: vec![0.0; if per_point { local_points } else { 0 }],
        }
    }

    /// Bonds of the rank's points, each counted from its end here, broken ones included.
    pub fn directed_bonds(&self) -> u64 {
        self.bonds.iter().map(|bonds| bonds.list.bonds()).sum()
    }

    /// Memory of the bonds, bytes.
    pub fn bytes(&self) -> usize {
        self.bonds.iter().map(|bonds| bonds.list.bytes()).sum()
    }

    /// Breaks the bonds for which `crosses` (of the two local indices) holds.
    pub fn cut(&mut self, crosses: impl Fn(usize, usize) -> bool) {
        for bonds in &mut self.bonds {
            bonds.list.cut(&crosses);
        }
    }

    /// Calls `found` with the local indices of both ends of every intact bond of the owned points.
    pub fn for_each_intact(&self, mut found: impl FnMut(usize, usize)) {
        for bonds in &self.bonds {
            bonds.list.for_each_intact(&mut found);
        }
    }

    /// How many bytes of bits the bonds of each owned point take.
    pub fn intact_lengths(&self, owned: usize) -> Vec<u32> {
        let mut lengths = vec![0; owned];
        for (point, row) in self.bonds.iter().flat_map(|bonds| bonds.list.intact_rows()) {
            lengths[point] += row.len() as u32;
        }
        lengths
    }

    /// The bits of the bonds of all owned points, one after the other.
    pub fn intact(&self, lengths: &[u32]) -> Vec<u8> {
        let (mut next, total) = starts(lengths);
        let mut bytes = vec![0; total];
        for (point, row) in self.bonds.iter().flat_map(|bonds| bonds.list.intact_rows()) {
            bytes[next[point]..next[point] + row.len()].copy_from_slice(row);
            next[point] += row.len();
        }
        bytes
    }

    /// Puts back what [`Self::intact`] gave.
    pub fn set_intact(&mut self, lengths: &[u32], bytes: &[u8]) {
        let (mut next, _) = starts(lengths);
        for bonds in &mut self.bonds {
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
        for bonds in &mut self.bonds {
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
        let Self {
            bonds,
            halo,
            damage,
            thresholds,
        } = self;
        let owned = responses.len();
        let interior = 0..model.interior;
        let border = model.interior..owned;
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

        halo.pack(&components(displacement));
        if thresholds.is_empty() {
            halo.exchange(comm, &mut || {
                timed(&mut || {
                    let geometry = geometry(model, displacement);
                    sum_forces(bonds, geometry, &[], interior.clone(), responses);
                });
            });
            halo.unpack(&mut components_mut(displacement));
        } else {
            let smallest = &mut thresholds[..owned];
            smallest.fill(f64::INFINITY);
            halo.exchange(comm, &mut || {
                timed(&mut || {
                    let geometry = geometry(model, displacement);
                    smallest_stretches(bonds, geometry, interior.clone(), smallest);
                });
            });
            halo.unpack(&mut components_mut(displacement));
            let geometry = geometry(model, displacement);
            timed(&mut || {
                smallest_stretches(bonds, geometry, border.clone(), smallest);
                for (value, block) in smallest.iter_mut().zip(&model.block) {
                    *value = match damage[usize::from(*block)] {
                        // A point without intact bonds has no smallest stretch.
                        Some(law) if value.is_infinite() => law.critical,
                        Some(law) => law.threshold(*value),
                        None => f64::INFINITY,
                    };
                }
            });
            halo.pack(&[&thresholds[..]]);
            halo.exchange(comm, &mut || {
                timed(&mut || sum_forces(bonds, geometry, thresholds, interior.clone(), responses));
            });
            halo.unpack(&mut [&mut thresholds[..]]);
        }
        let geometry = geometry(model, displacement);
        timed(&mut || sum_forces(bonds, geometry, thresholds, border.clone(), responses));
        times.bonds += in_bonds;
        times.halo += start.elapsed() - in_bonds;
    }

    /// What the intact bonds of each owned point hold, at displacements whose ghosts are up to date.
    pub fn stored(&mut self, model: &Model<D>, displacement: &[Vec<f64>; D]) -> Vec<Stored> {
        let mut stored = vec![Stored::default(); model.owned()];
        let geometry = geometry(model, displacement);
        for Bonds { list, law, .. } in &mut self.bonds {
            let ListLaw::Pmb(law) = *law;
            let kernel = Energy { geometry, law };
            let rows = 0..list.len();
            sweep(list, rows, &mut stored, &kernel);
        }
        stored
    }

    /// D = Σ V C n⊗n of each owned point (N/m⁴): xx, yy, zz, xy, xz, yz.
    pub fn stiffness(&mut self, model: &Model<D>, displacement: &[Vec<f64>; D]) -> Vec<[f64; 6]> {
        let mut stiffness = vec![[0.0; 6]; model.owned()];
        let geometry = geometry(model, displacement);
        for Bonds { list, law, .. } in &mut self.bonds {
            let ListLaw::Pmb(law) = *law;
            let kernel = Stiffness { geometry, law };
            let rows = 0..list.len();
            sweep(list, rows, &mut stiffness, &kernel);
        }
        stiffness
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

/// The rows of a list whose points have local indices in a range.
fn rows_of(bonds: &Bonds, points: &Range<usize>) -> Range<usize> {
    bonds.list.rows_below(points.start)..bonds.list.rows_below(points.end)
}

fn sum_forces<const D: usize>(
    all: &mut [Bonds],
    geometry: Geometry<'_, D>,
    thresholds: &[f64],
    points: Range<usize>,
    responses: &mut [Response<D>],
) {
    for bonds in all {
        let rows = rows_of(bonds, &points);
        let ListLaw::Pmb(law) = bonds.law;
        let list = &mut bonds.list;
        match bonds.failure {
            ListFailure::Never => {
                let failure = NoFailure;
                let kernel = Force {
                    geometry,
                    law,
                    failure,
                };
                sweep(list, rows, responses, &kernel);
            }
            ListFailure::Uniform(critical) => {
                let failure = Uniform(critical);
                let kernel = Force {
                    geometry,
                    law,
                    failure,
                };
                sweep(list, rows, responses, &kernel);
            }
            ListFailure::PerPoint => {
                let failure = PerPoint(thresholds);
                let kernel = Force {
                    geometry,
                    law,
                    failure,
                };
                sweep(list, rows, responses, &kernel);
            }
        }
    }
}

fn smallest_stretches<const D: usize>(
    all: &mut [Bonds],
    geometry: Geometry<'_, D>,
    points: Range<usize>,
    smallest: &mut [f64],
) {
    for bonds in all {
        let rows = rows_of(bonds, &points);
        let kernel = SmallestStretch { geometry };
        sweep(&mut bonds.list, rows, smallest, &kernel);
    }
}
