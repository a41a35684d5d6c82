//! Import of decks of other codes: translated values, keys that are left out, invalid decks, and mutated
//! decks.

use fissure::comm::threads;
use fissure::deck::{Deck, Source};
use fissure::import::log::Fate;
use fissure::import::{Code, Import, translate};
use fissure::points::{generate, set};
use fissure::problem::Problem;
use fissure::solver::Simulation;
use fissure::survey::dry_run;
use nalgebra::{Rotation3, Vector3};

use super::meshes::exodus_of_first_cube;
use crate::support::{command, displace, force};

/// A temporary folder of decks and their files, removed when dropped.
struct Folder(command::Folder);

impl Folder {
    fn new(name: &str) -> Self {
        Self(command::Folder::new(&format!("import-{name}")))
    }

    /// Create a folder with the points and the node set of [`STRIP`].
    fn strip(name: &str) -> Self {
        let folder = Self::new(name);
        folder.write(
            "strip.txt",
            "# a strip\n\nheader: x y block_id volume\n0 0 1 0.5\n1 0 1 0.5\n",
        );
        folder.write("ends.txt", "header: global_id\n1\n2\n");
        folder
    }

    fn write(&self, name: &str, text: &str) {
        self.0.write(name, text);
    }

    fn write_bytes(&self, name: &str, bytes: &[u8]) {
        self.0.write(name, bytes);
    }

    /// Import a deck of this folder into the same folder.
    fn import(&self, name: &str, text: &str) -> Result<Import, String> {
        let source = Source::new(self.0.join(name), text);
        let place = format!("{}/", self.0.0.display());
        let imported = translate(&source, None, &self.0.join("new.toml"));
        imported.map_err(|error| error.message.replace(&place, ""))
    }

    /// Return the problem of an imported deck in this folder.
    fn problem(&self, imported: &Import) -> Problem {
        assert!(
            imported.fault.is_none(),
            "{:?}\n{}",
            imported.fault,
            imported.text
        );
        let source = Source::new(self.0.join("new.toml"), imported.text.clone());
        Deck::new(source).unwrap().problem().unwrap()
    }
}

/// Return the fate of a key and its note.
fn fate<'a>(imported: &'a Import, key: &str) -> (Fate, &'a str) {
    let entry = imported.entries.iter().find(|entry| entry.key == key);
    let entry = entry.unwrap_or_else(|| panic!("no {key} in {:#?}", imported.entries));
    (entry.fate, &entry.note)
}

fn with<const D: usize, T>(problem: &Problem, body: impl FnOnce(Simulation<D>) -> T) -> T {
    let comm = threads::alone();
    body(Simulation::new(problem, &comm).unwrap_or_else(|error| panic!("{error}")))
}

/// Two points that move towards each other.
const TWO_POINTS: &str = r#"
Peridigm:
  Discretization:
    Type: PdQuickGrid
    NeighborhoodType: Spherical
    TensorProduct3DMeshGenerator:
      Type: PdQuickGrid
      X Origin: -1.5
      Y Origin: -0.5
      Z Origin: -0.5
      X Length: 3.0
      Y Length: 1.0
      Z Length: 1.0
      Number Points X: 2
      Number Points Y: 1
      Number Points Z: 1
  Materials:
    Soft Solid:
      Material Model: "Elastic"
      Density: 1000.0
      Bulk Modulus: 12.0e6
      Shear Modulus: 5.0e6
      Apply Shear Correction Factor: false
  Blocks:
    All:
      Block Names: block_1
      Material: Soft Solid
      Horizon: 1.6
  Boundary Conditions:
    Left Node Set: "1"
    Right Node Set: "2"
    Spare Node Set: "1 2"
    Go Right:
      Type: Initial Velocity
      Node Set: Left Node Set
      Coordinate: x
      Value: "0.5"
    Go Left:
      Type: Initial Velocity
      Node Set: Right Node Set
      Coordinate: x
      Value: "value = -0.5"
  Solver:
    Verbose: false
    Initial Time: 0.0
    Final Time: 4.0e-3
    Enable Magic: true
    Verlet:
      Fixed dt: 2.0e-5
  Output:
    Output Filename: two_points
    Output Frequency: 10
    Output Variables:
      Displacement: true
      Force: true
      Proc_Num: false
      Radius: true
"#;

/// Two points with one bond of Peridigm's ordinary solid: the force state follows from dilatation and
/// deviatoric extension.
#[test]
fn two_points_of_peridigm_oscillate() {
    let folder = Folder::new("two-points");
    let imported = folder.import("two.yaml", TWO_POINTS).unwrap();
    assert_eq!(imported.code, Code::Peridigm);
    let problem = folder.problem(&imported);
    // One neighbour at x = 1.5 m with V = 1.5 m³: m = x² V, θ = 3 x e V/m = 3 e/x. The deviatoric extension e
    // − θ x/3 is 0, so the force state is 3 k θ x/m = 9 k e/m, and the acceleration of the extension −2·2·9 k
    // V/(m ρ) e.
    let (x, bulk, density) = (1.5_f64, 12e6, 1000.0);
    let frequency = (4.0 * 9.0 * bulk / (x * x * density)).sqrt();
    let end = 4e-3;
    let expected = -(1.0 / frequency) * (frequency * end).sin();
    let found = with::<3, _>(&problem, |mut simulation| {
        while simulation.clock.number() < simulation.clock.last() {
            simulation.advance();
        }
        let u = &simulation.fields.displacement[0];
        u[1] - u[0]
    });
    // At these small amplitudes the bond is linear. The step is 1/115 of a period.
    assert!(
        (found - expected).abs() < 2e-3 / frequency,
        "{found} {expected}"
    );

    let taken = |key: &str| fate(&imported, key).0;
    let materials = "Peridigm > Materials > Soft Solid";
    assert_eq!(taken(&format!("{materials} > Bulk Modulus")), Fate::Taken);
    assert_eq!(
        taken(&format!("{materials} > Apply Shear Correction Factor")),
        Fate::Taken
    );
    assert_eq!(
        fate(&imported, "Peridigm > Boundary Conditions > Spare Node Set"),
        (Fate::LeftOut, "nothing uses this node set")
    );
    let variables = "Peridigm > Output > Output Variables";
    assert_eq!(taken(&format!("{variables} > Force")), Fate::Approximated);
    assert_eq!(
        fate(&imported, &format!("{variables} > Radius")),
        (Fate::LeftOut, "there is no such field")
    );
    assert_eq!(
        fate(&imported, "Peridigm > Solver > Verbose"),
        (Fate::LeftOut, "concerns what the code prints")
    );
    assert_eq!(
        fate(&imported, "Peridigm > Solver > Enable Magic"),
        (Fate::LeftOut, "unknown, or without a counterpart")
    );
    // Every key has one fate, and the deck lists all of them.
    let values = TWO_POINTS
        .lines()
        .filter(|line| line.contains(": "))
        .count();
    assert_eq!(imported.entries.len(), values);
    let listed = imported
        .text
        .lines()
        .filter(|line| line.contains(" -> "))
        .count();
    assert_eq!(listed, values, "{}", imported.text);
}

/// A bar with two pre-cracks; its points come from a text file.
const BAR: &str = r#"<ParameterList>
  <ParameterList name="Discretization">
    <Parameter name="Type" type="string" value="Text File"/>
    <Parameter name="Input Mesh File" type="string" value="bar.txt"/>
    <ParameterList name="Bond Filters">
      <ParameterList name="Cut">
        <Parameter name="Type" type="string" value="Rectangular_Plane"/>
        <Parameter name="Normal_X" type="double" value="1.0"/>
        <Parameter name="Normal_Y" type="double" value="0.0"/>
        <Parameter name="Normal_Z" type="double" value="0.0"/>
        <Parameter name="Lower_Left_Corner_X" type="double" value="1.5"/>
        <Parameter name="Lower_Left_Corner_Y" type="double" value="-5.0"/>
        <Parameter name="Lower_Left_Corner_Z" type="double" value="5.0"/>
        <Parameter name="Bottom_Unit_Vector_X" type="double" value="0.0"/>
        <Parameter name="Bottom_Unit_Vector_Y" type="double" value="1.0"/>
        <Parameter name="Bottom_Unit_Vector_Z" type="double" value="0.0"/>
        <Parameter name="Bottom_Length" type="double" value="10.0"/>
        <Parameter name="Side_Length" type="double" value="10.0"/>
      </ParameterList>
    </ParameterList>
  </ParameterList>
  <ParameterList name="Materials">
    <ParameterList name="Steel">
      <Parameter name="Material Model" type="string" value="Elastic Correspondence"/>
      <Parameter name="Density" type="double" value="8.0"/>
      <Parameter name="Young's Modulus" type="double" value="2.0e12"/>
      <Parameter name="Poisson's Ratio" type="double" value="0.25"/>
      <Parameter name="Hourglass Coefficient" type="double" value="0.02"/>
    </ParameterList>
  </ParameterList>
  <ParameterList name="Damage Models">
    <ParameterList name="Stretch">
      <Parameter name="Damage Model" type="string" value="Critical Stretch"/>
      <Parameter name="Critical Stretch" type="double" value="0.01"/>
    </ParameterList>
  </ParameterList>
  <ParameterList name="Blocks">
    <ParameterList name="Ends">
      <Parameter name="Block Names" type="string" value="block_2"/>
      <Parameter name="Material" type="string" value="Steel"/>
      <Parameter name="Horizon" type="double" value="2.1"/>
    </ParameterList>
    <ParameterList name="Rest">
      <Parameter name="Block Names" type="string" value="default"/>
      <Parameter name="Material" type="string" value="Steel"/>
      <Parameter name="Damage Model" type="string" value="Stretch"/>
      <Parameter name="Horizon" type="double" value="2.1"/>
    </ParameterList>
  </ParameterList>
  <ParameterList name="Boundary Conditions">
    <Parameter name="Node Set One" type="string" value="set.txt"/>
    <ParameterList name="Pull">
      <Parameter name="Type" type="string" value="Prescribed Displacement"/>
      <Parameter name="Node Set" type="string" value="Node Set One"/>
      <Parameter name="Coordinate" type="string" value="x"/>
      <Parameter name="Value" type="string" value="if(t&lt;=1){value=x*1.0e-3*t;} else {value=x*1.0e-3;}"/>
    </ParameterList>
  </ParameterList>
  <ParameterList name="Solver1">
    <Parameter name="Initial Time" type="double" value="0.0"/>
    <Parameter name="Final Time" type="double" value="1.0"/>
    <ParameterList name="QuasiStatic">
      <Parameter name="Number of Load Steps" type="int" value="2"/>
      <Parameter name="Absolute Tolerance" type="double" value="1.0"/>
    </ParameterList>
  </ParameterList>
  <ParameterList name="Solver2">
    <Parameter name="Initial Time" type="double" value="1.0"/>
    <Parameter name="Final Time" type="double" value="2.0"/>
    <ParameterList name="Verlet">
      <Parameter name="Safety Factor" type="double" value="0.5"/>
    </ParameterList>
  </ParameterList>
</ParameterList>
"#;

/// Return a point file of Peridigm without a header: 4 × 2 × 2 points in two blocks.
fn bar_points() -> String {
    let mut text = "# x y z block volume\n".to_owned();
    for index in 0..16 {
        let (x, y, z) = (index % 4, index / 4 % 2, index / 8);
        let block = if x == 0 { 2 } else { 1 };
        text += &format!("{x}. {y}. {z}. {block} 0.5\n");
    }
    text
}

#[test]
fn an_xml_deck_of_peridigm_has_its_points_and_sets_from_files() {
    let folder = Folder::new("bar");
    folder.write("bar.txt", &bar_points());
    folder.write("set.txt", "# ends\n1 5\n9\n13\n");
    let imported = folder.import("bar.xml", BAR).unwrap();
    let problem = folder.problem(&imported);
    assert_eq!(problem.bodies.len(), 2);
    assert_eq!(problem.cracks.len(), 1);
    let found = dry_run(&problem, 1, false).unwrap();
    assert_eq!(found.points, 16);
    for line in [
        "[body.block_2]",
        "[body.block_1]",
        "columns = [\"x\", \"y\", \"z\", \"block\", \"volume\"]",
        "first_id = 1",
        "zero_energy = \"silling2017\"",
        "if(t <= 1, x*1.0e-3*t, x*1.0e-3)",
        "edge_b = [0.0, 0.0, -10.0]",
    ] {
        assert!(imported.text.contains(line), "{line}\n{}", imported.text);
    }
    // Bonds of a correspondence law break by work. Fracture energy: s0² δ (3 G + (3/4)⁴ (k − 5 G/3)), with k
    // = 5 G/3 for ν = 1/4.
    let energy = 0.01_f64.powi(2) * 2.1 * 3.0 * 0.8e12;
    let written = imported
        .text
        .lines()
        .find_map(|line| line.strip_prefix("fracture_energy = "));
    let written: f64 = written.unwrap().parse().unwrap();
    assert!((written / energy - 1.0).abs() < 1e-12, "{written} {energy}");
    let key = "Damage Models > Stretch > Critical Stretch";
    assert_eq!(fate(&imported, key).0, Fate::Approximated);
    assert_eq!(problem.stages.len(), 2);
    // The pre-crack between x = 1 and x = 2 cuts the bar: no bond crosses it.
    with::<3, _>(&problem, |mut simulation| {
        displace(&mut simulation, |[x, y, z]| {
            [if x > 1.5 { x + 0.01 } else { x }, y, z]
        });
        for point in 0..16 {
            let f = force(&simulation, point);
            assert!(f.iter().all(|f| f.abs() < 1e-3), "{f:?}");
        }
    });
}

/// A bond-based strip of PeriLab with a bond, a contact and a force.
const STRIP: &str = r#"
PeriLab:
  Discretization:
    Type: "Text File"
    Input Mesh File: "strip.txt"
    Node Sets:
      Left: 1
      Right: x>0.5
      Ends: ends.txt
  Models:
    Pre Calculation Global:
      Deformed Bond Geometry: true
    Material Models:
      Alu:
        Material Model: "Bond-based Elastic"
        Symmetry: "isotropic plane stress"
        Young's Modulus: 7.0e+4
        Poisson's Ratio: 0.34
    Damage Models:
      Tough:
        Damage Model: Critical Energy
        Critical Value: 12.5
    Thermal Models:
      Heat:
        Thermal Model: "Thermal Flow"
        Thermal Conductivity: 5.0
  Blocks:
    block_1:
      Block ID: 1
      Material Model: "Alu"
      Damage Model: Tough
      Density: 2.7e-9
      Horizon: 1.2
  Boundary Conditions:
    Hold:
      Variable: "Displacements"
      Node Set: "Left"
      Coordinate: "x"
      Value: 0
      Type: Dirichlet
    Push:
      Variable: "Forces"
      Node Set: "Ends"
      Coordinate: "y"
      Value: -3*t
      Type: Dirichlet
    Warm:
      Variable: "Temperature"
      Node Set: "Ends"
      Value: 20
      Type: Dirichlet
  Solver:
    Material Models: True
    Damage Models: True
    Initial Time: 0.0
    Final Time: 1.0e-6
    Verlet:
      Fixed dt: 1.0e-8
      Numerical Damping: 0.002
  Outputs:
    Output1:
      Output Filename: strip
      Output File Type: Exodus
      Number of Output Steps: 20
      Output Variables:
        Displacements: True
        Damage: True
        Temperature: True
"#;

