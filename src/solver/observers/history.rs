//! The history of a run: energies and other sums, probes, fronts, cracks, crack tips and J integrals.

use std::ops::Range;

use rayon::prelude::*;

use crate::comm::sum::{ExactSum, reduce};
use crate::component::{AXES, entries};
use crate::error::Result;
use crate::material::Law;
use crate::problem::{self, Field, Problem, Reaction};
use crate::solver::Simulation;
use crate::solver::assign::block_laws;
use crate::solver::conditions::{members, not_empty};
use crate::solver::contact::contact_now;
use crate::solver::motion::load_step::LoadStep;

use super::centre_line::{self, Branch};
use super::columns::{Columns, GlobalState};
use super::crack_path::CrackPath;
use super::crack_surface::{CrackSurface, Surface};
use super::cracked::Cracked;
use super::fragments::Fragments;
use super::front::Front;
use super::j_integral::JIntegrals;
use super::nearest::nearest;
use super::row_fields::RowFields;
use super::snapshot::Snapshot;
use super::statistics::{self, FieldStatistics};
use super::tip::Tip;

/// Number of points that one task sums; the sums of all tasks are then merged.
const CHUNK: usize = 4096;

/// A point whose values the history contains.
struct Probe {
    /// Local index of the point on its owner; `None` on other ranks.
    point: Option<usize>,
    /// Requested fields other than displacement and velocity.
    fields: Vec<Field>,
}

/// The columns of the history, and the data for computing them.
pub struct HistoryObserver {
    columns: Columns,
    /// For each set of `reactions` in the deck, this rank's points of the set.
    reactions: Vec<Vec<u32>>,
    /// For each `[history.force.NAME]` of the deck, this rank's points of the set, and the direction in which
    /// the component of the force is taken.
    support_forces: Vec<(Vec<u32>, [f64; 3])>,
    statistics: Vec<FieldStatistics>,
    probes: Vec<Probe>,
    fronts: Vec<Front>,
    /// Cracks in 2-D, with centre lines.
    cracks: Vec<CrackPath>,
    /// Cracks in 3-D, with surfaces.
    surfaces: Vec<CrackSurface>,
    tips: Vec<Tip>,
    j_integrals: JIntegrals,
    /// Two reference values: energies minus work in the first row (J; see [`Energies::error`]), and number of
    /// bonds that were intact before any bond could break. Each bond counts twice. `None` before the first
    /// row.
    start: Option<(f64, u64)>,
}

/// Energies of all bodies, J.
#[derive(Debug, Clone, Copy, Default)]
pub struct Energies {
    /// ½ Σ ρ V u̇² of the points.
    pub kinetic: f64,
    /// Σ W V, with the strain energy density W.
    pub strain: f64,
    /// Energy released by broken bonds.
    pub fracture: f64,
    /// Overshoot energy, a part of `fracture`: the energies of the broken bonds when they broke, minus the
    /// energies at which they met their criterion.
    pub overshoot: f64,
    /// Kinetic energy of rigid bodies.
    pub rigid: f64,
    /// Energy stored in contacts.
    pub contact: f64,
    /// Work done by loads and supports, and by the prescribed forces and motions of rigid bodies.
    pub work: f64,
    /// Energy dissipated by viscous damping, plastic flow, softening, viscoelasticity, friction and contact
    /// damping.
    pub dissipated: f64,
    /// Error of the energy balance. Let S be kinetic + rigid + strain + contact + fracture + dissipated −
    /// work. The error is the change of S since the first row, minus the energy that refinements and changes
    /// of the density scale have added. An exact integrator has the error 0.
    pub error: f64,
}

/// One row of the history.
#[derive(Debug, Clone)]
pub struct HistoryRow {
    /// Values in the order of the columns; the same on all ranks.
    pub values: Vec<f64>,
    /// Step number of the row.
    pub number: u64,
    /// Energies of the row.
    pub energies: Energies,
    /// Value of S in the first row, J. S is the sum of the energies minus the work, see [`Energies::error`].
    pub first_energy: f64,
    /// Upper estimate of the kinetic energy (J) that loads and prescribed motions add in a step, but that is
    /// not part of the recorded work; see `Conditions::step_energy`.
    pub step_energy: f64,
    /// Number of bonds broken since the start.
    pub broken: u64,
}

