//! Checkpoints: two alternating files, readable on any number of ranks.
//!
//! A checkpoint is written to a temporary file and sealed with a checksum. The file is then renamed and
//! replaces the older checkpoint. If the run is killed during a write, the existing checkpoints remain valid.

use std::path::{Path, PathBuf};

use bytemuck::{Pod, Zeroable};

use crate::comm::{Communicator, IdOrder, agree};
use crate::error::{Error, Result};
use crate::message::{REPLACE, RESTART};
use crate::refine::NodeKey;
use crate::solver::Simulation;
use crate::solver::motion::{Saved, SavedBonds, SavedColumn};

use super::access::Creation;
use super::attribute::Attribute;
use super::collective::CollectiveFile;
use super::dataset::Rows;
use super::seal;

/// Names of the two checkpoint files.
const NAMES: [&str; 2] = ["checkpoint_0.h5", "checkpoint_1.h5"];

/// Name of the file into which a checkpoint is written. A complete file is renamed to one of [`NAMES`].
const PART: &str = "checkpoint.part";

/// Version of the file layout.
const VERSION: i64 = 12;

/// Test whether a path exists. A link to a missing file counts as existing, and so does a path that cannot be
/// examined.
pub fn is_taken(path: &Path) -> bool {
    !matches!(path.symlink_metadata(), Err(error) if error.kind() == std::io::ErrorKind::NotFound)
}

/// Contents of a checkpoint, without the state of the points and bonds and without the progress (clock, load
/// step, load factors, rigid bodies).
#[derive(Debug, Clone, PartialEq)]
pub struct Header {
    /// Number of completed time steps.
    pub number: u64,
    /// Time step, s.
    pub step: f64,
    /// State of the refined grids, see [`crate::refine::Grids::state`].
    pub grids: [Vec<NodeKey>; 2],
    /// Number of points over all ranks.
    pub points: u64,
    /// Hashes of the points and of the sets.
    pub fingerprint: Fingerprint,
    /// Number of outputs in the main result.
    pub outputs: u64,
    /// The further results.
    pub further: Vec<FurtherResult>,
    /// Number of rows in the history.
    pub rows: u64,
    /// Reference values of the history: energy at the start (J), and number of bonds that were intact
    /// before any bond could break.
    pub start: (f64, u64),
    /// State of the checks of the energy balance, encoded as words.
    pub energy_watch: [u64; 7],
    /// Description of the physics: the deck with all defaults or, without a deck, a listing of the problem.
    pub deck: String,
}

/// Hashes of the points and sets of a run. They do not depend on the number of ranks.
#[derive(Debug, Clone, PartialEq)]
pub struct Fingerprint {
    /// Hash of the ids, positions, volumes and blocks of the points.
    pub points: u64,
    /// Name of each set that comes from a file or mesh, and hash of the ids of its points.
    pub sets: Vec<(String, u64)>,
}

/// State of a further result in a checkpoint.
#[derive(Debug, Clone, PartialEq)]
pub struct FurtherResult {
    /// Name of the further result.
    pub name: String,
    /// Number of outputs in the file of the result.
    pub outputs: u64,
}

/// The numbers of a header, as stored in an attribute.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Numbers {
    version: i64,
    number: u64,
    step: f64,
    points: u64,
    fingerprint: u64,
    outputs: u64,
    rows: u64,
    energy_at_start: f64,
    intact_at_start: u64,
    energy_watch: [u64; 7],
    refined_nodes: u64,
    removed_nodes: u64,
    further_results: u64,
}

/// Two attributes: the names of the sets, one per line, and the hash of each set.
const SETS: [&str; 2] = ["sets", "hashes_of_sets"];

/// Two attributes: the names of the further results, one per line, and the number of outputs of each result.
/// Both attributes are absent if there are no further results.
const FURTHER: [&str; 2] = ["further_outputs", "counts_of_further_outputs"];

/// Attribute with the names of the datasets of the state, one per line.
const STATE: &str = "state";

/// Datasets with the refined nodes and the suppressed nodes of the refined grids; absent if empty.
const GRIDS: [&str; 2] = ["/refined", "/parted"];

/// The two checkpoints of a folder.
pub struct Checkpoints {
    folder: PathBuf,
    /// Index of the file to write next.
    next: usize,
}

