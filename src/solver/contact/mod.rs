//! Contact: repulsion, friction and damping between points that no intact bond joins.
//!
//! Every owned point has a row of the points that may touch it before the next search, sorted by id, so that its forces
//! are summed in the same order on any ranks. Points are searched anew when one has moved half a skin since the last
//! search. A pair touches where it is nearer than its distance of contact, which is never more than its reference
//! distance: a body at rest has no contact forces. The faces of cracks are points whose bond has broken.
//!
//! Rigid bodies repel all points. Their motion is the same on all ranks, for what points exert on them is summed exactly.
//!
//! Forces are those at the new positions; friction and damping are those of the velocities half a step before. Their work
//! in a step is the trapezoid of both ends.

mod by_pair;
mod cells;
mod foreign;
mod pair;
mod rigid;
mod rows;
mod shape;

use rayon::prelude::*;

use crate::comm::sum::{ExactSum, reduce};
use crate::comm::{Communicator, Found, Halo, least};
use crate::dimension::Dimension;
use crate::error::{Error, Result};
use crate::problem::{self, Problem};

use super::bonds::Forces;
use super::model::Model;
use super::motion::Fields;
use cells::Cells;
use foreign::Foreign;
use pair::{ContactPoint, PairRule, Touch};
use rigid::{RigidBody, WrenchSums};
use rows::{FoundPair, Rows};

pub use by_pair::{ContactNow, contact_now};
pub use rigid::RigidState;

/// The distance that points may approach between two searches, as a share of the largest distance of contact: at rest, a
/// row of a lattice holds the nearest neighbours only.
const SKIN: f64 = 0.4;

/// Points handled by one task.
const CHUNK: usize = 4096;

/// Contact on one rank.
pub struct Contact<const D: usize> {
    dimension: Dimension,
    /// By block of both points; the same for both orders.
    rules: Vec<Option<PairRule>>,
    blocks: usize,
    /// The largest distance at which any points touch, m.
    largest: f64,
    has_dissipation: bool,
    /// Edge of a cell of each owned point's volume, m.
    edges: Vec<f64>,
    foreign: ForeignPoints<D>,
    rigid: Vec<RigidBody>,
    /// Owned points that touch a rigid body, now and at the last evaluation.
    at_rigid: [Vec<u32>; 2],
    rows: Rows,
    /// Owned points with pairs that no bond joins.
    open: Vec<u32>,
    is_open: Vec<bool>,
    /// Displacements of the owned points at the last search, m.
    searched: [Vec<f64>; D],
    /// Rows and bonds must be found anew, on all ranks.
    is_stale: bool,
    /// The largest 2 Σ k/m of an owned point over all ranks, 1/s²: a bound of what contact adds to the squares of the
    /// frequencies.
    stiffness: f64,
    /// Points with forces, and what these are; kept for their memory.
    active: Vec<u32>,
    sums: Vec<PointSum<D>>,
}

/// Points of other ranks that may touch own ones.
#[derive(Default)]
struct ForeignPoints<const D: usize> {
    points: Vec<Foreign>,
    edges: Vec<f64>,
    displacement: Vec<Vec<f64>>,
    velocity: Vec<Vec<f64>>,
    halo: Halo,
}

/// The end of a step.
#[derive(Debug, Clone, Copy)]
pub struct StepEnd {
    /// Its time, s.
    pub time: f64,
    /// Length of the step, s.
    pub step: f64,
}

/// What contact does to a point.
#[derive(Clone, Copy)]
struct PointSum<const D: usize> {
    /// N.
    repulsion: [f64; D],
    /// N.
    damping: [f64; D],
    /// N.
    friction: [f64; D],
    /// Its share of the potential energies, J.
    energy: f64,
    /// Σ k, N/m.
    stiffness: f64,
    /// Whether it touches any point.
    touches: bool,
}

