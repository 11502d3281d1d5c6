#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Image stacks through vtkUltrasoundReader, written with VTK's own writers."""
import os
import tempfile
import unittest

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkLogger
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOImage import vtkPNGWriter, vtkTIFFWriter

from echorama import vtkUltrasoundReader


class ImageStack(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.pixels = np.random.default_rng(1).integers(0, 256, (11, 6, 8)).astype(np.uint8)  # slices, rows, columns

    def tearDown(self):
        self.folder.cleanup()

    def write(self, kind, name, pixels):
        image = vtkImageData()
        image.SetDimensions(pixels.shape[1], pixels.shape[0], 1)
        # VTK's images begin at the lower left.
        image.GetPointData().SetScalars(numpy_to_vtk(pixels[::-1].ravel(), deep=True))
        writer = kind()
        writer.SetInputData(image)
        writer.SetFileName(os.path.join(self.folder.name, name))
        writer.Write()

    def reader(self, name=""):
        reader = vtkUltrasoundReader()
        self.errors = []

        def complain(_, __, text):
            self.errors.append(text)
        complain.CallDataType = "string0"
        reader.AddObserver("ErrorEvent", complain)
        reader.SetFileName(os.path.join(self.folder.name, name) if name else self.folder.name)
        return reader

    def test_folder_and_one_of_its_files(self):
        for kind, extension in [(vtkPNGWriter, "png"), (vtkTIFFWriter, "tif")]:
            for k, pixels in enumerate(self.pixels):
                self.write(kind, f"{extension}{k}.{extension}", pixels)  # png10 after png9
            reader = self.reader(f"{extension}3.{extension}")
            reader.SetStackSpacingMm(0.2, 0.3, 0.4)
            reader.Update()
            volume = reader.GetOutput()
            self.assertEqual(volume.GetDimensions(), (8, 6, 11))
            self.assertEqual(volume.GetSpacing(), (0.2, 0.3, 0.4))
            np.testing.assert_array_equal(vtk_to_numpy(volume.GetPointData().GetArray("Intensity")), self.pixels.ravel())
            self.assertIn("no pose", reader.GetNotes())
            self.assertTrue(vtkUltrasoundReader.CanReadFile(os.path.join(self.folder.name, f"{extension}3.{extension}")))
        self.assertTrue(vtkUltrasoundReader.CanReadFile(self.folder.name))

    def test_a_broken_image_is_named(self):
        for k in range(3):
            self.write(vtkPNGWriter, f"a{k}.png", self.pixels[k])
        with open(os.path.join(self.folder.name, "a1.png"), "r+b") as file:
            file.truncate(60)
        reader = self.reader()
        reader.Update()
        self.assertIn("a1.png", " ".join(self.errors))
        self.assertEqual(reader.GetOutput().GetNumberOfPoints(), 0)


if __name__ == "__main__":
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    unittest.main()
