"""Read results of the peridynamics solver Fissure and start its runs.

    import fissure

    result = fissure.open("out/plate")
    damage = result.field("damage")              # at the last output, by point
    speed = result.field("velocity", time=25e-6) # at the output nearest to a time (s)
    energy = result.history["fracture_energy"]

    result = fissure.run("plate.toml", ranks=2, threads=4, tension=20e6)
    result = fissure.run("plate.toml", overlays=["slow.toml"], output="out/slow")
"""

from .history import History, read_history
from .launch import RunError, run
from .result import Result, open

__all__ = ["History", "Result", "RunError", "open", "read_history", "run"]
