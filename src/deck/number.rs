//! Numbers of a deck as written: an integer, a float, or an expression in a string.

use std::borrow::Cow;
use std::fmt;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{self, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::deck::spanned::Spanned;

/// A number as written in the deck.
#[derive(Debug, Clone, PartialEq)]
pub enum Written {
    /// A plain number; TOML integers are accepted.
    Value(f64),
    /// The text of an expression.
    Text(String),
}

/// A number with its byte range in the deck.
pub type Number = Spanned<Written>;

/// A list of numbers with its byte range in the deck, such as a vector with one entry per dimension.
pub type Vector = Spanned<Vec<Number>>;

/// Edges of a lattice cell as written in the deck: one number, or a list with one number per dimension.
#[derive(Debug, Clone, PartialEq)]
pub enum Edges {
    /// The same edge in all directions.
    Same(Written),
    /// One edge per dimension.
    Each(Vec<Number>),
}

/// Return a default number. Its byte range is empty, because the deck does not contain it.
pub fn default_number(value: f64) -> Number {
    Spanned::new(0..0, Written::Value(value))
}

impl<'de> Deserialize<'de> for Written {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct WrittenVisitor;

        impl Visitor<'_> for WrittenVisitor {
            type Value = Written;

            fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                formatter.write_str("a number or an expression in quotes")
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<Written, E> {
                Ok(Written::Value(value as f64))
            }

            fn visit_u64<E: de::Error>(self, value: u64) -> Result<Written, E> {
                Ok(Written::Value(value as f64))
            }

            fn visit_f64<E: de::Error>(self, value: f64) -> Result<Written, E> {
                Ok(Written::Value(value))
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Written, E> {
                Ok(Written::Text(text.to_owned()))
            }
        }

        deserializer.deserialize_any(WrittenVisitor)
    }
}

impl<'de> Deserialize<'de> for Edges {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct EdgesVisitor;

        impl<'de> Visitor<'de> for EdgesVisitor {
            type Value = Edges;

            fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                formatter.write_str("a number, an expression in quotes, or a list of them")
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<Edges, E> {
                Ok(Edges::Same(Written::Value(value as f64)))
            }

            fn visit_f64<E: de::Error>(self, value: f64) -> Result<Edges, E> {
                Ok(Edges::Same(Written::Value(value)))
            }

            fn visit_str<E: de::Error>(self, text: &str) -> Result<Edges, E> {
                Ok(Edges::Same(Written::Text(text.to_owned())))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Edges, A::Error> {
                let mut edges = Vec::new();
                while let Some(edge) = list.next_element()? {
                    edges.push(edge);
                }
                Ok(Edges::Each(edges))
            }
        }

        deserializer.deserialize_any(EdgesVisitor)
    }
}

impl JsonSchema for Written {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Number".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": ["number", "string"] })
    }
}

impl JsonSchema for Edges {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Edges".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let number = ["number", "string"];
        json_schema!({
            "type": ["number", "string", "array"],
            "items": { "type": number },
        })
    }
}

impl Serialize for Edges {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Same(edge) => edge.serialize(serializer),
            Self::Each(edges) => edges.serialize(serializer),
        }
    }
}

impl Serialize for Written {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Value(value) => serializer.serialize_f64(*value),
            Self::Text(text) => serializer.serialize_str(text),
        }
    }
}
