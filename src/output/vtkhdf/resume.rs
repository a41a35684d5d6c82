//! Resumption of a result: in place if the layout allows, otherwise in a copy.

use std::path::Path;

use super::super::access::Creation;
use super::super::attribute::Attribute;
use super::super::changing;
use super::super::collective::CollectiveFile;
use super::super::field::{Number, POINT_DATA};
use super::super::history::{HISTORY, History, HistoryContents};
use super::{Contents, ResultFile, STEPS, Table, append_one, tables_of, truncate};
use crate::comm::{Communicator, agree, threads, total};
use crate::error::{Error, Result};

/// Attributes that must be equal in the file and in the resumed run, so that the file can be continued in
/// place. The other attributes describe the last start of the run.
const IDENTITY: [&str; 3] = ["deck", "deck_in_full", "version"];

/// Number of steps and history rows that a resumed result retains.
#[derive(Debug, Clone, Copy)]
struct Retained {
    steps: u64,
    /// `None` for a result without a history.
    rows: Option<u64>,
}

/// Description of the history of a result, and the number of its retained rows; `None` without a history.
type RetainedHistory<'a, 'b> = Option<(&'a HistoryContents<'b>, u64)>;

impl<'a> ResultFile<'a> {
    /// Resume a result. Retain its first `steps` steps, and drop later steps. `history` gives the number of
    /// history rows that are retained; later rows are dropped. Return the retained history rows.
    ///
    /// A file is continued in place if these conditions are met:
    ///
    /// - The points never change.
    /// - The deck and the version in the file are those of this run.
    /// - The file has space for all expected steps.
    /// - Dropping the later rows does not free a chunk.
    ///
    /// The retained rows then do not move, so no row is lost if the process is killed. If a condition is not
    /// met, or the file is not writable, the retained part is copied to a new file. The new file then
    /// replaces the old file.
    ///
    /// # Errors
    /// - If the old file cannot be read or has fewer than `steps` steps.
    /// - If the points or fields of the old file differ from those of `contents`.
    /// - If a write fails, for example because the disk is full.
    pub fn resume(
        path: &Path,
        comm: &'a dyn Communicator,
        contents: &Contents,
        history: Option<(&HistoryContents, u64)>,
        steps: u64,
    ) -> Result<(Self, Vec<Vec<f64>>)> {
        let rows = history.map(|(_, rows)| rows);
        let retained = Retained { steps, rows };
        let prepared = if comm.rank() == 0 {
            prepare(path, contents, retained)
        } else {
            Ok(false)
        };
        if total(comm, u64::from(agree(comm, prepared)?)) > 0 {
            Self::continue_in_place(path, comm, contents, history, retained)
        } else {
            Self::copied(path, comm, contents, history, retained)
        }
    }

    /// Open a prepared file and continue it in place.
    fn continue_in_place(
        path: &Path,
        comm: &'a dyn Communicator,
        contents: &Contents,
        history: RetainedHistory,
        retained: Retained,
    ) -> Result<(Self, Vec<Vec<f64>>)> {
        let total = contents.piece.total;
        let mut file = CollectiveFile::open_to_append(path, comm)?;
        let times = file.open_dataset(&format!("{STEPS}/Values"))?;
        let numbers = file.open_dataset(&format!("{STEPS}/Step"))?;
        let past: Vec<f64> = file.read_rows(&times, 0, retained.steps as usize)?;
        let rows = match history {
            Some((_, rows)) => History::read(&mut file, rows)?,
            None => Vec::new(),
        };
        let mut fields = Vec::new();
        for field in contents.moving {
            let path = format!("{POINT_DATA}/{}", field.name);
            fields.push((*field, file.open_dataset(&path)?));
        }
        let mut tables = Vec::new();
        for (path, _, rule) in tables_of(contents) {
            let dataset = file.open_dataset(&path)?;
            tables.push(Table { dataset, rule });
        }
        let capacity = tables.iter().map(|table| table.dataset.rows());
        let capacity = capacity.chain(fields.iter().map(|(_, field)| field.rows() / total));
        let history = match history {
            Some((contents, _)) => Some(History::resume(&mut file, contents, &rows)?),
            None => None,
        };
        let result = Self {
            piece: contents.piece,
            points: contents.positions.len(),
            steps: retained.steps,
            past: past.iter().map(|time| (*time, total as usize)).collect(),
            rows: retained.steps * total,
            changing: None,
            capacity: capacity.min().unwrap_or(0),
            tables,
            numbers,
            times,
            fields,
            history,
            file,
        };
        Ok((result, rows))
    }

