# SPDX-License-Identifier: BSD-3-Clause
"""Painting, carving and landmarks in ParaView: what the properties and their handles do to the voxels, and that it is undone.

Usage: pvbatch TestPainting.py
"""
import os

import numpy
from paraview import servermanager
from paraview.simple import *
from vtkmodules.util.numpy_support import vtk_to_numpy

LoadPlugin(os.environ["ECHORAMA_PLUGIN"], remote=False, ns=globals())

volume = UltrasoundPhantom(SpacingMm=3.0, Orientation=[10.0, 20.0, 30.0])
volume.UpdatePipeline()
image = servermanager.Fetch(volume)
points = numpy.array([image.GetPoint(i) for i in range(image.GetNumberOfPoints())])
voxels = lambda source, name="Intensity": vtk_to_numpy(servermanager.Fetch(source).GetPointData().GetArray(name)).copy()
grey, valid = voxels(volume), voxels(volume, "ValidRegion")
middle = numpy.array(volume.GetDataInformation().GetBounds()).reshape(3, 2).mean(1)


def distances(path):
    least = numpy.linalg.norm(points - path[0], axis=1)
    for a, b in zip(path[:-1], path[1:]):
        t = numpy.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
        least = numpy.minimum(least, numpy.linalg.norm(points - a - t[:, None] * (b - a), axis=1))
    return least


def handles_of(proxy, name):
    """The widget that the panel makes of a group of properties."""
    groups = [proxy.SMProxy.GetPropertyGroup(i) for i in range(proxy.SMProxy.GetNumberOfPropertyGroups())]
    group = next(each for each in groups if each.GetPanelWidget() == f"Interactive{name}")
    widget = servermanager.ProxyManager().SMProxyManager.NewProxy("representations", f"{name}WidgetRepresentation")
    widget.LinkProperties(proxy.SMProxy, group)
    widget.UpdateVTKObjects()
    return widget


def dragged(widget, proxy, name):
    """What the widget tells ParaView when its handles have been dragged to where they are now, and what Apply makes of it."""
    widget.GetClientSideObject().GetWidget().InvokeEvent("InteractionEvent")
    changed = proxy.SMProxy.GetProperty(name)
    changed.SetElements([changed.GetUncheckedElement(i) for i in range(changed.GetNumberOfUncheckedElements())])
    proxy.SMProxy.UpdateVTKObjects()


def check_stroke(brush, path, radius):
    d = distances(path)
    inside, outside = (d < radius - 1e-3) & (valid == 1), (d > radius + 1e-3) | (valid == 0)
    assert inside.sum() > 50, inside.sum()
    after = voxels(brush)
    assert (after[inside] == 250).all(), "under the stroke"
    assert numpy.array_equal(after[outside], grey[outside]), "elsewhere"
    assert numpy.array_equal(voxels(brush, "ValidRegion"), valid)


# A new brush has one handle, in the middle of the volume. More of them come from the panel, and are dragged.
brush = UltrasoundBrush(Input=volume, RadiusMm=8.0, Intensity=250.0, Hardness=1.0)
assert numpy.allclose(brush.Points, middle), (brush.Points, middle)
handles = handles_of(brush, "PolyLine")
line = handles.GetClientSideObject().GetRepresentation()
assert line.GetNumberOfHandles() == 1
check_stroke(brush, middle[None], 8.0)
path = middle + numpy.array([[-20, 0, -10], [0, 10, 10], [25, -5, 0]])
brush.Points = (path + [[0, 0, 0], [0, -20, 5], [0, 0, 0]]).ravel().tolist()
handles.UpdateVTKObjects()
assert line.GetNumberOfHandles() == 3
line.SetHandlePosition(1, path[1])
dragged(handles, brush, "Points")
assert numpy.allclose(brush.Points, path.ravel()), (brush.Points, path)
check_stroke(brush, path, 8.0)
brush.Points = path[:2].ravel().tolist()
handles.UpdateVTKObjects()
assert line.GetNumberOfHandles() == 2, "a point that is taken away in the panel"
check_stroke(brush, path[:2], 8.0)

