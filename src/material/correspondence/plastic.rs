//! J2 plasticity with isotropic hardening, computed from the deformation gradient of each point's family.
//! This file implements small strains; [`logarithmic`] implements large strains.
//!
//! Green & Naghdi 1965: Green's strain is the sum of an elastic and a plastic strain, E = E_e + E_p. The
//! second Piola–Kirchhoff stress is S = C : E_e, and the first Piola–Kirchhoff stress is P = F S.
//! A rigid rotation does not change E. Therefore the law needs no corotational frame, no polar decomposition
//! and no integration of a stress rate.
//! Without flow the law equals the St. Venant–Kirchhoff law. The law is meant for small strains with
//! rotations of any size.
//!
//! Let S_d be the deviator of S, q = √(3/2 |S_d|²) the equivalent stress, and ε̄ the equivalent plastic
//! strain. With the yield stress σ_y and the hardening modulus H, the yield surface is q = σ_y + H ε̄. A
//! trial stress outside the surface returns along S_d (Simo & Hughes 1998, §3.3):
//! Δε̄ = (q − σ_y − H ε̄)/(3G + H), ΔE_p = (3/2) Δε̄ S_d/q. In plane stress, the out-of-plane stress stays 0.
//! Then ΔE_p = x S_d, where S_d is the deviator of the final stress, and x solves a scalar equation (§3.4).
//!
//! [`johnson_cook`](super::johnson_cook) implements the hardening of Johnson & Cook. With this hardening,
//! the yield stress grows with a power of ε̄ and with the rate of ε̄. It decreases with the temperature.
//!
//! The whole plastic work ∫ q dε̄ is dissipated.

use std::ops::AddAssign;

use nalgebra::{Matrix3, SMatrix};

use super::super::{Given, Key, Kind, LawFault, PlasticState, Property, Values, Word};
use super::hooke;
use super::johnson_cook::{self, JohnsonCook, Modes};
use super::logarithmic;
use super::stress::{green_strain, stretch_of};
use super::tensor::{matrix, rows};
use crate::dimension::Dimension;

/// Constants of J2 plasticity with isotropic hardening.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plastic {
    /// Yield stress σ_y, Pa.
    yield_stress: f64,
    hardening: Hardening,
    /// Lamé's λ, Pa. In plane stress, λ is that of a thin sheet, 2Gν/(1 − ν), with the Poisson ratio ν.
    lambda: f64,
    /// Shear modulus G, Pa.
    shear: f64,
    /// Whether the problem is plane stress, so that the out-of-plane stress is 0.
    is_sheet: bool,
    /// Whether the elastic strain is logarithmic.
    is_logarithmic: bool,
}

/// Dependence of the yield stress on the plastic state.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Hardening {
    /// The yield surface is q = σ_y + H ε̄. The number is the hardening modulus H, Pa.
    Linear(f64),
    JohnsonCook(JohnsonCook),
}

pub const YIELD_STRESS: Key = Key {
    name: "yield_stress",
    meaning: "yield stress σ_y in uniaxial tension, Pa (von Mises); only isotropic, with the \
              default `stress`; elastic if not given",
    kind: Kind::Optional {
        range: f64::MIN_POSITIVE..f64::INFINITY,
        words: "above 0",
    },
};

pub const HARDENING: Key = Key {
    name: "hardening_modulus",
    meaning: "hardening modulus H, Pa: slope of the yield stress over the equivalent plastic \
              strain; with `hardening_exponent` its factor; 0 if not given",
    kind: Kind::Optional {
        range: 0.0..f64::INFINITY,
        words: "at least 0",
    },
};

pub const STRAIN_MEASURE: Key = Key {
    name: "strain_measure",
    meaning: "elastic strain of a body that yields: Green-Lagrange, for small strains, or logarithmic with \
              F = F_e F_p, for large ones",
    kind: Kind::Word(&[Word::new("green-lagrange"), Word::new("logarithmic")]),
};

/// Tolerance of the yield surface, relative to the yield stress. Without this tolerance, a stress that has
/// been returned to the yield surface could flow again because of round-off.
const SURFACE: f64 = 1e-12;

/// Tolerance of the yield surface for logarithmic strains, and for hardening that is not linear. With
/// logarithmic strains, the round-off of a stress on the yield surface is larger than at small strains. The
/// reason is that the stress follows from b_e, whose round-off scales with the square of the stretches. With
/// Johnson–Cook hardening, heating can make the yield stress small compared with the round-off of the stress.
const WIDE_SURFACE: f64 = 1e-9;