    /// Copy the retained part to a new file. Then rename the new file, so that it replaces the old file. If
    /// the process is killed, either the old or the new file remains.
    fn copied(
        path: &Path,
        comm: &'a dyn Communicator,
        contents: &Contents,
        history: RetainedHistory,
        retained: Retained,
    ) -> Result<(Self, Vec<Vec<f64>>)> {
        let piece = contents.piece;
        let mut old = CollectiveFile::open(path, comm)?;
        let times = old.open_dataset(&format!("{STEPS}/Values"))?;
        let numbers = old.open_dataset(&format!("{STEPS}/Step"))?;
        let points = old.open_dataset("/VTKHDF/Points")?;
        let found = times.rows().min(numbers.rows());
        let fits = if !contents.changing && points.rows() != piece.total {
            Err(Error::run(format!("{}: has other points", path.display())))
        } else if found < retained.steps {
            let text = format!("has {found} of the first {} outputs", retained.steps);
            Err(Error::run(format!("{}: {text}", path.display())))
        } else {
            Ok(())
        };
        agree(comm, fits)?;
        let times: Vec<f64> = old.read_rows(&times, 0, retained.steps as usize)?;
        let numbers: Vec<u64> = old.read_rows(&numbers, 0, retained.steps as usize)?;

        let part = path.with_extension("vtkhdf.part");
        let copied = Self::copy(&mut old, &part, comm, contents, (times, numbers));
        let finished = copied.and_then(|mut result| {
            let rows = match history {
                Some((_, rows)) => History::read(&mut old, rows)?,
                None => Vec::new(),
            };
            old.close()?;
            if let Some((contents, _)) = history {
                result.create_history(contents)?;
                result.append_history(&rows)?;
            }
            result.file.flush()?;
            result.file.rename(path)?;
            Ok((result, rows))
        });
        if finished.is_err() && comm.rank() == 0 {
            // Best effort: a leftover file only takes space.
            let _ = std::fs::remove_file(&part);
        }
        finished
    }

    /// Create the file `part` with the first steps of an old file. `times` (s) and `numbers` are the times
    /// and the time step numbers of these steps.
    fn copy(
        old: &mut CollectiveFile<'a>,
        part: &Path,
        comm: &'a dyn Communicator,
        contents: &Contents,
        (times, numbers): (Vec<f64>, Vec<u64>),
    ) -> Result<Self> {
        let (piece, retained) = (contents.piece, times.len() as u64);
        let mut result = Self::create(part, comm, Creation::Truncate, contents)?;
        if contents.changing {
            let counts = result.copy_changing(old, retained)?;
            return result.record_steps(&times, &numbers, &counts);
        }
        result.allocate_steps(retained)?;
        for (field, values) in &result.fields {
            let stored = old.open_dataset(&format!("{POINT_DATA}/{}", field.name))?;
            for step in 0..retained {
                let (first, count) = (step * piece.total + piece.first, result.points);
                if field.number == Number::F32 {
                    let rows: Vec<f32> = old.read_rows(&stored, first, count)?;
                    result.file.write_rows(values, first, &rows)?;
                } else {
                    let rows: Vec<f64> = old.read_rows(&stored, first, count)?;
                    result.file.write_rows(values, first, &rows)?;
                }
            }
        }
        result.rows = retained * piece.total;
        result.record_steps(&times, &numbers, &vec![piece.total as i64; times.len()])
    }

    /// Write the times (s) and the time step numbers (`numbers`) of the copied steps, and the count of these
    /// steps. `points` has the number of points of each copied step.
    fn record_steps(mut self, times: &[f64], numbers: &[u64], points: &[i64]) -> Result<Self> {
        for ((time, number), points) in times.iter().zip(numbers).zip(points) {
            append_one(&mut self.file, &mut self.numbers, *number)?;
            append_one(&mut self.file, &mut self.times, *time)?;
            self.past.push((*time, *points as usize));
        }
        self.steps = times.len() as u64;
        let steps = Attribute::Integer(self.steps as i64);
        self.file.set_attribute(STEPS, "NSteps", steps)?;
        Ok(self)
    }

