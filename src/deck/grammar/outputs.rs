//! Grammar of the outputs: result, history and checkpoints.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::value::MapAccessDeserializer;
use serde::de::{DeserializeSeed, IntoDeserializer, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use super::{Count, Tables, Text};
use crate::deck::number::{Number, Vector, default_number};
use crate::deck::spanned::Spanned;

/// The result files.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Outputs {
    /// `[output]`: the main result.
    #[serde(flatten)]
    pub main: Output,
    /// `[output.NAME]`: further results.
    #[serde(flatten)]
    pub further: Tables<Output>,
}

/// Keys of [`Output`]; other keys of `[output]` are names of further results.
pub const OUTPUT_KEYS: [&str; 6] = [
    "every",
    "every_steps",
    "times",
    "fields",
    "precision",
    "set",
];

impl<'de> Deserialize<'de> for Outputs {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct OutputsVisitor;

        impl<'de> Visitor<'de> for OutputsVisitor {
            type Value = Outputs;

            fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                formatter.write_str("a table")
            }

            fn visit_map<A: MapAccess<'de>>(self, keys: A) -> Result<Outputs, A::Error> {
                let mut further = Tables::new();
                let main = MainKeys {
                    keys,
                    further: &mut further,
                };
                let main = Output::deserialize(MapAccessDeserializer::new(main))?;
                Ok(Outputs { main, further })
            }
        }

        deserializer.deserialize_map(OutputsVisitor)
    }
}

/// Map access that yields the keys of the main result, and moves the tables of further results to `further`.
struct MainKeys<'a, A> {
    keys: A,
    further: &'a mut Tables<Output>,
}

impl<'de, A: MapAccess<'de>> MapAccess<'de> for MainKeys<'_, A> {
    type Error = A::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, A::Error> {
        while let Some(key) = self.keys.next_key::<String>()? {
            if OUTPUT_KEYS.contains(&key.as_str()) {
                return seed.deserialize(key.into_deserializer()).map(Some);
            }
            self.further.insert(key, self.keys.next_value()?);
        }
        Ok(None)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, A::Error> {
        self.keys.next_value_seed(seed)
    }
}

/// Schema of [`Output`]. Any key that [`Output`] does not have is the name of a further result, whose table
/// has the same schema.
impl JsonSchema for Outputs {
    fn schema_name() -> Cow<'static, str> {
        "Outputs".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let mut schema = Output::json_schema(generator);
        let further = generator.subschema_for::<Output>();
        schema.insert("additionalProperties".to_owned(), further.into());
        schema
    }
}

/// A result file.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Simulated time between outputs in s. The default is 1/50 of the run, unless `every_steps` or `times`
    /// is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every: Option<Number>,
    /// Steps between outputs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every_steps: Option<Spanned<Count>>,
    /// Simulated times of outputs in s, in addition to those of `every` or `every_steps`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub times: Option<Vector>,
    /// Names of the fields. If not given: `displacement`, `velocity`, `damage` and `strain_energy_density`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fields: Option<Vec<Text>>,
    /// Precision of the fields that change in time: `"double"` (8 bytes per number) or `"single"` (4 bytes).
    #[serde(default)]
    pub precision: Precision,
    /// Name of the set whose points the result contains; all points if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub set: Option<Text>,
}

/// Precision of the numbers in a result.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// 8 bytes per number, without loss.
    #[default]
    Double,
    /// 4 bytes per number, about seven digits.
    Single,
}

