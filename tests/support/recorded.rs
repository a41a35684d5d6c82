//! Outputs and history of a run in memory, with ranks as threads, without MPI and without files.

use std::collections::BTreeMap;

use fissure::comm::{Communicator, all_gather_many, threads};
use fissure::problem::{Balance, Problem};
use fissure::solver::motion::Clock;
use fissure::solver::observers::{HistoryObserver, Schedule, Snapshot};
use fissure::solver::{Simulation, Stepper};
use rayon::ThreadPoolBuilder;

use super::datasets::sorted;

/// The outputs and rows of a run.
#[derive(Default)]
pub struct Recorded {
    /// Names and bits in the form of [`datasets`](super::datasets::datasets).
    pub datasets: BTreeMap<String, Vec<u64>>,
    /// Number of rebalancings in which points migrated.
    pub repartitions: usize,
}

/// Run a problem on `ranks` ranks with `threads` threads each.
pub fn record(problem: &Problem, ranks: usize, threads: usize) -> Recorded {
    let mut of_rank = threads::run(ranks, |comm| {
        let pool = ThreadPoolBuilder::new().num_threads(threads);
        let _pool = pool.use_current_thread().build().unwrap();
        match problem.dimension.count() {
            1 => run::<1>(problem, comm),
            2 => run::<2>(problem, comm),
            _ => run::<3>(problem, comm),
        }
    });
    of_rank.swap_remove(0)
}

fn run<const D: usize>(problem: &Problem, comm: &dyn Communicator) -> Recorded {
    let mut simulation = Simulation::<D>::new(problem, comm).unwrap();
    let mut history = HistoryObserver::new(&simulation).unwrap();
    let mut recorded = Recorded::default();
    recorded.add(&mut simulation, &mut history);
    let mut stepper = Stepper::new(simulation);
    while !stepper.is_over() {
        if stepper.is_refinement_due() {
            let simulation = stepper.at_full_step();
            if simulation.refine().unwrap().is_some() {
                history.follow(simulation).unwrap();
            }
        }
        stepper.advance();
        if stepper.load_step().is_settled
            && Recorded::is_due(problem, stepper.clock()).contains(&true)
        {
            recorded.add(stepper.at_full_step(), &mut history);
        }
        if !stepper.is_over() && is_rebalance_due(problem, &stepper) {
            let simulation = stepper.at_full_step();
            let time = pretended_time(simulation);
            let moved = simulation.repartition(time).unwrap();
            history.follow(simulation).unwrap();
            recorded.repartitions += usize::from(moved > 0);
        }
    }
    stepper.at_full_step().check().unwrap();
    recorded
}

fn is_rebalance_due<const D: usize>(problem: &Problem, stepper: &Stepper<'_, D>) -> bool {
    let number = stepper.clock().number();
    let is_due = |rule: Balance| number.is_multiple_of(rule.every_steps);
    stepper.comm().size() > 1 && problem.balance.is_some_and(is_due)
}

/// Return an artificial time of the loops over bonds, ns. Even and odd ranks are slow alternately. Measured
/// times would make the test depend on the load of the machine.
fn pretended_time<const D: usize>(simulation: &Simulation<'_, D>) -> u64 {
    let rule = simulation.problem.balance.unwrap();
    let turn = simulation.clock.number() / rule.every_steps;
    let is_slow = (turn + simulation.comm.rank() as u64).is_multiple_of(2);
    1000 * simulation.model.owned() as u64 * if is_slow { 3 } else { 1 }
}

impl Recorded {
    /// Return whether an output is due, and whether a history row is due.
    fn is_due(problem: &Problem, clock: &Clock) -> [bool; 2] {
        let output = Schedule::of_outputs(&problem.output);
        let row = Schedule::every(problem.row_interval());
        [output, row].map(|schedule| schedule.is_due(clock))
    }

    /// Record the output and the history row that are due after the current step. Collective.
    fn add<const D: usize>(
        &mut self,
        simulation: &mut Simulation<'_, D>,
        history: &mut HistoryObserver,
    ) {
        let (problem, clock) = (simulation.problem, simulation.clock);
        let [output, row] = Self::is_due(problem, &clock);
        if !output && !row {
            return;
        }
        let snapshot = Snapshot::new(simulation);
        if row {
            let values = history.row(simulation, &snapshot).values;
            for ((name, _), value) in history.columns().iter().zip(values) {
                self.push(format!("history {name}"), value.to_bits());
            }
        }
        if output {
            self.add_output(simulation, &snapshot);
            self.push("times".to_owned(), clock.time().to_bits());
            self.push("steps".to_owned(), clock.number());
            simulation.fields.forget_newly_broken();
        }
    }

    fn push(&mut self, name: String, bits: u64) {
        self.datasets.entry(name).or_default().push(bits);
    }

    fn add_output<const D: usize>(
        &mut self,
        simulation: &mut Simulation<'_, D>,
        snapshot: &Snapshot,
    ) {
        let (problem, comm, model) = (simulation.problem, simulation.comm, &simulation.model);
        let owned = model.owned();
        let ids = all_gather_many(comm, &model.ids[..owned]);
        let number = self.datasets.get("times").map_or(0, Vec::len);
        let mut add = |name: &str, values: &[f64]| {
            let values = sorted(&ids, &all_gather_many(comm, values));
            self.datasets.insert(format!("{name} {number}"), values);
        };
        let places: Vec<f64> = (0..owned).flat_map(|k| model.position(k)).collect();
        add("positions", &places);
        let own_ids: Vec<f64> = model.ids[..owned].iter().map(|id| *id as f64).collect();
        add("id", &own_ids);
        add(
            "volume",
            &model.volume.iter().take(owned).collect::<Vec<_>>(),
        );
        let blocks = || model.block.iter().map(|block| usize::from(*block));
        let bodies: Vec<f64> = blocks()
            .map(|block| problem.body_of(block) as f64)
            .collect();
        add("block", &bodies);
        if problem.refinement.is_some() {
            let levels = blocks().map(|block| f64::from(problem.block(block).level));
            add("level", &levels.collect::<Vec<_>>());
        }
        for field in problem.output.fields.clone() {
            add(field.name(), &snapshot.field(simulation, field));
        }
    }
}
