#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The optical tracker as a line of the tracker source: what is wrong with a line or with what it names is said, and nothing comes."""
import pathlib
import tempfile

from vtkmodules.vtkCommonCore import vtkCommand

from echorama import vtkUltrasoundTrackerSource

assert "optical" in vtkUltrasoundTrackerSource.GetDeviceKinds().split(", "), vtkUltrasoundTrackerSource.GetDeviceKinds()


def refusal(device):
    source, errors = vtkUltrasoundTrackerSource(), []

    def said(_, event, text):
        errors.append(text)
    said.CallDataType = "string0"
    source.AddObserver(vtkCommand.ErrorEvent, said)
    source.SetDevice(device)
    assert not source.Start()
    source.Update()
    assert source.GetOutput().GetNumberOfPoints() == 0 and source.GetNumberOfTools() == 0
    assert errors, device
    return errors[0]


with tempfile.TemporaryDirectory() as folder:
    missing, damaged = pathlib.Path(folder) / "belly.json", pathlib.Path(folder) / "damaged.json"
    damaged.write_text('{"schema": "echorama-surface-1", "mesh": 3}')
    for device, words in ((f"optical:camera:0?shell={missing}", str(missing)),
                          (f"optical:simulated:?shell={damaged}", str(damaged)),
                          (f"optical:simulated:?shell={missing}&colour=red", "no option colour"),
                          (f"optical:recording:{folder}/film.igs.mhd?shell={damaged}", str(damaged)),
                          ("optical:camera:0", "which printed skin?"),
                          (f"fused:optical:camera:0?shell={missing}|simulated:", str(missing))):
        assert words in refusal(device), (device, refusal(device))
