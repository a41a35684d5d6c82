//! Values with their byte ranges in the deck.

use std::borrow::{Borrow, Cow};
use std::fmt;
use std::marker::PhantomData;
use std::ops::Range;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Error as _, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

/// A value and its byte range in the deck. Comparison, hash and serialization use the value only.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize)]
#[serde(transparent)]
pub struct Spanned<T>(toml::Spanned<T>);

/// Name by which [`from_toml`](super::from_toml) recognises a [`Spanned`].
pub(super) const SPANNED: &str = "Spanned";

impl<T> Spanned<T> {
    /// Create a value with this byte range.
    pub fn new(span: Range<usize>, value: T) -> Self {
        Self(toml::Spanned::new(span, value))
    }

    /// Return the byte range.
    pub fn span(&self) -> Range<usize> {
        self.0.span()
    }

    /// Return a reference to the value.
    pub fn get_ref(&self) -> &T {
        self.0.get_ref()
    }

    /// Return a mutable reference to the value.
    pub fn get_mut(&mut self) -> &mut T {
        self.0.get_mut()
    }
}

/// A list of start, end and value.
impl<'de, T: Deserialize<'de>> Deserialize<'de> for Spanned<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct SpannedVisitor<T>(PhantomData<T>);

        impl<'de, T: Deserialize<'de>> Visitor<'de> for SpannedVisitor<T> {
            type Value = Spanned<T>;

            fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                formatter.write_str("start, end and value")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Spanned<T>, A::Error> {
                let missing = |count| A::Error::invalid_length(count, &self);
                let start = list.next_element()?.ok_or_else(|| missing(0))?;
                let end = list.next_element()?.ok_or_else(|| missing(1))?;
                let value = list.next_element()?.ok_or_else(|| missing(2))?;
                Ok(Spanned::new(start..end, value))
            }
        }

        deserializer.deserialize_tuple_struct(SPANNED, 3, SpannedVisitor(PhantomData))
    }
}

/// The default value, with an empty byte range because the deck does not contain it.
impl<T: Default> Default for Spanned<T> {
    fn default() -> Self {
        Self::new(0..0, T::default())
    }
}

impl Borrow<str> for Spanned<String> {
    fn borrow(&self) -> &str {
        self.get_ref()
    }
}

impl<T: fmt::Display> fmt::Display for Spanned<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.get_ref().fmt(formatter)
    }
}

impl<T> AsRef<T> for Spanned<T> {
    fn as_ref(&self) -> &T {
        self.get_ref()
    }
}

/// The schema of the value.
impl<T: JsonSchema> JsonSchema for Spanned<T> {
    fn inline_schema() -> bool {
        T::inline_schema()
    }

    fn schema_name() -> Cow<'static, str> {
        T::schema_name()
    }

    fn schema_id() -> Cow<'static, str> {
        T::schema_id()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        T::json_schema(generator)
    }
}
