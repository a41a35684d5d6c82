//! The deck's grammar: what may stand in the TOML file, section by section.
//!
//! Every number may be a string with an expression of the `[parameters]`; all values are SI.
//! Unknown keys are errors. Choices are tables named by the choice (`[material.glass.pmb]`), which
//! keeps the place of an error.

use std::fmt;
use std::num::NonZeroU64;

use indexmap::IndexMap;
use serde::de::{EnumAccess, VariantAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_spanned::Spanned;

use super::number::{Edges, Number, Vector, default_number};
use crate::elastic::Constant;

/// A string with its place in the deck.
pub type Text = Spanned<String>;

/// Named tables in the order of the deck.
pub type Tables<T> = IndexMap<String, Spanned<T>>;

/// A whole deck.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Deck {
    /// One line for summaries and pictures.
    #[serde(default = "nowhere")]
    pub title: Text,
    /// `"1d"`, `"plane-stress"`, `"plane-strain"` or `"3d"`.
    pub dimension: Spanned<DimensionName>,
    /// Thickness of a plane body in m; 1 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thickness: Option<Number>,
    /// Cross-section of a 1-D body in m²; 1 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cross_section: Option<Number>,
    /// Named numbers for use in expressions; may build on one another.
    #[serde(default)]
    pub parameters: IndexMap<Text, Number>,
    /// Spacing and horizon.
    pub grid: Spanned<Grid>,
    /// The bonds between blocks.
    #[serde(default)]
    pub interface: Interface,
    /// Finer grids in parts of the bodies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refinement: Option<Spanned<Refinement>>,
    /// Materials by name: `[material.NAME.LAW]`.
    pub material: Tables<Material>,
    /// Damage laws by name.
    #[serde(default)]
    pub damage: Tables<Damage>,
    /// Bodies by name; each is a block with its own material and damage.
    pub body: Tables<Body>,
    /// Sets of points by name. `all` and the names of the bodies are sets as well.
    #[serde(default)]
    pub set: Tables<Set>,
    /// Pre-cracks by name: bonds that cross one start broken.
    #[serde(default)]
    pub crack: Tables<Crack>,
    /// Initial displacements and velocities by name.
    #[serde(default)]
    pub initial: Tables<Initial>,
    /// Loads and supports by name.
    #[serde(default)]
    pub condition: Tables<Condition>,
    /// End time and step.
    pub time: Spanned<Time>,
    /// What is written to the result, and how often.
    #[serde(default = "nowhere")]
    pub output: Spanned<Output>,
    /// What is written to the history, and how often.
    #[serde(default = "nowhere")]
    pub history: Spanned<History>,
    /// How often the run can be continued from.
    #[serde(default = "nowhere")]
    pub checkpoint: Spanned<Checkpoint>,
    /// When points are dealt out anew to the ranks; never if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub balance: Option<Spanned<Balance>>,
}

fn nowhere<T: Default>() -> Spanned<T> {
    Spanned::new(0..0, T::default())
}

/// The setting of the problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
pub enum DimensionName {
    /// A bar under uniaxial strain.
    #[serde(rename = "1d")]
    Line,
    /// A thin plate, free of stress across its thickness.
    #[serde(rename = "plane-stress")]
    PlaneStress,
    /// A slice of a long body, without strain along it.
    #[serde(rename = "plane-strain")]
    PlaneStrain,
    /// A solid.
    #[serde(rename = "3d")]
    Space,
}

/// The lattice and the range of the bonds.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Edge of a lattice cell in m, or a list with one a dimension; for bodies given as shapes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing: Option<Spanned<Edges>>,
    /// Horizon δ in m: points up to this distance are bonded.
    pub horizon: Number,
    /// A corner of a lattice cell in m; points lie at the centres of cells. 0 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin: Option<Vector>,
    /// What the volumes of points near the edge of a family count: `"none"`, `"linear"` or `"exact"`.
    #[serde(default = "no_correction")]
    pub volume_correction: Spanned<VolumeCorrection>,
    /// The points of a lattice cell: `"midpoint"` or `"gauss"`.
    #[serde(default)]
    pub quadrature: Quadrature,
    /// How bonds are kept: `"lattice"`, one bit each, for points on a regular grid (those of a file
    /// may be), `"list"` for any, or `"auto"`, a lattice where possible. Bonds between bodies on
    /// different grids are always listed. Results differ by rounding only.
    #[serde(default = "automatic")]
    pub family: Spanned<Family>,
}

fn automatic() -> Spanned<Family> {
    Spanned::new(0..0, Family::Auto)
}

/// How bonds are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Family {
    /// As lattices where bodies have them, else in lists.
    Auto,
    /// A list for each point.
    List,
    /// Fixed offsets for all points.
    Lattice,
}

