//! Colour maps.

use super::canvas::Colour;

/// A colour map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColourMap {
    /// From dark violet through green to yellow, perceptually uniform.
    Viridis,
    /// Rainbow from dark blue through green to dark red, smoother than "jet".
    Turbo,
    /// From blue through light grey to red: a diverging map, for values on both sides of a reference value.
    Coolwarm,
    /// From almost black to light grey.
    Grey,
    /// From light grey through orange and red to almost black. Even a crack with the width of one point is
    /// visible.
    Damage,
}

impl ColourMap {
    /// All maps.
    pub const ALL: [Self; 5] = [
        Self::Viridis,
        Self::Turbo,
        Self::Coolwarm,
        Self::Grey,
        Self::Damage,
    ];

    /// Return the name of the map.
    pub fn name(self) -> &'static str {
        match self {
            Self::Viridis => "viridis",
            Self::Turbo => "turbo",
            Self::Coolwarm => "coolwarm",
            Self::Grey => "grey",
            Self::Damage => "damage",
        }
    }

    /// Return the default map of a field. Only the name of the field selects the map, so all pictures of a
    /// series use the same map.
    pub fn for_field(field: &str) -> Self {
        if is_damage(field) {
            Self::Damage
        } else {
            Self::Viridis
        }
    }

    /// Return the colour at a fraction of the way from the low to the high end. Fractions outside of 0 to 1
    /// are clamped; NaN has the colour of points without a value.
    pub fn colour(self, fraction: f64) -> Colour {
        if fraction.is_nan() {
            return self.no_value();
        }
        let fraction = fraction.clamp(0.0, 1.0);
        match self {
            Self::Viridis => viridis(fraction),
            Self::Turbo => between(&TURBO, fraction),
            Self::Coolwarm => between(&COOLWARM, fraction),
            Self::Grey => [(GREY[0] + fraction * (GREY[1] - GREY[0])).round() as u8; 3],
            Self::Damage => damage(fraction),
        }
    }

    /// Return the colour of points without a value: grey, or pale blue if the map is grey.
    fn no_value(self) -> Colour {
        match self {
            Self::Grey => [150, 190, 225],
            _ => [140, 142, 146],
        }
    }
}

/// Test whether the name of a field contains "damage", in small or capital letters. The values of such a
/// field are at least 0.
pub fn is_damage(field: &str) -> bool {
    field.to_lowercase().contains("damage")
}

/// Return the colour darkened to `brightness` (0 to 1), for faces turned away from the light.
pub fn shaded(colour: Colour, brightness: f64) -> Colour {
    colour.map(|channel| (f64::from(channel) * brightness).round() as u8)
}

/// Coefficients of a polynomial fit to the colours of "viridis", lowest power first.
const VIRIDIS: [[f64; 3]; 7] = [
    [0.277_727_3, 0.005_407_3, 0.334_099_8],
    [0.105_093_0, 1.404_613_5, 1.384_590_2],
    [-0.330_861_8, 0.214_847_6, 0.095_095_2],
    [-4.634_230_5, -5.799_101_0, -19.332_441_0],
    [6.228_269_9, 14.179_933_4, 56.690_552_6],
    [4.776_385_0, -13.745_145_4, -65.353_032_6],
    [-5.435_455_9, 4.645_852_6, 26.312_435_2],
];

/// Return the colour of the "viridis" map at a fraction from 0 to 1.
fn viridis(fraction: f64) -> Colour {
    let mut colour = [0.0; 3];
    for coefficients in VIRIDIS.iter().rev() {
        for (channel, coefficient) in colour.iter_mut().zip(coefficients) {
            *channel = *channel * fraction + coefficient;
        }
    }
    colour.map(|channel| (channel * 255.0).round() as u8)
}

/// Common value of red, green and blue, at the low and at the high end of the grey map. The high end is
/// darker than the white background.
const GREY: [f64; 2] = [24.0, 226.0];

/// Equally spaced colours of the diverging map of K. Moreland, "Diverging color maps for scientific
/// visualization", Proc. ISVC 2009.
const COOLWARM: [Colour; 33] = [
    [59, 76, 192],
    [68, 90, 204],
    [77, 104, 215],
    [87, 117, 225],
    [98, 130, 234],
    [108, 142, 241],
    [119, 154, 247],
    [130, 165, 251],
    [141, 176, 254],
    [152, 185, 255],
    [163, 194, 255],
    [174, 201, 253],
    [184, 208, 249],
    [194, 213, 244],
    [204, 217, 238],
    [213, 219, 230],
    [221, 221, 221],
    [229, 216, 209],
    [236, 211, 197],
    [241, 204, 185],
    [245, 196, 173],
    [247, 187, 160],
    [247, 177, 148],
    [247, 166, 135],
    [244, 154, 123],
    [241, 141, 111],
    [236, 127, 99],
    [229, 112, 88],
    [222, 96, 77],
    [213, 80, 66],
    [203, 62, 56],
    [192, 40, 47],
    [180, 4, 38],
];

