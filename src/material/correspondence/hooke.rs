//! Hooke's matrix: isotropic, orthotropic or full. The deck gives the constants in material axes, which may
//! be rotated against the axes of the body.
//!
//! Voigt's order is xx, yy, zz, yz, xz, xy with engineering shear strains. A plane problem uses the
//! components xx, yy and xy. In plane stress the matrix is that of a thin sheet. In plane strain the
//! components xx, yy and xy of the matrix are those of the solid.

use nalgebra::{DMatrix, Matrix6, Rotation3, Vector3};

use super::super::{Given, Key, Kind, LawFault, Values};
use super::family::extremes;
use super::tensor::{Number, Tensor, matrix, tensor};
use crate::dimension::Dimension;
use crate::elastic::Isotropic;

/// Components of a tensor in Voigt's order.
const VOIGT: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)];

/// Indices of the in-plane components in Voigt's order.
const PLANE: [usize; 3] = [0, 1, 5];

/// Hooke's matrix C, Pa.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hooke {
    matrix: Matrix6<f64>,
    /// Factors a, b and c of the in-plane strains xx, yy and 2 xy.
    ///
    /// The sum a E_xx + b E_yy + 2 c E_xy is the stress zz (Pa) in plane strain, and the strain zz in plane
    /// stress. `None` in 3-D and 1-D, and if the constants of the deck do not determine these factors.
    out_of_plane_factors: Option<[f64; 3]>,
}

/// Keys of the full matrix, by row and column. The matrix is symmetric, so only its upper triangle has keys.
const FULL: [[&str; 6]; 6] = [
    ["c11", "c12", "c13", "c14", "c15", "c16"],
    ["", "c22", "c23", "c24", "c25", "c26"],
    ["", "", "c33", "c34", "c35", "c36"],
    ["", "", "", "c44", "c45", "c46"],
    ["", "", "", "", "c55", "c56"],
    ["", "", "", "", "", "c66"],
];

/// Keys of an orthotropic solid: Young's moduli, Poisson's ratios and shear moduli.
const ORTHOTROPIC: [&str; 9] = [
    "youngs_modulus_x",
    "youngs_modulus_y",
    "youngs_modulus_z",
    "poisson_ratio_xy",
    "poisson_ratio_yz",
    "poisson_ratio_xz",
    "shear_modulus_xy",
    "shear_modulus_yz",
    "shear_modulus_xz",
];

/// Keys of an orthotropic thin sheet.
const SHEET: [&str; 4] = [
    "youngs_modulus_x",
    "youngs_modulus_y",
    "poisson_ratio_xy",
    "shear_modulus_xy",
];

const ANGLES: [&str; 3] = ["angle_1", "angle_2", "angle_3"];

pub const fn entry(name: &'static str) -> Key {
    Key {
        name,
        meaning: "an entry of Hooke's matrix in Voigt's order xx, yy, zz, yz, xz, xy, Pa; 0 if \
                  only other entries are given",
        kind: Kind::Optional {
            range: f64::NEG_INFINITY..f64::INFINITY,
            words: "a number",
        },
    }
}

pub const fn modulus(name: &'static str) -> Key {
    Key {
        name,
        meaning: "a modulus of an orthotropic solid along its own axes, Pa",
        kind: Kind::Optional {
            range: f64::MIN_POSITIVE..f64::INFINITY,
            words: "above 0",
        },
    }
}

pub const fn ratio(name: &'static str) -> Key {
    Key {
        name,
        meaning: "a Poisson's ratio of an orthotropic solid: in tension along the first axis, \
                  minus the strain along the second axis divided by the strain along the first",
        kind: Kind::Optional {
            range: f64::NEG_INFINITY..f64::INFINITY,
            words: "a number",
        },
    }
}

