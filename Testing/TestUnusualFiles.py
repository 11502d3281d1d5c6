#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Names as long as they may be; empty files; a decimal comma."""
import os
import pathlib
import resource
import shutil
import subprocess
import sys
import tempfile
import unittest

from program_under_test import blobs, read_mha, run, snapshot, write_mha

VOLUMES = (".mha", ".mhd", ".nrrd", ".nhdr", ".nii", ".nii.gz", ".vdb", ".vti")
# Whatever a reader is chosen by.
EXTENSIONS = (*VOLUMES, ".hdr", ".img", ".vol", ".dcm", ".png", ".tif", ".igs.mha", ".seq.nrrd", ".json", ".xml", ".csv", ".txt", ".unknown", "")
MESHES = (".stl", ".ply", ".obj", ".vtp", ".glb")
LANDMARKS = (".fcsv", ".mrk.json", ".csv")


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)
        self.good = self.path / "good.mha"
        write_mha(self.good, blobs())

    def says_why(self, name, done):
        """Refused, with one line that names the file."""
        self.assertEqual(done.returncode, 1, f"{name}: {done.stdout}{done.stderr}")
        lines = [line for line in done.stderr.splitlines() if not line.startswith("echorama: note: ")]
        self.assertEqual(len(lines), 1, done.stderr)
        self.assertIn(name, lines[0])


class Names(Folder):
    def test_paths_of_300_characters(self):
        folder = self.path.joinpath(*["long folder name " + "x" * 50] * 4)
        folder.mkdir(parents=True)
        self.assertGreater(len(str(folder)), 270)
        for extension in VOLUMES:
            out = folder / ("y" * 30 + extension)
            for source, target in ((self.good, out), (out, self.path / "back.mha")):
                done = run("convert", source, target)
                self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(read_mha(self.path / "back.mha")[1].tobytes(), read_mha(self.good)[1].tobytes())

    def test_longer_than_a_name_may_be(self):
        before = snapshot(self.path)
        for name in ("z" * 252 + ".mha", "z" * 300 + ".mha"):
            done = run("convert", self.good, self.path / name)
            self.assertEqual(done.returncode, 1)
            self.assertIn("too long", done.stderr)
            self.assertEqual(snapshot(self.path), before)

    def test_that_a_header_cannot_name(self):
        before = snapshot(self.path)
        for extension in (".mhd", ".nhdr"):
            done = run("convert", self.good, self.path / f"two\nlines{extension}")
            self.says_why(f"two lines{extension}", done)
            self.assertIn("not found again", done.stderr)
            self.assertEqual(snapshot(self.path), before)


class Sizes(Folder):
    """Read with little memory and time: what a reader may take does not grow with a file that is not what it says."""

    def tells(self, path, *command):
        def little():
            resource.setrlimit(resource.RLIMIT_DATA, (3 << 30, 3 << 30))
            resource.setrlimit(resource.RLIMIT_CPU, (5, 5))  # to read through 100 GB takes longer on any machine

        return run(*command, preexec_fn=little) if command else run("info", path, preexec_fn=little)

    def commands(self, extension, path):
        if extension in MESHES:
            yield ("shell", path, "-o", self.path / "out")
        elif extension in (".fcsv", ".mrk.json"):
            yield ("score", self.path / "poses.json", "--landmarks", path, path)
        else:
            yield ("info", path)

    def each(self, make):
        self.assertIn(run("align", self.good, self.good, "-o", self.path / "poses.json").returncode, (0, 1, 3))
        for extension in dict.fromkeys((*EXTENSIONS, *MESHES)):
            path = self.path / f"bad{extension}"
            make(path)
            for command in self.commands(extension, path):
                with self.subTest(extension=extension):
                    self.says_why(path.name, self.tells(path, *command))
            path.unlink()

    def test_empty_files(self):
        self.each(lambda path: path.write_bytes(b""))

    def test_a_good_file_with_100_gb_behind_it(self):
        for name, encode in (("appended", "SetDataModeToAppended"), ("inline", "SetDataModeToBinary"), ("text", "SetDataModeToAscii")):
            path = self.path / f"{name}.vti"
            made = subprocess.run([sys.executable, "-c", VTI, encode, path], capture_output=True, text=True, check=False)
            self.assertEqual(made.returncode, 0, made.stderr)
            self.assertEqual(self.tells(path).returncode, 0)
            os.truncate(path, 100 << 30)  # a hole: it takes no room
            done = self.tells(path)
            with self.subTest(name=name):
                self.assertIn(done.returncode, (0, 1), done.stderr)  # not ended for want of time
                if done.returncode:
                    self.says_why(path.name, done)


