//! Postfix code of an expression: constant folding and evaluation.

use std::sync::Arc;

use super::{Table, Variable};

/// Largest absolute value of an integer exponent for which a power is computed by multiplication.
const LARGEST_INTEGER_EXPONENT: f64 = 16.0;

/// Stack size, in values, that is enough for nearly all expressions. An evaluation first sets its stack to
/// zero, which is cheap for a small stack.
const SHALLOW_STACK: usize = 16;

/// Stack size, in values, for the most deeply nested expression. A level of nesting has at most two pending
/// operands: the first two arguments of a function with three arguments.
const DEEP_STACK: usize = 2 * super::parse::DEEPEST_NESTING + 1;

/// One step of postfix code.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Instruction {
    /// Push a value.
    Constant(f64),
    /// Push the value of a variable.
    Variable(Variable),
    /// Push the value of the table with this index.
    Table(usize),
    /// Replace the topmost value by the result.
    Unary(Unary),
    /// Replace the two topmost values by the result.
    Binary(Binary),
    /// Replace the three topmost values by the result.
    Ternary(Ternary),
}

/// An operation on one value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Unary {
    /// `-a`
    Negate,
    /// `!a`
    Not,
    /// `a^n` with a small integer `n` that is known at parse time.
    IntegerPower(i32),
    /// `sin(a)`
    Sine,
    /// `cos(a)`
    Cosine,
    /// `tan(a)`
    Tangent,
    /// `asin(a)`
    ArcSine,
    /// `acos(a)`
    ArcCosine,
    /// `atan(a)`
    ArcTangent,
    /// `sinh(a)`
    HyperbolicSine,
    /// `cosh(a)`
    HyperbolicCosine,
    /// `tanh(a)`
    HyperbolicTangent,
    /// `exp(a)`
    Exponential,
    /// `log(a)`, the natural logarithm
    Logarithm,
    /// `log10(a)`
    DecimalLogarithm,
    /// `sqrt(a)`
    SquareRoot,
    /// `abs(a)`
    Absolute,
    /// `floor(a)`
    Floor,
    /// `ceil(a)`
    Ceiling,
    /// `sign(a)`
    Sign,
    /// `step(a)`
    Step,
}

/// An operation on two values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Binary {
    /// `a + b`
    Add,
    /// `a - b`
    Subtract,
    /// `a * b`
    Multiply,
    /// `a / b`
    Divide,
    /// `a ^ b`
    Power,
    /// `a < b`
    Less,
    /// `a <= b`
    LessOrEqual,
    /// `a > b`
    Greater,
    /// `a >= b`
    GreaterOrEqual,
    /// `a == b`
    Equal,
    /// `a != b`
    NotEqual,
    /// `a && b`
    And,
    /// `a || b`
    Or,
    /// `min(a, b)`
    Minimum,
    /// `max(a, b)`
    Maximum,
    /// `atan2(a, b)`
    ArcTangent,
    /// `hypot(a, b)`
    Hypotenuse,
}

/// An operation on three values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ternary {
    /// `if(a, b, c)`
    Choose,
    /// `ramp(a, b, c)`
    Ramp,
    /// `clamp(a, b, c)`
    Clamp,
}

impl Unary {
    pub(super) fn apply(self, value: f64) -> f64 {
        match self {
            Self::Negate => -value,
            Self::Not if value.is_nan() => value,
            Self::Not => truth(value == 0.0),
            Self::IntegerPower(exponent) => value.powi(exponent),
            Self::Sine => libm::sin(value),
            Self::Cosine => libm::cos(value),
            Self::Tangent => libm::tan(value),
            Self::ArcSine => libm::asin(value),
            Self::ArcCosine => libm::acos(value),
            Self::ArcTangent => libm::atan(value),
            Self::HyperbolicSine => libm::sinh(value),
            Self::HyperbolicCosine => libm::cosh(value),
            Self::HyperbolicTangent => libm::tanh(value),
            Self::Exponential => libm::exp(value),
            Self::Logarithm => libm::log(value),
            Self::DecimalLogarithm => libm::log10(value),
            Self::SquareRoot => value.sqrt(),
            Self::Absolute => value.abs(),
            Self::Floor => value.floor(),
            Self::Ceiling => value.ceil(),
            // Unlike `signum`, the sign of zero is zero.
            Self::Sign if value > 0.0 => 1.0,
            Self::Sign if value < 0.0 => -1.0,
            Self::Sign => value,
            Self::Step if value < 0.0 => 0.0,
            Self::Step if value >= 0.0 => 1.0,
            Self::Step => value,
        }
    }
}

