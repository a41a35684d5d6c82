//! Crack surfaces in 3-D: area and front of the crack that starts at a given position.
//!
//! Let H be 1 on one side of a crack and 0 on the other. The integral of |∇H| over the volume is the area of
//! the crack. At point i, the gradient g of H is the gradient of a linear function fitted to H by least
//! squares. The fit has the weights ω Ṽ. H is 1 at neighbours j with a broken bond ij, and 0 at the other
//! neighbours. With the weighted mean ξ̄ of the bond vectors ξ of the family,
//!
//! g = C⁻¹ Σ_broken (ξ − ξ̄) ω Ṽ,   C = Σ (ξ − ξ̄) ⊗ (ξ − ξ̄) ω Ṽ over all bonds,   area = Σ |g| V.
//!
//! On a cubic lattice, C is isotropic, and the area of a plane crack is exact for any direction of its
//! normal. Points without intact bonds have g = 0. Therefore the area is counted only once, even if the crack
//! contains such points or has a width.

use bytemuck::{Pod, Zeroable};
use nalgebra::{Matrix3, Vector3};

use crate::comm::all_gather_many;
use crate::comm::sum::{ExactSum, reduce};
use crate::error::Result;
use crate::points::bins::Bins;
use crate::points::distance_squared;
use crate::problem;
use crate::solver::Simulation;
use crate::solver::assign::cutoffs;
use crate::solver::connected::Pieces;

use super::crack_edge::Edge;
use super::crack_points::{horizon_of, link, points_of, spacings};
use super::snapshot::Snapshot;

type Vector = Vector3<f64>;

/// Lower limit of the connection distance, in spacings. Two damaged points are connected if they are at most
/// the connection distance apart. With this limit, diagonal neighbours are connected for any horizon.
pub(super) const DIAGONAL: f64 = 1.8;

/// Relative tolerance of distance limits: a point at the limit counts as within it.
const TOLERANCE: f64 = 1e-9;

/// Largest damage at which a point ahead of the front counts as undamaged, divided by
/// [`problem::CrackPath::threshold`]. At an oblique surface of the body, the damage falls below the threshold
/// before the crack ends, but stays above this fraction.
const UNDAMAGED: f64 = 0.5;

/// A crack in 3-D whose area and front are computed.
pub struct CrackSurface {
    rule: problem::CrackPath,
    /// Owned points of the set in which the crack is searched for.
    points: Vec<u32>,
    /// Distance up to which damaged points are connected, m.
    link: f64,
    /// Radius in m, at most one horizon. A point contributes to the area only if a damaged point of the crack
    /// lies within this radius. Whether a damaged point is on the front depends on the damaged points within
    /// this radius.
    radius: f64,
    /// Minimum distance between points of the front, m.
    front_spacing: f64,
}

/// Surface of a crack at one time; the same on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Area of the crack, m²; only one of the two faces counts.
    pub area: f64,
    /// Largest distance between the start of the crack and a damaged point of the crack, m; 0 without damaged
    /// points.
    pub reach: f64,
    /// Positions of the points of the front, moved to the mid-plane of the crack, m. The positions are in the
    /// order of the ids of the points.
    pub front: Vec<[f64; 3]>,
}

/// A point of the front, as sent to all ranks.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct FrontPoint {
    id: u64,
    place: [f64; 3],
}

impl CrackSurface {
    /// Create the crack, and find the points of the set in which the crack is searched for. Collective.
    ///
    /// # Errors
    /// If the set is empty; the error is the same on all ranks.
    pub fn new<const D: usize>(
        simulation: &Simulation<'_, D>,
        rule: &problem::CrackPath,
    ) -> Result<Self> {
        let problem = simulation.problem;
        let points = points_of(simulation, rule)?;
        let [smallest, largest] = spacings(simulation);
        let horizon = horizon_of(simulation, &points);
        let link = link(horizon, DIAGONAL * largest);
        // A rank has all points within the length of the longest bond from its owned points.
        let known = cutoffs(problem).into_iter().fold(0.0, f64::max);
        Ok(Self {
            rule: rule.clone(),
            points,
            link: (link * (1.0 + TOLERANCE)).min(known),
            radius: (horizon * (1.0 + TOLERANCE)).min(known),
            front_spacing: 0.5 * smallest,
        })
    }

    /// Name of the crack.
    pub fn name(&self) -> &str {
        &self.rule.name
    }

    /// Start position of the crack, m.
    pub fn from(&self) -> [f64; 3] {
        self.rule.from
    }

