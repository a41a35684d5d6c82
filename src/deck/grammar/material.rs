//! Materials and damage laws.

use std::borrow::Cow;
use std::fmt;

use indexmap::IndexMap;
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{EnumAccess, VariantAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Value, json};

use super::Text;
use crate::deck::number::{Number, Vector, default_number};
use crate::deck::spanned::Spanned;
use crate::elastic::Constant;
use crate::material::{Declaration, Kind, declarations};

/// A material: the name of its law, and the table with the keys of this law.
#[derive(Debug, Clone)]
pub struct Material {
    /// Name of the law.
    pub law: Text,
    /// The keys of the table with their values: [`common_keys`], and the keys that the law
    /// [declares](crate::material::Declaration::keys).
    pub table: Spanned<LawTable>,
}

/// The keys and values of a law. A value is a number, an expression or a word.
pub type LawTable = IndexMap<Text, Number>;

/// Key of the density ρ in kg/m³.
pub const DENSITY: &str = "density";

/// Key of the viscous damping r in 1/s, which exerts the force density −r ρ u̇; 0 if not given.
pub const DAMPING: &str = "damping";

/// Key of the coefficient of thermal expansion α in 1/K; 0 if not given.
pub const THERMAL_EXPANSION: &str = "thermal_expansion";

/// Key of the reference temperature, at which the thermal strain is 0. It has the unit of prescribed
/// temperatures, and is 0 if not given.
pub const REFERENCE_TEMPERATURE: &str = "reference_temperature";

/// Keys of the elastic constants: moduli in Pa, and Poisson's ratio.
pub const ELASTIC_CONSTANTS: [(&str, Constant); 5] = [
    ("youngs_modulus", Constant::Young),
    ("bulk_modulus", Constant::Bulk),
    ("shear_modulus", Constant::Shear),
    ("lame_lambda", Constant::Lame),
    ("poisson_ratio", Constant::Poisson),
];

/// Return the keys that the table of every law may have.
pub fn common_keys() -> impl Iterator<Item = &'static str> + Clone {
    let constants = ELASTIC_CONSTANTS.into_iter().map(|(name, _)| name);
    let others = [DAMPING, THERMAL_EXPANSION, REFERENCE_TEMPERATURE];
    [DENSITY].into_iter().chain(constants).chain(others)
}

/// Deserialize as an enum of laws. The validation checks the name of the law.
impl<'de> Deserialize<'de> for Material {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct MaterialVisitor;

        impl<'de> Visitor<'de> for MaterialVisitor {
            type Value = Material;

            fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                formatter.write_str("a table")
            }

            fn visit_enum<A: EnumAccess<'de>>(self, data: A) -> Result<Material, A::Error> {
                let (law, table) = data.variant()?;
                let table = table.newtype_variant()?;
                Ok(Material { law, table })
            }
        }

        deserializer.deserialize_enum("Material", &[], MaterialVisitor)
    }
}

/// Schema with one property per law; the value of the property is the table of the law's keys.
impl JsonSchema for Material {
    fn schema_name() -> Cow<'static, str> {
        "Material".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let laws = declarations().map(|law| (law.name.to_owned(), law_schema(law)));
        let laws: serde_json::Map<String, Value> = laws.collect();
        let one = json!({
            "type": "object",
            "description": "A material, by its law.",
            "properties": laws,
            "additionalProperties": false,
            "minProperties": 1,
            "maxProperties": 1,
        });
        one.try_into().unwrap_or_default()
    }
}

/// Return the schema description of a key common to all laws.
fn meaning(key: &str) -> &'static str {
    match key {
        DENSITY => "Density in kg/m³.",
        DAMPING => "Viscous damping in 1/s.",
        THERMAL_EXPANSION => "Coefficient of thermal expansion in 1/K.",
        REFERENCE_TEMPERATURE => "Temperature without thermal strain.",
        "poisson_ratio" => "Poisson's ratio.",
        _ => "Elastic constant in Pa.",
    }
}

/// Return the schema of the table of a law.
fn law_schema(law: &Declaration) -> Value {
    let number = json!(["number", "string"]);
    let mut properties = serde_json::Map::new();
    for name in common_keys() {
        let schema = json!({ "type": number, "description": meaning(name) });
        properties.insert(name.to_owned(), schema);
    }
    let mut required = vec![DENSITY];
    for key in law.keys {
        let mut schema = match &key.kind {
            Kind::Number { default, .. } => {
                if default.is_none() {
                    required.push(key.name);
                }
                json!({ "type": number, "default": default })
            }
            Kind::Optional { .. } | Kind::OfLength => json!({ "type": number }),
            Kind::Word(words) => {
                let words: Vec<&str> = words.iter().map(|word| word.word).collect();
                json!({ "enum": words, "default": words.first() })
            }
        };
        if let Some(entries) = schema.as_object_mut() {
            entries.retain(|_, value| !value.is_null());
            entries.insert("description".to_owned(), key.meaning.into());
        }
        properties.insert(key.name.to_owned(), schema);
    }
    json!({
        "type": "object",
        "description": law.force,
        "properties": properties,
        "required": required,
        "additionalProperties": false,
    })
}

impl Serialize for Material {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map([(&self.law, &self.table)])
    }
}

/// A damage law.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Damage {
    /// A bond breaks permanently at a critical stretch.
    CriticalStretch(Spanned<CriticalStretch>),
    /// A bond breaks permanently when the work done on it reaches a critical value.
    Energy(Spanned<BondEnergy>),
    /// A bond breaks permanently when the mean of the stress measures of its two points reaches a strength.
    Stress(Spanned<Stress>),
}

