//! The regular grids of the bodies' points: grids that decks define, and grids that are detected in point
//! files and meshes.

use rayon::prelude::*;

use crate::comm::{self, Communicator, agree};
use crate::error::{Error, Result};
use crate::families::GridFrame;
use crate::partition::Domain;
use crate::points::Point;
use crate::points::bins::Bins;
use crate::problem::{FamilyRule, Kind, PointSource, Problem, Quadrature};

/// Tolerance for points that must lie at cell centres and for grids that must coincide, as a fraction of the
/// edge of a cell. Also, two coordinates count as equal if their difference is at most this fraction of the
/// length of the longest bond.
const ON_GRID: f64 = 1e-6;

/// Largest cell index; integers up to this size are exact in floating point.
const FARTHEST: f64 = 1e15;

/// Largest accepted relative difference between the volume of a point and the volume of a cell.
const VOLUME: f64 = 1e-2;

/// A grid, given by the centre of one cell and the edge lengths of its cells, in m. All cells are equal.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cells {
    centre: [f64; 3],
    edges: [f64; 3],
}

/// Find the regular grids of the bodies whose points all lie on a regular grid. `longest` is the length of
/// the longest bond, m. The result is empty with `family = "list"`. Collective.
///
/// # Errors
/// If the deck has `family = "lattice"` and a body is not suitable: all points of the body must lie on a
/// regular grid and have the volume of a cell. The error is the same on all ranks.
pub fn grids(
    problem: &Problem,
    comm: &dyn Communicator,
    domain: &Domain,
    longest: f64,
) -> Result<Vec<GridFrame>> {
    let mut grids: Vec<GridFrame> = Vec::new();
    if problem.family == FamilyRule::List {
        return Ok(grids);
    }
    let dimension = problem.dimension.count();
    for (index, body) in problem.bodies.iter().enumerate() {
        let found = match body.points {
            PointSource::Lattice { .. } if problem.jitter.is_some() => None,
            PointSource::Lattice {
                quadrature: Quadrature::Gauss,
                ..
            } => None,
            PointSource::Lattice {
                spacing, origin, ..
            } => Some(described(origin, spacing, dimension)),
            PointSource::File { .. } | PointSource::Mesh { .. } => {
                detected(problem, comm, domain, index, longest)
            }
        };
        let Some(Cells { centre, edges }) = found else {
            let message = format!(
                "[body.{}]: `family = \"lattice\"` needs points of equal volume on a regular grid; use \
                 \"auto\" or \"list\"",
                body.name
            );
            let wanted = problem.family == FamilyRule::Lattice;
            let error = || Error::input(message).at(&body.span);
            agree(comm, if wanted { Err(error()) } else { Ok(()) })?;
            continue;
        };
        // The centre of a level-0 cell lies on the grid of every refinement level, so all levels have the
        // same `centre`.
        let is_shape = matches!(body.points, PointSource::Lattice { .. });
        let refinement = problem.refinement.as_ref().filter(|_| is_shape);
        for level in 0..=refinement.map_or(0, |refinement| refinement.levels) {
            let edges = edges.map(|edge| edge * 0.5_f64.powi(level as i32));
            let block = problem.block_number(index, level, Kind::Whole);
            add(&mut grids, Cells { centre, edges }, block, problem);
        }
    }
    Ok(grids)
}

/// Record that the points of a block lie on a grid. If a known grid coincides with this grid, mark the block
/// in the known grid. Otherwise, add this grid to `grids`.
fn add(
    grids: &mut Vec<GridFrame>,
    Cells { centre, edges }: Cells,
    block: usize,
    problem: &Problem,
) {
    let coincides = |frame: &&mut GridFrame| {
        (0..problem.dimension.count()).all(|k| {
            let steps = (centre[k] - frame.origin[k]) / edges[k];
            let same = (frame.spacing[k] / edges[k] - 1.0).abs() < 1e-12;
            same && (steps - steps.round()).abs() < ON_GRID
        })
    };
    match grids.iter_mut().find(coincides) {
        Some(frame) => frame.blocks[block] = true,
        None => grids.push(GridFrame {
            origin: centre,
            spacing: edges,
            blocks: (0..problem.block_count())
                .map(|other| other == block)
                .collect(),
        }),
    }
}

