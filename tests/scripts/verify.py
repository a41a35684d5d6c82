"""Compares results with values printed by Peridigm, PeriLab and LAMMPS.

tests/decks/verification/values.toml lists the problems. For each problem it has the deck, the source of the values, the
tolerance of each field with a reason, and the values, each with field, component, time and position. Each deck runs
once, on one thread. If the other code defines a quantity differently, its value is multiplied by the `factor` of the
field, or of the field and component; the reason explains the factor. The error of a field is the largest difference
between Fissure and the listed values, divided by the largest absolute listed value.

In some problems, the other code computes fields by another formula than Fissure. Such a problem has `departs` with two
fractions for each of these fields, and the error must be between them. `formulas` names two functions of this script:
the results of the first must equal the values of the other code, and the results of the second must equal those of the
run of Fissure.

The tested program is $FISSURE, or `fissure` on the path.
"""

import argparse
import math
import os
import shutil
import sys
import tempfile
import time
import tomllib
from pathlib import Path

import fissure
import numpy

FOLDER = Path(__file__).resolve().parent.parent / "decks/verification"
# Column of each component.
VECTOR = {"x": 0, "y": 1, "z": 2}
SYMMETRIC = {"xx": 0, "yy": 1, "zz": 2, "xy": 3, "yz": 4, "xz": 5}
FULL = {row + column: 3 * i + j for i, row in enumerate("xyz") for j, column in enumerate("xyz")}
COLUMNS = {3: VECTOR, 6: SYMMETRIC, 9: FULL}


class Failure(Exception):
    """A problem whose values cannot be compared."""


def eight_points(deck, theta_of):
    """Compute displacement, velocity and force density of the eight points of a viscoelastic deck, by step.

    The law is the viscoelastic solid in the form of LAMMPS. `theta_of` returns the dilatations for the deviatoric
    extension at both ends of a bond, from the dilatations of points i and j.
    """
    h, delta = deck["grid"]["spacing"], deck["grid"]["horizon"]
    [law] = deck["material"]["solid"].values()
    bulk, shear, density = law["bulk_modulus"], law["shear_modulus"], law["density"]
    share, tau = law["relaxing_share"], law["relaxation_time"]
    step = deck["time"]["step"]
    reference = numpy.array([[h * (n & 1), h * (n >> 1 & 1), h * (n >> 2 & 1)] for n in range(8)])
    bonds = reference[None] - reference[:, None]
    length = numpy.linalg.norm(bonds, axis=2)
    others = ~numpy.eye(8, dtype=bool)
    omega = numpy.zeros((8, 8))
    omega[others] = delta / length[others]
    volume = h**3
    weighted = (omega * length**2 * volume).sum(axis=1)
    decay = math.exp(-step / tau)
    beta = 1 - tau / step * (1 - decay)
    # For each bond and end: the previous deviatoric extension, and its relaxed part.
    before, relaxed = numpy.zeros((2, 8, 8)), numpy.zeros((2, 8, 8))

    def force(u):
        nonlocal before, relaxed
        deformed = bonds + u[None] - u[:, None]
        distance = numpy.linalg.norm(deformed, axis=2)
        extension = distance - length
        theta = 3 / weighted * (omega * length * extension * volume).sum(axis=1)
        total = 3 * bulk * length * omega * (theta / weighted)[:, None]
        total = total + total.T
        ends = theta_of(theta[:, None] + 0 * length, theta[None] + 0 * length)
        deviatoric = numpy.array([extension - end * length / 3 for end in ends])
        relaxed = before * (1 - decay) + relaxed * decay + beta * (deviatoric - before)
        before = deviatoric
        for end, mass in zip(deviatoric - share * relaxed, (weighted[:, None], weighted[None])):
            total = total + 15 * shear * omega / mass * end
        along = numpy.zeros_like(deformed)
        along[others] = deformed[others] / distance[others][:, None]
        return (total[..., None] * along * volume).sum(axis=1)

    x, y, z = (reference - h / 2).T
    u, v = numpy.zeros((8, 3)), numpy.array([400 * x + 300 * y, -100 * y, 50 * z]).T
    f = force(u)
    states = [(u, v, f)]
    for _ in range(round(deck["time"]["end"] / step)):
        half = v + step / 2 * f / density
        u = u + step * half
        f = force(u)
        v = half + step / 2 * f / density
        states.append((u, v, f))
    return reference, states


