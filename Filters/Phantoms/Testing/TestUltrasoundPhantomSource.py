# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped phantom source: geometry, arrays, field data, the same result twice, errors."""
import json
import math

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkPoints
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkCommonDataModel import vtkDataObject
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline

from echorama.EchoramaCore import vtkUltrasoundAcquisition, vtkUltrasoundVolume
from echorama.EchoramaFiltersPhantoms import vtkUltrasoundPhantomSource


def small():
    source = vtkUltrasoundPhantomSource()
    source.SetFanAngle(35)
    source.SetSweepAngle(25)
    source.SetDepthMin(15)
    source.SetDepthMax(50)
    return source


def array(image, name):
    return vtk_to_numpy(image.GetPointData().GetArray(name)).reshape(image.GetDimensions()[::-1])


def errors_of(source):
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    source.AddObserver(vtkCommand.ErrorEvent, note)
    source.GetExecutive().AddObserver(vtkCommand.ErrorEvent, note)
    source.Update()
    return " ".join(messages)


# The default volume: about 128^3 voxels, both arrays, uniform background near mid-grey, fluid black.
source = vtkUltrasoundPhantomSource()
source.Update()
image = source.GetOutput()
voxels = image.GetNumberOfPoints()
assert 1.5e6 < voxels < 3.0e6, voxels
assert image.GetPointData().GetScalars().GetName() == vtkUltrasoundVolume.IntensityName() == "Intensity"
intensity, valid = array(image, "Intensity"), array(image, "ValidRegion")
assert intensity.dtype == np.uint8 and valid.dtype == np.uint8
assert set(np.unique(valid)) == {0, 1}
assert (intensity[valid == 0] == 0).all()
assert 90 < intensity[valid == 1].mean() < 130
assert (intensity[valid == 1] < 5).mean() > 0.01, "anechoic voxels are real data"

# The pose is the geometry, in the information pass too.
axis = np.array([1.0, 2.0, -1.0]) / math.sqrt(6.0)
c, s = math.cos(0.5), math.sin(0.5)
cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
rotation = np.eye(3) + s * cross + (1 - c) * cross @ cross
matrix = vtkMatrix4x4()
for i in range(3):
    for j in range(3):
        matrix.SetElement(i, j, rotation[i, j])
    matrix.SetElement(i, 3, (30.0, -12.0, 5.0)[i])

still, posed = small(), small()
posed.SetProbeToWorld(matrix)
still.Update()
posed.UpdateInformation()
information = posed.GetOutputInformation(0)
assert np.allclose([information.Get(vtkDataObject.DIRECTION(), i) for i in range(9)], rotation.ravel(), atol=1e-12)
extent = information.Get(vtkStreamingDemandDrivenPipeline.WHOLE_EXTENT())
posed.Update()
image = posed.GetOutput()
assert tuple(extent) == image.GetExtent()
found = np.array([[image.GetDirectionMatrix().GetElement(i, j) for j in range(3)] for i in range(3)])
assert np.allclose(found, rotation, atol=1e-12)
moved = rotation @ np.array(still.GetOutput().GetOrigin()) + (30.0, -12.0, 5.0)
assert np.allclose(image.GetOrigin(), moved, atol=1e-9)

# Acquisition.
back = vtkMatrix4x4()
assert vtkUltrasoundAcquisition.GetProbeToWorld(image, back)
assert all(abs(back.GetElement(i, j) - matrix.GetElement(i, j)) < 1e-12 for i in range(4) for j in range(4))
posed.GetProbeToWorld(back)
assert all(abs(back.GetElement(i, j) - matrix.GetElement(i, j)) < 1e-12 for i in range(4) for j in range(4))
fields = image.GetFieldData()
geometry = fields.GetArray("ProbeGeometry").GetTuple(0)
assert abs(geometry[0] - 35) < 1e-9 and abs(geometry[2] - 25) < 1e-9 and geometry[4:] == (15, 50)
assert fields.GetArray("Seed").GetTuple1(0) == 1
scene = fields.GetAbstractArray("Scene").GetValue(0)
assert json.loads(scene)["schema"] == "echorama-phantom-1"

# The same twice; the scene that a volume carries makes it again; another seed is other tissue.
again = small()
again.SetProbeToWorld(matrix)
again.SetScene(scene)
again.Update()
assert (array(again.GetOutput(), "Intensity") == array(image, "Intensity")).all()
again.SetSeed(2)
again.Update()
assert (array(again.GetOutput(), "Intensity") != array(image, "Intensity")).mean() > 0.1

