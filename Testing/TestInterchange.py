#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Our files opened by the code of other programs, and theirs by us: the checks of interchange.py; and what says that they can fail."""
import pathlib
import tempfile
import unittest

import numpy
from vtkmodules.vtkCommonCore import vtkLogger

import interchange
from program_under_test import write_mha


class Interchange(unittest.TestCase):
    """A test for each check, named as its function."""


def test_of(one):
    def test(self):
        if not one.peer.is_there():
            self.skipTest(f"real data of {one.peer.title} are not there" if not one.peer.package else f"{one.peer.package} is not installed")
        interchange.perform(one)
    return test


for one in interchange.CHECKS:
    setattr(Interchange, f"test_{one.function.__name__}", test_of(one))


class Comparison(unittest.TestCase):
    def test_what_differs_is_seen(self):
        known, matrix = interchange.voxels("i2"), interchange.affine()
        self.assertEqual(interchange.assert_same(known, known, matrix, matrix), 0)
        other = known.copy()
        other[2, 3, 4] ^= 1
        with self.assertRaisesRegex(AssertionError, "^1 of 210 grey values differ"):
            interchange.assert_same(known, other, matrix, matrix)
        for changed in (known.astype("u2"), known.byteswap(), known[::-1], known[:, ::-1], known.transpose(2, 1, 0)):
            with self.assertRaises(AssertionError):
                interchange.assert_same(known, changed, matrix, matrix)
        off = matrix.copy()
        off[0, 3] += 1e-5
        self.assertAlmostEqual(interchange.assert_same(known, known, matrix, off), 1e-5, delta=1e-9)
        for lost in (interchange.affine(rotation=numpy.eye(3)), interchange.affine(rotation=interchange.DIRECTION.T), interchange.LPS @ matrix,
                     interchange.affine(spacing=interchange.SPACING[::-1])):
            with self.assertRaises(AssertionError):
                interchange.assert_same(known, known, matrix, lost)

    def test_slices_in_reverse_at_the_same_points_are_the_same(self):
        known, matrix = interchange.voxels("u1"), interchange.affine()
        reverse = matrix.copy()
        reverse[:3, 3] += 4 * matrix[:3, 2]
        reverse[:3, 2] *= -1
        self.assertLess(interchange.assert_same(known, known[::-1], matrix, reverse), 1e-12)

    def test_our_two_sides_are_no_mirror_of_each_other(self):
        """What we write and what we read is compared with files that neither made."""
        with tempfile.TemporaryDirectory() as folder:
            path, known = pathlib.Path(folder) / "a.mha", interchange.voxels("i2")
            interchange.we_write(path, known)
            self.assertEqual(interchange.assert_same(known, interchange.parsed_mha(path)[0], interchange.affine(), interchange.parsed_mha(path)[1]), 0)
            write_mha(path, known, interchange.SPACING, interchange.ORIGIN, interchange.DIRECTION)
            self.assertEqual(interchange.assert_same(known, interchange.we_read(path)[0], interchange.affine(), interchange.we_read(path)[1]), 0)


if __name__ == "__main__":
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)  # notes on what NIfTI rounds
    unittest.main()
