//! Choice of the time steps of a run.

use std::ops::Range;

use crate::error::{Error, Result};
use crate::message::format_number;
use crate::problem::{Adaptive, Body, PointSource, Problem, Stage, StepRule, Time};

use super::motion::Clock;
use super::motion::clock::steps_to;

/// Maximum number of steps of a stage. A much larger number of steps would not be exact in floating point.
/// The steps could also be so short that adding a step to the time would not change the time.
const MOST_STEPS: f64 = 1e15;

/// For each stage, return the length of the first step (s), and the number of steps that the stage has if no
/// bond breaks. `stable` is the stable step (s) for the density of the materials, without `density_scale`. An
/// automatic step divides the stage evenly, unless `[time.adaptive] largest` limits the step.
///
/// # Errors
/// - If no point has a bond, and a stage has load steps or an automatic step.
/// - If a stage could have more than `MOST_STEPS` steps.
/// - If a step is too long for viscous damping.
/// - If the adaptive rule could repeat one step more than `MOST_REPEATS` times.
pub fn choose_steps(problem: &Problem, stable: f64) -> Result<Vec<(f64, f64)>> {
    let mut start = 0.0;
    let choose = |stage: Stage| {
        let (time, length) = (stage.time, stage.time.end - start);
        start = time.end;
        choose_step(problem, &time, length, stable)
    };
    problem.all_stages().into_iter().map(choose).collect()
}

/// Return a clock with equal steps. Their number is the total number of steps of all stages. For each stage,
/// `steps` contains the length of the first step (s) and the number of steps.
pub fn even_clock(problem: &Problem, steps: &[(f64, f64)]) -> Clock {
    let all: f64 = steps.iter().map(|(_, steps)| steps).sum();
    Clock::new(problem.time.end / all, problem.time.end)
}

/// Return the length of the first step of a stage (s), and the number of steps of the stage if no bond
/// breaks. `length` is the duration of the stage (s). `stable` is the stable step (s) for the density of the
/// materials, without `density_scale`.
fn choose_step(problem: &Problem, time: &Time, length: f64, stable: f64) -> Result<(f64, f64)> {
    if let Some(steps) = time.method.load_steps() {
        if stable.is_infinite() {
            return Err(without_neighbours(problem, "equilibrium"));
        }
        let steps = steps as f64;
        return countable(problem, length, (length / steps, steps));
    }
    let (step, steps) = match time.step {
        StepRule::Fixed(step) => {
            follows_damping(problem, "step", &problem.spans.step, step)?;
            (step, steps_to(length, step))
        }
        StepRule::Automatic(_) if stable.is_infinite() => {
            return Err(without_neighbours(problem, "stable step"));
        }
        StepRule::Automatic(safety) => {
            let steps = (length / automatic_step(problem, time, safety, stable)).ceil();
            (length / steps, steps)
        }
    };
    let (step, steps) = match &time.adaptive {
        Some(rule) => {
            adapts_in_time(problem, rule, length, step)?;
            adapted(rule, (step, steps), length)
        }
        None => (step, steps),
    };
    countable(problem, length, (step, steps))
}

/// Create the error for a problem without any bond. `missing` is the quantity that cannot be computed.
fn without_neighbours(problem: &Problem, missing: &str) -> Error {
    let from_mesh = |body: &Body| matches!(body.points, PointSource::Mesh { .. });
    let scale = if problem.bodies.iter().any(from_mesh) {
        "; a mesh in millimetres needs `scale = 1e-3`"
    } else {
        ""
    };
    let message = format!(
        "[grid] horizon: no point has a neighbour, so there is no {missing}; check that the horizon is in metres and \
         exceeds the spacing{scale}"
    );
    Error::input(message).at(&problem.spans.horizon)
}

/// Return the given step length (s) and number of steps, or an error if the number exceeds [`MOST_STEPS`].
/// `length` is the duration of the stage (s).
fn countable(problem: &Problem, length: f64, (step, steps): (f64, f64)) -> Result<(f64, f64)> {
    if steps > MOST_STEPS {
        let message = format!(
            "[time] end: a run or stage of {} s would take {steps:.1e} steps of {step:.1e} s; at most {MOST_STEPS:.0e} steps \
             are allowed",
            format_number(length)
        );
        return Err(Error::input(message).at(&problem.spans.step));
    }
    Ok((step, steps))
}

/// Maximum number of times that a step may be rolled back and repeated; each repeat costs as much as a step.
const MOST_REPEATS: f64 = 100.0;

/// Return an error if the adaptive rule may repeat a step too often, or if its smallest step gives too many
/// steps. Also return an error if its largest step is too long for viscous damping. `length` is the duration
/// of the stage (s). `step` is the time step that the stage would have without the adaptive rule (s).
fn adapts_in_time(problem: &Problem, rule: &Adaptive, length: f64, step: f64) -> Result<()> {
    let [smallest, largest] = rule.limits(step);
    let error = |message: String| Err(Error::input(message).at(&problem.spans.adaptive));
    if length / smallest > MOST_STEPS {
        return error(format!(
            "[time] adaptive smallest: a run or stage of {} s would take {:.1e} steps of {smallest:.1e} s; at most \
             {MOST_STEPS:.0e} steps are allowed",
            format_number(length),
            length / smallest,
        ));
    }
    // The last repeat uses the smallest step, even if `reduce` would give a smaller one.
    let repeats = (libm::log(smallest / largest) / libm::log(rule.reduce)).ceil();
    if repeats > MOST_REPEATS {
        return error(format!(
            "[time] adaptive reduce: each repeat multiplies the step by {}, so a step of {largest:.3e} s may be repeated \
             {repeats:.0} times before it reaches `smallest`, {smallest:.3e} s; at most {MOST_REPEATS} repeats are \
             allowed; use a smaller `reduce` or a larger `smallest`",
            format_number(rule.reduce),
        ));
    }
    follows_damping(
        problem,
        "adaptive largest",
        &problem.spans.adaptive,
        largest,
    )
}

