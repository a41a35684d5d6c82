//! Data of the points and blocks that time steps do not change.

use crate::dimension::Dimension;
use crate::partition::Domain;
use crate::problem::{Material, Problem};

use super::palette_column::PaletteColumn;

/// Reference data of the local points, and the properties of the blocks.
pub struct Model<const D: usize> {
    /// Reference positions by component, m; owned points, then ghosts.
    pub reference: [Vec<f64>; D],
    /// Volumes, m³; owned points, then ghosts.
    pub volume: PaletteColumn,
    /// Index of the block of each owned point.
    pub block: Vec<u16>,
    /// Global ids; owned points, then ghosts.
    pub ids: Vec<u64>,
    /// Density of each block, multiplied by the density scale of the present stage, kg/m³.
    pub density: Vec<f64>,
    /// Rate r of viscous damping of each block, 1/s. The damping force density at a velocity u̇ is −r ρ u̇,
    /// with the density ρ.
    pub damping: Vec<f64>,
    /// Thermal expansion of each block.
    pub expansion: Vec<Expansion>,
    /// Number of interior points, which are owned points without bonds to ghosts. Interior points have the
    /// lowest local indices.
    pub interior: usize,
    /// Number of points over all ranks.
    pub total: u64,
    /// Number of points of level 0 over all ranks. These points have the lowest ids.
    pub coarsest: u64,
}

/// Thermal expansion: along the bar in 1-D, in the plane in 2-D, in all directions in 3-D.
#[derive(Debug, Clone, Copy)]
pub struct Expansion {
    /// Free thermal stretch per kelvin, 1/K.
    pub stretch_per_kelvin: f64,
    /// Temperature with zero thermal stretch, in the unit of the prescribed temperatures.
    pub reference_temperature: f64,
}

impl Expansion {
    /// Free thermal stretch at a temperature.
    pub fn stretch_at(self, temperature: f64) -> f64 {
        self.stretch_per_kelvin * (temperature - self.reference_temperature)
    }

    fn of(material: &Material, dimension: Dimension) -> Self {
        let (expansion, ratio) = (material.expansion, material.elastic.poisson_ratio);
        Self {
            stretch_per_kelvin: expansion.free_stretch_per_kelvin(dimension, ratio),
            reference_temperature: expansion.reference_temperature,
        }
    }
}

impl<const D: usize> Model<D> {
    /// Create the model from a distributed point cloud. `coarsest` is the number of points of level 0 over
    /// all ranks.
    pub fn new(problem: &Problem, domain: &Domain, coarsest: u64) -> Self {
        let owned = &domain.points[..domain.owned];
        Self {
            reference: std::array::from_fn(|d| {
                domain
                    .points
                    .iter()
                    .map(|point| point.position[d])
                    .collect()
            }),
            volume: PaletteColumn::new(domain.points.iter().map(|point| point.volume).collect()),
            block: owned.iter().map(|point| point.block as u16).collect(),
            ids: domain.points.iter().map(|point| point.id).collect(),
            density: problem
                .blocks()
                .map(|block| block.body.material.density)
                .collect(),
            damping: problem
                .blocks()
                .map(|block| block.body.material.damping)
                .collect(),
            expansion: problem
                .blocks()
                .map(|block| Expansion::of(&block.body.material, problem.dimension))
                .collect(),
            interior: domain.interior,
            total: domain.total,
            coarsest,
        }
    }

    /// Create a model without points.
    pub fn empty() -> Self {
        Self {
            reference: std::array::from_fn(|_| Vec::new()),
            volume: PaletteColumn::new(Vec::new()),
            block: Vec::new(),
            ids: Vec::new(),
            density: Vec::new(),
            damping: Vec::new(),
            expansion: Vec::new(),
            interior: 0,
            total: 0,
            coarsest: 0,
        }
    }

    /// Number of owned points.
    pub fn owned(&self) -> usize {
        self.block.len()
    }

    /// Reference position of a local point, m; components beyond the dimension are 0.
    pub fn position(&self, point: usize) -> [f64; 3] {
        let mut position = [0.0; 3];
        for d in 0..D {
            position[d] = self.reference[d][point];
        }
        position
    }

    /// Thermal expansion of an owned point.
    pub fn expansion_of(&self, point: usize) -> Expansion {
        self.expansion[usize::from(self.block[point])]
    }

    /// Rate r of viscous damping of an owned point, 1/s.
    pub fn damping_of(&self, point: usize) -> f64 {
        self.damping[usize::from(self.block[point])]
    }

    /// Return the sum of `force` and the viscous damping −r ρ u̇ of an owned point, N/m³. r is the rate of
    /// [`Self::damping_of`], and ρ is the density of [`Self::density_of`]. `force` is a component of the
    /// force density on the point, and `velocity` is the same component of the velocity u̇ (m/s).
    #[inline]
    pub fn with_damping(&self, point: usize, force: f64, velocity: f64) -> f64 {
        let damping = self.damping_of(point);
        if damping > 0.0 {
            force - damping * self.density_of(point) * velocity
        } else {
            force
        }
    }

    /// Density of an owned point, multiplied by the density scale of the present stage, kg/m³.
    pub fn density_of(&self, point: usize) -> f64 {
        self.density[usize::from(self.block[point])]
    }
}
