//! Decisions to write a checkpoint or to stop the run. They depend on signals, the wall-clock time, the deck
//! and the observer.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use crate::comm::Communicator;
use crate::problem::CheckpointRule;
use crate::solver::Stepper;
use crate::solver::motion::Clock;
use crate::solver::observers::Schedule;

use super::signals::Signals;

/// Maximum number of iterations of the time loop between two collective decisions. An iteration of the time
/// loop makes one explicit step, or one iteration of a load step.
const MAX_ITERATIONS: u64 = 10;
/// Target interval of wall-clock time between two collective decisions, s.
const INTERVAL: f64 = 0.2;

/// Fraction of the wall-clock limit reserved for the last checkpoint.
const RESERVED_FRACTION: f64 = 0.05;
/// Smallest time reserved for the last checkpoint, s.
const MIN_RESERVE: f64 = 0.5;
/// Largest time reserved for the last checkpoint, s.
const MAX_RESERVE: f64 = 60.0;

/// Common decision of all ranks after an iteration of the time loop.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Decision {
    /// Whether a checkpoint is written.
    pub checkpoint: bool,
    /// Reason to stop; `None` to continue.
    pub stop: Option<Reason>,
    /// Whether the observer of a rank has made an invalid request, or the observers have set different load
    /// factors.
    pub has_wrong_request: bool,
}

/// Requests of the observer of this rank.
#[derive(Debug, Clone, Copy)]
pub struct OwnRequests {
    stop: bool,
    is_wrong: bool,
    /// Fingerprint of all load factors that this rank's observer has requested.
    factors: f64,
}

/// Combined requests of the observers of all ranks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CombinedRequests {
    /// Whether an observer has requested a stop.
    pub stop: bool,
    /// Whether a request is invalid, or the load factors differ between ranks.
    pub are_wrong: bool,
}

impl OwnRequests {
    /// Collect the requests that this rank's observer has made so far.
    pub fn of<const D: usize>(stepper: &Stepper<'_, D>) -> Self {
        Self {
            stop: stepper.is_stop_requested(),
            is_wrong: stepper.wrong_request().is_some(),
            factors: stepper.load_factors().fingerprint(),
        }
    }

    /// Encode the requests, so that [`CombinedRequests::of_maxima`] can decode the element-wise maximum over
    /// all ranks.
    fn entries(self) -> [f64; 4] {
        let flag = |set: bool| f64::from(u8::from(set));
        [
            flag(self.stop),
            flag(self.is_wrong),
            self.factors,
            -self.factors,
        ]
    }

    /// Combine the requests of all ranks. Collective.
    pub fn agree(self, comm: &dyn Communicator) -> CombinedRequests {
        let mut entries = self.entries();
        comm.max(&mut entries);
        CombinedRequests::of_maxima(entries)
    }
}

impl CombinedRequests {
    fn of_maxima([stop, is_wrong, largest, least]: [f64; 4]) -> Self {
        Self {
            stop: stop > 0.0,
            are_wrong: is_wrong > 0.0 || largest != -least,
        }
    }
}

/// Reason of a stop before the end.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reason {
    /// A rank received a signal.
    Signal,
    /// The wall-clock limit is near.
    WallTime,
    /// The observer of a rank has requested the stop.
    Observer,
}

/// Signals, wall clock and schedule on a rank, for the decisions on checkpoints and stops.
pub struct Watch<'a> {
    signals: Option<&'a Signals>,
    rule: CheckpointRule,
    /// Schedule of checkpoints by steps or simulated time; `None` for checkpoints by wall-clock time.
    schedule: Option<Schedule>,
    /// Start and duration (s) of the wall-clock limit.
    limit: Option<(Instant, f64)>,
    last_checkpoint: Instant,
    /// Longest time that a checkpoint has taken.
    cost: Duration,
    /// Number of iterations of the time loop.
    iterations: u64,
    /// Time and iteration of the last decision on a checkpoint or a stop.
    last_decision: (Instant, u64),
    /// Iteration of the next decision.
    next_decision: u64,
}

impl<'a> Watch<'a> {
    /// Create the watch. `limit` is the start and the duration of a wall-clock limit. If `limit` is `None`
    /// inside a Slurm job, the time limit of the job applies.
    pub fn new(
        signals: Option<&'a Signals>,
        rule: CheckpointRule,
        limit: Option<(Instant, Duration)>,
    ) -> Self {
        let schedule = match rule {
            CheckpointRule::WallClock(_) => None,
            CheckpointRule::Simulation(interval) => Some(Schedule::every(interval)),
        };
        let of_job = || Some((Instant::now(), slurm_time_left()?));
        Self {
            signals,
            rule,
            schedule,
            limit: limit
                .or_else(of_job)
                .map(|(start, limit)| (start, limit.as_secs_f64())),
            last_checkpoint: Instant::now(),
            cost: Duration::ZERO,
            iterations: 0,
            last_decision: (Instant::now(), 0),
            next_decision: 1,
        }
    }

