//! The energy that separating a body along a plane dissipates, compared with the fracture energy, for damage
//! by stretch and by energy, and for softening bonds.
//!
//! The opening is multiplied by a factor in each step, so the stretch at which a bond breaks is too large by
//! up to this factor. The overshoot energy of the bond is not counted. The remaining error is the quadrature
//! error of the lattice, which decreases with m.

use std::borrow::Cow;
use std::ops::Range;

use fissure::comm::threads::alone;
use fissure::solver::Simulation;
use fissure::solver::calibration::{calibrated, separation_energy_ratio};

use crate::support::{displace, problem, simulate};

/// G0, J/m².
const FRACTURE_ENERGY: f64 = 2.0;

/// Return the deck of a body with unit spacing and a cut plane between two layers of points. The points above
/// and below the middle of the cut have all their bonds across the cut. With state-based laws, the families
/// at both ends of these bonds are complete.
fn text(dimension: &str, ratio: u32, law: &str, rule: &str) -> String {
    let (rule, more) = rule.split_once(' ').unwrap_or((rule, ""));
    let (dimension, constraint) = match dimension {
        "uniaxial-stress" | "uniaxial-strain" => ("1d", format!("constraint = '{dimension}'")),
        _ => (dimension, String::new()),
    };
    // Only the points at the ends of bonds across the cut matter; for state-based laws, the families of these
    // points matter too.
    let reach = f64::from(ratio);
    let alone = ["pmb", "elastic_plastic_pmb", "softening_pmb", "fatigue_pmb"];
    let wide = if alone.iter().any(|name| law.starts_with(name)) {
        reach
    } else {
        2.0 * reach
    };
    let (side, height) = (wide + 0.5, wide);
    let corner = |sign: f64| match dimension {
        "1d" => format!("[{}]", sign * height),
        "3d" => format!("[{0}, {1}, {0}]", sign * side, sign * height),
        _ => format!("[{}, {}]", sign * side, sign * height),
    };
    let origin = match dimension {
        "1d" => "[0]",
        "3d" => "[0.5, 0, 0.5]",
        _ => "[0.5, 0]",
    };
    // Bonds of a softening law break without a damage law.
    let (damage, of_body) = if law.starts_with("softening_pmb") {
        (String::new(), "")
    } else {
        let energy = format!("fracture_energy = {FRACTURE_ENERGY}\nalpha = 0\n{more}");
        (
            format!("[damage.brittle.{rule}]\n{energy}"),
            "damage = 'brittle'",
        )
    };
    format!(
        "dimension = '{dimension}'
        {constraint}
        [grid]
        spacing = 1
        horizon = {ratio}
        origin = {origin}
        volume_correction = 'exact'
        [material]
        rubber.{law}
        {damage}
        [body.block]
        material = 'rubber'
        {of_body}
        shape.box = {{ lower = {}, upper = {} }}
        [time]
        end = 1
        ",
        corner(-1.0),
        corner(1.0),
    )
}

/// Motion of the upper half of a body.
#[derive(Debug, Clone, Copy)]
enum Mode {
    /// Along the normal of the cut.
    Opening,
    /// First by this distance (m) along the cut, then along the normal of the cut.
    SlideAndOpening(f64),
    /// At this angle (degrees) to the normal of the cut.
    Slanted(f64),
}

/// Return the energy per area that separates the upper half, divided by G0. The opening grows by the fraction
/// `growth` per step.
fn cost<const D: usize>(dimension: &str, ratio: u32, law: &str, rule: &str, growth: f64) -> f64 {
    cost_in::<D>(Mode::Opening, dimension, ratio, law, rule, growth)
}

/// Same as [`cost`], for any [`Mode`] of motion.
fn cost_in<const D: usize>(
    mode: Mode,
    dimension: &str,
    ratio: u32,
    law: &str,
    rule: &str,
    growth: f64,
) -> f64 {
    cost_of_deck::<D>(mode, &text(dimension, ratio, law, rule), growth)
}

