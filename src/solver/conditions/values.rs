//! Values of an expression at some points.

use crate::expression::{Expression, Variable};

/// An expression. If its value does not depend on the position, it is evaluated only once at each time, for
/// all points.
pub struct Values {
    pub expression: Expression,
    /// Whether the expression depends on time.
    pub changes: bool,
    /// Whether the expression depends on the position.
    pub varies: bool,
}

/// The values of an expression at a time.
pub struct At {
    /// Time, s.
    time: f64,
    /// Common value of all points; `None` if the values depend on the position.
    same: Option<f64>,
}

impl Values {
    pub fn new(expression: &Expression) -> Self {
        let space = [Variable::X, Variable::Y, Variable::Z];
        Self {
            changes: expression.uses(Variable::T),
            varies: space.iter().any(|variable| expression.uses(*variable)),
            expression: expression.clone(),
        }
    }

    /// Prepare the values at a time (s). If the value is the same for all points, this call computes it.
    pub fn at(&self, time: f64) -> At {
        let same = || self.expression.evaluate([0.0; 3], time);
        At {
            time,
            same: (!self.varies).then(same),
        }
    }

    /// The value at a point. `position` returns the position of the point (m). It is called only if the value
    /// depends on the position.
    pub fn of(&self, at: &At, position: impl Fn() -> [f64; 3]) -> f64 {
        let own = || self.expression.evaluate(position(), at.time);
        at.same.unwrap_or_else(own)
    }
}
