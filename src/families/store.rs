//! What is kept of bonds, by groups of eight: whether they are intact, whether they can break, and the
//! numbers that laws declare. Lists and lattices share it; they differ in what a group is.

use std::ops::Range;

use crate::lanes::{Lanes, WIDTH};

/// What is kept of all bonds of one storage.
#[derive(Debug, Clone, Default)]
pub struct Store {
    /// One bit a bond, clear where it is broken or there is none.
    pub(super) intact: Vec<u8>,
    /// One bit a bond, clear where it can never break; all can break if there is none.
    pub(super) breakable: Option<Vec<u8>>,
    /// So many numbers a bond.
    width: usize,
    /// Group by group, `width` each.
    numbers: Vec<Lanes>,
}

/// A range of groups that can be split between threads.
pub struct Groups<'a> {
    /// See [`Store`].
    pub intact: &'a mut [u8],
    /// See [`Store`].
    pub breakable: Option<&'a [u8]>,
    width: usize,
    numbers: &'a mut [Lanes],
}

impl Store {
    /// Gives every bond so many numbers, which are 0.
    pub fn allocate_history(&mut self, width: usize) {
        self.width = width;
        self.numbers = vec![Lanes::splat(0.0); width * self.intact.len()];
    }

    /// Bytes that so many numbers a bond take.
    pub fn history_bytes(&self, width: usize) -> u64 {
        (width * self.intact.len() * size_of::<Lanes>()) as u64
    }

    /// Some of the groups.
    pub fn groups(&mut self, range: Range<usize>) -> Groups<'_> {
        let numbers = self.width * range.start..self.width * range.end;
        Groups {
            breakable: self.breakable.as_ref().map(|bits| &bits[range.clone()]),
            intact: &mut self.intact[range],
            width: self.width,
            numbers: &mut self.numbers[numbers],
        }
    }

    /// Bytes that [`Self::save_numbers`] takes a bond.
    pub fn number_bytes(&self) -> usize {
        size_of::<f64>() * self.width
    }

    /// Copies the numbers of a bond to bytes.
    pub fn save_numbers(&self, group: usize, lane: usize, bytes: &mut [u8]) {
        for (k, bytes) in bytes.chunks_exact_mut(size_of::<f64>()).enumerate() {
            bytes.copy_from_slice(&self.numbers[self.width * group + k].0[lane].to_le_bytes());
        }
    }

    /// Takes the numbers of a bond from bytes.
    pub fn restore_numbers(&mut self, group: usize, lane: usize, bytes: &[u8]) {
        for (k, bytes) in bytes.chunks_exact(size_of::<f64>()).enumerate() {
            let bytes = bytes.try_into().expect("eight bytes");
            self.numbers[self.width * group + k].0[lane] = f64::from_le_bytes(bytes);
        }
    }

    /// What a step can change, to be put back by [`Self::undo`].
    pub fn keep(&self, kept: &mut (Vec<u8>, Vec<Lanes>)) {
        kept.0.clone_from(&self.intact);
        kept.1.clone_from(&self.numbers);
    }

    /// Puts back what [`Self::keep`] took.
    pub fn undo(&mut self, kept: &(Vec<u8>, Vec<Lanes>)) {
        self.intact.copy_from_slice(&kept.0);
        self.numbers.copy_from_slice(&kept.1);
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        let breakable = self.breakable.as_ref().map_or(0, Vec::len);
        self.intact.len() + breakable + size_of_val(&self.numbers[..])
    }
}

impl<'a> Groups<'a> {
    /// The groups before one of them, and those from it on.
    pub fn split_at(self, group: usize) -> [Self; 2] {
        let (intact_a, intact_b) = self.intact.split_at_mut(group);
        let breakable = self.breakable.map(|bits| bits.split_at(group));
        let (numbers_a, numbers_b) = self.numbers.split_at_mut(self.width * group);
        let part = |intact, breakable, numbers| Self {
            intact,
            breakable,
            width: self.width,
            numbers,
        };
        [
            part(intact_a, breakable.map(|(a, _)| a), numbers_a),
            part(intact_b, breakable.map(|(_, b)| b), numbers_b),
        ]
    }

    /// Some of the groups.
    #[inline(always)]
    pub fn range(&mut self, range: Range<usize>) -> Groups<'_> {
        let numbers = self.width * range.start..self.width * range.end;
        Groups {
            breakable: self.breakable.map(|bits| &bits[range.clone()]),
            intact: &mut self.intact[range],
            width: self.width,
            numbers: &mut self.numbers[numbers],
        }
    }

    /// The numbers of a group.
    #[inline(always)]
    pub fn numbers(&mut self, group: usize) -> &mut [Lanes] {
        &mut self.numbers[self.width * group..self.width * (group + 1)]
    }
}

/// Bytes that the bits of so many bonds take.
pub(super) fn bit_bytes(bonds: usize) -> usize {
    bonds.div_ceil(WIDTH)
}
