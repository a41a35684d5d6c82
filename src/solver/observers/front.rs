//! Fronts: the farthest position along a line at which a field exceeds a threshold.

use crate::error::{Error, Result};
use crate::problem;

use super::reach::Course;
use super::row_fields::RowFields;
use crate::solver::Simulation;

/// A front whose position along a line is tracked.
pub struct Front {
    rule: problem::Front,
    course: Course,
}

impl Front {
    /// Find the points along the line. Collective.
    ///
    /// # Errors
    /// If no point lies along the line; the error is the same on all ranks.
    pub fn new<const D: usize>(
        simulation: &Simulation<'_, D>,
        rule: &problem::Front,
    ) -> Result<Self> {
        let owned = 0..simulation.model.owned() as u32;
        let course = Course::new(simulation, rule.line, (rule.length, rule.radius), owned);
        if course.is_empty(simulation.comm) {
            let message = format!(
                "[history.front.{}]: no point lies within `radius`, {} m, of the line; points beyond the ends of the line do \
                 not count",
                rule.name, rule.radius
            );
            return Err(Error::input(message).at(&rule.span));
        }
        Ok(Self {
            rule: rule.clone(),
            course,
        })
    }

    /// Farthest position along the line (m) at which the absolute value of the field's component exceeds the
    /// threshold; NaN if no absolute value exceeds the threshold. Collective.
    pub fn position<const D: usize>(
        &self,
        simulation: &mut Simulation<'_, D>,
        fields: &mut RowFields<'_>,
    ) -> f64 {
        let problem::Front {
            field, component, ..
        } = self.rule;
        let values = fields.get(simulation, field);
        let size = |point: usize| {
            let row = &values[field.components() * point..][..field.components()];
            component.of(row).abs()
        };
        let reached = self.course.reached(simulation, self.rule.threshold, size);
        reached.map_or(f64::NAN, |reached| reached.along)
    }
}
