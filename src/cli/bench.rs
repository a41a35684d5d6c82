//! `fissure bench`: the speed of the time loop on a fixed problem.

use std::process::ExitCode;
use std::time::Duration;

use clap::ValueEnum;
use fissure::comm::mpi::World;
use fissure::comm::{self, Communicator, agree};
use fissure::deck::{Deck, Source};
use fissure::error::Result;
use fissure::survey::memory::{Resident, resident};
use fissure::survey::speed;

use super::bench_report::{Figures, Limited, Phase};
use super::{BenchArguments, Verbosity, launch, machine_limits};

/// The measured laws.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Law {
    /// Prototype microelastic: bond-based, one pass over the bonds.
    Pmb,
    /// Linear peridynamic solid (`ordinary` in a deck): state-based, two passes.
    Lps,
    /// Correspondence with the zero-energy control of Wan et al.: two passes, energy-based damage.
    Correspondence,
}

impl Law {
    /// Return the material table of this law in the deck of the benchmark.
    fn in_deck(self) -> &'static str {
        match self {
            Self::Pmb => "pmb = { density = 2440, youngs_modulus = 72e9 }",
            Self::Lps => {
                "ordinary = { density = 2440, youngs_modulus = 72e9, poisson_ratio = 0.25 }"
            }
            Self::Correspondence => {
                "correspondence = { density = 2440, youngs_modulus = 72e9, poisson_ratio = 0.25, \
                 zero_energy = 'wan2019' }"
            }
        }
    }

    /// Return a damage table with a threshold that no bond reaches.
    fn damage(self) -> &'static str {
        match self {
            Self::Pmb | Self::Lps => "critical_stretch = { critical_stretch = 1e3, alpha = 0 }",
            Self::Correspondence => "energy = { fracture_energy = 1e30 }",
        }
    }

    /// Return the number of passes over the bonds per step.
    fn passes(self) -> u64 {
        match self {
            Self::Pmb => 1,
            Self::Lps | Self::Correspondence => 2,
        }
    }

    /// Return the number of floating-point operations per directed bond and step, without the operations that
    /// compute ξ and |ξ|. If `failure` is true, count the operations of the failure test, too. See
    /// docs/src/developers/performance.md.
    fn operations(self, failure: bool) -> u64 {
        match self {
            Self::Pmb => 23 + u64::from(failure),
            Self::Lps => 41 + 2 * u64::from(failure),
            Self::Correspondence => 96 + 7 * u64::from(failure),
        }
    }
}

/// Storage of the bonds.
#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Family {
    /// Automatic choice: one bit per bond, because the points of the benchmark form a lattice.
    Auto,
    /// One bit per bond.
    Lattice,
    /// Neighbour lists, as for scattered points.
    List,
}

impl Family {
    /// Return the value of the key `[grid] family` for this storage.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Lattice => "lattice",
            Self::List => "list",
        }
    }
}

/// Upper limit of the argument of `--contact`: the number of points that touch other points, divided by the
/// number of all points. With this limit, the distance between adjacent cracks is larger than the horizon.
const MOST_TOUCHING: f64 = 0.25;

/// Initial strain of the block along x in a benchmark with contact. The strain presses the faces of each
/// crack together.
const PRESSED: f64 = -1e-5;

/// Parse the fraction of the points that touch other points.
pub fn touching_share(text: &str) -> std::result::Result<f64, String> {
    let share = text.parse().ok();
    let share = share.filter(|share| (0.0..=MOST_TOUCHING).contains(share));
    share.ok_or_else(|| format!("must be a number, 0 to {MOST_TOUCHING}"))
}

/// Return the number of cracks normal to x. The number is chosen such that about the requested fraction of
/// all points lies on crack faces.
fn cracks(arguments: &BenchArguments) -> u64 {
    let share = arguments.contact.unwrap_or(0.0);
    (0.5 * share * arguments.points[0] as f64).round() as u64
}

