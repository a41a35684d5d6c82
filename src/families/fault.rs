//! Errors that occur while families are built.

use crate::error::Error;
use crate::memory::Shortage;
use crate::message::format_number;
use crate::points::Point;
use crate::problem::Problem;
use crate::problem::{Body, PointSource};

/// Upper limit on the number of neighbours of a point. A lattice reaches this limit at a horizon of about 17
/// spacings in 3-D and 80 in 2-D.
pub const MOST_NEIGHBOURS: f64 = 20_000.0;

/// An error that occurs while families are built.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Fault {
    /// Two points with the same position.
    SamePlace([Point; 2]),
    /// A point with more than [`MOST_NEIGHBOURS`] neighbours.
    TooManyNeighbours {
        /// The blocks of the point and of its neighbours. If the neighbours in all blocks were counted, both
        /// entries are the block of the point.
        blocks: [usize; 2],
        /// Estimated number of neighbours; `None` if it is not known.
        neighbours: Option<f64>,
        /// Ratio of the longest bond to the spacing of the neighbours; `None` if the neighbours in all blocks
        /// were counted.
        spacings: Option<f64>,
    },
    /// Bonds that do not fit in memory.
    TooLittleMemory {
        /// The pair of blocks whose lattice or weights do not fit in memory. If the lists or bond histories
        /// of all pairs need more memory in total than is available, this is the pair that takes most memory.
        blocks: [usize; 2],
        /// Needed and available memory.
        shortage: Shortage,
    },
    /// A grid layout with too many empty slots.
    TooManyHoles,
}

impl Fault {
    /// Create the error. The message names the body or the deck key that causes the fault, except for
    /// [`Self::TooManyHoles`].
    pub fn error(&self, problem: &Problem) -> Error {
        match self {
            Self::SamePlace(points) => same_place(problem, points),
            Self::TooManyNeighbours {
                blocks,
                neighbours,
                spacings,
            } => too_many_neighbours(problem, *blocks, *neighbours, *spacings),
            Self::TooLittleMemory { blocks, shortage } => {
                too_little_memory(problem, *blocks, *shortage)
            }
            Self::TooManyHoles => Error::run(
                "a rank's part of a grid has too many holes for a lattice (2³¹ places at most); \
                 use more ranks or `family = \"list\"`",
            ),
        }
    }
}

fn same_place(problem: &Problem, points: &[Point; 2]) -> Error {
    let [a, b] = *points;
    let [first, second] = if a.id < b.id { [a, b] } else { [b, a] };
    let [body, other] = [second, first].map(|point| problem.block(point.block as usize).body);
    let position = &first.position[..problem.dimension.count()];
    let message = if body.name == other.name {
        format!(
            "[body.{}]: its points {} and {} lie at the same place, {position:?} m",
            body.name, first.id, second.id
        )
    } else {
        format!(
            "[body.{}]: its point {} lies at the same place as point {} of [body.{}], {position:?} m; \
             check whether the bodies overlap",
            body.name, second.id, first.id, other.name
        )
    };
    Error::input(message).at(&body.span)
}

/// Format a large number to two significant digits.
fn rounded(value: f64) -> String {
    let unit = libm::pow(10_f64, libm::log10(value).floor() - 1.0);
    format_number((value / unit).round() * unit)
}

/// The deck key that sets the horizon of a body.
fn horizon_key(problem: &Problem, body: &Body) -> String {
    if body.horizon_span == problem.spans.horizon {
        "[grid] horizon".to_owned()
    } else {
        format!("[body.{}] horizon", body.name)
    }
}

fn too_little_memory(problem: &Problem, blocks: [usize; 2], shortage: Shortage) -> Error {
    let [near, other] = blocks.map(|block| problem.block(block));
    let (body, other) = (near.body, other.body);
    let spacings = match &body.points {
        PointSource::Lattice { spacing, .. } => {
            format!(", {:.1} spacings,", body.horizon / spacing[0])
        }
        PointSource::File { .. } | PointSource::Mesh { .. } => String::new(),
    };
    let ends = if body.name == other.name {
        format!("within [body.{}]", body.name)
    } else {
        format!("from [body.{}] to [body.{}]", body.name, other.name)
    };
    let [needed, available] = [shortage.needed, shortage.available].map(|x| x as f64 / 1e9);
    let message = format!(
        "{}: with {} m{spacings} bonds, most of them {ends}, take {needed:.2} GB of memory on a rank, where \
         {available:.2} GB are left; take a shorter horizon, a larger spacing or more nodes",
        horizon_key(problem, body),
        format_number(near.horizon),
    );
    Error::input(message).at(&body.horizon_span)
}

fn too_many_neighbours(
    problem: &Problem,
    blocks: [usize; 2],
    neighbours: Option<f64>,
    spacings: Option<f64>,
) -> Error {
    let [near, other] = blocks.map(|block| problem.block(block));
    let (body, other) = (near.body, other.body);
    let key = horizon_key(problem, body);
    // On a lattice, the ratio is computed from the deck's horizon, because the longest bond may exceed this
    // horizon by part of a cell.
    let spacings = match &other.points {
        PointSource::Lattice { spacing, .. } => Some(body.horizon / spacing[0]),
        PointSource::File { .. } | PointSource::Mesh { .. } => spacings,
    };
    let is = match spacings {
        Some(spacings) => format!(" is {spacings:.0} spacings of [body.{}]", other.name),
        None => String::new(),
    };
    let count = match neighbours {
        Some(neighbours) => format!("about {}", rounded(neighbours)),
        None => format!("more than {MOST_NEIGHBOURS}"),
    };
    let message = format!(
        "{key}: {} m{is}, so a point of [body.{}] would have {count} neighbours in [body.{}] \
         (at most {MOST_NEIGHBOURS} are allowed); check that the horizon is in metres",
        format_number(near.horizon),
        body.name,
        other.name
    );
    Error::input(message).at(&body.horizon_span)
}
