#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What ./run fuzz keeps of a run: its row in the table and the archive of inputs; with a program in the place of libFuzzer's."""
import contextlib
import csv
import io
import pathlib
import subprocess
import sys
import tempfile
import unittest
import zipfile
from unittest import mock

import fuzz

# It finds the words of WORDS as inputs, tells of a branch more for each, and merges by copying.
PROGRAM = """#!/usr/bin/python3
import pathlib, shutil, sys
options = [word for word in sys.argv[1:] if word.startswith("-")]
folders = [pathlib.Path(word) for word in sys.argv[1:] if not word.startswith("-")]
if "-merge=1" in options:
    for folder in folders[1:]:
        for path in folder.iterdir():
            shutil.copy(path, folders[0])
    sys.exit()
seen = {path.read_bytes() for folder in folders for path in folder.iterdir()}
print(f"#9\\tINITED cov: {len(seen)} ft: 9", file=sys.stderr)
for number, word in enumerate(WORDS):
    if word not in seen:
        (folders[0] / str(number)).write_bytes(word)
        seen.add(word)
    print(f"#{10 + number}\\tNEW    cov: {len(seen)} ft: 9", file=sys.stderr)
print(f"#100\\tDONE   cov: {len(seen)} ft: 9\\nwhat broke", file=sys.stderr)
sys.exit(STATUS)
"""


class Kept(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = pathlib.Path(folder.name)
        (self.path / "SeedsThing.py").write_text("import pathlib, sys\n(pathlib.Path(sys.argv[1]) / 'seed').write_bytes(b'seed')\n")
        self.enterContext(mock.patch.object(fuzz, "TABLE", self.path / "fuzzed.csv"))

    def run_fuzzer(self, words, *options, status=0):
        program = self.path / "FuzzThing"
        program.write_text(PROGRAM.replace("WORDS", repr(words)).replace("STATUS", str(status)))
        program.chmod(0o755)
        with mock.patch.object(sys, "argv", ["fuzz", str(program), str(self.path / "FuzzThing.cxx"), "1", *options]), \
             contextlib.redirect_stdout(io.StringIO()) as said, self.assertRaises(SystemExit) as ended:
            fuzz.main()
        return ended.exception.code, said.getvalue()

    def row(self):
        with open(fuzz.TABLE, newline="") as file:
            rows = list(csv.DictReader(file))
        self.assertEqual(len(rows), 1)
        return rows[0]

    def test_runs_add_up(self):
        with mock.patch.object(fuzz, "cpu_seconds", side_effect=[0, 90, 100, 160, 200, 320]):
            self.run_fuzzer([b"one", b"two"], "--keep")
            first = self.row()
            self.assertEqual((first["fuzzer"], first["CPU minutes"], first["inputs tried"], first["branches"]), ("Thing", "1.5", "100", "3"))
            self.run_fuzzer([b"one", b"two"], "--keep")
            second = self.row()
            self.assertEqual((second["CPU minutes"], second["inputs tried"], second["branches"]), ("2.5", "200", "3"))
            last = "CPU minutes since the last new branch"
            self.assertAlmostEqual(float(second[last]), float(first[last]) + 1.0, delta=0.11)  # nothing was new in all of it
            self.run_fuzzer([b"three"], "--keep")
            self.assertLess(float(self.row()[last]), 2.1)
            self.assertEqual(self.row()["CPU minutes"], "4.5")

    def test_archive_holds_what_the_seeds_do_not(self):
        self.run_fuzzer([b"one", b"seed"], "--keep")
        with zipfile.ZipFile(self.path / "CorpusThing.zip") as packed:
            self.assertEqual([packed.read(name) for name in packed.namelist()], [b"one"])
        before = (self.path / "CorpusThing.zip").read_bytes()
        subprocess.run(["rm", "-r", self.path / "corpus"], check=True)  # another machine
        said = self.run_fuzzer([b"one"])[1]
        self.assertIn("2 branches", said)  # those of the seed and of the archive were there before
        self.run_fuzzer([b"one"], "--keep")
        self.assertEqual((self.path / "CorpusThing.zip").read_bytes(), before)

    def test_archive_is_small(self):
        with mock.patch.object(fuzz, "LARGEST_ARCHIVE", 1000):
            self.run_fuzzer([bytes([each]) * (each + 1) for each in range(40)], "--keep")
        self.assertLessEqual((self.path / "CorpusThing.zip").stat().st_size, 1000)
        with zipfile.ZipFile(self.path / "CorpusThing.zip") as packed:
            sizes = [item.file_size for item in packed.infolist()]
        self.assertGreater(len(sizes), 3)
        self.assertEqual(sorted(sizes), list(range(1, len(sizes) + 1)))  # the largest went

    def test_what_breaks_is_told_and_the_sources_stay_as_they_are_without_keep(self):
        status, said = self.run_fuzzer([b"one"], status=77)
        self.assertEqual(status, 77)
        self.assertIn("what broke", said)
        self.assertIn(str(self.path / "corpus" / "FuzzThing" / "broken"), said)
        self.assertEqual(self.run_fuzzer([b"one"])[0], 0)
        self.assertFalse(fuzz.TABLE.exists() or (self.path / "CorpusThing.zip").exists())


if __name__ == "__main__":
    unittest.main()
