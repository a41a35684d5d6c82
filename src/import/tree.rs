//! Parameter trees, the common form of YAML decks and XML parameter lists.

/// Maximum number of nodes of a tree; limits the memory that a deck can take.
pub const MOST_NODES: usize = 1 << 20;

/// Maximum depth of a tree.
pub const DEEPEST: usize = 64;

/// A mistake in a deck: its line, from 1, and the message.
pub type Mistake = (usize, String);

/// A value of a deck with its line.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Number of the node in its tree, in the order of the text.
    pub id: usize,
    /// Line, from 1.
    pub line: usize,
    /// Content of the node.
    pub content: Content,
}

/// Content of a node.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// A number, a word or a text.
    Text(String),
    /// Values in order.
    List(Vec<Node>),
    /// Values by name, in their order in the deck.
    Table(Vec<(String, Node)>),
}

impl Node {
    /// Return the value of a key in a table. The names in the table are compared with the key by [`is_key`].
    pub fn get(&self, key: &str) -> Option<&Self> {
        let (_, node) = self.entries().iter().find(|(name, _)| is_key(name, key))?;
        Some(node)
    }

    /// Return the names and values of a table; empty for other nodes.
    pub fn entries(&self) -> &[(String, Self)] {
        match &self.content {
            Content::Table(entries) => entries,
            _ => &[],
        }
    }

    /// Return the names and values of the entries whose values are tables.
    pub fn tables(&self) -> impl Iterator<Item = (&str, &Self)> {
        let entries = self.entries().iter();
        entries
            .filter(|(_, node)| matches!(node.content, Content::Table(_)))
            .map(|(name, node)| (name.as_str(), node))
    }

    /// Return the text of a value that is neither list nor table.
    pub fn text(&self) -> Option<&str> {
        match &self.content {
            Content::Text(text) => Some(text.trim()),
            _ => None,
        }
    }
}

/// Test whether a name equals a key. Case is ignored, and any sequence of `_` and spaces equals one space.
pub fn is_key(name: &str, key: &str) -> bool {
    let plain = |text: &str| {
        let words = text.split([' ', '_']).filter(|word| !word.is_empty());
        words.collect::<Vec<_>>().join(" ").to_lowercase()
    };
    plain(name) == plain(key)
}
