#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Poses edited in a pipeline: what is moved, where to, that no voxel is copied, and the score against the truth."""
import math

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkDoubleArray
from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet, vtkImageData, vtkMultiBlockDataSet
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkCommonTransforms import vtkTransform

from echorama import vtkUltrasoundAlignmentScore, vtkUltrasoundPoseEditor

SIZE = (9, 11, 13)


def volume(origin):
    image = vtkImageData()
    image.SetDimensions(SIZE)
    image.SetOrigin(origin)
    image.SetSpacing(1.0, 2.0, 0.5)
    grey = np.arange(np.prod(SIZE), dtype=np.uint8)
    for name, values in (("Intensity", grey), ("ValidRegion", (grey % 5 > 0).astype(np.uint8))):
        array = numpy_to_vtk(values, deep=True)
        array.SetName(name)
        image.GetPointData().AddArray(array)
    probe = vtkDoubleArray()
    probe.SetName("ProbeToWorld")
    probe.SetNumberOfComponents(16)
    probe.InsertNextTuple(np.eye(4).ravel())
    image.GetFieldData().AddArray(probe)
    return image


def numbers(matrix):
    return np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])


def place(image):
    """From indices to the world, as a 4x4 matrix."""
    matrix = np.eye(4)
    direction = image.GetDirectionMatrix()
    matrix[:3, :3] = np.array([[direction.GetElement(i, j) for j in range(3)] for i in range(3)]) * image.GetSpacing()
    matrix[:3, 3] = image.GetOrigin()
    return matrix


def field(data, name):
    return vtk_to_numpy(data.GetFieldData().GetArray(name))


def editor_of(*volumes, truth=()):
    editor = vtkUltrasoundPoseEditor()
    editor.messages = []

    def note(caller, event, text):
        editor.messages.append(text)

    note.CallDataType = "string0"
    for each in (editor, editor.GetExecutive()):
        each.AddObserver(vtkCommand.ErrorEvent, note)
    for image in volumes:
        editor.AddInputDataObject(0, image)
    for image in truth:
        editor.AddTruthData(image)
    return editor


def motion_of(editor):
    matrix = vtkMatrix4x4()
    editor.GetMotion(matrix)
    return numbers(matrix)


a, b, c = volume((0, 0, 0)), volume((10, 0, 0)), volume((0, 20, 5))

# The numbers mean what vtkProp3D, and so ParaView's box, means by them.
editor = editor_of(a, b, c)
editor.SetTranslation(3.0, -4.0, 5.0)
editor.SetRotation(10.0, 20.0, 30.0)
editor.Update()
outside = vtkTransform()
outside.Translate(3.0, -4.0, 5.0)
outside.RotateZ(30.0)
outside.RotateX(10.0)
outside.RotateY(20.0)
expected = numbers(outside.GetMatrix())
assert not editor.messages, editor.messages
assert np.allclose(motion_of(editor), expected, atol=1e-12)
output = editor.GetOutput()
assert output.GetNumberOfBlocks() == 3
for index, (image, motion) in enumerate(((a, np.eye(4)), (b, expected), (c, expected))):  # all but the fixed one
    block = output.GetBlock(index)
    assert np.allclose(place(block), motion @ place(image), atol=1e-12), index
    assert block.GetPointData().GetArray("Intensity") is image.GetPointData().GetArray("Intensity"), "a voxel was copied"
    assert np.allclose(field(block, "ProbeToWorld").reshape(4, 4), motion, atol=1e-12)
    assert np.allclose(field(block, "VolumeToWorld").reshape(4, 4), motion, atol=1e-12)
    assert np.array_equal(field(image, "ProbeToWorld").reshape(4, 4), np.eye(4)), "the input was modified"
assert math.isnan(editor.GetScore()) and output.GetFieldData().GetArray("Score") is None

# Chosen volumes, about the middle of them, and a given centre.
editor.AddVolume(1)
editor.SetTranslation(0.0, 0.0, 0.0)
editor.SetRotation(0.0, 0.0, 90.0)
editor.SetRotateAbout(editor.MIDDLE)
editor.Update()
middle = place(b) @ [4, 5, 6, 1]
assert np.array_equal(motion_of(editor)[:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]]), "a quarter turn is exact"
assert np.allclose(motion_of(editor) @ middle, middle, atol=1e-12)
assert np.allclose(place(editor.GetOutput().GetBlock(2)), place(c))
assert np.allclose(place(editor.GetOutput().GetBlock(1)) @ [4, 5, 6, 1], middle, atol=1e-12)
editor.SetRotateAbout(editor.CENTRE)
editor.SetCentre(7.0, 8.0, 9.0)
editor.Update()
assert np.allclose(motion_of(editor) @ [7, 8, 9, 1], [7, 8, 9, 1], atol=1e-12)

