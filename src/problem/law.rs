//! The law of a material, with the values of its keys.

use super::{BreakableBonds, Damage, DamageRule};
use crate::dimension::Dimension;
use crate::error::{Error, Result};
use crate::expression::Expression;
use crate::material::{Declaration, Key, Kind, LawFault, OfLength, Value, Values, declarations};
use crate::message::format_number;
use crate::message::suggestion;

/// A law with the values of its keys.
#[derive(Debug, Clone)]
pub struct Law {
    /// Declaration of the law.
    pub declaration: &'static Declaration,
    /// Values of the keys that this law declares.
    pub values: Values,
}

impl Law {
    /// Create the law with this name and the defaults of its keys.
    ///
    /// # Errors
    /// If no law has this name.
    pub fn named(name: &str) -> Result<Self> {
        find(name).map(Self::of).map_err(Error::input)
    }

    /// Create the law of a declaration, with the defaults of its keys.
    pub fn of(declaration: &'static Declaration) -> Self {
        Self {
            declaration,
            values: Values::defaults(declaration.keys),
        }
    }

    /// Set a key of the law to a number, a word, or an [expression](Expression::of_length) of a bond's
    /// length.
    ///
    /// # Errors
    /// If the law has no such key, or the key does not allow this value.
    pub fn with(mut self, key: &str, value: impl Into<Value>) -> Result<Self> {
        let (name, value) = (self.declaration.name, value.into());
        let Some(declared) = self.declaration.key(key) else {
            let known = self.declaration.keys.iter().map(|key| key.name);
            return Err(Error::input(format!(
                "law `{name}`: unknown key `{key}`{}",
                suggestion(key, known)
            )));
        };
        let value = match (&declared.kind, value) {
            (Kind::OfLength, Value::Number(same)) => Expression::constant(same).into(),
            (_, value) => value,
        };
        check(declared, &value)
            .map_err(|message| Error::input(format!("law `{name}`, {key}: {message}")))?;
        self.values.set(declared.name, value);
        Ok(self)
    }

    /// Return the first fault of the law: a missing key, an invalid combination of values, or a dimension
    /// that the law does not support. `None` if there is no fault.
    pub fn fault(&self, dimension: Dimension) -> Option<LawFault> {
        for key in self.declaration.keys {
            let required = matches!(key.kind, Kind::Number { .. });
            if required && self.values.get(key.name).is_none() {
                return Some(LawFault {
                    key: None,
                    message: format!("needs `{}`: {}", key.name, key.meaning),
                });
            }
        }
        if matches!(dimension, Dimension::Line { .. })
            && let Some(fault) = self.fault_of_a_line()
        {
            return Some(fault);
        }
        let fault = self.declaration.fault?;
        fault(&self.values, dimension)
    }

    /// Return the fault of the law in 1-D; `None` if there is no fault. There is a fault if the law has no
    /// 1-D form. There is also a fault if the value of a key is a word that is not available in 1-D.
    fn fault_of_a_line(&self) -> Option<LawFault> {
        let word = |key: &'static Key| match (&key.kind, self.values.get(key.name)) {
            (Kind::Word(words), Some(Value::Word(given))) => {
                let word = words.iter().find(|word| word.word == given)?;
                Some((Some(key.name), word.no_line?))
            }
            _ => None,
        };
        let whole = self.declaration.no_line.map(|why| (None, why));
        let (key, why) = whole.or_else(|| self.declaration.keys.iter().find_map(word))?;
        Some(LawFault {
            key,
            message: why.to_owned(),
        })
    }

    /// Return the reason why a body with this law cannot have the damage law `damage`; `None` if it can.
    pub fn damage_fault(&self, damage: &Damage) -> Option<String> {
        if self.declaration.breaks_by_itself() {
            return Some(format!(
                "bonds of `{}` break by their own law; remove `damage`",
                self.declaration.name
            ));
        }
        let (can, way): (fn(&Declaration) -> bool, _) = match damage.rule {
            DamageRule::CriticalStretch => (
                |law| law.critical_stretch.is_some(),
                "by a critical stretch",
            ),
            DamageRule::Energy { work, .. } => {
                let wanted = [
                    (
                        work.breakable == BreakableBonds::Any,
                        "tension_only = false",
                    ),
                    (work.family_correction > 0.0, "family_correction"),
                ];
                let wanted = wanted.into_iter().find_map(|(is, key)| is.then_some(key));
                if let Some(key) = wanted.filter(|_| !self.declaration.any_poisson_ratio) {
                    return Some(format!(
                        "bonds of `{}` break by the critical stretch that corresponds to the fracture energy; `{key}` is \
                         only for laws that are not bond-based",
                        self.declaration.name
                    ));
                }
                (|law| law.breaks_by_energy, "by energy")
            }
            DamageRule::Stress(_) => (|law| law.breaks_by_stress, "by stress"),
        };
        if can(self.declaration) {
            return None;
        }
        let others = declarations().filter(|law| can(law));
        Some(format!(
            "`{}` cannot break {way}; take {}",
            self.declaration.name,
            names(others, "or"),
        ))
    }

    /// Return the name of the key whose value is an expression of the bond's length; `None` if no key has
    /// such a value.
    pub fn key_of_length(&self) -> Option<&'static str> {
        let mut names = self.declaration.keys.iter().map(|key| key.name);
        names.find(|name| self.values.of_length(name).is_some())
    }
}

