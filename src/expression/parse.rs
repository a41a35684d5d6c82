//! Parser from the text of an expression to postfix code, by precedence climbing.

use super::ExpressionError;
use super::evaluate::{Binary, Instruction, Ternary, Unary, append};
use super::names::{Function, PI, Scope};
use super::token::{Kind, Precedence, Token, tokenize};
use crate::message::format_number;

/// Largest depth of nested operands, parentheses, calls and signs.
pub(super) const DEEPEST_NESTING: usize = 200;

/// Parse the text to postfix code with folded constants.
pub(super) fn parse(text: &str, scope: &Scope) -> Result<Vec<Instruction>, ExpressionError> {
    let tokens = tokenize(text)?;
    if tokens.len() == 1 {
        return Err(ExpressionError::new(
            0,
            text.len(),
            "the expression is empty",
        ));
    }
    let mut parser = Parser {
        text,
        scope,
        tokens,
        next: 0,
        nesting: 0,
        code: Vec::new(),
    };
    parser.expression(Precedence::Or)?;
    match parser.peek().kind {
        Kind::End => Ok(parser.code),
        _ => Err(parser.misplaced()),
    }
}

/// Return the names in the text that are neither functions nor constants. Each name occurs once, in the order
/// of first use in the text. A name counts as a function if `(` follows.
pub(super) fn names(text: &str) -> Result<Vec<String>, ExpressionError> {
    let tokens = tokenize(text)?;
    let mut names: Vec<String> = Vec::new();
    for pair in tokens.windows(2) {
        let name = &text[pair[0].start..pair[0].end];
        let is_name = pair[0].kind == Kind::Name && pair[1].kind != Kind::Open && name != PI;
        if is_name && !names.iter().any(|known| known == name) {
            names.push(name.to_owned());
        }
    }
    Ok(names)
}

struct Parser<'a> {
    /// The whole text.
    text: &'a str,
    /// Meaning of the names.
    scope: &'a Scope<'a>,
    /// All tokens of the text; the last token is [`Kind::End`].
    tokens: Vec<Token>,
    /// Index of the next token.
    next: usize,
    /// Number of nested expressions that are being parsed.
    nesting: usize,
    /// Code so far.
    code: Vec<Instruction>,
}

