#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Projects that travel, and tints, by the wrapped class."""
import pathlib
import shutil
import tempfile
import unittest

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData

from echorama import vtkUltrasoundAlignmentSession, vtkUltrasoundWriter


def write(seed, path):
    image = vtkImageData()
    image.SetDimensions(12, 11, 10)
    image.SetOrigin(seed, 0, 0)
    data = numpy_to_vtk(np.random.default_rng(seed).integers(1, 200, 12 * 11 * 10).astype(np.uint8), deep=True)
    data.SetName("Intensity")
    image.GetPointData().SetScalars(data)
    writer = vtkUltrasoundWriter()
    writer.SetInputData(image)
    writer.SetFileName(str(path))
    writer.Write()


def colour(session, number):
    rgb = [0.0] * 3
    assert session.GetColour(session.GetVolumeId(number), rgb)
    return tuple(rgb)


class Projects(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.session = vtkUltrasoundAlignmentSession()
        self.errors = []
        self.session.AddObserver("ErrorEvent", lambda *_: self.errors.append(1))
        (self.folder / "here").mkdir()
        for seed, suffix in ((1, "mhd"), (2, "mha")):
            write(seed, self.folder / "here" / f"v{seed}.{suffix}")
            self.assertGreater(self.session.OpenVolume(str(self.folder / "here" / f"v{seed}.{suffix}")), 0)

    def test_a_copy_opens_where_nothing_else_is(self):
        self.session.SetPlacement(2, 5, 6, 7, 10, 20, 30)
        self.session.BeginStroke(1, "paint", 2, 250, 1, 1, False)
        self.session.ExtendStroke(6, 5, 5)
        self.session.EndStroke()
        self.assertTrue(self.session.CopyProject(str(self.folder / "copy")))
        self.assertEqual(self.session.GetProjectPath(), "", "the session goes on where it was")
        shutil.rmtree(self.folder / "here")
        shutil.move(self.folder / "copy", self.folder / "there")
        again = vtkUltrasoundAlignmentSession()
        self.assertTrue(again.OpenProject(str(self.folder / "there" / "copy.json")))
        for volume in (0, 1):
            old, new = (each.GetImage(each.GetVolumeId(volume)) for each in (self.session, again))
            np.testing.assert_array_equal(vtk_to_numpy(old.GetPointData().GetArray("Intensity")),
                                          vtk_to_numpy(new.GetPointData().GetArray("Intensity")))
            np.testing.assert_allclose(old.GetOrigin(), new.GetOrigin(), atol=1e-9)
        self.assertEqual(self.errors, [])

    def test_what_is_there_stays(self):
        self.assertFalse(self.session.CopyProject(str(self.folder / "here")))
        self.assertEqual(len(self.errors), 1)
        self.assertFalse((self.folder / "here" / "here.json").exists())

    def test_tints(self):
        self.assertEqual(colour(self.session, 0), (1.0, 1.0, 1.0))
        self.assertTrue(self.session.SetTints("blue-orange"))
        self.assertGreater(colour(self.session, 0)[2], colour(self.session, 0)[0])
        self.assertGreater(colour(self.session, 1)[0], colour(self.session, 1)[2])
        self.assertFalse(self.session.SetTints("plaid"))
        self.assertEqual(len(self.errors), 1)


if __name__ == "__main__":
    unittest.main()
