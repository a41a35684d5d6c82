//! The sum of the bond forces, and the breaking of bonds by what both ends' force states say.

use crate::damage::{Criterion, Ends};
use crate::lanes::{IsaSet, LaneTuple, Lanes, Simd};
use crate::material::bond::{Wanted, Weights};
use crate::material::{ForceState, Law};

use super::kernel::{Group, Kernel};

/// What happens to bonds while forces are evaluated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BondUpdate {
    /// Bonds break and their history advances, as at the end of a step of this length (s).
    Step(f64),
    /// Forces follow from the history that bonds would have at the end of a step of this length (s). It is not stored,
    /// and no bond breaks.
    Trial(f64),
    /// Neither history nor bonds change.
    None,
}

impl BondUpdate {
    /// The time by which the history of bonds advances, s.
    #[inline(always)]
    pub fn history_step(self) -> Option<f64> {
        match self {
            Self::Step(step) | Self::Trial(step) => Some(step),
            Self::None => None,
        }
    }

    /// Whether what changes is stored.
    #[inline(always)]
    pub fn is_stored(self) -> bool {
        matches!(self, Self::Step(_))
    }
}

/// Sums the forces of the intact bonds: force density by component (N/m³), less those of bonds that
/// break by what their force states say. Of these it sums the number, the energy (J) that the points'
/// shares of them set free, how much of it they held above their criterion (J), and their forces (N/m³).
#[derive(Clone, Copy)]
pub struct Force<L> {
    /// Laws of the own and of the far end.
    pub laws: [L; 2],
    /// When bonds break here.
    pub criterion: Criterion,
    /// Whether the weights of bonds are their influence, and not shares of volume.
    pub influence: bool,
    /// What happens to the bonds.
    pub bond_update: BondUpdate,
}

impl<L> Force<L> {
    /// The weighted sum of the force states of both ends.
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

    /// The work of the acting force states of each bond between whole cells, J/m⁶, from the weighted force density; 0 if
    /// the criterion does not read it. A force state does not act beyond the horizon of its point.
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
        let weights = match group.weights {
            weights if self.influence => weights,
            Weights::One | Weights::Same(_) => Weights::One,
            Weights::Each(_) => {
                let ([i, j], one) = (group.weights.acting(), Lanes::splat(1.0));
                Weights::Each([simd.keep(one, i), simd.keep(one, j)])
            }
        };
        if L::Force::CENTRAL {
            let total = if self.influence {
                total
            } else {
                self.weighted(simd, group, weights)
            };
            return total.work(simd, &group.bond, L::LINEAR, group.rotation_i);
        }
        let ([law_i, law_j], [point_i, point_j]) = (&self.laws, group.points());
        let ([history_i, history_j], bond) = (&group.history, &group.bond);
        let i = law_i.end_work(simd, bond, point_i, history_i, group.rotation_i);
        let j = law_j.end_work(simd, bond, point_j, history_j, &group.rotation_j);
        weights.sum(i, j)
    }

    /// A bit for each bond that breaks.
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
        let breaking =
            (self.criterion).breaking::<S, L, D>(simd, &group.bond, self.ends(group), work);
        group.intact & group.breakable & breaking
    }

    #[inline(always)]
    fn ends<'a, const D: usize>(&'a self, group: &'a Group<'_, Self, D>) -> Ends<'a, L, L::Point>
    where
        L: Law<D>,
    {
        Ends {
            laws: &self.laws,
            points: group.points(),
            limits: [group.limits_i, &group.limits_j],
            weights: group.weights,
        }
    }
}

impl<L: Law<D>, const D: usize> Kernel<D> for Force<L> {
    type Sums = [Lanes; D];
    type Broken = ([Lanes; 3], [Lanes; D]);
    type Point = L::Point;
    type BondHistory = L::BondHistory;
    type Rotation = <L::Force as ForceState<D>>::Rotation;
    const EXISTS: bool = D >= L::LEAST_DIMENSION;
    const ISA_SET: IsaSet = L::ISA_SET;
    const HAS_FAST_PATH: bool = L::ISA_SET.is_each()
        && !L::LINEAR
        && L::BondHistory::COUNT == 0
        && (L::FORCE_READS_STRETCH || L::FORCE_READS_EXTENSION);
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
        if L::BondHistory::COUNT > 0
            && let Some(step) = self.bond_update.history_step()
        {
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

    #[inline(always)]
    fn add_broken<S: Simd>(
        &self,
        simd: S,
        group: &mut Group<'_, Self, D>,
        (counts, lost): &mut Self::Broken,
    ) {
        let total = self.weighted(simd, group, group.weights);
        let work = self.work(simd, group, total);
        let broken = self.breaks(simd, group, work);
        group.intact &= !broken;
        let bond = group.bond.with_stretch(L::LINEAR);
        let share = group.weights.own() * group.own_volume * group.volume;
        let energy = self.laws[0].bond_energy(&bond, group.own, &group.history[0]) * share;
        let ends = self.ends(group);
        let late = self.criterion.overshoot::<S, L, D>(simd, &bond, ends, work);
        let overshoot = if self.criterion.reads_work() {
            // The work of a bond belongs to its acting ends in equal parts.
            let [own, far] = ends.weights.acting();
            let half = simd.keep(Lanes::splat(0.5), own & far);
            let part = simd.select(half, own & far, simd.keep(Lanes::splat(1.0), own));
            work * part * share * late
        } else {
            energy * late
        };
        counts[0] += simd.keep(Lanes::splat(1.0), broken);
        counts[1] += simd.keep(energy, broken);
        counts[2] += simd.keep(overshoot, broken);
        total.add(simd, &bond, group.force_volume, broken, lost);
    }
}
