//! The refined nodes of a body, and all nodes that result from the refinement.

use std::sync::Arc;

use rustc_hash::FxHashSet;

use super::grid_index::{GridIndex, around, between, canonical, halves, parents};
use super::grid_index_set::GridIndexSet;

/// A node of a refined grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// Level of the node's block; the spacing of level l is dx₀/2^l, with the spacing dx₀ of level 0.
    pub level: u32,
    /// Ratio of the node's volume to the volume of a level-0 cell.
    pub volume_fraction: f64,
    /// Whether the volume is exactly the volume of a cell of the node's level.
    pub has_cell_volume: bool,
}

/// The refined nodes of a body, by level. A node is stored as a grid index. The unit of the index is the
/// spacing of the node's level.
///
/// - The arguments `body` of the methods are functions that test whether a level-0 cell belongs to the body.
/// - The parents of a refined node are refined, so neighbouring nodes differ by at most one level, except
///   next to suppressed nodes.
/// - If a crack separates the parents of a new node, the node is suppressed. Crack faces then act like the
///   boundary of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern {
    dimension: usize,
    /// Refined nodes, by level. Nodes of the finest level cannot be refined, so this level is missing.
    refined: Vec<FxHashSet<GridIndex>>,
    /// Nodes that are never coarsened, by level.
    permanent: Arc<[FxHashSet<GridIndex>]>,
    /// Suppressed nodes, by canonical level and index.
    suppressed: FxHashSet<(u32, GridIndex)>,
}

impl Pattern {
    /// Create a pattern without refined nodes; the finest level is `finest`.
    pub fn new(dimension: usize, finest: u32) -> Self {
        Self {
            dimension,
            refined: vec![FxHashSet::default(); finest as usize],
            permanent: vec![FxHashSet::default(); finest as usize].into(),
            suppressed: FxHashSet::default(),
        }
    }

    /// The finest refinement level that nodes can have.
    pub fn finest(&self) -> u32 {
        self.refined.len() as u32
    }

    /// Number of dimensions.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Refine a node and its ancestors, if a node is possible at the index. Return true if the node is
    /// possible and was not refined before.
    pub fn refine(
        &mut self,
        body: &impl Fn(GridIndex) -> bool,
        level: u32,
        index: GridIndex,
    ) -> bool {
        if !self.is_possible(body, level, index) || !self.refined[level as usize].insert(index) {
            return false;
        }
        if level > 0 {
            for parent in parents(index) {
                self.refine(body, level - 1, parent);
            }
        }
        true
    }

    /// Coarsen a node, unless it is permanent or a parent of a refined node. Return whether the node was
    /// coarsened.
    pub fn coarsen(&mut self, level: u32, index: GridIndex) -> bool {
        let finer = level as usize + 1;
        let is_needed = self.refined.get(finer).is_some_and(|finer| {
            finer.contains(&index.map(|x| 2 * x))
                || around(index, self.dimension).any(|other| finer.contains(&other))
        });
        let level = level as usize;
        !is_needed && !self.permanent[level].contains(&index) && self.refined[level].remove(&index)
    }

    /// Make all refined nodes permanent.
    pub fn make_permanent(&mut self) {
        self.permanent = self.refined.as_slice().into();
    }

    /// The finest level at which the node at `index` is refined, and the index of the node in spacings of
    /// this level. `index` is in spacings of the finest level of the pattern ([`Self::finest`]). `None` if
    /// the node is not refined at any level, or if it is permanent at this level.
    pub fn refined_at(&self, index: GridIndex) -> Option<(u32, GridIndex)> {
        let finest = self.finest();
        let (coarsest, _) = canonical(finest, index);
        let nodes = (coarsest..finest).map(|level| (level, index.map(|x| x >> (finest - level))));
        let is_in = |sets: &[FxHashSet<GridIndex>], (level, index): &(u32, GridIndex)| {
            sets[*level as usize].contains(index)
        };
        let node = nodes.rev().find(|node| is_in(&self.refined, node));
        node.filter(|node| !is_in(&self.permanent, node))
    }

    /// The nodes that the coarsening of a node has removed, as grid indices in spacings of the finest level.
    /// `level` is the level of the coarsened node, and `index` is its grid index in spacings of this level.
    pub fn removed(
        &self,
        body: &impl Fn(GridIndex) -> bool,
        level: u32,
        index: GridIndex,
    ) -> impl Iterator<Item = GridIndex> {
        let steps = 1 << (self.finest() - level - 1);
        around(index, self.dimension)
            .filter(move |other| {
                !self.exists_if_possible(level + 1, *other)
                    && self.is_possible(body, level + 1, *other)
            })
            .map(move |other| other.map(|x| x * steps))
    }

