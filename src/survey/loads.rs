//! Warnings about loads, supports and temperatures that do not have the intended effect.

use crate::comm::sum::reduce;
use crate::comm::{ExactSum, total};
use crate::component::AXES;
use crate::error::Warning;
use crate::expression::Expression;
use crate::message::format_number;
use crate::problem::{Action, Condition, Depth, PointSource, Problem, Stage};
use crate::solver::Simulation;
use crate::solver::conditions::members;

/// Largest ratio of the thickness of a loaded layer to the depth of the load. A warning is printed if the
/// ratio is larger. If the normal of a layer is a diagonal of the cells, a layer meant to be one cell thick
/// may contain two diagonal rows of cells. Both rows together are up to √2 cells thick.
const MAX_THICKNESS_RATIO: f64 = 1.6;

/// Largest length of a row that counts for the thickness of a layer, divided by the length of the shortest
/// row through the same cell. Longer rows lie along the layer, not across it.
const MAX_ROW_RATIO: f64 = 1.5;

/// Maximum number of points of a layer for which the thickness is checked.
const LARGE_LAYER: u64 = 4_000_000;

/// Check all conditions and append warnings. Collective.
pub fn check_conditions<const D: usize>(
    simulation: &mut Simulation<'_, D>,
    warnings: &mut Vec<Warning>,
) {
    let problem = simulation.problem;
    let points: Vec<Vec<u32>> = problem
        .conditions
        .iter()
        .map(|condition| members(problem, &simulation.model, condition.set))
        .collect();
    overridden_motions(simulation, &points, warnings);
    without_effect(simulation, &points, warnings);
    for (condition, points) in problem.conditions.iter().zip(&points) {
        if condition.depth == Some(Depth::Spacing) {
            layer(simulation, condition, points, warnings);
        }
    }
    inward_normals(simulation, &points, warnings);
    if let Some(torque) = simulation.unheld_torque() {
        let condition = &problem.conditions[torque.condition];
        warn(condition, &torque.description, warnings);
    }
}

fn warn(condition: &Condition, words: &str, warnings: &mut Vec<Warning>) {
    let message = format!(
        "[condition.{}] {}: {words}",
        condition.name, condition.quantity
    );
    warnings.push(Warning::new(message).at(&condition.place));
}

/// Return the components of the motion that a condition prescribes; `None` for loads and temperatures.
fn motion(condition: &Condition) -> Option<&[Option<Expression>]> {
    match &condition.action {
        Action::Displacement(values) | Action::Velocity(values) => Some(values),
        Action::BodyForce(..) | Action::Force(_) | Action::Temperature(_) => None,
    }
}

/// Warn of prescribed motions that a later condition with other values overrides.
fn overridden_motions<const D: usize>(
    simulation: &Simulation<'_, D>,
    points: &[Vec<u32>],
    warnings: &mut Vec<Warning>,
) {
    let conditions = &simulation.problem.conditions;
    for (later, second) in conditions.iter().enumerate() {
        for (earlier, first) in conditions[..later].iter().enumerate() {
            let (Some(old), Some(new)) = (motion(first), motion(second)) else {
                continue;
            };
            let both = |stage: &Stage| stage.acting[earlier] && stage.acting[later];
            if !simulation.stages.all.iter().any(both) {
                continue;
            }
            let differs = |d: &usize| {
                let same = old[*d] == new[*d] && first.quantity == second.quantity;
                old[*d].is_some() && new[*d].is_some() && !same
            };
            let components: Vec<&str> = (0..D).filter(differs).map(|d| AXES[d]).collect();
            if components.is_empty() {
                continue;
            }
            let is_common = |point: &&u32| points[earlier].binary_search(point).is_ok();
            let common = points[later].iter().filter(is_common).count();
            let common = total(simulation.comm, common as u64);
            if common > 0 {
                let words = format!(
                    "overrides [condition.{}] in {} at {common} point(s)",
                    first.name,
                    components.join(" and ")
                );
                warn(second, &words, warnings);
            }
        }
    }
}

