//! Checks before the first step: figures of bodies, cracks, probes and sets, and warnings of likely
//! mistakes. `check` and the start of a run print the same figures and warnings.

mod bodies;
mod cost;
mod dry_run;
mod interior;
mod loads;
pub mod memory;
mod size;
mod speed;

pub use bodies::BodyFigures;
pub use cost::{Cost, Measured, ResultCost, ghost_share};
pub use dry_run::{DryRun, Seconds, dry_run};
pub use interior::{Interior, interior};
pub use size::{Size, size};
pub use speed::{Speed, speed};

use rayon::prelude::*;

use crate::comm::total;
use crate::damage::{CriticalStretch, DamageLaw};
use crate::error::Warning;
use crate::message::format_number;
use crate::points::crack;
use crate::problem::{Block, Crack, Interval, PointSource, Problem, Selector, Stage, StepRule};
use crate::solver::Simulation;
use crate::solver::assign::{block_laws, pair_damage_laws};
use crate::solver::conditions::members;
use crate::solver::contact::Coincident;
use crate::solver::observers::{Nearest, Snapshot, foreign_tip, nearest};

/// Number of intact bonds of a point in 1-D, 2-D and 3-D below which a warning is printed. The numbers are
/// half the number of neighbours of a complete family with a horizon of two spacings.
const FEW_NEIGHBOURS: [f64; 3] = [2.0, 6.0, 16.0];

/// Usual horizons, in spacings. A warning is printed for all other horizons.
const USUAL_HORIZONS: std::ops::RangeInclusive<f64> = 1.999..=8.001;

/// Number of steps above which even small runs take days.
const MANY_STEPS: u64 = 100_000_000;

/// Number of steps below which an explicit run cannot show any motion.
const FEW_STEPS: u64 = 2;

/// Critical stretch above which a warning is printed.
const LARGEST_STRETCH: f64 = 1.0;

/// Critical stretch below which a warning is printed. The critical stretch of rock is 1.5e-6 at a horizon of
/// 1 km.
const SMALLEST_STRETCH: f64 = 1e-6;

/// Largest distance from a pre-crack, in spacings, at which a point counts as lying on the pre-crack.
const ON_CRACK: f64 = 1e-6;

/// The figures and warnings of a run; equal on all ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// Figures of each body.
    pub bodies: Vec<BodyFigures>,
    /// Number of bonds between each pair of bonded bodies; the lower body index comes first.
    pub bonds_between_bodies: Vec<([usize; 2], u64)>,
    /// Number of bonds cut by each pre-crack.
    pub cuts: Vec<u64>,
    /// The point nearest to each probe.
    pub probes: Vec<Nearest>,
    /// Number of points of each set.
    pub sets: Vec<u64>,
    /// Warnings of likely mistakes, most of them with a position in the deck.
    pub warnings: Vec<Warning>,
}

impl Survey {
    /// Survey a run before its first step. Collective.
    pub fn new<const D: usize>(simulation: &mut Simulation<'_, D>) -> Self {
        let (problem, comm) = (simulation.problem, simulation.comm);
        let mut warnings = problem.warnings.clone();
        let bodies = bodies::figures(simulation, &mut warnings);
        horizons(problem, &bodies, &mut warnings);
        stretches(problem, &mut warnings);
        let bonds_between_bodies = bonds_between_bodies(simulation);
        bonded_with_contact(problem, &bonds_between_bodies, &mut warnings);
        let mut cuts = simulation.undeformed.cut.clone();
        comm.sum(&mut cuts);
        cuts.iter_mut().for_each(|ends| *ends /= 2);
        for (crack, _) in problem
            .cracks
            .iter()
            .zip(&cuts)
            .filter(|(_, cut)| **cut == 0)
        {
            let message = format!("[crack.{}]: cuts no bond", crack.name);
            warnings.push(Warning::new(message).at(&crack.span));
        }
        refined_cracks(problem, &mut warnings);
        points_on_cracks(simulation, &mut warnings);
        let sets = sets(simulation, &mut warnings);
        let probes = probes(simulation, &mut warnings);
        foreign_tips(simulation, &mut warnings);
        loads::check_conditions(simulation, &mut warnings);
        few_neighbours(simulation, &mut warnings);
        coincident(simulation, &mut warnings);
        time(simulation, &mut warnings);
        Self {
            bodies,
            bonds_between_bodies,
            cuts,
            probes,
            sets,
            warnings,
        }
    }
}

