//! A loop over the owned points in parts, on several threads. A part is small enough that its fields stay in
//! the cache.

use rayon::iter::split;
use rayon::prelude::*;

use crate::solver::bonds::BondInputs;
use crate::solver::model::Model;

use super::Fields;
use super::fields::Exerted;

/// Number of points of a part; the last part may have fewer.
pub const PART: usize = 2048;

/// For each of `N` components, a column with one number per point of a part.
type Columns<'a, const N: usize> = [&'a mut [f64]; N];

/// A part of the owned points with their fields.
pub struct Part<'a, const D: usize> {
    /// All local points, and the properties of their blocks.
    pub model: &'a Model<D>,
    /// Local index of the first point of the part.
    pub first: usize,
    /// Entries of [`Fields::displacement`].
    pub displacement: Columns<'a, D>,
    /// Entries of [`Fields::temperature`].
    pub temperature: Option<Columns<'a, 1>>,
    /// Entries of [`Fields::thermal_stretch`].
    pub thermal_stretch: Option<Columns<'a, 1>>,
    /// Entries of [`Fields::velocity`].
    pub velocity: Columns<'a, D>,
    /// Entries of [`Fields::internal_force`].
    pub internal_force: Columns<'a, D>,
    /// Entries of [`Fields::external_force`].
    pub external_force: Option<Columns<'a, D>>,
    /// Entries of [`Fields::reaction`].
    pub reaction: Option<Columns<'a, D>>,
    /// Entries of [`Fields::external_work`].
    pub external_work: Option<Columns<'a, 1>>,
    /// Entries of [`Fields::damping_power`] and [`Fields::damped_energy`].
    pub damping: Option<Columns<'a, 2>>,
    bond_inputs: BondInputs<'a, D>,
}

/// One component of the displacements, velocities, force densities and reactions of the points of a part.
pub struct Moving<'a> {
    /// Displacements, m.
    pub displacement: &'a mut [f64],
    /// Velocities, m/s.
    pub velocity: &'a mut [f64],
    /// Force densities, N/m³.
    pub force: Exerted<'a>,
    /// Reactions, N/m³; `None` in runs without supports.
    pub reaction: Option<&'a mut [f64]>,
}

impl<'a, const D: usize> Part<'a, D> {
    /// Create a part with all owned points.
    pub fn all(
        model: &'a Model<D>,
        fields: &'a mut Fields<D>,
        bond_inputs: BondInputs<'a, D>,
    ) -> Self {
        let owned = model.owned();
        let vector = |field: &'a mut [Vec<f64>; D]| field.each_mut().map(Vec::as_mut_slice);
        let scalars = fields
            .damping_power
            .as_mut()
            .zip(fields.damped_energy.as_mut());
        Self {
            model,
            first: 0,
            displacement: (fields.displacement.each_mut()).map(|column| &mut column[..owned]),
            temperature: fields.temperature.as_mut().map(|column| [&mut column[..]]),
            thermal_stretch: (fields.thermal_stretch.as_mut()).map(|column| [&mut column[..owned]]),
            velocity: vector(&mut fields.velocity),
            internal_force: vector(&mut fields.internal_force),
            external_force: fields.external_force.as_mut().map(vector),
            reaction: fields.reaction.as_mut().map(vector),
            external_work: fields.external_work.as_mut().map(|work| [&mut work[..]]),
            damping: scalars.map(|(power, energy)| [&mut power[..], &mut energy[..]]),
            bond_inputs,
        }
    }

    /// Number of points of the part.
    pub fn count(&self) -> usize {
        self.velocity[0].len()
    }

