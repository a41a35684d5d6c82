//! Components and invariants of vectors and tensors. The order of the components is the order in which a
//! result stores them.

use nalgebra::Matrix3;

/// Names of the components of a vector.
pub const AXES: [&str; 3] = ["x", "y", "z"];

/// Names of the components of a symmetric tensor, in the order in which a result stores them.
const SYMMETRIC: [&str; 6] = ["xx", "yy", "zz", "xy", "yz", "xz"];

/// Names of the components of a tensor, row by row.
const TENSOR: [&str; 9] = ["xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"];

/// A component or invariant: a number computed from the values of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Component {
    /// The value with this index.
    Entry(usize),
    /// Length of a vector; √(A:A) of a tensor A.
    Magnitude,
    /// √(3/2 s:s) of the deviator s of a symmetric tensor.
    VonMises,
    /// Eigenvalue of a symmetric tensor; index 0 is the largest.
    Principal(usize),
    /// Sum of the diagonal entries of a tensor.
    Trace,
    /// Determinant of a tensor.
    Determinant,
}

/// Return the names of the components of a field with this number of values per point. Only fields with 2, 3,
/// 6 or 9 values have component names. For all other fields, the result is empty.
pub fn names(components: usize) -> &'static [&'static str] {
    match components {
        2 => &AXES[..2],
        3 => &AXES,
        6 => &SYMMETRIC,
        9 => &TENSOR,
        _ => &[],
    }
}

/// Return the index and name of each component that a field has in a problem of this dimension. `components`
/// is the number of stored values per point. A scalar has one component, without a name. A symmetric tensor
/// (stress or strain) has three normal components in any dimension.
pub fn entries(
    components: usize,
    dimension: usize,
) -> impl Iterator<Item = (usize, &'static str)> + Clone {
    let all = if components == 1 {
        &[""]
    } else {
        names(components)
    };
    let is_there = move |(entry, name): &(usize, &str)| {
        let is_normal = components == 6 && *entry < 3;
        is_normal || name.chars().all(|axis| "xyz"[..dimension].contains(axis))
    };
    all.iter().copied().enumerate().filter(is_there)
}

/// Return the name and the [`Component`] of each invariant of a field with this number of values per point.
pub fn invariants(components: usize) -> &'static [(&'static str, Component)] {
    match components {
        2 | 3 => &[("magnitude", Component::Magnitude)],
        6 => &[
            ("von_mises", Component::VonMises),
            ("principal_1", Component::Principal(0)),
            ("principal_2", Component::Principal(1)),
            ("principal_3", Component::Principal(2)),
            ("trace", Component::Trace),
            ("magnitude", Component::Magnitude),
        ],
        9 => &[
            ("magnitude", Component::Magnitude),
            ("determinant", Component::Determinant),
            ("trace", Component::Trace),
        ],
        _ => &[],
    }
}

impl Component {
    /// Compute this component or invariant from the values of a point. A [`Self::Principal`] is NaN if any of
    /// these values is not finite.
    pub fn of(self, values: &[f64]) -> f64 {
        match self {
            Self::Entry(entry) => values[entry],
            Self::Magnitude => {
                let off_diagonal = if values.len() == 6 { 2.0 } else { 1.0 };
                let square = |(k, entry): (usize, &f64)| {
                    entry * entry * if k < 3 { 1.0 } else { off_diagonal }
                };
                values.iter().enumerate().map(square).sum::<f64>().sqrt()
            }
            Self::VonMises => {
                let [xx, yy, zz, xy, yz, xz] = six(values);
                let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
                (0.5 * normal + 3.0 * (xy * xy + yz * yz + xz * xz)).sqrt()
            }
            Self::Principal(number) => {
                let [xx, yy, zz, xy, yz, xz] = six(values);
                let tensor = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
                // The eigenvalue iteration does not end for values that are not finite.
                if !values.iter().all(|entry| entry.is_finite()) {
                    return f64::NAN;
                }
                let mut principal: [f64; 3] = tensor.symmetric_eigenvalues().into();
                principal.sort_by(|a, b| b.total_cmp(a));
                principal[number]
            }
            Self::Trace if values.len() == 6 => values[..3].iter().sum(),
            Self::Trace => values[0] + values[4] + values[8],
            Self::Determinant => Matrix3::from_row_slice(values).determinant(),
        }
    }
}

/// Return the six stored components of a symmetric tensor, in the order of [`SYMMETRIC`].
fn six(values: &[f64]) -> [f64; 6] {
    std::array::from_fn(|k| values[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(components: usize, name: &str, values: &[f64]) -> f64 {
        let entry = names(components).iter().position(|known| *known == name);
        let invariant = invariants(components)
            .iter()
            .find(|(known, _)| *known == name);
        let component = entry
            .map(Component::Entry)
            .or(invariant.map(|found| found.1));
        component.unwrap().of(values)
    }

    #[test]
    fn invariants_of_known_states() {
        let close = |value: f64, wanted: f64| {
            assert!(
                (value - wanted).abs() < 1e-12 * wanted.abs().max(1.0),
                "{value} {wanted}"
            );
        };
        // Uniaxial tension, pure shear, pressure.
        let tension = [0.0, 5.0, 0.0, 0.0, 0.0, 0.0];
        let shear = [0.0, 0.0, 0.0, 0.0, 2.0, 0.0];
        let pressure = [-3.0, -3.0, -3.0, 0.0, 0.0, 0.0];
        for (state, von_mises, first, third, trace, magnitude) in [
            (tension, 5.0, 5.0, 0.0, 5.0, 5.0),
            (shear, 12_f64.sqrt(), 2.0, -2.0, 0.0, 8_f64.sqrt()),
            (pressure, 0.0, -3.0, -3.0, -9.0, 27_f64.sqrt()),
        ] {
            close(value(6, "von_mises", &state), von_mises);
            close(value(6, "principal_1", &state), first);
            close(value(6, "principal_3", &state), third);
            close(value(6, "trace", &state), trace);
            close(value(6, "magnitude", &state), magnitude);
        }
        close(value(6, "principal_2", &shear), 0.0);
        close(value(6, "yz", &shear), 2.0);
        close(value(3, "magnitude", &[2.0, 3.0, 6.0]), 7.0);
        let rows = [2.0, 1.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 4.0];
        close(value(9, "determinant", &rows), 24.0);
        close(value(9, "trace", &rows), 9.0);
        close(value(9, "xy", &rows), 1.0);
    }

    #[test]
    fn components_that_a_dimension_has() {
        let of = |components, dimension| {
            let found = entries(components, dimension).map(|(_, name)| name);
            found.collect::<Vec<_>>().join(" ")
        };
        assert_eq!(of(1, 2), "");
        assert_eq!(entries(1, 3).count(), 1);
        assert_eq!([of(3, 1), of(3, 2), of(3, 3)], ["x", "x y", "x y z"]);
        assert_eq!(of(6, 1), "xx yy zz");
        assert_eq!(of(6, 2), "xx yy zz xy");
        assert_eq!(of(6, 3), "xx yy zz xy yz xz");
        assert_eq!(of(9, 2), "xx xy yx yy");
        let indices: Vec<usize> = entries(9, 2).map(|(index, _)| index).collect();
        assert_eq!(indices, [0, 1, 3, 4]);
    }
}
