//! Validation of the shapes and pre-cracks of a deck.

use std::ops::Range;

use nalgebra::Vector3;

use super::grammar;
use super::number::{Number, Vector};
use super::resolve::Scope;
use crate::deck::spanned::Spanned;
use crate::error::Result;
use crate::message::format_number;
use crate::points::Polygon;
use crate::problem;

/// Validate a shape.
///
/// # Errors
/// On a shape for another dimension, an empty shape, too few corners or parts, or an invalid number.
pub fn shape(scope: &Scope, key: &str, shape: &Spanned<grammar::Shape>) -> Result<problem::Shape> {
    resolve(scope, key, shape.get_ref(), shape.span())
}

fn resolve(
    scope: &Scope,
    key: &str,
    shape: &grammar::Shape,
    span: Range<usize>,
) -> Result<problem::Shape> {
    use grammar::Shape;
    let only_in = |dimension: usize, name: &str, instead: &str| {
        if scope.dimension == dimension {
            return Ok(());
        }
        let instead = if scope.dimension == 1 {
            "`box`"
        } else {
            instead
        };
        let message = format!(
            "{key} {name}: is for {dimension}-D problems, this one is {}-D; use {instead}",
            scope.dimension
        );
        Err(scope.error(span.clone(), message))
    };
    match shape {
        Shape::Box { lower, upper } => {
            let [lower, upper] = corners_of_box(scope, key, lower, upper)?;
            Ok(problem::Shape::Box { lower, upper })
        }
        Shape::Disc { centre, radius } => {
            only_in(2, "disc", "`cylinder` or `sphere`")?;
            Ok(problem::Shape::Ball {
                centre: scope.vector(centre, &format!("{key} centre"))?,
                radius: scope.positive(radius, &format!("{key} radius"))?,
            })
        }
        Shape::Sphere { centre, radius } => {
            only_in(3, "sphere", "`disc`")?;
            Ok(problem::Shape::Ball {
                centre: scope.vector(centre, &format!("{key} centre"))?,
                radius: scope.positive(radius, &format!("{key} radius"))?,
            })
        }
        Shape::Cylinder { from, to, radius } => {
            only_in(3, "cylinder", "`disc`")?;
            let start = scope.vector(from, &format!("{key} from"))?;
            let end = scope.vector(to, &format!("{key} to"))?;
            if start == end {
                let message = format!("{key} to: must differ from `from`");
                return Err(scope.error(to.span(), message));
            }
            Ok(problem::Shape::Cylinder {
                from: start,
                to: end,
                radius: scope.positive(radius, &format!("{key} radius"))?,
            })
        }
        Shape::Polygon { vertices } => {
            only_in(2, "polygon", "`prism`")?;
            Ok(problem::Shape::Prism {
                base: corners(scope, key, vertices)?,
                bottom: f64::NEG_INFINITY,
                top: f64::INFINITY,
            })
        }
        Shape::Prism {
            vertices,
            bottom,
            top,
        } => {
            only_in(3, "prism", "`polygon`")?;
            let low = scope.number(bottom, &format!("{key} bottom"))?;
            let high = scope.number(top, &format!("{key} top"))?;
            if low >= high {
                let message = format!("{key} top: must be above `bottom`");
                return Err(scope.error(top.span(), message));
            }
            Ok(problem::Shape::Prism {
                base: corners(scope, key, vertices)?,
                bottom: low,
                top: high,
            })
        }
        Shape::Union(parts) => several(scope, key, parts, "union").map(problem::Shape::Union),
        Shape::Difference(parts) => {
            several(scope, key, parts, "difference").map(problem::Shape::Difference)
        }
    }
}

/// Validate the lower and upper corner of a box, m.
///
/// # Errors
/// On an invalid number, or a box without extent.
pub fn corners_of_box(
    scope: &Scope,
    key: &str,
    lower: &Vector,
    upper: &Vector,
) -> Result<[[f64; 3]; 2]> {
    let low = scope.vector(lower, &format!("{key} lower"))?;
    let high = scope.vector(upper, &format!("{key} upper"))?;
    if let Some(k) = (0..scope.dimension).find(|k| low[*k] >= high[*k]) {
        let message = format!(
            "{key} upper: must be above `lower` in every component, but {} is not above {}",
            format_number(high[k]),
            format_number(low[k])
        );
        return Err(scope.error(upper.get_ref()[k].span(), message));
    }
    Ok([low, high])
}

