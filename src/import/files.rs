//! Files that a source deck names: their paths, and the data that the import reads from them.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Component, Path, PathBuf};

use crate::points::columns::{Columns, entries, heading, is_comment};

/// Return the path of a file relative to a folder, with `/` between its parts.
pub fn relative(file: &Path, folder: &Path) -> PathBuf {
    let absolute = |path: &Path| {
        // The empty path is the working directory.
        let path = if path.as_os_str().is_empty() {
            Path::new(".")
        } else {
            path
        };
        std::path::absolute(path).unwrap_or_else(|_| path.to_owned())
    };
    let (file, folder) = (plain(&absolute(file)), plain(&absolute(folder)));
    let common = file
        .components()
        .zip(folder.components())
        .take_while(|(a, b)| a == b);
    let common = common.count();
    let up = folder
        .components()
        .skip(common)
        .map(|_| Component::ParentDir);
    up.chain(file.components().skip(common)).collect()
}

/// Remove `.` and `..` from a path, without access to the file system.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for component in path.components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir if plain.file_name().is_some() => {
                plain.pop();
            }
            other => plain.push(other),
        }
    }
    plain
}

/// Read a finite number.
fn finite(entry: &str) -> Option<f64> {
    entry.parse().ok().filter(|number: &f64| number.is_finite())
}

/// Summary of a point file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PointFile {
    /// Path, relative to the working directory or absolute.
    pub path: PathBuf,
    /// Column names, if the file has a header.
    pub names: Option<Vec<String>>,
    /// Block numbers in the file.
    pub blocks: BTreeSet<u32>,
    /// Number of rows with points.
    pub rows: u64,
}

impl PointFile {
    /// Read a point file. `order` contains the column names, which are used if the file has no header. The
    /// header, comments and blank lines are not counted as rows.
    ///
    /// Return `None` if the file cannot be read.
    pub fn read(path: &Path, order: &[&str]) -> Option<Self> {
        let heading = heading(path).ok()?;
        let names = match &heading {
            Some(heading) => heading.names.clone(),
            None => order.iter().map(|name| (*name).to_owned()).collect(),
        };
        // Only the block column matters here, so the number of coordinates is arbitrary.
        let columns = Columns::named(&names, 1).ok();
        let mut file = Self {
            path: path.to_owned(),
            names: heading.as_ref().map(|heading| heading.names.clone()),
            ..Self::default()
        };
        let reader = BufReader::new(File::open(path).ok()?);
        for (line, row) in (1..).zip(reader.lines()) {
            let row = row.ok()?;
            let is_heading = heading.as_ref().is_some_and(|heading| heading.line == line);
            if is_heading || row.trim().is_empty() || is_comment(&row) {
                continue;
            }
            file.rows += 1;
            let block = columns.as_ref().and_then(|columns| columns.block);
            if let (Some(block), Ok(entries)) = (block, entries(&row)) {
                let number = entries
                    .get(block)
                    .and_then(|entry| entry.parse::<f64>().ok());
                file.blocks.extend(number.map(|number| number as u32));
            }
        }
        Some(file)
    }

    /// Read the positions (m) of the points of two blocks. Return `None` if the file cannot be read, or if it
    /// has no header with coordinates and block numbers.
    pub fn positions(&self, blocks: [u64; 2]) -> Option<[Vec<[f64; 3]>; 2]> {
        let columns = Columns::named(self.names.as_ref()?, self.dimension()?).ok()?;
        let block = columns.block?;
        let mut positions = [Vec::new(), Vec::new()];
        let reader = BufReader::new(File::open(&self.path).ok()?);
        for row in reader.lines() {
            let row = row.ok()?;
            let entries = entries(&row).unwrap_or_default();
            let number = |column: usize| finite(entries.get(column)?);
            let coordinates = columns.position.iter().map(|column| number(*column));
            // The header, comments and blank lines have no numbers.
            let Some(coordinates) = coordinates.collect::<Option<Vec<f64>>>() else {
                continue;
            };
            let mut position = [0.0; 3];
            position[..coordinates.len()].copy_from_slice(&coordinates);
            for (known, positions) in blocks.into_iter().zip(&mut positions) {
                if number(block) == Some(known as f64) {
                    positions.push(position);
                }
            }
        }
        Some(positions)
    }

    /// Create the message for a deck whose blocks have no points in this file.
    pub fn no_block_message(&self) -> String {
        let listed: Vec<String> = self.blocks.iter().take(8).map(u32::to_string).collect();
        let more = if self.blocks.len() > 8 { ", …" } else { "" };
        match listed.len() {
            0 => "no row of the point file has a block number; the header must name the columns x, block_id and \
                  volume"
                .to_owned(),
            _ => format!(
                "no row of the point file belongs to one of the blocks; the file has the block numbers {}{more}",
                listed.join(", ")
            ),
        }
    }

    /// Return the number of coordinates in the header; `None` without a header.
    pub fn dimension(&self) -> Option<usize> {
        let names = self.names.as_ref()?;
        let has = |name: &str| names.iter().any(|known| known.eq_ignore_ascii_case(name));
        Some(1 + usize::from(has("y")) + usize::from(has("z")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_written_as_seen_from_another_folder() {
        for (file, folder, expected) in [
            ("/a/b/mesh.txt", "/a/b", "mesh.txt"),
            ("/a/b/mesh.txt", "/a", "b/mesh.txt"),
            ("/a/b/../mesh.txt", "/a/c/d", "../../mesh.txt"),
            ("/a/b/./mesh.txt", "/a/b/c", "../mesh.txt"),
            ("mesh.txt", "", "mesh.txt"),
            ("a/mesh.txt", "", "a/mesh.txt"),
            ("mesh.txt", "a/b", "../../mesh.txt"),
        ] {
            assert_eq!(
                relative(file.as_ref(), folder.as_ref()),
                Path::new(expected)
            );
        }
    }
}
