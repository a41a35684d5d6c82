"""Runs of decks."""

import os
import pathlib
import shlex
import subprocess

from . import result


class RunError(RuntimeError):
    """Error of a run that failed or was stopped, with its exit code `code` and its printed text `output`."""

    def __init__(self, code, output):
        super().__init__(output.strip() or f"fissure ended with exit code {code}")
        self.code = code
        self.output = output


def run(
    deck,
    *,
    output=None,
    ranks=1,
    threads=None,
    overwrite=False,
    restart=False,
    overlays=(),
    keys=None,
    launcher=None,
    binary=None,
    **parameters,
):
    """Run a deck and open its result.

    deck        path of the deck
    output      folder of the result [out/ and the deck's name]
    ranks       number of MPI ranks; more than one are started by `launcher`
    threads     threads of each rank [the cores of the rank]
    overwrite   replace an existing result
    restart     restart from the newest checkpoint
    overlays    paths of decks whose keys override the deck; later overlays override earlier ones
    keys        other values of keys, such as {"time.safety": 0.4}
    launcher    command that starts the ranks [mpirun -n RANKS --bind-to none]
    binary      the program [$FISSURE, or fissure on the path]
    parameters  other values of the deck's parameters: numbers or expressions

    Raises ValueError if both `overwrite` and `restart` are true.
    Raises RunError if the run fails or is stopped; its `code` is 75 if the run can be restarted with `restart=True`.
    """
    if overwrite and restart:
        raise ValueError("`overwrite` and `restart` exclude each other: a restart continues the existing result")
    deck = pathlib.Path(deck)
    folder = pathlib.Path(output) if output is not None else pathlib.Path("out") / deck.stem
    command = [os.fspath(binary or os.environ.get("FISSURE") or "fissure"), "run", os.fspath(deck), "--quiet"]
    command += ["--output", os.fspath(folder)]
    if threads is not None:
        command += ["--threads", str(threads)]
    if restart:
        command.append("--restart")
    if overwrite:
        command.append("--overwrite")
    for overlay in [overlays] if isinstance(overlays, (str, os.PathLike)) else overlays:
        command += ["--with", os.fspath(overlay)]
    for name, value in {**(keys or {}), **parameters}.items():
        command += ["--set", f"{name}={_toml(value)}"]
    if launcher is None and ranks > 1:
        launcher = f"mpirun -n {ranks} --bind-to none"
    if launcher is not None:
        command = [*(shlex.split(launcher) if isinstance(launcher, str) else launcher), *command]
    done = subprocess.run(
        command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
    )
    if done.returncode != 0:
        raise RunError(done.returncode, done.stdout)
    return result.open(folder)


def _toml(value):
    """Format a value as the text of a deck or of --set."""
    if hasattr(value, "tolist"):
        value = value.tolist()  # numpy values
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return value
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(_entry(entry) for entry in value)}]"
    if isinstance(value, int):
        return str(value)
    return repr(float(value))


def _entry(value):
    return f'"{value}"' if isinstance(value, str) else _toml(value)