    /// Compute the surface at the time of a snapshot. The result is bitwise the same on all ranks and for any
    /// number of ranks. Collective.
    pub fn now<const D: usize>(
        &self,
        simulation: &mut Simulation<'_, D>,
        snapshot: &Snapshot,
    ) -> Surface {
        let damage = self.damage(simulation, snapshot);
        let damaged = self.damaged(simulation, &damage);
        let moments = simulation.forces.broken_moments(&simulation.model);
        let mut gradient = [0; 3].map(|_| vec![0.0; simulation.model.volume.len()]);
        for point in 0..simulation.model.owned() {
            if moments[point].has_broken() {
                let of_point = moments[point].gradient();
                (0..3).for_each(|d| gradient[d][point] = of_point[d]);
            }
        }
        let mut columns = gradient.each_mut().map(|column| &mut column[..]);
        simulation
            .forces
            .update_ghosts(simulation.comm, &mut columns);
        let gradient = |point: usize| Vector::from_fn(|d, _| gradient[d][point]);
        let (model, comm) = (&simulation.model, simulation.comm);
        let places: Vec<[f64; 3]> = damaged.iter().map(|point| model.position(*point)).collect();
        let bins = (!places.is_empty()).then(|| Bins::new(&places, self.radius));

        let mut area = ExactSum::default();
        for point in self.points.iter().map(|point| *point as usize) {
            let size = gradient(point).norm();
            let mut is_near = false;
            if let Some(bins) = &bins
                && size > 0.0
            {
                bins.within(model.position(point), |_, _| is_near = true);
            }
            if is_near {
                area.add(size * model.volume[point]);
            }
        }
        let area = reduce(comm, &mut [area])[0];

        let mut reach = [0.0_f64];
        let mut front = Vec::new();
        let mut around = Vec::new();
        for point in damaged.iter().copied().filter(|k| *k < model.owned()) {
            let place = model.position(point);
            reach[0] = reach[0].max(distance_squared(self.rule.from, place).sqrt());
            around.clear();
            if let Some(bins) = &bins {
                bins.within(place, |other, _| around.push(damaged[other as usize]));
            }
            // Sums in the order of ids have the same round-off on any number of ranks.
            around.sort_unstable_by_key(|other| model.ids[*other]);
            let own = Vector::from(place);
            let add = |sum: Matrix3<f64>, other: &usize| {
                let gradient = gradient(*other);
                sum + gradient * gradient.transpose()
            };
            let normals = around.iter().fold(Matrix3::zeros(), add);
            let others = around.iter().filter(|other| **other != point);
            let bonds = others.map(|other| Vector::from(model.position(*other)) - own);
            let bonds: Vec<Vector> = bonds.collect();
            let Some(edge) = Edge::find(self.radius, &bonds, normals, moments[point].mean()) else {
                continue;
            };
            // If no undamaged point is ahead, the crack has reached the surface of the body, so the point is
            // not on the front.
            let mut is_front = false;
            simulation.forces.for_each_neighbour(point, |other| {
                let bond = Vector::from(model.position(other)) - own;
                let is_undamaged =
                    damage[other].is_some_and(|damage| damage <= UNDAMAGED * self.rule.threshold);
                is_front |= is_undamaged && edge.is_ahead(&bond);
            });
            if is_front {
                front.push(FrontPoint {
                    id: model.ids[point],
                    place: (own + edge.to_middle).into(),
                });
            }
        }
        comm.max(&mut reach);
        Surface {
            area,
            reach: reach[0],
            front: self.thinned(all_gather_many(comm, &front)),
        }
    }

    /// Return the damage of the local points, ghosts included; `None` outside the set. Collective.
    fn damage<const D: usize>(
        &self,
        simulation: &mut Simulation<'_, D>,
        snapshot: &Snapshot,
    ) -> Vec<Option<f64>> {
        // Points outside the set have NaN.
        let mut damage = vec![f64::NAN; simulation.model.volume.len()];
        for point in self.points.iter().map(|point| *point as usize) {
            damage[point] = snapshot.damage(&simulation.undeformed.family_volume, point);
        }
        simulation
            .forces
            .update_ghosts(simulation.comm, &mut [&mut damage]);
        let in_set = |damage: f64| (!damage.is_nan()).then_some(damage);
        damage.into_iter().map(in_set).collect()
    }

    /// Return the local indices of the damaged points of the crack, ghosts included. Collective.
    fn damaged<const D: usize>(
        &self,
        simulation: &mut Simulation<'_, D>,
        damage: &[Option<f64>],
    ) -> Vec<usize> {
        let model = &simulation.model;
        let is_damaged =
            |point: &usize| damage[*point].is_some_and(|damage| damage > self.rule.threshold);
        let damaged: Vec<usize> = (0..model.volume.len()).filter(is_damaged).collect();
        let places: Vec<[f64; 3]> = damaged.iter().map(|point| model.position(*point)).collect();
        let mut pieces = Pieces::new(model.volume.len());
        // 0 for points that are connected to the start of the crack, otherwise 1.
        let mut is_apart = vec![1.0; model.volume.len()];
        if !places.is_empty() {
            let bins = Bins::new(&places, self.link);
            for (point, place) in damaged.iter().zip(&places) {
                bins.within(*place, |other, _| {
                    pieces.join(*point, damaged[other as usize]);
                });
                if distance_squared(self.rule.from, *place).sqrt() <= self.radius.max(self.link) {
                    is_apart[*point] = 0.0;
                }
            }
        }
        simulation.spread_least_over(pieces, &mut [&mut is_apart]);
        let mut damaged = damaged;
        damaged.retain(|point| is_apart[*point] == 0.0);
        damaged
    }

    /// Sort the points of the front by id, and remove points that are closer than `front_spacing` to an
    /// earlier point. Such points lie, for example, on the other face of the crack.
    fn thinned(&self, mut front: Vec<FrontPoint>) -> Vec<[f64; 3]> {
        front.sort_unstable_by_key(|point| point.id);
        if front.is_empty() {
            return Vec::new();
        }
        let places: Vec<[f64; 3]> = front.iter().map(|point| point.place).collect();
        let bins = Bins::new(&places, self.front_spacing);
        let mut is_kept = vec![true; places.len()];
        for (point, place) in places.iter().enumerate() {
            if is_kept[point] {
                bins.within(*place, |other, _| {
                    is_kept[other as usize] &= other as usize <= point;
                });
            }
        }
        let kept = places.into_iter().zip(is_kept);
        kept.filter_map(|(place, is_kept)| is_kept.then_some(place))
            .collect()
    }
}
