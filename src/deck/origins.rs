//! Source locations in a deck merged from several files.

use std::ops::Range;
use std::path::PathBuf;

use toml::de::{DeTable, DeValue};

/// The files of a merged deck, and the byte ranges of the merged text that come from each file.
#[derive(Debug)]
pub struct Origins {
    /// Paths and texts: the deck and its overlays.
    files: Vec<(PathBuf, String)>,
    pieces: Vec<Piece>,
}

/// A byte range of the merged text (`changed`) that comes from a file.
#[derive(Debug)]
struct Piece {
    changed: Range<usize>,
    /// Index of the file.
    file: usize,
    /// Byte range in this file.
    place: Range<usize>,
    /// Whether both byte ranges have equal content.
    is_equal: bool,
}

impl Origins {
    /// Locate the keys and values of the merged text `text` in `files`; later files take precedence.
    pub fn new(text: &str, files: Vec<(PathBuf, String)>) -> Self {
        let mut pieces = Vec::new();
        if let Ok(changed) = DeTable::parse(text) {
            for (file, (_, of_file)) in files.iter().enumerate() {
                if let Ok(table) = DeTable::parse(of_file) {
                    let mut search = Search {
                        texts: [text, of_file],
                        file,
                        pieces: &mut pieces,
                    };
                    search.tables(changed.get_ref(), table.get_ref());
                }
            }
        }
        Self { files, pieces }
    }

    /// Return the source of the range `span` of the merged text: the path and the text of a file, and a byte
    /// range in this file. `length` is the length of the merged text, bytes. Return `None` for a range that
    /// comes from no file, such as a value of `--set`.
    pub fn find(
        &self,
        span: &Range<usize>,
        length: usize,
    ) -> Option<(&PathBuf, &str, Range<usize>)> {
        let (path, deck) = &self.files[0];
        // Errors about missing sections point at the start or the end of the deck.
        if span.end == 0 {
            return Some((path, deck, 0..0));
        }
        if span.start >= length {
            return Some((path, deck, deck.len()..deck.len()));
        }
        let around =
            |piece: &&Piece| piece.changed.start <= span.start && span.end <= piece.changed.end;
        let pieces = self.pieces.iter().rev().filter(around);
        let Piece {
            changed,
            file,
            place,
            is_equal,
        } = pieces.min_by_key(|piece| piece.changed.len())?;
        let (path, text) = &self.files[*file];
        if changed == span {
            return Some((path, text, place.clone()));
        }
        let begin = place.start + (span.start - changed.start);
        is_equal.then(|| (path, &text[..], begin..begin + span.len()))
    }
}

/// Search for the ranges of the merged text that come from one file.
struct Search<'a> {
    /// The merged text and the text of the file.
    texts: [&'a str; 2],
    file: usize,
    pieces: &'a mut Vec<Piece>,
}

impl Search<'_> {
    fn add(&mut self, changed: Range<usize>, place: Range<usize>) {
        self.pieces.push(Piece {
            is_equal: self.is_equal(&changed, &place),
            changed,
            file: self.file,
            place,
        });
    }

    fn is_equal(&self, changed: &Range<usize>, place: &Range<usize>) -> bool {
        self.texts[0].get(changed.clone()) == self.texts[1].get(place.clone())
    }

    fn tables(&mut self, changed: &DeTable, of_file: &DeTable) {
        for (key, value) in changed {
            let Some((known, of_file)) = of_file.get_key_value(key.get_ref().as_ref()) else {
                continue;
            };
            self.add(key.span(), known.span());
            let spans = [value.span(), of_file.span()];
            self.values([value.get_ref(), of_file.get_ref()], spans);
        }
    }

    fn values(&mut self, [changed, of_file]: [&DeValue; 2], [span, place]: [Range<usize>; 2]) {
        match (changed, of_file) {
            (DeValue::Table(changed), DeValue::Table(of_file)) => {
                self.add(span, place);
                self.tables(changed, of_file);
            }
            (DeValue::Array(changed), DeValue::Array(of_file))
                if changed.len() == of_file.len() =>
            {
                if self.is_equal(&span, &place) {
                    self.add(span, place);
                }
                for (changed, of_file) in changed.iter().zip(of_file.iter()) {
                    let spans = [changed.span(), of_file.span()];
                    self.values([changed.get_ref(), of_file.get_ref()], spans);
                }
            }
            _ if self.is_equal(&span, &place) => self.add(span, place),
            _ => {}
        }
    }
}
