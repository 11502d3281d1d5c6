#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""echorama calibrate, track, motion, and align with a tracker: from scans of the rig and a log to volumes that a tracker places."""
import csv
import json
import math
import pathlib
import re
import signal
import subprocess
import tempfile
import time
import unittest

import numpy

from program_under_test import DATA, PLUS, PROGRAM, run, run_json, snapshot, write_mha, write_plus, write_poses

work = None


def pose(translation, rotation_vector):
    """A rigid 4 x 4 matrix; radians."""
    matrix = numpy.eye(4)
    angle = numpy.linalg.norm(rotation_vector)
    if angle > 0:
        x, y, z = numpy.asarray(rotation_vector) / angle
        cross = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        matrix[:3, :3] += math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    matrix[:3, 3] = translation
    return matrix


def quaternion(matrix):
    values, vectors = numpy.linalg.eigh(numpy.array(
        [[matrix[0, 0] + matrix[1, 1] + matrix[2, 2], matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]],
         [0, matrix[0, 0] - matrix[1, 1] - matrix[2, 2], matrix[1, 0] + matrix[0, 1], matrix[2, 0] + matrix[0, 2]],
         [0, 0, matrix[1, 1] - matrix[0, 0] - matrix[2, 2], matrix[2, 1] + matrix[1, 2]],
         [0, 0, 0, matrix[2, 2] - matrix[0, 0] - matrix[1, 1]]]).T)
    return vectors[:, -1]


def write_log(path, tool, times, poses, unit=1.0):
    lines = ["time,tool,tx,ty,tz,qw,qx,qy,qz"]
    for moment, matrix in zip(times, poses):
        numbers = [float(moment), *map(float, matrix[:3, 3] / unit), *map(float, quaternion(matrix))]
        lines.append(",".join([repr(numbers[0]), tool, *map(repr, numbers[1:])]))
    pathlib.Path(path).write_text("\n".join(lines) + "\n")
    return path


def looking(face, target, fan):
    """ProbeToWorld of a probe at a place that looks at another (scenes)."""
    z = numpy.subtract(target, face) / numpy.linalg.norm(numpy.subtract(target, face))
    x = numpy.asarray(fan, float) - z * numpy.dot(z, fan)
    x /= numpy.linalg.norm(x)
    matrix = numpy.eye(4)
    matrix[:3, 0], matrix[:3, 1], matrix[:3, 2], matrix[:3, 3] = x, numpy.cross(z, x), z, face
    return matrix


