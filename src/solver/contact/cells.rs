//! Cells of present positions, for the contact search. Points are sorted by the hashes of their cells, so the
//! memory does not depend on the extent of the positions.

/// Integer coordinates of a cell; 0 beyond the dimension.
pub type Cell = [i64; 3];

/// Return the cell that contains a position (m). `edge` is the edge length of the cells, m.
pub fn cell_of(position: [f64; 3], edge: f64) -> Cell {
    position.map(|x| (x / edge).floor() as i64)
}

/// Return the hash of a cell. It determines the rank and the bucket of the cell.
pub fn hash(cell: Cell) -> u64 {
    cell.into_iter().fold(0_u64, |hash, k| {
        let mixed = (hash ^ k as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        mixed ^ mixed >> 29
    })
}

/// The cell and its adjacent cells.
pub(super) fn neighbourhood(cell: Cell, dimension: usize) -> impl Iterator<Item = Cell> {
    (0..3_usize.pow(dimension as u32)).map(move |k| {
        let shift = [k % 3, k / 3 % 3, k / 9].map(|shift| shift as i64 - 1);
        std::array::from_fn(|d| {
            if d < dimension {
                cell[d].wrapping_add(shift[d])
            } else {
                cell[d]
            }
        })
    })
}

/// Positions sorted into hashed cells.
pub(super) struct Cells {
    edge: f64,
    dimension: usize,
    /// Index in `entries` of the first point of each bucket; the last element is the number of points. A
    /// bucket contains the points of all cells whose hashes have the same lowest bits.
    starts: Vec<u32>,
    /// Cell and index of each point.
    entries: Vec<(Cell, u32)>,
}

impl Cells {
    /// Sort positions (m) into cells with the edge length `edge` (m).
    pub fn new(positions: &[[f64; 3]], edge: f64, dimension: usize) -> Self {
        let buckets = positions.len().next_power_of_two();
        let mut starts = vec![0_u32; buckets + 1];
        let cells: Vec<Cell> = positions
            .iter()
            .map(|position| cell_of(*position, edge))
            .collect();
        let bucket = |cell: Cell| (hash(cell) as usize) & (buckets - 1);
        for cell in &cells {
            starts[bucket(*cell) + 1] += 1;
        }
        for k in 1..starts.len() {
            starts[k] += starts[k - 1];
        }
        let mut next = starts.clone();
        let mut entries = vec![([0; 3], 0); positions.len()];
        for (index, cell) in cells.into_iter().enumerate() {
            let slot = &mut next[bucket(cell)];
            entries[*slot as usize] = (cell, index as u32);
            *slot += 1;
        }
        Self {
            edge,
            dimension,
            starts,
            entries,
        }
    }

    /// Call `visit` with the index of every point in the cell of a position (m) and in the adjacent cells.
    /// The visited points include all points whose distance from the position is at most the edge of a cell.
    pub fn near(&self, position: [f64; 3], mut visit: impl FnMut(usize)) {
        let mask = self.starts.len() - 2;
        for cell in neighbourhood(cell_of(position, self.edge), self.dimension) {
            let bucket = (hash(cell) as usize) & mask;
            let entries = self.starts[bucket] as usize..self.starts[bucket + 1] as usize;
            for (other, index) in &self.entries[entries] {
                if *other == cell {
                    visit(*index as usize);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_points_within_an_edge_are_found_however_far_others_are() {
        let mut positions: Vec<[f64; 3]> = (0..500)
            .map(|k| {
                let k = f64::from(k);
                [
                    (7.3 * k) % 10.0 - 5.0,
                    (3.7 * k) % 9.0 - 4.5,
                    (1.3 * k) % 8.0,
                ]
            })
            .collect();
        positions.push([1e30, -1e200, 0.0]);
        let cells = Cells::new(&positions, 1.5, 3);
        for position in &positions {
            let mut found = Vec::new();
            cells.near(*position, |index| found.push(index));
            found.sort_unstable();
            assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "found once");
            for (index, other) in positions.iter().enumerate() {
                let square: f64 = (0..3).map(|d| (position[d] - other[d]).powi(2)).sum();
                assert!(square > 1.5 * 1.5 || found.contains(&index));
            }
        }
    }
}
