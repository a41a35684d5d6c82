//! Symmetric band matrices and their Cholesky factor.

/// A pivot below this fraction of the diagonal entry in its row is round-off.
const SINGULAR: f64 = 1e-10;

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
}

impl Banded {
    /// Create a zero matrix with `size` rows and `band` entries per row left of the diagonal.
    pub fn zero(size: usize, band: usize) -> Self {
        Self {
            size,
            band,
            entries: vec![0.0; size * (band + 1)],
            inverse: vec![0.0; size],
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
            if pivot > SINGULAR * diagonal {
                let root = pivot.sqrt();
                own[self.band] = root;
                self.inverse[row] = 1.0 / root;
            } else {
                own.fill(0.0);
                self.inverse[row] = 0.0;
            }
        }
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
