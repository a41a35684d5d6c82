//! Bodies with their points, materials, bonds and damage. Also sets of points, and pre-cracks.

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

/// A body: points with one material and damage law.
#[derive(Debug, Clone)]
pub struct Body {
    /// Name in the deck.
    pub name: String,
    /// Span in the deck.
    pub span: Range<usize>,
    /// Name of the material.
    pub material_name: String,
    /// Law, density, elastic constants, damping and thermal expansion.
    pub material: Material,
    /// The damage law; `None` if bonds never break, or break by the law of the material.
    pub damage: Option<Damage>,
    /// Horizon δ, m.
    pub horizon: f64,
    /// Span of the horizon in the deck: in the section of the body, or in `[grid]` if the body gives no
    /// horizon.
    pub horizon_span: Range<usize>,
    /// Source of the points.
    pub points: PointSource,
}

impl Body {
    /// Test whether bonds of the body can break, by a damage law or by the law of its material.
    pub fn can_break(&self) -> bool {
        let law = self.material.law.declaration;
        self.damage.is_some() || law.breaks_by_itself() || law.wears_out
    }

    /// Test whether the points are the centres or Gauss points of the cells of a lattice. `jitter` is the
    /// jitter of the problem.
    pub fn is_on_lattice(&self, jitter: Option<Jitter>) -> bool {
        jitter.is_none() && matches!(self.points, PointSource::Lattice { .. })
    }

    /// Test whether each cell of the body's lattice has several points.
    pub fn has_gauss_points(&self) -> bool {
        self.quadrature() == Quadrature::Gauss
    }

    /// Return the edge of the lattice cells, m; `None` for points from a file or a mesh, and for cells with
    /// edges of different lengths.
    pub fn single_spacing(&self, dimension: usize) -> Option<f64> {
        match &self.points {
            PointSource::Lattice { spacing, .. } => {
                let edges = &spacing[..dimension];
                let are_equal = edges.iter().all(|edge| *edge == edges[0]);
                are_equal.then_some(edges[0])
            }
            PointSource::File { .. } | PointSource::Mesh { .. } => None,
        }
    }

    /// Return the reason why the volumes of the points cannot be corrected at the edge of a family; `None` if
    /// the points are the centres of square or cubic cells. `is_jittered` tells whether the problem has a
    /// jitter.
    pub(crate) fn no_cell_volume(
        &self,
        is_jittered: bool,
        dimension: usize,
    ) -> Option<&'static str> {
        match &self.points {
            PointSource::File { .. } => Some("has its points from a file"),
            PointSource::Mesh { .. } => Some("has its points from a mesh"),
            PointSource::Lattice { .. } if self.has_gauss_points() => Some("has Gauss points"),
            PointSource::Lattice { .. } if is_jittered => Some("has points that `jitter` moves"),
            PointSource::Lattice { .. } => self
                .single_spacing(dimension)
                .is_none()
                .then_some("has cells with edges of different lengths"),
        }
    }

    /// Return the diagonal of a lattice cell (m) if it is longer than the horizon, otherwise `None`.
    /// Refinement during a run needs a shorter diagonal. The rank that owns a new point needs the parents of
    /// this point as owned points or ghosts. The parents may be a diagonal apart, and ghosts are at most a
    /// horizon away.
    pub(crate) fn diagonal_above_horizon(&self, dimension: usize) -> Option<f64> {
        let PointSource::Lattice { spacing, .. } = self.points else {
            return None;
        };
        let edges = spacing[..dimension].iter();
        let diagonal = edges.map(|edge| edge * edge).sum::<f64>().sqrt();
        (self.horizon < diagonal).then_some(diagonal)
    }

    /// Return the rule for the positions of the points in a cell. For points from a file or a mesh,
    /// return [`Quadrature::Midpoint`].
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
    /// Law with the values of its keys.
    pub law: Law,
    /// Density, kg/m³.
    pub density: f64,
    /// Elastic constants E and ν. A bond-based law fixes ν, except for a bar under uniaxial stress.
    pub elastic: Isotropic,
    /// Rate r of viscous damping, 1/s. The damping exerts the force density −r ρ u̇.
    pub damping: f64,
    /// Thermal expansion; 0 by default.
    pub expansion: ThermalExpansion,
}

