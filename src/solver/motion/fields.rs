//! The fields of the points. Each field has one declaration, which states its meaning, storage and output.
//!
//! Checkpoints, rollbacks and the result iterate over the list of fields. A new field in this list is saved,
//! rolled back and output as its description says. A field has one column of numbers per component.

use crate::problem::{Action, Field, Problem};
use crate::solver::bonds::{Broken, PlasticColumns};
use crate::solver::model::Model;

/// Name, unit and treatment of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Description {
    /// Name of the field; in checkpoints, its columns have this name and the index of the component.
    pub name: &'static str,
    /// SI unit of the values; `1` for dimensionless values.
    pub unit: &'static str,
    /// Whether the field is part of the state of a run. The state is stored in checkpoints and migrates with
    /// the points. Other fields are recomputed from the state.
    pub state: bool,
    /// Whether a rollback of a step restores the field.
    pub undone: bool,
    /// Effect on the field if a point is created or removed during a run.
    pub birth: Birth,
    /// Name of the field in decks; `None` if decks cannot request it.
    pub output: Option<Field>,
}

/// Values of a field that a new point gets from its parents, and values that a removed point returns to its
/// parents in equal parts. In the descriptions below, "the mean" is the mean of the parents' values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Birth {
    /// A new point gets the mean; a removed point returns nothing.
    Interpolated,
    /// A new point gets the mean. Let d be the value of a removed point minus the mean. The removed point
    /// returns the product of its volume and d. These rules conserve momentum, and do not change a field that
    /// is linear in space.
    Conserved,
    /// A new point gets the mean. If a point is removed, each parent gets the average of its own value and
    /// the value of the removed point. The weights are the parent's volume and the volume that the parent
    /// receives. Therefore each average lies between the two averaged values.
    Mixed,
    /// A new point takes a part of the value of each parent, in proportion to the volume that it takes from
    /// this parent. The sum over all points is therefore conserved. A removed point returns all of its value.
    Shared,
    /// The field is recomputed for a new point; a removed point returns nothing.
    FoundAnew,
}

/// A field as a slice of columns: a scalar is a `Vec<f64>`, a vector is a `[Vec<f64>; D]`.
trait Columns {
    fn columns(&self) -> &[Vec<f64>];
    fn columns_mut(&mut self) -> &mut [Vec<f64>];
}

impl Columns for Vec<f64> {
    fn columns(&self) -> &[Vec<f64>] {
        std::slice::from_ref(self)
    }

    fn columns_mut(&mut self) -> &mut [Vec<f64>] {
        std::slice::from_mut(self)
    }
}

impl<const D: usize> Columns for [Vec<f64>; D] {
    fn columns(&self) -> &[Vec<f64>] {
        self
    }

    fn columns_mut(&mut self) -> &mut [Vec<f64>] {
        self
    }
}

/// A list of scalar fields, which may be empty.
impl Columns for Vec<Vec<f64>> {
    fn columns(&self) -> &[Vec<f64>] {
        self
    }

    fn columns_mut(&mut self) -> &mut [Vec<f64>] {
        self
    }
}

/// A field that only some runs have.
impl<T: Columns> Columns for Option<T> {
    fn columns(&self) -> &[Vec<f64>] {
        self.as_ref().map_or(&[], T::columns)
    }

    fn columns_mut(&mut self) -> &mut [Vec<f64>] {
        self.as_mut().map_or(&mut [], T::columns_mut)
    }
}

