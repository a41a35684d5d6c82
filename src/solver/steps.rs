//! How long the steps of a run are.

use std::ops::Range;

use crate::deck::plan::{Adaptive, Method, Plan, Stage, StepRule, Time};
use crate::deck::shown;
use crate::error::Result;

use super::motion::clock::steps_to;

/// Most steps of a stage; as many can be counted, and time still advances with each.
const MOST_STEPS: f64 = 1e15;

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
        (Method::Explicit, StepRule::Fixed(step)) => {
            follows_damping(plan, "step", &plan.places.step, step)?;
            (step, steps_to(length, step))
        }
        (Method::Explicit, StepRule::Automatic(_)) if stable.is_infinite() => {
            return Err(plan.source.error(
                plan.places.horizon.clone(),
                "[grid] horizon: no point has a neighbour, so there is no stable step; is the horizon \
                 in m and larger than the distance of the points?",
            ));
        }
        (Method::Explicit, StepRule::Automatic(safety)) => {
            let steps = (length / automatic_step(plan, time, safety, stable)).ceil();
            (length / steps, steps)
        }
    };
    if steps > MOST_STEPS {
        let message = format!(
            "[time] end: {} s take {steps:.1e} steps of {step:.1e} s",
            shown(length)
        );
        return Err(plan.source.error(plan.places.step.clone(), message));
    }
    if let (Method::Explicit, Some(rule)) = (time.method, &time.adaptive) {
        adapts_in_time(plan, rule, length, step)?;
    }
    Ok((step, steps))
}

/// The most times that a step is undone and made again; each time costs as much as a step.
const MOST_REPEATS: f64 = 100.0;

/// An error if a step of a stage of some length (s), for which `step` (s) was chosen, may be repeated without end, or
/// become so small that the stage has no end.
fn adapts_in_time(plan: &Plan, rule: &Adaptive, length: f64, step: f64) -> Result<()> {
    let [smallest, largest] = rule.limits(step);
    let error = |message: String| Err(plan.source.error(plan.places.adaptive.clone(), message));
    if length / smallest > MOST_STEPS {
        return error(format!(
            "[time] adaptive smallest: {} s take {:.1e} steps of {smallest:.1e} s, {MOST_STEPS:.0e} at most",
            shown(length),
            length / smallest,
        ));
    }
    // The size that is left when the last repeat has been made may be cut to the smallest.
    let repeats = (libm::log(smallest / largest) / libm::log(rule.reduce)).ceil();
    if repeats > MOST_REPEATS {
        return error(format!(
            "[time] adaptive reduce: with {} a step may be repeated {repeats:.0} times until {largest:.3e} s become \
             `smallest`, {smallest:.3e} s; {MOST_REPEATS} at most: take a smaller `reduce` or a larger `smallest`",
            shown(rule.reduce),
        ));
    }
    follows_damping(plan, "adaptive largest", &plan.places.adaptive, largest)
}

/// The largest r Δt of an automatic step, with viscous damping at a rate r: the error of the energy balance is up to
/// (r Δt)²/4 of the kinetic energy that is damped.
const DAMPED: f64 = 0.5;

/// The largest r Δt: beyond it a damped velocity changes its sign in each step.
const SIGN_CHANGES: f64 = 2.0;

/// The largest rate of viscous damping of a body, 1/s.
fn damping(plan: &Plan) -> f64 {
    let rates = plan.bodies.iter().map(|body| body.material.damping);
    rates.fold(0.0, f64::max)
}

/// The longest step (s) that `safety` allows, with a stable step (s) for the density of the materials.
pub fn automatic_step(plan: &Plan, time: &Time, safety: f64, stable: f64) -> f64 {
    let damped = DAMPED / damping(plan);
    safety * (stable * time.density_scale.sqrt()).min(damped)
}

/// An error if steps of a key of [time] (s) are too long for viscous damping.
fn follows_damping(plan: &Plan, key: &str, place: &Range<usize>, step: f64) -> Result<()> {
    let rate = damping(plan);
    if rate * step <= SIGN_CHANGES {
        return Ok(());
    }
    let message = format!(
        "[time] {key}: {} s is too long for the largest `damping`, {} 1/s: it must be at most {SIGN_CHANGES}/damping = \
         {:.3e} s, or velocities change their sign in each step",
        shown(step),
        shown(rate),
        SIGN_CHANGES / rate,
    );
    Err(plan.source.error(place.clone(), message))
}
