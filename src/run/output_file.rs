//! The result file of an output: the main result or a further result.

use std::path::Path;

use crate::comm::{Communicator, IdOrder, agree};
use crate::error::{ErrorKind, Result};
use crate::output::{Creation, HistoryContents, ResultFile, SideCar};
use crate::problem::{Field, Output};
use crate::solver::Simulation;
use crate::solver::conditions::output_members;
use crate::solver::observers::{Schedule, Snapshot};

use super::layout::{ResultLayout, select};

/// Whether a result file is created or resumed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// Create a new file.
    New(Creation),
    /// Resume the existing file after this number of outputs.
    After(u64),
}

/// The open result file of an output.
pub struct OutputFile<'a> {
    /// The result file.
    pub file: ResultFile<'a>,
    /// Schedule of the outputs.
    pub schedule: Schedule,
    output: &'a Output,
    /// Index of this output among the further outputs that count newly broken bonds; `None` for other
    /// outputs.
    counter: Option<usize>,
    /// Rows of the points in the result, counted within this rank's range of ids. `None` if the result
    /// contains all points.
    rows: Option<Vec<usize>>,
    /// The side-car; on rank 0 only.
    side_car: Option<SideCar>,
}

/// History rows of a resumed main result.
pub type RetainedRows = Vec<Vec<f64>>;

impl<'a> OutputFile<'a> {
    /// Create or resume the file at a path. `history` is the description of the history, and the number of
    /// rows after which a resumed history continues; `None` for further results. Also return the history rows
    /// that a resumed file retains. Collective.
    ///
    /// # Errors
    /// If the file cannot be created, resumed or written, or the set of the output is empty.
    pub fn new<const D: usize>(
        simulation: &Simulation<'a, D>,
        (output, path): (&'a Output, &Path),
        order: &IdOrder,
        (start, history): (Start, Option<(&HistoryContents, u64)>),
        metadata: &[(&str, String)],
    ) -> Result<(Self, RetainedRows)> {
        let comm = simulation.comm;
        let rows = output_rows(simulation, output, order)?;
        let schedule = Schedule::of_outputs(output);
        let steps = schedule.count(&simulation.expected_clock());
        let mut metadata = metadata.to_vec();
        metadata.extend(output.name.clone().map(|name| ("output", name)));
        let layout = ResultLayout::new(simulation, output, (order, &rows), steps, &metadata);
        let fixed = layout.fixed();
        let contents = layout.contents(&fixed);
        let (file, past) = match start {
            Start::New(creation) => {
                let created = ResultFile::create(path, comm, creation, &contents);
                let created = created.and_then(|mut file| {
                    if let Some((history, _)) = history {
                        file.create_history(history)?;
                    }
                    Ok(file)
                });
                let is_begun = |error: &crate::error::Error| error.kind == ErrorKind::Run;
                if created.as_ref().err().is_some_and(is_begun) && comm.rank() == 0 {
                    // An error is ignored, because a result without outputs only takes space.
                    let _ = std::fs::remove_file(path);
                }
                let file = created?;
                if comm.rank() == 0 {
                    // The side-car of an earlier result does not describe this result. An error is ignored,
                    // because the first output replaces the side-car.
                    let _ = std::fs::remove_file(path.with_extension("xdmf"));
                }
                (file, RetainedRows::new())
            }
            Start::After(outputs) => ResultFile::resume(path, comm, &contents, history, outputs)?,
        };
        let side_car = (comm.rank() == 0).then(|| SideCar::new(path, &contents, file.past()));
        let mut counters = simulation.problem.further_counts();
        let counter = counters.position(|counting| std::ptr::eq(counting, output));
        let opened = Self {
            file,
            schedule,
            output,
            counter,
            rows,
            side_car,
        };
        Ok((opened, past))
    }

    /// Find the rows of the result again after a rebalance or refinement. Collective.
    ///
    /// # Errors
    /// If the set of the output is empty.
    pub fn update_points<const D: usize>(
        &mut self,
        simulation: &Simulation<'_, D>,
        order: &IdOrder,
    ) -> Result<()> {
        self.rows = output_rows(simulation, self.output, order)?;
        Ok(())
    }

    /// Return the fields of the output.
    pub fn fields(&self) -> &[Field] {
        &self.output.fields
    }

    /// Append an output, and reset the count of newly broken bonds that belongs to this result. Collective.
    ///
    /// # Errors
    /// If a write fails, for example because the disk is full.
    pub fn write<const D: usize>(
        &mut self,
        simulation: &mut Simulation<'_, D>,
        snapshot: &Snapshot,
        order: &IdOrder,
    ) -> Result<()> {
        if simulation.may_refine() {
            let layout = ResultLayout::new(simulation, self.output, (order, &self.rows), 0, &[]);
            let fixed = layout.fixed();
            self.file.set_points(&layout.contents(&fixed))?;
        }
        let (time, number) = (simulation.clock.time(), simulation.clock.number());
        let (fields, counter, rows) = (&self.output.fields, self.counter, &self.rows);
        self.file.write_step(time, number, |k| {
            let (field, width) = (fields[k], fields[k].components());
            let counted = counter.filter(|_| field == Field::NewlyBrokenBonds);
            let columns = &simulation.fields.newly_broken_of_further;
            let values = match counted.and_then(|counter| columns.get(counter)) {
                Some(counted) => order.collect(simulation.comm, counted, 1),
                None => {
                    let values = snapshot.field(simulation, field);
                    order.collect(simulation.comm, &values, width)
                }
            };
            select(rows, values, width)
        })?;
        let written = match &mut self.side_car {
            Some(side_car) => side_car.add(time, self.file.points()),
            None => Ok(()),
        };
        agree(simulation.comm, written)?;
        match (&self.output.name, self.counter) {
            (None, _) => simulation.fields.forget_newly_broken(),
            (Some(_), Some(counter)) => simulation.fields.forget_newly_broken_of(counter),
            (Some(_), None) => {}
        }
        Ok(())
    }

    /// Close the file. If `will_resume` is true, unused space in the file is not freed. Collective.
    ///
    /// # Errors
    /// If closing the file or an earlier write fails, for example because the disk is full.
    pub fn close(self, will_resume: bool) -> Result<()> {
        let comm = self.file.communicator();
        self.file.close(will_resume)?;
        agree(comm, self.side_car.map_or(Ok(()), SideCar::finish))
    }
}

/// Find the rows of the output's points. A row is an index into this rank's range of ids. `None` if the
/// output contains all points. Collective.
///
/// # Errors
/// If the set of the output is empty.
pub fn output_rows<const D: usize>(
    simulation: &Simulation<'_, D>,
    output: &Output,
    order: &IdOrder,
) -> Result<Option<Vec<usize>>> {
    let (problem, model) = (simulation.problem, &simulation.model);
    let comm: &dyn Communicator = simulation.comm;
    let Some(points) = output_members(problem, output, comm, model)? else {
        return Ok(None);
    };
    let mut flags = vec![0_u32; model.owned()];
    points.iter().for_each(|point| flags[*point as usize] = 1);
    let flags = order.collect(comm, &flags, 1);
    Ok(Some(
        (0..flags.len()).filter(|row| flags[*row] == 1).collect(),
    ))
}
