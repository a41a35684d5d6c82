#!/usr/bin/env python3
"""Edge-on impact on ALON in the three limits of Diehl & Schweitzer (2016), figures 8 to 10.

Runs `inputs/eoi_alon.toml` with several laws, prints a table of the speeds of the wave front and of the damage
front, and draws these speeds beside the measured speeds. The table also contains the computed speeds of a long wave
on the same lattice: in the bulk, and in a tile of the same thickness with free faces.
"""

import json
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import common  # noqa: E402  (the folder above has it)
from common import ROOT, numpy, pyplot, replace_once  # noqa: E402

EXAMPLES = """\
examples:
  studies/eoi/run.py --small             spacings down to 1.25 mm; 2 to 3 minutes on two cores
  studies/eoi/run.py                     spacings down to 0.5 mm, the finest of the paper; half an hour on two cores
  studies/eoi/run.py --limits local --laws pmb,energy

limits:
  local      the horizon is three spacings, and the spacing decreases
  continuum  the horizon is 7.5 mm, and the spacing decreases
  discrete   the spacing is fixed, and the horizon decreases to two spacings

laws:
  pmb        the prototype law
  energy     the normalised law, form `energy`
  diehl2016  the normalised law, form `diehl2016`
The other laws are run only in the limit `local`, with spacings of 1 mm and more:
  pmb-exact  the prototype law with the exact volumes of the paper
  ordinary   the ordinary law; the conclusion of the paper proposes it
  printed    the normalised law as the paper prints it: the constant of eq. 15 in the force of eq. 4; its bonds are too
             soft by a factor of the bond length in metres

The speed of a front is the slope of its position over time, by least squares. For the wave front, the positions
between 30 and 90 mm are used; for the damage front, those between 20 and 50 mm. The table has `none` if the front
covers less than 15 mm in this range, or jumps by more than 10 mm between two rows of the history, as scattered damage
does. The mean speed is the position of the wave front at the end divided by the duration of the run.

Writes eoi_alon.md (the table), eoi_alon.png and eoi_alon.json into the output folder.
"""

DECK = ROOT / "inputs/eoi_alon.toml"

BULK_MODULUS = 210e9  # Pa
DENSITY = 3690.0  # kg/m³
THICKNESS = 0.01  # m
DURATION = 8.7e-6  # s
MEASURED = {"wave": 9367.0, "damage": 8381.0}  # m/s
THEORY = (1.8 * BULK_MODULUS / DENSITY) ** 0.5
# E/(1 − ν²) = 1.6 K for ν = 1/4.
PLATE = (1.6 * BULK_MODULUS / DENSITY) ** 0.5

LAWS = ["pmb", "energy", "diehl2016", "pmb-exact", "ordinary", "printed"]
# Laws that are run only in the limit `local`, with spacings of 1 mm and more.
ADDED = ("pmb-exact", "ordinary", "printed")
LIMITS = {
    "local": "horizon 3 dx, dx to 0",
    "continuum": "horizon fixed at 7.5 mm, dx to 0",
    "discrete": "dx fixed, horizon to 2 dx",
}
FIXED_HORIZON = 7.5e-3  # m


def arguments():
    parser = common.parser(__file__, __doc__, EXAMPLES)
    add = parser.add_argument
    add("--small", action="store_true", help="run the coarse lattices only")
    add("--laws", type=common.several_of(LAWS), default=LAWS, metavar="LIST", help="laws, separated by commas [all]")
    add("--limits", type=common.several_of(LIMITS), default=list(LIMITS), metavar="LIST", help="limits, separated by commas [all]")
    add("--reuse", action="store_true", help="do not repeat runs whose history is complete in the output folder")
    add("--threads", type=int, metavar="N", help="threads of each run [all cores]")
    return common.start(parser)


def grids(limit, small):
    """Return the pairs (spacing in m, horizon in spacings) of a limit, in the order in which they are run."""
    if limit == "local":
        return [(dx, 3.0) for dx in ([2.5e-3, 2e-3, 1.25e-3] if small else [2.5e-3, 2e-3, 1.25e-3, 1e-3, 0.5e-3])]
    if limit == "continuum":
        return [(dx, FIXED_HORIZON / dx) for dx in ([2.5e-3, 2e-3] if small else [2.5e-3, 2e-3, 1.25e-3, 1e-3])]
    return [(1.25e-3 if small else 1e-3, ratio) for ratio in (4.0, 3.0, 8**0.5, 2.0)]


