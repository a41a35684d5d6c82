//! Snapshot of a run at one time. Fields for the result are computed from the snapshot on request.

use nalgebra::{Matrix3, SMatrix};

use crate::component::Component;
use crate::dimension::{Constraint, Dimension};
use crate::elastic::Isotropic;
use crate::material::{PlasticState, determinant};
use crate::problem::Field;
use crate::solver::Simulation;
use crate::solver::bonds::BondSums;
use crate::solver::motion::Fields;
use crate::solver::palette_column::PaletteColumn;

/// Bond quantities at one time, computed once for all fields and the history.
pub struct Snapshot {
    /// Bond quantities of the owned points.
    pub stored: BondSums,
}

impl Snapshot {
    /// Take a snapshot of a run. The forces must have been evaluated at the present positions.
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

    /// Take a snapshot from which these fields can be computed. Energies are summed only if a field needs
    /// them. For a row of the history, use [`Self::new`], because rows always need energies.
    pub fn for_fields<const D: usize>(
        simulation: &mut Simulation<'_, D>,
        fields: impl IntoIterator<Item = Field>,
    ) -> Self {
        let mut fields = fields.into_iter();
        if fields.any(|field| field == Field::StrainEnergyDensity) {
            Self::new(simulation)
        } else {
            Self::without_energies(simulation)
        }
    }

    /// Take a snapshot without energies.
    pub fn without_energies<const D: usize>(simulation: &mut Simulation<'_, D>) -> Self {
        let mut stored = simulation.forces.intact_families(&simulation.model);
        stored.softened = simulation.forces.softened(&simulation.model);
        Self { stored }
    }

    /// Damage φ of an owned point: the volume of the neighbours whose bonds to the point are broken, divided
    /// by the volume of the family (Dipasquale et al. 2014, eq. 7). A bond that softens contributes V_j
    /// times the fraction of its stiffness that it has lost. Damage is 0 for a point without a family.
    pub fn damage(&self, family_volume: &PaletteColumn, point: usize) -> f64 {
        let softened = self.stored.softened.get(point).copied().unwrap_or(0.0);
        match family_volume[point] {
            0.0 => 0.0,
            whole => 1.0 - (self.stored.volume[point] - softened) / whole,
        }
    }

    /// Number of intact bonds of the owned points. In the sum over all ranks, each bond counts twice.
    pub fn intact(&self) -> u64 {
        let counts = self.stored.neighbours.iter();
        counts.map(|count| *count as u64).sum()
    }

