"""Compares restarted runs with uninterrupted ones, bit for bit.

Each small deck tests one feature whose state must survive a restart. The deck first runs without interruption on one
rank. Then it runs in parts: each part is stopped by a signal, or one of its ranks is killed, and the next part restarts
on other numbers of ranks and threads and with another instruction set. The last part runs to the end. All datasets of
the result and history.csv must equal those of the uninterrupted run.

The instruction set is chosen with FISSURE_INSTRUCTIONS, among those of this machine. A note is printed if the machine
has only one.

The binary is $FISSURE, or target/release/fissure, or else target/debug/fissure.
"""

import argparse
import csv
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

# Exit code of a run stopped by a signal.
STOPPED = 75
# Time-out of a part of a run, s.
PATIENCE = 300
# Time-out of mpirun after all ranks have ended, s; mpirun of Open MPI 4.1.4 can hang.
LAUNCHER_PATIENCE = 10
# Number of parts of a run that are stopped or killed.
INTERRUPTIONS = 2

ELASTIC = "density = 2, youngs_modulus = 5, poisson_ratio = 0.3"
TORN = "damage.brittle.energy = { fracture_energy = 0.003, family_correction = 1 }"
STEPS = "time = { end = 12, step = 0.2 }"


def plate(law, time_rule, damage, more=""):
    """Return the deck of a notched plate under tension."""
    return f"""
dimension = 'plane-stress'
grid = {{ spacing = 1, horizon = 3 }}
material.sheet.{law}
{damage}
body.plate = {{ material = 'sheet', damage = 'brittle', shape.box = {{ lower = [0, 0], upper = [24, 16] }} }}
crack.notch.segment = {{ from = [-1, 8], to = [7, 8] }}
set.top.where = 'y > 13'
set.bottom.where = 'y < 3'
condition.up = {{ set = 'top', velocity = ['0.002*sin(t)', '0.01*ramp(t, 0, 2)'] }}
condition.down = {{ set = 'bottom', velocity = [0, '-0.01*ramp(t, 0, 2)'] }}
output = {{ every_steps = 15, fields = ['displacement', 'velocity', 'damage', 'stress'] }}
history = {{ every_steps = 2, reactions = ['bottom'] }}
checkpoint.every_steps = 6
{time_rule}
{more}
"""


# By name: the deck, and a column of the history that must change during the run.
DECKS = {
    "correspondence": (plate(f"correspondence = {{ {ELASTIC} }}", STEPS, TORN), "fracture_energy"),
    "bond_associated": (plate(f"bond_associated_correspondence = {{ {ELASTIC} }}", STEPS, TORN), "fracture_energy"),
    "j2_plasticity": (
        plate(f"correspondence = {{ {ELASTIC}, yield_stress = 0.05, hardening_modulus = 0.5 }}", STEPS, TORN),
        "dissipated_energy",
    ),
    "ordinary_plastic": (
        plate(f"ordinary_plastic = {{ {ELASTIC}, yield_stress = 0.05 }}", STEPS, TORN),
        "dissipated_energy",
    ),
    "viscoelastic": (
        plate(f"ordinary_viscoelastic = {{ {ELASTIC}, relaxation_time = 5, relaxing_share = 0.5 }}", STEPS, TORN),
        "dissipated_energy",
    ),
    "adaptive_step": (
        plate(
            f"ordinary = {{ {ELASTIC} }}",
            "time = { end = 12, step = 0.2, adaptive = { most_broken = 2, stable_broken = 1, steps = 5 } }",
            TORN,
        ),
        "undone_steps",
    ),
    "relaxation": (
        plate(
            f"ordinary = {{ {ELASTIC} }}",
            "time = { end = 12, method = 'relaxation', relaxation = { load_steps = 24, tolerance = 1e-3 } }",
            TORN,
        ),
        "iterations",
    ),
    "stages": (
        plate(
            f"ordinary = {{ {ELASTIC} }}",
            "time.end = 12",
            TORN,
            """
[[stage]]
end = 4
method = 'relaxation'
relaxation = { load_steps = 5, tolerance = 1e-3 }
[[stage]]
end = 8
step = 0.2
[[stage]]
end = 12
step = 0.25
""",
        ),
        "fracture_energy",
    ),
    "refinement": (
        plate(
            "pmb = { density = 2, youngs_modulus = 5 }",
            STEPS,
            "damage.brittle.critical_stretch.critical_stretch = 0.03",
            """
refinement.levels = 1
refinement.region.tip.where = 'x > 5 && x < 9 && y > 6 && y < 10'
refinement.trigger = { damage = 0.1, energy = 0.5, every_steps = 5, coarsen_after = 1 }
""",
        ),
        "points",
    ),
    "refined_region": (
        plate(
            f"correspondence = {{ {ELASTIC} }}",
            STEPS,
            TORN,
            "refinement = { levels = 1, region.tip.where = 'x > 5 && x < 9 && y > 6 && y < 10' }",
        ),
        "fracture_energy",
    ),
}