/// Critical stretch, given by exactly one of four measures of toughness.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CriticalStretch {
    /// Fracture energy G0 in J/m².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fracture_energy: Option<Number>,
    /// Fracture toughness K_Ic in Pa·√m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fracture_toughness: Option<Number>,
    /// Fracture energy in J/m² of cracks along `direction`: the normal of the crack is perpendicular to
    /// `direction`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fracture_energy_along: Option<Number>,
    /// Fracture energy in J/m² of cracks across `direction`: the normal of the crack is parallel to
    /// `direction`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fracture_energy_across: Option<Number>,
    /// Direction of the fibres, or the normal of the layers, in the undeformed body; a vector of any length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<Vector>,
    /// The critical stretch s0 itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub critical_stretch: Option<Number>,
    /// α in the critical stretch s0 − α s_min, where s_min is the smallest stretch of the intact bonds of a
    /// point. The default 0 gives a constant critical stretch.
    #[serde(default = "zero")]
    pub alpha: Number,
    /// Modulus m ≥ 1 of a Weibull distribution of the points' strength; all points are equally strong if not
    /// given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weibull_modulus: Option<Number>,
    /// Seed of the random strengths of `weibull_modulus`; 0 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<Spanned<u64>>,
    /// Sets of points whose bonds never break.
    #[serde(default)]
    pub no_failure: Vec<Text>,
}

/// Critical work of bonds, given by exactly one of three measures of toughness.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BondEnergy {
    /// Fracture energy G0 in J/m².
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fracture_energy: Option<Number>,
    /// Fracture toughness K_Ic in Pa·√m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fracture_toughness: Option<Number>,
    /// Fracture energy in J/m² of cracks along `direction`: the normal of the crack is perpendicular to
    /// `direction`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fracture_energy_along: Option<Number>,
    /// Fracture energy in J/m² of cracks across `direction`: the normal of the crack is parallel to
    /// `direction`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fracture_energy_across: Option<Number>,
    /// Direction of the fibres, or the normal of the layers, in the undeformed body; a vector of any length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<Vector>,
    /// How the critical work follows from the toughness. `"energy"`: breaking all bonds across an area
    /// dissipates the fracture energy. `"opening"`: the energy for separating a block of the body into two
    /// halves, per crack area, equals the fracture energy. This energy is computed before the run.
    /// `"willberg2022"`: eq. 16 and 18 of Willberg et al. (2022). `"perilab"`: the formula of PeriLab; only
    /// in 2-D and 3-D. `"peridigm2021"`: the formula that Peridigm had in 2021; only in 2-D.
    #[serde(default = "default_calibration")]
    pub calibration: Spanned<Calibration>,
    /// Whether only bonds that are longer than in the undeformed body can break; true if not given. If false,
    /// compressed bonds break too, as in a shear crack.
    #[serde(default = "yes")]
    pub tension_only: bool,
    /// Degree of the surface correction of the critical work, from 0 to 1; 0 if not given. Points beside
    /// surfaces have fewer bonds, so each bond stores more energy at the same strain. Without the correction,
    /// the body therefore breaks at its surfaces first. With degree 1, the critical work of a bond increases
    /// by the same factor as its stored energy.
    #[serde(default = "zero")]
    pub family_correction: Number,
    /// α: the critical work at a point is computed for the stretch s0 − α s_min instead of the critical
    /// stretch s0. s_min is the smallest stretch of the intact bonds of this point. The default 0 gives a
    /// constant critical work.
    #[serde(default = "zero")]
    pub alpha: Number,
    /// Modulus m ≥ 1 of a Weibull distribution of the points' strength; all points are equally strong if not
    /// given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weibull_modulus: Option<Number>,
    /// Seed of the random strengths of `weibull_modulus`; 0 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<Spanned<u64>>,
    /// Sets of points whose bonds never break.
    #[serde(default)]
    pub no_failure: Vec<Text>,
}

/// Strength of the points, compared with a measure of their Cauchy stress.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stress {
    /// The measure: `"principal"` is the largest principal stress, `"von_mises"` is the von Mises stress.
    pub measure: StressMeasure,
    /// Stress at which bonds break, in Pa.
    pub strength: Number,
    /// Whether only bonds that are longer than in the undeformed body can break; true if not given.
    #[serde(default = "yes")]
    pub tension_only: bool,
    /// Modulus m ≥ 1 of a Weibull distribution of the points' strength; all points are equally strong if not
    /// given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weibull_modulus: Option<Number>,
    /// Seed of the random strengths of `weibull_modulus`; 0 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<Spanned<u64>>,
    /// Sets of points whose bonds never break.
    #[serde(default)]
    pub no_failure: Vec<Text>,
}

/// Scalar measure of the Cauchy stress of a point.
#[derive(Debug, Clone, Copy, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StressMeasure {
    /// The von Mises stress.
    VonMises,
    /// The largest principal stress.
    Principal,
}

/// How the critical work of bonds follows from the fracture energy.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Calibration {
    /// All bonds that cross a unit area together dissipate the fracture energy when they break.
    #[default]
    Energy,
    /// From the computed energy of separating a block into two halves.
    Opening,
    /// As printed in Willberg et al. 2022.
    Willberg2022,
    /// As PeriLab computes it.
    Perilab,
    /// As Peridigm computed it in 2021.
    Peridigm2021,
}

fn default_calibration() -> Spanned<Calibration> {
    Spanned::new(0..0, Calibration::default())
}

fn yes() -> bool {
    true
}

fn zero() -> Number {
    default_number(0.0)
}
