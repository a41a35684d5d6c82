"""Model of the time per step on many ranks, and of the resource limits that are reached first.

The points of a rank are assumed to fill a cube. The rank exchanges a layer of points, one horizon thick, with
neighbouring ranks. The bonds of interior points are computed while the messages are under way, so the time per step is

    border bonds + packing + max(interior bonds, messages · latency + bytes / bandwidth)

plus the time of the reductions for the history, per step.

To check the assumption of cubes: METIS partitions of 64³ points have 1.04 times the ghosts of cubes on 8 ranks, and
1.00 times on 27 ranks.
"""

import math

INPUTS = {
    # name: (default, unit, meaning)
    "points": (1e6, "", "points of each rank (weak scaling)"),
    "total": (1e9, "", "points of all ranks together (strong scaling)"),
    "cores": (8, "", "cores of each rank"),
    "rate": (None, "/s", "bond updates of one core; the measured rate if not given"),
    "neighbours": (122, "", "neighbours of each point"),
    "layers": (3, "", "horizon over spacing, rounded down"),
    "passes": (1, "", "passes over the bonds in a step"),
    "values": (3, "", "numbers sent in a step for each point of the exchanged layer"),
    "latency": (2e-6, "s", "latency of one message"),
    "bandwidth": (3e9, "B/s", "network bandwidth for one rank"),
    "memory_bandwidth": (2e10, "B/s", "memory bandwidth for one rank; packing and unpacking each read and write every value"),
    "imbalance": (1.05, "", "points of the largest rank, divided by the mean"),
    "history": (100, "", "steps between two rows of the history"),
    "memory": (4e9, "B", "available memory of each rank"),
    "patience": (60, "s", "acceptable time of the set-up"),
}
RANKS = [10**3, 10**4, 10**5]

# Bytes of the reduction per history row: some 30 exact sums of 69 words.
HISTORY_BYTES = 30 * 69 * 8
# Time of METIS per cell, s: 216 000 cells in 0.24 s on one core.
METIS_SECONDS = 0.24 / 216_000
# Bytes per cell on every rank: occupation twice (the sum needs a copy), owner three times.
CELL_BYTES = 2 * 8 + 3 * 4
# Bytes per cell on rank 0: for each of 26 edges the index of the neighbour, the weight as an integer and the weight as
# a float; and METIS's copies.
GRAPH_BYTES = 26 * (4 + 4 + 8) + 26 * 2 * 8
# Largest number of cells: the graph may have 2³¹ edges, and each cell has 26 edges.
GRAPH_CELLS = 2**31 / 26


def step(given, points):
    """Return for a rank with this number of points: the parts of the time per step (s), and the messages and bytes per step."""
    edge = points ** (1 / 3)
    layers = given["layers"]
    ghosts = (edge + 2 * layers) ** 3 - points
    interior = max(0.0, edge - 2 * layers) ** 3 / points
    # Number of ranks with points in the layer of ghosts. If the cubes of the ranks are thinner than the layer, the
    # layer contains several cubes in each direction.
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
    """Return a row for each number of ranks; `points_of` returns the number of points of one rank."""
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
    """Return the limits for these numbers of ranks and of points: (name, amount, limit) with the amount in the unit of
    the limit, the largest ratio of amount to limit first."""
    # Number of cells as in src/partition/cells.rs. The edges of a cell are at least as long as the horizon.
    cells = min(points / given["layers"] ** 3, max(1e5, 2000 * ranks), max(4e6, 64 * ranks))
    own = points / ranks
    found = [
        ("points and owner of every cell, on each rank: memory, B", CELL_BYTES * cells, given["memory"]),
        ("METIS on rank 0: memory of the graph, B", GRAPH_BYTES * cells, given["memory"]),
        ("METIS on rank 0: time, s", METIS_SECONDS * cells, given["patience"]),
        ("METIS on rank 0: cells, limited by edges numbered with 32 bits", cells, GRAPH_CELLS),
        ("sum of the points of every cell over all ranks: time, s", 2 * 8 * cells / given["bandwidth"], given["patience"]),
        ("lists with an entry per rank in all-to-all exchanges: memory, B", 4 * 24 * ranks, given["memory"]),
        ("message sizes in each all-to-all exchange: time, s", ranks * given["latency"], 0.01 * given["patience"]),
        ("points of a rank, limited by local indices of 32 bits", own, 2**31),
        ("points of all ranks, limited by global ids of 64 bits", points, 2**63),
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
        lines.append("     ranks  points/rank  messages    sent/step  bonds     halo      not hidden    efficiency")
        for row in rows:
            halo = row["packing"] + row["wire"]
            lines.append(
                f"  {row['ranks']:>8}  {row['points']:>11.0f}  {row['messages']:>8.0f}  {row['bytes'] / 1e6:>8.3f} MB"
                f"  {1e3 * row['bonds']:>7.3f} ms {1e3 * halo:>7.3f} ms  {1e3 * row['exposed']:>9.3f} ms"
                f"  {100 * row['efficiency']:>7.0f} %"
            )
    for ranks in RANKS:
        points = ranks * given["points"]
        lines.append(f"limits that are reached first on {ranks} ranks with {points:.3g} points")
        for what, amount, limit in limits(given, ranks, points):
            share = amount / limit
            if share > 0.02:
                verdict = "BREAKS" if share > 1 else "holds"
                lines.append(f"  {what:<50}{amount:>10.3g} of {limit:<10.3g}{verdict}")
    return lines, predicted
