//! Ticks at round numbers, and units with SI prefixes.

/// A tick of a scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Tick {
    /// Position from 0 (low end) to 1 (high end).
    pub fraction: f64,
    /// Text of the number at the tick.
    pub label: String,
}

/// Ticks between two numbers, and the unit of their labels.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// The ticks from low to high.
    pub ticks: Vec<Tick>,
    /// The unit, with prefix or power of ten; may be empty.
    pub unit: String,
}

impl Scale {
    /// Create a scale from `low` to `high` with at most `most_intervals + 1` ticks. `unit` is the unit of
    /// both numbers.
    ///
    /// The prefix of the unit suits numbers up to `magnitude`. For scales that belong together, pass the same
    /// `magnitude`. Their units then have the same prefix.
    pub fn new(low: f64, high: f64, unit: &str, magnitude: f64, most_intervals: usize) -> Self {
        let (exponent, unit) = prefixed(unit, magnitude);
        let factor = 10_f64.powi(-exponent);
        let (step, ticks) = round_numbers(low * factor, high * factor, most_intervals);
        let decimals = decimals_of(step);
        let ticks = ticks
            .into_iter()
            .map(|number| Tick {
                fraction: (number / factor - low) / (high - low),
                label: format!("{number:.decimals$}").replace('-', "−"),
            })
            .collect();
        Self { ticks, unit }
    }

    /// Create a logarithmic scale from `low` to `high`, both above 0.
    ///
    /// If the range contains three or more powers of ten, the ticks are at powers of ten, and there are at
    /// most max(`most_intervals`, 2) ticks. Otherwise, the ticks are at 1, 2 and 5 times powers of ten. If
    /// the range contains fewer than two of these numbers, the ticks are at round numbers instead, and there
    /// are at most `most_intervals + 1` ticks.
    pub fn logarithmic(low: f64, high: f64, unit: &str, most_intervals: usize) -> Self {
        let (exponent, unit) = prefixed(unit, high);
        let factor = 10_f64.powi(-exponent);
        let decades = |decade: f64| (decade.log10() - 1e-9).ceil() as i32;
        let (first, end) = (decades(low * factor), decades(high * factor * (1.0 + 1e-8)));
        let fraction = |number: f64| (number / factor / low).ln() / (high / low).ln();
        let inside = |number: &f64| (-1e-9..=1.0 + 1e-9).contains(&fraction(*number));
        let powers = (end - first).max(0) as usize;
        let ticks: Vec<Tick> = if powers >= 3 {
            let stride = powers.div_ceil(most_intervals.max(2));
            let powers = (first..end).rev().step_by(stride).collect::<Vec<i32>>();
            let plain = powers.iter().all(|power| (-3..=4).contains(power));
            let tick = |power: &i32| Tick {
                fraction: fraction(10_f64.powi(*power)),
                label: if plain {
                    format!("{:.*}", (-power).max(0) as usize, 10_f64.powi(*power))
                } else {
                    format!("10{}", superscript(*power))
                },
            };
            powers.iter().rev().map(tick).collect()
        } else {
            let digits = (first - 1..=end)
                .flat_map(|power| [1.0, 2.0, 5.0].map(|digit| (digit * 10_f64.powi(power), power)));
            let digits: Vec<(f64, i32)> = digits.filter(|(number, _)| inside(number)).collect();
            if digits.len() < 2 {
                let (step, numbers) = round_numbers(low * factor, high * factor, most_intervals);
                let decimals = decimals_of(step);
                let tick = |number: f64| Tick {
                    fraction: fraction(number),
                    label: format!("{number:.decimals$}"),
                };
                numbers.into_iter().map(tick).collect()
            } else {
                let tick = |(number, power): (f64, i32)| Tick {
                    fraction: fraction(number),
                    label: format!("{number:.*}", (-power).max(0) as usize),
                };
                digits.into_iter().map(tick).collect()
            }
        };
        Self { ticks, unit }
    }

    /// Return the name of a quantity, followed by the unit in parentheses if there is a unit.
    pub fn caption(&self, name: &str) -> String {
        if self.unit.is_empty() {
            name.to_owned()
        } else {
            format!("{name} ({})", self.unit)
        }
    }
}

/// Return the number of decimals that multiples of a step need.
fn decimals_of(step: f64) -> usize {
    (-step.log10() - 1e-9).ceil().clamp(0.0, 12.0) as usize
}

