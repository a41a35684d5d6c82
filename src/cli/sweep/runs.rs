//! The runs of a sweep, each in a separate process.

use std::fs::File;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use fissure::error::{Error, Result};
use fissure::problem::{PointSource, Problem, StepRule};
use signal_hook::consts::{SIGINT, SIGTERM, SIGUSR1, SIGUSR2};
use signal_hook::iterator::Signals;

use super::SweepArguments;

/// File with the text that a run prints.
pub const LOG: &str = "log.txt";

/// File with the deck of a run, with every default written out. Two runs with equal files count as the same
/// run.
const DECK: &str = "deck_in_full.toml";

/// File with the result of a run.
const RESULT: &str = "result.vtkhdf";

/// Marker file in the folder of a complete run.
const COMPLETE: &str = "complete";

/// Files with the checkpoints of a run.
const CHECKPOINTS: [&str; 2] = ["checkpoint_0.h5", "checkpoint_1.h5"];

/// Interval between checks of the processes.
const INTERVAL: Duration = Duration::from_millis(20);

/// Exit code of a stopped run.
const STOPPED: i32 = 75;

/// A combination of values and its folder.
pub struct Run {
    /// Names and values of the combination, for messages.
    pub label: String,
    pub folder: PathBuf,
    pub set: Vec<(String, String)>,
    /// Text of the deck with the values of this combination and with every default written out.
    pub deck: String,
    /// Horizons (m), spacings (m) and time steps of the run, see [`resolution`]. A fixed time step is in s.
    /// An automatic time step is a fraction of the stable step.
    pub resolution: Vec<f64>,
}

/// Return the horizons, spacings and time steps of a run. Runs of a convergence study differ in these
/// numbers.
pub fn resolution(problem: &Problem) -> Vec<f64> {
    let mut found = vec![problem.horizon];
    for body in &problem.bodies {
        found.push(body.horizon);
        if let PointSource::Lattice { spacing, .. } = &body.points {
            found.extend(spacing);
        }
    }
    for stage in problem.all_stages() {
        let (StepRule::Automatic(step) | StepRule::Fixed(step)) = stage.time.step;
        found.push(step);
    }
    found
}

/// State of a process after its end.
pub enum State {
    Complete,
    /// Failure; the text gives the exit code or signal.
    Failed(String),
}

impl Run {
    /// Check that this run may use its folder: the folder holds this run, or it holds neither a run of a
    /// sweep nor a result. With `overwrite`, the folder may hold any run of a sweep.
    ///
    /// # Errors
    /// - If the folder holds a result that does not belong to a sweep.
    /// - If the folder holds another run of a sweep, and `overwrite` is false.
    pub fn check(&self, overwrite: bool) -> Result<()> {
        let path = self.folder.join(DECK);
        match std::fs::read_to_string(&path) {
            Ok(text) if text != self.deck && !overwrite => Err(Error::input(format!(
                "{} has a run of another deck, or of this one before it was changed; --overwrite replaces it, \
                 -o DIR writes elsewhere",
                self.folder.display()
            ))),
            Ok(_) => Ok(()),
            Err(_) if self.folder.join(RESULT).exists() => Err(Error::input(format!(
                "{} has a result that is not of a sweep; -o DIR writes elsewhere",
                self.folder.display()
            ))),
            Err(_) => Ok(()),
        }
    }

    /// Test whether the folder holds this run, complete or not.
    pub fn is_begun(&self) -> bool {
        std::fs::read_to_string(self.folder.join(DECK)).is_ok_and(|text| text == self.deck)
    }

    /// Test whether the folder holds this run and the run is complete.
    pub fn is_complete(&self) -> bool {
        self.is_begun() && self.folder.join(COMPLETE).exists()
    }

