#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Live images of tissue that a probe presses, from states that were worked out before: they are those of the tissue deformed."""
import unittest

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkFiltersModeling import vtkLinearSubdivisionFilter
from vtkmodules.vtkFiltersCore import vtkTriangleFilter

import echorama
from pressing import BACK, TOP, Refusing, ball, block, probe, tissue

LIVE = echorama.vtkUltrasoundLiveImage


def pose_at(depth):
    matrix = vtkMatrix4x4()
    matrix.SetElement(2, 3, TOP + depth)
    return matrix


def texture():
    """What the block looks like at rest: waves of 8 to 13 mm."""
    image = vtkImageData()
    image.SetDimensions(61, 61, int(BACK - TOP) + 1)
    image.SetOrigin(-30, -30, TOP)
    z, y, x = np.meshgrid(TOP + np.arange(BACK - TOP + 1), *[np.arange(61) - 30.0] * 2, indexing="ij")
    values = 120 + 40 * np.sin(x / 2 + 0.3) + 40 * np.cos(z / 1.5 + 0.2 * y) + 20 * np.sin(0.6 * y)
    array = numpy_to_vtk(values.astype(np.float32).ravel(), deep=True)
    array.SetName("Intensity")
    image.GetPointData().SetScalars(array)
    return image


def fine_block():
    coarse, triangles = block(), vtkTriangleFilter()
    triangles.SetInputConnection(coarse.GetOutputPort())
    finer = vtkLinearSubdivisionFilter()
    finer.SetInputConnection(triangles.GetOutputPort())
    finer.SetNumberOfSubdivisions(5)
    finer.Update()
    return finer


def live_of(*states, press=0.0, volume=None, scene=None):
    live = LIVE()
    live.SetProbeFrom(probe(0.0))
    live.SetDepthMm(30)
    live.SetThicknessMm(2)
    live.SetFocusMm(15)
    live.SetWidth(240)
    live.SetHeight(180)
    live.SetBeams(96)
    live.SetSamples(200)
    live.SetPressMm(press)
    for state in states:
        live.AddPressStateData(state)
    if volume is not None:
        live.SetInputData(volume)
    if scene is not None:
        live.SetInputDataObject(1, scene)
        live.SetSource(live.SCENE)
        live.SetSpeckle(0)
    return live


def picture(live, depth):
    assert live.SetProbeToWorld(pose_at(depth))
    live.Update()
    assert live.GetState() == live.SEES_VOLUME, live.GetStateText()
    arrays = live.GetOutput().GetPointData()
    shape = (180, 240)
    return [vtk_to_numpy(arrays.GetArray(name)).reshape(shape).astype(float) for name in ("Intensity", "ValidRegion")]


def difference(one, other):
    both = (one[1] == 1) & (other[1] == 1)
    assert both.mean() > 0.2, both.mean()
    return np.sqrt(np.mean((one[0] - other[0])[both] ** 2))


class Pressed(Refusing):
    @classmethod
    def setUpClass(cls):
        cls.body = tissue(muscle=fine_block(), fat=ball(6.0, 4.0, 1.0, 35.0), liver=ball(4.0, -10.0, 0.0, 31.0))
        cls.states = {}
        for depth in (3.0, 6.0, 9.0):
            press = echorama.vtkUltrasoundTissuePress()
            press.SetInputData(cls.body)
            press.AddProbeData(probe(depth))
            press.SetSpacingMm(3.0)
            press.Update()
            cls.states[depth] = press.GetOutput()
            assert LIVE.SetPressState(press.GetOutput(), depth, pose_at(depth))

    def deformed(self, data, depth):
        deform = echorama.vtkUltrasoundDeformGeometry()
        deform.SetInputData(data)
        deform.SetDisplacementData(self.states[depth])
        deform.SetOutsideToNearest()
        deform.MaskFoldsOn()
        deform.Update()
        return deform.GetOutput()

    def test_volumes_are_as_the_deformed_volume(self):
        rest = texture()
        expected = picture(live_of(volume=self.deformed(rest, 6.0)), 6.0)
        errors = {"state": difference(picture(live_of(self.states[6.0], press=6.0, volume=rest), 6.0), expected),
                  "between": difference(picture(live_of(self.states[3.0], self.states[9.0], press=6.0, volume=rest), 6.0), expected),
                  "rest": difference(picture(live_of(volume=rest), 6.0), expected)}
        print("volume, rms of grey:", errors)
        self.assertLess(errors["state"], 2.5)  # the deformed volume was sampled twice
        self.assertLess(errors["between"], 4.0)
        self.assertGreater(errors["rest"], 20.0)

    def test_scenes_are_as_the_deformed_scene(self):
        moved = self.deformed(self.body, 6.0)
        expected = picture(live_of(scene=moved), 6.0)
        errors = {"state": difference(picture(live_of(self.states[6.0], press=6.0, scene=self.body), 6.0), expected),
                  "between": difference(picture(live_of(self.states[3.0], self.states[9.0], press=6.0, scene=self.body), 6.0), expected),
                  "rest": difference(picture(live_of(scene=self.body), 6.0), expected)}
        print("scene, rms of grey:", errors)
        self.assertLess(errors["state"], 2.0)
        self.assertLess(errors["between"], 3.0)
        self.assertGreater(errors["rest"], 5.0)

    def test_what_is_touched_is_seen_at_the_face(self):
        # The skin is where the face is, whatever the press: volumes begin there, and beams have contact.
        rest = texture()
        for depth in (0.5, 2.0, 4.5, 9.0):
            live = live_of(*self.states.values(), press=depth, volume=rest)
            grey, valid = picture(live, depth)
            column = np.flatnonzero(valid[:, 120])
            first = live.GetOutput().GetPoint(int(column[0]) * 240 + 120)[2] - TOP - depth
            self.assertLess(abs(first), 0.6, depth)
            scene = live_of(*self.states.values(), press=depth, scene=self.body)
            picture(scene, depth)
            self.assertGreater(scene.GetContactShare(), 0.15)

    def test_the_dent_goes_with_the_probe(self):
        # The texture is the same 4 pi mm further along x, and so is its pressed image.
        rest = texture()
        live = live_of(self.states[6.0], press=6.0, volume=rest)
        here = picture(live, 6.0)
        live.SetPosition(4 * np.pi, 0, TOP + 6.0)
        live.Update()
        there = vtk_to_numpy(live.GetOutput().GetPointData().GetArray("Intensity")).reshape(180, 240).astype(float)
        valid = vtk_to_numpy(live.GetOutput().GetPointData().GetArray("ValidRegion")).reshape(180, 240)
        self.assertLess(difference(here, (there, valid)), 1.0)

    def test_what_is_refused(self):
        rest = texture()
        self.refused(live_of(self.states[6.0], press=6.5, volume=rest), "PressMm", "6.5", "6")
        self.refused(live_of(self.states[6.0], self.states[6.0], press=3.0, volume=rest), "same PressMm")
        bare = vtkImageData()
        bare.DeepCopy(self.states[6.0])
        bare.GetFieldData().RemoveArray(LIVE.PressMmName())
        self.refused(live_of(bare, press=3.0, volume=rest), "pressed state 1", "PressMm")
        none = texture()
        assert LIVE.SetPressState(none, 4.0, pose_at(4.0))
        self.refused(live_of(none, press=3.0, volume=rest), "pressed state 1", "Displacement")
        skew = vtkMatrix4x4()
        skew.SetElement(0, 0, 2.0)
        self.assertFalse(LIVE.SetPressState(none, 4.0, skew))


if __name__ == "__main__":
    unittest.main()
