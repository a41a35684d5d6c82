//! What is summed over a family: bond forces, energies, stiffnesses, the smallest stretch.
//!
//! A kernel sees one row at a time and adds to the point's outputs. It is written once for any
//! dimension, law and failure rule; the bonds of a row are evaluated eight at a time.

use crate::families::Row;
use crate::material::lanes::WIDTH;
use crate::material::{Bond, BondLaw, Lanes};

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

/// Something that is summed over rows.
pub trait Kernel: Sync {
    /// What is summed for each point.
    type Output: Send;

    /// The number of local points that it can read.
    fn points(&self) -> usize;

    /// Adds a row's share to its point's output.
    fn row(&self, row: Row<'_>, output: &mut Self::Output);
}

/// Eight bonds of one point as the kernels see them.
struct Loaded<const D: usize> {
    bond: Bond,
    /// ξ by component, m.
    reference: [Lanes; D],
    /// Y by component, m.
    deformed: [Lanes; D],
    /// 1/|Y|, 1/m.
    inverse_length: Lanes,
    /// Volumes of the neighbours, m³.
    volume: Lanes,
}

impl<const D: usize> Geometry<'_, D> {
    /// The number of local points that every array covers.
    pub fn points(&self) -> usize {
        let lengths = self.reference.iter().chain(&self.displacement);
        let shortest = lengths.map(|component| component.len()).min();
        shortest.unwrap_or(0).min(self.volume.len())
    }

    #[inline(always)]
    fn gather(values: &[f64], indices: &[u32; WIDTH]) -> Lanes {
        let mut lanes = Lanes::splat(0.0);
        for k in 0..WIDTH {
            // SAFETY: `sweep` has checked that every array is longer than any index of the list.
            lanes.0[k] = unsafe { *values.get_unchecked(indices[k] as usize) };
        }
        lanes
    }

    /// Loads the bonds of a group. The stretch is (η·(2ξ + η)) / (|ξ| (|Y| + |ξ|)), which loses no
    /// digits when |Y| is close to |ξ|, and is the same to the bit from both ends.
    #[inline(always)]
    fn load(&self, point: usize, neighbours: &[u32; WIDTH]) -> Loaded<D> {
        let mut reference = [Lanes::splat(0.0); D];
        let mut deformed = [Lanes::splat(0.0); D];
        let mut length_squared = Lanes::splat(0.0);
        let mut deformed_squared = Lanes::splat(0.0);
        let mut growth = Lanes::splat(0.0);
        for d in 0..D {
            let here = self.reference[d][point];
            let xi = Self::gather(self.reference[d], neighbours) - Lanes::splat(here);
            let here = self.displacement[d][point];
            let eta = Self::gather(self.displacement[d], neighbours) - Lanes::splat(here);
            let y = xi + eta;
            length_squared += xi * xi;
            deformed_squared += y * y;
            growth += eta * (xi + y);
            reference[d] = xi;
            deformed[d] = y;
        }
        let length = length_squared.sqrt();
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
            deformed,
            inverse_length: inverse * product,
            volume: Self::gather(self.volume, neighbours),
        }
    }
}

/// When a bond breaks.
pub trait Failure: Copy + Sync {
    /// Whether it can happen at all.
    const POSSIBLE: bool;

    /// A bit for each bond that breaks at this stretch.
    fn breaks(&self, point: usize, neighbours: &[u32; WIDTH], stretch: Lanes) -> u8;
}

/// Bonds never break.
#[derive(Clone, Copy)]
pub struct NoFailure;

/// One critical stretch for all bonds.
#[derive(Clone, Copy)]
pub struct Uniform(pub f64);

/// A threshold for each local point; a bond takes the smaller of its ends'.
#[derive(Clone, Copy)]
pub struct PerPoint<'a>(pub &'a [f64]);

impl Failure for NoFailure {
    const POSSIBLE: bool = false;

    #[inline(always)]
    fn breaks(&self, _: usize, _: &[u32; WIDTH], _: Lanes) -> u8 {
        0
    }
}

impl Failure for Uniform {
    const POSSIBLE: bool = true;

    #[inline(always)]
    fn breaks(&self, _: usize, _: &[u32; WIDTH], stretch: Lanes) -> u8 {
        stretch.at_least(Lanes::splat(self.0))
    }
}

impl Failure for PerPoint<'_> {
    const POSSIBLE: bool = true;

    #[inline(always)]
    fn breaks(&self, point: usize, neighbours: &[u32; WIDTH], stretch: Lanes) -> u8 {
        let mut threshold = Lanes::splat(self.0[point]);
        for (value, index) in threshold.0.iter_mut().zip(neighbours) {
            *value = value.min(self.0[*index as usize]);
        }
        stretch.at_least(threshold)
    }
}

/// What the bonds of a point do to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response<const D: usize> {
    /// Force density by component, N/m³.
    pub force: [f64; D],
    /// Energy that the point's halves of bonds have set free by breaking so far, J.
    pub set_free: f64,
}

impl<const D: usize> Default for Response<D> {
    fn default() -> Self {
        Self {
            force: [0.0; D],
            set_free: 0.0,
        }
    }
}

