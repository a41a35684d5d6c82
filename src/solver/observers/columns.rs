//! The columns of the history: name, unit and value of each column are defined together.

use crate::component::AXES;
use crate::solver::contact::ContactNow;
use crate::solver::motion::Clock;
use crate::solver::motion::load_step::LoadStep;

use super::fragments::Fragments;
use super::history::Energies;
use super::tip::TipNow;

/// Global quantities for one row of the history; the same on all ranks.
pub struct GlobalState {
    /// Time and step of the run.
    pub clock: Clock,
    /// Energies of all bodies.
    pub energies: Energies,
    /// Momentum by component, kg m/s.
    pub momentum: Vec<f64>,
    /// Angular momentum about the origin, kg m²/s: z in 2-D; x, y and z in 3-D. Empty if the history does not
    /// contain it.
    pub angular_momentum: Vec<f64>,
    /// Number of bonds broken since the start.
    pub broken: u64,
    /// Number of cracked points: points whose damage exceeds the `damage_threshold` of the history.
    pub cracked_points: u64,
    /// Lower and upper corner of the bounding box of the cracked points, m; NaN if there are no cracked
    /// points.
    pub cracked_extent: [[f64; 3]; 2],
    /// Number of singular points: points whose law gives no force.
    pub singular_points: u64,
    /// State of the present load step.
    pub load_step: LoadStep,
    /// Number of force evaluations of the present load step.
    pub force_evaluations: u64,
    /// Number of steps rolled back so far.
    pub undone_steps: u64,
    /// Largest number of bonds that broke at one point in one step, among the steps since the last row.
    pub most_broken: u64,
    /// Energy added by changes of the density scale, J.
    pub density_scale_energy: f64,
    /// Number of points.
    pub points: u64,
    /// Energy added by refinements, J.
    pub refinement_energy: f64,
    /// For each set in `reactions` of the deck, the components of the force of the supports on this set, N.
    pub reactions: Vec<Vec<f64>>,
    /// For each `[history.force.NAME]` of the deck, the component of the support force in the requested
    /// direction, N.
    pub support_forces: Vec<f64>,
    /// Values of the columns of each probe.
    pub probes: Vec<Vec<f64>>,
    /// Values of the requested statistics of each field.
    pub statistics: Vec<Vec<f64>>,
    /// Position of each front, m.
    pub fronts: Vec<f64>,
    /// Two values per crack. In 2-D: length (m) and number of branches. In 3-D: area (m²) and
    /// [`Surface::reach`](super::Surface::reach) (m).
    pub cracks: Vec<[f64; 2]>,
    /// State of each crack tip.
    pub tips: Vec<TipNow>,
    /// J integrals, J/m².
    pub j_integrals: Vec<f64>,
    /// Contact quantities: for all contacts together, and for each pair of bodies.
    pub contact: ContactNow,
    /// Fragments; empty if the history does not contain them.
    pub fragments: Fragments,
}

/// Function that computes the value of a column from the global quantities.
type Value = Box<dyn Fn(&GlobalState) -> f64>;

/// The columns of the history, in order.
pub struct Columns {
    dimension: usize,
    names: Vec<(String, &'static str)>,
    values: Vec<Value>,
}

impl Columns {
    /// Create an empty list of columns for this dimension.
    pub fn new(dimension: usize) -> Self {
        Self {
            dimension,
            names: Vec::new(),
            values: Vec::new(),
        }
    }

    /// Add a column with its name, its unit, and the function that computes its value.
    pub fn add(
        &mut self,
        name: impl Into<String>,
        unit: &'static str,
        value: impl Fn(&GlobalState) -> f64 + 'static,
    ) {
        self.names.push((name.into(), unit));
        self.values.push(Box::new(value));
    }

    /// Add a column for each component d, with the values `value(state, d)`.
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

    /// Name and unit of each column.
    pub fn names(&self) -> &[(String, &'static str)] {
        &self.names
    }

    /// Value of the column with this name in a row; `None` if there is no such column.
    pub fn value(&self, row: &[f64], name: &str) -> Option<f64> {
        let place = self.names.iter().position(|(own, _)| own == name);
        place.map(|place| row[place])
    }

    /// Compute a row from the present global quantities.
    pub fn row(&self, now: &GlobalState) -> Vec<f64> {
        self.values.iter().map(|value| value(now)).collect()
    }
}
