//! Initial values, loads, supports and temperatures.

use std::ops::Range;
use std::path::PathBuf;

use super::Body;
use crate::error::Error;
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
    /// Thickness of the layer that carries a traction or pressure; `None` for other quantities.
    pub depth: Option<Depth>,
    /// The prescribed quantity and its values.
    pub action: Action,
}

/// Thickness of the layer of points that carries a traction or pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Depth {
    /// The thickness that the deck gives, m.
    Given(f64),
    /// The spacing of the body to which a point belongs.
    Spacing,
}

impl Condition {
    /// Return the number by which the load on the points of a body is divided: the thickness of the layer
    /// (m), or 1 without a layer. `None` if the thickness is the spacing and the body has no single spacing.
    pub fn divisor(&self, body: &Body, dimension: usize) -> Option<f64> {
        match self.depth {
            None => Some(1.0),
            Some(Depth::Given(depth)) => Some(depth),
            Some(Depth::Spacing) => body.single_spacing(dimension),
        }
    }

    /// Return the distinct values of [`Self::divisor`] for `bodies`. Values that are `None` are skipped.
    pub fn divisors<'b>(
        &self,
        bodies: impl IntoIterator<Item = &'b Body>,
        dimension: usize,
    ) -> Vec<f64> {
        let mut divisors = Vec::new();
        for body in bodies {
            let divisor = self.divisor(body, dimension);
            divisors.extend(divisor.filter(|divisor| !divisors.contains(divisor)));
        }
        divisors
    }

    /// Return the error for a condition whose layer is one spacing thick, although the body has no single
    /// spacing.
    pub fn no_depth(&self, body: &Body) -> Error {
        let message = format!(
            "[condition.{}]: a traction or a pressure acts on a layer of points. The default thickness of this layer is \
             the spacing, but the points of [body.{}] have no single spacing; give the thickness as `depth`",
            self.name, body.name
        );
        Error::input(message).at(&self.place)
    }
}

/// The effect of a condition on its points, by component.
#[derive(Debug, Clone)]
pub enum Action {
    /// Prescribed displacement (m); `None` for free components.
    Displacement(Vec<Option<Expression>>),
    /// Prescribed velocity (m/s); `None` for free components.
    Velocity(Vec<Option<Expression>>),
    /// Additional force density (N/m³): the expressions and the factors by component. The expression of a
    /// component is multiplied by its factor, and divided by [`Condition::depth`] if there is a depth.
    BodyForce(Vec<Expression>, Vec<f64>),
    /// Additional total force (N), distributed over the points by volume.
    Force(Vec<Expression>),
    /// Prescribed temperature, in the unit of the reference temperatures of the materials.
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
