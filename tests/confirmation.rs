//! Calls of fsync on a result. Outputs into preallocated space make no call. Calls occur when the file is
//! created, grows or is closed, and on request. This is a separate test program, because it replaces a
//! function of MPI.

use std::os::raw::c_int;
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};

use fissure::comm::Communicator;
use fissure::output::{Contents, Creation, FieldDescription, Number, Piece, ResultFile};

use command::{Folder, is_rank};

#[allow(dead_code, reason = "the other tests use all of it")]
#[path = "support/command.rs"]
mod command;

static ASKED: AtomicUsize = AtomicUsize::new(0);

/// Replacement of the function of the MPI library that HDF5 calls to flush a file.
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

    // Return the number of calls since the last query.
    let asked = || ASKED.swap(0, Ordering::Relaxed);
    let rank = world.rank() as u64;
    let moving = [FieldDescription {
        name: "damage",
        unit: "",
        components: 1,
        number: Number::F64,
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
        // The number of steps that fills one chunk.
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
    // The first output also writes the first rows of the tables of steps.
    write(&mut file, 1);
    asked();
    write(&mut file, 2);
    assert_eq!(asked(), 0);
    file.sync().unwrap();
    assert_eq!(asked(), 1);
    write(&mut file, 509);
    assert_eq!(asked(), 0);
    // One output more than expected: the file grows.
    write(&mut file, 1);
    assert!(asked() > 0);
    file.close(true).unwrap();
    assert!(asked() > 0);
    world.sum(&mut [0]);
}
