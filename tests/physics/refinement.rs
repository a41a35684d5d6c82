//! Refined grids: volumes, forces between levels, energies under a uniform strain.

use fissure::comm::sum::{ExactSum, reduce};
use fissure::solver::Simulation;
use fissure::solver::observers::Snapshot;
use fissure::solver::refinement::Regridded;

use crate::support::{displace, problem, simulate, simulate_on};

/// Return the deck of a plate with a hole, refined twice at the edge of the hole and once in a corner of the
/// plate.
fn plate(more: &str) -> String {
    format!(
        "dimension = 'plane-stress'
        thickness = 0.5
        grid = {{ spacing = 1, horizon = 3 }}
        material.glass.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.plate = {{ material = 'glass', shape.difference = [
            {{ box = {{ lower = [0, 0], upper = [20, 16] }} }}, {{ disc = {{ centre = [10, 8], radius = 2.4 }} }}] }}
        refinement.levels = 2
        refinement.region.near.where = '(x - 13)^2 + (y - 8)^2 < 9'
        refinement.region.corner = {{ where = 'x < 4 && y < 5', level = 1 }}
        time.end = 1
        {more}
        "
    )
}

/// A 3-D block, refined in a corner (twice) and in its middle.
const BLOCK: &str = "dimension = '3d'
    grid = { spacing = 1, horizon = 2.2 }
    material.glass.pmb = { density = 2, youngs_modulus = 5 }
    body.block = { material = 'glass', shape.box = { lower = [0, 0, 0], upper = [9, 8, 7] } }
    refinement.levels = 2
    refinement.region.corner.where = 'x + y + z < 3.2'
    refinement.region.middle = { where = '(x - 4.5)^2 + (y - 4)^2 + (z - 3.5)^2 < 2', level = 1 }
    time.end = 1
    ";

#[test]
fn volumes_add_up_to_that_of_the_cells() {
    for ranks in 1..=3 {
        let volumes = simulate_on::<2, _>(ranks, &plate(""), |simulation| {
            let mut sum = [ExactSum::ZERO];
            let model = &simulation.model;
            for volume in model.volume.iter().take(model.owned()) {
                sum[0].add(volume);
            }
            let cells = 0.5 * model.coarsest as f64;
            (
                reduce(simulation.comm, &mut sum)[0] / cells,
                model.total > model.coarsest,
            )
        });
        for (volume, refined) in volumes {
            assert!((volume - 1.0).abs() < 1e-13 && refined, "{volume}");
        }
    }
    simulate::<3, _>(BLOCK, |simulation| {
        let model = &simulation.model;
        let volume: f64 = model.volume.iter().sum();
        assert!((volume / 504.0 - 1.0).abs() < 1e-13, "{volume}");
        assert!(model.total > 700, "{}", model.total);
    });
}

#[test]
fn ids_depend_on_place_and_level_only() {
    let places = |text: &str, ranks: usize| {
        let found = simulate_on::<2, _>(ranks, text, |simulation| {
            let model = &simulation.model;
            let point = |k: usize| (model.ids[k], model.position(k).map(f64::to_bits));
            (0..model.owned()).map(point).collect::<Vec<_>>()
        });
        let mut all = found.concat();
        all.sort_unstable();
        all
    };
    let all = places(&plate(""), 1);
    assert_eq!(places(&plate(""), 3), all);
    assert!(all.windows(2).all(|pair| pair[0].0 < pair[1].0));
    // With a smaller refined region, all points are also points of the larger region's grid.
    let less = plate("").replace("x < 4 && y < 5", "x < 2 && y < 3");
    let fewer = places(&less, 2);
    assert!(fewer.len() < all.len());
    assert!(fewer.iter().all(|point| all.binary_search(point).is_ok()));
}

/// Return the largest sum of the forces along an axis, divided by the sum of their absolute values.
fn unbalanced<const D: usize>(text: &str) -> f64 {
    simulate::<D, _>(text, |mut simulation| {
        displace(&mut simulation, |place| {
            let wave = |a: f64, b: f64| 0.02 * (a * place[0] + b * place[1] + place[2]).sin();
            [0, 1, 2].map(|k| place[k] + wave(1.0 + k as f64, 1.7))
        });
        let model = &simulation.model;
        let force = &simulation.fields.internal_force;
        let share = |d: usize| {
            let (mut sum, mut size) = (0.0, 0.0);
            for point in 0..model.owned() {
                let own = force[d][point] * model.volume[point];
                sum += own;
                size += own.abs();
            }
            sum.abs() / size
        };
        (0..D).map(share).fold(0.0, f64::max)
    })
}

