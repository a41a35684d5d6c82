//! Nonlocal J integrals over boxes around crack tips (in 3-D, around pieces of crack fronts): energy released
//! per area of crack growth.
//!
//! Each box has a weight q. In a layer inside the faces of the box, q rises from 0 at the faces to 1.
//! Farther inside, q is 1. With the unit vector e in the direction of growth, the strain energy density W and
//! the force states T, the integral is
//!
//! J = −(1/L) Σ_i V_i (∂q/∂e W_i + q_i Σ_j T_i⟨ξ⟩·(∂u_j/∂e − ∂u_i/∂e) Ṽ_j)
//!
//! V_i is the volume of point i, Ṽ_j the corrected volume of neighbour j, and u the displacement. L is the
//! thickness in plane problems, and the integral of q along the crack front in 3-D. Each number s between 0
//! and 1 defines a box {q > s}. In an equilibrium without loads in the box, J is the mean, over all s, of the
//! integrals of Silling & Lehoucq (2010) for these boxes; see `docs/src/theory/j_integral.md`.

use crate::comm;
use crate::comm::sum::{ExactSum, reduce};
use crate::component::AXES;
use crate::error::{Error, Result};
use crate::lanes::Column;
use crate::message::format_number;
use crate::problem::JIntegral;
use crate::solver::Simulation;

use super::j_weight::{Weight, edges, front_length, weights};
use super::snapshot::Snapshot;

/// Tolerance for round-off. A component of the direction of growth counts as 0 up to this value. The bodies
/// must reach at least one horizon beyond the box, less this fraction of the horizon.
const ROUND_OFF: f64 = 1e-9;

/// The J integrals of a run.
pub struct JIntegrals {
    /// Directions of growth (unit vectors), without duplicates.
    directions: Vec<[f64; 3]>,
    boxes: Vec<WeightedBox>,
}

/// The points of a box with their weights.
struct WeightedBox {
    /// Index of the direction of growth in `JIntegrals::directions`.
    direction: usize,
    points: Vec<Weight>,
    /// Thickness in plane problems, integral of q along the crack front in 3-D, m.
    length: f64,
}

impl JIntegrals {
    /// Find the points of the boxes. Collective.
    ///
    /// # Errors
    /// If a box contains no point. If the crack grows along an axis, but the bodies reach less than one
    /// horizon beyond the box along this axis. In 3-D, also if no body lies on the line that approximates the
    /// crack front, see [`front_length`]. The error is the same on all ranks.
    pub fn new<const D: usize>(simulation: &Simulation<'_, D>) -> Result<Self> {
        let mut directions = Vec::new();
        let mut boxes = Vec::new();
        for rule in &simulation.problem.history.j_integrals {
            is_in_the_bodies(simulation, rule)?;
            let known = directions.iter().position(|known| *known == rule.direction);
            let direction = known.unwrap_or_else(|| {
                directions.push(rule.direction);
                directions.len() - 1
            });
            boxes.push(WeightedBox {
                direction,
                points: weights(simulation, rule),
                length: match rule.front {
                    None => simulation.problem.dimension.out_of_plane_measure(),
                    Some(front) => front_length(simulation, rule, front)?,
                },
            });
        }
        Ok(Self { directions, boxes })
    }

    /// Compute the integrals (J/m²) at the time of a snapshot. The values are bitwise the same for any number
    /// of ranks and threads. Collective.
    pub fn values<const D: usize>(
        &self,
        simulation: &mut Simulation<'_, D>,
        snapshot: &Snapshot,
    ) -> Vec<f64> {
        if self.boxes.is_empty() {
            return Vec::new();
        }
        let (comm, model, forces) = (simulation.comm, &simulation.model, &mut simulation.forces);
        let gradients = forces.displacement_gradient(model);
        let energy_rates = self.directions.iter().map(|direction| {
            let mut rate: [Column; D] =
                std::array::from_fn(|d| Column::new(d, model.volume.len(), 0.0));
            for (point, gradient) in gradients.iter().enumerate() {
                for (d, column) in rate.iter_mut().enumerate() {
                    column[point] = (0..D).map(|k| gradient[(d, k)] * direction[k]).sum();
                }
            }
            forces.update_ghosts(comm, &mut rate.each_mut().map(|column| &mut column[..]));
            forces.energy_rate(model.owned(), rate)
        });
        let energy_rates: Vec<Vec<f64>> = energy_rates.collect();
        let sum_of = |weighted: &WeightedBox| {
            let energy_rate = &energy_rates[weighted.direction];
            let mut sum = ExactSum::default();
            for weight in &weighted.points {
                let (point, energy) = (weight.point, &snapshot.stored.energy);
                let change = weight.slope * energy[point] + weight.value * energy_rate[point];
                sum.add(-change * model.volume[point]);
            }
            sum
        };
        let mut sums: Vec<ExactSum> = self.boxes.iter().map(sum_of).collect();
        let sums = reduce(comm, &mut sums).into_iter().zip(&self.boxes);
        sums.map(|(sum, weighted)| sum / weighted.length).collect()
    }
}

/// Check that the box contains points. Also check that the bodies reach at least one horizon beyond both
/// sides of the box, along each axis along which the crack grows. Collective.
fn is_in_the_bodies<const D: usize>(
    simulation: &Simulation<'_, D>,
    rule: &JIntegral,
) -> Result<()> {
    let (problem, model, comm) = (simulation.problem, &simulation.model, simulation.comm);
    let key = format!("[history.j_integral.{}]", rule.name);
    let grows_along = |d: usize| rule.direction[d].abs() > ROUND_OFF;
    let is_within = |position: [f64; 3], margin: f64| {
        (0..D).all(|d| {
            let margin = if grows_along(d) { margin } else { 0.0 };
            position[d] > rule.lower[d] - margin && position[d] < rule.upper[d] + margin
        })
    };
    let owned = (0..model.owned()).map(|point| (point, model.position(point)));
    let inside = owned
        .clone()
        .filter(|(_, position)| is_within(*position, 0.0));
    if comm::total(comm, inside.count() as u64) == 0 {
        let message = format!("{key}: no point lies in the box");
        return Err(Error::input(message).at(&rule.span));
    }
    let margin = problem.horizon;
    let (mut lower, mut upper) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
    for (point, position) in owned.filter(|(_, position)| is_within(*position, 2.0 * margin)) {
        let edges = edges(simulation, point);
        for d in 0..D {
            lower[d] = lower[d].min(position[d] - 0.5 * edges[d]);
            upper[d] = upper[d].max(position[d] + 0.5 * edges[d]);
        }
    }
    comm::min(comm, &mut lower);
    comm.max(&mut upper);
    for d in (0..D).filter(|d| grows_along(*d)) {
        let sides = [
            (lower[d], rule.lower[d] - lower[d]),
            (upper[d], upper[d] - rule.upper[d]),
        ];
        for (end, beyond) in sides {
            if beyond < margin * (1.0 - ROUND_OFF) {
                let message = format!(
                    "{key}: the crack grows along {axis}, so the bodies must extend at least one horizon ({} m) beyond \
                     the box along {axis}, but near the box they end at {axis} = {} m",
                    format_number(margin),
                    format_number(end),
                    axis = AXES[d],
                );
                return Err(Error::input(message).at(&rule.span));
            }
        }
    }
    Ok(())
}
