#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The program echorama from a tracked sequence to a volume and the probe that made it: reconstruct, probe-fit, and what they refuse."""
import pathlib
import shutil
import tempfile
import unittest

import numpy

from program_under_test import PLUS, blobs, read_mha, run, run_json, snapshot, turned, write_mha, write_plus, write_sequence

work = None  # a folder for all tests
SHAPE = (9, 12, 15)  # frames, rows, columns
PLAIN = ["--between", "nothing", "--spacing", 1, "--grid", "axis"]
EXACT = [*PLAIN, "--clip", "none", "--fill", "none"]


def setUpModule():
    global work
    work = pathlib.Path(tempfile.mkdtemp())


def tearDownModule():
    shutil.rmtree(work)


def shifted(z, scale=1.0):
    """Pixels of 1 mm (or `scale`) in the plane at z."""
    matrix = numpy.diag([scale, scale, scale, 1.0])
    matrix[2, 3] = z
    return matrix


def slices(name="slices.igs.mha", shape=SHAPE, **options):
    """A sequence whose frames are the slices of a volume, 1 mm apart; its path and the volume."""
    pixels = blobs(shape)
    transforms = [{"ImageToWorld": (shifted(z), "OK")} for z in range(shape[0])]
    write_sequence(work / name, pixels, **{"transforms": transforms, **options})
    return work / name, pixels


