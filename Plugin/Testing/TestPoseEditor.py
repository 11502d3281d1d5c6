# SPDX-License-Identifier: BSD-3-Clause
"""The pose editor in ParaView: properties, the handle that its XML asks for, and the score as an information property.

Usage: pvbatch TestPoseEditor.py
"""
import math
import os

import numpy
from paraview import servermanager
from paraview.simple import *

LoadPlugin(os.environ["ECHORAMA_PLUGIN"], remote=False, ns=globals())

a = UltrasoundPhantom(SpacingMm=2.0)
b = UltrasoundPhantom(SpacingMm=2.0, Position=[20.0, 0.0, 0.0])
editor = UltrasoundPoseEditor(Input=[a, b])


def score():
    editor.UpdatePipeline()
    editor.UpdatePropertyInformation()
    return editor.SMProxy.GetProperty("Score").GetElement(0)


assert math.isnan(score())
before = numpy.array(servermanager.Fetch(editor).GetBlock(1).GetOrigin())

# Connect the truth, where they are now: moved by (3, 4, 0), volume B scores 5.
editor.Truth = [a, b]
editor.Translation = [3.0, 4.0, 0.0]
print("score", score())
assert abs(score() - 5.0) < 1e-9, score()
blocks = servermanager.Fetch(editor)
assert numpy.allclose(numpy.array(blocks.GetBlock(1).GetOrigin()) - before, [3.0, 4.0, 0.0])
assert abs(blocks.GetFieldData().GetArray("Score").GetValue(0) - 5.0) < 1e-9

# Volumes by number, about their middle.
editor.Volumes = [0]
editor.Translation = [0.0, 0.0, 0.0]
editor.RotateAbout = "Middle"
editor.Rotation = [0.0, 0.0, 180.0]
editor.UpdatePipeline()
blocks = servermanager.Fetch(editor)
assert numpy.allclose(blocks.GetBlock(1).GetOrigin(), before)
middle = lambda image: numpy.array(image.GetBounds()).reshape(3, 2).mean(axis=1)
axes = lambda image: numpy.array([[image.GetDirectionMatrix().GetElement(i, j) for j in range(3)] for i in range(3)])
turned, was = blocks.GetBlock(0), servermanager.Fetch(a)
assert numpy.allclose(middle(turned), middle(was), atol=1e-6), (middle(turned), middle(was))
assert numpy.allclose(axes(turned), numpy.diag([-1, -1, 1]) @ axes(was), atol=1e-9)

# The handle: a group with a box, its position and rotation.
groups = [editor.SMProxy.GetPropertyGroup(i) for i in range(editor.SMProxy.GetNumberOfPropertyGroups())]
box = [group for group in groups if group.GetPanelWidget() == "InteractiveBox"]
assert len(box) == 1 and all(box[0].GetProperty(function) for function in ("Position", "Rotation", "Input"))
assert box[0].GetProperty("Scale") is None, "a pose does not scale"
Show(editor, CreateView("RenderView"))
Render()

# The box lies around the volumes that are moved: as a property, and as the widget that the panel makes of the group.
c = UltrasoundPhantom(SpacingMm=2.0, Position=[0.0, 90.0, 0.0])
bounds = []
for volume in (a, b, c):
    volume.UpdatePipeline()
    bounds.append(numpy.array(volume.GetDataInformation().GetBounds()))
third = UltrasoundPoseEditor(Input=[a, b, c])
joined = lambda *parts: [(min if i % 2 == 0 else max)(part[i] for part in parts) for i in range(6)]
box = [third.SMProxy.GetPropertyGroup(i) for i in range(third.SMProxy.GetNumberOfPropertyGroups())]
box = next(group for group in box if group.GetPanelWidget() == "InteractiveBox")
widget = servermanager.ProxyManager().SMProxyManager.NewProxy("representations", "BoxWidgetRepresentation")
widget.LinkProperties(third.SMProxy, box)
whole = joined(*bounds)
widget.GetProperty("PlaceWidget").SetElements(whole)  # as the panel does, around its first input


def drawn():
    widget.UpdateVTKObjects()
    return widget.GetClientSideObject().GetRepresentation().GetBounds()


first = [third.SMProxy.GetProperty("BoxBounds").GetElement(i) for i in range(6)]
assert numpy.allclose(first, joined(bounds[1], bounds[2])), "before it has run: all but the fixed one"
for chosen, expected in (([0], bounds[0]), ([1], bounds[1]), ([2], bounds[2]), ([0, 1], joined(bounds[0], bounds[1])),
                         ([], joined(bounds[1], bounds[2]))):
    third.Volumes = chosen
    third.UpdatePipeline()
    told = [third.SMProxy.GetProperty("BoxBounds").GetElement(i) for i in range(6)]
    assert numpy.allclose(told, expected), (chosen, told, expected)
    assert numpy.allclose(drawn(), expected), (chosen, drawn(), expected)
third.Volumes, third.Translation = [1], [7.0, 0.0, -3.0]
third.UpdatePipeline()
moved = numpy.array(servermanager.Fetch(third).GetBlock(1).GetBounds())
assert numpy.allclose(drawn(), moved) and numpy.allclose(moved, bounds[1] + [7, 7, 0, 0, -3, -3]), "and it is where they are now"
third.BoxFollows = 0
assert numpy.allclose(drawn(), numpy.array(whole) + [7, 7, 0, 0, -3, -3]), "as the panel placed it"
