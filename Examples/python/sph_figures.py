#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""sph_figures.py [--quick] PROGRAM [FOLDER]: fluids by smoothed particle hydrodynamics as pictures in FOLDER (after figures 3.6 to 3.8 of
the dissertation). PROGRAM is the benchmark that computes them, build/release/benchmarks/BenchmarkSph.

sph_block.png: a column of water in a tank; sph_bodies.png: water around a probe above tissue, which are particles too;
sph_gel.png: a fluid of 20 Pa s, pressed by a probe. Needs a display (xvfb-run gives one where there is none).
"""
import argparse
import pathlib
import subprocess
import tempfile

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401 - the renderer
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkLookupTable, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkFiltersCore import vtkGlyph3D
from vtkmodules.vtkFiltersModeling import vtkOutlineFilter
from vtkmodules.vtkFiltersSources import vtkCubeSource, vtkSphereSource
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import vtkActor, vtkLight, vtkPolyDataMapper, vtkRenderer, vtkRenderWindow, vtkWindowToImageFilter

# As the program has them: mm between particles, what to look at, and from where on (y) it is shown.
SCENES = {"block": (1.0, (0, 72, 0, 24, 0, 50), None), "bodies": (1.25, (0, 110, 0, 50, 0, 60), None), "gel": (1.25, (14, 76, 30, 50, 2, 50), 30)}
TISSUE, PROBE = (0.83, 0.62, 0.55), (0.42, 0.46, 0.52)


def spheres(places, radius, colour=None, speeds=None, fastest=1.0):
    """Shaded balls, by their speed where these are given."""
    cloud, points, ball, glyphs = vtkPolyData(), vtkPoints(), vtkSphereSource(), vtkGlyph3D()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(places, np.float32), deep=True))
    cloud.SetPoints(points)
    if speeds is not None:
        cloud.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(speeds, np.float32), deep=True))
    ball.SetRadius(radius)
    ball.SetThetaResolution(12)
    ball.SetPhiResolution(10)
    glyphs.SetInputData(cloud)
    glyphs.SetSourceConnection(ball.GetOutputPort())
    glyphs.ScalingOff()
    mapper, actor = vtkPolyDataMapper(), vtkActor()
    mapper.SetInputConnection(glyphs.GetOutputPort())
    if colour:
        mapper.ScalarVisibilityOff()
        actor.GetProperty().SetColor(*colour)
    else:  # from deep blue to nearly white foam
        table = vtkLookupTable()
        table.SetNumberOfTableValues(64)
        for n in range(64):
            part = (n / 63) ** 0.8
            table.SetTableValue(n, 0.10 + 0.72 * part, 0.34 + 0.54 * part, 0.70 + 0.27 * part)
        mapper.SetLookupTable(table)
        mapper.SetScalarRange(0, fastest)
    actor.SetMapper(mapper)
    actor.GetProperty().SetAmbient(0.25)
    actor.GetProperty().SetSpecular(0.25)
    actor.GetProperty().SetSpecularPower(20)
    return actor


def box(bounds):
    cube, outline, mapper, actor = vtkCubeSource(), vtkOutlineFilter(), vtkPolyDataMapper(), vtkActor()
    cube.SetBounds(*bounds)
    outline.SetInputConnection(cube.GetOutputPort())
    mapper.SetInputConnection(outline.GetOutputPort())
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(0.45, 0.45, 0.45)
    actor.GetProperty().SetLineWidth(1.5)
    actor.GetProperty().LightingOff()
    return actor


def floor(bounds):
    cube, mapper, actor = vtkCubeSource(), vtkPolyDataMapper(), vtkActor()
    cube.SetBounds(*bounds[:4], bounds[4] - 1.5, bounds[4] - 0.5)
    mapper.SetInputConnection(cube.GetOutputPort())
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(0.88, 0.88, 0.86)
    return actor


def read(path):
    table = np.loadtxt(path, delimiter=",", skiprows=1)
    return table[:, :3], table[:, 3], table[:, 4].astype(int)


def picture(frames, path, spacing, bounds, cut_at=None):
    """Frames side by side in a box; of what lies before the plane y = cut_at nothing is shown."""
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(1500, 430)
    window.SetMultiSamples(8)
    tables = [read(frame) for frame in frames]
    fastest = max(np.percentile(speed[body < 0], 98) for _, speed, body in tables)
    for n, (places, speeds, body) in enumerate(tables):
        renderer = vtkRenderer()
        renderer.SetBackground(1, 1, 1)
        renderer.SetViewport(n / len(frames), 0, (n + 1) / len(frames), 1)
        seen = places[:, 1] > (-np.inf if cut_at is None else cut_at)
        fluid = seen & (body < 0)
        renderer.AddActor(spheres(places[fluid], 0.62 * spacing, speeds=speeds[fluid], fastest=fastest))
        for number, colour in ((1, TISSUE), (2, PROBE)):
            if np.any(seen & (body == number)):
                renderer.AddActor(spheres(places[seen & (body == number)], 0.68 * spacing, colour))
        if cut_at is None:
            renderer.AddActor(box(bounds))
            renderer.AddActor(floor(bounds))
        light = vtkLight()
        light.SetLightTypeToCameraLight()
        light.SetPosition(-0.6, 0.9, 1)
        renderer.AddLight(light)
        camera = renderer.GetActiveCamera()
        middle = [0.5 * (bounds[2 * axis] + bounds[2 * axis + 1]) for axis in range(3)]
        camera.SetFocalPoint(*middle)
        camera.SetPosition(middle[0] + 0.35, middle[1] - 2, middle[2] + 0.75)
        camera.SetViewUp(0, 0, 1)
        renderer.ResetCamera(*bounds)
        camera.Zoom(1.2)
        window.AddRenderer(renderer)
    window.Render()
    grab, writer = vtkWindowToImageFilter(), vtkPNGWriter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    writer.SetInputConnection(grab.GetOutputPort())
    writer.SetFileName(str(path))
    writer.Write()


def pictures(program, folder, quick):
    with tempfile.TemporaryDirectory() as frames:
        subprocess.run([program, "--frames", frames, *["--quick"] * quick], check=True)
        for name, (spacing, bounds, cut_at) in SCENES.items():
            picture([f"{frames}/{name}_{n}.csv" for n in (1, 2, 3)], folder / f"sph_{name}.png", spacing * (2.5 if quick else 1), bounds, cut_at)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("folder", nargs="?", default=".", type=pathlib.Path)
    parser.add_argument("--quick", action="store_true", help="coarse: to see that it works")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    pictures(options.program, options.folder, options.quick)


if __name__ == "__main__":
    main()
