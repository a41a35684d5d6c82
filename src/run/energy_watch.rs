//! Checks of the energy balance, which detect unstable time steps and lost energy.
//!
//! The energy gain is the change of [`Energies::error`](crate::solver::observers::Energies::error) since the
//! last load step. In a run without an earlier load step, it is the change since the start of the run. If
//! breaking bonds have added energy, the fracture energy is negative. The energy gain does not include a
//! negative fracture energy. The checks compare the energy gain with the energy input, see
//! `EnergyWatch::input`.

use crate::comm::Communicator;
use crate::comm::ExactSum;
use crate::comm::sum::reduce;
use crate::error::{Error, Result};
use crate::problem::Problem;
use crate::solver::Simulation;
use crate::solver::motion::Clock;
use crate::solver::observers::HistoryRow;

/// Ratio of energy gain to energy input above which a warning is printed. If the time step is close to the
/// stable step, the energy of the shortest waves, evaluated at full steps, oscillates by several times its
/// mean. Smaller gains therefore do not prove instability.
const WARNING_GAIN: f64 = 1.0;

/// Ratio of energy gain to energy input. The run ends with an error if two consecutive rows of the history,
/// or the last row of the run, exceed this ratio.
const FATAL_GAIN: f64 = 100.0;

/// Ratio of energy gain to energy input. The run ends with an error as soon as one row of the history exceeds
/// this ratio.
const CERTAIN_GAIN: f64 = 1e9;

/// Largest energy that breaking bonds can add without a warning, as a fraction of the energy input.
const MAX_ADDED_FRACTION: f64 = 0.01;

/// If the error of the energy balance at the end of a run exceeds this fraction of the largest energy, a
/// warning is printed. In the explicit runs of `inputs/`, this error is below 0.01, also on coarse grids.
const MAX_FINAL_ERROR: f64 = 0.2;

/// Strain below which strain energy may be round-off.
const ROUNDOFF_STRAIN: f64 = 1e-9;

/// Kinds of steps of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StepKinds {
    /// Time steps only.
    Time,
    /// Load steps only.
    Load,
    /// Time steps and load steps, in different stages.
    Both,
}

impl StepKinds {
    /// Return the kinds of steps of a problem.
    pub fn of(problem: &Problem) -> Self {
        let stages = problem.all_stages();
        let static_stages = stages.iter().filter(|stage| stage.time.is_quasi_static());
        match static_stages.count() {
            0 => Self::Time,
            count if count == stages.len() => Self::Load,
            _ => Self::Both,
        }
    }
}

/// Comparison of the energy of a run with the energy input.
pub struct EnergyWatch {
    /// Upper bound of the round-off of the energy, J.
    floor: f64,
    /// Maximum energy input so far, J. The energy input is |initial energy| + |work of loads and supports| +
    /// [`HistoryRow::step_energy`].
    input: f64,
    /// Energy gain from the start of the run to the latest load step, J; 0 before the first load step.
    gain_of_load_steps: f64,
    /// Whether a warning about an energy gain has been printed.
    warned: bool,
    /// Largest fracture energy in the rows since the last load step, or since the start if there was no load
    /// step, J.
    max_freed: f64,
    /// Whether a warning about energy from breaking bonds has been printed.
    warned_of_breaking: bool,
    /// Largest energy of the rows so far, J.
    largest: f64,
    /// Whether the ratio of energy gain to energy input in the previous row was above [`FATAL_GAIN`].
    suspected: bool,
}

impl EnergyWatch {
    /// Create the watch for a run before its first step. Collective.
    pub fn new<const D: usize>(simulation: &Simulation<'_, D>) -> Self {
        let (problem, model) = (simulation.problem, &simulation.model);
        let comm: &dyn Communicator = simulation.comm;
        let mut stiffness = [ExactSum::ZERO];
        for (volume, block) in model.volume.iter().zip(&model.block) {
            let material = &problem.block(usize::from(*block)).body.material;
            stiffness[0].add(material.elastic.youngs_modulus * volume);
        }
        Self {
            floor: ROUNDOFF_STRAIN * ROUNDOFF_STRAIN * reduce(comm, &mut stiffness)[0],
            input: 0.0,
            gain_of_load_steps: 0.0,
            warned: false,
            max_freed: 0.0,
            warned_of_breaking: false,
            largest: 0.0,
            suspected: false,
        }
    }

