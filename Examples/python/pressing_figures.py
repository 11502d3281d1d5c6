#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""pressing_figures.py [--quick] [--sph PROGRAM] [FOLDER]: a probe, gel and the invented abdomen as pictures in FOLDER.

Gel.png: what a scan shows without and with gel, in air and on the skin (after figure 6.4 of the dissertation), above where the gel went.
TissuePress.png: gel and tissue under a probe that presses (after figures 3.8 to 3.10), with squares that were drawn on it at rest.
Moving.png: a probe with gel that scans on its way, of the scene moving.json, with what gel it has and left.
With the benchmark that computes them, build/release/benchmarks/BenchmarkSph, also the pictures of sph_figures.py (figures 3.6 to 3.8).
"""
import argparse
import json
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.collections import LineCollection
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkPlane, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkCutter

import sph_figures
from echorama import (
    vtkUltrasoundAnatomySource, vtkUltrasoundDeformGeometry, vtkUltrasoundGel, vtkUltrasoundProbeSource, vtkUltrasoundSceneSource,
    vtkUltrasoundSynthesizer, vtkUltrasoundTissuePress)

GEL, TISSUE = (0.20, 0.45, 0.80), (0.65, 0.35, 0.25)


def outlines(surface):
    """Where the plane y = 0 cuts a surface: segments (x, z), and the body of each, if it has any."""
    plane, cutter = vtkPlane(), vtkCutter()
    plane.SetNormal(0, 1, 0)
    cutter.SetCutFunction(plane)
    cutter.SetInputData(surface)
    cutter.GenerateTrianglesOff()
    cutter.Update()
    lines = cutter.GetOutput()
    if not lines.GetNumberOfCells():
        return np.zeros((0, 2, 2)), np.zeros(0, int)
    ends = vtk_to_numpy(lines.GetLines().GetConnectivityArray()).reshape(-1, 2)
    body = lines.GetCellData().GetArray("Body")
    places = vtk_to_numpy(lines.GetPoints().GetData())[:, (0, 2)]
    return places[ends], vtk_to_numpy(body) if body else np.zeros(len(ends), int)


def draw(axis, tissue, probe, has_gel, span):
    segments, body = outlines(tissue)
    is_gel = body == (0 if has_gel else -1)
    axis.add_collection(LineCollection(segments[is_gel], colors=[GEL], linewidths=1.4))
    axis.add_collection(LineCollection(segments[~is_gel], colors=[TISSUE], linewidths=0.6))
    axis.add_collection(LineCollection(outlines(probe.GetOutput())[0], colors="black", linewidths=1.0))
    axis.set_xlim(-span, span)
    axis.set_aspect("equal")
    axis.axis("off")


def plane_of(tissue, probe, quick):
    scanner = vtkUltrasoundSynthesizer()
    scanner.SetInputData(tissue)
    scanner.SetProbeConnection(probe.GetOutputPort())
    scanner.SliceOnlyOn()
    scanner.SetElements(48 if quick else 160)
    scanner.SetSamples(160 if quick else 500)
    scanner.SetSpacingMm(1.0 if quick else 0.4)
    scanner.SetGainDb(4)
    scanner.SetNoiseDb(-65)
    scanner.Update()
    image = scanner.GetOutput()
    return vtk_to_numpy(image.GetPointData().GetArray("Intensity")).reshape(image.GetDimensions()[::-1]).squeeze()


def probe_at(z):
    probe = vtkUltrasoundProbeSource()
    probe.SetPosition(0, 0, z)
    probe.Update()
    return probe


def gel_of(body, probe, millilitres, quick):
    gel = vtkUltrasoundGel()
    gel.SetInputData(body)
    gel.AddProbeConnection(probe.GetOutputPort())
    gel.SetAmountMl(millilitres)
    gel.SetCellMm(4 if quick else 2)
    return gel


def gel_picture(body, path, quick):
    figure, axes = plt.subplots(2, 4, figsize=(13, 4.4), gridspec_kw={"height_ratios": (1.4, 1)})
    for column, (z, millilitres, title) in enumerate(((-150, 0, "in air"), (-150, 12, "in air, with gel"), (-4, 0, "4 mm above the skin"),
                                                      (-4, 12, "4 mm above the skin, with gel"))):
        probe = probe_at(z)
        gel = gel_of(body, probe, millilitres, quick)
        gel.Update()
        coupled = gel.GetOutput(1).GetFieldData().GetArray("Coupled").GetValue(0)
        above, below = axes[:, column]
        above.imshow(plane_of(gel.GetOutput(0), probe, quick), cmap="gray", vmin=0, vmax=255)
        above.set_title(f"{title}\n{100 * coupled:.0f}% of the face couples", fontsize=10)
        above.axis("off")
        draw(below, gel.GetOutput(0), probe, millilitres > 0, 60)
        below.set_ylim(z + 30, z - 25)
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.88, 0.02, 0.02)
    figure.savefig(path, dpi=80)


def press_picture(body, path, quick):
    probe = probe_at(9)
    press = vtkUltrasoundTissuePress()
    press.SetInputData(body)
    press.AddProbeConnection(probe.GetOutputPort())
    press.SetSpacingMm(8 if quick else 4)
    surfaces = vtkUltrasoundDeformGeometry()
    surfaces.SetInputData(body)
    surfaces.SetDisplacementConnection(press.GetOutputPort())
    surfaces.SetOutsideToNearest()
    surfaces.SetMaskFolds(True)
    gel = gel_of(body, probe, 15, quick)
    gel.SetPressedConnection(surfaces.GetOutputPort())
    gel.Update()
    # Squares of 8 mm, whose corners go where the tissue goes.
    across, down = np.meshgrid(np.arange(-70, 71), np.arange(0, 91))
    drawn, points, moved = vtkPolyData(), vtkPoints(), vtkUltrasoundDeformGeometry()
    points.SetDataTypeToDouble()
    for x, z in zip(across.ravel(), down.ravel()):
        points.InsertNextPoint(x, 0, z)
    drawn.SetPoints(points)
    moved.SetInputData(drawn)
    moved.SetDisplacementConnection(press.GetOutputPort())
    moved.SetMaskFolds(True)
    moved.SetOutsideToNearest()
    moved.Update()
    now = vtk_to_numpy(moved.GetOutput().GetPoints().GetData()).reshape(*across.shape, 3)
    dark = (across[:-1, :-1] // 8 + down[:-1, :-1] // 8) % 2
    figure, axis = plt.subplots(figsize=(7, 5.6))
    axis.pcolormesh(now[..., 0], now[..., 2], dark, cmap="Greys", vmin=-1.5, vmax=2.5)
    draw(axis, gel.GetOutput(0), probe, True, 70)
    axis.set_ylim(90, -20)
    figure.subplots_adjust(0, 0, 1, 1)
    figure.savefig(path, dpi=80)


def moving_picture(path, quick):
    scene = json.loads((pathlib.Path(__file__).resolve().parents[1] / "scenes" / "moving.json").read_text())
    scene["volume"] = {"spacingMm": 2 if quick else 0.5, "knockMm": 0, "knockDegrees": 0}
    if quick:
        scene["probe"].update(elements=24, sweepSteps=8, samples=80)
        scene["press"]["spacingMm"], scene["gel"]["cellMm"], scene["views"]["stepMm"] = 12, 6, 20
    source = vtkUltrasoundSceneSource()
    source.SetScene(json.dumps(scene))
    source.Update()
    volumes, truth = source.GetOutputDataObject(0), source.GetOutputDataObject(3)
    figure, axes = plt.subplots(2, 3, figsize=(12, 6.4), gridspec_kw={"height_ratios": [1.35, 1]})
    for view, (above, below) in enumerate(axes.T):
        image = volumes.GetBlock(view)
        bounds, size = image.GetBounds(), image.GetDimensions()
        grey = vtk_to_numpy(image.GetPointData().GetArray("Intensity")).reshape(size[::-1])[:, size[1] // 2]
        above.imshow(grey, cmap="gray", vmin=0, vmax=180, extent=(bounds[0], bounds[1], bounds[5], bounds[4]))
        segments, body = outlines(truth.GetBlock(view).GetBlock(0))
        below.add_collection(LineCollection(segments[body > 0], colors=[TISSUE], linewidths=0.6))
        below.add_collection(LineCollection(segments[body == 0], colors=[GEL], linewidths=1.4))
        below.set_xlim(-60, 110)
        below.set_ylim(75, -25)
        below.set_aspect("equal")
        for axis in (above, below):
            axis.axis("off")
    figure.subplots_adjust(0, 0, 1, 1, 0.02, 0.02)
    figure.savefig(path, dpi=80)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", default=".", type=pathlib.Path)
    parser.add_argument("--quick", action="store_true", help="coarse: to see that it works")
    parser.add_argument("--sph", type=pathlib.Path, metavar="PROGRAM", help="the benchmark sph: its pictures too")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    body = vtkUltrasoundAnatomySource()
    body.Update()
    gel_picture(body.GetOutput(), options.folder / "Gel.png", options.quick)
    press_picture(body.GetOutput(), options.folder / "TissuePress.png", options.quick)
    moving_picture(options.folder / "Moving.png", options.quick)
    if options.sph:
        sph_figures.pictures(options.sph, options.folder, options.quick)


if __name__ == "__main__":
    main()
