//! From the plan to the law, the failure rule and the weights of every family.

use crate::damage::{Criterion, CriticalStretch};
use crate::deck::plan::{self, Block, Body, InterfaceRule, Plan, Toughness, VolumeCorrection};
use crate::elastic::Isotropic;
use crate::error::{Error, Result};
use crate::families::{BlockBonds, CellShare};
use crate::material::{Built, Given, PairLaw};
use crate::points::distance_squared;

use super::bonds::{BlockLaws, Interaction};
use super::model::Model;

/// The elastic constants and the horizon (m) that an end of bonds has.
#[derive(Clone, Copy)]
struct Constants {
    elastic: Isotropic,
    horizon: f64,
}

/// Those of the own end of the bonds from one block to another.
fn constants(plan: &Plan, here: &Block, there: &Block) -> Constants {
    let [own, other] = [here, there].map(|block| (block.body.material.elastic, block.horizon));
    let combine = |of: fn(f64, f64) -> f64| Constants {
        elastic: Isotropic {
            youngs_modulus: of(own.0.youngs_modulus, other.0.youngs_modulus),
            ..own.0
        },
        horizon: of(own.1, other.1),
    };
    match plan.interface.between(here.body, there.body) {
        // Where there are no bonds, these are asked for none.
        InterfaceRule::Own | InterfaceRule::None => combine(|own, _| own),
        InterfaceRule::Average => combine(|own, other| 0.5 * (own + other)),
        InterfaceRule::Minimum => combine(f64::min),
    }
}

/// An error if a body has a law that cannot be made, or damage and a law whose bonds never break.
///
/// # Errors
/// For plans made in Rust; what a deck says is checked where it is read.
pub fn laws_are_possible(plan: &Plan) -> Result<()> {
    for body in &plan.bodies {
        let law = &body.material.law;
        let fault = law.fault(plan.dimension).map(|fault| fault.message);
        let fault = fault.or_else(|| law.damage_fault().filter(|_| body.damage.is_some()));
        if let Some(fault) = fault {
            let name = law.declaration.name;
            return Err(Error::input(format!(
                "[body.{}] law `{name}`: {fault}",
                body.name
            )));
        }
    }
    Ok(())
}

/// What the law of a body is made from.
fn given<'a>(plan: &Plan, body: &'a Body, constants: Constants) -> Given<'a> {
    // A critical stretch that the plan gives itself holds for all bonds.
    let itself =
        |damage: &plan::CriticalStretch| matches!(damage.toughness, Toughness::CriticalStretch(_));
    Given {
        dimension: plan.dimension,
        elastic: constants.elastic,
        horizon: constants.horizon,
        values: &body.material.law.values,
        from_fracture_energy: body.damage.as_ref().is_some_and(|damage| !itself(damage)),
    }
}

/// The law of a body with these constants.
fn build(plan: &Plan, body: &Body, constants: Constants) -> Built {
    (body.material.law.declaration.build)(&given(plan, body, constants))
}

/// The share of a block's cells in the families of a horizon.
fn cell_share(plan: &Plan, neighbours: &Block, horizon: f64) -> CellShare {
    // Only cells with equal edges are corrected.
    let edge = neighbours.spacing().map_or(0.0, |edges| edges[0]);
    CellShare::new(
        plan.volume_correction,
        horizon,
        edge,
        plan.dimension.count(),
    )
}

/// The longest bond (m) of each pair of blocks, row by row.
pub fn cutoffs(plan: &Plan) -> Vec<f64> {
    let reach = |here: &Block, there: &Block| {
        if plan.interface.between(here.body, there.body) == InterfaceRule::None {
            return 0.0;
        }
        let horizon = constants(plan, here, there).horizon;
        cell_share(plan, there, horizon).cutoff()
    };
    let blocks: Vec<Block> = plan.blocks().collect();
    let pairs = blocks
        .iter()
        .flat_map(|here| blocks.iter().map(move |there| (here, there)));
    pairs
        .map(|(here, there)| reach(here, there).max(reach(there, here)))
        .collect()
}

/// What the points of a block follow.
pub fn block_laws(plan: &Plan, block: &Block) -> BlockLaws {
    let constants = constants(plan, block, block);
    BlockLaws {
        law: build(plan, block.body, constants).law,
        damage: damage(plan, block.body, constants),
    }
}

/// The damage law of a block.
fn damage(plan: &Plan, body: &Body, constants: Constants) -> Option<CriticalStretch> {
    let damage = body.damage.as_ref()?;
    let (dimension, elastic) = (plan.dimension, constants.elastic);
    let of_energy = body.material.law.declaration.critical_stretch?;
    let from_energy = |energy: f64| of_energy(&given(plan, body, constants), energy);
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
        let [here, there] = ends.map(|block| plan.block(block));
        let ends = [(here, there), (there, here)].map(|(block, other)| {
            let constants = constants(plan, &block, &other);
            let horizon = constants.horizon;
            End {
                built: build(plan, block.body, constants),
                horizon,
                share: cell_share(plan, &other, horizon),
            }
        });
        weigh(plan, model, &mut bonds, &ends);
        let [own, far] = ends.map(|end| end.built.law);
        Interaction {
            bonds,
            laws: PairLaw::new(own, far),
            criterion,
        }
    };
    all.into_iter().map(give).collect()
}

/// An end of the bonds between two blocks.
struct End {
    built: Built,
    /// m.
    horizon: f64,
    /// The share of the other body's cells in its families.
    share: CellShare,
}

impl End {
    /// What the volume of the far end counts, ξ away (m).
    fn weight(&self, offset: [f64; 3]) -> f64 {
        let share = self.share.at(offset);
        match &self.built.influence {
            None => share,
            Some(influence) => share * influence(distance_squared([0.0; 3], offset).sqrt()),
        }
    }
}

/// Sets the weights of the bonds between two blocks, unless they are all 1.
fn weigh<const D: usize>(plan: &Plan, model: &Model<D>, bonds: &mut BlockBonds, ends: &[End; 2]) {
    let plain = plan.volume_correction == VolumeCorrection::None
        && ends[0].horizon == ends[1].horizon
        && ends.iter().all(|end| end.built.influence.is_none());
    if plain {
        return;
    }
    // The far end of bonds within a block has the same weights.
    let [here, there] = bonds.blocks();
    let count = if here == there { 1 } else { 2 };
    for (k, end) in ends.iter().enumerate().take(count) {
        match bonds {
            BlockBonds::Lattice(lattice) => lattice.weigh(k, |offset| end.weight(offset)),
            BlockBonds::List(list) => list.weigh(k, |here, there| {
                let [a, b] = [here, there].map(|point| model.position(point));
                end.weight(std::array::from_fn(|k| b[k] - a[k]))
            }),
        }
    }
}
