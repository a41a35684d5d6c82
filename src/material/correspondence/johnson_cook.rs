//! Hardening of Johnson & Cook (1983), with strain, strain rate and adiabatic heating.
//!
//! The yield stress is
//!
//! σ = (A + B ε̄ⁿ)(1 + C ln max(ε̄̇/ε̇₀, 1))(1 − T*ᵐ), T* = (T − T₀)/(T_m − T₀),
//!
//! with the equivalent plastic strain ε̄, the temperature T, the initial temperature T₀, the melting
//! temperature T_m, and the constants of [`JohnsonCook`].
//! In a step Δt the rate is ε̄̇ = Δε̄/Δt. All heat stays at the point where it is generated:
//! T − T₀ = β w/(ρ c). Here w is the energy density that the point has dissipated, β the fraction of w that
//! becomes heat, and ρ c the volumetric heat capacity. A step is computed with the temperature at the start
//! of the step.
//!
//! The product of the last two factors of σ is the factor of rate and temperature. This factor is part of the
//! plastic state. A force evaluation with Δt = 0 uses this stored factor. Therefore a stress that was
//! returned to the yield surface does not cause flow again.
//!
//! Let S_d be the deviatoric stress and q the equivalent stress at the end of the step. The increment of
//! plastic strain is ΔE_p = x S_d with an unknown x, and Δε̄ = ⅔ x q. q follows from the trial stress and x:
//! each part of the equivalent trial stress is divided by 1 + x c. Here c is the stiffness of the part
//! ([`Modes`]), not the heat capacity. The equation for x,
//!
//! F = σ(ε̄ + Δε̄, Δε̄/Δt) − q = 0
//!
//! is solved by Newton's method. The variable of the iteration is ln u, with u = x/(1 + x c), where c is the
//! largest stiffness of the parts. In 3-D and plane strain there is one part, and u is proportional to Δε̄.
//! Then F is convex in ln u, also at ε̄ = 0, where the slope of ε̄ⁿ is infinite for n < 1. Newton's method
//! therefore converges to the solution from larger values of u. In plane stress, a bracket safeguards the
//! method.

use super::super::{Key, Kind, LawFault, PlasticState, Property, Values};
use super::plastic::{HARDENING, YIELD_STRESS};

/// The constants of the hardening.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JohnsonCook {
    /// Yield stress A, Pa.
    yield_stress: f64,
    /// Hardening modulus B, Pa.
    modulus: f64,
    /// Hardening exponent n.
    exponent: f64,
    /// Strain rate coefficient C.
    rate_coefficient: f64,
    /// Reference strain rate ε̇₀, 1/s.
    reference_rate: f64,
    /// Thermal softening exponent m.
    softening_exponent: f64,
    /// T* divided by the dissipated energy density: β/(ρ c (T_m − T₀)), m³/J; 0 without thermal softening.
    heating: f64,
}

pub const EXPONENT: Key = Key {
    name: "hardening_exponent",
    meaning: "exponent n of the hardening σ_y + H ε̄ⁿ (Johnson & Cook 1983); 1 if not given",
    kind: Kind::Optional {
        range: f64::MIN_POSITIVE..1_f64.next_up(),
        words: "above 0 and at most 1",
    },
};

pub const RATE_COEFFICIENT: Key = Key {
    name: "strain_rate_coefficient",
    meaning: "C of the factor 1 + C ln(ε̄̇/ε̇₀) on the yield stress, 1 below ε̇₀ (Johnson & Cook 1983); 0 if not \
              given",
    kind: Kind::Optional {
        range: 0.0..f64::INFINITY,
        words: "at least 0",
    },
};

pub const REFERENCE_RATE: Key = Key {
    name: "reference_strain_rate",
    meaning: "ε̇₀ of the factor of the strain rate, 1/s",
    kind: Kind::Optional {
        range: f64::MIN_POSITIVE..f64::INFINITY,
        words: "above 0",
    },
};

pub const SOFTENING_EXPONENT: Key = Key {
    name: "thermal_softening_exponent",
    meaning: "m of the factor 1 − ((T − T₀)/(T_m − T₀))ᵐ on the yield stress (Johnson & Cook 1983), with the \
              temperature T by adiabatic heating; no thermal softening if not given",
    kind: Kind::Optional {
        range: f64::MIN_POSITIVE..f64::INFINITY,
        words: "above 0",
    },
};

