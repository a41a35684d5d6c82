//! `fissure init`: a commented example deck.

use crate::cli::outln;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};

use fissure::deck;
use fissure::error::{Error, Result};

use super::{InitArguments, Verbosity, file_error};

/// Write the example deck to a new file.
///
/// # Errors
/// If the file exists or cannot be written.
pub fn init(arguments: &InitArguments, verbosity: Verbosity) -> Result<()> {
    let mut path = arguments.name.clone();
    if path.extension().is_none() {
        path.set_extension("toml");
    }
    let mut file = match OpenOptions::new().write(true).create_new(true).open(&path) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {
            let message = format!("{} exists already; choose another name", path.display());
            return Err(Error::input(message));
        }
        Err(error) => return Err(file_error(&path, "create", &error)),
    };
    file.write_all(deck::EXAMPLE.as_bytes())
        .map_err(|error| file_error(&path, "write", &error))?;
    if verbosity > Verbosity::Quiet {
        let name = path.display();
        outln!("wrote {name}; next: fissure check {name}, then fissure run {name}");
    }
    Ok(())
}
