//! Grid refinement after Dipasquale et al. (2014, §2), in any dimension.
//!
//! Each level halves the spacing: dx_l = dx₀/2^l. The refinement of a node adds nodes around it, at a
//! distance of half a spacing along one or several axes: 2 nodes in 1-D, 8 in 2-D, and 26 in 3-D. A node is
//! added only if it lies between nodes of the body.
//!
//! A [`Pattern`] stores the refined nodes and the suppressed nodes of a body. Together with the cells of the
//! body, the pattern determines the positions, levels and volumes of all nodes. Therefore nodes do not depend
//! on the number of ranks.

mod fractions;
mod grid_index;
mod grid_index_set;
mod grids;
mod near_coarser;
mod pattern;

pub use fractions::SetFractions;
pub use grid_index::GridIndex;
pub use grid_index_set::GridIndexSet;
pub use grids::{Grids, NodeKey};
pub use pattern::{Node, Pattern};
