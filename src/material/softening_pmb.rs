//! Softening microelastic material. In tension f = c (1 − d) s Y/|Y| with the micromodulus c, where the
//! damage variable d depends on the largest past stretch κ. In compression f = c s Y/|Y|.
//!
//! On first loading |f|/c is F(κ), and 1 − d = F(κ)/κ. Up to the strength stretch s0, F(κ) is κ. Beyond s0, F
//! decreases, and it is 0 at the critical stretch sc. Unloading follows the straight line to the origin.
//! Damage does not act in compression, because the faces of a crack close.
//!
//! | curve | F between s0 and sc |
//! |---|---|
//! | bilinear | s0 (sc − κ)/(sc − s0) |
//! | trilinear | linear from s0 to β s0 at κ = s0 + γ (sc − s0), and from there to 0 at sc |
//! | exponential | s0 (exp(−(κ − s0)/a) − r)/(1 − r), sc = s0 + a ln(1/r), with the decay stretch a |
//!
//! A body in uniaxial tension bears a stress of more than E s0. When the bonds along the axis soften, the
//! forces of bonds in other directions still increase. Therefore s0 is chosen such that the largest stress in
//! uniaxial tension equals the tensile strength f_t. This stress is computed by quadrature over the
//! directions of the bonds.
//!
//! Let s_e be the critical stretch of `pmb` for a given fracture energy. Breaking a `pmb` bond at the stretch
//! s_e dissipates c |ξ| s_e²/2. Stretching a bond of this law to sc dissipates c |ξ| A with A = ∫ F dκ. With
//! A = s_e²/2, the bonds across a unit area dissipate the given fracture energy. This holds in every
//! dimension.

use std::f64::consts::FRAC_PI_2;

use super::declaration::bond_based_critical_stretch;
use super::{
    Along, Bond, Built, Declaration, Declared, Described, Given, Invariants, Key, Kind, Law,
    LawFault, Pmb, Property, Values, Word,
};
use crate::damage::CriticalStretch;
use crate::dimension::Dimension;
use crate::elastic::Isotropic;
use crate::lanes::{IsaSet, Lanes, WIDTH};
use crate::message::format_number;

/// The constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SofteningPmb {
    /// The elastic part.
    pub elastic: Pmb,
    /// Strength stretch s0.
    pub strength_stretch: f64,
    /// Critical stretch sc.
    pub critical_stretch: f64,
    /// Curve F between s0 and sc.
    pub curve: SofteningCurve,
}

/// Shape of the decrease of a bond's force between the stretches s0 and sc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SofteningCurve {
    /// Two straight lines that meet at the stretch `kink`, where the force is `kink_force` times the
    /// force at s0.
    Lines {
        /// The stretch s0 + γ (sc − s0).
        kink: f64,
        /// The factor β.
        kink_force: f64,
    },
    /// Exponential decrease.
    Exponential {
        /// Decay stretch a.
        decay: f64,
    },
}

/// Residual r of the exponential curve: the value of exp(−(κ − s0)/a) at κ = sc.
const RESIDUAL: f64 = 0.01;

/// Ratio (sc − s0)/a = ln(1/r), with the decay stretch a.
const DECAYS: f64 = 4.605_170_185_988_092;

/// β and γ of the bilinear curve: between s0 and sc, F is one straight line.
const STRAIGHT: [f64; 2] = [0.5, 0.5];

/// β and γ of concrete (Petersson 1981). Let f_t be the tensile strength and G_F the fracture energy. The
/// stress is ⅓ f_t at the crack opening 0.8 G_F/f_t. It is 0 at the crack opening 3.6 G_F/f_t.
const CONCRETE: [f64; 2] = [1.0 / 3.0, 2.0 / 9.0];

const TENSILE_STRENGTH: Key = Key {
    name: "tensile_strength",
    meaning: "tensile strength f_t in Pa, the largest stress in uniaxial tension; this or \
              `strength_stretch`",
    kind: ABOVE_ZERO,
};

const STRENGTH_STRETCH: Key = Key {
    name: "strength_stretch",
    meaning: "stretch s0 at which a bond begins to soften",
    kind: ABOVE_ZERO,
};

const FRACTURE_ENERGY: Key = Key {
    name: "fracture_energy",
    meaning: "fracture energy G_F in J/m², the energy that breaks all bonds across a unit area; \
              this or `critical_stretch`",
    kind: ABOVE_ZERO,
};