macro_rules! fields {
    ($($(#[$doc:meta])* $name:ident: $type:ty = $description:expr;)+) => {
        /// The fields over the points. Fields that a run does not need are absent on all ranks.
        pub struct Fields<const D: usize> {
            $($(#[$doc])* pub $name: $type,)+
        }

        impl<const D: usize> Fields<D> {
            /// Iterate over all fields with their components.
            pub fn each(&self) -> impl Iterator<Item = (Description, &[Vec<f64>])> {
                [$(($description, self.$name.columns()),)+].into_iter()
            }

            /// Iterate over all fields with their components.
            pub fn each_mut(&mut self) -> impl Iterator<Item = (Description, &mut [Vec<f64>])> {
                [$(($description, self.$name.columns_mut()),)+].into_iter()
            }
        }
    };
}

/// Description of a field that is part of the state and that a rollback restores.
const STATE: Description = Description {
    name: "",
    unit: "",
    state: true,
    undone: true,
    birth: Birth::Interpolated,
    output: None,
};

/// Description of a cumulative energy of the points.
const ENERGY: Description = Description {
    unit: "J",
    birth: Birth::Shared,
    ..STATE
};

/// Description of a force density that is recomputed from the state.
const FORCE_DENSITY: Description = Description {
    unit: "N/m^3",
    state: false,
    birth: Birth::FoundAnew,
    ..STATE
};

/// Name of the field [`Fields::newly_broken_of_further`], which has one column per further result.
pub const NEWLY_BROKEN_OF_FURTHER: &str = "newly_broken_of_further";

fields! {
    /// Displacement u, m; owned points, then ghosts.
    displacement: [Vec<f64>; D] = Description {
        name: "displacement",
        unit: "m",
        output: Some(Field::Displacement),
        ..STATE
    };
    /// Temperature, in the unit of the key `reference_temperature` of the materials; `None` without
    /// prescribed temperatures.
    temperature: Option<Vec<f64>> = Description {
        name: "temperature",
        unit: "K",
        state: false,
        undone: false,
        birth: Birth::FoundAnew,
        output: Some(Field::Temperature),
    };
    /// Thermal stretch: along the bar in 1-D, in the plane in 2-D, in all directions in 3-D. Owned points,
    /// then ghosts; `None` without prescribed temperatures.
    thermal_stretch: Option<Vec<f64>> = Description {
        name: "thermal_stretch",
        unit: "1",
        state: false,
        undone: false,
        birth: Birth::FoundAnew,
        ..STATE
    };
    /// Velocity u̇ at full steps, m/s. Between the steps of a [`Stepper`](crate::solver::Stepper), the field
    /// holds the velocities at half steps.
    velocity: [Vec<f64>; D] = Description {
        name: "velocity",
        unit: "m/s",
        birth: Birth::Conserved,
        output: Some(Field::Velocity),
        ..STATE
    };
    /// Internal force density of bonds and contact, N/m³.
    internal_force: [Vec<f64>; D] = Description {
        name: "internal_force",
        output: Some(Field::ForceDensity),
        ..FORCE_DENSITY
    };
    /// Force density of the loads, N/m³; none without loads.
    external_force: Option<[Vec<f64>; D]> = Description {
        name: "external_force",
        ..FORCE_DENSITY
    };
    /// Force density of the supports, N/m³; none without supports.
    reaction: Option<[Vec<f64>; D]> = Description {
        name: "reaction",
        unit: "N/m^3",
        birth: Birth::FoundAnew,
        ..STATE
    };
    /// Number of bonds of a point that have broken since the start; none without damage.
    broken_bonds: Option<Vec<f64>> = Description {
        name: "broken_bonds",
        unit: "1",
        birth: Birth::FoundAnew,
        output: Some(Field::BrokenBonds),
        ..STATE
    };
    /// Number of bonds of a point that have broken since the last output of the main result; none without
    /// damage.
    newly_broken_bonds: Option<Vec<f64>> = Description {
        name: "newly_broken_bonds",
        unit: "1",
        birth: Birth::FoundAnew,
        output: Some(Field::NewlyBrokenBonds),
        ..STATE
    };
    /// Energy that broken bonds have released, per point, J; none without damage.
    freed_energy: Option<Vec<f64>> = Description {
        name: "freed_energy",
        ..ENERGY
    };
    /// Overshoot energy of the broken bonds of a point, J; none without damage. The overshoot energy of a
    /// bond is its energy above the criterion when it breaks. The freed energy includes the overshoot energy.
    overshoot_energy: Option<Vec<f64>> = Description {
        name: "overshoot_energy",
        ..ENERGY
    };
    /// Plastic strain of a point, xx, yy, zz, yz, xz, xy; none without plasticity.
    plastic_strain: Option<[Vec<f64>; 6]> = Description {
        name: "plastic_strain",
        unit: "1",
        birth: Birth::Mixed,
        ..STATE
    };
    /// Equivalent plastic strain of a point; none without plasticity.
    plastic_strain_equivalent: Option<Vec<f64>> = Description {
        name: "plastic_strain_equivalent",
        unit: "1",
        birth: Birth::Mixed,
        output: Some(Field::PlasticStrainEquivalent),
        ..STATE
    };
    /// Factor of strain rate and temperature on the yield stress of a point in the last step, minus 1. None
    /// without plasticity.
    yield_change: Option<Vec<f64>> = Description {
        name: "yield_change",
        unit: "1",
        birth: Birth::Mixed,
        ..STATE
    };
    /// Energy density that the zero-energy control would have if plastic flow did not reduce the control,
    /// J/m³. The control consists of the forces that resist zero-energy modes. None without plasticity.
    control_energy: Option<Vec<f64>> = Description {
        name: "control_energy",
        unit: "J/m^3",
        birth: Birth::Mixed,
        ..STATE
    };
    /// Energy density that plastic flow at a point has dissipated, J/m³. It includes the energy that is
    /// dissipated when the flow reduces the zero-energy control of the point. None without plasticity.
    plastic_work: Option<Vec<f64>> = Description {
        name: "plastic_work",
        unit: "J/m^3",
        birth: Birth::Mixed,
        ..STATE
    };
    /// Work done by loads and supports, J; none if the deck has neither loads nor supports.
    external_work: Option<Vec<f64>> = Description {
        name: "external_work",
        ..ENERGY
    };
    /// Power r ρ V u̇² (in W) that viscous damping with the rate r dissipates; none without viscous damping.
    damping_power: Option<Vec<f64>> = Description {
        name: "damping_power",
        unit: "W",
        state: false,
        birth: Birth::FoundAnew,
        ..STATE
    };
    /// Force density of contact, N/m³, part of the internal force; none without contact.
    contact_force: Option<[Vec<f64>; D]> = Description {
        name: "contact_force",
        output: Some(Field::ContactForceDensity),
        ..FORCE_DENSITY
    };
    /// Part of the contact force that is friction, N/m³; none without contact.
    friction: Option<[Vec<f64>; D]> = Description {
        name: "friction",
        unit: "N/m^3",
        birth: Birth::FoundAnew,
        ..STATE
    };
    /// Part of the contact force that is contact damping, N/m³; none without contact.
    contact_damping: Option<[Vec<f64>; D]> = Description {
        name: "contact_damping",
        unit: "N/m^3",
        birth: Birth::FoundAnew,
        ..STATE
    };
    /// Potential energy of contact, J; none without contact.
    contact_energy: Option<Vec<f64>> = Description {
        name: "contact_energy",
        unit: "J",
        state: false,
        birth: Birth::FoundAnew,
        ..STATE
    };
    /// Energy dissipated by friction, J; none without contact.
    friction_energy: Option<Vec<f64>> = Description {
        name: "friction_energy",
        ..ENERGY
    };
    /// Energy dissipated by contact damping, J; none without contact.
    contact_damping_energy: Option<Vec<f64>> = Description {
        name: "contact_damping_energy",
        ..ENERGY
    };
    /// Velocity u̇ of the relaxation at half iterations, m per iteration; none without relaxation.
    relaxation_velocity: Option<[Vec<f64>; D]> = Description {
        name: "relaxation_velocity",
        unit: "m",
        ..STATE
    };
    /// Displacement u at the last equilibrium, m; none without load steps.
    equilibrium_displacement: Option<[Vec<f64>; D]> = Description {
        name: "equilibrium_displacement",
        unit: "m",
        ..STATE
    };
    /// Force density of the supports at the last equilibrium, N/m³. None if the deck lacks load steps or
    /// supports.
    equilibrium_reaction: Option<[Vec<f64>; D]> = Description {
        name: "equilibrium_reaction",
        unit: "N/m^3",
        birth: Birth::FoundAnew,
        ..STATE
    };
    /// Fictitious density of a point, N/m⁴: an upper bound of its stiffness. Iterations of a relaxation
    /// without contact are stable with this density. None without load steps.
    fictitious_density: Option<Vec<f64>> = Description {
        name: "fictitious_density",
        unit: "N/m^4",
        state: false,
        undone: false,
        birth: Birth::FoundAnew,
        ..STATE
    };
    /// Contribution of contact to the fictitious density, N/m⁴: the largest value since the points last
    /// started from rest. None if the deck lacks contact or relaxation.
    contact_density: Option<Vec<f64>> = Description {
        name: "contact_density",
        unit: "N/m^4",
        undone: false,
        birth: Birth::FoundAnew,
        ..STATE
    };
    /// Last time (s) at which the point was within the horizon of a source. A source is a point that triggers
    /// refinement, or a point with broken bonds. None without coarsening.
    last_seen: Option<Vec<f64>> = Description {
        name: "last_seen",
        unit: "s",
        birth: Birth::FoundAnew,
        ..STATE
    };
    /// Energy dissipated by viscous damping, J; none without viscous damping.
    damped_energy: Option<Vec<f64>> = Description {
        name: "damped_energy",
        ..ENERGY
    };
    /// Number of a point's bonds that have broken since the last output of a further result; one column per
    /// further result with this field. There are no columns in runs without damage.
    newly_broken_of_further: Vec<Vec<f64>> = Description {
        name: NEWLY_BROKEN_OF_FURTHER,
        unit: "1",
        birth: Birth::FoundAnew,
        ..STATE
    };
}

/// The quantities that decide which optional fields a run has; the same on all ranks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Needs {
    /// Whether there are loads.
    pub loads: bool,
    /// Whether there are supports.
    pub supports: bool,
    /// Whether there are prescribed temperatures.
    pub temperature: bool,
    /// Whether there is viscous damping.
    pub damping: bool,
    /// Whether there are load steps.
    pub equilibria: bool,
    /// Whether there is relaxation.
    pub relaxation: bool,
    /// Whether bonds can break.
    pub damage: bool,
    /// Number of further results that contain the number of newly broken bonds.
    pub further_counts: usize,
    /// Whether any point has a plastic state.
    pub plasticity: bool,
    /// Whether there is contact.
    pub contact: bool,
    /// Whether refined regions are coarsened again.
    pub coarsening: bool,
}

/// The columns of the plastic state; empty without plasticity.
pub fn plastic_columns<'a>(
    strain: &'a mut Option<[Vec<f64>; 6]>,
    equivalent: &'a mut Option<Vec<f64>>,
    yield_change: &'a mut Option<Vec<f64>>,
    control: &'a mut Option<Vec<f64>>,
    work: &'a mut Option<Vec<f64>>,
) -> PlasticColumns<'a> {
    let fields: [&mut dyn Columns; 5] = [strain, equivalent, yield_change, control, work];
    let mut columns = fields.into_iter().flat_map(Columns::columns_mut);
    std::array::from_fn(|_| columns.next().map(Vec::as_mut_slice).unwrap_or_default())
}

/// Fictitious density of the owned points with the contribution of contact, N/m⁴.
#[derive(Clone, Copy)]
pub struct RelaxationDensity<'a> {
    bonds: &'a [f64],
    contact: Option<&'a [f64]>,
}