impl Checkpoints {
    /// Return the checkpoints of a new run, before the first write. The first checkpoint will be
    /// `checkpoint_0.h5`.
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            next: 0,
        }
    }

    /// Return the paths of the two files in a folder.
    pub fn paths(folder: &Path) -> impl Iterator<Item = PathBuf> {
        let folder = folder.to_owned();
        NAMES.into_iter().map(move |name| folder.join(name))
    }

    /// Remove existing checkpoints and a leftover temporary file, because all these files belong to another
    /// run. To be called on one rank only.
    ///
    /// # Errors
    /// If a file cannot be removed.
    pub fn remove(&self) -> Result<()> {
        for name in NAMES.iter().chain([&PART]) {
            let path = self.folder.join(name);
            match std::fs::remove_file(&path) {
                Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                    return Err(Error::file(&path, "remove", &error));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Write a checkpoint that replaces the older of the two checkpoints. Collective.
    ///
    /// # Errors
    /// If the checkpoint cannot be written, for example because the disk is full. The existing checkpoints
    /// are kept.
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

    /// Find the newest intact checkpoint of the folder. Return the checkpoints of the folder, and the path of
    /// the found checkpoint. `warn` receives a message for each damaged checkpoint that is tried before an
    /// intact one is found. Collective.
    ///
    /// # Errors
    /// If there is no checkpoint, no checkpoint is intact, or a file is unreadable. An unreadable file may be
    /// the newest checkpoint. A run that ignored this file could later replace it.
    pub fn open(
        comm: &dyn Communicator,
        folder: &Path,
        warn: &mut dyn FnMut(String),
    ) -> Result<(Self, PathBuf)> {
        // Only rank 0 reads the folder, because the view of the file system may be out of date on other
        // ranks.
        let slots = match comm.rank() {
            0 => newest_first(folder),
            _ => Ok(Vec::new()),
        };
        let mut packed = agree(comm, slots)?;
        comm.broadcast(0, &mut packed);
        let mut damaged = Vec::new();
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
            damaged.push(path.display().to_string());
        }
        Err(Error::input(match &damaged[..] {
            [] => format!(
                "there is no checkpoint in {}; start without {RESTART}",
                folder.display()
            ),
            [only] => format!(
                "{only} is damaged, and there is no other checkpoint; {REPLACE} starts the run again"
            ),
            both => format!(
                "both checkpoints are damaged, {}; {REPLACE} starts the run again",
                both.join(" and ")
            ),
        }))
    }
}

/// Return the indices (into [`NAMES`]) of the existing checkpoints, in the order in which to try the files.
fn newest_first(folder: &Path) -> Result<Vec<u8>> {
    let mut found: Vec<(Option<u64>, u8)> = Vec::new();
    for (slot, name) in (0..).zip(NAMES) {
        let path = folder.join(name);
        if is_taken(&path) {
            found.push((seal::number(&path)?, slot));
        }
    }
    // A file without a seal may have been the newest checkpoint. Try such a file first, so that a warning is
    // printed.
    found.sort_by_key(|(number, _)| (number.is_some(), std::cmp::Reverse(*number)));
    Ok(found.into_iter().map(|(_, slot)| slot).collect())
}

/// Read the header of a checkpoint. Collective.
///
/// # Errors
/// If the file cannot be read, or another version of Fissure wrote it.
pub fn read_header(comm: &dyn Communicator, path: &Path) -> Result<Header> {
    let mut file = CollectiveFile::open(path, comm)?;
    let words = file.integers_attribute("/", "numbers")?;
    let numbers = bytemuck::try_cast_slice::<i64, Numbers>(&words);
    let numbers = match numbers {
        Ok([numbers]) if numbers.version == VERSION => *numbers,
        _ => {
            return Err(Error::input(format!(
                "{} was written by another version of Fissure",
                path.display()
            )));
        }
    };
    let deck = file.text_attribute("/", "deck")?;
    let mut further = Vec::new();
    if numbers.further_results > 0 {
        let names = file.text_attribute("/", FURTHER[0])?;
        let counts = file.integers_attribute("/", FURTHER[1])?;
        let results = names.lines().zip(counts);
        further.extend(results.map(|(name, outputs)| FurtherResult {
            name: name.to_owned(),
            outputs: outputs as u64,
        }));
    }
    let names = file.text_attribute("/", SETS[0])?;
    let hashes = file.integers_attribute("/", SETS[1])?;
    let sets = names.lines().zip(hashes);
    let sets = sets.map(|(name, hash)| (name.to_owned(), hash as u64));
    let mut grids = [const { Vec::new() }; 2];
    let counts = [numbers.refined_nodes, numbers.removed_nodes];
    for ((keys, name), count) in grids.iter_mut().zip(GRIDS).zip(counts) {
        if count > 0 {
            let dataset = file.open_dataset(name)?;
            let rows: Vec<i64> = file.read_rows(&dataset, 0, count as usize)?;
            *keys = rows.as_chunks().0.to_vec();
        }
    }
    file.close()?;
    Ok(Header {
        number: numbers.number,
        step: numbers.step,
        grids,
        points: numbers.points,
        fingerprint: Fingerprint {
            points: numbers.fingerprint,
            sets: sets.collect(),
        },
        outputs: numbers.outputs,
        further,
        rows: numbers.rows,
        start: (numbers.energy_at_start, numbers.intact_at_start),
        energy_watch: numbers.energy_watch,
        deck,
    })
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
    let names = file.text_attribute("/", STATE)?;
    let (first, count) = (order.first(), order.count());
    let mut columns = Vec::new();
    for name in names.lines() {
        let dataset = file.open_dataset(&dataset_name(name))?;
        columns.push(SavedColumn {
            name: name.to_owned(),
            values: file.read_rows(&dataset, first, count)?,
        });
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

/// Return the path of the dataset that contains a column of the state.
fn dataset_name(column: &str) -> String {
    format!("/{column}")
}

fn write_file<const D: usize>(
    simulation: &Simulation<'_, D>,
    path: &Path,
    order: &IdOrder,
    header: &Header,
) -> Result<()> {
    let comm = simulation.comm;
    let mut file = CollectiveFile::create(path, comm, Creation::Truncate)?;
    let numbers = Numbers {
        version: VERSION,
        number: header.number,
        step: header.step,
        points: header.points,
        fingerprint: header.fingerprint.points,
        outputs: header.outputs,
        rows: header.rows,
        energy_at_start: header.start.0,
        intact_at_start: header.start.1,
        energy_watch: header.energy_watch,
        refined_nodes: header.grids[0].len() as u64,
        removed_nodes: header.grids[1].len() as u64,
        further_results: header.further.len() as u64,
    };
    let sets = &header.fingerprint.sets;
    let names: Vec<&str> = sets.iter().map(|(name, _)| &name[..]).collect();
    let hashes: Vec<i64> = sets.iter().map(|(_, hash)| *hash as i64).collect();
    file.set_attribute("/", SETS[0], Attribute::Text(&names.join("\n")))?;
    file.set_attribute("/", SETS[1], Attribute::Integers(&hashes))?;
    if !header.further.is_empty() {
        let names: Vec<&str> = (header.further.iter())
            .map(|result| &result.name[..])
            .collect();
        let counts: Vec<i64> = (header.further.iter())
            .map(|result| result.outputs as i64)
            .collect();
        file.set_attribute("/", FURTHER[0], Attribute::Text(&names.join("\n")))?;
        file.set_attribute("/", FURTHER[1], Attribute::Integers(&counts))?;
    }
    let words = bytemuck::cast_slice(std::slice::from_ref(&numbers));
    file.set_attribute("/", "numbers", Attribute::Integers(words))?;
    let progress: Vec<i64> = simulation
        .progress_words()
        .iter()
        .map(|word| *word as i64)
        .collect();
    file.set_attribute("/", "progress", Attribute::Integers(&progress))?;
    let names = simulation.saved_names().join("\n");
    file.set_attribute("/", STATE, Attribute::Text(&names))?;
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
    // Write column by column to limit the buffer memory.
    for column in simulation.saved_columns(order) {
        let dataset = file.create_dataset::<f64>(&dataset_name(&column.name), points, None)?;
        file.write_rows(&dataset, order.first(), &column.values)?;
    }
    let saved = simulation.saved_bonds(order);
    let (start, total) = crate::comm::scan(comm, saved.bytes.len() as u64);
    let lengths = file.create_dataset::<u32>("/bond_bytes", points, None)?;
    file.write_rows(&lengths, order.first(), &saved.lengths)?;
    let bonds = file.create_dataset::<u8>("/bonds", Rows::Fixed(total), None)?;
    file.write_rows(&bonds, start, &saved.bytes)?;
    file.close()
}
