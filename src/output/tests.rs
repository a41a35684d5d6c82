//! Tests: reading a result returns what was written.

use super::access::Creation;
use super::attribute::Attribute;
use super::collective::CollectiveFile;
use super::field::{FieldData, FieldDescription, Number};
use super::history::HistoryContents;
use super::read::ResultReader;
use super::vtkhdf::{Contents, Piece, ResultFile, STEPS};
use crate::comm::threads;
use crate::error::Result;
use std::path::Path;

fn describe(name: &'static str, unit: &'static str, components: usize) -> FieldDescription {
    FieldDescription {
        name,
        unit,
        components,
        number: Number::F64,
    }
}

#[test]
fn what_is_written_reads_back() -> Result<()> {
    let path = std::env::temp_dir().join(format!("fissure-result-{}.h5", std::process::id()));
    let positions = [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]];
    let comm = threads::alone();
    let piece = Piece { first: 0, total: 2 };
    let number = Number::U64;
    let id = FieldDescription {
        number,
        ..describe("id", "", 1)
    };
    let fixed = [(id, FieldData::U64(&[7, 3]))];
    let moving = [describe("velocity", "m/s", 2), describe("damage", "", 1)];
    let metadata = [("deck", "ω = 1".to_owned())];
    let contents = Contents {
        piece,
        changing: false,
        positions: &positions,
        fixed: &fixed,
        moving: &moving,
        metadata: &metadata,
        steps: 2,
    };
    let create = || ResultFile::create(&path, &comm, Creation::Exclusive, &contents);
    let mut file = create()?;
    let columns = [("time".into(), "s"), ("a".into(), "")];
    let csv = path.with_extension("csv");
    let history = HistoryContents {
        columns: &columns,
        csv: &csv,
        rows: 2,
    };
    file.create_history(&history)?;
    for step in [0, 1] {
        file.append_history(&[vec![step as f64, 4.5]])?;
        let velocity = [1.0, 2.0, 3.0, 4.0].map(|value| value + 10.0 * step as f64);
        let damage = [step as f64, 9.0];
        let fields = [velocity.to_vec(), damage.to_vec()];
        file.write_step(0.5 * step as f64, 100 * step, |k| fields[k].clone())?;
    }
    let error = file.write_step(1.0, 2, |_| vec![0.0]);
    assert!(error.unwrap_err().message.contains("velocity has 1 values"));
    file.close(false)?;

    let error = create().err().unwrap();
    assert!(
        error.message.contains("exists already"),
        "{}",
        error.message
    );

    let reader = ResultReader::open(&path)?;
    assert_eq!(reader.times()?, [0.0, 0.5]);
    assert_eq!(reader.steps()?, [0, 100]);
    assert_eq!(reader.positions(0)?, positions);
    assert_eq!(reader.ids(0)?, [7, 3]);
    assert_eq!(
        reader.field("velocity", 1)?,
        [11.0, 12.0, 0.0, 13.0, 14.0, 0.0]
    );
    assert_eq!(reader.field("damage", 1)?, [1.0, 9.0]);
    assert_eq!(reader.field("id", 1)?, [7.0, 3.0]);
    assert!(
        reader
            .field("stress", 0)
            .unwrap_err()
            .message
            .contains("damage, id, velocity")
    );
    assert_eq!(
        reader.attributes()?,
        [("deck".to_owned(), "ω = 1".to_owned())]
    );
    let velocity = &reader.fields()?[2];
    assert_eq!((velocity.unit.as_str(), velocity.components), ("m/s", 3));
    let history = reader.history()?;
    assert_eq!(history[0].name, "time");
    assert_eq!(history[1].values, [4.5, 4.5]);
    let csv = std::fs::read_to_string(path.with_extension("csv")).unwrap();
    assert_eq!(csv, "time [s],a\n0,4.5\n1,4.5\n");
    drop(reader);
    // After a loss of power, NSteps can exceed the number of stored steps.
    let mut file = CollectiveFile::open_to_append(&path, &comm)?;
    file.set_attribute(STEPS, "NSteps", Attribute::Integer(3))?;
    file.close()?;
    assert_eq!(ResultReader::open(&path)?.times()?, [0.0, 0.5]);
    for name in ["h5", "csv"] {
        std::fs::remove_file(path.with_extension(name)).unwrap();
    }
    Ok(())
}

#[test]
fn what_is_no_result_is_named_so() {
    let path = std::env::temp_dir().join(format!("fissure-no-result-{}", std::process::id()));
    let comm = threads::alone();
    let message = |path: &Path| ResultReader::open(path).unwrap_err().message;
    assert!(message(&path).contains("cannot open"));
    std::fs::write(&path, "no HDF5").unwrap();
    assert!(message(&path).contains("not a readable HDF5 file"));
    let empty = CollectiveFile::create(&path, &comm, Creation::Truncate).unwrap();
    empty.close().unwrap();
    assert!(message(&path).contains("no group /VTKHDF"));
    std::fs::remove_file(&path).unwrap();
}

