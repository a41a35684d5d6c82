//! Checkpoints: two alternating files, readable on any number of ranks.
//!
//! A checkpoint is written to a temporary file and sealed with a checksum. A rename then replaces the
//! older file, so a kill at any time leaves at least one valid checkpoint.

use std::path::{Path, PathBuf};

use crate::comm::{Communicator, IdOrder, agree};
use crate::error::{Error, Result};
use crate::refine::NodeKey;
use crate::solver::Simulation;
use crate::solver::motion::{Saved, SavedBonds};

use super::access::Creation;
use super::attribute::Attribute;
use super::collective::CollectiveFile;
use super::dataset::Rows;
use super::seal;

/// Names of the two files.
const NAMES: [&str; 2] = ["checkpoint_0.h5", "checkpoint_1.h5"];

/// Name of the temporary file.
const PART: &str = "checkpoint.part";

/// Version of the layout.
const VERSION: i64 = 8;

/// Test whether a path is in use; a link to a missing or unreadable file counts.
pub fn is_taken(path: &Path) -> bool {
    !matches!(path.symlink_metadata(), Err(error) if error.kind() == std::io::ErrorKind::NotFound)
}

/// The contents of a checkpoint without the state of the points.
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// Number of the step.
    pub number: u64,
    /// Time step, s.
    pub step: f64,
    /// State of the refined grids, see [`crate::refine::Grids::state`].
    pub grids: [Vec<NodeKey>; 2],
    /// Number of points over all ranks.
    pub points: u64,
    /// Hash of the points.
    pub fingerprint: u64,
    /// Outputs in the main result.
    pub outputs: u64,
    /// The further results.
    pub further: Vec<FurtherResult>,
    /// Rows in the history.
    pub rows: u64,
    /// Reference values of the history: energy at the start, J, and number of intact bonds before it.
    pub start: (f64, u64),
    /// The deck with all defaults.
    pub deck: String,
}

/// Data of a further result in a checkpoint.
#[derive(Debug, Clone, PartialEq)]
pub struct FurtherResult {
    /// Name of its output.
    pub name: String,
    /// Outputs in the file.
    pub outputs: u64,
    /// Whether the state has, after all other columns, a column with the number of bonds that have broken since the last
    /// output of this result.
    pub counts_newly_broken: bool,
}

/// Attribute with the names of the further results, one per line; absent if there are none. The attribute `numbers` then
/// ends with two numbers of each further result.
const FURTHER: &str = "further_outputs";

/// The datasets of the state of the grids; absent if empty.
const GRIDS: [&str; 2] = ["/refined", "/parted"];

/// The two checkpoints of a folder.
pub struct Checkpoints {
    folder: PathBuf,
    /// Index of the file to write next.
    next: usize,
}

