//! Laws, failure criteria and weights of the bonds between all pairs of blocks, from the problem.

mod possible;

use std::fmt;

use crate::damage::{
    BondEnergy, Criterion, CriticalStretch, DamageLaw, EndRatios, StressLimit, StressMeasure,
    StressRule, StretchConversion, ToughnessByDirection, WorkRule,
};
use crate::dimension::Dimension;
use crate::elastic::Isotropic;
use crate::families::{BlockBonds, Fault, VolumeFactors};
use crate::material::{Built, Given, PairLaw};
use crate::memory::check_room;
use crate::points::distance_squared;
use crate::problem::{
    self, Block, Body, DamageRule, InterfaceDamage, InterfacePair, InterfaceRule, Problem,
    Toughness, VolumeCorrection,
};

use super::bonds::{BlockLaws, Interaction, PairReads};
use super::model::Model;
pub use possible::laws_are_possible;

/// Elastic constants and horizon (m) at one end of bonds.
#[derive(Clone, Copy, PartialEq)]
struct Constants {
    elastic: Isotropic,
    horizon: f64,
}

/// Return the constants that points of block `here` use for their bonds to block `there`. The constants
/// follow from the interface rule of the two bodies or, within a body, from `Refinement::bonds`.
fn constants(problem: &Problem, here: &Block, there: &Block) -> Constants {
    let [own, other] = [here, there].map(|block| (block.body.material.elastic, block.horizon));
    let combine = |of: fn(f64, f64) -> f64| Constants {
        elastic: Isotropic {
            youngs_modulus: of(own.0.youngs_modulus, other.0.youngs_modulus),
            ..own.0
        },
        horizon: of(own.1, other.1),
    };
    let within = problem
        .refinement
        .as_ref()
        .map(|refinement| refinement.bonds);
    let rule = match within.filter(|_| here.body.name == there.body.name) {
        Some(rule) => rule,
        None => problem.interface.between(here.body, there.body),
    };
    match rule {
        // Without bonds, the constants are not used.
        InterfaceRule::Own | InterfaceRule::None => combine(|own, _| own),
        InterfaceRule::Average => combine(|own, other| 0.5 * (own + other)),
        InterfaceRule::Minimum => combine(f64::min),
    }
}

/// Return the bond stiffness at an end with these constants, in arbitrary units. Micromoduli are proportional
/// to E/δ^(d+1) in d dimensions.
fn bond_stiffness(constants: &Constants, dimension: Dimension) -> f64 {
    let Constants { elastic, horizon } = constants;
    elastic.youngs_modulus / horizon.powi(dimension.count() as i32 + 1)
}

/// Quantity that is compared with a threshold to break bonds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Breaks {
    Stretch,
    Work,
    Stress(StressMeasure),
}

impl fmt::Display for Breaks {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Stretch => "stretch",
            Self::Work => "work",
            Self::Stress(measure) => measure.name(),
        })
    }
}

/// Return the quantity that this damage law compares with a threshold to break the bonds of a body. In a
/// bond-based law, the work of a bond follows from its stretch, so the bond breaks at the equivalent critical
/// stretch.
fn breaks(body: &Body, damage: &problem::Damage) -> Breaks {
    let bond_based = !body.material.law.declaration.any_poisson_ratio;
    match damage.rule {
        DamageRule::Stress(rule) => Breaks::Stress(rule.measure),
        DamageRule::Energy { .. } if !bond_based => Breaks::Work,
        DamageRule::Energy { .. } | DamageRule::CriticalStretch => Breaks::Stretch,
    }
}

/// Return the input from which the law of a body is created. `damage` is the damage of the bonds, and
/// `constants` are the constants at one end of the bonds.
fn given<'a>(
    problem: &Problem,
    body: &'a Body,
    damage: Option<&problem::Damage>,
    constants: Constants,
) -> Given<'a> {
    // A critical stretch in the deck is used as given, for any horizon.
    let itself =
        |damage: &problem::Damage| matches!(damage.toughness, Toughness::CriticalStretch(_));
    Given {
        dimension: problem.dimension,
        elastic: constants.elastic,
        horizon: constants.horizon,
        values: &body.material.law.values,
        from_fracture_energy: damage.is_some_and(|damage| !itself(damage)),
    }
}

