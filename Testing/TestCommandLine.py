#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The program echorama from end to end: phantom, align, score, stitch, info, convert, view; its manners on the way."""
import json
import os
import pathlib
import pty
import re
import shutil
import signal
import struct
import subprocess
import tempfile
import time
import unittest
import zlib

import numpy

from program_under_test import PROGRAM, blobs, read_mha, run, run_json, snapshot, turned, write_mha, write_poses

work = None     # a folder for all tests
phantom = None  # the folder of phantom volumes in it
FILES = ["volume_1.mha", "volume_2.mha", "volume_3.mha"]
# Enough points for these volumes, and quick; and sound in a phantom is as fast as the scanner takes it to be.
FEWER_POINTS = ["--points", "4000", "--sound-speed-error", "0"]


def setUpModule():
    global work, phantom
    work = pathlib.Path(tempfile.mkdtemp())
    phantom = work / "a phantöm"  # a space and a letter beyond ASCII, on purpose
    done = run("phantom", "-o", phantom, "--spacing", 2.5, "--seed", 5)
    assert done.returncode == 0, done.stderr


def tearDownModule():
    shutil.rmtree(work)


def volumes():
    return [phantom / name for name in FILES]


def truth():
    return json.loads((phantom / "truth.json").read_text())


def peak_of(*arguments):
    """The largest memory of `echorama arguments`, bytes, and the JSON that it printed."""
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen([PROGRAM, *map(str, arguments), "--json", "--threads", "2"], stdout=output, stderr=subprocess.DEVNULL)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        assert process.returncode == 0, arguments
        return usage.ru_maxrss * 1024, json.load(output)


def started(folder, *arguments, signal_number=signal.SIGINT):
    """A process of `echorama arguments` in a folder that has come so far that it catches the signal."""
    process = subprocess.Popen([PROGRAM, *map(str, arguments)], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               text=True, cwd=folder)
    caught = re.compile(r"^SigCgt:\s*(\w+)", re.M)
    status = pathlib.Path(f"/proc/{process.pid}/status")
    while process.poll() is None and not int(caught.search(status.read_text())[1], 16) >> (signal_number - 1) & 1:
        time.sleep(0.05)  # however long the machine takes to start it
    return process


def pieces_of(terminal):
    """What is shown there, until the other end is closed; then it is closed, too."""
    try:
        while piece := os.read(terminal, 4096):
            yield piece
    except OSError:
        pass  # the other end is closed
    os.close(terminal)


def affine_of(pose):
    return numpy.array(pose["VolumeToWorld"])


class Usage(unittest.TestCase):
    def test_help(self):
        self.assertEqual(run("--help").returncode, 0)
        self.assertRegex(run("--version").stdout, r"^echorama \d+\.\d+\.\d+\n$")
        commands = re.findall(r"^  ([a-z][a-z-]*) ", run("--help").stdout, re.MULTILINE)
        self.assertGreater(len(commands), 10)
        for command in commands:
            done = run(command, "--help")
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertIn("--threads", done.stdout)

    def test_wrong_usage_is_status_2(self):
        some = volumes()
        for arguments in ([], ["banana"], ["info"], ["info", some[0], "--banana"], ["info", some[0], "--threads", "-1"],
                          ["info", some[0], "--threads", "many"], ["convert", some[0]], ["stitch", *some],
                          ["stitch", *some, "-o", work / "no.mha", "--method", "banana"],
                          ["stitch", *some, "-o", work / "no.mha", "--sharpness", "-1"],
                          ["stitch", *some, "-o", work / "no.mha", "--spacing", "-1"], ["align", *some, "--start", "nowhere"],
                          ["align", *some, "--metric", "banana"], ["align", *some, "--method", "search"],
                          ["align", *some, "-o", work / "no.json", "--fixed", "0"],
                          ["align", *some, "-o", work / "no.json", "--fixed", "4"],
                          ["align", *some, "-o", work / "no.json", "--hold", "4"],
                          ["align", *some, "-o", work / "no.json", "--points"],
                          ["align", *some, "-o", work / "no.json", "--points", "many"],
                          ["align", *some, "-o", work / "no.json", "--points", "99"], ["score", phantom / "truth.json"],
                          ["score", phantom / "truth.json", "--landmarks", work / "one.csv"],
                          ["phantom"], ["phantom", "-o", work / "no", "--count", "0"], ["view"],
                          ["view", some[0], "--screenshot", work / "no.png", "--size", "1", "1"]):
            done = run(*arguments)
            self.assertEqual(done.returncode, 2, f"{arguments}: {done.stderr}")
            self.assertTrue(done.stderr.startswith("echorama: "), done.stderr)
            self.assertEqual(done.stdout, "")
            self.assertEqual(done.stderr.count("\n"), 1)
        self.assertEqual(sorted(path.name for path in work.iterdir() if path.name.startswith("no")), [])

    def test_errors_as_json(self):
        for status, arguments in ((1, ["info", work / "missing.mha"]), (2, ["info", "--threads", "-1", "--json"]),
                                  (2, ["--json"])):
            done = run(*arguments, *(["--json"] if "--json" not in arguments else []))
            self.assertEqual(done.returncode, status)
            self.assertTrue(json.loads(done.stdout)["error"])
            self.assertTrue(done.stderr.startswith("echorama: "))


