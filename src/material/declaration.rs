//! Declarations of laws, as data. The deck's grammar, the table of laws in the book, and the tests of all
//! laws use these declarations.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use super::AnyLaw;
use crate::damage::CriticalStretch;
use crate::dimension::Dimension;
use crate::elastic::Isotropic;

/// Declaration of a law under one name. A law with several names in decks has one declaration per name.
pub struct Declaration {
    /// Name of the law in decks.
    pub name: &'static str,
    /// Description of the forces, one line.
    pub force: &'static str,
    /// Keys of the law in addition to the keys common to all laws.
    pub keys: &'static [Key],
    /// Whether Poisson's ratio is free, so that the deck gives two elastic constants. Otherwise the ratio is
    /// that of [bond-based laws](Dimension::bond_based_poisson_ratio).
    pub any_poisson_ratio: bool,
    /// Error message for a 1-D deck with this law. It says that the law has no 1-D form, and names an
    /// alternative law if there is one. `None` if the law has a 1-D form.
    pub no_line: Option<&'static str>,
    /// Whether forces act along ξ and are linear in the displacements, so that the law holds for small
    /// rotations only.
    pub linear: bool,
    /// Return the invariants of the law with these values of its keys.
    pub invariants: fn(&Values) -> Invariants,
    /// Return the error in the combination of the keys' values, if there is one. The field is `None` if every
    /// combination is allowed.
    pub fault: Option<fn(&Values, Dimension) -> Option<LawFault>>,
    /// Return the elastic constants that follow from the law's own keys, if the deck gives these keys. Such a
    /// deck must give no other elastic constants. The field is `None` if the law has no such keys.
    pub elastic: Option<fn(&Values, Dimension) -> Option<Isotropic>>,
    /// Whether the energy criterion can break bonds of this law.
    pub breaks_by_energy: bool,
    /// Whether the stress criterion can break bonds of this law.
    pub breaks_by_stress: bool,
    /// Return the critical stretch for a fracture energy (J/m²). The field is `None` if no stretch criterion
    /// can break bonds of this law.
    pub critical_stretch: Option<fn(&Given, f64) -> f64>,
    /// Return the stretch at which the law itself breaks its bonds; bodies of such a law have no damage law.
    /// The field is `None` for laws without such a stretch.
    pub own_critical_stretch: Option<fn(&Given) -> f64>,
    /// Whether the law breaks bonds because of their history. Bonds of such a law also break in a body
    /// without a damage law. A damage law can break further bonds.
    pub wears_out: bool,
    /// Return the error message for a horizon that is not allowed. The field is `None` if every horizon is
    /// allowed.
    pub horizon_fault: Option<fn(&Given) -> Option<String>>,
    /// Create the law from the constants of one body.
    pub build: fn(&Given) -> Built,
    /// Examples for the tests. Each example lists the keys that a test deck gives for the law, except density
    /// and Young's modulus.
    pub examples: &'static [&'static str],
}

impl Declaration {
    /// Create a declaration with default properties. The law has no keys, exists in every dimension and has
    /// the Poisson ratio of bond-based laws. Its forces act along Y and derive from an energy. Its bonds
    /// never break.
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
            wears_out: false,
            horizon_fault: None,
            build,
            examples: &[""],
        }
    }

    /// Test whether the law has its own critical stretch, so that its bodies have no damage law.
    pub fn breaks_by_itself(&self) -> bool {
        self.own_critical_stretch.is_some()
    }

    /// Test whether the law with the defaults of all its keys exists in this dimension.
    pub fn is_for(&self, dimension: Dimension) -> bool {
        self.no_line.is_none() || !matches!(dimension, Dimension::Line { .. })
    }

    /// Return the key with this name; `None` if the law has no such key.
    pub fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys.iter().find(|key| key.name == name)
    }
}

impl fmt::Debug for Declaration {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name)
    }
}

/// Invariants of a law. A field is true if its statement holds for all motions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Invariants {
    /// Forces are the gradient of the strain energy. This holds neither for laws that dissipate energy nor
    /// for `stress = "willberg2022"`.
    pub conservative: bool,
    /// If a motion is rotated, the forces rotate with the motion. This is false for
    /// [linear](Declaration::linear) laws, whose forces keep the direction of ξ.
    pub objective: bool,
    /// The internal forces of a body have no resultant moment.
    pub angular_momentum: bool,
}

impl Invariants {
    /// All invariants hold.
    pub const ALL: Self = Self {
        conservative: true,
        objective: true,
        angular_momentum: true,
    };
}

/// An error in the values of a law's keys.
#[derive(Debug, Clone)]
pub struct LawFault {
    /// The wrong key; `None` if the error is not in a single key, for example if a key is missing.
    pub key: Option<&'static str>,
    /// Message: what is wrong, and what is allowed.
    pub message: String,
}

