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
    /// The stages of the run in their order; without them there is one, that of `[time]`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stage: Vec<Spanned<Stage>>,
    /// What is written to the result, and how often.
    #[serde(default = "nowhere")]
    pub output: Spanned<Output>,
    /// What is written to the history, and how often.
    #[serde(default = "nowhere")]
    pub history: Spanned<History>,
    /// How often the run can be continued from.
    #[serde(default = "nowhere")]
    pub checkpoint: Spanned<Checkpoint>,
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
    /// What the volumes of points near the edge of a family count: `"exact"`, `"linear"` or `"none"`; if not
    /// given, `"exact"` where all points are centres of square or cubic cells, and else `"none"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume_correction: Option<Spanned<VolumeCorrection>>,
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

/// How volumes near the edge of a family are corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum VolumeCorrection {
    /// Points within the horizon count whole.
    None,
    /// Points count clamp((δ + dx/2 − |ξ|)/dx, 0, 1), those beyond the horizon too (PA-HHB); LAMMPS ends
    /// this taper at δ, Peridigm has none.
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
    /// A bond that is pulled breaks for good when it has taken a work.
    Energy(Spanned<BondEnergy>),
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
    /// α in s ≥ s0 − α s_min; 0 if not given, a plain critical stretch.
    #[serde(default = "default_alpha")]
    pub alpha: Number,
    /// Sets of points whose bonds never break.
    #[serde(default)]
    pub no_failure: Vec<Text>,
}

/// The work of bonds, from one of two measures of toughness.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct BondEnergy {
    /// Fracture energy G0 in J/m².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fracture_energy: Option<Number>,
    /// Fracture toughness K_Ic in Pa·√m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fracture_toughness: Option<Number>,
    /// How the critical work follows: "energy" (all bonds across an area take the fracture energy) or
    /// "willberg2022" (as in Willberg et al. 2022, eq. 16 and 18).
    #[serde(default)]
    pub calibration: Calibration,
    /// α: the threshold is that of a stretch s0 − α s_min in place of s0; 0 if not given.
    #[serde(default = "no_alpha")]
    pub alpha: Number,
    /// Sets of points whose bonds never break.
    #[serde(default)]
    pub no_failure: Vec<Text>,
}

/// How the critical work of bonds follows from the fracture energy.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Calibration {
    /// From the energy of all bonds across an area.
    #[default]
    Energy,
    /// As printed in Willberg et al. 2022.
    Willberg2022,
}

fn no_alpha() -> Number {
    default_number(0.0)
}

fn default_alpha() -> Number {
    default_number(0.0)
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
        /// Width in m of a cut with two faces, half on each side; 0 if not given.
        #[serde(skip_serializing_if = "Option::is_none")]
        width: Option<Number>,
    },
    /// A parallelogram (3-D).
    Rectangle {
        /// A corner.
        corner: Vector,
        /// The edge from the corner to a neighbouring one.
        edge_a: Vector,
        /// The edge from the corner to the other neighbouring one.
        edge_b: Vector,
        /// As of a segment.
        #[serde(skip_serializing_if = "Option::is_none")]
        width: Option<Number>,
    },
    /// A flat disc (3-D).
    Disc {
        /// Centre.
        centre: Vector,
        /// Normal, of any length.
        normal: Vector,
        /// Radius.
        radius: Number,
        /// As of a segment.
        #[serde(skip_serializing_if = "Option::is_none")]
        width: Option<Number>,
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
    /// How the points come to move: `"explicit"`, by the equation of motion, or `"relaxation"`, from one
    /// equilibrium to the next.
    #[serde(default = "explicit")]
    pub method: Spanned<Method>,
    /// How equilibria are found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relaxation: Option<Spanned<Relaxation>>,
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
#[derive(Debug, Clone, Deserialize, Serialize)]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Velocity Verlet.
    Explicit,
    /// Adaptive dynamic relaxation in load steps; t is the load parameter.
    Relaxation,
}

/// A step that follows the number of bonds that break in it.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Adaptive {
    /// A step that breaks more bonds of any point is undone, and made again with a shorter one.
    #[serde(default = "default_most_broken")]
    pub most_broken: NonZeroU64,
    /// A step that breaks no more bonds of any point is calm.
    #[serde(default = "default_stable_broken")]
    pub stable_broken: Spanned<u64>,
    /// Calm steps in a row before the step is raised.
    #[serde(default = "default_calm_steps")]
    pub steps: NonZeroU64,
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

fn default_most_broken() -> NonZeroU64 {
    NonZeroU64::new(2).expect("not 0")
}

fn default_stable_broken() -> Spanned<u64> {
    Spanned::new(0..0, 1)
}

fn default_calm_steps() -> NonZeroU64 {
    NonZeroU64::new(10).expect("not 0")
}

fn default_reduce() -> Number {
    default_number(0.5)
}

fn default_raise() -> Number {
    default_number(1.5)
}

/// How equilibria are found.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Relaxation {
    /// Number of load steps.
    #[serde(default = "default_load_steps")]
    pub load_steps: NonZeroU64,
    /// What the forces that are out of balance may be, as a share of loads and reactions.
    #[serde(default = "default_tolerance")]
    pub tolerance: Number,
    /// The most iterations of a load step.
    #[serde(default = "default_iterations")]
    pub iterations: NonZeroU64,
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

fn default_load_steps() -> NonZeroU64 {
    NonZeroU64::new(20).expect("not 0")
}

fn default_tolerance() -> Number {
    default_number(1e-6)
}

fn default_iterations() -> NonZeroU64 {
    NonZeroU64::new(100_000).expect("not 0")
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
    /// Of the fields that change in time: `"double"`, 8 bytes a number, or `"single"`, 4 bytes.
    #[serde(default)]
    pub precision: Precision,
    /// The set whose points the result holds; all points if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set: Option<Text>,
}

/// How long the numbers of a result are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// 8 bytes: every bit.
    #[default]
    Double,
    /// 4 bytes: seven digits.
    Single,
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
    /// Sets whose reaction force is recorded, by component.
    #[serde(default)]
    pub reactions: Vec<Text>,
    /// Forces of supports along a direction, by name.
    #[serde(default)]
    pub force: Tables<SupportForce>,
    /// Points with more damage than this count as cracked in the damage extent; 0.35 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damage_threshold: Option<Number>,
    /// Places whose nearest point is followed, by name.
    #[serde(default)]
    pub probe: Tables<Probe>,
    /// Fronts that are followed along lines, by name.
    #[serde(default)]
    pub front: Tables<Front>,
    /// Cracks whose path and length are found, by name; plane problems.
    #[serde(default)]
    pub crack: Tables<CrackPath>,
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

/// The force of the supports on a set along a direction.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct SupportForce {
    /// The set.
    pub set: Text,
    /// The direction in which the force counts, of any length.
    pub direction: Vector,
}

/// A crack: the lines through the middle of the damage that hangs together from a place on, each
/// branch by itself.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct CrackPath {
    /// Where the crack starts, m; damage within one horizon of it belongs to the crack.
    pub from: Vector,
    /// The points that are looked at; all if not given.
    #[serde(default = "all_points")]
    pub set: Text,
    /// What the damage must exceed; `damage_threshold` if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold: Option<Number>,
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
