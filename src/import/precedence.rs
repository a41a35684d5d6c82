//! Operators of LAMMPS formulas, translated into Fissure's grammar.
//!
//! LAMMPS evaluates operators of the same precedence from left to right, also in `2^3^2`. A sign binds
//! tighter than `^`: `-2^2` is 4. Fissure's grammar differs, so operands get parentheses where needed.

use super::expression::{DEEPEST, LONGEST, Rewriter, Token, closing, is_symbol};

/// Precedence of a number, a name, a call or an expression in parentheses.
const ATOM: u8 = 9;

/// Precedence of `-`, `+` and `!` before a value.
const PREFIX: u8 = 8;

const POWER: u8 = 7;

/// Precedences of the comparisons. `<` and similar operators bind tighter than `==` and `!=`.
const COMPARISONS: [u8; 2] = [3, 4];

/// A translated formula and the precedence of its outermost operator.
struct Operand {
    text: String,
    precedence: u8,
}

/// Return the precedence of an operator between two values; `None` if LAMMPS has no such operator.
fn precedence(symbol: &str) -> Option<u8> {
    Some(match symbol {
        "||" | "|^" => 1,
        "&&" => 2,
        "==" | "!=" => COMPARISONS[0],
        "<" | "<=" | ">" | ">=" => COMPARISONS[1],
        "+" | "-" => 5,
        "*" | "/" | "%" => 6,
        "^" => POWER,
        _ => return None,
    })
}

impl Rewriter<'_> {
    /// Translate a LAMMPS formula.
    pub(super) fn left_to_right(&self, tokens: &[Token], depth: usize) -> Result<String, String> {
        let mut at = 0;
        let operand = self.operation(tokens, &mut at, 0, depth)?;
        match tokens.get(at) {
            None => Ok(operand.text),
            Some(token) => Err(format!("unexpected `{}`", token.text())),
        }
    }

    /// Translate the operand at index `at` and the operations after it, up to the first operator with a
    /// precedence below `loosest`. Move `at` behind them.
    fn operation(
        &self,
        tokens: &[Token],
        at: &mut usize,
        loosest: u8,
        depth: usize,
    ) -> Result<Operand, String> {
        if depth > DEEPEST {
            return Err("the expression is too deep".to_owned());
        }
        let mut left = self.operand(tokens, at, depth)?;
        while let Some(Token::Symbol(symbol)) = tokens.get(*at)
            && let Some(precedence) = precedence(symbol)
            && precedence >= loosest
        {
            *at += 1;
            let right = self.operation(tokens, at, precedence + 1, depth)?;
            left = combine(symbol, precedence, left, right);
            if left.text.len() > LONGEST {
                return Err("the expression is too long".to_owned());
            }
        }
        Ok(left)
    }

    /// Translate the value at index `at`, with the signs before it. Move `at` behind it.
    fn operand(&self, tokens: &[Token], at: &mut usize, depth: usize) -> Result<Operand, String> {
        let token = tokens.get(*at).ok_or("a value is missing")?;
        let is_call = tokens
            .get(*at + 1)
            .is_some_and(|token| is_symbol(token, "("));
        let text = match token {
            Token::Symbol(sign @ ("-" | "+" | "!")) => {
                *at += 1;
                let value = self.operation(tokens, at, PREFIX, depth + 1)?;
                return Ok(Operand {
                    text: format!("{sign}{}", value.above(PREFIX)),
                    precedence: PREFIX,
                });
            }
            Token::Symbol("(") => {
                let end = closing(tokens, *at)?;
                let inner = self.left_to_right(&tokens[*at + 1..end], depth + 1)?;
                *at = end;
                format!("({inner})")
            }
            Token::Symbol(symbol) => return Err(format!("unexpected `{symbol}`")),
            Token::Name(name) if is_call => {
                let end = closing(tokens, *at + 1)?;
                let call = self.call(name, &tokens[*at + 2..end], depth + 1)?;
                *at = end;
                call
            }
            Token::Name(name) => (self.names)(name).unwrap_or_else(|| name.clone()),
            Token::Number(number) => number.clone(),
        };
        *at += 1;
        Ok(Operand {
            text,
            precedence: ATOM,
        })
    }
}

/// Translate an operator with both operands.
fn combine(symbol: &str, precedence: u8, left: Operand, right: Operand) -> Operand {
    let atom = |text: String| Operand {
        text,
        precedence: ATOM,
    };
    let text = match symbol {
        // In LAMMPS scripts, the time is `step*dt`. `step` is translated to (t/dt), so this product is t.
        "*" if left.text == format!("(t/{})", right.text)
            || right.text == format!("(t/{})", left.text) =>
        {
            return atom("t".to_owned());
        }
        // The remainder has the sign of the dividend.
        "%" => {
            let [a, b] = [left.above(ATOM - 1), right.above(ATOM - 1)];
            let rounded = format!("if({a}/{b} < 0, ceil({a}/{b}), floor({a}/{b}))");
            return atom(format!("({a} - {b}*{rounded})"));
        }
        "|^" => {
            let [a, b] = [left, right].map(|operand| operand.above(ATOM - 1));
            return atom(format!("(({a} == 0) != ({b} == 0))"));
        }
        "^" => format!("{}^{}", left.above(PREFIX), right.above(PREFIX)),
        "+" | "-" | "*" | "/" => format!("{}{symbol}{}", left.text, right.text),
        symbol if COMPARISONS.contains(&precedence) => {
            // Fissure rejects a comparison that begins with `!`, and `a < b < c`.
            let operand = |operand: Operand| {
                if operand.text.starts_with('!') {
                    format!("({})", operand.text)
                } else {
                    operand.above(COMPARISONS[1])
                }
            };
            format!("{} {symbol} {}", operand(left), operand(right))
        }
        symbol => format!("{} {symbol} {}", left.text, right.text),
    };
    Operand { text, precedence }
}

impl Operand {
    /// Return the text, in parentheses unless its outermost operator has a precedence above `loosest`.
    fn above(&self, loosest: u8) -> String {
        if self.precedence > loosest {
            self.text.clone()
        } else {
            format!("({})", self.text)
        }
    }
}
