//! The sections of the report of `fissure check`.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use fissure::damage::DamageLaw;
use fissure::deck::Deck;
use fissure::dimension::Dimension;
use fissure::error::Warning;
use fissure::problem::Problem;
use fissure::problem::{
    Block, Body, BreakableBonds, ContactModel, ContactRule, DamageRule, InterfaceDamage,
    PointSource, RigidMotion, RigidShape, Time,
};
use fissure::solver::assign::{block_laws, pair_damage_laws};
use fissure::solver::calibration::separation_energy_ratio;
use fissure::survey::{BodyFigures, Cost, Interior, Seconds, Survey};

use super::format::{bytes, count, duration, si, with_unit};
use super::report::Report;

/// Append the path, the title, the dimension and the horizon of the deck; in 1-D, also the constraint
/// (uniaxial stress or uniaxial strain).
pub fn heading(report: &mut Report, problem: &Problem, deck: &Path) {
    report.heading(format_args!(
        "{} is a valid deck: {}",
        deck.display(),
        problem.title
    ));
    report.line("dimension", problem.dimension.name());
    if let Some(constraint) = problem.dimension.constraint() {
        report.line("constraint", constraint);
    }
    report.line("horizon", si(problem.horizon, "m"));
}

/// Append the warnings, with positions in the deck.
pub fn warnings(report: &mut Report, deck: &Deck, warnings: &[Warning]) {
    for warning in warnings {
        let warning = deck.locate_warning(warning.clone());
        report.heading(format_args!("warning: {warning}"));
    }
}

/// Append the material, the laws and the horizon of a body.
pub fn body(report: &mut Report, problem: &Problem, body: &Body) {
    report.heading(format_args!("body {}", body.name));
    report.line("material", &body.material_name);
    report.line("density", format_args!("{} kg/m³", body.material.density));
    let elastic = body.material.elastic;
    report.line("Young's modulus", si(elastic.youngs_modulus, "Pa"));
    report.line(
        "Poisson's ratio",
        format_args!("{:.4}", elastic.poisson_ratio),
    );
    let laws = block_laws(problem, &Block::unrefined(body));
    for (name, value) in laws.law.described() {
        report.line(name, value);
    }
    match laws.damage {
        None if laws.wears_out => report.line("damage", "fatigue"),
        None => report.line("damage", "none"),
        Some(damage) => {
            match damage {
                DamageLaw::CriticalStretch(law) => {
                    report.line("critical stretch", format_args!("{:.4e}", law.critical));
                }
                DamageLaw::BondEnergy(law) => {
                    report.line("critical energy", format_args!("{:.4e} J/m⁶", law.critical));
                }
                DamageLaw::Stress(law) => {
                    report.line("breaks by", law.rule.measure.name());
                    report.line("strength", si(law.strength, "Pa"));
                }
            }
            // Bonds that break at the end of their softening need no damage in the deck. `damage` then
            // follows from the material law and has no alpha. Damage by stress has no alpha either.
            if body.damage.is_some() && damage.stress_measure().is_none() {
                report.line("alpha", damage.alpha());
            }
            if let Some(direction) = laws.direction {
                let ratio = direction.ratio(problem.dimension.count());
                report.line("energy across/along", format_args!("{ratio:.3}"));
            }
            if let Some(weibull) = laws.weibull {
                report.line("Weibull modulus", weibull.modulus);
            }
        }
    }
    let horizon = si(body.horizon, "m");
    if let PointSource::Lattice { spacing, .. } = body.points {
        let multiples = spacing[..problem.dimension.count()]
            .iter()
            .map(|edge| format!("{:.3}", body.horizon / edge));
        let mut multiples: Vec<String> = multiples.collect();
        multiples.dedup();
        report.line(
            "horizon",
            format_args!("{horizon}, {} spacings", multiples.join(" × ")),
        );
    } else {
        report.line("horizon", horizon);
    }
}

/// Append the figures of a body's points.
pub fn figures(report: &mut Report, body: &Body, figures: &BodyFigures, dimension: Dimension) {
    report.line("points", count(figures.points));
    let of_shape = figures.shape_volume.map(|volume| {
        let share = 100.0 * figures.volume / volume;
        format!(", {share:.2} % of the volume of its shape")
    });
    report.line(
        "volume",
        format_args!("{:.4e} m³{}", figures.volume, of_shape.unwrap_or_default()),
    );
    if !matches!(body.points, PointSource::Lattice { .. }) {
        let mean = figures.mean_spacing(dimension);
        let multiple = body.horizon / mean;
        report.line(
            "mean spacing",
            format_args!("{}, horizon {multiple:.3} times as long", si(mean, "m")),
        );
        report.line("distance of points", si(figures.spacing, "m"));
    }
    if let Some([least, median, largest]) = figures.neighbours {
        let [least, median, largest] = [least, median, largest].map(count);
        report.line(
            "neighbours",
            format_args!("{least} at least, median {median}, {largest} at most"),
        );
    }
    report.line("mass", format_args!("{:.4e} kg", figures.mass));
    report.line("centre", place(&figures.centre[..dimension.count()]));
}