pub const MELTING_TEMPERATURE: Key = Key {
    name: "melting_temperature",
    meaning: "melting temperature T_m of thermal softening, K",
    kind: Kind::Optional {
        range: f64::NEG_INFINITY..f64::INFINITY,
        words: "a number",
    },
};

pub const INITIAL_TEMPERATURE: Key = Key {
    name: "initial_temperature",
    meaning: "initial temperature T₀ of thermal softening, at which its factor is 1, K",
    kind: Kind::Optional {
        range: f64::NEG_INFINITY..f64::INFINITY,
        words: "a number",
    },
};

pub const HEAT_CAPACITY: Key = Key {
    name: "volumetric_heat_capacity",
    meaning: "density times specific heat capacity, ρ c, J/(m³ K)",
    kind: Kind::Optional {
        range: f64::MIN_POSITIVE..f64::INFINITY,
        words: "above 0",
    },
};

pub const TAYLOR_QUINNEY: Key = Key {
    name: "taylor_quinney_coefficient",
    meaning: "fraction β of the dissipated energy that heats the body; 0.9 if not given",
    kind: Kind::Optional {
        range: 0.0..1_f64.next_up(),
        words: "between 0 and 1",
    },
};

/// Keys of thermal softening. The deck gives either all or none of them.
const THERMAL: [&Key; 4] = [
    &SOFTENING_EXPONENT,
    &MELTING_TEMPERATURE,
    &INITIAL_TEMPERATURE,
    &HEAT_CAPACITY,
];

/// Keys that only this hardening has.
const ALL: [&Key; 8] = [
    &EXPONENT,
    &RATE_COEFFICIENT,
    &REFERENCE_RATE,
    &SOFTENING_EXPONENT,
    &MELTING_TEMPERATURE,
    &INITIAL_TEMPERATURE,
    &HEAT_CAPACITY,
    &TAYLOR_QUINNEY,
];

/// Default of the Taylor–Quinney coefficient β.
const DEFAULT_TAYLOR_QUINNEY: f64 = 0.9;

/// Lower limit of the factor 1 − T*ᵐ on the yield stress. A molten point keeps this fraction of its yield
/// stress.
const MOLTEN: f64 = 1e-3;

/// Tolerance of the residual F of Newton's method, relative to the equivalent trial stress.
const TOLERANCE: f64 = 1e-14;

/// Largest number of Newton iterations. Usually, about five iterations are needed. When a point with a small
/// hardening exponent n yields for the first time, up to thirty iterations are needed.
const MOST_ITERATIONS: usize = 100;

/// Return the first key of this hardening that the deck gives.
pub fn first_given(values: &Values) -> Option<&'static Key> {
    ALL.into_iter().find(|key| values.get(key.name).is_some())
}

/// Return the error in the combination of the keys; `None` if there is no error.
pub fn fault(values: &Values) -> Option<LawFault> {
    let is_given = |key: &&Key| values.get(key.name).is_some();
    let fault = |key: &Key, message: String| {
        let key = Some(key.name);
        Some(LawFault { key, message })
    };
    let needs = |key: &Key, other: &Key| fault(key, format!("needs `{}`", other.name));
    if is_given(&&EXPONENT) && !is_given(&&HARDENING) {
        return needs(&EXPONENT, &HARDENING);
    }
    for (key, other) in [
        (&RATE_COEFFICIENT, &REFERENCE_RATE),
        (&REFERENCE_RATE, &RATE_COEFFICIENT),
        (&TAYLOR_QUINNEY, &SOFTENING_EXPONENT),
    ] {
        if is_given(&key) && !is_given(&other) {
            return needs(key, other);
        }
    }
    let first = THERMAL.into_iter().find(is_given)?;
    if let Some(missing) = THERMAL.into_iter().find(|key| !is_given(key)) {
        return needs(first, missing);
    }
    let [melting, initial] =
        [&MELTING_TEMPERATURE, &INITIAL_TEMPERATURE].map(|key| values.number(key.name));
    if melting <= initial {
        let initial_name = INITIAL_TEMPERATURE.name;
        return fault(
            &MELTING_TEMPERATURE,
            format!("must be above `{initial_name}` = {initial}, is {melting}"),
        );
    }
    let to_melt = values.number(HEAT_CAPACITY.name) * (melting - initial);
    if !to_melt.is_normal() || !to_melt.recip().is_normal() {
        let message = "times the range of temperatures must be a finite number above 0";
        return fault(&HEAT_CAPACITY, message.to_owned());
    }
    None
}

