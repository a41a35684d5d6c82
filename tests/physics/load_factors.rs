//! Observers that change loads and stop runs.

use std::path::Path;

use crate::support::command::Folder;
use crate::support::datasets::{datasets, difference, sorted};
use fissure::comm::{all_gather_many, threads};
use fissure::deck::{Deck, Source};
use fissure::error::{Error, ErrorKind, Result};
use fissure::problem::{Field, Problem};
use fissure::run::{Existing, Observer, Options, Outcome, Reason, Row, RunState, Unobserved};
use fissure::solver::{Simulation, Stepper};
use rayon::ThreadPoolBuilder;

/// Return the problem of a plate under tension.
fn plate(traction: &str, time: &str, extra: &str) -> Problem {
    let text = format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 1e-3, horizon = 3e-3 }}
        material.glass.pmb = {{ density = 2440, youngs_modulus = 72e9 }}
        damage.brittle.critical_stretch = {{ fracture_energy = 135 }}
        body.plate = {{ material = 'glass', damage = 'brittle', shape.box = {{ lower = [0, 0], upper = [0.03, 0.02] }} }}
        set.top.where = 'y > 0.018'
        set.bottom.where = 'y < 0.003'
        condition.hold = {{ set = 'bottom', displacement = [0, 0] }}
        condition.pull = {{ set = 'top', traction = [0, '{traction}'] }}
        condition.weight = {{ set = 'all', body_force = ['1e6*x', 0] }}
        time = {{ {time} }}
        {extra}
        "
    );
    let deck = Deck::new(Source::new("plate.toml", text)).unwrap_or_else(|error| panic!("{error}"));
    deck.problem().unwrap_or_else(|error| panic!("{error}"))
}

const EXPLICIT: &str = "end = 3e-6, step = 1e-8";

/// Outputs and history rows of explicit runs.
const OFTEN: &str = "output.every_steps = 50\n history.every_steps = 10";

/// Outputs and history rows of quasi-static runs.
const ALWAYS: &str = "output.every_steps = 1\n history.every_steps = 1";

/// Observer that sets factors of the load `pull` at rows with these step numbers, and stops the run at one of
/// them.
#[derive(Default)]
struct Control {
    factors: Vec<(u64, f64)>,
    stop: Option<u64>,
}

impl Observer for Control {
    fn row(&mut self, now: &mut dyn RunState, row: &Row) {
        for (number, factor) in &self.factors {
            if now.number() == *number {
                now.set_load_factor("pull", *factor);
                assert_eq!(now.load_factor("pull"), Some(*factor));
            }
        }
        if Some(now.number()) == self.stop {
            now.stop();
        }
        // The energies of the state equal those of the row.
        let (found, expected) = (now.energies(), row.energies());
        assert_eq!(
            [found.kinetic, found.strain, found.fracture, found.work],
            [
                expected.kinetic,
                expected.strain,
                expected.fracture,
                expected.work
            ]
        );
        let points = now.ids().len();
        assert_eq!(now.field(Field::Damage).len(), points);
        assert_eq!(now.field(Field::ForceDensity).len(), 3 * points);
        let energy = now.field(Field::StrainEnergyDensity);
        let volume = 1e-3 * 1e-3;
        let energy: f64 = energy.iter().map(|density| density * volume).sum();
        assert!((energy - found.strain).abs() <= 1e-12 * found.strain.abs());
        assert_eq!(now.load_factor("hold"), None);
    }
}

fn run(
    problem: &Problem,
    out: &Path,
    existing: Existing,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let mut options = Options::new(out);
    options.existing = existing;
    fissure::run(problem, &threads::alone(), options, observer)
}

/// Assert that a run with factors gives the bits of a run whose load expression contains the factors.
/// `factors` has the step at which the observer sets a factor, the factor, and the time (s) after which the
/// expression contains it.
fn is_as_by_expression(name: &str, time: &str, outputs: &str, factors: &[(u64, f64, f64)]) {
    let folder = Folder::new(name);
    let [controlled, expressed] = ["controlled", "expressed"].map(|name| folder.join(name));
    let mut control = Control {
        factors: factors
            .iter()
            .map(|(number, factor, _)| (*number, *factor))
            .collect(),
        stop: None,
    };
    let load = "20e6";
    run(
        &plate(load, time, outputs),
        &controlled,
        Existing::Refuse,
        &mut control,
    )
    .unwrap();
    let mut expression = "1".to_owned();
    for (_, factor, from) in factors {
        expression = format!("if(t > {from:e}, {factor}, {expression})");
    }
    let problem = plate(&format!("{load}*({expression})"), time, outputs);
    run(&problem, &expressed, Existing::Refuse, &mut Unobserved).unwrap();
    let [found, expected] =
        [&controlled, &expressed].map(|out| datasets(&out.join("result.vtkhdf")));
    assert_eq!(difference(&expected, &found), None);
    let constant = folder.join("constant");
    run(
        &plate(load, time, outputs),
        &constant,
        Existing::Refuse,
        &mut Unobserved,
    )
    .unwrap();
    assert_ne!(
        expected["history external_work"],
        datasets(&constant.join("result.vtkhdf"))["history external_work"]
    );
}

