//! Detection of crack tips that lie on another crack than the one at `from`.

use bytemuck::{Pod, Zeroable};
use nalgebra::Vector3;

use crate::comm::all_gather_many;
use crate::points::bins::Bins;
use crate::points::distance_squared;
use crate::problem;
use crate::solver::Simulation;
use crate::solver::conditions::members;

use super::crack_path;
use super::crack_points::{horizon_of, link, spacings};
use super::crack_surface;
use super::snapshot::Snapshot;

/// Tolerance of distances, as a fraction of the horizon.
const TOLERANCE: f64 = 1e-9;

/// A point whose damage exceeds the threshold, as sent to all ranks.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Damaged {
    id: u64,
    position: [f64; 3],
}

/// Find out whether a tip lies on another crack than the one at `from`: whether the farthest damaged point
/// along the direction of the tip is ahead of all damaged points that are connected to the damaged points at
/// `from`. If so, return the position (m) of the farthest damaged point. Return `None` otherwise, or if no
/// point at `from` is damaged. The result is the same on all ranks. Collective.
pub fn foreign_tip<const D: usize>(
    simulation: &Simulation<'_, D>,
    rule: &problem::Tip,
    snapshot: &Snapshot,
) -> Option<[f64; 3]> {
    let model = &simulation.model;
    let points = members(simulation.problem, model, rule.set);
    let horizon = horizon_of(simulation, &points);
    let [_, spacing] = spacings(simulation);
    let diagonal = if D == 3 {
        crack_surface::DIAGONAL
    } else {
        crack_path::DIAGONAL
    };
    let link = link(horizon, diagonal * spacing);
    let own: Vec<Damaged> = (points.into_iter().map(|point| point as usize))
        .filter(|point| {
            snapshot.damage(&simulation.undeformed.family_volume, *point) > rule.threshold
        })
        .map(|point| Damaged {
            id: model.ids[point],
            position: model.position(point),
        })
        .collect();
    let mut damaged = all_gather_many(simulation.comm, &own);
    damaged.sort_unstable_by_key(|point| point.id);
    let positions: Vec<[f64; 3]> = damaged.iter().map(|point| point.position).collect();

    let begin = horizon.max(link) * (1.0 + TOLERANCE);
    let is_at_start =
        |position: &[f64; 3]| distance_squared(rule.line.from, *position) <= begin * begin;
    let mut is_connected: Vec<bool> = positions.iter().map(is_at_start).collect();
    let mut open: Vec<usize> = (0..positions.len()).filter(|k| is_connected[*k]).collect();
    let bins = Bins::new(&positions, link * (1.0 + TOLERANCE));
    while let Some(point) = open.pop() {
        bins.within(positions[point], |other, _| {
            let other = other as usize;
            if !std::mem::replace(&mut is_connected[other], true) {
                open.push(other);
            }
        });
    }

    let [from, direction] = [rule.line.from, rule.line.direction].map(Vector3::from);
    let along = |k: usize| (Vector3::from(positions[k]) - from).dot(&direction);
    let farthest = |among: &dyn Fn(&usize) -> bool| {
        let chosen = (0..positions.len()).filter(among);
        chosen.max_by(|a, b| along(*a).total_cmp(&along(*b)).then(b.cmp(a)))
    };
    let connected = farthest(&|k| is_connected[*k])?;
    let tip = farthest(&|_| true)?;
    (along(tip) > along(connected) + TOLERANCE * horizon).then_some(positions[tip])
}
