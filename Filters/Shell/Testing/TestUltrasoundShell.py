#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped class: what it puts out for a body, and what it refuses by name."""
import math
import pathlib
import re
import tempfile
import xml.etree.ElementTree
import zipfile

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkFiltersCore import vtkAppendPolyData, vtkFeatureEdges, vtkMassProperties
from vtkmodules.vtkFiltersSources import vtkSphereSource

from echorama import vtkUltrasoundShell


def ball(radius=40.0, centre=(0.0, 0.0, 0.0), gap=0.0):
    source = vtkSphereSource()
    source.SetRadius(radius)
    source.SetCenter(centre)
    source.SetThetaResolution(72)
    source.SetPhiResolution(36)
    source.SetEndPhi(180.0 - gap)
    source.Update()
    return source.GetOutput()


def shell(body, **parameters):
    made = vtkUltrasoundShell()
    made.SetInputData(body)
    for name, value in {"ResolutionMm": 1.0, "OpeningMm": 20.0, "Points": 60, **parameters}.items():
        getattr(made, "Set" + name)(value)
    return made


def errors_of(filter):
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    for each in (filter, filter.GetExecutive()):
        each.AddObserver(vtkCommand.ErrorEvent, note)
    filter.Update()
    return " ".join(messages)


def volume_of(mesh):
    edges = vtkFeatureEdges()
    edges.SetInputData(mesh)
    edges.FeatureEdgesOff()
    edges.ManifoldEdgesOff()
    edges.Update()
    assert edges.GetOutput().GetNumberOfCells() == 0, "it has open edges, or some that more than two triangles share"
    mass = vtkMassProperties()
    mass.SetInputData(mesh)
    mass.Update()
    return mass.GetVolume()


made = shell(ball())
assert errors_of(made) == ""
skin, base, marks, proxy = (made.GetOutput(port) for port in range(4))

# The skin is closed; without flange it is what lies between two caps, and with it there is a ring more, with eight holes.
cap = lambda r, z: math.pi * (2 / 3 * r**3 - r * r * z + z**3 / 3)
wall = cap(40, -20) - cap(38, -20)
ring = volume_of(skin) - wall
flange = 3 * math.pi * (52**2 - 40**2) - 8 * 3 * math.pi * 1.7**2  # what lies within 12 mm of the ball, 3 mm high, without the screws
assert abs(ring - flange) < 0.03 * flange, (ring, flange)
assert volume_of(base) > 5 * math.pi * 45**2 * 0.9
points = vtk_to_numpy(skin.GetPoints().GetData()).astype(float)
assert abs(points[:, 2].max() - 40) < 0.1 and abs(points[:, 2].min() + 20) < 1e-3
assert abs(made.GetLeastThickness() - 2) < 0.06 and abs(made.GetMostThickness() - 2) < 0.06
camera = skin.GetFieldData().GetArray("CameraPosition").GetTuple(0)
assert np.allclose(camera, (0, 0, -20 - 5 + 3 + 8), atol=0.05), camera
assert skin.GetFieldData().GetArray("CameraDirection").GetTuple(0) == (0.0, 0.0, 1.0)

# Calibration points lie on the body, are numbered in order, and are the points of the proxy.
places = vtk_to_numpy(marks.GetPoints().GetData()).astype(float)
assert 45 <= len(places) <= 75, len(places)
assert marks.GetNumberOfVerts() == len(places)
assert np.abs(np.linalg.norm(places, axis=1) - 40).max() < 0.2
assert list(vtk_to_numpy(marks.GetPointData().GetArray("Mark"))) == list(range(1, len(places) + 1))
normals = vtk_to_numpy(marks.GetPointData().GetNormals())
assert (np.einsum("ij,ij->i", normals, places) > 39).all()
numbers = vtk_to_numpy(proxy.GetPointData().GetArray("Mark"))
corners = vtk_to_numpy(proxy.GetPoints().GetData())
for number, corner in zip(numbers, corners):
    assert number == 0 or np.allclose(corner, places[number - 1], atol=1e-3)
