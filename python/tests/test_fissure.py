"""Tests of the package with the program $FISSURE.

Tables are tested with pandas, if installed, and without pandas.
"""

import contextlib
import os
import pathlib
import shutil
import sys
import tempfile
import unittest
from unittest import mock

import fissure
import numpy
from fissure import history

PLATE = """\
title = "A small plate"
dimension = "plane-stress"
thickness = 1e-3

[parameters]
dx = 1e-3
speed = 1.0

[grid]
spacing = "dx"
horizon = "3*dx"

[material.glass.pmb]
density = 2440
youngs_modulus = 72e9

[body.plate]
shape.box = { lower = [0, 0], upper = [20e-3, 10e-3] }
material = "glass"

[set.left]
where = "x < 3*dx"

[set.corner]
ids = [0, 1]

[condition.pull]
set = "left"
velocity = ["-speed", 0]

[time]
end = 4e-6

[output]
every = 1e-6
fields = ["displacement", "damage", "stress"]

[history]
every_steps = 2
reactions = ["left"]
"""

REFINED = """
[refinement]
levels = 1

[refinement.trigger]
where = "x < 1e9*(t - 1e-6)"
every_steps = 2
"""


@contextlib.contextmanager
def without_pandas():
    with mock.patch.object(history, "pandas", None):
        yield