/// Parts of the equivalent trial stress that plastic flow reduces at different rates. The square of the final
/// equivalent stress is q² = Σ s/(1 + x c)², summed over the parts. x (1/Pa) is the unknown of ΔE_p = x S_d.
#[derive(Debug, Clone, Copy)]
pub struct Modes {
    /// Squares s of the parts of the equivalent trial stress, Pa².
    pub squares: [f64; 2],
    /// Stiffnesses c, Pa. The second is at least as large as the first.
    pub stiffnesses: [f64; 2],
}

impl Modes {
    /// Return q (Pa), −dq/dx (Pa²) and dΔε̄/dx (Pa) at x (1/Pa).
    fn at(&self, x: f64) -> [f64; 3] {
        let divisors = self.stiffnesses.map(|stiffness| 1.0 + x * stiffness);
        let parts: [f64; 2] = std::array::from_fn(|k| self.squares[k] / divisors[k].powi(2));
        let q = (parts[0] + parts[1]).sqrt();
        let weights: [f64; 2] = std::array::from_fn(|k| parts[k] / divisors[k]);
        let fall = weights[0] * self.stiffnesses[0] + weights[1] * self.stiffnesses[1];
        [q, fall / q, 2.0 / 3.0 * (weights[0] + weights[1]) / q]
    }
}

/// Yield surface of a point in a step.
#[derive(Debug, Clone, Copy)]
pub struct Surface {
    /// A + B ε̄ⁿ at the start of the step, Pa.
    pub by_strain: f64,
    /// Yield stress at the start of the step for rates below the reference strain rate, Pa. If no time
    /// passes, `limit` is computed with the factor of rate and temperature that the last step stored.
    pub limit: f64,
    /// Ratio of `limit` to `by_strain`.
    factor: f64,
    /// Increment of ε̄ in a step during which ε̄ grows at the reference strain rate. Infinite if the yield
    /// stress does not depend on the rate, or if no time passes.
    threshold: f64,
}

impl JohnsonCook {
    /// Create the hardening of a body. `None` if the deck gives no yield stress, or if it gives none of the
    /// keys that only this hardening has.
    pub fn of(values: &Values) -> Option<Self> {
        first_given(values)?;
        let number = |key: &Key| values.get(key.name).map(|_| values.number(key.name));
        let heating = || {
            let range = number(&MELTING_TEMPERATURE)? - number(&INITIAL_TEMPERATURE)?;
            let fraction = number(&TAYLOR_QUINNEY).unwrap_or(DEFAULT_TAYLOR_QUINNEY);
            Some(fraction / (number(&HEAT_CAPACITY)? * range))
        };
        Some(Self {
            yield_stress: number(&YIELD_STRESS)?,
            modulus: number(&HARDENING).unwrap_or(0.0),
            exponent: number(&EXPONENT).unwrap_or(1.0),
            rate_coefficient: number(&RATE_COEFFICIENT).unwrap_or(0.0),
            reference_rate: number(&REFERENCE_RATE).unwrap_or(1.0),
            softening_exponent: number(&SOFTENING_EXPONENT).unwrap_or(1.0),
            heating: heating().unwrap_or(0.0),
        })
    }

    /// Return the properties for display.
    pub fn described(&self) -> Vec<(&'static str, Property)> {
        let number = |value| Property::Number(value, "");
        let mut facts = vec![("hardening exponent", number(self.exponent))];
        if self.rate_coefficient > 0.0 {
            facts.push(("strain rate coefficient", number(self.rate_coefficient)));
            let rate = Property::Number(self.reference_rate, "1/s");
            facts.push(("reference strain rate", rate));
        }
        if self.heating > 0.0 {
            facts.push(("softening exponent", number(self.softening_exponent)));
            let melting = Property::Number(1.0 / self.heating, "J/m³");
            facts.push(("energy to melt", melting));
        }
        facts
    }

