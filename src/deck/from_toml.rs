//! Deserialization of the grammar from the tree of a TOML text.
//!
//! The deserializers of the `toml` crate have several types, and the compiler builds each type of the grammar
//! once for each of them. Here, all keys and values have the type [`Node`], which makes the build shorter.

use std::fmt;
use std::marker::PhantomData;
use std::ops::Range;

use serde::de::{
    self, DeserializeOwned, DeserializeSeed, EnumAccess, Error as _, MapAccess, SeqAccess,
    Unexpected, VariantAccess, Visitor,
};
use serde::{Deserializer, forward_to_deserialize_any};
use toml::de::{DeTable, DeValue};

use super::spanned::SPANNED;

/// Message if a choice is neither a name in quotes nor a table.
pub const NEITHER_NAME_NOR_TABLE: &str = "neither a name nor a table";

/// Message if the table of a choice has no key or several keys.
pub const NOT_ONE_KEY: &str = "not one key";

/// Deserialize a table with the byte range `span`.
///
/// # Errors
/// If the table does not follow the grammar of `T`.
pub fn from_table<T: DeserializeOwned>(table: &DeTable, span: Range<usize>) -> Result<T, Mismatch> {
    let content = Content::Table(table);
    Node { content, span }.read(PhantomData)
}

/// Parse and deserialize a text that is valid TOML.
#[cfg(test)]
pub fn from_text<T: DeserializeOwned>(text: &str) -> Result<T, Mismatch> {
    let table = DeTable::parse(text).unwrap();
    from_table(table.get_ref(), table.span())
}

/// Deserialize a name, as if the deck contained it in quotes.
///
/// # Errors
/// If `T` has no such name. The message lists the names of `T`.
pub fn from_name<T: DeserializeOwned>(name: &str) -> Result<T, Mismatch> {
    let content = Content::Text(name);
    Node {
        content,
        span: 0..0,
    }
    .read(PhantomData)
}

/// A key or value that does not follow the grammar.
#[derive(Debug)]
pub struct Mismatch {
    /// A message of serde, or a constant of this module.
    pub message: String,
    /// Byte range of the key or value.
    pub span: Range<usize>,
}

impl fmt::Display for Mismatch {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.message)
    }
}

impl std::error::Error for Mismatch {}

/// Byte range of a [`Mismatch`] whose location is not yet known.
const UNKNOWN: Range<usize> = usize::MAX..usize::MAX;

impl de::Error for Mismatch {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self {
            message: message.to_string(),
            span: UNKNOWN,
        }
    }
}

impl Mismatch {
    /// Set the location to `span`, unless it is known.
    fn at(mut self, span: Range<usize>) -> Self {
        if self.span == UNKNOWN {
            self.span = span;
        }
        self
    }
}

/// A key or value with its byte range.
#[derive(Clone)]
struct Node<'t> {
    content: Content<'t>,
    span: Range<usize>,
}

#[derive(Clone, Copy)]
enum Content<'t> {
    Table(&'t DeTable<'t>),
    Value(&'t DeValue<'t>),
    /// A key, or a value that is a string.
    Text(&'t str),
    /// Start or end of the byte range of a [`Spanned`](super::spanned::Spanned).
    Offset(usize),
}

impl<'t> Node<'t> {
    fn of_value(value: &'t toml::Spanned<DeValue<'t>>) -> Self {
        let content = match value.get_ref() {
            DeValue::Table(table) => Content::Table(table),
            DeValue::String(text) => Content::Text(text),
            other => Content::Value(other),
        };
        Self {
            content,
            span: value.span(),
        }
    }

    /// Deserialize a value of the type of `seed`.
    fn read<'de, S: DeserializeSeed<'de>>(self, seed: S) -> Result<S::Value, Mismatch> {
        let span = self.span.clone();
        seed.deserialize(self).map_err(|error| error.at(span))
    }

    /// Call the method of `visitor` for the type of the content.
    fn visit<'de, V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Mismatch> {
        match self.content {
            Content::Table(table) => visitor.visit_map(Entries::of(table)),
            Content::Text(text) => visitor.visit_str(text),
            Content::Offset(offset) => visitor.visit_u64(offset as u64),
            Content::Value(DeValue::Array(list)) => {
                let nodes: Vec<Node> = list.iter().map(Node::of_value).collect();
                visitor.visit_seq(Elements(nodes.into_iter()))
            }
            Content::Value(DeValue::Boolean(value)) => visitor.visit_bool(*value),
            Content::Value(DeValue::Integer(digits)) => {
                let (digits, radix) = (digits.as_str(), digits.radix());
                if let Ok(number) = i64::from_str_radix(digits, radix) {
                    visitor.visit_i64(number)
                } else if let Ok(number) = u64::from_str_radix(digits, radix) {
                    visitor.visit_u64(number)
                } else {
                    // Larger integers have the value of a float, where numbers are allowed.
                    visitor.visit_f64(digits.parse().unwrap_or(f64::INFINITY))
                }
            }
            Content::Value(DeValue::Float(digits)) => match digits.as_str().parse::<f64>() {
                Ok(number) if number.is_finite() || !digits.as_str().contains(char::is_numeric) => {
                    visitor.visit_f64(number)
                }
                _ => Err(Mismatch::custom("the number is too large")),
            },
            Content::Value(_) => Err(Mismatch::invalid_type(Unexpected::Other("date"), &visitor)),
        }
    }
}