impl Checkpoints {
    /// The checkpoints of a new run; it replaces existing files.
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            next: 0,
        }
    }

    /// The paths of the two files in a folder.
    pub fn paths(folder: &Path) -> impl Iterator<Item = PathBuf> {
        let folder = folder.to_owned();
        NAMES.into_iter().map(move |name| folder.join(name))
    }

    /// Remove existing checkpoints, which would belong to another run. For rank 0.
    ///
    /// # Errors
    /// If a file cannot be removed.
    pub fn remove(&self) -> Result<()> {
        for name in NAMES.iter().chain([&PART]) {
            let path = self.folder.join(name);
            match std::fs::remove_file(&path) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    let path = path.display();
                    return Err(Error::run(format!("cannot remove {path}: {error}")));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Write a checkpoint that replaces the older one. Collective.
    ///
    /// # Errors
    /// If the disk is full; existing checkpoints are kept.
    pub fn write<const D: usize>(
        &mut self,
        simulation: &Simulation<'_, D>,
        order: &IdOrder,
        header: &Header,
    ) -> Result<()> {
        let comm = simulation.comm;
        let part = self.folder.join(PART);
        let written = write_file(simulation, &part, order, header)
            .and_then(|()| seal::seal(comm, &part, header.number));
        if written.is_err() && comm.rank() == 0 {
            // Best effort: a leftover file only takes space.
            let _ = std::fs::remove_file(&part);
        }
        written?;
        let target = self.folder.join(NAMES[self.next]);
        let moved = match comm.rank() {
            0 => std::fs::rename(&part, &target)
                .and_then(|()| std::fs::File::open(&self.folder)?.sync_all())
                .map_err(|error| Error::run(format!("{}: {error}", target.display()))),
            _ => Ok(()),
        };
        agree(comm, moved)?;
        self.next = 1 - self.next;
        Ok(())
    }

    /// Open the newest intact checkpoint of the folder; `warn` receives a message per damaged one.
    /// Collective.
    ///
    /// # Errors
    /// If there is none, or one is unreadable: it may be the newest, which the next checkpoint would replace.
    pub fn open(
        comm: &dyn Communicator,
        folder: &Path,
        warn: &mut dyn FnMut(String),
    ) -> Result<(Self, PathBuf)> {
        // Only rank 0 reads the folder: on other ranks, the file system may be out of date.
        let slots = match comm.rank() {
            0 => newest_first(folder),
            _ => Ok(Vec::new()),
        };
        let mut packed = agree(comm, slots)?;
        comm.broadcast(0, &mut packed);
        for slot in packed {
            let path = folder.join(NAMES[usize::from(slot)]);
            if seal::is_intact(comm, &path)? {
                let checkpoints = Self {
                    folder: folder.to_owned(),
                    next: 1 - usize::from(slot),
                };
                return Ok((checkpoints, path));
            }
            warn(format!("{} is damaged and not used", path.display()));
        }
        Err(Error::input(format!(
            "there is no usable checkpoint in {}; start without --restart",
            folder.display()
        )))
    }
}

/// The indices of existing checkpoints in the order to try them.
fn newest_first(folder: &Path) -> Result<Vec<u8>> {
    let mut found: Vec<(Option<u64>, u8)> = Vec::new();
    for (slot, name) in (0..).zip(NAMES) {
        let path = folder.join(name);
        if is_taken(&path) {
            found.push((seal::number(&path)?, slot));
        }
    }
    // An unsealed file may have been the newest, so try it first to warn of it.
    found.sort_by_key(|(number, _)| (number.is_some(), std::cmp::Reverse(*number)));
    Ok(found.into_iter().map(|(_, slot)| slot).collect())
}

/// Read the header of a checkpoint. Collective.
///
/// # Errors
/// If another version of Fissure wrote the file.
pub fn read_header(comm: &dyn Communicator, path: &Path) -> Result<Header> {
    let mut file = CollectiveFile::open(path, comm)?;
    let numbers = file.integers_attribute("/", "numbers")?;
    let deck = file.text_attribute("/", "deck")?;
    let mut grids = [const { Vec::new() }; 2];
    let mut further = Vec::new();
    if let [
        VERSION,
        _,
        _,
        _,
        _,
        _,
        _,
        _,
        _,
        refined,
        suppressed,
        ref figures @ ..,
    ] = numbers[..]
    {
        if !figures.is_empty() {
            let names = file.text_attribute("/", FURTHER)?;
            let figures = figures.as_chunks().0.iter();
            further = names
                .lines()
                .zip(figures)
                .map(|(name, [outputs, counts])| FurtherResult {
                    name: name.to_owned(),
                    outputs: *outputs as u64,
                    counts_newly_broken: *counts != 0,
                })
                .collect();
        }
        for ((keys, name), count) in grids.iter_mut().zip(GRIDS).zip([refined, suppressed]) {
            if count > 0 {
                let dataset = file.open_dataset(name)?;
                let rows: Vec<i64> = file.read_rows(&dataset, 0, count as usize)?;
                *keys = rows.as_chunks().0.to_vec();
            }
        }
    }
    file.close()?;
    match numbers[..] {
        [
            VERSION,
            number,
            step,
            points,
            fingerprint,
            outputs,
            rows,
            energy,
            intact,
            _,
            _,
            ..,
        ] => Ok(Header {
            number: number as u64,
            step: f64::from_bits(step as u64),
            grids,
            points: points as u64,
            fingerprint: fingerprint as u64,
            outputs: outputs as u64,
            further,
            rows: rows as u64,
            start: (f64::from_bits(energy as u64), intact as u64),
            deck,
        }),
        _ => Err(Error::input(format!(
            "{} was written by another version of Fissure",
            path.display()
        ))),
    }
}

/// Read the state of this rank's range of ids. Collective.
///
/// # Errors
/// If the file cannot be read.
pub fn read_saved(comm: &dyn Communicator, path: &Path, order: &IdOrder) -> Result<Saved> {
    let mut file = CollectiveFile::open(path, comm)?;
    let lengths = file.open_dataset("/bond_bytes")?;
    let bonds = file.open_dataset("/bonds")?;
    let progress = file.integers_attribute("/", "progress")?;
    let width = file.integers_attribute("/", "columns")?;
    let (first, count) = (order.first(), order.count());
    let mut columns = Vec::new();
    for k in 0..width.first().copied().unwrap_or(0) {
        let dataset = file.open_dataset(&column(k as usize))?;
        columns.push(file.read_rows(&dataset, first, count)?);
    }
    let lengths: Vec<u32> = file.read_rows(&lengths, first, count)?;
    let own = lengths.iter().map(|length| u64::from(*length)).sum();
    let (start, _) = crate::comm::scan(comm, own);
    let bytes = file.read_rows(&bonds, start, own as usize)?;
    file.close()?;
    Ok(Saved {
        columns,
        bonds: SavedBonds { lengths, bytes },
        progress: progress.into_iter().map(|word| word as u64).collect(),
    })
}

/// Path of the dataset of a column of the state.
fn column(k: usize) -> String {
    format!("/column_{k}")
}

fn write_file<const D: usize>(
    simulation: &Simulation<'_, D>,
    path: &Path,
    order: &IdOrder,
    header: &Header,
) -> Result<()> {
    let comm = simulation.comm;
    let mut file = CollectiveFile::create(path, comm, Creation::Truncate)?;
    let mut numbers = vec![
        VERSION,
        header.number as i64,
        header.step.to_bits() as i64,
        header.points as i64,
        header.fingerprint as i64,
        header.outputs as i64,
        header.rows as i64,
        header.start.0.to_bits() as i64,
        header.start.1 as i64,
        header.grids[0].len() as i64,
        header.grids[1].len() as i64,
    ];
    for further in &header.further {
        let counts = i64::from(further.counts_newly_broken);
        numbers.extend([further.outputs as i64, counts]);
    }
    if !header.further.is_empty() {
        let names: Vec<&str> = header
            .further
            .iter()
            .map(|result| &result.name[..])
            .collect();
        file.set_attribute("/", FURTHER, Attribute::Text(&names.join("\n")))?;
    }
    file.set_attribute("/", "numbers", Attribute::Integers(&numbers))?;
    let progress: Vec<i64> = simulation
        .progress()
        .iter()
        .map(|word| *word as i64)
        .collect();
    file.set_attribute("/", "progress", Attribute::Integers(&progress))?;
    let width = [simulation.saved_width() as i64];
    file.set_attribute("/", "columns", Attribute::Integers(&width))?;
    file.set_attribute("/", "deck", Attribute::Text(&header.deck))?;
    for (keys, name) in header.grids.iter().zip(GRIDS) {
        if !keys.is_empty() {
            let rows = Rows::Fixed(keys.len() as u64);
            let dataset = file.create_dataset::<i64>(name, rows, Some(5))?;
            let own = if comm.rank() == 0 {
                keys.as_flattened()
            } else {
                &[]
            };
            file.write_rows(&dataset, 0, own)?;
        }
    }
    let points = Rows::Fixed(header.points);
    // Column by column, to limit the buffer memory.
    for (k, values) in simulation.saved_columns(order).enumerate() {
        let dataset = file.create_dataset::<f64>(&column(k), points, None)?;
        file.write_rows(&dataset, order.first(), &values)?;
    }
    let saved = simulation.saved_bonds(order);
    let (start, total) = crate::comm::scan(comm, saved.bytes.len() as u64);
    let lengths = file.create_dataset::<u32>("/bond_bytes", points, None)?;
    file.write_rows(&lengths, order.first(), &saved.lengths)?;
    let bonds = file.create_dataset::<u8>("/bonds", Rows::Fixed(total), None)?;
    file.write_rows(&bonds, start, &saved.bytes)?;
    file.close()
}