/// Format a position, m.
fn place(position: &[f64]) -> String {
    let entries: Vec<String> = position.iter().map(|x| format!("{x:.4e}")).collect();
    format!("[{}] m", entries.join(", "))
}

/// Append the computed properties of the interior of a body, and the moduli of the classical solid for
/// comparison. Append nothing if `interior` is `None`.
pub fn interior(report: &mut Report, problem: &Problem, interior: Option<&Interior>) {
    let Some(interior) = interior else {
        return;
    };
    report.line("neighbours inside", interior.neighbours);
    let deviation = |found: f64, exact: f64| format!("{:+.1} %", 100.0 * (found / exact - 1.0));
    let [bulk, shear] = interior.exact;
    let name = match problem.dimension {
        Dimension::Space => "bulk modulus inside",
        _ => "expansion inside",
    };
    report.line(
        name,
        format_args!(
            "{}, material {} ({})",
            si(interior.bulk, "Pa"),
            si(bulk, "Pa"),
            deviation(interior.bulk, bulk)
        ),
    );
    if let Some([axes, diagonals]) = interior.shear {
        report.line(
            "shear modulus inside",
            format_args!(
                "{} along axes, {} along diagonals, material {} ({}, {})",
                si(axes, "Pa"),
                si(diagonals, "Pa"),
                si(shear, "Pa"),
                deviation(axes, shear),
                deviation(diagonals, shear)
            ),
        );
    }
}

/// Append the separation energy ratio for opening, if the body has energy-based damage. In 2-D and 3-D, if
/// compressed bonds can break, also append the ratio for sliding.
pub fn separation_energy(report: &mut Report, problem: &Problem, body: usize) {
    let Some(damage) = &problem.bodies[body].damage else {
        return;
    };
    let DamageRule::Energy { work, .. } = damage.rule else {
        return;
    };
    let mut modes = vec![("cost of opening", 0.0)];
    if work.breakable == BreakableBonds::Any && problem.dimension.count() > 1 {
        modes.push(("cost of sliding", FRAC_PI_2));
    }
    for (name, angle) in modes {
        if let Some(ratio) = separation_energy_ratio(problem, body, angle) {
            report.line(name, format_args!("{ratio:.3} of the fracture energy"));
        }
    }
}

/// Largest number of bodies for which the contact rule of every pair is listed.
const MOST_PAIRS: usize = 6;

/// Append the number of bonds between each pair of bodies. If the deck gives the damage of a pair, also
/// append the damage thresholds of this pair.
pub fn bonds_between_bodies(report: &mut Report, problem: &Problem, survey: &Survey) {
    if problem.bodies.len() < 2 {
        return;
    }
    report.heading("bonds between bodies");
    if survey.bonds_between_bodies.is_empty() {
        report.line("none", "");
    }
    for (pair, bonds) in &survey.bonds_between_bodies {
        let [a, b] = pair.map(|body| &problem.bodies[body].name);
        report.line(&format!("{a} and {b}"), count(*bonds));
    }
    let damage = problem.interface.pairs.iter().filter_map(|pair| {
        let words = match (&pair.damage, pair_damage_laws(problem, pair)) {
            (InterfaceDamage::Unbreakable, _) => "none".to_owned(),
            (_, laws) => pair_damage(laws?),
        };
        let [a, b] = &pair.bodies;
        Some((format!("{a} and {b}"), words))
    });
    let damage: Vec<_> = damage.collect();
    if !damage.is_empty() {
        report.heading("damage of bonds between bodies");
    }
    for (bodies, words) in damage {
        report.line(&bodies, words);
    }
}

/// Format the damage thresholds at both ends of the bonds between a pair of bodies; a single number if both
/// thresholds are equal.
fn pair_damage(laws: [DamageLaw; 2]) -> String {
    let [first, second] = laws.map(|law| format!("{:.4e}", law.critical()));
    let values = if first == second {
        first
    } else {
        format!("{first} and {second}")
    };
    match laws[0] {
        DamageLaw::CriticalStretch(_) => format!("critical stretch {values}"),
        DamageLaw::BondEnergy(_) => format!("critical energy {values} J/m⁶"),
        DamageLaw::Stress(law) => format!("{} {values} Pa", law.rule.measure.name()),
    }
}

