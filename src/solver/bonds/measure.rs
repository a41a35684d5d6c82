//! Quantities of the owned points for set-up and output, computed from their bonds.

use std::ops::Range;

use nalgebra::SMatrix;

use crate::families::BlockBonds;
use crate::lanes::{Column, LaneTuple, Lanes};
use crate::material::{Law, PlasticState, ShapeTensor};
use crate::solver::model::Model;

use super::Forces;
use super::broken_moments::{MomentSums, Moments};
use super::interaction::Interaction;
use super::kernel::Kernel;
use super::measures;
use super::sweep::{PointData, sweep, sweep_from};

/// Sums over the bonds of each owned point, one column per sum.
#[derive(Debug, Clone, PartialEq)]
pub struct BondSums {
    /// Strain energy density W, J/m³; empty if energies were not requested.
    pub energy: Vec<f64>,
    /// Volume of the intact neighbours within the horizon of the point, m³.
    pub volume: Vec<f64>,
    /// Sum over the intact neighbours j: V_j times the fraction of the stiffness that bond ij has lost, m³.
    /// Empty if no law softens, or if this sum was not requested.
    pub softened: Vec<f64>,
    /// Number of intact bonds, including bonds longer than the horizon of the point.
    pub neighbours: Vec<f64>,
    /// Energy density that bonds have dissipated without breaking, J/m³; empty if no law has a bond history
    /// or if energies were not requested.
    pub dissipated: Vec<f64>,
}

