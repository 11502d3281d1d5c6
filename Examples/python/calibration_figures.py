#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""calibration_figures.py [FOLDER]: what a calibration needs from a 3D printer, as a picture in FOLDER: the rig, and the clip on a probe.

Needs a display (xvfb-run gives one where there is none).
"""
import argparse
import pathlib

import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 - the renderer
from vtkmodules.vtkCommonTransforms import vtkTransform
from vtkmodules.vtkFiltersCore import vtkPolyDataNormals
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter

from echorama import vtkUltrasoundPrintableSource, vtkUltrasoundProbeSource


def shown(source, colour, transform=None):
    normals, mapper, actor = vtkPolyDataNormals(), vtkPolyDataMapper(), vtkActor()
    normals.SetInputConnection(source.GetOutputPort())
    normals.SetFeatureAngle(30)
    mapper.SetInputConnection(normals.GetOutputPort())
    mapper.ScalarVisibilityOff()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(*colour)
    if transform:
        actor.SetUserTransform(transform)
    return actor


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("folder", nargs="?", default=".", type=pathlib.Path)
    folder = arguments.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    print_colour, probe_colour = (0.85, 0.8, 0.7), (0.45, 0.55, 0.65)

    rig, small, clip = (vtkUltrasoundPrintableSource() for _ in range(3))
    small.SetScale(0.6)
    clip.SetKindToClip()
    beside = vtkTransform()
    beside.Translate(75, 0, 0)

    probe = vtkUltrasoundProbeSource()  # its handle is what the clip's defaults fit
    probe.SetPresetToMechanical3D()
    probe.Update()
    back = probe.GetOutput().GetBounds()[4]
    # A clip is printed on its front end, half a turn about x from how it sits on the handle.
    on_handle = vtkTransform()
    on_handle.Translate(0, 0, back + 62)
    on_handle.RotateX(180)

    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(1200, 560)
    scenes = (((0, 0, 0.58, 1), [shown(rig, print_colour), shown(small, print_colour, beside)], (0.35, -1, 0.6), 1.3),
              ((0.58, 0, 1, 1), [shown(probe, probe_colour), shown(clip, print_colour, on_handle)], (1, 0.35, 0.1), 0.95))
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
    writer.SetFileName(str(folder / "PrintableSource.png"))
    writer.Write()
    print(folder / "PrintableSource.png")


if __name__ == "__main__":
    main()