class HandEye(unittest.TestCase):
    """The way of dissertation 4.1.2: scans of the rig and the tracker's log give the calibration, which then places other scans."""

    @classmethod
    def setUpClass(cls):
        random = numpy.random.default_rng(4)
        views = [{"face": [0, 0, 0], "target": [0, 0, 80], "fan": [1, 0, 0]}]
        for i in range(5):
            angle = 2 * math.pi * i / 5
            tilt = 0.6 * math.sin(2.4 * i + 0.7)
            views.append({"face": [20 * math.cos(angle), 20 * math.sin(angle), 2 * math.sin(5 * i)], "target": [3 * math.sin(i), 2 * math.cos(i), 75],
                          "fan": [math.cos(tilt), math.sin(tilt), 0]})
        scene = {"schema": "echorama-scene-1", "name": "rig", "seed": 2,
                 "probe": {"preset": "mechanical-3d", "depthMaxMm": 115, "elements": 64, "sweepSteps": 40, "samples": 300},
                 "receiver": {"tgcDbPerCm": 0, "noiseDb": -45, "dynamicRangeDb": 70}, "background": "water",
                 "tissue": [{"rig": {"waterCelsius": 20, "plateDepthMm": 105}}], "views": {"poses": views},
                 "volume": {"spacingMm": 1.2, "knockMm": 8, "knockDegrees": 6}}
        (work / "rig.json").write_text(json.dumps(scene))
        run_json("synthesize", work / "rig.json", "-o", work / "rig")
        cls.volumes = [work / "rig" / f"volume_{i + 1}.mha" for i in range(6)]
        # Where the sensor was, with the noise of a good tracker: S = O M C^-1.
        cls.calibration, cls.world = pose([12, -35, -150], [0.1, -0.2, 1.9]), pose([300, -120, 80], [0.4, 0.9, -0.3])
        cls.probes = [looking(**view) for view in views]
        cls.sensor = [cls.world @ probe @ numpy.linalg.inv(cls.calibration) @ pose(random.normal(0, 0.3, 3), random.normal(0, 0.002, 3))
                      for probe in cls.probes]
        cls.log = write_log(work / "log.csv", "SensorToTracker", 10.0 * numpy.arange(6), cls.sensor)
        cls.told = run_json("calibrate", "hand-eye", "--volumes", *cls.volumes, "--tracker", cls.log, "-o", work / "calibration.json",
                            "--save-poses", work / "by_rig.json")

    def by_hand(self, *options):
        """Calibrated from the true poses of the volumes."""
        return run_json("calibrate", "hand-eye", "--volumes", *self.volumes, "--poses", work / "rig" / "truth.json", "-o", work / "by_hand.json",
                        *(() if "--tracker" in options else ("--tracker", self.log)), *options)

    def swaying(self, name, poses, sway, times, more=()):
        """A log in which the sensor is at each pose for 2 s about a moment, and meanwhile sways along the tracker's x axis, 2.5 times a
        second; at the moment itself it is off by the given mm."""
        clock, held = [], []
        for moment, matrix, mm in sorted(zip(times, poses, sway), key=lambda each: each[0]):
            for t in numpy.arange(-1, 1.001, 0.02):
                clock.append(moment + t)
                held.append(pose([mm * math.cos(2 * math.pi * 2.5 * t), 0, 0], [0, 0, 0]) @ matrix)
        path = write_log(work / name, "SensorToTracker", clock, held)
        with path.open("a") as file:
            file.writelines(line + "\n" for line in more)
        return path

    def error_of(self, matrix):
        target = numpy.append(self.told["report"]["target"], 1)
        return numpy.linalg.norm((numpy.asarray(matrix) - self.calibration) @ target)

    def test_the_calibration_is_found_with_its_error(self):
        report = self.told["report"]
        error = self.error_of(self.told["VolumeToSensor"])
        self.assertLess(error, 2.0)  # six scans that turn by some 30 degrees
        self.assertLess(error, 1.5 * report["target_radius95_mm"])  # 95% lie within 1, all but one in thousands within 1.5
        self.assertEqual(report["inliers"], 6)
        self.assertAlmostEqual(report["rig"]["depth_scale"], 1540 / 1482.4, delta=0.004)
        self.assertLess(run_json("score", work / "by_rig.json", "--truth", work / "rig" / "truth.json")["score_mm"], 1.2)  # a voxel
        self.assertGreaterEqual(min(report["rig"]["balls"]), 5)
        self.assertIn("degrees", report["advice"][0]["text"])

    def test_the_file_is_one_of_transforms(self):
        content = json.loads((work / "calibration.json").read_text())
        self.assertEqual(content["schema"], "echorama-transforms-1")
        self.assertEqual([(t["from"], t["to"]) for t in content["transforms"]], [("Volume", "Sensor"), ("World", "Tracker")])
        self.assertEqual(content["report"]["kind"], "hand-eye")
        self.assertEqual(content["report"], self.told["report"])
        self.assertIn("VolumeToSensor", run("info", work / "calibration.json").stdout)

    def test_align_refines_what_the_tracker_says(self):
        """The example of the README. A rig alone can be turned about the axis of the probe and looks the same: what the voxels do not
        determine must not be worse for it than the tracker left it."""
        log = write_log(work / "refined.csv", "SensorToTracker", [0, 1, 2], self.sensor[:3])
        scores = {}
        for name, options in (("tracked", ["--tracker-only"]), ("refined", ["--start", "tracked"])):
            done = run("align", *self.volumes[:3], "--tracker", log, "--calibration", work / "calibration.json", *options, "-o",
                       work / f"{name}_poses.json")
            self.assertIn(done.returncode, (0, 3), done.stderr)
            scores[name] = run_json("score", work / f"{name}_poses.json", "--truth", work / "rig" / "truth.json")["score_mm"]
        self.assertLess(scores["refined"], 1.5 * scores["tracked"], done.stdout)

    def test_the_tracker_alone_places_volumes(self):
        told = run_json("align", *self.volumes[:3], "--tracker", write_log(work / "three.csv", "SensorToTracker", [0, 1, 2], self.sensor[:3]),
                        "--calibration", work / "calibration.json", "--tracker-only", "-o", work / "tracked.json")
        score = run_json("score", work / "tracked.json", "--truth", work / "rig" / "truth.json")["score_mm"]
        self.assertLess(score, 2.0)
        self.assertEqual(len(told["volumes"]), 3)
        # What the knock made 8 mm and 6 degrees wrong is far better now.
        untouched = {"schema": "echorama-poses-1", "unit": "mm", "frame": "LPS",
                     "volumes": [{"file": str(v), "VolumeToWorld": numpy.eye(4).tolist()} for v in self.volumes[:3]]}
        (work / "untouched.json").write_text(json.dumps(untouched))
        self.assertLess(score, 0.3 * run_json("score", work / "untouched.json", "--truth", work / "rig" / "truth.json")["score_mm"])
        # The same out of a log in metres, of two tools, in another order, in which the sensor sways: by 5 mm to one side when the first
        # volume is made, to the other when the second is.
        metres = [matrix.copy() for matrix in self.sensor[:3]]
        for matrix in metres:
            matrix[:3, 3] /= 1000
        log = self.swaying("sways.csv", metres, [0.005, -0.005, 0], [20, 10, 0], ["5,StylusToTracker,0,0,0,1,0,0,0"])
        poses = {}
        for window in ((), ("--window", 0)):
            swaying = run_json("align", *self.volumes[:3], "--tracker", log, "--calibration", work / "calibration.json", "--tracker-only", "--tool",
                               "SensorToTracker", "--unit", 1000, "--at", 20, 10, 0, *window, "-o", work / "swaying.json")
            poses[bool(window)] = [numpy.array(volume["VolumeToWorld"]) for volume in swaying["volumes"]]
        for volume, averaged in zip(told["volumes"], poses[False]):
            numpy.testing.assert_allclose(averaged, volume["VolumeToWorld"], atol=0.1)
        self.assertAlmostEqual(numpy.linalg.norm((poses[True][1] - poses[False][1])[:3, 3]), 10, delta=0.1)
        self.assertAlmostEqual(numpy.linalg.norm((poses[True][2] - poses[False][2])[:3, 3]), 5, delta=0.1)

    def test_a_persons_alignment_will_do(self):
        self.by_hand()
        content = json.loads((work / "by_hand.json").read_text())
        self.assertLess(self.error_of(content["transforms"][0]["matrix"]), 1.5)
        self.assertNotIn("rig", content["report"])

    def test_the_error_is_that_of_the_noise_at_the_target(self):
        """Noise that is stated is used as it is, and twice the noise is twice the error; far away, turns count for more."""
        once = self.by_hand("--sensor-noise", 0.1, 0.3, "--volume-noise", 0.05, 0.2)["report"]
        self.assertEqual(once["noise"], {"sensor_degrees": 0.1, "sensor_mm": 0.3, "volume_degrees": 0.05, "volume_mm": 0.2, "estimated": False, "scale": 1})
        self.assertIsInstance(once["noise"]["scale"], int)  # whole numbers are printed as such, also those that were computed
        twice = self.by_hand("--sensor-noise", 0.2, 0.6, "--volume-noise", 0.1, 0.4)["report"]
        self.assertAlmostEqual(twice["target_rms_mm"] / once["target_rms_mm"], 2, places=6)
        far = self.by_hand("--sensor-noise", 0.1, 0.3, "--volume-noise", 0.05, 0.2, "--target", 0, 0, 550)["report"]
        self.assertEqual(far["target"], [0, 0, 550])
        self.assertGreater(far["target_rms_mm"], 1.5 * once["target_rms_mm"])

    def test_a_depth_scale_that_is_given_is_used(self):
        """For a scanner that is told the speed of sound in the bath, balls of this one lie 4% too near."""
        told = run_json("calibrate", "hand-eye", "--volumes", *self.volumes, "--tracker", self.log, "--depth-scale", 1, "--keep-all", "-o",
                        work / "scaled.json")["report"]["rig"]
        self.assertEqual((told["depth_scale"], told["depth_scale_error"]), (1, 0))
        self.assertGreater(min(told["rms_mm"]), max(self.told["report"]["rig"]["rms_mm"]))

    def test_the_window_averages_what_sways(self):
        """5 mm at the moment of each scan: without a window they are in the calibration, of the default one exp(-(w s)^2 / 2) = 0.7% is."""
        times = 10.0 * numpy.arange(6)
        log = self.swaying("sways.csv", self.sensor, [5] * 6, times)
        still, now, averaged = (self.by_hand(*options) for options in (
            (), ("--tracker", log, "--at", *times, "--window", 0), ("--tracker", log, "--at", *times)))
        for told, mm in ((now, 5), (averaged, 5 * math.exp(-(2 * math.pi * 2.5 * 0.2) ** 2 / 2))):
            off = numpy.subtract(told["WorldToTracker"], still["WorldToTracker"])
            numpy.testing.assert_allclose(off[:3, 3], [mm, 0, 0], atol=0.01)
            numpy.testing.assert_allclose(off[:, :3], 0, atol=1e-5)
            numpy.testing.assert_allclose(told["VolumeToSensor"], still["VolumeToSensor"], atol=0.01)

    def test_metres_are_told(self):
        metres = write_log(work / "metres.csv", "SensorToTracker", range(6), self.sensor, unit=1000.0)
        done = run("calibrate", "hand-eye", "--volumes", *self.volumes, "--tracker", metres, "--poses", work / "rig" / "truth.json", "-o",
                   work / "no.json")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr.lower(), "metre|1000")
        told = run_json("calibrate", "hand-eye", "--volumes", *self.volumes, "--tracker", metres, "--unit", 1000, "--poses",
                 work / "rig" / "truth.json", "-o", work / "metres.json")
        numpy.testing.assert_allclose(told["VolumeToSensor"], self.by_hand()["VolumeToSensor"], atol=1e-5)

    def test_a_bad_fifth_scan_is_left_out(self):
        sensor = [*self.sensor[:4], self.sensor[4] @ pose([30, 0, 0], [0.4, 0, 0])]
        told = run_json("calibrate", "hand-eye", "--volumes", *self.volumes[:5], "--tracker",
                        write_log(work / "fifth.csv", "SensorToTracker", range(5), sensor), "--poses", work / "rig" / "truth.json", "-o",
                        work / "fifth.json")
        self.assertEqual([scan["inlier"] for scan in told["report"]["scans"]], [True] * 4 + [False])
        self.assertFalse(told["report"]["noise"]["estimated"])
        # A less bad one of six can be kept, at a price.
        log = write_log(work / "sixth.csv", "SensorToTracker", range(6), [*self.sensor[:5], self.sensor[5] @ pose([8, 0, 0], [0.1, 0, 0])])
        without, kept = (self.by_hand("--tracker", log, *options)["report"] for options in ((), ("--keep-all",)))
        self.assertEqual((without["inliers"], kept["inliers"]), (5, 6))
        self.assertGreater(kept["rms_mm"], 3 * without["rms_mm"])

    def test_refusals_leave_nothing(self):
        before = snapshot(work)
        volumes, log = list(map(str, self.volumes)), str(self.log)
        five = write_log(work / "five.csv", "SensorToTracker", range(5), self.sensor[:5])
        for arguments, words in (
                ((["--volumes", *volumes[:2], "--tracker", write_log(work / "two.csv", "SensorToTracker", range(2), self.sensor[:2])]), "three"),
                ((["--volumes", *volumes, "--tracker", five]), "5 valid poses"),
                ((["--volumes", *volumes, "--tracker", log, "--at", "1", "2"]), "--at"),
                ((["--volumes", *volumes, "--tracker", log, "--tool", "Nothing"]), "SensorToTracker"),
                ((["--volumes", *volumes, "--tracker", work / "absent.csv"]), "absent.csv"),
                ((["--volumes", *volumes, "--tracker", log, "--rig", "9"]), "Scale is 9; it must be in [0.2, 5]"),
                ((["--volumes", *volumes, "--tracker", log, "--rig", log]), "label"),
                ((["--volumes", *volumes, "--tracker", log, "--align", "contents", "--rig", "1"]), "--rig: it says nothing with --align contents"),
                ((["--volumes", *volumes, "--tracker", log, "--align", "contents", "--depth-scale", "1.04"]), "--depth-scale: it says nothing"),
                ((["--volumes", *volumes, "--tracker", log, "--align", "rig", "--start", "tracked"]), "--start: it says nothing")):
            aligned = [] if {"--rig", "--align"} & set(arguments) else ["--poses", work / "rig" / "truth.json"]
            done = run("calibrate", "hand-eye", *arguments, *aligned, "-o", work / "refused.json")
            self.assertIn(done.returncode, (1, 2), words)
            self.assertIn(words, done.stderr)
        for name in ("two.csv", "five.csv"):
            (work / name).unlink()
        self.assertEqual(before.keys(), snapshot(work).keys())
        done = run("calibrate", "hand-eye", "--volumes", *volumes, "--tracker", log, "--poses", work / "rig" / "truth.json", "--save-poses",
                   work / "same.json", "-o", work / "same.json")
        self.assertEqual(done.returncode, 2)
        done = run("align", *volumes, "--tracker", log, "-o", work / "refused.json")
        self.assertEqual(done.returncode, 2)
        self.assertIn("--calibration", done.stderr)
        for option in (["--tool", "SensorToTracker"], ["--at", *range(6)]):
            done = run("align", *volumes, "-o", work / "refused.json", *option)
            self.assertEqual(done.returncode, 2, option)
            self.assertIn("--tracker", done.stderr)
        table = work / "balls.csv"
        table.write_text("\ufefflabel,x,y,z,radius\nA,1,2,3,wide\n", encoding="utf-8")  # as spreadsheets write it
        done = run("calibrate", "hand-eye", "--volumes", *volumes, "--tracker", log, "--rig", table, "-o", work / "refused.json")
        self.assertEqual(done.returncode, 1)
        self.assertIn('line 2: "wide" is no number for radius', done.stderr)
        table.write_text("label,x,y,z,radius\n")
        done = run("calibrate", "hand-eye", "--volumes", *volumes, "--tracker", log, "--rig", table, "-o", table)
        self.assertEqual(done.returncode, 1)
        self.assertIn("inputs are never overwritten", done.stderr)
        self.assertEqual(table.read_text(), "label,x,y,z,radius\n")


    def test_at_says_when_each_was_made(self):
        common = ["--tracker", self.log, "--poses", work / "rig" / "truth.json", "-o", work / "at.json"]
        told = run_json("calibrate", "hand-eye", "--volumes", *self.volumes, *common)
        back = run_json("calibrate", "hand-eye", "--volumes", *self.volumes[::-1], "--at", *range(50, -10, -10), *common)
        numpy.testing.assert_allclose(back["VolumeToSensor"], told["VolumeToSensor"], atol=1e-3)