pub const fn angle(name: &'static str) -> Key {
    Key {
        name,
        meaning: "Bunge's Euler angles of the material's axes, degrees: rotation about z, then \
                  x, then z; in the plane only the first",
        kind: Kind::Number {
            range: -360.0..360_f64.next_up(),
            words: "between -360 and 360",
            default: Some(0.0),
        },
    }
}

/// The given keys, followed by the keys of Hooke's matrix.
macro_rules! keys_with_hooke {
    ($($own:expr),* $(,)?) => {
        &[
            $($own,)*
            hooke::entry("c11"), hooke::entry("c12"), hooke::entry("c13"), hooke::entry("c14"),
            hooke::entry("c15"), hooke::entry("c16"), hooke::entry("c22"), hooke::entry("c23"),
            hooke::entry("c24"), hooke::entry("c25"), hooke::entry("c26"), hooke::entry("c33"),
            hooke::entry("c34"), hooke::entry("c35"), hooke::entry("c36"), hooke::entry("c44"),
            hooke::entry("c45"), hooke::entry("c46"), hooke::entry("c55"), hooke::entry("c56"),
            hooke::entry("c66"),
            hooke::modulus("youngs_modulus_x"), hooke::modulus("youngs_modulus_y"),
            hooke::modulus("youngs_modulus_z"), hooke::ratio("poisson_ratio_xy"),
            hooke::ratio("poisson_ratio_yz"), hooke::ratio("poisson_ratio_xz"),
            hooke::modulus("shear_modulus_xy"), hooke::modulus("shear_modulus_yz"),
            hooke::modulus("shear_modulus_xz"),
            hooke::angle("angle_1"), hooke::angle("angle_2"), hooke::angle("angle_3"),
        ]
    };
}
pub(super) use keys_with_hooke;

/// Return the first key in `names` that has a value in `values`.
fn given_of(
    values: &Values,
    names: impl IntoIterator<Item = &'static str>,
) -> Option<&'static str> {
    let mut names = names.into_iter();
    names.find(|name| !name.is_empty() && values.get(name).is_some())
}

fn full_entries() -> impl Iterator<Item = &'static str> {
    FULL.into_iter().flatten()
}

fn fault_at(key: &'static str, message: impl Into<String>) -> Option<LawFault> {
    Some(LawFault {
        key: Some(key),
        message: message.into(),
    })
}

/// Return the first key with a value among the keys of anisotropic solids; `None` if all constants are
/// isotropic.
pub fn own_constants(values: &Values) -> Option<&'static str> {
    given_of(values, full_entries().chain(ORTHOTROPIC))
}