/// Same as [`cost_in`], for a deck with one or several bodies as in [`text`].
fn cost_of_deck<const D: usize>(mode: Mode, deck: &str, growth: f64) -> f64 {
    let pulled_only = !deck.contains("tension_only = false");
    simulate::<D, _>(deck, |mut simulation| {
        // Axis of the normal of the cut. Slides are along the first of the other axes.
        let axis = if D == 1 { 0 } else { 1 };
        let horizon = simulation.problem.horizon;
        let mut grow = |end: f64, moved: &dyn Fn(f64) -> [f64; 2]| {
            let mut size = 4e-3;
            while size < end {
                let [along, open] = moved(size);
                displace(&mut simulation, |mut x| {
                    if x[axis] > 0.0 {
                        x[0] += along;
                        x[axis] += open;
                    }
                    x
                });
                size *= 1.0 + growth;
            }
        };
        match mode {
            // Softening bonds carry force up to larger stretches.
            Mode::Opening if deck.contains("softening_pmb") => grow(20.0, &|size| [0.0, size]),
            Mode::Opening => grow(0.5, &|size| [0.0, size]),
            Mode::SlideAndOpening(slide) => {
                grow(slide, &|size| [size, 0.0]);
                grow(1.0, &|size| [slide, size]);
            }
            // Bonds that are inclined against the motion become shorter at first, so they break only after a
            // longer motion.
            Mode::Slanted(angle) => {
                let (sin, cos) = angle.to_radians().sin_cos();
                let end = horizon * if pulled_only { 2.2 } else { 0.4 };
                grow(end, &|size| [sin * size, cos * size]);
            }
        }
        let stored = simulation.forces.stored(&simulation.model);
        let model = &simulation.model;
        let on_line = |point: &usize| {
            let place = model.position(*point);
            (0..D).all(|k| k == axis || place[k].abs() < 1e-9)
        };
        let line = (0..model.owned()).filter(on_line);
        // A bond that has yielded releases only the energy that it has not dissipated before, so both
        // energies count.
        let fields = &simulation.fields;
        let [freed, overshoot] =
            [&fields.freed_energy, &fields.overshoot_energy].map(|field| field.as_ref().unwrap());
        let cost = line.map(|point| {
            let dissipated = stored.dissipated.get(point).copied();
            freed[point] - overshoot[point] + dissipated.unwrap_or(0.0) * model.volume[point]
        });
        cost.sum::<f64>() / FRACTURE_ENERGY
    })
}

const STRETCH: &str = "critical_stretch";

const ENERGY: &str = "energy";

const PMB: &str = "pmb = { density = 1, youngs_modulus = 3e3 }";
const NORMALISED: &str = "normalised_pmb = { density = 1, youngs_modulus = 3e3 }";
const DIEHL: &str = "normalised_pmb = { density = 1, youngs_modulus = 3e3, form = 'diehl2016' }";

fn ordinary(ratio: f64, influence: &str) -> String {
    format!(
        "ordinary = {{ density = 1, youngs_modulus = 3e3, poisson_ratio = {ratio}, influence = '{influence}' }}"
    )
}

/// Assert that the costs at two values of m have at most these relative errors, and that the error at the
/// second m is smaller. `expected` is the expected cost as a fraction of G0.
fn compare(case: &str, costs: [f64; 2], expected: f64, [coarse, fine]: [f64; 2]) {
    let errors = costs.map(|cost| (cost / expected - 1.0).abs());
    assert!(errors[0] < coarse && errors[1] < fine, "{case}: {costs:?}");
    assert!(errors[1] < 0.7 * errors[0], "{case}: {costs:?}");
}

fn in_a_bar(law: &str) {
    for constraint in ["uniaxial-stress", "uniaxial-strain"] {
        let costs = [3, 6].map(|ratio| cost::<1>(constraint, ratio, law, STRETCH, 0.001));
        compare(&format!("{constraint} {law}"), costs, 1.0, [0.06, 0.018]);
    }
}

fn in_the_plane(law: &str, expected: f64) {
    for dimension in ["plane-strain", "plane-stress"] {
        let costs = [3, 6].map(|ratio| cost::<2>(dimension, ratio, law, STRETCH, 0.004));
        compare(
            &format!("{dimension} {law}"),
            costs,
            expected,
            [0.04, 0.013],
        );
    }
}

fn in_space(law: &str, ratios: [u32; 2]) {
    let costs = ratios.map(|ratio| cost::<3>("3d", ratio, law, STRETCH, 0.01));
    compare(&format!("3d {law}"), costs, 1.0, [0.06, 0.03]);
}

#[test]
fn of_the_prototype_law() {
    in_a_bar(PMB);
    in_the_plane(PMB, 1.0);
    in_space(PMB, [2, 4]);
}

#[test]
fn of_the_elastic_plastic_law() {
    // Without yielding, the bonds of the coarsest lattice would break at a stretch of about 0.02, so they
    // yield before they break.
    let law = "elastic_plastic_pmb = { density = 1, youngs_modulus = 3e3, yield_stretch = 0.008 }";
    in_a_bar(law);
    in_the_plane(law, 1.0);
    in_space(law, [2, 4]);
    // With this yield stretch, bonds break before they yield.
    let law = "elastic_plastic_pmb = { density = 1, youngs_modulus = 3e3, yield_stretch = 0.05 }";
    in_the_plane(law, 1.0);
}

#[test]
fn of_the_softening_law() {
    // Without softening, the bonds of the coarsest lattice would break at a stretch of about 0.02, so they
    // soften before. The dissipated energy follows from the largest stretch, so that steps may be long.
    for curve in ["bilinear", "trilinear", "exponential"] {
        let law = format!(
            "softening_pmb = {{ density = 1, youngs_modulus = 3e3, strength_stretch = 0.005, \
             fracture_energy = {FRACTURE_ENERGY}, curve = '{curve}' }}"
        );
        for setting in ["uniaxial-stress", "uniaxial-strain"] {
            let costs = [3, 6].map(|ratio| cost::<1>(setting, ratio, &law, "", 0.02));
            compare(&format!("{setting} {curve}"), costs, 1.0, [0.06, 0.018]);
        }
        for setting in ["plane-stress", "plane-strain"] {
            let costs = [3, 6].map(|ratio| cost::<2>(setting, ratio, &law, "", 0.02));
            compare(&format!("{setting} {curve}"), costs, 1.0, [0.04, 0.013]);
        }
        let costs = [2, 3].map(|ratio| cost::<3>("3d", ratio, &law, "", 0.05));
        compare(&format!("3d {curve}"), costs, 1.0, [0.06, 0.03]);
    }
}