class Phantom(unittest.TestCase):
    def test_files(self):
        self.assertEqual(sorted(path.name for path in phantom.iterdir() if ".ValidRegion." not in path.name), ["truth.json", *FILES])
        self.assertEqual([volume["file"] for volume in truth()["volumes"]], FILES)

    def test_knock_is_as_told(self):
        """The first volume stays; the others are turned by 6 degrees and moved by 8 mm about the centre of their valid region."""
        poses = [affine_of(pose) for pose in truth()["volumes"]]
        numpy.testing.assert_allclose(poses[0], numpy.eye(4), atol=1e-12)
        for name, pose in zip(FILES[1:], poses[1:]):
            self.assertAlmostEqual(numpy.degrees(numpy.arccos((numpy.trace(pose[:3, :3]) - 1) / 2)), 6, places=6)
            header, _ = read_mha(phantom / name)
            valid = read_mha(phantom / name.replace(".mha", ".ValidRegion.mha"))[1]
            index = numpy.argwhere(valid).mean(0)[::-1]
            numbers = {key: numpy.array(header[key].split(), float) for key in ("TransformMatrix", "Offset", "ElementSpacing")}
            centre = numbers["Offset"] + numbers["TransformMatrix"].reshape(3, 3).T @ (numbers["ElementSpacing"] * index)
            self.assertAlmostEqual(numpy.linalg.norm(pose[:3, :3] @ centre + pose[:3, 3] - centre), 8, places=3)

    def test_the_knock_is_what_was_asked_for(self):
        run_json("phantom", "-o", work / "far", "--count", 2, "--spacing", 3, "--knock-mm", 21, "--knock-degrees", 17, "--format", "nrrd",
                 "--overlap", 0.8)
        pose = affine_of(json.loads((work / "far" / "truth.json").read_text())["volumes"][1])
        self.assertAlmostEqual(numpy.degrees(numpy.arccos((numpy.trace(pose[:3, :3]) - 1) / 2)), 17, places=6)
        files = [work / "far" / f"volume_{i}.nrrd" for i in (1, 2)]
        write_poses(work / "far_still.json", files, [numpy.eye(4)] * 2)
        off = run_json("score", work / "far_still.json", "--truth", work / "far" / "truth.json")["volumes"][1]["mean_mm"]
        self.assertTrue(20 < off < 32, off)
        # So is what the neighbours share.
        told = run_json("stitch", *files, "-o", work / "far.mha", "--poses", work / "far" / "truth.json", "--method", "average", "--spacing", 4)
        shared = told["overlap_fraction"]
        self.assertAlmostEqual(2 * shared / (1 + shared), 0.8, delta=0.03)  # shared voxels over those of one volume

    def test_seed(self):
        for name, seed, count in (("same", 5, 3), ("other", 6, 2)):
            run_json("phantom", "-o", work / name, "--spacing", 2.5, "--seed", seed, "--count", count)
        contents = [{path.name: path.read_bytes() for path in folder.iterdir()} for folder in (phantom, work / "same", work / "other")]
        self.assertEqual(contents[0], contents[1])
        self.assertNotEqual(contents[0]["volume_1.mha"], contents[2]["volume_1.mha"])
        other = json.loads(contents[2]["truth.json"])["volumes"][1]
        self.assertGreater(abs(affine_of(other) - affine_of(truth()["volumes"][1])).max(), 0.01)

    def test_what_sets_volumes_apart(self):
        """Each planted difference changes the volumes it is for and no others, and landmarks tell where tissue is seen."""
        def contents(name, *options):
            run_json("phantom", "-o", work / name, "--spacing", 2.5, "--seed", 5, "--count", 2, *options)
            return [(work / name / file).read_bytes() for file in FILES[:2]]

        unchanged = contents("changed", "--landmarks", 30)
        for options, first_stays in ((("--decorrelation", 0.5), False), (("--noise", -10), False), (("--rib", 0.3), True),
                                     (("--jets",), True), (("--deformation", 3, "--landmarks", 30), True)):
            changed = contents("changed" + options[0], *options)
            self.assertEqual(changed[0] == unchanged[0], first_stays, options)
            self.assertNotEqual(changed[1], unchanged[1], options)

        def error(name, poses="truth.json"):
            return run_json("score", work / name / poses, "--landmarks", *(work / name / f"landmarks_{i}.csv" for i in (1, 2)))["landmarks"]

        right = error("changed")
        self.assertEqual(right["pairs"], 30)
        self.assertLess(right["max_mm"], 1e-9)
        pressed = error("changed--deformation")  # the part of the deformation that is left after the true poses
        self.assertTrue(0.2 < pressed["mean_mm"] < pressed["max_mm"] <= 3, pressed)
        self.assertEqual(len(pressed["errors"]), pressed["pairs"])


