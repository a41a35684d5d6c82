//! The time axis, stages, and how points come to move.

use super::Problem;

/// The time axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Time {
    /// End time, s.
    pub end: f64,
    /// The step.
    pub step: StepRule,
    /// How the points come to move.
    pub method: Method,
    /// How many times its density a body has in the equation of motion.
    pub density_scale: f64,
    /// How the step follows the number of bonds that break in it, if it does.
    pub adaptive: Option<Adaptive>,
}

/// How the step follows the number of bonds that break in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adaptive {
    /// A step that breaks more bonds of any point is undone, and made again with a shorter one.
    pub most_broken: u64,
    /// A step that breaks no more bonds of any point is calm.
    pub stable_broken: u64,
    /// Calm steps in a row before the step is raised.
    pub steps: u64,
    /// What the step is multiplied with when one is undone.
    pub reduce: f64,
    /// What it is multiplied with when it is raised.
    pub raise: f64,
    /// The smallest step, s; `None` is a hundredth of the largest.
    pub smallest: Option<f64>,
    /// The largest step, s; `None` is the one that [`Time::step`] says.
    pub largest: Option<f64>,
}

/// The smallest step as a share of the largest, where the deck does not say.
const SMALLEST_SHARE: f64 = 0.01;

impl Adaptive {
    /// The smallest and the largest step (s) of a stage for which a step (s) was chosen.
    pub fn limits(&self, step: f64) -> [f64; 2] {
        let largest = self.largest.unwrap_or(step);
        let smallest = self.smallest.unwrap_or(SMALLEST_SHARE * largest);
        [smallest.min(largest), largest]
    }
}

/// A stage of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Its end, counted from the start of the run, and how it gets there.
    pub time: Time,
    /// Whether each condition acts.
    pub acting: Vec<bool>,
}

/// How the points come to move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// By the equation of motion, with velocity Verlet.
    Explicit,
    /// From one equilibrium to the next; t is the load parameter, and [`Time::step`] is not used.
    Relaxation(Relaxation),
    /// As [`Method::Relaxation`], by Newton's method.
    Static(Static),
}

/// How Newton's method finds equilibria.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Static {
    /// Number of load steps.
    pub load_steps: u64,
    /// What the forces that are out of balance may be, as a share of loads and reactions.
    pub tolerance: f64,
    /// The most iterations of a load step without a bond that breaks.
    pub max_iterations: u64,
    /// How often a load step may be halved.
    pub max_halvings: u64,
}

impl Method {
    /// Its name in a deck.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Explicit => "explicit",
            Self::Relaxation(_) => "relaxation",
            Self::Static(_) => "static",
        }
    }

    /// What to change in a deck where it finds no equilibrium.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Static(_) => {
                "give [time.static] more `load_steps`, `max_iterations` or `max_halvings`"
            }
            Self::Explicit | Self::Relaxation(_) => "give [time.relaxation] more `iterations`",
        }
    }

    /// The number of load steps, if it finds equilibria.
    pub fn load_steps(&self) -> Option<u64> {
        match self {
            Self::Explicit => None,
            Self::Relaxation(rule) => Some(rule.load_steps),
            Self::Static(rule) => Some(rule.load_steps),
        }
    }
}

/// How equilibria are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relaxation {
    /// Number of load steps.
    pub load_steps: u64,
    /// What the forces that are out of balance may be, as a share of loads and reactions.
    pub tolerance: f64,
    /// The most iterations of a load step.
    pub iterations: u64,
}

/// How the time step is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepRule {
    /// This fraction of the stable step.
    Automatic(f64),
    /// Fixed, s.
    Fixed(f64),
}

impl Problem {
    /// The stages of the run, of which there is at least one.
    pub fn all_stages(&self) -> Vec<Stage> {
        if self.stages.is_empty() {
            return vec![Stage {
                time: self.time,
                acting: vec![true; self.conditions.len()],
            }];
        }
        let mut stages = self.stages.clone();
        if let Some(last) = stages.last_mut() {
            last.time.end = self.time.end;
        }
        stages
    }

    /// Whether any stage of the run is a sequence of equilibria.
    pub fn is_quasi_static(&self) -> bool {
        let mut stages = self.all_stages().into_iter();
        stages.any(|stage| stage.time.is_quasi_static())
    }

    /// Whether any stage of the run is a relaxation.
    pub fn has_relaxation(&self) -> bool {
        let mut stages = self.all_stages().into_iter();
        stages.any(|stage| matches!(stage.time.method, Method::Relaxation(_)))
    }

    /// Whether Newton's method finds the equilibria of any stage.
    pub fn has_newton(&self) -> bool {
        let mut stages = self.all_stages().into_iter();
        stages.any(|stage| matches!(stage.time.method, Method::Static(_)))
    }

    /// Whether the step of any stage follows the number of bonds that break in it.
    pub fn adapts(&self) -> bool {
        let mut stages = self.all_stages().into_iter();
        stages.any(|stage| stage.time.adaptive.is_some())
    }

    /// Whether bodies have another density in the equation of motion of any stage.
    pub fn scales_density(&self) -> bool {
        let mut stages = self.all_stages().into_iter();
        stages.any(|stage| stage.time.density_scale != 1.0)
    }

    /// Whether a stage that follows the equation of motion has another density scale than the one before it, which does so
    /// too.
    pub fn changes_density_scale(&self) -> bool {
        self.stages.windows(2).any(changes_density_scale)
    }
}

impl Time {
    /// Whether the method finds a sequence of equilibria.
    pub fn is_quasi_static(&self) -> bool {
        self.method.load_steps().is_some()
    }
}

/// Whether two stages in a row follow the equation of motion with different density scales.
pub(crate) fn changes_density_scale(pair: &[Stage]) -> bool {
    let [before, after] = [&pair[0].time, &pair[1].time];
    let moves = !before.is_quasi_static() && !after.is_quasi_static();
    moves && before.density_scale != after.density_scale
}