/// Return the declaration of the law with this name, or an error that lists the known laws.
pub fn find(name: &str) -> std::result::Result<&'static Declaration, String> {
    let mut all = declarations();
    all.find(|law| law.name == name)
        .ok_or_else(|| unknown(name, declarations().map(|law| law.name)))
}

/// Check a value of a key. The error says which values are allowed.
pub fn check(key: &Key, value: &Value) -> std::result::Result<(), String> {
    match (&key.kind, value) {
        (
            Kind::Number { range, words, .. } | Kind::Optional { range, words },
            Value::Number(number),
        ) => {
            let fits = range.contains(number);
            let error = || format!("must be {words}, is {}", format_number(*number));
            if fits { Ok(()) } else { Err(error()) }
        }
        (Kind::Word(words), Value::Word(given)) => {
            let known = words.iter().map(|word| word.word);
            let fits = known.clone().any(|word| word == given);
            let error = || unknown(given, known);
            if fits { Ok(()) } else { Err(error()) }
        }
        (Kind::OfLength, Value::OfLength(_)) => Ok(()),
        (_, Value::Number(number)) => Err(format!(
            "must be {}, is {}",
            wanted(key),
            format_number(*number)
        )),
        _ => Err(format!("must be {}", wanted(key))),
    }
}

/// Return the description of the values that a key allows, for error messages.
pub fn wanted(key: &Key) -> String {
    match &key.kind {
        Kind::Number { .. } | Kind::Optional { .. } | Kind::OfLength => {
            "a number or an expression in quotes".to_owned()
        }
        Kind::Word(words) => {
            let words = words.iter().map(|word| format!("\"{}\"", word.word));
            listed(words, "or")
        }
    }
}

fn unknown<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    format!("unknown name `{name}`{}", suggestion(name, known))
}

/// Format names of laws in backticks, such as `a`, `b` and `c`. The argument `and` is the word before the
/// last name, such as "or".
pub fn names(laws: impl IntoIterator<Item = &'static Declaration>, and: &str) -> String {
    listed(laws.into_iter().map(|law| format!("`{}`", law.name)), and)
}

/// Join the items to a list such as `a, b and c`. The argument `and` is the word before the last item, such
/// as "or".
fn listed(items: impl IntoIterator<Item = String>, and: &str) -> String {
    let items: Vec<String> = items.into_iter().collect();
    match items.split_last() {
        Some((last, others)) if !others.is_empty() => {
            format!("{} {and} {last}", others.join(", "))
        }
        _ => items.concat(),
    }
}

impl OfLength for Expression {
    fn at(&self, length: f64) -> f64 {
        self.evaluate([length, 0.0, 0.0], 0.0)
    }
}

impl From<Expression> for Value {
    fn from(expression: Expression) -> Self {
        Self::OfLength(std::sync::Arc::new(expression))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::Constraint;

    #[test]
    fn a_law_takes_its_own_keys_only() {
        let error = |law: Result<Law>| law.map(|_| ()).unwrap_err().message;
        let law = |name| Law::named(name).unwrap();
        assert!(error(Law::named("bmp")).starts_with("unknown name `bmp`"));
        assert_eq!(
            error(law("elastic_plastic_pmb").with("yield_strech", 0.1)),
            "law `elastic_plastic_pmb`: unknown key `yield_strech`; did you mean `yield_stretch`? \
             (known: yield_stretch)"
        );
        assert_eq!(
            error(law("elastic_plastic_pmb").with("yield_stretch", -0.1)),
            "law `elastic_plastic_pmb`, yield_stretch: must be above 0, is -0.1"
        );
        assert_eq!(
            error(law("pmb").with("surface_correction", 0.1)),
            "law `pmb`, surface_correction: must be \"none\", \"energy\", \"directional\" or \"tensor\", is 0.1"
        );
        assert_eq!(
            error(law("normalised_pmb").with("form", "energi")),
            "law `normalised_pmb`, form: unknown name `energi`; did you mean `energy`? (known: \
             energy, diehl2016)"
        );
    }

    #[test]
    fn a_law_is_at_fault_without_its_keys_and_in_a_dimension_that_it_has_not() {
        let line = Dimension::Line {
            cross_section: 1.0,
            constraint: Constraint::UniaxialStress,
        };
        let space = Dimension::Space;
        let law = Law::named("elastic_plastic_pmb").unwrap();
        assert!(law.fault(space).is_some());
        let law = law.with("yield_stretch", 0.1).unwrap();
        assert!(law.fault(space).is_none() && law.fault(line).is_none());
        let law = Law::named("normalised_pmb").unwrap();
        let law = law.with("form", "diehl2016").unwrap();
        assert!(law.fault(space).is_none());
        assert_eq!(law.fault(line).unwrap().key, Some("form"));
        assert!(Law::named("ordinary").unwrap().fault(line).is_some());
    }
}