    /// Copy the first steps of an old file in which each step has its own points. Return the number of points
    /// of each step.
    fn copy_changing(&mut self, old: &mut CollectiveFile<'a>, retained: u64) -> Result<Vec<i64>> {
        let Some(changing) = &mut self.changing else {
            return Ok(Vec::new());
        };
        let counts = old.open_dataset("/VTKHDF/NumberOfPoints")?;
        let counts: Vec<i64> = old.read_rows(&counts, 0, retained as usize)?;
        self.rows = counts.iter().sum::<i64>() as u64;
        changing.copy(old, &mut self.file, self.rows, retained)?;
        for (field, dataset) in &mut self.fields {
            changing::copy_field(old, &mut self.file, field.number, dataset, self.rows)?;
        }
        for table in &mut self.tables {
            changing::copy::<i64>(old, &mut self.file, &mut table.dataset, retained)?;
        }
        Ok(counts)
    }
}

/// Prepare a file for a continuation in place: truncate the times, the time step numbers and the history to
/// the retained rows, and set the attributes. Return false, without a change, if the file cannot be continued
/// in place. To be called on one rank only.
///
/// # Errors
/// If a write fails.
fn prepare(path: &Path, contents: &Contents, retained: Retained) -> Result<bool> {
    let alone = threads::alone();
    let checked = CollectiveFile::open(path, &alone).and_then(|mut file| {
        let fits = has_room(&mut file, contents, retained)?;
        file.close()?;
        Ok(fits)
    });
    // Return false for a file that is read-only, locked by a reader or damaged: the file is then copied, and
    // the copy reports any damage.
    let opened = match checked {
        Ok(true) => CollectiveFile::open_to_append(path, &alone).ok(),
        _ => None,
    };
    let Some(mut file) = opened else {
        return Ok(false);
    };
    // Write NSteps first: a killed process must not leave NSteps larger than the tables.
    let steps = Attribute::Integer(retained.steps as i64);
    file.set_attribute(STEPS, "NSteps", steps)?;
    file.flush()?;
    truncate(&mut file, &counted_rows(retained))?;
    for (name, text) in contents.metadata {
        if file.text_attribute("/", name).ok().as_ref() != Some(text) {
            file.set_attribute("/", name, Attribute::Text(text))?;
        }
    }
    file.close()?;
    Ok(true)
}

/// Test whether a file can be continued in place, under the conditions of [`ResultFile::resume`]. The number
/// of points in the file must also equal the total number of points of `contents`.
fn has_room(
    file: &mut CollectiveFile<'_>,
    contents: &Contents,
    retained: Retained,
) -> Result<bool> {
    if contents.changing {
        return Ok(false);
    }
    let (total, steps) = (contents.piece.total, contents.steps.max(retained.steps));
    let texts = contents.metadata.iter();
    for (name, text) in texts.filter(|(name, _)| IDENTITY.contains(name)) {
        if file.text_attribute("/", name)? != *text {
            return Ok(false);
        }
    }
    if file.open_dataset("/VTKHDF/Points")?.rows() != total {
        return Ok(false);
    }
    for field in contents.moving {
        let dataset = file.open_dataset(&format!("{POINT_DATA}/{}", field.name))?;
        if dataset.rows() < steps * total {
            return Ok(false);
        }
    }
    for (path, _, _) in tables_of(contents) {
        if file.open_dataset(&path)?.rows() < steps {
            return Ok(false);
        }
    }
    for (path, rows) in counted_rows(retained) {
        let dataset = file.open_dataset(&path)?;
        if dataset.rows() < rows || dataset.frees_a_chunk(rows) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// List the datasets that have one row per written step or per history row. An item of the list is the path
/// of a dataset and the length of this dataset after truncation.
fn counted_rows(retained: Retained) -> Vec<(String, u64)> {
    let mut counted = vec![
        (format!("{STEPS}/Values"), retained.steps),
        (format!("{STEPS}/Step"), retained.steps),
    ];
    counted.extend(retained.rows.map(|rows| (HISTORY.to_owned(), rows)));
    counted
}
