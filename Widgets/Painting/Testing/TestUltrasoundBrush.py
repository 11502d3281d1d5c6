#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped brush: the voxels under the stroke change as the formula says, and no others; the same as in an alignment session."""
import math

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkImageData, vtkPolyData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkCommonTransforms import vtkTransform

from echorama import vtkUltrasoundAlignmentSession, vtkUltrasoundBrush, vtkUltrasoundPoseEditor, vtkUltrasoundVolume

SIZE = (30, 26, 22)
c, s = math.cos(0.3), math.sin(0.3)


def volume(dtype=np.uint8, valid=True):
    image = vtkImageData()
    image.SetDimensions(SIZE)
    image.SetSpacing(0.9, 1.1, 1.3)
    image.SetOrigin(3, -7, 11)
    image.SetDirectionMatrix([0, -1, 0, c, 0, s, -s, 0, c])
    values = np.random.default_rng(1).integers(20, 200, np.prod(SIZE)).astype(dtype)
    arrays = [("Intensity", values)]
    if valid:
        arrays.append(("ValidRegion", (np.arange(len(values)) % SIZE[0] > 8).astype(np.uint8)))
    for name, array in arrays:
        data = numpy_to_vtk(array, deep=True)
        data.SetName(name)
        image.GetPointData().AddArray(data)
    image.GetPointData().SetActiveScalars("Intensity")
    return image


def voxels(image, name="Intensity"):
    return vtk_to_numpy(image.GetPointData().GetArray(name)).copy()


def places(image):
    return np.array([image.GetPoint(i) for i in range(image.GetNumberOfPoints())])


def distances(points, path):
    """Of each point from a path of straight lines."""
    least = np.linalg.norm(points - path[0], axis=1)
    for a, b in zip(path[:-1], path[1:]):
        t = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        least = np.minimum(least, np.linalg.norm(points - a - t[:, None] * (b - a), axis=1))
    return least


def brush_on(image, path=(), **settings):
    brush = vtkUltrasoundBrush()
    brush.messages = []

    def note(caller, event, text):
        brush.messages.append(text)

    note.CallDataType = "string0"
    brush.AddObserver(vtkCommand.ErrorEvent, note)
    brush.SetInputData(image)
    for point in path:
        brush.AddPoint(*point)
    for name, value in settings.items():
        assert brush.SetParameterAsText(name, str(value)), name
    brush.Update()
    return brush


def result(image, path=(), **settings):
    brush = brush_on(image, path, **settings)
    assert not brush.messages, brush.messages
    return brush.GetOutput()


for dtype in (np.uint8, np.float32):
    image = volume(dtype)
    before, valid, points = voxels(image), voxels(image, "ValidRegion"), places(image)
    path = np.array([image.GetPoint(int(np.ravel_multi_index(k, SIZE[::-1]))) for k in ((5, 8, 4), (12, 15, 14), (15, 9, 25))])
    d = distances(points, path)

    # 1. painted hard: what is under the ball, and no other voxel
    painted = result(image, path, RadiusMm=3.0, Intensity=250.0, Hardness=1.0, Opacity=1.0)
    under, clear = (d <= 3.0 - 1e-4) & (valid == 1), (d > 3.0 + 1e-4) | (valid == 0)
    assert under.sum() > 300 and ((d < 3) & (valid == 0)).sum() > 50
    after = voxels(painted)
    assert (after[under] == 250).all() and np.array_equal(after[clear], before[clear])
    assert np.array_equal(voxels(painted, "ValidRegion"), valid)
    assert np.array_equal(voxels(image), before), "the input is as it was"
    assert np.allclose(places(painted), points, atol=1e-9)

    # 2. half covering, soft: the formula of the page
    soft = voxels(result(image, path, RadiusMm=4.0, Intensity=10.0, Hardness=0.25, Opacity=0.6)).astype(float)
    fall = np.clip((d - 1.0) / 3.0, 0, 1)
    weight = 0.6 * (1 - fall**2 * (3 - 2 * fall)) * (valid == 1)
    expected = before + weight * (10.0 - before)
    assert np.abs(soft - expected).max() < (0.51 if dtype == np.uint8 else 1e-3), np.abs(soft - expected).max()

    # 3. beyond what is real: what is painted becomes real
    wide = result(image, path, RadiusMm=3.0, Intensity=250.0, Hardness=1.0, InsideValid="off")
    inside, outside = d <= 3.0 - 1e-4, d > 3.0 + 1e-4
    assert (voxels(wide)[inside] == 250).all() and (voxels(wide, "ValidRegion")[inside] == 1).all()
    assert np.array_equal(voxels(wide, "ValidRegion")[outside], valid[outside]) and np.array_equal(voxels(wide)[outside], before[outside])

    # 4. carved: out of the valid region, intensities stay
    carved = result(image, path, RadiusMm=3.0, Mode="carve")
    gone = voxels(carved, "ValidRegion")
    assert (gone[inside] == 0).all() and np.array_equal(gone[outside], valid[outside]) and np.array_equal(voxels(carved), before)

    # 5. the very stroke of a session
    session = vtkUltrasoundAlignmentSession()
    one = session.AddVolume(image, None)
    assert session.BeginStroke(one, "paint", 4.0, 10.0, 0.6, 0.25, True)
    for point in path:
        assert session.ExtendStroke(*point)
    assert session.EndStroke()
    snapshot = vtkImageData()
    assert session.GetSnapshot(one, snapshot)
    ours = result(image, path, RadiusMm=4.0, Intensity=10.0, Hardness=0.25, Opacity=0.6)
    for name in ("Intensity", "ValidRegion"):
        assert np.array_equal(voxels(ours, name), voxels(snapshot, name)), name

