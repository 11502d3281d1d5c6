#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""noise_tiling_figures.py [--spacing MM] FOLDER: noise volumes side by side, as a picture in FOLDER.

Real noise is acquired with gel on the probe and air before it. The volumes here are stand-ins: speckle along the beams of a
curved probe, with the ringing of gel below its face and a gain that grows with depth. Shown are planes in the middle of the sweep:
each volume as it comes, all where they are laid, and what they make when they are blended.
"""
import argparse
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData

from echorama import vtkUltrasoundAcquisition, vtkUltrasoundNoiseTiler, vtkUltrasoundScanConverter

RADIUS = 40.0 # mm, of the array
PROBE = (60.0, np.radians(60.0) * RADIUS, 40.0, np.radians(40.0) * 30.0, 2.0, 90.0) # angles in degrees, widths and depths in mm
COLOURS = ("tab:orange", "tab:cyan")


def blurred(samples, sigmas):
    """Each axis filtered by a Gaussian, by Fourier transforms."""
    spectrum = np.fft.fftn(samples)
    for axis, sigma in enumerate(sigmas):
        frequency = np.fft.fftfreq(samples.shape[axis])
        shape = [-1 if a == axis else 1 for a in range(3)]
        spectrum *= np.exp(-2 * (np.pi * sigma * frequency) ** 2).reshape(shape)
    return np.fft.ifftn(spectrum)


def stand_in(seed, gain, spacing):
    """Grey noise along beams, converted to voxels: the envelope of a filtered complex Gaussian field, log compressed."""
    random = np.random.default_rng(seed)
    shape = (48, 120, 360)
    field = blurred(random.normal(size=shape) + 1j * random.normal(size=shape), (1.0, 1.2, 1.5))
    echo = np.abs(field) / np.sqrt(np.mean(np.abs(field) ** 2))
    depth = np.linspace(PROBE[4], PROBE[5], shape[2])
    ringing = np.exp(-(depth - PROBE[4]) / 3.0) * (1.4 + np.cos(2 * np.pi * depth / 2.2))
    level = -38.0 + 24.0 * depth / PROBE[5] + 30.0 * ringing + gain # dB
    grey = np.clip(255.0 * (1.0 + (20.0 * np.log10(echo + 1e-3) + level) / 60.0), 0, 255)

    beams = vtkImageData()
    beams.SetDimensions(shape[::-1])
    for name, values, fields in (("Intensity", grey.astype(np.uint8).ravel(), beams.GetPointData()),
                                 (vtkUltrasoundAcquisition.ProbeGeometryName(), np.array([PROBE]), beams.GetFieldData())):
        data = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
        data.SetName(name)
        fields.AddArray(data)
    converter = vtkUltrasoundScanConverter()
    converter.SetInputData(beams)
    converter.SetSpacingMm(spacing)
    converter.Update()
    return converter.GetOutput()


def plane(volume):
    """The plane in the middle of the sweep: greys [depth, across], NaN outside, and the places of its rows and columns in mm."""
    shape = volume.GetDimensions()[::-1]
    grey = vtk_to_numpy(volume.GetPointData().GetArray("Intensity")).reshape(shape).astype(float)
    grey[vtk_to_numpy(volume.GetPointData().GetArray("ValidRegion")).reshape(shape) == 0] = np.nan
    origin, spacing = np.array(volume.GetOrigin()), np.array(volume.GetSpacing())
    return grey[:, shape[1] // 2], origin[2] + spacing[2] * np.arange(shape[0]), origin[0] + spacing[0] * np.arange(shape[2])


def turned(picture, angle, z, x):
    """A plane turned by an angle (radians) about the middle of the array's arc, on other rows and columns."""
    grey, rows, columns = picture
    across, down = np.meshgrid(x, z + RADIUS)
    from_x = np.cos(angle) * across - np.sin(angle) * down
    from_z = np.sin(angle) * across + np.cos(angle) * down - RADIUS
    i = np.round((from_x - columns[0]) / (columns[1] - columns[0])).astype(int)
    k = np.round((from_z - rows[0]) / (rows[1] - rows[0])).astype(int)
    there = (i >= 0) & (i < len(columns)) & (k >= 0) & (k < len(rows))
    return np.where(there, grey[np.clip(k, 0, len(rows) - 1), np.clip(i, 0, len(columns) - 1)], np.nan)


def show(axes, grey, z, x, title):
    axes.imshow(np.nan_to_num(grey), cmap="gray", vmin=0, vmax=255, extent=(x[0], x[-1], z[-1], z[0]))
    axes.set_title(title, fontsize=9)
    axes.set_axis_off()


def outline(axes, angle, half, colour):
    """The edge of a fan of half an angle, turned by another."""
    arc = angle + np.linspace(-half, half, 60)
    near, far = RADIUS + PROBE[4], RADIUS + PROBE[5]
    points = np.concatenate([np.stack([near * np.sin(arc), near * np.cos(arc)], 1), np.stack([far * np.sin(arc), far * np.cos(arc)], 1)[::-1]])
    axes.plot(*np.vstack([points, points[:1]]).T - np.array([[0], [RADIUS]]), color=colour, linewidth=0.8)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--spacing", type=float, default=0.6, help="voxel size, mm")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)

    volumes = [stand_in(1, 0.0, options.spacing), stand_in(2, 5.0, options.spacing)]
    tiler = vtkUltrasoundNoiseTiler()
    for volume in volumes:
        tiler.AddInputDataObject(0, volume)
    tiler.Update()
    blended, z, x = plane(tiler.GetOutput())
    probe = vtk_to_numpy(tiler.GetOutput().GetFieldData().GetArray(vtkUltrasoundAcquisition.ProbeGeometryName())).ravel()
    overlap = tiler.GetOverlapDegrees()
    middle = np.radians(probe[0] - overlap) / 4.0 # of the second volume
    half = np.radians(probe[0] + overlap) / 4.0

    figure = plt.figure(figsize=(8.6, 6.0), facecolor="white")
    pictures = [plane(volume) for volume in volumes]
    for number, picture in enumerate(pictures):
        show(figure.add_axes([0.25 * number, 0.54, 0.24, 0.40]), *picture, f"noise volume {number + 1}, {PROBE[0]:.0f} degrees")
    first, second = (turned(picture, angle, z, x) for picture, angle in zip(pictures, (-middle, middle)))
    laid = figure.add_axes([0.5, 0.54, 0.5, 0.40])
    show(laid, np.where(np.isnan(first), second, first), z, x, f"where they are laid: they overlap by {overlap:.0f} degrees")
    for angle, colour in zip((-middle, middle), COLOURS):
        outline(laid, angle, half, colour)
    laid.set_xlim(x[0] - 2, x[-1] + 2)
    laid.set_ylim(z[-1] + 2, z[0] - 2)
    show(figure.add_axes([0.1, 0.0, 0.8, 0.49]), blended, z, x, f"blended into one, {probe[0]:.0f} degrees")
    figure.savefig(options.folder / "NoiseTiler.png", dpi=85)
    plt.close(figure)


if __name__ == "__main__":
    main()
