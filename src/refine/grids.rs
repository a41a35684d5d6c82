//! The refined grids of a run's bodies, and their points.

use std::sync::Arc;

use rayon::prelude::*;

use crate::comm::{Communicator, agree, all_gather_many};
use crate::error::{Error, Result};
use crate::families::cutoff;
use crate::points::{LatticeBody, Point, crack};
use crate::problem::{Kind, PreCrack, Problem, Refinement};

use super::at_coarser::AtCoarser;
use super::pattern::{Node, Pattern};
use super::place::{Place, canonical, numbered, parents};
use super::place_set::PlaceSet;

/// The grids of all bodies, by body; the same on all ranks.
#[derive(Clone)]
pub struct Grids<'a> {
    problem: &'a Problem,
    /// Number of points of level 0 over all ranks.
    coarsest: u64,
    finest: u32,
    bodies: Vec<Option<BodyGrid<'a>>>,
}

/// The grid of a body that is given as a shape.
#[derive(Clone)]
struct BodyGrid<'a> {
    cells: Arc<LatticeBody<'a>>,
    pattern: Pattern,
}

/// A node that is to be refined: body, level, and place in steps of the level.
pub type NodeKey = [i64; 5];

/// An order of nodes in which finer ones come first.
fn finest_first([body, level, x, y, z]: &NodeKey) -> NodeKey {
    [-level, *body, *z, *y, *x]
}

impl<'a> Grids<'a> {
    /// Grids in which nothing is refined, of a problem with so many points of level 0 over all ranks; without
    /// refinement there is none.
    ///
    /// # Errors
    /// When the cells of a body are too far away to be numbered.
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

    /// Number of points of level 0 over all ranks; those of finer levels have ids from this on.
    pub fn coarsest(&self) -> u64 {
        self.coarsest
    }