const CRITICAL_STRETCH: Key = Key {
    name: "critical_stretch",
    meaning: "stretch s_c at which the force of a bond reaches 0 and the bond breaks",
    kind: ABOVE_ZERO,
};

const CURVE: Key = Key {
    name: "curve",
    meaning: "shape of the softening curve between s0 and s_c: one line, two lines, or an \
              exponential",
    kind: Kind::Word(&[
        Word::new("bilinear"),
        Word::new("trilinear"),
        Word::new("exponential"),
    ]),
};

const KINK_FORCE: Key = Key {
    name: "kink_force",
    meaning: "β of \"trilinear\": force at the kink divided by the largest force; 1/3 if not \
              given",
    kind: BELOW_ONE,
};

const KINK_STRETCH: Key = Key {
    name: "kink_stretch",
    meaning: "γ of \"trilinear\": position of the kink between s0 and s_c, as a fraction; 2/9 if \
              not given",
    kind: BELOW_ONE,
};

const ABOVE_ZERO: Kind = Kind::Optional {
    range: f64::MIN_POSITIVE..f64::INFINITY,
    words: "above 0",
};

const BELOW_ONE: Kind = Kind::Optional {
    range: f64::MIN_POSITIVE..1.0,
    words: "above 0 and below 1",
};

impl Declared for SofteningPmb {
    const DECLARATIONS: &'static [Declaration] = &[Declaration {
        keys: &[
            TENSILE_STRENGTH,
            STRENGTH_STRETCH,
            FRACTURE_ENERGY,
            CRITICAL_STRETCH,
            CURVE,
            KINK_FORCE,
            KINK_STRETCH,
        ],
        invariants: |_| Invariants {
            conservative: false,
            ..Invariants::ALL
        },
        fault: Some(fault),
        own_critical_stretch: Some(|given| stretches(given).1),
        horizon_fault: Some(horizon_fault),
        examples: &[
            "strength_stretch = 0.02, critical_stretch = 0.1",
            "tensile_strength = 0.1, fracture_energy = 0.05, curve = 'trilinear'",
            "strength_stretch = 0.03, fracture_energy = 0.05, curve = 'exponential'",
        ],
        ..Declaration::new(
            "softening_pmb",
            "f = c (1 − d) s e, where d ≥ 0 follows from the largest stretch of the bond; in \
             tension the force falls from s0 to s_c, where the bond breaks",
            build,
        )
    }];
}

fn number(values: &Values, key: &Key) -> Option<f64> {
    values.get(key.name).map(|_| values.number(key.name))
}

/// Return the error if the keys are inconsistent. Exactly one of `tensile_strength` and `strength_stretch`
/// must be given, and exactly one of `fracture_energy` and `critical_stretch`. Only the curve `trilinear`
/// allows kink keys.
fn fault(values: &Values, _: Dimension) -> Option<LawFault> {
    for [first, second] in [
        [&TENSILE_STRENGTH, &STRENGTH_STRETCH],
        [&FRACTURE_ENERGY, &CRITICAL_STRETCH],
    ] {
        let (key, message) = match [first, second].map(|key| number(values, key).is_some()) {
            [true, true] => {
                let message = format!(
                    "`{}` is given already; give either `{}` or `{}`",
                    first.name, first.name, second.name
                );
                (Some(second.name), message)
            }
            [false, false] => {
                let message = format!("needs `{}` or `{}`", first.name, second.name);
                (None, message)
            }
            _ => continue,
        };
        return Some(LawFault { key, message });
    }
    let kinks = [KINK_FORCE, KINK_STRETCH];
    let kink = kinks.iter().find(|key| number(values, key).is_some())?;
    (values.word(CURVE.name) != "trilinear").then(|| LawFault {
        key: Some(kink.name),
        message: "is for `curve = \"trilinear\"`".to_owned(),
    })
}

/// Return β and γ of a bilinear or trilinear curve.
fn kink(values: &Values) -> [f64; 2] {
    if values.word(CURVE.name) == "bilinear" {
        return STRAIGHT;
    }
    let [force, stretch] = CONCRETE;
    [
        number(values, &KINK_FORCE).unwrap_or(force),
        number(values, &KINK_STRETCH).unwrap_or(stretch),
    ]
}

/// Return ∫ F dκ from s0 to sc, divided by s0 (sc − s0).
fn fullness(values: &Values) -> f64 {
    if values.word(CURVE.name) == "exponential" {
        1.0 / DECAYS - RESIDUAL / (1.0 - RESIDUAL)
    } else {
        let [force, stretch] = kink(values);
        0.5 * (force + stretch)
    }
}