/// PeriLab computes Young's modulus of bonds from one constant and a fixed Poisson's ratio: 1/3 in plane
/// stress and plane strain, 1/4 in 3-D.
#[test]
fn bonds_of_perilab_have_a_fixed_poisson_ratio() {
    let folder = Folder::strip("fixed-ratio");
    let given = "        Young's Modulus: 7.0e+4\n        Poisson's Ratio: 0.34\n";
    let with = |constants: &[(&str, f64)], model: &str, symmetry: &str| {
        let lines = constants.iter();
        let lines = lines.map(|(key, value)| format!("        {key}: {value}\n"));
        let deck = STRIP
            .replacen(given, &lines.collect::<String>(), 1)
            .replacen("Bond-based Elastic", model, 1)
            .replacen("plane stress", symmetry, 1);
        folder.import("fixed.yaml", &deck).unwrap()
    };
    let (k, g, e, nu) = (
        "Bulk Modulus",
        "Shear Modulus",
        "Young's Modulus",
        "Poisson's Ratio",
    );
    for (constants, young) in [
        (&[(k, 7e4)][..], 7e4),
        (&[(k, 7e4), (nu, 0.3)], 7e4),
        (&[(g, 3e4)], 8e4),
        (&[(g, 3e4), (nu, 0.25)], 8e4),
        (&[(k, 7e4), (g, 3e4)], 7e4),
        (&[(e, 5e4), (g, 3e4)], 8e4),
        (&[(e, 5e4), (k, 7e4)], 7e4),
        (&[(e, 5e4), (nu, 0.34)], 5e4),
    ] {
        for symmetry in ["plane stress", "plane strain"] {
            let imported = with(constants, "Bond-based Elastic", symmetry);
            folder.problem(&imported);
            let found = imported.text.lines();
            let mut found = found.filter_map(|line| line.strip_prefix("youngs_modulus = "));
            let found = found.next().and_then(|number| number.parse::<f64>().ok());
            assert_eq!(found, Some(young), "{constants:?}");
        }
    }
    let key = |name: &str| format!("PeriLab > Models > Material Models > Alu > {name}");
    let ignored = "PeriLab computes it from the other constants";
    let imported = with(&[(k, 7e4), (g, 3e4)], "Bond-based Elastic", "plane stress");
    let note = "youngs_modulus of the material, for a Poisson's ratio of 1/3";
    assert_eq!(fate(&imported, &key(k)), (Fate::Taken, note));
    assert_eq!(fate(&imported, &key(g)), (Fate::LeftOut, ignored));
    // In 3-D, E = 3 (1 − 2/4) K and E = 2 (1 + 1/4) G.
    folder.write(
        "strip.txt",
        "header: x y z block_id volume\n0 0 0 1 0.5\n1 0 0 1 0.5\n",
    );
    for (constant, young) in [(k, "105000.0"), (g, "175000.0")] {
        let imported = with(&[(constant, 7e4)], "Bond-based Elastic", "3D");
        let line = format!("youngs_modulus = {young}");
        assert!(imported.text.contains(&line), "{}", imported.text);
    }
    // Other laws have two constants: those of the highest precedence.
    let all = [(e, 5e4), (nu, 0.3), (k, 7e4), (g, 3e4)];
    let imported = with(&all, "PD Solid Elastic", "3D");
    let line = "bulk_modulus = 70000\npoisson_ratio = 0.3\n";
    assert!(imported.text.contains(line), "{}", imported.text);
    for constant in [e, g] {
        assert_eq!(fate(&imported, &key(constant)), (Fate::LeftOut, ignored));
    }
}

/// PeriLab calls no function that applies conditions of the type Neumann.
#[test]
fn conditions_of_perilab_of_the_type_neumann_have_no_effect() {
    let folder = Folder::strip("neumann");
    let line = 1 + STRIP[..STRIP.find("    Hold:").unwrap()]
        .matches('\n')
        .count();
    let of_type = |kind: &str| {
        let text = STRIP.replacen(
            "Value: 0\n      Type: Dirichlet",
            &format!("Value: 0\n      Type: {kind}"),
            1,
        );
        folder.import("strip.yaml", &text).unwrap()
    };
    let imported = of_type("Neumann");
    let note = "PeriLab applies no condition of the type Neumann";
    let key = "PeriLab > Boundary Conditions > Hold";
    assert_eq!(fate(&imported, key), (Fate::LeftOut, note));
    assert!(imported.losses().conditions.contains(&line));
    assert!(
        !imported.text.contains("[condition.hold]\nset"),
        "{}",
        imported.text
    );
    // An unknown type is one of Dirichlet.
    let imported = of_type("neumann");
    assert_eq!(
        fate(&imported, &format!("{key} > Type")).0,
        Fate::Approximated
    );
    assert!(
        imported.text.contains("[condition.hold]\nset"),
        "{}",
        imported.text
    );
}

/// PeriLab drops the numbers of a node set above that of the last point.
#[test]
fn numbers_of_perilab_without_a_point_are_dropped() {
    let folder = Folder::strip("dropped");
    folder.write("ends.txt", "header: global_id\n1\n2\n3\n9\n");
    let text = STRIP.replacen("Left: 1\n", "Left: 1 7\n", 1);
    let imported = folder.import("strip.yaml", &text).unwrap();
    folder.problem(&imported);
    for line in [
        "[set.left]\nids = [0]\n",
        "[set.ends]\nids = [0, 1]\n",
        "force = [0, \"2*(-3*t)\"]",
    ] {
        assert!(imported.text.contains(line), "{line}\n{}", imported.text);
    }
    assert_eq!(imported.losses().dropped_numbers, [7, 9]);
    let warning =
        "PeriLab drops the numbers of this node set above the number of the last point: line 7";
    assert!(
        imported.losses().to_string().contains(warning),
        "{}",
        imported.losses()
    );
    let text = STRIP.replacen("Left: 1\n", "Left: 3 4\n", 1);
    let error = folder.import("strip.yaml", &text).unwrap_err();
    let message =
        "strip.yaml:7:7: `Left`: all its numbers are above 2, the number of the last point";
    assert_eq!(error.lines().next(), Some(message));
}

/// PeriLab uses constants of 3-D for a plane material without `Symmetry`. The import assumes plane stress,
/// and a warning says so.
#[test]
fn a_plane_material_of_perilab_without_symmetry_is_named() {
    let folder = Folder::strip("symmetry");
    let symmetry = "        Symmetry: \"isotropic plane stress\"\n";
    let imported = (folder.import("bare.yaml", &STRIP.replacen(symmetry, "", 1))).unwrap();
    let (fate, note) = fate(&imported, "PeriLab > Models > Material Models > Alu");
    assert_eq!(fate, Fate::Approximated);
    assert!(
        note.contains("no `Symmetry`: dimension = \"plane-stress\""),
        "{note}"
    );
    let consequences = imported.losses().consequences;
    let [(note, 14)] = consequences[..] else {
        panic!("{consequences:?}")
    };
    assert!(note.contains("constants of 3-D"), "{note}");
}

/// Contact of PeriLab: one force density 9 κ/(π δ⁵) (R − r) V for each pair of points, with the horizon δ of
/// the slave block, or 9 κ/(π δ³) or 48 κ/(5 π δ³) with `Symmetry`. The new deck has the same spring
/// constants: 18 S/(π δ⁵) in 3-D, 9 S/(π δ⁴) in plane stress and 72 S/(5 π δ⁴) in plane strain, with the
/// `stiffness` S and the smaller horizon δ.
#[test]
fn contact_of_perilab_has_its_spring_constant() {
    let folder = Folder::strip("contact");
    let write = |header: &str, row: &str| {
        let gap = |x: f64, block: u32| format!("{x} {row} {block} 0.5\n");
        let text = format!(
            "header: x {header} block_id volume\n{}{}{}{}",
            gap(0.0, 1),
            gap(1.0, 1),
            gap(2.0, 2),
            gap(3.0, 2)
        );
        folder.write("strip.txt", &text);
    };
    let with_contact = |keys: &str, symmetry: &str, horizon: f64| {
        let contact = format!(
            "  Contact:\n    Sides:\n      Type: Penalty Contact\n{keys}      Contact Groups:\n        Both:\n          \
             Master Block ID: 2\n          Slave Block ID: 1\n          Search Radius: 1\n  Blocks:\n"
        );
        let second = format!(
            "    block_2:\n      Block ID: 2\n      Material Model: Alu\n      Density: 2.7e-9\n      Horizon: {horizon}\n  \
             Boundary Conditions:\n"
        );
        let text = STRIP
            .replacen("  Blocks:\n", &contact, 1)
            .replacen("  Boundary Conditions:\n", &second, 1)
            .replacen("Horizon: 1.2\n", "Horizon: 1.5\n", 1)
            .replacen("isotropic plane stress", symmetry, 1);
        let imported = folder.import("contact.yaml", &text).unwrap();
        folder.problem(&imported);
        let mut lines = imported.text.lines();
        let stiffness = lines.find_map(|line| line.strip_prefix("stiffness = "));
        let stiffness = stiffness.unwrap().parse::<f64>().unwrap();
        (imported, stiffness)
    };
    let given = "      Contact Radius: 0.5\n      Contact Stiffness: 4e3\n";
    let close = |found: f64, expected: f64| {
        assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
    };
    write("y", "0");
    for (symmetry, of_contact, expected) in [
        ("plane stress", "", 4e3 / 1.5),
        ("plane stress", "plane stress", 4e3 * 1.5),
        ("plane strain", "", 0.625 * 4e3 / 1.5),
        ("plane strain", "plane strain", 4e3 * 1.5 / 1.5),
    ] {
        let keys = match of_contact {
            "" => given.to_owned(),
            of_contact => format!("{given}      Symmetry: {of_contact}\n"),
        };
        let (imported, stiffness) = with_contact(&keys, symmetry, 1.5);
        close(stiffness, expected);
        let losses = imported.losses();
        assert!(losses.consequences.is_empty(), "{losses}");
    }
    // PeriLab's default stiffness, and points that start closer than the radius.
    let (imported, stiffness) = with_contact("      Contact Radius: 1.1\n", "plane stress", 1.5);
    close(stiffness, 1e8 / 1.5);
    let warning = imported.losses().to_string();
    let note = "at most 0.9 of the distance at the start: line ";
    assert!(warning.contains(note), "{warning}");
    write("y z", "0 0");
    let (_, stiffness) = with_contact(given, "3D", 1.5);
    close(stiffness, 4e3 / 2.0);
    // The formula of PeriLab contains the horizon of the slave block, that of Fissure the smaller one.
    let (_, stiffness) = with_contact(given, "3D", 1.2);
    close(stiffness, 4e3 / 2.0 * (1.2_f64 / 1.5).powi(5));
}

/// PeriLab takes C:E as the Cauchy stress, and doubles or halves the shear stress for some symmetries.
#[test]
fn correspondence_of_perilab_has_its_cauchy_stress() {
    let folder = Folder::strip("cauchy");
    let given = "        Young's Modulus: 7.0e+4\n        Poisson's Ratio: 0.34\n";
    let with_keys = |symmetry: &str, keys: &str| {
        let text = STRIP
            .replacen("Bond-based Elastic", "Correspondence Elastic", 1)
            .replacen("isotropic plane stress", symmetry, 1)
            .replacen(given, keys, 1);
        let imported = folder.import("cauchy.yaml", &text).unwrap();
        folder.problem(&imported);
        let has_stress = imported.text.contains("\nstress = \"willberg2022\"\n");
        let consequences = imported.losses().consequences;
        let notes: Vec<&str> = consequences.iter().map(|(note, _)| *note).collect();
        (has_stress, notes.join(" "))
    };
    let associated = format!("{given}        Bond Associated: true\n");
    let (has_stress, notes) = with_keys("isotropic plane stress", given);
    assert!(has_stress && notes.is_empty(), "{notes}");
    let (has_stress, notes) = with_keys("isotropic plane stress", &associated);
    assert!(has_stress && notes.contains("halves"), "{notes}");
    // Bodies that yield need the default stress.
    let yields = format!("{given}        Yield Stress: 5\n");
    assert!(!with_keys("isotropic plane stress", &yields).0);
    folder.write(
        "strip.txt",
        "header: x y z block_id volume\n0 0 0 1 0.5\n1 0 0 1 0.5\n",
    );
    let (has_stress, notes) = with_keys("isotropic", given);
    assert!(has_stress && notes.contains("doubles"), "{notes}");
    let (has_stress, notes) = with_keys("isotropic", &associated);
    assert!(has_stress && notes.is_empty(), "{notes}");
}

/// PeriLab's transversely isotropic solid: y and z are equivalent.
#[test]
fn transverse_isotropy_of_perilab_is_orthotropic() {
    let folder = Folder::strip("transverse");
    let given = "        Young's Modulus: 7.0e+4\n        Poisson's Ratio: 0.34\n";
    let constants = "        Young's Modulus X: 135\n        Young's Modulus Y: 9\n        Poisson's Ratio XY: 0.27\n        \
                     Poisson's Ratio YZ: 0.4\n        Shear Modulus XY: 4.5\n        Shear Modulus YZ: 3\n";
    let with_points = |points: &str, symmetry: &str| {
        folder.write("strip.txt", points);
        let text = STRIP
            .replacen("Bond-based Elastic", "Correspondence Elastic", 1)
            .replacen("isotropic plane stress", symmetry, 1)
            .replacen(given, constants, 1);
        let imported = folder.import("transverse.yaml", &text).unwrap();
        folder.problem(&imported);
        imported
    };
    let solid = "header: x y z block_id volume\n0 0 0 1 0.5\n1 0 0 1 0.5\n";
    let plane = "header: x y block_id volume\n0 0 1 0.5\n1 0 1 0.5\n";
    for (points, symmetry) in [
        (solid, "transverse isotropic"),
        (plane, "transverse isotropic plane strain"),
    ] {
        let imported = with_points(points, symmetry);
        for line in [
            "youngs_modulus_z = 9\n",
            "poisson_ratio_xz = 0.27\n",
            "shear_modulus_xz = 4.5\n",
            "shear_modulus_yz = 3\n",
        ] {
            assert!(imported.text.contains(line), "{line}\n{}", imported.text);
        }
        // The modulus differs from E_y/(2 (1 + ν_yz)) = 3.2.
        let key = "PeriLab > Models > Material Models > Alu > Shear Modulus YZ";
        assert_eq!(fate(&imported, key).0, Fate::Approximated);
    }
    let imported = with_points(plane, "transverse isotropic plane stress");
    assert!(
        !imported.text.contains("\nshear_modulus_yz"),
        "{}",
        imported.text
    );
}

/// Corrections and damping of PeriLab that the new deck lacks are named in a warning.
#[test]
fn corrections_of_perilab_without_a_counterpart_are_losses() {
    let folder = Folder::strip("corrections");
    let text = STRIP
        .replacen(
            "  Blocks:\n",
            "  Surface Correction:\n    Type: Volume Correction\n  Blocks:\n",
            1,
        )
        .replacen(
            "Critical Value: 12.5\n",
            "Critical Value: 12.5\n        Local Damping:\n          Damping coefficient: 0.9\n",
            1,
        );
    let imported = folder.import("strip.yaml", &text).unwrap();
    folder.problem(&imported);
    let consequences = imported.losses().consequences;
    let lines: Vec<usize> = consequences.iter().map(|(_, line)| *line).collect();
    assert_eq!(lines, [23, 29], "{consequences:?}");
    let linear = STRIP.replacen("    Verlet:\n", "    Linear Static Matrix Based:\n", 1);
    let imported = folder.import("strip.yaml", &linear).unwrap();
    let (fate, note) = fate(&imported, "PeriLab > Solver > Linear Static Matrix Based");
    assert_eq!(fate, Fate::Approximated);
    assert!(note.contains("linear in the displacements"), "{note}");
}

#[test]
fn a_bond_of_perilab_has_its_micromodulus() {
    let folder = Folder::strip("strip");
    let imported = folder.import("strip.yaml", STRIP).unwrap();
    assert_eq!(imported.code, Code::PeriLab);
    let problem = folder.problem(&imported);
    // Force density c s V of the only bond, with c = 9 E/(π δ³ h).
    let stretch = 1e-6;
    let expected = 9.0 * 7e4 / (std::f64::consts::PI * 1.2_f64.powi(3)) * stretch * 0.5;
    with::<2, _>(&problem, |mut simulation| {
        displace(&mut simulation, |[x, y, z]| [x * (1.0 + stretch), y, z]);
        let [f, _] = force(&simulation, 0);
        assert!((f / expected - 1.0).abs() < 1e-6, "{f} {expected}");
    });
    for line in [
        "dimension = \"plane-stress\"",
        "calibration = \"perilab\"",
        "damping = 200000.0",
        "force = [0, \"2*(-3*t)\"]",
        "where = \"x > 0.5\"",
    ] {
        let expected = line != "where = \"x > 0.5\"";
        assert_eq!(
            imported.text.contains(line),
            expected,
            "{line}\n{}",
            imported.text
        );
    }
    let key = |name: &str| fate(&imported, &format!("PeriLab > {name}")).0;
    assert_eq!(
        key("Models > Material Models > Alu > Poisson's Ratio"),
        Fate::Approximated
    );
    assert_eq!(key("Models > Thermal Models"), Fate::LeftOut);
    assert_eq!(key("Boundary Conditions > Warm"), Fate::LeftOut);
    // A table that is left out has one line in the list.
    let mut keys = imported.entries.iter().map(|entry| entry.key.as_str());
    assert!(!keys.any(|key| key.contains("Warm > ") || key.contains("Heat")));
    assert_eq!(
        key("Boundary Conditions > Push > Value"),
        Fate::Approximated
    );
    assert_eq!(
        key("Outputs > Output1 > Number of Output Steps"),
        Fate::Taken
    );
}