#[test]
fn action_and_reaction_cancel_across_levels() {
    let rising = "refinement.rule = 'delta-m'";
    let ordinary = plate(rising).replace(
        "glass.pmb = { density = 2, youngs_modulus = 5 }",
        "glass.ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.2 }",
    );
    let exact = plate("grid.volume_correction = 'exact'").replace(
        "grid = { spacing = 1, horizon = 3 }",
        "grid.spacing = 1\ngrid.horizon = 3",
    );
    let mean = "refinement.bonds = 'average'";
    let mean_ordinary = format!("{ordinary}\n{mean}");
    for text in [
        plate(""),
        plate(rising),
        ordinary,
        exact,
        plate(mean),
        mean_ordinary,
    ] {
        let share = unbalanced::<2>(&text);
        assert!(share < 1e-13, "{share}: {text}");
    }
    assert!(unbalanced::<3>(BLOCK) < 1e-13);
}

#[test]
fn horizons_follow_their_rule() {
    let horizons = |more: &str| {
        let problem = problem(&plate(more));
        let mut horizons: Vec<f64> = problem.blocks().map(|block| block.horizon).collect();
        horizons.dedup();
        horizons
    };
    let root = 2.0_f64.sqrt();
    assert_eq!(horizons(""), [3.0, 1.5, 1.5 * root, 0.75, 0.75 * root]);
    // Table 2 of Dipasquale et al. (2014).
    assert_eq!(horizons("refinement.rule = 'delta-m'"), [3.0, 2.0, 1.25]);
    let own = "refinement = { rule = 'delta-m', m = [6, 8], interface_factor = 2 }";
    let own = plate("")
        .replace("refinement.levels = 2", own)
        .replace("rule", "levels = 2, rule");
    let own = own.replace("refinement.region", "# ");
    let problem = problem(&own);
    let horizons: Vec<f64> = problem.blocks().map(|block| block.horizon).collect();
    assert_eq!(horizons, [3.0, 3.0, 3.0, 3.0, 3.0, 6.0, 2.0, 2.0, 4.0]);
}

/// Return the smallest and largest energy density under a uniform strain along x, divided by the energy
/// density of a complete family. Only points farther than 5 m from the sides count.
fn energies(more: &str, region: &str) -> [f64; 2] {
    let text = format!(
        "dimension = 'plane-stress'
        grid.spacing = 1
        grid.horizon = 3
        material.glass.linear_microelastic = {{ density = 1, youngs_modulus = 1 }}
        body.plate = {{ material = 'glass', shape.box = {{ lower = [0, 0], upper = [41, 41] }} }}
        refinement.levels = 1
        refinement.region.middle.where = '{region}'
        {more}
        time.end = 1"
    );
    simulate::<2, _>(&text, |mut simulation| {
        displace(&mut simulation, |[x, y, z]| [1.001 * x, y, z]);
        let snapshot = Snapshot::new(&mut simulation);
        let model = &simulation.model;
        let inside = |x: &f64| (5.0..36.0).contains(x);
        let energy = |k: usize| snapshot.stored.energy[k];
        let points = 0..model.owned();
        let points = points.filter(|k| model.position(*k)[..2].iter().all(inside));
        let points: Vec<usize> = points.collect();
        let at = |place: [f64; 3]| points.iter().find(|k| model.position(**k) == place);
        let whole = energy(*at([6.5, 6.5, 0.0]).expect("a node"));
        let shares = points.iter().map(|k| energy(*k) / whole);
        shares.fold([f64::MAX, f64::MIN], |[least, most], share| {
            [least.min(share), most.max(share)]
        })
    })
}

#[test]
fn a_uniform_strain_has_uniform_energy_but_at_interfaces() {
    let patch = "(x - 20.5)^2 + (y - 20.5)^2 < 9.01";
    for correction in ["none", "linear"] {
        let more = format!("grid.volume_correction = '{correction}'");
        // If the whole plate is refined, each family is a scaled copy of the family on the coarse lattice.
        let [least, most] = energies(&more, "x > -1");
        assert!(
            (least - 1.0).abs() < 1e-9 && (most - 1.0).abs() < 1e-9,
            "{least} {most}"
        );
    }
    // In Dipasquale et al. (2014), table 3, the loss is 10 to 12 %, and 37 % without larger horizons at
    // interfaces.
    let linear = "grid.volume_correction = 'linear'";
    let [least, most] = energies(linear, patch);
    assert!(least > 0.95 && most < 1.10, "{least} {most}");
    let none = "grid.volume_correction = 'none'";
    let [least, most] = energies(none, patch);
    assert!(least > 0.90 && most < 1.32, "{least} {most}");
    let [least, _] = energies(&format!("{none}\nrefinement.interface_factor = 1"), patch);
    assert!(least < 0.5, "{least}");
    let [least, most] = energies("", patch);
    // Measured values, without a theory: 0.930 and 1.083, as in docs/src/theory/refinement.md.
    assert!(least > 0.92 && most < 1.09, "{least} {most}");
}