/// Warn of loads that are 0 or act only on points with prescribed motion, and of temperatures that act only
/// on points without thermal expansion.
fn without_effect<const D: usize>(
    simulation: &Simulation<'_, D>,
    points: &[Vec<u32>],
    warnings: &mut Vec<Warning>,
) {
    let problem = simulation.problem;
    for (condition, own) in problem.conditions.iter().zip(points) {
        let acts: Vec<usize> = match &condition.action {
            Action::BodyForce(values, factors) => (0..D)
                .filter(|d| factors[*d] != 0.0 && values[*d].as_constant() != Some(0.0))
                .collect(),
            Action::Force(values) => (0..D)
                .filter(|d| values[*d].as_constant() != Some(0.0))
                .collect(),
            Action::Temperature(_) => {
                let expands = |point: &u32| {
                    let expansion = simulation.model.expansion_of(*point as usize);
                    expansion.stretch_per_kelvin != 0.0
                };
                let expanding = own.iter().filter(|point| expands(point)).count();
                if total(simulation.comm, expanding as u64) == 0 {
                    let words = "acts on bodies without `thermal_expansion` and has no effect";
                    warn(condition, words, warnings);
                }
                continue;
            }
            Action::Displacement(_) | Action::Velocity(_) => continue,
        };
        if acts.is_empty() {
            warn(condition, "is 0 and has no effect", warnings);
            continue;
        }
        let is_prescribed = |point: &u32, d: usize| {
            problem
                .conditions
                .iter()
                .zip(points)
                .any(|(other, others)| {
                    let prescribes = motion(other).is_some_and(|motion| motion[d].is_some());
                    prescribes && others.binary_search(point).is_ok()
                })
        };
        let is_free = |point: &&u32| acts.iter().any(|d| !is_prescribed(point, *d));
        let free = own.iter().filter(is_free).count();
        if total(simulation.comm, free as u64) == 0 {
            let words = "acts only on points with prescribed motion and has no effect";
            warn(condition, words, warnings);
        }
    }
}

/// Check a traction or pressure with the default depth. This depth is, for each point, the spacing of the
/// body to which the point belongs. Warn if the loaded layer is thicker than the depth by more than a factor
/// of [`MAX_THICKNESS_RATIO`]. Layers of more than [`LARGE_LAYER`] points are not checked. Collective.
fn layer<const D: usize>(
    simulation: &Simulation<'_, D>,
    condition: &Condition,
    points: &[u32],
    warnings: &mut Vec<Warning>,
) {
    let (problem, model, comm) = (simulation.problem, &simulation.model, simulation.comm);
    if total(comm, points.len() as u64) > LARGE_LAYER {
        return;
    }
    // Gather body and cell of all points of the layer on rank 0.
    let mut cells = vec![Vec::new(); comm.size()];
    for point in points {
        let index = problem.body_of(usize::from(model.block[*point as usize]));
        let body = &problem.bodies[index];
        // Skip points of bodies without a single spacing. Only sets of conditions that act in no stage may
        // have such points.
        let (Some(edge), PointSource::Lattice { origin, .. }) =
            (body.single_spacing(D), &body.points)
        else {
            continue;
        };
        let position = model.position(*point as usize);
        let along = |k: usize| ((position[k] - origin[k]) / edge).floor() as i64;
        cells[0].extend_from_slice(bytemuck::cast_slice(&[
            index as i64,
            along(0),
            along(1),
            along(2),
        ]));
    }
    let received = comm.all_to_all(cells).concat();
    let mut cells: Vec<[i64; 4]> = bytemuck::pod_collect_to_vec::<u8, i64>(&received)
        .chunks_exact(4)
        .map(|cell| [cell[0], cell[1], cell[2], cell[3]])
        .collect();
    cells.sort_unstable();
    cells.dedup();
    let found = thickness::<D>(problem, cells);
    let mut packed = found.map_or(Vec::new(), |found| bytemuck::cast_slice(&found).to_vec());
    comm.broadcast(0, &mut packed);
    let found = bytemuck::pod_collect_to_vec::<u8, f64>(&packed);
    let [thickness, depth] = found[..] else {
        return;
    };
    if thickness / depth > MAX_THICKNESS_RATIO {
        let words = format!(
            "acts on a layer about {thickness:.2e} m thick but is divided by the spacing, {} m; give the thickness of \
             the layer as `depth`",
            format_number(depth)
        );
        warn(condition, &words, warnings);
    }
}

/// A cell of a layer.
struct Cell {
    /// Index of the body and the three indices of the cell.
    index: [i64; 4],
    /// For each axis, the number of cells in the row through this cell. A row consists of adjacent cells of
    /// the layer along an axis.
    rows: [f64; 3],
}

