//! Rotation of a family: the orthogonal factor R of its deformation gradient F = R U.
//!
//! R is stored as modified Rodrigues parameters σ = n tan(φ/4) of the axis n and the angle φ, |φ| ≤ π, so that |σ| ≤ 1
//! (Schaub & Junkins 1996):
//!
//! R − I = (8 [σ×]² + 4 (1 − σ²) [σ×])/(1 + σ²)²
//!
//! keeps all digits at small angles. In the plane only σ_z is not 0. R is found with additions, products, quotients and
//! square roots alone, so that its bits are the same on every machine.

use nalgebra::{Matrix3, SMatrix};

use crate::lanes::{LaneTuple, Lanes};

/// σ of a rotation, by component; 0 is none.
pub type Rotation = [f64; 3];

/// Iterations of the polar decomposition at most; strains of a factor of a thousand take about fifteen.
const MOST_ITERATIONS: usize = 40;

/// The change of an entry of R in an iteration below which R has converged; the next change would be its square.
const CONVERGED: f64 = 1e-9;

/// R of a deformation gradient in the plane or in space; none where F turns the family inside out.
pub fn of_gradient<const D: usize>(gradient: &SMatrix<f64, D, D>) -> Rotation {
    let mut f = Matrix3::identity();
    f.view_mut((0, 0), (D, D)).copy_from(gradient);
    match D {
        2 => in_plane(&f),
        _ => orthogonal_factor(f).map_or([0.0; 3], |r| parameters(&r)),
    }
}

/// R in the plane turns by the angle of the vector (F_xx + F_yy, F_yx − F_xy).
fn in_plane(f: &Matrix3<f64>) -> Rotation {
    let (cosine, sine) = (f[(0, 0)] + f[(1, 1)], f[(1, 0)] - f[(0, 1)]);
    let length = (cosine * cosine + sine * sine).sqrt();
    if length > 0.0 {
        [0.0, 0.0, quarter_tangent(cosine / length, sine / length)]
    } else {
        [0.0; 3]
    }
}

/// tan(φ/4) from cos φ and sin φ, |φ| ≤ π.
fn quarter_tangent(cosine: f64, sine: f64) -> f64 {
    // tan(φ/2) = sin φ/(1 + cos φ) = (1 − cos φ)/sin φ, and the same once more for the half angle.
    let [cosine, sine] = if cosine > -0.5 {
        let half = (0.5 * (1.0 + cosine)).sqrt();
        [half, 0.5 * sine / half]
    } else {
        let half = (0.5 * (1.0 - cosine)).sqrt();
        let half = if sine < 0.0 { -half } else { half };
        [(0.5 * sine / half).abs(), half]
    };
    sine / (1.0 + cosine)
}

/// R of F = R U by Newton's iteration X ← ½ (X + X⁻ᵀ) (Higham 1986), if det F > 0.
fn orthogonal_factor(f: Matrix3<f64>) -> Option<Matrix3<f64>> {
    let mut x = f;
    for _ in 0..MOST_ITERATIONS {
        let [a, b, c] = [0, 1, 2].map(|k| x.column(k).into_owned());
        let cofactors = Matrix3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)]);
        let determinant = a.dot(&cofactors.column(0));
        // False for what is not a number, too.
        let is_proper = determinant > 0.0;
        if !is_proper {
            return None;
        }
        let next = (x + cofactors / determinant) * 0.5;
        let change = (next - x).amax();
        x = next;
        if change < CONVERGED {
            return Some(x);
        }
    }
    None
}

/// σ of a rotation matrix, from the quaternion (q, p) with q ≥ 0: σ = p/(1 + q). The largest of its entries is found
/// first (Shepperd 1978).
fn parameters(r: &Matrix3<f64>) -> Rotation {
    let [x, y, z] = [r[(0, 0)], r[(1, 1)], r[(2, 2)]];
    let squares = [
        1.0 + x + y + z,
        1.0 + x - y - z,
        1.0 - x + y - z,
        1.0 - x - y + z,
    ];
    let mut largest = 0;
    for k in 1..4 {
        if squares[k] > squares[largest] {
            largest = k;
        }
    }
    let entry = 0.5 * squares[largest].sqrt();
    let share = 0.25 / entry;
    let difference = |a: usize, b: usize| (r[(b, a)] - r[(a, b)]) * share;
    let sum = |a: usize, b: usize| (r[(b, a)] + r[(a, b)]) * share;
    let quaternion = match largest {
        0 => [entry, difference(1, 2), difference(2, 0), difference(0, 1)],
        1 => [difference(1, 2), entry, sum(0, 1), sum(0, 2)],
        2 => [difference(2, 0), sum(0, 1), entry, sum(1, 2)],
        _ => [difference(0, 1), sum(0, 2), sum(1, 2), entry],
    };
    let [q, p @ ..] = quaternion;
    let share = if q < 0.0 { -1.0 } else { 1.0 } / (1.0 + q.abs());
    p.map(|p| p * share)
}