/// Impact of a sphere on a disc, in LAMMPS.
const DISC: &str = "# a disc
units           si
boundary        s s s
atom_style      peri
atom_modify     map array
neighbor        0.002 bin
variable        a equal 0.001
lattice         sc $a
region          target cylinder y 0.0 0.0 $(10*v_a) -0.010 0.0 units box
create_box      1 target
create_atoms    1 region target
pair_style      peri/pmb
pair_coeff      * * 1.0e21 0.0030003 0.001 0.25
set             group all density 2000
set             group all volume 1e-9
velocity        all set 0.0 0.0 0.0 sum no units box
fix             1 all nve
variable        y0 equal 0.004
variable        vy equal -50
variable        y equal \"v_y0 + step*dt*v_vy\"
fix             2 all indent 1e17 sphere 0.0 v_y 0.0 &
                0.003 units box
compute         1 all damage/atom
timestep        1.0e-7
thermo          100
dump            1 all custom 50 dump.peri id type x y z c_1
fix             3 all deform 1 x scale 2
run             200
";

/// The lattice of the LAMMPS example. The log of LAMMPS counts 3487 atoms and 335 966 bonds, each at both
/// ends.
#[test]
fn a_lattice_of_lammps_has_its_atoms_and_bonds() {
    let folder = Folder::new("disc");
    let imported = folder.import("in.disc", DISC).unwrap();
    assert_eq!(imported.code, Code::Lammps);
    let problem = folder.problem(&imported);
    let found = dry_run(&problem, 1, false).unwrap();
    assert_eq!(found.points, 3487);
    assert_eq!(2 * found.bonds, 335_966);
    assert_eq!(found.steps, [(1e-7, 200.0)]);
    for line in [
        "origin = [-0.0005, -0.0005, -0.0005]",
        "motion = [0, \"0.004+t*(-50) - (0.004)\", 0]",
        "alpha = 0.25",
        "every_steps = 50",
    ] {
        assert!(imported.text.contains(line), "{line}\n{}", imported.text);
    }
    assert_eq!(imported.entries.len(), DISC.lines().count() - 2);
    let deform = imported
        .entries
        .iter()
        .find(|entry| entry.value.contains("deform"));
    assert_eq!(deform.map(|entry| entry.fate), Some(Fate::LeftOut));
}

#[test]
fn a_bond_of_lammps_has_its_force() {
    let folder = Folder::new("pair");
    // A bond of length 2. If the neighbour is within half a spacing of the horizon δ, its volume has the
    // factor 1 + (δ − 1 − 2)/2 (`vfrac_scale` of `pair_peri_pmb`).
    for (horizon, share) in [(3.5, 1.0), (2.5, 0.75)] {
        let pair = format!(
            "units si\nboundary s s s\natom_style peri\nlattice sc 2.0\nregion r block 0 1 0 0 0 0\n\
             create_box 1 r\ncreate_atoms 1 region r\npair_style peri/pmb\npair_coeff * * 3.0e4 {horizon} 0.1 0.0\n\
             set type 1 density 5 volume 8\ntimestep 1e-6\nrun 1\n"
        );
        let imported = folder.import("in.pair", &pair).unwrap();
        let problem = folder.problem(&imported);
        let stretch = 1e-6;
        with::<3, _>(&problem, |mut simulation| {
            displace(&mut simulation, |[x, y, z]| [x * (1.0 + stretch), y, z]);
            let [f, ..] = force(&simulation, 0);
            let expected = share * 3.0e4 * stretch * 8.0;
            assert!((f / expected - 1.0).abs() < 1e-6, "{f} {expected}");
        });
    }
}

/// `lps` and `ves` have the influence function 1/|ξ|. The plastic law of Fissure has only the influence
/// function 1, and the log says so.
#[test]
fn state_based_laws_of_lammps_have_their_influence_function() {
    let folder = Folder::new("influence");
    for (style, more, inverse) in [
        ("lps", "", true),
        ("ves", " 0.5 1.0", true),
        ("eps", " 1e6", false),
    ] {
        let script = format!(
            "units si\nboundary s s s\natom_style peri\nlattice sc 2.0\nregion r block 0 1 0 1 0 1\n\
             create_box 1 r\ncreate_atoms 1 region r\npair_style peri/{style}\n\
             pair_coeff * * 3.0e4 2.0e4 5.0 0.1 0.0{more}\nset type 1 density 5 volume 8\ntimestep 1e-6\nrun 1\n"
        );
        let imported = folder.import("in.influence", &script).unwrap();
        assert_eq!(
            imported.text.contains("influence = \"inverse\""),
            inverse,
            "{style}"
        );
        let said = imported
            .entries
            .iter()
            .any(|entry| entry.note.contains("influence function is 1"));
        assert_eq!(said, !inverse, "{style}");
    }
}

/// Return a deck of Peridigm with two blocks from a text file and these interactions.
fn with_contact(interactions: &str) -> String {
    BAR.replacen(
        "</ParameterList>\n  <ParameterList name=\"Solver1\">",
        &format!(
            r#"</ParameterList>
  <ParameterList name="Contact">
    <ParameterList name="Models">
      <ParameterList name="Soft">
        <Parameter name="Contact Model" type="string" value="Short Range Force"/>
        <Parameter name="Contact Radius" type="double" value="0.5"/>
        <Parameter name="Spring Constant" type="double" value="1e12"/>
      </ParameterList>
    </ParameterList>
    <ParameterList name="Interactions">
      {interactions}
    </ParameterList>
  </ParameterList>
  <ParameterList name="Solver1">"#
        ),
        1,
    )
}

/// General contact acts between different blocks only. With contact, a quasi-static solver becomes a
/// relaxation.
#[test]
fn general_contact_of_peridigm_leaves_a_block_alone() {
    let folder = Folder::new("general-contact");
    folder.write("bar.txt", &bar_points());
    folder.write("set.txt", "1\n5\n9\n13\n");
    let interaction = |name: &str| {
        format!(
            "<ParameterList name=\"{name}\"><Parameter name=\"Contact Model\" type=\"string\" value=\"Soft\"/></ParameterList>"
        )
    };
    let general = interaction("General Contact");
    let both = general.clone() + &interaction("Self Contact");
    for (interactions, off) in [(general, 2), (both, 0)] {
        let imported = folder
            .import("bar.xml", &with_contact(&interactions))
            .unwrap();
        folder.problem(&imported);
        let count = imported.text.matches("model = \"none\"").count();
        assert_eq!(count, off, "{}", imported.text);
        assert!(
            imported
                .text
                .contains("bodies = [\"block_1\", \"block_1\"]")
        );
        assert!(imported.text.contains("method = \"relaxation\""));
    }
    let imported = folder.import("bar.xml", BAR).unwrap();
    assert!(
        imported
            .text
            .contains("method = \"static\"\nstatic = { load_steps = 2 }"),
        "{}",
        imported.text
    );
}

/// A bottom unit vector at 45° to the plane is projected onto the plane, and both lengths grow by √2.
#[test]
fn a_slanted_bond_filter_cuts_as_in_peridigm() {
    let folder = Folder::new("slanted");
    folder.write("bar.txt", &bar_points());
    folder.write("set.txt", "1\n");
    let text = BAR.replacen(
        "Bottom_Unit_Vector_X\" type=\"double\" value=\"0.0\"",
        "Bottom_Unit_Vector_X\" type=\"double\" value=\"1.0\"",
        1,
    );
    let imported = folder.import("bar.xml", &text).unwrap();
    folder.problem(&imported);
    let key = "Discretization > Bond Filters > Cut > Type";
    assert_eq!(fate(&imported, key).0, Fate::Approximated);
    let numbers = |key: &str| -> Vec<f64> {
        let line = imported
            .text
            .lines()
            .find_map(|line| line.strip_prefix(key));
        let list = line
            .unwrap()
            .trim_start_matches(" = [")
            .trim_end_matches(']');
        list.split(", ").map(|word| word.parse().unwrap()).collect()
    };
    let long = 10.0 * 2.0_f64.sqrt();
    for (found, expected) in [
        (numbers("edge_a"), [0.0, long, 0.0]),
        (numbers("edge_b"), [0.0, 0.0, -long]),
    ] {
        let near = found
            .iter()
            .zip(expected)
            .all(|(f, e)| (f - e).abs() < 1e-12);
        assert!(near, "{found:?} {expected:?}");
    }
    // A vector along the normal has no projection.
    let text = text.replacen(
        "Bottom_Unit_Vector_Y\" type=\"double\" value=\"1.0\"",
        "Bottom_Unit_Vector_Y\" type=\"double\" value=\"0.0\"",
        1,
    );
    let imported = folder.import("bar.xml", &text).unwrap();
    assert!(!imported.text.contains("[crack."));
}

/// Prescribed temperatures of Peridigm: materials expand relative to the initial temperature.
#[test]
fn temperatures_of_peridigm_count_from_the_start() {
    let folder = Folder::new("warm");
    let warm = |expansion: &str, values: &[&str]| {
        let mut conditions = String::new();
        for (index, value) in values.iter().enumerate() {
            conditions += &format!(
                "    Warm {index}:\n      Type: Prescribed Temperature\n      Node Set: Spare Node Set\n      Value: \"{value}\"\n"
            );
        }
        let text = TWO_POINTS
            .replacen("    Go Right:\n", &(conditions + "    Go Right:\n"), 1)
            .replacen(
                "      Density: 1000.0\n",
                &format!("      Density: 1000.0\n{expansion}"),
                1,
            )
            .replacen("Radius: true", "Temperature: true", 1);
        folder.import("two.yaml", &text).unwrap()
    };
    let expands = "      Thermal Expansion Coefficient: 1.0e-5\n";
    let imported = warm(expands, &["273.0+1000.0*t"]);
    folder.problem(&imported);
    for line in [
        "thermal_expansion = 1.0e-5",
        "reference_temperature = 273.0",
        "temperature = \"273.0+1000.0*t\"",
        "\"temperature\"",
    ] {
        let plain = imported.text.replace(" + ", "+");
        assert!(plain.contains(line), "{line}\n{}", imported.text);
    }
    assert!(imported.losses().is_empty());
    // If initial temperatures differ, each point expands relative to its own initial temperature.
    let imported = warm(expands, &["x*t + 5*x"]);
    folder.problem(&imported);
    assert!(!imported.text.contains("reference_temperature"));
    assert!(imported.text.contains(") - ("), "{}", imported.text);
    // Without thermal expansion, temperatures have no effect.
    let imported = warm("", &["20*t"]);
    folder.problem(&imported);
    assert!(!imported.text.contains("temperature = "));
    assert_eq!(imported.losses().conditions, [33]);
    assert!(imported.losses().damages.is_empty());
    assert_eq!(
        imported.losses().to_string(),
        "1 load or support is left out: line 33"
    );
}

/// Materials of PeriLab expand if the solver enables thermal models.
#[test]
fn materials_of_perilab_expand() {
    let folder = Folder::strip("expansion");
    let text = STRIP
        .replacen("Thermal Flow", "Thermal Expansion", 1)
        .replacen(
            "Thermal Conductivity: 5.0",
            "Thermal Expansion Coefficient: 2.5e-2\n        Reference Temperature: 4.0",
            1,
        )
        .replacen(
            "      Damage Model: Tough\n",
            "      Thermal Model: Heat\n",
            1,
        );
    let off = folder.import("strip.yaml", &text).unwrap();
    folder.problem(&off);
    assert!(!off.text.contains("thermal_expansion = "));
    let text = text.replacen(
        "    Material Models: True",
        "    Material Models: True\n    Thermal Models: True",
        1,
    );
    let on = folder.import("strip.yaml", &text).unwrap();
    folder.problem(&on);
    for line in [
        "thermal_expansion = 2.5e-2",
        "reference_temperature = 4.0",
        "temperature = 20",
    ] {
        assert!(on.text.contains(line), "{line}\n{}", on.text);
    }
}

/// Return a deck of PeriLab with a mesh and blocks of these numbers.
fn perilab_mesh(kind: &str, file: &str, blocks: &[u32]) -> String {
    let block = |id: &u32| {
        format!(
            "    block_{id}:\n      Block ID: {id}\n      Material Model: Alu\n      Density: 1\n      Horizon: 1.2\n"
        )
    };
    let blocks: String = blocks.iter().map(block).collect();
    format!(
        "PeriLab:
  Discretization:
    Type: {kind}
    Input Mesh File: {file}
  Models:
    Material Models:
      Alu:
        Material Model: PD Solid Elastic
        Young's Modulus: 7.0e+4
        Poisson's Ratio: 0.34
  Blocks:
{blocks}  Boundary Conditions:
    Pull:
      Variable: Displacements
      Node Set: First
      Coordinate: x
      Value: 2*t
  Solver:
    Initial Time: 0.0
    Final Time: 1.0e-6
    Verlet:
      Safety Factor: 1.0
"
    )
}

/// Blocks and node sets of an Abaqus mesh are element sets in PeriLab. The set of the condition is the last
/// block.
#[test]
fn blocks_of_perilab_are_element_sets_of_abaqus() {
    let folder = Folder::new("abaqus");
    let mut nodes = String::new();
    for x in 0..4 {
        for (k, (y, z)) in [(0, 0), (1, 0), (1, 1), (0, 1)].iter().enumerate() {
            nodes += &format!("{}, {x}., {y}., {z}.\n", 4 * x + k + 1);
        }
    }
    let mut elements = String::new();
    for element in 0..3 {
        let corners =
            [1, 2, 3, 4, 5, 6, 7, 8].map(|corner: usize| (corner + 4 * element).to_string());
        elements += &format!("{}, {}\n", element + 1, corners.join(", "));
    }
    let mesh = format!(
        "*Instance, name=bar-1, part=bar\n*Node\n{nodes}*Element, type=C3D8R\n{elements}*Nset, nset=First\n1, 2\n\
         *Elset, elset=First\n1\n*Elset, elset=Rest, generate\n2, 3\n*End Instance\n"
    );
    folder.write("bar.inp", &mesh);
    let imported = folder
        .import("bar.yaml", &perilab_mesh("Abaqus", "bar.inp", &[1, 2]))
        .unwrap();
    let key = |block: u32| format!("PeriLab > Blocks > block_{block} > Block ID");
    let (fate_of_id, note) = fate(&imported, &key(1));
    assert_eq!(fate_of_id, Fate::Approximated);
    assert!(note.contains("`Rest`"), "{note}");
    let problem = folder.problem(&imported);
    let found = dry_run(&problem, 1, false).unwrap();
    assert_eq!(found.points, 3);
    let (points, _) = generate(&problem, &threads::alone()).unwrap();
    let blocks: Vec<u32> = points.iter().map(|point| point.block).collect();
    assert_eq!(blocks, [1, 0, 0]);
    let set = problem.sets.iter().find(|set| set.name == "first").unwrap();
    let is_first = |id: &u64| set::contains(set, 1.0, *id, [0.0; 3], 0);
    assert_eq!((0..3).filter(is_first).collect::<Vec<_>>(), [0]);
    // The only block of a deck has all elements, also those of other sets.
    let imported = folder
        .import("bar.yaml", &perilab_mesh("Abaqus", "bar.inp", &[1]))
        .unwrap();
    assert_eq!(fate(&imported, &key(1)).0, Fate::Approximated);
    let found = dry_run(&folder.problem(&imported), 1, false).unwrap();
    assert_eq!(found.points, 3);
    let imported = folder
        .import("bar.yaml", &perilab_mesh("Abaqus", "bar.inp", &[2, 3]))
        .unwrap();
    let note = "the number of element sets of the mesh that are blocks is 2; name the element set";
    assert_eq!(fate(&imported, &key(3)), (Fate::Approximated, note));
    let imported = folder
        .import("bar.yaml", &perilab_mesh("Abaqus", "later.inp", &[1, 2]))
        .unwrap();
    let note = "the mesh cannot be read yet; name the element sets";
    for block in [1, 2] {
        assert_eq!(fate(&imported, &key(block)), (Fate::Approximated, note));
    }
    // A mesh with one set has no other elements.
    let single = mesh.replacen(
        "*Elset, elset=First\n1\n*Elset, elset=Rest, generate\n2, 3\n",
        "",
        1,
    );
    assert_ne!(single, mesh);
    folder.write("bar.inp", &single);
    let imported = folder
        .import("bar.yaml", &perilab_mesh("Abaqus", "bar.inp", &[1]))
        .unwrap();
    assert_eq!(fate(&imported, &key(1)).0, Fate::Taken);
    let imported = folder
        .import("bar.yaml", &perilab_mesh("Gmsh", "bar.msh", &[1]))
        .unwrap();
    assert_eq!(fate(&imported, &key(1)).0, Fate::Approximated);
}