/// Breaks bonds and sums their forces.
pub struct Force<'a, L, F, const D: usize> {
    /// The points.
    pub geometry: Geometry<'a, D>,
    /// The law of the list's bonds.
    pub law: L,
    /// The failure rule.
    pub failure: F,
}

impl<L: BondLaw, F: Failure, const D: usize> Kernel for Force<'_, L, F, D> {
    type Output = Response<D>;

    fn points(&self) -> usize {
        self.geometry.points()
    }

    #[inline(always)]
    fn row(&self, row: Row<'_>, output: &mut Response<D>) {
        let mut force = [Lanes::splat(0.0); D];
        for (group, neighbours) in row.neighbours.iter().enumerate() {
            let loaded = self.geometry.load(row.point, neighbours);
            let mut bits = row.intact[group];
            if F::POSSIBLE {
                let stretch = loaded.bond.stretch;
                let mut broken = bits & self.failure.breaks(row.point, neighbours, stretch);
                if broken != 0 {
                    broken &= row.breakable.map_or(u8::MAX, |breakable| breakable[group]);
                    let energy = self.law.energy(&loaded.bond) * loaded.volume;
                    let half = 0.5 * self.geometry.volume[row.point];
                    output.set_free += half * energy.select(broken, 0.0).sum();
                    bits &= !broken;
                    row.intact[group] = bits;
                }
            }
            let strength = self.law.force(&loaded.bond) * loaded.volume * loaded.inverse_length;
            let strength = strength.select(bits, 0.0);
            for d in 0..D {
                force[d] += strength * loaded.deformed[d];
            }
        }
        for d in 0..D {
            output.force[d] += force[d].sum();
        }
    }
}

/// The smallest stretch s_min of the intact bonds; outputs start at +∞.
pub struct SmallestStretch<'a, const D: usize> {
    /// The points.
    pub geometry: Geometry<'a, D>,
}

impl<const D: usize> Kernel for SmallestStretch<'_, D> {
    type Output = f64;

    fn points(&self) -> usize {
        self.geometry.points()
    }

    #[inline(always)]
    fn row(&self, row: Row<'_>, output: &mut f64) {
        let mut smallest = Lanes::splat(f64::INFINITY);
        for (neighbours, bits) in row.neighbours.iter().zip(row.intact.iter()) {
            let loaded = self.geometry.load(row.point, neighbours);
            smallest = loaded
                .bond
                .stretch
                .select(*bits, f64::INFINITY)
                .min(smallest);
        }
        *output = output.min(smallest.smallest());
    }
}

/// What the intact bonds of a point hold.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stored {
    /// Strain energy density W = ½ Σ w V, J/m³.
    pub energy: f64,
    /// Volume of the neighbours, m³.
    pub volume: f64,
    /// Number of neighbours.
    pub neighbours: u32,
}

/// Sums up what the intact bonds hold.
pub struct Energy<'a, L, const D: usize> {
    /// The points.
    pub geometry: Geometry<'a, D>,
    /// The law of the list's bonds.
    pub law: L,
}

impl<L: BondLaw, const D: usize> Kernel for Energy<'_, L, D> {
    type Output = Stored;

    fn points(&self) -> usize {
        self.geometry.points()
    }

    #[inline(always)]
    fn row(&self, row: Row<'_>, output: &mut Stored) {
        let mut energy = Lanes::splat(0.0);
        let mut volume = Lanes::splat(0.0);
        for (neighbours, bits) in row.neighbours.iter().zip(row.intact.iter()) {
            let loaded = self.geometry.load(row.point, neighbours);
            energy += (self.law.energy(&loaded.bond) * loaded.volume).select(*bits, 0.0);
            volume += loaded.volume.select(*bits, 0.0);
            output.neighbours += bits.count_ones();
        }
        output.energy += 0.5 * energy.sum();
        output.volume += volume.sum();
    }
}

/// Sums D = Σ V C n⊗n over the intact bonds, undeformed (N/m⁴), as xx, yy, zz, xy, xz, yz.
pub struct Stiffness<'a, L, const D: usize> {
    /// The points.
    pub geometry: Geometry<'a, D>,
    /// The law of the list's bonds.
    pub law: L,
}

impl<L: BondLaw, const D: usize> Kernel for Stiffness<'_, L, D> {
    type Output = [f64; 6];

    fn points(&self) -> usize {
        self.geometry.points()
    }

    #[inline(always)]
    fn row(&self, row: Row<'_>, output: &mut [f64; 6]) {
        for (neighbours, bits) in row.neighbours.iter().zip(row.intact.iter()) {
            let loaded = self.geometry.load(row.point, neighbours);
            let length = loaded.bond.length;
            let weight = self.law.stiffness(length) * loaded.volume / (length * length);
            let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
            for (sum, (a, b)) in output.iter_mut().zip(pairs) {
                if a < D && b < D {
                    let entry = weight * loaded.reference[a] * loaded.reference[b];
                    *sum += entry.select(*bits, 0.0).sum();
                }
            }
        }
    }
}
