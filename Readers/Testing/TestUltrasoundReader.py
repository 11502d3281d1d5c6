#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundReader: bad files, valid regions from every source, and the real volumes beside the project."""
import os
import pathlib
import tempfile
import unittest
import zlib

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkLogger
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

from echorama import vtkUltrasoundReader

real_data = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"]).parent / "shared" / "data"


def meta(data, dims="2 2 2", element="MET_UCHAR", more="", spacing="1 1 1", matrix="1 0 0 0 1 0 0 0 1", last="LOCAL"):
    return (f"ObjectType = Image\nNDims = 3\nTransformMatrix = {matrix}\nOffset = 0 0 0\nElementSpacing = {spacing}\n"
            f"DimSize = {dims}\nElementType = {element}\n{more}ElementDataFile = {last}\n").encode() + data


def vti(extent="0 1 0 1 0 1", spacing="1 1 1", direction="1 0 0 0 1 0 0 0 1", components=1, name="Echoes", values="1 2 3 4 5 6 7 8"):
    return (f'<?xml version="1.0"?>\n<VTKFile type="ImageData" version="0.1" byte_order="LittleEndian">\n<ImageData WholeExtent="{extent}" '
            f'Origin="0 0 0" Spacing="{spacing}" Direction="{direction}">\n<Piece Extent="{extent}">\n<PointData Scalars="{name}">\n'
            f'<DataArray type="UInt8" Name="{name}" NumberOfComponents="{components}" format="ascii">{values}</DataArray>\n'
            f'</PointData>\n</Piece>\n</ImageData>\n</VTKFile>\n').encode()