    /// Encode the state for a checkpoint. `floor` is not included; [`Self::new`] recomputes it.
    pub fn words(&self) -> [u64; 7] {
        [
            self.input.to_bits(),
            self.gain_of_load_steps.to_bits(),
            u64::from(self.warned),
            self.max_freed.to_bits(),
            u64::from(self.warned_of_breaking),
            self.largest.to_bits(),
            u64::from(self.suspected),
        ]
    }

    /// Restore the state from [`Self::words`].
    pub fn continue_from(&mut self, words: [u64; 7]) {
        let [
            input,
            gain_of_load_steps,
            warned,
            max_freed,
            warned_of_breaking,
            largest,
            suspected,
        ] = words;
        self.input = f64::from_bits(input);
        self.gain_of_load_steps = f64::from_bits(gain_of_load_steps);
        self.warned = warned == 1;
        self.max_freed = f64::from_bits(max_freed);
        self.warned_of_breaking = warned_of_breaking == 1;
        self.largest = f64::from_bits(largest);
        self.suspected = suspected == 1;
    }

    /// Check a row of the history, and return warnings. `simulation` must be at the time of this row.
    /// `is_last` says whether this row is the last of the run. The warnings are the same on all ranks.
    ///
    /// # Errors
    /// If a time step is clearly unstable; [`Self::check`] states the limits.
    pub fn check_row<const D: usize>(
        &mut self,
        row: &HistoryRow,
        simulation: &Simulation<'_, D>,
        is_last: bool,
    ) -> Result<Vec<String>> {
        self.largest = self.largest.max(row.largest_energy());
        if simulation.is_quasi_static() {
            self.note_load_step(row);
            return Ok(Vec::new());
        }
        let (clock, stable) = (&simulation.clock, simulation.scaled_stable_step());
        let growth = self.check(row, clock, stable, is_last)?;
        let of_breaking = self.check_breaking(row, clock);
        Ok(growth.into_iter().chain(of_breaking).collect())
    }

    /// Record the row of a load step. The energy error of a load step does not come from the size of a time
    /// step. This error therefore does not count as an energy gain of later time steps.
    fn note_load_step(&mut self, row: &HistoryRow) {
        self.add_input(row);
        self.gain_of_load_steps = gain_since_start(row);
        self.max_freed = row.energies.fracture;
    }

    fn add_input(&mut self, row: &HistoryRow) {
        let input = row.first_energy.abs() + row.energies.work.abs() + row.step_energy;
        self.input = self.input.max(input);
    }

    /// Check the ratio of energy gain to energy input in the row of a time step. Return a warning at the
    /// first row with a ratio above [`WARNING_GAIN`]. `stable` is the stable step of the present stage, s.
    /// `is_last` says whether this row is the last of the run. The result is the same on all ranks.
    ///
    /// # Errors
    /// If the ratio exceeds one of these limits:
    ///
    /// - [`FATAL_GAIN`] in two consecutive rows or in the last row of the run;
    /// - [`CERTAIN_GAIN`] in one row.
    fn check(
        &mut self,
        row: &HistoryRow,
        clock: &Clock,
        stable: f64,
        is_last: bool,
    ) -> Result<Option<String>> {
        let gain = gain_since_start(row) - self.gain_of_load_steps;
        self.add_input(row);
        let relative_gain = gain / self.input.max(self.floor);
        let text = || {
            format!(
                "step {} (t = {:.6e} s): the energy has grown by {gain:.3e} J beyond the energy input of {:.3e} J \
                 (start, loads, supports)",
                clock.number(),
                clock.time(),
                self.input,
            )
        };
        let steps = || format!("time step {:.3e} s, stable {stable:.3e} s", clock.step());
        let fatal = relative_gain > FATAL_GAIN;
        if relative_gain > CERTAIN_GAIN || (fatal && (self.suspected || is_last)) {
            let message = format!("{}; reduce the time step ({})", text(), steps());
            return Err(Error::run(message));
        }
        self.suspected = fatal;
        if relative_gain <= WARNING_GAIN || self.warned {
            return Ok(None);
        }
        self.warned = true;
        Ok(Some(format!("{} ({})", text(), steps())))
    }

