//! Time integration of a stage: one integrator per method.

use crate::problem::{Method, Time};
use crate::solver::Simulation;

use super::adaptive::AdaptiveVerlet;
use super::newton::NewtonKrylov;
use super::relaxation::DynamicRelaxation;
use super::verlet::Verlet;

/// The integration method of a stage.
pub trait Integrator<const D: usize>: Send + Sync {
    /// Make one explicit time step, or one iteration of a load step. An explicit step may leave its second
    /// half kick to the next call. `half_kick_pending` says whether the second half kick of the previous step
    /// must still be applied. Returns whether the second half kick of this step must still be applied.
    /// Collective.
    fn advance(&mut self, simulation: &mut Simulation<'_, D>, half_kick_pending: bool) -> bool;
}

/// Create the integrator of a stage.
pub fn integrator<const D: usize>(time: &Time) -> Box<dyn Integrator<D>> {
    match (time.method, time.adaptive) {
        (Method::Explicit, None) => Box::new(Verlet),
        (Method::Explicit, Some(rule)) => Box::new(AdaptiveVerlet(rule)),
        (Method::Relaxation(rule), _) => Box::new(DynamicRelaxation(rule)),
        (Method::Static(rule), _) => Box::new(NewtonKrylov::new(rule)),
    }
}
