//! The measured figures of `fissure bench`, and their output as a table or as JSON.

use clap::ValueEnum;

use crate::cli::outln;

use super::bench::{Family, Law};
use super::format::{bytes, count, si};
use fissure::lanes::Instructions;
use serde_json::{Map, Value, json};

/// Time of a phase of the time loop, s.
pub struct Phase {
    /// Name of the phase.
    pub name: &'static str,
    /// Mean over the ranks.
    pub mean: f64,
    /// Maximum over the ranks.
    pub slowest: f64,
}

/// Memory bandwidth and operation rate: the measured limits of all cores together, and the rates that the
/// time loop reaches.
pub struct Limited {
    /// Triad bandwidth, bytes/s.
    pub bandwidth: f64,
    /// Minimum number of bytes that the time loop must move, divided by the measured time, bytes/s.
    pub moved: f64,
    /// Operation rate of multiply-adds, operations/s; a multiply-add counts as two operations.
    pub arithmetic: f64,
    /// Operation rate of the loop, operations/s.
    pub done: f64,
}

/// Settings and measured values of a benchmark. Times are in s, and sizes in bytes. The values are for all
/// ranks together, unless the comment of a field says otherwise.
pub struct Figures {
    /// The law of the bonds.
    pub law: Law,
    /// Storage of the bonds.
    pub family: Family,
    /// Instruction set of the bond loops.
    pub instructions: Instructions,
    /// Bonds can break.
    pub failure: bool,
    /// Fraction of the points that touch other points; `None` without contact.
    pub touching: Option<f64>,
    /// Number of points along x, y and z.
    pub edges: [u64; 3],
    /// Number of points.
    pub points: f64,
    /// Number of directed bonds: neighbours, summed over all points.
    pub bonds: f64,
    /// Number of ranks.
    pub ranks: usize,
    /// Number of threads of rank 0.
    pub threads: usize,
    /// Number of threads of all ranks together.
    pub cores: f64,
    /// Number of measured steps.
    pub steps: f64,
    /// Number of warm-up steps.
    pub warm_up: f64,
    /// Set-up time of the slowest rank.
    pub set_up: f64,
    /// Phases of the time loop; the last entry is the total.
    pub phases: Vec<Phase>,
    /// Memory: name and size (bytes, sum over the ranks) of each entry. One entry is the memory of the stored
    /// bonds. The last entry is the peak memory of the processes. The other entries are the memory of the
    /// processes at several times.
    pub memory: Vec<(&'static str, f64)>,
    /// Bytes that all ranks send per step in halo exchanges.
    pub halo_bytes: f64,
    /// Communication time per step that does not overlap with computation, mean over the ranks, s.
    pub messages_time: f64,
    /// Communication time per step if no computation overlaps with it, mean over the ranks, s.
    pub messages_time_alone: f64,
    /// Number of messages that all ranks send per step in halo exchanges.
    pub messages: f64,
    /// Largest number of messages that one rank sends per step in halo exchanges.
    pub most_messages: f64,
    /// Number of ghosts of all ranks.
    pub ghosts: f64,
    /// Largest number of ghosts of one rank.
    pub most_ghosts: f64,
    /// Limits of the machine; `None` if the limits were not measured.
    pub limits: Option<Limited>,
}

impl Figures {
    /// Return the time of the loop on the slowest rank, s.
    fn seconds(&self) -> f64 {
        self.phases.last().map_or(f64::NAN, |phase| phase.slowest)
    }

    /// Return the bond updates per second. One update is the work of all passes of a step on
    /// one directed bond.
    fn updates(&self) -> f64 {
        self.bonds * self.steps / self.seconds()
    }

    /// Return the fraction of the communication time that the computation of interior bonds hides; NaN
    /// without messages. If ranks wait for each other, the computed fraction can be negative; 0 is then
    /// returned.
    fn hidden(&self) -> f64 {
        if self.messages > 0.0 {
            (1.0 - self.messages_time / self.messages_time_alone).max(0.0)
        } else {
            f64::NAN
        }
    }

    /// Return the time of the contact phase divided by the time of the bonds phase, both as means over the
    /// ranks; `None` without contact.
    fn contact_over_bonds(&self) -> Option<f64> {
        let mean = |name: &str| {
            let phase = self.phases.iter().find(|phase| phase.name == name)?;
            Some(phase.mean)
        };
        Some(mean("contact")? / mean("bonds")?)
    }

