//! Exact volume and centroid of an element; the element becomes a point with this volume at the centroid.
//!
//! The shape functions map the reference element to the element; J is the Jacobian matrix of this map. The
//! volume ∫ det J and the first moments ∫ x det J over the reference element are integrals of polynomials.
//! The Gauss rules of this module are exact for these polynomials.

use std::ops::{Add, Mul, Sub};
use std::sync::LazyLock;

use super::kind::{Form, KINDS, Kind};

/// A value with its derivatives along the three reference coordinates.
#[derive(Debug, Clone, Copy)]
struct Dual {
    value: f64,
    gradient: [f64; 3],
}

impl Dual {
    fn constant(value: f64) -> Self {
        Self {
            value,
            gradient: [0.0; 3],
        }
    }

    /// Return the reference coordinate along `axis`, which has the value `value`. Its derivative is 1 along
    /// `axis` and 0 along the other axes.
    fn coordinate(value: f64, axis: usize) -> Self {
        let mut gradient = [0.0; 3];
        gradient[axis] = 1.0;
        Self { value, gradient }
    }

    fn times(self, other: Self) -> Self {
        let (x, y) = (self.value, other.value);
        self.combine(other, x * y, |a, b| a * y + x * b)
    }

    fn combine(self, other: Self, value: f64, of: impl Fn(f64, f64) -> f64) -> Self {
        Self {
            value,
            gradient: std::array::from_fn(|k| of(self.gradient[k], other.gradient[k])),
        }
    }
}

impl Add for Dual {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        self.combine(other, self.value + other.value, |a, b| a + b)
    }
}

impl Sub for Dual {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self.combine(other, self.value - other.value, |a, b| a - b)
    }
}

impl Mul for Dual {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        self.times(other)
    }
}

impl Mul<Dual> for f64 {
    type Output = Dual;

    fn mul(self, other: Dual) -> Dual {
        Dual::constant(self) * other
    }
}

/// A point of a Gauss rule, with its weight. `functions` contains the value and the gradient of each node's
/// shape function.
struct GaussPoint {
    weight: f64,
    functions: Vec<Dual>,
}

/// The Gauss rules of all types, in the order of [`KINDS`].
static RULES: LazyLock<Vec<Vec<GaussPoint>>> = LazyLock::new(|| KINDS.map(rule).into());

/// Return points and weights of the Gauss rule on [−1, 1] with 1 to 4 points.
fn gauss(points: usize) -> Vec<(f64, f64)> {
    let symmetric = |pairs: &[(f64, f64)]| {
        let mirrored = pairs.iter().rev().map(|(x, weight)| (-x, *weight));
        mirrored.chain(pairs.iter().copied()).collect()
    };
    match points {
        1 => vec![(0.0, 2.0)],
        2 => symmetric(&[((1.0_f64 / 3.0).sqrt(), 1.0)]),
        3 => {
            let x = (0.6_f64).sqrt();
            vec![(-x, 5.0 / 9.0), (0.0, 8.0 / 9.0), (x, 5.0 / 9.0)]
        }
        _ => {
            let root = (6.0_f64 / 5.0).sqrt();
            let near = (3.0 / 7.0 - 2.0 / 7.0 * root).sqrt();
            let far = (3.0 / 7.0 + 2.0 / 7.0 * root).sqrt();
            let share = 30.0_f64.sqrt() / 36.0;
            symmetric(&[(near, 0.5 + share), (far, 0.5 - share)])
        }
    }
}

