//! A run at one moment: fields for the result, found when they are asked for.

use nalgebra::{Matrix3, SMatrix};

use crate::component::Component;
use crate::dimension::{Constraint, Dimension};
use crate::elastic::Isotropic;
use crate::material::{PlasticState, determinant};
use crate::problem::Field;
use crate::solver::Simulation;
use crate::solver::bonds::Stored;
use crate::solver::motion::Fields;
use crate::solver::palette_column::PaletteColumn;

/// What the bonds hold at one moment; found once, used by fields and history.
pub struct Snapshot {
    /// Of the owned points.
    pub stored: Stored,
}

impl Snapshot {
    /// Looks at a run, whose forces are those of the present place.
    pub fn new<const D: usize>(simulation: &mut Simulation<'_, D>) -> Self {
        let mut stored = simulation.forces.stored(&simulation.model);
        stored.softened = simulation.forces.softened(&simulation.model);
        if let Some(work) = &simulation.fields.plastic_work {
            stored.dissipated.resize(work.len(), 0.0);
            for (dissipated, work) in stored.dissipated.iter_mut().zip(work) {
                *dissipated += work;
            }
        }
        Self { stored }
    }

    /// Without energies: neither for a row of the history nor for [`Field::StrainEnergyDensity`].
    pub fn without_energies<const D: usize>(simulation: &mut Simulation<'_, D>) -> Self {
        let mut stored = simulation.forces.intact_families(&simulation.model);
        stored.softened = simulation.forces.softened(&simulation.model);
        Self { stored }
    }

    /// Damage φ of an owned point: the share of its family's volume that is cut off (Dipasquale et
    /// al. 2014, eq. 7). The volume at a bond that softens counts as cut off to the share of its stiffness that it has
    /// lost. A point without family has 0.
    pub fn damage(&self, family_volume: &PaletteColumn, point: usize) -> f64 {
        let softened = self.stored.softened.get(point).copied().unwrap_or(0.0);
        match family_volume[point] {
            0.0 => 0.0,
            whole => 1.0 - (self.stored.volume[point] - softened) / whole,
        }
    }

    /// Number of intact bonds of the owned points; summed over the ranks each counts from both ends.
    pub fn intact(&self) -> u64 {
        let counts = self.stored.neighbours.iter();
        counts.map(|count| *count as u64).sum()
    }

    /// A field over the owned points, row-major with [`Field::components`] entries a point; of the
    /// moment of the snapshot.
    pub fn field<const D: usize>(
        &self,
        simulation: &mut Simulation<'_, D>,
        field: Field,
    ) -> Vec<f64> {
        let (model, fields) = (&simulation.model, &simulation.fields);
        let count = model.owned();
        if let Some(columns) = fields.offered(field) {
            return rows(columns, count, field.components());
        }
        match field {
            Field::Acceleration => {
                let acceleration = |d: usize, point: usize| {
                    let mut force = fields.acting(model, d, point);
                    if let Some(reaction) = &fields.reaction {
                        force += reaction[d][point];
                    }
                    force / model.density_of(point)
                };
                let columns: [Vec<f64>; D] =
                    std::array::from_fn(|d| (0..count).map(|k| acceleration(d, k)).collect());
                rows(&columns, count, 3)
            }
            Field::Damage => (0..count)
                .map(|point| self.damage(&simulation.family_volume, point))
                .collect(),
            Field::StrainEnergyDensity => self.stored.energy.clone(),
            Field::Neighbours => self.stored.neighbours.clone(),
            Field::Dilatation => {
                let [_, mut dilatation] = simulation.forces.dilatation(model);
                for (point, value) in dilatation.iter_mut().enumerate() {
                    *value = trace(simulation, point, *value);
                }
                dilatation
            }
            Field::WeightedVolume => {
                let [volume, _] = simulation.forces.dilatation(model);
                volume
            }
            Field::Stress => {
                let mut stress = simulation.forces.stress(model);
                across(simulation, &mut stress);
                rows(&stress, count, 6)
            }
            Field::CauchyStress => {
                let stress = self.field(simulation, Field::Stress);
                cauchy_stress(simulation, stress)
            }
            Field::VonMisesStress => {
                let stress = self.field(simulation, Field::CauchyStress);
                let von_mises = |stress: &[f64]| Component::VonMises.of(stress);
                stress.chunks_exact(6).map(von_mises).collect()
            }
            Field::DeformationGradient => {
                let all = simulation.forces.deformation_gradient(model);
                let whole = |tensor: &SMatrix<f64, D, D>| {
                    let mut whole = Matrix3::identity();
                    whole.view_mut((0, 0), (D, D)).copy_from(tensor);
                    whole.transpose()
                };
                all.iter()
                    .flat_map(|tensor| whole(tensor).data.0)
                    .flatten()
                    .collect()
            }
            Field::Strain => strain(simulation),
            Field::Singular => simulation.forces.singular(model),
            // Where none is prescribed.
            Field::Temperature => {
                let point = |point| model.expansion_of(point).reference_temperature;
                (0..count).map(point).collect()
            }
            Field::Fragment => simulation.fragment_ids(),
            Field::Rank => vec![simulation.comm.rank() as f64; count],
            // Where nothing touches, no bonds can break, and no points flow.
            Field::ContactForceDensity => vec![0.0; 3 * count],
            Field::BrokenBonds | Field::NewlyBrokenBonds | Field::PlasticStrainEquivalent => {
                vec![0.0; count]
            }
            Field::Displacement | Field::Velocity | Field::ForceDensity => {
                unreachable!("one of the points' own fields")
            }
        }
    }
}

