# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped tissue source: what it puts out and reports, live parameters, the same result twice, errors."""
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkFiltersCore import vtkFeatureEdges, vtkMassProperties, vtkPolyDataConnectivityFilter

from echorama.EchoramaFiltersTissue import vtkUltrasoundTissue, vtkUltrasoundTissueSource


def small():
    source = vtkUltrasoundTissueSource()
    source.SetBox(-20, 20, -20, 20, 0, 30)
    source.SetRadiusMax(5)
    return source


def field(source, name):
    return vtk_to_numpy(source.GetOutput().GetFieldData().GetArray(name))


def errors_of(source):
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    tags = [(each, each.AddObserver(vtkCommand.ErrorEvent, note)) for each in (source, source.GetExecutive())]
    source.Update()
    for each, tag in tags:
        each.RemoveObserver(tag)
    return " ".join(messages)


# Tissue, with one closed component per sphere.
source = small()
box = [0.0] * 6
source.GetBox(box)
assert box == [-20, 20, -20, 20, 0, 30] and source.GetBoxMax() == (20, 20, 30)
source.Update()
tissue = source.GetOutput()
assert vtkUltrasoundTissue.IsTissue(tissue)
spheres = field(source, "Spheres")
assert len(spheres) == source.GetSphereCount() == field(source, "SphereCount")[0] > 50
assert abs(source.GetPackedFillFraction() - 0.3) < 1e-3 and field(source, "FillFraction")[0] == source.GetPackedFillFraction()
assert abs((4 / 3 * np.pi * spheres[:, 3] ** 3).sum() / (40 * 40 * 30) - source.GetPackedFillFraction()) < 1e-9
assert not source.GetSaturated() and field(source, "Saturated")[0] == 0
for i in range(len(spheres)):
    way = np.linalg.norm(spheres[:i, :3] - spheres[i, :3], axis=1) - spheres[:i, 3] - spheres[i, 3]
    assert i == 0 or way.min() >= -1e-12

edges = vtkFeatureEdges()
edges.SetInputData(tissue)
edges.ManifoldEdgesOff()
edges.FeatureEdgesOff()
edges.Update()
assert edges.GetOutput().GetNumberOfCells() == 0, "open or non-manifold edges"
parts = vtkPolyDataConnectivityFilter()
parts.SetInputData(tissue)
parts.SetExtractionModeToAllRegions()
parts.Update()
assert parts.GetNumberOfExtractedRegions() == len(spheres)

# Every body has its own material, of the four.
bodies = vtk_to_numpy(tissue.GetCellData().GetArray("Body"))
materials = vtk_to_numpy(tissue.GetCellData().GetArray("Material"))
names = tissue.GetFieldData().GetAbstractArray("MaterialName")
assert [names.GetValue(i) for i in range(names.GetNumberOfValues())] == ["tissue", "lesion-dark", "liver", "lesion-bright", "cyst"]
assert set(materials) == {1, 2, 3, 4}
assert (vtk_to_numpy(tissue.GetFieldData().GetArray("BodyMaterial"))[bodies] == materials).all()
assert set(bodies) == set(range(len(spheres)))

# Corners lie on their sphere; a finer cell takes more triangles; the true volume is the spheres' together.
points = vtk_to_numpy(tissue.GetPoints().GetData())
corners = vtk_to_numpy(tissue.GetPolys().GetConnectivityArray()).reshape(-1, 3)
way = np.linalg.norm(points[corners[:, 0]] - spheres[bodies, :3], axis=1) - spheres[bodies, 3]
assert abs(way).max() < 1e-4
fine = small()
fine.SetCellMm(0.25)
fine.TrueVolumeOn()
fine.Update()
assert fine.GetOutput().GetNumberOfCells() > 2 * tissue.GetNumberOfCells()
mass = vtkMassProperties()
mass.SetInputData(fine.GetOutput())
assert abs(mass.GetVolume() / (0.3 * 40 * 40 * 30) - 1) < 1e-3

# The same again is the same; another seed is not; a property that changes makes it anew.
again = small()
again.Update()
assert (vtk_to_numpy(again.GetOutput().GetPoints().GetData()) == points).all()
again.SetSeed(2)
again.Update()
assert not np.array_equal(field(again, "Spheres"), spheres)
again.SetCount(12)
again.Update()
assert again.GetSphereCount() == 12

# The other method, the other region, materials by their shares, nothing at all, and no more room.
other = small()
other.SetMethod(vtkUltrasoundTissueSource.EMPTY_SPACE)
other.SetRegion(vtkUltrasoundTissueSource.BALL)
other.SetMaterials("bone 0, muscle")
other.SetBackground("water")
other.Update()
assert abs(other.GetPackedFillFraction() - 0.3) < 1e-3
assert (np.linalg.norm(field(other, "Spheres")[:, :3] - (0, 0, 15), axis=1) + field(other, "Spheres")[:, 3] < 15 + 1e-9).all()
assert set(vtk_to_numpy(other.GetOutput().GetCellData().GetArray("Material"))) == {2}
other.SetCount(0)
other.Update()
assert other.GetOutput().GetNumberOfCells() == 0 and vtkUltrasoundTissue.IsTissue(other.GetOutput())
full = small()
full.SetFillFraction(1)
full.SetMisses(500)
full.Update()
assert full.GetSaturated() and field(full, "Saturated")[0] == 1 and 0.4 < full.GetPackedFillFraction() < 0.74

# Errors name what is wrong, leave nothing behind, and pass.
for spoil, words in (
    (lambda s: s.SetRadiusMax(25), "RadiusMax is 25 mm"),
    (lambda s: s.SetRadiusMin(6), "at least RadiusMin, 6"),
    (lambda s: s.SetRadiusMin(float("nan")), "RadiusMin is nan"),
    (lambda s: s.SetBox(0, 0, 0, 10, 0, 10), "box"),
    (lambda s: s.SetMaxTriangles(100), "MaxTriangles (100)"),
    (lambda s: s.SetFillFraction(1.1), "FillFraction is 1.1"),
    (lambda s: s.SetMaterials("livre 2"), "liver"),
    (lambda s: s.SetMaterials("liver two"), "liver two"),
    (lambda s: s.SetMaterials("liver 1 2"), "liver 1 2"),
    (lambda s: s.SetMaterials("liver -1"), "weight of \"liver\""),
    (lambda s: s.SetMaterials(""), "no material"),
    (lambda s: s.SetBackground("plasma"), "plasma"),
    (lambda s: s.SetBackground(None), "no standard material"),
):
    source = small()
    spoil(source)
    errors = errors_of(source)
    assert words in errors, (words, errors)
    assert source.GetOutput().GetNumberOfCells() == 0 and source.GetSphereCount() == 0
    source.SetBox(-20, 20, -20, 20, 0, 30)
    source.SetFillFraction(0.3)
    source.SetRadiusMin(1)
    source.SetRadiusMax(5)
    source.SetMaxTriangles(10000000)
    source.SetMaterials("liver")
    source.SetBackground("tissue")
    assert errors_of(source) == "" and source.GetOutput().GetNumberOfCells() > 0
assert "Saturated" not in str(source) and "PackedFillFraction" in str(source)