/// Return the error in the constants for this dimension; `None` if there is no error.
pub fn fault(values: &Values, dimension: Dimension) -> Option<LawFault> {
    let full = given_of(values, full_entries());
    let orthotropic = given_of(values, ORTHOTROPIC);
    let space = matches!(dimension, Dimension::Space);
    if let (Some(entry), Some(_)) = (full, orthotropic) {
        let message = "give the entries of Hooke's matrix or the constants of an orthotropic solid, \
                       not both";
        return fault_at(entry, message);
    }
    if !space
        && let Some(key) = given_of(
            values,
            ["angle_2", "angle_3"]
                .into_iter()
                .filter(|key| values.number(key) != 0.0),
        )
    {
        return fault_at(key, "in plane problems, only `angle_1` is available");
    }
    let axes = ANGLES.into_iter().find(|key| values.number(key) != 0.0);
    if let (Some(key), None) = (axes, full.or(orthotropic)) {
        return fault_at(
            key,
            "angles are only for anisotropic solids; an isotropic solid has no axes",
        );
    }
    if let (Some(key), "neo-hooke") = (full.or(orthotropic), values.word(super::STRESS.name)) {
        return fault_at(
            key,
            "`stress = \"neo-hooke\"` is isotropic: give two elastic constants",
        );
    }
    if let Some(first) = full {
        let is_out_of_plane = |(k, name): (usize, &'static str)| {
            let (row, column) = (k / 6, k % 6);
            (!PLANE.contains(&row) || !PLANE.contains(&column)).then_some(name)
        };
        let outside = given_of(
            values,
            full_entries().enumerate().filter_map(is_out_of_plane),
        );
        if let (false, Some(key)) = (space, outside) {
            let message = "in plane problems, Hooke's matrix has only the entries c11, c12, c16, c22, c26 and c66";
            return fault_at(key, message);
        }
        // A diagonal entry of 0 or below is an error by itself, so the message points at this entry.
        let to_blame = |name: &&'static str| {
            let of_diagonal = (0..6).any(|k| FULL[k][k] == *name);
            of_diagonal && values.get(name).is_some() && values.number(name) <= 0.0
        };
        let at = full_entries().find(to_blame).unwrap_or(first);
        return indefinite(&unturned(values, dimension)?, dimension, at);
    }
    let first = orthotropic?;
    let wanted: &[&'static str] = match dimension {
        Dimension::PlaneStress { .. } => &SHEET,
        _ => &ORTHOTROPIC,
    };
    if let Some(missing) = wanted.iter().find(|key| values.get(key).is_none()) {
        return fault_at(
            first,
            format!("an orthotropic solid needs `{missing}`, too"),
        );
    }
    let unused = ORTHOTROPIC.into_iter().filter(|key| !wanted.contains(key));
    if let Some(key) = given_of(values, unused) {
        return fault_at(key, "a thin sheet in plane stress has no such constant");
    }
    indefinite(&unturned(values, dimension)?, dimension, first)
}

/// Return an error if the matrix is not finite or not positive definite; `None` otherwise. The error is
/// reported at the key `first`.
fn indefinite(
    matrix: &Matrix6<f64>,
    dimension: Dimension,
    first: &'static str,
) -> Option<LawFault> {
    if matrix.iter().any(|entry| !entry.is_finite()) {
        let message = "Hooke's matrix has entries that are not finite";
        return fault_at(first, message);
    }
    let (eigenvalue, strain) = softest(matrix, dimension);
    if eigenvalue > 0.0 {
        return None;
    }
    fault_at(
        first,
        format!(
            "Hooke's matrix must be positive definite, but its smallest eigenvalue is {eigenvalue:.4e} Pa (relative \
             components of the eigenvector: {strain})"
        ),
    )
}

/// Return the smallest eigenvalue (Pa) of the matrix, which is in Voigt's order. Also return its eigenvector
/// as a text. The eigenvector is a strain; the text gives its components relative to the largest component.
fn softest(matrix: &Matrix6<f64>, dimension: Dimension) -> (f64, String) {
    let used = used(dimension);
    let written = DMatrix::from_fn(used.len(), used.len(), |a, b| matrix[(used[a], used[b])]);
    let all = written.symmetric_eigen();
    let softest = all.eigenvalues.imin();
    let strain = all.eigenvectors.column(softest);
    let largest = strain[strain.iamax()];
    let name = |component: usize| ["xx", "yy", "zz", "yz", "xz", "xy"][component];
    let parts = used.iter().zip(strain.iter());
    let parts = parts.filter(|(_, part)| part.abs() > 0.01 * largest.abs());
    let parts: Vec<String> = parts
        .map(|(component, part)| format!("{} {:.2}", name(*component), part / largest))
        .collect();
    (all.eigenvalues[softest], parts.join(", "))
}

/// Return the indices, in Voigt's order, of the components that problems of this dimension use.
fn used(dimension: Dimension) -> Vec<usize> {
    match dimension {
        Dimension::Space => (0..6).collect(),
        _ => PLANE.to_vec(),
    }
}

/// Return the smallest eigenvalue of C : I (Pa), with Hooke's matrix C and the unit tensor I. `None` for
/// isotropic constants.
pub fn least_under_dilation(values: &Values, dimension: Dimension) -> Option<f64> {
    let hooke = Hooke {
        matrix: unturned(values, dimension)?,
        out_of_plane_factors: None,
    };
    Some(match dimension {
        Dimension::Space => hooke.least_of_unit_strain::<3>(),
        _ => hooke.least_of_unit_strain::<2>(),
    })
}

