//! Check that loads, supports, temperatures, initial values, and the conditions `where` and `only` are finite
//! at all points where they are evaluated.

use std::ops::Range;

use crate::comm::{Communicator, Found, least};
use crate::error::{Error, Result};
use crate::expression::Expression;
use crate::message::format_number;
use crate::problem::{Action, Problem, Selector};
use crate::solver::model::Model;

use super::members;

/// Words before the value in the messages about vector components.
const COMPONENTS: [&str; 3] = ["component x is", "component y is", "component z is"];

/// Check that the values of all conditions that act in a stage are finite at `time` (s) at all of their
/// points, and that thermal stretches are above −1. `stage` is the index of the stage. At time 0, also check
/// that all initial values are finite. Collective.
///
/// # Errors
/// If a value is not finite, or a thermal stretch is −1 or less. The message names the first entry of the
/// deck that fails the check. Of the points at which this entry fails, the message names the point with the
/// smallest id. The error is the same on all ranks.
pub fn are_finite<const D: usize>(
    problem: &Problem,
    comm: &dyn Communicator,
    model: &Model<D>,
    (stage, time): (usize, f64),
) -> Result<()> {
    let check = FiniteCheck {
        problem,
        comm,
        model,
        time,
    };
    if time == 0.0 {
        for initial in &problem.initials {
            for (quantity, values) in [
                ("displacement", &initial.displacement),
                ("velocity", &initial.velocity),
            ] {
                if let Some((values, place)) = values {
                    let key = format!("[initial.{}] {quantity}", initial.name);
                    let values = values.iter().map(Some).zip([1.0; D]);
                    check.check_values(&key, &COMPONENTS, place, Some(initial.set), values)?;
                }
            }
        }
    }
    let stages = problem.all_stages();
    let conditions = problem.conditions.iter().zip(&stages[stage].acting);
    for (condition, _) in conditions.filter(|(_, acting)| **acting) {
        let key = format!("[condition.{}] {}", condition.name, condition.quantity);
        let (place, set) = (&condition.place, condition.set);
        match &condition.action {
            Action::Displacement(values) | Action::Velocity(values) => {
                let values = values.iter().map(Option::as_ref).zip([1.0; D]);
                check.check_values(&key, &COMPONENTS, place, Some(set), values)?;
            }
            Action::BodyForce(values, factors) => {
                // Only the smallest divisor is checked, because this divisor gives the largest load.
                let bodies = problem.sets[set].possible_bodies(&problem.bodies);
                let divisors = condition.divisors(bodies, D);
                let smallest_divisor = divisors.into_iter().fold(f64::INFINITY, f64::min);
                let factors = factors.iter().map(|factor| factor / smallest_divisor);
                let values = values.iter().map(Some).zip(factors);
                check.check_values(&key, &COMPONENTS, place, Some(set), values)?;
            }
            Action::Force(values) => {
                let values = values.iter().map(Some).zip([1.0; D]);
                check.check_values(&key, &COMPONENTS, place, Some(set), values)?;
            }
            Action::Temperature(value) => {
                let values = std::iter::once((Some(value), 1.0));
                check.check_values(&key, &["is"], place, Some(set), values)?;
                check.check_stretches(&key, place, set, value)?;
            }
        }
    }
    Ok(())
}

/// Check that the conditions `where` of all sets are finite at all points. Collective.
///
/// # Errors
/// If a value is not finite. The message names the first set of the deck with such a value, and of the points
/// at which its value is not finite, the point with the smallest id. The error is the same on all ranks.
pub fn sets_are_finite<const D: usize>(
    problem: &Problem,
    comm: &dyn Communicator,
    model: &Model<D>,
) -> Result<()> {
    let check = FiniteCheck {
        problem,
        comm,
        model,
        time: 0.0,
    };
    for set in &problem.sets {
        if let Selector::Where(condition) = &set.selector {
            let key = format!("[set.{}] where", set.name);
            let value = std::iter::once((Some(condition), 1.0));
            check.check_values(&key, &["is"], &set.span, None, value)?;
        }
    }
    Ok(())
}

