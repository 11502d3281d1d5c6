#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The rig, imaged by the synthesizer, is found where it is: at any pose of the volume, in water of any temperature."""
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkCommonTransforms import vtkTransform

from echorama.EchoramaCore import vtkUltrasoundVolume
from echorama.EchoramaFiltersCalibration import vtkUltrasoundRigFit
from echorama.EchoramaFiltersAcoustics import vtkUltrasoundSynthesizer
from echorama.EchoramaFiltersPhantoms import vtkUltrasoundAnatomySource

BALLS = (("A", (-27, -22, -19), 4), ("B", (-30, 23, -45), 5), ("C", (-5, -20, -49), 3), ("D", (-2, 18, -28), 6), ("E", (27, 21, -20), 7),
         ("F", (12, -14, -58), 3.5), ("G", (30, -1, -47), 4.5))


def errors_of(filter):
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    for each in (filter, filter.GetExecutive()):
        each.AddObserver(vtkCommand.ErrorEvent, note)
    filter.Update()
    return " ".join(messages)


def volume_of(celsius):
    rig = vtkUltrasoundAnatomySource()
    rig.SetKindToCalibrationRig()
    rig.SetWaterCelsius(celsius)
    scan = vtkUltrasoundSynthesizer()
    scan.SetInputConnection(rig.GetOutputPort())
    scan.SetFanAngle(70)
    scan.SetFanRadius(40)
    scan.SetSweepAngle(65)
    scan.SetSweepRadius(30)
    scan.SetDepthMax(118)
    scan.SetElements(64)
    scan.SetSteps(48)
    scan.SetSamples(320)
    scan.SetTgcDbPerCm(0)
    scan.SetDynamicRangeDb(70)
    scan.SetNoiseDb(-45)
    scan.SetSpacingMm(1.2)
    scan.Update()
    volume = vtkImageData()
    volume.ShallowCopy(scan.GetOutput())
    return volume


def rig_fit(volume):
    fit = vtkUltrasoundRigFit()
    for ball in BALLS:
        fit.AddBall(*ball)
    fit.SetInputData(volume)
    return fit


def matrix_of(fit):
    matrix = vtkMatrix4x4()
    assert fit.GetRigToWorld(matrix)
    return np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])


centres = np.array([ball[1] for ball in BALLS], float)
volume = volume_of(20)
fit = rig_fit(volume)
problem = errors_of(fit)
assert not problem, problem
assert fit.GetNumberOfFoundBalls() >= 6, fit.GetNumberOfFoundBalls()
assert abs(fit.GetFoundDepthScale() - 1540 / 1482.36) < 0.008, fit.GetFoundDepthScale()
found = vtk_to_numpy(fit.GetOutput().GetPoints().GetData())
truth = centres + (0, 0, 105)
error = np.linalg.norm(matrix_of(fit)[:3] @ np.c_[centres, np.ones(7)].T - truth.T, axis=0)
assert error.max() < 1.2, error
assert np.linalg.norm(found - truth, axis=1).max() < 1.5, found - truth  # in image depth it would be 2 to 4 mm off
is_found = vtk_to_numpy(fit.GetOutput().GetPointData().GetArray("Found"))
residual = vtk_to_numpy(fit.GetOutput().GetPointData().GetArray("Residual"))
placed = (matrix_of(fit)[:3] @ np.c_[centres, np.ones(7)].T).T
assert is_found.sum() == fit.GetNumberOfFoundBalls()
assert np.allclose(residual[is_found == 1], np.linalg.norm(found - placed, axis=1)[is_found == 1], atol=1e-3)
assert (residual[is_found == 0] == 0).all()
fit.SetDepthScale(1540 / 1482.36)  # known, it need not be told from the balls
assert not errors_of(fit)
error = np.linalg.norm(matrix_of(fit)[:3] @ np.c_[centres, np.ones(7)].T - truth.T, axis=0)
assert error.max() < 0.7, error
assert fit.GetOutput().GetFieldData().GetArray("RigToWorld").GetNumberOfComponents() == 16
assert fit.GetOutput().GetPointData().GetAbstractArray("Name").GetValue(3) == "D"

# The volume moves, the rig moves with it.
turn = vtkTransform()
turn.Translate(30, -20, 400)
turn.RotateWXYZ(150, 1, 2, -1)
moved = vtkImageData()
moved.DeepCopy(volume)
assert vtkUltrasoundVolume.Move(moved, turn.GetMatrix())
before = matrix_of(fit)
fit.SetInputData(moved)
assert not errors_of(fit)
step = np.array([[turn.GetMatrix().GetElement(i, j) for j in range(4)] for i in range(4)])
assert np.abs(matrix_of(fit) - step @ before).max() < 1e-3

# ParaView's text says the same as AddBall.
typed = vtkUltrasoundRigFit()
typed.SetBalls("; ".join(f"{name} {x} {y} {z} {r}" for name, (x, y, z), r in BALLS))
assert typed.GetNumberOfBalls() == 7
typed.SetBalls("A 1 2 3")
typed.SetInputData(volume)
assert "name x y z radius" in errors_of(typed)

# What cannot be done is said.
fit = rig_fit(volume)
fit.SetDepthScale(3)
assert "DepthScale" in errors_of(fit) and fit.GetOutput().GetNumberOfPoints() == 0 and not fit.GetRigToWorld(vtkMatrix4x4())
fit = rig_fit(volume)
fit.ClearBalls()
assert "0 balls" in errors_of(fit)
bare = vtkImageData()
bare.DeepCopy(volume)
bare.GetFieldData().Initialize()
assert "ProbeGeometry" in errors_of(rig_fit(bare))
dark = vtkImageData()
dark.DeepCopy(volume)
dark.GetPointData().GetArray("Intensity").Fill(0)
assert "not found" in errors_of(rig_fit(dark))
print("the rig fit holds")
