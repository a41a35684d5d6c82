//! Validation of the bodies of a deck.

use indexmap::IndexMap;

use super::grammar::{self, Deck};
use super::group_name::GroupName;
use super::resolve::{Scope, resolve_each};
use super::shapes;
use super::validate;
use crate::deck::spanned::Spanned;
use crate::error::Result;
use crate::mesh::{Format, GroupKey};
use crate::message::format_number;
use crate::points::{BodyPoints, Columns};
use crate::problem::{self, check::MOST_BODIES};

/// Validate the bodies. `spacing` is the spacing in `[grid]`: the edges of a lattice cell, m.
///
/// # Errors
/// - If the deck has no body or more than 256 bodies.
/// - If a material or a damage law is unknown.
/// - If the material of a body does not support the damage law of the body.
/// - If a number or a shape is invalid.
/// - If a body does not have exactly one source of points.
/// - If a spacing is missing.
/// - If the name of a mesh file has an unknown ending.
/// - If a key does not belong to the source of points.
/// - If two bodies request the same rows or elements of a file.
/// - If two bodies have different `columns` for the same file.
pub fn bodies(
    scope: &Scope,
    deck: &Deck,
    spacing: Option<[f64; 3]>,
    materials: &IndexMap<String, problem::Material>,
    damages: &IndexMap<String, problem::Damage>,
) -> Result<Vec<problem::Body>> {
    are_possible(scope, deck)?;
    resolve_each(&deck.body, |name, table| {
        let body = table.get_ref();
        let key = format!("[body.{name}]");
        let names = materials.keys().map(String::as_str);
        let material = scope.find_used(
            "material",
            &body.material,
            names,
            &format!("{key} material"),
        )?;
        let damage = body
            .damage
            .as_ref()
            .map(|damage| {
                let names = damages.keys().map(String::as_str);
                let key = format!("{key} damage");
                let index = scope.find_used("damage", damage, names, &key)?;
                Ok(damages[index].clone())
            })
            .transpose()?;
        let (horizon, horizon_span) = match &body.horizon {
            None => {
                let number = &deck.grid.get_ref().horizon;
                (scope.length(number, "[grid] horizon")?, number.span())
            }
            Some(number) => {
                let key = format!("{key} horizon");
                (scope.length(number, &key)?, number.span())
            }
        };
        let fault = damage
            .as_ref()
            .and_then(|damage: &problem::Damage| materials[material].law.damage_fault(damage));
        if let (Some(name), Some(fault)) = (&body.damage, fault) {
            return Err(scope.error(name.span(), format!("{key} damage: {fault}")));
        }
        Ok(problem::Body {
            name: name.to_owned(),
            span: table.span(),
            material_name: body.material.get_ref().clone(),
            points: point_source(scope, deck, name, table, spacing, horizon)?,
            material: materials[material].clone(),
            damage,
            horizon,
            horizon_span,
        })
    })
    .map(|bodies| bodies.into_values().collect())
    .and_then(|mut bodies: Vec<problem::Body>| {
        rows_are_taken_once(scope, &BodyPoints::of(&bodies))?;
        if deck.grid.get_ref().origin.is_none() {
            anchor(&mut bodies, scope.dimension);
        }
        Ok(bodies)
    })
}

/// Validate only the source of the points of each body, not the other keys of the body. `spacing` is the
/// spacing in `[grid]`: the edges of a lattice cell, m.
///
/// # Errors
/// On the same errors in the sources of points as [`bodies`], except that spacings are not compared with the
/// horizon.
pub fn point_sources(
    scope: &Scope,
    deck: &Deck,
    spacing: Option<[f64; 3]>,
) -> Result<Vec<problem::PointSource>> {
    are_possible(scope, deck)?;
    let sources = resolve_each(&deck.body, |name, table| {
        point_source(scope, deck, name, table, spacing, f64::INFINITY)
    })?;
    let sources: Vec<_> = sources.into_values().collect();
    rows_are_taken_once(scope, &of_sources(deck, &sources))?;
    Ok(sources)
}

/// Return the name of each body and the source of its points.
pub fn of_sources<'a>(deck: &'a Deck, sources: &'a [problem::PointSource]) -> Vec<BodyPoints<'a>> {
    let bodies = deck.body.iter().zip(sources);
    let own = bodies.map(|((name, table), points)| BodyPoints {
        name,
        span: table.span(),
        points,
    });
    own.collect()
}

