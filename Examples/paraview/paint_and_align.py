# SPDX-License-Identifier: BSD-3-Clause
"""A state for ParaView: painting, carving and landmarks as steps of a pipeline, then alignment, stitching and what disagrees.

File > Load State in ParaView with the plugin (`./run paraview`), or run it in pvbatch after LoadPlugin. Select a filter and drag its
handles: what comes after it follows with Apply.
"""
import paraview

paraview.compatibility.major, paraview.compatibility.minor = 5, 11
from paraview.simple import *

# Two views of one phantom. Places that both show, in the world:
places = [[0, -12, 40], [10, 14, 55], [-8, 16, 68]]
left = UltrasoundPhantom(registrationName="Left view", SpacingMm=1.5, Position=[-25, 0, 0])
right = UltrasoundPhantom(registrationName="Right view", SpacingMm=1.5, Position=[25, 0, 0], Orientation=[0, -8, 0], Seed=2)

# A stroke along three points on the left view, and a ball that is carved out of the right one.
painted = UltrasoundBrush(registrationName="Stroke", Input=left, Points=[-60, 0, 30, -45, 0, 55, -20, 0, 45], RadiusMm=3, Intensity=230)
carved = UltrasoundCarver(registrationName="Ball", Input=right, Shape="Sphere")
carved.Shape.Center, carved.Shape.Radius = [45, 0, 50], 12

# Landmarks, and the right view taken to lie elsewhere: what was carved and marked goes with it.
labels = ["cyst", "fork", "wall"]
marked = [UltrasoundLandmarks(registrationName=f"Marks on {name}", Input=volume, Points=[x for place in places for x in place], Labels=labels)
          for name, volume in (("the left", painted), ("the right", carved))]
knocked = UltrasoundPoseEditor(registrationName="Out of place", Input=marked[1], Translation=[6, -5, 4], Rotation=[3, 0, -4])

aligned = UltrasoundAligner(registrationName="Aligned", Input=[marked[0], knocked])
error = UltrasoundLandmarkError(registrationName="Landmark error", Input=aligned)
stitched = UltrasoundStitcher(registrationName="Stitched", Input=aligned)
disagreement = UltrasoundDisagreement(registrationName="Disagreement", Input=aligned)


def look(data, place, cell):
    """A view of the plane y = 0, from behind, in a cell of the layout."""
    view = CreateView("RenderView", OrientationAxesVisibility=0, UseColorPaletteForBackground=0, Background=[0, 0, 0])
    real = Threshold(registrationName=place, Input=data, Scalars=["POINTS", "ValidRegion"], LowerThreshold=1, UpperThreshold=1)
    plane = Slice(registrationName=f"{place}, y = 0", Input=real, SliceType="Plane")
    plane.SliceType.Origin, plane.SliceType.Normal = [0, 0, 50], [0, 1, 0]
    display = Show(plane, view)
    ColorBy(display, ("POINTS", "Intensity"))
    display.SetScalarBarVisibility(view, False)
    display.Ambient, display.Diffuse = 1, 0
    x0, x1 = plane.GetDataInformation().GetBounds()[:2]
    view.CameraPosition, view.CameraFocalPoint, view.CameraViewUp = [(x0 + x1) / 2, 400, 50], [(x0 + x1) / 2, 0, 50], [0, 0, -1]
    view.CameraParallelProjection, view.CameraParallelScale = 1, 80
    layout.AssignView(cell, view)
    return view


layout = CreateLayout(name="Painting")
layout.SplitHorizontal(0, 0.3)
layout.SplitHorizontal(2, 0.4)
views = [look(painted, "Left, painted", 1), look(carved, "Right, carved", 5), look(stitched, "What is real", 6)]
greys = GetColorTransferFunction("Intensity")
greys.ApplyPreset("Grayscale", True)
greys.RescaleTransferFunction(0, 255)

# What the aligned volumes disagree about, as balls where something is known.
known = Threshold(registrationName="Known", Input=disagreement, Scalars=["POINTS", "KnownDirections"], LowerThreshold=1, UpperThreshold=3)
balls = Show(known, views[2])
balls.SetRepresentationType("Point Gaussian")
balls.GaussianRadius = 2
ColorBy(balls, ("POINTS", "Disagreement"))
shifts = GetColorTransferFunction("Disagreement")
shifts.ApplyPreset("Viridis (matplotlib)", True)
shifts.RescaleTransferFunction(0, 2)
balls.SetScalarBarVisibility(views[2], True)
bar = GetScalarBar(shifts, views[2])
bar.Title, bar.ComponentTitle, bar.AutomaticLabelFormat, bar.LabelFormat, bar.RangeLabelFormat = "Disagreement, mm", "", 0, "%.1f", "%.1f"
bar.WindowLocation, bar.ScalarBarLength, bar.TitleFontSize, bar.LabelFontSize = "Lower Right Corner", 0.3, 12, 12
SetActiveSource(painted)