/// Return Hooke's matrix in the material's axes, Pa; `None` for isotropic constants. The entries are NaN if
/// the compliance has no inverse.
fn unturned(values: &Values, dimension: Dimension) -> Option<Matrix6<f64>> {
    let number = |key: &str| values.get(key).map_or(0.0, |_| values.number(key));
    if given_of(values, full_entries()).is_some() {
        return Some(Matrix6::from_fn(|a, b| number(FULL[a.min(b)][a.max(b)])));
    }
    given_of(values, ORTHOTROPIC)?;
    let sheet = matches!(dimension, Dimension::PlaneStress { .. });
    let of = |kind: &str, axes: &str| number(&format!("{kind}_{axes}"));
    let young = ["x", "y", "z"].map(|axis| of("youngs_modulus", axis));
    let mut compliance = Matrix6::zeros();
    for (k, young) in young.into_iter().enumerate() {
        // The out-of-plane stiffness of a sheet may have any value, because the matrix does not couple this
        // stiffness to the plane.
        compliance[(k, k)] = if sheet && k == 2 { 1.0 } else { 1.0 / young };
    }
    for (axes, a, b) in [("yz", 1, 2), ("xz", 0, 2), ("xy", 0, 1)] {
        let shear = 6 - a - b;
        if sheet && axes != "xy" {
            compliance[(shear, shear)] = 1.0;
            continue;
        }
        compliance[(a, b)] = -of("poisson_ratio", axes) / young[a];
        compliance[(b, a)] = compliance[(a, b)];
        compliance[(shear, shear)] = 1.0 / of("shear_modulus", axes);
    }
    let not_a_solid = Matrix6::from_element(f64::NAN);
    Some(compliance.try_inverse().unwrap_or(not_a_solid))
}

/// Average the stiffness of an anisotropic solid over all directions (Voigt); in 2-D, over all directions in
/// the plane. Return the isotropic elastic constants of the average; `None` if no anisotropic constants are
/// given.
pub fn average(values: &Values, dimension: Dimension) -> Option<Isotropic> {
    let c = unturned(values, dimension)?;
    if matches!(dimension, Dimension::Space) {
        let normal = c[(0, 0)] + c[(1, 1)] + c[(2, 2)];
        let coupled = c[(0, 1)] + c[(1, 2)] + c[(0, 2)];
        let shear = c[(3, 3)] + c[(4, 4)] + c[(5, 5)];
        let bulk = (normal + 2.0 * coupled) / 9.0;
        let shear = (normal - coupled + 3.0 * shear) / 15.0;
        return Some(Isotropic {
            youngs_modulus: 9.0 * bulk * shear / (3.0 * bulk + shear),
            poisson_ratio: (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear),
        });
    }
    let area = (c[(0, 0)] + c[(1, 1)] + 2.0 * c[(0, 1)]) / 4.0;
    let shear = (c[(0, 0)] + c[(1, 1)] - 2.0 * c[(0, 1)] + 4.0 * c[(5, 5)]) / 8.0;
    let poisson_ratio = match dimension {
        Dimension::PlaneStress { .. } => (area - shear) / (area + shear),
        _ => (area - shear) / (2.0 * area),
    };
    Some(Isotropic {
        youngs_modulus: 2.0 * shear * (1.0 + poisson_ratio),
        poisson_ratio,
    })
}

