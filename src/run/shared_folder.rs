//! Check that all ranks write to the same output folder. A folder on a local disk of a node is another folder
//! on each node; a collective open of a file in it would never return.

use std::fs::{self, File};
use std::hash::{BuildHasher, RandomState};
use std::io::Write;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::comm::{self, Communicator, agree};
use crate::error::{Error, Result};

use super::files::Files;

/// Longest wait for the lock file of rank 0. A network file system may show new files late on other nodes.
pub const TIMEOUT: Duration = Duration::from_secs(30);

/// Time between two reads of the lock file.
const INTERVAL: Duration = Duration::from_millis(50);

/// Write a random token to the lock file on rank 0, and wait on the other ranks until the lock file in
/// their folder contains this token. `lock` is the open lock file on rank 0. Collective.
///
/// # Errors
/// If the token cannot be written, or a rank does not see it within `timeout`.
pub fn check(
    comm: &dyn Communicator,
    files: &Files,
    lock: Option<&File>,
    timeout: Duration,
) -> Result<()> {
    if comm.size() == 1 {
        return Ok(());
    }
    let path = files.lock_path();
    let token = lock.map_or(0, |_| RandomState::new().hash_one(0));
    // The other ranks contribute 0, so the sum is a broadcast.
    let token = format!("{:016x}\n", comm::total(comm, token));
    let written = lock.map_or(Ok(()), |lock| write(lock, &token));
    agree(
        comm,
        written.map_err(|error| Error::file(&path, "write", &error)),
    )?;
    let found = if lock.is_some() || appears(&path, &token, timeout) {
        Ok(())
    } else {
        Err(Error::input(format!(
            "rank {} does not see the files of rank 0 in the output folder {}; the folder must be on a file \
             system that all nodes share; --output DIR writes elsewhere",
            comm.rank(),
            files.folder.display()
        )))
    };
    agree(comm, found)
}

/// Replace the contents of the lock file, and fsync it, so that other nodes see the contents.
fn write(mut lock: &File, token: &str) -> std::io::Result<()> {
    lock.set_len(0)?;
    lock.write_all(token.as_bytes())?;
    lock.sync_all()
}

/// Wait until a file contains the token. Return false if it does not within `timeout`.
fn appears(path: &Path, token: &str, timeout: Duration) -> bool {
    let begin = Instant::now();
    loop {
        if fs::read(path).is_ok_and(|bytes| bytes == token.as_bytes()) {
            return true;
        }
        if begin.elapsed() > timeout {
            return false;
        }
        std::thread::sleep(INTERVAL);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use crate::dimension::Dimension;
    use crate::problem::Problem;

    #[test]
    fn a_rank_in_another_folder_is_named() {
        let parent = std::env::temp_dir().join(format!("fissure-shared-{}", std::process::id()));
        let run = |of_rank_1: &str| {
            let results = threads::run(3, |comm| {
                let name = if comm.rank() == 1 { of_rank_1 } else { "a" };
                let problem = Problem::new(Dimension::PlaneStress { thickness: 1.0 }, 3.0, 1.0);
                let files = Files::new(&problem, parent.join(name));
                let lock = (comm.rank() == 0).then(|| files.lock().unwrap());
                let checked = check(comm, &files, lock.as_ref(), Duration::from_millis(200));
                checked.map_err(|error| error.message)
            });
            assert!(results.windows(2).all(|pair| pair[0] == pair[1]));
            results.into_iter().next().unwrap()
        };
        assert_eq!(run("a"), Ok(()));
        // The folder does not exist, and then has the lock file of another run.
        let missing = run("b").unwrap_err();
        fs::create_dir_all(parent.join("b")).unwrap();
        fs::copy(parent.join("a/.lock"), parent.join("b/.lock")).unwrap();
        let other = run("b").unwrap_err();
        fs::remove_dir_all(&parent).unwrap();
        for message in [missing, other] {
            let words = "rank 1 does not see the files of rank 0 in the output folder ";
            assert!(message.starts_with(words), "{message}");
        }
    }
}
