#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""echorama embed: what it writes, what it says, what it refuses."""
import json
import pathlib
import tempfile
import unittest

import numpy as np
from program_under_test import read_mha, run, run_json, snapshot, write_mha


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
        # A form that holds all data is the outline.
        told = run_json("embed", self.views[0], "-o", out, "--form", self.views[0], "--margin", "0", "--preview", "3")
        known = run_json("info", self.views[0])["files"][0]["acquisition"]["ProbeGeometry"]
        for key, value in known.items():
            np.testing.assert_allclose(told["ProbeGeometry"][key], value, rtol=1e-6, err_msg=key)

    def test_overlap_moves_noise_volumes_together(self):
        """By 30 degrees or none: other noise, and the same data. All of a fan of 65 degrees cannot be overlap."""
        def embedded(name, overlap):
            done = run("embed", self.stitched, "-o", self.folder / f"{name}.mha", "--noise", *self.views, "--preview", 4,
                       "--no-contrast", "--overlap", overlap)
            return done, *(read_mha(self.folder / f"{name}{kind}.mha")[1] for kind in ("", ".Embedding") if done.returncode == 0)

        (done, apart, labels), (_, together, same) = embedded("apart", 0), embedded("together", 30)
        self.assertIn("noise is that of 2 volumes", done.stdout)
        np.testing.assert_array_equal(labels, same)
        np.testing.assert_array_equal(apart[labels == 1], together[labels == 1])
        self.assertGreater((apart != together)[labels == 3].mean(), 0.2)  # where the tiles moved
        done, = embedded("refused", 70)
        self.assertEqual(done.returncode, 1)
        self.assertIn("nothing would be left of it", done.stderr)

    def test_numbers_of_a_cube(self):
        """A cube of 14 mm, 100 inside; its surface is 60 on the left half and 140 on the right, and has no grain."""
        valid, shell = np.zeros((2, 24, 26, 28), np.uint8)
        valid[4:18, 5:19, 6:20] = shell[4:18, 5:19, 6:20] = 1
        shell[5:17, 6:18, 7:19] = 0
        voxels = 100 * valid
        voxels[shell == 1] = np.broadcast_to(np.where(np.arange(28) < 13, 60, 140), valid.shape)[shell == 1]
        write_mha(self.folder / "cube.mha", voxels)
        write_mha(self.folder / "cube.ValidRegion.mha", valid)
        where = np.argwhere(shell)

        def spread(place, exponent):
            """The mean of the surface, weighted by distance to a power."""
            weights = np.linalg.norm(where - place, axis=1) ** -exponent
            return (weights * voxels[shell == 1]).sum() / weights.sum()

        def embedded(*options):
            told = run_json("embed", self.folder / "cube.mha", "-o", self.folder / "cubed.mha", *options)
            first = -np.array(told["origin"][::-1])  # where the first voxel of the cube's file went
            first = (first / told["spacing"][0]).round().astype(int)
            return told, first, *(read_mha(self.folder / f"cubed{name}.mha")[1] for name in ("", ".Embedding"))

        for margin, feather, outside, inside, options in (
                (5, 3, 4, 6, ("--margin", 5, "--feather", 3)), (9, 5, 1, 2, ("--margin", 9, "--feather", 5, "--outside-exponent", 1, "--inside-exponent", 2))):
            told, first, grey, labels = embedded("--smooth", 0.001, *options)
            probe = told["ProbeGeometry"]
            side = 14 + 2 * margin
            np.testing.assert_allclose([probe["fan_mm"], probe["sweep_mm"], *probe["depth_mm"]], [side, side, 0, side], atol=1e-3)
            # What is nearer to the background than the feather is mixed with it.
            data, cube = (14 - 2 * (feather - 1))**3, 14**3
            self.assertEqual((told["voxels_data"], told["voxels_blend"]), (data, cube - data))
            self.assertEqual([(labels == kind).sum() for kind in (1, 2)], [data, cube - data])
            for x in range(6 - margin, 6):
                place = np.array([11, 12, x])
                self.assertEqual(labels[tuple(place + first)], 3)
                self.assertAlmostEqual(grey[tuple(place + first)], spread(place, outside), delta=0.8, msg=f"{x}")  # half a level by rounding
            for x in range(7, 6 + feather - 1):  # behind the surface
                place, weight = np.array([11, 12, x]), (x - 5) / feather
                self.assertAlmostEqual(grey[tuple(place + first)], weight * 100 + (1 - weight) * spread(place, inside), delta=0.8, msg=f"{x}")

        # By themselves margin and feather follow the data: a fortieth of 13 mm, in which there is no voxel, so that nothing is invented;
        # and four voxels are more than 3 mm.
        told, first, grey, labels = embedded("--smooth", 0.001)
        self.assertAlmostEqual(told["ProbeGeometry"]["depth_mm"][1], 14 + 2 * 13 / 40, delta=1e-3)
        self.assertEqual((told["feather_mm"], told["voxels_data"], told["voxels_blend"]), (3, 14**3, 0))
        told, first, grey, labels = embedded("--smooth", 0.001, "--margin", 1)
        self.assertEqual((told["feather_mm"], told["voxels_data"]), (3, 10**3))

        # Every third voxel, from the second: the middle of three.
        told, first, grey, labels = embedded("--preview", 3)
        self.assertEqual(told["spacing"], [3, 3, 3])
        known = labels == 1
        third = (slice(1, None, 3),) * 3
        self.assertEqual(told["voxels_data"] + told["voxels_blend"], valid[third].sum())
        np.testing.assert_array_equal(np.sort(grey[known]), np.sort(voxels[third][valid[third] == 1]))  # the feather is no thicker than a voxel

        # Where all of it is grain, the background has the mean and the deviation of the whole cube; with --no-contrast that of the noise.
        told, _, grey, labels = embedded("--smooth", 1000, "--margin", 5)
        real, invented = voxels[valid == 1].astype(float), grey[labels == 3].astype(float)
        self.assertAlmostEqual(invented.mean(), real.mean(), delta=2)
        self.assertAlmostEqual(invented.std(), real.std(), delta=2)
        told, _, grey, labels = embedded("--smooth", 1000, "--margin", 5, "--no-contrast")
        self.assertGreater(grey[labels == 3].std(), 1.5 * real.std())

    def test_it_says_when_there_is_too_little_speckle(self):
        """Water with a wall: no speckle at all. The note tells what to do, and the background is made nevertheless."""
        voxels = np.zeros((40, 44, 48), np.uint8)
        voxels[30:32] = 220
        write_mha(self.folder / "water.mha", voxels)
        write_mha(self.folder / "water.ValidRegion.mha", np.ones_like(voxels))
        done = run("embed", self.folder / "water.mha", "-o", self.folder / "wet.mha")
        self.assertEqual(done.returncode, 0, done.stderr)
        for words in ("too little speckle", "noise volumes of the same scanner"):
            self.assertIn(words, done.stdout + done.stderr)
        told = run_json("embed", self.folder / "water.mha", "-o", self.folder / "wet.mha")
        self.assertFalse(told["enough_speckle"])
        self.assertEqual(told["speckle_grains"], 0)
        self.assertEqual(told["ProbeGeometry"]["fan_degrees"], 0)
        # A volume of speckle has enough, and says nothing of the kind.
        done = run("embed", self.stitched, "-o", self.folder / "fine.mha", "--outline", "linear", "--json")
        told = json.loads(done.stdout)
        self.assertTrue(told["enough_speckle"])
        self.assertGreater(told["speckle_grains"], 400)
        self.assertNotIn("too little speckle", done.stdout + done.stderr)
        self.assertEqual((told["ProbeGeometry"]["fan_degrees"], told["ProbeGeometry"]["sweep_degrees"]), (0, 0))
        found = run_json("embed", self.stitched, "-o", self.folder / "fine.mha")
        self.assertGreater(found["ProbeGeometry"]["fan_degrees"], 10)
        self.assertLess(found["voxels_invented"], told["voxels_invented"])

    def test_what_is_refused(self):
        nothing = self.folder / "nothing.mha"
        write_mha(nothing, np.zeros((20, 20, 20), np.uint8))
        before = snapshot(self.folder)
        for status, arguments, words in (
                (2, (self.stitched,), ("output",)),
                (2, (self.stitched, "-o", self.folder / "a.mha", "--feather", "-2"), ("feather",)),
                (2, (self.stitched, "-o", self.folder / "a.mha", "--outline", "round"), ("outline",)),
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
