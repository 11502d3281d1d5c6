#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundSynthesizer: tissue and probe in, a volume with its truth out."""
import json
import unittest

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkDoubleArray, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPolyData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkFiltersSources import vtkCubeSource, vtkSphereSource
from vtkmodules.vtkFiltersGeneral import vtkTransformPolyDataFilter
from vtkmodules.vtkCommonTransforms import vtkTransform

import echorama

acquisition = echorama.vtkUltrasoundAcquisition


def tissue(**numbers):
    source = echorama.vtkUltrasoundTissueSource()
    for name, value in numbers.items():
        getattr(source, "Set" + name)(value)
    return source


def small(source=None):
    """A synthesizer of few beams."""
    synthesizer = echorama.vtkUltrasoundSynthesizer()
    synthesizer.source = source or tissue()
    synthesizer.SetInputConnection(synthesizer.source.GetOutputPort())
    synthesizer.SetElements(24)
    synthesizer.SetSteps(10)
    synthesizer.SetSamples(120)
    synthesizer.SetDepthMax(70)
    synthesizer.SetSpacingMm(2)
    return synthesizer


def grey(image, name="Intensity"):
    return vtk_to_numpy(image.GetPointData().GetArray(name)).reshape(image.GetDimensions()[::-1])


def errors_of(filter, port=0):
    errors = []

    def remember(caller, event, message):
        errors.append(message)

    remember.CallDataType = "string0"
    for each in (filter, filter.GetExecutive()):
        each.AddObserver(vtkCommand.ErrorEvent, remember)
    filter.Update(port)
    return " ".join(errors)


