//! A body of a problem alone, as a block of its lattice that nothing acts on.

use super::{PointSource, Problem, Shape, StepRule};

/// A problem with this body only, and the edges of its cells (m); `None` for points from a file.
pub fn alone(problem: &Problem, body: usize) -> Option<(Problem, [f64; 3])> {
    let mut body = problem.bodies[body].clone();
    let PointSource::Lattice { spacing, .. } = body.points else {
        return None;
    };
    if let Some(damage) = &mut body.damage {
        damage.no_failure.clear();
    }
    // It is never moved by steps.
    body.material.damping = 0.0;
    let mut alone = Problem {
        volume_correction: problem.volume_correction,
        quadrature: problem.quadrature,
        family: problem.family,
        bodies: vec![body],
        ..Problem::new(problem.dimension, problem.horizon, 1.0)
    };
    alone.time.step = StepRule::Fixed(1.0);
    Some((alone, spacing))
}

/// Gives the body of such a problem the cells between two corners, of a lattice through `origin`; all in m.
pub fn fill(
    alone: &mut Problem,
    [lower, upper]: [[f64; 3]; 2],
    spacing: [f64; 3],
    origin: [f64; 3],
) {
    alone.bodies[0].points = PointSource::Lattice {
        shape: Shape::Box { lower, upper },
        spacing,
        origin,
    };
}
