//! How far a run has come: a moving bar on a terminal, a line every tenth of the way elsewhere
//! (mpirun and Slurm pass output through pipes and files).

use crate::cli::tell;
use std::io::IsTerminal;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};

use super::format::si;

/// Lines printed over a run where there is no terminal.
const LINES: u64 = 10;

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
        /// Lines printed.
        printed: u64,
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
                printed: first * LINES / last,
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

    /// Shows that a step, ending at `time` (s), has been made.
    pub fn show(&mut self, step: u64, time: f64) {
        match self {
            Self::Silent => {}
            Self::Bar(bar) => {
                bar.set_position(step);
                bar.set_message(format!("t = {}", si(time, "s")));
            }
            Self::Lines {
                start,
                first,
                last,
                printed,
            } => {
                if step * LINES / *last > *printed {
                    *printed = step * LINES / *last;
                    let full = (step as usize * WIDTH) / *last as usize;
                    let left = start
                        .elapsed()
                        .mul_f64((*last - step) as f64 / (step - *first) as f64);
                    tell!(
                        "[{}{}] {:>3} %  step {step}/{last}  t = {}  eta {:.0} s",
                        "█".repeat(full),
                        "·".repeat(WIDTH - full),
                        100 * step / *last,
                        si(time, "s"),
                        left.as_secs_f64(),
                    );
                }
            }
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