# One after the other: VolumeToWorld is the whole way. The only volume is moved; blocks keep their names and trees are looked through.
inner, outer = vtkMultiBlockDataSet(), vtkMultiBlockDataSet()
inner.SetBlock(0, b)
inner.GetMetaData(0).Set(vtkCompositeDataSet.NAME(), "liver")
outer.SetBlock(2, inner)
first, second = editor_of(outer), editor_of()
first.SetTranslation(1.0, 0.0, 0.0)
second.SetInputConnection(first.GetOutputPort())
second.SetRotation(0.0, 0.0, 180.0)
second.Update()
block = second.GetOutput().GetBlock(0)
assert second.GetOutput().GetMetaData(0).Get(vtkCompositeDataSet.NAME()) == "liver"
turned = np.diag([-1.0, -1.0, 1.0, 1.0])
turned[0, 3] = -1.0
assert np.allclose(field(block, "VolumeToWorld").reshape(4, 4), turned, atol=1e-12)
assert np.allclose(place(block), turned @ place(b), atol=1e-12)

# The score: a translation by d scores |d|, the truth as a whole may lie anywhere, and it is that of the score filter.
editor = editor_of(a, b, truth=(volume((100, 0, 0)), volume((110, 0, 0))))
editor.Update()
assert editor.GetScore() < 1e-12
editor.SetTranslation(3.0, 4.0, 0.0)
editor.Update()
assert abs(editor.GetScore() - 5.0) < 1e-12 and abs(field(editor.GetOutput(), "Score")[0] - 5.0) < 1e-12
assert np.allclose(field(editor.GetOutput(), "VolumeScore"), [0, 5])
editor.SetRotation(4.0, 5.0, 6.0)
editor.Update()
score = vtkUltrasoundAlignmentScore()
score.SetInputConnection(editor.GetOutputPort())
score.AddTruthData(a)
score.AddTruthData(b)
score.Update()
assert abs(score.GetScore() - editor.GetScore()) < 1e-12, "points that are kept are the points that would be drawn"
# Other voxels are other points.
a.GetPointData().GetArray("ValidRegion").SetValue(7, 0)
a.GetPointData().GetArray("ValidRegion").Modified()
a.Modified()
editor.Update()
score.Update()
assert abs(score.GetScore() - editor.GetScore()) < 1e-12 and not editor.messages

# The box of those that are moved, where the input has them: before it has run, whatever they are moved by; turned volumes, too.
editor = editor_of(a, b, c)
assert editor.GetBoxBounds() == (0, 1, 0, 1, 0, 1)
editor.SetTranslation(50.0, 0.0, 0.0)
editor.UpdateInformation()
assert editor.GetBoxBounds() == (0, 18, 0, 40, 0, 11), editor.GetBoxBounds()
for chosen, box in ((2, (0, 8, 20, 40, 5, 11)), (1, (10, 18, 0, 20, 0, 6)), (0, (0, 8, 0, 20, 0, 6))):
    editor.ClearVolumes()
    editor.AddVolume(chosen)
    editor.Update()
    assert editor.GetBoxBounds() == box, (chosen, editor.GetBoxBounds())
turned = editor_of(a)
turned.SetRotation(0, 0, 90)
turned.Update()
editor = editor_of(turned.GetOutput(), b)
editor.AddVolume(0)
editor.Update()
assert np.allclose(editor.GetBoxBounds(), (-20, 0, 0, 8, 0, 6), atol=1e-9), editor.GetBoxBounds()

# What is not there is said, and nothing half-made is put out.
for spoil, words in ((lambda e: e.AddVolume(2), "no volume 2"), (lambda e: e.SetTranslation(math.nan, 0, 0), "Translation is (nan 0 0) mm; it must be finite"),
                     (lambda e: e.AddTruthData(c), "3 true ones"), (lambda e: e.RemoveAllTruths(), None)):
    editor = editor_of(a, b, truth=(a, b))
    spoil(editor)
    editor.Update()
    text = " ".join(editor.messages)
    if words:
        assert words in text, text
        assert editor.GetOutput().GetNumberOfBlocks() == 0 and math.isnan(editor.GetScore())
    else:
        assert not text and editor.GetOutput().GetNumberOfBlocks() == 2
editor = editor_of(a, truth=(a,))
editor.Update()
assert "two" in " ".join(editor.messages), editor.messages
print("poses are edited as told")