/// Return the ratio of stress to strain in uniaxial tension, Pa. It depends on Poisson's ratio only in plane
/// strain and under uniaxial strain. In these two cases, Poisson's ratio of this law is 1/4.
fn tensile_modulus(given: &Given) -> f64 {
    let elastic = Isotropic {
        poisson_ratio: 0.25,
        ..given.elastic
    };
    CriticalStretch::tensile_modulus(given.dimension, elastic)
}

/// Return sc: the value in the deck, or the value that follows from the fracture energy and s0. `strength` is
/// s0.
fn critical_stretch(given: &Given, strength: f64) -> f64 {
    let values = given.values;
    number(values, &CRITICAL_STRETCH).unwrap_or_else(|| {
        let energy = values.number(FRACTURE_ENERGY.name);
        let elastic = bond_based_critical_stretch(given, energy);
        let softening = 0.5 * (elastic * elastic - strength * strength);
        strength + softening / (strength * fullness(values))
    })
}

/// Number of iterations that compute s0 from f_t. For a given s0, the largest stress in uniaxial tension
/// depends only weakly on sc/s0. Therefore each iteration gains more than half a digit of s0.
const STRENGTH_ITERATIONS: u32 = 8;

/// Return s0 and sc from the keys of the deck. sc is above s0 only if the keys give a valid softening curve.
fn stretches(given: &Given) -> (f64, f64) {
    let values = given.values;
    if let Some(strength) = number(values, &STRENGTH_STRETCH) {
        return (strength, critical_stretch(given, strength));
    }
    let first = values.number(TENSILE_STRENGTH.name) / tensile_modulus(given);
    let mut strength = first;
    for _ in 0..STRENGTH_ITERATIONS {
        let critical = critical_stretch(given, strength);
        if critical <= strength {
            break;
        }
        let unit = SofteningPmb {
            elastic: Pmb { micromodulus: 1.0 },
            strength_stretch: 1.0,
            critical_stretch: critical / strength,
            curve: curve(values, 1.0, critical / strength),
        };
        strength = first / unit.largest_tension(given.dimension);
    }
    (strength, critical_stretch(given, strength))
}

/// Create the curve F between s0 and sc. `strength` is s0, and `critical` is sc.
fn curve(values: &Values, strength: f64, critical: f64) -> SofteningCurve {
    let falls = critical - strength;
    if values.word(CURVE.name) == "exponential" {
        return SofteningCurve::Exponential {
            decay: falls / DECAYS,
        };
    }
    let [kink_force, kink_stretch] = kink(values);
    SofteningCurve::Lines {
        kink: strength + kink_stretch * falls,
        kink_force,
    }
}

/// Format a number with four significant digits.
fn rounded(number: f64) -> String {
    let digits = format!("{number:.3e}");
    digits.parse().map_or(digits, format_number)
}

/// Return the error message if sc is not above s0. Bonds would then break before they soften. A possible
/// cause is a long horizon: the energy that the bonds store at s0 then exceeds the fracture energy.
fn horizon_fault(given: &Given) -> Option<String> {
    let (strength, critical) = stretches(given);
    if critical > strength {
        return None;
    }
    let values = given.values;
    Some(match number(values, &FRACTURE_ENERGY) {
        Some(energy) => {
            let elastic = bond_based_critical_stretch(given, energy);
            let held = (strength / elastic).powi(2);
            let stored = rounded(energy * held);
            format!(
                "`fracture_energy` must be above {stored} J/m², is {} J/m²; with the horizon of {} m, bonds already store \
                 {stored} J/m² when they begin to soften; use a horizon below {} m",
                format_number(energy),
                format_number(given.horizon),
                rounded(given.horizon / held),
            )
        }
        None => format!(
            "`critical_stretch`, {}, must be above the stretch at which bonds begin to soften, {}",
            format_number(critical),
            format_number(strength)
        ),
    })
}

fn build(given: &Given) -> Built {
    let (strength_stretch, critical_stretch) = stretches(given);
    Built::plain(SofteningPmb {
        elastic: Pmb::of(given),
        strength_stretch,
        critical_stretch,
        curve: curve(given.values, strength_stretch, critical_stretch),
    })
}

/// Number of bond directions in the quadrature of the stress. The directions lie between the axis of tension
/// and the plane normal to this axis.
const DIRECTIONS: usize = 64;

/// Strain of a sample, divided by the strain of the previous sample, in the search for the largest stress.
const STRAIN_GROWTH: f64 = 1.02;

