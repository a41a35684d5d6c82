"""What the studies share: arguments, the packages and the program that they need, decks, runs and histories.

`--help` and wrong arguments need nothing but Python. With right arguments, `start` installs what is missing, builds
the program and starts the study again with the packages.
"""

import argparse
import csv
import importlib
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Pictures are files.
os.environ.setdefault("MPLBACKEND", "Agg")

# Set for the second start of a study, in which its packages are there.
STARTED = "FISSURE_STUDY_STARTED"

# The working directory stays that of the user.
PREPARE = """\
set -euo pipefail
root=$1 target=$2
shift 2
cd "$root"
. scripts/environment
scripts/setup
. scripts/python
if [[ -n $target ]]; then
    # shellcheck disable=SC2086
    cargo build --release --quiet $target
fi
cd "$OLDPWD"
exec "$FISSURE_PYTHON" "$@"
"""


class Package:
    """A package that is imported when it is first used, so that --help works without it."""

    def __init__(self, name):
        self._name = name

    def __getattr__(self, attribute):
        return getattr(importlib.import_module(self._name), attribute)


fissure = Package("fissure")
numpy = Package("numpy")
pyplot = Package("matplotlib.pyplot")


def parser(path, description, epilog=None, output=None):
    """The parser of the study with this `run.py`, with the arguments --binary and --output.

    `output` describes another default of the latter, for which it is None.
    """
    name = pathlib.Path(path).resolve().parent.name
    found = argparse.ArgumentParser(
        prog=f"studies/{name}/run.py",
        description=description,
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    default = None if output else ROOT / "out" / name
    found.add_argument("--output", type=pathlib.Path, default=default, metavar="DIR", help=f"[{output or f'out/{name}'}]")
    found.add_argument("--binary", type=pathlib.Path, metavar="PATH", help="the program [$FISSURE, or built from here]")
    return found


def start(found, target="--bin fissure", check=None):
    """Parse the arguments; on the first start, prepare everything and start again.

    `target` is what cargo builds; `check` returns what is wrong with the arguments, if anything.
    """
    options = found.parse_args()
    if check is not None and (wrong := check(options)):
        found.error(wrong)
    binary = options.binary or os.environ.get("FISSURE")
    if os.environ.pop(STARTED, None) is None:
        os.environ[STARTED] = "1"
        target = "" if binary and target.startswith("--bin") else target
        script = [sys.argv[0], *sys.argv[1:]]
        os.execvp("bash", ["bash", "-c", PREPARE, "bash", str(ROOT), target, *script])
    options.binary = pathlib.Path(binary or ROOT / "target/release/fissure").resolve()
    return options


def several_of(known):
    """The type of an argument that is a list of names, separated by commas."""

    def parse(text):
        names = text.split(",")
        if wrong := [name for name in names if name not in known]:
            raise argparse.ArgumentTypeError(f"`{wrong[0]}` is none of {', '.join(known)}")
        return names

    return parse


def replace_once(text, old, new, deck):
    """A text with another part, which it must have once; `deck` is named if it does not."""
    if text.count(old) != 1:
        sys.exit(f"error: {deck} has {text.count(old)} times `{old.strip()}`, and should have it once")
    return text.replace(old, new)


def run(options, folder, text, assignments=()):
    """Write a deck into a folder and run it there, with `--set` for each assignment."""
    folder.mkdir(parents=True, exist_ok=True)
    written = folder / "deck.toml"
    written.write_text(text)
    command = [options.binary, "run", written, "--quiet", "--overwrite", "--output", folder]
    for assignment in assignments:
        command += ["--set", assignment]
    if options.threads:
        command += ["--threads", options.threads]
    done = subprocess.run([str(word) for word in command])
    if done.returncode != 0:
        sys.exit(done.returncode)


def history(folder):
    """The columns of a history as arrays, by name."""
    table = fissure.read_history(folder)
    return {name: numpy.array(table[name]) for name in table}


def branches(path):
    """The branches of the crack in a `crack_NAME.csv` as arrays of positions (m), longest first."""
    with open(path, newline="") as file:
        head, *rows = csv.reader(file)
    if head[0] != "branch":
        sys.exit(f"error: {path} has no branches; only cracks of plane problems have them")
    rows = [[float(cell) for cell in row] for row in rows]
    numbers = sorted({row[0] for row in rows})
    return [numpy.array([row[1:3] for row in rows if row[0] == number]) for number in numbers]
