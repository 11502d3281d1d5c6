#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The program echorama makes noise: in a fan that is given, in that of a volume, like that of a volume, and what it refuses."""
import pathlib
import shutil
import tempfile
import unittest

import numpy

from program_under_test import read_mha, run, run_json, snapshot

work = None  # a folder for all tests
FAN = ["--fan-angle", 40, "--fan-width", 25, "--sweep-angle", 30, "--sweep-width", 18, "--depth-max", 50, "--spacing", 0.8,
       "--depth-correlation", 1, "--fan-correlation", 0.035, "--sweep-correlation", 0.05]


def setUpModule():
    global work
    work = pathlib.Path(tempfile.mkdtemp())


def tearDownModule():
    shutil.rmtree(work)


class Noise(unittest.TestCase):
    def test_it_fills_the_fan(self):
        out = work / "noise.mha"
        told = run_json("noise", "-o", out, *FAN)
        _, voxels = read_mha(out)
        _, valid = read_mha(work / "noise.ValidRegion.mha")
        self.assertEqual(told["counts"], {"samples": 151, "elements": 87, "steps": 61})
        self.assertEqual(told["correlation"], {"depth_mm": 1, "fan": 0.035, "sweep": 0.05})
        self.assertAlmostEqual(voxels[valid == 1].mean(), 40, delta=1.5)
        self.assertTrue((voxels[valid == 0] == 0).all())
        for key, value in {"fan_degrees": 40, "fan_mm": 25, "sweep_degrees": 30, "sweep_mm": 18, "depth_mm": [0, 50]}.items():
            numpy.testing.assert_allclose(told["ProbeGeometry"][key], value, rtol=1e-9, err_msg=key)
        text = run("noise", "-o", out, *FAN).stdout
        for words in ("151 samples, 87 elements, 61 steps", "1.000 mm along the depth, 3.50% of the fan, 5.00% of the sweep", f"wrote {out}"):
            self.assertIn(words, text)

    def test_the_seed_decides(self):
        for name, seed in (("a", 3), ("b", 3), ("c", 4)):
            run_json("noise", "-o", work / f"{name}.mha", *FAN, "--seed", seed)
        a, b, c = (read_mha(work / f"{name}.mha")[1] for name in "abc")
        numpy.testing.assert_array_equal(a, b)
        self.assertGreater((a != c).mean(), 0.2)

    def test_it_is_like_another_volume(self):
        run_json("noise", "-o", work / "first.mha", *FAN)
        told = run_json("noise", "-o", work / "like.mha", "--match", work / "first.mha", "--on-grid", "--seed", 9)
        self.assertEqual(told["resolved"], [True, True, True])
        for got, wanted in zip(told["correlation"].values(), (1, 0.035, 0.05)):
            self.assertAlmostEqual(got, wanted, delta=0.15 * wanted)
        (_, first), (_, like), (_, valid) = (read_mha(work / name) for name in ("first.mha", "like.mha", "like.ValidRegion.mha"))
        self.assertEqual(first.shape, like.shape)
        self.assertAlmostEqual(first[valid == 1].mean(), like[valid == 1].mean(), delta=2)
        self.assertAlmostEqual(first[valid == 1].std(), like[valid == 1].std(), delta=2.5)
        # In a window no wider than the grain, part of the grain is taken for something else.
        narrow = run_json("noise", "-o", work / "narrow.mha", "--match", work / "first.mha", "--on-grid", "--window", 0.7)
        self.assertLess(narrow["correlation"]["depth_mm"], 0.85 * told["correlation"]["depth_mm"])

    def test_form_gives_the_fan_alone(self):
        run_json("noise", "-o", work / "form.mha", *FAN)
        told = run_json("noise", "-o", work / "in_form.mha", "--form", work / "form.mha", "--spacing", 1, "--intensity", "rayleigh",
                        "--mean", 300, "--float", "--samples", 80, "--elements", 61, "--steps", 37)
        header, voxels = read_mha(work / "in_form.mha")
        self.assertEqual(header["ElementType"], "MET_FLOAT")
        self.assertEqual(told["counts"], {"samples": 80, "elements": 61, "steps": 37})
        self.assertAlmostEqual(told["ProbeGeometry"]["depth_mm"][1], 50, delta=1e-6)
        # The mean that was asked for, and the longer tail of Rayleigh's distribution to the right; logarithms have theirs to the left.
        run_json("noise", "-o", work / "logs.mha", "--form", work / "form.mha", "--spacing", 1, "--mean", 90, "--float")
        skews = []
        for name, mean in (("in_form", 300), ("logs", 90)):
            real = read_mha(work / f"{name}.mha")[1][read_mha(work / f"{name}.ValidRegion.mha")[1] == 1].astype(float)
            self.assertAlmostEqual(real.mean(), mean, delta=0.05 * mean)
            skews.append(((real - real.mean()) ** 3).mean() / real.std() ** 3)
        self.assertAlmostEqual(skews[0], 0.63, delta=0.2)
        self.assertLess(skews[1], -0.1)

    def test_the_kinds_to_compare_with(self):
        """White noise has no grain, Perlin's is as smooth as if it had one of its own; both begin at the first depth."""
        alike = {}
        for kind in ("white", "perlin"):
            told = run_json("noise", "-o", work / "kind.mha", *FAN, "--kind", kind, "--depth-min", 10)
            self.assertNotIn("counts", told)
            (header, voxels), (_, valid) = (read_mha(work / f"kind{name}.mha") for name in ("", ".ValidRegion"))
            self.assertAlmostEqual(voxels[valid == 1].mean(), 40, delta=1)
            both = (valid[:, :, 1:] & valid[:, :, :-1]) == 1
            alike[kind] = numpy.corrcoef(voxels[:, :, 1:][both], voxels[:, :, :-1][both])[0, 1]
            # Along the beam in the middle.
            origin = numpy.array(header["Offset"].split(), float)
            x, y = (-origin[:2] / 0.8).round().astype(int)
            depths = origin[2] + 0.8 * numpy.flatnonzero(valid[:, y, x])
            self.assertAlmostEqual(depths[0], 10, delta=0.8)
            self.assertAlmostEqual(depths[-1], 50, delta=0.8)
        self.assertLess(abs(alike["white"]), 0.05)
        self.assertGreater(alike["perlin"], 0.6)

    def test_what_it_refuses(self):
        before = snapshot(work)
        for arguments, status, words in (
            (["-o", work / "x.mha", "--fan-correlation", 2], 2, "--fan-correlation"),
            (["-o", work / "x.mha", "--kind", "pink"], 2, "--kind"),
            (["-o", work / "x.mha", "--on-grid"], 2, "--on-grid"),
            (["-o", work / "x.mha", "--match", work / "missing.mha"], 1, "missing.mha"),
            (["-o", work / "x.mha", "--depth-max", -5], 1, "depth"),
            (["-o", work / "x.mha", *FAN, "--mean", 400], 1, "Mean"),
            (["-o", work / "x.unknown"], 2, "x.unknown"),
        ):
            done = run("noise", *arguments)
            self.assertEqual(done.returncode, status, done.stderr)
            self.assertIn(words, done.stderr)
        self.assertEqual(snapshot(work), before)


if __name__ == "__main__":
    unittest.main()
