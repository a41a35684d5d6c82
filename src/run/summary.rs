//! Size and times of a finished run, for the summary.

use std::time::Duration;

use crate::comm;
use crate::solver::Simulation;
use crate::solver::refinement::Refined;

/// Size and times of a run; equal on all ranks.
#[derive(Debug, Clone)]
pub struct Summary {
    /// Number of points at the end.
    pub points: u64,
    /// Number of bonds at the end, intact or broken.
    pub bonds: u64,
    /// Whether a refinement has changed the bonds since time 0.
    pub is_refined: bool,
    /// Number of steps of this run.
    pub steps: u64,
    /// Number of force evaluations. Each explicit step, each repeat of such a step and each refinement takes
    /// one evaluation. Each iteration of a load step takes one or more.
    pub evaluations: u64,
    /// Time step at the end of the run, or at the stop, s.
    pub step: f64,
    /// Stable step for the scaled density of the last stage, s. The last stage is the stage in which the run
    /// ended or stopped. `None` if this stage computes equilibria.
    pub stable_step: Option<f64>,
    /// Number of ranks.
    pub ranks: usize,
    /// Instruction set of the bond loops.
    pub instructions: &'static str,
    /// Number of checkpoints written.
    pub checkpoints: u64,
    /// Wall-clock time by phase, s: for each phase, the largest time of any rank.
    pub seconds: Phases,
}

/// Wall-clock time per phase, s.
#[derive(Debug, Clone, Copy, Default)]
pub struct Phases {
    /// Set-up: points, partition, bonds, conditions and the first forces.
    pub set_up: f64,
    /// Loops over bonds.
    pub bonds: f64,
    /// Halo exchange, without the part that overlaps with computation.
    pub halo: f64,
    /// Contact search and contact forces.
    pub contact: f64,
    /// Parts of steps that are in no other phase: integration, conditions, the solution of load steps, and
    /// copies of displacements to the arrays of the bond loops.
    pub motion: f64,
    /// Refinement and rebalancing.
    pub regridding: f64,
    /// Output of the results.
    pub output: f64,
    /// Computation and output of the history.
    pub history: f64,
    /// Output of checkpoints.
    pub checkpoints: f64,
    /// Total since `Options::started`.
    pub whole: f64,
}

impl Summary {
    /// Collect the summary from all ranks. The durations are the times spent on results, on history and on
    /// checkpoints, and the total time. Collective.
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
            times.contact,
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
            contact,
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
            is_refined: simulation.progress.refined != Refined::default(),
            steps,
            step: simulation.clock.step(),
            evaluations: times.evaluations,
            stable_step: (!simulation.is_quasi_static()).then(|| simulation.scaled_stable_step()),
            ranks: simulation.comm.size(),
            instructions: simulation.forces.instructions().name(),
            checkpoints,
            seconds: Phases {
                set_up,
                bonds,
                halo,
                contact,
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
