//! Printed summary of a run.

use crate::cli::outln;
use fissure::run::{Outcome, Phases, Summary};

use super::format::{count, si};

/// Print the summary of a run with at least one step. Call on rank 0 only.
pub fn print(outcome: &Outcome, threads: usize) {
    let summary = &outcome.summary;
    let (energies, largest, broken) = match &outcome.last_row {
        Some(row) => (row.energies, row.largest_energy(), row.broken),
        None => Default::default(),
    };
    let line = |name: &str, value: String| outln!("  {name:<17}{value}");
    outln!("summary");
    line("points", count(summary.points));
    line("bonds", count(summary.bonds));
    line("broken bonds", count(broken));
    line("steps", count(summary.steps));
    let step = si(summary.step, "s");
    let share = summary.stable_step.map_or(String::new(), |stable| {
        format!(" ({:.2} of the stable one)", summary.step / stable)
    });
    line("time step", format!("{step}{share}"));
    if summary.evaluations > summary.steps {
        line("evaluations", count(summary.evaluations));
    }
    line("ranks × threads", format!("{} × {threads}", summary.ranks));
    line("instructions", summary.instructions.to_owned());
    line("checkpoints", count(summary.checkpoints));
    // After a refinement, the number of bonds in earlier steps is unknown, so the rate is omitted.
    if !summary.is_refined {
        line("bond updates", si(bond_updates(summary), "/s"));
    }
    outln!("time by phase");
    let phases = phases(&summary.seconds).into_iter();
    let happened =
        |(name, seconds): &(&str, f64)| ![CONTACT, REGRIDDING].contains(name) || *seconds > 0.0;
    for (name, seconds) in phases.filter(happened) {
        let share = 100.0 * seconds / summary.seconds.whole;
        outln!("  {name:<17}{seconds:8.3} s {share:5.1} %");
    }
    outln!("energy");
    line("kinetic", si(energies.kinetic, "J"));
    line("strain", si(energies.strain, "J"));
    line("fracture", si(energies.fracture, "J"));
    line("external work", si(energies.work, "J"));
    let share = energies.error / largest.max(f64::MIN_POSITIVE);
    line(
        "balance error",
        format!("{} ({share:.1e} of the largest)", si(energies.error, "J")),
    );
}

/// Name of the phase of contact. This phase is omitted if its time is 0.
const CONTACT: &str = "contact";
/// Name of the phase of refinement and rebalancing. This phase is omitted if its time is 0.
const REGRIDDING: &str = "other points";

/// Return the names and times (s) of the phases.
fn phases(seconds: &Phases) -> [(&'static str, f64); 10] {
    [
        ("set-up", seconds.set_up),
        ("bonds", seconds.bonds),
        ("halo", seconds.halo),
        (CONTACT, seconds.contact),
        ("motion", seconds.motion),
        (REGRIDDING, seconds.regridding),
        ("output", seconds.output),
        ("history", seconds.history),
        ("checkpoints", seconds.checkpoints),
        ("whole run", seconds.whole),
    ]
}

/// Return the rate at which the time loop updates directed bonds, 1/s.
fn bond_updates(summary: &Summary) -> f64 {
    let seconds = &summary.seconds;
    let time_loop = seconds.bonds + seconds.halo + seconds.contact + seconds.motion;
    2.0 * summary.bonds as f64 * summary.evaluations as f64 / time_loop
}
