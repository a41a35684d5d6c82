//! Random numbers of points, such as the scatter of positions and strengths. The numbers depend only on a
//! seed and the id of a point, so they are the same for any number of ranks and threads and after a restart.

/// A scattered quantity. The random numbers of different quantities are independent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scattered {
    /// The shift of a point from the centre of its cell, in the direction with this index.
    Position(usize),
    /// The strength of a point.
    Strength,
    /// The random sign of a point for the displacement component with this index. Newton's method estimates
    /// the trace of a matrix from these signs.
    Probe(usize),
}

/// A Weibull distribution of strengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weibull {
    /// The modulus m: the larger m, the smaller the scatter.
    pub modulus: f64,
    /// Seed of the random numbers.
    pub seed: u64,
}

impl Weibull {
    /// Return the strength of the point with this id, divided by the characteristic strength: (−ln u)^(1/m),
    /// with the uniform random number u. The probability that this quotient is below x is 1 − exp(−x^m).
    pub fn strength(self, id: u64) -> f64 {
        let survival = uniform(self.seed, Scattered::Strength, id);
        libm::pow(-libm::log(survival), 1.0 / self.modulus)
    }
}

/// Return the random number of the point with this id, with a uniform distribution between 0 and 1, both
/// excluded.
pub fn uniform(seed: u64, what: Scattered, id: u64) -> f64 {
    let stream = match what {
        Scattered::Position(component) => component as u64,
        Scattered::Strength => 3,
        Scattered::Probe(component) => 4 + component as u64,
    };
    let hash = mix(mix(mix(seed) ^ stream) ^ id);
    // The middle of one of 2⁵² equal intervals: this number is exact in floating point.
    ((hash >> 12) as f64 + 0.5) * 0.5_f64.powi(52)
}

/// Compute a step of the generator SplitMix64 (Steele, Lea & Flood 2014): a bijection with pseudo-random
/// results.
fn mix(value: u64) -> u64 {
    let mut mixed = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    const COUNT: u64 = 20_000;

    /// Return the bound on the largest difference between the empirical distribution function of `count`
    /// values and the true distribution function. The probability of a larger difference is at most 10⁻⁶
    /// (Dvoretzky, Kiefer & Wolfowitz, with Massart's constant).
    fn bound(count: u64) -> f64 {
        (libm::log(2e6) / (2.0 * count as f64)).sqrt()
    }

    /// Compute the largest difference between the empirical distribution function of `values` and the
    /// distribution function `distribution`.
    fn difference(mut values: Vec<f64>, distribution: impl Fn(f64) -> f64) -> f64 {
        values.sort_by(f64::total_cmp);
        let count = values.len() as f64;
        let each = values.into_iter().enumerate().map(|(k, value)| {
            let exact = distribution(value);
            (exact - k as f64 / count)
                .abs()
                .max((exact - (k + 1) as f64 / count).abs())
        });
        each.fold(0.0, f64::max)
    }

    #[test]
    fn numbers_are_evenly_distributed() {
        for what in [
            Scattered::Position(0),
            Scattered::Position(2),
            Scattered::Strength,
        ] {
            for seed in [0, 1, u64::MAX] {
                let values = (0..COUNT).map(|id| uniform(seed, what, id)).collect();
                assert!(difference(values, |x| x) < bound(COUNT), "{what:?} {seed}");
            }
        }
    }

    #[test]
    fn numbers_of_points_components_and_seeds_are_independent() {
        let x = |id| uniform(7, Scattered::Position(0), id) - 0.5;
        let y = |id| uniform(7, Scattered::Position(1), id) - 0.5;
        let other = |id| uniform(8, Scattered::Position(0), id) - 0.5;
        let pairs: [&dyn Fn(u64) -> f64; 3] =
            [&|id| x(id) * x(id + 1), &|id| x(id) * y(id), &|id| {
                x(id) * other(id)
            }];
        for (number, product) in pairs.iter().enumerate() {
            let mean = (0..COUNT).map(product).sum::<f64>() / COUNT as f64;
            // The mean has the standard deviation (1/12)/√n. One in about two million means deviates by more
            // than five standard deviations.
            let deviation = 1.0 / 12.0 / (COUNT as f64).sqrt();
            assert!(mean.abs() < 5.0 * deviation, "{number}: {mean}");
        }
    }

    #[test]
    fn strengths_follow_weibull() {
        for modulus in [1.0, 3.5, 20.0] {
            let weibull = Weibull { modulus, seed: 42 };
            let values = (0..COUNT).map(|id| weibull.strength(id)).collect();
            let distribution = |x: f64| 1.0 - libm::exp(-libm::pow(x, modulus));
            assert!(difference(values, distribution) < bound(COUNT), "{modulus}");
        }
    }
}