/// Return the error in the values of the keys; `None` if there is no error.
pub fn fault(values: &Values, dimension: Dimension) -> Option<LawFault> {
    let fault = |key: &Key, message: &str| {
        Some(LawFault {
            key: Some(key.name),
            message: message.to_owned(),
        })
    };
    let is_logarithmic = values.word(STRAIN_MEASURE.name) == "logarithmic";
    if values.get(YIELD_STRESS.name).is_none() {
        if is_logarithmic {
            return fault(&STRAIN_MEASURE, "`\"logarithmic\"` needs `yield_stress`");
        }
        let hardening = values.get(HARDENING.name).map(|_| &HARDENING);
        let key = hardening.or_else(|| johnson_cook::first_given(values))?;
        return fault(key, "needs `yield_stress`");
    }
    if is_logarithmic && matches!(dimension, Dimension::PlaneStress { .. }) {
        return fault(
            &STRAIN_MEASURE,
            "`\"logarithmic\"` is for plane strain and 3-D, not for plane stress",
        );
    }
    if let Some(constant) = hooke::own_constants(values) {
        let message = format!(
            "only isotropic solids can yield; give two elastic constants instead of `{constant}`"
        );
        return fault(&YIELD_STRESS, &message);
    }
    if values.word(super::STRESS.name) != "st-venant-kirchhoff" {
        return fault(
            &super::STRESS,
            "a body that yields needs `stress = \"st-venant-kirchhoff\"`",
        );
    }
    johnson_cook::fault(values)
}

impl Plastic {
    /// Create the law of a body; `None` if the body does not yield.
    pub fn of(given: &Given) -> Option<Self> {
        let number = |key: &Key| {
            let is_given = given.values.get(key.name).is_some();
            is_given.then(|| given.values.number(key.name))
        };
        let (shear, ratio) = (given.elastic.shear_modulus(), given.elastic.poisson_ratio);
        let is_sheet = matches!(given.dimension, Dimension::PlaneStress { .. });
        Some(Self {
            yield_stress: number(&YIELD_STRESS)?,
            hardening: JohnsonCook::of(given.values).map_or_else(
                || Hardening::Linear(number(&HARDENING).unwrap_or(0.0)),
                Hardening::JohnsonCook,
            ),
            lambda: if is_sheet {
                2.0 * shear * ratio / (1.0 - ratio)
            } else {
                given.elastic.lame_lambda()
            },
            shear,
            is_sheet,
            is_logarithmic: given.values.word(STRAIN_MEASURE.name) == "logarithmic",
        })
    }

    /// Return the properties for display.
    pub fn described(&self) -> Vec<(&'static str, Property)> {
        let strain = if self.is_logarithmic {
            "logarithmic"
        } else {
            "Green–Lagrange"
        };
        let (modulus, more) = match &self.hardening {
            Hardening::Linear(modulus) => (*modulus, Vec::new()),
            Hardening::JohnsonCook(law) => (law.modulus(), law.described()),
        };
        let mut facts = vec![
            ("yield stress", Property::Number(self.yield_stress, "Pa")),
            ("hardening", Property::Number(modulus, "Pa")),
        ];
        facts.extend(more);
        facts.push(("strain measure", Property::Text(strain)));
        facts
    }

    /// Return P (Pa) and the elastic energy density (J/m³) at a displacement gradient, and update the plastic
    /// state. `step` is the length of the time step (s), 0 if no time passes. `None` if the logarithmic
    /// strain does not exist.
    pub fn at<const D: usize>(
        &self,
        gradient: &SMatrix<f64, D, D>,
        state: &mut PlasticState,
        step: f64,
    ) -> Option<(SMatrix<f64, D, D>, f64)> {
        if self.is_logarithmic {
            return logarithmic::at(self, gradient, state, step);
        }
        let mut strain = Matrix3::zeros();
        let in_plane = matrix(&green_strain(&rows(gradient)));
        strain.view_mut((0, 0), (D, D)).copy_from(&in_plane);
        let trial = self.stress(&(strain - tensor_of(&state.strain)));
        if let Some(flow) = self.flow(&trial, state, step) {
            logarithmic::add(&mut state.strain, &flow);
        }
        let elastic = strain - tensor_of(&state.strain);
        let stress = self.stress(&elastic);
        let second: SMatrix<f64, D, D> = stress.fixed_view::<D, D>(0, 0).into_owned();
        Some((second + gradient * second, 0.5 * stress.dot(&elastic)))
    }

