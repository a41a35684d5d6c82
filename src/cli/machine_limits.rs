//! Limits of this machine: memory bandwidth and floating-point rate, measured on all threads of all ranks at
//! once.
//!
//! Each figure is the best of several repetitions, because other processes can only slow a repetition down.

use std::hint::black_box;
use std::time::Instant;

use fissure::comm::Communicator;

use super::launch;

/// Memory bandwidth and floating-point rate of all threads of this rank together. All ranks measure at the
/// same time.
#[derive(Clone, Copy)]
pub struct Limits {
    /// Memory bandwidth, bytes/s, measured with the triad a = b + s c. Here a, b and c are arrays, and s is a
    /// number. As in STREAM (McCalpin 1995), 24 bytes are counted per array entry.
    pub bandwidth: f64,
    /// Rate of floating-point operations with the widest vectors, 1/s. A multiply-add counts as two
    /// operations.
    pub arithmetic: f64,
}

/// Measure the memory bandwidth and the rate of floating-point operations. Collective.
pub fn measure(comm: &dyn Communicator, threads: usize) -> Limits {
    Limits {
        bandwidth: bandwidth(comm, threads),
        arithmetic: arithmetic(comm),
    }
}

/// Repetitions of each measurement.
const REPETITIONS: usize = 10;

/// Run `work` on all threads of all ranks at once, [`REPETITIONS`] times. Return the time of the slowest rank
/// in the fastest repetition, s. Collective.
fn seconds(comm: &dyn Communicator, work: impl Fn() + Sync) -> f64 {
    let once = |_| {
        // The sum acts as a barrier.
        comm.sum(&mut [0]);
        let start = Instant::now();
        rayon::broadcast(|_| work());
        let mut seconds = [start.elapsed().as_secs_f64()];
        comm.max(&mut seconds);
        seconds[0]
    };
    (0..REPETITIONS).map(once).fold(f64::INFINITY, f64::min)
}

/// Size of each array with which a thread measures the bandwidth, divided by the thread's share of the
/// last-level cache.
const CACHES: usize = 4;

fn bandwidth(comm: &dyn Communicator, threads: usize) -> f64 {
    let length = CACHES * share_of_cache(threads) / size_of::<f64>();
    thread_local! {
        static ARRAYS: std::cell::RefCell<[Vec<f64>; 3]> = const {
            std::cell::RefCell::new([const { Vec::new() }; 3])
        };
    }
    // Each thread is the first to write its arrays, so the system allocates the arrays in local memory.
    rayon::broadcast(|_| {
        ARRAYS.with_borrow_mut(|arrays| *arrays = [0.0, 1.0, 2.0].map(|value| vec![value; length]));
    });
    let seconds = seconds(comm, || {
        ARRAYS.with_borrow_mut(|[a, b, c]| triad(a, b, c, black_box(3.0)));
    });
    rayon::broadcast(|_| {
        ARRAYS.with_borrow_mut(|arrays| {
            assert!(arrays[0].iter().all(|entry| *entry == 7.0));
            *arrays = Default::default();
        });
    });
    24.0 * length as f64 * rayon::current_num_threads() as f64 / seconds
}

/// Return the size of the last-level cache per running thread, bytes: the size of the cache, divided by the
/// number of running threads that share the cache. `threads` is the number of threads of this rank. If the
/// size of the cache is unknown, assume 64 MiB.
fn share_of_cache(threads: usize) -> usize {
    let read = |name: &str| {
        let path = format!("/sys/devices/system/cpu/cpu0/cache/index3/{name}");
        std::fs::read_to_string(path).unwrap_or_default()
    };
    let size = read("size");
    let size = size.trim().strip_suffix('K');
    let kibibytes = size.and_then(|size| size.parse::<usize>().ok());
    let sharing = launch::cores_in(&read("shared_cpu_list"));
    let busy = threads * launch::ranks_on_host();
    kibibytes.unwrap_or(1 << 16) * 1024 / busy.min(sharing).max(1)
}

