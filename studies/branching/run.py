#!/usr/bin/env python3
"""Crack branching on adaptively refined and on uniform grids (Dipasquale et al. 2014, §4).

Runs inputs/crack_branching_adaptive.toml with horizons of 3 to 6 fine spacings; --twice adds runs with two levels of
refinement. Runs the same plate on the uniform coarse grid and on uniform fine grids, one run after the other on one
core.

Prints for each run: points, run time, fracture energy and crack length. For a refined grid, it also prints the
largest distance between its crack and two cracks on uniform grids, in coarse spacings. The first is the crack on the
uniform fine grid. The second is the crack on a uniform fine grid with the points of the refined grid ("same places").
Each distance is printed twice: for all branches ("all"), and for the branches that reach the right side ("through").
A picture of each crack is written to the output folder.

With --shifts N, instead runs the refined and the uniform fine grid with N different shifts of the lattice each. Prints
mean and standard deviation of the x of the branching point, and of the heights of the outermost branches at the right
side. Also prints Welch's t for the difference of the means between the two grids; an absolute value above 2.2 is
significant at the 5 % level for 12 shifts.
"""

import pathlib
import re
import resource
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import common  # noqa: E402  (the folder above has it)
from common import ROOT, fissure, numpy, replace_once  # noqa: E402

DECK = ROOT / "inputs" / "crack_branching_adaptive.toml"
BEYOND_THE_NOTCH = 0.055  # m
NEAR_THE_SIDE = 0.095  # m


def deck(spacing):
    """Return the deck of the refined plate with a spacing (m) of the coarse grid."""
    return with_value(DECK.read_text(), "dx", spacing)


def value(text, key):
    """Return the first number assigned to a key in the text of a deck."""
    return float(re.search(rf"(?m)^{key} = (\S+)", text)[1])


def with_value(text, key, number):
    """Return the text of a deck in which the first number assigned to a key is replaced."""
    return re.sub(rf"(?m)^{key} = \S+", f"{key} = {number}", text, count=1)


def uniform(spacing, ratio):
    """Return the deck of the plate on a uniform grid with a spacing (m) and a horizon in spacings."""
    text = re.sub(r"(?ms)^\[refinement[^\]]*\]\n.*?(?=^\[(?!refinement)|\Z)", "", deck(spacing))
    return re.sub(r'(?m)^horizon = "3\*dx"', f'horizon = "{ratio}*dx"', text)


def same_places(coarse, ratio):
    """Return the deck with a uniform fine grid that contains the points of the refined grid.

    The points of this grid are the points of the coarse grid and points half-way between these, except on the notch.
    """
    text = uniform(coarse / 2, ratio)
    shift = coarse / 4
    whole = 'shape.box = { lower = [0, "-height/2"], upper = ["length", "height/2"] }'
    box = f'lower = [{shift}, "-height/2 + {shift}"], upper = ["length - {shift}", "height/2 - {shift}"]'
    notch = 'lower = [0, "-dx/4"], upper = ["length/2 + dx/4", "dx/4"]'
    changes = {
        "[grid]\n": f"[grid]\norigin = [{shift}, {shift}]\n",
        whole: f"shape.difference = [{{ box = {{ {box} }} }}, {{ box = {{ {notch} }} }}]",
        'where = "y > height/2 - dx"': 'where = "y > height/2 - 1.5*dx"',
        'where = "y < -height/2 + dx"': 'where = "y < -height/2 + 1.5*dx"',
    }
    for old, new in changes.items():
        text = replace_once(text, old, new, DECK)
    return text


def refined(coarse, ratio):
    """Return the deck with one level of refinement and a horizon of `ratio` fine spacings."""
    return with_value(deck(coarse), "m", ratio)


def refined_twice(coarse):
    """Return the deck with two levels of refinement and the same ratio of horizon to spacing on all levels."""
    text = re.sub(r"(?m)^levels = 1", "levels = 2", deck(coarse))
    text = re.sub(r'(?m)^rule = .*\n^m = \["m"\]\n', 'rule = "delta"\n', text)
    return re.sub(r"(?m)^interface_factor = .*\n", "", text)


