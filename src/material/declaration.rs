//! Declarations of laws, as data. The deck's grammar, the table of laws in the book, and the tests of all laws use
//! them.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use super::AnyLaw;
use crate::damage::CriticalStretch;
use crate::dimension::Dimension;
use crate::elastic::Isotropic;

/// A law under its name in decks.
pub struct Declaration {
    /// Its name in decks.
    pub name: &'static str,
    /// Description of its forces, one line.
    pub force: &'static str,
    /// Its keys in addition to density, elastic constants and damping.
    pub keys: &'static [Key],
    /// Whether Poisson's ratio is free, so that it takes two elastic constants; else the ratio is
    /// that of [bond-based laws](Dimension::bond_based_poisson_ratio).
    pub any_poisson_ratio: bool,
    /// Why there is no 1-D form, and the alternative; `None` if there is one.
    pub no_line: Option<&'static str>,
    /// Whether forces act along ξ and are linear in the displacements, so that they ignore rotation.
    pub linear: bool,
    /// The invariants of the law with these values of its keys.
    pub invariants: fn(&Values) -> Invariants,
    /// The error in the combination of its keys' values, if there is one.
    pub fault: Option<fn(&Values, Dimension) -> Option<LawFault>>,
    /// The elastic constants that follow from its own keys, if these are given; a deck must then give no other
    /// constants.
    pub elastic: Option<fn(&Values, Dimension) -> Option<Isotropic>>,
    /// Whether bonds can break by the work done on them.
    pub breaks_by_energy: bool,
    /// Whether bonds can break by the stress of their points.
    pub breaks_by_stress: bool,
    /// The critical stretch that belongs to a fracture energy (J/m²); `None` if bonds never break by
    /// their stretch.
    pub critical_stretch: Option<fn(&Given, f64) -> f64>,
    /// The stretch at which bonds of the law break by themselves; its bodies have no damage law. `None` if a damage law
    /// says when they break.
    pub own_critical_stretch: Option<fn(&Given) -> f64>,
    /// Check of the law at a horizon, which returns an error; `None` if no horizon is wrong.
    pub horizon_fault: Option<fn(&Given) -> Option<String>>,
    /// Whether the law scales the critical stretch of each bond itself, with these values of its keys.
    pub scales_thresholds: fn(&Values) -> bool,
    /// Create the law.
    pub build: fn(&Given) -> Built,
    /// Examples for the tests: keys in addition to density and Young's modulus.
    pub examples: &'static [&'static str],
}

impl Declaration {
    /// A law without keys, in every dimension, with the Poisson ratio of bond-based laws and forces
    /// along Y, the slope of an energy, whose bonds never break.
    pub const fn new(name: &'static str, force: &'static str, build: fn(&Given) -> Built) -> Self {
        Self {
            name,
            force,
            keys: &[],
            any_poisson_ratio: false,
            no_line: None,
            linear: false,
            invariants: |_| Invariants::ALL,
            fault: None,
            elastic: None,
            breaks_by_energy: false,
            breaks_by_stress: false,
            critical_stretch: None,
            own_critical_stretch: None,
            horizon_fault: None,
            scales_thresholds: |_| false,
            build,
            examples: &[""],
        }
    }

    /// Whether bonds can break without a damage law.
    pub fn breaks_by_itself(&self) -> bool {
        self.own_critical_stretch.is_some()
    }

    /// Whether the law exists in this setting, with the defaults of its keys.
    pub fn is_for(&self, dimension: Dimension) -> bool {
        self.no_line.is_none() || !matches!(dimension, Dimension::Line { .. })
    }

    /// The key of this name, if the law has it.
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys.iter().find(|key| key.name == name)
    }
}

impl fmt::Debug for Declaration {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name)
    }
}

/// Invariants of a law that hold after any motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Invariants {
    /// Forces are the gradient of the strain energy; this does not hold for bonds that yield.
    pub conservative: bool,
    /// A rotated motion has the same forces, rotated.
    pub objective: bool,
    /// The internal forces of a body have no resultant moment.
    pub angular_momentum: bool,
}

impl Invariants {
    /// All of them.
    pub const ALL: Self = Self {
        conservative: true,
        objective: true,
        angular_momentum: true,
    };
}

/// An error in the values of a law's keys.
#[derive(Debug, Clone)]
pub struct LawFault {
    /// The wrong key, if it is a single one.
    pub key: Option<&'static str>,
    /// Message: what is wrong, and what is allowed.
    pub message: String,
}

/// A law that decks can name, perhaps under several names.
pub trait Declared {
    /// One for each name.
    const DECLARATIONS: &'static [Declaration];
}

/// A key of a law's table in decks.
#[derive(Debug)]
pub struct Key {
    /// Its name.
    pub name: &'static str,
    /// Its meaning, with unit.
    pub meaning: &'static str,
    /// The allowed values.
    pub kind: Kind,
}