impl<const D: usize> Contact<D> {
    /// Contact of the points of a run with one another and with rigid bodies, if its deck asks for any. Collective.
    ///
    /// # Errors
    /// When a point lies in a rigid body; the same on all ranks.
    pub fn new(
        problem: &Problem,
        comm: &dyn Communicator,
        model: &Model<D>,
    ) -> Result<Option<Self>> {
        if !problem.has_contact() {
            return Ok(None);
        }
        let dimension = problem.dimension;
        let blocks: Vec<_> = problem.blocks().collect();
        let pairs = blocks
            .iter()
            .flat_map(|here| blocks.iter().map(move |there| [here, there]));
        let rules: Vec<Option<PairRule>> = pairs
            .map(|[here, there]| {
                let bodies = [here.body, there.body];
                let contact = problem.contact.as_ref()?;
                let rule = contact.between(here.body, there.body)?;
                Some(PairRule::new(dimension, &rule, bodies))
            })
            .collect();
        let edges: Vec<f64> = model
            .volume
            .iter()
            .map(|volume| edge_of(dimension, volume))
            .collect();
        let mut largest_edges = vec![0.0_f64; blocks.len()];
        for (block, edge) in model.block.iter().zip(&edges) {
            let largest = &mut largest_edges[usize::from(*block)];
            *largest = largest.max(*edge);
        }
        comm.max(&mut largest_edges);
        let largest = |here: usize, there: usize| {
            let edge = 0.5 * (largest_edges[here] + largest_edges[there]);
            let rule = rules[here * blocks.len() + there].as_ref();
            rule.map_or(0.0, |rule| rule.largest_distance(edge))
        };
        let all =
            (0..blocks.len()).flat_map(|here| (0..blocks.len()).map(move |there| (here, there)));
        let largest = all
            .map(|(here, there)| largest(here, there))
            .fold(0.0, f64::max);
        let bodies: Vec<_> = blocks.iter().map(|block| block.body).collect();
        let rigid = problem.rigid.iter();
        let rigid: Vec<_> = rigid
            .map(|rigid| RigidBody::new(rigid, dimension, &bodies))
            .collect();
        are_outside(problem, comm, model, &rigid)?;
        Ok(Some(Self {
            dimension,
            rigid,
            at_rigid: [Vec::new(), Vec::new()],
            active: Vec::new(),
            has_dissipation: rules.iter().flatten().any(PairRule::has_dissipation),
            blocks: blocks.len(),
            rules,
            largest,
            edges: edges[..model.owned()].to_vec(),
            foreign: ForeignPoints::default(),
            rows: Rows::default(),
            open: Vec::new(),
            is_open: vec![false; model.owned()],
            searched: std::array::from_fn(|_| Vec::new()),
            is_stale: true,
            stiffness: 0.0,
            sums: Vec::new(),
        }))
    }

    /// What of the rigid bodies changes; the same on all ranks.
    pub fn rigid_states(&self) -> impl Iterator<Item = RigidState> {
        self.rigid.iter().map(|rigid| rigid.state)
    }

    /// Puts the rigid bodies back.
    pub fn set_rigid_states(&mut self, states: impl Iterator<Item = RigidState>) {
        for (rigid, state) in self.rigid.iter_mut().zip(states) {
            rigid.state = state;
        }
    }

    /// Moves the rigid bodies on to a time (s) by a step (s).
    pub fn drift(&mut self, time: f64, step: f64) {
        for rigid in &mut self.rigid {
            rigid.drift(time, step);
        }
    }

    /// Bonds or positions were changed other than by a step.
    pub fn set_stale(&mut self) {
        self.is_stale = true;
    }

    /// The stable step (s) with contact as it is now, where it is `step` (s) without.
    pub fn stable_step(&self, step: f64) -> f64 {
        1.0 / (1.0 / (step * step) + 0.25 * self.stiffness).sqrt()
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        self.rows.bytes()
            + size_of_val(&self.edges[..])
            + self.foreign.points.len() * (size_of::<Foreign>() + (2 * D + 1) * size_of::<f64>())
            + self
                .searched
                .iter()
                .map(|column| size_of_val(&column[..]))
                .sum::<usize>()
    }

    /// Adds the forces of contact at the present positions to the internal forces. At the end of a step, friction and
    /// damping follow from the present velocities, their work is booked, and rigid bodies get their second half kick; else
    /// they stay as they are. Collective.
    pub fn add_forces(
        &mut self,
        comm: &dyn Communicator,
        model: &Model<D>,
        forces: &Forces<D>,
        fields: &mut Fields<D>,
        end: Option<StepEnd>,
    ) {
        if self.largest > 0.0 {
            let is_finite = self.search_where_due(comm, model, forces, fields);
            if !is_finite {
                return;
            }
            self.note_broken(model, forces);
            self.update_foreign(comm, fields);
        }
        let mut active = std::mem::take(&mut self.active);
        self.find_active(model, fields, &mut active);
        let mut sums = std::mem::take(&mut self.sums);
        active
            .par_iter()
            .with_min_len(CHUNK / 16)
            .map(|point| self.point_sum(model, fields, *point as usize))
            .collect_into_vec(&mut sums);
        let mut stiffest = 0.0_f64;
        for (point, sum) in active.iter().zip(&sums) {
            let point = *point as usize;
            let volume = model.volume[point];
            let mass = model.density_of(point) * volume;
            stiffest = stiffest.max(2.0 * sum.stiffness / mass);
            let [repulsion, damping, friction] = [sum.repulsion, sum.damping, sum.friction]
                .map(|force| force.map(|component| component / volume));
            if let Some(StepEnd { step, .. }) = end {
                fields.book_dissipation(point, volume, step, [friction, damping]);
            }
            // A sum with 0 would change the sign of −0.
            if sum.touches {
                fields.add_contact(point, repulsion, sum.energy);
            } else {
                fields.clear_contact(point);
            }
        }
        (self.active, self.sums) = (active, sums);
        self.stiffness = self.close_step(comm, model, fields, stiffest, end);
    }