def cases(arguments):
    """Yield for each run its name, its deck and the names of the uniform runs to compare it with."""
    coarse = arguments.dx

    def asked(text):
        for key, number in (("energy", arguments.energy), ("every_steps", arguments.every)):
            text = text if number is None else with_value(text, key, number)
        return text

    yield "coarse", uniform(coarse, 3), []
    for ratio in arguments.m:
        fine, same = f"fine, m = {ratio}", f"same places, m = {ratio}"
        yield fine, uniform(coarse / 2, ratio), []
        yield same, same_places(coarse, ratio), [fine]
        yield f"refined, m = {ratio}", asked(refined(coarse, ratio)), [fine, same]
    if arguments.twice:
        yield "finer, m = 3", uniform(coarse / 4, 3), []
        yield "refined twice, m = 3", asked(refined_twice(coarse)), ["finer, m = 3"]


def processor_seconds():
    """Return the processor time of all runs so far, s."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run(arguments, name, text):
    """Run a deck; return the folder of the result and the shortest processor time, s."""
    folder = arguments.output / re.sub(r"\W+", "_", name)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "deck.toml").write_text(text)
    out = folder / "out"
    command = [arguments.binary, "run", folder / "deck.toml", "--output", out, "--overwrite", "--quiet"]
    seconds = []
    for _ in range(arguments.repeat):
        begin = processor_seconds()
        subprocess.run([str(part) for part in [*command, "--threads", "1"]], check=True)
        seconds.append(processor_seconds() - begin)
    return out, min(seconds)


def lines(out):
    """Return the branches of the crack at the end of a run, each as an array of positions, m."""
    return common.branches(out / "crack_notch.csv")


def distance(places, branches):
    """Return the largest distance, m, of the positions beyond the notch from the nearest of the branches."""
    places = places[places[:, 0] > BEYOND_THE_NOTCH]
    nearest = numpy.full(len(places), numpy.inf)
    for branch in branches:
        for start, end in zip(branch[:-1], branch[1:]):
            along = end - start
            share = numpy.clip((places - start) @ along / max(along @ along, 1e-30), 0, 1)
            gaps = places - start - share[:, None] * along
            nearest = numpy.minimum(nearest, numpy.hypot(*gaps.T))
    return nearest.max(initial=0)


def has_grown(branches):
    return any((branch[:, 0] > BEYOND_THE_NOTCH).any() for branch in branches)


def apart(one, other):
    """Return the Hausdorff distance of two cracks beyond the notch, m; NaN if a crack has not grown."""
    if not has_grown(one) or not has_grown(other):
        return numpy.nan
    return max(distance(numpy.concatenate(one), other), distance(numpy.concatenate(other), one))


def through(branches):
    """Return the branches that reach the right side."""
    return [branch for branch in branches if branch[:, 0].max() > NEAR_THE_SIDE]


def shifted(text, coarse, number):
    """Return the deck with its lattice shifted by a fraction of the coarse spacing in both directions.

    The pairs of fractions are a low-discrepancy sequence (Roberts 2018) in the unit square.
    """
    shift = [coarse * ((0.5 + number * step) % 1) for step in (0.7548776662, 0.5698402910)]
    return replace_once(text, "[grid]\n", f"[grid]\norigin = {shift}\n", DECK)


def figures(branches):
    """Return the x of the branching point, and the distances of the outermost branches from the axis at the right side, m.

    The branching point is where the crack is first more than 2 mm off the axis. The distances are those of the upper and of
    the lower branch. A value is NaN if the crack does not reach this place.
    """
    places = numpy.concatenate(branches)
    apart = places[numpy.abs(places[:, 1]) > 2e-3]
    at_side = places[places[:, 0] > NEAR_THE_SIDE]
    return [
        apart[:, 0].min() if len(apart) else numpy.nan,
        at_side[:, 1].max() if len(at_side) else numpy.nan,
        -at_side[:, 1].min() if len(at_side) else numpy.nan,
    ]


def statistics(arguments):
    """Print the statistics of the refined and the uniform fine grid over shifted lattices."""
    print("                        more than 2 mm off axis from x, mm   upper branch at the side, mm   lower, mm   time, s")
    for ratio in arguments.m:
        both = {
            f"fine, m = {ratio}": uniform(arguments.dx / 2, ratio),
            f"refined, m = {ratio}": refined(arguments.dx, ratio),
        }
        samples = []
        for name, text in both.items():
            rows, total = [], 0.0
            for number in range(arguments.shifts):
                out, seconds = run(arguments, f"{name} {number}", shifted(text, arguments.dx, number))
                rows.append(figures(lines(out)))
                total += seconds
            rows = 1e3 * numpy.array(rows)
            samples.append(rows)
            mean, deviation = numpy.nanmean(rows, axis=0), numpy.nanstd(rows, axis=0, ddof=1)
            cells = [f"{a:8.2f} ± {b:5.2f} ({n})" for a, b, n in zip(mean, deviation, (~numpy.isnan(rows)).sum(axis=0))]
            print(f"{name:20} {cells[0]:>32} {cells[1]:>28} {cells[2]:>20} {total / arguments.shifts:8.2f}", flush=True)
        mean = [numpy.nanmean(rows, axis=0) for rows in samples]
        error = sum(numpy.nanvar(rows, axis=0, ddof=1) / (~numpy.isnan(rows)).sum(axis=0) for rows in samples)
        print("    Welch's t: " + ", ".join(f"{t:.2f}" for t in (mean[1] - mean[0]) / error**0.5), flush=True)


def main():
    parser = common.parser(__file__, __doc__)
    parser.add_argument("--dx", type=float, default=value(DECK.read_text(), "dx"), help="spacing of the coarse grid, m [as in the deck]")
    parser.add_argument("--m", type=int, nargs="+", default=[3, 4, 5, 6], help="horizons, in fine spacings [3 4 5 6]")
    parser.add_argument("--energy", type=float, help="refine where the energy density exceeds this fraction of its maximum [as in the deck]")
    parser.add_argument("--every", type=int, help="time steps between two checks of the refinement [as in the deck]")
    parser.add_argument("--twice", action="store_true", help="also run a grid with two levels of refinement, and a uniform grid of its finest spacing")
    parser.add_argument("--repeat", type=int, default=1, help="runs of each case; the shortest run time is printed [1]")
    parser.add_argument("--shifts", type=int, help="compare refined and uniform fine grids over this number of shifted lattices")
    arguments = common.start(parser)
    if arguments.shifts:
        statistics(arguments)
        return
    found, taken = {}, {}
    print("                                                                                              apart, all / through, coarse spacings")
    print("grid                   points at start, end    time, s   fracture, mJ   length, mm   branches   from fine    from same places")
    for name, text, references in cases(arguments):
        out, seconds = run(arguments, name, text)
        with fissure.open(out) as result:
            history = result.history
            counts = [len(result.points_at(k)) for k in (0, -1)]
        energy = 1e3 * numpy.array(history["fracture_energy"])[-1]
        length = 1e3 * numpy.array(history["crack_notch_length"])[-1]
        branches = lines(out)
        found[name] = branches
        pairs = [(branches, found[other]) for other in references]
        gaps = [[apart(*pair), apart(*map(through, pair))] for pair in pairs]
        gap = "".join(f"{every / arguments.dx:8.2f} /{main / arguments.dx:6.2f}" for every, main in gaps)
        taken[name] = counts[-1], seconds
        print(
            f"{name:20} {counts[0]:8} {counts[-1]:8} {seconds:15.2f} {energy:14.2f} {length:12.1f} {len(branches):10} {gap}",
            flush=True,
        )
        if references and "refined" in name:
            points, time_of_fine = taken[references[0]]
            print(f"    {100 * counts[-1] / points:.0f} % of the points of `{references[0]}`, {100 * seconds / time_of_fine:.0f} % of its time")
        picture = arguments.output / f"{re.sub(r'[^0-9a-z]+', '_', name)}.png"
        plot = [arguments.binary, "plot", out / "result.vtkhdf", "--field", "damage", "--output", picture]
        subprocess.run([str(part) for part in [*plot, "--path", out / "crack_notch.csv"]], check=True)


if __name__ == "__main__":
    main()
