# SPDX-License-Identifier: BSD-3-Clause
"""Blocks of tissue, and probes above and in their skin, for tests of what a probe presses."""
import unittest

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkFiltersCore import vtkTriangleFilter
from vtkmodules.vtkFiltersSources import vtkCubeSource, vtkSphereSource

import echorama

acquisition = echorama.vtkUltrasoundAcquisition
TOP, BACK = 20.0, 55.0  # of the block, which is 60 mm wide


def block():
    source = vtkCubeSource()
    source.SetBounds(-30.0, 30.0, -30.0, 30.0, TOP, BACK)
    return source


def ball(radius, x, y, z):
    source = vtkSphereSource()
    source.SetRadius(radius)
    source.SetCenter(x, y, z)
    source.SetThetaResolution(24)
    source.SetPhiResolution(24)
    return source


def tissue(**bodies):
    """Sources by the names of their materials, the outermost first."""
    made = echorama.vtkUltrasoundTissueMeshes()
    made.SetMaterials(", ".join(name.replace("_", "-") for name in bodies))
    for source in bodies.values():
        triangles = vtkTriangleFilter()
        triangles.SetInputConnection(source.GetOutputPort())
        triangles.Update()
        made.AddInputDataObject(triangles.GetOutput())
    made.Update()
    return made.GetOutput()


def add_field(data, name, values):
    array = numpy_to_vtk(np.array([values], float), deep=True)
    array.SetName(name)
    data.GetFieldData().AddArray(array)


def probe(depth, x=0.0):
    """A convex one, the middle of whose face is so deep below the skin."""
    data = vtkPolyData()
    pose = np.eye(4)
    pose[:3, 3] = (x, 0.0, TOP + depth)
    add_field(data, acquisition.ProbeGeometryName(), [57.0, 25.0, 30.0, 12.0, 0.0, 100.0])
    add_field(data, acquisition.ProbeToWorldName(), pose.ravel())
    return data


class Refusing(unittest.TestCase):
    def refused(self, filter, *words):
        errors = []
        observe = lambda caller, event, text="": errors.append(text)
        observe.CallDataType = "string0"
        for one in (filter, filter.GetExecutive()):
            one.AddObserver(vtkCommand.ErrorEvent, observe)
        filter.Update()
        self.assertTrue(errors, "nothing was refused")
        for word in words:
            self.assertIn(word, errors[0])
        self.assertEqual(filter.GetOutput().GetNumberOfPoints(), 0)