    /// Check the fracture energy in the row of a time step. Return a warning at the first row in which
    /// breaking bonds have added more than [`MAX_ADDED_FRACTION`] of the energy input. Breaking bonds can add
    /// energy, because a family of a correspondence law can store more energy with fewer bonds.
    fn check_breaking(&mut self, row: &HistoryRow, clock: &Clock) -> Option<String> {
        let freed = row.energies.fracture;
        self.max_freed = self.max_freed.max(freed);
        let added = self.max_freed - freed;
        if self.warned_of_breaking || added <= MAX_ADDED_FRACTION * self.input {
            return None;
        }
        self.warned_of_breaking = true;
        Some(format!(
            "t = {:.4e} s: breaking bonds have added {added:.3e} J to the body, {:.0} % of the energy put in. \
             Families of correspondence laws can store more with fewer bonds; compare with a smaller \
             step, a finer grid, or `ordinary`",
            clock.time(),
            100.0 * added / self.input,
        ))
    }

    /// Check the last row of a run. Return a warning if the energy balance does not close, unless the error
    /// is a gain and [`Self::check`] has already reported a gain.
    pub fn check_end(&self, row: &HistoryRow, steps: StepKinds) -> Option<String> {
        let error = row.energies.error;
        let largest = self.largest.max(row.largest_energy()).max(self.floor);
        let is_reported = self.warned && error > 0.0;
        if is_reported || error.abs() <= MAX_FINAL_ERROR * largest {
            return None;
        }
        let (size, percent) = (error.abs(), 100.0 * error.abs() / largest);
        Some(if error > 0.0 {
            let remedy = match steps {
                StepKinds::Time => "half the time step",
                StepKinds::Load => "twice as many load steps",
                StepKinds::Both => "half the time step and twice as many load steps",
            };
            format!(
                "the energy has grown by {size:.3e} J, {percent:.0} % of the largest energy, which no load or support has \
                 put in; repeat with {remedy} and compare"
            )
        } else {
            let lost = format!("{size:.3e} J, {percent:.0} % of the largest energy");
            let causes = "possible causes are loads that act in full in the first load step, loads that end abruptly, \
                          bodies that are stopped, unstable cracks, snap-through, and pieces that turn";
            match steps {
                StepKinds::Time => format!(
                    "the time steps have lost {lost}; repeat with half the time step and compare"
                ),
                StepKinds::Load => {
                    format!("load steps have lost {lost}, in jumps between equilibria; {causes}")
                }
                StepKinds::Both => format!(
                    "the run has lost {lost}. Look at the column `energy_error` to find the stage. If the stage has load \
                     steps, {causes}. If it is explicit, repeat with half the time step and compare"
                ),
            }
        })
    }
}

/// Return the energy gain since the start of the run, J. If breaking bonds have added energy, the fracture
/// energy is negative. A negative fracture energy is left out, because it would hide part of the gain.
fn gain_since_start(row: &HistoryRow) -> f64 {
    row.energies.error - row.energies.fracture.min(0.0)
}

