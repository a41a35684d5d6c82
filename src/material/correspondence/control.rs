//! Control of zero-energy modes: forces against motions that do not change the deformation gradient.

use nalgebra::SMatrix;

use super::super::{Given, Influence, Key, Kind, LawFault, Pmb, Property, Values, Word};
use super::hooke::{self, Hooke};
use super::tensor::{matrix, rows};
use crate::dimension::Dimension;
use std::f64::consts::PI;

/// The zero-energy control: the matrix B of the force state ω B z, with the symbols of
/// `correspondence/mod.rs`.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is one per law, not one per point"
)]
pub enum Control {
    /// B = 0.
    None,
    /// B = (4/3) G/k I, with the shear modulus G and a diagonal entry k (m⁵) of the shape tensor of an
    /// untruncated family. Long shear waves then have no dispersion.
    ///
    /// Derivation: consider a wave along the axis x with the amplitude u, the wavenumber κ and the modulus M,
    /// which is G for shear waves. Let q = Σ ω ξ_x⁴ Ṽ. The displacement gradient H that is computed from the
    /// family is smaller than the exact gradient of the wave by the fraction κ²q/(6k). Therefore the energy
    /// density of the stress is ½ M κ² (1 − κ²q/(3k)) |u|². The part z of η is −½ (κ ξ_x)² u. Therefore a
    /// control B = (b/k) I with a modulus b has the energy density ½ b κ⁴q/(4k) |u|². For b = (4/3) M, the
    /// sum of the two energy densities is independent of q, for every dimension, influence function and
    /// lattice.
    Dispersion {
        /// Product (4/3) G/k, N/m⁷.
        strength: f64,
    },
    /// B = C : K⁻¹, B_ij = C_ijkl K⁻¹_kl (Wan, Chen, Chu & Chen 2019; Willberg et al. 2022, eq. 15). B has
    /// the stiffness and the anisotropy of the solid. The deck gives no coefficient for B.
    Wan2019(Hooke),
    /// B = G (c/δ) (V_δ/ω₀) I (Silling 2017). Here G is a coefficient, c the micromodulus of `pmb`, V_δ the
    /// volume of an untruncated family (m³), and ω₀ = Σ ω Ṽ (m³).
    Silling2017 {
        /// Coefficient G, dimensionless.
        coefficient: f64,
        /// Product G c V_δ/δ, N/m⁴.
        strength: f64,
    },
}

pub const KIND: Key = Key {
    name: "zero_energy",
    meaning: "control of zero-energy modes, the motions that do not change the deformation \
              gradient",
    kind: Kind::Word(&[
        Word::new("dispersion"),
        Word::new("wan2019"),
        Word::new("silling2017"),
        Word::new("none"),
    ]),
};

pub const COEFFICIENT: Key = Key {
    name: "zero_energy_coefficient",
    meaning: "G of \"silling2017\": force against a zero-energy mode, divided by that of a \
              bond-based solid",
    kind: Kind::Number {
        range: f64::MIN_POSITIVE..f64::INFINITY,
        words: "above 0",
        default: Some(1.0),
    },
};

/// Return an error if the control is `wan2019`, the constants are anisotropic, and C : I is not positive
/// definite; `None` otherwise.
pub fn fault(values: &Values, dimension: Dimension) -> Option<LawFault> {
    let least = hooke::least_under_dilation(values, dimension)?;
    (values.word(KIND.name) == "wan2019" && least <= 0.0).then(|| LawFault {
        key: Some(KIND.name),
        message: format!(
            "with \"wan2019\", the control of zero-energy modes would have a negative stiffness: the tensor C : I must \
             have only eigenvalues above 0, but for this solid it has the eigenvalue \
             {least:.4e} Pa; take \"dispersion\" or \"silling2017\""
        ),
    })
}

impl Control {
    /// Create the control of a law.
    pub fn of(given: &Given, hooke: Hooke) -> Self {
        match given.values.word(KIND.name) {
            "none" => Self::None,
            "wan2019" => Self::Wan2019(hooke),
            "dispersion" => {
                let (dimension, horizon) = (given.dimension, given.horizon);
                let trace = Influence::Constant.weighted_volume(dimension, horizon);
                let untruncated = trace / dimension.count() as f64;
                Self::Dispersion {
                    strength: 4.0 / 3.0 * hooke.shear_modulus(dimension) / untruncated,
                }
            }
            _ => {
                let coefficient = given.values.number(COEFFICIENT.name);
                let horizon = given.horizon;
                let ball = match given.dimension {
                    Dimension::Space => 4.0 / 3.0 * PI * horizon.powi(3),
                    Dimension::PlaneStress { thickness } | Dimension::PlaneStrain { thickness } => {
                        PI * horizon.powi(2) * thickness
                    }
                    Dimension::Line { cross_section, .. } => 2.0 * horizon * cross_section,
                };
                Self::Silling2017 {
                    coefficient,
                    strength: coefficient * Pmb::of(given).micromodulus * ball / horizon,
                }
            }
        }
    }

