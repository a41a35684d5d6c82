//! A body of a plan alone, as a block of its lattice that nothing acts on.

use crate::deck::plan::{Plan, PointSource, Shape, StepRule};

/// A plan with this body only, and the edges of its cells (m); `None` for points from a file.
pub fn alone(plan: &Plan, body: usize) -> Option<(Plan, [f64; 3])> {
    let mut body = plan.bodies[body].clone();
    let PointSource::Lattice { spacing, .. } = body.points else {
        return None;
    };
    if let Some(damage) = &mut body.damage {
        damage.no_failure.clear();
    }
    // It is never moved by steps.
    body.material.damping = 0.0;
    let mut alone = Plan {
        source: plan.source.clone(),
        volume_correction: plan.volume_correction,
        quadrature: plan.quadrature,
        family: plan.family,
        bodies: vec![body],
        ..Plan::new(plan.dimension, plan.horizon, 1.0)
    };
    alone.time.step = StepRule::Fixed(1.0);
    Some((alone, spacing))
}

/// Gives the body of such a plan the cells between two corners, of a lattice through `origin`; all in m.
pub fn fill(alone: &mut Plan, [lower, upper]: [[f64; 3]; 2], spacing: [f64; 3], origin: [f64; 3]) {
    alone.bodies[0].points = PointSource::Lattice {
        shape: Shape::Box { lower, upper },
        spacing,
        origin,
    };
}