/// In PeriLab, an element is in a node set of an Exodus mesh if all its nodes are.
#[test]
fn node_sets_of_perilab_have_elements_with_all_nodes() {
    for (name, used) in [("First", "First"), ("", "Set-1")] {
        let folder = Folder::new("exodus");
        folder.write_bytes("cubes.g", &exodus_of_first_cube(name));
        let text = perilab_mesh("Exodus", "cubes.g", &[10, 20]);
        let text = text.replace("Node Set: First", &format!("Node Set: {used}"));
        let imported = folder.import("cubes.yaml", &text).unwrap();
        let problem = folder.problem(&imported);
        let set = &problem.sets[problem.sets.len() - 1];
        let is_in = |id: &u64| set::contains(set, 1.0, *id, [0.0; 3], 0);
        assert_eq!(
            (0..2).filter(is_in).collect::<Vec<_>>(),
            [0],
            "{}",
            imported.text
        );
        let key = "PeriLab > Boundary Conditions > Pull > Node Set";
        assert_eq!(fate(&imported, key).0, Fate::Taken);
        // An element that is in no block of the deck shifts the ids.
        let text = text.replace("Block ID: 20", "Block ID: 30");
        let imported = folder.import("cubes.yaml", &text).unwrap();
        assert_eq!(fate(&imported, key).0, Fate::Approximated);
    }
}

/// PeriLab sorts the steps by `Step ID`, and its variable `st` starts again in each step.
#[test]
fn steps_of_perilab_are_in_their_order_and_have_their_time() {
    let folder = Folder::strip("ordered");
    let from = STRIP.find("  Solver:").unwrap();
    let to = STRIP.find("  Outputs:").unwrap();
    let step = |name: &str, id: u32, time: &str| {
        format!(
            "    {name}:\n      Step ID: {id}\n      {time}\n      Verlet:\n        Fixed dt: 1.0e-2\n"
        )
    };
    let steps = [
        step("Pull", 2, "Additional Time: 0.2"),
        step("Rest", 1, "Initial Time: 0.0\n      Final Time: 0.1"),
        step("Last", 3, "Additional Time: 0.4"),
    ];
    let steps = format!("  Multistep Solver:\n{}", steps.concat());
    let text = format!("{}{steps}{}", &STRIP[..from], &STRIP[to..]);
    let hold = |ids: &str| text.replacen("Value: 0\n", &format!("Value: 0.1*st\n{ids}"), 1);
    for (ids, starts) in [
        ("", vec!["t", "(t - 0.1)", "(t - 0.3"]),
        ("      Step ID: \"1,3\"\n", vec!["t", "(t - 0.3"]),
        ("      Step ID: 2\n", vec!["(t - 0.1)"]),
    ] {
        let imported = folder.import("strip.yaml", &hold(ids)).unwrap();
        let problem = folder.problem(&imported);
        let ends: Vec<f64> = problem
            .all_stages()
            .iter()
            .map(|stage| stage.time.end)
            .collect();
        assert!(
            (ends[0] - 0.1).abs() < 1e-12 && (ends[1] - 0.3).abs() < 1e-12,
            "{ends:?}"
        );
        let lines = imported
            .text
            .lines()
            .filter(|line| line.starts_with("displacement"));
        let lines: Vec<&str> = lines.collect();
        assert_eq!(lines.len(), starts.len(), "{}", imported.text);
        for (line, start) in lines.iter().zip(&starts) {
            assert!(line.contains(&format!("0.1*{start}")), "{line} {start}");
        }
    }
}

#[test]
fn a_fixed_step_of_a_static_solver_counts_load_steps() {
    let folder = Folder::strip("fixed");
    let verlet = "    Verlet:\n      Fixed dt: 1.0e-8\n      Numerical Damping: 0.002\n";
    let fixed = "    Static:\n      Fixed dt: 5.0e-8\n      Number of Steps: 3\n";
    let text = STRIP.replace(verlet, fixed);
    assert_ne!(text, STRIP);
    let imported = folder.import("strip.yaml", &text).unwrap();
    assert!(
        imported.text.contains("load_steps = 20"),
        "{}",
        imported.text
    );
    let key = "PeriLab > Solver > Static > Number of Steps";
    assert_eq!(fate(&imported, key).0, Fate::LeftOut);
}

#[test]
fn what_perilab_would_read_otherwise_is_named() {
    let folder = Folder::strip("named");
    let influence = STRIP.replace(
        "    Node Sets:\n",
        "    Influence Function: 1/xi^2\n    Node Sets:\n",
    );
    let influence = influence.replace("Bond-based Elastic", "PD Solid Elastic");
    let losses = folder.import("strip.yaml", &influence).unwrap().losses();
    assert_eq!(losses.influence, [6], "{losses}");
    let constant = influence.replace("1/xi^2", "1");
    let losses = folder.import("strip.yaml", &constant).unwrap().losses();
    assert!(losses.influence.is_empty(), "{losses}");
    for (scaling, lines) in [("1.0", &[][..]), ("0.5", &[6])] {
        let text = format!("    Horizon Mesh Scaling X: {scaling}\n    Node Sets:\n");
        let text = STRIP.replace("    Node Sets:\n", &text);
        let losses = folder.import("strip.yaml", &text).unwrap().losses();
        assert_eq!(losses.scaled_families, lines, "{losses}");
    }
    folder.write(
        "strip.txt",
        "header: x y block_id volume Bulk_Modulus\n0 0 1 0.5 2\n1 0 1 0.5 3\n",
    );
    let losses = folder.import("strip.yaml", STRIP).unwrap().losses();
    assert_eq!(losses.columns, [5], "{losses}");
    // If the file has no row of the block of the deck, the new deck would have no body.
    folder.write("strip.txt", "header: x y block_id volume\n0 0 11 0.5\n");
    let error = folder.import("strip.yaml", STRIP).unwrap_err();
    assert!(
        error.contains("the file has the block numbers 11"),
        "{error}"
    );
    // A file that is missing makes the new deck invalid.
    let folder = Folder::new("nothing");
    let imported = folder.import("strip.yaml", STRIP).unwrap();
    assert!(imported.fault.is_some());
    assert_eq!(imported.files.len(), 2);
}

#[test]
fn a_thickness_divides_the_critical_energy_of_perilab() {
    let folder = Folder::strip("thickness");
    let text = STRIP.replace(
        "Critical Value: 12.5\n",
        "Critical Value: 12.5\n        Thickness: 2\n",
    );
    let imported = folder.import("strip.yaml", &text).unwrap();
    folder.problem(&imported);
    assert!(
        imported.text.contains("fracture_energy = 6.25"),
        "{}",
        imported.text
    );
}

/// Steps of PeriLab: conditions of two steps, and settings that only one step has.
#[test]
fn steps_of_perilab_share_damping_and_damage() {
    let folder = Folder::strip("steps");
    let from = STRIP.find("  Solver:").unwrap();
    let to = STRIP.find("  Outputs:").unwrap();
    let steps = "  Multistep Solver:
    One:
      Step ID: 1
      Damage Models: True
      Initial Time: 0.0
      Final Time: 1.0e-6
      Verlet:
        Fixed dt: 1.0e-8
        Numerical Damping: 0.002
    Two:
      Step ID: 2
      Additional Time: 1.0e-6
      Verlet:
        Fixed dt: 1.0e-8
    Three:
      Step ID: 3
      Additional Time: 1.0e-6
      Verlet:
        Fixed dt: 1.0e-8
";
    let text = format!("{}{steps}{}", &STRIP[..from], &STRIP[to..])
        .replacen("      Value: 0\n", "      Value: 0\n      Step ID: \"1, 2\"\n", 1)
        .replacen(
            "    Warm:\n",
            "    Start:\n      Variable: Velocity\n      Node Set: Right\n      Coordinate: x\n      Value: 1\n      \
             Type: Initial\n      Step ID: 2\n    Warm:\n",
            1,
        );
    let imported = folder.import("strip.yaml", &text).unwrap();
    folder.problem(&imported);
    let key = |name: &str| fate(&imported, &format!("PeriLab > {name}")).0;
    assert_eq!(
        key("Multistep Solver > One > Verlet > Numerical Damping"),
        Fate::Approximated
    );
    assert_eq!(
        key("Multistep Solver > One > Damage Models"),
        Fate::Approximated
    );
    assert_eq!(key("Boundary Conditions > Hold > Step ID"), Fate::Taken);
    // PeriLab sets initial values only at the time 0, which is not in the second step.
    assert_eq!(key("Boundary Conditions > Start"), Fate::LeftOut);
    assert_eq!(imported.text.matches("off = [\"hold\"]").count(), 1);
    let error = folder
        .import("strip.yaml", &text.replacen("\"1, 2\"", "\"1; 2\"", 1))
        .unwrap_err();
    assert!(error.contains("`Step ID` must be whole numbers"), "{error}");
}

#[test]
fn the_largest_of_several_intervals_counts() {
    let folder = Folder::new("intervals");
    let text = TWO_POINTS.to_owned()
        + "  Output2:\n    Output Frequency: 50\n    Output Variables:\n      Velocity: true\n";
    let imported = folder.import("two.yaml", &text).unwrap();
    folder.problem(&imported);
    assert!(
        imported.text.contains("every_steps = 50"),
        "{}",
        imported.text
    );
    let (kept, note) = fate(&imported, "Peridigm > Output2 > Output Frequency");
    assert_eq!(kept, Fate::Approximated);
    assert!(note.contains("the other outputs have 10"), "{note}");
}

#[test]
fn a_damage_model_without_a_counterpart_is_a_loss() {
    let folder = Folder::new("loss");
    folder.write("bar.txt", &bar_points());
    folder.write("set.txt", "1\n");
    let text = BAR.replacen("value=\"Critical Stretch\"", "value=\"Von Mises\"", 1);
    let imported = folder.import("bar.xml", &text).unwrap();
    let line = 1 + text[..text.find("name=\"Stretch\"").unwrap()]
        .matches('\n')
        .count();
    assert_eq!(imported.losses().damages, [line]);
    assert!(imported.losses().conditions.is_empty());
}

/// Return a deck of Peridigm with computed quantities, and a second output that only has columns of the
/// history.
fn with_quantities(quantities: &str, variables: &str) -> String {
    let tables = format!("  Compute Class Parameters:\n{quantities}  Solver:\n");
    let output = format!(
        "  Output2:\n    Initial Output Step: 3\n    Output Frequency: 5\n    Output Variables:\n{variables}"
    );
    TWO_POINTS.replacen("  Solver:\n", &tables, 1) + &output
}

#[test]
fn computed_quantities_of_peridigm_are_columns_of_the_history() {
    let folder = Folder::new("quantities");
    let mut quantities = String::new();
    for (name, class, place, calculation, variable) in [
        (
            "Fastest",
            "Block_Data",
            "Block: block_1",
            "Maximum",
            "Velocity",
        ),
        (
            "Lowest",
            "Node_Set_Data",
            "Node Set: Left Node Set",
            "Minimum",
            "Displacement",
        ),
        ("Broken", "Block_Data", "Block: block_1", "Sum", "Damage"),
        (
            "Force",
            "Node_Set_Data",
            "Node Set: Left Node Set",
            "Sum",
            "Force",
        ),
        (
            "Stored",
            "Block_Data",
            "Block: block_1",
            "Sum",
            "Stored_Elastic_Energy",
        ),
        (
            "Largest",
            "Block_Data",
            "Block: block_1",
            "Maximum",
            "Force",
        ),
        ("Spin", "Angular_Momentum", "Verbose: true", "Sum", "None"),
        ("Global", "Energy", "Verbose: true", "Sum", "None"),
        ("Odd", "Block_Data", "Block: block_1", "Median", "Damage"),
        ("Radii", "Block_Data", "Block: block_1", "Sum", "Radius"),
        ("Gone", "Block_Data", "Block: block_7", "Sum", "Damage"),
        ("Magic", "Magic_Data", "Block: block_1", "Sum", "Damage"),
        (
            "Now",
            "Nearest_Point_Data",
            "X: -1.0\n      Y: 0.0\n      Z: 0.0",
            "None",
            "Coordinates",
        ),
        (
            "Then",
            "Nearest_Point_Data",
            "X: -1.0\n      Y: 0.0\n      Z: 0.0",
            "None",
            "Model_Coordinates",
        ),
    ] {
        quantities += &format!(
            "    {name}:\n      Compute Class: {class}\n      {place}\n      Calculation Type: {calculation}\n      \
             Variable: {variable}\n      Output Label: Label_{name}\n"
        );
    }
    let variables =
        "      Label_Fastest: true\n      Label_Now: true\n      Global_Angular_Momentum: true\n";
    let text = with_quantities(&quantities, variables);
    let imported = folder.import("two.yaml", &text).unwrap();
    let problem = folder.problem(&imported);
    let set = |name: &str| {
        problem
            .sets
            .iter()
            .position(|set| set.name == name)
            .unwrap()
    };
    let found: Vec<_> = problem.history.statistics.iter().collect();
    // One table for each component of a vector.
    assert_eq!(found.len(), 4 * 3 + 2, "{}", imported.text);
    let with = |start: &str| {
        found
            .iter()
            .filter(|one| one.name.starts_with(start))
            .count()
    };
    assert_eq!(with("label_fastest_"), 3);
    let of = |name: &str| *found.iter().find(|one| one.name == name).unwrap();
    assert_eq!(of("label_lowest_x").set, set("left_node_set"));
    assert_eq!(of("label_broken").set, set("block_1"));
    for line in [
        "field.label_fastest_y = { field = \"velocity\", component = \"y\", set = \"block_1\", of = [\"maximum\"] }",
        "field.label_broken = { field = \"damage\", set = \"block_1\", of = [\"sum\"] }",
        "field.label_force_x = { field = \"force_density\", component = \"x\", set = \"left_node_set\", of = [\"integral\"] }",
        "field.label_stored = { field = \"strain_energy_density\", set = \"block_1\", of = [\"integral\"] }",
        "probe.label_now = { at = [-1.0, 0.0, 0.0] }",
        "angular_momentum = true",
    ] {
        assert!(imported.text.contains(line), "{line}\n{}", imported.text);
    }
    // No support acts, so there are no reactions.
    assert!(!imported.text.contains("reactions"), "{}", imported.text);
    let quantity = |name: &str| {
        fate(
            &imported,
            &format!("Peridigm > Compute Class Parameters > {name}"),
        )
    };
    for (name, expected, note) in [
        (
            "Fastest",
            Fate::Taken,
            "[history] field.label_fastest_x, field.label_fastest_y, field.label_fastest_z: maximum of velocity",
        ),
        (
            "Force",
            Fate::Taken,
            "field.label_force_z: integral of force_density",
        ),
        (
            "Largest",
            Fate::Approximated,
            "maximum of force_density; times the volume",
        ),
        ("Global", Fate::Taken, "of the history are always there"),
        (
            "Spin",
            Fate::Taken,
            "[history] angular_momentum: about the origin",
        ),
        (
            "Odd",
            Fate::LeftOut,
            "the calculation `Median` is not known",
        ),
        ("Radii", Fate::LeftOut, "there is no such field"),
        ("Gone", Fate::LeftOut, "the block `block_7` is no body"),
        (
            "Magic",
            Fate::LeftOut,
            "the class `Magic_Data` has no counterpart",
        ),
        (
            "Now",
            Fate::Approximated,
            "[history] probe.label_now: displacement; add the position",
        ),
        (
            "Then",
            Fate::LeftOut,
            "a constant: the position of the nearest point",
        ),
    ] {
        let (found, text) = quantity(name);
        assert_eq!(found, expected, "{name}: {text}");
        assert!(text.contains(note), "{name}: {text}");
    }
    // A quantity has one line in the list. The interval of its output becomes the interval of the history.
    let mut keys = imported.entries.iter().map(|entry| entry.key.as_str());
    assert!(!keys.any(|key| key.contains("Fastest > ")));
    assert!(
        imported.text.contains("[output]\nevery_steps = 10\n"),
        "{}",
        imported.text
    );
    let history = &imported.text[imported.text.find("\n[history]\n").unwrap()..];
    assert!(history.contains("\nevery_steps = 5\n"), "{history}");
    assert_eq!(
        fate(&imported, "Peridigm > Output2 > Output Frequency"),
        (Fate::Taken, "[history] every_steps")
    );
    assert_eq!(
        fate(&imported, "Peridigm > Output2 > Initial Output Step").1,
        "the first and the last state are always written"
    );
}

