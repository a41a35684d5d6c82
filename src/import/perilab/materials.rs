//! Material, damage and thermal models of PeriLab.

use crate::error::{Result, excerpt};
use crate::import::bodies::{Criterion, DamageModel};
use crate::import::draft::{Section, Value};
use crate::import::elastic::Constants;
use crate::import::log::{DOUBLED_SHEAR, Fate, HALVED_SHEAR, UNDAMPED_DAMAGE};
use crate::import::translation::Translation;
use crate::import::tree::{Node, is_key};

/// Laws for the material models. Each entry has three texts: a part of the model's name, the law, and how the
/// law differs from the model. The first match is used. If the law is empty, the model has no counterpart.
const MATERIALS: [(&str, &str, &str); 9] = [
    (
        "unified bond-based",
        "ordinary",
        "state-based in place of bonds with two constants",
    ),
    ("1d bond-based", "pmb", ""),
    ("bond-based elastic", "pmb", ""),
    ("pd solid plastic", "ordinary_plastic", ""),
    ("pd solid elastic", "ordinary", ""),
    ("correspondence plastic", "correspondence", ""),
    ("correspondence elastic", "correspondence", ""),
    ("correspondence umat", "", ""),
    ("correspondence vumat", "", ""),
];

/// Elastic constants by precedence. If more than two are given, PeriLab computes the moduli from the two that
/// come first in this list.
const PRECEDENCE: [&str; 4] = [
    "bulk_modulus",
    "poisson_ratio",
    "shear_modulus",
    "youngs_modulus",
];

/// Log note for an elastic constant that PeriLab ignores.
const IGNORED: &str = "PeriLab computes it from the other constants";

/// Constants of an orthotropic solid. Each entry has the name in PeriLab, the key in the new deck, and
/// whether the new deck has this constant in plane stress.
const ORTHOTROPIC: [(&str, &str, bool); 9] = [
    ("Young's Modulus X", "youngs_modulus_x", true),
    ("Young's Modulus Y", "youngs_modulus_y", true),
    ("Young's Modulus Z", "youngs_modulus_z", false),
    ("Poisson's Ratio XY", "poisson_ratio_xy", true),
    ("Poisson's Ratio YZ", "poisson_ratio_yz", false),
    ("Poisson's Ratio XZ", "poisson_ratio_xz", false),
    ("Shear Modulus XY", "shear_modulus_xy", true),
    ("Shear Modulus YZ", "shear_modulus_yz", false),
    ("Shear Modulus XZ", "shear_modulus_xz", false),
];

/// Pairs of equal constants of a transversely isotropic solid. Each entry has the key of a constant that the
/// source deck does not give, and the key of the constant with the same value, both in the new deck. The
/// isotropic plane is that of y and z.
const TRANSVERSE: [(&str, &str); 3] = [
    ("youngs_modulus_z", "youngs_modulus_y"),
    ("poisson_ratio_xz", "poisson_ratio_xy"),
    ("shear_modulus_xz", "shear_modulus_xy"),
];

/// Relative tolerance for the comparison of elastic constants.
const ROUND_OFF: f64 = 1e-6;

/// Thermal expansion of a material.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Expansion {
    /// Name of the thermal model.
    pub(super) name: String,
    pub(super) coefficient: Value,
    pub(super) reference: Option<Value>,
}

/// A material of the source deck, without its density. PeriLab reads the density from the blocks.
pub(super) struct Model<'n> {
    pub(super) name: &'n str,
    pub(super) node: &'n Node,
    pub(super) law: &'static str,
    pub(super) constants: Constants,
}

impl Model<'_> {
    /// Test whether the new material is anisotropic, so that its axes have a direction.
    pub(super) fn has_axes(&self) -> bool {
        let is_hooke = |name: &str| {
            let digits = name.trim().strip_prefix(['C', 'c']);
            digits.is_some_and(|digits| digits.parse().is_ok_and(|digits: u8| digits < 70))
        };
        let mut names = self.node.entries().iter().map(|(name, _)| name);
        self.law.contains("correspondence")
            && names.any(|name| {
                is_hooke(name) || ORTHOTROPIC.iter().any(|(known, ..)| is_key(name, known))
            })
    }
}

