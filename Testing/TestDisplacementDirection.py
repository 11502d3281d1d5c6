#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Displacement images have one direction, from rest to now, whoever makes or reads them: one image presses the surfaces and the
scatterers of tissue; read back through it, the scan of the pressed tissue is that of tissue at rest; and an aligner that compares both
scans finds it."""
import unittest

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData

import echorama

LONGEST = 4.0  # mm


def pressed(points):
    """Where tissue goes: away from the probe, mostly below its middle."""
    x, y, z = points.T
    push = LONGEST * np.exp(-(x**2 + y**2) / (2 * 45.0**2) - (z - 30) ** 2 / (2 * 45.0**2))
    return np.stack([0.25 * push, 0 * push, push], 1)


def displacement(sign=1.0):
    image = vtkImageData()
    image.SetDimensions(41, 41, 31)
    image.SetSpacing(10, 10, 10)
    image.SetOrigin(-200, -200, -120)
    points = np.array([image.GetPoint(i) for i in range(image.GetNumberOfPoints())])
    array = numpy_to_vtk(sign * pressed(points), deep=True)
    array.SetName(echorama.vtkUltrasoundDisplacement.DisplacementName())
    image.GetPointData().AddArray(array)
    return image


def deformed(data, image, **parameters):
    deform = echorama.vtkUltrasoundDeformGeometry()
    deform.SetInputDataObject(0, data)
    deform.SetDisplacementData(image)
    for name, value in parameters.items():
        deform.SetParameterAsText(name, value)
    deform.Update()
    return deform.GetOutputDataObject(0)


def tissue():
    source = echorama.vtkUltrasoundTissueSource()
    source.SetFillFraction(0.2)
    source.Update()
    return source.GetOutput()


def scan(data, image=None):
    synthesizer = echorama.vtkUltrasoundSynthesizer()
    synthesizer.SetInputDataObject(0, data)
    if image is not None:
        synthesizer.SetInputDataObject(2, image)
    for name, value in (("Elements", 64), ("Steps", 48), ("Samples", 320), ("DepthMax", 80), ("SpacingMm", 1.0)):
        getattr(synthesizer, "Set" + name)(value)
    synthesizer.Update()
    return synthesizer.GetOutput()


def values(image, name="Intensity"):
    return vtk_to_numpy(image.GetPointData().GetArray(name)).astype(float)


def likeness(a, b):
    """The correlation of what both show well inside."""
    points = np.array([a.GetPoint(i) for i in range(a.GetNumberOfPoints())])
    both = (values(a, "ValidRegion") * values(b, "ValidRegion") > 0) & (points[:, 2] > 10) & (points[:, 2] < 70)
    return np.corrcoef(values(a)[both], values(b)[both])[0, 1]


class Direction(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.there, cls.wrong = displacement(), displacement(-1.0)
        cls.rest = scan(tissue())
        cls.now = scan(deformed(tissue(), cls.there), cls.there)

    def check(self, right, wrong, like):
        """Speckle of voxels of 1 mm is blurred between them, so no two scans are the same. They are much less alike the wrong way, and as
        they are."""
        alike = likeness(right, like)
        self.assertGreater(alike, likeness(self.now, self.rest) + 0.15)
        self.assertGreater(alike, likeness(wrong, like) + 0.3)

    def test_a_scan_read_through_what_pressed_its_tissue_is_that_at_rest(self):
        options = {"Outside": "keep", "Direction": "backward"}
        right, wrong = deformed(self.now, self.there, **options), deformed(self.now, self.wrong, **options)
        self.check(right, wrong, self.rest)

    def test_tissue_at_rest_goes_where_the_scan_shows_it(self):
        right, wrong = (deformed(self.rest, image, Outside="keep") for image in (self.there, self.wrong))
        self.check(right, wrong, self.now)

    def test_the_stitcher_reads_at_rest(self):
        def stitched(image):
            stitcher = echorama.vtkUltrasoundStitcher()
            for _ in range(2):  # it takes no single one
                stitcher.AddInputDataObject(0, self.now)
                stitcher.AddDisplacementData(image)
            stitcher.Update()
            return stitcher.GetOutput()

        right, wrong = stitched(self.there), stitched(self.wrong)
        self.assertEqual(right.GetDimensions(), self.rest.GetDimensions())
        self.check(right, wrong, self.rest)

    def test_an_aligner_finds_it(self):
        align = echorama.vtkUltrasoundDeformableAligner()
        align.AddInputDataObject(0, self.rest)
        align.AddInputDataObject(0, self.now)
        align.Update()
        found = align.GetOutputDataObject(1).GetBlock(1)
        points = np.array([[x, y, z] for x in (-12, 0, 12) for y in (-10, 0, 10) for z in (25.0, 35.0, 45.0)])
        result, vectors = [0.0] * 3, []
        for point in points:
            self.assertTrue(echorama.vtkUltrasoundDisplacement.Evaluate(found, point, result))
            vectors.append(list(result))
        self.assertLess(np.linalg.norm(np.array(vectors) - pressed(points), axis=1).max(), 0.5 * LONGEST)
        self.assertLess(np.linalg.norm(np.array(vectors) - pressed(points), axis=1).mean(), 0.25 * LONGEST)


if __name__ == "__main__":
    unittest.main()
