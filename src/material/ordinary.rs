//! Ordinary state-based linear peridynamic solid: any Poisson ratio.
//!
//! Silling, Epton, Weckner, Xu & Askari 2007; the plane forms after Le, Chan & Schwartz 2014. With the
//! weighted volume m = Σ ω|ξ|²Ṽ, the extension ε = |Y| − |ξ|, the dilatation θ = (d/m) Σ ω|ξ|εṼ and
//! its deviatoric part ε_d = ε − θ|ξ|/d,
//!
//! t = (d k′θ/m) ω|ξ| + (A/m) ω ε_d,  W = ½ k′θ² + ½ (A/m) Σ ω ε_d² Ṽ.
//!
//! | setting | k′ | A |
//! |---|---|---|
//! | 3-D | K | 15G |
//! | plane strain | K + G/3 | 8G |
//! | plane stress | E/(2(1−ν)) | 8G |
//!
//! Written with κ = k′ − A/d² this is t = (d κ θ/m) ω|ξ| + (A/m) ω ε and
//! W = ½ κθ² + ½ (A/m) Σ ω ε² Ṽ, of which t is the derivative with bonds broken as well: m is that of
//! the whole family, θ sums over intact bonds.

use super::{Bond, End, Lanes, Law};
use crate::dimension::Dimension;
use crate::elastic::Isotropic;

/// The law with its constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ordinary {
    /// d.
    dimension: f64,
    /// κ = k′ − A/d², Pa.
    volumetric: f64,
    /// A, Pa.
    extensional: f64,
}

impl Ordinary {
    /// From the elastic constants; `None` in 1-D, where the Poisson ratio has no meaning.
    pub fn new(dimension: Dimension, elastic: Isotropic) -> Option<Self> {
        let (modulus, shear) = (bulk_modulus(dimension, elastic)?, elastic.shear_modulus());
        let (count, extensional) = match dimension {
            Dimension::Space => (3.0, 15.0 * shear),
            _ => (2.0, 8.0 * shear),
        };
        Some(Self {
            dimension: count,
            volumetric: modulus - extensional / (count * count),
            extensional,
        })
    }

    /// d.
    pub fn dimension(&self) -> f64 {
        self.dimension
    }

    /// κ, Pa.
    pub fn volumetric(&self) -> f64 {
        self.volumetric
    }

    /// A, Pa.
    pub fn extensional(&self) -> f64 {
        self.extensional
    }

    /// θ from Σ ω|ξ|εṼ over the intact bonds and 1/m.
    #[inline(always)]
    fn dilatation(&self, sum: f64, constant: f64) -> f64 {
        self.dimension * sum * constant
    }
}

/// k′ (Pa): ½ k′ θ² is the energy density of an isotropic expansion θ in the setting's dimensions.
fn bulk_modulus(dimension: Dimension, elastic: Isotropic) -> Option<f64> {
    match dimension {
        Dimension::Line { .. } => None,
        Dimension::PlaneStress { .. } => {
            Some(elastic.youngs_modulus / (2.0 * (1.0 - elastic.poisson_ratio)))
        }
        Dimension::PlaneStrain { .. } => {
            Some(elastic.bulk_modulus() + elastic.shear_modulus() / 3.0)
        }
        Dimension::Space => Some(elastic.bulk_modulus()),
    }
}

impl Law for Ordinary {
    const CONSTANT: bool = true;
    const STATE: bool = true;

    #[inline(always)]
    fn constant_share(&self, length: Lanes) -> Lanes {
        length * length
    }

    /// 1/m, 1/m⁵.
    #[inline(always)]
    fn constant(&self, sum: f64) -> f64 {
        if sum > 0.0 { 1.0 / sum } else { 0.0 }
    }

    #[inline(always)]
    fn state_share(&self, bond: &Bond) -> Lanes {
        bond.length * bond.length * bond.stretch
    }

    /// d κ θ/m, N/m⁷.
    #[inline(always)]
    fn state(&self, sum: f64, constant: f64) -> f64 {
        self.dimension * self.volumetric * self.dilatation(sum, constant) * constant
    }

    #[inline(always)]
    fn force(&self, bond: &Bond, end: &End) -> Lanes {
        bond.length * (end.state + bond.stretch * end.constant * self.extensional)
    }

    #[inline(always)]
    fn bond_energy(&self, bond: &Bond, end: &End) -> Lanes {
        let extension = bond.length * bond.stretch;
        extension * extension * end.constant * (0.5 * self.extensional)
    }

    #[inline(always)]
    fn point_energy(&self, sum: f64, constant: f64) -> f64 {
        0.5 * self.volumetric * self.dilatation(sum, constant).powi(2)
    }

    /// θ² ≤ (d²/m) Σ ω ε² Ṽ (Cauchy–Schwarz), so (A + max(κ, 0) d²)/m serves.
    #[inline(always)]
    fn stiffness(&self, _: Lanes, end: &End) -> Lanes {
        let square = self.dimension * self.dimension;
        end.constant * (self.extensional + square * self.volumetric.max(0.0))
    }
}
