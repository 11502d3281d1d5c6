#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""echorama calibrate surface: a whole calibration by a simulated hand in a simulated camera, and whether it still holds."""
import json
import pathlib
import shutil
import subprocess
import tempfile
import unittest

import numpy
from vtkmodules.vtkCommonTransforms import vtkTransform
from vtkmodules.vtkFiltersGeneral import vtkTransformPolyDataFilter
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkIOGeometry import vtkSTLWriter

from program_under_test import PROGRAM, run, snapshot

RADII = numpy.array((130.0, 110.0, 90.0))
# A lens and a place of the camera that are not the nominal ones.
CAMERA = ("simulated:?speed=0&cameraMm=2 -3 -16&cameraTurn=1 2 140&focal=150&centreX=324&centreY=236&k1=-0.026&k2=0.002"
          "&moveSeconds=0.3&liftMm=8")
ROUGH = ("--camera-position", 0, 0, -20, "--focal", 145, "--rest-frames", 12)
work = None  # a folder for all tests


def setUpModule():
    global work
    work = pathlib.Path(tempfile.mkdtemp())
    ball, shape, belly, writer = vtkSphereSource(), vtkTransform(), vtkTransformPolyDataFilter(), vtkSTLWriter()
    ball.SetRadius(1)
    ball.SetThetaResolution(160)
    ball.SetPhiResolution(160)
    shape.Scale(*RADII)
    belly.SetTransform(shape)
    belly.SetInputConnection(ball.GetOutputPort())
    writer.SetInputConnection(belly.GetOutputPort())
    writer.SetFileName(str(work / "belly.stl"))
    writer.SetFileTypeToBinary()
    writer.Write()
    count = 90
    lines = ["label,x,y,z"]
    for i in range(count):  # along a spiral from the top down
        z = 1 - 0.9 * (i + 0.5) / count
        across, angle = numpy.sqrt(1 - z * z), 2.399963 * i
        x, y, z = RADII * (across * numpy.cos(angle), across * numpy.sin(angle), z)
        lines.append(f"{i + 1},{x},{y},{z}")
    (work / "points.csv").write_text("\n".join(lines) + "\n")
    calibrate("first", "placementMm=0.1&wrongMarks=0.05")


def tearDownModule():
    shutil.rmtree(work)


told = {}


def calibrate(name, hand):
    done = run("calibrate", "surface", f"{CAMERA}&{hand}", "--mesh", work / "belly.stl", "--marks", work / "points.csv", "-o", work / f"{name}.json",
               "--shell", "belly-1", *ROUGH, "--json")
    told[name] = (done.returncode, json.loads(done.stdout), done.stderr)


def check(camera=CAMERA):
    done = run("calibrate", "surface", f"{camera}&placementMm=0.1&handSeed=9", "--check", work / "first.json", "--rest-frames", 12, "--json")
    return done.returncode, json.loads(done.stdout), done.stderr


