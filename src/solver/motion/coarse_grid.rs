//! The coarse grid of a preconditioner. The grid is effective for long waves in the displacement of a body.
//!
//! A grid of box cells covers all bodies. Each edge of a cell is at least one horizon long, except along an
//! axis with a single cell. Displacements are defined at the nodes and are linear along each axis within a
//! cell. The cells have the stiffness of a classical elastic solid. The elastic constants of a cell are
//! volume-weighted averages over its points. Each point contributes its constants times its fraction of
//! intact bonds. If a support prescribes a component of a point's motion, a spring resists this component of
//! the displacement at the position of the point. Forces on points are distributed to the nodes of their
//! cells (restriction). Displacements of nodes are interpolated to the points (prolongation) with the same
//! weights, so the preconditioner is symmetric.
//!
//! The grid has few nodes, so every rank stores the whole grid, factors its matrix and solves with it. The
//! terms of sums over points are [rounded](crate::comm::rounded_sum::Unit) to multiples of a unit, so the
//! sums do not depend on the number of ranks and threads.

use std::ops::Range;

use rayon::prelude::*;

use crate::comm::rounded_sum::Unit;
use crate::comm::{Communicator, min};
use crate::solver::model::Model;

use super::banded::Banded;
use super::load_step::CHUNK;

/// Minimum edge of a cell, in horizons.
const EDGE: f64 = 1.0;

/// The edges of the cells are multiplied by this factor repeatedly until the matrix is small enough.
const GROWTH: f64 = 1.1;

/// Maximum number of multiply-adds per point to solve with the factored matrix. The force evaluation of a
/// point with few bonds needs about this number of multiply-adds.
const SOLUTION: f64 = 16.0;

/// Maximum number of multiply-adds to solve with the factored matrix if there are few points. This maximum
/// applies if `SOLUTION` times the number of points is smaller.
const LEAST_SOLUTION: f64 = 2e4;

/// Maximum number of multiply-adds of the factorization.
const FACTORIZATION: f64 = 2e8;

/// Maximum number of nodes at the corners of a cell.
const CORNERS: usize = 8;

/// Maximum number of pairs of nodes of a cell, including the pairs of a node with itself.
const PAIRS: usize = CORNERS * (CORNERS + 1) / 2;

/// The grid, and its stiffness matrix as a Cholesky factor.
pub struct CoarseGrid<const D: usize> {
    /// Lower corner of the grid, m.
    lower: [f64; D],
    /// Cells per length along each axis, 1/m.
    per_length: [f64; D],
    cells: [usize; D],
    /// Index difference of nodes that are adjacent along an axis.
    node_strides: [usize; D],
    /// Index difference of cells that are adjacent along an axis.
    cell_strides: [usize; D],
    matrix: Banded,
    /// Forces on the nodes as multiples of a [`Unit`], one vector per task.
    parts: Vec<Vec<i64>>,
    /// Sums of `parts` over tasks and ranks.
    words: Vec<u64>,
    /// Displacements of the nodes by component, m.
    values: Vec<f64>,
}

/// Contribution of a point to the stiffness of the grid.
#[derive(Debug, Clone, Copy)]
pub struct PointStiffness<const D: usize> {
    /// Lamé's first parameter λ and the shear modulus G, each times the volume V of the point and its
    /// fraction of intact bonds, N m.
    pub moduli: [f64; 2],
    /// Stiffness of the supported components, N/m; 0 for free components.
    pub springs: [f64; D],
}

/// The cell of a point, and the position of the point in the cell.
struct CellPosition<const D: usize> {
    cell: usize,
    /// Index of the first node of the cell.
    node: usize,
    /// Coordinates from 0 to 1 along each axis.
    along: [f64; D],
}

impl<const D: usize> CoarseGrid<D> {
    /// Create a grid that covers all points. The edges of its cells are long enough that the stiffness
    /// matrix of the grid is small. The edges are at least `horizon` (m), except along axes with a single
    /// cell. Collective.
    pub fn new(comm: &dyn Communicator, model: &Model<D>, horizon: f64) -> Self {
        let owned = model.owned();
        let column = |d: usize| model.reference[d][..owned].iter().copied();
        let mut lower: [f64; D] = std::array::from_fn(|d| column(d).fold(f64::INFINITY, f64::min));
        let mut upper: [f64; D] =
            std::array::from_fn(|d| column(d).fold(f64::NEG_INFINITY, f64::max));
        min(comm, &mut lower);
        comm.max(&mut upper);
        let length: [f64; D] = std::array::from_fn(|d| upper[d] - lower[d]);
        let mut edge = EDGE * horizon;
        let solution = (SOLUTION * model.total as f64).max(LEAST_SOLUTION);
        let shape = loop {
            let shape = Shape::new(length, edge);
            let (size, band) = (shape.size as f64, (shape.band + 1) as f64);
            let is_small = 2.0 * size * band <= solution && size * band * band <= FACTORIZATION;
            if is_small || shape.cells == [1; D] {
                break shape;
            }
            edge *= GROWTH;
        };
        Self {
            lower,
            per_length: std::array::from_fn(|d| {
                if length[d] > 0.0 {
                    shape.cells[d] as f64 / length[d]
                } else {
                    1.0 / edge
                }
            }),
            cells: shape.cells,
            node_strides: shape.node_strides,
            cell_strides: shape.cell_strides,
            matrix: Banded::zero(shape.size, shape.band),
            parts: vec![vec![0; shape.size]; rayon::current_num_threads()],
            words: vec![0; shape.size],
            values: vec![0.0; shape.size],
        }
    }