impl Hooke {
    /// Create Hooke's matrix of a body. `None` if the solid is anisotropic and an entry of its matrix is not
    /// finite.
    pub fn of(given: &Given) -> Option<Self> {
        let Some(own) = unturned(given.values, given.dimension) else {
            let matrix = isotropic(given);
            let ratio = given.elastic.poisson_ratio;
            let thinning = -ratio / (1.0 - ratio);
            let out_of_plane_factors = match given.dimension {
                Dimension::PlaneStress { .. } => Some([thinning, thinning, 0.0]),
                dimension => out_of_plane_row(&matrix, dimension),
            };
            return Some(Self {
                matrix,
                out_of_plane_factors,
            });
        };
        let degrees = ANGLES.map(|key| given.values.number(key));
        let turned = if degrees == [0.0; 3] {
            own
        } else {
            turned(&own, degrees.map(f64::to_radians))
        };
        let is_full = given_of(given.values, full_entries()).is_some();
        let out_of_plane_factors = out_of_plane_row(&turned, given.dimension).filter(|_| !is_full);
        turned
            .iter()
            .all(|entry| entry.is_finite())
            .then_some(Self {
                matrix: turned,
                out_of_plane_factors,
            })
    }

    /// Return the stress zz (Pa) in plane strain, or the strain zz in plane stress, from the strain in the
    /// plane. `None` in 3-D and 1-D, and if the constants of the deck do not determine this result.
    pub fn out_of_plane<const D: usize>(&self, strain: &Tensor<f64, D>) -> Option<f64> {
        let [xx, yy, xy] = self.out_of_plane_factors?;
        Some(xx * strain[0][0] + yy * strain[1][1] + xy * (strain[0][1] + strain[1][0]))
    }

    /// Return S = C : E, Pa.
    #[inline(always)]
    pub fn stress<T: Number, const D: usize>(&self, strain: &Tensor<T, D>) -> Tensor<T, D> {
        let mut stress = [[T::of(0.0); D]; D];
        for i in components::<D>() {
            let (a, b) = VOIGT[i];
            let mut sum = T::of(0.0);
            for j in components::<D>() {
                let (c, d) = VOIGT[j];
                let factor = if c == d { 1.0 } else { 2.0 };
                sum = sum + strain[c][d] * (self.matrix[(i, j)] * factor);
            }
            stress[a][b] = sum;
            stress[b][a] = sum;
        }
        stress
    }

    /// Average the compliance over all directions (Reuss); in 2-D, over all directions in the plane. Return
    /// the shear modulus (Pa) of the average. The softest shear modes dominate this shear modulus.
    ///
    /// # Panics
    /// If Hooke's matrix is singular.
    pub fn shear_modulus(&self, dimension: Dimension) -> f64 {
        let used = used(dimension);
        // The matrix is scaled, because the determinant of a matrix of very small or very large entries is
        // not representable. The scale is a power of two, which causes no round-off.
        let (_, exponent) = libm::frexp(self.matrix.amax());
        let unit = libm::ldexp(1.0, exponent - 1);
        let own = DMatrix::from_fn(used.len(), used.len(), |a, b| {
            self.matrix[(used[a], used[b])] / unit
        });
        let s = own.try_inverse().expect("the matrix is positive definite");
        if used.len() == 3 {
            return unit * (2.0 / (s[(0, 0)] + s[(1, 1)] - 2.0 * s[(0, 1)] + s[(2, 2)]));
        }
        let normal = s[(0, 0)] + s[(1, 1)] + s[(2, 2)];
        let coupled = s[(0, 1)] + s[(1, 2)] + s[(0, 2)];
        let shear = s[(3, 3)] + s[(4, 4)] + s[(5, 5)];
        unit * (15.0 / (4.0 * (normal - coupled) + 3.0 * shear))
    }

    fn least_of_unit_strain<const D: usize>(&self) -> f64 {
        let unit = tensor(|a, b| if a == b { 1.0 } else { 0.0 });
        extremes(&matrix::<D>(&self.stress(&unit)))[0]
    }

