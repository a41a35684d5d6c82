//! Tuples of [`Lanes`], and columns of numbers. Loops read tuples from the columns, or add the quantities of
//! a tuple to the numbers in the columns.

use std::ops::{Deref, DerefMut};

use super::{Lanes, WIDTH};

/// Several quantities of eight bonds or points: an array or a matrix of [`Lanes`], or a pair of such tuples.
pub trait LaneTuple: Copy + Send + Sync {
    /// Number of quantities.
    const COUNT: usize;

    /// Whether quantities may lack a column; such quantities are read as 0.
    const PADDED: bool = false;

    /// One column per quantity, for reading values.
    type Columns<'a>: Copy + Send + Sync;

    /// One column per quantity, for adding values.
    type ColumnsMut<'a>: Send;

    /// Create the tuple by calling `value` with the index of each quantity.
    fn each(value: impl FnMut(usize) -> Lanes) -> Self;

    /// Return the quantity with this index.
    fn get(&self, quantity: usize) -> Lanes;

    /// Get a quantity for writing.
    fn get_mut(&mut self, quantity: usize) -> &mut Lanes;

    /// Select the first [`Self::COUNT`] columns, for reading values.
    ///
    /// # Panics
    /// - If there are fewer than [`Self::COUNT`] columns, and [`Self::PADDED`] is false.
    /// - If `Self` is a pair of tuples, and the first tuple has more quantities than there are columns.
    fn columns(all: &[impl Deref<Target = [f64]>]) -> Self::Columns<'_>;

    /// Select the first [`Self::COUNT`] columns, for adding values.
    ///
    /// # Panics
    /// If there are fewer than [`Self::COUNT`] columns.
    fn columns_mut(all: &mut [impl DerefMut<Target = [f64]>]) -> Self::ColumnsMut<'_>;

    /// Return the column of a quantity.
    fn column<'a>(columns: &Self::Columns<'a>, quantity: usize) -> &'a [f64];

    /// Split each column into the entries before `middle` and the entries from `middle` on.
    fn split_at(columns: Self::ColumnsMut<'_>, middle: usize) -> [Self::ColumnsMut<'_>; 2];

    /// Return the column of a quantity, for adding values.
    fn column_mut<'a>(columns: &'a mut Self::ColumnsMut<'_>, quantity: usize) -> &'a mut [f64];

    /// Test whether every column has at least `entries` entries. Quantities without a column
    /// ([`Self::PADDED`]) are ignored.
    fn covers(columns: &Self::Columns<'_>, entries: usize) -> bool {
        (0..Self::COUNT).all(|k| {
            let column = Self::column(columns, k);
            column.len() >= entries || Self::PADDED && column.is_empty()
        })
    }

    /// Load each quantity by calling `take` with the column of the quantity. Quantities without a column are
    /// 0.
    #[inline(always)]
    fn load(columns: &Self::Columns<'_>, take: impl Fn(&[f64]) -> Lanes) -> Self {
        Self::load_first::<Self>(columns, take)
    }

    /// Same as [`Self::load`], but read the first columns of a tuple of type `T`, which has at least as many
    /// quantities as `Self`.
    #[inline(always)]
    fn load_first<T: LaneTuple>(columns: &T::Columns<'_>, take: impl Fn(&[f64]) -> Lanes) -> Self {
        const { assert!(Self::COUNT <= T::COUNT) };
        Self::each(|k| {
            let column = T::column(columns, k);
            if T::PADDED && column.is_empty() {
                Lanes::splat(0.0)
            } else {
                take(column)
            }
        })
    }

    /// Create a tuple with the same value in all lanes.
    #[inline(always)]
    fn splat(value: f64) -> Self {
        Self::each(|_| Lanes::splat(value))
    }
}