class Contents(unittest.TestCase):
    """Three volumes of a texture that is known everywhere, with noise of their own, turned by up to 24 degrees against each other; and a
    tracked probe. Their files say nothing of where they belong."""

    @classmethod
    def setUpClass(cls):
        random = numpy.random.default_rng(11)
        waves = random.normal(size=(60, 3))
        waves *= (2 * math.pi / random.uniform(12, 60, 60) / numpy.linalg.norm(waves, axis=1))[:, None]
        phases = random.uniform(0, 2 * math.pi, 60)
        count, spacing = 30, 3
        places = numpy.stack(numpy.meshgrid(*3 * [spacing * (numpy.arange(count) - (count - 1) / 2)], indexing="ij")[::-1], axis=-1)
        cls.truth = [numpy.eye(4), pose([12, -6, 4], [0.15, 0, 0.05]), pose([-9, 8, 10], [0, 0.4, -0.1])]
        cls.volumes = [work / f"texture_{i + 1}.mha" for i in range(3)]
        for path, matrix in zip(cls.volumes, cls.truth):
            seen = 128 + 8 * numpy.cos((places @ matrix[:3, :3].T + matrix[:3, 3]) @ waves.T + phases).sum(axis=-1)
            write_mha(path, (seen + random.normal(0, 10, seen.shape)).clip(1, 255).astype("u1"), spacing=[spacing] * 3,
                      origin=[-spacing * (count - 1) / 2] * 3)
        write_poses(work / "texture.json", cls.volumes, cls.truth)
        cls.calibration, cls.world = pose([12, -35, -150], [0.1, -0.2, 1.9]), pose([300, -120, 80], [0.4, 0.9, -0.3])

    def track(self, name, poses):
        return write_log(work / name, "SensorToTracker", range(3), [self.world @ matrix @ numpy.linalg.inv(self.calibration) for matrix in poses])

    def test_align_refines_what_the_tracker_says(self):
        """A tracker that is off by 2 mm and as many degrees: what the volumes show takes that back."""
        off = [matrix @ pose(1.15 * numpy.array(way), 0.02 * numpy.array(way))
               for matrix, way in zip(self.truth, ([0, 0, 0], [1, 1, 1], [1, -1, 1]))]
        (work / "known.json").write_text(json.dumps({
            "schema": "echorama-transforms-1", "unit": "mm",
            "transforms": [{"from": "Volume", "to": "Sensor", "matrix": self.calibration.tolist()}]}))
        scores = {}
        for name, option in (("tracked", ["--tracker-only"]), ("refined", ["--start", "tracked", "--points", "4000"])):
            run_json("align", *self.volumes, "--tracker", self.track("off.csv", off), "--calibration", work / "known.json", *option, "-o",
                     work / f"texture_{name}.json")
            scores[name] = run_json("score", work / f"texture_{name}.json", "--truth", work / "texture.json")["score_mm"]
        self.assertTrue(1.5 < scores["tracked"] < 3, scores)
        self.assertLess(scores["refined"], 0.5)  # a sixth of a voxel

    def test_scans_without_a_rig_are_aligned_by_what_they_show(self):
        """From a start that is 24 degrees off; tracked searches 12, and so one of the three is left out."""
        def calibrate(*options):
            return run("calibrate", "hand-eye", "--volumes", *self.volumes, "--tracker", self.track("texture.csv", self.truth), "-o",
                       work / "by_contents.json", "--save-poses", work / "by_contents_poses.json", "--json", *options)

        done = calibrate("--align", "contents", "--start", "hand-made")
        self.assertEqual(done.returncode, 0, done.stderr)
        told = json.loads(done.stdout)
        self.assertEqual(told["report"]["inliers"], 3)
        self.assertNotIn("rig", told["report"])
        self.assertLess(run_json("score", work / "by_contents_poses.json", "--truth", work / "texture.json")["score_mm"], 0.5)
        target = numpy.append(told["report"]["target"], 1)
        self.assertLess(numpy.linalg.norm((numpy.array(told["VolumeToSensor"]) - self.calibration) @ target), 3)  # three scans, 9 and 24 degrees
        for options, words in ((["--align", "contents", "--start", "tracked"], "there are 2"), ([], "the rig was found in no volume")):
            done = calibrate(*options)
            self.assertEqual(done.returncode, 1)
            self.assertIn(words, done.stderr)

    def test_what_parameters_of_the_alignment_do(self):
        """Two volumes that overlap by 91%, quickly."""
        def aligned(*settings, start="tracked", points="2000"):
            done = run("align", *self.volumes[:2], "--start", start, "--points", points, *settings,
                       "-o", work / "set.json", "--json")
            told = json.loads(done.stdout)
            self.assertEqual(done.returncode, 0 if told["verdict"] == "aligned" else 3, done.stderr)
            return told["volumes"][1], told["pairs"][0]

        plain = aligned()
        self.assertEqual(plain[0]["verdict"], "aligned")
        for setting, verdict, words in (("--minimum-overlap=0.97", "failed", "overlap by 97%"), ("--minimum-similarity=1", "failed", "more similar"),
                                        ("--maximum-error-voxels=0.001", "ambiguous", "predicted error"),
                                        ("--maximum-split-voxels=0.001", "failed", "two halves")):
            volume, _ = aligned(setting)
            self.assertEqual(volume["verdict"], verdict, setting)
            self.assertIn(words, volume["reason"], setting)
            if verdict == "failed":
                self.assertEqual(volume["VolumeToWorld"], numpy.eye(4).tolist(), setting)
        # Other points, other weights and other voxels find the same place, and other digits of it.
        found = [plain[0]["VolumeToWorld"]]
        for volume, _ in (aligned("--seed=7"), aligned(points="4000"), aligned("--no-use-reliability"), aligned("--finest-mm=6")):
            numpy.testing.assert_allclose(volume["VolumeToWorld"], plain[0]["VolumeToWorld"], atol=0.5)
            found.append(volume["VolumeToWorld"])
        self.assertEqual(len(set(map(json.dumps, found))), 5)
        # Within 35 degrees there is a second place that fits, with a third of the evidence; a single candidate has no rival.
        ratio = aligned(start="hand-made")[1]["peak_ratio"]
        self.assertTrue(1.5 < ratio < 10, ratio)
        self.assertEqual(aligned("--candidates=1", start="hand-made")[1]["peak_ratio"], 99)
        volume, _ = aligned(f"--minimum-peak-ratio={ratio + 5}", start="hand-made")
        self.assertEqual(volume["verdict"], "ambiguous")
        self.assertIn("a different pose fits nearly as well", volume["reason"])