assert (numbers > 0).sum() == len(places) and proxy.GetNumberOfPolys() > 60
assert re.search(rf">{len(places)}</text>", made.GetGuide()) and "<svg" in made.GetGuide()
report = made.GetReport()
stated = float(re.search(r"proxy ([\d.]+) mm from the body in the mean", report)[1])
assert 0.05 < stated < 2.0, report

# 3MF: both parts stand on the plate, as many triangles as the outputs have.
with tempfile.TemporaryDirectory() as folder:
    path = pathlib.Path(folder) / "shell.3mf"
    assert made.Write3mf(str(path))
    with zipfile.ZipFile(path) as archive:
        assert archive.testzip() is None
        assert set(archive.namelist()) == {"[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model"}
        model = xml.etree.ElementTree.fromstring(archive.read("3D/3dmodel.model"))
        for name in ("[Content_Types].xml", "_rels/.rels"):
            xml.etree.ElementTree.fromstring(archive.read(name))
    core = {"m": "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"}
    assert model.get("unit") == "millimeter"
    items = model.findall("m:build/m:item", core)
    for item, body, mesh in zip(items, model.findall("m:resources/m:object", core), (skin, base)):
        assert len(body.findall(".//m:triangle", core)) == mesh.GetNumberOfPolys()
        z = [float(vertex.get("z")) for vertex in body.findall(".//m:vertex", core)]
        assert abs(min(z) + float(item.get("transform").split()[11])) < 1e-5
    assert len(items) == 2
    missing = vtkUltrasoundShell()
    said = []
    missing.AddObserver(vtkCommand.ErrorEvent, lambda *_: said.append(1))
    assert not missing.Write3mf(str(path)) and said
    assert not made.Write3mf(str(pathlib.Path(folder) / "nowhere" / "shell.3mf"))

# Given points are taken in their order, but those near the opening; holes go through there.
given = vtkPolyData()
where = vtkPoints()
for place in ((0, 0, 45), (30, 0, 30), (0, 40, -19)):
    where.InsertNextPoint(place)
given.SetPoints(where)
made = shell(ball(), FlangeMm=0)
made.SetMarksToHoles()
made.SetInputData(1, given)
assert errors_of(made) == ""
places = vtk_to_numpy(made.GetOutput(2).GetPoints().GetData())
assert np.allclose(places, [(0, 0, 40), (28.28, 0, 28.28)], atol=0.1), places
assert made.GetOutput(3).GetNumberOfPoints() == 0
mesh = made.GetOutput(0)
assert mesh.GetNumberOfPoints() - mesh.GetNumberOfPolys() // 2 == 2 - 2 * 2  # Euler: two ways through
assert made.GetMeasured() == 0 and "ThicknessMm: 2" in str(made)

# On a dome: seen from the middle of the opening, three times as dense at the horizon as at the top.
made = shell(ball(), FlangeMm=0, Points=400)
made.SetPlacesToDome()
assert errors_of(made) == ""
seen = vtk_to_numpy(made.GetOutput(2).GetPoints().GetData()).astype(float) + (0, 0, 20)
height = seen[:, 2] / np.linalg.norm(seen, axis=1)
top, low = (height > 0.8).sum() / 0.2, ((height > 0.2) & (height < 0.4)).sum() / 0.2
assert abs(low / top - (1 + 2 * 0.7) / (1 + 2 * 0.1)) < 0.15, low / top
assert made.GetOutput(3).GetNumberOfPoints() == 0

# What is refused, with the reason, leaves nothing.
two = vtkAppendPolyData()
for centre in ((0, 0, 0), (30, 1, 2)):
    two.AddInputData(ball(centre=centre))
two.Update()
spoilt = vtkPolyData()
spoilt.DeepCopy(ball())
spoilt.GetPoints().SetPoint(5, 0, float("nan"), 0)
for made, word in (
    (shell(ball(gap=10)), "the body is not closed: it has 1 hole, one of"),
    (shell(two.GetOutput()), "self-intersections"),
    (shell(spoilt), "not finite"),
    (shell(vtkPolyData()), "no triangle"),
    (shell(ball(1.9), OpeningMm=1), "the body is too thin: a wall of ThicknessMm, 2 mm"),
    (shell(ball(), PrinterMm=(70, 70, 70), CutToFit=False), "does not fit the printer (PrinterMm), which makes 70 x 70 x 70 mm"),
    (shell(ball(), ThicknessMm=0), "ThicknessMm is 0 mm"),
    (shell(ball(), ResolutionMm=1.5), "ResolutionMm is 1.5 mm; it must be at most half of ThicknessMm"),
):
    told = errors_of(made)
    assert word in told, (word, told)
    assert all(made.GetOutput(port).GetNumberOfPoints() == 0 for port in range(5))
    assert math.isnan(made.GetLeastThickness()) and made.GetReport() == ""
