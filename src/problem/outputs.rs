//! Outputs of a run: result, history and checkpoints.

use std::ops::Range;

use super::{FieldStatistics, Problem};
use crate::component::Component;

/// Interval between outputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Interval {
    /// Simulated time, s.
    Seconds(f64),
    /// Number of time steps.
    Steps(u64),
    /// Simulated time, checked only at steps whose number is a multiple of `steps`.
    SecondsAtSteps {
        /// Interval of simulated time, s.
        seconds: f64,
        /// Number of steps between checks.
        steps: u64,
    },
}

/// Schedule of checkpoints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CheckpointRule {
    /// Interval of wall-clock time, s.
    WallClock(f64),
    /// Interval of steps or simulated time.
    Simulation(Interval),
}

/// Schedule and threshold for the rebalancing of points between ranks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Balance {
    /// Number of steps between two comparisons of the computing times of the ranks.
    pub every_steps: u64,
    /// Ratio of the time of the slowest rank to the mean time of all ranks, above which points are
    /// rebalanced.
    pub imbalance: f64,
}

/// Settings of the main result file or of a further result file.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Name of a further result; `None` for the main result.
    pub name: Option<String>,
    /// Interval of outputs; `None` if outputs are written only at `times`.
    pub every: Option<Interval>,
    /// Simulated times of additional outputs in ascending order, s.
    pub times: Vec<f64>,
    /// Fields that are written.
    pub fields: Vec<Field>,
    /// Whether the fields are rounded to 4-byte numbers.
    pub single: bool,
    /// Index of the set whose points the result contains, and the span of the set's name in the deck; `None`
    /// for all points.
    pub set: Option<(usize, Range<usize>)>,
}

impl Default for Output {
    /// Return a main result with the default fields of all points, without outputs.
    fn default() -> Self {
        Self {
            name: None,
            every: None,
            times: Vec::new(),
            fields: DEFAULT_FIELDS.to_vec(),
            single: false,
            set: None,
        }
    }
}

impl Output {
    /// Return the section of this output in the deck, for messages.
    pub fn section(&self) -> String {
        match &self.name {
            None => "[output]".to_owned(),
            Some(name) => format!("[output.{name}]"),
        }
    }

    /// Test whether the values of a field are rounded to 4-byte floats. Ids are never rounded, because
    /// rounding would change them.
    pub fn is_single(&self, field: Field) -> bool {
        self.single && field != Field::Fragment
    }

    /// Test whether the result contains the number of bonds that have broken since its last output.
    pub fn counts_newly_broken(&self) -> bool {
        self.fields.contains(&Field::NewlyBrokenBonds)
    }
}

/// Settings of the history.
#[derive(Debug, Clone)]
pub struct History {
    /// Interval of rows; `None` for the default of [`Problem::row_interval`](super::Problem::row_interval).
    pub every: Option<Interval>,
    /// Sets whose reaction force is recorded. Each component of the force has its own column.
    pub reactions: Vec<Reaction>,
    /// Sets whose reaction force along a direction is recorded.
    pub support_forces: Vec<SupportForce>,
    /// Whether fragments are counted.
    pub fragments: bool,
    /// Whether the angular momentum is recorded.
    pub angular_momentum: bool,
    /// Damage above which a point counts as cracked.
    pub damage_threshold: f64,
    /// Sums, means and extremes of fields over sets.
    pub statistics: Vec<FieldStatistics>,
    /// Probes: positions. The history contains values of the point nearest to each probe.
    pub probes: Vec<Probe>,
    /// Tracked fronts.
    pub fronts: Vec<Front>,
    /// Cracks whose path is computed.
    pub cracks: Vec<CrackPath>,
    /// Tracked crack tips.
    pub tips: Vec<Tip>,
    /// J integrals over boxes.
    pub j_integrals: Vec<JIntegral>,
}

