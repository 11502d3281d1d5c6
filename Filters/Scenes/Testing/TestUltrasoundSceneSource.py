#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundSceneSource: a scene goes in, volumes with their truth come out, in one pipeline with what aligns and stitches them.
(What a view is made of: TestSceneRun.cxx; files: TestCommandLineSynthesize.py.)"""
import json
import pathlib
import tempfile
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet, vtkMultiBlockDataSet
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkIOGeometry import vtkGLTFWriter, vtkOBJWriter, vtkSTLWriter
from vtkmodules.vtkIOPLY import vtkPLYWriter
from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

import echorama

SCENE = {
    "schema": "echorama-scene-1",
    "seed": 3,
    "probe": {"preset": "mechanical-3d", "depthMinMm": 2, "depthMaxMm": 50, "elements": 16, "sweepSteps": 8, "samples": 80},
    "background": "air",
    "tissue": [{"name": "block", "box": {"centre": [0, 0, 35], "size": [80, 80, 62], "material": "muscle"}},
               {"name": "ball", "sphere": {"centre": [0, 0, 28], "radius": 8, "material": "cyst"}}],
    "views": {"poses": [{"face": [x, 0, 7], "target": [x, 0, 50]} for x in (-6, 6)]},
    "press": {"spacingMm": 8},
    "volume": {"spacingMm": 2, "knockMm": 8, "knockDegrees": 6},
}


def source(**properties):
    made = echorama.vtkUltrasoundSceneSource()
    for name, value in properties.items():
        getattr(made, "Set" + name)(value)
    return made


def names(blocks):
    return [blocks.GetMetaData(n).Get(vtkCompositeDataSet.NAME()) for n in range(blocks.GetNumberOfBlocks())]


def block(blocks, name):
    return blocks.GetBlock(names(blocks).index(name))


def voxels(image):
    return vtk_to_numpy(image.GetPointData().GetArray("Intensity"))


class Scenes(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.made = source(Scene=json.dumps(SCENE), Landmarks=12)
        cls.made.Update()

    def output(self, port):
        return self.made.GetOutputDataObject(port)

    def test_what_comes_out(self):
        self.assertEqual(self.made.GetNumberOfViews(), 2)
        self.assertEqual(names(self.output(0)), ["volume_1", "volume_2"])
        self.assertEqual(names(self.output(1)), ["beams_1", "beams_2"])
        self.assertEqual(block(self.output(1), "beams_1").GetDimensions(), (80, 16, 8))
        self.assertEqual(names(self.output(3)), ["view_1", "view_2"])
        for view in (0, 1):
            self.assertEqual(names(self.output(3).GetBlock(view)), ["tissue", "displacement", "landmarks"])
        bodies = self.output(2).GetFieldData().GetAbstractArray("BodyName")
        self.assertEqual([bodies.GetValue(n) for n in range(bodies.GetNumberOfValues())], ["block", "ball"])
        report = json.loads(self.made.GetReport())["volumes"]
        self.assertEqual(len(report), 2)
        self.assertGreater(report[0]["press"]["force_n"][2], 0.1)
        self.assertGreater(report[0]["cost"]["rays"], 100)

    def test_the_truth_brings_the_volumes_together(self):
        """Landmarks that both volumes have are one place at rest, where the poses and the displacements take them."""
        places = []
        for view in (1, 2):
            matrix, result = vtkMatrix4x4(), [0.0] * 3
            self.assertTrue(self.made.GetVolumeToWorld(view, matrix))
            truth = self.output(3).GetBlock(view - 1)
            landmarks, displacement = block(truth, "landmarks"), block(truth, "displacement")
            labels = landmarks.GetPointData().GetAbstractArray("Label")
            found = {}
            for n in range(landmarks.GetNumberOfPoints()):
                now = matrix.MultiplyPoint([*landmarks.GetPoint(n), 1])[:3]
                self.assertTrue(echorama.vtkUltrasoundDisplacement.Invert(displacement, now, result))
                found[labels.GetValue(n)] = np.array(result)
            places.append(found)
        both = places[0].keys() & places[1].keys()
        self.assertGreater(len(both), 8)
        for label in both:
            np.testing.assert_allclose(places[0][label], places[1][label], atol=1e-4)
        self.assertFalse(self.made.GetVolumeToWorld(3, vtkMatrix4x4()))
        identity = vtkMatrix4x4()
        self.made.GetVolumeToWorld(1, identity)
        self.assertTrue(identity.IsIdentity())

    def test_one_view_alone_is_that_of_all(self):
        alone = source(Scene=json.dumps(SCENE), View=2)
        alone.Update()
        self.assertEqual(names(alone.GetOutputDataObject(0)), ["volume_2"])
        one, all = alone.GetOutputDataObject(0).GetBlock(0), block(self.output(0), "volume_2")
        np.testing.assert_array_equal(voxels(one), voxels(all))
        np.testing.assert_allclose(one.GetOrigin(), all.GetOrigin())
        alone.SetView(1)
        alone.Update()
        np.testing.assert_array_equal(voxels(alone.GetOutputDataObject(0).GetBlock(0)), voxels(block(self.output(0), "volume_1")))

    def test_the_resolved_scene_makes_it_again(self):
        again = source(Scene=self.made.GetResolvedScene())
        again.Update()
        for n in (0, 1):
            np.testing.assert_array_equal(voxels(again.GetOutputDataObject(0).GetBlock(n)), voxels(self.output(0).GetBlock(n)))
        other = source(Scene=json.dumps(SCENE), Seed=4, View=1)
        other.Update()
        self.assertTrue((voxels(other.GetOutputDataObject(0).GetBlock(0)) != voxels(self.output(0).GetBlock(0))).any())

    def test_volumes_go_on_to_the_stitcher(self):
        scene = {**SCENE, "volume": {"spacingMm": 2, "knockMm": 0, "knockDegrees": 0}}
        made, stitcher = source(Scene=json.dumps(scene)), echorama.vtkUltrasoundStitcher()
        stitcher.SetInputConnection(made.GetOutputPort())
        stitcher.Update()
        stitched = stitcher.GetOutput()
        self.assertGreater(stitched.GetBounds()[1] - stitched.GetBounds()[0], 60)

    def test_a_file_that_changed_is_read_again(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "scene.json"
            path.write_text(json.dumps({key: value for key, value in SCENE.items() if key != "press"}))
            made = source(FileName=str(path), View=1)
            made.Update()
            before = voxels(made.GetOutputDataObject(0).GetBlock(0)).copy()
            self.assertNotIn("displacement", names(made.GetOutputDataObject(3).GetBlock(0)))
            path.write_text(json.dumps({**SCENE, "tissue": SCENE["tissue"][:1]}))
            made.Modified()
            made.Update()
            self.assertTrue((voxels(made.GetOutputDataObject(0).GetBlock(0)) != before).any())
            self.assertIn("displacement", names(made.GetOutputDataObject(3).GetBlock(0)))

    def test_meshes_of_all_formats_are_the_same_tissue(self):
        def seen(tissue):
            made = source(Scene=json.dumps({**SCENE, "tissue": tissue}), View=1)
            made.Update()
            return voxels(made.GetOutputDataObject(0).GetBlock(0)).copy()

        sphere, scene = vtkSphereSource(), vtkMultiBlockDataSet()
        sphere.SetCenter(0, 0, 30)
        sphere.SetRadius(10)
        sphere.Update()
        scene.SetBlock(0, vtkMultiBlockDataSet())
        scene.GetBlock(0).SetBlock(0, sphere.GetOutput())
        text, big, inline = vtkPLYWriter(), vtkPLYWriter(), vtkGLTFWriter()
        text.SetFileTypeToASCII()
        big.SetDataByteOrderToBigEndian()
        inline.SetInlineData(True)
        with tempfile.TemporaryDirectory() as folder:
            tissues = {}
            for name, writer in (("a.stl", vtkSTLWriter()), ("b.ply", vtkPLYWriter()), ("text.ply", text), ("big.ply", big),
                                 ("o.obj", vtkOBJWriter()), ("p.vtp", vtkXMLPolyDataWriter()), ("g.gltf", inline)):
                path = str(pathlib.Path(folder) / name)
                writer.SetFileName(path)
                writer.SetInputData(scene if name == "g.gltf" else sphere.GetOutput())
                writer.Write()
                tissues[name] = seen([SCENE["tissue"][0], {"mesh": {"file": path, "material": "cyst"}}])
            self.assertGreater((tissues["a.stl"] != seen(SCENE["tissue"][:1])).mean(), 0.02)
            for name, tissue in tissues.items():
                self.assertLess((tissue != tissues["a.stl"]).mean(), 1e-3, name)

    def test_damaged_polydata_is_refused(self):
        sphere, writer = vtkSphereSource(), vtkXMLPolyDataWriter()
        writer.SetInputConnection(sphere.GetOutputPort())
        writer.SetDataModeToAscii()
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "p.vtp"
            writer.SetFileName(str(path))
            writer.Write()
            whole = path.read_text()
            for old, new, words in (('NumberOfPoints="50"', 'NumberOfPoints="-2147483648"', "NumberOfPoints"),
                                    ('NumberOfPoints="50"', 'NumberOfPoints="40"', "points that are not there"),
                                    ('NumberOfPoints="50"', 'NumberOfPoints="0"', "points that are not there"),
                                    ("          3 6 9 12", "          1 6 9 12", "fewer than three corners"),
                                    (" 285 288", " 285 9000000000", "more corners than the file can hold")):
                self.assertIn(old, whole)
                path.write_text(whole.replace(old, new))
                errors = self.errors_of(source(Scene=json.dumps({**SCENE, "tissue": [{"mesh": {"file": str(path), "material": "liver"}}]})))
                self.assertIn(words, errors[0])
                self.assertIn("p.vtp", errors[0])

    @staticmethod
    def errors_of(made):
        errors = []
        observe = lambda caller, event, text="": errors.append(text)
        observe.CallDataType = "string0"
        for one in (made, made.GetExecutive()):
            one.AddObserver(vtkCommand.ErrorEvent, observe)
        made.Update()
        return errors

    def test_what_is_refused(self):
        for properties, words in (
                ({}, ["there is no scene"]),
                ({"Scene": "{"}, ["the scene", "JSON"]),
                ({"Scene": json.dumps({**SCENE, "sede": 1})}, ["sede", "no such key"]),
                ({"Scene": json.dumps(SCENE), "FileName": "a.json"}, ["both set"]),
                ({"Scene": json.dumps(SCENE), "View": 3}, ["View is 3", "2 views"]),
                ({"FileName": "/nowhere/scene.json"}, ["/nowhere/scene.json"]),
                ({"Scene": json.dumps({**SCENE, "tissue": [{"mesh": {"file": "nowhere.stl", "material": "liver"}}]})}, ["nowhere.stl"])):
            made = source(**properties)
            errors = self.errors_of(made)
            self.assertTrue(errors, properties)
            for word in words:
                self.assertIn(word, errors[0])
            self.assertEqual(made.GetOutputDataObject(0).GetNumberOfBlocks(), 0)


if __name__ == "__main__":
    unittest.main()