    /// The refined nodes with their levels, unordered.
    pub fn refined(&self) -> impl Iterator<Item = (u32, GridIndex)> {
        let by_level = (0..).zip(&self.refined);
        by_level.flat_map(|(level, indices)| indices.iter().map(move |index| (level, *index)))
    }

    /// Test whether a node exists at an index of a level.
    pub fn exists(&self, body: &impl Fn(GridIndex) -> bool, level: u32, index: GridIndex) -> bool {
        self.exists_if_possible(level, index) && self.is_possible(body, level, index)
    }

    /// Test whether a node exists at an index of a level. The result is valid only if a node is possible at
    /// this index ([`Self::is_possible`]).
    fn exists_if_possible(&self, level: u32, index: GridIndex) -> bool {
        let (level, index) = canonical(level, index);
        level == 0 || {
            let refined = &self.refined[level as usize - 1];
            parents(index).any(|parent| refined.contains(&parent))
        }
    }

    /// Test whether a level-0 cell, given by the index of its centre, can contain nodes other than the node
    /// at its centre.
    pub fn touches(&self, cell: GridIndex) -> bool {
        let Some(refined) = self.refined.first() else {
            return false;
        };
        let high = std::array::from_fn(|k| cell[k] + i64::from(k < self.dimension));
        !refined.is_empty() && between(cell, high).any(|corner| refined.contains(&corner))
    }

    /// The level-0 cells whose nodes may differ from the nodes of an unrefined grid.
    pub fn changed(&self) -> GridIndexSet {
        let step = |k: usize| i64::from(k < self.dimension);
        let mut changed = GridIndexSet::default();
        for cell in self.refined.iter().take(1).flatten() {
            let low = std::array::from_fn(|k| cell[k] - step(k));
            let high = std::array::from_fn(|k| cell[k] + step(k));
            between(low, high).for_each(|other| changed.insert(other));
        }
        changed
    }

    /// The node at a grid index in spacings of the finest level; `None` if there is none.
    pub fn node(&self, body: &impl Fn(GridIndex) -> bool, index: GridIndex) -> Option<Node> {
        let finest = self.finest();
        if !self.exists(body, finest, index) {
            return None;
        }
        let (coarsest, canonical_index) = canonical(finest, index);
        let dimension = self.dimension as u32;
        // Volumes are integers in units of the finest cell's volume divided by 2^dimension, so the arithmetic
        // is exact.
        let cell = |level: u32| 1_u64 << (dimension * (finest + 1 - level));
        let (mut level, mut volume) = (coarsest, cell(coarsest));
        let mut complete = true;
        let mut centre = canonical_index;
        for coarse in coarsest..finest {
            let (mut existing, mut all) = (0, 0);
            for other in around(centre, self.dimension) {
                if !self.is_possible(body, coarse + 1, other) {
                    continue;
                }
                all += 1;
                if self.exists_if_possible(coarse + 1, other) {
                    existing += 1;
                    // Eq. 12 of Dipasquale et al.: subtract 1/2, 1/4 or 1/8 of the finer volume for a node
                    // that is offset along 1, 2 or 3 axes.
                    volume -= cell(coarse + 1) >> halves(other);
                }
            }
            complete &= existing == all && all > 0;
            if complete {
                level = coarse + 1;
            }
            if existing == 0 {
                break;
            }
            centre = centre.map(|x| 2 * x);
        }
        let scale = cell(0) as f64;
        Some(Node {
            level,
            volume_fraction: volume as f64 / scale,
            has_cell_volume: volume == cell(level),
        })
    }

    /// Test whether a node is possible at an index of a level. All level-0 nodes around the index must belong
    /// to the body. Neither the node nor an ancestor may be suppressed.
    pub(super) fn is_possible(
        &self,
        body: &impl Fn(GridIndex) -> bool,
        level: u32,
        index: GridIndex,
    ) -> bool {
        if self.suppressed.is_empty() {
            let low = index.map(|x| x >> level);
            let high = index.map(|x| (x + (1 << level) - 1) >> level);
            return between(low, high).all(body);
        }
        let (level, index) = canonical(level, index);
        if level == 0 {
            return body(index);
        }
        !self.suppressed.contains(&(level, index))
            && parents(index).all(|parent| self.is_possible(body, level - 1, parent))
    }

    /// Suppress a node, given by its canonical level and index, for the rest of the run.
    pub fn suppress(&mut self, level: u32, index: GridIndex) {
        self.suppressed.insert((level, index));
    }

    /// The suppressed nodes with their canonical level and index, unordered.
    pub fn suppressed(&self) -> impl Iterator<Item = (u32, GridIndex)> {
        self.suppressed.iter().copied()
    }