/// Equally spaced colours of "turbo" (A. Mikhailov, Google AI Blog, 2019; Apache-2.0). Interpolated colours
/// differ from the published 256 colours by at most 2 of 255.
const TURBO: [Colour; 33] = [
    [48, 18, 59],
    [57, 42, 115],
    [64, 64, 161],
    [68, 86, 199],
    [70, 107, 227],
    [70, 127, 246],
    [66, 147, 255],
    [55, 167, 250],
    [41, 187, 236],
    [29, 205, 216],
    [24, 220, 195],
    [30, 232, 176],
    [49, 242, 153],
    [76, 249, 126],
    [107, 253, 100],
    [138, 255, 77],
    [163, 253, 60],
    [184, 247, 53],
    [204, 237, 52],
    [222, 224, 55],
    [237, 208, 58],
    [248, 192, 58],
    [253, 174, 53],
    [254, 152, 44],
    [251, 128, 34],
    [245, 104, 23],
    [236, 82, 15],
    [224, 64, 9],
    [210, 49, 5],
    [192, 35, 2],
    [172, 23, 1],
    [149, 13, 1],
    [122, 4, 3],
];

/// Interpolate linearly between equally spaced colours. `fraction` is 0 at the first colour and 1 at the last
/// colour.
fn between(colours: &[Colour; 33], fraction: f64) -> Colour {
    let at = fraction * (colours.len() - 1) as f64;
    let lower = (at as usize).min(colours.len() - 2);
    let part = at - lower as f64;
    std::array::from_fn(|channel| {
        let [from, to] = [lower, lower + 1].map(|entry| f64::from(colours[entry][channel]));
        (from + part * (to - from)).round() as u8
    })
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

/// Return the colour of the damage map at a fraction from 0 to 1.
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

    /// Return the lightness of a map at 33 equally spaced fractions from 0 to 1.
    fn lightnesses(map: ColourMap) -> Vec<f64> {
        (0..=32)
            .map(|step| lightness(map.colour(f64::from(step) / 32.0)))
            .collect()
    }

    #[test]
    fn viridis_becomes_steadily_lighter() {
        let steps = lightnesses(ColourMap::Viridis);
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
    fn grey_map_becomes_steadily_lighter() {
        let steps = lightnesses(ColourMap::Grey);
        assert!(steps.windows(2).all(|pair| pair[1] > pair[0]));
        assert!(steps[0] < 15.0 && steps[32] > 85.0 && steps[32] < 95.0);
    }

    #[test]
    fn diverging_map_is_lightest_in_the_middle_and_symmetric() {
        let steps = lightnesses(ColourMap::Coolwarm);
        assert!(steps[..17].windows(2).all(|pair| pair[1] > pair[0]));
        assert!(steps[16..].windows(2).all(|pair| pair[1] < pair[0]));
        for (low, high) in steps.iter().zip(steps.iter().rev()) {
            assert!((low - high).abs() < 4.0, "{low} {high}");
        }
        assert_eq!(ColourMap::Coolwarm.colour(0.5), [221; 3]);
    }

    #[test]
    fn ends_are_those_of_the_published_maps() {
        let close = |left: Colour, right: Colour| {
            left.iter()
                .zip(right)
                .all(|(one, other)| one.abs_diff(other) <= 4)
        };
        assert!(close(ColourMap::Viridis.colour(0.0), [68, 1, 84]));
        assert!(close(ColourMap::Viridis.colour(0.5), [33, 145, 140]));
        assert!(close(ColourMap::Viridis.colour(1.0), [253, 231, 37]));
        // Some of the 256 colours of the published table.
        let turbo = |entry: f64| ColourMap::Turbo.colour(entry / 255.0);
        assert!(close(turbo(0.0), [48, 18, 59]));
        assert!(close(turbo(255.0), [122, 4, 3]));
        assert!(close(turbo(64.0), [40, 188, 235]));
        assert!(close(turbo(128.0), [164, 252, 60]));
        assert!(close(turbo(192.0), [251, 126, 33]));
        assert_eq!(ColourMap::Coolwarm.colour(0.0), [59, 76, 192]);
        assert_eq!(ColourMap::Coolwarm.colour(1.0), [180, 4, 38]);
        assert_eq!(ColourMap::Damage.colour(0.0), [222, 224, 228]);
        assert_eq!(ColourMap::Damage.colour(1.0), [44, 6, 44]);
    }

    #[test]
    fn values_beyond_the_ends_and_missing_values_have_colours() {
        for map in ColourMap::ALL {
            assert_eq!(map.colour(f64::NEG_INFINITY), map.colour(0.0));
            assert_eq!(map.colour(7.0), map.colour(1.0));
            let steps: Vec<Colour> = (0..=255)
                .map(|step| map.colour(f64::from(step) / 255.0))
                .collect();
            assert!(!steps.contains(&map.colour(f64::NAN)), "{map:?}");
        }
    }

    #[test]
    fn map_follows_from_the_name_of_the_field() {
        assert_eq!(ColourMap::for_field("Damage"), ColourMap::Damage);
        assert_eq!(ColourMap::for_field("velocity"), ColourMap::Viridis);
    }
}
