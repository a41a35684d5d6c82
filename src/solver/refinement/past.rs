//! What points have before a refinement, and what new ones begin with.

use rustc_hash::FxHashMap;

use crate::points::Point;
use crate::refine::{Grids, Pick, Place};
use crate::solver::Simulation;
use crate::solver::motion::fields::Birth;

/// Instead of a block, of a point that was not there before a refinement.
pub const NOWHERE: f64 = -1.0;

/// What local points, ghosts included, have before a refinement: the numbers of their state, energies as
/// densities, and at last their block.
pub struct Past {
    pub columns: Vec<Vec<f64>>,
    /// What new points have of each.
    births: Vec<Birth>,
    /// Local index by body and place, in steps of the finest level.
    at: FxHashMap<(usize, Place), usize>,
    /// Which local points leave.
    leaves: Vec<bool>,
}

impl Past {
    /// Before the nodes `left` leave, each with its body, the level of its birth and its place in steps of the
    /// finest level, the finest level first, the same on all ranks. Collective.
    pub fn new<const D: usize>(
        simulation: &mut Simulation<'_, D>,
        grids: &Grids<'_>,
        left: &[Pick],
    ) -> Self {
        let (plan, comm) = (simulation.plan, simulation.comm);
        let model = &simulation.model;
        let (owned, local) = (model.owned(), model.volume.len());
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let mut births = Vec::new();
        for (field, state) in simulation.fields.each().filter(|(field, _)| field.state) {
            for column in state {
                let volumes = model.volume.iter();
                let value = |(value, volume): (&f64, &f64)| match field.birth {
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
            simulation.forces.bring(comm, column);
        }
        let blocks = &columns[columns.len() - 1];
        let place = |point: usize| {
            let body = plan.body_of(blocks[point] as usize);
            let place = grids.place_at(body, simulation.model.position(point))?;
            Some(((body, place), point))
        };
        let at = (0..local).filter_map(place).collect();
        let mut past = Self {
            columns,
            births,
            at,
            leaves: vec![false; local],
        };
        if !left.is_empty() {
            past.leave(simulation, grids, left);
        }
        past
    }

    /// Lets those that points which leave lie between have what these have, so that volume, mass, momentum and
    /// energies stay. Collective.
    fn leave<const D: usize>(
        &mut self,
        simulation: &mut Simulation<'_, D>,
        grids: &Grids<'_>,
        left: &[Pick],
    ) {
        let comm = simulation.comm;
        let owned = simulation.model.owned();
        let mut volume = simulation.model.volume.clone();
        for level in left.chunk_by(|a, b| a[1] == b[1]) {
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
                simulation.forces.bring(comm, column);
            }
            volume = grown;
            simulation.forces.bring(comm, &mut volume);
        }
        for [body, _, x, y, z] in left {
            if let Some(point) = self.at.get(&(*body as usize, [*x, *y, *z])) {
                self.leaves[*point] = true;
            }
        }
    }

    /// The owned points that stay.
    pub fn staying(&self, owned: usize) -> impl Iterator<Item = usize> {
        (0..owned).filter(|point| !self.leaves[*point])
    }

    /// A node and those that it lies between, if this rank has all of them.
    fn with_parents(
        &self,
        grids: &Grids<'_>,
        [body, _, x, y, z]: &Pick,
    ) -> Option<(usize, Vec<usize>)> {
        let (body, place) = (*body as usize, [*x, *y, *z]);
        let at = |place: Place| self.at.get(&(body, place)).copied();
        let parents = grids.parents(place).into_iter().map(at);
        Some((at(place)?, parents.collect::<Option<_>>()?))
    }

    /// Ids and rows of the owned points that stay and of those that are born in this rank's `pieces`.
    pub fn rows<const D: usize>(
        &self,
        simulation: &Simulation<'_, D>,
        grids: &Grids<'_>,
        pieces: &[Point],
    ) -> (Vec<u64>, Vec<f64>) {
        let model = &simulation.model;
        let mut ids = Vec::new();
        let mut rows: Vec<f64> = Vec::new();
        for point in self.staying(model.owned()) {
            ids.push(model.ids[point]);
            rows.extend(self.columns.iter().map(|column| column[point]));
        }
        let mut born = FxHashMap::default();
        for piece in pieces {
            let body = simulation.plan.body_of(piece.block as usize);
            let Some(place) = grids.place_at(body, piece.position) else {
                continue;
            };
            if !self.at.contains_key(&(body, place)) {
                ids.push(piece.id);
                rows.extend(self.row(grids, body, place, &mut born));
            }
        }
        (ids, rows)
    }

    /// The row of a place: of the point there, or the mean of those that it lies between.
    fn row(
        &self,
        grids: &Grids<'_>,
        body: usize,
        place: Place,
        born: &mut FxHashMap<(usize, Place), Vec<f64>>,
    ) -> Vec<f64> {
        if let Some(point) = self.at.get(&(body, place)) {
            return self.columns.iter().map(|column| column[*point]).collect();
        }
        if let Some(row) = born.get(&(body, place)) {
            return row.clone();
        }
        let mut row = vec![0.0; self.columns.len()];
        let parents = grids.parents(place);
        for parent in &parents {
            let theirs = self.row(grids, body, *parent, born);
            row.iter_mut()
                .zip(theirs)
                .for_each(|(sum, value)| *sum += value);
        }
        for (value, birth) in row.iter_mut().zip(&self.births) {
            *value = match birth {
                Birth::FoundAnew => 0.0,
                _ => *value / parents.len() as f64,
            };
        }
        *row.last_mut().expect("the block") = NOWHERE;
        born.insert((body, place), row.clone());
        row
    }
}
