//! The runs, each in a process of its own.

use std::fs::File;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use fissure::error::{Error, Result};
use fissure::problem::{PointSource, Problem, StepRule};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

use super::SweepArguments;
use crate::cli::file_error;

/// What a run prints.
pub const LOG: &str = "log.txt";

/// The deck of a run with all its values, to recognise the run.
const DECK: &str = "deck_in_full.toml";

/// The result of a run.
const RESULT: &str = "result.vtkhdf";

/// Present in the folder of a complete run.
const COMPLETE: &str = "complete";

/// Checkpoints of a run.
const CHECKPOINTS: [&str; 2] = ["checkpoint_0.h5", "checkpoint_1.h5"];

/// Time between looks at the processes.
const INTERVAL: Duration = Duration::from_millis(20);

/// Exit code of a stopped run.
const STOPPED: i32 = 75;

/// A combination of values and its folder.
pub struct Run {
    /// Names and values that tell it apart.
    pub label: String,
    pub folder: PathBuf,
    pub set: Vec<(String, String)>,
    /// The deck with all its values.
    pub deck: String,
    /// Horizons and spacings (m) and time steps (s, or fractions of the stable one).
    pub resolution: Vec<f64>,
}

/// The horizons, spacings and time steps of a run, which differ between runs of a convergence study.
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

/// How a run ended.
pub enum State {
    Complete,
    /// With an exit code or a signal, in words.
    Failed(String),
}

impl Run {
    /// Check that the folder is new or of this very run or, with `overwrite`, of any run of a sweep.
    ///
    /// # Errors
    /// If something else is there.
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

    /// Whether this very run has been completed.
    pub fn is_complete(&self) -> bool {
        let same =
            std::fs::read_to_string(self.folder.join(DECK)).is_ok_and(|text| text == self.deck);
        same && self.folder.join(COMPLETE).exists()
    }

    /// The last line that the run printed.
    pub fn last_words(&self) -> String {
        let log = std::fs::read(self.folder.join(LOG)).unwrap_or_default();
        let log = String::from_utf8_lossy(&log);
        // An error may have several lines, of which the first one says what is wrong.
        let error = log.lines().rfind(|line| line.starts_with("error: "));
        let line = error.or_else(|| log.lines().rfind(|line| !line.trim().is_empty()));
        line.unwrap_or("it printed nothing").to_owned()
    }
}

/// How runs are started.
pub struct Program<'a> {
    arguments: &'a SweepArguments,
    fissure: PathBuf,
    launcher: Vec<String>,
}

/// A run that goes on.
struct Process {
    number: usize,
    child: Child,
    started: Instant,
}

impl<'a> Program<'a> {
    /// The program itself, with the launcher of the arguments.
    ///
    /// # Errors
    /// If the launcher is empty, or the system does not say where the program is.
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

    /// Run those of `due`, some at a time, and call `ended` with number, state and time (s) of each that has ended.
    /// Return whether a signal stopped them.
    ///
    /// After a first SIGINT or SIGTERM, all runs are asked to stop, which leaves checkpoints; a second one kills them.
    ///
    /// # Errors
    /// If a run cannot be started, or of `ended`; the runs that go on are stopped then.
    pub fn run_all(
        &self,
        runs: &[Run],
        due: &[usize],
        mut ended: impl FnMut(usize, State, f64) -> Result<()>,
    ) -> Result<bool> {
        let mut signals = Signals::new([SIGINT, SIGTERM])
            .map_err(|error| Error::run(format!("cannot listen to signals: {error}")))?;
        let mut waiting = due.iter().copied();
        let mut processes: Vec<Process> = Vec::new();
        let (mut stopped, mut outcome) = (false, Ok(()));
        // The runs were asked to stop.
        let mut asked = false;
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
            for _ in signals.pending() {
                kill(
                    &processes,
                    if asked { libc::SIGKILL } else { libc::SIGUSR1 },
                );
                (stopped, asked) = (true, true);
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
                        File::create(&mark).map_err(|error| file_error(&mark, "create", &error));
                    outcome = outcome.and(marked.map(|_| ()));
                    State::Complete
                } else {
                    State::Failed(words(status))
                };
                let is_stop = !status.success()
                    && (stopped || outcome.is_err() || status.code() == Some(STOPPED));
                if is_stop {
                    // Also without a signal to this process: the limit of a batch job, for example.
                    stopped |= outcome.is_ok();
                } else if outcome.is_ok() {
                    outcome = ended(process.number, state, seconds);
                }
            }
            processes = going_on;
            if outcome.is_err() && !asked {
                kill(&processes, libc::SIGUSR1);
                asked = true;
            }
        }
        outcome.map(|()| stopped)
    }

    /// Start a run, from its checkpoint if it has one.
    fn start(&self, run: &Run) -> Result<Child> {
        let folder = &run.folder;
        std::fs::create_dir_all(folder).map_err(|error| file_error(folder, "create", &error))?;
        let known = folder.join(DECK);
        let same = std::fs::read_to_string(&known).is_ok_and(|text| text == run.deck);
        let has_checkpoint = CHECKPOINTS.iter().any(|name| folder.join(name).exists());
        let begin = if same && has_checkpoint && !self.arguments.overwrite {
            "--restart"
        } else {
            "--overwrite"
        };
        let _ = std::fs::remove_file(folder.join(COMPLETE));
        std::fs::write(&known, &run.deck).map_err(|error| file_error(&known, "write", &error))?;
        let path = folder.join(LOG);
        let log = File::create(&path).map_err(|error| file_error(&path, "create", &error))?;
        let errors = log
            .try_clone()
            .map_err(|error| file_error(&path, "write", &error))?;
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
        // In a process group of its own, so that Ctrl-C reaches it once, through this process.
        command.process_group(0);
        command.spawn().map_err(|error| {
            let program = command.get_program().to_string_lossy().into_owned();
            Error::run(format!("cannot start {program}: {error}"))
        })
    }
}

/// How a process ended.
fn words(status: ExitStatus) -> String {
    match status.code() {
        Some(code) => format!("failed with exit code {code}"),
        None => format!("was killed ({status})"),
    }
}

/// Send a signal to processes that have not been waited for.
fn kill(processes: &[Process], signal: i32) {
    for process in processes {
        // SAFETY: only sends a signal. The id is that of the child: it is not given to another process before
        // the child is waited for.
        unsafe {
            libc::kill(process.child.id() as i32, signal);
        }
    }
}
