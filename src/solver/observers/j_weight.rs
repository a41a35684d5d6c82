//! Weight q of a J integral: 1 inside a box, falling to 0 over a layer inside the faces.

use std::ops::Range;

use crate::comm;
use crate::error::{Error, Result};
use crate::problem::JIntegral;
use crate::solver::Simulation;

/// Weight of an owned point.
pub struct Weight {
    /// Local index.
    pub point: usize,
    /// q, between 0 and 1.
    pub value: f64,
    /// Mean of ∂q/∂e over the cell of the point, 1/m.
    pub slope: f64,
}

/// Return q at a position: a product with one factor per axis. The factor is the distance to the nearer face,
/// divided by the thickness of the layer and clamped to the range from 0 to 1.
fn weight_at(rule: &JIntegral, position: [f64; 3], dimension: usize) -> f64 {
    let along = |d: usize| {
        let nearest = (position[d] - rule.lower[d]).min(rule.upper[d] - position[d]);
        (nearest / rule.layer).clamp(0.0, 1.0)
    };
    (0..dimension).map(along).product()
}

/// Compute the weights of the owned points; points without weight and slope are left out.
pub fn weights<const D: usize>(simulation: &Simulation<'_, D>, rule: &JIntegral) -> Vec<Weight> {
    let model = &simulation.model;
    let of_point = |point: usize| {
        let position = model.position(point);
        let extent = extent(edges(simulation, point), rule.direction);
        let at = |distance: f64| {
            let position = std::array::from_fn(|d| position[d] + distance * rule.direction[d]);
            weight_at(rule, position, D)
        };
        Weight {
            point,
            value: at(0.0),
            slope: (at(0.5 * extent) - at(-0.5 * extent)) / extent,
        }
    };
    let all = (0..model.owned()).map(of_point);
    all.filter(|weight| weight.value != 0.0 || weight.slope != 0.0)
        .collect()
}

/// Return the edges of the cell of an owned point, m.
pub fn edges<const D: usize>(simulation: &Simulation<'_, D>, point: usize) -> [f64; 3] {
    let (problem, model) = (simulation.problem, &simulation.model);
    let spacing = problem.block(usize::from(model.block[point])).spacing();
    spacing.unwrap_or([problem.dimension.edge(model.volume[point]); 3])
}

/// Return the length of a cell along a direction, m. The component of the direction along an axis that the
/// problem does not have is 0.
fn extent(edges: [f64; 3], direction: [f64; 3]) -> f64 {
    let squares = edges.iter().zip(direction);
    let squares = squares.map(|(edge, component)| (component * edge).powi(2));
    squares.sum::<f64>().sqrt()
}

/// Integrate q along the part of a line that lies in the bodies, m. The line passes through the centre of the
/// box along the crack front. Collective.
///
/// # Errors
/// If no body lies on the line in the box. The error is the same on all ranks.
pub fn front_length<const D: usize>(
    simulation: &Simulation<'_, D>,
    rule: &JIntegral,
    front: [f64; 3],
) -> Result<f64> {
    let (model, comm) = (&simulation.model, simulation.comm);
    let centre: [f64; 3] = std::array::from_fn(|d| 0.5 * (rule.lower[d] + rule.upper[d]));
    let (mut start, mut end) = ([f64::INFINITY], [f64::NEG_INFINITY]);
    for point in 0..model.owned() {
        let position = model.position(point);
        // At the surface of a refined body, each point fills its cell of level 0.
        let level = simulation
            .problem
            .block(usize::from(model.block[point]))
            .level;
        let edges = edges(simulation, point).map(|edge| libm::scalbn(edge, level as i32));
        let offset: [f64; 3] = std::array::from_fn(|d| position[d] - centre[d]);
        let along: f64 = (0..3).map(|d| offset[d] * front[d]).sum();
        let across = (0..3).map(|d| (offset[d] - along * front[d]).powi(2));
        let edge = edges.into_iter().fold(0.0, f64::max);
        let is_near_the_box = (0..3)
            .all(|d| position[d] > rule.lower[d] - edge && position[d] < rule.upper[d] + edge);
        if is_near_the_box && across.sum::<f64>() <= edge.powi(2) {
            let half = 0.5 * extent(edges, front);
            start[0] = start[0].min(along - half);
            end[0] = end[0].max(along + half);
        }
    }
    comm::min(comm, &mut start);
    comm.max(&mut end);
    if start[0] < end[0] {
        let length = integral(rule, centre, front, start[0]..end[0]);
        if length > 0.0 {
            return Ok(length);
        }
    }
    let message = format!(
        "[history.j_integral.{}]: no body lies on the line through the centre of the box along `front`; the line must \
         be near the crack front",
        rule.name
    );
    Err(Error::input(message).at(&rule.span))
}

/// Integrate q over a range of the line, m. Between the positions at which a factor of q has a kink, q is a product
/// of up to three linear factors, for which Simpson's rule is exact.
fn integral(rule: &JIntegral, centre: [f64; 3], front: [f64; 3], range: Range<f64>) -> f64 {
    let mut kinks = vec![range.start, range.end];
    for d in 0..3 {
        let (lower, upper) = (rule.lower[d], rule.upper[d]);
        let planes = [lower, lower + rule.layer, upper - rule.layer, upper];
        let kinks_of_factor = planes.map(|plane| (plane - centre[d]) / front[d]);
        kinks.extend(kinks_of_factor.iter().filter(|kink| range.contains(kink)));
    }
    kinks.sort_by(f64::total_cmp);
    let at = |along: f64| {
        weight_at(
            rule,
            std::array::from_fn(|d| centre[d] + along * front[d]),
            3,
        )
    };
    let pieces = kinks.windows(2).map(|ends| {
        let (start, end) = (ends[0], ends[1]);
        (end - start) / 6.0 * (at(start) + 4.0 * at(0.5 * (start + end)) + at(end))
    });
    pieces.sum()
}