#[test]
fn of_the_law_with_fatigue() {
    // Without cycles, bonds break by the damage law only.
    let law = "fatigue_pmb = { density = 1, youngs_modulus = 3e3, cycles_per_second = 1, fatigue_coefficient = 1, \
               fatigue_exponent = 1 }";
    in_a_bar(law);
    in_the_plane(law, 1.0);
}

#[test]
fn of_the_normalised_law() {
    in_a_bar(NORMALISED);
    in_the_plane(NORMALISED, 1.0);
    in_space(NORMALISED, [2, 3]);
}

#[test]
fn of_the_normalised_law_as_printed() {
    // In the plane, eq. 16 of Diehl & Schweitzer (2016) for the critical stretch counts the energy of each
    // bond twice, so an opening costs half of G0.
    in_the_plane(DIEHL, 0.5);
    in_space(DIEHL, [2, 3]);
}

#[test]
fn of_the_ordinary_law_in_the_plane() {
    in_the_plane(&ordinary(0.1, "constant"), 1.0);
}

#[test]
fn of_the_ordinary_law_in_the_plane_with_another_influence() {
    in_the_plane(&ordinary(0.45, "inverse"), 1.0);
}

#[test]
fn of_the_ordinary_law_in_space() {
    in_space(&ordinary(0.1, "constant"), [2, 3]);
}

const CORRESPONDENCE: &str =
    "correspondence = { density = 1, youngs_modulus = 3e3, poisson_ratio = 0.3 }";

/// Correspondence with the zero-energy control of Wan et al. (2019).
const WAN: &str = "correspondence = { density = 1, youngs_modulus = 3e3, poisson_ratio = 0.3, zero_energy = 'wan2019' }";

#[test]
fn by_the_energy_of_bonds_of_bond_based_laws() {
    // The energy of a bond of these laws follows from its stretch, so both rules break a bond at the same
    // stretch.
    let plastic =
        "elastic_plastic_pmb = { density = 1, youngs_modulus = 3e3, yield_stretch = 0.008 }";
    for law in [PMB, plastic, NORMALISED] {
        let [by_stretch, by_energy] =
            [STRETCH, ENERGY].map(|rule| cost::<2>("plane-stress", 3, law, rule, 0.01));
        assert_eq!(by_energy, by_stretch, "{law}");
    }
}

/// Assert that the costs of damage by energy lie in these ranges: in plane strain and plane stress with m = 3
/// and m = 6, and in 3-D with m = 2. The opening grows by the fraction `growth` per step.
fn by_energy(law: &str, growth: f64, [strain, stress, space]: [Range<f64>; 3]) {
    for (dimension, range) in [("plane-strain", strain), ("plane-stress", stress)] {
        for ratio in [3, 6] {
            let cost = cost::<2>(dimension, ratio, law, ENERGY, growth);
            assert!(range.contains(&cost), "{law} {dimension} {ratio}: {cost}");
        }
    }
    let cost = cost::<3>("3d", 2, law, ENERGY, growth);
    assert!(space.contains(&cost), "{law} 3d: {cost}");
}

#[test]
fn by_the_energy_of_bonds_of_correspondence() {
    // A broken bond changes the deformation gradients of both ends, and thus the energies of the other bonds
    // of both ends. The total cost therefore differs from the sum of the energies of the bonds at their
    // breaking.
    by_energy(CORRESPONDENCE, 0.01, [0.93..1.02, 0.95..1.01, 0.85..0.9]);
    by_energy(WAN, 0.01, [0.78..0.85, 0.77..0.85, 0.66..0.71]);
}

#[test]
fn by_the_energy_of_bonds_of_bond_associated_correspondence() {
    let law = format!("bond_associated_{CORRESPONDENCE}");
    // This law has three passes over the bonds per step, so the steps are longer.
    by_energy(&law, 0.02, [0.96..1.03, 0.96..1.03, 0.98..1.06]);
}

#[test]
fn by_the_energy_of_bonds_of_the_ordinary_law() {
    // A broken bond changes the energy of the other bonds of both ends. The released energy exceeds the
    // energy of the broken bonds if ν is above the ratio of a bond-based law (1/4, or 1/3 in plane stress),
    // and is smaller otherwise.
    let [low, high] = [0.1, 0.4].map(|ratio| ordinary(ratio, "constant"));
    by_energy(&low, 0.01, [0.94..0.96, 0.94..0.96, 0.9..0.93]);
    by_energy(&high, 0.01, [1.1..1.15, 1.0..1.02, 1.05..1.1]);
}

