#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundProbeFit: finds the probe of phantoms (known) and of real data; what it says, keeps and refuses."""
import os
import zlib

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData

import echorama

acquisition = echorama.vtkUltrasoundAcquisition
data = os.path.join(os.environ["ECHORAMA_SOURCE_DIR"], "..", "shared", "data")
skipped = []


def image_of(intensity, valid=None, spacing=(1, 1, 1), origin=(0, 0, 0)):
    """A volume of arrays [z, y, x] or [y, x]."""
    intensity = np.atleast_3d(intensity.T).T
    image = vtkImageData()
    image.SetDimensions(intensity.shape[::-1])
    image.SetSpacing(spacing)
    image.SetOrigin(origin)
    arrays = {"Intensity": intensity} if valid is None else {"Intensity": intensity, "ValidRegion": valid}
    for name, values in arrays.items():
        array = numpy_to_vtk(np.ascontiguousarray(values.ravel()), deep=1)
        array.SetName(name)
        image.GetPointData().AddArray(array)
    return image


def fit(image, **properties):
    """(filter, its errors)"""
    filter = echorama.vtkUltrasoundProbeFit()
    filter.SetInputData(image)
    for name, value in properties.items():
        getattr(filter, "Set" + name)(value)
    errors = []

    def note(caller, event, text):
        errors.append(text)

    note.CallDataType = "string0"
    filter.AddObserver(vtkCommand.ErrorEvent, note)
    filter.GetExecutive().AddObserver(vtkCommand.ErrorEvent, lambda *_: None) # it would print that the filter failed
    filter.Update()
    return filter, errors


def fields(image):
    probe = vtk_to_numpy(image.GetFieldData().GetArray(acquisition.ProbeGeometryName())).ravel()
    pose = vtk_to_numpy(image.GetFieldData().GetArray(acquisition.ProbeToWorldName())).reshape(4, 4)
    return probe, pose


def mha(name):
    """Header and voxels of a MetaImage of bytes, or None where the data is not there."""
    path = os.path.join(data, name)
    if not os.path.exists(path):
        skipped.append(name)
        return None
    with open(path, "rb") as file:
        header = {}
        while "ElementDataFile" not in header:
            key, _, value = file.readline().decode("latin-1").partition("=")
            header[key.strip()] = value.strip()
        rest = file.read()
    size = [int(n) for n in header["DimSize"].split()]
    rest = zlib.decompress(rest) if header.get("CompressedData") == "True" else rest
    return header, np.frombuffer(rest, np.uint8)[: np.prod(size)].reshape(size[::-1])


def check_phantoms():
    """The phantoms know their probe."""
    if not hasattr(echorama, "vtkUltrasoundPhantomSource"):
        skipped.append("phantoms (the room Filters/Phantoms is not built)")
        return
    for place in (dict(), dict(Position=(20, -30, 40), Orientation=(30, -50, 70)), dict(FanAngle=80, FanRadius=12, SweepRadius=50)):
        source = echorama.vtkUltrasoundPhantomSource()
        source.SetSpacingMm(1.5)
        for name, value in place.items():
            getattr(source, "Set" + name)(value)
        source.Update()
        phantom = source.GetOutput()
        truth, pose = fields(phantom)
        filter, errors = fit(phantom)
        assert not errors, errors
        found, found_pose = fields(filter.GetOutput())
        assert abs(found[0] - truth[0]) < 0.5 and abs(found[2] - truth[2]) < 0.5, (found, truth)
        # Depth 0 is the near edge: the first sample of the truth.
        fan, sweep = np.radians(truth[0]), np.radians(truth[2])
        assert abs(found[1] - (truth[1] + fan * truth[4])) < 1.5, (found, truth)
        assert abs(found[3] - (truth[3] + sweep * truth[4])) < 1.5, (found, truth)
        assert found[4] == 0 and abs(found[5] - (truth[5] - truth[4])) < 1.0, (found, truth)
        near = pose @ [0, 0, truth[4], 1]
        assert np.linalg.norm(found_pose[:3, 3] - near[:3]) < 1.0, (found_pose, near)
        assert found_pose[:3, 2] @ pose[:3, 2] > 0.9999
        assert filter.GetOverlap() > 0.98 and filter.GetResidualMm() < 1.5 and filter.GetMeanDistance() < 0.01
        assert "had a probe geometry" in filter.GetNotes() and "Depth 0" in filter.GetNotes()