impl RelaxationDensity<'_> {
    /// Fictitious density of a point, N/m⁴.
    #[inline(always)]
    pub fn at(&self, point: usize) -> f64 {
        match self.contact {
            Some(contact) => self.bonds[point] + contact[point],
            None => self.bonds[point],
        }
    }
}

/// A component of the internal and external force densities, N/m³.
#[derive(Clone, Copy)]
pub struct Exerted<'a> {
    /// Internal force density, of bonds and contact.
    pub internal: &'a [f64],
    /// External force density of the loads; `None` in runs without loads.
    pub external: Option<&'a [f64]>,
}

impl<'a> Exerted<'a> {
    /// Select a component of [`Fields::internal_force`] and [`Fields::external_force`].
    pub fn new<const D: usize>(
        internal: &'a [Vec<f64>; D],
        external: Option<&'a [Vec<f64>; D]>,
        component: usize,
    ) -> Self {
        Self {
            internal: &internal[component],
            external: external.map(|field| &field[component][..]),
        }
    }

    /// Sum of internal and external force density at a point.
    #[inline(always)]
    pub fn at(&self, k: usize) -> f64 {
        match self.external {
            Some(external) => self.internal[k] + external[k],
            None => self.internal[k],
        }
    }
}

impl Needs {
    /// Find the needs of a problem. `has_plasticity` says whether a law of the problem has a plastic state.
    pub fn new(problem: &Problem, has_plasticity: bool) -> Self {
        let acts = |acts: fn(&Action) -> bool| {
            let mut conditions = problem.conditions.iter();
            conditions.any(|condition| acts(&condition.action))
        };
        let mut bodies = problem.bodies.iter();
        Self {
            loads: acts(Action::is_load),
            supports: acts(Action::is_support),
            temperature: problem.has_temperature(),
            damping: bodies.any(|body| body.material.damping > 0.0),
            equilibria: problem.is_quasi_static(),
            relaxation: problem.has_relaxation(),
            damage: problem.has_damage(),
            further_counts: problem.further_counts().count(),
            plasticity: has_plasticity,
            contact: problem.has_contact(),
            coarsening: problem.may_coarsen(),
        }
    }

