//! The lengths that points cover in contacts.

use rustc_hash::FxHashSet;

use crate::problem::{Block, PointSource, Problem, Quadrature};
use crate::solver::model::Model;

/// Return the length (m) that each owned point covers: two points with the covers a and b touch at the
/// distance (a + b)/2, and a point touches the surface of a rigid body at the distance a/2. `edges` are the
/// edges of line segments, squares or cubes with the volumes of the points, m.
///
/// Most points cover this edge. In a refined grid, the points next to the faces of a body are half a spacing
/// of level 0 away from the faces, at all levels. Such points cover this spacing. If the cells of a lattice
/// have different edges, its points cover the longest edge.
pub(super) fn covers<const D: usize>(
    problem: &Problem,
    model: &Model<D>,
    edges: &[f64],
) -> Vec<f64> {
    let blocks: Vec<Block> = problem.blocks().collect();
    let nodes: Vec<Option<Nodes<D>>> = problem
        .bodies
        .iter()
        .map(|body| {
            let levels = problem.refinement.as_ref()?.levels;
            Nodes::new(&Block::unrefined(body), levels, model)
        })
        .collect();
    (0..model.owned())
        .map(|point| {
            let number = usize::from(model.block[point]);
            let block = &blocks[number];
            match (longest_edge::<D>(block), &nodes[problem.body_of(number)]) {
                (Some(longest), _) => longest,
                (None, Some(nodes)) if !nodes.surround(model, point, block.level) => nodes.coarsest,
                _ => edges[point],
            }
        })
        .collect()
}

/// Return the longest edge (m) of the cells of a block; `None` if the points do not lie at the centres of
/// cells, or if all edges of the cells are equal.
fn longest_edge<const D: usize>(block: &Block<'_>) -> Option<f64> {
    let [edges, _] = lattice::<D>(block)?;
    let longest = edges.into_iter().fold(0.0, f64::max);
    edges.iter().any(|edge| *edge != longest).then_some(longest)
}

/// Return the edges of the cells of level 0 and the corner of a cell, m; `None` if the points do not lie at
/// the centres of cells.
fn lattice<const D: usize>(block: &Block<'_>) -> Option<[[f64; D]; 2]> {
    match block.body.points {
        PointSource::Lattice {
            spacing,
            origin,
            quadrature: Quadrature::Midpoint,
            ..
        } => Some([spacing, origin].map(|vector| std::array::from_fn(|d| vector[d]))),
        _ => None,
    }
}

/// The nodes of the refined grid of a body.
struct Nodes<const D: usize> {
    /// Corner of a cell, m.
    origin: [f64; D],
    /// Spacing of level 0, m.
    coarsest: f64,
    /// Number of the finest level.
    levels: u32,
    /// Positions of all points of this rank, relative to `origin`, in half spacings of the finest level.
    places: FxHashSet<[i64; D]>,
}

impl<const D: usize> Nodes<D> {
    /// Return the nodes of a body; `None` if the body has no cells.
    fn new(block: &Block<'_>, levels: u32, model: &Model<D>) -> Option<Self> {
        let [edges, origin] = lattice::<D>(block)?;
        let mut nodes = Self {
            origin,
            coarsest: edges[0],
            levels,
            places: FxHashSet::default(),
        };
        let all = 0..model.reference[0].len();
        let places = all.map(|point| nodes.place(model, point)).collect();
        nodes.places = places;
        Some(nodes)
    }

    fn place(&self, model: &Model<D>, point: usize) -> [i64; D] {
        let half = 0.5 * self.coarsest * 0.5_f64.powi(self.levels as i32);
        std::array::from_fn(|d| {
            ((model.reference[d][point] - self.origin[d]) / half).round() as i64
        })
    }

    /// Whether a point of a level has a neighbour at the spacing of this level in both directions along each
    /// axis. The neighbours are on this rank, because they are within the horizon.
    fn surround(&self, model: &Model<D>, point: usize, level: u32) -> bool {
        let place = self.place(model, point);
        let spacing = 2_i64 << (self.levels - level);
        (0..D).all(|d| {
            [-spacing, spacing].iter().all(|step| {
                let mut neighbour = place;
                neighbour[d] += step;
                self.places.contains(&neighbour)
            })
        })
    }
}