class MainJob(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.poses = work / "poses.json"
        cls.moved = work / "moved"
        cls.aligned = run_json("align", *volumes(), "-o", cls.poses, "--apply", cls.moved, *FEWER_POINTS)

    def test_align_finds_the_truth(self):
        still = work / "still.json"
        write_poses(still, volumes(), [numpy.eye(4)] * 3)
        before = run_json("score", still, "--truth", phantom / "truth.json")
        after = run_json("score", self.poses, "--truth", phantom / "truth.json")
        self.assertGreater(before["score_mm"], 6)
        self.assertLess(after["score_mm"], 1.25)  # half a voxel
        self.assertEqual(len(after["volumes"]), 3)
        perfect = run_json("score", phantom / "truth.json", "--truth", phantom / "truth.json")
        self.assertLess(perfect["score_mm"], 1e-9)

    def test_score_of_a_known_shift(self):
        """A volume that is 3 mm off in a known direction scores 3 mm, whatever the other is."""
        shifted = [affine_of(pose) for pose in truth()["volumes"]]
        shifted[2] = shifted[2].copy()
        shifted[2][0, 3] += 3
        write_poses(work / "shifted.json", volumes(), shifted)
        score = run_json("score", work / "shifted.json", "--truth", phantom / "truth.json")
        self.assertAlmostEqual(score["volumes"][2]["mean_mm"], 3, places=6)
        self.assertAlmostEqual(score["score_mm"], 1.5, places=6)
        # Points of a volume that is turned are not all as far off; a single one has no spread.
        still = work / "turned.json"
        write_poses(still, volumes(), [numpy.eye(4)] * 3)
        many, one = (run_json("score", still, "--truth", phantom / "truth.json", *points)["volumes"][1] for points in ((), ("--points", 1)))
        self.assertGreater(many["max_mm"], many["mean_mm"] + 1)
        self.assertEqual([one[key] for key in ("median_mm", "percentile95_mm", "max_mm")], [one["mean_mm"]] * 3)

    def test_align_tells_how_sure_it_is(self):
        told = self.aligned
        self.assertEqual(told["verdict"], "aligned")
        for volume in told["volumes"]:
            self.assertEqual((volume["verdict"], volume["reason"]), ("aligned", ""))
            covariance = numpy.array(volume["covariance"])
            numpy.testing.assert_allclose(covariance, covariance.T, rtol=1e-9)
            self.assertGreaterEqual(numpy.linalg.eigvalsh(covariance).min(), 0)
            self.assertEqual(len(volume["centre"]), 3)
        self.assertGreater(min(volume["overlap"] for volume in told["volumes"][1:]), 0.2)
        self.assertTrue(any({pair["fixed"], pair["moving"]} == {1, 2} for pair in told["pairs"]))
        for pair in told["pairs"]:
            self.assertIn(pair["verdict"], ("aligned", "ambiguous", "failed"))
            self.assertEqual(set(pair["seconds"]), {"global", "local", "confidence"})
            self.assertFalse(pair["voted_down"])
        self.assertEqual(set(told["align_seconds"]), {"prepare", "pairs", "graph"})

    def test_align_goes_on_and_plans(self):
        """A dry run writes nothing; what is known of pairs is used again; little memory finds the same poses."""
        finished, poses = work / "finished.json", [work / f"on_{i}.json" for i in range(4)]
        common = (*volumes(), "--start", "tracked", "--finished-pairs", finished, *FEWER_POINTS)
        plan = run_json("align", *common, "-o", poses[0], "--dry-run")["plan"]
        self.assertFalse(poses[0].exists())
        self.assertEqual(plan["pairs_finished_before"], 0)
        self.assertIn([1, 2], plan["pairs"])
        self.assertGreater(plan["seconds"], 0)
        self.assertGreater(plan["bytes_of_all"], 2.9 * plan["bytes_per_volume"])
        self.assertGreater(plan["bytes_per_volume"], 4 * 10**5)
        first = run_json("align", *common, "-o", poses[1])
        self.assertGreater(first["pairs_finished_before"], 0)  # those that the plan has tried
        second = run_json("align", *common, "-o", poses[2], "--memory-gb", 1e-6)
        self.assertEqual(second["pairs_finished_before"], sum(pair["attempts"] for pair in first["pairs"]))
        self.assertEqual(second["times_prepared"], 0)
        finished.unlink()
        little = run_json("align", *common, "-o", poses[3], "--memory-gb", 1e-6)
        self.assertLess(little["prepared_bytes"], 2.1 * plan["bytes_per_volume"])
        self.assertEqual(len({path.read_bytes() for path in poses[1:]}), 1)
        told = run("align", *common, "--dry-run")
        self.assertEqual(told.returncode, 0, told.stderr)
        self.assertIn(f"{len(plan['pairs'])} pairs", told.stdout)
        finished.write_text('{"schema": "echorama-poses-1"}')
        refused = run("align", *common, "-o", work / "no.json")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("finished.json", refused.stderr)
        self.assertEqual(finished.read_text(), '{"schema": "echorama-poses-1"}')

    def test_align_with_no_options(self):
        """The poses go to poses.json, and what is there already stays."""
        folder = work / "plain"
        folder.mkdir()
        files = [path.resolve() for path in volumes()[:2]]
        done = run("align", *files, cwd=folder)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("aligned", done.stdout)
        before = (folder / "poses.json").read_bytes()
        again = run("align", *files, cwd=folder)
        self.assertEqual(again.returncode, 1)
        self.assertIn("poses.json", again.stderr)
        self.assertEqual((folder / "poses.json").read_bytes(), before)

        # Another run that has written them meanwhile keeps them, even when this one is as good as done.
        (folder / "poses.json").unlink()
        self.assertEqual(run("phantom", "-o", folder / "fine", "--spacing", 1, "--seed", 5).returncode, 0)
        command = [PROGRAM, "align", "fine/volume_1.mha", "fine/volume_2.mha", "--poses", "fine/truth.json", "--start", "tracked",
                   "--deformable", "--control-spacing-mm", "8", "--minimum-gain", "0", *FEWER_POINTS]  # deforms for seconds
        terminal, child = pty.openpty()
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=child, cwd=folder)
        os.close(child)
        shown = b""
        for piece in pieces_of(terminal):
            shown += piece
            if b"deform" in shown and not (folder / "poses.json").exists():
                (folder / "poses.json").write_text("of another run")
        self.assertEqual(process.wait(timeout=300), 0, shown)
        self.assertIn(b"poses-2.json", shown)
        self.assertEqual((folder / "poses.json").read_text(), "of another run")
        self.assertEqual(json.loads((folder / "poses-2.json").read_text())["volumes"][1]["displacement"], "poses-2.displacement-2.vti")
        self.assertTrue((folder / "poses-2.displacement-2.vti").exists())

    def test_align_refuses_first_what_it_could_not_write(self):
        """Nothing is refused after the work, of which the pairs would tell."""
        folder, finished = work / "strange", work / "strange.pairs"
        folder.mkdir()
        names = [os.fsdecode(b"volume \xfc.mha"), "two.mha", "one.dat"]
        for name, path in zip(names, [*volumes()[:2], volumes()[0]]):
            shutil.copy(path, folder / name)
        for files, more, words in ((names[:2], [], "not UTF-8"), (names[1:], ["--apply", work / "no"], "one.dat: the extension names none")):
            done = run("align", *(folder / name for name in files), "-o", work / "no.json", "--start", "tracked", "--finished-pairs", finished, *more)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(words, done.stderr)
            self.assertFalse(finished.exists())
        for place in ("no", "no.json"):
            self.assertFalse((work / place).exists())

    def test_a_dry_run_replaces_nothing(self):
        poses = work / "precious.json"
        poses.write_text("precious")
        write_poses(work / "identities.json", volumes(), [numpy.eye(4)] * 3)
        run("convert", work / "identities.json", work / "identities.tfm")
        for option in (["--transforms", "-", work / "identities.volume_2.tfm", "--transforms-only"], ["--tracker", "x.csv", "--calibration", "x.json", "--tracker-only"]):
            done = run("align", *volumes()[:2], "-o", poses, "--dry-run", *option)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn("--dry-run", done.stderr)
            self.assertEqual(poses.read_text(), "precious")

    def test_poses_found_at_a_stride_are_those_of_the_whole_volumes(self):
        poses = work / "coarse.json"
        run("align", *volumes()[:2], "-o", poses, "--stride", 2, "--start", "tracked")
        recorded = json.loads(poses.read_text())["volumes"][0]["geometry"]["spacing"]
        self.assertEqual(recorded, [2 * length for length in run_json("info", volumes()[0])["files"][0]["spacing"]])
        self.assertLess(run_json("score", poses, "--truth", phantom / "truth.json")["score_mm"], 2.5)  # half a coarse voxel
        whole = run_json("stitch", *volumes()[:2], "--poses", poses, "-o", work / "whole.mha")
        self.assertEqual(whole["spacing"], run_json("info", volumes()[0])["files"][0]["spacing"])
        refused = run("align", *volumes()[:2], "-o", work / "no.json", "--stride", 2, "--apply", work / "no")
        self.assertEqual(refused.returncode, 2)
        self.assertIn("--stride", refused.stderr)

    def test_align_says_when_it_cannot(self):
        """Noise beside a phantom: exit status 3 and a reason."""
        write_mha(work / "random.mha", numpy.random.default_rng(1).integers(1, 255, (40, 40, 40), "u1"), spacing=(2.5, 2.5, 2.5))
        done = run("align", phantom / "volume_1.mha", work / "random.mha", "-o", work / "doubt.json", "--start", "hand-made", "--json")
        self.assertEqual(done.returncode, 3, done.stderr)
        told = json.loads(done.stdout)
        self.assertEqual(told["verdict"], "doubtful")
        self.assertIn(told["volumes"][1]["verdict"], ("ambiguous", "failed"))
        self.assertTrue(told["volumes"][1]["reason"])
        self.assertTrue(any("not every volume is aligned" in note for note in told["notes"]))

    def test_score_with_landmarks(self):
        """Lists of Slicer and our own, each in the frame of its volume's file; 3 mm off is an error of 3 mm."""
        places = numpy.array([[10.0, -5, 40], [-20, 8, 55], [0, 12, 70]])
        poses = [affine_of(pose) for pose in truth()["volumes"]]
        seen = [(places - pose[:3, 3]) @ pose[:3, :3] for pose in poses]  # by the inverse of each pose
        (work / "1.csv").write_text("".join(f"p{i},{x},{y},{z}\n" for i, (x, y, z) in enumerate(seen[0])))
        (work / "2.fcsv").write_text("# Markups fiducial file version = 4.11\n# CoordinateSystem = 0\n" + "".join(
            f"n{i},{-x},{-y},{z},0,0,0,1,1,1,0,p{i},,\n" for i, (x, y, z) in enumerate(seen[1])))
        (work / "3.mrk.json").write_text(json.dumps({"markups": [{"coordinateSystem": "LPS", "controlPoints": [
            {"label": f"p{i}", "position": list(point)} for i, point in enumerate(seen[2])]}]}))
        lists = [work / "1.csv", work / "2.fcsv", work / "3.mrk.json"]
        right = run_json("score", phantom / "truth.json", "--landmarks", *lists, "--truth", phantom / "truth.json")
        self.assertEqual(right["landmarks"]["pairs"], 9)
        self.assertLess(right["landmarks"]["max_mm"], 1e-9)
        self.assertLess(right["score_mm"], 1e-9)
        poses[2] = poses[2].copy()
        poses[2][1, 3] -= 3
        write_poses(work / "off.json", volumes(), poses)
        off = run_json("score", work / "off.json", "--landmarks", *lists)["landmarks"]
        self.assertAlmostEqual(off["mean_mm"], 2, places=9)  # 0 for the first pair of volumes, 3 for the others
        self.assertAlmostEqual(off["max_mm"], 3, places=9)
        numpy.testing.assert_allclose(off["errors"][3]["vector_mm"], [0, -3, 0], atol=1e-9)
        self.assertEqual(off["unmatched"], [])
        with open(lists[0], "a") as file:
            file.write("mine,0,0,0\n")
        more = run_json("score", phantom / "truth.json", "--landmarks", *lists)
        self.assertEqual([lone["label"] for lone in more["landmarks"]["unmatched"]], ["mine"])
        self.assertTrue(any('"mine"' in note for note in more["notes"]))

    def test_align_with_landmarks(self):
        """They say where to begin, whatever the poses to start from, and the result tells how far apart they are in the end."""
        places = numpy.array([[10.0, -5, 40], [-20, 8, 55], [0, 12, 70]])
        lists = []
        for number, pose in enumerate([affine_of(pose) for pose in truth()["volumes"]][:2], 1):
            lists.append(work / f"marks{number}.csv")
            lists[-1].write_text("".join(f"p{i},{x},{y},{z}\n" for i, (x, y, z) in enumerate((places - pose[:3, 3]) @ pose[:3, :3])))
        far = numpy.eye(4)
        far[:3] = [[0, -1, 0, 200], [1, 0, 0, -50], [0, 0, 1, 30]]
        write_poses(work / "far.json", volumes()[:2], [numpy.eye(4), far])
        told = run_json("align", *volumes()[:2], "--landmarks", *lists, "--poses", work / "far.json", "-o", work / "marked.json", *FEWER_POINTS)
        self.assertEqual(told["verdict"], "aligned")
        self.assertEqual(told["landmarks"]["pairs"], 3)
        self.assertLess(told["landmarks"]["max_mm"], 2)
        self.assertFalse(told["pairs"][0]["anywhere"])
        lists[1].write_text(lists[1].read_text().replace("p0", "x").replace("p1", "p0").replace("x,", "p1,"))
        wrong = run("align", *volumes()[:2], "--landmarks", *lists, "-o", work / "swapped.json", *FEWER_POINTS, "--json")
        self.assertEqual(wrong.returncode, 3, wrong.stderr)
        self.assertNotEqual(json.loads(wrong.stdout)["volumes"][1]["verdict"], "aligned")
        for arguments in (["--landmarks", lists[0]], ["--landmarks", lists[0], work / "missing.csv"], ["--landmarks", lists[0], "-"]):
            done = run("align", *volumes()[:2], *arguments, "-o", work / "nothing.json")
            self.assertNotEqual(done.returncode, 0)
            self.assertFalse((work / "nothing.json").exists())

    def test_pose_file(self):
        text = json.loads(self.poses.read_text())
        self.assertEqual((text["schema"], text["unit"], text["frame"]), ("echorama-poses-1", "mm", "LPS"))
        self.assertEqual([(work / volume["file"]).resolve() for volume in text["volumes"]], [path.resolve() for path in volumes()])
        numpy.testing.assert_array_equal(affine_of(text["volumes"][0]), numpy.eye(4))
        for told, written in zip(self.aligned["volumes"], text["volumes"]):
            self.assertEqual(told["VolumeToWorld"], written["VolumeToWorld"])
            info = run_json("info", told["file"])["files"][0]
            for key in ("origin", "spacing", "direction", "dimensions"):
                numpy.testing.assert_allclose(written["geometry"][key], info[key], atol=1e-12)

    def test_apply_moves_and_changes_nothing_else(self):
        for name, pose in zip(FILES, self.aligned["volumes"]):
            before, after = run_json("info", phantom / name)["files"][0], run_json("info", self.moved / name)["files"][0]
            matrix = numpy.array(pose["VolumeToWorld"])
            numpy.testing.assert_allclose(after["origin"], matrix[:3, :3] @ before["origin"] + matrix[:3, 3], atol=1e-9)
            numpy.testing.assert_allclose(after["direction"], matrix[:3, :3] @ before["direction"], atol=1e-12)
            probe = numpy.array(before["acquisition"]["ProbeToWorld"])
            numpy.testing.assert_allclose(after["acquisition"]["ProbeToWorld"], matrix @ probe, atol=1e-9)
            numpy.testing.assert_array_equal(read_mha(phantom / name)[1], read_mha(self.moved / name)[1])
            mask = name.replace(".mha", ".ValidRegion.mha")
            numpy.testing.assert_array_equal(read_mha(phantom / mask)[1], read_mha(self.moved / mask)[1])

    def test_start_poses_and_fixed_volume(self):
        """From the truth the aligner stays there, and the fixed volume is where the start says, to the last bit."""
        common = ["--poses", phantom / "truth.json", "--fixed", 2, "--start", "tracked", *FEWER_POINTS]
        again = run_json("align", *volumes(), "-o", work / "again.json", *common)
        numpy.testing.assert_allclose(again["volumes"][1]["VolumeToWorld"], affine_of(truth()["volumes"][1]), atol=1e-12)
        self.assertEqual(again["fixed"], 2)
        self.assertLess(run_json("score", work / "again.json", "--truth", phantom / "truth.json", "--fixed", 2)["score_mm"], 1.25)
        # Another likeness finds the same place, and other digits of it.
        other = run_json("align", *volumes(), "-o", work / "other.json", "--metric", "ncc", *common)
        self.assertLess(run_json("score", work / "other.json", "--truth", phantom / "truth.json", "--fixed", 2)["score_mm"], 1.25)
        self.assertNotEqual(other["volumes"][0]["VolumeToWorld"], again["volumes"][0]["VolumeToWorld"])

    def test_held_volumes(self):
        """With one volume held beside the fixed one, only the third moves."""
        again = run_json("align", *volumes(), "-o", work / "held.json", "--poses", phantom / "truth.json", "--hold", "2", "--start",
                         "tracked", *FEWER_POINTS)
        for i in (0, 1):
            numpy.testing.assert_allclose(again["volumes"][i]["VolumeToWorld"], affine_of(truth()["volumes"][i]), atol=1e-12)
        self.assertEqual(sorted((pair["fixed"], pair["moving"]) for pair in again["pairs"]), [(1, 3), (2, 3)])
        self.assertGreater(abs(numpy.array(again["volumes"][2]["VolumeToWorld"]) - affine_of(truth()["volumes"][2])).max(), 0)

    def test_align_deformable(self):
        """The displacements lie beside the poses, which name them, and stitch reads the volumes through them."""
        poses, files = work / "bent.json", volumes()[:2]
        common = ["--poses", phantom / "truth.json", "--start", "tracked", "--deformable", *FEWER_POINTS]
        told = run_json("align", *files, "-o", poses, *common, "--minimum-gain", 0)  # so that the little there is is taken
        bent = told["volumes"][1]["deformation"]
        self.assertTrue(bent["applied"], bent)
        self.assertGreater(bent["similarity_after"], bent["similarity_before"])
        self.assertGreater(bent["smallest_determinant"], 0.5)
        self.assertNotIn("deformation", told["volumes"][0])
        text = json.loads(poses.read_text())
        self.assertNotIn("displacement", text["volumes"][0])
        self.assertEqual(text["volumes"][1].pop("displacement"), "bent.displacement-2.vti")
        (work / "unbent.json").write_text(json.dumps(text))
        stitched = []
        for name in ("bent", "unbent"):
            run_json("stitch", *files, "-o", work / f"{name}.mha", "--poses", work / f"{name}.json", "--spacing", 3)
            stitched.append(read_mha(work / f"{name}.mha")[1].astype(int))
        self.assertTrue((stitched[0] != stitched[1]).any())
        good = (work / "bent.displacement-2.vti").read_text()
        for bad in (good.replace('type="Float64"', 'type="Float99"'), good.replace("</VTKFile>", "")):
            (work / "bent.displacement-2.vti").write_text(bad)
            damaged = run("stitch", *files, "-o", work / "damaged.mha", "--poses", poses, "--spacing", 3)
            self.assertEqual(damaged.returncode, 1)
            self.assertIn("bent.displacement-2.vti: ", damaged.stderr)
        (work / "bent.displacement-2.vti").unlink()
        missing = run("stitch", *files, "-o", work / "missing.mha", "--poses", poses, "--spacing", 3)
        self.assertEqual(missing.returncode, 1)
        self.assertIn("bent.displacement-2.vti", missing.stderr)
        none = run_json("align", *files, "-o", work / "straight.json", *common, "--minimum-gain", 1)["volumes"][1]["deformation"]
        self.assertFalse(none["applied"])
        self.assertIn("MinimumGain", none["reason"])
        self.assertNotIn("displacement", (work / "straight.json").read_text())

    def test_stitch(self):
        """Stitched with poses, or from volumes that were moved there: the same."""
        told = run_json("stitch", *volumes(), "-o", work / "stitched.mha", "--poses", self.poses, "--spacing", 3)
        self.assertEqual(run("stitch", *[self.moved / name for name in FILES], "-o", work / "stitched_moved.mha", "--spacing", 3).returncode, 0)
        header, voxels = read_mha(work / "stitched.mha")
        numpy.testing.assert_array_equal(voxels, read_mha(work / "stitched_moved.mha")[1])
        self.assertEqual(list(voxels.shape[::-1]), told["dimensions"])
        numpy.testing.assert_array_equal([float(x) for x in header["ElementSpacing"].split()], [3, 3, 3])
        self.assertGreater(told["overlap_fraction"], 0.4)
        for method in ("feather", "average", "maximum"):
            run_json("stitch", *volumes(), "-o", work / f"{method}.mha", "--poses", self.poses, "--spacing", 3, "--method", method,
                     "--texture", "mix")
        results = {method: read_mha(work / f"{method}.mha")[1].astype(int) for method in ("feather", "average", "maximum")}
        self.assertTrue((results["maximum"] >= results["average"]).all())
        self.assertTrue((results["average"] != results["feather"]).any())
        run_json("stitch", *volumes(), "-o", work / "blunt.mha", "--poses", self.poses, "--spacing", 3, "--sharpness", 0, "--texture", "mix")
        self.assertLessEqual(abs(read_mha(work / "blunt.mha")[1].astype(int) - results["average"]).max(), 1)

    def test_a_project_paints_and_carves(self):
        """Strokes of a project are part of its volumes: what was carved does not come back."""
        folder = work / "project"
        folder.mkdir()
        for name in ("a.mha", "b.mha"):
            write_mha(folder / name, numpy.full((20, 20, 20), 100, "u1"))
        brush = {"radiusMm": 3, "intensity": 200, "opacity": 1, "hardness": 1, "insideValid": True}
        carve = {**brush, "mode": "carve", "pathMm": [[5, 10, 10]]}
        paint = {**brush, "mode": "paint", "pathMm": [[14, 10, 10]]}
        pose = numpy.eye(4).tolist()
        project = {"schema": "echorama-project-1", "unit": "mm", "frame": "LPS", "volumes": [
            {"name": "a", "file": "a.mha", "VolumeToWorld": pose, "strokes": [carve, paint]},
            {"name": "b", "file": "b.mha", "VolumeToWorld": pose, "strokes": [carve, paint]}]}
        (folder / "project.json").write_text(json.dumps(project))
        told = run_json("stitch", folder / "a.mha", folder / "b.mha", "--poses", folder / "project.json", "-o", folder / "out.mha",
                        "--spacing", 1)
        self.assertEqual(sum("2 strokes" in note for note in told["notes"]), 2)
        _, voxels = read_mha(folder / "out.mha")
        _, valid = read_mha(folder / "out.ValidRegion.mha")
        self.assertEqual((valid[10, 10, 5], valid[10, 10, 14], valid[10, 10, 1]), (0, 1, 1))
        self.assertEqual(int(valid.size - valid.sum()), sum((z - 10) ** 2 + (y - 10) ** 2 + (x - 5) ** 2 <= 9
                                                            for z in range(20) for y in range(20) for x in range(20)))
        self.assertEqual((voxels[10, 10, 14], voxels[10, 10, 18]), (200, 100))

    def test_stitch_in_every_way(self):
        """All methods and textures give a volume of the same shape and valid region, and no two of them the same voxels."""
        folder = work / "ways"
        folder.mkdir()
        arguments = [*volumes(), "--poses", phantom / "truth.json", "--spacing", 4]
        ways = [(method, "split") for method in ("membrane", "distance", "feather", "average", "maximum")]
        voxels, regions = set(), set()
        for method, texture in [*ways, ("membrane", "mix")]:
            out = folder / f"{method}_{texture}.nrrd"
            told = run_json("stitch", *arguments, "-o", out, "--method", method, "--texture", texture)
            self.assertEqual((told["method"], told["texture"]), (method, texture))
            voxels.add(out.read_bytes())
            regions.add(out.with_name(f"{out.stem}.ValidRegion.nrrd").read_bytes())
        self.assertEqual((len(voxels), len(regions)), (6, 1))
        refused = run("stitch", *arguments, "-o", folder / "none.nrrd", "--method", "multiband")
        self.assertEqual(refused.returncode, 2)
        self.assertIn("feather", refused.stderr)
        default = run_json("stitch", *arguments, "-o", folder / "default.nrrd")
        self.assertEqual((folder / "default.nrrd").read_bytes(), (folder / f"{default['method']}_{default['texture']}.nrrd").read_bytes())

    def test_stitch_parts_detail_from_the_rest(self):
        """A wave of each volume, across that of the other. Where the smooth part is the plain average and details are those of one
        volume, as much of a wave of wavelength L is averaged as a Gaussian of standard deviation s leaves: exp(-(2 pi s / L)^2 / 2)."""
        wave = 100 + 40 * numpy.cos(2 * numpy.pi * numpy.arange(48) / 12)
        write_mha(work / "along_x.mha", numpy.broadcast_to(wave, (48, 24, 48)).astype("u1"))
        write_mha(work / "along_z.mha", numpy.broadcast_to(wave[:, None, None], (48, 24, 48)).astype("u1"), origin=(0, 12, 0))

        def kept(*options):
            """The share of the first volume's wave where its own details are shown, and where those of the other are."""
            run_json("stitch", work / "along_x.mha", work / "along_z.mha", "-o", work / "waves.mha", "--sharpness", 0, *options)
            middle = read_mha(work / "waves.mha")[1][6:42, :, 6:42].astype(float)  # whole periods
            return [2 * (middle[:, rows] * (wave[6:42] - 100) / 40).mean() / 40 for rows in (slice(13, 16), slice(20, 23))]

        for scale in (2, 4):
            smooth = numpy.exp(-(2 * numpy.pi * scale / 12) ** 2 / 2)
            numpy.testing.assert_allclose(kept("--detail-scale", scale), [1 - smooth / 2, smooth / 2], atol=0.05)
        # The plain average of details too, but as strong as one of them.
        smooth = numpy.exp(-(2 * numpy.pi * 2 / 12) ** 2 / 2)
        numpy.testing.assert_allclose(kept("--detail-sharpness", 0), [smooth / 2 + (1 - smooth) / 2**0.5] * 2, atol=0.05)

    def test_stitch_tells_first_what_it_needs(self):
        before = snapshot(work)
        arguments = ["stitch", *volumes(), "--poses", phantom / "truth.json", "--spacing", 1.5]
        whole = run_json(*arguments, "-o", work / "dry.mha", "--dry-run")
        self.assertEqual((whole["slabs"], whole["plan_factor"]), (1, 1))
        self.assertGreater(whole["output_bytes"], numpy.prod(whole["dimensions"]))
        small = run_json(*arguments, "-o", work / "dry.mha", "--dry-run", "--memory", 1e-9 * whole["output_bytes"] / 4)
        self.assertGreater(small["slabs"], 4)
        self.assertGreater(small["plan_factor"], 1)
        self.assertLess(small["plan_bytes"], small["allowed_bytes"])
        told = run(*arguments, "-o", work / "dry.mha", "--dry-run", "--memory", 1e-9 * whole["output_bytes"] / 4)
        self.assertIn(f"{small['slabs']} slabs", told.stdout)
        refused = run(*arguments, "-o", work / "dry.vti", "--memory", 1e-9 * whole["output_bytes"] / 4)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("dry.vti", refused.stderr)
        self.assertIn(f"{small['slabs']} slabs", refused.stderr)
        hopeless = run(*arguments, "-o", work / "dry.mha", "--memory", 1e-6)
        self.assertEqual(hopeless.returncode, 1)
        self.assertIn("would fit", hopeless.stderr)
        self.assertEqual(snapshot(work), before)

    def test_stitch_more_than_fits(self):
        """A result four times the memory that is allowed is written slab by slab, and is the whole one but for what a coarser
        plan leaves out in overlaps."""
        arguments = ["stitch", *volumes(), "--poses", phantom / "truth.json", "--spacing", 1.0]
        resting, _ = peak_of(*arguments, "-o", work / "slabs.nii", "--dry-run")
        needed, whole = peak_of(*arguments, "-o", work / "whole.nii", "--uncertainty")
        limit = whole["output_bytes"] / 4.1  # bytes
        peak, slabs = peak_of(*arguments, "-o", work / "slabs.nii", "--uncertainty", "--memory", 1e-9 * limit)
        self.assertGreater(slabs["slabs"], 4)
        self.assertEqual(whole["valid_voxels"], slabs["valid_voxels"])
        self.assertEqual(whole["overlap_fraction"], slabs["overlap_fraction"])
        # The limit is of the voxels that are held; readers, threads and the allocator take some 8 MB more, whatever the size.
        self.assertLess(peak - resting, limit + 14e6, (resting, needed, limit))
        self.assertLess(peak - resting, 0.7 * whole["output_bytes"], (resting, needed, limit))
        self.assertGreater(needed - resting, whole["output_bytes"])
        names = ["whole", "slabs", "whole.ValidRegion", "slabs.ValidRegion", "whole.Coverage"]
        voxels = {}
        for name in names:
            run_json("convert", work / f"{name}.nii", work / f"{name}.mha")
            voxels[name] = read_mha(work / f"{name}.mha")[1].astype(int)
        numpy.testing.assert_array_equal(voxels["whole.ValidRegion"], voxels["slabs.ValidRegion"])
        shared = voxels["whole.Coverage"] > 1
        difference = abs(voxels["whole"] - voxels["slabs"])
        self.assertLessEqual(numpy.percentile(difference[~shared], 99.9), 1)
        self.assertLess(difference[shared].mean(), 1)
        self.assertLess(numpy.percentile(difference[shared], 99), 12)

    def test_stitch_equalizes_gains(self):
        header, voxels = read_mha(phantom / FILES[1])
        numbers = lambda key: [float(number) for number in header[key].split()]
        quiet = work / "quiet.mha"
        write_mha(quiet, (0.75 * voxels).astype("u1"), numbers("ElementSpacing"), numbers("Offset"),
                  numpy.reshape(numbers("TransformMatrix"), (3, 3)).T)
        shutil.copy(phantom / "volume_2.ValidRegion.mha", work / "quiet.ValidRegion.mha")
        poses = work / "quiet.json"
        first = [affine_of(pose) for pose in truth()["volumes"]]
        write_poses(poses, [phantom / FILES[0], quiet], first[:2])
        told = run_json("stitch", phantom / FILES[0], quiet, "-o", work / "loud.mha", "--poses", poses, "--spacing", 3, "--gain")
        self.assertAlmostEqual(told["gains"][1]["gain"] / told["gains"][0]["gain"], 1 / 0.75, delta=0.05)
        self.assertNotIn("gains", run_json("stitch", phantom / FILES[0], quiet, "-o", work / "loud.mha", "--poses", poses, "--spacing", 3))

    def test_stitch_tells_how_good_it_is(self):
        told = {texture: run_json("stitch", *volumes(), "-o", work / "good.mha", "--poses", phantom / "truth.json", "--texture", texture,
                                  "--uncertainty", "--quality") for texture in ("mix", "split")}
        for quality in (told["mix"]["quality"], told["split"]["quality"]):
            self.assertLess(quality["seam_mean"], 1.5)
            self.assertTrue(0.5 < quality["texture_kept"] < 1.2, quality)
        self.assertGreater(told["split"]["quality"]["texture_kept"], told["mix"]["quality"]["texture_kept"])
        coverage, spread = (read_mha(work / f"good.{name}.mha")[1] for name in ("Coverage", "Spread"))
        self.assertEqual((coverage.dtype, spread.dtype), ("u1", "f4"))
        self.assertEqual((coverage > 0).sum(), told["split"]["valid_voxels"])
        self.assertTrue((spread[coverage < 2] == 0).all())
        self.assertGreater(spread[coverage > 1].mean(), 0)
        info = run_json("info", work / "good.mha")["files"][0]
        self.assertLessEqual({"Coverage", "Spread"}, set(info["arrays"]))

    def test_stitch_by_reliability(self):
        """The shadow of the phantom's stone is found, and filled by the volumes that look past it."""
        told = run_json("stitch", *volumes(), "-o", work / "trusted.mha", "--poses", phantom / "truth.json", "--spacing", 3, "--reliability")
        self.assertEqual([pathlib.Path(each["file"]).name for each in told["reliability"]], FILES)
        fractions = [each["shadow_fraction"] for each in told["reliability"]]
        self.assertTrue(all(0 <= fraction < 0.05 for fraction in fractions), fractions)
        self.assertGreater(max(fractions), 0.001)
        run_json("stitch", *volumes(), "-o", work / "trusting.mha", "--poses", phantom / "truth.json", "--spacing", 3)
        change = read_mha(work / "trusted.mha")[1].astype(int) - read_mha(work / "trusting.mha")[1]
        self.assertGreater((change > 20).sum(), 20 * (change < -20).sum())  # shadows became lighter
        self.assertGreater((change > 20).sum(), 20)

    def test_companions_are_no_volumes(self):
        """volume_*.mha in a shell names the valid regions too."""
        done = run("stitch", *sorted(phantom.glob("volume_*.mha")), "-o", work / "globbed.mha", "--poses", self.poses, "--spacing", 3)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("volume_2.ValidRegion.mha: not a volume of its own", done.stderr)
        run_json("stitch", *volumes(), "-o", work / "named.mha", "--poses", self.poses, "--spacing", 3)
        numpy.testing.assert_array_equal(read_mha(work / "globbed.mha")[1], read_mha(work / "named.mha")[1])

    def test_threads_change_nothing(self):
        results = []
        for threads in (1, 2):
            folder = work / f"threads{threads}"
            folder.mkdir()
            run_json("align", *volumes(), "-o", folder / "poses.json", "--threads", threads, *FEWER_POINTS)
            run_json("stitch", *volumes(), "-o", folder / "stitched.mha", "--poses", folder / "poses.json", "--threads", threads, "--spacing", 3)
            results.append({path.name: path.read_bytes() for path in folder.iterdir()})
        self.assertEqual(len(results[0]), 3)
        self.assertEqual(results[0], results[1])

    def test_view(self):
        picture = work / "view.png"
        told = run_json("view", *volumes(), "--poses", self.poses, "--screenshot", picture, "--size", 480, 360)
        self.assertEqual(told["screenshot"], str(picture))
        pixels = read_png(picture)
        self.assertEqual(pixels.shape, (360, 480, 3))
        # Each quarter shows something, and tinted volumes that overlap: not grey everywhere.
        for quarter in (pixels[:180, :240], pixels[:180, 240:], pixels[180:, :240], pixels[180:, 240:]):
            self.assertGreater((quarter.max(axis=2) > 60).mean(), 0.02)
            self.assertGreater(len(numpy.unique(quarter.reshape(-1, 3), axis=0)), 100)
        self.assertGreater(numpy.ptp(pixels.astype(int), axis=2).max(), 40)

    def test_view_labels(self):
        """What is invented is blue, what is mixed yellow, and data stay grey."""
        write_mha(work / "cube.mha", blobs((20, 20, 20)))
        run_json("embed", work / "cube.mha", "-o", work / "in_noise.mha", "--margin", 8)
        tints = {}
        for labels in ([], ["--labels"]):
            run_json("view", work / "in_noise.mha", "--screenshot", work / "labels.png", "--size", 240, 180, *labels)
            pixels = read_png(work / "labels.png").astype(int)[:90, :120]  # one of the slices
            bright = pixels.min(axis=2) > 40
            tints[bool(labels)] = [(bright & (change > 20)).mean() for change in (pixels[..., 2] - pixels[..., 0], pixels[..., 0] - pixels[..., 2])]
            grey = (bright & (numpy.ptp(pixels, axis=2) < 4)).mean()
            self.assertGreater(grey, 0.05)
        self.assertLess(max(tints[False]), 0.02)  # the lines through the middle
        self.assertGreater(tints[True][0], 0.25)
        self.assertGreater(tints[True][1], 0.05)

    def test_view_without_a_display(self):
        environment = {key: value for key, value in os.environ.items() if key != "DISPLAY"}
        done = run("view", *volumes(), "--screenshot", work / "none.png", env=environment)
        self.assertEqual(done.returncode, 1)
        self.assertIn("DISPLAY", done.stderr)
        self.assertFalse((work / "none.png").exists())


