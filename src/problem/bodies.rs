//! Bodies: their points, materials, bonds and damage, and what is told of them by place.

use std::fmt;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::OnceLock;

use super::{Calibration, Law, ThermalExpansion, WorkRule};
use crate::elastic::Isotropic;
use crate::expression::Expression;
use crate::mesh::{GroupKey, Runs};
use crate::points::{Columns, Polygon};
use crate::scatter::Weibull;

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
    pub damage: Option<Damage>,
    /// Horizon δ, m.
    pub horizon: f64,
    /// Where its horizon stands in the deck: its own or that of the grid.
    pub horizon_place: Range<usize>,
    /// Where its points come from.
    pub points: PointSource,
}

impl Body {
    /// Whether its bonds can break, by a damage law or by the law of its material.
    pub fn can_break(&self) -> bool {
        self.damage.is_some() || self.material.law.declaration.breaks_by_itself()
    }

    /// Whether its points are the centres of the cells of a lattice, or its Gauss points.
    pub fn is_on_lattice(&self, jitter: Option<Jitter>) -> bool {
        jitter.is_none() && matches!(self.points, PointSource::Lattice { .. })
    }

    /// Whether its cells have several points.
    pub fn has_gauss_points(&self) -> bool {
        self.quadrature() == Quadrature::Gauss
    }

    /// Where the points of a cell lie; the centre for points from a file or a mesh.
    pub fn quadrature(&self) -> Quadrature {
        match self.points {
            PointSource::Lattice { quadrature, .. } => quadrature,
            PointSource::File { .. } | PointSource::Mesh { .. } => Quadrature::Midpoint,
        }
    }
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
    /// Thermal expansion; none by default.
    pub expansion: ThermalExpansion,
}

/// What volumes near the edge of a family count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VolumeCorrection {
    /// Whole or not at all.
    None,
    /// A share that falls linearly with the distance, from 1 at δ − dx/2 to 0 at δ + dx/2.
    Linear,
    /// The same up to δ, where it falls from 1/2 to 0.
    LinearInside,
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

/// Random displacement of the points of shapes from the centres of their cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jitter {
    /// The largest displacement by direction, as a share of the cell's edge.
    pub share: f64,
    /// The seed.
    pub seed: u64,
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
    /// Pairs of bodies that have a rule or damage of their own.
    pub pairs: Vec<InterfacePair>,
}

/// The bonds between two bodies.
#[derive(Debug, Clone)]
pub struct InterfacePair {
    /// Its name in the deck.
    pub name: String,
    /// Names of the two bodies, in any order.
    pub bodies: [String; 2],
    /// Constants of the bonds.
    pub rule: InterfaceRule,
    /// When the bonds break.
    pub damage: InterfaceDamage,
    /// Where that stands in the deck.
    pub span: Range<usize>,
}

/// When the bonds between two bodies break.
#[derive(Debug, Clone, PartialEq)]
pub enum InterfaceDamage {
    /// By the damage of both bodies: at the smaller of two thresholds.
    OfBodies,
    /// Never.
    Unbreakable,
    /// By damage of their own, whatever that of the bodies is.
    Own(Damage),
}

impl InterfaceDamage {
    /// The damage of the bonds' own, if they have any.
    pub fn own(&self) -> Option<&Damage> {
        match self {
            Self::Own(damage) => Some(damage),
            Self::OfBodies | Self::Unbreakable => None,
        }
    }
}

impl Interface {
    /// The pair of two bodies, in any order, if it is listed.
    pub fn pair(&self, here: &Body, there: &Body) -> Option<&InterfacePair> {
        self.pairs.iter().find(|pair| {
            let [a, b] = &pair.bodies;
            (*a == here.name && *b == there.name) || (*a == there.name && *b == here.name)
        })
    }

    /// The rule of the bonds between two bodies; the same for both orders. Within a body each end has its
    /// own constants.
    pub fn between(&self, here: &Body, there: &Body) -> InterfaceRule {
        if here.name == there.name {
            return InterfaceRule::Own;
        }
        let own = self.pair(here, there);
        own.map_or(self.rule, |pair| pair.rule)
    }

    /// When the bonds between two bodies break; the same for both orders. Within a body its own damage counts.
    pub fn damage_between(&self, here: &Body, there: &Body) -> &InterfaceDamage {
        let own = self.pair(here, there);
        own.map_or(&InterfaceDamage::OfBodies, |pair| &pair.damage)
    }
}

impl InterfacePair {
    /// Damage of its own, if it has any.
    pub fn own_damage(&self) -> Option<&Damage> {
        self.damage.own()
    }

