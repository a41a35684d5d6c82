//! Stress measures of points, computed from the Cauchy stress, for failure criteria.

use nalgebra::{Matrix3, SMatrix};

use crate::damage::StressMeasure;
use crate::dimension::Dimension;
use crate::lanes::Column;
use crate::material::{FamilyStress, Law, MOST, PlasticState, determinant};
use crate::solver::model::Model;

use super::interaction::BlockLaws;
use super::point_numbers::{PlasticColumns, PointNumbers, over_points};

/// Inputs of the stress measures, in addition to the sums of the law's first pass.
pub struct StressInputs<'a, 'b, const D: usize> {
    /// Model of the points, which gives the block of each point.
    pub model: &'a Model<D>,
    /// Laws of the blocks, by index of the block.
    pub blocks: &'a [BlockLaws],
    /// Plastic states of the owned points.
    pub plastic: &'a PlasticColumns<'b>,
    /// Thermal stretches of the local points; `None` in runs without temperatures.
    pub thermal_stretch: Option<&'a [f64]>,
}

impl PointNumbers {
    /// Compute the stress measures of the owned points (Pa) from the sums of the law's first pass; −∞ for
    /// points that carry no stress. Measures with empty columns are skipped.
    pub fn find_stresses<const D: usize>(
        &self,
        read: &StressInputs<'_, '_, D>,
        stresses: &mut [Column; StressMeasure::ALL.len()],
    ) {
        let owned = 0..read.model.owned();
        let columns = stresses.each_mut().map(|column| {
            let own = column.get_mut(owned.clone());
            own.unwrap_or_default()
        });
        if columns.iter().all(|column| column.is_empty()) {
            return;
        }
        let plastic: [&[f64]; PlasticState::COUNT] =
            read.plastic.each_ref().map(|column| &**column);
        over_points(owned, columns, &|points, columns| {
            for (k, point) in points.enumerate() {
                let block = &read.blocks[usize::from(read.model.block[point])];
                let mut sums = [0.0; MOST.sum];
                for (sum, column) in sums.iter_mut().zip(&self.sums) {
                    *sum = column[point];
                }
                let numbers = self.of(point);
                let state = plastic.map(|column| column.get(point).copied().unwrap_or(0.0));
                let state = PlasticState::of(state);
                let of_family = Law::<D>::family_stress(&block.law, &sums, &numbers, &state);
                let thermal = read.thermal_stretch.map_or(0.0, |stretch| stretch[point]);
                let stress = of_family.and_then(|found| cauchy(block, &found, thermal));
                for (measure, column) in StressMeasure::ALL.into_iter().zip(columns.iter_mut()) {
                    if let Some(entry) = column.get_mut(k) {
                        *entry = stress.map_or(f64::NEG_INFINITY, |stress| measure.of(&stress));
                    }
                }
            }
        });
    }
}

/// Compute the 3-D Cauchy stress of a point (Pa) with the thermal stretch `thermal`; `None` if the deformed
/// volume is not positive.
fn cauchy<const D: usize>(
    block: &BlockLaws,
    found: &FamilyStress<D>,
    thermal: f64,
) -> Option<Matrix3<f64>> {
    let FamilyStress {
        gradient,
        piola,
        plastic,
    } = found;
    let deformation = SMatrix::<f64, D, D>::identity() + gradient;
    let kirchhoff = piola * deformation.transpose();
    let mut stress = Matrix3::zeros();
    for a in 0..D {
        for b in 0..D {
            stress[(a, b)] = 0.5 * (kirchhoff[(a, b)] + kirchhoff[(b, a)]);
        }
    }
    let in_plane = determinant(&deformation);
    let ratio = block.elastic.poisson_ratio;
    let (out_of_plane_stretch, directions) = match block.dimension {
        Dimension::PlaneStress { .. } => {
            let stretch = Law::<D>::out_of_plane_stretch(&block.law, gradient, plastic);
            let default = || libm::pow(in_plane, -ratio / (1.0 - ratio));
            (stretch.unwrap_or_else(default), 3)
        }
        Dimension::PlaneStrain { .. } => {
            let of_law = Law::<D>::out_of_plane_stress(&block.law, gradient, plastic);
            let default = ratio * (stress[(0, 0)] + stress[(1, 1)]);
            // In plane strain, `thermal` is (1 + ν) α ΔT. The thermal stress −E α ΔT perpendicular to the
            // plane is therefore −2G `thermal`.
            let confined = 2.0 * block.elastic.shear_modulus() * thermal;
            stress[(2, 2)] = of_law.unwrap_or(default) - confined;
            (1.0, 2)
        }
        Dimension::Space | Dimension::Line { .. } => (1.0, 3),
    };
    let volume_ratio = in_plane * out_of_plane_stretch * (1.0 + thermal).powi(directions);
    (volume_ratio > 0.0).then(|| stress / volume_ratio)
}
