#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The skin of volumes, of tissue and of meshes: where it lies, which way it looks, that it is closed, and what is refused."""
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkFeatureEdges, vtkReverseSense
from vtkmodules.vtkFiltersSources import vtkPlaneSource, vtkSphereSource

from echorama import vtkUltrasoundSkin, vtkUltrasoundTissueMeshes


def volume(size, spacing, inside, origin=(0, 0, 0), direction=np.eye(3), with_region=True):
    """A volume whose valid region is where inside(points of the world) holds."""
    image = vtkImageData()
    image.SetDimensions(*size)
    image.SetSpacing(*spacing)
    image.SetOrigin(*origin)
    image.SetDirectionMatrix(*np.ravel(direction).tolist())
    grid = np.stack(np.meshgrid(*(np.arange(n) for n in size), indexing="ij"), -1) * np.array(spacing) @ np.transpose(direction) + origin
    for name, values in (("Intensity", np.full(size, 100.0)), ("ValidRegion", inside(grid))):
        if name == "Intensity" or with_region:
            array = numpy_to_vtk(np.ascontiguousarray(values.transpose(2, 1, 0).ravel().astype("u1")), deep=True)
            array.SetName(name)
            image.GetPointData().AddArray(array)
    image.GetPointData().SetActiveScalars("Intensity")
    return image


def skin_of(data, **properties):
    skin = vtkUltrasoundSkin()
    skin.errors = []

    def said(_, event, text):
        skin.errors.append(text)
    said.CallDataType = "string0"
    skin.AddObserver(vtkCommand.ErrorEvent, said)
    for name, value in properties.items():
        getattr(skin, "Set" + name)(value)
    skin.SetInputDataObject(data)
    skin.Update()
    return skin


