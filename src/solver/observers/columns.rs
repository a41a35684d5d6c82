//! The columns of the history: each with its name, its unit and what its value is, in one place.

use crate::component::AXES;
use crate::solver::contact::ContactNow;
use crate::solver::motion::Clock;
use crate::solver::motion::load_step::LoadStep;

use super::fragments::Fragments;
use super::history::Energies;
use super::tip::TipNow;

/// Global quantities of one row of the history; the same on all ranks.
pub struct GlobalState {
    /// Time and step.
    pub clock: Clock,
    /// Energies of the whole body.
    pub energies: Energies,
    /// By component, kg m/s.
    pub momentum: Vec<f64>,
    /// About the origin, kg m²/s: z in plane problems, x, y and z of solids, where the history has it.
    pub angular_momentum: Vec<f64>,
    /// Bonds broken since the start.
    pub broken: u64,
    /// Points above the threshold of damage, and the corners (m) of the box around them.
    pub cracked_points: u64,
    /// See `cracked_points`.
    pub cracked_extent: [[f64; 3]; 2],
    /// Points whose bonds left are too few for their law.
    pub singular_points: u64,
    /// State of the present load step.
    pub load_step: LoadStep,
    /// Force evaluations of the present load step.
    pub force_evaluations: u64,
    /// Steps undone so far, and the largest number of bonds of a point that a step has broken since the last row.
    pub undone_steps: u64,
    /// See `undone_steps`.
    pub most_broken: u64,
    /// What changes of the density scale have added, J.
    pub density_scale_energy: f64,
    /// Number of points.
    pub points: u64,
    /// What refinements have added, J.
    pub refinement_energy: f64,
    /// Forces of supports on each set by component, N.
    pub reactions: Vec<Vec<f64>>,
    /// Forces of supports in a direction, N.
    pub support_forces: Vec<f64>,
    /// Values of the columns of each probe.
    pub probes: Vec<Vec<f64>>,
    /// Values of the columns of the statistics of each field.
    pub statistics: Vec<Vec<f64>>,
    /// Position of each front, m.
    pub fronts: Vec<f64>,
    /// Length (m) and number of branches of each crack.
    pub cracks: Vec<(f64, usize)>,
    /// Of each crack tip.
    pub tips: Vec<TipNow>,
    /// Contact.
    pub contact: ContactNow,
    /// Fragments, where the history has them.
    pub fragments: Fragments,
}

/// The value of a column.
type Value = Box<dyn Fn(&GlobalState) -> f64>;

/// The columns in their order.
pub struct Columns {
    dimension: usize,
    names: Vec<(String, &'static str)>,
    values: Vec<Value>,
}

impl Columns {
    /// None yet, of a history in so many dimensions.
    pub fn new(dimension: usize) -> Self {
        Self {
            dimension,
            names: Vec::new(),
            values: Vec::new(),
        }
    }

    /// Adds a column.
    pub fn add(
        &mut self,
        name: impl Into<String>,
        unit: &'static str,
        value: impl Fn(&GlobalState) -> f64 + 'static,
    ) {
        self.names.push((name.into(), unit));
        self.values.push(Box::new(value));
    }

    /// Adds a column for each component.
    pub fn add_vector(
        &mut self,
        name: &str,
        unit: &'static str,
        value: impl Fn(&GlobalState, usize) -> f64 + Copy + 'static,
    ) {
        for (d, axis) in AXES[..self.dimension].iter().enumerate() {
            self.add(format!("{name}_{axis}"), unit, move |now| value(now, d));
        }
    }

    /// Name and unit of each.
    pub fn names(&self) -> &[(String, &'static str)] {
        &self.names
    }

    /// The value of a column in a row.
    pub fn value(&self, row: &[f64], name: &str) -> Option<f64> {
        let place = self.names.iter().position(|(own, _)| own == name);
        place.map(|place| row[place])
    }

    /// The values now.
    pub fn row(&self, now: &GlobalState) -> Vec<f64> {
        self.values.iter().map(|value| value(now)).collect()
    }
}
