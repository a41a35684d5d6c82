//! The communicator of MPI runs: `MPI_COMM_WORLD`.
//!
//! Only the thread that created the [`World`] may use it (`MPI_THREAD_FUNNELED`). The only exception is
//! [`abort_on_panic`]: the thread that panics aborts the job.

use std::cell::{RefCell, RefMut};
use std::ffi::c_void;
use std::marker::PhantomData;
use std::os::raw::c_int;

use mpi::collective::SystemOperation;
use mpi::datatype::PartitionMut;
use mpi::environment::Universe;
use mpi::topology::{Communicator as _, SimpleCommunicator};
use mpi::traits::*;
use mpi_sys::{MPI_Request, RSMPI_COMM_WORLD};

use super::{Communicator, During, PeerBuffers, RawCommunicator};
use crate::error::{Error, Result};

/// Maximum size of an MPI message, bytes. The limit is needed because MPI counts are 32-bit integers.
const LARGEST_MESSAGE: usize = 1 << 30;
const HALO_TAG: c_int = 1;
const SET_UP_TAG: c_int = 2;

// Cargo does not rebuild `mpi-sys` when the MPI library changes, so check that the bindings fit the library.
const _: () = assert!(
    OF_OPEN_MPI == cfg!(open_mpi),
    "the target folder holds bindings to another MPI: take one folder for each (--target-dir), or \
     run `cargo clean -p mpi-sys`"
);

/// Whether `mpi-sys` was built for Open MPI.
const OF_OPEN_MPI: bool = {
    // If the bindings belong to Open MPI, their `OMPI_MAJOR_VERSION` shadows the constant of the same name
    // below, which is 0.
    #[allow(unused_imports)]
    use mpi_sys::*;
    OMPI_MAJOR_VERSION > 0
};
#[allow(dead_code)]
const OMPI_MAJOR_VERSION: u32 = 0;

/// Test whether MPI is running in this process.
pub fn is_running() -> bool {
    mpi::environment::is_initialized()
}

/// From now on, a panic on any thread aborts all ranks with exit code 1 after its message is printed. Without
/// this, the other ranks would wait for the rank that panicked. MPI must be running.
pub fn abort_on_panic() {
    let print = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        print(panic);
        SimpleCommunicator::world().abort(1);
    }));
}

/// Name and version of the MPI library. MPI does not have to be running.
pub fn library() -> String {
    let text = mpi::environment::library_version().unwrap_or_default();
    name_and_version(&text)
}

/// The name and version at the start of an MPI version string, such as `Open MPI v4.1.4, package: …`.
fn name_and_version(text: &str) -> String {
    let line = text.lines().next().unwrap_or_default();
    let beginning = line.split(',').next().unwrap_or_default();
    let words = beginning
        .split_whitespace()
        .filter(|word| *word != "Version:");
    words.collect::<Vec<_>>().join(" ")
}

/// All ranks that `mpirun` started; one rank without `mpirun`.
///
/// `World` is not `Send`, even if all handles of the MPI library are `Send`. Therefore this code does not
/// compile:
///
/// ```compile_fail,E0277
/// fn move_to_a_thread<T: Send>() {}
/// move_to_a_thread::<fissure::comm::mpi::World>();
/// ```
pub struct World {
    world: SimpleCommunicator,
    /// Request handles, whose memory is reused so that exchanges in the time loop do not allocate.
    requests: RefCell<Vec<MPI_Request>>,
    _not_send: PhantomData<*const ()>,
    // This field is dropped last, because its drop calls `MPI_Finalize`.
    _universe: Universe,
}

impl World {
    /// Start MPI.
    ///
    /// # Errors
    /// If MPI is already running in this process or lacks `MPI_THREAD_FUNNELED`.
    pub fn start() -> Result<Self> {
        let (universe, level) = mpi::initialize_with_threading(mpi::Threading::Funneled)
            .ok_or_else(|| Error::run("MPI is already running in this process"))?;
        if level < mpi::Threading::Funneled {
            return Err(Error::run(
                "this MPI library has no support for threads (MPI_THREAD_FUNNELED)",
            ));
        }
        Ok(Self {
            world: universe.world(),
            requests: RefCell::default(),
            _not_send: PhantomData,
            _universe: universe,
        })
    }

    /// Borrow the vector of requests. This vector is empty, because all earlier requests have completed.
    fn in_flight(&self) -> InFlight<'_> {
        InFlight(self.requests.borrow_mut())
    }

    /// Number of hosts on which ranks run. Collective.
    pub fn hosts(&self) -> usize {
        let name = mpi::environment::processor_name().unwrap_or_default();
        let outgoing = (0..self.size())
            .map(|q| {
                if q == 0 {
                    name.clone().into_bytes()
                } else {
                    Vec::new()
                }
            })
            .collect();
        let mut names = self.all_to_all(outgoing);
        names.sort();
        names.dedup();
        let mut count = [if self.rank() == 0 {
            names.len() as u64
        } else {
            0
        }];
        self.sum(&mut count);
        count[0] as usize
    }
}

