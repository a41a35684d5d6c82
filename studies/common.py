"""Functions of all studies: arguments, preparation of packages and program, decks, runs and histories.

Printing `--help` or an error about the arguments needs only Python. With valid arguments, `start` installs missing
packages, builds the program, and starts the study again in an environment with these packages.
"""

import argparse
import csv
import importlib
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent

# Draw into files, without windows.
os.environ.setdefault("MPLBACKEND", "Agg")

# Environment variable that is set for the second start of a study. The environment then has the packages.
STARTED = "FISSURE_STUDY_STARTED"

# Bash script that installs the packages, builds the program and starts the study again, in the working directory of the
# user.
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
    """Return the parser of the study whose `run.py` is at `path`, with the arguments --binary and --output.

    If `output` is given, --output defaults to None and its help text names `output` as the default.
    """
    name = pathlib.Path(path).resolve().parent.name
    found = argparse.ArgumentParser(
        prog=f"studies/{name}/run.py",
        description=description,
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    default = None if output else ROOT / "out" / name
    found.add_argument("--output", type=pathlib.Path, default=default, metavar="DIR", help=f"output folder [{output or f'out/{name}'}]")
    found.add_argument("--binary", type=pathlib.Path, metavar="PATH", help="program fissure [$FISSURE; if not set, it is built]")
    return found


def start(found, target="--bin fissure", check=None):
    """Parse the arguments; on the first start, install packages, build the program and start the study again.

    `target` are the arguments of `cargo build`. `check` returns an error message about the arguments, or None.
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
    """Return the argparse type of a list of names from `known`, separated by commas."""

    def parse(text):
        names = text.split(",")
        if wrong := [name for name in names if name not in known]:
            raise argparse.ArgumentTypeError(f"`{wrong[0]}` is none of {', '.join(known)}")
        return names

    return parse


def replace_once(text, old, new, deck):
    """Replace `old` in a text. If the text does not have `old` exactly once, exit with an error that names `deck`."""
    if text.count(old) != 1:
        sys.exit(f"error: {deck} has {text.count(old)} times `{old.strip()}`, and should have it once")
    return text.replace(old, new)


def run(options, folder, text, assignments=()):
    """Write the text of a deck into a folder and run the deck, with the result in the folder and `--set` for each assignment.

    If the run fails, exit with the exit code of the run.
    """
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
    """Return the columns of a history as arrays, by name."""
    table = fissure.read_history(folder)
    return {name: numpy.array(table[name]) for name in table}


def branches(path):
    """Return the branches of the crack in a `crack_NAME.csv` as arrays of positions (m), longest first."""
    with open(path, newline="") as file:
        head, *rows = csv.reader(file)
    if head[0] != "branch":
        sys.exit(f"error: {path} has no branches; only cracks of plane problems have them")
    rows = [[float(cell) for cell in row] for row in rows]
    numbers = sorted({row[0] for row in rows})
    return [numpy.array([row[1:3] for row in rows if row[0] == number]) for number in numbers]
