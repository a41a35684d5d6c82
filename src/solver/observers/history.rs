//! The history of a run: energies and other sums, probes, fronts, crack paths and crack tips.

use rayon::prelude::*;

use crate::comm::sum::{ExactSum, reduce};
use crate::error::Result;
use crate::problem::{self, Reaction};
use crate::solver::Simulation;
use crate::solver::conditions::{members, not_empty};

use super::centre_line::{self, Branch};
use super::crack_path::CrackPath;
use super::cracked::Cracked;
use super::front::Front;
use super::nearest::nearest;
use super::snapshot::Snapshot;
use super::tip::Tip;

/// Points summed by one task.
const CHUNK: usize = 4096;

/// Names of the components.
const AXES: [&str; 3] = ["x", "y", "z"];

/// A point that is followed.
struct Probe {
    /// Local index, on the rank that owns it.
    point: Option<usize>,
}

/// The columns of the history and what they need.
pub struct HistoryObserver {
    columns: Vec<(String, &'static str)>,
    reactions: Vec<Vec<u32>>,
    /// Points, and the direction in which the force on them counts.
    support_forces: Vec<(Vec<u32>, [f64; 3])>,
    probes: Vec<Probe>,
    fronts: Vec<Front>,
    cracks: Vec<CrackPath>,
    tips: Vec<Tip>,
    /// Whether points may be born.
    refines: bool,
    /// Energy (J) in the first row, and intact bonds before.
    start: Option<(f64, u64)>,
}

/// Energies of the whole body at one moment, J.
#[derive(Debug, Clone, Copy, Default)]
pub struct Energies {
    /// ½ Σ ρ V u̇².
    pub kinetic: f64,
    /// Σ W V.
    pub strain: f64,
    /// Set free by bonds that broke.
    pub fracture: f64,
    /// How much of that bonds held above their criterion when they were seen to break.
    pub overshoot: f64,
    /// Work done by loads and supports.
    pub work: f64,
    /// Taken by viscous damping and by bonds that yield.
    pub dissipated: f64,
    /// Kinetic + strain + fracture + dissipated − work, less its value at the start and what refinements
    /// and changes of the density scale have added: 0 for an exact integrator.
    pub error: f64,
}

/// One row of the history.
#[derive(Debug, Clone)]
pub struct HistoryRow {
    /// Values in the order of the columns; the same on all ranks.
    pub values: Vec<f64>,
    /// Number of the step that it is of.
    pub number: u64,
    /// The energies among them.
    pub energies: Energies,
    /// Energy at the start, which the error of the balance refers to, J.
    pub first_energy: f64,
    /// Kinetic energy, J, that loads and prescribed motions can give within a step before they do work.
    pub step_energy: f64,
    /// Bonds broken since the start.
    pub broken: u64,
}

impl HistoryObserver {
    /// Finds the sets, probes, lines and tips.
    ///
    /// # Errors
    /// On an empty set and on a line without points; the same on all ranks.
    pub fn new<const D: usize>(simulation: &Simulation<'_, D>) -> Result<Self> {
        let (problem, comm) = (simulation.problem, simulation.comm);
        let axes = &AXES[..D];
        let mut columns: Vec<(String, &'static str)> = [
            ("time", "s"),
            ("step", "1"),
            ("kinetic_energy", "J"),
            ("strain_energy", "J"),
            ("fracture_energy", "J"),
            ("external_work", "J"),
            ("dissipated_energy", "J"),
            ("energy_error", "J"),
            ("broken_bonds", "1"),
            ("cracked_points", "1"),
        ]
        .map(|(name, unit)| (name.to_owned(), unit))
        .into();
        if simulation.fields.relaxation_velocity.is_some() {
            columns.push(("residual".to_owned(), "1"));
            columns.push(("iterations".to_owned(), "1"));
        }
        if problem.adapts() {
            columns.push(("time_step".to_owned(), "s"));
            columns.push(("undone_steps".to_owned(), "1"));
            columns.push(("most_broken_bonds".to_owned(), "1"));
        }
        if problem.scales_density() {
            columns.push(("kinetic_ratio".to_owned(), "1"));
        }
        if problem.changes_density_scale() {
            columns.push(("density_scale_energy".to_owned(), "J"));
        }
        if simulation.may_refine() {
            columns.push(("points".to_owned(), "1"));
            columns.push(("refinement_energy".to_owned(), "J"));
        }
        let vector = |columns: &mut Vec<_>, name: String, unit| {
            columns.extend(axes.iter().map(|axis| (format!("{name}_{axis}"), unit)));
        };
        vector(&mut columns, "momentum".to_owned(), "kg m/s");
        vector(&mut columns, "cracked_lower".to_owned(), "m");
        vector(&mut columns, "cracked_upper".to_owned(), "m");
        columns.push(("overshoot_energy".to_owned(), "J"));
        if simulation.forces.can_be_singular() {
            columns.push(("singular_points".to_owned(), "1"));
        }
        let mut reactions = Vec::new();
        for Reaction { set, span } in &problem.history.reactions {
            let points = members(problem, &simulation.model, *set);
            let place = ("[history] reactions", span.clone());
            not_empty(problem, comm, *set, &points, place)?;
            reactions.push(points);
            vector(
                &mut columns,
                format!("reaction_{}", problem.sets[*set].name),
                "N",
            );
        }
        let mut support_forces = Vec::new();
        for rule in &problem.history.support_forces {
            let points = members(problem, &simulation.model, rule.set);
            let key = format!("[history.force.{}] set", rule.name);
            not_empty(problem, comm, rule.set, &points, (&key, rule.span.clone()))?;
            support_forces.push((points, rule.direction));
            columns.push((format!("force_{}", rule.name), "N"));
        }
        let mut probes = Vec::new();
        for problem::Probe { name, at, .. } in &problem.history.probes {
            let point = nearest(simulation, *at).own;
            probes.push(Probe { point });
            vector(&mut columns, format!("probe_{name}_displacement"), "m");
            vector(&mut columns, format!("probe_{name}_velocity"), "m/s");
        }
        let mut fronts = Vec::new();
        for front in &problem.history.fronts {
            fronts.push(Front::new(simulation, front)?);
            columns.push((format!("front_{}", front.name), "m"));
        }
        let mut cracks = Vec::new();
        for rule in &problem.history.cracks {
            cracks.push(CrackPath::new(simulation, rule)?);
            columns.push((format!("crack_{}_length", rule.name), "m"));
            columns.push((format!("crack_{}_branches", rule.name), "1"));
        }
        let mut tips = Vec::new();
        for tip in &problem.history.tips {
            tips.push(Tip::new(simulation, tip)?);
            let name = format!("tip_{}", tip.name);
            columns.extend(axes.iter().map(|axis| (format!("{name}_{axis}"), "m")));
            columns.push((format!("{name}_length"), "m"));
            columns.push((format!("{name}_speed"), "m/s"));
        }
        Ok(Self {
            columns,
            reactions,
            support_forces,
            probes,
            fronts,
            cracks,
            tips,
            refines: simulation.may_refine(),
            start: None,
        })
    }