/// The sum of the forces on a supported set is also a reaction, and the values of the history equal those of
/// the fields.
#[test]
fn sums_of_forces_are_opposite_to_reactions() {
    let folder = Folder::new("forces");
    let quantities = "    Sum:\n      Compute Class: Node_Set_Data\n      Node Set: Left Node Set\n      \
                      Calculation Type: Sum\n      Variable: Force\n";
    let text = with_quantities(quantities, "      Sum: true\n").replacen(
        "      Type: Initial Velocity\n      Node Set: Left Node Set\n      Coordinate: x\n      Value: \"0.5\"",
        "      Type: Prescribed Displacement\n      Node Set: Left Node Set\n      Coordinate: x\n      Value: \"0.0\"",
        1,
    );
    let imported = folder.import("two.yaml", &text).unwrap();
    folder.problem(&imported);
    assert!(
        imported.text.contains("reactions = [\"left_node_set\"]"),
        "{}",
        imported.text
    );
    let (kind, note) = fate(&imported, "Peridigm > Compute Class Parameters > Sum");
    assert_eq!(kind, Fate::Taken);
    assert!(
        note.ends_with(
            "column reaction_left_node_set: the force of the supports, opposite at rest"
        ),
        "{note}"
    );
}

#[test]
fn a_node_set_of_peridigm_is_one_by_its_name_or_by_its_use() {
    let folder = Folder::new("node-sets");
    let text = TWO_POINTS
        .replacen(
            "    Left Node Set: \"1\"\n",
            "    Left Points: [1]\n    Others: \"2\"\n",
            1,
        )
        .replacen("Node Set: Left Node Set", "Node Set: Left Points", 1);
    let imported = folder.import("two.yaml", &text).unwrap();
    folder.problem(&imported);
    assert!(
        imported.text.contains("[set.left_points]\nids = [0]"),
        "{}",
        imported.text
    );
    let (kind, note) = fate(&imported, "Peridigm > Boundary Conditions > Left Points");
    assert_eq!(kind, Fate::Taken);
    assert!(
        note.contains("Peridigm wants `Node Set` in its name"),
        "{note}"
    );
    let others = fate(&imported, "Peridigm > Boundary Conditions > Others");
    assert_eq!(others, (Fate::LeftOut, "unknown, or without a counterpart"));
    let error = folder
        .import(
            "two.yaml",
            &text.replacen("Node Set: Left Points", "Node Set: Left Point", 1),
        )
        .unwrap_err();
    let message = "the deck defines no node set `Left Point`; it has `Right Node Set`, `Spare Node Set`; node sets are \
                   parameters of `Boundary Conditions` with `Node Set` in their names";
    assert!(error.contains(message), "{error}");
}

#[test]
fn bonds_between_blocks_of_peridigm_are_all_or_none() {
    let folder = Folder::new("omitted-bonds");
    folder.write("bar.txt", &bar_points());
    folder.write("set.txt", "1\n");
    for (value, rule, expected, note) in [
        ("All", true, Fate::Taken, "[interface] rule = \"none\""),
        ("None", false, Fate::Taken, "blocks are bonded"),
        (
            "Off",
            false,
            Fate::LeftOut,
            "the value `Off` is not known (All, None); the blocks stay bonded",
        ),
    ] {
        let key = format!(
            "<Parameter name=\"Omit Bonds Between Blocks\" type=\"string\" value=\"{value}\"/>\n    \
             <ParameterList name=\"Bond Filters\">"
        );
        let text = BAR.replacen("<ParameterList name=\"Bond Filters\">", &key, 1);
        let imported = folder.import("bar.xml", &text).unwrap();
        folder.problem(&imported);
        assert_eq!(
            imported.text.contains("[interface]"),
            rule,
            "{}",
            imported.text
        );
        let found = fate(&imported, "Discretization > Omit Bonds Between Blocks");
        assert_eq!(found, (expected, note));
        let losses = imported.losses();
        assert_eq!(losses.is_empty(), expected == Fate::Taken);
        if value == "Off" {
            let warning = "the value of `Omit Bonds Between Blocks` is not known: line 5";
            assert_eq!(losses.to_string(), warning);
        }
    }
}

#[test]
fn correspondence_has_no_influence_function() {
    let folder = Folder::new("influence");
    folder.write("bar.txt", &bar_points());
    folder.write("set.txt", "1\n");
    let key = "Discretization > Influence Function";
    let import = |function: &str, model: &str| {
        let function = format!(
            "<Parameter name=\"Influence Function\" type=\"string\" value=\"{function}\"/>\n    \
             <ParameterList name=\"Bond Filters\">"
        );
        let text = BAR
            .replacen("<ParameterList name=\"Bond Filters\">", &function, 1)
            .replacen("Elastic Correspondence", model, 1);
        let imported = folder.import("bar.xml", &text).unwrap();
        folder.problem(&imported);
        imported
    };
    let imported = import("Parabolic Decay", "Elastic Correspondence");
    assert!(
        !imported.text.contains("\ninfluence = "),
        "{}",
        imported.text
    );
    assert_eq!(
        fate(&imported, key),
        (Fate::LeftOut, "correspondence: always ω = 1")
    );
    assert_eq!(
        fate(&import("One", "Elastic Correspondence"), key).0,
        Fate::Taken
    );
    let imported = import("Parabolic Decay", "Elastic");
    assert!(
        imported.text.contains("\ninfluence = \"linear\""),
        "{}",
        imported.text
    );
    assert_eq!(fate(&imported, key).0, Fate::Approximated);
    assert_eq!(fate(&import("1.0/zeta", "Elastic"), key).0, Fate::Taken);
}

/// A comment replaces a load that is left out. A damage model without a block is not a loss.
#[test]
fn what_is_left_out_has_a_comment_and_what_is_unused_no_warning() {
    let folder = Folder::new("left-out");
    folder.write("bar.txt", &bar_points());
    folder.write("set.txt", "1\n");
    let spare = "<ParameterList name=\"Damage Models\">\n    <ParameterList name=\"Spare\">\n      \
                 <Parameter name=\"Damage Model\" type=\"string\" value=\"Von Mises\"/>\n    </ParameterList>";
    let restart = "</ParameterList>\n  <ParameterList name=\"Restart\">\n    <Parameter name=\"Restart\" type=\"bool\" \
                   value=\"true\"/>\n  </ParameterList>\n  <ParameterList name=\"Solver1\">";
    let text = BAR
        .replacen("<ParameterList name=\"Damage Models\">", spare, 1)
        .replacen(
            "</ParameterList>\n  <ParameterList name=\"Solver1\">",
            restart,
            1,
        );
    let imported = folder.import("bar.xml", &text).unwrap();
    folder.problem(&imported);
    assert_eq!(
        fate(&imported, "Damage Models > Spare"),
        (Fate::LeftOut, "no block uses this damage model")
    );
    assert!(imported.losses().is_empty(), "{:?}", imported.losses());
    let (kind, note) = fate(&imported, "Restart");
    assert_eq!(kind, Fate::Approximated);
    assert!(note.contains("`fissure run --restart` continues"), "{note}");
    let text = text.replacen("Prescribed Displacement", "Prescribed Velocity", 1);
    let imported = folder.import("bar.xml", &text).unwrap();
    folder.problem(&imported);
    let comment = "\n# left out: [condition.pull] `Prescribed Velocity` has no counterpart\n";
    assert!(imported.text.contains(comment), "{}", imported.text);
    let at = |header: &str| imported.text.find(header).unwrap();
    assert!(at("\n[body.block_1]") < at(comment) && at(comment) < at("\n[time]"));
    assert!(
        imported
            .losses()
            .to_string()
            .starts_with("1 load or support is left out: line ")
    );
}

/// Twelve points of LAMMPS; the four points with x = 2 are the group `top`.
const BLOCK: &str = "units si
boundary s s s
atom_style peri
lattice sc 1.0
region r block 0 2 0 1 0 1
region high block 1.5 2 INF INF INF INF
create_box 1 r
create_atoms 1 region r
group top region high
pair_style peri/pmb
pair_coeff * * 3.0e4 1.5 0.1 0.0
set type 1 density 5
timestep 1e-6
";

/// Import the block with further commands.
fn block(folder: &Folder, commands: &str) -> Import {
    let imported = folder.import("in.block", &format!("{BLOCK}{commands}"));
    imported.unwrap_or_else(|error| panic!("{commands}{error}"))
}

/// Return the lines of an imported deck without comments and blank lines.
fn lines(imported: &Import) -> Vec<&str> {
    let lines = imported.text.lines();
    let lines = lines.filter(|line| !line.is_empty() && !line.starts_with('#'));
    lines.collect()
}

/// Return the positions of the lattice sites of [`BLOCK`] that are in a set of the imported deck.
fn sites(problem: &Problem, set: &str) -> Vec<[f64; 3]> {
    let set = problem.sets.iter().find(|own| own.name == set);
    let set = set.unwrap_or_else(|| panic!("{:?}", problem.sets));
    let mut sites = Vec::new();
    for site in 0..12 {
        let site = [site % 3, site / 3 % 2, site / 6].map(f64::from);
        if set::contains(set, 1.0, 0, site, 0) {
            sites.push(site);
        }
    }
    sites
}

#[test]
fn commands_of_lammps_after_the_first_run_change_only_the_end() {
    let folder = Folder::new("later");
    let before = "variable v equal 2
variable y equal step*3
velocity all set v_v 0 0
variable v equal 4
fix 1 top addforce v_y v_v 0
thermo 7
run 10
";
    let first = block(&folder, before);
    folder.problem(&first);
    for line in [
        "velocity = [2.0, 0.0, 0.0]",
        "density = 5.0",
        "end = 1e-5",
        "step = 1e-6",
    ] {
        assert!(lines(&first).contains(&line), "{line}\n{}", first.text);
    }
    let after = "set type 1 density 9
velocity all set 1 1 1
fix 2 all viscous 3
fix 3 all addforce 1 0 0
unfix 1
pair_coeff * * 9.0e4 1.5 0.1 0.0
group low type 1
compute 1 all damage/atom
dump 1 all custom 50 dump.peri id x
thermo 5
create_atoms 1 region high
";
    let changes = "variable v equal 7\nvariable y equal 8\ntimestep 2e-6\n";
    let whole = block(&folder, &format!("{before}{after}{changes}"));
    assert_eq!(lines(&whole), lines(&first));
    let start = BLOCK.lines().count() + before.lines().count();
    let left_out = &whole.entries[start..start + after.lines().count()];
    for entry in left_out {
        let note = "changes after the first `run` are not followed";
        assert_eq!(entry.fate, Fate::LeftOut, "{entry}");
        assert!(entry.note.starts_with(note), "{entry}");
    }
    // Each run uses the time step set last.
    let whole = block(&folder, &format!("{before}{changes}run v_v\nrun 3\n"));
    let expected = lines(&first).into_iter().map(|line| match line {
        "end = 1e-5" => "end = 3e-5",
        line => line,
    });
    assert_eq!(lines(&whole), expected.collect::<Vec<_>>());
    let steps = whole.entries.iter().filter(|entry| entry.key == "timestep");
    let fates: Vec<Fate> = steps.map(|entry| entry.fate).collect();
    assert_eq!(fates, [Fate::Taken, Fate::Approximated]);
}

#[test]
fn velocities_of_lammps_act_in_order() {
    let folder = Folder::new("velocities");
    for (commands, all, top) in [
        (
            "velocity all set 3 0 10\nvelocity top set 0 0 0\n",
            [3.0, 0.0, 10.0],
            [0.0; 3],
        ),
        (
            "velocity top set 0 0 0\nvelocity all set 3 0 10\n",
            [3.0, 0.0, 10.0],
            [3.0, 0.0, 10.0],
        ),
        (
            "velocity all set 3 0 10\nvelocity top set NULL 4 NULL\n",
            [3.0, 0.0, 10.0],
            [3.0, 4.0, 10.0],
        ),
        (
            "velocity top set 1 2 3\nvelocity top set 4 NULL 0\n",
            [0.0; 3],
            [4.0, 2.0, 0.0],
        ),
        ("velocity all set 0 0 0\n", [0.0; 3], [0.0; 3]),
        (
            "velocity all set 3 1 0\nvelocity top set 5 NULL NULL sum yes\n",
            [3.0, 1.0, 0.0],
            [8.0, 1.0, 0.0],
        ),
        // `NULL` keeps the velocity of other groups too.
        (
            "group high region high\nvelocity high set 0 7 0\nvelocity top set 1 NULL 0\n",
            [0.0; 3],
            [1.0, 7.0, 0.0],
        ),
    ] {
        let imported = block(&folder, &format!("{commands}run 1\n"));
        let problem = folder.problem(&imported);
        with::<3, _>(&problem, |simulation| {
            assert_eq!(simulation.model.owned(), 12);
            for point in 0..12 {
                let [x, ..] = simulation.model.position(point);
                let expected = if x > 1.5 { top } else { all };
                let velocity = simulation.fields.velocity.each_ref();
                let velocity = velocity.map(|component| component[point]);
                assert_eq!(velocity, expected, "{commands}{x}");
            }
        });
    }
}

/// In `atom_style peri`, forces are force densities, because LAMMPS divides them by the density. LAMMPS
/// scales numbers by the lattice constant, but not the values of variables.
#[test]
fn forces_of_lammps_are_densities_and_variables_have_no_scale() {
    let folder = Folder::new("densities");
    let script = BLOCK.replace("lattice sc 1.0", "lattice sc 2.0");
    let script = script.replace("3.0e4 1.5", "3.0e4 3.0")
        + "variable v equal 3\nvariable f equal step*dt*2\nvelocity all set 3 v_v 0\n\
           fix 1 all nve\nfix 2 top addforce 3 v_f 0\nfix 3 all viscous 10\nrun 1\n";
    let imported = folder.import("in.densities", &script).unwrap();
    folder.problem(&imported);
    for line in [
        "body_force = [3.0, \"t*2\", 0.0]",
        "damping = 2.0",
        "velocity = [6.0, 3.0, 0.0]",
    ] {
        assert!(
            lines(&imported).contains(&line),
            "{line}\n{}",
            imported.text
        );
    }
}

