//! What kernels read of the local points where bonds are listed: all that is needed of a point in one
//! cache line.

use std::ops::Range;

use rayon::prelude::*;

use crate::families::Row;
use crate::material::{Arithmetic, End, Lanes};

use super::geometry::{Loaded, Reference, Weights, deform};
use super::kernels::Kernel;
use super::model::Model;

/// Points handled by one task.
const CHUNK: usize = 4096;

/// Reference position (m), displacement (m) and volume (m³) of a point, three components each.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Node([f64; 8]);

/// First entry of a node's displacement.
const DISPLACEMENT: usize = 3;

/// Entry of a node's volume.
const VOLUME: usize = 6;

/// The nodes of the local points, at rest.
pub fn nodes<const D: usize>(model: &Model<D>) -> Vec<Node> {
    let node = |point: usize| {
        let [x, y, z] = model.position(point);
        Node([x, y, z, 0.0, 0.0, 0.0, model.volume[point], 0.0])
    };
    (0..model.volume.len()).map(node).collect()
}

/// Brings the displacements of a range of points up to date.
pub fn bring<const D: usize>(
    nodes: &mut [Node],
    points: Range<usize>,
    displacement: &[Vec<f64>; D],
) {
    let first = points.start;
    nodes[points]
        .par_chunks_mut(CHUNK)
        .enumerate()
        .for_each(|(chunk, nodes)| {
            for (k, node) in nodes.iter_mut().enumerate() {
                for d in 0..D {
                    node.0[DISPLACEMENT + d] = displacement[d][first + chunk * CHUNK + k];
                }
            }
        });
}

/// The local points, ghosts included. Empty arrays are not read.
#[derive(Clone, Copy)]
pub struct Cloud<'a> {
    /// Geometry.
    pub nodes: &'a [Node],
    /// [`crate::material::Law::constant`] of each point.
    pub constants: &'a [f64],
    /// [`crate::material::Law::state`] of each point.
    pub states: &'a [f64],
    /// Threshold of each point.
    pub thresholds: &'a [f64],
}

/// What is read of the own end of bonds.
#[derive(Clone, Copy)]
pub struct Here<const D: usize> {
    reference: [Lanes; D],
    displacement: [Lanes; D],
    volume: Lanes,
    end: End,
    threshold: Lanes,
}

/// # Safety
/// `values` must be longer than every index.
#[inline(always)]
unsafe fn gather(needed: bool, values: &[f64], indices: &[u32; 8]) -> Lanes {
    let mut lanes = Lanes::splat(0.0);
    if needed {
        for (lane, index) in lanes.0.iter_mut().zip(indices) {
            // SAFETY: passed on to the caller.
            *lane = unsafe { *values.get_unchecked(*index as usize) };
        }
    }
    lanes
}

impl Cloud<'_> {
    /// # Panics
    /// When an array that the kernel reads has fewer than `count` entries.
    pub fn assert_covers<K: Kernel<D>, const D: usize>(&self, count: usize) {
        let enough = |needed: bool, length: usize| !needed || length >= count;
        assert!(
            enough(true, self.nodes.len())
                && enough(K::CONSTANT, self.constants.len())
                && enough(K::STATE, self.states.len())
                && enough(K::THRESHOLD, self.thresholds.len()),
            "an array is too short for the bonds"
        );
    }

    /// The own end of a point's bonds.
    ///
    /// # Safety
    /// All arrays that the kernel reads must be longer than the index.
    #[inline(always)]
    pub unsafe fn here<K: Kernel<D>, const D: usize>(&self, point: usize) -> Here<D> {
        // SAFETY: passed on to the caller.
        let node = unsafe { &self.nodes.get_unchecked(point).0 };
        let own = [point as u32; 8];
        // SAFETY: as above.
        let of = |needed, values: &[f64]| unsafe { gather(needed, values, &own) };
        Here {
            reference: std::array::from_fn(|d| Lanes::splat(node[d])),
            displacement: std::array::from_fn(|d| Lanes::splat(node[DISPLACEMENT + d])),
            volume: Lanes::splat(node[VOLUME]),
            end: End {
                constant: of(K::CONSTANT, self.constants),
                state: of(K::STATE, self.states),
            },
            threshold: of(K::THRESHOLD, self.thresholds),
        }
    }

    /// The bonds of a group.
    ///
    /// # Safety
    /// All arrays that the kernel reads must be longer than every index of the row.
    #[inline(always)]
    pub unsafe fn load<A: Arithmetic, K: Kernel<D>, const D: usize>(
        &self,
        kernel: &K,
        here: &Here<D>,
        row: &Row<'_>,
        group: usize,
    ) -> Loaded<D> {
        let neighbours = &row.neighbours[group];
        // SAFETY: passed on to the caller.
        let node = |k: usize| unsafe { &self.nodes.get_unchecked(neighbours[k] as usize).0 };
        let columns = A::transpose(std::array::from_fn(node));
        let along: [Lanes; D] = std::array::from_fn(|d| columns[d] - here.reference[d]);
        let eta = std::array::from_fn(|d| columns[DISPLACEMENT + d] - here.displacement[d]);
        let mut square = along[0] * along[0];
        for xi in &along[1..] {
            square = A::multiply_add(*xi, *xi, square);
        }
        let inverse = A::inverse_sqrt(square);
        let reference = Reference {
            along,
            square,
            length: square * inverse,
            inverse,
            inverse_square: inverse * inverse,
        };
        let deformed = deform::<A, D>(&reference, eta, kernel.linear());
        // SAFETY: as above.
        let of = |needed, values: &[f64]| unsafe { gather(needed, values, neighbours) };
        let there = End {
            constant: of(K::CONSTANT, self.constants),
            state: of(K::STATE, self.states),
        };
        Loaded {
            bond: deformed.bond,
            reference: along,
            along: deformed.along,
            inverse_length: deformed.inverse_length,
            own_volume: here.volume,
            volume: columns[VOLUME],
            weights: match row.weights {
                [None, _] => Weights::One,
                [Some(weights), None] => Weights::Same(weights[group]),
                [Some(own), Some(far)] => Weights::Each([own[group], far[group]]),
            },
            ends: [here.end, there],
            thresholds: [here.threshold, of(K::THRESHOLD, self.thresholds)],
            intact: row.intact[group],
            filled: if K::FILLED { row.filled(group) } else { 0 },
            breakable: row.breakable.map_or(u8::MAX, |bits| bits[group]),
        }
    }
}
