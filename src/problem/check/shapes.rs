//! Shapes, sets and pre-cracks.

use nalgebra::Vector3;

use super::allowed::{NOT_NEGATIVE, POSITIVE};
use super::{expression, finite, unit_vector, wrong};
use crate::component::AXES;
use crate::error::Result;
use crate::expression::POSITION;
use crate::problem::{Crack, PointSource, Problem, Selector, Shape};

/// Check a shape; `key` is its section and key.
///
/// # Errors
/// On a number that is not finite, a shape without extent, or a shape without parts.
pub fn shape(problem: &Problem, key: &str, shape: &Shape) -> Result<()> {
    let dimension = problem.dimension.count();
    match shape {
        Shape::Box { lower, upper } => corners(dimension, key, (lower, upper)),
        Shape::Ball { centre, radius } => {
            finite(&format!("{key} centre"), centre)?;
            POSITIVE.check(&format!("{key} radius"), *radius)
        }
        Shape::Cylinder { from, to, radius } => {
            finite(&format!("{key} from"), from)?;
            finite(&format!("{key} to"), to)?;
            if from == to {
                return Err(wrong(&format!("{key} to"), "must differ from `from`"));
            }
            POSITIVE.check(&format!("{key} radius"), *radius)
        }
        Shape::Prism { base, bottom, top } => {
            let vertices = base.vertices();
            let of_vertices = format!("{key} vertices");
            if vertices.len() < 3 {
                return Err(wrong(&of_vertices, "needs at least three corners"));
            }
            finite(&of_vertices, vertices.as_flattened())?;
            if dimension == 2 {
                return Ok(());
            }
            finite(&format!("{key} bottom"), &[*bottom])?;
            finite(&format!("{key} top"), &[*top])?;
            if bottom >= top {
                return Err(wrong(&format!("{key} top"), "must be above `bottom`"));
            }
            Ok(())
        }
        Shape::Union(parts) => several(problem, &format!("{key} union"), parts),
        Shape::Difference(parts) => several(problem, &format!("{key} difference"), parts),
    }
}

fn several(problem: &Problem, key: &str, parts: &[Shape]) -> Result<()> {
    if parts.is_empty() {
        return Err(wrong(key, "needs at least one shape"));
    }
    parts.iter().try_for_each(|part| shape(problem, key, part))
}

/// Check the lower and the upper corner of a box in a problem of this dimension.
///
/// # Errors
/// On a number that is not finite, or a box without extent.
pub fn corners(dimension: usize, key: &str, (lower, upper): (&[f64; 3], &[f64; 3])) -> Result<()> {
    finite(&format!("{key} lower"), &lower[..dimension])?;
    finite(&format!("{key} upper"), &upper[..dimension])?;
    match (0..dimension).find(|k| lower[*k] >= upper[*k]) {
        None => Ok(()),
        Some(k) => Err(wrong(
            &format!("{key} upper"),
            format!(
                "must be above `lower` in every component, but {} {} is not above {}",
                AXES[k], upper[k], lower[k]
            ),
        )),
    }
}

/// Check the sets.
///
/// # Errors
/// If a set refers to a missing body, or its rule is invalid.
pub fn sets(problem: &Problem) -> Result<()> {
    for set in &problem.sets {
        let section = format!("[set.{}]", set.name);
        match &set.selector {
            Selector::All => {}
            Selector::Body(body) => {
                let count = problem.bodies.len();
                if *body >= count {
                    let fault = format!("must be the index of a body, below {count}, is {body}");
                    return Err(wrong(&section, fault));
                }
            }
            Selector::Where(condition) => {
                expression(&format!("{section} where"), condition, &POSITION)?;
            }
            Selector::Within(region) => shape(problem, &format!("{section} shape"), region)?,
            Selector::Ids { ids, .. } => {
                if !ids.is_sorted() {
                    let fault = "must be in ascending order";
                    return Err(wrong(&format!("{section} ids"), fault));
                }
            }
            Selector::Mesh(_) => {
                let mut bodies = problem.bodies.iter();
                if !bodies.any(|body| matches!(body.points, PointSource::Mesh { .. })) {
                    let fault = "no body has its points from a mesh";
                    return Err(wrong(&format!("{section} mesh"), fault));
                }
            }
        }
    }
    Ok(())
}

/// Check the pre-cracks.
///
/// # Errors
/// On a crack for another dimension, a crack without extent, or a number that is not allowed.
pub fn cracks(problem: &Problem) -> Result<()> {
    for crack in &problem.cracks {
        surface(problem.dimension.count(), &crack.name, &crack.surface)?;
    }
    Ok(())
}

fn surface(dimension: usize, name: &str, surface: &Crack) -> Result<()> {
    let (kind, own) = match surface {
        Crack::Segment { .. } => ("segment", 2),
        Crack::Rectangle { .. } => ("rectangle", 3),
        Crack::Disc { .. } => ("disc", 3),
    };
    let section = format!("[crack.{name}.{kind}]");
    let key = |name: &str| format!("{section} {name}");
    if own != dimension {
        let fault = format!("is for {own}-D problems, this one is {dimension}-D");
        return Err(wrong(&section, fault));
    }
    let width = match surface {
        Crack::Segment { from, to, width } => {
            finite(&key("from"), from)?;
            finite(&key("to"), to)?;
            if from[..2] == to[..2] {
                return Err(wrong(&key("to"), "must differ from `from`"));
            }
            width
        }
        Crack::Rectangle {
            corner,
            edge_a,
            edge_b,
            width,
        } => {
            finite(&key("corner"), corner)?;
            finite(&key("edge_a"), edge_a)?;
            finite(&key("edge_b"), edge_b)?;
            let normal = Vector3::from(*edge_a).cross(&Vector3::from(*edge_b));
            if normal == Vector3::zeros() {
                return Err(wrong(
                    &key("edge_b"),
                    "must be neither 0 nor along `edge_a`",
                ));
            }
            width
        }
        Crack::Disc {
            centre,
            normal,
            radius,
            width,
        } => {
            finite(&key("centre"), centre)?;
            unit_vector(&key("normal"), *normal)?;
            POSITIVE.check(&key("radius"), *radius)?;
            width
        }
    };
    NOT_NEGATIVE.check(&key("width"), *width)
}
