//! Removal of files of an earlier run from the output folder: results of outputs and tables of cracks that
//! the deck no longer has.

use std::fs;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::output::ResultReader;
use crate::problem::Problem;

use super::crack_files;

/// Remove the further results, with their side-cars, and the tables of cracks that a run of this problem does
/// not replace. Return the paths of the removed results and tables. A file with such a name but other content
/// is kept. Called on rank 0.
///
/// # Errors
/// If a file cannot be removed.
pub fn remove(problem: &Problem, folder: &Path) -> Result<Vec<PathBuf>> {
    let failed = |path: &Path, error: std::io::Error| {
        Error::run(format!("cannot remove {}: {error}", path.display()))
    };
    let entries = fs::read_dir(folder).map_err(|error| failed(folder, error))?;
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| is_stale(problem, path));
    paths.sort();
    for path in &paths {
        fs::remove_file(path).map_err(|error| failed(path, error))?;
        if path
            .extension()
            .is_some_and(|extension| extension == "vtkhdf")
        {
            // An error is ignored, because the result may have no side-car.
            let _ = fs::remove_file(path.with_extension("xdmf"));
        }
    }
    Ok(paths)
}

fn is_stale(problem: &Problem, path: &Path) -> bool {
    let Some(file) = path.file_name().and_then(|name| name.to_str()) else {
        return false;
    };
    let between = |before: &str, after: &str| file.strip_prefix(before)?.strip_suffix(after);
    if let Some(name) = between("result_", ".vtkhdf") {
        let mut outputs = problem.further_outputs.iter();
        let is_known = outputs.any(|output| output.name.as_deref() == Some(name));
        return !is_known && is_result_of(path, name);
    }
    if let Some(name) = between("crack_", ".csv") {
        let mut cracks = problem.history.cracks.iter();
        return !cracks.any(|crack| crack.name == name) && crack_files::is_table(path);
    }
    false
}

/// Test whether a file is the result of a further output with this name. A result that a restart has renamed
/// has another name in its attributes, so the file is not removed.
fn is_result_of(path: &Path, name: &str) -> bool {
    let attributes = ResultReader::open(path).and_then(|reader| reader.attributes());
    attributes.is_ok_and(|attributes| {
        let mut attributes = attributes.into_iter();
        attributes.any(|(key, value)| key == "output" && value == name)
    })
}
