//! Bodies with their points, materials, bonds and damage; sets of points and pre-cracks.

use std::fmt;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::OnceLock;

use super::{Calibration, Law, StressRule, ThermalExpansion, ToughnessByDirection, WorkRule};
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
    /// Its span in the deck.
    pub span: Range<usize>,
    /// The material's name.
    pub material_name: String,
    /// The material.
    pub material: Material,
    /// The damage law, if bonds can break.
    pub damage: Option<Damage>,
    /// Horizon δ, m.
    pub horizon: f64,
    /// Span of its horizon in the deck: the horizon of the body or of the grid.
    pub horizon_place: Range<usize>,
    /// Source of its points.
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

    /// Positions of the points in a cell; the centre for points from a file or a mesh.
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
    /// E and ν; a bond-based law fixes ν.
    pub elastic: Isotropic,
    /// Viscous damping r, 1/s: a force density −r ρ u̇.
    pub damping: f64,
    /// Thermal expansion; none by default.
    pub expansion: ThermalExpansion,
}

/// Volume correction of points near the edge of a family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VolumeCorrection {
    /// No correction: the factor is 1 within the horizon and 0 beyond it.
    None,
    /// The factor falls linearly with the distance, from 1 at δ − dx/2 to 0 at δ + dx/2.
    Linear,
    /// The same linear factor up to δ, where it drops from 1/2 to 0.
    LinearInside,
    /// The factor is the fraction of the cell that lies within the horizon.
    Exact,
}

/// Positions of the points in a lattice cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quadrature {
    /// One point at the centre.
    Midpoint,
    /// Two points in each direction, at ±√3/3 of half the edge.
    Gauss,
}

impl Quadrature {
    /// Number of points in a cell of this dimension.
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
    /// The largest displacement in each direction, as a fraction of the cell's edge.
    pub share: f64,
    /// The seed.
    pub seed: u64,
}

/// How bonds are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FamilyRule {
    /// In lattice families for bodies on a lattice, in lists for other bodies.
    Auto,
    /// In lists.
    List,
    /// In lattice families; every body must lie on a lattice.
    Lattice,
}

/// The bonds between blocks.
#[derive(Debug, Clone)]
pub struct Interface {
    /// The rule of pairs without their own rule.
    pub rule: InterfaceRule,
    /// Pairs of bodies with their own rule or damage.
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
    /// Its span in the deck.
    pub span: Range<usize>,
}

/// When the bonds between two bodies break.
#[derive(Debug, Clone, PartialEq)]
pub enum InterfaceDamage {
    /// By the damage laws of both bodies, at the smaller of their thresholds.
    OfBodies,
    /// Never.
    Unbreakable,
    /// By their own damage law, which replaces the damage laws of the bodies.
    Own(Damage),
}

impl InterfaceDamage {
    /// The bonds' own damage law, if they have one.
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

    /// The rule of the bonds between two bodies, independent of their order. Within a body, each end has its own
    /// constants.
    pub fn between(&self, here: &Body, there: &Body) -> InterfaceRule {
        if here.name == there.name {
            return InterfaceRule::Own;
        }
        let own = self.pair(here, there);
        own.map_or(self.rule, |pair| pair.rule)
    }

    /// When the bonds between two bodies break, independent of their order. Within a body, its damage law decides.
    pub fn damage_between(&self, here: &Body, there: &Body) -> &InterfaceDamage {
        let own = self.pair(here, there);
        own.map_or(&InterfaceDamage::OfBodies, |pair| &pair.damage)
    }
}

impl InterfacePair {
    /// Its own damage law, if it has one.
    pub fn own_damage(&self) -> Option<&Damage> {
        self.damage.own()
    }

    /// Whether the body is one of the pair.
    pub fn has(&self, body: &Body) -> bool {
        self.bodies.contains(&body.name)
    }
}

/// Constants of the bonds between two blocks.
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