    /// The nodes with the canonical level `level` that exist now but not in `earlier`, unordered. Each node
    /// is given by its grid index at this level. `level` is at least 1.
    pub fn created_since(
        &self,
        earlier: &Self,
        body: &impl Fn(GridIndex) -> bool,
        level: u32,
    ) -> Vec<GridIndex> {
        let coarse = level as usize - 1;
        let added = self.refined[coarse].difference(&earlier.refined[coarse]);
        let indices: FxHashSet<GridIndex> = added
            .flat_map(|index| around(*index, self.dimension))
            .filter(|index| canonical(level, *index).0 == level)
            .filter(|index| {
                self.exists(body, level, *index) && !earlier.exists(body, level, *index)
            })
            .collect();
        indices.into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::near_coarser::NearCoarser;
    use super::*;
    use proptest::prelude::*;

    /// All nodes of a body, with their grid indices in spacings of the finest level.
    fn nodes(
        pattern: &Pattern,
        body: &impl Fn(GridIndex) -> bool,
        edge: i64,
    ) -> Vec<(GridIndex, Node)> {
        let end = edge << pattern.finest();
        let high = std::array::from_fn(|k| if k < pattern.dimension { end } else { 0 });
        between([0; 3], high)
            .filter_map(|index| Some((index, pattern.node(body, index)?)))
            .collect()
    }

    #[test]
    fn volumes_at_interfaces_are_those_of_the_paper() {
        // Volume removed from the node (0, 0), in cell volumes of the finer level.
        let taken = |bottom: i64, refined: &[[i64; 2]]| {
            let body = |cell: GridIndex| cell[1] >= bottom;
            let mut pattern = Pattern::new(2, 1);
            for [x, y] in refined {
                pattern.refine(&body, 0, [*x, *y, 0]);
            }
            let node = pattern.node(&body, [0; 3]).unwrap();
            4.0 * (1.0 - node.volume_fraction)
        };
        assert_eq!(taken(-9, &[]), 0.0);
        assert_eq!(taken(-9, &[[1, 1]]), 0.25);
        // At an edge of the body, the node first has two finer neighbours, then four.
        assert_eq!(taken(0, &[[1, 0]]), 0.75);
        assert_eq!(taken(-9, &[[1, 0]]), 1.0);
        assert_eq!(taken(0, &[[1, 0], [0, 1]]), 1.5);
        assert_eq!(taken(-9, &[[1, 0], [0, 1]]), 1.75);
        // With all eight finer neighbours, the node has the volume of a cell of the finer level.
        assert_eq!(taken(-9, &[[0, 0]]), 3.0);
    }

    #[test]
    fn a_refined_node_at_an_edge_has_the_finer_level() {
        let body = |cell: GridIndex| cell[..2].iter().all(|x| (0..5).contains(x));
        let mut pattern = Pattern::new(2, 2);
        pattern.refine(&body, 0, [0, 2, 0]);
        let node = pattern.node(&body, [0, 8, 0]).unwrap();
        assert_eq!((node.level, node.has_cell_volume), (1, false));
        let inner = pattern.node(&body, [4, 8, 0]).unwrap();
        assert_eq!((inner.level, inner.has_cell_volume), (0, false));
        let near_coarser = |x, reach| {
            let near_coarser = NearCoarser::new(&pattern, 1, [0.5; 3], reach);
            near_coarser.has(&body, [x, 4, 0])
        };
        assert!(!near_coarser(0, 0.5) && near_coarser(0, 1.2));
        assert!(!near_coarser(1, 0.5) && near_coarser(1, 0.75));
    }

    /// Check volumes and levels after random refinement up to level `finest`, with suppressed nodes, and
    /// after coarsening.
    fn check(
        (dimension, edge, finest): (usize, i64, u32),
        holes: &[GridIndex],
        selected: &[(u32, GridIndex)],
        suppressed: &[(u32, GridIndex)],
    ) {
        let within = |cell: GridIndex| (0..dimension).all(|k| (0..edge).contains(&cell[k]));
        let body = |cell: GridIndex| within(cell) && !holes.contains(&cell);
        let mut pattern = Pattern::new(dimension, finest);
        for (level, index) in suppressed {
            let index = std::array::from_fn(|k| if k < dimension { index[k] } else { 0 });
            if let (level @ 1.., index) = canonical(level % (finest + 1), index) {
                pattern.suppress(level, index);
            }
        }
        for (level, index) in selected {
            let index = std::array::from_fn(|k| if k < dimension { index[k] } else { 0 });
            let level = level % finest;
            if pattern.exists(&body, level, index) {
                pattern.refine(&body, level, index);
            }
        }
        let high = std::array::from_fn(|k| if k < dimension { edge } else { 0 });
        let cells = between([0; 3], high).filter(|cell| body(*cell)).count() as f64;
        let is_sound = |pattern: &Pattern| {
            let nodes = nodes(pattern, &body, edge);
            let volume: f64 = nodes.iter().map(|(_, node)| node.volume_fraction).sum();
            assert!((volume / cells - 1.0).abs() < 1e-13, "{volume} for {cells}");
            for (index, node) in &nodes {
                assert!(node.volume_fraction > 0.0, "{index:?}: {node:?}");
            }
            for (level, index) in pattern.refined() {
                assert!(pattern.exists(&body, level, index));
                for parent in parents(index).filter(|_| level > 0) {
                    assert!(pattern.refined[level as usize - 1].contains(&parent));
                }
            }
            // Adjacent nodes differ by at most one level, unless nodes are suppressed.
            for (index, node) in &nodes {
                for k in (0..dimension).filter(|_| suppressed.is_empty()) {
                    let next = (1..=1 << finest).find_map(|step| {
                        let mut other = *index;
                        other[k] += step;
                        pattern.node(&body, other)
                    });
                    if let Some(next) = next {
                        assert!(node.level.abs_diff(next.level) <= 1, "{index:?} {k}");
                    }
                }
            }
            nodes
        };
        let mut before = is_sound(&pattern);
        // Coarsen every third refined node, then the rest.
        for every in [3, 1] {
            let mut refined: Vec<(u32, GridIndex)> = pattern.refined().collect();
            refined.sort_unstable_by_key(|(level, index)| (std::cmp::Reverse(*level), *index));
            let earlier = pattern.clone();
            let coarse = refined.into_iter().step_by(every);
            let coarse: Vec<(u32, GridIndex)> = coarse
                .filter(|(level, index)| pattern.coarsen(*level, *index))
                .collect();
            let removed = coarse
                .iter()
                .flat_map(|(level, index)| pattern.removed(&body, *level, *index));
            let removed: FxHashSet<GridIndex> = removed.collect();
            let after = is_sound(&pattern);
            let remains = |(index, _): &&(GridIndex, Node)| !removed.contains(index);
            let indices = |nodes: Vec<&(GridIndex, Node)>| -> Vec<GridIndex> {
                nodes.into_iter().map(|(index, _)| *index).collect()
            };
            let remaining = indices(before.iter().filter(remains).collect());
            assert_eq!(remaining, indices(after.iter().collect()));
            // A removed node has the volume of a cell of its level, unless finer nodes are removed with it.
            for (index, node) in before.iter().filter(|node| !remains(node)) {
                let (level, _) = canonical(finest, *index);
                let cell = 0.5_f64.powi((level * dimension as u32) as i32);
                let finer = around_by_half(level, finest, *index, dimension);
                if finer
                    .iter()
                    .all(|other| earlier.node(&body, *other).is_none())
                {
                    assert_eq!((node.level, node.volume_fraction), (level, cell));
                }
            }
            before = after;
        }
        assert_eq!(before.len() as f64, cells);
    }

    /// The indices around an index, at a distance of half a spacing of `level` along one or several axes. All
    /// indices are in spacings of the finest level.
    fn around_by_half(
        level: u32,
        finest: u32,
        index: GridIndex,
        dimension: usize,
    ) -> Vec<GridIndex> {
        if level == finest {
            return Vec::new();
        }
        let scale = 1 << (finest - level - 1);
        let centre = index.map(|x| x >> (finest - level));
        around(centre, dimension)
            .map(|other| other.map(|x| x * scale))
            .collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn volume_is_conserved_in_2d(
            holes in prop::collection::vec([0_i64..7, 0_i64..7, 0_i64..1], 0..6),
            selected in prop::collection::vec((0_u32..3, [0_i64..28, 0_i64..28, 0_i64..1]), 0..40),
            suppressed in prop::collection::vec((1_u32..4, [0_i64..28, 0_i64..28, 0_i64..1]), 1..20),
        ) {
            check((2, 7, 3), &holes, &selected, &[]);
            check((2, 7, 3), &holes, &selected, &suppressed);
        }

        #[test]
        fn volume_is_conserved_in_3d(
            holes in prop::collection::vec([0_i64..4, 0_i64..4, 0_i64..4], 0..6),
            selected in prop::collection::vec((0_u32..2, [0_i64..8, 0_i64..8, 0_i64..8]), 0..12),
            suppressed in prop::collection::vec((1_u32..3, [0_i64..8, 0_i64..8, 0_i64..8]), 1..12),
        ) {
            check((3, 4, 2), &holes, &selected, &[]);
            check((3, 4, 2), &holes, &selected, &suppressed);
        }
    }
}
