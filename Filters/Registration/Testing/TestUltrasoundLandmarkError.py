# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped landmark error: lists from files and points, poses from matrices and from volumes, vectors, figures, messages."""
import math
import pathlib
import tempfile

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkDoubleArray
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonMath import vtkMatrix4x4

from echorama import vtkUltrasoundLandmarkError

work = tempfile.TemporaryDirectory()
folder = pathlib.Path(work.name)
PLACES = {"apex": (10.0, 0.0, 5.0), "fork": (-20.0, 15.0, 40.0), "cyst": (3.0, -7.0, 60.0)}


def errors_of(filter):
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    filter.AddObserver(vtkCommand.ErrorEvent, note)
    filter.Update()
    return "".join(messages)


def shifted(x, y, z):
    matrix = vtkMatrix4x4()
    for row, by in enumerate((x, y, z)):
        matrix.SetElement(row, 3, by)
    return matrix


def written(name, places):
    path = folder / name
    path.write_text("".join(f"{label},{x},{y},{z}\n" for label, (x, y, z) in places.items()))
    return str(path)


def image(pose=None):
    image = vtkImageData()
    image.SetDimensions(4, 4, 4)
    array = numpy_to_vtk(np.arange(64, dtype=np.uint8), deep=True)
    array.SetName("Intensity")
    image.GetPointData().SetScalars(array)
    if pose:
        rows = vtkDoubleArray()
        rows.SetName("VolumeToWorld")
        rows.SetNumberOfComponents(16)
        rows.InsertNextTuple([pose.GetElement(r, c) for r in range(4) for c in range(4)])
        image.GetFieldData().AddArray(rows)
    return image


# 1. files, and a pose by its matrix: 3 mm off
first, second = written("first.csv", {**PLACES, "only here": (0, 0, 0)}), written("second.csv", PLACES)
filter = vtkUltrasoundLandmarkError()
filter.AddLandmarkFile(first)
filter.AddLandmarkFile(second)
assert filter.SetPose(1, shifted(1, -2, 2))
filter.Update()
output = filter.GetOutput()
assert output.GetNumberOfPoints() == output.GetNumberOfVerts() == filter.GetNumberOfPairs() == 3
assert output.GetPointData().GetVectors().GetName() == "Error"
labels = [output.GetPointData().GetAbstractArray("Label").GetValue(i) for i in range(3)]
assert labels == list(PLACES)
for point, label in enumerate(labels):
    assert output.GetPoint(point) == PLACES[label]
    np.testing.assert_allclose(output.GetPointData().GetVectors().GetTuple3(point), (1, -2, 2), atol=1e-12)
np.testing.assert_allclose(vtk_to_numpy(output.GetPointData().GetArray("Distance")), 3, atol=1e-12)
assert set(vtk_to_numpy(output.GetPointData().GetArray("FirstVolume"))) == {0}
assert set(vtk_to_numpy(output.GetPointData().GetArray("SecondVolume"))) == {1}
for figure in ("Mean", "Rms", "Median", "Percentile95", "Max"):
    assert abs(getattr(filter, f"Get{figure}")() - 3) < 1e-12 and abs(output.GetFieldData().GetArray(figure).GetValue(0) - 3) < 1e-12
assert filter.GetNumberOfUnmatched() == 1
assert output.GetFieldData().GetAbstractArray("UnmatchedLabel").GetValue(0) == "only here"
assert output.GetFieldData().GetArray("UnmatchedVolume").GetValue(0) == 0

# 2. points beside the file, a third volume, and figures of different lengths
filter.ClearPoses()
for label in ("apex", "fork"):
    x, y, z = PLACES[label]
    filter.AddLandmark(2, label, x, y, z + (3 if label == "apex" else 4))
filter.Update()
assert filter.GetNumberOfPairs() == 7  # three of the first two, two of each of them and the third
assert abs(filter.GetMean() - 14 / 7) < 1e-12 and abs(filter.GetRms() - math.sqrt(50 / 7)) < 1e-12 and abs(filter.GetMax() - 4) < 1e-12
filter.ClearLandmarks()
filter.Update()
assert filter.GetNumberOfPairs() == 3 and filter.GetMax() < 1e-12

# 3. poses that an aligner left on its volumes; one without is where its file has it; a pose that is set goes before
filter.AddInputDataObject(0, image())
filter.AddInputDataObject(0, image(shifted(0, 0, 5)))
filter.Update()
assert abs(filter.GetMean() - 5) < 1e-12
np.testing.assert_allclose(filter.GetOutput().GetPointData().GetVectors().GetTuple3(1), (0, 0, 5), atol=1e-12)
filter.SetPose(1, shifted(0, 1, 0))
filter.Update()
assert abs(filter.GetMean() - 1) < 1e-12

# 4. displacements: what they say is taken back where the pose has put the landmarks
def displacement(x, y, z):
    image = vtkImageData()
    image.SetDimensions(24, 24, 24)  # so wide that its border, where it fades, is far
    image.SetOrigin(-345.0, -345.0, -345.0)
    image.SetSpacing(30.0, 30.0, 30.0)
    array = numpy_to_vtk(np.tile([float(x), float(y), float(z)], (24**3, 1)), deep=True)
    array.SetName("Displacement")
    image.GetPointData().AddArray(array)
    return image


bent = vtkUltrasoundLandmarkError()
for file in (first, second):
    bent.AddLandmarkFile(file)
bent.SetPose(1, shifted(1, -2, 2))
bent.AddDisplacementData(displacement(0, 0, 0))
bent.AddDisplacementData(displacement(1, -2, 2))
bent.Update()
assert bent.GetNumberOfPairs() == 3 and bent.GetMax() < 1e-4, bent.GetMax()
bent.AddDisplacementData(displacement(0, 0, 0))
assert "3 displacements came in for 2 volumes" in errors_of(bent)
bent.RemoveAllDisplacements()
bent.Update()
assert abs(bent.GetMean() - 3) < 1e-12

# 5. messages
filter.AddLandmark(2, "apex", 0, 0, 0)
assert "landmarks of volume 2, counted from 0, and there are 2 volumes" in errors_of(filter)
assert filter.GetNumberOfPairs() == 0 and filter.GetOutput().GetNumberOfPoints() == 0
filter.ClearLandmarks()
filter.AddLandmark(-1, "apex", 0, 0, 0)
assert "landmarks of volume -1" in errors_of(filter)
filter.ClearLandmarks()
filter.AddLandmark(1, "apex", 0, 0, 0)
assert 'two landmarks have the label "apex"' in errors_of(filter)
filter.ClearLandmarks()
filter.ClearLandmarkFiles()
filter.AddLandmarkFile(str(folder / "missing.csv"))
assert "missing.csv" in errors_of(filter)
alone = vtkUltrasoundLandmarkError()
assert "at least two" in errors_of(alone)
alone.AddLandmark(0, "a", 0, 0, 0)
alone.AddLandmark(1, "b", 0, 0, 0)
assert "no label" in errors_of(alone)
bad = vtkMatrix4x4()
bad.SetElement(0, 0, 2)
alone.AddObserver(vtkCommand.ErrorEvent, lambda *_: None)
assert not alone.SetPose(0, bad)