/// Non-blocking messages in flight. Dropping the value waits for all messages, also during unwinding, so MPI
/// never accesses a freed buffer.
struct InFlight<'a>(RefMut<'a, Vec<MPI_Request>>);

impl InFlight<'_> {
    /// Start a send.
    ///
    /// # Safety
    /// The bytes must stay valid and unchanged until `self` is dropped. `self` must be dropped, because the
    /// drop waits for the message.
    unsafe fn send(&mut self, bytes: &[u8], rank: usize, tag: c_int) {
        for chunk in bytes.chunks(LARGEST_MESSAGE) {
            // SAFETY: the caller keeps the chunk valid, and its length fits a C integer. MPI aborts the job
            // on an invalid rank or call.
            self.0.push(unsafe {
                let mut request = mpi_sys::RSMPI_REQUEST_NULL;
                mpi_sys::MPI_Isend(
                    chunk.as_ptr().cast::<c_void>(),
                    chunk.len() as c_int,
                    mpi_sys::RSMPI_UINT8_T,
                    rank as c_int,
                    tag,
                    RSMPI_COMM_WORLD,
                    &mut request,
                );
                request
            });
        }
    }

    /// Start a receive.
    ///
    /// # Safety
    /// The bytes must stay valid, and must not be accessed, until `self` is dropped. `self` must be dropped,
    /// because the drop waits for the message.
    unsafe fn receive(&mut self, bytes: &mut [u8], rank: usize, tag: c_int) {
        for chunk in bytes.chunks_mut(LARGEST_MESSAGE) {
            // SAFETY: the caller keeps the chunk valid and unaccessed, and its length fits a C integer. MPI
            // aborts the job if a message is longer than the chunk.
            self.0.push(unsafe {
                let mut request = mpi_sys::RSMPI_REQUEST_NULL;
                mpi_sys::MPI_Irecv(
                    chunk.as_mut_ptr().cast::<c_void>(),
                    chunk.len() as c_int,
                    mpi_sys::RSMPI_UINT8_T,
                    rank as c_int,
                    tag,
                    RSMPI_COMM_WORLD,
                    &mut request,
                );
                request
            });
        }
    }

    /// Drive progress; return true while any message is in flight.
    fn advance(&mut self) -> bool {
        let count = self.0.len() as c_int;
        let mut arrived = 0;
        // SAFETY: the array has `count` requests that MPI created; completed requests are null.
        unsafe {
            mpi_sys::MPI_Testall(
                count,
                self.0.as_mut_ptr(),
                &mut arrived,
                mpi_sys::RSMPI_STATUSES_IGNORE,
            );
        }
        arrived == 0
    }
}

impl Drop for InFlight<'_> {
    fn drop(&mut self) {
        let count = self.0.len() as c_int;
        // SAFETY: the array has `count` requests that MPI created; completed requests are null.
        unsafe {
            mpi_sys::MPI_Waitall(count, self.0.as_mut_ptr(), mpi_sys::RSMPI_STATUSES_IGNORE);
        }
        self.0.clear();
    }
}

impl Communicator for World {
    fn rank(&self) -> usize {
        self.world.rank() as usize
    }

    fn size(&self) -> usize {
        self.world.size() as usize
    }

    fn sum(&self, values: &mut [u64]) {
        let own = values.to_vec();
        self.world
            .all_reduce_into(&own[..], values, SystemOperation::sum());
    }

    fn max(&self, values: &mut [f64]) {
        let own = values.to_vec();
        self.world
            .all_reduce_into(&own[..], values, SystemOperation::max());
    }

    fn broadcast(&self, root: usize, data: &mut Vec<u8>) {
        let process = self.world.process_at_rank(root as i32);
        let mut length = data.len() as u64;
        process.broadcast_into(&mut length);
        data.resize(length as usize, 0);
        for chunk in data.chunks_mut(LARGEST_MESSAGE) {
            process.broadcast_into(chunk);
        }
    }

    fn all_to_all(&self, outgoing: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        assert_eq!(outgoing.len(), self.size(), "one message for each rank");
        let sizes: Vec<u64> = outgoing.iter().map(|bytes| bytes.len() as u64).collect();
        let mut incoming_sizes = vec![0_u64; self.size()];
        self.world
            .all_to_all_into(&sizes[..], &mut incoming_sizes[..]);
        let mut incoming: Vec<Vec<u8>> = incoming_sizes
            .iter()
            .map(|size| vec![0; *size as usize])
            .collect();
        let mut in_flight = self.in_flight();
        for (rank, bytes) in incoming.iter_mut().enumerate() {
            // SAFETY: `incoming` outlives `in_flight` and is not accessed before its drop.
            unsafe { in_flight.receive(bytes, rank, SET_UP_TAG) };
        }
        for (rank, bytes) in outgoing.iter().enumerate() {
            // SAFETY: `outgoing` outlives `in_flight` and is not changed before its drop.
            unsafe { in_flight.send(bytes, rank, SET_UP_TAG) };
        }
        drop(in_flight);
        incoming
    }