made = shell(ball(), PrinterMm=(70, 70, 70), FitPrinter=False)
assert errors_of(made) == "" and "the printer is smaller" in made.GetReport()

# What is too large for the printer is cut; each part is closed, and named.
made = shell(ball(), FlangeMm=0, PrinterMm=(70, 100, 100))
assert errors_of(made) == ""
names = [made.GetPrintName(i) for i in range(made.GetNumberOfPrints())]
assert names == ["skin 1", "skin 2", "base 1", "base 2"], names
prints = made.GetOutput(4)
numbers = vtk_to_numpy(prints.GetCellData().GetArray("Print"))
for i, name in enumerate(names):
    part = vtkPolyData()
    assert made.GetPrint(i, part) and part.GetNumberOfPolys() == (numbers == i).sum() > 1000
    assert volume_of(part) > 500 and f"to print: {name}, " in made.GetReport()
assert len(numbers) == prints.GetNumberOfPolys() and set(numbers) == {0, 1, 2, 3}
assert abs(sum(volume_of(made.GetOutput(port)) for port in (0, 1)) / volume_of(prints) - 1) < 0.2
said = []
made.AddObserver(vtkCommand.ErrorEvent, lambda *_: said.append(1))
assert not made.GetPrint(4, part) and said and made.GetPrintName(4) == ""
made = shell(ball())
assert errors_of(made) == "" and [made.GetPrintName(i) for i in range(made.GetNumberOfPrints())] == ["skin", "base"]

# A rig: two domes about the camera, whose marks it sees in the same directions.
made = shell(ball(), OpeningMm=30, BaffleMm=4, MarkMm=2, Rig=True)
assert errors_of(made) == ""
assert [made.GetPrintName(i) for i in range(made.GetNumberOfPrints())] == ["large-dome", "small-dome"]
marks = made.GetOutput(2).GetPointData()
seen, numbers, domes = (vtk_to_numpy(marks.GetArray(name)) for name in ("InCamera", "Mark", "Dome"))
radii = np.linalg.norm(seen, axis=1)
large, small = seen[domes == 0] / radii[0], seen[domes == 1] / radii[-1]
assert len(large) == len(small) >= 20 and np.allclose(large, small, atol=1e-6) and abs(radii[-1] / radii[0] - 0.6) < 1e-3
assert (numbers[domes == 0] == numbers[domes == 1]).all() and numbers[0] == 1
camera = np.array(made.GetOutput(0).GetFieldData().GetArray("CameraPosition").GetTuple(0))
places = vtk_to_numpy(made.GetOutput(2).GetPoints().GetData())
assert np.allclose(places - camera, seen, atol=1e-3)  # Up is z: only the origin is another
for port in (0, 1):
    assert volume_of(made.GetOutput(port)) > 5000
assert made.GetOutput(3).GetNumberOfPoints() == 0 and math.isnan(made.GetLeastThickness())
assert "has room for a dome of" in errors_of(shell(ball(), OpeningMm=30, Rig=True, LargeDomeMm=90))

# A marker says which shell it is.
made = shell(ball(), FlangeMm=0, BaffleMm=4, Marker=True, ResolutionMm=0.4)
assert errors_of(made) == ""
assert f"marker: {int(made.GetOutput(0).GetFieldData().GetArray('MarkerId').GetTuple1(0)):06X}" in made.GetReport()

# It can be stopped, and run again.
made = shell(ball())
stop = made.AddObserver(vtkCommand.ProgressEvent, lambda *_: made.SetAbortExecute(1))
made.Update()
assert made.GetOutput(0).GetNumberOfPoints() == 0
made.RemoveObserver(stop)
made.Modified()
assert errors_of(made) == "" and made.GetOutput(0).GetNumberOfPoints() > 0
print("the shell holds")