/// The history: sums and probes over time.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct History {
    /// Simulated time between rows in s. The default is 1/500 of the run, unless `every_steps` is given. If
    /// the whole run is explicit, this default writes rows only at multiples of 20 steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every: Option<Number>,
    /// Steps between rows. If `every` is also given, a row is written only at steps whose number is a
    /// multiple of `every_steps`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every_steps: Option<Spanned<Count>>,
    /// Sets whose reaction force is recorded, by component.
    #[serde(default)]
    pub reactions: Vec<Text>,
    /// Reaction forces of sets, projected on a direction, by name.
    #[serde(default)]
    pub force: Tables<SupportForce>,
    /// Whether fragments are recorded; false if not given. The recorded values are the number of fragments,
    /// and the mass and momentum of the fragment that has the most points.
    #[serde(default)]
    pub fragments: bool,
    /// Whether the angular momentum about the origin is recorded (plane problems and solids); false if not
    /// given.
    #[serde(default)]
    pub angular_momentum: Spanned<bool>,
    /// Damage above which a point counts as cracked; 0.35 if not given. Cracked points are counted, and their
    /// smallest and largest coordinates are recorded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damage_threshold: Option<Number>,
    /// Sums, means and extremes of fields over sets and bodies, by name.
    #[serde(default)]
    pub field: Tables<FieldStatistics>,
    /// Probes by name; each records the values of the point nearest to a position.
    #[serde(default)]
    pub probe: Tables<Probe>,
    /// Fronts that are tracked along lines, by name.
    #[serde(default)]
    pub front: Tables<Front>,
    /// Cracks by name. In plane problems, the path and the length of each crack are computed. In 3-D, the
    /// area and the front are computed.
    #[serde(default)]
    pub crack: Tables<CrackPath>,
    /// Crack tips that are tracked, by name.
    #[serde(default)]
    pub tip: Tables<Tip>,
    /// J integrals over boxes around crack tips or pieces of crack fronts, by name.
    #[serde(default)]
    pub j_integral: Tables<JIntegral>,
}

/// Interval of checkpoints, given by at most one of the keys.
#[derive(Debug, Clone, Default, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    /// Wall-clock time between checkpoints, such as `"10 min"`, `"90 s"` or `"2 h"`. If `[checkpoint]` has no
    /// keys, checkpoints are written every 10 minutes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every: Option<Text>,
    /// Steps between checkpoints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every_steps: Option<Spanned<Count>>,
    /// Simulated time between checkpoints in s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub every_time: Option<Number>,
}

/// Rebalancing: points are distributed over the ranks again when the loads of the ranks drift apart. The load
/// of a rank is its time in the loops over bonds; these times are compared at regular intervals. Results do
/// not depend on the rebalancing.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Balance {
    /// Steps between comparisons of the ranks' times; 500 if not given.
    #[serde(default = "default_interval")]
    pub every_steps: Spanned<Count>,
    /// Largest ratio of the slowest rank's time to the mean time of the ranks; 1.2 if not given. Points are
    /// rebalanced above this ratio.
    #[serde(default = "default_imbalance")]
    pub imbalance: Number,
}

fn default_interval() -> Spanned<Count> {
    Spanned::new(0..0, Count::new(500))
}

fn default_imbalance() -> Number {
    default_number(1.2)
}

/// Reaction force of a set, projected on a direction.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SupportForce {
    /// The set.
    pub set: Text,
    /// Direction on which the force is projected; a vector of any length.
    pub direction: Vector,
}

/// A crack path: the centre lines of a damaged region, one line for each branch. The region is the damage
/// that is connected to a start position. In 3-D, the area and the front of this region are computed.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CrackPath {
    /// Start position of the crack, m; damage within one horizon of this position belongs to the crack.
    pub from: Vector,
    /// The set of points that are evaluated; all points if not given.
    #[serde(default = "super::all_points")]
    pub set: Text,
    /// Threshold that the damage must exceed; `damage_threshold` if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold: Option<Number>,
}

/// A probe at a position.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Probe {
    /// Position in m; the probe records values of the nearest point.
    pub at: Vector,
    /// Names of output fields, such as `"stress"` and `"strain"`, that are recorded in addition to
    /// displacement and velocity.
    #[serde(default)]
    pub fields: Vec<Text>,
}

