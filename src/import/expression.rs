//! Translation of expressions of other codes into Fissure's grammar.
//!
//! Peridigm uses statements of C, such as `if(t<=1){value=2*t;} else{value=2;}`. PeriLab uses Julia,
//! including `if` on one line, such as `if t>2 0 else 20 end`. LAMMPS uses the formulas of its `variable`
//! commands.

use crate::expression::{Expression, Variable, number_length};

/// Maximum nesting depth of parentheses and blocks.
pub(super) const DEEPEST: usize = 48;

/// Maximum length of a translated expression, bytes.
pub(super) const LONGEST: usize = 4096;

/// Source language of an expression.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dialect {
    /// C: a formula, or statements that set `value`.
    Peridigm,
    /// Julia.
    PeriLab,
    /// A formula of a LAMMPS variable.
    Lammps,
}

/// Translation of names in an expression; `None` keeps the name.
pub type Names<'a> = &'a dyn Fn(&str) -> Option<String>;

/// Translate an expression.
///
/// # Errors
/// If the text cannot be translated, is too long, or the result is not an expression of `variables` or is a
/// constant that is not finite. `Err` holds a message.
pub fn rewrite(
    text: &str,
    dialect: Dialect,
    names: Names,
    variables: &[Variable],
) -> Result<String, String> {
    if text.len() > LONGEST {
        return Err("the expression is too long".to_owned());
    }
    let rewriter = Rewriter { dialect, names };
    let tokens = tokens(text, dialect)?;
    let result = match dialect {
        Dialect::Peridigm if has_statements(&tokens) => rewriter.statements(&tokens)?,
        Dialect::PeriLab => rewriter.choice(&tokens, 0)?,
        _ => rewriter.formula(&tokens, 0)?,
    };
    if result.len() > LONGEST {
        return Err("the expression is too long".to_owned());
    }
    match Expression::parse(&result, &|_| None, &[], variables) {
        Ok(expression) => Ok(match expression.as_constant() {
            Some(value) if !value.is_finite() => return Err(format!("`{result}` is not finite")),
            // A plain number keeps its notation. Any other constant expression is replaced by its value.
            Some(value) if result.parse::<f64>().is_err() => format!("{value:?}"),
            _ => result,
        }),
        Err(error) => Err(format!("`{result}`: {error}")),
    }
}

/// A token of an expression.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Token {
    Number(String),
    Name(String),
    Symbol(&'static str),
}

impl Token {
    /// Return the text of the token.
    pub(super) fn text(&self) -> &str {
        match self {
            Self::Number(text) | Self::Name(text) => text,
            Self::Symbol(symbol) => symbol,
        }
    }
}

/// The symbols. A symbol comes before its own prefixes, so the longest match is found first.
const SYMBOLS: [&str; 29] = [
    "<=", ">=", "==", "!=", "&&", "||", "|^", "**", "+", "-", "*", "/", "%", "^", "(", ")", ",",
    "<", ">", "!", "=", ";", "{", "}", "?", ":", "&", "|", "≤",
];

fn tokens(text: &str, dialect: Dialect) -> Result<Vec<Token>, String> {
    let mut tokens = Vec::new();
    let mut rest = text.trim_start();
    while let Some(first) = rest.chars().next() {
        let number = number_length(rest.as_bytes());
        let length = if number > 0 {
            tokens.push(Token::Number(rest[..number].to_owned()));
            number
        } else if first.is_alphabetic() || first == '_' {
            let is_part = |c: char| c.is_alphanumeric() || c == '_';
            let length = rest.find(|c| !is_part(c)).unwrap_or(rest.len());
            tokens.push(Token::Name(rest[..length].to_owned()));
            length
        } else if let Some(symbol) = SYMBOLS.iter().find(|symbol| rest.starts_with(**symbol)) {
            tokens.push(Token::Symbol(symbol));
            symbol.len()
        } else if first == '\\' || (first == '.' && dialect == Dialect::PeriLab) {
            // Skip: parameter lists escape braces with a backslash, and Julia marks operations on arrays with
            // dots.
            1
        } else {
            return Err(format!("unexpected character `{}`", first.escape_debug()));
        };
        rest = rest[length..].trim_start();
    }
    Ok(tokens)
}