/// Minimum memory traffic of the phase `motion` in 3-D, bytes per point and step. Displacement, velocity and
/// force density are read and written. The index of the point's block is read. A copy of the displacement is
/// written for the bond loops.
const MOTION_BYTES: u64 = 170;
/// Estimated minimum memory traffic of a 3-D pass over the bonds, bytes per point. The stored bonds are not
/// included. Reference position, displacement and volume are read, and the sums of the pass are read and
/// written. The estimate assumes four sums per point.
const PASS_BYTES: u64 = 120;

/// Parse `N` or `X,Y,Z` into the numbers of points along the edges of a block.
pub fn edges(text: &str) -> std::result::Result<[u64; 3], String> {
    let numbers: Option<Vec<u64>> = text
        .split(',')
        .map(|part| part.trim().parse().ok().filter(|number| *number > 0))
        .collect();
    match numbers.as_deref() {
        Some([points]) => Ok([(*points as f64).cbrt().round() as u64; 3]),
        Some([x, y, z]) => Ok([*x, *y, *z]),
        _ => Err(format!(
            "`{text}` must be a number of points such as 262144, or edges such as 128,64,64"
        )),
    }
}

/// Return the deck of the benchmark. Some processors compute faster with zeros. Therefore a small initial
/// displacement avoids zeros.
fn deck(arguments: &BenchArguments) -> String {
    let law = arguments.law.in_deck();
    let breaking = arguments.law.damage();
    let family = arguments.family.name();
    let [x, y, z] = arguments.points;
    let last = u64::from(warm_up(arguments)) + u64::from(arguments.steps);
    let (contact, strain) = match arguments.contact {
        None => (String::new(), 0.0),
        Some(_) => {
            let cracks = cracks(arguments);
            let crack = |number: u64| {
                let place = x * (number + 1) / (cracks + 1);
                format!(
                    "crack.c{number}.rectangle = {{ corner = ['{place}*1e-3', -1, -1], edge_a = [0, 9, 0], edge_b = [0, 0, 9] }}\n"
                )
            };
            let cracks: String = (0..cracks).map(crack).collect();
            (format!("contact.model = 'penalty'\n{cracks}"), PRESSED)
        }
    };
    let damage = if arguments.no_failure {
        ""
    } else {
        "damage = 'block'"
    };
    format!(
        "title = 'Benchmark'
        dimension = '3d'
        grid = {{ volume_correction = 'none', spacing = 1e-3, horizon = 3.015e-3, family = '{family}' }}
        material.block.{law}
        damage.block.{breaking}
        {contact}
        [body.block]
        material = 'block'
        {damage}
        shape.box = {{ lower = [0, 0, 0], upper = ['{x}*1e-3', '{y}*1e-3', '{z}*1e-3'] }}
        [initial.wave]
        displacement = ['{strain}*x + 1e-9*sin(400*x)', '1e-9*sin(300*y)', '1e-9*sin(200*z)']
        [time]
        step = 1e-8
        end = '{last}*1e-8'
        "
    )
}

/// Return the number of warm-up steps: a tenth of the measured steps, rounded up.
fn warm_up(arguments: &BenchArguments) -> u32 {
    arguments.steps.div_ceil(10)
}

/// Start MPI, run the benchmark on all ranks, print the figures on rank 0, and finalise MPI.
pub fn bench(arguments: &BenchArguments, verbosity: Verbosity) -> ExitCode {
    launch::on_all_ranks(|world| {
        let threads = agree(world, launch::start_threads(arguments.threads))?;
        if world.rank() == 0 && verbosity > Verbosity::Quiet {
            launch::warn(threads);
        }
        let figures = measure(world, arguments, threads)?;
        if world.rank() == 0 {
            figures.print(arguments.json);
        }
        Ok(ExitCode::SUCCESS)
    })
}