    /// Return the first line of the last error message in the log of the run. If the log has no error
    /// message, return the last line that is not blank.
    pub fn last_words(&self) -> String {
        let log = std::fs::read(self.folder.join(LOG)).unwrap_or_default();
        let log = String::from_utf8_lossy(&log);
        // An error message may have several lines; the first line describes the error.
        let error = log.lines().rfind(|line| line.starts_with("error: "));
        let line = error.or_else(|| log.lines().rfind(|line| !line.trim().is_empty()));
        line.unwrap_or("it printed nothing").to_owned()
    }
}

/// The program that executes a run: this executable. With `--launcher`, the given command starts this
/// executable.
pub struct Program<'a> {
    arguments: &'a SweepArguments,
    fissure: PathBuf,
    launcher: Vec<String>,
}

/// The process of a run.
struct Process {
    number: usize,
    child: Child,
    started: Instant,
}

impl<'a> Program<'a> {
    /// Create the program from the path of this executable and the launcher that `arguments` gives.
    ///
    /// # Errors
    /// If the launcher is empty, or the path of this executable is unknown.
    pub fn new(arguments: &'a SweepArguments) -> Result<Self> {
        let words = arguments.launcher.as_deref().map(str::split_whitespace);
        let launcher: Vec<String> = words.into_iter().flatten().map(str::to_owned).collect();
        if arguments.launcher.is_some() && launcher.is_empty() {
            let message = "--launcher: must be words that start a run, such as 'mpirun -n 4'";
            return Err(Error::input(message));
        }
        let fissure = std::env::current_exe()
            .map_err(|error| Error::run(format!("cannot find the program itself: {error}")))?;
        Ok(Self {
            arguments,
            fissure,
            launcher,
        })
    }

    /// Execute the runs with the indices `due`, as many at a time as `--jobs` allows. When a run is complete
    /// or has failed, call `ended` with its index, its state and its run time (s). Return true if a signal or
    /// a time limit stopped a run.
    ///
    /// The first SIGINT, SIGTERM or SIGUSR1 makes all runs write checkpoints and stop. Another of these
    /// signals kills the runs if it arrives more than 1 s after the first. SIGUSR2 makes all runs write
    /// checkpoints and continue.
    ///
    /// # Errors
    /// If signals cannot be received, a run cannot be started, a marker file cannot be created, or `ended`
    /// fails. In these cases, the runs that are still in progress are stopped.
    pub fn run_all(
        &self,
        runs: &[Run],
        due: &[usize],
        mut ended: impl FnMut(usize, State, f64) -> Result<()>,
    ) -> Result<bool> {
        let mut signals = Signals::new([SIGINT, SIGTERM, SIGUSR1, SIGUSR2])
            .map_err(|error| Error::run(format!("cannot listen to signals: {error}")))?;
        let mut waiting = due.iter().copied();
        let mut processes: Vec<Process> = Vec::new();
        let (mut stopped, mut outcome) = (false, Ok(()));
        // Time at which the runs have received a signal to stop.
        let mut asked: Option<Instant> = None;
        loop {
            while !stopped && outcome.is_ok() && processes.len() < usize::from(self.arguments.jobs)
            {
                let Some(number) = waiting.next() else {
                    break;
                };
                match self.start(&runs[number]) {
                    Ok(child) => processes.push(Process {
                        number,
                        child,
                        started: Instant::now(),
                    }),
                    Err(error) => outcome = Err(error),
                }
            }
            if processes.is_empty() {
                break;
            }
            std::thread::sleep(INTERVAL);
            for signal in signals.pending() {
                if signal == SIGUSR2 {
                    kill(&processes, SIGUSR2);
                    continue;
                }
                stopped = true;
                match asked {
                    None => {
                        kill(&processes, SIGUSR1);
                        asked = Some(Instant::now());
                    }
                    Some(first) if first.elapsed() > fissure::run::Signals::SAME_SIGNAL => {
                        kill(&processes, libc::SIGKILL);
                    }
                    Some(_) => {}
                }
            }
            let mut going_on = Vec::new();
            for mut process in processes {
                let status = process.child.try_wait();
                let Ok(Some(status)) = status else {
                    going_on.push(process);
                    continue;
                };
                let run = &runs[process.number];
                let seconds = process.started.elapsed().as_secs_f64();
                let state = if status.success() {
                    let mark = run.folder.join(COMPLETE);
                    let marked =
                        File::create(&mark).map_err(|error| Error::file(&mark, "create", &error));
                    outcome = outcome.and(marked.map(|_| ()));
                    State::Complete
                } else {
                    State::Failed(words(status))
                };
                let is_stop = !status.success()
                    && (stopped || outcome.is_err() || status.code() == Some(STOPPED));
                if is_stop {
                    // A run may stop although this process received no signal, for example at the time limit
                    // of a batch job.
                    stopped |= outcome.is_ok();
                } else if outcome.is_ok() {
                    outcome = ended(process.number, state, seconds);
                }
            }
            processes = going_on;
            if outcome.is_err() && asked.is_none() {
                kill(&processes, SIGUSR1);
                asked = Some(Instant::now());
            }
        }
        outcome.map(|()| stopped)
    }