impl HistoryRow {
    /// Return the largest absolute value among the energies of the balance and [`Self::first_energy`], J.
    pub fn largest_energy(&self) -> f64 {
        let Energies {
            kinetic,
            strain,
            fracture,
            overshoot: _,
            rigid,
            contact,
            work,
            dissipated,
            error: _,
        } = self.energies;
        let start = self.first_energy;
        let all = [
            kinetic, strain, fracture, rigid, contact, work, dissipated, start,
        ];
        all.map(f64::abs).into_iter().fold(0.0, f64::max)
    }
}

/// Sums over the points of this rank, to be added over all ranks in one message.
#[derive(Default)]
struct Sums(Vec<ExactSum>);

impl Sums {
    /// Append a sum and return its position.
    fn push(&mut self, sum: ExactSum) -> usize {
        self.0.push(sum);
        self.0.len() - 1
    }

    /// Append several sums and return their positions.
    fn extend(&mut self, sums: impl IntoIterator<Item = ExactSum>) -> Range<usize> {
        let start = self.0.len();
        self.0.extend(sums);
        start..self.0.len()
    }
}

impl HistoryObserver {
    /// Find the points of all sets, probes, fronts, cracks, tips and J integrals of the history. Collective.
    ///
    /// # Errors
    /// - If a set is empty.
    /// - If no point lies along the line of a front.
    /// - If all points in the set of a crack tip lie behind the start of the tip's line.
    /// - If the box of a J integral contains no point.
    /// - If the crack of a J integral grows along an axis, but the bodies end less than one horizon beyond
    ///   the box along this axis.
    /// - If no body lies on the line that approximates the crack front of a J integral.
    ///
    /// The error is the same on all ranks.
    pub fn new<const D: usize>(simulation: &Simulation<'_, D>) -> Result<Self> {
        let (problem, comm) = (simulation.problem, simulation.comm);
        let history = &problem.history;
        let find = |set: usize, key: &str, span: &Range<usize>| {
            let points = members(problem, &simulation.model, set);
            not_empty(problem, comm, set, &points, (key, span.clone()))?;
            Ok(points)
        };
        let reactions = history.reactions.iter();
        let reactions = reactions.map(|rule| find(rule.set, "[history] reactions", &rule.span));
        let reactions = reactions.collect::<Result<_>>()?;
        let support_forces = history.support_forces.iter().map(|rule| {
            let key = format!("[history.force.{}] set", rule.name);
            Ok((find(rule.set, &key, &rule.span)?, rule.direction))
        });
        let support_forces = support_forces.collect::<Result<_>>()?;
        let statistics = history.statistics.iter();
        let statistics = statistics.map(|rule| FieldStatistics::new(simulation, rule));
        let statistics = statistics.collect::<Result<_>>()?;
        let probe = |probe: &problem::Probe| Probe {
            point: nearest(simulation, probe.at).own,
            fields: probe.fields.clone(),
        };
        let probes = history.probes.iter().map(probe).collect();
        let fronts = history.fronts.iter();
        let fronts = fronts.map(|front| Front::new(simulation, front));
        let fronts = fronts.collect::<Result<_>>()?;
        let (in_plane, in_space) = if D == 3 {
            (&[][..], &history.cracks[..])
        } else {
            (&history.cracks[..], &[][..])
        };
        let cracks = in_plane.iter();
        let cracks = cracks.map(|rule| CrackPath::new(simulation, rule));
        let cracks = cracks.collect::<Result<_>>()?;
        let surfaces = in_space.iter();
        let surfaces = surfaces.map(|rule| CrackSurface::new(simulation, rule));
        let surfaces = surfaces.collect::<Result<_>>()?;
        let tips = history.tips.iter();
        let tips = tips.map(|tip| Tip::new(simulation, tip));
        let tips = tips.collect::<Result<_>>()?;
        Ok(Self {
            columns: columns_of::<D>(problem),
            reactions,
            support_forces,
            statistics,
            probes,
            fronts,
            cracks,
            surfaces,
            tips,
            j_integrals: JIntegrals::new(simulation)?,
            start: None,
        })
    }

