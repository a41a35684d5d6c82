//! Rigid bodies: their motion, and their contact with points.

use bytemuck::{Pod, Zeroable};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::comm::sum::ExactSum;
use crate::dimension::Dimension;
use crate::expression::Expression;
use crate::problem::{self, Block, RigidMotion};

use super::pair::{ContactPoint, Demand, Response, Touch, whole};
use super::shape::{distance, inertia};

/// Number of components of a [`Wrench`].
const WRENCH: usize = 6;

/// A force (N) on a rigid body, and its torque (N m) about the centre of the body.
type Wrench = [f64; WRENCH];

/// The state of a rigid body; the same on all ranks.
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct RigidState {
    /// Position of the centre, m.
    pub position: [f64; 3],
    /// Velocity of the centre, m/s; for a driven body, the mean velocity in the last step (0 in load steps).
    pub velocity: [f64; 3],
    /// Rotation from the body's axes to the space axes: quaternion i, j, k, w.
    pub rotation: [f64; 4],
    /// Angular momentum, kg m²/s.
    pub angular_momentum: [f64; 3],
    /// Contact force (N) and torque (N m) that the points exert on the body.
    pub contact: Wrench,
    /// Part of `contact` that is friction.
    friction: Wrench,
    /// Part of `contact` that is contact damping.
    damping: Wrench,
    /// Displacement of a driven body in the present load step, m. The work of this displacement is added at
    /// the first equilibrium of the load step. The value is then reset to 0. It is also 0 in explicit stages.
    advance: [f64; 3],
    /// Prescribed force, N.
    load: [f64; 3],
    /// Work of the prescribed force or motion, J.
    pub work: f64,
    /// Energy that friction has taken from the body, J. The energy that friction has taken from the points is
    /// not included.
    pub friction_energy: f64,
    /// Same as `friction_energy`, for contact damping.
    pub damping_energy: f64,
}

#[derive(Debug)]
pub(super) struct RigidBody {
    problem: problem::Rigid,
    /// Position of the centre at the start, m.
    start: [f64; 3],
    dimension: Dimension,
    pub state: RigidState,
    /// Mass, kg; 0 for a driven body, whose mass has no effect.
    mass: f64,
    /// Inertia tensor in the body's axes (kg m²), and its inverse.
    inertia: [Matrix3<f64>; 2],
    response: Response,
    /// Stiffness of the contact layer by block: modulus times out-of-plane measure, divided by the thickness
    /// of the layer (N/m³ in 3-D).
    layers: Vec<f64>,
}

/// Exact sums of the forces and torques that the points exert on a rigid body.
pub(super) struct WrenchSums {
    /// Sums of all contact forces, of friction, and of contact damping.
    sums: [[ExactSum; WRENCH]; 3],
}

impl WrenchSums {
    pub fn new() -> Self {
        Self {
            sums: std::array::from_fn(|_| [const { ExactSum::ZERO }; WRENCH]),
        }
    }

    pub fn flat(self) -> impl Iterator<Item = ExactSum> {
        self.sums.into_iter().flatten()
    }

    /// Number of exact sums in the result of [`Self::flat`].
    pub const COUNT: usize = 3 * WRENCH;
}

impl RigidBody {
    /// The rigid body's definition in the deck.
    pub fn problem(&self) -> &problem::Rigid {
        &self.problem
    }

    /// Create the body at the start of a run.
    pub fn new(problem: &problem::Rigid, dimension: Dimension, blocks: &[Block<'_>]) -> Self {
        let mut start = problem.centre;
        let (mass, velocity, spin) = match &problem.motion {
            RigidMotion::Driven(displacement) => {
                let moved = Self::values(displacement, 0.0);
                start = std::array::from_fn(|d| start[d] + moved[d]);
                (0.0, [0.0; 3], [0.0; 3])
            }
            RigidMotion::Free {
                mass,
                velocity,
                angular_velocity,
                ..
            } => (*mass, *velocity, *angular_velocity),
        };
        let moments = mass.max(f64::MIN_POSITIVE) * inertia(&problem.shape, dimension.count());
        let inverse = moments.try_inverse().unwrap_or_else(Matrix3::identity);
        let layer = |block: &Block<'_>| {
            // The thickness of the contact layer is half the horizon of the points.
            let modulus = problem
                .rule
                .stiffness
                .unwrap_or(block.body.material.elastic.youngs_modulus);
            2.0 * modulus * dimension.out_of_plane_measure() / block.horizon
        };
        Self {
            problem: problem.clone(),
            start,
            dimension,
            state: RigidState {
                position: start,
                velocity,
                rotation: [0.0, 0.0, 0.0, 1.0],
                angular_momentum: (moments * Vector3::from(spin)).into(),
                ..RigidState::zeroed()
            },
            mass,
            inertia: [moments, inverse],
            response: Response::new(&problem.rule),
            layers: blocks.iter().map(layer).collect(),
        }
    }