/// Return an error if the deck has no body, or more than `MOST_BODIES`.
fn are_possible(scope: &Scope, deck: &Deck) -> Result<()> {
    if deck.body.len() > MOST_BODIES {
        let message = format!(
            "[body]: the deck has {} bodies; {MOST_BODIES} at most, each a block with its own \
             material (a union of shapes is one body)",
            deck.body.len()
        );
        return Err(scope.error(deck.body[MOST_BODIES].span(), message));
    }
    if deck.body.is_empty() {
        let end = scope.source.text.len();
        return Err(scope.error(end..end, "[body]: the deck needs a body"));
    }
    Ok(())
}

/// Set the grid origins of a deck without `origin`. Bodies with the same spacing share an origin, so that
/// their points stay aligned. In each direction, one of these bodies determines the origin: the first body
/// that has two flat faces a whole number of cells apart. If a grid with the origin 0 fills this body
/// exactly, the origin is 0. Otherwise, the origin is the coordinate of the lower face of this body. If no
/// body has two such faces, the origin is 0.
fn anchor(bodies: &mut [problem::Body], dimension: usize) {
    let mut anchors: Vec<([f64; 3], [f64; 3])> = Vec::new();
    for index in 0..bodies.len() {
        let problem::PointSource::Lattice { spacing, .. } = bodies[index].points else {
            continue;
        };
        let known = anchors.iter().find(|(of, _)| *of == spacing);
        let anchor = known.map_or_else(
            || {
                let shapes = || same_cells(bodies, spacing);
                let along =
                    |k: usize| shapes().find_map(|shape| anchor_along(shape, spacing[k], k));
                std::array::from_fn(|k| (k < dimension).then(|| along(k)).flatten().unwrap_or(0.0))
            },
            |(_, anchor)| *anchor,
        );
        anchors.push((spacing, anchor));
        if let problem::PointSource::Lattice { origin, .. } = &mut bodies[index].points {
            *origin = anchor;
        }
    }
}

/// Return the shapes of the bodies whose lattice cells have these edges, m.
fn same_cells(bodies: &[problem::Body], edges: [f64; 3]) -> impl Iterator<Item = &problem::Shape> {
    bodies.iter().filter_map(move |body| match &body.points {
        problem::PointSource::Lattice { shape, spacing, .. } => {
            (*spacing == edges).then_some(shape)
        }
        problem::PointSource::File { .. } | problem::PointSource::Mesh { .. } => None,
    })
}

/// Tolerance for the deviation of a length from a whole number of cells, as a fraction of a cell's edge.
const WHOLE: f64 = 1e-6;

/// Return the origin of a grid along `axis`, m. The cells of this grid, with the edge `edge` (m), fill the
/// shape exactly along this axis. If a grid with the origin 0 fills the shape exactly, the origin is 0.
/// Otherwise, the origin is the coordinate of the lower face of the shape. `None` if the shape does not have
/// two flat faces, or if the distance between the faces is not a whole number of cells.
fn anchor_along(shape: &problem::Shape, edge: f64, axis: usize) -> Option<f64> {
    let [lower, upper] = flat_faces(shape, axis)?;
    let is_whole = |length: f64| {
        let cells = length / edge;
        (cells - cells.round()).abs() < WHOLE
    };
    is_whole(upper - lower).then_some(if is_whole(lower) { 0.0 } else { lower })
}

/// Return the positions of the two faces that bound a shape along an axis, m; `None` if the shape has no flat
/// faces normal to this axis. For a prism or polygon, the positions along x or y are the smallest and the
/// largest coordinate of the corners, even if the sides are slanted. The faces of a union are the lowest and
/// the highest face of its parts. If one of its parts has no flat faces, the union has none. A difference has
/// the faces of its first part.
fn flat_faces(shape: &problem::Shape, axis: usize) -> Option<[f64; 2]> {
    match shape {
        problem::Shape::Box { lower, upper } => Some([lower[axis], upper[axis]]),
        problem::Shape::Prism { bottom, top, .. } if axis == 2 => Some([*bottom, *top]),
        problem::Shape::Prism { base, .. } => {
            let (lower, upper) = base.bounds();
            Some([lower[axis], upper[axis]])
        }
        problem::Shape::Cylinder { from, to, .. } => {
            let is_along = (0..3).all(|k| k == axis || from[k] == to[k]);
            is_along.then_some([from[axis].min(to[axis]), from[axis].max(to[axis])])
        }
        problem::Shape::Ball { .. } => None,
        problem::Shape::Union(parts) => parts
            .iter()
            .map(|part| flat_faces(part, axis))
            .reduce(|a, b| Some([a?[0].min(b?[0]), a?[1].max(b?[1])]))?,
        problem::Shape::Difference(parts) => flat_faces(&parts[0], axis),
    }
}

