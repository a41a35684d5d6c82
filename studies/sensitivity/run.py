#!/usr/bin/env python3
"""Runs a deck for many values of its parameters, given by a table or a Morris design.

Each row of the table or design is one run of the deck. The runs are executed in parallel on this machine or as
a Slurm array. The same command continues an interrupted study: complete rows are kept, other rows restart from
their checkpoints. After the runs, the outputs that the study file defines are collected from the histories into
results.csv. For a Morris design, μ* (the mean of the absolute elementary effects) with its 95 % confidence
interval, and σ (the standard deviation of the elementary effects), are computed, printed and drawn. The crack
paths of all runs are drawn in one picture.
"""

import argparse
import concurrent.futures
import csv
import difflib
import math
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
import tomllib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import common  # noqa: E402  (the folder above has it)
from common import ROOT, branches, numpy, pyplot  # noqa: E402

EXAMPLES = """\
examples:
  studies/sensitivity/run.py studies/pmma/morris.toml             on this machine, one run per core
  studies/sensitivity/run.py study.toml --jobs 2 --threads 4      two runs at a time, four threads each
  studies/sensitivity/run.py study.toml --rows 1-10,13            only these rows
  studies/sensitivity/run.py study.toml --slurm --time=02:00:00   as a job array; passes --time to sbatch
  studies/sensitivity/run.py study.toml --collect                 tables and pictures of existing results

The study file is TOML:

  deck = "../plate.toml"          path relative to the study file
  fixed = { dx = 1e-3 }           values of parameters of the deck that are the same in all runs
  keep = ["history.csv"]          files of a complete run that are kept [all files]

  [design.morris]                 a Morris design
  trajectories = 5                each of k + 1 runs for k parameters
  levels = 4                      number of values of each parameter, even
  seed = 1
                                  instead of [design.morris], a table of values:
                                  design.rows = [{ tension = 18e6 }, …], or
                                  design.table = "loads.txt", in the format of slurm/array.sbatch

  [parameter.tension]             range of a parameter in a Morris design
  lower = 18e6
  upper = 22e6
                                  instead of lower and upper: `mean` and `range`,
                                  for mean − range to mean + range
  label = "T"                     name in pictures [name of the parameter]

  [output.reaction]               one number from the history of each run
  column = "reaction_top"         the column that has the number
  at = { column = "time", value = 20e-6 }
                                  take it where the column `time` has this value, by linear
                                  interpolation; instead of `at`: pick = "last", "first", "max" or "min"
  scale = 1e-3                    factor on the number in tables and pictures [1]
  unit = "kN"                     unit of the scaled number, for tables and pictures

  [paths]                         heat map of the crack paths of all runs
  file = "crack_NAME.csv"         file that [history.crack.NAME] of the deck writes
  lower = [0, 0]                  lower corner of the drawn part of the plane, m
  upper = [0.1, 0.04]             upper corner, m
  cell = 0.5e-3                   size of a cell of the map, m
  reference = [[0, 0], [0.1, 0]]  a path that is drawn for comparison, m

Writes table.txt (the table of parameter values), row_K/ (the run of row K), results.csv, morris.csv, morris.png
and paths.png into the output folder. Exit codes: 0 all done; 1 some runs failed; 2 the study file or the
arguments are wrong; 75 stopped by a signal, and the same command continues the study.
"""

STOPPED = 75

KEYS = {
    "": ["title", "deck", "fixed", "keep", "design", "parameter", "output", "paths"],
    "design": ["morris", "rows", "table"],
    "design.morris": ["trajectories", "levels", "seed"],
    "parameter": ["lower", "upper", "mean", "range", "label"],
    "output": ["column", "at", "pick", "scale", "unit"],
    "output.at": ["column", "value"],
    "paths": ["file", "lower", "upper", "cell", "reference"],
}


class Wrong(Exception):
    """An error in the study file or in the arguments."""


