//! The kernel that sums over the bonds that break in a step.

use crate::damage::Criterion;
use crate::lanes::{LaneTuple, Lanes, Simd};
use crate::material::bond::Wanted;
use crate::material::{AnyHistory, AnyLaw, AnyPoint, ForceState, Law, PairLaw};

use super::kernel::{Group, Kernel};
use super::measures::wanted;

/// Kernel that sums over breaking bonds. In [`Group::intact`], the caller sets only the bits of these bonds.
/// The sums are:
///
/// - the number of these bonds;
/// - the energy that they release at the point, J;
/// - the point's part of the overshoot energy of these bonds, J;
/// - their forces, N/m³.
///
/// This kernel and its loops are not compiled separately for each law, because few bonds break.
#[derive(Clone, Copy)]
pub struct BreakingBonds {
    /// Laws of points i and j.
    pub laws: [AnyLaw; 2],
    /// Failure criterion of the bonds.
    pub criterion: Criterion,
    /// Whether the weights of the bonds contain only the influence function, without volume correction.
    pub no_volume_correction: bool,
}

impl BreakingBonds {
    /// Return the work of the force states of both ends, J/m⁶; 0 if the criterion does not read the work. The
    /// work equals `Force::work` up to rounding.
    #[inline(always)]
    fn work<S: Simd, const D: usize>(&self, simd: S, group: &Group<'_, Self, D>) -> Lanes {
        if !self.criterion.reads_work() {
            return Lanes::splat(0.0);
        }
        let weights = group.weights_of_work(simd, self.no_volume_correction);
        group.work_of_ends(simd, &self.laws, weights)
    }
}

impl<const D: usize> Kernel<D> for BreakingBonds {
    type Sums = ([Lanes; 3], [Lanes; D]);
    type Point = AnyPoint;
    type PointJ = AnyPoint;
    type BondHistory = AnyHistory;
    type Rotation = [Lanes; 4];
    const READS_STRESSES: bool = true;
    const ANY_LAW: bool = true;
    const WANTED: Wanted = wanted(false);

    fn is_linear(&self) -> bool {
        self.laws[0].is_linear::<D>()
    }

    #[inline(always)]
    fn criterion(&self) -> Criterion {
        self.criterion
    }

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut Self::Sums) {
        let (counts, lost) = sums;
        let (breaking, points) = (group.intact, group.points());
        let bond = group.bond.with_stretch(Kernel::<D>::is_linear(self));
        let work = self.work(simd, group);
        let share = group.weights.at_i() * group.volume_i * group.volume_j;
        let energy = self.laws[0].bond_energy(&bond, group.numbers_i, &group.history[0]) * share;
        let scale = PairLaw::new(self.laws[0], self.laws[1]).toughness_scale(&bond, points);
        let late = (self.criterion).overshoot(simd, &bond, group.ends(), scale, work);
        let overshoot = if self.criterion.reads_work() {
            // The work of a bond is divided equally between the ends whose force states act.
            let [own, far] = group.weights.acting();
            let half = simd.keep(Lanes::splat(0.5), own & far);
            let part = simd.select(half, own & far, simd.keep(Lanes::splat(1.0), own));
            work * part * share * late
        } else {
            energy * late
        };
        counts[0] += simd.keep(Lanes::splat(1.0), breaking);
        counts[1] += simd.keep(energy, breaking);
        counts[2] += simd.keep(overshoot, breaking);
        let total = AnyLaw::bond_force(
            simd,
            &self.laws,
            &bond,
            points,
            &group.history,
            group.weights,
        );
        total.add(simd, &bond, group.force_volume, breaking, lost);
    }
}

/// Sums over the bonds of a point that break in a sweep.
#[derive(Debug, Clone, Copy)]
pub struct BrokenSums {
    /// Local index of the point.
    pub point: usize,
    /// The sums of [`BreakingBonds`]; 0 for components beyond the dimension.
    pub sums: [f64; MAX_BROKEN_SUMS],
}

/// Number of sums of [`BreakingBonds`] in three dimensions.
pub const MAX_BROKEN_SUMS: usize = 6;

/// The breaking bonds of one row or lane group. Each group of eight bonds that contains breaking bonds has
/// one entry: the index of the group, and one bit per bond. The bit is 1 if the bond breaks.
pub type BreakingBits = Vec<(usize, u8)>;

/// Note the breaking bonds of a group. Out of line to save registers.
#[cold]
#[inline(never)]
pub fn note_group(noted: &mut BreakingBits, group: usize, bits: u8) {
    noted.push((group, bits));
}

/// Return the sums of [`BreakingBonds`] in `D` dimensions, padded with zeros to [`MAX_BROKEN_SUMS`] entries.
#[inline(always)]
pub fn padded<const D: usize>(
    sums: &<BreakingBonds as Kernel<D>>::Sums,
) -> [Lanes; MAX_BROKEN_SUMS] {
    LaneTuple::each(|k| {
        if k < <BreakingBonds as Kernel<D>>::Sums::COUNT {
            sums.get(k)
        } else {
            Lanes::splat(0.0)
        }
    })
}
