//! The kernel that sums bond forces and breaks the bonds that meet their criterion.

use crate::damage::Criterion;
use crate::lanes::{IsaSet, LaneTuple, Lanes, Simd};
use crate::material::bond::{Wanted, Weights};
use crate::material::{ForceState, Law};

use super::kernel::{Group, Kernel};

/// Changes of bond state in a force evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BondUpdate {
    /// Bonds break, and the bond history advances to the end of a step of this length (s).
    Step(f64),
    /// Forces follow from the bond history at the end of a step of this length (s). The history is not
    /// stored, and no bond breaks.
    Trial(f64),
    /// Neither history nor bonds change.
    None,
}

impl BondUpdate {
    /// Time increment of the bond history, s; `None` if the history does not advance.
    #[inline(always)]
    pub fn history_step(self) -> Option<f64> {
        match self {
            Self::Step(step) | Self::Trial(step) => Some(step),
            Self::None => None,
        }
    }

    /// Whether changes of the bond state are stored.
    #[inline(always)]
    pub fn is_stored(self) -> bool {
        matches!(self, Self::Step(_))
    }
}

/// Kernel that sums the forces of the intact bonds: force density by component, N/m³.
///
/// Bonds that break in this sweep are excluded.
#[derive(Clone, Copy)]
pub struct Force<L> {
    /// Laws of points i and j.
    pub laws: [L; 2],
    /// Failure criterion of the bonds.
    pub criterion: Criterion,
    /// Whether the weights of the bonds contain only the influence function, without volume correction.
    pub no_volume_correction: bool,
    /// How this sweep changes the bond state.
    pub bond_update: BondUpdate,
}

impl<L> Force<L> {
    /// Return the weighted difference T_i⟨ξ⟩ − T_j⟨−ξ⟩ of the force states of each bond, see
    /// [`Law::bond_force`].
    #[inline(always)]
    fn weighted<S: Simd, const D: usize>(
        &self,
        simd: S,
        group: &Group<'_, Self, D>,
        weights: Weights,
    ) -> L::Force
    where
        L: Law<D>,
    {
        let (laws, points) = (&self.laws, group.points());
        L::bond_force(simd, laws, &group.bond, points, &group.history, weights)
    }

    /// Return the work of the force states of each bond, J/m⁶. `total` is the result of [`Self::weighted`].
    /// The work is computed without volume correction, see [`Group::weights_of_work`]. If the force state of
    /// a point does not act on the bond (see [`Weights::acting`]), this force state does no work. The result
    /// is 0 if the criterion does not read the work.
    #[inline(always)]
    fn work<S: Simd, const D: usize>(
        &self,
        simd: S,
        group: &Group<'_, Self, D>,
        total: L::Force,
    ) -> Lanes
    where
        L: Law<D>,
    {
        if !self.criterion.reads_work() {
            return Lanes::splat(0.0);
        }
        let weights = group.weights_of_work(simd, self.no_volume_correction);
        if L::Force::CENTRAL {
            let total = if self.no_volume_correction {
                total
            } else {
                self.weighted(simd, group, weights)
            };
            return total.work(simd, &group.bond, L::LINEAR, group.rotation_i);
        }
        group.work_of_ends(simd, &self.laws, weights)
    }

    /// Time increment for computing the bond history, s; `None` if the evaluation does not compute the
    /// history.
    #[inline(always)]
    fn history_step<const D: usize>(&self) -> Option<f64>
    where
        L: Law<D>,
    {
        if L::BondHistory::COUNT > 0 && (L::FORCE_READS_HISTORY || self.bond_update.is_stored()) {
            self.bond_update.history_step()
        } else {
            None
        }
    }

    /// Return one bit per bond, set if the bond breaks because of its history at one end. The history at an
    /// end counts only if the force state of this end acts on the bond.
    #[inline(always)]
    fn worn_out<S: Simd, const D: usize>(&self, simd: S, group: &Group<'_, Self, D>) -> u8
    where
        L: Law<D>,
    {
        if !L::WEARS_OUT || !self.bond_update.is_stored() {
            return 0;
        }
        let [law_i, law_j] = &self.laws;
        let [acts_i, acts_j] = group.weights.acting();
        let [history_i, history_j] = &group.history;
        law_i.is_worn_out(simd, history_i) & acts_i | law_j.is_worn_out(simd, history_j) & acts_j
    }

    /// Return one bit per bond, set if the bond breaks.
    #[inline(always)]
    fn breaks<S: Simd, const D: usize>(
        &self,
        simd: S,
        group: &Group<'_, Self, D>,
        work: Lanes,
    ) -> u8
    where
        L: Law<D>,
    {
        let laws = (&self.laws, group.points());
        let breaking =
            (self.criterion).breaking::<S, L, D>(simd, &group.bond, laws, group.ends(), work);
        group.intact & group.breakable & (breaking | self.worn_out(simd, group))
    }
}

impl<L: Law<D>, const D: usize> Kernel<D> for Force<L> {
    type Sums = [Lanes; D];
    type Point = L::Point;
    type PointJ = L::Point;
    type BondHistory = L::BondHistory;
    type Rotation = <L::Force as ForceState<D>>::Rotation;
    const EXISTS: bool = D >= L::LEAST_DIMENSION;
    // One-dimensional bodies are small: one version of the loops, without a fast path, is enough.
    const ISA_SET: IsaSet = if D == 1 { IsaSet::Avx2 } else { L::ISA_SET };
    const HAS_FAST_PATH: bool = <Self as Kernel<D>>::ISA_SET.is_each()
        && !L::LINEAR
        && L::BondHistory::COUNT == 0
        && (L::FORCE_READS_STRETCH || L::FORCE_READS_EXTENSION);
    const BREAKS: bool = true;
    const READS_STRESSES: bool = !L::Force::CENTRAL;
    const WANTED: Wanted = Wanted {
        linear: L::LINEAR,
        stretch: L::FORCE_READS_STRETCH,
        extension_over_deformed: L::FORCE_READS_EXTENSION,
    };

    #[inline(always)]
    fn criterion(&self) -> Criterion {
        self.criterion
    }

    #[inline(always)]
    fn stores_history(&self) -> bool {
        self.bond_update.is_stored()
    }

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, force: &mut [Lanes; D]) {
        if let Some(step) = self.history_step() {
            let [own, far] = &self.laws;
            let [here, there] = group.points();
            group.history = [
                own.bond_history(&group.bond, here, &group.history[0], step),
                far.bond_history(&group.bond, there, &group.history[1], step),
            ];
        }
        let total = self.weighted(simd, group, group.weights);
        let work = self.work(simd, group, total);
        group.intact &= !self.breaks(simd, group, work);
        total.add(simd, &group.bond, group.force_volume, group.intact, force);
    }

    #[inline(always)]
    fn may_skip_criterion(&self) -> bool {
        self.criterion.marks_all(L::SCALED)
    }

    #[inline(always)]
    fn add_fast<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, force: &mut [Lanes; D]) {
        let total = self.weighted(simd, group, group.weights);
        total.add(simd, &group.bond, group.force_volume, group.intact, force);
    }
}
