//! Warnings about loads, supports and temperatures that do not have the intended effect.

use std::collections::HashSet;

use crate::comm::sum::reduce;
use crate::comm::{ExactSum, total};
use crate::component::AXES;
use crate::error::Warning;
use crate::expression::Expression;
use crate::message::format_number;
use crate::problem::{Action, Condition, Depth, Problem, Stage};
use crate::solver::Simulation;
use crate::solver::conditions::members;

/// Largest factor between the thickness of a loaded layer and the depth of the load. A warning is printed if
/// the thickness is larger or smaller than the depth by more than this factor. The thickness is measured
/// along the axes. For a curved layer one cell thick, the measured thickness is therefore up to π/2 cells.
const MAX_THICKNESS_RATIO: f64 = 1.8;

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
/// body to which the point belongs. Warn if the depth differs from the thickness of the loaded layer by more
/// than a factor of [`MAX_THICKNESS_RATIO`]. Layers of more than [`LARGE_LAYER`] points are not checked.
/// Collective.
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
        let body = problem.body_of(usize::from(model.block[*point as usize]));
        // Skip points of bodies without a single spacing. Only sets of conditions that act in no stage may
        // have such points.
        let Some(edge) = problem.bodies[body].single_spacing(D) else {
            continue;
        };
        let position = model.position(*point as usize);
        let cell: [i64; 3] = std::array::from_fn(|k| (position[k] / edge).floor() as i64);
        cells[0].extend_from_slice(bytemuck::cast_slice(&[
            body as i64,
            cell[0],
            cell[1],
            cell[2],
        ]));
    }
    let received = comm.all_to_all(cells).concat();
    let cells: HashSet<[i64; 4]> = bytemuck::pod_collect_to_vec::<u8, i64>(&received)
        .chunks_exact(4)
        .map(|cell| [cell[0], cell[1], cell[2], cell[3]])
        .collect();
    let found = thickness::<D>(problem, &cells);
    let mut packed = found.map_or(Vec::new(), |found| bytemuck::cast_slice(&found).to_vec());
    comm.broadcast(0, &mut packed);
    let found = bytemuck::pod_collect_to_vec::<u8, f64>(&packed);
    let [thickness, depth] = found[..] else {
        return;
    };
    if !(MAX_THICKNESS_RATIO.recip()..MAX_THICKNESS_RATIO).contains(&(thickness / depth)) {
        let words = format!(
            "acts on a layer about {thickness:.2e} m thick but is divided by the spacing, {} m; give the thickness of \
             the layer as `depth`",
            format_number(depth)
        );
        warn(condition, &words, warnings);
    }
}

/// Return the thickness of a layer and the cell edge, m. Along each axis, adjacent cells form rows. The
/// thickness is the smallest of the mean row lengths along the axes. If the layer has points of several
/// bodies, the result is that of the body for which thickness and cell edge differ most. `None` if there are
/// no cells. Each entry of `cells` contains the index of a body and the three indices of a cell.
fn thickness<const D: usize>(problem: &Problem, cells: &HashSet<[i64; 4]>) -> Option<[f64; 2]> {
    let of_body = |body: usize| {
        let own = || cells.iter().filter(move |cell| cell[0] == body as i64);
        let row_length = |k: usize| {
            let begins = |cell: &&[i64; 4]| {
                let mut before = **cell;
                before[1 + k] -= 1;
                !cells.contains(&before)
            };
            let rows = own().filter(begins).count();
            own().count() as f64 / rows as f64
        };
        own().next()?;
        let cells_deep = (0..D).map(row_length).fold(f64::INFINITY, f64::min);
        let edge = problem.bodies[body].single_spacing(D)?;
        Some([cells_deep * edge, edge])
    };
    let difference = |[thickness, edge]: &[f64; 2]| libm::log(thickness / edge).abs();
    (0..problem.bodies.len())
        .filter_map(of_body)
        .max_by(|a, b| difference(a).total_cmp(&difference(b)))
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
