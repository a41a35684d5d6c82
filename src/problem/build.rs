//! Problems that are built in Rust, without a deck.

use super::{
    Action, Body, CheckpointRule, Condition, Crack, Damage, DamageRule, FamilyRule, History,
    Initial, Interface, InterfaceRule, Interval, Law, Material, Method, OUTPUTS, Output,
    PointSource, PreCrack, Problem, Quadrature, Selector, Set, Shape, Spans, StepRule,
    ThermalExpansion, Time, Toughness, VolumeCorrection,
};
use crate::dimension::Dimension;
use crate::elastic::Isotropic;
use crate::expression::Expression;

/// Default of `safety`: the automatic time step as a fraction of the stable step.
const DEFAULT_SAFETY: f64 = 0.8;

impl Problem {
    /// Create a problem with a horizon (m), an end time (s) and no bodies. All other settings have the
    /// defaults of a deck whose points are centres of cubic cells.
    pub fn new(dimension: Dimension, horizon: f64, end: f64) -> Self {
        Self {
            warnings: Vec::new(),
            spans: Spans::default(),
            title: String::new(),
            dimension,
            horizon,
            volume_correction: VolumeCorrection::Exact,
            jitter: None,
            family: FamilyRule::Auto,
            interface: Interface {
                rule: InterfaceRule::Own,
                pairs: Vec::new(),
            },
            contact: None,
            rigid: Vec::new(),
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
                every: Some(Interval::Seconds(end / OUTPUTS)),
                ..Output::default()
            },
            further_outputs: Vec::new(),
            history: History::default(),
            checkpoint: CheckpointRule::default(),
            balance: None,
        }
    }

    /// Add a body that fills a shape with cubic (or square) cells of edge `spacing` (m). Also add the set of
    /// its points, with the same name. Return the index of the set.
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
            horizon_span: 0..0,
            points: PointSource::Lattice {
                shape,
                spacing: edges,
                origin: [0.0; 3],
                quadrature: Quadrature::Midpoint,
            },
        });
        self.add_set(name, selector)
    }

    /// Add a set and return its index. The set of all points has the index 0.
    pub fn add_set(&mut self, name: &str, selector: Selector) -> usize {
        self.sets.push(Set {
            name: name.to_owned(),
            span: 0..0,
            selector,
        });
        self.sets.len() - 1
    }

    /// Add a pre-crack.
    pub fn add_crack(&mut self, name: &str, surface: Crack) {
        self.cracks.push(PreCrack {
            name: name.to_owned(),
            span: 0..0,
            surface,
        });
    }

    /// Add a load, a support or a prescribed temperature to the set with index `set`.
    pub fn add_condition(&mut self, name: &str, set: usize, action: Action) {
        self.conditions.push(Condition {
            name: name.to_owned(),
            set,
            span: 0..0,
            quantity: action.quantity(),
            place: 0..0,
            depth: None,
            action,
        });
    }

    /// Add an initial velocity (m/s) to the set with index `set`. `velocity` has an expression for each
    /// component.
    pub fn add_initial_velocity(&mut self, name: &str, set: usize, velocity: Vec<Expression>) {
        self.initials.push(Initial {
            name: name.to_owned(),
            set,
            span: 0..0,
            displacement: None,
            velocity: Some((velocity, 0..0)),
            file: None,
        });
    }
}

impl Action {
    /// Return the deck's key for this condition. Tractions and pressures are stored as body forces, so their
    /// key is `body_force`.
    fn quantity(&self) -> &'static str {
        match self {
            Self::Displacement(_) => "displacement",
            Self::Velocity(_) => "velocity",
            Self::BodyForce(..) => "body_force",
            Self::Force(_) => "force",
            Self::Temperature(_) => "temperature",
        }
    }
}

impl Problem {
    /// Test whether any bonds can break.
    pub fn has_damage(&self) -> bool {
        self.bodies.iter().any(Body::can_break)
            || (self.interface.pairs.iter()).any(|pair| pair.own_damage().is_some())
    }
}

impl Material {
    /// Create a material without damping and thermal expansion; the density is in kg/m³.
    pub fn new(law: Law, density: f64, elastic: Isotropic) -> Self {
        Self {
            law,
            density,
            elastic,
            damping: 0.0,
            expansion: ThermalExpansion::default(),
        }
    }
}

impl Damage {
    /// Create a damage law with α = 0. It has no scatter, does not depend on the direction of the crack, and
    /// has an empty list of no-failure sets.
    pub fn new(rule: DamageRule, toughness: Toughness) -> Self {
        Self {
            rule,
            toughness,
            alpha: 0.0,
            weibull: None,
            direction: None,
            no_failure: Vec::new(),
        }
    }
}
