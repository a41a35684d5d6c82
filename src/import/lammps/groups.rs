//! Groups of LAMMPS: their regions, and their sets in the new deck.

use super::Model;
use crate::import::draft::Section;
use crate::import::regions::Region;
use crate::import::translation::Translation;

/// Largest number of lattice sites that are tested for atoms.
const MOST_SITES: usize = 10_000_000;

/// Reason for leaving out a command whose group has no counterpart in the new deck.
pub(super) const NO_SET: &str = "its group is no body or region";

/// Atoms that a group selects: all atoms, the atoms of a type, the atoms in a named region, or another
/// selection, which has no counterpart.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Group {
    All,
    Type(u32),
    Region(String),
    Other,
}

/// Return the selection of a group by its name; `None` for an unknown group.
pub(super) fn find(model: &Model, name: &str) -> Option<Group> {
    if name == "all" {
        return Some(Group::All);
    }
    let mut groups = model.groups.iter();
    let found = groups.find(|(other, ..)| other == name);
    found.map(|(_, group, _)| group.clone())
}

/// Return a region by its name, with bounds of the box in place of infinite bounds. Return `None` if no
/// region with this name has been translated.
pub(super) fn named_region(model: &Model, name: &str) -> Option<Region> {
    let mut regions = model.regions.iter();
    let (_, region, _) = regions.find(|(other, ..)| other == name)?;
    let region = region.clone();
    Some(match model.bounds {
        Some(bounds) => region.within(bounds),
        None => region,
    })
}

/// Return a region that contains the atoms of a group and no other atoms. Return `None` if the group has no
/// counterpart or no atoms.
pub(super) fn region_of(model: &Model, name: &str) -> Option<Region> {
    let kind = match find(model, name)? {
        Group::All => None,
        Group::Type(kind) => Some(kind),
        Group::Region(region) => return named_region(model, &region),
        Group::Other => return None,
    };
    let is_in = |of: u32| kind.is_none_or(|kind| kind == of);
    let atoms = model.atoms.iter().filter(|atoms| is_in(atoms.kind));
    let mut parts: Vec<Region> = atoms.map(|atoms| atoms.region.clone()).collect();
    match parts.len() {
        0 | 1 => parts.pop(),
        _ => Some(Region::Union(parts)),
    }
}

/// Return the name of the set that replaces a group in the new deck. Write the set if the new deck does not
/// have it yet. Return `None` if the group has no counterpart.
pub(super) fn set(
    translation: &mut Translation,
    model: &Model,
    bodies: &[(u32, String, String)],
    name: &str,
) -> Option<String> {
    match find(model, name)? {
        Group::All => Some("all".to_owned()),
        Group::Type(kind) => {
            let mut of_type = bodies.iter().filter(|(of, ..)| *of == kind);
            match (of_type.next(), of_type.next()) {
                (Some((.., body)), None) => Some(body.clone()),
                _ => None,
            }
        }
        Group::Region(region) => {
            let region = named_region(model, &region)?;
            let taken = bodies.iter().any(|(.., body)| body == name);
            let wanted = if taken {
                format!("group {name}")
            } else {
                name.to_owned()
            };
            Some(write_set(translation, model, &wanted, &region))
        }
        Group::Other => None,
    }
}

/// Return the name of a set with the points of a group that are in a region at the start. Write the set if
/// the new deck does not have it yet. `Err` holds the reason why there is no such set.
pub(super) fn set_in_region(
    translation: &mut Translation,
    model: &Model,
    group: &str,
    region: &str,
) -> Result<String, &'static str> {
    let shape = named_region(model, region).ok_or("its region has no shape")?;
    let (wanted, shape) = match group {
        "all" => (format!("region {region}"), shape),
        group => {
            let of_group = region_of(model, group).ok_or(NO_SET)?;
            (format!("{group} in {region}"), of_group.intersection(shape))
        }
    };
    if has_atoms(model, &shape) == Some(false) {
        return Err("no atom of its group is in its region at the start");
    }
    Ok(write_set(translation, model, &wanted, &shape))
}

/// Return the name of a set with the points of a region. Write the set if the new deck does not have it yet.
/// The name follows from `wanted`; calls with the same `wanted` return the same set.
pub(super) fn write_set(
    translation: &mut Translation,
    model: &Model,
    wanted: &str,
    region: &Region,
) -> String {
    let written = translation.name("set", wanted);
    let header = format!("set.{written}");
    if !translation.draft.has(&header) {
        let mut section = Section::new(header);
        section.set("shape", region.shape(model.spacing.unwrap_or(1.0)));
        translation.add(section);
    }
    written
}

/// Test whether a region contains an atom at the start of the run. Return `None` if no atom is found, but the
/// lattice is too large to test every site.
pub(super) fn has_atoms(model: &Model, region: &Region) -> Option<bool> {
    let (mut atoms, is_complete) = atoms_in(model, region);
    let is_found = atoms.next().is_some();
    (is_found || is_complete).then_some(is_found)
}

/// Return the positions of the atoms in a region at the start of the run, and whether the list is complete.
/// If the region has more than `MOST_SITES` lattice sites, only every n-th site in each direction is tested,
/// so the list is incomplete.
pub(super) fn atoms_in<'m>(
    model: &'m Model,
    region: &'m Region,
) -> (impl Iterator<Item = [f64; 3]> + 'm, bool) {
    let spacing = model.spacing.unwrap_or(1.0);
    let bounds = region.bounds();
    let index = |corner: usize, k: usize| bounds[corner][k] / spacing - model.origin[k];
    let first = [0, 1, 2].map(|k| index(0, k).floor());
    let last = [0, 1, 2].map(|k| index(1, k).ceil());
    let count: f64 = (0..3).map(|k| last[k] - first[k] + 1.0).product();
    let step = (count / MOST_SITES as f64).cbrt().ceil().max(1.0) as usize;
    let sites = move |k: usize| {
        let site = move |n: i64| (n as f64 + model.origin[k]) * spacing;
        let range = first[k] as i64..=last[k] as i64;
        range.step_by(step).map(site)
    };
    let is_atom = move |point: &[f64; 3]| {
        let mut atoms = model.atoms.iter();
        let is_in = |region: &Region| region.contains(*point, spacing);
        is_in(region) && atoms.any(|atoms| is_in(&atoms.region))
    };
    let planes = sites(0).flat_map(move |x| sites(1).map(move |y| (x, y)));
    let all = planes.flat_map(move |(x, y)| sites(2).map(move |z| [x, y, z]));
    let atoms = all.take(MOST_SITES).filter(is_atom);
    (atoms, count <= MOST_SITES as f64)
}
