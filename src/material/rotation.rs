//! Rotation of a family: the orthogonal factor R of its deformation gradient F = R U.
//!
//! R is stored as the unit quaternion (q, q₀) = (n sin(φ/2), cos(φ/2)) of the axis n and the angle φ,
//! |φ| ≤ π. The formula
//!
//! (R − I) ξ = q₀ t + q × t with t = 2 q × ξ
//!
//! is accurate at small angles and needs no division in the loops. In the plane only q_z and q₀ are nonzero.
//! R is computed with additions, multiplications, divisions and square roots only. Its bits are therefore the
//! same on every machine.

use nalgebra::{Matrix3, SMatrix};

use crate::lanes::{Lanes, Simd};

/// Unit quaternion of a rotation: the components of q, then q₀.
pub type Rotation = [f64; 4];

/// The identity, R = I.
pub const IDENTITY: Rotation = [0.0, 0.0, 0.0, 1.0];

/// Largest number of iterations of the polar decomposition. A stretch by a factor of 1000 needs about fifteen
/// iterations.
const MOST_ITERATIONS: usize = 40;

/// R has converged if an iteration changes every entry by less than this number. The next iteration would
/// change the entries by about the square of this number.
const CONVERGED: f64 = 1e-9;

/// Return the rotation R of a deformation gradient F in the plane or in space. In the plane, `in_plane`
/// computes R. In space, R is the identity if det F ≤ 0 or if the iteration does not converge.
pub fn of_gradient<const D: usize>(gradient: &SMatrix<f64, D, D>) -> Rotation {
    let mut f = Matrix3::identity();
    f.view_mut((0, 0), (D, D)).copy_from(gradient);
    match D {
        2 => in_plane(&f),
        _ => orthogonal_factor(f).map_or(IDENTITY, |r| quaternion(&r)),
    }
}

/// Return R in the plane. The angle of R is the angle of the vector (F_xx + F_yy, F_yx − F_xy); R is the
/// identity if this vector is 0.
fn in_plane(f: &Matrix3<f64>) -> Rotation {
    let (cosine, sine) = (f[(0, 0)] + f[(1, 1)], f[(1, 0)] - f[(0, 1)]);
    let length = (cosine * cosine + sine * sine).sqrt();
    if length > 0.0 {
        let [cosine, sine] = of_half_angle(cosine / length, sine / length);
        [0.0, 0.0, sine, cosine]
    } else {
        IDENTITY
    }
}

/// Return cos(φ/2) and sin(φ/2) from cos φ and sin φ, |φ| ≤ π.
fn of_half_angle(cosine: f64, sine: f64) -> [f64; 2] {
    // A square root gives cos(φ/2) for |φ| below 120°, and sin(φ/2) for larger |φ|. The other function
    // follows from sin φ = 2 sin(φ/2) cos(φ/2).
    if cosine > -0.5 {
        let half = (0.5 * (1.0 + cosine)).sqrt();
        [half, 0.5 * sine / half]
    } else {
        let half = (0.5 * (1.0 - cosine)).sqrt();
        let half = if sine < 0.0 { -half } else { half };
        [(0.5 * sine / half).abs(), half]
    }
}

/// Return R of F = R U by Newton's iteration X ← ½ (X + X⁻ᵀ) (Higham 1986); `None` if det F ≤ 0 or if the
/// iteration does not converge.
fn orthogonal_factor(f: Matrix3<f64>) -> Option<Matrix3<f64>> {
    let mut x = f;
    for _ in 0..MOST_ITERATIONS {
        let [a, b, c] = [0, 1, 2].map(|k| x.column(k).into_owned());
        let cofactors = Matrix3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)]);
        let determinant = a.dot(&cofactors.column(0));
        // False for NaN, too.
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

/// Return the quaternion of a rotation matrix, with q₀ ≥ 0. The largest component of the quaternion is
/// computed first (Shepperd 1978).
fn quaternion(r: &Matrix3<f64>) -> Rotation {
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
    let [q0, x, y, z] = match largest {
        0 => [entry, difference(1, 2), difference(2, 0), difference(0, 1)],
        1 => [difference(1, 2), entry, sum(0, 1), sum(0, 2)],
        2 => [difference(2, 0), sum(0, 1), entry, sum(1, 2)],
        _ => [difference(0, 1), sum(0, 2), sum(1, 2), entry],
    };
    let sign = if q0 < 0.0 { -1.0 } else { 1.0 };
    [x, y, z, q0].map(|entry| entry * sign)
}

/// Return (R − I) ξ of eight bonds, m. The components are written out, because the compiler keeps indexed
/// arrays in memory instead of registers.
#[inline(always)]
pub fn displacement<S: Simd, const D: usize>(
    simd: S,
    xi: &[Lanes; D],
    [x, y, z, q0]: &[Lanes; 4],
) -> [Lanes; D] {
    if D < 3 {
        let twice = *z * 2.0;
        let mut turned = [Lanes::splat(0.0); D];
        if D > 1 {
            let (tx, ty) = (twice * xi[1] * -1.0, twice * xi[0]);
            turned[0] = simd.multiply_add(*q0, tx, *z * ty * -1.0);
            turned[1] = simd.multiply_add(*q0, ty, *z * tx);
        }
        return turned;
    }
    let cross = |a: [Lanes; 2], b: [Lanes; 2]| simd.multiply_add(a[0], b[1], a[1] * b[0] * -1.0);
    let t = [
        cross([*y, *z], [xi[1], xi[2]]) * 2.0,
        cross([*z, *x], [xi[2], xi[0]]) * 2.0,
        cross([*x, *y], [xi[0], xi[1]]) * 2.0,
    ];
    let mut turned = [simd.multiply_add(*q0, t[0], cross([*y, *z], [t[1], t[2]])); D];
    turned[1] = simd.multiply_add(*q0, t[1], cross([*z, *x], [t[2], t[0]]));
    turned[2] = simd.multiply_add(*q0, t[2], cross([*x, *y], [t[0], t[1]]));
    turned
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Rotation3, Vector3};

    use super::*;
    use crate::lanes::simd::Portable;

    /// Return R ξ.
    fn turned<const D: usize>(rotation: &Rotation, xi: [f64; D]) -> [f64; D] {
        let change = displacement(
            Portable::<true>,
            &xi.map(Lanes::splat),
            &rotation.map(Lanes::splat),
        );
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
                let quaternion = of_gradient(&(wanted * stretch));
                assert!((quaternion.iter().map(|q| q * q).sum::<f64>() - 1.0).abs() < 1e-14);
                let xi = [0.3, -1.2, 0.7];
                let found = Vector3::from(turned(&quaternion, xi));
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
            let quaternion = of_gradient(&(rotation * stretch));
            let [x, y] = turned(&quaternion, [0.6, -0.9]);
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
            Portable::<true>,
            &[Lanes::splat(2.0), Lanes::splat(0.0)],
            &of_gradient(&gradient).map(Lanes::splat),
        );
        assert!((change[1].0[0] / (2.0 * angle) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn a_family_that_is_turned_inside_out_has_none() {
        let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, -1.0));
        assert_eq!(of_gradient(&mirror), IDENTITY);
        assert_eq!(
            of_gradient(&Matrix3::<f64>::from_element(f64::NAN)),
            IDENTITY
        );
        assert_eq!(of_gradient(&Matrix2::<f64>::zeros()), IDENTITY);
    }
}