class Pivot(unittest.TestCase):
    def test_the_tip(self):
        random = numpy.random.default_rng(1)
        tip, fixed = numpy.array([3.0, -5.0, 120.0]), numpy.array([10.0, 20.0, -80.0])
        poses = []
        for _ in range(60):
            matrix = pose([0, 0, 0], random.normal(0, 0.4, 3))
            matrix[:3, 3] = fixed - matrix[:3, :3] @ tip + random.normal(0, 0.2, 3)
            poses.append(matrix)
        log = write_log(work / "pivot.csv", "StylusToTracker", range(60), poses)
        told = run_json("calibrate", "pivot", "--tracker", log, "-o", work / "pivot.json")
        self.assertLess(numpy.linalg.norm(numpy.subtract(told["report"]["tip"], tip)), 0.3)
        self.assertLess(told["report"]["tip_radius95_mm"], 0.25)
        content = json.loads((work / "pivot.json").read_text())["transforms"][0]
        self.assertEqual((content["from"], content["to"]), ("StylusTip", "Stylus"))
        numpy.testing.assert_allclose(content["matrix"], pose(told["report"]["tip"], [0, 0, 0]), atol=1e-9)
        # A tip that slipped away three times, and the tracker's noise as it is stated.
        for matrix in poses[7::20]:
            matrix[:3, 3] += [15, 0, 0]
        slipped = ["calibrate", "pivot", "--tracker", write_log(work / "slipped.csv", "StylusToTracker", range(60), poses), "-o",
                   work / "slipped.json"]
        rejected, kept = (run_json(*slipped, *options)["report"] for options in ((), ("--keep-all",)))
        self.assertEqual((rejected["inliers"], kept["inliers"], kept["poses"]), (57, 60, 60))
        self.assertLess(rejected["rms_mm"], 0.5)
        self.assertAlmostEqual(kept["rms_mm"], math.sqrt(3 * 15**2 / 60), delta=0.2)  # 15 mm in three of sixty
        once, twice = (run_json(*slipped, "--noise", degrees, mm)["report"]["tip_rms_mm"] for degrees, mm in ((0.05, 0.2), (0.1, 0.4)))
        self.assertAlmostEqual(twice / once, 2, places=4)
        some = run_json(*slipped, "--from", 10, "--to", 39, "--unit", 10)["report"]
        self.assertEqual(some["poses"], 30)
        self.assertLess(numpy.linalg.norm(numpy.subtract(some["tip"], 10 * tip)), 5)
        done = run("calibrate", "pivot", "--tracker", write_log(work / "still.csv", "StylusToTracker", range(20), poses[:1] * 20), "-o",
                   work / "still.json")
        self.assertEqual(done.returncode, 1)
        self.assertFalse((work / "still.json").exists())

    @unittest.skipUnless(PLUS.is_dir(), f"{PLUS} is not there")
    def test_a_stylus_of_plus(self):
        sequence = PLUS / "EightLandmarkPointsTrackedForPhantomRegistration.igs.mha"
        tips = [run_json("calibrate", "pivot", "--tracker", sequence, "--tool", "StylusToReference", "--from", start, "--to", start + 4, "-o",
                         work / "stylus.json")["report"]["tip"] for start in (300, 330)]
        self.assertLess(numpy.linalg.norm(numpy.subtract(*tips)), 1.0)
        done = run("calibrate", "pivot", "--tracker", sequence, "--tool", "StylusToReference", "-o", work / "none.json")
        self.assertEqual(done.returncode, 1)  # it touches eight points, not one
        self.assertIn("fixed point", done.stderr)


