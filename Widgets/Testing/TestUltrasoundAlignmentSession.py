#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundAlignmentSession: a whole session without a window, killed and reopened, and everything that may go wrong."""
import json
import math
import os
import pathlib
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkDoubleArray, vtkIntArray, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet, vtkImageData, vtkMultiBlockDataSet, vtkPolyData
from vtkmodules.vtkCommonMath import vtkMatrix4x4

from echorama import vtkUltrasoundAlignmentSession, vtkUltrasoundReader, vtkUltrasoundWriter

source = pathlib.Path(os.environ.get("ECHORAMA_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
c, s = math.cos(0.3), math.sin(0.3)


def volume(seed=0, origin=(3, -7, 11), dtype=np.uint8, size=(20, 18, 16), valid=True):
    image = vtkImageData()
    image.SetDimensions(size)
    image.SetSpacing(0.5, 0.6, 0.7)
    image.SetOrigin(origin)
    image.SetDirectionMatrix([0, -1, 0, c, 0, s, -s, 0, c])
    z, y, x = np.meshgrid(*(np.arange(n) for n in size[::-1]), indexing="ij")
    values = np.random.default_rng(seed).integers(20, 200, x.shape).astype(dtype)
    inside = (x - size[0] / 2) ** 2 + (y - size[1] / 2) ** 2 < (size[0] / 2) ** 2
    for name, array in (("Intensity", values), ("ValidRegion", inside.astype(np.uint8)))[: 2 if valid else 1]:
        data = numpy_to_vtk(array.ravel(), deep=True)
        data.SetName(name)
        image.GetPointData().AddArray(data)
    image.GetPointData().SetActiveScalars("Intensity")
    return image


def write(image, path):
    writer = vtkUltrasoundWriter()
    writer.SetInputData(image)
    writer.SetFileName(str(path))
    writer.Write()


def voxels(image, name="Intensity"):
    return vtk_to_numpy(image.GetPointData().GetArray(name)).copy()


def pose(session, volume_id):
    matrix = vtkMatrix4x4()
    assert session.GetVolumeToWorld(volume_id, matrix)
    return np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])


def matrix_of(rows):
    matrix = vtkMatrix4x4()
    matrix.DeepCopy(np.asarray(rows, dtype=float).ravel())
    return matrix


def shift(x, y=0.0, z=0.0):
    return matrix_of([[1, 0, 0, x], [0, 1, 0, y], [0, 0, 1, z], [0, 0, 0, 1]])


def placement(session, volume_id):
    middle, degrees = [0.0] * 3, [0.0] * 3
    assert session.GetPlacement(volume_id, middle, degrees)
    return np.array(middle), np.array(degrees)


def ids(session):
    return [session.GetVolumeId(i) for i in range(session.GetNumberOfVolumes())]


def backups(session):
    paths, labels, times = vtkStringArray(), vtkStringArray(), vtkDoubleArray()
    count = session.GetBackups(paths, labels, times)
    assert count == paths.GetNumberOfValues() == labels.GetNumberOfValues() == times.GetNumberOfTuples()
    return [(paths.GetValue(i), labels.GetValue(i), times.GetValue(i)) for i in range(count)]