#[test]
fn what_a_survey_says_of_parting() {
    for (law, bound) in [(PMB, 1e-3), (&*ordinary(0.4, "constant"), 0.01)] {
        let found = |dimension, ratio, angle: f64| {
            let problem = problem(&text(dimension, ratio, law, ENERGY));
            separation_energy_ratio(&problem, 0, angle.to_radians()).unwrap()
        };
        let pairs = [
            (
                cost::<2>("plane-strain", 3, law, ENERGY, 0.01),
                found("plane-strain", 3, 0.0),
            ),
            (cost::<3>("3d", 2, law, ENERGY, 0.01), found("3d", 2, 0.0)),
        ];
        for (wanted, found) in pairs {
            assert!(
                (found / wanted - 1.0).abs() < bound,
                "{law}: {found} for {wanted}"
            );
        }
    }
    let line = problem(&text("1d", 3, PMB, STRETCH));
    let wanted = cost::<1>("1d", 3, PMB, STRETCH, 0.01);
    assert!((separation_energy_ratio(&line, 0, 0.0).unwrap() / wanted - 1.0).abs() < 1e-3);
    // A given critical stretch has no fracture energy, hence no ratio.
    let stretch = text("1d", 3, PMB, STRETCH).replace("fracture_energy", "critical_stretch");
    assert_eq!(separation_energy_ratio(&problem(&stretch), 0, 0.0), None);
}

#[test]
fn calibrated_by_opening() {
    let rule = "energy calibration = 'opening'";
    // With correspondence, the cost varies by some per cent with the order in which bonds break.
    for (law, bound) in [(CORRESPONDENCE, 0.05), (&*ordinary(0.4, "constant"), 0.01)] {
        for (dimension, ratio) in [("plane-strain", 3), ("plane-stress", 4), ("3d", 2)] {
            let problem = problem(&text(dimension, ratio, law, rule));
            let problem = calibrated(&problem).unwrap();
            let cost = separation_energy_ratio(&problem, 0, 0.0).unwrap();
            assert!((cost - 1.0).abs() < bound, "{law} {dimension}: {cost}");
        }
    }
    // Without `calibration = 'opening'`, nothing is computed.
    let plain = problem(&text("plane-strain", 3, PMB, ENERGY));
    assert!(matches!(calibrated(&plain), Ok(Cow::Borrowed(_))));
    let large = problem(&text("3d", 9, CORRESPONDENCE, rule));
    let error = calibrated(&large).unwrap_err();
    let wanted = "[body.block] damage: `calibration = \"opening\"` needs a body on a lattice";
    assert!(error.message.starts_with(wanted), "{error}");
    assert_eq!(error.span, Some(large.bodies[0].span.clone()));
    let (unmeasured, comm) = (
        problem(&text("plane-strain", 3, CORRESPONDENCE, rule)),
        alone(),
    );
    let error = Simulation::<2>::new(&unmeasured, &comm).err().unwrap();
    assert!(error.message.contains("is not known"), "{error}");
}

/// Return the costs of a law in plane strain: for a slide followed by an opening, and for a slanted motion.
fn of_mixed_modes(law: &str, rule: &str) -> [f64; 2] {
    let of = |mode, growth| cost_in::<2>(mode, "plane-strain", 4, law, rule, growth);
    [
        of(Mode::SlideAndOpening(0.1), 0.004),
        of(Mode::Slanted(45.0), 0.01),
    ]
}

#[test]
fn of_mixed_modes_by_stretch_and_by_energy() {
    let near = |cost: f64, wanted: f64, bound: f64| {
        assert!((cost - wanted).abs() < bound, "{cost} for {wanted}");
    };
    // With `pmb`, the energy of a bond when it breaks does not depend on the path to this stretch.
    for rule in [STRETCH, ENERGY] {
        for cost in of_mixed_modes(PMB, rule) {
            near(cost, 1.0, 0.03);
        }
    }
    // The critical stretch of the ordinary law is calibrated for an opening. In an opening, the dilatation
    // adds or releases energy, so the other modes cost more or less than G0.
    let [slide, slanted] = of_mixed_modes(&ordinary(0.1, "constant"), STRETCH);
    assert!(slide > 1.1 && slanted > 1.06, "{slide} {slanted}");
    let [slide, slanted] = of_mixed_modes(&ordinary(0.4, "constant"), STRETCH);
    assert!(slide < 0.7 && slanted < 0.85, "{slide} {slanted}");
    let [slide, slanted] = of_mixed_modes(&ordinary(0.1, "constant"), ENERGY);
    near(slide, 1.0, 0.05);
    near(slanted, 1.0, 0.05);
    let [slide, slanted] = of_mixed_modes(&ordinary(0.4, "constant"), ENERGY);
    near(slide, 1.0, 0.1);
    near(slanted, 1.0, 0.05);
}

#[test]
fn of_mixed_modes_of_correspondence() {
    let of = |law: &str, rule| {
        let mode = Mode::SlideAndOpening(0.1);
        cost_in::<2>(mode, "plane-strain", 4, law, rule, 0.01)
    };
    // In a slide, the compressed bonds determine the deformation gradient. If they cannot break, the other
    // bonds break late.
    for (law, tension, both) in [
        (WAN, 0.44..0.54, 0.75..0.9),
        (CORRESPONDENCE, 0.98..1.1, 0.85..1.1),
    ] {
        let pulled = of(law, ENERGY);
        assert!(tension.contains(&pulled), "{law}: {pulled}");
        let either = of(law, "energy tension_only = false");
        assert!(both.contains(&either), "{law}: {either}");
    }
    // The delay is smaller if each bond has its own deformation gradient.
    let associated = of(&format!("bond_associated_{CORRESPONDENCE}"), ENERGY);
    assert!((0.85..0.98).contains(&associated), "{associated}");
}

