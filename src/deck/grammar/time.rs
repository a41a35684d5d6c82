//! The time axis, stages, and how points come to move.

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
    /// Automatic step as a fraction of the stable one.
    #[serde(default = "default_safety")]
    pub safety: Number,
    /// How the points come to move: `"explicit"`, by the equation of motion, or `"relaxation"` or `"static"`, from one
    /// equilibrium to the next.
    #[serde(default = "explicit")]
    pub method: Spanned<Method>,
    /// How equilibria are found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relaxation: Option<Spanned<Relaxation>>,
    /// How Newton's method finds equilibria.
    #[serde(rename = "static", skip_serializing_if = "Option::is_none")]
    pub newton: Option<Spanned<Static>>,
    /// How many times its density a body has in the equation of motion; more than 1 to take larger steps
    /// through slow loading.
    #[serde(default = "default_density_scale")]
    pub density_scale: Number,
    /// The step follows the number of bonds that break in it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<Spanned<Adaptive>>,
}

fn default_density_scale() -> Number {
    default_number(1.0)
}

fn default_safety() -> Number {
    default_number(0.8)
}

/// A stage of the run. What it does not say is as in `[time]`.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// When it ends, s; the last stage ends with the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end: Option<Number>,
    /// As in `[time]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub method: Option<Spanned<Method>>,
    /// As in `[time]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub step: Option<Number>,
    /// As in `[time]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub safety: Option<Number>,
    /// As in `[time]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relaxation: Option<Spanned<Relaxation>>,
    /// As in `[time]`.
    #[serde(rename = "static", skip_serializing_if = "Option::is_none")]
    pub newton: Option<Spanned<Static>>,
    /// As in `[time]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density_scale: Option<Number>,
    /// As in `[time]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub adaptive: Option<Spanned<Adaptive>>,
    /// Names of the loads and supports that act; all if neither this nor `off` is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub on: Option<Spanned<Vec<Text>>>,
    /// Names of the loads and supports that do not act.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub off: Option<Spanned<Vec<Text>>>,
}

fn explicit() -> Spanned<Method> {
    Spanned::new(0..0, Method::Explicit)
}

/// How the points come to move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Velocity Verlet.
    Explicit,
    /// Adaptive dynamic relaxation in load steps; t is the load parameter.
    Relaxation,
    /// Newton's method in load steps.
    Static,
}

impl Method {
    /// Its name in a deck.
    pub fn name(self) -> &'static str {
        match self {
            Self::Explicit => "explicit",
            Self::Relaxation => "relaxation",
            Self::Static => "static",
        }
    }

    /// Whether it finds equilibria.
    pub fn is_quasi_static(self) -> bool {
        self != Self::Explicit
    }
}

/// A step that follows the number of bonds that break in it.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Adaptive {
    /// A step that breaks more bonds of any point is undone, and made again with a shorter one.
    #[serde(default = "default_most_broken")]
    pub most_broken: Count,
    /// A step that breaks no more bonds of any point is calm.
    #[serde(default = "default_stable_broken")]
    pub stable_broken: Spanned<u64>,
    /// Calm steps in a row before the step is raised.
    #[serde(default = "default_calm_steps")]
    pub steps: Count,
    /// What the step is multiplied with when one is undone.
    #[serde(default = "default_reduce")]
    pub reduce: Number,
    /// What it is multiplied with when it is raised.
    #[serde(default = "default_raise")]
    pub raise: Number,
    /// The smallest step in s; a hundredth of the largest if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub smallest: Option<Number>,
    /// The largest step in s; that of `step` or `safety` if not given.
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

/// How equilibria are found.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Relaxation {
    /// Number of load steps.
    #[serde(default = "default_load_steps")]
    pub load_steps: Count,
    /// What the forces that are out of balance may be, as a share of loads and reactions.
    #[serde(default = "default_tolerance")]
    pub tolerance: Number,
    /// The most iterations of a load step.
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

/// How Newton's method finds equilibria.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Static {
    /// Number of load steps; that of the relaxation if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_steps: Option<Count>,
    /// What the forces that are out of balance may be, as a share of loads and reactions; that of the relaxation if not
    /// given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<Number>,
    /// The most iterations of a load step.
    #[serde(default = "default_max_iterations")]
    pub max_iterations: Count,
    /// How often a load step without an equilibrium is halved.
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
