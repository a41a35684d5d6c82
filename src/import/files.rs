//! Files that an imported deck names: their paths, and what the import needs to know of them.

use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Component, Path, PathBuf};

use crate::points::columns::{Columns, entries, heading, is_comment};

/// The path of a file as seen from another folder, with `/` between its parts.
pub fn relative(file: &Path, folder: &Path) -> PathBuf {
    let absolute = |path: &Path| {
        // No path at all is the working directory.
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

/// A path without `.` and `..`, as far as its text tells.
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

/// What the import needs to know of a point file.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PointFile {
    /// Names of its columns, if a header gives them.
    pub names: Option<Vec<String>>,
    /// Block numbers of its rows.
    pub blocks: BTreeSet<u32>,
    /// Number of its rows.
    pub rows: u64,
}

impl PointFile {
    /// Read a point file; `order` are its columns if it has no header. Rows that are no points do not count.
    ///
    /// `None` if the file cannot be read.
    pub fn read(path: &Path, order: &[&str]) -> Option<Self> {
        let heading = heading(path).ok()?;
        let names = match &heading {
            Some(heading) => heading.names.clone(),
            None => order.iter().map(|name| (*name).to_owned()).collect(),
        };
        // The coordinates do not count here, nor their number.
        let columns = Columns::named(&names, 1).ok();
        let mut file = Self {
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

    /// Number of coordinates that the header names.
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
