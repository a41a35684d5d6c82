//! Weight q of a J integral. Over a layer along the faces of the box, q rises from 0 at the faces to 1. As in
//! `j_integral.rs`, e is the unit vector in the direction of crack growth.

use std::ops::Range;

use crate::comm;
use crate::error::{Error, Result};
use crate::problem::{JIntegral, PointSource};
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

/// Compute the weights of the owned points; points whose weight and slope are both 0 are left out.
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

/// Return the length (m) of a cell along a direction: √Σ(a n)², with the edges a of the cell and the
/// direction n. The components of n beyond the dimension of the problem are 0.
fn extent(edges: [f64; 3], direction: [f64; 3]) -> f64 {
    let squares = edges.iter().zip(direction);
    let squares = squares.map(|(edge, component)| (component * edge).powi(2));
    squares.sum::<f64>().sqrt()
}

/// Return the centre and the edges (m) of the cell that an owned point fills. Also return whether the cells
/// of the body fill the body without gaps.
fn cell<const D: usize>(
    simulation: &Simulation<'_, D>,
    point: usize,
) -> ([f64; 3], [f64; 3], bool) {
    let (problem, model) = (simulation.problem, &simulation.model);
    let block = problem.block(usize::from(model.block[point]));
    let position = model.position(point);
    let PointSource::Lattice {
        spacing, origin, ..
    } = block.body.points
    else {
        return (position, edges(simulation, point), false);
    };
    // In a refined body, the cell of each point has the edges of level 0, because the outermost points lie
    // half an edge of level 0 inside the surface. Gauss points, and points that `jitter` has moved, do not
    // lie at the centres of their cells.
    let middle = |d: usize| {
        let number = ((position[d] - origin[d]) / spacing[d]).floor();
        origin[d] + (number + 0.5) * spacing[d]
    };
    let middle = match block.level {
        0 => std::array::from_fn(middle),
        _ => position,
    };
    (middle, spacing, true)
}

/// Distance by which a line parallel to a face may lie outside a cell, divided by half the edge of the cell.
/// With this tolerance, a line along the face between two cells lies in both cells.
const FACE: f64 = 1e-9;

/// Return the range of distances a (m) for which the position a · `direction` lies in a box with this centre
/// and these edges (m). `None` if there is no such distance.
fn part_in_box(centre: [f64; 3], edges: [f64; 3], direction: [f64; 3]) -> Option<Range<f64>> {
    let mut range = f64::NEG_INFINITY..f64::INFINITY;
    for d in 0..3 {
        let half = 0.5 * edges[d];
        if direction[d] == 0.0 {
            if centre[d].abs() > half * (1.0 + FACE) {
                return None;
            }
            continue;
        }
        let ends = [-half, half].map(|side| (centre[d] + side) / direction[d]);
        range.start = range.start.max(ends[0].min(ends[1]));
        range.end = range.end.min(ends[0].max(ends[1]));
    }
    (range.start < range.end).then_some(range)
}

/// Return the part of a line that the cell of the point at `position` (m) covers, as a range of distances a
/// (m). The positions on the line are a · `direction`. `None` if the distance of the point from the line
/// exceeds the edge of the cell (`edges[0]`).
fn part_near(position: [f64; 3], edges: [f64; 3], direction: [f64; 3]) -> Option<Range<f64>> {
    let along: f64 = (0..3).map(|d| position[d] * direction[d]).sum();
    let across = (0..3).map(|d| (position[d] - along * direction[d]).powi(2));
    let half = 0.5 * extent(edges, direction);
    (across.sum::<f64>() <= edges[0].powi(2)).then_some(along - half..along + half)
}

/// Return the integral of q along a line, m. The line passes through the centre of the box in the direction
/// `front`. The integral extends from the first to the last position at which a body lies on the line. Gaps
/// along the line are included. Collective.
///
/// # Errors
/// If no body lies on the part of the line that is inside the box. The error is the same on all ranks.
pub fn front_length<const D: usize>(
    simulation: &Simulation<'_, D>,
    rule: &JIntegral,
    front: [f64; 3],
) -> Result<f64> {
    let (model, comm) = (&simulation.model, simulation.comm);
    let centre: [f64; 3] = std::array::from_fn(|d| 0.5 * (rule.lower[d] + rule.upper[d]));
    let (mut start, mut end) = ([f64::INFINITY], [f64::NEG_INFINITY]);
    for point in 0..model.owned() {
        let (middle, edges, is_of_lattice) = cell(simulation, point);
        let is_near_the_box = (0..3)
            .all(|d| middle[d] > rule.lower[d] - edges[d] && middle[d] < rule.upper[d] + edges[d]);
        if !is_near_the_box {
            continue;
        }
        let offset: [f64; 3] = std::array::from_fn(|d| middle[d] - centre[d]);
        let covered = if is_of_lattice {
            part_in_box(offset, edges, front)
        } else {
            part_near(offset, edges, front)
        };
        if let Some(covered) = covered {
            start[0] = start[0].min(covered.start);
            end[0] = end[0].max(covered.end);
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
        "[history.j_integral.{}]: no body lies on the line that runs through the centre of the box in the direction \
         `front`; this line must be near the crack front",
        rule.name
    );
    Err(Error::input(message).at(&rule.span))
}

/// Integrate q over a range of the line, m. Between the positions at which a factor of q has a kink, q is a
/// product of up to three linear factors. Simpson's rule is exact for such a product.
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