class Failure(Exception):
    """A run that fails, hangs or ends with other results."""


def binary():
    """Return the path of the tested program."""
    named = os.environ.get("FISSURE")
    for path in [named] if named else ["target/release/fissure", "target/debug/fissure"]:
        if Path(path).is_file():
            return str(Path(path).resolve())
    sys.exit("error: there is no binary; build one with `cargo build` or name it in FISSURE")


def instruction_sets(program):
    """Return the instruction sets of this machine, widest last."""
    printed = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    line = next(line for line in printed.splitlines() if line.split()[:1] == ["instructions"])
    largest, built = line.split(maxsplit=1)[1].split(", of ")
    built = built.split(", ")
    return built[: built.index(largest) + 1]


def start(program, deck, out, layout):
    """Start or restart a run."""
    ranks, threads, instructions = layout
    flag = "--restart" if has_checkpoint(out) else "--overwrite"
    line = [program, "run", str(deck), "--output", str(out), "--threads", str(threads), "--quiet", flag]
    if ranks > 1:
        line = ["mpirun", "--bind-to", "none", "-n", str(ranks), *line]
    environment = dict(os.environ, FISSURE_INSTRUCTIONS=instructions, OMPI_MCA_mpi_yield_when_idle="1")
    with open(out.with_suffix(".log"), "w") as log:
        return subprocess.Popen(line, env=environment, stdout=log, stderr=subprocess.STDOUT)


def children(process):
    """Return the process ids of the children of a process, including zombies."""
    try:
        return [int(number) for number in Path(f"/proc/{process}/task/{process}/children").read_text().split()]
    except OSError:
        return []