class Reconstruct(unittest.TestCase):
    def test_slices_become_the_volume(self):
        path, pixels = slices()
        out = work / "out.mha"
        told = run_json("reconstruct", path, "-o", out, *EXACT)
        header, voxels = read_mha(out)
        numpy.testing.assert_array_equal(voxels, pixels)
        self.assertEqual([float(n) for n in header["ElementSpacing"].split()], [1, 1, 1])
        numpy.testing.assert_allclose([float(n) for n in header["Offset"].split()], [0, 0, 0], atol=1e-9)
        self.assertEqual((told["frames"], told["frames_used"], told["frames_refused"], told["frames_between"]), (9, 9, 0, 0))
        self.assertEqual((told["voxels_seen"], told["voxels_filled"], told["mean_coverage"]), (pixels.size, 0, 1))
        self.assertEqual((told["transform"], told["path"]), ("ImageToWorld", ["ImageToWorld"]))
        self.assertGreater(told["memory_mb"], 0)
        text = run("reconstruct", path, "-o", out, *EXACT).stdout
        for words in ("15 x 12 x 9 voxels of 1.000", "9 ", "100.0% of the voxels are real", "images placed by ImageToWorld\n"):
            self.assertIn(words, text)

    def test_coverage_goes_where_it_can(self):
        path, _ = slices()
        run_json("reconstruct", path, "-o", work / "covered.vti", *EXACT)
        self.assertIn("Coverage", run_json("info", work / "covered.vti")["files"][0]["arrays"])
        self.assertEqual(run_json("reconstruct", path, "-o", work / "plain.nrrd", *EXACT)["lost"], [])

    def test_invalid_frames_are_counted_and_not_used(self):
        transforms = [{"ImageToWorld": (shifted(z), "INVALID" if z == 4 else "OK")} for z in range(SHAPE[0])]
        path, pixels = slices("lost.igs.mha", transforms=transforms)
        told = run_json("reconstruct", path, "-o", work / "lost.mha", *EXACT)
        self.assertEqual((told["frames_used"], told["frames_refused"]), (8, 1))
        voxels = read_mha(work / "lost.mha")[1]
        self.assertEqual(abs(voxels[4].astype(int)).max(), 0)
        numpy.testing.assert_array_equal(voxels[5], pixels[5])
        # The hole is one voxel wide.
        told = run_json("reconstruct", path, "-o", work / "lost.mha", *PLAIN, "--clip", "none", "--fill", "stick", "--reach", 1)
        self.assertEqual(told["voxels_filled"], SHAPE[1] * SHAPE[2])

    def test_some_frames(self):
        path, pixels = slices()
        for text, expected in (("2:6", range(2, 7)), ("0:8:4", (0, 4, 8)), ("7:", (7, 8)), ("::2", range(0, 9, 2)), (":8:3", (0, 3, 6))):
            told = run_json("reconstruct", path, "-o", work / "some.mha", *EXACT, "--frames", text)
            self.assertEqual(told["frames_used"], len(expected), text)
            voxels = read_mha(work / "some.mha")[1]
            for z in expected:
                numpy.testing.assert_array_equal(voxels[z - expected[0]], pixels[z], text)

    def test_a_calibration_from_a_file(self):
        """ImageToProbe is in a configuration of Plus, ProbeToTracker and ReferenceToTracker in the sequence."""
        turn = numpy.eye(4)
        turn[:3, :3] = turned(90)
        transforms = [{"ProbeToTracker": (turn @ shifted(z), "OK"), "ReferenceToTracker": (turn, "OK")} for z in range(SHAPE[0])]
        path, pixels = slices("probe.igs.mha", transforms=transforms)
        write_plus(work / "set.xml", [("Image", "Probe", shifted(10), "")])
        told = run_json("reconstruct", path, "-o", work / "probe.mha", "--transforms", work / "set.xml", *EXACT)
        self.assertEqual(told["transform"], "ImageToReference")
        self.assertEqual(told["path"], ["ImageToProbe", "ProbeToTracker", "inverse of ReferenceToTracker"])
        header, voxels = read_mha(work / "probe.mha")
        numpy.testing.assert_array_equal(voxels, pixels)
        numpy.testing.assert_allclose([float(n) for n in header["Offset"].split()], [0, 0, 10], atol=1e-9)
        run_json("convert", work / "set.xml", work / "set.json")
        told = run_json("reconstruct", path, "-o", work / "tracker.mha", "--transforms", work / "set.json", "--transform",
                        "ImageToTracker", *EXACT)
        self.assertEqual(told["path"], ["ImageToProbe", "ProbeToTracker"])
        self.assertEqual(read_mha(work / "tracker.mha")[1].shape, (9, 15, 12))

    def test_a_given_grid(self):
        path, pixels = slices()
        write_mha(work / "grid.mha", blobs((4, 5, 6)), (1, 1, 1), (2, 3, 1))
        told = run_json("reconstruct", path, "-o", work / "onto.mha", "--grid", work / "grid.mha", "--clip", "none", "--between", "nothing",
                        "--fill", "none")
        self.assertEqual((told["dimensions"], told["origin"]), ([6, 5, 4], [2, 3, 1]))
        numpy.testing.assert_array_equal(read_mha(work / "onto.mha")[1], pixels[1:5, 3:8, 2:8])

    def test_between_frames(self):
        pixels = blobs((2, 12, 15))
        write_sequence(work / "gap.igs.mha", pixels, [{"ImageToWorld": (shifted(z), "OK")} for z in (0, 2)])
        for way in ("forward", "backward"):
            common = ["reconstruct", work / "gap.igs.mha", "-o", work / "gap.mha", "--spacing", 1, "--grid", "axis", "--clip", "none",
                      "--between", way]
            self.assertGreater(run_json(*common, "--fill", "none")["frames_between"], 0)
            numpy.testing.assert_allclose(read_mha(work / "gap.mha")[1][1], pixels.astype(float).mean(0), atol=1.5, err_msg=way)
            self.assertEqual(run_json(*common, "--fill", "none", "--maximum-gap", 1.5)["frames_between"], 0, way)
            self.assertEqual(read_mha(work / "gap.mha")[1][1].max(), 0, way)
        run_json(*common[:-1], "nothing", "--fill", "mean", "--reach", 1)
        self.assertGreater(read_mha(work / "gap.mha")[1][1].min(), 0)

    def test_modes(self):
        """Two frames in one place."""
        pixels = blobs((2, 12, 15))
        transforms = [{"ImageToWorld": (shifted(0), "OK")}] * 2
        write_sequence(work / "two.igs.mha", pixels, transforms)
        for mode, expected in (("mean", pixels.astype(int).mean(0)), ("maximum", pixels.max(0)), ("latest", pixels[1]),
                               ("alpha", 0.25 * pixels[1] + 0.75 * pixels[0])):
            run_json("reconstruct", work / "two.igs.mha", "-o", work / "mode.mha", *EXACT, "--mode", mode, "--alpha", 0.25)
            numpy.testing.assert_allclose(read_mha(work / "mode.mha")[1][0], expected, atol=0.51, err_msg=mode)
        # Plus rounds after each pixel.
        pixels = numpy.random.default_rng(7).integers(1, 255, (3, 12, 15))
        write_sequence(work / "three.igs.mha", pixels.astype("u1"), [{"ImageToWorld": (shifted(0), "OK")}] * 3)
        run_json("reconstruct", work / "three.igs.mha", "-o", work / "mode.mha", *EXACT, "--mode", "running-mean")
        expected = numpy.floor((2 * numpy.floor((pixels[0] + pixels[1]) / 2 + 0.5) + pixels[2]) / 3 + 0.5)
        numpy.testing.assert_array_equal(read_mha(work / "mode.mha")[1][0], expected)
        self.assertTrue((expected != numpy.floor(pixels.mean(0) + 0.5)).any())

    def test_interpolation(self):
        """Pixels that lie a quarter of a voxel to the right: into the nearest voxel, or by weights into two."""
        matrices = [shifted(z) for z in range(SHAPE[0])]
        for matrix in matrices:
            matrix[0, 3] = 0.25
        path, pixels = slices("quarter.igs.mha", transforms=[{"ImageToWorld": (matrix, "OK")} for matrix in matrices])
        write_mha(work / "grid.mha", blobs(SHAPE))
        for way, expected in (("nearest", pixels[:, :, 1:]), ("linear", 0.75 * pixels[:, :, 1:] + 0.25 * pixels[:, :, :-1])):
            run_json("reconstruct", path, "-o", work / "quarter.mha", "--grid", work / "grid.mha", "--clip", "none", "--between", "nothing",
                     "--fill", "none", "--interpolation", way)
            numpy.testing.assert_allclose(read_mha(work / "quarter.mha")[1][:, :, 1:], expected, atol=0.51, err_msg=way)

    def test_the_grid_lies_as_the_sweep_does(self):
        """Unless the world's axes are asked for."""
        turn = numpy.eye(4)
        turn[:3, :3] = turned(30) @ turned(20, 0)
        path, pixels = slices("oblique.igs.mha", transforms=[{"ImageToWorld": (turn @ shifted(z), "OK")} for z in range(SHAPE[0])])
        common = ["reconstruct", path, "-o", work / "oblique.mha", "--between", "nothing", "--spacing", 1, "--clip", "none", "--fill", "none"]
        run_json(*common)
        header, voxels = read_mha(work / "oblique.mha")
        numpy.testing.assert_array_equal(voxels, pixels)
        numpy.testing.assert_allclose(numpy.array(header["TransformMatrix"].split(), float).reshape(3, 3).T, turn[:3, :3], atol=1e-9)
        told = run_json(*common, "--grid", "axis")
        corners = turn[:3, :3] @ numpy.array([[x, y, z] for x in (0, 14) for y in (0, 11) for z in (0, 8)]).T
        numpy.testing.assert_allclose(told["dimensions"], numpy.ptp(corners, axis=1) + 1, atol=1)
        numpy.testing.assert_allclose(told["origin"], corners.min(axis=1), atol=1e-6)
    def test_clip(self):
        path, pixels = slices()
        run_json("reconstruct", path, "-o", work / "clip.mha", *PLAIN, "--fill", "none", "--clip", "3,2,8,7")
        numpy.testing.assert_array_equal(read_mha(work / "clip.mha")[1], pixels[:, 2:9, 3:11])
        # Found: echoes change from frame to frame, what is printed beside them does not.
        y, x = numpy.mgrid[:60, :80]
        depth, beam = numpy.hypot(x - 40, y + 10), numpy.arctan2(x - 40, y + 10)
        sector = (depth > 15) & (depth < 65) & (abs(beam) < 0.5)
        frames = numpy.random.default_rng(1).integers(40, 200, (6, 60, 80), "u1") * sector.astype("u1")
        frames[:, 2:6, 2:10] = 255
        write_sequence(work / "sector.igs.mha", frames, [{"ImageToWorld": (shifted(z), "OK")} for z in range(6)])
        write_mha(work / "grid.mha", blobs(frames.shape))
        run_json("reconstruct", work / "sector.igs.mha", "-o", work / "sector.mha", "--grid", work / "grid.mha", "--between", "nothing",
                 "--fill", "none")
        found, voxels = read_mha(work / "sector.ValidRegion.mha")[1][3] == 1, read_mha(work / "sector.mha")[1][3]
        self.assertGreater((found & sector).sum() / (found | sector).sum(), 0.93)
        numpy.testing.assert_array_equal(voxels, frames[3] * found)

    def test_threads_change_nothing(self):
        path, _ = slices()
        for threads in (1, 2):
            run_json("reconstruct", path, "-o", work / f"threads{threads}.mha", "--spacing", 0.7, "--interpolation", "linear", "--clip", "none",
                     "--threads", threads)
        self.assertEqual((work / "threads1.mha").read_bytes(), (work / "threads2.mha").read_bytes())

    def test_a_real_one(self):
        if not PLUS.exists():
            self.skipTest(f"{PLUS} is not there")
        told = run_json("reconstruct", PLUS / "SpinePhantomFreehand.igs.mha", "-o", work / "spine.mha", "--transforms",
                        PLUS / "PlusDeviceSet_SpinePhantomFreehandReconstructionOnly.xml", "--spacing", 1)
        self.assertEqual((told["transform"], told["frames_used"]), ("ImageToReference", 21))
        self.assertGreater(told["voxels_seen"], 10000)


