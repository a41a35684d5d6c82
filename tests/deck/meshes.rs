//! Meshes of other programs: all element types, encodings and sets; damaged files; a run on several ranks.

use std::path::Path;

use fissure::comm::threads;
use fissure::deck;
use fissure::mesh::{self, Format, GroupKey, Members, Mesh};
use fissure::points::generate;
use fissure::problem::Problem;

use crate::support::command::Folder;
use crate::support::problem;
use crate::support::recorded::record;

fn parse(name: &str, bytes: impl AsRef<[u8]>) -> Result<Mesh, String> {
    let path = Path::new(name);
    let format = Format::of(path).unwrap();
    mesh::parse(format, path, bytes.as_ref()).map_err(|error| error.message)
}

/// Return positions, volumes and blocks of the points of a problem.
fn points(problem: &Problem) -> Vec<([f64; 3], f64, u32)> {
    let comm = threads::alone();
    let (points, _) = generate(problem, &comm).unwrap_or_else(|error| panic!("{error}"));
    points
        .iter()
        .map(|point| (point.position, point.volume, point.block))
        .collect()
}

/// Assert that points lie at these centres, up to rounding, and have the volume 1.
fn assert_unit_cubes(found: &[([f64; 3], f64, u32)], centres: &[[f64; 3]]) {
    assert_eq!(found.len(), centres.len());
    for ((position, volume, _), centre) in found.iter().zip(centres) {
        let distance = (0..3)
            .map(|k| (position[k] - centre[k]).abs())
            .fold(0.0, f64::max);
        assert!(distance < 1e-14, "{position:?} {centre:?}");
        assert!((volume - 1.0).abs() < 1e-14, "{volume}");
    }
}

/// Return the problem of a solid from a mesh, with sets from these groups.
fn solid(mesh: &Path, sets: &[&str]) -> Problem {
    let sets: String = sets
        .iter()
        .map(|set| format!("[set.\"{set}\"]\nmesh = \"{set}\"\n"))
        .collect();
    problem(&format!(
        "dimension = '3d'\ngrid.horizon = 1\nmaterial.a.pmb = {{ density = 1, youngs_modulus = 1 }}\n\
         time.end = 1\n{sets}[body.a]\nmaterial = 'a'\npoints.mesh = '{}'\n",
        mesh.display()
    ))
}

/// Return the ids from 0 to 99 that belong to a set.
fn ids(problem: &Problem, set: &str) -> Vec<u64> {
    let set = problem.sets.iter().find(|own| own.name == set).unwrap();
    let is_member = |id: &u64| fissure::points::set::contains(set, 1.0, *id, [0.0; 3], 0);
    (0..100).filter(is_member).collect()
}

/// A mesh to write. An element has a Gmsh type, a physical tag, the tag of its entity, and nodes counted from
/// 1.
#[derive(Clone, Default)]
struct Written {
    nodes: Vec<[f64; 3]>,
    elements: Vec<(i32, i32, i32, Vec<usize>)>,
    names: Vec<(i32, i32, &'static str)>,
}

fn dimension(kind: i32) -> i32 {
    match kind {
        15 => 0,
        1 | 8 => 1,
        2 | 3 | 9 | 10 | 16 => 2,
        _ => 3,
    }
}

/// Writer of numbers as text or as bytes.
struct Numbers {
    bytes: Vec<u8>,
    /// Byte order; `None` for text.
    is_big: Option<bool>,
}

impl Numbers {
    fn line(&mut self, line: &str) {
        self.bytes.extend_from_slice(line.as_bytes());
        self.bytes.push(b'\n');
    }

    fn int(&mut self, number: usize) {
        match self.is_big {
            None => self
                .bytes
                .extend_from_slice(format!("{number} ").as_bytes()),
            Some(true) => self.bytes.extend_from_slice(&(number as i32).to_be_bytes()),
            Some(false) => self.bytes.extend_from_slice(&(number as i32).to_le_bytes()),
        }
    }

    fn size(&mut self, number: usize) {
        match self.is_big {
            None => self.int(number),
            Some(true) => self.bytes.extend_from_slice(&(number as u64).to_be_bytes()),
            Some(false) => self.bytes.extend_from_slice(&(number as u64).to_le_bytes()),
        }
    }

    fn real(&mut self, number: f64) {
        match self.is_big {
            None => self
                .bytes
                .extend_from_slice(format!("{number:e} ").as_bytes()),
            Some(true) => self.bytes.extend_from_slice(&number.to_be_bytes()),
            Some(false) => self.bytes.extend_from_slice(&number.to_le_bytes()),
        }
    }

    fn end_of_line(&mut self) {
        if self.is_big.is_none() {
            self.bytes.push(b'\n');
        }
    }
}

impl Written {
    fn add_nodes(&mut self, nodes: &[[f64; 3]]) -> usize {
        self.nodes.extend_from_slice(nodes);
        self.nodes.len() - nodes.len() + 1
    }

    fn head(&self, version: &str, is_big: Option<bool>) -> Numbers {
        let mut out = Numbers {
            bytes: Vec::new(),
            is_big,
        };
        out.line("$MeshFormat");
        out.line(&format!("{version} {} 8", u8::from(is_big.is_some())));
        if is_big.is_some() {
            out.int(1);
            out.line("");
        }
        out.line("$EndMeshFormat");
        if !self.names.is_empty() {
            out.line("$PhysicalNames");
            out.line(&self.names.len().to_string());
            for (dimension, tag, name) in &self.names {
                out.line(&format!("{dimension} {tag} \"{name}\""));
            }
            out.line("$EndPhysicalNames");
        }
        out
    }

    fn version_2(&self, is_big: Option<bool>) -> Vec<u8> {
        let mut out = self.head("2.2", is_big);
        out.line("$Nodes");
        out.line(&self.nodes.len().to_string());
        for (node, tag) in self.nodes.iter().zip(1..) {
            out.int(tag);
            node.iter().for_each(|x| out.real(*x));
            out.end_of_line();
        }
        out.line("\n$EndNodes\n$Elements");
        out.line(&self.elements.len().to_string());
        for ((kind, physical, entity, nodes), number) in self.elements.iter().zip(1..) {
            if is_big.is_some() {
                [*kind as usize, 1, 2]
                    .into_iter()
                    .for_each(|number| out.int(number));
                out.int(number);
            } else {
                [number, *kind as usize, 2]
                    .into_iter()
                    .for_each(|number| out.int(number));
            }
            [*physical, *entity]
                .into_iter()
                .for_each(|tag| out.int(tag as usize));
            nodes.iter().for_each(|node| out.int(*node));
            out.end_of_line();
        }
        out.line("\n$EndElements");
        out.bytes
    }

    fn version_4(&self, is_big: Option<bool>) -> Vec<u8> {
        let mut out = self.head("4.1", is_big);
        let mut entities: Vec<(i32, i32, i32)> = self
            .elements
            .iter()
            .map(|(kind, physical, entity, _)| (dimension(*kind), *entity, *physical))
            .collect();
        entities.sort_unstable();
        entities.dedup();
        out.line("$Entities");
        for dimension in 0..4 {
            out.size(
                entities
                    .iter()
                    .filter(|entity| entity.0 == dimension)
                    .count(),
            );
        }
        for (dimension, tag, physical) in &entities {
            out.int(*tag as usize);
            for _ in 0..if *dimension == 0 { 3 } else { 6 } {
                out.real(0.0);
            }
            out.size(usize::from(*physical != 0));
            if *physical != 0 {
                out.int(*physical as usize);
            }
            if *dimension > 0 {
                out.size(1);
                out.int(9);
            }
        }
        out.line("\n$EndEntities\n$Nodes");
        let count = self.nodes.len();
        // Write the nodes in two blocks, the first with parametric coordinates.
        [2, count, 1, count]
            .into_iter()
            .for_each(|size| out.size(size));
        for (tags, is_parametric) in [(1..2, true), (2..count + 1, false)] {
            [2, 1, usize::from(is_parametric)]
                .into_iter()
                .for_each(|number| out.int(number));
            out.size(tags.len());
            tags.clone().for_each(|tag| out.size(tag));
            for tag in tags {
                self.nodes[tag - 1].iter().for_each(|x| out.real(*x));
                if is_parametric {
                    [0.25, 0.5].into_iter().for_each(|x| out.real(x));
                }
                out.end_of_line();
            }
        }
        out.line("\n$EndNodes\n$Elements");
        let count = self.elements.len();
        [count, count, 1, count]
            .into_iter()
            .for_each(|size| out.size(size));
        for ((kind, _, entity, nodes), number) in self.elements.iter().zip(1..) {
            [dimension(*kind), *entity, *kind]
                .into_iter()
                .for_each(|tag| out.int(tag as usize));
            [1, number].into_iter().for_each(|size| out.size(size));
            nodes.iter().for_each(|node| out.size(*node));
            out.end_of_line();
        }
        out.line("\n$EndElements");
        out.line("$Periodic\n0\n$EndPeriodic");
        out.bytes
    }

    /// Return the file in both versions, as text and in both byte orders.
    fn all(&self) -> Vec<(&'static str, Vec<u8>)> {
        vec![
            ("2.2", self.version_2(None)),
            ("2.2 little", self.version_2(Some(false))),
            ("2.2 big", self.version_2(Some(true))),
            ("4.1", self.version_4(None)),
            ("4.1 little", self.version_4(Some(false))),
            ("4.1 big", self.version_4(Some(true))),
        ]
    }
}

/// Corners of the cube [0, 1]³ in the order of a hexahedron.
const CUBE: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [1.0, 1.0, 1.0],
    [0.0, 1.0, 1.0],
];

