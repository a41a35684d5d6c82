//! Contact force between two points.

use std::f64::consts::PI;

use crate::dimension::Dimension;
use crate::material::Pmb;
use crate::problem::{Block, ContactModel, ContactRule};

/// Contact distance of short-range forces, as a fraction of the mean of the edges of both points
/// (Silling & Askari 2005, §5).
const SHORT_RANGE: f64 = 1.35;

/// Upper limit of the contact distance of short-range forces, as a fraction of the distance between the
/// reference positions of both points.
const SHORT_RANGE_OF_REFERENCE: f64 = 0.9;

/// Stiffness of short-range forces, divided by the bond stiffness of a bond-based law (Macek & Silling 2007).
const SHORT_RANGE_STIFFNESS: f64 = 15.0;

/// Damping ratio of the tangential motion of a contact that sticks by friction.
const STICKING: f64 = 0.5;

/// Contact rule for the points of two blocks.
#[derive(Debug, Clone, Copy)]
pub(super) struct PairRule {
    /// Contact distance, m. If `None`, the contact distance is `edge_share` times the mean of the edges of
    /// both points.
    radius: Option<f64>,
    edge_share: f64,
    /// Upper limit of the contact distance, as a fraction of the reference distance. With this limit, no
    /// force acts in the reference positions or after free thermal expansion.
    reference_share: f64,
    stiffness: Stiffness,
    response: Response,
}

/// Friction and damping of a contact, which depend on the overlap and the relative velocity.
#[derive(Debug, Clone, Copy)]
pub(super) struct Response {
    static_friction: f64,
    kinetic_friction: f64,
    /// Damping ratio of a collision of two points, or of a point and a rigid body.
    damping_ratio: f64,
}

/// The stiffness of a pair of points, N/m.
#[derive(Debug, Clone, Copy)]
enum Stiffness {
    /// Stiffness of a layer of material between the points: this factor (N/m^D) times ℓ^(D − 1), where ℓ is
    /// the mean edge (m) of both points.
    OfLayer(f64),
    /// Stiffness: this factor (N/m⁷) times the product of the volumes of both points.
    OfVolumes(f64),
}

/// Data of a point for the computation of contact forces.
#[derive(Debug, Clone, Copy)]
pub(super) struct ContactPoint<const D: usize> {
    /// Reference position, m.
    pub reference: [f64; D],
    /// Displacement, m.
    pub displacement: [f64; D],
    /// Velocity, m/s.
    pub velocity: [f64; D],
    /// Thermal stretch; 0 in runs without temperatures.
    pub thermal_stretch: f64,
    /// Volume, m³.
    pub volume: f64,
    /// Edge of the line segment, square or cube that represents the volume of the point, m.
    pub edge: f64,
    /// Mass, kg.
    pub mass: f64,
}

impl<const D: usize> ContactPoint<D> {
    /// Present position, m.
    pub fn position(&self) -> [f64; 3] {
        let position = std::array::from_fn(|d| self.reference[d] + self.displacement[d]);
        whole::<D>(position)
    }
}

/// Extend a vector to three components by zeros.
pub(super) fn whole<const D: usize>(vector: [f64; D]) -> [f64; 3] {
    let mut whole = [0.0; 3];
    whole[..D].copy_from_slice(&vector);
    whole
}

/// Contribution of a pair, or of all contacts of a point, to the limits of the time step.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Demand {
    /// Stiffness, N/m.
    pub stiffness: f64,
    /// Damping coefficient, N s/m. For a pair, the larger of the coefficients of normal damping and of
    /// sticking friction. For a point, the sum over its contacts.
    pub damping: f64,
}

/// The contact force between two points, or of a rigid body on a point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Touch<const D: usize> {
    /// Repulsive force on the first point, N. The potential of this force is `energy`.
    pub repulsion: [f64; D],
    /// Force of normal damping on the first point, N.
    pub damping: [f64; D],
    /// Friction on the first point, N.
    pub friction: [f64; D],
    /// Potential energy of the pair, J.
    pub energy: f64,
    /// Contact distance minus present distance, m.
    pub overlap: f64,
    /// Overlap divided by the contact distance; 0 for contacts with rigid bodies.
    pub depth: f64,
}

