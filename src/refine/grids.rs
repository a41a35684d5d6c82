//! The refined grids of all bodies, and their points.

use std::sync::Arc;

use rayon::prelude::*;

use crate::comm::{Communicator, Found, agree, all_gather_many, least};
use crate::error::{Error, Result};
use crate::families::cutoff;
use crate::points::{LatticeBody, Point, crack};
use crate::problem::{Kind, PreCrack, Problem, Refinement};

use super::grid_index::{GridIndex, canonical, numbered, parents};
use super::grid_index_set::GridIndexSet;
use super::near_coarser::NearCoarser;
use super::pattern::{Node, Pattern};

/// The grids of all bodies; equal on all ranks.
#[derive(Clone)]
pub struct Grids<'a> {
    problem: &'a Problem,
    /// Number of points of level 0 over all ranks.
    coarsest: u64,
    finest: u32,
    bodies: Vec<Option<BodyGrid<'a>>>,
}

/// The grid of a body on a lattice.
#[derive(Clone)]
struct BodyGrid<'a> {
    cells: Arc<LatticeBody<'a>>,
    pattern: Pattern,
}

/// A node: body, level, and the three components of its grid index. The index is in spacings of the node's
/// level, except in the result of [`Grids::coarsen`].
pub type NodeKey = [i64; 5];

/// Sort key of nodes, finer levels first.
fn finest_first([body, level, x, y, z]: &NodeKey) -> NodeKey {
    [-level, *body, *z, *y, *x]
}

impl<'a> Grids<'a> {
    /// Create unrefined grids. If the problem has no refinement settings, no grids are created. `coarsest` is
    /// the number of level-0 points of all ranks.
    ///
    /// # Errors
    /// If the cells of a body are too far from the origin to be numbered.
    pub fn new(problem: &'a Problem, coarsest: u64) -> Result<Self> {
        let finest = problem.refinement.as_ref().map_or(0, |r| r.levels);
        let dimension = problem.dimension.count();
        let grid = |body| {
            let cells = LatticeBody::new(problem, body)?;
            let pattern = Pattern::new(dimension, finest);
            Ok(cells.map(|cells| BodyGrid {
                cells: Arc::new(cells),
                pattern,
            }))
        };
        let bodies = if finest == 0 {
            Vec::new()
        } else {
            (0..problem.bodies.len()).map(grid).collect::<Result<_>>()?
        };
        Ok(Self {
            problem,
            coarsest,
            finest,
            bodies,
        })
    }

    /// Number of level-0 points of all ranks. Ids of finer points are at least this number.
    pub fn coarsest(&self) -> u64 {
        self.coarsest
    }

    /// Permanently refine the nodes in the refinement regions of the problem. A new node is suppressed if a
    /// pre-crack separates two of its parents. `coarse` are this rank's level-0 points. Collective.
    ///
    /// # Errors
    /// If a region contains no point of a body given as a shape, or its condition is NaN at a node. The error
    /// is the same on all ranks.
    pub fn refine_regions(&mut self, comm: &dyn Communicator, coarse: &[Point]) -> Result<()> {
        let problem = self.problem;
        let Some(refinement) = &problem.refinement else {
            return Ok(());
        };
        let unrefined = self.clone();
        for region in &refinement.regions {
            for level in 0..region.level {
                let mut keys: Vec<NodeKey> = Vec::new();
                let mut undefined: Option<Found<[f64; 3]>> = None;
                for point in coarse {
                    let Some(grid) = &self.bodies[point.block as usize] else {
                        continue;
                    };
                    grid.for_each_node(point.position, level, &mut |index, position| {
                        let value = region.condition.evaluate(position, 0.0);
                        if value.is_nan() {
                            let found = Found {
                                key: 0.0,
                                ids: [point.id],
                                payload: position,
                            };
                            if undefined.is_none_or(|first| found.ids < first.ids) {
                                undefined = Some(found);
                            }
                        } else if value != 0.0 {
                            let [x, y, z] = index;
                            keys.push([i64::from(point.block), i64::from(level), x, y, z]);
                        }
                    });
                }
                if let Some(found) = least(comm, undefined) {
                    let message = format!(
                        "[refinement.region.{}] where: is NaN at {:?} m",
                        region.name,
                        &found.payload[..problem.dimension.count()]
                    );
                    return Err(Error::input(message).at(&region.span));
                }
                let all = all_gather_many(comm, &keys);
                if all.is_empty() {
                    let message = format!(
                        "[refinement.region.{}] where: there is no point of a body given as a shape",
                        region.name
                    );
                    let error = Error::input(message).at(&region.span);
                    return agree(comm, Err(error));
                }
                self.refine(&all);
            }
        }
        let crosses = |crack: &PreCrack, a, b| crack::crosses(&crack.surface, a, b);
        self.suppress_separated(&unrefined, &|a, b| {
            problem.cracks.iter().any(|crack| crosses(crack, a, b))
        });
        for grid in self.bodies.iter_mut().flatten() {
            grid.pattern.make_permanent();
        }
        Ok(())
    }

