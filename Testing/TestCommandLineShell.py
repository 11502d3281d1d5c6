#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The program echorama makes a skin to print, and says what is wrong with a body that it cannot."""
import pathlib
import shutil
import struct
import tempfile
import unittest
import zipfile

import numpy
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkIOGeometry import vtkSTLWriter

from program_under_test import run, run_json, snapshot

work = None  # a folder for all tests


def setUpModule():
    global work
    work = pathlib.Path(tempfile.mkdtemp())
    for name, end in (("ball", 180.0), ("open", 170.0)):
        ball, writer = vtkSphereSource(), vtkSTLWriter()
        ball.SetRadius(40)
        ball.SetThetaResolution(64)
        ball.SetPhiResolution(32)
        ball.SetEndPhi(end)
        writer.SetInputConnection(ball.GetOutputPort())
        writer.SetFileName(str(work / f"{name}.stl"))
        writer.SetFileTypeToBinary()
        writer.Write()


def tearDownModule():
    shutil.rmtree(work)


def triangles(path):
    data = path.read_bytes()
    count = struct.unpack_from("<I", data, 80)[0]
    kind = numpy.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
    return numpy.frombuffer(data, kind, count, 84)["corners"].astype(float)


class Shell(unittest.TestCase):
    def test_all_files_are_made(self):
        out = work / "prints"
        told = run_json("shell", work / "ball.stl", "-o", out, "--resolution-mm", 1, "--opening-mm", 20, "--flange-mm", 0, "--points", 50)
        self.assertEqual(sorted(path.name for path in out.iterdir()), ["base.stl", "points.csv", "points.html", "shell.3mf", "skin.stl"])
        skin = triangles(out / "skin.stl")
        volume = numpy.linalg.det(skin).sum() / 6  # files of STL repeat their points
        cap = lambda r: numpy.pi * (2 / 3 * r**3 + 20 * r * r - 8000 / 3)
        self.assertAlmostEqual(volume / (cap(40) - cap(38)), 1, delta=0.02)
        for mm in told["wall_mm"]:
            self.assertAlmostEqual(mm, 2, delta=0.06)
        numpy.testing.assert_allclose(told["camera"], (0, 0, -14), atol=0.1)
        points = numpy.loadtxt(out / "points.csv", delimiter=",", skiprows=1)
        numpy.testing.assert_array_equal(points[:, 0], numpy.arange(1, len(points) + 1))
        self.assertTrue(35 <= len(points) <= 65, len(points))
        numpy.testing.assert_allclose(numpy.linalg.norm(points[:, 1:], axis=1), 40, atol=0.3)
        self.assertIn(f">{len(points)}</text>", (out / "points.html").read_text())
        with zipfile.ZipFile(out / "shell.3mf") as archive:
            self.assertEqual(archive.read("3D/3dmodel.model").count(b"<triangle "), len(skin) + len(triangles(out / "base.stl")))

    def test_what_is_too_large_is_cut(self):
        out = work / "parts"
        told = run_json("shell", work / "ball.stl", "-o", out, "--resolution-mm", 1, "--opening-mm", 20, "--flange-mm", 0, "--points", 0,
                        "--printer-mm", 70, 100, 100)
        names = ["base-1.stl", "base-2.stl", "shell.3mf", "skin-1.stl", "skin-2.stl"]
        self.assertEqual(sorted(path.name for path in out.iterdir()), names)
        self.assertEqual(told["skin"] + told["base"] + [told["all"]], ["skin-1.stl", "skin-2.stl", "base-1.stl", "base-2.stl", "shell.3mf"])
        for name in told["skin"] + told["base"]:
            size = numpy.ptp(triangles(out / name).reshape(-1, 3), axis=0)
            self.assertTrue((size <= (70, 100, 100)).all() or (size <= (100, 70, 100)).all(), (name, size))

    def test_rig_has_two_domes_whose_marks_the_camera_sees_in_the_same_directions(self):
        out = work / "rig"
        told = run_json("shell", work / "ball.stl", "-o", out, "--resolution-mm", 1, "--opening-mm", 30, "--mark-mm", 2, "--points", 100,
                        "--baffle-mm", 4, "--rig")
        names = ["large-dome.stl", "points-large.csv", "points-small.csv", "points.html", "rig.3mf", "small-dome.stl"]
        self.assertEqual(sorted(path.name for path in out.iterdir()), names)
        large, small = (numpy.loadtxt(out / name, delimiter=",", skiprows=1) for name in told["points"])
        numpy.testing.assert_array_equal(large[:, 0], small[:, 0])
        radii = [numpy.linalg.norm(points[:, 1:], axis=1) for points in (large, small)]
        for radius in radii:
            self.assertLess(numpy.ptp(radius), 1e-3)
        self.assertAlmostEqual(radii[1][0] / radii[0][0], 0.6, delta=1e-3)
        numpy.testing.assert_allclose(small[:, 1:] / radii[1][0], large[:, 1:] / radii[0][0], atol=1e-4)
        # Seen from the camera the dome ends at its radius.
        top = triangles(out / "large-dome.stl").reshape(-1, 3)[:, 2].max() - told["camera"][2]
        self.assertAlmostEqual(top, radii[0][0], delta=0.3)  # there is a hole at the top
        self.assertNotIn("wall_mm", told)

    def test_what_cannot_be_made_leaves_nothing(self):
        before = snapshot(work)
        for arguments, words in (
                ((work / "open.stl",), f"{work / 'open.stl'}: the body is not closed: it has 1 hole, one of"),
                ((work / "nowhere.stl",), "nowhere.stl: there is no such file"),
                ((work / "ball.stl", "--printer-mm", 50, 50, 50), "cannot be cut for a printer"),
                ((work / "ball.stl", "--printer-mm", 50, 50, 50, "--no-cut-to-fit"), "does not fit the printer"),
                ((work / "ball.stl", "--thickness-mm", 100), "ThicknessMm is 100 mm; it must be in [0.4, 20]"),
        ):
            done = run("shell", *arguments, "-o", work / "nothing", "--opening-mm", 20, "--resolution-mm", 1)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(words, done.stderr)
            self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)
            self.assertEqual(snapshot(work), before)


if __name__ == "__main__":
    unittest.main()
