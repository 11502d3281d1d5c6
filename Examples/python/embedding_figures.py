#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""embedding_figures.py [--spacing MM] [FOLDER [VOLUME VOLUME ...]]: what embedding does, as pictures in FOLDER.

Three views of a phantom are stitched and embedded: what cropping would have left of them, how noise becomes a background, and
embedding beside plainer ways. Volumes that are given (posed, overlapping) are shown in the same way.
"""
import argparse
import json
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData

from echorama import (vtkUltrasoundEmbedder, vtkUltrasoundEmbedQuality, vtkUltrasoundFeather, vtkUltrasoundNoiseSource,
                      vtkUltrasoundPhantomSource, vtkUltrasoundReader, vtkUltrasoundStitcher, vtkUltrasoundSurfaceDiffuser,
                      vtkUltrasoundToneMapper)

COLOURS = np.array([[0, 0, 0], [150, 150, 150], [86, 180, 233], [230, 159, 0]]) / 255 # of EmbeddedVoxel


def array(volume, name):
    """An array of a volume, z first."""
    return vtk_to_numpy(volume.GetPointData().GetArray(name)).reshape(volume.GetDimensions()[::-1])


def with_arrays(like, **arrays):
    """A volume of the same geometry."""
    result = vtkImageData()
    result.CopyStructure(like)
    result.SetDirectionMatrix(like.GetDirectionMatrix())
    for name, values in arrays.items():
        data = numpy_to_vtk(np.ascontiguousarray(values).ravel(), deep=True)
        data.SetName(name)
        result.GetPointData().AddArray(data)
    result.GetPointData().SetActiveScalars("Intensity")
    return result


def phantom(spacing):
    stitcher = vtkUltrasoundStitcher()
    for x in (-35, 0, 35):
        view = vtkUltrasoundPhantomSource()
        view.SetSpacingMm(spacing)
        view.SetPosition(x, 0, 0)
        view.SetOrientation(0, -x / 7, 0)
        stitcher.AddInputConnection(view.GetOutputPort())
    stitcher.Update()
    return stitcher.GetOutput()


def tank(spacing):
    """Three views of a linear probe in water, each with speckle of its own: two walls and a block of tissue."""
    stitcher = vtkUltrasoundStitcher()
    for seed, (place, turn) in enumerate((((-6, 0, 0), (0, 2, 0)), ((0, 4, 0), (0, 0, 0)), ((6, -3, 0), (1, -2, 0))), 1):
        source = vtkUltrasoundNoiseSource()
        for name, value in (("FanAngle", 0), ("FanWidth", 38), ("SweepAngle", 0), ("SweepWidth", 24), ("DepthMax", 40),
                            ("IntensityModel", 0), ("Mean", 50), ("DepthCorrelationMm", 0.35), ("FanCorrelation", 0.5 / 38),
                            ("SweepCorrelation", 0.6 / 24), ("SpacingMm", spacing), ("Seed", seed)):
            getattr(source, "Set" + name)(value)
        source.SetPosition(*place)
        source.SetOrientation(*turn)
        source.FloatOutputOn()
        source.Update()
        view = source.GetOutput()
        axes, origin = view.GetDirectionMatrix(), view.GetOrigin()
        index = np.meshgrid(*(np.arange(n) for n in view.GetDimensions()[::-1]), indexing="ij", sparse=True)[::-1]
        x, y, z = (origin[i] + sum(axes.GetElement(i, j) * view.GetSpacing()[j] * index[j] for j in range(3)) for i in range(3))
        wall = (abs(z - 35) < 0.4) | ((abs(z - 10.5 - 0.1 * y) < 0.4) & (x < -10))
        block = (x > 6) & (y > -4) & (abs(z - 22) < 7)
        echo = array(view, "Intensity") * np.where(wall, 3, np.where(block, 1, 0.03))
        stitcher.AddInputData(with_arrays(view, Intensity=np.minimum(echo + 0.5, 255).astype(np.uint8),
                                          ValidRegion=array(view, "ValidRegion")))
    stitcher.Update()
    return stitcher.GetOutput()


def given(paths):
    stitcher = vtkUltrasoundStitcher()
    for path in paths:
        reader = vtkUltrasoundReader()
        reader.SetFileName(path)
        stitcher.AddInputConnection(reader.GetOutputPort())
    stitcher.Update()
    if stitcher.GetErrorCode():
        raise SystemExit("the volumes were not stitched")
    return stitcher.GetOutput()


class Scene:
    """A stitched volume, and all that is made of it on the grid of its embedding."""

    def __init__(self, name, stitched):
        self.name, self.stitched = name, stitched
        embedder = vtkUltrasoundEmbedder()
        embedder.SetInputData(stitched)
        embedder.Update()
        self.full = embedder.GetOutput()
        labels = array(self.full, "Embedding")
        # Where the data are on this grid, and what they were: blended voxels are taken from the original.
        self.seen = ((labels == 1) | (labels == 2)).astype(np.uint8)
        self.values = np.where(self.seen, self._original(), 0)
        noise = vtkUltrasoundNoiseSource()
        noise.SetInputData(self.full) # its fan and its grid
        noise.OnInputGridOn()
        noise.FloatOutputOn()
        noise.Update()
        self.noise = noise.GetOutput()
        # The plane through the data that shows the most border: widest along the first axes.
        counts = [self.seen.sum(axis=tuple(a for a in range(3) if a != axis), dtype=float) for axis in range(3)]
        self.axis = int(np.argmax([count.max() for count in counts]))
        self.index = int(np.argmax(counts[self.axis]))
        self.bright = np.percentile(self.values[self.seen > 0], 99.7)

    def _original(self):
        """The stitched intensities on the grid of the embedded volume, 0 where they do not reach: whole voxels apart."""
        source, target = array(self.stitched, "Intensity"), np.zeros(self.full.GetDimensions()[::-1])
        index = [0.0, 0.0, 0.0]
        self.full.TransformPhysicalPointToContinuousIndex(self.stitched.GetOrigin(), index)
        corner = np.rint(index).astype(int)[::-1]
        low, high = np.maximum(corner, 0), np.minimum(corner + source.shape, target.shape)
        there = tuple(slice(a, b) for a, b in zip(low, high))
        target[there] = source[tuple(slice(a, b) for a, b in zip(low - corner, high - corner))]
        return target

    def data(self):
        return with_arrays(self.full, Intensity=self.values.astype(np.float32), ValidRegion=self.seen)

    def overlay(self, feather_mm):
        """The data on noise as it is."""
        feather = vtkUltrasoundFeather()
        feather.SetInputData(0, self.data())
        feather.SetInputData(1, self.noise)
        feather.SetFeatherMm(feather_mm)
        feather.KeepTextureOff()
        feather.Update()
        return feather.GetOutput()

    def cut(self, volume, name="Intensity"):
        return np.take(array(volume, name) if isinstance(volume, vtkImageData) else volume, self.index, axis=self.axis)

    def shown(self, volume):
        """Grey for the eye: echoes span more than a screen shows."""
        return 255 * np.sqrt(np.clip(self.cut(volume) / self.bright, 0, 1))


def measured(scene, volume):
    quality = vtkUltrasoundEmbedQuality()
    quality.SetInputData(volume)
    quality.Update()
    return quality


def save(folder, name, rows, titles, side_titles, width=3.2):
    heights = [row[0].shape[0] / row[0].shape[1] for row in rows]
    figure, axes = plt.subplots(len(rows), len(rows[0]), squeeze=False, layout="constrained", dpi=100,
                                figsize=(width * len(rows[0]), width * sum(heights) + 0.25), gridspec_kw={"height_ratios": heights})
    for r, row in enumerate(rows):
        for c, panel in enumerate(row):
            axis = axes[r][c]
            axis.imshow(panel, cmap="gray", interpolation="bilinear" if panel.ndim == 2 else "nearest",
                        **({"vmin": 0, "vmax": 255} if panel.ndim == 2 else {}))
            axis.set(xticks=[], yticks=[])
            if r == 0:
                axis.set_title(titles[c], fontsize=9)
        axes[r][0].set_ylabel(side_titles[r], fontsize=9)
    figure.savefig(folder / name)
    plt.close(figure)
    Image.open(folder / name).convert("RGB").quantize(64, dither=Image.Dither.NONE).save(folder / name, optimize=True)
    print(f"wrote {folder / name}")


def coverage(folder, scenes):
    """What cropping leaves of the data, beside what embedding keeps (dissertation 6.2)."""
    rows = []
    for scene in scenes:
        quality = measured(scene, scene.full)
        crop = in_crop(scene, quality)
        rows.append([scene.shown(scene.data()), np.where(scene.cut(crop), scene.shown(scene.data()), 0), scene.shown(scene.full),
                     COLOURS[scene.cut(scene.full, "Embedding")]])
        print(f"{scene.name}: a crop keeps {quality.GetCropShare():.3f}")
    save(folder, "embedding_coverage.png", rows, ("stitched", "the largest crop", "embedded", "grey: data, blue: blend, orange: invented"),
         [scene.name for scene in scenes])


def backgrounds(folder, scenes):
    """Noise, its grain, and the grain with the diffused levels of the data (dissertation 6.14)."""
    rows = []
    for scene in scenes:
        diffuser = vtkUltrasoundSurfaceDiffuser()
        diffuser.SetInputData(scene.data())
        panels = [scene.shown(scene.noise)]
        fan = scene.cut(scene.noise, "ValidRegion")
        for levels in (False, True):
            tone = vtkUltrasoundToneMapper()
            tone.SetInputData(0, scene.noise)
            if levels:
                tone.SetLevelsConnection(diffuser.GetOutputPort())
            tone.Update()
            panels.append(scene.shown(tone.GetOutput()) if levels else np.clip(128 + 32 * scene.cut(tone.GetOutput()), 0, 255))
        panels.insert(2, scene.shown(diffuser.GetOutput()))
        rows.append([np.where(fan, panel, 0) for panel in panels])
    save(folder, "embedding_background.png", rows, ("noise", "its grain (tone mapped)", "levels at the surface, diffused",
                                                    "grain with these levels"), [scene.name for scene in scenes])


def ways(folder, scenes):
    """Naive, with a soft edge, and in full (dissertation 6.16)."""
    rows = []
    for scene in scenes:
        volumes = [scene.overlay(0.0), scene.overlay(3.0)]
        embedder = vtkUltrasoundEmbedder()
        embedder.SetInputData(scene.stitched)
        embedder.MatchContrastOff()
        embedder.MatchGrainOff()
        embedder.KeepTextureOff()
        embedder.Update()
        volumes += [embedder.GetOutput(), scene.full]
        rows.append([scene.shown(volume) for volume in volumes])
        for way, volume in zip(WAYS, volumes):
            quality = measured(scene, volume)
            print(f"{scene.name}, {way}: the border jumps by {quality.GetSeamJump():.1f} of {quality.GetJumpLimit():.1f} allowed, "
                  f"deviations {quality.GetDeviationRatio():.2f} : 1")
    save(folder, "embedding_ways.png", rows, WAYS, [scene.name for scene in scenes])


def outlines(folder, spacing):
    """A linear probe in water: in a fan with fixed widths, and as the data ask."""
    scene = Scene("a tank", tank(spacing))
    embedder = vtkUltrasoundEmbedder()
    embedder.SetInputData(scene.stitched)
    for name, value in (("Outline", 3), ("MarginMm", 5), ("FeatherMm", 3), ("MatchGrain", False)):
        getattr(embedder, "Set" + name)(value)
    embedder.Update()
    rows, spans = [], []
    for volume in (embedder.GetOutput(), scene.full):
        labels = array(volume, "Embedding")
        plane = labels.shape[1] // 2
        grey = np.sqrt(np.clip(array(volume, "Intensity")[:, plane] / 130, 0, 1)) * 255
        spans.append([grey, COLOURS[labels[:, plane]]])
        seen = ((labels == 1) | (labels == 2)).sum()
        print(f"{scene.name}: {(labels == 2).sum() / seen:.1%} of the data mixed, {(labels == 3).sum() / (labels > 0).sum():.1%} invented")
    rows.append([spans[0][0], spans[0][1], *(np.pad(panel, [(1, 1), (1, 1), (0, 0)][:panel.ndim]) for panel in spans[1])])
    save(folder, "embedding_outlines.png", rows, ("a curved fan, fixed widths", "grey: data, blue: blend, orange: invented",
                                                  "as the data ask", ""), [scene.name])


WAYS = ("laid over noise", "with a soft edge", "noise with the levels of the data", "and their contrast and grain")


def in_crop(scene, quality):
    """Which voxels of the grid are in the crop: the box that the measure tells, in beam space."""
    volume, box = scene.full, json.loads(quality.GetReport())["crop"]
    probe = vtk_to_numpy(volume.GetFieldData().GetArray("ProbeGeometry")).ravel()
    place = np.linalg.inv(vtk_to_numpy(volume.GetFieldData().GetArray("ProbeToWorld")).reshape(4, 4))
    direction = volume.GetDirectionMatrix()
    to_world = np.array([[direction.GetElement(i, j) * volume.GetSpacing()[j] for j in range(3)] for i in range(3)])
    z, y, x = np.meshgrid(*(np.arange(n) for n in volume.GetDimensions()[::-1]), indexing="ij", sparse=True)
    x, y, z = (sum(place[i, :3] @ to_world[:, j] * index for j, index in enumerate((x, y, z))) +
               place[i, :3] @ volume.GetOrigin() + place[i, 3] for i in range(3))

    def on_arc(across, outward, angle, width):
        """Where the normal of a face through a point starts (in whole faces), and how deep the point lies below it."""
        if angle < 1e-6:
            return across / width, outward
        radius = width / angle
        return np.arctan2(across, outward + radius) / angle, np.hypot(across, outward + radius) - radius

    sweep, depth = on_arc(y, z, np.radians(probe[2]), probe[3])
    fan, depth = on_arc(x, depth, np.radians(probe[0]), probe[1])
    fan -= probe[6] if len(probe) > 6 else 0
    return np.all([(box[name][0] <= values) & (values <= box[name][1])
                   for name, values in (("depth_mm", depth), ("fan", fan), ("sweep", sweep))], axis=0)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--spacing", type=float, default=1.0, help="voxel size of the phantom, mm")
    parser.add_argument("folder", nargs="?", default=".", type=pathlib.Path)
    parser.add_argument("volumes", nargs="*", help="files of two or more posed volumes that overlap")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    scenes = [Scene("phantom", phantom(options.spacing))]
    if options.volumes:
        scenes.append(Scene("given volumes", given(options.volumes)))
    coverage(options.folder, scenes)
    backgrounds(options.folder, scenes)
    ways(options.folder, scenes)
    outlines(options.folder, 0.2 * options.spacing)


main()
