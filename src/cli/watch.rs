//! When a run must write a checkpoint or stop: signals, the clock, the deck.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use fissure::comm::Communicator;
use fissure::deck::plan::CheckpointRule;
use fissure::error::{Error, Result};
use fissure::solver::schedule::Schedule;
use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1, SIGUSR2};

/// Exit code of a run that stopped before its end and can be continued with --restart (that of
/// sysexits.h for "try again").
pub const STOPPED: u8 = 75;

/// Exit code after a second signal.
const ENDED_AT_ONCE: i32 = 130;

/// The same signal may come twice, from the launcher and from the batch system; only one that comes this
/// much later is a second one.
const ONE_SIGNAL: Duration = Duration::from_secs(1);

/// The ranks look at signals and clocks together, at most this many steps and about this long apart.
const MOST_STEPS: u64 = 10;
const SECONDS_APART: f64 = 0.2;

/// Part of a wall-clock limit that is kept for the last checkpoint, at least and at most so long.
const RESERVED_SHARE: f64 = 0.05;
const LEAST_RESERVE: f64 = 0.5;
const MOST_RESERVE: f64 = 60.0;

/// What the ranks have agreed to do after the present step.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Decision {
    /// Write a checkpoint.
    pub checkpoint: bool,
    /// Leave, and why.
    pub stop: Option<Reason>,
}

/// Why a run stops before its end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// A signal came on some rank.
    Signal,
    /// The wall-clock limit is near.
    WallTime,
}

/// The signals of this process.
pub struct Signals {
    stop: Arc<AtomicBool>,
    request: Arc<AtomicBool>,
}

impl Signals {
    /// Starts to listen, in a thread of its own.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn listen() -> Result<Self> {
        let signals = Self {
            stop: Arc::default(),
            request: Arc::default(),
        };
        let (stop, request) = (Arc::clone(&signals.stop), Arc::clone(&signals.request));
        let refused = |error| Error::run(format!("cannot listen to signals: {error}"));
        let mut queue = signal_hook::iterator::Signals::new([SIGTERM, SIGINT, SIGUSR1, SIGUSR2])
            .map_err(refused)?;
        std::thread::Builder::new()
            .name("signals".to_owned())
            .spawn(move || {
                let mut first: Option<Instant> = None;
                for signal in queue.forever() {
                    match (signal, first) {
                        (SIGUSR2, _) => request.store(true, Ordering::Relaxed),
                        (_, None) => {
                            stop.store(true, Ordering::Relaxed);
                            first = Some(Instant::now());
                        }
                        (_, Some(first)) if first.elapsed() > ONE_SIGNAL => {
                            signal_hook::low_level::exit(ENDED_AT_ONCE);
                        }
                        _ => {}
                    }
                }
            })
            .map_err(refused)?;
        Ok(signals)
    }
}

/// The signals and clocks that decide what a rank wants.
pub struct Watch<'a> {
    signals: &'a Signals,
    rule: CheckpointRule,
    schedule: Option<Schedule>,
    limit: Option<(Instant, f64)>,
    last_checkpoint: Instant,
    cost: Duration,
    last_look: (Instant, u64),
    next_look: u64,
}

impl<'a> Watch<'a> {
    /// For a run of `steps`: length (s), number made, number of the last. `limit` is a wall-clock time
    /// and when it began; without it that of the Slurm job counts.
    pub fn new(
        signals: &'a Signals,
        rule: CheckpointRule,
        limit: Option<(Instant, Duration)>,
        (step, number, last): (f64, u64, u64),
    ) -> Self {
        let schedule = match rule {
            CheckpointRule::WallClock(_) => None,
            CheckpointRule::Simulation(interval) => Some(Schedule::new(interval, step, last)),
        };
        let of_job = || Some((Instant::now(), left_to_slurm()?));
        Self {
            signals,
            rule,
            schedule,
            limit: limit
                .or_else(of_job)
                .map(|(start, limit)| (start, limit.as_secs_f64())),
            last_checkpoint: Instant::now(),
            cost: Duration::ZERO,
            last_look: (Instant::now(), number),
            next_look: number + 1,
        }
    }

