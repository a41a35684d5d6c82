//! Comparison of the copies of a file that the ranks read. Each node may have a copy of its own.

use std::fs::File;
use std::hash::{DefaultHasher, Hasher};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use super::columns::{LONGEST_ROW, heading};
use crate::comm::{Communicator, agree, check_equal};
use crate::error::{Error, Result};

/// What the user must do if the copies differ, for messages.
const RULE: &str = "all ranks must read the same file, on a file system that all nodes share";

/// Check that all ranks read the same contents of a file. Rank 0 reads the whole file. Every other rank reads
/// the heading and its own part of the rows, and compares both with what rank 0 reads there. Collective.
///
/// # Errors
/// If the file cannot be read; `unreadable` converts the error. If the contents differ; the message names the
/// file and the lowest rank that differs.
pub fn check_same_file(
    path: &Path,
    comm: &dyn Communicator,
    unreadable: impl Fn(io::Error) -> Error,
) -> Result<()> {
    let (rank, ranks) = (comm.rank(), comm.size());
    if ranks == 1 {
        return Ok(());
    }
    let found = agree(comm, heading(path).map_err(&unreadable))?;
    let name = format!("heading of {}", path.display());
    // Each rank may have another path to the file.
    agree(comm, check_equal(comm, &found, &name, RULE))?;
    let hashes: io::Result<Vec<u64>> = if rank == 0 {
        (0..ranks).map(|part| hash(path, part, ranks)).collect()
    } else {
        hash(path, rank, ranks).map(|hash| vec![hash])
    };
    let hashes = agree(comm, hashes.map_err(unreadable))?;
    let mut expected = bytemuck::cast_slice(&hashes).to_vec();
    comm.broadcast(0, &mut expected);
    let expected: Vec<u64> = bytemuck::pod_collect_to_vec(&expected);
    let is_same = rank == 0 || hashes[0] == expected[rank];
    let checked = if is_same {
        Ok(())
    } else {
        Err(Error::input(format!(
            "{}: rank {rank} reads other contents than rank 0; {RULE}",
            path.display()
        )))
    };
    agree(comm, checked)
}

/// Hash the length of a file, and the bytes of one of `parts` equal parts of the file. A row that starts in
/// the part may end after it, so the hash includes the following bytes up to the length of the longest row.
fn hash(path: &Path, part: usize, parts: usize) -> io::Result<u64> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let border = |part: usize| (u128::from(length) * part as u128 / parts as u128) as u64;
    let (start, end) = (border(part), border(part + 1) + LONGEST_ROW);
    file.seek(SeekFrom::Start(start))?;
    let mut bytes = file.take(end - start);
    let mut hasher = DefaultHasher::new();
    hasher.write_u64(length);
    let mut buffer = vec![0; 1 << 16];
    loop {
        match bytes.read(&mut buffer)? {
            0 => return Ok(hasher.finish()),
            read => hasher.write(&buffer[..read]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;

    #[test]
    fn a_rank_with_another_copy_is_named() {
        let folder = std::env::temp_dir().join(format!("fissure-copies-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let rows = |changed: Option<usize>| {
            let row = |k: usize| {
                let x = k + usize::from(changed == Some(k));
                format!("{x:06} 0 1 0\n")
            };
            (0..100_000).map(row).collect::<String>()
        };
        let write = |name: &str, text: String| {
            let path = folder.join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        let first = write("first.txt", rows(None));
        let copy = write("copy.txt", rows(None));
        let early = write("early.txt", rows(Some(10)));
        let late = write("late.txt", rows(Some(90_000)));
        let headed = write("headed.txt", format!("x y volume block\n{}", rows(None)));
        // Rank 2 of 3 reads the last third of its copy.
        let check = |of_rank_2: &Path| {
            let results = threads::run(3, |comm| {
                let path = if comm.rank() == 2 { of_rank_2 } else { &first };
                let unreadable = |error: io::Error| Error::input(error.to_string());
                check_same_file(path, comm, unreadable).map_err(|error| error.message)
            });
            assert!(results.windows(2).all(|pair| pair[0] == pair[1]));
            results.into_iter().next().unwrap()
        };
        let equal = [check(&copy), check(&early)];
        let different = [check(&late), check(&headed)];
        let missing = check(&folder.join("missing.txt"));
        std::fs::remove_dir_all(&folder).unwrap();
        assert_eq!(equal, [Ok(()), Ok(())]);
        for (result, words) in different.into_iter().zip([
            "late.txt: rank 2 reads other contents than rank 0",
            "rank 2 has another heading of ",
        ]) {
            let message = result.unwrap_err();
            assert!(message.contains(words), "{message}");
        }
        assert!(missing.unwrap_err().contains("No such file"));
    }
}
