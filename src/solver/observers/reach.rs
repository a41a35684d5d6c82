//! The farthest position along a line at which values exceed a threshold. The values are interpolated between
//! points to find the position where they equal the threshold.

use bytemuck::{Pod, Zeroable};
use nalgebra::Vector3;

use crate::comm::{self, Communicator, Found, least, total};
use crate::points::distance_squared;
use crate::problem::Line;

use crate::solver::Simulation;

/// Tolerance of distances, in horizons. Points whose distances differ by at most the tolerance count as
/// equally far. A point beyond a limit by at most the tolerance counts as within the limit.
const TOLERANCE: f64 = 1e-9;

/// This rank's points along a line, and the coordinate of each point along the line (m).
pub struct Course {
    line: Line,
    points: Vec<(u32, f64)>,
}

/// Position (m) of a point, and the horizon of its body (m).
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Foremost {
    position: [f64; 3],
    horizon: f64,
}

/// The farthest position along the line at which values exceed the threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reached {
    /// Distance from the start of the line, m.
    pub along: f64,
    /// Position, m. To obtain it, the position of the farthest point above the threshold is moved in the
    /// direction of the line until its coordinate along the line is `along`.
    pub position: [f64; 3],
}

impl Course {
    /// Find the points of `among` (local indices) that lie between the start of the line and `end` (m along
    /// the line), and within `radius` (m) of the line.
    pub fn new<const D: usize>(
        simulation: &Simulation<'_, D>,
        line: Line,
        (end, radius): (f64, f64),
        among: impl Iterator<Item = u32>,
    ) -> Self {
        let tolerance = TOLERANCE * simulation.problem.horizon;
        let from = Vector3::from(line.from);
        let along = |point: u32| {
            let place = Vector3::from(simulation.model.position(point as usize));
            let (offset, direction) = (place - from, Vector3::from(line.direction));
            let along = offset.dot(&direction);
            let beside = offset - along * direction;
            let beside = beside.dot(&beside).sqrt();
            let counts =
                along >= -tolerance && along <= end + tolerance && beside <= radius + tolerance;
            counts.then_some((point, along))
        };
        Self {
            line,
            points: among.filter_map(along).collect(),
        }
    }

    /// Whether no rank has a point along the line. Collective.
    pub fn is_empty(&self, comm: &dyn Communicator) -> bool {
        total(comm, self.points.len() as u64) == 0
    }

    /// Find the farthest position along the line at which the values of the points exceed the threshold.
    /// `value` returns the value of a point, given its local index. The result is `None` if no value exceeds
    /// the threshold. The result is bitwise the same for any number of ranks. Collective.
    ///
    /// The search starts at the farthest point whose value exceeds the threshold. If several of these points
    /// are equally far, the search starts at the point with the smallest id. Only points ahead of this point
    /// and within the horizon of its body are considered. The next points are those of them with the smallest
    /// coordinate along the line. The values are interpolated linearly between the farthest point and the
    /// next points. The result is the position at which the interpolated value equals the threshold. Without
    /// next points, the result is the position of the farthest point. If several points are equally far along
    /// the line, the interpolation uses their largest value. While values grow, the result therefore moves
    /// along the line without jumps, also when the value of a next point begins to exceed the threshold.
    pub fn reached<const D: usize>(
        &self,
        simulation: &Simulation<'_, D>,
        threshold: f64,
        value: impl Fn(usize) -> f64,
    ) -> Option<Reached> {
        let (problem, model, comm) = (simulation.problem, &simulation.model, simulation.comm);
        let tolerance = TOLERANCE * problem.horizon;
        let points = || {
            let entry = |(point, along): &(u32, f64)| (*point as usize, *along);
            self.points.iter().map(entry)
        };
        let above = || points().filter(|(point, _)| value(*point) > threshold);

        let mut last = [largest(above().map(|(_, along)| along))];
        comm.max(&mut last);
        let [last] = last;
        if last == f64::MIN {
            return None;
        }
        let foremost = above()
            .filter(|(_, along)| *along >= last - tolerance)
            .map(|(point, _)| point)
            .min_by_key(|point| model.ids[*point])
            .map(|point| Found {
                key: 0.0,
                ids: [model.ids[point]],
                payload: Foremost {
                    position: model.position(point),
                    horizon: {
                        let body = problem.body_of(usize::from(model.block[point]));
                        problem.bodies[body].horizon
                    },
                },
            });
        let Foremost {
            position: place,
            horizon,
        } = least(comm, foremost)?.payload;

        let near = |point: usize| {
            distance_squared(place, model.position(point)).sqrt() <= horizon + tolerance
        };
        let ahead = || points().filter(|(point, along)| *along > last + tolerance && near(*point));
        let mut next = [ahead().map(|(_, along)| along).fold(f64::MAX, f64::min)];
        comm::min(comm, &mut next);
        let [next] = next;
        let here = above().filter(|(point, along)| *along >= last - tolerance && near(*point));
        let there = ahead().filter(|(_, along)| *along <= next + tolerance);
        let mut values = [
            largest(here.map(|(point, _)| value(point))),
            largest(there.map(|(point, _)| value(point))),
        ];
        comm.max(&mut values);
        let share = (values[0] - threshold) / (values[0] - values[1]);
        let further = if next == f64::MAX {
            0.0
        } else {
            share * (next - last)
        };
        Some(Reached {
            along: last + further,
            position: std::array::from_fn(|d| place[d] + further * self.line.direction[d]),
        })
    }
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::MIN, f64::max)
}