/// A damage law: when bonds break.
#[derive(Debug, Clone, PartialEq)]
pub struct Damage {
    /// The quantity that decides whether a bond breaks.
    pub rule: DamageRule,
    /// The toughness, from which the threshold follows.
    pub toughness: Toughness,
    /// α in the criterion s ≥ s0 − α s_min.
    pub alpha: f64,
    /// Scatter of the strength of the points, if there is any.
    pub weibull: Option<Weibull>,
    /// Toughness by direction, if it is not the same in all directions. The fracture energy is then that of cracks along
    /// its axis.
    pub direction: Option<ToughnessByDirection>,
    /// Indices of sets whose bonds never break.
    pub no_failure: Vec<usize>,
}

/// The quantity that decides whether a bond breaks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DamageRule {
    /// The stretch of the bond.
    CriticalStretch,
    /// The work done on the bond.
    Energy {
        /// How the critical work follows from the toughness.
        calibration: Calibration,
        /// How the work is looked at; for laws that are not bond-based.
        work: WorkRule,
    },
    /// The stress of the points of the bond.
    Stress(StressRule),
}

/// Toughness, in one of four measures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Toughness {
    /// G0, J/m².
    FractureEnergy(f64),
    /// K_Ic, Pa·√m.
    FractureToughness(f64),
    /// s0 itself, for laws with a critical stretch.
    CriticalStretch(f64),
    /// Strength, Pa, for damage by stress.
    Strength(f64),
}

/// Source of a body's points.
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
        /// Positions of the points in a cell.
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
        /// Span of the file's name in the deck.
        span: Range<usize>,
    },
    /// The elements of a mesh.
    Mesh {
        /// Path, already relative to the working directory.
        path: PathBuf,
        /// The group of its elements; if not given, all elements that belong to no other body.
        block: Option<GroupKey>,
        /// Metres per unit of length of the mesh.
        scale: f64,
        /// Span of the file's name in the deck.
        span: Range<usize>,
        /// Span of the group's name in the deck.
        block_span: Range<usize>,
    },
}

/// A region of space, lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A box, rectangle or interval between two corners.
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
    /// A cylinder between the centres of its ends.
    Cylinder {
        /// Centre of one end.
        from: [f64; 3],
        /// Centre of the other end.
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
    /// The union of shapes.
    Union(Vec<Shape>),
    /// The first shape without the parts that lie in any other shape.
    Difference(Vec<Shape>),
}

/// A named set of points.
#[derive(Debug, Clone)]
pub struct Set {
    /// Its name.
    pub name: String,
    /// Its span in the deck.
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
    /// Points whose reference position fulfils this condition.
    Where(Expression),
    /// Points within a region.
    Within(Shape),
    /// Points with these global ids.
    Ids {
        /// Sorted.
        ids: Vec<u64>,
        /// The file that has them, if it is not the deck.
        file: Option<IdFile>,
        /// Where the largest one stands in the deck.
        largest: Range<usize>,
    },
    /// Points of a group of the meshes that define the points of bodies.
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
    /// Its span in the deck.
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

    /// Set the ids of the points. Return whether they equal the ids of an earlier call; true for the first call.
    pub fn resolve(&self, ids: Runs) -> bool {
        let ids = &ids;
        self.ids.get_or_init(|| ids.clone()) == ids
    }

    /// Test whether the point with an id is in the set; false before the points have been generated.
    pub fn contains(&self, id: u64) -> bool {
        self.ids.get().is_some_and(|ids| ids.contains(id))
    }
}

/// Omit the ids, which do not belong to the description.
impl fmt::Debug for MeshSet {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "MeshSet({:?})", self.group)
    }
}

/// A pre-crack; bonds that cross it start broken.
#[derive(Debug, Clone, PartialEq)]
pub struct PreCrack {
    /// Its name.
    pub name: String,
    /// Its span in the deck.
    pub span: Range<usize>,
    /// The surface.
    pub surface: Crack,
}

/// A surface that cuts bonds; lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub enum Crack {
    /// A segment, in plane problems.
    Segment {
        /// One end.
        from: [f64; 3],
        /// The other.
        to: [f64; 3],
        /// Width of the slot, half on each side; 0 for a cut without width.
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
        /// Width of the slot, half on each side of the surface; 0 for a cut without width.
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
        /// Width of the slot, half on each side of the surface; 0 for a cut without width.
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
    /// Whether it is calibrated with the energy that separates a block, and this energy has not been computed yet.
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
