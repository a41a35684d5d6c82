//! Data of the points of a grid, for kernels. The data are ordered by slot, so that a kernel loads the data
//! of eight adjacent points at once.

use std::marker::PhantomData;
use std::sync::Arc;

use crate::damage::Limits;
use crate::families::{Grid, Offset, VectorBonds, Which};
use crate::lanes::lane_tuple::eight;
use crate::lanes::{Column, LaneTuple, Lanes, Simd};
use crate::material::bond::{Elastic, Reference, SeparateThermal, Weights, deform};

use super::kernel::{Group, Kernel};
use super::limit_columns::{LimitColumns, LimitsRead, ReadLimits, ReadRotations};
use super::list_points::load_history;

/// Values of the points of a grid by slot. Arrays that no kernel reads are empty. Entries of holes keep their
/// initial values, and have no meaning.
pub struct GridValues<const D: usize> {
    grid: Arc<Grid>,
    displacement: [Column; D],
    /// Thermal stretches by slot; empty in runs without temperatures.
    thermal_stretch: Column,
    /// The values per point that laws compute and bonds read (`PointNumbers`), by slot.
    numbers: Vec<Column>,
    limits: LimitColumns,
}

impl<const D: usize> GridValues<D> {
    /// Create the values of a grid with zero displacements. `numbers` is the count of the point numbers that
    /// bonds read. Bonds also read the limits in `limits`, and thermal stretches if `is_thermal` is true.
    pub fn new(grid: Arc<Grid>, numbers: usize, limits: LimitsRead, is_thermal: bool) -> Self {
        let count = grid.slots();
        let of_temperature = if is_thermal { count } else { 0 };
        Self {
            thermal_stretch: Column::new(D + numbers, of_temperature, 0.0),
            displacement: std::array::from_fn(|d| Column::new(d, count, 0.0)),
            numbers: (0..numbers)
                .map(|k| Column::new(D + k, count, 0.0))
                .collect(),
            limits: LimitColumns::new::<D>(limits, D + numbers, count),
            grid,
        }
    }

    /// Test whether `self` holds the values of `grid`.
    pub fn is_of(&self, grid: &Arc<Grid>) -> bool {
        Arc::ptr_eq(&self.grid, grid)
    }

    /// Copy the displacements of the ghosts to their slots. If the run has temperatures, also copy the
    /// thermal stretches of the ghosts.
    pub fn update_ghosts(&mut self, displacement: &[Vec<f64>; D], thermal_stretch: Option<&[f64]>) {
        for (places, values) in self.displacement.iter_mut().zip(displacement) {
            self.grid.update(Which::Ghosts, values, places);
        }
        if let Some(values) = thermal_stretch {
            self.grid
                .update(Which::Ghosts, values, &mut self.thermal_stretch);
        }
    }