/// Return the grid of a lattice in the deck. `origin` is a corner of a cell (m), and `edges` are the edges of
/// the cells (m).
fn described(origin: [f64; 3], edges: [f64; 3], dimension: usize) -> Cells {
    let mut centre = [0.0; 3];
    for k in 0..dimension {
        centre[k] = origin[k] + 0.5 * edges[k];
    }
    Cells { centre, edges }
}

/// Detect the grid of a body's points. The result is `None` unless all points lie on the grid and have the
/// same volume. This volume must equal the volume of a cell, with the relative tolerance [`VOLUME`]. If the
/// points form a single layer in at least one direction, their volume is not compared with the volume of a
/// cell. Collective.
fn detected(
    problem: &Problem,
    comm: &dyn Communicator,
    domain: &Domain,
    body: usize,
    longest: f64,
) -> Option<Cells> {
    let dimension = problem.dimension.count();
    let points = || {
        let owned = &domain.points[..domain.owned];
        owned.iter().filter(|point| point.block as usize == body)
    };
    // Minima over the points of all ranks: coordinates (entries 0 to 2), negative coordinates (3 to 5), gaps
    // (6 to 8), volume (9), negative volume (10).
    let mut smallest = [f64::MAX; 11];
    let [gap_x, gap_y, gap_z] = smallest_gaps(domain, body, longest);
    (smallest[6], smallest[7], smallest[8]) = (gap_x, gap_y, gap_z);
    for point in points() {
        for k in 0..dimension {
            smallest[k] = smallest[k].min(point.position[k]);
            smallest[3 + k] = smallest[3 + k].min(-point.position[k]);
        }
        smallest[9] = smallest[9].min(point.volume);
        smallest[10] = smallest[10].min(-point.volume);
    }
    comm::min(comm, &mut smallest);
    let (mut centre, mut edges) = ([0.0; 3], [1.0; 3]);
    for k in 0..dimension {
        let (low, high, gap) = (smallest[k], -smallest[3 + k], smallest[6 + k]);
        centre[k] = low;
        // If the points form a single layer in direction k, any edge fits.
        edges[k] = if gap < f64::MAX {
            (high - low) / ((high - low) / gap).round()
        } else {
            longest
        };
    }
    let cell: f64 =
        edges[..dimension].iter().product::<f64>() * problem.dimension.out_of_plane_measure();
    let layers = (0..dimension).any(|k| smallest[6 + k] == f64::MAX);
    let [volume, largest] = [smallest[9], -smallest[10]];
    let fits = volume == largest && (layers || (volume / cell - 1.0).abs() < VOLUME);
    let on_grid = points().all(|point| {
        (0..dimension).all(|k| {
            let steps = (point.position[k] - centre[k]) / edges[k];
            steps < FARTHEST && (steps - steps.round()).abs() < ON_GRID
        })
    });
    let mut good = [f64::from(u8::from(fits && on_grid))];
    comm::min(comm, &mut good);
    (good[0] == 1.0).then_some(Cells { centre, edges })
}

/// Return the smallest nonzero difference of each coordinate (m) between two local points of a body;
/// `f64::MAX` if there is none. Only pairs at a distance of at most `longest` (m) count, so the minimum over
/// all ranks does not depend on the number of ranks.
fn smallest_gaps(domain: &Domain, body: usize, longest: f64) -> [f64; 3] {
    let of_body = |point: &&Point| point.block as usize == body;
    let places: Vec<[f64; 3]> = domain
        .points
        .iter()
        .filter(of_body)
        .map(|p| p.position)
        .collect();
    let bins = Bins::new(&places, longest);
    let none = [f64::MAX; 3];
    let least = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|k| a[k].min(b[k]));
    places
        .par_iter()
        .map(|here| {
            let mut gaps = none;
            bins.within(*here, |other, _| {
                for k in 0..3 {
                    let gap = (places[other as usize][k] - here[k]).abs();
                    if gap > ON_GRID * longest {
                        gaps[k] = gaps[k].min(gap);
                    }
                }
            });
            gaps
        })
        .reduce(|| none, least)
}
