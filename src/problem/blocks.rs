//! The blocks of a problem. Without refinement, each body is a block. With refinement, a block contains the
//! points of a body that have the same level and the same [`Kind`].
//!
//! All points of a block have the same law and horizon. They also have the same volume, except in bodies from
//! files and meshes, and in some blocks of refined bodies.

use super::{Body, HorizonRule, PointSource, Problem};

/// Number of block kinds for each level of a refined body.
const KINDS: usize = 3;

/// Kind of a block: whether its points have the full cell volume, and whether they have coarser points within
/// their horizon.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Lattice points whose volume is the full volume of a cell of their level. Without refinement, all
    /// points of a body have this kind.
    Whole,
    /// Points with a smaller volume, next to finer points or at the edge of the body.
    Partial,
    /// Points with coarser points within their horizon. The horizon of these points is multiplied by
    /// [`Refinement::interface_factor`](super::Refinement::interface_factor).
    NearCoarser,
}

/// A block of a problem.
#[derive(Debug, Clone, Copy)]
pub struct Block<'a> {
    /// The body of the block.
    pub body: &'a Body,
    /// The refinement level of the points; 0 without refinement.
    pub level: u32,
    /// The kind of the points.
    pub kind: Kind,
    /// Horizon δ, m.
    pub horizon: f64,
}

impl<'a> Block<'a> {
    /// Create the block of a body without refinement.
    pub fn unrefined(body: &'a Body) -> Self {
        Self {
            body,
            level: 0,
            kind: Kind::Whole,
            horizon: body.horizon,
        }
    }

    /// Return the edges of a cell (m); `None` if the points do not lie in lattice cells.
    pub fn spacing(&self) -> Option<[f64; 3]> {
        match self.body.points {
            PointSource::Lattice { spacing, .. } => Some(spacing.map(|edge| edge * self.scale())),
            PointSource::File { .. } | PointSource::Mesh { .. } => None,
        }
    }

    /// Return the spacing of the level, divided by the spacing of level 0: 2^−level.
    fn scale(&self) -> f64 {
        0.5_f64.powi(self.level as i32)
    }
}

impl Problem {
    /// Return the number of blocks.
    pub fn block_count(&self) -> usize {
        let levels = self.refinement.as_ref().map(|refinement| refinement.levels);
        let parts = levels.map_or(1, |finest| KINDS * (finest as usize + 1));
        parts * self.bodies.len()
    }

    /// Return the number of the block with this body, level and kind.
    pub fn block_number(&self, body: usize, level: u32, kind: Kind) -> usize {
        body + self.bodies.len() * (KINDS * level as usize + kind as usize)
    }

    /// Return the index of the body that a block belongs to.
    pub fn body_of(&self, block: usize) -> usize {
        block % self.bodies.len()
    }

    /// Return the block with this number.
    pub fn block(&self, number: usize) -> Block<'_> {
        let body = &self.bodies[self.body_of(number)];
        let part = number / self.bodies.len();
        let level = (part / KINDS) as u32;
        let kind = [Kind::Whole, Kind::Partial, Kind::NearCoarser][part % KINDS];
        Block {
            level,
            kind,
            horizon: self.horizon_of(body, level, kind),
            ..Block::unrefined(body)
        }
    }

    /// Return all blocks in the order of their numbers.
    pub fn blocks(&self) -> impl Iterator<Item = Block<'_>> + Clone {
        (0..self.block_count()).map(|number| self.block(number))
    }

    fn horizon_of(&self, body: &Body, level: u32, kind: Kind) -> f64 {
        let (Some(refinement), true) = (&self.refinement, level > 0) else {
            return body.horizon;
        };
        let scale = 0.5_f64.powi(level as i32);
        let horizon = match (&refinement.rule, &body.points) {
            (HorizonRule::DeltaM(ratios), PointSource::Lattice { spacing, .. }) => {
                ratios[level as usize - 1] * spacing[0] * scale
            }
            _ => body.horizon * scale,
        };
        match kind {
            Kind::NearCoarser => horizon * refinement.interface_factor,
            Kind::Whole | Kind::Partial => horizon,
        }
    }
}