/// Return the smallest strain energy density in a patch refined twice, divided by the value far from the
/// patch. A strip with fixed lateral displacements is in equilibrium under a strain along x.
fn least_energy_at_rest(bonds: &str) -> f64 {
    let text = format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 1, horizon = 3, volume_correction = 'linear' }}
        material.glass.linear_microelastic = {{ density = 1, youngs_modulus = 1 }}
        body.plate = {{ material = 'glass', shape.box = {{ lower = [0, 0], upper = [41, 31] }} }}
        refinement.levels = 2
        refinement.bonds = '{bonds}'
        refinement.region.outer = {{ where = '(x - 20.5)^2 + (y - 15.5)^2 < 9.01', level = 1 }}
        refinement.region.inner = {{ where = '(x - 20.5)^2 + (y - 15.5)^2 < 2.26', level = 2 }}
        set.left.where = 'x < 3'
        set.right.where = 'x > 38'
        condition.sides = {{ set = 'all', displacement = ['free', 0] }}
        condition.hold = {{ set = 'left', displacement = ['1e-3*x*t', 'free'] }}
        condition.pull = {{ set = 'right', displacement = ['1e-3*x*t', 'free'] }}
        time = {{ end = 1, method = 'relaxation', relaxation = {{ load_steps = 1 }} }}"
    );
    simulate::<2, _>(&text, |mut simulation| {
        while !simulation.is_over() {
            simulation.advance();
            simulation.check().unwrap();
        }
        let snapshot = Snapshot::new(&mut simulation);
        let model = &simulation.model;
        let energy = |k: usize| snapshot.stored.energy[k];
        let near = |k: &usize| {
            let [x, y, _] = model.position(*k);
            (x - 20.5).abs().max((y - 15.5).abs()) < 5.0
        };
        let far = (0..model.owned()).find(|k| model.position(*k)[..2] == [8.5, 15.5]);
        let patch = (0..model.owned()).filter(near).map(energy);
        patch.fold(f64::MAX, f64::min) / energy(far.expect("a node"))
    })
}

#[test]
fn patches_lose_less_with_bonds_of_mean_horizons() {
    let [own, mean] = ["own", "average"].map(least_energy_at_rest);
    // The energy density of a wave, half of which is kinetic, decreases by 17.1 and 8.2 % in such a patch
    // (docs/src/verification/dipasquale.md).
    assert!(own < 0.75, "{own}");
    assert!((0.78..0.9).contains(&mean), "{mean}");
}

#[test]
fn surface_corrections_hold_between_levels() {
    let extremes = |correction: &str, bonds: &str| {
        let text = format!(
            "dimension = 'plane-stress'
            grid = {{ spacing = 1, horizon = 3 }}
            material.glass.pmb = {{ density = 1, youngs_modulus = 5, surface_correction = '{correction}' }}
            body.plate = {{ material = 'glass', shape.box = {{ lower = [-12, -9], upper = [12, 9] }} }}
            refinement = {{ levels = 1, bonds = '{bonds}', region.half.where = 'x > 0' }}
            time.end = 1"
        );
        simulate::<2, _>(&text, |mut simulation| {
            displace(&mut simulation, |place| place.map(|x| (1.0 + 1e-6) * x));
            let snapshot = Snapshot::new(&mut simulation);
            let model = &simulation.model;
            let near = |k: &usize| {
                let [x, y, _] = model.position(*k);
                x.abs() < 5.0 && y.abs() < 2.0
            };
            // E ε²/(1 − ν) with ν = 1/3.
            let exact = 5.0 * 1.5 * 1e-12;
            let ratios = (0..model.owned()).filter(near);
            let ratios = ratios.map(|k| snapshot.stored.energy[k] / exact);
            ratios.fold([f64::MAX, 0.0], |[least, most], ratio| {
                [least.min(ratio), most.max(ratio)]
            })
        })
    };
    // The corrections only approximate the solid at the irregular families between levels, also with "own". A
    // fit with the micromodulus of the point's own block would give 0.58 to 1.24 with "average" and "tensor".
    for (correction, range) in [("tensor", 0.998..1.001), ("directional", 0.97..1.02)] {
        for bonds in ["own", "average"] {
            let found = extremes(correction, bonds);
            let is_near = found.iter().all(|ratio| range.contains(ratio));
            assert!(is_near, "{correction}, {bonds}: {found:?}");
        }
    }
}