    /// Refine nodes and their ancestors. Return whether any of these nodes was not refined before.
    pub fn refine(&mut self, keys: &[NodeKey]) -> bool {
        let mut changed = false;
        for [body, level, x, y, z] in keys {
            let Some(BodyGrid { cells, pattern }) = &mut self.bodies[*body as usize] else {
                continue;
            };
            changed |= pattern.refine(&|cell| cells.has_cell(cell), *level as u32, [*x, *y, *z]);
        }
        changed
    }

    /// Coarsen nodes, except permanent nodes and parents of refined nodes.
    ///
    /// Return the keys of the removed nodes, finest level first and without duplicates. A key contains the
    /// body, the canonical level, and the grid index in spacings of the finest level.
    pub fn coarsen(&mut self, keys: &[NodeKey]) -> Vec<NodeKey> {
        let mut coarse: Vec<NodeKey> = keys.to_vec();
        // Finer nodes come first, because they block the coarsening of their parents.
        coarse.sort_unstable_by_key(finest_first);
        coarse.retain(|[body, level, x, y, z]| {
            let grid = self.bodies[*body as usize].as_mut();
            grid.is_some_and(|grid| grid.pattern.coarsen(*level as u32, [*x, *y, *z]))
        });
        let mut removed: Vec<NodeKey> = Vec::new();
        for [number, level, x, y, z] in coarse {
            let Some(BodyGrid { cells, pattern }) = &self.bodies[number as usize] else {
                continue;
            };
            let body = |cell| cells.has_cell(cell);
            let indices = pattern.removed(&body, level as u32, [x, y, z]);
            removed.extend(indices.map(|[x, y, z]| [number, level + 1, x, y, z]));
        }
        removed.sort_unstable_by_key(finest_first);
        removed.dedup();
        removed
    }

    /// The node to coarsen at `position` (m) in a body: the finest refined node there. `None` if this node is
    /// permanent, if no node is refined there, or if the body has no refined grid.
    pub fn coarsening(&self, body: usize, position: [f64; 3]) -> Option<NodeKey> {
        let index = self.index_at(body, position)?;
        let (level, [x, y, z]) = self.bodies.get(body)?.as_ref()?.pattern.refined_at(index)?;
        Some([body as i64, i64::from(level), x, y, z])
    }

