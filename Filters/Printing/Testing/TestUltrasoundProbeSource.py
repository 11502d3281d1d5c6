# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped probe source: closed solids for every preset, elements on the face, pose and field data, live parameters, errors."""
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from vtkmodules.vtkFiltersCore import vtkFeatureEdges, vtkMassProperties

from echorama.EchoramaFiltersPrinting import vtkUltrasoundProbeSource


def errors_of(source, call):
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    tags = [(each, each.AddObserver(vtkCommand.ErrorEvent, note)) for each in (source, source.GetExecutive())]
    call()
    for each, tag in tags:
        each.RemoveObserver(tag)
    return " ".join(messages)


def points_of(data):
    return vtk_to_numpy(data.GetPoints().GetData())


def field(data, name):
    return vtk_to_numpy(data.GetFieldData().GetArray(name)).ravel()


source = vtkUltrasoundProbeSource()
source.SetResolutionMm(3)
presets = {"Curvilinear": 1, "Linear": 1, "Phased": 1, "Endocavity3D": 96, "Mechanical3D": 128}
for name, steps in presets.items():
    getattr(source, f"SetPresetTo{name}")()
    source.Update()
    probe, elements = source.GetOutput(0), source.GetOutput(1)
    edges = vtkFeatureEdges()
    edges.SetInputData(probe)
    edges.BoundaryEdgesOn()
    edges.NonManifoldEdgesOn()
    edges.FeatureEdgesOff()
    edges.ManifoldEdgesOff()
    edges.Update()
    assert edges.GetOutput().GetNumberOfCells() == 0, f"{name} is open"
    mass = vtkMassProperties()
    mass.SetInputData(probe)
    assert 2e4 < mass.GetVolume() < 1e6, (name, mass.GetVolume())
    assert set(vtk_to_numpy(probe.GetCellData().GetArray("Part"))) == {0, 1, 2}
    assert elements.GetNumberOfPoints() == 128 * steps == elements.GetNumberOfCells(), name
    direction = vtk_to_numpy(elements.GetPointData().GetNormals())
    assert elements.GetPointData().GetNormals().GetName() == "Direction" and np.allclose(np.linalg.norm(direction, axis=1), 1)
    matrix = vtk_to_numpy(elements.GetPointData().GetArray("ElementToWorld")).reshape(-1, 4, 4)
    assert np.allclose(matrix[:, :3, 3], points_of(elements)) and np.allclose(matrix[:, :3, 2], direction)
    assert np.allclose(np.linalg.det(matrix[:, :3, :3]), 1)
    fan = vtk_to_numpy(elements.GetPointData().GetArray("Fan"))
    assert fan.min() == -0.5 and fan.max() == 0.5 and (np.diff(fan[:128]) > 0).all()
    assert source.GetPresetSource()

# Elements of a head of one's own lie on the corner of a torus as the formulas of its parameters say.
source.SetPresetToCustom()
assert source.GetPresetSource() == ""
source.SetFanAngle(60)
source.SetFanRadius(50)
source.SetSweepAngle(40)
source.SetSweepRadius(45)
source.SetElements(9)
source.SetSweepSteps(5)
source.SetDepthMax(120)
source.Update()
elements = source.GetOutput(1)
assert elements.GetNumberOfPoints() == 45
phi, psi = np.radians(30), np.radians(20)
rho = 50 * np.cos(phi) - 50
corner = [50 * np.sin(phi), (45 + rho) * np.sin(psi), (45 + rho) * np.cos(psi) - 45]
assert np.allclose(points_of(elements)[-1], corner, atol=1e-9)
assert np.allclose(points_of(elements)[22], 0, atol=1e-12)
for output in (source.GetOutput(0), elements):
    geometry = field(output, "ProbeGeometry")
    assert np.allclose(geometry[[0, 1, 2, 3, 4, 5]], [60, np.radians(60) * 50, 40, np.radians(40) * 45, 0, 120]), geometry
    assert np.allclose(field(output, "ProbeToWorld"), np.eye(4).ravel())
at_rest = points_of(source.GetOutput(0)).copy()

# A flat array.
source.SetFanAngle(0)
source.SetFanWidth(36)
source.SetSweepAngle(0)
source.Update()
assert source.GetOutput(1).GetNumberOfPoints() == 9  # a single plane, whatever SweepSteps says
assert np.ptp(points_of(source.GetOutput(1))[:, 0]) == 36
source.SetSweepWidth(20)
source.Update()
assert source.GetOutput(1).GetNumberOfPoints() == 45 and abs(np.ptp(points_of(source.GetOutput(1))[:, 1]) - 20) < 1e-12
source.SetFanAngle(60)
source.SetSweepAngle(40)

# The pose moves everything.
pose = vtkMatrix4x4()
pose.DeepCopy([0, -1, 0, 10, 1, 0, 0, 20, 0, 0, 1, 30, 0, 0, 0, 1])
source.SetProbeToWorld(pose)
source.Update()
turned = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
assert np.allclose(points_of(source.GetOutput(0)), at_rest @ turned.T + [10, 20, 30])
assert np.allclose(points_of(source.GetOutput(1))[-1], turned @ corner + [10, 20, 30])
back = vtkMatrix4x4()
source.GetProbeToWorld(back)
assert all(abs(back.GetElement(i, j) - pose.GetElement(i, j)) < 1e-12 for i in range(4) for j in range(4))
assert np.allclose(field(source.GetOutput(0), "ProbeToWorld"), [0, -1, 0, 10, 1, 0, 0, 20, 0, 0, 1, 30, 0, 0, 0, 1])
pose.SetElement(0, 0, 5)
assert "not a rigid transform" in errors_of(source, lambda: source.SetProbeToWorld(pose))
assert np.allclose(source.GetPosition(), [10, 20, 30])

# What cannot be built is refused, and nothing comes out.
for setter, wrong, words in ((source.SetSweepRadius, 5, "axis of the sweep"), (source.SetFanAngle, 200, "200 degrees"),
                             (source.SetHandleMm, -1, "HandleMm is -1 mm; it must be in [1, 1000]"), (source.SetElements, 0, "Elements is 0"),
                             (source.SetResolutionMm, 0, "ResolutionMm is 0 mm"), (source.SetDepthMax, -1, "depths go from"),
                             (source.SetFanAngle, float("nan"), "FanAngle is nan")):
    before = getattr(source, setter.__name__.replace("Set", "Get", 1))()
    setter(wrong)
    text = errors_of(source, source.Update)
    assert words in text, (setter.__name__, text)
    assert source.GetOutput(0).GetNumberOfPoints() == 0 == source.GetOutput(1).GetNumberOfPoints()
    setter(before)
assert not errors_of(source, source.Update) and source.GetOutput(0).GetNumberOfCells() > 0
print("the probe source is in order")
