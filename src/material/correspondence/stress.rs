//! First Piola–Kirchhoff stress and strain energy density from a deformation gradient.

use nalgebra::SMatrix;

use super::super::Given;
use super::family::determinant;
use super::hooke::Hooke;
use super::tensor::{Number, Tensor, contracted, matrix, rows, tensor};
use crate::dimension::Dimension;
use crate::lanes::{Lanes, WIDTH};

/// Law for the first Piola–Kirchhoff stress P and the strain energy density W.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stress {
    /// P = F S, S = C : E with E = ½ (FᵀF − I). This stress derives from an energy and is objective.
    StVenantKirchhoff(Hooke),
    /// P = J σ F⁻ᵀ with the Cauchy stress σ = C : E and J = det F (Willberg et al. 2022, eq. 9, which prints
    /// F⁻¹ instead of F⁻ᵀ). At small strains without rotation, this stress equals that of
    /// St. Venant–Kirchhoff. This stress law is not objective.
    Willberg2022(Hooke),
    /// W = ½ μ (tr C − 3 − ln det C) + ⅛ λ (ln det C)² with C = FᵀF. In plane stress, the out-of-plane
    /// stretch is the one at which the out-of-plane stress is 0.
    NeoHooke(NeoHooke),
}

/// The constants of the compressible neo-Hookean solid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NeoHooke {
    /// Lamé's first parameter λ, Pa.
    lambda: f64,
    /// Shear modulus μ, Pa.
    shear: f64,
    plane_stress: bool,
    /// Largest eigenvalue of Hooke's matrix of the undeformed solid, Pa.
    largest: f64,
}

/// Stresses and energies of eight bonds. The values of a bond follow from its displacement gradient.
#[derive(Debug, Clone, Copy)]
pub struct OfBonds<const D: usize> {
    /// P, Pa.
    pub piola: Tensor<Lanes, D>,
    /// W, J/m³.
    pub energy: Lanes,
    /// 1 for bonds at which the stress does not exist; their P and W are 0.
    pub missing: Lanes,
}

impl Stress {
    /// Create the stress law that has the name `name` in decks.
    pub fn of(name: &str, given: &Given, hooke: Hooke) -> Self {
        match name {
            "willberg2022" => Self::Willberg2022(hooke),
            "neo-hooke" => Self::NeoHooke(NeoHooke {
                lambda: given.elastic.lame_lambda(),
                shear: given.elastic.shear_modulus(),
                plane_stress: matches!(given.dimension, Dimension::PlaneStress { .. }),
                largest: hooke.largest(),
            }),
            _ => Self::StVenantKirchhoff(hooke),
        }
    }

    /// Displayed name of the stress law of bodies with plasticity.
    pub const OF_PLASTIC: &'static str = "St. Venant–Kirchhoff";