#[test]
fn of_all_modes_by_energy_where_pressed_bonds_break_too() {
    let associated = format!("bond_associated_{CORRESPONDENCE}");
    // Numbers of docs/src/theory/damage.md. The numbers of correspondence scatter by some per cent.
    for (law, plane, space) in [
        (ordinary(0.1, "constant"), 0.94..1.01, 0.9..0.97),
        (ordinary(0.4, "constant"), 0.97..1.14, 0.95..1.09),
        (WAN.to_owned(), 0.74..0.87, 0.66..0.79),
        (CORRESPONDENCE.to_owned(), 0.94..1.08, 0.84..1.02),
        (associated.clone(), 0.9..1.03, 0.85..1.06),
    ] {
        // The bond-associated law has three passes over the bonds per evaluation of the forces. Its
        // displacement grows by larger increments, to limit the time of the test.
        let growth = if law == associated { 0.02 } else { 0.01 };
        for angle in [0.0, 45.0, 90.0] {
            let (mode, rule) = (Mode::Slanted(angle), "energy tension_only = false");
            let cost = cost_in::<2>(mode, "plane-strain", 4, &law, rule, growth);
            assert!(plane.contains(&cost), "{law} {angle}: {cost}");
            let cost = cost_in::<3>(mode, "3d", 2, &law, rule, growth);
            assert!(space.contains(&cost), "{law} 3d {angle}: {cost}");
        }
    }
}

/// Return the deck of [`text`] with two bodies that meet at the cut; `rule` applies to bonds between them
/// only. `own` has the keys of `[damage.own.…]`, the damage law of the bodies; `None` for bodies without
/// damage.
fn pair_text(dimension: &str, ratio: u32, law: &str, rule: &str, own: Option<&str>) -> String {
    let whole = text(dimension, ratio, law, rule);
    let (before, body) = whole.split_once("[body.block]").unwrap();
    let damage = own.map_or("", |_| "damage = 'own'");
    let corners = body.split_once("shape.box").unwrap().1;
    let part = |name: &str, lower: bool| {
        let vector = |text: &str| -> Vec<String> {
            let inside = text.split_once('[').unwrap().1.split_once(']').unwrap().0;
            inside.split(", ").map(str::to_owned).collect()
        };
        let (first, second) = corners.split_once("upper").unwrap();
        let mut corners = [vector(first), vector(second)];
        let axis = usize::from(corners[0].len() > 1);
        corners[usize::from(lower)][axis] = "0".to_owned();
        let [from, to] = corners.map(|corner| corner.join(", "));
        format!(
            "[body.{name}]
            material = 'rubber'
            {damage}
            shape.box = {{ lower = [{from}], upper = [{to}] }}
            "
        )
    };
    let own = own.map_or(String::new(), |keys| format!("damage.own.{keys}"));
    format!(
        "{before}
        [interface.pair.glue]
        bodies = ['upper', 'lower']
        damage = 'brittle'
        {}{}
        [time]
        end = 1
        ",
        part("lower", true),
        part("upper", false)
    )
    .replacen("[grid]", &format!("{own}\n[grid]"), 1)
}

#[test]
fn in_a_pair_of_bodies_with_damage_of_its_own() {
    let tough = format!(
        "{STRETCH} = {{ fracture_energy = {} }}",
        8.0 * FRACTURE_ENERGY
    );
    let weak = format!(
        "{STRETCH} = {{ fracture_energy = {} }}",
        FRACTURE_ENERGY / 8.0
    );
    let tough_by_work = tough.replace(STRETCH, ENERGY);
    let soft = ordinary(0.1, "constant");
    for (law, rule, owns) in [
        (PMB, STRETCH, vec![None, Some(&tough), Some(&weak)]),
        (NORMALISED, STRETCH, vec![Some(&tough)]),
        (&*soft, STRETCH, vec![None]),
        // Bonds between the bodies break by energy. Bonds within a body never break, or break by stretch.
        (&*soft, ENERGY, vec![None, Some(&tough)]),
        (CORRESPONDENCE, ENERGY, vec![None, Some(&tough_by_work)]),
    ] {
        let whole = cost::<2>("plane-stress", 3, law, rule, 0.02);
        assert!((0.9..1.1).contains(&whole), "{law}: {whole}");
        for own in owns {
            let deck = pair_text("plane-stress", 3, law, rule, own.map(String::as_str));
            let pair = cost_of_deck::<2>(Mode::Opening, &deck, 0.02);
            assert!(
                (pair / whole - 1.0).abs() < 1e-6,
                "{law} {own:?}: {pair} for {whole}"
            );
        }
    }
    let line = cost::<1>("uniaxial-stress", 3, PMB, STRETCH, 0.02);
    let deck = pair_text("uniaxial-stress", 3, PMB, STRETCH, Some(&tough));
    let pair = cost_of_deck::<1>(Mode::Opening, &deck, 0.02);
    assert!((pair / line - 1.0).abs() < 1e-6, "{pair} for {line}");
}