    /// Number of values per point that a checkpoint stores, without the state of the bonds.
    pub fn state_width<const D: usize>(self) -> usize {
        let fields = Fields::<D>::new(&Model::empty(), self);
        fields.state().count()
    }
}

impl<const D: usize> Fields<D> {
    /// Iterate over the columns of the state. Each item has the description of the field, the index of the
    /// component, and the column.
    pub fn state(&self) -> impl Iterator<Item = (Description, usize, &Vec<f64>)> {
        let fields = self.each().filter(|(field, _)| field.state);
        fields.flat_map(|(field, columns)| {
            let columns = columns.iter().enumerate();
            columns.map(move |(component, column)| (field, component, column))
        })
    }

    /// Iterate over the columns of the state, in the order of [`Self::state`].
    pub fn state_mut(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        let fields = self.each_mut().filter(|(field, _)| field.state);
        fields.flat_map(|(_, columns)| columns)
    }

    /// Present position of a local point, m; components beyond the dimension are 0.
    pub fn position(&self, model: &Model<D>, point: usize) -> [f64; 3] {
        let mut position = model.position(point);
        for d in 0..D {
            position[d] += self.displacement[d][point];
        }
        position
    }

    /// Allocate the fields with all points at rest at their reference positions.
    pub fn new(model: &Model<D>, needs: Needs) -> Self {
        let (owned, local) = (model.owned(), model.volume.len());
        let vector = |count: usize| std::array::from_fn(|_| vec![0.0; count]);
        let scalar = || vec![0.0; owned];
        Self {
            displacement: vector(local),
            temperature: needs.temperature.then(scalar),
            thermal_stretch: needs.temperature.then(|| vec![0.0; local]),
            velocity: vector(owned),
            internal_force: vector(owned),
            external_force: needs.loads.then(|| vector(owned)),
            reaction: needs.supports.then(|| vector(owned)),
            broken_bonds: needs.damage.then(scalar),
            newly_broken_bonds: needs.damage.then(scalar),
            freed_energy: needs.damage.then(scalar),
            overshoot_energy: needs.damage.then(scalar),
            plastic_strain: needs.plasticity.then(|| std::array::from_fn(|_| scalar())),
            plastic_strain_equivalent: needs.plasticity.then(scalar),
            yield_change: needs.plasticity.then(scalar),
            control_energy: needs.plasticity.then(scalar),
            plastic_work: needs.plasticity.then(scalar),
            external_work: (needs.loads || needs.supports).then(scalar),
            damping_power: needs.damping.then(scalar),
            contact_force: needs.contact.then(|| vector(owned)),
            friction: needs.contact.then(|| vector(owned)),
            contact_damping: needs.contact.then(|| vector(owned)),
            contact_energy: needs.contact.then(scalar),
            friction_energy: needs.contact.then(scalar),
            contact_damping_energy: needs.contact.then(scalar),
            relaxation_velocity: needs.relaxation.then(|| vector(owned)),
            equilibrium_displacement: needs.equilibria.then(|| vector(owned)),
            equilibrium_reaction: (needs.equilibria && needs.supports).then(|| vector(owned)),
            fictitious_density: needs.equilibria.then(scalar),
            contact_density: (needs.relaxation && needs.contact).then(scalar),
            last_seen: needs.coarsening.then(scalar),
            damped_energy: needs.damping.then(scalar),
            newly_broken_of_further: match needs.damage {
                true => vec![scalar(); needs.further_counts],
                false => Vec::new(),
            },
        }
    }

