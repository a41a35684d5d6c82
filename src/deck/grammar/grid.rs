//! The grid, and the bonds between bodies.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Tables, Text};
use crate::deck::number::{Edges, Number, Vector};
use crate::deck::spanned::Spanned;

/// The lattice and the range of the bonds.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Edge of a lattice cell in m, or a list with one a dimension; for bodies given as shapes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing: Option<Spanned<Edges>>,
    /// Horizon δ in m: points up to this distance are bonded.
    pub horizon: Number,
    /// A corner of a lattice cell in m; points lie at the centres of cells. If not given, 0 in each direction, or the lower
    /// face of the first body that is a whole number of cells long and would not be filled exactly from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin: Option<Vector>,
    /// What the volumes of points near the edge of a family count: `"exact"`, `"linear"` or `"none"`; if not
    /// given, `"exact"` where all points are centres of square or cubic cells, and else `"none"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume_correction: Option<Spanned<VolumeCorrection>>,
    /// The points of a lattice cell: `"midpoint"` or `"gauss"`.
    #[serde(default)]
    pub quadrature: Quadrature,
    /// How far points of shapes are moved at random from the centres of their cells: by direction by up to this share of
    /// the spacing, below 0.5. Not at all if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jitter: Option<Number>,
    /// Seed of `jitter`: other numbers move the points otherwise; 0 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<Spanned<u64>>,
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum VolumeCorrection {
    /// Points within the horizon count whole.
    None,
    /// Points count clamp((δ + dx/2 − |ξ|)/dx, 0, 1), those beyond the horizon too (PA-HHB).
    Linear,
    /// As `linear`, without points beyond the horizon (LAMMPS; Dipasquale et al. 2014, eq. 1 with eq. 10).
    LinearInside,
    /// Points count the share of their cell within the horizon.
    Exact,
}

/// The points of a lattice cell.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Quadrature {
    /// One at the centre.
    #[default]
    Midpoint,
    /// 2 in 1-D, 4 in the plane, 8 in 3-D.
    Gauss,
}

/// The bonds between blocks.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Interface {
    /// What constants they have: `"own"`, `"average"` or `"minimum"`. With `"own"` each end exerts its
    /// half with its own modulus and horizon; else both have the mean or the smaller of each. `"none"`:
    /// there are none, however near the bodies are. If not given, `"own"`, or `"none"` with `[contact]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rule: Option<Spanned<Rule>>,
    /// Pairs of bodies with a rule or damage of their own, by any name.
    #[serde(default)]
    pub pair: Tables<Pair>,
}

/// The bonds between two bodies.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pair {
    /// Names of the two bodies, in any order.
    pub bodies: Spanned<Vec<Text>>,
    /// As for all pairs, whose rule it is if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rule: Option<Spanned<Rule>>,
    /// Name of the damage law of these bonds, whatever that of the bodies is, or `"none"`: they never break. If neither this
    /// nor `strength` is given, they break at the smaller threshold of both bodies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damage: Option<Text>,
    /// Stress in Pa, normal to the interface, at which these bonds begin to open; their critical stretch follows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strength: Option<Number>,
}

/// What constants bonds between blocks have, if there are any.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
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