/// Append the contact rules of bodies and pairs of bodies.
pub fn contact(report: &mut Report, problem: &Problem) {
    let Some(contact) = &problem.contact else {
        return;
    };
    report.heading("contact");
    let described = |rule: Option<ContactRule>| match rule {
        None => "none".to_owned(),
        Some(rule) => {
            let model = match rule.model {
                ContactModel::Penalty => "penalty",
                ContactModel::ShortRange => "short-range",
            };
            format!(
                "{model}, friction {} (static {}), restitution {}",
                rule.kinetic_friction, rule.static_friction, rule.restitution
            )
        }
    };
    if problem.bodies.len() > MOST_PAIRS {
        report.line("all pairs", described(contact.rule));
        for pair in &contact.pairs {
            let [a, b] = &pair.bodies;
            report.line(&format!("{a} and {b}"), described(pair.rule));
        }
        return;
    }
    for (second, there) in problem.bodies.iter().enumerate() {
        for here in &problem.bodies[..=second] {
            let name = if here.name == there.name {
                format!("{} with itself", here.name)
            } else {
                format!("{} and {}", here.name, there.name)
            };
            report.line(&name, described(contact.between(here, there)));
        }
    }
}

/// Append the rigid bodies.
pub fn rigid(report: &mut Report, problem: &Problem) {
    if !problem.rigid.is_empty() {
        report.heading("rigid bodies");
    }
    let dimension = problem.dimension.count();
    for rigid in &problem.rigid {
        let shape = match rigid.shape {
            RigidShape::Ball { radius } => format!("radius {}", si(radius, "m")),
            RigidShape::Cylinder {
                half_length,
                radius,
                ..
            } => format!(
                "cylinder, radius {}, length {}",
                si(radius, "m"),
                si(2.0 * half_length, "m")
            ),
            RigidShape::Box { half } => {
                let edges = half[..dimension].iter().map(|edge| si(2.0 * edge, "m"));
                format!("box, {}", edges.collect::<Vec<_>>().join(" × "))
            }
            RigidShape::HalfSpace { .. } => "half space".to_owned(),
        };
        let motion = match &rigid.motion {
            RigidMotion::Driven(motion) if motion.is_empty() => "fixed".to_owned(),
            RigidMotion::Driven(_) => "driven".to_owned(),
            RigidMotion::Free { mass, .. } => format!("free, {}", with_unit(*mass, "kg")),
        };
        let at = place(&rigid.centre[..dimension]);
        let friction = rigid.rule.kinetic_friction;
        report.line(
            &rigid.name,
            format_args!("{shape}, at {at}, {motion}, friction {friction}"),
        );
    }
}

/// Append the number of bonds that each crack cuts, and the point nearest to each probe.
pub fn places(report: &mut Report, problem: &Problem, survey: &Survey, dimension: usize) {
    if !problem.cracks.is_empty() {
        report.heading("cracks");
    }
    for (crack, cut) in problem.cracks.iter().zip(&survey.cuts) {
        report.line(&crack.name, format_args!("cuts {} bonds", count(*cut)));
    }
    if !problem.history.probes.is_empty() {
        report.heading("probes");
    }
    for (probe, found) in problem.history.probes.iter().zip(&survey.probes) {
        report.line(
            &probe.name,
            format_args!(
                "point {} at {}, {} away",
                found.id,
                place(&found.position[..dimension]),
                si(found.distance, "m")
            ),
        );
    }
}

/// Append the sets with their numbers of points.
pub fn sets(report: &mut Report, problem: &Problem, survey: &Survey) {
    report.heading("sets");
    for (set, size) in problem.sets.iter().zip(&survey.sets) {
        let note = if *size == 0 { "  (empty!)" } else { "" };
        report.line(&set.name, format_args!("{} points{note}", count(*size)));
    }
}

/// Append the numbers of points and bonds.
pub fn size(report: &mut Report, problem: &Problem, points: u64, bonds: u64) {
    let trigger = problem
        .refinement
        .as_ref()
        .map(|refinement| &refinement.trigger);
    let note = if matches!(trigger, Some(Some(_))) {
        " at the start; the estimates below leave out points that refinement adds"
    } else {
        ""
    };
    report.line("points", format_args!("{}{note}", count(points)));
    report.line("bonds", count(bonds));
}

