#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What starts loads what it needs and no more: the program echorama, its commands, and the Python package."""
import importlib
import os
import pathlib
import pickle
import pydoc
import re
import subprocess
import sys
import tempfile
import unittest

import echorama
from program_under_test import PROGRAM, blobs, run, write_mha

# What takes long to load, by what it is for.
DRAWS = "vtkRendering|GL|X11"
READS = "gdcm|tiff|vtkIO"
HEAVY = "openvdb|OpenVdb|ceres|embree|OpenIGTLink|opencv|python|Qt"


def loaded_by(*command):
    """The names of all libraries that a command loads until it ends; it must succeed."""
    with tempfile.TemporaryDirectory() as folder:
        environment = {**os.environ, "LD_DEBUG": "files", "LD_DEBUG_OUTPUT": os.path.join(folder, "told")}
        done = subprocess.run([str(word) for word in command], env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True)
        assert done.returncode == 0, f"{command}: {done.stderr}"
        told = "".join(path.read_text(errors="replace") for path in pathlib.Path(folder).iterdir())
    return sorted({os.path.basename(path) for path in re.findall(r"calling init: (\S+)", told)})


def commands():
    return re.findall(r"^  ([a-z][a-z-]*) ", run("--help").stdout, re.MULTILINE)


class Program(unittest.TestCase):
    def assertLoadsNone(self, libraries, pattern):
        self.assertIn("libEchoramaCoreKernels.so.0", libraries)  # else nothing was looked at
        self.assertEqual([name for name in libraries if re.search(pattern, name)], [])

    def test_help_waits_for_nobody(self):
        for option in ("--help", "--version"):
            libraries = loaded_by(PROGRAM, option)
            self.assertLoadsNone(libraries, f"{DRAWS}|{READS}|{HEAVY}")
            self.assertEqual([name for name in libraries if "Echorama" in name], ["libEchoramaCoreKernels.so.0"])

    def test_info_loads_what_reads(self):
        with tempfile.TemporaryDirectory() as folder:
            volume = os.path.join(folder, "volume.mha")
            write_mha(volume, blobs())
            libraries = loaded_by(PROGRAM, "info", volume)
            self.assertLoadsNone(libraries, f"{DRAWS}|{HEAVY}|EchoramaFilters|EchoramaWidgets")
            self.assertEqual([name for name in libraries if "Command" in name], ["libEchoramaCommand-info.so"])
            # The library that reads OpenVDB comes with the first such file.
            sparse = os.path.join(folder, "volume.vdb")
            self.assertIn("libEchoramaReadersOpenVdbKernels.so.0", loaded_by(PROGRAM, "convert", volume, sparse))
            self.assertIn("libEchoramaReadersOpenVdbKernels.so.0", loaded_by(PROGRAM, "info", sparse))

    def test_every_command_is_found_and_view_alone_draws(self):
        self.assertGreater(len(commands()), 10)
        for command in commands():
            libraries = loaded_by(PROGRAM, command, "--help")
            self.assertEqual([name for name in libraries if "Command" in name], [f"libEchoramaCommand-{command}.so"])
            draws = any("vtkRenderingOpenGL2" in name for name in libraries)
            self.assertEqual(draws, command == "view", command)

    def test_found_from_anywhere(self):
        """By a link to the program, from another folder, with a path that is relative."""
        with tempfile.TemporaryDirectory() as folder:
            link = pathlib.Path(folder) / "ultrasound"
            link.symlink_to(PROGRAM)
            for program in (link, "./ultrasound"):
                done = subprocess.run([program, "info", "--help"], cwd=folder, capture_output=True, text=True)
                self.assertEqual((done.returncode, done.stderr), (0, ""))


PROBE = """
import sys
{code}
maps = open("/proc/self/maps").read()
print(*[name for name in ("libvtk", "libEchorama", "libvtkRenderingCore", "libopenvdb", "libceres", "EchoramaWidgets") if name in maps])
"""


class Package(unittest.TestCase):
    def loaded_by(self, code):
        """Which of some libraries are in the memory of a Python that has run the code."""
        done = subprocess.run([sys.executable, "-c", PROBE.format(code=code)], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout.split()

    def test_a_class_brings_its_module_alone(self):
        self.assertEqual(self.loaded_by("import echorama; dir(echorama)"), [])
        self.assertEqual(self.loaded_by("from echorama import vtkUltrasoundReader"), ["libvtk", "libEchorama"])
        self.assertEqual(self.loaded_by("import echorama; echorama.vtkUltrasoundReader()"), ["libvtk", "libEchorama"])
        self.assertIn("libceres", self.loaded_by("from echorama import vtkUltrasoundAligner"))
        self.assertIn("libvtkRenderingCore", self.loaded_by("from echorama import vtkUltrasoundSliceView"))
        everything = self.loaded_by("from echorama import *; vtkUltrasoundShell(); EchoramaWidgets")
        self.assertEqual(len(everything), 6)

    def test_a_view_brings_what_draws(self):
        code = "import echorama; view = echorama.vtkUltrasoundVolumeView; from vtkmodules.vtkRenderingCore import vtkRenderer; print(vtkRenderer().GetClassName())"
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        self.assertEqual(done.stdout, "vtkOpenGLRenderer\n", done.stderr)

    def test_every_class_is_there(self):
        folder = pathlib.Path(echorama.__file__).parent
        modules = sorted(path.name.split(".")[0] for path in folder.glob("Echorama*.so"))
        self.assertGreater(len(modules), 10)
        names = []
        for module in modules:
            loaded = importlib.import_module(f"echorama.{module}")
            self.assertIs(getattr(echorama, module), loaded)
            for name in vars(loaded):
                if not name.startswith("_"):
                    names.append(name)
                    self.assertIs(getattr(echorama, name), getattr(loaded, name))
        self.assertEqual(sorted(echorama.__all__), sorted(names + modules))
        self.assertLessEqual(set(echorama.__all__), set(dir(echorama)))

    def test_as_other_packages(self):
        kind = echorama.vtkUltrasoundStitcher
        self.assertIs(pickle.loads(pickle.dumps(kind)), kind)
        self.assertIs(echorama.vtkUltrasoundStitcher, kind)
        self.assertIn("class vtkUltrasoundStitcher", pydoc.render_doc(echorama, renderer=pydoc.plaintext))
        with self.assertRaisesRegex(AttributeError, "'echorama' has no attribute 'vtkNone'"):
            echorama.vtkNone
        with self.assertRaises(ImportError):
            from echorama import vtkNone
        self.assertFalse(hasattr(echorama, "vtkNone"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
