//! Parser that converts Teuchos parameter lists (XML) to parameter trees.

use roxmltree::{Document, ParsingOptions};

use super::tree::{Content, DEEPEST, MOST_NODES, Mistake, Node};

/// Parse the parameter list of an XML text.
///
/// # Errors
/// - If the text is not XML.
/// - If an element is neither a parameter nor a list.
/// - If an element has no name, or a parameter has no value.
/// - If a list has the same name as another entry of its parent list.
/// - If lists are nested too deeply.
pub fn parse(text: &str) -> Result<Node, Mistake> {
    let options = ParsingOptions {
        nodes_limit: MOST_NODES as u32,
        ..ParsingOptions::default()
    };
    let document = Document::parse_with_options(text, options).map_err(|error| {
        let line = error.pos().row as usize;
        (line, format!("is no XML: {error}"))
    })?;
    let root = document.root_element();
    if root.tag_name().name() != "ParameterList" {
        let line = line_of(&document, root);
        let message = format!(
            "the root element must be ParameterList, is {}",
            root.tag_name().name()
        );
        return Err((line, message));
    }
    let mut nodes = 0;
    list(&document, root, &mut nodes, 0)
}

fn line_of(document: &Document, element: roxmltree::Node) -> usize {
    document.text_pos_at(element.range().start).row as usize
}

/// Build the table of a parameter list.
fn list(
    document: &Document,
    element: roxmltree::Node,
    nodes: &mut usize,
    depth: usize,
) -> Result<Node, Mistake> {
    let line = line_of(document, element);
    if depth > DEEPEST {
        return Err((line, "the parameters are too deep".to_owned()));
    }
    let id = *nodes;
    *nodes += 1;
    let mut entries: Vec<(String, Node)> = Vec::new();
    for child in element.children().filter(roxmltree::Node::is_element) {
        let line = line_of(document, child);
        let tag = child.tag_name().name();
        let name = child.attribute("name").map(str::trim);
        let name = name.ok_or_else(|| (line, format!("{tag} has no name")))?;
        if let Some(earlier) = entries.iter_mut().find(|(other, _)| other == name) {
            if tag != "Parameter" || earlier.1.text().is_none() {
                return Err((line, format!("the list `{name}` occurs twice")));
            }
            // The last value is used; the earlier value is renamed so that the log lists it as unused.
            earlier.0 = format!("{name} (set again in line {line})");
        }
        let node = match tag {
            "ParameterList" => list(document, child, nodes, depth + 1)?,
            "Parameter" => {
                let value = child.attribute("value");
                let value = value.ok_or_else(|| (line, format!("`{name}` has no value")))?;
                let id = *nodes;
                *nodes += 1;
                let content = Content::Text(value.to_owned());
                Node { id, line, content }
            }
            tag => {
                let message = format!("{tag} is neither Parameter nor ParameterList");
                return Err((line, message));
            }
        };
        entries.push((name.to_owned(), node));
    }
    let content = Content::Table(entries);
    Ok(Node { id, line, content })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_become_tables() {
        let text = "<ParameterList>\n<ParameterList name='A'>\n<!-- mm -->\n\
                    <Parameter name='B c' type='double' value='1.0'/>\n</ParameterList>\n</ParameterList>";
        let root = parse(text).unwrap();
        let b = root.get("A").and_then(|a| a.get("B C")).unwrap();
        assert_eq!((b.text(), b.line), (Some("1.0"), 4));
    }

    #[test]
    fn the_last_value_of_a_name_counts() {
        let text = "<ParameterList><Parameter name='a' value='1'/>\n<Parameter name='a' value='2'/></ParameterList>";
        let root = parse(text).unwrap();
        assert_eq!(root.get("a").and_then(Node::text), Some("2"));
        assert_eq!(root.entries()[0].0, "a (set again in line 2)");
    }

    #[test]
    fn mistakes_have_a_line() {
        for (text, line, message) in [
            ("<A/>", 1, "the root element must be ParameterList, is A"),
            (
                "<ParameterList>\n<B name='c'/></ParameterList>",
                2,
                "B is neither Parameter nor ParameterList",
            ),
            (
                "<ParameterList>\n<Parameter value='1'/></ParameterList>",
                2,
                "Parameter has no name",
            ),
            (
                "<ParameterList>\n\n<Parameter name='c'/></ParameterList>",
                3,
                "`c` has no value",
            ),
            (
                "<ParameterList><Parameter name='c' value='1'/>\n<ParameterList name='c'/></ParameterList>",
                2,
                "the list `c` occurs twice",
            ),
        ] {
            assert_eq!(parse(text), Err((line, message.to_owned())), "{text}");
        }
        let (line, message) = parse("<ParameterList>\n<a></b>\n</ParameterList>").unwrap_err();
        assert!(
            line == 2 && message.starts_with("is no XML: "),
            "{line}: {message}"
        );
    }
}
