//! Observed rates of convergence.

/// Bound of the search for a rate of convergence p: only roots from −`LARGEST_RATE` to `LARGEST_RATE` are
/// found.
const LARGEST_RATE: f64 = 30.0;

/// Number of bisections. They reduce the search interval below the round-off of [`LARGEST_RATE`].
const BISECTIONS: usize = 60;

/// Compute the rate of convergence p of each row of a series; `None` for a row without a rate. Each row is a
/// pair (h, f). h is a parameter such as the spacing. f is the value of a run, or `None` if the run has no
/// value.
///
/// - With a reference, p follows from |f − reference| ∝ h^p at the row and the previous row.
/// - Without a reference, p follows from f − f₀ ∝ h^p with unknown f₀ at the row and the previous two rows.
pub fn rates(series: &[(f64, Option<f64>)], reference: Option<f64>) -> Vec<Option<f64>> {
    let rate = |row: usize| -> Option<f64> {
        match reference {
            Some(exact) => {
                let [(h1, f1), (h2, f2)] = last(series, row)?;
                positive([h1, h2])?;
                let rate = ((f1 - exact) / (f2 - exact)).abs().ln() / (h1 / h2).ln();
                rate.is_finite().then_some(rate)
            }
            None => {
                let [(h1, f1), (h2, f2), (h3, f3)] = last(series, row)?;
                positive([h1, h2, h3])?;
                rate_of_differences([h1, h2, h3], (f1 - f2) / (f2 - f3))
            }
        }
    };
    (0..series.len()).map(rate).collect()
}

/// Return the last N rows up to `row`; `None` if there are fewer rows or one of these rows has no value.
fn last<const N: usize>(series: &[(f64, Option<f64>)], row: usize) -> Option<[(f64, f64); N]> {
    let rows = series[..=row].last_chunk::<N>()?;
    rows.iter()
        .all(|(_, value)| value.is_some())
        .then(|| rows.map(|(h, f)| (h, f.unwrap_or(f64::NAN))))
}

fn positive<const N: usize>(sizes: [f64; N]) -> Option<()> {
    sizes.iter().all(|h| *h > 0.0).then_some(())
}

/// Return the root p of (h₁^p − h₂^p)/(h₂^p − h₃^p) = ratio. Return `None` if h₁, h₂, h₃ is neither an
/// increasing nor a decreasing sequence. Also return `None` if there is no root between −[`LARGEST_RATE`] and
/// [`LARGEST_RATE`].
fn rate_of_differences([h1, h2, h3]: [f64; 3], ratio: f64) -> Option<f64> {
    let (up, down) = ((h1 / h2).ln(), (h3 / h2).ln());
    let monotonic = up * down < 0.0;
    let possible = ratio.is_finite() && ratio > 0.0;
    if !monotonic || !possible {
        return None;
    }
    let quotient = |p: f64| {
        if p == 0.0 {
            -up / down
        } else {
            -(p * up).exp_m1() / (p * down).exp_m1()
        }
    };
    // The quotient increases with p if h₁ > h₂ > h₃, and decreases with p if h₁ < h₂ < h₃.
    let sign = up.signum();
    let (mut low, mut high) = (-LARGEST_RATE, LARGEST_RATE);
    let above = |p: f64| sign * (quotient(p) - ratio) > 0.0;
    if above(low) || !above(high) {
        return None;
    }
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if above(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    Some(0.5 * (low + high))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(sizes: &[f64], value: impl Fn(f64) -> f64) -> Vec<(f64, Option<f64>)> {
        sizes.iter().map(|h| (*h, Some(value(*h)))).collect()
    }

    fn assert_rates(found: &[Option<f64>], wanted: &[Option<f64>]) {
        assert_eq!(found.len(), wanted.len());
        for (found, wanted) in found.iter().zip(wanted) {
            match (found, wanted) {
                (Some(found), Some(wanted)) => {
                    assert!((found - wanted).abs() < 1e-6, "{found} {wanted}")
                }
                (found, wanted) => assert_eq!(found, wanted),
            }
        }
    }

    #[test]
    fn rates_of_powers_are_their_exponents() {
        for p in [0.5, 1.0, 2.0, 3.7] {
            let value = |h: f64| 3.0 - 0.2 * h.powf(p);
            let sizes = [1.0, 0.5, 0.3, 0.1];
            let with = rates(&series(&sizes, value), Some(3.0));
            assert_rates(&with, &[None, Some(p), Some(p), Some(p)]);
            let without = rates(&series(&sizes, value), None);
            assert_rates(&without, &[None, None, Some(p), Some(p)]);
            // The parameter may decrease or increase from row to row.
            let reversed: Vec<f64> = sizes.iter().rev().copied().collect();
            assert_rates(
                &rates(&series(&reversed, value), None),
                &[None, None, Some(p), Some(p)],
            );
        }
        // If h is a count that increases with refinement, the rate is negative.
        let counts = rates(&series(&[10.0, 20.0, 40.0], |n| 1.0 + n.powi(-2)), None);
        assert_rates(&counts, &[None, None, Some(-2.0)]);
    }

    #[test]
    fn what_does_not_converge_has_no_rate() {
        let oscillating = [(1.0, Some(1.0)), (0.5, Some(2.0)), (0.25, Some(1.5))];
        assert_eq!(rates(&oscillating, None), [None; 3]);
        let unordered = series(&[1.0, 0.25, 0.5], |h| h);
        assert_eq!(rates(&unordered, None), [None; 3]);
        let missing = [(1.0, Some(1.0)), (0.5, None), (0.25, Some(1.5))];
        assert_eq!(rates(&missing, Some(1.0)), [None; 3]);
        assert_eq!(rates(&series(&[1.0, 0.5], |_| 2.0), Some(2.0)), [None; 2]);
        assert_eq!(rates(&series(&[0.0, -0.5], |h| h), Some(2.0)), [None; 2]);
        assert_eq!(rates(&series(&[3.0, 2.0, 1.0], |_| 2.0), None), [None; 3]);
    }
}