def check_output(probe_less):
    """All but the two fields is shared or kept; the input is as it was."""
    remark = numpy_to_vtk(np.arange(3.0))
    remark.SetName("Remark")
    probe_less.GetFieldData().AddArray(remark)
    filter, errors = fit(probe_less)
    output = filter.GetOutput()
    assert not errors and "had a probe geometry" not in filter.GetNotes()
    for i in range(probe_less.GetPointData().GetNumberOfArrays()):
        assert output.GetPointData().GetAbstractArray(i) is probe_less.GetPointData().GetAbstractArray(i)
    assert output.GetFieldData().GetArray("Remark") is not None
    assert probe_less.GetFieldData().GetNumberOfArrays() == 1
    assert "OutlinePoints: 4000" in str(filter) and f"Overlap: {filter.GetOverlap():.5g}"[:12] in str(filter)


def check_refusals():
    z, y, x = np.mgrid[:40, :40, :40] - 20.0
    grey = np.full(x.shape, 7, np.uint8)
    ball = ((x**2 + y**2 + z**2) < 15**2).astype(np.uint8)
    filter, errors = fit(image_of(grey, ball))
    assert len(errors) == 1 and "no fan explains the valid region" in errors[0], errors
    assert filter.GetOutput().GetNumberOfPoints() == 0 and filter.GetOverlap() == 0 and filter.GetNotes() == ""
    filter, errors = fit(image_of(grey, ball), MinimumOverlap=0, MaximumDistance=10)
    assert not errors and 0 < filter.GetOverlap() < 0.85
    filter, errors = fit(image_of(grey, np.zeros_like(ball)))
    assert len(errors) == 1 and "empty" in errors[0], errors
    for name, wrong in (("MinimumOverlap", 7), ("MaximumDistance", -1), ("OutlinePoints", 3), ("MarginMm", -2)):
        filter, errors = fit(image_of(grey, ball), **{name: wrong})
        assert len(errors) == 1 and f"{name} is {wrong}" in errors[0], errors


def check_region():
    """Without a valid region all that is finite is valid."""
    grey = np.full((30, 40, 50), 7, np.float32)
    filter, errors = fit(image_of(grey, spacing=(0.5, 0.5, 0.5)))
    assert not errors and "has no valid region" in filter.GetNotes() and "Every voxel is valid" in filter.GetNotes()
    probe, pose = fields(filter.GetOutput())
    assert np.allclose(probe, [0, 25, 0, 20, 0, 15], atol=0.1), probe
    grey[:, :, 30:] = np.nan
    filter, errors = fit(image_of(grey, spacing=(0.5, 0.5, 0.5)))
    probe, pose = fields(filter.GetOutput())
    assert not errors and np.allclose(probe, [0, 15, 0, 20, 0, 15], atol=0.3), probe


