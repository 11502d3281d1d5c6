#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""NIfTI beside nibabel: what either writes, the other reads as the same voxels at the same points."""
import gc
import os
import sys
import tempfile
import unittest

import numpy as np

try:
    import nibabel
except ImportError:
    print("skipped: python3-nibabel is not installed")
    sys.exit(77)

from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkLogger
from vtkmodules.vtkCommonDataModel import vtkImageData

from echorama import vtkUltrasoundReader, vtkUltrasoundWriter

lps = np.diag([-1.0, -1.0, 1.0])  # from RAS
dims = (7, 6, 5)


def rotation(seed):
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q * np.sign(np.linalg.det(q))


def affine(seed, mirrored=False):
    linear = rotation(seed) @ np.diag([0.3, 0.5, -0.7 if mirrored else 0.7])
    return np.block([[linear, np.array([[10.0], [-20.0], [30.0]])], [np.zeros((1, 3)), np.ones((1, 1))]])


def values(dtype, shape=dims):
    return np.random.default_rng(4).integers(0, 100, shape).astype(dtype)


def points_and_values(image):
    """World points of all voxels in a fixed order, and their values."""
    count = image.GetNumberOfPoints()
    points = np.array([image.GetPoint(i) for i in range(count)])
    return points, vtk_to_numpy(image.GetPointData().GetArray("Intensity"))