/// A notched plate that tears, and is refined where its strain energy is largest: in three places at the end.
const TORN: &str = "dimension = 'plane-stress'
    thickness = 1e-3
    parameters.dx = 1e-3
    grid = { spacing = 'dx', horizon = '3*dx' }
    material.glass.pmb = { density = 2440, youngs_modulus = 72e9 }
    damage.brittle.critical_stretch = { fracture_energy = 5, alpha = 0.25 }
    body.plate = { material = 'glass', damage = 'brittle', shape.box = { lower = [0, -8e-3], upper = [24e-3, 8e-3] } }
    crack.notch.segment = { from = [0, 0], to = ['12*dx', 0] }
    initial.pull.velocity = ['40*sin(200*x)', '2000*y*(1 + 10*x)']
    refinement.levels = 2
    refinement.trigger = { energy = 0.6, damage = 0.5, every_steps = 6 }
    refinement.region.side = { where = 'x > 22*dx', level = 1 }
    time.end = 1e-5
    ";

/// Return the deck [`TORN`] with coarsening: points without a trigger for two evaluations become coarser.
fn torn_and_coarsened() -> String {
    TORN.replace("every_steps = 6", "coarsen_after = 1e-7, every_steps = 6")
}

/// Advance and refine as a run does, with a rebalancing from time to time. Return the numbers of created and
/// removed points.
fn go_on(simulation: &mut Simulation<'_, 2>, steps: u64) -> [u64; 2] {
    let mut change = [0; 2];
    for step in 1..=steps {
        simulation.advance();
        if simulation.is_refinement_due() {
            let Regridded { created, removed } = simulation.refine().unwrap().unwrap_or_default();
            change[0] += created;
            change[1] += removed;
        }
        if step.is_multiple_of(5) && simulation.comm.size() > 1 {
            let unequal = 1000 * (1 + simulation.comm.rank() as u64);
            simulation.repartition(unequal).unwrap();
        }
        simulation.check().unwrap();
    }
    change
}

/// Assert that a run is the same on 1 to 4 ranks, and that it creates and removes at least the numbers of
/// points in `least`.
fn are_the_same(text: &str, least: [u64; 2]) {
    let states = |ranks: usize| {
        let found = simulate_on::<2, _>(ranks, text, |mut simulation| {
            let change = go_on(&mut simulation, 42);
            assert!(change[0] >= least[0] && change[1] >= least[1], "{change:?}");
            let snapshot = Snapshot::new(&mut simulation);
            let (model, fields) = (&simulation.model, &simulation.fields);
            let freed = fields.freed_energy.as_ref().expect("bonds break");
            let state = |k: usize| {
                let numbers = [
                    fields.displacement[0][k],
                    fields.displacement[1][k],
                    fields.velocity[0][k],
                    fields.velocity[1][k],
                    freed[k],
                    snapshot.stored.energy[k],
                    snapshot.damage(&simulation.undeformed.family_volume, k),
                    model.volume[k],
                    simulation.clock.time(),
                    simulation.progress.refined.energy,
                ];
                (model.ids[k], numbers.map(f64::to_bits))
            };
            (0..model.owned()).map(state).collect::<Vec<_>>()
        });
        let mut all = found.concat();
        all.sort_unstable();
        all
    };
    let expected = states(1);
    let broken = |state: &&(u64, [u64; 10])| f64::from_bits(state.1[4]) > 0.0;
    assert!(expected.iter().filter(broken).count() > 10, "no bond broke");
    for ranks in 2..=4 {
        assert!(states(ranks) == expected, "on {ranks} ranks");
    }
}

#[test]
fn refined_runs_are_the_same_on_any_number_of_ranks() {
    are_the_same(TORN, [100, 0]);
}

#[test]
fn runs_that_become_coarser_are_the_same_on_any_number_of_ranks() {
    are_the_same(&torn_and_coarsened(), [200, 100]);
}

#[test]
fn bonds_of_mean_horizons_are_the_same_on_any_number_of_ranks() {
    let mean = "refinement.trigger = { energy = 0.6, damage = 0.5, every_steps = 6 }";
    let text = TORN.replace(mean, &format!("{mean}\n    refinement.bonds = 'average'"));
    assert_ne!(text, TORN);
    are_the_same(&text, [100, 0]);
}

