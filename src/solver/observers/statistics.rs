//! Sums and extremes of fields over sets.

use rayon::prelude::*;

use crate::comm;
use crate::comm::sum::{ExactSum, reduce};
use crate::error::Result;
use crate::problem::{self, Statistic};
use crate::solver::Simulation;
use crate::solver::conditions::{members, not_empty};

use super::row_fields::RowFields;

/// Number of points that one task sums; the sums of all tasks are then merged.
const CHUNK: usize = 4096;

/// The statistics of a field over a set.
pub struct FieldStatistics {
    rule: problem::FieldStatistics,
    /// This rank's points of the set.
    points: Vec<u32>,
    /// Volume of the set, m³.
    volume: f64,
}

/// Sums and extremes over some points.
#[derive(Clone)]
struct Totals {
    sum: ExactSum,
    integral: ExactSum,
    minimum: f64,
    maximum: f64,
}

impl Totals {
    const EMPTY: Self = Self {
        sum: ExactSum::ZERO,
        integral: ExactSum::ZERO,
        minimum: f64::INFINITY,
        maximum: f64::NEG_INFINITY,
    };

    fn add(&mut self, value: f64, volume: f64) {
        self.sum.add(value);
        self.integral.add(value * volume);
        self.minimum = self.minimum.min(value);
        self.maximum = self.maximum.max(value);
    }

    fn merge(mut self, other: &Self) -> Self {
        self.sum.merge(&other.sum);
        self.integral.merge(&other.integral);
        self.minimum = self.minimum.min(other.minimum);
        self.maximum = self.maximum.max(other.maximum);
        self
    }
}

/// Name and unit of each column of the statistics.
pub fn columns(rule: &problem::FieldStatistics) -> impl Iterator<Item = (String, &'static str)> {
    let problem::FieldStatistics {
        name, field, of, ..
    } = rule;
    of.iter()
        .map(move |of| (format!("field_{name}_{}", of.name()), of.unit(*field)))
}

impl FieldStatistics {
    /// Find the points of the set. Collective.
    ///
    /// # Errors
    /// If the set is empty; the error is the same on all ranks.
    pub fn new<const D: usize>(
        simulation: &Simulation<'_, D>,
        rule: &problem::FieldStatistics,
    ) -> Result<Self> {
        let (problem, comm, model) = (simulation.problem, simulation.comm, &simulation.model);
        let points = members(problem, model, rule.set);
        let key = format!("[history.field.{}] set", rule.name);
        not_empty(problem, comm, rule.set, &points, (&key, rule.span.clone()))?;
        let mut volume = ExactSum::default();
        points
            .iter()
            .for_each(|point| volume.add(model.volume[*point as usize]));
        let [volume] = reduce(comm, &mut [volume])[..] else {
            unreachable!("one sum")
        };
        Ok(Self {
            rule: rule.clone(),
            points,
            volume,
        })
    }

    /// Compute the sums and extremes over this rank's points of the set.
    fn totals<const D: usize>(
        &self,
        simulation: &mut Simulation<'_, D>,
        fields: &mut RowFields<'_>,
    ) -> Totals {
        let problem::FieldStatistics {
            field, component, ..
        } = self.rule;
        let values = fields.get(simulation, field);
        let volumes = &simulation.model.volume;
        let of_chunk = |points: &[u32]| {
            let mut totals = Totals::EMPTY;
            for point in points.iter().map(|point| *point as usize) {
                let row = &values[field.components() * point..][..field.components()];
                totals.add(component.of(row), volumes[point]);
            }
            totals
        };
        let chunks = self.points.par_chunks(CHUNK).map(of_chunk);
        chunks.reduce(|| Totals::EMPTY, |a, b| a.merge(&b))
    }

    /// Compute the values of all columns, one list per entry of `all`. The values are bitwise the same for
    /// any number of ranks and threads. Collective.
    pub fn values<const D: usize>(
        all: &[Self],
        simulation: &mut Simulation<'_, D>,
        fields: &mut RowFields<'_>,
    ) -> Vec<Vec<f64>> {
        if all.is_empty() {
            return Vec::new();
        }
        let (mut sums, mut smallest, mut largest) = (Vec::new(), Vec::new(), Vec::new());
        for statistics in all {
            let totals = statistics.totals(simulation, fields);
            sums.extend([totals.sum, totals.integral]);
            smallest.push(totals.minimum);
            largest.push(totals.maximum);
        }
        let sums = reduce(simulation.comm, &mut sums);
        comm::min(simulation.comm, &mut smallest);
        simulation.comm.max(&mut largest);
        let values = all.iter().enumerate().map(|(k, statistics)| {
            let (sum, integral) = (sums[2 * k], sums[2 * k + 1]);
            let value = |statistic: &Statistic| match statistic {
                Statistic::Sum => sum,
                Statistic::Integral => integral,
                Statistic::Mean => integral / statistics.volume,
                // The minimum of −0 and 0 depends on their order. Adding 0 turns −0 into 0.
                Statistic::Minimum => smallest[k] + 0.0,
                Statistic::Maximum => largest[k] + 0.0,
            };
            statistics.rule.of.iter().map(value).collect()
        });
        values.collect()
    }
}
