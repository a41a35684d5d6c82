#!/usr/bin/env python3
"""Plots the separation energy of a body against the direction of separation, for several laws and damage criteria.

Builds and runs examples/parting.rs, which separates the two halves of a small block. Prints the separation energies as
fractions of the fracture energy, at increasing angles between the direction of separation and the normal of the crack:
0° is opening, 90° is sliding. Writes a picture of these energies into the output folder.
"""

import csv
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import common  # noqa: E402  (the folder above has it)
from common import ROOT, pyplot  # noqa: E402

PANELS = [("ordinary", "0.1"), ("ordinary", "0.4"), ("correspondence", "0.3"), ("bond_associated_correspondence", "0.3")]
STYLES = {"stretch": "C0o--", "work of pulled bonds": "C1s:", "work": "C2D-"}
LABELS = {
    "stretch": "critical stretch",
    "work of pulled bonds": "energy, tension only",
    "work": "energy, compressed bonds too",
}


def table(program):
    """Yield the rows of the table: law, Poisson's ratio, criterion, and pairs of angle (degrees) and separation energy ratio."""
    printed = subprocess.run([program], check=True, capture_output=True, text=True).stdout
    head, *rows = csv.reader(printed.splitlines())
    angles = [float(angle) for angle in head[3:]]
    for law, ratio, criterion, *costs in rows:
        yield law, ratio, criterion, [(a, float(c)) for a, c in zip(angles, costs) if c]


def main():
    arguments = common.start(common.parser(__file__, __doc__), "--example parting")
    arguments.output.mkdir(parents=True, exist_ok=True)
    figure, axes = pyplot.subplots(2, 2, figsize=(9, 6.5), sharex=True, sharey=True, constrained_layout=True)
    panels = dict(zip(PANELS, axes.flat))
    for law, ratio, criterion, costs in table(ROOT / "target/release/examples/parting"):
        shown = ", ".join(f"{cost:.3f}" for _, cost in costs)
        print(f"{law}, ν = {ratio}, {LABELS[criterion]}: {shown}")
        panels[law, ratio].plot(*zip(*costs), STYLES[criterion], label=LABELS[criterion])
    for (law, ratio), panel in panels.items():
        panel.axhline(1, color="0.7", zorder=0)
        panel.set_title(f"{law.replace('_', ' ')}, ν = {ratio}", fontsize=10)
        panel.set_ylim(0, 1.6)
        panel.set_xticks(range(0, 91, 15))
    figure.supxlabel("angle between separation and normal of the crack, degrees (90: sliding)", fontsize=10)
    for panel in axes[:, 0]:
        panel.set_ylabel("separation energy / fracture energy")
    axes[0, 0].legend(fontsize=8, loc="lower left")
    picture = arguments.output / "parting.png"
    figure.savefig(picture, dpi=110)
    print(picture)


if __name__ == "__main__":
    main()