impl Binary {
    pub(super) fn apply(self, left: f64, right: f64) -> f64 {
        match self {
            Self::Add => left + right,
            Self::Subtract => left - right,
            Self::Multiply => left * right,
            Self::Divide => left / right,
            Self::Power => match small_integer(right) {
                Some(exponent) => left.powi(exponent),
                None => libm::pow(left, right),
            },
            Self::Less => truth(left < right),
            Self::LessOrEqual => truth(left <= right),
            Self::Greater => truth(left > right),
            Self::GreaterOrEqual => truth(left >= right),
            Self::Equal => truth(left == right),
            Self::NotEqual => truth(left != right),
            Self::And if left == 0.0 || right == 0.0 => 0.0,
            Self::Or if is_true(left) || is_true(right) => 1.0,
            Self::And | Self::Or if left.is_nan() || right.is_nan() => f64::NAN,
            Self::And => 1.0,
            Self::Or => 0.0,
            Self::Minimum => minimum(left, right),
            Self::Maximum => maximum(left, right),
            Self::ArcTangent => libm::atan2(left, right),
            Self::Hypotenuse => libm::hypot(left, right),
        }
    }
}

impl Ternary {
    pub(super) fn apply(self, first: f64, second: f64, third: f64) -> f64 {
        match self {
            Self::Choose if is_true(first) => second,
            Self::Choose if first == 0.0 => third,
            Self::Choose => first,
            Self::Ramp if first >= third => 1.0,
            Self::Ramp if first <= second => 0.0,
            Self::Ramp => (first - second) / (third - second),
            Self::Clamp => minimum(maximum(first, second), third),
        }
    }
}

/// Test whether a value, taken as a condition, is true: not 0 and not NaN.
pub(super) fn is_true(value: f64) -> bool {
    value != 0.0 && !value.is_nan()
}

fn truth(condition: bool) -> f64 {
    f64::from(u8::from(condition))
}

/// Return the smaller value, or NaN if either is NaN. `f64::min` would ignore NaN, and does not specify the
/// sign of zero.
fn minimum(left: f64, right: f64) -> f64 {
    if left < right || left.is_nan() {
        left
    } else {
        right
    }
}

/// Return the larger value, or NaN if either is NaN.
fn maximum(left: f64, right: f64) -> f64 {
    if left > right || left.is_nan() {
        left
    } else {
        right
    }
}

/// Return the exponent as an integer, if the power is computed by multiplication; otherwise, return `None`.
fn small_integer(exponent: f64) -> Option<i32> {
    (exponent.abs() <= LARGEST_INTEGER_EXPONENT && exponent.fract() == 0.0)
        .then_some(exponent as i32)
}

/// Append an instruction. If all operands of the instruction are constants, replace the operands by the
/// result. A power with a small constant integer as exponent becomes [`Unary::IntegerPower`].
///
/// A constant at the end of postfix code is always a complete operand. Therefore all n operands of an
/// instruction are constants if, and only if, the last n instructions of the code are constants.
pub(super) fn append(code: &mut Vec<Instruction>, instruction: Instruction) {
    use Instruction::{Constant, Unary as One};
    let (operands, replacement) = match (instruction, code.as_slice()) {
        (One(operation), &[.., Constant(value)]) => (1, Constant(operation.apply(value))),
        (Instruction::Binary(operation), &[.., Constant(left), Constant(right)]) => {
            (2, Constant(operation.apply(left, right)))
        }
        (
            Instruction::Ternary(operation),
            &[.., Constant(first), Constant(second), Constant(third)],
        ) => (3, Constant(operation.apply(first, second, third))),
        (Instruction::Binary(Binary::Power), &[.., Constant(right)]) => {
            match small_integer(right) {
                Some(exponent) => (1, One(Unary::IntegerPower(exponent))),
                None => (0, instruction),
            }
        }
        _ => (0, instruction),
    };
    code.truncate(code.len() - operands);
    code.push(replacement);
}