    /// Find the points of the history again after a rebalance or refinement. Collective.
    ///
    /// # Errors
    /// Same as for [`Self::new`].
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
        self.columns.names()
    }

    /// Two reference values for all rows. The first value is the sum S of [`Energies::error`] in the
    /// first row, J. The second value is the number of bonds that were intact before any bond could break.
    /// Each bond counts twice. `None` before the first row.
    pub fn start(&self) -> Option<(f64, u64)> {
        self.start
    }

    /// Continue a history with these [reference values](Self::start).
    pub fn continue_from(&mut self, start: (f64, u64)) {
        self.start = Some(start);
    }

    /// Read the crack length of each tracked tip from earlier rows. The next speeds of the tips depend on
    /// these lengths.
    pub fn record_past(&mut self, rows: &[Vec<f64>]) {
        for row in rows {
            let value = |name: &str| self.columns.value(row, name);
            for tip in &mut self.tips {
                if let (Some(time), Some(length)) = (value("time"), value(&length_of(tip.name()))) {
                    tip.record_past(time, length);
                }
            }
        }
    }

    /// Name and present branches of each tracked crack path; the same on all ranks. Collective.
    pub fn crack_paths<const D: usize>(
        &self,
        simulation: &Simulation<'_, D>,
        snapshot: &Snapshot,
    ) -> Vec<(&str, Vec<Branch>)> {
        let damage = |point| snapshot.damage(&simulation.undeformed.family_volume, point);
        self.cracks
            .iter()
            .map(|crack| (crack.name(), crack.branches(simulation, damage)))
            .collect()
    }

    /// Name, start position (m) and surface of each tracked crack in 3-D, at the time of a snapshot; the same
    /// on all ranks. Collective.
    pub fn crack_surfaces<const D: usize>(
        &self,
        simulation: &mut Simulation<'_, D>,
        snapshot: &Snapshot,
    ) -> Vec<(&str, [f64; 3], Surface)> {
        let now = |crack: &'_ CrackSurface| crack.now(simulation, snapshot);
        let surfaces: Vec<Surface> = self.surfaces.iter().map(now).collect();
        let cracks = self.surfaces.iter().zip(surfaces);
        cracks
            .map(|(crack, surface)| (crack.name(), crack.from(), surface))
            .collect()
    }

    /// Compute the present row, then reset `most_broken` to 0. `most_broken` is the largest number of bonds
    /// that one point lost in one step. The next row therefore contains the largest number since this row.
    /// Collective.
    pub fn row<const D: usize>(
        &mut self,
        simulation: &mut Simulation<'_, D>,
        snapshot: &Snapshot,
    ) -> HistoryRow {
        let comm = simulation.comm;
        let contact = contact_now(simulation);
        let fragments = if simulation.problem.history.fragments {
            Fragments::now(simulation)
        } else {
            Fragments::default()
        };
        let (model, fields) = (&simulation.model, &simulation.fields);
        let mut sums = Sums::default();
        let own = sums.extend(point_sums(simulation, snapshot));
        let work = sums.push(sum(fields.external_work.as_deref().unwrap_or_default()));
        let mut dissipated = sum(fields.damped_energy.as_deref().unwrap_or_default());
        for (density, volume) in snapshot.stored.dissipated.iter().zip(model.volume.iter()) {
            dissipated.add(density * volume);
        }
        let dissipated = sums.push(dissipated);
        let overshoot = sums.push(sum(fields.overshoot_energy.as_deref().unwrap_or_default()));
        let step = simulation.clock.step();
        let step_energy = sums.push(simulation.conditions.step_energy(model, fields, step));
        let reaction = |members: &Vec<u32>| simulation.conditions.reaction(model, fields, members);
        let reactions = sums.extend(self.reactions.iter().flat_map(reaction));
        let directed = self.support_forces.iter().map(|(members, _)| members);
        let directed = sums.extend(directed.flat_map(reaction));
        let angular_momentum = if simulation.problem.history.angular_momentum {
            sums.extend(angular_momentum(simulation))
        } else {
            0..0
        };
        let sums = reduce(comm, &mut sums.0);
        let own = &sums[own];
        let [mut work, mut dissipated] = [sums[work], sums[dissipated]];

        let cracked = Cracked::new(simulation, snapshot);
        let intact = snapshot.intact();
        let singular = simulation.forces.can_be_singular().then(|| {
            let all = simulation.forces.singular(model);
            all.iter().filter(|value| **value > 0.0).count() as u64
        });
        let at_start = simulation.undeformed.intact.unwrap_or(intact);
        let mut counts = [intact, cracked.points, at_start, singular.unwrap_or(0)];
        comm.sum(&mut counts);
        let [intact, cracked_points, at_start, singular_points] = counts;
        let (lower, upper) = cracked.extent(comm);

        dissipated += contact.friction;
        dissipated += contact.damping;
        // The last bits of the results depend on the order of these additions, so the order must stay.
        let (mut kinetic, mut rigid_energy) = (own[0], 0.0);
        for (state, energy) in &contact.rigid {
            kinetic += energy;
            rigid_energy += energy;
            work += state.work;
        }
        let energy = kinetic + own[1] + own[2] + contact.energy + dissipated - work;
        let (first_energy, first_intact) = *self.start.get_or_insert((energy, at_start));
        let energies = Energies {
            kinetic: own[0],
            strain: own[1],
            fracture: own[2],
            overshoot: sums[overshoot],
            rigid: rigid_energy,
            contact: contact.energy,
            work,
            dissipated,
            error: energy
                - first_energy
                - simulation.progress.refined.energy
                - simulation.progress.density_scale_energy,
        };
        // Refinements add intact bonds, and remove some if horizons become shorter.
        let started_intact = first_intact as i64 + simulation.progress.refined.bonds;
        let broken = (started_intact - intact as i64) as u64 / 2;
        let most_broken = std::mem::take(&mut simulation.progress.step_control.most_broken);
        let support_forces = sums[directed].chunks_exact(D).zip(&self.support_forces);
        let support_forces = support_forces.map(|(force, (_, direction))| {
            let products = force.iter().zip(direction).map(|(f, d)| f * d);
            products.sum()
        });
        let mut fields = RowFields::new(snapshot);
        let probes = self.probe_values(simulation, &mut fields);
        let statistics = FieldStatistics::values(&self.statistics, simulation, &mut fields);
        let fronts = self.fronts.iter();
        let fronts = fronts
            .map(|front| front.position(simulation, &mut fields))
            .collect();
        let surfaces = self.surfaces.iter().map(|crack| {
            let surface = crack.now(simulation, snapshot);
            [surface.area, surface.reach]
        });
        let surfaces: Vec<[f64; 2]> = surfaces.collect();
        let damage = |point| snapshot.damage(&simulation.undeformed.family_volume, point);
        let cracks = self.cracks.iter().map(|crack| {
            let branches = crack.branches(simulation, damage);
            [centre_line::length(&branches), branches.len() as f64]
        });
        let cracks = cracks.chain(surfaces).collect();
        let tips = self.tips.iter_mut();
        let tips = tips.map(|tip| tip.row(simulation, damage)).collect();
        let j_integrals = self.j_integrals.values(simulation, snapshot);
        let values = self.columns.row(&GlobalState {
            clock: simulation.clock,
            energies,
            momentum: own[3..].to_vec(),
            angular_momentum: sums[angular_momentum].to_vec(),
            broken,
            cracked_points,
            cracked_extent: [lower, upper],
            singular_points,
            // An explicit step has no equilibrium.
            load_step: if simulation.is_quasi_static() {
                simulation.progress.load_step
            } else {
                LoadStep::default()
            },
            force_evaluations: simulation.progress.newton.evaluations,
            undone_steps: simulation.progress.step_control.undone,
            most_broken,
            density_scale_energy: simulation.progress.density_scale_energy,
            points: simulation.model.total,
            refinement_energy: simulation.progress.refined.energy,
            reactions: sums[reactions]
                .chunks_exact(D)
                .map(<[f64]>::to_vec)
                .collect(),
            support_forces: support_forces.collect(),
            statistics,
            probes,
            fronts,
            cracks,
            tips,
            j_integrals,
            contact,
            fragments,
        });
        HistoryRow {
            values,
            number: simulation.clock.number(),
            energies,
            first_energy,
            step_energy: sums[step_energy],
            broken,
        }
    }

    /// Return the values of each probe. The result is the same on all ranks. Collective.
    fn probe_values<const D: usize>(
        &self,
        simulation: &mut Simulation<'_, D>,
        fields: &mut RowFields<'_>,
    ) -> Vec<Vec<f64>> {
        let mut bits = Vec::new();
        let mut counts = Vec::new();
        for probe in &self.probes {
            let before = bits.len();
            for columns in [&simulation.fields.displacement, &simulation.fields.velocity] {
                let bits_of =
                    |point: usize| columns.each_ref().map(|column| column[point].to_bits());
                bits.extend(probe.point.map_or([0; D], bits_of));
            }
            for field in &probe.fields {
                let width = field.components();
                // All ranks compute the field together.
                let values = fields.get(simulation, *field);
                bits.extend(entries(width, D).map(|(entry, _)| {
                    let bits_of = |point: usize| values[width * point + entry].to_bits();
                    probe.point.map_or(0, bits_of)
                }));
            }
            counts.push(bits.len() - before);
        }
        // All ranks except the owner contribute 0, so the sum has the bits of the owner's value.
        simulation.comm.sum(&mut bits);
        let mut values = bits.into_iter().map(f64::from_bits);
        let of_probe = |count: usize| values.by_ref().take(count).collect();
        counts.into_iter().map(of_probe).collect()
    }
}

