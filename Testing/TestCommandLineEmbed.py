#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""echorama embed: what it writes, what it says, what it refuses."""
import json
import pathlib
import tempfile
import unittest

import numpy as np
from program_under_test import run, snapshot, write_mha


class Embed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.holder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.holder.cleanup)
        cls.folder = pathlib.Path(cls.holder.name)
        done = run("phantom", "-o", cls.folder / "views", "--count", "2", "--spacing", "2")
        assert done.returncode == 0, done.stderr
        cls.views = sorted(path for path in (cls.folder / "views").glob("*.mha") if "ValidRegion" not in path.name)
        cls.stitched = cls.folder / "stitched.mha"
        done = run("stitch", *cls.views, "-o", cls.stitched)
        assert done.returncode == 0, done.stderr

    def test_a_volume_and_its_labels(self):
        out = self.folder / "embedded.mha"
        done = run("embed", self.stitched, "-o", out, "--json", "--seed", "5", "--feather", "4")
        self.assertEqual(done.returncode, 0, done.stderr)
        result = json.loads(done.stdout)
        self.assertTrue((self.folder / "embedded.Embedding.mha").exists())
        self.assertTrue((self.folder / "embedded.ValidRegion.mha").exists())
        self.assertGreater(result["voxels_data"], 10000)
        self.assertGreater(result["voxels_blend"], 1000)
        self.assertGreater(result["voxels_invented"], 1000)
        self.assertEqual(result["spacing"], [2, 2, 2])
        for option in ("fan_degrees", "depth_mm"):
            self.assertIn(option, result["ProbeGeometry"])
        # The same seed writes the same file.
        again = self.folder / "again.mha"
        self.assertEqual(run("embed", self.stitched, "-o", again, "--seed", "5", "--feather", "4").returncode, 0)
        self.assertEqual(out.read_bytes(), again.read_bytes())

    def test_options(self):
        out = self.folder / "options.vti"
        done = run("embed", self.stitched, "-o", out, "--noise", *self.views, "--overlap", "5", "--preview", "2", "--no-contrast",
                   "--form", self.views[0], "--json")
        self.assertEqual(done.returncode, 0, done.stderr)
        report = "\n".join(json.loads(done.stdout)["report"])
        self.assertIn("that of 2 volumes", report)
        self.assertIn("fan of the form", report)
        done = run("embed", self.stitched, "-o", out, "--no-match", "--preview", "3")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("invented background", done.stdout)
        self.assertNotIn("grain of the data", done.stdout)

    def test_what_is_refused(self):
        nothing = self.folder / "nothing.mha"
        write_mha(nothing, np.zeros((20, 20, 20), np.uint8))
        before = snapshot(self.folder)
        for status, arguments, words in (
                (2, (self.stitched,), ("output",)),
                (2, (self.stitched, "-o", self.folder / "a.mha", "--feather", "-1"), ("feather",)),
                (2, (self.stitched, "-o", self.folder / "a.mha", "--preview", "0"), ("preview",)),
                (2, (self.stitched, "-o", self.folder / "a.xyz"), ("a.xyz",)),
                (1, (self.stitched, "-o", self.stitched), ("stitched.mha",)),
                (1, (nothing, "-o", self.folder / "a.mha"), ("nothing.mha: ", "valid region is empty")),
                (1, (self.stitched, "-o", self.folder / "a.mha", "--noise", nothing), ("nothing.mha: ", "no probe")),
                (1, (self.stitched, "-o", self.folder / "a.mha", "--form", nothing), ("nothing.mha: ", "no probe")),
                (1, (self.folder / "missing.mha", "-o", self.folder / "a.mha"), ("missing.mha",)),
                (1, (self.stitched, "-o", self.folder / "a.mha", "--noise", self.folder / "missing.mha"), ("missing.mha",)),
                (1, (self.stitched, "-o", self.folder / "a.mha", "--form", self.folder / "missing.mha"), ("missing.mha",))):
            done = run("embed", *arguments)
            self.assertEqual(done.returncode, status, f"{arguments}: {done.stdout}{done.stderr}")
            for word in words:
                self.assertIn(word, done.stderr)
        self.assertEqual(snapshot(self.folder), before)


if __name__ == "__main__":
    unittest.main()