    /// Return the largest eigenvalue λ of C : E = λ E, Pa.
    pub fn largest(&self) -> f64 {
        // In Kelvin's notation a tensor and the vector of its components have the same norm.
        let factor = |k: usize| if k < 3 { 1.0 } else { 2_f64.sqrt() };
        let kelvin = Matrix6::from_fn(|a, b| self.matrix[(a, b)] * factor(a) * factor(b));
        kelvin
            .symmetric_eigenvalues()
            .iter()
            .copied()
            .fold(0.0, f64::max)
    }
}

/// Return the indices, in Voigt's order, of the tensor components that exist in `D` dimensions.
fn components<const D: usize>() -> impl Iterator<Item = usize> {
    const ALL: [usize; 6] = [0, 1, 2, 3, 4, 5];
    let used: &[usize] = match D {
        3 => &ALL,
        2 => &PLANE,
        _ => &ALL[..1],
    };
    used.iter().copied()
}

/// Return the index of a component in Voigt's order.
fn voigt(a: usize, b: usize) -> usize {
    if a == b { a } else { 6 - a - b }
}

/// Return the factors `out_of_plane_factors` of [`Hooke`] for plane strain; `None` in other dimensions.
fn out_of_plane_row(matrix: &Matrix6<f64>, dimension: Dimension) -> Option<[f64; 3]> {
    let is_plane_strain = matches!(dimension, Dimension::PlaneStrain { .. });
    is_plane_strain.then(|| PLANE.map(|k| matrix[(2, k)]))
}

fn isotropic(given: &Given) -> Matrix6<f64> {
    let Isotropic {
        youngs_modulus: young,
        poisson_ratio: ratio,
    } = given.elastic;
    let shear = given.elastic.shear_modulus();
    let lambda = match given.dimension {
        Dimension::PlaneStress { .. } => young * ratio / (1.0 - ratio * ratio),
        _ => given.elastic.lame_lambda(),
    };
    Matrix6::from_fn(|a, b| match (a, b) {
        _ if a < 3 && b < 3 => lambda + if a == b { 2.0 * shear } else { 0.0 },
        _ if a == b => shear,
        _ => 0.0,
    })
}

/// Transform Hooke's matrix from the axes of the material to the axes of the body. The axes of the material
/// are rotated by Bunge's angles (rad).
fn turned(own: &Matrix6<f64>, [first, second, third]: [f64; 3]) -> Matrix6<f64> {
    let about = |axis, angle| Rotation3::from_axis_angle(&axis, angle);
    let (z, x) = (Vector3::z_axis(), Vector3::x_axis());
    let turn = (about(z, first) * about(x, second) * about(z, third)).into_inner();
    // C_ijkl = R_ia R_jb R_kc R_ld C_abcd.
    Matrix6::from_fn(|m, n| {
        let ((i, j), (k, l)) = (VOIGT[m], VOIGT[n]);
        let mut sum = 0.0;
        for (a, b) in pairs() {
            for (c, d) in pairs() {
                let factor = turn[(i, a)] * turn[(j, b)] * turn[(k, c)] * turn[(l, d)];
                sum += factor * own[(voigt(a, b), voigt(c, d))];
            }
        }
        sum
    })
}

fn pairs() -> impl Iterator<Item = (usize, usize)> {
    (0..3).flat_map(|a| (0..3).map(move |b| (a, b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shear_modulus_is_computed_for_moduli_of_any_size() {
        for modulus in [1e-300, 1.0, 5e307] {
            let mut matrix = Matrix6::identity() * modulus;
            for a in 0..3 {
                for b in 0..3 {
                    matrix[(a, b)] += modulus * if a == b { 2.0 } else { 1.0 };
                }
            }
            let hooke = Hooke {
                matrix,
                out_of_plane_factors: None,
            };
            for dimension in [Dimension::Space, Dimension::PlaneStrain { thickness: 1.0 }] {
                let found = hooke.shear_modulus(dimension);
                assert!((found / modulus - 1.0).abs() < 1e-12, "{found} {modulus}");
            }
        }
    }
}