/// Name and unit of each column of the history of a problem.
pub fn column_names(problem: &Problem) -> Vec<(String, &'static str)> {
    let columns = match problem.dimension.count() {
        1 => columns_of::<1>(problem),
        2 => columns_of::<2>(problem),
        _ => columns_of::<3>(problem),
    };
    columns.names().to_vec()
}

/// Whether a law of the problem can have singular points, see [`Law::is_singular`].
fn can_be_singular<const D: usize>(problem: &Problem) -> bool {
    let mut blocks = problem.blocks();
    blocks.any(|block| Law::<D>::needs_shape(&block_laws(problem, &block).law))
}

/// The columns of the history of a problem.
fn columns_of<const D: usize>(problem: &Problem) -> Columns {
    let mut columns = Columns::new(D);
    columns.add("time", "s", |now| now.clock.time());
    columns.add("step", "1", |now| now.clock.number() as f64);
    columns.add("kinetic_energy", "J", |now| now.energies.kinetic);
    columns.add("strain_energy", "J", |now| now.energies.strain);
    columns.add("fracture_energy", "J", |now| now.energies.fracture);
    columns.add("external_work", "J", |now| now.energies.work);
    columns.add("dissipated_energy", "J", |now| now.energies.dissipated);
    columns.add("energy_error", "J", |now| now.energies.error);
    columns.add("broken_bonds", "1", |now| now.broken as f64);
    columns.add("cracked_points", "1", |now| now.cracked_points as f64);
    if problem.is_quasi_static() {
        columns.add("residual", "1", |now| now.load_step.residual);
        columns.add("iterations", "1", |now| now.load_step.iterations as f64);
    }
    if problem.has_newton() {
        let evaluations = |now: &GlobalState| now.force_evaluations as f64;
        columns.add("force_evaluations", "1", evaluations);
    }
    if problem.adapts() {
        columns.add("time_step", "s", |now| now.clock.step());
        columns.add("undone_steps", "1", |now| now.undone_steps as f64);
        columns.add("most_broken_bonds", "1", |now| now.most_broken as f64);
    }
    if problem.scales_density() {
        let ratio = |now: &GlobalState| now.energies.kinetic / now.energies.strain;
        columns.add("kinetic_ratio", "1", ratio);
    }
    if problem.changes_density_scale() {
        columns.add("density_scale_energy", "J", |now| now.density_scale_energy);
    }
    if problem.refinement_trigger().is_some() {
        columns.add("points", "1", |now| now.points as f64);
        columns.add("refinement_energy", "J", |now| now.refinement_energy);
    }
    columns.add_vector("momentum", "kg m/s", |now, d| now.momentum[d]);
    columns.add_vector("cracked_lower", "m", |now, d| now.cracked_extent[0][d]);
    columns.add_vector("cracked_upper", "m", |now, d| now.cracked_extent[1][d]);
    columns.add("overshoot_energy", "J", |now| now.energies.overshoot);
    if can_be_singular::<D>(problem) {
        columns.add("singular_points", "1", |now| now.singular_points as f64);
    }
    if problem.has_contact() {
        columns.add("contact_energy", "J", |now| now.contact.energy);
        columns.add("friction_energy", "J", |now| now.contact.friction);
        columns.add("contact_damping_energy", "J", |now| now.contact.damping);
    }
    if problem.history.fragments {
        columns.add("fragments", "1", |now| now.fragments.count as f64);
        columns.add("loose_points", "1", |now| now.fragments.loose as f64);
        columns.add("largest_fragment_mass", "kg", |now| {
            now.fragments.largest_mass
        });
        columns.add_vector("largest_fragment_momentum", "kg m/s", |now, d| {
            now.fragments.largest_momentum[d]
        });
    }
    for (k, rigid) in problem.rigid.iter().enumerate() {
        let of = |quantity: &str| format!("rigid_{}_{quantity}", rigid.name);
        columns.add_vector(&of("force"), "N", move |now, d| {
            now.contact.rigid[k].0.contact[d]
        });
        for axis in rotation_axes(D) {
            let name = format!("{}_{}", of("torque"), AXES[axis]);
            columns.add(name, "N m", move |now| {
                now.contact.rigid[k].0.contact[3 + axis]
            });
        }
        columns.add_vector(&of("position"), "m", move |now, d| {
            now.contact.rigid[k].0.position[d]
        });
        columns.add_vector(&of("velocity"), "m/s", move |now, d| {
            now.contact.rigid[k].0.velocity[d]
        });
        columns.add(of("kinetic_energy"), "J", move |now| now.contact.rigid[k].1);
    }
    if let Some(contact) = &problem.contact {
        columns.add("touching_pairs", "1", |now| now.contact.all.count as f64);
        columns.add("deepest_overlap", "m", |now| now.contact.all.overlap);
        for (k, pair) in contact.pairs.iter().enumerate() {
            let of = |quantity: &str| format!("contact_{}_{quantity}", pair.name);
            columns.add_vector(&of("force"), "N", move |now, d| {
                now.contact.pairs[k].force[d]
            });
            let count = move |now: &GlobalState| now.contact.pairs[k].count as f64;
            columns.add(of("touching_pairs"), "1", count);
            columns.add(of("deepest_overlap"), "m", move |now| {
                now.contact.pairs[k].overlap
            });
        }
    }
    for (k, Reaction { set, .. }) in problem.history.reactions.iter().enumerate() {
        let name = format!("reaction_{}", problem.sets[*set].name);
        columns.add_vector(&name, "N", move |now, d| now.reactions[k][d]);
    }
    for (k, rule) in problem.history.support_forces.iter().enumerate() {
        let name = format!("force_{}", rule.name);
        columns.add(name, "N", move |now| now.support_forces[k]);
    }
    if problem.history.angular_momentum {
        for (k, axis) in rotation_axes(D).enumerate() {
            let name = format!("angular_momentum_{}", AXES[axis]);
            columns.add(name, "kg m^2/s", move |now| now.angular_momentum[k]);
        }
    }
    for (k, rule) in problem.history.statistics.iter().enumerate() {
        for (column, (name, unit)) in statistics::columns(rule).enumerate() {
            columns.add(name, unit, move |now| now.statistics[k][column]);
        }
    }
    for (k, problem::Probe { name, fields, .. }) in problem.history.probes.iter().enumerate() {
        let mut count = 0;
        for field in [Field::Displacement, Field::Velocity].iter().chain(fields) {
            for (_, entry) in entries(field.components(), D) {
                let separator = if entry.is_empty() { "" } else { "_" };
                let name = format!("probe_{name}_{}{separator}{entry}", field.name());
                let column = count;
                columns.add(name, field.unit(), move |now| now.probes[k][column]);
                count += 1;
            }
        }
    }
    for (k, front) in problem.history.fronts.iter().enumerate() {
        let name = format!("front_{}", front.name);
        columns.add(name, "m", move |now| now.fronts[k]);
    }
    for (k, rule) in problem.history.cracks.iter().enumerate() {
        let of = |quantity: &str| format!("crack_{}_{quantity}", rule.name);
        let names = match D {
            3 => [("area", "m^2"), ("reach", "m")],
            _ => [("length", "m"), ("branches", "1")],
        };
        for (column, (quantity, unit)) in names.into_iter().enumerate() {
            columns.add(of(quantity), unit, move |now| now.cracks[k][column]);
        }
    }
    for (k, tip) in problem.history.tips.iter().enumerate() {
        let name = format!("tip_{}", tip.name);
        columns.add_vector(&name, "m", move |now, d| now.tips[k].position[d]);
        columns.add(length_of(&tip.name), "m", move |now| now.tips[k].length);
        columns.add(format!("{name}_speed"), "m/s", move |now| now.tips[k].speed);
    }
    for (k, rule) in problem.history.j_integrals.iter().enumerate() {
        let name = format!("j_integral_{}", rule.name);
        columns.add(name, "J/m^2", move |now| now.j_integrals[k]);
    }
    columns
}

