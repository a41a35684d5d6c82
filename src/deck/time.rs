//! Validation of the time settings of a deck: `[time]` and the stages.

use super::grammar::{self, Deck, Text};
use super::number::Number;
use super::resolve::{Scope, find};
use crate::deck::spanned::Spanned;
use crate::error::Result;
use crate::message::format_number;
use crate::problem::check::MOST_HALVINGS;
use crate::problem::{self, Method, StepRule};

/// Relative tolerance for comparisons of times. Times that are equal in exact arithmetic can differ by
/// round-off.
const UP_TO_ROUNDING: f64 = 1e-9;

/// The run or a stage, with the keys of `[time]` or `[[stage]]`.
struct TimeSegment<'a> {
    /// Header of the section, for messages.
    key: &'static str,
    /// Length, s.
    length: f64,
    /// End, s.
    end: f64,
    step: Option<&'a Number>,
    safety: &'a Number,
    method: grammar::Method,
    relaxation: Option<&'a Spanned<grammar::Relaxation>>,
    newton: Option<&'a Spanned<grammar::Static>>,
    density_scale: &'a Number,
    adaptive: Option<&'a Spanned<grammar::Adaptive>>,
}

/// Validate the section `[time]`.
///
/// # Errors
/// On an invalid number, and on keys of a method that no stage uses.
pub fn time(scope: &Scope, deck: &Deck) -> Result<problem::Time> {
    let time = deck.time.get_ref();
    let end = scope.positive(&time.end, "[time] end")?;
    let method = *time.method.get_ref();
    let methods = methods(deck).into_iter();
    let methods: Vec<grammar::Method> = methods.map(|(_, method)| *method.get_ref()).collect();
    let mut quasi_static = methods.iter().filter(|method| method.is_quasi_static());
    if let (Some(table), None) = (&time.relaxation, quasi_static.next()) {
        let message = "[time] relaxation: is for `method = \"relaxation\"`; give this `method`, or remove the table";
        return Err(scope.error(table.span(), message));
    }
    if let (Some(table), false) = (&time.newton, methods.contains(&grammar::Method::Static)) {
        let message =
            "[time] static: is for `method = \"static\"`; give this `method`, or remove the table";
        return Err(scope.error(table.span(), message));
    }
    let segment = TimeSegment {
        key: "[time]",
        length: end,
        end,
        step: time.step.as_ref(),
        safety: &time.safety,
        // With stages, `step` and `adaptive` may be for explicit stages even if the method of `[time]` is
        // quasi-static, so validate these keys as for explicit steps.
        method: if deck.stage.is_empty() {
            method
        } else {
            grammar::Method::Explicit
        },
        relaxation: time.relaxation.as_ref(),
        newton: time.newton.as_ref(),
        density_scale: &time.density_scale,
        adaptive: time.adaptive.as_ref(),
    };
    segment.time(scope)
}

/// Validate the stages of the run. `whole` contains the time settings of the run.
///
/// # Errors
/// On a missing or invalid end of a stage, an unknown name, or an invalid number. If a stage has both `on`
/// and `off`, or a key of a method that the stage does not use.
pub fn stages(scope: &Scope, deck: &Deck, whole: &problem::Time) -> Result<Vec<problem::Stage>> {
    let time = deck.time.get_ref();
    let mut start = 0.0;
    let mut stages = Vec::new();
    for ((number, table), (_, method)) in (1..).zip(&deck.stage).zip(methods(deck)) {
        let stage = table.get_ref();
        let is_last = number == deck.stage.len();
        let end = stage_end(scope, table, (start, whole.end), is_last)?;
        let method = *method.get_ref();
        let is_explicit = !method.is_quasi_static();
        if let (Some(table), true) = (&stage.relaxation, is_explicit) {
            let message = "[[stage]] relaxation: is for `method = \"relaxation\"`; give this `method`, or remove the table";
            return Err(scope.error(table.span(), message));
        }
        let is_newton = method == grammar::Method::Static;
        if let (Some(table), false) = (&stage.newton, is_newton) {
            let message = "[[stage]] static: is for `method = \"static\"`; give this `method`, or remove the table";
            return Err(scope.error(table.span(), message));
        }
        let inherited_step = time.step.as_ref().filter(|_| is_explicit);
        let inherited_rule = time.adaptive.as_ref().filter(|_| is_explicit);
        let segment = TimeSegment {
            key: "[[stage]]",
            length: end - start,
            end,
            step: stage.step.as_ref().or(inherited_step),
            safety: stage.safety.as_ref().unwrap_or(&time.safety),
            method,
            relaxation: stage.relaxation.as_ref().or(time.relaxation.as_ref()),
            newton: stage.newton.as_ref().or(time.newton.as_ref()),
            density_scale: stage.density_scale.as_ref().unwrap_or(&time.density_scale),
            adaptive: stage.adaptive.as_ref().or(inherited_rule),
        };
        stages.push(problem::Stage {
            time: segment.time(scope)?,
            acting: acting(scope, deck, stage)?,
        });
        start = end;
    }
    Ok(stages)
}

