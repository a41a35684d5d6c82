//! Compressed neighbour indices of list families, in groups of eight.
//!
//! Points close in space usually have close indices. A compact group stores its smallest index and eight
//! 16-bit differences. If the range of indices is too wide, for example in a group of owned points and
//! ghosts, the group stores eight full indices in a second array.

use std::ops::Range;

use rayon::prelude::*;

use crate::lanes::WIDTH;

/// Flag of [`Compact::first`]. If it is set, the other bits are an index into the full groups. Local indices
/// are always below the value of the flag.
const IN_FULL: u32 = 1 << 31;

/// A group of eight indices.
#[derive(Debug, Clone, Copy)]
struct Compact {
    /// Smallest of the eight indices. If the flag [`IN_FULL`] is set, the other bits are an index into the
    /// full groups instead.
    first: u32,
    /// Differences from the smallest index; unused with [`IN_FULL`].
    differences: [u16; WIDTH],
}

/// Neighbour indices of bonds that are stored as a list, in groups of eight.
#[derive(Debug, Clone, Default)]
pub struct Neighbours {
    compact: Vec<Compact>,
    full: Vec<[u32; WIDTH]>,
}

/// A range of groups of neighbour indices.
#[derive(Debug, Clone, Copy)]
pub struct NeighbourGroups<'a> {
    compact: &'a [Compact],
    full: &'a [[u32; WIDTH]],
}

/// The neighbour indices of a group.
#[derive(Debug, Clone, Copy)]
pub enum NeighbourGroup<'a> {
    /// The smallest index, and the differences from the smallest index.
    Compact(u32, &'a [u16; WIDTH]),
    /// The indices.
    Full(&'a [u32; WIDTH]),
}

impl Neighbours {
    /// Append a group of eight neighbour indices.
    ///
    /// # Panics
    /// If the smallest index or the number of full groups is 2³¹ or more.
    pub fn push(&mut self, indices: [u32; WIDTH]) {
        let first = indices.into_iter().fold(u32::MAX, u32::min);
        assert!(first < IN_FULL, "too many points for one rank");
        let mut differences = [0; WIDTH];
        for (difference, index) in differences.iter_mut().zip(indices) {
            let Ok(short) = u16::try_from(index - first) else {
                let first = in_full(self.full.len());
                self.full.push(indices);
                self.compact.push(Compact { first, differences });
                return;
            };
            *difference = short;
        }
        self.compact.push(Compact { first, differences });
    }

    /// Append groups of another list.
    ///
    /// # Panics
    /// If the number of full groups is 2³¹ or more.
    pub fn extend(&mut self, others: NeighbourGroups<'_>) {
        let before = self.compact.len();
        self.compact.extend_from_slice(others.compact);
        if others.full.is_empty() {
            return;
        }
        for compact in &mut self.compact[before..] {
            if compact.first & IN_FULL != 0 {
                let indices = others.full[(compact.first & !IN_FULL) as usize];
                compact.first = in_full(self.full.len());
                self.full.push(indices);
            }
        }
    }

    /// Remove all groups.
    pub fn clear(&mut self) {
        self.compact.clear();
        self.full.clear();
    }

    /// Free unused capacity.
    pub fn shrink_to_fit(&mut self) {
        self.compact.shrink_to_fit();
        self.full.shrink_to_fit();
    }

    /// Number of groups.
    pub fn len(&self) -> usize {
        self.compact.len()
    }

    /// Return the groups with the indices in `range`.
    pub fn groups(&self, range: Range<usize>) -> NeighbourGroups<'_> {
        NeighbourGroups {
            compact: &self.compact[range],
            full: &self.full,
        }
    }

    /// View of all groups.
    pub fn all(&self) -> NeighbourGroups<'_> {
        self.groups(0..self.len())
    }

    /// The indices of a group.
    pub fn indices(&self, group: usize) -> [u32; WIDTH] {
        self.all().group(group).indices()
    }

    /// Largest neighbour index in all groups; `None` if there are no groups.
    pub fn largest(&self) -> Option<u32> {
        let largest = |group: usize| self.indices(group).into_iter().fold(0, u32::max);
        (0..self.len()).into_par_iter().map(largest).max()
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.compact[..]) + size_of_val(&self.full[..])
    }
}