/// Models to which the blocks refer.
pub(super) struct Laws<'n> {
    pub(super) models: Vec<Model<'n>>,
    pub(super) damages: Vec<DamageModel>,
    pub(super) expansions: Vec<Expansion>,
    /// Whether a solver of the deck uses a stiffness matrix.
    pub(super) has_matrix: bool,
}

pub(super) fn read_materials<'n>(
    translation: &mut Translation,
    node: &'n Node,
) -> Result<Vec<Model<'n>>> {
    let mut materials = Vec::new();
    for (name, table) in node.tables() {
        let model =
            translation.required(table, "Material Model", &format!("the material `{name}`"))?;
        let text = translation.text(model, "Material Model")?;
        let lower = text.to_lowercase();
        let known = MATERIALS.iter().find(|(part, ..)| lower.contains(part));
        let Some((_, law, difference)) = known.filter(|(_, law, _)| !law.is_empty()) else {
            let note = format!("{} has no counterpart", excerpt(text));
            translation.log.left_out(table, note);
            continue;
        };
        let associated = table.get("Bond Associated");
        let law = match associated {
            Some(node) if *law == "correspondence" && translation.is_true(node) => {
                translation
                    .log
                    .approximated(node, "another bond-associated formulation");
                "bond_associated_correspondence"
            }
            Some(node) => {
                translation
                    .log
                    .taken(node, "the law is not bond-associated");
                law
            }
            None => law,
        };
        if difference.is_empty() {
            translation.log.taken(model, format!("the law {law}"))
        } else {
            translation
                .log
                .approximated(model, format!("the law {law}: {difference}"))
        }
        let mut constants = Constants::read(translation, table)?;
        if law != "pmb" {
            for key in constants.keep_two(&PRECEDENCE) {
                if let Some(node) = Constants::node(table, key) {
                    translation.log.replace(node, Fate::LeftOut, IGNORED);
                }
            }
        }
        materials.push(Model {
            name,
            node: table,
            law,
            constants,
        });
    }
    Ok(materials)
}

/// Write a material with the density of a block.
pub(super) fn write_material(
    translation: &mut Translation,
    model: &Model,
    written: &str,
    density: Value,
    damping: Option<f64>,
    angles: [f64; 3],
    expansion: Option<&Expansion>,
) -> Result<()> {
    let mut section = Section::new(format!("material.{written}.{}", model.law));
    section.set("density", density);
    let table = model.node;
    let is_correspondence = model.law.contains("correspondence");
    let anisotropic = anisotropic(translation, table, is_correspondence, &mut section)?;
    let enough = match model.law {
        "pmb" => write_bonds(translation, model, &mut section),
        _ if anisotropic => true,
        _ => {
            model.constants.write_two(&mut section);
            model.constants.count() >= 2
        }
    };
    if !enough {
        let message = format!(
            "the material `{}` has too few elastic constants",
            model.name
        );
        return Err(translation.error(table.line, message));
    }
    if let Some(damping) = damping {
        section.set("damping", Value::number(damping));
    }
    let yields = model.law == "ordinary_plastic" || (model.law == "correspondence" && !anisotropic);
    let yield_stress = table.get("Yield Stress").filter(|_| yields);
    if is_correspondence {
        write_stress(translation, model, yield_stress, expansion, &mut section);
    }
    if anisotropic {
        for (key, angle) in ["angle_1", "angle_2", "angle_3"].into_iter().zip(angles) {
            if angle != 0.0 {
                section.set(key, Value::number(angle));
            }
        }
    }
    if let Some(expansion) = expansion {
        section.set("thermal_expansion", expansion.coefficient.clone());
        if let Some(reference) = &expansion.reference {
            section.set("reference_temperature", reference.clone());
        }
    }
    let control = table.get("Zero Energy Control");
    if model.law == "correspondence" {
        match control {
            Some(node) => {
                translation.log.taken(node, "zero_energy = \"wan2019\"");
                section.set("zero_energy", Value::text("wan2019"));
            }
            None => {
                section.set("zero_energy", Value::text("none"));
            }
        }
    } else if let Some(node) = control {
        translation
            .log
            .taken(node, "this law has no modes of zero energy");
    }
    if let Some(node) = yield_stress {
        translation.log.taken(node, "yield_stress of the material");
        section.set(
            "yield_stress",
            translation.number_value(node, "Yield Stress")?,
        );
    }
    if model.law == "ordinary_plastic" {
        section.set("calibration", Value::text("continuum"));
    }
    if let Some(node) = table.get("Density") {
        translation
            .log
            .left_out(node, "the density of the block counts");
    }
    translation.add(section);
    Ok(())
}

