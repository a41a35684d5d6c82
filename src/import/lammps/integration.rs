//! Time integration of LAMMPS: atoms that no fix integrates do not move.

use super::Model;
use super::fixes::without_suffix;
use super::groups::{NO_SET, has_atoms, region_of, write_set};
use crate::import::draft::{Section, Value};
use crate::import::log::NO_INTEGRATION;
use crate::import::regions::Region;
use crate::import::script::Command;
use crate::import::translation::Translation;

/// Fix styles that integrate the motion of atoms. Each entry is the part of a style before the first `/`: the
/// entry `nve` also stands for `nve/limit`.
const INTEGRATORS: [&str; 8] = ["move", "nph", "npt", "nve", "nvk", "nvt", "poems", "rigid"];

/// Name of the set of points that no fix integrates, and of the condition that holds these points.
const HELD: &str = "held";

/// Write a condition with velocity 0 for the points that no fix integrates. `fixes` are the fixes that act in
/// the first run, and `run` is its command.
pub(super) fn hold(
    translation: &mut Translation,
    model: &Model,
    fixes: &[&Command],
    run: Option<&Command>,
) {
    // The first three arguments of a fix are id, group and style.
    let integrates = |fix: &Command| {
        let style = fix.words.get(3).map_or("", |style| without_suffix(style));
        INTEGRATORS.contains(&style.split('/').next().unwrap_or(""))
    };
    let integrators: Vec<&&Command> = fixes.iter().filter(|fix| integrates(fix)).collect();
    if integrators.is_empty() {
        if let Some(run) = run {
            translation.log.approximated(&run.node, NO_INTEGRATION);
        }
        return;
    }
    if integrators.iter().any(|fix| fix.words[2] == "all") {
        return;
    }
    let all = region_of(model, "all");
    let mut parts = Vec::from_iter(all.clone());
    for fix in &integrators {
        let Some(region) = region_of(model, &fix.words[2]) else {
            let note = format!("{NO_SET}; points outside of it do not move in LAMMPS");
            translation.leave_out_load(&fix.node, "condition", HELD, &note);
            return;
        };
        let is_all = |all: &Region| region == *all || region.covers(all.bounds());
        if all.as_ref().is_some_and(is_all) {
            return;
        }
        parts.push(region);
    }
    let rest = Region::Difference(parts);
    match has_atoms(model, &rest) {
        Some(true) => {}
        Some(false) => return,
        None => {
            let note = "the lattice is too large to find the points that no fix integrates; they do not move in LAMMPS";
            translation.leave_out_load(&integrators[0].node, "condition", HELD, note);
            return;
        }
    }
    let set = write_set(translation, model, HELD, &rest);
    let written = translation.new_name("condition", HELD);
    let mut section = Section::new(format!("condition.{written}"));
    section.comment("In LAMMPS, points that no fix such as `nve` integrates do not move.");
    section
        .set("set", Value::text(set))
        .set("velocity", Value::numbers(&[0.0; 3]));
    translation.add(section);
    for fix in integrators {
        let note = format!("[condition.{written}] holds the points that no fix integrates");
        translation.log.taken(&fix.node, note);
    }
}