    /// Finds sets, probes, lines and tips anew, after points have changed their ranks. Collective.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn follow<const D: usize>(&mut self, simulation: &Simulation<'_, D>) -> Result<()> {
        let mut new = Self::new(simulation)?;
        new.start = self.start;
        for (tip, old) in new.tips.iter_mut().zip(&mut self.tips) {
            tip.take_past(old);
        }
        *self = new;
        Ok(())
    }

    /// Name and unit of each column.
    pub fn columns(&self) -> &[(String, &'static str)] {
        &self.columns
    }

    /// Energy (J) in the first row and bonds that were intact before any could break, which later rows
    /// refer to.
    pub fn start(&self) -> Option<(f64, u64)> {
        self.start
    }

    /// Goes on with a history that [started](Self::start) so.
    pub fn continue_from(&mut self, start: (f64, u64)) {
        self.start = Some(start);
    }

    /// Takes note of rows of the past, as [`Self::row`] gave them.
    pub fn recall<const D: usize>(&mut self, rows: &[Vec<f64>]) {
        let width = D + 2;
        let first = self.columns.len() - width * self.tips.len();
        for row in rows {
            for (tip, values) in self.tips.iter_mut().zip(row[first..].chunks_exact(width)) {
                tip.recall(row[0], values[D]);
            }
        }
    }

    /// The name of each crack whose path is found, and its branches now; the same on all ranks.
    /// Collective.
    pub fn crack_paths<const D: usize>(
        &self,
        simulation: &Simulation<'_, D>,
        snapshot: &Snapshot,
    ) -> Vec<(&str, Vec<Branch>)> {
        let damage = |point| snapshot.damage(&simulation.family_volume, point);
        self.cracks
            .iter()
            .map(|crack| (crack.name(), crack.branches(simulation, damage)))
            .collect()
    }

    /// The present row; collective.
    pub fn row<const D: usize>(
        &mut self,
        simulation: &mut Simulation<'_, D>,
        snapshot: &Snapshot,
    ) -> HistoryRow {
        let comm = simulation.comm;
        let (model, fields) = (&simulation.model, &simulation.fields);
        let mut sums = point_sums(simulation, snapshot);
        sums.push(sum(fields.external_work.as_deref().unwrap_or_default()));
        let mut dissipated = sum(fields.damped_energy.as_deref().unwrap_or_default());
        for (density, volume) in snapshot.stored.dissipated.iter().zip(model.volume.iter()) {
            dissipated.add(density * volume);
        }
        sums.push(dissipated);
        sums.push(sum(fields.overshoot_energy.as_deref().unwrap_or_default()));
        let step = simulation.clock.step();
        sums.push(simulation.conditions.step_energy(model, fields, step));
        let directed = self.support_forces.iter().map(|(members, _)| members);
        for members in self.reactions.iter().chain(directed) {
            sums.extend(simulation.conditions.reaction(model, fields, members));
        }
        let sums = reduce(comm, &mut sums);
        let (own, rest) = sums.split_at(3 + D);
        let (&[work, dissipated, overshoot, step_energy], reactions) =
            rest.split_first_chunk().expect("four sums");

        let cracked = Cracked::new(simulation, snapshot);
        let intact = snapshot.intact();
        let singular = simulation.forces.can_be_singular().then(|| {
            let all = simulation.forces.singular(model);
            all.iter().filter(|value| **value > 0.0).count() as u64
        });
        let at_start = simulation.intact_at_start.unwrap_or(intact);
        let mut counts = [intact, cracked.points, at_start, singular.unwrap_or(0)];
        comm.sum(&mut counts);
        let [intact, cracked_points, at_start, singular_points] = counts;
        let (lower, upper) = cracked.extent(comm);

        let energy = own[0] + own[1] + own[2] + dissipated - work;
        let (first_energy, first_intact) = *self.start.get_or_insert((energy, at_start));
        let energies = Energies {
            kinetic: own[0],
            strain: own[1],
            fracture: own[2],
            overshoot,
            work,
            dissipated,
            error: energy
                - first_energy
                - simulation.refined.energy
                - simulation.density_scale_energy,
        };
        // Refinements add intact bonds, and take some away where horizons become shorter.
        let there_were = first_intact as i64 + simulation.refined.bonds;
        let broken = (there_were - intact as i64) as u64 / 2;
        let mut values = vec![
            simulation.clock.time(),
            simulation.clock.number() as f64,
            energies.kinetic,
            energies.strain,
            energies.fracture,
            energies.work,
            energies.dissipated,
            energies.error,
            broken as f64,
            cracked_points as f64,
        ];
        if fields.relaxation_velocity.is_some() {
            let load_step = simulation.load_step;
            values.extend([load_step.residual, load_step.iterations as f64]);
        }
        if simulation.problem.adapts() {
            let control = &mut simulation.step_control;
            let most = std::mem::take(&mut control.most_broken);
            let counts = [control.undone, most].map(|count| count as f64);
            values.push(simulation.clock.step());
            values.extend(counts);
        }
        if simulation.problem.scales_density() {
            values.push(energies.kinetic / energies.strain);
        }
        if simulation.problem.changes_density_scale() {
            values.push(simulation.density_scale_energy);
        }
        if self.refines {
            values.extend([simulation.model.total as f64, simulation.refined.energy]);
        }
        values.extend(&own[3..]);
        values.extend(&lower[..D]);
        values.extend(&upper[..D]);
        values.push(energies.overshoot);
        values.extend(singular.map(|_| singular_points as f64));
        let (reactions, directed) = reactions.split_at(D * self.reactions.len());
        values.extend(reactions);
        for (force, (_, direction)) in directed.chunks_exact(D).zip(&self.support_forces) {
            let products = force.iter().zip(direction).map(|(f, d)| f * d);
            values.push(products.sum());
        }
        values.extend(self.probe_values(simulation));
        for front in &self.fronts {
            values.push(front.position(simulation, snapshot));
        }
        let damage = |point| snapshot.damage(&simulation.family_volume, point);
        for crack in &self.cracks {
            let branches = crack.branches(simulation, damage);
            values.push(centre_line::length(&branches));
            values.push(branches.len() as f64);
        }
        for tip in &mut self.tips {
            values.extend(tip.row(simulation, damage));
        }
        HistoryRow {
            values,
            number: simulation.clock.number(),
            energies,
            first_energy,
            step_energy,
            broken,
        }
    }

    /// Displacement and velocity of the probes, from the ranks that own their points to all.
    fn probe_values<const D: usize>(&self, simulation: &Simulation<'_, D>) -> Vec<f64> {
        let fields = &simulation.fields;
        let mut bits: Vec<u64> = self
            .probes
            .iter()
            .flat_map(|probe| {
                let at = |field: &[Vec<f64>; D], d: usize| {
                    probe.point.map_or(0, |point| field[d][point].to_bits())
                };
                let displacement = (0..D).map(move |d| at(&fields.displacement, d));
                displacement.chain((0..D).map(move |d| at(&fields.velocity, d)))
            })
            .collect();
        // One rank has the bits, the others add nothing.
        simulation.comm.sum(&mut bits);
        bits.into_iter().map(f64::from_bits).collect()
    }
}

fn sum(values: &[f64]) -> ExactSum {
    let mut sum = ExactSum::default();
    values.iter().for_each(|value| sum.add(*value));
    sum
}

/// Kinetic, strain and fracture energy (J), then momentum by component (kg m/s), of the owned points.
pub(in crate::solver) fn point_sums<const D: usize>(
    simulation: &Simulation<'_, D>,
    snapshot: &Snapshot,
) -> Vec<ExactSum> {
    let (model, fields) = (&simulation.model, &simulation.fields);
    let add = |sums: &mut [ExactSum], point: usize| {
        let mass = model.density_of(point) * model.volume[point];
        let mut square = 0.0;
        for (d, sum) in sums[3..].iter_mut().enumerate() {
            let velocity = fields.velocity[d][point];
            square += velocity * velocity;
            sum.add(mass * velocity);
        }
        sums[0].add(0.5 * mass * square);
        sums[1].add(snapshot.stored.energy[point] * model.volume[point]);
        if let Some(freed) = &fields.freed_energy {
            sums[2].add(freed[point]);
        }
    };
    (0..model.owned().div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let mut sums = vec![ExactSum::default(); 3 + D];
            let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(model.owned());
            range.for_each(|point| add(&mut sums, point));
            sums
        })
        .reduce(
            || vec![ExactSum::default(); 3 + D],
            |mut a, b| {
                a.iter_mut().zip(&b).for_each(|(a, b)| a.merge(b));
                a
            },
        )
}
