//! A body of a plan alone, as a block of its lattice that nothing acts on.

use crate::deck::plan::{
    History, Interface, InterfaceRule, Method, Plan, PointSource, Selector, Set, Shape, StepRule,
    Time,
};

/// A plan with this body only, and the edges of its cells (m); `None` for points from a file.
pub fn alone(plan: &Plan, body: usize) -> Option<(Plan, [f64; 3])> {
    let mut body = plan.bodies[body].clone();
    let PointSource::Lattice { spacing, .. } = body.points else {
        return None;
    };
    if let Some(damage) = &mut body.damage {
        damage.no_failure.clear();
    }
    let alone = Plan {
        bodies: vec![body],
        refinement: None,
        interface: Interface {
            rule: InterfaceRule::Own,
            pairs: Vec::new(),
        },
        sets: vec![Set {
            name: "all".to_owned(),
            span: 0..0,
            selector: Selector::All,
        }],
        cracks: Vec::new(),
        initials: Vec::new(),
        conditions: Vec::new(),
        history: History {
            reactions: Vec::new(),
            support_forces: Vec::new(),
            probes: Vec::new(),
            fronts: Vec::new(),
            cracks: Vec::new(),
            tips: Vec::new(),
            ..plan.history.clone()
        },
        time: Time {
            end: 1.0,
            step: StepRule::Fixed(1.0),
            method: Method::Explicit,
            density_scale: 1.0,
            adaptive: None,
        },
        stages: Vec::new(),
        ..plan.clone()
    };
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
