//! Runs of the `fissure` command, as a single process and under mpirun.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Upper limit of the duration of a command in a test, also on a slow and busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// Time that mpirun may take after all of its ranks have ended. The mpirun of Open MPI 4.1.4 with PMIx 4.2.2
/// may hang in `PMIx_server_finalize` after a rank was killed.
const LAUNCHER_PATIENCE: Duration = Duration::from_secs(10);

/// A folder that is removed with its content when dropped.
pub struct Folder(pub PathBuf);

impl Folder {
    /// Create an empty temporary folder; its name contains `name` and the process id.
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("fissure-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&path);
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    /// Return a path in the folder.
    pub fn join(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.join(name)
    }

    /// Write a file into the folder.
    pub fn write(&self, name: &str, content: &(impl AsRef<[u8]> + ?Sized)) -> PathBuf {
        let path = self.join(name);
        std::fs::write(&path, content).unwrap();
        path
    }
}

/// A small file system (tmpfs) in a folder, unmounted when dropped.
pub struct SmallDisc(PathBuf);

impl SmallDisc {
    /// Mount a file system of a size such as `2m`. Only root can do this; otherwise the test is
    /// [skipped](skip) and the result is `None`.
    pub fn mount(folder: &Folder, size: &str) -> Option<Self> {
        let path = folder.join("small");
        std::fs::create_dir(&path).unwrap();
        let mounted = Command::new("mount")
            .args(["-t", "tmpfs", "-o", &format!("size={size}"), "tmpfs"])
            .arg(&path)
            .stderr(Stdio::null())
            .status();
        if mounted.is_ok_and(|status| status.success()) {
            return Some(Self(path));
        }
        skip("only root can mount the small disc that this test fills");
        None
    }

    /// Return a path in the file system.
    pub fn join(&self, name: impl AsRef<Path>) -> PathBuf {
        self.0.join(name)
    }
}

impl Drop for SmallDisc {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

/// Print that a test is skipped, and the reason.
///
/// # Panics
/// If the environment variable `CI` is set, because CI must not skip tests.
pub fn skip(why: &str) {
    let in_ci = std::env::var_os("CI").is_some();
    assert!(!in_ci, "{why}; where CI is set, no test is skipped");
    eprintln!("skipped: {why}");
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Return the command on several ranks under mpirun, or on one rank without mpirun.
pub fn fissure(ranks: usize) -> Command {
    let binary = env!("CARGO_BIN_EXE_fissure");
    if ranks == 1 {
        let mut command = Command::new(binary);
        command.envs([WITHOUT_NETWORK]);
        return command;
    }
    under_mpirun(ranks, binary)
}

/// Return `fissure run` on two ranks under mpirun. Each rank has its own current folder and arguments.
pub fn run_on_two_ranks(ranks: [(&Path, &[&str]); 2]) -> Command {
    let mut command = mpirun();
    for (rank, (folder, arguments)) in ranks.into_iter().enumerate() {
        if rank > 0 {
            command.arg(":");
        }
        command.args(["-n", "1", "--wdir"]).arg(folder);
        command.args([env!("CARGO_BIN_EXE_fissure"), "run"]);
        command.args(arguments);
    }
    command
}

/// Keep Open MPI from loading the drivers of networks, two of which wait for 0.1 s when a process starts.
const WITHOUT_NETWORK: (&str, &str) = ("OMPI_MCA_pml", "ob1");

/// Environment variable that marks the ranks of a test that uses MPI in its own process.
const RANK_OF_A_TEST: &str = "FISSURE_RANK_OF_A_TEST";

/// Return whether this process is a rank of a test that uses MPI. Otherwise run the test with this full name
/// on `ranks` ranks; the test must pass on all ranks.
pub fn is_rank(ranks: usize, test: &str) -> bool {
    if std::env::var_os(RANK_OF_A_TEST).is_some() {
        return true;
    }
    let mut command = under_mpirun(ranks, std::env::current_exe().unwrap());
    command.args([test, "--exact", "--nocapture"]);
    let printed = succeed(command.env(RANK_OF_A_TEST, "yes"));
    let passed = printed.matches("1 passed").count();
    assert_eq!(passed, ranks, "{printed}");
    false
}

fn under_mpirun(ranks: usize, program: impl AsRef<OsStr>) -> Command {
    let mut command = mpirun();
    command.args(["-n", &ranks.to_string()]);
    command.arg(program);
    command
}

fn mpirun() -> Command {
    let mut command = Command::new("mpirun");
    command.args(["--bind-to", "none"]);
    command.envs([
        WITHOUT_NETWORK,
        ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
        ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
        ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
        // Waiting ranks yield their core to working ranks.
        ("OMPI_MCA_mpi_yield_when_idle", "1"),
        ("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe"),
    ]);
    command
}

/// Run a command to its end.
///
/// # Panics
/// If the command exceeds the time limit.
pub fn finish(command: &mut Command) -> Output {
    let child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    wait(child)
}

/// Return the process ids of the ranks started by mpirun, or of the command itself.
pub fn rank_processes(child: &Child, ranks: usize) -> Vec<u32> {
    if ranks == 1 {
        return vec![child.id()];
    }
    children(child)
}

/// Return the ids of the child processes of a process, including zombies.
fn children(child: &Child) -> Vec<u32> {
    let children = format!("/proc/{0}/task/{0}/children", child.id());
    let text = std::fs::read_to_string(children).unwrap_or_default();
    text.split_whitespace()
        .filter_map(|id| id.parse().ok())
        .collect()
}

/// Return whether a process exists and is not a zombie.
pub fn is_running(process: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    let state = status.rsplit(") ").next().unwrap_or_default();
    !(state.is_empty() || state.starts_with(['Z', 'X']))
}

/// Wait for the end of a process. Its output must fit into the pipes, which are read after the end. Kill an
/// mpirun that hangs after all of its ranks have ended.
///
/// # Panics
/// If the process exceeds the time limit; the process is killed.
pub fn wait(mut child: Child) -> Output {
    let start = Instant::now();
    let mut last_with_ranks = start;
    while child.try_wait().unwrap().is_none() {
        let ranks = children(&child);
        if ranks.is_empty() || ranks.into_iter().any(is_running) {
            last_with_ranks = Instant::now();
        } else if last_with_ranks.elapsed() > LAUNCHER_PATIENCE {
            child.kill().unwrap();
        }
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!(
                "the command hangs: {}",
                text(&child.wait_with_output().unwrap())
            );
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    child.wait_with_output().unwrap()
}

/// Run a command that must succeed, and return its standard output.
pub fn succeed(command: &mut Command) -> String {
    let output = finish(command);
    assert!(output.status.success(), "{command:?}\n{}", text(&output));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Return standard output and standard error of a command.
pub fn text(output: &Output) -> String {
    let (out, error) = (&output.stdout, &output.stderr);
    format!(
        "{}{}",
        String::from_utf8_lossy(out),
        String::from_utf8_lossy(error)
    )
}