    /// Component `d` of the force density on an owned point, N/m³: internal force, external force and viscous
    /// damping, but not the reaction.
    #[inline]
    pub fn acting(&self, model: &Model<D>, d: usize, point: usize) -> f64 {
        let exerted = Exerted::new(&self.internal_force, self.external_force.as_ref(), d);
        model.with_damping(point, exerted.at(point), self.velocity[d][point])
    }

    /// Component `d` of the force density of all forces on an owned point, N/m³; 0 in equilibrium.
    #[inline]
    pub fn total_force(&self, model: &Model<D>, d: usize, point: usize) -> f64 {
        let reaction = self.reaction.as_ref().map_or(0.0, |field| field[d][point]);
        self.acting(model, d, point) + reaction
    }

    /// Record the bonds that broke at the end of a step: their number, the energy that they released, and
    /// their overshoot energy. `step` is the length of the step, s.
    ///
    /// The force F of a breaking bond acted in the first half kick of the step, but not in the second. So the
    /// points gave the bond less energy than it had at the end of the step. The difference is ½ F·Δℓ, where
    /// Δℓ is the change of the bond vector in the step. The released energy is reduced by this amount. The
    /// break is detected at the end of the step. On average, the bond reached its criterion in the middle of
    /// this step. Therefore neither motion nor energy depends on the step length to first order.
    pub fn book_broken(&mut self, model: &Model<D>, all: &[Broken<D>], step: f64) {
        let velocity = &self.velocity;
        let (Some(count), Some(new), Some(freed), Some(overshoot)) = (
            &mut self.broken_bonds,
            &mut self.newly_broken_bonds,
            &mut self.freed_energy,
            &mut self.overshoot_energy,
        ) else {
            return;
        };
        for broken in all {
            let point = broken.point;
            let power: f64 = (0..D).map(|d| broken.force[d] * velocity[d][point]).sum();
            count[point] += broken.count as f64;
            new[point] += broken.count as f64;
            for further in &mut self.newly_broken_of_further {
                further[point] += broken.count as f64;
            }
            freed[point] += broken.energy + 0.5 * step * model.volume[point] * power;
            overshoot[point] += broken.overshoot;
        }
    }

