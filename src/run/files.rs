//! The output files of a run.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::error::{Error, Result};
use crate::message::{FOLDER, REPLACE, RESTART};
use crate::output::checkpoint::{Checkpoints, is_taken};
use crate::problem::Problem;

/// Longest wait for the lock of the folder.
const LOCK_TIMEOUT: Duration = Duration::from_secs(5);

/// Paths of the output files.
#[derive(Debug, Clone)]
pub struct Files {
    /// The folder of the run.
    pub folder: PathBuf,
    /// The main result.
    pub result: PathBuf,
    /// The further results, in the order of the outputs.
    pub further: Vec<PathBuf>,
    /// The history, as CSV.
    pub history: PathBuf,
    /// The tables of the cracks, as CSV.
    pub cracks: Vec<PathBuf>,
}

impl Files {
    /// Return the paths of the output files of a run. All files are in `folder`.
    pub fn new(problem: &Problem, folder: PathBuf) -> Self {
        let further = problem.further_outputs.iter();
        let cracks = problem.history.cracks.iter();
        Self {
            result: result_of(&folder, None),
            further: further
                .map(|output| result_of(&folder, output.name.as_deref()))
                .collect(),
            history: folder.join("history.csv"),
            cracks: cracks
                .map(|crack| crack_table(&folder, &crack.name))
                .collect(),
            folder,
        }
    }

    /// Return the paths of the results, the main result first.
    pub fn results(&self) -> impl Iterator<Item = &Path> {
        let all = [&self.result].into_iter().chain(&self.further);
        all.map(PathBuf::as_path)
    }

    fn side_cars(&self) -> impl Iterator<Item = PathBuf> {
        self.results().map(|path| path.with_extension("xdmf"))
    }

    /// Remove temporary files that a killed run has left. Called on rank 0.
    ///
    /// # Errors
    /// If a file cannot be removed.
    pub fn remove_temporary(&self) -> Result<()> {
        let results = self.results();
        let mut paths: Vec<PathBuf> = results
            .map(|path| path.with_extension("vtkhdf.part"))
            .collect();
        paths.extend(
            self.side_cars()
                .map(|path| path.with_extension("xdmf.part")),
        );
        let tables = self.cracks.iter().chain([&self.history]);
        paths.extend(tables.map(|path| path.with_extension("csv.part")));
        paths.iter().try_for_each(|path| remove(path))
    }

    /// If the main result of an earlier run has been removed, remove the other files of the earlier run:
    /// further results, side-cars, the history, tables of cracks, and the files `stale`. Called on rank 0.
    ///
    /// # Errors
    /// If a file cannot be removed.
    pub fn remove_remains(&self, stale: &[PathBuf]) -> Result<()> {
        if is_taken(&self.result) {
            return Ok(());
        }
        let results = self.further.iter().chain(stale);
        let tables = self.cracks.iter().chain([&self.history]);
        let mut paths = results.chain(tables).cloned().chain(self.side_cars());
        paths.try_for_each(|path| remove(&path))
    }

    /// Check that a new run may write to the folder. Called on rank 0.
    ///
    /// # Errors
    /// If the folder contains a result, history or checkpoint, and `overwrite` is false.
    pub fn prepare(&self, overwrite: bool) -> Result<()> {
        let files = self.results().chain([self.history.as_path()]);
        let existing = files
            .map(Path::to_path_buf)
            .chain(Checkpoints::paths(&self.folder))
            .find(|file| is_taken(file));
        if let (Some(file), false) = (existing, overwrite) {
            let restart = if Checkpoints::paths(&self.folder).any(|path| is_taken(&path)) {
                format!("{RESTART} continues the run, ")
            } else {
                String::new()
            };
            return Err(Error::input(format!(
                "{} exists already; {restart}{REPLACE} replaces it, {FOLDER} writes elsewhere",
                file.display()
            )));
        }
        Ok(())
    }

    /// Create the folder and lock it until the returned file is dropped. Called on rank 0.
    ///
    /// # Errors
    /// If the folder or its lock file cannot be created, the path is empty or not UTF-8, or another run has
    /// locked the folder.
    pub fn lock(&self) -> Result<fs::File> {
        if self.folder.as_os_str().is_empty() {
            let message = "the path of the output folder is empty; `.` is the working directory";
            return Err(Error::input(message));
        }
        if self.folder.to_str().is_none() {
            return Err(Error::input(format!(
                "{}: the path of the output folder must be UTF-8; {FOLDER} writes elsewhere",
                self.folder.display()
            )));
        }
        fs::create_dir_all(&self.folder)
            .map_err(|error| Error::file(&self.folder, "create the folder", &error))?;
        let path = self.lock_path();
        // The content belongs to the run that holds the lock, so it is not truncated here.
        let mut opened = fs::OpenOptions::new();
        opened.write(true).create(true).truncate(false);
        let file = opened.open(&path);
        let file = file.map_err(|error| Error::file(&path, "create", &error))?;
        let begin = Instant::now();
        loop {
            match file.try_lock() {
                // The ranks of a killed run need a moment to exit and to release the lock.
                Err(fs::TryLockError::WouldBlock) if begin.elapsed() < LOCK_TIMEOUT => {
                    std::thread::sleep(Duration::from_millis(100));
                }
                Err(fs::TryLockError::WouldBlock) => {
                    return Err(Error::input(format!(
                        "another run is writing to {}; {FOLDER} writes elsewhere",
                        self.folder.display()
                    )));
                }
                // Some network file systems do not support locks. The run then writes to the folder without a
                // lock.
                Ok(()) | Err(fs::TryLockError::Error(_)) => return Ok(file),
            }
        }
    }

    /// Return the path of the lock file of the folder.
    pub fn lock_path(&self) -> PathBuf {
        self.folder.join(".lock")
    }

    /// Rename existing files of a result, so that new files can be created. The new names contain `number`,
    /// the step of the restart. Return the new paths. Called on rank 0.
    ///
    /// # Errors
    /// If a file cannot be renamed.
    pub fn set_aside(files: &[&Path], number: u64) -> Result<Vec<PathBuf>> {
        let named = |file: &Path, count: u32| {
            let stem = file.file_stem().unwrap_or_default().to_string_lossy();
            let extension = file.extension().unwrap_or_default().to_string_lossy();
            let again = if count == 0 {
                String::new()
            } else {
                format!("_{count}")
            };
            file.with_file_name(format!("{stem}_until_step_{number}{again}.{extension}"))
        };
        let is_free = |count: &u32| files.iter().all(|file| !is_taken(&named(file, *count)));
        let count = (0..).find(is_free).unwrap_or(u32::MAX);
        let aside = |file: &Path| named(file, count);
        let mut renamed = Vec::new();
        for file in files {
            if is_taken(file) {
                fs::rename(file, aside(file))
                    .map_err(|error| Error::file(file, "rename", &error))?;
                renamed.push(aside(file));
            }
        }
        Ok(renamed)
    }
}

/// Return the path of the further result `name`, or of the main result for `None`.
fn result_of(folder: &Path, name: Option<&str>) -> PathBuf {
    match name {
        None => folder.join("result.vtkhdf"),
        Some(name) => folder.join(format!("result_{name}.vtkhdf")),
    }
}

/// Return the path of the table of a crack.
pub fn crack_table(folder: &Path, crack: &str) -> PathBuf {
    folder.join(format!("crack_{crack}.csv"))
}

/// Remove a file, if it exists.
///
/// # Errors
/// If the file cannot be removed.
pub fn remove(path: &Path) -> Result<()> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(Error::file(path, "remove", &error))
        }
        _ => Ok(()),
    }
}