/// Stretch at which the law itself breaks bonds of a body with these constants; `None` for laws without such
/// a stretch.
fn own_critical_stretch(problem: &Problem, body: &Body, constants: Constants) -> Option<f64> {
    let own = body.material.law.declaration.own_critical_stretch?;
    Some(own(&given(problem, body, None, constants)))
}

/// Create the law of a body with these constants. `damage` is the damage law of the bonds; `None` for bonds
/// without a damage law.
fn build(
    problem: &Problem,
    body: &Body,
    damage: Option<&problem::Damage>,
    constants: Constants,
) -> Built {
    (body.material.law.declaration.build)(&given(problem, body, damage, constants))
}

/// Return the volume correction factors for points with this horizon (m) whose neighbours are cells of block
/// `neighbours`.
fn volume_factors(problem: &Problem, neighbours: &Block, horizon: f64) -> VolumeFactors {
    // The volume correction applies only to cells with equal edges.
    let edge = neighbours.spacing().map_or(0.0, |edges| edges[0]);
    VolumeFactors::new(
        problem.volume_correction,
        horizon,
        edge,
        problem.dimension.count(),
    )
}

/// Length (m) of the longest bond of each pair of blocks, row-major; 0 for a pair without bonds.
pub fn cutoffs(problem: &Problem) -> Vec<f64> {
    let reach = |here: &Block, there: &Block| {
        if problem.interface.between(here.body, there.body) == InterfaceRule::None {
            return 0.0;
        }
        let horizon = constants(problem, here, there).horizon;
        volume_factors(problem, there, horizon).cutoff()
    };
    let blocks: Vec<Block> = problem.blocks().collect();
    let pairs = blocks
        .iter()
        .flat_map(|here| blocks.iter().map(move |there| (here, there)));
    pairs
        .map(|(here, there)| reach(here, there).max(reach(there, here)))
        .collect()
}

/// The laws of the points of a block.
pub fn block_laws(problem: &Problem, block: &Block) -> BlockLaws {
    let constants = constants(problem, block, block);
    let body = block.body;
    let damage = body.damage.as_ref();
    BlockLaws {
        law: build(problem, body, damage, constants).law,
        damage: own_critical_stretch(problem, body, constants)
            .map(softened)
            .or_else(|| damage.map(|damage| damage_law(problem, body, damage, constants))),
        wears_out: body.material.law.declaration.wears_out,
        weibull: damage.and_then(|damage| damage.weibull),
        direction: damage.and_then(|damage| damage.direction),
        pairs: pair_reads(problem, body),
        dimension: problem.dimension,
        elastic: body.material.elastic,
    }
}

/// Return the damage law of bonds that break at the end of their softening, at the stretch `critical`.
fn softened(critical: f64) -> DamageLaw {
    DamageLaw::CriticalStretch(CriticalStretch {
        critical,
        alpha: 0.0,
    })
}

/// Return the kinds of point data of `body` that the failure criteria of bonds to other bodies read. Pairs
/// of bodies without a separate damage law are ignored.
fn pair_reads(problem: &Problem, body: &Body) -> PairReads {
    let block = Block::unrefined(body);
    let mut reads = PairReads::default();
    for pair in problem.interface.pairs.iter().filter(|pair| pair.has(body)) {
        if let Some(damage) = pair.own_damage() {
            let law = damage_law(problem, body, damage, constants(problem, &block, &block));
            reads.add(&law);
        }
    }
    reads
}

/// Return the damage laws of the bonds between two bodies: one law for the end in each body. The laws are in
/// the order of the bodies in the problem. `None` if the pair has no separate damage law.
pub fn pair_damage_laws(problem: &Problem, pair: &InterfacePair) -> Option<[DamageLaw; 2]> {
    let damage = pair.own_damage()?;
    let mut bodies = problem.bodies.iter().filter(|body| pair.has(body));
    let [first, second] = [bodies.next()?, bodies.next()?].map(Block::unrefined);
    Some([(&first, &second), (&second, &first)].map(|(here, there)| {
        damage_law(problem, here.body, damage, constants(problem, here, there))
    }))
}

