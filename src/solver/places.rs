//! What kernels read of the local points of a grid, in the order of their places: eight adjacent
//! points at once.

use std::sync::Arc;

use crate::families::{Adjacent, Grid, Offset, Which};
use crate::material::lanes::WIDTH;
use crate::material::{Arithmetic, End, Lanes};

use super::geometry::{Loaded, Reference, Weights, deform};
use super::kernels::Kernel;

/// Values of the points of a grid by place. Empty arrays are not read; entries of holes mean nothing,
/// but are finite.
pub struct Places<const D: usize> {
    grid: Arc<Grid>,
    displacement: [Vec<f64>; D],
    constants: Vec<f64>,
    states: Vec<f64>,
    thresholds: Vec<f64>,
}

/// The arrays of [`Places`], to be kept at hand in a loop.
#[derive(Clone, Copy)]
pub struct View<'a, const D: usize> {
    displacement: [&'a [f64]; D],
    constants: &'a [f64],
    states: &'a [f64],
    thresholds: &'a [f64],
}

/// What is read of the own ends of bonds.
#[derive(Clone, Copy)]
pub struct Here<const D: usize> {
    displacement: [Lanes; D],
    end: End,
    threshold: Lanes,
}

/// # Safety
/// `values` must have eight entries from `first` on.
#[inline(always)]
unsafe fn eight(needed: bool, values: &[f64], first: usize) -> Lanes {
    match needed {
        // SAFETY: passed on to the caller.
        true => Lanes(unsafe { values.as_ptr().add(first).cast::<[f64; WIDTH]>().read() }),
        false => Lanes::splat(0.0),
    }
}

impl<const D: usize> Places<D> {
    /// For a grid, at rest.
    pub fn new(grid: Arc<Grid>) -> Self {
        let count = grid.places();
        Self {
            grid,
            displacement: std::array::from_fn(|_| vec![0.0; count]),
            constants: Vec::new(),
            states: Vec::new(),
            thresholds: Vec::new(),
        }
    }

    /// Takes the displacements of some of the local points.
    pub fn bring_displacement(&mut self, which: Which, displacement: &[Vec<f64>; D]) {
        for (places, values) in self.displacement.iter_mut().zip(displacement) {
            self.grid.bring(which, values, places);
        }
    }

    /// Takes the constants of all local points.
    pub fn bring_constants(&mut self, values: &[f64]) {
        bring(&self.grid, Which::All, values, &mut self.constants);
    }

    /// Takes the states of some of the local points.
    pub fn bring_states(&mut self, which: Which, values: &[f64]) {
        bring(&self.grid, which, values, &mut self.states);
    }

    /// Takes the thresholds of some of the local points.
    pub fn bring_thresholds(&mut self, which: Which, values: &[f64]) {
        bring(&self.grid, which, values, &mut self.thresholds);
    }

    /// Memory, that of the grid included, bytes.
    pub fn bytes(&self) -> usize {
        let count: usize = self.displacement.iter().map(Vec::len).sum();
        let others = self.constants.len() + self.states.len() + self.thresholds.len();
        8 * (count + others) + self.grid.bytes()
    }

    /// # Panics
    /// When an array that the kernel reads has fewer than `count` entries.
    pub fn assert_covers<K: Kernel<D>>(&self, count: usize) {
        let enough = |needed: bool, length: usize| !needed || length >= count;
        assert!(
            self.displacement.iter().all(|values| values.len() >= count)
                && enough(K::CONSTANT, self.constants.len())
                && enough(K::STATE, self.states.len())
                && enough(K::THRESHOLD, self.thresholds.len()),
            "an array is too short for the grid"
        );
    }

    /// The arrays.
    pub fn view(&self) -> View<'_, D> {
        View {
            displacement: self.displacement.each_ref().map(Vec::as_slice),
            constants: &self.constants,
            states: &self.states,
            thresholds: &self.thresholds,
        }
    }
}

impl<const D: usize> View<'_, D> {
    /// The own ends of the bonds of eight points from a place on.
    ///
    /// # Safety
    /// All arrays that the kernel reads must cover the grid.
    #[inline(always)]
    pub unsafe fn here<K: Kernel<D>>(&self, place: usize) -> Here<D> {
        // SAFETY: passed on to the caller.
        let of = |needed, values: &[f64]| unsafe { eight(needed, values, place) };
        Here {
            displacement: std::array::from_fn(|d| of(true, self.displacement[d])),
            end: End {
                constant: of(K::CONSTANT, self.constants),
                state: of(K::STATE, self.states),
            },
            threshold: of(K::THRESHOLD, self.thresholds),
        }
    }

    /// The bonds of a vector at one offset; `volumes` are those of the own and the far ends.
    ///
    /// # Safety
    /// As for [`Self::here`].
    #[inline(always)]
    pub unsafe fn load<A: Arithmetic, K: Kernel<D>>(
        &self,
        kernel: &K,
        here: &Here<D>,
        vector: &Adjacent<'_>,
        o: usize,
        volumes: [Lanes; 2],
    ) -> Loaded<D> {
        let offset: &Offset = &vector.offsets[o];
        let far = vector.far(offset);
        // SAFETY: passed on to the caller; `far` is a place with seven more after it.
        let of = |needed, values: &[f64]| unsafe { eight(needed, values, far) };
        let eta = std::array::from_fn(|d| of(true, self.displacement[d]) - here.displacement[d]);
        let reference = Reference {
            along: std::array::from_fn(|d| Lanes::splat(offset.reference[d])),
            square: Lanes::splat(offset.square),
            length: Lanes::splat(offset.length),
            inverse: Lanes::splat(offset.inverse),
            inverse_square: Lanes::splat(offset.inverse_square),
        };
        let deformed = deform::<A, D>(&reference, eta, kernel.linear());
        let there = End {
            constant: of(K::CONSTANT, self.constants),
            state: of(K::STATE, self.states),
        };
        Loaded {
            bond: deformed.bond,
            reference: reference.along,
            along: deformed.along,
            inverse_length: deformed.inverse_length,
            own_volume: volumes[0],
            volume: volumes[1],
            weights: match vector.weighted {
                [false, _] => Weights::One,
                [true, false] => Weights::Same(Lanes::splat(offset.weights[0])),
                [true, true] => Weights::Each(offset.weights.map(Lanes::splat)),
            },
            ends: [here.end, there],
            thresholds: [here.threshold, of(K::THRESHOLD, self.thresholds)],
            intact: vector.intact[o],
            filled: 0,
            breakable: vector.breakable.map_or(u8::MAX, |bits| bits[o]),
        }
    }
}

/// Copies values to their places, of which there are none yet at first.
fn bring(grid: &Grid, which: Which, values: &[f64], places: &mut Vec<f64>) {
    places.resize(grid.places(), 0.0);
    grid.bring(which, values, places);
}