    /// Refines what the problem wants from the start, but for nodes between places that a pre-crack parts;
    /// `coarse` are this rank's points of level 0. Collective.
    ///
    /// # Errors
    /// When there is no point in a region; the same on all ranks.
    pub fn refine_regions(&mut self, comm: &dyn Communicator, coarse: &[Point]) -> Result<()> {
        let problem = self.problem;
        let Some(refinement) = &problem.refinement else {
            return Ok(());
        };
        let whole = self.clone();
        for region in &refinement.regions {
            for level in 0..region.level {
                let mut keys: Vec<NodeKey> = Vec::new();
                for point in coarse {
                    let Some(grid) = &self.bodies[point.block as usize] else {
                        continue;
                    };
                    grid.for_each_node(point.position, level, &mut |place, position| {
                        if region.condition.is_true(position, 0.0) {
                            let [x, y, z] = place;
                            keys.push([i64::from(point.block), i64::from(level), x, y, z]);
                        }
                    });
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
        self.part(&whole, &|a, b| {
            problem.cracks.iter().any(|crack| crosses(crack, a, b))
        });
        for grid in self.bodies.iter_mut().flatten() {
            grid.pattern.make_last();
        }
        Ok(())
    }

    /// Refines nodes, and what must be refined with them. Returns whether any were not yet.
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

    /// Makes refined nodes coarse again, but for those that are refined from the start or are needed by finer ones.
    /// Returns the nodes that are no longer there: body, level of their birth, and place in steps of the
    /// finest level, the finest level first, each once.
    pub fn coarsen(&mut self, keys: &[NodeKey]) -> Vec<NodeKey> {
        let mut coarse: Vec<NodeKey> = keys.to_vec();
        // Finer nodes first, for they need the coarser ones.
        coarse.sort_unstable_by_key(finest_first);
        coarse.retain(|[body, level, x, y, z]| {
            let grid = self.bodies[*body as usize].as_mut();
            grid.is_some_and(|grid| grid.pattern.coarsen(*level as u32, [*x, *y, *z]))
        });
        let mut left: Vec<NodeKey> = Vec::new();
        for [number, level, x, y, z] in coarse {
            let Some(BodyGrid { cells, pattern }) = &self.bodies[number as usize] else {
                continue;
            };
            let body = |cell| cells.has_cell(cell);
            let gone = pattern.removed(&body, level as u32, [x, y, z]);
            left.extend(gone.map(|[x, y, z]| [number, level + 1, x, y, z]));
        }
        left.sort_unstable_by_key(finest_first);
        left.dedup();
        left
    }

    /// What making the refined point of a body at a position (m) coarse means; none if it is not refined, or was
    /// from the start.
    pub fn coarsening(&self, body: usize, position: [f64; 3]) -> Option<NodeKey> {
        let place = self.place_at(body, position)?;
        let (level, [x, y, z]) = self.bodies.get(body)?.as_ref()?.pattern.refined_at(place)?;
        Some([body as i64, i64::from(level), x, y, z])
    }

    /// Of the nodes that have come since an earlier state, takes back those that lie between places (m) which
    /// are `parted`, and leaves their places without nodes.
    pub fn part(&mut self, earlier: &Self, parted: &impl Fn([f64; 3], [f64; 3]) -> bool) {
        for (grid, earlier) in self.bodies.iter_mut().zip(&earlier.bodies) {
            let (Some(grid), Some(earlier)) = (grid, earlier) else {
                continue;
            };
            for level in 1..=self.finest {
                let cells = &grid.cells;
                let body = |cell| cells.has_cell(cell);
                for place in grid.pattern.born_since(&earlier.pattern, &body, level) {
                    let parents = parents(place).map(|parent| grid.position(level - 1, parent));
                    let parents: Vec<[f64; 3]> = parents.collect();
                    let mut pairs = (1..parents.len()).flat_map(|b| (0..b).map(move |a| (a, b)));
                    if pairs.any(|(a, b)| parted(parents[a], parents[b])) {
                        grid.pattern.part(level, place);
                    }
                }
            }
        }
    }

    /// The faces between nodes next to one another between which no node is born: centre (m), edges of the nodes'
    /// cells (m), and the axis across.
    pub fn parted_faces(&self) -> Vec<([f64; 3], [f64; 3], usize)> {
        let mut faces = Vec::new();
        for (body, grid) in self.bodies.iter().enumerate() {
            let Some(grid) = grid else { continue };
            for (level, place) in grid.pattern.parted() {
                let mut half_way = (0..3).filter(|k| place[*k] & 1 == 1);
                let number = self.problem.block_number(body, level - 1, Kind::Whole);
                if let (Some(axis), None) = (half_way.next(), half_way.next())
                    && let Some(edges) = self.problem.block(number).spacing()
                {
                    faces.push((grid.position(level, place), edges, axis));
                }
            }
        }
        faces
    }

    /// All nodes that are refined, and all places without nodes with the level that they would be born at.
    pub fn state(&self) -> [Vec<NodeKey>; 2] {
        let mut state = [Vec::new(), Vec::new()];
        for (body, grid) in (0..).zip(&self.bodies) {
            let pick = |(level, [x, y, z]): (u32, Place)| [body, i64::from(level), x, y, z];
            let [refined, parted] = &mut state;
            refined.extend(
                grid.iter()
                    .flat_map(|grid| grid.pattern.refined())
                    .map(pick),
            );
            parted.extend(grid.iter().flat_map(|grid| grid.pattern.parted()).map(pick));
        }
        state.iter_mut().for_each(|keys| keys.sort_unstable());
        state
    }

    /// Refines to what [`Self::state`] gave. Returns whether anything was not yet.
    pub fn refine_to(&mut self, [refined, parted]: &[Vec<NodeKey>; 2]) -> bool {
        for [body, level, x, y, z] in parted {
            if let Some(Some(grid)) = self.bodies.get_mut(*body as usize) {
                grid.pattern.part(*level as u32, [*x, *y, *z]);
            }
        }
        self.refine(refined)
    }

    /// What refining the point of a block at a position (m) means; none if it is of the finest level.
    pub fn pick(&self, block: usize, position: [f64; 3]) -> Option<NodeKey> {
        let level = self.problem.block(block).level;
        if level == self.finest {
            return None;
        }
        let body = self.problem.body_of(block);
        let [x, y, z] = self
            .place_at(body, position)?
            .map(|x| x >> (self.finest - level));
        Some([body as i64, i64::from(level), x, y, z])
    }

    /// The place of a point of a body at a position (m), in steps of the finest level.
    pub fn place_at(&self, body: usize, position: [f64; 3]) -> Option<Place> {
        let grid = self.bodies.get(body)?.as_ref()?;
        Some(grid.cells.place_at(position, f64::from(1 << self.finest)))
    }

    /// Reference position (m) of a place of a body in steps of the finest level, if it is one of level 0.
    pub fn coarse_position(&self, body: usize, place: Place) -> Option<[f64; 3]> {
        let grid = self.bodies.get(body)?.as_ref()?;
        (canonical(self.finest, place).0 == 0).then(|| grid.position(self.finest, place))
    }

    /// The places, in steps of the finest level, of the points that one lies between.
    pub fn parents(&self, place: Place) -> Vec<Place> {
        let (level, place) = canonical(self.finest, place);
        let steps = 1 << (self.finest + 1 - level);
        parents(place)
            .map(|parent| parent.map(|x| x * steps))
            .collect()
    }

    /// Points of level 0 as they are without refinement.
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

    /// The points in the cells of `coarse`, points of level 0 as they are without refinement: those with
    /// the volume and the block that they have with it, and those of finer levels.
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
            let block = |place, node: &Node| self.block(body, interfaces, grid, place, node);
            let mut finer = Vec::new();
            if grid.pattern.touches(cell) {
                for part in 1..1_u64 << (self.finest as usize * self.problem.dimension.count()) {
                    let place = numbered(origin, self.finest, part);
                    if let Some(node) = grid.node(place) {
                        let id = point.id + self.coarsest * part;
                        let block = block(place, &node);
                        let place = grid.position(self.finest, place);
                        finer.push(Point::new(id, place, cell_volume * node.share, block));
                    }
                }
            }
            if let Some(node) = grid.node(origin) {
                point.volume = cell_volume * node.share;
                point.block = block(origin, &node) as u32;
            }
            Some(finer)
        };
        let finer: Vec<Vec<Point>> = coarse.par_iter_mut().filter_map(refine).collect();
        coarse.extend(finer.into_iter().flatten());
        coarse
    }

    /// Which nodes of each level from 1 on have coarser ones within their horizon; none where horizons are not
    /// enlarged for it.
    fn interfaces<'p>(&self, body: usize, pattern: &'p Pattern) -> Vec<AtCoarser<'p>> {
        let is_enlarged = |refinement: &Refinement| refinement.interface_factor != 1.0;
        if !self.problem.refinement.as_ref().is_some_and(is_enlarged) {
            // They can share a lattice with the others.
            return Vec::new();
        }
        let of_level = |level| {
            let number = self.problem.block_number(body, level, Kind::Whole);
            let block = self.problem.block(number);
            let edges = block.spacing()?;
            Some(AtCoarser::new(pattern, level, edges, cutoff(block.horizon)))
        };
        (1..=self.finest).filter_map(of_level).collect()
    }

    fn block(
        &self,
        body: usize,
        interfaces: &[AtCoarser],
        grid: &BodyGrid,
        place: Place,
        node: &Node,
    ) -> usize {
        let cells = &grid.cells;
        let at_coarser = node.level.checked_sub(1).is_some_and(|k| {
            let place = place.map(|x| x >> (self.finest - node.level));
            let interface = interfaces.get(k as usize);
            interface.is_some_and(|nodes| nodes.has(&|cell| cells.has_cell(cell), place))
        });
        let kind = if at_coarser {
            Kind::AtCoarser
        } else if node.whole {
            Kind::Whole
        } else {
            Kind::Partial
        };
        self.problem.block_number(body, node.level, kind)
    }

    /// Which cells of a body hold points that are other than without refinement, or nodes that are next to them;
    /// none for a body that is not given as a shape.
    pub fn changed(&self, body: usize) -> Option<PlaceSet> {
        let grid = self.bodies.get(body)?.as_ref()?;
        Some(grid.pattern.changed())
    }

    /// The cell of level 0 that a place of a body, in steps of the finest level, lies in.
    pub fn cell_of(&self, place: Place) -> Place {
        place.map(|x| x >> self.finest)
    }
}

impl BodyGrid<'_> {
    fn node(&self, place: Place) -> Option<Node> {
        let cells = &self.cells;
        self.pattern.node(&|cell| cells.has_cell(cell), place)
    }

    /// Reference position (m) of a place in steps of a level.
    fn position(&self, level: u32, place: Place) -> [f64; 3] {
        let scale = 0.5_f64.powi(level as i32);
        self.cells.place(place.map(|x| x as f64 * scale))
    }

    /// Calls `found` with the place, in steps of a level, and the reference position (m) of each node of
    /// the level's grid in the cell whose centre is at a position (m).
    fn for_each_node(&self, centre: [f64; 3], level: u32, found: &mut impl FnMut(Place, [f64; 3])) {
        let cells = &self.cells;
        let cell = cells.cell_at(centre);
        let origin = cell.map(|x| x << level);
        let dimension = self.pattern.dimension();
        let parts = if level > 0 && self.pattern.touches(cell) {
            1_u64 << (level as usize * dimension)
        } else {
            1
        };
        let body = |cell| cells.has_cell(cell);
        for part in 0..parts {
            let place = numbered(origin, level, part);
            if self.pattern.exists(&body, level, place) {
                found(place, self.position(level, place));
            }
        }
    }
}
