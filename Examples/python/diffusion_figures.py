#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""diffusion_figures.py OUT.png VOLUME...: what the exponent of diffusion does, as one picture.

The volumes (posed, overlapping) are stitched, one alone is taken as it is; the brightness at the surface is spread with d = 1, 2, 4, 8, 16
and 32, the same in- and outside, and a slice through the middle is shown. The white line is the border of the region.
"""
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy

from echorama import vtkUltrasoundReader, vtkUltrasoundStitcher, vtkUltrasoundSurfaceDiffuser

EXPONENTS = (1, 2, 4, 8, 16, 32)


def stitched(paths, spacing):
    readers = [vtkUltrasoundReader() for _ in paths]
    stitcher = vtkUltrasoundStitcher()
    for reader, path in zip(readers, paths):
        reader.SetFileName(path)
        stitcher.AddInputConnection(reader.GetOutputPort())
    stitcher.SetSpacingMm(spacing)
    stitcher.Update()
    if stitcher.GetErrorCode():
        raise SystemExit("the volumes were not stitched")
    return stitcher.GetOutput()


def middle_slice(volume, name):
    """The slice across y that shows most, z downwards."""
    arrays = [vtk_to_numpy(volume.GetPointData().GetArray(of)).reshape(volume.GetDimensions()[::-1]) for of in (name, "ValidRegion")]
    at = int(np.argmax(arrays[1].sum(axis=(0, 2))))
    return [array[:, at, :] for array in arrays]


def main():
    if len(sys.argv) < 3:
        raise SystemExit(__doc__)
    volume = stitched(sys.argv[2:], 1.2)
    panels = [("stitched", *middle_slice(volume, "Intensity"))]
    for exponent in EXPONENTS:
        diffuser = vtkUltrasoundSurfaceDiffuser()
        diffuser.SetInputData(volume)
        diffuser.SetInsideExponent(exponent)
        diffuser.SetOutsideExponent(exponent)
        diffuser.Update()
        panels.append((f"d = {exponent}", *middle_slice(diffuser.GetOutput(), "Intensity")))
    high = max(panel[1].max() for panel in panels[1:])
    figure, axes = plt.subplots(2, 4, figsize=(13, 4.6), facecolor="white")
    for axis in axes.flat:
        axis.axis("off")
    aspect = volume.GetSpacing()[2] / volume.GetSpacing()[0]
    for axis, (title, values, region) in zip(axes.flat, panels):
        axis.imshow(values, cmap="gray", vmin=0, vmax=high if title != "stitched" else None, aspect=aspect)
        axis.contour(region, [0.5], colors="white", linewidths=0.7)
        axis.set_title(title, fontsize=11)
    figure.tight_layout()
    figure.savefig(sys.argv[1], dpi=80)


if __name__ == "__main__":
    main()