/// Append the memory of each rank and the disk space. `ghosts` is the number of ghosts per owned point.
pub fn cost(report: &mut Report, cost: &Cost, ranks: u32, ghosts: f64) {
    let memory = bytes(cost.memory_of_a_rank(ranks, ghosts));
    report.line(
        "memory of each rank",
        format_args!("about {memory} on {ranks} rank(s)"),
    );
    for result in &cost.results {
        let name = match &result.name {
            None => "result".to_owned(),
            Some(name) => format!("result {name}"),
        };
        report.line(
            &name,
            format_args!(
                "about {}, {} outputs",
                bytes(result.bytes),
                count(result.outputs)
            ),
        );
    }
    if cost.results.len() > 1 {
        report.line(
            "all results",
            format_args!("about {}", bytes(cost.all_results())),
        );
    }
    report.line(
        "checkpoints",
        format_args!("two of about {} each", bytes(cost.checkpoint)),
    );
}

/// Append the end time and the stable step.
pub fn time(report: &mut Report, problem: &Problem, stable: f64) {
    report.heading("time");
    report.line("end", si(problem.time.end, "s"));
    report.line("stable step", si(stable, "s"));
}

/// Append the first time step and the number of time steps of each explicit stage, and the number of load
/// steps of each quasi-static stage.
pub fn steps(report: &mut Report, problem: &Problem, steps: &[(f64, f64)]) {
    let stages = problem.all_stages();
    if let ([stage], [(step, steps)]) = (&stages[..], steps) {
        let steps = count(*steps as u64);
        if stage.time.is_quasi_static() {
            report.line("load steps", steps);
        } else {
            report.line(
                "time step",
                si(*step, "s") + &largest_step(&stage.time, *step),
            );
            report.line("steps", steps + note_on_steps(problem, &stage.time));
        }
        return;
    }
    for (number, (stage, (step, steps))) in (1..).zip(stages.iter().zip(steps)) {
        let steps = count(*steps as u64);
        let words = if stage.time.is_quasi_static() {
            format!("{steps} load steps")
        } else {
            let (step, largest) = (si(*step, "s"), largest_step(&stage.time, *step));
            format!(
                "{steps} steps of {step}{largest}{}",
                note_on_steps(problem, &stage.time)
            )
        };
        report.line(&format!("stage {number}"), words);
    }
}

/// Format the largest time step of a stage. `first` is the first time step (s) of the stage. Return an empty
/// text unless the largest step exceeds the first step.
fn largest_step(time: &Time, first: f64) -> String {
    match time.adaptive.and_then(|rule| rule.largest) {
        Some(largest) if largest > first => format!(" at first, then up to {}", si(largest, "s")),
        _ => String::new(),
    }
}

fn note_on_steps(problem: &Problem, time: &Time) -> &'static str {
    match (time.adaptive.is_some(), problem.has_contact()) {
        (true, true) => ", more if bonds break or contact is stiff",
        (true, false) => ", more if bonds break",
        (false, true) => ", more if contact is stiff",
        (false, false) => "",
    }
}

/// Append the estimated run times on `ranks` ranks. For explicit stages, append three totals: for the steps,
/// for the history rows and for the outputs. For stages with load steps, append the time of one force
/// evaluation.
pub fn run_time(
    report: &mut Report,
    problem: &Problem,
    steps: &[(f64, f64)],
    (seconds, cost): (&Seconds, &Cost),
    ranks: u32,
) {
    let threads = rayon::current_num_threads();
    let on = format!("{ranks} rank(s) × {threads} thread(s) of this machine");
    let parts = f64::from(ranks);
    let stages = problem.all_stages();
    let explicit = stages.iter().zip(steps);
    let explicit = explicit.filter(|(stage, _)| !stage.time.is_quasi_static());
    let explicit: f64 = explicit.map(|(_, (_, steps))| steps).sum();
    if explicit > 0.0 {
        let whole = duration(seconds.evaluation * explicit / parts);
        let rows = duration(seconds.row * cost.rows as f64 / parts);
        let outputs = cost.results.iter().zip(&seconds.outputs);
        let outputs = outputs.map(|(result, seconds)| seconds * result.outputs as f64);
        let outputs = duration(outputs.sum::<f64>() / parts);
        report.line(
            "run time",
            format_args!(
                "about {whole} for the steps, {rows} for {} history row(s), {outputs} for the fields of the outputs, {on}",
                count(cost.rows)
            ),
        );
    }
    let evaluation = duration(seconds.evaluation / parts);
    if problem.has_relaxation() {
        report.line(
            "run time",
            format_args!(
                "about {evaluation} for an iteration, {on}; a load step takes some hundreds to ten thousands"
            ),
        );
    }
    if problem.has_newton() {
        report.line(
            "run time",
            format_args!(
                "about {evaluation} for a force evaluation, {on}; a load step of `static` takes some tens to hundreds, more \
                 while bonds break"
            ),
        );
    }
}