/// Return a step of 1, 2 or 5 times a power of ten, and the multiples of the step within `low..=high`. There
/// are at most `most_intervals + 1` multiples; none if `low` is not below `high`.
pub fn round_numbers(low: f64, high: f64, most_intervals: usize) -> (f64, Vec<f64>) {
    let coarse = (high - low) / most_intervals.max(1) as f64;
    if !(coarse.is_finite() && coarse > 0.0) {
        return (1.0, Vec::new());
    }
    let power = 10_f64.powi(coarse.log10().floor() as i32);
    let step = [1.0, 2.0, 5.0, 10.0]
        .map(|digit| digit * power)
        .into_iter()
        .find(|step| *step >= coarse * (1.0 - 1e-9))
        .unwrap_or(10.0 * power);
    let first = (low / step - 1e-6).ceil();
    let last = (high / step + 1e-6).floor();
    let count = (last - first + 1.0).clamp(0.0, most_intervals as f64 + 1.0) as usize;
    // Adding 0 replaces −0 by 0.
    let numbers = (0..count).map(|index| (first + index as f64) * step + 0.0);
    (step, numbers.collect())
}

/// SI prefixes with their powers of ten.
const PREFIXES: [(i32, &str); 10] = [
    (-15, "f"),
    (-12, "p"),
    (-9, "n"),
    (-6, "µ"),
    (-3, "m"),
    (0, ""),
    (3, "k"),
    (6, "M"),
    (9, "G"),
    (12, "T"),
];

/// Unit symbols that take a prefix. Other symbols have a prefix already (kg, MPa) or take none (°C, %).
const PREFIXABLE: [&str; 9] = ["m", "s", "N", "Pa", "J", "W", "V", "A", "Hz"];

/// Largest absolute value of the exponent that [`prefixed`] returns. Its power of ten, and the inverse of
/// this power, are normal numbers.
const LARGEST_EXPONENT: i32 = 306;

/// Choose a power of ten for numbers up to `magnitude`. Return its exponent, and the unit with this power.
/// The power becomes a prefix, as in "MPa". If the unit takes no prefix, or if there is no such prefix in
/// [`PREFIXES`], the power becomes a factor, as in "×10⁻³ m²" or "×10¹⁸ Pa". A unit that takes no prefix
/// stays as it is if `magnitude` is from 0.01 to 10⁴.
pub fn prefixed(unit: &str, magnitude: f64) -> (i32, String) {
    let size = magnitude.abs();
    if !(size.is_finite() && size > 0.0) {
        return (0, unit.to_owned());
    }
    let exponent = 3 * ((size.log10() + 1e-9) / 3.0).floor() as i32;
    let exponent = exponent.clamp(-LARGEST_EXPONENT, LARGEST_EXPONENT);
    let prefix = PREFIXES.iter().find(|(power, _)| *power == exponent);
    let is_prefixable = takes_prefix(unit);
    match prefix {
        Some((_, prefix)) if is_prefixable => (exponent, format!("{prefix}{unit}")),
        _ if !is_prefixable && (0.01..1e4).contains(&size) => (0, unit.to_owned()),
        _ => {
            let factor = format!("×10{} {unit}", superscript(exponent));
            (exponent, factor.trim_end().to_owned())
        }
    }
}

/// Test whether a prefix scales the whole unit: true for "m/s", false for "m²", because 1 mm² is 10⁻⁶ m².
pub fn takes_prefix(unit: &str) -> bool {
    let end = unit
        .find(|character: char| !character.is_ascii_alphabetic())
        .unwrap_or(unit.len());
    let (symbol, rest) = unit.split_at(end);
    PREFIXABLE.contains(&symbol) && (rest.is_empty() || rest.starts_with(['/', '·', ' ', '*']))
}