class Results(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.deck = cls.folder / "plate.toml"
        cls.deck.write_text(PLATE)
        cls.result = fissure.run(cls.deck, output=cls.folder / "out", threads=1)

    @classmethod
    def tearDownClass(cls):
        cls.result.close()
        shutil.rmtree(cls.folder)

    def test_outputs_have_times_points_and_fields(self):
        result = self.result
        self.assertEqual(len(result), 5)
        numpy.testing.assert_allclose(result.times, numpy.arange(5) * 1e-6, atol=0.2e-6)
        self.assertEqual(result.steps[0], 0)
        self.assertEqual(result.points.shape, (200, 3))
        numpy.testing.assert_allclose(result.points[0], [0.5e-3, 0.5e-3, 0], atol=1e-12)
        numpy.testing.assert_array_equal(result.ids, numpy.arange(200))
        self.assertEqual(result.fields["stress"], "Pa")
        self.assertEqual(result.field("stress").shape, (200, 6))
        self.assertEqual(result["displacement"].shape, (5, 200, 3))
        self.assertEqual(result["volume"].shape, (5, 200))
        for k in range(5):
            numpy.testing.assert_array_equal(result["displacement"][k], result.field("displacement", k))
        numpy.testing.assert_array_equal(result.field("displacement"), result.field("displacement", -1))
        numpy.testing.assert_array_equal(result.field("displacement", time=2.1e-6), result.field("displacement", 2))
        self.assertAlmostEqual(result.field("displacement")[0, 0], -result.times[-1], delta=1e-12)

    def test_the_history_is_a_table(self):
        for context in (contextlib.nullcontext, without_pandas):
            with context():
                stored, read = self.result.history, fissure.read_history(self.folder / "out")
                self.assertEqual(list(stored), list(read))
                for name in stored:
                    numpy.testing.assert_array_equal(stored[name], read[name])
                units = stored.attrs["units"]
                self.assertEqual(units["time"], "s")
                self.assertGreater(numpy.array(stored["kinetic_energy"])[-1], 0)
        with without_pandas():
            self.assertIsInstance(self.result.history, fissure.History)
            self.assertEqual(self.result.history.attrs["units"]["reaction_left_x"], "N")

    def test_rows_that_were_cut_off_are_skipped(self):
        text = (self.folder / "out/history.csv").read_text()
        path = self.folder / "cut.csv"
        path.write_text(text + "1e-3,4")
        self.assertEqual(len(fissure.read_history(path)["time"]), len(text.splitlines()) - 1)
        path.write_text("")
        with self.assertRaisesRegex(ValueError, "there is no header"):
            fissure.read_history(path)

    def test_decks_and_sets_are_those_of_the_run(self):
        result = self.result
        self.assertEqual(result.title, "A small plate")
        self.assertEqual(result.deck_text, PLATE)
        self.assertEqual(result.deck["body"]["plate"]["material"], "glass")
        self.assertEqual(result.deck["time"]["safety"], 0.8)
        self.assertEqual(result.attributes["ranks"], "1")
        self.assertEqual(list(result.sets), ["all", "plate", "corner"])
        self.assertEqual(result.sets["plate"].sum(), 200)
        numpy.testing.assert_array_equal(numpy.flatnonzero(result.sets["corner"]), [0, 1])

    def test_what_is_not_there_is_an_error_with_a_hint(self):
        result = self.result
        with self.assertRaisesRegex(KeyError, "no field `dammage`; did you mean `damage`"):
            result.field("dammage")
        with self.assertRaisesRegex(IndexError, "no output 5; there are 5"):
            result.field("damage", 5)
        with self.assertRaisesRegex(IndexError, "no output at 25 s; they are between 0 and 4"):
            result.field("damage", time=25)
        with self.assertRaisesRegex(TypeError, "one of output and time"):
            result.field("damage", 1, time=1e-6)
        with self.assertRaisesRegex(FileNotFoundError, "there is no result"):
            fissure.open(self.folder)
        with self.assertRaises(OSError):
            fissure.open(self.deck)

    def test_values_of_parameters_and_keys_reach_the_run(self):
        out = self.folder / "other"
        keys = {"time.end": 2e-6, "output.fields": ["damage"], "history.every_steps": numpy.int64(1)}
        with fissure.run(self.deck, output=out, keys=keys, speed="2*0.5", dx=numpy.float64(2e-3), threads=1) as result:
            self.assertEqual(len(result.points), 50)
            self.assertEqual(sorted(result.fields), ["block", "damage", "id", "volume"])
            self.assertLess(result.times[-1], 2.5e-6)
        with self.assertRaises(fissure.RunError) as caught:
            fissure.run(self.deck, output=out)
        self.assertEqual(caught.exception.code, 2)
        self.assertIn("--overwrite", str(caught.exception))
        with self.assertRaisesRegex(fissure.RunError, "sped"):
            fissure.run(self.deck, output=out, overwrite=True, sped=1)
        fissure.run(self.deck, output=out, overwrite=True, dx=2e-3).close()
        with self.assertRaisesRegex(ValueError, "`overwrite` and `restart` exclude each other"):
            fissure.run(self.deck, output=out, overwrite=True, restart=True)

    def test_overlays_replace_keys(self):
        slow, short = self.folder / "slow.toml", self.folder / "short.toml"
        slow.write_text("parameters.speed = 0.5\ntime.end = 3e-6\n")
        short.write_text("time.end = 2e-6\noutput.left = { every_steps = 1, fields = ['stress'], set = 'left' }\n")
        out = self.folder / "overlaid"
        with fissure.run(self.deck, output=out, overlays=[slow, str(short)], threads=1) as result:
            self.assertEqual(result.deck["time"]["end"], 2e-6)
            self.assertEqual(result.deck["parameters"]["speed"], 0.5)
            count = result.steps[-1] + 1
        for path in (out, out / "result.vtkhdf"):
            with fissure.open(path, output="left") as result:
                self.assertEqual((len(result), len(result.points)), (count, 30))
                self.assertEqual(sorted(result.fields), ["block", "id", "stress", "volume"])
                self.assertEqual(len(result.history), 0)
        with self.assertRaisesRegex(FileNotFoundError, "no result of the output 'right'; there are left"):
            fissure.open(out, output="right")
        with fissure.run(self.deck, output=out, overlays=slow, overwrite=True, speed=2, threads=1) as result:
            self.assertEqual(result.deck["time"]["end"], 3e-6)
            self.assertEqual(result.deck["parameters"]["speed"], 2)
        # The deck of this run has no further output.
        self.assertFalse((out / "result_left.vtkhdf").exists())
        with self.assertRaisesRegex(fissure.RunError, "missing.toml"):
            fissure.run(self.deck, output=out, overlays=["missing.toml"])

    def test_ranks_are_started_by_a_launcher(self):
        with fissure.run(self.deck, output=self.folder / "ranks", ranks=2, threads=1) as result:
            self.assertEqual(result.attributes["ranks"], "2")
            numpy.testing.assert_array_equal(result["displacement"], self.result["displacement"])

    def test_points_may_change_from_output_to_output(self):
        deck = self.folder / "refined.toml"
        deck.write_text(PLATE.replace("[set.corner]\nids = [0, 1]\n", "") + REFINED)
        with fissure.run(deck, output=self.folder / "refined", threads=1) as result:
            first, last = (len(result.points_at(k)) for k in (0, -1))
            self.assertEqual(first, 200)
            self.assertGreater(last, first)
            self.assertEqual(result.field("displacement").shape, (last, 3))
            self.assertEqual(result.field("displacement", 0).shape, (first, 3))
            self.assertEqual(len(result.ids), last)
            with self.assertRaisesRegex(ValueError, "own points"):
                result["displacement"]


if __name__ == "__main__":
    if "FISSURE" not in os.environ:
        sys.exit("FISSURE must name the program")
    unittest.main()
