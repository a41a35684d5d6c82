//! Grammar of bodies, sets of points and pre-cracks.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Quadrature, Text};
use crate::deck::group_name::GroupName;
use crate::deck::number::{Edges, Number, Vector};
use crate::deck::spanned::Spanned;

/// A body: a shape filled with lattice points, or points from a file or mesh.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Body {
    /// Name of the material.
    pub material: Text,
    /// Name of the damage law. Without a damage law, bonds within the body never break, except bonds of
    /// `softening_pmb` and `fatigue_pmb`. Bonds to another body can break by the damage law of that body, or
    /// by the damage law in `[interface.pair.NAME]` for the two bodies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damage: Option<Text>,
    /// The shape that is filled with lattice points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<Spanned<Shape>>,
    /// The file or mesh that the points come from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub points: Option<Spanned<Points>>,
    /// Lattice spacing of this body in m; the spacing of `[grid]` if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spacing: Option<Spanned<Edges>>,
    /// Positions of the points in a cell of this body: `"midpoint"` or `"gauss"`; the value of `[grid]` if
    /// not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub quadrature: Option<Spanned<Quadrature>>,
    /// Horizon of this body in m; the horizon of `[grid]` if not given. In an expression, `spacing` is the
    /// mean spacing of the points of this body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub horizon: Option<Number>,
}

/// Points from a file or from the elements of a mesh. Exactly one of `file` and `mesh` must be given. Rows of
/// a file are `x [y [z]] volume block`, unless `columns` or a header names other columns. Entries are
/// separated by commas, semicolons or white space.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Points {
    /// Path of the file, relative to the deck.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<Text>,
    /// Path of the mesh, relative to the deck.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<Text>,
    /// Block number in the file, or group in the mesh. The body uses the rows with this number, or the
    /// elements of this group. If not given, the body uses all rows or elements that belong to no other body.
    /// A body without `block` must come after the other bodies with the same file or mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub block: Option<Spanned<GroupName>>,
    /// Names of the columns of the file: coordinates, `volume`, `block`, and any other names. These names
    /// take precedence over a header of the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub columns: Option<Spanned<Vec<String>>>,
    /// Metres per unit of length of the mesh; 1 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<Number>,
}

/// A region of space.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Shape {
    /// A box between two corners; a rectangle in plane problems, an interval in 1-D.
    Box {
        /// Lower corner, m.
        lower: Vector,
        /// Upper corner, m.
        upper: Vector,
    },
    /// A disc (plane problems).
    Disc {
        /// Centre, m.
        centre: Vector,
        /// Radius, m.
        radius: Number,
    },
    /// A cylinder (3-D), given by the centres of its two ends and by its radius.
    Cylinder {
        /// Centre of one end, m.
        from: Vector,
        /// Centre of the other end, m.
        to: Vector,
        /// Radius, m.
        radius: Number,
    },
    /// A ball (3-D).
    Sphere {
        /// Centre, m.
        centre: Vector,
        /// Radius, m.
        radius: Number,
    },
    /// A polygon (plane problems).
    Polygon {
        /// Corners [x, y] in order along the border, m.
        vertices: Spanned<Vec<Vector>>,
    },
    /// A polygon in x and y, extruded along z (3-D).
    Prism {
        /// Corners [x, y] in order along the border, m.
        vertices: Spanned<Vec<Vector>>,
        /// Lower z, m.
        bottom: Number,
        /// Upper z, m.
        top: Number,
    },
    /// The union of the shapes.
    Union(Spanned<Vec<Spanned<Shape>>>),
    /// The first shape without the parts that lie in any of the other shapes.
    Difference(Spanned<Vec<Spanned<Shape>>>),
}

/// A set of points, given by exactly one selector: `where`, `shape`, `ids`, `file` or `mesh`.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Set {
    /// A condition on the reference position, such as `"x < 2*dx && y > 0"`.
    #[serde(rename = "where", skip_serializing_if = "Option::is_none")]
    pub condition: Option<Number>,
    /// Region that contains the points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<Spanned<Shape>>,
    /// The points' global ids, from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ids: Option<Spanned<Vec<Spanned<u64>>>>,
    /// Path, relative to the deck, of a file with the ids of the points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<Text>,
    /// Id that the file uses for the point with the id 0; 0 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_id: Option<Spanned<u64>>,
    /// Name or number of a group in a mesh that defines the points of a body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<Spanned<GroupName>>,
}

/// A pre-crack: bonds that cross this surface (in plane problems, this line) start broken. With a `width`,
/// the pre-crack is a slot: bonds that touch the slot start broken.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Crack {
    /// A straight line (plane problems).
    Segment {
        /// One end, m.
        from: Vector,
        /// The other end, m.
        to: Vector,
        /// Width of a slot in m, half on each side of the segment; 0 if not given.
        #[serde(skip_serializing_if = "Option::is_none")]
        width: Option<Number>,
    },
    /// A parallelogram (3-D).
    Rectangle {
        /// A corner, m.
        corner: Vector,
        /// The vector in m from `corner` to an adjacent corner.
        edge_a: Vector,
        /// The vector in m from `corner` to the other adjacent corner.
        edge_b: Vector,
        /// Width of a slot in m, half on each side of the surface; 0 if not given.
        #[serde(skip_serializing_if = "Option::is_none")]
        width: Option<Number>,
    },
    /// A flat disc (3-D).
    Disc {
        /// Centre, m.
        centre: Vector,
        /// Normal of the disc; a vector of any length.
        normal: Vector,
        /// Radius, m.
        radius: Number,
        /// Width of a slot in m, half on each side of the surface; 0 if not given.
        #[serde(skip_serializing_if = "Option::is_none")]
        width: Option<Number>,
    },
}