    /// Correct the plastic state of a point that is the mean of the states of other points.
    pub fn correct_mean(&self, state: &mut PlasticState) {
        if self.is_logarithmic {
            logarithmic::restore_volume(&mut state.strain);
        }
    }

    /// Return the out-of-plane Kirchhoff stress in plane strain, Pa; `None` if the logarithmic strain does
    /// not exist.
    pub fn out_of_plane_stress<const D: usize>(
        &self,
        gradient: &SMatrix<f64, D, D>,
        state: &PlasticState,
    ) -> Option<f64> {
        if self.is_logarithmic {
            return logarithmic::out_of_plane_stress(self, gradient, state);
        }
        let mut elastic = -tensor_of(&state.strain);
        let in_plane = matrix(&green_strain(&rows(gradient)));
        elastic.view_mut((0, 0), (D, D)).add_assign(&in_plane);
        Some(self.stress(&elastic)[(2, 2)])
    }

    /// Return the out-of-plane stretch F_zz in plane stress; `None` if F_zz² would not be positive.
    pub fn out_of_plane_stretch<const D: usize>(
        &self,
        gradient: &SMatrix<f64, D, D>,
        state: &PlasticState,
    ) -> Option<f64> {
        let strain = matrix(&green_strain(&rows(gradient)));
        let [xx, yy, zz, ..] = state.strain;
        let elastic = strain.trace() - xx - yy;
        stretch_of(zz - 0.5 * self.lambda / self.shear * elastic)
    }

    /// Return the stress of an elastic strain, Pa: S for Green's strain, or the Kirchhoff stress for a
    /// logarithmic strain.
    pub fn stress(&self, elastic: &Matrix3<f64>) -> Matrix3<f64> {
        let mut stress = elastic * (2.0 * self.shear);
        if self.is_sheet {
            let mean = self.lambda * (elastic[(0, 0)] + elastic[(1, 1)]);
            stress[(0, 0)] += mean;
            stress[(1, 1)] += mean;
            stress[(2, 2)] = 0.0;
        } else {
            let mean = self.lambda * elastic.trace();
            for k in 0..3 {
                stress[(k, k)] += mean;
            }
        }
        stress
    }

    /// Return the factor on the zero-energy control: (σ/(σ + 3G ε̄))², where σ is the yield stress without
    /// the factor of rate and temperature. The result is the square of the ratio of the secant shear modulus
    /// to G. The result is 1 before any flow. It never grows, because σ depends on ε̄ only, and σ/ε̄
    /// decreases as ε̄ grows.
    ///
    /// The motion z of the zero-energy modes grows with ε̄. With the ratio instead of its square, the energy
    /// of the control would grow with the plastic work. This energy would then contribute to the computed
    /// limit loads. With the square, the energy of the control stays at its value at first yield.
    pub fn control_left(&self, state: &PlasticState) -> f64 {
        let limit = self.limit(state);
        (limit / (limit + 3.0 * self.shear * state.equivalent)).powi(2)
    }

    /// Return the yield stress of this state without the factor of rate and temperature, Pa.
    fn limit(&self, state: &PlasticState) -> f64 {
        match &self.hardening {
            Hardening::Linear(modulus) => self.yield_stress + modulus * state.equivalent,
            Hardening::JohnsonCook(law) => law.by_strain(state.equivalent),
        }
    }

