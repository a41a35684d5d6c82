//! Crack surfaces in 3-D: area and front of the crack that starts at a given position.
//!
//! Let H be 1 on one side of a crack and 0 on the other. The integral of |∇H| over the volume is the area of
//! the crack. At point i, the gradient g of H is that of a linear function fitted to H by least squares. The
//! fit has the weights ω Ṽ. H is 1 at neighbours j with a broken bond ij, and 0 at the other neighbours. With
//! the mean ξ̄ of the family,
//!
//! g = C⁻¹ Σ_broken (ξ − ξ̄) ω Ṽ,   C = Σ (ξ − ξ̄) ⊗ (ξ − ξ̄) ω Ṽ over all bonds,   area = Σ |g| V.
//!
//! On a cubic lattice, C is isotropic, and the area of a plane crack is exact for any direction of its
//! normal. Points without intact bonds have g = 0. Therefore a crack with crushed points, or with a width,
//! counts once.

use bytemuck::{Pod, Zeroable};
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

use crate::comm::all_gather_many;
use crate::comm::sum::{ExactSum, reduce};
use crate::error::Result;
use crate::points::bins::Bins;
use crate::points::distance_squared;
use crate::problem;
use crate::solver::Simulation;
use crate::solver::assign::cutoffs;
use crate::solver::conditions::{members, not_empty};
use crate::solver::connected::Pieces;

use super::snapshot::Snapshot;

type Vector = Vector3<f64>;

/// Distance, in horizons, up to which damaged points are connected; the same as in 2-D.
const LINK: f64 = 2.0 / 3.0;

/// Minimum of this distance in spacings, so that diagonal neighbours are connected for any horizon.
const DIAGONAL: f64 = 1.8;

/// Relative tolerance of distance limits: a point at the limit counts as within it.
const TOLERANCE: f64 = 1e-9;

/// Fraction of the trace of C that is added to the diagonal of C, so that C of a single layer of points is
/// invertible.
const LAYER: f64 = 1e-9;

/// Threshold, in horizons, of the distance between the mean of the damaged points around a point and the mean
/// of its family. Points of the front are above the threshold. The distance is 0.4 on a straight front, and
/// 0.05 at an edge of the body.
const ONE_SIDED: f64 = 0.2;

/// Cosine of 45°, the half angle of the cone ahead of a point of the front. The cone contains no damaged
/// point.
const CONE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Sine of 14°, the largest angle between the plane of the crack and the bond to an undamaged point ahead.
const IN_PLANE: f64 = 0.25;

/// Largest damage of an undamaged point ahead, as a fraction of the threshold. At an oblique surface of the
/// body, the damage falls below the threshold before the crack ends, but stays above this fraction.
const UNDAMAGED: f64 = 0.5;

/// A crack in 3-D whose area and front are computed.
pub struct CrackSurface {
    rule: problem::CrackPath,
    /// Owned points of the set.
    points: Vec<u32>,
    /// Distance up to which damaged points are connected, m.
    link: f64,
    /// Radius of the surroundings of a point, m; about one horizon.
    radius: f64,
    /// Minimum distance between points of the front, m.
    front_spacing: f64,
}

/// Surface of a crack at one time; the same on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Area of the crack, m², with one face counted.
    pub area: f64,
    /// Largest distance between the start of the crack and a damaged point of the crack, m; 0 without damaged
    /// points.
    pub reach: f64,
    /// Positions of the points of the front, m, in the order of their ids.
    pub front: Vec<[f64; 3]>,
}

/// A point of the front, in messages to all ranks.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct FrontPoint {
    id: u64,
    place: [f64; 3],
}