def edge_angle(valid):
    """Between the straight sides of a sector that looks down, by the medians of the slopes between rows far apart."""
    rows = np.arange(valid.shape[0] // 6, valid.shape[0] * 3 // 4)
    left, right = valid[rows].argmax(1), valid.shape[1] - 1 - valid[rows, ::-1].argmax(1)
    half = len(rows) // 2
    slopes = [np.median((edge[half:2 * half] - edge[:half]) / half) for edge in (left, right)]
    return np.degrees(np.arctan(slopes[1]) - np.arctan(slopes[0]))


def check_liver_frames():
    """The sector of the frames, beside the angle between its sides."""
    read = mha("liver/liver_sweep.igs.mha")
    if not read:
        return
    frames = read[1]
    for valid in (frames[70] > 0, (frames > 0).mean(0) > 0.5, (frames > 0).any(0)):
        filter, errors = fit(image_of(frames[70], valid.astype(np.uint8), spacing=(0.315, 0.315, 1)))
        assert not errors, errors
        probe, pose = fields(filter.GetOutput())
        assert abs(probe[0] - edge_angle(frames[70, :, :-1] > 0)) < 0.6 and abs(probe[5] - 181.5) < 2.0 and probe[2] == probe[3] == 0, probe
        assert abs(probe[1] - 54.0) < 1.6, probe
        assert pose[1, 2] > 0.9999 and pose[0, 0] > 0.9999 # away from the probe is down
        assert filter.GetOverlap() > 0.93


def check_plus_frames():
    read = mha("plus/UltrasonixCurvilinearScanConvertedData.igs.mha")
    if read:
        valid = (read[1] > 0).any(0).astype(np.uint8)
        filter, errors = fit(image_of(valid, valid))
        probe, pose = fields(filter.GetOutput())
        assert not errors and abs(probe[0] - 150) < 0.3 and filter.GetOverlap() > 0.99 and filter.GetResidualMm() < 0.5, probe
    read = mha("plus/SpinePhantomFreehand.igs.mha")
    if read:
        valid = (read[1] > 0).any(0).astype(np.uint8)
        filter, errors = fit(image_of(valid, valid))
        probe, pose = fields(filter.GetOutput())
        rows, columns = np.where(valid)
        assert not errors and abs(probe[1] - 445) < 1 and abs(probe[5] - 590) < 1 and probe[0] < 0.01, probe
        assert pose[1, 2] > 0.999 and "another axis" in filter.GetNotes()
    read = mha("plus/NwirePhantomFreehand.igs.mha")
    if read: # mostly black: the pixels that are not are no sector
        valid = (read[1] > 0).any(0).astype(np.uint8)
        filter, errors = fit(image_of(valid, valid))
        assert errors and "no fan explains" in errors[0]


def check_kretz():
    """A file that knows its probe, as voxels: the same probe is found."""
    path = os.path.join(data, "kretz", "sphere_phantom.vol")
    if not os.path.exists(path) or not hasattr(echorama, "vtkUltrasoundReader"):
        skipped.append("kretz/sphere_phantom.vol")
        return
    reader = echorama.vtkUltrasoundReader()
    reader.SetFileName(path)
    reader.Update()
    volume = reader.GetOutput()
    truth, pose = fields(volume)
    filter, errors = fit(volume)
    assert not errors, errors
    found, found_pose = fields(filter.GetOutput())
    print("Kretz: file", np.round(truth, 2), "found", np.round(found, 2), f"overlap {filter.GetOverlap():.3f}, residual {filter.GetResidualMm():.3f} mm")
    assert np.all(abs(found[[0, 2]] - truth[[0, 2]]) < 0.5), (found, truth)
    assert len(truth) == len(found) == 7 and abs(abs(found[6]) - truth[6]) < 0.03 # the fan is not centred on the array
    # Depth 0 is the near edge: the first sample of the truth.
    near = [truth[1] + np.radians(truth[0]) * truth[4], truth[3] + np.radians(truth[2]) * truth[4]]
    assert np.allclose(found[[1, 3]], near, atol=0.5) and abs(found[5] - (truth[5] - truth[4])) < 0.5, (found, truth)
    assert np.linalg.norm(found_pose[:3, 3] - (pose @ [0, 0, truth[4], 1])[:3]) < 0.5 and found_pose[:3, 2] @ pose[:3, 2] > 0.9999


def check_liver_volumes():
    """A freehand sweep is nearly a fan, tilted against its sweep. Its frames have a fan of 60.5 degrees, 54 mm, 181 mm long."""
    for name in "A", "B", "full":
        read = mha(f"liver/liver_volume_{name}.mha")
        if not read:
            continue
        voxels = read[1]
        filter, errors = fit(image_of(voxels, (voxels > 0).astype(np.uint8), (0.8, 0.8, 0.8), [float(n) for n in read[0]["Offset"].split()]))
        assert not errors, errors
        probe, pose = fields(filter.GetOutput())
        assert abs(probe[0] - 60.5) < 1.5 and abs(probe[1] - 54) < 3 and abs(probe[5] - 181) < 2, probe
        assert "not centred" in filter.GetNotes() # the probe was turned about a line that is not parallel to its array
        assert filter.GetOverlap() > 0.93 and filter.GetResidualMm() < 3
        print(f"liver {name}: fan {probe[0]:.1f}, sweep {probe[2]:.1f} degrees, overlap {filter.GetOverlap():.3f}, "
              f"residual {filter.GetResidualMm():.2f} mm")


def outside(image, valid):
    """How many real voxels the fan of a volume leaves out: scan conversion of beams of ones onto the same places."""
    probe, pose = fields(image)
    fan, sweep = np.radians(probe[0]), np.radians(probe[2])
    k, j, i = np.nonzero(valid)
    world = np.array(image.GetOrigin()) + np.stack([i, j, k], 1) * image.GetSpacing()
    x, y, z = np.linalg.inv(pose)[:3, :3] @ world.T + np.linalg.inv(pose)[:3, 3:]

    def place(angle, width, across, outward):
        if angle < 1e-9:
            return across / max(width, 1e-9), outward
        radius = width / angle
        return np.arctan2(across, radius + outward) / angle, np.hypot(across, radius + outward) - radius

    along_sweep, rho = place(sweep, probe[3], y, z)
    along_fan, depth = place(fan, probe[1], x, rho)
    along_fan -= probe[6] if len(probe) > 6 else 0
    off = 1e-6
    return np.sum((abs(along_sweep) > 0.5 + off) | (abs(along_fan) > 0.5 + off) | (depth < probe[4] - off) | (depth > probe[5] + off))


def check_enclosing():
    """Two wedges that are no fan together; a margin; a probe that is there is kept where it holds all."""
    z, y, x = np.mgrid[:40, :50, :60].astype(float)
    two = ((np.abs(x - 15 - 0.3 * z) < 6 + 0.2 * z) | (np.abs(x - 45 + 0.2 * z) < 6 + 0.2 * z)) & (np.abs(y - 25) < 8 + 0.3 * z)
    image = image_of(np.ones(two.shape, np.uint8), two.astype(np.uint8))
    filter, errors = fit(image, EncloseRegion=True)
    assert not errors and outside(filter.GetOutput(), two) == 0, errors
    assert 0.6 < filter.GetOverlap() < 0.95 and "encloses the whole region" in filter.GetNotes(), filter.GetOverlap()
    wider, errors = fit(image, EncloseRegion=True, MarginMm=5)
    assert not errors and wider.GetOverlap() < filter.GetOverlap() - 0.1
    again, errors = fit(filter.GetOutput(), EncloseRegion=True)
    assert not errors and "that, or larger" in again.GetNotes()
    assert all(np.array_equal(a, b) for a, b in zip(fields(again.GetOutput()), fields(filter.GetOutput())))
    alone = np.zeros((9, 9, 9), np.uint8)
    alone[3, 4, 5] = 1
    filter, errors = fit(image_of(alone, alone), EncloseRegion=True)
    assert not errors and outside(filter.GetOutput(), alone) == 0
    filter, errors = fit(image_of(alone, 0 * alone), EncloseRegion=True)
    assert len(errors) == 1 and "empty" in errors[0], errors
    assert "EncloseRegion" in str(filter) and "MarginMm: 0" in str(filter)


def check_enclosing_liver():
    """Both halves of a freehand sweep together: no fan at all, but one holds them."""
    parts = [mha(f"liver/liver_volume_{name}.mha") for name in "AB"]
    if not all(parts):
        return
    low = np.min([[float(n) for n in header["Offset"].split()] for header, _ in parts], 0)
    places = [np.round((np.array([float(n) for n in header["Offset"].split()]) - low) / 0.8).astype(int)[::-1] for header, _ in parts]
    valid = np.zeros(np.max([place + voxels.shape for place, (_, voxels) in zip(places, parts)], 0), np.uint8)
    for place, (_, voxels) in zip(places, parts):
        valid[tuple(slice(a, a + n) for a, n in zip(place, voxels.shape))] |= voxels > 0
    filter, errors = fit(image_of(valid, valid, (0.8, 0.8, 0.8), low), EncloseRegion=True)
    assert not errors and outside(filter.GetOutput(), valid) == 0, errors
    print(f"liver A and B: the enclosing fan is {1 / filter.GetOverlap():.2f} times as large;", np.round(fields(filter.GetOutput())[0], 1))
    assert filter.GetOverlap() > 0.55


z, y, x = np.mgrid[:30, :60, :50]
wedge = (np.abs(x - 25) < 5 + 0.3 * y).astype(np.uint8)
check_output(image_of(wedge, wedge))
check_refusals()
check_region()
check_enclosing()
check_phantoms()
check_liver_frames()
check_plus_frames()
check_kretz()
check_liver_volumes()
check_enclosing_liver()
if skipped:
    print("left out, not there:", ", ".join(skipped))