/// Return the number of bonds of each pair of different bodies, over all ranks.
fn bonds_between_bodies<const D: usize>(simulation: &Simulation<'_, D>) -> Vec<([usize; 2], u64)> {
    let count = simulation.problem.bodies.len();
    let mut bonds = vec![0; count * count];
    for (blocks, own) in simulation.forces.bonds_of_blocks() {
        let [i, j] = blocks.map(|block| simulation.problem.body_of(block));
        bonds[i * count + j] += own;
    }
    simulation.comm.sum(&mut bonds);
    let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| [i, j]));
    pairs
        .map(|[i, j]| ([i, j], bonds[i * count + j]))
        .filter(|(_, bonds)| *bonds > 0)
        .collect()
}

/// Warn of pairs of bodies that have contact, and are bonded although the deck has no `[interface.pair]`
/// for them.
fn bonded_with_contact(
    problem: &Problem,
    bonds_between_bodies: &[([usize; 2], u64)],
    warnings: &mut Vec<Warning>,
) {
    let Some(contact) = &problem.contact else {
        return;
    };
    for (pair, bonds) in bonds_between_bodies {
        let [first, second] = pair.map(|body| &problem.bodies[body]);
        let is_chosen = problem.interface.pair(first, second).is_some();
        if is_chosen || contact.between(first, second).is_none() {
            continue;
        }
        let message = format!(
            "[interface] rule: {bonds} bonds join [body.{}] and [body.{}], which also have contact; for contact alone, set \
             `rule = \"none\"`; for bonds and contact, give the pair an [interface.pair.NAME]",
            first.name, second.name
        );
        warnings.push(Warning::new(message).at(&second.span));
    }
}

fn horizons(problem: &Problem, bodies: &[BodyFigures], warnings: &mut Vec<Warning>) {
    for (body, figures) in problem.bodies.iter().zip(bodies) {
        let spacing = match &body.points {
            PointSource::Lattice { spacing, .. } => spacing[..problem.dimension.count()]
                .iter()
                .copied()
                .fold(0.0, f64::max),
            // Wrong volumes have their own warning.
            PointSource::File { .. } | PointSource::Mesh { .. } => {
                match figures.volumes_fit(problem.dimension) {
                    Some(true) => figures.mean_spacing(problem.dimension),
                    Some(false) | None => figures.spacing,
                }
            }
        };
        let horizon = body.horizon / spacing;
        if spacing > 0.0 && !USUAL_HORIZONS.contains(&horizon) {
            let message = format!(
                "[body.{}]: its horizon, {} m, is {} spacings; 3 to 6 are usual",
                body.name,
                format_number(body.horizon),
                format_number((100.0 * horizon).round() / 100.0)
            );
            warnings.push(Warning::new(message).at(&body.horizon_span));
        }
    }
}

fn stretches(problem: &Problem, warnings: &mut Vec<Warning>) {
    // Bodies without `damage` are not checked, even if their law breaks bonds at the end of softening. A
    // softening bond carries almost no force near its critical stretch.
    let of_damage = problem.bodies.iter().filter(|body| body.damage.is_some());
    let of_bodies = of_damage.filter_map(|body| {
        let law = block_laws(problem, &Block::unrefined(body)).damage?;
        Some((format!("[body.{}]", body.name), &body.span, law))
    });
    let of_pairs = problem.interface.pairs.iter().filter_map(|pair| {
        let laws = pair_damage_laws(problem, pair)?;
        let law = if laws[0].critical() > laws[1].critical() {
            laws[0]
        } else {
            laws[1]
        };
        Some((format!("[interface.pair.{}]", pair.name), &pair.span, law))
    });
    for (section, span, law) in of_bodies.chain(of_pairs) {
        let DamageLaw::CriticalStretch(CriticalStretch { critical, .. }) = law else {
            continue;
        };
        let shown = if critical < 1e-3 {
            format!("{critical:.1e}")
        } else {
            format!("{critical:.3}")
        };
        let mut warn = |consequence: String| {
            let message =
                format!("{section} damage: its bonds break at a stretch of {shown}{consequence}");
            warnings.push(Warning::new(message).at(span));
        };
        if critical < SMALLEST_STRETCH {
            let units = "; check the units of the toughness and of the moduli";
            warn(units.to_owned());
        }
        if critical >= LARGEST_STRETCH {
            warn(format!(
                ", that is, at {:.3} times their initial length",
                1.0 + critical
            ));
        }
        let slower = stretched_stiffness(critical, problem.dimension.count()).sqrt();
        let unstable = safeties(problem)
            .into_iter()
            .find(|safety| safety * slower > 1.0);
        if let Some(safety) = unstable {
            let largest = (100.0 / slower).floor() / 100.0;
            warn(format!(
                "; at this stretch, the step is stable only with `safety = {largest:.2}` or less, but `safety` is {safety}"
            ));
        }
    }
}

