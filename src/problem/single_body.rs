//! Problems with a single body and no conditions, for computations on a box of lattice cells of this body.

use super::{PointSource, Problem, Shape, StepRule};

/// Create a problem that contains only the body with index `body`. Omit the body's no-failure sets, scatter
/// and damping. Return the problem and the edges of the cells of the body (m). `None` if no body has this
/// index, or if the points of the body are not on a lattice.
pub fn single_body(problem: &Problem, body: usize) -> Option<(Problem, [f64; 3])> {
    let mut body = problem.bodies.get(body)?.clone();
    let PointSource::Lattice { spacing, .. } = body.points else {
        return None;
    };
    if let Some(damage) = &mut body.damage {
        damage.no_failure.clear();
        damage.weibull = None;
    }
    // These problems make no time steps. With damping, the fixed step below could be rejected as too long.
    body.material.damping = 0.0;
    let mut single = Problem {
        volume_correction: problem.volume_correction,
        family: problem.family,
        bodies: vec![body],
        ..Problem::new(problem.dimension, problem.horizon, 1.0)
    };
    single.time.step = StepRule::Fixed(1.0);
    Some((single, spacing))
}

/// Replace the points of the only body by those of the lattice cells in the box from `lower` to `upper` (m).
/// `origin` is a corner of a cell, m.
pub fn fill(
    problem: &mut Problem,
    [lower, upper]: [[f64; 3]; 2],
    spacing: [f64; 3],
    origin: [f64; 3],
) {
    let body = &mut problem.bodies[0];
    body.points = PointSource::Lattice {
        shape: Shape::Box { lower, upper },
        spacing,
        origin,
        quadrature: body.quadrature(),
    };
}
