#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The study: coarse cases made twice alike, aligned in a batch that nothing ends, judged rightly, and drawn."""
import csv
import dataclasses
import json
import pathlib
import shutil
import sys
import tempfile
import types
import unittest
import unittest.mock

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy

import echorama
from program_under_test import PROGRAM, SOURCE, run_json

sys.path.insert(0, str(SOURCE / "Applications" / "study"))
import cases  # noqa: E402
import contestants  # noqa: E402
import figures  # noqa: E402
import study  # noqa: E402
from geometry import Probe, about, apply, degrees_of, pose, random_motion, read_poses, write_poses  # noqa: E402

temporary = tempfile.TemporaryDirectory()
work = pathlib.Path(temporary.name)
QUICK = "--start tracked --points 2000"


def quiet(*_):
    pass


def grey_of(image):
    return vtk_to_numpy(echorama.vtkUltrasoundVolume.GetIntensity(image)).reshape(image.GetDimensions()[::-1])


class Study(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = work / "cases"
        cases.make_case(cls.folder / "plain", {"overlap": 0.7}, ((4.0, 4.0), (20.0, 25.0)), seed=3, spacing=3.0)
        cls.case = cases.Case(cls.folder / "plain")

    def test_the_truth_is_true(self):
        """Landmarks coincide under the truth, and views overlap as stated."""
        judge = study.Judge(self.case, PROGRAM)
        right = judge.figures(self.case.truth)
        self.assertEqual(right["tre_mm"], 0)
        self.assertLess(right["landmarks_max_mm"], 1e-9)
        moved = judge.figures(pose(move=(3, 0, 4)) @ self.case.truth)
        for name in ("tre_mm", "percentile95_mm", "landmarks_mm", "landmarks_max_mm"):
            self.assertAlmostEqual(moved[name], 5, places=6)
        self.assertAlmostEqual(moved["tre_voxels"], 5 / 3, places=6)
        score = run_json("score", self.folder / "plain" / "start_20deg_25mm.json", "--truth", self.folder / "plain" / "truth.json")
        start = next(start for start in self.case.starts() if "20deg" in start.name)
        self.assertAlmostEqual(judge.figures(start.motion)["tre_mm"] / score["score_mm"], 1, delta=0.03)  # other points, one score
        size = judge.size_of_start(start)
        self.assertAlmostEqual(size["start_degrees"], 20, places=2)
        self.assertAlmostEqual(size["start_mm"], 25, places=2)

        first, second = (self.case.image(number) for number in (0, 1))
        views = [np.array([matrix for matrix in image.GetFieldData().GetArray("ProbeToWorld").GetTuple(0)]).reshape(4, 4)
                 for image in (first, second)]
        motion = np.linalg.inv(views[0]) @ self.case.truth @ views[1]
        self.assertAlmostEqual(Probe().overlap(motion, Probe().points(np.random.default_rng(9), 20000)), 0.7, delta=0.02)

    def test_landmarks_know_the_deformation(self):
        cases.make_case(work / "pressed", {"deformation_mm": 3.0}, (), seed=3, spacing=3.0)
        case = cases.Case(work / "pressed")
        found = study.Judge(case, PROGRAM).figures(case.truth)
        self.assertEqual(found["tre_mm"], 0)
        self.assertTrue(0.3 < found["landmarks_mm"] < found["landmarks_max_mm"] <= 3, found)

    def test_the_floor_of_a_body(self):
        """Landmarks lie where bent sound shows pressed tissue: no rigid pose fits them better than the floor, the truth less well."""
        from bodies import CONDITIONS, make_bodies, make_impossible
        folder = work / "bodies"
        condition = dataclasses.replace(CONDITIONS["pressed_6"], overlaps=(0.75,))
        with unittest.mock.patch.dict(CONDITIONS, {"pressed_6": condition}):
            make_bodies(folder, ["pressed_6"], [1], spacing=3.0, landmarks=100, say=quiet)
        (place,) = cases.cases_in(folder)
        case = cases.Case(place)
        judge = study.Judge(case, PROGRAM)
        floor, truth = judge.figures(case.floor), judge.figures(case.truth)
        self.assertAlmostEqual(floor["excess_mm"], 0, places=9)
        self.assertLess(floor["beside_floor_mm"], 1e-9)
        self.assertTrue(0.1 < floor["landmarks_mm"] < truth["landmarks_mm"] < 6, (floor, truth))
        self.assertGreater(judge.figures(about(judge.points.mean(axis=0), pose((0.02, 0, 0))) @ case.floor)["excess_mm"], 0.1)
        self.assertLess(floor["tre_mm"], 3)  # tissue is seen within some mm of where it is
        self.assertEqual((case.properties["overlap"], case.properties["pressed_mm"]), (0.75, 6.0))

        # Pairs without an answer start as far from where the right view lies as by a hand; only their verdicts count.
        with unittest.mock.patch("bodies.OVERLAPS", (0.75,)):
            make_impossible(folder, ["pressed_6"], [1], say=quiet)
        mirror, negative = (cases.Case(path) for path in cases.cases_in(folder / "impossible"))
        self.assertEqual((mirror.impossible, negative.impossible), ("mirror image", "negative"))
        right, back, dark = (grey_of(one.image(1)) for one in (case, mirror, negative))
        np.testing.assert_array_equal(back, right[:, :, ::-1])
        np.testing.assert_array_equal(dark, 255 - right)
        for one in (mirror, negative):
            (start,) = one.starts()
            middle = np.array(case.image(1).GetCenter())[np.newaxis]
            self.assertAlmostEqual(degrees_of(start.motion @ np.linalg.inv(case.truth)), 20, places=6)
            self.assertAlmostEqual(np.linalg.norm(apply(start.motion, middle) - apply(case.truth, middle)), 25, places=6)
        methods = {"quick": contestants.contestants(PROGRAM, [f"quick={QUICK}"])["quick"]}
        rows = study.run(folder / "impossible", methods, PROGRAM, say=quiet)
        self.assertEqual([(row["impossible"], row["method"], "tre_mm" in row) for row in rows],
                         [("mirror image", "quick", False), ("negative", "quick", False)])
        self.assertNotIn("aligned", [row["verdict"] for row in rows])
        self.assertIn(f"| mirror image | quick | 1 | 0 | {(rows[0]['verdict'] == 'ambiguous') + 0} |", figures.tables_of_bodies(rows))
        figures.plot(folder, rows, folder / "out")

    def test_tables_of_bodies(self):
        """Lost pairs count in the error beyond the floor but not in what is predicted; what was said to be aligned is held against the floor."""
        def row(individual, excess, beside, verdict, rms, predicted, cpu):
            return {"scan": "bent", "individual": individual, "overlap": 0.55, "start": "start_20deg_25mm", "start_degrees": 20.0, "start_mm": 25.0,
                    "method": "echorama", "excess_mm": excess, "beside_floor_mm": beside, "verdict": verdict, "tre_rms_mm": rms,
                    "predicted_mm": predicted, "cpu_seconds": cpu}

        rows = [row(1, 0.1, 0.2, "aligned", 1.0, 2.0, 3.0), row(2, 0.3, 2.1, "aligned", 3.0, 1.0, 5.0), row(2, 0.2, 1.0, "aligned", 1.0, 0.4, 4.0),
                row(3, 30.0, 31.0, "ambiguous", 31.0, 1.0, 9.0)]
        text = figures.tables_of_bodies(rows + [dict(rows[0], method="start")])
        self.assertIn("| 55% | 20 deg, 25 mm | echorama | 4 | 0.25 | 21.09 | 30.00 | 1 | 3, 2 | 4.5 |\n", text)
        self.assertIn("| odd | echorama | 1 | 0.50 | 100% |\n", text)
        self.assertIn("| even | echorama | 2 | 2.75 | 0% |\n", text)
        self.assertNotIn("| start |", text.partition("\n| --- ")[2])

    def test_the_same_seed_makes_the_same_case(self):
        cases.make_case(work / "again", {"overlap": 0.7}, ((4.0, 4.0), (20.0, 25.0)), seed=3, spacing=3.0)
        names = sorted(path.name for path in (work / "again").iterdir())
        self.assertEqual(names, sorted(path.name for path in (self.folder / "plain").iterdir()))
        for name in names:
            self.assertEqual((work / "again" / name).read_bytes(), (self.folder / "plain" / name).read_bytes(), name)

    def test_batch(self):
        """Cases that are broken and methods that fail are noted; what was done is not done again; plots appear."""
        folder = work / "batch"
        shutil.copytree(self.folder, folder)
        (folder / "broken").mkdir()
        (folder / "broken" / "truth.json").write_text("{")
        own = folder / "own"  # a user's: landmarks of Slicer, no truth, no start
        own.mkdir()
        for number, point in ((1, "1,2,3"), (2, "2,2,3")):
            shutil.copy(self.case.files[number - 1], own / f"{number}.mha")
            (own / f"landmarks_{number}.fcsv").write_text(f"# CoordinateSystem = 0\nid,{point},0,0,0,1,1,1,0,apex,,\n")
        said = []
        methods = {name: value for name, value in contestants.contestants(PROGRAM, [f"quick={QUICK}", "wrong=--metric banana"]).items()
                   if name in ("quick", "wrong")}
        rows = study.run(folder, methods, PROGRAM, say=said.append)
        self.assertEqual(len(rows), 3 * 3, [(row["case"], row["start"], row["method"]) for row in rows])
        self.assertTrue(any(text.startswith("broken: left out") for text in said), said)
        row = {(row["case"], row["start"], row["method"]): row for row in rows}
        near = row["plain", "start_4deg_4mm", "quick"]
        self.assertLess(near["tre_mm"], 3)
        self.assertGreater(near["seconds"], 0)
        self.assertGreater(row["plain", "start_4deg_4mm", "start"]["tre_mm"], 3)
        self.assertEqual(row["plain", "start_4deg_4mm", "wrong"]["verdict"], "failed")
        self.assertIn("banana", row["plain", "start_4deg_4mm", "wrong"]["error"])
        self.assertAlmostEqual(row["own", "files", "start"]["tre_mm"], 1, places=9)
        before = (folder / "results.jsonl").read_bytes()
        self.assertEqual(len(study.run(folder, methods, PROGRAM, say=quiet)), 9)
        self.assertEqual((folder / "results.jsonl").read_bytes(), before)
        # A run that was cut off in a line: that row is found again, and nothing else is.
        lines = before.splitlines(keepends=True)
        whole = b"".join(lines[:-2]) + lines[-1]
        (folder / "results.jsonl").write_bytes(whole + lines[-2][:len(lines[-2]) // 2])
        said.clear()
        self.assertEqual(len(study.run(folder, methods, PROGRAM, say=said.append)), 9)
        self.assertEqual(len(study.results_of(folder)), 9)
        self.assertEqual(len([text for text in said if "left out" not in text]), 1, said)
        self.assertTrue((folder / "results.jsonl").read_bytes().startswith(whole))
        with open(folder / "results.csv") as stream:
            table = list(csv.DictReader(stream))
        self.assertEqual([line["overlap"] for line in table], [str(line.get("overlap", "")) for line in rows])
        self.assertIn("0.7", [line["overlap"] for line in table])

        with self.assertRaisesRegex(ValueError, "no such pair"):
            figures.plot(folder, rows, folder / "out", "plain/nowhere")
        figures.plot(folder, rows, folder / "out", "plain/start_4deg_4mm")
        for name in ("results.png", "slices.png", "scores.png"):
            self.assertGreater((folder / "out" / name).stat().st_size, 5000)
        self.assertIn("| 4 deg, 4 mm | quick | 1 | 100% |", (folder / "out" / "table.md").read_text())

    def test_the_search_of_the_dissertation(self):
        peers = contestants.contestants(PROGRAM)
        if "search" not in peers:
            self.skipTest("the benchmarks are not built")
        judge = study.Judge(self.case, PROGRAM)
        start = next(start for start in self.case.starts() if "4deg" in start.name)
        answer = peers["search"].align(self.case, start, 120)
        self.assertLess(judge.figures(answer.motion)["tre_mm"], 2)
        self.assertGreater(judge.figures(start.motion)["tre_mm"], 3)
        self.assertEqual(answer.verdict, "")
        with self.assertRaisesRegex(contestants.Failed, "minimum overlap"):
            contestants.Search(peers["search"].program, 0.99).align(self.case, start, 120)

    @unittest.skipUnless(shutil.which("elastix"), "elastix is not installed")
    def test_elastix_finds_a_known_motion(self):
        """A volume against itself under another geometry: the whole chain of conventions, on the way there and back."""
        known = about(np.array([0.0, 0, 60]), pose((0.09, -0.07, 0.08), (3, -4, 2)))
        same = types.SimpleNamespace(files=self.case.files, image=lambda number: self.case.image(0))
        start = cases.Start("known", None, known)
        points = self.case.points(0, 500)
        self.assertGreater(np.linalg.norm(apply(known, points) - points, axis=1).mean(), 5)
        peers = {name: method for name, method in contestants.contestants(PROGRAM).items() if name.startswith("elastix")}
        self.assertEqual(list(peers), ["elastix-mi-250", "elastix-mi-1000", "elastix-ncc-250"])
        for name, peer in peers.items():
            answer = peer.align(same, start, 120)
            self.assertLess(np.linalg.norm(apply(answer.motion, points) - points, axis=1).mean(), 0.6, name)  # a fifth of a voxel

    def test_programs_of_the_user(self):
        """A program finds both volumes, the second where the start puts it; its answer counts from where its file stood. What fails says why."""
        script = work / "own.py"
        script.write_text("import json, sys\nfrom echorama import vtkUltrasoundReader\nreader = vtkUltrasoundReader()\nreader.SetFileName(sys.argv[3])\n"
                          "reader.Update()\nif sys.argv[1] == 'fails': sys.exit('no ' + sys.argv[1])\nif sys.argv[1] == 'nothing': sys.exit()\n"
                          "moves = [[[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]] for x in (2, 5)]\n"
                          "json.dump({'schema': 'echorama-poses-1', 'unit': 'mm', 'frame': 'LPS', 'centre': reader.GetOutput().GetCenter(), 'volumes': "
                          "[{'file': f, 'VolumeToWorld': m} for f, m in zip(sys.argv[2:4], moves)]} if sys.argv[1] == 'moves' else {}, open(sys.argv[4], 'w'))\n")
        own = contestants.contestants(PROGRAM, programs=[f"{word}=/usr/bin/python3 {script} {word}" for word in ("moves", "fails", "nothing", "nonsense")])
        start = next(start for start in self.case.starts() if "20deg" in start.name)
        answer = own["moves"].align(self.case, start, 60)
        np.testing.assert_allclose(answer.motion, pose(move=(3, 0, 0)) @ start.motion, atol=1e-9)
        self.assertGreater(answer.seconds, 0)
        for word, why in (("fails", "no fails"), ("nothing", "wrote no poses"), ("nonsense", "no file of poses")):
            with self.assertRaisesRegex(contestants.Failed, why):
                own[word].align(self.case, start, 60)
        with self.assertRaisesRegex(contestants.Failed, "does not start"):
            contestants.Program("no-such-program").align(self.case, start, 60)

    def test_refusals(self):
        (work / "empty").mkdir(exist_ok=True)
        for arguments, words in ((["run", work / "empty"], "there are no cases in it"), (["plot", work / "empty"], "run comes first"),
                                 (["run", self.folder, "--methods", "banana"], "there is no method banana")):
            with self.assertRaises(SystemExit) as stopped:
                study.main([str(argument) for argument in arguments])
            self.assertIn(words, str(stopped.exception.code))


class Geometry(unittest.TestCase):
    def test_motions(self):
        random = np.random.default_rng(5)
        motion = about(np.array([10.0, -20, 30]), random_motion(random, 33, 12))
        self.assertAlmostEqual(degrees_of(motion), 33, places=9)
        self.assertAlmostEqual(np.linalg.norm(apply(motion, np.array([[10.0, -20, 30]])) - (10, -20, 30)), 12, places=9)
        write_poses(work / "poses.json", [work / "a.mha"], [motion])
        np.testing.assert_array_equal(read_poses(work / "poses.json")[0][1], motion)

    def test_euler_motion(self):
        """The order of the turns and the centre as ITK has them: R = Rz Rx Ry, x -> R (x - c) + c + t."""
        text = '(Transform "EulerTransform")\n(TransformParameters 0.3 -0.2 0.5 1 2 3)\n(CenterOfRotationPoint 4 5 6)\n'
        turn = pose((0, 0, 0.5)) @ pose((0.3, 0, 0)) @ pose((0, -0.2, 0))
        np.testing.assert_allclose(contestants.euler_motion(text), pose(move=(1, 2, 3)) @ about(np.array([4.0, 5, 6]), turn), atol=1e-12)
        turn = pose((0, 0, 0.5)) @ pose((0, -0.2, 0)) @ pose((0.3, 0, 0))
        np.testing.assert_allclose(contestants.euler_motion(text + '(ComputeZYX "true")'),
                                   pose(move=(1, 2, 3)) @ about(np.array([4.0, 5, 6]), turn), atol=1e-12)


if __name__ == "__main__":
    unittest.main()
