#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Every kind of bad input, through the command line: exit status 1, one line that names the file (or parameter) and the
reason, no crash, nothing written, nothing overwritten."""
import json
import os
import pathlib
import resource
import subprocess
import sys
import tempfile
import unittest

import numpy

from program_under_test import (PROGRAM, SOURCE, blobs, read_mha, run, run_json, snapshot, turned, write_mha, write_plus, write_poses,
                                write_sequence)

NAN = float("nan")
SHEARED = numpy.array([[1, 0.3, 0], [0, 1, 0], [0, 0, 1.0]])


class BadInput(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = pathlib.Path(self.folder.name)
        self.good = self.path / "good.mha"
        write_mha(self.good, blobs())

    def refuses(self, name, arguments, words=(), status=1, **options):
        """Runs a command that must fail, naming `name` and every one of `words`, and must leave the folder as it is."""
        before = snapshot(self.path)
        done = run(*arguments, **options)
        self.assertEqual(done.returncode, status, f"{arguments}: {done.stdout}{done.stderr}")
        self.assertEqual(done.stdout, "")
        lines = [line for line in done.stderr.splitlines() if not line.startswith("echorama: note: ")]
        self.assertEqual(len(lines), 1, done.stderr)
        self.assertTrue(lines[0].startswith("echorama: "), lines[0])
        for word in (name, *words):
            self.assertIn(str(word).lower(), lines[0].lower(), f"{arguments}")
        self.assertEqual(snapshot(self.path), before, f"{arguments}: the folder changed")

    def refused_by_all(self, bad, *words):
        """A file that no command may accept."""
        self.refuses(bad.name, ["info", bad], words)
        self.refuses(bad.name, ["convert", bad, self.path / "out.nrrd"], words)
        self.refuses(bad.name, ["stitch", self.good, bad, "-o", self.good.with_name("out.mha")], words)
        self.refuses(bad.name, ["align", self.good, bad, "-o", self.path / "poses.json", "--apply", self.path / "moved"], words)

    # Files that are not what they say.

    def bad_mha(self, *words, voxels=None, **options):
        bad = self.path / "bad.mha"
        write_mha(bad, blobs() if voxels is None else voxels, **options)
        self.refused_by_all(bad, *words)

    def test_missing(self):
        self.refused_by_all(self.path / "missing.mha")

    def test_folder(self):
        (self.path / "folder.mha").mkdir()
        self.refused_by_all(self.path / "folder.mha")

    @unittest.skipIf(os.geteuid() == 0, "root may read everything")
    def test_unreadable(self):
        locked = self.path / "locked.mha"
        write_mha(locked, blobs())
        locked.chmod(0)
        done = run("info", locked)
        self.assertEqual(done.returncode, 1)
        self.assertIn("locked.mha", done.stderr)

    def test_empty(self):
        for name in ("bad.mha", "bad.nrrd", "bad.vti"):
            (self.path / name).write_bytes(b"")
            self.refused_by_all(self.path / name, "empty")

    def test_another_type(self):
        for name in ("bad.mha", "bad.nrrd", "bad.vti"):
            (self.path / name).write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 8)
            self.refused_by_all(self.path / name)

    def test_truncated(self):
        for name in ("bad.mha", "bad.nrrd", "bad.vti"):
            bad = self.path / name
            self.assertEqual(run("convert", self.good, bad).returncode, 0)
            content = bad.read_bytes()
            bad.write_bytes(content[:-len(content) // 3])
            self.refused_by_all(bad)

    def test_truncated_header(self):
        bad = self.path / "bad.mha"
        bad.write_bytes(self.good.read_bytes()[:100])
        self.refused_by_all(bad)

    def test_raw_data_that_end_early(self):
        bad = self.path / "bad.mha"
        bad.write_bytes(self.good.read_bytes()[:-500])
        self.refused_by_all(bad)

    def test_compressed_data_that_end_early(self):
        bad = self.path / "bad.mha"
        write_mha(bad, blobs(), compressed=True)
        bad.write_bytes(bad.read_bytes()[:-200])
        self.refused_by_all(bad)

    def test_compressed_data_that_decompress_to_too_little(self):
        bad = self.path / "bad.mha"
        write_mha(bad, blobs((20, 20, 10)), compressed=True, header={"DimSize": "20 20 20"})
        self.refused_by_all(bad)

    def test_compressed_data_that_are_damaged(self):
        bad = self.path / "bad.mha"
        write_mha(bad, blobs(), compressed=True)
        content = bytearray(bad.read_bytes())
        for i in range(len(content) - 1500, len(content) - 1400):
            content[i] ^= 0x5A
        bad.write_bytes(content)
        self.refused_by_all(bad)

    def test_dimensions_that_lie(self):
        self.bad_mha(header={"DimSize": "20 20 21"})
        self.bad_mha(header={"DimSize": "20 20 2000"})

    def test_dimensions_whose_product_overflows(self):
        self.bad_mha(header={"DimSize": "2147483647 2147483647 2147483647"})
        self.bad_mha(header={"DimSize": "4294967296 4294967296 1"})
        self.bad_mha(header={"DimSize": "100000 100000 100000"}, compressed=True)

    def test_dimensions_that_are_none(self):
        for size in ("0 20 20", "-20 20 20", "20 20", "a b c"):
            self.bad_mha(header={"DimSize": size})
        self.bad_mha(header={"DimSize": None})

    def test_element_types(self):
        self.bad_mha(header={"ElementType": "MET_BANANA"})
        self.bad_mha(header={"ElementNumberOfChannels": "3", "DimSize": "20 20 6"})

    def test_spacing(self):
        self.bad_mha("spacing", spacing=(1, 0, 1))
        self.bad_mha("spacing", spacing=(1, -1, 1))

    def test_direction(self):
        self.bad_mha("direction", direction=numpy.diag([1, 1, 0.0]))
        self.bad_mha("direction", direction=SHEARED)
        self.bad_mha("direction", direction=numpy.zeros((3, 3)))

    def test_numbers_that_are_none(self):
        self.bad_mha(spacing=(1, NAN, 1))
        self.bad_mha(origin=(NAN, 0, 0))
        self.bad_mha(origin=(0, float("inf"), 0))
        self.bad_mha(direction=numpy.full((3, 3), NAN))

    def test_detached_data_that_are_missing(self):
        bad = self.path / "bad.mhd"
        bad.write_text("ObjectType = Image\nNDims = 3\nDimSize = 4 4 4\nElementType = MET_UCHAR\nElementSpacing = 1 1 1\n"
                       "ElementDataFile = nowhere.raw\n")
        self.refused_by_all(bad)

    def test_nrrd_geometry(self):
        for directions, word in (("(1,0,0) (2,0,0) (0,0,1)", ""), ("(1,0,0) (0.5,1,0) (0,0,1)", "direction"), ("(1,0,0) (0,0,0) (0,0,1)", ""),
                                 ("(1,0,0) (0,nan,0) (0,0,1)", "")):
            bad = self.path / "bad.nrrd"
            bad.write_bytes(b"NRRD0004\ntype: uchar\ndimension: 3\nspace: left-posterior-superior\nsizes: 4 4 4\nencoding: raw\n"
                            b"space directions: " + directions.encode() + b"\nspace origin: (0,0,0)\n\n" + bytes(64))
            self.refused_by_all(bad, word)

    def test_valid_region_of_another_geometry(self):
        write_mha(self.path / "bad.mha", blobs())
        write_mha(self.path / "bad.ValidRegion.mha", numpy.ones((20, 20, 19), "u1"))
        self.refused_by_all(self.path / "bad.mha")

    def test_what_the_fuzzers_start_from(self):
        """Small files of every format, whole and broken: told about or refused with one line, and never a crash."""
        refused = 0
        for script in SOURCE.glob("*/Fuzzing/Seeds*.py"):
            seeds = self.path / script.stem
            seeds.mkdir()
            subprocess.run([sys.executable, script, seeds], check=True)
            for seed in sorted(path for path in seeds.iterdir() if path.is_file()):
                done = run("info", seed)
                lines = [line for line in done.stderr.splitlines() if not line.startswith("echorama: note: ")]
                self.assertIn((done.returncode, len(lines)), ((0, 0), (1, 1)), f"{seed}: {done.returncode} {done.stderr}")
                if done.returncode:
                    refused += 1
                    self.assertIn(f"{seeds}/", lines[0])  # of a stack, another picture may be the bad one
        self.assertGreater(refused, 10)

    # Tracked sequences.

    def sequence(self, name="tracked.igs.mha", **options):
        path = self.path / name
        options = {"pixels": blobs((4, 20, 30)), "transforms": [{"ImageToWorld": (numpy.eye(4), "OK")}] * 4, **options}
        write_sequence(path, **options)
        return path

    def test_sequences_that_are_broken(self):
        good = self.sequence()
        bad = self.path / "bad.igs.mha"
        out = self.path / "out.seq.nrrd"
        for header, word in (({"DimSize": "30 20 5"}, ""), ({"DimSize": "30 -20 4"}, ""), ({"DimSize": "2147483647 2147483647 4"}, ""),
                             ({"Seq_Frame0004_Timestamp": "1"}, "frame 4"), ({"UltrasoundImageOrientation": "QQ"}, "QQ"),
                             ({"ElementType": "MET_BANANA"}, "type")):
            self.sequence("bad.igs.mha", header=header)
            self.refuses("bad.igs.mha", ["info", bad], [word])
            self.refuses("bad.igs.mha", ["convert", bad, out], [word])
        bad.write_bytes(good.read_bytes()[:-700])
        self.refuses("bad.igs.mha", ["convert", bad, out])
        bad.write_bytes(good.read_bytes()[:300])
        self.refuses("bad.igs.mha", ["info", bad])
        self.sequence("bad.igs.mha", pixels=blobs((4, 20, 30)), header={"CompressedData": "True"})
        self.refuses("bad.igs.mha", ["convert", bad, out])

    def test_sequences_are_no_volumes(self):
        path = self.sequence()
        self.refuses("tracked.igs.mha", ["stitch", self.good, path, "-o", self.path / "out.mha"], ["sequence"])
        self.refuses("tracked.igs.mha", ["align", self.good, path, "-o", self.path / "poses.json"], ["sequence"])
        for name in ("out.vti", "out.banana"):
            self.refuses(name, ["convert", path, self.path / name], ["sequence"], status=2)

    def test_frames_that_are_not_there(self):
        path = self.sequence()
        for text in ("4", "-1", "2:1", "0:4", "0:3:0", "0:3:-1", "a", "1.5", "0:1:1:1", ",", "1,", "99999999999"):
            self.refuses("--frames", ["convert", path, self.path / "out.igs.mha", f"--frames={text}"], ["4 frames"], status=2)
        self.refuses("--frames", ["convert", self.good, self.path / "out.nrrd", "--frames", "1"], ["good.mha"], status=2)

    # Transforms.

    def test_transforms_that_are_none(self):
        unit = numpy.eye(4)
        path = self.path / "set.xml"
        moved = numpy.eye(4)
        moved[1, 3] = 1
        for transforms, word in (([("A", "A", unit, "")], "itself"), ([("A", "B", unit[:3], "")], "12 values"), ([("A", "", unit, "")], "names"),
                                 ([("A", "B", unit * 2, "")], "last row"), ([("A", "B", numpy.full((4, 4), NAN), "")], "finite"),
                                 ([("A", "B", unit, ""), ("A", "B", moved, "")], "twice")):
            write_plus(path, transforms)
            self.refuses("set.xml", ["info", path], [word])
            self.refuses("set.xml", ["convert", path, self.path / "out.json"], [word])
        write_plus(path, [("A", "B", unit, ""), ("B", "A", moved, "")])
        self.refuses("set.xml", ["convert", path, self.path / "out.json"], ["does not close"])
        for text in ("", "<", "<a/>", "<PlusConfiguration>", "<PlusConfiguration/>"):
            path.write_text(text)
            self.refuses("set.xml", ["info", path])
        write_plus(path, [("A", "B", unit, "")])
        self.refuses("out.xml", ["convert", path, self.path / "out.xml"], [".json"], status=2)
        self.refuses("input", ["convert", path, path])
        ours = self.path / "set.json"
        for text in ("", "{", '{"schema": "echorama-transforms-1"}', '{"schema": "echorama-transforms-1", "unit": "m", "transforms": []}'):
            ours.write_text(text)
            self.refuses("set.json", ["info", ours])

    # What convert cannot do with a good file.

    def test_options_that_do_not_apply(self):
        out = self.path / "out.nrrd"
        self.refuses("--time", ["convert", self.good, out, "--time", 1], ["one volume"], status=2)
        self.refuses("--time", ["convert", self.good, out, "--time", -1], status=2)
        self.refuses("--beams", ["convert", self.good, out, "--beams"], ["good.mha"], status=2)
        self.refuses("--spacing", ["convert", self.good, out, "--spacing", 1], ["good.mha"], status=2)
        self.refuses("--stack-spacing", ["convert", self.good, out, "--stack-spacing", 1, 1, 1], ["good.mha"], status=2)
        self.refuses("--stack-spacing", ["convert", self.good, out, "--stack-spacing", 1, 1, 0], status=2)
        poses = self.path / "poses.json"
        write_poses(poses, ["good.mha"], [numpy.eye(4)])
        self.refuses("other.json", ["convert", poses, self.path / "other.json"], ["poses become .tfm"], status=2)

    def test_transforms_of_other_programs(self):
        other, bad = self.path / "other.mha", self.path / "bad.tfm"
        write_mha(other, blobs(seed=2))
        bad.write_text("#Insight Transform File V1.0\nTransform: AffineTransform_double_3_3\nParameters: 2 0 0 0 1 0 0 0 1 0 0 0\nFixedParameters: 0 0 0\n")
        align = ["align", self.good, other, "-o", self.path / "poses.json"]
        self.refuses("bad.tfm, line 4", [*align, "--transforms", "-", bad], ["not a rotation", "by 3"])
        self.refuses("missing.tfm", [*align, "--transforms", "-", self.path / "missing.tfm"])
        self.refuses("--transforms", [*align, "--transforms", bad], ["2 volumes", "there are 1"], status=2)
        self.refuses("--transforms", [*align, "--transforms", "-", bad, "--poses", self.path / "start.json"], ["--poses"], status=2)
        self.refuses("--transforms", [*align, "--transforms-only"], status=2)
        self.refuses("bad.tfm", ["align", self.good, other, "-o", bad, "--transforms", "-", bad])

    # Volumes that are good files and bad input.

    def test_one_volume_where_two_are_needed(self):
        self.refuses("", ["align", self.good, "-o", self.path / "poses.json"], ["two"])
        self.refuses("", ["stitch", self.good, "-o", self.path / "out.mha"], ["two"])

    def test_volumes_that_do_not_overlap(self):
        far = self.path / "far.mha"
        write_mha(far, blobs(seed=2), origin=(500, 0, 0))
        self.refuses("", ["stitch", self.good, far, "-o", self.path / "out.mha"], ["overlap"])
        done = run("stitch", self.good, far, "-o", self.path / "both.mha", "--allow-disjoint")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(int(read_mha(self.path / "both.ValidRegion.mha")[1].sum()), 2 * 20**3)

    def test_constant_volumes(self):
        flat = self.path / "flat.mha"
        write_mha(flat, numpy.full((20, 20, 20), 7, "u1"))
        self.refuses("flat.mha", ["align", self.good, flat, "-o", self.path / "poses.json"], ["constant"])

    def test_volumes_without_a_real_voxel(self):
        for name, voxels in (("nan.mha", numpy.full((20, 20, 20), NAN, "f4")), ("zero.mha", numpy.zeros((20, 20, 20), "u1"))):
            write_mha(self.path / name, voxels)
            self.refuses(name, ["align", self.good, self.path / name, "-o", self.path / "poses.json"])
            self.refuses(name, ["stitch", self.good, self.path / name, "-o", self.path / "out.mha"])

    def test_some_voxels_that_are_not_numbers(self):
        """They count as not real: the result is made, and holds none."""
        voxels = blobs().astype("f4")
        voxels[4:8, 4:8, 4:8] = NAN
        write_mha(self.path / "holes.mha", voxels)
        self.assertEqual(run_json("info", self.path / "holes.mha")["files"][0]["not_finite"], 64)
        self.assertEqual(run("stitch", self.good, self.path / "holes.mha", "-o", self.path / "out.mha").returncode, 0)
        self.assertTrue(numpy.isfinite(read_mha(self.path / "out.mha")[1]).all())

    # Poses.

    def test_poses_that_are_none(self):
        poses, out = self.path / "poses.json", self.path / "out.mha"
        rigid = numpy.eye(4)
        for text in ("", "{", "[]", "{}", '{"schema": "something-else", "unit": "mm", "frame": "LPS", "volumes": []}'):
            poses.write_text(text)
            self.refuses("poses.json", ["stitch", self.good, self.good, "-o", out, "--poses", poses])
            self.refuses("poses.json", ["info", poses])
        for matrix in (2 * rigid, numpy.vstack([rigid[:3], [0, 0, 1, 1]]), numpy.diag([1, 1, -1, 1]), rigid[:3], numpy.full((4, 4), NAN)):
            write_poses(poses, ["good.mha"], [matrix])
            self.refuses("poses.json", ["stitch", self.good, self.good, "-o", out, "--poses", poses])

    def test_poses_that_do_not_fit(self):
        other, poses = self.path / "other.mha", self.path / "poses.json"
        voxels = blobs((20, 20, 24))
        write_mha(self.good, voxels[:, :, :20])
        write_mha(other, voxels[:, :, 4:], origin=(4, 0, 0))
        write_poses(poses, ["good.mha"], [numpy.eye(4)])
        self.refuses("other.mha", ["stitch", self.good, other, "-o", self.path / "out.mha", "--poses", poses], ["poses.json"])
        # A volume that has moved since the poses were found: nothing may be moved twice.
        self.assertIn(run("align", self.good, other, "-o", poses).returncode, (0, 3))
        write_mha(other, voxels[:, :, 4:], origin=(4, 0, 0), direction=turned(1))
        for command in (["stitch", self.good, other, "-o", self.path / "out.mha", "--poses", poses],
                        ["align", self.good, other, "-o", self.path / "new.json", "--poses", poses], ["score", poses, "--truth", poses]):
            self.refuses("other.mha", command, ["geometry"])

    def test_missing_poses(self):
        missing = self.path / "missing.json"
        self.refuses("missing.json", ["stitch", self.good, self.good, "-o", self.path / "out.mha", "--poses", missing])
        self.refuses("missing.json", ["score", missing, "--truth", missing])
        self.refuses("missing.json", ["info", missing])

    # Outputs.

    def test_a_full_disk(self):
        """The size of files is limited in the child: writes fail part of the way. What was there before stays."""
        def small_disk():
            resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))

        noise = self.path / "noise.mha"
        write_mha(noise, numpy.random.default_rng(1).integers(1, 255, (20, 20, 20), "u1"))
        for name in ("out.mha", "out.mhd", "out.nrrd", "out.vti"):
            for exists in (False, True):
                if exists:
                    (self.path / name).write_bytes(b"precious")
                self.refuses(name, ["convert", noise, self.path / name], preexec_fn=small_disk)
                self.refuses(name, ["stitch", noise, noise, "-o", self.path / name], preexec_fn=small_disk)
        twin = self.path / "twin.mha"
        twin.write_bytes(noise.read_bytes())
        self.refuses("moved/", ["align", noise, twin, "-o", self.path / "p.json", "--apply", self.path / "moved"],
                     preexec_fn=small_disk)
        self.refuses("volumes/volume_1", ["phantom", "-o", self.path / "volumes", "--spacing", 4, "--count", 2], preexec_fn=small_disk)

    def test_a_full_disk_of_a_scene(self):
        """Files that VTK writes: surfaces, displacements."""
        scene, whole = self.path / "scene.json", self.path / "whole"
        scene.write_text(json.dumps({
            "schema": "echorama-scene-1", "name": "block", "seed": 3, "background": "gel", "press": {"spacingMm": 4},
            "volume": {"spacingMm": 6, "knockMm": 8, "knockDegrees": 6},
            "tissue": [{"name": "block", "box": {"centre": [0, 0, 30], "size": [90, 90, 60], "material": "muscle"}}],
            "views": {"poses": [{"face": [0, 0, 4], "target": [0, 0, 50]}]},
            "probe": {"preset": "mechanical-3d", "depthMinMm": 2, "depthMaxMm": 60, "elements": 20, "sweepSteps": 12, "samples": 120}}))
        run_json("synthesize", scene, "-o", whole)
        for name in ("geometry.vtp", "displacement_1.vti"):
            most = (whole / name).stat().st_size * 9 // 10
            self.refuses("parts/" + name, ["synthesize", scene, "-o", self.path / "parts"], ["it cannot be written"],
                         preexec_fn=lambda size=most: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size)))

    def test_a_full_device(self):
        if not pathlib.Path("/dev/full").exists():
            self.skipTest("/dev/full is not there")
        self.refuses("/dev/full", ["stitch", self.good, self.good, "-o", "/dev/full"])
        for arguments in (["info", self.good], ["info", self.good, "--json"]):
            with open("/dev/full", "w", encoding="ascii") as full:
                done = subprocess.run([PROGRAM, *arguments], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
            self.assertEqual(done.returncode, 1)
            self.assertIn("standard output", done.stderr)

    def test_places_that_cannot_be_written(self):
        (self.path / "folder.mha").mkdir()
        for place in (self.path / "nowhere" / "out.mha", self.path / "folder.mha", "/proc/out.mha"):
            self.refuses(place, ["stitch", self.good, self.good, "-o", place])
            self.refuses(place, ["convert", self.good, place])
        self.refuses("good.mha", ["phantom", "-o", self.good / "below"])
        self.refuses("out.banana", ["convert", self.good, self.path / "out.banana"], ["extension"], status=2)
        self.refuses("nowhere", ["align", self.good, self.good, "-o", self.path / "nowhere" / "poses.json"])

    def test_inputs_are_never_overwritten(self):
        other = self.path / "other.mha"
        write_mha(other, blobs(seed=2), origin=(3, 0, 0))
        mask = self.path / "good.ValidRegion.mha"
        write_mha(mask, numpy.ones((20, 20, 20), "u1"))
        (self.path / "link.mha").symlink_to("good.mha")
        os.link(self.good, self.path / "hard.mha")
        for place in ("good.mha", "link.mha", "hard.mha", "../" + self.path.name + "/good.mha", "good.ValidRegion.mha"):
            self.refuses("input", ["stitch", self.good, other, "-o", self.path / place])
            self.refuses("input", ["convert", self.good, self.path / place])
        self.refuses("input", ["align", self.good, other, "-o", self.good])
        self.refuses("input", ["align", self.good, other, "-o", self.path / "poses.json", "--apply", self.path])
        self.refuses("input", ["convert", mask, self.good])  # the valid region of the output would be the input
        poses = self.path / "poses.json"
        write_poses(poses, ["good.mha", "other.mha"], [numpy.eye(4)] * 2)
        self.refuses("input", ["align", self.good, other, "-o", poses, "--poses", poses])

    def test_two_volumes_of_one_name(self):
        (self.path / "sub").mkdir()
        write_mha(self.path / "sub" / "good.mha", blobs(seed=2))
        self.refuses("good.mha", ["align", self.good, self.path / "sub" / "good.mha", "-o", self.path / "poses.json", "--apply",
                                  self.path / "moved"], ["twice"])


if __name__ == "__main__":
    unittest.main()
