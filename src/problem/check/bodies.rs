//! Bodies, with their materials, damage laws and points.

use super::allowed::{
    AT_LEAST_ONE, FRACTION, FROM_0_TO_1, LENGTH, NOT_NEGATIVE, POISSON_RATIO, POSITIVE,
};
use super::{finite, shapes, wrong};
use crate::error::Result;
use crate::message::format_number;
use crate::problem::{
    Body, Calibration, Damage, DamageRule, Material, PointSource, Problem, Toughness,
};

/// Largest number of bodies. Some tables have an entry for each pair of bodies. For example, the bond search
/// reads the length of the longest bond of each pair. These tables grow with the square of the number of
/// bodies.
pub(crate) const MOST_BODIES: usize = 256;

/// Largest deviation of Poisson's ratio from the ratio of a bond-based law. It accepts 0.33 for 1/3.
pub(crate) const RATIO_TOLERANCE: f64 = 0.005;

/// Check the bodies.
///
/// # Errors
/// If there are no bodies or too many, or a value of a body is not allowed.
pub fn bodies(problem: &Problem) -> Result<()> {
    let count = problem.bodies.len();
    if count == 0 {
        return Err(wrong("[body]", "the problem needs a body"));
    }
    if count > MOST_BODIES {
        let fault = format!("the problem has {count} bodies; {MOST_BODIES} at most");
        return Err(wrong("[body]", fault));
    }
    for body in &problem.bodies {
        let section = format!("[body.{}]", body.name);
        LENGTH.check(&format!("{section} horizon"), body.horizon)?;
        points(problem, body, &section)?;
        material(problem, &body.material, &section)?;
        if let Some(law) = &body.damage {
            damage(problem, law, &section)?;
        }
    }
    Ok(())
}

fn points(problem: &Problem, body: &Body, section: &str) -> Result<()> {
    let (shape, spacing, origin) = match &body.points {
        PointSource::Lattice {
            shape,
            spacing,
            origin,
            ..
        } => (shape, spacing, origin),
        PointSource::Mesh { scale, .. } => {
            return LENGTH.check(&format!("{section} points scale"), *scale);
        }
        PointSource::File { .. } => return Ok(()),
    };
    let key = format!("{section} spacing");
    for edge in spacing {
        LENGTH.check(&key, *edge)?;
    }
    let mut edges = spacing[..problem.dimension.count()].iter();
    if let Some(edge) = edges.find(|edge| **edge > body.horizon) {
        let fault = format!(
            "{} m is larger than the horizon {} m, so no point would have a neighbour; the horizon is usually 3 to 6 \
             spacings",
            format_number(*edge),
            format_number(body.horizon)
        );
        return Err(wrong(&key, fault));
    }
    finite(&format!("{section} origin"), origin)?;
    shapes::shape(problem, &format!("{section} shape"), shape)
}

fn material(problem: &Problem, material: &Material, section: &str) -> Result<()> {
    let key = |name: &str| format!("{section} {name}");
    POSITIVE.check(&key("density"), material.density)?;
    let (young, ratio) = (
        material.elastic.youngs_modulus,
        material.elastic.poisson_ratio,
    );
    POSITIVE.check(&key("youngs_modulus"), young)?;
    let law = &material.law;
    let own = (law.declaration.elastic).and_then(|own| own(&law.values, problem.dimension));
    if own.is_some() {
        // In plane stress, the mean ratio of an anisotropic solid can be above 0.5.
        finite(&key("poisson_ratio"), &[ratio])?;
    } else {
        POISSON_RATIO.check(&key("poisson_ratio"), ratio)?;
        let elastic = material.elastic;
        let longitudinal = elastic.lame_lambda() + 2.0 * elastic.shear_modulus();
        finite(&key("youngs_modulus, λ + 2G"), &[longitudinal])?;
    }
    let bond_based = problem.dimension.bond_based_poisson_ratio();
    let is_free = law.declaration.any_poisson_ratio || problem.dimension.allows_any_poisson_ratio();
    if !is_free && (ratio - bond_based).abs() > RATIO_TOLERANCE {
        let fault = format!(
            "must be {bond_based:.4}, the ratio of the bond-based law `{}` in {}, is {ratio}",
            law.declaration.name,
            problem.dimension.name(),
        );
        return Err(wrong(&key("poisson_ratio"), fault));
    }
    NOT_NEGATIVE.check(&key("damping"), material.damping)?;
    let expansion = material.expansion;
    finite(&key("thermal_expansion"), &[expansion.coefficient])?;
    finite(
        &key("reference_temperature"),
        &[expansion.reference_temperature],
    )
}

/// Check a damage law; `section` is the section of its body or pair of bodies.
pub(super) fn damage(problem: &Problem, damage: &Damage, section: &str) -> Result<()> {
    let key = |name: &str| format!("{section} damage {name}");
    let (name, toughness) = match damage.toughness {
        Toughness::FractureEnergy(energy) => ("fracture_energy", energy),
        Toughness::FractureToughness(toughness) => ("fracture_toughness", toughness),
        Toughness::CriticalStretch(stretch) => ("critical_stretch", stretch),
        Toughness::Strength(strength) => ("strength", strength),
    };
    POSITIVE.check(&key(name), toughness)?;
    FRACTION.check(&key("alpha"), damage.alpha)?;
    if let Some(weibull) = damage.weibull {
        AT_LEAST_ONE.check(&key("weibull_modulus"), weibull.modulus)?;
    }
    if damage.direction.is_some() && problem.dimension.count() == 1 {
        return Err(wrong(
            &key("direction"),
            "cracks in a bar have one direction",
        ));
    }
    if let DamageRule::Energy { calibration, work } = damage.rule {
        FROM_0_TO_1.check(&key("family_correction"), work.family_correction)?;
        if let Calibration::Opening(Some(ratio)) = calibration {
            POSITIVE.check(&key("calibration"), ratio)?;
        }
    }
    let mut sets = damage.no_failure.iter();
    sets.try_for_each(|set| problem.check_set(&key("no_failure"), *set))
}