/// Return the Gauss rule of an element type; empty for a point. The rule is exact for the volume and the
/// first moments of the element.
fn rule(kind: Kind) -> Vec<GaussPoint> {
    let second_order = kind.nodes > kind.corners();
    // A Gauss rule of n points is exact up to the degree 2n − 1 in each coordinate. Collapsing the
    // coordinates raises the degree by up to 2.
    let points = match (kind.form, second_order) {
        (Form::Point, _) => return Vec::new(),
        (Form::Triangle | Form::Tetrahedron, false) => 1,
        (_, false) => 2,
        (Form::Line | Form::Quadrilateral, true) => 3,
        (_, true) => 4,
    };
    // Point and weight on [0, 1], for collapsed coordinates.
    let unit = |(x, weight): (f64, f64)| (0.5 * (1.0 + x), 0.5 * weight);
    let one_axis = gauss(points);
    let mut rule = Vec::new();
    let mut add = |at: [f64; 3], weight: f64| {
        rule.push(GaussPoint {
            weight,
            functions: shape_functions(kind, at),
        });
    };
    match kind.form {
        Form::Triangle if points == 1 => add([1.0 / 3.0, 1.0 / 3.0, 0.0], 0.5),
        Form::Tetrahedron if points == 1 => add([0.25; 3], 1.0 / 6.0),
        _ => {
            let dimension = kind.dimension();
            let count = points.pow(dimension as u32);
            for index in 0..count {
                let axis = |k: u32| one_axis[index / points.pow(k) % points];
                let (at, weight) = match (kind.form, dimension) {
                    (Form::Triangle | Form::Wedge, _) => {
                        let [(r, a), (s, b)] = [axis(0), axis(1)].map(unit);
                        let (t, c) = if dimension == 3 { axis(2) } else { (0.0, 1.0) };
                        ([r, s * (1.0 - r), t], a * b * c * (1.0 - r))
                    }
                    (Form::Tetrahedron, _) => {
                        let [(r, a), (s, b), (t, c)] = [axis(0), axis(1), axis(2)].map(unit);
                        let (rest, layer) = (1.0 - r, (1.0 - r) * (1.0 - s));
                        ([r, s * rest, t * layer], a * b * c * rest * layer)
                    }
                    (Form::Pyramid, _) => {
                        let [(u, a), (v, b)] = [axis(0), axis(1)];
                        let (w, c) = unit(axis(2));
                        ([u, v, w], a * b * c)
                    }
                    (_, 1) => ([axis(0).0, 0.0, 0.0], axis(0).1),
                    (_, 2) => {
                        let [(u, a), (v, b)] = [axis(0), axis(1)];
                        ([u, v, 0.0], a * b)
                    }
                    _ => {
                        let [(u, a), (v, b), (w, c)] = [axis(0), axis(1), axis(2)];
                        ([u, v, w], a * b * c)
                    }
                };
                add(at, weight);
            }
        }
    }
    // det J of a quadrilateral is linear. If the edges cross one another, det J is negative along an edge,
    // but may be positive at all Gauss points. The middles of the edges are therefore added with weight 0.
    if kind == Kind::new(Form::Quadrilateral, 4) {
        for at in [[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]] {
            add([at[0], at[1], 0.0], 0.0);
        }
    }
    rule
}