impl<const N: usize> LaneTuple for [Lanes; N] {
    const COUNT: usize = N;
    type Columns<'a> = [&'a [f64]; N];
    type ColumnsMut<'a> = [&'a mut [f64]; N];

    #[inline(always)]
    fn each(mut value: impl FnMut(usize) -> Lanes) -> Self {
        let mut all = [Lanes::splat(0.0); N];
        for (k, lanes) in all.iter_mut().enumerate() {
            *lanes = value(k);
        }
        all
    }

    #[inline(always)]
    fn get(&self, quantity: usize) -> Lanes {
        self[quantity]
    }

    #[inline(always)]
    fn get_mut(&mut self, quantity: usize) -> &mut Lanes {
        &mut self[quantity]
    }

    fn columns(all: &[impl Deref<Target = [f64]>]) -> Self::Columns<'_> {
        std::array::from_fn(|k| &all[k][..])
    }

    fn columns_mut(all: &mut [impl DerefMut<Target = [f64]>]) -> Self::ColumnsMut<'_> {
        let mut all = all.iter_mut();
        std::array::from_fn(|_| &mut all.next().expect("a column for each quantity")[..])
    }

    #[inline(always)]
    fn column<'a>(columns: &Self::Columns<'a>, quantity: usize) -> &'a [f64] {
        columns[quantity]
    }

    fn split_at(columns: Self::ColumnsMut<'_>, middle: usize) -> [Self::ColumnsMut<'_>; 2] {
        let mut firsts = columns;
        let seconds = std::array::from_fn(|k| {
            let (first, second) = std::mem::take(&mut firsts[k]).split_at_mut(middle);
            firsts[k] = first;
            second
        });
        [firsts, seconds]
    }

    #[inline(always)]
    fn column_mut<'a>(columns: &'a mut Self::ColumnsMut<'_>, quantity: usize) -> &'a mut [f64] {
        columns[quantity]
    }
}

/// Quantities are numbered row by row.
impl<const N: usize, const M: usize> LaneTuple for [[Lanes; N]; M] {
    const COUNT: usize = N * M;
    type Columns<'a> = [[&'a [f64]; N]; M];
    type ColumnsMut<'a> = [[&'a mut [f64]; N]; M];

    #[inline(always)]
    fn each(mut value: impl FnMut(usize) -> Lanes) -> Self {
        let mut all = [[Lanes::splat(0.0); N]; M];
        for (row, rows) in all.iter_mut().enumerate() {
            for (k, lanes) in rows.iter_mut().enumerate() {
                *lanes = value(row * N + k);
            }
        }
        all
    }

    #[inline(always)]
    fn get(&self, quantity: usize) -> Lanes {
        self[quantity / N][quantity % N]
    }

    #[inline(always)]
    fn get_mut(&mut self, quantity: usize) -> &mut Lanes {
        &mut self[quantity / N][quantity % N]
    }

    fn columns(all: &[impl Deref<Target = [f64]>]) -> Self::Columns<'_> {
        std::array::from_fn(|row| <[Lanes; N]>::columns(&all[row * N..]))
    }

    fn columns_mut(all: &mut [impl DerefMut<Target = [f64]>]) -> Self::ColumnsMut<'_> {
        let mut rows = all.chunks_mut(N);
        std::array::from_fn(|_| {
            <[Lanes; N]>::columns_mut(rows.next().expect("a column for each quantity"))
        })
    }

    #[inline(always)]
    fn column<'a>(columns: &Self::Columns<'a>, quantity: usize) -> &'a [f64] {
        columns[quantity / N][quantity % N]
    }

    fn split_at(columns: Self::ColumnsMut<'_>, middle: usize) -> [Self::ColumnsMut<'_>; 2] {
        let mut firsts = columns;
        let seconds = std::array::from_fn(|row| {
            let own = std::mem::replace(&mut firsts[row], std::array::from_fn(|_| &mut [][..]));
            let [first, second] = <[Lanes; N]>::split_at(own, middle);
            firsts[row] = first;
            second
        });
        [firsts, seconds]
    }

    #[inline(always)]
    fn column_mut<'a>(columns: &'a mut Self::ColumnsMut<'_>, quantity: usize) -> &'a mut [f64] {
        columns[quantity / N][quantity % N]
    }
}

/// At most `N` quantities, for laws that are known only at run time. Quantities without a column are read as
/// 0.
#[derive(Debug, Clone, Copy)]
pub struct UpTo<const N: usize>([Lanes; N]);

