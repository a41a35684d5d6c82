//! Detection of bodies that pass through each other in runs without `[contact]`. This module finds two points
//! of different bodies whose distance is below a limit. For bodies without common bonds, the limit is the
//! spacing of the two points: the mean of the edges of their cells. For bodies whose common bonds have
//! broken, the limit is half the spacing. [`Interpenetration`] states the exact limits.
//!
//! If the bounding boxes of two bodies overlap or nearly touch, a third box is computed. It contains all
//! points of each body that are near the other body. The points in this box are distributed to the ranks by
//! spatial cells. Each rank then compares the points of its cells. Points of the first body that are too near
//! to a point of the second body may lie in several cells. The point of the second body is sent to the ranks
//! of all these cells.

use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

use crate::comm::{self, Communicator, Found, least};
use crate::points::bins::Bins;
use crate::points::distance_squared;
use crate::solver::Simulation;
use crate::solver::contact::cells::{cell_of, hash};

/// Edge of a cell divided by [`Meeting::radius`]. If cells are large, fewer points in total lie near the
/// border of a cell, so fewer points are sent to several ranks.
const CELL: f64 = 8.0;

/// If no bond joins two bodies, a point of one body and a point of the other body are too near only if their
/// distance is below this fraction of their initial distance.
const NEARER: f64 = 0.9;

/// Fraction for two bodies that bonds joined at the start of the run. A point of one body and a point of the
/// other body are too near if their distance is below this fraction of their spacing, and also below this
/// fraction of their initial distance. Compression alone rarely reaches this distance.
const PASSED: f64 = 0.5;

/// Minimum number of points that one task processes; the last task may have fewer.
const CHUNK: usize = 1 << 15;

/// Two points of different bodies that are too near: nearer than their spacing, and nearer than 0.9 of their
/// initial distance. For bodies that bonds joined at the start of the run, the limits are smaller: half the
/// spacing, and half the initial distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interpenetration {
    /// Bodies of the points, the lower index first.
    pub bodies: [usize; 2],
    /// Ids of the points.
    pub ids: [u64; 2],
    /// Midpoint of the points, m.
    pub place: [f64; 3],
    /// Distance of the points, m.
    pub distance: f64,
    /// Whether bonds joined the bodies at the start of the run.
    pub were_bonded: bool,
}

/// Pairs of bodies that may pass through each other.
pub struct InterpenetrationWatch {
    /// All pairs of bodies if bonds can break in this run, otherwise the pairs that no bond joins.
    pairs: Vec<Pair>,
    /// Largest spacing of each body, m.
    spacing: Vec<f64>,
}

/// Two bodies that may pass through each other.
#[derive(Clone, Copy)]
struct Pair {
    /// Indices of the bodies, the lower one first.
    bodies: [usize; 2],
    /// Whether bonds joined the bodies at the start of the run.
    were_bonded: bool,
}

/// A pair of bodies whose bounding boxes overlap or nearly touch.
#[derive(Clone, Copy)]
struct Meeting {
    pair: Pair,
    /// Largest distance at which two points are compared, m.
    radius: f64,
    /// Lower corner of a box, m. The box contains the points of each body that are within
    /// `radius` of the other body.
    lower: [f64; 3],
    /// Upper corner of this box, m.
    upper: [f64; 3],
}

/// A point, as sent to the ranks that compare this point with points of the other body.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Candidate {
    /// Twice the index of the [`Meeting`], plus 1 for points of the second body.
    side: u64,
    id: u64,
    place: [f64; 3],
    reference: [f64; 3],
    spacing: f64,
}

impl InterpenetrationWatch {
    /// Find the pairs of bodies that may pass through each other. Collective.
    pub fn new<const D: usize>(simulation: &Simulation<'_, D>) -> Self {
        let (comm, model) = (simulation.comm, &simulation.model);
        let bodies = simulation.problem.bodies.len();
        if bodies < 2 {
            return Self {
                pairs: Vec::new(),
                spacing: Vec::new(),
            };
        }
        let mut bonds = vec![0; bodies * bodies];
        for ([here, there], count) in simulation.forces.bonds_of_blocks() {
            let [here, there] = [here, there].map(|block| simulation.problem.body_of(block));
            bonds[here * bodies + there] += count;
        }
        comm.sum(&mut bonds);
        let pairs = (0..bodies).flat_map(|a| (a + 1..bodies).map(move |b| [a, b]));
        let pairs = pairs.map(|[a, b]| Pair {
            bodies: [a, b],
            were_bonded: bonds[a * bodies + b] > 0,
        });
        let can_break = simulation.fields.broken_bonds.is_some();
        let pairs = pairs.filter(|pair| can_break || !pair.were_bonded);
        let pairs = pairs.collect();
        let mut spacing = vec![0.0_f64; bodies];
        for (point, block) in model.block.iter().enumerate() {
            let largest = &mut spacing[simulation.problem.body_of(usize::from(*block))];
            *largest = largest.max(
                simulation
                    .problem
                    .dimension
                    .edge(simulation.model.volume[point]),
            );
        }
        comm.max(&mut spacing);
        Self { pairs, spacing }
    }