/// Return the cube divided into hexahedra, tetrahedra, wedges or pyramids. In each mesh another corner is
/// moved inwards, so that elements of one type differ.
fn cubes() -> Vec<(&'static str, Written)> {
    let elements = |kind: i32, all: &[&[usize]]| {
        let element = |nodes: &&[usize]| (kind, 1, 1, nodes.to_vec());
        Written {
            nodes: [&CUBE[..], &[[0.4, 0.6, 0.3]]].concat(),
            elements: all.iter().map(element).collect(),
            names: Vec::new(),
        }
    };
    vec![
        ("hexahedron", elements(5, &[&[1, 2, 3, 4, 5, 6, 7, 8]])),
        (
            "tetrahedra",
            elements(
                4,
                &[
                    &[1, 2, 3, 7],
                    &[1, 3, 4, 7],
                    &[1, 4, 8, 7],
                    &[1, 8, 5, 7],
                    &[1, 5, 6, 7],
                    &[1, 6, 2, 7],
                ],
            ),
        ),
        (
            "wedges",
            elements(6, &[&[1, 2, 3, 5, 6, 7], &[1, 3, 4, 5, 7, 8]]),
        ),
        (
            "pyramids",
            elements(
                7,
                &[
                    &[1, 2, 3, 4, 9],
                    &[5, 8, 7, 6, 9],
                    &[1, 5, 6, 2, 9],
                    &[2, 6, 7, 3, 9],
                    &[3, 7, 8, 4, 9],
                    &[4, 8, 5, 1, 9],
                ],
            ),
        ),
    ]
}

#[test]
fn a_cube_in_any_elements_has_its_volume_and_centre_in_any_encoding() {
    let folder = Folder::new("mesh-cube");
    for (name, written) in cubes() {
        let mut first = None;
        for (encoding, bytes) in written.all() {
            let path = folder.write("cube.msh", &bytes);
            let found = points(&solid(&path, &[]));
            assert_eq!(found.len(), written.elements.len());
            let volume: f64 = found.iter().map(|(_, volume, _)| volume).sum();
            assert!((volume - 1.0).abs() < 1e-14, "{name} {encoding}: {volume}");
            for k in 0..3 {
                let moment: f64 = found.iter().map(|(x, volume, _)| volume * x[k]).sum();
                assert!((moment - 0.5).abs() < 1e-14, "{name} {encoding}: {moment}");
            }
            let first = first.get_or_insert_with(|| found.clone());
            assert_eq!(*first, found, "{name} {encoding}");
        }
    }
}

