//! Global quantities of contact: totals over all ranks, and values per pair of bodies.

use super::rigid::RigidState;
use crate::comm::sum::{ExactSum, reduce};
use crate::problem::Problem;
use crate::solver::Simulation;

/// Contact quantities at one time; the same on all ranks.
#[derive(Debug, Clone, Default)]
pub struct ContactNow {
    /// Potential energy, J.
    pub energy: f64,
    /// Energy dissipated by friction so far, J.
    pub friction: f64,
    /// Energy dissipated by contact damping so far, J.
    pub damping: f64,
    /// Contacts between points of all bodies.
    pub all: Touching,
    /// Contacts of each pair of bodies that has a separate contact rule.
    pub pairs: Vec<Touching>,
    /// Rigid bodies and their kinetic energies, J.
    pub rigid: Vec<(RigidState, f64)>,
}

/// Totals over the pairs of points in contact.
#[derive(Debug, Clone, Default)]
pub struct Touching {
    /// Number of pairs of points in contact.
    pub count: u64,
    /// The largest overlap, m.
    pub overlap: f64,
    /// Force on the first of the two bodies by component, N. The force is 0 in [`ContactNow::all`] and for
    /// the contact of a body with itself. Friction and damping are computed from the velocities at the full
    /// step.
    pub force: Vec<f64>,
}

/// Contact values of one rank, for a pair of bodies or for all bodies: number of contacts, largest overlap,
/// and force.
struct PairSum<const D: usize> {
    /// Number of contacts of owned points. The sum over all ranks counts each pair of points twice.
    count: u64,
    overlap: f64,
    force: [ExactSum; D],
}

/// Compute the contact quantities at the present positions; all are 0 or empty if the run has no contact.
/// Collective.
pub fn contact_now<const D: usize>(simulation: &mut Simulation<'_, D>) -> ContactNow {
    let (comm, model, fields) = (simulation.comm, &simulation.model, &simulation.fields);
    let Some(contact) = &mut simulation.contact else {
        return ContactNow::default();
    };
    contact.ghosts.update(comm, fields);
    let contact = &*contact;
    let bodies = bodies_of_pairs(simulation.problem);
    let new = || PairSum {
        count: 0,
        overlap: 0.0,
        force: [ExactSum::ZERO; D],
    };
    // The first entry is the total. The other entries belong to the pairs of bodies.
    let mut sums: Vec<PairSum<D>> = (0..=bodies.len()).map(|_| new()).collect();
    for point in contact.open.iter().map(|point| *point as usize) {
        let body = simulation.problem.body_of(usize::from(model.block[point]));
        contact.for_each_touch(model, fields, point, |block, touch| {
            let other = simulation.problem.body_of(block);
            let of_pair = bodies.iter().position(|[first, second]| {
                [*first, *second] == [body, other] || [*first, *second] == [other, body]
            });
            for place in [Some(0), of_pair.map(|pair| pair + 1)]
                .into_iter()
                .flatten()
            {
                sums[place].count += 1;
                sums[place].overlap = sums[place].overlap.max(touch.overlap);
            }
            if let Some(pair) = of_pair.filter(|pair| bodies[*pair][0] == body && body != other) {
                for d in 0..D {
                    let force = touch.repulsion[d] + touch.damping[d] + touch.friction[d];
                    sums[pair + 1].force[d].add(force);
                }
            }
        });
    }
    let mut counts: Vec<u64> = sums.iter().map(|sum| sum.count).collect();
    comm.sum(&mut counts);
    let mut overlaps: Vec<f64> = sums.iter().map(|sum| sum.overlap).collect();
    comm.max(&mut overlaps);
    let columns = [
        &fields.contact_energy,
        &fields.friction_energy,
        &fields.contact_damping_energy,
    ];
    let mut exact: Vec<ExactSum> = columns
        .into_iter()
        .map(|column| {
            let mut sum = ExactSum::ZERO;
            column.iter().flatten().for_each(|value| sum.add(*value));
            sum
        })
        .collect();
    exact.extend(sums.into_iter().flat_map(|sum| sum.force));
    let exact = reduce(comm, &mut exact);
    let mut all = counts.iter().zip(overlaps).zip(exact[3..].chunks_exact(D));
    let mut touching = std::iter::from_fn(|| {
        let ((count, overlap), force) = all.next()?;
        Some(Touching {
            count: count / 2,
            overlap,
            force: force.to_vec(),
        })
    });
    let rigid: Vec<_> = contact
        .rigid
        .iter()
        .map(|it| (it.state, it.kinetic_energy()))
        .collect();
    let taken = |of: fn(&RigidState) -> f64| rigid.iter().map(|(state, _)| of(state)).sum::<f64>();
    ContactNow {
        energy: exact[0],
        friction: exact[1] + taken(|state| state.friction_energy),
        damping: exact[2] + taken(|state| state.damping_energy),
        all: touching.next().unwrap_or_default(),
        pairs: touching.collect(),
        rigid,
    }
}

/// Indices of the two bodies of each pair with a separate contact rule.
fn bodies_of_pairs(problem: &Problem) -> Vec<[usize; 2]> {
    let index = |name: &String| problem.bodies.iter().position(|body| body.name == *name);
    let pairs = problem.contact.iter().flat_map(|contact| &contact.pairs);
    let bodies = pairs.filter_map(|pair| Some([index(&pair.bodies[0])?, index(&pair.bodies[1])?]));
    bodies.collect()
}