#[test]
fn a_replaced_file_stays_readable_where_it_is_open() -> Result<()> {
    use std::io::Read as _;

    let path = std::env::temp_dir().join(format!("fissure-replaced-{}", std::process::id()));
    std::fs::write(&path, "an old result").unwrap();
    let mut open = std::fs::File::open(&path).unwrap();
    let link = path.with_extension("link");
    std::os::unix::fs::symlink(&path, &link).unwrap();
    CollectiveFile::create(&link, &threads::alone(), Creation::Truncate)?.close()?;
    assert!(link.is_symlink());
    std::fs::remove_file(&link).unwrap();
    let mut text = String::new();
    open.read_to_string(&mut text).unwrap();
    assert_eq!(text, "an old result");
    assert!(hdf5_metno::File::open(&path).is_ok());
    std::fs::remove_file(&path).unwrap();
    Ok(())
}

/// Create a result with the deck text `one` and with allocated space for two steps. Write these two steps.
/// Resume the result after its first step, with the deck text `deck`. Write three more steps. Return true if
/// the file was continued in place, and false if a copy replaced it.
fn is_continued_in_place(name: &str, deck: &str) -> Result<bool> {
    use std::os::unix::fs::MetadataExt as _;

    let path = std::env::temp_dir().join(format!("fissure-{name}-{}.h5", std::process::id()));
    let comm = threads::alone();
    let positions = [[0.0; 3], [1.0, 0.0, 0.0]];
    let moving = [describe("damage", "", 1)];
    let metadata = |deck: &str, ranks: &str| [("deck", deck.into()), ("ranks", ranks.into())];
    let contents = |metadata| Contents {
        piece: Piece { first: 0, total: 2 },
        changing: false,
        positions: &positions,
        fixed: &[],
        moving: &moving,
        metadata,
        steps: 2,
    };
    let (columns, csv) = ([("time".into(), "s")], path.with_extension("csv"));
    let history = HistoryContents {
        columns: &columns,
        csv: &csv,
        rows: 2,
    };
    let write = |file: &mut ResultFile<'_>, step: u64| {
        file.append_history(&[vec![step as f64]])?;
        file.write_step(step as f64, step, |_| vec![step as f64, 10.0 + step as f64])
    };
    let first = metadata("one", "4");
    let mut file = ResultFile::create(&path, &comm, Creation::Exclusive, &contents(&first))?;
    file.create_history(&history)?;
    write(&mut file, 0)?;
    write(&mut file, 7)?;
    file.close(true)?;
    let inode = || std::fs::metadata(&path).unwrap().ino();
    let before = inode();
    let second = metadata(deck, "12");
    let (mut file, past) =
        ResultFile::resume(&path, &comm, &contents(&second), Some((&history, 1)), 1)?;
    assert_eq!(past, [[0.0]]);
    assert_eq!(file.past(), [(0.0, 2)]);
    for step in 1..4 {
        write(&mut file, step)?;
    }
    file.close(false)?;
    let reader = ResultReader::open(&path)?;
    assert_eq!(reader.steps()?, [0, 1, 2, 3]);
    assert_eq!(reader.times()?, [0.0, 1.0, 2.0, 3.0]);
    for step in 0..4 {
        let found = reader.field("damage", step)?;
        assert_eq!(found, [step as f64, 10.0 + step as f64]);
    }
    assert_eq!(reader.history()?[0].values, [0.0, 1.0, 2.0, 3.0]);
    drop(reader);
    let text = std::fs::read_to_string(&csv).unwrap();
    assert_eq!(text, "time [s]\n0\n1\n2\n3\n");
    let mut file = CollectiveFile::open(&path, &comm)?;
    assert_eq!(file.text_attribute("/", "ranks")?, "12");
    assert_eq!(file.open_dataset("/VTKHDF/PointData/damage")?.rows(), 8);
    file.close()?;
    let stayed = inode() == before;
    std::fs::remove_file(&path).unwrap();
    std::fs::remove_file(&csv).unwrap();
    Ok(stayed)
}

#[test]
fn a_result_that_outgrows_its_room_in_place() -> Result<()> {
    assert!(is_continued_in_place("grown", "one")?);
    Ok(())
}

#[test]
fn a_result_of_another_deck_is_copied() -> Result<()> {
    assert!(!is_continued_in_place("copied", "another")?);
    Ok(())
}
