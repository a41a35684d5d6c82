//! Types of elements: corners, dimension and node order of each type.
//!
//! In this module, all types have the node order of VTK. Each node after the corners is described by the
//! corners between which it lies. A node on an edge lies between two corners, a node on a face between three
//! or four, and a node at the element's centre between all corners. The node order of another format is a
//! list of such descriptions. The list can be compared with the manual of that format.

/// The shape of an element, without its polynomial order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Form {
    /// A node.
    Point,
    /// A straight or curved line.
    Line,
    /// A triangle.
    Triangle,
    /// A quadrilateral.
    Quadrilateral,
    /// A tetrahedron.
    Tetrahedron,
    /// A hexahedron.
    Hexahedron,
    /// A wedge, or triangular prism.
    Wedge,
    /// A pyramid with a quadrilateral base.
    Pyramid,
}

/// A type of element: its form and its number of nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Kind {
    /// Shape of the element.
    pub form: Form,
    /// Number of nodes.
    pub nodes: usize,
}

use Form::{Hexahedron, Line, Point, Pyramid, Quadrilateral, Tetrahedron, Triangle, Wedge};

/// All supported types.
pub const KINDS: [Kind; 19] = [
    Kind::new(Point, 1),
    Kind::new(Line, 2),
    Kind::new(Line, 3),
    Kind::new(Triangle, 3),
    Kind::new(Triangle, 6),
    Kind::new(Quadrilateral, 4),
    Kind::new(Quadrilateral, 8),
    Kind::new(Quadrilateral, 9),
    Kind::new(Tetrahedron, 4),
    Kind::new(Tetrahedron, 10),
    Kind::new(Hexahedron, 8),
    Kind::new(Hexahedron, 20),
    Kind::new(Hexahedron, 27),
    Kind::new(Wedge, 6),
    Kind::new(Wedge, 15),
    Kind::new(Wedge, 18),
    Kind::new(Pyramid, 5),
    Kind::new(Pyramid, 13),
    Kind::new(Pyramid, 14),
];

/// Indices of the corners between which a node lies.
pub type Between = &'static [usize];

impl Kind {
    /// Create a type; only the types in [`KINDS`] are supported.
    pub const fn new(form: Form, nodes: usize) -> Self {
        Self { form, nodes }
    }

    /// Return the index of the type in [`KINDS`].
    ///
    /// # Panics
    /// If the type is not in [`KINDS`].
    pub fn index(self) -> usize {
        let found = KINDS.iter().position(|kind| *kind == self);
        found.expect("elements have a type of the list")
    }

    /// Return the number of dimensions of the element: 0 for a point, 3 for a solid.
    pub fn dimension(self) -> usize {
        match self.form {
            Point => 0,
            Line => 1,
            Triangle | Quadrilateral => 2,
            Tetrahedron | Hexahedron | Wedge | Pyramid => 3,
        }
    }

    /// Return the number of corners. The corners are the first nodes of the element.
    pub fn corners(self) -> usize {
        match self.form {
            Point => 1,
            Line => 2,
            Triangle => 3,
            Quadrilateral | Tetrahedron => 4,
            Pyramid => 5,
            Wedge => 6,
            Hexahedron => 8,
        }
    }

    /// For each node that is not a corner, return the corners between which this node lies. These nodes
    /// follow the corners in the order of the nodes.
    pub fn between(self) -> &'static [Between] {
        let all: &[Between] = match self.form {
            Point => &[],
            Line => &[&[0, 1]],
            Triangle => &[&[0, 1], &[1, 2], &[2, 0]],
            Quadrilateral => &[&[0, 1], &[1, 2], &[2, 3], &[3, 0], &[0, 1, 2, 3]],
            Tetrahedron => &[&[0, 1], &[1, 2], &[0, 2], &[0, 3], &[1, 3], &[2, 3]],
            Hexahedron => &[
                &[0, 1],
                &[1, 2],
                &[2, 3],
                &[3, 0],
                &[4, 5],
                &[5, 6],
                &[6, 7],
                &[7, 4],
                &[0, 4],
                &[1, 5],
                &[2, 6],
                &[3, 7],
                &[0, 3, 4, 7],
                &[1, 2, 5, 6],
                &[0, 1, 4, 5],
                &[2, 3, 6, 7],
                &[0, 1, 2, 3],
                &[4, 5, 6, 7],
                &[0, 1, 2, 3, 4, 5, 6, 7],
            ],
            Wedge => &[
                &[0, 1],
                &[1, 2],
                &[2, 0],
                &[3, 4],
                &[4, 5],
                &[5, 3],
                &[0, 3],
                &[1, 4],
                &[2, 5],
                &[0, 1, 3, 4],
                &[1, 2, 4, 5],
                &[0, 2, 3, 5],
            ],
            Pyramid => &[
                &[0, 1],
                &[1, 2],
                &[2, 3],
                &[3, 0],
                &[0, 4],
                &[1, 4],
                &[2, 4],
                &[3, 4],
                &[0, 1, 2, 3],
            ],
        };
        &all[..self.nodes - self.corners()]
    }

    /// Return, for each node in VTK's order, its position in another order. Both orders begin with the same
    /// corners. `other` lists the remaining nodes of the other order, in the form of [`Self::between`].
    ///
    /// # Panics
    /// If `other` lacks a node.
    pub fn permutation(self, other: &[Between]) -> Vec<usize> {
        let same = |a: &[usize], b: &[usize]| a.len() == b.len() && a.iter().all(|k| b.contains(k));
        let position = |node: &Between| {
            let found = other.iter().position(|candidate| same(candidate, node));
            self.corners() + found.expect("both orders list the same nodes")
        };
        let others = self.between().iter().map(position);
        (0..self.corners()).chain(others).collect()
    }

    /// Return the name of the form, for messages.
    pub fn name(self) -> &'static str {
        match self.form {
            Point => "point",
            Line => "line",
            Triangle => "triangle",
            Quadrilateral => "quadrilateral",
            Tetrahedron => "tetrahedron",
            Hexahedron => "hexahedron",
            Wedge => "wedge",
            Pyramid => "pyramid",
        }
    }
}
