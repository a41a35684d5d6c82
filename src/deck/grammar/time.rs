//! Grammar of the time axis, the stages, and the methods of time integration and equilibrium.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Count, Text};
use crate::deck::number::{Number, default_number};
use crate::deck::spanned::Spanned;

/// The time axis.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Time {
    /// End time in s.
    pub end: Number,
    /// A fixed time step in s; automatic if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<Number>,
    /// Upper limit of the automatic step, as a fraction of the stable step.
    #[serde(default = "default_safety")]
    pub safety: Number,
    /// Solution method: `"explicit"` integrates the equation of motion; `"relaxation"` and `"static"` compute
    /// one equilibrium per load step.
    #[serde(default = "explicit")]
    pub method: Spanned<Method>,
    /// Settings of the relaxation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relaxation: Option<Spanned<Relaxation>>,
    /// Settings of Newton's method.
    #[serde(rename = "static", skip_serializing_if = "Option::is_none")]
    pub newton: Option<Spanned<Static>>,
    /// Factor on the density in the equation of motion; a factor above 1 permits larger steps during slow
    /// loading.
    #[serde(default = "default_density_scale")]
    pub density_scale: Number,
    /// Settings of an adaptive time step, which depends on the number of bonds that break in a step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<Spanned<Adaptive>>,
}

fn default_density_scale() -> Number {
    default_number(1.0)
}

fn default_safety() -> Number {
    default_number(0.8)
}

/// A stage of the run. If a key is not given, its value in `[time]` applies. However, `step` and `adaptive`
/// of `[time]` apply only to explicit stages.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// End of the stage in s; the last stage ends with the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end: Option<Number>,
    /// Same key as in `[time]`. If not given, the value in `[time]` applies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<Spanned<Method>>,
    /// Same key as in `[time]`. If an explicit stage does not give this key, the value in `[time]` applies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<Number>,
    /// Same key as in `[time]`. If not given, the value in `[time]` applies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub safety: Option<Number>,
    /// Same key as in `[time]`. If not given, the value in `[time]` applies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relaxation: Option<Spanned<Relaxation>>,
    /// Same key as in `[time]`. If not given, the value in `[time]` applies.
    #[serde(rename = "static", skip_serializing_if = "Option::is_none")]
    pub newton: Option<Spanned<Static>>,
    /// Same key as in `[time]`. If not given, the value in `[time]` applies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density_scale: Option<Number>,
    /// Same key as in `[time]`. If an explicit stage does not give this key, the value in `[time]` applies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<Spanned<Adaptive>>,
    /// Names of the conditions (loads, supports and temperatures) that act; all conditions if neither `on`
    /// nor `off` is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub on: Option<Spanned<Vec<Text>>>,
    /// Names of the conditions (loads, supports and temperatures) that do not act.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub off: Option<Spanned<Vec<Text>>>,
}

fn explicit() -> Spanned<Method> {
    Spanned::new(0..0, Method::Explicit)
}

/// The solution method.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Velocity Verlet.
    Explicit,
    /// Adaptive dynamic relaxation in load steps; t is the load parameter.
    Relaxation,
    /// Newton's method in load steps; t is the load parameter.
    Static,
}

impl Method {
    /// Return the name that decks use for this method.
    pub fn name(self) -> &'static str {
        match self {
            Self::Explicit => "explicit",
            Self::Relaxation => "relaxation",
            Self::Static => "static",
        }
    }

    /// Return whether the method computes equilibria.
    pub fn is_quasi_static(self) -> bool {
        self != Self::Explicit
    }
}

/// An adaptive time step dt, which depends on the number of bonds that break in a step.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Adaptive {
    /// Largest number of bonds of one point that may break in a step. If more bonds break, the step is
    /// repeated with a smaller dt, unless dt is already `smallest`.
    #[serde(default = "default_most_broken")]
    pub most_broken: Count,
    /// A step is calm if no point loses more bonds than this number in the step.
    #[serde(default = "default_stable_broken")]
    pub stable_broken: Spanned<u64>,
    /// Number of consecutive calm steps after which dt is raised.
    #[serde(default = "default_calm_steps")]
    pub steps: Count,
    /// Factor on dt when a step is repeated; dt does not become smaller than `smallest`.
    #[serde(default = "default_reduce")]
    pub reduce: Number,
    /// Factor by which dt is raised; dt does not become larger than `largest`.
    #[serde(default = "default_raise")]
    pub raise: Number,
    /// The smallest step in s; 1/100 of the largest if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smallest: Option<Number>,
    /// The largest step in s. If not given, the step that `step` or `safety` gives is the largest step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub largest: Option<Number>,
}

fn default_most_broken() -> Count {
    Count::new(2)
}

fn default_stable_broken() -> Spanned<u64> {
    Spanned::new(0..0, 1)
}

fn default_calm_steps() -> Count {
    Count::new(10)
}

fn default_reduce() -> Number {
    default_number(0.5)
}

fn default_raise() -> Number {
    default_number(1.5)
}

/// Settings of the relaxation.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Relaxation {
    /// Number of load steps.
    #[serde(default = "default_load_steps")]
    pub load_steps: Count,
    /// Largest residual: norm of the unbalanced force, divided by the sum of the norms of loads and
    /// reactions.
    #[serde(default = "default_tolerance")]
    pub tolerance: Number,
    /// Largest number of iterations in a load step; the count restarts whenever bonds break.
    #[serde(default = "default_iterations")]
    pub iterations: Count,
}

impl Default for Relaxation {
    fn default() -> Self {
        Self {
            load_steps: default_load_steps(),
            tolerance: default_tolerance(),
            iterations: default_iterations(),
        }
    }
}

fn default_load_steps() -> Count {
    Count::new(20)
}

fn default_tolerance() -> Number {
    default_number(1e-6)
}

fn default_iterations() -> Count {
    Count::new(100_000)
}

/// Settings of Newton's method.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Static {
    /// Number of load steps. If not given, the value of `load_steps` of the relaxation applies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_steps: Option<Count>,
    /// Largest residual: norm of the unbalanced force, divided by the sum of the norms of loads and
    /// reactions. If not given, the value of `tolerance` of the relaxation applies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<Number>,
    /// Largest number of iterations in a load step; the count restarts whenever bonds break.
    #[serde(default = "default_max_iterations")]
    pub max_iterations: Count,
    /// Largest number of times that a load step is halved because no equilibrium is found.
    #[serde(default = "default_max_halvings")]
    pub max_halvings: Spanned<u64>,
}

impl Default for Static {
    fn default() -> Self {
        Self {
            load_steps: None,
            tolerance: None,
            max_iterations: default_max_iterations(),
            max_halvings: default_max_halvings(),
        }
    }
}

fn default_max_iterations() -> Count {
    Count::new(50)
}

fn default_max_halvings() -> Spanned<u64> {
    Spanned::new(0..0, 5)
}
