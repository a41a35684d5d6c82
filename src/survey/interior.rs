//! Properties of a lattice body away from its surface, computed on a small block of the lattice.

use crate::comm::threads;
use crate::dimension::{Constraint, Dimension};
use crate::elastic::Isotropic;
use crate::problem::single_body::{fill, single_body};
use crate::problem::{PointSource, Problem, Shape};
use crate::solver::Simulation;
use crate::solver::assign::cutoffs;
use crate::solver::bonds::BondUpdate;
use crate::solver::observers::nearest;

/// Maximum number of bonds of a block.
const MAX_BONDS: f64 = 2e7;

/// Strain at which both nonlinear terms and round-off are negligible.
const STRAIN: f64 = 1e-6;

/// Properties of a point with a complete family.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interior {
    /// Number of neighbours.
    pub neighbours: u32,
    /// Guaranteed stable step, s.
    pub stable_step: f64,
    /// Modulus of isotropic expansion in 1-D, 2-D or 3-D, from the strain energy, Pa. In 3-D, it is the bulk
    /// modulus.
    pub bulk: f64,
    /// Shear moduli for shear along the axes and along the diagonals of the grid, Pa; `None` in 1-D.
    pub shear: Option<[f64; 2]>,
    /// Moduli of the classical solid, Pa: modulus of isotropic expansion, and shear modulus.
    pub exact: [f64; 2],
}

/// Compute the properties of a lattice body from a small block of the lattice. The result is `None` if a
/// value of the problem is not allowed, if no body has this index, or if the points are not on a lattice. It
/// is also `None` if the families are so large that the block has too many bonds, or if the block cannot be
/// set up.
pub fn interior(problem: &Problem, body: usize) -> Option<Interior> {
    problem.check().ok()?;
    if !problem.bodies.get(body)?.is_on_lattice(problem.jitter) {
        return None;
    }
    let block = block(problem, body)?;
    match problem.dimension.count() {
        1 => measure::<1>(&block),
        2 => measure::<2>(&block),
        _ => measure::<3>(&block),
    }
}

/// Create the problem of a small block of the lattice with at least one complete family; `None` if the block
/// has too many bonds.
fn block(problem: &Problem, body: usize) -> Option<Problem> {
    let (mut block, spacing) = single_body(problem, body)?;
    block.bodies[0].damage = None;
    let cutoff = cutoffs(&block)[0];
    let (mut upper, mut bonds) = ([0.0; 3], 1.0);
    for k in 0..problem.dimension.count() {
        let cells = 2.0 * (cutoff / spacing[k]).ceil() + 1.0;
        upper[k] = cells * spacing[k];
        bonds *= cells * cells * f64::from(block.bodies[0].quadrature().points(1)).powi(2);
    }
    fill(&mut block, [[0.0; 3], upper], spacing, [0.0; 3]);
    (bonds < MAX_BONDS).then_some(block)
}

fn measure<const D: usize>(block: &Problem) -> Option<Interior> {
    let comm = threads::alone();
    let mut simulation = Simulation::<D>::new(block, &comm).ok()?;
    let PointSource::Lattice {
        shape: Shape::Box { upper, .. },
        ..
    } = &block.bodies[0].points
    else {
        return None;
    };
    let middle = nearest(&simulation, upper.map(|x| 0.5 * x)).own?;
    let stable_step = simulation.undeformed.stable_step;
    let neighbours = energy_and_bonds(&mut simulation, middle, [[0.0; D]; D]).1;
    // The mean over both signs of the strain cancels odd terms.
    let mut energy = |gradient: [[f64; D]; D]| {
        let negative = gradient.map(|row| row.map(|entry| -entry));
        let [a, b] = [gradient, negative]
            .map(|gradient| energy_and_bonds(&mut simulation, middle, gradient).0);
        0.5 * (a + b) / (STRAIN * STRAIN)
    };
    let one = |row: usize, column: usize| f64::from(u8::from(row == column));
    let expansion = energy(std::array::from_fn(|row| {
        std::array::from_fn(|column| one(row, column))
    }));
    let shear = (D > 1).then(|| {
        let mut along = [[0.0; D]; D];
        (along[0][1], along[1][0]) = (0.5, 0.5);
        let mut diagonal = [[0.0; D]; D];
        (diagonal[0][0], diagonal[1][1]) = (0.5, -0.5);
        [along, diagonal].map(|gradient| 2.0 * energy(gradient))
    });
    let elastic = block.bodies[0].material.elastic;
    Some(Interior {
        neighbours,
        stable_step,
        bulk: 2.0 * expansion / (D * D) as f64,
        shear,
        exact: [
            bulk_modulus(block.dimension, elastic),
            elastic.shear_modulus(),
        ],
    })
}

/// Return the strain energy density (J/m³) and number of intact bonds of a point under the uniform
/// displacement gradient `gradient` × [`STRAIN`].
fn energy_and_bonds<const D: usize>(
    simulation: &mut Simulation<'_, D>,
    point: usize,
    gradient: [[f64; D]; D],
) -> (f64, u32) {
    let model = &simulation.model;
    for (row, field) in gradient.iter().zip(&mut simulation.fields.displacement) {
        for (entry, values) in field.iter_mut().enumerate() {
            let position = model.position(entry);
            *values = STRAIN * (0..D).map(|d| row[d] * position[d]).sum::<f64>();
        }
    }
    simulation.evaluate(BondUpdate::None);
    let stored = simulation.forces.stored(&simulation.model);
    (stored.energy[point], stored.neighbours[point] as u32)
}

/// Return the modulus of isotropic expansion, Pa: 2 W/θ², where W is the classical energy density, and θ the
/// sum of the strains in the directions of the problem.
fn bulk_modulus(dimension: Dimension, elastic: Isotropic) -> f64 {
    let (bulk, shear) = (elastic.bulk_modulus(), elastic.shear_modulus());
    match dimension {
        Dimension::Line { constraint, .. } => match constraint {
            Constraint::UniaxialStress => elastic.youngs_modulus,
            Constraint::UniaxialStrain => bulk + 4.0 / 3.0 * shear,
        },
        Dimension::PlaneStress { .. } => {
            elastic.youngs_modulus / (2.0 * (1.0 - elastic.poisson_ratio))
        }
        Dimension::PlaneStrain { .. } => bulk + shear / 3.0,
        Dimension::Space => bulk,
    }
}