/// The search for the largest stress ends when the stress is below this fraction of the largest stress so
/// far.
const PAST_LARGEST: f64 = 0.95;

/// Largest number of samples in the search for the largest stress.
const MOST_STRAINS: usize = 400;

/// Number of bisection steps for the transverse strain.
const ACROSS_ITERATIONS: usize = 25;

impl SofteningPmb {
    /// Return F on first loading to `stretch`. In compression, return `stretch` itself.
    fn first_loading(&self, stretch: Lanes) -> Lanes {
        let zero = Lanes::splat(0.0);
        let pulled = stretch.max(zero);
        pulled * self.secant(pulled) + stretch.min(zero)
    }

    /// Return the largest stress of a homogeneous body in uniaxial tension, divided by the elastic stress of
    /// this body at the axial strain s0.
    pub fn largest_tension(&self, dimension: Dimension) -> f64 {
        let in_space = match dimension {
            Dimension::Line { .. } => return 1.0,
            Dimension::PlaneStress { .. } | Dimension::PlaneStrain { .. } => false,
            Dimension::Space => true,
        };
        // cos² and sin² of the angle between bond and axis, and the weight of the direction in the
        // quadrature.
        let directions: [[Lanes; 3]; DIRECTIONS / WIDTH] = std::array::from_fn(|group| {
            let angle = |lane: usize| {
                let middle = (WIDTH * group + lane) as f64 + 0.5;
                middle / DIRECTIONS as f64 * FRAC_PI_2
            };
            let lanes = |of: fn(f64) -> f64| Lanes(std::array::from_fn(|lane| of(angle(lane))));
            let weight = if in_space {
                lanes(libm::sin)
            } else {
                Lanes::splat(1.0)
            };
            let (cos, sin) = (lanes(libm::cos), lanes(libm::sin));
            [cos * cos, sin * sin, weight]
        });
        // Axial and transverse stress, both without a constant factor, from the axial and the transverse
        // strain.
        let stress = |along: f64, across: f64| {
            let mut sums = [Lanes::splat(0.0); 2];
            for [cos2, sin2, weight] in directions {
                let force = self.first_loading(cos2 * along + sin2 * across) * weight;
                sums[0] += force * cos2;
                sums[1] += force * sin2;
            }
            sums.map(Lanes::sum)
        };
        let free_across = |along: f64| {
            // The transverse stress is compressive at the transverse strain −along, and tensile at 0.
            let (mut low, mut high) = (-along, 0.0);
            for _ in 0..ACROSS_ITERATIONS {
                let middle = 0.5 * (low + high);
                if stress(along, middle)[1] > 0.0 {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            stress(along, 0.5 * (low + high))[0]
        };
        let elastic = free_across(self.strength_stretch);
        let (mut strain, mut largest) = (self.strength_stretch, elastic);
        for _ in 0..MOST_STRAINS {
            strain *= STRAIN_GROWTH;
            let now = free_across(strain);
            largest = largest.max(now);
            if now < PAST_LARGEST * largest {
                break;
            }
        }
        largest / elastic
    }
}

impl Described for SofteningPmb {
    fn described(&self) -> Vec<(&'static str, Property)> {
        let mut facts = self.elastic.described();
        facts.push((
            "strength stretch",
            Property::Number(self.strength_stretch, ""),
        ));
        facts
    }
}

impl SofteningPmb {
    /// Clamp the largest past stretches κ to the range from s0 to sc.
    #[inline(always)]
    fn in_softening(&self, largest: Lanes) -> Lanes {
        largest
            .max(Lanes::splat(self.strength_stretch))
            .min(Lanes::splat(self.critical_stretch))
    }

    /// Return (stretch − `from`)/(`to` − `from`), clamped to the range from 0 to 1.
    #[inline(always)]
    fn way(stretch: Lanes, from: f64, to: f64) -> Lanes {
        let way = (stretch - Lanes::splat(from)) * (1.0 / (to - from));
        way.max(Lanes::splat(0.0)).min(Lanes::splat(1.0))
    }

    /// Return F(κ)/s0. `largest` are the largest past stretches κ, which must lie between s0 and sc.
    #[inline(always)]
    fn relative_force(&self, largest: Lanes) -> Lanes {
        let one = Lanes::splat(1.0);
        match self.curve {
            SofteningCurve::Lines { kink, kink_force } => {
                let first = Self::way(largest, self.strength_stretch, kink);
                let second = Self::way(largest, kink, self.critical_stretch);
                (one - first) * (1.0 - kink_force) + (one - second) * kink_force
            }
            SofteningCurve::Exponential { decay } => {
                let decays = (Lanes::splat(self.strength_stretch) - largest) * (1.0 / decay);
                let force = (decays.exp() - Lanes::splat(RESIDUAL)) * (1.0 / (1.0 - RESIDUAL));
                force.max(Lanes::splat(0.0)).min(one)
            }
        }
    }

    /// Return ∫ F dκ from s0 to the largest past stretch of each bond, divided by s0. The largest past
    /// stretches must be between s0 and sc.
    #[inline(always)]
    fn relative_area(&self, largest: Lanes) -> Lanes {
        let one = Lanes::splat(1.0);
        match self.curve {
            SofteningCurve::Lines { kink, kink_force } => {
                let first = Self::way(largest, self.strength_stretch, kink);
                let second = Self::way(largest, kink, self.critical_stretch);
                let to_kink = first * (one - first * (0.5 * (1.0 - kink_force)));
                let to_end = second * (one - second * 0.5);
                to_kink * (kink - self.strength_stretch)
                    + to_end * (kink_force * (self.critical_stretch - kink))
            }
            SofteningCurve::Exponential { decay } => {
                let decays = (largest - Lanes::splat(self.strength_stretch)) * (1.0 / decay);
                let whole = one - (decays * -1.0).exp() - decays * RESIDUAL;
                whole * (decay / (1.0 - RESIDUAL))
            }
        }
    }

    /// Return 1 − d of bonds with these largest past stretches κ.
    #[inline(always)]
    fn secant(&self, largest: Lanes) -> Lanes {
        if largest.above(self.strength_stretch) == 0 {
            return Lanes::splat(1.0);
        }
        let largest = self.in_softening(largest);
        self.relative_force(largest) * self.strength_stretch / largest
    }
}

impl<const D: usize> Law<D> for SofteningPmb {
    type Point = [Lanes; 0];
    /// Largest past stretch κ.
    type BondHistory = [Lanes; 1];
    type ReferenceSum = [Lanes; 0];
    type Sum = [Lanes; 0];
    type Force = Along;
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const FORCE_READS_STRETCH: bool = true;
    const SOFTENS: bool = true;

    #[inline(always)]
    fn bond_history(
        &self,
        bond: &Bond<D>,
        _: &[Lanes; 0],
        [before]: &[Lanes; 1],
        _: f64,
    ) -> [Lanes; 1] {
        [bond.stretch.max(*before)]
    }

    #[inline(always)]
    fn force_state(&self, bond: &Bond<D>, _: &[Lanes; 0], [largest]: &[Lanes; 1]) -> Along {
        let (zero, extension) = (Lanes::splat(0.0), bond.extension_over_deformed);
        let elastic = extension.max(zero) * self.secant(*largest) + extension.min(zero);
        Along(elastic * (bond.inverse * (0.5 * self.elastic.micromodulus)))
    }

    #[inline(always)]
    fn bond_energy(&self, bond: &Bond<D>, _: &[Lanes; 0], [largest]: &[Lanes; 1]) -> Lanes {
        let zero = Lanes::splat(0.0);
        let (pulled, pushed) = (bond.stretch.max(zero), bond.stretch.min(zero));
        let squares = pulled * pulled * self.secant(*largest) + pushed * pushed;
        squares * bond.length * (0.25 * self.elastic.micromodulus)
    }

    /// Return the work that stretches a bond to κ, minus the work that the bond returns when it unloads
    /// from κ.
    #[inline(always)]
    fn dissipated(&self, length: Lanes, [largest]: &[Lanes; 1]) -> Lanes {
        if largest.above(self.strength_stretch) == 0 {
            return Lanes::splat(0.0);
        }
        let strength = self.strength_stretch;
        let largest = self.in_softening(*largest);
        let work = self.relative_area(largest) + Lanes::splat(0.5 * strength);
        let stored = self.relative_force(largest) * largest * 0.5;
        (work - stored) * length * (0.5 * self.elastic.micromodulus * strength)
    }

    #[inline(always)]
    fn lost_stiffness(&self, [largest]: &[Lanes; 1]) -> Lanes {
        Lanes::splat(1.0) - self.secant(*largest)
    }

    #[inline(always)]
    fn stiffness(&self, bond: &Bond<D>, end: &[Lanes; 0]) -> Lanes {
        Law::<D>::stiffness(&self.elastic, bond, end)
    }
}
