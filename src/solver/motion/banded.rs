//! Symmetric band matrices and their Cholesky factor.

/// A pivot above this fraction of the diagonal entry in its row is not round-off. The round-off of smaller
/// pivots is estimated.
const CERTAIN: f64 = 1e-4;

/// Estimated round-off of a pivot, divided by ε Σ A_kk x_k². [`Banded::round_off`] defines ε, A and x.
const ROUND_OFF: f64 = 4.0;

/// A symmetric, positive semidefinite band matrix, or its Cholesky factor. The lower half of the band is
/// stored by rows.
#[derive(Debug, Clone, Default)]
pub struct Banded {
    size: usize,
    /// Number of entries of a row left of the diagonal.
    band: usize,
    /// Rows of `band + 1` entries, the diagonal last.
    entries: Vec<f64>,
    /// 1/L_ii of the factor; 0 if the pivot is round-off.
    inverse: Vec<f64>,
    /// Diagonal entries A_ii of the matrix before its factorization.
    diagonal: Vec<f64>,
}

impl Banded {
    /// Create a zero matrix with `size` rows and `band` entries per row left of the diagonal.
    pub fn zero(size: usize, band: usize) -> Self {
        Self {
            size,
            band,
            entries: vec![0.0; size * (band + 1)],
            inverse: vec![0.0; size],
            diagonal: vec![0.0; size],
        }
    }

    /// Set all entries to 0.
    pub fn clear(&mut self) {
        self.entries.fill(0.0);
    }

    /// Add `value` to the entry at `row` and `column` of the lower half.
    ///
    /// # Panics
    /// If the entry is above the diagonal or outside the band.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        assert!(
            column <= row && row - column <= self.band,
            "within the band"
        );
        self.entries[row * (self.band + 1) + self.band + column - row] += value;
    }

    /// Replace the matrix A by its factor L, with L Lᵀ = A. Rows whose pivot is round-off become 0. The
    /// unknowns of these rows are 0 in [`Self::solve`], which then applies a generalized inverse.
    pub fn factor(&mut self) {
        let width = self.band + 1;
        for row in 0..self.size {
            let (above, own) = self.entries.split_at_mut(row * width);
            let own = &mut own[..width];
            let first = row.saturating_sub(self.band);
            let at = |column: usize| self.band + column - row;
            let diagonal = own[self.band];
            self.diagonal[row] = diagonal;
            for column in first..row {
                // The first column in which both rows have entries.
                let from = first.max(column.saturating_sub(self.band));
                let other = &above[column * width..][..width];
                let start = self.band + from - column;
                let known = &other[start..self.band];
                let product = dot(&own[at(from)..at(column)], known);
                own[at(column)] = (own[at(column)] - product) * self.inverse[column];
            }
            let known = &own[at(first)..self.band];
            let pivot = diagonal - dot(known, known);
            let is_certain = pivot > CERTAIN * diagonal;
            if is_certain || pivot > 0.0 && pivot > self.round_off(row) {
                let root = pivot.sqrt();
                self.entries[row * width + self.band] = root;
                self.inverse[row] = 1.0 / root;
            } else {
                self.entries[row * width..][..width].fill(0.0);
                self.inverse[row] = 0.0;
            }
        }
    }

    /// Estimate the round-off of the pivot in a row. The entries of this row to the left of the diagonal must
    /// already be factored.
    ///
    /// The pivot is the smallest value of x·A x over all x with x_row = 1 and x = 0 below the row. In the
    /// following, x is the vector at this minimum. The round-off of the factorization changes A by about ε
    /// A_kk in each row k, with the machine precision ε. It therefore changes the pivot by about ε Σ A_kk
    /// x_k². For the pivot that belongs to the rotation of a free body, x is a rotation about the nodes below
    /// the row. Nodes far from these have large x_k, so the estimate is large and this pivot counts as
    /// round-off.
    fn round_off(&self, row: usize) -> f64 {
        let width = self.band + 1;
        let mut x = vec![0.0; row + 1];
        x[row] = 1.0;
        let mut sum = self.diagonal[row];
        for k in (0..=row).rev() {
            if k < row {
                x[k] *= self.inverse[k];
                sum += self.diagonal[k] * x[k] * x[k];
            }
            let first = k.saturating_sub(self.band);
            let known = &self.entries[k * width..][self.band + first - k..self.band];
            let value = x[k];
            for (x, entry) in x[first..k].iter_mut().zip(known) {
                *x -= entry * value;
            }
        }
        ROUND_OFF * f64::EPSILON * sum
    }

    /// Return the rank of the matrix after [`Self::factor`]: the number of pivots that are not round-off.
    pub fn rank(&self) -> usize {
        self.inverse
            .iter()
            .filter(|inverse| **inverse != 0.0)
            .count()
    }

    /// Solve L Lᵀ x = b after [`Self::factor`]. `values` contains b at the call and x at the return.
    pub fn solve(&self, values: &mut [f64]) {
        let width = self.band + 1;
        for row in 0..self.size {
            let first = row.saturating_sub(self.band);
            let own = &self.entries[row * width..][..width];
            let product = dot(
                &own[self.band + first - row..self.band],
                &values[first..row],
            );
            values[row] = (values[row] - product) * self.inverse[row];
        }
        for row in (0..self.size).rev() {
            let first = row.saturating_sub(self.band);
            let own = &self.entries[row * width..][..width];
            let value = values[row] * self.inverse[row];
            values[row] = value;
            let known = &own[self.band + first - row..self.band];
            for (value_before, entry) in values[first..row].iter_mut().zip(known) {
                *value_before -= entry * value;
            }
        }
    }
}