class Refused(unittest.TestCase):
    def refuses(self, words, *arguments, status=1):
        before = snapshot(work)
        done = run(*arguments)
        self.assertEqual(done.returncode, status, f"{arguments}: {done.stdout}{done.stderr}")
        self.assertEqual(done.stdout, "")
        lines = [line for line in done.stderr.splitlines() if not line.startswith("echorama: note: ")]
        self.assertEqual(len(lines), 1, done.stderr)
        for word in words:
            self.assertIn(word, lines[0])
        self.assertEqual(snapshot(work), before)

    def reconstruct(self, words, *arguments, path=None, status=1):
        path = path or slices()[0]
        self.refuses(words, "reconstruct", path, "-o", work / "no.mha", *arguments, status=status)

    def test_usage(self):
        for arguments, word in ((["--transform", "banana"], "--transform"), (["--frames", "0:1,3"], "--frames"), (["--frames", "9"], "9 frames"),
                                (["--clip", "banana"], "--clip"), (["--clip", "0,0,16,12"], "15 x 12"), (["--clip", "1,2,3"], "--clip"),
                                (["--clip", "0,0,0,5"], "--clip"), (["--clip=-1,0,5,5"], "--clip"), (["--clip", "0,0,5,5,"], "--clip"),
                                (["--clip", "2147483647,0,2147483647,5"], "--clip"), (["--mode", "banana"], "--mode"),
                                (["--alpha", 0], "--alpha"), (["--reach", 0], "--reach"), (["--spacing", -1], "--spacing"),
                                (["--between", "us"], "--between"), (["--maximum-gap", 0], "--maximum-gap")):
            self.reconstruct([word], *arguments, status=2)
        self.refuses(["out.banana"], "reconstruct", slices()[0], "-o", work / "out.banana", status=2)
        self.refuses(["sequence"], "reconstruct", status=2)

    def test_transforms_that_are_missing(self):
        path = slices("none.igs.mha", transforms=[{}] * 9)[0]
        self.reconstruct(["none.igs.mha", "transforms", "--transforms"], path=path)
        path = slices("probe.igs.mha", transforms=[{"ProbeToTracker": (shifted(z), "OK")} for z in range(9)])[0]
        self.reconstruct(["probe.igs.mha", "Image", "--transforms"], path=path)
        self.reconstruct(["World", "Reference"], "--transform", "ImageToReference")
        self.reconstruct(["missing.xml"], "--transforms", work / "missing.xml")
        write_plus(work / "bad.xml", [("A", "B", numpy.eye(3), "")])
        self.reconstruct(["bad.xml", "9 values"], "--transforms", work / "bad.xml")

    def test_no_frame_that_can_be_used(self):
        path = slices("invalid.igs.mha", transforms=[{"ImageToWorld": (shifted(z), "INVALID")} for z in range(9)])[0]
        self.reconstruct(["pose"], path=path)
        flat = numpy.diag([1.0, 0.0, 1.0, 1.0])
        path = slices("flat.igs.mha", transforms=[{"ImageToWorld": (flat, "OK")}] * 9)[0]
        self.reconstruct(["pose"], path=path)

    def test_files_that_are_no_sequences(self):
        write_mha(work / "volume.mha", blobs((5, 6, 7)))
        self.reconstruct(["volume.mha"], path=work / "volume.mha")
        self.reconstruct(["missing.igs.mha"], path=work / "missing.igs.mha")
        write_sequence(work / "trackers.igs.mha", numpy.zeros((3, 0, 0), "u1"), [{"ProbeToTracker": (shifted(z), "OK")} for z in range(3)],
                       header={"ElementType": "MET_OTHER"})
        self.reconstruct(["trackers.igs.mha", "no images"], path=work / "trackers.igs.mha")

    def test_truncated_pixels(self):
        path = slices("cut.igs.mha")[0]
        path.write_bytes(path.read_bytes()[:-400])
        self.reconstruct(["cut.igs.mha"], path=path)

    def test_too_much_memory(self):
        self.reconstruct(["MB"], "--memory", 0.001, "--spacing", 0.05)
        self.reconstruct(["voxels", "SpacingMm"], "--spacing", 1e-6)

    def test_inputs_are_never_overwritten(self):
        path = slices()[0]
        write_mha(work / "grid.mha", blobs((4, 5, 6)))
        write_plus(work / "set.mha", [("Image", "Probe", numpy.eye(4), "")])
        for arguments in ([path, "-o", path], [path, "-o", work / "grid.mha", "--grid", work / "grid.mha"],
                          [path, "-o", work / "set.mha", "--transforms", work / "set.mha"]):
            self.refuses(["input"], "reconstruct", *arguments)
        self.reconstruct(["--spacing"], "--grid", work / "grid.mha", "--spacing", 1, status=2)
        self.reconstruct(["banana"], "--grid", "banana")