/// `setforce 0` keeps the velocity that the points start with, whichever groups have set it.
#[test]
fn points_of_lammps_without_force_keep_their_velocity() {
    let folder = Folder::new("setforce");
    let groups = "region tip block 1.5 INF INF INF INF 0.5\ngroup tip region tip\ngroup odd id 1 3\n\
                  fix 9 all nve\n";
    for (commands, expected) in [
        (
            "velocity top set 5 0 0\nfix 1 tip setforce 0 0 0\n",
            "[5.0, 0.0, 0.0]",
        ),
        (
            "velocity all set 1 2 3\nvelocity top set 5 NULL 0\nfix 1 tip setforce 0 0 NULL\n",
            "[5.0, 2.0, \"free\"]",
        ),
        (
            "velocity tip set 5 0 0\nfix 1 all setforce NULL 0 0\n",
            "[\"free\", 0.0, 0.0]",
        ),
        (
            "velocity top set 5 0 0\nfix 1 all setforce 0 0 0 region tip\n",
            "[5.0, 0.0, 0.0]",
        ),
    ] {
        let imported = block(&folder, &format!("{groups}{commands}run 1\n"));
        let problem = folder.problem(&imported);
        assert_eq!(problem.conditions.len(), 1, "{commands}");
        let (_, condition) = imported.text.split_once("[condition.fix_1]").unwrap();
        let velocity = format!("velocity = {expected}");
        assert!(
            condition.lines().any(|line| line == velocity),
            "{commands}{}",
            imported.text
        );
        assert!(
            imported.losses().is_empty(),
            "{commands}{}",
            imported.losses()
        );
    }
    for (velocity, note) in [
        (
            "velocity tip set 5 0 0",
            "its points start with different velocities",
        ),
        (
            "velocity odd set 5 0 0",
            "a `velocity` command has a group without a region",
        ),
    ] {
        let imported = block(
            &folder,
            &format!("{groups}{velocity}\nfix 1 top setforce 0 0 0\nrun 1\n"),
        );
        assert!(
            folder.problem(&imported).conditions.is_empty(),
            "{velocity}"
        );
        let last = imported.entries.iter().rfind(|entry| entry.key == "fix");
        assert_eq!(last.map(|entry| &*entry.note), Some(note), "{velocity}");
        assert!(last.unwrap().is_lost_load, "{velocity}");
    }
}

/// LAMMPS creates atoms on the upper face of the box only if this face is shrink-wrapped.
#[test]
fn atoms_of_lammps_end_at_the_box() {
    let folder = Folder::new("boundary");
    for (boundary, points) in [
        ("boundary s s s\n", 12),
        ("boundary s m fs\n", 6),
        ("boundary f f f\n", 2),
        ("boundary sf s s\n", 8),
        ("boundary s p f\n", 3),
        ("", 2),
    ] {
        for create in ["create_atoms 1 region r", "create_atoms 1 box"] {
            let script = BLOCK.replace("boundary s s s\n", boundary);
            let script =
                script.replace("create_atoms 1 region r", create) + "fix 1 all nve\nrun 1\n";
            let imported = folder.import("in.boundary", &script).unwrap();
            let found = dry_run(&folder.problem(&imported), 1, false).unwrap();
            assert_eq!(
                found.points, points,
                "{boundary}{create}\n{}",
                imported.text
            );
            let is_periodic = boundary.is_empty() || boundary.contains('p');
            let warning = imported.losses().to_string();
            let note =
                "there are no periodic boundaries; bodies end at the faces of the box: line ";
            assert_eq!(
                warning.starts_with(note),
                is_periodic,
                "{boundary}{warning}"
            );
        }
    }
    // Atoms outside of the box do not exist.
    let script = BLOCK.replace(
        "create_box 1 r",
        "region b block 0 1 0 1 0 1\ncreate_box 1 b",
    );
    let imported = folder.import("in.box", &format!("{script}fix 1 all nve\nrun 1\n"));
    let imported = imported.unwrap();
    assert_eq!(
        dry_run(&folder.problem(&imported), 1, false)
            .unwrap()
            .points,
        8
    );
}

#[test]
fn included_files_of_lammps_are_read() {
    let folder = Folder::new("include");
    folder.write(
        "bc.in",
        "# loads\ninclude more.in\nfix 1 top addforce ${a} 0 0\n",
    );
    folder.write("more.in", "variable a equal 3\nfix 2 all spring/self 1\n");
    folder.write("loop.in", "\ninclude loop.in\n");
    folder.write("wrong.in", "\nfix 1 top addforce x 0 0\n");
    let imported = block(&folder, "fix 9 all nve\ninclude bc.in\nrun 1\n");
    folder.problem(&imported);
    assert!(
        lines(&imported).contains(&"body_force = [3.0, 0.0, 0.0]"),
        "{}",
        imported.text
    );
    let entry = |key: &str| {
        imported
            .entries
            .iter()
            .find(|entry| entry.key == key)
            .unwrap()
    };
    assert_eq!(entry("bc.in:3: fix").line, 15);
    assert_eq!(entry("bc.in:3: fix").fate, Fate::Taken);
    assert_eq!(entry("more.in:2: fix").fate, Fate::LeftOut);
    let warning = "1 load or support is left out: line 15";
    assert_eq!(imported.losses().to_string(), warning);
    assert_eq!(imported.files.len(), 2);
    for (commands, message) in [
        (
            "include none.in",
            "deck:14:1: include: cannot read the deck none.in: ",
        ),
        ("include loop.in", "deck:14:1: loop.in:2: loop.in:2: "),
        (
            "include wrong.in\nrun 1",
            "deck:14:1: wrong.in:2: fix: must be a number, is `x`",
        ),
    ] {
        let error = folder
            .import("deck", &format!("{BLOCK}{commands}\n"))
            .unwrap_err();
        assert!(error.starts_with(message), "{error}\nexpected {message}");
    }
}

#[test]
fn changes_of_lammps_without_a_counterpart_are_losses() {
    let folder = Folder::new("changes");
    let control =
        "control flow is not followed, so commands that it chooses or repeats are left out";
    let model = "points, materials or bonds of the new deck differ from those of LAMMPS";
    for (commands, warning) in [
        ("if \"1 > 0\" then \"velocity top set 5 0 0\"", control),
        (
            "if \"1 > 0\" then \"print a\" elif \"2 > 1\" quit else \"run 20\"",
            control,
        ),
        ("variable i loop 3\nlabel a\nnext i\njump SELF a", control),
        ("create_atoms 1 single 1 1 4", model),
        ("delete_atoms overlap 0.1 all all", model),
        ("replicate 2 1 1", model),
        ("set group top density 3", model),
        ("set type 1 volume 2", model),
    ] {
        let imported = block(&folder, &format!("fix 9 all nve\n{commands}\nrun 1\n"));
        folder.problem(&imported);
        let line = 14 + commands.lines().count();
        let warning = format!("{warning}: line {line}");
        assert_eq!(imported.losses().to_string(), warning, "{commands}");
    }
    for command in [
        "if \"1 > 0\" then \"print a\" elif \"2 > 1\" quit else \"log b\"",
        "next i",
        "label a",
    ] {
        let imported = block(&folder, &format!("fix 9 all nve\n{command}\nrun 1\n"));
        assert!(
            imported.losses().is_empty(),
            "{command}: {}",
            imported.losses()
        );
    }
    for command in [
        "set type 1 density 3",
        "delete_atoms region high",
        "run 1\nunfix 8",
    ] {
        let before = "fix 9 all nve\nfix 8 top addforce 1 0 0\nrun 1\n";
        let imported = block(&folder, &format!("{before}{command}\n"));
        assert!(!imported.losses().is_empty(), "{command}");
    }
}

#[test]
fn groups_of_lammps_are_deleted_or_have_another_type() {
    let folder = Folder::new("types");
    let more = "pair_coeff 2 2 9.0e4 1.5 0.1 0.0\nset type 2 density 7\n";
    for (commands, points) in [
        ("delete_atoms group top\n", [8].as_slice()),
        ("set region high type 2\n", &[8, 4]),
        ("set group top type 2\n", &[8, 4]),
        ("set type 1 type 2\n", &[12]),
    ] {
        let script = BLOCK.replace("create_box 1", "create_box 2");
        let script = script.replace("pair_style", &format!("{commands}pair_style"));
        let script = format!("{script}{more}fix 1 all nve\nrun 1\n");
        let imported = folder.import("in.types", &script).unwrap();
        let problem = folder.problem(&imported);
        let found = dry_run(&problem, 1, false).unwrap();
        assert_eq!(
            found.points,
            points.iter().sum::<u64>(),
            "{commands}{}",
            imported.text
        );
        assert_eq!(problem.bodies.len(), points.len(), "{commands}");
    }
    // A group with more than one definition has no counterpart.
    for more in ["group top type 1", "group top clear"] {
        let commands = format!("fix 9 all nve\nfix 1 top addforce 1 0 0\n{more}\nrun 1\n");
        let imported = block(&folder, &commands);
        assert_eq!(imported.losses().conditions, [15], "{more}");
    }
}

/// Bonds between bodies have the mean modulus of both and the smaller critical stretch.
#[test]
fn joints_of_lammps_with_other_constants_are_losses() {
    let folder = Folder::new("joints");
    for (joint, is_lost) in [
        ("2.0e4 1.5 0.1 0.0", false),
        ("2.5e4 1.5 0.1 0.0", true),
        ("2.0e4 1.5 0.2 0.0", true),
        ("2.0e4 1.5 0.1 0.3", true),
    ] {
        let script = BLOCK.replace("create_box 1", "create_box 2");
        let script = script.replace("pair_style", "set region high type 2\npair_style");
        let commands = format!(
            "pair_coeff 1 1 1.0e4 1.5 0.1 0.0\npair_coeff 2 2 3.0e4 1.5 0.2 0.0\n\
             pair_coeff 1 2 {joint}\nset type 2 density 5\nfix 1 all nve\nrun 1\n"
        );
        let imported = folder
            .import("in.joints", &format!("{script}{commands}"))
            .unwrap();
        folder.problem(&imported);
        assert_eq!(
            !imported.losses().is_empty(),
            is_lost,
            "{joint}: {}",
            imported.losses()
        );
    }
}

#[test]
fn time_steps_of_lammps_have_a_default() {
    let folder = Folder::new("default-step");
    for (units, step) in [
        ("si", "1e-8"),
        ("cgs", "1e-8"),
        ("micro", "2.0"),
        ("nano", "0.00045"),
    ] {
        let script = BLOCK
            .replace("timestep 1e-6\n", "")
            .replace("units si", &format!("units {units}"));
        let imported = folder.import("in.step", &format!("{script}fix 1 all nve\nrun 1\n"));
        let imported = imported.unwrap();
        let line = format!("step = {step}");
        assert!(
            lines(&imported).contains(&line.as_str()),
            "{units}\n{}",
            imported.text
        );
        let (fate, note) = fate(&imported, "run");
        assert_eq!(fate, Fate::Taken);
        assert!(note.contains("the default of the units"), "{note}");
    }
}

#[test]
fn fixes_of_lammps_that_do_not_act_are_left_out() {
    let folder = Folder::new("unfix");
    let plain = block(&folder, "run 10\n");
    let removed = "fix 1 top addforce 1 0 0\nfix 2 all viscous 3\nunfix 1\nunfix 2\nrun 10\n";
    let removed = block(&folder, removed);
    assert_eq!(lines(&removed), lines(&plain));
    assert_eq!(
        fate(&removed, "fix"),
        (Fate::LeftOut, "`unfix` removes it before the first `run`")
    );
    let last = "fix 1 top addforce 2 0 0\nrun 10\n";
    let replaced = block(&folder, &format!("fix 1 all addforce 1 0 0\n{last}"));
    assert_eq!(lines(&replaced), lines(&block(&folder, last)));
}

/// A load or support of LAMMPS acts on the atoms of its group that are in its region.
#[test]
fn fixes_of_lammps_act_in_their_region() {
    let folder = Folder::new("region");
    let groups = "region front block INF INF INF 0.5 INF INF\nregion far block 7 9 INF INF INF INF\n\
                  group front region front\ngroup one type 1\ngroup odd id 1 3\nfix 9 all nve\n";
    let high: &[[f64; 3]] = &[
        [2.0, 0.0, 0.0],
        [2.0, 1.0, 0.0],
        [2.0, 0.0, 1.0],
        [2.0, 1.0, 1.0],
    ];
    for (fix, set, expected) in [
        (
            "all addforce 1 0 0 region high every 1",
            "region_high",
            high,
        ),
        ("all setforce NULL 0 NULL region high", "region_high", high),
        ("one setforce 0 0 0 region high", "one_in_high", high),
        (
            "front addforce 1 0 0 energy v_e region high",
            "front_in_high",
            &[[2.0, 0.0, 0.0], [2.0, 0.0, 1.0]],
        ),
    ] {
        let imported = block(&folder, &format!("{groups}fix 1 {fix}\nrun 1\n"));
        let problem = folder.problem(&imported);
        assert_eq!(sites(&problem, set), expected, "{fix}\n{}", imported.text);
        assert_eq!(problem.conditions.len(), 1, "{fix}");
        let last = imported.entries.iter().rfind(|entry| entry.key == "fix");
        let note = "; on the points that are in the region at the start";
        assert!(last.unwrap().note.ends_with(note), "{fix}: {last:?}");
        assert!(imported.losses().is_empty(), "{fix}");
    }
    let line = (BLOCK.lines().count() + groups.lines().count()) + 1;
    for (fix, note) in [
        (
            "all addforce 1 0 0 every 10",
            "the force does not act in every step",
        ),
        ("all addforce 1 0 0 often", "the word `often` is not read"),
        ("all setforce 0 0 0 region", "the word `region` is not read"),
        ("all setforce 0 0 0 every 1", "the word `every` is not read"),
        (
            "all move linear 1 0 0 region high",
            "the word `region` is not read",
        ),
        (
            "all move variable NULL v_d NULL v_v NULL NULL",
            "a component has only a velocity, and another one has a displacement",
        ),
        ("all addforce 1 0 0 region low", "its region has no shape"),
        (
            "odd addforce 1 0 0 region high",
            "its group is no body or region",
        ),
        (
            "all addforce 1 0 0 region far",
            "no atom of its group is in its region at the start",
        ),
        (
            "all indent 1e9 sphere 0 9 0 3 soft",
            "the word `soft` is not read",
        ),
    ] {
        let imported = block(&folder, &format!("{groups}fix 1 {fix}\nrun 1\n"));
        assert!(folder.problem(&imported).conditions.is_empty(), "{fix}");
        let last = imported.entries.iter().rfind(|entry| entry.key == "fix");
        assert_eq!(last.map(|entry| &*entry.note), Some(note), "{fix}");
        assert_eq!(imported.losses().conditions, [line], "{fix}");
    }
    // A region that moves has no fixed points.
    let moving = "region slider block 0 1 0 1 0 1 move v_x NULL NULL\nfix 1 all addforce 1 0 0 region slider\n";
    let imported = block(&folder, &format!("{groups}{moving}run 1\n"));
    assert_eq!(imported.losses().conditions, [line + 1]);
    // A displacement that is NULL leaves its component to the velocity.
    let imported = block(
        &folder,
        "variable v equal 3\nfix 1 top move variable NULL NULL NULL v_v NULL NULL\nrun 1\n",
    );
    assert!(
        imported
            .text
            .contains("velocity = [3.0, \"free\", \"free\"]"),
        "{}",
        imported.text
    );
}

/// Atoms that no fix integrates do not move in LAMMPS.
#[test]
fn points_of_no_integrator_of_lammps_are_held() {
    let folder = Folder::new("held");
    let groups = "region low block INF 0.5 INF INF INF INF\ngroup low region low\ngroup one type 1\n\
                  region all block INF INF INF INF INF INF\ngroup every region all\n\
                  group odd id 1 3\nvelocity all set 1 0 0\n";
    for (fixes, held) in [
        ("fix 1 top nve\n", Some(8)),
        ("fix 1 top nve/omp\nfix 2 low move linear 0 0 1\n", Some(4)),
        ("fix 1 top nve\nfix 2 low nve\n", Some(4)),
        ("fix 1 top nve\nfix 2 all nve/limit 0.1\n", None),
        ("fix 1 all nve\nfix 2 top setforce 0 0 0\n", None),
        ("fix 1 one nve\n", None),
        ("fix 1 every nve\n", None),
        ("fix 1 top nve\nunfix 1\nfix 1 all nve\n", None),
    ] {
        let imported = block(&folder, &format!("{groups}{fixes}run 3\n"));
        let problem = folder.problem(&imported);
        let is_held = problem.sets.iter().any(|set| set.name == "held");
        assert_eq!(is_held, held.is_some(), "{fixes}{}", imported.text);
        assert!(imported.losses().is_empty(), "{fixes}{}", imported.losses());
        let Some(count) = held else { continue };
        let sites = sites(&problem, "held");
        assert_eq!(sites.len(), count, "{fixes}{sites:?}");
        with::<3, _>(&problem, |mut simulation| {
            while simulation.clock.number() < simulation.clock.last() {
                simulation.advance();
            }
            for point in 0..12 {
                let position = simulation.model.position(point);
                let is_held = sites.contains(&position);
                let moved = simulation
                    .fields
                    .displacement
                    .iter()
                    .any(|u| u[point] != 0.0);
                assert_eq!(moved, !is_held, "{fixes}{position:?}");
            }
        });
    }
    let imported = block(&folder, &format!("{groups}fix 1 odd nve\nrun 3\n"));
    folder.problem(&imported);
    let note = "velocity Verlet; its group is no body or region; points outside of it do not move in LAMMPS";
    assert_eq!(fate(&imported, "fix"), (Fate::LeftOut, note));
    assert_eq!(imported.losses().conditions, [21]);
    let imported = block(&folder, "run 3\n");
    assert_eq!(
        imported.losses().to_string(),
        "no `fix nve` acts in the first run, so no atom moves in LAMMPS; points of the new deck move: line 14"
    );
}