/// Return mass, momentum by component, and released energy.
fn sums(simulation: &Simulation<'_, 2>) -> Vec<f64> {
    let (model, fields) = (&simulation.model, &simulation.fields);
    let freed = fields.freed_energy.as_ref().expect("bonds break");
    let mut sums = [const { ExactSum::ZERO }; 4];
    for point in 0..model.owned() {
        let mass = model.density_of(point) * model.volume[point];
        sums[0].add(mass);
        sums[1].add(mass * fields.velocity[0][point]);
        sums[2].add(mass * fields.velocity[1][point]);
        sums[3].add(freed[point]);
    }
    reduce(simulation.comm, &mut sums)
}

#[test]
fn what_comes_and_goes_keeps_mass_momentum_and_the_energy_set_free() {
    // The velocity is not symmetric, so that both components of the momentum are not zero.
    let text = torn_and_coarsened().replace("2000*y*(1 + 10*x)", "2000*y*(1 + 10*x) + 3");
    for ranks in [1, 3] {
        simulate_on::<2, _>(ranks, &text, |mut simulation| {
            let (mut creations, mut removals) = (0, 0);
            for _ in 0..60 {
                simulation.advance();
                if !simulation.is_refinement_due() {
                    continue;
                }
                let before = sums(&simulation);
                let Regridded { created, removed } =
                    simulation.refine().unwrap().unwrap_or_default();
                creations += created;
                removals += removed;
                let after = sums(&simulation);
                for (before, after) in before.iter().zip(&after) {
                    assert!(
                        (after - before).abs() <= 1e-12 * before.abs(),
                        "{before} {after}"
                    );
                }
            }
            assert!(creations > 100 && removals > 100, "{creations} {removals}");
        });
    }
}

#[test]
fn new_bonds_do_not_join_what_a_crack_has_parted() {
    let text = TORN.replace(
        "energy = 0.6, damage = 0.5, every_steps = 6",
        "where = 'x > 12*dx', every_steps = 1",
    );
    simulate::<2, _>(&text, |mut simulation| {
        // Cut a crack from the tip of the notch to the right, along a row of cell faces.
        let y: Vec<f64> = simulation.model.reference[1].clone();
        let (x, limit) = (simulation.model.reference[0].clone(), 18e-3);
        simulation.forces.cut(
            |_| true,
            |a, b| y[a] * y[b] < 0.0 && 0.5 * (x[a] + x[b]) < limit,
        );
        simulation.advance();
        assert!(simulation.refine().unwrap().unwrap().created > 100);
        let model = &simulation.model;
        let (x, y) = (&model.reference[0], &model.reference[1]);
        let on_the_crack = |k: usize| y[k].abs() < 1e-9 && x[k] < limit - 1e-3;
        assert!(!(0..model.owned()).any(on_the_crack), "born in the crack");
        let mut joined = 0;
        simulation.forces.for_each_intact(|a, b| {
            let above = |point: usize| y[point] > -1e-9;
            let crossing = x[a] + (x[b] - x[a]) * y[a] / (y[a] - y[b]);
            if above(a) != above(b) {
                assert!(
                    crossing > limit - 1e-3,
                    "{} {} {} {}",
                    x[a],
                    y[a],
                    x[b],
                    y[b]
                );
                joined += 1;
            }
        });
        assert!(joined > 0, "nothing joins the halves ahead of the crack");
    });
}

/// Return the sum of the loads by component, N.
fn loads<const D: usize>(text: &str) -> [f64; D] {
    simulate::<D, _>(text, |simulation| {
        let external = simulation.fields.external_force.as_ref().expect("loads");
        let volume = &simulation.model.volume;
        let sum = |d: usize| {
            external[d]
                .iter()
                .zip(volume.iter())
                .map(|(f, v)| f * v)
                .sum()
        };
        std::array::from_fn(sum)
    })
}

