//! The fictitious density of load steps, with which iterations of Δt = 1 are stable.

use super::stable_step::largest_eigenvalue;

/// Safety factor on the fictitious density, because rotations of bonds can increase the stiffness of a point.
const MARGIN: f64 = 1.2;

/// Fictitious density (N/m⁴) with which iterations of Δt = 1 are stable. `eigenvalue` is the largest
/// eigenvalue of the matrix D of a point (N/m⁴); see [`super::stable_step`].
pub fn stable_density(eigenvalue: f64) -> f64 {
    0.5 * MARGIN * eigenvalue
}

/// Fictitious density of each owned point (N/m⁴), with which iterations of Δt = 1 are stable. It is an upper
/// bound of the stiffness of the point, and infinite for a point without bonds. `stiffness` contains the
/// matrices D of the owned points; see [`super::stable_step`].
pub fn fictitious_density(stiffness: &[Vec<f64>; 6]) -> Vec<f64> {
    let density = |point: usize| {
        let entries = stiffness.each_ref().map(|column| column[point]);
        match stable_density(largest_eigenvalue(&entries)) {
            0.0 => f64::INFINITY,
            density => density,
        }
    };
    (0..stiffness[0].len()).map(density).collect()
}
