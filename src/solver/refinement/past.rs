//! State of points before a refinement, from which new points get their initial state.

use rustc_hash::FxHashMap;

use crate::points::Point;
use crate::refine::{GridIndex, Grids, NodeKey};
use crate::solver::Simulation;
use crate::solver::motion::fields::Birth;

/// Placeholder for the previous block of a point that did not exist before a refinement.
pub const NOWHERE: f64 = -1.0;

/// State of the local points, including ghosts, before a refinement. Energies are stored as densities. The
/// last column is the block of the point.
pub struct Past {
    pub columns: Vec<Vec<f64>>,
    /// For each column, the rule by which new points get their values.
    births: Vec<Birth>,
    /// Local index by body and grid index (in spacings of the finest level). The map contains only points in
    /// certain level-0 cells. [`Grids::changed`] returns these cells, for the grids before the refinement or
    /// for the grids after it.
    at: FxHashMap<(usize, GridIndex), usize>,
    /// Whether each local point is removed.
    is_removed: Vec<bool>,
}

impl Past {
    /// Collect the state of the points. `removed` are the nodes that the refinement will remove; the values
    /// of these nodes are added to their parents. Each node consists of its body, its canonical level, and
    /// its grid index in steps of the finest level. Nodes of the finest level must come first. All ranks pass
    /// the same nodes. Collective.
    pub fn new<const D: usize>(
        simulation: &mut Simulation<'_, D>,
        grids: &Grids<'_>,
        removed: &[NodeKey],
    ) -> Self {
        let (problem, comm) = (simulation.problem, simulation.comm);
        let model = &simulation.model;
        let (owned, local) = (model.owned(), model.volume.len());
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let mut births = Vec::new();
        for (field, state) in simulation.fields.each().filter(|(field, _)| field.state) {
            for column in state {
                let volumes = model.volume.iter();
                let value = |(value, volume): (&f64, f64)| match field.birth {
                    Birth::Shared => value / volume,
                    _ => *value,
                };
                columns.push(column[..owned].iter().zip(volumes).map(value).collect());
                births.push(field.birth);
            }
        }
        columns.push(model.block.iter().map(|block| f64::from(*block)).collect());
        births.push(Birth::FoundAnew);
        for column in &mut columns {
            column.resize(local, 0.0);
            simulation.forces.update_ghosts(comm, &mut [column]);
        }
        // The parents of new and removed points lie in level-0 cells in which the grid differs from an
        // unrefined grid, before or after the refinement.
        let bodies = 0..problem.bodies.len();
        let changed =
            bodies.map(|body| [grids, &simulation.grids].map(|grids| grids.changed(body)));
        let changed: Vec<_> = changed.collect();
        let blocks = &columns[columns.len() - 1];
        let place = |point: usize| {
            let body = problem.body_of(blocks[point] as usize);
            let place = grids.index_at(body, simulation.model.position(point))?;
            let cell = grids.cell_of(place);
            let mut changed = changed[body].iter().flatten();
            let is_near = changed.any(|cells| cells.contains(cell));
            is_near.then_some(((body, place), point))
        };
        let at = (0..local).filter_map(place).collect();
        let mut past = Self {
            columns,
            births,
            at,
            is_removed: vec![false; local],
        };
        if !removed.is_empty() {
            past.return_to_parents(simulation, grids, removed);
        }
        past
    }

    /// Add the values of removed points to their parents, so that volume, mass, momentum and energies
    /// are conserved. Collective.
    fn return_to_parents<const D: usize>(
        &mut self,
        simulation: &mut Simulation<'_, D>,
        grids: &Grids<'_>,
        removed: &[NodeKey],
    ) {
        let comm = simulation.comm;
        let owned = simulation.model.owned();
        let mut volume: Vec<f64> = simulation.model.volume.iter().collect();
        for level in removed.chunk_by(|a, b| a[1] == b[1]) {
            let near: Vec<(usize, Vec<usize>)> = level
                .iter()
                .filter_map(|pick| self.with_parents(grids, pick))
                .collect();
            let part = |point: usize, parents: &[usize]| volume[point] / parents.len() as f64;
            let mut grown = volume.clone();
            for (point, parents) in &near {
                let part = part(*point, parents);
                parents.iter().for_each(|parent| grown[*parent] += part);
            }
            for (column, birth) in self.columns.iter_mut().zip(&self.births) {
                if matches!(birth, Birth::FoundAnew | Birth::Interpolated) {
                    continue;
                }
                let mut gain = vec![0.0; owned];
                for (point, parents) in &near {
                    let part = part(*point, parents);
                    let theirs = parents.iter().map(|parent| column[*parent]);
                    let mean = theirs.sum::<f64>() / parents.len() as f64;
                    for parent in parents.iter().filter(|parent| **parent < owned) {
                        let known = if *birth == Birth::Conserved {
                            mean
                        } else {
                            column[*parent]
                        };
                        gain[*parent] += part * (column[*point] - known);
                    }
                }
                for ((value, gain), volume) in column.iter_mut().zip(gain).zip(&grown) {
                    *value += gain / volume;
                }
                simulation.forces.update_ghosts(comm, &mut [column]);
            }
            volume = grown;
            simulation.forces.update_ghosts(comm, &mut [&mut volume]);
        }
        for [body, _, x, y, z] in removed {
            if let Some(point) = self.at.get(&(*body as usize, [*x, *y, *z])) {
                self.is_removed[*point] = true;
            }
        }
    }

