//! A run at one moment: fields for the result, found when they are asked for.

use crate::deck::plan::Field;
use crate::solver::Simulation;
use crate::solver::bonds::Stored;

/// What the bonds hold at one moment; found once, used by fields and history.
pub struct Snapshot {
    /// Of the owned points.
    pub stored: Stored,
}

impl Snapshot {
    /// Looks at a run now, whose forces are those of the present place.
    pub fn new<const D: usize>(simulation: &mut Simulation<'_, D>) -> Self {
        Self {
            stored: simulation.forces.stored(&simulation.model),
        }
    }

    /// Damage φ of an owned point: the share of its family's volume that is cut off (Dipasquale et
    /// al. 2014, eq. 7). A point without family has 0.
    pub fn damage(&self, family_volume: &[f64], point: usize) -> f64 {
        match family_volume[point] {
            0.0 => 0.0,
            whole => 1.0 - self.stored.volume[point] / whole,
        }
    }

    /// A field over the owned points, row-major with [`Field::components`] entries a point; of the
    /// moment of the snapshot.
    pub fn field<const D: usize>(
        &self,
        simulation: &mut Simulation<'_, D>,
        field: Field,
    ) -> Vec<f64> {
        let (model, fields) = (&simulation.model, &simulation.fields);
        let count = model.owned();
        if let Some(columns) = fields.offered(field) {
            return rows(columns, count, field.components());
        }
        match field {
            Field::Acceleration => {
                let acceleration = |d: usize, point: usize| {
                    let mut force = fields.acting(model, d, point);
                    if let Some(reaction) = &fields.reaction {
                        force += reaction[d][point];
                    }
                    force / model.density_of(point)
                };
                let columns: [Vec<f64>; D] =
                    std::array::from_fn(|d| (0..count).map(|k| acceleration(d, k)).collect());
                rows(&columns, count, 3)
            }
            Field::Damage => (0..count)
                .map(|point| self.damage(&simulation.family_volume, point))
                .collect(),
            Field::StrainEnergyDensity => self.stored.energy.clone(),
            Field::Neighbours => self.stored.neighbours.clone(),
            Field::Dilatation => {
                let [_, dilatation] = simulation.forces.dilatation(model);
                dilatation
            }
            Field::WeightedVolume => {
                let [volume, _] = simulation.forces.dilatation(model);
                volume
            }
            Field::Stress => rows(&simulation.forces.stress(model), count, 6),
            Field::Rank => vec![simulation.comm.rank() as f64; count],
            Field::Displacement | Field::Velocity | Field::ForceDensity => {
                unreachable!("one of the points' own fields")
            }
        }
    }
}

/// Rows of so many components, 0 where there is no column.
fn rows(columns: &[Vec<f64>], count: usize, components: usize) -> Vec<f64> {
    let mut values = vec![0.0; components * count];
    for (d, column) in columns.iter().enumerate() {
        let places = values.iter_mut().skip(d).step_by(components);
        for (value, number) in places.zip(column) {
            *value = *number;
        }
    }
    values
}