# Parameters take effect.
plain = small()
plain.ClearScene()
plain.Update()
mean = array(plain.GetOutput(), "Intensity")[array(plain.GetOutput(), "ValidRegion") == 1].mean()
assert abs(mean - 100) < 4, mean
plain.SetGainDb(6)
plain.Update()
louder = array(plain.GetOutput(), "Intensity")[array(plain.GetOutput(), "ValidRegion") == 1].mean()
assert abs(louder - mean - 6 * 255 / 60) < 1.5, louder - mean
plain.SetSpacingMm(2)
plain.Update()
assert plain.GetOutput().GetSpacing() == (2, 2, 2)
plain.SetSpacingMm(1)
plain.AddEllipsoid((0, 0, 35), (6, 6, 6), -120)
plain.AddTube((-20, 0, 22), (20, 0, 22), 2, 15)
plain.Update()
volume = plain.GetOutput()


def at(point):
    index = [round((p - o) / s) for p, o, s in zip(point, volume.GetOrigin(), volume.GetSpacing())]
    return array(volume, "Intensity")[index[2] - 1 : index[2] + 2, index[1] - 1 : index[1] + 2, index[0] - 1 : index[0] + 2].mean()


assert at((0, 0, 35)) < 20
assert at((0, 0, 22)) > 140

# What sets two volumes of one tissue apart: each has its effect, and is told in the scene's text.
for change, name, value in (
    (lambda f: f.SetDecorrelation(0.4), "decorrelation", 0.4),
    (lambda f: f.SetDeformationMm(2), "deformationMm", 2),
    (lambda f: f.SetNoiseDb(-10), "noiseDb", -10),
    (lambda f: f.SetRibShare(0.3), "ribShare", 0.3),
    (lambda f: f.SetJets(True), "jets", True),
):
    changed = small()
    changed.SetPosition(0, 0, 40)  # where a jet is in view
    as_it_was = array((changed.Update(), changed.GetOutput())[1], "Intensity").copy()
    change(changed)
    changed.Update()
    assert (array(changed.GetOutput(), "Intensity") != as_it_was).mean() > 0.005, name
    told = json.loads(changed.GetOutput().GetFieldData().GetAbstractArray("Scene").GetValue(0))["parameters"]
    assert told[name] == value, told

# The truth of the deformation: along the probe's axis below its face, nothing far away, and back again.
pressed = small()
pressed.SetProbeToWorld(matrix)
pressed.SetDeformationMm(3)
tissue, seen, back_again = vtkPoints(), vtkPoints(), vtkPoints()
tissue.SetDataTypeToDouble()
tissue.InsertNextPoint(30, -12, 5)
tissue.InsertNextPoint(rotation @ (0, 0, 300) + (30, -12, 5))
tissue.InsertNextPoint(rotation @ (12, -9, 30) + (30, -12, 5))
pressed.TissueToSeen(tissue, seen)
pressed.SeenToTissue(seen, back_again)
before, after, again = (vtk_to_numpy(p.GetData()) for p in (tissue, seen, back_again))
assert np.allclose(after[0] - before[0], rotation @ (0, 0, 3), atol=1e-12)
assert np.abs(after[1] - before[1]).max() < 1e-9
assert 1 < np.linalg.norm(after[2] - before[2]) < 3
assert np.abs(again - before).max() < 1e-8

# Bad parameters: a message that says why, an empty output, and no crash.
for change, word in (
    (lambda f: f.SetSpacingMm(0), "SpacingMm is 0 mm"),
    (lambda f: f.SetSpacingMm(float("nan")), "SpacingMm is nan"),
    (lambda f: f.SetSpacingMm(1e-4), "larger spacing"),
    (lambda f: f.SetDepthMax(3), "depth"),
    (lambda f: f.SetSweepAngle(0), "plane"),
    (lambda f: f.SetFanAngle(-10), "FanAngle is -10 degrees"),
    (lambda f: f.SetPosition(float("nan"), 0, 0), "Position is (nan"),
    (lambda f: f.SetDecorrelation(2), "Decorrelation is 2"),
    (lambda f: f.SetDeformationMm(-1), "DeformationMm is -1 mm"),
    (lambda f: f.SetRibShare(1), "RibShare is 1; it must be in [0, 0.6]"),
    (lambda f: f.SetScene("{"), "JSON"),
):
    bad = small()
    change(bad)
    message = errors_of(bad)
    assert word in message, (word, message)
    assert bad.GetOutput().GetNumberOfPoints() == 0

sheared = vtkMatrix4x4()
sheared.SetElement(0, 1, 0.5)
kept = small()
notes = []
kept.AddObserver(vtkCommand.ErrorEvent, lambda *_: notes.append(1))
kept.SetProbeToWorld(sheared)
assert notes and kept.GetOrientation() == (0, 0, 0)
