//! CSV files with the crack paths (in 3-D, the crack fronts) at the latest output, one file per crack.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::comm::{Communicator, agree};
use crate::error::{Error, Result};
use crate::points::distance_squared;
use crate::solver::observers::{Branch, Surface};

use super::files::crack_table;

/// Name of a crack, and its table as CSV text.
type Table = (String, String);

/// Write `crack_NAME.csv` for each crack, and replace the file of an earlier output. Collective.
///
/// # Errors
/// If a file cannot be written, for example because the disk is full.
pub fn write(comm: &dyn Communicator, folder: &Path, cracks: &[Table]) -> Result<()> {
    let write_all = || {
        for (name, table) in cracks {
            let path = crack_table(folder, name);
            // The file is renamed when complete, so readers never see a partial file.
            let part = path.with_extension("csv.part");
            let written = fs::write(&part, table).and_then(|()| fs::rename(&part, &path));
            written.map_err(|error| {
                let path = path.display();
                Error::run(format!(
                    "{path}: cannot write the table of the crack: {error}"
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

/// Format the tables of crack paths. Each row is a vertex of a branch, with the length of the crack up to
/// this vertex.
pub fn of_paths(cracks: Vec<(&str, Vec<Branch>)>) -> Vec<Table> {
    let table = |(name, branches): (&str, Vec<Branch>)| (name.to_owned(), of_branches(&branches));
    cracks.into_iter().map(table).collect()
}

/// Format the tables of crack fronts. Each row is a position on the front, with its distance from the start
/// of the crack.
pub fn of_surfaces(cracks: Vec<(&str, [f64; 3], Surface)>) -> Vec<Table> {
    let table = |(name, from, surface): (&str, [f64; 3], Surface)| {
        let mut text = "x [m],y [m],z [m],distance [m]\n".to_owned();
        for place in surface.front {
            let [x, y, z] = place;
            let distance = distance_squared(from, place).sqrt();
            let _ = writeln!(text, "{x:?},{y:?},{z:?},{distance:?}");
        }
        (name.to_owned(), text)
    };
    cracks.into_iter().map(table).collect()
}

fn of_branches(branches: &[Branch]) -> String {
    let mut text = "branch,x [m],y [m],length [m]\n".to_owned();
    for (number, branch) in branches.iter().enumerate() {
        for vertex in branch {
            let [x, y, _] = vertex.place;
            let _ = writeln!(text, "{number},{x:?},{y:?},{:?}", vertex.along);
        }
    }
    text
}
