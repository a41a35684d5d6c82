//! Dimension of a problem and its out-of-plane conditions.

/// Dimension of a problem, with the out-of-plane measure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Dimension {
    /// A bar.
    Line {
        /// Cross-section, m².
        cross_section: f64,
        /// Condition perpendicular to the bar: no stress or no strain.
        constraint: Constraint,
    },
    /// A thin plate.
    PlaneStress {
        /// Thickness, m.
        thickness: f64,
    },
    /// A slice of a long body.
    PlaneStrain {
        /// Thickness of the slice, m.
        thickness: f64,
    },
    /// A solid.
    Space,
}

/// Condition perpendicular to a bar: no stress or no strain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Constraint {
    /// No stress perpendicular to the bar; the bar has the modulus E.
    UniaxialStress,
    /// No strain perpendicular to the bar; the bar has the modulus λ + 2G.
    UniaxialStrain,
}

impl Dimension {
    /// Return the number of dimensions: 1, 2 or 3.
    pub fn count(self) -> usize {
        match self {
            Self::Line { .. } => 1,
            Self::PlaneStress { .. } | Self::PlaneStrain { .. } => 2,
            Self::Space => 3,
        }
    }

    /// Return the factor that converts a length, area or volume to a volume: cross-section (m²), thickness
    /// (m) or 1.
    pub fn out_of_plane_measure(self) -> f64 {
        match self {
            Self::Line { cross_section, .. } => cross_section,
            Self::PlaneStress { thickness } | Self::PlaneStrain { thickness } => thickness,
            Self::Space => 1.0,
        }
    }

    /// Return the edge (m) of the line segment, square or cube that represents a `volume` (m³). `volume` is
    /// the length, area or volume of this shape, multiplied by [`Self::out_of_plane_measure`].
    pub fn edge(self, volume: f64) -> f64 {
        let extent = volume / self.out_of_plane_measure();
        libm::pow(extent, 1.0 / self.count() as f64)
    }

    /// Return Poisson's ratio of bond-based laws. If [`Self::allows_any_poisson_ratio`] is true, these
    /// laws also allow other values.
    pub fn bond_based_poisson_ratio(self) -> f64 {
        match self {
            Self::PlaneStress { .. } => 1.0 / 3.0,
            _ => 0.25,
        }
    }

    /// Test whether bond-based laws allow all Poisson's ratios. This is true only for a bar in uniaxial
    /// stress: its stiffness E does not depend on Poisson's ratio.
    pub fn allows_any_poisson_ratio(self) -> bool {
        matches!(
            self,
            Self::Line {
                constraint: Constraint::UniaxialStress,
                ..
            }
        )
    }

    /// Test whether the strain perpendicular to the plane or bar is 0.
    pub fn is_confined(self) -> bool {
        matches!(
            self,
            Self::PlaneStrain { .. }
                | Self::Line {
                    constraint: Constraint::UniaxialStrain,
                    ..
                }
        )
    }

    /// Return the name of the dimension, for messages. In 1-D and 2-D, the name contains the condition
    /// perpendicular to the bar or plane, as in `plane stress`.
    pub fn name(self) -> &'static str {
        use Constraint::{UniaxialStrain, UniaxialStress};
        match self {
            Self::Line { constraint, .. } => match constraint {
                UniaxialStress => "1-D under uniaxial stress",
                UniaxialStrain => "1-D under uniaxial strain",
            },
            Self::PlaneStress { .. } => "plane stress",
            Self::PlaneStrain { .. } => "plane strain",
            Self::Space => "3-D",
        }
    }

    /// Describe what is 0 in the directions across a bar: the stress or the strain. `None` in 2-D and 3-D.
    pub fn constraint(self) -> Option<&'static str> {
        match self {
            Self::Line { constraint, .. } => Some(match constraint {
                Constraint::UniaxialStress => {
                    "uniaxial stress: the bar contracts freely across, stiffness E"
                }
                Constraint::UniaxialStrain => {
                    "uniaxial strain: no strain across the bar, stiffness λ + 2G (1.2 E for ν = 1/4)"
                }
            }),
            _ => None,
        }
    }
}