fn several(
    scope: &Scope,
    key: &str,
    parts: &Spanned<Vec<Spanned<grammar::Shape>>>,
    name: &str,
) -> Result<Vec<problem::Shape>> {
    if parts.get_ref().len() < 2 {
        let message = format!("{key} {name}: needs at least two shapes");
        return Err(scope.error(parts.span(), message));
    }
    parts
        .get_ref()
        .iter()
        .map(|part| shape(scope, &format!("{key} {name}"), part))
        .collect()
}

fn corners(scope: &Scope, key: &str, vertices: &Spanned<Vec<Vector>>) -> Result<Polygon> {
    let key = format!("{key} vertices");
    if vertices.get_ref().len() < 3 {
        let message = format!("{key}: needs at least three corners");
        return Err(scope.error(vertices.span(), message));
    }
    let corner = |vertex: &Vector| match &vertex.get_ref()[..] {
        [x, y] => Ok([scope.number(x, &key)?, scope.number(y, &key)?]),
        _ => Err(scope.error(vertex.span(), format!("{key}: a corner must be [x, y]"))),
    };
    let corners = vertices.get_ref().iter().map(corner);
    Ok(Polygon::new(corners.collect::<Result<_>>()?))
}

/// Validate a pre-crack.
///
/// # Errors
/// On a crack for another dimension, a crack without extent, or an invalid number.
pub fn crack(
    scope: &Scope,
    name: &str,
    crack: &Spanned<grammar::Crack>,
) -> Result<problem::PreCrack> {
    Ok(problem::PreCrack {
        name: name.to_owned(),
        span: crack.span(),
        surface: surface(scope, name, crack)?,
    })
}

fn surface(scope: &Scope, name: &str, crack: &Spanned<grammar::Crack>) -> Result<problem::Crack> {
    use grammar::Crack;
    let (kind, dimension) = match crack.get_ref() {
        Crack::Segment { .. } => ("segment", 2),
        Crack::Rectangle { .. } => ("rectangle", 3),
        Crack::Disc { .. } => ("disc", 3),
    };
    let key = format!("[crack.{name}.{kind}]");
    if dimension != scope.dimension {
        let message = format!(
            "{key}: is for {dimension}-D problems, this one is {}-D",
            scope.dimension
        );
        return Err(scope.error(crack.span(), message));
    }
    let width_of = |width: &Option<Number>| match width {
        None => Ok(0.0),
        Some(number) => scope.within(
            number,
            &format!("{key} width"),
            0.0..f64::INFINITY,
            "at least 0",
        ),
    };
    match crack.get_ref() {
        Crack::Segment { from, to, width } => {
            let start = scope.vector(from, &format!("{key} from"))?;
            let end = scope.vector(to, &format!("{key} to"))?;
            if start == end {
                let message = format!("{key} to: must differ from `from`");
                return Err(scope.error(to.span(), message));
            }
            Ok(problem::Crack::Segment {
                from: start,
                to: end,
                width: width_of(width)?,
            })
        }
        Crack::Rectangle {
            corner,
            edge_a,
            edge_b,
            width,
        } => {
            let corner = scope.vector(corner, &format!("{key} corner"))?;
            let a = scope.vector(edge_a, &format!("{key} edge_a"))?;
            let b = scope.vector(edge_b, &format!("{key} edge_b"))?;
            if Vector3::from(a).cross(&Vector3::from(b)) == Vector3::zeros() {
                let message = format!("{key} edge_b: must be neither 0 nor along `edge_a`");
                return Err(scope.error(edge_b.span(), message));
            }
            Ok(problem::Crack::Rectangle {
                corner,
                edge_a: a,
                edge_b: b,
                width: width_of(width)?,
            })
        }
        Crack::Disc {
            centre,
            normal,
            radius,
            width,
        } => Ok(problem::Crack::Disc {
            centre: scope.vector(centre, &format!("{key} centre"))?,
            normal: scope.direction(normal, &format!("{key} normal"))?,
            radius: scope.positive(radius, &format!("{key} radius"))?,
            width: width_of(width)?,
        }),
    }
}