/// Volume correction for cells at the edge of a family.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VolumeCorrection {
    /// No correction: the factor is 1 within the horizon and 0 beyond it.
    None,
    /// The factor falls linearly with the distance, from 1 at δ − dx/2 to 0 at δ + dx/2.
    Linear,
    /// The factor of [`Self::Linear`] up to the distance δ, and 0 beyond this distance.
    LinearInside,
    /// The factor is the fraction of the cell that lies within the horizon.
    Exact,
}

/// Positions of the points in a lattice cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quadrature {
    /// One point at the centre.
    Midpoint,
    /// Two points along each axis. In each direction, a point lies at ±√3/3 of half the edge from the centre.
    Gauss,
}

impl Quadrature {
    /// Return the number of points in a cell of this dimension.
    pub fn points(self, dimension: usize) -> u32 {
        match self {
            Self::Midpoint => 1,
            Self::Gauss => 1 << dimension,
        }
    }
}

/// Random displacement of the points of lattices from the centres of their cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jitter {
    /// The largest displacement in each direction, as a fraction of the cell's edge.
    pub largest_shift: f64,
    /// Seed of the random displacements.
    pub seed: u64,
}

/// Storage of bonds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FamilyRule {
    /// Lattice families for bodies on a lattice, lists for other bodies.
    Auto,
    /// Lists for all bodies.
    List,
    /// Lattice families for all bodies; every body must lie on a lattice.
    Lattice,
}

/// Rules for the bonds between bodies.
#[derive(Debug, Clone)]
pub struct Interface {
    /// Default for pairs of bodies that are not in `pairs`.
    pub rule: InterfaceRule,
    /// Pairs of bodies for which the deck gives a separate rule or damage.
    pub pairs: Vec<InterfacePair>,
}

/// Rules for the bonds between two bodies.
#[derive(Debug, Clone)]
pub struct InterfacePair {
    /// Name in the deck.
    pub name: String,
    /// Names of the two bodies, in any order.
    pub bodies: [String; 2],
    /// Rule for the elastic constants and the horizon of the bonds.
    pub rule: InterfaceRule,
    /// Breaking of the bonds.
    pub damage: InterfaceDamage,
    /// Span in the deck.
    pub span: Range<usize>,
}

/// Breaking of the bonds between two bodies.
#[derive(Debug, Clone, PartialEq)]
pub enum InterfaceDamage {
    /// Bonds break by the damage laws of both bodies. If the horizons are equal, a bond breaks at the smaller
    /// of the two thresholds. Otherwise, the threshold of the bond depends on both thresholds and on both
    /// horizons.
    OfBodies,
    /// Bonds never break.
    Unbreakable,
    /// Bonds break by a separate damage law, which replaces the damage laws of the bodies.
    Own(Damage),
}

impl InterfaceDamage {
    /// Return the damage law of [`Self::Own`]; `None` for the other variants.
    pub fn own(&self) -> Option<&Damage> {
        match self {
            Self::Own(damage) => Some(damage),
            Self::OfBodies | Self::Unbreakable => None,
        }
    }
}

impl Interface {
    /// Return the entry of [`Self::pairs`] for two bodies, in any order; `None` if there is none.
    pub fn pair(&self, here: &Body, there: &Body) -> Option<&InterfacePair> {
        self.pairs.iter().find(|pair| {
            let [a, b] = &pair.bodies;
            (*a == here.name && *b == there.name) || (*a == there.name && *b == here.name)
        })
    }

    /// Return the rule of the bonds between two bodies. The rule does not depend on the order of the bodies.
    /// If both are the same body, the rule is [`InterfaceRule::Own`].
    pub fn between(&self, here: &Body, there: &Body) -> InterfaceRule {
        if here.name == there.name {
            return InterfaceRule::Own;
        }
        let own = self.pair(here, there);
        own.map_or(self.rule, |pair| pair.rule)
    }

    /// Return how the bonds between two bodies break. The result does not depend on the order of the bodies.
    /// If both are the same body, bonds break by the damage law of this body.
    pub fn damage_between(&self, here: &Body, there: &Body) -> &InterfaceDamage {
        let own = self.pair(here, there);
        own.map_or(&InterfaceDamage::OfBodies, |pair| &pair.damage)
    }
}

impl InterfacePair {
    /// Return the separate damage law of the pair; `None` if the pair has none.
    pub fn own_damage(&self) -> Option<&Damage> {
        self.damage.own()
    }

    /// Test whether the body is one of the pair.
    pub fn has(&self, body: &Body) -> bool {
        self.bodies.contains(&body.name)
    }
}