class Volumes(unittest.TestCase):
    def test_what_comes_out(self):
        synthesizer = small()
        synthesizer.SetSeed(7)
        synthesizer.Update()
        volume, beams = synthesizer.GetOutput(0), synthesizer.GetOutput(1)
        self.assertEqual(beams.GetDimensions(), (120, 24, 10))
        self.assertEqual(set(np.unique(grey(volume, "ValidRegion"))), {0, 1})
        self.assertTrue((grey(volume)[grey(volume, "ValidRegion") == 0] == 0).all())
        self.assertGreater(grey(volume)[grey(volume, "ValidRegion") == 1].std(), 5)
        for image in (volume, beams):
            self.assertEqual(image.GetFieldData().GetArray(acquisition.SeedName()).GetValue(0), 7)
            scene = json.loads(image.GetFieldData().GetAbstractArray(acquisition.SceneName()).GetValue(0))
            self.assertEqual((scene["elements"], scene["seed"]), (24, 7))
            self.assertEqual(image.GetFieldData().GetNumberOfArrays(), 4)
        self.assertIn("scatterers", synthesizer.GetNotes())

    def test_counting_uses_what_is_said_to_be_used(self):
        def counted(name=None, value=None):
            synthesizer = small()
            synthesizer.SetElements(4)
            synthesizer.SetSteps(2)
            synthesizer.SetModeToCounting()
            synthesizer.SetRaysPerElement(30)
            synthesizer.SetNoiseDb(-40)
            if name:
                synthesizer.SetParameterAsText(name, value)
            synthesizer.Update(1)
            return grey(synthesizer.GetOutput(1))

        reference = counted()
        self.assertGreater(reference.std(), 5)
        for one in json.loads(small().GetParameterDescriptions()):
            when = one.get("when", {})
            if when.get("name") not in ("Mode", "DynamicReceive") or "counting" in when["values"]:
                continue
            other = {"switch": lambda: "off" if one["value"] else "on",
                     "choice": lambda: next(choice for choice in one["choices"] if choice != one["value"])}
            value = other.get(one["type"], lambda: str(one["low"] if one["value"] != one["low"] else one["high"]))()
            with self.subTest(one["name"], value=value):
                self.assertTrue((counted(one["name"], value) == reference).all())
        for name, value in {"Seed": "2", "AssumedSoundSpeed": "1400", "GainDb": "10", "RaysPerElement": "20", "Clarity": "3",
                            "ConeDegrees": "20", "MaxEvents": "1", "DynamicRangeDb": "40"}.items():
            with self.subTest(name):
                self.assertFalse((counted(name, value) == reference).all())

    def test_scan_conversion_of_the_beams_is_the_volume(self):
        synthesizer = small()
        converter = echorama.vtkUltrasoundScanConverter()
        converter.SetInputConnection(synthesizer.GetOutputPort(1))
        converter.SetSpacingMm(2)
        converter.Update()
        synthesizer.Update(0)
        np.testing.assert_array_equal(grey(converter.GetOutput()), grey(synthesizer.GetOutput(0)))

    def test_the_same_seed_is_the_same_volume(self):
        first, again, other = small(), small(), small()
        other.SetSeed(2)
        for each in (first, again, other):
            each.Update()
        np.testing.assert_array_equal(grey(first.GetOutput()), grey(again.GetOutput()))
        self.assertGreater(np.abs(grey(first.GetOutput()).astype(float) - grey(other.GetOutput())).mean(), 3)

    def test_the_geometry_is_the_pose(self):
        synthesizer = small()
        synthesizer.SetPosition(10, -20, 30)
        synthesizer.SetOrientation(20, 30, -10)
        synthesizer.Update()
        pose, said = vtkMatrix4x4(), vtkMatrix4x4()
        synthesizer.GetProbeToWorld(pose)
        self.assertTrue(acquisition.GetProbeToWorld(synthesizer.GetOutput(), said))
        direction = synthesizer.GetOutput().GetDirectionMatrix()
        for i in range(3):
            for j in range(4):
                self.assertAlmostEqual(pose.GetElement(i, j), said.GetElement(i, j), 12)
                if j < 3:
                    self.assertAlmostEqual(pose.GetElement(i, j), direction.GetElement(i, j), 12)
        again = small()
        again.SetProbeToWorld(pose)
        self.assertAlmostEqual(again.GetPosition()[1], -20)
        self.assertAlmostEqual(again.GetOrientation()[0], 20)

    def test_moving_tissue_and_probe_alike_changes_nothing_that_lies_on_surfaces(self):
        """Surfaces move with their data; scatterers only with a displacement."""
        def seen(shift, with_displacement):
            synthesizer = small(tissue(FillFraction=0.1))
            move = vtkTransform()
            move.Translate(shift)
            moved = vtkTransformPolyDataFilter()
            moved.SetTransform(move)
            moved.SetInputConnection(synthesizer.source.GetOutputPort())
            synthesizer.SetInputConnection(moved.GetOutputPort())
            synthesizer.SetPosition(shift)
            if with_displacement:
                image = vtkImageData()
                image.SetDimensions(16, 16, 16)
                image.SetSpacing(25, 25, 25)
                image.SetOrigin(-190, -190, -150)
                array = vtkDoubleArray()
                array.SetName("Displacement")
                array.SetNumberOfComponents(3)
                array.SetNumberOfTuples(16**3)
                for axis in range(3):
                    array.FillComponent(axis, shift[axis])
                image.GetPointData().AddArray(array)
                synthesizer.SetInputData(2, image)
            synthesizer.Update()
            return grey(synthesizer.GetOutput(1)).astype(float)

        rest, moved, left = seen((0, 0, 0), False), seen((3, -2, 4), True), seen((3, -2, 4), False)
        self.assertLess(np.abs(rest - moved).mean(), 0.5)
        self.assertGreater(np.abs(rest - left).mean(), 3)

    def test_a_slice_is_an_image(self):
        synthesizer = small()
        synthesizer.SliceOnlyOn()
        for position in (-0.5, 0.0, 0.5):
            synthesizer.SetSlicePosition(position)
            synthesizer.Update()
            self.assertEqual(synthesizer.GetOutput().GetDimensions()[2], 1)
            self.assertEqual(synthesizer.GetOutput(1).GetDimensions(), (120, 24, 1))

    def test_a_probe_by_its_input(self):
        probe = vtkPolyData()
        for name, numbers in ((acquisition.ProbeGeometryName(), [0.0, 30.0, 0.0, 20.0, 0.0, 50.0]),
                              (acquisition.ProbeToWorldName(), [1, 0, 0, 5, 0, 1, 0, 6, 0, 0, 1, 7, 0, 0, 0, 1])):
            array = vtkDoubleArray()
            array.SetName(name)
            array.SetNumberOfComponents(len(numbers))
            array.InsertNextTuple(numbers)
            probe.GetFieldData().AddArray(array)
        synthesizer = small()
        synthesizer.SetInputData(1, probe)
        synthesizer.Update()
        volume = synthesizer.GetOutput()
        np.testing.assert_allclose(volume.GetBounds(), (-10, 20, -4, 16, 7, 57), atol=2.1)
        self.assertTrue(grey(volume, "ValidRegion").mean() > 0.9)
        synthesizer.SetInputConnection(1, None)
        synthesizer.Update()
        self.assertLess(grey(synthesizer.GetOutput(), "ValidRegion").mean(), 0.9)

    def test_counting(self):
        synthesizer = small()
        synthesizer.SetModeToCounting()
        synthesizer.SetRaysPerElement(16)
        synthesizer.Update()
        self.assertGreater(grey(synthesizer.GetOutput()).max(), 50)

    def test_gain_brightens(self):
        synthesizer = small()
        synthesizer.Update()
        before = grey(synthesizer.GetOutput()).mean()
        synthesizer.SetGainDb(10)
        synthesizer.Update()
        self.assertGreater(grey(synthesizer.GetOutput()).mean(), before + 10)

    def test_tissue_that_changes_is_seen(self):
        synthesizer = small()
        synthesizer.Update()
        before = grey(synthesizer.GetOutput()).copy()
        synthesizer.source.SetSeed(99)
        synthesizer.Update()
        self.assertGreater(np.abs(before.astype(float) - grey(synthesizer.GetOutput())).mean(), 1)


