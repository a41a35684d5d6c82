//! Copies of the bond state: for checkpoints, and to roll back a step.

use crate::lanes::Lanes;

use super::Forces;

/// Copy of the intact bits and histories of all bonds, for a rollback.
#[derive(Debug, Default)]
pub struct KeptBonds(Vec<(Vec<u8>, Vec<Lanes>)>);

impl<const D: usize> Forces<D> {
    /// Number of bytes that the bonds of each owned point need in a checkpoint.
    pub fn saved_lengths(&self, owned: usize) -> Vec<u32> {
        let mut lengths = vec![0; owned];
        for interaction in &self.interactions {
            let add = |point: usize, length: usize| lengths[point] += length as u32;
            interaction.bonds.row_lengths(add);
        }
        lengths
    }

    /// Serialize the bonds of all owned points, in the order of the points. `lengths` is the result of
    /// [`Self::saved_lengths`].
    pub fn saved(&self, lengths: &[u32]) -> Vec<u8> {
        let (mut next, total) = starts(lengths);
        let mut bytes = vec![0; total];
        for interaction in &self.interactions {
            interaction.bonds.save(&mut next, &mut bytes);
        }
        bytes
    }

    /// Restore the bonds from the bytes of [`Self::saved`].
    pub fn restore(&mut self, lengths: &[u32], bytes: &[u8]) {
        let (mut next, _) = starts(lengths);
        for interaction in &mut self.interactions {
            interaction.bonds.restore(&mut next, bytes);
        }
    }

    /// Copy the bond state for [`Self::undo`].
    pub fn keep(&self, kept: &mut KeptBonds) {
        kept.0
            .resize_with(self.interactions.len(), Default::default);
        for (interaction, kept) in self.interactions.iter().zip(&mut kept.0) {
            interaction.bonds.store().keep(kept);
        }
    }

    /// Restore the bond state that [`Self::keep`] copied.
    pub fn undo(&mut self, kept: &KeptBonds) {
        for (interaction, kept) in self.interactions.iter_mut().zip(&kept.0) {
            interaction.bonds.store_mut().undo(kept);
        }
    }
}

/// Index of the first byte of each point, and the total number of bytes.
fn starts(lengths: &[u32]) -> (Vec<usize>, usize) {
    let mut end = 0;
    let starts = lengths
        .iter()
        .map(|length| {
            end += *length as usize;
            end - *length as usize
        })
        .collect();
    (starts, end)
}