impl<const D: usize> Forces<D> {
    /// Allocate columns of zeros, with one entry per owned point. Call `sweep` with these columns for each
    /// pair of blocks that have bonds to each other. Return the columns.
    fn measure(
        &mut self,
        owned: usize,
        columns: usize,
        mut sweep: impl FnMut(&mut Interaction, &mut [Vec<f64>], PointData<'_, D>),
    ) -> Vec<Vec<f64>> {
        let mut sums = vec![vec![0.0; owned]; columns];
        self.for_each_interaction(|interaction, source| sweep(interaction, &mut sums, source));
        sums
    }

    /// Sum the quantities of [`BondSums`] except `softened` for each owned point, at the displacements of the
    /// last [evaluation](Self::evaluate).
    pub fn stored(&mut self, model: &Model<D>) -> BondSums {
        self.stored_at(model, 0..model.owned())
    }

    /// Same as [`Self::stored`], for a range of points that consists of whole lane groups.
    pub(super) fn stored_at(&mut self, model: &Model<D>, points: Range<usize>) -> BondSums {
        let mut columns: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; points.len()]);
        self.for_each_interaction(|interaction, source| {
            let [law, _] = interaction.laws.laws();
            let keeps_history = law.counts::<D>().bond_history > 0;
            let kernel = measures::EnergiesAndFamilies { law, keeps_history };
            let results = <[Lanes; 4]>::columns_mut(&mut columns);
            let (bonds, base) = (&mut interaction.bonds, points.start);
            sweep_from(bonds, points.clone(), base, results, &kernel, source);
        });
        let [mut energy, volume, neighbours, dissipated] = columns;
        if self.numbers.passes > 0 {
            for (point, energy) in points.zip(&mut energy) {
                let law = &self.blocks[usize::from(model.block[point])].law;
                *energy += Law::<D>::point_energy(law, &self.numbers.of(point));
            }
        }
        BondSums {
            energy,
            volume,
            softened: Vec::new(),
            neighbours,
            dissipated: if self.has_history {
                dissipated
            } else {
                Vec::new()
            },
        }
    }

    /// Same as [`Self::stored`] without the energies, whose computation takes most of the time.
    pub fn intact_families(&mut self, model: &Model<D>) -> BondSums {
        let columns = self.measure(model.owned(), 2, |interaction, sums, source| {
            sweep_all(
                &mut interaction.bonds,
                sums,
                &measures::IntactFamilies,
                source,
            );
        });
        let [volume, neighbours] = columns.try_into().expect("two columns");
        BondSums {
            energy: Vec::new(),
            volume,
            softened: Vec::new(),
            neighbours,
            dissipated: Vec::new(),
        }
    }

    /// Compute [`BondSums::softened`].
    pub fn softened(&mut self, model: &Model<D>) -> Vec<f64> {
        if !self.blocks.iter().any(|block| block.law.softens::<D>()) {
            return Vec::new();
        }
        let mut columns = self.measure(model.owned(), 1, |interaction, sums, source| {
            let [law, _] = interaction.laws.laws();
            if law.softens::<D>() {
                let kernel = measures::Softened { law };
                sweep_all(&mut interaction.bonds, sums, &kernel, source);
            }
        });
        columns.swap_remove(0)
    }

    /// Compute the [`Moments`] of each owned point. In 3-D only.
    pub fn broken_moments(&mut self, model: &Model<D>) -> Vec<Moments> {
        let columns = self.measure(model.owned(), 14, |interaction, sums, source| {
            sweep_all(&mut interaction.bonds, sums, &MomentSums, source);
        });
        let of_point = |point| Moments(std::array::from_fn(|k| columns[k][point]));
        (0..model.owned()).map(of_point).collect()
    }

    /// Compute the tensor D (N/m⁴) of each owned point, as defined by `measures::Stiffness`. The columns are
    /// xx, yy, zz, xy, yz, xz.
    pub fn stiffness(&mut self, model: &Model<D>) -> [Vec<f64>; 6] {
        let columns = self.measure(model.owned(), 6, |interaction, sums, source| {
            let laws = interaction.laws.laws();
            let kernel = measures::Stiffness { laws };
            sweep_all(&mut interaction.bonds, sums, &kernel, source);
        });
        columns.try_into().expect("six columns")
    }

    /// Compute the Kirchhoff stress of each owned point (Pa) at the displacements of the last
    /// [evaluation](Self::evaluate). The columns are xx, yy, zz, xy, yz, xz.
    pub fn stress(&mut self, model: &Model<D>) -> [Vec<f64>; 6] {
        let columns = self.measure(model.owned(), 6, |interaction, sums, source| {
            let [law, _] = interaction.laws.laws();
            let kernel = measures::Stress { law };
            sweep_all(&mut interaction.bonds, sums, &kernel, source);
        });
        columns.try_into().expect("six columns")
    }

    /// Compute the out-of-plane Kirchhoff stress of each owned point (Pa) in plane strain, see
    /// [`Law::out_of_plane_stress`]. The displacements are those of the last [evaluation](Self::evaluate).
    /// `plastic` returns the plastic state of a point. The result is `None` for a point whose law does not
    /// compute this stress.
    pub fn out_of_plane_stress(
        &mut self,
        model: &Model<D>,
        plastic: impl Fn(usize) -> PlasticState,
    ) -> Vec<Option<f64>> {
        let gradients = self.elastic_gradient(model);
        let columns = self.measure(model.owned(), 1, |interaction, sums, source| {
            let [law, _] = interaction.laws.laws();
            if law.has_out_of_plane_bond_stress::<D>() {
                let kernel = measures::OutOfPlaneStress { law };
                sweep_all(&mut interaction.bonds, sums, &kernel, source);
            }
        });
        let stress = |point: usize| {
            let law = &self.blocks[usize::from(model.block[point])].law;
            let gradient = gradients[point] - SMatrix::identity();
            let of_point = Law::<D>::out_of_plane_stress(law, &gradient, &plastic(point))?;
            Some(if law.has_out_of_plane_bond_stress::<D>() {
                columns[0][point]
            } else {
                of_point
            })
        };
        (0..model.owned()).map(stress).collect()
    }

    /// Out-of-plane stretch F_zz of an owned point in plane stress, at its deformation gradient and plastic
    /// state. `None` if the law does not compute this stretch; see [`Law::out_of_plane_stretch`].
    pub fn out_of_plane_stretch(
        &self,
        model: &Model<D>,
        point: usize,
        deformation: &SMatrix<f64, D, D>,
        plastic: &PlasticState,
    ) -> Option<f64> {
        let law = &self.blocks[usize::from(model.block[point])].law;
        let gradient = deformation - SMatrix::identity();
        Law::<D>::out_of_plane_stretch(law, &gradient, plastic)
    }

    /// Compute the deformation gradient F = I + (Σ ω η⊗ξ Ṽ) K⁻¹ of each owned point at the displacements of
    /// the last [evaluation](Self::evaluate). The sum and the shape tensor K contain only the intact bonds. F
    /// is I if the point is [singular](Self::singular) or its shape tensor is nearly singular.
    pub fn deformation_gradient(&mut self, model: &Model<D>) -> Vec<SMatrix<f64, D, D>> {
        self.gradient(model, false)
    }

    /// Same as [`Self::deformation_gradient`], but the thermal stretch of each bond is excluded.
    pub fn elastic_gradient(&mut self, model: &Model<D>) -> Vec<SMatrix<f64, D, D>> {
        self.gradient(model, true)
    }

    fn gradient(&mut self, model: &Model<D>, is_elastic: bool) -> Vec<SMatrix<f64, D, D>> {
        let mut gradients = self.change_of_gradient(model, is_elastic);
        for gradient in &mut gradients {
            *gradient += SMatrix::identity();
        }
        gradients
    }

    /// Displacement gradient F − I of each owned point; see [`Self::deformation_gradient`].
    pub fn displacement_gradient(&mut self, model: &Model<D>) -> Vec<SMatrix<f64, D, D>> {
        self.change_of_gradient(model, false)
    }

    fn change_of_gradient(
        &mut self,
        model: &Model<D>,
        is_elastic: bool,
    ) -> Vec<SMatrix<f64, D, D>> {
        let kernel = measures::FamilyTensors { is_elastic };
        let columns = self.measure(model.owned(), 2 * D + D * D, |interaction, sums, source| {
            sweep_all(&mut interaction.bonds, sums, &kernel, source);
        });
        let gradient = |point: usize| {
            let entry = |k: usize| columns[k][point];
            let shape: Vec<f64> = (0..2 * D).map(entry).collect();
            let moved = SMatrix::from_fn(|a, b| entry(2 * D + D * a + b));
            let inverse = if self.is_singular(model, point) {
                None
            } else {
                ShapeTensor::new(&shape).inverse()
            };
            let change = inverse.map(|inverse| moved * inverse);
            change.unwrap_or_else(SMatrix::zeros)
        };
        (0..model.owned()).map(gradient).collect()
    }

    /// Compute the rate of change of the strain energy density of each owned point. v is the given rate of
    /// change of a point's displacement. The result is Σ T·(v_j − v_i) Ṽ over the intact bonds. T are the
    /// force states of the last [evaluation](Self::evaluate). `rate` contains the components of v at the
    /// local points, including ghosts. The unit of the result is J/m⁴ times the unit of v.
    pub fn energy_rate(&mut self, owned: usize, rate: [Column; D]) -> Vec<f64> {
        // The kernel reads the rates as the first point numbers.
        for grid in &mut self.grids {
            grid.insert_numbers(&rate);
        }
        self.numbers.columns.splice(0..0, rate);
        self.numbers.read += D;
        let mut columns = self.measure(owned, 1, |interaction, sums, source| {
            let [law, _] = interaction.laws.laws();
            let kernel = measures::EnergyRate { law };
            sweep_all(&mut interaction.bonds, sums, &kernel, source);
        });
        self.numbers.read -= D;
        self.numbers.columns.drain(..D);
        for grid in &mut self.grids {
            grid.remove_numbers(D);
        }
        columns.swap_remove(0)
    }

    /// Flag singular owned points with 1, others with 0. A singular point carries no force, see
    /// [`Law::is_singular`].
    pub fn singular(&self, model: &Model<D>) -> Vec<f64> {
        let flag = |point| f64::from(u8::from(self.is_singular(model, point)));
        (0..model.owned()).map(flag).collect()
    }

    fn is_singular(&self, model: &Model<D>, point: usize) -> bool {
        let law = &self.blocks[usize::from(model.block[point])].law;
        Law::<D>::is_singular(law, &self.numbers.of(point))
    }

    /// Whether any law can have [singular](Self::singular) points; the same on all ranks.
    pub fn can_be_singular(&self) -> bool {
        self.blocks
            .iter()
            .any(|block| Law::<D>::needs_shape(&block.law))
    }

    /// Weighted volume m (m⁵) and dilatation θ of each owned point, at the displacements of the last
    /// [evaluation](Self::evaluate). `thermal_stretch` are the thermal stretches of the local points; `None`
    /// in runs without temperatures.
    pub fn dilatation(
        &mut self,
        model: &Model<D>,
        thermal_stretch: Option<&[f64]>,
    ) -> [Vec<f64>; 2] {
        let columns = self.measure(model.owned(), 3, |interaction, sums, source| {
            let [law, _] = interaction.laws.laws();
            let is_linear = law.is_linear::<D>();
            let kernel = measures::Dilatation { is_linear };
            sweep_all(&mut interaction.bonds, sums, &kernel, source);
        });
        let [mut weighted_volume, intact, mut growth] = columns.try_into().expect("three columns");
        for (point, growth) in growth.iter_mut().enumerate() {
            let law = &self.blocks[usize::from(model.block[point])].law;
            let numbers = self.numbers.of(point);
            let of_law = Law::<D>::weighted_volume(law, &numbers);
            if let Some(volume) = of_law {
                weighted_volume[point] = volume;
            }
            // θ is the elastic dilatation plus the thermal strain. If the law stores its weighted volume, the
            // sum for θ is divided by this volume, which includes broken bonds. Otherwise the sum is divided
            // by the weighted volume of the intact bonds. `growth` contains the thermal strain of the intact
            // bonds only, so the thermal strain of the broken bonds is added.
            let volume = of_law.unwrap_or(intact[point]);
            let thermal = D as f64 * thermal_stretch.map_or(0.0, |stretch| stretch[point]);
            *growth = match Law::<D>::dilatation(law, &numbers) {
                Some(elastic) => elastic + thermal,
                None if volume > 0.0 => {
                    D as f64 * *growth / volume + thermal * (1.0 - intact[point] / volume)
                }
                None => thermal,
            };
        }
        [weighted_volume, growth]
    }
}

/// Run a kernel over all bonds between two blocks.
fn sweep_all<K: Kernel<D>, const D: usize>(
    bonds: &mut BlockBonds,
    sums: &mut [Vec<f64>],
    kernel: &K,
    source: PointData<'_, D>,
) {
    let owned = sums.first().map_or(0, Vec::len);
    let results = K::Sums::columns_mut(sums);
    sweep(bonds, 0..owned, results, kernel, source);
}