    /// Start a run. If the folder has a checkpoint of this run, continue from the checkpoint, unless
    /// `--overwrite` is given.
    fn start(&self, run: &Run) -> Result<Child> {
        let folder = &run.folder;
        std::fs::create_dir_all(folder).map_err(|error| Error::file(folder, "create", &error))?;
        let known = folder.join(DECK);
        let has_checkpoint = CHECKPOINTS.iter().any(|name| folder.join(name).exists());
        let begin = if run.is_begun() && has_checkpoint && !self.arguments.overwrite {
            "--restart"
        } else {
            "--overwrite"
        };
        let _ = std::fs::remove_file(folder.join(COMPLETE));
        std::fs::write(&known, &run.deck).map_err(|error| Error::file(&known, "write", &error))?;
        let path = folder.join(LOG);
        let log = File::create(&path).map_err(|error| Error::file(&path, "create", &error))?;
        let errors = log
            .try_clone()
            .map_err(|error| Error::file(&path, "write", &error))?;
        let mut command = match &self.launcher[..] {
            [first, others @ ..] => {
                let mut command = Command::new(first);
                command.args(others).arg(&self.fissure);
                command
            }
            [] => Command::new(&self.fissure),
        };
        command
            .arg("run")
            .arg(&self.arguments.deck)
            .arg("--output")
            .arg(folder);
        for overlay in &self.arguments.with {
            command.arg("--with").arg(overlay);
        }
        for (name, value) in &run.set {
            command.arg("--set").arg(format!("{name}={value}"));
        }
        if let Some(threads) = self.arguments.threads {
            command.args(["--threads", &threads.to_string()]);
        }
        command
            .arg(begin)
            .stdin(Stdio::null())
            .stdout(log)
            .stderr(errors);
        // In a separate process group, a run does not receive the SIGINT of Ctrl-C. Only this process
        // receives SIGINT, and sends SIGUSR1 to the run.
        command.process_group(0);
        // Without a handler, SIGUSR2 would end the run. The run ignores the signal until its own handler
        // replaces this setting.
        // SAFETY: the closure only calls `signal`, which is async-signal-safe.
        unsafe {
            command.pre_exec(|| {
                libc::signal(SIGUSR2, libc::SIG_IGN);
                Ok(())
            });
        }
        command.spawn().map_err(|error| {
            let program = command.get_program().to_string_lossy().into_owned();
            Error::run(format!("cannot start {program}: {error}"))
        })
    }
}

/// Describe the end of a process.
fn words(status: ExitStatus) -> String {
    match status.code() {
        Some(code) => format!("failed with exit code {code}"),
        None => format!("was killed ({status})"),
    }
}

/// Send a signal to all `processes`. This program must not have waited for any of them yet.
fn kill(processes: &[Process], signal: i32) {
    for process in processes {
        // SAFETY: the call only sends a signal. The id belongs to the child: the system does not reuse an id
        // before the child has been waited for.
        unsafe {
            libc::kill(process.child.id() as i32, signal);
        }
    }
}
