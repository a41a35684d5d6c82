//! What the kernels read of the points, and eight bonds loaded from it.

use crate::material::lanes::WIDTH;
use crate::material::{Bond, End, Lanes, Law};

/// What kernels read of the local points, ghosts included.
#[derive(Clone, Copy)]
pub struct Geometry<'a, const D: usize> {
    /// Reference positions by component, m.
    pub reference: [&'a [f64]; D],
    /// Displacements by component, m.
    pub displacement: [&'a [f64]; D],
    /// Volumes, m³.
    pub volume: &'a [f64],
}

/// What bonds know of the families of their ends, over the local points; empty where no law has it.
#[derive(Clone, Copy)]
pub struct Shared<'a> {
    /// [`Law::constant`] of each point.
    pub constants: &'a [f64],
    /// [`Law::state`] of each point.
    pub states: &'a [f64],
}

/// Eight bonds of one point as the kernels see them.
pub struct Loaded<const D: usize> {
    /// What laws see.
    pub bond: Bond,
    /// ξ by component, m.
    pub reference: [Lanes; D],
    /// What the force is along by component, m: Y, or ξ for linear laws.
    pub along: [Lanes; D],
    /// Its inverse length, 1/m.
    pub inverse_length: Lanes,
    /// Volumes of the neighbours, m³.
    pub volume: Lanes,
}

/// # Safety
/// `values` must be longer than every index.
#[inline(always)]
unsafe fn gather(values: &[f64], indices: &[u32; WIDTH]) -> Lanes {
    let mut lanes = Lanes::splat(0.0);
    for k in 0..WIDTH {
        // SAFETY: passed on to the caller.
        lanes.0[k] = unsafe { *values.get_unchecked(indices[k] as usize) };
    }
    lanes
}

impl<const D: usize> Geometry<'_, D> {
    /// The number of local points that every array covers.
    pub fn points(&self) -> usize {
        let lengths = self.reference.iter().chain(&self.displacement);
        let shortest = lengths.map(|component| component.len()).min();
        shortest.unwrap_or(0).min(self.volume.len())
    }

    /// Loads the bonds of a group. The stretch is (η·(2ξ + η)) / (|ξ| (|Y| + |ξ|)), which loses no
    /// digits when |Y| is close to |ξ|, and is the same to the bit from both ends; `linear` takes
    /// what is linear in η instead.
    ///
    /// # Safety
    /// All arrays must be longer than every index.
    #[inline(always)]
    pub unsafe fn load(&self, point: usize, neighbours: &[u32; WIDTH], linear: bool) -> Loaded<D> {
        let mut reference = [Lanes::splat(0.0); D];
        let mut deformed = [Lanes::splat(0.0); D];
        let mut length_squared = Lanes::splat(0.0);
        let mut deformed_squared = Lanes::splat(0.0);
        let mut growth = Lanes::splat(0.0);
        for d in 0..D {
            let here = self.reference[d][point];
            // SAFETY: passed on to the caller.
            let there = unsafe { gather(self.reference[d], neighbours) };
            let xi = there - Lanes::splat(here);
            let here = self.displacement[d][point];
            // SAFETY: as above.
            let there = unsafe { gather(self.displacement[d], neighbours) };
            let eta = there - Lanes::splat(here);
            let y = xi + eta;
            length_squared += xi * xi;
            deformed_squared += y * y;
            growth += eta * if linear { xi } else { xi + y };
            reference[d] = xi;
            deformed[d] = y;
        }
        // SAFETY: as above.
        let volume = unsafe { gather(self.volume, neighbours) };
        let length = length_squared.sqrt();
        if linear {
            return Loaded {
                bond: Bond {
                    length,
                    stretch: growth / length_squared,
                },
                reference,
                along: reference,
                inverse_length: Lanes::splat(1.0) / length,
                volume,
            };
        }
        let deformed_length = deformed_squared.sqrt();
        let product = length * (deformed_length + length);
        // One division serves both 1/product and 1/|Y|.
        let inverse = Lanes::splat(1.0) / (product * deformed_length);
        Loaded {
            bond: Bond {
                length,
                stretch: growth * deformed_length * inverse,
            },
            reference,
            along: deformed,
            inverse_length: inverse * product,
            volume,
        }
    }
}

impl Shared<'_> {
    /// The number of local points that the arrays a law needs cover.
    pub fn points<L: Law>(&self) -> usize {
        let of = |needed: bool, values: &[f64]| if needed { values.len() } else { usize::MAX };
        of(L::CONSTANT, self.constants).min(of(L::STATE, self.states))
    }

    /// What the own end of a point's bonds knows.
    #[inline(always)]
    pub fn here<L: Law>(&self, point: usize) -> End {
        let of =
            |needed: bool, values: &[f64]| Lanes::splat(if needed { values[point] } else { 0.0 });
        End {
            constant: of(L::CONSTANT, self.constants),
            state: of(L::STATE, self.states),
        }
    }

    /// What the far ends of eight bonds know.
    ///
    /// # Safety
    /// The arrays that the law needs must be longer than every index.
    #[inline(always)]
    pub unsafe fn there<L: Law>(&self, neighbours: &[u32; WIDTH]) -> End {
        let of = |needed: bool, values: &[f64]| match needed {
            // SAFETY: passed on to the caller.
            true => unsafe { gather(values, neighbours) },
            false => Lanes::splat(0.0),
        };
        End {
            constant: of(L::CONSTANT, self.constants),
            state: of(L::STATE, self.states),
        }
    }
}
