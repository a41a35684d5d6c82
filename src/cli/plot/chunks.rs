//! Reading of all points of an output, in chunks of consecutive points.

use std::ops;

use fissure::error::Result;
use fissure::output::ResultReader;

/// Maximum number of points that are read at once. It limits the memory that is needed to draw a picture.
const CHUNK: usize = 1 << 18;

/// Largest difference of coordinates that count as equal, as a fraction of the extent of the body.
/// Coordinates that are equal in an exact lattice can differ by round-off.
const SAME_COORDINATE: f64 = 1e-9;

/// A body of n points counts as scattered if its number of combinations exceeds this constant times n^1.5.
/// [`scattered_bodies`] defines the number of combinations.
const MOST_COMBINATIONS: f64 = 4.0;

/// Divide `points` points into ranges of at most [`CHUNK`] points.
pub fn chunks(points: usize) -> impl Iterator<Item = ops::Range<usize>> {
    let chunk = move |first: usize| first..(first + CHUNK).min(points);
    (0..points).step_by(CHUNK).map(chunk)
}

/// Test whether all values of a field are 0 at output `index`.
///
/// # Errors
/// If the result is damaged.
pub fn is_zero(result: &ResultReader, field: &str, index: usize) -> Result<bool> {
    for points in chunks(result.points(index)) {
        let values = result.field_of(field, index, points)?;
        if values.iter().any(|value| *value != 0.0) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// For each body, return whether its points are scattered (not on a lattice) at output `index`. The list is
/// empty if the problem is 1-D or if the result has no outputs.
///
/// The number of combinations of a body is n_x n_y in 2-D and n_x n_y n_z in 3-D. Here n_x, n_y and n_z are
/// the numbers of different x, y and z coordinates of its points. A body of n points is scattered if its
/// number of combinations is above [`MOST_COMBINATIONS`] n^1.5. The number of combinations is about n for a
/// lattice; for scattered points, it is n² in 2-D and n³ in 3-D. In 2-D, 16 points or fewer never count as
/// scattered.
///
/// # Errors
/// If the result is damaged.
pub fn scattered_bodies(
    result: &ResultReader,
    index: usize,
    dimension: usize,
) -> Result<Vec<bool>> {
    if dimension < 2 || result.times()?.is_empty() {
        return Ok(Vec::new());
    }
    // Number of points of each body. The field `block` contains the number of the body.
    let mut points_of: Vec<usize> = Vec::new();
    for points in chunks(result.points(index)) {
        for body in result.field_of("block", index, points)? {
            let body = body as usize;
            points_of.resize(points_of.len().max(body + 1), 0);
            points_of[body] += 1;
        }
    }
    let mut combinations = vec![1.0; points_of.len()];
    for d in 0..dimension {
        // Store the coordinates of one direction at a time, to limit the memory.
        let of_body = points_of.iter().map(|points| Vec::with_capacity(*points));
        let mut along: Vec<Vec<f64>> = of_body.collect();
        for points in chunks(result.points(index)) {
            let bodies = result.field_of("block", index, points.clone())?;
            let positions = result.positions_of(index, points)?;
            for (position, body) in positions.iter().zip(&bodies) {
                along[*body as usize].push(position[d]);
            }
        }
        for (along, combinations) in along.iter_mut().zip(&mut combinations) {
            along.sort_unstable_by(f64::total_cmp);
            let ends = along.first().zip(along.last());
            let tolerance = ends.map_or(0.0, |(first, last)| SAME_COORDINATE * (last - first));
            let steps = along
                .windows(2)
                .filter(|pair| pair[1] - pair[0] > tolerance);
            *combinations *= 1.0 + steps.count() as f64;
        }
    }
    let both = combinations.into_iter().zip(points_of);
    let is_scattered = |(combinations, points): (f64, usize)| {
        points > 0 && combinations > MOST_COMBINATIONS * (points as f64).powf(1.5)
    };
    Ok(both.map(is_scattered).collect())
}