    /// Return the constant that [`Self::matrix`] needs for a point, N/m⁷. `weight` is ω₀ (m³) of the initial
    /// family of the point. For `none` and `wan2019`, which do not use the constant, the constant is 0. For
    /// `silling2017`, the constant is 0 if ω₀ = 0.
    pub fn constant(&self, weight: f64) -> f64 {
        match self {
            Self::Silling2017 { strength, .. } if weight > 0.0 => strength / weight,
            Self::Dispersion { strength } => *strength,
            _ => 0.0,
        }
    }

    /// Return B (N/m⁷) of a point from K⁻¹ (m⁻⁵) and [`Self::constant`] of the point.
    pub fn matrix<const D: usize>(
        &self,
        inverse: &SMatrix<f64, D, D>,
        constant: f64,
    ) -> SMatrix<f64, D, D> {
        match self {
            Self::None => SMatrix::zeros(),
            Self::Wan2019(hooke) => matrix(&hooke.stress(&rows(inverse))),
            Self::Dispersion { .. } | Self::Silling2017 { .. } => {
                SMatrix::from_diagonal_element(constant)
            }
        }
    }

    /// Return the properties for display.
    pub fn described(&self) -> Vec<(&'static str, Property)> {
        let (words, number) = match *self {
            Self::None => ("none", None),
            Self::Dispersion { strength } => {
                let strength = ("zero-energy stiffness", Property::Number(strength, "N/m⁷"));
                ("long shear waves without dispersion", Some(strength))
            }
            Self::Wan2019(_) => ("as stiff as the solid (Wan et al. 2019)", None),
            Self::Silling2017 { coefficient, .. } => {
                let coefficient = ("zero-energy coefficient", Property::Number(coefficient, ""));
                ("Silling 2017", Some(coefficient))
            }
        };
        let words = ("zero energy", Property::Text(words));
        [words].into_iter().chain(number).collect()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Matrix3};

    use super::*;
    use crate::elastic::Isotropic;

    const YOUNG: f64 = 3.0;

    /// Return the control of a law whose keys have these values.
    fn control(
        dimension: Dimension,
        poisson_ratio: f64,
        kind: &str,
        more: &[(&str, f64)],
    ) -> Control {
        let mut values = Values::defaults(super::super::KEYS);
        values.set(KIND.name, super::super::super::Value::Word(kind.to_owned()));
        for (key, number) in more {
            values.set(key, (*number).into());
        }
        let elastic = Isotropic {
            youngs_modulus: YOUNG,
            poisson_ratio,
        };
        let given = Given {
            dimension,
            elastic,
            horizon: 2.0,
            values: &values,
            from_fracture_energy: false,
        };
        Control::of(&given, Hooke::of(&given).unwrap())
    }

    const PLANES: [Dimension; 2] = [
        Dimension::PlaneStress { thickness: 0.5 },
        Dimension::PlaneStrain { thickness: 0.5 },
    ];

    /// Return Lamé's λ and G, Pa. In plane stress, λ is that of a thin sheet, 2Gν/(1 − ν), with ν = `ratio`.
    fn constants(dimension: Dimension, ratio: f64) -> [f64; 2] {
        let shear = YOUNG / (2.0 * (1.0 + ratio));
        let across = match dimension {
            Dimension::PlaneStress { .. } => 1.0 - ratio,
            _ => 1.0 - 2.0 * ratio,
        };
        [2.0 * shear * ratio / across, shear]
    }

    #[test]
    fn that_of_wan_is_the_stress_of_the_inverse_shape_tensor() {
        let space = Matrix3::new(3.0, 0.4, -0.2, 0.4, 2.0, 0.5, -0.2, 0.5, 4.0);
        let plane = Matrix2::new(3.0, 0.4, 0.4, 2.0);
        for ratio in [-0.3, 0.0, 0.25, 1.0 / 3.0, 0.4] {
            let of = |dimension| control(dimension, ratio, "wan2019", &[]);
            let [lambda, shear] = constants(Dimension::Space, ratio);
            let wanted = Matrix3::identity() * (lambda * space.trace()) + space * (2.0 * shear);
            let found = of(Dimension::Space).matrix(&space, 0.0);
            assert!((found - wanted).norm() < 1e-14 * wanted.norm(), "{ratio}");
            for dimension in PLANES {
                let [lambda, shear] = constants(dimension, ratio);
                let wanted = Matrix2::identity() * (lambda * plane.trace()) + plane * (2.0 * shear);
                let found = of(dimension).matrix(&plane, 0.0);
                assert!((found - wanted).norm() < 1e-14 * wanted.norm(), "{ratio}");
            }
            // C_ijkl K⁻¹_jl for K = I is (λ + 4 G) I. This equals B of the control, (3 λ + 2 G) I, only if
            // λ = G.
            let other = lambda + 4.0 * shear;
            let found = of(Dimension::Space).matrix(&Matrix3::identity(), 0.0)[(0, 0)];
            let are_equal = (found / other - 1.0).abs() < 1e-14;
            assert_eq!(are_equal, ratio == 0.25, "{ratio}: {found} {other}");
        }
    }

