//! Causes of HDF5 errors.

use hdf5_metno as hdf5;
use std::io;

/// Prefix of a system error number in HDF5's messages.
const ERRNO_PREFIX: &str = "errno = ";

/// Return HDF5's description of the innermost error on the error stack of `error`.
pub(super) fn innermost(error: &hdf5::Error) -> String {
    let stack = error.stack();
    let frame = stack.as_ref().and_then(|frames| frames.last());
    frame.map_or_else(|| error.to_string(), |frame| frame.desc().to_owned())
}

/// Return the error of the system call that caused an HDF5 error; `None` if no system call failed.
pub(super) fn system_error(error: &hdf5::Error) -> Option<io::Error> {
    errno(&innermost(error)).map(io::Error::from_raw_os_error)
}

fn errno(description: &str) -> Option<i32> {
    let (_, rest) = description.split_once(ERRNO_PREFIX)?;
    let end = rest.find(|c: char| !c.is_ascii_digit());
    let number = rest[..end.unwrap_or(rest.len())].parse().ok()?;
    (number != 0).then_some(number)
}

#[cfg(test)]
mod tests {
    use super::errno;

    #[test]
    fn the_error_number_of_a_system_call() {
        let locked =
            "unable to lock file, errno = 11, error message = 'Resource temporarily unavailable'";
        assert_eq!(errno(locked), Some(11));
        assert_eq!(
            errno("truncated file: eof = 96, sblock->base_addr = 0"),
            None
        );
        assert_eq!(
            errno("file read failed: errno = 0, error message = 'Success'"),
            None
        );
    }
}
