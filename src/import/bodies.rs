//! Bodies of the new deck, with material, damage model and horizon; conversion of damage models to damage
//! laws.

use super::draft::{Section, Value};
use super::elastic::Constants;
use super::log::{Fate, INTACT_COMPRESSED, UNUSED_DAMAGE};
use super::translation::Translation;
use super::tree::{Node, is_key};

/// A material of the new deck.
#[derive(Debug, Clone)]
pub struct Material {
    /// Name in the source deck.
    pub read: String,
    /// Name in the new deck.
    pub written: String,
    /// Material law.
    pub law: &'static str,
    /// Elastic constants.
    pub constants: Constants,
}

/// Criterion of a damage model.
#[derive(Debug, Clone, PartialEq)]
pub enum Criterion {
    /// Critical stretch.
    Stretch {
        /// Value to write.
        value: Value,
        /// The same value as a number.
        stretch: f64,
        /// Whether compressed bonds never break.
        tension_only: bool,
    },
    /// Critical work of a bond. PeriLab's formula computes it from the fracture energy.
    Energy {
        /// Fracture energy, J/m².
        energy: Value,
        /// Whether compressed bonds never break.
        tension_only: bool,
    },
}

/// A damage model of the source deck.
#[derive(Debug, Clone)]
pub struct DamageModel {
    /// Name in the source deck.
    pub read: String,
    /// Criterion that breaks bonds.
    pub criterion: Criterion,
    /// Node of the source deck that contains the value of the criterion.
    pub node: Node,
}

/// Log the damage models that no block uses. `models` is the table of damage models, `blocks` is the table of
/// blocks.
pub fn note_unused_damages(translation: &Translation, models: &Node, blocks: &Node) {
    let used = |name: &str| {
        blocks.tables().any(|(_, block)| {
            let model = block.get("Damage Model").and_then(Node::text);
            model.is_some_and(|model| is_key(model, name))
        })
    };
    for (name, table) in models.tables() {
        if !used(name) {
            translation.log.replace(table, Fate::LeftOut, UNUSED_DAMAGE);
        }
    }
}

/// Laws whose bonds cannot break by a critical stretch.
const WITHOUT_CRITICAL_STRETCH: [&str; 3] = [
    "ordinary_plastic",
    "correspondence",
    "bond_associated_correspondence",
];

/// The bond-based laws among the laws that an import writes.
const BOND_BASED: [&str; 1] = ["pmb"];

/// Write the damage law of a body and return the name of the damage law. `horizon` is the horizon of the
/// body, m.
///
/// If bonds of the material law cannot break by a critical stretch, a stretch criterion is converted to a
/// fracture energy. Return `None` if the elastic constants do not determine this energy.
pub fn damage(
    translation: &mut Translation,
    model: &DamageModel,
    material: &Material,
    horizon: f64,
) -> Option<String> {
    let lacks_critical_stretch = WITHOUT_CRITICAL_STRETCH.contains(&material.law);
    match &model.criterion {
        Criterion::Stretch {
            value,
            tension_only,
            ..
        } if !lacks_critical_stretch => {
            let name = translation.name("damage", &model.read);
            let header = format!("damage.{name}.critical_stretch");
            translation
                .log
                .taken(&model.node, format!("[{header}] critical_stretch"));
            if !tension_only {
                translation.log.approximated(&model.node, INTACT_COMPRESSED);
            }
            translation
                .draft
                .section(&header)
                .set("critical_stretch", value.clone());
            Some(name)
        }
        Criterion::Stretch {
            stretch,
            tension_only,
            ..
        } => {
            let Some([bulk, shear]) = material.constants.moduli() else {
                let note = format!(
                    "{} breaks by energy only, which needs two moduli",
                    material.law
                );
                translation.log.left_out(&model.node, note);
                return None;
            };
            // State-based form of the relation of Silling & Askari (2005):
            // G0 = s0² δ (3 G + (3/4)⁴ (k − 5 G/3)) with the bulk modulus k and the shear modulus G. For
            // k = 5 G/3, this is the relation G0 = 9 k δ s0²/5 of bond-based solids.
            let energy = stretch
                * stretch
                * horizon
                * (3.0 * shear + 0.316_406_25 * (bulk - 5.0 * shear / 3.0));
            let name = translation.name("damage", &format!("{} energy {horizon}", model.read));
            let header = format!("damage.{name}.energy");
            let note = format!(
                "[{header}] fracture_energy = s0² δ (3 G + (3/4)⁴ (k − 5 G/3)): {} breaks by energy only",
                material.law
            );
            translation.log.approximated(&model.node, note);
            let section = translation.draft.section(&header);
            section.set("fracture_energy", Value::number(energy));
            if !tension_only {
                section.set("tension_only", Value::Flag(false));
            }
            Some(name)
        }
        Criterion::Energy {
            energy,
            tension_only,
        } => {
            let bond_based = BOND_BASED.contains(&material.law);
            // In Fissure, bonds of a bond-based law break in tension only. A damage model that also breaks
            // compressed bonds therefore becomes two damage laws: one for bond-based bodies, and one for
            // other bodies.
            let name = if bond_based && !tension_only {
                translation.name("damage", &format!("{} of bonds", model.read))
            } else {
                translation.name("damage", &model.read)
            };
            let header = format!("damage.{name}.energy");
            let note = format!("[{header}] fracture_energy with PeriLab's calibration");
            if bond_based && !tension_only {
                let note = format!("{note}; {INTACT_COMPRESSED}");
                translation.log.approximated(&model.node, note);
            } else {
                translation.log.taken(&model.node, note);
            }
            let section = translation.draft.section(&header);
            section
                .set("fracture_energy", energy.clone())
                .set("calibration", Value::text("perilab"));
            if !tension_only && !bond_based {
                section.set("tension_only", Value::Flag(false));
            }
            Some(name)
        }
    }
}

/// A body of the new deck.
pub struct Body {
    /// Name in the new deck.
    pub name: String,
    /// Name of the material.
    pub material: String,
    /// Name of the damage law.
    pub damage: Option<String>,
    /// Horizon, m.
    pub horizon: Value,
    /// Key and value in the new deck that give the points. The key is `points`, or a shape such as
    /// `shape.box`.
    pub points: (String, Value),
}

/// Write the bodies. The horizon of the first body becomes that of `[grid]`.
pub fn write(translation: &mut Translation, bodies: &[Body]) {
    let Some(first) = bodies.first() else {
        return;
    };
    let grid = translation.draft.section("grid");
    grid.set("horizon", first.horizon.clone());
    for body in bodies {
        let mut section = Section::new(format!("body.{}", body.name));
        section.set("material", Value::text(body.material.clone()));
        if let Some(damage) = &body.damage {
            section.set("damage", Value::text(damage.clone()));
        }
        if body.horizon != first.horizon {
            section.set("horizon", body.horizon.clone());
        }
        section.set(body.points.0.clone(), body.points.1.clone());
        translation.add(section);
    }
}
