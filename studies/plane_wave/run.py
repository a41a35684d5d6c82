#!/usr/bin/env python3
"""The effect of a refined patch on a plane wave, compared with table 3 of Dipasquale et al. (2014).

Runs inputs/plane_wave_refined.toml without refinement, and with 1 to 3 levels for both rules of convergence (`delta`
and `delta-m`). Compares two quantities of the refined and the uniform grid: the energy densities when the crest of the
wave is in the patch, and the largest displacement of a node that only a reflected wave reaches.

Four interpretations of the paper are run:
1. Each level is two horizons wide, the energies of refined nodes are compared (caption of table 3), and each end of a
   bond uses the horizon of its own level.
2. Each level is one horizon wide, and the energies of all nodes in the patch are compared.
3. Same as 2, but bonds between levels use the mean of the two horizons.
4. Same as 2, but without the enlarged horizon at interfaces (figure 5b); only for the rule `delta`.
"""

import pathlib
import re
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import common  # noqa: E402  (the folder above has it)
from common import ROOT, fissure  # noqa: E402
from common import numpy as np  # noqa: E402

DECK = ROOT / "inputs" / "plane_wave_refined.toml"

# Table 3: largest loss of energy density, largest gain of energy density, and reflected displacement, in percent.
PAPER = {
    ("delta", 1): (9.83, 5.86, 0.24),
    ("delta", 2): (11.00, 5.23, 0.31),
    ("delta", 3): (11.63, 5.88, 0.35),
    ("delta-m", 1): (17.10, 4.38, 0.58),
    ("delta-m", 2): (18.96, 6.25, 0.87),
    ("delta-m", 3): (20.81, 7.27, 1.03),
}
# Largest loss of energy density in figure 5b, without the enlarged horizon, in percent.
PAPER_UNCORRECTED = 37.4

AMPLITUDE = 0.1  # of each half of the wave, m
CENTRE = (0.2005, 0.0405)
DX = 1e-3
SPEED = 1.125**0.5  # with blocked transverse motion, m/s


def without_section(text, name):
    """Return the deck without a section and its subtables."""
    pattern = rf"(?ms)^\[{name}[^\]]*\]\n.*?(?=^\[(?!{name})|\Z)"
    return re.sub(pattern, "", text)


def horizons(rule, level):
    return {"delta": 3.0 * 0.5**level, "delta-m": (3.0 + level) * 0.5**level}[rule]


def deck(rule, levels, margin, factor, bonds, seen, end):
    """Return the text of the deck with an output at the time `seen` and the end at `end`; 0 levels mean no refinement.

    The patch of each level has a radius of `margin` horizons of the next coarser level. `factor` is the value of the key
    `interface_factor` (None for its default), and `bonds` the value of the key `bonds`.
    """
    text = DECK.read_text()
    text = re.sub(r"(?m)^end = 0\.17 .*$", f"end = {end}", text)
    text = re.sub(r'(?m)^every = "end".*$', f"every = {seen}", text)
    text = without_section(text, "refinement")
    if levels == 0:
        return text
    lines = [f'[refinement]\nlevels = {levels}\nrule = "{rule}"']
    if factor is not None:
        lines.append(f"interface_factor = {factor}")
    lines.append(f'bonds = "{bonds}"')
    for level in range(1, levels + 1):
        radius = margin * horizons(rule, level - 1) + 1e-4
        lines.append(
            f"[refinement.region.level_{level}]\n"
            f'where = "(x - centre_x)^2 + (y - centre_y)^2 <= ({radius}*dx)^2"\nlevel = {level}'
        )
    return text + "\n" + "\n".join(lines) + "\n"


def run(arguments, name, text):
    """Run a deck and return its result."""
    folder = arguments.output / name
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "deck.toml"
    path.write_text(text)
    return fissure.run(path, output=folder / "out", overwrite=True, binary=arguments.binary)


class Energy:
    """Positions, total energy densities (J/m³) and time of the second output of a result."""

    def __init__(self, result):
        self.places = result.points[:, :2]
        kinetic = 0.5 * (result.field("velocity", 1) ** 2).sum(axis=1)
        self.density = result.field("strain_energy_density", 1) + kinetic
        # A run without refinement has no field `level`.
        self.is_refined = "level" in result.fields and result.field("level", 1) > 0
        self.time = result.times[1]

    def profile(self):
        """Return x and energy density along the row of nodes through the centre of the patch."""
        row = np.abs(self.places[:, 1] - CENTRE[1]) < 1e-3 * DX
        order = np.argsort(self.places[row, 0])
        return self.places[row, 0][order], self.density[row][order]


def columns(result, *names):
    """Return the named columns of the history of a result."""
    history = result.history
    return [np.array(history[name]) for name in names]


def main():
    arguments = common.start(common.parser(__file__, __doc__))

    # The energy is largest at the largest velocity, beside the centre of the displacement pulse.
    crest = CENTRE[0] - 0.03 / 2**0.5
    seen = crest / SPEED
    after = (2 * CENTRE[0] - 0.1) / SPEED
    plain = run(arguments, "uniform", deck("delta", 0, 1, None, "own", seen, after))
    uniform = Energy(plain)
    at, density = uniform.profile()
    before, times = columns(plain, "probe_reflected_displacement_x", "time")

    print("rule     level  horizons  nodes    factor   bonds       loss % (paper)     gain % (paper)   reflected % (paper)")
    each = [(rule, level) for rule in ("delta", "delta-m") for level in (1, 2, 3)]
    cases = [(rule, level, 2, "refined", None, "own") for rule, level in each]
    cases += [(rule, level, 1, "all", None, bonds) for bonds in ("own", "average") for rule, level in each]
    cases += [("delta", level, 1, "all", 1.0, "own") for level in (1, 2, 3)]
    for rule, level, margin, nodes, factor, bonds in cases:
        name = f"{rule}_{level}_{margin}_{factor}_{bonds}"
        result = run(arguments, name, deck(rule, level, margin, factor, bonds, seen, after))
        energy = Energy(result)
        # The output times of this run and of the uniform run differ slightly, because the time steps differ.
        shift = SPEED * (energy.time - uniform.time)
        wanted = np.interp(energy.places[:, 0] - shift, at, density)
        near = np.abs(energy.places - np.array(CENTRE)).max(axis=1) < 5 * DX
        counted = energy.is_refined if nodes == "refined" else near
        change = 100 * (energy.density[counted] / wanted[counted] - 1)
        found = np.interp(times, *columns(result, "time", "probe_reflected_displacement_x"))
        late = times > (CENTRE[0] - 0.1) / SPEED + 0.09
        reflected = 100 * np.abs(found - before)[late].max() / AMPLITUDE
        loss, gain, coming_back = PAPER[rule, level]
        if factor is not None:
            loss, gain, coming_back = (PAPER_UNCORRECTED if rule == "delta" and level == 3 else "-", "-", "-")
        factor = "default" if factor is None else f"{factor:.3f}"
        print(
            f"{rule:8} {level:5}  {margin:8}  {nodes:7}  {factor:7}  {bonds:8} {-change.min():8.2f} ({loss:>5})"
            f"   {change.max():8.2f} ({gain:>5})   {reflected:8.2f} ({coming_back:>5})",
            flush=True,
        )


if __name__ == "__main__":
    main()
