#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped carver: the side of a shape that is taken away leaves the valid region, and nothing else."""
import math

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkBox, vtkImageData, vtkImplicitFunction, vtkPlane, vtkSphere
from vtkmodules.vtkCommonTransforms import vtkTransform

from echorama import vtkUltrasoundCarver

SIZE = (30, 26, 22)
c, s = math.cos(0.3), math.sin(0.3)


def volume(valid=True):
    image = vtkImageData()
    image.SetExtent(4, 33, -3, 22, 7, 28)
    image.SetSpacing(0.9, 1.1, 1.3)
    image.SetOrigin(3, -7, 11)
    image.SetDirectionMatrix([0, -1, 0, c, 0, s, -s, 0, c])
    values = np.random.default_rng(1).integers(20, 200, np.prod(SIZE)).astype(np.uint8)
    arrays = [("Intensity", values)]
    if valid:
        arrays.append(("ValidRegion", (np.arange(len(values)) % SIZE[0] > 8).astype(np.uint8)))
    for name, array in arrays:
        data = numpy_to_vtk(array, deep=True)
        data.SetName(name)
        image.GetPointData().AddArray(data)
    image.GetPointData().SetActiveScalars("Intensity")
    return image


def voxels(image, name):
    return vtk_to_numpy(image.GetPointData().GetArray(name)).copy()


image = volume()
points = np.array([image.GetPoint(i) for i in range(image.GetNumberOfPoints())])
middle = points.mean(0)
grey, valid = voxels(image, "Intensity"), voxels(image, "ValidRegion")

sphere = vtkSphere()
sphere.SetCenter(middle)
sphere.SetRadius(8)
in_sphere = np.linalg.norm(points - middle, axis=1) <= 8

box = vtkBox()
box.SetBounds(-6, 6, -5, 5, -9, 9)
turn = vtkTransform() # from the world to the box
turn.RotateWXYZ(-35, 1, 2, 3)
turn.Translate(-middle)
box.SetTransform(turn)
inner = np.array([turn.TransformPoint(point) for point in points])
in_box = (np.abs(inner) <= [6, 5, 9]).all(1)

plane = vtkPlane()
plane.SetOrigin(middle)
plane.SetNormal(1, 1, 0)
behind = (points - middle) @ [1, 1, 0] <= 0

carver = vtkUltrasoundCarver()
carver.SetInputData(image)
carver.Update()
assert np.array_equal(voxels(carver.GetOutput(), "ValidRegion"), valid), "without a shape nothing is taken away"
for shape, inside in ((sphere, in_sphere), (box, in_box), (plane, behind)):
    assert 500 < inside.sum() < len(inside) - 500
    carver.SetShape(shape)
    for take, gone in ((carver.INSIDE, inside), (carver.OUTSIDE, ~inside)):
        carver.SetTakeAway(take)
        carver.Update()
        output = carver.GetOutput()
        assert np.array_equal(voxels(output, "ValidRegion"), valid * ~gone), (shape.GetClassName(), take)
        assert np.array_equal(voxels(output, "Intensity"), grey)
        assert output.GetExtent() == image.GetExtent() and output.GetOrigin() == image.GetOrigin()
assert np.array_equal(voxels(image, "ValidRegion"), valid), "the input is as it was"

# The shape is followed; without it all is as before.
carver.SetTakeAwayToInside()
carver.SetShape(sphere)
carver.Update()
sphere.SetRadius(4)
carver.Update()
assert np.array_equal(voxels(carver.GetOutput(), "ValidRegion"), valid * ~(np.linalg.norm(points - middle, axis=1) <= 4))
carver.SetShape(None)
carver.Update()
assert np.array_equal(voxels(carver.GetOutput(), "ValidRegion"), valid)

# A volume without a valid region gets one.
whole = vtkUltrasoundCarver()
whole.SetInputData(volume(valid=False))
sphere.SetRadius(8)
whole.SetShape(sphere)
whole.Update()
assert np.array_equal(voxels(whole.GetOutput(), "ValidRegion"), (~in_sphere).astype(np.uint8))
assert isinstance(whole.GetShape(), vtkImplicitFunction)
