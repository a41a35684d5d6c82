//! When ranks wait for the disc to confirm a result: not at outputs that have room, but where the file grows and
//! where that is asked for. A program of its own, in which a function of MPI is another one.

use std::os::raw::c_int;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use fissure::comm::Communicator;
use fissure::output::{Contents, Creation, FieldDescription, Piece, ResultFile};

use command::{Folder, is_rank};

#[allow(dead_code, reason = "the other tests use all of it")]
#[path = "support/command.rs"]
mod command;

static ASKED: AtomicUsize = AtomicUsize::new(0);

/// In the place of the MPI library's, which HDF5's call ends in.
#[unsafe(no_mangle)]
extern "C" fn PMPI_File_sync(_: mpi_sys::MPI_File) -> c_int {
    ASKED.fetch_add(1, Ordering::Relaxed);
    0
}

#[test]
fn outputs_that_have_room_do_not_wait_for_the_disc() {
    if !is_rank(2, "outputs_that_have_room_do_not_wait_for_the_disc") {
        return;
    }
    let world = fissure::run::start_mpi().unwrap();
    let folder = (world.rank() == 0).then(|| Folder::new("confirmation"));
    let path = folder.as_ref().map(|folder| folder.join("result.vtkhdf"));
    let mut path = path
        .unwrap_or_default()
        .into_os_string()
        .into_encoded_bytes();
    world.broadcast(0, &mut path);
    let path = PathBuf::from(String::from_utf8(path).unwrap());

    // Times that the disc was asked in the meantime.
    let asked = || ASKED.swap(0, Ordering::Relaxed);
    let rank = world.rank() as u64;
    let moving = [FieldDescription {
        name: "damage",
        unit: "",
        components: 1,
    }];
    let contents = Contents {
        piece: Piece {
            first: rank,
            total: 2,
        },
        changing: false,
        positions: &[[rank as f64, 0.0, 0.0]],
        fixed: &[],
        moving: &moving,
        metadata: &[],
        single: false,
        // As many as fill one chunk.
        steps: 512,
    };
    let mut file = ResultFile::create(&path, &world, Creation::Exclusive, &contents).unwrap();
    assert!(asked() > 0, "HDF5 does not find the program's own call");
    let mut step = 0;
    let mut write = |file: &mut ResultFile<'_>, count: u64| {
        for _ in 0..count {
            file.write_step(step as f64, step, |_| vec![0.5]).unwrap();
            step += 1;
        }
    };
    // The tables of steps get their first rows.
    write(&mut file, 1);
    asked();
    write(&mut file, 2);
    assert_eq!(asked(), 0);
    file.sync().unwrap();
    assert_eq!(asked(), 1);
    write(&mut file, 509);
    assert_eq!(asked(), 0);
    // More than were expected: the file grows.
    write(&mut file, 1);
    assert!(asked() > 0);
    file.close(true).unwrap();
    assert!(asked() > 0);
    world.sum(&mut [0]);
}
