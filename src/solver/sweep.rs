//! Running a kernel over the bonds of a family, on all threads.
//!
//! A task owns some of the bonds and the outputs of their points, so there is no lock and no atomic;
//! each point's sum is the same sequence of operations whatever the tasks are.

use std::ops::Range;

use crate::families::{Adjacent, Family, Row, Rows, Vectors};
use crate::material::lanes::WIDTH;
use crate::material::{Arithmetic, Lanes, arithmetic};

use super::cloud::Cloud;
use super::instructions::Instructions;
use super::kernels::{Kernel, Pick};
use super::places::Places;

/// Bonds by groups of eight below which a task is not split further.
const LEAF: usize = 2048;

/// What kernels read of the points.
#[derive(Clone, Copy)]
pub struct Source<'a, const D: usize> {
    /// For lists.
    pub cloud: Cloud<'a>,
    /// For lattices, by grid.
    pub places: &'a [Places<D>],
    /// What to run on.
    pub instructions: Instructions,
}

/// Part of the bonds of a family.
trait Part: Sized + Send {
    /// Number of points or vectors.
    fn len(&self) -> usize;

    /// Local index of the first point of one of them.
    fn point(&self, k: usize) -> usize;

    /// Those before one of them, and the rest.
    fn split_at(self, k: usize) -> (Self, Self);
}

/// A kernel with what it reads, for one kind of family.
trait Runner<P: Part>: Sync {
    type Output: Send;

    /// Goes through a part; `base` is the local index of the first output.
    fn run<A: Arithmetic>(&self, part: P, base: usize, outputs: &mut [Self::Output]);

    /// Whether it is worth a version for each set of vector instructions.
    const HOT: bool;
}

/// Runs the kernel over the bonds of the owned points in a range of local indices. `outputs` are over
/// all owned points.
///
/// # Panics
/// When an array that the kernel reads is too short for the family's indices.
pub fn sweep<K: Kernel<D>, const D: usize>(
    family: &mut Family,
    points: Range<usize>,
    outputs: &mut [K::Output],
    kernel: &K,
    source: Source<'_, D>,
) {
    let Source {
        cloud,
        places,
        instructions,
    } = source;
    let several = rayon::current_num_threads() > 1;
    let leaf = |groups: usize| match several {
        true => (LEAF / groups.max(1)).max(1),
        false => usize::MAX,
    };
    match family {
        Family::List(list) => {
            cloud.assert_covers::<K, D>(list.reach());
            let rows = list.rows_below(points.start)..list.rows_below(points.end);
            let leaf = leaf(list.groups_a_row());
            let runner = OverRows::<K, D> { kernel, cloud };
            split(list.rows(rows), 0, outputs, &runner, leaf, instructions);
        }
        Family::Lattice(lattice) => {
            let places = &places[lattice.index];
            places.assert_covers::<K>(lattice.grid.places());
            let vectors = lattice.vectors_below(points.start)..lattice.vectors_below(points.end);
            let filled = if K::FILLED {
                lattice.filled()
            } else {
                Vec::new()
            };
            let runner = OverVectors::<K, D> {
                kernel,
                places,
                volumes: [lattice.own_volume, lattice.volume].map(Lanes::splat),
                filled,
            };
            let leaf = leaf(lattice.offsets());
            let part = lattice.vectors(vectors);
            split(part, 0, outputs, &runner, leaf, instructions);
        }
    }
}

/// Halves a part until a task is small.
fn split<P: Part, R: Runner<P>>(
    part: P,
    base: usize,
    outputs: &mut [R::Output],
    runner: &R,
    leaf: usize,
    instructions: Instructions,
) {
    if part.len() <= leaf {
        return run(part, base, outputs, runner, instructions);
    }
    let half = part.len() / 2;
    let border = part.point(half);
    let (part_a, part_b) = part.split_at(half);
    let (outputs_a, outputs_b) = outputs.split_at_mut(border - base);
    rayon::join(
        || split(part_a, base, outputs_a, runner, leaf, instructions),
        || split(part_b, border, outputs_b, runner, leaf, instructions),
    );
}

