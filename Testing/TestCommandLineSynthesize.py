#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""echorama synthesize: sets of volumes with truth, from scenes."""
import csv
import json
import pathlib
import tempfile
import unittest

import echorama
import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLImageDataReader, vtkXMLPolyDataReader

from program_under_test import read_mha, run, run_json, write_sequence

work = None
SCENE = {
    "schema": "echorama-scene-1",
    "name": "small",
    "seed": 3,
    "probe": {"preset": "mechanical-3d", "depthMinMm": 2, "depthMaxMm": 60, "elements": 20, "sweepSteps": 12, "samples": 120},
    "background": "tissue",
    "tissue": [{"name": "ball", "sphere": {"centre": [0, 0, 30], "radius": 8, "material": "cyst"}},
               {"name": "plate", "box": {"centre": [0, 0, 55], "size": [80, 80, 4], "material": "lesion-bright"}},
               {"name": "vessel", "cylinder": {"from": [-30, 10, 20], "to": [30, 12, 22], "radius": 3, "material": "blood"}}],
    "views": {"count": 2, "overlap": 0.6},
    "volume": {"spacingMm": 1.5, "knockMm": 8, "knockDegrees": 6},
}


def scene(name="scene.json", **changes):
    path = work / name
    path.write_text(json.dumps({**SCENE, **changes}))
    return path


def affine(header):
    """From voxel indices to the world."""
    numbers = lambda key: numpy.array([float(number) for number in header[key].split()])
    matrix = numpy.eye(4)
    matrix[:3, :3] = numpy.reshape(numbers("TransformMatrix"), (3, 3)).T * numbers("ElementSpacing")
    matrix[:3, 3] = numbers("Offset")
    return matrix


