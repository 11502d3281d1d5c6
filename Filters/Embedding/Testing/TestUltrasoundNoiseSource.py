# SPDX-License-Identifier: BSD-3-Clause
"""The wrapped noise source: its fan and grid, from properties or volumes; matching; the same result twice; errors."""
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData

from echorama.EchoramaCore import vtkUltrasoundAcquisition
from echorama.EchoramaFiltersEmbedding import vtkUltrasoundNoiseSource


def small(spacing=0.8):
    source = vtkUltrasoundNoiseSource()
    source.SetFanAngle(40)
    source.SetFanWidth(25)
    source.SetSweepAngle(30)
    source.SetSweepWidth(18)
    source.SetDepthMax(50)
    source.SetSpacingMm(spacing)
    source.SetDepthCorrelationMm(1.0)
    source.SetFanCorrelation(0.035)
    source.SetSweepCorrelation(0.05)
    return source


def made(source):
    source.Update()
    image = vtkImageData()
    image.DeepCopy(source.GetOutput())
    return image


def array(image, name):
    return vtk_to_numpy(image.GetPointData().GetArray(name)).reshape(image.GetDimensions()[::-1])


def errors_of(source):
    messages = []

    def note(caller, event, text):
        messages.append(text)

    note.CallDataType = "string0"
    source.AddObserver(vtkCommand.ErrorEvent, note)
    source.GetExecutive().AddObserver(vtkCommand.ErrorEvent, note)
    source.Update()
    return " ".join(messages)


# By itself: log-compressed greys of the mean that was asked for, inside the fan alone; acquisition as field data.
source = small()
image = made(source)
intensity, valid = array(image, "Intensity"), array(image, "ValidRegion")
assert intensity.dtype == np.uint8 and valid.dtype == np.uint8 and set(np.unique(valid)) == {0, 1}
assert (intensity[valid == 0] == 0).all()
grey = intensity[valid == 1].astype(float)
assert abs(grey.mean() - 40) < 1.5 and 10 < grey.std() < 24, (grey.mean(), grey.std())
assert source.GetMadeCounts()[0] == 151 and source.GetMadeCorrelation() == (1.0, 0.035, 0.05)
geometry = vtk_to_numpy(image.GetFieldData().GetArray(vtkUltrasoundAcquisition.ProbeGeometryName())).ravel()
assert np.allclose(geometry, [40, 25, 30, 18, 0, 50]), geometry
assert image.GetFieldData().GetArray(vtkUltrasoundAcquisition.SeedName()).GetValue(0) == 1

# The same seed, the same noise; another seed, other noise; turned, the same noise elsewhere.
assert (array(made(small()), "Intensity") == intensity).all()
other = small()
other.SetSeed(2)
assert (array(made(other), "Intensity") != intensity).mean() > 0.3
turned = small()
turned.SetPosition(10, 20, 30)
turned.SetOrientation(0, 90, 0)
image2 = made(turned)
assert (np.abs(array(image2, "Intensity").astype(int) - intensity) <= 1).all()
assert np.allclose([image2.GetDirectionMatrix().GetElement(i, 2) for i in range(3)], [1, 0, 0], atol=1e-12)

# Floats are neither rounded nor cut; Rayleigh has its quotient of mean and deviation.
rayleigh = small()
rayleigh.FloatOutputOn()
rayleigh.SetIntensityModel(vtkUltrasoundNoiseSource.RAYLEIGH)
rayleigh.SetMean(200)
values = array(made(rayleigh), "Intensity")[valid == 1]
assert values.dtype == np.float32 and values.max() > 255 and 1.85 < values.mean() / values.std() < 2.25

# A volume gives the fan, and the grid if wanted; one to match gives grain and intensities.
same = vtkUltrasoundNoiseSource()
same.SetInputData(image2)
same.SetMatchData(image)
same.OnInputGridOn()
same.SetSeed(7)
like = made(same)
assert like.GetDimensions() == image2.GetDimensions() and like.GetOrigin() == image2.GetOrigin()
assert (array(like, "ValidRegion") == array(image2, "ValidRegion")).all()
for got, wanted in zip(same.GetMadeCorrelation(), (1.0, 0.035, 0.05)):
    assert abs(got - wanted) < 0.15 * wanted, same.GetMadeCorrelation()
assert same.GetMatchResolved() == (1, 1, 1)
grey2 = array(like, "Intensity")[valid == 1].astype(float)
assert abs(grey2.mean() - grey.mean()) < 2 and abs(grey2.std() - grey.std()) < 2.5, (grey2.mean(), grey2.std())

# Without field data the fan is fitted to the valid region.
bare = vtkImageData()
bare.DeepCopy(image)
bare.GetFieldData().Initialize()
fitted = vtkUltrasoundNoiseSource()
fitted.SetInputData(bare)
fitted.SetSpacingMm(1.0)
fan = vtk_to_numpy(made(fitted).GetFieldData().GetArray("ProbeGeometry")).ravel()
assert np.allclose(fan[:6], [40, 25, 30, 18, 0, 50], atol=1.5), fan

# What it is compared with: the same fan, other noise.
for kind in (vtkUltrasoundNoiseSource.WHITE, vtkUltrasoundNoiseSource.PERLIN):
    lattice = small()
    lattice.SetKind(kind)
    image3 = made(lattice)
    assert (array(image3, "ValidRegion") == valid).all()
    grey3 = array(image3, "Intensity")[valid == 1].astype(float)
    assert 35 < grey3.mean() < 45 and 15 < grey3.std() < 24, (grey3.mean(), grey3.std())

# A single plane is an image.
plane = small()
plane.SetSweepAngle(0)
plane.SetSweepWidth(0)
assert made(plane).GetDimensions()[2] == 1 and plane.GetMadeCounts()[2] == 1

# What cannot be done is said, and nothing comes out.
for change, words in (
    (lambda s: s.SetDepthMax(-1), "depth"),
    (lambda s: s.SetDepthCorrelationMm(30), "DepthCorrelationMm"),
    (lambda s: s.SetMean(0), "Mean"),
    (lambda s: s.SetSpacingMm(0), "SpacingMm"),
    (lambda s: s.SetOctaves(11), "Octaves"),
    (lambda s: s.SetMaximumVoxels(1000), "voxels"),
    (lambda s: s.OnInputGridOn(), "OnInputGrid"),
):
    bad = small()
    change(bad)
    text = errors_of(bad)
    assert words in text, (words, text)
    assert bad.GetOutput().GetNumberOfPoints() == 0
constant = vtkImageData()
constant.DeepCopy(image)
vtk_to_numpy(constant.GetPointData().GetArray("Intensity"))[:] = 50
bad = small()
bad.SetMatchData(constant)
text = errors_of(bad)
assert "too little texture" in text, text
assert "DepthCorrelationMm: 1\n" in str(source)
