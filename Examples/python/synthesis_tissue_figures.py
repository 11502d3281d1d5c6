#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""synthesis_tissue_figures.py [FOLDER]: how packed tissue is made, as pictures in FOLDER.

The first shows how an icosahedron becomes a sphere, and how fine spheres of one tissue are (dissertation, figures 3.3 and 3.4);
the second cuts through dense packings, with bodies as bright as they scatter (figure 3.5).
"""
import argparse
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkPlane
from vtkmodules.vtkFiltersCore import vtkCutter

from echorama import vtkUltrasoundTissueSource

DEVIATIONS = (0.2053, 0.0658, 0.01775, 0.00453) # of levels 0 to 3, per radius


def mesh(data):
    """Points and the corners of triangles."""
    return vtk_to_numpy(data.GetPoints().GetData()).astype(float), vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)


def icosphere(level):
    source = vtkUltrasoundTissueSource()
    source.SetBox(-10, 10, -10, 10, -10, 10)
    source.SetRadiusMin(10)
    source.SetRadiusMax(10)
    source.SetFillFraction(1)
    source.SetCount(1)
    source.TurnedOff()
    source.SetCellMm(1)
    source.SetDeviation(10 * 1.05 * DEVIATIONS[level])
    source.Update()
    return mesh(source.GetOutput())


def split(points, corners):
    """Each triangle cut into four that stay flat."""
    a, b, c = points[corners[:, 0]], points[corners[:, 1]], points[corners[:, 2]]
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    triangles = np.concatenate([np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return triangles.reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)


def draw(axis, points, corners, colour=(0.62, 0.72, 0.86), title="", extent=10.8):
    """Triangles, seen from in front and a bit from above, lit from above left."""
    turn = np.deg2rad(20), np.deg2rad(18)
    across = np.array([[np.cos(turn[0]), np.sin(turn[0]), 0], [-np.sin(turn[0]), np.cos(turn[0]), 0], [0, 0, 1]])
    down = np.array([[1, 0, 0], [0, np.cos(turn[1]), np.sin(turn[1])], [0, -np.sin(turn[1]), np.cos(turn[1])]])
    triangles = (points @ (down @ across).T)[corners]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    seen = normals[:, 1] < 0 # looking along +y
    order = np.argsort(-triangles[seen].mean(1)[:, 1])
    light = np.clip(normals[seen][order] @ (np.array([-0.5, -0.7, 0.6]) / 1.05), 0, 1)
    faces = np.asarray(colour) * (0.35 + 0.65 * light)[:, None]
    axis.add_collection(PolyCollection(triangles[seen][order][:, :, (0, 2)], facecolors=np.clip(faces, 0, 1), edgecolors=(0.1, 0.1, 0.15), linewidths=0.5))
    axis.set_xlim(-extent, extent)
    axis.set_ylim(-extent, extent)
    axis.set_aspect("equal")
    axis.axis("off")
    axis.set_title(title, fontsize=8, pad=2)


def levels(path):
    figure, axes = plt.subplots(2, 4, figsize=(9, 4.9))
    start = icosphere(0)
    flat = split(*start)
    once = icosphere(1)
    draw(axes[0, 0], *start, title="an icosahedron")
    draw(axes[0, 1], *flat, title="each triangle in four")
    draw(axes[0, 2], *once, title="corners out to the sphere")
    draw(axes[0, 3], *split(*once), title="and again")
    for level, axis in enumerate(axes[1]):
        points, corners = icosphere(level)
        draw(axis, points, corners, (0.86, 0.70, 0.55), f"level {level}: {len(corners)} triangles, within {100 * DEVIATIONS[level]:.2g}%")
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.95, 0.02, 0.12)
    figure.savefig(path, dpi=90)


def section(axis, data, title):
    """The bodies in the plane y = 0, as grey as they scatter."""
    cutter = vtkCutter()
    plane = vtkPlane()
    plane.SetNormal(0, 1, 0)
    cutter.SetCutFunction(plane)
    cutter.SetInputData(data)
    cutter.Update()
    cut = cutter.GetOutput()
    points = vtk_to_numpy(cut.GetPoints().GetData())[:, (0, 2)]
    lines = vtk_to_numpy(cut.GetLines().GetConnectivityArray()).reshape(-1, 2)
    body = vtk_to_numpy(cut.GetCellData().GetArray("Body"))
    material = vtk_to_numpy(data.GetFieldData().GetArray("BodyMaterial"))
    properties = data.GetFieldData().GetArray("MaterialProperty")
    column = [i for i in range(properties.GetNumberOfComponents()) if properties.GetComponentName(i) == "BackscatterDb"][0]
    grey = np.clip((vtk_to_numpy(properties)[:, column] + 16) / 24, 0, 1)
    outlines, greys = [], []
    for which in np.unique(body): # a cut through a convex body is convex
        corners = points[lines[body == which].ravel()]
        way = corners - corners.mean(0)
        outlines.append(corners[np.argsort(np.arctan2(way[:, 1], way[:, 0]))])
        greys.append(str(grey[material[which]]))
    axis.add_collection(PolyCollection(outlines, facecolors=greys, edgecolors="none"))
    axis.set_facecolor(str(grey[0]))
    axis.set_xlim(-50, 50)
    axis.set_ylim(100, 0)
    axis.set_aspect("equal")
    axis.set_xticks([])
    axis.set_yticks([])
    axis.set_title(title, fontsize=9, pad=3)


def packings(path):
    figure, axes = plt.subplots(1, 3, figsize=(10.5, 3.75))
    for axis, method, fill, misses, name in ((axes[0], vtkUltrasoundTissueSource.RANDOM, 0.3, 20000, "random"),
                                             (axes[1], vtkUltrasoundTissueSource.RANDOM, 0.6, 20000, "random"),
                                             (axes[2], vtkUltrasoundTissueSource.EMPTY_SPACE, 0.6, 20000, "empty space")):
        source = vtkUltrasoundTissueSource()
        source.SetMethod(method)
        source.SetRadiusMin(0.7)
        source.SetRadiusMax(9)
        source.SetFillFraction(fill)
        source.SetMisses(misses)
        source.SetCellMm(0.5)
        source.Update()
        section(axis, source.GetOutput(), f"{name}: {source.GetSphereCount()} spheres, {100 * source.GetPackedFillFraction():.1f}%")
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.94, 0.03)
    figure.savefig(path, dpi=90)


arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
arguments.add_argument("folder", nargs="?", type=pathlib.Path, default=pathlib.Path("."))
folder = arguments.parse_args().folder
folder.mkdir(parents=True, exist_ok=True)
levels(folder / "TissueSourceLevels.png")
packings(folder / "TissueSource.png")
