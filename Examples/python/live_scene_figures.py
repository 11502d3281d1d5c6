#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""live_scene_figures.py [--detail MM] [FOLDER]: live images of the invented abdomen, as live_scene.png in FOLDER.

Left: drawn, right: by the acoustic model. Above: liver and kidney; then ribs; then without speckle, and the coarsest step of the
acoustic image. Below: without speckle, the plane as thin as a razor, and tissue that the probe has pressed by 12 mm, by a state of its mechanics.
"""
import argparse
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonMath import vtkMatrix4x4

from echorama import vtkUltrasoundAnatomySource, vtkUltrasoundLiveImage, vtkUltrasoundProbeSource, vtkUltrasoundTissuePress


def pressed(anatomy, depth, spacing):
    """The state of the body under the probe so deep in it."""
    probe, pose = vtkUltrasoundProbeSource(), vtkMatrix4x4()
    probe.SetParameterAsText("Preset", "curvilinear")
    probe.SetPosition(0, 0, depth)
    pose.SetElement(2, 3, depth)
    press = vtkUltrasoundTissuePress()
    press.SetInputConnection(anatomy.GetOutputPort())
    press.AddProbeConnection(probe.GetOutputPort())
    press.SetSpacingMm(spacing)
    press.Update()
    vtkUltrasoundLiveImage.SetPressState(press.GetOutput(), depth, pose)
    return press.GetOutput()


def picture(anatomy, source, place, turn, state=None, **controls):
    live = vtkUltrasoundLiveImage()
    live.SetInputConnection(1, anatomy.GetOutputPort())
    if state:
        live.AddPressStateData(state)
    live.SetParameterAsText("Source", source)
    live.SetPosition(*place)
    live.SetOrientation(*turn)
    for name, value in controls.items():
        live.SetParameter(name, value)
    live.Update()
    image = live.GetOutput()
    return vtk_to_numpy(image.GetPointData().GetArray("Intensity")).reshape(image.GetDimensions()[1::-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", default=".", type=pathlib.Path)
    parser.add_argument("--detail", type=float, default=1.5, help="edge of the anatomy's triangles, mm")
    parser.add_argument("--cells", type=float, default=4.0, help="edge of the cells that are pressed, mm")
    arguments = parser.parse_args()
    anatomy = vtkUltrasoundAnatomySource()
    anatomy.SetDetailMm(arguments.detail)
    organs, ribs = ((0, 0, 0), (0, 0, 0)), ((-50, -60, 1), (20, -15, 0))
    shown = [("drawn", "scene", organs, {}), ("acoustic", "acoustic", organs, {}),
             ("drawn", "scene", ribs, {}), ("acoustic", "acoustic", ribs, {}),
             ("drawn, without speckle", "scene", organs, {"Speckle": 0}),
             ("acoustic, a quarter of the beams, no reflections", "acoustic", organs, {"Refinement": 0}),
             ("drawn, without speckle, as thin as a razor", "scene", organs, {"Speckle": 0, "SceneRays": 1}),
             ("drawn, pressed by 12 mm", "scene", ((0, 0, 12), (0, 0, 0)), {"PressMm": 12, "state": pressed(anatomy, 12, arguments.cells)})]
    figure, axes = plt.subplots(4, 2, figsize=(10, 14.8), facecolor="black")
    for axis, (title, source, (place, turn), controls) in zip(axes.flat, shown):
        axis.imshow(picture(anatomy, source, place, turn, **controls), cmap="gray", vmin=0, vmax=255)
        axis.set_title(title, fontsize=9, color="white", pad=3)
        axis.axis("off")
    figure.subplots_adjust(0.005, 0.005, 0.995, 0.97, 0.02, 0.06)
    figure.savefig(arguments.folder / "live_scene.png", dpi=85, facecolor="black")


if __name__ == "__main__":
    main()
