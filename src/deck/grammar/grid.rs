//! The grid, and the bonds between bodies.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Tables, Text};
use crate::deck::number::{Edges, Number, Vector};
use crate::deck::spanned::Spanned;

/// The lattice of the points, the horizon, and the storage of the bonds.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Edge of a lattice cell in m, or a list with one edge for each dimension. Only bodies given as shapes
    /// use this key.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing: Option<Spanned<Edges>>,
    /// Horizon δ in m: points up to this distance are bonded. With the volume corrections `"exact"` and
    /// `"linear"`, points that are slightly farther apart are bonded too. In an expression, for example
    /// `"3.015 * spacing"`, `spacing` is the mean spacing of the points of a body. The expression is
    /// evaluated separately for each body without its own horizon.
    pub horizon: Number,
    /// Position in m of a corner of a lattice cell. The default is chosen separately for each spacing and
    /// each direction. One body with this spacing determines the default. It is the first body with two flat
    /// faces that are normal to this direction and a whole number of cells apart. The default is 0 if a grid
    /// with the origin 0 fills this body exactly, otherwise the position of the lower face of the body.
    /// Without such a body, the default is 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin: Option<Vector>,
    /// Volume correction of points near the edge of a family: `"exact"`, `"linear"`, `"linear-inside"` or
    /// `"none"`. The default is `"exact"` if all points are centres of square or cubic cells, otherwise
    /// `"none"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume_correction: Option<Spanned<VolumeCorrection>>,
    /// Positions of the points in a lattice cell: `"midpoint"` or `"gauss"`.
    #[serde(default)]
    pub quadrature: Quadrature,
    /// Largest random shift of a point from the centre of its cell in each direction, in spacings; below 0.5.
    /// Only points of bodies given as shapes are shifted. If not given, no points are shifted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jitter: Option<Number>,
    /// Seed of the random shifts of `jitter`; 0 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<Spanned<u64>>,
    /// How bonds are stored. `"lattice"` uses one bit per bond and needs points on a regular grid. Points
    /// from a file are allowed if they form a regular grid. `"list"` works for any points. `"auto"` uses a
    /// lattice where possible. Bonds between bodies on different grids are always stored in lists. The choice
    /// changes results by rounding only.
    #[serde(default = "automatic")]
    pub family: Spanned<Family>,
}

fn automatic() -> Spanned<Family> {
    Spanned::new(0..0, Family::Auto)
}

/// How bonds are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Family {
    /// In lattice families for bodies on a lattice, otherwise in lists.
    Auto,
    /// In a neighbour list of each point.
    List,
    /// In one bit per lattice offset.
    Lattice,
}

/// How volumes near the edge of a family are corrected.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum VolumeCorrection {
    /// No correction: points within the horizon have their full volume.
    None,
    /// The factor on the volume is clamp((δ + dx/2 − |ξ|)/dx, 0, 1), also for points beyond the horizon (Hu,
    /// Ha & Bobaru 2010; PA-HHB in Seleson 2014). δ is the horizon, dx the spacing, and |ξ| the length of the
    /// bond.
    Linear,
    /// The factor of `linear` for points within the horizon, and 0 for points beyond it (as in LAMMPS).
    LinearInside,
    /// The factor on the volume is the fraction of the cell that lies within the horizon.
    Exact,
}

/// Positions of the points in a lattice cell.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Quadrature {
    /// One point at the centre.
    #[default]
    Midpoint,
    /// The Gauss points: 2 in 1-D, 4 in the plane, 8 in 3-D.
    Gauss,
}

/// Bonds between bodies.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Interface {
    /// Constants of the bonds between bodies. `"own"`: each end exerts its half of the force with its own
    /// modulus and horizon. `"average"`: both ends use the mean modulus and the mean horizon. `"minimum"`:
    /// both ends use the smaller modulus and the smaller horizon. `"none"`: bodies are not bonded, whatever
    /// their distance. The default is `"none"` in a deck with `[contact]`, otherwise `"own"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rule: Option<Spanned<Rule>>,
    /// Pairs of bodies with their own rule or damage law; each pair has a freely chosen name.
    #[serde(default)]
    pub pair: Tables<Pair>,
}

/// The bonds between two bodies.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pair {
    /// Names of the two bodies, in any order.
    pub bodies: Spanned<Vec<Text>>,
    /// Constants of these bonds; the values have the same meaning as in `[interface]`. The default is the
    /// `rule` of `[interface]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rule: Option<Spanned<Rule>>,
    /// Name of the damage law of these bonds, which replaces the damage laws of the bodies. With `"none"`
    /// these bonds never break. If neither `damage` nor `strength` is given, the bonds break by the damage
    /// laws of the two bodies. If the horizons of the two bodies are equal, a bond breaks at the smaller
    /// threshold of the two damage laws. Otherwise, the critical stretch or critical work of a bond is
    /// computed from both damage laws and both horizons.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damage: Option<Text>,
    /// Stress in Pa, normal to the interface, at which these bonds begin to break. The critical stretch of
    /// the bonds follows from this stress.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strength: Option<Number>,
}

/// Constants of the bonds between bodies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Rule {
    /// No bonds.
    None,
    /// The mean of the two moduli, and the mean of the two horizons.
    Average,
    /// The smaller of the two moduli, and the smaller of the two horizons.
    Minimum,
    /// Each end uses its own constants.
    Own,
}