    /// Return the name for display.
    pub fn name(&self) -> &'static str {
        match self {
            Self::StVenantKirchhoff(_) => Self::OF_PLASTIC,
            Self::Willberg2022(_) => "C:E as Cauchy stress (Willberg et al. 2022)",
            Self::NeoHooke(_) => "neo-Hooke",
        }
    }

    /// Return the largest modulus c of the undeformed solid, Pa. For small displacement gradients H,
    /// W ≤ ½ c |H|².
    pub fn largest_modulus(&self) -> f64 {
        match self {
            Self::StVenantKirchhoff(hooke) | Self::Willberg2022(hooke) => hooke.largest(),
            Self::NeoHooke(law) => law.largest,
        }
    }

    /// Return P (Pa) and W (J/m³) at a displacement gradient H = F − I. Return `None` if the stress is not
    /// defined. This is the case for neo-Hooke at det F ≤ 0, and for Willberg et al. at det F = 0.
    pub fn at<const D: usize>(
        &self,
        gradient: &SMatrix<f64, D, D>,
    ) -> Option<(SMatrix<f64, D, D>, f64)> {
        let deformation = SMatrix::<f64, D, D>::identity() + gradient;
        match self {
            Self::StVenantKirchhoff(hooke) => {
                let (stress, energy) = st_venant_kirchhoff(hooke, &rows(gradient));
                Some((matrix(&stress), energy))
            }
            Self::Willberg2022(hooke) => {
                let strain = matrix(&green_strain(&rows(gradient)));
                let stress = matrix(&hooke.stress(&rows(&strain)));
                let inverse = deformation.try_inverse()?;
                let volume = determinant(&deformation);
                let piola = stress * inverse.transpose() * volume;
                Some((piola, 0.5 * stress.dot(&strain)))
            }
            Self::NeoHooke(law) => {
                if determinant(&deformation) <= 0.0 {
                    return None;
                }
                let inverse = deformation.try_inverse()?.transpose();
                let doubled = matrix(&green_strain(&rows(gradient))) * 2.0;
                let (log, energy) = law.in_plane(&doubled);
                // Identity: F − F⁻ᵀ = F⁻ᵀ (FᵀF − I).
                let shear = inverse * doubled * law.shear;
                Some((shear + inverse * (0.5 * law.lambda * log), energy))
            }
        }
    }

    /// Return the out-of-plane Kirchhoff stress (Pa) in plane strain; `None` if the elastic constants of the
    /// deck do not determine this stress.
    pub fn out_of_plane_stress<const D: usize>(
        &self,
        gradient: &SMatrix<f64, D, D>,
    ) -> Option<f64> {
        let strain = green_strain(&rows(gradient));
        let volume = determinant(&(SMatrix::identity() + gradient));
        match self {
            Self::StVenantKirchhoff(hooke) => hooke.out_of_plane(&strain),
            Self::Willberg2022(hooke) => Some(hooke.out_of_plane(&strain)? * volume),
            // The law has no stress for det F ≤ 0.
            Self::NeoHooke(_) if volume <= 0.0 => Some(0.0),
            Self::NeoHooke(law) => {
                let log = libm::log1p(growth(&(matrix(&strain) * 2.0)));
                Some(0.5 * law.lambda * log)
            }
        }
    }

    /// Same as [`Self::out_of_plane_stress`] for eight bonds; 0 where [`Self::out_of_plane_stress`] returns
    /// `None`.
    #[inline(never)]
    pub fn out_of_plane_stress_of_bonds<const D: usize>(
        &self,
        gradient: &Tensor<Lanes, D>,
    ) -> Lanes {
        Lanes(std::array::from_fn(|lane| {
            let own = SMatrix::<f64, D, D>::from_fn(|a, b| gradient[a][b].0[lane]);
            self.out_of_plane_stress(&own).unwrap_or(0.0)
        }))
    }

    /// Return the out-of-plane stretch F_zz in plane stress. `None` if the elastic constants of the deck do
    /// not determine F_zz, or if no positive F_zz exists.
    pub fn out_of_plane_stretch<const D: usize>(
        &self,
        gradient: &SMatrix<f64, D, D>,
    ) -> Option<f64> {
        let strain = green_strain(&rows(gradient));
        match self {
            Self::StVenantKirchhoff(hooke) => stretch_of(hooke.out_of_plane(&strain)?),
            // J of this law is the determinant of the in-plane F, so F_zz is 1.
            Self::Willberg2022(_) => Some(1.0),
            Self::NeoHooke(law) => {
                let growth = growth(&(matrix(&strain) * 2.0));
                (growth > -1.0)
                    .then(|| libm::exp(0.5 * law.log_square_stretch(libm::log1p(growth))))
            }
        }
    }

    /// Same as [`Self::at`] for eight bonds. The function is not inlined, so that its code is compiled once
    /// and not in every loop over bonds.
    #[inline(never)]
    pub fn of_bonds<const D: usize>(&self, gradient: &Tensor<Lanes, D>) -> OfBonds<D> {
        let none = Lanes::splat(0.0);
        if let Self::StVenantKirchhoff(hooke) = self {
            let (piola, energy) = st_venant_kirchhoff(hooke, gradient);
            return OfBonds {
                piola,
                energy,
                missing: none,
            };
        }
        let mut all = OfBonds {
            piola: [[none; D]; D],
            energy: none,
            missing: none,
        };
        for lane in 0..WIDTH {
            let own = SMatrix::from_fn(|a, b| gradient[a][b].0[lane]);
            let Some((piola, energy)) = self.at::<D>(&own) else {
                all.missing.0[lane] = 1.0;
                continue;
            };
            for a in 0..D {
                for b in 0..D {
                    all.piola[a][b].0[lane] = piola[(a, b)];
                }
            }
            all.energy.0[lane] = energy;
        }
        all
    }
}

/// Return the Green strain E = ½ (H + Hᵀ + HᵀH) for the displacement gradient H = F − I. This form avoids the
/// cancellation in ½ (FᵀF − I).
#[inline(always)]
pub fn green_strain<T: Number, const D: usize>(gradient: &Tensor<T, D>) -> Tensor<T, D> {
    tensor(|a, b| {
        let mut sum = gradient[a][b] + gradient[b][a];
        for row in gradient {
            sum = sum + row[a] * row[b];
        }
        sum * 0.5
    })
}

/// Return the stretch √(1 + 2E) along an axis with the Green strain E; `None` if 1 + 2E is not positive.
pub fn stretch_of(strain: f64) -> Option<f64> {
    let square = 1.0 + 2.0 * strain;
    (square > 0.0).then(|| square.sqrt())
}

/// Return P = F (C : E) and W = ½ E : C : E.
#[inline(always)]
fn st_venant_kirchhoff<T: Number, const D: usize>(
    hooke: &Hooke,
    gradient: &Tensor<T, D>,
) -> (Tensor<T, D>, T) {
    let strain = green_strain(gradient);
    let second = hooke.stress(&strain);
    let piola = tensor(|a, b| {
        let mut sum = second[a][b];
        for k in 0..D {
            sum = sum + gradient[a][k] * second[k][b];
        }
        sum
    });
    (piola, contracted(&second, &strain) * 0.5)
}