impl Default for History {
    /// Return a history with the columns that all decks have, and the default interval of rows.
    fn default() -> Self {
        Self {
            every: None,
            reactions: Vec::new(),
            support_forces: Vec::new(),
            fragments: false,
            angular_momentum: false,
            damage_threshold: DEFAULT_DAMAGE_THRESHOLD,
            statistics: Vec::new(),
            probes: Vec::new(),
            fronts: Vec::new(),
            cracks: Vec::new(),
            tips: Vec::new(),
            j_integrals: Vec::new(),
        }
    }
}

/// A set whose reaction force is recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Reaction {
    /// Index of the set.
    pub set: usize,
    /// Span of the name of the set in the deck.
    pub span: Range<usize>,
}

/// A set whose reaction force along a direction is recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct SupportForce {
    /// Name in the deck.
    pub name: String,
    /// Span in the deck.
    pub span: Range<usize>,
    /// Index of the set.
    pub set: usize,
    /// Direction, a unit vector.
    pub direction: [f64; 3],
}

/// A crack whose path is computed.
#[derive(Debug, Clone)]
pub struct CrackPath {
    /// Name in the deck.
    pub name: String,
    /// Span in the deck.
    pub span: Range<usize>,
    /// Start position, m.
    pub from: [f64; 3],
    /// Index of the set that is evaluated.
    pub set: usize,
    /// Damage above which a point counts as cracked.
    pub threshold: f64,
}

/// A probe: a position. The history contains values of the point nearest to the probe.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// Name in the deck.
    pub name: String,
    /// Span in the deck.
    pub span: Range<usize>,
    /// The position, m.
    pub at: [f64; 3],
    /// Fields that are recorded in addition to displacement and velocity.
    pub fields: Vec<Field>,
}

/// A line: start and direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Start position, m.
    pub from: [f64; 3],
    /// Direction, a unit vector.
    pub direction: [f64; 3],
}

/// A front: the farthest position along a line at which a field exceeds a threshold.
#[derive(Debug, Clone)]
pub struct Front {
    /// Name in the deck.
    pub name: String,
    /// Span in the deck.
    pub span: Range<usize>,
    /// Start and direction of the line.
    pub line: Line,
    /// Length of the line, m.
    pub length: f64,
    /// Maximum distance from the line at which points are evaluated, m.
    pub radius: f64,
    /// Field whose values are compared with the threshold.
    pub field: Field,
    /// Component or invariant of the field.
    pub component: Component,
    /// Threshold for the absolute value of the component.
    pub threshold: f64,
}

/// A crack tip: the farthest damaged point in a direction.
#[derive(Debug, Clone)]
pub struct Tip {
    /// Name in the deck.
    pub name: String,
    /// Span in the deck.
    pub span: Range<usize>,
    /// Start and direction of the crack.
    pub line: Line,
    /// Index of the set that is evaluated.
    pub set: usize,
    /// Damage above which a point counts as damaged.
    pub threshold: f64,
}

/// A J integral over a box around a crack tip or a piece of a crack front.
#[derive(Debug, Clone)]
pub struct JIntegral {
    /// Name in the deck.
    pub name: String,
    /// Span in the deck.
    pub span: Range<usize>,
    /// Lower corner of the box, m.
    pub lower: [f64; 3],
    /// Upper corner of the box, m.
    pub upper: [f64; 3],
    /// Direction in which the crack grows, a unit vector.
    pub direction: [f64; 3],
    /// Direction of the crack front, a unit vector; in 3-D only.
    pub front: Option<[f64; 3]>,
    /// Width (m) of the layer along the inner side of the box faces. Across this layer, the weight of the
    /// points falls from 1 to 0. The weight is 0 at the faces.
    pub layer: f64,
}

