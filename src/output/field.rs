//! Fields of a result file: description, data and writing.

use super::attribute::Attribute;
use super::collective::CollectiveFile;
use super::dataset::{Dataset, Rows};
use crate::error::{Error, Result};
use std::borrow::Cow;

/// Path of the group of the fields.
pub(super) const POINT_DATA: &str = "/VTKHDF/PointData";

/// The number type of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    /// 8-byte float.
    F64,
    /// 4-byte float.
    F32,
    /// 8-byte unsigned integer.
    U64,
    /// 4-byte unsigned integer.
    U32,
    /// 1-byte unsigned integer.
    U8,
}

/// Name, unit, shape and number type of a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FieldDescription {
    /// Name of the field.
    pub name: &'static str,
    /// Unit, such as `m/s`; `1` or empty if dimensionless.
    pub unit: &'static str,
    /// Components per point:
    ///
    /// - 1: scalar;
    /// - 2: plane vector, stored with a third component of 0;
    /// - 3: vector;
    /// - 6: symmetric tensor (xx, yy, zz, xy, yz, xz);
    /// - 9: tensor, row-major.
    pub components: usize,
    /// Number type of the stored values.
    pub number: Number,
}

/// This rank's values of a field, row-major: [points of this rank, components].
#[derive(Debug, Clone, Copy)]
pub enum FieldData<'a> {
    /// 8-byte floats.
    F64(&'a [f64]),
    /// 4-byte floats.
    F32(&'a [f32]),
    /// 8-byte integers, such as point ids.
    U64(&'a [u64]),
    /// 4-byte integers.
    U32(&'a [u32]),
    /// 1-byte integers and flags.
    U8(&'a [u8]),
}

impl FieldData<'_> {
    /// Return the number type.
    pub fn number(&self) -> Number {
        match self {
            FieldData::F64(_) => Number::F64,
            FieldData::F32(_) => Number::F32,
            FieldData::U64(_) => Number::U64,
            FieldData::U32(_) => Number::U32,
            FieldData::U8(_) => Number::U8,
        }
    }

    fn len(&self) -> usize {
        match self {
            FieldData::F64(values) => values.len(),
            FieldData::F32(values) => values.len(),
            FieldData::U64(values) => values.len(),
            FieldData::U32(values) => values.len(),
            FieldData::U8(values) => values.len(),
        }
    }
}

/// Check that a field has a supported number of components, and that its values have the right count and the
/// right number type.
pub(super) fn check(field: &FieldDescription, data: &FieldData, points: usize) -> Result<()> {
    let (name, components, length) = (field.name, field.components, data.len());
    if !matches!(components, 1 | 2 | 3 | 6 | 9) {
        let text = format!("the field {name} has {components} components, not 1, 2, 3, 6 or 9");
        return Err(Error::run(text));
    }
    if length != points * components {
        let text = format!(
            "the field {name} has {length} values, not {components} for each of {points} points"
        );
        return Err(Error::run(text));
    }
    if data.number() != field.number {
        let (number, expected) = (data.number(), field.number);
        let text = format!("the field {name} has values of type {number:?}, not {expected:?}");
        return Err(Error::run(text));
    }
    Ok(())
}

pub(super) fn create_field(
    file: &mut CollectiveFile,
    field: &FieldDescription,
    rows: Rows,
) -> Result<Dataset> {
    let path = format!("{POINT_DATA}/{}", field.name);
    let columns = match field.components {
        1 => None,
        2 => Some(3),
        more => Some(more),
    };
    let dataset = match field.number {
        Number::F64 => file.create_dataset::<f64>(&path, rows, columns),
        Number::F32 => file.create_dataset::<f32>(&path, rows, columns),
        Number::U64 => file.create_dataset::<u64>(&path, rows, columns),
        Number::U32 => file.create_dataset::<u32>(&path, rows, columns),
        Number::U8 => file.create_dataset::<u8>(&path, rows, columns),
    }?;
    file.set_dataset_attribute(&dataset, "unit", Attribute::Text(field.unit))?;
    Ok(dataset)
}

pub(super) fn write_field(
    file: &mut CollectiveFile,
    dataset: &Dataset,
    row: u64,
    field: &FieldDescription,
    data: &FieldData,
) -> Result<()> {
    let plane = field.components == 2;
    match data {
        FieldData::F64(values) => file.write_rows(dataset, row, &padded(values, plane)),
        FieldData::F32(values) => file.write_rows(dataset, row, &padded(values, plane)),
        FieldData::U64(values) => file.write_rows(dataset, row, &padded(values, plane)),
        FieldData::U32(values) => file.write_rows(dataset, row, &padded(values, plane)),
        FieldData::U8(values) => file.write_rows(dataset, row, &padded(values, plane)),
    }
}

/// Pad plane vectors with a third component, because viewers require vectors of three components.
fn padded<T: Copy + Default>(values: &[T], plane: bool) -> Cow<'_, [T]> {
    if !plane {
        return Cow::Borrowed(values);
    }
    let spatial = |pair: &[T]| [pair[0], pair[1], T::default()];
    Cow::Owned(values.chunks_exact(2).flat_map(spatial).collect())
}
