//! From the plan to the law, the failure rule and the weights of every family.

use crate::damage::{Criterion, CriticalStretch};
use crate::deck::plan::{
    Body, InterfaceRule, Law, NormalisedForm, Plan, PointSource, Toughness, VolumeCorrection,
};
use crate::dimension::Dimension;
use crate::elastic::Isotropic;
use crate::families::{BlockBonds, CellShare};
use crate::material::{
    AnyLaw, ElasticPlasticPmb, Influence, LinearMicroelastic, Normalised, Ordinary, PairLaw, Pmb,
};
use crate::points::distance_squared;

use super::bonds::{BlockLaws, Interaction};
use super::model::Model;

/// The elastic constants and the horizon (m) that an end of bonds has.
#[derive(Clone, Copy)]
struct Constants {
    elastic: Isotropic,
    horizon: f64,
}

/// Those of the own end of the bonds from one body to another.
fn constants(plan: &Plan, here: &Body, there: &Body) -> Constants {
    let [own, other] = [here, there].map(|body| (body.material.elastic, body.horizon));
    let combine = |of: fn(f64, f64) -> f64| Constants {
        elastic: Isotropic {
            youngs_modulus: of(own.0.youngs_modulus, other.0.youngs_modulus),
            ..own.0
        },
        horizon: of(own.1, other.1),
    };
    match plan.interface.between(here, there) {
        InterfaceRule::Own => combine(|own, _| own),
        InterfaceRule::Average => combine(|own, other| 0.5 * (own + other)),
        InterfaceRule::Minimum => combine(f64::min),
    }
}

/// The constant of Diehl & Schweitzer 2016, eq. 15, for a family of the whole horizon: 9K/Σ V, divided
/// by the horizon, which stands in the influence.
fn diehl_reference(dimension: Dimension, constants: Constants) -> f64 {
    let volume = match dimension {
        Dimension::Space => 4.0 / 3.0 * std::f64::consts::PI * constants.horizon.powi(3),
        _ => std::f64::consts::PI * constants.horizon.powi(2) * dimension.section(),
    };
    9.0 * constants.elastic.bulk_modulus() / (volume * constants.horizon)
}

fn ordinary(dimension: Dimension, elastic: Isotropic) -> Ordinary {
    Ordinary::new(dimension, elastic).expect("the deck has no ordinary law in 1-D")
}

/// The law of a body with these constants.
fn law(plan: &Plan, body: &Body, constants: Constants) -> AnyLaw {
    let (dimension, modulus) = (plan.dimension, constants.elastic.youngs_modulus);
    let plain = Pmb::new(dimension, modulus, constants.horizon);
    let energy = Pmb::isotropic_energy(dimension, modulus);
    // A critical stretch that the deck gives itself holds for all bonds.
    let calibrated = body
        .damage
        .as_ref()
        .is_some_and(|damage| !matches!(damage.toughness, Toughness::CriticalStretch(_)));
    let normalised = |energy, reference| {
        AnyLaw::Normalised(Normalised {
            energy,
            reference: calibrated.then_some(reference),
        })
    };
    match &body.material.law {
        Law::Pmb { corrected: false } | Law::Proportional { corrected: false } => {
            AnyLaw::Pmb(plain)
        }
        Law::Pmb { corrected: true }
        | Law::Proportional { corrected: true }
        | Law::NormalisedPmb(NormalisedForm::Energy) => normalised(energy, plain.micromodulus),
        Law::NormalisedPmb(NormalisedForm::Diehl2016) => normalised(
            2.25 * constants.elastic.bulk_modulus(),
            diehl_reference(dimension, constants),
        ),
        Law::LinearMicroelastic { lambda, corrected } => {
            AnyLaw::LinearMicroelastic(LinearMicroelastic {
                micromodulus: lambda.as_ref().map_or(plain.micromodulus, |_| 1.0),
                corrected_to: corrected.then_some(energy),
            })
        }
        Law::Ordinary(_) => AnyLaw::Ordinary(ordinary(dimension, constants.elastic)),
    }
}

/// What bonds of this length (m) are multiplied by in all sums of a body's points.
fn influence(body: &Body, horizon: f64, length: f64) -> f64 {
    match &body.material.law {
        Law::Ordinary(influence) => influence.at(length, horizon),
        Law::NormalisedPmb(NormalisedForm::Diehl2016) => Influence::Inverse.at(length, horizon),
        Law::LinearMicroelastic {
            lambda: Some(lambda),
            ..
        } => lambda.evaluate([length, 0.0, 0.0], 0.0) * length.powi(3),
        _ => 1.0,
    }
}

/// Whether [`influence`] is 1 for all lengths.
fn has_no_influence(body: &Body) -> bool {
    matches!(
        body.material.law,
        Law::Pmb { .. }
            | Law::Proportional { .. }
            | Law::NormalisedPmb(NormalisedForm::Energy)
            | Law::LinearMicroelastic { lambda: None, .. }
            | Law::Ordinary(Influence::Constant)
    )
}

