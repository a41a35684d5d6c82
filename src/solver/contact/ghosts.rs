//! The ghosts of contact: points of other ranks that may touch owned points. These ghosts differ from the
//! ghosts of the bonds, because contact depends on present positions.
//!
//! Points of any two ranks can touch each other. The points are sorted into cells by their present positions.
//! Each cell has a home rank, given by the hash of the cell. Each rank with points in the cell receives a
//! list from the home rank: the other ranks that have points in this cell or in an adjacent cell.

use std::collections::{BTreeMap, BTreeSet};

use bytemuck::{Pod, Zeroable};

use crate::comm::halo::Neighbour;
use crate::comm::{Communicator, Halo};
use crate::dimension::Dimension;
use crate::solver::motion::Fields;

use super::cells::{Cell, Cells, cell_of, hash, neighbourhood};

/// Edge of a cell divided by the search radius. With larger cells, home ranks receive fewer messages, but
/// more points are sent between ranks.
const CELL: f64 = 4.0;

/// A point in messages to other ranks.
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub(super) struct Ghost {
    /// Id of the point.
    pub id: u64,
    /// Local index on its owner.
    pub index: u64,
    /// Block of the point.
    pub block: u64,
    /// Volume, m³.
    pub volume: f64,
    /// Reference position, m.
    pub reference: [f64; 3],
    /// Present position, m.
    pub position: [f64; 3],
}

/// The points of other ranks that may touch owned points, with their motion.
#[derive(Default)]
pub(super) struct Ghosts<const D: usize> {
    /// The points, sorted by owner and then by id.
    pub points: Vec<Ghost>,
    /// For each point, the edge of the line segment, square or cube that represents the point, m.
    pub edges: Vec<f64>,
    /// Displacements by component, m.
    pub displacement: Vec<Vec<f64>>,
    /// Velocities by component, m/s.
    pub velocity: Vec<Vec<f64>>,
    /// Thermal stretches; `None` in runs without temperatures.
    pub thermal_stretch: Option<Vec<f64>>,
    halo: Halo,
}

impl<const D: usize> Ghosts<D> {
    /// Find the points of other ranks within `reach` (m) of owned points. `is_thermal` says whether points
    /// have thermal stretches. Call [`Self::update`] afterwards to exchange the motion of these points.
    /// Collective.
    pub fn within(
        comm: &dyn Communicator,
        dimension: Dimension,
        own: &[Ghost],
        reach: f64,
        is_thermal: bool,
    ) -> Self {
        let width = 2 * D + usize::from(is_thermal);
        let (points, halo) = find(comm, own, reach, D, width);
        let columns = || vec![vec![0.0; points.len()]; D];
        let edges = points.iter().map(|point| dimension.edge(point.volume));
        Self {
            edges: edges.collect(),
            displacement: columns(),
            velocity: columns(),
            thermal_stretch: is_thermal.then(|| vec![0.0; points.len()]),
            points,
            halo,
        }
    }

    /// Exchange the motion of the ghosts, and their thermal stretches in runs with temperatures. Collective.
    pub fn update(&mut self, comm: &dyn Communicator, fields: &Fields<D>) {
        let column = |k: usize| -> &[f64] {
            match k.checked_sub(D) {
                None => &fields.displacement[k],
                Some(k) if k < D => &fields.velocity[k],
                Some(_) => fields.thermal_stretch.as_deref().unwrap_or_default(),
            }
        };
        let width = 2 * D + usize::from(self.thermal_stretch.is_some());
        self.halo.pack((0..width).map(column));
        self.halo.exchange(comm, &mut |_| {});
        let motion = self.displacement.iter_mut().chain(&mut self.velocity);
        let received = motion.chain(&mut self.thermal_stretch);
        self.halo.unpack(received.map(Vec::as_mut_slice));
    }
}

/// Message to a home rank: the sender has points in a cell or in an adjacent one.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Claim {
    cell: Cell,
    /// 1 if the sender has points in the cell itself.
    inside: u64,
}

/// Message from a home rank to a rank with points in `cell`: the other rank `rank` has points in this cell or
/// in an adjacent cell.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Partner {
    cell: Cell,
    rank: u64,
}

