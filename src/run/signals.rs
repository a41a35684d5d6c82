//! Signals that stop a run or ask it for a checkpoint.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crate::error::{Error, Result};
use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1, SIGUSR2};

/// Exit code after a second signal.
const ENDED_AT_ONCE: i32 = 130;

/// The same signal may come twice, from the launcher and from the batch system; only one that comes this
/// much later is a second one.
const ONE_SIGNAL: Duration = Duration::from_secs(1);

/// The signals of this process: SIGTERM, SIGINT and SIGUSR1 stop a run after its present step, a second
/// one ends the process at once; SIGUSR2 asks for a checkpoint.
#[derive(Clone)]
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

    /// Whether the run shall stop.
    pub(super) fn stop(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Whether a checkpoint has been asked for since the last time.
    pub(super) fn take_request(&self) -> bool {
        self.request.swap(false, Ordering::Relaxed)
    }
}
