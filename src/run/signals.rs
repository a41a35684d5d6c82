//! Signals that stop a run or request a checkpoint.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::error::{Error, Result};
use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1, SIGUSR2};

/// Exit code of an immediate exit after a second signal.
const IMMEDIATE_EXIT: i32 = 130;

/// Receiver of the signals of this process.
///
/// - SIGTERM, SIGINT, SIGUSR1: write a checkpoint and stop, within about ten steps. If another of these
///   signals arrives more than 1 s later, the process ends at once.
/// - SIGUSR2: write a checkpoint.
#[derive(Clone)]
pub struct Signals {
    stop: Arc<AtomicBool>,
    request: Arc<AtomicBool>,
}

impl Signals {
    /// Time after the first stop signal during which further stop signals are ignored. They are ignored
    /// because the launcher and the batch system may both send a stop signal.
    pub const SAME_SIGNAL: Duration = Duration::from_secs(1);

    /// Start a thread that receives the signals.
    ///
    /// # Errors
    /// If the signal handlers cannot be installed, or the thread cannot be started.
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
                        (_, Some(first)) if first.elapsed() > Self::SAME_SIGNAL => {
                            signal_hook::low_level::exit(IMMEDIATE_EXIT);
                        }
                        _ => {}
                    }
                }
            })
            .map_err(refused)?;
        Ok(signals)
    }

    /// Return signals of which SIGUSR2 has arrived.
    #[cfg(test)]
    pub(super) fn requested() -> Self {
        Self {
            stop: Arc::default(),
            request: Arc::new(AtomicBool::new(true)),
        }
    }

    /// Test whether a stop was requested.
    pub(super) fn stop(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Test whether a checkpoint was requested since the last call.
    pub(super) fn take_request(&self) -> bool {
        self.request.swap(false, Ordering::Relaxed)
    }
}
