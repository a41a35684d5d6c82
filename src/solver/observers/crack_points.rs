//! Points that are searched for a crack, in 2-D and 3-D.

use crate::error::Result;
use crate::problem::CrackPath;
use crate::solver::Simulation;
use crate::solver::conditions::{members, not_empty};

/// Distance, in horizons, up to which damaged points are connected. This distance is long enough to bridge a
/// gap of one point, and short enough to separate two branches soon after their fork.
const LINK: f64 = 2.0 / 3.0;

/// Find the owned points in the set that is evaluated for a crack. Collective.
///
/// # Errors
/// If the set is empty; the error is the same on all ranks.
pub fn points_of<const D: usize>(
    simulation: &Simulation<'_, D>,
    rule: &CrackPath,
) -> Result<Vec<u32>> {
    let (problem, comm) = (simulation.problem, simulation.comm);
    let points = members(problem, &simulation.model, rule.set);
    let key = format!("[history.crack.{}] set", rule.name);
    not_empty(problem, comm, rule.set, &points, (&key, rule.span.clone()))?;
    Ok(points)
}

/// Smallest and largest spacing of all points, from their volumes, m. Collective.
pub fn spacings<const D: usize>(simulation: &Simulation<'_, D>) -> [f64; 2] {
    let model = &simulation.model;
    let mut extremes = [-f64::MAX, 0.0];
    for volume in (0..model.owned()).map(|point| model.volume[point]) {
        extremes = [extremes[0].max(-volume), extremes[1].max(volume)];
    }
    simulation.comm.max(&mut extremes);
    let [smallest, largest] = extremes;
    [-smallest, largest].map(|volume| simulation.problem.dimension.edge(volume))
}

/// Largest horizon of the bodies with a damage law to which the owned points `points` of the ranks belong, m; of
/// all their bodies, if none has a damage law. For refined bodies, this is the horizon of level 0. Collective.
pub fn horizon_of<const D: usize>(simulation: &Simulation<'_, D>, points: &[u32]) -> f64 {
    let (problem, model) = (simulation.problem, &simulation.model);
    let mut largest = [0.0_f64; 2];
    for point in points {
        let block = usize::from(model.block[*point as usize]);
        let body = &problem.bodies[problem.body_of(block)];
        let kind = usize::from(body.damage.is_none());
        largest[kind] = largest[kind].max(body.horizon);
    }
    simulation.comm.max(&mut largest);
    let [damaged, other] = largest;
    if damaged > 0.0 { damaged } else { other }
}

/// Return the distance up to which damaged points are connected, m; this distance is at least `least` (m).
pub fn link(horizon: f64, least: f64) -> f64 {
    (LINK * horizon).max(least)
}