/// Compute a = b + s c.
fn triad(a: &mut [f64], b: &[f64], c: &[f64], s: f64) {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") {
            // SAFETY: the instruction set is available.
            return unsafe { triad_avx512(a, b, c, s) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the instruction set is available.
            return unsafe { triad_avx2(a, b, c, s) };
        }
    }
    triad_any(a, b, c, s);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn triad_avx512(a: &mut [f64], b: &[f64], c: &[f64], s: f64) {
    triad_any(a, b, c, s);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn triad_avx2(a: &mut [f64], b: &[f64], c: &[f64], s: f64) {
    triad_any(a, b, c, s);
}

#[inline(always)]
fn triad_any(a: &mut [f64], b: &[f64], c: &[f64], s: f64) {
    for ((a, b), c) in a.iter_mut().zip(b).zip(c) {
        *a = b + s * c;
    }
}

/// Number of independent sums. This number exceeds the latency (4 or 5 cycles) times the throughput (2 per
/// cycle) of multiply-adds. Therefore, no multiply-add waits for the result of another multiply-add.
const SUMS: usize = 12;

/// Multiply-adds per sum and repetition; a repetition takes some 30 ms.
const LENGTH: u32 = 8_000_000;

fn arithmetic(comm: &dyn Communicator) -> f64 {
    let (work, width) = multiply_adds();
    let seconds = seconds(comm, || work(black_box(0.999_999), black_box(1e-6)));
    let operations = 2.0 * f64::from(LENGTH) * SUMS as f64 * width as f64;
    operations * rayon::current_num_threads() as f64 / seconds
}

/// Return a function with [`LENGTH`] × [`SUMS`] multiply-adds in the widest vectors, and the number of lanes
/// of these vectors.
fn multiply_adds() -> (fn(f64, f64), usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use std::arch::x86_64::*;
        /// Return a function with [`LENGTH`] × [`SUMS`] multiply-adds for one instruction set.
        macro_rules! version {
            ($feature:literal, $splat:ident, $multiply_add:ident) => {{
                #[target_feature(enable = $feature)]
                fn work(factor: f64, term: f64) {
                    let (factor, term) = ($splat(factor), $splat(term));
                    let mut sums = [term; SUMS];
                    for _ in 0..LENGTH {
                        for sum in &mut sums {
                            *sum = $multiply_add(*sum, factor, term);
                        }
                    }
                    black_box(sums);
                }
                // SAFETY: the closure is returned only if the instruction set is available.
                |factor, term| unsafe { work(factor, term) }
            }};
        }
        if is_x86_feature_detected!("avx512f") {
            return (version!("avx512f", _mm512_set1_pd, _mm512_fmadd_pd), 8);
        }
        if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            return (version!("avx2,fma", _mm256_set1_pd, _mm256_fmadd_pd), 4);
        }
    }
    (multiply_adds_any, 2)
}

/// Perform [`LENGTH`] × [`SUMS`] multiplications and additions in two lanes, with instructions that every
/// processor has.
fn multiply_adds_any(factor: f64, term: f64) {
    let mut sums = [[term; 2]; SUMS];
    for _ in 0..LENGTH {
        for lane in sums.as_flattened_mut() {
            *lane = *lane * factor + term;
        }
    }
    black_box(sums);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_version_of_the_triad_is_the_triad() {
        let (b, c): (Vec<f64>, Vec<f64>) = (0..37).map(|k| (f64::from(k), 0.5)).unzip();
        let expected: Vec<f64> = b.iter().map(|b| b + 1.5).collect();
        for version in [triad, triad_any as fn(&mut [f64], &[f64], &[f64], f64)] {
            let mut a = vec![0.0; b.len()];
            version(&mut a, &b, &c, 3.0);
            assert_eq!(a, expected);
        }
    }
}
