# SPDX-License-Identifier: BSD-3-Clause
"""A real GE Kretz file of a sphere in a water tank: read as it is, converted, the sphere is round."""
import os
import sys
from pathlib import Path

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy

import echorama

FILE = Path(os.environ["ECHORAMA_SOURCE_DIR"]) / ".." / "shared" / "data" / "kretz" / "sphere_phantom.vol"
if not FILE.exists():
    print(f"skipped: {FILE} is not there")
    sys.exit(77)


def expect(condition, what):
    if not condition:
        raise AssertionError(what)


def read(**properties):
    reader = echorama.vtkUltrasoundReader()
    reader.SetFileName(str(FILE))
    for name, value in properties.items():
        getattr(reader, "Set" + name)(value)
    reader.Update()
    return reader


def voxels(image, name="Intensity"):
    return vtk_to_numpy(image.GetPointData().GetArray(name)).reshape(image.GetDimensions()[::-1])


def smoothed(volume, sigma):
    reach = int(4 * sigma)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2)
    for axis in range(3):
        volume = np.apply_along_axis(np.convolve, axis, volume, kernel / kernel.sum(), "same")
    return volume


def trilinear(volume, points):
    """Values at points (x, y, z in voxels), those outside taken from the edge."""
    last = np.array(volume.shape[::-1]) - 1
    points = np.clip(points, 0, last - 1e-6)
    at = points.astype(int)
    t = points - at
    value = 0.0
    for corner in np.ndindex(2, 2, 2):
        weight = np.prod(np.where(corner, t, 1 - t), axis=-1)
        x, y, z = np.moveaxis(at + corner, -1, 0)
        value = value + weight * volume[z, y, x]
    return value


def sphere_axes(volume, spacing, centre):
    """Half axes along x, y, z of the bright shell around centre (mm from the first voxel), and the radius of the sphere.

    The echo saturates, so it has no highest point: its middle counts, where it is above half its peak along a ray from the
    centre. Rays go towards the probe and a little beyond the equator; what lies below is in the shadow."""
    radii = np.arange(4.0, 10.0, 0.1)
    count = np.arange(4000) + 0.5
    up = -1 + 2 * count / 4000
    turn = count * 2.399963
    directions = np.c_[np.sqrt(1 - up**2) * np.cos(turn), np.sqrt(1 - up**2) * np.sin(turn), up][up < 0.1]
    low = np.maximum(np.floor((centre - 11) / spacing).astype(int), 0)
    high = np.ceil((centre + 11) / spacing).astype(int)
    part = smoothed(volume[low[2]:high[2], low[1]:high[1], low[0]:high[0]].astype(float), 1.5)
    for _ in range(8):
        rays = centre + directions[:, None, :] * radii[:, None]
        values = trilinear(part, rays / spacing - low)
        peak, place = values.max(1), values.argmax(1)
        weight = np.clip(values - 0.5 * peak[:, None], 0, None)
        there = (place > 0) & (place < len(radii) - 1) & (peak > 50)
        points = (centre + directions * ((weight * radii).sum(1) / weight.sum(1).clip(1e-9))[:, None])[there]
        kept = np.ones(len(points), bool)
        for _ in range(15):
            system = np.c_[2 * points, np.ones(len(points))]
            solution = np.linalg.lstsq(system[kept], (points[kept] ** 2).sum(1), rcond=None)[0]
            centre = solution[:3]
            radius = np.sqrt(solution[3] + centre @ centre)
            off = np.abs(np.linalg.norm(points - centre, axis=1) - radius)
            kept = off < max(0.4, 2 * np.median(off[kept]))
    shell = points[kept] - centre
    solution = np.linalg.lstsq(np.c_[shell**2, shell], np.ones(len(shell)), rcond=None)[0]
    middle = -solution[3:] / (2 * solution[:3])
    axes = np.sqrt((1 + (solution[:3] * middle**2).sum()) / solution[:3])
    return axes, radius, len(shell) / len(directions)