fn superscript(number: i32) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    number
        .to_string()
        .chars()
        .map(|character| match character.to_digit(10) {
            Some(digit) => RAISED[digit as usize],
            None => '⁻',
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64, unit: &str, most_intervals: usize) -> (Vec<String>, String) {
        let magnitude = low.abs().max(high.abs());
        let scale = Scale::new(low, high, unit, magnitude, most_intervals);
        let labels = scale.ticks.into_iter().map(|tick| tick.label).collect();
        (labels, scale.unit)
    }

    #[test]
    fn ticks_are_round_numbers_inside_the_range() {
        assert_eq!(
            round_numbers(0.0, 1.0, 5),
            (0.2, vec![0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0])
        );
        assert_eq!(round_numbers(-3.0, 7.0, 4), (5.0, vec![0.0, 5.0]));
        assert_eq!(round_numbers(2.0, 2.0, 4).1, Vec::<f64>::new());
        assert_eq!(round_numbers(f64::NAN, 2.0, 4).1, Vec::<f64>::new());
        for exponent in -20..20 {
            let high = 7.3 * 10_f64.powi(exponent);
            for most_intervals in 2..12 {
                let (step, ticks) = round_numbers(-high, high, most_intervals);
                assert!(ticks.len() > most_intervals / 3 && ticks.len() <= most_intervals + 1);
                assert!(ticks.iter().all(|tick| tick.abs() <= high));
                let steps = ticks.windows(2).map(|pair| (pair[1] - pair[0]) / step);
                assert!(steps.into_iter().all(|ratio| (ratio - 1.0).abs() < 1e-9));
            }
        }
    }

    #[test]
    fn labels_are_in_prefixed_units_with_the_decimals_they_need() {
        let (numbers, unit) = labels(-0.01, 0.11, "m", 6);
        assert_eq!(numbers, ["0", "20", "40", "60", "80", "100"]);
        assert_eq!(unit, "mm");
        let (numbers, unit) = labels(-1.5e-6, 1.5e-6, "m", 3);
        assert_eq!(numbers, ["−1", "0", "1"]);
        assert_eq!(unit, "µm");
        let (numbers, unit) = labels(0.0, 0.6, "", 4);
        assert_eq!(numbers, ["0.0", "0.2", "0.4", "0.6"]);
        assert_eq!(unit, "");
        assert_eq!(labels(0.0, 2.5e9, "Pa", 3).1, "GPa");
        let (numbers, unit) = labels(-1e300, 1e300, "Pa", 3);
        assert_eq!(numbers, ["−1", "0", "1"]);
        assert_eq!(unit, "×10³⁰⁰ Pa");
    }

    #[test]
    fn logarithmic_ticks_are_at_powers_of_ten() {
        let scale = |low, high, most_intervals| {
            let scale = Scale::logarithmic(low, high, "Pa", most_intervals);
            for tick in &scale.ticks {
                assert!((-1e-6..=1.0 + 1e-6).contains(&tick.fraction), "{tick:?}");
            }
            let labels = scale.ticks.iter().map(|tick| tick.label.as_str());
            (labels.collect::<Vec<_>>().join(" "), scale.unit)
        };
        let (labels, unit) = scale(1e3, 1e7, 8);
        assert_eq!((&labels[..], &unit[..]), ("0.001 0.01 0.1 1 10", "MPa"));
        assert_eq!(scale(3e-9, 2e8, 6).0, "10⁻¹³ 10⁻¹⁰ 10⁻⁷ 10⁻⁴ 10⁻¹ 10²");
        assert_eq!(scale(1.0, 100.0, 8).0, "1 10 100");
        assert_eq!(scale(30.0, 600.0, 8).0, "50 100 200 500");
        assert_eq!(
            scale(0.03, 0.6, 8),
            ("50 100 200 500".to_owned(), "mPa".to_owned())
        );
        assert_eq!(scale(21.0, 24.0, 4).0, "21 22 23 24");
        let middle = Scale::logarithmic(1.0, 1e4, "Pa", 8).ticks;
        assert!((middle[2].fraction - 0.5).abs() < 1e-12);
    }

    #[test]
    fn prefixes_suit_the_unit() {
        assert_eq!(prefixed("m", 1.0), (0, "m".to_owned()));
        assert_eq!(prefixed("m", 0.001), (-3, "mm".to_owned()));
        assert_eq!(prefixed("m", 1000.0), (3, "km".to_owned()));
        assert_eq!(prefixed("Pa", 3.2e7), (6, "MPa".to_owned()));
        assert_eq!(prefixed("J/m³", 4.0e4), (3, "kJ/m³".to_owned()));
        assert_eq!(prefixed("m²", 2.0e-5), (-6, "×10⁻⁶ m²".to_owned()));
        assert_eq!(prefixed("", 5.0e-3), (-3, "×10⁻³".to_owned()));
        assert_eq!(prefixed("MPa", 50.0), (0, "MPa".to_owned()));
        assert_eq!(prefixed("m", 0.0), (0, "m".to_owned()));
        assert_eq!(prefixed("m", 2e-15), (-15, "fm".to_owned()));
        assert_eq!(prefixed("Pa", 5e14), (12, "TPa".to_owned()));
        assert_eq!(prefixed("m", 1e-30), (-30, "×10⁻³⁰ m".to_owned()));
        assert_eq!(prefixed("N/m³", 5e17), (15, "×10¹⁵ N/m³".to_owned()));
        assert_eq!(prefixed("Pa", 2e-310), (-306, "×10⁻³⁰⁶ Pa".to_owned()));
    }

    #[test]
    fn captions_name_the_unit_only_if_there_is_one() {
        let scale = |unit| Scale::new(0.0, 1.0, unit, 1.0, 5);
        assert_eq!(scale("m").caption("x"), "x (m)");
        assert_eq!(scale("").caption("damage"), "damage");
    }
}