/// Return the name of the history column for the length of a crack. `tip` is the name of the tip of this
/// crack.
fn length_of(tip: &str) -> String {
    format!("tip_{tip}_length")
}

fn sum(values: &[f64]) -> ExactSum {
    let mut sum = ExactSum::default();
    values.iter().for_each(|value| sum.add(*value));
    sum
}

/// Sum kinetic, strain and fracture energy and external work over all points, J. Collective.
pub fn state_energies<const D: usize>(simulation: &mut Simulation<'_, D>) -> [f64; 4] {
    let snapshot = Snapshot::new(simulation);
    let mut sums = point_sums(simulation, &snapshot);
    sums.truncate(3);
    let work = simulation.fields.external_work.as_deref();
    sums.push(sum(work.unwrap_or_default()));
    let sums = reduce(simulation.comm, &mut sums);
    std::array::from_fn(|k| sums[k])
}

/// Sum kinetic, strain and fracture energy (J), then momentum by component (kg m/s), over the owned points.
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
    sums_over(model.owned(), 3 + D, &add)
}

/// Axes of the angular momentum: z in 2-D, all in 3-D, none in 1-D.
fn rotation_axes(dimension: usize) -> std::ops::Range<usize> {
    match dimension {
        1 => 0..0,
        2 => 2..3,
        _ => 0..3,
    }
}