/// Corners of the square [−1, 1]².
const SQUARE: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// Compute the shape functions of all nodes at a position in the reference element. The reference elements
/// are:
///
/// - Lines, quadrilaterals and hexahedra in D dimensions: [−1, 1]^D.
/// - Triangles and tetrahedra: r, s, t ≥ 0, r + s + t ≤ 1.
/// - Wedges: a triangle × [−1, 1].
/// - Pyramids: collapsed coordinates u, v in [−1, 1] and w in [0, 1]. The cross-section at the
///   height w is the square |ξ|, |η| ≤ 1 − w, where ξ = u (1 − w) and η = v (1 − w).
fn shape_functions(kind: Kind, at: [f64; 3]) -> Vec<Dual> {
    let [x, y, z] = std::array::from_fn(|k| Dual::coordinate(at[k], k));
    let one = Dual::constant(1.0);
    let half = |sign: f64, x: Dual| 0.5 * (one + sign * x);
    let corner = |k: usize| {
        let [a, b] = SQUARE[k % 4];
        let c = if k < 4 { -1.0 } else { 1.0 };
        [a, b, c]
    };
    match kind.form {
        Form::Point => vec![one],
        Form::Line | Form::Quadrilateral | Form::Hexahedron => {
            let axes = &[x, y, z][..kind.dimension()];
            let corner = |k: usize| match kind.form {
                Form::Line => [2.0 * k as f64 - 1.0, 0.0, 0.0],
                _ => corner(k),
            };
            let middle = |between: &[usize]| {
                let sum = |c: usize| between.iter().map(|k| corner(*k)[c]).sum::<f64>();
                std::array::from_fn(|c| sum(c) / between.len() as f64)
            };
            let corners = (0..kind.corners()).map(corner);
            let places = corners.chain(kind.between().iter().map(|nodes| middle(nodes)));
            let linear = kind.nodes == kind.corners();
            let serendipity = matches!(kind.nodes, 8 | 20) && !linear;
            let function = |place: [f64; 3]| {
                let along = axes.iter().zip(place);
                let product = along.map(|(x, node)| match (linear, serendipity, node == 0.0) {
                    (true, ..) | (_, true, false) => half(node, *x),
                    (_, _, true) => one - *x * *x,
                    // Lagrange polynomial of the node at an end of the line.
                    _ => 0.5 * (*x * (*x + Dual::constant(node))),
                });
                let product = product.fold(one, |a, b| a * b);
                if serendipity && place[..axes.len()].iter().all(|node| *node != 0.0) {
                    let mut sum = Dual::constant(1.0 - axes.len() as f64);
                    for (x, node) in axes.iter().zip(place) {
                        sum = sum + node * *x;
                    }
                    return product * sum;
                }
                product
            };
            places.map(function).collect()
        }
        Form::Triangle | Form::Tetrahedron => {
            let axes = &[x, y, z][..kind.dimension()];
            let first = axes.iter().fold(one, |rest, x| rest - *x);
            let weights: Vec<Dual> = std::iter::once(first).chain(axes.iter().copied()).collect();
            quadratic(&weights, kind)
        }
        Form::Wedge => {
            let weights = [one - x - y, x, y];
            let ends = [half(-1.0, z), half(1.0, z)];
            if kind.nodes == 6 {
                let corners = ends
                    .iter()
                    .flat_map(|end| weights.map(|weight| weight * *end));
                return corners.collect();
            }
            let triangle = quadratic(&weights, Kind::new(Form::Triangle, 6));
            let bubble = one - z * z;
            let (corners, edges) = triangle.split_at(3);
            if kind.nodes == 15 {
                let corner = |end: usize| {
                    let pairs = corners.iter().zip(weights);
                    pairs.map(move |(function, weight)| {
                        *function * ends[end] - 0.5 * (weight * bubble)
                    })
                };
                let edge = |end: usize| edges.iter().map(move |function| *function * ends[end]);
                let upright = weights.iter().map(|weight| *weight * bubble);
                let corners = corner(0).chain(corner(1));
                return corners
                    .chain(edge(0))
                    .chain(edge(1))
                    .chain(upright)
                    .collect();
            }
            let ends = [0.5 * (z * (z - one)), 0.5 * (z * (z + one))];
            let times = |functions: &[Dual], end: Dual| -> Vec<Dual> {
                functions.iter().map(|function| *function * end).collect()
            };
            [
                times(corners, ends[0]),
                times(corners, ends[1]),
                times(edges, ends[0]),
                times(edges, ends[1]),
                times(corners, bubble),
                times(edges, bubble),
            ]
            .concat()
        }
        Form::Pyramid => {
            let rest = one - z;
            let base = |k: usize| {
                let [a, b] = SQUARE[k];
                (one + a * x) * (one + b * y)
            };
            if kind.nodes == 5 {
                let corners = (0..4).map(|k| 0.25 * (rest * base(k)));
                return corners.chain([z]).collect();
            }
            let centre = if kind.nodes == 14 {
                rest * rest * (one - x * x) * (one - y * y)
            } else {
                Dual::constant(0.0)
            };
            let corner = |k: usize| {
                let [a, b] = SQUARE[k];
                let sum = rest * (a * x + b * y) - one;
                0.25 * (rest * base(k) * sum + centre)
            };
            let edge = |k: usize| {
                let [[a, b], [c, d]] = [SQUARE[k], SQUARE[(k + 1) % 4]];
                let across = if a == c {
                    (one + a * x) * (one - y * y)
                } else {
                    debug_assert_eq!(b, d);
                    (one - x * x) * (one + b * y)
                };
                0.5 * (rest * rest * across - centre)
            };
            let upright = (0..4).map(|k| z * rest * base(k));
            let apex = z * (2.0 * z - one);
            let corners = (0..4).map(corner).chain([apex]);
            let all = corners.chain((0..4).map(edge)).chain(upright);
            all.chain((kind.nodes == 14).then_some(centre)).collect()
        }
    }
}

