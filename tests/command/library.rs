//! Runs started from Rust, with and without a deck, behave like runs of the command.

use std::path::Path;
use std::time::Duration;

use crate::support;
use crate::support::command::{Folder, fissure, succeed};
use crate::support::datasets::{datasets, difference};
use fissure::comm::threads;
use fissure::error::ErrorKind;
use fissure::expression::Expression;
use fissure::output::ResultReader;
use fissure::problem::{Interval, Problem, Selector, StepRule};
use fissure::run::{
    Existing, Message, Observer, Options, Outcome, Reason, Row, RunState, Unobserved,
};
use fissure::solver::Simulation;

#[allow(dead_code, reason = "the test calls what the example's main calls")]
#[path = "../../examples/problem_in_rust.rs"]
mod problem_in_rust;
#[allow(dead_code, reason = "as above")]
#[path = "../../examples/run_deck.rs"]
mod run_deck;

/// The plate of `examples/problem_in_rust.rs` as a deck.
const PLATE: &str = "title = 'A plate built in Rust'
    dimension = 'plane-stress'
    thickness = 1e-3
    grid = { spacing = 1e-3, horizon = '3*1e-3' }
    material.glass.pmb = { density = 2440, youngs_modulus = 72e9 }
    damage.brittle.critical_stretch = { fracture_energy = 135, alpha = 0 }
    body.plate = { material = 'glass', damage = 'brittle', shape.box = { lower = [0, 0], upper = [0.06, 0.03] } }
    crack.notch.segment = { from = [0, 0.015], to = [0.02, 0.015] }
    set.top.where = 'y > 0.027'
    set.bottom.where = 'y < 0.003'
    condition.top = { set = 'top', velocity = ['free', 'ramp(t, 0, 1e-5)'] }
    condition.bottom = { set = 'bottom', velocity = ['free', '-ramp(t, 0, 1e-5)'] }
    time.end = 3e-5
    history.every_steps = 50
    ";

/// Observer that records its calls.
#[derive(Default)]
struct Notes {
    messages: Vec<Message>,
    begun_at: Option<u64>,
    steps: Vec<u64>,
    rows: Vec<(u64, f64, f64)>,
    complete: Option<bool>,
    /// Displacement of a point of the pulled end, m.
    top: f64,
}

impl Observer for Notes {
    fn message(&mut self, message: &Message) {
        self.messages.push(message.clone());
    }

    fn begin(&mut self, now: &mut dyn RunState) {
        self.begun_at = Some(now.number());
    }

    fn step(&mut self, now: &mut dyn RunState) {
        self.steps.push(now.number());
        assert_eq!((now.dimension(), now.ids().len()), (2, 1800));
        assert_eq!(now.reference(1).len(), 1800);
        assert_eq!(now.velocity(0).len(), 1800);
        let height = now.reference(1).iter();
        let top = (0..).zip(height).find(|(_, y)| **y > 0.027);
        self.top = now.displacement(1)[top.unwrap().0];
    }

    fn row(&mut self, now: &mut dyn RunState, row: &Row) {
        assert_eq!(row.value("time"), Some(now.time()));
        assert_eq!(row.values().len(), row.columns.len());
        let energies = row.energies();
        self.rows
            .push((now.number(), energies.kinetic, energies.work));
    }

    fn end(&mut self, complete: bool) {
        self.complete = Some(complete);
    }
}

