//! Problems built in Rust: wrong values are errors that name the item, and no file changes.

use fissure::comm::threads;
use fissure::component::Component;
use fissure::deck;
use fissure::dimension::Dimension;
use fissure::elastic::Isotropic;
use fissure::error::{Error, ErrorKind};
use fissure::expression::Expression;
use fissure::problem::*;
use fissure::run::{Existing, Options, Unobserved};
use fissure::scatter::Weibull;
use fissure::solver::Simulation;
use fissure::solver::calibration::separation_energy_ratio;

use crate::support::command::Folder;

const NAN: f64 = f64::NAN;

fn expression(text: &str) -> Expression {
    Expression::of(text).unwrap()
}

fn constant(value: f64) -> Expression {
    Expression::constant(value)
}

/// Return the problem of a small plate with damage, an initial velocity, a load and a support.
fn plate() -> Problem {
    let dimension = Dimension::PlaneStress { thickness: 1.0 };
    let mut problem = Problem::new(dimension, 3.0, 1.0);
    let elastic = Isotropic {
        youngs_modulus: 5.0,
        poisson_ratio: 1.0 / 3.0,
    };
    let material = Material::new(Law::named("pmb").unwrap(), 2.0, elastic);
    let damage = Damage::new(DamageRule::CriticalStretch, Toughness::FractureEnergy(1.0));
    problem.add_body("plate", material, Some(damage), square(0.0), 1.0);
    let left = problem.add_set("left", Selector::Where(expression("x < 2")));
    let right = problem.add_set("right", Selector::Where(expression("x > 8")));
    let force = Action::BodyForce(vec![constant(0.1), constant(0.0)], vec![1.0; 2]);
    problem.add_condition("pull", right, force);
    let held = Action::Displacement(vec![Some(constant(0.0)), None]);
    problem.add_condition("hold", left, held);
    problem.add_initial_velocity("push", 0, vec![constant(0.1); 2]);
    problem
}

fn square(lower: f64) -> Shape {
    Shape::Box {
        lower: [lower, 0.0, 0.0],
        upper: [lower + 10.0, 10.0, 0.0],
    }
}

/// Refer to the shape, the edges and the origin of the lattice of the plate.
fn lattice(problem: &mut Problem) -> (&mut Shape, &mut [f64; 3], &mut [f64; 3]) {
    match &mut problem.bodies[0].points {
        PointSource::Lattice {
            shape,
            spacing,
            origin,
            ..
        } => (shape, spacing, origin),
        PointSource::File { .. } | PointSource::Mesh { .. } => unreachable!(),
    }
}

fn damage(problem: &mut Problem) -> &mut Damage {
    problem.bodies[0].damage.as_mut().unwrap()
}

fn static_method(load_steps: u64, tolerance: f64) -> Method {
    Method::Static(Static {
        load_steps,
        tolerance,
        max_iterations: 30,
        max_halvings: 2,
    })
}

/// Replace the time settings by two stages; the first ends at `end`, s.
fn stages(problem: &mut Problem, end: f64, acting: usize) {
    let stage = |end: f64| Stage {
        time: Time {
            end,
            ..problem.time
        },
        acting: vec![true; acting],
    };
    problem.stages = vec![stage(end), stage(1.0)];
}

fn refine(problem: &mut Problem, rule: HorizonRule, level: u32) {
    problem.refinement = Some(Refinement {
        span: 0..0,
        levels: 2,
        rule,
        interface_factor: 1.0,
        bonds: InterfaceRule::Own,
        regions: vec![RefinedRegion {
            name: "near".to_owned(),
            span: 0..0,
            level,
            condition: expression("x < 5"),
        }],
        trigger: None,
    });
}

fn statistics(set: usize, component: Component) -> FieldStatistics {
    FieldStatistics {
        name: "mean".to_owned(),
        span: 0..0,
        set,
        field: Field::Displacement,
        component,
        of: vec![Statistic::Mean],
    }
}

