//! Initial displacements and velocities.

use crate::comm::{Communicator, Found, IdOrder, agree, all_gather, least};
use crate::error::{Error, Result};
use crate::points::value_file;
use crate::problem::{Initial, InitialFile, Problem};
use crate::solver::model::Model;
use crate::solver::motion::Fields;

use super::{members, not_empty};

/// Set the initial displacements and velocities. Collective.
///
/// # Errors
/// If a set is empty; or if a file cannot be read, has an invalid row, or does not have exactly one row for
/// each point of its set. The error is the same on all ranks.
pub fn apply_initials<const D: usize>(
    problem: &Problem,
    comm: &dyn Communicator,
    model: &Model<D>,
    fields: &mut Fields<D>,
) -> Result<()> {
    for initial in &problem.initials {
        let points = members(problem, model, initial.set);
        let key = format!("[initial.{}] set", initial.name);
        not_empty(
            problem,
            comm,
            initial.set,
            &points,
            (&key, initial.span.clone()),
        )?;
        if let Some(file) = &initial.file {
            apply_file(initial, file, comm, model, &points, fields)?;
        }
        for point in points {
            let position = model.position(point as usize);
            for d in 0..D {
                if let Some((values, _)) = &initial.displacement {
                    fields.displacement[d][point as usize] = values[d].evaluate(position, 0.0);
                }
                if let Some((values, _)) = &initial.velocity {
                    fields.velocity[d][point as usize] = values[d].evaluate(position, 0.0);
                }
            }
        }
    }
    Ok(())
}

/// Set the displacements and velocities of points from a file. `points` are the local indices of these owned
/// points. Collective.
fn apply_file<const D: usize>(
    initial: &Initial,
    file: &InitialFile,
    comm: &dyn Communicator,
    model: &Model<D>,
    points: &[u32],
    fields: &mut Fields<D>,
) -> Result<()> {
    let values = values_of_owned(file, comm, model)?;
    let width = 2 * D;
    let error = |message: String| {
        let message = format!(
            "[initial.{}] file: {}: {message}",
            initial.name,
            file.path.display()
        );
        Error::input(message).at(&file.span)
    };
    let row = |point: u32| &values[point as usize * width..][..width];
    let missing = points.iter().filter(|point| row(**point)[0].is_nan());
    let missing = missing.map(|point| model.ids[*point as usize]).min();
    let missing = missing.map(|id| Found {
        key: 0.0,
        ids: [id],
        payload: (),
    });
    if let Some(Found { ids: [id], .. }) = least(comm, missing) {
        return Err(error(format!("has no row for the point {id} of the set")));
    }
    for point in points {
        let (displacement, velocity) = row(*point).split_at(D);
        for d in 0..D {
            if file.columns.has_displacement() {
                fields.displacement[d][*point as usize] = displacement[d];
            }
            if file.columns.has_velocity() {
                fields.velocity[d][*point as usize] = velocity[d];
            }
        }
    }
    Ok(())
}

/// Read displacement and velocity of the owned points from a file. Return `2 * D` values per point, NaN for
/// points without a row. Each rank reads a part of the rows, and sends each row to the rank whose range of
/// ids contains the id of the row. Collective.
fn values_of_owned<const D: usize>(
    file: &InitialFile,
    comm: &dyn Communicator,
    model: &Model<D>,
) -> Result<Vec<f64>> {
    let rows = value_file::read(file, model.total, comm)?;
    let order = IdOrder::new(comm, &model.ids[..model.owned()], model.coarsest);
    let firsts = all_gather(comm, order.first());
    let path = file.path.display();
    let mut outgoing = vec![Vec::new(); comm.size()];
    for (id, values) in rows {
        let home = firsts.partition_point(|first| *first <= id) - 1;
        outgoing[home].extend_from_slice(&id.to_ne_bytes());
        let bytes = values.iter().flat_map(|value| value.to_ne_bytes());
        outgoing[home].extend(bytes);
    }
    let width = 2 * D;
    let mut of_range = vec![f64::NAN; order.count() * width];
    let mut checked = Ok(());
    for bytes in comm.all_to_all(outgoing) {
        for words in bytemuck::pod_collect_to_vec::<u8, u64>(&bytes).chunks(1 + width) {
            let row = (words[0] - order.first()) as usize;
            let values = &mut of_range[row * width..][..width];
            if !values[0].is_nan() {
                let id = words[0];
                let message = format!("{path}: has two rows for the point {id}");
                checked = checked.and(Err(Error::input(message).at(&file.span)));
            }
            for (value, word) in values.iter_mut().zip(&words[1..]) {
                *value = f64::from_bits(*word);
            }
        }
    }
    agree(comm, checked)?;
    Ok(order.spread(comm, &of_range, width))
}