/// Write the stress of a correspondence law. PeriLab takes C:E as the Cauchy stress, with the Green–Lagrange
/// strain E. In the new deck, bodies that yield and bodies that expand in plane strain do not have this
/// stress.
fn write_stress(
    translation: &Translation,
    model: &Model,
    yield_stress: Option<&Node>,
    expansion: Option<&Expansion>,
    section: &mut Section,
) {
    let is_confined = translation.draft.top_is("dimension", "plane-strain");
    let Some(node) = model.node.get("Material Model") else {
        return;
    };
    let note = if yield_stress.is_some() {
        "bodies that yield have St. Venant–Kirchhoff's stress, not C:E as Cauchy stress"
    } else if expansion.is_some() && is_confined {
        "bodies that expand in plane strain have St. Venant–Kirchhoff's stress, not C:E as Cauchy stress"
    } else {
        section.set("stress", Value::text("willberg2022"));
        "stress = \"willberg2022\""
    };
    translation.log.approximated(node, note);
    if let Some(note) = shear_note(model, translation.dimension) {
        translation.log.approximated(node, note);
    }
}

/// Return the log note on the shear stress of a correspondence law; `None` if PeriLab's shear stress is that
/// of Hooke's law.
///
/// For some symmetries, Hooke's matrix of PeriLab contains 2G in place of G. PeriLab multiplies the matrix by
/// engineering shear strains, or, in bond-associated laws, by components of the strain tensor.
fn shear_note(model: &Model, dimension: usize) -> Option<&'static str> {
    let symmetry = model.node.get("Symmetry")?.text()?.to_lowercase();
    let has_doubled_modulus = !symmetry.contains("anisotropic")
        && (dimension == 3
            || symmetry.contains("orthotropic")
            || symmetry.contains("transverse isotropic"));
    let is_bond_associated = model.law == "bond_associated_correspondence";
    match (is_bond_associated, has_doubled_modulus) {
        (false, true) => Some(DOUBLED_SHEAR),
        (true, false) => Some(HALVED_SHEAR),
        _ => None,
    }
}

/// Write Young's modulus of a bond-based law. Return false if there is no constant to compute it from.
///
/// PeriLab uses a Poisson ratio of 1/3 in plane stress and in plane strain, and of 1/4 in 3-D.
fn write_bonds(translation: &Translation, model: &Model, section: &mut Section) -> bool {
    let (ratio, fraction) = match translation.dimension {
        2 => (1.0 / 3.0, "1/3"),
        _ => (0.25, "1/4"),
    };
    let Some(used) = model.constants.write_young(section, ratio) else {
        return false;
    };
    for key in PRECEDENCE {
        let Some(node) = Constants::node(model.node, key) else {
            continue;
        };
        match key {
            "poisson_ratio" => {
                let note = format!("the law has the Poisson's ratio of bonds, {fraction}");
                translation.log.replace(node, Fate::Approximated, note);
            }
            "youngs_modulus" if key == used => {}
            _ if key == used => {
                let note =
                    format!("youngs_modulus of the material, for a Poisson's ratio of {fraction}");
                translation.log.replace(node, Fate::Taken, note);
            }
            _ => translation.log.replace(node, Fate::LeftOut, IGNORED),
        }
    }
    true
}

