#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundSequenceReader and vtkUltrasoundSequenceWriter: frames over time, tracks, round trips, bad input, real recordings."""
import os
import pathlib
import tempfile
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkDoubleArray, vtkLogger
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

from echorama import vtkUltrasoundReader, vtkUltrasoundSequenceReader, vtkUltrasoundSequenceWriter, vtkUltrasoundWriter

real_data = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"]).parent / "shared" / "data"
SIZE = (6, 4)


def matrix(x=0.0, scale=1.0):
    m = np.diag([scale, scale, 1.0, 1.0])
    m[:3, 3] = x, 2 * x, -x
    return m


def text(m):
    return " ".join(repr(float(v)) for v in np.ravel(m))


def sequence(frames, more="", size=SIZE, element="MET_UCHAR"):
    """A sequence: a list of dicts of the fields of each frame; pixels count up from 10 times the frame."""
    header = (f"ObjectType = Image\nNDims = 3\nDimSize = {size[0]} {size[1]} {len(frames)}\nKinds = domain domain list\n"
              f"ElementType = {element}\nElementSpacing = 1 1 1\nUltrasoundImageOrientation = MF\n{more}")
    for number, fields in enumerate(frames):
        header += "".join(f"Seq_Frame{number:04}_{key} = {value}\n" for key, value in fields.items())
    pixels = b"".join(bytes(range(10 * number, 10 * number + size[0] * size[1])) for number in range(len(frames)))
    return (header + "ElementDataFile = LOCAL\n").encode() + pixels


def tracked(count=5):
    """Probe and reference seen by a tracker; the probe is lost in frame 2."""
    return [{"ProbeToTrackerTransform": text(matrix(10.0 * i)), "ProbeToTrackerTransformStatus": "OUT_OF_VIEW" if i == 2 else "OK",
             "ReferenceToTrackerTransform": text(matrix(1.0)), "ReferenceToTrackerTransformStatus": "OK",
             "Timestamp": 100.0 + i / 3, "ImageStatus": "INVALID" if i == 4 else "OK", "FrameNumber": 7000 + i} for i in range(count)]


def points(image, name):
    return vtk_to_numpy(image.GetPointData().GetArray(name))


def field(data, name):
    array = data.GetFieldData().GetAbstractArray(name)
    if array is None:
        return None
    if array.IsA("vtkStringArray"):
        return array.GetValue(0)
    values = vtk_to_numpy(array).ravel()
    return values.reshape(4, 4) if len(values) == 16 else values[0]


def index_to_world(image):
    m = np.eye(4)
    direction = image.GetDirectionMatrix()
    for i in range(3):
        for j in range(3):
            m[i, j] = direction.GetElement(i, j) * image.GetSpacing()[j]
    m[:3, 3] = image.GetOrigin()
    return m


def steps(algorithm):
    information = algorithm.GetOutputInformation(0)
    return list(information.Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS()) or ())