pub(super) fn is_symbol(token: &Token, symbol: &str) -> bool {
    matches!(token, Token::Symbol(text) if *text == symbol)
}

fn is_name(token: &Token, name: &str) -> bool {
    matches!(token, Token::Name(text) if text == name)
}

/// Test whether an expression of Peridigm contains statements that set `value`.
fn has_statements(tokens: &[Token]) -> bool {
    tokens.iter().any(|token| is_name(token, "value"))
}

/// Return the index of the closing bracket that belongs to the opening bracket `{` or `(` at `start`.
pub(super) fn closing(tokens: &[Token], start: usize) -> Result<usize, String> {
    let (open, close) = match &tokens[start] {
        Token::Symbol("{") => ("{", "}"),
        _ => ("(", ")"),
    };
    let mut depth = 0_usize;
    for (index, token) in tokens.iter().enumerate().skip(start) {
        if is_symbol(token, open) {
            depth += 1;
        } else if is_symbol(token, close) {
            depth -= 1;
            if depth == 0 {
                return Ok(index);
            }
        }
    }
    Err(format!("`{open}` is not closed"))
}

/// Return the index of the `else` or `elseif` that ends the first branch of a Julia `if`. `tokens` are those
/// between this `if` and its `end`. Return `None` without `else`.
fn branch_end(tokens: &[Token]) -> Option<usize> {
    let mut level = 0_i64;
    tokens.iter().position(|token| {
        match token {
            Token::Name(name) if name == "if" => level += 1,
            Token::Name(name) if name == "end" => level -= 1,
            _ => {}
        }
        level == 0 && (is_name(token, "else") || is_name(token, "elseif"))
    })
}

/// Return the index of the `:` that belongs to the `?` before these tokens.
fn colon(tokens: &[Token]) -> Option<usize> {
    let mut level = 0_i64;
    tokens.iter().position(|token| {
        match token {
            Token::Symbol("?") => level += 1,
            Token::Symbol(":") => level -= 1,
            _ => {}
        }
        level < 0
    })
}

/// Return the translation of a function; `$1`, `$2`, `$3` are placeholders for its arguments.
fn template(dialect: Dialect, name: &str, arguments: usize) -> Option<&'static str> {
    Some(match (dialect, name, arguments) {
        (_, "pow", 2) => "(($1)^($2))",
        (Dialect::Peridigm, "fabs", 1) => "abs($1)",
        (Dialect::PeriLab, "ifelse", 3) => "if($1, $2, $3)",
        (Dialect::PeriLab, "atan", 2) => "atan2($1, $2)",
        (Dialect::Lammps, "ln", 1) => "log($1)",
        (Dialect::Lammps, "log", 1) => "log10($1)",
        (Dialect::Lammps, "ternary", 3) => "if($1, $2, $3)",
        (Dialect::Lammps, "vdisplace", 2) => "($1 + ($2)*t)",
        (Dialect::Lammps, "swiggle", 3) => "($1 + ($2)*sin(2*pi*t/($3)))",
        (Dialect::Lammps, "cwiggle", 3) => "($1 + ($2)*(1 - cos(2*pi*t/($3))))",
        _ => return None,
    })
}

/// Translator of the tokens of one expression.
pub(super) struct Rewriter<'a> {
    dialect: Dialect,
    pub(super) names: Names<'a>,
}

