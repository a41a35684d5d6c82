//! Variables of netCDF files, in the classic formats and in netCDF-4, which uses HDF5.

use std::path::Path;

use rustc_hash::FxHashMap;

use super::{Fault, LARGEST_RATIO};

/// First bytes of an HDF5 file.
pub const HDF5_SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

/// The variables of a file.
pub enum Netcdf<'a> {
    /// CDF-1, CDF-2 and CDF-5.
    Classic(Classic<'a>),
    /// netCDF-4.
    Hdf5 {
        /// The open file.
        file: hdf5_metno::File,
        /// Size of the file, bytes.
        size: u64,
    },
}

impl<'a> Netcdf<'a> {
    /// Open a file. `bytes` are the content of the file; for HDF5, the first bytes suffice.
    pub fn open(path: &Path, bytes: &'a [u8]) -> Fault<Self> {
        if bytes.starts_with(b"CDF") {
            return Classic::new(bytes).map(Self::Classic);
        }
        if !bytes.starts_with(HDF5_SIGNATURE) {
            return Err("is neither a netCDF nor an HDF5 file".to_owned());
        }
        let file = hdf5_metno::File::open(path);
        let file = file.map_err(|error| format!("cannot open it as HDF5: {error}"))?;
        let size = std::fs::metadata(path).map_err(|error| error.to_string())?;
        Ok(Self::Hdf5 {
            file,
            size: size.len(),
        })
    }

    /// Test whether the file has a variable of this name.
    pub fn has(&self, name: &str) -> bool {
        match self {
            Self::Classic(classic) => classic.variables.contains_key(name),
            Self::Hdf5 { file, .. } => file.link_exists(name),
        }
    }

    /// Return the lengths of a variable's dimensions.
    pub fn shape(&self, name: &str) -> Fault<Vec<usize>> {
        match self {
            Self::Classic(classic) => Ok(classic.variable(name)?.shape.clone()),
            Self::Hdf5 { file, .. } => {
                let dataset = file
                    .dataset(name)
                    .map_err(|error| format!("variable {name}: {error}"))?;
                Ok(dataset.shape())
            }
        }
    }

    /// Return the dataset of a variable, or an error if the variable is larger than the file can hold.
    fn dataset(file: &hdf5_metno::File, name: &str, size: u64) -> Fault<hdf5_metno::Dataset> {
        let words = |error: hdf5_metno::Error| format!("variable {name}: {error}");
        let dataset = file.dataset(name).map_err(words)?;
        let each = dataset.dtype().map_err(words)?.size() as u64;
        let count = dataset
            .shape()
            .iter()
            .try_fold(each, |all, length| all.checked_mul(*length as u64));
        // Chunks that were never written take no bytes in the file. A valid dataset with almost only such
        // chunks would fail here, but programs write all chunks of a mesh.
        if count.is_none_or(|count| count > (LARGEST_RATIO as u64).saturating_mul(size)) {
            return Err(format!("variable {name}: is larger than the file can hold"));
        }
        Ok(dataset)
    }

    /// Read a variable of real numbers.
    pub fn reals(&self, name: &str) -> Fault<Vec<f64>> {
        match self {
            Self::Classic(classic) => classic.reals(name),
            Self::Hdf5 { file, size } => {
                let dataset = Self::dataset(file, name, *size)?;
                dataset
                    .read_raw()
                    .map_err(|error| format!("variable {name}: {error}"))
            }
        }
    }

    /// Read a variable of whole numbers.
    pub fn integers(&self, name: &str) -> Fault<Vec<i64>> {
        match self {
            Self::Classic(classic) => {
                let numbers = classic.reals(name)?;
                Ok(numbers.iter().map(|number| *number as i64).collect())
            }
            Self::Hdf5 { file, size } => {
                let dataset = Self::dataset(file, name, *size)?;
                dataset
                    .read_raw()
                    .map_err(|error| format!("variable {name}: {error}"))
            }
        }
    }