/// Second-order elements of Gmsh: type, nodes in the order of Gmsh's manual, and volume.
const SECOND_ORDER: [(i32, &[[f64; 3]], f64); 7] = [
    (
        11,
        &[
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.5, 0.0, 0.0],
            [0.5, 0.5, 0.0],
            [0.0, 0.5, 0.0],
            [0.0, 0.0, 0.5],
            [0.0, 0.5, 0.5],
            [0.5, 0.0, 0.5],
        ],
        1.0 / 6.0,
    ),
    (
        17,
        &[
            [-1.0, -1.0, -1.0],
            [1.0, -1.0, -1.0],
            [1.0, 1.0, -1.0],
            [-1.0, 1.0, -1.0],
            [-1.0, -1.0, 1.0],
            [1.0, -1.0, 1.0],
            [1.0, 1.0, 1.0],
            [-1.0, 1.0, 1.0],
            [0.0, -1.0, -1.0],
            [-1.0, 0.0, -1.0],
            [-1.0, -1.0, 0.0],
            [1.0, 0.0, -1.0],
            [1.0, -1.0, 0.0],
            [0.0, 1.0, -1.0],
            [1.0, 1.0, 0.0],
            [-1.0, 1.0, 0.0],
            [0.0, -1.0, 1.0],
            [-1.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
            [0.0, 1.0, 1.0],
        ],
        8.0,
    ),
    (
        12,
        &[
            [-1.0, -1.0, -1.0],
            [1.0, -1.0, -1.0],
            [1.0, 1.0, -1.0],
            [-1.0, 1.0, -1.0],
            [-1.0, -1.0, 1.0],
            [1.0, -1.0, 1.0],
            [1.0, 1.0, 1.0],
            [-1.0, 1.0, 1.0],
            [0.0, -1.0, -1.0],
            [-1.0, 0.0, -1.0],
            [-1.0, -1.0, 0.0],
            [1.0, 0.0, -1.0],
            [1.0, -1.0, 0.0],
            [0.0, 1.0, -1.0],
            [1.0, 1.0, 0.0],
            [-1.0, 1.0, 0.0],
            [0.0, -1.0, 1.0],
            [-1.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
            [0.0, 1.0, 1.0],
            [0.0, 0.0, -1.0],
            [0.0, -1.0, 0.0],
            [-1.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, 0.0],
        ],
        8.0,
    ),
    (
        18,
        &[
            [0.0, 0.0, -1.0],
            [1.0, 0.0, -1.0],
            [0.0, 1.0, -1.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
            [0.0, 1.0, 1.0],
            [0.5, 0.0, -1.0],
            [0.0, 0.5, -1.0],
            [0.0, 0.0, 0.0],
            [0.5, 0.5, -1.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.5, 0.0, 1.0],
            [0.0, 0.5, 1.0],
            [0.5, 0.5, 1.0],
        ],
        1.0,
    ),
    (
        13,
        &[
            [0.0, 0.0, -1.0],
            [1.0, 0.0, -1.0],
            [0.0, 1.0, -1.0],
            [0.0, 0.0, 1.0],
            [1.0, 0.0, 1.0],
            [0.0, 1.0, 1.0],
            [0.5, 0.0, -1.0],
            [0.0, 0.5, -1.0],
            [0.0, 0.0, 0.0],
            [0.5, 0.5, -1.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.5, 0.0, 1.0],
            [0.0, 0.5, 1.0],
            [0.5, 0.5, 1.0],
            [0.5, 0.0, 0.0],
            [0.0, 0.5, 0.0],
            [0.5, 0.5, 0.0],
        ],
        1.0,
    ),
    (
        19,
        &[
            [-1.0, -1.0, 0.0],
            [1.0, -1.0, 0.0],
            [1.0, 1.0, 0.0],
            [-1.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, -1.0, 0.0],
            [-1.0, 0.0, 0.0],
            [-0.5, -0.5, 0.5],
            [1.0, 0.0, 0.0],
            [0.5, -0.5, 0.5],
            [0.0, 1.0, 0.0],
            [0.5, 0.5, 0.5],
            [-0.5, 0.5, 0.5],
        ],
        4.0 / 3.0,
    ),
    (
        14,
        &[
            [-1.0, -1.0, 0.0],
            [1.0, -1.0, 0.0],
            [1.0, 1.0, 0.0],
            [-1.0, 1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, -1.0, 0.0],
            [-1.0, 0.0, 0.0],
            [-0.5, -0.5, 0.5],
            [1.0, 0.0, 0.0],
            [0.5, -0.5, 0.5],
            [0.0, 1.0, 0.0],
            [0.5, 0.5, 0.5],
            [-0.5, 0.5, 0.5],
            [0.0, 0.0, 0.0],
        ],
        4.0 / 3.0,
    ),
];

#[test]
fn second_order_elements_have_the_order_of_gmsh() {
    let folder = Folder::new("mesh-second-order");
    for (kind, nodes, volume) in SECOND_ORDER {
        let mut written = Written::default();
        // Deform the element by a shear that keeps the volume; with a wrong order of nodes the volume would
        // change.
        let bend = |[x, y, z]: [f64; 3]| [x + 0.2 * y * y, y, z];
        let nodes: Vec<[f64; 3]> = nodes.iter().map(|node| bend(*node)).collect();
        written.add_nodes(&nodes);
        written
            .elements
            .push((kind, 1, 1, (1..=nodes.len()).collect()));
        for (encoding, bytes) in written.all() {
            let path = folder.write("element.msh", &bytes);
            let found = points(&solid(&path, &[]));
            assert!(
                (found[0].1 / volume - 1.0).abs() < 1e-14,
                "{kind} {encoding}: {}",
                found[0].1
            );
        }
    }
}

#[test]
fn plane_elements_have_an_area_times_the_thickness_from_either_side() {
    let folder = Folder::new("mesh-plane");
    let square = [
        [0.0, 0.0, 3.0],
        [2.0, 0.0, 3.0],
        [2.0, 2.0, 3.0],
        [0.0, 2.0, 3.0],
    ];
    let middles = [
        [1.0, 0.0, 3.0],
        [2.0, 1.0, 3.0],
        [1.0, 2.0, 3.0],
        [0.0, 1.0, 3.0],
        [1.0, 1.0, 3.0],
    ];
    let nodes = [&square[..], &middles[..]].concat();
    for (kind, nodes_of, area, centre) in [
        (2, &[1, 2, 3][..], 2.0, [4.0 / 3.0, 2.0 / 3.0]),
        (2, &[1, 3, 2], 2.0, [4.0 / 3.0, 2.0 / 3.0]),
        (3, &[1, 2, 3, 4], 4.0, [1.0, 1.0]),
        (3, &[4, 3, 2, 1], 4.0, [1.0, 1.0]),
        (9, &[1, 2, 3, 5, 6, 9], 2.0, [4.0 / 3.0, 2.0 / 3.0]),
        (16, &[1, 2, 3, 4, 5, 6, 7, 8], 4.0, [1.0, 1.0]),
        (10, &[1, 2, 3, 4, 5, 6, 7, 8, 9], 4.0, [1.0, 1.0]),
    ] {
        let mut written = Written::default();
        written.add_nodes(&nodes);
        written.elements.push((kind, 1, 1, nodes_of.to_vec()));
        let path = folder.write("plane.msh", &written.version_4(None));
        let deck = format!(
            "dimension = 'plane-strain'\nthickness = 0.25\ngrid.horizon = 1\ntime.end = 1\n\
             material.a.pmb = {{ density = 1, youngs_modulus = 1 }}\n[body.a]\nmaterial = 'a'\n\
             points = {{ mesh = '{}', scale = 0.5 }}\n",
            path.display()
        );
        let (position, volume, _) = points(&problem(&deck))[0];
        assert!(
            (volume - 0.25 * 0.25 * area).abs() < 1e-15,
            "{kind}: {volume}"
        );
        let centre = centre.map(|x| 0.5 * x);
        for k in 0..2 {
            assert!(
                (position[k] - centre[k]).abs() < 1e-15,
                "{kind}: {position:?}"
            );
        }
        assert_eq!(position[2], 0.0);
    }
}

/// Return two cubes side by side along x, with the face between them, the face at x = 0, an edge and a corner
/// as elements.
fn two_cubes() -> Written {
    let mut written = Written::default();
    written.add_nodes(&CUBE);
    written.add_nodes(&[
        [2.0, 0.0, 0.0],
        [2.0, 1.0, 0.0],
        [2.0, 0.0, 1.0],
        [2.0, 1.0, 1.0],
    ]);
    written.elements = vec![
        (3, 7, 1, vec![1, 4, 8, 5]),
        (3, 8, 2, vec![2, 3, 7, 6]),
        (1, 5, 1, vec![9, 10]),
        (15, 3, 1, vec![1]),
        (5, 1, 1, vec![1, 2, 3, 4, 5, 6, 7, 8]),
        (5, 2, 2, vec![2, 9, 10, 3, 6, 11, 12, 7]),
    ];
    written.names = vec![
        (2, 7, "outer face"),
        (2, 8, "between"),
        (1, 5, "edge"),
        (0, 3, "corner"),
        (3, 1, "first"),
    ];
    written
}

#[test]
fn groups_of_any_dimension_become_sets() {
    let folder = Folder::new("mesh-groups");
    for (encoding, bytes) in two_cubes().all() {
        let path = folder.write("two.msh", &bytes);
        let problem = solid(&path, &["outer face", "between", "edge", "corner", "first"]);
        assert!(ids(&problem, "first").is_empty(), "before there are points");
        points(&problem);
        for (set, expected) in [
            ("outer face", &[0][..]),
            ("between", &[0, 1]),
            ("edge", &[1]),
            ("corner", &[0]),
            ("first", &[0]),
        ] {
            assert_eq!(ids(&problem, set), expected, "{encoding} {set}");
        }
    }
}

#[test]
fn the_kind_tells_groups_of_the_same_number_apart() {
    let folder = Folder::new("mesh-kinds");
    let mut written = two_cubes();
    // The face between the cubes has the number of the second cube.
    written.elements[1].1 = 2;
    written.names.clear();
    for (encoding, bytes) in written.all() {
        let path = folder.write("two.msh", &bytes);
        let problem = solid(&path, &["surface 2", "volume 2"]);
        points(&problem);
        assert_eq!(ids(&problem, "surface 2"), [0, 1], "{encoding}");
        assert_eq!(ids(&problem, "volume 2"), [1], "{encoding}");
    }
    let mesh = parse("two.msh", written.version_2(None)).unwrap();
    let message = mesh.find(&GroupKey::Number(2), |_| true).unwrap_err();
    assert!(message.contains("\"surface 2\", \"volume 2\""), "{message}");
    let solids = mesh.find(&GroupKey::Number(2), |group| mesh.dimension(group) == 3);
    assert_eq!(solids.unwrap().unwrap().kind, "volume");
}

#[test]
fn a_block_may_be_a_number_and_a_body_without_one_gets_the_rest() {
    let folder = Folder::new("mesh-blocks");
    let path = folder.write("two.msh", &two_cubes().version_2(None));
    let deck = format!(
        "dimension = '3d'\ngrid.horizon = 1\ntime.end = 1\n\
         material.a.pmb = {{ density = 1, youngs_modulus = 1 }}\n\
         [body.b]\nmaterial = 'a'\npoints = {{ mesh = '{0}', block = 2 }}\n\
         [body.a]\nmaterial = 'a'\npoints.mesh = '{0}'\n",
        path.display()
    );
    let found = points(&problem(&deck));
    let blocks: Vec<u32> = found.iter().map(|(_, _, block)| *block).collect();
    assert_eq!(blocks, [1, 0]);
    assert_unit_cubes(&found, &[[0.5; 3], [1.5, 0.5, 0.5]]);
}

#[test]
fn entities_are_the_groups_of_a_mesh_without_physical_groups() {
    let folder = Folder::new("mesh-entities");
    let mut written = two_cubes();
    written.names.clear();
    for (_, physical, ..) in &mut written.elements {
        *physical = 0;
    }
    // The cubes are the volumes 1 and 2. One of the two faces has a physical group.
    written.elements[0].1 = 7;
    for (encoding, bytes) in written.all() {
        let path = folder.write("two.msh", &bytes);
        let deck = format!(
            "dimension = '3d'\ngrid.horizon = 1\ntime.end = 1\n\
             material.a.pmb = {{ density = 1, youngs_modulus = 1 }}\n\
             set.face.mesh = 'surface 7'\nset.edge.mesh = 'curve 1'\n\
             [body.b]\nmaterial = 'a'\npoints = {{ mesh = '{0}', block = 2 }}\n\
             [body.a]\nmaterial = 'a'\npoints = {{ mesh = '{0}', block = 'volume 1' }}\n",
            path.display()
        );
        let problem = problem(&deck);
        let found = points(&problem);
        let blocks: Vec<u32> = found.iter().map(|(_, _, block)| *block).collect();
        assert_eq!(blocks, [1, 0], "{encoding}");
        assert_eq!(ids(&problem, "face"), [0], "{encoding}");
        assert_eq!(ids(&problem, "edge"), [1], "{encoding}");
        // The other face, surface 2, is not a group, because a surface has a physical group.
        let mesh = parse("two.msh", &bytes).unwrap();
        let second = GroupKey::Name("surface 2".to_owned());
        assert!(
            mesh.find(&second, |_| true).unwrap().is_none(),
            "{encoding}"
        );
    }
}

/// A geometrical entity never replaces a physical group: the entity never has the name of a group, and a
/// number alone means the physical group.
#[test]
fn physical_groups_precede_entities() {
    let mut written = two_cubes();
    // No line and no corner has a physical group. The line is the curve 1 and the corner is the point 1.
    written.elements[0].1 = 1;
    written.elements[2].1 = 0;
    written.elements[3].1 = 0;
    written.names = vec![(1, 1, "a curve"), (2, 1, "face")];
    for (encoding, bytes) in written.all() {
        let mesh = parse("two.msh", &bytes).unwrap();
        let find = |name: &str| {
            let found = mesh.find(&GroupKey::Name(name.to_owned()), |_| true);
            found.unwrap().map(|group| group.kind)
        };
        assert_eq!(find("a curve"), None, "{encoding}");
        assert_eq!(find("face"), Some("surface"), "{encoding}");
        assert_eq!(find("curve 1"), Some("curve"), "{encoding}");
        let number = |number: i64, dimension: usize| {
            let found = mesh.find(&GroupKey::Number(number), |group| {
                mesh.dimension(group) <= dimension
            });
            found.map(|group| group.unwrap().kind)
        };
        assert_eq!(number(1, 2), Ok("surface"), "{encoding}");
        // Two entities of one number remain ambiguous.
        assert!(number(1, 1).is_err(), "{encoding}");
    }
}

#[test]
fn version_2_repeats_an_element_for_each_of_its_groups() {
    let folder = Folder::new("mesh-repeated");
    let mut written = two_cubes();
    let mut again = written.elements[4].clone();
    again.1 = 2;
    written.elements.insert(5, again);
    let path = folder.write("two.msh", &written.version_2(None));
    let problem = solid(&path, &["first"]);
    assert_eq!(points(&problem).len(), 2);
    assert_eq!(ids(&problem, "first"), [0]);
    let mesh = parse("two.msh", written.version_2(None)).unwrap();
    let second = mesh.find(&GroupKey::Number(2), |_| true).unwrap().unwrap();
    let Members::Elements(elements) = &second.members else {
        panic!("a group of elements");
    };
    assert_eq!(elements.iter().collect::<Vec<_>>(), [4, 5]);
}

const ABAQUS: &str = "\
*Heading
 a bracket, not a mesh
** PARTS
*Part, name=Block
*Node, nset=ALL
 1, 0., 0., 0.
 2, 1., 0., 0.
 3, 1., 1., 0.
 4, 0., 1., 0.
 5, 0., 0., 1.
 6, 1., 0., 1.
 7, 1., 1., 1.D0
 8, 0., 1., 1.
 11, 2.
 12, 2., 1.
 13, 2., 0., 1.
 14, 2., 1., 1.
*Element, type=C3D8R, elset=BODY
 1, 1, 2, 3, 4,
 5, 6, 7, 8
 2, 2, 11, 12, 3, 6, 13, 14, 7
*Nset, nset=Face, generate
 1, 8, 4
*Elset, elset=Second
 2,
*Surface, type=ELEMENT, name=Right
Second, S4
*Surface, type=ELEMENT, name=Whole
BODY,
*Surface, name=Sides, combine=union
Right,
Whole,Right
*Surface, type=NODE, name=Edge
Face
*Elset, elset=Edge
 2,
*Surface, name=Edges, combine=union
Edge
*Solid Section, elset=BODY, material=Steel
,
*End Part
*Assembly, name=Assembly
*Instance, name=Left, part=Block
*End Instance
*Instance, name=Turned, part=Block
 10., 0., 0.
 10., 0., 0., 10., 0., 1., 90.
*End Instance
*Elset, elset=Both, instance=Left
 1
*Elset, elset=Both, instance=Turned
 2
*Elset, elset=Nested
 Both, Left.Second
*Nset, nset=Corner
 Turned.11, Left.1
*End Assembly
*Material, name=Steel
*Elastic
 210000., 0.3
*Step
";

#[test]
fn parts_instances_and_sets_of_abaqus() {
    let folder = Folder::new("mesh-abaqus");
    let path = folder.write("bracket.inp", ABAQUS);
    let sets = [
        "Left",
        "turned",
        "left.face",
        "Turned.Second",
        "second",
        "RIGHT",
        "both",
        "Nested",
        "Corner",
        "BODY",
        "left.sides",
        "Edges",
    ];
    let problem = solid(&path, &sets);
    let found = points(&problem);
    let expected = [
        [0.5, 0.5, 0.5],
        [1.5, 0.5, 0.5],
        [9.5, 0.5, 0.5],
        [9.5, 1.5, 0.5],
    ];
    assert_unit_cubes(&found, &expected);
    for (set, expected) in [
        ("Left", &[0, 1][..]),
        ("turned", &[2, 3]),
        ("left.face", &[0]),
        ("Turned.Second", &[3]),
        ("second", &[1, 3]),
        ("RIGHT", &[1, 3]),
        ("both", &[0, 3]),
        ("Nested", &[0, 1, 3]),
        ("Corner", &[0, 3]),
        ("BODY", &[0, 1, 2, 3]),
        ("left.sides", &[0, 1]),
        ("Edges", &[0, 2]),
    ] {
        assert_eq!(ids(&problem, set), expected, "{set}");
    }
}

/// The second instance has a mesh of its own, its part has none, and the file does not list the part of the
/// third instance.
const OWN_MESHES: &str = "\
*Part, name=Meshed
*Node
 1, 0., 0., 0.
 2, 1., 0., 0.
 3, 1., 1., 0.
 4, 0., 1., 0.
 5, 0., 0., 1.
 6, 1., 0., 1.
 7, 1., 1., 1.
 8, 0., 1., 1.
*Element, type=C3D8, elset=Cube
 1, 1, 2, 3, 4, 5, 6, 7, 8
*End Part
*Part, name=Bare
*End Part
*Assembly, name=Assembly
*Instance, name=First, part=Meshed
*End Instance
*Instance, name=Second, part=Bare
 4., 0., 0.
*Node
 1, 0., 0., 0.
 2, 1., 0., 0.
 3, 1., 1., 0.
 4, 0., 1., 0.
 5, 0., 0., 1.
 6, 1., 0., 1.
 7, 1., 1., 1.
 8, 0., 1., 1.
*Element, type=C3D8, elset=Cube
 7, 1, 2, 3, 4, 5, 6, 7, 8
*End Instance
*Instance, name=Third, part=Elsewhere
*Node
 1, 0., 6., 0.
 2, 1., 6., 0.
 3, 1., 7., 0.
 4, 0., 7., 0.
 5, 0., 6., 1.
 6, 1., 6., 1.
 7, 1., 7., 1.
 8, 0., 7., 1.
*Element, type=C3D8R
 1, 1, 2, 3, 4, 5, 6, 7, 8
*Nset, nset=Top, generate
 5, 8
*End Instance
*Elset, elset=Seventh, instance=Second
 7
*End Assembly
";

#[test]
fn an_instance_of_abaqus_may_have_its_own_mesh() {
    let folder = Folder::new("mesh-own");
    let path = folder.write("own.inp", OWN_MESHES);
    let problem = solid(&path, &["Second", "Third", "Seventh", "Cube", "Third.Top"]);
    let expected = [[0.5, 0.5, 0.5], [4.5, 0.5, 0.5], [0.5, 6.5, 0.5]];
    assert_unit_cubes(&points(&problem), &expected);
    for (set, expected) in [
        ("Second", &[1][..]),
        ("Third", &[2]),
        ("Seventh", &[1]),
        ("Cube", &[0, 1]),
        ("Third.Top", &[2]),
    ] {
        assert_eq!(ids(&problem, set), expected, "{set}");
    }
}

#[test]
fn files_of_abaqus_include_others() {
    let folder = Folder::new("mesh-include");
    folder.write(
        "nodes.txt",
        "1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n",
    );
    folder.write("elements.inc", "*ELEMENT, TYPE=C3D4\n7, 1, 2, 3, 4\n");
    let path = folder.write(
        "a.inp",
        "*NODE, INPUT=nodes.txt\n*INCLUDE, INPUT=elements.inc\n",
    );
    let found = points(&solid(&path, &[]));
    assert!((found[0].1 - 1.0 / 6.0).abs() < 1e-16);
    // The error of an element names the file that contains the element.
    folder.write("elements.inc", "*ELEMENT, TYPE=C3D4\n7, 1, 3, 2, 4\n");
    let comm = threads::alone();
    let error = generate(&solid(&path, &[]), &comm).unwrap_err().message;
    let ending = "elements.inc:2: element 7 (tetrahedron): has the volume -1.6666666666666666e-1 m³; its nodes are \
                  in the order of a mirrored element";
    assert!(error.ends_with(ending), "{error}");
    let path = folder.write("b.inp", "*INCLUDE, INPUT=b.inp\n");
    let error = generate(&solid(&path, &[]), &comm).unwrap_err().message;
    assert!(
        error.ends_with("includes files 16 deep or 1000 in all; do they include themselves?"),
        "{error}"
    );
}

#[test]
fn every_element_type_of_abaqus() {
    let square = "1,0,0\n2,1,0\n3,1,1\n4,0,1\n5,.5,0\n6,1,.5\n7,.5,1\n8,0,.5\n9,.5,.5\n";
    for (name, nodes, kind) in [
        ("CPS3", "1,2,3", 3),
        ("CPE6M", "1,2,3,5,6,9", 6),
        ("CPS4R", "1,2,3,4", 4),
        ("CPEG8R", "1,2,3,4,5,6,7,8", 8),
        ("S4RSW", "1,2,3,4", 4),
        ("S8R5", "1,2,3,4,5,6,7,8", 8),
        ("S9R5", "1,2,3,4,5,6,7,8,9", 9),
        ("STRI65", "1,2,3,5,6,9", 6),
        ("M3D4", "1,2,3,4", 4),
        ("DC2D4", "1,2,3,4", 4),
        ("T3D2", "1,2", 2),
        ("B32", "1,2,5", 3),
        ("C3D4", "1,2,3,4", 4),
        ("C3D10MH", "1,2,3,4,5,6,7,8,9,9", 10),
        ("C3D5", "1,2,3,4,5", 5),
        ("C3D6", "1,2,3,4,5,6", 6),
        ("SC8R", "1,2,3,4,5,6,7,8", 8),
        ("C3D15", "1,2,3,4,5,6,7,8,9,1,2,3,4,5,6", 15),
        ("C3D20R", "1,2,3,4,5,6,7,8,9,1,2,3,4,5,6,\n7,8,9,1,2", 20),
    ] {
        let text = format!("*NODE\n{square}*ELEMENT, TYPE={name}\n1,{nodes}\n");
        let mesh = parse("a.inp", text).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(mesh.elements.kind(0).nodes, kind, "{name}");
    }
}

#[test]
fn damaged_lines_of_abaqus_have_their_message() {
    let nodes = "*NODE\n1, 0, 0\n2, 1, 0\n3, 0, 1\n";
    for (text, message) in [
        ("*NODE\n1, 0, a\n", "a.inp:2: must be a number, is `a`"),
        ("*NODE\n1, 0\n1, 1\n", "a.inp:3: node 1 is given twice"),
        (
            "*NODE\n1, 1e99\n",
            "a.inp:2: node 1: a coordinate must be a number of at most 1e30, is one of 1e99, 0e0, 0e0",
        ),
        (
            "*NODE, SYSTEM=C\n",
            "a.inp:1: *NODE: coordinates must be Cartesian",
        ),
        (
            "*NGEN\n",
            "a.inp:1: *NGEN is not supported; write the mesh with all nodes and elements",
        ),
        (
            "NODES*ELEMENT, TYPE=CPS3\n1, 1, 2\n*ELSET, ELSET=a\n",
            "a.inp:7: element 1: has 2 nodes before this line, must have 3",
        ),
        (
            "NODES*ELEMENT, TYPE=CPS3\n1, 1, 2, 3, 1\n",
            "a.inp:6: element 1: has more than 3 nodes",
        ),
        (
            "NODES*ELEMENT, TYPE=CPS3\n1, 1, 2, 4\n",
            "a.inp:6: element 1: node 4 is not defined before this element",
        ),
        (
            "NODES*ELEMENT, TYPE=CPS3\n1, 1, 2, 3\n1, 1, 2, 3\n",
            "a.inp:7: element 1 is given twice",
        ),
        (
            "NODES*ELSET, ELSET=a\n5\n",
            "a.inp:5: set `a`: there is no element 5",
        ),
        (
            "NODES*NSET, NSET=a\nb\n",
            "a.inp:5: set `a`: there is no node set `b` before it",
        ),
        (
            "NODES*NSET, NSET=a, GENERATE\n3, 1\n",
            "a.inp:6: GENERATE: needs first ≤ last and a step of at least 1",
        ),
        (
            "*INSTANCE, PART=p\n*END INSTANCE\n",
            "a.inp:1: *INSTANCE: there is no part `p`, and the instance has no nodes of its own",
        ),
        (
            "*INSTANCE, NAME=i\n*END INSTANCE\n",
            "a.inp:1: *INSTANCE: has neither `PART=` nor nodes of its own",
        ),
        (
            "*PART, NAME=p\n*PART, NAME=q\n",
            "a.inp:2: *PART within `p`, which has no end",
        ),
        ("*PART, NAME=p\n", "a.inp: part or instance `p` has no end"),
        ("*END PART\n", "a.inp:1: *END PART without *PART"),
        (
            "*PART, NAME=p\n*END PART\n",
            "a.inp: has parts but no *INSTANCE of one",
        ),
        ("NODES", "a.inp: has no elements"),
        (
            "*ASSEMBLY, NAME=a\n",
            "a.inp:1: *ASSEMBLY has no *END ASSEMBLY; is the file complete?",
        ),
        (
            "*ASSEMBLY, NAME=a\n*ASSEMBLY, NAME=b\n",
            "a.inp:2: *ASSEMBLY within another *ASSEMBLY",
        ),
        (
            "*END ASSEMBLY\n",
            "a.inp:1: *END ASSEMBLY without *ASSEMBLY",
        ),
        (
            "*PART, NAME=p\n*ASSEMBLY, NAME=a\n",
            "a.inp:2: *ASSEMBLY within `p`, which has no end",
        ),
        (
            "*ASSEMBLY, NAME=a\n*INSTANCE, NAME=i\n*END ASSEMBLY\n",
            "a.inp:3: *END ASSEMBLY within `i`, which has no end",
        ),
        (
            "NODES*SURFACE, NAME=a, COMBINE=UNION\nb, c\n",
            "a.inp:5: set `a`: there is no element surface `b` before it",
        ),
        (
            "*INCLUDE, INPUT=nothing.txt\n",
            "a.inp:1: cannot read nothing.txt: No such file or directory (os error 2)",
        ),
    ] {
        let text = text.replace("NODES", nodes);
        assert_eq!(parse("a.inp", &text).unwrap_err(), message);
    }
}

/// A surface that cannot be read is an error only for a deck or a surface that uses it.
#[test]
fn unsupported_surfaces_of_abaqus_are_errors_where_they_are_used() {
    let mesh = "*NODE\n1, 0, 0\n2, 1, 0\n3, 0, 1\n*ELEMENT, TYPE=CPS3, ELSET=b\n1, 1, 2, 3\n";
    for (surface, message) in [
        (
            "*SURFACE, NAME=a\n1, S1\n, S1\n",
            "a.inp:9: *SURFACE: a line must begin with an element, a node or a set; a blank entry, which stands \
             for the whole model, is not supported",
        ),
        (
            "*SURFACE, NAME=a, COMBINE=difference\nc, d\n",
            "a.inp:7: *SURFACE: COMBINE=DIFFERENCE is not supported, only COMBINE=UNION is; list the elements of \
             the surface",
        ),
        (
            "*SURFACE, NAME=a, CROP\nc\n",
            "a.inp:7: *SURFACE: CROP is not supported; list the elements of the surface",
        ),
    ] {
        let text = format!("{mesh}{surface}");
        let read = parse("a.inp", &text).unwrap();
        let find = |name: &str| read.find(&GroupKey::Name(name.to_owned()), |_| true);
        assert!(find("b").unwrap().is_some(), "{surface}");
        for name in ["a", "A", "element set a"] {
            assert_eq!(find(name).unwrap_err(), message);
        }
        let union = format!("{text}*SURFACE, NAME=u, COMBINE=UNION\na\n");
        assert_eq!(parse("a.inp", &union).unwrap_err(), message);
    }
}

/// Pseudo-random numbers (xorshift).
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % end.max(1) as u64) as usize
    }
}