/// Compute the linear or quadratic shape functions of a triangle or tetrahedron from the barycentric
/// coordinates `weights` of a position.
fn quadratic(weights: &[Dual], kind: Kind) -> Vec<Dual> {
    if kind.nodes == kind.corners() {
        return weights.to_vec();
    }
    let one = Dual::constant(1.0);
    let corners = weights.iter().map(|weight| *weight * (2.0 * *weight - one));
    let edges = kind
        .between()
        .iter()
        .map(|ends| 4.0 * (weights[ends[0]] * weights[ends[1]]));
    corners.chain(edges).collect()
}

/// Length (m), area (m²) or volume (m³) of an element, and its centroid, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measure {
    /// Signed size of the element. The sign is negative for an inverted element.
    pub size: f64,
    /// Centroid, m.
    pub centroid: [f64; 3],
    /// Smallest and largest det J at the points of the Gauss rule.
    determinants: [f64; 2],
}

/// Values of det J whose absolute value is at most this fraction of the largest |det J| count as round-off.
/// Their sign is ignored.
const ROUND_OFF: f64 = 1e-9;

impl Measure {
    /// Test whether det J has both signs. If so, edges cross one another or a part of the element is
    /// inverted.
    pub fn is_folded(&self) -> bool {
        let [low, high] = self.determinants;
        let limit = ROUND_OFF * low.abs().max(high.abs());
        low < -limit && high > limit
    }
}