# Carving; and without points nothing is painted.
brush.Mode = "Carve"
d = distances(path[:2])
gone = voxels(brush, "ValidRegion")
assert (gone[d < 7.99] == 0).all() and numpy.array_equal(gone[d > 8.01], valid[d > 8.01]) and numpy.array_equal(voxels(brush), grey)
brush.Points = []
assert numpy.array_equal(voxels(brush, "ValidRegion"), valid)

# Lines of the pipeline: a spline with handles of its own. Taken away, the brush's points count again.
spline = SplineSource()
spline.ParametricFunction.Points = path.ravel().tolist()
brush.Mode, brush.Path, brush.Points = "Paint", spline, (middle + [0, 0, 30]).tolist()
spline.UpdatePipeline()
curve = servermanager.Fetch(spline)
check_stroke(brush, numpy.array([curve.GetPoint(i) for i in range(curve.GetNumberOfPoints())]), 8.0)
brush.Path = None
check_stroke(brush, (middle + [0, 0, 30])[None], 8.0)

# The carver: shapes of ParaView, which begin where the volume is, each with its handles.
carver = UltrasoundCarver(Input=volume)
assert numpy.allclose(carver.Shape.Center, middle)
carver.Shape.Center, carver.Shape.Radius = path[1].tolist(), 15.0
in_ball = numpy.linalg.norm(points - path[1], axis=1) <= 15.0
assert 200 < in_ball.sum() and numpy.array_equal(voxels(carver, "ValidRegion"), valid * ~in_ball)
ball = handles_of(carver.Shape, "Sphere")
ball.GetClientSideObject().GetRepresentation().SetRadius(22.0)
dragged(ball, carver.Shape, "Radius")
in_ball = numpy.linalg.norm(points - path[1], axis=1) <= 22.0
assert carver.Shape.Radius == 22.0 and numpy.array_equal(voxels(carver, "ValidRegion"), valid * ~in_ball), "the shape's handle is followed"
carver.TakeAway = "Outside"
assert numpy.array_equal(voxels(carver, "ValidRegion"), valid * in_ball)
carver.TakeAway = "Inside"
carver.Shape = "Box"
corner, length = middle - [20, 15, 10], numpy.array([40.0, 30.0, 20.0])
carver.Shape.Position, carver.Shape.Length = corner.tolist(), length.tolist()
in_box = ((points >= corner) & (points <= corner + length)).all(1)
assert 200 < in_box.sum() and numpy.array_equal(voxels(carver, "ValidRegion"), valid * ~in_box)
carver.Shape = "Plane"
carver.Shape.Origin, carver.Shape.Normal = middle.tolist(), [0.0, 0.6, 0.8]
assert numpy.array_equal(voxels(carver, "ValidRegion"), valid * ((points - middle) @ [0.0, 0.6, 0.8] > 0))

# Landmarks: a handle each; what the pose editor moves, they follow, and the landmark error finds them.
marks = UltrasoundLandmarks(Input=volume)
assert numpy.allclose(marks.Points, middle)
places = handles_of(marks, "PolyLine")
marks.Points = (path + [[0, 0, 0], [0, 0, 0], [5, 5, 5]]).ravel().tolist()
places.UpdateVTKObjects()
places.GetClientSideObject().GetRepresentation().SetHandlePosition(2, path[2])
dragged(places, marks, "Points")
marks.Labels = ["apex", "fork"]
fields = servermanager.Fetch(marks).GetFieldData()
assert numpy.allclose(vtk_to_numpy(fields.GetArray("Landmarks")), path)
assert [fields.GetAbstractArray("LandmarkLabels").GetValue(i) for i in range(3)] == ["apex", "fork", "3"]
moved = UltrasoundPoseEditor(Input=marks, Translation=[1.0, -2.0, 2.0])
error = servermanager.Fetch(UltrasoundLandmarkError(Input=[marks, moved])).GetFieldData()
assert abs(error.GetArray("Max").GetValue(0) - 3.0) < 1e-9 and abs(error.GetArray("Mean").GetValue(0) - 3.0) < 1e-9

# All of it taken away: the volume is as it was.
for filter in (moved, marks, carver, brush):
    Delete(filter)
assert numpy.array_equal(voxels(volume), grey) and numpy.array_equal(voxels(volume, "ValidRegion"), valid)
assert servermanager.Fetch(volume).GetFieldData().GetAbstractArray("Landmarks") is None
