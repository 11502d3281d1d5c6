# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped anatomy source: both kinds, live parameters, the same result twice, landmarks, errors."""
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkPoints, vtkStringArray
from vtkmodules.vtkFiltersCore import vtkFeatureEdges

from echorama.EchoramaFiltersPhantoms import vtkUltrasoundAnatomySource
from echorama.EchoramaFiltersTissue import vtkUltrasoundTissue


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


def names_of(tissue):
    names = tissue.GetFieldData().GetAbstractArray("BodyName")
    return [names.GetValue(i) for i in range(names.GetNumberOfValues())]


# The abdomen: tissue, closed, named bodies, the same twice.
source = vtkUltrasoundAnatomySource()
source.SetDetailMm(4)
source.SetSepta(30)
source.SetLumps(30)
source.Update()
tissue = source.GetOutput()
assert vtkUltrasoundTissue.IsTissue(tissue)
edges = vtkFeatureEdges()
edges.SetInputData(tissue)
edges.BoundaryEdgesOn()
edges.NonManifoldEdgesOn()
edges.FeatureEdgesOff()
edges.ManifoldEdgesOff()
edges.Update()
assert edges.GetOutput().GetNumberOfCells() == 0, "a body is open"
names = names_of(tissue)
assert names[0] == "skin" and {"lobule", "septum of fat", "liver", "kidney", "gallbladder", "stone", "rib", "portal vein", "aorta"} <= set(names), names
points = vtk_to_numpy(tissue.GetPoints().GetData()).copy()
assert abs(points[:, 2].min() - source.GetStandoffMm()) < 1e-4 and np.ptp(points[:, 0]) <= source.GetTrunkWidthMm() + 1e-3
source.Modified()
source.Update()
assert (vtk_to_numpy(source.GetOutput().GetPoints().GetData()) == points).all()

# Parameters reach the kernel.
source.SetSeed(2)
source.Update()
assert not np.array_equal(vtk_to_numpy(source.GetOutput().GetPoints().GetData()), points)
source.SetCysts(5)
source.LiverOn()
source.KidneyOff()
source.SetRibs(0)
source.Update()
names = names_of(source.GetOutput())
assert names.count("cyst") == 5 and "kidney" not in names and "rib" not in names

# Numbers out of range are refused with the range, and nothing comes out.
for setter, wrong, words in ((source.SetFatMm, 500, "FatMm is 500 mm; it must be in [2, 60]"), (source.SetGenerations, 99, "Generations is 99"),
                             (source.SetTrunkDepthMm, 80, "the organs need")):
    getter = getattr(source, setter.__name__.replace("Set", "Get", 1))
    before = getter()
    setter(wrong)
    text = errors_of(source, source.Update)
    assert words in text, text
    assert source.GetOutput().GetNumberOfCells() == 0
    setter(before)
assert not errors_of(source, source.Update) and source.GetOutput().GetNumberOfCells() > 0

# The rig and its truth.
source.SetKindToCalibrationRig()
source.Update()
rig = source.GetOutput()
centres, labels = vtkPoints(), vtkStringArray()
source.GetLandmarks(centres, labels)
assert labels.GetNumberOfValues() == centres.GetNumberOfPoints() == source.GetNumberOfBalls() == 7
names, owner = names_of(rig), vtk_to_numpy(rig.GetCellData().GetArray("Body"))
corners = vtk_to_numpy(rig.GetPolys().GetConnectivityArray()).reshape(-1, 3)
places = vtk_to_numpy(rig.GetPoints().GetData())
for i in range(7):
    ball = places[np.unique(corners[owner == names.index(labels.GetValue(i))])]
    assert np.abs(0.5 * (ball.min(axis=0) + ball.max(axis=0)) - centres.GetPoint(i)).max() < 0.05
speed = rig.GetFieldData().GetArray("MaterialProperty").GetComponent(0, 0)
assert abs(speed - 1482.36) < 0.1, speed
source.ClearBalls()
assert "number of balls" in errors_of(source, source.Update)
source.AddBall("one", (0, 0, -20), 5)
assert not errors_of(source, source.Update)
assert names_of(source.GetOutput()) == ["plate", "base", "stem of one", "one"]
source.SetRigScale(9)
assert "RigScale is 9; it must be in [0.2, 5]" in errors_of(source, source.Update)
source.SetRigScale(1)
source.SetBallMaterial("cheese")
assert "cheese" in errors_of(source, lambda: source.GetLandmarks(centres, labels)) and centres.GetNumberOfPoints() == 0
print("the anatomy source holds")
