#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""vtkUltrasoundOpenIGTLinkSender: what a client reads, byte by byte, and what is refused. (Arrays and pose: TestDataContract.py.)"""
import socket
import struct

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonCore import vtkCommand
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkCommonMath import vtkMatrix4x4
import echorama


def volume(dtype=np.int16):
    image = vtkImageData()
    image.SetDimensions(5, 4, 3)
    image.SetSpacing(0.5, 0.75, 2.0)
    image.SetOrigin(10, -20, 30)
    image.SetDirectionMatrix(0, -1, 0, 1, 0, 0, 0, 0, 1)
    array = numpy_to_vtk(np.arange(60).astype(dtype), deep=1)
    array.SetName("Intensity")
    image.GetPointData().SetScalars(array)
    return image


def errors_of(filter, call):
    errors = []
    tag = filter.AddObserver(vtkCommand.ErrorEvent, lambda *_: errors.append(1))
    result = call()
    filter.RemoveObserver(tag)
    return len(errors), result


class Client:
    """As small as an OpenIGTLink client can be."""

    def __init__(self, port):
        self.socket = socket.create_connection(("127.0.0.1", port), 10)
        self.socket.settimeout(10)

    def read(self, size):
        data = b""
        while len(data) < size:
            piece = self.socket.recv(size - len(data))
            assert piece, "the connection has ended"
            data += piece
        return data

    def message(self):
        """Type, name, time and body."""
        version, kind, name, seconds, fraction, size, _ = struct.unpack(">H12s20sIIQQ", self.read(58))
        assert version == 1
        return kind.rstrip(b"\0").decode(), name.rstrip(b"\0").decode(), seconds + fraction / 2**32, self.read(size)


def image_of(body):
    """Size, type, axes as a matrix of steps, the middle, and the voxels."""
    version, components, kind, endian, axes, *size = struct.unpack(">HBBBBHHH", body[:12])
    assert (version, components, endian, axes) == (1, 1, 2, 1)
    numbers = np.array(struct.unpack(">12f", body[12:60])).reshape(4, 3)
    assert struct.unpack(">6H", body[60:72]) == (0, 0, 0, *size)
    return size, kind, numbers[:3].T, numbers[3], body[72:]


# 1. A client that is there gets the volume, in R, A, S about its middle; one that comes later gets it too.
sender = echorama.vtkUltrasoundOpenIGTLinkSender()
assert (sender.GetHost(), sender.GetPort(), sender.GetDeviceName(), sender.GetKeepCoordinates(), sender.GetWaitSeconds()) == (
    "127.0.0.1", 18944, "Volume", 0, 0.0)
assert sender.GetListeningPort() == 0
sender.SetPort(0)
sender.SetDeviceName("Stitched")
sender.SetWaitSeconds(10)
assert sender.Start()
port = sender.GetListeningPort()
assert port > 0
early = Client(port)
image = volume()
sender.SetInputData(image)
sender.Update()
assert sender.GetNumberOfClients() == 1 and sender.GetNumberOfSentMessages() == 1 and sender.GetNumberOfDroppedMessages() == 0
late = Client(port)
middle = np.array(image.GetPoint(0)) + (np.array(image.GetPoint(59)) - image.GetPoint(0)) / 2
turn = np.diag([-1, -1, 1])
for client in (early, late):
    kind, name, time, body = client.message()
    assert (kind, name) == ("IMAGE", "Stitched") and time > 1.6e9
    size, scalar, steps, centre, voxels = image_of(body)
    assert size == [5, 4, 3] and scalar == 4
    assert np.allclose(steps, turn @ np.array([[0, -0.75, 0], [0.5, 0, 0], [0, 0, 2.0]]))
    assert np.allclose(centre, turn @ middle)
    assert np.array_equal(np.frombuffer(voxels, "<i2"), np.arange(60))

# 2. Transforms go to all, turned as the volume is.
matrix = vtkMatrix4x4()
for i, value in enumerate([0, -1, 0, 5, 1, 0, 0, 6, 0, 0, 1, 7]):
    matrix.SetElement(i // 4, i % 4, value)
assert sender.SendTransform("VolumeToReference", matrix)
for client in (early, late):
    kind, name, time, body = client.message()
    assert (kind, name) == ("TRANSFORM", "VolumeToReference")
    assert np.allclose(np.array(struct.unpack(">12f", body)).reshape(4, 3).T, [[0, -1, 0, -5], [1, 0, 0, -6], [0, 0, 1, 7]])
c, s = np.cos(0.4), np.sin(0.4)
about_x = np.array([[1, 0, 0, 5], [0, c, -s, 6], [0, s, c, 7]])
for i, value in enumerate(about_x.ravel()):
    matrix.SetElement(i // 4, i % 4, float(value))
assert sender.SendTransform("VolumeToReference", matrix)
for client in (early, late):
    sent = np.array(struct.unpack(">12f", client.message()[3])).reshape(4, 3).T
    assert np.allclose(sent, turn @ about_x @ np.diag([-1, -1, 1, 1]), atol=1e-6)
assert sender.Flush(10)

# 3. As they are.
sender.SetKeepCoordinates(1)
assert sender.Start()
client = Client(sender.GetListeningPort())
sender.Update()
_, _, _, body = client.message()
_, _, steps, centre, _ = image_of(body)
assert np.allclose(steps, np.array([[0, -0.75, 0], [0.5, 0, 0], [0, 0, 2.0]])) and np.allclose(centre, middle)
assert sender.SendTransform("VolumeToReference", matrix)
assert np.allclose(np.array(struct.unpack(">12f", client.message()[3])).reshape(4, 3).T, about_x, atol=1e-6)

# 4. All types of voxels.
for dtype, kind in ((np.uint8, 3), (np.uint16, 5), (np.float32, 10), (np.float64, 11)):
    sender.SetInputData(volume(dtype))
    sender.Update()
    _, scalar, _, _, voxels = image_of(client.message()[3])
    assert scalar == kind and np.array_equal(np.frombuffer(voxels, dtype), np.arange(60))

# 5. What is refused.
sender.SetDeviceName("a name of more than twenty bytes")
count, _ = errors_of(sender, sender.Update)
assert count and sender.GetOutput().GetNumberOfPoints() == 0
sender.SetDeviceName("")
assert errors_of(sender, sender.Update)[0]
sender.SetDeviceName("Volume")
assert errors_of(sender, lambda: sender.SendTransform("AVeryLongNameToAnotherFrame", matrix)) == (1, False)
assert errors_of(sender, lambda: sender.SendTransform("", matrix)) == (1, False)
matrix.SetElement(0, 0, float("nan"))
assert errors_of(sender, lambda: sender.SendTransform("VolumeToReference", matrix)) == (1, False)
taken = echorama.vtkUltrasoundOpenIGTLinkSender()
taken.SetPort(sender.GetListeningPort())
assert errors_of(taken, taken.Start) == (1, False)
taken.SetInputData(volume())
assert errors_of(taken, taken.Update)[0] and taken.GetOutput().GetNumberOfPoints() == 0

# 6. Stopped, the connection is closed, and the port is free.
sender.Stop()
assert sender.GetListeningPort() == 0 and client.socket.recv(1) == b""
assert taken.Start()
print("the volume arrives where it lies")