    #[test]
    fn that_of_wan_contracts_an_anisotropic_solid_with_the_shape_tensor() {
        let entries = [
            ("c11", 9.0),
            ("c12", 3.0),
            ("c13", 2.0),
            ("c16", 0.3),
            ("c22", 8.0),
            ("c23", 2.5),
            ("c24", 0.1),
            ("c33", 7.0),
            ("c35", 0.2),
            ("c44", 2.0),
            ("c45", 0.1),
            ("c55", 3.0),
            ("c66", 2.5),
        ];
        let entry = |a: usize, b: usize| {
            let name = format!("c{}{}", a.min(b) + 1, a.max(b) + 1);
            let found = entries.iter().find(|(key, _)| *key == name);
            found.map_or(0.0, |(_, number)| *number)
        };
        let voigt = |a: usize, b: usize| if a == b { a } else { 6 - a - b };
        let inverse = Matrix3::new(3.0, 0.4, -0.2, 0.4, 2.0, 0.5, -0.2, 0.5, 4.0);
        let wanted = Matrix3::from_fn(|i, j| {
            let pairs = (0..3).flat_map(|k| (0..3).map(move |l| (k, l)));
            pairs
                .map(|(k, l)| entry(voigt(i, j), voigt(k, l)) * inverse[(k, l)])
                .sum()
        });
        let found = control(Dimension::Space, 0.25, "wan2019", &entries).matrix(&inverse, 0.0);
        assert!(
            (found - wanted).norm() < 1e-14 * wanted.norm(),
            "{found} {wanted}"
        );
    }

    #[test]
    fn that_without_dispersion_has_four_thirds_of_the_shear_modulus() {
        let horizon = 2.0_f64;
        for ratio in [-0.3, 0.25, 0.4] {
            let of = |dimension| control(dimension, ratio, "dispersion", &[]).constant(1.0);
            let close = |found: f64, wanted: f64| {
                assert!(
                    (found / wanted - 1.0).abs() < 1e-11,
                    "{ratio}: {found} {wanted}"
                );
            };
            let shear = YOUNG / (2.0 * (1.0 + ratio));
            let space = 4.0 * PI / 15.0 * horizon.powi(5);
            close(of(Dimension::Space), 4.0 / 3.0 * shear / space);
            for dimension in PLANES {
                let plane = 0.5 * PI / 4.0 * horizon.powi(4);
                close(of(dimension), 4.0 / 3.0 * shear / plane);
            }
        }
    }

    #[test]
    fn that_without_dispersion_follows_the_softest_shears_of_an_orthotropic_solid() {
        let fibres = [
            ("youngs_modulus_x", 140.0),
            ("youngs_modulus_y", 10.0),
            ("youngs_modulus_z", 10.0),
            ("poisson_ratio_xy", 0.3),
            ("poisson_ratio_yz", 0.4),
            ("poisson_ratio_xz", 0.3),
            ("shear_modulus_xy", 5.0),
            ("shear_modulus_yz", 3.5),
            ("shear_modulus_xz", 5.0),
        ];
        let of = |more: &[(&'static str, f64)]| {
            let all = [&fibres[..], more].concat();
            control(Dimension::Space, 0.25, "dispersion", &all).constant(1.0)
        };
        let space = 4.0 * PI / 15.0 * 2.0_f64.powi(5);
        // Reuss shear modulus: 15/(4 (S11 + S22 + S33 − S12 − S23 − S13) + 3 (S44 + S55 + S66)).
        let normal = 1.0 / 140.0 + 2.0 / 10.0;
        let coupled = -2.0 * 0.3 / 140.0 - 0.4 / 10.0;
        let shear = 15.0 / (4.0 * (normal - coupled) + 3.0 * (2.0 / 5.0 + 1.0 / 3.5));
        let wanted = 4.0 / 3.0 * shear / space;
        assert!((of(&[]) / wanted - 1.0).abs() < 1e-11);
        // The result is independent of the material axes.
        let turned = of(&[("angle_1", 20.0), ("angle_2", 50.0), ("angle_3", -70.0)]);
        assert!((turned / wanted - 1.0).abs() < 1e-11);
    }
}
