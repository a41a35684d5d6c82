#!/usr/bin/env python3
"""Mixed-mode fracture of a PMMA plate: the experiment of Réthoré (2018) and the computation of Willberg,
Hesse & Heinecke (2022).

Runs `inputs/pmma_mixed_mode.toml` with one or several laws on the same grid. Draws the computed crack path beside the
measured path, and the force and the crack length over the displacement of the plate's right side.
"""

import argparse
import json
import math
import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import common  # noqa: E402  (the folder above has it)
from common import ROOT, fissure, history, numpy, pyplot  # noqa: E402

EXAMPLES = """\
examples:
  studies/pmma/run.py --small                       spacing 2 mm, a test that the study runs; seconds
  studies/pmma/run.py --dx 1e-3                     spacing 1 mm
  studies/pmma/run.py --laws correspondence --dx 0.31e-3
                                             grid of the 2022 paper; 8 minutes on two cores
  studies/pmma/run.py --set fracture_energy=100 --set family_correction=0 --set damage.brittle.energy.calibration=energy
                                             damage as in the 2022 paper, see docs/src/verification/pmma.md
  studies/pmma/run.py --relaxation 60               without inertia: 60 load steps, each relaxed to equilibrium
  studies/pmma/run.py --set speed=0.01              another value of a parameter of the deck; may be repeated
  studies/pmma/run.py --reuse                       table and pictures of runs that are in the output folder

All displacements in the table are those of the plate's right side. Initiation is the displacement at which the crack is
one horizon long. The deviation of the path is the largest vertical distance between the main branch of the crack and the
measured path, over the x that both cover. The column "as far left as x" has the smallest x of this comparison. The
column "crack right of the hole from" has the displacement at which damage right of the hole's centre first exceeds the
deck's threshold; `none` means that it does not.

Writes pmma.md (the table), pmma.json, pmma_path.png and pmma_curves.png into the output folder.
"""

DECK = ROOT / "inputs/pmma_mixed_mode.toml"

# Willberg et al. (2022), table 1, mm.
NOTCH = [[92.5, 35.0], [71.7, 21.0], [65.1, 18.0]]
MEASURED = [
    [65.1, 18.0],
    [63.1, 20.0],
    [61.1, 21.9],
    [59.1, 23.3],
    [57.1, 24.7],
    [55.1, 25.8],
    [53.1, 26.9],
    [51.1, 27.7],
    [49.1, 28.5],
    [47.1, 29.1],
    [45.1, 29.4],
    [43.1, 29.7],
    [41.1, 30.0],
    [39.1, 30.3],
    [37.1, 30.6],
    [35.1, 31.0],
    [15.0, 31.0],
]
INITIATION = 0.43e-3  # m, the paper's section 6.3
HOLE = (0.095, 0.035, 0.015)  # centre and radius, m
CRACKED = 0.35  # the deck's damage_threshold

# Replacements in the deck for relaxation: no inertia, and a row of the history at each equilibrium.
RELAXED = {
    r'(?m)^end = "end_displacement/speed"$': """\
end = "end_displacement/speed"
method = "relaxation"
relaxation = {{ load_steps = {steps}, tolerance = 1e-4 }}""",
    r"\[initial\.compression\]\n.*\n": "",
    r'every = "end_displacement/speed/700"': "every_steps = 1",
}

# The tables [material] and [damage] of each law; None stands for the tables of the deck.
LAWS = {
    "correspondence": None,
    "ordinary": """\
[material.pmma.ordinary]
density = "density"
youngs_modulus = "youngs_modulus"
poisson_ratio = "poisson_ratio"

[damage.brittle.critical_stretch]
fracture_energy = "fracture_energy"
alpha = 0
no_failure = ["left", "right"]

""",
}
# Parameter of the deck that only damage by energy uses.
OF_WORK = "family_correction"
COLOURS = ("#1b6ca8", "#d1495b", "#66a182", "#8d6a9f")

FORCES_AT = (0.1e-3, 0.2e-3, 0.3e-3, 0.4e-3, 0.59e-3)  # m
LENGTHS_AT = (0.5e-3, 0.55e-3, 0.59e-3, 0.65e-3)  # m
# Réthoré (2018): forces (N) and crack lengths (m) of the experiment at these displacements.
MEASURED_FORCES = (930, 1990, 3040, 4090, 5460)
MEASURED_LENGTHS = (8.9e-3, 13.6e-3, 17.2e-3, 23.6e-3)


