//! What a run did, for the reader of the log.

use crate::cli::say;
use std::time::Duration;

use fissure::comm::{self, Communicator};
use fissure::solver::Simulation;
use fissure::solver::observe::Energies;

use super::format::{count, si};

/// The figures of a finished run that only all ranks together know.
pub struct Summary {
    points: u64,
    bonds: u64,
    steps: u64,
    checkpoints: u64,
    seconds: [f64; 7],
}

/// The phases, in the order of [`Summary::seconds`].
const PHASES: [&str; 7] = [
    "set-up",
    "bonds",
    "halo",
    "motion",
    "output",
    "checkpoints",
    "whole run",
];

impl Summary {
    /// Gathers the figures of `steps` steps with so many checkpoints; `spent` is the time of output,
    /// of checkpoints and in all. Times are those of the slowest rank. Collective.
    pub fn new<const D: usize>(
        simulation: &Simulation<'_, D>,
        steps: u64,
        checkpoints: u64,
        spent: (Duration, Duration, Duration),
    ) -> Self {
        let times = &simulation.times;
        let phases = [
            times.set_up,
            times.forces.bonds,
            times.forces.halo,
            times.motion,
            spent.0,
            spent.1,
            spent.2,
        ];
        let mut seconds = phases.map(|phase| phase.as_secs_f64());
        simulation.comm.max(&mut seconds);
        Self {
            points: simulation.model.total,
            bonds: comm::total(simulation.comm, simulation.forces.directed_bonds()),
            steps,
            checkpoints,
            seconds,
        }
    }

    /// Prints the figures; for rank 0.
    pub fn print<const D: usize>(
        &self,
        simulation: &Simulation<'_, D>,
        threads: usize,
        energies: Energies,
        broken: u64,
    ) {
        let comm: &dyn Communicator = simulation.comm;
        let line = |name: &str, value: String| say!("  {name:<17}{value}");
        say!("summary");
        line("points", count(self.points));
        line("bonds", count(self.bonds / 2));
        line("broken bonds", count(broken));
        line("steps", count(self.steps));
        let step = si(simulation.step, "s");
        let share = simulation.step / simulation.stable_step;
        line(
            "time step",
            format!("{step} ({share:.2} of the stable one)"),
        );
        line("ranks × threads", format!("{} × {threads}", comm.size()));
        line(
            "instructions",
            simulation.forces.instructions().name().to_owned(),
        );
        line("checkpoints", count(self.checkpoints));
        let [_, bonds, halo, motion, ..] = self.seconds;
        let loop_seconds = bonds + halo + motion;
        let updates = self.bonds as f64 * self.steps as f64 / loop_seconds;
        line("bond updates", si(updates, "/s"));
        say!("time by phase");
        for (name, seconds) in PHASES.iter().zip(self.seconds) {
            let share = 100.0 * seconds / self.seconds[6];
            say!("  {name:<17}{seconds:8.3} s {share:5.1} %");
        }
        say!("energy");
        line("kinetic", si(energies.kinetic, "J"));
        line("strain", si(energies.strain, "J"));
        line("fracture", si(energies.fracture, "J"));
        line("external work", si(energies.work, "J"));
        let largest = [
            energies.kinetic,
            energies.strain,
            energies.fracture,
            energies.work,
        ]
        .map(f64::abs)
        .into_iter()
        .fold(f64::MIN_POSITIVE, f64::max);
        let share = energies.error / largest;
        line(
            "balance error",
            format!("{} ({share:.1e} of the largest)", si(energies.error, "J")),
        );
    }
}
