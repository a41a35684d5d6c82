//! Number of rigid motions that the supports of a piece leave free.
//!
//! A support prescribes a component u_d of the displacement of a point. In a small rigid motion of the piece,
//! u_d is a linear function of D translations and, in 2-D and 3-D, of the angles of rotation. Translations
//! and angles are the unknowns. Each prescribed component gives one row of coefficients of the unknowns. The
//! number of free motions is the number of unknowns minus the rank of these rows.

use crate::comm::ExactSum;
use crate::comm::sum::reduce;
use crate::solver::Simulation;

use super::banded::Banded;
use super::held::PLANES;
use super::pieces::Piece;

impl<const D: usize> Simulation<'_, D> {
    /// Describe a loaded or supported piece whose supports leave rigid motions free; `None` if there is no
    /// such piece. Of several pieces, describe the one with the smallest point id. Collective.
    pub(super) fn describe_free_motions(&mut self) -> Option<String> {
        let pieces = self.find_pieces(self.unloaded_points());
        let is_free = self.conditions.free_components(self.model.volume.len());
        let is_suspect = |point: usize| {
            let is_used =
                |d: usize| pieces.is_free[d][point] == 0.0 || pieces.is_unloaded[d][point] == 0.0;
            (0..D).any(is_used)
        };
        self.first_of_pieces(&pieces, is_suspect, |piece| {
            let free = self.count_free_motions(&piece, &is_free);
            (free > 0).then(|| {
                let [body, size] = self.describe_piece(&piece);
                format!(
                    "The supports leave {free} of {} rigid motions of a piece of body `{body}` free; `static` may \
                     find no equilibrium if loads compress such a piece. {size}. Prescribe displacements that \
                     prevent these translations and rotations, or use `method = \"relaxation\"`",
                    motions(D)
                )
            })
        })
    }

    /// Return the number of rigid motions that the supports of a piece leave free. The motions are small
    /// displacements from the reference positions. `is_free[d][point]` is 0 if a support prescribes the
    /// displacement component d of the point, otherwise 1. Collective.
    fn count_free_motions(&self, piece: &Piece, is_free: &[Vec<f64>; D]) -> usize {
        let position = |point: &usize| self.model.position(*point);
        // The largest coordinates, then the smallest coordinates with the opposite sign.
        let mut bounds = [f64::NEG_INFINITY; 6];
        for position in piece.points.iter().map(position) {
            for d in 0..3 {
                bounds[d] = bounds[d].max(position[d]);
                bounds[3 + d] = bounds[3 + d].max(-position[d]);
            }
        }
        self.comm.max(&mut bounds);
        let size = (0..D)
            .map(|d| bounds[d] + bounds[3 + d])
            .fold(0.0, f64::max);
        let size = if size > 0.0 { size } else { 1.0 };
        let none = vec![ExactSum::ZERO; motions(D) * motions(D)];
        let (mut possible, mut prescribed) = (none.clone(), none);
        for point in &piece.points {
            // The entries of an arm are between 1 and 2, so that none of them is round-off.
            let position = position(point);
            let arm = std::array::from_fn(|d| (position[d] + bounds[3 + d]) / size + 1.0);
            for d in 0..D {
                let row = coefficients::<D>(arm, d);
                add_products(&mut possible, &row);
                if is_free[d][*point] == 0.0 {
                    add_products(&mut prescribed, &row);
                }
            }
        }
        // A single point cannot rotate, and a straight row of points cannot rotate about itself.
        let [possible, prescribed] = [&mut possible, &mut prescribed]
            .map(|products| rank(motions(D), &reduce(self.comm, products)));
        // The round-off of `possible` is larger, because it contains more rows, so its rank may be too small.
        possible.saturating_sub(prescribed)
    }
}

/// Return the number of rigid motions: translations and rotations.
const fn motions(dimension: usize) -> usize {
    dimension * (dimension + 1) / 2
}

/// Return the coefficients of the displacement component `d`: D for the translations, then one for each
/// rotation. `arm` is the position of the point relative to the centre of the rotations.
fn coefficients<const D: usize>(arm: [f64; 3], d: usize) -> Vec<f64> {
    let translations = (0..D).map(|k| f64::from(u8::from(k == d)));
    let planes = PLANES.iter().filter(|plane| plane.iter().all(|k| *k < D));
    let rotations = planes.map(|[a, b]| {
        if d == *a {
            -arm[*b]
        } else if d == *b {
            arm[*a]
        } else {
            0.0
        }
    });
    translations.chain(rotations).collect()
}

/// Add the products of all pairs of coefficients to a matrix, which is stored by rows.
fn add_products(matrix: &mut [ExactSum], row: &[f64]) {
    for (sums, a) in matrix.chunks_exact_mut(row.len()).zip(row) {
        sums.iter_mut().zip(row).for_each(|(sum, b)| sum.add(a * b));
    }
}

/// Return the rank of a symmetric, positive semidefinite matrix of this size, which is stored by rows.
fn rank(size: usize, matrix: &[f64]) -> usize {
    let mut factor = Banded::zero(size, size - 1);
    for row in 0..size {
        (0..=row).for_each(|column| factor.add(row, column, matrix[row * size + column]));
    }
    factor.factor();
    factor.rank()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;

    /// Return the rank of the prescribed components, each given by a position and a component.
    fn rank_of<const D: usize>(prescribed: &[([f64; 3], usize)]) -> usize {
        let mut products = vec![ExactSum::ZERO; motions(D) * motions(D)];
        for (arm, d) in prescribed {
            add_products(&mut products, &coefficients::<D>(*arm, *d));
        }
        rank(motions(D), &reduce(&threads::alone(), &mut products))
    }

    #[test]
    fn supports_that_prevent_rigid_motions() {
        assert_eq!(rank_of::<1>(&[([1.0; 3], 0)]), 1);
        let [a, b, c] = [[1.0, 1.0, 1.0], [2.0, 1.0, 1.0], [1.0, 1.7, 1.3]];
        assert_eq!(rank_of::<2>(&[]), 0);
        assert_eq!(rank_of::<2>(&[(a, 0), (a, 1)]), 2);
        // A pin and a roller. The direction of the roller must not pass through the pin.
        assert_eq!(rank_of::<2>(&[(a, 0), (a, 1), (b, 1)]), 3);
        assert_eq!(rank_of::<2>(&[(a, 0), (a, 1), (b, 0)]), 2);
        // A fixed axis leaves the rotation about the axis.
        let axis = [(a, 0), (a, 1), (a, 2), (b, 0), (b, 1), (b, 2)];
        assert_eq!(rank_of::<3>(&axis), 5);
        assert_eq!(rank_of::<3>(&[&axis[..], &[(c, 2)]].concat()), 6);
    }
}
