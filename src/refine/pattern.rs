//! Which nodes of a body are refined, and the nodes that follow.

use std::sync::Arc;

use rustc_hash::FxHashSet;

use super::place::{Place, around, between, canonical, halves, parents};
use super::place_set::PlaceSet;

/// A node of a refined grid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// The level at whose spacing it lies among its neighbours.
    pub level: u32,
    /// Volume as a share of that of a cell of level 0.
    pub share: f64,
    /// Whether this is just the volume of a cell of its level.
    pub whole: bool,
}

/// The refined nodes of a body, by level, in steps of their level's spacing.
///
/// `body` says of a cell, by its numbers, whether it is one of the body's. If a node is refined, its
/// parents are; so neighbouring nodes differ by one level at most. Where a crack has parted the nodes
/// that a new one would lie between, none is born: its faces are like the sides of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Pattern {
    dimension: usize,
    /// One set a level but the finest.
    refined: Vec<FxHashSet<Place>>,
    /// Those that stay refined, by level.
    lasting: Arc<[FxHashSet<Place>]>,
    /// Places where no node is born, with the level that it would be born at.
    parted: FxHashSet<(u32, Place)>,
}

impl Pattern {
    /// Nothing is refined; `finest` is the finest level there can be.
    pub fn new(dimension: usize, finest: u32) -> Self {
        Self {
            dimension,
            refined: vec![FxHashSet::default(); finest as usize],
            lasting: vec![FxHashSet::default(); finest as usize].into(),
            parted: FxHashSet::default(),
        }
    }

    /// The finest level that there can be.
    pub fn finest(&self) -> u32 {
        self.refined.len() as u32
    }

    /// Number of dimensions.
    pub fn dimension(&self) -> usize {
        self.dimension
    }

    /// Refines a node of a level, given in steps of it; its parents first. A place outside of the body
    /// stays as it is. Returns whether it was not refined yet.
    pub fn refine(&mut self, body: &impl Fn(Place) -> bool, level: u32, place: Place) -> bool {
        if !self.is_possible(body, level, place) || !self.refined[level as usize].insert(place) {
            return false;
        }
        if level > 0 {
            for parent in parents(place) {
                self.refine(body, level - 1, parent);
            }
        }
        true
    }

    /// Makes a refined node of a level, given in steps of it, coarse again, unless it is to last or is needed by
    /// one of the next level. Returns whether it was refined until now.
    pub fn coarsen(&mut self, level: u32, place: Place) -> bool {
        let finer = level as usize + 1;
        let is_needed = self.refined.get(finer).is_some_and(|finer| {
            finer.contains(&place.map(|x| 2 * x))
                || around(place, self.dimension).any(|other| finer.contains(&other))
        });
        let level = level as usize;
        !is_needed && !self.lasting[level].contains(&place) && self.refined[level].remove(&place)
    }

    /// Makes the nodes that are refined now last.
    pub fn make_last(&mut self) {
        self.lasting = self.refined.as_slice().into();
    }

    /// The finest level at which a place, in steps of the finest level, is a refined node, if it is not to last
    /// there.
    pub fn refined_at(&self, place: Place) -> Option<(u32, Place)> {
        let finest = self.finest();
        let (birth, _) = canonical(finest, place);
        let nodes = (birth..finest).map(|level| (level, place.map(|x| x >> (finest - level))));
        let is_in = |sets: &[FxHashSet<Place>], (level, place): &(u32, Place)| {
            sets[*level as usize].contains(place)
        };
        let node = nodes.rev().find(|node| is_in(&self.refined, node));
        node.filter(|node| !is_in(&self.lasting, node))
    }

    /// The nodes that a refined one of a level had around it and that are no longer there now that it is coarse,
    /// in steps of the finest level.
    pub fn removed(
        &self,
        body: &impl Fn(Place) -> bool,
        level: u32,
        place: Place,
    ) -> impl Iterator<Item = Place> {
        let steps = 1 << (self.finest() - level - 1);
        around(place, self.dimension)
            .filter(move |other| {
                !self.is_taken(level + 1, *other) && self.is_possible(body, level + 1, *other)
            })
            .map(move |other| other.map(|x| x * steps))
    }

    /// The refined nodes with their levels, in no order.
    pub fn refined(&self) -> impl Iterator<Item = (u32, Place)> {
        let by_level = (0..).zip(&self.refined);
        by_level.flat_map(|(level, places)| places.iter().map(move |place| (level, *place)))
    }

