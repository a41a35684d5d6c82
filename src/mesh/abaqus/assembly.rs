//! Parts, instances and sets, and their assembly to a mesh.

use std::path::Path;

use nalgebra::{Rotation3, Vector3};
use rustc_hash::{FxHashMap, FxHashSet};

use super::super::{Elements, Group, Members, Mesh, Runs, fault, position};
use super::{Place, Reader};
use crate::error::{Error, Result, excerpt};

/// Largest number of nodes in the model and all instances together. Also the largest number of elements in
/// the model and all instances together.
const LARGEST: usize = u32::MAX as usize;

/// Nodes, elements and sets of the model, of a part or of an instance.
#[derive(Clone, Default)]
pub(super) struct Part {
    pub(super) name: String,
    pub(super) nodes: Vec<[f64; 3]>,
    pub(super) elements: Elements,
    /// Indices of nodes and elements, by the numbers in the file.
    pub(super) node_indices: FxHashMap<u64, u32>,
    pub(super) element_indices: FxHashMap<u64, u32>,
    pub(super) sets: Vec<Set>,
}

/// Kind of the members of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum MemberKind {
    Nodes,
    Elements,
}

/// Data lines of one keyword that defines or extends a set.
#[derive(Clone)]
pub(super) struct Set {
    pub(super) of: MemberKind,
    pub(super) name: String,
    pub(super) instance: Option<String>,
    pub(super) numbers: Vec<u64>,
    /// Ranges of numbers: first, last and step.
    pub(super) ranges: Vec<[u64; 3]>,
    /// Names of other sets that this set includes. An entry may also be a single member, given by an instance
    /// and a number, such as `part-1-1.7`.
    pub(super) names: Vec<String>,
    /// Whether the set consists of all nodes of the element sets in `names`.
    pub(super) is_nodes_of_elements: bool,
    pub(super) is_surface: bool,
    /// Whether the set is a union of the surfaces in `names`. A union of surfaces that consist of nodes also
    /// consists of nodes.
    pub(super) is_union: bool,
    /// Error for the use of a set that cannot be read; `None` if the set can be read.
    pub(super) unsupported: Option<Error>,
    pub(super) place: Place,
}

/// An instance, or the model, that has been appended to the mesh.
pub(super) struct Placed {
    name: String,
    node_indices: FxHashMap<u64, u32>,
    element_indices: FxHashMap<u64, u32>,
    first_node: u64,
    first_element: u64,
}

/// Position of an instance in the assembly: a translation, then a rotation.
pub(super) struct Instance {
    /// Name of the instance's part if the file does not define this part.
    pub(super) missing_part: Option<String>,
    pub(super) place: Place,
    pub(super) translation: Vector3<f64>,
    pub(super) rotation: Rotation3<f64>,
    /// A point on the axis of rotation.
    pub(super) pivot: Vector3<f64>,
    pub(super) position_lines_read: usize,
}

/// Return the full name of a set of an instance: `instance.name`, or only `name` if `instance` is empty.
fn qualified(instance: &str, name: &str) -> String {
    match instance {
        "" => name.to_owned(),
        _ => format!("{instance}.{name}"),
    }
}

/// If there are more than `limit` numbers, sort them and remove repeated numbers. Then set `limit` to more
/// than twice the number of remaining entries.
fn compact(numbers: &mut Vec<u64>, limit: &mut usize) {
    if numbers.len() > *limit {
        numbers.sort_unstable();
        numbers.dedup();
        *limit = 1024 + 2 * numbers.len();
    }
}

impl Reader {
    /// Move an instance to its position, and append it to the mesh.
    pub(super) fn place_instance(&mut self, part: Part, instance: &Instance) -> Result<()> {
        let mut part = part;
        for node in &mut part.nodes {
            let moved = Vector3::from(*node) + instance.translation;
            let turned = if instance.position_lines_read > 1 {
                instance.rotation * (moved - instance.pivot) + instance.pivot
            } else {
                moved
            };
            *node = position(turned.into()).map_err(|message| self.fault(message))?;
        }
        self.append(part)
    }