#[test]
fn a_load_keeps_its_sum_on_a_refined_layer() {
    let pulled = plate(
        "set.top.where = 'y > 15'
        condition.pull = { set = 'top', traction = [3, 7] }
        condition.side = { set = 'side', force = [0, 11] }
        set.side.where = 'x < 2'",
    );
    for layer in ["y > 12 && x < 9", "x < 9", "y > 15 && x > 3"] {
        let text = pulled.replace("(x - 13)^2 + (y - 8)^2 < 9", layer);
        let [x, y] = loads::<2>(&text);
        // 3 and 7 Pa on 20 m × 0.5 m, and the total force of 11 N on the side.
        assert!((x - 30.0).abs() < 1e-12, "{layer}: {x}");
        assert!((y - 81.0).abs() < 1e-12, "{layer}: {y}");
    }
    let block = format!(
        "{BLOCK}
        set.floor.where = 'z < 2'
        condition.press = {{ set = 'floor', traction = [1, 2, -4], depth = 2 }}"
    );
    let expected = [72.0, 144.0, -288.0];
    for (found, expected) in loads::<3>(&block).into_iter().zip(expected) {
        assert!((found - expected).abs() < 1e-11, "{found} {expected}");
    }
}

#[test]
fn points_are_triggers_only_where_they_may_be() {
    let text = TORN.replace(
        "every_steps = 6",
        "every_steps = 1, only = 'x < 6*dx && t > 1e-7'",
    );
    let text = text
        .replace("energy = 0.6, damage = 0.5", "where = 'true'")
        .replace("'true'", "'y < 0'");
    simulate::<2, _>(&text, |mut simulation| {
        assert!(simulation.is_refinement_due());
        assert_eq!(simulation.refine().unwrap(), None, "at the start");
        go_on(&mut simulation, 8);
        assert!(simulation.clock.time() > 1e-7);
        let model = &simulation.model;
        let fine = |point: &usize| {
            simulation
                .problem
                .block(usize::from(model.block[*point]))
                .level
                > 0
        };
        let born = (0..model.owned())
            .filter(fine)
            .filter(|k| model.reference[0][*k] < 15e-3);
        let (mut number, mut farthest) = (0, 0.0_f64);
        for point in born {
            number += 1;
            farthest = farthest.max(model.reference[0][point]);
        }
        // Each of two levels extends up to a horizon from its triggers.
        assert!(number > 50 && farthest < 12e-3, "{number} {farthest}");
    });
}

#[test]
fn a_trigger_refines_the_next_body_too_on_any_number_of_ranks() {
    // No bonds join the two bodies. The trigger is in the left body, and its horizon reaches into the right
    // body.
    let text = "dimension = 'plane-stress'
        thickness = 1e-3
        parameters.dx = 1e-3
        grid = { spacing = 'dx', horizon = '3*dx' }
        material.glass.pmb = { density = 2440, youngs_modulus = 72e9 }
        body.left = { material = 'glass', shape.box = { lower = [0, 0], upper = [12e-3, 16e-3] } }
        body.right = { material = 'glass', shape.box = { lower = [12e-3, 0], upper = [24e-3, 16e-3] } }
        interface.rule = 'none'
        refinement.levels = 1
        refinement.trigger = { where = 'x > 11*dx && x < 12*dx', every_steps = 1, coarsen_after = 1e-7 }
        time = { end = 1e-5, step = 2e-8 }
        ";
    let points = |ranks: usize| {
        let found = simulate_on::<2, _>(ranks, text, |mut simulation| {
            assert!(simulation.refine().unwrap().is_some());
            let model = &simulation.model;
            let point = |k: usize| (model.ids[k], model.position(k).map(f64::to_bits));
            (0..model.owned()).map(point).collect::<Vec<_>>()
        });
        let mut all = found.concat();
        all.sort_unstable();
        all
    };
    let expected = points(1);
    let is_right = |(_, [x, ..]): &&(u64, [u64; 3])| f64::from_bits(*x) > 12e-3;
    let right = expected.iter().filter(is_right).count();
    assert!(right > 12 * 16, "{right}");
    for ranks in 2..=4 {
        assert!(points(ranks) == expected, "on {ranks} ranks");
    }
}

/// Return the deck of a plate that is refined twice by the trigger in `more`.
fn passing(more: &str) -> String {
    format!(
        "dimension = 'plane-stress'
        thickness = 1e-3
        parameters.dx = 1e-3
        grid = {{ spacing = 'dx', horizon = '3*dx' }}
        material.glass.pmb = {{ density = 2440, youngs_modulus = 72e9 }}
        body.plate = {{ material = 'glass', shape.box = {{ lower = [0, 0], upper = [24e-3, 16e-3] }} }}
        refinement.levels = 2
        refinement.region.corner = {{ where = 'x < 4*dx && y < 4*dx', level = 1 }}
        {more}
        time = {{ end = 1e-5, step = 2e-8 }}
        "
    )
}

