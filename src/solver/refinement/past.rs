//! What points have before a refinement, and what new ones begin with.

use std::collections::HashMap;

use crate::points::Point;
use crate::refine::{Grids, Place};
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
    at: HashMap<(usize, Place), usize>,
}

impl Past {
    /// Collective.
    pub fn new<const D: usize>(simulation: &mut Simulation<'_, D>, grids: &Grids<'_>) -> Self {
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
        Self {
            columns,
            births,
            at,
        }
    }

    /// Ids and rows of the owned points and of those that are born in this rank's `pieces`.
    pub fn rows<const D: usize>(
        &self,
        simulation: &Simulation<'_, D>,
        grids: &Grids<'_>,
        pieces: &[Point],
    ) -> (Vec<u64>, Vec<f64>) {
        let model = &simulation.model;
        let owned = model.owned();
        let mut ids = model.ids[..owned].to_vec();
        let mut rows: Vec<f64> = Vec::new();
        for point in 0..owned {
            rows.extend(self.columns.iter().map(|column| column[point]));
        }
        let mut born = HashMap::new();
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
        born: &mut HashMap<(usize, Place), Vec<f64>>,
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
                Birth::Interpolated | Birth::Shared => *value / parents.len() as f64,
            };
        }
        *row.last_mut().expect("the block") = NOWHERE;
        born.insert((body, place), row.clone());
        row
    }
}
