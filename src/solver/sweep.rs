//! Running a kernel over the rows of a list, on all threads.
//!
//! A task owns a range of rows and the outputs of their points, so there is no lock and no atomic;
//! each point's sum is the same sequence of operations whatever the tasks are.

use std::ops::Range;

use crate::families::{BondList, Rows};

use super::kernels::Kernel;

/// Rows below which a range is not split further.
const LEAF: usize = 128;

/// Runs the kernel over a range of rows. `outputs` are over the owned points.
///
/// # Panics
/// When an array that the kernel reads is too short for the list's indices.
pub fn sweep<K: Kernel>(
    list: &mut BondList,
    rows: Range<usize>,
    outputs: &mut [K::Output],
    kernel: &K,
) {
    assert!(
        list.reach() <= kernel.points(),
        "an array is too short for the bonds"
    );
    let leaf = match rayon::current_num_threads() {
        1 => usize::MAX,
        _ => LEAF,
    };
    split(list.rows(rows), 0, outputs, kernel, leaf);
}

/// Halves the rows until a task is small; `base` is the local index of the first output.
fn split<K: Kernel>(
    rows: Rows<'_>,
    base: usize,
    outputs: &mut [K::Output],
    kernel: &K,
    leaf: usize,
) {
    if rows.len() <= leaf {
        return run(rows, base, outputs, kernel);
    }
    let half = rows.len() / 2;
    let border = rows.point(half);
    let (rows_a, rows_b) = rows.split_at(half);
    let (outputs_a, outputs_b) = outputs.split_at_mut(border - base);
    rayon::join(
        || split(rows_a, base, outputs_a, kernel, leaf),
        || split(rows_b, border, outputs_b, kernel, leaf),
    );
}

/// Runs with the widest vectors of this machine. Operations are never contracted to fused ones, so
/// the results are the same to the bit with any.
fn run<K: Kernel>(rows: Rows<'_>, base: usize, outputs: &mut [K::Output], kernel: &K) {
    #[cfg(target_arch = "x86_64")]
    if K::HOT {
        if has_avx512() {
            // SAFETY: the machine has the instructions.
            return unsafe { run_avx512(rows, base, outputs, kernel) };
        }
        if has_avx2() {
            // SAFETY: the machine has the instructions.
            return unsafe { run_avx2(rows, base, outputs, kernel) };
        }
    }
    run_any(rows, base, outputs, kernel);
}

#[cfg(target_arch = "x86_64")]
fn has_avx512() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl")
        && is_x86_feature_detected!("avx512bw")
        && has_avx2()
}

#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2") && is_x86_feature_detected!("bmi2")
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw,avx2,bmi2")]
fn run_avx512<K: Kernel>(rows: Rows<'_>, base: usize, outputs: &mut [K::Output], kernel: &K) {
    run_any(rows, base, outputs, kernel);
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi2")]
fn run_avx2<K: Kernel>(rows: Rows<'_>, base: usize, outputs: &mut [K::Output], kernel: &K) {
    run_any(rows, base, outputs, kernel);
}

#[inline(always)]
fn run_any<K: Kernel>(mut rows: Rows<'_>, base: usize, outputs: &mut [K::Output], kernel: &K) {
    for k in 0..rows.len() {
        let row = rows.row(k);
        let output = &mut outputs[row.point - base];
        // SAFETY: `sweep` has checked that every array is longer than any index of the list.
        unsafe { kernel.row(row, output) };
    }
}