/// Return the thickness of a layer and the cell edge, m. The thickness is the harmonic mean of
/// [`local_thickness`] over the cells. If the layer has points of several bodies, the result is that of the
/// body with the largest ratio of thickness to cell edge. `None` if there are no cells. Each entry of `cells`
/// contains the index of a body and the three indices of a cell; no entry occurs twice.
fn thickness<const D: usize>(problem: &Problem, cells: Vec<[i64; 4]>) -> Option<[f64; 2]> {
    let rows = [0.0; 3];
    let mut cells: Vec<Cell> = cells
        .into_iter()
        .map(|index| Cell { index, rows })
        .collect();
    for k in 0..D {
        // With the index along the axis k as the last key, the cells of a row follow one another.
        cells.sort_unstable_by_key(|cell| {
            let mut key = cell.index;
            key[1 + k..].rotate_left(1);
            key
        });
        let is_adjacent = |cell: &Cell, next: &Cell| {
            let mut index = cell.index;
            index[1 + k] += 1;
            index == next.index
        };
        for row in cells.chunk_by_mut(is_adjacent) {
            let length = row.len() as f64;
            row.iter_mut().for_each(|cell| cell.rows[k] = length);
        }
    }
    let of_body = |cells: &[Cell]| {
        let inverse = cells
            .iter()
            .map(|cell| local_thickness(&cell.rows[..D]).recip());
        // A layer that fills a box of cells lies along a face of the box, even if it is hardly wider than deep.
        let volume = |cell: &Cell| cell.rows[..D].iter().product::<f64>();
        let is_box = cells.iter().all(|cell| volume(cell) == cells.len() as f64);
        let cells_deep = if is_box {
            cells[0].rows[..D]
                .iter()
                .copied()
                .fold(f64::INFINITY, f64::min)
        } else {
            cells.len() as f64 / inverse.sum::<f64>()
        };
        let edge = problem.bodies[cells[0].index[0] as usize].single_spacing(D)?;
        Some([cells_deep * edge, edge])
    };
    let ratio = |[thickness, edge]: &[f64; 2]| thickness / edge;
    cells
        .chunk_by(|a, b| a.index[0] == b.index[0])
        .filter_map(of_body)
        .max_by(|a, b| ratio(a).total_cmp(&ratio(b)))
}

/// Return the thickness of a layer at one of its cells, in cells. `rows` contains the number of cells in the
/// row through this cell along each axis. Let T be the thickness of the layer and n its unit normal. The row
/// along the axis k then has the length L_k = T/|n_k|, so T = (Σ L_k⁻²)^(−1/2). The sum does not include rows
/// that are longer than [`MAX_ROW_RATIO`] times the shortest row.
fn local_thickness(rows: &[f64]) -> f64 {
    let shortest = rows.iter().copied().fold(f64::INFINITY, f64::min);
    let across = rows.iter().filter(|row| **row <= MAX_ROW_RATIO * shortest);
    across.map(|row| row.powi(-2)).sum::<f64>().sqrt().recip()
}

/// Warn of pressures whose normal points into the body.
fn inward_normals<const D: usize>(
    simulation: &Simulation<'_, D>,
    points: &[Vec<u32>],
    warnings: &mut Vec<Warning>,
) {
    let (problem, model) = (simulation.problem, &simulation.model);
    let is_pressure = |condition: &Condition| condition.quantity == "pressure";
    if !problem.conditions.iter().any(is_pressure) {
        return;
    }
    // For each point, the sum of the unit vectors to its neighbours.
    let mut inward = vec![[0.0; 3]; model.owned()];
    simulation.forces.for_each_intact(|i, j| {
        let (a, b) = (model.position(i), model.position(j));
        let along: [f64; 3] = std::array::from_fn(|k| b[k] - a[k]);
        let length = along.iter().map(|x| x * x).sum::<f64>().sqrt();
        (0..3).for_each(|k| inward[i][k] += along[k] / length);
    });
    for (condition, points) in problem.conditions.iter().zip(points) {
        let Action::BodyForce(_, factors) = &condition.action else {
            continue;
        };
        if !is_pressure(condition) {
            continue;
        }
        // The factors of a pressure are −normal.
        let mut sum = [ExactSum::ZERO];
        for point in points {
            let inward = inward[*point as usize];
            sum[0].add((0..D).map(|d| -factors[d] * inward[d]).sum());
        }
        if reduce(simulation.comm, &mut sum)[0] > 0.0 {
            let words =
                "`normal` points into the body, so the pressure pulls; give the outward normal";
            warn(condition, words, warnings);
        }
    }
}
