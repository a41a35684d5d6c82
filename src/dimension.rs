//! The settings that a problem can be posed in.

/// The setting of the problem, with what turns lengths and areas into volumes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Dimension {
    /// A bar.
    Line {
        /// m².
        cross_section: f64,
    },
    /// A thin plate.
    PlaneStress {
        /// m.
        thickness: f64,
    },
    /// A slice of a long body.
    PlaneStrain {
        /// m.
        thickness: f64,
    },
    /// A solid.
    Space,
}

impl Dimension {
    /// 1, 2 or 3.
    pub fn count(self) -> usize {
        match self {
            Self::Line { .. } => 1,
            Self::PlaneStress { .. } | Self::PlaneStrain { .. } => 2,
            Self::Space => 3,
        }
    }

    /// What a length, area or volume is multiplied by to be a volume: m², m or 1.
    pub fn section(self) -> f64 {
        match self {
            Self::Line { cross_section } => cross_section,
            Self::PlaneStress { thickness } | Self::PlaneStrain { thickness } => thickness,
            Self::Space => 1.0,
        }
    }

    /// The Poisson ratio that bond-based laws have.
    pub fn bond_based_poisson_ratio(self) -> f64 {
        match self {
            Self::PlaneStress { .. } => 1.0 / 3.0,
            _ => 0.25,
        }
    }

    /// For messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::Line { .. } => "1-D",
            Self::PlaneStress { .. } => "plane stress",
            Self::PlaneStrain { .. } => "plane strain",
            Self::Space => "3-D",
        }
    }
}