impl CrackSurface {
    /// Create the crack, and find the points of the set in which it is searched. Collective.
    ///
    /// # Errors
    /// If the set is empty; the error is the same on all ranks.
    pub fn new<const D: usize>(
        simulation: &Simulation<'_, D>,
        rule: &problem::CrackPath,
    ) -> Result<Self> {
        let (problem, model, comm) = (simulation.problem, &simulation.model, simulation.comm);
        let points = members(problem, model, rule.set);
        let key = format!("[history.crack.{}] set", rule.name);
        not_empty(problem, comm, rule.set, &points, (&key, rule.span.clone()))?;
        let volumes = (0..model.owned()).map(|point| model.volume[point]);
        let mut extremes = [0.0, -f64::MAX];
        for volume in volumes {
            extremes = [extremes[0].max(volume), extremes[1].max(-volume)];
        }
        comm.max(&mut extremes);
        let spacing = |volume| problem.dimension.edge(volume);
        let link = (LINK * problem.horizon).max(DIAGONAL * spacing(extremes[0]));
        // A rank has all points within the length of the longest bond from its owned points.
        let known = cutoffs(problem).into_iter().fold(0.0, f64::max);
        Ok(Self {
            rule: rule.clone(),
            points,
            link: (link * (1.0 + TOLERANCE)).min(known),
            radius: (problem.horizon * (1.0 + TOLERANCE)).min(known),
            front_spacing: 0.5 * spacing(-extremes[1]),
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
        let moments = |point: usize| Moments(moments.each_ref().map(|column| column[point]));
        let mut gradient = [0; 3].map(|_| vec![0.0; simulation.model.volume.len()]);
        for point in 0..simulation.model.owned() {
            if moments(point).has_broken() {
                let of_point = moments(point).gradient();
                (0..3).for_each(|d| gradient[d][point] = of_point[d]);
            }
        }
        let mut columns = gradient.each_mut().map(|column| &mut column[..]);
        simulation.forces.bring_all(simulation.comm, &mut columns);
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
            let Some(edge) = self.edge(&bonds, normals, moments(point).mean()) else {
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
            damage[point] = snapshot.damage(&simulation.family_volume, point);
        }
        simulation.forces.bring(simulation.comm, &mut damage);
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

    /// Return the edge of the damaged region at a damaged point; `None` if the point is inside the region.
    ///
    /// `bonds` are the vectors (m) from the point to the damaged points around it. `normals` is the sum of g
    /// ⊗ g over these points and the point itself, 1/m². `mean` is the mean ξ̄ of the point's family, m.
    ///
    /// At the edge, the damaged points lie on one side of the family, and no damaged point lies in the cone
    /// ahead.
    fn edge(&self, bonds: &[Vector], normals: Matrix3<f64>, mean: Vector) -> Option<Edge> {
        if bonds.is_empty() {
            return None;
        }
        let count = bonds.len() as f64;
        let middle = bonds.iter().sum::<Vector>() / count;
        let normals = SymmetricEigen::new(normals);
        let normal = normals.eigenvectors.column(normals.eigenvalues.imax());
        let normal: Vector = normal.into_owned();
        let ahead = mean - middle;
        let ahead = ahead - ahead.dot(&normal) * normal;
        let length = ahead.norm();
        if length <= ONE_SIDED * self.radius {
            return None;
        }
        let edge = Edge {
            to_middle: middle.dot(&normal) * normal,
            ahead: ahead / length,
            normal,
        };
        let is_free = !bonds.iter().any(|bond| edge.is_in_cone(bond));
        is_free.then_some(edge)
    }

    /// Sort the points of the front by id, and remove points that are too close to an earlier point. Such
    /// points lie, for example, on the other face of the crack.
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

/// Edge of the damaged region at a damaged point.
struct Edge {
    /// Vector from the point to the mid-plane of the crack, m.
    to_middle: Vector,
    /// Unit vector in the plane of the crack that points away from the damaged points.
    ahead: Vector,
    /// Unit normal of the crack.
    normal: Vector,
}

impl Edge {
    fn is_in_cone(&self, bond: &Vector) -> bool {
        bond.dot(&self.ahead) > CONE * bond.norm()
    }

    /// Whether a bond lies in the cone ahead and close to the plane of the crack.
    fn is_ahead(&self, bond: &Vector) -> bool {
        self.is_in_cone(bond) && bond.dot(&self.normal).abs() <= IN_PLANE * bond.norm()
    }
}

/// Sums of a point from [`broken_moments`](crate::solver::bonds::Forces::broken_moments).
struct Moments([f64; 14]);

impl Moments {
    fn vector(&self, first: usize) -> Vector {
        Vector::from_fn(|d, _| self.0[first + d])
    }

    /// Whether a bond of the point is broken.
    fn has_broken(&self) -> bool {
        self.0[10] > 0.0
    }

    /// Mean ξ̄ of the family, m; 0 for a point without a family.
    fn mean(&self) -> Vector {
        match self.0[0] {
            0.0 => Vector::zeros(),
            volume => self.vector(1) / volume,
        }
    }

    /// Gradient g of H at the point, 1/m.
    fn gradient(&self) -> Vector {
        let mean = self.mean();
        let [xx, yy, zz, xy, yz, xz] = std::array::from_fn(|k| self.0[4 + k]);
        let all = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let spread = all - self.0[0] * mean * mean.transpose();
        let spread = spread + LAYER * spread.trace() * Matrix3::identity();
        let broken = self.vector(11) - self.0[10] * mean;
        let inverse = spread.try_inverse();
        inverse.map_or(Vector::zeros(), |inverse| inverse * broken)
    }
}
