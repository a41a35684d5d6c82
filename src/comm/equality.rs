//! Comparison of a value that each rank has read or received for itself.

use std::fmt::{self, Debug, Write};
use std::hash::{DefaultHasher, Hasher};

use super::{Communicator, all_gather};
use crate::error::{Error, Result};

/// Check that a value is equal on all ranks. The ranks compare hashes of its `Debug` listing. `name` is the
/// value and `rule` what the user must do, for the message. Collective.
///
/// # Errors
/// If the value of a rank differs from that of rank 0. The message names the lowest such rank; the error is
/// the same on all ranks.
pub fn check_equal(
    comm: &dyn Communicator,
    value: &impl Debug,
    name: &str,
    rule: &str,
) -> Result<()> {
    if comm.size() == 1 {
        return Ok(());
    }
    let hashes = all_gather(comm, hash(value));
    match hashes.iter().position(|hash| *hash != hashes[0]) {
        None => Ok(()),
        Some(rank) => Err(Error::input(format!(
            "rank {rank} has another {name} than rank 0; {rule}"
        ))),
    }
}

/// Hash the `Debug` listing of a value, without storing the listing.
fn hash(value: &impl Debug) -> u64 {
    struct Listing(DefaultHasher);

    impl Write for Listing {
        fn write_str(&mut self, text: &str) -> fmt::Result {
            self.0.write(text.as_bytes());
            Ok(())
        }
    }

    let mut listing = Listing(DefaultHasher::new());
    write!(listing, "{value:?}").expect("the hash accepts any text");
    listing.0.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;

    #[test]
    fn all_ranks_name_the_lowest_rank_that_differs() {
        let check = |values: [f64; 4]| {
            threads::run(4, move |comm| {
                let value = values[comm.rank()];
                let checked = check_equal(comm, &value, "step", "give one step");
                checked.map_err(|error| error.message)
            })
        };
        for result in check([0.1; 4]) {
            assert_eq!(result, Ok(()));
        }
        for result in check([0.1, 0.1, 0.1 + 1e-16, 0.2]) {
            let message = "rank 2 has another step than rank 0; give one step";
            assert_eq!(result, Err(message.to_owned()));
        }
    }
}
