//! The validated deck: every number known, every name resolved.
//!
//! Positions and vectors have three components; those beyond the dimension are 0.

use std::ops::Range;
use std::path::PathBuf;

pub use super::blocks::{Block, Kind};
use super::expression::Expression;
pub use super::law::Law;
use super::source::Source;
use crate::dimension::Dimension;
use crate::elastic::Isotropic;

/// Everything that a run needs to know.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The deck's text, for errors found later and for the result's metadata.
    pub source: Source,
    /// What the deck may say but most likely does not mean, each with file and line.
    pub warnings: Vec<String>,
    /// One line.
    pub title: String,
    /// Where some of the values stand in the deck.
    pub places: Places,
    /// The setting.
    pub dimension: Dimension,
    /// Horizon δ of the grid, m; bodies may have their own.
    pub horizon: f64,
    /// What volumes near the edge of a family count.
    pub volume_correction: VolumeCorrection,
    /// Where the points of a lattice cell lie.
    pub quadrature: Quadrature,
    /// How bonds are kept.
    pub family: FamilyRule,
    /// The bonds between blocks.
    pub interface: Interface,
    /// Bodies in the order of the deck.
    pub bodies: Vec<Body>,
    /// Finer grids in parts of the bodies.
    pub refinement: Option<Refinement>,
    /// Sets: `all`, then the bodies, then those of the deck.
    pub sets: Vec<Set>,
    /// Pre-cracks.
    pub cracks: Vec<PreCrack>,
    /// Initial values, applied in order.
    pub initials: Vec<Initial>,
    /// Loads and supports, applied in order.
    pub conditions: Vec<Condition>,
    /// The time axis.
    pub time: Time,
    /// The result file.
    pub output: Output,
    /// The history.
    pub history: History,
    /// When checkpoints are written.
    pub checkpoint: CheckpointRule,
    /// When points are dealt out anew to the ranks.
    pub balance: Option<Balance>,
}

/// Where values stand in the deck whose mistakes only the points show.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Places {
    /// The horizon of the grid.
    pub horizon: Range<usize>,
    /// The end time.
    pub end: Range<usize>,
    /// The time step; the end time if the step is automatic.
    pub step: Range<usize>,
}

/// A body, which is a block with its own material and damage.
#[derive(Debug, Clone)]
pub struct Body {
    /// Its name in the deck.
    pub name: String,
    /// Where it stands in the deck.
    pub span: Range<usize>,
    /// The material's name.
    pub material_name: String,
    /// The material.
    pub material: Material,
    /// The damage law, if bonds can break.
    pub damage: Option<CriticalStretch>,
    /// Horizon δ, m.
    pub horizon: f64,
    /// Where its horizon stands in the deck: its own or that of the grid.
    pub horizon_place: Range<usize>,
    /// Where its points come from.
    pub points: PointSource,
}

/// Refinement of the grid (Dipasquale et al. 2014, §2).
#[derive(Debug, Clone)]
pub struct Refinement {
    /// Where it stands in the deck.
    pub span: Range<usize>,
    /// The finest level: the spacing there is that of the grid divided by 2^levels.
    pub levels: u32,
    /// The horizons of the levels.
    pub rule: HorizonRule,
    /// What the horizon of points is multiplied by that have a coarser level within it.
    pub interface_factor: f64,
    /// What is refined from the start.
    pub regions: Vec<RefinedRegion>,
}

/// How the horizon goes with the spacing from level to level.
#[derive(Debug, Clone, PartialEq)]
pub enum HorizonRule {
    /// δ convergence: m = δ/dx is the same.
    Delta,
    /// δm convergence: m of each level from 1 on.
    DeltaM(Vec<f64>),
}

/// Points that are refined from the start.
#[derive(Debug, Clone)]
pub struct RefinedRegion {
    /// Its name.
    pub name: String,
    /// Where it stands in the deck.
    pub span: Range<usize>,
    /// Points of lower levels are refined until they have this level.
    pub level: u32,
    /// Which points, by reference position.
    pub condition: Expression,
}

/// A material: density, elastic constants and the law that uses them.
#[derive(Debug, Clone)]
pub struct Material {
    /// The law.
    pub law: Law,
    /// kg/m³.
    pub density: f64,
    /// E and ν; for a bond-based law ν is the law's own.
    pub elastic: Isotropic,
    /// Viscous damping r, 1/s: a force density −r ρ u̇.
    pub damping: f64,
}

