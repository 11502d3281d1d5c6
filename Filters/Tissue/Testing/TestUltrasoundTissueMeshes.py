# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped meshes-as-tissue filter: units and axes, materials and blocks, what it mends and reports, errors; and real organs."""
import os
import sys

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkCompositeDataSet, vtkMultiBlockDataSet, vtkPlane, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkAppendPolyData, vtkClipPolyData, vtkReverseSense, vtkStripper, vtkTriangleFilter
from vtkmodules.vtkFiltersSources import vtkCubeSource, vtkSphereSource
from vtkmodules.vtkIOGeometry import vtkGLTFReader

from echorama.EchoramaFiltersTissue import vtkUltrasoundTissue, vtkUltrasoundTissueMeshes, vtkUltrasoundTissueSource

FAULTS = ("open", "crowded", "inconsistent", "inside out", "crossing", "degenerate")


def ball(radius, x=0.0, y=0.0, z=0.0):
    source = vtkSphereSource()
    source.SetRadius(radius)
    source.SetCenter(x, y, z)
    source.SetThetaResolution(24)
    source.SetPhiResolution(16)
    source.Update()
    return source.GetOutput()


def through(filter, data):
    filter.SetInputData(data)
    filter.Update()
    output = vtkPolyData()
    output.ShallowCopy(filter.GetOutput()) # the filter may run again
    return output


def blocks(*meshes, names=()):
    tree = vtkMultiBlockDataSet()
    for i, mesh in enumerate(meshes):
        tree.SetBlock(i, mesh)
        if i < len(names):
            tree.GetMetaData(i).Set(vtkCompositeDataSet.NAME(), names[i])
    return tree


def tissue_of(*inputs, **properties):
    filter = vtkUltrasoundTissueMeshes()
    for data in inputs:
        filter.AddInputDataObject(data)
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    return filter


def run(*inputs, **properties):
    filter = tissue_of(*inputs, **properties)
    filter.Update()
    return filter


def field(filter, name):
    array = filter.GetOutput().GetFieldData().GetAbstractArray(name)
    return vtk_to_numpy(array) if hasattr(array, "GetTuple1") else [array.GetValue(i) for i in range(array.GetNumberOfValues())]


def faults(filter, body=0):
    return dict(zip(FAULTS, field(filter, "SurfaceFaults")[body].tolist()))


def errors_of(filter):
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    for each in (filter, filter.GetExecutive()):
        each.AddObserver(vtkCommand.ErrorEvent, note)
    filter.Update()
    return " ".join(messages)


# A sound ball: nothing to report. Strips are cut into triangles.
filter = run(ball(10, 1, 2, 3), Materials="liver")
tissue = filter.GetOutput()
assert vtkUltrasoundTissue.IsTissue(tissue) and tissue.GetNumberOfCells() == ball(10).GetNumberOfPolys()
assert filter.GetNumberOfFaultyBodies() == 0 and filter.GetReport() == "" and field(filter, "SurfaceReport") == [""]
assert faults(filter) == dict.fromkeys(FAULTS, 0)
assert np.allclose(tissue.GetBounds(), ball(10, 1, 2, 3).GetBounds())
assert 0.93 < field(filter, "SurfaceVolume")[0] / (4 / 3 * np.pi * 1000) < 1
assert field(filter, "MaterialName") == ["tissue", "liver"] and field(filter, "BodyName") == ["liver"]
strips = run(through(vtkStripper(), ball(10)))
assert strips.GetOutput().GetNumberOfCells() == tissue.GetNumberOfCells() and strips.GetNumberOfFaultyBodies() == 0

# Metres and y up; RAS.
upright = run(ball(0.01, 0.1, 0.2, 0.3), Scale=1000, Axes=vtkUltrasoundTissueMeshes.Y_UP).GetOutput()
assert np.allclose(np.array(upright.GetBounds()).reshape(3, 2).mean(1), (100, -300, 200), atol=0.3), upright.GetBounds()
slicer = run(ball(10, 10, 20, 30), Axes=vtkUltrasoundTissueMeshes.RAS)
assert np.allclose(np.array(slicer.GetOutput().GetBounds()).reshape(3, 2).mean(1), (-10, -20, 30), atol=0.3)
assert field(slicer, "SurfaceVolume")[0] > 0 and slicer.GetReport() == ""

