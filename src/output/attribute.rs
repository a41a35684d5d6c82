//! Attributes of groups and datasets.

use hdf5_metno as hdf5;
use hdf5_metno::types::{FixedAscii, TypeDescriptor, VarLenUnicode};

/// Maximum length of [`Attribute::Ascii`], bytes.
const ASCII_BYTES: usize = 64;

/// Value of an attribute.
#[derive(Debug, Clone, Copy)]
pub enum Attribute<'a> {
    /// One integer.
    Integer(i64),
    /// Several integers.
    Integers(&'a [i64]),
    /// UTF-8 text of any length, without NUL.
    Text(&'a str),
    /// ASCII text of 1 to 64 bytes. The text is stored with a fixed length, as VTK requires.
    Ascii(&'a str),
}

impl Attribute<'_> {
    /// Return the length of an [`Attribute::Text`], bytes; 0 for other values.
    pub(super) fn text_length(self) -> u64 {
        match self {
            Self::Text(text) => text.len() as u64,
            Self::Integer(_) | Self::Integers(_) | Self::Ascii(_) => 0,
        }
    }
}

/// Write an attribute; an existing attribute must have the same type and length.
pub(super) fn set_attribute(
    object: &hdf5::Location,
    name: &str,
    value: Attribute,
) -> hdf5::Result<()> {
    let open = |number: TypeDescriptor, length: Option<usize>| match (object.attr(name), length) {
        (Ok(attribute), _) => Ok(attribute),
        (Err(_), None) => object.new_attr_builder().empty_as(&number).create(name),
        (Err(_), Some(length)) => object
            .new_attr_builder()
            .empty_as(&number)
            .shape(length)
            .create(name),
    };
    let integer = TypeDescriptor::Integer(hdf5::types::IntSize::U8);
    let text = |error: &dyn std::fmt::Display| hdf5::Error::from(format!("{error}"));
    match value {
        Attribute::Integer(value) => open(integer, None)?.write_scalar(&value),
        Attribute::Integers(values) => open(integer, Some(values.len()))?.write_raw(values),
        Attribute::Text(value) => {
            let value: VarLenUnicode = value.parse().map_err(|error| text(&error))?;
            open(TypeDescriptor::VarLenUnicode, None)?.write_scalar(&value)
        }
        Attribute::Ascii(value) => {
            let bytes =
                FixedAscii::<ASCII_BYTES>::from_ascii(value).map_err(|error| text(&error))?;
            open(TypeDescriptor::FixedAscii(value.len()), None)?.write_scalar(&bytes)
        }
    }
}
