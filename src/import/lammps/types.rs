//! Changes of atom types in LAMMPS: `set … type`.

use super::groups::{Group, find, has_atoms, named_region, region_of};
use super::{Atoms, Model};
use crate::import::regions::Region;

/// Set the type of the selected atoms to `kind`. `arguments` are the arguments of `set`, which select the
/// atoms. If a region selects the atoms, the selected part of each body becomes a separate body.
///
/// # Errors
/// If the import cannot find the selected atoms, or if the script has already defined a group of a type.
/// `Err` holds the reason.
pub(super) fn retype(model: &mut Model, arguments: &[&str], kind: u32) -> Result<(), &'static str> {
    if model
        .groups
        .iter()
        .any(|(_, group, _)| matches!(group, Group::Type(_)))
    {
        return Err("a group of a type is defined before atoms change their type");
    }
    let selected = match arguments {
        ["region", name, ..] => named_region(model, name),
        ["group", name, ..] if find(model, name) == Some(Group::All) => None,
        ["group", name, ..] => region_of(model, name),
        _ => None,
    };
    let Some(selected) = selected else {
        let of = match arguments {
            ["group", "all", ..] => None,
            ["type", of, ..] => Some(of.parse::<u32>().map_err(|_| NOT_KNOWN)?),
            _ => return Err(NOT_KNOWN),
        };
        for atoms in &mut model.atoms {
            if of.is_none_or(|of| of == atoms.kind) {
                atoms.kind = kind;
            }
        }
        return Ok(());
    };
    let mut parts = Vec::new();
    for Atoms {
        kind: own,
        region,
        name,
    } in model.atoms.drain(..)
    {
        if own == kind {
            parts.push(Atoms {
                kind: own,
                region,
                name,
            });
            continue;
        }
        let inside = match &selected {
            Region::Block(lower, upper) => region.clipped([*lower, *upper]),
            other => region.clone().intersection(other.clone()),
        };
        let outside = Region::Difference(vec![region, selected.clone()]);
        parts.push(Atoms {
            kind: own,
            region: outside,
            name: name.clone(),
        });
        parts.push(Atoms {
            kind,
            region: inside,
            name,
        });
    }
    model.atoms = parts;
    let is_empty = |atoms: &Atoms| has_atoms(model, &atoms.region) == Some(false);
    let empty: Vec<bool> = model.atoms.iter().map(is_empty).collect();
    let mut empty = empty.into_iter();
    model.atoms.retain(|_| empty.next() != Some(true));
    Ok(())
}

/// Reason for leaving out a `set … type` whose atoms cannot be found.
const NOT_KNOWN: &str = "types are those of all atoms, of a type, a region or a group of a region";