/// Check that the conditions `where` and `only` of the refinement trigger are finite at all points at `time`
/// (s). Collective.
///
/// # Errors
/// If a value is not finite. The message names the key, and of the points at which its value is not finite,
/// the point with the smallest id. The error is the same on all ranks.
pub fn trigger_is_finite<const D: usize>(
    problem: &Problem,
    comm: &dyn Communicator,
    model: &Model<D>,
    time: f64,
) -> Result<()> {
    let Some(trigger) = problem.refinement_trigger() else {
        return Ok(());
    };
    let check = FiniteCheck {
        problem,
        comm,
        model,
        time,
    };
    for (name, condition) in [("where", &trigger.condition), ("only", &trigger.only)] {
        let key = format!("[refinement.trigger] {name}");
        let value = condition.iter().map(|condition| (Some(condition), 1.0));
        check.check_values(&key, &["is"], &trigger.span, None, value)?;
    }
    Ok(())
}

/// Data for the checks of the conditions and initial values. Each method call checks one entry of the deck.
struct FiniteCheck<'a, const D: usize> {
    problem: &'a Problem,
    comm: &'a dyn Communicator,
    model: &'a Model<D>,
    time: f64,
}

impl<const D: usize> FiniteCheck<'_, D> {
    /// Return an error if the thermal stretch of a point of a set is −1 or less. The point's cell would have
    /// no volume at this stretch. Collective.
    fn check_stretches(
        &self,
        key: &str,
        place: &Range<usize>,
        set: usize,
        temperature: &Expression,
    ) -> Result<()> {
        let stretch = |point: &usize| {
            let value = temperature.evaluate(self.model.position(*point), self.time);
            self.model.expansion_of(*point).stretch_at(value)
        };
        let members = members(self.problem, self.model, set);
        let members = members.into_iter().map(|point| point as usize);
        let wrong = members.filter(|point| stretch(point) <= -1.0);
        let own = wrong.min_by_key(|point| self.model.ids[*point]);
        let own = own.map(|point| Found {
            key: 0.0,
            ids: [self.model.ids[point]],
            payload: [stretch(&point)],
        });
        let Some(Found {
            ids: [id],
            payload: [stretch],
            ..
        }) = least(self.comm, own)
        else {
            return Ok(());
        };
        let message = format!(
            "{key}: the thermal stretch must be above -1, is {} at t = {} s at point {id}; check `thermal_expansion`, \
             which is per unit of temperature, such as 1e-5",
            format_number(stretch),
            format_number(self.time),
        );
        Err(Error::input(message).at(place))
    }

    /// Return an error if a component is not finite at a point of a set; for `None`, at any point.
    /// `components` contains an expression and a factor for each component. The component is the product of
    /// both. `names` has one entry per component, such as "component x is". In the error message, the entry
    /// of the component precedes its value. Collective.
    fn check_values<'e>(
        &self,
        key: &str,
        names: &[&str],
        place: &Range<usize>,
        set: Option<usize>,
        components: impl Iterator<Item = (Option<&'e Expression>, f64)>,
    ) -> Result<()> {
        let changing: Vec<(usize, &Expression, f64)> = components
            .enumerate()
            .filter_map(|(component, (value, factor))| Some((component, value?, factor)))
            .filter(|(_, value, factor)| {
                let constant = value.as_constant();
                !constant.is_some_and(|constant| (constant * factor).is_finite())
            })
            .collect();
        if changing.is_empty() {
            return Ok(());
        }
        let wrong = |point: u32| {
            let position = self.model.position(point as usize);
            changing.iter().find_map(|(component, value, factor)| {
                let value = factor * value.evaluate(position, self.time);
                (!value.is_finite()).then_some((*component, value))
            })
        };
        let points = match set {
            Some(set) => members(self.problem, self.model, set),
            None => (0..self.model.owned() as u32).collect(),
        };
        let found = points
            .into_iter()
            .filter_map(|point| Some((self.model.ids[point as usize], point, wrong(point)?)))
            .min_by_key(|(id, ..)| *id);
        let own = found.map(|(id, point, (component, value))| {
            let [x, y, z] = self.model.position(point as usize);
            Found {
                key: 0.0,
                ids: [id],
                payload: [component as f64, value, x, y, z],
            }
        });
        let Some(Found {
            ids: [id],
            payload: [component, value, position @ ..],
            ..
        }) = least(self.comm, own)
        else {
            return Ok(());
        };
        let message = format!(
            "{key}: {} {value} at t = {} s at point {id}, {:?} m",
            names[component as usize],
            format_number(self.time),
            &position[..D]
        );
        Err(Error::input(message).at(place))
    }
}