/// Return an error if rows of a point file or elements of a mesh would belong to two bodies, or if two bodies
/// name different columns of the same file.
fn rows_are_taken_once(scope: &Scope, bodies: &[BodyPoints]) -> Result<()> {
    let rows = |body: &BodyPoints| match body.points {
        problem::PointSource::File {
            path, block, span, ..
        } => {
            let block = block.map(|block| GroupKey::Number(block.into()));
            Some((path.clone(), block, span.clone(), ("file", "rows")))
        }
        problem::PointSource::Mesh {
            path, block, span, ..
        } => Some((
            path.clone(),
            block.clone(),
            span.clone(),
            ("mesh", "elements"),
        )),
        problem::PointSource::Lattice { .. } => None,
    };
    for (index, body) in bodies.iter().enumerate() {
        let Some((path, block, span, (key, what))) = rows(body) else {
            continue;
        };
        let taker = bodies[..index].iter().find(|earlier| {
            rows(earlier).is_some_and(|(other, taken, ..)| {
                other == path && (taken.is_none() || taken == block)
            })
        });
        if let Some(taker) = taker {
            let message = format!(
                "[body.{}] points {key}: [body.{}] already uses these {what}; give each body its own \
                 `block`",
                body.name, taker.name
            );
            return Err(scope.error(span, message));
        }
    }
    columns_agree(scope, bodies)
}

/// Return an error if two bodies with the same point file have different `columns`.
fn columns_agree(scope: &Scope, bodies: &[BodyPoints]) -> Result<()> {
    let file = |body: &BodyPoints| match body.points {
        problem::PointSource::File {
            path,
            columns,
            span,
            ..
        } => Some((path.clone(), columns.clone(), span.clone())),
        _ => None,
    };
    for (index, body) in bodies.iter().enumerate() {
        let Some((path, columns, span)) = file(body) else {
            continue;
        };
        let differs = |other: &&BodyPoints| {
            file(other).is_some_and(|(other, theirs, _)| other == path && theirs != columns)
        };
        if let Some(other) = bodies[..index].iter().find(differs) {
            let message = format!(
                "[body.{}] points columns: differ from those of [body.{}], which has the same file",
                body.name, other.name
            );
            return Err(scope.error(span, message));
        }
    }
    Ok(())
}

/// Validate the source of a body's points. `grid_spacing` (the cell edges of `[grid]`) and `horizon` are in
/// m.
fn point_source(
    scope: &Scope,
    deck: &Deck,
    name: &str,
    table: &Spanned<grammar::Body>,
    grid_spacing: Option<[f64; 3]>,
    horizon: f64,
) -> Result<problem::PointSource> {
    let (body, key) = (table.get_ref(), &format!("[body.{name}]"));
    let given = [
        ("shape", body.shape.as_ref().map(Spanned::span)),
        ("points", body.points.as_ref().map(Spanned::span)),
    ];
    scope.exactly_one(table.span(), key, &given)?;
    match (&body.shape, &body.points) {
        (Some(shape), _) => {
            let grid = deck.grid.get_ref();
            let own = body
                .spacing
                .as_ref()
                .map(|edges| validate::spacing(scope, edges, &format!("{key} spacing"), horizon))
                .transpose()?;
            let Some(spacing) = own.or(grid_spacing) else {
                let message = "[grid]: a body given as a shape needs `spacing` here or in the body";
                return Err(scope.error(deck.grid.span(), message));
            };
            let edges = &spacing[..scope.dimension];
            let longest = edges.iter().copied().fold(0.0, f64::max);
            if let (Some(number), true) = (&body.horizon, longest > horizon) {
                // If the horizon of the grid contains the mean spacing, `horizon::resolve` has stored the
                // value of this horizon in the body, with the byte range of the value in `[grid]`.
                let key = if number.span() == grid.horizon.span() {
                    "[grid]"
                } else {
                    key
                };
                let message = format!(
                    "{key} horizon: {} m is smaller than the spacing of [body.{name}], {} m, so no point would have \
                     a neighbour",
                    format_number(horizon),
                    format_number(longest)
                );
                return Err(scope.error(number.span(), message));
            }
            let origin = match &grid.origin {
                Some(origin) => scope.vector(origin, "[grid] origin")?,
                None => [0.0; 3],
            };
            Ok(problem::PointSource::Lattice {
                shape: shapes::shape(scope, &format!("{key} shape"), shape)?,
                spacing,
                origin,
                quadrature: match body.quadrature.as_ref().map(Spanned::get_ref) {
                    None => grid.quadrature,
                    Some(own) => *own,
                }
                .into(),
            })
        }
        (None, points) => {
            let points = points.as_ref().expect("a body without a shape has points");
            from_file(scope, key, body, points)
        }
    }
}