    /// Whether the ranks look together after this step.
    pub fn is_due(&self, number: u64) -> bool {
        number >= self.next_look || self.is_scheduled(number)
    }

    fn is_scheduled(&self, number: u64) -> bool {
        self.schedule
            .is_some_and(|schedule| schedule.is_due(number))
    }

    /// What to do after this step: the same on all ranks. Collective.
    pub fn look(&mut self, comm: &dyn Communicator, number: u64) -> Decision {
        let (then, before) = self.last_look;
        let per_step = then.elapsed().as_secs_f64() / (number - before).max(1) as f64;
        let due = match self.rule {
            CheckpointRule::WallClock(seconds) => {
                self.last_checkpoint.elapsed().as_secs_f64() >= seconds
            }
            CheckpointRule::Simulation(_) => false,
        };
        let late = self.limit.is_some_and(|(start, limit)| {
            let reserve = (RESERVED_SHARE * limit).clamp(LEAST_RESERVE, MOST_RESERVE);
            start.elapsed().as_secs_f64() + reserve + 2.0 * self.cost.as_secs_f64() >= limit
        });
        let flag = |set: bool| f64::from(u8::from(set));
        let mut votes = [
            flag(self.signals.stop.load(Ordering::Relaxed)),
            flag(late),
            flag(due || self.signals.request.swap(false, Ordering::Relaxed)),
            per_step,
        ];
        comm.max(&mut votes);
        let steps = (SECONDS_APART / votes[3].max(1e-9)) as u64;
        self.next_look = number + steps.clamp(1, MOST_STEPS);
        self.last_look = (Instant::now(), number);
        Decision {
            checkpoint: votes[2] > 0.0 || self.is_scheduled(number),
            stop: match (votes[0] > 0.0, votes[1] > 0.0) {
                (true, _) => Some(Reason::Signal),
                (_, true) => Some(Reason::WallTime),
                _ => None,
            },
        }
    }

    /// Takes note that a checkpoint has been written, and how long that took.
    pub fn wrote_checkpoint(&mut self, cost: Duration) {
        self.last_checkpoint = Instant::now();
        self.cost = self.cost.max(cost);
    }
}

/// The time until the end of the Slurm job that this process is part of.
fn left_to_slurm() -> Option<Duration> {
    let end: u64 = std::env::var("SLURM_JOB_END_TIME").ok()?.parse().ok()?;
    let now = SystemTime::now().duration_since(UNIX_EPOCH).ok()?;
    Some(Duration::from_secs(end).saturating_sub(now))
}

/// Reads `HH:MM`, `HH:MM:SS` or, with days, `D-HH:MM:SS`.
///
/// # Errors
/// With what would be right.
pub fn wall_time(text: &str) -> std::result::Result<Duration, String> {
    let wrong = || format!("`{text}` must be HH:MM, HH:MM:SS or D-HH:MM:SS");
    let (days, clock) = match text.split_once('-') {
        Some((days, clock)) => (days.parse::<u64>().map_err(|_| wrong())?, clock),
        None => (0, text),
    };
    let parts: Vec<u64> = clock
        .split(':')
        .map(|part| part.parse().map_err(|_| wrong()))
        .collect::<std::result::Result<_, _>>()?;
    let [hours, minutes, seconds] = match parts[..] {
        [hours, minutes] => [hours, minutes, 0],
        [hours, minutes, seconds] => [hours, minutes, seconds],
        _ => return Err(wrong()),
    };
    if minutes > 59 || seconds > 59 || days > 10_000 || hours > 1_000_000 {
        return Err(wrong());
    }
    Ok(Duration::from_secs(
        ((days * 24 + hours) * 60 + minutes) * 60 + seconds,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wall_times_as_slurm_writes_them() {
        let seconds = |text| wall_time(text).map(|time| time.as_secs());
        assert_eq!(seconds("23:50"), Ok(85_800));
        assert_eq!(seconds("0:00:07"), Ok(7));
        assert_eq!(seconds("2-00:00:01"), Ok(172_801));
        for wrong in ["90", "1:60", "1:2:3:4", "x:10", "-1:10"] {
            assert!(seconds(wrong).is_err(), "{wrong}");
        }
    }
}
