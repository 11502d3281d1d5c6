#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped landmarks: they travel with the volume, through the pose editor and the aligner, and both who use them find them."""
import math

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkDoubleArray
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonMath import vtkMatrix4x4

from echorama import vtkUltrasoundAligner, vtkUltrasoundLandmarkError, vtkUltrasoundLandmarks, vtkUltrasoundPoseEditor, vtkUltrasoundVolume

PLACES = [(10.0, 4.0, 5.0), (-3.0, 15.0, 14.0), (3.0, -7.0, 20.0)]


def volume(origin=(0, 0, 0), seed=0):
    image = vtkImageData()
    image.SetDimensions(24, 24, 24)
    image.SetOrigin(origin)
    array = numpy_to_vtk(np.random.default_rng(seed).integers(0, 255, 24**3).astype(np.uint8), deep=True)
    array.SetName("Intensity")
    image.GetPointData().SetScalars(array)
    return image


def watched(filter):
    filter.messages = []

    def note(caller, event, text):
        filter.messages.append(text)

    note.CallDataType = "string0"
    filter.AddObserver(vtkCommand.ErrorEvent, note)
    return filter


def marked(image, places, labels=()):
    filter = watched(vtkUltrasoundLandmarks())
    filter.SetInputData(image)
    for place in places:
        filter.AddPoint(*place)
    for label in labels:
        filter.AddLabel(label)
    filter.Update()
    return filter


def landmarks(image):
    places, labels = image.GetFieldData().GetArray("Landmarks"), image.GetFieldData().GetAbstractArray("LandmarkLabels")
    return {labels.GetValue(i): places.GetTuple(i) for i in range(labels.GetNumberOfValues())}


def errors_of(filter):
    filter.Update()
    return " ".join(filter.messages)


# 1. fields with labels; voxels are shared, the input has none of it
given = volume()
filter = marked(given, PLACES, ["apex", "fork"])
assert landmarks(filter.GetOutput()) == {"apex": PLACES[0], "fork": PLACES[1], "3": PLACES[2]}, "without a label: its number"
assert given.GetFieldData().GetNumberOfArrays() == 0
assert filter.GetOutput().GetPointData().GetScalars() is given.GetPointData().GetScalars()

# 2. one step after the other: more of them, and one that is given anew
again = marked(filter.GetOutput(), [(1, 1, 1), (2, 2, 2)], ["fork", "new"])
assert landmarks(again.GetOutput()) == {"apex": PLACES[0], "3": PLACES[2], "fork": (1, 1, 1), "new": (2, 2, 2)}
filter.ClearPoints()
filter.ClearLabels()
filter.Update()
assert landmarks(filter.GetOutput()) == {}

# 3. they go where the volume goes, and what came in stays
source = marked(given, PLACES, ["apex", "fork"])
editor = vtkUltrasoundPoseEditor()
editor.SetInputConnection(source.GetOutputPort())
editor.SetTranslation(5, -3, 2)
editor.SetRotation(0, 0, 90)
editor.Update()
moved = landmarks(editor.GetOutput().GetBlock(0))
for (x, y, z), label in zip(PLACES, ("apex", "fork", "3")):
    assert np.allclose(moved[label], (5 - y, x - 3, z + 2), atol=1e-9), (label, moved[label])
assert landmarks(source.GetOutput())["apex"] == PLACES[0]

# 4. the landmark error of volumes that carry them: one is 3 mm off; told where the alignment puts them, whatever moved the volumes
other = marked(volume((40, 0, 0), 1), [(x + 1, y - 2, z + 2) for x, y, z in PLACES], ["apex", "fork"])
error = watched(vtkUltrasoundLandmarkError())
error.AddInputConnection(0, source.GetOutputPort())
error.AddInputConnection(0, other.GetOutputPort())
assert errors_of(error) == "" and error.GetNumberOfPairs() == 3 and math.isclose(error.GetMax(), 3.0) and math.isclose(error.GetMean(), 3.0)
both = vtkUltrasoundPoseEditor()
both.AddInputConnection(0, source.GetOutputPort())
both.AddInputConnection(0, other.GetOutputPort())
both.AddVolume(1)
both.SetTranslation(-1, 2, -2)
both.Update()
error.RemoveAllInputConnections(0)
error.AddInputConnection(0, both.GetOutputPort())
assert errors_of(error) == "" and error.GetMax() < 1e-9
assert np.allclose(error.GetOutput().GetPoint(0), PLACES[0], atol=1e-9)
pose = vtkMatrix4x4()
pose.SetElement(0, 3, 4.0)
assert error.SetPose(1, pose) # from where the file has it: 5, -2, 2 away
assert errors_of(error) == "" and math.isclose(error.GetMean(), math.sqrt(33))

# 5. the aligner believes them: volumes of noise, which images cannot align, are told apart by whether their landmarks can be joined
aligner = watched(vtkUltrasoundAligner())
aligner.SetStart("tracked")
aligner.SetPoints(1000)
aligner.AddInputConnection(0, source.GetOutputPort())
far = marked(volume((40, 0, 0), 1), [PLACES[0], (60, 60, 60), PLACES[2]], ["apex", "fork"]) # no rigid motion joins these
aligner.AddInputConnection(0, far.GetOutputPort())
assert errors_of(aligner) == ""
reason = aligner.GetOutput().GetBlock(1).GetFieldData().GetAbstractArray("AlignmentReason").GetValue(0)
assert "landmark" in reason and "fork" in reason, reason

# 6. what is refused is said
for places, labels, said in ((PLACES, ["a", "b", "c", "d"], "4 labels"), (PLACES, ["a", ""], "empty label"), (PLACES, ["a", "a"], "called a"),
                             (PLACES, ["3"], "called 3"), ([(math.nan, 0, 0)], ["a"], "not finite")):
    bad = marked(given, places, labels)
    assert said in " ".join(bad.messages) and bad.GetOutput().GetNumberOfPoints() == 0, (said, bad.messages)
spoiled = vtkImageData()
spoiled.ShallowCopy(source.GetOutput())
lone = vtkDoubleArray()
lone.SetName("Landmarks")
lone.SetNumberOfComponents(3)
lone.InsertNextTuple((1, 2, 3))
spoiled.GetFieldData().AddArray(lone) # one place, three labels
assert "LandmarkLabels" in " ".join(marked(spoiled, PLACES).messages)
error = watched(vtkUltrasoundLandmarkError())
error.AddInputDataObject(0, spoiled)
error.AddInputConnection(0, other.GetOutputPort())
assert "LandmarkLabels" in errors_of(error)