impl<'de> Deserializer<'de> for Node<'_> {
    type Error = Mismatch;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Mismatch> {
        let span = self.span.clone();
        self.visit(visitor).map_err(|error| error.at(span))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Mismatch> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _name: &'static str,
        visitor: V,
    ) -> Result<V::Value, Mismatch> {
        visitor.visit_newtype_struct(self)
    }

    /// Deserialize a [`Spanned`](super::spanned::Spanned) as a list of start, end and value.
    fn deserialize_tuple_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        _length: usize,
        visitor: V,
    ) -> Result<V::Value, Mismatch> {
        assert_eq!(name, SPANNED, "the grammar has no other tuple structs");
        let offset = |offset| Node {
            content: Content::Offset(offset),
            span: self.span.clone(),
        };
        let nodes = vec![offset(self.span.start), offset(self.span.end), self];
        visitor.visit_seq(Elements(nodes.into_iter()))
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Mismatch> {
        let span = self.span.clone();
        let choice = match self.content {
            Content::Text(_) => Ok(Choice {
                name: self,
                table: None,
            }),
            Content::Table(table) => match Entries::of(table).nodes.as_slice() {
                [(name, table)] => Ok(Choice {
                    name: name.clone(),
                    table: Some(table.clone()),
                }),
                _ => Err(Mismatch::custom(NOT_ONE_KEY)),
            },
            _ => Err(Mismatch::custom(NEITHER_NAME_NOR_TABLE)),
        };
        choice
            .and_then(|choice| visitor.visit_enum(choice))
            .map_err(|error| error.at(span))
    }

    forward_to_deserialize_any! {
        bool u8 u16 u32 u64 i8 i16 i32 i64 f32 f64 char str string seq bytes byte_buf map struct unit
        ignored_any unit_struct tuple identifier
    }
}

/// The elements of a list.
struct Elements<'t>(std::vec::IntoIter<Node<'t>>);

impl<'de> SeqAccess<'de> for Elements<'_> {
    type Error = Mismatch;

    fn next_element_seed<T: DeserializeSeed<'de>>(
        &mut self,
        seed: T,
    ) -> Result<Option<T::Value>, Mismatch> {
        self.0.next().map(|node| node.read(seed)).transpose()
    }
}

/// The keys and values of a table.
struct Entries<'t> {
    nodes: std::vec::IntoIter<(Node<'t>, Node<'t>)>,
    /// Value of the last key.
    value: Option<Node<'t>>,
}

impl<'t> Entries<'t> {
    fn of(table: &'t DeTable<'t>) -> Self {
        let nodes: Vec<_> = table
            .iter()
            .map(|(key, value)| {
                let name = Node {
                    content: Content::Text(key.get_ref()),
                    span: key.span(),
                };
                (name, Node::of_value(value))
            })
            .collect();
        Self {
            nodes: nodes.into_iter(),
            value: None,
        }
    }
}

impl<'de> MapAccess<'de> for Entries<'_> {
    type Error = Mismatch;

    fn next_key_seed<K: DeserializeSeed<'de>>(
        &mut self,
        seed: K,
    ) -> Result<Option<K::Value>, Mismatch> {
        let Some((key, value)) = self.nodes.next() else {
            return Ok(None);
        };
        self.value = Some(value);
        key.read(seed).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Mismatch> {
        let value = self.value.take().expect("the key was read before");
        value.read(seed)
    }
}

/// A choice: a name alone, or a table whose only key is the name.
struct Choice<'t> {
    name: Node<'t>,
    table: Option<Node<'t>>,
}

impl<'de, 't> EnumAccess<'de> for Choice<'t> {
    type Error = Mismatch;
    type Variant = Chosen<'t>;

    fn variant_seed<V: DeserializeSeed<'de>>(
        self,
        seed: V,
    ) -> Result<(V::Value, Chosen<'t>), Mismatch> {
        Ok((self.name.read(seed)?, Chosen(self.table)))
    }
}

/// The value behind the name of a choice.
struct Chosen<'t>(Option<Node<'t>>);

impl<'de> VariantAccess<'de> for Chosen<'_> {
    type Error = Mismatch;

    fn unit_variant(self) -> Result<(), Mismatch> {
        match self.0 {
            None => Ok(()),
            Some(_) => Err(Mismatch::custom(NEITHER_NAME_NOR_TABLE)),
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, Mismatch> {
        let missing = || Mismatch::invalid_type(Unexpected::UnitVariant, &"newtype variant");
        self.0.ok_or_else(missing)?.read(seed)
    }

    fn tuple_variant<V: Visitor<'de>>(
        self,
        _length: usize,
        visitor: V,
    ) -> Result<V::Value, Mismatch> {
        Err(Mismatch::invalid_type(Unexpected::TupleVariant, &visitor))
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Mismatch> {
        let missing = || Mismatch::invalid_type(Unexpected::UnitVariant, &"struct variant");
        self.0.ok_or_else(missing)?.deserialize_any(visitor)
    }
}
