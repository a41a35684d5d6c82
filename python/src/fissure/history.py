"""Tables of a history."""

import csv
import os
import pathlib

import numpy

try:
    import pandas
except ImportError:
    pandas = None


class History(dict):
    """Columns of a history as arrays, by name. This class replaces pandas.DataFrame if pandas is not installed."""


def read_history(path):
    """Read history.csv from its path or its folder. Return a pandas.DataFrame, or a History if pandas is not installed.

    An incomplete last row of a killed run is skipped. The units of the returned table are in `table.attrs["units"]`.
    """
    path = pathlib.Path(path)
    if path.is_dir():
        path = path / "history.csv"
    with path.open(newline="") as file:
        text = file.read()
    lines = text[: text.rfind("\n") + 1].splitlines()
    if not lines:
        raise ValueError(f"{os.fspath(path)}: there is no header")
    header, *rows = csv.reader(lines)
    names = [cell.split("[")[0].strip() for cell in header]
    units = [cell.partition("[")[2].rstrip("] ") for cell in header]
    values = numpy.array(rows, dtype=float).reshape(len(rows), len(names))
    return table_of(names, units, values)


def table_of(names, units, values):
    """Return a table of the columns of a matrix, with their names and units."""
    by_name = dict(zip(names, units))
    if pandas is not None:
        table = pandas.DataFrame(values, columns=names)
        table.attrs["units"] = by_name
        return table
    table = History(zip(names, values.T))
    table.attrs = {"units": by_name}
    return table