/// (R − I) ξ of eight bonds, m.
#[inline(always)]
pub fn displacement<const D: usize>(xi: &[Lanes; D], sigma: &[Lanes; 3]) -> [Lanes; D] {
    let one = Lanes::splat(1.0);
    if D < 3 {
        let z = sigma[2];
        let square = z * z;
        let scale = Lanes::splat(4.0) / ((one + square) * (one + square));
        let (sine, cosine) = (z * (one - square) * scale, square * 2.0 * scale);
        let across = |d: usize| {
            if d == 0 {
                Lanes::splat(0.0) - xi[1 % D]
            } else {
                xi[0]
            }
        };
        return LaneTuple::each(|d| sine * across(d) - cosine * xi[d]);
    }
    let cross = |b: [Lanes; 3]| -> [Lanes; 3] {
        LaneTuple::each(|k| {
            let (m, n) = ((k + 1) % 3, (k + 2) % 3);
            sigma[m] * b[n] - sigma[n] * b[m]
        })
    };
    let square = sigma[0] * sigma[0] + sigma[1] * sigma[1] + sigma[2] * sigma[2];
    let scale = Lanes::splat(4.0) / ((one + square) * (one + square));
    let once = cross(LaneTuple::each(|k| xi[k % D]));
    let twice = cross(once);
    LaneTuple::each(|d| ((one - square) * once[d] + twice[d] * 2.0) * scale)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Rotation3, Vector3};

    use super::*;

    /// R ξ.
    fn turned<const D: usize>(rotation: &Rotation, xi: [f64; D]) -> [f64; D] {
        let change = displacement(&xi.map(Lanes::splat), &rotation.map(Lanes::splat));
        std::array::from_fn(|d| xi[d] + change[d].0[0])
    }

    #[test]
    fn the_rotation_of_a_stretched_and_turned_solid_is_found() {
        let stretch = Matrix3::new(1.3, 0.2, -0.1, 0.2, 0.8, 0.05, -0.1, 0.05, 1.1);
        let axes = [
            Vector3::new(0.0, 0.0, 1.0),
            Vector3::new(1.0, 0.0, 0.0),
            Vector3::new(-0.3, 0.5, 0.2),
            Vector3::new(0.4, -1.0, 0.7),
        ];
        let pi = std::f64::consts::PI;
        for axis in axes {
            for angle in [
                0.0,
                1e-9,
                0.01,
                0.3,
                1.0,
                1.6,
                2.2,
                3.0,
                pi - 1e-7,
                pi,
                3.5,
                6.0,
            ] {
                let wanted = Rotation3::new(axis.normalize() * angle).into_inner();
                let sigma = of_gradient(&(wanted * stretch));
                assert!(sigma.iter().map(|s| s * s).sum::<f64>() < 1.0 + 1e-12);
                let xi = [0.3, -1.2, 0.7];
                let found = Vector3::from(turned(&sigma, xi));
                let error = (found - wanted * Vector3::from(xi)).norm();
                assert!(error < 1e-14, "{axis} {angle}: {error}");
            }
        }
    }

    #[test]
    fn in_the_plane_it_is_that_of_space() {
        let stretch = Matrix2::new(1.2, 0.1, 0.1, 0.7);
        for k in -36..=36 {
            let angle = std::f64::consts::PI / 36.0 * f64::from(k);
            let (sine, cosine) = angle.sin_cos();
            let rotation = Matrix2::new(cosine, -sine, sine, cosine);
            let sigma = of_gradient(&(rotation * stretch));
            let [x, y] = turned(&sigma, [0.6, -0.9]);
            let wanted = rotation * nalgebra::Vector2::new(0.6, -0.9);
            let error = (x - wanted[0]).abs().max((y - wanted[1]).abs());
            assert!(error < 1e-14, "{angle}: {error}");
        }
    }

    #[test]
    fn a_small_rotation_keeps_its_digits() {
        let angle = 1e-8;
        let gradient = Matrix2::new(1.0, -angle, angle, 1.0);
        let change = displacement(
            &[Lanes::splat(2.0), Lanes::splat(0.0)],
            &of_gradient(&gradient).map(Lanes::splat),
        );
        assert!((change[1].0[0] / (2.0 * angle) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn a_family_that_is_turned_inside_out_has_none() {
        let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
        assert_eq!(of_gradient(&mirror), [0.0; 3]);
        assert_eq!(
            of_gradient(&Matrix3::<f64>::from_element(f64::NAN)),
            [0.0; 3]
        );
        assert_eq!(of_gradient(&Matrix2::<f64>::zeros()), [0.0; 3]);
    }
}
