//! How long the steps of a run are.

use crate::deck::plan::{Method, Plan, Stage, StepRule, Time};
use crate::deck::shown;
use crate::error::Result;

use super::motion::clock::steps_to;

/// The step (s) of each stage of a run, and how many of them it takes, with a stable step (s). An automatic
/// step divides the stage evenly.
///
/// # Errors
/// When there is no stable step, or there are more steps than can be counted.
pub fn choose_steps(plan: &Plan, stable: f64) -> Result<Vec<(f64, f64)>> {
    let mut start = 0.0;
    let choose = |stage: Stage| {
        let (time, length) = (stage.time, stage.time.end - start);
        start = time.end;
        choose_step(plan, &time, length, stable)
    };
    plan.all_stages().into_iter().map(choose).collect()
}

/// The step (s) of a stage of some length (s), and how many of them it takes.
fn choose_step(plan: &Plan, time: &Time, length: f64, stable: f64) -> Result<(f64, f64)> {
    let (step, steps) = match (time.method, time.step) {
        (Method::Relaxation(rule), _) => {
            let steps = rule.load_steps as f64;
            (length / steps, steps)
        }
        (Method::Explicit, StepRule::Fixed(step)) => (step, steps_to(length, step)),
        (Method::Explicit, StepRule::Automatic(_)) if stable.is_infinite() => {
            return Err(plan.source.error(
                plan.places.horizon.clone(),
                "[grid] horizon: no point has a neighbour, so there is no stable step; is the horizon \
                 in m and larger than the distance of the points?",
            ));
        }
        (Method::Explicit, StepRule::Automatic(safety)) => {
            let stable = stable * time.density_scale.sqrt();
            let steps = (length / (safety * stable)).ceil();
            (length / steps, steps)
        }
    };
    if steps > 1e15 {
        let message = format!(
            "[time] end: {} s take {steps:.1e} steps of {step:.1e} s",
            shown(length)
        );
        return Err(plan.source.error(plan.places.step.clone(), message));
    }
    Ok((step, steps))
}