/// Dot product of two slices of the same length.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Assemble springs that connect each of `count` nodes to the next two nodes. A spring of stiffness
    /// `support` holds the first node.
    fn chain(count: usize, support: f64) -> (Banded, Vec<Vec<f64>>) {
        let mut matrix = Banded::zero(count, 2);
        let mut full = vec![vec![0.0; count]; count];
        let mut add = |row: usize, column: usize, value: f64| {
            full[row][column] += value;
            if row != column {
                full[column][row] += value;
            }
            matrix.add(row, column, value);
        };
        for node in 0..count {
            for next in node + 1..count.min(node + 3) {
                let stiffness = 1.0 + node as f64 / next as f64;
                add(node, node, stiffness);
                add(next, next, stiffness);
                add(next, node, -stiffness);
            }
        }
        add(0, 0, support);
        (matrix, full)
    }

    #[test]
    fn a_chain_of_springs_is_solved() {
        let (mut matrix, full) = chain(9, 0.5);
        let wanted: Vec<f64> = (0..9).map(|k| f64::from(k * k % 7) - 2.0).collect();
        let mut values: Vec<f64> = full.iter().map(|row| dot(row, &wanted)).collect();
        matrix.factor();
        matrix.solve(&mut values);
        for (value, wanted) in values.iter().zip(&wanted) {
            assert!((value - wanted).abs() < 1e-12, "{values:?}");
        }
    }

    /// Assemble the stiffness of a free square of `count`² cells. Springs of stiffness 1 lie along the edges
    /// and the diagonals of each cell.
    fn free_square(count: usize) -> Banded {
        let nodes = count + 1;
        let mut matrix = Banded::zero(2 * nodes * nodes, 2 * nodes + 3);
        let mut spring = |[x1, y1]: [usize; 2], [x2, y2]: [usize; 2]| {
            let (dx, dy) = (x2 as f64 - x1 as f64, y2 as f64 - y1 as f64);
            let n = [dx, dy].map(|d| d / dx.hypot(dy));
            let of = |x: usize, y: usize, d: usize| 2 * (y * nodes + x) + d;
            for a in 0..2 {
                for b in 0..2 {
                    let stiffness = n[a] * n[b];
                    for (row, column, value) in [
                        (of(x1, y1, a), of(x1, y1, b), stiffness),
                        (of(x2, y2, a), of(x2, y2, b), stiffness),
                        (of(x1, y1, a), of(x2, y2, b), -stiffness),
                        (of(x2, y2, a), of(x1, y1, b), -stiffness),
                    ] {
                        if row >= column {
                            matrix.add(row, column, value);
                        }
                    }
                }
            }
        };
        for y in 0..nodes {
            for x in 0..nodes {
                if x < count {
                    spring([x, y], [x + 1, y]);
                }
                if y < count {
                    spring([x, y], [x, y + 1]);
                }
                if x < count && y < count {
                    spring([x, y], [x + 1, y + 1]);
                    spring([x + 1, y], [x, y + 1]);
                }
            }
        }
        matrix
    }

    /// Only the two translations and the rotation have no stiffness.
    #[test]
    fn a_free_square_of_any_size_has_three_singular_rows() {
        for count in [4, 20, 40, 60] {
            let mut matrix = free_square(count);
            matrix.factor();
            assert_eq!(matrix.size - matrix.rank(), 3, "{count}");
        }
    }

    #[test]
    fn a_free_chain_is_solved_up_to_its_rigid_motion() {
        let (mut matrix, full) = chain(9, 0.0);
        let wanted: Vec<f64> = (0..9).map(|k| f64::from(k * k % 7) - 2.0).collect();
        let mut values: Vec<f64> = full.iter().map(|row| dot(row, &wanted)).collect();
        matrix.factor();
        matrix.solve(&mut values);
        for (value, wanted_here) in values.iter().zip(&wanted) {
            let rigid = values[0] - wanted[0];
            assert!((value - rigid - wanted_here).abs() < 1e-12, "{values:?}");
        }
    }
}