    fn rotation(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::new_unchecked(Quaternion::from(nalgebra::Vector4::from(
            self.state.rotation,
        )))
    }

    /// Angular velocity (1/s) for the present angular momentum and this rotation.
    fn angular_velocity(&self, rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
        if self.mass == 0.0 {
            return Vector3::zeros();
        }
        let own = rotation.inverse_transform_vector(&self.state.angular_momentum.into());
        rotation.transform_vector(&(self.inertia[1] * own))
    }

    /// Kinetic energy, J.
    pub fn kinetic_energy(&self) -> f64 {
        if self.mass == 0.0 {
            return 0.0;
        }
        let spin = self.angular_velocity(&self.rotation());
        let turning = spin.dot(&Vector3::from(self.state.angular_momentum));
        0.5 * (self.mass * Vector3::from(self.state.velocity).norm_squared() + turning)
    }

    /// Evaluate expressions of t at a time (s). The result is 0 for components without an expression.
    fn values(expressions: &[Expression], time: f64) -> [f64; 3] {
        std::array::from_fn(|d| {
            let value = expressions.get(d).map(|it| it.evaluate([0.0; 3], time));
            value.unwrap_or(0.0)
        })
    }

    /// Advance the body by a step of length `step` (s), which ends at `time` (s). A free body first gets
    /// the first half kick of the step.
    pub fn drift(&mut self, time: f64, step: f64) {
        match &self.problem.motion {
            RigidMotion::Driven(displacement) => {
                let moved = Self::values(displacement, time);
                for d in 0..3 {
                    let new = self.problem.centre[d] + moved[d];
                    self.state.velocity[d] = (new - self.state.position[d]) / step;
                    self.state.position[d] = new;
                }
            }
            RigidMotion::Free { .. } => {
                self.kick(0.5 * step);
                for d in 0..3 {
                    self.state.position[d] += step * self.state.velocity[d];
                }
                // The midpoint rule conserves angular momentum exactly, and energy to second order.
                let rotation = self.rotation();
                let middle = rotated(&rotation, self.angular_velocity(&rotation), 0.5 * step);
                let new = rotated(&rotation, self.angular_velocity(&middle), step);
                self.state.rotation = new.coords.into();
            }
        }
    }

    /// Prepare the next load step: move a driven body to its position at a time (s), and set its velocity
    /// to 0.
    pub fn place(&mut self, time: f64) {
        if let RigidMotion::Driven(displacement) = &self.problem.motion {
            let moved = Self::values(displacement, time);
            for d in 0..3 {
                let new = self.problem.centre[d] + moved[d];
                self.state.advance[d] = new - self.state.position[d];
                self.state.position[d] = new;
                self.state.velocity[d] = 0.0;
            }
        }
    }

    fn kick(&mut self, duration: f64) {
        if self.mass > 0.0 {
            for d in 0..3 {
                let force = self.state.contact[d] + self.state.load[d];
                self.state.velocity[d] += duration * (force / self.mass);
                self.state.angular_momentum[d] += duration * self.state.contact[3 + d];
            }
        }
    }

