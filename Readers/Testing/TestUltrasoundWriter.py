#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundWriter: what is written comes back, VTK's own readers agree, and a failure leaves what was there."""
import math
import os
import resource
import signal
import tempfile
import unittest

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkDoubleArray, vtkLogger, vtkStringArray, vtkTypeUInt64Array
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
from vtkmodules.vtkImagingCore import vtkRTAnalyticSource
from vtkmodules.vtkIOImage import vtkMetaImageReader, vtkNrrdReader
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase

from echorama import vtkUltrasoundReader, vtkUltrasoundWriter

extensions = ["mha", "mhd", "nrrd", "nhdr", "nii", "nii.gz", "vdb", "vti"]
products = ["nrrd", "nhdr", "vdb"]  # these store spacing and direction as one matrix
c, s = math.cos(0.3), math.sin(0.3)
oblique = [0, -1, 0, c, 0, s, -s, 0, c]  # a rotation, row by row


def array(image, name, values):
    data = numpy_to_vtk(np.ascontiguousarray(values).ravel(), deep=True)
    data.SetName(name)
    image.GetPointData().AddArray(data)
    return data


def field(image, name, values, kind=vtkDoubleArray):
    data = kind()
    data.SetName(name)
    if kind is vtkDoubleArray:
        data.SetNumberOfComponents(len(values))
        data.InsertNextTuple(values)
    else:
        for value in values:
            data.InsertNextValue(value)
    image.GetFieldData().AddArray(data)


def volume(dtype=np.uint8, dims=(5, 4, 3)):
    image = vtkImageData()
    image.SetDimensions(dims)
    image.SetSpacing(0.1, 1 / 3, 0.7)
    image.SetOrigin(1 / 3, -1e5 / 7, 1e-3)
    image.SetDirectionMatrix(oblique)
    random = np.random.default_rng(1)
    count = int(np.prod(dims))
    array(image, "Intensity", random.integers(0, 100, count).astype(dtype))
    image.GetPointData().SetActiveScalars("Intensity")
    return image


class Streamed(VTKPythonAlgorithmBase):
    """Makes the slices that it is asked for out of an image that it has, and remembers which."""

    def __init__(self, image, change=None):
        VTKPythonAlgorithmBase.__init__(self, nInputPorts=0, nOutputPorts=1, outputType="vtkImageData")
        self.image = image
        self.change = change  # of a slab, before it is handed out
        self.asked = []

    def RequestInformation(self, request, inputs, outputs):
        outputs.GetInformationObject(0).Set(vtkStreamingDemandDrivenPipeline.WHOLE_EXTENT(), self.image.GetExtent(), 6)
        return 1

    def RequestData(self, request, inputs, outputs):
        information = outputs.GetInformationObject(0)
        extent = information.Get(vtkStreamingDemandDrivenPipeline.UPDATE_EXTENT())
        self.asked.append(extent[4:])
        output = vtkImageData.GetData(information)
        output.ShallowCopy(self.image)
        output.Crop(extent)
        output.GetFieldData().ShallowCopy(self.image.GetFieldData())
        return 0 if self.change and self.change(output, len(self.asked)) is False else 1


