#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The needle in live images: where its pixels are, for every probe and source; that nothing of it is there out of the plane; what is told
of it; and that bone stops it."""
import unittest

import numpy
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonMath import vtkMatrix4x4

from echorama import vtkUltrasoundAnatomySource, vtkUltrasoundLiveImage


def volume(bone_from=None):
    """Grey of 100, 160 x 120 x 160 mm about (0, 0, 75), with bone below some depth."""
    image = vtkImageData()
    image.SetDimensions(80, 60, 80)
    image.SetSpacing(2, 2, 2)
    image.SetOrigin(-79, -59, -4)
    values = numpy.full((80, 60, 80), 100, numpy.uint8)
    if bone_from is not None:
        values[int((bone_from + 4) / 2):] = 250
    array = numpy_to_vtk(values.ravel(), deep=True)
    array.SetName("Intensity")
    image.GetPointData().AddArray(array)
    return image


def image_of(live):
    """Greys, and where each pixel lies in the world."""
    live.Update()
    image = live.GetOutput()
    width, height, _ = image.GetDimensions()
    grey = vtk_to_numpy(image.GetPointData().GetArray("Intensity")).reshape(height, width).astype(float)
    origin, spacing, direction = image.GetOrigin(), image.GetSpacing(), image.GetDirectionMatrix()
    axes = numpy.array([[direction.GetElement(i, j) for j in range(2)] for i in range(3)])
    x, y = numpy.meshgrid(numpy.arange(width) * spacing[0], numpy.arange(height) * spacing[1])
    return grey, numpy.array(origin) + x[..., None] * axes[:, 0] + y[..., None] * axes[:, 1]


def errors_of(live, action):
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    tags = [(each, each.AddObserver(vtkCommand.ErrorEvent, note)) for each in (live, live.GetExecutive())]
    action()
    for each, tag in tags:
        each.RemoveObserver(tag)
    return " ".join(messages)


class LiveNeedle(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.anatomy = vtkUltrasoundAnatomySource()
        cls.anatomy.SetDetailMm(4.0)

    def live(self, probe=vtkUltrasoundLiveImage.CONVEX, source=vtkUltrasoundLiveImage.VOLUMES, body=None):
        live = vtkUltrasoundLiveImage()
        live.AddInputDataObject(0, body if body is not None else volume())
        live.SetInputConnection(1, self.anatomy.GetOutputPort())
        live.SetSource(source)
        live.SetProbe(probe)
        live.SetPosition(0, 0, 4)
        return live

    def place(self, live, tip, direction):
        live.NeedleOn()
        live.SetNeedleTip(*tip)
        live.SetNeedleDirection(*direction)
        live.Modified()

    def test_lies_on_its_line_for_every_probe_and_source(self):
        cases = [(probe, vtkUltrasoundLiveImage.VOLUMES, (8, 0, 22), (1, 0, 0.05)) for probe in range(4)]
        cases += [(vtkUltrasoundLiveImage.RADIAL, vtkUltrasoundLiveImage.VOLUMES, (6, 0, 47), (1, 0, 0.05))] # over the seam
        cases += [(vtkUltrasoundLiveImage.CONVEX, source, (8, 0, 30), (1, 0, 0.05)) for source in (1, 2)]
        for flip in (0, 1):
            for probe, source, tip, direction in cases:
                with self.subTest(probe=probe, source=source, flip=flip):
                    live = self.live(probe, source)
                    if probe == live.RADIAL:
                        live.SetPosition(0, 0, 60)
                    live.SetFlip(flip)
                    live.SetRefinement(0)
                    live.SetNeedleReverberationMm(0)
                    live.SetNeedleShadowDb(0)
                    before, points = image_of(live)
                    self.assertEqual(live.GetNeedleState(), live.NO_NEEDLE)
                    self.place(live, tip, direction)
                    after, _ = image_of(live)
                    self.assertEqual(live.GetNeedleState(), live.NEEDLE_IN_PLANE)
                    way = numpy.array(direction) / numpy.linalg.norm(direction)
                    behind = (numpy.array(tip) - points) @ way # up the shaft
                    aside = numpy.linalg.norm(points - numpy.array(tip) + behind[..., None] * way, axis=-1)
                    brighter = after - before > 25
                    # All that is brighter lies on the needle, and ends at its tip.
                    self.assertLess(aside[brighter].max(), 2.0)
                    self.assertGreater(behind[brighter].min(), -2.0)
                    # The shaft has no gap where it is square to the beams.
                    on = (aside < 0.25) & (behind > 1) & (behind < (11 if probe == live.RADIAL else 8))
                    self.assertGreater(on.sum(), 10)
                    self.assertGreater(after[on].min(), before[on].max())

    def test_fades_with_the_thickness_and_is_nowhere_out_of_the_plane(self):
        live = self.live(vtkUltrasoundLiveImage.LINEAR)
        live.SetThicknessMm(2)
        live.SetDivergence(0)
        live.SetNeedleEchoDb(-6)
        live.SetNeedleShadowDb(0)
        live.SetNeedleReverberationMm(0)
        without, points = image_of(live)
        on = (numpy.abs(points[..., 2] - 24) < 0.1) & (numpy.abs(points[..., 0]) < 5)
        greys = {}
        for off in (0.0, 0.7, -0.7, 1.2, 10.0):
            self.place(live, (8, off, 24), (1, 0, 0))
            image, _ = image_of(live)
            greys[off] = image[on].max()
            self.assertAlmostEqual(live.GetNeedleTipOffPlaneMm(), off)
            self.assertEqual(live.GetNeedleTipInPlane(), abs(off) < 1)
            self.assertEqual(live.GetNeedleState(), live.NEEDLE_IN_PLANE if abs(off) < 1 else live.NEEDLE_OUT_OF_PLANE)
        self.assertTrue((image == without).all()) # 10 mm off: not a pixel
        self.assertEqual(greys[0.7], greys[-0.7])
        # Half of the amplitude half of 2 mm off: 6.02 dB of 60 for 255 steps, and tissue's own -36.5 dB adds little.
        self.assertAlmostEqual(greys[0] - greys[0.7], 255 * 6.02 * 0.49 / 60, delta=2)
        # The probe's own thickness makes it seen where a thin plane does not.
        live.SetThicknessMm(6)
        self.place(live, (8, 2.0, 24), (1, 0, 0))
        live.Update()
        self.assertEqual(live.GetNeedleState(), live.NEEDLE_IN_PLANE)

    def test_follows_the_probe(self):
        live = self.live()
        self.place(live, (10, 0, 40), (1, 0, 0))
        here, _ = image_of(live)
        live.SetNeedleTip(10, 20, 40)
        live.SetPosition(0, 20, 4)
        there, _ = image_of(live)
        self.assertLess(numpy.abs(there - here).max(), 2)
        live.SetPosition(0, 0, 4)
        live.Update()
        self.assertEqual(live.GetNeedleState(), live.NEEDLE_OUT_OF_PLANE)

    def test_marks_the_tip_only_when_it_may(self):
        live = self.live()
        self.place(live, (0, 0, 50), (0.15, 0, 1)) # steep: the shaft is hardly seen
        hidden, points = image_of(live)
        live.NeedleShowTipOn()
        shown, _ = image_of(live)
        near = numpy.linalg.norm(points - numpy.array([0, 0, 50]), axis=-1) < 0.5
        self.assertGreater(shown[near].max(), 230) # 0 dB, but for what lies between the beams
        self.assertLess(hidden[near].max(), 150)
        away = numpy.linalg.norm(points - numpy.array([0, 0, 50]), axis=-1)
        self.assertTrue((shown == hidden)[(away > 6) & (points[..., 2] < 50)].all())

    def test_takes_the_pose_of_a_tool(self):
        live = self.live()
        matrix = vtkMatrix4x4() # z of the tool along x of the world
        for i, row in enumerate(((0, 0, 1, 5), (0, 1, 0, 6), (-1, 0, 0, 7))):
            for j, value in enumerate(row):
                matrix.SetElement(i, j, value)
        self.assertTrue(live.SetNeedleToWorld(matrix))
        self.assertEqual(live.GetNeedleTip(), (5, 6, 7))
        self.assertTrue(numpy.allclose(live.GetNeedleDirection(), (1, 0, 0)))
        matrix.SetElement(0, 0, 0.5)
        self.assertIn("not a rigid", errors_of(live, lambda: self.assertFalse(live.SetNeedleToWorld(matrix))))
        self.assertEqual(live.GetNeedleTip(), (5, 6, 7))

    def test_refuses_what_is_no_needle(self):
        live = self.live()
        for tip, direction in (((0, 0, 20), (0, 0, 0)), ((0, 0, float("nan")), (0, 0, 1)), ((0, 0, 20), (float("inf"), 0, 0))):
            self.place(live, tip, direction)
            self.assertIn("Needle", errors_of(live, live.Update))
            self.assertEqual(live.GetState(), live.FAILED)
            self.assertIn("Needle", errors_of(live, lambda: self.assertEqual(live.AdvanceNeedle(1), 0)))
        self.place(live, (0, 0, 20), (0, 0, 1))
        live.Update()
        self.assertEqual(live.GetState(), live.SEES_VOLUME)

    def test_bone_of_a_volume_stops_it(self):
        live = self.live(body=volume(bone_from=60))
        self.place(live, (0, 0, 4), (0, 0, 3)) # of any length
        self.assertAlmostEqual(live.AdvanceNeedle(70), 70) # nobody asked for a stop
        self.assertAlmostEqual(live.AdvanceNeedle(-70), -70)
        live.NeedleStopsOn()
        self.assertAlmostEqual(live.AdvanceNeedle(70), 55.5, delta=1) # 250 from 60 mm on, 217 a little before
        self.assertAlmostEqual(live.GetNeedleTip()[2], 59.5, delta=1)
        self.assertAlmostEqual(live.AdvanceNeedle(5), 0, delta=0.02)
        self.assertAlmostEqual(live.AdvanceNeedle(-20), -20) # out it always goes
        live.SetNeedleStopLevel(1)
        self.assertAlmostEqual(live.AdvanceNeedle(30), 30)
        # The greys that count are those from black to white.
        live.SetNeedleTip(0, 0, 4)
        live.SetNeedleStopLevel(0.85)
        live.SetWhite(400)
        self.assertAlmostEqual(live.AdvanceNeedle(70), 70)

    def test_bone_of_a_scene_stops_it(self):
        live = self.live(source=vtkUltrasoundLiveImage.SCENE)
        live.NeedleStopsOn()
        self.place(live, (0, 0, 4), (0, 0, 1))
        free = live.AdvanceNeedle(30)
        self.assertAlmostEqual(free, 30)
        before = live.GetOutput().GetMTime()
        live.Update()
        self.assertGreater(live.GetOutput().GetMTime(), before) # it has moved


if __name__ == "__main__":
    unittest.main()
