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

    def test_form_gives_the_fan_alone(self):
        run_json("noise", "-o", work / "form.mha", *FAN)
        told = run_json("noise", "-o", work / "in_form.mha", "--form", work / "form.mha", "--spacing", 1, "--intensity", "rayleigh",
                        "--mean", 300, "--float", "--samples", 80)
        header, voxels = read_mha(work / "in_form.mha")
        self.assertEqual(header["ElementType"], "MET_FLOAT")
        self.assertGreater(voxels.max(), 400)
        self.assertEqual(told["counts"]["samples"], 80)
        self.assertAlmostEqual(told["ProbeGeometry"]["depth_mm"][1], 50, delta=1e-6)

    def test_the_kinds_to_compare_with(self):
        for kind in ("white", "perlin"):
            told = run_json("noise", "-o", work / "kind.mha", *FAN, "--kind", kind)
            self.assertNotIn("counts", told)
            self.assertAlmostEqual(read_mha(work / "kind.mha")[1][read_mha(work / "kind.ValidRegion.mha")[1] == 1].mean(), 40, delta=5)

    def test_what_it_refuses(self):
        before = snapshot(work)
        for arguments, status, words in (
            (["-o", work / "x.mha", "--fan-correlation", 2], 2, "--fan-correlation"),
            (["-o", work / "x.mha", "--kind", "pink"], 2, "--kind"),
            (["-o", work / "x.mha", "--on-grid"], 2, "--on-grid"),
            (["-o", work / "x.mha", "--match", work / "missing.mha"], 1, "missing.mha"),
            (["-o", work / "x.mha", "--depth-max", -5], 1, "depth"),
            (["-o", work / "x.mha", *FAN, "--mean", 400], 1, "mean"),
            (["-o", work / "x.unknown"], 2, "x.unknown"),
        ):
            done = run("noise", *arguments)
            self.assertEqual(done.returncode, status, done.stderr)
            self.assertIn(words, done.stderr)
        self.assertEqual(snapshot(work), before)


if __name__ == "__main__":
    unittest.main()