def read_png(path):
    """The pixels [row, column, rgb] of a PNG file of 8 bits, not interlaced."""
    content, at, data = path.read_bytes(), 8, b""
    while at < len(content):
        size, kind = struct.unpack(">I4s", content[at:at + 8])
        chunk = content[at + 8:at + 8 + size]
        if kind == b"IHDR":
            width, height, bits, colour = struct.unpack(">IIBB", chunk[:10])
            assert bits == 8
            channels = {2: 3, 6: 4}[colour]
        elif kind == b"IDAT":
            data += chunk
        at += size + 12
    rows = numpy.frombuffer(zlib.decompress(data), "u1").reshape(height, 1 + width * channels).astype(int)
    pixels = numpy.zeros((height, width * channels), int)
    for y in range(height):
        kind, line, above = rows[y, 0], rows[y, 1:], pixels[y - 1] if y else numpy.zeros(width * channels, int)
        for x in range(width * channels):
            left = pixels[y, x - channels] if x >= channels else 0
            corner = above[x - channels] if x >= channels else 0
            estimate = left + above[x] - corner
            paeth = min((abs(estimate - left), 0, left), (abs(estimate - above[x]), 1, above[x]), (abs(estimate - corner), 2, corner))[2]
            pixels[y, x] = (line[x] + (0, left, above[x], (left + above[x]) // 2, paeth)[kind]) & 255
    return pixels.reshape(height, width, channels)[:, :, :3].astype("u1")


class Files(unittest.TestCase):
    def test_info(self):
        path = work / "oblique.mha"
        voxels = blobs((5, 6, 7)).astype("i2") - 300  # no zeros: they would be taken for what lies outside
        direction = turned(30) @ turned(20, 0)
        write_mha(path, voxels, (0.5, 0.75, 1.25), (-10, 20, 30.125), direction)
        told = run_json("info", path)["files"][0]
        self.assertEqual(told["dimensions"], [7, 6, 5])
        self.assertEqual(told["type"], "short")
        self.assertEqual(told["range"], [voxels.min(), voxels.max()])
        self.assertAlmostEqual(told["mean"], voxels.mean(), places=9)
        self.assertEqual(told["valid_fraction"], 1)
        for key, value in (("spacing", [0.5, 0.75, 1.25]), ("origin", [-10, 20, 30.125]), ("direction", direction)):
            numpy.testing.assert_allclose(told[key], value, atol=1e-15)
        text = run("info", path).stdout
        for words in ("7 x 6 x 5", "short", "0.5000 x 0.7500 x 1.2500", "-10.000, 20.000, 30.125"):
            self.assertIn(words, text)

    def test_info_of_what_the_phantom_knows(self):
        told = run_json("info", *volumes(), phantom / "truth.json")
        self.assertEqual(len(told["files"]), 4)
        acquisition = told["files"][1]["acquisition"]
        self.assertEqual(acquisition["Seed"], 5)
        self.assertLess(acquisition["ProbeGeometry"]["depth_mm"][0], acquisition["ProbeGeometry"]["depth_mm"][1])
        self.assertEqual(told["files"][3]["poses"][0]["rotation_degrees"], 0)

    def test_convert_round_trips(self):
        start = phantom / "volume_2.mha"
        path = start
        for number, extension in enumerate(("nrrd", "mhd", "vti", "nhdr", "mha")):
            onward = work / f"round{number}.{extension}"
            self.assertEqual(run_json("convert", path, onward)["lost"], [])
            path = onward
        before, after = run_json("info", start)["files"][0], run_json("info", path)["files"][0]
        for key in ("dimensions", "type", "range", "mean", "valid_fraction", "has_valid_region", "arrays"):
            self.assertEqual(before[key], after[key])
        for key in ("origin", "spacing", "direction"):
            numpy.testing.assert_allclose(before[key], after[key], atol=1e-9)
        self.assertEqual(before["acquisition"].keys(), after["acquisition"].keys())
        numpy.testing.assert_allclose(before["acquisition"]["ProbeToWorld"], after["acquisition"]["ProbeToWorld"], atol=1e-9)
        numpy.testing.assert_array_equal(read_mha(start)[1], read_mha(path)[1])

    def test_convert_tells_what_is_lost(self):
        run_json("stitch", *volumes(), "-o", work / "all.vti", "--poses", phantom / "truth.json", "--spacing", 4)
        lost = run_json("convert", work / "all.vti", work / "less.mha")["lost"]
        self.assertTrue(any("StitchedVolumes" in line for line in lost), lost)

    def test_overwriting_an_old_output_is_fine(self):
        old = work / "old.mha"
        old.write_bytes(b"old")
        run_json("convert", phantom / "volume_1.mha", old)
        self.assertEqual(run("info", old).returncode, 0)


class Manners(unittest.TestCase):
    def test_messages_stay_off_standard_output(self):
        """A volume without a valid region makes the reader guess, and say so."""
        voxels = blobs((6, 6, 6))
        voxels[:2] = 0
        write_mha(work / "guess.mha", voxels)
        done = run("info", work / "guess.mha", "--json")
        self.assertIn("note: ", done.stderr)
        self.assertTrue(json.loads(done.stdout)["notes"])

    def test_nothing_that_a_terminal_would_obey(self):
        """Names of files and what stands in them reach the terminal as characters, not as orders to it."""
        name = work / "a\x1b[31m\xc2\x9b.mha"
        write_mha(name, numpy.ones((4, 4, 4), "u1"), header={"Comment": "b\x7f\u009b"})
        for arguments in (["info", name], ["info", name, "--json"], ["info", work / "missing\x1b[31m.mha", "--json"]):
            done = run(*arguments)
            for text in (done.stdout, done.stderr):
                self.assertFalse([c for c in text if (ord(c) < 32 and c != "\n") or 0x7f <= ord(c) < 0xa0], ascii(text))
            if "--json" in arguments:
                json.loads(done.stdout)
        self.assertIn("missing\\x1b[31m.mha", done.stderr)

    def test_every_command_tells_seconds(self):
        told = run_json("convert", phantom / "volume_1.mha", work / "seconds.nrrd")
        self.assertGreaterEqual(told["seconds"], sum(told["stages"].values()))
        self.assertGreater(told["stages"]["read"], 0)

    def test_progress_on_a_terminal_alone(self):
        command = [PROGRAM, "align", *volumes(), "-o", work / "bar.json", "--start", "tracked", *FEWER_POINTS]
        terminal, child = pty.openpty()
        process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=child)
        os.close(child)
        shown = b"".join(pieces_of(terminal))
        output = process.communicate(timeout=300)[0]
        self.assertIn(process.returncode, (0, 3))
        self.assertIn(b"align", shown)
        self.assertIn(b"%", shown)
        self.assertNotIn(b"%\r\n", shown)  # the bar is wiped, and leaves no line
        self.assertNotIn(b"\r", output)
        self.assertNotIn("%", run(*command[1:]).stderr)

    def interrupted(self, signal_number, *arguments):
        folder = work / "interrupted"
        folder.mkdir(exist_ok=True)
        before = snapshot(folder)
        process = started(folder, *arguments, signal_number=signal_number)
        time.sleep(1.5)
        process.send_signal(signal_number)
        output, messages = process.communicate(timeout=120)
        self.assertEqual(process.returncode, 1, messages)
        self.assertIn("stopped on request", messages)
        self.assertEqual(output, "")
        self.assertEqual(snapshot(folder), before)

    def test_stopping(self):
        """Far more work than can be done in the time before the signal; afterwards there is no new file."""
        self.interrupted(signal.SIGINT, "align", *volumes(), "-o", "poses.json", "--apply", "moved", "--start", "unknown",
                         "--candidates", "1000")
        self.interrupted(signal.SIGTERM, "phantom", "-o", "volumes", "--spacing", "0.5", "--count", "40")
        self.interrupted(signal.SIGINT, "stitch", *volumes(), "-o", "stitched.mha", "--spacing", "0.4")

    def test_stitch_measures_before_it_replaces(self):
        """Whoever stops the measuring of quality keeps the file that was there: the last that happens is that it takes its place."""
        stages = list(run_json("stitch", *volumes(), "-o", work / "measured.mha", "--poses", phantom / "truth.json", "--quality")["stages"])
        self.assertLess(stages.index("quality"), stages.index("write"), stages)


if __name__ == "__main__":
    unittest.main()