/// Cauchy's stress from Kirchhoff's, row by row: over the volume that the deformed body has for one of
/// the undeformed. In plane stress the plate thins by its law; by default as Hooke's law has it,
/// ε_zz = −ν/(1 − ν) (ε_xx + ε_yy) with logarithmic strains. Under uniaxial stress a bar has ε_yy = ε_zz = −ν ε_xx.
fn cauchy_stress<const D: usize>(
    simulation: &mut Simulation<'_, D>,
    mut kirchhoff: Vec<f64>,
) -> Vec<f64> {
    let gradients = simulation.forces.deformation_gradient(&simulation.model);
    for (point, (stress, gradient)) in kirchhoff.chunks_exact_mut(6).zip(&gradients).enumerate() {
        let ratio = elastic(simulation, point).poisson_ratio;
        // Expansion by temperature is the same in all directions.
        let thermal = 1.0 + free_stretch(simulation, point);
        let gradient = gradient / thermal;
        let in_plane = determinant(&gradient);
        let growth = match simulation.problem.dimension {
            Dimension::PlaneStress { .. } => {
                let plastic = plastic_state(&simulation.fields, point);
                let (forces, model) = (&simulation.forces, &simulation.model);
                match forces.stretch_across(model, point, &gradient, &plastic) {
                    Some(stretch) => in_plane * stretch,
                    None => libm::pow(in_plane, (1.0 - 2.0 * ratio) / (1.0 - ratio)),
                }
            }
            Dimension::Line {
                constraint: Constraint::UniaxialStress,
                ..
            } => libm::pow(in_plane, 1.0 - 2.0 * ratio),
            _ => in_plane,
        };
        let growth = growth * thermal.powi(3);
        // A body turned inside out has no volume to speak of.
        let growth = if growth > 0.0 { growth } else { 1.0 };
        stress.iter_mut().for_each(|entry| *entry /= growth);
    }
    kirchhoff
}

/// Green–Lagrange strain ½(FᵀF − I) of the body in space, row by row: xx, yy, zz, xy, yz, xz.
fn strain<const D: usize>(simulation: &mut Simulation<'_, D>) -> Vec<f64> {
    let gradients = simulation.forces.deformation_gradient(&simulation.model);
    let mut rows = Vec::with_capacity(6 * gradients.len());
    for (point, gradient) in gradients.iter().enumerate() {
        let across = stretch_across(simulation, point, gradient);
        // Of F − I, so that small strains lose no digits.
        let mut change = Matrix3::identity() * (across - 1.0);
        change
            .view_mut((0, 0), (D, D))
            .copy_from(&(gradient - SMatrix::identity()));
        let entry = |a: usize, b: usize| {
            let product: f64 = (0..3).map(|k| change[(k, a)] * change[(k, b)]).sum();
            0.5 * (change[(a, b)] + change[(b, a)] + product)
        };
        let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];
        rows.extend(pairs.map(|(a, b)| entry(a, b)));
    }
    rows
}

/// The stretch of an owned point across the directions of the setting at this deformation gradient: 1 without strain
/// there.
fn stretch_across<const D: usize>(
    simulation: &Simulation<'_, D>,
    point: usize,
    gradient: &SMatrix<f64, D, D>,
) -> f64 {
    let thermal = 1.0 + free_stretch(simulation, point);
    let elastic_gradient = gradient / thermal;
    let in_setting = determinant(&elastic_gradient);
    // A body turned inside out has no volume to speak of.
    let in_setting = if in_setting > 0.0 { in_setting } else { 1.0 };
    let ratio = || elastic(simulation, point).poisson_ratio;
    let across = match simulation.problem.dimension {
        Dimension::PlaneStress { .. } => {
            let plastic = plastic_state(&simulation.fields, point);
            let (forces, model) = (&simulation.forces, &simulation.model);
            let by_law = forces.stretch_across(model, point, &elastic_gradient, &plastic);
            by_law.unwrap_or_else(|| libm::pow(in_setting, -ratio() / (1.0 - ratio())))
        }
        Dimension::Line {
            constraint: Constraint::UniaxialStress,
            ..
        } => libm::pow(in_setting, -ratio()),
        Dimension::PlaneStrain { .. } | Dimension::Line { .. } | Dimension::Space => return 1.0,
    };
    across * thermal
}