#[test]
fn a_factor_acts_as_the_same_factor_in_the_expression() {
    // Powers of 2, so that products have no rounding errors.
    is_as_by_expression(
        "factor-explicit",
        EXPLICIT,
        OFTEN,
        &[
            (100, 0.5, 1.005e-6),
            (200, 0.0, 2.005e-6),
            (230, 2.0, 2.305e-6),
        ],
    );
}

#[test]
fn a_factor_acts_at_the_next_load_step() {
    for method in ["relaxation", "static"] {
        let time = format!("end = 8, method = '{method}', relaxation.load_steps = 8");
        let name = format!("factor-{method}");
        is_as_by_expression(
            &name,
            &time,
            ALWAYS,
            &[(0, 0.5, 0.5), (4, 1.0, 4.5), (6, 0.25, 6.5)],
        );
    }
}

#[test]
fn a_stopped_run_goes_on_with_its_factors() {
    let folder = Folder::new("factor-restart");
    let problem = plate("20e6", EXPLICIT, OFTEN);
    let control = |stop| Control {
        factors: vec![(100, 0.3)],
        stop,
    };
    let [whole, parts] = ["whole", "parts"].map(|name| folder.join(name));
    run(&problem, &whole, Existing::Refuse, &mut control(None)).unwrap();
    for (existing, number) in [(Existing::Refuse, 100), (Existing::Continue, 170)] {
        let outcome = run(&problem, &parts, existing, &mut control(Some(number))).unwrap();
        assert_eq!(
            (outcome.stopped, outcome.number),
            (Some(Reason::Observer), number)
        );
    }
    let outcome = run(&problem, &parts, Existing::Continue, &mut Unobserved).unwrap();
    assert_eq!(outcome.stopped, None);
    let [expected, found] = [whole, parts].map(|out| datasets(&out.join("result.vtkhdf")));
    assert_eq!(difference(&expected, &found), None);
}

/// Observer that calls a function at the first step.
struct Ask(fn(&mut dyn RunState));

impl Observer for Ask {
    fn step(&mut self, now: &mut dyn RunState) {
        if now.number() == 1 {
            self.0(now);
        }
    }
}

#[test]
fn a_stop_at_a_step_comes_soon_and_wrong_requests_are_errors() {
    let folder = Folder::new("requests");
    let problem = plate("20e6", EXPLICIT, "");
    let mut number = 0;
    let mut ask = |request| {
        number += 1;
        run(
            &problem,
            &folder.join(number.to_string()),
            Existing::Refuse,
            &mut Ask(request),
        )
    };
    let outcome = ask(|now| now.stop()).unwrap();
    assert_eq!(outcome.stopped, Some(Reason::Observer));
    assert!((2..=12).contains(&outcome.number), "{}", outcome.number);
    let mut error = |request| -> Error {
        let error = ask(request).unwrap_err();
        assert_eq!(error.kind, ErrorKind::Input);
        error
    };
    let unknown = error(|now| now.set_load_factor("pul", 0.5));
    assert_eq!(
        unknown.message,
        "there is no load `pul`; did you mean `pull`? (known: pull, weight)"
    );
    let support = error(|now| now.set_load_factor("hold", 0.5));
    assert!(
        support.message.starts_with("there is no load `hold`"),
        "{support}"
    );
    let infinite = error(|now| now.set_load_factor("pull", f64::INFINITY));
    assert!(
        infinite.message.contains("must be finite, is inf"),
        "{infinite}"
    );
}

/// Run a problem on ranks that are threads, with a load factor from step 50 on and a rebalancing. Return the
/// bits of ids and displacements at the end.
fn on_ranks(problem: &Problem, ranks: usize) -> Vec<u64> {
    let mut all = threads::run(ranks, |comm| {
        let pool = ThreadPoolBuilder::new().num_threads(1);
        let _pool = pool.use_current_thread().build().unwrap();
        let mut stepper = Stepper::new(Simulation::<2>::new(problem, comm).unwrap());
        while !stepper.is_over() {
            stepper.advance();
            match stepper.clock().number() {
                50 => stepper.set_load_factor("pull", 0.7),
                60 if ranks > 1 => {
                    let time = 1000 * (1 + comm.rank() as u64);
                    stepper.at_full_step().repartition(time).unwrap();
                }
                _ => {}
            }
        }
        let owned = stepper.model().owned();
        let ids = all_gather_many(comm, &stepper.model().ids[..owned]);
        let simulation = stepper.at_full_step();
        let columns = [
            &simulation.fields.displacement[1][..owned],
            simulation.fields.external_work.as_ref().unwrap(),
        ];
        let values = (0..owned).flat_map(|point| columns.map(|column| column[point]));
        let values: Vec<f64> = values.collect();
        sorted(&ids, &all_gather_many(comm, &values))
    });
    all.swap_remove(0)
}

#[test]
fn a_factor_gives_the_same_bits_on_any_ranks() {
    let problem = plate(
        "20e6",
        "end = 1e-6, step = 1e-8",
        "balance.every_steps = 1000",
    );
    let expected = on_ranks(&problem, 1);
    for ranks in [2, 3] {
        assert!(on_ranks(&problem, ranks) == expected, "{ranks} ranks");
    }
}
