//! The messages of decks, listed in `docs/messages.md` for reviews of the wording.

use std::fmt::Write;
use std::path::Path;

use fissure::deck::Source;

use super::decks::{decks, prepare};
use crate::support::command::{Folder, finish, fissure, text};

/// Path of the list of messages.
const LIST: &str = "docs/messages.md";

/// Return a message without the path of its file.
fn without_path(message: &str, path: &Path) -> String {
    let path = format!("{}:", path.display());
    message.replace(&path, "")
}

/// Return the first line of the error of each bad deck.
fn errors() -> impl Iterator<Item = (String, String)> {
    decks("tests/decks/bad").into_iter().map(|path| {
        let error = prepare(&Source::read(&path).unwrap()).unwrap_err();
        let line = error.message.lines().next().unwrap();
        (name(&path), without_path(line, &path))
    })
}

/// Return the warnings of runs of decks with probable mistakes.
fn warnings() -> impl Iterator<Item = (String, String)> {
    let folder = Folder::new("messages");
    decks("tests/decks/warned")
        .into_iter()
        .flat_map(move |path| {
            let mut command = fissure(1);
            command.arg("run").arg(&path).args(["--threads", "1"]);
            command.arg("--output").arg(folder.join(name(&path)));
            let output = finish(&mut command);
            let printed = text(&output);
            assert!(output.status.success(), "{}: {printed}", path.display());
            let lines = printed.lines();
            let warnings = lines.filter_map(|line| line.strip_prefix("warning: "));
            let found: Vec<_> = warnings
                .map(|warning| (name(&path), without_path(warning, &path)))
                .collect();
            assert!(!found.is_empty(), "{}: no warning", path.display());
            found
        })
}

fn name(path: &Path) -> String {
    path.file_stem().unwrap().to_string_lossy().into_owned()
}

#[test]
fn all_messages_are_listed() {
    let mut list = "# Messages\n\n\
        The messages for the decks in `tests/decks/bad` and `tests/decks/warned`, after line and column.\n\
        The test `deck::messages` compares this file with the messages that Fissure prints.\n\
        With `FISSURE_WRITE_MESSAGES=1`, the test writes this file.\n\
        Read the difference before you commit it.\n"
        .to_owned();
    let mut section = |title: &str, messages: &mut dyn Iterator<Item = (String, String)>| {
        write!(list, "\n## {title}\n\n").unwrap();
        for (deck, message) in messages {
            writeln!(list, "- `{deck}`: {message}").unwrap();
        }
    };
    section("Errors", &mut errors());
    section("Warnings", &mut warnings());
    if std::env::var_os("FISSURE_WRITE_MESSAGES").is_some() {
        std::fs::write(LIST, &list).unwrap();
    }
    let known = std::fs::read_to_string(LIST).unwrap_or_default();
    let differs = |(line, known): &(&str, &str)| line != known;
    let pair = list.lines().zip(known.lines()).find(differs);
    assert_eq!(
        pair, None,
        "{LIST} is stale: run this test with FISSURE_WRITE_MESSAGES=1"
    );
    assert_eq!(
        list.lines().count(),
        known.lines().count(),
        "{LIST} is stale"
    );
}