#[test]
fn in_the_bodies_of_a_pair_their_own_damage_counts() {
    // The cut between the halves lies within the lower body, which has the same fracture energy as the block
    // of one body. The bonds between the bodies, above the cut, are weak.
    let within = |own: &str, pair: &str| {
        let deck = pair_text("plane-stress", 3, PMB, STRETCH, Some(own));
        let deck = deck.replace(
            &format!("fracture_energy = {FRACTURE_ENERGY}\n"),
            &format!("{pair}\n"),
        );
        // Move the border between the bodies, but not the cut.
        let deck = deck.replace("upper = [3.5, 0]", "upper = [3.5, 2]");
        let deck = deck.replace("lower = [-3.5, 0]", "lower = [-3.5, 2]");
        cost_of_deck::<2>(Mode::Opening, &deck, 0.02)
    };
    let own = format!("{STRETCH} = {{ fracture_energy = {FRACTURE_ENERGY} }}");
    let whole = cost::<2>("plane-stress", 3, PMB, STRETCH, 0.02);
    // Bonds across the cut that end in the upper body have the fracture energy of the pair.
    let same = within(&own, &format!("fracture_energy = {FRACTURE_ENERGY}"));
    let weak = within(&own, "fracture_energy = 0.02");
    assert!((same / whole - 1.0).abs() < 1e-6, "{same} for {whole}");
    assert!(
        weak < 0.995 * whole && weak > 0.7 * whole,
        "{weak} of {whole}"
    );
}

#[test]
fn in_a_pair_that_never_breaks() {
    let weak = format!(
        "{STRETCH} = {{ fracture_energy = {} }}",
        FRACTURE_ENERGY / 8.0
    );
    let deck = pair_text("plane-stress", 3, PMB, STRETCH, Some(&weak));
    let deck = deck.replace("damage = 'brittle'", "damage = 'none'");
    simulate::<2, _>(&deck, |mut simulation| {
        let is_upper = |y: f64| y > 0.0;
        displace(&mut simulation, |[x, y, z]| {
            [x, if is_upper(y) { y + 0.5 } else { y }, z]
        });
        let mut broken = 0;
        simulation.forces.for_each_broken(|_, _| broken += 1);
        assert_eq!(broken, 0);
        // Bonds within the bodies break.
        displace(&mut simulation, |[x, y, z]| [x, 1.2 * y, z]);
        let mut within = [0, 0];
        let model = &simulation.model;
        simulation.forces.for_each_broken(|i, j| {
            let [a, b] = [i, j].map(|point| is_upper(model.position(point)[1]));
            within[usize::from(a == b)] += 1;
        });
        assert!(within[0] == 0 && within[1] > 0, "{within:?}");
    });
}

#[test]
fn in_a_pair_of_unlike_bodies() {
    // The bodies have different moduli and horizons. Opening a crack within a body would cost 100 times as
    // much.
    let cost = |law: [&str; 2], rule: &str, spacing: f64| {
        let text = format!(
            "dimension = 'plane-strain'
            grid = {{ spacing = {spacing}, horizon = 3 }}
            material.soft.{}
            material.hard.{}
            damage.glue.{rule} = {{ fracture_energy = {FRACTURE_ENERGY} }}
            damage.tough.{rule} = {{ fracture_energy = '100*{FRACTURE_ENERGY}' }}
            body.soft = {{ material = 'soft', damage = 'tough', shape.box = {{ lower = [0, 0], upper = [24, 6] }} }}
            [body.hard]
            material = 'hard'
            damage = 'tough'
            spacing = '{spacing}/2'
            horizon = 1.5
            shape.box = {{ lower = [0, 6], upper = [24, 10] }}
            [interface.pair.glue]
            bodies = ['soft', 'hard']
            damage = 'glue'
            [time]
            end = 1
            ",
            law[0], law[1]
        );
        opening_cost(&text, 6.0)
    };
    let hard = PMB.replace("3e3", "12e3");
    // An independent program has summed ¼ Σ_e k_e w_e m_e² |ξ| V_i V_j over the bonds of the two grids. Bonds
    // are missing at the left and right sides, so the sums do not converge to 1 but to a smaller value.
    for (spacing, sum) in [(1.0, 1.01697), (0.5, 0.97600)] {
        let cost = cost([PMB, &hard], STRETCH, spacing);
        assert!((cost - sum).abs() < 2e-4, "{spacing}: {cost}");
    }
    let hard = ordinary(0.2, "constant").replace("3e3", "12e3");
    let soft = ordinary(0.2, "constant");
    let by_work = cost([&soft, &hard], ENERGY, 1.0);
    assert!((0.8..1.05).contains(&by_work), "{by_work}");
}

