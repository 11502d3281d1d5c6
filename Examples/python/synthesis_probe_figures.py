#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""synthesis_probe_figures.py [FOLDER]: what the parameters of a probe's head mean, and the probes of the presets, as pictures in FOLDER.

Needs a display (xvfb-run gives one where there is none).
"""
import argparse
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import vtkmodules.vtkRenderingFreeType  # noqa: F401 - text
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 - the renderer
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkLookupTable, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPlane, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkCutter, vtkPolyDataNormals, vtkStripper
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import (vtkActor, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkTextActor, vtkWindowToImageFilter)

from echorama import vtkUltrasoundProbeSource

FAN, SWEEP = "#0072b2", "#d55e00"
FAN_ANGLE, FAN_RADIUS, SWEEP_ANGLE, SWEEP_RADIUS = 70.0, 40.0, 65.0, 30.0


def head():
    source = vtkUltrasoundProbeSource()
    source.SetPresetToCustom()
    source.SetFanAngle(FAN_ANGLE)
    source.SetFanRadius(FAN_RADIUS)
    source.SetSweepAngle(SWEEP_ANGLE)
    source.SetSweepRadius(SWEEP_RADIUS)
    source.SetElements(15)
    source.SetSweepSteps(15)
    source.SetResolutionMm(1)
    source.Update()
    return source


def outline(probe, axis):
    """Where the plane through the origin across an axis cuts the probe: a closed line, (n, 3)."""
    plane, cutter, stripper = vtkPlane(), vtkCutter(), vtkStripper()
    plane.SetOrigin(0, 0, 0)
    plane.SetNormal(*np.eye(3)[axis])
    cutter.SetCutFunction(plane)
    cutter.SetInputData(probe)
    stripper.SetInputConnection(cutter.GetOutputPort())
    stripper.SetMaximumLength(100000)
    stripper.Update()
    cut = stripper.GetOutput()
    points = vtk_to_numpy(cut.GetPoints().GetData())
    longest = max((cut.GetCell(i) for i in range(cut.GetNumberOfCells())), key=lambda cell: cell.GetNumberOfPoints())
    return points[[longest.GetPointId(i) for i in range(longest.GetNumberOfPoints())]]


def draw_plane(axes, source, across, angle, radius, colour, names, title):
    """The fan (across = 0) or the sweep (1): outline, beams, the centre of curvature, radius and angle. z points down."""
    line = outline(source.GetOutput(0), 1 - across)
    axes.fill(line[:, across], line[:, 2], color="0.88", ec="0.45", lw=1)
    elements = source.GetOutput(1)
    points = vtk_to_numpy(elements.GetPoints().GetData()).reshape(15, 15, 3)
    beams = vtk_to_numpy(elements.GetPointData().GetNormals()).reshape(15, 15, 3)
    points, beams = (points[7], beams[7]) if across == 0 else (points[:, 7], beams[:, 7])
    for start, beam in zip(points, beams):
        end = start + 32 * beam
        axes.plot([start[across], end[across]], [start[2], end[2]], color=colour, lw=0.7, alpha=0.6)
    axes.plot(points[:, across], points[:, 2], color=colour, lw=3, solid_capstyle="butt")
    half = np.radians(angle) / 2
    for side in (-half, half):
        axes.plot([0, radius * np.sin(side)], [-radius, -radius + radius * np.cos(side)], color="k", lw=0.9, ls="--")
    axes.plot(0, -radius, "k.", ms=7)
    arc = np.linspace(-half, half, 60)
    axes.plot(0.4 * radius * np.sin(arc), -radius + 0.4 * radius * np.cos(arc), color="k", lw=1)
    # The radius on the right, the angle on the left, both beside the probe.
    for name, value, unit, place, target in (
            (names[0], angle, "°", (-38, -52), (-0.4 * radius * np.sin(half / 2), -radius + 0.4 * radius * np.cos(half / 2))),
            (names[1], radius, " mm", (38, -52), (0.5 * radius * np.sin(half), -radius + 0.5 * radius * np.cos(half)))):
        axes.annotate(f"{name}\n{value:g}{unit}", target, place, ha="center", va="center",
                      arrowprops={"arrowstyle": "->", "lw": 0.9, "shrinkA": 2, "shrinkB": 2})
    axes.set_title(title, color=colour)
    axes.set_aspect("equal")
    axes.set_xlim(-52, 52)
    axes.set_ylim(38, -82)
    axes.set_xlabel("xy"[across] + " (mm)")


def parameters(path):
    figure, (left, right) = plt.subplots(1, 2, figsize=(9.2, 5.2), dpi=110, sharey=True)
    source = head()
    draw_plane(left, source, 0, FAN_ANGLE, FAN_RADIUS, FAN, ("fan angle", "fan radius"), "the fan: the array and its beams")
    draw_plane(right, source, 1, SWEEP_ANGLE, SWEEP_RADIUS, SWEEP, ("sweep angle", "sweep radius"), "the sweep: how the array is turned")
    left.set_ylabel("z (mm), into the tissue")
    figure.tight_layout()
    figure.savefig(path, bbox_inches="tight")
    plt.close(figure)


def add(renderer, data, colours=None, colour=None, opacity=1.0, width=1.0):
    mapper, actor = vtkPolyDataMapper(), vtkActor()
    if colours:
        normals = vtkPolyDataNormals()
        normals.SetInputData(data)
        normals.SetFeatureAngle(60)
        mapper.SetInputConnection(normals.GetOutputPort())
        table = vtkLookupTable()
        table.SetNumberOfTableValues(len(colours))
        for index, value in enumerate(colours):
            table.SetTableValue(index, *value, 1)
        mapper.SetColorModeToMapScalars() # bytes are no colours here
        mapper.SetScalarModeToUseCellFieldData()
        mapper.SelectColorArray(vtkUltrasoundProbeSource.PartName())
        mapper.SetLookupTable(table)
        mapper.SetScalarRange(0, len(colours) - 1)
    else:
        mapper.SetInputData(data)
        actor.GetProperty().SetColor(colour)
    actor.SetMapper(mapper)
    actor.GetProperty().SetOpacity(opacity)
    actor.GetProperty().SetLineWidth(width)
    actor.GetProperty().SetSpecular(0.3)
    actor.GetProperty().SetSpecularPower(30)
    renderer.AddActor(actor)


def beams(source, length):
    """The beams along the border of what the probe sees, as lines."""
    elements = source.GetOutput(1)
    starts, ways = vtk_to_numpy(elements.GetPoints().GetData()), vtk_to_numpy(elements.GetPointData().GetNormals())
    fan, sweep = (vtk_to_numpy(elements.GetPointData().GetArray(name)) for name in ("Fan", "Sweep"))
    border = (np.abs(fan) == 0.5) | (np.abs(sweep) == sweep.max())
    points, lines = vtkPoints(), vtkCellArray()
    for start, way in list(zip(starts[border], ways[border]))[::3]:
        lines.InsertNextCell(2)
        for point in (start, start + length * way):
            lines.InsertCellPoint(points.InsertNextPoint(*point))
    data = vtkPolyData()
    data.SetPoints(points)
    data.SetLines(lines)
    return data


def probes(path):
    names = {"Mechanical3D": "mechanical 3D", "Endocavity3D": "endocavity 3D", "Curvilinear": "curvilinear", "Linear": "linear", "Phased": "phased"}
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(8)
    window.SetSize(1250, 520)
    for index, (name, label) in enumerate(names.items()):
        source = vtkUltrasoundProbeSource()
        getattr(source, f"SetPresetTo{name}")()
        source.SetResolutionMm(0.8)
        if name == "Endocavity3D": # a long thin shaft
            source.SetHandleWidthMm(17)
            source.SetHandleThicknessMm(15)
            source.SetNeckMm(20)
            source.SetSkirtMm(4)
            source.SetRimMm(3)
        source.Update()
        renderer = vtkRenderer()
        renderer.SetViewport(index / 5, 0, (index + 1) / 5, 1)
        renderer.SetBackground(1, 1, 1)
        add(renderer, source.GetOutput(0), colours=((0.55, 0.58, 0.62), (0.93, 0.93, 0.91), (0.30, 0.42, 0.56)))
        add(renderer, beams(source, 35), colour=(0.84, 0.37, 0.0), opacity=0.55, width=1.3)
        text = vtkTextActor()
        text.SetInput(label)
        text.GetTextProperty().SetColor(0.1, 0.1, 0.1)
        text.GetTextProperty().SetFontSize(20)
        text.GetTextProperty().SetJustificationToCentered()
        text.SetPosition(125, 12)
        renderer.AddViewProp(text)
        window.AddRenderer(renderer)
        camera = renderer.GetActiveCamera()
        camera.SetFocalPoint(0, 0, -42)
        camera.SetPosition(150, 260, 130)
        camera.SetViewUp(0, 0, -1)
        camera.ParallelProjectionOn()
        camera.SetParallelScale(112)
        renderer.ResetCameraClippingRange()
    window.Render()
    grab, writer = vtkWindowToImageFilter(), vtkPNGWriter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    writer.SetInputConnection(grab.GetOutputPort())
    writer.SetFileName(str(path))
    writer.Write()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", default=".", type=pathlib.Path)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    parameters(folder / "ProbeSource_parameters.png")
    probes(folder / "ProbeSource_probes.png")
    print(f"ProbeSource_parameters.png and ProbeSource_probes.png in {folder}")