/// Check that the energies in a row of the history are finite. They can overflow while all motions and forces
/// are finite.
///
/// # Errors
/// If an energy is not finite. The error is the same on all ranks.
pub fn check_finite(row: &HistoryRow, clock: &Clock) -> Result<()> {
    // The error of the balance contains all other energies.
    if row.energies.error.is_finite() {
        return Ok(());
    }
    Err(Error::run(format!(
        "step {} (t = {:.6e} s): an energy is not finite; a load, a velocity or a stiffness is too large",
        clock.number(),
        clock.time(),
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::observers::Energies;

    fn row(energies: Energies) -> HistoryRow {
        HistoryRow {
            values: Vec::new(),
            number: 1,
            energies,
            first_energy: 0.0,
            step_energy: 0.0,
            broken: 0,
        }
    }

    fn watch() -> EnergyWatch {
        EnergyWatch {
            floor: 1e-3,
            input: 0.0,
            gain_of_load_steps: 0.0,
            warned: false,
            max_freed: 0.0,
            warned_of_breaking: false,
            largest: 0.0,
            suspected: false,
        }
    }

    #[test]
    fn errors_of_load_steps_are_no_gain_of_time_steps() {
        let after = |error: f64, fracture: f64| {
            row(Energies {
                work: 2.0,
                error,
                fracture,
                ..Energies::default()
            })
        };
        let clock = Clock::new(1.0, 1.0);
        let mut watch = watch();
        // In the load steps, the balance has lost or gained energy, and breaking bonds have added some.
        for (error, fracture) in [(-7.0, 0.0), (7.0, 0.0), (3.0, -5.0)] {
            watch.note_load_step(&after(error, fracture));
            let found = watch.check(&after(error, fracture), &clock, 1.0, true);
            assert_eq!(found.unwrap(), None, "{error} {fracture}");
        }
        let found = watch.check(&after(5.1, -5.0), &clock, 1.0, true).unwrap();
        assert!(found.unwrap().contains("grown by 2.100e0 J"));
    }

    #[test]
    fn a_restart_keeps_the_state_of_the_checks() {
        let row = |error: f64| {
            row(Energies {
                work: 1.0,
                error,
                ..Energies::default()
            })
        };
        let restarted = |before: &EnergyWatch| {
            let mut after = watch();
            after.continue_from(before.words());
            after
        };
        let clock = Clock::new(1.0, 1.0);
        // The energy error of load steps before the restart does not count as an energy gain of later time
        // steps.
        let mut before = watch();
        before.note_load_step(&row(200.0));
        let found = restarted(&before).check(&row(200.5), &clock, 1.0, true);
        assert_eq!(found.unwrap(), None);
        // The first of two rows above the fatal ratio may be before the restart.
        let mut before = watch();
        let warning = before.check(&row(200.0), &clock, 1.0, false).unwrap();
        assert!(warning.is_some());
        let mut after = restarted(&before);
        assert!(after.check(&row(200.0), &clock, 1.0, false).is_err());
        // The energy before the restart counts as input, and a warning is not repeated.
        let mut before = watch();
        before.check(&row(3.0), &clock, 1.0, false).unwrap();
        before.largest = 10.0;
        let mut after = restarted(&before);
        assert_eq!(after.check(&row(3.0), &clock, 1.0, false).unwrap(), None);
        assert_eq!((after.input, after.largest), (1.0, 10.0));
    }

    #[test]
    fn a_balance_that_does_not_close_is_reported() {
        let mut watch = watch();
        let energies = |work: f64, error: f64| Energies {
            work,
            strain: work + error,
            error,
            ..Energies::default()
        };
        let of = |work: f64, error: f64, steps| watch.check_end(&row(energies(work, error)), steps);
        assert_eq!(of(2.0, 0.4, StepKinds::Time), None);
        assert_eq!(of(2.0, -0.4, StepKinds::Load), None);
        // Energies below the floor are round-off.
        assert_eq!(of(1e-4, -1e-4, StepKinds::Load), None);
        for (error, steps, words) in [
            (
                0.8,
                StepKinds::Time,
                "grown by 8.000e-1 J, 29 % of the largest energy",
            ),
            (0.8, StepKinds::Load, "twice as many load steps"),
            (
                -0.8,
                StepKinds::Time,
                "time steps have lost 8.000e-1 J, 40 %",
            ),
            (
                -0.8,
                StepKinds::Load,
                "load steps have lost 8.000e-1 J, 40 %",
            ),
            (-0.8, StepKinds::Both, "the run has lost 8.000e-1 J, 40 %"),
        ] {
            let text = of(2.0, error, steps).unwrap();
            assert!(text.contains(words), "{text}");
        }
        // Energies of contacts and rigid bodies count.
        for of_bodies in [true, false] {
            let mut large = energies(2.0, -0.8);
            *(if of_bodies {
                &mut large.rigid
            } else {
                &mut large.contact
            }) = 10.0;
            assert_eq!(watch.check_end(&row(large), StepKinds::Time), None);
        }
        // The largest energy of the whole run counts, also if the bodies are unloaded at the end.
        watch.largest = 10.0;
        assert_eq!(
            watch.check_end(&row(energies(2.0, 0.8)), StepKinds::Load),
            None
        );
        watch.largest = 0.0;
        watch.warned = true;
        assert_eq!(
            watch.check_end(&row(energies(2.0, 0.8)), StepKinds::Time),
            None
        );
        assert!(
            watch
                .check_end(&row(energies(2.0, -0.8)), StepKinds::Time)
                .is_some()
        );
    }
}