    /// Finish a step of length `step` (s) that ends at `time` (s). Store the forces that the points exert.
    /// Record the work of these forces and of the prescribed force, and apply the second half kick. `sums`
    /// begins with the values of [`WrenchSums::flat`], summed over all ranks.
    pub fn close_step(&mut self, sums: &[f64], time: f64, step: f64) {
        let wrench = |k: usize| -> Wrench { std::array::from_fn(|c| sums[k * WRENCH + c]) };
        let [contact, friction, damping] = [0, 1, 2].map(wrench);
        let spin = self.angular_velocity(&self.rotation());
        let state = &mut self.state;
        let velocity = [state.velocity, spin.into()].concat();
        // Trapezoidal rule over the step.
        let work = |before: &Wrench, after: &Wrench| -> f64 {
            let powers = (0..WRENCH).map(|c| (before[c] + after[c]) * velocity[c]);
            0.5 * step * powers.sum::<f64>()
        };
        state.friction_energy -= work(&state.friction, &friction);
        state.damping_energy -= work(&state.damping, &damping);
        match &self.problem.motion {
            RigidMotion::Driven(_) => {
                state.work -= work(&state.contact, &contact);
                // In a load step, the velocity is 0 and work comes from `advance`. The first equilibrium
                // resets `advance`, so further equilibria of the load step add no work.
                for (d, advance) in state.advance.iter_mut().enumerate() {
                    let advance = std::mem::take(advance);
                    state.work -= 0.5 * (state.contact[d] + contact[d]) * advance;
                }
            }
            RigidMotion::Free { force, .. } => {
                let load = Self::values(force, time);
                let both = (0..3).map(|d| (state.load[d] + load[d]) * state.velocity[d]);
                state.work += 0.5 * step * both.sum::<f64>();
                state.load = load;
            }
        }
        (state.contact, state.friction, state.damping) = (contact, friction, damping);
        self.kick(0.5 * step);
    }

    fn surface(&self, position: [f64; 3]) -> (f64, Vector3<f64>) {
        let rotation = self.rotation();
        let seen = Vector3::from(position) - Vector3::from(self.state.position);
        let own = rotation.inverse_transform_vector(&seen);
        let (apart, normal) = distance(&self.problem.shape, own, self.dimension.count());
        (apart, rotation.transform_vector(&normal))
    }

    /// Return the overlap of a point and the surface (m), and the outward normal of the surface at the point.
    /// The overlap is the contact distance minus the present distance of the point from the surface. The
    /// contact distance is (1 + a) times the smaller of two lengths: half the edge of the point, and the
    /// distance of the point from the surface at the start. Here a is the thermal stretch of the point. The
    /// overlap is set to 0 if the point is farther from the surface than (1 + a) times half the edge.
    fn overlap<const D: usize>(&self, point: &ContactPoint<D>) -> (f64, Vector3<f64>) {
        let (apart, normal) = self.surface(point.position());
        let (half, expansion) = (0.5 * point.edge, 1.0 + point.thermal_stretch);
        if apart >= half * expansion {
            return (0.0, normal);
        }
        let distance = half.min(self.start_distance(whole(point.reference)));
        (distance * expansion - apart, normal)
    }

    /// Distance (m) of a position from the initial surface of the body; negative inside.
    pub fn start_distance(&self, position: [f64; 3]) -> f64 {
        let seen = Vector3::from(position) - Vector3::from(self.start);
        distance(&self.problem.shape, seen, self.dimension.count()).0
    }

    /// Contact force of the body on a point of a block; `None` if the point does not touch the body.
    pub fn touch<const D: usize>(&self, block: usize, point: &ContactPoint<D>) -> Option<Touch<D>> {
        let (overlap, normal) = self.overlap(point);
        if overlap <= 0.0 {
            return None;
        }
        let stiffness = self.point_stiffness(block, point);
        let mass = self.reduced(point.mass);
        let (position, velocity) = (point.position(), point.velocity);
        let arm = Vector3::from(position) - Vector3::from(self.state.position);
        let surface = self.surface_velocity(arm);
        let relative = std::array::from_fn(|d| velocity[d] - surface[d]);
        // [`Response::touch`] needs the normal from the point to the body, which is opposite to the outward
        // normal.
        let normal = std::array::from_fn(|d| -normal[d]);
        Some(
            self.response
                .touch(stiffness, overlap, normal, relative, mass),
        )
    }

    /// Distance of a position (m) from the centre of the body, m.
    pub fn arm(&self, position: [f64; 3]) -> f64 {
        (Vector3::from(position) - Vector3::from(self.state.position)).norm()
    }

