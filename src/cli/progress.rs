//! How far a run has come: a moving bar on a terminal, a line now and then elsewhere (mpirun and Slurm
//! pass output through pipes and files).

use crate::cli::errln;
use std::io::IsTerminal;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

use super::format::si;

/// The first line comes after so many seconds, the others a minute apart and, in long runs, a tenth of
/// the time that has gone by: some sixty lines a day.
const FIRST_LINE: f64 = 5.0;
const MINUTE: f64 = 60.0;
const SHARE: f64 = 0.1;

/// Width of the bar in characters.
const WIDTH: usize = 30;

/// A progress display.
pub enum Progress {
    /// Nothing is shown.
    Silent,
    /// A moving bar.
    Bar(ProgressBar),
    /// A line now and then.
    Lines {
        /// When the display began.
        start: Instant,
        /// Number of the step that it began after.
        first: u64,
        /// Number of the last step.
        last: u64,
        /// When the next line is due, s.
        due: f64,
    },
}

impl Progress {
    /// A display for a run from step `first` to step `last`.
    pub fn new(shown: bool, first: u64, last: u64) -> Self {
        if !shown {
            return Self::Silent;
        }
        if !std::io::stderr().is_terminal() {
            return Self::Lines {
                start: Instant::now(),
                first,
                last,
                due: FIRST_LINE,
            };
        }
        let bar = ProgressBar::new(last).with_position(first);
        bar.reset_eta();
        let template = "{bar:30} {percent:>3} %  step {pos}/{len}  {msg}  {per_sec}  eta {eta}";
        let style =
            ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.set_style(style.progress_chars("█▉▊▋▌▍▎▏ "));
        Self::Bar(bar)
    }

    /// Shows that a step, ending at `time` (s), has been made, of so many as now seems.
    pub fn show(&mut self, step: u64, steps: u64, time: f64) {
        match self {
            Self::Silent => {}
            Self::Bar(bar) => {
                bar.set_length(steps);
                bar.set_position(step);
                bar.set_message(format!("t = {}", si(time, "s")));
            }
            Self::Lines {
                start,
                first,
                last,
                due,
            } => {
                *last = steps;
                let elapsed = start.elapsed().as_secs_f64();
                if elapsed < *due || step >= *last {
                    return;
                }
                *due = next_line(elapsed);
                let full = (step as usize * WIDTH) / *last as usize;
                let left = elapsed * (*last - step) as f64 / (step - *first).max(1) as f64;
                errln!(
                    "[{}{}] {:>3} %  step {step}/{last}  t = {}  eta {left:.0} s",
                    "█".repeat(full),
                    "·".repeat(WIDTH - full),
                    100 * step / *last,
                    si(time, "s"),
                );
            }
        }
    }

    /// Prints something else, clear of the bar.
    pub fn aside(&self, print: impl FnOnce()) {
        match self {
            Self::Bar(bar) => bar.suspend(print),
            Self::Silent | Self::Lines { .. } => print(),
        }
    }

    /// Ends the display, of a run that came to its end or not.
    pub fn finish(&self, complete: bool) {
        match self {
            Self::Bar(bar) if complete => bar.finish(),
            Self::Bar(bar) => bar.abandon(),
            Self::Silent | Self::Lines { .. } => {}
        }
    }
}

/// When the line after one that is printed now is due, s.
fn next_line(elapsed: f64) -> f64 {
    if elapsed < MINUTE {
        MINUTE
    } else {
        elapsed + MINUTE.max(SHARE * elapsed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_a_minute_apart_and_sparser_in_long_runs() {
        let due: Vec<f64> = std::iter::successors(Some(FIRST_LINE), |due| Some(next_line(*due)))
            .take_while(|due| *due < 86_400.0)
            .collect();
        assert_eq!(due[..4], [5.0, 60.0, 120.0, 180.0]);
        assert!((50..80).contains(&due.len()), "{} lines a day", due.len());
    }
}