/// The share of a body's cells in the families of a horizon.
fn cell_share(plan: &Plan, neighbours: &Body, horizon: f64) -> CellShare {
    let edge = match neighbours.points {
        // Only cells with equal edges are corrected.
        PointSource::Lattice { spacing, .. } => spacing[0],
        PointSource::File { .. } => 0.0,
    };
    CellShare::new(
        plan.volume_correction,
        horizon,
        edge,
        plan.dimension.count(),
    )
}

/// The longest bond (m) of each pair of blocks, row by row.
pub fn cutoffs(plan: &Plan) -> Vec<f64> {
    let reach = |here: &Body, there: &Body| {
        let horizon = constants(plan, here, there).horizon;
        cell_share(plan, there, horizon).cutoff()
    };
    let bodies = &plan.bodies;
    let pairs = bodies
        .iter()
        .flat_map(|here| bodies.iter().map(move |there| (here, there)));
    pairs
        .map(|(here, there)| reach(here, there).max(reach(there, here)))
        .collect()
}

/// What the points of a block follow.
pub fn block_laws(plan: &Plan, body: &Body) -> BlockLaws {
    let constants = constants(plan, body, body);
    BlockLaws {
        law: law(plan, body, constants),
        damage: damage(plan, body, constants),
    }
}

/// The damage law of a block.
fn damage(plan: &Plan, body: &Body, constants: Constants) -> Option<CriticalStretch> {
    let damage = body.damage.as_ref()?;
    let (dimension, Constants { elastic, horizon }) = (plan.dimension, constants);
    let from_energy = |energy: f64| match &body.material.law {
        Law::Ordinary(influence) => {
            let law = ordinary(dimension, elastic);
            CriticalStretch::from_energy_ordinary(&law, *influence, energy, horizon)
        }
        // Eq. 16–17 as printed in the plane; in space the sum over the bonds across a plane.
        Law::NormalisedPmb(NormalisedForm::Diehl2016) => {
            let c = diehl_reference(dimension, constants) * horizon;
            match dimension {
                Dimension::Space => {
                    (8.0 * energy / (std::f64::consts::PI * c * horizon.powi(4))).sqrt()
                }
                _ => (1.5 * energy / (c * dimension.section() * horizon.powi(3))).sqrt(),
            }
        }
        _ => CriticalStretch::from_energy(dimension, elastic, energy, horizon),
    };
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

/// Gives the bonds between two blocks their laws, criterion and weights. A bond between blocks breaks
/// at the smaller of the two thresholds, of which a block without damage has none.
pub fn assign<const D: usize>(
    plan: &Plan,
    model: &Model<D>,
    blocks: &[BlockLaws],
    all: Vec<BlockBonds>,
) -> Vec<Interaction> {
    let per_point = blocks
        .iter()
        .any(|block| block.damage.is_some_and(|law| law.alpha > 0.0));
    let give = |mut bonds: BlockBonds| {
        let ends = bonds.blocks();
        let critical = ends.map(|block| blocks[block].damage.map(|law| law.critical));
        let criterion = match critical.into_iter().flatten().reduce(f64::min) {
            None => Criterion::Never,
            Some(_) if per_point => {
                Criterion::Thresholds(critical.map(|critical| critical.unwrap_or(0.0)))
            }
            Some(smallest) => Criterion::Stretch(smallest),
        };
        let [here, there] = ends.map(|block| &plan.bodies[block]);
        let [own, far] = [(here, there), (there, here)]
            .map(|(body, other)| (body, other, constants(plan, body, other)));
        weigh(plan, model, &mut bonds, [own, far]);
        Interaction {
            bonds,
            laws: PairLaw::new(law(plan, own.0, own.2), law(plan, far.0, far.2)),
            criterion,
        }
    };
    all.into_iter().map(give).collect()
}

/// Sets the weights of the bonds between two blocks, unless they are all 1. An end is its body, the other body and the
/// constants there.
fn weigh<const D: usize>(
    plan: &Plan,
    model: &Model<D>,
    bonds: &mut BlockBonds,
    ends: [(&Body, &Body, Constants); 2],
) {
    let [own, far] = &ends;
    let same_horizon = own.2.horizon == far.2.horizon;
    let plain = plan.volume_correction == VolumeCorrection::None
        && same_horizon
        && has_no_influence(own.0)
        && has_no_influence(far.0);
    if plain {
        return;
    }
    // The far end of bonds within a block has the same weights.
    let [here, there] = bonds.blocks();
    let count = if here == there { 1 } else { 2 };
    for (end, (body, other, constants)) in ends.iter().enumerate().take(count) {
        let horizon = constants.horizon;
        let share = cell_share(plan, other, horizon);
        let weight = |offset: [f64; 3]| {
            let length = distance_squared([0.0; 3], offset).sqrt();
            share.at(offset) * influence(body, horizon, length)
        };
        match bonds {
            BlockBonds::Lattice(lattice) => lattice.weigh(end, weight),
            BlockBonds::List(list) => list.weigh(end, |here, there| {
                let [a, b] = [here, there].map(|point| model.position(point));
                weight(std::array::from_fn(|k| b[k] - a[k]))
            }),
        }
    }
}
