//! Point data that kernels read for bonds in lists. The [`Node`] of a point fills one cache line.

use crate::damage::Limits;
use crate::families::{Groups, Row};
use crate::lanes::lane_tuple::gather;
use crate::lanes::{Column, LaneTuple, Lanes, Simd, WIDTH};
use crate::material::bond::{Elastic, Reference, SeparateThermal, Weights, deform};
use crate::solver::model::Model;

use super::kernel::{Group, Kernel};
use super::limit_columns::{LimitColumns, ReadLimits, ReadRotations};

/// Reference position (m), displacement (m), volume (m³) and thermal stretch of a point. Position and
/// displacement have three components each.
#[derive(Debug, Clone, Copy)]
#[repr(C, align(64))]
pub struct Node([f64; 8]);

/// Index of the first component of the displacement in a node.
const DISPLACEMENT: usize = 3;

/// Index of the volume in a node.
const VOLUME: usize = 6;

/// Index of the thermal stretch in a node.
const THERMAL_STRETCH: usize = 7;

/// Create the nodes of the local points, with zero displacements.
pub fn nodes<const D: usize>(model: &Model<D>) -> Vec<Node> {
    let node = |point: usize| {
        let [x, y, z] = model.position(point);
        Node([x, y, z, 0.0, 0.0, 0.0, model.volume[point], 0.0])
    };
    (0..model.volume.len()).map(node).collect()
}

/// Copy displacements into the nodes, and thermal stretches if the run has temperatures.
pub fn update<const D: usize>(
    nodes: &mut [Node],
    displacement: [&[f64]; D],
    thermal_stretch: Option<&[f64]>,
) {
    for (k, node) in nodes.iter_mut().enumerate() {
        for d in 0..D {
            node.0[DISPLACEMENT + d] = displacement[d][k];
        }
    }
    if let Some(stretch) = thermal_stretch {
        for (node, stretch) in nodes.iter_mut().zip(stretch) {
            node.0[THERMAL_STRETCH] = *stretch;
        }
    }
}

/// The local points, including ghosts, in the form that a kernel reads.
pub struct ListPoints<'a, K: Kernel<D>, const D: usize> {
    nodes: &'a [Node],
    numbers: <K::Point as LaneTuple>::Columns<'a>,
    limits: ReadLimits<'a>,
    rotations: ReadRotations<'a, K::Rotation>,
    limit: f64,
    is_linear: bool,
    /// Whether the kernel removes thermal stretches from the bonds.
    is_thermal: bool,
}

impl<K: Kernel<D>, const D: usize> Clone for ListPoints<'_, K, D> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<K: Kernel<D>, const D: usize> Copy for ListPoints<'_, K, D> {}

/// Data of point i, the same in all lanes.
#[derive(Clone, Copy)]
pub struct PointI<P, R, const D: usize> {
    reference: [Lanes; D],
    displacement: [Lanes; D],
    volume: Lanes,
    thermal_stretch: Lanes,
    numbers: P,
    limits: Limits,
    rotation: R,
}

impl<'a, K: Kernel<D>, const D: usize> ListPoints<'a, K, D> {
    /// Prepare the points with local index below `reach` for a kernel.
    ///
    /// # Panics
    /// If an array that the kernel reads is shorter than `reach`.
    pub fn new(
        kernel: &K,
        reach: usize,
        nodes: &'a [Node],
        numbers: &'a [Column],
        limits: &'a LimitColumns,
        is_thermal: bool,
    ) -> Self {
        let numbers = K::Point::columns(numbers);
        assert!(
            nodes.len() >= reach && K::Point::covers(&numbers, reach),
            "an array is too short for the bonds"
        );
        Self {
            nodes,
            numbers,
            limits: ReadLimits::new(kernel.criterion(), limits, reach),
            rotations: ReadRotations::new::<D>(kernel.criterion(), limits, reach),
            limit: kernel.criterion().limit(),
            is_linear: kernel.is_linear(),
            is_thermal: is_thermal && kernel.is_elastic(),
        }
    }

    /// # Safety
    /// The indices must be below the `reach` of [`Self::new`].
    #[inline(always)]
    unsafe fn numbers(&self, indices: &[u32; 8]) -> K::Point {
        // SAFETY: `new` has checked the length.
        K::Point::load(&self.numbers, |column| unsafe { gather(column, indices) })
    }

    /// # Safety
    /// The indices must be below the `reach` of [`Self::new`].
    #[inline(always)]
    unsafe fn numbers_j(&self, indices: &[u32; 8]) -> K::PointJ {
        // SAFETY: `new` has checked the length.
        K::PointJ::load_first::<K::Point>(&self.numbers, |column| unsafe {
            gather(column, indices)
        })
    }

    /// # Safety
    /// The indices must be below the `reach` of [`Self::new`].
    #[inline(always)]
    unsafe fn limits(&self, indices: &[u32; 8]) -> Limits {
        // SAFETY: `ReadLimits::new` has checked the lengths.
        (self.limits).eight(K::READS_STRESSES, |column| unsafe {
            gather(column, indices)
        })
    }

    /// # Safety
    /// The indices must be below the `reach` of [`Self::new`].
    #[inline(always)]
    unsafe fn rotations(&self, indices: &[u32; 8]) -> K::Rotation {
        // SAFETY: `ReadRotations::new` has checked the lengths.
        (self.rotations).eight::<D>(|column| unsafe { gather(column, indices) })
    }

