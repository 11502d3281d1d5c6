#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""synthesis_tissue_figures.py [FOLDER [ANATOMY]]: how tissue is made, as pictures in FOLDER.

The first shows how an icosahedron becomes a sphere, and how fine spheres of one tissue are (dissertation, figures 3.3 and 3.4);
the second cuts through dense packings, with bodies as bright as they scatter (figure 3.5). With a folder ANATOMY of organs (VH_F_*.glb
of the Human Reference Atlas) the third shows them as tissue, and the fourth what a probe sees of them.
"""
import argparse
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import PolyCollection
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkIdList
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPlane, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkCutter, vtkStripper
from vtkmodules.vtkIOGeometry import vtkGLTFReader

from echorama import vtkUltrasoundSynthesizer, vtkUltrasoundTissueMeshes, vtkUltrasoundTissueSource

ORGANS = { # in the order in which they count, with the blocks that bound them
    "Skin": "fat",
    "Pelvis": "bone",
    "Liver": "liver[10-19]",
    "Spleen": "spleen[*]",
    "Pancreas": "pancreas[*]",
    "Kidney_L": "kidney[14]",
    "Kidney_R": "kidney[2] + " + " + ".join(f"lesion-dark[{pyramid}]" for pyramid in range(4, 14)),
    "Urinary_Bladder": "muscle[*]",
}
COLOURS = {"bone": (0.93, 0.90, 0.80), "liver": (0.62, 0.30, 0.24), "spleen": (0.50, 0.30, 0.46), "pancreas": (0.90, 0.75, 0.45),
           "kidney": (0.75, 0.42, 0.36), "lesion-dark": (0.6, 0.3, 0.3), "muscle": (0.80, 0.60, 0.62)}
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


def organs_of(folder):
    meshes = vtkUltrasoundTissueMeshes()
    meshes.SetScale(1000) # they are in metres
    meshes.SetAxes(vtkUltrasoundTissueMeshes.Y_UP)
    meshes.SetMaterials(", ".join(ORGANS.values()))
    meshes.SetBackground("air")
    meshes.CloseHolesOn()
    for name in ORGANS:
        reader = vtkGLTFReader()
        reader.SetFileName(str(folder / f"VH_F_{name}.glb"))
        meshes.AddInputConnection(reader.GetOutputPort())
    meshes.Update()
    print(meshes.GetReport())
    return meshes.GetOutput()


def organs(path, tissue):
    """Seen from the front, and cut across: the patient's left is on the right."""
    points, corners = mesh(tissue)
    materials = tissue.GetFieldData().GetAbstractArray("MaterialName")
    names = [materials.GetValue(i) for i in range(materials.GetNumberOfValues())]
    bodies = [names[material] for material in vtk_to_numpy(tissue.GetFieldData().GetArray("BodyMaterial"))]
    body = vtk_to_numpy(tissue.GetCellData().GetArray("Body"))

    figure, (front, across) = plt.subplots(1, 2, figsize=(9.5, 4.4), gridspec_kw={"width_ratios": (1, 1.18)})
    triangles = points[corners]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
    seen = (normals[:, 1] < 0) & np.array([bodies[i] in COLOURS for i in body]) # looking along +y, to the back
    order = np.argsort(-triangles[seen].mean(1)[:, 1])
    light = np.clip(normals[seen][order] @ np.array([-0.4, -0.8, 0.45]), 0, 1)
    colours = np.array([COLOURS[bodies[i]] for i in body[seen][order]])
    front.add_collection(PolyCollection(triangles[seen][order][:, :, (0, 2)], facecolors=colours * (0.3 + 0.7 * light)[:, None],
                                        edgecolors="face", linewidths=0.3, antialiaseds=False)) # else what is behind shines through
    front.set_xlim(-175, 175)
    front.set_ylim(-60, 445)
    front.set_aspect("equal")
    front.axis("off")

    height = 280.0 # of the cut, mm
    plane = vtkPlane()
    plane.SetOrigin(0, 0, height)
    plane.SetNormal(0, 0, 1)
    cutter = vtkCutter()
    cutter.SetCutFunction(plane)
    cutter.SetInputData(tissue)
    cutter.Update()
    properties = tissue.GetFieldData().GetArray("MaterialProperty")
    column = [i for i in range(properties.GetNumberOfComponents()) if properties.GetComponentName(i) == "BackscatterDb"][0]
    for which, name in enumerate(bodies):
        outlines = list(loops_of(cutter.GetOutput(), which))
        if outlines:
            grey = np.clip((properties.GetComponent(names.index(name), column) + 14) / 22, 0, 1)
            across.add_patch(PathPatch(Path.make_compound_path(*outlines), facecolor=str(grey), edgecolor="none"))
    front.axhline(height, color=(0.5, 0.5, 0.5), linewidth=0.6, zorder=9)
    across.set_facecolor("black")
    across.set_xlim(-190, 190)
    across.set_ylim(205, -115) # the front of the patient is above
    across.set_aspect("equal")
    across.set_xticks([])
    across.set_yticks([])
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.99, 0.02)
    figure.savefig(path, dpi=110)


def scan(path, tissue):
    """What a probe on the right flank sees, along the body: its head end is on the right."""
    synthesizer = vtkUltrasoundSynthesizer()
    synthesizer.SetInputData(tissue)
    synthesizer.SliceOnlyOn()
    synthesizer.SetPosition(-142, 85, 268)
    synthesizer.SetOrientation(-180 / 2**0.5, 0, -180 / 2**0.5) # beams to the patient's left, the fan along the body
    synthesizer.SetFanAngle(70)
    synthesizer.SetDepthMin(1)
    synthesizer.SetDepthMax(150)
    synthesizer.Update()
    image = synthesizer.GetOutput()
    plt.imsave(path, vtk_to_numpy(image.GetPointData().GetScalars()).reshape(image.GetDimensions()[1::-1]), cmap="gray", vmin=0, vmax=255)


def loops_of(cut, body):
    """The closed lines of a body in a cut, as paths that go round alike."""
    lines = vtk_to_numpy(cut.GetLines().GetConnectivityArray()).reshape(-1, 2)[vtk_to_numpy(cut.GetCellData().GetArray("Body")) == body]
    part = vtkPolyData()
    part.SetPoints(cut.GetPoints())
    cells = vtkCellArray()
    for a, b in lines:
        cells.InsertNextCell(2, (a, b))
    part.SetLines(cells)
    strips = vtkStripper()
    strips.SetInputData(part)
    strips.SetMaximumLength(100000)
    strips.JoinContiguousSegmentsOn()
    strips.Update()
    points = vtk_to_numpy(cut.GetPoints().GetData())[:, :2]
    ids = vtkIdList()
    strips.GetOutput().GetLines().InitTraversal()
    while strips.GetOutput().GetLines().GetNextCell(ids):
        yield Path(points[[ids.GetId(i) for i in range(ids.GetNumberOfIds())]], closed=True)


arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
arguments.add_argument("folder", nargs="?", type=pathlib.Path, default=pathlib.Path("."))
arguments.add_argument("anatomy", nargs="?", type=pathlib.Path)
arguments = arguments.parse_args()
folder = arguments.folder
folder.mkdir(parents=True, exist_ok=True)
levels(folder / "TissueSourceLevels.png")
packings(folder / "TissueSource.png")
if arguments.anatomy:
    anatomy = organs_of(arguments.anatomy)
    organs(folder / "TissueMeshes.png", anatomy)
    scan(folder / "TissueMeshesScan.png", anatomy)