/// Return a copy with a few random changes: bytes, cuts, repeats and extreme numbers.
fn mutant(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut changed = bytes.to_vec();
    for _ in 0..=random.below(4) {
        let at = random.below(changed.len());
        let end = (at + random.below(24)).min(changed.len());
        match random.below(7) {
            0 if !changed.is_empty() => changed[at] = random.below(256) as u8,
            1 if !changed.is_empty() => changed[at] ^= 1 << random.below(8),
            2 => changed.truncate(at),
            3 => drop(changed.drain(at..end)),
            4 => {
                let piece = changed[at..end].to_vec();
                let place = random.below(changed.len());
                changed.splice(place..place, piece);
            }
            5 => {
                let odd: [&[u8]; 8] = [
                    b"-1",
                    b"99999999999999999999",
                    b"1e308",
                    b"nan",
                    b"18446744073709551615",
                    b"\xff\xff\xff\xff\xff\xff\xff\xff",
                    b"\xff\xff\xff\x7f",
                    b"9223372036854775807",
                ];
                changed.splice(at..end, odd[random.below(odd.len())].iter().copied());
            }
            _ => {
                let other = random.below(changed.len());
                let piece: Vec<u8> = changed[at..end].to_vec();
                let other_end = (other + piece.len()).min(changed.len());
                changed.splice(other..other_end, piece);
            }
        }
    }
    changed
}