    /// Whether there is a node at a place, in steps of a level's spacing.
    pub fn exists(&self, body: &impl Fn(Place) -> bool, level: u32, place: Place) -> bool {
        self.is_taken(level, place) && self.is_possible(body, level, place)
    }

    /// Whether there is a node at a place, in steps of a level's spacing, if there can be one.
    fn is_taken(&self, level: u32, place: Place) -> bool {
        let (level, place) = canonical(level, place);
        level == 0 || {
            let refined = &self.refined[level as usize - 1];
            parents(place).any(|parent| refined.contains(&parent))
        }
    }

    /// Whether there can be nodes within a cell, its lower sides included, beside the one at its centre
    /// from which it is numbered.
    pub fn touches(&self, cell: Place) -> bool {
        let Some(refined) = self.refined.first() else {
            return false;
        };
        let high = std::array::from_fn(|k| cell[k] + i64::from(k < self.dimension));
        !refined.is_empty() && between(cell, high).any(|corner| refined.contains(&corner))
    }

    /// The nodes of level 0 that may be other than without refinement, and whose cells, lower sides included, may
    /// hold finer nodes.
    pub fn changed(&self) -> PlaceSet {
        let step = |k: usize| i64::from(k < self.dimension);
        let mut changed = PlaceSet::default();
        for cell in self.refined.iter().take(1).flatten() {
            let low = std::array::from_fn(|k| cell[k] - step(k));
            let high = std::array::from_fn(|k| cell[k] + step(k));
            between(low, high).for_each(|other| changed.insert(other));
        }
        changed
    }

    /// What the node at a place is, in steps of the finest level; none if there is no node.
    pub fn node(&self, body: &impl Fn(Place) -> bool, place: Place) -> Option<Node> {
        let finest = self.finest();
        if !self.exists(body, finest, place) {
            return None;
        }
        let (birth, at_birth) = canonical(finest, place);
        let dimension = self.dimension as u32;
        // Volume in units of which the finest cell has 2^dimension: all of this is exact.
        let cell = |level: u32| 1_u64 << (dimension * (finest + 1 - level));
        let (mut level, mut volume) = (birth, cell(birth));
        let mut complete = true;
        let mut here = at_birth;
        for coarse in birth..finest {
            let (mut taken, mut all) = (0, 0);
            for other in around(here, self.dimension) {
                if !self.is_possible(body, coarse + 1, other) {
                    continue;
                }
                all += 1;
                if self.is_taken(coarse + 1, other) {
                    taken += 1;
                    // Eq. 12: half of the finer volume on an axis, a quarter on a diagonal.
                    volume -= cell(coarse + 1) >> halves(other);
                }
            }
            complete &= taken == all && all > 0;
            if complete {
                level = coarse + 1;
            }
            if taken == 0 {
                break;
            }
            here = here.map(|x| 2 * x);
        }
        let scale = cell(0) as f64;
        Some(Node {
            level,
            share: volume as f64 / scale,
            whole: volume == cell(level),
        })
    }

    /// Whether there could be a node at a place, in steps of a level's spacing: whether the nodes of level 0
    /// around it are the body's, and no crack has parted those between which it would be born, or these.
    pub(super) fn is_possible(
        &self,
        body: &impl Fn(Place) -> bool,
        level: u32,
        place: Place,
    ) -> bool {
        if self.parted.is_empty() {
            let low = place.map(|x| x >> level);
            let high = place.map(|x| (x + (1 << level) - 1) >> level);
            return between(low, high).all(body);
        }
        let (level, place) = canonical(level, place);
        if level == 0 {
            return body(place);
        }
        !self.parted.contains(&(level, place))
            && parents(place).all(|parent| self.is_possible(body, level - 1, parent))
    }

    /// Leaves a place, in steps of the level that a node there would be born at, without one for ever.
    pub fn part(&mut self, level: u32, place: Place) {
        self.parted.insert((level, place));
    }

    /// The places where no node is born, with the level that it would be born at; in no order.
    pub fn parted(&self) -> impl Iterator<Item = (u32, Place)> {
        self.parted.iter().copied()
    }