    /// Return write access to the displacements and thermal stretches of the owned points.
    pub fn owned_places(&mut self) -> OwnedPlaces<'_, D> {
        OwnedPlaces {
            grid: &self.grid,
            columns: (self.displacement.each_mut()).map(|column| column.as_mut_ptr()),
            thermal_stretch: (!self.thermal_stretch.is_empty())
                .then(|| self.thermal_stretch.as_mut_ptr()),
            values: PhantomData,
        }
    }

    /// Copy the columns of the point numbers, from column `first` on, to the slots of the selected points.
    pub fn update_numbers(&mut self, which: Which, first: usize, numbers: &[Column]) {
        for (places, values) in self.numbers.iter_mut().zip(numbers).skip(first) {
            self.grid.update(which, values, places);
        }
    }

    /// Insert columns in front of the columns of the point numbers. `columns` contain the values of the local
    /// points.
    pub fn insert_numbers(&mut self, columns: &[Column]) {
        let by_slot = |values: &Column| {
            let mut places = Column::new(0, self.grid.slots(), 0.0);
            self.grid.update(Which::All, values, &mut places);
            places
        };
        let columns: Vec<Column> = columns.iter().map(by_slot).collect();
        self.numbers.splice(0..0, columns);
    }

    /// Remove the first `count` columns of the numbers that laws compute for each point.
    pub fn remove_numbers(&mut self, count: usize) {
        self.numbers.drain(..count);
    }

    /// Copy the thresholds of the selected local points to their slots.
    pub fn update_thresholds(&mut self, which: Which, values: &[f64]) {
        self.grid.update(which, values, &mut self.limits.thresholds);
    }

    /// Copy the rotations of the selected local points to their slots.
    pub fn update_rotations(&mut self, which: Which, rotations: &[Column; 4]) {
        for (places, values) in self.limits.rotations.iter_mut().zip(rotations) {
            if !values.is_empty() {
                self.grid.update(which, values, places);
            }
        }
    }

    /// Copy the stress measures of the selected local points to their slots.
    pub fn update_stresses(&mut self, which: Which, stresses: &[Column]) {
        for (places, values) in self.limits.stresses.iter_mut().zip(stresses) {
            if !values.is_empty() {
                self.grid.update(which, values, places);
            }
        }
    }

    /// Copy the truncation factors of all local points to their slots.
    pub fn update_truncation_factors(&mut self, values: &[f64]) {
        let places = &mut self.limits.truncation_factors;
        self.grid.update(Which::All, values, places);
    }

    /// Memory, including the grid, bytes.
    pub fn bytes(&self) -> usize {
        let columns = self.displacement.iter().chain(&self.numbers);
        let columns = columns.chain([&self.thermal_stretch]);
        let count: usize = columns.map(|column| column.len()).sum();
        size_of::<f64>() * count + self.limits.bytes() + self.grid.bytes()
    }
}

/// Write access of several threads to the displacements and thermal stretches of a grid's owned points.
pub struct OwnedPlaces<'a, const D: usize> {
    grid: &'a Grid,
    columns: [*mut f64; D],
    thermal_stretch: Option<*mut f64>,
    values: PhantomData<&'a mut f64>,
}

// SAFETY: threads write to the columns only under the conditions of `copy_from`.
unsafe impl<const D: usize> Sync for OwnedPlaces<'_, D> {}
// SAFETY: threads write to the columns only under the conditions of `copy_from`.
unsafe impl<const D: usize> Send for OwnedPlaces<'_, D> {}

impl<const D: usize> OwnedPlaces<'_, D> {
    /// Copy the displacements of consecutive owned points to their slots. `first` is the local index of the
    /// first of these points. Also copy their thermal stretches if the run has temperatures.
    ///
    /// # Safety
    /// No other thread may write any of these points at the same time.
    pub unsafe fn copy_from(
        &self,
        first: usize,
        displacement: [&[f64]; D],
        thermal_stretch: Option<&[f64]>,
    ) {
        let count = displacement[0].len();
        let thermal = self.thermal_stretch.zip(thermal_stretch);
        for (place, points) in self.grid.slots_of(first..first + count) {
            let copy = |entries: *mut f64, values: &[f64]| {
                let values = &values[points.start - first..points.end - first];
                // SAFETY: these are slots of the grid, and every column has an entry for each slot. No two
                // points have the same slot.
                unsafe {
                    let entries = entries.add(place);
                    entries.copy_from_nonoverlapping(values.as_ptr(), values.len());
                }
            };
            for d in 0..D {
                copy(self.columns[d], displacement[d]);
            }
            if let Some((entries, values)) = thermal {
                copy(entries, values);
            }
        }
    }
}

/// The points of a grid in the form that a kernel reads.
pub struct GridPoints<'a, K: Kernel<D>, const D: usize> {
    displacement: [&'a [f64]; D],
    /// Thermal stretches of the points; `None` if the run has no temperatures, or if the kernel does not
    /// remove thermal stretches from the bonds.
    thermal_stretch: Option<&'a [f64]>,
    numbers: <K::Point as LaneTuple>::Columns<'a>,
    limits: ReadLimits<'a>,
    rotations: ReadRotations<'a, K::Rotation>,
    limit: f64,
    is_linear: bool,
    /// Volumes of points i and of points j, m³.
    volumes: [Lanes; 2],
}