/// Compute the measure of a line along x, of a face in the x-y plane, or of a solid. `nodes` are the
/// positions of the nodes, m.
pub fn measure(kind: Kind, nodes: &[[f64; 3]]) -> Measure {
    // Positions are relative to the first node, so that a mesh far from the origin loses no digits.
    let origin = nodes[0];
    let (mut size, mut moments) = (0.0, [0.0; 3]);
    let mut determinants = [f64::INFINITY, f64::NEG_INFINITY];
    for point in &RULES[kind.index()] {
        let mut place = [0.0; 3];
        let mut jacobian = [[0.0; 3]; 3];
        for (function, node) in point.functions.iter().zip(nodes) {
            for c in 0..3 {
                let x = node[c] - origin[c];
                place[c] += function.value * x;
                for k in 0..3 {
                    jacobian[c][k] += function.gradient[k] * x;
                }
            }
        }
        let [a, b, c] = jacobian;
        let determinant = match kind.dimension() {
            1 => a[0],
            2 => a[0] * b[1] - a[1] * b[0],
            _ => {
                a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
                    + a[2] * (b[0] * c[1] - b[1] * c[0])
            }
        };
        determinants = [
            determinants[0].min(determinant),
            determinants[1].max(determinant),
        ];
        size += point.weight * determinant;
        for k in 0..3 {
            moments[k] += point.weight * determinant * place[k];
        }
    }
    Measure {
        size,
        centroid: std::array::from_fn(|k| origin[k] + moments[k] / size),
        determinants,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reference_nodes(kind: Kind) -> Vec<[f64; 3]> {
        let corners: Vec<[f64; 3]> = match kind.form {
            Form::Point => vec![[0.0; 3]],
            Form::Line => vec![[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
            Form::Triangle => vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            Form::Quadrilateral => SQUARE.map(|[a, b]| [a, b, 0.0]).to_vec(),
            Form::Tetrahedron => {
                vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
            }
            Form::Hexahedron => {
                let layer = |c: f64| SQUARE.map(|[a, b]| [a, b, c]);
                [layer(-1.0), layer(1.0)].concat()
            }
            Form::Wedge => {
                let layer = |c: f64| [[0.0, 0.0, c], [1.0, 0.0, c], [0.0, 1.0, c]];
                [layer(-1.0), layer(1.0)].concat()
            }
            Form::Pyramid => {
                let mut corners = SQUARE.map(|[a, b]| [a, b, 0.0]).to_vec();
                corners.push([0.0, 0.0, 1.0]);
                corners
            }
        };
        let middle = |between: &&[usize]| {
            let sum = |k: usize| between.iter().map(|node| corners[*node][k]).sum::<f64>();
            std::array::from_fn(|k| sum(k) / between.len() as f64)
        };
        let others: Vec<[f64; 3]> = kind.between().iter().map(middle).collect();
        [corners, others].concat()
    }

    /// Return the collapsed coordinates of a position in a pyramid, or the position itself for other
    /// elements.
    fn coordinates(kind: Kind, [x, y, z]: [f64; 3]) -> [f64; 3] {
        if kind.form == Form::Pyramid && z < 1.0 {
            return [x / (1.0 - z), y / (1.0 - z), z];
        }
        [x, y, z]
    }

    fn size_of_reference(form: Form) -> f64 {
        match form {
            Form::Point => 0.0,
            Form::Line => 2.0,
            Form::Triangle => 0.5,
            Form::Quadrilateral => 4.0,
            Form::Tetrahedron => 1.0 / 6.0,
            Form::Hexahedron => 8.0,
            Form::Wedge => 1.0,
            Form::Pyramid => 4.0 / 3.0,
        }
    }

    #[test]
    fn shape_functions_interpolate_and_sum_to_one() {
        for kind in KINDS {
            let nodes = reference_nodes(kind);
            assert_eq!(nodes.len(), kind.nodes);
            for (i, node) in nodes.iter().enumerate() {
                for (j, function) in shape_functions(kind, coordinates(kind, *node))
                    .iter()
                    .enumerate()
                {
                    let expected = f64::from(u8::from(i == j));
                    assert!(
                        (function.value - expected).abs() < 1e-14,
                        "{kind:?} {i} {j}: {}",
                        function.value
                    );
                }
            }
            let functions = shape_functions(kind, [0.1, 0.2, 0.3]);
            assert_eq!(functions.len(), kind.nodes);
            let sum: f64 = functions.iter().map(|function| function.value).sum();
            assert!((sum - 1.0).abs() < 1e-14, "{kind:?}: {sum}");
            for k in 0..3 {
                let slope: f64 = functions.iter().map(|function| function.gradient[k]).sum();
                assert!(slope.abs() < 1e-14, "{kind:?}: {slope}");
            }
        }
    }

    /// Apply an affine map in `dimension` dimensions to nodes. Return the mapped nodes, and the determinant
    /// of the map.
    fn mapped(nodes: &[[f64; 3]], dimension: usize) -> (Vec<[f64; 3]>, f64) {
        let rows = [[1.5, 0.3, -0.2], [-0.4, 0.8, 0.5], [0.1, -0.6, 1.2]];
        let det = match dimension {
            1 => 1.5,
            2 => 1.5 * 0.8 + 0.4 * 0.3,
            _ => {
                1.5 * (0.8 * 1.2 + 0.5 * 0.6)
                    - 0.3 * (-0.4 * 1.2 - 0.5 * 0.1)
                    - 0.2 * (0.4 * 0.6 - 0.8 * 0.1)
            }
        };
        let map = |x: &[f64; 3]| {
            let of = |row: [f64; 3]| (0..dimension).map(|k| row[k] * x[k]).sum::<f64>();
            std::array::from_fn(|k| {
                if k < dimension {
                    7.0 + of(rows[k])
                } else {
                    0.0
                }
            })
        };
        (nodes.iter().map(map).collect(), det)
    }

    #[test]
    fn straight_elements_have_the_volume_and_centroid_of_closed_forms() {
        for kind in KINDS.into_iter().filter(|kind| kind.form != Form::Point) {
            let nodes = reference_nodes(kind);
            let (nodes, det) = mapped(&nodes, kind.dimension());
            let measure = measure(kind, &nodes);
            let expected = det * size_of_reference(kind.form);
            assert!((measure.size / expected - 1.0).abs() < 1e-14, "{kind:?}");
            let corners = &nodes[..kind.corners()];
            // The centroid is the mean of the corners, except for a pyramid.
            let mean = |k: usize| corners.iter().map(|x| x[k]).sum::<f64>() / corners.len() as f64;
            for k in 0..3 {
                let expected = if kind.form == Form::Pyramid {
                    let base = nodes[..4].iter().map(|x| x[k]).sum::<f64>() / 4.0;
                    0.75 * base + 0.25 * nodes[4][k]
                } else {
                    mean(k)
                };
                assert!((measure.centroid[k] - expected).abs() < 1e-14, "{kind:?}");
            }
        }
    }

    /// The map x → x + 0.2 y² bends an element and keeps its volume. The centroid moves by 0.2 times the mean
    /// of y².
    #[test]
    fn bent_elements_have_the_volume_and_centroid_of_closed_forms() {
        for kind in KINDS {
            if kind.nodes == kind.corners() || kind.dimension() < 2 {
                continue;
            }
            let mut nodes = reference_nodes(kind);
            for node in &mut nodes {
                node[0] += 0.2 * node[1] * node[1];
            }
            let measure = measure(kind, &nodes);
            let expected = size_of_reference(kind.form);
            assert!((measure.size / expected - 1.0).abs() < 1e-13, "{kind:?}");
            let second_moment = match kind.form {
                Form::Quadrilateral | Form::Hexahedron => 1.0 / 3.0,
                // ∫ y² over the element, divided by its volume.
                Form::Triangle | Form::Wedge => 1.0 / 6.0,
                Form::Tetrahedron => 0.1,
                _ => 0.2,
            };
            let straight = match kind.form {
                Form::Triangle | Form::Wedge => 1.0 / 3.0,
                Form::Tetrahedron => 0.25,
                _ => 0.0,
            };
            let expected = straight + 0.2 * second_moment;
            assert!(
                (measure.centroid[0] - expected).abs() < 1e-13,
                "{kind:?}: {} and {expected}",
                measure.centroid[0]
            );
        }
    }

    #[test]
    fn an_inverted_element_has_a_negative_volume() {
        let kind = Kind::new(Form::Tetrahedron, 4);
        let nodes = [[0.0; 3], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(measure(kind, &nodes).size, -1.0 / 6.0);
    }

    #[test]
    fn crossed_and_partly_inverted_elements_are_folded() {
        let quadrilateral = Kind::new(Form::Quadrilateral, 4);
        let square = reference_nodes(quadrilateral);
        let crossed = [square[0], square[2], square[1], square[3]];
        assert!(measure(quadrilateral, &crossed).is_folded());
        // The edges cross close to a corner.
        let slightly = [[0.0; 3], [1.0, 0.0, 0.0], [0.1, 1.0, 0.0], [0.2, 0.9, 0.0]];
        assert!(measure(quadrilateral, &slightly).is_folded());
        // With two equal nodes, a quadrilateral is a triangle.
        let triangle = [square[0], square[1], square[2], square[2]];
        assert!(!measure(quadrilateral, &triangle).is_folded());
        let tetrahedron = Kind::new(Form::Tetrahedron, 10);
        let mut nodes = reference_nodes(tetrahedron);
        // An edge runs from the origin to (1, 0, 0). Move its middle node far beyond the end of the edge.
        nodes[4][0] = 1.5;
        let folded = measure(tetrahedron, &nodes);
        assert!(folded.is_folded() && folded.size > 0.0, "{folded:?}");
        for kind in KINDS.into_iter().filter(|kind| kind.form != Form::Point) {
            assert!(!measure(kind, &reference_nodes(kind)).is_folded());
        }
    }

    #[test]
    fn a_frustum_as_one_hexahedron_has_its_volume() {
        // Base area A = 2 × 2, top area a = 1 × 1, height h = 3: V = h/3 (A + a + √(A a)) = 7.
        let layer = |half: f64, z: f64| SQUARE.map(|[a, b]| [half * a, half * b, z]);
        let nodes = [layer(1.0, 0.0), layer(0.5, 3.0)].concat();
        let measure = measure(Kind::new(Form::Hexahedron, 8), &nodes);
        assert!((measure.size - 7.0).abs() < 1e-14);
        // Height of the centroid: h/4 (A + 2 √(A a) + 3 a)/(A + √(A a) + a).
        assert!((measure.centroid[2] - 0.75 * 11.0 / 7.0).abs() < 1e-14);
    }
}
