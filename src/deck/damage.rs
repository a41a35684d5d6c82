//! Validation of the damage laws of a deck.

use super::grammar::{self, Text};
use super::number::{Number, Vector};
use super::resolve::Scope;
use super::sets::find_sets;
use crate::deck::spanned::Spanned;
use crate::error::Result;
use crate::message::format_number;
use crate::problem::{
    self, BreakableBonds, Calibration, DamageRule, StressMeasure, StressRule, Toughness,
    ToughnessByDirection, WorkMeasure, WorkRule,
};
use crate::scatter::Weibull;

/// A measure of toughness: its key, its value in the deck, and the constructor of [`Toughness`].
type Measure<'a> = (&'a str, &'a Option<Number>, fn(f64) -> Toughness);

/// Validate a damage law.
///
/// # Errors
/// On an invalid number, an unknown set, or a table that does not give exactly one measure of toughness. On a
/// calibration or a toughness by direction that is not available in this dimension. On a toughness by
/// direction with only some of its three keys, and on a seed without `weibull_modulus`.
pub fn damage(
    scope: &Scope,
    sets: &[problem::Set],
    name: &str,
    table: &Spanned<grammar::Damage>,
) -> Result<problem::Damage> {
    match table.get_ref() {
        grammar::Damage::CriticalStretch(spanned) => {
            let law = spanned.get_ref();
            let key = format!("[damage.{name}.critical_stretch]");
            let stretch: Measure = (
                "critical_stretch",
                &law.critical_stretch,
                Toughness::CriticalStretch,
            );
            let directed = Directed {
                along: &law.fracture_energy_along,
                across: &law.fracture_energy_across,
                direction: &law.direction,
            };
            let [energy, toughness] = of_crack(&law.fracture_energy, &law.fracture_toughness);
            let all = [energy, toughness, directed.measure(), stretch];
            Ok(problem::Damage {
                rule: DamageRule::CriticalStretch,
                toughness: measure(scope, spanned, &key, &all)?,
                alpha: alpha(scope, &law.alpha, &key)?,
                weibull: weibull(scope, &law.weibull_modulus, &law.seed, &key)?,
                direction: directed.toughness(scope, &key)?,
                no_failure: no_failure(scope, sets, &law.no_failure, &key)?,
            })
        }
        grammar::Damage::Energy(spanned) => {
            let law = spanned.get_ref();
            let key = format!("[damage.{name}.energy]");
            let directed = Directed {
                along: &law.fracture_energy_along,
                across: &law.fracture_energy_across,
                direction: &law.direction,
            };
            let [energy, toughness] = of_crack(&law.fracture_energy, &law.fracture_toughness);
            let all = [energy, toughness, directed.measure()];
            let calibration = match law.calibration.get_ref() {
                grammar::Calibration::Energy => Calibration::Energy,
                grammar::Calibration::Opening => Calibration::Opening(None),
                grammar::Calibration::Willberg2022 => Calibration::Willberg2022,
                grammar::Calibration::Perilab => Calibration::PeriLab,
                grammar::Calibration::Peridigm2021 => Calibration::Peridigm2021,
            };
            if !calibration.is_for(scope.dimension) {
                let message = format!(
                    "{key} calibration: this formula is known only for {}; use `energy`, `opening` or `willberg2022`",
                    match calibration {
                        Calibration::Peridigm2021 => "plane problems",
                        _ => "plane problems and 3-D",
                    }
                );
                return Err(scope.error(law.calibration.span(), message));
            }
            let work = WorkRule {
                breakable: breakable(law.tension_only),
                family_correction: family_correction(scope, &law.family_correction, &key)?,
                measure: match calibration {
                    Calibration::Willberg2022
                    | Calibration::PeriLab
                    | Calibration::Peridigm2021 => WorkMeasure::Displacement,
                    Calibration::Energy | Calibration::Opening(_) => WorkMeasure::Objective,
                },
            };
            Ok(problem::Damage {
                rule: DamageRule::Energy { calibration, work },
                toughness: measure(scope, spanned, &key, &all)?,
                alpha: alpha(scope, &law.alpha, &key)?,
                weibull: weibull(scope, &law.weibull_modulus, &law.seed, &key)?,
                direction: directed.toughness(scope, &key)?,
                no_failure: no_failure(scope, sets, &law.no_failure, &key)?,
            })
        }
        grammar::Damage::Stress(spanned) => {
            let law = spanned.get_ref();
            let key = format!("[damage.{name}.stress]");
            let rule = StressRule {
                measure: match law.measure {
                    grammar::StressMeasure::VonMises => StressMeasure::VonMises,
                    grammar::StressMeasure::Principal => StressMeasure::Principal,
                },
                breakable: breakable(law.tension_only),
            };
            let strength = scope.positive(&law.strength, &format!("{key} strength"))?;
            Ok(problem::Damage {
                rule: DamageRule::Stress(rule),
                toughness: Toughness::Strength(strength),
                alpha: 0.0,
                weibull: weibull(scope, &law.weibull_modulus, &law.seed, &key)?,
                direction: None,
                no_failure: no_failure(scope, sets, &law.no_failure, &key)?,
            })
        }
    }
}

fn breakable(tension_only: bool) -> BreakableBonds {
    if tension_only {
        BreakableBonds::Stretched
    } else {
        BreakableBonds::Any
    }
}