/// A law with one or several names in decks.
pub trait Declared {
    /// One declaration per name.
    const DECLARATIONS: &'static [Declaration];
}

/// A key of a law's table in decks.
#[derive(Debug)]
pub struct Key {
    /// Name of the key.
    pub name: &'static str,
    /// Meaning of the key's value, with unit.
    pub meaning: &'static str,
    /// Type of the value, with its allowed range and its default.
    pub kind: Kind,
}

/// The allowed values of a key.
#[derive(Debug)]
pub enum Kind {
    /// A number.
    Number {
        /// The allowed range.
        range: Range<f64>,
        /// The range in words; error messages write these words after "must be".
        words: &'static str,
        /// Default; `None` if the key is required.
        default: Option<f64>,
    },
    /// A number that may be missing and has no default.
    Optional {
        /// The allowed range.
        range: Range<f64>,
        /// The range in words; error messages write these words after "must be".
        words: &'static str,
    },
    /// One of these words; the default is the first word.
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
    /// Message for a 1-D deck with this word: why the word is not available in 1-D, and the alternative.
    /// `None` if the word is available in 1-D.
    pub no_line: Option<&'static str>,
}

impl Word {
    /// Return a word that every dimension supports.
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
    /// Evaluate the function at a length (m).
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

/// Values of the law's own keys, in the order of their declaration.
#[derive(Debug, Clone)]
pub struct Values(Vec<(&'static str, Option<Value>)>);

impl Values {
    /// Return the defaults of these keys.
    pub fn defaults(keys: &[Key]) -> Self {
        let default = |key: &Key| match &key.kind {
            Kind::Number { default, .. } => default.map(Value::Number),
            Kind::Word(words) => words.first().map(|first| first.word.into()),
            Kind::Optional { .. } | Kind::OfLength => None,
        };
        Self(keys.iter().map(|key| (key.name, default(key))).collect())
    }

    /// Set the value of a key. A key that the law does not have is ignored.
    pub fn set(&mut self, key: &str, value: Value) {
        if let Some((_, old)) = self.0.iter_mut().find(|(name, _)| *name == key) {
            *old = Some(value);
        }
    }

    /// Return the value of a key, if it has one.
    pub fn get(&self, key: &str) -> Option<&Value> {
        let (_, value) = self.0.iter().find(|(name, _)| *name == key)?;
        value.as_ref()
    }

    /// Return the number of a key.
    ///
    /// # Panics
    /// If the key is not declared as a number, or has no value.
    pub fn number(&self, key: &str) -> f64 {
        match self.get(key) {
            Some(Value::Number(number)) => *number,
            other => panic!("`{key}` is no number: {other:?}"),
        }
    }

    /// Return the value of a key whose value is a word.
    ///
    /// # Panics
    /// If the value of the key is not a word, or the key has no value.
    pub fn word(&self, key: &str) -> &str {
        match self.get(key) {
            Some(Value::Word(word)) => word,
            other => panic!("`{key}` is no word: {other:?}"),
        }
    }

    /// Return the function that the deck gives for a key; `None` if the deck gives no function.
    pub fn of_length(&self, key: &str) -> Option<&Arc<dyn OfLength>> {
        match self.get(key) {
            Some(Value::OfLength(function)) => Some(function),
            _ => None,
        }
    }
}

/// Input for the creation of a law: the constants of one body.
pub struct Given<'a> {
    /// Dimension of the problem.
    pub dimension: Dimension,
    /// Isotropic elastic constants of the body.
    pub elastic: Isotropic,
    /// Horizon δ, m.
    pub horizon: f64,
    /// Values of the law's own keys; all required keys have a value.
    pub values: &'a Values,
    /// Whether the critical stretch follows from a fracture energy; the law may then scale the critical
    /// stretch by a factor per bond. Otherwise, the deck gives a critical stretch that holds for all bonds,
    /// or the bonds have no damage.
    pub from_fracture_energy: bool,
}

/// Return the critical stretch of `pmb` for a fracture energy (J/m²).
pub fn bond_based_critical_stretch(given: &Given, energy: f64) -> f64 {
    CriticalStretch::from_energy(given.dimension, given.elastic, energy, given.horizon)
}

/// A law and its influence function.
pub struct Built {
    /// The law that the loops over bonds call.
    pub law: AnyLaw,
    /// Influence function of the bond's length (m). The contribution of a bond to any sum of a point is
    /// multiplied by this function. `None` if the function is 1 for all bonds.
    pub influence: Option<Box<dyn Fn(f64) -> f64 + Sync>>,
}

impl Built {
    /// Return a law without influence function.
    pub fn plain(law: impl Into<AnyLaw>) -> Self {
        Self {
            law: law.into(),
            influence: None,
        }
    }

    /// Return a law with an influence function of the bond's length (m).
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
