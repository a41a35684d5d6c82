//! Translation of decks of other codes into Fissure decks: `fissure import`.
//!
//! A source deck becomes a tree of parameters (`tree`) or a list of commands (`script`). For each code, one
//! translator reads the tree or the list. The translator logs the outcome of every key in a [log], and fills
//! a `draft` of the new deck, which is written as TOML. Keys that no translator reads are logged as left out.

mod bodies;
mod bond_filters;
mod computed;
mod conditions;
mod draft;
mod elastic;
mod expression;
mod files;
mod lammps;
pub mod log;
mod outputs;
mod peridigm;
mod perilab;
mod precedence;
mod regions;
mod script;
mod sets;
mod solver;
mod translation;
mod tree;
mod xml;
mod yaml;

use std::fmt;
use std::path::{Path, PathBuf};

use crate::comm::threads;
use crate::deck::{Deck, Source};
use crate::error::{Error, Result};
use crate::points::generate;
use crate::problem::{Body, PointSource, Problem};
use expression::Dialect;
use log::{Entry, Fate, Losses};
use translation::{Translation, line_error};
use tree::Node;

/// A code whose decks can be imported.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Code {
    /// Peridigm, in YAML or XML.
    Peridigm,
    /// PeriLab, in YAML.
    PeriLab,
    /// LAMMPS, as an input script with `atom_style peri`.
    Lammps,
}

impl fmt::Display for Code {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Peridigm => "Peridigm",
            Self::PeriLab => "PeriLab",
            Self::Lammps => "LAMMPS",
        })
    }
}

/// A translated deck.
#[derive(Debug, Clone)]
pub struct Import {
    /// The code for which the source deck was written, such as Peridigm.
    pub code: Code,
    /// Text of the new deck.
    pub text: String,
    /// Outcome of each key of the source deck.
    pub entries: Vec<Entry>,
    /// Files that the new deck reads, and files that the source deck includes.
    pub files: Vec<PathBuf>,
    /// Error of the new deck or of its point and mesh files; `None` if the new deck is valid.
    pub fault: Option<Error>,
}

impl Import {
    /// Return the number of keys with the outcome `fate`.
    pub fn count(&self, fate: Fate) -> usize {
        self.entries
            .iter()
            .filter(|entry| entry.fate == fate)
            .count()
    }

    /// Return the line numbers of the losses that change the results.
    pub fn losses(&self) -> Losses {
        Losses::of(&self.entries)
    }
}

/// Translate the deck at `path`. `target` is the path of the new deck; paths of files in the new deck are
/// relative to the folder of the new deck. `code` is the code for which the source deck was written; if
/// `None`, the code is detected from the text.
///
/// # Errors
/// If the file cannot be read or parsed, the code is unknown, or data that a run needs are missing or wrong.
/// The message gives file and line, or only the file if the file cannot be read.
pub fn import(path: &Path, code: Option<Code>, target: &Path) -> Result<Import> {
    translate(&Source::read(path)?, code, target)
}

/// Same as [`import`], for a deck that has been read.
///
/// # Errors
/// Same as [`import`].
pub fn translate(source: &Source, code: Option<Code>, target: &Path) -> Result<Import> {
    if code.map_or_else(
        || script::is_script(&source.text),
        |code| code == Code::Lammps,
    ) {
        let folder = source.path.parent().unwrap_or("".as_ref());
        let script = script::parse(&source.text, folder);
        let script = script.map_err(|(line, message)| line_error(source, line, message))?;
        let mut translation = Translation::new(source, target, Dialect::Lammps);
        translation.files.borrow_mut().extend(script.files.clone());
        lammps::translate(&mut translation, &script)?;
        return Ok(finish(
            translation,
            &lammps::tree(&script),
            Code::Lammps,
            target,
        ));
    }
    let is_xml = source
        .text
        .trim_start_matches('\u{feff}')
        .trim_start()
        .starts_with('<');
    let text = source.text.trim_start_matches('\u{feff}');
    let parsed = if is_xml {
        xml::parse(text)
    } else {
        // Decks of Peridigm escape the braces of statements with backslashes, and YAML does not allow these
        // escapes.
        yaml::parse(&text.replace("\\{", "{").replace("\\}", "}"))
    };
    let root = parsed.map_err(|(line, message)| line_error(source, line, message))?;
    let found = match root.get("PeriLab") {
        Some(_) => Some(Code::PeriLab),
        None => (is_xml || root.get("Peridigm").is_some()).then_some(Code::Peridigm),
    };
    let Some(code) = code.or(found) else {
        let message = "is no deck of Peridigm (`Peridigm:`, or a ParameterList in XML), PeriLab (`PeriLab:`) or LAMMPS \
                       (`atom_style peri`); --from says which it is";
        return Err(line_error(source, 1, message));
    };
    let dialect = match code {
        Code::PeriLab => Dialect::PeriLab,
        _ => Dialect::Peridigm,
    };
    let mut translation = Translation::new(source, target, dialect);
    match code {
        Code::PeriLab => perilab::translate(&mut translation, &root)?,
        _ => peridigm::translate(&mut translation, &root)?,
    }
    Ok(finish(translation, &root, code, target))
}

/// Compose the text of the new deck and check whether the deck is valid.
fn finish(translation: Translation, root: &Node, code: Code, target: &Path) -> Import {
    let entries = translation.log.entries(root);
    let name = translation.source.path.file_name().unwrap_or_default();
    let name = name.to_string_lossy();
    let heading = [
        format!("Imported from {name}, a deck of {code}."),
        "Numbers have the units of that deck; use one consistent system, such as SI.".to_owned(),
        "Each of its keys is taken, approximated or left out:".to_owned(),
    ];
    let text = translation.draft.text(&heading, &entries);
    let new = Source::new(target, text.clone());
    let problem = Deck::new(new).and_then(|deck| deck.problem());
    let fault = problem.and_then(|problem| check_points(&problem)).err();
    Import {
        code,
        text,
        entries,
        files: translation.files.into_inner(),
        fault,
    }
}

/// If no body of a problem is a shape, read the points, to find errors in the point files and meshes.
///
/// # Errors
/// If a file or a set is invalid.
fn check_points(problem: &Problem) -> Result<()> {
    let is_shape = |body: &Body| matches!(body.points, PointSource::Lattice { .. });
    if !problem.bodies.iter().any(is_shape) {
        generate(problem, &threads::alone())?;
    }
    Ok(())
}