# 6. undone: the point taken away, the filter is as if it were not there; changed points are followed
brush = brush_on(image, path, Intensity=250.0)
assert not np.array_equal(voxels(brush.GetOutput()), before)
brush.ClearPoints()
brush.Update()
assert np.array_equal(voxels(brush.GetOutput()), before) and np.array_equal(voxels(brush.GetOutput(), "ValidRegion"), valid)
brush.AddPoint(*path[1])
brush.SetHardness(1.0)
brush.Update()
dab = distances(points, path[1:2])
assert np.array_equal(voxels(brush.GetOutput()) == 250, (dab <= 3.0) & (valid == 1))

# 7. strokes of the pipeline: each line one, each vertex one; the brush's own points do not count
lines, corners = vtkCellArray(), vtkPoints()
vertices = vtkCellArray()
for point in (path[0], path[1], path[1], path[2], path[0] + [0, 0, 9]):
    corners.InsertNextPoint(point)
for ids in ((0, 1), (2, 3)):
    lines.InsertNextCell(2)
    for i in ids:
        lines.InsertCellPoint(i)
vertices.InsertNextCell(1)
vertices.InsertCellPoint(4)
strokes = vtkPolyData()
strokes.SetPoints(corners)
strokes.SetLines(lines)
strokes.SetVerts(vertices)
brush = brush_on(image)
brush.AddPoint(*(path[0] + [9, 9, 9]))
brush.SetIntensity(10.0)
brush.SetOpacity(0.5)
brush.SetHardness(1.0)
brush.SetPathData(strokes)
brush.Update()
by_hand = image
for part in (path[:2], path[1:], [path[0] + [0, 0, 9]]):
    by_hand = result(by_hand, np.array(part), Intensity=10.0, Opacity=0.5, Hardness=1.0)
assert np.array_equal(voxels(brush.GetOutput()), voxels(by_hand))
crossing = (distances(points, path[1:2]) < 2.9) & (valid == 1)
assert np.allclose(voxels(brush.GetOutput())[crossing], before[crossing] * 0.25 + 7.5), "two strokes cross there"
brush.RemovePath()
brush.Update()
assert not np.array_equal(voxels(brush.GetOutput()), voxels(by_hand)), "without them its own points count again"

# 8. strokes go where the volume goes
turn = vtkTransform()
turn.Translate(5, -3, 2)
turn.RotateWXYZ(40, 1, 2, 3)
editor = vtkUltrasoundPoseEditor()
editor.SetInputConnection(brush_on(image, path, Intensity=250.0).GetOutputPort())
editor.SetTranslation(5, -3, 2)
editor.SetRotation(10, 20, 30)
editor.Update()
moved = editor.GetOutput().GetBlock(0)
assert np.array_equal(voxels(moved), voxels(result(image, path, Intensity=250.0))) and not np.allclose(places(moved), points)

# 9. a volume without a valid region gets one when it is carved
whole = volume(valid=False)
carved = result(whole, path, Mode="carve")
assert np.array_equal(voxels(carved, "ValidRegion") == 0, d <= 3.0)

# 10. what is refused is said; the next good one works
for path_, settings, said in (([[math.nan, 0, 0]], {}, "finite"), (path, {"RadiusMm": 0.0}, "RadiusMm"), (path, {"Opacity": 2.0}, "Opacity"),
                              ([], {"Hardness": -1.0}, "Hardness")):
    bad = brush_on(image, path_, **settings)
    assert any(said in message for message in bad.messages), (said, bad.messages)
    assert bad.GetOutput().GetNumberOfPoints() == 0
assert not vtkUltrasoundBrush().SetParameterAsText("Mode", "restore"), "there is nothing to restore: the filter is taken away"
