//! `fissure init`: commented example decks.

use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use fissure::deck;
use fissure::error::{Error, Result};

use super::{Verbosity, outln};

/// Write a commented example deck.
#[derive(Args)]
#[command(after_help = "\
Examples:
  fissure init plate.toml && fissure run plate.toml
  fissure init beam.toml --template three-point-bending")]
pub struct InitArguments {
    /// Path of the new deck; without an ending, .toml is added.
    name: PathBuf,

    /// Example to write.
    #[arg(long, value_enum, default_value_t = Template::CrackBranching)]
    template: Template,
}

/// An example deck.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Template {
    /// Fast fracture: a crack branches in a glass plate under sudden tension.
    CrackBranching,
    /// Fast fracture: the same plate on a grid that is refined along the crack.
    RefinedGrid,
    /// Slow loading with fracture: a notched beam is bent until it breaks.
    ThreePointBending,
    /// Slow loading with fracture: a compact tension specimen is opened until a crack runs.
    CompactTension,
    /// Slow loading without fracture: the strain beside a hole.
    PlateWithHole,
    /// Slow loading without fracture: a beam under a force at its end.
    Cantilever,
    /// A solid: a round crack grows in a glass cube.
    PennyCrack,
    /// A solid under impact: edge-on impact on a ceramic tile.
    Impact,
    /// Points from a file: a rock disc between two plates. Also writes disc.csv.
    PointsFromFile,
}

impl Template {
    /// Return the text of the deck.
    fn text(self) -> &'static str {
        match self {
            Self::CrackBranching => deck::EXAMPLE,
            Self::RefinedGrid => include_str!("../../inputs/crack_branching_adaptive.toml"),
            Self::ThreePointBending => include_str!("../../inputs/three_point_bending.toml"),
            Self::CompactTension => include_str!("../../inputs/compact_tension.toml"),
            Self::PlateWithHole => include_str!("../../inputs/plate_with_hole.toml"),
            Self::Cantilever => include_str!("../../inputs/cantilever.toml"),
            Self::PennyCrack => include_str!("../../inputs/penny_crack.toml"),
            Self::Impact => include_str!("../../inputs/eoi_alon.toml"),
            Self::PointsFromFile => include_str!("../../inputs/points_from_file.toml"),
        }
    }

    /// Return name and text of the data file that the deck reads; `None` if the deck reads no file.
    fn data(self) -> Option<(&'static str, &'static str)> {
        match self {
            Self::PointsFromFile => Some(("disc.csv", include_str!("../../inputs/disc.csv"))),
            _ => None,
        }
    }
}

/// Write a deck to a new file. If the deck reads a data file, write this file into the same folder.
///
/// # Errors
/// - If the file of the deck already exists.
/// - If the data file exists with other content, or has the same path as the deck.
/// - If a file cannot be written.
pub fn init(arguments: &InitArguments, verbosity: Verbosity) -> Result<()> {
    let mut path = arguments.name.clone();
    if path.extension().is_none() {
        path.set_extension("toml");
    }
    let data = arguments.template.data();
    let mut data = data.map(|(name, text)| (path.with_file_name(name), text));
    // Check both paths before a file is written.
    if path.symlink_metadata().is_ok() {
        return Err(exists(&path));
    }
    if let Some((beside, text)) = &data {
        if *beside == path {
            let message = format!(
                "{}: the template writes another file of this name; choose another name",
                path.display()
            );
            return Err(Error::input(message));
        }
        if fs::read(beside).is_ok_and(|known| known == text.as_bytes()) {
            data = None;
        } else if beside.symlink_metadata().is_ok() {
            let message = format!(
                "{} exists already with other content, and the template writes this file; choose another folder",
                beside.display()
            );
            return Err(Error::input(message));
        }
    }
    if let Some((path, text)) = &data {
        write_new(path, text)?;
    }
    write_new(&path, arguments.template.text())?;
    if verbosity > Verbosity::Quiet {
        let name = path.display();
        let beside = data.map_or(String::new(), |(path, _)| {
            format!(" and {}", path.display())
        });
        outln!("wrote {name}{beside}; next: fissure check {name}, then fissure run {name}");
    }
    Ok(())
}

fn exists(path: &Path) -> Error {
    let message = format!("{} exists already; choose another name", path.display());
    Error::input(message)
}

fn write_new(path: &Path, text: &str) -> Result<()> {
    let mut file = match OpenOptions::new().write(true).create_new(true).open(path) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::AlreadyExists => return Err(exists(path)),
        Err(error) => return Err(Error::file(path, "create", &error)),
    };
    file.write_all(text.as_bytes())
        .map_err(|error| Error::file(path, "write", &error))
}