/// Read `FISSURE_MUTANTS` mutants of a file, 2000 by default. Each is a mesh or an error, and a mesh has at
/// most 40 nodes and elements per byte of its file.
fn survives_mutants(name: &str, bytes: &[u8], seed: u64) {
    let mutants = std::env::var("FISSURE_MUTANTS").map_or(2000, |count| count.parse().unwrap());
    let mut random = Random(seed);
    let mut sound = 0;
    for _ in 0..mutants {
        let changed = mutant(bytes, &mut random);
        if let Ok(mesh) = parse(name, &changed) {
            sound += 1;
            assert!(mesh.nodes.len() + mesh.elements.len() <= 40 * changed.len());
            for element in 0..mesh.elements.len() {
                let nodes = mesh.elements.nodes(element).iter();
                let nodes: Vec<[f64; 3]> = nodes.map(|node| mesh.nodes[*node as usize]).collect();
                mesh::measure(mesh.elements.kind(element), &nodes);
            }
            mesh.names(|_| true);
        }
    }
    assert!(
        sound > 0 && sound < mutants,
        "{sound} of {mutants} mutants are sound"
    );
}

#[test]
fn damaged_files_of_gmsh_are_errors() {
    for ((_, bytes), seed) in two_cubes().all().iter().zip(1..) {
        survives_mutants("two.msh", bytes, seed);
    }
}

/// A node or an element is one line of a text file. A number too many or too few would shift all numbers after
/// it.
#[test]
fn lines_of_gmsh_have_their_numbers() {
    for bytes in [two_cubes().version_2(None), two_cubes().version_4(None)] {
        let text = String::from_utf8(bytes).unwrap();
        // A blank line is before the end of a section, and the last but one entry is two lines before it.
        for (end, name) in [("$EndNodes", "node 11"), ("$EndElements", "element 5")] {
            let at = text.lines().position(|line| line == end).unwrap() - 3;
            let line = text.lines().nth(at).unwrap();
            let (short, _) = line.trim_end().rsplit_once(' ').unwrap();
            for (changed, what) in [(format!("{line} 1"), "many"), (short.to_owned(), "few")] {
                let mut lines: Vec<&str> = text.lines().collect();
                lines[at] = &changed;
                let error = parse("a.msh", lines.join("\n")).unwrap_err();
                let message = format!("a.msh:{}: {name}: its line has too {what} numbers", at + 1);
                assert_eq!(error, message, "{text}");
            }
        }
    }
}

#[test]
fn damaged_files_of_abaqus_are_errors() {
    survives_mutants("bracket.inp", ABAQUS.as_bytes(), 7);
    survives_mutants("own.inp", OWN_MESHES.as_bytes(), 13);
}

#[test]
fn a_plate_of_a_mesh_has_equal_bits_on_two_ranks() {
    let deck = deck::read(Path::new("tests/decks/good/mesh_plate.toml"), &[]);
    let problem = || deck.as_ref().unwrap().problem().unwrap();
    let first = problem();
    let alone = record(&first, 1, 1);
    assert_eq!(record(&problem(), 2, 1).datasets, alone.datasets);
    // Run the same problem again, whose sets already have their points.
    assert_eq!(record(&first, 3, 1).datasets, alone.datasets);
    // The area is the square minus a regular polygon of 48 sides, the hole.
    let hole = 0.5 * 48.0 * 64.0 * (std::f64::consts::TAU / 48.0).sin();
    let expected = (1600.0 - hole) * 1e-9;
    let volume: f64 = points(&first).iter().map(|(_, volume, _)| volume).sum();
    assert!(
        (volume / expected - 1.0).abs() < 1e-6,
        "{volume} {expected}"
    );
}