    /// Index of the block of each point of the part.
    pub fn blocks(&self) -> &'a [u16] {
        &self.model.block[self.first..self.first + self.count()]
    }

    /// Return the entries of `field` that belong to the points of this part. `field` has entries for all
    /// owned points.
    pub fn of<'f>(&self, field: &'f [Vec<f64>; D]) -> [&'f [f64]; D] {
        (field.each_ref()).map(|column| &column[self.first..self.first + self.count()])
    }

    /// Return one component of the motion.
    pub fn component(&mut self, d: usize) -> Moving<'_> {
        Moving {
            displacement: self.displacement[d],
            velocity: self.velocity[d],
            force: Exerted {
                internal: self.internal_force[d],
                external: self.external_force.as_ref().map(|force| &*force[d]),
            },
            reaction: self.reaction.as_mut().map(|reaction| &mut *reaction[d]),
        }
    }

    /// Component d of all force densities on a point except the reaction, N/m³. Viscous damping is included.
    pub fn force_without_reaction(&self, d: usize, point: usize) -> f64 {
        let force = Exerted {
            internal: &*self.internal_force[d],
            external: self.external_force.as_ref().map(|force| &*force[d]),
        };
        let velocity = self.velocity[d][point];
        (self.model).with_damping(self.first + point, force.at(point), velocity)
    }

    /// Compute the power of viscous damping at the present velocities. Add the energy that damping has
    /// dissipated in a time step of length `step` (s), by the trapezoidal rule.
    pub fn add_damped_energy(&mut self, step: f64) {
        let (model, first) = (self.model, self.first);
        let Some([powers, energies]) = &mut self.damping else {
            return;
        };
        let both = powers.iter_mut().zip(energies.iter_mut());
        for (k, (power, energy)) in both.enumerate() {
            let before = *power;
            let square: f64 = self.velocity.iter().map(|column| column[k].powi(2)).sum();
            let mass = model.density_of(first + k) * model.volume[first + k];
            *power = model.damping_of(first + k) * mass * square;
            *energy += 0.5 * step * (before + *power);
        }
    }

    /// Copy displacements and thermal stretches of the part's points to the bond inputs, and set the internal
    /// forces on these points to 0.
    pub fn write_bond_inputs(&mut self) {
        let thermal_stretch = self.thermal_stretch.as_ref();
        self.bond_inputs.write_bond_inputs(
            self.displacement.each_ref().map(|column| &**column),
            thermal_stretch.map(|[column]| &**column),
        );
        for component in &mut self.internal_force {
            component.fill(0.0);
        }
    }

    /// Split off the first `count` points of the part, and return them as another part.
    fn split_off_first(&mut self, count: usize) -> Self {
        let first = self.first;
        self.first += count;
        Self {
            model: self.model,
            first,
            displacement: cut(&mut self.displacement, count),
            temperature: self.temperature.as_mut().map(|column| cut(column, count)),
            thermal_stretch: self
                .thermal_stretch
                .as_mut()
                .map(|column| cut(column, count)),
            velocity: cut(&mut self.velocity, count),
            internal_force: cut(&mut self.internal_force, count),
            external_force: self.external_force.as_mut().map(|force| cut(force, count)),
            reaction: self.reaction.as_mut().map(|force| cut(force, count)),
            external_work: self.external_work.as_mut().map(|work| cut(work, count)),
            damping: self.damping.as_mut().map(|damping| cut(damping, count)),
            bond_inputs: self.bond_inputs.split_off_first(count),
        }
    }
}

/// Split off the first `count` entries of each column, and return them.
fn cut<'a, const N: usize>(columns: &mut Columns<'a, N>, count: usize) -> Columns<'a, N> {
    columns.each_mut().map(|column| {
        let (first, others) = std::mem::take(column).split_at_mut(count);
        *column = others;
        first
    })
}

/// Number of parts of the owned points.
pub fn parts(owned: usize) -> usize {
    owned.div_ceil(PART)
}

/// One or several adjacent parts, and one entry for each part. The entries come from the argument `each` of
/// [`walk`].
type Parts<'a, C, const D: usize> = (Part<'a, D>, &'a mut [C]);

/// Split several parts into two halves; a single part is not split.
fn halves<C, const D: usize>(
    (mut points, each): Parts<'_, C, D>,
) -> (Parts<'_, C, D>, Option<Parts<'_, C, D>>) {
    if each.len() < 2 {
        return ((points, each), None);
    }
    let (first, second) = each.split_at_mut(each.len() / 2);
    let points_of_first = points.split_off_first(first.len() * PART);
    ((points_of_first, first), Some((points, second)))
}

/// Call `work` with each part of the points and the entry of `each` for this part. Returns whether all calls
/// returned true. `work` is a trait object, because a generic closure would generate a loop per caller.
///
/// # Panics
/// If `each` does not have one entry per part.
pub fn walk<'a, C: Send, const D: usize>(
    all: Part<'a, D>,
    each: &'a mut [C],
    work: &(dyn Fn(&mut Part<'_, D>, &mut C) -> bool + Sync),
) -> bool {
    assert_eq!(each.len(), parts(all.count()), "one entry a part");
    split((all, each), halves::<C, D>)
        .map(|(mut points, each)| {
            let mut all = true;
            for own in each {
                let count = points.count().min(PART);
                all &= work(&mut points.split_off_first(count), own);
            }
            all
        })
        .reduce(|| true, |a, b| a & b)
}
