//! What is summed over a family in every step: bond forces, states, energies, the smallest stretch.
//!
//! A kernel sees one row at a time and adds to the point's outputs. It is written once for any
//! dimension, law and failure rule; the bonds of a row are evaluated eight at a time.

use crate::families::Row;
use crate::material::{End, Lanes, Law};

use super::failure::{Ends, Failure};
use super::geometry::{Geometry, Loaded, Shared};

/// Something that is summed over rows.
pub trait Kernel: Sync {
    /// What is summed for each point.
    type Output: Send;

    /// Whether it is worth a version for each set of vector instructions.
    const HOT: bool = false;

    /// The number of local points that every array it reads by index covers.
    fn points(&self) -> usize;

    /// Adds a row's share to its point's output.
    ///
    /// # Safety
    /// Every index of the row must be below [`Self::points`].
    unsafe fn row(&self, row: Row<'_>, output: &mut Self::Output);
}

/// The bonds of a list: the points, their shared numbers and the laws of both ends.
#[derive(Clone, Copy)]
pub struct Bonded<'a, L, const D: usize> {
    /// The points.
    pub geometry: Geometry<'a, D>,
    /// What bonds know of the families of their ends.
    pub shared: Shared<'a>,
    /// Laws of the own and of the far end.
    pub laws: [L; 2],
}

impl<L: Law, const D: usize> Bonded<'_, L, D> {
    /// The number of local points that every array covers.
    pub fn points(&self) -> usize {
        self.geometry.points().min(self.shared.points::<L>())
    }

    /// The intact bonds of a group that must break, and their energy at the own end (J).
    #[inline(always)]
    fn failing<F: Failure>(
        &self,
        row: &Row<'_>,
        group: usize,
        loaded: &Loaded<D>,
        [here, there]: [&End; 2],
        failure: F,
    ) -> (u8, f64) {
        let ends = Ends {
            here_law: &self.laws[0],
            there_law: &self.laws[1],
            here,
            there,
        };
        let stretch = loaded.bond.stretch;
        let neighbours = &row.neighbours[group];
        let mut broken = row.intact[group] & failure.breaks(row.point, neighbours, stretch, ends);
        if broken == 0 {
            return (0, 0.0);
        }
        broken &= row.breakable.map_or(u8::MAX, |breakable| breakable[group]);
        let energy = self.laws[0].bond_energy(&loaded.bond, here) * loaded.volume;
        let energy = energy * row.weight_here(group);
        let volume = self.geometry.volume[row.point];
        (broken, volume * energy.select(broken, 0.0).sum())
    }
}

/// What the bonds of a point do to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response<const D: usize> {
    /// Force density by component, N/m³.
    pub force: [f64; D],
    /// Energy that the point's share of bonds has set free by breaking so far, J.
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

/// Breaks bonds, unless that has been done, and sums their forces.
pub struct Force<'a, L, F, const D: usize> {
    /// The bonds.
    pub bonded: Bonded<'a, L, D>,
    /// The failure rule; none where bonds have been broken already.
    pub failure: Option<F>,
}

impl<L: Law, F: Failure, const D: usize> Kernel for Force<'_, L, F, D> {
    type Output = Response<D>;
    const HOT: bool = true;

    fn points(&self) -> usize {
        self.bonded.points()
    }

    #[inline(always)]
    unsafe fn row(&self, row: Row<'_>, output: &mut Response<D>) {
        let bonded = &self.bonded;
        let [law, other] = &bonded.laws;
        let here = bonded.shared.here::<L>(row.point);
        let mut force = [Lanes::splat(0.0); D];
        for group in 0..row.neighbours.len() {
            let neighbours = &row.neighbours[group];
            // SAFETY: passed on to the caller.
            let loaded = unsafe { bonded.geometry.load(row.point, neighbours, L::LINEAR) };
            // SAFETY: as above.
            let there = unsafe { bonded.shared.there::<L>(neighbours) };
            let mut bits = row.intact[group];
            if let Some(failure) = self.failure {
                let ends = [&here, &there];
                let (broken, energy) = bonded.failing(&row, group, &loaded, ends, failure);
                if broken != 0 {
                    output.set_free += energy;
                    bits &= !broken;
                    row.intact[group] = bits;
                }
            }
            let bond = &loaded.bond;
            let (pull, push) = (law.force(bond, &here), other.force(bond, &there));
            let strength = match row.weights {
                [None, _] => pull + push,
                [Some(weights), None] => (pull + push) * weights[group],
                [Some(own), Some(far)] => pull * own[group] + push * far[group],
            };
            let strength = strength * loaded.volume * loaded.inverse_length;
            let strength = strength.select(bits, 0.0);
            for d in 0..D {
                force[d] += strength * loaded.along[d];
            }
        }
        for d in 0..D {
            output.force[d] += force[d].sum();
        }
    }
}