impl<K: Kernel<D>, const D: usize> Clone for GridPoints<'_, K, D> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<K: Kernel<D>, const D: usize> Copy for GridPoints<'_, K, D> {}

/// Data of eight adjacent points i.
#[derive(Clone, Copy)]
pub struct PointI<P, R, const D: usize> {
    displacement: [Lanes; D],
    thermal_stretch: Lanes,
    numbers: P,
    limits: Limits,
    rotation: R,
}

impl<'a, K: Kernel<D>, const D: usize> GridPoints<'a, K, D> {
    /// Prepare a grid for a kernel. `volumes` are the volumes (m³) of points i and j.
    ///
    /// # Panics
    /// If an array that the kernel reads does not cover the grid.
    pub fn new(kernel: &K, values: &'a GridValues<D>, volumes: [f64; 2]) -> Self {
        let numbers = K::Point::columns(&values.numbers);
        let slots = values.grid.slots();
        assert!(
            (values.displacement.iter()).all(|column| column.len() >= slots)
                && (values.thermal_stretch.is_empty() || values.thermal_stretch.len() >= slots)
                && K::Point::covers(&numbers, slots),
            "an array is too short for the grid"
        );
        let is_thermal = kernel.is_elastic() && !values.thermal_stretch.is_empty();
        Self {
            thermal_stretch: is_thermal.then_some(&values.thermal_stretch[..]),
            displacement: values.displacement.each_ref().map(|column| &column[..]),
            numbers,
            limits: ReadLimits::new(kernel.criterion(), &values.limits, slots),
            rotations: ReadRotations::new::<D>(kernel.criterion(), &values.limits, slots),
            limit: kernel.criterion().limit(),
            is_linear: kernel.is_linear(),
            volumes: volumes.map(Lanes::splat),
        }
    }

    /// # Safety
    /// `place` and the seven following slots must be in the grid.
    #[inline(always)]
    unsafe fn numbers(&self, place: usize) -> K::Point {
        // SAFETY: `new` has checked the length.
        K::Point::load(&self.numbers, |column| unsafe { eight(column, place) })
    }

    /// Whether the kernel removes thermal stretches from the bonds.
    #[inline(always)]
    pub fn is_thermal(&self) -> bool {
        self.thermal_stretch.is_some()
    }

    /// # Safety
    /// Same as for [`Self::numbers`].
    #[inline(always)]
    unsafe fn thermal_stretch(&self, place: usize) -> Lanes {
        match self.thermal_stretch {
            // SAFETY: `new` has checked the length.
            Some(column) => unsafe { eight(column, place) },
            None => Lanes::splat(0.0),
        }
    }

    /// # Safety
    /// Same as for [`Self::numbers`].
    #[inline(always)]
    unsafe fn numbers_j(&self, place: usize) -> K::PointJ {
        // SAFETY: `new` has checked the length.
        K::PointJ::load_first::<K::Point>(&self.numbers, |column| unsafe { eight(column, place) })
    }

    /// # Safety
    /// Same as for [`Self::numbers`].
    #[inline(always)]
    unsafe fn limits<const FAST_PATH: bool>(&self, place: usize) -> Limits {
        if FAST_PATH {
            return Limits::unread();
        }
        // SAFETY: `ReadLimits::new` has checked the lengths.
        (self.limits).eight(K::READS_STRESSES, |column| unsafe { eight(column, place) })
    }

    /// # Safety
    /// Same as for [`Self::numbers`].
    #[inline(always)]
    unsafe fn rotations<const FAST_PATH: bool>(&self, place: usize) -> K::Rotation {
        if FAST_PATH {
            return K::Rotation::splat(0.0);
        }
        // SAFETY: `ReadRotations::new` has checked the lengths.
        (self.rotations).eight::<D>(|column| unsafe { eight(column, place) })
    }