/// Return the fracture energy (J/m²) from which the critical stretch of this damage follows, for a body with
/// these constants. `None` if the deck gives a critical stretch or a strength instead.
fn fracture_energy(problem: &Problem, damage: &problem::Damage, elastic: Isotropic) -> Option<f64> {
    let dimension = problem.dimension;
    let energy = match damage.toughness {
        Toughness::FractureEnergy(energy) => energy,
        Toughness::FractureToughness(toughness) => {
            CriticalStretch::energy_from_toughness(dimension, elastic, toughness)
        }
        Toughness::CriticalStretch(_) | Toughness::Strength(_) => return None,
    };
    Some(match damage.rule {
        DamageRule::CriticalStretch | DamageRule::Stress(_) => energy,
        DamageRule::Energy { calibration, .. } => energy * calibration.energy_ratio(dimension),
    })
}

/// Return the critical stretch at one end of a bond for a fracture energy (J/m²). `body` and `constants` are
/// the body and the constants of this end, and `damage` is the damage of the bonds of this body.
fn critical_stretch(
    problem: &Problem,
    body: &Body,
    damage: Option<&problem::Damage>,
    constants: Constants,
    energy: f64,
) -> f64 {
    match body.material.law.declaration.critical_stretch {
        Some(stretch) => stretch(&given(problem, body, damage, constants), energy),
        None => {
            let Constants { elastic, horizon } = constants;
            CriticalStretch::from_energy(problem.dimension, elastic, energy, horizon)
        }
    }
}

/// Return the damage law at one end of a bond, computed from the damage in the deck. `body` and `constants`
/// are the body and the constants of this end.
fn damage_law(
    problem: &Problem,
    body: &Body,
    damage: &problem::Damage,
    constants: Constants,
) -> DamageLaw {
    let dimension = problem.dimension;
    let Some(energy) = fracture_energy(problem, damage, constants.elastic) else {
        return match (damage.toughness, damage.rule) {
            (Toughness::CriticalStretch(critical), _) => {
                let alpha = damage.alpha;
                DamageLaw::CriticalStretch(CriticalStretch { critical, alpha })
            }
            (Toughness::Strength(strength), DamageRule::Stress(rule)) => {
                DamageLaw::Stress(StressLimit { strength, rule })
            }
            _ => unreachable!("only stress is compared with a strength"),
        };
    };
    let critical = critical_stretch(problem, body, Some(damage), constants, energy);
    let alpha = damage.alpha;
    match damage.rule {
        DamageRule::Energy { work, .. } if breaks(body, damage) == Breaks::Work => {
            DamageLaw::BondEnergy(BondEnergy {
                critical: BondEnergy::from_energy(dimension, energy, constants.horizon),
                alpha,
                stretch: critical,
                rule: work,
            })
        }
        _ => DamageLaw::CriticalStretch(CriticalStretch { critical, alpha }),
    }
}

/// Failure criterion of the bonds between two bodies that have a separate damage law for these bonds. `laws`
/// and `stiffness` are the damage law and the bond stiffness of each end.
fn pair_criterion(laws: [DamageLaw; 2], stiffness: [f64; 2]) -> Criterion {
    use DamageLaw::{BondEnergy, CriticalStretch, Stress};
    match laws {
        [CriticalStretch(i), CriticalStretch(j)] if i.critical == j.critical => {
            Criterion::Stretch(i.critical)
        }
        [CriticalStretch(i), CriticalStretch(j)] => {
            // The factor ∞ means that the critical stretch of one end does not limit the other end, see
            // [`StretchConversion`].
            let ratios = [[1.0, f64::INFINITY], [f64::INFINITY, 1.0]];
            let conversion = StretchConversion { ratios, stiffness };
            Criterion::StretchBetween([i.critical, j.critical], conversion)
        }
        [BondEnergy(i), BondEnergy(j)] => {
            Criterion::Work([0.5 * i.critical, 0.5 * j.critical], i.rule)
        }
        [Stress(i), Stress(_)] => Criterion::Stress(i.strength, i.rule),
        _ => unreachable!("a pair breaks by stretch, by work or by stress"),
    }
}

/// Factor that converts a critical stretch of the body of block `from` to an end of bonds in block `to`, for
/// the same fracture energy. `constants` are the constants of this end.
fn stretch_ratio(problem: &Problem, [to, from]: [usize; 2], constants: Constants) -> f64 {
    let [to, from] = [to, from].map(|block| problem.block(block));
    let damage = from.body.damage.as_ref();
    let elastic = from.body.material.elastic;
    // A critical stretch in the deck is used as given, for any horizon and modulus.
    let Some(energy) = damage.and_then(|damage| fracture_energy(problem, damage, elastic)) else {
        return 1.0;
    };
    let at = |block: &Block, constants: Constants| {
        critical_stretch(problem, block.body, damage, constants, energy)
    };
    at(&to, constants) / at(&from, self::constants(problem, &from, &from))
}