    /// Add the contact forces on an owned point to the internal forces. The contact forces are `repulsion`
    /// (N/m³), and the friction and damping that [`Self::book_dissipation`] has recorded. `energy` is the
    /// potential energy of the repulsion, J.
    pub fn add_contact(&mut self, point: usize, repulsion: [f64; D], energy: f64) {
        let (Some(contact), Some(friction), Some(damping), Some(potential)) = (
            &mut self.contact_force,
            &self.friction,
            &self.contact_damping,
            &mut self.contact_energy,
        ) else {
            return;
        };
        for d in 0..D {
            contact[d][point] = repulsion[d] + damping[d][point] + friction[d][point];
            self.internal_force[d][point] += contact[d][point];
        }
        potential[point] = energy;
    }

    /// Set contact force and contact energy of an owned point without contact to 0.
    pub fn clear_contact(&mut self, point: usize) {
        let columns = self.contact_force.iter_mut().flatten();
        for column in columns.chain(&mut self.contact_energy) {
            column[point] = 0.0;
        }
    }

    /// Set friction and contact damping to 0, because they do not act in load steps.
    pub fn clear_dissipative_contact(&mut self) {
        let forces = [&mut self.friction, &mut self.contact_damping];
        let columns = forces.into_iter().flatten().flatten();
        columns.for_each(|column| column.fill(0.0));
    }