    /// Assemble the stiffness matrix, and factor it. `of_point` returns the contribution of an owned point.
    /// Collective.
    pub fn assemble(
        &mut self,
        comm: &dyn Communicator,
        model: &Model<D>,
        of_point: impl Fn(usize) -> PointStiffness<D> + Sync,
    ) {
        let owned = model.owned();
        let most = |values: &[f64]| values.iter().fold(0.0_f64, |most, v| most.max(v.abs()));
        let points = (0..owned).into_par_iter().with_min_len(CHUNK);
        let magnitudes = points.map(|point| {
            let PointStiffness { moduli, springs } = of_point(point);
            [most(&moduli), most(&springs)]
        });
        let mut largest = magnitudes.reduce(|| [0.0; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])]);
        comm.max(&mut largest);
        let units = largest.map(|magnitude| Unit::of(magnitude, model.total));
        let cells: usize = self.cells.iter().product();
        let width = 2 + D * PAIRS;
        let sums_of = |points: Range<usize>| {
            let mut words = vec![0_u64; cells * width];
            for point in points {
                let PointStiffness { moduli, springs } = of_point(point);
                let place = self.place(model, point);
                let own = &mut words[place.cell * width..][..width];
                let mut add = |index: usize, unit: Option<Unit>, value: f64| {
                    if let Some(unit) = unit {
                        own[index] = own[index].wrapping_add(unit.round(value) as u64);
                    }
                };
                add(0, units[0], moduli[0]);
                add(1, units[0], moduli[1]);
                for (d, spring) in springs.into_iter().enumerate().filter(|(_, k)| *k > 0.0) {
                    for (pair, (p, q)) in pairs::<D>().enumerate() {
                        let value = spring * place.weight(p) * place.weight(q);
                        add(2 + d * PAIRS + pair, units[1], value);
                    }
                }
            }
            words
        };
        let threads = rayon::current_num_threads();
        let size = owned.div_ceil(threads).max(1);
        let parts = (0..threads)
            .into_par_iter()
            .map(|part| sums_of((part * size).min(owned)..((part + 1) * size).min(owned)));
        let mut words = parts.reduce(
            || vec![0; cells * width],
            |mut a, b| {
                a.iter_mut()
                    .zip(b)
                    .for_each(|(a, b)| *a = a.wrapping_add(b));
                a
            },
        );
        comm.sum(&mut words);
        let value = |unit: Option<Unit>, word: u64| unit.map_or(0.0, |u| u.value(word as i64));
        let [bulk, shear] = self.reference_stiffness();
        self.matrix.clear();
        for cell in 0..cells {
            let own = &words[cell * width..][..width];
            let moduli = [value(units[0], own[0]), value(units[0], own[1])];
            let first = self.first_node(cell);
            for (pair, (p, q)) in pairs::<D>().enumerate() {
                for a in 0..D {
                    for b in 0..D {
                        let entry = (p * D + a) * CORNERS * D + q * D + b;
                        let spring = if a == b {
                            value(units[1], own[2 + a * PAIRS + pair])
                        } else {
                            0.0
                        };
                        let stiffness = moduli[0] * bulk[entry] + moduli[1] * shear[entry];
                        let row = (first + self.corner(p)) * D + a;
                        let column = (first + self.corner(q)) * D + b;
                        // The matrix is symmetric, so only the lower half is added.
                        if row >= column {
                            self.matrix.add(row, column, stiffness + spring);
                        } else if p != q {
                            self.matrix.add(column, row, stiffness + spring);
                        }
                    }
                }
            }
        }
        self.matrix.factor();
    }

    /// Compute the displacements of the nodes under force densities on the owned points (N/m³, by component).
    /// Collective.
    pub fn solve(&mut self, comm: &dyn Communicator, model: &Model<D>, force: &[Vec<f64>; D]) {
        let owned = model.owned();
        let largest = (0..owned).into_par_iter().with_min_len(CHUNK).map(|point| {
            let volume = model.volume[point];
            let force = force.iter().map(|column| (volume * column[point]).abs());
            force.fold(0.0, f64::max)
        });
        let mut largest = [largest.reduce(|| 0.0, f64::max)];
        comm.max(&mut largest);
        let Some(unit) = Unit::of(largest[0], model.total) else {
            self.values.fill(0.0);
            return;
        };
        // The buffers are taken out of `self` while they are written.
        let mut parts = std::mem::take(&mut self.parts);
        let size = owned.div_ceil(parts.len()).max(1);
        parts.par_iter_mut().enumerate().for_each(|(part, sums)| {
            sums.fill(0);
            for point in (part * size).min(owned)..((part + 1) * size).min(owned) {
                let place = self.place(model, point);
                let volume = model.volume[point];
                for p in 0..1 << D {
                    let (weight, node) = (place.weight(p), place.node + self.corner(p));
                    for d in 0..D {
                        sums[node * D + d] += unit.round(weight * (volume * force[d][point]));
                    }
                }
            }
        });
        self.words.fill(0);
        for sums in &parts {
            for (word, sum) in self.words.iter_mut().zip(sums) {
                *word = word.wrapping_add(*sum as u64);
            }
        }
        self.parts = parts;
        comm.sum(&mut self.words);
        for (value, word) in self.values.iter_mut().zip(&self.words) {
            *value = unit.value(*word as i64);
        }
        self.matrix.solve(&mut self.values);
    }

    /// Interpolate component `d` of the displacement (m) of an owned point. Call after [`Self::solve`].
    pub fn displacement(&self, model: &Model<D>, d: usize, point: usize) -> f64 {
        let place = self.place(model, point);
        let of = |p: usize| place.weight(p) * self.values[(place.node + self.corner(p)) * D + d];
        (0..1 << D).map(of).sum()
    }

    /// The cell of an owned point, and the position of the point in the cell.
    fn place(&self, model: &Model<D>, point: usize) -> CellPosition<D> {
        let mut place = CellPosition {
            cell: 0,
            node: 0,
            along: [0.0; D],
        };
        for d in 0..D {
            let along = (model.reference[d][point] - self.lower[d]) * self.per_length[d];
            let cell = (along as usize).min(self.cells[d] - 1);
            place.cell += cell * self.cell_strides[d];
            place.node += cell * self.node_strides[d];
            place.along[d] = along - cell as f64;
        }
        place
    }

    /// Index of the first node of a cell.
    fn first_node(&self, cell: usize) -> usize {
        let along = |d: usize| cell / self.cell_strides[d] % self.cells[d];
        (0..D).map(|d| along(d) * self.node_strides[d]).sum()
    }

    /// Index of a node of a cell, relative to the first node of the cell. Bit d of `corner` is 1 for nodes on
    /// the upper face along axis d.
    fn corner(&self, corner: usize) -> usize {
        let strides = self.node_strides.iter().enumerate();
        strides.map(|(d, stride)| (corner >> d & 1) * stride).sum()
    }

    /// Two stiffness matrices of a cell, divided by the volume of the cell. The moduli are λ = 1 and G = 0 in
    /// the first matrix, and λ = 0 and G = 1 in the second. Each row and each column belongs to a
    /// displacement component of a node.
    fn reference_stiffness(&self) -> [Vec<f64>; 2] {
        let mut both = [0; 2].map(|_| vec![0.0; (CORNERS * D) * (CORNERS * D)]);
        let gauss = [0.5 - 0.5 / f64::sqrt(3.0), 0.5 + 0.5 / f64::sqrt(3.0)];
        let share = 1.0 / f64::from(1_u32 << D);
        for number in 0..1_usize << D {
            let at = CellPosition::<D> {
                cell: 0,
                node: 0,
                along: std::array::from_fn(|d| gauss[number >> d & 1]),
            };
            let slopes: Vec<[f64; D]> =
                (0..1 << D).map(|p| at.slope(p, &self.per_length)).collect();
            for (p, of_p) in slopes.iter().enumerate() {
                for (q, of_q) in slopes.iter().enumerate() {
                    let product: f64 = (0..D).map(|d| of_p[d] * of_q[d]).sum();
                    for a in 0..D {
                        for b in 0..D {
                            let entry = (p * D + a) * CORNERS * D + q * D + b;
                            let same = if a == b { product } else { 0.0 };
                            both[0][entry] += share * of_p[a] * of_q[b];
                            both[1][entry] += share * (of_p[b] * of_q[a] + same);
                        }
                    }
                }
            }
        }
        both
    }
}

