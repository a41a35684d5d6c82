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

    /// Calls `set` with the number of each position and the value there.
    pub fn at(&self, positions: &[[f64; 3]], time: f64, mut set: impl FnMut(usize, f64)) {
        if self.varies {
            for (k, position) in positions.iter().enumerate() {
                set(k, self.expression.evaluate(*position, time));
            }
        } else {
            let value = self.expression.evaluate([0.0; 3], time);
            (0..positions.len()).for_each(|k| set(k, value));
        }
    }
}