    /// Fictitious density of each owned point (N/m⁴), with which iterations are stable. The density of a
    /// point that has never had an intact bond is infinite, so the point does not move.
    ///
    /// # Panics
    /// In a run without load steps.
    pub fn relaxation_density(&self) -> RelaxationDensity<'_> {
        RelaxationDensity {
            bonds: self.fictitious_density.as_deref().expect("a relaxation"),
            contact: self.contact_density.as_deref(),
        }
    }

    /// Record friction and contact damping (N/m³) on an owned point at the end of a step of length `step`
    /// (s). Add the energy that these forces have dissipated in this step. The energy is computed by the
    /// trapezoidal rule, with the velocities in the middle of the step.
    pub fn book_dissipation(
        &mut self,
        point: usize,
        volume: f64,
        step: f64,
        [friction, damping]: [[f64; D]; 2],
    ) {
        let velocity = &self.velocity;
        let both = [
            (&mut self.friction, friction, &mut self.friction_energy),
            (
                &mut self.contact_damping,
                damping,
                &mut self.contact_damping_energy,
            ),
        ];
        for (column, force, energy) in both {
            let (Some(column), Some(energy)) = (column, energy) else {
                continue;
            };
            for d in 0..D {
                let sum = column[d][point] + force[d];
                column[d][point] = force[d];
                energy[point] -= 0.5 * step * volume * sum * velocity[d][point];
            }
        }
    }

    /// Reset the main result's count of newly broken bonds to 0.
    pub fn forget_newly_broken(&mut self) {
        if let Some(new) = &mut self.newly_broken_bonds {
            new.fill(0.0);
        }
    }

    /// Reset the counts of bonds that have broken since the last output of a further result. `further` is the
    /// index of this result among the further results with such counts.
    pub fn forget_newly_broken_of(&mut self, further: usize) {
        if let Some(new) = self.newly_broken_of_further.get_mut(further) {
            new.fill(0.0);
        }
    }

    /// The columns of a field for output; `None` if this run does not store the field. Fields such as the
    /// damage are never stored, but computed for each output.
    pub fn offered(&self, field: Field) -> Option<&[Vec<f64>]> {
        self.each().find_map(|(description, columns)| {
            let there = !columns.is_empty() && description.output == Some(field);
            there.then_some(columns)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_that_decks_may_ask_for_have_their_units() {
        let model = Model::<2>::empty();
        let fields = Fields::new(&model, Needs::default());
        let mut offered = 0;
        for (description, _) in fields.each() {
            if let Some(output) = description.output {
                assert_eq!(description.unit, output.unit(), "{}", description.name);
                offered += 1;
            }
        }
        assert_eq!(offered, 8);
    }
}