impl Parser<'_> {
    /// Return the next token without consuming it.
    fn peek(&self) -> Token {
        self.tokens[self.next]
    }

    /// Consume the next token; [`Kind::End`] is never consumed.
    fn take(&mut self) -> Token {
        let token = self.peek();
        if token.kind != Kind::End {
            self.next += 1;
        }
        token
    }

    /// Return the text of a token.
    fn text_of(&self, token: Token) -> &str {
        &self.text[token.start..token.end]
    }

    /// Return the text in a byte range, trimmed.
    fn trimmed(&self, start: usize, end: usize) -> &str {
        self.text[start..end].trim()
    }

    /// Return the byte index after the last consumed token.
    fn end_of_last(&self) -> usize {
        self.next
            .checked_sub(1)
            .map_or(0, |last| self.tokens[last].end)
    }

    fn append(&mut self, instruction: Instruction) {
        append(&mut self.code, instruction);
    }

    /// Parse a value, and the following operators that bind at least as tightly as `loosest`, with their
    /// right operands.
    fn expression(&mut self, loosest: Precedence) -> Result<(), ExpressionError> {
        let first = self.peek();
        if self.nesting > DEEPEST_NESTING {
            return Err(first.error(format!(
                "nested too deeply: at most {DEEPEST_NESTING} levels are allowed"
            )));
        }
        self.nesting += 1;
        self.value()?;
        while let Kind::Operator(operation, precedence) = self.peek().kind
            && precedence >= loosest
        {
            let operator = self.take();
            self.expression(tighter(precedence))?;
            self.append(Instruction::Binary(operation));
            if precedence == Precedence::Comparison {
                self.check_comparison(first, operator)?;
            }
        }
        self.nesting -= 1;
        Ok(())
    }

    /// Reject comparisons whose meaning probably differs from the intention: `a < b < c` and `!a < b`.
    fn check_comparison(&mut self, first: Token, operator: Token) -> Result<(), ExpressionError> {
        let next = self.peek();
        let (end, message) = if let Kind::Operator(_, Precedence::Comparison) = next.kind {
            self.take();
            self.expression(tighter(Precedence::Comparison))?;
            let end = self.end_of_last();
            let message = format!(
                "comparisons cannot be chained: \
                 write `{left} {operator} {middle} && {middle} {next} {right}`",
                left = self.trimmed(first.start, operator.start),
                operator = self.text_of(operator),
                middle = self.trimmed(operator.end, next.start),
                next = self.text_of(next),
                right = self.trimmed(next.end, end),
            );
            (end, message)
        } else if first.kind == Kind::Not {
            let end = self.end_of_last();
            let message = format!(
                "`{not}` binds tighter than `{operator}`: \
                 write `{not}({operand} {operator} {right})` or `({left}) {operator} {right}`",
                not = self.text_of(first),
                operator = self.text_of(operator),
                operand = self.trimmed(first.end, operator.start),
                left = self.trimmed(first.start, operator.start),
                right = self.trimmed(operator.end, end),
            );
            (end, message)
        } else {
            return Ok(());
        };
        Err(ExpressionError::new(first.start, end, message))
    }

    /// Parse a number, a name, a call, a parenthesis, or a prefix operator with its operand.
    fn value(&mut self) -> Result<(), ExpressionError> {
        let token = self.peek();
        match token.kind {
            Kind::Number(value) => {
                self.take();
                self.append(Instruction::Constant(value));
            }
            Kind::Name => {
                self.take();
                if self.peek().kind == Kind::Open {
                    return self.call(token);
                }
                let instruction = self
                    .scope
                    .value(self.text_of(token))
                    .map_err(|message| token.error(message))?;
                self.append(instruction);
            }
            Kind::Operator(Binary::Add, _) => {
                self.take();
                self.expression(Precedence::Prefix)?;
            }
            Kind::Operator(Binary::Subtract, _) => {
                self.take();
                self.expression(Precedence::Prefix)?;
                self.append(Instruction::Unary(Unary::Negate));
            }
            Kind::Not => {
                self.take();
                self.expression(Precedence::Prefix)?;
                self.append(Instruction::Unary(Unary::Not));
            }
            Kind::Open => {
                self.take();
                self.expression(Precedence::Or)?;
                if self.peek().kind != Kind::Close {
                    return Err(self.unclosed(token));
                }
                self.take();
            }
            Kind::Operator(..) | Kind::Close | Kind::Comma | Kind::End => {
                return Err(self.missing_value());
            }
        }
        Ok(())
    }

    /// Parse the arguments of a call of the function `name`, and append the instruction of the function.
    fn call(&mut self, name: Token) -> Result<(), ExpressionError> {
        let function = self
            .scope
            .function(self.text_of(name))
            .map_err(|message| name.error(message))?;
        let open = self.take();
        let mut count = 0;
        if self.peek().kind != Kind::Close {
            loop {
                self.expression(Precedence::Or)?;
                count += 1;
                if let Function::Several(operation) = function
                    && count > 1
                {
                    self.append(Instruction::Binary(operation));
                }
                if self.peek().kind != Kind::Comma {
                    break;
                }
                self.take();
            }
        }
        if self.peek().kind != Kind::Close {
            return Err(self.unclosed(open));
        }
        let close = self.take();
        let expected = match (function, count) {
            (Function::Unary(operation), 1) => {
                self.append(Instruction::Unary(operation));
                return Ok(());
            }
            (Function::Binary(operation), 2) => {
                self.append(Instruction::Binary(operation));
                return Ok(());
            }
            (Function::Ternary(operation), 3) => {
                if operation == Ternary::Ramp {
                    self.check_ramp(name.start, close.end)?;
                }
                self.append(Instruction::Ternary(operation));
                return Ok(());
            }
            (Function::Several(_), 2..) => return Ok(()),
            (Function::Unary(_), _) => "1 argument",
            (Function::Binary(_), _) => "2 arguments",
            (Function::Ternary(_), _) => "3 arguments",
            (Function::Several(_), _) => "at least 2 arguments",
        };
        let message = format!("`{}` takes {expected}, got {count}", self.text_of(name));
        Err(ExpressionError::new(name.start, close.end, message))
    }

    /// Reject a ramp whose constant end is before its constant start. The code must end with the three
    /// arguments of the ramp; `start` and `end` are the byte range of the call.
    fn check_ramp(&self, start: usize, end: usize) -> Result<(), ExpressionError> {
        match self.code[..] {
            [.., Instruction::Constant(from), Instruction::Constant(to)] if from > to => {
                let message = format!(
                    "`ramp(a, start, end)` needs an `end` that is not below `start`; `start` is {}, `end` is {}",
                    format_number(from),
                    format_number(to)
                );
                Err(ExpressionError::new(start, end, message))
            }
            _ => Ok(()),
        }
    }

    /// Return the error for a missing value: the next token cannot start a value.
    fn missing_value(&self) -> ExpressionError {
        let token = self.peek();
        let after = match self.next.checked_sub(1) {
            Some(last) => format!("after `{}`", self.text_of(self.tokens[last])),
            None => "at the start".to_owned(),
        };
        let message = match token.kind {
            Kind::End => format!("unexpected end: expected a value {after}"),
            _ => format!("expected a value {after}, found `{}`", self.text_of(token)),
        };
        token.error(message)
    }

    /// Return the error if a value in the parenthesis `open` is not followed by `)`. The next token is the
    /// token after this value.
    fn unclosed(&self, open: Token) -> ExpressionError {
        if self.peek().kind == Kind::End {
            return open.error("unbalanced parenthesis: this `(` is never closed");
        }
        self.misplaced()
    }

    /// Return the error for the next token, which is misplaced: it cannot follow a value.
    fn misplaced(&self) -> ExpressionError {
        let token = self.peek();
        let text = self.text_of(token);
        let message = match token.kind {
            Kind::Close => "unbalanced parenthesis: this `)` closes nothing".to_owned(),
            Kind::Comma => {
                "unexpected `,`: it only separates the arguments of a function".to_owned()
            }
            _ => format!("expected an operator before `{text}`; to multiply, write `* {text}`"),
        };
        token.error(message)
    }
}

/// Return the loosest precedence that operators may have in the right operand of an operator with the given
/// precedence.
fn tighter(precedence: Precedence) -> Precedence {
    match precedence {
        Precedence::Or => Precedence::And,
        Precedence::And => Precedence::Comparison,
        Precedence::Comparison => Precedence::Sum,
        Precedence::Sum => Precedence::Product,
        Precedence::Product => Precedence::Prefix,
        Precedence::Prefix | Precedence::Power => Precedence::Power,
    }
}