    /// Find the nearest two points of different bodies; `None` if no two points are too near, see
    /// [`Interpenetration`]. The result is the same on all ranks. Collective.
    pub fn find<const D: usize>(&self, simulation: &Simulation<'_, D>) -> Option<Interpenetration> {
        let meetings = self.meetings(simulation);
        if meetings.is_empty() {
            return None;
        }
        let comm = simulation.comm;
        let incoming = comm.all_to_all(candidates(simulation, &meetings));
        let mut sides = vec![[Vec::new(), Vec::new()]; meetings.len()];
        for bytes in incoming {
            for candidate in bytemuck::pod_collect_to_vec::<u8, Candidate>(&bytes) {
                let (meeting, second) = (candidate.side / 2, candidate.side % 2);
                sides[meeting as usize][second as usize].push(candidate);
            }
        }
        let nearest = meetings
            .iter()
            .zip(&sides)
            .filter_map(|(meeting, sides)| nearest(meeting, sides))
            .min_by(|a, b| (a.distance.total_cmp(&b.distance)).then(a.ids.cmp(&b.ids)));
        agree_on_nearest(comm, nearest)
    }

    /// Find the pairs of bodies whose bounding boxes overlap or have a small gap. The gap along each axis may
    /// be at most the mean of the largest spacings of the two bodies. Collective.
    fn meetings<const D: usize>(&self, simulation: &Simulation<'_, D>) -> Vec<Meeting> {
        if self.pairs.is_empty() {
            return Vec::new();
        }
        // Lower corners of the bounding boxes, and negative upper corners, so that one element-wise minimum
        // gives both.
        let (model, fields) = (&simulation.model, &simulation.fields);
        let none = || vec![f64::INFINITY; 6 * self.spacing.len()];
        let include = |mut corners: Vec<f64>, point: usize| {
            let first = 6 * simulation.problem.body_of(usize::from(model.block[point]));
            for (k, x) in fields.position(model, point).into_iter().enumerate() {
                corners[first + k] = corners[first + k].min(x);
                corners[first + 3 + k] = corners[first + 3 + k].min(-x);
            }
            corners
        };
        let join = |mut corners: Vec<f64>, others: Vec<f64>| {
            for (corner, other) in corners.iter_mut().zip(others) {
                *corner = corner.min(other);
            }
            corners
        };
        let points = (0..model.owned()).into_par_iter();
        let found = points.with_min_len(CHUNK).fold(none, include);
        let mut corners = found.reduce(none, join);
        comm::min(simulation.comm, &mut corners);
        let corner = |body: usize, k: usize| corners[6 * body + k];
        let meeting = |pair: &Pair| {
            let [a, b] = pair.bodies;
            let radius = 0.5 * (self.spacing[a] + self.spacing[b]);
            let lower = |k: usize| corner(a, k).max(corner(b, k)) - radius;
            let upper = |k: usize| (-corner(a, 3 + k)).min(-corner(b, 3 + k)) + radius;
            let meeting = Meeting {
                pair: *pair,
                radius,
                lower: std::array::from_fn(lower),
                upper: std::array::from_fn(upper),
            };
            (0..3)
                .all(|k| meeting.upper[k] - meeting.lower[k] >= radius)
                .then_some(meeting)
        };
        self.pairs.iter().filter_map(meeting).collect()
    }
}