class Surface(unittest.TestCase):
    def test_calibration(self):
        status, result, messages = told["first"]
        self.assertEqual(status, 0, messages)
        accuracy = result["accuracy"]
        self.assertLess(accuracy["mm95"], 0.5)
        self.assertGreater(accuracy["coverage"], 0.9)
        self.assertEqual(accuracy["inliers"] + len(result["outliers"]), accuracy["marks"])
        self.assertAlmostEqual(accuracy["scatter_mm"], 0.1, delta=0.04)
        self.assertRegex(messages, r"mark 1, please \(0 of 90 taken\)")
        self.assertRegex(messages, r"mark 5, please \(1 of 90 taken\)")  # thinned out
        self.assertRegex(messages, r"mark \d+ taken, 0\.\d\d mm from where \d+ others put it")
        self.assertRegex(messages, r"that is mark \d+, not \d+: taken for it|mark \d+ lies \d+\.\d mm from where \d+ others put it: repeat it")
        written = json.loads((work / "first.json").read_text())
        self.assertEqual(written["schema"], "echorama-surface-1")
        self.assertEqual(written["shell"], "belly-1")
        self.assertEqual(written["mesh"]["file"], "first.mesh.stl")
        self.assertTrue((work / "first.mesh.stl").exists())
        numpy.testing.assert_allclose(written["cameraToShell"]["position"], (2, -3, -16), atol=0.5)
        z = numpy.cross(written["cameraToShell"]["x"], written["cameraToShell"]["y"])
        numpy.testing.assert_allclose(z, written["cameraToShell"]["z"], atol=1e-9)
        self.assertAlmostEqual(written["lens"]["focal"], 150, delta=1)

    def test_it_holds_while_nothing_moves(self):
        status, result, messages = check()
        self.assertEqual(status, 0, messages)
        self.assertEqual(result["verdict"], "holds")
        self.assertGreater(result["chance"], 0.001)

    def test_a_camera_that_moved_is_noticed(self):
        status, result, messages = check(CAMERA.replace("cameraMm=2 -3", "cameraMm=3.2 -3"))
        self.assertEqual(status, 3, messages)
        self.assertEqual(result["verdict"], "moved")
        self.assertAlmostEqual(result["moved_mm"], 1.2, delta=0.5)

    def test_a_light_that_does_not_touch_is_told_so(self):
        weak = CAMERA.replace("moveSeconds=0.3&liftMm=8", "moveSeconds=0.6&liftMm=20") + "&peak=60"
        status, result, messages = check(weak)
        self.assertIn("the light is too weak or too wide there for one that touches the skin: press it onto mark", messages)
        self.assertEqual(status, 0, messages)  # whoever insists is believed
        self.assertEqual(result["verdict"], "holds")

    def test_a_person_may_type_what_comes_next(self):
        with tempfile.TemporaryDirectory() as folder:
            arguments = ("calibrate", "surface", CAMERA, "--mesh", work / "belly.stl", "--marks", work / "points.csv", "-o", f"{folder}/no.json", *ROUGH)
            done = subprocess.run([PROGRAM, *map(str, arguments)], input="s\ng 99\nwhat?\ng 7\ne\n", stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                  text=True, timeout=300)
            self.assertIn("there is no mark 99; there are 1 to 90", done.stderr)
            self.assertIn("s: skip this mark, b: the last one again", done.stderr)
            self.assertIn("mark 7, please (0 of 90 taken)", done.stderr)
            self.assertIn("no mark has been taken", done.stderr)
            self.assertEqual(done.returncode, 1)
            self.assertEqual(list(pathlib.Path(folder).iterdir()), [])

    def test_wrong_shell_picture_and_files_are_refused(self):
        before = snapshot(work)
        for arguments, words in (
                (("--check", work / "first.json", "--shell", "belly-2"), f'{work / "first.json"}: it was made in the shell "belly-1", and "belly-2" is mounted'),
                (("--check", work / "nowhere.json"), "nowhere.json"),
                (("--check", work / "first.json", "--light", 3), "there is no light 3; there are 2"),
                (("--check", work / "first.json", "--mesh", work / "belly.stl"), "--check takes mesh and marks from the calibration"),
                (("--mesh", work / "belly.stl"), "a calibration needs --mesh, --marks and --output"),
        ):
            done = run("calibrate", "surface", CAMERA, *arguments)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(words, done.stderr)
        done = run("calibrate", "surface", CAMERA.replace("focal=150", "focal=75&width=320&height=240"), "--check", work / "first.json")
        self.assertEqual(done.returncode, 1)
        self.assertIn(f"{work / 'first.json'}: the camera was calibrated with pictures of 640 x 480 and now gives 320 x 240", done.stderr)
        # What is written beside the calibration replaces no input, and another extension is refused before anybody has done any work.
        shutil.copy(work / "belly.stl", work / "body.mesh.stl")
        for output, words in (("body.json", "inputs are never overwritten"), ("body", "a calibration is written as .json")):
            done = run("calibrate", "surface", CAMERA, "--mesh", work / "body.mesh.stl", "--marks", work / "points.csv", "-o", work / output)
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(words, done.stderr)
            self.assertNotIn("please", done.stderr)
        (work / "body.mesh.stl").unlink()
        lines = (work / "points.csv").read_text().splitlines()
        lines[7] = "7,0,0,130"
        (work / "shifted.csv").write_text("\n".join(lines))
        done = run("calibrate", "surface", CAMERA, "--mesh", work / "belly.stl", "--marks", work / "shifted.csv", "-o", work / "no.json")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"mark 7 lies 40\.0 mm from the skin")
        (work / "shifted.csv").unlink()
        self.assertEqual(snapshot(work), before)

    def test_a_mesh_that_is_gone_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            lonely = pathlib.Path(folder) / "lonely.json"
            shutil.copy(work / "first.json", lonely)
            done = run("calibrate", "surface", CAMERA, "--check", lonely)
            self.assertEqual(done.returncode, 1)
            self.assertIn(f"{lonely}: its mesh {lonely.with_name('first.mesh.stl')} is missing", done.stderr)


if __name__ == "__main__":
    unittest.main()