    fn law_name(&self) -> String {
        let value = self.law.to_possible_value();
        value.map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Print the figures as a table, or as one line of JSON if `json` is true.
    pub fn print(&self, json: bool) {
        if json {
            outln!("{}", self.json())
        } else {
            self.table()
        }
    }

    fn table(&self) {
        let line = |name: &str, value: String| outln!("  {name:<17}{value}");
        let failure = if self.failure {
            "bonds can break"
        } else {
            "bonds cannot break"
        };
        let family = self.family.name();
        outln!("benchmark: {}, {failure}, family {family}", self.law_name());
        let [x, y, z] = self.edges;
        let points = count(self.points as u64);
        line("points", format!("{points}   ({x} × {y} × {z})"));
        let neighbours = self.bonds / self.points;
        line("neighbours", format!("{neighbours:.1} a point"));
        line(
            "ranks × threads",
            format!("{} × {}", self.ranks, self.threads),
        );
        line("instructions", self.instructions.name().to_owned());
        let (steps, warm_up) = (self.steps, self.warm_up);
        line("steps", format!("{steps} after {warm_up} to warm up"));
        outln!("speed");
        let updates = si(self.updates(), "/s");
        let each = si(self.updates() / self.cores, "/s");
        line("bond updates", format!("{updates}   ({each} a core)"));
        line("set-up", si(self.set_up, "s"));
        outln!("time by phase      mean of ranks   slowest");
        for Phase {
            name,
            mean,
            slowest,
        } in &self.phases
        {
            let share = 100.0 * mean / self.seconds();
            outln!("  {name:<12}{mean:9.3} s {share:5.1} %{slowest:8.3} s");
        }
        if let (Some(touching), Some(ratio)) = (self.touching, self.contact_over_bonds()) {
            let touching = 100.0 * touching;
            line(
                "contact",
                format!(
                    "{:.1} % of bonds   ({touching:.1} % of the points touch)",
                    100.0 * ratio
                ),
            );
        }
        outln!("memory             of all ranks   a point");
        for (name, all) in &self.memory {
            let each = all / self.points;
            outln!("  {name:<17}{:>12}   {each:.0} B", bytes(*all));
        }
        outln!("halo, each step");
        let most = self.most_messages;
        line(
            "messages",
            format!("{}   (at most {most} of a rank)", self.messages),
        );
        line("sent", bytes(self.halo_bytes));
        if self.messages > 0.0 {
            let took = si(self.messages_time, "s");
            let alone = si(self.messages_time_alone, "s");
            let hidden = 100.0 * self.hidden();
            line(
                "time",
                format!("{took}, without work meanwhile {alone}   hidden: {hidden:.0} %"),
            );
        }
        let most = count(self.most_ghosts as u64);
        line(
            "ghosts",
            format!("{}   (at most {most} of a rank)", count(self.ghosts as u64)),
        );
        if let Some(limits) = &self.limits {
            outln!("limits of these cores, measured");
            let reached = |part: f64, whole: f64| format!("reached: {:.0} %", 100.0 * part / whole);
            let share = reached(limits.moved, limits.bandwidth);
            line(
                "triad",
                format!("{}   {share}", si(limits.bandwidth, "B/s")),
            );
            let share = reached(limits.done, limits.arithmetic);
            line(
                "multiply-adds",
                format!("{}   {share}", si(limits.arithmetic, "FLOP/s")),
            );
        }
    }

    /// Return the figures as one JSON object. If a figure has a unit, its name includes the unit.
    fn json(&self) -> String {
        let mut entries = Map::new();
        let mut add =
            |name: &str, value: Value| entries.insert(name.replace(['-', ' '], "_"), value);
        add("law", json!(self.law_name()));
        add("family", json!(self.family.name()));
        add("instructions", json!(self.instructions.name()));
        add("failure", json!(self.failure));
        add("edges", json!(self.edges));
        // Numbers that are not finite become null.
        let mut number = |name: &str, value: f64| add(name, json!(value));
        number("points", self.points);
        number("directed_bonds", self.bonds);
        number("ranks", self.ranks as f64);
        number("threads", self.threads as f64);
        number("cores", self.cores);
        number("steps", self.steps);
        number("warm_up_steps", self.warm_up);
        number("updates_per_second", self.updates());
        number("updates_per_second_and_core", self.updates() / self.cores);
        number("set_up_seconds", self.set_up);
        for Phase {
            name,
            mean,
            slowest,
        } in &self.phases
        {
            number(&format!("{name}_seconds"), *mean);
            number(&format!("{name}_seconds_slowest"), *slowest);
        }
        if let (Some(touching), Some(ratio)) = (self.touching, self.contact_over_bonds()) {
            number("touching_share", touching);
            number("contact_over_bonds", ratio);
        }
        for (name, all) in &self.memory {
            number(&format!("memory_{name}_bytes"), *all);
        }
        number("halo_bytes_per_step", self.halo_bytes);
        number("halo_seconds_per_step", self.messages_time);
        number("halo_seconds_per_step_alone", self.messages_time_alone);
        number("halo_hidden", self.hidden());
        number("halo_messages_per_step", self.messages);
        number("halo_messages_per_step_most", self.most_messages);
        number("ghosts", self.ghosts);
        number("ghosts_most", self.most_ghosts);
        if let Some(limits) = &self.limits {
            number("triad_bytes_per_second", limits.bandwidth);
            number("moved_bytes_per_second", limits.moved);
            number("multiply_add_operations_per_second", limits.arithmetic);
            number("operations_per_second", limits.done);
        }
        Value::Object(entries).to_string()
    }
}