    /// Finds the owned points that have forces, or had some at the last evaluation.
    fn find_active(&mut self, model: &Model<D>, fields: &Fields<D>, active: &mut Vec<u32>) {
        active.clear();
        if !self.rigid.is_empty() {
            self.at_rigid.swap(0, 1);
            let mut now = std::mem::take(&mut self.at_rigid[0]);
            now.clear();
            let all = (0..model.owned()).into_par_iter().with_min_len(CHUNK);
            let touching = all.filter(|index| {
                let (_, point) = self.point(model, fields, *index);
                self.rigid.iter().any(|rigid| rigid.touches(&point))
            });
            now.par_extend(touching.map(|point| point as u32));
            self.at_rigid[0] = now;
            let both = self.at_rigid.iter().flatten();
            active.extend(both.filter(|point| !self.is_open[**point as usize]));
            active.sort_unstable();
            active.dedup();
        }
        active.extend(&self.open);
    }

    /// Sums what points exert on rigid bodies and ends their step. Returns the largest 2 Σ k/m over all ranks, of which
    /// `stiffest` is that of the own points. Collective.
    fn close_step(
        &mut self,
        comm: &dyn Communicator,
        model: &Model<D>,
        fields: &Fields<D>,
        stiffest: f64,
        end: Option<StepEnd>,
    ) -> f64 {
        // Then the distance of the farthest point that touches each rigid body.
        let mut largest = vec![0.0; 1 + self.rigid.len()];
        largest[0] = stiffest;
        let mut sums = Vec::new();
        for (rigid, reach) in self.rigid.iter().zip(&mut largest[1..]) {
            let (mut wrench, mut stiffness) = (WrenchSums::new(), ExactSum::ZERO);
            for index in &self.at_rigid[0] {
                let (block, point) = self.point(model, fields, *index as usize);
                if let Some(touch) = rigid.touch(block, &point) {
                    *reach = reach.max(rigid.add_opposite(&mut wrench, point.place(), &touch));
                    stiffness.add(touch.stiffness);
                }
            }
            sums.extend(wrench.flat());
            sums.push(stiffness);
        }
        comm.max(&mut largest);
        let mut stiffest = largest[0];
        if !self.rigid.is_empty() {
            let sums = reduce(comm, &mut sums);
            let each = sums.chunks_exact(WrenchSums::COUNT + 1).zip(&largest[1..]);
            for (rigid, (sums, reach)) in self.rigid.iter_mut().zip(each) {
                stiffest = stiffest.max(rigid.stiffness(sums[WrenchSums::COUNT], *reach));
                if let Some(StepEnd { time, step }) = end {
                    rigid.close_step(sums, time, step);
                }
            }
        }
        stiffest
    }