/// The value of [`Compact::first`] for the full group with this index.
fn in_full(index: usize) -> u32 {
    assert!(index < IN_FULL as usize, "too many bonds for one rank");
    IN_FULL | index as u32
}

impl<'a> NeighbourGroups<'a> {
    /// Number of groups.
    #[inline(always)]
    pub fn len(self) -> usize {
        self.compact.len()
    }

    /// Return the groups with the indices in `range`.
    #[inline(always)]
    pub fn range(self, range: Range<usize>) -> Self {
        Self {
            compact: &self.compact[range],
            full: self.full,
        }
    }

    /// Split before `group`.
    pub fn split_at(self, group: usize) -> [Self; 2] {
        [self.range(0..group), self.range(group..self.len())]
    }

    /// Return the group with index `group`.
    #[inline(always)]
    pub fn group(self, group: usize) -> NeighbourGroup<'a> {
        let compact = &self.compact[group];
        if compact.first & IN_FULL != 0 {
            NeighbourGroup::Full(&self.full[(compact.first & !IN_FULL) as usize])
        } else {
            NeighbourGroup::Compact(compact.first, &compact.differences)
        }
    }
}

impl NeighbourGroup<'_> {
    /// The indices.
    #[inline(always)]
    pub fn indices(self) -> [u32; WIDTH] {
        match self {
            Self::Compact(first, differences) => {
                // Not `map`: see the rules for loops in docs/src/developers/performance.md.
                let mut indices = [first; WIDTH];
                for (index, difference) in indices.iter_mut().zip(differences) {
                    *index += u32::from(*difference);
                }
                indices
            }
            Self::Full(indices) => *indices,
        }
    }

    /// A base index, and the differences of the eight indices from the base index.
    #[inline(always)]
    pub fn base_and_offsets(self) -> (usize, [usize; WIDTH]) {
        let mut offsets = [0; WIDTH];
        match self {
            Self::Compact(first, differences) => {
                for (offset, difference) in offsets.iter_mut().zip(differences) {
                    *offset = usize::from(*difference);
                }
                (first as usize, offsets)
            }
            Self::Full(indices) => {
                for (offset, index) in offsets.iter_mut().zip(indices) {
                    *offset = *index as usize;
                }
                (0, offsets)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_read_as_they_were_pushed() {
        let groups = [
            [7, 3, 4, 3, 9, 8, 65_530, 3],
            [3, 65_538, 3, 3, 3, 3, 3, 3],
            [3, 65_539, 3, 3, 3, 3, 3, 3],
            [IN_FULL - 1; WIDTH],
            [0, IN_FULL - 1, 5, 5, 5, 5, 5, 5],
            [0; WIDTH],
        ];
        let mut pushed = Neighbours::default();
        groups.into_iter().for_each(|group| pushed.push(group));
        assert_eq!(pushed.full.len(), 2);
        let mut copied = Neighbours::default();
        copied.push([1, 1_000_000, 1, 1, 1, 1, 1, 1]);
        copied.extend(pushed.groups(1..groups.len()));
        for (k, group) in groups.into_iter().enumerate() {
            assert_eq!(pushed.indices(k), group);
            let (first, differences) = pushed.all().group(k).base_and_offsets();
            assert_eq!(
                differences.map(|difference| (first + difference) as u32),
                group
            );
            if k > 0 {
                assert_eq!(copied.indices(k), group);
            }
        }
        let [first, rest] = pushed.all().split_at(2);
        assert_eq!(first.group(1).indices(), groups[1]);
        assert_eq!(rest.group(2).indices(), groups[4]);
        assert_eq!(pushed.largest(), Some(IN_FULL - 1));
        assert_eq!(Neighbours::default().largest(), None);
    }
}