/// Largest r Δt of an automatic step with viscous damping at a rate r. The error of the energy balance is
/// then at most (r Δt)²/4 of the kinetic energy that damping removes.
const DAMPED: f64 = 0.5;

/// Largest allowed r Δt; with a larger value, viscous damping reverses the velocity in each step.
const SIGN_CHANGES: f64 = 2.0;

/// The largest rate r of viscous damping of the bodies, 1/s.
fn damping(problem: &Problem) -> f64 {
    let rates = problem.bodies.iter().map(|body| body.material.damping);
    rates.fold(0.0, f64::max)
}

/// Return the largest automatic step of a stage, s. `stable` is the stable step (s) without density scaling.
pub fn automatic_step(problem: &Problem, time: &Time, safety: f64, stable: f64) -> f64 {
    let damped = DAMPED / damping(problem);
    safety * (stable * time.density_scale.sqrt()).min(damped)
}

/// Return an error if `step` (s) is too long for viscous damping. `key` is the key of `[time]` that gives the
/// step, and `place` is the span of this key in the deck.
fn follows_damping(problem: &Problem, key: &str, place: &Range<usize>, step: f64) -> Result<()> {
    let rate = damping(problem);
    if rate * step <= SIGN_CHANGES {
        return Ok(());
    }
    let message = format!(
        "[time] {key}: must be at most {SIGN_CHANGES}/damping = {:.3e} s, is {} s; with a longer step, \
         the largest `damping`, {} 1/s, would reverse the velocities in each step",
        SIGN_CHANGES / rate,
        format_number(step),
        format_number(rate),
    );
    Err(Error::input(message).at(place))
}

/// Return the length of the first step (s) of a stage with an adaptive rule, and the number of steps of the
/// stage if no bond breaks. Without the rule, the stage would have `steps` steps of the length `step` (s).
/// `length` is the duration of the stage, s. The first step is at most `largest`; later steps grow up to
/// `largest`.
fn adapted(rule: &Adaptive, (step, steps): (f64, f64), length: f64) -> (f64, f64) {
    match rule.largest {
        Some(largest) if largest < step => (largest, steps_to(length, largest)),
        Some(largest) if largest > step => (step, raised(rule, [step, largest], length)),
        _ => (step, steps),
    }
}

/// Number of steps in a duration `length` (s). The step starts at `first` (s) and is multiplied by
/// `rule.raise` after each round of `rule.steps` steps, up to `largest` (s).
fn raised(rule: &Adaptive, [first, largest]: [f64; 2], length: f64) -> f64 {
    let round = rule.steps as f64;
    let growth = rule.raise - 1.0;
    let rounds_to = |ratio: f64| libm::log(ratio) / libm::log1p(growth);
    // Number of rounds before the largest step is reached, or the number of rounds that fit in the duration
    // if this number is smaller. The duration of k rounds is a geometric series.
    let before_largest = rounds_to(largest / first).ceil();
    let fitting = rounds_to(1.0 + length * growth / (round * first)).floor();
    let rounds = before_largest.min(fitting);
    let raised = libm::expm1(rounds * libm::log1p(growth));
    let left = length - round * first * raised / growth;
    let step = (first * (1.0 + raised)).min(largest);
    (rounds * round + left.max(0.0) / step).ceil().max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rule(raise: f64, steps: u64, largest: f64) -> Adaptive {
        Adaptive {
            most_broken: 2,
            stable_broken: 1,
            steps,
            reduce: 0.5,
            raise,
            smallest: None,
            largest: Some(largest),
        }
    }

    /// Count the steps one by one, to check [`raised`].
    fn counted(rule: &Adaptive, mut step: f64, length: f64) -> u64 {
        let (mut time, mut calm, mut steps) = (0.0, 0, 0);
        while time < length * (1.0 - 1e-9) {
            time += step;
            steps += 1;
            calm += 1;
            if calm == rule.steps {
                step = (step * rule.raise).min(rule.largest.unwrap());
                calm = 0;
            }
        }
        steps
    }

    #[test]
    fn a_largest_step_limits_the_first_one() {
        let limited = adapted(&rule(1.5, 10, 1e-10), (8e-8, 125.0), 1e-5);
        assert_eq!(limited, (1e-10, 1e5));
        let same = adapted(&rule(1.5, 10, 8e-8), (8e-8, 125.0), 1e-5);
        assert_eq!(same, (8e-8, 125.0));
    }

    #[test]
    fn a_first_step_below_the_largest_is_raised() {
        for (raise, each, largest) in [
            (1.5, 10, 64.0),
            (2.0, 1, 1e9),
            (1.01, 3, 2.0),
            (8.0, 7, 3.0),
        ] {
            let rule = rule(raise, each, largest);
            for length in [5.0, 300.0, 1e5] {
                let (step, found) = adapted(&rule, (1.0, length), length);
                let expected = counted(&rule, 1.0, length) as f64;
                assert_eq!(step, 1.0);
                assert!(
                    (found - expected).abs() <= 1.0,
                    "{rule:?} {length}: {found} for {expected}"
                );
            }
        }
        // Steps that hardly grow are too many to be counted one by one.
        let slow = rule(1.0 + f64::EPSILON, 1, 2.0);
        let steps = adapted(&slow, (1e-12, 1e12), 1.0).1;
        assert!((steps / 1e12 - 1.0).abs() < 1e-3, "{steps}");
    }
}