#[test]
fn what_was_refined_for_a_while_is_as_it_was_before() {
    // A rigid motion, which refinement and coarsening must not change. The trigger ends at 0.3 µs.
    let text = passing(
        "refinement.trigger = { where = 'x > 10*dx && x < 14*dx && t < 3e-7', every_steps = 5, coarsen_after = 2e-7 }
        initial.drift.velocity = [3, -2]",
    );
    for ranks in [1, 3] {
        simulate_on::<2, _>(ranks, &text, |mut simulation| {
            let volumes = |simulation: &Simulation<'_, 2>| {
                let model = &simulation.model;
                let point = |k: usize| (model.ids[k], model.volume[k].to_bits(), model.block[k]);
                let mut all: Vec<_> = (0..model.owned()).map(point).collect();
                all.sort_unstable();
                all
            };
            let (before, total) = (volumes(&simulation), simulation.model.total);
            let [created, removed] = go_on(&mut simulation, 18);
            assert!(created > 500 && removed < created, "{created} {removed}");
            let [again, rest] = go_on(&mut simulation, 32);
            assert!(
                again == 0 && removed + rest == created,
                "{created} {again} {removed} {rest}"
            );
            assert_eq!(simulation.model.total, total);
            if ranks == 1 {
                assert_eq!(volumes(&simulation), before);
            }
            let (fields, time) = (&simulation.fields, simulation.clock.time());
            for (d, speed) in [3.0, -2.0].into_iter().enumerate() {
                for k in 0..simulation.model.owned() {
                    // The bounds allow for rounding errors of positions of 1e-2 m and displacements of 1e-6
                    // m.
                    let [u, v] = [&fields.displacement, &fields.velocity].map(|field| field[d][k]);
                    assert!((v / speed - 1.0).abs() < 1e-9, "{v}");
                    assert!((u / (speed * time) - 1.0).abs() < 1e-9, "{u}");
                }
            }
        });
    }
}

/// Return the deck of [`passing`] with damage, refined on the right for 0.1 µs.
fn passing_and_brittle() -> String {
    let more = "damage.brittle.critical_stretch = { fracture_energy = 5, alpha = 0 }
        refinement.trigger = { where = 'x > 8*dx && t < 1e-7', every_steps = 1, coarsen_after = 1e-7 }";
    passing(more).replace(
        "material = 'glass',",
        "material = 'glass', damage = 'brittle',",
    )
}

/// Return the x at which the bond between points a and b crosses a height; `None` without a crossing.
fn crosses_at(height: f64, [x, y]: [&[f64]; 2], a: usize, b: usize) -> Option<f64> {
    let share = (height - y[a]) / (y[b] - y[a]);
    ((y[a] - height) * (y[b] - height) < 0.0).then(|| x[a] + share * (x[b] - x[a]))
}

#[test]
fn points_near_a_crack_stay() {
    simulate::<2, _>(&passing_and_brittle(), |mut simulation| {
        simulation.advance();
        simulation.refine().unwrap();
        simulation.advance();
        assert!(simulation.refine().unwrap().unwrap().created > 100);
        let [x, y] = [0, 1].map(|d| simulation.model.reference[d].clone());
        simulation.forces.cut(
            |_| true,
            |a, b| crosses_at(8.1e-3, [&x, &y], a, b).is_some_and(|x| x > 14e-3),
        );
        let [_, removed] = go_on(&mut simulation, 20);
        assert!(removed > 300, "{removed}");
        let model = &simulation.model;
        let [x, y] = [0, 1].map(|d| model.reference[d].as_slice());
        // The finest points near the cut are still there, and no bond across the cut has been created.
        let finest = |k: &usize| simulation.problem.block(usize::from(model.block[*k])).level == 2;
        let stay = (0..model.owned()).filter(finest).filter(|k| x[*k] > 15e-3);
        assert!(stay.count() > 100);
        let mut joined = 0;
        simulation.forces.for_each_intact(|a, b| {
            if let Some(place) = crosses_at(8.1e-3, [x, y], a, b) {
                // Tolerance: half of a coarse spacing beyond the cut, because bonds cross at any angle and
                // cell faces are upright.
                assert!(place < 14.6e-3, "{place}");
                joined += 1;
            }
        });
        assert!(joined > 0);
    });
}

