//! Adaptive time step: if too many bonds of a point break in a step, the step is rolled back and repeated
//! with a shorter length.
//!
//! See Willberg, Hesse & Heinecke 2022, §5. A broken bond transfers its load to other bonds. With short
//! steps, the load is redistributed before more bonds break. The rule is:
//!
//! ```text
//! N_b > most_broken, Δt > smallest                    undo the step, Δt ← Δt · reduce
//! N_b ≤ stable_broken in `steps` consecutive steps    Δt ← Δt · raise, up to the largest
//! ```
//!
//! For each point, the bonds that break in the step are counted. N_b is the largest of these counts over the
//! points of all ranks. All ranks therefore make the same decision. The other names are those of [`Adaptive`]
//! and of the keys of `[time.adaptive]`.

use crate::problem::Adaptive;
use crate::solver::Simulation;

use super::integrator::Integrator;

/// Verlet integrator whose time step follows an adaptive rule.
pub struct AdaptiveVerlet(pub Adaptive);

impl<const D: usize> Integrator<D> for AdaptiveVerlet {
    fn advance(&mut self, simulation: &mut Simulation<'_, D>, _half_kick_pending: bool) -> bool {
        simulation.make_adaptive_step(&self.0);
        false
    }
}

/// If the rest of the stage exceeds the next step by less than this fraction of the step, the step is
/// lengthened to the end of the stage.
const UP_TO_ROUNDING: f64 = 1e-9;

/// State of the adaptive rule between steps; the same on all ranks.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StepControl {
    /// Step that the rule requests, s.
    step: f64,
    /// Smallest and largest step, s.
    limits: [f64; 2],
    /// Number of consecutive steps in which no point lost more than `stable_broken` bonds.
    calm: u64,
    /// Number of steps that were rolled back since the start of the run.
    pub undone: u64,
    /// Largest number of bonds of one point that broke in one step, since the last row of the history. Steps
    /// that were rolled back do not count.
    pub most_broken: u64,
}

impl StepControl {
    /// Start the rule for a stage. `step` (s) is the first step that the stage would have without the rule.
    pub fn begin(&mut self, rule: &Adaptive, step: f64) {
        self.limits = rule.limits(step);
        self.step = step.min(self.limits[1]);
        self.calm = 0;
    }

    /// The step that the rule requests, s.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Encode the state for a checkpoint.
    pub fn words(&self) -> [u64; 6] {
        let [smallest, largest] = self.limits.map(f64::to_bits);
        let counts = [self.calm, self.undone, self.most_broken];
        let step = self.step.to_bits();
        [step, smallest, largest, counts[0], counts[1], counts[2]]
    }

    /// Decode the state from [`Self::words`].
    pub fn of_words([step, smallest, largest, calm, undone, most_broken]: [u64; 6]) -> Self {
        Self {
            step: f64::from_bits(step),
            limits: [smallest, largest].map(f64::from_bits),
            calm,
            undone,
            most_broken,
        }
    }

    /// Return whether a step of `size` (s) must be rolled back, and set the size of the next step. `broken`
    /// is the largest number of bonds that one point has lost in the step.
    fn undoes(&mut self, rule: &Adaptive, size: f64, broken: u64) -> bool {
        let [smallest, largest] = self.limits;
        if broken > rule.most_broken && size > smallest {
            self.step = (size * rule.reduce).max(smallest);
            self.calm = 0;
            self.undone += 1;
            return true;
        }
        self.most_broken = self.most_broken.max(broken);
        self.calm = if broken <= rule.stable_broken {
            self.calm + 1
        } else {
            0
        };
        if self.calm >= rule.steps && self.step < largest {
            self.step = (self.step * rule.raise).min(largest);
            self.calm = 0;
        }
        false
    }
}

impl<const D: usize> Simulation<'_, D> {
    /// Make one explicit step of the size that the rule requests. If too many bonds break, repeat the step
    /// with a smaller size. Contact and the end of the stage can also require a smaller size. Collective.
    fn make_adaptive_step(&mut self, rule: &Adaptive) {
        let mut kept = std::mem::take(&mut self.kept);
        self.keep(&mut kept);
        loop {
            // The last step ends at the end of the stage.
            let left = self.clock.end() - self.clock.time();
            let wanted = (self.progress.step_control.step).min(self.adaptive_limit());
            let is_last = left > 0.0 && left < (1.0 + UP_TO_ROUNDING) * wanted;
            let size = if is_last { left } else { wanted };
            if size != self.clock.step() {
                self.clock.set_step(size);
            }
            self.make_step(false);
            self.kick();
            let broken = self.forces.broken().iter().map(|broken| broken.count);
            let mut most = [broken.max().unwrap_or(0) as f64];
            self.comm.max(&mut most);
            if !self
                .progress
                .step_control
                .undoes(rule, size, most[0] as u64)
            {
                break;
            }
            self.undo(&kept);
        }
        self.kept = kept;
        self.count_calm_steps();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULE: Adaptive = Adaptive {
        most_broken: 4,
        stable_broken: 2,
        steps: 3,
        reduce: 0.5,
        raise: 1.5,
        smallest: Some(0.2),
        largest: Some(1.0),
    };

    #[test]
    fn too_many_broken_bonds_shorten_the_step_down_to_the_smallest() {
        let mut control = StepControl::default();
        control.begin(&RULE, 1.0);
        assert!(control.undoes(&RULE, 1.0, 5));
        assert!(control.undoes(&RULE, control.step, 5));
        assert_eq!(control.step, 0.25);
        assert!(control.undoes(&RULE, control.step, 5));
        assert_eq!(control.step, 0.2);
        assert!(!control.undoes(&RULE, control.step, 5));
        assert_eq!((control.undone, control.most_broken), (3, 5));
    }

    #[test]
    fn calm_steps_raise_it_again() {
        let mut control = StepControl::default();
        control.begin(&RULE, 0.5);
        for broken in [0, 2, 3, 2, 1, 0] {
            assert!(!control.undoes(&RULE, control.step, broken));
        }
        assert_eq!(control.step, 0.75);
        for _ in 0..3 {
            control.undoes(&RULE, control.step, 0);
        }
        assert_eq!(control.step, 1.0);
        for _ in 0..9 {
            control.undoes(&RULE, control.step, 0);
        }
        assert_eq!(control.step, 1.0);
        assert_eq!(StepControl::of_words(control.words()), control);
    }
}