    /// Searches anew where points have moved too far. Returns whether all positions are finite on all ranks. Collective.
    fn search_where_due(
        &mut self,
        comm: &dyn Communicator,
        model: &Model<D>,
        forces: &Forces<D>,
        fields: &mut Fields<D>,
    ) -> bool {
        let displacement = &fields.displacement;
        let searched = &self.searched;
        let is_stale = self.is_stale;
        let moved = (0..model.owned())
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|point| {
                let square: f64 = (0..D)
                    .map(|d| {
                        let before = if is_stale { 0.0 } else { searched[d][point] };
                        (displacement[d][point] - before).powi(2)
                    })
                    .sum();
                if square.is_nan() {
                    f64::INFINITY
                } else {
                    square
                }
            });
        let mut moved = [moved.reduce(|| 0.0, f64::max)];
        comm.max(&mut moved);
        let skin = SKIN * self.largest;
        if moved[0].is_infinite() {
            return false;
        }
        if is_stale || 4.0 * moved[0] > skin * skin {
            self.search(comm, model, forces, fields);
        }
        true
    }

    /// Finds the pairs that may touch before the next search. Collective.
    fn search(
        &mut self,
        comm: &dyn Communicator,
        model: &Model<D>,
        forces: &Forces<D>,
        fields: &mut Fields<D>,
    ) {
        let skin = SKIN * self.largest;
        let reach = self.largest + skin;
        let own: Vec<Foreign> = (0..model.owned())
            .map(|point| {
                let reference = model.position(point);
                let mut place = reference;
                for d in 0..D {
                    place[d] += fields.displacement[d][point];
                }
                Foreign {
                    id: model.ids[point],
                    index: point as u64,
                    block: model.block[point].into(),
                    volume: model.volume[point],
                    reference,
                    place,
                }
            })
            .collect();
        let width = if self.has_dissipation { 2 * D } else { D };
        let (points, halo) = foreign::find(comm, &own, reach, D, width);
        let edges = points
            .iter()
            .map(|point| edge_of(self.dimension, point.volume));
        let columns = || vec![vec![0.0; points.len()]; D];
        self.foreign = ForeignPoints {
            edges: edges.collect(),
            displacement: columns(),
            velocity: columns(),
            points,
            halo,
        };
        let all: Vec<Foreign> = own.iter().chain(&self.foreign.points).copied().collect();
        let places: Vec<[f64; 3]> = all.iter().map(|point| point.place).collect();
        let cells = Cells::new(&places, reach, D);
        let edge = |index: usize| match index.checked_sub(model.owned()) {
            None => self.edges[index],
            Some(foreign) => self.foreign.edges[foreign],
        };
        let mut rows = Rows::new(model.owned(), |point, row| {
            let here = &all[point];
            cells.near(here.place, |index| {
                let there = &all[index];
                let rule = &self.rules[here.block as usize * self.blocks + there.block as usize];
                let (Some(rule), true) = (rule, index != point) else {
                    return;
                };
                let apart = |a: &[f64; 3], b: &[f64; 3]| {
                    (0..D).map(|d| (a[d] - b[d]).powi(2)).sum::<f64>().sqrt()
                };
                let reference = apart(&here.reference, &there.reference);
                let distance = rule.distance([edge(point), edge(index)], reference);
                if apart(&here.place, &there.place) <= distance + skin {
                    row.push(FoundPair {
                        id: there.id,
                        other: index as u32,
                    });
                }
            });
        });
        if self.is_stale {
            forces.for_each_intact(|point, other| {
                if !rows.is_empty(point) {
                    rows.set_bonded(point, model.ids[other]);
                }
            });
        } else {
            for point in rows.inherit(&self.rows) {
                find_bonds(&mut rows, model, forces, point);
            }
        }
        self.rows = rows;
        let before = std::mem::take(&mut self.open);
        for point in 0..model.owned() {
            self.is_open[point] = self.rows.is_open(point);
            if self.is_open[point] {
                self.open.push(point as u32);
            }
        }
        for point in before {
            if !self.is_open[point as usize] {
                fields.clear_contact(point as usize);
            }
        }
        for d in 0..D {
            self.searched[d].clear();
            self.searched[d].extend_from_slice(&fields.displacement[d][..model.owned()]);
        }
        self.is_stale = false;
    }

    /// Takes note of the bonds that broke in the last evaluation of bonds.
    fn note_broken(&mut self, model: &Model<D>, forces: &Forces<D>) {
        for broken in forces.broken() {
            let point = broken.point;
            find_bonds(&mut self.rows, model, forces, point);
            if !self.is_open[point] && self.rows.is_open(point) {
                self.is_open[point] = true;
                self.open.push(point as u32);
            }
        }
    }

    /// Brings the motion of the points of other ranks. Collective.
    fn update_foreign(&mut self, comm: &dyn Communicator, fields: &Fields<D>) {
        let ForeignPoints {
            displacement,
            velocity,
            halo,
            ..
        } = &mut self.foreign;
        let count = if self.has_dissipation { 2 * D } else { D };
        let column = |k: usize| -> &[f64] {
            match k.checked_sub(D) {
                None => &fields.displacement[k],
                Some(k) => &fields.velocity[k],
            }
        };
        halo.pack((0..count).map(column));
        halo.exchange(comm, &mut |_| {});
        let received = displacement.iter_mut().chain(velocity).take(count);
        halo.unpack(received.map(Vec::as_mut_slice));
    }

    /// A point by its index: owned points, then those of other ranks.
    fn point(
        &self,
        model: &Model<D>,
        fields: &Fields<D>,
        index: usize,
    ) -> (usize, ContactPoint<D>) {
        match index.checked_sub(model.owned()) {
            None => {
                let block = usize::from(model.block[index]);
                let volume = model.volume[index];
                (
                    block,
                    ContactPoint {
                        reference: std::array::from_fn(|d| model.reference[d][index]),
                        displacement: std::array::from_fn(|d| fields.displacement[d][index]),
                        velocity: std::array::from_fn(|d| fields.velocity[d][index]),
                        volume,
                        edge: self.edges[index],
                        mass: model.density[block] * volume,
                    },
                )
            }
            Some(index) => {
                let foreign = &self.foreign;
                let point = &foreign.points[index];
                let block = point.block as usize;
                (
                    block,
                    ContactPoint {
                        reference: std::array::from_fn(|d| point.reference[d]),
                        displacement: std::array::from_fn(|d| foreign.displacement[d][index]),
                        velocity: std::array::from_fn(|d| foreign.velocity[d][index]),
                        volume: point.volume,
                        edge: foreign.edges[index],
                        mass: model.density[block] * point.volume,
                    },
                )
            }
        }
    }

    /// Calls `visit` with the block of each point that touches an owned one, and with what the owned one feels of it, in
    /// ascending order of ids.
    fn for_each_touch(
        &self,
        model: &Model<D>,
        fields: &Fields<D>,
        point: usize,
        mut visit: impl FnMut(usize, Touch<D>),
    ) {
        if !self.is_open[point] {
            return;
        }
        let (block, here) = self.point(model, fields, point);
        for other in self.rows.touching(point) {
            let (other_block, there) = self.point(model, fields, other);
            let rule = &self.rules[block * self.blocks + other_block];
            if let Some(touch) = rule.as_ref().and_then(|rule| rule.touch(&here, &there)) {
                visit(other_block, touch);
            }
        }
    }

    fn point_sum(&self, model: &Model<D>, fields: &Fields<D>, point: usize) -> PointSum<D> {
        let mut sum = PointSum {
            repulsion: [0.0; D],
            damping: [0.0; D],
            friction: [0.0; D],
            energy: 0.0,
            stiffness: 0.0,
            touches: false,
        };
        let mut add = |touch: Touch<D>| {
            for d in 0..D {
                sum.repulsion[d] += touch.repulsion[d];
                sum.damping[d] += touch.damping[d];
                sum.friction[d] += touch.friction[d];
            }
            sum.energy += touch.energy;
            sum.stiffness += touch.stiffness;
            sum.touches = true;
        };
        self.for_each_touch(model, fields, point, |_, touch| {
            // The other half of its energy is the other point's.
            add(Touch {
                energy: 0.5 * touch.energy,
                ..touch
            });
        });
        if !self.rigid.is_empty() {
            let (block, here) = self.point(model, fields, point);
            let touches = self
                .rigid
                .iter()
                .filter_map(|rigid| rigid.touch(block, &here));
            touches.for_each(add);
        }
        sum
    }
}