#[test]
fn velocities_that_are_linear_in_place_stay_so() {
    let text = passing(
        "refinement.trigger = { where = 'x > 10*dx && x < 14*dx && t < 1e-7', every_steps = 1, coarsen_after = 1e-9 }
        initial.shear.velocity = ['y', '1e3*(x - 3*dx)']",
    )
    .replace("step = 2e-8", "step = 1e-8");
    simulate::<2, _>(&text, |mut simulation| {
        for _ in 0..10 {
            simulation.clock.advance();
            simulation.refine().unwrap();
        }
        let [mut created, mut removed] = [0, 0];
        for _ in 0..4 {
            simulation.clock.advance();
            let change = simulation.refine().unwrap().unwrap_or_default();
            created += change.created;
            removed += change.removed;
        }
        assert!(created == 0 && removed > 300, "{created} {removed}");
        let (model, velocity) = (&simulation.model, &simulation.fields.velocity);
        for k in 0..model.owned() {
            let [x, y] = [0, 1].map(|d| model.reference[d][k]);
            let expected = [y, 1e3 * (x - 3e-3)];
            for d in 0..2 {
                // The bound allows for rounding errors of velocities up to 20 m/s.
                assert!((velocity[d][k] - expected[d]).abs() < 1e-11, "{x} {y}");
            }
        }
    });
}

#[test]
fn a_crack_of_the_coarse_grid_stays_when_finer_ones_have_come_and_gone() {
    simulate::<2, _>(&passing_and_brittle(), |mut simulation| {
        let [x, y] = [0, 1].map(|d| simulation.model.reference[d].clone());
        simulation.forces.cut(
            |_| true,
            |a, b| crosses_at(8e-3, [&x, &y], a, b).is_some_and(|x| x > 12e-3),
        );
        let mut finest = 0;
        for _ in 0..30 {
            simulation.advance();
            simulation.refine().unwrap();
            let model = &simulation.model;
            let levels = model.block.iter();
            let levels = levels.map(|block| simulation.problem.block(usize::from(*block)).level);
            finest = finest.max(levels.max().unwrap());
            let [x, y] = [0, 1].map(|d| model.reference[d].as_slice());
            let mut joined = 0;
            simulation.forces.for_each_intact(|a, b| {
                if let Some(place) = crosses_at(8e-3, [x, y], a, b) {
                    // Tolerance: one coarse spacing, in which the first separated cell face begins.
                    assert!(place < 13e-3, "{} {} {} {}", x[a], y[a], x[b], y[b]);
                    joined += 1;
                }
            });
            assert!(joined > 0);
        }
        assert_eq!(finest, 2);
    });
}

#[test]
fn the_mean_of_plastic_states_preserves_volume() {
    // The shear differs from row to row. The mean of two tensors C_p⁻¹ whose shears differ by Δ has the
    // determinant 1 + Δ²/4.
    let text = "dimension = 'plane-strain'
        parameters.dx = 1e-3
        grid = { spacing = 'dx', horizon = '2.015*dx', volume_correction = 'none' }
        [material.steel.correspondence]
        density = 8000
        youngs_modulus = 200e9
        poisson_ratio = 0.3
        yield_stress = 200e6
        hardening_modulus = 1e9
        strain_measure = 'logarithmic'
        [body.block]
        material = 'steel'
        shape.box = { lower = [0, 0], upper = ['12*dx', '12*dx'] }
        [condition.shear]
        set = 'all'
        displacement = ['0.1*(y - 6*dx)*abs(y - 6*dx)/dx*min(1, t/5e-7)', 0]
        [refinement]
        levels = 1
        trigger = { where = 'x > 4*dx && x < 8*dx && t > 5e-7 && t < 8e-7', every_steps = 1, coarsen_after = 1e-7 }
        [time]
        end = 2e-6
        step = 5e-8
        ";
    simulate_on::<2, _>(1, text, |mut simulation| {
        let check = |simulation: &Simulation<'_, 2>| {
            let [xx, yy, zz, yz, xz, xy] = simulation.fields.plastic_strain.as_ref().unwrap();
            let flow = simulation.fields.plastic_strain_equivalent.as_ref();
            assert!(flow.unwrap().iter().any(|flow| *flow > 0.2));
            for k in 0..simulation.model.owned() {
                let [a, b, c] = [xx, yy, zz].map(|diagonal| 1.0 + diagonal[k]);
                assert!(yz[k] == 0.0 && xz[k] == 0.0);
                let determinant = c * (a * b - xy[k] * xy[k]);
                assert!((determinant - 1.0).abs() < 1e-8, "{determinant}");
            }
        };
        let [created, _] = go_on(&mut simulation, 14);
        assert!(created > 0);
        check(&simulation);
        let [_, removed] = go_on(&mut simulation, 16);
        assert!(removed > 0);
        check(&simulation);
    });
}
