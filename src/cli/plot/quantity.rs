//! The drawn number of a point: a scalar field, or a component or invariant of a vector or tensor.

use fissure::component::{Component, invariants};
use fissure::error::{Error, Result};
use fissure::message::suggestion;
use fissure::output::StoredField;

/// A number per point, with name and unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quantity {
    /// Name of the field.
    pub field: String,
    /// Name of the quantity, as written on the colour bar.
    pub label: String,
    /// Unit of the quantity; empty if dimensionless.
    pub unit: String,
    /// Number of components of the field.
    pub components: usize,
    kind: Component,
}

impl Quantity {
    /// Create the quantity for a component or invariant of a field. If `component` is `None`, the kind of the
    /// field determines the quantity: the value of a scalar, the magnitude of a vector or a full tensor, or
    /// the von Mises equivalent of a symmetric tensor.
    ///
    /// # Errors
    /// If the field has no component or invariant with this name.
    pub fn new(field: &StoredField, component: Option<&str>) -> Result<Self> {
        let (names, invariants) = (field.component_names(), invariants(field.components));
        let kind = match component {
            None => invariants
                .first()
                .map_or(Component::Entry(0), |(_, kind)| *kind),
            Some(wanted) => {
                let entry = names.iter().position(|name| *name == wanted);
                let found = invariants.iter().find(|(name, _)| *name == wanted);
                let kind = entry.map(Component::Entry).or(found.map(|(_, kind)| *kind));
                kind.ok_or_else(|| no_component(field, wanted, names, invariants))?
            }
        };
        let label = match kind {
            Component::Entry(_) if names.is_empty() => field.name.clone(),
            Component::Entry(entry) => format!("{} {}", field.name, names[entry]),
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
                _ if kind == Component::Determinant => String::new(),
                unit => unit.to_owned(),
            },
            components: field.components,
            kind,
        })
    }

    /// Compute the quantity of each point. `stored` contains the values of the field, point by point, with
    /// the components of a point together.
    pub fn of(&self, stored: Vec<f64>) -> Vec<f64> {
        if self.components == 1 {
            return stored;
        }
        stored
            .chunks_exact(self.components)
            .map(|values| self.kind.of(values))
            .collect()
    }
}

fn no_component(
    field: &StoredField,
    wanted: &str,
    names: &[&str],
    invariants: &[(&str, Component)],
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
