//! Edge of a crack in 3-D: damaged points that have damaged points on one side only.

use nalgebra::{Matrix3, SymmetricEigen, Vector3};

type Vector = Vector3<f64>;

/// Threshold of the distance d of a damaged point, in horizons. d is measured in the plane of the crack, from
/// the mean position of the damaged points around the point to the mean position of the point's family. A
/// point can be on the front only if its d exceeds the threshold. d is 0.4 on a straight front, and 0.05 at
/// an edge of the body.
const ONE_SIDED: f64 = 0.2;

/// Cosine of 45°, the half angle of the cone ahead of a point of the front. The cone contains no damaged
/// point.
const CONE: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Sine of 14.5°, the largest angle between the plane of the crack and the bond to an undamaged point ahead.
const IN_PLANE: f64 = 0.25;

/// Edge of the damaged region at a damaged point.
pub struct Edge {
    /// Vector from the point to the mid-plane of the crack, m.
    pub to_middle: Vector,
    /// Unit vector in the plane of the crack. The vector points away from the damaged points.
    ahead: Vector,
    /// Unit normal of the crack.
    normal: Vector,
}

impl Edge {
    /// Return the edge of the damaged region at a damaged point. `None` if the point is inside the region, if
    /// the point is at an edge of the body, or if no other damaged points are around it.
    ///
    /// `bonds` are the vectors (m) from the point to the damaged points around it. For a point, let g be the
    /// result of [`Moments::gradient`](crate::solver::bonds::Moments::gradient). `normals` is the sum of
    /// g ⊗ g over the point and the damaged points around it, 1/m². `mean` is the result of
    /// [`Moments::mean`](crate::solver::bonds::Moments::mean) for the point, m. `radius` is the radius of the
    /// family, m.
    ///
    /// The point is at the edge if two conditions are met. The damaged points lie on one side of the point's
    /// family (see `ONE_SIDED`). The cone ahead of the point contains no damaged point (see `CONE`).
    pub fn find(
        radius: f64,
        bonds: &[Vector],
        normals: Matrix3<f64>,
        mean: Vector,
    ) -> Option<Self> {
        if bonds.is_empty() {
            return None;
        }
        let count = bonds.len() as f64;
        let middle = bonds.iter().sum::<Vector>() / count;
        let normals = SymmetricEigen::new(normals);
        let normal = normals.eigenvectors.column(normals.eigenvalues.imax());
        let normal: Vector = normal.into_owned();
        let ahead = mean - middle;
        let ahead = ahead - ahead.dot(&normal) * normal;
        let length = ahead.norm();
        if length <= ONE_SIDED * radius {
            return None;
        }
        let edge = Self {
            to_middle: middle.dot(&normal) * normal,
            ahead: ahead / length,
            normal,
        };
        let is_free = !bonds.iter().any(|bond| edge.is_in_cone(bond));
        is_free.then_some(edge)
    }

    fn is_in_cone(&self, bond: &Vector) -> bool {
        bond.dot(&self.ahead) > CONE * bond.norm()
    }

    /// Whether a bond lies in the cone ahead and is close to the plane of the crack.
    pub fn is_ahead(&self, bond: &Vector) -> bool {
        self.is_in_cone(bond) && bond.dot(&self.normal).abs() <= IN_PLANE * bond.norm()
    }
}
