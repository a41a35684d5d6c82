//! Crack paths at the latest output as CSV files, one per crack.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::comm::{Communicator, agree};
use crate::error::{Error, Result};
use crate::solver::observers::Branch;

/// Write `crack_NAME.csv` for each crack, and replace the file of an earlier output. Collective.
///
/// Each row is a vertex of a branch, with the length of the crack up to it.
///
/// # Errors
/// If the disk is full.
pub fn write(comm: &dyn Communicator, folder: &Path, cracks: &[(&str, Vec<Branch>)]) -> Result<()> {
    let write_all = || {
        for (name, branches) in cracks {
            let path = folder.join(format!("crack_{name}.csv"));
            // The file is renamed when complete, so readers never see a partial file.
            let part = folder.join(format!("crack_{name}.csv.part"));
            let written = fs::write(&part, table(branches)).and_then(|()| fs::rename(&part, &path));
            written.map_err(|error| {
                let path = path.display();
                Error::run(format!(
                    "{path}: cannot write the path of the crack: {error}"
                ))
            })?;
        }
        Ok(())
    };
    let written = match comm.rank() {
        0 => write_all(),
        _ => Ok(()),
    };
    agree(comm, written)
}

fn table(branches: &[Branch]) -> String {
    let mut text = "branch,x [m],y [m],length [m]\n".to_owned();
    for (number, branch) in branches.iter().enumerate() {
        for vertex in branch {
            let [x, y, _] = vertex.place;
            let _ = writeln!(text, "{number},{x:?},{y:?},{:?}", vertex.along);
        }
    }
    text
}
