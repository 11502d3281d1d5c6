#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundSynthesizer: tissue and probe in, a volume with its truth out."""
import json
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkDoubleArray
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPolyData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
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
        self.refuses(lambda s: s.SetFrequencyMHz(0), "FrequencyMHz", "[0.5, 50]")
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