    /// Load point i.
    ///
    /// # Safety
    /// The local index of the point must be below the `reach` of [`Self::new`].
    #[inline(always)]
    pub unsafe fn load_point_i(&self, point: usize) -> PointI<K::Point, K::Rotation, D> {
        debug_assert!(point < self.nodes.len());
        let own = [point as u32; 8];
        // SAFETY: `new` has checked the lengths.
        let (node, numbers, limits, rotation) = unsafe {
            (
                &self.nodes.get_unchecked(point).0,
                self.numbers(&own),
                self.limits(&own),
                self.rotations(&own),
            )
        };
        PointI {
            reference: LaneTuple::each(|d| Lanes::splat(node[d])),
            displacement: LaneTuple::each(|d| Lanes::splat(node[DISPLACEMENT + d])),
            volume: Lanes::splat(node[VOLUME]),
            thermal_stretch: Lanes::splat(node[THERMAL_STRETCH]),
            numbers,
            limits,
            rotation,
        }
    }

    /// Load the bonds of a group.
    ///
    /// # Safety
    /// The row must belong to a list whose reach is at most the `reach` of [`Self::new`]. `group` must be the
    /// index of a group of the row.
    #[inline(always)]
    pub unsafe fn load<'h, S: Simd>(
        &self,
        simd: S,
        here: &'h PointI<K::Point, K::Rotation, D>,
        row: &mut Row<'_>,
        group: usize,
    ) -> Group<'h, K, D> {
        let neighbours = row.neighbours.group(group);
        let indices = neighbours.indices();
        debug_assert!(indices.iter().all(|n| (*n as usize) < self.nodes.len()));
        let (first, distances) = neighbours.base_and_offsets();
        // SAFETY: `new` has checked the length.
        let nodes = unsafe { self.nodes.get_unchecked(first..) };
        // SAFETY: as above.
        let node = |k: usize| unsafe { &nodes.get_unchecked(distances[k]).0 };
        // Not `map`: see the rules for loops in docs/src/developers/performance.md.
        let [a, b, c, d] = [node(0), node(1), node(2), node(3)];
        let [e, f, g, h] = [node(4), node(5), node(6), node(7)];
        let columns = simd.transpose([a, b, c, d, e, f, g, h]);
        let xi: [Lanes; D] = LaneTuple::each(|d| columns[d] - here.reference[d]);
        let eta = LaneTuple::each(|d| columns[DISPLACEMENT + d] - here.displacement[d]);
        let mut square = xi[0] * xi[0];
        for component in &xi[1..] {
            square = simd.multiply_add(*component, *component, square);
        }
        // Compute 1/|ξ|² first: x of `material::bond` needs only this quotient, so the computation of x does
        // not wait for the square root.
        let inverse_square = Lanes::splat(1.0) / square;
        let inverse = inverse_square.sqrt();
        let reference = Reference {
            xi,
            length: square * inverse,
            inverse,
            inverse_square,
        };
        // SAFETY: as above.
        let numbers = unsafe { self.numbers_j(&indices) };
        // SAFETY: as above.
        let (limits, rotation) = unsafe { (self.limits(&indices), self.rotations(&indices)) };
        let intact = row.groups.intact[group];
        let (mut eta, volume) = (eta, columns[VOLUME]);
        let mut force_volume = volume;
        if self.is_thermal {
            let stretches = [here.thermal_stretch, columns[THERMAL_STRETCH]];
            let elastic: Elastic<D> = simd.aside(SeparateThermal { xi, eta, stretches });
            eta = elastic.eta;
            force_volume = volume * elastic.slope;
        }
        Group {
            bond: deform::<_, false, D>(
                simd,
                &reference,
                eta,
                intact,
                self.limit,
                K::wanted(self.is_linear),
            ),
            volume_i: here.volume,
            volume_j: volume,
            force_volume,
            weights: match row.weights {
                [None, _] => Weights::One,
                [Some(weights), None] => Weights::Same(weights[group]),
                [Some(own), Some(far)] => Weights::Each([own[group], far[group]]),
            },
            numbers_i: &here.numbers,
            numbers_j: numbers,
            limits_i: &here.limits,
            limits_j: limits,
            rotation_i: &here.rotation,
            rotation_j: rotation,
            history: load_history::<K::BondHistory>(&mut row.groups, group),
            whole: if K::READS_BROKEN { row.whole(group) } else { 0 },
            intact,
            breakable: row.groups.breakable.map_or(u8::MAX, |bits| bits[group]),
        }
    }
}

/// Load the history of the bonds of a group for point i and for point j. If [`LaneTuple::PADDED`] is false,
/// the history of point j is valid only if `H::COUNT` equals the number of values that are stored per end.
#[inline(always)]
pub fn load_history<H: LaneTuple>(groups: &mut Groups<'_>, group: usize) -> [H; 2] {
    if H::COUNT == 0 {
        return [H::splat(0.0); 2];
    }
    let all = groups.history(group);
    if H::PADDED {
        let of_each = all.len() / 2;
        let load = |first: usize| {
            H::each(|k| {
                if k < of_each {
                    all[first + k]
                } else {
                    Lanes::splat(0.0)
                }
            })
        };
        return [load(0), load(of_each)];
    }
    [H::each(|k| all[k]), H::each(|k| all[H::COUNT + k])]
}

/// Store the history of the intact bonds of a group.
#[inline(always)]
pub fn store_history<H: LaneTuple>(all: &mut [Lanes], history: &[H; 2], intact: u8) {
    let of_each = if H::PADDED { all.len() / 2 } else { H::COUNT };
    for (k, stored) in all.iter_mut().enumerate() {
        let value = history[k / of_each].get(k % of_each);
        for lane in 0..WIDTH {
            if intact >> lane & 1 == 1 {
                stored.0[lane] = value.0[lane];
            }
        }
    }
}
