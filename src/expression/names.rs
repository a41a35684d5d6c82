//! Lookup of the names in an expression: functions, variables, constants, parameters and tables.

use std::sync::Arc;

use super::evaluate::{Binary, Instruction, Ternary, Unary};
use super::{Table, Variable};

/// Largest number of known names in an error message.
const MOST_NAMES_LISTED: usize = 16;

/// A function, stored as the operation that evaluates it. The variant gives the number of arguments.
#[derive(Debug, Clone, Copy)]
pub(super) enum Function {
    /// One argument.
    Unary(Unary),
    /// Two arguments.
    Binary(Binary),
    /// Three arguments.
    Ternary(Ternary),
    /// Two or more arguments. The operation is applied to the first two arguments, then to this result and
    /// the third argument, and so on.
    Several(Binary),
}

const FUNCTIONS: &[(&str, Function)] = &[
    ("sin", Function::Unary(Unary::Sine)),
    ("cos", Function::Unary(Unary::Cosine)),
    ("tan", Function::Unary(Unary::Tangent)),
    ("asin", Function::Unary(Unary::ArcSine)),
    ("acos", Function::Unary(Unary::ArcCosine)),
    ("atan", Function::Unary(Unary::ArcTangent)),
    ("atan2", Function::Binary(Binary::ArcTangent)),
    ("sinh", Function::Unary(Unary::HyperbolicSine)),
    ("cosh", Function::Unary(Unary::HyperbolicCosine)),
    ("tanh", Function::Unary(Unary::HyperbolicTangent)),
    ("exp", Function::Unary(Unary::Exponential)),
    ("log", Function::Unary(Unary::Logarithm)),
    ("log10", Function::Unary(Unary::DecimalLogarithm)),
    ("sqrt", Function::Unary(Unary::SquareRoot)),
    ("abs", Function::Unary(Unary::Absolute)),
    ("floor", Function::Unary(Unary::Floor)),
    ("ceil", Function::Unary(Unary::Ceiling)),
    ("sign", Function::Unary(Unary::Sign)),
    ("min", Function::Several(Binary::Minimum)),
    ("max", Function::Several(Binary::Maximum)),
    ("hypot", Function::Binary(Binary::Hypotenuse)),
    ("if", Function::Ternary(Ternary::Choose)),
    ("step", Function::Unary(Unary::Step)),
    ("ramp", Function::Ternary(Ternary::Ramp)),
    ("clamp", Function::Ternary(Ternary::Clamp)),
];

/// Name of the constant π.
pub(super) const PI: &str = "pi";

/// Meaning of the names in an expression.
pub(super) struct Scope<'a> {
    /// Returns the value of a named parameter.
    pub(super) parameters: &'a dyn Fn(&str) -> Option<f64>,
    /// Names that error messages suggest.
    pub(super) known_names: &'a [&'a str],
    /// Allowed variables.
    pub(super) variables: &'a [Variable],
    /// Tables by name.
    pub(super) tables: &'a [(&'a str, &'a Arc<Table>)],
}

pub(super) fn is_function(name: &str) -> bool {
    FUNCTIONS.iter().any(|(known, _)| *known == name)
}

impl Scope<'_> {
    /// Find the function of this name, or return an error message.
    pub(super) fn function(&self, name: &str) -> Result<Function, String> {
        if let Some((_, function)) = FUNCTIONS.iter().find(|(known, _)| *known == name) {
            return Ok(*function);
        }
        let is_value = name == PI
            || Variable::from_name(name).is_some()
            || (self.parameters)(name).is_some()
            || self.table(name).is_some();
        let message = if is_value {
            format!("`{name}` is not a function; to multiply, write `{name} * (…)`")
        } else {
            let names: Vec<&str> = FUNCTIONS.iter().map(|(known, _)| *known).collect();
            let suggestion = suggestion(name, &names);
            format!(
                "unknown function `{name}`{suggestion} functions are: {}",
                names.join(", ")
            )
        };
        Err(message)
    }

    fn table(&self, name: &str) -> Option<usize> {
        self.tables.iter().position(|(known, _)| *known == name)
    }

    /// Return the instruction that pushes the value of this name, or an error message.
    pub(super) fn value(&self, name: &str) -> Result<Instruction, String> {
        // `r`, the length of a bond, is a variable only in keys that are functions of this length. Elsewhere,
        // parameters often have the name `r`.
        let reserved =
            |variable: &Variable| *variable != Variable::R || self.variables.contains(variable);
        if let Some(variable) = Variable::from_name(name).filter(reserved) {
            return if self.variables.contains(&variable) {
                Ok(Instruction::Variable(variable))
            } else {
                Err(self.not_allowed(name))
            };
        }
        if name == PI {
            return Ok(Instruction::Constant(std::f64::consts::PI));
        }
        if let Some(value) = (self.parameters)(name) {
            return Ok(Instruction::Constant(value));
        }
        if let Some(number) = self.table(name) {
            return if self.variables.contains(&Variable::T) {
                Ok(Instruction::Table(number))
            } else {
                Err(format!(
                    "`{name}` cannot be used here: the values of a table depend on time, and this expression may not use `t`"
                ))
            };
        }
        Err(if is_function(name) {
            format!("`{name}` is a function: write `{name}(…)`")
        } else if self.known_names.contains(&name) {
            format!("`{name}` has no value that could be used here")
        } else if name == "e" {
            "unknown name `e`; for Euler's number, write `exp(1)`".to_owned()
        } else {
            self.unknown(name)
        })
    }

    /// Return the error message for a variable that is not allowed.
    fn not_allowed(&self, name: &str) -> String {
        let allowed: Vec<&str> = self
            .variables
            .iter()
            .map(|variable| variable.name())
            .collect();
        if allowed.is_empty() {
            return format!("`{name}` cannot be used here: this expression must be constant");
        }
        format!(
            "`{name}` cannot be used here: of the variables, this expression may use only {}",
            allowed.join(", ")
        )
    }

    /// Return the error message for an unknown name.
    fn unknown(&self, name: &str) -> String {
        let variables = self.variables.iter().map(|variable| variable.name());
        let names: Vec<&str> = variables
            .chain(self.known_names.iter().copied())
            .chain([PI])
            .collect();
        let listed = names.len().min(MOST_NAMES_LISTED);
        let more = if listed < names.len() { ", …" } else { "" };
        format!(
            "unknown name `{name}`{} known here: {}{more}",
            suggestion(name, &names),
            names[..listed].join(", "),
        )
    }
}

/// Return the part of an error message after the unknown name: `; did you mean …?` with the most similar
/// name, or `;` if no name is similar.
fn suggestion(name: &str, names: &[&str]) -> String {
    let lower = name.to_lowercase();
    let tolerance = match lower.len() {
        // Any two single letters differ by one edit, so only the other case of a single letter is suggested.
        1 => 0,
        length => (length / 3).clamp(1, 3),
    };
    let nearest = names
        .iter()
        // This condition also keeps very long names out of the quadratic comparison.
        .filter(|known| known.len().abs_diff(name.len()) <= tolerance)
        .map(|known| {
            (
                strsim::damerau_levenshtein(&lower, &known.to_lowercase()),
                known,
            )
        })
        .filter(|(distance, _)| *distance <= tolerance)
        .min_by_key(|(distance, _)| *distance);
    match nearest {
        Some((_, known)) => format!("; did you mean `{known}`?"),
        None => ";".to_owned(),
    }
}
