//! Progress display: a bar on a terminal, otherwise (for example under mpirun and Slurm) periodic lines.

use crate::cli::errln;
use std::io::IsTerminal;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

use super::format::si;

/// Time from the start to the first line, s.
const FIRST_LINE: f64 = 5.0;
/// Time from the start to the second line, s. The intervals between later lines are at least as long.
const MINUTE: f64 = 60.0;
/// Minimum interval between lines after the second line, as a fraction of the elapsed time. A run of one day
/// prints about sixty lines.
const RELATIVE_INTERVAL: f64 = 0.1;

/// Width of the bar in characters.
const WIDTH: usize = 30;

/// A progress display.
pub enum Progress {
    /// No display.
    Silent,
    /// A progress bar.
    Bar(ProgressBar),
    /// Periodic lines.
    Lines {
        /// Word for a step in the printed lines, such as `step` or `frame`.
        noun: &'static str,
        /// Time at which the display started.
        start: Instant,
        /// Number of steps that were complete at the start.
        first: u64,
        /// Number of the last step.
        last: u64,
        /// Time from the start to the next line, s.
        due: f64,
    },
}

impl Progress {
    /// Create a display for the steps `first` + 1 to `last`. If `shown` is false, there is no display.
    /// `noun` is the word for a step in the display.
    pub fn new(shown: bool, noun: &'static str, first: u64, last: u64) -> Self {
        if !shown {
            return Self::Silent;
        }
        if !std::io::stderr().is_terminal() {
            return Self::Lines {
                noun,
                start: Instant::now(),
                first,
                last,
                due: FIRST_LINE,
            };
        }
        let bar = ProgressBar::new(last).with_position(first);
        bar.reset_eta();
        let template = format!(
            "{{bar:30}} {{percent:>3}} %  {noun} {{pos}}/{{len}}  {{msg}}  {{per_sec}}  eta {{eta}}"
        );
        let style = ProgressStyle::with_template(&template)
            .unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.set_style(style.progress_chars("█▉▊▋▌▍▎▏ "));
        Self::Bar(bar)
    }

    /// Update the display after step number `step`, which ends at `time` (s). `steps` is the current estimate
    /// of the number of the last step.
    pub fn update(&mut self, step: u64, steps: u64, time: f64) {
        match self {
            Self::Silent => {}
            Self::Bar(bar) => {
                bar.set_length(steps);
                bar.set_position(step);
                bar.set_message(format!("t = {}", si(time, "s")));
            }
            Self::Lines {
                noun,
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
                    "[{}{}] {:>3} %  {noun} {step}/{last}  t = {}  eta {left:.0} s",
                    "█".repeat(full),
                    "·".repeat(WIDTH - full),
                    100 * step / *last,
                    si(time, "s"),
                );
            }
        }
    }

    /// Print other output without disturbing the bar.
    pub fn aside(&self, print: impl FnOnce()) {
        match self {
            Self::Bar(bar) => bar.suspend(print),
            Self::Silent | Self::Lines { .. } => print(),
        }
    }

    /// End the display. `complete` is true if all steps are done.
    pub fn finish(&self, complete: bool) {
        match self {
            Self::Bar(bar) if complete => bar.finish(),
            Self::Bar(bar) => bar.abandon(),
            Self::Silent | Self::Lines { .. } => {}
        }
    }
}

/// Return the time at which the next progress line is printed, after a line at the time `elapsed`. Both times
/// are in seconds, counted from the creation of the display.
fn next_line(elapsed: f64) -> f64 {
    if elapsed < MINUTE {
        MINUTE
    } else {
        elapsed + MINUTE.max(RELATIVE_INTERVAL * elapsed)
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