def arguments():
    parser = common.parser(__file__, __doc__, EXAMPLES)

    def spacing(text):
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not 0 < value <= 5e-3:
            raise argparse.ArgumentTypeError(f"must be a spacing in m, at most 5e-3, is `{text}`")
        return value

    def load_steps(text):
        if not text.isdigit() or int(text) == 0:
            raise argparse.ArgumentTypeError(f"must be a number of load steps, 1 or more, is `{text}`")
        return int(text)

    add = parser.add_argument
    add("--laws", type=common.several_of(LAWS), default=list(LAWS), metavar="LIST", help="laws: correspondence,ordinary [all]")
    add("--dx", type=spacing, default=0.5e-3, metavar="M", help="spacing, m [0.5e-3]")
    add("--small", action="store_true", help="spacing 2 mm and fast loading (0.2 m/s)")
    add("--relaxation", type=load_steps, metavar="STEPS", help="solve by relaxation, with this number of load steps [explicit time steps]")
    add("--set", action="append", default=[], metavar="NAME=VALUE", help="set a parameter or a key of the deck; may be repeated")
    add("--reuse", action="store_true", help="do not repeat runs whose results are in the output folder")
    add("--threads", type=int, metavar="N", help="threads of each run [all cores]")
    options = common.start(parser)
    if options.small:
        options.dx = 2e-3
        options.set = ["speed=0.2", *options.set]
    return options


def deck(law, load_steps):
    """Return the text of the deck with this law; with relaxation if a number of load steps is given, else with explicit steps."""
    text = DECK.read_text()

    def replace(pattern, new):
        nonlocal text
        text, count = re.subn(pattern, lambda _: new, text)
        if count != 1:
            sys.exit(f"error: {DECK} has {count} times what fits `{pattern}`, and should have it once")

    if LAWS[law] is not None:
        replace(r"(?s)\[material\.pmma\..*?(?=\[body\.plate\])", LAWS[law])
        replace(rf"(?m)^{OF_WORK} = .*\n", "")
    if load_steps:
        for pattern, new in RELAXED.items():
            replace(pattern, new.format(steps=load_steps))
    return text


def run(options, law):
    """Run the deck with a law; return the folder of the result."""
    way = "-relaxed" if options.relaxation else ""
    folder = options.output / f"{law}-{options.dx * 1e3:g}{way}"
    if options.reuse and (folder / "crack_main.csv").exists():
        return folder
    assignments = [f"dx={options.dx!r}", *options.set]
    if LAWS[law] is not None:
        assignments = [assignment for assignment in assignments if not assignment.startswith(f"{OF_WORK}=")]
    common.run(options, folder, deck(law, options.relaxation), assignments)
    return folder


def metres(places):
    """Convert positions in mm to an array of positions in m."""
    return 1e-3 * numpy.array(places)


def branches(folder):
    """Return the branches of the crack as arrays of positions (m), longest first."""
    return common.branches(folder / "crack_main.csv")


def deviation(path):
    """Return the largest vertical distance (m) between a path and the measured path, and the smallest compared x (m)."""
    along, up = metres(MEASURED).T
    left = max(path[:, 0].min(), along[-1])
    places = numpy.linspace(left, min(path[:, 0].max(), along[0]), 400)
    order = numpy.argsort(path[:, 0], kind="stable")
    found = numpy.interp(places, path[order, 0], path[order, 1])
    measured = numpy.interp(places, along[::-1], up[::-1])
    return float(numpy.abs(found - measured).max()), float(left)


def damage(folder):
    """Return the positions (m) of the points, the damage by output and point, and the times (s) of the outputs."""
    with fissure.open(folder) as result:
        return result.points, result["damage"], result.times


def evaluate(folder, law, dx):
    """Return the row of the table for a run."""
    columns = history(folder)
    way = -columns["probe_right_displacement_x"]
    force, length = columns["force_push"], columns["crack_main_length"]
    horizon = 3 * dx

    def at(values, displacement):
        return float(numpy.interp(displacement, way, values)) if way[-1] >= displacement else None

    grown = numpy.nonzero(length > horizon)[0]
    result = {"law": law, "dx": dx, "points": len(damage(folder)[0])}
    result["initiation"] = float(way[grown[0]]) if len(grown) else None
    result["forces"] = [at(force, displacement) for displacement in FORCES_AT]
    result["peak_force"] = float(force.max())
    result["peak_at"] = float(way[force.argmax()])
    result["lengths"] = [at(length, displacement) for displacement in LENGTHS_AT]
    result["branches"] = float(columns["crack_main_branches"][-1])
    # Skip the first tenth of the displacement, in which the strain energy is too small for a ratio.
    late = way > 0.1 * way[-1]
    result["kinetic_share"] = float((columns["kinetic_energy"][late] / columns["strain_energy"][late]).max())
    result["deviation"] = result["reached"] = None
    if lines := branches(folder):
        result["deviation"], result["reached"] = deviation(lines[0])
    places, values, times = damage(folder)
    right = (places[:, 0] > HOLE[0]) & (numpy.hypot(places[:, 0] - HOLE[0], places[:, 1] - HOLE[1]) < 3 * HOLE[2])
    cracked = (values[:, right] > CRACKED).any(axis=1)
    at_right = numpy.interp(times, columns["time"], way)[cracked]
    result["right_of_hole"] = float(at_right[0]) if len(at_right) else None
    return result


