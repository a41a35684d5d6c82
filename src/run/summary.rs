//! What a run did.

use std::time::Duration;

use crate::comm;
use crate::solver::Simulation;

/// The figures of a run; the same on all ranks.
#[derive(Debug, Clone)]
pub struct Summary {
    /// Number of points.
    pub points: u64,
    /// Number of bonds that there were or are, each counted once.
    pub bonds: u64,
    /// Number of steps that this run made.
    pub steps: u64,
    /// Number of force evaluations: one a step, or one an iteration of a load step.
    pub evaluations: u64,
    /// Length of a step of the last stage, s.
    pub step: f64,
    /// The largest step that is known to be stable in the last stage, s; none where that is a relaxation.
    pub stable_step: Option<f64>,
    /// Number of ranks.
    pub ranks: usize,
    /// The vector instructions that were used.
    pub instructions: &'static str,
    /// Number of checkpoints that were written.
    pub checkpoints: u64,
    /// Wall-clock time of the slowest rank by phase, s.
    pub seconds: Phases,
}

/// A time for each phase of a run, s.
#[derive(Debug, Clone, Copy, Default)]
pub struct Phases {
    /// Points, partition and bonds.
    pub set_up: f64,
    /// Loops over bonds.
    pub bonds: f64,
    /// Exchange with other ranks that no work hides.
    pub halo: f64,
    /// Integration and conditions, and showing the bonds where points are.
    pub motion: f64,
    /// Refinements of the grid, and points that were dealt out anew.
    pub regridding: f64,
    /// Result.
    pub output: f64,
    /// History.
    pub history: f64,
    /// Checkpoints.
    pub checkpoints: f64,
    /// All, from the start of the process on if the caller says when that was.
    pub whole: f64,
}

impl Summary {
    /// Gathers the figures of `steps` steps with so many checkpoints; `spent` is the time of output,
    /// of the history, of checkpoints and in all. Collective.
    pub(super) fn new<const D: usize>(
        simulation: &Simulation<'_, D>,
        steps: u64,
        checkpoints: u64,
        [output, history, checkpointing, whole]: [Duration; 4],
    ) -> Self {
        let times = &simulation.times;
        let phases = [
            times.set_up,
            times.forces.bonds,
            times.forces.halo,
            times.motion,
            times.regridding,
            output,
            history,
            checkpointing,
            whole,
        ];
        let mut seconds = phases.map(|phase| phase.as_secs_f64());
        simulation.comm.max(&mut seconds);
        let [
            set_up,
            bonds,
            halo,
            motion,
            regridding,
            output,
            history,
            checkpointing,
            whole,
        ] = seconds;
        Self {
            points: simulation.model.total,
            bonds: comm::total(simulation.comm, simulation.forces.directed_bonds()) / 2,
            steps,
            step: simulation.clock.step(),
            evaluations: times.evaluations,
            stable_step: (!simulation.relaxes()).then(|| simulation.scaled_stable_step()),
            ranks: simulation.comm.size(),
            instructions: simulation.forces.instructions().name(),
            checkpoints,
            seconds: Phases {
                set_up,
                bonds,
                halo,
                motion,
                regridding,
                output,
                history,
                checkpoints: checkpointing,
                whole,
            },
        }
    }
}