/// Write the entries of Hooke's matrix or the constants of an orthotropic solid, if given. Return whether
/// anything was written.
fn anisotropic(
    translation: &Translation,
    table: &Node,
    is_correspondence: bool,
    section: &mut Section,
) -> Result<bool> {
    let mut found = false;
    let in_plane = translation.dimension == 2;
    for i in 1..=6 {
        for j in i..=6 {
            let name = format!("C{i}{j}");
            let Some(node) = table.get(&name) else {
                continue;
            };
            let of_plane = [1, 2, 6].contains(&i) && [1, 2, 6].contains(&j);
            if !is_correspondence {
                translation.log.left_out(node, "this law is isotropic");
            } else if in_plane && !of_plane {
                translation.log.left_out(node, "the problem has no z");
            } else {
                let key = name.to_lowercase();
                section.set(key.clone(), translation.number_value(node, &name)?);
                translation
                    .log
                    .taken(node, format!("{key} of the material"));
                found = true;
            }
        }
    }
    let is_sheet = translation.draft.top_is("dimension", "plane-stress");
    let symmetry = table.get("Symmetry").and_then(Node::text).unwrap_or("");
    let is_transverse = symmetry.to_lowercase().contains("transverse isotropic");
    for (name, key, of_sheet) in ORTHOTROPIC {
        let Some(node) = table.get(name) else {
            continue;
        };
        if !is_correspondence {
            translation.log.left_out(node, "this law is isotropic");
        } else if is_sheet && !of_sheet {
            let note = "a thin sheet in plane stress has no such constant";
            translation.log.left_out(node, note);
        } else if is_transverse && TRANSVERSE.iter().any(|(known, _)| *known == key) {
            translation.log.left_out(node, IGNORED);
        } else {
            section.set(key, translation.number_value(node, name)?);
            translation
                .log
                .taken(node, format!("{key} of the material"));
            found = true;
        }
    }
    if is_transverse && found && !is_sheet {
        write_transverse(translation, table, section)?;
    }
    Ok(found)
}

/// Write the constants of a transversely isotropic solid that follow from the given constants.
fn write_transverse(translation: &Translation, table: &Node, section: &mut Section) -> Result<()> {
    for (key, other) in TRANSVERSE {
        if let Some(value) = section.get(other).cloned() {
            section.set(key, value);
        }
    }
    let (young, ratio) = ("Young's Modulus Y", "Poisson's Ratio YZ");
    let (Some(young_node), Some(ratio_node)) = (table.get(young), table.get(ratio)) else {
        return Ok(());
    };
    let young = translation.number(young_node, young)?;
    let shear = young / (2.0 * (1.0 + translation.number(ratio_node, ratio)?));
    let key = "Shear Modulus YZ";
    match table.get(key) {
        None => {
            section.set("shear_modulus_yz", Value::number(shear));
        }
        Some(node) if (translation.number(node, key)? / shear - 1.0).abs() > ROUND_OFF => {
            let note = "PeriLab also computes c22 and c33 from this modulus, the new deck computes them from \
                        youngs_modulus_y and poisson_ratio_yz";
            translation.log.approximated(node, note);
        }
        Some(_) => {}
    }
    Ok(())
}