impl<const D: usize> CellPosition<D> {
    /// Interpolation weight of a node of the cell, evaluated at the position of the point. `corner` is the
    /// number of the node, as in [`CoarseGrid::corner`].
    fn weight(&self, corner: usize) -> f64 {
        let along = self.along.iter().enumerate();
        along
            .map(|(d, along)| weight(corner >> d & 1, *along))
            .product()
    }

    /// Gradient of the weight of a node, 1/m. `per_length` is the same as in [`CoarseGrid`].
    fn slope(&self, corner: usize, per_length: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|d| {
            let others = (0..D).filter(|other| *other != d);
            let others: f64 = others
                .map(|other| weight(corner >> other & 1, self.along[other]))
                .product();
            let sign = if corner >> d & 1 == 1 { 1.0 } else { -1.0 };
            sign * per_length[d] * others
        })
    }
}

/// Interpolation weight of one of the two faces of a cell that are normal to an axis: the lower face
/// (`end` = 0) or the upper face (`end` = 1). The coordinate `along` is 0 at the lower face and 1 at the
/// upper face.
fn weight(end: usize, along: f64) -> f64 {
    if end == 1 { along } else { 1.0 - along }
}

/// Pairs of nodes p and q of a cell, with p ≤ q.
fn pairs<const D: usize>() -> impl Iterator<Item = (usize, usize)> {
    (0..1 << D).flat_map(|q| (0..=q).map(move |p| (p, q)))
}

