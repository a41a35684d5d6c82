//! Decks, the TOML files that describe runs. This module converts the text of a deck to a validated
//! [`Problem`].

mod assign;
mod bodies;
mod conditions;
mod contact;
mod damage;
mod difference;
mod explain;
mod fields;
mod from_toml;
pub mod grammar;
mod group_name;
mod history;
mod horizon;
mod interface;
mod lints;
mod materials;
mod names;
mod number;
mod outputs;
mod overlay;
mod parameters;
mod refinement;
mod resolve;
mod rigid;
mod schema;
mod sets;
mod shapes;
pub mod source;
mod source_map;
pub mod spanned;
mod tables;
mod time;
mod toml_error;
mod validate;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use toml::de::DeTable;

pub use difference::{differences, history_differences};
pub use schema::schema;
pub use source::Source;

use crate::comm::{Communicator, agree, check_equal, threads, total};
use crate::error::{Error, Result, Warning};
use crate::problem::Problem;
use resolve::Scope;

/// The commented deck that `fissure init` writes by default.
pub const EXAMPLE: &str = include_str!("example.toml");

/// A deck whose text follows the grammar, not yet validated.
pub struct Deck {
    source: Source,
    grammar: grammar::Deck,
    /// Copy of `grammar` in which numbers replace horizons that depend on the mean spacing of points; `None`
    /// if the deck has no such horizons. The copy is made only once, because making it can require reading
    /// meshes and point files.
    with_horizons: OnceLock<Option<grammar::Deck>>,
}

/// Read a deck. Each entry of `set` has two parts: a name, and a value or expression. The name is a
/// parameter, a key with its section (`time.safety`), or a key outside of all sections (`thickness`).
///
/// # Errors
/// If the file cannot be read, its text does not follow the grammar, or an entry of `set` has an unknown name
/// or an invalid value. The message has file, line, column, key and the allowed values. For an entry of
/// `set`, the message has the name and the value instead.
pub fn read(path: &Path, set: &[(String, String)]) -> Result<Deck> {
    read_with(path, &[], set)
}

/// Read a deck as [`read`] does, and merge the decks `overlays` into it. Later overlays override earlier
/// overlays; `set` overrides all decks. Tables are merged key by key. Any other value, such as a list, is
/// replaced as a whole. In some tables, the only key names a choice, such as the law of a material. If an
/// overlay makes another choice, this choice replaces the table. Paths in an overlay are relative to the
/// folder of the deck.
///
/// # Errors
/// Same as [`read`]. The location in the message is in the deck or in an overlay.
pub fn read_with(path: &Path, overlays: &[PathBuf], set: &[(String, String)]) -> Result<Deck> {
    let mut files = vec![Source::read(path)?];
    for overlay in overlays {
        files.push(Source::read(overlay)?);
    }
    let merged = Source::new(path, overlay::merge(&files[0], &files[1..])?);
    let (keys, parameters): (Vec<_>, Vec<_>) = set
        .iter()
        .map(|(name, value)| (name.as_str(), value.as_str()))
        .partition(|(name, _)| assign::is_key(&merged, name));
    let source = if overlays.is_empty() && keys.is_empty() {
        merged
    } else {
        Source::changed(assign::assign(&merged, &keys)?, files)
    };
    let mut deck = Deck::new(source)?;
    for (name, value) in parameters {
        parameters::set(&deck.source, &mut deck.grammar.parameters, name, value)?;
    }
    Ok(deck)
}

impl Deck {
    /// Parse the text of a deck.
    ///
    /// # Errors
    /// If the text does not follow the grammar; the message is as in [`read`].
    pub fn new(source: Source) -> Result<Self> {
        let tree = DeTable::parse(&source.text)
            .map_err(|error| toml_error::syntax_error(&source, &error))?;
        let grammar = from_toml::from_table(tree.get_ref(), tree.span())
            .map_err(|error| toml_error::grammar_error(&source, tree.get_ref(), &error))?;
        Ok(Self {
            source,
            grammar,
            with_horizons: OnceLock::new(),
        })
    }

