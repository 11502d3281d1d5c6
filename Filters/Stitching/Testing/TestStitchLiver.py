#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Two overlapping volumes of a real sweep, stitched, against the volume that was made of the whole sweep."""
import json
import os
import sys

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy

from echorama.EchoramaFiltersStitching import vtkUltrasoundStitcher

try:
    from echorama.EchoramaReaders import vtkUltrasoundReader
except ImportError:
    print("skipped: the readers were not built")
    sys.exit(77)

FOLDER = os.path.join(os.environ["ECHORAMA_SOURCE_DIR"], "..", "shared", "data", "liver")


def array(image, name):
    return vtk_to_numpy(image.GetPointData().GetArray(name)).reshape(image.GetDimensions()[::-1])


def shifted(values, valid, first, shape):
    """values at first + (0 ... shape - 1), continuous indices (x, y, z) along the same axes; NaN where a neighbour is not real."""
    low = np.floor(first).astype(int)
    result = np.zeros(shape[::-1])
    for corner in np.ndindex(2, 2, 2):  # x, y, z
        weight = np.prod(np.where(corner, first - low, 1 - (first - low)))
        if weight == 0:
            continue
        piece = np.full(shape[::-1], np.nan)
        source, target = [], []
        for axis in (2, 1, 0):
            begin = low[axis] + corner[axis]
            a, b = max(begin, 0), min(begin + shape[axis], values.shape[2 - axis])
            source.append(slice(a, b))
            target.append(slice(a - begin, b - begin))
        piece[tuple(target)] = np.where(valid[tuple(source)] > 0, values[tuple(source)], np.nan)
        result += weight * piece
    return result


def main():
    paths = [os.path.join(FOLDER, f"liver_volume_{name}.mha") for name in ("A", "B", "full")]
    if not all(os.path.exists(path) for path in paths):
        print("skipped: no liver volumes beside the project")
        return 77
    readers = []
    for path in paths:
        reader = vtkUltrasoundReader()
        reader.SetFileName(path)
        reader.Update()
        readers.append(reader)
    full = readers[2].GetOutput()
    stitcher = vtkUltrasoundStitcher()
    for reader in readers[:2]:
        stitcher.AddInputConnection(reader.GetOutputPort())
    errors = {}
    default = stitcher.GetMethodAsString()
    methods = next(one["choices"] for one in json.loads(stitcher.GetParameterDescriptions()) if one["name"] == "Method")
    for method in methods:
        stitcher.SetParameterAsText("Method", method)
        stitcher.Update()
        out = stitcher.GetOutput()
        if not errors:
            first = (np.array(out.GetOrigin()) - full.GetOrigin()) / full.GetSpacing()
            assert np.allclose(out.GetSpacing(), full.GetSpacing())
            truth = shifted(array(full, "Intensity"), array(full, "ValidRegion"), first, out.GetDimensions())
        known = (array(out, "ValidRegion") > 0) & ~np.isnan(truth)
        overlap = array(out, "Coverage") > 1
        error = np.abs(array(out, "Intensity") - truth)
        inside, outside = error[known & overlap].mean(), error[known & ~overlap].mean()
        name = stitcher.GetMethodAsString()
        errors[name] = inside
        print(f"{name}: mean absolute difference {inside:.3f} in the overlap, {outside:.3f} outside of it, grey levels")
        assert known.sum() > 0.8 * (array(out, "ValidRegion") > 0).sum()
        assert outside < 1.0, "where a volume is alone it must be as it was, but for interpolation"
        assert inside < 1.0
    assert default in errors and len(errors) == len(methods), errors
    assert all(errors[name] < errors["maximum"] for name in ("distance", "feather", default)), errors
    return 0


sys.exit(main())
