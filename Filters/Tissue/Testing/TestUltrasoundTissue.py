# SPDX-License-Identifier: BSD-3-Clause
"""Tissue as vtkPolyData: what VTK's own filters may do to it, through a file and back, and what is said of arrays that do not fit."""
import os
import tempfile

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkDoubleArray, vtkFloatArray, vtkIntArray, vtkStringArray
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPlane, vtkPolyData
from vtkmodules.vtkCommonTransforms import vtkTransform
from vtkmodules.vtkFiltersCore import vtkClipPolyData
from vtkmodules.vtkFiltersGeneral import vtkTransformPolyDataFilter
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLPolyDataWriter

from echorama.EchoramaFiltersTissue import vtkUltrasoundTissue, vtkUltrasoundTissueMeshes, vtkUltrasoundTissueSource


def through(filter, data):
    filter.SetInputData(data)
    filter.Update()
    output = vtkPolyData()
    output.ShallowCopy(filter.GetOutput()) # the filter may run again
    return output


def read_back(data):
    """As a filter that uses tissue reads it: the output, and the errors."""
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    filter = vtkUltrasoundTissueMeshes()
    filter.AddInputDataObject(data)
    for each in (filter, filter.GetExecutive()):
        each.AddObserver(vtkCommand.ErrorEvent, note)
    filter.Update()
    return filter.GetOutput(), " ".join(messages)


def field(data, name):
    array = data.GetFieldData().GetAbstractArray(name)
    return [array.GetValue(i) for i in range(array.GetNumberOfValues())] if isinstance(array, vtkStringArray) else vtk_to_numpy(array)


def cells(data, name="Body"):
    return vtk_to_numpy(data.GetCellData().GetArray(name))


source = vtkUltrasoundTissueSource()
source.SetBox(-20, 20, -20, 20, 0, 40)
source.SetRadiusMin(2)
source.SetRadiusMax(6)
source.Update()
tissue = source.GetOutput()
assert vtkUltrasoundTissue.IsTissue(tissue) and not vtkUltrasoundTissue.IsTissue(vtkPolyData()) and not vtkUltrasoundTissue.IsTissue(None)

# Read back it is the same, but for a background that its reader brings. (Materials are listed as bodies use them.)
same, errors = read_back(tissue)
assert errors == ""
assert (vtk_to_numpy(same.GetPoints().GetData()) == vtk_to_numpy(tissue.GetPoints().GetData())).all()
assert (vtk_to_numpy(same.GetPolys().GetConnectivityArray()) == vtk_to_numpy(tissue.GetPolys().GetConnectivityArray())).all()
assert (cells(same) == cells(tissue)).all()


def materials_of_cells(data):
    names, properties = field(data, "MaterialName"), field(data, "MaterialProperty")
    return [(names[material], *properties[material]) for material in cells(data, "Material")]


assert materials_of_cells(same) == materials_of_cells(tissue)

# Through a file.
with tempfile.TemporaryDirectory() as folder:
    path = os.path.join(folder, "tissue.vtp")
    writer = vtkXMLPolyDataWriter()
    writer.SetFileName(path)
    writer.SetInputData(tissue)
    assert writer.Write() == 1
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(path)
    reader.Update()
    stored, errors = read_back(reader.GetOutput())
    assert errors == "" and materials_of_cells(stored) == materials_of_cells(tissue)
    assert (vtk_to_numpy(stored.GetPoints().GetData()) == vtk_to_numpy(tissue.GetPoints().GetData())).all()

# Moved by VTK, bodies stay what they are.
move = vtkTransform()
move.Translate(10, 20, 30)
mover = vtkTransformPolyDataFilter()
mover.SetTransform(move)
moved, errors = read_back(through(mover, tissue))
assert errors == "" and materials_of_cells(moved) == materials_of_cells(tissue)
assert np.allclose(np.subtract(moved.GetBounds(), tissue.GetBounds()), (10, 10, 20, 20, 30, 30), atol=1e-4)