/// Read the thermal models with expansion. `is_thermal_enabled` says whether the solver enables thermal
/// models.
pub(super) fn expansions(
    translation: &Translation,
    models: &Node,
    is_thermal_enabled: bool,
) -> Result<Vec<Expansion>> {
    let mut expansions = Vec::new();
    let Some(node) = models.get("Thermal Models") else {
        return Ok(expansions);
    };
    if !is_thermal_enabled {
        let note = "the solver has no `Thermal Models: true`, so nothing expands";
        translation.log.left_out(node, note);
        return Ok(expansions);
    }
    for (name, table) in node.tables() {
        let kind = translation.required(
            table,
            "Thermal Model",
            &format!("the thermal model `{name}`"),
        )?;
        let kind_name = translation.text(kind, "Thermal Model")?.to_lowercase();
        if !kind_name.contains("thermal expansion") {
            translation.log.left_out(table, "heat is not conducted");
            continue;
        }
        match kind_name.trim() {
            "thermal expansion" => translation.log.taken(kind, "thermal_expansion"),
            _ => translation
                .log
                .approximated(kind, "thermal_expansion; heat is not conducted"),
        }
        let key = "Thermal Expansion Coefficient";
        let coefficient = translation.required(table, key, "the thermal model")?;
        let value = translation.number_value(coefficient, key)?;
        translation
            .log
            .taken(coefficient, "thermal_expansion of the material");
        let mut reference = None;
        let key = "Reference Temperature";
        if let Some(node) = table.get(key) {
            reference = Some(translation.number_value(node, key)?);
            translation
                .log
                .taken(node, "reference_temperature of the material");
        }
        expansions.push(Expansion {
            name: name.to_owned(),
            coefficient: value,
            reference,
        });
    }
    Ok(expansions)
}

/// Read the damage models. `is_damage_enabled` says whether the solver enables damage.
pub(super) fn damages(
    translation: &mut Translation,
    models: &Node,
    is_damage_enabled: bool,
) -> Result<Vec<DamageModel>> {
    let mut damages = Vec::new();
    let Some(node) = models.get("Damage Models") else {
        return Ok(damages);
    };
    if !is_damage_enabled {
        let note = "the solver has no `Damage Models: true`, so nothing breaks";
        translation.log.left_out(node, note);
        return Ok(damages);
    }
    for (name, table) in node.tables() {
        let what = format!("the damage model `{name}`");
        let model = translation.required(table, "Damage Model", &what)?;
        let kind = translation.text(model, "Damage Model")?;
        let is_stretch = is_key(kind, "Critical Stretch");
        if !is_stretch && !is_key(kind, "Critical Energy") {
            let note = format!(
                "{} has no counterpart; bodies with it never break",
                excerpt(kind)
            );
            translation.log.left_out(table, note);
            continue;
        }
        let node = translation.required(table, "Critical Value", &what)?;
        let number = translation.number(node, "Critical Value")?;
        let mut value = translation.number_value(node, "Critical Value")?;
        if let Some(node) = table.get("Thickness")
            && !is_stretch
        {
            let thickness = translation.number(node, "Thickness")?;
            if translation.dimension == 2 && thickness > 0.0 {
                let note = "fracture_energy is the critical value divided by the thickness";
                translation.log.taken(node, note);
                value = Value::number(number / thickness);
            } else {
                let note = "counts in plane problems only, and must be above 0";
                translation.log.left_out(node, note);
            }
        }
        let tension = table.get("Only Tension");
        let tension_only = tension.is_none_or(|node| translation.is_true(node));
        if let Some(node) = tension {
            translation.log.taken(
                node,
                "whether compressed bonds break; see the critical value",
            );
        }
        if let Some(node) = table.get("Local Damping") {
            translation.log.left_out(node, UNDAMPED_DAMAGE);
        }
        if let Some(node) = table.get("Interblock Damage") {
            translation.log.left_out(
                node,
                "bonds between bodies take the weaker toughness of both",
            );
        }
        translation.log.taken(
            model,
            if is_stretch {
                "critical_stretch"
            } else {
                "energy"
            },
        );
        damages.push(DamageModel {
            read: name.to_owned(),
            criterion: if is_stretch {
                Criterion::Stretch {
                    value,
                    stretch: number,
                    tension_only,
                }
            } else {
                Criterion::Energy {
                    energy: value,
                    tension_only,
                }
            },
            node: node.clone(),
        });
    }
    Ok(damages)
}
