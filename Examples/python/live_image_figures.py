#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""live_image_figures.py [--spacing MM] [FOLDER]: what live images of the phantom look like, as live_image.png in FOLDER.

Above: probes, all at one place of one volume. Below: the plane as thin as a razor and as thick as a beam, and what the controls do.
"""
import argparse
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from vtkmodules.util.numpy_support import vtk_to_numpy

from echorama import vtkUltrasoundLiveImage, vtkUltrasoundPhantomSource


def picture(volume, probe, place, **controls):
    live = vtkUltrasoundLiveImage()
    live.SetInputData(volume)
    live.SetParameterAsText("Probe", probe)
    live.SetPosition(*place)
    for name, value in controls.items():
        live.SetParameter(name, value)
    live.Update()
    image = live.GetOutput()
    return vtk_to_numpy(image.GetPointData().GetArray("Intensity")).reshape(image.GetDimensions()[1::-1])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", default=".", type=pathlib.Path)
    parser.add_argument("--spacing", type=float, default=0.4, help="edge of the phantom's voxels, mm")
    arguments = parser.parse_args()
    phantom = vtkUltrasoundPhantomSource()
    phantom.SetSpacingMm(arguments.spacing)
    phantom.Update()
    volume = phantom.GetOutput()
    above, inside = (0, 0, 2), (-8, 0, 42)
    shown = [("convex", "convex", above, {"DepthMm": 90}), ("linear", "linear", above, {"DepthMm": 70}),
             ("phased", "phased", above, {"DepthMm": 90}), ("radial, inside", "radial", inside, {"DepthMm": 28}),
             ("one plane", "convex", above, {"DepthMm": 90, "ThicknessMm": 0}),
             ("6 mm thick", "convex", above, {"DepthMm": 90, "ThicknessMm": 6, "FocusMm": 45, "ThicknessPlanes": 17}),
             ("dynamic range 40 dB, gain 8 dB", "convex", above, {"DepthMm": 90, "DynamicRangeDb": 40, "GainDb": 8}),
             ("noise at -45 dB, deep gain 10 dB", "convex", above,
              {"DepthMm": 90, "NoiseDb": -45, "Tgc6Db": 4, "Tgc7Db": 7, "Tgc8Db": 10})]
    figure, axes = plt.subplots(2, 4, figsize=(12, 5.0), facecolor="black")
    for axis, (title, probe, place, controls) in zip(axes.flat, shown):
        axis.imshow(picture(volume, probe, place, **controls), cmap="gray", vmin=0, vmax=255)
        axis.set_title(title, fontsize=9, color="white", pad=3)
        axis.axis("off")
    figure.subplots_adjust(0.005, 0.005, 0.995, 0.95, 0.02, 0.09)
    figure.savefig(arguments.folder / "live_image.png", dpi=85, facecolor="black")


if __name__ == "__main__":
    main()
