//! Formatting of numbers, times and sizes.

use fissure::picture::takes_prefix;

/// Values of at least this absolute value are formatted without an SI prefix.
const TOO_LARGE: f64 = 1e16;

/// Format a value with four digits and its unit. The unit has an SI prefix if it takes one, as in `50.00 µs`.
/// Without a prefix, a value below 0.01 or from 10⁴ has a power of ten, as in `4.219e-10 m^3`.
pub fn with_unit(value: f64, unit: &str) -> String {
    let text = if takes_prefix(unit) {
        si(value, unit)
    } else if value == 0.0 {
        format!("0 {unit}")
    } else if (0.01..1e4).contains(&value.abs()) {
        format!("{:.4} {unit}", Digits(value))
    } else {
        format!("{value:.3e} {unit}")
    };
    text.trim_end().to_owned()
}

/// Format a value with four digits, an SI prefix and its unit, such as `50.00 µs`. The prefix is written
/// before any unit, also before `/s`. [`with_unit`] writes a prefix only if the unit takes one.
pub fn si(value: f64, unit: &str) -> String {
    const PREFIXES: [(f64, &str); 9] = [
        (1e12, "T"),
        (1e9, "G"),
        (1e6, "M"),
        (1e3, "k"),
        (1.0, ""),
        (1e-3, "m"),
        (1e-6, "µ"),
        (1e-9, "n"),
        (1e-12, "p"),
    ];
    let size = value.abs();
    if !value.is_finite() || size >= TOO_LARGE {
        return format!("{value:.3e} {unit}");
    }
    // The factor 0.99995 allows for the rounding of the last digit: 999.96 is printed as 1.000 k, not as
    // 1000.0.
    let prefix = PREFIXES.iter().find(|(factor, _)| size >= 0.99995 * factor);
    match prefix {
        Some((factor, prefix)) => format!("{:.4} {prefix}{unit}", Digits(value / factor)),
        None if value == 0.0 => format!("0 {unit}"),
        None => format!("{value:.3e} {unit}"),
    }
}

/// A number. The precision in the format string is the number of significant digits.
struct Digits(f64);

impl std::fmt::Display for Digits {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let further = formatter.precision().unwrap_or(4).saturating_sub(1);
        // The exponent of the rounded number: 9.9996 is printed as 10.00.
        let rounded = format!("{:.further$e}", self.0);
        let exponent = rounded
            .rsplit_once('e')
            .map(|(_, exponent)| exponent.parse());
        let exponent: i32 = exponent.and_then(|exponent| exponent.ok()).unwrap_or(0);
        let places = (further as i32 - exponent).max(0) as usize;
        write!(formatter, "{:.places$}", self.0)
    }
}

/// Format a count with separators, such as `1 234 567`.
pub fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// Format a duration (s) in its two largest units, such as `3 h 20 min`. Durations below a minute are
/// formatted in seconds with an SI prefix.
pub fn duration(seconds: f64) -> String {
    const UNITS: [(f64, &str); 4] = [
        (31_557_600.0, "a"),
        (86_400.0, "d"),
        (3600.0, "h"),
        (60.0, "min"),
    ];
    let Some(k) = UNITS.iter().position(|(unit, _)| seconds >= *unit) else {
        return si(seconds, "s");
    };
    let (unit, name) = UNITS[k];
    let (smaller, smaller_name) = UNITS.get(k + 1).copied().unwrap_or((1.0, "s"));
    if seconds >= 1000.0 * unit {
        return format!("{:.1e} {name}", seconds / unit);
    }
    let whole = (seconds / unit).floor();
    let rest = ((seconds - whole * unit) / smaller).floor();
    format!("{whole} {name} {rest} {smaller_name}")
}

/// Format bytes in binary units.
pub fn bytes(value: f64) -> String {
    let units = ["B", "KiB", "MiB", "GiB", "TiB"];
    let power = (value.max(1.0).log2() / 10.0).floor().min(4.0) as usize;
    format!(
        "{:.1} {}",
        value / 1024_f64.powi(power as i32),
        units[power]
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formatted_numbers() {
        assert_eq!(si(5e-5, "s"), "50.00 µs");
        assert_eq!(si(9.99996e-4, "s"), "1.000 ms");
        assert_eq!(si(-2.5e9, "Pa"), "-2.500 GPa");
        assert_eq!(si(0.0, "J"), "0 J");
        assert_eq!(si(2e15, "Pa"), "2000 TPa");
        assert_eq!(si(-3e18, "Pa"), "-3.000e18 Pa");
        assert_eq!(si(f64::INFINITY, "J"), "inf J");
        assert_eq!(si(f64::NAN, "J"), "NaN J");
        assert_eq!(si(99.9996, "m"), "100.0 m");
        assert_eq!(count(1234567), "1 234 567");
        assert_eq!(count(12), "12");
        assert_eq!(duration(0.25), "250.0 ms");
        assert_eq!(duration(12_000.0), "3 h 20 min");
        assert_eq!(duration(61.0), "1 min 1 s");
        assert_eq!(duration(1e12), "3.2e4 a");
        assert_eq!(bytes(3.0 * 1024.0 * 1024.0), "3.0 MiB");
    }

    #[test]
    fn only_units_that_take_a_prefix_have_one() {
        assert_eq!(with_unit(-0.02107, ""), "-0.02107");
        assert_eq!(with_unit(0.1452, ""), "0.1452");
        assert_eq!(with_unit(2886.0, ""), "2886");
        assert_eq!(with_unit(0.0, ""), "0");
        assert_eq!(with_unit(4.219e-10, "m^3"), "4.219e-10 m^3");
        assert_eq!(with_unit(5e-4, "kg"), "5.000e-4 kg");
        assert_eq!(with_unit(9.9996, "K"), "10.00 K");
        assert_eq!(with_unit(4.5e4, "N/m^3"), "45.00 kN/m^3");
    }
}