/// Keys of a fracture energy that depends on the direction of a crack.
struct Directed<'a> {
    along: &'a Option<Number>,
    across: &'a Option<Number>,
    direction: &'a Option<Vector>,
}

impl<'a> Directed<'a> {
    fn measure(&self) -> Measure<'a> {
        (
            "fracture_energy_along",
            self.along,
            Toughness::FractureEnergy,
        )
    }

    /// Return the toughness by direction; `None` if the table has none of the three keys of `Directed`.
    /// Return an error if the table has only some of these keys, if the problem is 1-D, or if the ratio of
    /// the two fracture energies is out of range.
    fn toughness(&self, scope: &Scope, key: &str) -> Result<Option<ToughnessByDirection>> {
        let across = self.across.as_ref();
        let given = [
            (
                "fracture_energy_along",
                self.along.as_ref().map(Spanned::span),
            ),
            ("fracture_energy_across", across.map(Spanned::span)),
            ("direction", self.direction.as_ref().map(Spanned::span)),
        ];
        let first = given
            .iter()
            .find_map(|(name, span)| Some((*name, span.clone()?)));
        let Some((name, span)) = first else {
            return Ok(None);
        };
        let (Some(along), Some(across), Some(direction)) = (self.along, across, self.direction)
        else {
            let missing = given.iter().find(|(_, span)| span.is_none());
            let missing = missing.map_or("", |(missing, _)| missing);
            let message = format!("{key} {name}: needs `{missing}` too");
            return Err(scope.error(span, message));
        };
        if scope.dimension == 1 {
            let message =
                format!("{key} {name}: cracks in a bar have one direction; give `fracture_energy`");
            return Err(scope.error(span, message));
        }
        let axis = scope.direction(direction, &format!("{key} direction"))?;
        let [along, across_value] = [
            scope.positive(along, &format!("{key} fracture_energy_along"))?,
            scope.positive(across, &format!("{key} fracture_energy_across"))?,
        ];
        let ratio = across_value / along;
        let toughness = ToughnessByDirection::new(scope.dimension, axis, ratio);
        if toughness.is_none() {
            let [least, most] = ToughnessByDirection::limits(scope.dimension);
            // Round the limits inwards, so that the printed values are allowed.
            let limits =
                [(100.0 * least).ceil(), (100.0 * most).floor()].map(|limit| limit / 100.0);
            let message = format!(
                "{key} fracture_energy_across: must be {} to {} times `fracture_energy_along`, is {} times; \
                 outside this range, bonds in the weak direction would break far from cracks",
                format_number(limits[0]),
                format_number(limits[1]),
                format_number((1e4 * ratio).round() / 1e4)
            );
            return Err(scope.error(across.span(), message));
        }
        Ok(toughness)
    }
}

/// Return the measures of toughness of a crack: fracture energy and fracture toughness.
fn of_crack<'a>(energy: &'a Option<Number>, toughness: &'a Option<Number>) -> [Measure<'a>; 2] {
    [
        ("fracture_energy", energy, Toughness::FractureEnergy),
        (
            "fracture_toughness",
            toughness,
            Toughness::FractureToughness,
        ),
    ]
}

/// Return the toughness. The table must give exactly one of the measures; otherwise, an error is returned.
fn measure<T>(
    scope: &Scope,
    table: &Spanned<T>,
    key: &str,
    measures: &[Measure<'_>],
) -> Result<Toughness> {
    let given: Vec<_> = measures
        .iter()
        .map(|(name, number, _)| (*name, number.as_ref().map(Spanned::span)))
        .collect();
    let (name, number, toughness) = measures[scope.exactly_one(table.span(), key, &given)?];
    let number = number.as_ref().expect("this measure is given");
    Ok(toughness(scope.positive(number, &format!("{key} {name}"))?))
}

fn alpha(scope: &Scope, number: &Number, key: &str) -> Result<f64> {
    let words = "at least 0 and below 1";
    scope.within(number, &format!("{key} alpha"), 0.0..1.0, words)
}

fn weibull(
    scope: &Scope,
    modulus: &Option<Number>,
    seed: &Option<Spanned<u64>>,
    key: &str,
) -> Result<Option<Weibull>> {
    let Some(modulus) = modulus else {
        return match seed {
            None => Ok(None),
            Some(seed) => {
                let message = format!("{key} seed: `seed` needs `weibull_modulus`");
                Err(scope.error(seed.span(), message))
            }
        };
    };
    let place = format!("{key} weibull_modulus");
    let modulus = scope.within(modulus, &place, 1.0..f64::INFINITY, "1 or more")?;
    let seed = match seed {
        Some(seed) => scope.whole(seed, &format!("{key} seed"))?,
        None => 0,
    };
    Ok(Some(Weibull { modulus, seed }))
}

fn family_correction(scope: &Scope, number: &Number, key: &str) -> Result<f64> {
    let (key, range) = (format!("{key} family_correction"), 0.0..1_f64.next_up());
    scope.within(number, &key, range, "0 to 1")
}

fn no_failure(
    scope: &Scope,
    sets: &[problem::Set],
    names: &[Text],
    key: &str,
) -> Result<Vec<usize>> {
    find_sets(scope, names, sets, &format!("{key} no_failure"))
}
