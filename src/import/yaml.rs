//! Parser that converts YAML to parameter trees.

use saphyr_parser::{Event, Parser, StrInput};

use super::tree::{Content, DEEPEST, MOST_NODES, Mistake, Node};

/// Parse a YAML text of one document.
///
/// # Errors
/// If the text is empty, not YAML, too long or too deep, or a key occurs twice in a table. Aliases such as
/// `*name`, keys that are not text, and a second document are also rejected.
pub fn parse(text: &str) -> Result<Node, Mistake> {
    let mut builder = Builder {
        parser: Parser::new_from_str(text),
        nodes: 0,
    };
    let mut root = None;
    loop {
        let (event, line) = builder.next()?;
        match event {
            Event::StreamEnd => break,
            Event::StreamStart | Event::DocumentStart(_) | Event::DocumentEnd | Event::Nothing => {}
            _ if root.is_some() => return Err((line, "a second document starts here".to_owned())),
            event => root = Some(builder.node(event, line, 0)?),
        }
    }
    root.ok_or((1, "the file is empty".to_owned()))
}

struct Builder<'a> {
    parser: Parser<'a, StrInput<'a>>,
    nodes: usize,
}

impl<'a> Builder<'a> {
    /// Return the next event and its line.
    fn next(&mut self) -> Result<(Event<'a>, usize), Mistake> {
        match self.parser.next() {
            None => Ok((Event::StreamEnd, 1)),
            Some(Ok((event, span))) => Ok((event, span.start.line())),
            Some(Err(error)) => {
                let message = format!("is no YAML: {}", error.info());
                Err((error.marker().line(), message))
            }
        }
    }

    /// Build the node that an event starts.
    fn node(&mut self, event: Event<'a>, line: usize, depth: usize) -> Result<Node, Mistake> {
        let id = self.nodes;
        self.nodes += 1;
        if self.nodes > MOST_NODES || depth > DEEPEST {
            return Err((line, "the parameters are too many or too deep".to_owned()));
        }
        let content = match event {
            Event::Scalar(text, ..) => Content::Text(text.into_owned()),
            Event::SequenceStart(..) => {
                let mut nodes = Vec::new();
                loop {
                    match self.next()? {
                        (Event::SequenceEnd, _) => break Content::List(nodes),
                        (event, line) => nodes.push(self.node(event, line, depth + 1)?),
                    }
                }
            }
            Event::MappingStart(..) => {
                let mut entries: Vec<(String, Node)> = Vec::new();
                loop {
                    let (key, key_line) = match self.next()? {
                        (Event::MappingEnd, _) => break Content::Table(entries),
                        (Event::Scalar(key, ..), line) => (key.trim().to_owned(), line),
                        (_, line) => return Err((line, "a key must be a text".to_owned())),
                    };
                    if entries.iter().any(|(name, _)| *name == key) {
                        return Err((key_line, format!("the key `{key}` occurs twice")));
                    }
                    let (event, _) = self.next()?;
                    let node = self.node(event, key_line, depth + 1)?;
                    entries.push((key, node));
                }
            }
            Event::Alias(_) => {
                let message = "references (`*name`) are not read; write the value in full";
                return Err((line, message.to_owned()));
            }
            _ => return Err((line, "the file ends within a value".to_owned())),
        };
        Ok(Node { id, line, content })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_the_line_of_their_key() {
        let root = parse("A:\n  B: 1.0\n  C d:\n    E: \"x*t\"\n  F: [1, 2]\n").unwrap();
        let a = root.get("A").unwrap();
        assert_eq!(a.get("b").and_then(Node::text), Some("1.0"));
        let e = a.get("C_D").and_then(|c| c.get("E")).unwrap();
        assert_eq!((e.text(), e.line), (Some("x*t"), 4));
        let Content::List(list) = &a.get("F").unwrap().content else {
            panic!("F is a list");
        };
        assert_eq!(list.len(), 2);
    }

    #[test]
    fn mistakes_have_a_line() {
        for (text, line, message) in [
            ("A: 1\nA: 2\n", 2, "the key `A` occurs twice"),
            (
                "A: &x 1\nB: *x\n",
                2,
                "references (`*name`) are not read; write the value in full",
            ),
            ("A: 1\n---\nB: 2\n", 3, "a second document starts here"),
            ("? [1]\n: 2\n", 1, "a key must be a text"),
            ("", 1, "the file is empty"),
        ] {
            assert_eq!(parse(text), Err((line, message.to_owned())), "{text}");
        }
        let (line, message) = parse("A: 1\nB: [1\n").unwrap_err();
        assert!(
            line >= 2 && message.starts_with("is no YAML: "),
            "{line}: {message}"
        );
        let deep = format!("{}1{}", "[".repeat(100), "]".repeat(100));
        assert_eq!(
            parse(&deep).unwrap_err().1,
            "the parameters are too many or too deep"
        );
    }
}