impl<const N: usize> LaneTuple for UpTo<N> {
    const COUNT: usize = N;
    const PADDED: bool = true;
    type Columns<'a> = [&'a [f64]; N];
    type ColumnsMut<'a> = [&'a mut [f64]; N];

    #[inline(always)]
    fn each(value: impl FnMut(usize) -> Lanes) -> Self {
        Self(LaneTuple::each(value))
    }

    #[inline(always)]
    fn get(&self, quantity: usize) -> Lanes {
        self.0[quantity]
    }

    #[inline(always)]
    fn get_mut(&mut self, quantity: usize) -> &mut Lanes {
        &mut self.0[quantity]
    }

    fn columns(all: &[impl Deref<Target = [f64]>]) -> Self::Columns<'_> {
        std::array::from_fn(|k| all.get(k).map_or(&[][..], |column| &column[..]))
    }

    fn columns_mut(all: &mut [impl DerefMut<Target = [f64]>]) -> Self::ColumnsMut<'_> {
        <[Lanes; N]>::columns_mut(all)
    }

    #[inline(always)]
    fn column<'a>(columns: &Self::Columns<'a>, quantity: usize) -> &'a [f64] {
        columns[quantity]
    }

    fn split_at(columns: Self::ColumnsMut<'_>, middle: usize) -> [Self::ColumnsMut<'_>; 2] {
        <[Lanes; N]>::split_at(columns, middle)
    }

    #[inline(always)]
    fn column_mut<'a>(columns: &'a mut Self::ColumnsMut<'_>, quantity: usize) -> &'a mut [f64] {
        columns[quantity]
    }
}

impl<A: LaneTuple, B: LaneTuple> LaneTuple for (A, B) {
    const COUNT: usize = A::COUNT + B::COUNT;
    const PADDED: bool = A::PADDED || B::PADDED;
    type Columns<'a> = (A::Columns<'a>, B::Columns<'a>);
    type ColumnsMut<'a> = (A::ColumnsMut<'a>, B::ColumnsMut<'a>);

    #[inline(always)]
    fn each(mut value: impl FnMut(usize) -> Lanes) -> Self {
        let first = A::each(&mut value);
        (first, B::each(|k| value(A::COUNT + k)))
    }

    #[inline(always)]
    fn get(&self, quantity: usize) -> Lanes {
        if quantity < A::COUNT {
            self.0.get(quantity)
        } else {
            self.1.get(quantity - A::COUNT)
        }
    }

    #[inline(always)]
    fn get_mut(&mut self, quantity: usize) -> &mut Lanes {
        if quantity < A::COUNT {
            self.0.get_mut(quantity)
        } else {
            self.1.get_mut(quantity - A::COUNT)
        }
    }

    fn columns(all: &[impl Deref<Target = [f64]>]) -> Self::Columns<'_> {
        (A::columns(all), B::columns(&all[A::COUNT..]))
    }

    fn columns_mut(all: &mut [impl DerefMut<Target = [f64]>]) -> Self::ColumnsMut<'_> {
        let (first, second) = all.split_at_mut(A::COUNT);
        (A::columns_mut(first), B::columns_mut(second))
    }

    #[inline(always)]
    fn column<'a>(columns: &Self::Columns<'a>, quantity: usize) -> &'a [f64] {
        if quantity < A::COUNT {
            A::column(&columns.0, quantity)
        } else {
            B::column(&columns.1, quantity - A::COUNT)
        }
    }

    fn split_at(columns: Self::ColumnsMut<'_>, middle: usize) -> [Self::ColumnsMut<'_>; 2] {
        let [a, c] = A::split_at(columns.0, middle);
        let [b, d] = B::split_at(columns.1, middle);
        [(a, b), (c, d)]
    }

    #[inline(always)]
    fn column_mut<'a>(columns: &'a mut Self::ColumnsMut<'_>, quantity: usize) -> &'a mut [f64] {
        if quantity < A::COUNT {
            A::column_mut(&mut columns.0, quantity)
        } else {
            B::column_mut(&mut columns.1, quantity - A::COUNT)
        }
    }
}

/// Load eight consecutive numbers of a column.
///
/// # Safety
/// The column must have eight entries from `first` on.
#[inline(always)]
pub unsafe fn eight(column: &[f64], first: usize) -> Lanes {
    debug_assert!(first + WIDTH <= column.len());
    // SAFETY: the caller guarantees eight entries from `first` on.
    Lanes(unsafe { column.as_ptr().add(first).cast::<[f64; WIDTH]>().read() })
}

/// Load the numbers of a column at eight indices.
///
/// # Safety
/// The column must be longer than every index.
#[inline(always)]
pub unsafe fn gather(column: &[f64], indices: &[u32; WIDTH]) -> Lanes {
    let mut lanes = Lanes::splat(0.0);
    for (lane, index) in lanes.0.iter_mut().zip(indices) {
        debug_assert!((*index as usize) < column.len());
        // SAFETY: the caller guarantees that the column is longer than the index.
        *lane = unsafe { *column.get_unchecked(*index as usize) };
    }
    lanes
}
