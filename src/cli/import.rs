//! `fissure import`: decks of other codes.

use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use fissure::error::{Error, Result};
use fissure::import::log::Fate;
use fissure::import::{self, Code};

use super::{Verbosity, errln, outln};

/// Translate a deck of Peridigm, PeriLab or LAMMPS.
///
/// Writes a commented deck. Lists for each key whether the key was translated, approximated or left out, and
/// why.
#[derive(Args)]
#[command(after_help = "\
Examples:
  fissure import disk_impact.yaml               writes disk_impact.toml beside it
  fissure import WaveInBar.xml -o bar.toml
  fissure import in.peri                        writes in.peri.toml
  fissure import model.yaml --from peridigm     skip the detection")]
pub struct ImportArguments {
    /// Deck to translate: YAML, XML, or an input script of LAMMPS.
    deck: PathBuf,

    /// Path of the new deck [default: the path of the source deck with the ending .toml instead of .yaml,
    /// .yml, .xml or .peridigm; .toml is appended to paths with another ending].
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,

    /// Code for which the source deck was written [default: detected from the deck].
    #[arg(long, value_enum, value_name = "CODE")]
    from: Option<From>,

    /// Replace an existing deck.
    #[arg(long)]
    overwrite: bool,
}

/// A code whose decks can be translated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum From {
    /// Peridigm.
    Peridigm,
    /// PeriLab.
    Perilab,
    /// LAMMPS with `atom_style peri`.
    Lammps,
}

/// Translate a deck and write the new deck.
///
/// # Errors
/// - If the deck cannot be translated.
/// - If the new deck exists and may not be replaced.
/// - If the new deck would replace the source deck or a file that the new deck reads.
/// - If the new deck cannot be written.
pub fn import(arguments: &ImportArguments, verbosity: Verbosity) -> Result<()> {
    let target = arguments.output.clone();
    let target = target.unwrap_or_else(|| default_target(&arguments.deck));
    let code = arguments.from.map(|from| match from {
        From::Peridigm => Code::Peridigm,
        From::Perilab => Code::PeriLab,
        From::Lammps => Code::Lammps,
    });
    let exists = || {
        let message = format!(
            "{} exists already; choose another name with --output, or replace it with --overwrite",
            target.display()
        );
        Error::input(message)
    };
    let is_target = |path: &Path| match (path.canonicalize(), target.canonicalize()) {
        (Ok(path), Ok(target)) => path == target,
        _ => false,
    };
    let not_to_replace = |what: &str| {
        let name = target.display();
        Error::input(format!(
            "{name} is {what}; choose another name with --output"
        ))
    };
    if is_target(&arguments.deck) {
        return Err(not_to_replace("the deck to import"));
    }
    if target.exists() && !arguments.overwrite {
        return Err(exists());
    }
    let imported = import::import(&arguments.deck, code, &target)?;
    if imported.files.iter().any(|file| is_target(file)) {
        return Err(not_to_replace("a file that the deck reads"));
    }
    let mut options = OpenOptions::new();
    if arguments.overwrite {
        options.write(true).create(true).truncate(true)
    } else {
        options.write(true).create_new(true)
    };
    let mut file = match options.open(&target) {
        Ok(file) => file,
        Err(error) if error.kind() == ErrorKind::AlreadyExists => return Err(exists()),
        Err(error) => return Err(Error::file(&target, "create", &error)),
    };
    file.write_all(imported.text.as_bytes())
        .map_err(|error| Error::file(&target, "write", &error))?;
    if verbosity == Verbosity::Quiet {
        return Ok(());
    }
    let name = target.display();
    outln!(
        " line  what became of the keys of {}",
        arguments.deck.display()
    );
    for entry in &imported.entries {
        outln!("{entry}");
    }
    outln!(
        "wrote {name} from a deck of {}: {} keys taken, {} approximated, {} left out",
        imported.code,
        imported.count(Fate::Taken),
        imported.count(Fate::Approximated),
        imported.count(Fate::LeftOut)
    );
    match &imported.fault {
        None => outln!("next: fissure check {name}, then fissure run {name}"),
        Some(_) => outln!("next: correct {name}"),
    }
    if let Some(fault) = &imported.fault {
        errln!("warning: the new deck is not valid yet: {fault}");
    }
    let losses = imported.losses();
    if !losses.is_empty() {
        errln!("warning: {losses}");
    }
    Ok(())
}

/// Return the default path of the new deck. If the path of the source deck has an ending of Peridigm or
/// PeriLab (such as `.yaml`), this ending is replaced by `.toml`. Otherwise, `.toml` is appended to the path.
fn default_target(deck: &Path) -> PathBuf {
    let endings = ["yaml", "yml", "xml", "peridigm"];
    let ending = deck.extension().and_then(|ending| ending.to_str());
    if ending.is_some_and(|ending| {
        endings
            .iter()
            .any(|known| ending.eq_ignore_ascii_case(known))
    }) {
        deck.with_extension("toml")
    } else {
        let mut name = deck.as_os_str().to_owned();
        name.push(".toml");
        name.into()
    }
}
