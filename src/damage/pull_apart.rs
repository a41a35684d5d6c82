//! Energy for pulling apart a body along a plane. The body has an ordinary state-based law, and its bonds
//! break at a critical stretch s0.
//!
//! The plane divides the body into two halves. The halves move apart by a distance Δ along the normal of the
//! plane. A bond at the angle φ to the normal has the extension Δ cos φ, and breaks when this extension is
//! s0|ξ|. When a bond breaks, each end dissipates the bond energy ½ (A/m) ω|ξ|²s0². The dilatation energy of
//! each end decreases by κ θ (d/m) ω|ξ|² s0, and this amount is dissipated too. The dilatation θ is a sum
//! over the bonds that are still intact. The sum of these energies over all bonds across a unit area is
//! G0 = δ s0² (A b + κ τ). The numbers b and τ depend only on the dimension and the influence function. The
//! symbols d, m, ω, κ and A are those of `ordinary.rs`, see [`crate::material::Ordinary`]. For the Poisson
//! ratio of bond-based laws, κ is 0. With ω = 1/|ξ|, s0 then equals the critical stretch of the bond-based
//! law (Silling & Askari 2005; Dipasquale et al. 2014, eq. 5).

use std::f64::consts::PI;
use std::sync::OnceLock;

use crate::material::Influence;

/// Number of distances from a point to the plane, in the quadrature of τ.
const DISTANCES: u32 = 48;

/// Number of bond lengths in the quadrature of τ, for each distance from a point to the plane.
const LENGTHS: u32 = 64;

/// Number of angles φ per bond length in the quadrature of τ.
const ANGLES: u32 = 64;

/// Return b and τ in G0 = δ s0² (A b + κ τ), in two or three dimensions. The relative error of τ is about
/// 10⁻³.
///
/// The quadrature takes tens of milliseconds, so each result is stored for later calls.
pub fn pull_apart(dimension: i32, influence: Influence) -> [f64; 2] {
    static RESULTS: [[OnceLock<[f64; 2]>; 4]; 2] = [const { [const { OnceLock::new() }; 4] }; 2];
    let result = &RESULTS[usize::from(dimension == 3)][influence as usize];
    *result.get_or_init(|| quadrature(dimension, influence))
}

fn quadrature(dimension: i32, influence: Influence) -> [f64; 2] {
    // δ = 1. The thickness is omitted because it cancels.
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
        // Per bond of length r: the opening Δ at which the bond breaks for s0 = 1, ω r cos φ dV, and ω r² dV.
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
        // The bonds that break last come first. When a bond breaks, the bonds before it in this order are
        // still intact.
        let mut intact = 0.0;
        for [opening, growth, moment] in crossing {
            let dilatation = factor * opening * (intact + 0.5 * growth);
            intact += growth;
            points += factor * dilatation * moment / f64::from(DISTANCES);
        }
    }
    [bonds, 2.0 * points]
}
