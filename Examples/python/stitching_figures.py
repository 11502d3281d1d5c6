#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""stitching_figures.py [--size N] [FOLDER [VOLUME VOLUME ...]]: what the ways of stitching look like, as pictures in FOLDER.

Three flat shapes that overlap (a square, a triangle and a circle) show regions, distances, membranes and the exponent of the
weights; the same shapes filled with speckle show what becomes of texture. Volumes that are given (posed, overlapping) are
stitched in every way too, and a slice through their overlap is shown.
"""
import argparse
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData

from echorama import vtkUltrasoundDistanceMap, vtkUltrasoundReader, vtkUltrasoundStitcher

COLOURS = np.array([[0.84, 0.37, 0.20], [0.20, 0.55, 0.75], [0.95, 0.77, 0.28]], dtype=np.float32)
NAMES = ("square", "triangle", "circle")
WAYS = (("plain average", "average", "mix"), ("feather (Szeliski)", "feather", "mix"), ("distance", "distance", "mix"),
        ("membrane", "membrane", "mix"))
TEXTURES = (("plain average", "average", "mix"), ("membrane, mix", "membrane", "mix"),
            ("membrane, split", "membrane", "split"))


def shapes(size):
    """Masks of a square, a triangle and a circle that overlap each other in pairs and all three in the middle."""
    y, x = np.mgrid[0:size, 0:size] / size
    square = (np.abs(x - 0.32) < 0.25) & (np.abs(y - 0.32) < 0.25)
    triangle = (y > 0.12) & (y < 0.66) & (np.abs(x - 0.64) < 0.31 * (y - 0.12) / 0.54)
    circle = np.hypot(x - 0.45, y - 0.64) < 0.27
    return [square, triangle, circle]


def image(values, valid):
    """A 2D image as the filters take it."""
    result = vtkImageData()
    result.SetDimensions(values.shape[1], values.shape[0], 1)
    for name, array in (("Intensity", values.astype(np.float32)), ("ValidRegion", valid.astype(np.uint8))):
        data = numpy_to_vtk(np.ascontiguousarray(array).ravel(), deep=True)
        data.SetName(name)
        result.GetPointData().AddArray(data)
    result.GetPointData().SetActiveScalars("Intensity")
    return result


def array(volume, name):
    """An array of a volume, z first."""
    return vtk_to_numpy(volume.GetPointData().GetArray(name)).reshape(volume.GetDimensions()[::-1])


def stitched(volumes, method, texture="mix", sharpness=1.5, weights=False):
    stitcher = vtkUltrasoundStitcher()
    for volume in volumes:
        stitcher.AddInputDataObject(volume)
    stitcher.SetParameterAsText("Method", method)
    stitcher.SetParameterAsText("Texture", texture)
    stitcher.SetSharpness(sharpness)
    stitcher.SetOutputWeights(weights)
    stitcher.Update()
    if stitcher.GetErrorCode():
        raise SystemExit("the volumes were not stitched")
    return stitcher.GetOutput()


def placed(values, masks):
    """Values of the stitched grid on that of the shapes: it begins where the first shape does."""
    rows, columns = np.nonzero(np.any(masks, axis=0))
    result = np.zeros(masks[0].shape, dtype=values.dtype)
    result[rows.min():rows.min() + values.shape[0], columns.min():columns.min() + values.shape[1]] = values
    return result


def on_shapes(volume, name, masks):
    values = array(volume, name)[0]
    return values if values.shape == masks[0].shape else placed(values, masks)


def painted(masks, method, sharpness=1.5):
    """The shapes in their colours, stitched: an RGB picture on white."""
    channels = [on_shapes(stitched([image(np.full(mask.shape, COLOURS[i][c]), mask) for i, mask in enumerate(masks)], method,
                                   sharpness=sharpness), "Intensity", masks) for c in range(3)]
    picture = np.stack(channels, axis=-1)
    picture[~np.any(masks, axis=0)] = 1
    return np.clip(picture, 0, 1)


def scale_of(masks, which):
    """The membrane s of one shape: of two volumes, with an exponent of 1, weights are just that."""
    others = np.any([mask for i, mask in enumerate(masks) if i != which], axis=0)
    volume = stitched([image(np.ones(mask.shape), mask) for mask in (masks[which], others)], "membrane", sharpness=1.0,
                      weights=True)
    return on_shapes(volume, "Weight0", masks)


def distance_to(region):
    measure = vtkUltrasoundDistanceMap()
    measure.SetInputData(image(region.astype(np.float32), region))
    measure.Update()
    return array(measure.GetOutput(), "Distance")[0]


def save(folder, name, rows, titles, side_titles=(), grey=True, width=1.9):
    """One picture of a table of panels."""
    tall, wide = rows[0][0].shape[:2]
    figure, axes = plt.subplots(len(rows), len(rows[0]), squeeze=False, layout="constrained",
                                figsize=(width * len(rows[0]), width * len(rows) * tall / wide + 0.2), dpi=110)
    for r, row in enumerate(rows):
        for c, panel in enumerate(row):
            axis = axes[r][c]
            axis.imshow(panel, cmap="gray" if grey else "magma", interpolation="nearest",
                        **({"vmin": 0, "vmax": 255} if panel.ndim == 2 and grey else {}))
            axis.set(xticks=[], yticks=[])
            if r == 0:
                axis.set_title(titles[c], fontsize=8)
            if c == 0 and side_titles:
                axis.set_ylabel(side_titles[r], fontsize=8)
    figure.savefig(folder / name)
    plt.close(figure)
    print(f"wrote {folder / name}")


def regions(folder, masks):
    """Pure (full) and empty (striped) regions; distances to both; what a membrane starts from, and the membrane."""
    pure = [mask & ~np.any([m for j, m in enumerate(masks) if j != i], axis=0) for i, mask in enumerate(masks)]
    empty = [np.any([m for j, m in enumerate(masks) if j != i], axis=0) & ~mask for i, mask in enumerate(masks)]
    y, x = np.mgrid[0:masks[0].shape[0], 0:masks[0].shape[1]]
    stripes = (x + y) % 10 < 5
    panels = []
    for i in range(3):
        panel = np.ones(masks[0].shape + (3,), dtype=np.float32)
        panel[masks[i] & ~pure[i]] = 0.93
        panel[empty[i] & stripes] = 0.6
        panel[pure[i]] = COLOURS[i]
        panels.append(panel)
    save(folder, "stitching_regions.png", [panels], NAMES)
    distances = [[distance_to(region[i]) for i in range(3)] for region in (pure, empty)]
    save(folder, "stitching_distances.png", distances, NAMES, ("to the pure region", "to the empty region"), grey=False)
    start, membrane = [], []
    for i in range(3):
        picture = np.full(masks[0].shape + (3,), 1.0)
        overlap = masks[i] & ~pure[i]
        picture[np.any(masks, axis=0)] = [0.55, 0.65, 0.8]
        picture[empty[i]] = 0
        picture[pure[i]] = 0.999
        picture[~np.any(masks, axis=0)] = [0.8, 0.85, 0.92]
        start.append(picture)
        solved = picture.copy()
        solved[overlap] = scale_of(masks, i)[overlap][:, None]
        membrane.append(solved)
    save(folder, "stitching_membranes.png", [start, membrane], NAMES, ("known", "membrane"))


def speckle(shape, seed):
    """Grey levels of fully developed speckle: the logarithm of a filtered complex Gaussian field's magnitude."""
    generator = np.random.default_rng(seed)
    field = generator.standard_normal((2,) + shape)
    frequency = np.hypot(np.fft.fftfreq(shape[0])[:, None], np.fft.fftfreq(shape[1])[None, :])
    blurred = np.fft.ifft2(np.fft.fft2(field[0] + 1j * field[1]) * np.exp(-(frequency / 0.16)**2))
    magnitude = np.abs(blurred)
    return 20 * np.log10(np.maximum(magnitude / magnitude.mean(), 1e-3))