    /// Read a variable whose rows are texts.
    pub fn texts(&self, name: &str) -> Fault<Vec<String>> {
        let length = self.shape(name)?.last().copied().unwrap_or(0).max(1);
        let bytes = match self {
            Self::Classic(classic) => classic.bytes(name)?.to_vec(),
            Self::Hdf5 { file, size } => {
                let dataset = Self::dataset(file, name, *size)?;
                let words = |error: hdf5_metno::Error| format!("variable {name}: {error}");
                let letters: Vec<hdf5_metno::types::FixedAscii<1>> =
                    dataset.read_raw().map_err(words)?;
                letters
                    .iter()
                    .map(|letter| letter.as_bytes().first().copied().unwrap_or(0))
                    .collect()
            }
        };
        Ok(bytes.chunks(length).map(text).collect())
    }

    /// Read a text attribute of a variable.
    pub fn attribute(&self, variable: &str, name: &str) -> Fault<String> {
        match self {
            Self::Classic(classic) => {
                let found = classic.variable(variable)?.attributes.get(name);
                found
                    .cloned()
                    .ok_or_else(|| format!("variable {variable}: has no {name}"))
            }
            Self::Hdf5 { file, .. } => {
                let words =
                    |error: hdf5_metno::Error| format!("variable {variable}: {name}: {error}");
                let attribute = file
                    .dataset(variable)
                    .and_then(|dataset| dataset.attr(name));
                let attribute = attribute.map_err(words)?;
                // The text has a fixed length, as in files that netCDF writes, or a variable length.
                let fixed = attribute.read_scalar::<hdf5_metno::types::FixedAscii<64>>();
                fixed
                    .map(|text| text.as_str().to_owned())
                    .or_else(|_| {
                        let any = attribute.read_scalar::<hdf5_metno::types::VarLenAscii>();
                        any.map(|text| text.as_str().to_owned())
                    })
                    .map_err(words)
            }
        }
    }
}

/// Return the text before the first zero byte, without white space at its ends.
fn text(bytes: &[u8]) -> String {
    let end = bytes
        .iter()
        .position(|byte| *byte == 0)
        .unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).trim().to_owned()
}

/// A classic file with its header.
pub struct Classic<'a> {
    bytes: &'a [u8],
    variables: FxHashMap<String, Variable>,
}

struct Variable {
    shape: Vec<usize>,
    kind: u32,
    begin: usize,
    attributes: FxHashMap<String, String>,
    /// Whether the variable is a record variable, whose entries are interleaved with those of other
    /// variables.
    is_record: bool,
}

/// Return the size of a number of the netCDF type `kind`, bytes.
fn size_of_kind(kind: u32) -> Fault<usize> {
    match kind {
        1 | 2 | 7 => Ok(1),
        3 | 8 => Ok(2),
        4 | 5 | 9 => Ok(4),
        6 | 10 | 11 => Ok(8),
        _ => Err(format!("has numbers of the unknown type {kind}")),
    }
}

/// Current position in the header. `rest` are the bytes after this position.
struct Cursor<'a> {
    rest: &'a [u8],
    version: u8,
}

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Fault<&'a [u8]> {
        let taken = self.rest.split_off(..count);
        taken.ok_or_else(|| "its header ends too early".to_owned())
    }

    fn word(&mut self) -> Fault<u32> {
        let bytes = self.take(4)?.try_into().expect("there are four");
        Ok(u32::from_be_bytes(bytes))
    }

    fn long(&mut self) -> Fault<usize> {
        let bytes = self.take(8)?.try_into().expect("there are eight");
        usize::try_from(u64::from_be_bytes(bytes)).map_err(|error| error.to_string())
    }

    /// Read one number, which is a count of entries or a length.
    fn count(&mut self) -> Fault<usize> {
        if self.version == 5 {
            self.long()
        } else {
            Ok(self.word()? as usize)
        }
    }

    /// Read a position in the file.
    fn offset(&mut self) -> Fault<usize> {
        if self.version == 1 {
            Ok(self.word()? as usize)
        } else {
            self.long()
        }
    }

    fn padded(&mut self, count: usize) -> Fault<&'a [u8]> {
        let taken = self.take(count)?;
        self.take((4 - count % 4) % 4)?;
        Ok(taken)
    }

    fn name(&mut self) -> Fault<String> {
        let length = self.count()?;
        Ok(String::from_utf8_lossy(self.padded(length)?).into_owned())
    }

    /// Read the number of entries of a list. The number is not checked. Each entry takes at least one byte of
    /// the file. Therefore, if the number is too large, reading the entries fails at the end of the file.
    fn list(&mut self) -> Fault<usize> {
        self.word()?;
        self.count()
    }

    /// Read a list of attributes. Return the text attributes.
    fn attributes(&mut self) -> Fault<FxHashMap<String, String>> {
        let mut attributes = FxHashMap::default();
        for _ in 0..self.list()? {
            let name = self.name()?;
            let kind = self.word()?;
            let count = self.count()?.checked_mul(size_of_kind(kind)?);
            let value = self.padded(count.ok_or("its header is damaged")?)?;
            if kind == 2 {
                attributes.insert(name, text(value));
            }
        }
        Ok(attributes)
    }
}

