#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The watch over long runs finds memory and open files that grow, and passes what does not."""
import subprocess
import sys
import unittest

import numpy
import soak

STEADY = "import time\nkept = bytearray(b'x') * (40 << 20)\nwhile True: time.sleep(0.1)"
LEAKS = "import time\nkept = []\nwhile True:\n    kept.append(bytearray(b'x') * (2 << 20))\n    time.sleep(0.1)"
OPENS = "import time\nkept = []\nwhile True:\n    kept.append(open('/dev/null'))\n    time.sleep(0.1)"
ENDS = "import time\ntime.sleep(1)"


def rows(megabytes, files, minutes=120.0):
    times = numpy.arange(0, minutes, 1 / 30)
    return numpy.stack([times, megabytes(times), files(times)], axis=1)


class Judged(unittest.TestCase):
    def wrong(self, megabytes=lambda t: 300 + 0 * t, files=lambda t: 30 + 0 * t):
        return soak.judge(rows(megabytes, files), 120.0)[0]

    def test_what_grows_is_found(self):
        noise = numpy.random.default_rng(1).normal(0, 5, 3600)
        self.assertEqual(self.wrong(), [])
        self.assertEqual(self.wrong(lambda t: 300 + noise), [])
        self.assertEqual(self.wrong(lambda t: 300 + 15 * t / 60 + noise), [])  # less than is allowed
        self.assertEqual(self.wrong(lambda t: 300 + 200 * (1 - numpy.exp(-t / 3))), [])  # that is warming up
        self.assertIn("memory grows", self.wrong(lambda t: 300 + 30 * t / 60 + noise)[0])
        self.assertIn("files", self.wrong(files=lambda t: 30 + t // 50)[0])
        self.assertEqual(self.wrong(files=lambda t: 30 + (t % 10 > 9)), [])  # opened and closed
        self.assertEqual(len(self.wrong(lambda t: 300 + 30 * t / 60, lambda t: 30 + t // 30)), 2)

    def test_what_ended_early_has_not_passed(self):
        self.assertIn("it ended", soak.judge(rows(lambda t: 300 + 0 * t, lambda t: 30 + 0 * t, 60.0), 120.0)[0][0])
        self.assertIn("it ended", soak.judge(numpy.empty((0, 3)), 120.0)[0][0])


class Watched(unittest.TestCase):
    def test_programs(self):
        """Programs that do one thing each, beside each other for six seconds."""
        expected = ((STEADY, 0, "neither grows"), (LEAKS, 1, "memory grows"), (OPENS, 1, "open still"), (ENDS, 1, "it ended"))
        watches = [subprocess.Popen([sys.executable, soak.__file__, "0.1", "--interval", "0.1", "--command", sys.executable, "-c", program],
                                    text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) for program, _, _ in expected]
        for watch, (program, status, words) in zip(watches, expected):
            said = watch.communicate()[0]
            with self.subTest(program=program):
                self.assertEqual(watch.returncode, status, said)
                self.assertIn(words, said)


if __name__ == "__main__":
    unittest.main()
