//! Damage whose critical work is to follow from what opening a body costs.

use std::borrow::Cow;

use crate::deck::plan::{Calibration, DamageRule, Plan};
use crate::error::Result;

use super::parting::parting_cost;

/// The plan with what opening its bodies costs, where their damage is calibrated by it.
///
/// # Errors
/// When that of a body cannot be measured.
pub fn calibrated(plan: &Plan) -> Result<Cow<'_, Plan>> {
    let mut found = Cow::Borrowed(plan);
    for index in 0..plan.bodies.len() {
        let mut trial = plan.clone();
        let Some(rule @ Calibration::Opening(None)) = calibration_of(&mut trial, index) else {
            continue;
        };
        *rule = Calibration::Opening(Some(1.0));
        let Some(cost) = parting_cost(&trial, index, 0.0).filter(|cost| *cost > 0.0) else {
            let body = &plan.bodies[index];
            let message = format!(
                "[body.{}] damage: what opening this body costs cannot be measured: `calibration = \"opening\"` is for \
                 bodies on a lattice with horizons of at most 3 spacings in space and 10 in the plane; take \"energy\"",
                body.name
            );
            return Err(plan.source.error(body.span.clone(), message));
        };
        if let Some(rule) = calibration_of(found.to_mut(), index) {
            *rule = Calibration::Opening(Some(cost));
        }
    }
    Ok(found)
}

fn calibration_of(plan: &mut Plan, body: usize) -> Option<&mut Calibration> {
    match &mut plan.bodies[body].damage.as_mut()?.rule {
        DamageRule::Energy { calibration, .. } => Some(calibration),
        DamageRule::CriticalStretch => None,
    }
}
