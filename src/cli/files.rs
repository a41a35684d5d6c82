//! The files of a run's output folder.

use std::fs;
use std::path::{Path, PathBuf};

use fissure::error::{Error, Result};
use fissure::output::checkpoint::Checkpoints;

use super::file_error;

/// Where a run writes to.
pub struct Files {
    /// The folder.
    pub folder: PathBuf,
    /// The result.
    pub result: PathBuf,
    /// The history as a table.
    pub history: PathBuf,
}

impl Files {
    /// The files of a folder.
    pub fn new(folder: PathBuf) -> Self {
        Self {
            result: folder.join("result.vtkhdf"),
            history: folder.join("history.csv"),
            folder,
        }
    }

    /// Makes the folder for a new run. For rank 0.
    ///
    /// # Errors
    /// When a result or a checkpoint is there that must not be replaced, or the folder cannot be made.
    pub fn prepare(&self, overwrite: bool) -> Result<()> {
        let files = [self.result.clone(), self.history.clone()];
        let existing = files
            .into_iter()
            .chain(Checkpoints::paths(&self.folder))
            .find(|file| file.exists());
        if let (Some(file), false) = (existing, overwrite) {
            return Err(Error::input(format!(
                "{} exists already; --restart continues the run, --overwrite replaces it, \
                 --output DIR writes elsewhere",
                file.display()
            )));
        }
        fs::create_dir_all(&self.folder)
            .map_err(|error| file_error(&self.folder, "create the folder", &error))
    }

    /// Renames result and history, so that others can take their names. For rank 0.
    ///
    /// # Errors
    /// When one cannot be renamed.
    pub fn set_aside(&self, number: u64) -> Result<PathBuf> {
        let aside = |file: &Path| {
            let stem = file.file_stem().unwrap_or_default().to_string_lossy();
            let extension = file.extension().unwrap_or_default().to_string_lossy();
            file.with_file_name(format!("{stem}_until_step_{number}.{extension}"))
        };
        for file in [&self.result, &self.history] {
            if file.exists() {
                fs::rename(file, aside(file))
                    .map_err(|error| file_error(file, "rename", &error))?;
            }
        }
        Ok(aside(&self.result))
    }
}