impl Rewriter<'_> {
    /// Translate all statements. Return the expression that they assign to the name `value`.
    fn statements(&self, tokens: &[Token]) -> Result<String, String> {
        let (value, end) = self.block(tokens, 0, None, 0)?;
        if end < tokens.len() {
            return Err("a `}` is not opened".to_owned());
        }
        value.ok_or_else(|| "`value` is not set".to_owned())
    }

    /// Translate the statements from index `at` to the first unmatched `}` or to the end of `tokens`. In the
    /// source deck, these statements assign expressions to a variable with the name `value`. The parameter
    /// `value` is the expression that earlier statements have assigned to this variable. Return the
    /// expression that is assigned to this variable after the last statement, and the index after this
    /// statement.
    fn block(
        &self,
        tokens: &[Token],
        mut at: usize,
        mut value: Option<String>,
        depth: usize,
    ) -> Result<(Option<String>, usize), String> {
        while at < tokens.len() && !is_symbol(&tokens[at], "}") {
            if is_symbol(&tokens[at], ";") {
                at += 1;
                continue;
            }
            (value, at) = self.statement(tokens, at, value, depth)?;
            if value.as_ref().is_some_and(|value| value.len() > LONGEST) {
                return Err("the expression is too long".to_owned());
            }
        }
        Ok((value, at))
    }

    /// Translate the statement that starts at index `at` of `tokens`. Parameters and result are those of
    /// [`block`](Self::block).
    fn statement(
        &self,
        tokens: &[Token],
        at: usize,
        value: Option<String>,
        depth: usize,
    ) -> Result<(Option<String>, usize), String> {
        if depth > DEEPEST {
            return Err("the statements are too deep".to_owned());
        }
        if is_name(&tokens[at], "if") {
            if !tokens
                .get(at + 1)
                .is_some_and(|token| is_symbol(token, "("))
            {
                return Err("`if` needs a condition in parentheses".to_owned());
            }
            let end = closing(tokens, at + 1)?;
            let condition = self.with_value(&tokens[at + 2..end], value.as_deref(), depth)?;
            let (then, next) = self.body(tokens, end + 1, value.clone(), depth + 1)?;
            let has_else = tokens.get(next).is_some_and(|token| is_name(token, "else"));
            let (otherwise, next) = if has_else {
                self.body(tokens, next + 1, value, depth + 1)?
            } else {
                (value, next)
            };
            let or_zero = |value: Option<String>| value.unwrap_or_else(|| "0".to_owned());
            let chosen = format!("if({condition}, {}, {})", or_zero(then), or_zero(otherwise));
            return Ok((Some(chosen), next));
        }
        let assigns = is_name(&tokens[at], "value")
            && tokens
                .get(at + 1)
                .is_some_and(|token| is_symbol(token, "="));
        if !assigns {
            return Err("a statement must be `value = …;` or `if(…) …`".to_owned());
        }
        let ends = |token: &Token| is_symbol(token, ";") || is_symbol(token, "}");
        let length = tokens[at + 2..].iter().position(ends);
        let end = length.map_or(tokens.len(), |length| at + 2 + length);
        let set = self.with_value(&tokens[at + 2..end], value.as_deref(), depth)?;
        Ok((Some(set), end))
    }

    /// Translate a block in braces or one statement. Parameters and result are those of
    /// [`block`](Self::block).
    fn body(
        &self,
        tokens: &[Token],
        at: usize,
        value: Option<String>,
        depth: usize,
    ) -> Result<(Option<String>, usize), String> {
        let Some(first) = tokens.get(at) else {
            return Err("a statement is missing at the end".to_owned());
        };
        if !is_symbol(first, "{") {
            let (value, at) = self.statement(tokens, at, value, depth)?;
            let ends = tokens.get(at).is_some_and(|token| is_symbol(token, ";"));
            return Ok((value, at + usize::from(ends)));
        }
        let (value, end) = self.block(tokens, at + 1, value, depth)?;
        if end < tokens.len() {
            Ok((value, end + 1))
        } else {
            Err("`{` is not closed".to_owned())
        }
    }

    /// Translate a formula. The name `value` in the formula is replaced by the parameter `value`, or by 0 if
    /// the parameter is `None`.
    fn with_value(
        &self,
        tokens: &[Token],
        value: Option<&str>,
        depth: usize,
    ) -> Result<String, String> {
        let names = |name: &str| match (name, value) {
            ("value", value) => Some(value.map_or("0".to_owned(), |value| format!("({value})"))),
            (name, _) => (self.names)(name),
        };
        let rewriter = Rewriter {
            dialect: self.dialect,
            names: &names,
        };
        rewriter.formula(tokens, depth)
    }

    /// Translate a Julia formula: `if a b else c end`, `if a b elseif c d else e end`, `a ? b : c`, or a
    /// formula without a choice.
    fn choice(&self, tokens: &[Token], depth: usize) -> Result<String, String> {
        if depth > DEEPEST {
            return Err("the expression is too deep".to_owned());
        }
        let is_choice = tokens.first().is_some_and(|token| is_name(token, "if"))
            && tokens.last().is_some_and(|token| is_name(token, "end"));
        if is_choice {
            let inner = &tokens[1..tokens.len() - 1];
            let middle = branch_end(inner).ok_or_else(|| "`if` without `else`".to_owned())?;
            let before = &inner[..middle];
            // `elseif c d else e end` is the same as `else if c d else e end end`.
            let nested;
            let otherwise = if is_name(&inner[middle], "elseif") {
                let mut words = vec![Token::Name("if".to_owned())];
                words.extend_from_slice(&tokens[middle + 2..]);
                nested = words;
                &nested[..]
            } else {
                &inner[middle + 1..]
            };
            let end = self.condition_end(before);
            let end = end.ok_or_else(|| "a value is missing after the condition".to_owned())?;
            return Ok(format!(
                "if({}, {}, {})",
                self.formula(&before[..end], depth + 1)?,
                self.choice(&before[end..], depth + 1)?,
                self.choice(otherwise, depth + 1)?
            ));
        }
        let mut level = 0_i64;
        for (index, token) in tokens.iter().enumerate() {
            match token {
                Token::Symbol("(") => level += 1,
                Token::Symbol(")") => level -= 1,
                Token::Symbol("?") if level == 0 => {
                    let rest = &tokens[index + 1..];
                    let colon = colon(rest).ok_or_else(|| "`?` without `:`".to_owned())?;
                    return Ok(format!(
                        "if({}, {}, {})",
                        self.formula(&tokens[..index], depth + 1)?,
                        self.choice(&rest[..colon], depth + 1)?,
                        self.choice(&rest[colon + 1..], depth + 1)?
                    ));
                }
                _ => {}
            }
        }
        self.formula(tokens, depth)
    }

    /// Find the end of the condition `a` in `if a b`: the first position between two operands that have no
    /// operator between them. Return `None` if there is no such position.
    fn condition_end(&self, tokens: &[Token]) -> Option<usize> {
        let mut level = 0_i64;
        for (index, pair) in tokens.windows(2).enumerate() {
            match &pair[0] {
                Token::Symbol("(") => level += 1,
                Token::Symbol(")") => level -= 1,
                _ => {}
            }
            let ends = !matches!(pair[0], Token::Symbol(symbol) if symbol != ")");
            let is_call = matches!(pair[0], Token::Name(_));
            let starts = match &pair[1] {
                Token::Symbol(symbol) => *symbol == "(" && !is_call,
                _ => true,
            };
            if level == 0 && ends && starts {
                return Some(index + 1);
            }
        }
        None
    }

    /// Translate a formula that contains no choice, neither `if … end` nor `a ? b : c`.
    fn formula(&self, tokens: &[Token], depth: usize) -> Result<String, String> {
        if depth > DEEPEST {
            return Err("the expression is too deep".to_owned());
        }
        if self.dialect == Dialect::Lammps {
            return self.left_to_right(tokens, depth);
        }
        let mut text = String::new();
        let mut at = 0;
        while at < tokens.len() {
            match &tokens[at] {
                Token::Number(number) => text.push_str(number),
                Token::Name(name) => {
                    if tokens
                        .get(at + 1)
                        .is_some_and(|token| is_symbol(token, "("))
                    {
                        let end = closing(tokens, at + 1)?;
                        text.push_str(&self.call(name, &tokens[at + 2..end], depth + 1)?);
                        at = end;
                    } else {
                        let name = (self.names)(name).unwrap_or_else(|| name.clone());
                        text.push_str(&name);
                    }
                }
                Token::Symbol(symbol) => text.push_str(match *symbol {
                    "**" => "^",
                    "&" | "&&" => " && ",
                    "|" | "||" => " || ",
                    "≤" | "<=" => " <= ",
                    ">=" => " >= ",
                    "==" => " == ",
                    "!=" => " != ",
                    "<" => " < ",
                    ">" => " > ",
                    symbol => symbol,
                }),
            }
            if text.len() > LONGEST {
                return Err("the expression is too long".to_owned());
            }
            at += 1;
        }
        Ok(text)
    }

    /// Translate a function call. A function without a template keeps its name.
    pub(super) fn call(
        &self,
        name: &str,
        tokens: &[Token],
        depth: usize,
    ) -> Result<String, String> {
        let mut arguments = vec![Vec::new()];
        let mut level = 0_i64;
        for token in tokens {
            match token {
                Token::Symbol("(") => level += 1,
                Token::Symbol(")") => level -= 1,
                Token::Symbol(",") if level == 0 => {
                    arguments.push(Vec::new());
                    continue;
                }
                _ => {}
            }
            arguments
                .last_mut()
                .expect("there is one")
                .push(token.clone());
        }
        let rewritten = arguments
            .iter()
            .map(|argument| self.formula(argument, depth));
        let arguments = rewritten.collect::<Result<Vec<_>, _>>()?;
        let Some(template) = template(self.dialect, name, arguments.len()) else {
            return Ok(format!("{name}({})", arguments.join(", ")));
        };
        let mut parts = template.split('$');
        let mut text = parts.next().unwrap_or("").to_owned();
        for part in parts {
            let index = part.as_bytes()[0] - b'1';
            text.push_str(&arguments[usize::from(index)]);
            text.push_str(&part[1..]);
        }
        Ok(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::expression::POSITION_AND_TIME;

    fn rewritten(text: &str, dialect: Dialect) -> Result<String, String> {
        rewrite(text, dialect, &|_| None, &POSITION_AND_TIME)
    }

    fn value(text: &str, dialect: Dialect) -> f64 {
        let text = rewritten(text, dialect).unwrap();
        Expression::of(&text)
            .unwrap()
            .evaluate([0.3, -2.0, 5.0], 1.5)
    }

    #[test]
    fn formulas_keep_their_values() {
        let (x, y, z, t): (f64, f64, f64, f64) = (0.3, -2.0, 5.0, 1.5);
        for (text, expected) in [
            ("0.0", 0.0),
            ("value = 3*t", 3.0 * t),
            (
                "(200 - 50*((z/0.05)-1)^2)*cos(atan2(y,x))",
                (200.0 - 50.0 * (z / 0.05 - 1.0) * (z / 0.05 - 1.0)) * libm::cos(libm::atan2(y, x)),
            ),
            ("pow(x, 2) + fabs(y)", x * x + 2.0),
            (
                "if(t<=1){value=-y*1.0e-6*t;} else{value=-y*1.0e-6*1;}",
                -y * 1e-6,
            ),
            (
                r" if(t <= 2.0)\{ value = 50.0; \} else\{ value = 0.015; \} ",
                50.0,
            ),
            ("value = x; if (t > 1) value = value + 1;", x + 1.0),
            (
                "if(t<1){value=1;} else if(t<2){value=2;} else {value=3;}",
                2.0,
            ),
        ] {
            assert_eq!(value(text, Dialect::Peridigm), expected, "{text}");
        }
        for (text, expected) in [
            ("-4.4*t", -4.4 * t),
            ("0.1 .* x .+ sin.(t)", 0.1 * x + libm::sin(t)),
            ("ifelse.(x .> y, 10, 20)", 10.0),
            ("if t>2 0 else 20 end", 20.0),
            ("if (t>1) (3) else 20 end", 3.0),
            ("if t<1 5 elseif t<2 6 else 7 end", 6.0),
            ("if t<1 5 elseif t<1.2 6 elseif t<1.6 7 else 8 end", 7.0),
            ("if t<1 5 else if t<2 6 else 7 end end", 6.0),
            ("if t>1 if t>2 5 else 6 end else 7 end", 6.0),
            ("t < 1 ? 5 : 6", 6.0),
            ("t < 1 ? 5 : t < 2 ? 6 : 7", 6.0),
            ("t > 1 ? t > 2 ? 5 : 6 : 7", 6.0),
            ("atan(y, x)", libm::atan2(y, x)),
            ("2.*t", 3.0),
            ("t > 1 & x < 1", 1.0),
        ] {
            assert_eq!(value(text, Dialect::PeriLab), expected, "{text}");
        }
        for (text, expected) in [
            ("ln(10) + log(100)", libm::log(10.0) + 2.0),
            ("vdisplace(1.0, -100)", 1.0 - 100.0 * t),
            // Values of LAMMPS itself.
            ("-2^2", 4.0),
            ("2^3^2", 64.0),
            ("2^-1", 0.5),
            ("-(2)^2", 4.0),
            ("--2", 2.0),
            ("2*-3", -6.0),
            ("8/4/2 - 3 - 1", -3.0),
            ("7%4*2", 6.0),
            ("2*7%4", 2.0),
            ("-7%4", -3.0),
            ("1<2==1", 1.0),
            ("1==1==0", 0.0),
            ("3>2>1", 0.0),
            ("!0==0", 0.0),
            ("!2^2", 0.0),
            ("1|^1", 0.0),
            ("0|^1||1", 1.0),
            ("1||0&&0", 1.0),
            ("ternary(1<2, 5, 6)", 5.0),
        ] {
            assert_eq!(value(text, Dialect::Lammps), expected, "{text}");
        }
    }

    #[test]
    fn a_wrong_expression_says_why() {
        for (text, message) in [
            ("0.01*q", "`0.01*q`: unknown name `q`"),
            ("if(t<1){value=1;", "`{` is not closed"),
            ("value", "a statement must be `value = …;` or `if(…) …`"),
            ("rand(1)", "`rand(1)`: unknown function `rand`"),
            ("2 $ 3", "unexpected character `$`"),
            ("sin(t", "`(` is not closed"),
            ("1e999", "`1e999`: the number `1e999` is too large"),
            ("1/0", "`1/0` is not finite"),
        ] {
            let error = rewritten(text, Dialect::Peridigm).unwrap_err();
            assert!(error.starts_with(message), "{text}: {error}");
        }
        assert!(rewritten(&"(".repeat(1000), Dialect::PeriLab).is_err());
        for text in ["sin(", "(", "-", "2^", "2*"] {
            assert!(
                rewritten(&text.repeat(1000), Dialect::Lammps).is_err(),
                "{text}"
            );
        }
        for (text, message) in [
            ("1 +", "a value is missing"),
            ("1 & 2", "unexpected `&`"),
            ("1 2", "unexpected `2`"),
            ("2**3", "unexpected `**`"),
        ] {
            assert_eq!(rewritten(text, Dialect::Lammps).unwrap_err(), message);
        }
    }
}