    /// Add to `sums` the force and torque that a point at a position (m) exerts on the body. `touch` is the
    /// contact force of the body on the point.
    pub fn add_opposite<const D: usize>(
        &self,
        sums: &mut WrenchSums,
        position: [f64; 3],
        touch: &Touch<D>,
    ) {
        let arm = Vector3::from(position) - Vector3::from(self.state.position);
        let all: [f64; D] =
            std::array::from_fn(|d| touch.repulsion[d] + touch.damping[d] + touch.friction[d]);
        let forces = [all, touch.friction, touch.damping];
        let forces = forces.map(|force| -Vector3::from(whole(force)));
        for (sums, force) in sums.sums.iter_mut().zip(forces) {
            let torque = arm.cross(&force);
            for d in 0..3 {
                sums[d].add(force[d]);
                sums[3 + d].add(torque[d]);
            }
        }
    }

    /// Contribution of a point to the step limits. The result is `None` unless the point touches the body, or
    /// will touch the body within `time` (s) at the present approach speed. At any velocity, the result is
    /// also `None` if the gap exceeds the edge of the point. The gap is d − (1 + a) ℓ/2. Here d is the
    /// distance of the point from the surface, ℓ is the edge of the point, and a is the thermal stretch of
    /// the point.
    pub fn demand<const D: usize>(
        &self,
        block: usize,
        point: &ContactPoint<D>,
        time: f64,
    ) -> Option<Demand> {
        let (apart, normal) = self.surface(point.position());
        let gap = apart - 0.5 * point.edge * (1.0 + point.thermal_stretch);
        if gap > point.edge {
            return None;
        }
        let arm = Vector3::from(point.position()) - Vector3::from(self.state.position);
        let velocity = Vector3::from(whole(point.velocity)) - self.surface_velocity(arm);
        let approach = -velocity.dot(&normal);
        let touches = gap <= time * approach.max(0.0);
        touches.then(|| {
            self.response
                .demand(self.point_stiffness(block, point), self.reduced(point.mass))
        })
    }

    fn point_stiffness<const D: usize>(&self, block: usize, point: &ContactPoint<D>) -> f64 {
        self.layers[block] * point.edge.powi(D as i32 - 1)
    }

    /// Reduced mass of the body and a point, kg.
    fn reduced(&self, mass: f64) -> f64 {
        if self.mass > 0.0 {
            mass * self.mass / (mass + self.mass)
        } else {
            mass
        }
    }

    /// Velocity (m/s) of the surface at the position `arm`, which is relative to the centre (m).
    fn surface_velocity(&self, arm: Vector3<f64>) -> Vector3<f64> {
        let spin = self.angular_velocity(&self.rotation());
        Vector3::from(self.state.velocity) + spin.cross(&arm)
    }

    /// Upper bound of 1/m + r²/I (1/kg) for contacts within a distance r (m) of the centre; 0 for a driven
    /// body. m is the mass of the body, and I is its moment of inertia about any axis.
    pub fn mobility(&self, reach: f64) -> f64 {
        if self.mass == 0.0 {
            return 0.0;
        }
        let inverse = &self.inertia[1];
        let largest = if self.dimension.count() == 2 {
            inverse[(2, 2)]
        } else {
            // No eigenvalue exceeds the largest row sum of absolute values.
            let rows = inverse
                .row_iter()
                .map(|row| row.iter().map(|entry| entry.abs()).sum::<f64>());
            rows.fold(0.0, f64::max)
        };
        1.0 / self.mass + reach * reach * largest
    }

    /// Whether position and velocity are finite.
    pub fn is_finite(&self) -> bool {
        let RigidState {
            position, velocity, ..
        } = &self.state;
        position
            .iter()
            .chain(velocity)
            .all(|value| value.is_finite())
    }
}

/// Return `rotation`, followed by a rotation with an angular velocity `spin` (1/s) over a time (s).
fn rotated(rotation: &UnitQuaternion<f64>, spin: Vector3<f64>, time: f64) -> UnitQuaternion<f64> {
    let half = 0.5 * time * spin;
    // The result is (1 + ½ Δt w) q with the angular velocity w and the quaternion q of `rotation`. The
    // computation needs no sine, and the error of the angle is of third order in Δt.
    let turn = Quaternion::from_parts(1.0, half);
    UnitQuaternion::new_normalize(turn * rotation.quaternion())
}
