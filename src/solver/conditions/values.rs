//! Values of an expression at some points.

use crate::deck::expression::{Expression, Variable};

/// Values of an expression at some points, evaluated no more often than it can change.
pub struct Values {
    pub expression: Expression,
    /// In time.
    pub changes: bool,
    /// From point to point.
    pub varies: bool,
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

    /// The values at a time (s), by the number of the position.
    pub fn at<'a>(&'a self, positions: &'a [[f64; 3]], time: f64) -> impl Fn(usize) -> f64 + 'a {
        let same = (!self.varies).then(|| self.expression.evaluate([0.0; 3], time));
        move |k| same.unwrap_or_else(|| self.expression.evaluate(positions[k], time))
    }
}
