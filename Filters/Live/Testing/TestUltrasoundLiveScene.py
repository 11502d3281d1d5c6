#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Live images of scenes: tissue in, drawn or by the acoustic model."""
import unittest

import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkFiltersSources import vtkSphereSource

from echorama import vtkUltrasoundAnatomySource, vtkUltrasoundLiveImage


def pixels(image):
    nx, ny, _ = image.GetDimensions()
    return vtk_to_numpy(image.GetPointData().GetArray("Intensity")).reshape(ny, nx)


class LiveScene(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.anatomy = vtkUltrasoundAnatomySource()
        cls.anatomy.SetDetailMm(4.0)

    def live(self, source):
        live = vtkUltrasoundLiveImage()
        live.SetInputConnection(1, self.anatomy.GetOutputPort())
        live.SetSource(source)
        live.SetBeams(64)
        live.SetSamples(256)
        live.SetDepthMm(90)
        live.SetPosition(0, 0, 4)
        return live

    def test_shows_the_body_by_both_models(self):
        for source, name in ((vtkUltrasoundLiveImage.SCENE, "scene"), (vtkUltrasoundLiveImage.ACOUSTIC, "acoustic")):
            live = self.live(source)
            live.Update()
            self.assertEqual((live.GetState(), live.GetStateText()), (live.SEES_VOLUME, ""), name)
            self.assertEqual(live.GetSeenShare(), 1.0)
            self.assertEqual(live.GetContactShare(), 1.0) # the anatomy lies in gel
            image = pixels(live.GetOutput())
            self.assertEqual(image.shape, (480, 640))
            valid = vtk_to_numpy(live.GetOutput().GetPointData().GetArray("ValidRegion")).reshape(480, 640)
            self.assertGreater(image[valid == 1].mean(), 40)
            self.assertEqual(image[valid == 0].max(), 0)
            live.SetGainDb(-200 / 2)
            live.Update()
            self.assertLess(pixels(live.GetOutput())[valid == 1].mean(), 1)

    def test_keeps_the_scene_while_the_probe_moves(self):
        live = self.live(vtkUltrasoundLiveImage.SCENE)
        live.Update()
        first = pixels(live.GetOutput()).copy()
        live.SetPosition(20, 0, 4)
        live.Update()
        self.assertGreater(numpy.abs(pixels(live.GetOutput()).astype(float) - first).mean(), 1)
        live.SetPosition(0, 0, 4)
        live.Update()
        self.assertTrue((pixels(live.GetOutput()) == first).all())
        # Other tissue is noticed.
        other = vtkUltrasoundAnatomySource()
        other.SetDetailMm(4.0)
        other.SetSeed(7)
        live.SetInputConnection(1, other.GetOutputPort())
        live.Update()
        self.assertFalse((pixels(live.GetOutput()) == first).all())

    def test_refinement_ends_with_the_best(self):
        live = self.live(vtkUltrasoundLiveImage.ACOUSTIC)
        images = []
        for level in range(4):
            live.SetRefinement(level)
            live.Update()
            images.append(pixels(live.GetOutput()).astype(float))
        errors = [numpy.abs(image - images[3]).mean() for image in images]
        self.assertGreater(errors[0], errors[1])
        self.assertGreater(errors[1], errors[2])

    def test_without_tissue_it_is_empty_and_says_so(self):
        live = vtkUltrasoundLiveImage()
        live.SetSource(live.SCENE)
        live.Update()
        self.assertEqual((live.GetState(), live.GetStateText()), (live.NO_VOLUME, "there is no tissue"))
        self.assertEqual(pixels(live.GetOutput()).max(), 0)
        live = self.live(vtkUltrasoundLiveImage.SCENE)
        live.SetPosition(0, 0, 4)
        live.SetOrientation(180, 0, 0) # looks away
        live.SetPosition(0, 0, -100)
        live.Update()
        self.assertEqual(live.GetState(), live.OUTSIDE)
        self.assertEqual(live.GetStateText(), "no body lies under the probe")

    def test_refuses_what_is_no_tissue(self):
        sphere = vtkSphereSource()
        live = vtkUltrasoundLiveImage()
        live.SetSource(live.SCENE)
        live.SetInputConnection(1, sphere.GetOutputPort())
        messages = []

        def note(caller, event, text):
            messages.append(text)

        note.CallDataType = "string0"
        live.AddObserver(vtkCommand.ErrorEvent, note)
        live.Update()
        self.assertIn("Material", " ".join(messages))
        self.assertEqual(live.GetState(), live.FAILED)
        live.SetInputConnection(1, self.anatomy.GetOutputPort())
        live.Update()
        self.assertEqual(live.GetState(), live.SEES_VOLUME)


if __name__ == "__main__":
    unittest.main()
