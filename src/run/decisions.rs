//! Automatic choices of a run, for the log.

use crate::comm;
use crate::problem::{Body, StepRule};
use crate::solver::Simulation;

/// Return the names and values of the automatic choices, which are the same on all ranks. Collective.
pub fn decisions<const D: usize>(
    simulation: &mut Simulation<'_, D>,
) -> Vec<(&'static str, String)> {
    let problem = simulation.problem;
    let sent = sent(simulation);
    let lower = |rule: &dyn std::fmt::Debug| format!("{rule:?}").to_lowercase();
    let mut decided = vec![
        ("partition", partition(simulation)),
        ("sent to ghosts", sent),
        ("bonds", bonds(simulation)),
        (
            "instructions",
            simulation.forces.instructions().name().to_owned(),
        ),
        ("time step", step(simulation)),
        (
            "volumes",
            format!(
                "volume correction {}, quadrature {}",
                lower(&problem.volume_correction),
                quadrature(&problem.bodies)
            ),
        ),
    ];
    if problem.bodies.len() > 1 {
        let rule = lower(&problem.interface.rule);
        let own = problem.interface.pairs.len();
        decided.push((
            "interface",
            format!("rule {rule}, {own} pair(s) with their own"),
        ));
    }
    decided
}

fn partition<const D: usize>(simulation: &Simulation<'_, D>) -> String {
    let (comm, model) = (simulation.comm, &simulation.model);
    let own = [
        model.owned(),
        model.volume.len() - model.owned(),
        simulation.forces.halo().neighbours(),
    ]
    .map(|count| count as f64);
    let (mut max, mut min) = (own, own);
    comm.max(&mut max);
    comm::min(comm, &mut min);
    let interior = comm::total(comm, model.interior as u64) as f64 / model.total as f64;
    let range = |k: usize| {
        if min[k] == max[k] {
            max[k].to_string()
        } else {
            format!("{} to {}", min[k], max[k])
        }
    };
    format!(
        "each rank has {} points, {} ghosts of {} other rank(s); {:.0} % of all points are interior",
        range(0),
        range(1),
        range(2),
        100.0 * interior
    )
}

/// Describe the halo exchanges of a force evaluation: the content of each exchange, and the number of values
/// per ghost.
fn sent<const D: usize>(simulation: &mut Simulation<'_, D>) -> String {
    let sizes = simulation.forces.halo_sizes().into_iter();
    let parts: Vec<String> = sizes
        .map(|(name, columns)| format!("{name} ({columns})"))
        .collect();
    format!("{}; numbers per ghost in each step", parts.join(", then "))
}

/// Return the common quadrature of all bodies, or the quadrature of each body if the quadratures differ.
fn quadrature(bodies: &[Body]) -> String {
    let name = |body: &Body| format!("{:?}", body.quadrature()).to_lowercase();
    if bodies
        .iter()
        .all(|body| body.quadrature() == bodies[0].quadrature())
    {
        return name(&bodies[0]);
    }
    let each = bodies
        .iter()
        .map(|body| format!("{} of [body.{}]", name(body), body.name));
    each.collect::<Vec<_>>().join(", ")
}

fn bonds<const D: usize>(simulation: &Simulation<'_, D>) -> String {
    let total = |directed: u64| comm::total(simulation.comm, directed) / 2;
    let all = total(simulation.forces.directed_bonds());
    let lattice = total(simulation.forces.lattice_bonds());
    format!(
        "{all}: {lattice} as bits of lattices, {} in lists",
        all - lattice
    )
}

fn step<const D: usize>(simulation: &Simulation<'_, D>) -> String {
    let (step, stable) = (simulation.clock.step(), simulation.scaled_stable_step());
    let method = simulation.time_rule().method;
    if let Some(steps) = method.load_steps() {
        return format!("{step:.4e} s, {steps} load steps of {}", method.name());
    }
    let source = match simulation.time_rule().step {
        StepRule::Automatic(_) => "chosen",
        StepRule::Fixed(_) => "of the deck",
    };
    format!(
        "{step:.4e} s ({source}), {:.2} of the stable one",
        step / stable
    )
}