/// Find the points of other ranks within `reach` (m) of the owned points `own`. Return the found points,
/// sorted by owner, then by id, and the plan to exchange `width` values per found point. Collective.
fn find(
    comm: &dyn Communicator,
    own: &[Ghost],
    reach: f64,
    dimension: usize,
    width: usize,
) -> (Vec<Ghost>, Halo) {
    if comm.size() == 1 {
        return (Vec::new(), Halo::default());
    }
    let edge = CELL * reach;
    let mut inside: BTreeMap<Cell, Vec<u32>> = BTreeMap::new();
    for (index, point) in own.iter().enumerate() {
        let cell = cell_of(point.position, edge);
        inside.entry(cell).or_default().push(index as u32);
    }
    let partners = partners(comm, &inside, dimension);
    let mut outgoing = vec![Vec::new(); comm.size()];
    for Partner { cell, rank } in partners {
        for index in &inside[&cell] {
            outgoing[rank as usize].extend_from_slice(bytemuck::bytes_of(&own[*index as usize]));
        }
    }
    let offered = comm.all_to_all(outgoing);

    let positions: Vec<[f64; 3]> = own.iter().map(|point| point.position).collect();
    let cells = Cells::new(&positions, reach, dimension);
    let is_near = |point: &Ghost| {
        let mut is_near = false;
        cells.near(point.position, |index| {
            let square = (0..dimension).map(|d| (positions[index][d] - point.position[d]).powi(2));
            is_near |= square.sum::<f64>() <= reach * reach;
        });
        is_near
    };
    let mut found: Vec<Ghost> = Vec::new();
    let mut requests = vec![Vec::new(); comm.size()];
    let mut received = vec![0..0; comm.size()];
    for (rank, bytes) in offered.into_iter().enumerate() {
        let mut points: Vec<Ghost> = bytemuck::pod_collect_to_vec(&bytes);
        points.retain(is_near);
        points.sort_unstable_by_key(|point| point.id);
        for point in &points {
            requests[rank].extend_from_slice(&point.index.to_ne_bytes());
        }
        received[rank] = found.len()..found.len() + points.len();
        found.extend(points);
    }
    let requested = comm.all_to_all(requests);
    let neighbours = requested.into_iter().zip(received).enumerate();
    let neighbours = neighbours.filter_map(|(rank, (bytes, receive))| {
        let send = bytemuck::pod_collect_to_vec::<u8, u64>(&bytes);
        let send: Vec<u32> = send.into_iter().map(|index| index as u32).collect();
        let talk = !send.is_empty() || !receive.is_empty();
        talk.then_some(Neighbour {
            rank,
            send,
            receive,
        })
    });
    let halo = Halo::new(neighbours.collect(), width);
    (found, halo)
}

/// For each cell with owned points, find the other ranks with points in this or an adjacent cell. Return
/// pairs of cell and rank. Collective.
fn partners(
    comm: &dyn Communicator,
    inside: &BTreeMap<Cell, Vec<u32>>,
    dimension: usize,
) -> Vec<Partner> {
    let ranks = comm.size();
    let near = inside
        .keys()
        .flat_map(|cell| neighbourhood(*cell, dimension));
    let near: BTreeSet<Cell> = near.collect();
    let mut claims = vec![Vec::new(); ranks];
    for cell in near {
        let claim = Claim {
            cell,
            inside: inside.contains_key(&cell).into(),
        };
        let home = (hash(cell) % ranks as u64) as usize;
        claims[home].extend_from_slice(bytemuck::bytes_of(&claim));
    }
    let mut by_cell: BTreeMap<Cell, Vec<(usize, bool)>> = BTreeMap::new();
    for (rank, bytes) in comm.all_to_all(claims).into_iter().enumerate() {
        for claim in bytemuck::pod_collect_to_vec::<u8, Claim>(&bytes) {
            let all = by_cell.entry(claim.cell).or_default();
            all.push((rank, claim.inside == 1));
        }
    }
    let mut replies = vec![Vec::new(); ranks];
    for (cell, all) in by_cell {
        for (owner, _) in all.iter().filter(|(_, inside)| *inside) {
            for (other, _) in all.iter().filter(|(other, _)| other != owner) {
                let partner = Partner {
                    cell,
                    rank: *other as u64,
                };
                replies[*owner].extend_from_slice(bytemuck::bytes_of(&partner));
            }
        }
    }
    let answers = comm.all_to_all(replies);
    let answers = answers.iter();
    answers
        .flat_map(|bytes| bytemuck::pod_collect_to_vec::<u8, Partner>(bytes))
        .collect()
}