def textures(folder, masks):
    """The shapes filled with speckle that differs from each to the next, as views of moving tissue do."""
    volumes, brightness = [], (140, 115, 165)
    y = np.mgrid[0:masks[0].shape[0], 0:masks[0].shape[1]][0] / masks[0].shape[0]
    for i, mask in enumerate(masks):
        volumes.append(image(np.clip(brightness[i] - 40 * (y - 0.5) + 4.0 * speckle(mask.shape, i), 0, 255), mask))
    panels = [on_shapes(stitched(volumes, method, texture), "Intensity", masks) for _, method, texture in TEXTURES]
    rows, columns = np.nonzero(np.sum(masks, axis=0) > 1)
    panels = [panel[max(rows.min() - 8, 0):rows.max() + 9, max(columns.min() - 8, 0):columns.max() + 9] for panel in panels]
    titles = [title for title, _, _ in TEXTURES]
    save(folder, "stitching_textures.png", [panels], titles, width=2.6)


def volumes_in_slices(folder, paths):
    """Given volumes, stitched in every way: the slice that has most of their overlap."""
    readers = []
    for path in paths:
        reader = vtkUltrasoundReader()
        reader.SetFileName(path)
        reader.Update()
        readers.append(reader)
    volumes = [reader.GetOutput() for reader in readers]
    panels, titles, place = [], [], None
    for title, method, texture in (*WAYS, *TEXTURES[2:]):
        volume = stitched(volumes, method, texture)
        if place is None: # where volumes are alone and overlap, both
            coverage = array(volume, "Coverage")
            counts = [[np.sum(which, axis=tuple(a for a in range(3) if a != axis), dtype=float) for axis in range(3)]
                      for which in (coverage > 1, coverage == 1)]
            both = [np.minimum(counts[0][axis], counts[1][axis]) for axis in range(3)]
            axis = int(np.argmax([counted.max() for counted in both]))
            place = (axis, int(np.argmax(both[axis])))
            bright = np.percentile(array(volume, "Intensity")[coverage > 0], 99.8)
        panel = np.take(array(volume, "Intensity"), place[1], axis=place[0])
        panels.append(255 * np.sqrt(np.clip(panel / bright, 0, 1))) # echoes span more than a screen shows
        titles.append(title)
    save(folder, "stitching_volumes.png", [panels], titles, width=2.6)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--size", type=int, default=240, help="pixels along a side of the shapes' picture")
    parser.add_argument("folder", nargs="?", default=".", type=pathlib.Path)
    parser.add_argument("volumes", nargs="*", help="files of two or more posed volumes that overlap")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    masks = shapes(options.size)
    regions(options.folder, masks)
    exponents = (0.0, 0.5, 1.0, 1.5, 3.0, 8.0, 50.0)
    save(options.folder, "stitching_sharpness.png",
         [[painted(masks, method, b) for b in exponents] for method in ("distance", "membrane")],
         [f"b = {b:g}" for b in exponents], ("distance", "membrane"))
    save(options.folder, "stitching_methods.png", [[painted(masks, method) for _, method, _ in WAYS]], [way[0] for way in WAYS])
    textures(options.folder, masks)
    if options.volumes:
        volumes_in_slices(options.folder, options.volumes)


main()
