//! Causes of HDF5's errors.

use hdf5_metno as hdf5;
use std::io;

/// How HDF5 writes the error number of a failed system call into its messages.
const NUMBER: &str = "errno = ";

/// HDF5's description of what failed first.
pub(super) fn innermost(error: &hdf5::Error) -> String {
    let stack = error.stack();
    let frame = stack.as_ref().and_then(|frames| frames.last());
    frame.map_or_else(|| error.to_string(), |frame| frame.desc().to_owned())
}

/// The failed system call behind an error; `None` where the bytes of the file could be read.
pub(super) fn system_error(error: &hdf5::Error) -> Option<io::Error> {
    number(&innermost(error)).map(io::Error::from_raw_os_error)
}

fn number(description: &str) -> Option<i32> {
    let (_, rest) = description.split_once(NUMBER)?;
    let end = rest.find(|c: char| !c.is_ascii_digit());
    let number = rest[..end.unwrap_or(rest.len())].parse().ok()?;
    (number != 0).then_some(number)
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn the_error_number_of_a_system_call() {
        let locked =
            "unable to lock file, errno = 11, error message = 'Resource temporarily unavailable'";
        assert_eq!(number(locked), Some(11));
        assert_eq!(
            number("truncated file: eof = 96, sblock->base_addr = 0"),
            None
        );
        assert_eq!(
            number("file read failed: errno = 0, error message = 'Success'"),
            None
        );
    }
}