impl NeoHooke {
    /// Return ln det FᵀF and W (J/m³). `doubled` is FᵀF − I in 2-D or 3-D. The returned ln det FᵀF
    /// includes the out-of-plane stretch.
    fn in_plane<const D: usize>(&self, doubled: &SMatrix<f64, D, D>) -> (f64, f64) {
        let own = libm::log1p(growth(doubled));
        // `log_square` is the logarithm of the squared out-of-plane stretch.
        let log_square = if self.plane_stress && D == 2 {
            self.log_square_stretch(own)
        } else {
            0.0
        };
        let log = own + log_square;
        let trace = doubled.trace() + libm::expm1(log_square);
        let energy = 0.5 * self.shear * (trace - log) + 0.125 * self.lambda * log * log;
        (log, energy)
    }

    /// Return the logarithm q of the squared out-of-plane stretch in plane stress. `own` is ln det FᵀF of the
    /// in-plane F. Newton's method solves μ (e^q − 1) + ½ λ (own + q) = 0 for q.
    fn log_square_stretch(&self, own: f64) -> f64 {
        let mut q = -0.5 * self.lambda * own / (self.shear + 0.5 * self.lambda);
        for _ in 0..20 {
            let rest = self.shear * libm::expm1(q) + 0.5 * self.lambda * (own + q);
            let step = rest / (self.shear * libm::exp(q) + 0.5 * self.lambda);
            q -= step;
            if step.abs() <= 1e-15 * q.abs() {
                break;
            }
        }
        q
    }
}

/// Return det (I + M) − 1 without cancellation.
fn growth<const D: usize>(m: &SMatrix<f64, D, D>) -> f64 {
    match D {
        1 => m[(0, 0)],
        2 => m.trace() + determinant(m),
        _ => {
            let minor = |a: usize, b: usize| m[(a, a)] * m[(b, b)] - m[(a, b)] * m[(b, a)];
            m.trace() + (minor(0, 1) + minor(1, 2) + minor(0, 2)) + determinant(m)
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Matrix3};

    use super::*;
    use crate::elastic::Isotropic;
    use crate::material::Values;

    const ELASTIC: Isotropic = Isotropic {
        youngs_modulus: 3.0,
        poisson_ratio: 0.3,
    };

    fn all(dimension: Dimension) -> [Stress; 3] {
        let values = Values::defaults(super::super::KEYS);
        let given = Given {
            dimension,
            elastic: ELASTIC,
            horizon: 1.0,
            values: &values,
            from_fracture_energy: false,
        };
        let hooke = Hooke::of(&given).unwrap();
        ["st-venant-kirchhoff", "willberg2022", "neo-hooke"]
            .map(|name| Stress::of(name, &given, hooke))
    }

    /// Check that P is the derivative of W, by central differences.
    fn is_slope<const D: usize>(law: &Stress, gradient: SMatrix<f64, D, D>) {
        let (stress, _) = law.at(&gradient).unwrap();
        let step = 1e-5;
        for a in 0..D {
            for b in 0..D {
                let energy = |sign: f64| {
                    let mut moved = gradient;
                    moved[(a, b)] += sign * step;
                    law.at(&moved).unwrap().1
                };
                let slope = (energy(1.0) - energy(-1.0)) / (2.0 * step);
                let error = (slope - stress[(a, b)]).abs();
                assert!(error < 1e-8, "{law:?} {a}{b}: {slope} {}", stress[(a, b)]);
            }
        }
    }

    #[test]
    fn stress_is_the_slope_of_energy_where_there_is_one() {
        let plane = Matrix2::new(0.1, 0.2, -0.05, -0.15);
        let space = Matrix3::new(0.1, 0.2, -0.1, 0.05, -0.12, 0.3, 0.0, 0.15, 0.2);
        for dimension in [
            Dimension::PlaneStress { thickness: 1.0 },
            Dimension::PlaneStrain { thickness: 1.0 },
        ] {
            let [svk, _, neo] = all(dimension);
            is_slope(&svk, plane);
            is_slope(&neo, plane);
        }
        let [svk, _, neo] = all(Dimension::Space);
        is_slope(&svk, space);
        is_slope(&neo, space);
    }

    #[test]
    fn small_strains_have_hookes_stress_in_all_of_them() {
        let strain = Matrix3::new(1.0, 0.3, -0.2, 0.3, -0.5, 0.1, -0.2, 0.1, 0.7) * 1e-9;
        let (lambda, shear) = (ELASTIC.lame_lambda(), ELASTIC.shear_modulus());
        let wanted = Matrix3::identity() * (lambda * strain.trace()) + strain * (2.0 * shear);
        for law in all(Dimension::Space) {
            let (stress, _) = law.at(&strain).unwrap();
            let error = (stress - wanted).norm() / wanted.norm();
            assert!(error < 1e-8, "{law:?} {error}");
        }
    }
}
