# SPDX-License-Identifier: BSD-3-Clause
"""Tracked frames for tests: made from numbers, or read from the sequences beside the project; and a source of them over time."""
import os
import pathlib
import zlib

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.util.vtkAlgorithm import VTKPythonAlgorithmBase
from vtkmodules.vtkCommonCore import vtkDoubleArray
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline as Pipeline

data = pathlib.Path(os.environ["ECHORAMA_SOURCE_DIR"]) / "../shared/data"


def frame(pixels, pose=None, valid=None):
    """A tracked frame: pixels[y, x]; pose 4 x 4 from pixels to the world, None when there is none."""
    image = vtkImageData()
    fill(image, pixels, pose, valid)
    return image


def fill(image, pixels, pose=None, valid=None):
    image.Initialize()
    image.SetDimensions(pixels.shape[1], pixels.shape[0], 1)
    for name, values in (("Intensity", pixels), ("ValidRegion", np.ones(pixels.shape, np.uint8) if valid is None else valid)):
        array = numpy_to_vtk(np.ascontiguousarray(values).ravel(), deep=True)
        array.SetName(name)
        image.GetPointData().AddArray(array)
    image.GetPointData().SetActiveScalars("Intensity")
    if pose is not None:
        array = vtkDoubleArray()
        array.SetName("ImageToWorld")
        array.SetNumberOfComponents(16)
        array.InsertNextTuple(np.asarray(pose, float).ravel())
        image.GetFieldData().AddArray(array)


class Source(VTKPythonAlgorithmBase):
    """Frames over time steps."""

    def __init__(self, images, poses, times=None, valids=None):
        super().__init__(nInputPorts=0, nOutputPorts=1, outputType="vtkImageData")
        self.images, self.poses, self.valids = images, poses, valids
        self.times = list(range(len(images))) if times is None else list(times)
        self.made = []

    def RequestInformation(self, request, inputs, outputs):
        out = outputs.GetInformationObject(0)
        shape = self.images[0].shape
        out.Set(Pipeline.WHOLE_EXTENT(), (0, shape[1] - 1, 0, shape[0] - 1, 0, 0), 6)
        out.Set(Pipeline.TIME_STEPS(), [float(t) for t in self.times], len(self.times))
        out.Set(Pipeline.TIME_RANGE(), [float(min(self.times)), float(max(self.times))], 2)
        return 1

    def RequestData(self, request, inputs, outputs):
        out = outputs.GetInformationObject(0)
        time = out.Get(Pipeline.UPDATE_TIME_STEP()) if out.Has(Pipeline.UPDATE_TIME_STEP()) else min(self.times)
        number = int(np.argmin(np.abs(np.array(self.times) - time)))
        self.made.append(number)
        fill(vtkImageData.GetData(outputs), self.images[number], self.poses[number], None if self.valids is None else self.valids[number])
        vtkImageData.GetData(outputs).GetInformation().Set(vtkImageData.DATA_TIME_STEP(), float(time))
        return 1


def metaimage(path):
    """Header and array [z, y, x] of a MetaImage of bytes."""
    content = pathlib.Path(path).read_bytes()
    start = content.index(b"\n", content.index(b"ElementDataFile")) + 1
    header = dict(line.split(" = ", 1) for line in content[:start].decode("latin1").splitlines() if " = " in line)
    header = {name: value.strip() for name, value in header.items()}
    values = content[start:] if header["CompressedData"] == "False" else zlib.decompress(content[start:])
    size = [int(n) for n in header["DimSize"].split()]
    return header, np.frombuffer(values, np.uint8, count=int(np.prod(size))).reshape(size[::-1])


def transforms(header, name, count):
    """The matrices of a sequence, None where the status is not OK."""
    result = []
    for number in range(count):
        field = f"Seq_Frame{number:04}_{name}Transform"
        good = header.get(field + "Status", "OK") == "OK"
        result.append(np.array(header[field].split(), float).reshape(4, 4) if good else None)
    return result


def grid_of(header):
    """An empty image on the grid of a MetaImage."""
    image = vtkImageData()
    image.SetDimensions([int(n) for n in header["DimSize"].split()])
    image.SetOrigin([float(x) for x in header["Offset"].split()])
    image.SetSpacing([float(x) for x in header["ElementSpacing"].split()])
    return image


def array(image, name="Intensity"):
    return vtk_to_numpy(image.GetPointData().GetArray(name)).reshape(image.GetDimensions()[::-1])


def messages_of(filter, event="ErrorEvent"):
    """The list that will hold the error messages, or the warnings, of a filter and its pipeline."""
    messages = []

    def heard(caller, event, message=None):
        messages.append(message)
    heard.CallDataType = "string0"
    filter.AddObserver(event, heard)
    filter.GetExecutive().AddObserver(event, heard)
    return messages
