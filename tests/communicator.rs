//! The communicator of a real run, between ranks that `mpirun` starts.

use std::panic::{AssertUnwindSafe, catch_unwind};

use fissure::comm::mpi::World;
use fissure::comm::{Communicator, Message};

use crate::support::command::is_rank;

/// Numbers of a message that waits for its receiver: larger than what any MPI sends at once.
const LARGE: usize = 1 << 20;

#[test]
fn a_panic_during_an_exchange_leaves_nothing_under_way() {
    if !is_rank(
        2,
        "communicator::a_panic_during_an_exchange_leaves_nothing_under_way",
    ) {
        return;
    }
    let world = World::start().unwrap();
    let other = 1 - world.rank();
    let value = |rank: usize, turn: usize| (10 * turn + rank) as f64;
    for turn in 1..4 {
        let mut messages = [Message {
            rank: other,
            send: vec![value(world.rank(), turn); LARGE],
            receive: vec![0.0; LARGE],
        }];
        let exchange = || world.exchange(&mut messages, &mut || panic!("on purpose"));
        assert!(catch_unwind(AssertUnwindSafe(exchange)).is_err());
        // Whoever frees the buffers now has them alone.
        let arrived = |found: &f64| *found == value(other, turn);
        assert!(messages[0].receive.iter().all(arrived));
    }
}
