//! Initial values, loads, supports and temperatures.

use std::ops::Range;
use std::path::PathBuf;

use crate::expression::Expression;
use crate::points::value_file::ValueColumns;

/// Initial values of a set.
#[derive(Debug, Clone)]
pub struct Initial {
    /// Name in the deck.
    pub name: String,
    /// Index of the set.
    pub set: usize,
    /// Span of the set's name in the deck.
    pub span: Range<usize>,
    /// Displacement (m) by component, and its span in the deck.
    pub displacement: Option<(Vec<Expression>, Range<usize>)>,
    /// Velocity (m/s) by component, and its span in the deck.
    pub velocity: Option<(Vec<Expression>, Range<usize>)>,
    /// A file with the values of each point, instead of expressions.
    pub file: Option<InitialFile>,
}

impl Initial {
    /// Test whether the initial values include displacements.
    pub fn displaces(&self) -> bool {
        let by_file = |file: &InitialFile| file.columns.has_displacement();
        self.displacement.is_some() || self.file.as_ref().is_some_and(by_file)
    }
}

/// A file with initial values, one row per point.
#[derive(Debug, Clone)]
pub struct InitialFile {
    /// Path of the file, relative to the working directory or absolute.
    pub path: PathBuf,
    /// Span of the path in the deck.
    pub span: Range<usize>,
    /// Meaning of the columns, from the heading of the file.
    pub columns: ValueColumns,
}

/// A load, support or prescribed temperature.
#[derive(Debug, Clone)]
pub struct Condition {
    /// Name in the deck.
    pub name: String,
    /// Index of the set.
    pub set: usize,
    /// Span of the set's name in the deck.
    pub span: Range<usize>,
    /// Key of the prescribed quantity in the deck, such as `traction`.
    pub quantity: &'static str,
    /// Span of this key in the deck.
    pub place: Range<usize>,
    /// Default thickness (m) of the layer that carries a traction or pressure: the spacing. `None` if the
    /// deck gives the thickness, and for other quantities.
    pub default_depth: Option<f64>,
    /// The prescribed quantity and its values.
    pub action: Action,
}

/// The effect of a condition on its points, by component.
#[derive(Debug, Clone)]
pub enum Action {
    /// Prescribed displacement (m); `None` for free components.
    Displacement(Vec<Option<Expression>>),
    /// Prescribed velocity (m/s); `None` for free components.
    Velocity(Vec<Option<Expression>>),
    /// Additional force density (N/m³): each expression is multiplied by its factor.
    BodyForce(Vec<Expression>, Vec<f64>),
    /// Additional total force (N), distributed over the points by volume.
    Force(Vec<Expression>),
    /// Prescribed temperature.
    Temperature(Expression),
}

impl Action {
    /// Test whether the condition adds forces.
    pub fn is_load(&self) -> bool {
        matches!(self, Self::BodyForce(..) | Self::Force(_))
    }

    /// Test whether the condition prescribes displacement or velocity.
    pub fn is_support(&self) -> bool {
        matches!(self, Self::Displacement(_) | Self::Velocity(_))
    }
}
