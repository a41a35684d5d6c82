"""Model of the time per step and of the limits on many ranks, with given inputs.

A rank has the points of a cube and exchanges a layer of one horizon with its neighbours. The time per
step, with the interior overlapping the messages, is

    border bonds + packing + max(interior bonds, messages · latency + bytes / bandwidth)

For comparison: METIS partitions of 64³ points on 8 and 27 ranks have 1.04 and 1.00 times the ghosts of cubes.
"""

import math

INPUTS = {
    # name: (default, unit, meaning)
    "points": (1e6, "", "points of a rank (weak scaling)"),
    "total": (1e9, "", "points in all (strong scaling)"),
    "cores": (8, "", "cores of a rank"),
    "rate": (None, "/s", "bond updates of a core; the measured ones if not given"),
    "neighbours": (122, "", "neighbours of a point"),
    "layers": (3, "", "horizon over spacing, rounded down"),
    "passes": (1, "", "passes over the bonds in a step"),
    "values": (3, "", "numbers sent for a point in a step"),
    "latency": (2e-6, "s", "of one message"),
    "bandwidth": (3e9, "B/s", "of the network for one rank"),
    "memory_bandwidth": (2e10, "B/s", "of the memory for one rank; packing goes through it twice"),
    "imbalance": (1.05, "", "points of the largest rank over the mean"),
    "history": (100, "", "steps between rows of the history"),
    "memory": (4e9, "B", "of a rank"),
    "patience": (60, "s", "for the set-up"),
}
RANKS = [10**3, 10**4, 10**5]

# Bytes of the reduction per history row: some 30 exact sums of 69 words.
HISTORY_BYTES = 30 * 69 * 8
# Time of METIS per cell, s: 216 000 cells in 0.24 s on one core.
METIS_SECONDS = 0.24 / 216_000
# Bytes per cell on every rank: occupation twice (the sum needs a copy), owner three times.
CELL_BYTES = 2 * 8 + 3 * 4
# Bytes per cell on rank 0: 26 edges of index, weight and its real value, and METIS's copies.
GRAPH_BYTES = 26 * (4 + 4 + 8) + 26 * 2 * 8
# Limit of 2³¹ edges of the graph, 26 per cell.
GRAPH_CELLS = 2**31 / 26


def step(given, points):
    """Return the parts of the time per step (s), the messages and the bytes of a rank with this number of points."""
    edge = points ** (1 / 3)
    layers = given["layers"]
    ghosts = (edge + 2 * layers) ** 3 - points
    interior = max(0.0, edge - 2 * layers) ** 3 / points
    # Number of ranks within the layer of ghosts; the layer contains several cubes if they are thinner than the layer.
    messages = (2 * math.ceil(layers / edge) + 1) ** 3 - 1
    bonds = given["imbalance"] * points * given["neighbours"] / (given["rate"] * given["cores"])
    size = 8 * given["values"] * ghosts
    wire = given["passes"] * messages * given["latency"] + size / given["bandwidth"]
    packing = 4 * size / given["memory_bandwidth"]
    hidden = min(wire, interior * bonds)
    return {
        "points": points,
        "ghosts": ghosts,
        "messages": given["passes"] * messages,
        "bytes": size,
        "bonds": bonds,
        "packing": packing,
        "wire": wire,
        "exposed": packing + wire - hidden,
    }


def predict(given, points_of):
    """Return a row for each number of ranks; `points_of` returns the points of one rank."""
    rows = []
    for ranks in RANKS:
        row = {"ranks": ranks, **step(given, points_of(ranks))}
        row["history"] = math.log2(ranks) * (given["latency"] + HISTORY_BYTES / given["bandwidth"])
        row["history"] /= given["history"]
        row["step"] = row["bonds"] + row["exposed"] + row["history"]
        row["efficiency"] = row["bonds"] / given["imbalance"] / row["step"]
        rows.append(row)
    return rows


def limits(given, ranks, points):
    """Return the limits for a number of ranks and points: (name, amount, limit) in the same unit, worst
    first."""
    # As in src/partition/cells.rs: at most one cell per horizon in each direction.
    cells = min(points / given["layers"] ** 3, max(1e5, 2000 * ranks), max(4e6, 64 * ranks))
    own = points / ranks
    found = [
        ("cells on every rank: points and owner of each, B", CELL_BYTES * cells, given["memory"]),
        ("METIS on rank 0: memory of the graph, B", GRAPH_BYTES * cells, given["memory"]),
        ("METIS on rank 0: time, s", METIS_SECONDS * cells, given["patience"]),
        ("METIS on rank 0: cells that 32-bit edges allow", cells, GRAPH_CELLS),
        ("adding up the points of cells: time, s", 2 * 8 * cells / given["bandwidth"], given["patience"]),
        ("lists by rank in swaps between all, B", 4 * 24 * ranks, given["memory"]),
        ("telling all ranks sizes, in each swap: time, s", ranks * given["latency"], 0.01 * given["patience"]),
        ("local index of 32 bits: points of a rank", own, 2**31),
        ("global ids of 64 bits", points, 2**63),
    ]
    return sorted(found, key=lambda row: row[1] / row[2], reverse=True)


def report(given):
    """Format the model as lines of text."""
    lines = ["model of many ranks, with"]
    for name, (_, unit, meaning) in INPUTS.items():
        lines.append(f"  {name:<17}{given[name]:>12.4g} {unit:<4}{meaning}")
    kinds = {
        f"weak, {given['points']:.3g} points a rank": lambda ranks: given["points"],
        f"strong, {given['total']:.3g} points": lambda ranks: given["total"] / ranks,
    }
    predicted = {}
    for (title, points_of), kind in zip(kinds.items(), ("weak", "strong")):
        rows = predict(given, points_of)
        predicted[kind] = rows
        lines.append(title)
        lines.append("     ranks  points/rank  messages    sent/step  bonds     halo      of that seen  efficiency")
        for row in rows:
            halo = row["packing"] + row["wire"]
            lines.append(
                f"  {row['ranks']:>8}  {row['points']:>11.0f}  {row['messages']:>8.0f}  {row['bytes'] / 1e6:>8.3f} MB"
                f"  {1e3 * row['bonds']:>7.3f} ms {1e3 * halo:>7.3f} ms  {1e3 * row['exposed']:>9.3f} ms"
                f"  {100 * row['efficiency']:>7.0f} %"
            )
    for ranks in RANKS:
        points = ranks * given["points"]
        lines.append(f"what breaks first on {ranks} ranks, {points:.3g} points")
        for what, amount, limit in limits(given, ranks, points):
            share = amount / limit
            if share > 0.02:
                verdict = "BREAKS" if share > 1 else "holds"
                lines.append(f"  {what:<50}{amount:>10.3g} of {limit:<10.3g}{verdict}")
    return lines, predicted