impl PairRule {
    /// Create the rule for the points of two blocks.
    pub fn new(dimension: Dimension, rule: &ContactRule, blocks: [&Block<'_>; 2]) -> Self {
        let elastic = blocks.map(|block| block.body.material.elastic);
        let horizon = blocks[0].horizon.min(blocks[1].horizon);
        let (edge_share, reference_share, stiffness) = match rule.model {
            ContactModel::Penalty => {
                // The materials act in series. The layer of each material is half a horizon thick.
                let [first, second] = elastic.map(|elastic| elastic.youngs_modulus);
                let series = 2.0 * first * second / (first + second);
                let modulus = rule.stiffness.unwrap_or(series);
                let layer = modulus * dimension.out_of_plane_measure() / horizon;
                (1.0, 1.0, Stiffness::OfLayer(layer))
            }
            ContactModel::ShortRange => {
                let [first, second] = elastic.map(|elastic| elastic.bulk_modulus());
                let stiffest = SHORT_RANGE_STIFFNESS * first.min(second);
                let modulus = rule.stiffness.unwrap_or(stiffest);
                let constant = short_range_spring(dimension, modulus, horizon);
                let (share, reference) = (SHORT_RANGE, SHORT_RANGE_OF_REFERENCE);
                (share, reference, Stiffness::OfVolumes(constant))
            }
        };
        Self {
            radius: rule.radius,
            edge_share,
            reference_share,
            stiffness,
            response: Response::new(rule),
        }
    }

    /// Largest contact distance (m) of points with edges of at most `edge` (m), without thermal stretch.
    pub fn largest_distance(&self, edge: f64) -> f64 {
        self.radius.unwrap_or(self.edge_share * edge)
    }

    /// Contact distance (m) of points with these edges (m) and the reference distance `reference` (m),
    /// without thermal stretch.
    pub fn distance(&self, edges: [f64; 2], reference: f64) -> f64 {
        let distance = self.largest_distance(0.5 * (edges[0] + edges[1]));
        distance.min(self.reference_share * reference)
    }

    /// Return three quantities: contact distance minus present distance (m), the present distance (m), and
    /// the vector from the first to the second point (m). The contact distance is multiplied by 1 + a with
    /// the mean thermal stretch a of the two points.
    fn overlap<const D: usize>(
        &self,
        first: &ContactPoint<D>,
        second: &ContactPoint<D>,
    ) -> (f64, f64, [f64; D]) {
        let reference: [f64; D] = std::array::from_fn(|d| second.reference[d] - first.reference[d]);
        let vector: [f64; D] = std::array::from_fn(|d| {
            reference[d] + (second.displacement[d] - first.displacement[d])
        });
        let apart = norm(vector);
        let thermal_stretch = 0.5 * (first.thermal_stretch + second.thermal_stretch);
        let distance = self.distance([first.edge, second.edge], norm(reference));
        (distance * (1.0 + thermal_stretch) - apart, apart, vector)
    }

    /// Contact stiffness of a pair, N/m.
    fn stiffness<const D: usize>(&self, first: &ContactPoint<D>, second: &ContactPoint<D>) -> f64 {
        match self.stiffness {
            Stiffness::OfLayer(layer) => {
                let edge = 0.5 * (first.edge + second.edge);
                layer * edge.powi(D as i32 - 1)
            }
            Stiffness::OfVolumes(constant) => constant * (first.volume * second.volume),
        }
    }

    /// Contribution of a pair to the step limits. The result is `None` if the pair does not touch and will
    /// not touch within `time` (s) at its present approach speed. The result is also `None` if the gap
    /// (present distance minus contact distance) exceeds `most_gap` (m).
    pub fn demand<const D: usize>(
        &self,
        first: &ContactPoint<D>,
        second: &ContactPoint<D>,
        (time, most_gap): (f64, f64),
    ) -> Option<Demand> {
        let (overlap, apart, vector) = self.overlap(first, second);
        let velocity: [f64; D] = std::array::from_fn(|d| first.velocity[d] - second.velocity[d]);
        let approach = dot(velocity, vector) / apart;
        let touches = overlap >= -most_gap && overlap + time * approach.max(0.0) >= 0.0;
        touches.then(|| {
            let mass = first.mass * second.mass / (first.mass + second.mass);
            self.response.demand(self.stiffness(first, second), mass)
        })
    }

    /// Contact force of the second point on the first; `None` if the points do not touch or if they coincide.
    /// If the two points are exchanged, the force has exactly the opposite sign.
    pub fn touch<const D: usize>(
        &self,
        first: &ContactPoint<D>,
        second: &ContactPoint<D>,
    ) -> Option<Touch<D>> {
        let (overlap, apart, vector) = self.overlap(first, second);
        if overlap <= 0.0 || apart == 0.0 {
            return None;
        }
        let normal = vector.map(|component| component / apart);
        let stiffness = self.stiffness(first, second);
        let mass = first.mass * second.mass / (first.mass + second.mass);
        let velocity = std::array::from_fn(|d| first.velocity[d] - second.velocity[d]);
        let touch = (self.response).touch(stiffness, overlap, normal, velocity, mass);
        Some(Touch {
            depth: overlap / (overlap + apart),
            ..touch
        })
    }
}

impl Response {
    /// Create the response from the friction and damping of a contact rule.
    pub fn new(rule: &ContactRule) -> Self {
        Self {
            static_friction: rule.static_friction,
            kinetic_friction: rule.kinetic_friction,
            damping_ratio: damping_ratio(rule.restitution),
        }
    }

