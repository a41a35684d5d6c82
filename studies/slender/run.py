#!/usr/bin/env python3
"""Compares laws and surface corrections in slender bodies: stiffness, separation energy and stable step.

The horizon is 3.015 spacings, and Poisson's ratio is 1/4 (`pmb` in plane stress: 1/3). The problems are:
- square bars under tension, bending and torsion, with displacements of their ends from beam theory. The stiffness per
  length follows from the strain energies of bars of two lengths, which eliminates the ends;
- a dog bone in plane stress with a gauge section six points wide. Young's modulus follows from the reaction and from
  the mean displacements of two cross-sections;
- square bars whose halves are moved apart until all bonds between them are broken. The separation energy is the energy
  of these bonds at their damage criterion.

Stiffnesses are divided by those of beam theory, Young's modulus by that of the material, separation energies by the
fracture energy times the cross-section, and stable steps by that of the same law with the correction "none".

Writes slender.md (a table) and slender.json into the output folder.
"""

import json
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import common  # noqa: E402  (the folder above has it)
from common import history, run  # noqa: E402

LAWS = {
    "`pmb`, `\"none\"`": "pmb = { surface_correction = 'none', ",
    "`pmb`, `\"energy\"`": "pmb = { surface_correction = 'energy', ",
    "`pmb`, `\"directional\"`": "pmb = { surface_correction = 'directional', ",
    "`pmb`, `\"tensor\"`": "pmb = { surface_correction = 'tensor', ",
    "`ordinary`, `\"none\"`": "ordinary = { surface_correction = 'none', ",
    "`ordinary`, `\"directional\"`": "ordinary = { surface_correction = 'directional', ",
    "`ordinary`, `\"pals\"`": "ordinary = { surface_correction = 'pals', ",
    "`correspondence`": "correspondence = { ",
}
THICKNESSES = [4, 6, 10]
YOUNG, DENSITY, TOUGHNESS = 1e9, 1000, 100
# Displacements of the ends for a strain, curvature or twist k, and the stiffness for a section of this edge.
LOADS = {
    "tension": ("['k*x', '-k*0.25*y', '-k*0.25*z']", lambda edge: YOUNG * edge**2),
    "bending": ("['-k*x*y', 'k*(x^2 + 0.25*(y^2 - z^2))/2', 'k*0.25*y*z']", lambda edge: YOUNG * edge**4 / 12),
    "torsion": ("['free', '-k*x*z', 'k*x*y']", lambda edge: 0.140577 * YOUNG / 2.5 * edge**4),
}

BAR = """\
dimension = "3d"
[parameters]
k = {curvature}
[grid]
spacing = 1
horizon = 3.015
origin = [-{half_length}, -{half}, -{half}]
[material]
solid.{law} density = {density}, youngs_modulus = {young}, poisson_ratio = 0.25 }}
[body.bar]
material = "solid"
shape.box = {{ lower = [-{half_length}, -{half}, -{half}], upper = [{half_length}, {half}, {half}] }}
"""

EQUILIBRIUM = """\
[time]
end = 1
method = "static"
static = { load_steps = 1, tolerance = 1e-6 }
[history]
every_steps = 1
"""

ENDS = """\
[set.ends]
where = "abs(x) > {half_length} - 4"
[condition.ends]
set = "ends"
displacement = {displacement}
"""

# The final opening is large enough to break the last bond. Each step adds a small part of this opening, so bonds break
# near their thresholds.
SEPARATION = """\
[damage.brittle]
{criterion}
[condition.apart]
set = "all"
displacement = ["sign(x)*t/2", 0, 0]
[time]
end = {opening}
step = {step}
[history]
every_steps = 100
"""

DOG_BONE = """\
dimension = "plane-stress"
[grid]
spacing = 1
horizon = 3.015
origin = [-35, -10]
[material]
solid.{law} density = {density}, youngs_modulus = {young}, poisson_ratio = {ratio} }}
[body.bone]
material = "solid"
shape.polygon.vertices = [[-35, -9], [-25, -9], [-19, -3], [19, -3], [25, -9], [35, -9], [35, 9], [25, 9], [19, 3], [-19, 3], [-25, 9], [-35, 9]]
[set.left]
where = "x < -29"
[set.right]
where = "x > 29"
[condition.left]
set = "left"
displacement = [0, 0]
[condition.right]
set = "right"
displacement = ["1e-3*t", 0]
[history.force.pull]
set = "right"
direction = [1, 0]
[set.row_1]
where = "abs(x + 10.5) < 0.1"
[set.row_2]
where = "abs(x - 10.5) < 0.1"
[history.field.row_1]
field = "displacement"
component = "x"
set = "row_1"
of = ["mean"]
[history.field.row_2]
field = "displacement"
component = "x"
set = "row_2"
of = ["mean"]
"""


