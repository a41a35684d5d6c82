//! What it costs to pull an ordinary state-based body apart along a plane, at a critical stretch.
//!
//! The halves of a body move apart by Δ, normal to the plane; a bond whose direction makes an angle φ
//! with the normal has the extension Δ cos φ and breaks at s0|ξ|. It then takes
//! ½ (A/m) ω|ξ|²s0² and, at each end, what the dilatation there loses: κ θ (d/m) ω|ξ|² s0 with θ that
//! of the bonds still intact. Summed over all bonds across a unit area this is G0 = δ s0² (A b + κ τ)
//! with two numbers that depend on the dimension and on the influence only; ω, κ and A are those of
//! [`crate::material::Ordinary`]. For the Poisson ratio of a bond-based law κ = 0, and with ω = 1/|ξ|
//! its critical stretch comes out (Silling & Askari 2005; Dipasquale et al. 2014, eq. 5).

use std::f64::consts::PI;

use crate::material::Influence;

/// Distances from the plane, and lengths and angles of the bonds at each, of the quadrature of τ.
const DISTANCES: u32 = 48;
const LENGTHS: u32 = 64;
const ANGLES: u32 = 64;

/// b and τ in G0 = δ s0² (A b + κ τ), in `dimension` 2 or 3; τ to about 10⁻³.
pub fn pull_apart(dimension: i32, influence: Influence) -> [f64; 2] {
    // With δ = 1; thickness and solid angle are left out wherever they cancel.
    let moment = influence.moment(dimension + 1);
    let (mass, share) = match dimension {
        3 => (4.0 * PI * moment, 0.25),
        _ => (2.0 * PI * moment, 1.0 / PI),
    };
    let bonds = share * influence.moment(dimension + 2) / moment;
    let factor = f64::from(dimension) / mass;
    let middle = |k: u32, count: u32| (f64::from(k) + 0.5) / f64::from(count);
    let mut points = 0.0;
    for i in 0..DISTANCES {
        let distance = middle(i, DISTANCES);
        // Opening at which a bond breaks (s0 = 1), ω r cos φ dV, and ω r² dV.
        let mut crossing = Vec::with_capacity((LENGTHS * ANGLES) as usize);
        for j in 0..LENGTHS {
            let r = distance + (1.0 - distance) * middle(j, LENGTHS);
            let widest = libm::acos(distance / r);
            let ring = influence.at(r, 1.0) * (1.0 - distance) / f64::from(LENGTHS);
            for k in 0..ANGLES {
                let angle = widest * middle(k, ANGLES);
                let arc = widest / f64::from(ANGLES);
                let volume = ring
                    * match dimension {
                        3 => 2.0 * PI * r * r * libm::sin(angle) * arc,
                        _ => 2.0 * r * arc,
                    };
                let cosine = libm::cos(angle);
                crossing.push([r / cosine, r * cosine * volume, r * r * volume]);
            }
        }
        crossing.sort_unstable_by(|a, b| b[0].total_cmp(&a[0]));
        // From the last bond to break to the first: those seen so far are intact.
        let mut intact = 0.0;
        for [opening, growth, moment] in crossing {
            let dilatation = factor * opening * (intact + 0.5 * growth);
            intact += growth;
            points += factor * dilatation * moment / f64::from(DISTANCES);
        }
    }
    [bonds, 2.0 * points]
}