def deck(law, dx):
    """Return the text of the deck with this law; `dx` is the spacing, m."""
    text = DECK.read_text()

    def replace(old, new):
        nonlocal text
        text = replace_once(text, old, new, DECK)

    table = "[material.alon.pmb]"
    if law in ("energy", "diehl2016"):
        replace(table, f'[material.alon.normalised_pmb]\nform = "{law}"')
    elif law == "pmb-exact":
        replace('volume_correction = "none" ', 'volume_correction = "exact"')
    elif law == "ordinary":
        replace(table, "[material.alon.ordinary]\npoisson_ratio = 0.25")
    elif law == "printed":
        # The constant c = 9K/(4πδ³/3) of eq. 15 equals the prototype's constant 18K'/(πδ⁴) for a bulk modulus
        # K' = 3Kδ/8, with δ in metres. Eq. 17 with this c and the tile's thickness gives the critical stretch. The
        # automatic step of this soft material would be too long.
        replace("bulk_modulus = 210e9", 'bulk_modulus = "210e9*0.375*m*dx"')
        stretch = "sqrt(15)/4*2e6/(210e9*sqrt(27/(4*pi)*thickness))"
        replace("fracture_toughness = 2e6", f'critical_stretch = "{stretch}"')
        replace('end = "duration"', f'end = "duration"\nstep = {1e-4 * dx!r}')
    return text


def offsets(ratio):
    """Return the offsets of the neighbours and their lengths, on a lattice of unit spacing with this ratio of horizon to spacing."""
    reach = range(-int(ratio) - 1, int(ratio) + 2)
    every = numpy.array([(x, y, z) for x in reach for y in reach for z in reach], dtype=float)
    length = numpy.linalg.norm(every, axis=1)
    inside = (length > 0) & (length <= ratio * (1 + 1e-9))
    return every[inside], length[inside]


def long_waves(law, dx, ratio):
    """Return the speeds (m/s) of long waves along a lattice axis: in the bulk, and in the tile, whose layers may move
    freely in the direction of the thickness. Both are None for `pmb-exact`, whose volume correction is not implemented
    here."""
    if law == "pmb-exact":
        return None, None
    steps, lengths = offsets(ratio)
    steps, lengths, horizon = steps * dx, lengths * dx, ratio * dx
    volume = dx**3
    if law == "ordinary":
        return long_waves_of_ordinary(steps, lengths, dx)
    layers = round(THICKNESS / dx)
    level = numpy.round(steps[:, 2] / dx).astype(int)

    # The energy density of a bond is (g/2) s²|ξ|. The constant g of point i follows from the family of i, which
    # depends on the layer of i.
    def modulus(inside):
        if law == "pmb":
            return numpy.full(len(lengths), 18 * BULK_MODULUS / (numpy.pi * horizon**4))
        if law == "energy":
            return numpy.full(len(lengths), 18 * BULK_MODULUS / (lengths[inside].sum() * volume))
        if law == "printed":
            return numpy.full(len(lengths), 9 * BULK_MODULUS / (4 / 3 * numpy.pi * horizon**3))
        return 9 * BULK_MODULUS / (inside.sum() * volume) / lengths

    whole = modulus(numpy.full(len(lengths), True))
    bulk = (whole * steps[:, 0] ** 4 / lengths**3).sum() * volume / 2

    own = [modulus((0 <= level + layer) & (level + layer < layers)) for layer in range(layers)]
    matrix, load, energy = numpy.zeros((layers, layers)), numpy.zeros(layers), 0.0
    for layer in range(layers):
        for k, (step, length) in enumerate(zip(steps, lengths)):
            other = layer + level[k]
            if not 0 <= other < layers:
                continue
            weight = (own[layer][k] + own[other][k]) / 2 * volume / (2 * length**3)
            # At unit strain along x, s = (ξx² + ξz (w_j − w_i))/|ξ|², where w_i and w_j are the displacements of the
            # layers of i and j along z.
            axial, across = step[0] ** 2, step[2]
            energy += weight * axial**2
            for index, sign in ((other, 1), (layer, -1)):
                load[index] += sign * weight * axial * across
                matrix[index, other] += sign * weight * across**2
                matrix[index, layer] -= sign * weight * across**2
    shift = numpy.linalg.lstsq(matrix, -load, rcond=None)[0]
    plate = (energy + load @ shift) / layers
    return (bulk / DENSITY) ** 0.5, (plate / DENSITY) ** 0.5


