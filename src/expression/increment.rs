//! Change of an expression's value over a time interval, computed without cancellation for most operations.
//!
//! The difference of two computed values of size |u| has a round-off of ε|u|, where ε is the machine epsilon.
//! Dividing a second difference of such values by the square of a small step amplifies this error. In this
//! module, most operations compute the change of their result from the changes of their operands. The
//! round-off of these operations is therefore ε times the size of the change. For example, the change of sin
//! from a to b is 2 cos((a + b)/2) sin((b − a)/2). For the other operations, such as `tan` and `atan2`, the
//! change is the difference of two computed values.

use std::sync::Arc;

use super::evaluate::{Binary, Instruction, Ternary, Unary, is_true};
use super::{Table, Variable};

/// A value and its change over the time interval.
#[derive(Debug, Clone, Copy)]
struct Moving {
    value: f64,
    change: f64,
}

impl Moving {
    fn end(self) -> f64 {
        self.value + self.change
    }
}

/// Compute the change of the code's value from the time t to t + `step`; `step` may be negative. `variables`
/// are x, y, z and t.
pub(super) fn increment(
    code: &[Instruction],
    tables: &[Arc<Table>],
    variables: [f64; 4],
    step: f64,
) -> f64 {
    let mut stack: Vec<Moving> = Vec::with_capacity(code.len());
    let take = |stack: &mut Vec<Moving>| stack.pop().expect("postfix code has its operands");
    for instruction in code {
        let result = match *instruction {
            Instruction::Constant(value) => Moving { value, change: 0.0 },
            Instruction::Variable(variable) => Moving {
                value: variables[variable.slot()],
                change: if variable == Variable::T { step } else { 0.0 },
            },
            Instruction::Table(number) => {
                let (table, time) = (&tables[number], variables[Variable::T.slot()]);
                Moving {
                    value: table.at(time),
                    change: table.increment(time, step),
                }
            }
            Instruction::Unary(operation) => unary(operation, take(&mut stack)),
            Instruction::Binary(operation) => {
                let right = take(&mut stack);
                binary(operation, take(&mut stack), right)
            }
            Instruction::Ternary(operation) => {
                let (third, second) = (take(&mut stack), take(&mut stack));
                ternary(operation, [take(&mut stack), second, third])
            }
        };
        stack.push(result);
    }
    take(&mut stack).change
}

fn unary(operation: Unary, a: Moving) -> Moving {
    let (from, change, to) = (a.value, a.change, a.end());
    let (half, middle) = (0.5 * change, from + 0.5 * change);
    let value = operation.apply(from);
    let change = match operation {
        _ if change == 0.0 => 0.0,
        Unary::Negate => -change,
        Unary::IntegerPower(power) => power_change(from, to, change, power),
        Unary::Sine => 2.0 * libm::cos(middle) * libm::sin(half),
        Unary::Cosine => -2.0 * libm::sin(middle) * libm::sin(half),
        Unary::HyperbolicSine => 2.0 * libm::cosh(middle) * libm::sinh(half),
        Unary::HyperbolicCosine => 2.0 * libm::sinh(middle) * libm::sinh(half),
        Unary::HyperbolicTangent => libm::tanh(change) * (1.0 - value * libm::tanh(to)),
        Unary::Exponential => value * libm::expm1(change),
        Unary::Logarithm if from > 0.0 => libm::log1p(change / from),
        Unary::DecimalLogarithm if from > 0.0 => {
            libm::log1p(change / from) / std::f64::consts::LN_10
        }
        Unary::SquareRoot if from > 0.0 => change / (value + to.sqrt()),
        Unary::Absolute if from > 0.0 && to > 0.0 => change,
        Unary::Absolute if from < 0.0 && to < 0.0 => -change,
        _ => operation.apply(to) - value,
    };
    Moving { value, change }
}

/// Compute to^n − from^n, where n is `power` and to = from + change.
fn power_change(from: f64, to: f64, change: f64, power: i32) -> f64 {
    let count = power.unsigned_abs() as i32;
    let sum: f64 = (0..count)
        .map(|k| to.powi(k) * from.powi(count - 1 - k))
        .sum();
    if power >= 0 {
        change * sum
    } else {
        -change * sum / (from.powi(count) * to.powi(count))
    }
}

fn binary(operation: Binary, a: Moving, b: Moving) -> Moving {
    let value = operation.apply(a.value, b.value);
    let end = operation.apply(a.end(), b.end());
    let change = match operation {
        _ if a.change == 0.0 && b.change == 0.0 => 0.0,
        Binary::Add => a.change + b.change,
        Binary::Subtract => a.change - b.change,
        Binary::Multiply => a.value * b.change + a.change * b.end(),
        Binary::Divide => (a.change - value * b.change) / b.end(),
        Binary::Power if b.change == 0.0 && a.value > 0.0 => {
            value * libm::expm1(b.value * libm::log1p(a.change / a.value))
        }
        Binary::Power if a.change == 0.0 && a.value > 0.0 => {
            value * libm::expm1(b.change * libm::log(a.value))
        }
        Binary::Hypotenuse if value > 0.0 => {
            let squares = a.change * (a.value + a.end()) + b.change * (b.value + b.end());
            squares / (value + end)
        }
        Binary::Minimum if a.value < b.value && a.end() < b.end() => a.change,
        Binary::Minimum if a.value > b.value && a.end() > b.end() => b.change,
        Binary::Maximum if a.value > b.value && a.end() > b.end() => a.change,
        Binary::Maximum if a.value < b.value && a.end() < b.end() => b.change,
        _ => end - value,
    };
    Moving { value, change }
}

fn ternary(operation: Ternary, [a, b, c]: [Moving; 3]) -> Moving {
    let value = operation.apply(a.value, b.value, c.value);
    let end = operation.apply(a.end(), b.end(), c.end());
    let is_between = |x: f64| b.value < x && x < c.value;
    let change = match operation {
        Ternary::Choose if is_true(a.value) && is_true(a.end()) => b.change,
        Ternary::Choose if a.value == 0.0 && a.end() == 0.0 => c.change,
        Ternary::Ramp
            if b.change == 0.0 && c.change == 0.0 && is_between(a.value) && is_between(a.end()) =>
        {
            a.change / (c.value - b.value)
        }
        Ternary::Clamp => {
            let raised = binary(Binary::Maximum, a, b);
            return binary(Binary::Minimum, raised, c);
        }
        _ => end - value,
    };
    Moving { value, change }
}
