//! Initial values, loads and supports.

use std::ops::Range;
use std::path::PathBuf;

use crate::expression::Expression;
use crate::points::value_file::ValueColumns;

/// Initial values of a set.
#[derive(Debug, Clone)]
pub struct Initial {
    /// Its name.
    pub name: String,
    /// Index of the set.
    pub set: usize,
    /// Span of the set's name in the deck.
    pub span: Range<usize>,
    /// Displacement (m) by component, and its span in the deck.
    pub displacement: Option<(Vec<Expression>, Range<usize>)>,
    /// Velocity (m/s) by component, and its span in the deck.
    pub velocity: Option<(Vec<Expression>, Range<usize>)>,
    /// A file with the values of each point, in place of expressions.
    pub file: Option<InitialFile>,
}

impl Initial {
    /// Whether it moves points at the start.
    pub fn displaces(&self) -> bool {
        let by_file = |file: &InitialFile| file.columns.has_displacement();
        self.displacement.is_some() || self.file.as_ref().is_some_and(by_file)
    }
}

/// A file with initial values, one row per point.
#[derive(Debug, Clone)]
pub struct InitialFile {
    /// Its path.
    pub path: PathBuf,
    /// Span of its path in the deck.
    pub span: Range<usize>,
    /// Its columns.
    pub columns: ValueColumns,
}

/// A load or support.
#[derive(Debug, Clone)]
pub struct Condition {
    /// Its name.
    pub name: String,
    /// Index of the set.
    pub set: usize,
    /// Span of the set's name in the deck.
    pub span: Range<usize>,
    /// The key of what it prescribes, such as `traction`.
    pub quantity: &'static str,
    /// Span of this key in the deck.
    pub place: Range<usize>,
    /// Thickness (m) of the layer that carries a traction or pressure, if it is the spacing by default.
    pub default_depth: Option<f64>,
    /// The prescribed quantity and its values.
    pub action: Action,
}

/// The effect of a condition on its points, by component.
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

impl Action {
    /// Whether it adds forces.
    pub fn is_load(&self) -> bool {
        matches!(self, Self::BodyForce(..) | Self::Force(_))
    }

    /// Whether it prescribes the motion.
    pub fn is_support(&self) -> bool {
        matches!(self, Self::Displacement(_) | Self::Velocity(_))
    }
}
