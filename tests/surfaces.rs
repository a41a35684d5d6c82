//! A strained body breaks at its surfaces where bonds go by their work, for fewer bonds hold the energy of a point
//! there; with `family_correction` no sooner than inside.

use crate::support::{displace, simulate};

const CORRESPONDENCE: &str =
    "correspondence = { density = 1, youngs_modulus = 1, poisson_ratio = 0.3";
const ASSOCIATED: &str =
    "bond_associated_correspondence = { density = 1, youngs_modulus = 1, poisson_ratio = 0.3";
const ORDINARY: &str = "ordinary = { density = 1, youngs_modulus = 1, poisson_ratio = 0.3";

/// The deck of a block of unit spacing; where it is held together, only bonds inside it can break.
fn text(dimension: &str, law: &str, corrected: bool, held: bool) -> String {
    let (half, ratio, lower, upper) = if dimension == "3d" {
        (6, 2, "[-6, -6, -6]", "[6, 6, 6]")
    } else {
        (10, 3, "[-10, -10]", "[10, 10]")
    };
    let inside = half - 2 * ratio;
    let beyond = if dimension == "3d" {
        format!("abs(x) > {inside} || abs(y) > {inside} || abs(z) > {inside}")
    } else {
        format!("abs(x) > {inside} || abs(y) > {inside}")
    };
    let no_failure = if held { "no_failure = ['edge']" } else { "" };
    format!(
        "dimension = '{dimension}'
        [grid]
        spacing = 1
        horizon = {ratio}
        volume_correction = 'exact'
        [material]
        rubber.{law} }}
        [damage.brittle.energy]
        fracture_energy = 1e-3
        family_correction = {corrected}
        {no_failure}
        [set.edge]
        where = '{beyond}'
        [body.block]
        material = 'rubber'
        damage = 'brittle'
        shape.box = {{ lower = {lower}, upper = {upper} }}
        [time]
        end = 1
        "
    )
}

/// The strain along x at which the first bond breaks; that across is `across` of it.
fn strength<const D: usize>(law: &str, corrected: bool, held: bool, across: f64) -> f64 {
    let dimension = if D == 2 { "plane-stress" } else { "3d" };
    simulate::<D, _>(&text(dimension, law, corrected, held), |mut simulation| {
        let mut strain = 7e-3;
        loop {
            displace(&mut simulation, |x| {
                [0, 1, 2].map(|k| x[k] * (1.0 + strain * if k == 0 { 1.0 } else { across }))
            });
            let mut broken = 0;
            simulation.forces.for_each_broken(|_, _| broken += 1);
            if broken > 0 {
                return strain;
            }
            strain *= 1.01;
            assert!(strain < 0.5, "nothing breaks");
        }
    })
}

/// Checks the strains at which a body breaks somewhere, over that at which it breaks inside without the correction:
/// without it, with it, and with it where it is held together at its surface.
fn check<const D: usize>(law: &str, across: f64) {
    let inside = strength::<D>(law, false, true, across);
    let [plain, corrected, corrected_inside] = [(false, false), (true, false), (true, true)]
        .map(|(corrected, held)| strength::<D>(law, corrected, held, across) / inside);
    assert!(plain < 0.75, "{law}: {plain} without the correction");
    // Families of a lattice are not quite a ball inside either.
    assert!(
        (0.93..1.01).contains(&corrected_inside),
        "{law}: {corrected_inside} inside"
    );
    let surface = corrected / corrected_inside;
    assert!(
        (0.915..1.01).contains(&surface),
        "{law}: {surface} at the surface"
    );
}

#[test]
fn a_strained_body_breaks_at_its_surface_no_sooner_than_inside() {
    for law in [CORRESPONDENCE, ASSOCIATED, ORDINARY] {
        for across in [-0.3, 1.0] {
            check::<2>(law, across);
        }
    }
    check::<3>(CORRESPONDENCE, -0.3);
    check::<3>(ORDINARY, -0.3);
}
