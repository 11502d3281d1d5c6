# SPDX-License-Identifier: BSD-3-Clause
"""Volumes in world space: what the demo's pictures and numbers are made of.

A volume may lie obliquely: its direction matrix is part of its pose. vtkImageReslice and the other image filters of VTK
lose that matrix, so points are not cut out of a volume by a filter here. They are given in the world and carried into
the index space of each volume by the inverse of its whole geometry, and the voxels around them are interpolated.
"""
import dataclasses
import pathlib

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLImageDataReader

import echorama


def xml_image(path):
    reader = vtkXMLImageDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


class Displacement:
    """A displacement image: the cubic spline through its vectors, which fades to zero beyond it (vtkUltrasoundDisplacement)."""

    def __init__(self, path):
        image = xml_image(path)
        array = image.GetPointData().GetArray(echorama.vtkUltrasoundDisplacement.DisplacementName())
        if array is None:
            raise OSError(f"{path}: it holds no displacement")
        self.world_to_index = np.linalg.inv(index_to_world(image))
        self.coefficients = vtk_to_numpy(array).astype(float).reshape(*image.GetDimensions()[::-1], 3)
        for axis, count in enumerate(self.coefficients.shape[:3]):
            through = (4 * np.eye(count) + np.eye(count, k=1) + np.eye(count, k=-1)) / 6
            self.coefficients = np.moveaxis(np.linalg.solve(through, np.moveaxis(self.coefficients, axis, 0).reshape(count, -1))
                                            .reshape(count, *np.delete(self.coefficients.shape, axis)), 0, axis)

    def at(self, points):
        """u at world points [..., 3], mm."""
        index = (points.reshape(-1, 3) @ self.world_to_index[:3, :3].T + self.world_to_index[:3, 3])[:, ::-1]
        first = np.floor(index).astype(int) - 1
        t = index - first - 1
        weights = np.stack([(1 - t) ** 3, 4 - 6 * t ** 2 + 3 * t ** 3, 1 + 3 * t + 3 * t ** 2 - 3 * t ** 3, t ** 3]) / 6
        count = np.array(self.coefficients.shape[:3])
        total = np.zeros((len(index), 3))
        for offset in np.ndindex(4, 4, 4):
            node = first + offset
            inside = ((node >= 0) & (node < count)).all(axis=1)
            weight = np.prod([weights[o, :, axis] for axis, o in enumerate(offset)], axis=0)
            total[inside] += weight[inside, np.newaxis] * self.coefficients[tuple(node[inside].T)]
        return total.reshape(points.shape)


def index_to_world(image):
    direction, matrix = image.GetDirectionMatrix(), np.eye(4)
    matrix[:3, :3] = [[direction.GetElement(row, column) * image.GetSpacing()[column] for column in range(3)] for row in range(3)]
    matrix[:3, 3] = image.GetOrigin()
    return matrix


@dataclasses.dataclass(frozen=True)
class Volume:
    name: str
    intensity: np.ndarray  # [k, j, i]
    valid: np.ndarray  # bool, the same shape: which voxels are real
    spacing: np.ndarray  # mm
    index_to_world: np.ndarray  # 4 x 4
    labels: np.ndarray = None  # what the voxels of an embedded volume are: 0 nothing, 1 data, 2 blend, 3 invented
    displacement: object = None  # a Displacement: what belongs at x is shown at x + u(x)

    @staticmethod
    def read(path):
        reader = echorama.vtkUltrasoundReader()
        reader.SetFileName(str(path))
        reader.Update()
        image = reader.GetOutput()
        shape = image.GetDimensions()[::-1]
        intensity = echorama.vtkUltrasoundVolume.GetIntensity(image)
        if intensity is None:
            raise OSError(f"{path}: cannot be read")
        valid = echorama.vtkUltrasoundVolume.GetValidRegion(image)
        labels = image.GetPointData().GetArray(echorama.vtkUltrasoundVolume.EmbeddingName())
        return Volume(pathlib.Path(path).name, vtk_to_numpy(intensity).reshape(shape),
                      vtk_to_numpy(valid).reshape(shape) != 0 if valid is not None else np.ones(shape, bool),
                      np.array(image.GetSpacing()), index_to_world(image),
                      vtk_to_numpy(labels).reshape(shape) if labels else None)

    def moved(self, pose):
        """The same voxels elsewhere; pose is a rigid 4 x 4 matrix, VolumeToWorld."""
        return dataclasses.replace(self, index_to_world=np.asarray(pose) @ self.index_to_world)

    @property
    def dimensions(self):
        return self.intensity.shape[::-1]

    @property
    def extent_mm(self):
        return self.spacing * self.dimensions

    @property
    def real_percent(self):
        return 100 * float(self.valid.mean())

    def real_box(self):
        """Lowest and highest world corner of the real voxels."""
        if not self.valid.any():
            raise ValueError(f"{self.name}: no voxel is real")
        ends = []
        for axis in range(3):
            used = np.flatnonzero(self.valid.any(axis=tuple(other for other in range(3) if other != axis)))
            ends.insert(0, (used[0], used[-1]))
        corners = np.array([[i, j, k, 1] for i in ends[0] for j in ends[1] for k in ends[2]]) @ self.index_to_world.T
        return corners[:, :3].min(axis=0), corners[:, :3].max(axis=0)

    def as_seen(self):
        """An embedded volume as a machine shows it: what was invented counts as real."""
        return dataclasses.replace(self, valid=self.labels > 0)

    def labels_at(self, points):
        """Labels of the nearest voxels to world points [..., 3]; 0 outside."""
        world_to_index = np.linalg.inv(self.index_to_world)
        index = np.rint(points.reshape(-1, 3) @ world_to_index[:3, :3].T + world_to_index[:3, 3]).astype(int)
        labels = np.zeros(len(index), np.uint8)
        inside = ((index >= 0) & (index < self.dimensions)).all(axis=1)
        i, j, k = index[inside].T
        labels[inside] = self.labels[k, j, i]
        return labels.reshape(points.shape[:-1])

    def at(self, points):
        """Trilinear values at world points [..., 3]; NaN where less than half of the weight falls on real voxels."""
        if self.displacement is not None:
            points = points + self.displacement.at(points)
        world_to_index = np.linalg.inv(self.index_to_world)
        index = points.reshape(-1, 3) @ world_to_index[:3, :3].T + world_to_index[:3, 3]
        size = np.array(self.dimensions)
        values = np.full(len(index), np.nan, np.float32)
        inside = np.flatnonzero(((index >= -0.5) & (index <= size - 0.5)).all(axis=1))
        index = index[inside].clip(0, size - 1)
        first = np.minimum(np.floor(index).astype(int), np.maximum(size - 2, 0))
        part = index - first
        total, weights = np.zeros(len(index)), np.zeros(len(index))
        for corner in np.ndindex(2, 2, 2):
            i, j, k = np.minimum(first + corner, size - 1).T
            weight = np.prod(np.where(corner, part, 1 - part), axis=1) * self.valid[k, j, i]
            total += weight * np.where(weight > 0, self.intensity[k, j, i], 0)
            weights += weight
        real = weights >= 0.5
        values[inside[real]] = total[real] / weights[real]
        return values.reshape(points.shape[:-1])


