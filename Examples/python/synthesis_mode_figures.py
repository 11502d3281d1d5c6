#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Figures of the synthesizer: both modes side by side, and what the clarity of counted events changes.

synthesis_mode_figures.py FOLDER [--quick]
"""
import argparse
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from vtkmodules.util.numpy_support import vtk_to_numpy

import echorama


def synthesizer_of(source, position, quick):
    synthesizer = echorama.vtkUltrasoundSynthesizer()
    synthesizer.SetInputConnection(source.GetOutputPort())
    synthesizer.SetPosition(position)
    synthesizer.SliceOnlyOn()
    synthesizer.SetDepthMin(0)
    synthesizer.SetDepthMax(130)
    synthesizer.SetElements(48 if quick else 192)
    synthesizer.SetSamples(150 if quick else 700)
    synthesizer.SetRaysPerElement(64 if quick else 2000)
    synthesizer.SetSubRays(1 if quick else 16)
    return synthesizer


def picture(axes, synthesizer, title):
    synthesizer.Update()
    image = synthesizer.GetOutput()
    grey = vtk_to_numpy(image.GetPointData().GetArray("Intensity")).reshape(image.GetDimensions()[::-1]).squeeze()
    axes.imshow(grey, cmap="gray", vmin=0, vmax=255)
    axes.set_title(title)
    axes.axis("off")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--quick", action="store_true", help="coarse pictures, for tests")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)

    scenes = [(echorama.vtkUltrasoundAnatomySource(), (-30, 0, 0), "invented abdomen"),
              (echorama.vtkUltrasoundTissueSource(), (0, 0, 0), "packed spheres")]
    figure, grid = plt.subplots(2, 2, figsize=(11, 8.4))
    for row, (source, position, name) in zip(grid, scenes):
        synthesizer = synthesizer_of(source, position, options.quick)
        for axes, mode, what in ((row[0], synthesizer.COHERENT, "coherent echoes"), (row[1], synthesizer.COUNTING, "counted events")):
            synthesizer.SetMode(mode)
            synthesizer.SetTgcDbPerCm(3.5 if mode == synthesizer.COHERENT else 0) # events are counted without attenuation
            picture(axes, synthesizer, f"{name}: {what}")
    figure.tight_layout()
    figure.savefig(options.folder / "Synthesizer.png", dpi=60)

    figure, row = plt.subplots(1, 4, figsize=(15, 4))
    synthesizer = synthesizer_of(*scenes[1][:2], options.quick)
    synthesizer.SetMode(synthesizer.COUNTING)
    for axes, clarity in zip(row, (1, 10, 50, 200)):
        synthesizer.SetClarity(clarity)
        synthesizer.SetTgcDbPerCm(0)
        synthesizer.SetGainDb(0.06 * clarity)
        picture(axes, synthesizer, f"clarity {clarity}")
    figure.tight_layout()
    figure.savefig(options.folder / "SynthesizerClarity.png", dpi=60)


if __name__ == "__main__":
    main()