# A cube with points of its own for every side is welded; inside out is turned, with a word about it.
cube = vtkCubeSource()
cube.SetXLength(7)
cube.Update()
assert cube.GetOutput().GetNumberOfPoints() == 24
welded = run(cube.GetOutput())
assert welded.GetOutput().GetNumberOfPoints() == 8 and welded.GetReport() == "" and abs(field(welded, "SurfaceVolume")[0] - 7) < 1e-5
turned = run(through(vtkReverseSense(), cube.GetOutput()))
assert faults(turned)["inside out"] == 1 and "turned" in turned.GetReport() and abs(field(turned, "SurfaceVolume")[0] - 7) < 1e-5
left = run(through(vtkReverseSense(), cube.GetOutput()), Orient=False)
assert faults(left)["inside out"] == 1 and "turned" not in left.GetReport() and abs(field(left, "SurfaceVolume")[0] + 7) < 1e-5

# A hole is reported where it is, and closed when asked.
plane = vtkPlane()
plane.SetOrigin(0, 0, 4)
plane.SetNormal(0, 0, -1)
clip = vtkClipPolyData()
clip.SetClipFunction(plane)
cut = through(clip, ball(10))
opened = run(cut)
count = faults(opened)["open"]
assert count >= 24 and opened.GetNumberOfFaultyBodies() == 1 and f"{count} open edges" in opened.GetReport(), opened.GetReport()
marks = opened.GetOutput(1)
assert marks.GetNumberOfPoints() == marks.GetNumberOfVerts() == count
assert abs(vtk_to_numpy(marks.GetPoints().GetData())[:, 2] - 4).max() < 1e-3
assert (vtk_to_numpy(marks.GetPointData().GetArray("Fault")) == 0).all() and (vtk_to_numpy(marks.GetPointData().GetArray("Body")) == 0).all()
closed = run(cut, CloseHoles=True)
assert "1 hole closed" in closed.GetReport() and closed.GetNumberOfFaultyBodies() == 1 # as it came
assert run(closed.GetOutput()).GetReport() == ""
again = vtkPolyData()
again.SetPoints(closed.GetOutput().GetPoints())
again.SetPolys(closed.GetOutput().GetPolys())
assert run(again).GetNumberOfFaultyBodies() == 0

# Two balls that cross in one body cross; as two bodies they do not.
append = vtkAppendPolyData()
append.AddInputData(ball(10))
append.AddInputData(ball(10, 12))
append.Update()
crossing = run(append.GetOutput())
assert faults(crossing)["crossing"] > 20 and "self-intersections" in crossing.GetReport()
assert faults(run(append.GetOutput(), SelfIntersections=False))["crossing"] == 0
assert run(ball(10), ball(10, 12)).GetNumberOfFaultyBodies() == 0

# Materials by input, the last for all further ones; blocks as bodies, in their order, by their names.
several = run(ball(10), blocks(ball(3), ball(2), names=("outer", "inner")), ball(1), Materials="liver, vessel-wall,blood", Background="water")
assert field(several, "MaterialName") == ["water", "liver", "vessel-wall", "blood"]
assert field(several, "BodyMaterial").tolist() == [1, 2, 2, 3]
assert field(several, "BodyName") == ["liver", "vessel-wall outer", "vessel-wall inner", "blood"]
assert field(run(ball(1), ball(2), ball(3), Materials="bone"), "BodyMaterial").tolist() == [1, 1, 1]
nested = blocks(vtkPolyData(), blocks(ball(5), names=("deep",)), None, ball(2)) # what is empty is no block
assert field(run(nested, Materials="bone"), "BodyName") == ["bone deep", "bone"]
assert field(run(blocks(ball(3), ball(2), names=("outer",)), Materials="bone"), "BodyName") == ["bone outer", "bone"]
assert field(run(blocks(blocks(ball(3), ball(2)), names=("above",)), Materials="bone"), "BodyName") == ["bone above", "bone above"]

# Chosen blocks: patches become one body. The halves of a ball are open alone and closed together.
plane.SetNormal(0, 0, 1)
other = through(clip, ball(10))
halves = blocks(cut, ball(1, 30), other)
assert field(run(halves, Materials="liver"), "SurfaceFaults")[:, 0].min() == 0 and run(halves).GetNumberOfFaultyBodies() == 2
joined = run(halves, Materials="liver[0,2] + bone[1]")
assert joined.GetNumberOfFaultyBodies() == 0, joined.GetReport()
assert field(joined, "BodyMaterial").tolist() == [1, 2] and field(joined, "BodyName") == ["liver[0,2]", "bone[1]"]
assert run(halves, Materials="liver[*]").GetNumberOfFaultyBodies() == 0
assert len(field(run(halves, Materials="liver[0-1] + liver[2]"), "BodyMaterial")) == 2

