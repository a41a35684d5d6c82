//! `fissure check`: what a deck would do.

use crate::cli::say;
use fissure::comm::threads;
use fissure::deck::{self, Plan};
use fissure::error::Result;
use fissure::solver::Simulation;
use fissure::solver::assign::block_laws;
use fissure::solver::conditions::members;
use fissure::solver::observers::HistoryObserver;

use super::format::{bytes, count, si};
use super::{CheckArguments, Verbosity, launch};

/// Fewest bonds of a point, by dimension, below which it is poorly held: half of a family at a
/// horizon of two spacings.
const FEW_NEIGHBOURS: [f64; 3] = [2.0, 6.0, 16.0];

/// Validates the deck and prints the figures.
///
/// # Errors
/// When the deck is wrong.
pub fn check(arguments: &CheckArguments, verbosity: Verbosity) -> Result<()> {
    let plan = deck::read(&arguments.deck, &arguments.set)?.plan()?;
    launch::start_threads(launch::threads(None))?;
    match plan.dimension.count() {
        1 => report::<1>(&plan, arguments, verbosity),
        2 => report::<2>(&plan, arguments, verbosity),
        _ => report::<3>(&plan, arguments, verbosity),
    }
}

fn line(name: &str, value: impl std::fmt::Display) {
    say!("  {name:<24}{value}");
}

fn report<const D: usize>(
    plan: &Plan,
    arguments: &CheckArguments,
    verbosity: Verbosity,
) -> Result<()> {
    let comm = threads::alone();
    let mut simulation = Simulation::<D>::new(plan, &comm)?;
    simulation.check()?;
    HistoryObserver::new(&simulation)?;
    if verbosity == Verbosity::Quiet {
        return Ok(());
    }
    say!(
        "{} is a valid deck: {}",
        arguments.deck.display(),
        plan.title
    );
    line("dimension", plan.dimension.name());
    line("horizon", si(plan.horizon, "m"));
    for body in &plan.bodies {
        say!("body {}", body.name);
        line("material", &body.material_name);
        line("density", format!("{} kg/m³", body.material.density));
        line(
            "Young's modulus",
            si(body.material.elastic.youngs_modulus, "Pa"),
        );
        line(
            "Poisson's ratio",
            format!("{:.4}", body.material.elastic.poisson_ratio),
        );
        let laws = block_laws(plan, body);
        for (name, value) in laws.law.described() {
            line(name, value);
        }
        match laws.damage {
            None => line("damage", "none"),
            Some(damage) => {
                line("critical stretch", format!("{:.4e}", damage.critical));
                line("alpha", damage.alpha);
            }
        }
    }
    say!("size");
    let model = &simulation.model;
    let total = model.total;
    line("points", count(total));
    line("bonds", count(simulation.forces.directed_bonds() / 2));
    line(
        "of them as lattice",
        count(simulation.forces.lattice_bonds() / 2),
    );
    let state = 8 * (2 * D + 1) + 8 * D + 8 * (D + 1) + 8 + 2;
    let whole = simulation.forces.bytes() as f64 + (state as u64 * total) as f64;
    let ranks = arguments.ranks;
    let estimate = whole / f64::from(ranks) * (1.0 + ghost_share(&simulation, ranks));
    line(
        "memory of each rank",
        format!("about {} on {ranks} rank(s)", bytes(estimate)),
    );
    say!("time");
    line("end", si(plan.time.end, "s"));
    line("stable step", si(simulation.stable_step, "s"));
    line("time step", si(simulation.clock.step(), "s"));
    line("steps", count(simulation.clock.last()));
    say!("sets");
    let model = &simulation.model;
    for (index, set) in plan.sets.iter().enumerate() {
        let size = members(plan, model, index).len();
        let note = if size == 0 { "  (empty!)" } else { "" };
        line(&set.name, format!("{} points{note}", count(size as u64)));
    }
    let few = FEW_NEIGHBOURS[D - 1];
    let stored = simulation.forces.stored(&simulation.model);
    let neighbours = stored.neighbours.iter();
    let poor = neighbours.filter(|count| **count < few).count();
    if poor > 0 {
        say!(
            "warning: {} points have fewer than {few} intact bonds",
            count(poor as u64)
        );
    }
    if simulation.clock.step() > simulation.stable_step {
        say!("warning: the time step is larger than the stable one");
    }
    Ok(())
}

/// Ghosts of a rank as a share of its own points, if the ranks' parts were cubes.
fn ghost_share<const D: usize>(simulation: &Simulation<'_, D>, ranks: u32) -> f64 {
    if ranks == 1 {
        return 0.0;
    }
    let volume: f64 = simulation.model.volume.iter().sum();
    let extent = volume / simulation.plan.dimension.section() / f64::from(ranks);
    let edge = extent.powf(1.0 / D as f64);
    (1.0 + 2.0 * simulation.plan.horizon / edge).powi(D as i32) - 1.0
}