/// A lattice with more sites than are tested for atoms.
#[test]
fn points_of_large_lattices_of_lammps_are_held_only_if_they_are_found() {
    let folder = Folder::new("held-large");
    for (mobile, (is_held, losses)) in [
        ("0 219 0 219 0 219", (false, 0)),
        ("INF INF INF INF INF INF", (false, 0)),
        ("INF 200 INF INF INF INF", (true, 0)),
        ("INF INF INF INF INF 218.5", (false, 1)),
    ] {
        let commands = "group mobile region m\nfix 1 mobile nve\nrun 1\n";
        let script = format!("{BLOCK}region m block {mobile}\n{commands}");
        let script = script.replace("block 0 2 0 1 0 1", "block 0 219 0 219 0 219");
        let imported = folder.import("in.large", &script).unwrap();
        assert_eq!(imported.text.contains("[set.held]"), is_held, "{mobile}");
        assert_eq!(imported.losses().conditions.len(), losses, "{mobile}");
    }
}

#[test]
fn loads_of_lammps_that_are_left_out_are_losses() {
    let folder = Folder::new("losses");
    for command in [
        "velocity all create 300 12345",
        "velocity all ramp vx 0 5 y 5 25",
        "displace_atoms top move 0 0 1e-4 units box",
        "set type 1 vx 3",
        "fix 1 all wall/reflect xlo EDGE",
        "fix 1 all nve/noforce",
        "fix 1 top viscous 3",
        "fix 1 all viscous 3 scale 1 2",
        "fix 1 all langevin 1 1 1 5",
        "minimize 0 1e-3 50 100",
        "fix 1 top spring/self 10",
        "fix 1 all gravity/kk 9.81 vector 0 0 -1",
    ] {
        let imported = block(&folder, &format!("fix 9 all nve\n{command}\nrun 1\n"));
        folder.problem(&imported);
        let warning = "1 load or support is left out: line 15";
        assert_eq!(imported.losses().to_string(), warning, "{command}");
        assert!(imported.text.contains("\n# left out: ["), "{command}");
        let imported = block(&folder, &format!("fix 9 all nve\nrun 1\n{command}\n"));
        assert!(!imported.losses().is_empty(), "{command}");
    }
    // A fix that does not act is no loss.
    let imported = block(
        &folder,
        "fix 9 all nve\nfix 1 top addforce 1 0 0\nunfix 1\nfix 2 top setforce NULL NULL NULL\nrun 1\n",
    );
    assert!(imported.losses().is_empty(), "{}", imported.losses());
}

#[test]
fn a_run_of_lammps_ends_at_a_step() {
    let folder = Folder::new("upto");
    for (commands, end) in [
        ("run 10\nrun 25 upto\nrun 5\n", "end = 3e-5"),
        ("run 10\nreset_timestep 0\nrun 25 upto\n", "end = 3.5e-5"),
        ("reset_timestep 20\nrun 25 upto\n", "end = 5e-6"),
    ] {
        let imported = block(&folder, commands);
        assert!(lines(&imported).contains(&end), "{}", imported.text);
    }
    let wrong = format!("{BLOCK}run 10\nrun 5 upto\n");
    let error = folder.import("deck", &wrong).unwrap_err();
    let message = "deck:15:1: run: the last step 5 is before the step 10";
    assert_eq!(error.lines().next(), Some(message));
}

#[test]
fn commands_of_lammps_after_a_run_without_steps_act() {
    let folder = Folder::new("run-0");
    let commands = "velocity all set 3 0 10\nfix 1 top addforce 1 0 0\nrun 10\n";
    let plain = block(&folder, commands);
    let imported = block(&folder, &format!("run 0\n{commands}run 0 post no\n"));
    assert_eq!(lines(&imported), lines(&plain));
    assert_eq!(fate(&imported, "run"), (Fate::LeftOut, "it makes no step"));
}

#[test]
fn indenters_of_lammps_have_names_of_their_own() {
    let folder = Folder::new("indenters");
    let commands =
        "fix 1 all indent 1e9 sphere 0 9 0 3\nfix 2 all indent 1e9 sphere 0 -9 0 3\nrun 1\n";
    let problem = folder.problem(&block(&folder, commands));
    assert_eq!(problem.rigid.len(), 2);
}

#[test]
fn a_wrong_deck_names_file_and_line() {
    let folder = Folder::new("wrong");
    let peridigm = |from: &str, to: &str| TWO_POINTS.replacen(from, to, 1);
    let perilab = |from: &str, to: &str| STRIP.replacen(from, to, 1);
    let lammps = |from: &str, to: &str| DISC.replacen(from, to, 1);
    for (text, message) in [
        (
            peridigm("Density: 1000.0", "Density: heavy"),
            "20:7: `Density` must be a number, is `heavy`",
        ),
        (
            peridigm("      Density: 1000.0\n", ""),
            "18:5: the material `Soft Solid` has no `Density`",
        ),
        (
            peridigm("Material: Soft Solid", "Material: Air"),
            "27:7: the material `Air` is not defined, or has no counterpart",
        ),
        (
            peridigm("Coordinate: x", "Coordinate: r"),
            "36:7: `Coordinate` must be x, y or z, is `r`",
        ),
        (
            peridigm("Node Set: Left Node Set", "Node Set: Top"),
            "35:7: the deck defines no node set `Top`",
        ),
        (
            peridigm("Left Node Set: \"1\"", "Left Node Set: \"0\""),
            "30:5: `Left Node Set`: number 1 is 0, but the first point has the number 1",
        ),
        (
            peridigm("Final Time: 4.0e-3", "Final Time: 0"),
            "43:3: the end 0 must be later than the start 0",
        ),
        (
            peridigm("    Verlet:", "    Leapfrog:"),
            "43:3: the solver is none of Verlet, QuasiStatic, NOXQuasiStatic, Implicit, Static, Newmark and the matrix-based ones",
        ),
        (
            peridigm("Type: PdQuickGrid", "Type: Albany"),
            "4:5: the discretization `Albany` is not read; known are Text File, Exodus and PdQuickGrid",
        ),
        (
            perilab("Young's Modulus: 7.0e+4", "Z: 1"),
            "14:7: the material `Alu` has too few elastic constants",
        ),
        (
            perilab("  Models:\n", "  Modules:\n"),
            "2:1: the deck has no `Models`",
        ),
        (
            lammps("lattice         sc", "lattice         fcc"),
            "8:1: lattice: points need a simple cubic lattice, `lattice sc`",
        ),
        (
            lammps("pair_coeff      * * 1.0e21", "pair_coeff      * *"),
            "13:1: pair_coeff: needs 4 numbers behind the types: c horizon s00 alpha",
        ),
        (
            lammps("run             200", "run             soon"),
            "28:1: run: must be a number, is `soon`",
        ),
        (
            lammps("units           si", "units           lj"),
            "2:1: units: the scale of a lattice is a density in the units `lj`; convert the script to si, cgs, micro or nano",
        ),
        (
            lammps("units           si", "units           metal"),
            "2:1: units: the units `metal` are no consistent system; convert the script to si, cgs, micro or nano",
        ),
        (
            lammps("units           si\n", ""),
            "1:1: the script has no `units`, so LAMMPS uses the default `lj`: the scale of a lattice is a density",
        ),
        (
            lammps("$(10*v_a)", "${b}"),
            "9:1: the variable `b` is not defined",
        ),
        ("a: [1\n".to_owned(), "2:1: is no YAML: "),
        (
            "a: 1\n".to_owned(),
            "1:1: is no deck of Peridigm (`Peridigm:`, or a ParameterList in XML), PeriLab (`PeriLab:`) or LAMMPS (`atom_style peri`); --from says which it is",
        ),
        (
            "<a/>".to_owned(),
            "1:1: the root element must be ParameterList, is a",
        ),
    ] {
        let error = folder.import("deck", &text).unwrap_err();
        let first = error.lines().next().unwrap();
        assert!(
            first.starts_with(&format!("deck:{message}")),
            "{error}\nexpected {message}"
        );
    }
}

/// Every mutated deck is imported or gives an error with its location; none causes a panic.
#[test]
fn mutants_are_decks_or_errors() {
    let folder = Folder::strip("mutants");
    folder.write("bar.txt", &bar_points());
    folder.write("set.txt", "1\n5\n");
    let mutants = std::env::var("FISSURE_MUTANTS").map_or(400, |count| count.parse().unwrap());
    let mut state = 7_u64;
    let mut random = |below: usize| {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below.max(1)
    };
    let words = [
        "-1",
        "0",
        "1e400",
        "nan",
        "x",
        "\"",
        "'",
        ":",
        "- ",
        "{",
        "}",
        "(",
        "[",
        "]",
        "&",
        "*a",
        "$(",
        "${",
        "<",
        ">",
        "é",
        "\t",
        "\n",
        "\0",
        "if(",
        "t>2 0 else",
        "value",
        "block_1",
        "default",
        "INF",
    ];
    for (name, deck) in [
        ("a.yaml", TWO_POINTS),
        ("b.xml", BAR),
        ("c.yaml", STRIP),
        ("in.d", DISC),
    ] {
        let mut sound = 0;
        for _ in 0..mutants {
            let mut text = deck.to_owned();
            for _ in 0..1 + random(3) {
                let at = text.floor_char_boundary(random(text.len()));
                let end = text.floor_char_boundary((at + random(12)).min(text.len()));
                match random(4) {
                    0 => text.insert_str(at, words[random(words.len())]),
                    1 => text.replace_range(at..end, words[random(words.len())]),
                    2 => text.replace_range(at..end, ""),
                    _ => {
                        let mut lines: Vec<&str> = text.lines().collect();
                        let (a, b) = (random(lines.len()), random(lines.len()));
                        match random(3) {
                            0 => lines.swap(a, b),
                            1 => {
                                lines.remove(a);
                            }
                            _ => lines.insert(a, lines[b]),
                        }
                        text = lines.join("\n");
                    }
                }
            }
            match folder.import(name, &text) {
                Ok(imported) => {
                    sound += 1;
                    // Values may be wrong, but the text is always TOML.
                    let table = toml::from_str::<toml::Table>(&imported.text);
                    assert!(table.is_ok(), "{text}\n{}", imported.text);
                }
                Err(message) => assert!(
                    message.starts_with(&format!("{name}:")),
                    "{text}\n{message}"
                ),
            }
        }
        assert!(
            sound > 0 && sound < mutants,
            "{name}: {sound} of {mutants} are sound"
        );
    }
}

/// Young's modulus is enough for a bond-based material.
#[test]
fn a_bond_based_material_of_peridigm_has_one_constant() {
    let folder = Folder::new("one-constant");
    let text = TWO_POINTS
        .replacen("\"Elastic\"", "\"Elastic Bond Based\"", 1)
        .replacen("Bulk Modulus: 12.0e6", "Young's Modulus: 3.0e7", 1)
        .replacen("Shear Modulus: 5.0e6", "Poisson's Ratio: 0.25", 1);
    let imported = folder.import("bonds.yaml", &text).unwrap();
    folder.problem(&imported);
    let key = |name: &str| format!("Peridigm > Materials > Soft Solid > {name}");
    assert_eq!(fate(&imported, &key("Young's Modulus")).0, Fate::Taken);
    let note = "the other constants determine the stiffness of a bond-based material";
    assert_eq!(
        fate(&imported, &key("Poisson's Ratio")),
        (Fate::LeftOut, note)
    );
}

#[test]
fn plasticity_of_peridigm_can_be_disabled() {
    let folder = Folder::new("disabled");
    for (value, law) in [("true", "ordinary"), ("false", "ordinary_plastic")] {
        let text = TWO_POINTS
            .replacen("\"Elastic\"", "\"Elastic Plastic\"", 1)
            .replacen(
                "Material Model: Elastic\n",
                "Material Model: Elastic Plastic\n",
                1,
            );
        let at = text.find("Density").unwrap();
        let indent: String = text[..at].chars().rev().take_while(|c| *c == ' ').collect();
        let more = format!("Yield Stress: 1.0\n{indent}Disable Plasticity: {value}\n{indent}");
        let text = format!("{}{more}{}", &text[..at], &text[at..]);
        let imported = folder.import("two.yaml", &text).unwrap();
        let header = format!(".{law}]");
        assert!(
            imported.text.contains(&header),
            "{value}: {}",
            imported.text
        );
    }
}

/// Points of several node sets: each initial value of Peridigm replaces earlier values of the same component,
/// and leaves the other components.
#[test]
fn initial_values_of_peridigm_act_in_order() {
    let folder = Folder::new("initials");
    let from = TWO_POINTS.find("    Go Right:").unwrap();
    let to = TWO_POINTS.find("  Solver:").unwrap();
    for (given, expected) in [
        (
            &[
                ("Left", "x", 0.5),
                ("Spare", "x", 3.0),
                ("Spare", "y", 2.0),
                ("Left", "y", 7.0),
            ][..],
            [[3.0, 7.0, 0.0], [3.0, 2.0, 0.0]],
        ),
        (
            &[("Spare", "x", 3.0), ("Left", "y", 7.0), ("Right", "z", 1.0)],
            [[3.0, 7.0, 0.0], [3.0, 0.0, 1.0]],
        ),
        (
            &[("Left", "x", 0.5), ("Spare", "z", 3.0)],
            [[0.5, 0.0, 3.0], [0.0, 0.0, 3.0]],
        ),
        (
            &[("Left", "x", 0.5), ("Right", "y", 3.0)],
            [[0.5, 0.0, 0.0], [0.0, 3.0, 0.0]],
        ),
    ] {
        let mut conditions = String::new();
        for (index, (set, component, value)) in given.iter().enumerate() {
            conditions += &format!(
                "    Go {index}:\n      Type: Initial Velocity\n      Node Set: {set} Node Set\n      \
                 Coordinate: {component}\n      Value: {value}\n"
            );
        }
        let text = format!("{}{conditions}{}", &TWO_POINTS[..from], &TWO_POINTS[to..]);
        let imported = folder.import("two.yaml", &text).unwrap();
        for index in 0..given.len() {
            let key = format!("Peridigm > Boundary Conditions > Go {index} > Value");
            assert_eq!(fate(&imported, &key).0, Fate::Taken, "{given:?}");
        }
        let problem = folder.problem(&imported);
        with::<3, _>(&problem, |simulation| {
            for point in 0..2 {
                let [x, ..] = simulation.model.position(point);
                let velocity = simulation.fields.velocity.each_ref();
                let velocity = velocity.map(|component| component[point]);
                assert_eq!(velocity, expected[usize::from(x > 0.0)], "{given:?} {x}");
            }
        });
    }
}

