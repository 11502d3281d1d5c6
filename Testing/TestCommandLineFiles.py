#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""info and convert on every kind of file: volumes of all formats, beams, time series, tracked sequences, transforms."""
import json
import pathlib
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest
import zlib

import numpy

from program_under_test import PLUS, SOURCE, blobs, read_mha, read_sequence, run, run_json, turned, write_mha, write_plus, write_poses, write_sequence

work = None  # a folder for all tests


def setUpModule():
    global work
    work = pathlib.Path(tempfile.mkdtemp())
    subprocess.run([sys.executable, SOURCE / "Readers" / "Fuzzing" / "SeedsKretz.py", work], check=True)


def tearDownModule():
    shutil.rmtree(work)


def tracked(frames=5, size=(6, 7)):
    """Pixels [frame, y, x] and, per frame, its transforms: a probe that moves and is lost once, and a reference that rests."""
    pixels = numpy.random.default_rng(3).integers(0, 255, (frames, *size), "u1")
    transforms = []
    for i in range(frames):
        probe = numpy.eye(4)
        probe[:3, :3], probe[:3, 3] = turned(3 * i, 1), (1.5 * i, -2, 30)
        transforms.append({"ProbeToTracker": (probe, "INVALID" if i == 3 else "OK"), "ReferenceToTracker": (numpy.eye(4), "OK")})
    return pixels, transforms


class Volumes(unittest.TestCase):
    def test_formats_by_content(self):
        """The name of a file does not say what it is."""
        write_mha(work / "volume.mha", blobs((5, 6, 7)))
        for extension, name in (("mha", "MetaImage"), ("nrrd", "NRRD"), ("vti", "VTK XML image"), ("nii", "NIfTI"), ("nii.gz", "NIfTI"),
                                ("vdb", "OpenVDB")):
            path = work / f"format.{extension}"
            done = run("convert", work / "volume.mha", path)
            self.assertEqual(done.returncode, 0, done.stderr)
            told = run_json("info", path)["files"][0]
            self.assertEqual((told["kind"], told["format"], told["dimensions"]), ("volume", name, [7, 6, 5]))
            self.assertIn(name, run("info", path).stdout)
            anonymous = work / "anonymous"
            shutil.copy(path, anonymous)
            self.assertEqual(run_json("info", anonymous)["files"][0]["format"], name)

    def test_beams(self):
        told = run_json("info", work / "even")["files"][0]
        self.assertEqual(told["format"], "GE Kretz")
        self.assertEqual(told["beams"]["dimensions"], [4, 3, 2])
        self.assertAlmostEqual(told["beams"]["probe"]["fan_degrees"], numpy.degrees(0.2), places=6)
        self.assertEqual(told["acquisition"]["ProbeGeometry"], told["beams"]["probe"])
        self.assertIn("4 samples x 3 beams x 2 planes", run("info", work / "even").stdout)
        for spacing in (0.5, 1.0):
            run_json("convert", work / "even", work / "even.mha", "--spacing", spacing)
            self.assertEqual(run_json("info", work / "even.mha")["files"][0]["spacing"], [spacing] * 3)
        run_json("convert", work / "even", work / "beams.nrrd", "--beams")
        beams = run_json("info", work / "beams.nrrd")["files"][0]
        self.assertEqual((beams["dimensions"], beams["range"]), ([4, 3, 2], [0, 23]))
        self.assertEqual(beams["acquisition"]["ProbeGeometry"], told["beams"]["probe"])

    def test_time_series(self):
        told = run_json("info", work / "movie")["files"][0]
        self.assertEqual(told["times"], [0, 0.1])
        self.assertIn("2, from 0.000 to 0.100 s", run("info", work / "movie").stdout)
        for step in (0, 1):
            done = run("convert", work / "movie", work / "step.mha", "--time", step)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn(f"step {step} of 2", done.stderr)
            self.assertEqual(run_json("info", work / "step.mha")["files"][0]["acquisition"].get("TimeStamp"), 0.1 * step)

    def test_a_stack_of_pictures(self):
        """PNG files in a folder, which do not say their spacing."""
        voxels = blobs((3, 4, 5))
        (work / "stack").mkdir()
        for z, slice_ in enumerate(voxels):
            rows = b"".join(b"\0" + row.tobytes() for row in slice_)
            chunks = [(b"IHDR", struct.pack(">IIBBBBB", 5, 4, 8, 0, 0, 0, 0)), (b"IDAT", zlib.compress(rows)), (b"IEND", b"")]
            (work / "stack" / f"{z:03}.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(
                struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks))
        self.assertEqual(run_json("info", work / "stack")["files"][0]["format"], "stack of pictures")
        run_json("convert", work / "stack", work / "stacked.mha", "--stack-spacing", 0.25, 0.5, 2)
        header, read = read_mha(work / "stacked.mha")
        numpy.testing.assert_array_equal(read, voxels)
        self.assertEqual([float(n) for n in header["ElementSpacing"].split()], [0.25, 0.5, 2])

    def test_stride(self):
        voxels = blobs((5, 6, 7))
        write_mha(work / "large.mha", voxels)
        run_json("convert", work / "large.mha", work / "coarse.mha", "--stride", 3)
        header, read = read_mha(work / "coarse.mha")
        numpy.testing.assert_array_equal(read, voxels[::3, ::3, ::3])
        spacing = [float(n) for n in read_mha(work / "large.mha")[0]["ElementSpacing"].split()]
        numpy.testing.assert_allclose([float(n) for n in header["ElementSpacing"].split()], [3 * n for n in spacing])

    def test_header(self):
        write_mha(work / "fields.mha", blobs((5, 6, 7)), header={"Operator": "nobody", "Comment": "x" * 200})
        told = run_json("info", work / "fields.mha")["files"][0]["fields"]
        self.assertEqual((told["Operator"], told["Comment"]), ("nobody", "x" * 200))
        self.assertIn("Operator = nobody", run("info", work / "fields.mha").stdout)