    /// Return the hardening modulus B, Pa.
    pub fn modulus(&self) -> f64 {
        self.modulus
    }

    /// Return A + B ε̄ⁿ, Pa.
    pub fn by_strain(&self, equivalent: f64) -> f64 {
        self.yield_stress + self.modulus * libm::pow(equivalent, self.exponent)
    }

    /// Return the yield surface of a state in a step. `step` is the length of the step (s), 0 if no time
    /// passes.
    pub fn surface(&self, state: &PlasticState, step: f64) -> Surface {
        let factor = if step > 0.0 {
            self.by_heat(state.work)
        } else {
            1.0 + state.yield_change
        };
        let has_rate = step > 0.0 && self.rate_coefficient > 0.0;
        let by_strain = self.by_strain(state.equivalent);
        Surface {
            by_strain,
            limit: factor * by_strain,
            factor,
            threshold: if has_rate {
                step * self.reference_rate
            } else {
                f64::INFINITY
            },
        }
    }

    /// Return 1 − T*ᵐ for a dissipated energy density (J/m³); at least [`MOLTEN`].
    fn by_heat(&self, work: f64) -> f64 {
        if self.heating == 0.0 {
            return 1.0;
        }
        let temperature = (self.heating * work).clamp(0.0, 1.0);
        (1.0 - libm::pow(temperature, self.softening_exponent)).max(MOLTEN)
    }

    /// Advance the state over a step in which the stress is inside the yield surface.
    pub fn rest(&self, surface: &Surface, state: &mut PlasticState) {
        state.yield_change = surface.factor - 1.0;
    }

    /// Return x (1/Pa) of a trial stress outside the yield surface, and advance the state.
    ///
    /// The energy that the step dissipates is Δε̄ times the mean of the yield stresses before and after the
    /// step. The error of this energy is of second order in the step, except in a step in which flow begins.
    pub fn flow(&self, modes: &Modes, surface: &Surface, state: &mut PlasticState) -> f64 {
        let before = surface.by_strain * (1.0 + state.yield_change);
        let [x, growth, factor] = self.root(modes, surface, state.equivalent);
        state.equivalent += growth;
        state.yield_change = factor - 1.0;
        let after = self.by_strain(state.equivalent) * factor;
        state.work += 0.5 * (before + after) * growth;
        x
    }

    /// Solve F = 0. Returns x (1/Pa), Δε̄, and the factor of rate and temperature on A + B ε̄ⁿ.
    fn root(&self, modes: &Modes, surface: &Surface, equivalent: f64) -> [f64; 3] {
        let [soft, stiff] = modes.stiffnesses;
        let [trial, ..] = modes.at(0.0);
        // q is at most trial/(1 + x soft). At x = `most`, q is therefore at most the limit.
        let most = (trial / surface.limit - 1.0) / soft;
        // x must stay finite, also if the yield stress is below the round-off of the trial stress.
        let largest = (1.0 - f64::EPSILON) / stiff;
        let [mut low, mut high] = [0.0, (most / (1.0 + most * stiff)).min(largest)];
        let mut u: f64 = high;
        let mut found = [0.0; 3];
        for _ in 0..MOST_ITERATIONS {
            let x = u / (1.0 - u * stiff);
            let [q, fall, rise] = modes.at(x);
            let growth = 2.0 / 3.0 * x * q;
            let [factor, factor_slope] = surface.by_rate(self.rate_coefficient, growth);
            found = [x, growth, factor];
            let strained = equivalent + growth;
            let hardening = self.modulus * libm::pow(strained, self.exponent);
            let by_strain = self.yield_stress + hardening;
            let excess = by_strain * factor - q;
            if excess.abs() <= TOLERANCE * trial {
                break;
            }
            *(if excess > 0.0 { &mut high } else { &mut low }) = u;
            let strain_slope = self.exponent * hardening / strained;
            let slope = (strain_slope * factor + by_strain * factor_slope) * rise + fall;
            let next = u * libm::exp(-excess / (slope * x * (1.0 + x * stiff)));
            if next == u || next < f64::MIN_POSITIVE {
                break;
            }
            u = if next > low && next < high {
                next
            } else {
                low.sqrt() * high.sqrt()
            };
        }
        found
    }
}