/// Statistics of a field over a set or body, such as its sum, mean and extremes. Each statistic is one column
/// of the history.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FieldStatistics {
    /// Name of an output field.
    pub field: Text,
    /// A component such as `"x"` or `"xy"`, or an invariant such as `"magnitude"`, `"von_mises"` or
    /// `"principal_1"`. The default for a vector is its magnitude. The key is required for tensors, and not
    /// allowed for fields with one number per point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub component: Option<Text>,
    /// A set or a body; all points if not given.
    #[serde(default = "super::all_points")]
    pub set: Text,
    /// The quantities that are recorded.
    pub of: Spanned<Vec<Spanned<Statistic>>>,
}

/// A number computed from the values of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Statistic {
    /// The sum over the points.
    Sum,
    /// The sum over the points: value times volume of each point.
    Integral,
    /// The integral divided by the volume of the set.
    Mean,
    /// The smallest value.
    Minimum,
    /// The largest value.
    Maximum,
}

/// A front: the position that a field has reached along a line. Only points near the line are searched. The
/// search finds the point farthest along the line at which the absolute value of the field exceeds the
/// threshold. Linear interpolation to the next point ahead gives the position where the absolute value
/// crosses the threshold.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Front {
    /// Start of the line, m.
    pub from: Vector,
    /// Direction of the line; a vector of any length.
    pub direction: Vector,
    /// Length of the line in m; if not given, the line extends to the end of the bodies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub length: Option<Number>,
    /// Largest distance of the evaluated points from the line, in m; the horizon of `[grid]` if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<Number>,
    /// Name of an output field.
    pub field: Text,
    /// A component such as `"x"` or `"xy"`, or an invariant such as `"magnitude"`, `"von_mises"` or
    /// `"principal_1"`. The default for a vector is its magnitude. The key is required for tensors, and not
    /// allowed for fields with one number per point.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub component: Option<Text>,
    /// Threshold that the absolute value of the field must exceed, in the unit of the field.
    pub threshold: Number,
}

/// A crack tip: the point farthest in one direction among all points with a damage above a threshold. Only
/// the points of one set are searched. The position of the tip is interpolated as for a [`Front`].
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Tip {
    /// Position from which the length of the crack is measured, m.
    pub from: Vector,
    /// Direction of the crack, a vector of any length; the length of the crack is measured along this
    /// direction.
    pub direction: Vector,
    /// The set of points that are evaluated; all points if not given.
    #[serde(default = "super::all_points")]
    pub set: Text,
    /// Threshold that the damage must exceed; `damage_threshold` if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold: Option<Number>,
}

/// The nonlocal J integral over a box around a crack tip, or around a piece of a crack front in 3-D. The
/// integral is the energy that the crack releases per area of its growth.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JIntegral {
    /// Lower corner of the box, m.
    pub lower: Vector,
    /// Upper corner of the box, m.
    pub upper: Vector,
    /// Direction in which the crack grows, a vector of any length; along x if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<Vector>,
    /// Direction of the crack front, a vector of any length that is perpendicular to `direction`. Required in
    /// 3-D, not allowed in plane problems.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub front: Option<Vector>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::deck::from_toml::from_text;

    #[test]
    fn the_keys_of_an_output_are_listed() {
        let error = from_text::<Output>("unknown = 1").unwrap_err();
        let keys: Vec<&str> = error.message.split('`').skip(3).step_by(2).collect();
        assert_eq!(keys, OUTPUT_KEYS);
    }

    #[test]
    fn tables_of_an_output_are_further_ones() {
        let text =
            "every = 1\nslice = { every_steps = 2 }\nfields = ['damage']\n[edge]\nset = 'left'\n";
        let outputs: Outputs = from_text(text).unwrap();
        assert!(outputs.main.every.is_some() && outputs.main.fields.is_some());
        let names: Vec<&String> = outputs.further.keys().collect();
        assert_eq!(names, ["slice", "edge"]);
        let written = toml::to_string(&outputs).unwrap();
        let again: Outputs = from_text(&written).unwrap();
        assert_eq!(toml::to_string(&again).unwrap(), written);
    }
}
