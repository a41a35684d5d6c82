//! Initial values, loads and supports.

use std::ops::Range;

use crate::expression::Expression;

/// Initial values of a set.
#[derive(Debug, Clone)]
pub struct Initial {
    /// Its name.
    pub name: String,
    /// Index of the set.
    pub set: usize,
    /// Where the set is named.
    pub span: Range<usize>,
    /// Displacement (m) by component, and where it stands.
    pub displacement: Option<(Vec<Expression>, Range<usize>)>,
    /// Velocity (m/s) by component, and where it stands.
    pub velocity: Option<(Vec<Expression>, Range<usize>)>,
}

/// A load or support.
#[derive(Debug, Clone)]
pub struct Condition {
    /// Its name.
    pub name: String,
    /// Index of the set.
    pub set: usize,
    /// Where the set is named.
    pub span: Range<usize>,
    /// The key of what it prescribes, such as `traction`.
    pub quantity: &'static str,
    /// Where that stands.
    pub place: Range<usize>,
    /// Thickness (m) of the layer that carries a traction or pressure, if the deck leaves it to the
    /// spacing.
    pub default_depth: Option<f64>,
    /// What it does.
    pub action: Action,
}

/// What a condition does to its points, by component.
#[derive(Debug, Clone)]
pub enum Action {
    /// Prescribes displacement (m); `None` is free.
    Displacement(Vec<Option<Expression>>),
    /// Prescribes velocity (m/s); `None` is free.
    Velocity(Vec<Option<Expression>>),
    /// Adds a body force density: each expression times its factor (N/m³).
    BodyForce(Vec<Expression>, Vec<f64>),
    /// Adds a total force (N), spread by volume.
    Force(Vec<Expression>),
    /// Prescribes the temperature.
    Temperature(Expression),
}