/// PeriLab applies conditions in no fixed order.
#[test]
fn initial_values_of_perilab_are_ambiguous() {
    let folder = Folder::strip("ambiguous");
    let initial = |name: &str, set: &str, value: &str| {
        format!(
            "    {name}:\n      Variable: Velocity\n      Node Set: {set}\n      Coordinate: x\n      \
             Value: {value}\n      Type: Initial\n"
        )
    };
    let both = initial("One", "Left", "1") + &initial("Two", "Ends", "2");
    let text = STRIP.replacen("    Warm:\n", &(both + "    Warm:\n"), 1);
    let imported = folder.import("strip.yaml", &text).unwrap();
    folder.problem(&imported);
    let losses = imported.losses();
    assert_eq!(losses.unordered_initials.len(), 1, "{losses}");
    let late = text.replacen("Initial Time: 0.0", "Initial Time: 5.0e-7", 1);
    // PeriLab runs no step that starts after the time 0, if none is before it.
    let error = folder.import("strip.yaml", &late).unwrap_err();
    assert!(error.contains("PeriLab runs no step"), "{error}");
}

/// In PeriLab, `A + B` has the points of both node sets.
#[test]
fn sums_of_node_sets_of_perilab_are_one_set() {
    let folder = Folder::strip("sums");
    let held = |set: &str| STRIP.replacen("Node Set: \"Left\"", &format!("Node Set: {set}"), 1);
    let imported = folder.import("strip.yaml", &held("Left + Ends")).unwrap();
    folder.problem(&imported);
    for line in [
        "[set.left_ends]\nids = [0, 1]",
        "[condition.hold]\nset = \"left_ends\"",
    ] {
        assert!(imported.text.contains(line), "{line}\n{}", imported.text);
    }
    assert_eq!(
        fate(&imported, "PeriLab > Discretization > Node Sets > Left").0,
        Fate::Taken
    );
    // A point in both sets has the force once.
    let pushed = STRIP.replacen(
        "      Variable: \"Forces\"\n      Node Set: \"Ends\"",
        "      Variable: \"Forces\"\n      Node Set: \"Ends + Left\"",
        1,
    );
    let imported = folder.import("strip.yaml", &pushed).unwrap();
    folder.problem(&imported);
    assert!(
        imported.text.contains("force = [0, \"2*(-3*t)\"]"),
        "{}",
        imported.text
    );
    let conditions =
        held("Right + Low").replacen("      Right:", "      Low: y<1\n      Right:", 1);
    let imported = folder.import("strip.yaml", &conditions).unwrap();
    folder.problem(&imported);
    assert!(
        imported.text.contains("where = \"(x > 0.5) || (y < 1)\""),
        "{}",
        imported.text
    );
    let with_all =
        held("Left + Whole").replacen("      Right:", "      Whole: All\n      Right:", 1);
    let imported = folder.import("strip.yaml", &with_all).unwrap();
    folder.problem(&imported);
    assert!(
        imported.text.contains("[condition.hold]\nset = \"all\""),
        "{}",
        imported.text
    );
    let imported = folder.import("strip.yaml", &held("Left + Right")).unwrap();
    folder.problem(&imported);
    for line in [
        "[condition.hold_on_left]\nset = \"left\"",
        "[condition.hold_on_right]\nset = \"right\"",
    ] {
        assert!(imported.text.contains(line), "{line}\n{}", imported.text);
    }
    let error = folder.import("strip.yaml", &held("Left + Up")).unwrap_err();
    assert!(
        error.contains("the deck defines no node set `Up`"),
        "{error}"
    );
    // Peridigm has no sums of node sets.
    let text = TWO_POINTS.replacen(
        "Node Set: Left Node Set",
        "Node Set: Left Node Set + Right Node Set",
        1,
    );
    let error = Folder::new("sum").import("two.yaml", &text).unwrap_err();
    let message = "the deck defines no node set `Left Node Set + Right Node Set`";
    assert!(error.contains(message), "{error}");
}

/// The last of several body forces acts in Peridigm; loads add up in the new deck.
#[test]
fn loads_on_the_same_points_add_up() {
    let folder = Folder::new("loads");
    let load = |name: &str, set: &str| {
        format!(
            "    {name}:\n      Type: Body Force\n      Node Set: {set}\n      Coordinate: x\n      Value: 2\n"
        )
    };
    for (sets, count) in [
        (["Left Node Set", "Spare Node Set"], 1),
        (["Left Node Set", "Left Node Set"], 1),
        (["Left Node Set", "Right Node Set"], 0),
    ] {
        let loads = load("One", sets[0]) + &load("Two", sets[1]);
        let text = TWO_POINTS.replacen("    Go Right:\n", &(loads + "    Go Right:\n"), 1);
        let imported = folder.import("two.yaml", &text).unwrap();
        folder.problem(&imported);
        assert_eq!(imported.losses().added_loads.len(), count, "{sets:?}");
    }
}

/// A solver of Peridigm starts at its own `Initial Time`, which is 0 if it is not given. The increments of a
/// prescribed displacement add up.
#[test]
fn times_of_peridigm_are_shifted() {
    let folder = Folder::new("shifted");
    let solvers = |spans: &[&str]| {
        let mut text = TWO_POINTS.replacen(
            "    Go Right:\n",
            "    Pull:\n      Type: Prescribed Displacement\n      Node Set: Left Node Set\n      Coordinate: x\n      \
             Value: \"0.1*t\"\n    Push:\n      Type: Body Force\n      Node Set: Right Node Set\n      \
             Coordinate: x\n      Value: \"5*t\"\n    Go Right:\n",
            1,
        );
        let from = text.find("  Solver:").unwrap();
        let to = text.find("  Output:").unwrap();
        let mut all = String::new();
        for (index, span) in spans.iter().enumerate() {
            all += &format!("  Solver{index}:\n    {span}\n    Verlet:\n      Fixed dt: 0.01\n");
        }
        text.replace_range(from..to, &all);
        let imported = folder.import("two.yaml", &text).unwrap();
        let problem = folder.problem(&imported);
        let ends = problem
            .all_stages()
            .iter()
            .map(|stage| stage.time.end)
            .collect::<Vec<_>>();
        let value =
            |line: &&str| line.starts_with("displacement") || line.starts_with("body_force");
        let lines = imported.text.lines().filter(value).map(str::to_owned);
        (ends, lines.collect::<Vec<_>>())
    };
    for (spans, ends, lines) in [
        (
            &["Final Time: 1.0", "Initial Time: 1.0\n    Final Time: 3.0"][..],
            &[1.0, 3.0][..],
            &["\"0.1*t\"", "\"5*t\""][..],
        ),
        (
            &["Initial Time: 2.0\n    Final Time: 3.0"],
            &[1.0],
            &["\"(0.1*(t + 2.0)) - (0.2)\"", "\"5*(t + 2.0)\""],
        ),
        (
            &["Final Time: 1.0", "Final Time: 2.0"],
            &[1.0, 3.0],
            &[
                "\"0.1*t\"",
                "\"(0.1*(t - 1.0)) + (0.1)\"",
                "\"5*t\"",
                "\"5*(t - 1.0)\"",
            ],
        ),
        (
            &["Final Time: 1.0", "Initial Time: 1.5\n    Final Time: 2.0"],
            &[1.0, 1.5],
            &[
                "\"0.1*t\"",
                "\"(0.1*(t + 0.5)) + (0.1) - (0.15",
                "\"5*t\"",
                "\"5*(t + 0.5)\"",
            ],
        ),
    ] {
        let (found, values) = solvers(spans);
        assert_eq!(found, ends, "{spans:?}");
        assert_eq!(values.len(), lines.len(), "{spans:?} {values:?}");
        for (value, line) in values.iter().zip(lines) {
            assert!(value.contains(line), "{value} {line}");
        }
    }
}

/// PeriLab skips a step that does not contain the end of the step before. Other steps start at this end.
#[test]
fn steps_of_perilab_that_do_not_follow_are_skipped() {
    let folder = Folder::strip("gap");
    let from = STRIP.find("  Solver:").unwrap();
    let to = STRIP.find("  Outputs:").unwrap();
    for (initial, second_end, end) in [
        ("0.5", 0.7, 0.1),
        ("0.0", 0.1, 0.1),
        ("0.1", 0.7, 0.7),
        ("0.05", 0.7, 0.7),
    ] {
        let step = |name: &str, id: u32, initial: &str, last: f64| {
            format!(
                "    {name}:\n      Step ID: {id}\n      Initial Time: {initial}\n      Final Time: {last}\n      \
                 Verlet:\n        Fixed dt: 1.0e-2\n"
            )
        };
        let steps = step("One", 1, "0.0", 0.1) + &step("Two", 2, initial, second_end);
        let text = format!(
            "{}  Multistep Solver:\n{steps}{}",
            &STRIP[..from],
            &STRIP[to..]
        );
        let text = text.replacen("      Value: 0\n", "      Value: 2*t\n", 1);
        let imported = folder.import("strip.yaml", &text).unwrap();
        let problem = folder.problem(&imported);
        let last = problem.all_stages().last().unwrap().time.end;
        assert!((last - end).abs() < 1e-12, "{last}");
        let lines = imported.text.lines();
        let lines: Vec<&str> = lines
            .filter(|line| line.starts_with("displacement"))
            .collect();
        assert!(lines[0].contains("\"2*t\""), "{lines:?}");
        assert_eq!(lines.len(), 1, "{lines:?}");
        let is_skipped = imported.text.contains("PeriLab skips this step");
        assert_eq!(is_skipped, end == 0.1, "{}", imported.text);
    }
}

/// `Time Steps` of Peridigm: the first number is the start, and `Number of Load Steps` takes precedence.
#[test]
fn time_steps_of_peridigm_begin_at_the_first_one() {
    let folder = Folder::new("time-steps");
    let text = TWO_POINTS.replacen(
        "    Verlet:\n      Fixed dt: 2.0e-5\n",
        "    QuasiStatic:\n      Time Steps: \"1.0 1.5 3.0\"\n",
        1,
    );
    let text = text.replace("Initial Velocity", "Prescribed Displacement");
    let ends = |text: &str| {
        let imported = folder.import("two.yaml", text).unwrap();
        let problem = folder.problem(&imported);
        let stages = problem.all_stages();
        stages
            .iter()
            .map(|stage| stage.time.end)
            .collect::<Vec<_>>()
    };
    assert_eq!(ends(&text), [0.5, 2.0]);
    let load_steps = text.replacen(
        "QuasiStatic:\n",
        "QuasiStatic:\n      Number of Load Steps: 4\n",
        1,
    );
    assert_eq!(ends(&load_steps), [4e-3]);
}

/// Rotated axes of PeriLab: R = R_x R_y R_z, or its inverse without a stiffness matrix; in plane problems,
/// `Angle X` is the angle about z.
#[test]
fn angles_of_perilab_turn_the_axes() {
    let folder = Folder::strip("angles");
    let given = "        Young's Modulus: 7.0e+4\n        Poisson's Ratio: 0.34\n";
    let with_angles = |constants: &str, angles: &[(&str, f64)], solver: &str| {
        let angles: String = angles
            .iter()
            .map(|(axis, angle)| format!("      Angle {axis}: {angle}\n"))
            .collect();
        let text = STRIP
            .replacen(given, constants, 1)
            .replacen("Bond-based Elastic", "Correspondence Elastic", 1)
            .replacen(
                "      Horizon: 1.2\n",
                &format!("      Horizon: 1.2\n{angles}"),
                1,
            )
            .replacen("    Verlet:\n", &format!("    {solver}:\n"), 1);
        let imported = folder.import("strip.yaml", &text).unwrap();
        folder.problem(&imported);
        let lines = imported
            .text
            .lines()
            .filter(|line| line.starts_with("angle_"));
        let lines: Vec<String> = lines.map(str::to_owned).collect();
        (imported, lines)
    };
    let plane = "        C11: 10\n        C12: 3\n        C22: 5\n        C66: 2\n";
    let (imported, lines) = with_angles(plane, &[("X", 30.0), ("Z", 50.0)], "Verlet");
    assert_eq!(lines, ["angle_1 = -30.0"]);
    let key = |axis: &str| format!("PeriLab > Blocks > block_1 > Angle {axis}");
    assert_eq!(fate(&imported, &key("X")).0, Fate::Approximated);
    assert_eq!(fate(&imported, &key("Z")).0, Fate::LeftOut);
    assert_eq!(
        with_angles(plane, &[("X", 30.0)], "Verlet Matrix Based").1,
        ["angle_1 = 30.0"]
    );
    // An isotropic material has no axes.
    let (imported, lines) = with_angles(given, &[("X", 30.0)], "Verlet");
    assert!(lines.is_empty(), "{lines:?}");
    assert_eq!(fate(&imported, &key("X")).0, Fate::Taken);
    folder.write(
        "strip.txt",
        "header: x y z block_id volume\n0 0 0 1 0.5\n1 0 0 1 0.5\n",
    );
    let solid = "        C11: 10\n        C22: 5\n        C33: 5\n        C44: 2\n        C55: 2\n        C66: 2\n";
    let (_, lines) = with_angles(solid, &[("X", 0.0), ("Y", 0.0), ("Z", 45.0)], "Verlet");
    assert_eq!(lines, ["angle_1 = -45.0"]);
    let (x, y, z) = (Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis());
    let about = |axis, angle: f64| Rotation3::from_axis_angle(&axis, angle.to_radians());
    let rotation = about(x, 90.0) * about(y, 20.0) * about(z, 45.0);
    for (solver, expected) in [
        ("Verlet", rotation.inverse()),
        ("Verlet Matrix Based", rotation),
        ("Newmark", rotation),
    ] {
        let angles = [("X", 90.0), ("Y", 20.0), ("Z", 45.0)];
        let (_, lines) = with_angles(solid, &angles, solver);
        let written = lines.iter().map(|line| line.split_once(" = ").unwrap().1);
        let written: Vec<f64> = written.map(|angle| angle.parse().unwrap()).collect();
        let [first, second, third] = written[..] else {
            panic!("{lines:?}")
        };
        let found = about(z, first) * about(x, second) * about(z, third);
        let difference = (found.matrix() - expected.matrix()).norm();
        assert!(difference < 1e-12, "{solver}: {difference}");
    }
    // PeriLab reads the other angles only together with `Angle X`.
    let (imported, lines) = with_angles(solid, &[("Z", 45.0)], "Verlet");
    assert!(lines.is_empty(), "{lines:?}");
    assert_eq!(fate(&imported, &key("Z")).0, Fate::LeftOut);
    // Angles of points are not read.
    folder.write(
        "strip.txt",
        "header: x y block_id volume Angles\n0 0 1 0.5 30\n1 0 1 0.5 30\n",
    );
    let (imported, _) = with_angles(plane, &[], "Verlet");
    assert_eq!(imported.losses().columns, [5]);
}

#[test]
fn compressed_bonds_of_perilab_break_if_the_law_allows_it() {
    let folder = Folder::strip("compressed");
    let with_damage = |damage: &str, law: &str| {
        let text = STRIP
            .replacen(
                "Damage Model: Critical Energy\n",
                &format!("Damage Model: {damage}\n"),
                1,
            )
            .replacen(
                "Critical Value: 12.5\n",
                "Critical Value: 12.5\n        Only Tension: false\n",
                1,
            )
            .replacen("Bond-based Elastic", law, 1);
        let imported = folder.import("strip.yaml", &text).unwrap();
        folder.problem(&imported);
        let breaks = imported.text.contains("tension_only = false");
        assert_ne!(
            breaks,
            imported.losses().intact_compressed == [22],
            "{}",
            imported.text
        );
        breaks
    };
    assert!(!with_damage("Critical Stretch", "Bond-based Elastic"));
    assert!(!with_damage("Critical Stretch", "PD Solid Elastic"));
    assert!(with_damage("Critical Stretch", "Correspondence Elastic"));
    assert!(!with_damage("Critical Energy", "Bond-based Elastic"));
    assert!(with_damage("Critical Energy", "PD Solid Elastic"));
}

#[test]
fn numbers_that_are_too_large_are_named() {
    let folder = Folder::strip("large");
    let text = STRIP.replacen("Young's Modulus: 7.0e+4", "Young's Modulus: 1e999", 1);
    let error = folder.import("strip.yaml", &text).unwrap_err();
    assert!(
        error.contains("`Young's Modulus` must be a number, is `1e999`"),
        "{error}"
    );
    for value in ["1e999", "-1e999*t", "1/0"] {
        let text = STRIP.replacen("Value: -3*t", &format!("Value: {value}"), 1);
        let imported = folder.import("strip.yaml", &text).unwrap();
        folder.problem(&imported);
        assert_eq!(
            imported.losses().conditions.len(),
            2,
            "{}",
            imported.losses()
        );
    }
}