class Nifti(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()

    def tearDown(self):
        gc.collect()
        self.folder.cleanup()

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def read(self, name):
        reader = vtkUltrasoundReader()
        reader.SetFileName(self.path(name))
        reader.Update()
        return reader

    def assert_same(self, image, voxels, matrix, tolerance):
        """The voxels of a vtkImageData are those of an array with an affine to RAS, point by point."""
        self.assertEqual(image.GetDimensions(), voxels.shape)
        points, ours = points_and_values(image)
        index = np.linalg.inv(matrix) @ np.vstack([lps @ points.T, np.ones(len(points))])
        rounded = np.rint(index[:3]).astype(int)
        np.testing.assert_allclose(index[:3], rounded, atol=tolerance)
        np.testing.assert_array_equal(ours, voxels[tuple(rounded)])

    def test_what_nibabel_writes(self):
        for kind in [nibabel.Nifti1Image, nibabel.Nifti2Image]:
            for name in ["a.nii", "a.nii.gz"]:
                for mirrored in [False, True]:
                    for dtype in [np.uint8, np.int16, np.float32, np.float64, np.uint32]:
                        with self.subTest(kind=kind, name=name, mirrored=mirrored, dtype=dtype):
                            voxels, matrix = values(dtype), affine(3, mirrored)
                            nibabel.save(kind(voxels, matrix), self.path(name))
                            self.assert_same(self.read(name).GetOutput(), voxels, matrix, 1e-4)

    def test_the_qform_alone(self):
        for mirrored in [False, True]:
            voxels, matrix = values(np.uint8), affine(8, mirrored)
            image = nibabel.Nifti1Image(voxels, None)
            image.header.set_qform(matrix, code=1)
            image.header.set_sform(None, code=0)
            nibabel.save(image, self.path("q.nii"))
            stored = nibabel.load(self.path("q.nii")).affine
            self.assert_same(self.read("q.nii").GetOutput(), voxels, stored, 1e-4)

    def test_pairs_big_endian_and_scaling(self):
        voxels, matrix = values(np.int16), affine(5)
        nibabel.save(nibabel.Nifti1Pair(voxels, matrix), self.path("p.img"))
        self.assert_same(self.read("p.hdr").GetOutput(), voxels, matrix, 1e-4)
        header = nibabel.Nifti1Header(endianness=">")
        nibabel.save(nibabel.Nifti1Image(voxels, matrix, header), self.path("b.nii"))
        self.assert_same(self.read("b.nii").GetOutput(), voxels, matrix, 1e-4)
        image = nibabel.Nifti1Image(voxels.astype(np.float64) * 0.37 - 5, matrix)
        image.set_data_dtype(np.uint8)  # nibabel finds slope and intercept
        nibabel.save(image, self.path("s.nii"))
        scaled = np.asarray(nibabel.load(self.path("s.nii")).dataobj)
        _, ours = points_and_values(self.read("s.nii").GetOutput())
        np.testing.assert_allclose(ours, scaled.ravel(order="F"), rtol=1e-6)

    def test_units_and_times(self):
        voxels = values(np.uint8, dims + (3,))
        image = nibabel.Nifti1Image(voxels, affine(6))
        image.header.set_xyzt_units("mm", "msec")
        image.header["pixdim"][4] = 40
        nibabel.save(image, self.path("t.nii.gz"))
        reader = self.read("t.nii.gz")
        information = reader.GetOutputInformation(0)
        steps = information.Get(reader.GetExecutive().TIME_STEPS())
        np.testing.assert_allclose(steps, [0, 0.04, 0.08], atol=1e-9)
        for step in [2, 0, 1]:
            reader.UpdateTimeStep(steps[step])
            self.assert_same(reader.GetOutput(), voxels[..., step], affine(6), 1e-4)

    def test_a_time_may_be_rounded(self):
        voxels = values(np.uint8, dims + (4,))
        image = nibabel.Nifti1Image(voxels, affine(6))
        image.header.set_xyzt_units("mm", "sec")
        image.header["pixdim"][4] = 0.2  # a float, which is more
        nibabel.save(image, self.path("t.nii"))
        reader = self.read("t.nii")
        for time, step in ((0.4, 2), (0.2, 1), (0.399, 1), (0.6000001, 3), (0.0, 0)):
            reader.UpdateTimeStep(time)
            self.assert_same(reader.GetOutput(), voxels[..., step], affine(6), 1e-4)

    def test_nibabel_reads_what_we_write(self):
        for name in ["a.nii", "a.nii.gz"]:
            for dtype in [np.uint8, np.int16, np.float32, np.float64]:
                image = vtkImageData()
                image.SetDimensions(dims)
                image.SetOrigin(1, 2, 3)
                image.SetSpacing(0.3, 0.5, 0.7)
                image.SetDirectionMatrix(rotation(2).ravel())
                voxels = values(dtype)
                data = numpy_to_vtk(voxels.ravel(order="F"), deep=True)
                data.SetName("Intensity")
                image.GetPointData().SetScalars(data)
                writer = vtkUltrasoundWriter()
                writer.SetInputData(image)
                writer.SetFileName(self.path(name))
                self.assertEqual(writer.Write(), 1)
                theirs = nibabel.load(self.path(name))
                self.assertEqual(theirs.get_data_dtype(), dtype)
                self.assert_same(image, np.asarray(theirs.dataobj), theirs.affine, 1e-5)
                np.testing.assert_allclose(theirs.get_qform(), theirs.get_sform(), atol=1e-5)
                np.testing.assert_allclose(theirs.header.get_zooms(), [0.3, 0.5, 0.7], rtol=1e-6)
                self.assertEqual(theirs.header.get_xyzt_units()[0], "mm")

    def test_what_nibabel_changes_stays_changed(self):
        self.test_nibabel_reads_what_we_write()
        image = self.read("a.nii").GetOutput()
        pose = numpy_to_vtk(np.eye(4).ravel(), deep=True)
        pose.SetName("ProbeToWorld")
        image.GetFieldData().AddArray(pose)
        writer = vtkUltrasoundWriter()
        writer.SetInputData(image)
        writer.SetFileName(self.path("a.nii"))
        self.assertEqual(writer.Write(), 1)
        self.assertTrue(self.read("a.nii").GetOutput().GetFieldData().HasArray("ProbeToWorld"))
        theirs = nibabel.load(self.path("a.nii"))
        moved = theirs.affine.copy()
        moved[:3, 3] += [5, 0, 0]
        nibabel.save(nibabel.Nifti1Image(np.asarray(theirs.dataobj), moved, theirs.header), self.path("moved.nii"))
        reader = self.read("moved.nii")
        self.assertAlmostEqual(reader.GetOutput().GetOrigin()[0], -4, places=5)
        self.assertIn("another program", reader.GetNotes())
        self.assertFalse(reader.GetOutput().GetFieldData().HasArray("ProbeToWorld"))  # it did not move with the volume
        self.assertIn("ProbeToWorld", reader.GetNotes())


if __name__ == "__main__":
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    unittest.main()
