//! The state of bonds in groups of eight: intact bits, breakable bits, and the bond history of the law. A
//! group contains eight bonds of one point in a list, or the bonds of eight points at one offset in a
//! lattice.

use std::ops::Range;

use crate::lanes::{Lanes, WIDTH};

/// The state of all bonds of a list or lattice.
#[derive(Debug, Clone, Default)]
pub struct Store {
    /// One bit per bond, clear if the bond is broken or absent.
    pub(super) intact: Vec<u8>,
    /// One bit per bond, clear if the bond is unbreakable; `None` if all bonds can break.
    pub(super) breakable: Option<Vec<u8>>,
    /// Number of history values per bond.
    width: usize,
    /// History values of the bonds: `width` entries per group. Each entry has one lane per bond of the group.
    history: Vec<Lanes>,
}

/// A range of groups that can be split between threads.
pub struct Groups<'a> {
    /// One bit per bond, clear if the bond is broken or absent.
    pub intact: &'a mut [u8],
    /// One bit per bond, clear if the bond is unbreakable; `None` if all bonds can break.
    pub breakable: Option<&'a [u8]>,
    width: usize,
    history: &'a mut [Lanes],
}

impl Store {
    /// Allocate `width` history values per bond, set to 0.
    pub fn allocate_history(&mut self, width: usize) {
        self.width = width;
        self.history = vec![Lanes::splat(0.0); width * self.intact.len()];
    }

    /// Memory of `width` history values per bond, bytes.
    pub fn history_bytes(&self, width: usize) -> u64 {
        (width * self.intact.len() * size_of::<Lanes>()) as u64
    }

    /// Return the groups whose indices are in `range`.
    pub fn groups(&mut self, range: Range<usize>) -> Groups<'_> {
        let history = self.width * range.start..self.width * range.end;
        Groups {
            breakable: self.breakable.as_ref().map(|bits| &bits[range.clone()]),
            intact: &mut self.intact[range],
            width: self.width,
            history: &mut self.history[history],
        }
    }

    /// Bytes that [`Self::save_history`] writes per bond.
    pub fn history_bytes_per_bond(&self) -> usize {
        size_of::<f64>() * self.width
    }

    /// Write the history of a bond to bytes.
    pub fn save_history(&self, group: usize, lane: usize, bytes: &mut [u8]) {
        for (k, bytes) in bytes.chunks_exact_mut(size_of::<f64>()).enumerate() {
            bytes.copy_from_slice(&self.history[self.width * group + k].0[lane].to_le_bytes());
        }
    }

    /// Read the history of a bond from bytes.
    pub fn restore_history(&mut self, group: usize, lane: usize, bytes: &[u8]) {
        for (k, bytes) in bytes.chunks_exact(size_of::<f64>()).enumerate() {
            let bytes = bytes.try_into().expect("eight bytes");
            self.history[self.width * group + k].0[lane] = f64::from_le_bytes(bytes);
        }
    }

    /// Copy the intact bits and the history to `saved`, for [`Self::undo`]. A step changes no other part of
    /// the store.
    pub fn keep(&self, saved: &mut (Vec<u8>, Vec<Lanes>)) {
        saved.0.clone_from(&self.intact);
        saved.1.clone_from(&self.history);
    }

    /// Restore the state that [`Self::keep`] copied.
    pub fn undo(&mut self, saved: &(Vec<u8>, Vec<Lanes>)) {
        self.intact.copy_from_slice(&saved.0);
        self.history.copy_from_slice(&saved.1);
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        let breakable = self.breakable.as_ref().map_or(0, Vec::len);
        self.intact.len() + breakable + size_of_val(&self.history[..])
    }
}

impl<'a> Groups<'a> {
    /// Split before `group`.
    pub fn split_at(self, group: usize) -> [Self; 2] {
        let (intact_a, intact_b) = self.intact.split_at_mut(group);
        let breakable = self.breakable.map(|bits| bits.split_at(group));
        let (history_a, history_b) = self.history.split_at_mut(self.width * group);
        let part = |intact, breakable, history| Self {
            intact,
            breakable,
            width: self.width,
            history,
        };
        [
            part(intact_a, breakable.map(|(a, _)| a), history_a),
            part(intact_b, breakable.map(|(_, b)| b), history_b),
        ]
    }

    /// A range of the groups.
    #[inline(always)]
    pub fn range(&mut self, range: Range<usize>) -> Groups<'_> {
        let history = self.width * range.start..self.width * range.end;
        Groups {
            breakable: self.breakable.map(|bits| &bits[range.clone()]),
            intact: &mut self.intact[range],
            width: self.width,
            history: &mut self.history[history],
        }
    }

    /// The history values of a group.
    #[inline(always)]
    pub fn history(&mut self, group: usize) -> &mut [Lanes] {
        &mut self.history[self.width * group..self.width * (group + 1)]
    }
}

/// Number of bytes that hold one bit for each of `bonds` bonds.
pub(super) fn bit_bytes(bonds: usize) -> usize {
    bonds.div_ceil(WIDTH)
}