/// An error if a point begins in a rigid body. Collective.
fn are_outside<const D: usize>(
    problem: &Problem,
    comm: &dyn Communicator,
    model: &Model<D>,
    rigid: &[RigidBody],
) -> Result<()> {
    for rigid in rigid {
        let depth = |point: usize| rigid.start_distance(model.position(point));
        let inside = (0..model.owned()).filter(|point| depth(*point) <= 0.0);
        let first = inside.min_by_key(|point| model.ids[*point]);
        let own = first.map(|point| Found {
            key: 0.0,
            ids: [model.ids[point]],
            payload: [f64::from(model.block[point]), depth(point)],
        });
        if let Some(Found {
            ids: [id],
            payload: [block, depth],
            ..
        }) = least(comm, own)
        {
            let body = &problem.block(block as usize).body.name;
            let problem::Rigid { name, span, .. } = rigid.problem();
            let message = format!(
                "[rigid.{name}]: point {id} of [body.{body}] begins {:.3e} m within it; move it away",
                -depth
            );
            return Err(Error::input(message).at(span));
        }
    }
    Ok(())
}

/// Finds which points of a row an intact bond joins to its point.
fn find_bonds<const D: usize>(rows: &mut Rows, model: &Model<D>, forces: &Forces<D>, point: usize) {
    if rows.is_empty(point) {
        return;
    }
    rows.set_unbonded(point);
    forces.for_each_neighbour(point, |other| rows.set_bonded(point, model.ids[other]));
}

/// Edge of a cube, square or line of a volume (m³), m.
fn edge_of(dimension: Dimension, volume: f64) -> f64 {
    let extent = volume / dimension.out_of_plane_measure();
    match dimension.count() {
        1 => extent,
        2 => extent.sqrt(),
        _ => libm::cbrt(extent),
    }
}
