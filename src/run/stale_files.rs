//! Stale files in the output folder: an earlier run wrote them, and a new run does not replace them. Each of
//! these files is a further result or the table of a crack. The deck no longer contains the output or the
//! crack to which the file belongs.

use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::output::ResultReader;
use crate::problem::Problem;

use super::files::Files;

/// Largest number of bytes that are read to find the heading of a history file.
const LONGEST_HEADING: u64 = 1 << 20;

/// Find the files of earlier runs that a run of this problem does not replace: further results with their
/// side-cars, and tables of cracks. A file that no earlier run wrote is omitted, even if it has the name of a
/// further result or of a table of a crack. The names of the earlier cracks are read from the history file.
/// Therefore the function must be called before the run replaces this file. Only rank 0 calls the function.
///
/// # Errors
/// If the folder cannot be read.
pub fn find(problem: &Problem, files: &Files) -> Result<Vec<PathBuf>> {
    let folder = &files.folder;
    let entries = fs::read_dir(folder).map_err(|error| Error::file(folder, "read", &error))?;
    let heading = heading(&files.history).unwrap_or_default();
    let mut paths = Vec::new();
    for path in entries.flatten().map(|entry| entry.path()) {
        let Some(file) = path.file_name().and_then(|name| name.to_str()) else {
            continue;
        };
        let between = |before: &str, after: &str| file.strip_prefix(before)?.strip_suffix(after);
        if let Some(name) = between("result_", ".vtkhdf") {
            let mut outputs = problem.further_outputs.iter();
            if !outputs.any(|output| output.name.as_deref() == Some(name))
                && is_result_of(&path, name)
            {
                let side_car = path.with_extension("xdmf");
                paths.extend(side_car.is_file().then_some(side_car));
                paths.push(path);
            }
        } else if let Some(name) = between("crack_", ".csv") {
            let mut cracks = problem.history.cracks.iter();
            let column = format!("crack_{name}_");
            if !cracks.any(|crack| crack.name == name)
                && heading.split(',').any(|entry| entry.starts_with(&column))
            {
                paths.push(path);
            }
        }
    }
    paths.sort();
    Ok(paths)
}

/// Read the first line of a history file.
fn heading(path: &Path) -> std::io::Result<String> {
    let mut line = String::new();
    // Opening a pipe would block until its other end is opened, so only regular files are read.
    if fs::metadata(path)?.is_file() {
        BufReader::new(File::open(path)?.take(LONGEST_HEADING)).read_line(&mut line)?;
    }
    Ok(line)
}

/// Test whether a file is the result of a further output with this name. False for a result that a restart
/// has renamed, because its attributes contain the old name.
fn is_result_of(path: &Path, name: &str) -> bool {
    let attributes = ResultReader::open(path).and_then(|reader| reader.attributes());
    attributes.is_ok_and(|attributes| {
        let mut attributes = attributes.into_iter();
        attributes.any(|(key, value)| key == "output" && value == name)
    })
}
