//! Measurement of the speed of the time loop.

use std::time::{Duration, Instant};

use super::memory::{Resident, resident};
use crate::comm::Communicator;
use crate::comm::halo::Traffic;
use crate::error::Result;
use crate::lanes::Instructions;
use crate::problem::Problem;
use crate::solver::simulation::Times;
use crate::solver::{Simulation, Stepper};

/// Figures of the measured steps on this rank.
#[derive(Debug, Clone)]
pub struct Speed {
    /// Number of points over all ranks.
    pub points: u64,
    /// Number of ghosts of this rank.
    pub ghosts: u64,
    /// Number of bonds of owned points, counted at each owned end.
    pub directed_bonds: u64,
    /// Number of the [`Self::directed_bonds`] that are in lattice families.
    pub lattice_bonds: u64,
    /// Memory of the bonds, bytes.
    pub bond_bytes: u64,
    /// Instruction set of the bond loops.
    pub instructions: Instructions,
    /// Time of the set-up.
    pub set_up: Duration,
    /// Wall-clock time of all measured steps together.
    pub whole: Duration,
    /// Time of the steps by phase.
    pub times: Times,
    /// Number, bytes and time of the messages of the steps.
    pub sent: Traffic,
    /// Number, bytes and time of the messages of an additional test. After the steps, this test exchanges the
    /// displacements as many times as there are steps. No computation overlaps these messages.
    pub sent_without_overlap: Traffic,
    /// Memory after the steps.
    pub memory: Resident,
}

/// Measure `steps` steps after `warm_up` steps. During the warm-up, caches, page tables and clock rates
/// settle. Collective.
///
/// # Errors
/// If the set-up of the simulation fails, if a value or a motion is not finite, or if a load step has failed.
pub fn speed(
    problem: &Problem,
    comm: &dyn Communicator,
    warm_up: u32,
    steps: u32,
) -> Result<Speed> {
    match problem.dimension.count() {
        1 => speed_in::<1>(problem, comm, warm_up, steps),
        2 => speed_in::<2>(problem, comm, warm_up, steps),
        _ => speed_in::<3>(problem, comm, warm_up, steps),
    }
}

fn speed_in<const D: usize>(
    problem: &Problem,
    comm: &dyn Communicator,
    warm_up: u32,
    steps: u32,
) -> Result<Speed> {
    let mut simulation = Simulation::<D>::new(problem, comm)?;
    for _ in 0..warm_up {
        simulation.advance();
    }
    let set_up = simulation.times.set_up;
    let before = simulation.forces.halo().sent;
    simulation.times = Times::default();
    barrier(comm);
    let start = Instant::now();
    let mut stepper = Stepper::new(simulation);
    for _ in 0..steps {
        stepper.advance();
    }
    let simulation = stepper.at_full_step();
    let whole = start.elapsed();
    simulation.check()?;
    let sent = since(before, simulation.forces.halo().sent);
    let sent_without_overlap = exchange_without_overlap(comm, simulation, steps);
    let (model, forces) = (&simulation.model, &simulation.forces);
    Ok(Speed {
        points: model.total,
        ghosts: (model.volume.len() - model.owned()) as u64,
        directed_bonds: forces.directed_bonds(),
        lattice_bonds: forces.lattice_bonds(),
        bond_bytes: forces.bytes() as u64,
        instructions: forces.instructions(),
        set_up,
        whole,
        times: simulation.times,
        sent,
        sent_without_overlap,
        memory: resident(),
    })
}

/// Exchange displacements `times` times while nothing is computed, and return the traffic. Collective.
fn exchange_without_overlap<const D: usize>(
    comm: &dyn Communicator,
    simulation: &mut Simulation<'_, D>,
    times: u32,
) -> Traffic {
    let before = simulation.forces.halo().sent;
    barrier(comm);
    for _ in 0..times {
        let displacement = &mut simulation.fields.displacement;
        let mut columns = displacement.each_mut().map(Vec::as_mut_slice);
        simulation.forces.update_ghosts(comm, &mut columns);
    }
    since(before, simulation.forces.halo().sent)
}

fn barrier(comm: &dyn Communicator) {
    comm.sum(&mut [0]);
}

fn since(before: Traffic, after: Traffic) -> Traffic {
    Traffic {
        messages: after.messages - before.messages,
        bytes: after.bytes - before.bytes,
        time: after.time - before.time,
    }
}
