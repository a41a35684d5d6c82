//! Viscous damping: a force density −r ρ u̇ (Emmrich & Weckner 2006, eq. 11), and the work that it
//! takes out of the motion.

use super::model::Model;
use super::state::State;

/// What damping has taken so far.
#[derive(Debug, Clone, Default)]
pub struct Damping {
    /// Power that each owned point loses now, W; empty without damping.
    power: Vec<f64>,
    /// Whether any point of any rank is damped.
    pub damped: bool,
    /// Energy that each owned point has lost so far, J; empty without damping.
    pub dissipated: Vec<f64>,
}

impl Damping {
    /// Nothing lost yet.
    pub fn new<const D: usize>(model: &Model<D>) -> Self {
        let damped = model.damping.iter().any(|rate| *rate > 0.0);
        let zeros = vec![0.0; if damped { model.owned() } else { 0 }];
        Self {
            power: zeros.clone(),
            damped,
            dissipated: zeros,
        }
    }

    /// The damping force densities at the velocities of now join the others.
    pub fn add<const D: usize>(&self, model: &Model<D>, state: &mut State<D>) {
        for point in 0..self.power.len() {
            let rate = model.damping_of(point) * model.density_of(point);
            for d in 0..D {
                state.responses[point].force[d] -= rate * state.velocity[d][point];
            }
        }
    }

    /// Takes the energy that a point has lost, if any can, from the front of saved values; the rest.
    pub fn restore<'a>(&mut self, point: usize, saved: &'a [f64]) -> &'a [f64] {
        match self.dissipated.get_mut(point) {
            None => saved,
            Some(dissipated) => {
                *dissipated = saved[0];
                &saved[1..]
            }
        }
    }

    /// After a step (s), or at the start (0 s): adds up the energy lost, by the trapezoid rule.
    pub fn after_moving<const D: usize>(&mut self, model: &Model<D>, state: &State<D>, step: f64) {
        for (point, power) in self.power.iter_mut().enumerate() {
            let before = *power;
            let square: f64 = (0..D).map(|d| state.velocity[d][point].powi(2)).sum();
            let mass = model.density_of(point) * model.volume[point];
            *power = model.damping_of(point) * mass * square;
            self.dissipated[point] += 0.5 * step * (before + *power);
        }
    }
}
