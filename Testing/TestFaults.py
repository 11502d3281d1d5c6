#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Some commands that are killed, or whose disk is full, read-only or gone, while they write: nothing is lost, nothing half-written.
./run faults tries all of them, at more moments."""
import os
import pathlib
import subprocess
import sys
import unittest


def faults(*arguments):
    """Runs Testing/faults.py; what it printed, when a cell of its table is wrong."""
    program = pathlib.Path(__file__).resolve().with_name("faults.py")
    done = subprocess.run([sys.executable, program, "--build", os.environ["ECHORAMA_BUILD_DIR"], *arguments], text=True, check=False,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if done.returncode == 77:
        raise unittest.SkipTest(done.stdout)
    return done.stdout if done.returncode or ", 0 wrong" not in done.stdout else ""


class Faults(unittest.TestCase):
    def test_some_commands(self):
        self.assertEqual(faults("--quick"), "")


if __name__ == "__main__":
    unittest.main()
