#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The ParaView pipeline gives the same volume on two MPI ranks (symmetric, each with its piece) as on one."""
import pathlib
import subprocess
import sys
import tempfile

import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLPImageDataReader

script = str(pathlib.Path(__file__).resolve().parent / "TestPipeline.py")
with tempfile.TemporaryDirectory() as folder:
    results = []
    for ranks in (1, 2):
        out = f"{folder}/{ranks}.pvti"
        start = ["mpirun", "-np", str(ranks), "pvbatch", script, out]
        run = subprocess.run(start, capture_output=True, text=True)
        print(run.stdout, run.stderr)
        if run.returncode == 77 or "skipped:" in run.stdout:
            sys.exit(77)
        assert run.returncode == 0, f"{ranks} rank(s): exit status {run.returncode}"
        reader = vtkXMLPImageDataReader()
        reader.SetFileName(out)
        reader.Update()
        whole = reader.GetOutput()
        results.append({name: vtk_to_numpy(whole.GetPointData().GetArray(name)).copy() for name in ("Intensity", "ValidRegion")})
        results[-1]["geometry"] = numpy.array([*whole.GetOrigin(), *whole.GetSpacing(), *whole.GetDimensions()])
one, two = results
for key in ("Intensity", "ValidRegion"):
    assert numpy.array_equal(one[key], two[key]), f"{key} differs between one rank and two"
assert numpy.allclose(one["geometry"], two["geometry"], rtol=5e-6, atol=1e-6), "the geometry differs between one rank and two"
print("one rank and two agree in every voxel, and in the geometry")