/// Failure criterion of the bonds between two blocks, from the damage of both blocks; see [`Criterion`]. A
/// block without damage sets no threshold. `ends` are the indices of both blocks. `of_ends` has one entry per
/// block: the data of the bonds' end in this block. `per_point` says whether thresholds are stored per point.
fn criterion(
    problem: &Problem,
    blocks: &[BlockLaws],
    ends: [usize; 2],
    of_ends: &[End; 2],
    per_point: bool,
) -> Criterion {
    // If both ends soften, a bond breaks when neither end carries load.
    if let [Some(i), Some(j)] = of_ends.each_ref().map(|end| end.own_critical_stretch) {
        return Criterion::Stretch(i.max(j));
    }
    let horizons = of_ends.each_ref().map(|end| end.constants.horizon);
    let stiffness = of_ends.each_ref().map(|end| end.stiffness);
    let laws = ends.map(|block| blocks[block].damage);
    let critical = laws.map(|law| law.map(|law| law.critical()));
    let Some(smallest) = critical.into_iter().flatten().reduce(f64::min) else {
        return Criterion::Never;
    };
    let rule = |law: DamageLaw| match law {
        DamageLaw::BondEnergy(law) => Some(law.rule),
        DamageLaw::CriticalStretch(_) | DamageLaw::Stress(_) => None,
    };
    let stress_rule = |law: DamageLaw| match law {
        DamageLaw::Stress(law) => Some(law.rule),
        DamageLaw::CriticalStretch(_) | DamageLaw::BondEnergy(_) => None,
    };
    let stress_rules = laws.into_iter().flatten().filter_map(stress_rule);
    if let Some(rule) = stress_rules.reduce(StressRule::of_both) {
        return if per_point {
            Criterion::StressThresholds(rule)
        } else {
            Criterion::Stress(smallest, rule)
        };
    }
    let rules = laws.into_iter().flatten().filter_map(rule);
    let work = |horizon: f64| BondEnergy::from_energy(problem.dimension, 1.0, horizon);
    let of_block = ends.map(|block| work(problem.block(block).horizon));
    let ratios = horizons.map(|horizon| of_block.map(|block| work(horizon) / block));
    let stretch_ratios: EndRatios = [0, 1].map(|end| {
        [0, 1].map(|k| stretch_ratio(problem, [ends[end], ends[k]], of_ends[end].constants))
    });
    let conversion = (stretch_ratios != [[1.0; 2]; 2]).then_some(StretchConversion {
        ratios: stretch_ratios,
        stiffness,
    });
    let directions = ends.map(|block| blocks[block].direction);
    let is_directed = directions.iter().any(Option::is_some);
    let directions =
        is_directed.then(|| directions.map(|one| one.unwrap_or(ToughnessByDirection::NONE)));
    match (rules.reduce(WorkRule::of_both), per_point) {
        (Some(rule), true) => Criterion::WorkThresholds(ratios, rule, directions),
        (Some(rule), false) => {
            let shares = ratios.map(|of_end| {
                let all = of_end.into_iter().zip(critical);
                let converted = all.filter_map(|(ratio, critical)| Some(ratio * critical?));
                0.5 * converted.fold(f64::INFINITY, f64::min)
            });
            Criterion::Work(shares, rule)
        }
        (None, true) => match conversion {
            None => Criterion::Thresholds(directions),
            Some(conversion) => Criterion::ThresholdsBetween(conversion, directions),
        },
        (None, false) => match conversion {
            None => Criterion::Stretch(smallest),
            Some(conversion) => {
                let critical = critical.map(|critical| critical.unwrap_or(f64::INFINITY));
                Criterion::StretchBetween(critical, conversion)
            }
        },
    }
}