def at_eight_points(deck, values, theta_of):
    """Return results of the eight points at the positions and times of values."""
    reference, states = eight_points(deck, theta_of)
    fields = ["displacement", "velocity", "force_density"]
    computed = []
    for field, component, at_time, x, y, z, _ in values:
        state = states[round(at_time / deck["time"]["step"])]
        point = int(numpy.linalg.norm(reference - [x, y, z], axis=1).argmin())
        computed.append(state[fields.index(field)][point, VECTOR[component]])
    return computed


def lammps_ves(deck, values):
    """LAMMPS's peri/ves: the force on point i uses the dilatation of i at both ends of the bond."""
    return at_eight_points(deck, values, lambda own, other: (own, own))


def viscoelastic(deck, values):
    """Mitchell's viscoelastic solid: each end of a bond uses the dilatation of its own family."""
    return at_eight_points(deck, values, lambda own, other: (own, other))


def peridigm_hypoelastic(deck, values):
    """Peridigm's correspondence law in a bar stretched by 0.001: E Σ ΔF/F, with F at the end of each step."""
    [law] = deck["material"]["bar"].values()
    step = 1e-3 * deck["time"]["step"] / deck["time"]["end"]
    counts = [round(value[2] / deck["time"]["step"]) for value in values]
    return [law["youngs_modulus"] * sum(step / (1 + step * k) for k in range(1, n + 1)) for n in counts]


def saint_venant(deck, values):
    """St. Venant–Kirchhoff solid in the bar of `peridigm_hypoelastic`: the Cauchy stress E F (F² − 1)/2."""
    [law] = deck["material"]["bar"].values()
    stretches = [1 + 1e-3 * value[2] / deck["time"]["end"] for value in values]
    return [law["youngs_modulus"] * stretch * (stretch**2 - 1) / 2 for stretch in stretches]


def thermal_pair(deck, values, mechanical_force):
    """Compute the displacement of a point with one bond of length 1, whose temperature is lowered and raised.

    `mechanical_force` returns the force divided by the stiffness, from displacement and free thermal expansion.
    """
    [law] = deck["material"]["steel"].values()
    stiffness, step = 18 * law["bulk_modulus"] / law["density"], deck["time"]["step"]
    displacements, u, v, a = [0.0], 0.0, 0.0, 0.0
    for number in range(1, round(deck["time"]["end"] / step) + 1):
        cooling = 5000 * (1 + math.cos(3.14159265359 + number * step * 3.14159265359 / 0.1))
        v += step / 2 * a
        u += step * v
        a = -stiffness * mechanical_force(u, -law["thermal_expansion"] * cooling)
        v += step / 2 * a
        displacements.append(u)
    # The other points are fixed.
    return [
        displacements[round(at_time / step)] if x > 1 and y > 1 else 0.0
        for _, _, at_time, x, y, _, _ in values
    ]


def additive_expansion(deck, values):
    """Peridigm: the extension |Y| − (1 + αΔT) |ξ|."""
    return thermal_pair(deck, values, lambda u, expansion: u - expansion)


def multiplied_expansion(deck, values):
    """Fissure: the extension |Y|/(1 + αΔT) − |ξ|, with the force as its energy's derivative."""
    return thermal_pair(deck, values, lambda u, expansion: (u - expansion) / (1 + expansion) ** 2)


