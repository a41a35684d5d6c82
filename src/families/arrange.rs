//! The order of a rank's points: the points of a lane group get consecutive local indices.

use rayon::prelude::*;

use crate::lanes::WIDTH;
use crate::partition::Domain;

use super::grid::GridFrame;

/// Width of a tile in y and in z, as a number of lines of grid points along x. A tile contains `TILE` ×
/// `TILE` lines. The points are sorted tile by tile, because the points of a tile and their neighbours fit in
/// the cache.
const TILE: i64 = 8;

/// Local index and sort keys of a grid point.
#[derive(Clone, Copy)]
struct GridPoint {
    cell: [i64; 3],
    index: u32,
    grid: u16,
    border: bool,
}

impl GridPoint {
    fn line(&self) -> (u16, [i64; 3]) {
        let [x, y, z] = self.cell;
        (self.grid, [z, y, x])
    }

    fn order(&self) -> (bool, u16, [i64; 5]) {
        let [x, y, z] = self.cell;
        let tile = [z.div_euclid(TILE), y.div_euclid(TILE)];
        (self.border, self.grid, [tile[0], tile[1], z, y, x])
    }
}

/// Sort the owned points of a domain.
///
/// - Up to eight grid points adjacent along x get consecutive local indices. If one of them is a border
///   point, all of them count as border points.
/// - Interior points come before border points.
/// - The interior points begin with the points that are on no grid, in their previous order; the points of
///   each grid follow. The border points are sorted in the same way.
pub fn arrange(domain: &mut Domain, frames: &[GridFrame]) {
    if frames.is_empty() {
        return;
    }
    let owned = &domain.points[..domain.owned];
    let mut grid_points = Vec::with_capacity(domain.owned);
    let mut order: Vec<u32> = Vec::with_capacity(domain.owned);
    let mut scattered_border = Vec::new();
    for (point, index) in owned.iter().zip(0..) {
        let border = index as usize >= domain.interior;
        let contains = |frame: &GridFrame| frame.blocks[point.block as usize];
        match frames.iter().position(contains) {
            None if border => scattered_border.push(index),
            None => order.push(index),
            Some(grid) => grid_points.push(GridPoint {
                cell: frames[grid].cell(point.position),
                index,
                grid: grid as u16,
                border,
            }),
        }
    }
    grid_points.par_sort_unstable_by_key(GridPoint::line);
    for vector in vectors_mut(&mut grid_points) {
        let border = vector.iter().any(|point| point.border);
        for point in vector {
            point.border = border;
        }
    }
    grid_points.par_sort_unstable_by_key(GridPoint::order);
    let (interior_points, border_points) =
        grid_points.split_at(grid_points.partition_point(|point| !point.border));
    order.extend(interior_points.iter().map(|point| point.index));
    let interior = order.len();
    order.extend(scattered_border);
    order.extend(border_points.iter().map(|point| point.index));
    drop(grid_points);
    domain.reorder(&order, interior);
}

/// Split points into groups of up to eight points that are adjacent along x. The points must be sorted by
/// `GridPoint::line`.
fn vectors_mut(points: &mut [GridPoint]) -> impl Iterator<Item = &mut [GridPoint]> {
    let adjacent = |a: &GridPoint, b: &GridPoint| {
        let (grid, [z, y, x]) = a.line();
        (grid, [z, y, x + 1]) == b.line()
    };
    points
        .chunk_by_mut(adjacent)
        .flat_map(|run| run.chunks_mut(WIDTH))
}
