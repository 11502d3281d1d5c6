#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The program echorama-leds: what it prints, what it does to the lines of a chip that is a stand-in, and that no light stays on."""
import csv
import io
import itertools
import os
import pathlib
import re
import signal
import subprocess
import tempfile
import time
import unittest

BUILD = pathlib.Path(os.environ["ECHORAMA_BUILD_DIR"])
PROGRAM, FAKE = BUILD / "bin" / "echorama-leds", BUILD / "Testing" / "libFakeGpiod.so"


def run(*arguments, environment=None):
    return subprocess.run([PROGRAM, *map(str, arguments)], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60,
                          env={**os.environ, **(environment or {})})


def table(*arguments):
    """The seconds of all changes, and what each line shows from then on."""
    done = run(*arguments, "--dry-run", "--csv")
    assert done.returncode == 0, done.stderr
    rows = list(csv.reader(io.StringIO(done.stdout)))
    return rows[0], [float(row[0]) for row in rows[1:]], [tuple(map(int, row[1:])) for row in rows[1:]]


class DryRun(unittest.TestCase):
    def test_words_differ_however_they_are_shifted_and_all_are_off_at_first(self):
        for lights in (1, 2, 3, 4):
            head, times, states = table("-l", *range(lights))
            self.assertEqual(head, ["seconds", *(f"light {light}" for light in range(lights))])
            for slot, at in enumerate(times):
                self.assertAlmostEqual(at, slot / 90, delta=1e-9)
            self.assertEqual(states[:2], [(0,) * lights] * 2)
            words = list(zip(*states))
            for one, other in itertools.product(range(lights), repeat=2):
                for shift in range(len(states)):
                    differ = sum(a != b for a, b in zip(words[one], words[other][shift:] + words[other][:shift]))
                    self.assertTrue(differ >= 3 or (one == other and shift == 0), (lights, one, other, shift))

    def test_dimmed_lights_go_off_within_their_slots_and_the_trigger_rises_with_each(self):
        head, times, states = table("-l", 17, 27, "--trigger", 22, "--on-share", 0.3, "--rate-hz", 50, "--trigger-share", 0.6)
        self.assertEqual(head[-1], "trigger")
        rises = [at for at, before, now in zip(times, [(0, 0, 0), *states], states) if now[2] > before[2]]
        self.assertEqual(rises, [round(slot * 0.02, 9) for slot in range(len(rises))])
        words = [state[:2] for at, state in zip(times, states) if at in rises]
        self.assertEqual(words, table("-l", 1, 2)[2])
        for at, before, now in zip(times[1:], states, states[1:]):
            if any(a > b for a, b in zip(before[:2], now[:2])) and at not in rises:
                self.assertAlmostEqual(at % 0.02, 0.3 * 0.02, delta=1e-9)
            if before[2] > now[2]:
                self.assertAlmostEqual(at % 0.02, 0.6 * 0.02, delta=1e-9)

    def test_the_picture_shows_what_the_table_holds(self):
        done = run("-l", "GPIO17", 27, "-t", 5, "--on-share", 0.4, "--dry-run")
        self.assertEqual(done.returncode, 0, done.stderr)
        words = list(zip(*table("-l", 17, 27)[2]))
        for light, line in ((0, "GPIO17"), (1, "27")):
            share = 100 * 0.4 * sum(words[light]) / len(words[light])
            self.assertRegex(done.stdout, rf"light {light}  +{line} +on {share:.1f}% of the time, at most 4\.444 ms on end")
            self.assertIn(f"light {light}  " + "".join("##..." if on else "....." for on in words[light]), done.stdout)
        self.assertIn("trigger  " + "###.." * len(words[0]), done.stdout)

    def test_it_tries_how_punctual_the_machine_is(self):
        done = run("-l", 17, "--dry-run", "--rate-hz", 2, "--seconds", 5)  # slow enough for a machine that has much else to do
        self.assertIn(done.returncode, (0, 3), done.stderr)
        self.assertRegex(done.stderr, r"10 slots, 10 changes: half within [\d.]+ ms, 99% within [\d.]+ ms, the worst [\d.]+ ms later")

    def test_wrong_usage_is_told_in_a_line(self):
        for arguments, words in (((), "--line is required"), (("-l", 1, 2, 3, 4, 5), "--line: At Most 4"),
                                 (("-l", 1, "--rate-hz", 5000), "RateHz is 5000 Hz; it must be in [0.1, 2000]"),
                                 (("-l", 1, "--on-share", 0), "OnShare is 0; it must be in [0.01, 1]"),
                                 (("-l", 1, "--code", "morse"), "Code"),
                                 (("-l", 1, 2, 3, "--code", "alternating", "--dry-run"), "two lights can alternate, not 3"),
                                 (("-l", 1, "--csv"), "--csv requires --dry-run")):
            done = run(*arguments)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(words, done.stderr)
            self.assertEqual((done.stdout, done.stderr.count("\n")), ("", 1))


