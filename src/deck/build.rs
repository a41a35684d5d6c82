//! Problems made in Rust, without a deck.

use super::history::DEFAULT_DAMAGE_THRESHOLD;
use super::outputs::{DEFAULT_CHECKPOINT, DEFAULT_FIELDS, OUTPUTS, ROWS, STEPS_A_ROW};
use super::resolve::ALL_VARIABLES;
use crate::dimension::Dimension;
use crate::elastic::Isotropic;
use crate::error::{Error, Result};
use crate::expression::{Expression, Variable};
use crate::problem::{
    Action, Body, Calibration, CheckpointRule, Condition, Crack, Damage, DamageRule, FamilyRule,
    History, Initial, Interface, InterfaceRule, Interval, Law, Material, Method, Output, Places,
    PointSource, PreCrack, Problem, Quadrature, Selector, Set, Shape, Stage, StepRule, Time,
    Toughness, VolumeCorrection,
};

/// Share of the stable step that is taken if nothing else is said.
const DEFAULT_SAFETY: f64 = 0.8;

impl Problem {
    /// A problem without bodies, with a horizon (m) and an end (s), and everything else as in a deck that
    /// does not say more.
    pub fn new(dimension: Dimension, horizon: f64, end: f64) -> Self {
        Self {
            warnings: Vec::new(),
            places: Places::default(),
            title: String::new(),
            dimension,
            horizon,
            volume_correction: VolumeCorrection::Exact,
            quadrature: Quadrature::Midpoint,
            family: FamilyRule::Auto,
            interface: Interface {
                rule: InterfaceRule::Own,
                pairs: Vec::new(),
            },
            bodies: Vec::new(),
            refinement: None,
            sets: vec![Set {
                name: "all".to_owned(),
                span: 0..0,
                selector: Selector::All,
            }],
            cracks: Vec::new(),
            initials: Vec::new(),
            conditions: Vec::new(),
            time: Time {
                end,
                step: StepRule::Automatic(DEFAULT_SAFETY),
                method: Method::Explicit,
                density_scale: 1.0,
                adaptive: None,
            },
            stages: Vec::new(),
            output: Output {
                every: Interval::Seconds(end / OUTPUTS),
                fields: DEFAULT_FIELDS.to_vec(),
                single: false,
                set: None,
            },
            history: History {
                every: None,
                reactions: Vec::new(),
                support_forces: Vec::new(),
                damage_threshold: DEFAULT_DAMAGE_THRESHOLD,
                probes: Vec::new(),
                fronts: Vec::new(),
                cracks: Vec::new(),
                tips: Vec::new(),
            },
            checkpoint: CheckpointRule::default(),
            balance: None,
        }
    }

    /// Adds a body that fills a shape with cubic cells, or square ones, of this edge (m), and a set of
    /// its points with its name; returns the index of the set.
    pub fn add_body(
        &mut self,
        name: &str,
        material: Material,
        damage: Option<Damage>,
        shape: Shape,
        spacing: f64,
    ) -> usize {
        let selector = Selector::Body(self.bodies.len());
        let edges = std::array::from_fn(|d| {
            if d < self.dimension.count() {
                spacing
            } else {
                1.0
            }
        });
        self.bodies.push(Body {
            name: name.to_owned(),
            span: 0..0,
            material_name: name.to_owned(),
            material,
            damage,
            horizon: self.horizon,
            horizon_place: 0..0,
            points: PointSource::Lattice {
                shape,
                spacing: edges,
                origin: [0.0; 3],
            },
        });
        self.add_set(name, selector)
    }

    /// Adds a set; returns its index. The set of all points has the index 0.
    pub fn add_set(&mut self, name: &str, selector: Selector) -> usize {
        self.sets.push(Set {
            name: name.to_owned(),
            span: 0..0,
            selector,
        });
        self.sets.len() - 1
    }

