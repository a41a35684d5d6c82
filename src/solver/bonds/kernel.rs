//! What is summed over the bonds of points: forces, numbers of points, energies.
//!
//! A kernel sees eight bonds at a time and adds to eight sums. It is written once for any dimension,
//! law and storage: the bonds may be those of one point or those of eight.

use crate::damage::{Criterion, Limits};
use crate::lanes::{IsaSet, LaneTuple, Lanes, Simd};
use crate::material::Bond;
use crate::material::bond::{Wanted, Weights};

/// Eight bonds: what is read of both ends, and what is kept of the bonds.
pub struct Group<'a, K: Kernel<D>, const D: usize> {
    /// What laws see.
    pub bond: Bond<D>,
    /// Volumes of the own ends, m³.
    pub own_volume: Lanes,
    /// Volumes of the far ends, m³.
    pub volume: Lanes,
    /// What volumes are multiplied by.
    pub weights: Weights,
    /// The numbers of the own ends.
    pub own: &'a K::Point,
    /// The numbers of the far ends.
    pub far: K::Point,
    /// What the criterion reads of points i.
    pub limits_i: &'a Limits,
    /// What the criterion reads of points j.
    pub limits_j: Limits,
    /// Rotations of the families of points i.
    pub rotation_i: &'a K::Rotation,
    /// Rotations of the families of points j.
    pub rotation_j: K::Rotation,
    /// What the bonds keep for their own and their far ends.
    pub history: [K::BondHistory; 2],
    /// A bit for each bond that is intact.
    pub intact: u8,
    /// A bit for each bond, broken or not; only for kernels that want it.
    pub whole: u8,
    /// A bit for each bond that can break.
    pub breakable: u8,
}

impl<K: Kernel<D>, const D: usize> Group<'_, K, D> {
    /// The numbers of both ends.
    #[inline(always)]
    pub fn points(&self) -> [&K::Point; 2] {
        [self.own, &self.far]
    }

    /// A bit for each intact bond that counts in the own end's sums.
    #[inline(always)]
    pub fn family(&self) -> u8 {
        match self.weights {
            Weights::One => self.intact,
            weights => self.intact & weights.own().above(0.0),
        }
    }

    /// A share in the sums of the own end, by volume.
    #[inline(always)]
    pub fn own_share(&self, share: Lanes) -> Lanes {
        let share = share * self.volume;
        match self.weights {
            Weights::One => share,
            weights => share * weights.own(),
        }
    }
}

/// How the lanes of a sum become a number of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Combine {
    /// They are added.
    Add,
    /// The smallest counts.
    Smallest,
}

/// Something that is summed over the bonds of points.
pub trait Kernel<const D: usize>: Copy + Sync {
    /// Eight sums of each quantity; each is added to a column of numbers of the points.
    type Sums: LaneTuple;

    /// Eight sums of each quantity to which only bonds add that break; they are told by point, where
    /// there are any.
    type Broken: LaneTuple;

    /// The numbers of the ends that it reads.
    type Point: LaneTuple;

    /// The numbers of the bonds that it reads.
    type BondHistory: LaneTuple;

    /// The rotations of the ends, if its criterion can read them.
    type Rotation: LaneTuple;

    /// Whether there are bonds for it in `D` dimensions; else no loops are compiled.
    const EXISTS: bool = true;

    /// How its sums become numbers.
    const COMBINE: Combine = Combine::Add;

    /// For which vector instructions its loops are compiled. One that runs for outputs only takes longer to compile
    /// than it could save.
    const ISA_SET: IsaSet = IsaSet::One;

    /// Whether it is worth a loop for bonds none of which is marked.
    const NEAR: bool = false;

    /// Whether it wants to know of broken bonds.
    const WHOLE: bool = false;

    /// Whether its sums may follow from where points lie undeformed and which bonds are intact, and it neither breaks nor
    /// changes any: in a lattice they are then found once for all points that are alike in that.
    const UNDEFORMED: bool = false;

    /// Whether it reads the numbers of the far ends; else they are 0.
    const READS_FAR: bool = true;

    /// What it wants to know of deformed bonds.
    const WANTED: Wanted;

    /// Whether the law of its bonds is known at run time only, and with it whether bonds are linear.
    const ANY_LAW: bool = false;

    /// Whether bonds are those of a linear law, see [`Bond`].
    #[inline(always)]
    fn is_linear(&self) -> bool {
        Self::WANTED.linear
    }

    /// [`Self::WANTED`] for bonds that are linear or not.
    #[inline(always)]
    fn wanted(is_linear: bool) -> Wanted {
        let mut wanted = Self::WANTED;
        if Self::ANY_LAW {
            wanted.linear = is_linear;
        }
        wanted
    }

    /// Whether sums are [those of the undeformed](Self::UNDEFORMED); asked only where that is possible.
    #[inline(always)]
    fn is_undeformed(&self) -> bool {
        Self::UNDEFORMED
    }

    /// When it breaks bonds: what it needs of them for that is found.
    #[inline(always)]
    fn criterion(&self) -> Criterion {
        Criterion::Never
    }

    /// Whether it changes what bonds keep.
    #[inline(always)]
    fn stores_history(&self) -> bool {
        false
    }

    /// The sums over no bond.
    #[inline(always)]
    fn start(&self) -> Self::Sums {
        Self::Sums::splat(0.0)
    }

    /// Adds eight bonds but for those that break, whose bits it clears; may change what bonds keep.
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut Self::Sums);

    /// Whether no bond breaks or remembers but marked ones; only asked with [`Self::NEAR`].
    #[inline(always)]
    fn is_plain_near(&self) -> bool {
        true
    }

    /// Adds eight bonds none of which is marked, if [`Self::is_plain_near`].
    #[inline(always)]
    fn add_near<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut Self::Sums) {
        self.add(simd, group, sums);
    }

    /// Clears the bits of those of eight bonds that break, and adds them. Groups come here after
    /// [`Self::add`], if it has broken any bond of the same point or vector: what is rarely done takes no
    /// registers from the loop.
    fn add_broken<S: Simd>(
        &self,
        _simd: S,
        _group: &mut Group<'_, Self, D>,
        _broken: &mut Self::Broken,
    ) {
    }
}