    /// The owned points that are not removed.
    pub fn staying(&self, owned: usize) -> impl Iterator<Item = usize> {
        (0..owned).filter(|point| !self.is_removed[*point])
    }

    /// Local indices of a node and of its parents; `None` if this rank does not have all of these points.
    fn with_parents(
        &self,
        grids: &Grids<'_>,
        [body, _, x, y, z]: &NodeKey,
    ) -> Option<(usize, Vec<usize>)> {
        let (body, place) = (*body as usize, [*x, *y, *z]);
        let at = |place: GridIndex| self.at.get(&(body, place)).copied();
        let parents = grids.parents(place).into_iter().map(at);
        Some((at(place)?, parents.collect::<Option<_>>()?))
    }

    /// Return ids and rows of the owned points that are not removed, and of the new points in `points`, which
    /// this rank creates.
    pub fn rows<const D: usize>(
        &self,
        simulation: &Simulation<'_, D>,
        grids: &Grids<'_>,
        points: &[Point],
    ) -> (Vec<u64>, Vec<f64>) {
        let model = &simulation.model;
        let mut ids = Vec::new();
        let mut rows: Vec<f64> = Vec::new();
        for point in self.staying(model.owned()) {
            ids.push(model.ids[point]);
            rows.extend(self.columns.iter().map(|column| column[point]));
        }
        let mut born = Born::default();
        for point in points.iter().filter(|point| point.id >= model.coarsest) {
            let body = simulation.problem.body_of(point.block as usize);
            let Some(place) = grids.index_at(body, point.position) else {
                continue;
            };
            if !self.at.contains_key(&(body, place)) {
                ids.push(point.id);
                let row = self.row(grids, (body, place), &mut born);
                rows.extend_from_slice(&born.rows[row..row + self.columns.len()]);
            }
        }
        (ids, rows)
    }

    /// Return the index in `born.rows` at which the row of a new point starts. If the row does not
    /// exist yet, create it as the mean of the rows of the point's parents. The entries for fields of
    /// [`Birth::FoundAnew`] are 0, and the entry for the block is [`NOWHERE`].
    fn row(&self, grids: &Grids<'_>, (body, place): (usize, GridIndex), born: &mut Born) -> usize {
        if let Some(row) = born.at.get(&(body, place)) {
            return *row;
        }
        let mut row = vec![0.0; self.columns.len()];
        let parents = grids.parents(place);
        for parent in &parents {
            let parent = (body, *parent);
            if let Some(point) = self.at.get(&parent) {
                let columns = row.iter_mut().zip(&self.columns);
                columns.for_each(|(sum, column)| *sum += column[*point]);
            } else {
                let start = self.row(grids, parent, born);
                let values = row.iter_mut().zip(&born.rows[start..]);
                values.for_each(|(sum, value)| *sum += value);
            }
        }
        for (value, birth) in row.iter_mut().zip(&self.births) {
            *value = match birth {
                Birth::FoundAnew => 0.0,
                _ => *value / parents.len() as f64,
            };
        }
        *row.last_mut().expect("the block") = NOWHERE;
        let start = born.rows.len();
        born.rows.extend(row);
        born.at.insert((body, place), start);
        start
    }
}

/// The rows of new points, one after the other.
#[derive(Default)]
struct Born {
    /// Index in `rows` at which each row starts, by body and grid index.
    at: FxHashMap<(usize, GridIndex), usize>,
    rows: Vec<f64>,
}