/// Sum the angular momentum ρ V y × u̇ of the owned points about the origin (kg m²/s), by axis. y is the
/// deformed position.
fn angular_momentum<const D: usize>(simulation: &Simulation<'_, D>) -> Vec<ExactSum> {
    let (model, fields) = (&simulation.model, &simulation.fields);
    let axes = rotation_axes(D);
    sums_over(model.owned(), axes.len(), &|sums, point| {
        let mass = model.density_of(point) * model.volume[point];
        let position = fields.position(model, point);
        for (sum, axis) in sums.iter_mut().zip(axes.clone()) {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            let velocity = [a, b].map(|d| fields.velocity[d][point]);
            sum.add(mass * (position[a] * velocity[1] - position[b] * velocity[0]));
        }
    })
}

/// Compute `width` exact sums over the points with local index below `count`. `add` adds the terms of a
/// point.
fn sums_over(
    count: usize,
    width: usize,
    add: &(dyn Fn(&mut [ExactSum], usize) + Sync),
) -> Vec<ExactSum> {
    (0..count.div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let mut sums = vec![ExactSum::default(); width];
            let range = chunk * CHUNK..((chunk + 1) * CHUNK).min(count);
            range.for_each(|point| add(&mut sums, point));
            sums
        })
        .reduce(
            || vec![ExactSum::default(); width],
            |mut a, b| {
                a.iter_mut().zip(&b).for_each(|(a, b)| a.merge(b));
                a
            },
        )
}