    /// Whether a body is one of the two.
    pub fn has(&self, body: &Body) -> bool {
        self.bodies.contains(&body.name)
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

/// When bonds break.
#[derive(Debug, Clone, PartialEq)]
pub struct Damage {
    /// What they break by.
    pub rule: DamageRule,
    /// How much it takes.
    pub toughness: Toughness,
    /// α in s ≥ s0 − α s_min.
    pub alpha: f64,
    /// Scatter of the strength of the points, if there is any.
    pub weibull: Option<Weibull>,
    /// Indices of sets whose bonds never break.
    pub no_failure: Vec<usize>,
}

/// What bonds break by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DamageRule {
    /// Their stretch.
    CriticalStretch,
    /// The work that they have taken.
    Energy {
        /// How the critical work follows.
        calibration: Calibration,
        /// How the work is looked at; for laws that are not bond-based.
        work: WorkRule,
    },
}

/// Three measures of how much a material resists a crack.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Toughness {
    /// G0, J/m².
    FractureEnergy(f64),
    /// K_Ic, Pa·√m.
    FractureToughness(f64),
    /// s0 itself, for laws with a critical stretch.
    CriticalStretch(f64),
}

/// Where points come from.
#[derive(Debug, Clone)]
pub enum PointSource {
    /// The points of lattice cells whose centres lie within a shape.
    Lattice {
        /// The shape.
        shape: Shape,
        /// Edges of a cell, m.
        spacing: [f64; 3],
        /// A corner of a cell, m.
        origin: [f64; 3],
        /// Where the points of a cell lie.
        quadrature: Quadrature,
    },
    /// The rows of a file.
    File {
        /// Path, already relative to the working directory.
        path: PathBuf,
        /// Only rows with this block number.
        block: Option<u32>,
        /// The columns of a row, if the deck names them.
        columns: Option<Columns>,
        /// Where the file is named in the deck.
        span: Range<usize>,
    },
    /// The elements of a mesh.
    Mesh {
        /// Path, already relative to the working directory.
        path: PathBuf,
        /// The group of its elements; all elements that no other body has if not given.
        block: Option<GroupKey>,
        /// Metres per unit of length of the mesh.
        scale: f64,
        /// Where the file is named in the deck.
        span: Range<usize>,
        /// Where the group is named in the deck.
        block_span: Range<usize>,
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
        /// The polygon.
        base: Polygon,
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
        /// The file that has them, if it is not the deck.
        file: Option<IdFile>,
        /// Where the largest one stands in the deck.
        largest: Range<usize>,
    },
    /// Those of a group of the meshes that bodies have their points from.
    Mesh(MeshSet),
}

/// A file with the numbers of points.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IdFile {
    /// Path, already relative to the working directory.
    pub path: PathBuf,
    /// Number of the first point in it.
    pub first: u64,
}

/// The points of a named group of the problem's meshes. They are known once the points have been generated.
#[derive(Clone)]
pub struct MeshSet {
    /// The group's name or number.
    pub group: GroupKey,
    /// Where it stands in the deck.
    pub span: Range<usize>,
    ids: OnceLock<Runs>,
}

impl MeshSet {
    /// The points of a group that is named at `span` in the deck.
    pub fn new(group: GroupKey, span: Range<usize>) -> Self {
        Self {
            group,
            span,
            ids: OnceLock::new(),
        }
    }

    /// Set the ids of the points; return whether they are those of an earlier call, if there was one.
    pub fn resolve(&self, ids: Runs) -> bool {
        let ids = &ids;
        self.ids.get_or_init(|| ids.clone()) == ids
    }

    /// Test whether the point with an id is in the set; false before the points have been generated.
    pub fn contains(&self, id: u64) -> bool {
        self.ids.get().is_some_and(|ids| ids.contains(id))
    }
}

/// Without the ids, which are no part of the description.
impl fmt::Debug for MeshSet {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "MeshSet({:?})", self.group)
    }
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
        /// From face to face, half on each side; 0 for a cut without width.
        width: f64,
    },
    /// A parallelogram.
    Rectangle {
        /// A corner.
        corner: [f64; 3],
        /// One edge from it.
        edge_a: [f64; 3],
        /// The other edge from it.
        edge_b: [f64; 3],
        /// As of a segment.
        width: f64,
    },
    /// A flat disc.
    Disc {
        /// Centre.
        centre: [f64; 3],
        /// Unit normal.
        normal: [f64; 3],
        /// Radius.
        radius: f64,
        /// As of a segment.
        width: f64,
    },
}

impl Crack {
    /// Whether it is a slot with two faces instead of a cut.
    pub fn has_width(&self) -> bool {
        let (Self::Segment { width, .. }
        | Self::Rectangle { width, .. }
        | Self::Disc { width, .. }) = self;
        *width > 0.0
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