fn no_correction() -> Spanned<VolumeCorrection> {
    Spanned::new(0..0, VolumeCorrection::None)
}

/// How volumes near the edge of a family are corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum VolumeCorrection {
    /// Points within the horizon count whole.
    None,
    /// Points count clamp((δ + dx/2 − |ξ|)/dx, 0, 1), those beyond the horizon too; LAMMPS ends this
    /// taper at δ.
    Linear,
    /// Points count the share of their cell within the horizon.
    Exact,
}

/// The points of a lattice cell.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Quadrature {
    /// One at the centre.
    #[default]
    Midpoint,
    /// 2 in 1-D, 4 in the plane, 8 in 3-D.
    Gauss,
}

/// Refinement: points of bodies given as shapes get new ones around them at half the spacing, level by
/// level; neighbours differ by one level at most.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Refinement {
    /// The finest level: the spacing there is that of the grid divided by 2^levels.
    pub levels: Spanned<u64>,
    /// How horizons go with the spacing: `"delta"`, m = δ/dx stays, or `"delta-m"`, m rises.
    #[serde(default)]
    pub rule: HorizonRule,
    /// With `"delta-m"`: m of the levels from 1 on; by 1 more from level to level if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub m: Option<Spanned<Vec<Number>>>,
    /// What the horizon of points is multiplied by that have a coarser level within it, so that their
    /// families do not lose volume; √2 with `"delta"` and 1 with `"delta-m"` if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interface_factor: Option<Number>,
    /// What is refined from the start, by any name.
    #[serde(default)]
    pub region: Tables<RefinedRegion>,
}

/// How the horizon goes with the spacing from level to level.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum HorizonRule {
    /// δ/dx stays.
    #[default]
    Delta,
    /// δ/dx rises with the level.
    DeltaM,
}

/// Points that are refined from the start.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RefinedRegion {
    /// A condition on the reference position.
    #[serde(rename = "where")]
    pub condition: Number,
    /// The level that points there get at least; the finest if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<Spanned<u64>>,
}

/// The bonds between blocks.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Interface {
    /// What constants they have: `"own"`, `"average"` or `"minimum"`. With `"own"` each end exerts its
    /// half with its own modulus and horizon; else both have the mean or the smaller of each. `"none"`:
    /// there are none, however near the bodies are.
    #[serde(default = "own")]
    pub rule: Spanned<Rule>,
    /// Pairs of bodies with a rule of their own, by any name.
    #[serde(default)]
    pub pair: Tables<Pair>,
}

impl Default for Interface {
    fn default() -> Self {
        Self {
            rule: own(),
            pair: Tables::default(),
        }
    }
}

fn own() -> Spanned<Rule> {
    Spanned::new(0..0, Rule::Own)
}

/// The bonds between two bodies.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Pair {
    /// Names of the two bodies, in any order.
    pub bodies: Spanned<Vec<Text>>,
    /// As for all pairs.
    pub rule: Spanned<Rule>,
}

/// What constants bonds between blocks have, if there are any.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Rule {
    /// No bonds.
    None,
    /// Means.
    Average,
    /// The smaller.
    Minimum,
    /// Those of each end.
    Own,
}

/// A material: its law, and the table of the law.
#[derive(Debug, Clone)]
pub struct Material {
    /// Name of the law.
    pub law: Text,
    /// Density and damping, one or two elastic constants, and the keys that the law
    /// [declares](crate::material::Declaration::keys).
    pub table: Spanned<LawTable>,
}

/// The keys and values of a law. A value is a number, an expression or a word.
pub type LawTable = IndexMap<Text, Number>;

/// Density ρ in kg/m³.
pub const DENSITY: &str = "density";

/// Viscous damping r in 1/s, a force density −r ρ u̇; none if not given.
pub const DAMPING: &str = "damping";

/// The elastic constants: moduli in Pa, and Poisson's ratio.
pub const ELASTIC_CONSTANTS: [(&str, Constant); 5] = [
    ("youngs_modulus", Constant::Young),
    ("bulk_modulus", Constant::Bulk),
    ("shear_modulus", Constant::Shear),
    ("lame_lambda", Constant::Lame),
    ("poisson_ratio", Constant::Poisson),
];

/// The keys of every law's table.
pub fn common_keys() -> impl Iterator<Item = &'static str> + Clone {
    let constants = ELASTIC_CONSTANTS.into_iter().map(|(name, _)| name);
    [DENSITY].into_iter().chain(constants).chain([DAMPING])
}

/// As an enumeration of laws would be, whose names are looked at later.
impl<'de> Deserialize<'de> for Material {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct MaterialVisitor;

        impl<'de> Visitor<'de> for MaterialVisitor {
            type Value = Material;

            fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                formatter.write_str("a table")
            }

            fn visit_enum<A: EnumAccess<'de>>(self, data: A) -> Result<Material, A::Error> {
                let (law, table) = data.variant()?;
                let table = table.newtype_variant()?;
                Ok(Material { law, table })
            }
        }

        deserializer.deserialize_enum("Material", &[], MaterialVisitor)
    }
}

impl Serialize for Material {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map([(&self.law, &self.table)])
    }
}

/// A damage law.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Damage {
    /// A bond breaks for good at a critical stretch.
    CriticalStretch(Spanned<CriticalStretch>),
}

/// Critical stretch, from one of three measures of toughness.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CriticalStretch {
    /// Fracture energy G0 in J/m².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fracture_energy: Option<Number>,
    /// Fracture toughness K_Ic in Pa·√m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fracture_toughness: Option<Number>,
    /// The critical stretch s0 itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub critical_stretch: Option<Number>,
    /// α in s ≥ s0 − α s_min; 0.25 if not given, 0 for a plain critical stretch.
    #[serde(default = "default_alpha")]
    pub alpha: Number,
    /// Sets of points whose bonds never break.
    #[serde(default)]
    pub no_failure: Vec<Text>,
}

fn default_alpha() -> Number {
    default_number(0.25)
}

/// A body: a shape filled with lattice points, or a file of points.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Name of the material.
    pub material: Text,
    /// Name of the damage law; without it bonds never break.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damage: Option<Text>,
    /// The shape that is filled with lattice points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<Spanned<Shape>>,
    /// The file that holds the points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<PointFile>,
    /// Lattice spacing of this body in m; that of `[grid]` if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing: Option<Spanned<Edges>>,
    /// Horizon of this body in m; that of `[grid]` if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub horizon: Option<Number>,
}

/// Points from a file with rows `x y [z] volume block`, separated by commas or spaces.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct PointFile {
    /// Path, relative to the deck.
    pub file: Text,
    /// Take only the rows with this block number; all rows if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub block: Option<Spanned<u32>>,
}

/// A region of space.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// A box (interval, rectangle) between two corners, in m.
    Box {
        /// Lower corner.
        lower: Vector,
        /// Upper corner.
        upper: Vector,
    },
    /// A disc (plane problems).
    Disc {
        /// Centre.
        centre: Vector,
        /// Radius.
        radius: Number,
    },
    /// A cylinder (3-D) between the centres of its two ends.
    Cylinder {
        /// Centre of one end.
        from: Vector,
        /// Centre of the other end.
        to: Vector,
        /// Radius.
        radius: Number,
    },
    /// A ball (3-D).
    Sphere {
        /// Centre.
        centre: Vector,
        /// Radius.
        radius: Number,
    },
    /// A polygon (plane problems).
    Polygon {
        /// Corners [x, y] in order.
        vertices: Spanned<Vec<Vector>>,
    },
    /// A polygon in x and y, extruded along z (3-D).
    Prism {
        /// Corners [x, y] in order.
        vertices: Spanned<Vec<Vector>>,
        /// Lower z.
        bottom: Number,
        /// Upper z.
        top: Number,
    },
    /// Whatever lies in one of the shapes.
    Union(Spanned<Vec<Spanned<Shape>>>),
    /// Whatever lies in the first shape and in none of the others.
    Difference(Spanned<Vec<Spanned<Shape>>>),
}

/// A set of points; exactly one of the keys.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Set {
    /// A condition on the reference position, such as `"x < 2*dx && y > 0"`.
    #[serde(rename = "where", skip_serializing_if = "Option::is_none")]
    pub condition: Option<Number>,
    /// A region.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<Spanned<Shape>>,
    /// The points' global ids, from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ids: Option<Spanned<Vec<Spanned<u64>>>>,
}

/// A surface that cuts bonds.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Crack {
    /// A straight cut (plane problems).
    Segment {
        /// One end.
        from: Vector,
        /// The other end.
        to: Vector,
    },
    /// A parallelogram (3-D).
    Rectangle {
        /// A corner.
        corner: Vector,
        /// The edge from the corner to a neighbouring one.
        edge_a: Vector,
        /// The edge from the corner to the other neighbouring one.
        edge_b: Vector,
    },
    /// A flat disc (3-D).
    Disc {
        /// Centre.
        centre: Vector,
        /// Normal, of any length.
        normal: Vector,
        /// Radius.
        radius: Number,
    },
}

/// Initial values of a set; expressions of x, y, z, one a component.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Initial {
    /// The set; all points if not given.
    #[serde(default = "all_points")]
    pub set: Text,
    /// Displacement in m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement: Option<Vector>,
    /// Velocity in m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<Vector>,
}