    /// Append the nodes, elements and sets of an instance, or of the model, to the mesh.
    fn append(&mut self, part: Part) -> Result<()> {
        let (first_node, first_element) = (self.mesh.nodes.len(), self.mesh.elements.len());
        if first_node + part.nodes.len() > LARGEST || first_element + part.elements.len() > LARGEST
        {
            return Err(self.fault("has more than 2³² nodes or elements"));
        }
        self.mesh.nodes.extend_from_slice(&part.nodes);
        self.mesh.elements.append(&part.elements, first_node as u32);
        let placed = Placed {
            name: part.name,
            node_indices: part.node_indices,
            element_indices: part.element_indices,
            first_node: first_node as u64,
            first_element: first_element as u64,
        };
        let is_instance = !placed.name.is_empty();
        let count = part.elements.len() as u64;
        if is_instance {
            let all = [placed.first_element, placed.first_element + count];
            let all = Runs::union([(&[all][..], 0)].into_iter());
            self.add_group(&placed.name, "instance", Members::Elements(all));
        }
        self.placed.push(placed);
        let own = self.placed.len() - 1;
        let mut known: FxHashMap<(MemberKind, String), Runs> = FxHashMap::default();
        let mut order = Vec::new();
        for mut set in part.sets {
            let name = qualified(&self.placed[own].name, &set.name);
            if let Some(error) = set.unsupported {
                let names = [name, set.name];
                let all = names.map(|name| (name, error.message.clone()));
                self.mesh.unsupported.extend(all);
                continue;
            }
            if set.is_union {
                set.of = self.kind_of_union(&set, own);
            }
            let members = self.members(&set, own, &known)?;
            if set.is_surface {
                let key = (set.of, name.to_ascii_uppercase());
                let all = self.surfaces.entry(key).or_default();
                *all = Runs::union([&*all, &members].map(|runs| (runs.ranges(), 0)).into_iter());
            }
            let key = (set.of, set.name.to_ascii_uppercase());
            if !known.contains_key(&key) {
                order.push((key.clone(), set.name));
            }
            let all = known.entry(key).or_default();
            *all = Runs::union([&*all, &members].map(|runs| (runs.ranges(), 0)).into_iter());
        }
        for (key, name) in order {
            let members = known.remove(&key).unwrap_or_default();
            let name = qualified(&self.placed[own].name, &name);
            self.add_set(&name, key.0, members);
        }
        Ok(())
    }

    fn add_set(&mut self, name: &str, of: MemberKind, members: Runs) {
        match of {
            MemberKind::Nodes => self.add_group(name, "node set", Members::Nodes(members)),
            MemberKind::Elements => self.add_group(name, "element set", Members::Elements(members)),
        }
    }

    fn add_group(&mut self, name: &str, kind: &'static str, members: Members) {
        self.mesh.groups.push(Group {
            name: Some(name.to_owned()),
            number: None,
            kind,
            is_entity: false,
            members,
        });
    }

    /// Return the mesh indices of the members of a set. `own` is the index in `placed` of the instance or
    /// model that contains the set. `known` holds the earlier sets of this instance or model.
    fn members(
        &self,
        set: &Set,
        own: usize,
        known: &FxHashMap<(MemberKind, String), Runs>,
    ) -> Result<Runs> {
        let what = match set.of {
            MemberKind::Nodes => "node",
            MemberKind::Elements => "element",
        };
        let instance = |name: &str| {
            let found = self
                .placed
                .iter()
                .find(|placed| placed.name.eq_ignore_ascii_case(name));
            found.ok_or_else(|| {
                set.place.fault(format!(
                    "set {}: there is no instance {}",
                    excerpt(&set.name),
                    excerpt(name)
                ))
            })
        };
        let home = match &set.instance {
            None => &self.placed[own],
            Some(name) => instance(name)?,
        };
        let index = |placed: &Placed, number: u64| {
            let (indices, first) = match set.of {
                MemberKind::Nodes => (&placed.node_indices, placed.first_node),
                MemberKind::Elements => (&placed.element_indices, placed.first_element),
            };
            indices.get(&number).map(|index| first + u64::from(*index))
        };
        let missing = |name: &dyn std::fmt::Display| {
            set.place.fault(format!(
                "set {}: there is no {what} {name}",
                excerpt(&set.name)
            ))
        };
        let mut members = Vec::new();
        let mut limit = 1024;
        for number in &set.numbers {
            members.push(index(home, *number).ok_or_else(|| missing(number))?);
        }
        let count = match set.of {
            MemberKind::Nodes => home.node_indices.len(),
            MemberKind::Elements => home.element_indices.len(),
        };
        let numbers = || match set.of {
            MemberKind::Nodes => home.node_indices.keys(),
            MemberKind::Elements => home.element_indices.keys(),
        };
        for [first, last, step] in &set.ranges {
            // Numbers without a node or element are skipped, as in Abaqus.
            if (last - first) / step < count as u64 {
                let range = (*first..=*last).step_by(usize::try_from(*step).unwrap_or(usize::MAX));
                members.extend(range.filter_map(|number| index(home, number)));
            } else {
                let chosen = numbers().filter(|number| {
                    (first..=last).contains(number) && (*number - first).is_multiple_of(*step)
                });
                members.extend(chosen.filter_map(|number| index(home, *number)));
            }
            compact(&mut members, &mut limit);
        }
        let of = if set.is_nodes_of_elements {
            MemberKind::Elements
        } else {
            set.of
        };
        for name in &set.names {
            if set.is_union {
                let full_name = qualified(set.instance.as_deref().unwrap_or(&home.name), name);
                if let Some(message) = self.mesh.unsupported(&full_name) {
                    return Err(Error::input(message));
                }
                let found = self.find_surface(of, name, set, own);
                let found = found
                    .ok_or_else(|| missing(&format!("surface {} before it", excerpt(name))))?;
                members.extend(found.iter());
                compact(&mut members, &mut limit);
                continue;
            }
            let found = self.find_set(of, name, set.instance.as_deref(), known);
            let qualified = || {
                // The name may be a number in an instance, such as `part-1-1.7`.
                let (name, number) = name.rsplit_once('.')?;
                let placed = instance(name).ok()?;
                index(placed, number.parse().ok()?)
            };
            match found {
                Some(found) if set.is_nodes_of_elements => {
                    for element in found.iter() {
                        let nodes = self.mesh.elements.nodes(element as usize);
                        members.extend(nodes.iter().map(|node| u64::from(*node)));
                    }
                }
                Some(found) => members.extend(found.iter()),
                None => members.push(
                    qualified()
                        .ok_or_else(|| missing(&format!("set {} before it", excerpt(name))))?,
                ),
            }
            compact(&mut members, &mut limit);
        }
        Ok(Runs::new(members))
    }

