//! Tokens of an expression's text.

use super::ExpressionError;
use super::evaluate::Binary;

/// Precedence of operators, from the loosest to the tightest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Precedence {
    /// `||`
    Or,
    /// `&&`
    And,
    /// `<` and other comparisons
    Comparison,
    /// `+` and `-`
    Sum,
    /// `*` and `/`
    Product,
    /// `-`, `+` and `!` before a value
    Prefix,
    /// `^`
    Power,
}

/// Kind of a token.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    /// A number.
    Number(f64),
    /// The name of a variable, parameter, table, constant or function.
    Name,
    /// An operator between two values; `+` and `-` may also be prefix operators.
    Operator(Binary, Precedence),
    /// `!` or `not`
    Not,
    /// `(`
    Open,
    /// `)`
    Close,
    /// `,`
    Comma,
    /// The end of the text.
    End,
}

/// A token and its byte range in the text.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Token {
    pub(super) kind: Kind,
    /// Index of the first byte.
    pub(super) start: usize,
    /// Index after the last byte.
    pub(super) end: usize,
}

impl Token {
    /// Create an error for this token.
    pub(super) fn error(self, message: impl Into<String>) -> ExpressionError {
        ExpressionError::new(self.start, self.end, message)
    }
}

/// All symbols, in the order of the search. A symbol comes before every shorter symbol with which it begins:
/// `<=` comes before `<`. Therefore the longest match is found first.
const SYMBOLS: &[(&str, Kind)] = &[
    (
        "<=",
        Kind::Operator(Binary::LessOrEqual, Precedence::Comparison),
    ),
    (
        ">=",
        Kind::Operator(Binary::GreaterOrEqual, Precedence::Comparison),
    ),
    ("==", Kind::Operator(Binary::Equal, Precedence::Comparison)),
    (
        "!=",
        Kind::Operator(Binary::NotEqual, Precedence::Comparison),
    ),
    ("&&", Kind::Operator(Binary::And, Precedence::And)),
    ("||", Kind::Operator(Binary::Or, Precedence::Or)),
    ("<", Kind::Operator(Binary::Less, Precedence::Comparison)),
    (">", Kind::Operator(Binary::Greater, Precedence::Comparison)),
    ("+", Kind::Operator(Binary::Add, Precedence::Sum)),
    ("-", Kind::Operator(Binary::Subtract, Precedence::Sum)),
    ("*", Kind::Operator(Binary::Multiply, Precedence::Product)),
    ("/", Kind::Operator(Binary::Divide, Precedence::Product)),
    ("^", Kind::Operator(Binary::Power, Precedence::Power)),
    ("!", Kind::Not),
    ("(", Kind::Open),
    (")", Kind::Close),
    (",", Kind::Comma),
];

/// Symbols of other languages, with the correction for the error message.
const FOREIGN_SYMBOLS: &[(&str, &str)] = &[
    ("**", "to raise to a power, write `^`"),
    ("=", "to compare, write `==`"),
    ("&", "for a logical and, write `&&`"),
    ("|", "for a logical or, write `||`"),
];

/// Split the text into tokens; the last token is always [`Kind::End`].
pub(super) fn tokenize(text: &str) -> Result<Vec<Token>, ExpressionError> {
    let mut tokens = Vec::new();
    let mut start = 0;
    while let Some(character) = text[start..].chars().next() {
        if character.is_whitespace() {
            start += character.len_utf8();
            continue;
        }
        let (kind, length) =
            first_token(&text[start..], character).map_err(|(length, message)| {
                ExpressionError {
                    start,
                    end: start + length,
                    message,
                }
            })?;
        tokens.push(Token {
            kind,
            start,
            end: start + length,
        });
        start += length;
    }
    tokens.push(Token {
        kind: Kind::End,
        start,
        end: start,
    });
    Ok(tokens)
}

/// Return kind and length (bytes) of the first token of the text, or the length of the wrong part and a
/// message. `character` is the first character of the text.
fn first_token(text: &str, character: char) -> Result<(Kind, usize), (usize, String)> {
    let number_length = number_length(text.as_bytes());
    if number_length > 0 {
        let number = &text[..number_length];
        return match number.parse::<f64>() {
            Ok(value) if value.is_finite() => Ok((Kind::Number(value), number_length)),
            _ => Err((number_length, format!("the number `{number}` is too large"))),
        };
    }
    if character.is_ascii_alphabetic() || character == '_' {
        let length = text
            .find(|next: char| !next.is_ascii_alphanumeric() && next != '_')
            .unwrap_or(text.len());
        let kind = match &text[..length] {
            "and" => Kind::Operator(Binary::And, Precedence::And),
            "or" => Kind::Operator(Binary::Or, Precedence::Or),
            "not" => Kind::Not,
            _ => Kind::Name,
        };
        return Ok((kind, length));
    }
    // The longer match wins: `**` is not two `*`, and `==` is not two `=`.
    let symbol = SYMBOLS.iter().find(|(symbol, _)| text.starts_with(symbol));
    let foreign = FOREIGN_SYMBOLS
        .iter()
        .find(|(symbol, _)| text.starts_with(symbol));
    match (symbol, foreign) {
        (Some((symbol, kind)), None) => Ok((*kind, symbol.len())),
        (Some((symbol, kind)), Some((other, _))) if symbol.len() >= other.len() => {
            Ok((*kind, symbol.len()))
        }
        (_, Some((other, advice))) => Err((
            other.len(),
            format!("`{other}` is not an operator: {advice}"),
        )),
        (None, None) => Err((
            character.len_utf8(),
            format!("unexpected character `{}`", character.escape_debug()),
        )),
    }
}

/// Return the length (bytes) of the number at the start of the text; 0 without a number.
pub fn number_length(text: &[u8]) -> usize {
    let digits = |from: usize| {
        text.get(from..)
            .unwrap_or_default()
            .iter()
            .take_while(|byte| byte.is_ascii_digit())
            .count()
    };
    let whole = digits(0);
    let mut length = whole;
    if text.get(length) == Some(&b'.') {
        let fraction = digits(length + 1);
        if whole + fraction == 0 {
            return 0;
        }
        length += 1 + fraction;
    }
    if length > 0 && matches!(text.get(length), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(text.get(length + 1), Some(b'+' | b'-')));
        let exponent = digits(length + 1 + sign);
        if exponent > 0 {
            length += 1 + sign + exponent;
        }
    }
    length
}
