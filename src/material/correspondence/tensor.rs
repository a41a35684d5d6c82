//! Tensors of one point or of eight bonds. A generic type serves both, so each formula is written only once.

use std::ops::{Add, Mul};

use nalgebra::SMatrix;

use crate::lanes::Lanes;

/// A number, or eight numbers.
pub trait Number: Copy + Add<Output = Self> + Mul<Output = Self> + Mul<f64, Output = Self> {
    /// Convert a number to this type. If the type holds eight numbers, all of them are `value`.
    fn of(value: f64) -> Self;
}

impl Number for f64 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }
}

impl Number for Lanes {
    #[inline(always)]
    fn of(value: f64) -> Self {
        Self::splat(value)
    }
}

/// Tensor entries, row by row.
pub type Tensor<T, const D: usize> = [[T; D]; D];

/// Create a tensor from a function of row and column.
#[inline(always)]
pub fn tensor<T: Number, const D: usize>(entry: impl Fn(usize, usize) -> T) -> Tensor<T, D> {
    let mut all = [[T::of(0.0); D]; D];
    for a in 0..D {
        for b in 0..D {
            all[a][b] = entry(a, b);
        }
    }
    all
}

/// Return the rows of a matrix.
pub fn rows<const D: usize>(matrix: &SMatrix<f64, D, D>) -> Tensor<f64, D> {
    tensor(|a, b| matrix[(a, b)])
}

/// Create a matrix from its rows.
pub fn matrix<const D: usize>(rows: &Tensor<f64, D>) -> SMatrix<f64, D, D> {
    SMatrix::from_fn(|a, b| rows[a][b])
}

/// Return A : B.
#[inline(always)]
pub fn contracted<T: Number, const D: usize>(left: &Tensor<T, D>, right: &Tensor<T, D>) -> T {
    let mut sum = T::of(0.0);
    for a in 0..D {
        for b in 0..D {
            sum = sum + left[a][b] * right[a][b];
        }
    }
    sum
}
