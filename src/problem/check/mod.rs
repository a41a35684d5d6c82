//! Check of a problem: all numbers are in their ranges, and all names and indices refer to existing items.
//! The deck checks its values as well, with their locations, so only problems from Rust can fail here.

mod allowed;
mod bodies;
mod bonds;
mod conditions;
mod contact;
mod history;
mod names;
mod outputs;
mod refinement;
mod shapes;
mod time;

use super::{Body, FamilyRule, Problem, VolumeCorrection};
use crate::dimension::Dimension;
use crate::error::{Error, Result};
use crate::expression::{Expression, Variable};

pub(crate) use allowed::{Allowed, LENGTH, MOST_HALVINGS, POSITIVE, RESTITUTION};
pub(crate) use bodies::{MOST_BODIES, RATIO_TOLERANCE};
pub(crate) use bonds::{direction_fault, micromodulus_fault};
pub(crate) use history::LARGEST_COSINE;
pub(crate) use names::{column_fault, file_fault, name_fault};
pub(crate) use refinement::FINEST;

/// Largest deviation of the squared length of a unit vector from 1.
const UNIT_TOLERANCE: f64 = 1e-6;

impl Problem {
    /// Check all values, names and indices. A problem that a deck has produced has no error. The laws, and
    /// the files that contain points, are checked when the run is set up.
    ///
    /// # Errors
    /// On the first value that is not allowed. The message names the item, its value and the allowed values.
    /// The items have the names of a deck, such as `[body.plate] density`.
    pub fn check(&self) -> Result<()> {
        names::names(self)?;
        self.check_grid()?;
        bodies::bodies(self)?;
        self.check_volume_correction()?;
        bonds::bonds(self)?;
        contact::contact(self)?;
        refinement::refinement(self)?;
        shapes::sets(self)?;
        shapes::cracks(self)?;
        time::time(self)?;
        conditions::initials(self)?;
        conditions::conditions(self)?;
        outputs::outputs(self)?;
        history::history(self)
    }

    /// Check that the problem has this number of dimensions.
    ///
    /// # Errors
    /// If the numbers differ.
    pub(crate) fn check_dimension(&self, dimension: usize) -> Result<()> {
        let own = self.dimension.count();
        if own == dimension {
            return Ok(());
        }
        Err(Error::input(format!(
            "dimension: the simulation has {dimension} dimension(s), but the problem is {}, with {own}",
            self.dimension.name()
        )))
    }

    /// Check the dimension and the settings of the grid.
    fn check_grid(&self) -> Result<()> {
        match self.dimension {
            Dimension::Line { cross_section, .. } => {
                POSITIVE.check("cross_section", cross_section)?;
            }
            Dimension::PlaneStress { thickness } | Dimension::PlaneStrain { thickness } => {
                POSITIVE.check("thickness", thickness)?;
            }
            Dimension::Space => {}
        }
        LENGTH.check("[grid] horizon", self.horizon)?;
        let gauss = self.bodies.iter().find(|body| body.has_gauss_points());
        if let Some(jitter) = self.jitter {
            allowed::JITTER.check("[grid] jitter", jitter.largest_shift)?;
            if let Some(body) = gauss {
                return Err(wrong(
                    "[grid] jitter",
                    format!(
                        "needs one point per cell, but [body.{}] has Gauss points",
                        body.name
                    ),
                ));
            }
        }
        if self.family == FamilyRule::Lattice {
            let moved = self
                .jitter
                .map(|_| "the jitter moves the points".to_owned());
            let fault = gauss.map(|body| format!("[body.{}] has Gauss points", body.name));
            if let Some(fault) = moved.or(fault) {
                return Err(wrong(
                    "[grid] family",
                    format!("`FamilyRule::Lattice` needs points on a lattice, but {fault}"),
                ));
            }
        }
        Ok(())
    }

    /// Check that the volume correction is for the cells of all bodies.
    fn check_volume_correction(&self) -> Result<()> {
        if self.volume_correction == VolumeCorrection::None {
            return Ok(());
        }
        let reason = self.bodies.iter().find_map(|body| {
            let reason = body.no_cell_volume(self.jitter.is_some(), self.dimension.count())?;
            Some((body, reason))
        });
        let Some((Body { name, .. }, reason)) = reason else {
            return Ok(());
        };
        Err(wrong(
            "[grid] volume_correction",
            format!(
                "must be `VolumeCorrection::None`, because [body.{name}] {reason}; another correction is for points \
                 at the centres of square or cubic lattice cells"
            ),
        ))
    }

    /// Check the index of a set.
    fn check_set(&self, key: &str, set: usize) -> Result<()> {
        let count = self.sets.len();
        if set < count {
            return Ok(());
        }
        Err(wrong(
            key,
            format!("must be the index of a set, below {count}, is {set}"),
        ))
    }

    /// Check that a list has an entry per dimension.
    fn check_entries(&self, key: &str, entries: usize) -> Result<()> {
        let dimension = self.dimension.count();
        if entries == dimension {
            return Ok(());
        }
        Err(wrong(
            key,
            format!("must have {dimension} entries, one per dimension, has {entries}"),
        ))
    }

    /// Check a list of expressions, one per dimension, of the variables `allowed`.
    fn check_expressions(
        &self,
        key: &str,
        expressions: &[Expression],
        allowed: &[Variable],
    ) -> Result<()> {
        self.check_entries(key, expressions.len())?;
        let mut expressions = expressions.iter();
        expressions.try_for_each(|each| expression(key, each, allowed))
    }
}

/// Return the error of an item; `key` is its section and key, such as `[body.plate] density`.
fn wrong(key: &str, fault: impl AsRef<str>) -> Error {
    Error::input(format!("{key}: {}", fault.as_ref()))
}

/// Check that an expression has no variables but those in `allowed`, and is finite if it has none.
fn expression(key: &str, expression: &Expression, allowed: &[Variable]) -> Result<()> {
    if let Some(value) = expression.as_constant() {
        return finite(key, &[value]);
    }
    let names = |variables: &[Variable]| {
        let names = variables.iter().map(|variable| variable.name());
        names.collect::<Vec<_>>().join(", ")
    };
    match Variable::ALL
        .into_iter()
        .find(|variable| !allowed.contains(variable) && expression.uses(*variable))
    {
        None => Ok(()),
        Some(other) => Err(wrong(
            key,
            format!(
                "must not depend on `{}`; allowed variables: {}",
                other.name(),
                names(allowed)
            ),
        )),
    }
}

/// Check that all numbers are finite.
fn finite(key: &str, values: &[f64]) -> Result<()> {
    match values.iter().find(|value| !value.is_finite()) {
        None => Ok(()),
        Some(value) => Err(wrong(key, format!("must be finite, is {value}"))),
    }
}

/// Check that a count is not 0.
fn at_least_one(key: &str, count: u64) -> Result<()> {
    match count {
        0 => Err(wrong(key, "must be at least 1, is 0")),
        _ => Ok(()),
    }
}

/// Check that a vector has unit length.
fn unit_vector(key: &str, vector: [f64; 3]) -> Result<()> {
    let square: f64 = vector.iter().map(|component| component * component).sum();
    if (square - 1.0).abs() <= UNIT_TOLERANCE {
        return Ok(());
    }
    Err(wrong(
        key,
        format!("must be a unit vector, has the length {}", square.sqrt()),
    ))
}

/// Check the number of an item that may be absent.
fn optional(key: &str, value: Option<f64>, allowed: &Allowed) -> Result<()> {
    value.map_or(Ok(()), |value| allowed.check(key, value))
}