impl Surface {
    /// Return the factor by which strain rate and temperature multiply A + B ε̄ⁿ. Also return the derivative
    /// of this factor with respect to `growth`, the increment of ε̄.
    fn by_rate(&self, coefficient: f64, growth: f64) -> [f64; 2] {
        if growth > self.threshold {
            let rate = 1.0 + coefficient * libm::log(growth / self.threshold);
            [self.factor * rate, self.factor * coefficient / growth]
        } else {
            [self.factor, 0.0]
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};

    use super::super::super::Given;
    use super::super::plastic::{Plastic, STRAIN_MEASURE};
    use super::*;
    use crate::dimension::Dimension;
    use crate::elastic::Isotropic;

    const YOUNG: f64 = 124e9;
    const RATIO: f64 = 0.34;
    const STRENGTH: f64 = 90e6;
    const MODULUS: f64 = 292e6;
    const POWER: f64 = 0.31;
    const RATE: f64 = 0.025;
    const MELTING: f64 = 1.09;
    /// Energy density that melts the solid, J/m³.
    const TO_MELT: f64 = 3.43e6 * 1063.0 / 0.9;

    const BY_STRAIN: [(&str, f64); 1] = [("hardening_exponent", POWER)];
    const BY_RATE: [(&str, f64); 2] = [
        ("strain_rate_coefficient", RATE),
        ("reference_strain_rate", 1.0),
    ];
    const BY_HEAT: [(&str, f64); 4] = [
        ("thermal_softening_exponent", MELTING),
        ("initial_temperature", 293.0),
        ("melting_temperature", 1356.0),
        ("volumetric_heat_capacity", 3.43e6),
    ];

    /// Return the law of copper in 3-D with logarithmic strains.
    fn copper(modulus: f64, more: &[&[(&str, f64)]]) -> Plastic {
        let mut values = Values::defaults(super::super::KEYS);
        values.set(YIELD_STRESS.name, STRENGTH.into());
        values.set(HARDENING.name, modulus.into());
        values.set(STRAIN_MEASURE.name, "logarithmic".into());
        for (key, value) in more.concat() {
            values.set(key, value.into());
        }
        let given = Given {
            dimension: Dimension::Space,
            elastic: Isotropic {
                youngs_modulus: YOUNG,
                poisson_ratio: RATIO,
            },
            horizon: 1.0,
            values: &values,
            from_fracture_energy: false,
        };
        Plastic::of(&given).unwrap()
    }

    /// Pull a point uniaxially to a logarithmic strain at a constant rate (1/s). Return the axial Kirchhoff
    /// stress after each step (Pa), and the state at the end.
    fn pull(law: &Plastic, strain: f64, rate: f64, steps: i32) -> (Vec<f64>, PlasticState) {
        let mut state = PlasticState::default();
        let step = strain / rate / f64::from(steps);
        let mut across = 0.0_f64;
        let stresses = (1..=steps).map(|number| {
            let along = strain * f64::from(number) / f64::from(steps);
            let kirchhoff = |across: f64, state: &mut PlasticState| {
                let stretches = Vector3::new(along, across, across).map(f64::exp);
                let deformation = Matrix3::from_diagonal(&stretches);
                let gradient = deformation - Matrix3::identity();
                let (piola, _) = law.at(&gradient, state, step).unwrap();
                piola * deformation
            };
            // Secant method for the transverse strain at which the transverse stress is 0.
            let mut last = (across, kirchhoff(across, &mut state.clone())[(1, 1)]);
            across -= 1e-6;
            for _ in 0..50 {
                let now = (across, kirchhoff(across, &mut state.clone())[(1, 1)]);
                if now.1.abs() < 1e-8 * STRENGTH || now.0 == last.0 {
                    break;
                }
                across = now.0 - now.1 * (now.0 - last.0) / (now.1 - last.1);
                last = now;
            }
            kirchhoff(across, &mut state)[(0, 0)]
        });
        let stresses = stresses.collect();
        (stresses, state)
    }

    #[test]
    fn a_bar_hardens_by_the_power_of_its_plastic_strain() {
        let law = copper(MODULUS, &[&BY_STRAIN]);
        for strain in [1e-3, 0.01, 0.1, 1.0] {
            let (stresses, state) = pull(&law, strain, 1.0, 40);
            let stress = stresses[39];
            // The strain is σ/E + ε̄. Find ε̄ by bisection.
            let [mut low, mut high] = [0.0, strain];
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                let hardened = STRENGTH + MODULUS * f64::powf(middle, POWER);
                *(if hardened / YOUNG + middle > strain {
                    &mut high
                } else {
                    &mut low
                }) = middle;
            }
            assert!((state.equivalent / low - 1.0).abs() < 1e-8, "{strain}");
            let wanted = STRENGTH + MODULUS * f64::powf(low, POWER);
            assert!((stress / wanted - 1.0).abs() < 1e-8, "{strain}: {stress}");
        }
    }