def long_waves_of_ordinary(steps, lengths, dx):
    """Return the speeds of `long_waves` for the ordinary law with ω = 1 and ν = 1/4.

    The energy density of this law is W = K θ²/2 + 15 G/(2 m) Σ e_d² V, with the weighted volume m and the deviatoric
    extensions e_d.
    """
    volume, shear = dx**3, 0.6 * BULK_MODULUS
    layers = round(THICKNESS / dx)
    level = numpy.round(steps[:, 2] / dx).astype(int)

    def energy(layer_of, count):
        """Return the mean energy density of points of the layers `layer_of` at unit strain along x.

        The result is the matrix of a quadratic form of (1, displacements of the `count` layers along z). With `count`
        0, the point is in the bulk.
        """
        total = numpy.zeros((count + 1, count + 1))
        for layer in layer_of:
            inside = (0 <= level + layer) & (level + layer < count) if count else numpy.full(len(level), True)
            x, n = lengths[inside], steps[inside]
            weighted = (x**2).sum() * volume
            extension = numpy.zeros((len(x), count + 1))
            extension[:, 0] = n[:, 0] ** 2 / x
            if count:
                rows = numpy.arange(len(x))
                numpy.add.at(extension, (rows, 1 + layer + level[inside]), n[:, 2] / x)
                extension[:, 1 + layer] -= n[:, 2] / x
            dilatation = 3 / weighted * volume * (x @ extension)
            deviatoric = extension - numpy.outer(x, dilatation) / 3
            total += BULK_MODULUS / 2 * numpy.outer(dilatation, dilatation)
            total += 15 * shear / (2 * weighted) * volume * deviatoric.T @ deviatoric
        return total / len(layer_of)

    bulk = energy([0], 0)[0, 0]
    form = energy(range(layers), layers)
    shift = numpy.linalg.lstsq(form[1:, 1:], -form[1:, 0], rcond=None)[0]
    plate = form[0, 0] + form[0, 1:] @ shift
    return (2 * bulk / DENSITY) ** 0.5, (2 * plate / DENSITY) ** 0.5


def slope(times, places, start, end):
    """Return the speed (m/s) of a front between two positions (m); None if the front covers too little distance or jumps."""
    chosen = (places >= start) & (places <= end)
    if chosen.sum() < 3 or numpy.ptp(places[chosen]) < 0.015:
        return None
    leaps = numpy.diff(places)[chosen[:-1] | chosen[1:]]
    if leaps.max() > 0.01:
        return None
    return float(numpy.polyfit(times[chosen], places[chosen], 1)[0])


def run(options, limit, law, dx, ratio):
    """Run the deck; return the columns of its history."""
    folder = options.output / f"{limit}-{law}-{dx * 1e3:g}-{ratio:.3g}"
    if options.reuse and (folder / "history.csv").exists():
        earlier = common.history(folder)
        if len(earlier["time"]) and earlier["time"][-1] > 0.999 * DURATION:
            return earlier
    common.run(options, folder, deck(law, dx), [f"dx={dx!r}", f"m={ratio!r}", "outputs=1"])
    # Remove the fields and the checkpoints, which are not needed.
    for name in ("result.vtkhdf", "result.xdmf", "checkpoint_0.h5", "checkpoint_1.h5"):
        (folder / name).unlink(missing_ok=True)
    return common.history(folder)


def evaluate(history, limit, law, dx, ratio):
    """Return the row of the table for a run."""
    bulk, plate = long_waves(law, dx, ratio)
    result = {"limit": limit, "law": law, "dx": dx, "ratio": ratio, "bulk": bulk, "plate": plate}
    for front, window in (("wave", (0.03, 0.09)), ("damage", (0.02, 0.05))):
        places = history[f"front_{front}"]
        result[front] = slope(history["time"], places, *window)
        reached = float(places[-1])
        result[f"{front}_reached"] = None if numpy.isnan(reached) else reached
    result["mean_wave"] = None if result["wave_reached"] is None else result["wave_reached"] / DURATION
    return result


