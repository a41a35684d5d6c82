//! Colour maps.

use super::canvas::Colour;

/// Colour of points without a value.
pub const NO_VALUE: Colour = [140, 142, 146];

/// A colour map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColourMap {
    /// Dark violet over green to yellow, perceptually uniform ("viridis").
    General,
    /// Light grey over orange and red to almost black: even a crack of one point's width stands out.
    Damage,
}

impl ColourMap {
    /// Return the map for a field. The name of the field selects the map, so that all pictures of a series
    /// use the same map.
    pub fn for_field(field: &str) -> Self {
        if field.to_lowercase().contains("damage") {
            Self::Damage
        } else {
            Self::General
        }
    }

    /// Return the colour at `fraction` of the way from the low to the high end. Fractions beyond an end are
    /// clamped; NaN is grey.
    pub fn colour(self, fraction: f64) -> Colour {
        if fraction.is_nan() {
            return NO_VALUE;
        }
        let fraction = fraction.clamp(0.0, 1.0);
        match self {
            Self::General => viridis(fraction),
            Self::Damage => damage(fraction),
        }
    }
}

/// Return the colour darkened to `brightness` (0 to 1), for faces turned away from the light.
pub fn shaded(colour: Colour, brightness: f64) -> Colour {
    colour.map(|channel| (f64::from(channel) * brightness).round() as u8)
}

/// Coefficients, lowest power first, of a polynomial fit to "viridis".
const VIRIDIS: [[f64; 3]; 7] = [
    [0.277_727_3, 0.005_407_3, 0.334_099_8],
    [0.105_093_0, 1.404_613_5, 1.384_590_2],
    [-0.330_861_8, 0.214_847_6, 0.095_095_2],
    [-4.634_230_5, -5.799_101_0, -19.332_441_0],
    [6.228_269_9, 14.179_933_4, 56.690_552_6],
    [4.776_385_0, -13.745_145_4, -65.353_032_6],
    [-5.435_455_9, 4.645_852_6, 26.312_435_2],
];

/// Return the colour of the "viridis" map.
fn viridis(fraction: f64) -> Colour {
    let mut colour = [0.0; 3];
    for coefficients in VIRIDIS.iter().rev() {
        for (channel, coefficient) in colour.iter_mut().zip(coefficients) {
            *channel = *channel * fraction + coefficient;
        }
    }
    colour.map(|channel| (channel * 255.0).round() as u8)
}

/// Control points of the damage map: fraction and colour.
const DAMAGE: [(f64, [f64; 3]); 6] = [
    (0.00, [222.0, 224.0, 228.0]),
    (0.12, [247.0, 204.0, 138.0]),
    (0.30, [244.0, 146.0, 58.0]),
    (0.52, [214.0, 62.0, 42.0]),
    (0.75, [146.0, 18.0, 58.0]),
    (1.00, [44.0, 6.0, 44.0]),
];

/// Return the colour of the damage map.
fn damage(fraction: f64) -> Colour {
    let upper = DAMAGE[1..DAMAGE.len() - 1]
        .iter()
        .take_while(|(position, _)| *position < fraction)
        .count()
        + 1;
    let (start, from) = DAMAGE[upper - 1];
    let (end, to) = DAMAGE[upper];
    let part = (fraction - start) / (end - start);
    std::array::from_fn(|channel| {
        (from[channel] + part * (to[channel] - from[channel])).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Return the CIE lightness, 0 (black) to 100 (white).
    fn lightness(colour: Colour) -> f64 {
        let [red, green, blue] = colour.map(|channel| {
            let share = f64::from(channel) / 255.0;
            if share <= 0.04045 {
                share / 12.92
            } else {
                ((share + 0.055) / 1.055).powf(2.4)
            }
        });
        let luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
        116.0 * luminance.cbrt() - 16.0
    }

    /// Return the lightness of a map at 33 equally spaced fractions.
    fn lightnesses(map: ColourMap) -> Vec<f64> {
        (0..=32)
            .map(|step| lightness(map.colour(f64::from(step) / 32.0)))
            .collect()
    }

    #[test]
    fn general_map_becomes_steadily_lighter() {
        let steps = lightnesses(ColourMap::General);
        assert!(steps.windows(2).all(|pair| pair[1] > pair[0]));
        assert!(steps[0] < 20.0 && steps[32] > 85.0);
    }

    #[test]
    fn damage_map_becomes_steadily_darker() {
        let steps = lightnesses(ColourMap::Damage);
        assert!(steps.windows(2).all(|pair| pair[1] < pair[0]));
        assert!(steps[0] > 85.0 && steps[32] < 12.0);
    }

    #[test]
    fn ends_are_those_of_the_published_maps() {
        let close = |left: Colour, right: Colour| {
            left.iter()
                .zip(right)
                .all(|(one, other)| one.abs_diff(other) <= 4)
        };
        assert!(close(ColourMap::General.colour(0.0), [68, 1, 84]));
        assert!(close(ColourMap::General.colour(0.5), [33, 145, 140]));
        assert!(close(ColourMap::General.colour(1.0), [253, 231, 37]));
        assert_eq!(ColourMap::Damage.colour(0.0), [222, 224, 228]);
        assert_eq!(ColourMap::Damage.colour(1.0), [44, 6, 44]);
    }

    #[test]
    fn values_beyond_the_ends_and_missing_values_have_colours() {
        for map in [ColourMap::General, ColourMap::Damage] {
            assert_eq!(map.colour(f64::NEG_INFINITY), map.colour(0.0));
            assert_eq!(map.colour(7.0), map.colour(1.0));
            assert_eq!(map.colour(f64::NAN), NO_VALUE);
        }
    }

    #[test]
    fn map_follows_from_the_name_of_the_field() {
        assert_eq!(ColourMap::for_field("Damage"), ColourMap::Damage);
        assert_eq!(ColourMap::for_field("velocity"), ColourMap::General);
    }
}