    /// Load eight adjacent points i, starting at a slot.
    ///
    /// # Safety
    /// `place` must be the slot of the first point of a lane group of the grid.
    #[inline(always)]
    pub unsafe fn load_point_i(&self, place: usize) -> PointI<K::Point, K::Rotation, D> {
        // SAFETY: `new` has checked the lengths.
        unsafe {
            PointI {
                displacement: LaneTuple::each(|d| eight(self.displacement[d], place)),
                thermal_stretch: self.thermal_stretch(place),
                numbers: self.numbers(place),
                limits: self.limits::<false>(place),
                rotation: self.rotations::<false>(place),
            }
        }
    }

    /// Load the bonds of a lane group at the offset with index `o`. With `FAST_PATH`, the data of the
    /// criterion, the breakable bits and the thermal stretches are not loaded. In addition, the closed forms
    /// for |x| above [`NEAR`](crate::material::bond::NEAR) are not computed. [`crate::material::bond`]
    /// defines x and the closed forms.
    ///
    /// # Safety
    /// The lane group must belong to the grid, and `o` must be the index of an offset of the lattice.
    #[inline(always)]
    pub unsafe fn load<'h, S: Simd, const FAST_PATH: bool>(
        &self,
        simd: S,
        here: &'h PointI<K::Point, K::Rotation, D>,
        vector: &mut VectorBonds<'_>,
        o: usize,
    ) -> Group<'h, K, D> {
        let offset: &Offset = &vector.offsets[o];
        // SAFETY: the offset belongs to the lane group, so `far` and the seven following slots are in the
        // grid.
        let (displacement, numbers, limits, rotation) = unsafe {
            let far = vector.far(offset);
            let component = |d| eight(self.displacement[d], far);
            let displacement: [Lanes; D] = LaneTuple::each(component);
            (
                displacement,
                self.numbers_j(far),
                self.limits::<FAST_PATH>(far),
                self.rotations::<FAST_PATH>(far),
            )
        };
        let mut eta: [Lanes; D] =
            LaneTuple::each(|d: usize| displacement[d] - here.displacement[d]);
        let xi = LaneTuple::each(|d| Lanes::splat(offset.reference[d]));
        let mut force_volume = self.volumes[1];
        if !FAST_PATH && self.is_thermal() {
            // SAFETY: `far` and the seven following slots are in the grid, see above.
            let stretch_j = unsafe { self.thermal_stretch(vector.far(offset)) };
            let stretches = [here.thermal_stretch, stretch_j];
            let elastic: Elastic<D> = simd.aside(SeparateThermal { xi, eta, stretches });
            eta = elastic.eta;
            force_volume = force_volume * elastic.slope;
        }
        let reference = Reference {
            xi,
            length: Lanes::splat(offset.length),
            inverse: Lanes::splat(offset.inverse),
            inverse_square: Lanes::splat(offset.inverse_square),
        };
        let intact = vector.groups.intact[o];
        Group {
            bond: deform::<_, FAST_PATH, D>(
                simd,
                &reference,
                eta,
                intact,
                self.limit,
                K::wanted(self.is_linear),
            ),
            volume_i: self.volumes[0],
            volume_j: self.volumes[1],
            force_volume,
            weights: match vector.weighted {
                [false, _] => Weights::One,
                [true, false] => Weights::Same(Lanes::splat(offset.weights[0])),
                [true, true] => {
                    let [own, far] = offset.weights;
                    Weights::Each([Lanes::splat(own), Lanes::splat(far)])
                }
            },
            numbers_i: &here.numbers,
            numbers_j: numbers,
            limits_i: &here.limits,
            limits_j: limits,
            rotation_i: &here.rotation,
            rotation_j: rotation,
            history: load_history::<K::BondHistory>(&mut vector.groups, o),
            intact,
            whole: 0,
            breakable: match vector.groups.breakable {
                Some(bits) if !FAST_PATH => bits[o],
                _ => u8::MAX,
            },
        }
    }
}