    /// Return the increment of the plastic strain at a trial stress (Pa), and update ε̄, the plastic work and
    /// the factor of rate and temperature. `step` is the length of the step (s), 0 if no time passes. `None`
    /// if the stress is inside the yield surface or not finite.
    pub fn flow(
        &self,
        trial: &Matrix3<f64>,
        state: &mut PlasticState,
        step: f64,
    ) -> Option<Matrix3<f64>> {
        let most = equivalent(trial);
        // A stress of NaN or infinity is ignored here; the check for finite fields reports such values.
        let flows = |allowed: f64| most > allowed && most.is_finite();
        match &self.hardening {
            Hardening::Linear(modulus) => {
                let limit = self.limit(state);
                let surface = if self.is_logarithmic {
                    WIDE_SURFACE
                } else {
                    SURFACE
                };
                if !flows(limit * (1.0 + surface)) {
                    return None;
                }
                let (growth, change) = if self.is_sheet {
                    self.in_a_sheet(trial, limit, *modulus)
                } else {
                    let growth = (most - limit) / (3.0 * self.shear + modulus);
                    (growth, deviator(trial) * (1.5 * growth / most))
                };
                state.equivalent += growth;
                state.work += (limit + 0.5 * modulus * growth) * growth;
                Some(change)
            }
            Hardening::JohnsonCook(law) => {
                let surface = law.surface(state, step);
                if !flows(surface.limit + WIDE_SURFACE * surface.by_strain) {
                    law.rest(&surface, state);
                    return None;
                }
                let doubled = 2.0 * self.shear;
                Some(if self.is_sheet {
                    let x = law.flow(&self.modes_of_sheet(trial), &surface, state);
                    deviator(&self.final_stress_in_sheet(trial, x)) * x
                } else {
                    let modes = Modes {
                        squares: [0.0, most * most],
                        stiffnesses: [doubled; 2],
                    };
                    let x = law.flow(&modes, &surface, state);
                    deviator(trial) * (x / (1.0 + x * doubled))
                })
            }
        }
    }

    /// Return the [`Modes`] of a trial stress (Pa) in plane stress.
    ///
    /// The plastic strain increases by ΔE_p = x S_d. Here x is a scalar (1/Pa), and S_d is the deviator of
    /// the final stress S. Let Π be the projection to the deviator, so that S_d = Π S. With the stiffness C
    /// in plane stress, the final stress is S = S_trial − x C Π S. C and Π have the same eigenvectors. Each
    /// eigencomponent of the trial stress is therefore multiplied by 1/(1 + x c), with the eigenvalue c of
    /// C Π.
    fn modes_of_sheet(&self, trial: &Matrix3<f64>) -> Modes {
        let (xx, yy, xy) = (trial[(0, 0)], trial[(1, 1)], trial[(0, 1)]);
        Modes {
            squares: [
                0.25 * (xx + yy) * (xx + yy),
                0.75 * (xx - yy) * (xx - yy) + 3.0 * xy * xy,
            ],
            stiffnesses: [2.0 * (self.lambda + self.shear) / 3.0, 2.0 * self.shear],
        }
    }

    /// Return the final stress (Pa) in plane stress, from a trial stress (Pa). `x` (1/Pa) is the factor in
    /// ΔE_p = x S_d, see [`Self::modes_of_sheet`].
    fn final_stress_in_sheet(&self, trial: &Matrix3<f64>, x: f64) -> Matrix3<f64> {
        let (xx, yy, xy) = (trial[(0, 0)], trial[(1, 1)], trial[(0, 1)]);
        let [equibiaxial, in_plane_shear] = self.modes_of_sheet(trial).stiffnesses;
        let sum = 0.5 * (xx + yy) / (1.0 + x * equibiaxial);
        let difference = 0.5 * (xx - yy) / (1.0 + x * in_plane_shear);
        let shear = xy / (1.0 + x * in_plane_shear);
        let mut stress = Matrix3::from_diagonal(&[sum + difference, sum - difference, 0.0].into());
        stress[(0, 1)] = shear;
        stress[(1, 0)] = shear;
        stress
    }

    /// Return Δε̄ and ΔE_p in plane stress with linear hardening. `limit` is the yield stress before the
    /// flow, and `modulus` the hardening modulus, both in Pa.
    ///
    /// Here ΔE_p = x S_d, with the unknown x of [`Self::modes_of_sheet`]. The final equivalent stress q
    /// decreases with x and is convex, so Newton's method converges to the root from one side.
    fn in_a_sheet(&self, trial: &Matrix3<f64>, limit: f64, modulus: f64) -> (f64, Matrix3<f64>) {
        let Modes {
            squares,
            stiffnesses: [equibiaxial, in_plane_shear],
        } = self.modes_of_sheet(trial);
        let hardening = 2.0 / 3.0 * modulus;
        let mut x = 0.0;
        for _ in 0..100 {
            let divisors = [1.0 + x * equibiaxial, 1.0 + x * in_plane_shear];
            let parts = [
                squares[0] / divisors[0].powi(2),
                squares[1] / divisors[1].powi(2),
            ];
            let q = (parts[0] + parts[1]).sqrt();
            let slope = -(parts[0] * equibiaxial / divisors[0]
                + parts[1] * in_plane_shear / divisors[1])
                / q;
            let rest = q * (1.0 - hardening * x) - limit;
            let step = rest / (slope * (1.0 - hardening * x) - hardening * q);
            x -= step;
            if step.abs() <= 1e-15 * x {
                break;
            }
        }
        let stress = self.final_stress_in_sheet(trial, x);
        (2.0 / 3.0 * x * equivalent(&stress), deviator(&stress) * x)
    }
}