def sheared_cube(deck, values, reference, power):
    """Compute the force densities of a cube of the position-aware linear solid in simple shear.

    `reference` returns ω₀ and σ₀ of a family, from its bond lengths and weighted volume. Of all functions ω and σ with
    the right dilatation and deviatoric energy, those are used for which Σ |ξ|^power (ω − ω₀)² V and
    Σ |ξ|^power (σ − σ₀)² V are smallest.
    """
    [law] = deck["material"]["aluminium"].values()
    bulk, shear = law["bulk_modulus"], law["shear_modulus"]
    h, horizon = deck["grid"]["spacing"], deck["grid"]["horizon"]
    volume = h**3
    centres = h * (numpy.arange(7) + 0.5)
    points = numpy.array([[x, y, z - 1] for x in centres for y in centres for z in centres])
    displacement = numpy.outer(-1e-6 * points[:, 1], [1, 0, 0])
    axes = numpy.eye(3)
    probes = [numpy.outer(a, a) for a in axes]
    probes += [(numpy.outer(a, b) + numpy.outer(b, a)) / 2 for a, b in ((axes[0], axes[1]), (axes[0], axes[2]), (axes[1], axes[2]))]
    traces = numpy.array([numpy.trace(probe) for probe in probes])
    deviators = [probe - numpy.trace(probe) / 3 * axes for probe in probes]
    energies = numpy.array([2 * shear * (deviator**2).sum() for deviator in deviators])

    def fit(function, conditions, wanted, weights):
        multipliers = numpy.linalg.solve((conditions / weights) @ conditions.T, wanted - conditions @ function)
        return function + multipliers @ conditions / weights

    forces = numpy.zeros_like(points)
    for point, (position, moved) in enumerate(zip(points, displacement)):
        distance = numpy.linalg.norm(points - position, axis=1)
        family = numpy.flatnonzero((distance > 0) & (distance <= horizon))
        bonds, length = points[family] - position, distance[family]
        extensions = numpy.array([((bonds @ probe) * bonds).sum(axis=1) / length for probe in probes])
        deviatoric = numpy.array([((bonds @ deviator) * bonds).sum(axis=1) / length for deviator in deviators])
        omega, sigma = reference(length, (length**2 * volume).sum(), shear)
        omega = fit(omega, extensions * length * volume, traces, length**power)
        sigma = fit(sigma, deviatoric**2 * volume, energies, length**power)
        deformed = bonds + displacement[family] - moved
        distance = numpy.linalg.norm(deformed, axis=1)
        extension = distance - length
        dilatation = (omega * length * extension).sum() * volume
        rest = extension - dilatation * length / 3
        pressure = bulk * dilatation - (sigma * length * rest).sum() * volume / 3
        state = (pressure * omega * length + sigma * rest)[:, None] * deformed / distance[:, None] * volume
        forces[point] += state.sum(axis=0)
        forces[family] -= state
    found = [int(numpy.linalg.norm(points - value[3:6], axis=1).argmin()) for value in values]
    return [forces[point, VECTOR[value[1]]] for point, value in zip(found, values)]


def peridigm_pals(deck, values):
    """Peridigm: the functions ω and σ are those nearest to 1 and 2G."""
    return sheared_cube(deck, values, lambda length, m, shear: (numpy.ones_like(length), numpy.full_like(length, 2 * shear)), 0)


def weighted_pals(deck, values):
    """Fissure: ω and σ are those nearest to 3/m and 15G/m, and the distance has the weight |ξ|²."""
    return sheared_cube(deck, values, lambda length, m, shear: (numpy.full_like(length, 3 / m), numpy.full_like(length, 15 * shear / m)), 2)


# The functions that `formulas` names. They return results at the positions and times of the given values.
FORMULAS = {
    "lammps_ves": lammps_ves,
    "viscoelastic": viscoelastic,
    "peridigm_hypoelastic": peridigm_hypoelastic,
    "saint_venant": saint_venant,
    "additive_expansion": additive_expansion,
    "multiplied_expansion": multiplied_expansion,
    "peridigm_pals": peridigm_pals,
    "weighted_pals": weighted_pals,
}


def column(result, field, component):
    """Return the values of a component of a field: [output, point]."""
    values = numpy.asarray(result[field])
    if component == "":
        return values
    if values.ndim != 3 or component not in COLUMNS[values.shape[2]]:
        raise Failure(f"{field} has no component {component}")
    return values[..., COLUMNS[values.shape[2]][component]]


def factor_of(problem, field, component):
    """Return the factor that converts the quantity of the other code to the field."""
    factors = problem.get("factor", {})
    return factors.get(f"{field}.{component}", factors.get(field, 1.0))


