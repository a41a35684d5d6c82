//! Displacements and thermal stretches of the owned points, in the layout that bonds read. The values are
//! written range by range.

use std::ops::Range;

use super::Forces;
use super::grid_points::{GridValues, OwnedPlaces};
use super::list_points::{self, Node};

/// Write access to the bond inputs of a range of owned points. Different threads hold disjoint ranges.
pub struct BondInputs<'a, const D: usize> {
    points: Range<usize>,
    /// Data of the `points`, for bonds in lists; empty if no bonds are stored in lists.
    nodes: &'a mut [Node],
    /// Write access to the slots of the owned points, one entry per grid.
    places: &'a [OwnedPlaces<'a, D>],
}

impl<const D: usize> BondInputs<'_, D> {
    /// Split off the bond inputs of the first `count` points.
    ///
    /// # Panics
    /// If there are fewer than `count` points.
    pub fn split_off_first(&mut self, count: usize) -> Self {
        let middle = self.points.start + count;
        assert!(middle <= self.points.end, "more points than there are");
        let of_nodes = count.min(self.nodes.len());
        let nodes = self.nodes.split_off_mut(..of_nodes);
        let points = self.points.start..middle;
        self.points.start = middle;
        Self {
            points,
            nodes: nodes.unwrap_or_default(),
            places: self.places,
        }
    }

    /// Write the displacements (m) of all points of the range. If the run has temperatures, also write the
    /// thermal stretches of these points.
    ///
    /// # Panics
    /// If the number of values differs from the number of points.
    pub fn write_bond_inputs(
        &mut self,
        displacement: [&[f64]; D],
        thermal_stretch: Option<&[f64]>,
    ) {
        let count = self.points.len();
        let mut columns = displacement.into_iter().chain(thermal_stretch);
        assert!(columns.all(|column| column.len() == count));
        list_points::update(self.nodes, displacement, thermal_stretch);
        for places in self.places {
            // SAFETY: different `BondInputs` have disjoint ranges of points, so no other thread writes these
            // points.
            unsafe { places.copy_from(self.points.start, displacement, thermal_stretch) };
        }
    }
}

impl<const D: usize> Forces<D> {
    /// Call `work` with the bond inputs of all owned points; `owned` is the number of these points.
    pub fn with_bond_inputs<R>(
        &mut self,
        owned: usize,
        work: impl FnOnce(BondInputs<'_, D>) -> R,
    ) -> R {
        let places: Vec<_> = self
            .grids
            .iter_mut()
            .map(GridValues::owned_places)
            .collect();
        let of_nodes = owned.min(self.nodes.len());
        work(BondInputs {
            points: 0..owned,
            nodes: &mut self.nodes[..of_nodes],
            places: &places,
        })
    }
}