class Writer(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.messages = []

    def tearDown(self):
        self.folder.cleanup()

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def files(self):
        return sorted(os.listdir(self.folder.name))

    def writer(self, name, image=None, compress=True):
        writer = vtkUltrasoundWriter()
        self.messages = []

        def note(_, __, text):
            self.messages.append(text)
        note.CallDataType = "string0"
        writer.AddObserver("ErrorEvent", note)
        writer.AddObserver("WarningEvent", note)
        writer.SetFileName(self.path(name))
        writer.SetUseCompression(compress)
        if image:
            writer.SetInputData(image)
        return writer

    def write(self, name, image, compress=True):
        writer = self.writer(name, image, compress)
        self.assertEqual(writer.Write(), 1, self.messages)
        return writer.GetNotes()

    def read(self, name):
        reader = vtkUltrasoundReader()
        reader.SetFileName(self.path(name))
        reader.Update()
        return reader.GetOutput(), reader.GetNotes()

    @staticmethod
    def values(image, name):
        return vtk_to_numpy(image.GetPointData().GetArray(name))

    def test_everything_comes_back(self):
        probe_to_world = [1 / 3, *np.random.default_rng(2).normal(size=15)]
        scene = 'two "lines"\nand a \\ at the end \\ '
        for extension in extensions:
            for compress in [True, False]:
                with self.subTest(extension=extension, compress=compress):
                    image = volume(np.float32)
                    mask = (np.arange(60) % 3 != 0).astype(np.uint8)
                    array(image, "ValidRegion", mask)
                    array(image, "Provenance", np.arange(60, dtype=np.int16))
                    array(image, "Coverage", np.arange(60, dtype=np.uint8))
                    array(image, "Spread", np.arange(60, dtype=np.float32))
                    field(image, "ProbeToWorld", probe_to_world)
                    field(image, "ProbeGeometry", [70.1, 0.1, 60, 12, 1 / 3, 120])
                    field(image, "TimeStamp", [1700000000.123456])
                    field(image, "Seed", [2**64 - 3], vtkTypeUInt64Array)
                    field(image, "Scene", [scene], vtkStringArray)
                    field(image, "Modality", ["MET_MOD_US"], vtkStringArray)
                    name = "a." + extension
                    said = self.write(name, image, compress)
                    if extension.startswith("nii"):  # said, without a warning
                        self.assertIn("32-bit floats", said)
                    else:
                        self.assertEqual(said, "")
                    self.assertEqual(self.messages, [])
                    back, notes = self.read(name)
                    self.assertEqual(notes, "")
                    self.assertEqual(back.GetDimensions(), (5, 4, 3))
                    self.assertEqual(back.GetOrigin(), image.GetOrigin())
                    direction = [back.GetDirectionMatrix().GetData()[i] for i in range(9)]
                    if extension in products:
                        np.testing.assert_allclose(back.GetSpacing(), image.GetSpacing(), rtol=1e-15)
                        np.testing.assert_allclose(direction, oblique, atol=1e-15)
                    else:
                        self.assertEqual(back.GetSpacing(), image.GetSpacing())
                        self.assertEqual(direction, oblique)
                    for array_name in ["Intensity", "ValidRegion", "Provenance", "Coverage", "Spread"]:
                        wanted, got = self.values(image, array_name), self.values(back, array_name)
                        self.assertEqual(wanted.dtype, got.dtype)
                        self.assertTrue((wanted == got).all())
                    fields = back.GetFieldData()
                    self.assertEqual([fields.GetArray("ProbeToWorld").GetComponent(0, i) for i in range(16)], probe_to_world)
                    self.assertEqual(fields.GetArray("ProbeGeometry").GetComponent(0, 0), 70.1)
                    self.assertEqual(fields.GetArray("TimeStamp").GetValue(0), 1700000000.123456)
                    self.assertEqual(fields.GetArray("Seed").GetValue(0), 2**64 - 3)
                    self.assertEqual(fields.GetAbstractArray("Scene").GetValue(0), scene)
                    self.assertEqual(fields.GetAbstractArray("Modality").GetValue(0), "MET_MOD_US")
                    self.assertEqual(fields.GetNumberOfArrays(), 6)

    def test_every_type_of_number(self):
        for extension in extensions:
            for dtype in [np.int8, np.uint8, np.int16, np.uint16, np.int32, np.uint32, np.int64, np.uint64, np.float32, np.float64]:
                with self.subTest(extension=extension, dtype=dtype):
                    image = volume(dtype)
                    self.write("a." + extension, image)
                    back, _ = self.read("a." + extension)
                    self.assertTrue((self.values(back, "Intensity") == self.values(image, "Intensity")).all())
                    self.assertEqual(self.values(back, "Intensity").dtype, dtype)

    def test_the_valid_region_comes_back_whatever_it_is(self):
        zeros = np.zeros(60, np.uint8)
        some = np.array([0, 1] * 30, np.uint8)
        ones = np.ones(60, np.uint8)
        for intensity in [zeros, some, ones]:
            for mask in [None, zeros, some, ones]:
                image = volume()
                array(image, "Intensity", intensity)
                if mask is not None:
                    array(image, "ValidRegion", mask)
                wanted = ones if mask is None else mask
                for name in ["a.mha", "a.vti"]:
                    self.write(name, image)
                    back, _ = self.read(name)
                    self.assertTrue((self.values(back, "ValidRegion") == wanted).all(), name)
                self.assertEqual(image.GetPointData().GetNumberOfArrays(), 1 if mask is None else 2)
        self.assertEqual(self.files(), ["a.mha", "a.vti"], "all ones over all ones needs no second file")

    def test_openvdb_holds_the_valid_region_itself(self):
        image = volume()
        mask = (np.arange(60) % 2).astype(np.uint8)
        array(image, "ValidRegion", mask)
        self.write("a.vdb", image)
        self.assertEqual(self.files(), ["a.vdb"])
        back, notes = self.read("a.vdb")
        self.assertEqual(notes, "")
        self.assertTrue((self.values(back, "ValidRegion") == mask).all())
        self.assertTrue((self.values(back, "Intensity") == self.values(image, "Intensity")).all())

    def test_files_of_an_earlier_volume_do_not_stay(self):
        image = volume()
        array(image, "ValidRegion", np.zeros(60, np.uint8))
        array(image, "Provenance", np.zeros(60, np.uint8))
        self.write("a.nrrd", image)
        self.assertEqual(self.files(), ["a.Provenance.nrrd", "a.ValidRegion.nrrd", "a.nrrd"])
        later = volume()
        array(later, "Intensity", np.ones(60, np.uint8))
        self.write("a.nrrd", later)
        self.assertEqual(self.files(), ["a.nrrd"])
        self.write("b.nii.gz", image)
        self.assertEqual(self.files(), ["a.nrrd", "b.Provenance.nii.gz", "b.ValidRegion.nii.gz", "b.nii.gz"])
        self.write("b.nii.gz", later)
        self.assertEqual(self.files(), ["a.nrrd", "b.nii.gz"])

    def test_vtk_reads_the_same_voxels(self):
        for extension, reader, compress in [("mha", vtkMetaImageReader(), True), ("mha", vtkMetaImageReader(), False),
                                            ("mhd", vtkMetaImageReader(), True), ("mhd", vtkMetaImageReader(), False),
                                            ("nrrd", vtkNrrdReader(), False), ("nhdr", vtkNrrdReader(), False)]:
            with self.subTest(extension=extension, compress=compress):
                image = volume(np.int16, (50, 40, 30))
                field(image, "ProbeToWorld", [1 / 3] * 16)
                self.write("b." + extension, image, compress)
                reader.SetFileName(self.path("b." + extension))
                reader.Update()
                theirs = reader.GetOutput()
                self.assertEqual(theirs.GetDimensions(), (50, 40, 30))
                np.testing.assert_allclose(theirs.GetSpacing(), image.GetSpacing(), rtol=1e-5)
                np.testing.assert_allclose(theirs.GetOrigin(), image.GetOrigin(), rtol=1e-5)
                self.assertTrue((vtk_to_numpy(theirs.GetPointData().GetScalars()) == self.values(image, "Intensity")).all())

    def test_extents_are_folded_into_the_origin(self):
        image = volume()
        image.SetExtent(10, 14, -3, 0, 7, 9)
        for extension in extensions:
            self.write("a." + extension, image)
            back, _ = self.read("a." + extension)
            self.assertEqual(back.GetExtent(), (0, 4, 0, 3, 0, 2))
            first, same = [0] * 3, [0] * 3
            image.TransformIndexToPhysicalPoint(10, -3, 7, first)
            back.TransformIndexToPhysicalPoint(0, 0, 0, same)
            np.testing.assert_allclose(same, first, rtol=1e-14)

    def test_2d_images(self):
        image = volume(np.uint8, (6, 5, 1))
        for extension in extensions:
            self.write("a." + extension, image)
            back, _ = self.read("a." + extension)
            self.assertEqual(back.GetDimensions(), (6, 5, 1))
            self.assertTrue((self.values(back, "Intensity") == self.values(image, "Intensity")).all())

    def test_what_cannot_be_held_is_said(self):
        image = volume()
        array(image, "Elasticity", np.zeros(60))
        field(image, "Numbers", [1.0, 2.0])
        field(image, "Story", ["two\nlines"], vtkStringArray)
        for extension in extensions[:-1]:
            notes = self.write("a." + extension, image)
            for name in ["Elasticity", "Numbers", "Story"]:
                self.assertIn(name, notes)
            self.assertIn("Elasticity", " ".join(self.messages))
        self.assertEqual(self.write("a.vti", image), "")
        back, _ = self.read("a.vti")
        self.assertIsNotNone(back.GetPointData().GetArray("Elasticity"))
        self.assertIsNotNone(back.GetFieldData().GetArray("Numbers"))

    def refused(self, writer, *words):
        before = self.files()
        self.assertEqual(writer.Write(), 0)
        message = " ".join(self.messages)
        for word in words:
            self.assertIn(word, message)
        self.assertEqual(self.files(), before)

    def test_what_is_refused(self):
        self.refused(self.writer("a.png", volume()), "a.png", ".mha")
        self.refused(self.writer("missing/a.mha", volume()), "missing", "folder")
        os.mkdir(self.path("folder.mha"))
        self.refused(self.writer("folder.mha", volume()), "folder.mha", "plain file")
        writer = self.writer("a.mha", volume())
        writer.SetFileName(None)
        self.refused(writer, "no file name")
        image = volume()
        image.SetSpacing(1, 0, 1)
        self.refused(self.writer("a.mha", image), "spacing")
        image = volume()
        image.SetDirectionMatrix(1, 0.5, 0, 0, 1, 0, 0, 0, 1)
        self.refused(self.writer("a.mha", image), "direction")
        image = vtkImageData()
        image.SetDimensions(2, 2, 2)
        self.refused(self.writer("a.mha", image), "no intensities")
        image.AllocateScalars(3, 3)
        self.refused(self.writer("a.mha", image), "several numbers")

    def test_a_failed_input_writes_nothing(self):
        self.write("a.mha", volume())
        reader = vtkUltrasoundReader()
        reader.SetFileName(self.path("missing.mha"))
        writer = self.writer("a.mha")
        writer.SetInputConnection(reader.GetOutputPort())
        self.assertEqual(writer.Write(), 0)
        back, _ = self.read("a.mha")
        self.assertEqual(back.GetNumberOfPoints(), 60)

    def test_a_vti_that_is_stopped_leaves_what_was_there(self):
        for when in [0.5, 1.0]:
            self.write("a.vti", volume())
            writer = self.writer("a.vti", volume(np.uint8, (50, 40, 30)))
            writer.AddObserver("ProgressEvent", lambda sender, _, when=when: sender.SetAbortExecute(sender.GetProgress() >= when))
            self.assertEqual(writer.Write(), 0)
            self.assertEqual(self.messages, [])
            self.assertEqual(self.files(), ["a.vti"])
            back, _ = self.read("a.vti")
            self.assertEqual(back.GetNumberOfPoints(), 60)

    def slabs(self, name, source, count, compress=True):
        writer = self.writer(name, None, compress)
        writer.SetInputConnection(source.GetOutputPort())
        writer.SetNumberOfSlabs(count)
        return writer

    def contents(self):
        contents = {}
        for name in self.files():
            with open(self.path(name), "rb") as file:
                contents[name] = file.read()
        return contents

    def clear(self):
        for name in self.files():
            os.remove(self.path(name))

    def test_slabs_make_the_same_files(self):
        values = np.arange(17 * 16 * 23) % 251
        holes = np.where(values % 7 == 0, 0, 1).astype(np.uint8)
        one_hole = np.ones_like(holes)
        one_hole[-1] = 0
        inside = np.ones((23, 16, 17), np.int16)
        inside[10, 5, 5] = 0
        corner = np.ones_like(inside)
        corner[-1, -1, -1] = 0
        for intensity, mask in [(values, holes), (values, None), (inside, None), (corner, None),
                                (inside, np.ones_like(holes)), (inside, one_hole)]:
            image = volume(np.int16, (17, 16, 23))
            array(image, "Intensity", intensity.astype(np.int16))
            if mask is not None:
                array(image, "ValidRegion", mask)
                array(image, "Provenance", values.astype(np.uint8))
                array(image, "Spread", values.astype(np.float32))
            field(image, "ProbeToWorld", [1 / 3] * 16)
            field(image, "Numbers", [1.0, 2.0])
            image.SetExtent(3, 19, -2, 13, 5, 27)
            for extension in extensions[:6]:
                for compress in [True, False]:
                    with self.subTest(extension=extension, compress=compress):
                        self.clear()
                        notes = self.write("a." + extension, image, compress)
                        wanted = self.contents()
                        for count in [2, 5, 23, 1000]:
                            self.clear()
                            source = Streamed(image)
                            writer = self.slabs("a." + extension, source, count, compress)
                            self.assertEqual(writer.Write(), 1, self.messages)
                            self.assertEqual(writer.GetNotes(), notes)
                            self.assertEqual(self.contents(), wanted)
                            self.assertEqual(len(source.asked), min(count, 23))
                            self.assertEqual(sum(([*range(a, b + 1)] for a, b in source.asked), []), [*range(5, 28)])
        self.assertEqual(self.slabs("a.mha", Streamed(volume()), 1).GetNumberOfSlabs(), 1)

    def test_inputs_that_do_not_stream_are_written_by_slabs_too(self):
        image = volume()
        self.write("a.nii", image)
        wanted = self.contents()
        writer = self.writer("a.nii", image)
        writer.SetNumberOfSlabs(3)
        self.assertEqual(writer.Write(), 1, self.messages)
        self.assertEqual(self.contents(), wanted)

    def test_slabs_of_vtk_sources(self):
        source = vtkRTAnalyticSource()
        source.SetWholeExtent(-20, 20, -15, 17, -10, 12)
        for extension in ["mha", "nrrd", "nii.gz"]:
            self.clear()
            self.assertEqual(self.slabs("a." + extension, source, 1).Write(), 1, self.messages)
            wanted = self.contents()
            self.assertEqual(self.slabs("a." + extension, source, 4).Write(), 1, self.messages)
            self.assertEqual(self.contents(), wanted)
        source.Update()  # gives the whole again
        self.assertEqual(source.GetOutput().GetDimensions(), (41, 33, 23))

    def test_slabs_need_the_memory_of_a_slab(self):
        source = vtkRTAnalyticSource()
        source.SetWholeExtent(0, 199, 0, 199, 0, 199)
        writer = self.slabs("a.mha", source, 50, False)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        self.assertEqual(writer.Write(), 1, self.messages)
        grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024
        self.assertLess(grown, 8e6, "the whole is 32 MB")
        self.assertGreater(os.path.getsize(self.path("a.mha")), 32e6)

    def test_what_slabs_refuse(self):
        def turned(image, slab):
            if slab == 3:
                image.SetDirectionMatrix(1, 0, 0, 0, 1, 0, 0, 0, 1)

        def other_type(image, slab):
            if slab == 3:
                array(image, "Intensity", np.zeros(image.GetNumberOfPoints(), np.float32))

        def without_region(image, slab):
            if slab == 3:
                image.GetPointData().RemoveArray("ValidRegion")

        def too_few(image, slab):
            if slab == 2:
                image.Crop([0, 4, 0, 3, 3, 4])

        image = volume(np.uint8, (5, 4, 9))
        array(image, "ValidRegion", np.ones(180, np.uint8))
        for name in ["a.vti", "a.vdb"]:
            self.refused(self.slabs(name, Streamed(image), 3), name, "written whole", ".mha")
        self.refused(self.slabs("a.seq.mha", Streamed(image), 3), "frame by frame")
        self.refused(self.slabs("a.png", Streamed(image), 3), "extension")
        self.refused(self.slabs("missing/a.mha", Streamed(image), 3), "folder")
        self.write("a.mha", volume())
        for change, slab in [(turned, "6 to 8"), (other_type, "6 to 8"), (without_region, "6 to 8"), (too_few, "3 to 5"),
                             (lambda image, slab: slab < 3, "6 to 8")]:
            self.refused(self.slabs("a.mha", Streamed(image, change), 3), "a.mha", "slices " + slab)
        back, _ = self.read("a.mha")
        self.assertEqual(back.GetNumberOfPoints(), 60)
        writer = self.slabs("a.mha", Streamed(image), 3)
        writer.AddObserver("ProgressEvent", lambda sender, _: sender.SetAbortExecute(1))
        self.assertEqual(writer.Write(), 0)
        source = vtkRTAnalyticSource()  # tells how far it is, and is stopped in the middle of a slab
        writer = self.slabs("a.mha", source, 2)
        told = []

        def stop(sender, _):
            told.append((sender.GetProgress(), source.GetAbortExecute()))
            sender.SetAbortExecute(sender.GetProgress() > 0.1)
        writer.AddObserver("ProgressEvent", stop)
        self.assertEqual(writer.Write(), 0)
        self.assertGreater(len(told), 2)
        self.assertLess(told[-1][0], 0.5)
        self.assertEqual(source.GetAbortExecute(), 1)
        self.assertEqual(self.messages, [])
        back, _ = self.read("a.mha")
        self.assertEqual(back.GetNumberOfPoints(), 60)

    def test_a_full_disk_leaves_what_was_there(self):
        old = volume(np.uint8, (60, 60, 60))
        new = volume(np.uint8, (60, 60, 60))
        noise = np.random.default_rng(3).integers(0, 256, 216000).astype(np.uint8)
        array(new, "Intensity", noise)
        array(new, "ValidRegion", noise % 2)
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        for extension in extensions:
            for compress in [True, False]:
                with self.subTest(extension=extension, compress=compress):
                    name = "a." + extension
                    self.write(name, old)
                    writer = self.writer(name, new, compress)
                    resource.setrlimit(resource.RLIMIT_FSIZE, (150000, limits[1]))
                    try:
                        self.refused(writer, self.path("a."), "written")
                    finally:
                        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
                    back, _ = self.read(name)
                    self.assertTrue((self.values(back, "Intensity") == self.values(old, "Intensity")).all())


if __name__ == "__main__":
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)  # errors and warnings are expected here
    unittest.main()