    /// Return the path and the text of the deck.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// Add file, line, column and an excerpt to an error about the [`Problem`] of this deck, if the error has
    /// a span.
    pub fn locate(&self, error: Error) -> Error {
        self.source.locate(error)
    }

    /// Add file and line to a warning about the [`Problem`] of this deck, if the warning has a span.
    pub fn locate_warning(&self, warning: Warning) -> Warning {
        self.source.locate_warning(warning)
    }

    /// Validate the deck in a single process. Return the [`Problem`], including the warnings about the deck.
    ///
    /// If a horizon depends on the mean spacing of points, the process reads the meshes and point files that
    /// contain these points. [`Self::problem_on`] shares this work between ranks.
    ///
    /// # Errors
    /// If a value is invalid; the message is as in [`read`].
    pub fn problem(&self) -> Result<Problem> {
        self.problem_on(&threads::alone())
    }

    /// Same as [`Self::problem`], on several ranks with the same deck. Collective.
    ///
    /// # Errors
    /// If a value is invalid, or the decks of the ranks differ; the error is the same on all ranks.
    pub fn problem_on(&self, comm: &dyn Communicator) -> Result<Problem> {
        check_equal(
            comm,
            &(&self.source.text, &self.grammar),
            "deck",
            "all ranks must read equal decks, overlays and --set values; the deck must be on a file system that \
             all nodes share, and must not be edited during the start",
        )?;
        let mut scope = agree(comm, Scope::of(&self.source, &self.grammar))?;
        let grammar = self.with_horizons(&mut scope, comm)?;
        agree(comm, self.problem_in(&scope, grammar))
    }

    fn problem_in(&self, scope: &Scope, grammar: &grammar::Deck) -> Result<Problem> {
        let mut problem = validate::validate(scope, grammar)?;
        // The warnings are about the deck as written, `self.grammar`. A parameter that occurs only in a
        // horizon is used there, but `grammar` may have a number in place of this horizon.
        problem.warnings = lints::lints(scope, &self.grammar, &problem)?;
        Ok(problem)
    }

    /// Return the parsed deck. Horizons that depend on the mean spacing of points are replaced by their
    /// values. Collective.
    fn with_horizons(&self, scope: &mut Scope, comm: &dyn Communicator) -> Result<&grammar::Deck> {
        let known = self.with_horizons.get();
        // Ranks may be threads that share this deck, so some ranks may find the result of other ranks here.
        let known_on = total(comm, u64::from(known.is_some()));
        let found = match known {
            Some(found) if known_on == comm.size() as u64 => found,
            _ => {
                let found = horizon::resolve(scope, &self.grammar, comm)?;
                self.with_horizons.get_or_init(|| found)
            }
        };
        Ok(found.as_ref().unwrap_or(&self.grammar))
    }

    /// Return the deck as TOML with every default written out. Tables contain their rows instead of the path
    /// of a file. Horizons that depend on the mean spacing of points are replaced by their values.
    ///
    /// # Errors
    /// If the deck is invalid, as in [`Self::problem`], or cannot be serialized.
    pub fn explain(&self) -> Result<String> {
        let mut scope = Scope::of(&self.source, &self.grammar)?;
        let grammar = self.with_horizons(&mut scope, &threads::alone())?;
        explain::explain(&scope, grammar, &self.problem_in(&scope, grammar)?)
    }
}

/// Parse and validate the text of a deck.
///
/// # Errors
/// Same as for [`Deck::new`] and [`Deck::problem`].
pub fn parse(source: &Source) -> Result<Problem> {
    Deck::new(source.clone())?.problem()
}

/// Return the text of a deck with every default written out.
///
/// # Errors
/// Same as for [`Deck::new`] and [`Deck::explain`].
pub fn explain(source: &Source) -> Result<String> {
    Deck::new(source.clone())?.explain()
}