    fn is_rough(&self) -> bool {
        self.static_friction > 0.0 || self.kinetic_friction > 0.0
    }

    /// Contribution of a contact with this stiffness (N/m) and reduced mass (kg) to the step limits.
    pub fn demand(&self, stiffness: f64, mass: f64) -> Demand {
        let sticking = if self.is_rough() { STICKING } else { 0.0 };
        let ratio = sticking.max(self.damping_ratio);
        Demand {
            stiffness,
            damping: ratio * 2.0 * (stiffness * mass).sqrt(),
        }
    }

    /// Contact force on a point for an overlap (m) and a stiffness (N/m). `normal` is the unit vector from
    /// the point towards the other point or body. `velocity` (m/s) is the velocity of the point relative to
    /// this other object. `mass` is the reduced mass, kg.
    pub fn touch<const D: usize>(
        &self,
        stiffness: f64,
        overlap: f64,
        normal: [f64; D],
        velocity: [f64; D],
        mass: f64,
    ) -> Touch<D> {
        let repulsion = stiffness * overlap;
        let critical = 2.0 * (stiffness * mass).sqrt();
        let approach = dot(velocity, normal);
        // The total normal force is never attractive.
        let pressure = (repulsion + self.damping_ratio * critical * approach).max(0.0);
        let sliding: [f64; D] = std::array::from_fn(|d| velocity[d] - approach * normal[d]);
        let speed = norm(sliding);
        let drag = if self.is_rough() && speed > 0.0 {
            let sticking = STICKING * critical * speed;
            if sticking <= self.static_friction * pressure {
                sticking
            } else {
                sticking.min(self.kinetic_friction * pressure)
            }
        } else {
            0.0
        };
        Touch {
            repulsion: normal.map(|component| -repulsion * component),
            damping: normal.map(|component| -(pressure - repulsion) * component),
            friction: sliding.map(|component| {
                if speed > 0.0 {
                    -drag * (component / speed)
                } else {
                    0.0
                }
            }),
            energy: 0.5 * repulsion * overlap,
            overlap,
            depth: 0.0,
        }
    }
}

/// Damping ratio for a coefficient of restitution that is above 0 and at most 1.
fn damping_ratio(restitution: f64) -> f64 {
    if restitution == 1.0 {
        return 0.0;
    }
    let (mut low, mut high) = (0.0, 1.0);
    while restitution_of(high) > restitution {
        high *= 2.0;
    }
    // Bisect until no floating-point number lies inside the interval.
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if restitution_of(middle) >= restitution {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// Coefficient of restitution of a damped linear spring that never pulls, as a function of its damping ratio
/// (Schwager & Pöschel 2007, eq. 19 to 21).
fn restitution_of(ratio: f64) -> f64 {
    let root = (1.0 - ratio * ratio).abs().sqrt();
    if root < 1e-8 {
        return libm::exp(-2.0);
    }
    let turned = if ratio < 1.0 {
        PI - libm::atan2(2.0 * ratio * root, 1.0 - 2.0 * ratio * ratio)
    } else {
        libm::log((ratio + root) / (ratio - root))
    };
    libm::exp(-ratio / root * turned)
}

/// Spring constant of short-range forces divided by the volumes of both points, N/m⁷: c/δ with the
/// micromodulus c of a bond-based law with this bulk modulus (Pa) and this horizon δ (m).
pub fn short_range_spring(dimension: Dimension, modulus: f64, horizon: f64) -> f64 {
    let youngs_modulus = 3.0 * (1.0 - 2.0 * dimension.bond_based_poisson_ratio()) * modulus;
    Pmb::new(dimension, youngs_modulus, horizon).micromodulus / horizon
}

fn dot<const D: usize>(a: [f64; D], b: [f64; D]) -> f64 {
    (0..D).map(|d| a[d] * b[d]).sum()
}

fn norm<const D: usize>(a: [f64; D]) -> f64 {
    dot(a, a).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn restitution_falls_with_damping() {
        assert_eq!(damping_ratio(1.0), 0.0);
        let mut last = 0.0;
        for restitution in [0.9, 0.5, 0.2, 0.1353, 0.1, 0.02] {
            let ratio = damping_ratio(restitution);
            assert!(ratio > last);
            assert!((restitution_of(ratio) / restitution - 1.0).abs() < 1e-9);
            last = ratio;
        }
    }
}
