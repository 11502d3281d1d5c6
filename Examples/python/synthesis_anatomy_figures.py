#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""synthesis_anatomy_figures.py [--scan] [FOLDER]: the invented abdomen and the calibration rig as pictures in FOLDER.

AnatomySource.png: the abdomen cut open, its organs, and the rig; needs a display (xvfb-run gives one where there is none).
AnatomyScan.png: the abdomen as ultrasound shows it. With --scan this one alone.
"""
import argparse
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 - the renderer
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPlane, vtkPlaneCollection, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkPolyDataNormals
from vtkmodules.vtkFiltersGeneral import vtkClipClosedSurface
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter

from echorama import vtkUltrasoundAnatomySource, vtkUltrasoundSynthesizer

COLOURS = {
    "skin": (0.87, 0.68, 0.58), "subcutaneous-fat": (0.95, 0.87, 0.60), "fascia": (0.96, 0.96, 0.93), "muscle-wall": (0.72, 0.32, 0.29),
    "mesentery": (0.83, 0.66, 0.60), "lobule-bright": (0.93, 0.83, 0.62), "lobule-dark": (0.80, 0.58, 0.52), "bowel-wall": (0.74, 0.47, 0.44),
    "bowel": (0.66, 0.56, 0.42), "fat-septum": (0.98, 0.97, 0.90), "muscle-septum": (0.90, 0.62, 0.56), "bone": (0.93, 0.91, 0.84), "liver": (0.52, 0.22, 0.18),
    "capsule": (0.80, 0.62, 0.56), "kidney": (0.62, 0.29, 0.25), "kidney-medulla": (0.45, 0.16, 0.16),
    "renal-sinus": (0.94, 0.86, 0.62), "bile": (0.42, 0.58, 0.25), "stone": (0.95, 0.93, 0.80), "cyst": (0.45, 0.68, 0.80),
    "lesion-dark": (0.30, 0.24, 0.34), "lesion-bright": (0.96, 0.76, 0.42), "blood": (0.25, 0.33, 0.70),
    "vessel-wall": (0.76, 0.80, 0.88), "glass": (0.65, 0.80, 0.85), "nylon": (0.90, 0.90, 0.86),
}


def bodies_of(tissue):
    """(name, material, surface) of each body, in their order."""
    field = tissue.GetFieldData()
    materials, numbers = field.GetAbstractArray("MaterialName"), field.GetArray("BodyMaterial")
    names = field.GetAbstractArray("BodyName")
    places = vtk_to_numpy(tissue.GetPoints().GetData())
    corners = vtk_to_numpy(tissue.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    owner = vtk_to_numpy(tissue.GetCellData().GetArray("Body"))
    for body in range(numbers.GetNumberOfTuples()):
        used, triangles = np.unique(corners[owner == body], return_inverse=True)
        points, cells, surface = vtkPoints(), vtkCellArray(), vtkPolyData()
        points.SetData(numpy_to_vtk(places[used], deep=True))
        triangles = triangles.reshape(-1).astype(np.int64)
        cells.SetData(numpy_to_vtk(np.arange(0, len(triangles) + 1, 3, dtype=np.int64), deep=True), numpy_to_vtk(triangles, deep=True))
        surface.SetPoints(points)
        surface.SetPolys(cells)
        yield names.GetValue(body), materials.GetValue(int(numbers.GetTuple1(body))), surface


def cut(surface, planes, outward):
    """A closed surface cut open, its cuts closed; moved outward so that bodies which count more lie on top of the cut."""
    collection = vtkPlaneCollection()
    for origin, normal in planes:
        plane = vtkPlane()
        plane.SetOrigin([o - outward * n for o, n in zip(origin, normal)])
        plane.SetNormal(normal)
        collection.AddItem(plane)
    clip = vtkClipClosedSurface()
    clip.SetInputData(surface)
    clip.SetClippingPlanes(collection)
    clip.Update()
    out = vtkPolyData()
    out.ShallowCopy(clip.GetOutput())
    return out


def add(renderer, surface, colour, opacity=1.0, smooth=True):
    normals = vtkPolyDataNormals()
    normals.SetInputData(surface)
    normals.SetFeatureAngle(40 if smooth else 1)
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(normals.GetOutputPort())
    mapper.ScalarVisibilityOff()
    actor = vtkActor()
    actor.SetMapper(mapper)
    look = actor.GetProperty()
    look.SetColor(colour)
    look.SetOpacity(opacity)
    look.SetAmbient(0.25)
    look.SetDiffuse(0.75)
    look.SetSpecular(0.15)
    look.SetSpecularPower(20)
    renderer.AddActor(actor)


def panel(window, left, right, eye, focus, zoom):
    renderer = vtkRenderer()
    renderer.SetViewport(left, 0.0, right, 1.0)
    renderer.SetBackground(1, 1, 1)
    renderer.UseDepthPeelingOn()
    renderer.SetMaximumNumberOfPeels(6)
    renderer.UseFXAAOn()
    window.AddRenderer(renderer)
    camera = renderer.GetActiveCamera()
    camera.SetFocalPoint(focus)
    camera.SetPosition([f + 600 * e for f, e in zip(focus, eye)])
    camera.SetViewUp(0, 0, -1) # the probe is above
    camera.SetViewAngle(zoom)
    return renderer


def scan(path):
    """Planes of three places of a probe that slides along x."""
    source = vtkUltrasoundAnatomySource()
    scanner = vtkUltrasoundSynthesizer()
    scanner.SetInputConnection(source.GetOutputPort())
    scanner.SliceOnlyOn()
    scanner.SetDepthMax(140)
    scanner.SetElements(128)
    scanner.SetSamples(500)
    scanner.SetSpacingMm(0.4)
    scanner.SetGainDb(4)
    scanner.SetNoiseDb(-65)
    figure, axes = plt.subplots(1, 3, figsize=(12, 3.3), facecolor="black")
    for axis, (x, place) in zip(axes, ((-40, -0.05), (0, 0.1), (45, -0.05))):
        scanner.SetPosition(x, 0, 0)
        scanner.SetSlicePosition(place)
        scanner.Update()
        image = scanner.GetOutput()
        values = vtk_to_numpy(image.GetPointData().GetArray("Intensity")).reshape(image.GetDimensions()[::-1]).squeeze()
        axis.imshow(values, cmap="gray", vmin=0, vmax=255)
        axis.axis("off")
    figure.subplots_adjust(0, 0, 1, 1, 0.01, 0)
    figure.savefig(path, dpi=85, facecolor="black")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", default=".", type=pathlib.Path)
    parser.add_argument("--scan", action="store_true")
    options = parser.parse_args()
    folder = options.folder
    folder.mkdir(parents=True, exist_ok=True)
    scan(folder / "AnatomyScan.png")
    if options.scan:
        return
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetAlphaBitPlanes(1)
    window.SetMultiSamples(0) # which translucent bodies need
    window.SetSize(1320, 430)

    source = vtkUltrasoundAnatomySource()
    source.Update()
    whole = panel(window, 0.0, 0.41, (-0.25, 0.90, -0.34), (0, -15, 96), 29)
    inside = panel(window, 0.41, 0.76, (-0.12, 0.92, -0.36), (-8, 0, 92), 22)
    layers = ("skin", "fat", "outer fascia", "muscle", "inner fascia", "trunk")
    shown = 0
    for name, material, surface in bodies_of(source.GetOutput()):
        opened = cut(surface, [((0, -8, 0), (0, -1, 0))], 0.004 * shown)
        if opened.GetNumberOfCells():
            shown += 1
            add(whole, opened, COLOURS[material], smooth=False)
        if name in layers or "septum" in name or "capsule" in name or "wall" in name or name in ("lobule", "bowel"):
            continue
        see_through = {"liver": 0.22, "kidney": 0.35, "gallbladder": 0.45}.get(name, 1.0)
        colour = (0.72, 0.25, 0.25) if name == "aorta" else (0.30, 0.45, 0.55) if name == "hepatic vein" else COLOURS[material]
        add(inside, surface, colour, see_through)

    source.SetKindToCalibrationRig()
    source.Update()
    rig = panel(window, 0.76, 1.0, (-0.35, 0.85, -0.45), (0, 0, 76), 17)
    for name, material, surface in bodies_of(source.GetOutput()):
        add(rig, surface, COLOURS[material], 0.4 if material == "glass" else 1.0)

    for renderer in (whole, inside, rig):
        renderer.ResetCameraClippingRange()
    window.Render()
    shot = vtkWindowToImageFilter()
    shot.SetInput(window)
    shot.ReadFrontBufferOff()
    writer = vtkPNGWriter()
    writer.SetFileName(str(folder / "AnatomySource.png"))
    writer.SetInputConnection(shot.GetOutputPort())
    writer.Write()


if __name__ == "__main__":
    main()
