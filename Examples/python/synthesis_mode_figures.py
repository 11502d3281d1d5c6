#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Figures of the synthesizer: both modes side by side, what the clarity of counted events changes, and wide beams and their lobes.

synthesis_mode_figures.py FOLDER [--quick] [--scan SEQUENCE]
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


def grey_of(image):
    return vtk_to_numpy(image.GetPointData().GetArray("Intensity")).reshape(image.GetDimensions()[::-1]).squeeze()


def picture(axes, synthesizer, title):
    synthesizer.Update()
    show(axes, grey_of(synthesizer.GetOutput()), title)


def show(axes, grey, title):
    axes.imshow(grey, cmap="gray", vmin=0, vmax=255)
    axes.set_title(title)
    axes.axis("off")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--quick", action="store_true", help="coarse pictures, for tests")
    parser.add_argument("--scan", type=pathlib.Path, help="a tracked sequence, of which a frame is shown beside wide beams")
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

    figure, row = plt.subplots(1, 4 if options.scan else 3, figsize=(20 if options.scan else 15, 4.4))
    synthesizer = synthesizer_of(*scenes[1][:2], options.quick)
    synthesizer.SetTgcDbPerCm(3.5)
    for axes, (wide, lobes, title) in zip(row, ((False, 0, "beams along their axes"), (True, 0, "wide beams"),
                                                (True, 4, "wide beams, side and grating lobes"))):
        synthesizer.SetWideBeams(wide)
        synthesizer.SetSideLobes(lobes)
        synthesizer.SetApodisationToRectangular()
        synthesizer.SetPitchMm(0.6 if lobes else 0)
        picture(axes, synthesizer, title)
    if options.scan:
        reader = echorama.vtkUltrasoundSequenceReader()
        reader.SetFileName(str(options.scan))
        reader.Update()
        show(row[3], grey_of(reader.GetOutputDataObject(0)), "a liver, in vivo")
    figure.tight_layout()
    figure.savefig(options.folder / "SynthesizerBeams.png", dpi=60)


if __name__ == "__main__":
    main()