#[test]
fn the_page_on_meshes_has_the_deck_that_is_tested() {
    let deck = std::fs::read_to_string("tests/decks/good/mesh_plate.toml").unwrap();
    let page = std::fs::read_to_string("docs/src/reference/meshes.md").unwrap();
    let code = page
        .split("```toml\n")
        .nth(1)
        .unwrap()
        .split("```")
        .next()
        .unwrap();
    assert_eq!(deck, code);
}

/// Encodings of the arrays in a VTK file of the two cubes of [`two_cubes`].
#[derive(Clone, Copy, Debug, PartialEq)]
enum Arrays {
    Text,
    Inline,
    AppendedRaw,
    AppendedCompressed,
}

fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |chunk: &[u8]| {
        let mut word = [0; 3];
        word[..chunk.len()].copy_from_slice(chunk);
        let word = u32::from_be_bytes([0, word[0], word[1], word[2]]);
        let digit = |k: usize| char::from(DIGITS[(word >> (18 - 6 * k) & 63) as usize]);
        let digits = (0..4).map(|k| if k <= chunk.len() { digit(k) } else { '=' });
        digits.collect::<String>()
    };
    bytes.chunks(3).map(group).collect()
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes).unwrap();
    encoder.finish().unwrap()
}

fn unstructured(arrays: Arrays) -> Vec<u8> {
    let written = two_cubes();
    let solids: Vec<&Vec<usize>> = written.elements[4..]
        .iter()
        .map(|element| &element.3)
        .collect();
    let points = written.nodes.concat();
    let connectivity: Vec<i32> = solids
        .iter()
        .flat_map(|nodes| nodes.iter().map(|node| *node as i32 - 1))
        .collect();
    let mut appended = Vec::new();
    let mut array = |name: &str, kind: &str, components: usize, text: String, bytes: Vec<u8>| {
        let head = format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\""
        );
        match arrays {
            Arrays::Text => format!("{head} format=\"ascii\">{text}</DataArray>"),
            Arrays::Inline => {
                let all = [&(bytes.len() as u32).to_le_bytes()[..], &bytes].concat();
                format!("{head} format=\"binary\">\n{}\n</DataArray>", base64(&all))
            }
            Arrays::AppendedRaw => {
                let offset = appended.len();
                appended.extend_from_slice(&(bytes.len() as u64).to_le_bytes());
                appended.extend_from_slice(&bytes);
                format!("{head} format=\"appended\" offset=\"{offset}\"/>")
            }
            Arrays::AppendedCompressed => {
                let offset = appended.len();
                // Compress the array in two blocks; the second block is shorter.
                let size = bytes.len() / 2 + 1;
                let blocks: Vec<Vec<u8>> = bytes.chunks(size).map(zlib).collect();
                let last = bytes.len() - size * (blocks.len() - 1);
                let mut header = vec![blocks.len() as u64, size as u64, last as u64];
                header.extend(blocks.iter().map(|block| block.len() as u64));
                let header: Vec<u8> = header
                    .iter()
                    .flat_map(|number| number.to_le_bytes())
                    .collect();
                appended.extend_from_slice(base64(&header).as_bytes());
                appended.extend_from_slice(base64(&blocks.concat()).as_bytes());
                format!("{head} format=\"appended\" offset=\"{offset}\"/>")
            }
        }
    };
    let reals = |numbers: &[f64]| numbers.iter().map(|x| format!("{x} ")).collect::<String>();
    let whole = |numbers: &[i32]| numbers.iter().map(|x| format!("{x} ")).collect::<String>();
    let bytes = |numbers: &[i32]| {
        numbers
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let mut integers =
        |name: &str, numbers: &[i32]| array(name, "Int32", 1, whole(numbers), bytes(numbers));
    let cells = [
        integers("connectivity", &connectivity),
        integers("offsets", &[8, 16]),
        integers("types", &[12, 12]),
    ]
    .concat();
    let material = integers("material", &[4, 5]);
    let left: Vec<i32> = written
        .nodes
        .iter()
        .map(|node| i32::from(node[0] == 0.0))
        .collect();
    let left = integers("left", &left);
    let place = points.iter().flat_map(|x| x.to_le_bytes()).collect();
    let points = array("Points", "Float64", 3, reals(&points), place);
    let compressor = match arrays {
        Arrays::AppendedCompressed => " compressor=\"vtkZLibDataCompressor\"",
        _ => "",
    };
    let header = match arrays {
        Arrays::Inline => "UInt32",
        _ => "UInt64",
    };
    let mut file = format!(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" \
         header_type=\"{header}\"{compressor}>\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"12\" \
         NumberOfCells=\"2\">\n<PointData>{left}</PointData>\n<CellData>{material}</CellData>\n\
         <Points>{points}</Points>\n<Cells>{cells}</Cells>\n</Piece>\n</UnstructuredGrid>\n"
    )
    .into_bytes();
    if !appended.is_empty() {
        let encoding = if arrays == Arrays::AppendedRaw {
            "raw"
        } else {
            "base64"
        };
        file.extend_from_slice(format!("<AppendedData encoding=\"{encoding}\">\n_").as_bytes());
        file.extend_from_slice(&appended);
        file.extend_from_slice(b"\n</AppendedData>\n");
    }
    file.extend_from_slice(b"</VTKFile>\n");
    file
}

const WAYS: [Arrays; 4] = [
    Arrays::Text,
    Arrays::Inline,
    Arrays::AppendedRaw,
    Arrays::AppendedCompressed,
];

#[test]
fn an_unstructured_grid_is_read_in_any_encoding() {
    let folder = Folder::new("mesh-vtu");
    for way in WAYS {
        let path = folder.write("two.vtu", &unstructured(way));
        let problem = solid(&path, &["material=5", "left=1"]);
        let found = points(&problem);
        assert_unit_cubes(&found, &[[0.5; 3], [1.5, 0.5, 0.5]]);
        assert_eq!(ids(&problem, "material=5"), [1], "{way:?}");
        assert_eq!(ids(&problem, "left=1"), [0], "{way:?}");
        let mesh = parse("two.vtu", unstructured(way)).unwrap();
        assert!(mesh.find(&GroupKey::Number(4), |_| true).unwrap().is_some());
    }
}

#[test]
fn an_array_of_many_values_in_all_pieces_has_no_groups() {
    // A piece of a VTK file: vertices with the values of a range.
    let piece = |values: std::ops::Range<usize>| {
        let count = values.len();
        let join = |numbers: Vec<usize>| {
            let words: Vec<String> = numbers.iter().map(usize::to_string).collect();
            words.join(" ")
        };
        let array = |name: &str, numbers: Vec<usize>| {
            let numbers = join(numbers);
            format!(
                "<DataArray type=\"Int64\" Name=\"{name}\" format=\"ascii\">{numbers}</DataArray>"
            )
        };
        format!(
            "<Piece NumberOfPoints=\"{count}\" NumberOfCells=\"{count}\">\
             <Points><DataArray type=\"Int64\" NumberOfComponents=\"3\" format=\"ascii\">{}</DataArray></Points>\
             <Cells>{}{}{}</Cells><CellData>{}</CellData></Piece>",
            join(vec![0; 3 * count]),
            array("connectivity", (0..count).collect()),
            array("offsets", (1..=count).collect()),
            array("types", vec![1; count]),
            array("id", values.collect()),
        )
    };
    let groups = |pieces: &[std::ops::Range<usize>]| {
        let pieces: String = pieces.iter().cloned().map(piece).collect();
        let text = format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>{pieces}</UnstructuredGrid></VTKFile>"
        );
        parse("a.vtu", text).unwrap().groups.len()
    };
    assert_eq!(groups(&[0..600, 400..1000]), 1000);
    assert_eq!(groups(&[0..600, 401..1001]), 0);
    assert_eq!(groups(&[0..2, 0..1001]), 0);
    assert_eq!(groups(&[0..1001, 0..2]), 0);
}

#[test]
fn cells_of_vtk_have_their_types() {
    for (kind, points, expected) in [
        (8, "0 1 3 2", 1.0),
        (9, "0 1 2 3", 1.0),
        (5, "0 1 2", 0.5),
        (11, "0 1 3 2 4 5 7 6", 1.0),
        (12, "0 1 2 3 4 5 6 7", 1.0),
        (10, "0 1 2 6", 1.0 / 6.0),
        (14, "0 1 2 3 6", 1.0 / 3.0),
        (13, "0 1 2 4 5 6", 0.5),
        (13, "4 5 6 0 1 2", 0.5),
    ] {
        let numbers = points.split(' ').count();
        let nodes: String = CUBE.concat().iter().map(|x| format!("{x} ")).collect();
        let text = format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece><Points><DataArray type=\"Float32\" \
             format=\"ascii\">{nodes}</DataArray></Points><Cells><DataArray type=\"Int64\" Name=\"connectivity\" \
             format=\"ascii\">{points}</DataArray><DataArray type=\"Int64\" Name=\"offsets\" \
             format=\"ascii\">{numbers}</DataArray><DataArray type=\"UInt8\" Name=\"types\" \
             format=\"ascii\">{kind}</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>"
        );
        let mesh = parse("a.vtu", text).unwrap();
        let nodes: Vec<[f64; 3]> = mesh
            .elements
            .nodes(0)
            .iter()
            .map(|node| mesh.nodes[*node as usize])
            .collect();
        let size = mesh::measure(mesh.elements.kind(0), &nodes).size;
        assert!((size - expected).abs() < 1e-15, "{kind} {points}: {size}");
    }
}

