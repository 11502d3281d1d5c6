#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What is printed: closed, whole, true to the rig that is imaged, and refused when it cannot be made."""
import math

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkPoints, vtkStringArray
from vtkmodules.vtkFiltersCore import vtkFeatureEdges, vtkMassProperties, vtkPolyDataConnectivityFilter

from echorama.EchoramaFiltersPhantoms import vtkUltrasoundAnatomySource
from echorama.EchoramaFiltersPrinting import vtkUltrasoundPrintableSource

source = vtkUltrasoundPrintableSource()


def errors_of(source, call):
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    for each in (source, source.GetExecutive()):
        each.AddObserver(vtkCommand.ErrorEvent, note)
    call()
    return " ".join(messages)


def mesh_of():
    source.Update()
    mesh = source.GetOutput()
    edges = vtkFeatureEdges()
    edges.SetInputData(mesh)
    edges.FeatureEdgesOff()
    edges.ManifoldEdgesOff()
    edges.Update()
    assert edges.GetOutput().GetNumberOfCells() == 0, "it has open edges, or some that more than two triangles share"
    pieces = vtkPolyDataConnectivityFilter()
    pieces.SetInputData(mesh)
    pieces.SetExtractionModeToAllRegions()
    pieces.Update()
    assert pieces.GetNumberOfExtractedRegions() == 1, "it is in pieces"
    mass = vtkMassProperties()
    mass.SetInputData(mesh)
    mass.Update()
    return vtk_to_numpy(mesh.GetPoints().GetData()).astype(float), mass.GetVolume()


def ball_cap(r, a):
    """Volume of a ball above the place where a pin of radius a leaves it, and the height of that place above the centre."""
    h = math.sqrt(r * r - a * a)
    return math.pi * (2 * r**3 / 3 + r * r * h - h**3 / 3), h


# The rig, at two scales: the volume of base, pins and balls, and balls that lie where those of the imaged rig lie.
for scale in (1.0, 0.6):
    source.SetScale(scale)
    points, volume = mesh_of()
    rig = vtkUltrasoundAnatomySource()
    rig.SetKindToCalibrationRig()
    rig.SetRigScale(scale)
    centres, labels = vtkPoints(), vtkStringArray()
    rig.GetLandmarks(centres, labels)
    radii = [scale * r for r in (4, 5, 3, 6, 7, 3.5, 4.5)]
    centres = np.array([centres.GetPoint(i) for i in range(7)])
    low, high = centres[:, :2].min(axis=0) - 6, centres[:, :2].max(axis=0) + 6
    whole = 2.0 * np.prod(high - low)
    for (x, y, z), r in zip(centres, radii):
        top = np.array([x, -y, rig.GetPlateDepthMm() - z])
        pin = min(1.2, 0.6 * r)
        cap, h = ball_cap(r, pin)
        whole += cap + math.pi * pin**2 * (top[2] - h - 2.0)
        away = np.linalg.norm(points - top, axis=1)
        on_ball = (away < 1.2 * r) & (points[:, 2] > top[2])
        assert on_ball.sum() > 20 and np.abs(away[on_ball] - r).max() < 0.01, np.abs(away[on_ball] - r).max()
    assert abs(volume - whole) < 0.01 * whole, (volume, whole)
    assert points[:, 2].min() > -0.2 and abs(np.median(points[points[:, 2] < 0.5, 2])) < 0.01  # stands flat

# The clip: within its wall around the handle, which fits in; the sensor fits into its pocket.
source.SetKindToClip()
points, volume = mesh_of()
a, b, n = 15.0, 11.0, 2.6
sleeve = points[(points[:, 2] > 2) & (points[:, 2] < 20)]
level = (np.abs(sleeve[:, 0] / a) ** n + np.abs(sleeve[:, 1] / b) ** n) ** (1 / n)
assert level.min() > 1.0, "the handle does not fit in"
assert abs(volume - 16000) < 6000, volume
sensor = np.array([0.0, -(11 + 0.4 + 3 + 15 + 4.1), 18 + 70])
inside = np.all(np.abs(points - sensor) < np.array([4.1, 4.1, 10.0]) - 0.05, axis=1)
assert not inside.any(), "the sensor does not fit in"
near = np.abs(points[:, 0]) < 0.6
assert points[near & (points[:, 1] > 9) & (points[:, 2] < 36), 2].size == 0, "the side is not open"

# At the ends of its ranges it is whole, too.
for arm in (0, 13, 300):
    for stand_off in (0, 3, 100):
        source = vtkUltrasoundPrintableSource()
        source.SetKindToClip()
        source.SetResolution(1)
        source.SetArmMm(arm)
        source.SetStandOffMm(stand_off)
        mesh_of()

for change, word in (
    (lambda: source.SetWallMm(0), "WallMm is 0 mm"),
    (lambda: source.SetOpeningMm(29), "OpeningMm is 29 mm; it must be at most 0.9 of HandleWidthMm"),
    (lambda: source.SetResolution(0), "Resolution is 0 mm"),
    (lambda: source.SetTieGrooves(8), "LengthMm is 36 mm; an arm of 10 mm and 8 grooves need at least 50 mm"),
    (lambda: source.SetArmMm(float("nan")), "ArmMm is nan"),
    (lambda: (source.SetKindToRig(), source.SetBaseMm(0)), "BaseMm is 0 mm"),
):
    source = vtkUltrasoundPrintableSource()
    source.SetKindToClip()
    change()
    assert word in errors_of(source, source.Update), word
    assert source.GetOutput().GetNumberOfCells() == 0
print("the printable source holds")
