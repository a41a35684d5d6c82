//! Grid refinement after Dipasquale et al. (2014, §2), in any dimension: which nodes there are, and what
//! volume they have.
//!
//! Levels halve the spacing, dx_l = dx₀/2^l. A node that is refined gets nodes at all half-spacing places
//! around it, 2 in 1-D, 8 in the plane, 26 in 3-D, as far as they lie between nodes of its body. A
//! [`Pattern`] holds which nodes are refined; places, levels and volumes of all nodes follow from it and
//! from the cells of the body alone, so they are the same on any number of ranks.

mod at_coarser;
mod grids;
mod pattern;
mod place;
mod place_set;
mod shares;

pub use grids::{Grids, NodeKey};
pub use pattern::{Node, Pattern};
pub use place::Place;
pub use place_set::PlaceSet;
pub use shares::Shares;