# Cut by VTK: the cells that are left, and the pieces of those that were cut, keep their bodies.
plane = vtkPlane()
plane.SetOrigin(0, 0, 20)
plane.SetNormal(0, 0, 1)
clip = vtkClipPolyData()
clip.SetClipFunction(plane)
cut = through(clip, tissue)
half, errors = read_back(cut)
assert errors == "", errors
assert 0 < half.GetNumberOfCells() < tissue.GetNumberOfCells() and half.GetBounds()[4] > 20 - 1e-4
spheres = field(tissue, "Spheres")
points, corners = vtk_to_numpy(half.GetPoints().GetData()), vtk_to_numpy(half.GetPolys().GetConnectivityArray()).reshape(-1, 3)
middles = points[corners].mean(1)
way = np.linalg.norm(middles - spheres[cells(half), :3], axis=1) - spheres[cells(half), 3]
assert way.max() < 1e-4 and way.min() > -0.3 # on the spheres of their bodies
lost = set(range(len(spheres))) - set(cells(half))
assert lost and all(spheres[i, 2] < 20 for i in lost) # bodies without triangles remain listed
assert len(field(half, "BodyMaterial")) == len(spheres)

# Polygons and strips are cut into triangles, with the body of their cell; vertices and lines are left out.
square = vtkPolyData()
square.DeepCopy(tissue)
first = square.GetNumberOfCells()
polygon = vtkCellArray()
strip = vtkCellArray()
vertex = vtkCellArray()
for i in range(first):
    polygon.InsertNextCell(3, [square.GetCell(i).GetPointId(k) for k in range(3)])
corner = [square.GetPoints().InsertNextPoint(x, y, 90) for x, y in ((0, 0), (5, 0), (5, 5), (0, 5))]
polygon.InsertNextCell(4, corner)
strip.InsertNextCell(5, [0, 1, 2, 3, 4])
vertex.InsertNextCell(1, [0])
square.SetPolys(polygon)
square.SetStrips(strip)
square.SetVerts(vertex)
square.GetCellData().Initialize()
body = vtkFloatArray() # of any type
body.SetName("Body")
for value in [9, *cells(tissue), 1, 2]:
    body.InsertNextValue(value)
square.GetCellData().AddArray(body)
triangles, errors = read_back(square)
assert errors == "", errors
assert triangles.GetNumberOfCells() == first + 2 + 3
assert (cells(triangles) == [*cells(tissue), 1, 1, 2, 2, 2]).all()


# What does not fit is named.
def spoiled(spoil):
    data = vtkPolyData()
    data.DeepCopy(tissue)
    spoil(data)
    return read_back(data)


def with_field(array, name, tuples):
    array.SetName(name)
    array.SetNumberOfComponents(len(tuples[0]))
    for values in tuples:
        array.InsertNextTuple(values)
    return array


def replace_bodies(data, values, array=None):
    array = array or vtkIntArray()
    array.SetName("Body")
    for value in values:
        array.InsertNextValue(value)
    data.GetCellData().AddArray(array)


def set_property(data, component, value):
    array = data.GetFieldData().GetArray("MaterialProperty")
    names = [array.GetComponentName(i) for i in range(array.GetNumberOfComponents())]
    array.SetComponent(1, names.index(component), value)


count = tissue.GetNumberOfCells()
for spoil, words in (
    (lambda d: d.GetCellData().RemoveArray("Body"), "Body"),
    (lambda d: replace_bodies(d, [0] * (count - 1)), "Body"),
    (lambda d: replace_bodies(d, [len(spheres)] * count), "body"),
    (lambda d: replace_bodies(d, [-1] * count), "Body"),
    (lambda d: replace_bodies(d, [0.5] * count, vtkFloatArray()), "Body"),
    (lambda d: replace_bodies(d, [float("nan")] * count, vtkFloatArray()), "Body"),
    (lambda d: d.GetFieldData().RemoveArray("BodyMaterial"), "body"),
    (lambda d: d.GetFieldData().AddArray(with_field(vtkIntArray(), "BodyMaterial", [(7,)] * len(spheres))), "material"),
    (lambda d: d.GetFieldData().RemoveArray("MaterialProperty"), "MaterialProperty"),
    (lambda d: d.GetFieldData().AddArray(with_field(vtkDoubleArray(), "MaterialProperty", [(1.0, 2.0)] * 5)), "MaterialProperty"),
    (lambda d: d.GetFieldData().GetAbstractArray("MaterialName").SetNumberOfValues(3), "Material"),
    (lambda d: d.GetFieldData().AddArray(with_field(vtkDoubleArray(), "MaterialName", [(1.0,)] * 5)), "MaterialName"),
    (lambda d: set_property(d, "SoundSpeed", -1.0), "SoundSpeed is -1 m/s"),
    (lambda d: set_property(d, "Density", float("nan")), "Density is nan"),
    (lambda d: d.GetPoints().SetPoint(3, float("inf"), 0, 0), "point (3)"),
):
    data, errors = spoiled(spoil)
    assert words in errors, (words, errors)
    assert data.GetNumberOfCells() == 0