class Study:
    """A validated study file."""

    def __init__(self, path):
        self.path = path
        try:
            self.text = path.read_text()
            self.values = tomllib.loads(self.text)
        except OSError as error:
            raise Wrong(f"{path}: cannot read the study: {error.strerror}") from None
        except tomllib.TOMLDecodeError as error:
            raise Wrong(f"{path}: {error}") from None
        self.check_keys("", self.values)
        self.deck = self.find_file("deck", self.text_of("", self.values, "deck"))
        try:
            deck = tomllib.loads(self.deck.read_text())
        except tomllib.TOMLDecodeError as error:
            raise Wrong(f"{self.deck}: {error}") from None
        self.known = list(deck.get("parameters", {}))
        self.fixed = self.values.get("fixed", {})
        for name in self.fixed:
            self.parameter_of_deck("fixed", name)
        self.keep = self.values.get("keep")
        self.outputs = self.tables("output")
        for name, output in self.outputs.items():
            self.check_output(name, output)
        self.paths = self.values.get("paths")
        if self.paths is not None:
            self.check_paths()
        self.morris = None
        self.names, self.rows = self.design()

    def wrong(self, key, message):
        """Return an error about a key such as `output.NAME.pick`, with the number of the line that sets the last part of the key."""
        word = re.escape(key.rsplit(".", 1)[-1])
        pattern = re.compile(rf"^\s*(\[[^\]]*\b{word}\]|[^#]*\b{word}\s*=)")
        lines = (number for number, line in enumerate(self.text.splitlines(), 1) if pattern.search(line))
        line = next(lines, None)
        place = f"{self.path}:{line}" if line else f"{self.path}"
        return Wrong(f"{place}: {key}: {message}")

    def check_keys(self, section, table):
        kind = re.sub(r"^(parameter|output)\.[^.]*", r"\1", section)
        for key in table:
            if key not in KEYS[kind]:
                near = difflib.get_close_matches(key, KEYS[kind], 1)
                hint = f"; did you mean `{near[0]}`?" if near else ""
                known = ", ".join(KEYS[kind])
                raise self.wrong(f"{section}.{key}".strip("."), f"unknown key{hint} (known: {known})")

    def tables(self, section):
        tables = self.values.get(section, {})
        if not isinstance(tables, dict) or not all(isinstance(table, dict) for table in tables.values()):
            raise self.wrong(section, f"must be tables [{section}.NAME]")
        for name, table in tables.items():
            self.check_keys(f"{section}.{name}", table)
        return tables

    def text_of(self, section, table, key):
        value = table.get(key)
        if not isinstance(value, str):
            raise self.wrong(f"{section}.{key}".strip("."), "must be given, a text")
        return value

    def number_of(self, section, table, key, default=None):
        value = table.get(key, default)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
            raise self.wrong(f"{section}.{key}", f"must be a number, is {value!r}")
        return value

    def find_file(self, key, name):
        path = (self.path.parent / name).resolve()
        if not path.is_file():
            raise self.wrong(key, f"there is no file {path}")
        return path

    def parameter_of_deck(self, key, name):
        if name not in self.known:
            near = difflib.get_close_matches(name, self.known, 1)
            hint = f"; did you mean `{near[0]}`?" if near else ""
            known = ", ".join(self.known)
            raise self.wrong(f"{key}.{name}", f"{self.deck.name} has no parameter `{name}`{hint} (it has {known})")

    def check_output(self, name, output):
        section = f"output.{name}"
        self.text_of(section, output, "column")
        if ("at" in output) == ("pick" in output):
            raise self.wrong(section, "give one of `at` and `pick`")
        if "at" in output:
            at = output["at"]
            if not isinstance(at, dict):
                raise self.wrong(f"{section}.at", "must be { column = …, value = … }")
            self.check_keys(f"{section}.at", at)
            self.text_of(f"{section}.at", at, "column")
            self.number_of(f"{section}.at", at, "value")
        elif output["pick"] not in PICKS:
            raise self.wrong(f"{section}.pick", f"must be one of {', '.join(PICKS)}, is {output['pick']!r}")
        self.number_of(section, output, "scale", 1.0)

    def check_paths(self):
        self.check_keys("paths", self.paths)
        self.text_of("paths", self.paths, "file")

        def is_place(place):
            return (
                isinstance(place, list)
                and len(place) == 2
                and all(isinstance(entry, (int, float)) for entry in place)
            )

        for key in ("lower", "upper"):
            if not is_place(self.paths.get(key)):
                raise self.wrong(f"paths.{key}", "must be a place [x, y] in m")
        if any(low >= high for low, high in zip(self.paths["lower"], self.paths["upper"])):
            raise self.wrong("paths.upper", "must lie above `lower` in x and y")
        if not all(is_place(place) for place in self.paths.get("reference", [])):
            raise self.wrong("paths.reference", "must be a list of places [x, y] in m")
        if self.number_of("paths", self.paths, "cell") <= 0:
            raise self.wrong("paths.cell", "must be above 0")

    def design(self):
        """Return the names of the varied parameters, and for each row the values of these parameters as texts."""
        design = self.values.get("design", {})
        self.check_keys("design", design)
        ranges = self.tables("parameter")
        if len(design) != 1:
            raise self.wrong("design", "give one of `morris`, `rows` and `table`")
        if "morris" in design:
            return self.morris_design(design["morris"], ranges)
        if ranges:
            raise self.wrong("parameter", "ranges are for a Morris design")
        names, rows = self.rows_of(design["rows"]) if "rows" in design else self.rows_of_table(design["table"])
        for name in names:
            self.parameter_of_deck("design", name)
        if not rows:
            raise self.wrong("design", "has no rows")
        return names, rows

    def rows_of(self, rows):
        if not isinstance(rows, list) or not all(isinstance(row, dict) and row for row in rows):
            raise self.wrong("design.rows", "must be a list of tables { parameter = value }")
        names = list(rows[0]) if rows else []
        for number, row in enumerate(rows, 1):
            if list(row) != names:
                raise self.wrong("design.rows", f"row {number} must name {', '.join(names)}, as the first does")
        return names, [[f"{value}" for value in row.values()] for row in rows]

    def rows_of_table(self, name):
        path = self.find_file("design.table", name)
        lines = [line.split("#")[0].split() for line in path.read_text().splitlines()]
        lines = [line for line in lines if line]
        if len(lines) < 2:
            raise Wrong(f"{path}: must have a line of names and one or more of values")
        for number, line in enumerate(lines[1:], 1):
            if len(line) != len(lines[0]):
                raise Wrong(f"{path}: row {number} has {len(line)} values for {len(lines[0])} names")
        return lines[0], lines[1:]

    def morris_design(self, morris, ranges):
        self.check_keys("design.morris", morris)
        if not ranges:
            raise self.wrong("parameter", "a Morris design needs [parameter.NAME] with ranges")
        bounds = []
        for name, table in ranges.items():
            self.parameter_of_deck("parameter", name)
            section = f"parameter.{name}"
            if "mean" in table:
                mean, reach = (self.number_of(section, table, key) for key in ("mean", "range"))
                low, high = mean - reach, mean + reach
            else:
                low, high = (self.number_of(section, table, key) for key in ("lower", "upper"))
            if not low < high:
                raise self.wrong(section, f"must have a range, is {low} to {high}")
            bounds.append([low, high])

        def whole(key, default, least):
            value = morris.get(key, default)
            if isinstance(value, bool) or not isinstance(value, int) or value < least:
                raise self.wrong(f"design.morris.{key}", f"must be a whole number of {least} or more, is {value!r}")
            return value

        trajectories, levels, seed = whole("trajectories", None, 2), whole("levels", 4, 2), whole("seed", 0, 0)
        if levels % 2:
            raise self.wrong("design.morris.levels", f"must be even, is {levels}")
        from SALib.sample import morris as sampling

        problem = {"num_vars": len(bounds), "names": list(ranges), "bounds": bounds}
        sample = sampling.sample(problem, trajectories, num_levels=levels, seed=seed)
        self.morris = (problem, levels)
        return list(ranges), [[repr(float(value)) for value in row] for row in sample]

    def label(self, name):
        return self.values.get("parameter", {}).get(name, {}).get("label", name)

    def table(self):
        lines = [" ".join(self.names)] + [" ".join(row) for row in self.rows]
        return "\n".join(lines) + "\n"