/// Create a symmetric tensor from its entries xx, yy, zz, yz, xz, xy.
pub fn tensor_of([xx, yy, zz, yz, xz, xy]: &[f64; 6]) -> Matrix3<f64> {
    Matrix3::new(*xx, *xy, *xz, *xy, *yy, *yz, *xz, *yz, *zz)
}

fn deviator(stress: &Matrix3<f64>) -> Matrix3<f64> {
    stress - Matrix3::from_diagonal_element(stress.trace() / 3.0)
}

/// Return the equivalent stress q = √(3/2 |S_d|²), in the unit of the stress.
fn equivalent(stress: &Matrix3<f64>) -> f64 {
    1.5_f64.sqrt() * deviator(stress).norm()
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix2;

    use super::*;
    use crate::elastic::Isotropic;

    const YIELD: f64 = 0.01;
    const HARDENING_MODULUS: f64 = 0.3;

    fn given(dimension: Dimension, values: &Values) -> Given<'_> {
        Given {
            dimension,
            elastic: Isotropic {
                youngs_modulus: 3.0,
                poisson_ratio: 0.3,
            },
            horizon: 1.0,
            values,
            from_fracture_energy: false,
        }
    }

    /// Keys and values of Johnson–Cook plasticity. The yield stress rises with strain and strain rate, and
    /// falls with temperature. In the random walk, the temperature rises by about half of the difference
    /// between melting and initial temperature.
    const JOHNSON_COOK: [(&str, f64); 8] = [
        ("hardening_modulus", 0.02),
        ("hardening_exponent", 0.3),
        ("strain_rate_coefficient", 0.04),
        ("reference_strain_rate", 1e-3),
        ("thermal_softening_exponent", 1.1),
        ("initial_temperature", 300.0),
        ("melting_temperature", 1300.0),
        ("volumetric_heat_capacity", 5e-5),
    ];

    fn law_with(dimension: Dimension, more: &[(&str, f64)]) -> Plastic {
        let mut values = Values::defaults(super::super::KEYS);
        values.set(YIELD_STRESS.name, YIELD.into());
        values.set(HARDENING.name, HARDENING_MODULUS.into());
        for (key, value) in more {
            values.set(key, (*value).into());
        }
        Plastic::of(&given(dimension, &values)).unwrap()
    }

    fn law(dimension: Dimension) -> Plastic {
        law_with(dimension, &[])
    }

    /// Return the duration of a step of the random walk, s. The strain rates are below the reference strain
    /// rate in some steps, and above it in others.
    fn duration(number: usize) -> f64 {
        [0.01, 1e4, 1.0, 100.0][number % 4]
    }

    /// Generate displacement gradients of a random walk, with some large steps.
    fn walk<const D: usize>() -> impl Iterator<Item = SMatrix<f64, D, D>> {
        let mut number = 0.0_f64;
        let mut place = SMatrix::<f64, D, D>::zeros();
        (0..400).map(move |step| {
            let size = if step % 7 == 0 { 0.02 } else { 0.002 };
            place = SMatrix::from_fn(|a, b| {
                number += 1.0;
                0.9 * place[(a, b)] + size * libm::sin(number * number + 0.3 * number)
            });
            place
        })
    }

    fn check<const D: usize>(law: &Plastic) {
        let mut state = PlasticState::default();
        let (mut hardened, mut hottest) = (0, 0.0_f64);
        let tolerance = match law.hardening {
            Hardening::Linear(_) => 1e-12,
            Hardening::JohnsonCook(_) => 1e-11,
        };
        for (number, gradient) in walk::<D>().enumerate() {
            let before = state;
            law.at(&gradient, &mut state, duration(number));
            let strain = matrix(&green_strain(&rows(&gradient)));
            let mut elastic = -tensor_of(&state.strain);
            for a in 0..D {
                for b in 0..D {
                    elastic[(a, b)] += strain[(a, b)];
                }
            }
            let stress = law.stress(&elastic);
            let over = equivalent(&stress) / law.limit(&state) - 1.0 - state.yield_change;
            assert!(over < tolerance, "{over}");
            assert!(state.work >= before.work && state.equivalent >= before.equivalent);
            let flow = tensor_of(&state.strain) - tensor_of(&before.strain);
            assert!(flow.trace().abs() < 1e-16);
            hottest = hottest.min(state.yield_change);
            if state.equivalent > before.equivalent {
                hardened += usize::from(state.yield_change > 0.0);
                assert!(over > -tolerance, "{over}");
                // The increment of the plastic strain is along the deviator. The length of this increment
                // gives the increment of the equivalent plastic strain.
                let growth = state.equivalent - before.equivalent;
                let wanted = deviator(&stress) * (1.5 * growth / equivalent(&stress));
                assert!((flow - wanted).norm() < 1e-9 * growth);
            }
            // A stress that has been returned to the yield surface does not flow again.
            let after = state;
            law.at(&gradient, &mut state, 0.0);
            assert_eq!(state, after);
        }
        assert!(state.equivalent > 0.1, "{state:?}");
        if let Hardening::JohnsonCook(_) = law.hardening {
            assert!(hardened > 20 && hottest < -0.1, "{hardened} {hottest}");
        }
    }

    #[test]
    fn the_yield_surface_is_not_left_and_flow_dissipates() {
        for more in [&[][..], &JOHNSON_COOK] {
            check::<3>(&law_with(Dimension::Space, more));
            check::<2>(&law_with(Dimension::PlaneStrain { thickness: 1.0 }, more));
            check::<2>(&law_with(Dimension::PlaneStress { thickness: 1.0 }, more));
        }
    }

    #[test]
    fn a_sheet_flows_as_the_solid_that_is_free_across_it() {
        for more in [&[][..], &JOHNSON_COOK] {
            sheet_as_solid(more);
        }
    }

    fn sheet_as_solid(more: &[(&str, f64)]) {
        let sheet = law_with(Dimension::PlaneStress { thickness: 1.0 }, more);
        let solid = law_with(Dimension::Space, more);
        let [mut of_sheet, mut of_solid] = [PlasticState::default(); 2];
        for (number, gradient) in walk::<2>().enumerate() {
            let step = duration(number);
            let (stress, energy) = sheet.at(&gradient, &mut of_sheet, step).unwrap();
            let mut whole = Matrix3::zeros();
            whole.fixed_view_mut::<2, 2>(0, 0).copy_from(&gradient);
            // Find by bisection the out-of-plane displacement gradient at which the out-of-plane stress is 0.
            let [mut low, mut high] = [-0.3, 0.3];
            for _ in 0..80 {
                whole[(2, 2)] = 0.5 * (low + high);
                let (stress, _) = solid.at(&whole, &mut of_solid.clone(), step).unwrap();
                if stress[(2, 2)] > 0.0 {
                    high = whole[(2, 2)];
                } else {
                    low = whole[(2, 2)];
                }
            }
            let (wanted, wanted_energy) = solid.at(&whole, &mut of_solid, step).unwrap();
            let wanted: Matrix2<f64> = wanted.fixed_view::<2, 2>(0, 0).into_owned();
            assert!((stress - wanted).norm() < 1e-9 * YIELD, "{stress} {wanted}");
            assert!((energy - wanted_energy).abs() < 1e-9 * YIELD);
            assert!((of_sheet.equivalent - of_solid.equivalent).abs() < 1e-9);
        }
        assert!(of_sheet.equivalent > 0.1);
    }

    #[test]
    fn without_flow_it_is_the_elastic_law() {
        for dimension in [
            Dimension::PlaneStress { thickness: 1.0 },
            Dimension::PlaneStrain { thickness: 1.0 },
        ] {
            let law = law(dimension);
            let values = Values::defaults(super::super::KEYS);
            let given = given(dimension, &values);
            let hooke = hooke::Hooke::of(&given).unwrap();
            let elastic = super::super::Stress::of("st-venant-kirchhoff", &given, hooke);
            let gradient = Matrix2::new(1e-3, 2e-3, -5e-4, 1e-3);
            let mut state = PlasticState::default();
            let (stress, energy) = law.at(&gradient, &mut state, 0.0).unwrap();
            let (wanted, wanted_energy) = elastic.at(&gradient).unwrap();
            assert_eq!(state, PlasticState::default());
            assert!((stress - wanted).norm() < 1e-14 * wanted.norm());
            assert!((energy / wanted_energy - 1.0).abs() < 1e-14);
        }
    }
}