fn run<P: Part, R: Runner<P>>(
    part: P,
    base: usize,
    outputs: &mut [R::Output],
    runner: &R,
    instructions: Instructions,
) {
    #[cfg(target_arch = "x86_64")]
    if R::HOT {
        match instructions {
            // SAFETY: the machine has the instructions.
            Instructions::Avx512 => return unsafe { run_avx512(part, base, outputs, runner) },
            // SAFETY: as above.
            Instructions::Avx2 => return unsafe { run_avx2(part, base, outputs, runner) },
            Instructions::Baseline => {}
        }
    }
    let _ = instructions;
    runner.run::<arithmetic::Plain>(part, base, outputs);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw,avx2,bmi2,fma")]
fn run_avx512<P: Part, R: Runner<P>>(part: P, base: usize, outputs: &mut [R::Output], runner: &R) {
    runner.run::<arithmetic::Wide>(part, base, outputs);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi2,fma")]
fn run_avx2<P: Part, R: Runner<P>>(part: P, base: usize, outputs: &mut [R::Output], runner: &R) {
    runner.run::<arithmetic::Fused>(part, base, outputs);
}

impl Part for Rows<'_> {
    fn len(&self) -> usize {
        self.len()
    }

    fn point(&self, k: usize) -> usize {
        self.point(k)
    }

    fn split_at(self, k: usize) -> (Self, Self) {
        self.split_at(k)
    }
}

impl Part for Vectors<'_> {
    fn len(&self) -> usize {
        self.len()
    }

    fn point(&self, k: usize) -> usize {
        self.point(k)
    }

    fn split_at(self, k: usize) -> (Self, Self) {
        self.split_at(k)
    }
}

struct OverRows<'a, K, const D: usize> {
    kernel: &'a K,
    cloud: Cloud<'a>,
}

/// All lanes belong to one point.
struct Whole;

impl Pick for Whole {
    #[inline(always)]
    fn sum(&self, lanes: Lanes) -> f64 {
        lanes.sum()
    }

    #[inline(always)]
    fn smallest(&self, lanes: Lanes) -> f64 {
        lanes.smallest()
    }
}

impl<'b, K: Kernel<D>, const D: usize> Runner<Rows<'b>> for OverRows<'_, K, D> {
    type Output = K::Output;
    const HOT: bool = K::HOT;

    #[inline(always)]
    fn run<A: Arithmetic>(&self, mut rows: Rows<'b>, base: usize, outputs: &mut [K::Output]) {
        let (kernel, cloud) = (*self.kernel, self.cloud);
        for k in 0..rows.len() {
            let row: Row<'_> = rows.row(k);
            let mut sums = kernel.start();
            // SAFETY: `sweep` has checked that every array is longer than any index of the list.
            let here = unsafe { cloud.here::<K, D>(row.point) };
            for group in 0..row.neighbours.len() {
                // SAFETY: as above.
                let bonds = unsafe { cloud.load::<A, K, D>(&kernel, &here, &row, group) };
                let bits = kernel.add::<A>(&bonds, &mut sums);
                if bits != bonds.intact {
                    row.intact[group] = bits;
                }
            }
            kernel.finish(&sums, &Whole, &mut outputs[row.point - base]);
        }
    }
}

struct OverVectors<'a, K, const D: usize> {
    kernel: &'a K,
    places: &'a Places<D>,
    /// Of the own and the far ends, m³.
    volumes: [Lanes; 2],
    /// For kernels that want them, the bits of all vectors' bonds, broken or not.
    filled: Vec<u8>,
}

/// One lane belongs to one point.
struct Lane(usize);

impl Pick for Lane {
    #[inline(always)]
    fn sum(&self, lanes: Lanes) -> f64 {
        lanes.0[self.0]
    }

    #[inline(always)]
    fn smallest(&self, lanes: Lanes) -> f64 {
        lanes.0[self.0]
    }
}

impl<'b, K: Kernel<D>, const D: usize> Runner<Vectors<'b>> for OverVectors<'_, K, D> {
    type Output = K::Output;
    const HOT: bool = K::HOT;

    #[inline(always)]
    fn run<A: Arithmetic>(&self, mut vectors: Vectors<'b>, base: usize, outputs: &mut [K::Output]) {
        let Self {
            kernel,
            places,
            volumes,
            filled,
        } = self;
        // Copies, which the loop can keep in registers.
        let (kernel, volumes, places) = (**kernel, *volumes, places.view());
        for k in 0..vectors.len() {
            let vector: Adjacent<'_> = vectors.vector(k);
            let filled = filled.get(vector.bits.clone());
            let mut sums = kernel.start();
            // SAFETY: `sweep` has checked that every array covers the grid.
            let here = unsafe { places.here::<K>(vector.place) };
            for o in 0..vector.offsets.len() {
                // SAFETY: as above.
                let mut bonds = unsafe { places.load::<A, K>(&kernel, &here, &vector, o, volumes) };
                if K::FILLED {
                    bonds.filled = filled.map_or(0, |bits| bits[o]);
                }
                let bits = kernel.add::<A>(&bonds, &mut sums);
                if bits != bonds.intact {
                    vector.intact[o] = bits;
                }
            }
            for lane in 0..WIDTH {
                if vector.members >> lane & 1 == 1 {
                    let output = &mut outputs[vector.point + lane - base];
                    kernel.finish(&sums, &Lane(lane), output);
                }
            }
        }
    }
}
