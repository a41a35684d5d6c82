//! Group of a mesh as written in the deck: a name or a whole number.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::mesh::GroupKey;

/// Name or number of a group.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupName(pub GroupKey);

impl<'de> Deserialize<'de> for GroupName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NameVisitor;

        impl Visitor<'_> for NameVisitor {
            type Value = GroupName;

            fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                formatter.write_str("a whole number or a name in quotes")
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<GroupName, E> {
                Ok(GroupName(GroupKey::Number(value)))
            }

            fn visit_str<E: de::Error>(self, value: &str) -> Result<GroupName, E> {
                Ok(GroupName(GroupKey::Name(value.to_owned())))
            }
        }

        deserializer.deserialize_any(NameVisitor)
    }
}

impl JsonSchema for GroupName {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "GroupName".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["integer", "string"] })
    }
}

impl Serialize for GroupName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.0 {
            GroupKey::Number(number) => serializer.serialize_i64(*number),
            GroupKey::Name(name) => serializer.serialize_str(name),
        }
    }
}
