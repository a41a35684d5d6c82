//! J2 plasticity at large strains, with the logarithmic elastic strain of each point's family.
//!
//! The deformation gradient is the product of an elastic and a plastic part, F = F_e F_p. The stored state of
//! a point is C_p⁻¹ − I with C_p = F_pᵀ F_p. This state and F determine b_e = F_e F_eᵀ = F C_p⁻¹ Fᵀ.
//! Let b_a be the eigenvalues and n_a the eigenvectors of b_e. The logarithmic strains ε_a, the Kirchhoff
//! stress τ, P and the elastic energy density W are (Simo 1992):
//!
//! ε_a = ½ ln b_a, τ = Σ τ_a n_a⊗n_a, τ_a = λ (ε_1 + ε_2 + ε_3) + 2G ε_a, P = τ F⁻ᵀ, W = ½ Σ τ_a ε_a.
//!
//! The flow rule is that of small strains, applied to ε_a and τ_a. It changes ε_a and keeps n_a.
//! After the flow, b_e is Σ exp(2 ε_a) n_a⊗n_a with the new ε_a. A rigid rotation only rotates b_e, so no
//! stress rate needs integration. Flow preserves volume: det C_p is 1.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::super::PlasticState;
use super::family::determinant;
use super::plastic::{Plastic, tensor_of};

/// Largest number of sweeps of Jacobi's method; about six are needed.
const MOST_SWEEPS: usize = 30;

/// Jacobi's method has converged if m ≤ `CONVERGED` · a. Here m is the sum of the squares of the three mixed
/// entries, and a is the sum of the squares of all nine entries.
const CONVERGED: f64 = 1e-32;

/// Largest difference of det C_p⁻¹ from 1 that counts as round-off. In a metal, this difference corresponds
/// to a pressure below 100 Pa.
const ROUND_OFF: f64 = 1e-9;

/// Elastic trial state of a point, before any flow.
struct Trial {
    /// Inverse deformation gradient F⁻¹.
    inverse: Matrix3<f64>,
    /// Eigenvalues b_a.
    squares: Vector3<f64>,
    /// Eigenvectors n_a, by columns.
    axes: Matrix3<f64>,
    /// Logarithmic strains ε_a.
    strains: Vector3<f64>,
}

impl Trial {
    /// Compute the trial state; `None` if det F ≤ 0 or b_e is not positive definite.
    fn of<const D: usize>(gradient: &SMatrix<f64, D, D>, state: &PlasticState) -> Option<Self> {
        let mut h = Matrix3::zeros();
        h.view_mut((0, 0), (D, D)).copy_from(gradient);
        let deformation = Matrix3::identity() + h;
        if determinant(&deformation) <= 0.0 {
            return None;
        }
        let inverse = deformation.try_inverse()?;
        // b_e − I, without cancellation at small strains.
        let plastic = deformation * tensor_of(&state.strain) * deformation.transpose();
        let (over_one, axes) = eigen(h + h.transpose() + h * h.transpose() + plastic);
        if over_one.min() <= -1.0 {
            return None;
        }
        Some(Self {
            inverse,
            squares: over_one.map(|square| 1.0 + square),
            axes,
            strains: over_one.map(|square| 0.5 * libm::log1p(square)),
        })
    }

    /// Return the tensor Σ t_a n_a⊗n_a. `entries` are the eigenvalues t_a.
    fn tensor(&self, entries: &Vector3<f64>) -> Matrix3<f64> {
        self.axes * Matrix3::from_diagonal(entries) * self.axes.transpose()
    }
}

/// Return P (Pa) and the elastic energy density (J/m³) at a displacement gradient, and update the plastic
/// state. `step` is the length of the time step (s), 0 if no time passes. `None` if det F ≤ 0 or b_e is not
/// positive definite.
pub fn at<const D: usize>(
    law: &Plastic,
    gradient: &SMatrix<f64, D, D>,
    state: &mut PlasticState,
    step: f64,
) -> Option<(SMatrix<f64, D, D>, f64)> {
    let mut trial = Trial::of(gradient, state)?;
    let stress = law.stress(&Matrix3::from_diagonal(&trial.strains));
    let flow = law.flow(&stress, state, step);
    if let Some(flow) = flow {
        let change = flow.diagonal().map(|flow| libm::expm1(-2.0 * flow));
        let change = trial.tensor(&change.component_mul(&trial.squares));
        let change = trial.inverse * change * trial.inverse.transpose();
        add(&mut state.strain, &change);
        // The stress is computed again from the stored state, so that a restart computes the same bits.
        trial = Trial::of(gradient, state)?;
    }
    let strains = trial.strains;
    let stress = law.stress(&Matrix3::from_diagonal(&strains)).diagonal();
    let piola = trial.tensor(&stress) * trial.inverse.transpose();
    let piola = piola.fixed_view::<D, D>(0, 0).into_owned();
    Some((piola, 0.5 * stress.dot(&strains)))
}