/// Number of cells along each axis, and the numbering of nodes and cells as in [`CoarseGrid`].
struct Shape<const D: usize> {
    cells: [usize; D],
    node_strides: [usize; D],
    cell_strides: [usize; D],
    /// Number of rows of the stiffness matrix.
    size: usize,
    /// Number of entries left of the diagonal in a row of the stiffness matrix.
    band: usize,
}

impl<const D: usize> Shape<D> {
    /// Create the shape for a box of the size `length` (m). Along each axis, the edges of the cells are at
    /// least `edge` (m), unless the box is shorter than `edge`. The box then has one cell along this axis.
    /// Nodes are numbered first along the axis with the fewest nodes, which gives the narrowest band.
    fn new(length: [f64; D], edge: f64) -> Self {
        let cells = length.map(|length| ((length / edge) as usize).max(1));
        let mut axes: [usize; D] = std::array::from_fn(|d| d);
        axes.sort_by_key(|d| cells[*d]);
        let (mut node_strides, mut cell_strides) = ([0; D], [0; D]);
        let (mut nodes, mut all) = (1, 1);
        for d in axes {
            node_strides[d] = nodes;
            cell_strides[d] = all;
            nodes *= cells[d] + 1;
            all *= cells[d];
        }
        Self {
            cells,
            node_strides,
            cell_strides,
            size: nodes * D,
            band: node_strides.iter().sum::<usize>() * D + D - 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use crate::solver::palette_column::PaletteColumn;

    /// Part of a bar of 41 points. The points of the bar are 1 m apart and have a volume of 1 m³. The part
    /// has every `size`-th point of the bar, starting from point `first`.
    fn bar(first: usize, size: usize) -> (Model<1>, Vec<usize>) {
        let own: Vec<usize> = (first..41).step_by(size).collect();
        let model = Model {
            reference: [own.iter().map(|point| *point as f64).collect()],
            volume: PaletteColumn::new(vec![1.0; own.len()]),
            block: vec![0; own.len()],
            ids: own.iter().map(|point| *point as u64).collect(),
            total: 41,
            ..Model::empty()
        };
        (model, own)
    }

    #[test]
    fn a_bar_on_a_spring_is_stretched_alike_on_any_ranks() {
        let (modulus, spring, force) = (50.0, 3.0, 0.7);
        let run = |ranks: usize| {
            let parts = threads::run(ranks, |comm| {
                let (model, own) = bar(comm.rank(), comm.size());
                let mut grid = CoarseGrid::new(comm, &model, 4.0);
                grid.assemble(comm, &model, |point| PointStiffness {
                    moduli: [0.0, 0.5 * modulus],
                    springs: [if own[point] == 0 { spring } else { 0.0 }],
                });
                let load = own
                    .iter()
                    .map(|point| if *point == 40 { force } else { 0.0 });
                grid.solve(comm, &model, &[load.collect()]);
                let at = |k: usize| (own[k], grid.displacement(&model, 0, k).to_bits());
                (0..own.len()).map(at).collect::<Vec<_>>()
            });
            let mut all = parts.concat();
            all.sort_unstable();
            all
        };
        let one = run(1);
        let of = |point: usize| f64::from_bits(one[point].1);
        let (start, end) = (force / spring, force / spring + force * 40.0 / modulus);
        assert!((of(0) - start).abs() < 1e-9, "{}", of(0));
        // The last cell has one more point than the other cells.
        assert!((of(40) / end - 1.0).abs() < 0.03, "{} {end}", of(40));
        for ranks in [2, 3] {
            assert_eq!(run(ranks), one);
        }
    }
}