def seen_by(synthesizer, places):
    tissue, seen = vtkPoints(), vtkPoints()
    tissue.SetData(numpy_to_vtk(np.asarray(places, dtype=float), deep=True))
    synthesizer.TissueToSeen(tissue, seen)
    return vtk_to_numpy(seen.GetData())


class WhereTissueIsSeen(unittest.TestCase):
    places = np.array([(0, 0, 10), (2, -3, 30), (-15, 8, 45), (0, 0, 80), (90, 0, 30)])  # the last two: too deep, beside the fan

    def moved(self, background):
        """A probe somewhere in a uniform background; the places in the world, and what turns its frame into the world's."""
        synthesizer = small(tissue(FillFraction=0, Background=background))
        synthesizer.SetPosition(10, -20, 30)
        synthesizer.SetOrientation(20, 30, -10)
        pose = vtkMatrix4x4()
        synthesizer.GetProbeToWorld(pose)
        rotation = np.array([[pose.GetElement(i, j) for j in range(3)] for i in range(3)])
        return synthesizer, self.places @ rotation.T + (10, -20, 30), rotation

    def test_with_the_speed_that_is_assumed_where_it_is(self):
        synthesizer, world, _ = self.moved("tissue")
        seen = seen_by(synthesizer, world)
        np.testing.assert_allclose(seen[:3], world[:3], atol=1e-6)
        self.assertTrue(np.isnan(seen[3:]).all())
        self.assertEqual(synthesizer.GetOutput().GetNumberOfPoints(), 0)  # no update was needed

    def test_with_another_speed_deeper(self):
        synthesizer, world, rotation = self.moved("fat")
        seen = seen_by(synthesizer, world)
        np.testing.assert_allclose(seen[0] - world[0], rotation @ (0, 0, 10 * (1540 / 1450 - 1)), atol=1e-2)  # between beams
        synthesizer.SetAssumedSoundSpeed(1450)
        np.testing.assert_allclose(seen_by(synthesizer, world)[:3], world[:3], atol=1e-6)

    def test_tissue_and_probe_that_change(self):
        synthesizer = small(tissue(FillFraction=0))
        np.testing.assert_allclose(seen_by(synthesizer, self.places)[:3], self.places[:3], atol=1e-6)
        synthesizer.source.SetBackground("fat")
        self.assertGreater(seen_by(synthesizer, self.places)[1, 2], self.places[1, 2] + 1)
        probe = echorama.vtkUltrasoundProbeSource()
        probe.SetPosition(0, 0, 100)
        synthesizer.SetProbeConnection(probe.GetOutputPort())
        self.assertTrue(np.isnan(seen_by(synthesizer, self.places)).all())

    def test_a_ball_is_shown_there(self):
        """Behind a slanted layer, all in clear water: the middle of the power in the image."""
        ball, layer, slant, slanted = vtkSphereSource(), vtkCubeSource(), vtkTransform(), vtkTransformPolyDataFilter()
        centre = (2, -1, 45)
        ball.SetCenter(centre)
        ball.SetRadius(0.6)
        for length in (layer.SetXLength, layer.SetYLength):
            length(120)
        layer.SetZLength(12)
        slant.Translate(0, 0, 22)
        slant.RotateY(35)
        slanted.SetTransform(slant)
        slanted.SetInputConnection(layer.GetOutputPort())
        meshes = echorama.vtkUltrasoundTissueMeshes()
        meshes.AddInputConnection(slanted.GetOutputPort())
        meshes.AddInputConnection(ball.GetOutputPort())
        meshes.SetMaterials("cyst, tissue")
        meshes.SetBackground("water")
        synthesizer = small(meshes)
        for name, value in dict(FanAngle=15, SweepAngle=10, DepthMin=38, DepthMax=54, Elements=40, Steps=16, Samples=200,
                                SpacingMm=0.25, NoiseDb=-200, MirrorDb=0, ScatterersPerMm3=100).items():
            synthesizer.SetParameter(name, value)
        power = 0.0
        for seed in range(1, 6):  # few scatterers have their middle anywhere in the ball
            synthesizer.SetSeed(seed)
            synthesizer.Update()
            greys = grey(synthesizer.GetOutput()).astype(float)
            self.assertTrue(100 < greys.max() < 255, greys.max())
            power += np.where(greys > 0, 10 ** (greys / 255 * synthesizer.GetDynamicRangeDb() / 10), 0)
        index = [(power * axis).sum() / power.sum() for axis in np.indices(power.shape)[::-1]]
        middle = index * np.array(synthesizer.GetOutput().GetSpacing()) + synthesizer.GetOutput().GetOrigin()
        seen = seen_by(synthesizer, [centre])[0]
        np.testing.assert_allclose(middle, seen, atol=0.3)
        self.assertGreater(np.linalg.norm(seen - centre), 1.2)

    def test_errors_leave_nothing_seen(self):
        for change in (lambda s: s.SetModeToCounting(), lambda s: s.SetElements(1), lambda s: s.RemoveAllInputs(),
                       lambda s: s.SetInputData(vtkPolyData()), lambda s: s.SetInputData(1, vtkPolyData())):
            synthesizer, errors = small(), []
            change(synthesizer)
            synthesizer.AddObserver(vtkCommand.ErrorEvent, lambda *_: errors.append(1))
            self.assertTrue(np.isnan(seen_by(synthesizer, self.places)).all())
            self.assertEqual(len(errors), 1)