class Temporal(unittest.TestCase):
    def test_the_offset(self):
        def vector(t):
            return [0.6 * math.sin(1.1 * t) + 0.2 * math.sin(4.3 * t), 0.5 * math.sin(0.12 * t * t), 0.4 * math.sin(0.5 * t)]

        def smooth(t):
            return pose([30 * math.sin(0.9 * t), 20 * math.cos(1.7 * t), 5 * t], vector(t))

        hand = pose([10, 0, 40], [0.2, 0.4, 0.1])
        first, second = numpy.arange(0, 20, 0.02), numpy.arange(0.5, 18, 0.033)
        a = write_log(work / "a.csv", "ProbeToTracker", first, [smooth(t) for t in first])
        b = write_log(work / "b.csv", "MarkerToCamera", second - 0.137, [pose([1, 2, 3], [0.3, 0, 0]) @ smooth(t) @ hand for t in second])
        told = run_json("calibrate", "temporal", a, b, "-o", work / "offset.json")
        self.assertAlmostEqual(told["offset_seconds"], 0.137, delta=0.001)
        self.assertEqual(told["signal"], "rotation")
        self.assertEqual(json.loads((work / "offset.json").read_text())["offset_seconds"], told["offset_seconds"])
        self.assertEqual(run("calibrate", "temporal", a, b, "--largest", 0.1).returncode, 1)
        # Two tools in one file, of which one turns as the first recording does and goes where that went half a second later.
        lines = b.read_text().splitlines() + write_log(work / "d.csv", "StylusToCamera", second - 0.137, [
            pose(smooth(t + 0.5)[:3, 3], [0, 0, 0]) @ pose([0, 0, 0], vector(t)) for t in second]).read_text().splitlines()[1:]
        (work / "d.csv").write_text("\n".join(lines) + "\n")
        for signal, offset in (("rotation", 0.137), ("translation", 0.637)):
            told = run_json("calibrate", "temporal", a, work / "d.csv", "--second-tool", "StylusToCamera", "--signal", signal)
            self.assertEqual(told["signal"], signal)
            self.assertAlmostEqual(told["offset_seconds"], offset, delta=0.002, msg=signal)
        told = run_json("calibrate", "temporal", work / "d.csv", a, "--tool", "MarkerToCamera")
        self.assertAlmostEqual(told["offset_seconds"], -0.137, delta=0.001)
        still = write_log(work / "c.csv", "ProbeToTracker", first, [smooth(0)] * len(first))
        done = run("calibrate", "temporal", a, still)
        self.assertEqual(done.returncode, 1)


