"""Results of runs."""

import difflib
import pathlib
import tomllib

import h5py
import numpy

from .history import table_of

_STEPS = "VTKHDF/Steps"
_DATA = "VTKHDF/PointData"


def open(path, output=None):
    """Open a result, given by the path of result.vtkhdf or of its folder. Close the result with `close()`, or use `with`.

    `output` selects the further result of [output.NAME] in the folder, which has no history.
    """
    if output is None:
        return Result(path)
    path = pathlib.Path(path)
    folder = path if path.is_dir() else path.parent
    file = folder / f"result_{output}.vtkhdf"
    if not file.exists():
        names = sorted(found.stem.removeprefix("result_") for found in folder.glob("result_*.vtkhdf"))
        hint = f"; there are {', '.join(names)}" if names else ""
        raise FileNotFoundError(f"{file}: there is no result of the output {output!r}{hint}")
    return Result(file)


class Result:
    """A result of a run, open for reading.

    `times` (s) and `steps` have one entry per output. An output is selected by its index `output`, which may be negative, or
    by a `time` (s), which selects the nearest output; the default is the last output. A time must not be more than half an
    output interval before the first or after the last output. Rows of fields and points are in the order of `ids`.
    """

    def __init__(self, path):
        path = pathlib.Path(path)
        self.path = path / "result.vtkhdf" if path.is_dir() else path
        if not self.path.exists():
            raise FileNotFoundError(f"{path}: there is no result")
        self._file = h5py.File(self.path, "r")
        if _STEPS not in self._file or "NSteps" not in self._file[_STEPS].attrs:
            self._file.close()
            raise ValueError(f"{self.path}: this file is not a result of Fissure")
        table = self._file[_STEPS]
        # A run that was stopped has allocated rows for further outputs.
        count = min(int(table.attrs["NSteps"]), len(table["Values"]), len(table["Step"]))
        self.times = table["Values"][:count]
        self.steps = table["Step"][:count]
        self._counts = self._file["VTKHDF/NumberOfPoints"][:]

    def close(self):
        self._file.close()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def __len__(self):
        """Number of outputs."""
        return len(self.times)

    def __repr__(self):
        return f"<fissure.Result {self.path}: {len(self)} outputs>"

    @property
    def attributes(self):
        """Information about the run, as texts by name: version, command_line, ranks, threads, mpi, time_step, …"""
        return dict(self._file.attrs)

    @property
    def title(self):
        return self._file.attrs["title"]

    @property
    def deck(self):
        """The deck with all defaults, as nested dictionaries."""
        return tomllib.loads(self._file.attrs["deck_in_full"])

    @property
    def deck_text(self):
        """The text of the deck."""
        return self._file.attrs["deck"]

    @property
    def fields(self):
        """Units of the fields, by name."""
        return {name: dataset.attrs["unit"] for name, dataset in self._file[_DATA].items()}

    @property
    def points(self):
        """Reference positions at the last output, m: one row per point with x, y, z."""
        return self.points_at()

    def points_at(self, output=None, *, time=None):
        """Reference positions of the points at an output, m. The points change only with [refinement.trigger]."""
        output = self._output(output, time)
        return self._file["VTKHDF/Points"][self._rows("PointOffsets", output)]

    @property
    def ids(self):
        """Ids of the points at the last output."""
        return self.field("id")

    @property
    def sets(self):
        """Masks of points at the last output, by name: `all`, the bodies, and the sets with `ids` in the deck."""
        deck, block, ids = self.deck, self.field("block"), self.ids
        masks = {"all": numpy.ones(len(ids), dtype=bool)}
        masks |= {name: block == number for number, name in enumerate(deck["body"])}
        masks |= {name: numpy.isin(ids, table["ids"]) for name, table in deck.get("set", {}).items() if "ids" in table}
        return masks

    def field(self, name, output=None, *, time=None):
        """Values of a field at an output: one row per point; vectors and tensors have one column per component."""
        output = self._output(output, time)
        return self._dataset(name)[self._rows(f"PointDataOffsets/{name}", output)]

    def __getitem__(self, name):
        """Values of a field at all outputs: [output, point, component]; [output, point] for a scalar.

        The points must be the same at all outputs.
        """
        dataset = self._dataset(name)
        if len(self._counts) > 1:
            raise ValueError(f"{self.path}: each output has its own points; read them one by one with field()")
        points = int(self._counts[0])
        if dataset.maxshape[0] is not None:
            return numpy.broadcast_to(dataset[:], (len(self), *dataset.shape))
        return dataset[: len(self) * points].reshape(len(self), points, *dataset.shape[1:])

    @property
    def history(self):
        """The history: a pandas.DataFrame, or a dictionary of arrays by name if pandas is not installed."""
        if "history" not in self._file:
            return table_of([], [], numpy.empty((0, 0)))
        table = self._file["history"]
        names, units = (table.attrs[key].split(",") for key in ("columns", "units"))
        return table_of(names, units, table[:])

    def _dataset(self, name):
        data = self._file[_DATA]
        if name not in data:
            near = difflib.get_close_matches(name, data, 1)
            hint = f"; did you mean `{near[0]}`?" if near else ""
            raise KeyError(f"{self.path}: no field `{name}`{hint} (there are {', '.join(data)})")
        return data[name]

    def _output(self, output, time):
        count = len(self)
        if count == 0:
            raise IndexError(f"{self.path}: there is no output yet")
        if time is not None:
            if output is not None:
                raise TypeError("give one of output and time")
            nearest = int(numpy.abs(self.times - time).argmin())
            neighbour = min(max(nearest, 1), count - 1)
            reach = 0.5 * (self.times[neighbour] - self.times[neighbour - 1]) if count > 1 else 0.0
            if not self.times[0] - reach <= time <= self.times[-1] + reach:
                first, last = self.times[0], self.times[-1]
                raise IndexError(f"{self.path}: no output at {time} s; they are between {first:g} and {last:g} s")
            return nearest
        output = -1 if output is None else output
        if not -count <= output < count:
            raise IndexError(f"{self.path}: no output {output}; there are {count}")
        return output % count

    def _rows(self, offsets, output):
        first = int(self._file[_STEPS][offsets][output])
        return slice(first, first + int(self._counts[min(output, len(self._counts) - 1)]))