/// The allowed values of a key.
#[derive(Debug)]
pub enum Kind {
    /// A number.
    Number {
        /// The allowed range.
        range: Range<f64>,
        /// The range in words that follow "must be".
        words: &'static str,
        /// Its default; `None` if the key is required.
        default: Option<f64>,
    },
    /// An optional number.
    Optional {
        /// The allowed range.
        range: Range<f64>,
        /// The range in words that follow "must be".
        words: &'static str,
    },
    /// One of these words; the default is the first.
    Word(&'static [Word]),
    /// An optional expression of the bond's length r (m).
    OfLength,
}

impl Kind {
    /// A required number above 0.
    pub const POSITIVE: Self = Self::Number {
        range: f64::MIN_POSITIVE..f64::INFINITY,
        words: "above 0",
        default: None,
    };
}

/// An allowed word of a key.
#[derive(Debug)]
pub struct Word {
    /// The word as written in decks.
    pub word: &'static str,
    /// Why there is no 1-D form with this word, and the alternative; `None` if there is one.
    pub no_line: Option<&'static str>,
}

impl Word {
    /// A word for every dimension.
    pub const fn new(word: &'static str) -> Self {
        let no_line = None;
        Self { word, no_line }
    }
}

/// The value of a key.
#[derive(Debug, Clone)]
pub enum Value {
    /// A number.
    Number(f64),
    /// A word.
    Word(String),
    /// A function of a bond's length.
    OfLength(Arc<dyn OfLength>),
}

/// A function of a bond's length.
pub trait OfLength: fmt::Debug + Send + Sync {
    /// Its value for a length (m).
    fn at(&self, length: f64) -> f64;
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<&str> for Value {
    fn from(word: &str) -> Self {
        Self::Word(word.to_owned())
    }
}

/// The values of a law's own keys, in the order in which it declares them.
#[derive(Debug, Clone)]
pub struct Values(Vec<(&'static str, Option<Value>)>);

impl Values {
    /// The defaults of these keys.
    pub fn defaults(keys: &[Key]) -> Self {
        let default = |key: &Key| match &key.kind {
            Kind::Number { default, .. } => default.map(Value::Number),
            Kind::Word(words) => words.first().map(|first| first.word.into()),
            Kind::Optional { .. } | Kind::OfLength => None,
        };
        Self(keys.iter().map(|key| (key.name, default(key))).collect())
    }

    /// Set the value of a key, which must be one of the law's keys.
    pub fn set(&mut self, key: &str, value: Value) {
        if let Some((_, old)) = self.0.iter_mut().find(|(name, _)| *name == key) {
            *old = Some(value);
        }
    }

    /// The value of a key, if it has one.
    pub fn get(&self, key: &str) -> Option<&Value> {
        let (_, value) = self.0.iter().find(|(name, _)| *name == key)?;
        value.as_ref()
    }

    /// The number of a key.
    ///
    /// # Panics
    /// When the key has none: it is not declared as a number, or was not given.
    pub fn number(&self, key: &str) -> f64 {
        match self.get(key) {
            Some(Value::Number(number)) => *number,
            other => panic!("`{key}` is no number: {other:?}"),
        }
    }

    /// The word of a key.
    ///
    /// # Panics
    /// When the key has none.
    pub fn word(&self, key: &str) -> &str {
        match self.get(key) {
            Some(Value::Word(word)) => word,
            other => panic!("`{key}` is no word: {other:?}"),
        }
    }

    /// The function of a key, if it was given.
    pub fn of_length(&self, key: &str) -> Option<&Arc<dyn OfLength>> {
        match self.get(key) {
            Some(Value::OfLength(function)) => Some(function),
            _ => None,
        }
    }
}

/// The input from which a law is created: constants of one end of bonds.
pub struct Given<'a> {
    /// The setting.
    pub dimension: Dimension,
    /// Elastic constants.
    pub elastic: Isotropic,
    /// δ, m.
    pub horizon: f64,
    /// Values of the law's own keys; all required keys have one.
    pub values: &'a Values,
    /// Whether the critical stretch follows from a fracture energy, which a law may then hold bond by
    /// bond; else it was given itself and holds for all bonds alike.
    pub from_fracture_energy: bool,
}

/// The critical stretch of the prototype law with these constants and this fracture energy (J/m²).
pub fn bond_based_critical_stretch(given: &Given, energy: f64) -> f64 {
    CriticalStretch::from_energy(given.dimension, given.elastic, energy, given.horizon)
}

/// A law, and its data that the loops over bonds do not read.
pub struct Built {
    /// The law.
    pub law: AnyLaw,
    /// Factor on bonds of a length (m) in all sums of a point; `None` for 1.
    pub influence: Option<Box<dyn Fn(f64) -> f64 + Sync>>,
}

impl Built {
    /// Create it without an influence function.
    pub fn plain(law: impl Into<AnyLaw>) -> Self {
        Self {
            law: law.into(),
            influence: None,
        }
    }

    /// Create it with an influence function of the bond's length (m).
    pub fn with_influence(
        law: impl Into<AnyLaw>,
        influence: impl Fn(f64) -> f64 + Sync + 'static,
    ) -> Self {
        Self {
            law: law.into(),
            influence: Some(Box::new(influence)),
        }
    }
}