def corners_of(path):
    """Of the triangles of a binary STL file."""
    triangles = numpy.frombuffer(path.read_bytes()[84:], [("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("more", "<u2")])
    return triangles["corner"].reshape(-1, 3)


class Rig(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.told = run_json("calibrate", "rig", "-o", work / "prints", "--scale", 0.6, "--resolution", 1)

    def test_prints_and_scenes(self):
        told = self.told
        names = {path.name for path in (work / "prints").iterdir()}
        self.assertEqual(names, {"rig_0.6.stl", "rig_0.6.json", "rig_0.6.csv", "clip.stl"})
        count = int.from_bytes((work / "prints" / "clip.stl").read_bytes()[80:84], "little")
        self.assertEqual((work / "prints" / "clip.stl").stat().st_size, 84 + 50 * count)
        self.assertEqual(told["rigs"][0]["scale"], 0.6)
        rows = list(csv.DictReader((work / "prints" / "rig_0.6.csv").read_text().splitlines()))
        self.assertAlmostEqual(float(rows[0]["radius"]), 4 * 0.6)
        corners = corners_of(work / "prints" / "rig_0.6.stl")
        span = numpy.ptp([[float(row["x"]), float(row["y"])] for row in rows], axis=0)
        numpy.testing.assert_allclose(numpy.ptp(corners, axis=0)[:2], span + 12, atol=0.1)  # the base reaches 6 mm beyond the balls' centres
        done = run("synthesize", work / "prints" / "rig_0.6.json", "-o", work / "small", "--spacing", 3)
        self.assertEqual(done.returncode, 0, done.stderr)
        refused = run("calibrate", "rig", "-o", work / "huge", "--scale", 7).stderr
        self.assertIn("scale", refused)
        self.assertIn("see echorama calibrate rig --help", refused)

    def test_the_clip_fits_what_was_measured(self):
        """A handle of 40 x 32 mm instead of 30 x 22, and so on: its sleeve, its arm and its pocket change by as much."""
        def sizes(folder):
            corners = corners_of(folder / "clip.stl")
            sleeve, pocket = corners[corners[:, 2] < 30], corners[corners[:, 2] > corners[:, 2].max() - 10]
            return numpy.array([numpy.ptp(sleeve[:, 0]), numpy.ptp(pocket[:, 0]), -corners[:, 1].min(), corners[:, 2].max()])

        run_json("calibrate", "rig", "-o", work / "fitted", "--scale", 0.6, "--resolution", 1, "--handle", 40, 32, "--clearance", 2.4, "--sensor",
                 18.2, 13.2, 30, "--arm", 100, "--water", 37)
        # Both walls of the sleeve; the pocket; from the axis: half the handle, the clearance, the sensor; half the sensor and the arm.
        numpy.testing.assert_allclose(sizes(work / "fitted") - sizes(work / "prints"), [10 + 2 * 2, 10, 5 + 2 + 5, 30 + 10 / 2], atol=0.3)
        water = [json.loads((work / name / "rig_0.6.json").read_text())["tissue"][0]["rig"]["waterCelsius"] for name in ("prints", "fitted")]
        self.assertEqual(water, [20, 37])


class Motion(unittest.TestCase):
    def test_a_recording_becomes_a_path(self):
        times = numpy.sort(numpy.random.default_rng(2).uniform(0, 5, 200))
        log = write_log(work / "motion.csv", "ProbeToTracker", times, [pose([10 * t, 0, 0], [0, 0, 0.1 * t]) for t in times])
        told = run_json("motion", log, "-o", work / "path.igs.mha", "--rate", 40)
        self.assertEqual(told["poses"], int(40 * (times[-1] - times[0])) + 1)
        self.assertEqual(told["missing"], 0)
        self.assertAlmostEqual(told["path_mm"], 10 * (told["poses"] - 1) / 40, places=6)
        info = run_json("info", work / "path.igs.mha")["files"][0]["transforms"]["ProbeToTracker"]
        lasts = times[-1] - times[0]
        self.assertEqual(info["statuses"], {"OK": told["poses"]})
        self.assertAlmostEqual(info["moves_mm"], 10 * lasts, delta=10 / 40)  # all but a part of a step
        self.assertAlmostEqual(info["turns_degrees"], math.degrees(0.1 * lasts), delta=math.degrees(0.1 / 40))
        header = (work / "path.igs.mha").read_bytes().split(b"ElementDataFile")[0].decode()
        first = numpy.array(re.search("Seq_Frame0000_ProbeToTrackerTransform = (.*)", header)[1].split(), float).reshape(4, 4)
        numpy.testing.assert_allclose(first, pose([10 * times[0], 0, 0], [0, 0, 0.1 * times[0]]), atol=1e-6)
        self.assertEqual(run("motion", log, "-o", work / "path.txt").returncode, 2)

    def test_smoothing_gaps_and_the_part_that_is_wanted(self):
        """10 mm/s, swaying by 5 mm and 0.2 rad: of that, smoothing leaves exp(-(w s)^2 / 2)."""
        pulse = 2 * math.pi * 2.5

        def place(t):
            sway = math.cos(pulse * t)
            return pose([10 * t + 5 * sway, 0, 0], [0, 0, 0.2 * sway])

        times = numpy.arange(0, 4.001, 0.01)
        log = write_log(work / "sway.csv", "ProbeToTracker", times, [place(t) for t in times])
        for smooth in (0, 0.05):
            run_json("motion", log, "-o", work / "smooth.igs.mha", "--smooth", smooth, "--rate", 100)
            header = (work / "smooth.igs.mha").read_bytes().split(b"ElementDataFile")[0].decode()
            clock = numpy.array(re.findall("Timestamp = (.*)", header), float)
            poses = numpy.array([line.split() for line in re.findall("ProbeToTrackerTransform = (.*)", header)], float).reshape(-1, 4, 4)
            middle = (clock > 1) & (clock < 2.999)  # five times to and fro
            left = [2 * (part[middle] * numpy.cos(pulse * clock[middle])).mean()
                    for part in (poses[:, 0, 3] - 10 * clock, numpy.arctan2(poses[:, 1, 0], poses[:, 0, 0]))]
            numpy.testing.assert_allclose(left, numpy.array([5, 0.2]) * math.exp(-(pulse * smooth) ** 2 / 2), rtol=0.01)
        # From 1.5 to 1.8 s there is nothing: the poses between are missing, unless so long a gap is bridged.
        with_gap = [t for t in times if not 1.505 < t < 1.795]
        log = write_log(work / "gap.csv", "ProbeToTracker", with_gap, [place(t) for t in with_gap])
        for gap, missing in ((0.2, 14), (0.31, 0)):  # at 1.52, 1.54, ... 1.78 s
            told = run_json("motion", log, "-o", work / "gap.igs.mha", "--gap", gap)
            self.assertEqual((told["poses"], told["missing"]), (201, missing))
        told = run_json("motion", log, "-o", work / "part.igs.mha", "--from", 1, "--to", 1.2, "--smooth", 0)
        self.assertEqual((told["poses"], told["lasts_seconds"]), (11, 1.2 - 1))
        # One tool of two, in metres.
        lines = log.read_text().splitlines()
        lines += [line.replace("ProbeToTracker", "StylusToTracker") for line in lines[1::2]]
        (work / "two.csv").write_text("\n".join(lines) + "\n")
        self.assertIn("--tool", run("motion", work / "two.csv", "-o", work / "no.igs.mha").stderr)
        told, metres = (run_json("motion", work / "two.csv", "-o", work / "two.igs.mha", "--tool", "StylusToTracker", *unit)
                        for unit in ((), ("--unit", 1000)))
        self.assertEqual(told["tool"], "StylusToTracker")
        self.assertAlmostEqual(metres["path_mm"] / told["path_mm"], 1000, places=6)

    @unittest.skipUnless((DATA / "aurora").is_dir(), f"{DATA / 'aurora'} is not there")
    def test_a_log_of_an_aurora(self):
        told = run_json("motion", next((DATA / "aurora").glob("*.csv")), "--tool", "SensorAToTracker", "-o", work / "aurora.igs.mha")
        self.assertGreater(told["poses"], 100)


class Track(unittest.TestCase):
    def test_simulated_and_replayed(self):
        told = run_json("track", "simulated:?rate=80", "--seconds", 1, "--record", work / "recorded.igs.mha")
        recorded = sum(tool["valid"] + tool["missing"] + tool["out_of_range"] for tool in told["tools"])
        self.assertEqual(told["recording"]["poses"], recorded)
        self.assertEqual(told["recording"]["lost"], 0)
        self.assertGreater(recorded, 40)
        again = run_json("track", f"replay:{work / 'recorded.igs.mha'}?speed=0")
        self.assertEqual(again["state"], "ended")
        self.assertLessEqual(abs(sum(tool["valid"] + tool["missing"] + tool["out_of_range"] for tool in again["tools"]) - recorded), 4)
        self.assertEqual(run_json("track", work / "recorded.igs.mha")["state"], "ended")  # a file is a recording
        # A recording is never replaced, and nothing that was there goes.
        before = (work / "recorded.igs.mha").read_bytes()
        done = run("track", "simulated:", "--seconds", 0.5, "--record", work / "recorded.igs.mha")
        self.assertEqual(done.returncode, 1)
        self.assertIn("recorded.igs.mha", done.stderr)
        self.assertEqual((work / "recorded.igs.mha").read_bytes(), before)

    def test_what_is_shown_meanwhile(self):
        """Every fifth of a second: a frame that a fixed transform puts 50 mm from the probe, and the probe."""
        matrix = numpy.eye(4)
        matrix[:3, 3] = 30, 0, 40
        write_plus(work / "fixed.xml", [("Volume", "Probe", matrix, "")])
        done = run("track", "simulated:?rate=5", "--seconds", 1.5, "--every", 0.2, "--transforms", work / "fixed.xml", "--show", "VolumeToTracker",
                   "--show", "ProbeToTracker")
        self.assertEqual(done.returncode, 0, done.stderr)
        seen = {name: numpy.array([line.split() for line in re.findall(rf"{name}ToTracker: OK  (.*) mm", done.stderr)], float)
                for name in ("Volume", "Probe")}
        self.assertTrue(5 <= len(seen["Probe"]) <= 8, done.stderr)
        self.assertAlmostEqual(numpy.median(numpy.linalg.norm(seen["Volume"] - seen["Probe"], axis=1)), 50, delta=0.05)

    def test_a_tracker_that_is_gone_is_not_shown_as_live(self):
        begun = time.monotonic()
        done = run("track", "simulated:?rate=50&unplugAfter=0.7", "--seconds", 2.6, "--every", 0.2)
        took = time.monotonic() - begun
        shown = [line for line in done.stderr.splitlines() if line.startswith("ProbeToTracker: ")]
        self.assertIn("OK", shown[0])
        gone = re.search(r"MISSING  came last (\d+\.\d) s ago$", shown[-1])
        self.assertTrue(gone, shown[-1])
        self.assertTrue(1 <= float(gone[1]) <= took - 0.5, f"{shown[-1]}; the run took {took:.1f} s")
        self.assertNotIn("Hz", shown[-1])
        self.assertIn("lost", done.stderr)

    def test_nobody_answers(self):
        done = run("track", "igtl://127.0.0.1:1", "--seconds", 1, "--record", work / "nothing.igs.mha")
        self.assertEqual(done.returncode, 1)
        self.assertIn("refused", done.stderr.lower())
        self.assertFalse((work / "nothing.igs.mha").exists())

    def test_passed_on_over_openigtlink(self):
        server = subprocess.Popen([PROGRAM, "track", "simulated:?rate=60", "--serve", "0", "--every", "3600"], stdout=subprocess.PIPE,
                                  stderr=subprocess.PIPE, text=True)
        try:
            line = server.stderr.readline()
            self.assertIn("serving", line)
            port = line.strip().rsplit(":", 1)[1]
            told = run_json("track", f"igtl://127.0.0.1:{port}", "--seconds", 2, "--show", "ProbeToReference")
            self.assertEqual({tool["name"] for tool in told["tools"]}, {"ProbeToTracker", "ReferenceToTracker"})
            self.assertGreater(told["tools"][0]["valid"], 30)
        finally:
            server.send_signal(signal.SIGINT)
            out, _ = server.communicate(timeout=20)
        self.assertEqual(server.returncode, 0)  # how a live tracker is ended is no error
        self.assertIn("poses", out)

    def test_a_killed_recording_opens(self):
        path = work / "killed.igs.mha"
        recorder = subprocess.Popen([PROGRAM, "track", "simulated:?rate=100", "--record", path, "--every", "3600"], stdout=subprocess.DEVNULL,
                                    stderr=subprocess.DEVNULL)
        started = time.monotonic()
        while time.monotonic() - started < 60 and not (path.exists() and path.stat().st_size > 200000):
            time.sleep(0.05)
        recorder.kill()
        recorder.wait()
        told = run_json("track", f"replay:{path}?speed=0")
        self.assertGreater(told["tools"][0]["valid"], 100)

    def test_what_is_refused(self):
        for address, words in (("nothing:", "there is no tracker"), ("simulated:?rat=3", "rate"), ("replay:absent.mha", "absent.mha"),
                               ("polhemus:/dev/absent", "/dev/absent"), ("just text", "SCHEME:PLACE")):
            done = run("track", address, "--seconds", 0.5)
            self.assertIn(done.returncode, (1, 2), address)
            self.assertIn(words, done.stderr, address)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        unittest.main()