/// What volumes near the edge of a family count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VolumeCorrection {
    /// Whole or not at all.
    None,
    /// A share that falls linearly with the distance.
    Linear,
    /// The share of the cell that lies within the horizon.
    Exact,
}

/// Where the points of a lattice cell lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quadrature {
    /// One at the centre.
    Midpoint,
    /// Two by direction, at ±√3/3 of half the edge.
    Gauss,
}

impl Quadrature {
    /// Number of points of a cell of so many dimensions.
    pub fn points(self, dimension: usize) -> u32 {
        match self {
            Self::Midpoint => 1,
            Self::Gauss => 1 << dimension,
        }
    }
}

/// How bonds are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FamilyRule {
    /// As bits for bodies on a lattice, in lists for others.
    Auto,
    /// In lists.
    List,
    /// As bits; every body must lie on a lattice.
    Lattice,
}

/// The bonds between blocks.
#[derive(Debug, Clone)]
pub struct Interface {
    /// The rule of pairs without one of their own.
    pub rule: InterfaceRule,
    /// Pairs of bodies, by name, with a rule of their own.
    pub pairs: Vec<([String; 2], InterfaceRule)>,
}

impl Interface {
    /// The rule of the bonds between two bodies; the same for both orders. Within a body each end has its
    /// own constants.
    pub fn between(&self, here: &Body, there: &Body) -> InterfaceRule {
        if here.name == there.name {
            return InterfaceRule::Own;
        }
        let joins = |names: &[String; 2]| {
            let [a, b] = [&names[0], &names[1]];
            (*a == here.name && *b == there.name) || (*a == there.name && *b == here.name)
        };
        let own = self.pairs.iter().find(|(names, _)| joins(names));
        own.map_or(self.rule, |(_, rule)| *rule)
    }
}

/// What constants the bonds between two blocks have, if there are any.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InterfaceRule {
    /// No bonds join the blocks.
    None,
    /// Means of the moduli and of the horizons.
    Average,
    /// The smaller of the moduli and of the horizons.
    Minimum,
    /// Each end exerts its own half.
    Own,
}

/// Critical-stretch damage.
#[derive(Debug, Clone, PartialEq)]
pub struct CriticalStretch {
    /// What sets the critical stretch.
    pub toughness: Toughness,
    /// α in s ≥ s0 − α s_min.
    pub alpha: f64,
    /// Indices of sets whose bonds never break.
    pub no_failure: Vec<usize>,
}

/// Three measures of how much a material resists a crack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Toughness {
    /// G0, J/m².
    FractureEnergy(f64),
    /// K_Ic, Pa·√m.
    FractureToughness(f64),
    /// s0 itself.
    CriticalStretch(f64),
}

/// Where points come from.
#[derive(Debug, Clone)]
pub enum PointSource {
    /// The centres of lattice cells within a shape.
    Lattice {
        /// The shape.
        shape: Shape,
        /// Edges of a cell, m.
        spacing: [f64; 3],
        /// A corner of a cell, m.
        origin: [f64; 3],
    },
    /// The rows of a file.
    File {
        /// Path, already relative to the working directory.
        path: PathBuf,
        /// Only rows with this block number.
        block: Option<u32>,
        /// Where the file is named in the deck.
        span: Range<usize>,
    },
}

/// A region of space, lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Between two corners.
    Box {
        /// Lower corner.
        lower: [f64; 3],
        /// Upper corner.
        upper: [f64; 3],
    },
    /// A disc or ball.
    Ball {
        /// Centre.
        centre: [f64; 3],
        /// Radius.
        radius: f64,
    },
    /// Between the centres of its ends.
    Cylinder {
        /// Centre of one end.
        from: [f64; 3],
        /// Centre of the other.
        to: [f64; 3],
        /// Radius.
        radius: f64,
    },
    /// A polygon in x and y, between two values of z.
    Prism {
        /// Corners in order.
        vertices: Vec<[f64; 2]>,
        /// Lower z; −∞ in the plane.
        bottom: f64,
        /// Upper z; ∞ in the plane.
        top: f64,
    },
    /// In any of them.
    Union(Vec<Shape>),
    /// In the first and in none of the others.
    Difference(Vec<Shape>),
}