VTI = """
import sys
from vtkmodules.vtkImagingCore import vtkRTAnalyticSource
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter
source, writer = vtkRTAnalyticSource(), vtkXMLImageDataWriter()
writer.SetInputConnection(source.GetOutputPort())
getattr(writer, sys.argv[1])()
writer.SetFileName(sys.argv[2])
sys.exit(not writer.Write())
"""


COMMA = """
import locale, pathlib, sys
if sys.argv[1] == "comma":
    locale.setlocale(locale.LC_ALL, "de_DE.UTF-8")
    assert locale.localeconv()["decimal_point"] == ","
from vtkmodules.vtkCommonMath import vtkMatrix4x4
import echorama
source, out = sys.argv[2], pathlib.Path(sys.argv[3])
out.mkdir()
for extension in sys.argv[4:]:
    reader, writer, again = echorama.vtkUltrasoundReader(), echorama.vtkUltrasoundWriter(), echorama.vtkUltrasoundReader()
    reader.SetFileName(source)
    writer.SetInputConnection(reader.GetOutputPort())
    writer.SetFileName(str(out / ("a" + extension)))
    assert writer.Write()
    again.SetFileName(str(out / ("a" + extension)))
    again.Update()
    assert again.GetOutput().GetSpacing() == (0.25, 0.5, 1.75), again.GetOutput().GetSpacing()
session, place = echorama.vtkUltrasoundAlignmentSession(), vtkMatrix4x4()
place.SetElement(0, 3, 1.25)
volume = session.OpenVolume(source)
session.SetVolumeToWorld(volume, place)
assert session.SaveProject(str(out / "project.json"))
other = echorama.vtkUltrasoundAlignmentSession()
assert other.OpenProject(str(out / "project.json"))
other.GetVolumeToWorld(other.GetVolumeId(0), place)
assert place.GetElement(0, 3) == 1.25
"""


@unittest.skipUnless(shutil.which("localedef"), "localedef is not installed")
class DecimalComma(Folder):
    def setUp(self):
        super().setUp()
        made = subprocess.run(["localedef", "-i", "de_DE", "-f", "UTF-8", self.path / "de_DE.UTF-8"], capture_output=True, text=True, check=False)
        if not (self.path / "de_DE.UTF-8").is_dir():
            self.skipTest(f"no locale can be made: {made.stderr}")
        self.german = {**os.environ, "LOCPATH": str(self.path), "LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8"}
        write_mha(self.good, blobs(), spacing=(0.25, 0.5, 1.75))

    def test_in_a_program_that_asks_for_the_locale(self):
        for name in ("point", "comma"):
            done = subprocess.run([sys.executable, "-c", COMMA, name, self.good, self.path / name, *VOLUMES], env=self.german, text=True, capture_output=True, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
        for path in (self.path / "point").iterdir():
            if path.suffix not in (".vdb", ".backups", ".json") and path.is_file():  # which hold a drawn name, the time, the folder
                self.assertEqual(path.read_bytes(), (self.path / "comma" / path.name).read_bytes(), path.name)


if __name__ == "__main__":
    unittest.main()