def table(results):
    def number(value, factor=1.0):
        return "none" if value is None else f"{factor * value:.0f}"

    heads = ["limit", "law", "dx, mm", "δ/dx", "wave, m/s", "mean speed of the wave, m/s", "damage, m/s"]
    heads += ["wave at the end, mm"]
    heads += ["damage at the end, mm", "long wave in the bulk, m/s", "long wave in the tile, m/s"]
    rows = [heads, ["---"] * len(heads)]
    for result in results:
        rows.append([result["limit"], f"`{result['law']}`", f"{result['dx'] * 1e3:g}", f"{result['ratio']:.3g}"])
        rows[-1] += [number(result[name]) for name in ("wave", "mean_wave", "damage")]
        rows[-1] += [number(result[name], 1e3) for name in ("wave_reached", "damage_reached")]
        rows[-1] += [number(result[name]) for name in ("bulk", "plate")]
    rows.append(["measured", "", "", "", number(MEASURED["wave"]), "", number(MEASURED["damage"]), "", "", "", ""])
    rows.append(["classical", "", "", "", "", "", "", "", "", number(THEORY), number(PLATE)])
    return "".join("| " + " | ".join(row) + " |\n" for row in rows)


def draw(results, path):
    limits = [limit for limit in LIMITS if any(result["limit"] == limit for result in results)]
    figure, axes = pyplot.subplots(
        1, len(limits), figsize=(4.2 * len(limits) + 0.6, 4.2), sharey=True, squeeze=False, layout="constrained"
    )
    colours = dict(zip(LAWS, ("#1b6ca8", "#d1495b", "#66a182", "#5fa8d3", "#c98c1b", "#8d6a9f")))
    names = {
        "pmb": "prototype",
        "energy": "normalised, `energy`",
        "diehl2016": "normalised, `diehl2016`",
        "pmb-exact": "prototype, exact volumes",
        "ordinary": "ordinary",
        "printed": "normalised, c of eq. 15 in eq. 4",
    }
    for axis, limit in zip(axes[0], limits):
        for speed, style in ((MEASURED["wave"], "--"), (MEASURED["damage"], ":")):
            axis.axhline(speed, color="black", linestyle=style, linewidth=1)
        axis.axhline(THEORY, color="0.6", linewidth=1)
        axis.axhline(PLATE, color="0.6", linewidth=1, linestyle="-.")
        for law in LAWS:
            chosen = [result for result in results if (result["limit"], result["law"]) == (limit, law)]
            if not chosen:
                continue
            place = [result["ratio"] if limit == "discrete" else result["dx"] * 1e3 for result in chosen]
            for kind, marker, fill in (("wave", "o", "full"), ("damage", "^", "none")):
                # A front that has not started is drawn at speed 0.
                speeds = [result[kind] or 0.0 for result in chosen]
                label = f"{names[law]}: {kind}" if axis is axes[0][0] else None
                axis.plot(place, speeds, marker=marker, fillstyle=fill, color=colours[law], linewidth=0.8, label=label)
        axis.set_title(LIMITS[limit], fontsize=10)
        axis.set_xlabel("horizon / dx" if limit == "discrete" else "dx, mm")
        axis.set_ylim(-300, 12500)
    axes[0][0].set_ylabel("speed, m/s (0: no front)")
    lines = [
        pyplot.Line2D([], [], color="black", linestyle="--", linewidth=1, label="wave, measured"),
        pyplot.Line2D([], [], color="black", linestyle=":", linewidth=1, label="damage, measured"),
        pyplot.Line2D([], [], color="0.6", linewidth=1, label="√(1.8K/ρ), bulk"),
        pyplot.Line2D([], [], color="0.6", linestyle="-.", linewidth=1, label="√(1.6K/ρ), thin plate"),
    ]
    handles = axes[0][0].get_legend_handles_labels()[0]
    figure.legend(handles=handles + lines, loc="outside lower center", ncols=len(limits) + 1, fontsize=8, frameon=False)
    figure.savefig(path, dpi=110)


def main():
    options = arguments()
    options.output.mkdir(parents=True, exist_ok=True)
    results = []
    for limit in options.limits:
        for dx, ratio in grids(limit, options.small):
            for law in options.laws:
                if law in ADDED and (limit != "local" or dx < 1e-3):
                    continue
                history = run(options, limit, law, dx, ratio)
                result = evaluate(history, limit, law, dx, ratio)
                results.append(result)
                wave, damage = (result[kind] or 0.0 for kind in ("wave", "damage"))
                print(
                    f"{limit:10} {law:10} dx {dx * 1e3:.3g} mm, horizon {ratio:.3g} dx: "
                    f"wave {wave:.0f} m/s, damage {damage:.0f} m/s",
                    flush=True,
                )
    (options.output / "eoi_alon.json").write_text(json.dumps(results, indent=1) + "\n")
    (options.output / "eoi_alon.md").write_text(table(results))
    draw(results, options.output / "eoi_alon.png")
    print(f"\n{table(results)}\ntable and picture are in {options.output}")


if __name__ == "__main__":
    main()