    #[test]
    fn without_hardening_a_bar_has_the_stress_of_its_rate() {
        let law = copper(0.0, &[&BY_RATE]);
        for rate in [1e-3, 1.0, 10.0, 1e4, 1e7] {
            let (stresses, _) = pull(&law, 0.05, rate, 50);
            let wanted = STRENGTH * (1.0 + RATE * f64::ln(f64::max(rate, 1.0)));
            let error = stresses[49] / wanted - 1.0;
            assert!(error.abs() < 1e-9, "{rate}: {error}");
        }
    }

    /// Integrate the rate equations of a bar by the method of Runge and Kutta. Let σ₀ be the yield stress
    /// without the factor of the rate. If the stress σ exceeds σ₀, the rate of flow is
    /// ε̄̇ = ε̇₀ exp((σ/σ₀ − 1)/C).
    /// Returns σ (Pa), ε̄ and the dissipated energy density (J/m³).
    fn integrated(strain: f64, rate: f64) -> [f64; 3] {
        let steps = 400_000;
        let step = strain / rate / f64::from(steps);
        let slopes = |[stress, flowed, work]: [f64; 3]| {
            let heat = 1.0 - f64::powf(f64::max(work / TO_MELT, 0.0), MELTING);
            let slow = (STRENGTH + MODULUS * f64::powf(flowed, POWER)) * heat;
            let flow = if stress > slow {
                f64::exp((stress / slow - 1.0) / RATE)
            } else {
                0.0
            };
            [YOUNG * (rate - flow), flow, stress * flow]
        };
        let mut now = [0.0; 3];
        for _ in 0..steps {
            let moved = |by: f64, k: [f64; 3]| std::array::from_fn(|i| now[i] + by * k[i]);
            let a = slopes(now);
            let b = slopes(moved(0.5 * step, a));
            let c = slopes(moved(0.5 * step, b));
            let d = slopes(moved(step, c));
            now = std::array::from_fn(|i| {
                now[i] + step / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i])
            });
        }
        now
    }

    #[test]
    fn a_fast_bar_follows_its_rate_equations() {
        let law = copper(MODULUS, &[&BY_STRAIN, &BY_RATE, &BY_HEAT]);
        let (strain, rate) = (0.5, 1e4);
        let [stress, flowed, work] = integrated(strain, rate);
        // The temperature changes the yield stress noticeably.
        assert!(work / TO_MELT > 0.02, "{work}");
        let error = |steps| {
            let (stresses, state) = pull(&law, strain, rate, steps);
            let last = *stresses.last().unwrap();
            [last / stress, state.equivalent / flowed, state.work / work]
                .map(|part| (part - 1.0).abs())
        };
        let [coarse, fine] = [100, 400].map(error);
        for (coarse, fine) in coarse.into_iter().zip(fine) {
            assert!(fine < 1e-3 && fine < 0.4 * coarse, "{coarse} {fine}");
        }
    }

    #[test]
    fn the_root_is_that_of_bisection() {
        for exponent in [0.05, 0.31, 1.0, 2.0] {
            for rate_coefficient in [0.0, 0.025, 0.5] {
                let law = JohnsonCook {
                    yield_stress: STRENGTH,
                    modulus: MODULUS,
                    exponent,
                    rate_coefficient,
                    reference_rate: 1.0,
                    softening_exponent: MELTING,
                    heating: 1.0 / TO_MELT,
                };
                for equivalent in [0.0, 1e-9, 1e-3, 2.0] {
                    for step in [0.0, 1e-9, 1.0] {
                        for excess in [1e-11, 1e-6, 1e-2, 1.0, 1e3] {
                            compare(&law, equivalent, step, excess);
                        }
                    }
                }
            }
        }
    }

    /// Compare the root with the result of bisection. The trial stress is `1 + excess` times the yield
    /// stress.
    fn compare(law: &JohnsonCook, equivalent: f64, step: f64, excess: f64) {
        let state = PlasticState {
            equivalent,
            yield_change: 0.02,
            work: 0.1 * TO_MELT,
            ..PlasticState::default()
        };
        let surface = law.surface(&state, step);
        let trial = surface.limit * (1.0 + excess);
        for parts in [[0.0, 1.0], [0.3, 0.7], [1.0, 0.0]] {
            let modes = Modes {
                squares: parts.map(|part| part * trial * trial),
                stiffnesses: [60e9, 93e9],
            };
            let [x, growth, factor] = law.root(&modes, &surface, equivalent);
            let excess = |logarithm: f64| {
                let [q, ..] = modes.at(f64::exp(logarithm));
                let growth = 2.0 / 3.0 * f64::exp(logarithm) * q;
                let rate = f64::max(growth / (step * law.reference_rate), 1.0).ln();
                let by_rate = if step > 0.0 {
                    1.0 + law.rate_coefficient * rate
                } else {
                    1.0
                };
                let hardened = MODULUS * f64::powf(equivalent + growth, law.exponent);
                (STRENGTH + hardened) * surface.factor * by_rate - q
            };
            let [mut low, mut high] = [-800.0, 0.0];
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                *(if excess(middle) > 0.0 {
                    &mut high
                } else {
                    &mut low
                }) = middle;
            }
            // An error of x of this size changes q by less than a few times the tolerance of the root.
            let [q, fall, _] = modes.at(x);
            let allowed = 1e-12 * x + 4.0 * TOLERANCE * trial / fall;
            let case = format!(
                "{law:?} {equivalent} {step} {excess:?} {parts:?}",
                excess = trial
            );
            assert!(
                (x - f64::exp(low)).abs() < allowed,
                "{case}: {x} {}",
                low.exp()
            );
            assert!(
                (growth - 2.0 / 3.0 * x * q).abs() <= 1e-15 * growth,
                "{case}"
            );
            let hardened = law.by_strain(equivalent + growth) * factor;
            assert!(
                (hardened - q).abs() <= 1e-13 * trial,
                "{case}: {hardened} {q}"
            );
        }
    }

    #[test]
    fn a_yield_stress_below_the_round_off_of_the_stress_gives_finite_flow() {
        let law = JohnsonCook {
            yield_stress: 1e-12,
            modulus: 0.0,
            exponent: 0.5,
            rate_coefficient: 0.0,
            reference_rate: 1.0,
            softening_exponent: 1.0,
            heating: 0.0,
        };
        let state = PlasticState::default();
        let surface = law.surface(&state, 1.0);
        let modes = Modes {
            squares: [0.0, 1e16],
            stiffnesses: [60e9, 93e9],
        };
        let found = law.root(&modes, &surface, 0.0);
        assert!(found.iter().all(|value| value.is_finite()), "{found:?}");
        // The whole strain is plastic.
        assert!(
            (found[1] / (2.0 / 3.0 * 1e8 / 93e9) - 1.0).abs() < 1e-9,
            "{found:?}"
        );
    }

    #[test]
    fn a_molten_point_keeps_a_thousandth_of_its_yield_stress() {
        let law = copper(MODULUS, &[&BY_STRAIN, &BY_RATE, &BY_HEAT]);
        let mut state = PlasticState {
            work: 2.0 * TO_MELT,
            ..PlasticState::default()
        };
        let gradient = Matrix3::from_diagonal(&Vector3::new(0.02, -0.01, -0.01));
        law.at(&gradient, &mut state, 1.0).unwrap();
        assert_eq!(state.yield_change, 1e-3 - 1.0);
    }
}