/// Return the energy per area of an opening at a height in two bodies that meet at y = 7, divided by G0.
/// `spacing` is the spacing of the lower body; the upper body has half its spacing and half its horizon.
fn cost_at(height: f64, law: &str, rule: &str, spacing: f64) -> f64 {
    let (rule, more) = rule.split_once(' ').unwrap_or((rule, ""));
    let text = format!(
        "dimension = 'plane-strain'
        grid = {{ spacing = {spacing}, horizon = 3 }}
        material.rubber.{law}
        damage.brittle.{rule} = {{ fracture_energy = {FRACTURE_ENERGY}, {more} }}
        body.coarse = {{ material = 'rubber', damage = 'brittle', shape.box = {{ lower = [0, 0], upper = [24, 7] }} }}
        [body.fine]
        material = 'rubber'
        damage = 'brittle'
        spacing = '{spacing}/2'
        horizon = 1.5
        shape.box = {{ lower = [0, 7], upper = [24, 14] }}
        [time]
        end = 1
        "
    );
    opening_cost(&text, height)
}

/// Return the energy per area of an opening at a height in a plate 24 m wide, divided by G0.
fn opening_cost(text: &str, height: f64) -> f64 {
    simulate::<2, _>(text, |mut simulation| {
        let mut opening = 1e-2;
        while opening < 0.4 {
            displace(&mut simulation, |[x, y, z]| {
                [x, if y > height { y + opening } else { y }, z]
            });
            opening *= 1.02;
        }
        let fields = &simulation.fields;
        let [freed, late] =
            [&fields.freed_energy, &fields.overshoot_energy].map(|field| field.as_ref().unwrap());
        let cost: f64 = freed
            .iter()
            .zip(late)
            .map(|(freed, late)| freed - late)
            .sum();
        cost / (24.0 * FRACTURE_ENERGY)
    })
}

#[test]
fn between_bodies_of_different_horizons_by_energy() {
    for (law, rule) in [
        (ordinary(0.3, "constant"), "energy alpha = 0.25"),
        ("ordinary_viscoelastic = { density = 1, youngs_modulus = 3e3, poisson_ratio = 0.3, relaxation_time = 1, relaxing_share = 0.5 }".to_owned(), "energy"),
        ("correspondence = { density = 1, youngs_modulus = 3e3, poisson_ratio = 0.3 }".to_owned(), "energy"),
        ("bond_associated_correspondence = { density = 1, youngs_modulus = 3e3, poisson_ratio = 0.3 }".to_owned(), "energy"),
    ] {
        let [coarse, border, fine] = [4.0, 7.0, 10.0].map(|y| cost_at(y, &law, rule, 1.0));
        let inside = 0.5 * (coarse + fine);
        let case = format!("{law} {rule}: {coarse} {border} {fine}");
        assert!((0.8..1.2).contains(&inside), "{case}");
        // At the border, the spacings on both sides differ. A sum over bonds is then not a midpoint rule, so
        // its error is larger than inside. With correspondence, the cost also varies by some per cent with
        // the order in which bonds break.
        assert!((border / inside - 1.0).abs() < 0.12, "{case}");
    }
}

#[test]
fn between_bodies_of_different_horizons_by_stretch() {
    let tensor = "pmb = { density = 1, youngs_modulus = 3e3, surface_correction = 'tensor' }";
    let pmb = "pmb = { density = 1, youngs_modulus = 3e3 }";
    let pals = "ordinary = { density = 1, youngs_modulus = 3e3, poisson_ratio = 0.3, surface_correction = 'pals' }";
    for (law, rule) in [
        (pmb.to_owned(), "critical_stretch"),
        (pmb.to_owned(), "critical_stretch alpha = 0.25"),
        (tensor.to_owned(), "critical_stretch"),
        (tensor.replace("tensor", "directional"), "critical_stretch"),
        (pals.to_owned(), "critical_stretch"),
        (pals.replace("pals", "directional"), "critical_stretch"),
        (ordinary(0.3, "constant"), "critical_stretch"),
    ] {
        let [coarse, border, fine] = [4.0, 7.0, 10.0].map(|y| cost_at(y, &law, rule, 0.5));
        let inside = 0.5 * (coarse + fine);
        let case = format!("{law} {rule}: {coarse} {border} {fine}");
        println!("{case}");
        assert!((0.8..1.2).contains(&inside), "{case}");
        // With spacings of 1 and 0.5, opening the border costs 12 % more than opening the inside: the spacing
        // of 1 is too coarse for the sums over the small horizon of 1.5.
        assert!((border / inside - 1.0).abs() < 0.06, "{case}");
    }
}

/// The volume correction gives a bond different weights at its two ends. Summed over the bonds with these
/// weights, the cost of a joint is 155/144 of the fracture energy.
#[test]
fn between_bars_of_different_horizons_with_volume_correction() {
    let bars = format!(
        "dimension = '1d'
        constraint = 'uniaxial-stress'
        grid = {{ spacing = 1, horizon = 3, volume_correction = 'exact' }}
        material.rubber.{PMB}
        damage.brittle.{STRETCH} = {{ fracture_energy = {FRACTURE_ENERGY} }}
        body.coarse = {{ material = 'rubber', damage = 'brittle', shape.box = {{ lower = [-6], upper = [0] }} }}
        [body.fine]
        material = 'rubber'
        damage = 'brittle'
        spacing = 0.5
        horizon = 1.5
        shape.box = {{ lower = [0], upper = [6] }}
        [time]
        end = 1
        "
    );
    let cost = cost_of_deck::<1>(Mode::Opening, &bars, 0.001);
    assert!((cost * 144.0 / 155.0 - 1.0).abs() < 1e-3, "{cost}");
}