/// The elastic constants of an owned point's body.
fn elastic<const D: usize>(simulation: &Simulation<'_, D>, point: usize) -> Isotropic {
    let block = usize::from(simulation.model.block[point]);
    simulation.problem.block(block).body.material.elastic
}

/// The trace of the strain in space of an owned point from that in the setting's directions: without stress across a
/// plate, it thins by ε_zz = −ν/(1 − ν) (ε_xx + ε_yy), and a bar by ε_yy = ε_zz = −ν ε_xx, beside what temperature does.
fn trace<const D: usize>(simulation: &Simulation<'_, D>, point: usize, in_setting: f64) -> f64 {
    let share = match simulation.problem.dimension {
        Dimension::PlaneStress { .. } => {
            let ratio = elastic(simulation, point).poisson_ratio;
            (1.0 - 2.0 * ratio) / (1.0 - ratio)
        }
        Dimension::Line {
            constraint: Constraint::UniaxialStress,
            ..
        } => 1.0 - 2.0 * elastic(simulation, point).poisson_ratio,
        Dimension::PlaneStrain { .. } | Dimension::Line { .. } | Dimension::Space => {
            return in_setting;
        }
    };
    let free = free_stretch(simulation, point);
    share * (in_setting - D as f64 * free) + 3.0 * free
}

/// The stretch of an owned point by temperature in settings that leave it free across their directions, else 0: there, the
/// determinant of F is that of space.
fn free_stretch<const D: usize>(simulation: &Simulation<'_, D>, point: usize) -> f64 {
    match &simulation.fields.thermal_stretch {
        Some(stretch) if !simulation.problem.dimension.is_confined() => stretch[point],
        _ => 0.0,
    }
}

/// The stress −E α (T − T₀) of an owned point whose strain across the setting is 0, Pa.
fn thermal_stress<const D: usize>(simulation: &Simulation<'_, D>, point: usize) -> f64 {
    let Some(temperature) = &simulation.fields.temperature else {
        return 0.0;
    };
    let block = usize::from(simulation.model.block[point]);
    let material = &simulation.problem.block(block).body.material;
    let change = temperature[point] - material.expansion.reference_temperature;
    -material.elastic.youngs_modulus * material.expansion.coefficient * change
}

/// The plastic strain of an owned point; 0 where no points flow.
fn plastic_state<const D: usize>(fields: &Fields<D>, point: usize) -> PlasticState {
    let strain = fields.plastic_strain.as_ref();
    PlasticState {
        strain: strain.map_or([0.0; 6], |strain| {
            strain.each_ref().map(|column| column[point])
        }),
        ..PlasticState::default()
    }
}

/// Find the stress across the directions of the setting where there is no strain: zz by the law in plane strain,
/// ν (xx + yy) by default; yy = zz = ν/(1 − ν) xx under uniaxial strain. Temperature adds −E α ΔT, and −E α ΔT/(1 − ν).
fn across<const D: usize>(simulation: &mut Simulation<'_, D>, stress: &mut [Vec<f64>; 6]) {
    let [xx, yy, zz, ..] = stress;
    let by_law = match simulation.problem.dimension {
        Dimension::PlaneStrain { .. } => {
            let fields = &simulation.fields;
            let plastic = |point| plastic_state(fields, point);
            (simulation.forces).stress_across(&simulation.model, plastic)
        }
        _ => Vec::new(),
    };
    for point in 0..zz.len() {
        let ratio = elastic(simulation, point).poisson_ratio;
        match simulation.problem.dimension {
            Dimension::PlaneStrain { .. } => {
                let linear = ratio * (xx[point] + yy[point]);
                zz[point] = by_law[point].unwrap_or(linear) + thermal_stress(simulation, point);
            }
            Dimension::Line {
                constraint: Constraint::UniaxialStrain,
                ..
            } => {
                let thermal = thermal_stress(simulation, point) / (1.0 - ratio);
                zz[point] = ratio / (1.0 - ratio) * xx[point] + thermal;
                yy[point] = zz[point];
            }
            Dimension::PlaneStress { .. } | Dimension::Line { .. } | Dimension::Space => {}
        }
    }
}

/// Rows of so many components, 0 where there is no column.
fn rows(columns: &[Vec<f64>], count: usize, components: usize) -> Vec<f64> {
    let mut values = vec![0.0; components * count];
    for (d, column) in columns.iter().enumerate() {
        let places = values.iter_mut().skip(d).step_by(components);
        for (value, number) in places.zip(column) {
            *value = *number;
        }
    }
    values
}