/// A named set of points.
#[derive(Debug, Clone)]
pub struct Set {
    /// Its name.
    pub name: String,
    /// Where it stands in the deck.
    pub span: Range<usize>,
    /// Which points.
    pub selector: Selector,
}

/// How points are chosen.
#[derive(Debug, Clone)]
pub enum Selector {
    /// All points.
    All,
    /// The points of a body, by index.
    Body(usize),
    /// Those whose reference position makes this true.
    Where(Expression),
    /// Those within a region.
    Within(Shape),
    /// Those with these global ids.
    Ids {
        /// Sorted.
        ids: Vec<u64>,
        /// Where the largest one stands in the deck.
        largest: Range<usize>,
    },
}

/// A crack that is there from the start.
#[derive(Debug, Clone, PartialEq)]
pub struct PreCrack {
    /// Its name.
    pub name: String,
    /// Where it stands in the deck.
    pub span: Range<usize>,
    /// The surface.
    pub surface: Crack,
}

/// A surface that cuts bonds; lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub enum Crack {
    /// In the plane.
    Segment {
        /// One end.
        from: [f64; 3],
        /// The other.
        to: [f64; 3],
    },
    /// A parallelogram.
    Rectangle {
        /// A corner.
        corner: [f64; 3],
        /// One edge from it.
        edge_a: [f64; 3],
        /// The other edge from it.
        edge_b: [f64; 3],
    },
    /// A flat disc.
    Disc {
        /// Centre.
        centre: [f64; 3],
        /// Unit normal.
        normal: [f64; 3],
        /// Radius.
        radius: f64,
    },
}

/// Initial values of a set.
#[derive(Debug, Clone)]
pub struct Initial {
    /// Its name.
    pub name: String,
    /// Index of the set.
    pub set: usize,
    /// Where the set is named.
    pub span: Range<usize>,
    /// Displacement (m) by component, and where it stands.
    pub displacement: Option<(Vec<Expression>, Range<usize>)>,
    /// Velocity (m/s) by component, and where it stands.
    pub velocity: Option<(Vec<Expression>, Range<usize>)>,
}

/// A load or support.
#[derive(Debug, Clone)]
pub struct Condition {
    /// Its name.
    pub name: String,
    /// Index of the set.
    pub set: usize,
    /// Where the set is named.
    pub span: Range<usize>,
    /// The key of what it prescribes, such as `traction`.
    pub quantity: &'static str,
    /// Where that stands.
    pub place: Range<usize>,
    /// Thickness (m) of the layer that carries a traction or pressure, if the deck leaves it to the
    /// spacing.
    pub default_depth: Option<f64>,
    /// What it does.
    pub action: Action,
}

/// What a condition does to its points, by component.
#[derive(Debug, Clone)]
pub enum Action {
    /// Prescribes displacement (m); `None` is free.
    Displacement(Vec<Option<Expression>>),
    /// Prescribes velocity (m/s); `None` is free.
    Velocity(Vec<Option<Expression>>),
    /// Adds a body force density: each expression times its factor (N/m³).
    BodyForce(Vec<Expression>, Vec<f64>),
    /// Adds a total force (N), spread by volume.
    Force(Vec<Expression>),
}

/// The time axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Time {
    /// End time, s.
    pub end: f64,
    /// The step.
    pub step: StepRule,
}

/// How the time step is chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepRule {
    /// This fraction of the stable step.
    Automatic(f64),
    /// Fixed, s.
    Fixed(f64),
}

/// How often something is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Interval {
    /// Seconds of simulated time.
    Seconds(f64),
    /// Time steps.
    Steps(u64),
}

/// When checkpoints are written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CheckpointRule {
    /// So many seconds of wall-clock time apart.
    WallClock(f64),
    /// So many steps or so much simulated time apart.
    Simulation(Interval),
}

/// When points are dealt out anew to the ranks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Balance {
    /// Steps between looks at the ranks' times.
    pub every_steps: u64,
    /// What the time of the slowest rank must exceed, as a multiple of the mean.
    pub imbalance: f64,
}

/// The result file.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// How often.
    pub every: Interval,
    /// Which fields.
    pub fields: Vec<Field>,
}