def parts(skin):
    """Points, normals of points, corners of triangles."""
    out = skin.GetOutput()
    assert not skin.errors, skin.errors
    triangles = vtk_to_numpy(out.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    assert out.GetNumberOfPolys() == len(triangles) == out.GetNumberOfCells()
    return vtk_to_numpy(out.GetPoints().GetData()).astype(float), vtk_to_numpy(out.GetPointData().GetNormals()), triangles


def open_edges(data):
    edges = vtkFeatureEdges()
    edges.SetInputData(data)
    edges.FeatureEdgesOff()
    edges.Update()
    return edges.GetOutput().GetNumberOfLines()


def volume_within(points, triangles):
    a, b, c = (points[triangles[:, i]] for i in range(3))
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


def refused(data, reason, **properties):
    skin = skin_of(data, **properties)
    assert any(reason in text for text in skin.errors), (reason, skin.errors)
    assert skin.GetOutput().GetNumberOfPoints() == 0


# A ball, upright and oblique, of voxels that are no cubes: where it is, which way it looks, that it is closed.
angle = 0.5
turned = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
size, spacing = np.array([90, 110, 80]), np.array([1.0, 0.8, 1.25])
for direction in (np.eye(3), turned):
    centre = np.array([5.0, -3.0, 20.0])
    origin = centre - direction @ ((size - 1) / 2 * spacing)
    ball = volume(size, spacing, lambda at: np.linalg.norm(at - centre, axis=-1) < 35, origin, direction)
    skin = skin_of(ball)
    points, normals, triangles = parts(skin)
    radii = np.linalg.norm(points - centre, axis=1)
    print(f"ball of 35 mm: radius {radii.mean():.3f} mm, RMS error {np.sqrt(((radii - 35) ** 2).mean()):.3f} mm, worst "
          f"{abs(radii - 35).max():.3f} mm, {len(triangles)} triangles")
    assert abs(radii.mean() - 35) < 0.15 and abs(radii - 35).max() < 0.8
    outwards = (points - centre) / radii[:, None]
    assert np.einsum("ij,ij->i", outwards, normals).min() > 0.95
    assert abs(volume_within(points - centre, triangles) / (4 / 3 * np.pi * 35**3) - 1) < 0.02  # and so turned outwards
    assert open_edges(skin.GetOutput()) == 0
rough = skin_of(ball, SmoothingSteps=0)
assert np.std(np.linalg.norm(parts(rough)[0] - centre, axis=1)) > np.std(radii)  # smoothing takes something away
coarse = skin_of(ball, MostCells=2000)
assert len(parts(coarse)[2]) < len(triangles) / 4 and abs(np.linalg.norm(parts(coarse)[0] - centre, axis=1).mean() - 35) < 1

# Where the region ends with its grid the skin is closed there, on the outer faces of the voxels or a little within.
box = volume((20, 30, 40), (1, 1, 1), lambda at: np.ones(at.shape[:-1]), with_region=False)
skin = skin_of(box)
points, normals, triangles = parts(skin)
assert open_edges(skin.GetOutput()) == 0
assert np.allclose(points.min(0), -0.5, atol=0.5) and np.allclose(points.max(0), np.array([20, 30, 40]) - 0.5, atol=0.5)
assert abs(volume_within(points, triangles) / (20 * 30 * 40) - 1) < 0.1
whole = skin_of(volume((20, 30, 40), (1, 1, 1), lambda at: np.ones(at.shape[:-1])))
assert np.array_equal(parts(whole)[0], points)  # no region: all of it

# A hole within is none of the skin, nor is a smaller piece beside it.
holed = volume((60, 60, 60), (1, 1, 1), lambda at: (np.linalg.norm(at - [25, 30, 30], axis=-1) < 20) & (np.linalg.norm(at - [25, 30, 30], axis=-1) > 8)
               | (np.linalg.norm(at - [54, 30, 30], axis=-1) < 4))
points = parts(skin_of(holed))[0]
assert abs(np.linalg.norm(points - [25, 30, 30], axis=1) - 20).max() < 1.5

# A slice is a thin body.
flat = skin_of(volume((40, 40, 1), (1, 1, 2), lambda at: np.linalg.norm(at[..., :2] - 20, axis=-1) < 15))
points = parts(flat)[0]
assert open_edges(flat.GetOutput()) == 0 and np.ptp(points[:, 2]) > 0.5 and np.ptp(points[:, 0]) > 25


def sphere(radius, where=(0, 0, 0)):
    source = vtkSphereSource()
    source.SetRadius(radius)
    source.SetCenter(*where)
    source.SetThetaResolution(24)
    source.SetPhiResolution(24)
    source.Update()
    return source.GetOutput()


# Of tissue the body that holds the others, wherever it is listed.
for order in ((10, 50), (50, 10)):
    meshes = vtkUltrasoundTissueMeshes()
    meshes.SetMaterials("liver")
    for radius in order:
        meshes.AddInputDataObject(sphere(radius))
    meshes.Update()
    points, normals, _ = parts(skin_of(meshes.GetOutput()))
    assert np.allclose(np.linalg.norm(points, axis=1), 50, atol=1e-3)
    assert np.einsum("ij,ij->i", points, normals).min() > 0

# A mesh that is turned inside out looks outwards; a patch that is open is taken as it is.
inside_out = vtkReverseSense()
inside_out.SetInputData(sphere(30))
inside_out.ReverseNormalsOn()
inside_out.Update()
points, normals, triangles = parts(skin_of(inside_out.GetOutput()))
assert np.einsum("ij,ij->i", points, normals).min() > 0 and volume_within(points, triangles) > 0
plane = vtkPlaneSource()
plane.Update()
assert len(parts(skin_of(plane.GetOutput()))[2]) == 2

# Refused, with a sentence.
refused(volume((20, 20, 20), (1, 1, 1), lambda at: np.zeros(at.shape[:-1])), "valid")
wrong = volume((20, 20, 20), (1, 1, 1), lambda at: np.ones(at.shape[:-1]))
wrong.GetPointData().GetArray("ValidRegion").SetNumberOfTuples(7)
refused(wrong, "the volume: its ValidRegion is not one unsigned char per voxel")
refused(volume((20, 20, 20), (1, 1, 1), lambda at: np.ones(at.shape[:-1]), direction=np.diag([1, -1, 1])), "not a rotation")
empty = vtkPolyData()
empty.SetPoints(vtkPoints())
refused(empty, "no triangle")
refused(ball, "MostCells", MostCells=10)

# It can be stopped, at any step, and run again.
stopped = vtkUltrasoundSkin()
stopped.SetInputData(ball)
steps = []
stopped.AddObserver(vtkCommand.ProgressEvent, lambda *_: (steps.append(stopped.GetProgress()), stopped.SetAbortExecute(steps[-1] >= limit)))
for limit in (0.01, 0.45, 0.65, 0.75, 0.9):
    stopped.Modified()
    stopped.Update()
    assert stopped.GetOutput().GetNumberOfPoints() == 0, limit
limit = 2
stopped.Modified()
stopped.Update()
assert stopped.GetOutput().GetNumberOfPoints() > 1000 and max(steps) >= 0.99