    /// The places, in steps of the level of their birth, of the nodes that have come since an earlier state of
    /// the pattern, for one such level.
    pub fn born_since(
        &self,
        earlier: &Self,
        body: &impl Fn(Place) -> bool,
        level: u32,
    ) -> Vec<Place> {
        let coarse = level as usize - 1;
        let newly = self.refined[coarse].difference(&earlier.refined[coarse]);
        let places: FxHashSet<Place> = newly
            .flat_map(|place| around(*place, self.dimension))
            .filter(|place| canonical(level, *place).0 == level)
            .filter(|place| {
                self.exists(body, level, *place) && !earlier.exists(body, level, *place)
            })
            .collect();
        places.into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::at_coarser::AtCoarser;
    use super::*;
    use proptest::prelude::*;

    /// All nodes of the body by place, in steps of the finest level.
    fn nodes(pattern: &Pattern, body: &impl Fn(Place) -> bool, edge: i64) -> Vec<(Place, Node)> {
        let end = edge << pattern.finest();
        let high = std::array::from_fn(|k| if k < pattern.dimension { end } else { 0 });
        between([0; 3], high)
            .filter_map(|place| Some((place, pattern.node(body, place)?)))
            .collect()
    }

    #[test]
    fn volumes_at_interfaces_are_those_of_the_paper() {
        // What is taken from the node (0, 0), in volumes of the finer level.
        let taken = |bottom: i64, refined: &[[i64; 2]]| {
            let body = |cell: Place| cell[1] >= bottom;
            let mut pattern = Pattern::new(2, 1);
            for [x, y] in refined {
                pattern.refine(&body, 0, [*x, *y, 0]);
            }
            let node = pattern.node(&body, [0; 3]).unwrap();
            4.0 * (1.0 - node.share)
        };
        assert_eq!(taken(-9, &[]), 0.0);
        assert_eq!(taken(-9, &[[1, 1]]), 0.25);
        // Two finer nodes and four are there along the edge of a body.
        assert_eq!(taken(0, &[[1, 0]]), 0.75);
        assert_eq!(taken(-9, &[[1, 0]]), 1.0);
        assert_eq!(taken(0, &[[1, 0], [0, 1]]), 1.5);
        assert_eq!(taken(-9, &[[1, 0], [0, 1]]), 1.75);
        // All eight: what is left is a cell of the finer level.
        assert_eq!(taken(-9, &[[0, 0]]), 3.0);
    }

    #[test]
    fn a_refined_node_is_of_the_finer_level_at_an_edge_too() {
        let body = |cell: Place| cell[..2].iter().all(|x| (0..5).contains(x));
        let mut pattern = Pattern::new(2, 2);
        pattern.refine(&body, 0, [0, 2, 0]);
        let node = pattern.node(&body, [0, 8, 0]).unwrap();
        assert_eq!((node.level, node.whole), (1, false));
        let inner = pattern.node(&body, [4, 8, 0]).unwrap();
        assert_eq!((inner.level, inner.whole), (0, false));
        let at_coarser = |x, reach| {
            let at_coarser = AtCoarser::new(&pattern, 1, [0.5; 3], reach);
            at_coarser.has(&body, [x, 4, 0])
        };
        assert!(!at_coarser(0, 0.5) && at_coarser(0, 1.2));
        assert!(!at_coarser(1, 0.5) && at_coarser(1, 0.75));
    }

    /// Refined at random, some nodes twice or three times over, with places where nothing is born.
    fn check(
        (dimension, edge, finest): (usize, i64, u32),
        holes: &[Place],
        picks: &[(u32, Place)],
        parted: &[(u32, Place)],
    ) {
        let within = |cell: Place| (0..dimension).all(|k| (0..edge).contains(&cell[k]));
        let body = |cell: Place| within(cell) && !holes.contains(&cell);
        let mut pattern = Pattern::new(dimension, finest);
        for (level, place) in parted {
            let place = std::array::from_fn(|k| if k < dimension { place[k] } else { 0 });
            if let (level @ 1.., place) = canonical(level % (finest + 1), place) {
                pattern.part(level, place);
            }
        }
        for (level, place) in picks {
            let place = std::array::from_fn(|k| if k < dimension { place[k] } else { 0 });
            let level = level % finest;
            if pattern.exists(&body, level, place) {
                pattern.refine(&body, level, place);
            }
        }
        let high = std::array::from_fn(|k| if k < dimension { edge } else { 0 });
        let cells = between([0; 3], high).filter(|cell| body(*cell)).count() as f64;
        let is_sound = |pattern: &Pattern| {
            let nodes = nodes(pattern, &body, edge);
            let volume: f64 = nodes.iter().map(|(_, node)| node.share).sum();
            assert!((volume / cells - 1.0).abs() < 1e-13, "{volume} for {cells}");
            for (place, node) in &nodes {
                assert!(node.share > 0.0, "{place:?}: {node:?}");
            }
            for (level, place) in pattern.refined() {
                assert!(pattern.exists(&body, level, place));
                for parent in parents(place).filter(|_| level > 0) {
                    assert!(pattern.refined[level as usize - 1].contains(&parent));
                }
            }
            // A node and the next one in a row differ by one level at most, if no crack lies between them.
            for (place, node) in &nodes {
                for k in (0..dimension).filter(|_| parted.is_empty()) {
                    let next = (1..=1 << finest).find_map(|step| {
                        let mut other = *place;
                        other[k] += step;
                        pattern.node(&body, other)
                    });
                    if let Some(next) = next {
                        assert!(node.level.abs_diff(next.level) <= 1, "{place:?} {k}");
                    }
                }
            }
            nodes
        };
        let mut before = is_sound(&pattern);
        // Some of what was refined becomes coarse again, then the rest of it.
        for every in [3, 1] {
            let mut refined: Vec<(u32, Place)> = pattern.refined().collect();
            refined.sort_unstable_by_key(|(level, place)| (std::cmp::Reverse(*level), *place));
            let earlier = pattern.clone();
            let coarse = refined.into_iter().step_by(every);
            let coarse: Vec<(u32, Place)> = coarse
                .filter(|(level, place)| pattern.coarsen(*level, *place))
                .collect();
            let left = coarse
                .iter()
                .flat_map(|(level, place)| pattern.removed(&body, *level, *place));
            let left: FxHashSet<Place> = left.collect();
            let after = is_sound(&pattern);
            let stays = |(place, _): &&(Place, Node)| !left.contains(place);
            let places = |nodes: Vec<&(Place, Node)>| -> Vec<Place> {
                nodes.into_iter().map(|(place, _)| *place).collect()
            };
            let stayed = places(before.iter().filter(stays).collect());
            assert_eq!(stayed, places(after.iter().collect()));
            // Those that leave have their whole cell to give, but for finer ones that leave with them.
            for (place, node) in before.iter().filter(|node| !stays(node)) {
                let (level, _) = canonical(finest, *place);
                let alone = 0.5_f64.powi((level * dimension as u32) as i32);
                let finer = around_by_half(level, finest, *place, dimension);
                if finer
                    .iter()
                    .all(|other| earlier.node(&body, *other).is_none())
                {
                    assert_eq!((node.level, node.share), (level, alone));
                }
            }
            before = after;
        }
        assert_eq!(before.len() as f64, cells);
    }

    /// The places half a step of a level around a place, in steps of the finest level.
    fn around_by_half(level: u32, finest: u32, place: Place, dimension: usize) -> Vec<Place> {
        if level == finest {
            return Vec::new();
        }
        let scale = 1 << (finest - level - 1);
        let here = place.map(|x| x >> (finest - level));
        around(here, dimension)
            .map(|other| other.map(|x| x * scale))
            .collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn volume_is_kept_in_the_plane(
            holes in prop::collection::vec([0_i64..7, 0_i64..7, 0_i64..1], 0..6),
            picks in prop::collection::vec((0_u32..3, [0_i64..28, 0_i64..28, 0_i64..1]), 0..40),
            parted in prop::collection::vec((1_u32..4, [0_i64..28, 0_i64..28, 0_i64..1]), 1..20),
        ) {
            check((2, 7, 3), &holes, &picks, &[]);
            check((2, 7, 3), &holes, &picks, &parted);
        }

        #[test]
        fn volume_is_kept_in_space(
            holes in prop::collection::vec([0_i64..4, 0_i64..4, 0_i64..4], 0..6),
            picks in prop::collection::vec((0_u32..2, [0_i64..8, 0_i64..8, 0_i64..8]), 0..12),
            parted in prop::collection::vec((1_u32..3, [0_i64..8, 0_i64..8, 0_i64..8]), 1..12),
        ) {
            check((3, 4, 2), &holes, &picks, &[]);
            check((3, 4, 2), &holes, &picks, &parted);
        }
    }
}
