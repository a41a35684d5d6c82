//! Time settings, stages, and solution methods.

use super::Problem;

/// Time settings of a run or stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Time {
    /// End time, s.
    pub end: f64,
    /// Rule for the time step.
    pub step: StepRule,
    /// Solution method: explicit time steps, or equilibria by relaxation or Newton's method.
    pub method: Method,
    /// Factor on the density in the equation of motion.
    pub density_scale: f64,
    /// Settings of a step that adapts to the number of breaking bonds; `None` for a constant step.
    pub adaptive: Option<Adaptive>,
}

/// Settings of a time step that adapts to the number of bonds that break in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adaptive {
    /// Largest number of bonds of one point that may break in a step. If more bonds break, the step is
    /// repeated with a smaller Δt.
    pub most_broken: u64,
    /// A step is calm if it breaks at most this number of bonds at each point.
    pub stable_broken: u64,
    /// Number of consecutive calm steps before Δt is raised.
    pub steps: u64,
    /// Factor on Δt if a step is repeated.
    pub reduce: f64,
    /// Factor on Δt after `steps` calm steps.
    pub raise: f64,
    /// The smallest step, s; `None` for 1/100 of the largest.
    pub smallest: Option<f64>,
    /// The largest step, s; `None` for the step of [`Time::step`].
    pub largest: Option<f64>,
}

/// Default of the smallest step, as a fraction of the largest.
const SMALLEST_SHARE: f64 = 0.01;

impl Adaptive {
    /// Return the smallest and the largest step of a stage (s). `step` is the step chosen for the stage, s.
    pub fn limits(&self, step: f64) -> [f64; 2] {
        let largest = self.largest.unwrap_or(step);
        let smallest = self.smallest.unwrap_or(SMALLEST_SHARE * largest);
        [smallest.min(largest), largest]
    }
}

/// A stage of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Time settings. The end is measured from the start of the run.
    pub time: Time,
    /// Whether each condition of the problem acts in this stage.
    pub acting: Vec<bool>,
}

/// Solution method: explicit time steps, or equilibria by relaxation or Newton's method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Integration of the equation of motion with velocity Verlet.
    Explicit,
    /// Each load step computes an equilibrium by relaxation, and further equilibria if bonds break. The time
    /// t is the load parameter, and [`Time::step`] is not used.
    Relaxation(Relaxation),
    /// Same as [`Method::Relaxation`], but by Newton's method.
    Static(Static),
}

/// Settings of Newton's method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Static {
    /// Number of load steps.
    pub load_steps: u64,
    /// Largest allowed residual: norm of the unbalanced forces, divided by the sum of the norms of loads and
    /// reactions, or by the norm at the start of the load step if loads and reactions vanish.
    pub tolerance: f64,
    /// Largest number of iterations of a load step. The count restarts when bonds break.
    pub max_iterations: u64,
    /// Largest number of times that a load step is halved.
    pub max_halvings: u64,
}

impl Method {
    /// Return the name in decks.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Explicit => "explicit",
            Self::Relaxation(_) => "relaxation",
            Self::Static(_) => "static",
        }
    }

    /// Return advice for the error message if the method finds no equilibrium: which keys to change.
    pub fn remedy(&self) -> &'static str {
        match self {
            Self::Static(_) => {
                "give [time.static] more `load_steps`, `max_iterations` or `max_halvings`, or a larger `tolerance`; or use \
                 `method = \"relaxation\"`"
            }
            Self::Explicit | Self::Relaxation(_) => {
                "give [time.relaxation] more `iterations` or a larger `tolerance`"
            }
        }
    }

    /// Return the number of load steps; `None` for the explicit method.
    pub fn load_steps(&self) -> Option<u64> {
        match self {
            Self::Explicit => None,
            Self::Relaxation(rule) => Some(rule.load_steps),
            Self::Static(rule) => Some(rule.load_steps),
        }
    }
}

/// Settings of relaxation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relaxation {
    /// Number of load steps.
    pub load_steps: u64,
    /// Largest allowed residual: norm of the unbalanced forces, divided by the sum of the norms of loads and
    /// reactions, or by the norm at the start of the load step if loads and reactions vanish.
    pub tolerance: f64,
    /// Largest number of iterations of a load step. The count restarts when bonds break.
    pub iterations: u64,
}

/// Rule for the time step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepRule {
    /// A fraction of the stable step.
    Automatic(f64),
    /// A fixed step, s.
    Fixed(f64),
}

impl Problem {
    /// Return the stages of the run; there is at least one.
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

    /// Test whether any stage of the run computes equilibria.
    pub fn is_quasi_static(&self) -> bool {
        let mut stages = self.all_stages().into_iter();
        stages.any(|stage| stage.time.is_quasi_static())
    }

    /// Test whether any stage of the run is a relaxation.
    pub fn has_relaxation(&self) -> bool {
        let mut stages = self.all_stages().into_iter();
        stages.any(|stage| matches!(stage.time.method, Method::Relaxation(_)))
    }

    /// Test whether any stage of the run uses Newton's method.
    pub fn has_newton(&self) -> bool {
        let mut stages = self.all_stages().into_iter();
        stages.any(|stage| matches!(stage.time.method, Method::Static(_)))
    }

    /// Test whether any stage has a step that adapts to the number of broken bonds.
    pub fn adapts(&self) -> bool {
        let mut stages = self.all_stages().into_iter();
        stages.any(|stage| stage.time.adaptive.is_some())
    }

    /// Test whether any stage scales the density in the equation of motion.
    pub fn scales_density(&self) -> bool {
        let mut stages = self.all_stages().into_iter();
        stages.any(|stage| stage.time.density_scale != 1.0)
    }

    /// Test whether two consecutive stages integrate the equation of motion with different density scales.
    pub fn changes_density_scale(&self) -> bool {
        self.stages.windows(2).any(changes_density_scale)
    }
}

impl Time {
    /// Test whether the method computes equilibria.
    pub fn is_quasi_static(&self) -> bool {
        self.method.load_steps().is_some()
    }
}

/// Test whether two consecutive stages integrate the equation of motion with different density scales.
pub(crate) fn changes_density_scale(pair: &[Stage]) -> bool {
    let [before, after] = [&pair[0].time, &pair[1].time];
    let moves = !before.is_quasi_static() && !after.is_quasi_static();
    moves && before.density_scale != after.density_scale
}