    fn all_gather(&self, own: &[u8]) -> Vec<u8> {
        let mut sizes = vec![0_u64; self.size()];
        self.world
            .all_gather_into(&(own.len() as u64), &mut sizes[..]);
        let mut all = vec![0; sizes.iter().sum::<u64>() as usize];
        if all.is_empty() {
            return all;
        }
        // An empty slice may have the address 1, which is `MPI_IN_PLACE` in Open MPI.
        let own = if own.is_empty() { &[0; 1][..0] } else { own };
        if all.len() <= LARGEST_MESSAGE {
            let counts: Vec<c_int> = sizes.iter().map(|size| *size as c_int).collect();
            let starts: Vec<c_int> = counts
                .iter()
                .scan(0, |end, count| {
                    *end += count;
                    Some(*end - count)
                })
                .collect();
            let mut parts = PartitionMut::new(&mut all[..], counts, starts);
            self.world.all_gather_varcount_into(own, &mut parts);
            return all;
        }
        // The byte offsets of a single call may not fit in 32 bits, so each rank broadcasts its part.
        let mut rest = &mut all[..];
        for (rank, size) in sizes.into_iter().enumerate() {
            let (part, others) = rest.split_at_mut(size as usize);
            rest = others;
            if rank == self.rank() {
                part.copy_from_slice(own);
            }
            let process = self.world.process_at_rank(rank as i32);
            for chunk in part.chunks_mut(LARGEST_MESSAGE) {
                process.broadcast_into(chunk);
            }
        }
        all
    }

    fn exchange(&self, buffers: &mut [PeerBuffers], during: &mut During<'_>) {
        let mut in_flight = self.in_flight();
        for peer in buffers.iter_mut() {
            let bytes = bytemuck::cast_slice_mut(&mut peer.receive);
            // SAFETY: `buffers` outlives `in_flight`, is borrowed exclusively by this function, and is not
            // accessed before the drop.
            unsafe { in_flight.receive(bytes, peer.rank, HALO_TAG) };
        }
        for peer in buffers.iter() {
            let bytes = bytemuck::cast_slice(&peer.send);
            // SAFETY: `buffers` outlives `in_flight`, and its send parts are not changed before the drop.
            unsafe { in_flight.send(bytes, peer.rank, HALO_TAG) };
        }
        during(&mut || in_flight.advance());
        // The drop waits for all messages. If `during` panics, the implicit drop waits.
        drop(in_flight);
    }

    fn raw(&self) -> Option<RawCommunicator> {
        // SAFETY: reads a constant of the MPI library.
        Some(unsafe { RSMPI_COMM_WORLD })
    }
}

#[cfg(test)]
mod tests {
    use std::process::{Command, Stdio};

    use super::*;

    /// Environment variable that is set in the child process of [`a_panic_on_any_thread_ends_the_process`].
    const CHILD: &str = "FISSURE_TEST_PANIC";

    #[test]
    fn a_panic_on_any_thread_ends_the_process() {
        if std::env::var_os(CHILD).is_some() {
            let _world = World::start().unwrap();
            abort_on_panic();
            let panicked = std::thread::spawn(|| panic!("on purpose")).join();
            unreachable!("the thread ended with {panicked:?}");
        }
        let name = std::thread::current().name().unwrap().to_owned();
        let child = Command::new(std::env::current_exe().unwrap())
            .args([&name, "--exact", "--nocapture"])
            .env(CHILD, "1")
            .stdout(Stdio::null())
            .output()
            .unwrap();
        assert_eq!(child.status.code(), Some(1));
        let errors = String::from_utf8_lossy(&child.stderr);
        assert!(errors.contains("on purpose"), "{errors}");
        assert!(!errors.contains("the thread ended"), "{errors}");
    }

    #[test]
    fn library_names_and_versions() {
        for (text, name) in [
            (
                "Open MPI v4.1.4, package: Debian OpenMPI, ident: 4.1.4",
                "Open MPI v4.1.4",
            ),
            (
                "MPICH Version:\t4.0.2\nMPICH Release date:\tThu Apr  7",
                "MPICH 4.0.2",
            ),
            (
                "Intel(R) MPI Library 2021.8 for Linux* OS\n",
                "Intel(R) MPI Library 2021.8 for Linux* OS",
            ),
        ] {
            assert_eq!(name_and_version(text), name);
        }
    }
}