    /// Count an iteration. Return whether a decision is due. `step` is the clock after the step that the
    /// iteration has completed; `None` if it has completed no step.
    pub fn end_iteration(&mut self, step: Option<&Clock>) -> bool {
        self.iterations += 1;
        self.iterations >= self.next_decision || self.is_scheduled(step)
    }

    fn is_scheduled(&self, step: Option<&Clock>) -> bool {
        let due = |clock| {
            self.schedule
                .as_ref()
                .is_some_and(|schedule| schedule.is_due(clock))
        };
        step.is_some_and(due)
    }

    /// Decide whether to write a checkpoint after this iteration, and whether to stop the run. `observer`
    /// contains the requests of this rank's observer. The decision is the same on all ranks. Collective.
    pub fn decide(
        &mut self,
        comm: &dyn Communicator,
        step: Option<&Clock>,
        observer: OwnRequests,
    ) -> Decision {
        let (then, before) = self.last_decision;
        let per_iteration = then.elapsed().as_secs_f64() / (self.iterations - before).max(1) as f64;
        let due = match self.rule {
            CheckpointRule::WallClock(seconds) => {
                self.last_checkpoint.elapsed().as_secs_f64() >= seconds
            }
            CheckpointRule::Simulation(_) => false,
        };
        let late = self.limit.is_some_and(|(start, limit)| {
            let reserve = (RESERVED_FRACTION * limit).clamp(MIN_RESERVE, MAX_RESERVE);
            start.elapsed().as_secs_f64() + reserve + 2.0 * self.cost.as_secs_f64() >= limit
        });
        // Clear the request also if a checkpoint is due anyway, because this checkpoint fulfils the request.
        let is_requested = self.signals.is_some_and(Signals::take_request);
        let flag = |set: bool| f64::from(u8::from(set));
        let requests = observer.entries();
        let mut votes = [
            flag(self.signals.is_some_and(Signals::stop)),
            flag(late),
            flag(is_requested || due),
            per_iteration,
            requests[0],
            requests[1],
            requests[2],
            requests[3],
        ];
        comm.max(&mut votes);
        let [.., stop, is_wrong, largest, least] = votes;
        let requests = CombinedRequests::of_maxima([stop, is_wrong, largest, least]);
        let iterations = (INTERVAL / votes[3].max(1e-9)) as u64;
        self.next_decision = self.iterations + iterations.clamp(1, MAX_ITERATIONS);
        self.last_decision = (Instant::now(), self.iterations);
        Decision {
            checkpoint: votes[2] > 0.0 || self.is_scheduled(step),
            stop: match (votes[0] > 0.0, votes[1] > 0.0, requests.stop) {
                (true, _, _) => Some(Reason::Signal),
                (_, true, _) => Some(Reason::WallTime),
                (_, _, true) => Some(Reason::Observer),
                _ => None,
            },
            has_wrong_request: requests.are_wrong,
        }
    }

    /// Record a written checkpoint and its duration.
    pub fn record_checkpoint(&mut self, cost: Duration) {
        self.last_checkpoint = Instant::now();
        self.cost = self.cost.max(cost);
    }
}

/// Return the time left in the Slurm job of this process; `None` if the environment variable
/// `SLURM_JOB_END_TIME` is missing (outside a job) or is not a time in seconds.
fn slurm_time_left() -> Option<Duration> {
    let end: u64 = std::env::var("SLURM_JOB_END_TIME").ok()?.parse().ok()?;
    let now = SystemTime::now().duration_since(UNIX_EPOCH).ok()?;
    Some(Duration::from_secs(end).saturating_sub(now))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;

    #[test]
    fn a_request_when_a_checkpoint_is_due_causes_no_second_checkpoint() {
        let (comm, signals) = (threads::alone(), Signals::requested());
        let mut watch = Watch::new(Some(&signals), CheckpointRule::WallClock(0.0), None);
        let observer = OwnRequests {
            stop: false,
            is_wrong: false,
            factors: 0.0,
        };
        assert!(watch.decide(&comm, None, observer).checkpoint);
        watch.rule = CheckpointRule::WallClock(f64::INFINITY);
        assert!(!watch.decide(&comm, None, observer).checkpoint);
    }
}
