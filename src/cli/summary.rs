//! What a run did, for the reader of the log.

use std::time::Duration;

use fissure::comm::{self, Communicator};
use fissure::solver::Simulation;
use fissure::solver::observe::Energies;

use super::format::{count, si};

/// The figures of a finished run that only all ranks together know.
pub struct Summary {
    points: u64,
    bonds: u64,
    seconds: [f64; 6],
}

/// The phases, in the order of [`Summary::seconds`].
const PHASES: [&str; 6] = ["set-up", "bonds", "halo", "motion", "output", "whole run"];

impl Summary {
    /// Gathers the figures: times are those of the slowest rank. Collective.
    pub fn new<const D: usize>(
        simulation: &Simulation<'_, D>,
        output: Duration,
        whole: Duration,
    ) -> Self {
        let times = &simulation.times;
        let phases = [
            times.set_up,
            times.forces.bonds,
            times.forces.halo,
            times.motion,
            output,
            whole,
        ];
        let mut seconds = phases.map(|phase| phase.as_secs_f64());
        simulation.comm.max(&mut seconds);
        Self {
            points: simulation.model.total,
            bonds: comm::total(simulation.comm, simulation.forces.directed_bonds()),
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
        let line = |name: &str, value: String| println!("  {name:<17}{value}");
        println!("summary");
        line("points", count(self.points));
        line("bonds", count(self.bonds / 2));
        line("broken bonds", count(broken));
        line("steps", count(simulation.number));
        let step = si(simulation.step, "s");
        let share = simulation.step / simulation.stable_step;
        line(
            "time step",
            format!("{step} ({share:.2} of the stable one)"),
        );
        line("ranks × threads", format!("{} × {threads}", comm.size()));
        let [_, bonds, halo, motion, _, _] = self.seconds;
        let loop_seconds = bonds + halo + motion;
        let updates = self.bonds as f64 * simulation.number as f64 / loop_seconds;
        line("bond updates", si(updates, "/s"));
        println!("time by phase");
        for (name, seconds) in PHASES.iter().zip(self.seconds) {
            let share = 100.0 * seconds / self.seconds[5];
            println!("  {name:<17}{seconds:8.3} s {share:5.1} %");
        }
        println!("energy");
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