/// A field of the result that is written at each output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Field {
    /// Displacement u, m.
    Displacement,
    /// Velocity u̇, m/s.
    Velocity,
    /// Acceleration ü, m/s².
    Acceleration,
    /// Internal force density including contact, N/m³.
    ForceDensity,
    /// Force density of contact, N/m³.
    ContactForceDensity,
    /// Damage φ: volume of the neighbours whose bonds to the point are broken, divided by the volume of all
    /// neighbours; from 0 to 1.
    Damage,
    /// Strain energy density W, J/m³.
    StrainEnergyDensity,
    /// Dilatation θ, the trace of the three-dimensional strain. In plane stress, θ is (1 − 2ν)/(1 − ν) times
    /// the trace of the strain in the plane. Under uniaxial stress, θ is (1 − 2ν) times the strain along the
    /// bar.
    Dilatation,
    /// Weighted volume m = Σ ω|ξ|²Ṽ, m⁵.
    WeightedVolume,
    /// Kirchhoff stress Σ T⊗Y Ṽ of the three-dimensional body, Pa: xx, yy, zz, xy, yz, xz. In plane strain,
    /// correspondence laws compute zz; for other laws, zz = ν (xx + yy). Under uniaxial strain, yy and zz are
    /// ν/(1 − ν) xx.
    Stress,
    /// Cauchy stress, Pa: Kirchhoff stress divided by the ratio of deformed to undeformed volume. The order
    /// of the components is that of [`Self::Stress`].
    CauchyStress,
    /// Equivalent stress of von Mises from the Cauchy stress, Pa.
    VonMisesStress,
    /// Deformation gradient F = (Σ ω Y⊗ξ Ṽ) K⁻¹ of the intact bonds, stored row by row. F is I at points
    /// with too few intact bonds.
    DeformationGradient,
    /// Green–Lagrange strain ½(FᵀF − I) of the three-dimensional body: xx, yy, zz, xy, yz, xz. In plane
    /// stress, the law computes the out-of-plane stretch. Under uniaxial stress, the lateral stretch follows
    /// from ν.
    Strain,
    /// Number of intact bonds of the point. A bond counts if one of its ends lies within the horizon of the
    /// other.
    Neighbours,
    /// Number of the point's bonds that have broken since the start.
    BrokenBonds,
    /// Number of the point's bonds that have broken since the last output.
    NewlyBrokenBonds,
    /// Equivalent plastic strain ∫ √(⅔ Ė_p:Ė_p) dt for correspondence laws with plasticity, otherwise 0.
    PlasticStrainEquivalent,
    /// 1 if the point carries no force, otherwise 0. A point carries no force if it has too few intact bonds
    /// for its law, or if the intact part of its family is too stiff. It also carries no force if the law
    /// defines no stress at the deformation of the point or of one of its bonds.
    Singular,
    /// Temperature, K. Points without a prescribed temperature have the reference temperature of their
    /// material.
    Temperature,
    /// Fragment id: the smallest id of the points in the fragment. A fragment is a group of points that are
    /// connected by chains of intact bonds.
    Fragment,
    /// The rank that owns the point.
    Rank,
}

impl Field {
    /// All fields.
    pub const ALL: [Self; 22] = [
        Self::Displacement,
        Self::Velocity,
        Self::Acceleration,
        Self::ForceDensity,
        Self::ContactForceDensity,
        Self::Damage,
        Self::StrainEnergyDensity,
        Self::Dilatation,
        Self::WeightedVolume,
        Self::Stress,
        Self::CauchyStress,
        Self::VonMisesStress,
        Self::DeformationGradient,
        Self::Strain,
        Self::Neighbours,
        Self::BrokenBonds,
        Self::NewlyBrokenBonds,
        Self::PlasticStrainEquivalent,
        Self::Singular,
        Self::Temperature,
        Self::Fragment,
        Self::Rank,
    ];

