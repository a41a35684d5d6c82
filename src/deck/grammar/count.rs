//! Positive integers of a deck.

use std::borrow::Cow;
use std::fmt;
use std::num::NonZeroU64;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// A positive integer. In a deck, it must be below 2⁶³, the limit of TOML integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(transparent)]
pub struct Count(NonZeroU64);

impl Count {
    /// Create a count.
    ///
    /// # Panics
    /// If `number` is 0.
    pub const fn new(number: u64) -> Self {
        Self(NonZeroU64::new(number).expect("not 0"))
    }

    /// Return the count as a `u64`.
    pub fn get(self) -> u64 {
        self.0.get()
    }
}

impl fmt::Display for Count {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(formatter)
    }
}

impl JsonSchema for Count {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "Count".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "integer", "minimum": 1 })
    }
}

impl<'de> Deserialize<'de> for Count {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let number = NonZeroU64::deserialize(deserializer)?;
        if number.get() > i64::MAX as u64 {
            let most = i64::MAX;
            return Err(D::Error::custom(format!(
                "must be at most {most}, is {number}"
            )));
        }
        Ok(Self(number))
    }
}