/// Return the method of each stage, and the section that gives it: `[[stage]]` or `[time]`. Without stages,
/// return the method of `[time]`.
pub fn methods(deck: &Deck) -> Vec<(&'static str, &Spanned<grammar::Method>)> {
    let of_time = ("[time]", &deck.time.get_ref().method);
    if deck.stage.is_empty() {
        return vec![of_time];
    }
    let each = deck
        .stage
        .iter()
        .map(|stage| match &stage.get_ref().method {
            Some(method) => ("[[stage]]", method),
            None => of_time,
        });
    each.collect()
}

/// Return the method with which the run begins.
pub fn first_method(deck: &Deck) -> grammar::Method {
    *methods(deck)[0].1.get_ref()
}

/// Return the end of a stage, s. The end must be after the start of the stage. The last stage ends with the
/// run; all other stages must end before the end of the run.
fn stage_end(
    scope: &Scope,
    table: &Spanned<grammar::Stage>,
    (start, whole): (f64, f64),
    is_last: bool,
) -> Result<f64> {
    let Some(number) = &table.get_ref().end else {
        if is_last {
            return Ok(whole);
        }
        let message = "[[stage]]: needs `end`; only the last stage ends with the run";
        return Err(scope.error(table.span(), message));
    };
    let end = scope.positive(number, "[[stage]] end")?;
    let about = |other: f64| (end - other).abs() <= UP_TO_ROUNDING * whole;
    let words = if end <= start || about(start) {
        format!(
            "must be above {} s (the start of the stage) by more than round-off",
            format_number(start)
        )
    } else if is_last && !about(whole) {
        let whole = format_number(whole);
        format!("must be left out in the last stage, or be {whole} s (the end of the run)")
    } else if !is_last && (end >= whole || about(whole)) {
        format!(
            "must be before {} s (the end of the run)",
            format_number(whole)
        )
    } else {
        return Ok(if is_last { whole } else { end });
    };
    let message = format!("[[stage]] end: {words}, is {} s", format_number(end));
    Err(scope.error(number.span(), message))
}

/// Return for each condition whether it acts in the stage.
fn acting(scope: &Scope, deck: &Deck, stage: &grammar::Stage) -> Result<Vec<bool>> {
    let (names, key, named): (&[Text], _, _) = match (&stage.on, &stage.off) {
        (None, None) => return Ok(vec![true; deck.condition.len()]),
        (Some(on), None) => (on.get_ref(), "[[stage]] on", true),
        (None, Some(off)) => (off.get_ref(), "[[stage]] off", false),
        (Some(_), Some(off)) => {
            let message = "[[stage]] off: give either `on` or `off`";
            return Err(scope.error(off.span(), message));
        }
    };
    let mut acting = vec![!named; deck.condition.len()];
    for name in names {
        let known = deck.condition.keys().map(String::as_str);
        acting[find(scope.source, name, known, key)?] = named;
    }
    Ok(acting)
}