    /// Adds a crack that is there from the start.
    pub fn add_crack(&mut self, name: &str, surface: Crack) {
        self.cracks.push(PreCrack {
            name: name.to_owned(),
            span: 0..0,
            surface,
        });
    }

    /// Adds a load on or a support of a set, given by its index.
    pub fn add_condition(&mut self, name: &str, set: usize, action: Action) {
        self.conditions.push(Condition {
            name: name.to_owned(),
            set,
            span: 0..0,
            quantity: action.quantity(),
            place: 0..0,
            default_depth: None,
            action,
        });
    }

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

    /// Whether any stage of the run is a relaxation.
    pub fn relaxes(&self) -> bool {
        let mut stages = self.all_stages().into_iter();
        stages.any(|stage| stage.time.is_relaxation())
    }

    /// When rows of the history are written.
    pub fn row_interval(&self) -> Interval {
        let seconds = self.time.end / ROWS;
        let default = if self.relaxes() {
            Interval::Seconds(seconds)
        } else {
            let steps = STEPS_A_ROW;
            Interval::SecondsAtSteps { seconds, steps }
        };
        self.history.every.unwrap_or(default)
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

    /// Adds an initial velocity (m/s) of a set, given by its index: an expression a component.
    pub fn add_initial_velocity(&mut self, name: &str, set: usize, velocity: Vec<Expression>) {
        self.initials.push(Initial {
            name: name.to_owned(),
            set,
            span: 0..0,
            displacement: None,
            velocity: Some((velocity, 0..0)),
        });
    }
}

impl Time {
    /// Whether the method is relaxation.
    pub fn is_relaxation(&self) -> bool {
        matches!(self.method, Method::Relaxation(_))
    }
}

impl Action {
    /// The key of decks that prescribes it, a traction or pressure being a body force here.
    fn quantity(&self) -> &'static str {
        match self {
            Self::Displacement(_) => "displacement",
            Self::Velocity(_) => "velocity",
            Self::BodyForce(..) => "body_force",
            Self::Force(_) => "force",
        }
    }
}

impl Material {
    /// A material without damping; the density is in kg/m³.
    pub fn new(law: Law, density: f64, elastic: Isotropic) -> Self {
        Self {
            law,
            density,
            elastic,
            damping: 0.0,
        }
    }
}

impl Damage {
    /// Damage of all bonds alike.
    pub fn new(rule: DamageRule, toughness: Toughness) -> Self {
        Self {
            rule,
            toughness,
            alpha: 0.0,
            no_failure: Vec::new(),
        }
    }
}

impl DamageRule {
    /// Whether it is calibrated by what opening the body costs, and that has not been measured yet.
    pub fn is_unmeasured(self) -> bool {
        matches!(
            self,
            Self::Energy {
                calibration: Calibration::Opening(None),
                ..
            }
        )
    }
}

impl Default for CheckpointRule {
    fn default() -> Self {
        Self::WallClock(DEFAULT_CHECKPOINT)
    }
}

impl Expression {
    /// An expression of position and time, without parameters.
    ///
    /// # Errors
    /// When the text is none.
    pub fn of(text: &str) -> Result<Self> {
        Self::with(text, &ALL_VARIABLES)
    }

    /// An expression of a length `r` (m), without parameters.
    ///
    /// # Errors
    /// When the text is none.
    pub fn of_length(text: &str) -> Result<Self> {
        Self::with(text, &[Variable::R])
    }

    fn with(text: &str, variables: &[Variable]) -> Result<Self> {
        let parsed = Self::parse(text, &|_| None, &[], variables);
        parsed.map_err(|error| Error::input(format!("`{text}`: {error}")))
    }
}

/// Whether two stages in a row follow the equation of motion with different density scales.
pub(super) fn changes_density_scale(pair: &[Stage]) -> bool {
    let [before, after] = [&pair[0].time, &pair[1].time];
    let moves = !before.is_relaxation() && !after.is_relaxation();
    moves && before.density_scale != after.density_scale
}
