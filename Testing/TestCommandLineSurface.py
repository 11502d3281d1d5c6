#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""echorama calibrate surface: a whole calibration by a simulated hand in a simulated camera, and whether it still holds."""
import json
import pathlib
import queue
import re
import shutil
import subprocess
import tempfile
import threading
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


def calibrate(name, hand, shell=("--shell", "belly-1")):
    done = run("calibrate", "surface", f"{CAMERA}&{hand}", "--mesh", work / "belly.stl", "--marks", work / "points.csv", "-o", work / f"{name}.json",
               *shell, *ROUGH, "--json")
    told[name] = (done.returncode, json.loads(done.stdout), done.stderr)


def typed(camera, folder, text, *options):
    """With all of the text to be read at the start."""
    arguments = ("calibrate", "surface", camera, "--mesh", work / "belly.stl", "--marks", work / "points.csv", "-o", f"{folder}/typed.json", *ROUGH, *options)
    return subprocess.run([PROGRAM, *map(str, arguments)], input=text, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=300)


def asked(messages):
    return [int(mark) for mark in re.findall(r"mark (\d+), please", messages)]


class Person:
    """Who reads what the program says, and types."""

    def __init__(self, camera, folder, *options):
        arguments = ("calibrate", "surface", camera, "--mesh", work / "belly.stl", "--marks", work / "points.csv", "-o", f"{folder}/typed.json", *ROUGH, *options)
        self.program = subprocess.Popen([PROGRAM, *map(str, arguments)], stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.lines = queue.Queue()
        self.read = []
        self.reader = threading.Thread(target=self.listen)
        self.reader.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.program.kill()
        self.program.wait()
        self.reader.join()
        self.program.stdin.close()
        self.program.stderr.close()

    def listen(self):
        for line in self.program.stderr:
            self.lines.put(line)

    def type(self, line):
        self.program.stdin.write(line + "\n")
        self.program.stdin.flush()

    def wait_for(self, pattern):
        """What it says from now on, until it says this."""
        while True:
            try:
                line = self.lines.get(timeout=60)
            except queue.Empty:
                raise AssertionError(f"{pattern!r} was not said in a minute, but:\n" + "".join(self.read[-20:])) from None
            self.read.append(line)
            if found := re.search(pattern, line):
                return found

    def end(self):
        return self.program.wait(60)


def check(camera=CAMERA, calibration="first"):
    done = run("calibrate", "surface", f"{camera}&placementMm=0.1&handSeed=9", "--check", work / f"{calibration}.json", "--rest-frames", 12,
               "--json")
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
        self.assertIn("no shell's marker is seen", messages)
        self.assertNotIn("mounted", result)

    def test_the_marker_says_which_shell_is_mounted(self):
        marked = f"{CAMERA}&marker=0A1B2C"
        calibrate("marked", "placementMm=0.1&marker=0A1B2C", shell=())
        status, result, messages = told["marked"]
        self.assertEqual(status, 0, messages)
        self.assertIn("the marker of the mounted shell says 0A1B2C", messages)
        self.assertEqual(result["mounted"], "0A1B2C")
        self.assertEqual(json.loads((work / "marked.json").read_text())["shell"], "0A1B2C")
        status, result, messages = check(marked, "marked")
        self.assertEqual((status, result["verdict"], result["mounted"]), (0, "holds", "0A1B2C"), messages)
        # Another one: by a check, whatever the file calls its own, and by a calibration that was told otherwise.
        before = snapshot(work)
        for calibration, its in (("marked", "0A1B2C"), ("first", "belly-1")):
            done = run("calibrate", "surface", f"{CAMERA}&marker=FF0102", "--check", work / f"{calibration}.json")
            self.assertEqual(done.returncode, 1)
            self.assertIn(f'{work / calibration}.json: it was made in the shell "{its}", and "FF0102" is mounted', done.stderr)
        done = run("calibrate", "surface", marked, "--mesh", work / "belly.stl", "--marks", work / "points.csv", "-o", work / "no.json", "--shell",
                   "0A1B2D", *ROUGH)
        self.assertEqual(done.returncode, 1)
        self.assertIn("--shell says 0A1B2D, and the marker of the mounted shell says 0A1B2C: nothing is calibrated", done.stderr)
        self.assertEqual(snapshot(work), before)
        # A file that does not say whose it is holds for any.
        unnamed = json.loads((work / "marked.json").read_text())
        unnamed["shell"] = ""
        (work / "unnamed.json").write_text(json.dumps(unnamed))
        status, result, messages = check(marked, "unnamed")
        self.assertEqual((status, result["mounted"]), (0, "0A1B2C"), messages)
        self.assertIn("it does not say which shell it was made in", messages)
        (work / "unnamed.json").unlink()

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
            done = typed(CAMERA, folder, "s\ng 99\nwhat?\ng 7\nb\ng\ne\n")
            self.assertIn("there is no mark 99; there are 1 to 90", done.stderr)
            self.assertEqual(done.stderr.count("s: skip this mark, b: the last one again"), 2)  # no gap is known yet
            self.assertEqual(asked(done.stderr), [1, 5, 7])  # and with no mark taken b asks for none
            self.assertIn("no mark has been taken", done.stderr)
            self.assertEqual(done.returncode, 1)
            self.assertEqual(list(pathlib.Path(folder).iterdir()), [])

    def test_a_mark_that_is_skipped_comes_last(self):
        with tempfile.TemporaryDirectory() as folder:
            done = typed(CAMERA + "&placementMm=0.1", folder, "s\ns\ng 30", "--all")  # the last line lacks its end
            self.assertEqual(done.returncode, 0, done.stderr)
            marks = asked(done.stderr)
            self.assertEqual(marks[:5], [1, 5, 9, 30, 9])
            self.assertEqual(marks[-2:], [1, 5])
            self.assertEqual(sorted(marks), sorted([*range(1, 91), 1, 5, 9]))  # 30 is not asked for again

    def test_the_last_mark_is_done_again_and_the_largest_gap_is_gone_to(self):
        with tempfile.TemporaryDirectory() as folder, Person(f"{CAMERA}&handSeed=3&placementMm=0.1", folder, "--all") as person:
            taken = [person.wait_for(r"mark (\d+) taken")[1] for _ in range(2)]
            person.type("b")
            for _ in range(20):
                said = person.wait_for(r"mark (\d+)( taken|, please \((\d+) of)")
                if said[2] == " taken":
                    taken.append(said[1])
                elif said[1] in taken:
                    break
            self.assertEqual(said[1], taken[-1])  # the last one, which is not counted until it is done again
            self.assertEqual(int(said[3]), len(taken) - 1)
            person.wait_for(rf"mark {said[1]} taken")
            gap = person.wait_for(r"the largest gap, \d+ px, is about mark (\d+)")[1]
            person.type("g")
            person.wait_for(rf"mark {gap}, please")
            person.wait_for(rf"mark {gap} taken")
            person.type("e")
            self.assertEqual(person.end(), 0)
            accuracy = json.loads((pathlib.Path(folder) / "typed.json").read_text())["accuracy"]
            self.assertLess(accuracy["marks"], 90)

    def test_what_is_typed_is_heard_while_no_frames_come(self):
        with tempfile.TemporaryDirectory() as folder:
            dark = pathlib.Path(folder) / "dark.igs.mhd"
            header = ["ObjectType = Image", "NDims = 3", "DimSize = 640 480 2", "ElementType = MET_UCHAR", "ElementSpacing = 1 1 1", "CameraRate = 90",
                      "CameraExposureMs = 8"]
            header += [f"Seq_Frame{i:04}_Timestamp = {at}" for i, at in enumerate((0, 600))]  # ten minutes later
            dark.write_text("\n".join([*header, "ElementDataFile = dark.igs.raw"]) + "\n")
            dark.with_suffix(".raw").write_bytes(bytes(2 * 640 * 480))
            with Person(f"recording:{dark}", folder) as person:
                person.wait_for("mark 1, please")
                person.wait_for("no frame has come for 2 s")
                for line, answer in (("s", "mark 5, please"), ("g 17", "mark 17, please"), ("g 99", "there is no mark 99")):
                    person.type(line)
                    person.wait_for(answer)
                person.type("e")
                self.assertEqual(person.end(), 1)

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