def last(options, folder, text):
    """Run a deck; return the last row of its history."""
    run(options, folder, text)
    return {name: column[-1] for name, column in history(folder).items()}


def bar(law, across, length, curvature=0.0):
    """Return the tables of the deck of a square bar."""
    return BAR.format(law=law, half=across / 2, half_length=length / 2, curvature=curvature, density=DENSITY, young=YOUNG)


def stiffness(options, law, across, load):
    """Return the stiffness of a bar divided by that of beam theory."""
    displacement, beam = LOADS[load]
    curvature = 1e-4 / across
    lengths = [3 * across + 8, 5 * across + 8]
    energies = []
    for length in lengths:
        text = bar(law, across, length, curvature) + ENDS.format(half_length=length / 2, displacement=displacement)
        energies.append(last(options, options.output / "run", text + EQUILIBRIUM)["strain_energy"])
    return (energies[1] - energies[0]) / (lengths[1] - lengths[0]) / (0.5 * beam(across) * curvature**2)


def separation(options, law, across):
    """Return the energy of the broken bonds of a bar whose halves were moved apart, divided by G₀ times the section."""
    rule = "energy" if law.startswith("correspondence") else "critical_stretch"
    text = bar(law, across, 14) + SEPARATION.format(criterion=f"{rule} = {{ fracture_energy = {TOUGHNESS}, alpha = 0 }}", opening=6e-3, step=1.5e-6)
    text = text.replace('material = "solid"', 'material = "solid"\ndamage = "brittle"')
    row = last(options, options.output / "run", text)
    return (row["fracture_energy"] - row["overshoot_energy"]) / (TOUGHNESS * across**2)


def modulus(options, law):
    """Return Young's modulus of a dog bone divided by that of its material."""
    ratio = 0.25 if law.startswith(("ordinary", "correspondence")) else 1 / 3
    text = DOG_BONE.format(law=law, density=DENSITY, young=YOUNG, ratio=ratio) + EQUILIBRIUM
    row = last(options, options.output / "run", text)
    strain = (row["field_row_2_mean"] - row["field_row_1_mean"]) / 21
    return row["force_pull"] / 6 / strain / YOUNG


def stable_step(options, law, across):
    """Return the stable step of a bar, s."""
    deck = options.output / "run/deck.toml"
    deck.write_text(bar(law, across, 3 * across + 8) + "[time]\nend = 1\n")
    printed = subprocess.run([options.binary, "check", "--json", deck], check=True, capture_output=True, text=True)
    return json.loads(printed.stdout)["stable_step"]


def table(found):
    """Return the results as a Markdown table with a row for each law and correction."""
    cases = list(next(iter(found.values())))
    lines = ["| law | " + " | ".join(cases) + " |", "|" + "---|" * (len(cases) + 1)]
    for name, values in found.items():
        lines.append(f"| {name} | " + " | ".join(f"{values[case]:.2f}" for case in cases) + " |")
    return "\n".join(lines) + "\n"


def main():
    options = common.start(parser())
    (options.output / "run").mkdir(parents=True, exist_ok=True)
    found, uncorrected = {}, {}
    for name, law in LAWS.items():
        values = found[name] = {}
        for load in LOADS:
            for across in THICKNESSES:
                values[f"{load}, {across}"] = stiffness(options, law, across, load)
        values["dog bone, 6"] = modulus(options, law)
        for across in THICKNESSES:
            values[f"separation, {across}"] = separation(options, law, across)
        for across in THICKNESSES:
            step = stable_step(options, law, across)
            # The first row of a law has no correction.
            values[f"stable step, {across}"] = step / uncorrected.setdefault((law.split()[0], across), step)
        print(name, flush=True)
    written = table(found)
    print(written, end="")
    (options.output / "slender.md").write_text(written)
    (options.output / "slender.json").write_text(json.dumps(found, indent=1) + "\n")


def parser():
    found = common.parser(__file__, __doc__)
    found.add_argument("--threads", type=int, metavar="N", help="threads of each run [number of cores]")
    return found


if __name__ == "__main__":
    main()
