//! When a run must write a checkpoint or stop: signals, the clock, the deck.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::comm::Communicator;
use crate::problem::CheckpointRule;
use crate::solver::motion::Clock;
use crate::solver::observers::Schedule;

use super::signals::Signals;

/// The ranks look at signals and clocks together, at most this many turns of the time loop (steps, or
/// iterations of a load step) and about this long apart.
const MOST_TURNS: u64 = 10;
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

/// The signals and clocks that decide what a rank wants.
pub struct Watch<'a> {
    signals: Option<&'a Signals>,
    rule: CheckpointRule,
    schedule: Option<Schedule>,
    limit: Option<(Instant, f64)>,
    last_checkpoint: Instant,
    cost: Duration,
    /// Turns so far.
    turns: u64,
    last_look: (Instant, u64),
    next_look: u64,
}

impl<'a> Watch<'a> {
    /// For the rest of a run. `limit` is a wall-clock time and when it began; without it that of the
    /// Slurm job counts.
    pub fn new(
        signals: Option<&'a Signals>,
        rule: CheckpointRule,
        limit: Option<(Instant, Duration)>,
    ) -> Self {
        let schedule = match rule {
            CheckpointRule::WallClock(_) => None,
            CheckpointRule::Simulation(interval) => Some(Schedule(interval)),
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
            turns: 0,
            last_look: (Instant::now(), 0),
            next_look: 1,
        }
    }

    /// Counts a turn; whether the ranks look together after it. `step` is the clock if the turn ended a step.
    pub fn end_turn(&mut self, step: Option<&Clock>) -> bool {
        self.turns += 1;
        self.turns >= self.next_look || self.is_scheduled(step)
    }

    fn is_scheduled(&self, step: Option<&Clock>) -> bool {
        let due = |clock| self.schedule.is_some_and(|schedule| schedule.is_due(clock));
        step.is_some_and(due)
    }

    /// What to do after this turn, which may have ended a step: the same on all ranks. Collective.
    pub fn look(&mut self, comm: &dyn Communicator, step: Option<&Clock>) -> Decision {
        let (then, before) = self.last_look;
        let per_turn = then.elapsed().as_secs_f64() / (self.turns - before).max(1) as f64;
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
            flag(self.signals.is_some_and(Signals::stop)),
            flag(late),
            flag(due || self.signals.is_some_and(Signals::take_request)),
            per_turn,
        ];
        comm.max(&mut votes);
        let turns = (SECONDS_APART / votes[3].max(1e-9)) as u64;
        self.next_look = self.turns + turns.clamp(1, MOST_TURNS);
        self.last_look = (Instant::now(), self.turns);
        Decision {
            checkpoint: votes[2] > 0.0 || self.is_scheduled(step),
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