def compare(problem, result):
    """Return error and largest value of each field, and Fissure's result at the position of each value of a problem."""
    points = result.points
    pairs, all_ours, spacing = {}, [], None
    for field, component, at_time, x, y, z, value in problem["values"]:
        output = int(numpy.abs(result.times - at_time).argmin())
        if abs(result.times[output] - at_time) > 1e-6 * max(result.times[-1], abs(at_time)):
            raise Failure(f"no output at {at_time} s; the nearest is at {result.times[output]} s")
        distances = numpy.linalg.norm(points - [x, y, z], axis=1)
        point = int(distances.argmin())
        if spacing is None:
            spacing = max(numpy.ptp(points, axis=0)) / len(points)
        if distances[point] > 1e-3 * spacing:
            raise Failure(f"no point at ({x}, {y}, {z}); the nearest is {distances[point]} m away")
        ours = column(result, field, component)[output, point]
        all_ours.append(ours)
        pairs.setdefault(field, []).append((ours, value * factor_of(problem, field, component)))
    errors = {}
    for field, values in pairs.items():
        ours, theirs = numpy.array(values).T
        largest = numpy.abs(theirs).max()
        errors[field] = (numpy.abs(ours - theirs).max() / largest if largest > 0 else numpy.abs(ours).max(), largest)
    return errors, all_ours


def formula_error(problem, name, deck, values):
    """Return the error of values against a formula of this script, over the fields in `departs`."""
    rows = [(row, value) for row, value in zip(problem["values"], values) if row[0] in problem["departs"]]
    computed = FORMULAS[name](deck, [row for row, _ in rows])
    worst, largest = {}, {}
    for ((field, *_), value), expected in zip(rows, computed):
        worst[field] = max(worst.get(field, 0), abs(expected - value))
        largest[field] = max(largest.get(field, 0), abs(expected))
    return max(worst[field] / largest[field] for field in worst)


def verify(problem, folder):
    """Run the deck of a problem; return its lines of the table and its faults."""
    deck = FOLDER / problem["deck"]
    lines, faults = [], []
    with fissure.run(deck, output=folder / problem["name"], threads=1) as result:
        errors, ours = compare(problem, result)
        full = result.deck
    departs = problem.get("departs", {})
    for field, (error, largest) in errors.items():
        if field in departs:
            low, high = departs[field]
            held, allowed = low <= error <= high, f"{low:g} to {high:g}: theirs by another formula"
        else:
            held, allowed = error <= problem["tolerance"][field], f"{problem['tolerance'][field]:g}"
        lines.append((field, largest, error, allowed))
        if not held:
            faults.append(f"{field}: error {error:.3g}, allowed {allowed}")
    if departs:
        theirs = [value * factor_of(problem, *row[:2]) for *row, value in problem["values"]]
        allowed = problem["tolerance"]["formula"]
        for name, values in zip(problem["formulas"], (theirs, ours), strict=True):
            error = formula_error(problem, name, full, values)
            lines.append((name, 1.0, error, f"{allowed:g}"))
            if not error <= allowed:
                faults.append(f"formula {name}: error {error:.3g}, allowed {allowed:g}")
    return lines, faults


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="check these problems only")
    arguments = parser.parse_args()
    program = os.environ.get("FISSURE") or "fissure"
    if shutil.which(program) is None:
        sys.exit(f"error: there is no program {program}; build it, or name another one with FISSURE")
    with open(FOLDER / "values.toml", "rb") as file:
        problems = tomllib.load(file)["problem"]
    unknown = set(arguments.only or []) - {problem["name"] for problem in problems}
    if unknown:
        sys.exit(f"error: no problem {', '.join(sorted(unknown))} (known: {', '.join(p['name'] for p in problems)})")
    failed, values, begin = [], 0, time.monotonic()
    print(f"{'problem':32} {'field':22} {'largest':>13} {'error':>9}  allowed")
    with tempfile.TemporaryDirectory(prefix="verify.") as folder:
        for problem in problems:
            if arguments.only and problem["name"] not in arguments.only:
                continue
            try:
                lines, faults = verify(problem, Path(folder))
            except (Failure, fissure.RunError) as failure:
                lines, faults = [], [str(failure)]
            for field, largest, error, allowed in lines:
                print(f"{problem['name']:32} {field:22} {largest:13.6e} {error:9.1e}  {allowed}", flush=True)
            for fault in faults:
                print(f"error: {problem['name']}: {fault}", flush=True)
            if faults:
                failed.append(problem["name"])
            values += len(problem["values"])
    print(f"{values} values in {time.monotonic() - begin:.0f} s")
    sys.exit(f"error: {len(failed)} problems differ: {', '.join(failed)}" if failed else None)


if __name__ == "__main__":
    main()