#[test]
fn damaged_grids_have_their_message() {
    let text = String::from_utf8(unstructured(Arrays::Text)).unwrap();
    for (from, to, message) in [
        (
            "\"UnstructuredGrid\"",
            "\"PolyData\"",
            "must be a VTKFile of the type UnstructuredGrid",
        ),
        (
            ">12 12 ",
            ">12 42 ",
            "cell 1: VTK cell type 42 is not supported; use first- or second-order cells",
        ),
        (
            ">8 16 ",
            ">8 17 ",
            "cell 1: its entries of `offsets` and `connectivity`, from 8 on, must give 8 points",
        ),
        (">0 1 2 3 ", ">0 1 2 99 ", "cell 0: there is no point 99"),
        (
            ">4 5 ",
            ">4 five ",
            "array `material`: must have numbers of the type Int32, has `five`",
        ),
        (
            "Name=\"types\"",
            "Name=\"kinds\"",
            "Cells: needs whole numbers `types`",
        ),
        (
            "NumberOfCells=\"2\"",
            "NumberOfCells=\"3\"",
            "NumberOfCells of a piece is `3`, but its arrays have 2",
        ),
        (
            "NumberOfPoints=\"12\"",
            "NumberOfPoints=\"x\"",
            "NumberOfPoints of a piece is `x`, but its arrays have 12",
        ),
        (
            "version=\"1.0\" byte",
            "compressor=\"vtkLZ4DataCompressor\" byte",
            "is compressed by `vtkLZ4DataCompressor`; use zlib or no compression",
        ),
    ] {
        assert!(text.contains(from), "{from}");
        let error = parse("two.vtu", text.replacen(from, to, 1)).unwrap_err();
        assert_eq!(error, format!("two.vtu: {message}"));
    }
}

#[test]
fn damaged_files_of_vtk_are_errors() {
    for (way, seed) in WAYS.into_iter().zip(11..) {
        survives_mutants("two.vtu", &unstructured(way), seed);
    }
}