fn run(problem: &Problem, options: Options, observer: &mut dyn Observer) -> Outcome {
    fissure::run(problem, &threads::alone(), options, observer)
        .unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn a_plan_built_in_rust_gives_the_bits_of_its_deck() {
    let folder = Folder::new("problem-in-rust");
    let deck = folder.write("plate.toml", PLATE);
    let by_command = folder.join("command");
    let mut command = fissure(1);
    command.arg("run").arg(&deck).arg("-o").arg(&by_command);
    succeed(command.args(["--threads", "1"]));
    let result = |folder: &Path| datasets(&folder.join("result.vtkhdf"));
    let expected = result(&by_command);

    let by_deck = folder.join("deck");
    let outcome = run_deck::run_deck(&deck, &by_deck, &threads::alone()).unwrap();
    assert_eq!(difference(&expected, &result(&by_deck)), None);
    let attributes = |folder: &Path| {
        let reader = ResultReader::open(&folder.join("result.vtkhdf")).unwrap();
        let mut attributes = reader.attributes().unwrap();
        attributes.retain(|(name, _)| !["command_line", "hosts", "threads"].contains(&&name[..]));
        attributes
    };
    assert_eq!(attributes(&by_deck), attributes(&by_command));

    let problem = problem_in_rust::plate(3e-5).unwrap();
    let built = folder.join("built");
    let mut notes = Notes::default();
    let built_outcome = run(&problem, Options::new(&built), &mut notes);
    assert_eq!(difference(&expected, &result(&built)), None);

    let last = outcome.last;
    assert_eq!((built_outcome.number, built_outcome.last), (last, last));
    assert_eq!(built_outcome.stopped, None);
    assert_eq!(notes.begun_at, Some(0));
    assert_eq!(notes.complete, Some(true));
    assert_eq!(notes.steps, (1..=last).collect::<Vec<_>>());
    assert!(matches!(
        notes.messages[..],
        [Message::Started, Message::SetUp { .. }, Message::Decided(_)]
    ));
    // The top moves up, at 1 m/s after 10 µs.
    assert!((notes.top - 2.5e-5).abs() < 1e-7, "{}", notes.top);
    assert_eq!(notes.rows[1].0, 50);
    let (number, kinetic, work) = *notes.rows.last().unwrap();
    assert!(number == last && kinetic > 0.0 && work > kinetic);
    let [by_deck, built] = [outcome, built_outcome].map(|outcome| outcome.last_row.unwrap());
    assert_eq!(by_deck.energies.kinetic, kinetic);
    assert_eq!(built.values, by_deck.values);
}

#[test]
fn an_initial_velocity_from_rust_is_that_of_the_deck() {
    let deck = format!(
        "{PLATE}
        set.left.where = 'x < 0.01'
        initial.push = {{ set = 'left', velocity = ['5', '100*x'] }}"
    );
    let mut built = problem_in_rust::plate(3e-5).unwrap();
    let left = Selector::Where(Expression::of("x < 0.01").unwrap());
    let left = built.add_set("left", left);
    let velocity = ["5", "100*x"].map(|text| Expression::of(text).unwrap());
    built.add_initial_velocity("push", left, velocity.to_vec());
    let velocities = |problem: &Problem| {
        let comm = threads::alone();
        let simulation = Simulation::<2>::new(problem, &comm).unwrap();
        simulation.fields.velocity.clone()
    };
    let expected = velocities(&support::problem(&deck));
    assert!(expected[0].contains(&5.0));
    assert_eq!(velocities(&built), expected);
}

#[test]
fn a_run_from_rust_that_was_stopped_goes_on() {
    let folder = Folder::new("stopped-in-rust");
    let mut problem = problem_in_rust::plate(2e-5).unwrap();
    problem.time.step = StepRule::Fixed(5e-8);
    let whole = folder.join("whole");
    let outcome = run(&problem, Options::new(&whole), &mut Unobserved);
    assert_eq!(outcome.last, 400);

    let parts = folder.join("parts");
    let mut options = Options::new(&parts);
    options.wall_time = Some(Duration::ZERO);
    let mut notes = Notes::default();
    let outcome = run(&problem, options, &mut notes);
    assert_eq!(outcome.stopped, Some(Reason::WallTime));
    assert_eq!(notes.complete, Some(false));
    assert!(outcome.number < 400 && outcome.summary.checkpoints == 1);

    let attempt = |problem: &Problem, existing: Existing, observer: &mut dyn Observer| {
        let mut options = Options::new(&parts);
        options.existing = existing;
        fissure::run(problem, &threads::alone(), options, observer)
    };
    let error = attempt(&problem, Existing::Refuse, &mut Unobserved).unwrap_err();
    assert_eq!(error.kind, ErrorKind::Input);
    let mut other = problem.clone();
    other.bodies[0].material.density = 2500.0;
    let error = attempt(&other, Existing::Continue, &mut Unobserved).unwrap_err();
    assert_eq!(error.kind, ErrorKind::Input);
    assert!(
        error
            .message
            .contains("was `density: 2440.0,`, is `density: 2500.0,`"),
        "{error}"
    );
    assert!(
        error
            .message
            .starts_with("the problem differs in its physics"),
        "{error}"
    );

    // Other intervals do not change the physics.
    problem.checkpoint = fissure::problem::CheckpointRule::Simulation(Interval::Steps(100));
    let mut notes = Notes::default();
    let continued = attempt(&problem, Existing::Continue, &mut notes).unwrap();
    assert!(notes.messages.contains(&Message::Continued {
        number: outcome.number,
        time: outcome.time,
        complete: false,
    }));
    assert_eq!(notes.begun_at, Some(outcome.number));
    assert_eq!(continued.summary.steps, 400 - outcome.number);
    assert_eq!(continued.summary.checkpoints, 4);
    let [expected, found] = [&whole, &parts].map(|folder| datasets(&folder.join("result.vtkhdf")));
    assert_eq!(difference(&expected, &found), None);

    // The result of another run is not continued.
    let foreign = folder.join("foreign");
    run(&other, Options::new(&foreign), &mut Unobserved);
    std::fs::copy(foreign.join("result.vtkhdf"), parts.join("result.vtkhdf")).unwrap();
    let mut notes = Notes::default();
    attempt(&problem, Existing::Continue, &mut notes).unwrap();
    let reason =
        "the result so far is of another run (was `density: 2500.0,`, is `density: 2440.0,`)";
    let is_told = |message: &Message| matches!(message, Message::SetAside { reason: told, .. } if told == reason);
    assert!(notes.messages.iter().any(is_told), "{:?}", notes.messages);
}