class Sets(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.told = run_json("synthesize", scene(), "-o", work / "set", "--landmarks", 20)

    def test_what_is_there(self):
        names = {path.name for path in (work / "set").iterdir()}
        for name in ("volume_1.mha", "volume_1.ValidRegion.mha", "beams_1.mha", "landmarks_1.csv", "volume_2.mha", "truth.json",
                     "geometry.vtp", "scene.json"):
            self.assertIn(name, names)
        self.assertEqual([volume["file"] for volume in self.told["volumes"]],
                         [str(work / "set" / f"volume_{i}.mha") for i in (1, 2)])
        cost = self.told["volumes"][0]["cost"]
        for stage in ("rays_seconds", "scatterers_seconds", "echoes_seconds", "detection_seconds"):
            self.assertGreaterEqual(cost[stage], 0)
        self.assertGreater(cost["scatterers"], 0)
        self.assertEqual(self.told["seed"], 3)

    def test_a_landmark_is_one_place_of_the_world(self):
        """In the frame of the volume's file, inside what the volume shows, and the same place under the truth."""
        truth = json.loads((work / "set/truth.json").read_text())["volumes"]
        places = {}
        for i, pose in enumerate(truth, 1):
            header, valid = read_mha(work / f"set/volume_{i}.ValidRegion.mha")
            to_world = numpy.array(pose["VolumeToWorld"])
            for row in csv.DictReader((work / f"set/landmarks_{i}.csv").read_text().splitlines()):
                point = [float(row["x"]), float(row["y"]), float(row["z"]), 1]
                index = numpy.rint(numpy.linalg.inv(affine(header)) @ point).astype(int)[:3]
                self.assertTrue(valid[tuple(index[::-1])], row)
                places.setdefault(row["label"], []).append((to_world @ point)[:3])
        shared = [each for each in places.values() if len(each) > 1]
        self.assertEqual(len(shared), 20)
        for each in shared:
            numpy.testing.assert_allclose(each[0], each[1], atol=1e-6)

    def test_volumes_show_the_scene_where_the_truth_puts_them(self):
        """Each of them, although the second lies 8 mm and 6 degrees from there."""
        for number, pose in enumerate(json.loads((work / "set/truth.json").read_text())["volumes"], 1):
            _, voxels = read_mha(work / f"set/volume_{number}.mha")
            header, valid = read_mha(work / f"set/volume_{number}.ValidRegion.mha")
            k, j, i = numpy.nonzero(valid)
            points = (numpy.array(pose["VolumeToWorld"]) @ affine(header) @ [i, j, k, numpy.ones(len(i))])[:3].T
            grey = voxels[k, j, i].astype(float)
            away = numpy.linalg.norm(points - [0, 0, 30], axis=1)
            tissue = (away > 11) & (points[:, 2] < 45) & (abs(points[:, 1] - 11) > 5)
            self.assertLess(grey[away < 6].mean(), 0.4 * grey[tissue].mean(), number)
            self.assertGreater(grey[(away > 9) & (away < 11)].mean(), 0.7 * grey[tissue].mean(), number)  # no darker beside it
            plate = (abs(points[:, 2] - 55) < 1.5) & (numpy.hypot(points[:, 0], points[:, 1]) > 12)
            self.assertGreater(grey[plate].mean(), grey[tissue].mean() + 10, number)

    def test_the_scene_in_the_folder_makes_it_again(self):
        run_json("synthesize", work / "set/scene.json", "-o", work / "again")
        for name in ("volume_2.mha", "beams_2.mha"):
            numpy.testing.assert_array_equal(read_mha(work / "set" / name)[1], read_mha(work / "again" / name)[1])
        run_json("synthesize", work / "set/scene.json", "-o", work / "other", "--seed", 4)
        self.assertFalse((read_mha(work / "set/volume_1.mha")[1] == read_mha(work / "other/volume_1.mha")[1]).all())

    def test_threads_change_nothing(self):
        run_json("synthesize", scene(), "-o", work / "one", "--threads", 1)
        for name in ("volume_1.mha", "beams_2.mha"):
            numpy.testing.assert_array_equal(read_mha(work / "set" / name)[1], read_mha(work / "one" / name)[1])

    def test_the_geometry_as_it_was(self):
        reader = vtkXMLPolyDataReader()
        reader.SetFileName(str(work / "set/geometry.vtp"))
        reader.Update()
        tissue = reader.GetOutput()
        self.assertEqual(tissue.GetNumberOfPolys(), self.told["triangles"])
        names = tissue.GetFieldData().GetAbstractArray("BodyName")
        self.assertEqual([names.GetValue(i) for i in range(names.GetNumberOfValues())], ["ball", "plate", "vessel"])

    def test_beams_scan_convert_to_the_volume(self):
        for number in (1, 2):
            reader, converter = echorama.vtkUltrasoundReader(), echorama.vtkUltrasoundScanConverter()
            reader.SetFileName(str(work / f"set/beams_{number}.mha"))
            converter.SetInputConnection(reader.GetOutputPort())
            converter.SetSpacingMm(1.5)
            converter.Update()
            made, (header, voxels) = converter.GetOutput(), read_mha(work / f"set/volume_{number}.mha")
            self.assertEqual(made.GetDimensions(), voxels.shape[::-1])
            numpy.testing.assert_allclose(made.GetOrigin(), affine(header)[:3, 3], atol=1e-4)
            grey = vtk_to_numpy(made.GetPointData().GetArray("Intensity")).reshape(voxels.shape).astype(int)
            # Not exactly: the reader may take zeros at the rim of the beams for what lies outside.
            self.assertLess((abs(grey - voxels) > 1).mean(), 0.001, number)


class OtherScenes(unittest.TestCase):
    def test_the_seed_is_that_of_the_tissue_too(self):
        packing = {"boxMin": [-20, -20, 5], "boxMax": [20, 20, 45], "radiusMin": 2, "radiusMax": 5}
        path = scene("packing.json", tissue=[{"packing": packing}])
        geometry = {}
        for seed in (3, 4):
            run_json("synthesize", path, "-o", work / f"packing{seed}", "--seed", seed)
            geometry[seed] = (work / f"packing{seed}/geometry.vtp").read_bytes()
            self.assertEqual(json.loads((work / f"packing{seed}/scene.json").read_text())["seed"], seed)
        self.assertNotEqual(geometry[3], geometry[4])

    def test_a_mesh_that_is_read_is_not_replaced(self):
        run_json("synthesize", scene(), "-o", work / "first")
        before = (work / "first/geometry.vtp").read_bytes()
        path = scene("own.json", tissue=[{"mesh": {"file": "first/geometry.vtp", "material": "liver"}}])
        self.assertNotEqual(run("synthesize", path, "-o", work / "first").returncode, 0)
        self.assertEqual((work / "first/geometry.vtp").read_bytes(), before)

    def test_a_rig_brings_its_landmarks(self):
        path = scene("rig.json", background="water", tissue=[{"rig": {}}],
                     probe={**SCENE["probe"], "depthMaxMm": 120}, views={"count": 2, "overlap": 0.8})
        told = run_json("synthesize", path, "-o", work / "rig")
        rows = list(csv.DictReader((work / "rig/landmarks_1.csv").read_text().splitlines()))
        self.assertEqual(len(rows), 7)  # its balls
        self.assertEqual(len(told["volumes"]), 2)

    def test_a_mesh_from_a_folder_of_data(self):
        (work / "meshes").mkdir(exist_ok=True)
        (work / "meshes/tetrahedron.obj").write_text(
            "v 0 0 20\nv 10 0 20\nv 0 10 20\nv 0 0 30\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
        path = scene("mesh.json", tissue=[{"mesh": {"file": "../elsewhere/tetrahedron.obj", "unit": "mm", "material": "bone"}}])
        run_json("synthesize", path, "-o", work / "mesh", "--data", work / "meshes", "--format", "nrrd")
        self.assertEqual(run_json("info", work / "mesh/volume_2.nrrd")["files"][0]["format"], "NRRD")
        self.assertFalse(list((work / "mesh").glob("*.mha")))
        done = run("synthesize", path, "-o", work / "mesh2")
        self.assertEqual(done.returncode, 1)
        self.assertIn("tetrahedron.obj", done.stderr)
        self.assertFalse((work / "mesh2").exists())

    def test_an_open_mesh_is_told_and_not_fatal(self):
        (work / "open.obj").write_text("v 0 0 20\nv 10 0 20\nv 0 10 20\nv 0 0 30\nf 1 3 2\nf 1 2 4\nf 1 4 3\n")
        path = scene("open.json", tissue=[{"mesh": {"file": "open.obj", "material": "bone"}}])
        told = run_json("synthesize", path, "-o", work / "open")
        self.assertIn("open.obj", json.dumps(told["notes"]))

    def test_a_plane_alone(self):
        path = scene("plane.json", probe={"preset": "curvilinear", "elements": 32, "samples": 128},
                     views={"poses": [{"face": [0, 0, 0], "target": [0, 0, 50]}]})
        run_json("synthesize", path, "-o", work / "plane", "--spacing", 0.8)
        header, voxels = read_mha(work / "plane/volume_1.mha")
        self.assertEqual(voxels.shape[0], 1)
        self.assertEqual([float(number) for number in header["ElementSpacing"].split()[:2]], [0.8, 0.8])


class Pressed(unittest.TestCase):
    """A ball in a block, without and with a probe that presses 6 mm deep into it."""

    BALL = numpy.array([0.0, 0.0, 28.0])

    @classmethod
    def setUpClass(cls):
        tissue = [{"name": "block", "box": {"centre": [0, 0, 30], "size": [90, 90, 60], "material": "muscle"}},
                  {"name": "ball", "sphere": {"centre": cls.BALL.tolist(), "radius": 7, "material": "cyst"}}]
        cls.common = {"background": "gel", "tissue": tissue, "volume": {"spacingMm": 1.2, "knockMm": 8, "knockDegrees": 6},
                      "probe": {**SCENE["probe"], "elements": 40, "sweepSteps": 24}}
        views = lambda *depths: {"poses": [{"face": [0, 0, depth], "target": [0, 0, 50]} for depth in depths]}
        path = scene("pressed.json", views=views(0.0, 6.0), press={"spacingMm": 5}, **cls.common)
        cls.told = run_json("synthesize", path, "-o", work / "pressed", "--landmarks", 8)
        cls.truth = json.loads((work / "pressed/truth.json").read_text())["volumes"]
        cls.views = staticmethod(views)

    def ball(self, path, to_world=numpy.eye(4)):
        """Where the middle of the dark ball is shown."""
        header, voxels = read_mha(path)
        k, j, i = numpy.nonzero(numpy.ones(voxels.shape))
        points = (to_world @ affine(header) @ [i, j, k, numpy.ones(len(i))])[:3].T
        near = numpy.linalg.norm(points - self.BALL - [0, 0, 2], axis=1) < 11
        dark = near & (voxels[k, j, i] < 25)
        self.assertGreater(dark.sum(), 300)
        return points[dark].mean(axis=0)

    def moved(self, number, place):
        reader, result = vtkXMLImageDataReader(), [0.0, 0.0, 0.0]
        reader.SetFileName(str(work / "pressed" / self.truth[number]["displacement"]))
        reader.Update()
        self.assertTrue(echorama.vtkUltrasoundDisplacement.Evaluate(reader.GetOutput(), place, result))
        return numpy.array(result)

    def test_tissue_gives_way_and_the_truth_says_how_far(self):
        numpy.testing.assert_allclose(self.moved(0, self.BALL), 0, atol=0.1)  # that probe only touches
        went = self.moved(1, self.BALL)
        self.assertTrue(1.0 < went[2] < 5.0 and abs(went[:2]).max() < 0.2, went)
        shown = [self.ball(work / f"pressed/volume_{n + 1}.mha", numpy.array(self.truth[n]["VolumeToWorld"])) for n in (0, 1)]
        numpy.testing.assert_allclose(shown[1] - shown[0], went, atol=0.5)
        self.assertGreater(self.told["volumes"][1]["press"]["force_n"][2], 1.0)

    def test_landmarks_go_along(self):
        places = []
        for number in (0, 1):
            rows = csv.DictReader((work / f"pressed/landmarks_{number + 1}.csv").read_text().splitlines())
            to_world = numpy.array(self.truth[number]["VolumeToWorld"])
            places.append({row["label"]: (to_world @ [float(row["x"]), float(row["y"]), float(row["z"]), 1])[:3] for row in rows})
        both = places[0].keys() & places[1].keys()
        self.assertGreater(len(both), 4)
        for label in both:  # the first probe hardly moves anything
            numpy.testing.assert_allclose(places[1][label] - places[0][label], self.moved(1, places[0][label]), atol=0.3)

    def test_landmarks_agree_where_the_truth_takes_them_back(self):
        lists = [work / f"pressed/landmarks_{n}.csv" for n in (1, 2)]
        rigid = json.loads((work / "pressed/truth.json").read_text())
        for volume in rigid["volumes"]:
            del volume["displacement"]
        (work / "pressed/rigid.json").write_text(json.dumps(rigid))
        by = {name: run_json("score", work / f"pressed/{name}.json", "--landmarks", *lists)["landmarks"] for name in ("truth", "rigid")}
        self.assertGreater(by["truth"]["pairs"], 4)
        self.assertEqual(by["truth"]["pairs"], by["rigid"]["pairs"])
        self.assertLess(by["truth"]["max_mm"], 0.01)
        self.assertGreater(by["rigid"]["mean_mm"], 0.5)

    def test_stitching_by_the_truth_takes_it_back(self):
        volumes = [work / f"pressed/volume_{n}.mha" for n in (1, 2)]
        run_json("stitch", *volumes, "--poses", work / "pressed/truth.json", "--method", "average", "-o", work / "pressed_back.mha")
        back = self.ball(work / "pressed_back.mha")
        rest = self.ball(volumes[0])
        numpy.testing.assert_allclose(back, rest, atol=0.4)

    def test_gel_couples_and_air_does_not(self):
        bright = {}
        for amount in (0, 15):  # ml, between skin and a face whose middle is 3 mm away, and one that presses
            gel = {"amountMl": amount, "cellMm": 3, "settleS": 0}
            path = scene("gel.json", views=self.views(-3.0, 4.0), press={"spacingMm": 9}, gel=gel, **{**self.common, "background": "air"})
            told = run_json("synthesize", path, "-o", work / f"gel_{amount}")["volumes"]
            bright[amount] = [read_mha(work / f"gel_{amount}/volume_{n}.mha")[1].mean() for n in (1, 2)]
            for number, one in enumerate(told):
                surface, face = (vtkXMLPolyDataReader() for _ in range(2))
                for reader, key in ((surface, "surface"), (face, "face")):
                    reader.SetFileName(one["gel"][key])
                    reader.Update()
                self.assertEqual(surface.GetOutput().GetNumberOfPolys() > 0, amount > 0)
                self.assertAlmostEqual(face.GetOutput().GetFieldData().GetArray("Coupled").GetValue(0), one["gel"]["coupled"])
                if number == 0:
                    self.assertEqual((one["gel"]["coupled"] > 0.6, one["gel"]["coupled"] == 0.0), (amount > 0, amount == 0))
        self.assertGreater(bright[15][0], 5 * bright[0][0])
        self.assertGreater(bright[15][1], bright[0][1])  # where the dry face touches the skin sound passes all the same

    def test_what_cannot_be_pressed_is_told(self):
        bone = {"sphere": {"centre": [0, 0, 12], "radius": 8, "material": "bone"}}
        path = scene("bony.json", views=self.views(9.0), press={"spacingMm": 5}, **{**self.common, "tissue": self.common["tissue"] + [bone]})
        done = run("synthesize", path, "-o", work / "bony")
        self.assertEqual(done.returncode, 1)
        self.assertIn("something rigid is in it", done.stderr)
        self.assertFalse((work / "bony").exists())


def pose(x, degrees):
    """A probe at x that looks along +z, turned about z."""
    angle = numpy.radians(degrees)
    matrix = numpy.eye(4)
    matrix[:2, :2] = [[numpy.cos(angle), -numpy.sin(angle)], [numpy.sin(angle), numpy.cos(angle)]]
    matrix[0, 3] = x
    return matrix


class Recordings(unittest.TestCase):
    def record(self, name, frames):
        times = numpy.arange(frames) * 0.05
        transforms = [{"ProbeToTracker": (pose(10 * time, 5 * time), "INVALID" if i == 7 else "OK")} for i, time in enumerate(times)]
        write_sequence(work / name, numpy.zeros((frames, 2, 2), "u1"), transforms, times.tolist())

    def test_the_views_lie_on_the_path(self):
        self.record("path.igs.mha", 41)  # 2 s
        views = {"recording": {"file": "path.igs.mha", "transform": "ProbeToTracker", "smoothSeconds": 0.1, "count": 3,
                               "trackerToWorld": {"translation": [0, 3, 0]}}}
        path = scene("recorded.json", views=views, volume={**SCENE["volume"], "knockMm": 0, "knockDegrees": 0})
        run_json("synthesize", path, "-o", work / "recorded")
        for i, time in enumerate((0, 1, 2), 1):
            header, _ = read_mha(work / f"recorded/volume_{i}.mha")
            wanted = pose(10 * time, 5 * time)
            wanted[1, 3] = 3
            held = numpy.reshape([float(number) for number in header["Echorama_ProbeToWorld"].split()], (4, 4))
            numpy.testing.assert_allclose(held, wanted, atol=1e-6)

    def test_times_at_the_very_end_are_in_the_recording(self):
        for frames, count in ((28, 4), (33, 7)):
            self.record("end.igs.mha", frames)
            views = {"recording": {"file": "end.igs.mha", "transform": "ProbeToTracker", "count": count}}
            path = scene("end.json", views=views, probe={**SCENE["probe"], "elements": 4, "sweepSteps": 3, "samples": 40})
            self.assertEqual(len(run_json("synthesize", path, "-o", work / f"end{frames}")["volumes"]), count)

    def test_a_probe_that_moves_while_it_sweeps(self):
        self.record("sweep.igs.mha", 41)
        views = {"recording": {"file": "sweep.igs.mha", "transform": "ProbeToTracker", "count": 1}}
        still = scene("still.json", views=views)
        moving = scene("moving.json", views=views, sweep={"seconds": 1, "alongRecording": True})
        run_json("synthesize", still, "-o", work / "still")
        run_json("synthesize", moving, "-o", work / "moving")
        a, b = (read_mha(work / name / "beams_1.mha")[1].astype(float) for name in ("still", "moving"))
        first, middle = abs(a[0] - b[0]).mean(), abs(a[5:7] - b[5:7]).mean()
        self.assertGreater(first, 5)  # 5 mm away
        self.assertLess(middle, 0.8 * first)
        # Where it moves a place is not seen where it lies.
        two = scene("two.json", sweep={"seconds": 1, "velocityMmPerSecond": [3, 0, 0]})
        told = run_json("synthesize", two, "-o", work / "two", "--landmarks", 5)
        self.assertIn("moves", json.dumps(told["notes"]))
        self.assertFalse((work / "two/landmarks_1.csv").exists())

    def test_what_is_no_recording(self):
        for transform, name, word in (("NeedleToTracker", "path.igs.mha", "Needle"), ("ProbeToTracker", "nothing.igs.mha", "nothing"),
                                      ("Probe", "path.igs.mha", "transform")):
            self.record("path.igs.mha", 5)
            path = scene("no.json", views={"recording": {"file": name, "transform": transform, "count": 1}})
            done = run("synthesize", path, "-o", work / "no")
            self.assertEqual(done.returncode, 1)
            self.assertIn(word, done.stderr)
            self.assertFalse((work / "no").exists())


class Refusals(unittest.TestCase):
    def refuses(self, path, *words):
        done = run("synthesize", path, "-o", work / "refused")
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        for word in words:
            self.assertIn(word, done.stderr)
        self.assertFalse((work / "refused").exists())

    def test_wrong_scenes(self):
        self.refuses(scene("bad.json", tissue=[{"sphere": {"material": "lver"}}]), "bad.json", "tissue[0].sphere.material", "lver")
        self.refuses(scene("bad.json", probe={"elements": 1}), "probe.elements")
        self.refuses(scene("bad.json", sede=3), "sede")
        self.refuses(scene("bad.json", transducer={"frequencyMHz": 900}), "transducer.frequencyMHz")
        self.refuses(work / "missing.json", "missing.json")
        (work / "bad.json").write_text("{")
        self.refuses(work / "bad.json", "not JSON")

    def test_nothing_is_replaced_that_is_read(self):
        (work / "kept").mkdir(exist_ok=True)
        (work / "kept/scene.json").write_text(json.dumps(SCENE))
        done = run("synthesize", work / "kept/scene.json", "-o", work / "kept")
        self.assertNotEqual(done.returncode, 0)
        self.assertEqual(json.loads((work / "kept/scene.json").read_text()), SCENE)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        unittest.main()