/// Create one interaction per pair of blocks. `all` contains the bonds of each pair. This function adds the
/// weights, the laws and the failure criterion. `blocks` are the laws of all blocks.
///
/// # Errors
/// If there is not enough memory for the weights.
pub fn assign<const D: usize>(
    problem: &Problem,
    model: &Model<D>,
    blocks: &[BlockLaws],
    all: Vec<BlockBonds>,
) -> std::result::Result<Vec<Interaction>, Fault> {
    let per_point = blocks.iter().any(BlockLaws::has_thresholds);
    let give = |mut bonds: BlockBonds| {
        let indices = bonds.blocks();
        let [here, there] = indices.map(|block| problem.block(block));
        let pair_damage = problem.interface.damage_between(here.body, there.body);
        let ends = [(here, there), (there, here)].map(|(block, other)| {
            let constants = constants(problem, &block, &other);
            let damage = pair_damage.own().or(block.body.damage.as_ref());
            End {
                stiffness: bond_stiffness(&constants, problem.dimension),
                built: build(problem, block.body, damage, constants),
                pair_damage: pair_damage
                    .own()
                    .map(|damage| damage_law(problem, block.body, damage, constants)),
                own_critical_stretch: own_critical_stretch(problem, block.body, constants),
                constants,
                volume_factors: volume_factors(problem, &other, constants.horizon),
            }
        });
        weigh(problem, model, &mut bonds, &ends)?;
        let wears_out = |block: &Block| block.body.material.law.declaration.wears_out;
        if *pair_damage == InterfaceDamage::Unbreakable
            && [&here, &there].into_iter().any(wears_out)
        {
            // A law that wears out breaks bonds by their history, also without a criterion.
            bonds.protect(|_| true);
        }
        let stiffness = ends.each_ref().map(|end| end.stiffness);
        let criterion = match (pair_damage, ends.each_ref().map(|end| end.pair_damage)) {
            (InterfaceDamage::Unbreakable, _) => Criterion::Never,
            (_, [Some(own), Some(far)]) => pair_criterion([own, far], stiffness),
            _ => criterion(problem, blocks, indices, &ends, per_point),
        };
        let [own, far] = ends.map(|end| end.built.law);
        Ok(Interaction {
            bonds,
            laws: PairLaw::new(own, far),
            criterion,
            no_volume_correction: problem.volume_correction == VolumeCorrection::None,
        })
    };
    all.into_iter().map(give).collect()
}

/// One end of the bonds between two blocks.
struct End {
    built: Built,
    /// See [`own_critical_stretch`].
    own_critical_stretch: Option<f64>,
    /// See [`bond_stiffness`].
    stiffness: f64,
    /// Separate damage law of the pair of bodies, for this end; `None` if the pair has none.
    pair_damage: Option<DamageLaw>,
    constants: Constants,
    /// Volume correction factors for the neighbours of a point at this end; the neighbours are in the other
    /// block.
    volume_factors: VolumeFactors,
}

impl End {
    /// Return the weight of a neighbour, which is the factor on the neighbour's volume. The neighbour has the
    /// offset ξ (m) from the point at this end.
    fn weight(&self, offset: [f64; 3]) -> f64 {
        let factor = self.volume_factors.at(offset);
        match &self.built.influence {
            None => factor,
            Some(influence) => factor * influence(distance_squared([0.0; 3], offset).sqrt()),
        }
    }
}

/// Set the weights of the bonds between two blocks, unless all weights are 1.
fn weigh<const D: usize>(
    problem: &Problem,
    model: &Model<D>,
    bonds: &mut BlockBonds,
    ends: &[End; 2],
) -> std::result::Result<(), Fault> {
    let plain = problem.volume_correction == VolumeCorrection::None
        && ends[0].constants.horizon == ends[1].constants.horizon
        && ends.iter().all(|end| end.built.influence.is_none());
    if plain {
        return Ok(());
    }
    // Within a block, both ends have the same weights, so these are set once.
    let [here, there] = bonds.blocks();
    let count = if here == there { 1 } else { 2 };
    match bonds {
        BlockBonds::Lattice(lattice) => {
            for (k, end) in ends.iter().enumerate().take(count) {
                lattice.weigh(k, |offset| end.weight(offset));
            }
        }
        BlockBonds::List(list) => {
            check_room(list.weight_bytes(count)).map_err(|shortage| Fault::TooLittleMemory {
                blocks: [here, there],
                shortage,
            })?;
            let offset = |here: usize, there: usize| {
                let [a, b] = [here, there].map(|point| model.position(point));
                std::array::from_fn(|k| b[k] - a[k])
            };
            list.weigh(count, offset, |k, offset| ends[k].weight(offset));
        }
    }
    Ok(())
}