/// Return the out-of-plane Kirchhoff stress in plane strain, Pa; `None` if det F ≤ 0 or b_e is not positive
/// definite.
pub fn out_of_plane_stress<const D: usize>(
    law: &Plastic,
    gradient: &SMatrix<f64, D, D>,
    state: &PlasticState,
) -> Option<f64> {
    let trial = Trial::of(gradient, state)?;
    let stress = law.stress(&Matrix3::from_diagonal(&trial.strains));
    Some(trial.tensor(&stress.diagonal())[(2, 2)])
}

/// Divide C_p⁻¹ by the cube root of its determinant. Plastic flow preserves volume, so the determinant of
/// each C_p⁻¹ is 1. The determinant of a mean of different C_p⁻¹ is generally not 1. `entries` are those of
/// C_p⁻¹ − I. If the determinant is 1 up to round-off, they do not change.
pub fn restore_volume(entries: &mut [f64; 6]) {
    let one = Matrix3::identity();
    let inverse = one + tensor_of(entries);
    let determinant = determinant(&inverse);
    if (determinant - 1.0).abs() > ROUND_OFF {
        let restored = inverse / libm::cbrt(determinant) - one;
        *entries = [0.0; 6];
        add(entries, &restored);
    }
}

/// Add a symmetric tensor to the entries xx, yy, zz, yz, xz, xy of another tensor.
pub fn add(entries: &mut [f64; 6], change: &Matrix3<f64>) {
    let places = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)];
    for (entry, place) in entries.iter_mut().zip(places) {
        *entry += change[place];
    }
}

/// Return the eigenvalues of a symmetric matrix, in no particular order.
pub fn eigenvalues(m: &Matrix3<f64>) -> Vector3<f64> {
    eigen(*m).0
}