class Refusals(unittest.TestCase):
    def refuses(self, change, *words):
        synthesizer = small()
        change(synthesizer)
        said = errors_of(synthesizer)
        for word in words:
            self.assertIn(word, said)
        self.assertEqual(synthesizer.GetOutput().GetNumberOfPoints(), 0)

    def test_parameters(self):
        self.refuses(lambda s: s.SetElements(1), "Elements", "[2, 4096]")
        self.refuses(lambda s: s.SetSamples(100000), "Samples", "16384")
        self.refuses(lambda s: s.SetSteps(1), "Steps", "at least 2")
        self.refuses(lambda s: s.SetFrequencyMHz(0), "FrequencyMHz", "[0.5, 60]")
        self.refuses(lambda s: s.SetSubRays(0), "SubRays")
        self.refuses(lambda s: s.SetDynamicRangeDb(1), "DynamicRangeDb")
        self.refuses(lambda s: s.SetFanAngle(-5), "FanAngle")
        self.refuses(lambda s: s.SetSlicePosition(1), "SlicePosition", "[-0.5, 0.5]")
        self.refuses(lambda s: s.SetDepthMax(1), "depth")
        self.refuses(lambda s: s.SetScatterersPerMm3(-1), "ScatterersPerMm3")
        self.refuses(lambda s: s.SetMaxBounces(1000), "MaxBounces")

    def test_what_is_no_value_is_refused_when_it_is_set(self):
        synthesizer, errors = small(), []
        synthesizer.AddObserver(vtkCommand.ErrorEvent, lambda *_: errors.append(1))
        for change in (lambda: synthesizer.SetSeed(-1), lambda: synthesizer.SetNoiseSeed(-1), lambda: synthesizer.SetMode(7)):
            errors.clear()
            change()
            self.assertEqual(errors, [1])
        self.assertEqual((synthesizer.GetSeed(), synthesizer.GetNoiseSeed(), synthesizer.GetMode()), (1, 1, synthesizer.COHERENT))

    def test_inputs(self):
        self.refuses(lambda s: s.SetInputData(vtkPolyData()), "MaterialName")
        self.refuses(lambda s: s.SetInputData(1, vtkPolyData()), "ProbeGeometry")
        self.refuses(lambda s: s.SetInputData(2, vtkImageData()), "displacement")

    def test_it_works_again_afterwards(self):
        synthesizer = small()
        synthesizer.SetElements(1)
        self.assertNotEqual(errors_of(synthesizer), "")
        synthesizer.SetElements(8)
        synthesizer.Update()
        self.assertGreater(synthesizer.GetOutput().GetNumberOfPoints(), 0)

    def test_a_pose_that_is_none(self):
        synthesizer = small()
        matrix = vtkMatrix4x4()
        matrix.SetElement(0, 0, 2.0)
        errors = []
        synthesizer.AddObserver(vtkCommand.ErrorEvent, lambda *_: errors.append(1))
        synthesizer.SetProbeToWorld(matrix)
        self.assertTrue(errors)

    def test_it_can_be_stopped(self):
        synthesizer = small()
        synthesizer.AddObserver(vtkCommand.ProgressEvent, lambda *_: synthesizer.SetAbortExecute(1))
        synthesizer.Update()
        self.assertEqual(synthesizer.GetOutput().GetNumberOfPoints(), 0)


if __name__ == "__main__":
    unittest.main()
