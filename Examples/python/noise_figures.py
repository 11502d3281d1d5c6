#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""noise_figures.py [FOLDER [VOLUME]]: what synthetic noise looks like, as pictures in FOLDER.

The first shows how the numbers of samples and elements shape noise whose samples are independent (dissertation, figure 6.8).
With a VOLUME (its fan is found if it does not say) the second shows a plane of it beside noise along beams, white noise and
Perlin noise, all with its mean and deviation, and a part of each enlarged.
"""
import argparse
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy

from echorama import vtkUltrasoundNoiseSource, vtkUltrasoundReader


def array(volume, name="Intensity"):
    """An array of a volume, z first."""
    return vtk_to_numpy(volume.GetPointData().GetArray(name)).reshape(volume.GetDimensions()[::-1])


def show(axis, picture, title):
    axis.imshow(picture, cmap="gray", vmin=0, vmax=140, interpolation="bilinear")
    axis.set_title(title, fontsize=8, color="white", pad=3)
    axis.axis("off")


def resolutions(path):
    """One plane of noise for each number of samples (down) and elements (to the right)."""
    figure, axes = plt.subplots(3, 3, figsize=(8, 6.2), facecolor="black")
    for row, samples in zip(axes, (100, 200, 400)):
        for axis, elements in zip(row, (32, 80, 200)):
            source = vtkUltrasoundNoiseSource()
            source.SetSweepAngle(0)
            source.SetSweepWidth(0)
            source.SetDepthCorrelationMm(0)
            source.SetFanCorrelation(0)
            source.SetSamples(samples)
            source.SetElements(elements)
            source.SetSpacingMm(0.35)
            source.Update()
            show(axis, array(source.GetOutput())[0], f"{samples} samples, {elements} elements")
    figure.subplots_adjust(0.01, 0.01, 0.99, 0.96, 0.03, 0.1)
    figure.savefig(path, dpi=85, facecolor="black")


def kinds(path, volume):
    """A plane of a real volume beside noise in its fan."""
    made = []
    for kind in (vtkUltrasoundNoiseSource.BEAMS, vtkUltrasoundNoiseSource.WHITE, vtkUltrasoundNoiseSource.PERLIN):
        source = vtkUltrasoundNoiseSource()
        source.SetMatchData(volume)
        source.OnInputGridOn()
        source.SetKind(kind)
        source.Update()
        made.append(array(source.GetOutput()))
        if kind == vtkUltrasoundNoiseSource.BEAMS:
            print("counts", source.GetMadeCounts(), "lengths (mm, fans, sweeps)", source.GetMadeCorrelation())
            pose = vtk_to_numpy(source.GetOutput().GetFieldData().GetArray("ProbeToWorld")).reshape(4, 4)
    # The plane of the grid that lies nearest to those of the fan, and its axes so that the depth runs down.
    direction = volume.GetDirectionMatrix()
    to_index = np.array([[direction.GetElement(r, c) for c in range(3)] for r in range(3)]).T
    along, sweep, depth = (to_index @ pose[:3, column] for column in range(3))
    across = int(np.abs(sweep).argmax())
    down = int(np.abs(np.where(np.arange(3) == across, 0, depth)).argmax())
    valid = array(volume, "ValidRegion")
    plane = int(valid.sum(axis=tuple(a for a in range(3) if a != 2 - across)).argmax())

    def cut(voxels):
        picture = np.take(voxels, plane, axis=2 - across)
        others = [a for a in (2, 1, 0) if a != across]
        picture = picture if others[0] == down else picture.T
        return picture[:: 1 if depth[down] > 0 else -1]

    shown = [cut(array(volume))] + [cut(voxels) for voxels in made]
    mask = cut(valid)
    rows, columns = np.nonzero(mask)
    middle = int(rows.min() + 0.55 * (rows.max() - rows.min())), int(columns.mean())
    figure, axes = plt.subplots(2, 4, figsize=(10, 5.2), facecolor="black")
    for column, (picture, title) in enumerate(zip(shown, ("the volume", "noise along beams, matched", "white noise", "Perlin noise"))):
        show(axes[0, column], picture[rows.min():rows.max() + 1, columns.min():columns.max() + 1], title)
        show(axes[1, column], picture[middle[0] - 35:middle[0] + 35, middle[1] - 45:middle[1] + 45], "")
    figure.subplots_adjust(0.005, 0.005, 0.995, 0.96, 0.02, 0.02)
    figure.savefig(path, dpi=85, facecolor="black")


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("folder", nargs="?", default="pictures", type=pathlib.Path)
parser.add_argument("volume", nargs="?")
arguments = parser.parse_args()
arguments.folder.mkdir(parents=True, exist_ok=True)
resolutions(arguments.folder / "NoiseSource.png")
if arguments.volume:
    reader = vtkUltrasoundReader()
    reader.SetFileName(arguments.volume)
    reader.Update()
    kinds(arguments.folder / "NoiseKinds.png", reader.GetOutput())