def box_around(volumes):
    boxes = [volume.real_box() for volume in volumes]
    return np.min([low for low, _ in boxes], axis=0), np.max([high for _, high in boxes], axis=0)


@dataclasses.dataclass(frozen=True)
class Lattice:
    """Values of several volumes on one cubic lattice of world points."""
    step: float  # mm
    points: np.ndarray  # [x, y, z, 3]
    values: np.ndarray  # [volume, x, y, z], NaN where a volume is not real

    @staticmethod
    def over(volumes, points_per_axis=72):
        low, high = box_around(volumes)
        step = float((high - low).max()) / points_per_axis
        axes = [np.arange(low[axis] + step / 2, high[axis] + step / 2, step) for axis in range(3)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        return Lattice(step, points, np.stack([volume.at(points) for volume in volumes]))

    @property
    def real(self):
        return np.isfinite(self.values)


def blurred(values):
    """Binomial blur by one sample along each axis; what lies outside counts as 0."""
    for axis in range(values.ndim):
        padded = np.pad(values, [(int(axis == other), int(axis == other)) for other in range(values.ndim)])
        count = values.shape[axis]
        low, middle, high = (padded.take(range(start, start + count), axis=axis) for start in range(3))
        values = (low + 2 * middle + high) / 4
    return values


def blurred_where_real(values):
    """The same among finite values alone; NaN stays NaN."""
    real = np.isfinite(values)
    return np.where(real, blurred(np.where(real, values, 0)) / np.maximum(blurred(real.astype(np.float32)), 1e-6), np.nan)


@dataclasses.dataclass(frozen=True)
class Overlap:
    """How two volumes agree where both are real."""
    first: int
    second: int
    percent: float  # of the smaller one
    correlation: float  # of the grey values, -1 to 1; NaN where nothing varies
    difference: float  # mean absolute, grey levels
    centre: np.ndarray  # mm


def overlaps(lattice, least_percent=5.0):
    """Of every pair that shares enough of the lattice. Compared after a blur over three points of the lattice: speckle
    differs with the angle it is seen from, the structures do not."""
    real = lattice.real
    smooth = [blurred_where_real(values) for values in lattice.values]
    found = []
    for first in range(len(real)):
        for second in range(first + 1, len(real)):
            both = real[first] & real[second]
            percent = 100 * both.sum() / max(min(real[first].sum(), real[second].sum()), 1)
            if percent < least_percent:
                continue
            a, b = smooth[first][both].astype(float), smooth[second][both].astype(float)
            spread = a.std() * b.std()
            found.append(Overlap(first, second, float(percent),
                                 float(((a - a.mean()) * (b - b.mean())).mean() / spread) if spread > 0 else float("nan"),
                                 float(np.abs(a - b).mean()), lattice.points[both].mean(axis=0)))
    return found


def way_down(points, real):
    """The world axis and sign that point into the tissue.

    A fan widens with depth, so the middle of its voxels lies deeper than the middle of its box.
    Where nothing says so (a box of data), patient axes decide: down is towards the back, +y in LPS.
    """
    inside = points[real]
    low, high = inside.min(axis=0), inside.max(axis=0)
    shift = (inside.mean(axis=0) - (low + high) / 2) / np.maximum(high - low, 1e-9)
    axis = int(np.abs(shift).argmax())
    if abs(shift[axis]) < 0.02:
        return 1, 1
    return axis, 1 if shift[axis] > 0 else -1