@unittest.skipUnless(FAKE.exists(), "built without libgpiod")
class Lines(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.log = pathlib.Path(self.folder.name) / "log"

    def environment(self, trouble=""):
        return {"LD_PRELOAD": str(FAKE), "FAKE_GPIO": trouble, "FAKE_GPIO_LOG": str(self.log)}

    def settings(self):
        """When, and what, of all settings."""
        rows = [line.split() for line in self.log.read_text().splitlines() if re.match(r"\d+\.\d+ ", line)]
        return [float(row[0]) for row in rows], [tuple(map(int, row[1:])) for row in rows]

    def check_off(self):
        lines = self.log.read_text().splitlines()
        self.assertRegex(lines[-2], r"^\d+\.\d+( 0)+$")
        self.assertEqual(lines[-1], "released")

    def test_lines_do_what_was_printed(self):
        done = run("-l", 17, "GPIO27", "--trigger", "GPIO22", "--active-low", "--rate-hz", 40, "--seconds", 1, environment=self.environment())
        self.assertIn(done.returncode, (0, 3), done.stderr)
        self.assertIn("taken by echorama-leds as low 17=0 27=0 22=0\n", self.log.read_text())
        self.check_off()
        begin = float(re.search(r"slot 0 begins (\d+\.\d+) s after 1970 began", done.stderr)[1])
        times, states = self.settings()
        first = next(i for i, state in enumerate(states) if any(state))  # the trigger of slot 0, after the rehearsal
        times, states = times[first:], states[first:]
        self.assertAlmostEqual(times[0] - time.monotonic() + time.time(), begin, delta=0.2)
        _, planned, shown = table("-l", 1, 2, "--trigger", 3, "--rate-hz", 40)
        period = len(planned) / 2 / 40  # two changes a slot: the trigger falls
        due = [(at + turn * period, state) for turn in range(10) for at, state in zip(planned, shown)]
        # A busy machine may leave something out, which it tells; all else comes in its order, later than printed by a delay.
        late = [min((at - times[0] - when for when, what in due if what == state and when <= at - times[0] + 1e-3), default=9)
                for at, state in zip(times[:-2], states[:-2])]
        self.assertLess(sorted(late)[len(late) // 2], 2e-3)
        self.assertLess(max(late), 0.2)
        self.assertGreater(len(late), 40)

    def test_signals_end_it_with_all_lights_off(self):
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTSTP):
            self.log.unlink(missing_ok=True)
            # Slots are a second long, and a signal ends the sleep.
            process = subprocess.Popen([PROGRAM, "-l", "17", "27", "--off-slots", "1", "--rate-hz", "1"], stderr=subprocess.PIPE,
                                       text=True, env={**os.environ, **self.environment()})
            for _ in range(300):
                time.sleep(0.05)
                if self.log.exists() and any(map(any, self.settings()[1])):
                    break
            else:
                self.fail("no light came on")
            process.send_signal(number)
            _, told = process.communicate(timeout=20)
            self.assertIn(process.returncode, (0, 3), told)
            self.assertIn(" slots, ", told)
            self.check_off()

    def test_what_is_wrong_with_a_line_or_chip_is_told(self):
        for arguments, trouble, status, words in (
                ((17,), "missing", 1, "/dev/gpiochip0: there is no such GPIO chip"),
                ((17, "--chip", 3), "", 1, "/dev/gpiochip3: there is no such GPIO chip"),
                ((17,), "denied", 1, 'permission is missing; members of the group "gpio"'),
                ((17,), "busy", 1, "another program has just taken one"),
                ((17, 4), "", 1, 'line 4 is taken by "somebody\'s heater"'),
                ((17, 54), "", 2, "there is no line 54; it has lines 0 to 53"),
                ((17, -1), "", 2, "-1"),
                ((17, "GPIO99"), "", 2, "it has no line named GPIO99"),
                ((17, "GPIO17"), "", 2, "line GPIO17 is named twice"),
                ((17, "--trigger", 17), "", 2, "line 17 is named twice"),
                ((17, "--rate-hz", 1000), "slow:2000", 1, "this machine cannot hold 1000 Hz: 100% of all changes"),
        ):
            self.log.unlink(missing_ok=True)
            done = run("-l", *arguments, "--seconds", 0.2, environment=self.environment(trouble))
            self.assertEqual(done.returncode, status, (arguments, trouble, done.stderr))
            self.assertIn(words, done.stderr)
            self.assertEqual(len(re.findall("^echorama-leds: (?!note: )", done.stderr, re.M)), 1, done.stderr)
            if self.log.exists():
                for state in self.settings()[1]:
                    self.assertFalse(any(state), trouble)

    def test_lines_that_fail_are_told_and_switched_off(self):
        # Fewer than ten slots are in half a second, so there is no rehearsal.
        arguments = ("-l", 17, 27, "--rate-hz", 19, "--seconds", 3)
        done = run(*arguments, environment=self.environment("broken:5"))
        self.assertEqual(done.returncode, 1)
        self.assertIn("/dev/gpiochip0: its lines cannot be driven: Input/output error\n", done.stderr)
        self.check_off()
        self.assertTrue(any(map(any, self.settings()[1])))  # a light was on
        done = run(*arguments, environment=self.environment("dead:5"))
        self.assertEqual(done.returncode, 1)
        self.assertIn("Input/output error; nor could the lights be switched off\n", done.stderr)


if __name__ == "__main__":
    unittest.main()
