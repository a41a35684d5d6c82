//! What does not change during a run: the points and their constants.

use crate::damage::CriticalStretch;
use crate::deck::plan::{Body, Law, Plan, Toughness};
use crate::families::BondList;
use crate::material::Pmb;
use crate::partition::Domain;

/// The local points by component, and the constants of the blocks.
pub struct Model<const D: usize> {
    /// Reference positions by component, m; owned points, then ghosts.
    pub reference: [Vec<f64>; D],
    /// Volumes, m³; owned points, then ghosts.
    pub volume: Vec<f64>,
    /// Block of each owned point.
    pub block: Vec<u16>,
    /// Global ids; owned points, then ghosts.
    pub ids: Vec<u64>,
    /// Density of each block, kg/m³.
    pub density: Vec<f64>,
    /// Number of owned points without bonds to ghosts; they come first.
    pub interior: usize,
    /// Number of points over all ranks.
    pub total: u64,
}

impl<const D: usize> Model<D> {
    /// From a distributed cloud.
    pub fn new(plan: &Plan, domain: &Domain) -> Self {
        let owned = &domain.points[..domain.owned];
        Self {
            reference: std::array::from_fn(|d| {
                domain
                    .points
                    .iter()
                    .map(|point| point.position[d])
                    .collect()
            }),
            volume: domain.points.iter().map(|point| point.volume).collect(),
            block: owned.iter().map(|point| point.block as u16).collect(),
            ids: domain.points.iter().map(|point| point.id).collect(),
            density: plan
                .bodies
                .iter()
                .map(|body| body.material.density)
                .collect(),
            interior: domain.interior,
            total: domain.total,
        }
    }

    /// Number of owned points.
    pub fn owned(&self) -> usize {
        self.block.len()
    }

    /// Reference position of a local point, m; components beyond the dimension are 0.
    pub fn position(&self, point: usize) -> [f64; 3] {
        let mut position = [0.0; 3];
        for d in 0..D {
            position[d] = self.reference[d][point];
        }
        position
    }

    /// Density of an owned point, kg/m³.
    pub fn density_of(&self, point: usize) -> f64 {
        self.density[usize::from(self.block[point])]
    }
}

/// The law of a list's bonds.
#[derive(Debug, Clone, Copy)]
pub enum ListLaw {
    /// Prototype microelastic.
    Pmb(Pmb),
}

/// When a list's bonds break.
#[derive(Debug, Clone, Copy)]
pub enum ListFailure {
    /// Never.
    Never,
    /// At this stretch.
    Uniform(f64),
    /// At the smaller of the thresholds of the two points.
    PerPoint,
}

/// A list with its law and failure.
pub struct Bonds {
    /// The bonds.
    pub list: BondList,
    /// Their law.
    pub law: ListLaw,
    /// When they break.
    pub failure: ListFailure,
}

/// The law of each block, with the constants that the horizon gives it.
pub fn block_law(plan: &Plan, body: &Body) -> ListLaw {
    let Law::Pmb = body.material.law;
    let modulus = body.material.elastic.youngs_modulus;
    ListLaw::Pmb(Pmb::new(plan.dimension, modulus, plan.horizon))
}

/// The damage law of each block.
pub fn block_damage(plan: &Plan, body: &Body) -> Option<CriticalStretch> {
    let damage = body.damage.as_ref()?;
    let (dimension, elastic) = (plan.dimension, body.material.elastic);
    let from_energy =
        |energy| CriticalStretch::from_energy(dimension, elastic, energy, plan.horizon);
    let critical = match damage.toughness {
        Toughness::CriticalStretch(stretch) => stretch,
        Toughness::FractureEnergy(energy) => from_energy(energy),
        Toughness::FractureToughness(toughness) => from_energy(
            CriticalStretch::energy_from_toughness(dimension, elastic, toughness),
        ),
    };
    Some(CriticalStretch {
        critical,
        alpha: damage.alpha,
    })
}

/// Gives each list its law and failure. A bond between blocks has the average of the two laws and
/// breaks at the smaller of the two thresholds; a block without damage has none.
pub fn assign(plan: &Plan, lists: Vec<BondList>) -> Vec<Bonds> {
    use crate::material::BondLaw;
    let damage: Vec<_> = plan
        .bodies
        .iter()
        .map(|body| block_damage(plan, body))
        .collect();
    let per_point = damage.iter().flatten().any(|law| law.alpha > 0.0);
    lists
        .into_iter()
        .map(|list| {
            let ListLaw::Pmb(here) = block_law(plan, &plan.bodies[list.here]);
            let ListLaw::Pmb(there) = block_law(plan, &plan.bodies[list.there]);
            let ends = [damage[list.here], damage[list.there]];
            let smallest = ends
                .iter()
                .flatten()
                .map(|law| law.critical)
                .reduce(f64::min);
            let failure = match smallest {
                None => ListFailure::Never,
                Some(_) if per_point => ListFailure::PerPoint,
                Some(critical) => ListFailure::Uniform(critical),
            };
            Bonds {
                list,
                law: ListLaw::Pmb(here.between(&there)),
                failure,
            }
        })
        .collect()
}