class Reader(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.errors = []

    def tearDown(self):
        self.folder.cleanup()

    def put(self, name, content):
        path = os.path.join(self.folder.name, name)
        with open(path, "wb") as file:
            file.write(content)
        return path

    def reader(self, path):
        reader = vtkUltrasoundReader()
        self.errors = []

        def complain(_, __, text):
            self.errors.append(text)
        complain.CallDataType = "string0"
        reader.AddObserver("ErrorEvent", complain)
        reader.SetFileName(path)
        return reader

    def read(self, path):
        reader = self.reader(path)
        reader.Update()
        self.assertEqual(self.errors, [])
        return reader.GetOutput(), reader.GetNotes()

    def refused(self, name, content, *words):
        path = self.put(name, content) if content is not None else os.path.join(self.folder.name, name)
        reader = self.reader(path)
        reader.Update()
        message = " ".join(self.errors)
        self.assertIn(os.path.splitext(path)[0], message)
        for word in words:
            self.assertIn(word, message)
        self.assertEqual(reader.GetOutput().GetNumberOfPoints(), 0)
        self.assertEqual(reader.GetOutput().GetPointData().GetNumberOfArrays(), 0)

    @staticmethod
    def valid(image):
        return vtk_to_numpy(image.GetPointData().GetArray("ValidRegion"))

    def test_header_alone_is_read_first(self):
        # The data are damaged, which only reading them can tell.
        path = self.put("a.mha", meta(b"\x78\x5e" + b"x" * 60, "4 5 6", more="CompressedData = True\n", matrix="0 1 0 -1 0 0 0 0 1",
                                      spacing="0.1 0.2 0.30000000000000004"))
        reader = self.reader(path)
        reader.UpdateInformation()
        self.assertEqual(self.errors, [])
        information = reader.GetOutputInformation(0)
        key = vtkStreamingDemandDrivenPipeline.WHOLE_EXTENT()
        self.assertEqual([information.Get(key, i) for i in range(6)], [0, 3, 0, 4, 0, 5])
        self.assertEqual(information.Get(reader.GetOutputDataObject(0).SPACING(), 2), 0.30000000000000004)
        direction = [information.Get(reader.GetOutputDataObject(0).DIRECTION(), i) for i in range(9)]
        self.assertEqual(direction, [0, -1, 0, 1, 0, 0, 0, 0, 1])
        reader.Update()
        self.assertIn("damaged", " ".join(self.errors))

    def test_arrays_geometry_and_fields(self):
        image, notes = self.read(self.put("a.mha", meta(bytes(range(1, 9)), matrix="0 1 0 -1 0 0 0 0 1",
                                                        more="Modality = MET_MOD_US\nEchorama_TimeStamp = 0.1\nEchorama_Seed = x\n")))
        self.assertEqual(image.GetPointData().GetScalars().GetName(), "Intensity")
        self.assertEqual(list(vtk_to_numpy(image.GetPointData().GetScalars())), list(range(1, 9)))
        self.assertTrue(self.valid(image).all())
        point = [0, 0, 0]
        image.TransformIndexToPhysicalPoint(1, 0, 0, point)
        self.assertEqual(point, [0, 1, 0])
        fields = image.GetFieldData()
        self.assertEqual(fields.GetAbstractArray("Modality").GetValue(0), "MET_MOD_US")
        self.assertEqual(fields.GetArray("TimeStamp").GetValue(0), 0.1)
        self.assertIsNone(fields.GetAbstractArray("Seed"))
        self.assertIn("Echorama_Seed", notes)

    def test_valid_region_is_guessed(self):
        grid = np.full((4, 5, 6), 7, np.uint8)
        grid[:, :, :2] = 0   # touches the border
        grid[2, 2, 4] = 0    # fluid
        image, notes = self.read(self.put("a.mha", meta(grid.tobytes(), "6 5 4")))
        wanted = np.ones_like(grid)
        wanted[:, :, :2] = 0
        self.assertTrue((self.valid(image).reshape(grid.shape) == wanted).all())
        self.assertIn("guessed", notes)
        floats = grid.astype("<f4")
        floats[1, 1, 4] = np.nan
        wanted[1, 1, 4] = 0
        image, _ = self.read(self.put("b.mha", meta(floats.tobytes(), "6 5 4", "MET_FLOAT")))
        self.assertTrue((self.valid(image).reshape(grid.shape) == wanted).all())

    def test_valid_region_and_provenance_from_files_beside(self):
        path = self.put("a.mha", meta(bytes([0] * 4 + [9] * 4)))
        self.put("a.ValidRegion.mha", meta(bytes([255, 1, 1, 1, 1, 0, 1, 1])))
        self.put("a.Provenance.mha", meta(np.arange(8, dtype="<i2").tobytes(), element="MET_SHORT"))
        image, notes = self.read(path)
        self.assertEqual(list(self.valid(image)), [1, 1, 1, 1, 1, 0, 1, 1])
        self.assertEqual(list(vtk_to_numpy(image.GetPointData().GetArray("Provenance"))), list(range(8)))
        self.assertEqual(notes, "")
        self.put("a.ValidRegion.mha", meta(bytes(8), spacing="1 1 1.1"))
        self.refused("a.mha", meta(bytes(8)), "a.ValidRegion.mha", "geometry")
        self.put("a.ValidRegion.mha", meta(bytes(12), "2 2 3"))
        self.refused("a.mha", meta(bytes(8)), "a.ValidRegion.mha", "geometry")
        self.put("a.ValidRegion.mha", meta(bytes(7)))
        self.refused("a.mha", meta(bytes(8)), "a.ValidRegion.mha", "7")

    def test_a_piece_is_the_whole_cropped(self):
        reader = self.reader(self.put("a.mha", meta(bytes(range(1, 61)), "3 4 5", spacing="1 2 3")))
        reader.UpdateInformation()
        reader.UpdateExtent([0, 2, 0, 3, 2, 3])
        piece = reader.GetOutput()
        self.assertEqual(piece.GetExtent(), (0, 2, 0, 3, 2, 3))
        self.assertEqual(list(vtk_to_numpy(piece.GetPointData().GetScalars())), list(range(25, 49)))

    def slices(self, reader, extent):
        reader.UpdateExtent(extent)
        self.assertEqual(self.errors, [])
        points = reader.GetOutput().GetPointData()
        return {points.GetArrayName(i): vtk_to_numpy(points.GetArray(i)).copy() for i in range(points.GetNumberOfArrays())}

    def test_slices_are_those_of_the_whole(self):
        """Whether they can be read one by one (with a file of the valid region) or are cut out of the whole."""
        random = np.random.default_rng(2)
        dims = (6, 5, 12)
        voxels = random.integers(0, 3, np.prod(dims)).astype(np.uint8)
        for packed in (False, True):
            more = "CompressedData = True\n" if packed else ""
            content = meta(zlib.compress(voxels.tobytes()) if packed else voxels.tobytes(), "6 5 12", more=more)
            for beside in ([], ["ValidRegion"], ["ValidRegion", "Coverage"], ["Coverage"]):
                name = f"a{packed:d}{len(beside)}{''.join(beside)}"
                path = self.put(name + ".mha", content)
                for array in beside:
                    self.put(f"{name}.{array}.mha", meta(random.integers(0, 4, voxels.size).astype(np.uint8).tobytes(), "6 5 12"))
                whole, notes = self.read(path)
                arrays = whole.GetPointData()
                reader = self.reader(path)
                for first, last in ((0, 3), (4, 4), (5, 11), (2, 3), (0, 11), (7, 11)):
                    for columns in ((0, 5), (2, 3)):
                        found = self.slices(reader, (*columns, 0, 4, first, last))
                        there = reader.GetOutput().GetExtent()  # a pipeline leaves what holds all that is asked for
                        self.assertTrue(there[0] <= columns[0] and there[1] >= columns[1] and there[4] <= first and there[5] >= last)
                        self.assertEqual(reader.GetOutput().GetOrigin(), whole.GetOrigin())
                        self.assertEqual(set(found), {"Intensity", "ValidRegion", *beside})
                        for array, values in found.items():
                            expected = vtk_to_numpy(arrays.GetArray(array)).reshape(dims[::-1])
                            part = expected[there[4]:there[5] + 1, :, there[0]:there[1] + 1].ravel()
                            np.testing.assert_array_equal(values, part, (name, array, first, last))

    def test_slices_of_more_than_the_memory(self):
        """A sparse file of 8 TB, of which a few slices hold something."""
        for name, value in (("large", 0), ("large.ValidRegion", 1)):
            path = self.put(name + ".mha", meta(b"", "2000 2000 2000000"))
            start = os.path.getsize(path)
            try:
                os.truncate(path, start + 8 * 10 ** 12)
            except OSError:
                self.skipTest("this file system holds no sparse files of 8 TB")
            with open(path, "r+b") as file:
                file.seek(start + 1234567 * 2000 ** 2 + 777)
                file.write(bytes([5 - 4 * value, 7 - 6 * value]))
        reader = self.reader(os.path.join(self.folder.name, "large.mha"))
        found = self.slices(reader, (0, 1999, 0, 1999, 1234567, 1234567))
        np.testing.assert_array_equal(np.flatnonzero(found["Intensity"]), [777, 778])
        np.testing.assert_array_equal(found["Intensity"][777:779], [5, 7])
        np.testing.assert_array_equal(np.flatnonzero(found["ValidRegion"]), [777, 778])
        whole = self.reader(reader.GetFileName())
        whole.Update()
        self.assertIn("memory", " ".join(self.errors))
        self.assertEqual(whole.GetOutput().GetNumberOfPoints(), 0)

    def test_stride_reads_one_of_so_many_voxels_along_each_axis(self):
        random = np.random.default_rng(3)
        voxels = random.integers(1, 256, (12, 5, 6)).astype(np.uint8)
        valid = random.integers(0, 2, voxels.shape).astype(np.uint8)
        path = self.put("a.mha", meta(voxels.tobytes(), "6 5 12", spacing="0.5 1 2"))
        self.put("a.ValidRegion.mha", meta(valid.tobytes(), "6 5 12", spacing="0.5 1 2"))
        reader = self.reader(path)
        reader.SetStride(4)
        reader.Update()
        self.assertEqual(self.errors, [])
        coarse = reader.GetOutput()
        self.assertEqual(coarse.GetDimensions(), (2, 2, 3))
        self.assertEqual(coarse.GetSpacing(), (2, 4, 8))
        self.assertIn("one of 4 voxels along each axis was read", reader.GetNotes())
        for name, whole in (("Intensity", voxels), ("ValidRegion", valid)):
            found = vtk_to_numpy(coarse.GetPointData().GetArray(name)).reshape(3, 2, 2)
            np.testing.assert_array_equal(found, whole[::4, ::4, ::4])
        reader.SetFileName(self.put("a.vti", vti("1 2 0 1 0 1", "2 1 1", "0 -1 0 1 0 0 0 0 1")))
        reader.Update()
        self.assertIn("Stride", " ".join(self.errors))

    def test_a_file_that_changes_between_slices_is_opened_anew(self):
        for name in ("a.mha", "a.ValidRegion.mha"):
            path = self.put(name, meta(zlib.compress(bytes(range(1, 9))), "2 1 4", more="CompressedData = True\n"))
        reader = self.reader(os.path.join(self.folder.name, "a.mha"))
        np.testing.assert_array_equal(self.slices(reader, (0, 1, 0, 0, 0, 0))["Intensity"], [1, 2])
        path = self.put("a.mha", meta(zlib.compress(bytes(range(11, 19))), "2 1 4", more="CompressedData = True\n"))
        os.utime(path, (1e9, 1e9))
        np.testing.assert_array_equal(self.slices(reader, (0, 1, 0, 0, 1, 1))["Intensity"], [13, 14])

    def test_vtk_image_files(self):
        image, notes = self.read(self.put("a.vti", vti("1 2 0 1 0 1", "2 1 1", "0 -1 0 1 0 0 0 0 1")))
        self.assertEqual(image.GetPointData().GetScalars().GetName(), "Intensity")
        self.assertIsNone(image.GetPointData().GetArray("Echoes"))
        self.assertIn("Echoes", notes)
        self.assertEqual(image.GetExtent(), (0, 1, 0, 1, 0, 1))
        self.assertEqual(image.GetOrigin(), (0, 2, 0))  # the first voxel had index 1
        self.assertTrue(self.valid(image).all())
        misnamed, _ = self.read(self.put("a.mha", vti()))
        self.assertEqual(misnamed.GetNumberOfPoints(), 8)

    def test_old_vtk_image_files_have_no_direction(self):
        old = vti().replace(b'Direction="1 0 0 0 1 0 0 0 1"', b"")
        image, notes = self.read(self.put("a.vti", old))
        self.assertEqual(image.GetNumberOfPoints(), 8)
        self.assertIn("no direction", notes)

    def test_vtk_image_files_that_are_refused(self):
        good = vti()
        self.refused("a.vti", good[:150], "VTK file")
        self.refused("a.vti", good[:-80], "VTK file")
        self.refused("a.vti", vti(values="1 2 3"), "truncated or damaged")
        self.refused("a.vti", vti(extent="0 100000 0 100000 0 100000"), "more memory than the file justifies")
        self.refused("a.vti", vti(extent="0 2147483647 0 2147483647 0 2147483647"), "overflows")
        self.refused("a.vti", vti(extent="0 -1 0 1 0 1"), "WholeExtent")
        self.refused("a.vti", vti(spacing="1 0 1"), "spacing")
        self.refused("a.vti", vti(spacing="1 -1 1"), "spacing")
        self.refused("a.vti", vti(spacing="1 nan 1"), "nan")
        self.refused("a.vti", vti(direction="1 0 0"), "9 are needed")
        self.refused("a.vti", vti(direction="1 0 0 1 0 0 0 0 1"), "direction")
        self.refused("a.vti", vti(direction="1 0.3 0 0 1 0 0 0 1"), "direction")
        self.refused("a.vti", vti(components=3, values=" ".join(["1"] * 24)), "3 numbers per voxel")
        self.refused("a.vti", vti(name="ValidRegion"), "intensities")

    def test_files_that_are_refused(self):
        # The kinds of lies are tested one by one on the kernels; here, that each becomes an error of the filter.
        self.refused("missing.mha", None, "no such file")
        self.refused("", None, "folder")
        self.refused("a.mha", b"", "empty")
        self.refused("a.mha", b"Dear reader, this is a letter.\n", "none of MetaImage, NRRD")
        self.refused("a.mha", meta(bytes(7)), "truncated")
        self.refused("a.mha", meta(bytes(8), "100000 100000 100000"), "truncated or the dimensions are wrong")
        self.refused("a.mha", meta(bytes(8), "2147483647 2147483647 2147483647"), "overflows")
        self.refused("a.mha", meta(bytes(8), spacing="1 0 1"), "spacing")
        self.refused("a.mha", meta(bytes(8), spacing="1 nan 1"), "nan")
        self.refused("a.mha", meta(bytes(8), matrix="1 0 0 1 0 0 0 0 1"), "direction")
        packed = zlib.compress(os.urandom(8000))
        self.refused("a.mha", meta(packed[:4000], "20 20 20", more="CompressedData = True\n"), "end early")
        self.refused("a.mhd", meta(b"", last="a.raw"), "a.raw", "no such file")
        self.refused("a.mha", b"Seq_Frame0000_Timestamp = 1\n" + meta(b"", "0 0 2", "MET_OTHER"), "tracked sequence")
        reader = self.reader(None)
        reader.Update()
        self.assertIn("no file name", " ".join(self.errors))

    def test_a_reader_recovers(self):
        reader = self.reader(self.put("a.mha", b""))
        reader.Update()
        self.assertEqual(len(self.errors), 1)
        reader.SetFileName(self.put("b.mha", meta(bytes(8))))
        reader.Update()
        self.assertEqual(reader.GetOutput().GetNumberOfPoints(), 8)

    def test_can_read_file(self):
        self.assertTrue(vtkUltrasoundReader.CanReadFile(self.put("a.dat", meta(bytes(8)))))
        self.assertTrue(vtkUltrasoundReader.CanReadFile(self.put("b.dat", vti())))
        self.assertFalse(vtkUltrasoundReader.CanReadFile(self.put("c.mha", b"no")))
        self.assertFalse(vtkUltrasoundReader.CanReadFile(os.path.join(self.folder.name, "missing.mha")))

    @unittest.skipUnless(real_data.exists(), f"no real data at {real_data}")
    def test_real_volumes(self):
        # The fractions were found with scipy.ndimage.label.
        for name, dimensions, spacing, origin, fraction in [
                ("liver/liver_volume_A.mha", (305, 254, 155), 0.80000001192092896, (-148, -102, 52), 0.2662938),
                ("liver/liver_volume_B.mha", (316, 250, 155), 0.80000001192092896, (-161, -100, 17), 0.2237989),
                ("liver/liver_volume_full.mha", (321, 254, 199), 0.80000001192092896, (-161, -102, 17), 0.2841214),
                ("plus/SpinePhantomFreehandReconstructed.mha", (147, 106, 104), 0.5, (-74.5217, 165.573, 29.072), 0.2915463),
                ("plus/NwirePhantomFreehandReconstructed.mha", (101, 104, 74), 0.5, (-22.2573, -137.793, -58.5829), 0.0141298)]:
            with self.subTest(name):
                image, notes = self.read(str(real_data / name))
                self.assertEqual(image.GetDimensions(), dimensions)
                self.assertEqual(image.GetSpacing(), (spacing,) * 3)
                self.assertEqual(image.GetOrigin(), origin)
                self.assertAlmostEqual(self.valid(image).mean(), fraction, delta=1e-7)
                self.assertIn("guessed", notes)
        self.refused(str(real_data / "plus" / "SpinePhantomFreehand.igs.mha"), None, "tracked sequence")


if __name__ == "__main__":
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)  # errors are expected here
    unittest.main()