# Tissue passes as it is, and joins what else there is.
source = vtkUltrasoundTissueSource()
source.SetCount(5)
source.Update()
mixed = run(ball(10), source.GetOutput(), Materials="bone", Scale=2)
names = lambda filter: [field(filter, "MaterialName")[i] for i in field(filter, "BodyMaterial")]
assert names(mixed) == ["bone", *names(source)]
bodies = vtk_to_numpy(mixed.GetOutput().GetCellData().GetArray("Body"))
assert (bodies > 0).sum() == source.GetOutput().GetNumberOfCells()
assert np.isnan(field(mixed, "SurfaceVolume")[1:]).all()

# Errors name what is wrong and leave nothing behind.
for filter, words in (
    (tissue_of(ball(1), Materials="livre"), "liver"),
    (tissue_of(ball(1), Materials="livre[0]"), "liver"),
    (tissue_of(ball(1), Materials=""), "no standard material"),
    (tissue_of(ball(1), Background="livre"), "livre"),
    (tissue_of(ball(1), Materials="liver[1]"), "names block 1; the input has 1"),
    (tissue_of(ball(1), Materials="liver[a]"), "liver[a]"),
    (tissue_of(ball(1), Materials="liver[]"), "liver[]"),
    (tissue_of(ball(1), Materials="liver[2-1]"), "liver[2-1]"),
    (tissue_of(ball(1), Materials="liver[-1]"), "liver[-1]"),
    (tissue_of(ball(1), Materials="liver[0] + bone"), "bone"),
    (tissue_of(ball(1), Materials="liver[0"), "liver[0"),
    (tissue_of(blocks(ball(1), source.GetOutput()), Materials="liver[*]"), "tissue already"),
    (tissue_of(vtkPolyData()), "no input has polygons"),
    (tissue_of(vtkMultiBlockDataSet()), "no input has polygons"),
    (tissue_of(), ""),
):
    errors = errors_of(filter)
    assert errors and words in errors, (words, errors)
    assert filter.GetOutput().GetNumberOfCells() == 0 and filter.GetOutput(1).GetNumberOfPoints() == 0
assert "Report" in str(filter)

# A triangle mesh of nothing but a point that is not a number: dropped, and told.
triangle = through(vtkTriangleFilter(), ball(10))
triangle.GetPoints().SetPoint(5, float("nan"), 0, 0)
spoiled = run(triangle)
assert faults(spoiled)["open"] > 0 and "left out" in spoiled.GetReport() and np.isfinite(vtk_to_numpy(spoiled.GetOutput().GetPoints().GetData())).all()

# Real organs, in metres and y up.
folder = os.path.join(os.environ.get("ECHORAMA_SOURCE_DIR", "."), "..", "shared", "data", "anatomy")
if not os.path.exists(os.path.join(folder, "VH_F_Liver.glb")):
    print(f"without the organs in {folder}")
    sys.exit(77)


def organ(name, materials, **properties):
    reader = vtkGLTFReader()
    reader.SetFileName(os.path.join(folder, f"VH_F_{name}.glb"))
    reader.Update()
    return run(reader.GetOutput(), Scale=1000, Axes=vtkUltrasoundTissueMeshes.Y_UP, Materials=materials, **properties)


# The segments of the liver are open one by one, and bound it together; it lies on the right (x < 0), below the chest.
segments = organ("Liver", "liver")
assert segments.GetNumberOfFaultyBodies() == 26
liver = organ("Liver", "liver[10-19]")
assert liver.GetReport() == "" and 1.2e6 < field(liver, "SurfaceVolume")[0] < 2.5e6 # 1.2 to 2.5 litres
bounds = np.array(liver.GetOutput().GetBounds()).reshape(3, 2)
assert 150 < np.ptp(bounds[0]) < 280 and bounds[0].mean() < 0
spleen = organ("Spleen", "spleen[*]")
assert spleen.GetReport() == "" and 1e5 < field(spleen, "SurfaceVolume")[0] < 3e5
assert np.array(spleen.GetOutput().GetBounds()).reshape(3, 2)[0].mean() > 50 # on the left
pancreas = organ("Pancreas", "pancreas[*]", CloseHoles=True)
assert faults(pancreas)["open"] == 16 and "1 hole closed" in pancreas.GetReport()
skin = organ("Skin", "skin", SelfIntersections=False)
assert skin.GetNumberOfFaultyBodies() == 0
reach = np.array(skin.GetOutput().GetBounds()).reshape(3, 2)
assert 1500 < np.ptp(reach[2]) < 1800 and ((reach[:, 0] < bounds[:, 0]) & (bounds[:, 1] < reach[:, 1])).all()
