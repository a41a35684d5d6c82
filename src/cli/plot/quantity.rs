//! The drawn number of a point: a scalar field, or a component or invariant of a vector or tensor.

use fissure::error::{Error, Result};
use fissure::message::suggestion;
use fissure::output::StoredField;
use nalgebra::Matrix3;

/// The number that is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Entry of the stored values.
    Entry(usize),
    /// Length of a vector, √(A:A) of a tensor.
    Magnitude,
    /// √(3/2 s:s) of the deviator s of a symmetric tensor.
    VonMises,
    /// Eigenvalue of a symmetric tensor, the largest first.
    Principal(usize),
    Trace,
    Determinant,
}

/// A number per point, with its name and unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quantity {
    /// Name of the field.
    pub field: String,
    /// Name for the colour bar.
    pub label: String,
    /// Its unit; empty if dimensionless.
    pub unit: String,
    components: usize,
    kind: Kind,
}

/// Names of the invariants of fields with so many components.
fn invariants(components: usize) -> &'static [(&'static str, Kind)] {
    match components {
        2 | 3 => &[("magnitude", Kind::Magnitude)],
        6 => &[
            ("von_mises", Kind::VonMises),
            ("principal_1", Kind::Principal(0)),
            ("principal_2", Kind::Principal(1)),
            ("principal_3", Kind::Principal(2)),
            ("trace", Kind::Trace),
            ("magnitude", Kind::Magnitude),
        ],
        9 => &[
            ("magnitude", Kind::Magnitude),
            ("determinant", Kind::Determinant),
            ("trace", Kind::Trace),
        ],
        _ => &[],
    }
}

impl Quantity {
    /// A component or invariant of a field; by default the magnitude, or the von Mises equivalent of a symmetric
    /// tensor.
    ///
    /// # Errors
    /// If the field has no such component.
    pub fn new(field: &StoredField, component: Option<&str>) -> Result<Self> {
        let (names, invariants) = (field.component_names(), invariants(field.components));
        let kind = match component {
            None => invariants.first().map_or(Kind::Entry(0), |(_, kind)| *kind),
            Some(wanted) => {
                let entry = names.iter().position(|name| *name == wanted);
                let found = invariants.iter().find(|(name, _)| *name == wanted);
                let kind = entry.map(Kind::Entry).or(found.map(|(_, kind)| *kind));
                kind.ok_or_else(|| no_component(field, wanted, names, invariants))?
            }
        };
        let label = match kind {
            Kind::Entry(_) if names.is_empty() => field.name.clone(),
            Kind::Entry(entry) => format!("{} {}", field.name, names[entry]),
            _ => {
                let found = invariants.iter().find(|(_, known)| *known == kind);
                format!("{}, {}", field.name, found.map_or("", |(name, _)| name))
            }
        };
        Ok(Self {
            field: field.name.clone(),
            label,
            unit: match field.unit.as_str() {
                "1" => String::new(),
                _ if kind == Kind::Determinant => String::new(),
                unit => unit.to_owned(),
            },
            components: field.components,
            kind,
        })
    }

    /// The numbers of points with these stored values, row-major.
    pub fn of(&self, stored: Vec<f64>) -> Vec<f64> {
        if self.components == 1 {
            return stored;
        }
        stored
            .chunks_exact(self.components)
            .map(|entries| self.of_point(entries))
            .collect()
    }

    fn of_point(&self, entries: &[f64]) -> f64 {
        match self.kind {
            Kind::Entry(entry) => entries[entry],
            Kind::Magnitude => {
                let off_diagonal = if self.components == 6 { 2.0 } else { 1.0 };
                let square = |(k, entry): (usize, &f64)| {
                    entry * entry * if k < 3 { 1.0 } else { off_diagonal }
                };
                entries.iter().enumerate().map(square).sum::<f64>().sqrt()
            }
            Kind::VonMises => {
                let [xx, yy, zz, xy, yz, xz] = six(entries);
                let normal = (xx - yy).powi(2) + (yy - zz).powi(2) + (zz - xx).powi(2);
                (0.5 * normal + 3.0 * (xy * xy + yz * yz + xz * xz)).sqrt()
            }
            Kind::Principal(number) => {
                let [xx, yy, zz, xy, yz, xz] = six(entries);
                let tensor = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
                if !entries.iter().all(|entry| entry.is_finite()) {
                    return f64::NAN;
                }
                let mut values: [f64; 3] = tensor.symmetric_eigenvalues().into();
                values.sort_by(|a, b| b.total_cmp(a));
                values[number]
            }
            Kind::Trace if self.components == 6 => entries[..3].iter().sum(),
            Kind::Trace => entries[0] + entries[4] + entries[8],
            Kind::Determinant => Matrix3::from_row_slice(entries).determinant(),
        }
    }
}

/// The entries of a symmetric tensor.
fn six(entries: &[f64]) -> [f64; 6] {
    std::array::from_fn(|k| entries[k])
}

fn no_component(
    field: &StoredField,
    wanted: &str,
    names: &[&str],
    invariants: &[(&str, Kind)],
) -> Error {
    let name = &field.name;
    if names.is_empty() {
        return Error::input(format!(
            "--component {wanted}: `{name}` is a number per point, without components; leave the option out"
        ));
    }
    let known = names.iter().copied();
    let known = known.chain(invariants.iter().map(|(name, _)| *name));
    Error::input(format!(
        "--component {wanted}: `{name}` has no such component{}",
        suggestion(wanted, known)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use fissure::output::Number;

    fn field(name: &str, components: usize) -> StoredField {
        StoredField {
            name: name.to_owned(),
            unit: "Pa".to_owned(),
            components,
            number: Number::F64,
            dynamic: true,
        }
    }

    fn value(components: usize, component: &str, stored: &[f64]) -> f64 {
        let quantity = Quantity::new(&field("a", components), Some(component)).unwrap();
        quantity.of(stored.to_vec())[0]
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
    fn labels_say_what_is_drawn() {
        let label = |components, component| {
            Quantity::new(&field("stress", components), component)
                .unwrap()
                .label
        };
        assert_eq!(label(1, None), "stress");
        assert_eq!(label(3, None), "stress, magnitude");
        assert_eq!(label(6, None), "stress, von_mises");
        assert_eq!(label(6, Some("xy")), "stress xy");
        let wrong = |components, component| {
            Quantity::new(&field("stress", components), Some(component))
                .unwrap_err()
                .message
        };
        assert!(wrong(1, "x").contains("without components"));
        assert!(wrong(6, "vonmises").contains("did you mean `von_mises`"));
    }
}