class Session(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="echorama-session-")).resolve()
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        os.environ["XDG_DATA_HOME"] = str(self.folder / "data")
        self.errors = []

    def session(self):
        session = vtkUltrasoundAlignmentSession()

        def listen(_, __, text):
            self.errors.append(text)

        listen.CallDataType = "string0"
        session.AddObserver("ErrorEvent", listen)
        return session

    def files(self, count=2):
        paths = [self.folder / f"v{i}.mha" for i in range(count)]
        for i, path in enumerate(paths):
            write(volume(i, (3 + 4 * i, -7, 11)), path)
        return paths

    def opened(self, count=2):
        session = self.session()
        for path in self.files(count):
            self.assertGreater(session.OpenVolume(str(path)), 0)
        return session

    def refuses(self, session, words, call, *arguments):
        """The call fails with these words, and nothing has changed."""
        before = [(i, session.GetName(i), pose(session, i).tolist()) for i in ids(session)], session.GetUndoCount()
        self.errors.clear()
        answer = call(*arguments)
        self.assertIn(answer, (False, 0, -1, None), words)
        self.assertEqual(len(self.errors), 1, self.errors)
        for word in words if isinstance(words, tuple) else (words,):
            self.assertIn(word, self.errors[0])
        self.errors.clear()
        self.assertEqual(([(i, session.GetName(i), pose(session, i).tolist()) for i in ids(session)], session.GetUndoCount()), before)

    # ------------------------------------------------------------------------------------------------------------ volumes

    def test_images_lie_where_the_poses_say_and_share_voxels(self):
        session, given = self.session(), volume()
        one = session.AddVolume(given, None, "one")
        image = session.GetImage(one)
        self.assertIs(image.GetPointData().GetArray("Intensity"), given.GetPointData().GetArray("Intensity"))
        session.Select(one)
        turn = np.array([[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3], [0, 0, 0, 1.0]])
        session.MoveSelection(matrix_of(turn))
        self.assertIs(session.GetImage(one), image, "the same image")
        for i in (0, 77, given.GetNumberOfPoints() - 1):
            np.testing.assert_allclose(image.GetPoint(i), (turn @ [*given.GetPoint(i), 1])[:3], atol=1e-12)
        self.assertEqual(given.GetOrigin(), (3.0, -7.0, 11.0), "what was given stays where it is")
        self.assertTrue(session.Undo())
        self.assertEqual(image.GetOrigin(), given.GetOrigin())

        blocks = vtkMultiBlockDataSet()
        two = session.AddVolume(volume(1), None, "two")
        session.SetVisible(two, False)
        session.GetVolumes(blocks)
        self.assertEqual([blocks.GetMetaData(i).Get(vtkCompositeDataSet.NAME()) for i in range(2)], ["one", "two"])
        session.GetVolumes(blocks, True)
        self.assertEqual(blocks.GetNumberOfBlocks(), 1)
        session.SetVolumeToWorld(one, shift(5))
        self.assertEqual(blocks.GetBlock(0).GetOrigin(), given.GetOrigin(), "blocks are a moment of it")
        self.assertTrue(session.RemoveVolume(one))
        self.assertIsNone(session.GetImage(one))
        self.assertTrue(session.Undo())
        self.assertEqual(session.GetImage(one).GetOrigin()[0], 8.0)

    def test_an_extent_that_does_not_begin_at_zero(self):
        image = volume()
        moved = vtkImageData()
        moved.ShallowCopy(image)
        moved.SetExtent(4, 23, -3, 14, 7, 22)
        session = self.session()
        one = session.AddVolume(moved, None)
        np.testing.assert_allclose(session.GetImage(one).GetPoint(0), moved.GetPoint(0), atol=1e-12)
        self.assertEqual(session.GetImage(one).GetExtent()[0], 0)

    def test_placement_in_numbers(self):
        session = self.session()
        one = session.AddVolume(volume(), None)
        middle, degrees = placement(session, one)
        np.testing.assert_allclose(middle, np.mean([session.GetImage(one).GetPoint(0), session.GetImage(one).GetPoint(20 * 18 * 16 - 1)], 0))
        np.testing.assert_array_equal(degrees, 0)
        for wanted in ((10, 20, 30), (-170, 80, 5), (0, 0, 180), (5, 90, 0), (0, -90, 0)):
            self.assertTrue(session.SetPlacement(one, 1, 2, 3, *wanted))
            middle, degrees = placement(session, one)
            np.testing.assert_allclose(middle, [1, 2, 3], atol=1e-12)
            np.testing.assert_allclose(degrees, wanted, atol=1e-6)
            entries, before = session.GetUndoCount(), pose(session, one)
            self.assertTrue(session.SetPlacement(one, *middle, *degrees))
            self.assertEqual(session.GetUndoCount(), entries, "what was read and set again is no edit")
            np.testing.assert_array_equal(pose(session, one), before)
        # z, then y, then x of the world
        session.SetPlacement(one, 0, 0, 0, 90, 0, 90)
        np.testing.assert_allclose(pose(session, one)[:3, :3] @ [1, 0, 0], [0, 0, 1], atol=1e-12)

    def test_rotation_about_the_centre(self):
        session = self.session()
        one = session.AddVolume(volume(), None)
        session.SelectAll()
        centre = [0.0] * 3
        session.GetCentreOfRotation(centre)
        session.RotateSelection(10, -20, 30)
        np.testing.assert_allclose(placement(session, one)[0], centre, atol=1e-12)
        session.SetCentreOfRotation(1, 2, 3)
        session.SetVolumeToWorld(one, shift(0))
        session.RotateSelection(0, 0, 90)
        np.testing.assert_allclose(pose(session, one) @ [1, 2, 3, 1], [1, 2, 3, 1], atol=1e-12)
        np.testing.assert_allclose(pose(session, one) @ [2, 2, 3, 1], [1, 3, 3, 1], atol=1e-12)
        session.ResetCentreOfRotation()
        session.GetCentreOfRotation(centre)
        np.testing.assert_allclose(placement(session, one)[0], centre, atol=1e-12)

    def test_grey_window(self):
        session, window = self.session(), [0.0, 0.0]
        session.AddVolume(volume(dtype=np.float32), None)
        session.GetGreyWindow(window)
        self.assertTrue(20 <= window[0] <= 22 and 197 <= window[1] <= 199, window)
        session.SetGreyWindow(5, 50)
        session.AddVolume(volume(1), None)
        session.GetGreyWindow(window)
        self.assertEqual(window, [5, 50])
        session.ResetGreyWindow()
        session.GetGreyWindow(window)
        self.assertTrue(window[0] < 25 and window[1] > 190, window)
        session.SetGreyWindow(7, 7)
        self.assertIn("black must be below white", self.errors[0])

    def test_events(self):
        session, told = self.session(), []
        for name in ("Volumes", "Poses", "Selection", "Voxels", "History"):
            session.AddObserver(getattr(vtkUltrasoundAlignmentSession, name + "ChangedEvent"), lambda _, __, name=name: told.append(name))

        def tells(wanted, call, *arguments):
            told.clear()
            call(*arguments)
            self.assertEqual(told, wanted.split(), f"{call.__name__}{arguments}")

        tells("Volumes Poses History", session.AddVolume, volume(), None)
        tells("Volumes Poses History", session.AddVolume, volume(1), None)
        one, two = ids(session)
        tells("Selection", session.Select, one)
        tells("", session.Select, one)
        tells("Poses History", session.TranslateSelection, 1, 0, 0)
        tells("", session.TranslateSelection, 0, 0, 0)
        tells("", session.BeginEdit, "drag")
        tells("Poses", session.TranslateSelection, 1, 0, 0)
        tells("Poses", session.RotateSelection, 1, 0, 0)
        tells("History", session.EndEdit)
        tells("Poses History", session.Undo)
        tells("Poses History", session.Redo)
        tells("", session.BeginEdit, "drag")
        tells("Poses", session.TranslateSelection, 1, 0, 0)
        tells("Poses", session.CancelEdit)
        tells("Volumes History", session.SetOpacity, two, 0.5)
        tells("", session.SetOpacity, two, 0.5)
        tells("Volumes History", session.SetName, two, "second")
        tells("Volumes History", session.SetLandmark, one, "apex", 1, 2, 3)
        tells("", session.SetLandmark, one, "apex", 1, 2, 3)
        tells("Volumes History", session.Undo)
        tells("Selection History", session.SetCentreOfRotation, 1, 2, 3)
        tells("", session.SetCentreOfRotation, 1, 2, 3)
        tells("Selection History", session.Undo)
        tells("Selection History", session.Redo)
        tells("Selection", session.InvertSelection)
        tells("", session.BeginStroke, one, "carve", 3, 0, 1, 0.5, True)
        middle = placement(session, one)[0]
        tells("Voxels", session.ExtendStroke, *middle)
        tells("History", session.EndStroke)
        tells("Voxels History", session.Undo)
        tells("Selection", session.SelectAll)
        tells("Volumes Selection History", session.RemoveVolume, two)
        tells("", session.Select, 77)

    # ---------------------------------------------------------------------------------------------------------- landmarks

    def test_landmarks_are_places_of_the_world_that_move_with_their_volume(self):
        session = vtkUltrasoundAlignmentSession()
        one, two = session.AddVolume(volume(), None), session.AddVolume(volume(1), None)
        self.assertTrue(session.SetLandmark(one, "apex", 1, 2, 3) and session.SetLandmark(two, "apex", 4, 5, 6))
        self.assertEqual((session.GetNumberOfLandmarks(one), session.GetLandmarkLabel(one, 0), session.GetLandmarkLabel(one, 1)), (1, "apex", ""))
        session.Select(two)
        session.TranslateSelection(10, 0, 0)
        place = [0.0] * 3
        self.assertTrue(session.GetLandmark(two, "apex", place))
        np.testing.assert_allclose(place, (14, 5, 6), atol=1e-12)
        self.assertFalse(session.GetLandmark(two, "nobody's", place))
        self.assertEqual(session.GetNextLandmarkLabel(two), "1")
        session.RemoveLandmark("apex")
        self.assertEqual(session.GetNumberOfLandmarks(one) + session.GetNumberOfLandmarks(two), 0)

    def test_measurements_stay_in_the_world_and_are_edits(self):
        session = self.session()
        one = session.AddVolume(volume(), None)
        told = []
        session.AddObserver(session.MeasurementsChangedEvent, lambda *_: told.append(1))
        number = session.GetNextMeasurementNumber()
        self.assertTrue(session.SetDistance(number, (0, 0, 0), (3, 4, 0)))
        self.assertTrue(session.SetAngle(number + 1, (1, 0, 0), (0, 0, 0), (0, 2, 0)))
        session.Select(one)
        session.TranslateSelection(10, 0, 0)
        self.assertEqual([session.GetMeasurementNumber(i) for i in range(3)], [1, 2, 0])
        self.assertEqual([session.GetMeasurementValue(i) for i in range(2)], [5.0, 90.0])
        self.assertEqual(len(told), 2)
        self.assertTrue(session.RemoveMeasurement(1))
        session.Undo()
        self.assertEqual((session.GetNumberOfMeasurements(), len(told)), (2, 4))
        self.refuses(session, "measurement 7", session.RemoveMeasurement, 7)
        self.refuses(session, "from 1", session.SetDistance, 0, (0, 0, 0), (1, 0, 0))
        session.ClearMeasurements()
        self.assertEqual(session.GetNumberOfMeasurements(), 0)

    # ------------------------------------------------------------------------------------------------------------ strokes

    def test_strokes_go_where_the_volume_goes_and_are_undone_to_the_bit(self):
        for dtype in (np.uint8, np.int16, np.uint16, np.float32, np.float64):
            session, given = self.session(), volume(dtype=dtype, valid=dtype != np.float32)
            if dtype == np.float32:
                vtk_to_numpy(given.GetPointData().GetArray("Intensity"))[5] = math.nan
            original = voxels(given)
            one = session.AddVolume(given, None, "one")
            session.SetVolumeToWorld(one, matrix_of([[0, -1, 0, 30], [1, 0, 0, 5], [0, 0, 1, -9], [0, 0, 0, 1]]))
            image, middle = session.GetImage(one), placement(session, one)[0]
            kept = vtkMultiBlockDataSet()
            session.GetVolumes(kept)

            self.assertTrue(session.BeginStroke(one, "paint", 2.0, 255, 1.0, 1.0, False))
            self.assertTrue(session.ExtendStroke(*middle))
            self.assertTrue(session.ExtendStroke(*(middle + [2, 0, 0])))
            live = voxels(image)
            self.assertTrue(session.EndStroke())
            painted = voxels(image)
            np.testing.assert_array_equal(painted, live)
            distance = np.array([np.linalg.norm(np.array(image.GetPoint(i)) - middle) for i in range(image.GetNumberOfPoints())])
            self.assertTrue((painted[distance < 1.95] == 255).all())
            np.testing.assert_array_equal(painted[distance > 4.05], original[distance > 4.05])
            self.assertEqual(session.GetUndoLabel(), "Paint one")
            np.testing.assert_array_equal(voxels(given), original, "what was given is not painted")
            np.testing.assert_array_equal(voxels(kept.GetBlock(0)), original, "nor what was handed to a filter")

            session.GetVolumes(kept)
            session.BeginStroke(one, "carve", 3.0, 0, 1.0, 1.0, True)
            session.ExtendStroke(*middle)
            session.EndStroke()
            carved = voxels(image, "ValidRegion")
            self.assertTrue((carved[distance < 2.95] == 0).all())
            self.assertTrue((voxels(kept.GetBlock(0), "ValidRegion")[distance < 1.95] == 1).all(), "blocks keep what they had")
            np.testing.assert_array_equal(voxels(kept.GetBlock(0)), painted)

            session.Undo()
            session.Undo()
            np.testing.assert_array_equal(voxels(image), original)
            valid = voxels(given, "ValidRegion") if given.GetPointData().HasArray("ValidRegion") else np.isfinite(original)
            np.testing.assert_array_equal(voxels(image, "ValidRegion"), valid)
            session.Redo()
            np.testing.assert_array_equal(voxels(image), painted)
            session.Redo()
            np.testing.assert_array_equal(voxels(image, "ValidRegion"), carved)

    def test_strokes_that_do_not_end_well(self):
        session = self.session()
        one = session.AddVolume(volume(), None, "one")
        two = session.AddVolume(volume(1), None, "two")
        original, middle, entries = voxels(session.GetImage(one)), placement(session, one)[0], session.GetUndoCount()
        self.refuses(session, "no stroke", session.ExtendStroke, 0, 0, 0)
        self.refuses(session, "no stroke", session.EndStroke)
        self.refuses(session, "no volume 9", session.BeginStroke, 9, "paint", 2.0, 0, 1, 1, True)
        self.refuses(session, ("spray", "carve"), session.BeginStroke, one, "spray", 2.0, 0, 1, 1, True)
        self.refuses(session, "RadiusMm", session.BeginStroke, one, "paint", -2.0, 0, 1, 1, True)
        self.refuses(session, "Opacity", session.BeginStroke, one, "paint", 2.0, 0, 3, 1, True)
        stroke = (one, "paint", 2.0, 255, 1.0, 1.0, False)
        session.BeginStroke(*stroke)
        self.refuses(session, "not ended", session.BeginStroke, *stroke)
        self.refuses(session, "finite", session.ExtendStroke, math.nan, 0, 0)
        session.EndStroke() # nothing was painted
        self.assertEqual(session.GetUndoCount(), entries)
        session.BeginEdit("both")
        for _ in range(2): # nor here, and the edit around it goes on
            self.assertTrue(session.BeginStroke(*stroke), self.errors)
            self.assertTrue(session.EndStroke())
        session.SetOpacity(one, 0.5)
        self.assertTrue(session.EndEdit())
        self.assertEqual((session.GetUndoCount(), session.GetUndoLabel()), (entries + 1, "both"))
        session.Undo()
        session.BeginStroke(*stroke)
        session.ExtendStroke(*middle)
        self.refuses(session, "during an edit", session.Undo)
        session.CancelEdit()
        np.testing.assert_array_equal(voxels(session.GetImage(one)), original)
        session.BeginStroke(*stroke)
        session.ExtendStroke(*middle)
        session.RemoveVolume(one)
        self.refuses(session, "no stroke", session.ExtendStroke, *middle)
        session.Undo()
        self.assertEqual(ids(session), [one, two])
        np.testing.assert_array_equal(voxels(session.GetImage(one)), original)

    def test_a_brush_that_is_taken_in_hand(self):
        session, given = self.session(), volume()
        one = session.AddVolume(given, None, "one")
        original, middle, told = voxels(given), placement(session, one)[0], []
        session.AddObserver("AnyEvent", lambda _, event: told.append(event) if "User" in event else None)
        self.assertTrue(session.PrepareToPaint(one))
        array = session.GetImage(one).GetPointData().GetArray("Intensity")
        self.assertIsNot(array, given.GetPointData().GetArray("Intensity"), "it has its own voxels")
        self.assertEqual((told, session.GetUndoCount()), ([], 1))
        before, after = vtkImageData(), vtkImageData()
        self.assertTrue(session.GetSnapshot(one, before))
        session.BeginStroke(one, "paint", 2.0, 255, 1.0, 1.0, False)
        session.ExtendStroke(*middle)
        session.EndStroke()
        self.assertIs(session.GetImage(one).GetPointData().GetArray("Intensity"), array, "nothing was left to copy")
        self.assertTrue(session.GetSnapshot(one, after))
        painted = voxels(session.GetImage(one))
        self.assertTrue((painted != original).any())
        session.Undo()
        np.testing.assert_array_equal(voxels(before), original)
        np.testing.assert_array_equal(voxels(after), painted)
        self.assertFalse(session.GetSnapshot(9, after) or session.GetSnapshot(one, None))
        self.refuses(session, "no volume 9", session.PrepareToPaint, 9)

    def test_five_hundred_operations_and_back(self):
        random = np.random.default_rng(17)
        session = self.session()
        for i, dtype in enumerate((np.uint8, np.int16, np.float32)):
            session.AddVolume(volume(i, (3 + 4 * i, -7, 11), dtype, valid=i != 1), None)
        session.SelectAll()
        start = session.GetUndoCount()

        def everything():
            found = {}
            for i in ids(session):
                image, colour = session.GetImage(i), [0.0] * 3
                session.GetColour(i, colour)
                direction = image.GetDirectionMatrix()
                found[i] = (session.GetName(i), colour, session.GetOpacity(i), session.GetVisible(i), session.GetGroup(i),
                            pose(session, i).tobytes(), image.GetOrigin(), image.GetSpacing(), image.GetDimensions(),
                            [direction.GetData()[k] for k in range(9)], voxels(image).tobytes())
            return found

        def valid():
            found = {}
            for i in ids(session):
                array = session.GetImage(i).GetPointData().GetArray("ValidRegion")
                found[i] = vtk_to_numpy(array).tobytes() if array else bytes([1]) * session.GetImage(i).GetNumberOfPoints()
            return found

        def stroke():
            i = int(random.choice(ids(session)))
            session.BeginStroke(i, str(random.choice(["paint", "carve", "restore"])), random.uniform(0.5, 3), random.uniform(0, 255),
                                random.uniform(), random.uniform(), bool(random.integers(2)))
            for _ in range(random.integers(0, 4)):
                session.ExtendStroke(*(placement(session, i)[0] + random.uniform(-4, 4, 3)))
            session.CancelEdit() if random.integers(8) == 0 else session.EndStroke()

        def select():
            session.Select(int(random.choice(ids(session))), bool(random.integers(2)), bool(random.integers(2)))

        def remove():
            if session.GetNumberOfVolumes() > 1:
                session.RemoveVolume(int(random.choice(ids(session))))

        def group():
            session.GroupSelection() if session.GetNumberOfSelected() > 1 else session.UngroupSelection()

        def drag():
            session.BeginEdit("drag")
            for _ in range(3):
                session.TranslateSelection(*random.uniform(-2, 2, 3))
                session.RotateSelection(*random.uniform(-9, 9, 3))
            session.CancelEdit() if random.integers(4) == 0 else session.EndEdit()

        operations = [stroke, stroke, stroke, select, drag, group, session.InvertSelection, session.Undo, session.Redo,
                      lambda: session.TranslateSelection(*random.uniform(-5, 5, 3)),
                      lambda: session.SetOpacity(int(random.choice(ids(session))), random.uniform()),
                      lambda: session.SetVisible(int(random.choice(ids(session))), bool(random.integers(2)))]
        begun, begunValid = everything(), valid()
        for step in range(500):
            if step % 60 == 30:
                remove()
            else:
                while session.GetUndoCount() > start and random.integers(40) == 0:
                    session.Undo()
                operation = operations[random.integers(len(operations))]
                if operation != session.Undo or session.GetUndoCount() > start:
                    operation()
        self.assertEqual(self.errors, [])
        end, endValid, entries = everything(), valid(), session.GetUndoCount() - start
        self.assertGreater(entries, 50)
        for _ in range(entries):
            self.assertTrue(session.Undo())
        self.assertTrue(everything() == begun and valid() == begunValid, "the start, to the bit")
        for _ in range(entries):
            self.assertTrue(session.Redo())
        self.assertTrue(everything() == end and valid() == endValid, "and the end again")

    # ----------------------------------------------------------------------------------------------------------- projects

    def test_a_project_comes_back_to_the_last_bit_also_elsewhere(self):
        session = self.opened(3)
        one, two, three = ids(session)
        session.SelectAll()
        session.RotateSelection(11, 7, -3)
        session.SetCentreOfRotation(1, 2, 3)
        session.Select(three, False)
        session.GroupSelection()
        session.SetOpacity(two, 0.3)
        session.SetVisible(two, False)
        session.SetColour(three, 0.1, 0.2, 0.3)
        session.SetName(three, "the third")
        session.SetComment("who, what")
        session.BeginStroke(one, "paint", 2.0, 255, 0.7, 0.2, True)
        for step in range(4):
            session.ExtendStroke(*(placement(session, one)[0] + [step, 0, 0]))
        session.EndStroke()
        project = self.folder / "p.json"
        self.assertTrue(session.GetModifiedSinceSave())
        self.assertTrue(session.SaveProject(str(project)))
        self.assertFalse(session.GetModifiedSinceSave())
        self.assertEqual(session.GetProjectPath(), str(project))
        self.assertEqual([v["file"] for v in json.loads(project.read_text())["volumes"]], ["v0.mha", "v1.mha", "v2.mha"])

        elsewhere = self.folder / "elsewhere"
        elsewhere.mkdir()
        for path in (*self.folder.glob("v*.mha"), project):
            path.rename(elsewhere / path.name)
        again = self.session()
        self.assertTrue(again.OpenProject(str(elsewhere / "p.json")), self.errors)
        self.assertFalse(again.GetModifiedSinceSave())
        self.assertEqual(again.GetUndoCount(), 0)
        self.assertEqual(again.GetComment(), "who, what")
        self.assertEqual(again.GetNumberOfVolumes(), 3)
        for old, new in zip(ids(session), ids(again)):
            np.testing.assert_array_equal(pose(again, new), pose(session, old))
            np.testing.assert_array_equal(voxels(again.GetImage(new)), voxels(session.GetImage(old)))
            self.assertEqual(again.GetImage(new).GetOrigin(), session.GetImage(old).GetOrigin())
            for get in ("GetName", "GetOpacity", "GetVisible", "GetGroup"):
                self.assertEqual(getattr(again, get)(new), getattr(session, get)(old), get)
        # Read by somebody else: the blocks are taken, and nothing is moved twice.
        files, blocks = vtkStringArray(), vtkMultiBlockDataSet()
        self.assertTrue(again.GetProjectFiles(str(elsewhere / "p.json"), files))
        for i in range(3):
            reader = vtkUltrasoundReader()
            reader.SetFileName(files.GetValue(i))
            reader.Update()
            blocks.SetBlock(i, reader.GetOutput())
            blocks.GetMetaData(i).Set(vtkCompositeDataSet.NAME(), files.GetValue(i))
        self.assertTrue(again.OpenProject(str(elsewhere / "p.json"), blocks))
        self.assertIs(again.GetImage(again.GetVolumeId(1)).GetPointData().GetArray("Intensity"),
                      blocks.GetBlock(1).GetPointData().GetArray("Intensity"))
        np.testing.assert_array_equal(pose(again, again.GetVolumeId(2)), pose(session, three))

        # The command line's pose file is a project, and a project is a pose file.
        self.assertTrue(again.WritePoses(str(elsewhere / "poses.json")))
        third = self.session()
        self.assertTrue(third.OpenProject(str(elsewhere / "poses.json")))
        np.testing.assert_array_equal(pose(third, third.GetVolumeId(2)), pose(session, three))
        third.SelectAll()
        third.TranslateSelection(1, 2, 3)
        self.assertTrue(third.ReadPoses(str(elsewhere / "p.json")))
        np.testing.assert_array_equal(pose(third, third.GetVolumeId(0)), pose(session, one))
        self.assertTrue(third.Undo())
        self.assertNotEqual(pose(third, third.GetVolumeId(0))[0, 3], pose(session, one)[0, 3])

    def test_what_cannot_be_opened_is_told_and_nothing_is_lost(self):
        session = self.opened(3)
        project = self.folder / "p.json"
        session.SaveProject(str(project))
        session.SelectAll()
        session.TranslateSelection(1, 2, 3)
        good = project.read_text()

        self.refuses(session, "missing.json", session.OpenProject, str(self.folder / "missing.json"))
        project.write_text(good[: len(good) // 2])
        self.refuses(session, ("p.json", "not JSON"), session.OpenProject, str(project))
        project.write_text(good.replace("echorama-project-1", "echorama-project-9"))
        self.refuses(session, ("p.json", "echorama-project-9"), session.OpenProject, str(project))
        project.write_text(good)

        archive = self.folder / "archive"
        archive.mkdir()
        (self.folder / "v1.mha").rename(archive / "v1.mha")
        (self.folder / "v2.mha").rename(archive / "v2.mha")
        self.refuses(session, ("2 of its volumes", "v1.mha", "v2.mha"), session.OpenProject, str(project))
        files = vtkStringArray()
        session.GetProjectFiles(str(project), files)
        self.assertEqual([files.GetValue(i) != "" for i in range(3)], [True, False, False])
        session.AddSearchFolder(str(archive))
        other = self.session()
        self.refuses(other, "v1.mha", other.OpenProject, str(project))
        other.AddSearchFolder(str(archive))
        self.assertTrue(other.OpenProject(str(project)), self.errors)

        write(volume(1, (0, 0, 0)), archive / "v1.mha") # somebody resaved it where the poses had moved it
        self.refuses(session, ("v1.mha", "geometry"), session.OpenProject, str(project))
        (archive / "v1.mha").write_text("ObjectType = nothing")
        self.refuses(session, "v1.mha", session.OpenProject, str(project))
        self.refuses(session, "v1.mha", session.OpenVolume, str(archive / "v1.mha"))
        self.refuses(session, "nowhere.mha", session.OpenVolume, str(self.folder / "nowhere.mha"))
        self.refuses(session, "open already", session.OpenVolume, str(self.folder / "v0.mha"))

        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, limits[1]))
        self.errors.clear()
        saved = session.SaveProject(str(project))
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
        self.assertFalse(saved)
        self.assertIn("cannot be written", self.errors[0])
        self.assertEqual(project.read_text(), good)
        self.assertTrue(session.GetModifiedSinceSave())
        session.AddVolume(volume(), None, "of a pipeline")
        self.refuses(session, "of a pipeline", session.SaveProject, str(project))
        self.assertEqual(project.read_text(), good)

    def test_bad_input(self):
        session = self.session()
        one = session.AddVolume(volume(), None, "one")
        session.Select(one)
        self.refuses(session, "no image", session.AddVolume, None, None)
        self.refuses(session, "intensities", session.AddVolume, vtkImageData(), None, "empty")
        self.refuses(session, "type", session.AddVolume, volume(dtype=np.int32), None, "numbers")
        colour = volume()
        colour.GetPointData().AddArray(numpy_to_vtk(np.zeros((20 * 18 * 16, 3), np.uint8), deep=True))
        colour.GetPointData().GetArray(2).SetName("rgb")
        colour.GetPointData().RemoveArray("Intensity")
        colour.GetPointData().SetActiveScalars("rgb")
        self.refuses(session, "components", session.AddVolume, colour, None, "colours")
        for rows in (np.diag([1, 1, 2, 1]), np.diag([-1, 1, 1, 1]), np.full((4, 4), math.nan), np.zeros((4, 4))):
            self.refuses(session, "not rigid", session.SetVolumeToWorld, one, matrix_of(rows))
            self.refuses(session, "not rigid", session.MoveSelection, matrix_of(rows))
            self.refuses(session, "not rigid", session.SetTruth, one, matrix_of(rows))
        self.refuses(session, "no pose", session.SetVolumeToWorld, one, None)
        self.refuses(session, "not rigid", session.TranslateSelection, math.inf, 0, 0)
        self.refuses(session, "not rigid", session.SetPlacement, one, 0, 0, 0, math.nan, 0, 0)
        for call in ((session.SetName, "x"), (session.SetOpacity, 0.5), (session.SetColour, 0, 0, 0), (session.SetVisible, False),
                     (session.SetVolumeToWorld, shift(0)), (session.SetPlacement, 0, 0, 0, 0, 0, 0), (session.Select,),
                     (session.RemoveVolume,), (session.SetTruth, shift(0))):
            self.refuses(session, "no volume 99", call[0], 99, *call[1:])
        self.refuses(session, "two selected", session.GroupSelection)
        self.refuses(session, "opacity", session.SetOpacity, one, 1.5)
        self.refuses(session, "needs a name", session.SetName, one, "")
        for method in (session.ReadPoses, session.ReadTruth, session.RestoreBackup):
            self.refuses(session, "nowhere.json", method, "nowhere.json")
        self.assertEqual((session.GetVolumeId(5), session.GetName(9), session.GetImage(9)), (-1, "", None))
        self.assertFalse(session.GetVolumeToWorld(9, vtkMatrix4x4()))
        self.assertFalse(session.GetPlacement(9, [0.0] * 3, [0.0] * 3))
        self.assertIn("one (selected)", str(session))

    # ------------------------------------------------------------------------------------------------------------ backups

    def test_backups_of_an_unsaved_session_and_then_of_a_project(self):
        session = self.session()
        session.SetAutomaticBackups(True)
        self.assertFalse((self.folder / "data").exists(), "nothing is written before there is something")
        for path in self.files(2):
            session.OpenVolume(str(path))
        one = session.GetVolumeId(0)
        session.Select(one)
        session.TranslateSelection(7, 0, 0)
        made = backups(session)
        self.assertEqual([label for _, label, _ in made], ["Move v0", "Add v1", "Add v0"])
        self.assertIn(str(self.folder / "data"), session.GetBackupFolder())
        self.assertLess(abs(made[0][2] - time.time()), 60)
        self.assertTrue(session.SaveProject(str(self.folder / "liver.json")))
        self.assertEqual(session.GetBackupFolder(), str(self.folder / "liver.backups"))
        self.assertEqual([label for _, label, _ in backups(session)][-3:], ["Move v0", "Add v1", "Add v0"], "they came along")
        self.assertEqual(list((self.folder / "data" / "echorama" / "unsaved").iterdir()), [])

        session.BeginEdit("drag")
        for _ in range(50):
            session.TranslateSelection(0, 0.5, 0)
        session.EndEdit()
        self.assertEqual(backups(session)[0][1], "drag")
        session.RemoveVolume(session.GetVolumeId(1))
        session.Undo()
        self.assertEqual([label for _, label, _ in backups(session)][:3], ["Undo: Remove v1", "Remove v1", "drag"])

        # Back to an earlier one, and forth again.
        now, entries = pose(session, one), session.GetUndoCount()
        earlier = next(path for path, label, _ in backups(session) if label == "Move v0")
        self.assertTrue(session.RestoreBackup(earlier), self.errors)
        self.assertEqual(ids(session)[0], one, "volumes keep their ids")
        np.testing.assert_array_equal(pose(session, one)[:3, 3], [7, 0, 0])
        self.assertEqual(session.GetUndoCount(), entries + 1)
        self.assertIn("Restore", session.GetUndoLabel())
        session.Undo()
        np.testing.assert_array_equal(pose(session, one), now)

        # A damaged one is listed and refused.
        text = pathlib.Path(earlier).read_text()
        pathlib.Path(earlier).write_text(text.replace('"opacity":1.0', '"opacity":0.9', 1))
        self.assertEqual([label for path, label, _ in backups(session) if path == earlier], ["damaged"])
        self.refuses(session, "damaged", session.RestoreBackup, earlier)

        # A volume that came later goes, one that went before is read again.
        first = backups(session)[-1][0]
        self.assertTrue(session.RestoreBackup(first))
        self.assertEqual(session.GetNumberOfVolumes(), 1)
        fresh = self.session()
        fresh.AddVolume(volume(7), None, "something else")
        self.assertTrue(fresh.RestoreBackup(backups(session)[1][0]), self.errors)
        self.assertEqual([fresh.GetName(i) for i in ids(fresh)], ["v0", "v1"])
        fresh.Undo()
        self.assertEqual([fresh.GetName(i) for i in ids(fresh)], ["something else"])

    def test_a_full_disk_is_told_once_and_earlier_backups_stay(self):
        session = self.opened()
        session.SelectAll()
        session.SetAutomaticBackups(True)
        session.TranslateSelection(1, 0, 0)
        self.assertTrue(session.BackUp())
        before = backups(session)
        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (500, limits[1]))
        session.SetOpacity(session.GetVolumeId(0), 0.5)
        seen = len(backups(session))
        for step in range(3): # all of it is one trouble
            time.sleep(1.1 if step == 1 else 0)
            session.SetOpacity(session.GetVolumeId(0), 0.1 * step)
            backups(session)
        told = list(self.errors)
        written = session.BackUp()
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
        self.assertEqual((seen, len(told)), (len(before), 1), told)
        self.assertFalse(written)
        self.assertTrue(any("cannot be written" in error for error in self.errors), self.errors)
        self.assertEqual(backups(session), before)
        self.assertTrue(session.BackUp())
        self.assertEqual(len(backups(session)), len(before) + 1)

    def test_killed_in_the_middle_of_a_drag(self):
        self.files(2)
        script = f"""
import sys, time
from echorama import vtkUltrasoundAlignmentSession
session = vtkUltrasoundAlignmentSession()
session.SetAutomaticBackups(True)
for name in ("v0", "v1"):
    session.OpenVolume({str(self.folder)!r} + "/" + name + ".mha")
session.Select(session.GetVolumeId(0))
session.BeginEdit("drag")
for step in range(1, 100000):
    session.TranslateSelection(0.25, 0, 0)
    print(step, time.time(), flush=True)
    time.sleep(0.01)
"""
        child = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True)
        steps = []
        while not steps or steps[-1][1] < steps[0][1] + 3.0:
            number, when = child.stdout.readline().split()
            steps.append((int(number), float(when)))
        folders = vtkStringArray()
        self.assertEqual(vtkUltrasoundAlignmentSession.GetAbandonedSessions(folders), 0, "it is alive")
        child.send_signal(signal.SIGKILL)
        child.wait()
        steps += [(int(number), float(when)) for number, when in (line.split() for line in child.stdout if line.endswith("\n"))]
        child.stdout.close()

        self.assertEqual(vtkUltrasoundAlignmentSession.GetAbandonedSessions(folders), 1)
        paths, labels = vtkStringArray(), vtkStringArray()
        count = vtkUltrasoundAlignmentSession.GetBackupsIn(folders.GetValue(0), paths, labels)
        self.assertEqual([labels.GetValue(i) for i in range(count)], ["drag", "Add v1", "Add v0"])
        session = self.session()
        self.assertTrue(session.OpenProject(paths.GetValue(0)), self.errors)
        self.assertTrue(session.GetModifiedSinceSave(), "it was never saved")
        self.assertEqual(session.GetProjectPath(), "")
        done = round(pose(session, session.GetVolumeId(0))[0, 3] / 0.25)
        lost = steps[-1][0] - done
        print(f"killed after {len(steps)} steps; {done} are there; lost {lost}")
        self.assertLessEqual(lost, 90, "a second of steps")
        self.assertTrue(session.DiscardBackups(folders.GetValue(0)))
        self.assertEqual(vtkUltrasoundAlignmentSession.GetAbandonedSessions(folders), 0)

    def run_and_kill(self, script):
        """Another process does it with `session` and `folder`, and is killed."""
        child = subprocess.Popen([sys.executable, "-c", f"""
import os, signal
from echorama import vtkUltrasoundAlignmentSession
folder, session = {str(self.folder)!r}, vtkUltrasoundAlignmentSession()
session.SetAutomaticBackups(True)
{script}
session.GetBackups(None) # waits for the disk
os.kill(os.getpid(), signal.SIGKILL)
"""])
        self.assertEqual(child.wait(), -signal.SIGKILL)

    def test_work_on_a_saved_project_survives_a_kill_and_is_offered(self):
        project = str(self.folder / "p.json")
        self.opened().SaveProject(project)
        fresh = self.session()
        fresh.SetAutomaticBackups(True)
        self.assertTrue(fresh.OpenProject(project))
        self.assertEqual((backups(fresh), fresh.GetLaterBackup()), ([], ""), "nothing was done")
        del fresh
        self.run_and_kill("""
session.OpenProject(folder + "/p.json")
session.SelectAll()
session.TranslateSelection(3, 0, 0)
""")
        for _ in range(2): # looking does not hide it
            session = self.session()
            session.SetAutomaticBackups(True)
            self.assertTrue(session.OpenProject(project))
            later = session.GetLaterBackup()
            self.assertEqual([path for path, _, _ in backups(session)], [later])
        self.assertTrue(session.RestoreBackup(later), self.errors)
        self.assertEqual(pose(session, session.GetVolumeId(1))[0, 3], 3)
        self.assertEqual(session.GetLaterBackup(), "", "it is here now")
        self.assertTrue(session.SaveProject(project))
        self.assertEqual(session.GetLaterBackup(), "")
        del session

        # Work that a person did not want is not offered, what was saved before stays.
        session = self.session()
        session.SetAutomaticBackups(True)
        session.OpenProject(project)
        count = len(backups(session))
        session.SelectAll()
        session.TranslateSelection(5, 0, 0)
        session.ForgetUnsavedWork()
        del session
        session = self.session()
        session.OpenProject(project)
        self.assertEqual((session.GetLaterBackup(), len(backups(session))), ("", count))
        session.SetAutomaticBackups(True)
        session.SelectAll()
        session.TranslateSelection(5, 0, 0)
        session.ForgetUnsavedWork()
        session.TranslateSelection(1, 0, 0) # the person went on
        del session
        session = self.session()
        session.OpenProject(project)
        self.assertNotEqual(session.GetLaterBackup(), "")

    def test_comment_and_truth_survive_a_kill_as_well(self):
        project, found = str(self.folder / "p.json"), vtkMatrix4x4()
        saved = self.opened()
        saved.WritePoses(str(self.folder / "truth.json"))
        saved.SaveProject(project)

        def restored():
            """What the next start has."""
            session = self.session()
            self.assertTrue(session.OpenProject(project))
            self.assertEqual((session.GetComment(), session.HasTruth()), ("", False))
            self.assertTrue(session.RestoreBackup(session.GetLaterBackup()), self.errors)
            self.assertEqual(session.GetLaterBackup(), "", "it is here now")
            self.assertTrue(session.GetModifiedSinceSave())
            return session

        self.run_and_kill("""
session.OpenProject(folder + "/p.json")
session.SetComment("x")
""")
        session = restored()
        self.assertEqual((session.GetComment(), session.HasTruth(), session.GetUndoCount()), ("x", False, 0))
        self.run_and_kill("""
session.OpenProject(folder + "/p.json")
session.ReadTruth(folder + "/truth.json")
""")
        session = restored()
        self.assertEqual((session.GetComment(), session.HasTruth()), ("", True))
        session = self.session()
        session.OpenProject(project)
        session.SetComment("y")
        one, two = ids(session)
        session.ReadTruth(str(self.folder / "truth.json"))
        session.SetTruth(one, shift(2))
        session.Select(one)
        session.TranslateSelection(1, 0, 0)
        self.assertTrue(session.BackUp())
        session = restored()
        one, two = ids(session)
        self.assertEqual((session.GetComment(), pose(session, one)[0, 3]), ("y", 1))
        self.assertEqual([(session.GetTruth(i, found), found.GetElement(0, 3)) for i in (one, two)], [(True, 2), (True, 0)])
        self.assertAlmostEqual(session.GetVolumeScore(two), 1, 12)
        session.Undo()
        self.assertEqual((session.GetComment(), pose(session, one)[0, 3]), ("y", 0))

        # A project that was opened with both makes no backup.
        session.SaveProject(project)
        count = len(backups(session))
        session = self.session()
        session.SetAutomaticBackups(True)
        self.assertTrue(session.OpenProject(project))
        self.assertEqual((session.HasTruth(), session.GetModifiedSinceSave(), len(backups(session))), (True, False, count))
        session.ClearTruth()
        session.SetComment("z")
        self.assertEqual([label for _, label, _ in backups(session)][:2], ["Change comment", "Change truth"])
        self.assertEqual(self.errors, [])

    def test_what_is_kept_of_a_session_that_was_never_saved(self):
        def left():
            folders = vtkStringArray()
            return [folders.GetValue(i) for i in range(vtkUltrasoundAlignmentSession.GetAbandonedSessions(folders))]

        paths = self.files(2)

        def begun():
            session = self.session()
            session.SetAutomaticBackups(True)
            for path in paths:
                session.OpenVolume(str(path))
            session.SelectAll()
            return session

        session = begun()
        self.assertEqual(len(backups(session)), 2)
        del session
        self.assertEqual(left(), [], "volumes were opened, and no more")
        session = begun()
        session.TranslateSelection(1, 0, 0)
        session.ForgetUnsavedWork()
        del session
        self.assertEqual(left(), [])
        session = begun()
        session.TranslateSelection(1, 0, 0)
        del session
        self.assertEqual(len(left()), 1)

        # Who opens it takes it over, history and all, and it is offered no more.
        old = left()[0]
        session = self.session()
        session.SetAutomaticBackups(True)
        newest = vtkStringArray()
        vtkUltrasoundAlignmentSession.GetBackupsIn(old, newest)
        self.assertTrue(session.OpenProject(newest.GetValue(0)), self.errors)
        self.assertEqual(left(), [])
        self.assertFalse(os.path.exists(old))
        self.assertEqual([label for _, label, _ in backups(session)], ["Open", "Move 2 volumes", "Add v1", "Add v0"])
        del session
        self.assertEqual(len(left()), 1, "it is still not saved")
        session = self.session()
        vtkUltrasoundAlignmentSession.GetBackupsIn(left()[0], newest)
        session.OpenProject(newest.GetValue(0))
        self.assertTrue(session.SaveProject(str(self.folder / "p.json")), self.errors)
        self.assertEqual(left(), [])
        self.assertEqual(len(backups(session)), 4)
        for path, _, _ in backups(session): # names count from the new folder
            self.assertEqual(json.loads(pathlib.Path(path).read_text())["volumes"][0]["file"], "../v0.mha")

    def test_a_project_is_opened_during_a_stroke(self):
        session = self.opened()
        project = str(self.folder / "p.json")
        session.SaveProject(project)
        self.assertTrue(session.BackUp())
        one = session.GetVolumeId(0)
        original = voxels(session.GetImage(one))
        for automatic in (False, True):
            session.SetAutomaticBackups(automatic)
            for path in (project, backups(session)[0][0]):
                one = session.GetVolumeId(0)
                middle = placement(session, one)[0]
                self.assertTrue(session.BeginStroke(one, "paint", 2.0, 255, 1.0, 1.0, False))
                self.assertTrue(session.ExtendStroke(*middle))
                self.refuses(session, "during an edit", session.RestoreBackup, path)
                self.assertTrue(session.OpenProject(path), self.errors)
                self.refuses(session, "no stroke", session.ExtendStroke, *middle)
                np.testing.assert_array_equal(voxels(session.GetImage(session.GetVolumeId(0))), original)
                session.BeginStroke(session.GetVolumeId(0), "paint", 2.0, 255, 1.0, 1.0, False)
                session.CancelEdit()
                self.assertTrue(session.OpenProject(project), self.errors)

    def test_restored_volumes_are_the_very_ones(self):
        places = [self.folder / name for name in ("one", "two", "three")]
        for i, place in enumerate(places):
            place.mkdir()
            write(volume(i), place / "scan.mha") # one name, one geometry
        session = self.session()
        for place in places[:2]:
            session.OpenVolume(str(place / "scan.mha"))
        one, two = ids(session)
        session.SetVolumeToWorld(two, shift(2))
        self.assertTrue(session.BackUp())
        backup = backups(session)[0][0]
        swapped = self.session()
        for place in (places[1], places[0]):
            swapped.OpenVolume(str(place / "scan.mha"))
        self.assertTrue(swapped.RestoreBackup(backup), self.errors)
        self.assertEqual([swapped.GetFile(i) for i in ids(swapped)], [str(place / "scan.mha") for place in places[:2]])
        np.testing.assert_array_equal(voxels(swapped.GetImage(ids(swapped)[0])), voxels(volume(0)))
        self.assertEqual(pose(swapped, ids(swapped)[1])[0, 3], 2)
        # Another file of the name is not taken for one that is there.
        other = self.session()
        other.OpenVolume(str(places[2] / "scan.mha"))
        self.assertTrue(other.RestoreBackup(backup), self.errors)
        self.assertEqual([other.GetFile(i) for i in ids(other)], [str(place / "scan.mha") for place in places[:2]])
        # Two that are gone are not one and the same.
        session.SaveProject(str(self.folder / "p.json"))
        backup = backups(session)[0][0]
        for place in places[:2]:
            (place / "scan.mha").unlink()
        third = self.session()
        third.AddSearchFolder(str(places[2]))
        self.refuses(third, ("two of its volumes", "scan.mha"), third.OpenProject, str(self.folder / "p.json"))
        third.OpenVolume(str(places[2] / "scan.mha"))
        self.refuses(third, ("two of its volumes", "scan.mha"), third.RestoreBackup, backup)

    def test_a_backup_with_a_volume_that_was_in_no_file(self):
        session = self.opened(1)
        session.AddVolume(volume(4), None, "of a pipeline")
        session.BackUp()
        backup = backups(session)[0][0]
        warnings = []
        other = self.session()

        def listen(_, __, text):
            warnings.append(text)

        listen.CallDataType = "string0"
        other.AddObserver("WarningEvent", listen)
        files = vtkStringArray()
        other.GetProjectFiles(backup, files)
        self.assertEqual(files.GetNumberOfValues(), 1)
        for call in (other.OpenProject, other.RestoreBackup):
            self.assertTrue(call(backup), self.errors)
            self.assertEqual([other.GetName(i) for i in ids(other)], ["v0"])
            self.assertIn("of a pipeline", warnings.pop())
        self.assertTrue(session.RestoreBackup(backup), "where it still is, it stays")
        self.assertEqual(session.GetNumberOfVolumes(), 2)

    def test_a_project_whose_folder_cannot_be_written(self):
        session = self.opened()
        session.SaveProject(str(self.folder / "p.json"))
        (self.folder / "p.backups").write_text("in the way, as a folder on a read-only disk")
        session.SelectAll()
        session.SetAutomaticBackups(True)
        session.TranslateSelection(1, 0, 0)
        self.assertEqual((len(backups(session)), self.errors), (1, []))
        self.assertIn(str(self.folder / "data" / "echorama" / "projects"), session.GetBackupFolder())
        del session
        again = self.session()
        again.OpenProject(str(self.folder / "p.json"))
        self.assertEqual([again.GetLaterBackup()], [path for path, _, _ in backups(again)])
        self.assertTrue(again.RestoreBackup(again.GetLaterBackup()), self.errors)
        self.assertEqual(pose(again, ids(again)[0])[0, 3], 1)

    def test_a_project_that_somebody_else_saves(self):
        project = self.folder / "p.json"
        session = self.opened()
        session.SaveProject(str(project))
        other = self.session()
        other.OpenProject(str(project))
        other.SelectAll()
        other.TranslateSelection(1, 0, 0)
        other.SaveProject(str(project))
        theirs = project.read_text()
        session.SelectAll()
        session.TranslateSelection(0, 2, 0)
        self.refuses(session, ("p.json", "changed"), session.SaveProject, str(project))
        self.assertEqual(project.read_text(), theirs)
        self.assertTrue(session.SaveProject(str(project)), "who insists may")
        self.assertTrue(session.SaveProject(str(project)))

    def test_a_volume_is_not_replaced_by_a_project(self):
        session = self.opened()
        write_protected = self.folder / "v0.mha"
        before = write_protected.read_bytes()
        os.symlink(write_protected, self.folder / "link.json")
        for path in (write_protected, self.folder / "link.json"):
            self.refuses(session, ("v0.mha", "stays"), session.SaveProject, str(path))
            self.refuses(session, ("v0.mha", "stays"), session.WritePoses, str(path))
        self.assertEqual(write_protected.read_bytes(), before)

    def test_names_count_from_where_a_linked_folder_really_is(self):
        session = self.opened()
        deep = self.folder / "a" / "b" / "c"
        deep.mkdir(parents=True)
        session.SaveProject(str(deep / "p.json"))
        session.WritePoses(str(deep / "poses.json"))
        data = json.loads((deep / "p.json").read_text())
        for each in data["volumes"]:
            each["path"] = ""
        (deep / "p.json").write_text(json.dumps(data))
        os.symlink(deep, self.folder / "link")
        for name in ("p.json", "poses.json"):
            again = self.session()
            self.assertTrue(again.OpenProject(str(self.folder / "link" / name)), self.errors)
        again.SelectAll()
        again.TranslateSelection(1, 0, 0)
        self.assertTrue(again.ReadPoses(str(self.folder / "link" / "poses.json")), self.errors)
        self.assertEqual(pose(again, ids(again)[0])[0, 3], 0)

    def test_who_ends_well_leaves_nothing_behind(self):
        session = self.opened()
        session.SetAutomaticBackups(True)
        session.BackUp()
        session.SaveProject(str(self.folder / "p.json"))
        session.SelectAll()
        session.TranslateSelection(1, 0, 0)
        del session
        self.assertEqual(vtkUltrasoundAlignmentSession.GetAbandonedSessions(None), 0)
        again = self.session()
        again.OpenProject(str(self.folder / "p.json"))
        self.assertEqual(backups(again)[0][1], "Move 2 volumes", "the newest is beside the project")
        self.assertEqual(pose(again, again.GetVolumeId(0))[0, 3], 0)
        self.assertTrue(again.RestoreBackup(backups(again)[0][0]))
        self.assertEqual(pose(again, again.GetVolumeId(0))[0, 3], 1)

    # -------------------------------------------------------------------------------------------------------------- truth

    def test_the_score_follows_the_poses(self):
        session = self.opened(3)
        one, two, three = ids(session)
        self.assertTrue(math.isnan(session.GetScore()))
        self.assertEqual(session.GetFixedVolume(), -1)
        truth = self.session()
        for i in range(2):
            truth.OpenVolume(str(self.folder / f"v{i}.mha"))
        truth.SetVolumeToWorld(truth.GetVolumeId(1), shift(4))
        truth.WritePoses(str(self.folder / "truth.json"))
        self.assertTrue(session.ReadTruth(str(self.folder / "truth.json")))
        self.assertTrue(session.HasTruth())
        self.assertEqual(session.GetFixedVolume(), one)
        self.assertAlmostEqual(session.GetScore(), 4.0, 12)
        self.assertAlmostEqual(session.GetVolumeScore(two), 4.0, 12)
        self.assertTrue(math.isnan(session.GetVolumeScore(three)))
        session.Select(two, True, True)
        session.BeginEdit("drag")
        for step in range(4):
            session.TranslateSelection(1, 0, 0)
            self.assertAlmostEqual(session.GetScore(), 3.0 - step, 12)
        session.EndEdit()
        session.RotateSelection(0, 0, 10)
        self.assertAlmostEqual(session.GetRotationError(two), 10, 9)
        vectors = vtkPolyData()
        session.GetErrorVectors(vectors, 100)
        self.assertEqual(vectors.GetNumberOfPoints(), 200)
        errors, of = (vtk_to_numpy(vectors.GetPointData().GetArray(name)) for name in ("Error", "Volume"))
        np.testing.assert_allclose(errors[of == one], 0, atol=1e-12)
        self.assertAlmostEqual(np.linalg.norm(errors[of == two], axis=1).mean(), session.GetScore(), delta=0.1 * session.GetScore())
        session.SetFixedVolume(two)
        self.assertEqual(session.GetFixedVolume(), two)
        self.assertAlmostEqual(session.GetVolumeScore(two), 0, 12)
        self.errors.clear()
        session.SetFixedVolume(three)
        self.assertIn("no truth", self.errors[0])
        session.SetTruth(three, shift(2))
        self.assertFalse(math.isnan(session.GetVolumeScore(three)))

        # Saved with the project; a volume that comes later is found in it.
        session.SaveProject(str(self.folder / "p.json"))
        again = self.session()
        self.assertTrue(again.OpenProject(str(self.folder / "p.json")))
        self.assertTrue(again.HasTruth())
        self.assertFalse(again.GetModifiedSinceSave())
        self.assertEqual(again.GetFixedVolume(), ids(again)[1])
        np.testing.assert_allclose([again.GetVolumeScore(i) for i in ids(again)], [session.GetVolumeScore(i) for i in ids(session)], atol=1e-9)
        for place, modified in ((0, True), (1, False)):
            again.SetFixedVolume(ids(again)[place])
            self.assertEqual(again.GetModifiedSinceSave(), modified)
        found = vtkMatrix4x4()
        self.assertTrue(again.GetTruth(ids(again)[2], found), "what was set by hand as well")
        self.assertEqual([found.GetElement(0, 3), again.GetTruth(ids(again)[0], found)], [2, True])
        again.SetTruth(ids(again)[2], shift(1))
        self.assertTrue(again.GetModifiedSinceSave())
        again.ClearTruth()
        self.assertTrue(math.isnan(again.GetScore()))
        (self.folder / "truth.json").rename(self.folder / "hidden")
        self.assertTrue(again.OpenProject(str(self.folder / "p.json")), "without the truth it opens all the same")
        self.assertFalse(again.GetModifiedSinceSave())
        self.assertEqual([again.GetTruth(i, found) for i in ids(again)], [False, False, True], "but for what was set by hand")
        again.SaveProject(str(self.folder / "p.json"))
        (self.folder / "hidden").rename(self.folder / "truth.json")
        again.OpenProject(str(self.folder / "p.json"))
        self.assertTrue(again.HasTruth(), "it was not forgotten")
        self.assertEqual(again.GetFixedVolume(), ids(again)[1], "nor this")
        again.SetFixedVolume(ids(again)[2])
        self.assertTrue(again.BackUp())
        again.OpenProject(str(self.folder / "p.json"))
        self.assertTrue(again.RestoreBackup(again.GetLaterBackup()), self.errors)
        self.assertEqual(again.GetFixedVolume(), ids(again)[2], "a backup brings it back, too")
        later = self.session()
        later.OpenVolume(str(self.folder / "v0.mha"))
        later.ReadTruth(str(self.folder / "truth.json"))
        self.assertTrue(math.isnan(later.GetScore()), "of one volume alone")
        later.OpenVolume(str(self.folder / "v1.mha"))
        self.assertAlmostEqual(later.GetScore(), 4.0, 12)

    # ------------------------------------------------------------------------------------------------------------- results

    def result(self, session, sources, value=100, name="result", **options):
        """What a filter would make: a volume of one grey level."""
        listed = vtkIntArray()
        for source in sources:
            listed.InsertNextValue(source)
        record = session.RecordSources(listed, json.dumps(options) if options else None)
        image = volume(3, (-5, 1, 2))
        image.GetPointData().GetArray("Intensity").Fill(value)
        return image, record

    def test_a_result_is_a_volume_that_knows_its_sources(self):
        session = self.opened(3)
        one, two, three = ids(session)
        image, record = self.result(session, [one, two], Method="membrane")
        result = session.AddResult(image, "whole", record)
        self.assertEqual([session.IsResult(i) for i in ids(session)], [False, False, False, True])
        self.assertEqual([session.GetSource(result, i) for i in range(-1, 3)], [0, one, two, 0])
        self.assertEqual((session.GetResultOption(result, "Method"), session.GetResultOption(result, "x")), ("membrane", ""))
        self.assertEqual(session.GetSourcesChanged(result), "")
        colours = []
        for i in ids(session):
            colours.append([0.0] * 3)
            session.GetColour(i, colours[-1])
        self.assertNotIn(colours[3], colours[:3], "a colour of its own")
        session.Select(one, True, True)
        session.TranslateSelection(1, 0, 0)
        self.assertEqual(session.GetSourcesChanged(result), "v0 was moved")
        session.RemoveVolume(two)
        self.assertEqual(session.GetSourcesChanged(result), "v0 was moved; v1 is gone")
        session.Undo()

        # Made again: other voxels in its place, what was painted on it still there; undone to the bit.
        session.SetColour(result, 1, 0, 0)
        at = placement(session, result)[0]
        session.BeginStroke(result, "paint", 3, 250, 1, 1, False)
        session.ExtendStroke(*at)
        session.EndStroke()
        painted = session.GetVoxelAt(result, at)
        before = voxels(session.GetImage(result)).copy()
        self.assertEqual((before[painted], before[-1]), (250, 100))
        other, record = self.result(session, [one, two], 60)
        told = []
        session.AddObserver(vtkUltrasoundAlignmentSession.VoxelsChangedEvent, lambda *_: told.append("voxels"))
        self.assertTrue(session.RemakeResult(result, other, record))
        self.assertTrue(told)
        self.assertEqual((voxels(session.GetImage(result))[painted], voxels(session.GetImage(result))[-1]), (250, 60))
        self.assertEqual(session.GetSourcesChanged(result), "")
        session.Undo()
        np.testing.assert_array_equal(voxels(session.GetImage(result)), before)
        self.assertEqual(session.GetSourcesChanged(result), "v0 was moved")
        session.Redo()
        self.assertEqual(voxels(session.GetImage(result))[-1], 60)
        colour = [0.0] * 3
        session.GetColour(result, colour)
        self.assertEqual(colour, [1, 0, 0])

        # What is given to a filter stays, and what is refused changes nothing.
        session.BeginStroke(result, "carve", 3, 0, 1, 1, False)
        self.refuses(session, "has not ended", session.RemakeResult, result, other, record)
        session.EndStroke()
        self.refuses(session, "not made of other volumes", session.RemakeResult, one, other, record)
        self.refuses(session, "no image", session.RemakeResult, result, None, record)
        self.refuses(session, "the record", session.AddResult, other, "x", "{}")
        self.refuses(session, "the record", session.AddResult, other, "x", None)
        listed = vtkIntArray()
        self.errors.clear()
        self.assertEqual(session.RecordSources(listed, None), "")
        self.assertIn("at least one source", self.errors[0])

    def test_a_result_is_saved_with_its_link(self):
        session = self.opened(2)
        one, two = ids(session)
        image, record = self.result(session, [one, two], 100, Method="membrane")
        result = session.AddResult(image, "whole", record)
        session.SelectAll()
        session.TranslateSelection(0, 4, 0)  # all together: that changes nothing
        at = placement(session, result)[0]
        session.BeginStroke(result, "paint", 3, 250, 1, 1, False)
        session.ExtendStroke(*at)
        session.EndStroke()
        seen = voxels(session.GetImage(result)).copy()
        project, file = str(self.folder / "p.json"), str(self.folder / "whole.mha")
        self.refuses(session, ("whole", "in no file"), session.SaveProject, project)
        self.assertTrue(session.WritePoses(str(self.folder / "poses.json")), "it is left out of poses")
        self.assertEqual(len(json.loads((self.folder / "poses.json").read_text())["volumes"]), 2)
        self.assertTrue(session.SaveProject(project, True))
        self.assertTrue(session.GetModifiedSinceSave(), "what was left out is not saved")
        self.assertEqual(len(json.loads((self.folder / "p.json").read_text())["volumes"]), 2)

        unpainted = vtkImageData()
        self.assertTrue(session.GetUnpainted(result, unpainted))
        self.assertTrue((voxels(unpainted) == 100).all())
        np.testing.assert_array_equal(voxels(session.GetImage(result)), seen)
        self.refuses(session, "no such file", session.SetFile, result, file)
        write(unpainted, file)
        self.refuses(session, "is the file of v0", session.SetFile, result, str(self.folder / "v0.mha"))
        entries = session.GetUndoCount()
        self.assertTrue(session.SetFile(result, file))
        self.assertEqual(session.GetUndoCount(), entries)
        self.assertTrue(session.SaveProject(project), self.errors)
        self.assertFalse(session.GetModifiedSinceSave())

        again = self.session()
        self.assertTrue(again.OpenProject(project), self.errors)
        whole = ids(again)[2]
        self.assertTrue(again.IsResult(whole))
        np.testing.assert_array_equal(voxels(again.GetImage(whole)), seen)
        self.assertEqual(again.GetSourcesChanged(whole), "")
        self.assertEqual(again.GetResultOption(whole, "Method"), "membrane")
        again.SetVolumeToWorld(ids(again)[0], shift(1))
        self.assertEqual(again.GetSourcesChanged(whole), "v0 was moved")

    # ------------------------------------------------------------------------------------------------------------ the page

    def test_the_example_of_the_page_runs(self):
        page = (source / "Documentation" / "session.md").read_text()
        example = re.search(r"```python\n(.*?)```", page, re.S)[1]
        liver = source.parent / "shared" / "data" / "liver"
        for name in ("A", "B"):
            if (liver / f"liver_volume_{name}.mha").exists():
                shutil.copy(liver / f"liver_volume_{name}.mha", self.folder)
            else:
                write(volume(ord(name)), self.folder / f"liver_volume_{name}.mha")
        answer = subprocess.run([sys.executable, "-c", example], cwd=self.folder, capture_output=True, text=True)
        print(answer.stdout, answer.stderr, sep="")
        self.assertEqual((answer.returncode, answer.stderr), (0, ""))
        self.assertTrue((self.folder / "liver.json").exists())
        self.assertGreater(len(answer.stdout.splitlines()), 3)


if __name__ == "__main__":
    unittest.main()
