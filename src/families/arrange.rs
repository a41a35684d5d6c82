//! The order of a rank's points: points of a grid so that adjacent ones that are worked on together
//! follow one another.

use rayon::prelude::*;

use crate::lanes::WIDTH;
use crate::partition::Domain;

use super::grid::GridFrame;

/// Lines in a tile, in y and in z; the points around a tile stay in the cache while it is worked on.
const TILE: i64 = 8;

/// A point of a grid on its way to its place in the order.
#[derive(Clone, Copy)]
struct Placed {
    cell: [i64; 3],
    index: u32,
    grid: u16,
    border: bool,
}

impl Placed {
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

/// Orders the owned points of a domain. Of those on a grid, up to eight that are adjacent along x get
/// consecutive local indices, all of them counted as border points if any of them is one. Interior
/// points come first; then those on no grid, in the order that they had; then those of each grid.
pub fn arrange(domain: &mut Domain, frames: &[GridFrame]) {
    if frames.is_empty() {
        return;
    }
    let owned = &domain.points[..domain.owned];
    let mut placed = Vec::with_capacity(domain.owned);
    let mut order: Vec<u32> = Vec::with_capacity(domain.owned);
    let mut scattered_border = Vec::new();
    for (point, index) in owned.iter().zip(0..) {
        let border = index as usize >= domain.interior;
        let on = |frame: &GridFrame| frame.blocks[point.block as usize];
        match frames.iter().position(on) {
            None if border => scattered_border.push(index),
            None => order.push(index),
            Some(grid) => placed.push(Placed {
                cell: frames[grid].cell(point.position),
                index,
                grid: grid as u16,
                border,
            }),
        }
    }
    placed.par_sort_unstable_by_key(Placed::line);
    for vector in vectors_mut(&mut placed) {
        let border = vector.iter().any(|point| point.border);
        for point in vector {
            point.border = border;
        }
    }
    placed.par_sort_unstable_by_key(Placed::order);
    let (inner, outer) = placed.split_at(placed.partition_point(|point| !point.border));
    order.extend(inner.iter().map(|point| point.index));
    let interior = order.len();
    order.extend(scattered_border);
    order.extend(outer.iter().map(|point| point.index));
    drop(placed);
    domain.reorder(&order, interior);
}

/// Points in line order by groups of up to eight that are adjacent along x.
fn vectors_mut(points: &mut [Placed]) -> impl Iterator<Item = &mut [Placed]> {
    let adjacent = |a: &Placed, b: &Placed| {
        let (grid, [z, y, x]) = a.line();
        (grid, [z, y, x + 1]) == b.line()
    };
    points
        .chunk_by_mut(adjacent)
        .flat_map(|run| run.chunks_mut(WIDTH))
}