def test_the_volume():
    reader = read()
    image = reader.GetOutput()
    expect(reader.GetNotes() == "", reader.GetNotes())
    fields = image.GetFieldData()
    geometry = fields.GetArray("ProbeGeometry").GetTuple(0)
    expect(np.allclose(geometry, [34.0685, 6.1542, 39.7530, 7.1810, 14.322, 57.4728, 0.402174], atol=1e-4), f"{geometry}")
    expect(fields.GetArray("ProbeToWorld"), "ProbeToWorld")
    expect(fields.GetAbstractArray("TransducerType").GetValue(0).startswith("RIC6-12-D"), "the probe's name")
    everything = " ".join(fields.GetArrayName(i) for i in range(fields.GetNumberOfArrays()))
    expect("Patient" not in everything and "Institution" not in everything, everything)
    valid = voxels(image, "ValidRegion")
    expect(set(np.unique(valid)) == {0, 1}, "ValidRegion")
    expect(2e6 < valid.sum() < 5e6, f"{valid.sum()} voxels are real; there are 3.9 million samples")
    expect(voxels(image)[valid == 0].max() == 0, "echoes outside")


def test_spheres_are_round():
    image = read(SpacingMm=0.25).GetOutput()
    centre = np.array([17.7, 14.5, 40.5])
    axes, radius, part = sphere_axes(voxels(image), 0.25, centre)
    spread = axes.max() / axes.min() - 1
    print(f"half axes {axes.round(2)} mm, radius {radius:.2f} mm, spread {100 * spread:.1f}%, {100 * part:.0f}% of the rays")
    expect(part > 0.5, "the shell was not found")
    expect(spread < 0.05, f"half axes {axes}")


def test_a_wrong_sweep_would_show():
    # The same beams with a sweep that is an eighth wider: the measure above must notice.
    image = read(SpacingMm=0.25).GetOutput()
    volume = voxels(image)
    stretched = volume[:, np.round(np.arange(0, volume.shape[1], 1 / 1.125)).astype(int).clip(0, volume.shape[1] - 1), :]
    axes, _, _ = sphere_axes(stretched, 0.25, np.array([17.7, 14.5 * 1.125, 40.5]))
    expect(axes.max() / axes.min() - 1 > 0.05, f"half axes {axes}")


def test_beams_are_the_second_output():
    reader = echorama.vtkUltrasoundReader()
    reader.SetFileName(str(FILE))
    reader.Update(1)
    expect(reader.GetOutput(0).GetNumberOfPoints() == 0, "the volume was made though only the beams were asked for")
    beams = reader.GetOutput(1)
    expect(beams.GetDimensions() == (468, 116, 72), f"{beams.GetDimensions()}")
    data = FILE.read_bytes()
    start = data.index(b"\x00\xd0\x01\x00" + (468 * 116 * 72).to_bytes(4, "little")) + 8
    there = np.frombuffer(data, np.uint8, 468 * 116 * 72, start).reshape(72, 116, 468)
    expect((voxels(beams) == there[::-1]).all(), "samples are the file's, the planes in reverse")

    # Converted by the filter they are the first output.
    converter = echorama.vtkUltrasoundScanConverter()
    converter.SetInputConnection(reader.GetOutputPort(1))
    converter.Update()
    expect(reader.GetOutput(0).GetNumberOfPoints() == 0, "the volume was made though only the beams were asked for")
    reader.Update(0)
    volume, converted = reader.GetOutput(0), converter.GetOutput()
    expect(volume.GetOrigin() == converted.GetOrigin() and volume.GetSpacing() == converted.GetSpacing(), "geometry")
    expect((voxels(volume) == voxels(converted)).all(), "voxels")
    expect((voxels(volume, "ValidRegion") == voxels(converted, "ValidRegion")).all(), "ValidRegion")
    expect(reader.GetOutput(1).GetNumberOfPoints() == 468 * 116 * 72, "the beams are kept")

    only = read()
    expect(only.GetOutput(1).GetNumberOfPoints() == 0, "the beams were read though only the volume was asked for")
    only.SetFileName(str(FILE) + ".missing")
    only.GetExecutive().AddObserver("ErrorEvent", lambda *_: None)
    only.AddObserver("ErrorEvent", lambda *_: None)
    only.Update(1)
    expect(only.GetOutput(1).GetNumberOfPoints() == 0, "beams of a file that is not there")


for name, test in list(globals().items()):
    if name.startswith("test_"):
        test()