/// Rule for the elastic constants and the horizon of the bonds between two blocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InterfaceRule {
    /// No bonds join the blocks.
    None,
    /// The mean of the two Young's moduli, and the mean of the two horizons.
    Average,
    /// The smaller of the two Young's moduli, and the smaller of the two horizons.
    Minimum,
    /// Each end computes its half of the bond force with the constants of its own body.
    Own,
}

/// A damage law, which decides when bonds break.
#[derive(Debug, Clone, PartialEq)]
pub struct Damage {
    /// The quantity that decides whether a bond breaks.
    pub rule: DamageRule,
    /// The toughness, from which the threshold follows.
    pub toughness: Toughness,
    /// α in the threshold s0 − α s_min of the stretch. s0 is the critical stretch, and s_min the smallest
    /// stretch of the intact bonds of a point. With [`DamageRule::Energy`], the critical work is multiplied
    /// by ((s0 − α s_min)/s0)².
    pub alpha: f64,
    /// Scatter of the strength of the points; `None` without scatter.
    pub weibull: Option<Weibull>,
    /// Dependence of the fracture energy on the direction of the crack; `None` if the fracture energy is the
    /// same in all directions. Otherwise, `toughness` is the fracture energy of cracks along the axis a of
    /// [`ToughnessByDirection`].
    pub direction: Option<ToughnessByDirection>,
    /// Indices of the no-failure sets, whose bonds never break.
    pub no_failure: Vec<usize>,
}

/// The quantity that decides whether a bond breaks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DamageRule {
    /// The stretch of the bond.
    CriticalStretch,
    /// The work done on the bond.
    Energy {
        /// Derivation of the critical work from the toughness.
        calibration: Calibration,
        /// Rule for the work of a bond, in laws that are not bond-based.
        work: WorkRule,
    },
    /// The mean of the stress measures of the bond's ends. An end counts only if its force state acts on the
    /// bond and its point carries stress.
    Stress(StressRule),
}

/// Toughness, as one of four quantities.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Toughness {
    /// G0, J/m².
    FractureEnergy(f64),
    /// K_Ic, Pa·√m.
    FractureToughness(f64),
    /// Critical stretch s0, for laws with a critical stretch.
    CriticalStretch(f64),
    /// Strength, Pa, for damage by stress.
    Strength(f64),
}

/// Source of a body's points.
#[derive(Debug, Clone)]
pub enum PointSource {
    /// Points in the lattice cells whose centres lie within a shape, but not within the shape of a later
    /// body.
    Lattice {
        /// The region that the cells fill.
        shape: Shape,
        /// Edges of a cell, m.
        spacing: [f64; 3],
        /// Position of a corner of a cell, m.
        origin: [f64; 3],
        /// Positions of the points in a cell.
        quadrature: Quadrature,
    },
    /// Points from the rows of a file.
    File {
        /// Path, relative to the working directory or absolute.
        path: PathBuf,
        /// Block number of the rows that are used; `None` for all rows that belong to no other body.
        block: Option<u32>,
        /// Meaning of the columns; `None` if the deck does not name them.
        columns: Option<Columns>,
        /// Span of the file's name in the deck.
        span: Range<usize>,
    },
    /// Points from the elements of a mesh.
    Mesh {
        /// Path, relative to the working directory or absolute.
        path: PathBuf,
        /// Group of the elements; `None` for all elements that belong to no other body.
        block: Option<GroupKey>,
        /// Unit of length of the mesh, m.
        scale: f64,
        /// Span of the file's name in the deck.
        span: Range<usize>,
        /// Span of the group's name in the deck, or of the file's name if the deck names no group.
        block_span: Range<usize>,
    },
}

/// A region of space; lengths are in m.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A box, rectangle or interval between two corners.
    Box {
        /// Corner with the smallest coordinates.
        lower: [f64; 3],
        /// Corner with the largest coordinates.
        upper: [f64; 3],
    },
    /// A disc or ball.
    Ball {
        /// Position of the centre.
        centre: [f64; 3],
        /// Radius, m.
        radius: f64,
    },
    /// A cylinder, given by its radius and the centres of its ends.
    Cylinder {
        /// Centre of one end.
        from: [f64; 3],
        /// Centre of the other end.
        to: [f64; 3],
        /// Radius, m.
        radius: f64,
    },
    /// A polygon in the xy plane, extended between two values of z.
    Prism {
        /// The polygon of the cross-section.
        base: Polygon,
        /// Lower z; −∞ in 2-D.
        bottom: f64,
        /// Upper z; ∞ in 2-D.
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
    /// Name in the deck.
    pub name: String,
    /// Span in the deck.
    pub span: Range<usize>,
    /// Rule that selects the points.
    pub selector: Selector,
}