    /// Return the name of the field in decks and results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Displacement => "displacement",
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
            Self::ForceDensity => "force_density",
            Self::ContactForceDensity => "contact_force_density",
            Self::Damage => "damage",
            Self::StrainEnergyDensity => "strain_energy_density",
            Self::Dilatation => "dilatation",
            Self::WeightedVolume => "weighted_volume",
            Self::Stress => "stress",
            Self::CauchyStress => "cauchy_stress",
            Self::VonMisesStress => "von_mises_stress",
            Self::DeformationGradient => "deformation_gradient",
            Self::Strain => "strain",
            Self::Neighbours => "neighbours",
            Self::BrokenBonds => "broken_bonds",
            Self::NewlyBrokenBonds => "newly_broken_bonds",
            Self::PlasticStrainEquivalent => "plastic_strain_equivalent",
            Self::Singular => "singular",
            Self::Temperature => "temperature",
            Self::Fragment => "fragment",
            Self::Rank => "rank",
        }
    }

    /// Return the SI unit of the field.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Displacement => "m",
            Self::Velocity => "m/s",
            Self::Acceleration => "m/s^2",
            Self::ForceDensity | Self::ContactForceDensity => "N/m^3",
            Self::Damage
            | Self::Dilatation
            | Self::DeformationGradient
            | Self::Strain
            | Self::Neighbours
            | Self::BrokenBonds
            | Self::NewlyBrokenBonds
            | Self::PlasticStrainEquivalent
            | Self::Singular
            | Self::Fragment
            | Self::Rank => "1",
            Self::WeightedVolume => "m^5",
            Self::Stress | Self::CauchyStress | Self::VonMisesStress => "Pa",
            Self::StrainEnergyDensity => "J/m^3",
            Self::Temperature => "K",
        }
    }

    /// Return the number of values per point: 1 for scalars, 3 for vectors, 6 for symmetric tensors, 9 for
    /// other tensors. These numbers also hold in 1-D and 2-D.
    pub fn components(self) -> usize {
        match self {
            Self::Displacement
            | Self::Velocity
            | Self::Acceleration
            | Self::ForceDensity
            | Self::ContactForceDensity => 3,
            Self::Stress | Self::CauchyStress | Self::Strain => 6,
            Self::DeformationGradient => 9,
            _ => 1,
        }
    }
}

/// Default fields of a result.
pub(crate) const DEFAULT_FIELDS: [Field; 4] = [
    Field::Displacement,
    Field::Velocity,
    Field::Damage,
    Field::StrainEnergyDensity,
];

/// Default number of outputs of a run.
pub(crate) const OUTPUTS: f64 = 50.0;

/// Default number of history rows.
const ROWS: f64 = 500.0;
/// By default, rows of an explicit run are at least this number of steps apart. Writing a row takes as long
/// as 2 to 9 steps.
const STEPS_A_ROW: u64 = 20;

/// Default wall-clock time between checkpoints, s.
pub(crate) const DEFAULT_CHECKPOINT: f64 = 600.0;

/// Default damage above which a point counts as cracked.
pub(crate) const DEFAULT_DAMAGE_THRESHOLD: f64 = 0.35;

impl Problem {
    /// Return the main output, then the further outputs.
    pub fn outputs(&self) -> impl Iterator<Item = &Output> {
        [&self.output].into_iter().chain(&self.further_outputs)
    }

    /// Return the further outputs that contain the number of newly broken bonds, see
    /// [`Output::counts_newly_broken`].
    pub fn further_counts(&self) -> impl Iterator<Item = &Output> {
        let further = self.further_outputs.iter();
        further.filter(|output| output.counts_newly_broken())
    }

    /// Return the interval between rows of the history.
    pub fn row_interval(&self) -> Interval {
        let seconds = self.time.end / ROWS;
        let default = if self.is_quasi_static() {
            Interval::Seconds(seconds)
        } else {
            let steps = STEPS_A_ROW;
            Interval::SecondsAtSteps { seconds, steps }
        };
        self.history.every.unwrap_or(default)
    }
}

impl Default for CheckpointRule {
    fn default() -> Self {
        Self::WallClock(DEFAULT_CHECKPOINT)
    }
}