def is_running(process):
    """Test whether a process exists and is not a zombie."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rsplit(") ", 1)[1][0] not in "ZX"
    except OSError:
        return False


def wait(run, until=lambda: False):
    """Wait for the end of a run and return its exit code; return None as soon as `until` holds."""
    begin = with_ranks = time.monotonic()
    while run.poll() is None:
        now = time.monotonic()
        ranks = children(run.pid)
        if not ranks or any(map(is_running, ranks)):
            with_ranks = now
        if now - with_ranks > LAUNCHER_PATIENCE:
            print("    mpirun does not end although its ranks have: killed")
            run.kill()
        if now - begin > PATIENCE:
            run.kill()
            raise Failure(f"does not end within {PATIENCE} s")
        if until():
            return None
        time.sleep(0.005)
    return run.returncode


def rows(out):
    """Return the current number of rows of the history."""
    try:
        return max(0, (out / "history.csv").read_bytes().count(b"\n") - 1)
    except OSError:
        return 0


def printed_by(out):
    """Return the printed text of the last part of a run."""
    return out.with_suffix(".log").read_text()


def has_checkpoint(out):
    """Test whether a run can be restarted."""
    return any((out / f"checkpoint_{k}.h5").exists() for k in range(2))


def interrupt(program, deck, out, layout, at, kind):
    """Run a part of a deck until the history has some rows, then stop or kill it. Return whether the part was
    interrupted; it may have ended before."""
    run = start(program, deck, out, layout)
    code = wait(run, lambda: rows(out) >= at and has_checkpoint(out))
    if code is None:
        ranks = [run.pid] if layout[0] == 1 else children(run.pid)
        try:
            os.kill(random.choice(ranks), signal.SIGKILL if kind == "kill" else signal.SIGUSR1)
        except (OSError, IndexError):
            # The run has ended meanwhile.
            pass
        code = wait(run)
    if kind == "stop" and code not in (0, STOPPED):
        raise Failure(f"ends with code {code}:\n{printed_by(out)}")
    return code != 0


def complete(program, deck, out, layout):
    """Run a deck to its end."""
    code = wait(start(program, deck, out, layout))
    if code != 0:
        raise Failure(f"ends with code {code}:\n{printed_by(out)}")
    if "starting a new result" in printed_by(out):
        raise Failure(f"does not continue its result:\n{printed_by(out)}")


def compare(program, whole, out):
    """Compare the results and the tables of two runs."""
    compared = subprocess.run([program, "compare", str(whole), str(out)], capture_output=True, text=True)
    if compared.returncode != 0:
        raise Failure(f"ends with another result:\n{compared.stdout}{compared.stderr}")
    if (whole / "history.csv").read_bytes() != (out / "history.csv").read_bytes():
        raise Failure("ends with another history.csv")


def changes(whole, column):
    """Test whether a column of the history changes."""
    with open(whole / "history.csv", newline="") as file:
        table = list(csv.reader(file))
    names = [name.split(" ")[0] for name in table[0]]
    return len({row[names.index(column)] for row in table[1:]}) > 1


def layouts(most, sets):
    """Yield an endless sequence of (ranks, threads, instruction set); consecutive numbers of ranks differ."""
    before = 1
    number = random.randrange(len(sets))
    while True:
        ranks = random.choice([ranks for ranks in range(1, most + 1) if ranks != before])
        yield ranks, random.randint(1, 2), sets[number % len(sets)]
        before, number = ranks, number + 1


def test(program, folder, name, sets, most, trials):
    """Run a deck with and without interruptions; return the number of interruptions."""
    text, column = DECKS[name]
    deck = folder / f"{name}.toml"
    deck.write_text(text)
    whole = folder / f"{name}_whole"
    complete(program, deck, whole, (1, 1, sets[0]))
    if not changes(whole, column):
        raise Failure(f"does not use its feature: {column} does not change")
    last = rows(whole)
    interruptions = 0
    for trial in range(trials):
        out = folder / f"{name}_{trial}"
        parts, story = layouts(most, sets), []
        try:
            for part in range(INTERRUPTIONS):
                layout = next(parts)
                kind = ["stop", "kill"][(part + trial) % 2]
                at = int(last * (part + random.uniform(0.2, 0.8)) / (INTERRUPTIONS + 1))
                story.append(f"{kind} on {layout} after row {at}")
                interruptions += interrupt(program, deck, out, layout, at, kind)
            layout = next(parts)
            story.append(f"end on {layout}")
            complete(program, deck, out, layout)
            compare(program, whole, out)
        except Failure as failure:
            raise Failure(f"trial {trial} ({'; '.join(story)}; ranks, threads, instructions) {failure}") from None
    if interruptions == 0:
        raise Failure("was never interrupted")
    return interruptions


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="10 trials of each deck instead of 1, on up to 7 ranks instead of 3")
    parser.add_argument("--trials", type=int, help="trials of each deck [1; with --full 10]")
    parser.add_argument("--seed", type=int, default=1, help="seed of the random choices [1]")
    parser.add_argument("--only", choices=DECKS, nargs="+", help="run these decks only")
    arguments = parser.parse_args()
    trials, most = arguments.trials or (10 if arguments.full else 1), 7 if arguments.full else 3
    program = binary()
    random.seed(arguments.seed)
    sets = instruction_sets(program)
    only = " only: restarts on another instruction set are not tested" if len(sets) == 1 else ""
    print(f"instructions: {', '.join(sets)}{only}", flush=True)
    failed = []
    with tempfile.TemporaryDirectory(prefix="restart_test.") as folder:
        for name in arguments.only or DECKS:
            begin = time.monotonic()
            try:
                count = test(program, Path(folder), name, sets, most, trials)
                print(f"  {name}: {count} interruptions, equal, {time.monotonic() - begin:.1f} s", flush=True)
            except Failure as failure:
                failed.append(name)
                print(f"  error: {name} {failure}", flush=True)
    sys.exit(f"error: {len(failed)} decks failed: {', '.join(failed)}" if failed else None)


if __name__ == "__main__":
    main()
