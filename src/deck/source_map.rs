//! Source locations in a deck merged from several files.

use std::ops::Range;
use std::path::PathBuf;

use toml::de::{DeTable, DeValue};

/// The files of a merged deck, and the byte ranges of the merged text that come from each file.
#[derive(Debug)]
pub struct SourceMap {
    /// Path and text of each file: the deck, then its overlays.
    files: Vec<(PathBuf, String)>,
    ranges: Vec<MappedRange>,
}

/// A byte range of the merged text (`merged`) that comes from a file.
#[derive(Debug)]
struct MappedRange {
    merged: Range<usize>,
    /// Index of the file in `SourceMap::files`.
    file: usize,
    /// Byte range in this file.
    in_file: Range<usize>,
    /// Whether the byte ranges `merged` and `in_file` have equal content.
    is_equal: bool,
}

impl SourceMap {
    /// Locate the keys and values of the merged text `text` in `files`; later files take precedence.
    pub fn new(text: &str, files: Vec<(PathBuf, String)>) -> Self {
        let mut ranges = Vec::new();
        if let Ok(merged) = DeTable::parse(text) {
            for (file, (_, of_file)) in files.iter().enumerate() {
                if let Ok(table) = DeTable::parse(of_file) {
                    let mut search = Search {
                        texts: [text, of_file],
                        file,
                        ranges: &mut ranges,
                    };
                    search.tables(merged.get_ref(), table.get_ref());
                }
            }
        }
        Self { files, ranges }
    }

    /// Find the file from which the range `span` of the merged text comes. Return the path and the whole text
    /// of this file, and the byte range in this file. `length` is the length of the merged text, bytes.
    /// Return `None` for a range that comes from no file, such as a value of `--set`.
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
            |range: &&MappedRange| range.merged.start <= span.start && span.end <= range.merged.end;
        let ranges = self.ranges.iter().rev().filter(around);
        let MappedRange {
            merged,
            file,
            in_file,
            is_equal,
        } = ranges.min_by_key(|range| range.merged.len())?;
        let (path, text) = &self.files[*file];
        if merged == span {
            return Some((path, text, in_file.clone()));
        }
        let begin = in_file.start + (span.start - merged.start);
        is_equal.then(|| (path, &text[..], begin..begin + span.len()))
    }
}

/// Search for the ranges of the merged text that come from one file.
struct Search<'a> {
    /// The merged text and the text of the file.
    texts: [&'a str; 2],
    file: usize,
    ranges: &'a mut Vec<MappedRange>,
}

impl Search<'_> {
    fn add(&mut self, merged: Range<usize>, in_file: Range<usize>) {
        self.ranges.push(MappedRange {
            is_equal: self.is_equal(&merged, &in_file),
            merged,
            file: self.file,
            in_file,
        });
    }

    fn is_equal(&self, merged: &Range<usize>, in_file: &Range<usize>) -> bool {
        self.texts[0].get(merged.clone()) == self.texts[1].get(in_file.clone())
    }

    fn tables(&mut self, merged: &DeTable, of_file: &DeTable) {
        for (key, value) in merged {
            let Some((known, of_file)) = of_file.get_key_value(key.get_ref().as_ref()) else {
                continue;
            };
            self.add(key.span(), known.span());
            let spans = [value.span(), of_file.span()];
            self.values([value.get_ref(), of_file.get_ref()], spans);
        }
    }

    fn values(&mut self, [merged, of_file]: [&DeValue; 2], [span, in_file]: [Range<usize>; 2]) {
        match (merged, of_file) {
            (DeValue::Table(merged), DeValue::Table(of_file)) => {
                self.add(span, in_file);
                self.tables(merged, of_file);
            }
            (DeValue::Array(merged), DeValue::Array(of_file)) if merged.len() == of_file.len() => {
                if self.is_equal(&span, &in_file) {
                    self.add(span, in_file);
                }
                for (merged, of_file) in merged.iter().zip(of_file.iter()) {
                    let spans = [merged.span(), of_file.span()];
                    self.values([merged.get_ref(), of_file.get_ref()], spans);
                }
            }
            _ if self.is_equal(&span, &in_file) => self.add(span, in_file),
            _ => {}
        }
    }
}