class Sequences(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.pixels, cls.transforms = tracked()
        cls.path = work / "tracked.igs.mha"
        write_sequence(cls.path, cls.pixels, cls.transforms, times=[10, 10.1, 10.2, 10.3, 10.4], images=["OK"] * 4 + ["INVALID"],
                       header={"Operator": "nobody"})

    def test_info(self):
        told = run_json("info", self.path)["files"][0]
        self.assertEqual((told["kind"], told["format"], told["frames"], told["dimensions"]), ("sequence", "MetaImage", 5, [7, 6, 1]))
        self.assertEqual((told["orientation"], told["valid_images"], told["invalid_images"]), ("MF", 4, 1))
        self.assertEqual(told["transforms"]["ProbeToTracker"]["statuses"], {"OK": 4, "INVALID": 1})
        self.assertAlmostEqual(told["transforms"]["ProbeToTracker"]["moves_mm"], 6)  # the lost place does not count
        self.assertAlmostEqual(told["transforms"]["ProbeToTracker"]["turns_degrees"], 12)
        self.assertEqual(told["transforms"]["ReferenceToTracker"], {"statuses": {"OK": 5}, "moves_mm": 0, "turns_degrees": 0})
        self.assertAlmostEqual(told["time"]["frames_per_second"], 10)
        self.assertEqual(told["fields"]["Operator"], "nobody")
        text = run("info", self.path).stdout
        for words in ("5 of 7 x 6, unsigned char", "MF", "4 valid, 1 invalid", "10.000 to 10.400 s, 10.00 frames a second",
                      "ProbeToTracker: 4 OK, 1 INVALID; moves within 6.0 mm, turns by up to 12.0 degrees", "Operator = nobody"):
            self.assertIn(words, text)

    def test_trackers_alone(self):
        path = work / "trackers.igs.mha"
        write_sequence(path, numpy.zeros((5, 0, 0), "u1"), self.transforms, header={"ElementType": "MET_OTHER"})
        told = run_json("info", path)["files"][0]
        self.assertEqual((told["frames"], told["valid_images"], told["time"]), (5, 0, None))
        self.assertIn("without images", run("info", path).stdout)

    def test_round_trip(self):
        path = self.path
        for onward in (work / "round.seq.nrrd", work / "round.igs.mhd", work / "round.seq.nhdr", work / "back.igs.mha"):
            self.assertEqual(run_json("convert", path, onward)["frames"], 5)
            path = onward
        pixels, frames = read_sequence(path)
        numpy.testing.assert_array_equal(pixels, self.pixels)
        for frame, (given, image) in enumerate(zip(self.transforms, ["OK"] * 4 + ["INVALID"])):
            self.assertEqual(frames[frame]["ImageStatus"], image)
            self.assertAlmostEqual(float(frames[frame]["Timestamp"]), 10 + 0.1 * frame, places=9)
            for name, (matrix, status) in given.items():
                self.assertEqual(frames[frame][name + "TransformStatus"], status)
                numpy.testing.assert_array_equal(numpy.array(frames[frame][name + "Transform"].split(), float).reshape(4, 4), matrix)

    def test_fields_that_a_header_cannot_hold_are_left_out(self):
        path = work / "umlauts.igs.mha"
        write_sequence(path, self.pixels, self.transforms, header={"Prüfer": "nobody", "Seq_Frame0002_Größe": "3", "Seq_Frame0003_Size": "4"})
        told = run_json("convert", path, work / "plain.igs.mha")
        self.assertEqual(told["lost"], ["Größe", "Prüfer"])
        self.assertTrue(all(any(f"the field {name}" in note for note in told["notes"]) for name in told["lost"]))
        self.assertEqual(read_sequence(work / "plain.igs.mha")[1][3]["Size"], "4")

    def test_some_frames(self):
        for text, expected in (("1", [1]), ("1:3", [1, 2, 3]), ("::2", [0, 2, 4]), ("3:", [3, 4]), (":1,4", [0, 1, 4]), ("4,0:1", [4, 0, 1])):
            run_json("convert", self.path, work / "some.igs.mha", "--frames", text)
            pixels, frames = read_sequence(work / "some.igs.mha")
            numpy.testing.assert_array_equal(pixels, self.pixels[expected], text)
            self.assertEqual(len(frames), len(expected))
            for frame, i in zip(frames, expected):
                self.assertAlmostEqual(float(frame["Timestamp"]), 10 + 0.1 * i, places=9)
                self.assertEqual(frame["ImageStatus"], "INVALID" if i == 4 else "OK")
                for name, (matrix, status) in self.transforms[i].items():
                    self.assertEqual(frame[name + "TransformStatus"], status, text)
                    numpy.testing.assert_array_equal(numpy.array(frame[name + "Transform"].split(), float).reshape(4, 4), matrix, text)

    def test_real_ones(self):
        if not PLUS.exists():
            self.skipTest(f"{PLUS} is not there")
        paths = sorted(PLUS.glob("*.igs.mha"))
        self.assertTrue(paths)
        for path in paths:
            told = run_json("info", path)["files"][0]
            self.assertEqual(told["kind"], "sequence")
            self.assertGreater(told["frames"], 4)


class Transforms(unittest.TestCase):
    def test_info_and_convert(self):
        path = work / "set.xml"
        matrix = numpy.diag([0.08, 0.07, 0.08, 1.0])
        write_plus(path, [("Image", "Probe", matrix, 'Error="1.68" Date="022312_110631"'), ("Phantom", "Reference", numpy.eye(4), "")])
        told = run_json("info", path)["files"][0]
        self.assertEqual(told["frames"], ["Image", "Phantom", "Probe", "Reference"])
        self.assertEqual(told["transforms"][0], {"from": "Image", "to": "Probe", "matrix": matrix.tolist(), "status": "OK", "error_mm": 1.68,
                                                 "date": "022312_110631"})
        self.assertEqual(told["open_cycles"], [])
        self.assertIn("ImageToProbe: OK, error 1.680 mm, scale 0.08000 x 0.07000 x 0.08000, of 022312_110631", run("info", path).stdout)
        run_json("convert", path, work / "set.json")
        again = run_json("info", work / "set.json")["files"][0]
        self.assertEqual(again["transforms"], told["transforms"])
        self.assertEqual(json.loads((work / "set.json").read_text())["schema"], "echorama-transforms-1")

    def test_poses_become_transforms_of_itk(self):
        pose = numpy.eye(4)
        pose[:3, :3], pose[:3, 3] = turned(30, 1), (1, -2, 3.5)
        write_poses(work / "poses.json", ["first.mha", "second.mha"], [numpy.eye(4), pose])
        told = run_json("convert", work / "poses.json", work / "to.tfm")
        self.assertEqual(told["files"], [str(work / "to.first.tfm"), str(work / "to.second.tfm")])
        size_of_first = (work / "to.first.tfm").stat().st_size
        numbers = [float(word) for word in (work / "to.second.tfm").read_text().splitlines()[3].split()[1:]]
        back = numpy.linalg.inv(pose)  # ITK's lead from the result to what is moved
        numpy.testing.assert_allclose(numbers, [*back[:3, :3].ravel(), *back[:3, 3]], atol=1e-14)
        write_poses(work / "one.json", ["second.mha"], [pose])
        self.assertEqual(run_json("convert", work / "one.json", work / "one.tfm")["files"], [str(work / "one.tfm")])
        self.assertEqual((work / "one.tfm").read_text(), (work / "to.second.tfm").read_text())
        write_poses(work / "same.json", ["a/x.mha", "b/x.mha"], [pose, pose])
        done = run("convert", work / "same.json", work / "same.tfm")
        self.assertEqual((done.returncode, list(work.glob("same*.tfm"))), (1, []), done.stderr)
        self.assertIn("two volumes", done.stderr)
        self.assertEqual(run("convert", work / "poses.json", work / "other.json").returncode, 2)
        # A disk on which the first has room and the second, of longer numbers, has not: both, or none.
        done = run("convert", work / "poses.json", work / "full.tfm",
                   preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size_of_first, size_of_first)))
        self.assertEqual((done.returncode, list(work.glob("full*"))), (1, []), done.stderr)
        self.assertIn("full.second.tfm", done.stderr)

    def test_open_cycles_are_told(self):
        path = work / "open.xml"
        moved = numpy.eye(4)
        moved[0, 3] = 2
        write_plus(path, [("A", "B", numpy.eye(4), ""), ("B", "C", numpy.eye(4), ""), ("A", "C", moved, "")])
        done = run("info", path)
        self.assertEqual(done.returncode, 0)
        self.assertIn("off by 2 mm", done.stderr)
        self.assertAlmostEqual(run_json("info", path)["files"][0]["open_cycles"][0]["mm"], 2)


if __name__ == "__main__":
    unittest.main()