    /// Return the kind of the members of a union of surfaces.
    fn kind_of_union(&self, union: &Set, own: usize) -> MemberKind {
        let has_surface = |of: MemberKind| {
            let mut names = union.names.iter();
            names.any(|name| self.find_surface(of, name, union, own).is_some())
        };
        if has_surface(MemberKind::Nodes) && !has_surface(MemberKind::Elements) {
            MemberKind::Nodes
        } else {
            MemberKind::Elements
        }
    }

    /// Return the members of the surface that a union of surfaces lists as `name`. `own` is the index in
    /// `placed` of the instance or model that contains the union.
    fn find_surface(&self, of: MemberKind, name: &str, union: &Set, own: usize) -> Option<&Runs> {
        let own = &self.placed[own].name;
        let name = qualified(union.instance.as_ref().unwrap_or(own), name);
        self.surfaces.get(&(of, name.to_ascii_uppercase()))
    }

    /// Find the members of a set by its name, in `known` or among the groups of the mesh. With `instance`,
    /// find the set of this instance: a group of the mesh with a name such as `INSTANCE.NAME`.
    fn find_set(
        &self,
        of: MemberKind,
        name: &str,
        instance: Option<&str>,
        known: &FxHashMap<(MemberKind, String), Runs>,
    ) -> Option<Runs> {
        let qualified = match instance {
            Some(instance) => format!("{instance}.{name}"),
            None => {
                if let Some(members) = known.get(&(of, name.to_ascii_uppercase())) {
                    return Some(members.clone());
                }
                name.to_owned()
            }
        };
        self.mesh.groups.iter().find_map(|group| {
            let same = group.name.as_ref()?.eq_ignore_ascii_case(&qualified);
            match (&group.members, of) {
                (Members::Nodes(members), MemberKind::Nodes) if same => Some(members.clone()),
                (Members::Elements(members), MemberKind::Elements) if same => Some(members.clone()),
                _ => None,
            }
        })
    }

    pub(super) fn finish(mut self, path: &Path) -> Result<Mesh> {
        if let Some(open) = &self.current {
            let message = format!("part or instance {} has no end", excerpt(&open.name));
            return Err(fault(path, 0, message));
        }
        if let Some(place) = &self.assembly {
            return Err(place.fault("*ASSEMBLY has no *END ASSEMBLY; is the file complete?"));
        }
        if self.placed.is_empty() && !self.parts.is_empty() && self.model.elements.is_empty() {
            return Err(fault(path, 0, "has parts but no *INSTANCE of one"));
        }
        let model = std::mem::take(&mut self.model);
        self.append(model)?;
        self.add_bare_names();
        Ok(self.mesh)
    }

    /// For each set name that occurs in instances, add a group of this name. The group holds the members of
    /// the sets of this name in all instances. If the assembly has a set with this name, no group is added.
    fn add_bare_names(&mut self) {
        let prefixes: FxHashSet<String> = self
            .placed
            .iter()
            .map(|placed| placed.name.to_ascii_uppercase())
            .collect();
        let mut bare: FxHashMap<(MemberKind, String), usize> = FxHashMap::default();
        let mut unions: Vec<(MemberKind, String, Vec<Runs>)> = Vec::new();
        let mut taken: FxHashSet<(MemberKind, String)> = FxHashSet::default();
        for group in &self.mesh.groups {
            let Some(name) = &group.name else { continue };
            let (of, members) = match &group.members {
                Members::Nodes(members) => (MemberKind::Nodes, members),
                Members::Elements(members) => (MemberKind::Elements, members),
            };
            taken.insert((of, name.to_ascii_uppercase()));
            let parts = name
                .match_indices('.')
                .map(|(at, _)| (&name[..at], &name[at + 1..]));
            let mut parts =
                parts.filter(|(prefix, _)| prefixes.contains(&prefix.to_ascii_uppercase()));
            if let Some((_, short)) = parts.next() {
                let index = *bare
                    .entry((of, short.to_ascii_uppercase()))
                    .or_insert_with(|| {
                        unions.push((of, short.to_owned(), Vec::new()));
                        unions.len() - 1
                    });
                unions[index].2.push(members.clone());
            }
        }
        for (of, name, all) in unions {
            if !taken.contains(&(of, name.to_ascii_uppercase())) {
                let members = Runs::union(all.iter().map(|runs| (runs.ranges(), 0)));
                self.add_set(&name, of, members);
            }
        }
    }
}