impl From<grammar::Quadrature> for problem::Quadrature {
    fn from(quadrature: grammar::Quadrature) -> Self {
        match quadrature {
            grammar::Quadrature::Midpoint => Self::Midpoint,
            grammar::Quadrature::Gauss => Self::Gauss,
        }
    }
}

/// Validate the key `points` of a body. The points come from a file or a mesh.
fn from_file(
    scope: &Scope,
    key: &str,
    body: &grammar::Body,
    points: &Spanned<grammar::Points>,
) -> Result<problem::PointSource> {
    let place = points.span();
    let points = points.get_ref();
    let key_of_points = format!("{key} points");
    let given = [
        ("file", points.file.as_ref().map(Spanned::span)),
        ("mesh", points.mesh.as_ref().map(Spanned::span)),
    ];
    scope.exactly_one(place, &key_of_points, &given)?;
    let what = if points.file.is_some() {
        "file"
    } else {
        "mesh"
    };
    if let Some(spacing) = &body.spacing {
        let message = format!("{key} spacing: points from a {what} have no spacing");
        return Err(scope.error(spacing.span(), message));
    }
    if let Some(quadrature) = &body.quadrature {
        let message = format!("{key} quadrature: points from a {what} have no cells");
        return Err(scope.error(quadrature.span(), message));
    }
    let folder = scope.source.path.parent().unwrap_or("".as_ref());
    let block = points.block.as_ref();
    if let (Some(_), Some(columns)) = (&points.mesh, &points.columns) {
        let message = format!("{key_of_points} columns: are for a point file, not for a mesh");
        return Err(scope.error(columns.span(), message));
    }
    if let Some(mesh) = &points.mesh {
        let path = folder.join(mesh.get_ref());
        if Format::of(&path).is_none() {
            let message = format!(
                "{key_of_points} mesh: the name must end with one of {}",
                Format::endings()
            );
            return Err(scope.error(mesh.span(), message));
        }
        let scale = points.scale.as_ref();
        let scale = scale.map(|scale| scope.length(scale, &format!("{key_of_points} scale")));
        return Ok(problem::PointSource::Mesh {
            path,
            block: block.map(|block| block.get_ref().0.clone()),
            scale: scale.transpose()?.unwrap_or(1.0),
            span: mesh.span(),
            block_span: block.map_or(mesh.span(), Spanned::span),
        });
    }
    if let Some(scale) = &points.scale {
        let message = format!("{key_of_points} scale: is for a mesh; a point file is in metres");
        return Err(scope.error(scale.span(), message));
    }
    let file = points.file.as_ref().expect("there is a file or a mesh");
    let number = |block: &Spanned<GroupName>| match &block.get_ref().0 {
        GroupKey::Number(number) if u32::try_from(*number).is_ok() => Ok(*number as u32),
        written => {
            let message = format!(
                "{key_of_points} block: must be a whole number, 0 to {}, is {written}",
                u32::MAX
            );
            Err(scope.error(block.span(), message))
        }
    };
    let columns = points.columns.as_ref().map(|columns| {
        let named = Columns::named(columns.get_ref(), scope.dimension);
        named.map_err(|message| {
            scope.error(
                columns.span(),
                format!("{key_of_points} columns: {message}"),
            )
        })
    });
    Ok(problem::PointSource::File {
        path: folder.join(file.get_ref()),
        block: block.map(number).transpose()?,
        columns: columns.transpose()?,
        span: file.span(),
    })
}