/// Return the `safety` factors of the explicit stages with an automatic step.
fn safeties(problem: &Problem) -> Vec<f64> {
    let moving = problem
        .all_stages()
        .into_iter()
        .filter(|stage| !stage.time.is_quasi_static());
    let safety = |stage: Stage| match stage.time.step {
        StepRule::Automatic(safety) => Some(safety),
        StepRule::Fixed(_) => None,
    };
    moving.filter_map(safety).collect()
}

/// Return the stiffness of a family with bonds stretched by s = `stretch`, divided by the stiffness that the
/// stable step assumes. The tension of a stretched bond also resists displacements across the bond. The
/// stiffness across the bond is s/(1 + s) of the stiffness along the bond.
fn stretched_stiffness(stretch: f64, dimension: usize) -> f64 {
    1.0 + (dimension as f64 - 1.0) * stretch / (1.0 + stretch)
}

/// Warn of a refinement level whose horizon is shorter than the spacing of level 0. If a crack exists before
/// the refinement, the points at its opposite faces remain one spacing of level 0 apart. These points
/// therefore have no bonds with each other, not even broken ones.
fn refined_cracks(problem: &Problem, warnings: &mut Vec<Warning>) {
    let Some(refinement) = &problem.refinement else {
        return;
    };
    let can_crack = refinement.trigger.is_some() && problem.has_damage();
    if problem.cracks.is_empty() && !can_crack {
        return;
    }
    let count = problem.dimension.count();
    let is_short = |block: &Block<'_>| {
        let coarse = Block::unrefined(block.body).spacing();
        let spacing = coarse.map_or(0.0, |spacing| {
            spacing[..count].iter().copied().fold(0.0, f64::max)
        });
        block.horizon < spacing * (1.0 - 1e-6)
    };
    if let Some(block) = problem.blocks().find(is_short) {
        let message = format!(
            "[refinement] levels: the horizon of level {level} is shorter than the spacing of level 0. If a crack exists \
             before the grid around it is refined to level {level}, no bond can cross the crack, so it then has no damage \
             and no length",
            level = block.level,
        );
        warnings.push(Warning::new(message).at(&refinement.span));
    }
}

/// Warn of pre-cracks without width that pass through more than `D` points. All of these points count as
/// points on one side of the pre-crack, so the actual cut lies beside them.
fn points_on_cracks<const D: usize>(simulation: &Simulation<'_, D>, warnings: &mut Vec<Warning>) {
    let (problem, model) = (simulation.problem, &simulation.model);
    let is_on = |crack: &Crack, point: &usize| {
        let position = model.position(*point);
        let reach = ON_CRACK * problem.dimension.edge(model.volume[*point]);
        crack::is_in_reach(crack, position, reach)
            && (0..D).any(|k| {
                let [mut before, mut after] = [position; 2];
                before[k] -= reach;
                after[k] += reach;
                crack::crosses(crack, before, after)
            })
    };
    for crack in problem
        .cracks
        .iter()
        .filter(|crack| !crack.surface.has_width())
    {
        let own = (0..model.owned()).into_par_iter();
        let found = own.filter(|point| is_on(&crack.surface, point)).count();
        let points = total(simulation.comm, found as u64);
        if points > D as u64 {
            let message = format!(
                "[crack.{}]: passes through {points} points; all of them count as points on the same side of the \
                 crack, so the actual cut lies beside them; \
                 move the crack or the grid by half a spacing, or choose another spacing",
                crack.name
            );
            warnings.push(Warning::new(message).at(&crack.span));
        }
    }
}

/// Return the number of points of each set. Warn of each set that is selected by position and has fewer
/// points than the problem has dimensions. Do not warn if the run has at most 2 points in 1-D, 4 in 2-D or 6
/// in 3-D.
/// Collective.
fn sets<const D: usize>(simulation: &Simulation<'_, D>, warnings: &mut Vec<Warning>) -> Vec<u64> {
    let (problem, comm) = (simulation.problem, simulation.comm);
    let count = |set| members(problem, &simulation.model, set).len() as u64;
    let mut sizes: Vec<u64> = (0..problem.sets.len()).map(count).collect();
    comm.sum(&mut sizes);
    for (set, size) in problem.sets.iter().zip(&sizes) {
        let by_position = matches!(set.selector, Selector::Where(_) | Selector::Within(_));
        if by_position && *size < D as u64 && simulation.model.total > 2 * D as u64 {
            let message = format!("[set.{}]: has {size} point(s) only", set.name);
            warnings.push(Warning::new(message).at(&set.span));
        }
    }
    sizes
}

