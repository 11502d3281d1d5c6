#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The sample data: each scene becomes a set with its truth; a scene that cannot be made is left out and said."""
import json
import pathlib
import subprocess
import tempfile
import unittest

import numpy

from program_under_test import PROGRAM, SOURCE, run_json, write_poses

SCENE = {
    "schema": "echorama-scene-1",
    "seed": 3,
    "probe": {"preset": "mechanical-3d", "depthMinMm": 5, "depthMaxMm": 60, "elements": 20, "sweepSteps": 12, "samples": 120},
    "background": "tissue",
    "tissue": [{"name": "ball", "sphere": {"centre": [0, 0, 30], "radius": 8, "material": "cyst"}}],
    "views": {"count": 2, "overlap": 0.6},
    "volume": {"spacingMm": 2, "knockMm": 4, "knockDegrees": 3},
}


def samples(*arguments):
    return subprocess.run(["/usr/bin/python3", SOURCE / "Applications" / "samples" / "samples.py", *map(str, arguments), "--program", PROGRAM],
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=300)


class Samples(unittest.TestCase):
    def test_a_set_per_scene(self):
        with tempfile.TemporaryDirectory() as folder:
            work = pathlib.Path(folder)
            (work / "ball.json").write_text(json.dumps(SCENE))
            (work / "wrong.json").write_text(json.dumps({**SCENE, "probe": {"preset": "spoon"}}))
            done = samples(work / "out", "--scenes", work / "ball.json", work / "wrong.json")
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("wrong: left out", done.stderr)
            self.assertIn("spoon", done.stderr)
            made = work / "out" / "ball"
            volumes = sorted(path for path in made.glob("*.mha") if "ValidRegion" not in path.name and "beams" not in path.name)
            self.assertGreaterEqual(len(volumes), 2)
            files = [made / f"volume_{i}.mha" for i in (1, 2)]
            self.assertEqual([path.name for path in volumes], [path.name for path in files])
            write_poses(work / "still.json", files, [numpy.eye(4)] * 2)
            off = [each["mean_mm"] for each in run_json("score", work / "still.json", "--truth", made / "truth.json")["volumes"]]
            self.assertAlmostEqual(off[0], 0, places=9)
            self.assertTrue(3.5 < off[1] < 6.5, off)  # 4 mm and 3 degrees

    def test_nothing_made_is_an_error(self):
        with tempfile.TemporaryDirectory() as folder:
            work = pathlib.Path(folder)
            (work / "wrong.json").write_text("{")
            done = samples(work / "out", "--scenes", work / "wrong.json")
            self.assertEqual(done.returncode, 1)
            self.assertIn("no scene could be synthesised", done.stderr)

    def test_the_examples_are_found(self):
        self.assertGreaterEqual(len([path for path in (SOURCE / "Examples" / "scenes").glob("*.json") if "schema" not in path.name]), 3)


if __name__ == "__main__":
    unittest.main()