    /// Compute a field over the owned points at the time of the snapshot. The values are ordered by point,
    /// with [`Field::components`] entries per point. Some fields need messages between ranks. Collective.
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
                .map(|point| self.damage(&simulation.undeformed.family_volume, point))
                .collect(),
            Field::StrainEnergyDensity => self.stored.energy.clone(),
            Field::Neighbours => self.stored.neighbours.clone(),
            Field::Dilatation => {
                let thermal = simulation.fields.thermal_stretch.as_deref();
                let [_, mut dilatation] = simulation.forces.dilatation(model, thermal);
                for (point, value) in dilatation.iter_mut().enumerate() {
                    *value = trace(simulation, point, *value);
                }
                dilatation
            }
            Field::WeightedVolume => {
                let [volume, _] = simulation.forces.dilatation(model, None);
                volume
            }
            Field::Stress => {
                let mut stress = simulation.forces.stress(model);
                set_out_of_plane_stress(simulation, &mut stress);
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
            // Runs without prescribed temperatures do not store this field. All points then have the
            // reference temperature of their material.
            Field::Temperature => {
                let point = |point| model.expansion_of(point).reference_temperature;
                (0..count).map(point).collect()
            }
            Field::Fragment => simulation.fragment_ids(),
            Field::Rank => vec![simulation.comm.rank() as f64; count],
            // Runs without contact, damage or plasticity do not store these fields; their values are 0.
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

/// Convert Kirchhoff stress to Cauchy stress, with six components per point. The stress is divided by J, the
/// ratio of deformed to undeformed volume. In plane stress and under uniaxial stress, J depends on the
/// stretch perpendicular to the plane or bar. In plane stress, some laws compute this stretch. For the other
/// laws in plane stress, and for all laws under uniaxial stress, the stretch follows from Hooke's law with
/// logarithmic strains: ε_zz = −ν/(1 − ν) (ε_xx + ε_yy) in plane stress, and ε_yy = ε_zz = −ν ε_xx under
/// uniaxial stress.
fn cauchy_stress<const D: usize>(
    simulation: &mut Simulation<'_, D>,
    mut kirchhoff: Vec<f64>,
) -> Vec<f64> {
    let gradients = simulation.forces.deformation_gradient(&simulation.model);
    for (point, (stress, gradient)) in kirchhoff.chunks_exact_mut(6).zip(&gradients).enumerate() {
        let ratio = elastic(simulation, point).poisson_ratio;
        // The formulas below hold without thermal expansion, so F is divided by the isotropic thermal
        // stretch.
        let thermal = 1.0 + free_stretch(simulation, point);
        let gradient = gradient / thermal;
        let in_plane = determinant(&gradient);
        let volume_ratio = match simulation.problem.dimension {
            Dimension::PlaneStress { .. } => {
                let plastic = plastic_state(&simulation.fields, point);
                let (forces, model) = (&simulation.forces, &simulation.model);
                match forces.out_of_plane_stretch(model, point, &gradient, &plastic) {
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
        let volume_ratio = volume_ratio * thermal.powi(3);
        // The volume ratio of an inverted family has no meaning, so 1 is used.
        let volume_ratio = if volume_ratio > 0.0 {
            volume_ratio
        } else {
            1.0
        };
        stress.iter_mut().for_each(|entry| *entry /= volume_ratio);
    }
    kirchhoff
}

/// 3-D Green–Lagrange strain ½(FᵀF − I), with the components xx, yy, zz, xy, yz, xz for each point.
fn strain<const D: usize>(simulation: &mut Simulation<'_, D>) -> Vec<f64> {
    let gradients = simulation.forces.deformation_gradient(&simulation.model);
    let mut rows = Vec::with_capacity(6 * gradients.len());
    for (point, gradient) in gradients.iter().enumerate() {
        let out_of_plane = out_of_plane_stretch(simulation, point, gradient);
        // The strain is computed from F − I, so that small strains lose no digits.
        let mut change = Matrix3::identity() * (out_of_plane - 1.0);
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

/// Stretch ratio (deformed over reference length) perpendicular to the plane or bar. `gradient` is the
/// deformation gradient of the owned point `point`. The ratio is 1 in plane strain, under uniaxial
/// strain, and in 3-D.
fn out_of_plane_stretch<const D: usize>(
    simulation: &Simulation<'_, D>,
    point: usize,
    gradient: &SMatrix<f64, D, D>,
) -> f64 {
    let thermal = 1.0 + free_stretch(simulation, point);
    let elastic_gradient = gradient / thermal;
    let in_plane = determinant(&elastic_gradient);
    // The area ratio of an inverted family has no meaning, so 1 is used.
    let in_plane = if in_plane > 0.0 { in_plane } else { 1.0 };
    let ratio = || elastic(simulation, point).poisson_ratio;
    let out_of_plane = match simulation.problem.dimension {
        Dimension::PlaneStress { .. } => {
            let plastic = plastic_state(&simulation.fields, point);
            let (forces, model) = (&simulation.forces, &simulation.model);
            let by_law = forces.out_of_plane_stretch(model, point, &elastic_gradient, &plastic);
            by_law.unwrap_or_else(|| libm::pow(in_plane, -ratio() / (1.0 - ratio())))
        }
        Dimension::Line {
            constraint: Constraint::UniaxialStress,
            ..
        } => libm::pow(in_plane, -ratio()),
        Dimension::PlaneStrain { .. } | Dimension::Line { .. } | Dimension::Space => return 1.0,
    };
    out_of_plane * thermal
}

/// Elastic constants of the body of an owned point.
fn elastic<const D: usize>(simulation: &Simulation<'_, D>, point: usize) -> Isotropic {
    let block = usize::from(simulation.model.block[point]);
    simulation.problem.block(block).body.material.elastic
}

/// Trace of the 3-D strain of an owned point. `in_plane` is the trace in the plane, or the strain along the
/// bar. In plane stress, ε_zz = −ν/(1 − ν) (ε_xx + ε_yy); under uniaxial stress, ε_yy = ε_zz = −ν ε_xx.
/// These relations hold for the strain without thermal strain. The thermal strain is added afterwards.
fn trace<const D: usize>(simulation: &Simulation<'_, D>, point: usize, in_plane: f64) -> f64 {
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
            return in_plane;
        }
    };
    let free = free_stretch(simulation, point);
    share * (in_plane - D as f64 * free) + 3.0 * free
}

/// Thermal stretch of an owned point in 3-D, in plane stress, or in a bar that can expand sideways; 0 without
/// temperatures. Under plane or uniaxial strain, the result is 0, because no thermal correction is needed.
/// The stretch ratio perpendicular to the plane or bar is then 1, so the determinant of F is also the
/// determinant of the 3-D deformation gradient.
fn free_stretch<const D: usize>(simulation: &Simulation<'_, D>, point: usize) -> f64 {
    match &simulation.fields.thermal_stretch {
        Some(stretch) if !simulation.problem.dimension.is_confined() => stretch[point],
        _ => 0.0,
    }
}

/// Return −E α (T − T₀) of an owned point, Pa. This is the thermal stress in plane strain. The thermal stress
/// under uniaxial strain is this value divided by 1 − ν. E is Young's modulus, ν Poisson's ratio, α the
/// coefficient of thermal expansion, T the temperature, and T₀ the reference temperature.
fn thermal_stress<const D: usize>(simulation: &Simulation<'_, D>, point: usize) -> f64 {
    let Some(temperature) = &simulation.fields.temperature else {
        return 0.0;
    };
    let block = usize::from(simulation.model.block[point]);
    let material = &simulation.problem.block(block).body.material;
    let change = temperature[point] - material.expansion.reference_temperature;
    -material.elastic.youngs_modulus * material.expansion.coefficient * change
}

/// Plastic state of an owned point. Only the plastic strain of this state is set; the strain is 0 without
/// plasticity.
fn plastic_state<const D: usize>(fields: &Fields<D>, point: usize) -> PlasticState {
    let strain = fields.plastic_strain.as_ref();
    PlasticState {
        strain: strain.map_or([0.0; 6], |strain| {
            strain.each_ref().map(|column| column[point])
        }),
        ..PlasticState::default()
    }
}

/// Set the stress perpendicular to the plane or bar, if the strain in this direction is 0. In plane strain,
/// zz is the value of the law, or ν (xx + yy) if the law computes no value. Under uniaxial strain, yy = zz =
/// ν/(1 − ν) xx. Temperature adds −E α ΔT in plane strain, and −E α ΔT/(1 − ν) under uniaxial strain.
fn set_out_of_plane_stress<const D: usize>(
    simulation: &mut Simulation<'_, D>,
    stress: &mut [Vec<f64>; 6],
) {
    let [xx, yy, zz, ..] = stress;
    let by_law = match simulation.problem.dimension {
        Dimension::PlaneStrain { .. } => {
            let fields = &simulation.fields;
            let plastic = |point| plastic_state(fields, point);
            (simulation.forces).out_of_plane_stress(&simulation.model, plastic)
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

/// Convert columns to rows. Each of the `count` points has one row of `components` values. Missing columns
/// are 0.
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