fn all_points() -> Text {
    Spanned::new(0..0, "all".to_owned())
}

/// A load or support of a set; exactly one of the quantities. Values are expressions of x, y, z, t,
/// one a component; the string `"free"` leaves a component of a motion free.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// The set that it acts on.
    pub set: Text,
    /// Prescribed displacement in m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement: Option<Vector>,
    /// Prescribed velocity in m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<Vector>,
    /// Body force density in N/m³.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body_force: Option<Vector>,
    /// Traction in Pa on a surface layer of thickness `depth`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub traction: Option<Vector>,
    /// Pressure in Pa against the outward `normal` of a surface layer of thickness `depth`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure: Option<Number>,
    /// Total force in N, spread over the set in proportion to volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force: Option<Vector>,
    /// Thickness in m of the layer that carries a traction or pressure; the spacing if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<Number>,
    /// Outward normal for a pressure, of any length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal: Option<Vector>,
}

/// The time axis.
#[derive(Debug, Clone, Deserialize, Serialize)]
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
}

fn default_safety() -> Number {
    default_number(0.8)
}

/// The result file.
#[derive(Debug, Clone, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Simulated time between outputs in s; a fiftieth of the run if neither is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every: Option<Number>,
    /// Steps between outputs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every_steps: Option<Spanned<NonZeroU64>>,
    /// Names of the fields.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fields: Option<Vec<Text>>,
}

/// The history: sums and probes over time.
#[derive(Debug, Clone, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct History {
    /// Simulated time between rows in s; a five-hundredth of the run if neither is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every: Option<Number>,
    /// Steps between rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every_steps: Option<Spanned<NonZeroU64>>,
    /// Sets whose reaction force is recorded.
    #[serde(default)]
    pub reactions: Vec<Text>,
    /// Points with more damage than this count as cracked in the damage extent; 0.35 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damage_threshold: Option<Number>,
    /// Places whose nearest point is followed, by name.
    #[serde(default)]
    pub probe: Tables<Probe>,
    /// Fronts that are followed along lines, by name.
    #[serde(default)]
    pub front: Tables<Front>,
    /// Crack tips that are followed, by name.
    #[serde(default)]
    pub tip: Tables<Tip>,
}

/// Checkpoints; at most one of the keys.
#[derive(Debug, Clone, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    /// Wall-clock time between checkpoints, such as `"10 min"`, `"90 s"` or `"2 h"`; 10 minutes if
    /// nothing is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every: Option<Text>,
    /// Steps between checkpoints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every_steps: Option<Spanned<NonZeroU64>>,
    /// Simulated time between checkpoints in s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every_time: Option<Number>,
}

/// Points are dealt out anew to the ranks when these have become unequal: their times in the loops over
/// bonds are compared now and then. Results do not depend on it.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Balance {
    /// Steps between looks at the times; 500 if not given.
    #[serde(default = "default_look")]
    pub every_steps: Spanned<NonZeroU64>,
    /// The time of the slowest rank, as a multiple of the mean, above which points are dealt out anew;
    /// 1.2 if not given.
    #[serde(default = "default_imbalance")]
    pub imbalance: Number,
}

fn default_look() -> Spanned<NonZeroU64> {
    Spanned::new(0..0, NonZeroU64::new(500).expect("not 0"))
}

fn default_imbalance() -> Number {
    default_number(1.2)
}

/// A place to watch.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// The place in m; the nearest point is followed.
    pub at: Vector,
}

/// A front: how far a field has come along a line. Of the points near the line, the farthest one above
/// the threshold; from there to the next point ahead, linear interpolation to where the threshold is
/// crossed.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Front {
    /// Where the line starts, m.
    pub from: Vector,
    /// Where it leads, of any length.
    pub direction: Vector,
    /// Length of the line in m; to the end of the bodies if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length: Option<Number>,
    /// Points up to this distance from the line count, in m; the horizon if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<Number>,
    /// Name of an output field.
    pub field: Text,
    /// `"x"`, `"y"` or `"z"` of a vector, whose length is taken if nothing is given; `"xx"`, `"yy"`,
    /// `"zz"`, `"xy"`, `"yz"` or `"xz"` of a stress.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub component: Option<Text>,
    /// What the size of the field must exceed, in the unit of the field.
    pub threshold: Number,
}

/// A crack tip: the farthest point of a set, in one direction, with more damage than a threshold; from
/// there on as for a [`Front`].
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Tip {
    /// Where the length of the crack is counted from, m.
    pub from: Vector,
    /// Where the crack runs, of any length; its own length is counted along this.
    pub direction: Vector,
    /// The points that are looked at; all if not given.
    #[serde(default = "all_points")]
    pub set: Text,
    /// What the damage must exceed; `damage_threshold` if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold: Option<Number>,
}
