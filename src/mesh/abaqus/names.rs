//! Keyword lines, and the names of keywords and element types.

use super::super::kind::{Form, Kind};

/// Keywords that generate or move nodes or elements, and `SUBMODEL`, which refers to the mesh of another
/// model.
pub(super) const GENERATORS: [&str; 8] = [
    "NGEN", "NFILL", "NMAP", "NCOPY", "ELGEN", "ELCOPY", "SYSTEM", "SUBMODEL",
];

/// Return the element type with a name such as `C3D8R`; `None` for an unsupported type.
pub(super) fn kind(name: &str) -> Option<Kind> {
    const SOLIDS: [&str; 6] = ["C3D", "AC3D", "DC3D", "DCC3D", "Q3D", "SC"];
    const FACES: [&str; 12] = [
        "CPEG", "CPS", "CPE", "DC2D", "AC2D", "SFM3D", "M3D", "R3D", "STRI", "DS", "S", "F3D",
    ];
    const LINES: [&str; 5] = ["T2D", "T3D", "R2D", "DC1D", "AC1D"];
    // A name is a family, the number of nodes, and a suffix of letters and digits.
    let nodes = |families: &[&str]| {
        families.iter().find_map(|family| {
            let rest = name.strip_prefix(family)?;
            let end = rest
                .find(|c: char| !c.is_ascii_digit())
                .unwrap_or(rest.len());
            let is_suffix = rest[end..].chars().all(|c| c.is_ascii_alphanumeric());
            rest[..end].parse::<usize>().ok().filter(|_| is_suffix)
        })
    };
    let of = |form, nodes| Some(Kind::new(form, nodes));
    match name {
        "MASS" | "ROTARYI" => return of(Form::Point, 1),
        "B21" | "B21H" | "B23" | "B23H" | "B31" | "B31H" | "B31OS" | "B33" | "B33H" => {
            return of(Form::Line, 2);
        }
        "B22" | "B22H" | "B32" | "B32H" | "B32OS" => return of(Form::Line, 3),
        _ => {}
    }
    if let Some(count) = nodes(&SOLIDS) {
        return match count {
            4 | 10 => of(Form::Tetrahedron, count),
            5 => of(Form::Pyramid, count),
            6 | 15 => of(Form::Wedge, count),
            8 | 20 => of(Form::Hexahedron, count),
            _ => None,
        };
    }
    if let Some(count) = nodes(&FACES) {
        // `STRI65` has 6 nodes with 5 degrees of freedom per node.
        return match count {
            3 | 6 => of(Form::Triangle, count),
            65 => of(Form::Triangle, 6),
            4 | 8 | 9 => of(Form::Quadrilateral, count),
            _ => None,
        };
    }
    match nodes(&LINES) {
        Some(count @ (2 | 3)) => of(Form::Line, count),
        _ => None,
    }
}

/// A keyword line.
pub(super) struct Keyword {
    pub(super) name: String,
    parameters: Vec<(String, String)>,
}

impl Keyword {
    pub(super) fn new(line: &str) -> Self {
        let mut entries = line.split(',').map(str::trim);
        let name = entries.next().unwrap_or_default();
        // A name such as `*End  Part` may contain several blanks.
        let name: Vec<&str> = name.split_whitespace().collect();
        let parameter = |entry: &str| {
            let (key, value) = entry.split_once('=').unwrap_or((entry, ""));
            let value = value.trim().trim_matches('"');
            (key.trim().to_ascii_uppercase(), value.to_owned())
        };
        Self {
            name: name.join(" ").to_ascii_uppercase(),
            parameters: entries.map(parameter).collect(),
        }
    }

    pub(super) fn get(&self, key: &str) -> Option<&str> {
        let found = self.parameters.iter().find(|(name, _)| name == key);
        found.map(|(_, value)| value.as_str())
    }
}