/// The variables of a small Exodus file: the two cubes of [`two_cubes`] as blocks, a node set and a side set.
struct Exodus {
    /// Type of the elements of all blocks.
    element: &'static str,
    /// Name, lengths, values.
    reals: Vec<(&'static str, Vec<usize>, Vec<f64>)>,
    /// Name, lengths, values.
    integers: Vec<(&'static str, Vec<usize>, Vec<i32>)>,
    /// Name and rows.
    texts: Vec<(&'static str, Vec<&'static str>)>,
}

/// Length of a name in the file, characters.
const NAME: usize = 33;

fn exodus() -> Exodus {
    let written = two_cubes();
    let axis = |k: usize| written.nodes.iter().map(|node| node[k]).collect();
    let count = written.nodes.len();
    let nodes = |element: usize| {
        written.elements[element]
            .3
            .iter()
            .map(|node| *node as i32)
            .collect()
    };
    Exodus {
        element: "HEX8",
        reals: vec![
            ("coordx", vec![count], axis(0)),
            ("coordy", vec![count], axis(1)),
            ("coordz", vec![count], axis(2)),
        ],
        integers: vec![
            ("eb_prop1", vec![2], vec![10, 20]),
            ("connect1", vec![1, 8], nodes(4)),
            ("connect2", vec![1, 8], nodes(5)),
            ("elem_num_map", vec![2], vec![101, 102]),
            ("ns_prop1", vec![1], vec![3]),
            ("node_ns1", vec![2], vec![9, 10]),
            ("ss_prop1", vec![1], vec![4]),
            ("elem_ss1", vec![1], vec![1]),
            ("side_ss1", vec![1], vec![4]),
        ],
        texts: vec![
            ("eb_names", vec!["first", ""]),
            ("ns_names", vec!["right edge"]),
        ],
    }
}

/// Return an Exodus file of two cubes, with all nodes of the first cube in a node set of this name.
pub(super) fn exodus_of_first_cube(set: &'static str) -> Vec<u8> {
    let mut file = exodus();
    let of_name = |file: &Exodus, name: &str| {
        let mut integers = file.integers.iter();
        integers
            .find(|(known, ..)| *known == name)
            .unwrap()
            .2
            .clone()
    };
    let nodes = of_name(&file, "connect1");
    for (name, shape, values) in &mut file.integers {
        if *name == "node_ns1" {
            (*shape, *values) = (vec![nodes.len()], nodes.clone());
        }
    }
    for (name, rows) in &mut file.texts {
        if *name == "ns_names" {
            *rows = vec![set];
        }
    }
    file.classic(1)
}

impl Exodus {
    /// Return a classic netCDF file of version 1 or 2 (64-bit offsets).
    fn classic(&self, version: u8) -> Vec<u8> {
        struct Variable {
            name: &'static str,
            shape: Vec<usize>,
            kind: u32,
            data: Vec<u8>,
        }
        let mut variables = Vec::new();
        for (name, shape, values) in &self.reals {
            let data = values.iter().flat_map(|x| x.to_be_bytes()).collect();
            variables.push(Variable {
                name,
                shape: shape.clone(),
                kind: 6,
                data,
            });
        }
        for (name, shape, values) in &self.integers {
            let data = values.iter().flat_map(|x| x.to_be_bytes()).collect();
            variables.push(Variable {
                name,
                shape: shape.clone(),
                kind: 4,
                data,
            });
        }
        for (name, rows) in &self.texts {
            let mut data = Vec::new();
            for row in rows {
                let mut bytes = row.as_bytes().to_vec();
                bytes.resize(NAME, 0);
                data.extend(bytes);
            }
            let shape = vec![rows.len(), NAME];
            variables.push(Variable {
                name,
                shape,
                kind: 2,
                data,
            });
        }
        let mut lengths: Vec<usize> = variables
            .iter()
            .flat_map(|variable| variable.shape.clone())
            .collect();
        lengths.sort_unstable();
        lengths.dedup();
        let header = |begins: &[usize]| {
            let mut out = vec![b'C', b'D', b'F', version];
            let word = |out: &mut Vec<u8>, number: usize| out.extend((number as u32).to_be_bytes());
            let text = |out: &mut Vec<u8>, text: &str| {
                word(out, text.len());
                out.extend_from_slice(text.as_bytes());
                out.resize(out.len().next_multiple_of(4), 0);
            };
            word(&mut out, 0);
            word(&mut out, 10);
            word(&mut out, lengths.len());
            for length in &lengths {
                text(&mut out, &format!("d{length}"));
                word(&mut out, *length);
            }
            // The file has no global attributes.
            word(&mut out, 0);
            word(&mut out, 0);
            word(&mut out, 11);
            word(&mut out, variables.len());
            for (variable, begin) in variables.iter().zip(begins) {
                text(&mut out, variable.name);
                word(&mut out, variable.shape.len());
                for length in &variable.shape {
                    word(
                        &mut out,
                        lengths.iter().position(|own| own == length).unwrap(),
                    );
                }
                if variable.name.starts_with("connect") {
                    word(&mut out, 12);
                    word(&mut out, 1);
                    text(&mut out, "elem_type");
                    word(&mut out, 2);
                    text(&mut out, self.element);
                } else {
                    word(&mut out, 0);
                    word(&mut out, 0);
                }
                word(&mut out, variable.kind as usize);
                word(&mut out, variable.data.len().next_multiple_of(4));
                if version == 2 {
                    out.extend((*begin as u64).to_be_bytes());
                } else {
                    word(&mut out, *begin);
                }
            }
            out
        };
        let mut begins = vec![0; variables.len()];
        let mut at = header(&begins).len();
        for (variable, begin) in variables.iter().zip(&mut begins) {
            *begin = at;
            at += variable.data.len().next_multiple_of(4);
        }
        let mut out = header(&begins);
        for variable in &variables {
            out.extend_from_slice(&variable.data);
            out.resize(out.len().next_multiple_of(4), 0);
        }
        out
    }

    /// Write a netCDF-4 file.
    fn hdf5(&self, path: &Path) {
        use hdf5_metno::types::FixedAscii;
        let file = hdf5_metno::File::create(path).unwrap();
        for (name, shape, values) in &self.reals {
            let dataset = file
                .new_dataset::<f64>()
                .shape(shape.clone())
                .create(*name)
                .unwrap();
            dataset.write_raw(values).unwrap();
        }
        for (name, shape, values) in &self.integers {
            let dataset = file
                .new_dataset::<i32>()
                .shape(shape.clone())
                .create(*name)
                .unwrap();
            dataset.write_raw(values).unwrap();
            if name.starts_with("connect") {
                let attribute = dataset
                    .new_attr::<FixedAscii<8>>()
                    .create("elem_type")
                    .unwrap();
                attribute
                    .write_scalar(&FixedAscii::<8>::from_ascii(self.element).unwrap())
                    .unwrap();
            }
        }
        for (name, rows) in &self.texts {
            let dataset = file
                .new_dataset::<FixedAscii<1>>()
                .shape([rows.len(), NAME]);
            let dataset = dataset.create(*name).unwrap();
            let mut letters = Vec::new();
            for row in rows {
                let mut bytes = row.as_bytes().to_vec();
                bytes.resize(NAME, 0);
                letters.extend(
                    bytes
                        .iter()
                        .map(|byte| FixedAscii::<1>::from_ascii(&[*byte]).unwrap()),
                );
            }
            dataset.write_raw(&letters).unwrap();
        }
    }
}

#[test]
fn exodus_files_of_both_kinds_have_blocks_and_sets() {
    let folder = Folder::new("mesh-exodus");
    let classic = folder.write("classic.exo", &exodus().classic(1));
    let wide = folder.write("wide.g", &exodus().classic(2));
    let hdf5 = folder.join("hdf5.e");
    exodus().hdf5(&hdf5);
    for path in [classic, wide, hdf5] {
        let sets = ["first", "block_20", "right edge", "surface_4"];
        let problem = solid(&path, &sets);
        let found = points(&problem);
        assert_unit_cubes(&found, &[[0.5; 3], [1.5, 0.5, 0.5]]);
        for (set, expected) in sets.iter().zip([[0], [1], [1], [0]]) {
            assert_eq!(ids(&problem, set), expected, "{} {set}", path.display());
        }
    }
}

/// Three spheres in two blocks: a radius and the volume for each sphere.
fn spheres() -> Exodus {
    Exodus {
        element: "SPHERE",
        reals: vec![
            ("coordx", vec![3], vec![0.0, 0.5, 1.0]),
            ("coordy", vec![3], vec![0.0; 3]),
            ("coordz", vec![3], vec![0.25; 3]),
            ("attrib1", vec![2, 2], vec![0.5, 0.125, 0.6, 0.25]),
            ("attrib2", vec![1, 2], vec![0.7, 0.375]),
        ],
        integers: vec![
            ("eb_prop1", vec![2], vec![1, 2]),
            ("connect1", vec![2, 1], vec![1, 2]),
            ("connect2", vec![1, 1], vec![3]),
            ("ns_prop1", vec![1], vec![1]),
            ("node_ns1", vec![2], vec![2, 3]),
        ],
        texts: Vec::new(),
    }
}

#[test]
fn spheres_of_exodus_become_points_with_their_volume() {
    let folder = Folder::new("mesh-spheres");
    let mut named = spheres();
    // The name of an attribute takes precedence over its position.
    named
        .texts
        .push(("attrib_name1", vec!["SPHERE_VOLUME", "other"]));
    named.reals[3].2 = vec![0.125, 0.5, 0.25, 0.6];
    let named_path = folder.join("named.e");
    named.hdf5(&named_path);
    let classic = folder.write("classic.g", &spheres().classic(1));
    for path in [
        classic,
        folder.write("named.g", &named.classic(2)),
        named_path,
    ] {
        let problem = problem(&format!(
            "dimension = '3d'\ngrid.horizon = 2\nmaterial.a.pmb = {{ density = 1, youngs_modulus = 1 }}\n\
             time.end = 1\nset.nodes.mesh = 'nodelist_1'\nset.block.mesh = 'block_2'\n\
             [body.a]\nmaterial = 'a'\npoints = {{ mesh = '{0}', block = 'block_1', scale = 2 }}\n\
             [body.b]\nmaterial = 'a'\npoints = {{ mesh = '{0}', block = 2, scale = 2 }}\n",
            path.display()
        ));
        let expected = [
            ([0.0, 0.0, 0.5], 1.0, 0),
            ([1.0, 0.0, 0.5], 2.0, 0),
            ([2.0, 0.0, 0.5], 3.0, 1),
        ];
        assert_eq!(points(&problem), expected);
        assert_eq!(ids(&problem, "nodes"), [1, 2]);
        assert_eq!(ids(&problem, "block"), [2]);
    }
}

#[test]
fn spheres_without_a_volume_are_an_error() {
    let folder = Folder::new("mesh-no-volume");
    let comm = threads::alone();
    let need = "only single-node elements without a volume; sphere elements of an Exodus file need the volume as an \
                attribute with the name `volume`, or as their second attribute";
    let mut bare = spheres();
    bare.reals.truncate(3);
    let mut radius = spheres();
    radius.texts.push(("attrib_name1", vec!["radius", "mass"]));
    radius.texts.push(("attrib_name2", vec!["radius", "mass"]));
    for written in [bare, radius] {
        let path = folder.write("bare.e", &written.classic(1));
        let error = generate(&solid(&path, &[]), &comm).unwrap_err().message;
        assert_eq!(error, format!("[body.a] points mesh: the mesh has {need}"));
        let deck = format!(
            "dimension = '3d'\ngrid.horizon = 2\nmaterial.a.pmb = {{ density = 1, youngs_modulus = 1 }}\n\
             time.end = 1\n[body.a]\nmaterial = 'a'\npoints = {{ mesh = '{0}', block = 'block_1' }}\n",
            path.display()
        );
        let error = generate(&problem(&deck), &comm).unwrap_err().message;
        assert_eq!(
            error,
            format!("[body.a] points block: `block_1` has {need}")
        );
    }
    // Spheres without volumes are an error even if another block has elements with volumes.
    let mut mixed = spheres();
    mixed.reals.truncate(4);
    let path = folder.write("mixed.e", &mixed.classic(1));
    let error = generate(&solid(&path, &[]), &comm).unwrap_err().message;
    assert_eq!(
        error,
        format!("[body.a] points mesh: block `block_2` has {need}")
    );
    let deck = |path: &Path, rest: &str, scale: f64| {
        problem(&format!(
            "dimension = '3d'\ngrid.horizon = 2\nmaterial.a.pmb = {{ density = 1, youngs_modulus = 1 }}\n\
             time.end = 1\n[body.a]\nmaterial = 'a'\n\
             points = {{ mesh = '{0}', block = 'block_1', scale = {scale:e} }}\n{rest}",
            path.display()
        ))
    };
    assert_eq!(points(&deck(&path, "", 1.0)).len(), 2);
    let rest = format!(
        "[body.b]\nmaterial = 'a'\npoints.mesh = '{}'\n",
        path.display()
    );
    let error = generate(&deck(&path, &rest, 1.0), &comm).unwrap_err();
    assert_eq!(
        error.message,
        format!("[body.b] points mesh: the rest of the mesh has {need}")
    );
    // A body without elements has another message if all spheres have volumes.
    let mut single = spheres();
    single.reals.truncate(4);
    single.integers.truncate(2);
    single.integers[0] = ("eb_prop1", vec![1], vec![1]);
    single.reals[..3]
        .iter_mut()
        .for_each(|(_, lengths, values)| {
            *lengths = vec![2];
            values.truncate(2);
        });
    let path = folder.write("single.e", &single.classic(1));
    let rest = format!(
        "[body.b]\nmaterial = 'a'\npoints.mesh = '{}'\n",
        path.display()
    );
    let error = generate(&deck(&path, &rest, 1.0), &comm).unwrap_err();
    assert!(
        error.message.starts_with("[body.b]: has no points"),
        "{error}"
    );
    // The scale makes the volume too small or too large for a number.
    for (written, scale, volume) in [(1e-300, 1e-10, "0e0"), (1e300, 1e10, "inf")] {
        single.reals[3].2[1] = written;
        let path = folder.write("extreme.e", &single.classic(1));
        let error = generate(&deck(&path, "", scale), &comm).unwrap_err();
        let expected = format!("element 1 (point): has the volume {volume} m³, must be above 0");
        assert!(error.message.ends_with(&expected), "{error}");
    }
    for rows in [1, 3] {
        let mut odd = spheres();
        odd.reals[3] = ("attrib1", vec![rows, 2], vec![0.5; 2 * rows]);
        assert_eq!(
            parse("a.exo", odd.classic(1)).unwrap_err(),
            format!("a.exo: attrib1: has {rows} rows, the block has 2 elements")
        );
    }
    let mut flat = spheres();
    flat.reals[3].2[3] = 0.0;
    assert_eq!(
        parse("a.exo", flat.classic(1)).unwrap_err(),
        "a.exo: block block_1: the volume of sphere 2 of the block is 0e0, must be above 0"
    );
}

#[test]
fn damaged_exodus_files_have_their_message() {
    let folder = Folder::new("mesh-damaged-exodus");
    let mut damaged = exodus();
    damaged.integers[1].2[3] = 99;
    let bytes = damaged.classic(1);
    assert_eq!(
        parse("a.exo", &bytes).unwrap_err(),
        "a.exo: element 101: there is no node 99"
    );
    let bytes = exodus().classic(1);
    assert_eq!(
        parse("a.exo", &bytes[..bytes.len() - 80]).unwrap_err(),
        "a.exo: variable eb_names: is longer than the file"
    );
    assert_eq!(
        parse("a.exo", b"CDF\x09").unwrap_err(),
        "a.exo: is a netCDF file of the unknown version 9"
    );
    assert_eq!(
        parse("a.exo", b"CDX").unwrap_err(),
        "a.exo: is neither a netCDF nor an HDF5 file"
    );
    let mut damaged = exodus();
    damaged.integers[5].2[0] = 13;
    let path = folder.join("set.e");
    damaged.hdf5(&path);
    let error = parse(path.to_str().unwrap(), std::fs::read(&path).unwrap()).unwrap_err();
    assert!(
        error.ends_with("set.e: set right edge: there is no node 13"),
        "{error}"
    );
}

#[test]
fn damaged_classic_exodus_files_are_errors() {
    survives_mutants("two.exo", &exodus().classic(1), 21);
    survives_mutants("two.exo", &exodus().classic(2), 22);
    survives_mutants("spheres.exo", &spheres().classic(1), 23);
}