fn tip(set: usize, direction: [f64; 3]) -> Tip {
    Tip {
        name: "tip".to_owned(),
        span: 0..0,
        line: Line {
            from: [0.0; 3],
            direction,
        },
        set,
        threshold: 0.3,
    }
}

fn crack_path(name: &str, set: usize) -> CrackPath {
    CrackPath {
        name: name.to_owned(),
        span: 0..0,
        from: [0.0; 3],
        set,
        threshold: 0.3,
    }
}

fn contact(rule: ContactRule, bodies: [&str; 2]) -> Option<Contact> {
    Some(Contact {
        rule: Some(ContactRule::new(ContactModel::Penalty)),
        pairs: vec![ContactPair {
            name: "pair".to_owned(),
            bodies: bodies.map(str::to_owned),
            rule: Some(rule),
        }],
    })
}

fn rigid(radius: f64, motion: RigidMotion) -> Rigid {
    Rigid {
        name: "ball".to_owned(),
        span: 0..0,
        shape: RigidShape::Ball { radius },
        centre: [5.0, 20.0, 0.0],
        motion,
        rule: ContactRule::new(ContactModel::Penalty),
    }
}

/// A part of the message, and the change of the plate that causes it.
type Case = (&'static str, fn(&mut Problem));

const GRID: &[Case] = &[
    ("thickness: must be above 0, is 0", |p| {
        p.dimension = Dimension::PlaneStress { thickness: 0.0 }
    }),
    ("[grid] horizon: must be between", |p| p.horizon = NAN),
    ("[grid] jitter: must be at least 0", |p| {
        p.jitter = Some(Jitter {
            largest_shift: NAN,
            seed: 0,
        })
    }),
    ("[grid] volume_correction", |p| {
        p.jitter = Some(Jitter {
            largest_shift: 0.1,
            seed: 0,
        })
    }),
    ("title: must be one line", |p| p.title = "a\nb".to_owned()),
];

const BODIES: &[Case] = &[
    ("[body]: the problem needs a body", |p| p.bodies.clear()),
    ("[body.plate]: this name is given twice", |p| {
        p.bodies.push(p.bodies[0].clone())
    }),
    ("[body.plate] horizon: must be between", |p| {
        p.bodies[0].horizon = 0.0
    }),
    ("[body.plate] spacing: must be between", |p| {
        *lattice(p).1 = [f64::INFINITY; 3]
    }),
    ("[body.plate] spacing: 4 m is larger", |p| {
        *lattice(p).1 = [4.0; 3]
    }),
    ("[body.plate] origin: must be finite", |p| {
        *lattice(p).2 = [NAN; 3]
    }),
    ("[body.plate] shape upper: must be above", |p| {
        *lattice(p).0 = Shape::Box {
            lower: [1.0; 3],
            upper: [0.0; 3],
        }
    }),
    ("[body.plate] shape difference: needs at least", |p| {
        *lattice(p).0 = Shape::Difference(Vec::new())
    }),
    ("[body.plate] shape union radius: must be above 0", |p| {
        let centre = [0.0; 3];
        *lattice(p).0 = Shape::Union(vec![Shape::Ball {
            centre,
            radius: -1.0,
        }])
    }),
    ("[body.plate] density: must be above 0, is -1", |p| {
        p.bodies[0].material.density = -1.0
    }),
    ("[body.plate] youngs_modulus: must be above 0", |p| {
        p.bodies[0].material.elastic.youngs_modulus = 0.0
    }),
    ("[body.plate] poisson_ratio: must be above -1", |p| {
        p.bodies[0].material.elastic.poisson_ratio = NAN
    }),
    ("[body.plate] poisson_ratio: must be 0.3333", |p| {
        p.bodies[0].material.elastic.poisson_ratio = 0.2
    }),
    ("[body.plate] damping: must be at least 0", |p| {
        p.bodies[0].material.damping = -1.0
    }),
    ("[body.plate] thermal_expansion: must be finite", |p| {
        p.bodies[0].material.expansion.coefficient = NAN
    }),
    ("[body.plate] damage fracture_energy: must be", |p| {
        damage(p).toughness = Toughness::FractureEnergy(-1.0)
    }),
    ("[body.plate] damage alpha: must be", |p| {
        damage(p).alpha = 1.0
    }),
    ("[body.plate] damage weibull_modulus: must be", |p| {
        damage(p).weibull = Some(Weibull {
            modulus: 0.0,
            seed: 0,
        })
    }),
    ("[body.plate] damage no_failure: must be the index", |p| {
        damage(p).no_failure = vec![9]
    }),
    ("[set.left]: this name is given twice", |p| {
        p.add_set("left", Selector::All);
    }),
    ("[set.left]: must be the index of a body", |p| {
        p.sets[2].selector = Selector::Body(1)
    }),
    ("[set.left] where: must not depend on `t`", |p| {
        p.sets[2].selector = Selector::Where(expression("t > 1"))
    }),
    ("[crack.notch.segment] to: must differ", |p| {
        let (from, to) = ([1.0; 3], [1.0; 3]);
        p.add_crack(
            "notch",
            Crack::Segment {
                from,
                to,
                width: 0.0,
            },
        )
    }),
    ("[interface.pair.joint] bodies: no body has the name", |p| {
        p.interface.pairs.push(InterfacePair {
            name: "joint".to_owned(),
            bodies: ["plate".to_owned(), "other".to_owned()],
            rule: InterfaceRule::Own,
            damage: InterfaceDamage::OfBodies,
            span: 0..0,
        })
    }),
    ("[contact.pair.pair] bodies: no body has the name", |p| {
        let rule = ContactRule::new(ContactModel::Penalty);
        p.contact = contact(rule, ["plate", "other"])
    }),
    ("[contact.pair.pair] restitution: must be between", |p| {
        let rule = ContactRule {
            restitution: 0.0,
            ..ContactRule::new(ContactModel::Penalty)
        };
        p.contact = contact(rule, ["plate", "plate"])
    }),
    ("[rigid.ball] radius: must be above 0", |p| {
        p.rigid.push(rigid(0.0, RigidMotion::Driven(Vec::new())))
    }),
    ("[rigid.ball] motion: must have 2 entries", |p| {
        let motion = RigidMotion::Driven(vec![constant(0.0)]);
        p.rigid.push(rigid(1.0, motion))
    }),
    ("[refinement] m: must have 2 entries", |p| {
        refine(p, HorizonRule::DeltaM(vec![3.0]), 1)
    }),
    ("[refinement] m: must be 1 or more, is NaN", |p| {
        refine(p, HorizonRule::DeltaM(vec![NAN; 2]), 1)
    }),
    ("[refinement.region.near] level: must be 1 to", |p| {
        refine(p, HorizonRule::Delta, 3)
    }),
];

const CONDITIONS: &[Case] = &[
    ("[condition.pull]: this name is given twice", |p| {
        p.conditions[1].name = "pull".to_owned()
    }),
    ("[condition.pull] set: must be the index", |p| {
        p.conditions[0].set = 9
    }),
    ("[condition.pull] depth: must be above 0", |p| {
        p.conditions[0].depth = Some(Depth::Given(0.0))
    }),
    ("[condition.pull] body_force: must have 2 entries", |p| {
        p.conditions[0].action = Action::BodyForce(vec![constant(1.0); 3], vec![1.0; 3])
    }),
    ("[condition.pull] body_force factors: must have 2", |p| {
        p.conditions[0].action = Action::BodyForce(vec![constant(1.0); 2], vec![1.0])
    }),
    ("[condition.pull] body_force: must be finite", |p| {
        p.conditions[0].action = Action::BodyForce(vec![constant(NAN); 2], vec![1.0; 2])
    }),
    ("[condition.hold] displacement: must have 2 entries", |p| {
        p.conditions[1].action = Action::Displacement(vec![Some(constant(0.0))])
    }),
    ("[condition.hold] displacement: every component", |p| {
        p.conditions[1].action = Action::Displacement(vec![None; 2])
    }),
    ("[initial.push] set: must be the index", |p| {
        p.initials[0].set = 9
    }),
    ("[initial.push] velocity: must have 2 entries", |p| {
        p.initials[0].velocity = Some((vec![constant(1.0)], 0..0))
    }),
];

const TIME: &[Case] = &[
    ("[time] end: must be above 0, is NaN", |p| p.time.end = NAN),
    ("[time] step: must be above 0, is -0.1", |p| {
        p.time.step = StepRule::Fixed(-0.1)
    }),
    ("[time] step: 2 s is longer", |p| {
        p.time.step = StepRule::Fixed(2.0)
    }),
    ("[time] safety: must be above 0", |p| {
        p.time.step = StepRule::Automatic(2.0)
    }),
    ("[time] density_scale: must be above 0", |p| {
        p.time.density_scale = 0.0
    }),
    ("[time] static load_steps: must be at least 1", |p| {
        p.time.method = static_method(0, 1e-6)
    }),
    ("[time] static tolerance: must be above 0 and", |p| {
        p.time.method = static_method(1, 1.0)
    }),
    ("[time] adaptive reduce: must be above 0", |p| {
        p.time.adaptive = Some(Adaptive {
            most_broken: 1,
            stable_broken: 0,
            steps: 1,
            reduce: 1.0,
            raise: 1.2,
            smallest: None,
            largest: None,
        })
    }),
    ("[[stage]] 2 end: must be above 2 s", |p| stages(p, 2.0, 2)),
    ("[[stage]] 1 acting: must have 2 entries", |p| {
        stages(p, 0.5, 1)
    }),
    ("[initial.push] velocity: initial velocities have no", |p| {
        p.time.method = static_method(1, 1e-6)
    }),
];

const OUTPUTS: &[Case] = &[
    ("[output] every: must be above 0, is NaN", |p| {
        p.output.every = Some(Interval::Seconds(NAN))
    }),
    ("[output] every_steps: must be at least 1", |p| {
        p.output.every = Some(Interval::Steps(0))
    }),
    ("[output] times: must be between 0 and 1 s", |p| {
        p.output.times = vec![2.0]
    }),
    ("[output] fields: `damage` is named twice", |p| {
        p.output.fields = vec![Field::Damage; 2]
    }),
    ("[output] set: must be the index", |p| {
        p.output.set = Some((9, 0..0))
    }),
    ("[output.../x]: the name becomes part of a file", |p| {
        p.further_outputs.push(Output {
            name: Some("../x".to_owned()),
            ..Output::default()
        })
    }),
    ("[checkpoint] every: must be above 0", |p| {
        p.checkpoint = CheckpointRule::WallClock(NAN)
    }),
    ("[balance] every_steps: must be at least 1", |p| {
        p.balance = Some(Balance {
            every_steps: 0,
            imbalance: 2.0,
        })
    }),
    ("[history] every: must be above 0", |p| {
        p.history.every = Some(Interval::SecondsAtSteps {
            seconds: 0.0,
            steps: 1,
        })
    }),
    ("[history] damage_threshold: must be", |p| {
        p.history.damage_threshold = NAN
    }),
    ("[history] reactions: must be the index", |p| {
        p.history.reactions.push(Reaction { set: 9, span: 0..0 })
    }),
    ("[history.field.mean] set: must be the index", |p| {
        let mean = statistics(9, Component::Magnitude);
        p.history.statistics.push(mean)
    }),
    (
        "[history.field.mean] component: `displacement` has no",
        |p| {
            let mean = statistics(0, Component::Entry(2));
            p.history.statistics.push(mean)
        },
    ),
    ("[history.tip.tip] set: must be the index", |p| {
        p.history.tips.push(tip(9, [1.0, 0.0, 0.0]))
    }),
    ("[history.tip.tip] direction: must be a unit vector", |p| {
        p.history.tips.push(tip(0, [0.0; 3]))
    }),
    ("[history.crack.kink] set: must be the index", |p| {
        p.history.cracks.push(crack_path("kink", 9))
    }),
    ("[history.crack.../x]: the name becomes part", |p| {
        p.history.cracks.push(crack_path("../x", 0))
    }),
    ("[history.j_integral.j] layer: must be above 0", |p| {
        p.history.j_integrals.push(JIntegral {
            name: "j".to_owned(),
            span: 0..0,
            lower: [0.0; 3],
            upper: [9.0; 3],
            direction: [1.0, 0.0, 0.0],
            front: None,
            layer: NAN,
        })
    }),
];

#[test]
fn a_wrong_value_is_an_error_that_names_the_item() {
    plate().check().unwrap();
    for (wanted, change) in [GRID, BODIES, CONDITIONS, TIME, OUTPUTS].concat() {
        let mut problem = plate();
        change(&mut problem);
        let error = problem.check().err().unwrap_or_else(|| {
            panic!("no error, but the message should contain: {wanted}");
        });
        assert_eq!(error.kind, ErrorKind::Input, "{error}");
        assert!(error.message.contains(wanted), "{wanted}: {error}");
        let comm = threads::alone();
        let set_up = Simulation::<2>::new(&problem, &comm);
        assert_eq!(set_up.err().unwrap().message, error.message);
    }
}

/// Run a problem in a folder, and return the error.
fn failure(problem: &Problem, options: Options) -> Error {
    let run = fissure::run(problem, &threads::alone(), options, &mut Unobserved);
    run.unwrap_err()
}

#[test]
fn a_run_with_a_wrong_value_creates_no_file() {
    let folder = Folder::new("wrong-problem");
    let out = folder.join("out");
    let mut problem = plate();
    problem.bodies[0].material.density = NAN;
    let mut options = Options::new(&out);
    options.existing = Existing::Replace;
    let error = failure(&problem, options);
    assert!(error.message.contains("[body.plate] density"), "{error}");
    assert!(!out.exists());

    let error = failure(&plate(), Options::new(""));
    assert!(error.message.contains("folder is empty"), "{error}");
    assert!(!std::path::Path::new(".lock").exists());
}

#[test]
fn a_simulation_has_the_dimension_of_its_problem() {
    let (problem, comm) = (plate(), threads::alone());
    let error = Simulation::<3>::new(&problem, &comm).err().unwrap();
    assert!(error.message.starts_with("dimension: "), "{error}");
    assert!(Simulation::<1>::new(&problem, &comm).is_err());
    assert_eq!(separation_energy_ratio(&problem, 9, 0.0), None);
}

/// The deck of a bar, for runs with other physics than those of the deck.
const BAR: &str = "dimension = '1d'
    grid = { spacing = 1, horizon = 3 }
    material.steel.pmb = { density = 2, youngs_modulus = 5 }
    body.bar = { material = 'steel', shape.box = { lower = [0], upper = [20] } }
    initial.push = { set = 'bar', velocity = ['0.01*x'] }
    time.end = 1
    ";

#[test]
fn a_changed_problem_does_not_run_with_the_deck() {
    let folder = Folder::new("changed-problem");
    let path = folder.write("bar.toml", BAR);
    let options = |existing| {
        let mut options = Options::new(folder.join("out"));
        options.existing = existing;
        options.deck = Some(deck::read(&path, &[]).unwrap());
        options
    };
    let mut problem = options(Existing::Refuse).deck.unwrap().problem().unwrap();
    problem.bodies[0].material.density = 3.0;
    let error = failure(&problem, options(Existing::Refuse));
    let wanted = "was `density: 2.0,`, is `density: 3.0,`";
    assert!(error.message.contains(wanted), "{error}");
    assert!(!folder.join("out").exists());

    // A restart may change the end and the outputs.
    problem.bodies[0].material.density = 2.0;
    problem.time.end = 2.0;
    problem.output.every = Some(Interval::Steps(3));
    let run = |options| fissure::run(&problem, &threads::alone(), options, &mut Unobserved);
    run(options(Existing::Refuse)).unwrap();
    let error = run(options(Existing::Refuse)).unwrap_err();
    let wanted = "`Existing::Continue` continues the run, `Existing::Replace` replaces it";
    assert!(error.message.contains(wanted), "{error}");
}