/// The sums that give a point's state, and what breaking changes in them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StateSums {
    /// Over the bonds that were intact.
    pub before: f64,
    /// Over those that still are.
    pub after: f64,
    /// Energy that the point's share of bonds sets free by breaking, J.
    pub set_free: f64,
}

/// Breaks bonds and sums the states of points.
pub struct State<'a, L, F, const D: usize> {
    /// The bonds; states are not read.
    pub bonded: Bonded<'a, L, D>,
    /// The failure rule.
    pub failure: F,
}

impl<L: Law, F: Failure, const D: usize> Kernel for State<'_, L, F, D> {
    type Output = StateSums;
    const HOT: bool = true;

    fn points(&self) -> usize {
        self.bonded.points()
    }

    #[inline(always)]
    unsafe fn row(&self, row: Row<'_>, output: &mut StateSums) {
        let bonded = &self.bonded;
        let here = bonded.shared.here::<L>(row.point);
        let mut before = Lanes::splat(0.0);
        let mut after = Lanes::splat(0.0);
        for group in 0..row.neighbours.len() {
            let neighbours = &row.neighbours[group];
            // SAFETY: passed on to the caller.
            let loaded = unsafe { bonded.geometry.load(row.point, neighbours, L::LINEAR) };
            // SAFETY: as above.
            let there = unsafe { bonded.shared.there::<L>(neighbours) };
            let share = bonded.laws[0].state_share(&loaded.bond) * loaded.volume;
            let share = share * row.weight_here(group);
            let bits = row.intact[group];
            let ends = [&here, &there];
            let (broken, energy) = bonded.failing(&row, group, &loaded, ends, self.failure);
            output.set_free += energy;
            row.intact[group] = bits & !broken;
            before += share.select(bits, 0.0);
            after += share.select(bits & !broken, 0.0);
        }
        output.before += before.sum();
        output.after += after.sum();
    }
}

/// The smallest stretch s_min of the intact bonds; outputs start at +∞.
pub struct SmallestStretch<'a, const D: usize> {
    /// The points.
    pub geometry: Geometry<'a, D>,
}

impl<const D: usize> Kernel for SmallestStretch<'_, D> {
    type Output = f64;
    const HOT: bool = true;

    fn points(&self) -> usize {
        self.geometry.points()
    }

    #[inline(always)]
    unsafe fn row(&self, row: Row<'_>, output: &mut f64) {
        let mut smallest = Lanes::splat(f64::INFINITY);
        for (neighbours, bits) in row.neighbours.iter().zip(row.intact.iter()) {
            // SAFETY: passed on to the caller.
            let loaded = unsafe { self.geometry.load(row.point, neighbours, false) };
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
    /// Strain energy density W, J/m³.
    pub energy: f64,
    /// The sum that gives the point's state.
    pub state_sum: f64,
    /// Volume of the neighbours in the point's own family, m³.
    pub volume: f64,
    /// Number of neighbours, those included that have the point in their family only.
    pub neighbours: u32,
}

/// Sums up what the intact bonds hold.
pub struct Energy<'a, L, const D: usize> {
    /// The bonds; states are not read.
    pub bonded: Bonded<'a, L, D>,
}

impl<L: Law, const D: usize> Kernel for Energy<'_, L, D> {
    type Output = Stored;
    const HOT: bool = true;

    fn points(&self) -> usize {
        self.bonded.points()
    }

    #[inline(always)]
    unsafe fn row(&self, row: Row<'_>, output: &mut Stored) {
        let bonded = &self.bonded;
        let law = &bonded.laws[0];
        let here = bonded.shared.here::<L>(row.point);
        let mut energy = Lanes::splat(0.0);
        let mut state = Lanes::splat(0.0);
        let mut volume = Lanes::splat(0.0);
        for (group, neighbours) in row.neighbours.iter().enumerate() {
            // SAFETY: passed on to the caller.
            let loaded = unsafe { bonded.geometry.load(row.point, neighbours, L::LINEAR) };
            let bits = row.intact[group] & row.family(group);
            let weighted = loaded.volume * row.weight_here(group);
            energy += (law.bond_energy(&loaded.bond, &here) * weighted).select(bits, 0.0);
            state += (law.state_share(&loaded.bond) * weighted).select(bits, 0.0);
            volume += loaded.volume.select(bits, 0.0);
            output.neighbours += row.intact[group].count_ones();
        }
        output.energy += energy.sum();
        output.state_sum += state.sum();
        output.volume += volume.sum();
    }
}