class ProbeFit(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        done = run("phantom", "-o", work / "phantom", "--spacing", 1.5, "--count", 2)
        assert done.returncode == 0, done.stderr
        cls.volume = work / "phantom" / "volume_1.mha"

    def test_finds_the_probe_of_a_phantom(self):
        known = run_json("info", self.volume)["files"][0]["acquisition"]
        told = run_json("probe-fit", self.volume, "-o", work / "fitted.mha")
        self.assertGreater(told["overlap"], 0.98)
        self.assertLess(told["residual_mm"], 0.75)  # half a voxel
        for key in ("fan_degrees", "sweep_degrees"):
            self.assertAlmostEqual(told["ProbeGeometry"][key], known["ProbeGeometry"][key], delta=0.5)
        look = [numpy.array(matrix)[:3, 2] for matrix in (told["ProbeToWorld"], known["ProbeToWorld"])]
        self.assertGreater(look[0] @ look[1], 0.99999)  # a quarter of a degree
        fitted = run_json("info", work / "fitted.mha")["files"][0]["acquisition"]
        self.assertEqual(fitted["ProbeGeometry"], told["ProbeGeometry"])
        numpy.testing.assert_array_equal(read_mha(work / "fitted.mha")[1], read_mha(self.volume)[1])
        text = run("probe-fit", self.volume).stdout
        for words in ("probe ", "file says", "residual", "overlap"):
            self.assertIn(words, text)

    def test_enclose(self):
        """The least fan that holds the region is the file's own, or that of a box its size; with a margin, that to all sides."""
        known = run_json("info", self.volume)["files"][0]["acquisition"]
        told = run_json("probe-fit", self.volume, "--enclose")
        self.assertEqual(told["ProbeGeometry"], known["ProbeGeometry"])
        numpy.testing.assert_allclose(told["ProbeToWorld"], known["ProbeToWorld"], atol=1e-9)
        self.assertAlmostEqual(told["filled"], 1, delta=0.02)
        valid = numpy.zeros((30, 30, 30), "u1")
        valid[8:22, 8:22, 8:22] = 1
        write_mha(work / "box.mha", 100 * valid)
        write_mha(work / "box.ValidRegion.mha", valid)
        for margin in (0, 5):
            told = run_json("probe-fit", work / "box.mha", "--enclose", "--margin", margin, "-o", work / "boxed.mha")
            probe, side = told["ProbeGeometry"], 14 + 2 * margin
            numpy.testing.assert_allclose([probe["fan_mm"], probe["sweep_mm"], *probe["depth_mm"]], [side, side, 0, side], atol=1e-3)
            self.assertAlmostEqual(told["filled"], (14 / side)**3, places=4)
            self.assertEqual(run_json("info", work / "boxed.mha")["files"][0]["acquisition"]["ProbeGeometry"], probe)
        self.assertEqual(run("probe-fit", work / "box.mha", "--margin", 5).returncode, 2)  # only of a fan that encloses

    def test_refused(self):
        refuses = Refused().refuses
        voxels = numpy.zeros((20, 20, 20), "u1")
        write_mha(work / "zero.mha", voxels)
        refuses(["zero.mha"], "probe-fit", work / "zero.mha")
        voxels[2:4, 2:18, 2:18] = voxels[16:18, 2:18, 2:18] = voxels[2:18, 2:4, 2:4] = 9
        write_mha(work / "pi.mha", voxels)
        refuses(["pi.mha"], "probe-fit", work / "pi.mha", "-o", work / "no.mha")
        # Unless one is content with so bad a fit: each limit is what it is compared with.
        fit = run_json("probe-fit", work / "pi.mha", "--minimum-overlap", 0, "--maximum-distance", 1)
        self.assertLess(fit["overlap"], 0.75)
        for limits in ((1.01 * fit["overlap"], 1), (0, 0.99 * fit["mean_distance"])):
            refuses(["pi.mha"], "probe-fit", work / "pi.mha", "--minimum-overlap", limits[0], "--maximum-distance", limits[1])
        refuses(["missing.mha"], "probe-fit", work / "missing.mha")
        refuses(["input"], "probe-fit", self.volume, "-o", self.volume)
        refuses(["--minimum-overlap"], "probe-fit", self.volume, "--minimum-overlap", 2, status=2)


if __name__ == "__main__":
    unittest.main()
