//! The MPI communicator, between ranks started by `mpirun`.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::{Duration, Instant};

use fissure::comm::mpi::World;
use fissure::comm::{Communicator, PeerBuffers};
use rayon::ThreadPoolBuilder;

use crate::support::command::is_rank;
use crate::support::simulate_on;

/// Length of a message that waits for its receiver: larger than the eager limit of any MPI.
const LARGE: usize = 1 << 20;

#[test]
fn a_panic_during_an_exchange_leaves_nothing_under_way() {
    if !is_rank(
        2,
        "parallel::communicator::a_panic_during_an_exchange_leaves_nothing_under_way",
    ) {
        return;
    }
    let world = World::start().unwrap();
    let other = 1 - world.rank();
    let value = |rank: usize, turn: usize| (10 * turn + rank) as f64;
    for turn in 1..4 {
        let mut messages = [PeerBuffers {
            rank: other,
            send: vec![value(world.rank(), turn); LARGE],
            receive: vec![0.0; LARGE],
        }];
        let exchange = || world.exchange(&mut messages, &mut |_| panic!("on purpose"));
        assert!(catch_unwind(AssertUnwindSafe(exchange)).is_err());
        // No exchange uses the buffers any more, so they may be freed.
        let arrived = |found: &f64| *found == value(other, turn);
        assert!(messages[0].receive.iter().all(arrived));
    }
}

#[test]
fn large_messages_arrive_while_work_is_done() {
    if !is_rank(
        2,
        "parallel::communicator::large_messages_arrive_while_work_is_done",
    ) {
        return;
    }
    let world = World::start().unwrap();
    let mut messages = [PeerBuffers {
        rank: 1 - world.rank(),
        send: vec![world.rank() as f64; LARGE],
        receive: vec![-1.0; LARGE],
    }];
    let late = world.rank() == 1;
    if late {
        std::thread::sleep(Duration::from_millis(300));
    }
    world.exchange(&mut messages, &mut |progress| {
        assert!(late || progress(), "the other rank has not sent anything");
        let start = Instant::now();
        while progress() {
            assert!(start.elapsed() < Duration::from_secs(60), "nothing moves");
        }
    });
    let other = (1 - world.rank()) as f64;
    assert!(messages[0].receive.iter().all(|value| *value == other));
}

#[test]
fn ranks_may_have_nothing_to_gather() {
    if !is_rank(
        2,
        "parallel::communicator::ranks_may_have_nothing_to_gather",
    ) {
        return;
    }
    let world = World::start().unwrap();
    // The address of an empty vector of bytes equals `MPI_IN_PLACE` of Open MPI, so it must not be passed to
    // MPI.
    assert!(world.all_gather(&Vec::new()).is_empty());
    for giver in 0..2 {
        let own = if world.rank() == giver {
            vec![7, 8]
        } else {
            Vec::new()
        };
        assert_eq!(world.all_gather(&own), [7, 8]);
    }
    assert_eq!(world.all_gather(&[world.rank() as u8]), [0, 1]);
}

/// More than 4096 interior points on each of two ranks, so that the loops work on them in pieces.
const PLATE: &str = "
dimension = 'plane-stress'
grid = { volume_correction = 'none', spacing = 1, horizon = 3 }
material.rubber.LAW
damage.brittle.critical_stretch = { critical_stretch = 0.02, alpha = 0.25 }
body.plate = { material = 'rubber', damage = 'brittle', shape.box = { lower = [0, 0], upper = [120, 101] } }
initial.burst.velocity = ['0.02*sin(x)', '0.02*cos(y)']
time = { end = 3 }
";

#[test]
fn interior_bonds_in_pieces_give_the_same_bits() {
    for law in [
        "pmb = { density = 2, youngs_modulus = 5 }",
        "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }",
    ] {
        let deck = PLATE.replace("LAW", law);
        let displacements = |ranks| {
            let of_rank = simulate_on::<2, _>(ranks, &deck, |mut simulation| {
                // One thread per rank, so that the size of pieces does not depend on the machine.
                let pool = ThreadPoolBuilder::new().num_threads(1).use_current_thread();
                let _pool = pool.build().unwrap();
                for _ in 0..4 {
                    simulation.advance();
                }
                let model = &simulation.model;
                assert!(ranks == 1 || model.interior > 4096);
                let bits = |point: usize| {
                    let motion = &simulation.fields.displacement;
                    (model.ids[point], [0, 1].map(|d| motion[d][point].to_bits()))
                };
                (0..model.owned()).map(bits).collect::<Vec<_>>()
            });
            let mut all: Vec<_> = of_rank.into_iter().flatten().collect();
            all.sort_unstable();
            all
        };
        assert!(displacements(1) == displacements(2), "{law}");
    }
}