/// The history.
#[derive(Debug, Clone)]
pub struct History {
    /// How often.
    pub every: Interval,
    /// Sets whose reaction force is recorded.
    pub reactions: Vec<Reaction>,
    /// Damage above which a point counts as cracked.
    pub damage_threshold: f64,
    /// Places that are watched.
    pub probes: Vec<Probe>,
    /// Fronts that are followed.
    pub fronts: Vec<Front>,
    /// Crack tips that are followed.
    pub tips: Vec<Tip>,
}

/// A set whose reaction force is recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Reaction {
    /// Index of the set.
    pub set: usize,
    /// Where it is named.
    pub span: Range<usize>,
}

/// A place whose nearest point is followed.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// Its name.
    pub name: String,
    /// Where it stands in the deck.
    pub span: Range<usize>,
    /// The place, m.
    pub at: [f64; 3],
}

/// A start and a way from it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Where it starts, m.
    pub from: [f64; 3],
    /// Unit vector.
    pub direction: [f64; 3],
}

/// How far a field has come along a line.
#[derive(Debug, Clone)]
pub struct Front {
    /// Its name.
    pub name: String,
    /// Where it stands in the deck.
    pub span: Range<usize>,
    /// The line.
    pub line: Line,
    /// Length of the line, m.
    pub length: f64,
    /// Points up to this distance from the line count, m.
    pub radius: f64,
    /// The field.
    pub field: Field,
    /// The entry of a row of the field; `None` is the length of a vector.
    pub component: Option<usize>,
    /// What the size of the field must exceed.
    pub threshold: f64,
}

/// The farthest point with damage in a direction.
#[derive(Debug, Clone)]
pub struct Tip {
    /// Its name.
    pub name: String,
    /// Where it stands in the deck.
    pub span: Range<usize>,
    /// Where the crack starts, and where it runs.
    pub line: Line,
    /// Index of the set that is looked at.
    pub set: usize,
    /// What the damage must exceed.
    pub threshold: f64,
}

/// A field of the result that changes with time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Field {
    /// u, m.
    Displacement,
    /// u̇, m/s.
    Velocity,
    /// ü, m/s².
    Acceleration,
    /// Internal force density, N/m³.
    ForceDensity,
    /// φ, share of the family's volume that is cut off.
    Damage,
    /// W, J/m³.
    StrainEnergyDensity,
    /// θ.
    Dilatation,
    /// m = Σ ω|ξ|²Ṽ, m⁵.
    WeightedVolume,
    /// Σ T⊗Y Ṽ, Pa: xx, yy, zz, xy, yz, xz.
    Stress,
    /// Number of intact bonds.
    Neighbours,
    /// The rank that owns the point.
    Rank,
}

impl Field {
    /// All fields.
    pub const ALL: [Self; 11] = [
        Self::Displacement,
        Self::Velocity,
        Self::Acceleration,
        Self::ForceDensity,
        Self::Damage,
        Self::StrainEnergyDensity,
        Self::Dilatation,
        Self::WeightedVolume,
        Self::Stress,
        Self::Neighbours,
        Self::Rank,
    ];

    /// Its name in decks and results.
    pub fn name(self) -> &'static str {
        match self {
            Self::Displacement => "displacement",
            Self::Velocity => "velocity",
            Self::Acceleration => "acceleration",
            Self::ForceDensity => "force_density",
            Self::Damage => "damage",
            Self::StrainEnergyDensity => "strain_energy_density",
            Self::Dilatation => "dilatation",
            Self::WeightedVolume => "weighted_volume",
            Self::Stress => "stress",
            Self::Neighbours => "neighbours",
            Self::Rank => "rank",
        }
    }

    /// Its SI unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Displacement => "m",
            Self::Velocity => "m/s",
            Self::Acceleration => "m/s^2",
            Self::ForceDensity => "N/m^3",
            Self::Damage | Self::Dilatation | Self::Neighbours | Self::Rank => "1",
            Self::WeightedVolume => "m^5",
            Self::Stress => "Pa",
            Self::StrainEnergyDensity => "J/m^3",
        }
    }

    /// 3 for vectors and 6 for symmetric tensors (padded with 0 in 1-D and 2-D), 1 for scalars.
    pub fn components(self) -> usize {
        match self {
            Self::Displacement | Self::Velocity | Self::Acceleration | Self::ForceDensity => 3,
            Self::Stress => 6,
            _ => 1,
        }
    }
}
