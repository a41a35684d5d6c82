//! The local indices of the far ends of listed bonds, eight by eight, in as few bytes as they allow.
//!
//! Points that lie near one another mostly have indices near one another, so a group keeps the lowest index
//! and the distances from it in 16 bits. One whose indices lie farther apart, such as those of points on the
//! rank and of ghosts, has them in full elsewhere.

use std::ops::Range;

use rayon::prelude::*;

use crate::lanes::WIDTH;

/// The bit of [`Near::first`] that says that the others are the place among the groups in full. Local
/// indices stay below it.
const IN_FULL: u32 = 1 << 31;

/// A group of eight.
#[derive(Debug, Clone, Copy)]
struct Near {
    /// The lowest index.
    first: u32,
    /// The distances from it.
    distances: [u16; WIDTH],
}

/// The far ends of listed bonds.
#[derive(Debug, Clone, Default)]
pub struct Neighbours {
    near: Vec<Near>,
    full: Vec<[u32; WIDTH]>,
}

/// Some groups of far ends that follow one another.
#[derive(Debug, Clone, Copy)]
pub struct NeighbourGroups<'a> {
    near: &'a [Near],
    full: &'a [[u32; WIDTH]],
}

/// The far ends of the bonds of a group.
#[derive(Debug, Clone, Copy)]
pub enum Group<'a> {
    /// The lowest index, and the distances from it.
    Near(u32, &'a [u16; WIDTH]),
    /// The indices.
    Full(&'a [u32; WIDTH]),
}

impl Neighbours {
    /// Adds a group.
    pub fn push(&mut self, indices: [u32; WIDTH]) {
        let first = indices.into_iter().fold(u32::MAX, u32::min);
        assert!(first < IN_FULL, "too many points for one rank");
        let mut distances = [0; WIDTH];
        for (distance, index) in distances.iter_mut().zip(indices) {
            let Ok(short) = u16::try_from(index - first) else {
                let first = in_full(self.full.len());
                self.full.push(indices);
                self.near.push(Near { first, distances });
                return;
            };
            *distance = short;
        }
        self.near.push(Near { first, distances });
    }

    /// Adds groups of others.
    pub fn extend(&mut self, others: NeighbourGroups<'_>) {
        let before = self.near.len();
        self.near.extend_from_slice(others.near);
        if others.full.is_empty() {
            return;
        }
        for near in &mut self.near[before..] {
            if near.first & IN_FULL != 0 {
                let indices = others.full[(near.first & !IN_FULL) as usize];
                near.first = in_full(self.full.len());
                self.full.push(indices);
            }
        }
    }

    /// Forgets all groups.
    pub fn clear(&mut self) {
        self.near.clear();
        self.full.clear();
    }

    /// Gives back memory beyond what the groups take.
    pub fn shrink_to_fit(&mut self) {
        self.near.shrink_to_fit();
        self.full.shrink_to_fit();
    }

    /// Number of groups.
    pub fn len(&self) -> usize {
        self.near.len()
    }

    /// Some of the groups.
    pub fn groups(&self, range: Range<usize>) -> NeighbourGroups<'_> {
        NeighbourGroups {
            near: &self.near[range],
            full: &self.full,
        }
    }

    /// All groups.
    pub fn all(&self) -> NeighbourGroups<'_> {
        self.groups(0..self.len())
    }

    /// The indices of a group.
    pub fn indices(&self, group: usize) -> [u32; WIDTH] {
        self.all().group(group).indices()
    }

    /// The largest index.
    pub fn largest(&self) -> Option<u32> {
        let largest = |group: usize| self.indices(group).into_iter().fold(0, u32::max);
        (0..self.len()).into_par_iter().map(largest).max()
    }

    /// Memory that they take, bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.near[..]) + size_of_val(&self.full[..])
    }
}

/// [`Near::first`] of the group that is in full at a place.
fn in_full(place: usize) -> u32 {
    assert!(place < IN_FULL as usize, "too many bonds for one rank");
    IN_FULL | place as u32
}

impl<'a> NeighbourGroups<'a> {
    /// Number of groups.
    #[inline(always)]
    pub fn len(self) -> usize {
        self.near.len()
    }

    /// Some of them.
    #[inline(always)]
    pub fn range(self, range: Range<usize>) -> Self {
        Self {
            near: &self.near[range],
            full: self.full,
        }
    }

    /// Those before one of them, and the rest.
    pub fn split_at(self, group: usize) -> [Self; 2] {
        [self.range(0..group), self.range(group..self.len())]
    }

    /// One of them.
    #[inline(always)]
    pub fn group(self, group: usize) -> Group<'a> {
        let near = &self.near[group];
        if near.first & IN_FULL != 0 {
            Group::Full(&self.full[(near.first & !IN_FULL) as usize])
        } else {
            Group::Near(near.first, &near.distances)
        }
    }
}

impl Group<'_> {
    /// The indices.
    #[inline(always)]
    pub fn indices(self) -> [u32; WIDTH] {
        match self {
            Self::Near(first, distances) => distances.map(|distance| first + u32::from(distance)),
            Self::Full(indices) => *indices,
        }
    }

    /// An index, and how far each of the eight lies beyond it.
    #[inline(always)]
    pub fn base_and_offsets(self) -> (usize, [usize; WIDTH]) {
        match self {
            Self::Near(first, distances) => (first as usize, distances.map(usize::from)),
            Self::Full(indices) => (0, std::array::from_fn(|k| indices[k] as usize)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_put_in_comes_out() {
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
            let (first, distances) = pushed.all().group(k).base_and_offsets();
            assert_eq!(distances.map(|distance| (first + distance) as u32), group);
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