def table(results):
    def number(value, factor=1e3, digits=2):
        return "none" if value is None else f"{factor * value:.{digits}f}"

    heads = ["law", "dx, mm", "points", "initiation, mm", "deviation of the path, mm", "as far left as x, mm"]
    heads += ["crack right of the hole from, mm"]
    heads += [f"force at {1e3 * displacement:g} mm, kN" for displacement in FORCES_AT]
    heads += ["peak force, kN", "at, mm"]
    heads += [f"crack at {1e3 * displacement:g} mm, mm" for displacement in LENGTHS_AT]
    heads += ["branches", "kinetic/strain energy"]
    rows = [heads, ["---"] * len(heads)]
    for result in results:
        row = [f"`{result['law']}`", f"{result['dx'] * 1e3:g}", str(result["points"])]
        row += [number(result[key]) for key in ("initiation", "deviation", "reached", "right_of_hole")]
        row += [number(force, 1e-3) for force in result["forces"]]
        row += [number(result["peak_force"], 1e-3), number(result["peak_at"])]
        row += [number(length, 1e3, 1) for length in result["lengths"]]
        row += [f"{result['branches']:g}", f"{result['kinetic_share']:.1e}"]
        rows.append(row)
    measured = ["measured", "", "", number(INITIATION), "0 (±4 wanted)", "", "none"]
    measured += [number(force, 1e-3) for force in MEASURED_FORCES] + ["", ""]
    measured += [number(length, 1e3, 1) for length in MEASURED_LENGTHS] + ["1", ""]
    rows.append(measured)
    return "".join("| " + " | ".join(row) + " |\n" for row in rows)


def draw_path(runs, path):
    figure, axes = pyplot.subplots(
        len(runs), 1, figsize=(8, 0.4 + 4.2 * len(runs)), squeeze=False, layout="constrained"
    )
    for (law, dx, folder), axis in zip(runs, axes[:, 0]):
        places, values, _ = damage(folder)
        x, y = 1e3 * places[:, 0], 1e3 * places[:, 1]
        # Area of a cell in square points (1/72 inch): the plate is 140 mm wide, the axis about 7 inches.
        size = (72 * 7 / 140 * 1e3 * dx) ** 2
        marks = axis.scatter(x, y, c=values[-1], s=size, marker="s", linewidths=0, cmap="Greys", vmin=0, vmax=0.8)
        figure.colorbar(marks, ax=axis, label="damage")
        axis.plot(*zip(*MEASURED), color="#009e73", linewidth=1.5, label="measured path")
        axis.plot(*zip(*NOTCH), color="#009e73", linewidth=1, linestyle=":", label="measured notch")
        for number, branch in enumerate(branches(folder)):
            label = "computed path" if number == 0 else None
            axis.plot(*(1e3 * branch.T), color="#d1495b", linewidth=1.2, label=label)
        axis.set(aspect="equal", xlabel="x, mm", ylabel="y, mm", title=f"{law}, dx = {dx * 1e3:g} mm")
        axis.set(xlim=(0, 140), ylim=(0, 70))
        axis.legend(loc="lower right", fontsize=8)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def draw_curves(runs, path):
    figure, (forces, lengths) = pyplot.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for (law, dx, folder), colour in zip(runs, COLOURS):
        columns = history(folder)
        way = -1e3 * columns["probe_right_displacement_x"]
        label = f"{law}, dx = {dx * 1e3:g} mm"
        forces.plot(way, 1e-3 * columns["force_push"], color=colour, linewidth=1, label=label)
        lengths.plot(way, 1e3 * columns["crack_main_length"], color=colour, linewidth=1, label=label)
    for axis in (forces, lengths):
        axis.axvline(1e3 * INITIATION, color="#009e73", linestyle="--", linewidth=1, label="initiation, measured")
        axis.set_xlabel("displacement of the right side, mm")
        axis.set_xlim(left=0)
    measured = {"color": "#009e73", "marker": "o", "linestyle": "none", "label": "measured"}
    forces.plot(1e3 * numpy.array(FORCES_AT), 1e-3 * numpy.array(MEASURED_FORCES), **measured)
    lengths.plot(1e3 * numpy.array(LENGTHS_AT), 1e3 * numpy.array(MEASURED_LENGTHS), **measured)
    forces.set(ylabel="force, kN", ylim=(0, None))
    lengths.set_ylabel("length of the crack, mm")
    forces.legend(fontsize=8)
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def main():
    options = arguments()
    options.output.mkdir(parents=True, exist_ok=True)
    runs = [(law, options.dx, run(options, law)) for law in options.laws]
    results = [evaluate(folder, law, dx) for law, dx, folder in runs]
    (options.output / "pmma.json").write_text(json.dumps(results, indent=1) + "\n")
    (options.output / "pmma.md").write_text(table(results))
    draw_path(runs, options.output / "pmma_path.png")
    draw_curves(runs, options.output / "pmma_curves.png")
    print(f"{table(results)}\ntable and pictures are in {options.output}")


if __name__ == "__main__":
    main()