impl<'a> Classic<'a> {
    fn new(bytes: &'a [u8]) -> Fault<Self> {
        let version = bytes.get(3).copied().unwrap_or(0);
        if !matches!(version, 1 | 2 | 5) {
            return Err(format!("is a netCDF file of the unknown version {version}"));
        }
        let mut cursor = Cursor {
            rest: &bytes[4..],
            version,
        };
        let records = cursor.count()?;
        let mut dimensions = Vec::new();
        for _ in 0..cursor.list()? {
            cursor.name()?;
            dimensions.push(cursor.count()?);
        }
        cursor.attributes()?;
        let mut variables = FxHashMap::default();
        for _ in 0..cursor.list()? {
            let name = cursor.name()?;
            let mut shape = Vec::new();
            let mut is_record = false;
            for k in 0..cursor.count()? {
                let index = cursor.count()?;
                let length = *dimensions.get(index).ok_or("its header is damaged")?;
                if k == 0 && length == 0 {
                    is_record = true;
                    shape.push(records);
                } else {
                    shape.push(length);
                }
            }
            let attributes = cursor.attributes()?;
            let kind = cursor.word()?;
            cursor.count()?;
            let begin = cursor.offset()?;
            let variable = Variable {
                shape,
                kind,
                begin,
                attributes,
                is_record,
            };
            variables.insert(name, variable);
        }
        Ok(Self { bytes, variables })
    }

    fn variable(&self, name: &str) -> Fault<&Variable> {
        self.variables
            .get(name)
            .ok_or_else(|| format!("has no variable {name}"))
    }

    /// Return the bytes of a variable of fixed size.
    fn bytes(&self, name: &str) -> Fault<&'a [u8]> {
        let variable = self.variable(name)?;
        let words = |message: &str| format!("variable {name}: {message}");
        if variable.is_record {
            return Err(words(
                "is a record variable; variables of a mesh must have a fixed size",
            ));
        }
        let each = size_of_kind(variable.kind).map_err(|message| words(&message))?;
        let mut lengths = variable.shape.iter();
        let size = lengths.try_fold(each, |all, length| all.checked_mul(*length));
        let range = size.and_then(|size| Some(variable.begin..variable.begin.checked_add(size)?));
        let bytes = range.and_then(|range| self.bytes.get(range));
        bytes.ok_or_else(|| words("is longer than the file"))
    }

    fn reals(&self, name: &str) -> Fault<Vec<f64>> {
        let variable = self.variable(name)?;
        let bytes = self.bytes(name)?;
        macro_rules! numbers {
            ($number:ty) => {{
                let each = bytes.chunks_exact(size_of::<$number>());
                let number = |bytes: &[u8]| {
                    let bytes = bytes.try_into().expect("the chunk has this size");
                    <$number>::from_be_bytes(bytes) as f64
                };
                each.map(number).collect()
            }};
        }
        Ok(match variable.kind {
            1 => numbers!(i8),
            2 | 7 => numbers!(u8),
            3 => numbers!(i16),
            8 => numbers!(u16),
            4 => numbers!(i32),
            9 => numbers!(u32),
            5 => numbers!(f32),
            6 => numbers!(f64),
            10 => numbers!(i64),
            _ => numbers!(u64),
        })
    }
}