/// Select the owned points in the boxes where bodies may touch. If bonds joined two bodies at the start of
/// the run, select only those of their points that have broken bonds. Returns the points as bytes, one buffer
/// for each receiving rank.
fn candidates<const D: usize>(
    simulation: &Simulation<'_, D>,
    meetings: &[Meeting],
) -> Vec<Vec<u8>> {
    let ranks = simulation.comm.size();
    let mut outgoing = vec![Vec::new(); ranks];
    let mut of_body = vec![Vec::new(); simulation.problem.bodies.len()];
    for (number, meeting) in meetings.iter().enumerate() {
        for (second, body) in meeting.pair.bodies.into_iter().enumerate() {
            of_body[body].push((number, second));
        }
    }
    let (model, fields) = (&simulation.model, &simulation.fields);
    let broken = fields.broken_bonds.as_deref();
    for (point, block) in model.block.iter().enumerate() {
        let is_whole = broken.is_none_or(|broken| broken[point] == 0.0);
        let place = fields.position(model, point);
        for (number, second) in &of_body[simulation.problem.body_of(usize::from(*block))] {
            let meeting = &meetings[*number];
            if meeting.pair.were_bonded && is_whole {
                continue;
            }
            if (0..3).any(|k| place[k] < meeting.lower[k] || place[k] > meeting.upper[k]) {
                continue;
            }
            let candidate = Candidate {
                side: (2 * number + second) as u64,
                id: model.ids[point],
                place,
                reference: model.position(point),
                spacing: simulation
                    .problem
                    .dimension
                    .edge(simulation.model.volume[point]),
            };
            let reach = *second as f64 * meeting.radius;
            for rank in homes::<D>(place, reach, CELL * meeting.radius, ranks) {
                outgoing[rank].extend_from_slice(bytemuck::bytes_of(&candidate));
            }
        }
    }
    outgoing
}

/// The ranks of all cells that may contain points within `reach` (m) of `place`. A rank compares the points
/// of its cells. `edge` is the edge of a cell, m.
fn homes<const D: usize>(place: [f64; 3], reach: f64, edge: f64, ranks: usize) -> Vec<usize> {
    let mut homes = Vec::with_capacity(1);
    for corner in 0..1_u32 << D {
        let mut corner_place = place;
        for (k, x) in corner_place[..D].iter_mut().enumerate() {
            let side = f64::from(2 * (corner >> k & 1)) - 1.0;
            *x += side * reach;
        }
        let home = (hash(cell_of(corner_place, edge)) % ranks as u64) as usize;
        if !homes.contains(&home) {
            homes.push(home);
        }
    }
    homes
}

/// Find the nearest pair among the given points of two bodies. A pair must have a distance below the limit,
/// see [`Interpenetration`]; `None` if there is no such pair.
fn nearest(meeting: &Meeting, [first, second]: &[Vec<Candidate>; 2]) -> Option<Interpenetration> {
    if first.is_empty() || second.is_empty() {
        return None;
    }
    let places: Vec<[f64; 3]> = first.iter().map(|candidate| candidate.place).collect();
    let bins = Bins::new(&places, meeting.radius);
    let mut nearest: Option<Interpenetration> = None;
    for b in second {
        bins.within(b.place, |index, squared| {
            let a = &first[index as usize];
            let spacing = 0.5 * (a.spacing + b.spacing);
            let reference = distance_squared(a.reference, b.reference).sqrt();
            let found = Interpenetration {
                bodies: meeting.pair.bodies,
                ids: [a.id, b.id],
                place: std::array::from_fn(|k| 0.5 * (a.place[k] + b.place[k])),
                distance: squared.sqrt(),
                were_bonded: meeting.pair.were_bonded,
            };
            let is_nearer = |than: &Interpenetration| {
                let order = found.distance.total_cmp(&than.distance);
                order.then(found.ids.cmp(&than.ids)).is_lt()
            };
            let limit = if meeting.pair.were_bonded {
                PASSED * spacing.min(reference)
            } else {
                spacing.min(NEARER * reference)
            };
            if found.distance < limit && nearest.as_ref().is_none_or(is_nearer) {
                nearest = Some(found);
            }
        });
    }
    nearest
}

/// Return the nearest pair of all ranks; pairs at equal distance are ordered by ids. Collective.
fn agree_on_nearest(
    comm: &dyn Communicator,
    own: Option<Interpenetration>,
) -> Option<Interpenetration> {
    let found = own.map(|own| {
        let ([a, b], [x, y, z]) = (own.bodies, own.place);
        Found {
            key: own.distance,
            ids: own.ids,
            payload: [
                a as f64,
                b as f64,
                f64::from(u8::from(own.were_bonded)),
                x,
                y,
                z,
            ],
        }
    });
    let Found {
        key: distance,
        ids,
        payload: [a, b, were_bonded, x, y, z],
    } = least(comm, found)?;
    Some(Interpenetration {
        bodies: [a as usize, b as usize],
        ids,
        place: [x, y, z],
        distance,
        were_bonded: were_bonded != 0.0,
    })
}
