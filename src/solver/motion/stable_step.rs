//! The stable time step: the largest one for which stability is guaranteed.
//!
//! A bond with the stiffness C (N/m⁷) and the direction n has the energy ½ C (n·(u_j − u_i))² V_i V_j. This
//! energy is at most C ((n·u_i)² + (n·u_j)²) V_i V_j. So the energy of all bonds is at most Σ_i V_i u_i·(D_i
//! u_i) with D_i = Σ_j V_j C n⊗n, and every frequency obeys ω² ≤ 2 λ_max(D)/ρ. Verlet is stable for Δt ≤ 2/ω,
//! hence Δt = min √(2ρ/λ_max(D)), with the minimum over all points.
//!
//! The usual step √(2ρ/Σ_j V_j C) (Silling & Askari 2005) uses the trace of D instead of λ_max(D). If the
//! eigenvalues of D are equal, the usual step is shorter by a factor of √3 in 3-D, and √2 in 2-D.

use nalgebra::Matrix3;
use rayon::prelude::*;

use crate::comm::{self, Communicator};

use crate::solver::model::Model;

/// Return the stable step over all ranks, s; infinite if no point has a bond. `stiffness` contains the matrix
/// D of each owned point (N/m⁴) as columns xx, yy, zz, xy, yz, xz. Collective.
pub fn stable_step<const D: usize>(
    comm: &dyn Communicator,
    model: &Model<D>,
    stiffness: &[Vec<f64>; 6],
) -> f64 {
    let own = (0..model.owned())
        .into_par_iter()
        // Inside a body, consecutive points usually have equal entries, so the last result is reused.
        .map_init(Default::default, |last: &mut ([f64; 6], f64), point| {
            let entries = stiffness.each_ref().map(|column| column[point]);
            if entries != last.0 {
                *last = (entries, largest_eigenvalue(&entries));
            }
            (2.0 * model.density_of(point) / last.1).sqrt()
        })
        .reduce(|| f64::INFINITY, f64::min);
    let mut step = [own];
    comm::min(comm, &mut step);
    step[0]
}

/// The largest eigenvalue of a symmetric matrix given as xx, yy, zz, xy, yz, xz; 0 if this eigenvalue is
/// negative.
pub(super) fn largest_eigenvalue(entries: &[f64; 6]) -> f64 {
    let [xx, yy, zz, xy, yz, xz] = *entries;
    let matrix = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
    matrix.symmetric_eigenvalues().max().max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_of_a_known_matrix() {
        // The eigenvalues of [[2, 1], [1, 2]] are 1 and 3.
        assert!((largest_eigenvalue(&[2.0, 2.0, 0.0, 1.0, 0.0, 0.0]) - 3.0).abs() < 1e-12);
        assert_eq!(largest_eigenvalue(&[0.0; 6]), 0.0);
    }
}