    /// Suppress each node that is new since `earlier`, if any two of its parents are separated. `separated`
    /// tests whether two parents are separated, given their positions (m).
    pub fn suppress_separated(
        &mut self,
        earlier: &Self,
        separated: &impl Fn([f64; 3], [f64; 3]) -> bool,
    ) {
        for (grid, earlier) in self.bodies.iter_mut().zip(&earlier.bodies) {
            let (Some(grid), Some(earlier)) = (grid, earlier) else {
                continue;
            };
            for level in 1..=self.finest {
                let cells = &grid.cells;
                let body = |cell| cells.has_cell(cell);
                for index in grid.pattern.created_since(&earlier.pattern, &body, level) {
                    let parents = parents(index).map(|parent| grid.position(level - 1, parent));
                    let parents: Vec<[f64; 3]> = parents.collect();
                    let mut pairs = (1..parents.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
                    if pairs.any(|(a, b)| separated(parents[a], parents[b])) {
                        grid.pattern.suppress(level, index);
                    }
                }
            }
        }
    }

    /// Return one face per suppressed node that is half-way between two adjacent nodes of a level. It is the
    /// face between the cells of these two nodes. Each item contains the centre of the face (m), the edge
    /// lengths of the cells (m), and the axis normal to the face.
    pub fn suppressed_faces(&self) -> Vec<([f64; 3], [f64; 3], usize)> {
        let mut faces = Vec::new();
        for (body, grid) in self.bodies.iter().enumerate() {
            let Some(grid) = grid else { continue };
            for (level, index) in grid.pattern.suppressed() {
                let mut half_way = (0..3).filter(|k| index[*k] & 1 == 1);
                let number = self.problem.block_number(body, level - 1, Kind::Whole);
                if let (Some(axis), None) = (half_way.next(), half_way.next())
                    && let Some(edges) = self.problem.block(number).spacing()
                {
                    faces.push((grid.position(level, index), edges, axis));
                }
            }
        }
        faces
    }

    /// Two sorted lists: the refined nodes, and the suppressed nodes. A suppressed node is stored with its
    /// canonical level, and with its index at this level.
    pub fn state(&self) -> [Vec<NodeKey>; 2] {
        let mut state = [Vec::new(), Vec::new()];
        for (body, grid) in (0..).zip(&self.bodies) {
            let key = |(level, [x, y, z]): (u32, GridIndex)| [body, i64::from(level), x, y, z];
            let [refined, suppressed] = &mut state;
            refined.extend(grid.iter().flat_map(|grid| grid.pattern.refined()).map(key));
            suppressed.extend(
                grid.iter()
                    .flat_map(|grid| grid.pattern.suppressed())
                    .map(key),
            );
        }
        state.iter_mut().for_each(|keys| keys.sort_unstable());
        state
    }

    /// Apply two lists that [`Self::state`] returned: refine the nodes of the first list, and suppress the
    /// nodes of the second list. Return true if at least one node of the first list was not refined before.
    pub fn refine_to(&mut self, [refined, suppressed]: &[Vec<NodeKey>; 2]) -> bool {
        for [body, level, x, y, z] in suppressed {
            if let Some(Some(grid)) = self.bodies.get_mut(*body as usize) {
                grid.pattern.suppress(*level as u32, [*x, *y, *z]);
            }
        }
        self.refine(refined)
    }

    /// The node to refine for a point of block `block` at `position` (m). `None` if the point has the finest
    /// level, or if its body is on no lattice.
    pub fn refining(&self, block: usize, position: [f64; 3]) -> Option<NodeKey> {
        let level = self.problem.block(block).level;
        if level == self.finest {
            return None;
        }
        let body = self.problem.body_of(block);
        let [x, y, z] = self
            .index_at(body, position)?
            .map(|x| x >> (self.finest - level));
        Some([body as i64, i64::from(level), x, y, z])
    }

    /// Return the grid index of a position (m) in a body, in spacings of the finest level. `None` if the body
    /// is on no lattice, or if the problem has no refinement.
    pub fn index_at(&self, body: usize, position: [f64; 3]) -> Option<GridIndex> {
        let grid = self.bodies.get(body)?.as_ref()?;
        Some(grid.cells.index_at(position, f64::from(1 << self.finest)))
    }

    /// Reference position (m) of the grid index `index`, which is in spacings of the finest level. `None` if
    /// the index is not on the grid of level 0, if the body is on no lattice, or if the problem has no
    /// refinement.
    pub fn coarse_position(&self, body: usize, index: GridIndex) -> Option<[f64; 3]> {
        let grid = self.bodies.get(body)?.as_ref()?;
        (canonical(self.finest, index).0 == 0).then(|| grid.position(self.finest, index))
    }

    /// The parents of a node that is not on the grid of level 0. All indices are in spacings of the finest
    /// level.
    pub fn parents(&self, index: GridIndex) -> Vec<GridIndex> {
        let (level, index) = canonical(self.finest, index);
        let steps = 1 << (self.finest + 1 - level);
        parents(index)
            .map(|parent| parent.map(|x| x * steps))
            .collect()
    }

    /// Reset level-0 points to the volume and block that they have without refinement.
    pub fn unrefined(&self, points: impl Iterator<Item = Point>) -> Vec<Point> {
        let unrefined = |mut point: Point| {
            let body = self.problem.body_of(point.block as usize);
            point.block = body as u32;
            if let Some(grid) = &self.bodies[body] {
                point.volume = grid.cells.cell_volume();
            }
            point
        };
        points.map(unrefined).collect()
    }

    /// The points in the cells of the level-0 points `coarse`. Each point of `coarse` has the volume and
    /// block that it has without refinement. The result begins with the points of `coarse`, with updated
    /// volumes and blocks. Finer points follow.
    pub fn points(&self, mut coarse: Vec<Point>) -> Vec<Point> {
        let bodies = self.bodies.iter().enumerate().map(|(body, grid)| {
            let grid = grid.as_ref()?;
            let interfaces = self.interfaces(body, &grid.pattern);
            Some((grid, grid.pattern.changed(), interfaces))
        });
        let bodies: Vec<_> = bodies.collect();
        if bodies.is_empty() {
            return coarse;
        }
        let refine = |point: &mut Point| {
            let body = point.block as usize;
            let (grid, changed, interfaces) = bodies[body].as_ref()?;
            let cell = grid.cells.cell_at(point.position);
            if !changed.contains(cell) {
                return None;
            }
            let origin = cell.map(|x| x << self.finest);
            let cell_volume = point.volume;
            let block = |index, node: &Node| self.block(body, interfaces, grid, index, node);
            let mut finer = Vec::new();
            if grid.pattern.touches(cell) {
                for number in 1..1_u64 << (self.finest as usize * self.problem.dimension.count()) {
                    let index = numbered(origin, self.finest, number);
                    if let Some(node) = grid.node(index) {
                        let id = point.id + self.coarsest * number;
                        let block = block(index, &node);
                        let position = grid.position(self.finest, index);
                        let volume = cell_volume * node.volume_fraction;
                        finer.push(Point::new(id, position, volume, block));
                    }
                }
            }
            if let Some(node) = grid.node(origin) {
                point.volume = cell_volume * node.volume_fraction;
                point.block = block(origin, &node) as u32;
            }
            Some(finer)
        };
        let finer: Vec<Vec<Point>> = coarse.par_iter_mut().filter_map(refine).collect();
        coarse.extend(finer.into_iter().flatten());
        coarse
    }

    /// Return one test for each level from 1 on. The test of a level checks whether a node of this level has
    /// nodes of coarser levels within its horizon. The result is empty if horizons are not enlarged at
    /// interfaces.
    fn interfaces<'p>(&self, body: usize, pattern: &'p Pattern) -> Vec<NearCoarser<'p>> {
        let is_enlarged = |refinement: &Refinement| refinement.interface_factor != 1.0;
        if !self.problem.refinement.as_ref().is_some_and(is_enlarged) {
            // Without enlarged horizons, no test is needed, because nodes at interfaces can be in the same
            // block as other nodes.
            return Vec::new();
        }
        let of_level = |level| {
            let number = self.problem.block_number(body, level, Kind::Whole);
            let block = self.problem.block(number);
            let edges = block.spacing()?;
            Some(NearCoarser::new(
                pattern,
                level,
                edges,
                cutoff(block.horizon),
            ))
        };
        (1..=self.finest).filter_map(of_level).collect()
    }

    fn block(
        &self,
        body: usize,
        interfaces: &[NearCoarser],
        grid: &BodyGrid,
        index: GridIndex,
        node: &Node,
    ) -> usize {
        let cells = &grid.cells;
        let near_coarser = node.level.checked_sub(1).is_some_and(|k| {
            let index = index.map(|x| x >> (self.finest - node.level));
            let interface = interfaces.get(k as usize);
            interface.is_some_and(|nodes| nodes.has(&|cell| cells.has_cell(cell), index))
        });
        let kind = if near_coarser {
            Kind::NearCoarser
        } else if node.has_cell_volume {
            Kind::Whole
        } else {
            Kind::Partial
        };
        self.problem.block_number(body, node.level, kind)
    }

    /// The level-0 cells of a body in which the points may differ from those of the unrefined grid. `None` if
    /// the body is not on a lattice, or if the problem has no refinement.
    pub fn changed(&self, body: usize) -> Option<GridIndexSet> {
        let grid = self.bodies.get(body)?.as_ref()?;
        Some(grid.pattern.changed())
    }

    /// The cell of level 0 that contains the position `index`. The position is in spacings of the finest
    /// level.
    pub fn cell_of(&self, index: GridIndex) -> GridIndex {
        index.map(|x| x >> self.finest)
    }
}

impl BodyGrid<'_> {
    fn node(&self, index: GridIndex) -> Option<Node> {
        let cells = &self.cells;
        self.pattern.node(&|cell| cells.has_cell(cell), index)
    }

    /// Return the reference position (m) of a grid index. The index counts spacings of the given level.
    fn position(&self, level: u32, index: GridIndex) -> [f64; 3] {
        let scale = 0.5_f64.powi(level as i32);
        self.cells.position(index.map(|x| x as f64 * scale))
    }

    /// Call `visit(index, position)` for each node of a level in the level-0 cell with this centre (m).
    fn for_each_node(
        &self,
        centre: [f64; 3],
        level: u32,
        visit: &mut impl FnMut(GridIndex, [f64; 3]),
    ) {
        let cells = &self.cells;
        let cell = cells.cell_at(centre);
        let origin = cell.map(|x| x << level);
        let dimension = self.pattern.dimension();
        let count = if level > 0 && self.pattern.touches(cell) {
            1_u64 << (level as usize * dimension)
        } else {
            1
        };
        let body = |cell| cells.has_cell(cell);
        for number in 0..count {
            let index = numbered(origin, level, number);
            if self.pattern.exists(&body, level, index) {
                visit(index, self.position(level, index));
            }
        }
    }
}