/// Return the eigenvalues of a symmetric matrix, and a matrix whose columns are the eigenvectors. Jacobi's
/// method uses additions, multiplications, divisions and square roots only. The results are therefore bitwise
/// equal on every machine.
fn eigen(mut m: Matrix3<f64>) -> (Vector3<f64>, Matrix3<f64>) {
    let mut axes = Matrix3::identity();
    for _ in 0..MOST_SWEEPS {
        let off = m[(0, 1)].powi(2) + m[(0, 2)].powi(2) + m[(1, 2)].powi(2);
        if off <= CONVERGED * m.norm_squared() {
            break;
        }
        for (p, q, r) in [(0, 1, 2), (0, 2, 1), (1, 2, 0)] {
            if m[(p, q)] == 0.0 {
                continue;
            }
            let cotangent = (m[(q, q)] - m[(p, p)]) / (2.0 * m[(p, q)]);
            let size = 1.0 / (cotangent.abs() + (cotangent * cotangent + 1.0).sqrt());
            let tangent = if cotangent < 0.0 { -size } else { size };
            let cosine = 1.0 / (tangent * tangent + 1.0).sqrt();
            let sine = tangent * cosine;
            m[(p, p)] -= tangent * m[(p, q)];
            m[(q, q)] += tangent * m[(p, q)];
            m[(p, q)] = 0.0;
            m[(q, p)] = 0.0;
            let (of_p, of_q) = (m[(r, p)], m[(r, q)]);
            m[(r, p)] = cosine * of_p - sine * of_q;
            m[(r, q)] = sine * of_p + cosine * of_q;
            m[(p, r)] = m[(r, p)];
            m[(q, r)] = m[(r, q)];
            let (of_p, of_q) = (axes.column(p).into_owned(), axes.column(q).into_owned());
            axes.set_column(p, &(of_p * cosine - of_q * sine));
            axes.set_column(q, &(of_p * sine + of_q * cosine));
        }
    }
    (m.diagonal(), axes)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Rotation3};

    use super::super::super::{Given, Values};
    use super::super::{KEYS, hooke, plastic};
    use super::*;
    use crate::dimension::Dimension;
    use crate::elastic::Isotropic;

    const YOUNG: f64 = 3.0;
    const RATIO: f64 = 0.3;
    const YIELD: f64 = 0.01;
    const HARDENING: f64 = 0.3;

    fn law(dimension: Dimension, measure: &'static str) -> Plastic {
        let mut values = Values::defaults(KEYS);
        values.set(plastic::YIELD_STRESS.name, YIELD.into());
        values.set(plastic::HARDENING.name, HARDENING.into());
        values.set(plastic::STRAIN_MEASURE.name, measure.into());
        let given = Given {
            dimension,
            elastic: Isotropic {
                youngs_modulus: YOUNG,
                poisson_ratio: RATIO,
            },
            horizon: 1.0,
            values: &values,
            from_fracture_energy: false,
        };
        assert!(hooke::fault(&values, dimension).is_none());
        Plastic::of(&given).unwrap()
    }

    fn in_space() -> Plastic {
        law(Dimension::Space, "logarithmic")
    }

    /// Return P, W and the Kirchhoff stress τ = P Fᵀ.
    fn stress(
        law: &Plastic,
        deformation: &Matrix3<f64>,
        state: &mut PlasticState,
    ) -> (Matrix3<f64>, f64, Matrix3<f64>) {
        let (piola, energy) = law
            .at(&(deformation - Matrix3::identity()), state, 0.0)
            .expect("F is positive");
        (piola, energy, piola * deformation.transpose())
    }

    #[test]
    fn eigenvectors_make_up_the_matrix() {
        for m in [
            Matrix3::new(2.0, -0.3, 0.7, -0.3, 1.0, 0.2, 0.7, 0.2, -5.0),
            Matrix3::new(1e-9, 1e-9, 0.0, 1e-9, 1e-9, 0.0, 0.0, 0.0, 3e-9),
            Matrix3::from_diagonal_element(4.0),
            Matrix3::zeros(),
        ] {
            let (values, axes) = eigen(m);
            let again = axes * Matrix3::from_diagonal(&values) * axes.transpose();
            assert!((again - m).amax() <= 1e-15 * m.amax(), "{again}");
            let unit = axes.transpose() * axes;
            assert!((unit - Matrix3::identity()).amax() < 1e-14);
        }
    }

    #[test]
    fn a_bar_pulled_to_three_times_its_length_and_pushed_back_follows_its_logarithmic_strain() {
        let law = in_space();
        let mut state = PlasticState::default();
        let (mut plastic, mut flowed, mut across, mut work) = (0.0, 0.0, 1.0_f64, 0.0);
        for step in 0..200 {
            let along: f64 = match step {
                0..100 => 3_f64.powf((f64::from(step) + 1.0) / 100.0),
                _ => 3_f64.powf(2.0 - (f64::from(step) + 1.0) / 100.0),
            };
            // Reference solution in one dimension: the stress as a function of the logarithm of the stretch
            // `along`.
            let trial = YOUNG * (along.ln() - plastic);
            let limit = YIELD + HARDENING * flowed;
            let growth = ((trial.abs() - limit) / (YOUNG + HARDENING)).max(0.0);
            work += (limit + 0.5 * HARDENING * growth) * growth;
            flowed += growth;
            plastic += growth * trial.signum();
            let wanted = YOUNG * (along.ln() - plastic);
            // Find the transverse stretch at which the transverse stress is 0, in damped steps.
            let deformation =
                |across: f64| Matrix3::from_diagonal(&Vector3::new(along, across, across));
            for _ in 0..200 {
                let (_, _, tau) = stress(&law, &deformation(across), &mut state.clone());
                across *= (-0.3 * tau[(1, 1)] / YOUNG).exp();
            }
            let (_, _, tau) = stress(&law, &deformation(across), &mut state);
            assert!((tau[(0, 0)] - wanted).abs() < 1e-9 * wanted.abs(), "{step}");
            assert!((state.equivalent - flowed).abs() < 1e-9, "{step}");
            assert!((state.work - work).abs() < 1e-9, "{step}");
        }
        assert!(flowed > 1.5, "{flowed}");
        // Flow preserves volume.
        let volume = (Matrix3::identity() + tensor_of(&state.strain)).determinant();
        assert!((volume - 1.0).abs() < 1e-12, "{volume}");
    }

    #[test]
    fn a_body_that_turns_while_it_flows_has_the_same_stress_turned() {
        let law = in_space();
        let [mut fixed, mut turned] = [PlasticState::default(); 2];
        for step in 1..=60 {
            let t = f64::from(step) / 60.0;
            let deformation = Matrix3::new(
                1.0 + 0.4 * t,
                2.0 * t,
                0.0,
                0.1 * t * t,
                1.0 - 0.2 * t,
                0.3 * t,
                0.0,
                0.0,
                1.0,
            );
            let turn = Rotation3::new(Vector3::new(2.0, -3.0, 4.0) * t).into_inner();
            let (_, energy, tau) = stress(&law, &deformation, &mut fixed);
            let (_, again, other) = stress(&law, &(turn * deformation), &mut turned);
            assert!((turn * tau * turn.transpose() - other).amax() < 1e-12);
            assert!((energy - again).abs() < 1e-12);
            for (a, b) in fixed.numbers().into_iter().zip(turned.numbers()) {
                assert!((a - b).abs() < 1e-10, "{a} {b}");
            }
        }
        assert!(fixed.equivalent > 1.0);
    }

    #[test]
    fn work_becomes_elastic_energy_and_heat() {
        // Tension, shear and rotation, with strains above 1.
        let error = |steps: i32| {
            let law = in_space();
            let mut state = PlasticState::default();
            let at = |t: f64| {
                let turn = Rotation3::new(Vector3::new(0.5, 1.0, -1.0) * t).into_inner();
                turn * Matrix3::new(
                    1.0 + 0.8 * t,
                    1.5 * t * t,
                    0.0,
                    0.0,
                    1.0 - 0.3 * t,
                    0.4 * t,
                    0.2 * t,
                    0.0,
                    1.0,
                )
            };
            let (mut work, mut before) = (0.0, Matrix3::zeros());
            let mut last = 0.0;
            for step in 1..=steps {
                let (a, b) = (f64::from(step - 1), f64::from(step));
                let (from, to) = (at(a / f64::from(steps)), at(b / f64::from(steps)));
                let (piola, energy, _) = stress(&law, &to, &mut state);
                work += 0.5 * (before + piola).dot(&(to - from));
                before = piola;
                last = energy;
            }
            assert!(state.equivalent > 0.5);
            (work - last - state.work).abs() / work
        };
        let [coarse, fine] = [100, 400].map(error);
        assert!(fine < 1e-3 && fine < 0.3 * coarse, "{coarse} {fine}");
    }

    #[test]
    fn below_the_yield_stress_the_stress_is_the_slope_of_the_energy() {
        let law = in_space();
        let base = Matrix3::new(1.0004, 0.3, -0.2, -0.3, 1.0, 0.1, 0.2, -0.1, 0.9995);
        let turn = Rotation3::new(Vector3::new(-0.1, -0.2, -0.3)).into_inner();
        // Nearly a rotation, so that the point does not yield.
        let svd = base.svd(true, true);
        let small = svd.singular_values.map(|s| 1.0 + 1e-3 * (s - 1.0));
        let deformation = turn * svd.u.unwrap() * Matrix3::from_diagonal(&small) * svd.v_t.unwrap();
        let mut state = PlasticState::default();
        let (piola, _, _) = stress(&law, &deformation, &mut state);
        let size = 1e-6;
        for place in 0..9 {
            let energy = |sign: f64| {
                let mut moved = deformation;
                moved[place] += sign * size;
                stress(&law, &moved, &mut state.clone()).1
            };
            let slope = (energy(1.0) - energy(-1.0)) / (2.0 * size);
            assert!(
                (slope - piola[place]).abs() < 1e-6 * piola.amax(),
                "{slope}"
            );
        }
        assert_eq!(state, PlasticState::default());
    }

    #[test]
    fn at_small_strains_it_is_the_law_of_small_strains() {
        let dimension = Dimension::PlaneStrain { thickness: 1.0 };
        // Error as a fraction of the stress, divided by the size of the strain. The two strain measures
        // differ by about ε², and the pressures by about K ε², whereas the yield stress limits the deviator.
        // The error as a fraction of the stress is therefore at most of the order K ε²/σ_y.
        let error = |size: f64| {
            let laws = ["logarithmic", "green-lagrange"].map(|measure| law(dimension, measure));
            let mut states = [PlasticState::default(); 2];
            let mut largest = 0.0_f64;
            for step in 1..=20 {
                let t = size * f64::from(step) / 20.0;
                let gradient = Matrix2::new(t, 1.3 * t, 0.2 * t, -0.4 * t);
                let [a, b] = [0, 1].map(|k| laws[k].at(&gradient, &mut states[k], 0.0).unwrap().0);
                largest = largest.max((a - b).norm() / b.norm());
                let [a, b] =
                    [0, 1].map(|k| laws[k].out_of_plane_stress(&gradient, &states[k]).unwrap());
                largest = largest.max((a - b).abs() / b.abs());
            }
            assert!(states.iter().all(|state| state.equivalent > 0.3 * size));
            largest / size
        };
        let [coarse, fine] = [0.04, 0.01].map(error);
        assert!(coarse < 6.0 && fine < 6.0, "{coarse} {fine}");
    }

    #[test]
    fn an_inverted_point_has_no_stress() {
        let gradient = Matrix3::from_diagonal(&Vector3::new(-2.5, 0.0, 0.0));
        assert!(
            in_space()
                .at(&gradient, &mut PlasticState::default(), 0.0)
                .is_none()
        );
    }
}