impl Set {
    /// Return the bodies that may have points in the set. `bodies` are all bodies of the problem.
    pub fn possible_bodies<'b>(&self, bodies: &'b [Body]) -> &'b [Body] {
        match self.selector {
            Selector::Body(index) => &bodies[index..=index],
            _ => bodies,
        }
    }
}

/// Rule that selects the points of a set.
#[derive(Debug, Clone)]
pub enum Selector {
    /// All points.
    All,
    /// The points of the body with this index.
    Body(usize),
    /// Points whose reference position fulfils the condition.
    Where(Expression),
    /// Points within a region.
    Within(Shape),
    /// Points with these global ids.
    Ids {
        /// Global ids, ascending.
        ids: Vec<u64>,
        /// The file that contains the ids; `None` if the deck contains them.
        file: Option<IdFile>,
        /// Span of the largest id. If a file contains the ids, span of the name of this file in the deck.
        largest: Range<usize>,
    },
    /// Points of a group of elements or nodes in the meshes.
    Mesh(MeshSet),
}

/// A file with the ids of points.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct IdFile {
    /// Path, relative to the working directory or absolute.
    pub path: PathBuf,
    /// Number that the file uses for the first point.
    pub first: u64,
}

/// The points of a group of elements or nodes in the meshes. The deck gives the name or number of the group.
/// The ids of the points are known once the points have been generated.
#[derive(Clone)]
pub struct MeshSet {
    /// Name or number of the group.
    pub group: GroupKey,
    /// Span in the deck.
    pub span: Range<usize>,
    ids: OnceLock<Runs>,
}

impl MeshSet {
    /// Create the set of a group. The deck names the group at `span`.
    pub fn new(group: GroupKey, span: Range<usize>) -> Self {
        Self {
            group,
            span,
            ids: OnceLock::new(),
        }
    }

    /// At the first call, store `ids`. Return whether `ids` are equal to the stored ids.
    pub fn resolve(&self, ids: Runs) -> bool {
        let ids = &ids;
        self.ids.get_or_init(|| ids.clone()) == ids
    }

    /// Test whether the point with an id is in the set; false before the points have been generated.
    pub fn contains(&self, id: u64) -> bool {
        self.ids.get().is_some_and(|ids| ids.contains(id))
    }
}

/// The debug output omits the ids, because they are not part of the problem's description.
impl fmt::Debug for MeshSet {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "MeshSet({:?})", self.group)
    }
}

/// A pre-crack: bonds that cross its surface start broken.
#[derive(Debug, Clone, PartialEq)]
pub struct PreCrack {
    /// Name in the deck.
    pub name: String,
    /// Span in the deck.
    pub span: Range<usize>,
    /// Surface of the pre-crack.
    pub surface: Crack,
}

/// A surface that cuts bonds; lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub enum Crack {
    /// A segment, in 2-D.
    Segment {
        /// Position of one end.
        from: [f64; 3],
        /// Position of the other end.
        to: [f64; 3],
        /// Width of the slot, half on each side of the segment; 0 for a cut without width.
        width: f64,
    },
    /// A parallelogram.
    Rectangle {
        /// Position of one corner.
        corner: [f64; 3],
        /// Vector along one edge, from the corner.
        edge_a: [f64; 3],
        /// Vector along the other edge, from the corner.
        edge_b: [f64; 3],
        /// Width of the slot, half on each side of the surface; 0 for a cut without width.
        width: f64,
    },
    /// A flat disc.
    Disc {
        /// Position of the centre.
        centre: [f64; 3],
        /// Unit normal.
        normal: [f64; 3],
        /// Radius, m.
        radius: f64,
        /// Width of the slot, half on each side of the surface; 0 for a cut without width.
        width: f64,
    },
}

impl Crack {
    /// Test whether the crack is a slot with a width.
    pub fn has_width(&self) -> bool {
        let (Self::Segment { width, .. }
        | Self::Rectangle { width, .. }
        | Self::Disc { width, .. }) = self;
        *width > 0.0
    }
}

impl DamageRule {
    /// Test whether the damage is calibrated with the separation energy ratio, and this ratio has not been
    /// computed yet.
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