impl TimeSegment<'_> {
    fn time(&self, scope: &Scope) -> Result<problem::Time> {
        let named = |key: &str| format!("{} {key}", self.key);
        let safety = scope.within(
            self.safety,
            &named("safety"),
            f64::MIN_POSITIVE..1.0 + f64::EPSILON,
            "above 0 and at most 1",
        )?;
        let step = match self.step {
            None => StepRule::Automatic(safety),
            Some(number) => StepRule::Fixed(self.step(scope, number)?),
        };
        let density_scale = scope.positive(self.density_scale, &named("density_scale"))?;
        let method = match self.method {
            grammar::Method::Explicit => Method::Explicit,
            grammar::Method::Relaxation => {
                let table = self.relaxation.map(|table| table.get_ref().clone());
                Method::Relaxation(self.relaxation(scope, &table.unwrap_or_default())?)
            }
            grammar::Method::Static => {
                let table = self.newton.map(|table| table.get_ref().clone());
                let shared = self.relaxation.map(|table| table.get_ref().clone());
                let (table, shared) = (table.unwrap_or_default(), shared.unwrap_or_default());
                Method::Static(self.newton(scope, &table, &self.relaxation(scope, &shared)?)?)
            }
        };
        let adaptive = self.adaptive.map(|table| self.adaptive(scope, table));
        Ok(problem::Time {
            end: self.end,
            step,
            method,
            density_scale,
            adaptive: adaptive.transpose()?,
        })
    }

    /// Validate a fixed step, s.
    fn step(&self, scope: &Scope, number: &Number) -> Result<f64> {
        let key = format!("{} step", self.key);
        let step = scope.positive(number, &key)?;
        let words = if self.method.is_quasi_static() {
            let method = self.method.name();
            format!("{method} has load steps instead of time steps; set `{method}.load_steps`")
        } else if step > self.length * (1.0 + UP_TO_ROUNDING) {
            let (step, length) = (format_number(step), format_number(self.length));
            let whole = if self.key == "[time]" { "run" } else { "stage" };
            format!("{step} s is longer than the {whole}, {length} s")
        } else {
            return Ok(step);
        };
        Err(scope.error(number.span(), format!("{key}: {words}")))
    }

    fn adaptive(
        &self,
        scope: &Scope,
        table: &Spanned<grammar::Adaptive>,
    ) -> Result<problem::Adaptive> {
        let key = format!("{} adaptive", self.key);
        if self.method.is_quasi_static() {
            let message = format!(
                "{key}: is not available with `method = \"{}\"`, which has no time steps",
                self.method.name()
            );
            return Err(scope.error(table.span(), message));
        }
        let rule = table.get_ref();
        let named = |name: &str| format!("{key} {name}");
        let step = |number: &Option<Number>, name: &str| {
            let number = number.as_ref();
            number
                .map(|number| scope.positive(number, &named(name)))
                .transpose()
        };
        let (smallest, largest) = (
            step(&rule.smallest, "smallest")?,
            step(&rule.largest, "largest")?,
        );
        if let (Some(low), Some(high), Some(number)) = (smallest, largest, &rule.smallest)
            && low > high * (1.0 + UP_TO_ROUNDING)
        {
            let (low, high) = (format_number(low), format_number(high));
            let message = format!("{key} smallest: {low} s is more than `largest`, {high} s");
            return Err(scope.error(number.span(), message));
        }
        if rule.stable_broken.get_ref() > &rule.most_broken.get() {
            let message = format!(
                "{key} stable_broken: must be at most `most_broken`, {}, is {}",
                rule.most_broken,
                rule.stable_broken.get_ref()
            );
            return Err(scope.error(rule.stable_broken.span(), message));
        }
        let shorter = f64::MIN_POSITIVE..1.0;
        let longer = 1.0 + f64::EPSILON..f64::INFINITY;
        Ok(problem::Adaptive {
            most_broken: rule.most_broken.get(),
            stable_broken: *rule.stable_broken.get_ref(),
            steps: rule.steps.get(),
            reduce: scope.within(
                &rule.reduce,
                &named("reduce"),
                shorter,
                "above 0 and below 1",
            )?,
            raise: scope.within(&rule.raise, &named("raise"), longer, "above 1")?,
            smallest,
            largest,
        })
    }

    fn relaxation(
        &self,
        scope: &Scope,
        table: &grammar::Relaxation,
    ) -> Result<problem::Relaxation> {
        let key = format!("{} relaxation tolerance", self.key);
        let range = f64::MIN_POSITIVE..1.0;
        Ok(problem::Relaxation {
            load_steps: table.load_steps.get(),
            tolerance: scope.within(&table.tolerance, &key, range, "above 0 and below 1")?,
            iterations: table.iterations.get(),
        })
    }

    /// Return the settings of Newton's method; `shared` supplies missing `load_steps` and `tolerance`.
    fn newton(
        &self,
        scope: &Scope,
        table: &grammar::Static,
        shared: &problem::Relaxation,
    ) -> Result<problem::Static> {
        let key = |name: &str| format!("{} static {name}", self.key);
        let range = f64::MIN_POSITIVE..1.0;
        let words = "above 0 and below 1";
        let tolerance = |number| scope.within(number, &key("tolerance"), range, words);
        let tolerance = table.tolerance.as_ref().map(tolerance).transpose()?;
        let max_halvings = *table.max_halvings.get_ref();
        if max_halvings > MOST_HALVINGS {
            let message = format!(
                "{}: must be at most {MOST_HALVINGS}, is {max_halvings}",
                key("max_halvings")
            );
            return Err(scope.error(table.max_halvings.span(), message));
        }
        Ok(problem::Static {
            load_steps: table
                .load_steps
                .map_or(shared.load_steps, |count| count.get()),
            tolerance: tolerance.unwrap_or(shared.tolerance),
            max_iterations: table.max_iterations.get(),
            max_halvings,
        })
    }
}
