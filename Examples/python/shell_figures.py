#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""shell_figures.py [--resolution MM] [FOLDER]: the printed skin of an invented abdomen, as a picture in FOLDER: from outside with its
calibration points, cut open over its base, and the base from below.

Needs a display (xvfb-run gives one where there is none).
"""
import argparse
import pathlib

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 - the renderer
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkPlane, vtkPlaneCollection
from vtkmodules.vtkFiltersCore import vtkGlyph3D, vtkPolyDataNormals
from vtkmodules.vtkFiltersGeneral import vtkClipClosedSurface
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter

from echorama import vtkUltrasoundShell


def abdomen():
    """As the benchmark's: 300 x 240 x 190 mm, front upwards."""
    source = vtkSphereSource()
    source.SetThetaResolution(180)
    source.SetPhiResolution(90)
    source.Update()
    body = source.GetOutput()
    d = vtk_to_numpy(body.GetPoints().GetData()).astype(float)
    d /= np.linalg.norm(d, axis=1)[:, None]
    axes = np.where(d[:, 2:] > 0, [[150.0, 120.0, 120.0]], [[150.0, 120.0, 70.0]])
    radius = 1 / np.linalg.norm(d / axes, axis=1)
    middle = np.array([-0.08, 0, 1]) / np.hypot(0.08, 1)
    radius -= 5 * np.exp(-np.arccos(np.minimum(1, d @ middle)) ** 2 / (2 * 0.05**2))
    radius += 6 * np.exp(-((d[:, 0] - 0.55) / 0.2) ** 2) * np.maximum(0, d[:, 2]) * (1 - d[:, 1] ** 2)
    body.GetPoints().SetData(numpy_to_vtk(radius[:, None] * d, deep=True))
    body.GetPointData().Initialize()
    return body


def shown(data, colour, down=0.0):
    normals, mapper, actor = vtkPolyDataNormals(), vtkPolyDataMapper(), vtkActor()
    normals.SetInputData(data)
    normals.SetFeatureAngle(40)
    mapper.SetInputConnection(normals.GetOutputPort())
    mapper.ScalarVisibilityOff()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*colour)
    actor.GetProperty().SetAmbient(0.25)
    actor.GetProperty().SetDiffuse(0.8)
    actor.SetPosition(0, 0, -down)
    return actor


def dots(points, radius):
    ball, glyphs, mapper, actor = vtkSphereSource(), vtkGlyph3D(), vtkPolyDataMapper(), vtkActor()
    ball.SetRadius(radius)
    glyphs.SetInputData(points)
    glyphs.SetSourceConnection(ball.GetOutputPort())
    glyphs.ScalingOff()
    mapper.SetInputConnection(glyphs.GetOutputPort())
    mapper.ScalarVisibilityOff()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(0.75, 0.1, 0.1)
    return actor


def half(data):
    plane, planes, clip = vtkPlane(), vtkPlaneCollection(), vtkClipClosedSurface()
    plane.SetNormal(0, 1, 0)
    planes.AddItem(plane)
    clip.SetInputData(data)
    clip.SetClippingPlanes(planes)
    clip.Update()
    return clip.GetOutput()


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("folder", nargs="?", default=".", type=pathlib.Path)
    arguments.add_argument("--resolution", default=0.8, type=float, help="cells of the level set, mm")
    given = arguments.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    shell = vtkUltrasoundShell()
    shell.SetInputData(abdomen())
    shell.SetOpeningMm(70)
    shell.SetResolutionMm(given.resolution)
    shell.SetPrinterMm(400, 400, 400)
    shell.Update()
    print(shell.GetReport())
    skin, base, marks = (shell.GetOutput(port) for port in range(3))
    skin_colour, base_colour = (0.87, 0.8, 0.72), (0.5, 0.58, 0.66)

    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(1500, 430)
    scenes = (((0, 0, 0.34, 1), [shown(skin, skin_colour), dots(marks, 1.6)], (0.5, -1, 0.9), 1.45),
              ((0.34, 0, 0.74, 1), [shown(half(skin), skin_colour), shown(half(base), base_colour, 25)], (0.2, -1, 0.35), 1.35),
              ((0.74, 0, 1, 1), [shown(base, base_colour)], (0.3, -0.6, -1), 1.25))
    for viewport, actors, eye, zoom in scenes:
        renderer = vtkRenderer()
        renderer.SetViewport(viewport)
        renderer.SetBackground(1, 1, 1)
        for actor in actors:
            renderer.AddActor(actor)
        window.AddRenderer(renderer)
        camera = renderer.GetActiveCamera()
        camera.SetPosition(eye)
        camera.SetFocalPoint(0, 0, 0)
        camera.SetViewUp(0, 0, 1)
        renderer.ResetCamera()
        camera.Zoom(zoom)
    window.Render()
    grab, writer = vtkWindowToImageFilter(), vtkPNGWriter()
    grab.SetInput(window)
    writer.SetInputConnection(grab.GetOutputPort())
    writer.SetFileName(str(given.folder / "shell.png"))
    writer.Write()
    print(given.folder / "shell.png")


if __name__ == "__main__":
    main()