/// Return the largest stack size that the code needs, in values.
pub(super) fn stack_size(code: &[Instruction]) -> usize {
    let mut size = 0;
    let mut largest = 0;
    for instruction in code {
        match instruction {
            Instruction::Constant(_) | Instruction::Variable(_) | Instruction::Table(_) => {
                size += 1;
            }
            Instruction::Unary(_) => {}
            Instruction::Binary(_) => size -= 1,
            Instruction::Ternary(_) => size -= 2,
        }
        largest = largest.max(size);
    }
    largest
}

/// Return true if the operations in `code` show that the result is always 0, 1 or NaN. An example is a
/// comparison.
/// The function does not compute with the values of constants and variables, so it returns false for `0*x`,
/// for example.
pub(super) fn is_truth(code: &[Instruction]) -> bool {
    let mut truths = Vec::new();
    let take = |stack: &mut Vec<bool>| stack.pop().unwrap_or(false);
    for instruction in code {
        let truth = match instruction {
            Instruction::Constant(value) => *value == 0.0 || *value == 1.0,
            Instruction::Variable(_) | Instruction::Table(_) => false,
            Instruction::Unary(operation) => {
                let operand = take(&mut truths);
                match operation {
                    Unary::Not | Unary::Step => true,
                    Unary::Absolute | Unary::Sign | Unary::Floor | Unary::Ceiling => operand,
                    _ => false,
                }
            }
            Instruction::Binary(operation) => {
                let operands = [take(&mut truths), take(&mut truths)];
                match operation {
                    Binary::Less
                    | Binary::LessOrEqual
                    | Binary::Greater
                    | Binary::GreaterOrEqual
                    | Binary::Equal
                    | Binary::NotEqual
                    | Binary::And
                    | Binary::Or => true,
                    Binary::Multiply | Binary::Minimum | Binary::Maximum => {
                        operands == [true, true]
                    }
                    _ => false,
                }
            }
            Instruction::Ternary(operation) => {
                let [third, second, _] = [(); 3].map(|()| take(&mut truths));
                *operation == Ternary::Choose && second && third
            }
        };
        truths.push(truth);
    }
    truths == [true]
}

/// Evaluate the code with the variables x, y, z, t. `stack_size` is the result of the function
/// [`stack_size`].
pub(super) fn evaluate(
    code: &[Instruction],
    tables: &[Arc<Table>],
    stack_size: usize,
    variables: [f64; 4],
) -> f64 {
    match code {
        [Instruction::Constant(value)] => *value,
        _ if stack_size <= SHALLOW_STACK => run::<SHALLOW_STACK>(code, tables, variables),
        _ => run::<DEEP_STACK>(code, tables, variables),
    }
}

/// Run the code on a stack of a fixed size.
fn run<const SIZE: usize>(code: &[Instruction], tables: &[Arc<Table>], variables: [f64; 4]) -> f64 {
    let mut stack = [0.0; SIZE];
    let mut size = 0;
    for instruction in code {
        match *instruction {
            Instruction::Constant(value) => {
                stack[size] = value;
                size += 1;
            }
            Instruction::Variable(variable) => {
                stack[size] = variables[variable.slot()];
                size += 1;
            }
            Instruction::Table(number) => {
                stack[size] = tables[number].at(variables[Variable::T.slot()]);
                size += 1;
            }
            Instruction::Unary(operation) => {
                stack[size - 1] = operation.apply(stack[size - 1]);
            }
            Instruction::Binary(operation) => {
                size -= 1;
                stack[size - 1] = operation.apply(stack[size - 1], stack[size]);
            }
            Instruction::Ternary(operation) => {
                size -= 2;
                stack[size - 1] = operation.apply(stack[size - 1], stack[size], stack[size + 1]);
            }
        }
    }
    stack[0]
}