class Sequences(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.errors = []

    def tearDown(self):
        self.folder.cleanup()

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def put(self, name, content):
        with open(self.path(name), "wb") as file:
            file.write(content if isinstance(content, bytes) else content.encode())
        return self.path(name)

    def watched(self, algorithm):
        self.errors = []

        def complain(_, __, text):
            self.errors.append(text)
        complain.CallDataType = "string0"
        algorithm.AddObserver("ErrorEvent", complain)
        return algorithm

    def open(self, path, transforms=None):
        reader = self.watched(vtkUltrasoundSequenceReader())
        reader.SetFileName(path)
        if transforms:
            reader.SetTransformFile(transforms)
        reader.UpdateInformation()
        self.assertEqual(self.errors, [])
        return reader

    def frame(self, reader, time):
        reader.UpdateTimeStep(time)
        self.assertEqual(self.errors, [])
        return reader.GetOutputDataObject(0)

    def track(self, reader):
        reader.Update(1)
        self.assertEqual(self.errors, [])
        return reader.GetOutputDataObject(1)

    def calibration(self):
        return self.put("device.xml", '<PlusConfiguration version="2.0"><CoordinateDefinitions>'
                        f'<Transform From="Image" To="Probe" Matrix="{text(matrix(5.0, 0.25))}"/>'
                        "</CoordinateDefinitions></PlusConfiguration>")

    def test_frames_over_time(self):
        reader = self.open(self.put("a.igs.mha", sequence(tracked(), "Operator = nobody\n")), self.calibration())
        self.assertEqual(reader.GetNumberOfFrames(), 5)
        self.assertEqual(reader.GetWorldFrameInUse(), "Reference")
        self.assertEqual(reader.GetCoordinateFrames(), "Image, Probe, Reference, Tracker")
        self.assertEqual(steps(reader), [100.0 + i / 3 for i in range(5)])
        for i in (3, 0, 2, 4, 1):
            image = self.frame(reader, 100.0 + i / 3 + (0.1 if i < 4 else 10.0)) # the nearest
            self.assertEqual(image.GetInformation().Get(image.DATA_TIME_STEP()), 100.0 + i / 3)
            self.assertEqual(image.GetDimensions(), (6, 4, 1))
            np.testing.assert_array_equal(points(image, "Intensity"), np.arange(10 * i, 10 * i + 24))
            self.assertEqual(image.GetPointData().GetScalars().GetName(), "Intensity")
            np.testing.assert_array_equal(points(image, "ValidRegion"), 0 if i == 4 else 1)
            self.assertEqual(field(image, "TimeStamp"), 100.0 + i / 3)
            self.assertEqual(field(image, "FrameIndex"), i)
            self.assertEqual(field(image, "Frame_FrameNumber"), str(7000 + i))
            self.assertEqual(field(image, "Operator"), "nobody")
            self.assertEqual(field(image, "WorldFrame"), "Reference")
            np.testing.assert_array_equal(field(image, "ProbeToTrackerTransform"), matrix(10.0 * i))
            self.assertEqual(field(image, "ProbeToTrackerTransformStatus"), "OUT_OF_VIEW" if i == 2 else "OK")
            if i == 2: # lost: no pose, and nothing is invented
                self.assertIsNone(field(image, "ImageToWorld"))
                self.assertEqual(image.GetOrigin(), (0.0, 0.0, 0.0))
            else:
                expected = np.linalg.inv(matrix(1.0)) @ matrix(10.0 * i) @ matrix(5.0, 0.25)
                np.testing.assert_allclose(field(image, "ImageToWorld"), expected, atol=1e-12)
                np.testing.assert_allclose(index_to_world(image)[:, [0, 1, 3]], expected[:, [0, 1, 3]], atol=1e-12)
        notes = reader.GetNotes()
        self.assertIn("ProbeToTrackerTransform is valid in 4 of 5 frames", notes)
        self.assertIn("the image is marked as not valid in frame 4", notes)

        # Another world, and no calibration.
        reader.SetWorldFrame("Tracker")
        np.testing.assert_allclose(field(self.frame(reader, 100.0), "ImageToWorld"), matrix(5.0, 0.25))
        reader.SetTransformFile(None)
        reader.SetWorldFrame(None)
        self.assertIsNone(field(self.frame(reader, 100.0), "ImageToWorld"))
        self.assertIn("no transforms lead from Image to Reference", reader.GetNotes())

    def test_track(self):
        reader = self.open(self.put("a.igs.mha", sequence(tracked())), self.calibration())
        track = self.track(reader)
        self.assertEqual(track.GetNumberOfPoints(), 4)
        np.testing.assert_array_equal(points(track, "FrameIndex"), [0, 1, 3, 4])
        np.testing.assert_allclose(points(track, "TimeStamp"), [100, 100 + 1 / 3, 101, 100 + 4 / 3])
        self.assertEqual([track.GetCell(i).GetNumberOfPoints() for i in range(track.GetNumberOfCells())], [2, 2])
        np.testing.assert_allclose(track.GetPoint(2), (34, 68, -34))
        np.testing.assert_allclose(points(track, "ToolToWorld")[2].reshape(4, 4), matrix(34.0, 0.25))
        np.testing.assert_array_equal(points(track, "ProbeToTrackerTransform")[1].reshape(4, 4), matrix(10.0))
        np.testing.assert_array_equal(points(track, "ProbeToTrackerTransformStatus"), 0)
        self.assertEqual(track.GetFieldData().GetAbstractArray("ToolNames").GetValue(0), "Image")
        reader.SetToolFrame("Tracker") # seen from the reference
        track = self.track(reader)
        self.assertEqual(track.GetNumberOfPoints(), 5)
        np.testing.assert_array_equal(points(track, "ProbeToTrackerTransformStatus"), [0, 0, 2, 0, 0])
        reader.SetToolFrame("Nowhere")
        reader.Update(1)
        self.assertIn("ToolFrame Nowhere", self.errors[-1])
        self.assertEqual(reader.GetOutputDataObject(1).GetNumberOfPoints(), 0)

    def test_trackers_alone(self):
        frames = [{"ReferenceToTrackerTransform": text(matrix(0.0)), "StylusToTrackerTransform": text(matrix(float(i))),
                   "PointerToTrackerTransform": text(matrix(-float(i)))} for i in range(3)]
        reader = self.open(self.put("a.igs.mha", sequence(frames, size=(0, 0), element="MET_OTHER")))
        self.assertEqual(steps(reader), [0, 1, 2])
        self.assertIn("indices of frames", reader.GetNotes())
        image = self.frame(reader, 1)
        self.assertEqual(image.GetNumberOfPoints(), 0)
        np.testing.assert_array_equal(field(image, "StylusToTrackerTransform"), matrix(1.0))
        track = self.track(reader)
        names = track.GetFieldData().GetAbstractArray("ToolNames")
        self.assertEqual([names.GetValue(i) for i in range(names.GetNumberOfValues())], ["Stylus", "Pointer"])
        np.testing.assert_array_equal(points(track, "Tool"), [0, 0, 0, 1, 1, 1])
        self.assertEqual(track.GetNumberOfCells(), 2)
        # Written and read again.
        writer = self.watched(vtkUltrasoundSequenceWriter())
        writer.SetInputConnection(reader.GetOutputPort())
        writer.SetFileName(self.path("b.igs.mha"))
        self.assertEqual(writer.Write(), 1)
        again = self.open(self.path("b.igs.mha"))
        np.testing.assert_array_equal(points(self.track(again), "ToolToWorld"), points(track, "ToolToWorld"))
        writer.SetFileName(self.path("b.seq.nrrd"))
        self.assertEqual(writer.Write(), 0)
        self.assertIn("without images", self.errors[-1])

    def test_round_trips(self):
        frames = tracked()
        frames[1]["ProbeToTrackerTransform"] = text(np.vstack([np.random.default_rng(3).normal(size=(3, 4)), [0, 0, 0, 1]]))
        reader = self.open(self.put("a.igs.mha", sequence(frames, "Operator = nobody\n")), self.calibration())
        for name in ("b.igs.mha", "b.mhd", "b.seq.nrrd", "b.nhdr"):
            for compress in (0, 1):
                writer = self.watched(vtkUltrasoundSequenceWriter())
                writer.SetInputConnection(reader.GetOutputPort())
                writer.SetFileName(self.path(name))
                writer.SetUseCompression(compress)
                self.assertEqual(writer.Write(), 1, name)
                self.assertEqual(self.errors, [])
                self.assertEqual(writer.GetNotes(), "")
                again = self.open(self.path(name)) # without the calibration: the poses were written
                self.assertEqual(steps(again), steps(reader))
                for time in steps(reader):
                    one, two = self.frame(reader, time), self.frame(again, time)
                    np.testing.assert_array_equal(points(one, "Intensity"), points(two, "Intensity"))
                    np.testing.assert_array_equal(points(one, "ValidRegion"), points(two, "ValidRegion"))
                    names = [one.GetFieldData().GetArrayName(i) for i in range(one.GetFieldData().GetNumberOfArrays())]
                    for key in (*names, "ImageToWorld"):
                        np.testing.assert_array_equal(field(one, key), field(two, key), err_msg=key)
                    self.assertEqual(field(two, "ImageToReferenceTransformStatus"), "INVALID" if field(one, "FrameIndex") == 2 else "OK")

    def test_the_writer_of_volumes_knows_sequences_by_their_name(self):
        reader = self.open(self.put("a.igs.mha", sequence(tracked())))
        writer = self.watched(vtkUltrasoundWriter())
        writer.SetInputConnection(reader.GetOutputPort())
        writer.SetFileName(self.path("b.Seq.nrrd"))
        self.assertEqual(writer.Write(), 1)
        again = self.open(self.path("b.Seq.nrrd"))
        self.assertEqual(steps(again), steps(reader))
        np.testing.assert_array_equal(field(self.frame(again, 101), "ProbeToTrackerTransform"), matrix(30.0))
        writer.SetFileName(self.path("no/b.seq.nrrd"))
        self.assertEqual(writer.Write(), 0)
        self.assertIn("no folder", self.errors[-1])

    def test_other_sources(self):
        # One image that no sequence made: what a live source could give.
        image = vtkImageData()
        image.SetDimensions(3, 2, 1)
        image.AllocateScalars(5, 1) # unsigned short
        points(image, "ImageScalars")[:] = np.arange(6) * 1000
        pose = vtkDoubleArray()
        pose.SetName("ImageToWorld")
        pose.SetNumberOfComponents(16)
        pose.InsertNextTuple(matrix(3.0, 0.5).ravel())
        image.GetFieldData().AddArray(pose)
        extra = vtkDoubleArray()
        extra.SetName("Temperature")
        extra.InsertNextValue(37.0)
        image.GetFieldData().AddArray(extra)
        writer = self.watched(vtkUltrasoundSequenceWriter())
        writer.SetInputData(image)
        writer.SetFileName(self.path("a.seq.mha"))
        self.assertEqual(writer.Write(), 1)
        self.assertEqual(writer.GetNotes(), "sequences cannot hold the field Temperature")
        frame = self.frame(self.open(self.path("a.seq.mha")), 0)
        np.testing.assert_array_equal(points(frame, "Intensity"), np.arange(6) * 1000)
        self.assertEqual(points(frame, "Intensity").dtype, np.uint16)
        np.testing.assert_array_equal(field(frame, "ImageToWorld"), matrix(3.0, 0.5))
        np.testing.assert_array_equal(field(frame, "ImageToReferenceTransform"), matrix(3.0, 0.5))
        self.assertIsNone(field(frame, "TimeStamp"))

        # No poses at all: the geometry of the image is that of the file.
        image.GetFieldData().Initialize()
        image.SetSpacing(0.5, 0.25, 2.0)
        image.SetOrigin(1, 2, 3)
        self.assertEqual(writer.Write(), 1)
        frame = self.frame(self.open(self.path("a.seq.mha")), 0)
        self.assertEqual((frame.GetSpacing(), frame.GetOrigin()), ((0.5, 0.25, 1.0), (1.0, 2.0, 3.0)))

    def test_colours_become_grey(self):
        header = ("NDims = 3\nDimSize = 2 1 1\nElementType = MET_UCHAR\nElementNumberOfChannels = 3\nElementSpacing = 1 1 1\n"
                  "UltrasoundImageType = RGB_COLOR\nElementDataFile = LOCAL\n")
        reader = self.open(self.put("a.igs.mha", header.encode() + bytes([255, 255, 255, 200, 100, 50])))
        image = self.frame(reader, 0)
        np.testing.assert_array_equal(points(image, "Intensity"), [255, 124])
        self.assertIn("colours were turned into grey", reader.GetNotes())

    def test_bad_input(self):
        reader = self.watched(vtkUltrasoundSequenceReader())

        def refused(path, words, **settings):
            reader.SetFileName(path)
            reader.SetTransformFile(settings.get("transforms"))
            reader.SetWorldFrame(settings.get("world"))
            reader.Modified()
            self.errors.clear()
            reader.UpdateInformation()
            reader.Update()
            self.assertTrue(self.errors and words in self.errors[0] and str(path or "") in self.errors[0], (words, self.errors[:1]))
            self.assertEqual(reader.GetOutputDataObject(0).GetNumberOfPoints(), 0)

        good = sequence(tracked())
        refused(None, "no file name")
        refused(self.path("missing.mha"), "no such file")
        refused(self.put("a.mha", b""), "empty")
        refused(self.put("a.mha", good[:-1]), "truncated")
        refused(self.put("a.mha", good.replace(b"Frame0003_Timestamp", b"Frame0009_Timestamp")), "frame 9")
        refused(self.put("a.mha", good.replace(b"= MF", b"= QQ")), "orientation")
        refused(self.put("a.igs.mha", good), "Nowhere", world="Nowhere")
        reader.SetTransformFile(self.path("missing.xml"))
        self.errors.clear()
        reader.Update()
        self.assertIn("missing.xml", self.errors[0])
        refused(self.put("b.mha", sequence([{"ImageToATransform": text(matrix()), "ImageToBTransform": text(matrix())}])), "A, B")
        mirrored = matrix()
        mirrored[2, 2] = -1.0
        volumes = sequence([{"ImageToReferenceTransform": text(mirrored)}] * 2).replace(b"NDims = 3", b"NDims = 4")
        volumes = volumes.replace(b"DimSize = 6 4 2", b"DimSize = 6 2 2 2").replace(b"Kinds = domain", b"Kinds = domain domain")
        refused(self.put("b.mha", volumes.replace(b"Spacing = 1", b"Spacing = 1 1")), "ImageToReference: frames of 2 slices")
        # A file that changes under the reader is opened again.
        reader = self.open(self.put("c.mha", sequence(tracked())))
        self.put("c.mha", sequence(tracked(4)))
        reader.Modified()
        reader.UpdateInformation()
        self.assertEqual(reader.GetNumberOfFrames(), 4)

        writer = self.watched(vtkUltrasoundSequenceWriter())
        self.assertEqual(writer.Write(), 0)
        self.assertIn("no file name", self.errors[-1])
        self.put("d.igs.mha", "before")
        writer.SetFileName(self.path("d.igs.mha"))
        self.assertEqual(writer.Write(), 0)
        self.assertIn("no frames", self.errors[-1])
        broken = vtkUltrasoundSequenceReader()
        broken.SetFileName(self.put("e.mha", good.replace(b"DimSize", b"CompressedData = True\nDimSize")))
        broken.AddObserver("ErrorEvent", lambda *_: None)
        writer.SetInputConnection(broken.GetOutputPort())
        self.assertEqual(writer.Write(), 0)
        self.assertIn("the input failed", self.errors[-1])
        empty = vtkImageData()
        empty.SetDimensions(2, 2, 1)
        writer.SetInputData(empty)
        self.assertEqual(writer.Write(), 0)
        self.assertIn("no intensities", self.errors[-1])
        with open(self.path("d.igs.mha")) as file:
            self.assertEqual(file.read(), "before")
        self.assertEqual([name for name in os.listdir(self.folder.name) if name.startswith(".")], [])

    def test_who_reads_what(self):
        volume = self.put("v.mha", "NDims = 3\nDimSize = 1 1 2\nElementType = MET_UCHAR\nElementDataFile = LOCAL\nab")
        frames = self.put("s.igs.mha", sequence(tracked()))
        for path, volumes, sequences in ((volume, 1, 0), (frames, 0, 1), (self.put("t.txt", "text"), 0, 0), (self.path("none"), 0, 0)):
            self.assertEqual(vtkUltrasoundReader.CanReadFile(path), volumes)
            self.assertEqual(vtkUltrasoundSequenceReader.CanReadFile(path), sequences)
        reader = self.watched(vtkUltrasoundReader())
        reader.SetFileName(frames)
        reader.Update()
        self.assertIn("vtkUltrasoundSequenceReader", self.errors[0])

    @unittest.skipUnless((real_data / "plus").is_dir(), "the real data are not there")
    def test_real_recordings(self):
        reader = self.open(str(real_data / "liver" / "liver_sweep.igs.mha"))
        self.assertEqual(len(steps(reader)), 140)
        image = self.frame(reader, 70)
        self.assertEqual(image.GetDimensions(), (739, 593, 1))
        m, pose = index_to_world(image), field(image, "ImageToWorld")
        corners = np.array([[0, 0, 0, 1], [738, 0, 0, 1], [0, 592, 0, 1], [738, 592, 0, 1]]).T
        self.assertLess(np.abs(m @ corners - pose @ corners).max(), 0.01) # mm: this sweep has no shear to speak of
        self.assertEqual(self.track(reader).GetNumberOfPoints(), 140)

        plus = real_data / "plus"
        reader = self.open(str(plus / "SpinePhantomFreehand.igs.mha"), str(plus / "PlusDeviceSet_SpinePhantomFreehandReconstructionOnly.xml"))
        self.assertEqual(reader.GetWorldFrameInUse(), "Reference")
        self.assertEqual(len(steps(reader)), 21)
        self.assertEqual(steps(reader)[0], 215.102186)
        self.assertIsNotNone(field(self.frame(reader, 216.0), "ImageToWorld"))
        reader = self.open(str(plus / "EightLandmarkPointsTrackedForPhantomRegistration.igs.mha"))
        self.assertEqual(self.track(reader).GetNumberOfPoints(), 1000)


if __name__ == "__main__":
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF) # errors are collected by the tests
    unittest.main()