/// Opening the joint of a soft and a stiff body costs the smaller fracture energy of the two bodies.
#[test]
fn between_bars_of_different_moduli() {
    // The sum over the bonds of a uniform bar is 19/18 of the fracture energy.
    let costs = |rule: &str, tougher: &str, interface: &str| {
        let bars = format!(
            "dimension = '1d'
            constraint = 'uniaxial-stress'
            grid = {{ spacing = 1, horizon = 3, volume_correction = 'exact' }}
            material.soft.pmb = {{ density = 1, youngs_modulus = 3e3 }}
            material.hard.pmb = {{ density = 1, youngs_modulus = 9e3 }}
            damage.brittle.{rule} = {{ fracture_energy = {FRACTURE_ENERGY} }}
            damage.tough.{rule} = {{ fracture_energy = '4*{FRACTURE_ENERGY}' }}
            body.left = {{ material = 'soft', damage = 'brittle', shape.box = {{ lower = [-6], upper = [0] }} }}
            body.right = {{ material = 'hard'{tougher}, shape.box = {{ lower = [0], upper = [6] }} }}
            interface.rule = '{interface}'
            [time]
            end = 1
            "
        );
        cost_of_deck::<1>(Mode::Opening, &bars, 0.001)
    };
    for rule in [STRETCH, ENERGY] {
        for tougher in [", damage = 'brittle'", ", damage = 'tough'", ""] {
            for interface in ["own", "average", "minimum"] {
                let cost = costs(rule, tougher, interface);
                let case = format!("{rule} {tougher} {interface}: {cost}");
                assert!((cost * 18.0 / 19.0 - 1.0).abs() < 1e-3, "{case}");
            }
        }
    }
}

/// Return the work ¼ |(T_i − T_j)·η| (J/m⁶) in the last step before a bond of length 1 breaks. In each step,
/// the extension of the bond grows by 0.1 %, so this work is up to 0.2 % below the threshold. The horizon is
/// 1.5, and the thickness is 0.5 in the plane.
fn work_at_breaking<const D: usize>(dimension: &str, calibration: &str) -> f64 {
    let thickness = if D == 2 { "thickness = 0.5" } else { "" };
    let corner = |at: f64| {
        if D == 2 {
            format!("[{at}, 0.5]")
        } else {
            format!("[{at}, 0.5, 0.5]")
        }
    };
    let origin = if D == 2 { "[0, 0]" } else { "[0, 0, 0]" };
    let text = format!(
        "dimension = '{dimension}'
        {thickness}
        grid = {{ spacing = 1, horizon = 1.5, volume_correction = 'none', origin = {origin} }}
        material.rubber.ordinary = {{ density = 1, youngs_modulus = 50, poisson_ratio = 0.3 }}
        damage.brittle.energy = {{ fracture_energy = 0.01, calibration = '{calibration}' }}
        body.bond = {{ material = 'rubber', damage = 'brittle', shape.box = {{ lower = {}, upper = {} }} }}
        time = {{ end = 1, step = 0.01 }}",
        corner(0.0).replace("0.5", "0"),
        corner(2.0).replace("0.5", "1"),
    );
    simulate(&text, |mut simulation: Simulation<D>| {
        assert_eq!(simulation.model.owned(), 2);
        let (mut extension, mut work) = (1e-4, 0.0);
        loop {
            displace(&mut simulation, |[x, y, z]| {
                [if x > 1.0 { x + extension } else { x }, y, z]
            });
            let volume = simulation.model.volume[0];
            let force = simulation.fields.internal_force[0][0] / volume;
            if force == 0.0 {
                return work;
            }
            work = 0.25 * force * extension;
            extension *= 1.001;
            assert!(extension < 1.0, "the bond does not break");
        }
    })
}

#[test]
fn one_bond_breaks_where_the_formulas_of_other_codes_say() {
    let pi = std::f64::consts::PI;
    let (energy, horizon, thickness) = (0.01, 1.5_f64, 0.5);
    let plane = energy / (horizon.powi(3) * thickness);
    let space = energy / (pi * horizon.powi(4));
    let cases = [
        ("energy", 0.5 * 1.5 * plane, Some(0.5 * 4.0 * space)),
        (
            "willberg2022",
            0.25 * 3.0 * plane / pi,
            Some(0.25 * 4.0 * space),
        ),
        ("perilab", 3.0 * plane / pi, Some(4.0 * space)),
        ("peridigm2021", 3.0 * plane, None),
    ];
    for (calibration, in_the_plane, in_space) in cases {
        let found = work_at_breaking::<2>("plane-strain", calibration);
        let ratio = found / in_the_plane;
        assert!((0.998..=1.0).contains(&ratio), "{calibration}: {ratio}");
        if let Some(expected) = in_space {
            let ratio = work_at_breaking::<3>("3d", calibration) / expected;
            assert!(
                (0.998..=1.0).contains(&ratio),
                "{calibration} in space: {ratio}"
            );
        }
    }
}