PICKS = {
    "last": lambda values: values[-1],
    "first": lambda values: values[0],
    "max": lambda values: numpy.nanmax(values),
    "min": lambda values: numpy.nanmin(values),
}


def arguments():
    parser = common.parser(__file__, __doc__, EXAMPLES, output="out/NAME for a study file NAME.toml")
    cores = len(os.sched_getaffinity(0))
    add = parser.add_argument
    add("study", type=pathlib.Path, help="the study file")
    add("--jobs", type=int, metavar="N", help="number of runs at a time [cores divided by threads]")
    add("--threads", type=int, default=1, metavar="N", help="threads of each run [1]")
    add("--rows", metavar="LIST", help="run only these rows, such as 1-10,13")
    add("--overwrite", action="store_true", help="replace the results of another study in the output folder")
    add("--collect", action="store_true", help="run nothing; write tables and pictures of existing results")
    add("--slurm", nargs=argparse.REMAINDER, metavar="OPTION", help="submit a Slurm array; all options after --slurm are passed to sbatch")
    options = common.start(parser, check=are_positive)
    options.jobs = options.jobs or max(1, cores // options.threads)
    options.output = (options.output or ROOT / "out" / options.study.stem).resolve()
    return options


def are_positive(options):
    """Return an error message if --jobs or --threads is below 1."""
    if options.threads < 1 or (options.jobs is not None and options.jobs < 1):
        return "--jobs and --threads must be at least 1"
    return None


def chosen_rows(text, count):
    if text is None:
        return list(range(1, count + 1))
    rows = []
    for part in text.split(","):
        match = re.fullmatch(r"(\d+)(?:-(\d+))?", part.strip())
        first, last = (int(match[1]), int(match[2] or match[1])) if match else (0, 0)
        if not 1 <= first <= last <= count:
            raise Wrong(f"--rows: `{part}` is no part of the rows 1 to {count}")
        rows += range(first, last + 1)
    return rows


def prepare(study, options):
    """Create the output folder with the table of values.

    If the folder contains another study, delete the runs of that study with --overwrite, and fail without this option.
    """
    table = options.output / "table.txt"
    # The values of `fixed` are part of the table, so a study with other fixed values is another study.
    shared = "".join(f"# {name} = {value}\n" for name, value in study.fixed.items())
    wanted = f"# {study.deck.name}\n{shared}{study.table()}"
    if table.exists() and table.read_text() != wanted:
        if not options.overwrite:
            raise Wrong(
                f"{table} belongs to another study, or to this one before it was changed; "
                "--overwrite deletes its runs and replaces it, --output DIR writes elsewhere"
            )
        for folder in options.output.glob("row_*"):
            shutil.rmtree(folder)
    options.output.mkdir(parents=True, exist_ok=True)
    table.write_text(wanted)


class Runner:
    """Runs rows of the table in parallel. At a signal, the runs write checkpoints and stop."""

    def __init__(self, study, options):
        self.study, self.options = study, options
        self.lock = threading.Lock()
        self.children = set()
        self.stopped = False

    def stop(self, *_):
        # This signal handler must not wait for `lock`, which the interrupted thread may hold.
        self.stopped = True
        for child in list(self.children):
            child.send_signal(signal.SIGTERM)

    def run(self, row):
        """Run a row and return its exit code."""
        folder = self.options.output / f"row_{row}"
        folder.mkdir(exist_ok=True)
        values = dict(zip(self.study.names, self.study.rows[row - 1]))
        command = [str(self.options.binary), "run", str(self.study.deck), "--quiet", "--output", str(folder)]
        for name, value in {**self.study.fixed, **values}.items():
            command += ["--set", f"{name}={value}"]
        command += ["--threads", str(self.options.threads)]
        continued = any(folder.glob("checkpoint_[01].h5"))
        command.append("--restart" if continued else "--overwrite")
        with open(folder / "log.txt", "a") as log:
            log.write(f"$ {' '.join(command)}\n")
            log.flush()
            with self.lock:
                if self.stopped:
                    return STOPPED
                # In a separate session, the run does not receive the signal of Ctrl-C. This script signals the run instead.
                child = subprocess.Popen(command, stdout=log, stderr=log, start_new_session=True)
                self.children.add(child)
            if self.stopped:
                child.send_signal(signal.SIGTERM)
            code = child.wait()
            self.children.discard(child)
        if code == 0:
            if self.study.keep is not None:
                for path in folder.iterdir():
                    if path.name not in [*self.study.keep, "log.txt"]:
                        path.unlink()
            (folder / "complete").touch()
        return code

    def all(self, rows):
        """Run these rows; return the rows that failed."""
        started = time.monotonic()
        failed, done = [], 0
        for kind in (signal.SIGINT, signal.SIGTERM):
            signal.signal(kind, self.stop)
        with concurrent.futures.ThreadPoolExecutor(self.options.jobs) as pool:
            runs = {pool.submit(self.run, row): row for row in rows}
            for finished in concurrent.futures.as_completed(runs):
                code, row = finished.result(), runs[finished]
                if code == STOPPED:
                    self.stopped = True
                    continue
                done += 1
                elapsed = time.monotonic() - started
                if code != 0:
                    failed.append(row)
                    log = (self.options.output / f"row_{row}" / "log.txt").read_text().splitlines()
                    print(f"row {row} failed with exit code {code}: {log[-1] if log else ''}", file=sys.stderr)
                print(f"row {row}: {done} of {len(rows)} done after {elapsed:.0f} s", flush=True)
        return sorted(failed)


def submit(study, options, rows):
    """Submit the rows as a Slurm array; return the exit code of sbatch. Rows without a checkpoint start again from an empty folder."""
    for row in rows:
        folder = options.output / f"row_{row}"
        if folder.exists() and not any(folder.glob("checkpoint_[01].h5")):
            shutil.rmtree(folder)
    command = ["sbatch", f"--array={','.join(map(str, rows))}", *options.slurm, "slurm/array.sbatch"]
    command += [str(study.deck), str(options.output / "table.txt"), str(options.output)]
    for name, value in study.fixed.items():
        command += ["--set", f"{name}={value}"]
    print(" ".join(command), flush=True)
    return subprocess.run(command, cwd=ROOT).returncode


def history(folder):
    """Return the columns of a run's history by name; None without a history."""
    try:
        columns = common.history(folder)
    except (OSError, ValueError):
        return None
    return columns if len(next(iter(columns.values()))) else None


def value_of(study, name, output, columns):
    """Return the value of an output from a run's history; NaN if the history does not reach the value of `at`."""

    def column(wanted):
        if wanted not in columns:
            near = difflib.get_close_matches(wanted, columns, 1)
            hint = f"; did you mean `{near[0]}`?" if near else ""
            raise study.wrong(f"output.{name}", f"the history has no column `{wanted}`{hint}")
        return columns[wanted]

    values = column(output["column"])
    scale = output.get("scale", 1.0)
    if "pick" in output:
        return scale * float(PICKS[output["pick"]](values))
    at, wanted = column(output["at"]["column"]), output["at"]["value"]
    # Interpolate between the first two rows that bracket the value.
    between = numpy.nonzero((at[:-1] - wanted) * (at[1:] - wanted) <= 0)[0]
    if len(between) == 0:
        return math.nan
    first = between[0]
    width = at[first + 1] - at[first]
    share = (wanted - at[first]) / width if width else 0.0
    return scale * float(values[first] + share * (values[first + 1] - values[first]))


def collect(study, options):
    """Write results.csv; return the outputs as an array [row, output], NaN for missing values."""
    names = list(study.outputs)
    results = numpy.full((len(study.rows), len(names)), math.nan)
    complete = 0
    for row in range(1, len(study.rows) + 1):
        folder = options.output / f"row_{row}"
        complete += (folder / "complete").exists()
        columns = history(folder)
        if columns is not None:
            results[row - 1] = [value_of(study, name, output, columns) for name, output in study.outputs.items()]
    heads = [f"{name} [{unit}]" if (unit := study.outputs[name].get("unit")) else name for name in names]
    with open(options.output / "results.csv", "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["row", *study.names, *heads])
        for row, (values, found) in enumerate(zip(study.rows, results), 1):
            writer.writerow([row, *values, *("" if math.isnan(value) else repr(float(value)) for value in found)])
    print(f"{complete} of {len(study.rows)} rows are complete; results are in {options.output / 'results.csv'}")
    for k, name in enumerate(names):
        missing = [str(row) for row in range(1, len(study.rows) + 1) if math.isnan(results[row - 1, k])]
        if missing and len(missing) < len(study.rows):
            print(f"{name}: no value in the rows {', '.join(missing)}, which failed or ended too early")
    return results


def sensitivities(study, results):
    """Return for each output, by name, the mean μ, μ*, the 95 % confidence of μ*, and σ of each parameter.

    Only complete trajectories are used. Outputs with fewer than two complete trajectories are left out.
    """
    from SALib.analyze import morris as analysis

    problem, levels = study.morris
    length = problem["num_vars"] + 1
    values = numpy.array(study.rows, dtype=float)
    found = {}
    for name, own in zip(study.outputs, results.T):
        whole = numpy.isfinite(own).reshape(-1, length).all(axis=1)
        if whole.sum() < 2:
            print(f"{name}: no sensitivities, because only {whole.sum()} trajectories are complete and two are needed")
            continue
        if not whole.all():
            print(f"{name}: sensitivities are from {whole.sum()} of {len(whole)} trajectories; the others are incomplete")
        rows = numpy.repeat(whole, length)
        found[name] = analysis.analyze(problem, values[rows], own[rows], num_levels=levels, seed=0)
    return found


def write_sensitivities(study, options, found):
    with open(options.output / "morris.csv", "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["output", "unit", "parameter", "mu", "mu_star", "mu_star_conf", "sigma"])
        for output, effects in found.items():
            unit = study.outputs[output].get("unit", "")
            for k, name in enumerate(study.names):
                numbers = [effects[key][k] for key in ("mu", "mu_star", "mu_star_conf", "sigma")]
                writer.writerow([output, unit, name, *(repr(float(number)) for number in numbers)])
    figure, axes = pyplot.subplots(
        len(found), 2, figsize=(10, 0.6 + 3.6 * len(found)), squeeze=False, layout="constrained"
    )
    labels = [study.label(name) for name in study.names]
    for (output, effects), (bars, plane) in zip(found.items(), axes):
        unit = study.outputs[output].get("unit")
        unit = f", {unit}" if unit else ""
        mu_star, sigma, confidence = (numpy.array(effects[key]) for key in ("mu_star", "sigma", "mu_star_conf"))
        order = numpy.argsort(mu_star)
        bars.barh([labels[k] for k in order], mu_star[order], xerr=confidence[order], color="#1b6ca8", ecolor="0.5")
        bars.set_title(f"{output}: μ* and its 95 % confidence interval{unit}", fontsize=10)
        print(f"{output}{unit}: μ* ± half of its 95 % confidence interval, σ")
        for k in order[::-1]:
            print(f"  {study.names[k]:<20} {mu_star[k]:>10.4g} ± {confidence[k]:<10.3g} {sigma[k]:>10.4g}")
        bars.set_xlim(left=0)
        plane.scatter(mu_star, sigma, color="#d1495b", s=18)
        for k, label in enumerate(labels):
            plane.annotate(label, (mu_star[k], sigma[k]), xytext=(4, 3), textcoords="offset points", fontsize=9)
        end = 1.08 * max(mu_star.max(), sigma.max(), 1e-300)
        plane.plot([0, end], [0, end], color="0.7", linewidth=0.8)
        plane.set(xlim=(0, end), ylim=(0, end), xlabel=f"μ*{unit}", ylabel=f"σ{unit}")
    figure.savefig(options.output / "morris.png", dpi=110)
    pyplot.close(figure)
    print(options.output / "morris.png")


def covered(lines, centres, reach):
    """Return for each cell whether its centre (m) is within `reach` (m) of one of the lines."""
    near = numpy.zeros(centres.shape[:2], dtype=bool)
    for line in lines:
        for start, end in zip(line[:-1], line[1:]):
            way = end - start
            square = max(float(way @ way), 1e-300)
            share = numpy.clip((centres - start) @ way / square, 0, 1)
            beside = centres - start - share[..., None] * way
            near |= (beside**2).sum(axis=-1) <= reach**2
    return near


def heat_map(study, options):
    """Draw for each cell of the map the number of runs whose crack is within one cell size of the centre of the cell."""
    rule = study.paths
    cell = rule["cell"]
    xs, ys = (numpy.arange(low + cell / 2, high, cell) for low, high in zip(rule["lower"], rule["upper"]))
    centres = numpy.stack(numpy.meshgrid(xs, ys), axis=-1)
    counts, runs = numpy.zeros(centres.shape[:2], dtype=int), 0
    for row in range(1, len(study.rows) + 1):
        path = options.output / f"row_{row}" / rule["file"]
        if path.exists() and (lines := branches(path)):
            counts += covered(lines, centres, cell)
            runs += 1
    extent = [1e3 * value for value in (rule["lower"][0], rule["upper"][0], rule["lower"][1], rule["upper"][1])]
    height = 8 * (extent[3] - extent[2]) / (extent[1] - extent[0])
    figure, axis = pyplot.subplots(figsize=(9, 1.2 + height), layout="constrained")
    colours = pyplot.get_cmap("magma_r").copy()
    colours.set_under("white")
    image = axis.imshow(
        counts, origin="lower", extent=extent, cmap=colours, vmin=0.5, vmax=max(1, runs), interpolation="nearest"
    )
    figure.colorbar(image, ax=axis, label=f"number of runs, of {runs} with a crack")
    if reference := rule.get("reference"):
        axis.plot(*(1e3 * numpy.array(reference).T), color="#009e73", linewidth=1.5, label="reference")
        axis.legend(loc="best", fontsize=8)
    axis.set(xlabel="x, mm", ylabel="y, mm")
    figure.savefig(options.output / "paths.png", dpi=110)
    pyplot.close(figure)
    print(f"{options.output / 'paths.png'}: {runs} runs with a crack")


def main():
    options = arguments()
    study = Study(options.study)
    rows = chosen_rows(options.rows, len(study.rows))
    prepare(study, options)
    rows = [row for row in rows if not (options.output / f"row_{row}" / "complete").exists()]
    failed = []
    if not options.collect and rows:
        if options.slurm is not None:
            return submit(study, options, rows)
        print(f"{len(rows)} of {len(study.rows)} rows to run, {options.jobs} at a time", flush=True)
        runner = Runner(study, options)
        failed = runner.all(rows)
        if runner.stopped:
            print("stopped; the same command continues the study", file=sys.stderr)
            return STOPPED
    results = collect(study, options)
    if study.morris and study.outputs:
        if found := sensitivities(study, results):
            write_sensitivities(study, options, found)
    if study.paths:
        heat_map(study, options)
    return 1 if failed else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except Wrong as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(2)