fn probes<const D: usize>(
    simulation: &Simulation<'_, D>,
    warnings: &mut Vec<Warning>,
) -> Vec<Nearest> {
    let problem = simulation.problem;
    let follow = |probe: &crate::problem::Probe| {
        let found = nearest(simulation, probe.at);
        if found.distance > 0.5 * problem.horizon {
            let message = format!(
                "[history.probe.{}] at: the nearest point is {:.3e} m away, at {:?} m",
                probe.name,
                found.distance,
                &found.position[..D]
            );
            warnings.push(Warning::new(message).at(&probe.span));
        }
        found
    };
    problem.history.probes.iter().map(follow).collect()
}

/// Warn of tips that lie on another crack than the one at their `from`.
fn foreign_tips<const D: usize>(simulation: &mut Simulation<'_, D>, warnings: &mut Vec<Warning>) {
    let problem = simulation.problem;
    if problem.history.tips.is_empty() || problem.cracks.len() < 2 {
        return;
    }
    let snapshot = Snapshot::without_energies(simulation);
    for tip in &problem.history.tips {
        if let Some(position) = foreign_tip(simulation, tip, &snapshot) {
            let message = format!(
                "[history.tip.{}]: the farthest damage along `direction`, at {:?} m, lies on another crack than the \
                 damage at `from`; give a `set` that contains the points of one crack only",
                tip.name,
                &position[..D]
            );
            warnings.push(Warning::new(message).at(&tip.span));
        }
    }
}

/// Warn of points of different bodies at the same position. Contact cannot act between such points.
fn coincident<const D: usize>(simulation: &Simulation<'_, D>, warnings: &mut Vec<Warning>) {
    let (problem, model) = (simulation.problem, &simulation.model);
    let contact = simulation.contact.as_ref();
    let found = contact.and_then(|contact| contact.coincident(problem, simulation.comm, model));
    if let Some(Coincident { pairs, ids, blocks }) = found {
        let [first, second] = blocks.map(|block| problem.block(block).body);
        let message = format!(
            "[body.{}]: {pairs} pair(s) of points of different bodies lie at the same position and never touch, such as \
             point {} of `{}` and point {} of this body; move one of the bodies, or leave these points out of it",
            second.name, ids[0], first.name, ids[1]
        );
        warnings.push(Warning::new(message).at(&second.span));
    }
}

fn few_neighbours<const D: usize>(simulation: &mut Simulation<'_, D>, warnings: &mut Vec<Warning>) {
    let few = FEW_NEIGHBOURS[D - 1];
    let families = simulation.forces.intact_families(&simulation.model);
    let poor = families.neighbours.iter().filter(|count| **count < few);
    let poor = total(simulation.comm, poor.count() as u64);
    if poor > 0 {
        let message = format!("{poor} point(s) have fewer than {few} intact bonds");
        warnings.push(Warning::new(message));
    }
}

fn time<const D: usize>(simulation: &Simulation<'_, D>, warnings: &mut Vec<Warning>) {
    let problem = simulation.problem;
    let spans = &problem.spans;
    let mut warn = |place, message: String| warnings.push(Warning::new(message).at(place));
    let clock = simulation.clock;
    let (step, stable) = (clock.step(), simulation.scaled_stable_step());
    if step > stable && !simulation.is_quasi_static() {
        let message =
            format!("[time] step: {step:.4e} s is larger than the stable step, {stable:.4e} s");
        warn(&spans.step, message);
    }
    let rule = simulation.time_rule().adaptive;
    if let Some(largest) = rule.and_then(|rule| rule.largest)
        && largest > stable
    {
        let message = format!(
            "[time] adaptive largest: {largest:.4e} s is larger than the stable step, {stable:.4e} s"
        );
        warn(&spans.step, message);
    }
    let last = simulation.last_step();
    if last > MANY_STEPS {
        let message = format!(
            "[time] end: the run takes {:.1e} steps of {step:.4e} s; check the units of the end, the moduli and the \
             densities",
            last as f64
        );
        warn(&spans.end, message);
    }
    if last < FEW_STEPS && !simulation.is_quasi_static() {
        let message = format!(
            "[time] end: the run has only {last} step(s) of {step:.4e} s; check the units of the end, the lengths and \
             the moduli"
        );
        warn(&spans.end, message);
    }
    for output in problem.outputs() {
        if let Some(Interval::Seconds(every)) = output.every
            && every > problem.time.end
        {
            let message = format!(
                "{} every: {} s is longer than the run, {} s; only its first and last states are written",
                output.section(),
                format_number(every),
                format_number(problem.time.end)
            );
            warnings.push(Warning::new(message));
        }
    }
}