fn measure(world: &World, arguments: &BenchArguments, threads: usize) -> Result<Figures> {
    let before = resident();
    let deck = Deck::new(Source::new("benchmark.toml", deck(arguments)))?;
    let problem = deck.problem_on(world)?;
    let speed = speed(&problem, world, warm_up(arguments), arguments.steps);
    let speed = speed.map_err(|error| deck.locate(error))?;

    let total = |value: u64| comm::total(world, value) as f64;
    let largest = |value: f64| {
        let mut largest = [value];
        world.max(&mut largest);
        largest[0]
    };
    let phase = |name, time: Duration| Phase {
        name,
        mean: total(time.as_nanos() as u64) / 1e9 / world.size() as f64,
        slowest: largest(time.as_secs_f64()),
    };
    let (times, sent, alone) = (speed.times, speed.sent, speed.sent_without_overlap);
    let steps = f64::from(arguments.steps);
    let messages = sent.messages as f64 / steps;
    let points = speed.points;
    let bonds = total(speed.directed_bonds);
    let bonds_bytes = total(speed.bond_bytes);
    let halo_bytes = total(sent.bytes) / steps;
    let mean = |time: Duration| total(time.as_nanos() as u64) / 1e9 / world.size() as f64 / steps;
    // `Speed::sent_without_overlap` measures only the exchange of displacements. Laws with two passes also
    // exchange point numbers, such as the dilatation. The measured time is therefore multiplied by this
    // ratio: all bytes that the steps send, divided by the bytes of the displacements.
    let as_many = halo_bytes * steps / total(alone.bytes).max(1.0);
    let mut phases = vec![
        phase("bonds", times.forces.bonds),
        phase("halo", times.forces.halo),
        phase("motion", times.motion),
    ];
    if arguments.contact.is_some() {
        phases.push(phase("contact", times.contact));
    }
    let whole = phase("loop", speed.whole);
    let seconds = whole.slowest;
    phases.push(whole);
    let resident = |of: fn(Resident) -> f64, at: Resident| total(of(at) as u64);
    let memory = vec![
        ("before set-up", resident(|r| r.now, before)),
        ("bonds", bonds_bytes),
        ("after the loop", resident(|r| r.now, speed.memory)),
        ("peak", resident(|r| r.peak, speed.memory)),
    ];
    let family = if total(speed.lattice_bonds) > 0.0 {
        Family::Lattice
    } else {
        Family::List
    };
    let limits = if arguments.no_limits {
        None
    } else {
        let limits = machine_limits::measure(world, threads);
        let (law, failure) = (arguments.law, !arguments.no_failure);
        let by_points = points * (MOTION_BYTES + law.passes() * PASS_BYTES);
        let moved = law.passes() as f64 * bonds_bytes + by_points as f64;
        let operations = bonds * law.operations(failure) as f64;
        Some(Limited {
            bandwidth: total(limits.bandwidth as u64),
            moved: moved * steps / seconds,
            arithmetic: total(limits.arithmetic as u64),
            done: operations * steps / seconds,
        })
    };
    Ok(Figures {
        law: arguments.law,
        family,
        instructions: speed.instructions,
        failure: !arguments.no_failure,
        touching: (arguments.contact)
            .map(|_| 2.0 * cracks(arguments) as f64 / arguments.points[0] as f64),
        edges: arguments.points,
        points: points as f64,
        bonds,
        ranks: world.size(),
        threads,
        cores: total(threads as u64),
        steps,
        warm_up: f64::from(warm_up(arguments)),
        set_up: largest(speed.set_up.as_secs_f64()),
        phases,
        memory,
        halo_bytes,
        messages_time: mean(sent.time),
        messages_time_alone: mean(alone.time) * as_many,
        messages: total((messages * steps) as u64) / steps,
        most_messages: largest(messages),
        ghosts: total(speed.ghosts),
        most_ghosts: largest(speed.ghosts as f64),
        limits,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_touching_points() {
        assert_eq!(touching_share("0.1"), Ok(0.1));
        for wrong in ["-0.1", "0.3", "nan", "many"] {
            assert!(touching_share(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn edges_of_the_nearest_cube_or_of_a_block() {
        assert_eq!(edges("262144"), Ok([64; 3]));
        assert_eq!(edges("1000000"), Ok([100; 3]));
        assert_eq!(edges("4, 3,2"), Ok([4, 3, 2]));
        for wrong in ["0", "4,3", "a", "1,0,1", ""] {
            assert!(edges(wrong).is_err(), "{wrong}");
        }
    }
}
