#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""What is left when a command that writes is killed, or its disk is full, read-only or gone (./run faults): a table.

Each command writes a new set of files over an older one of the same names. Afterwards the folder must hold the old set or the new one,
byte by byte: nothing is lost, nothing half-written. The faults:

- kill -9 before a system call that changes the folder. strace lists them in a first run and kills at the chosen one in later runs: the first,
  every kind of the last ones, and some between, chosen by the seed. Two renames apart, a set of several files may be under hidden names,
  whole: .old* is the old file and .part* the new one. The next run must then put the new set in place.
- a full disk: a file system of its own (tmpfs), of which so much is free: nothing, half of what is needed, all but one page.
- a read-only folder: a bind mount that is read-only.
- a share that vanishes: a file system is unmounted (lazily, as a share that the system gives up) while the command waits, stopped by strace
  at such a system call. What is open stays open, and nothing is found by its name any more. It stands for a share that answers with
  errors; one that does not answer makes any program wait.

Mounts lie in a namespace of their own, which needs root or unprivileged user namespaces.
"""
import argparse
import collections
import dataclasses
import datetime
import os
import pathlib
import platform
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

SOURCE = pathlib.Path(__file__).resolve().parents[1]
PAGE = SOURCE / "Documentation" / "faults.md"
TABLE = re.compile(r"(<!-- faults -->\n).*?(<!-- end faults -->)", re.S)
FAULTS = {"kill": "`kill -9`", "full": "full disk", "readonly": "read-only folder", "gone": "vanished share"}
HIDDEN = re.compile(r"(?:^|/)\.(old|part)\d+-\d+@[^@/]*@(.+)")  # the rest: a file, or one in a folder
CHANGES = ("openat", "write", "pwrite64", "writev", "ftruncate", "rename", "renameat", "renameat2", "link", "linkat", "unlink", "unlinkat", "mkdir",
           "mkdirat", "rmdir", "fsync", "copy_file_range", "sendfile")
REASONS = {"full": r"[Dd]isk (is )?full|No space left|out of disk space|cannot be written", "readonly": r"[Rr]ead-only|cannot be written", "gone": r"No such file|is no folder|not there|no folder"}


@dataclasses.dataclass
class Command:
    name: str
    make: object  # (folder of inputs, output folder, 0 or 1): arguments of the old and the new run
    python: bool = False
    statuses: tuple = (0,)


def program(build):
    return str(build / "bin" / "echorama")


SAVE = """
import sys
from vtkmodules.vtkCommonMath import vtkMatrix4x4
from echorama import vtkUltrasoundAlignmentSession
session, place = vtkUltrasoundAlignmentSession(), vtkMatrix4x4()
place.SetElement(0, 3, float(sys.argv[3]))
session.SetVolumeToWorld(session.OpenVolume(sys.argv[1]), place)
sys.exit(0 if session.SaveProject(sys.argv[2]) else 1)  # VTK has printed why
"""
STUDY = str(SOURCE / "Applications" / "study" / "study.py")

COMMANDS = [
    Command("convert", lambda i, o, n: ["convert", i / f"volume_{n + 1}.mha", o / "volume.mhd"]),
    Command("convert, OpenVDB", lambda i, o, n: ["convert", i / f"volume_{n + 1}.mha", o / "volume.vdb"]),
    Command("convert, a sequence", lambda i, o, n: ["convert", i / f"track_{n}.igs.mha", o / "out.seq.nrrd"]),
    Command("reconstruct", lambda i, o, n: ["reconstruct", i / f"track_{n}.igs.mha", "-o", o / "out.nii.gz", "--between", "nothing", "--spacing", 1]),
    Command("align", lambda i, o, n: ["align", i / "volume_1.mha", i / "volume_2.mha", "-o", o / "poses.json", "--apply", o / "moved", "--fixed", n + 1],
            statuses=(0, 3)),
    Command("align --deformable", lambda i, o, n: ["align", i / "volume_1.mha", i / "volume_2.mha", "-o", o / "poses.json", "--deformable", "--minimum-gain", 0,
                                              "--bending-weight", 1 + n],
            statuses=(0, 3)),
    Command("stitch", lambda i, o, n: ["stitch", i / "volume_1.mha", i / "volume_2.mha", "-o", o / "out.mha", "--uncertainty", "--spacing", 4 + n]),
    Command("embed", lambda i, o, n: ["embed", i / "volume_1.mha", "-o", o / "out.nrrd", "--preview", 3 + n]),
    Command("noise", lambda i, o, n: ["noise", "-o", o / "noise.mha", "--fan-angle", 40, "--fan-width", 25, "--sweep-angle", 30, "--sweep-width", 18,
                                      "--depth-max", 50, "--spacing", 2, "--seed", n]),
    Command("probe-fit", lambda i, o, n: ["probe-fit", i / f"volume_{n + 1}.mha", "-o", o / "out.vti"]),
    Command("phantom", lambda i, o, n: ["phantom", "-o", o / "set", "--count", 2, "--spacing", 5, "--landmarks", 5, "--seed", 5 + n]),
    Command("synthesize", lambda i, o, n: ["synthesize", i / "scene.json", "-o", o / "set", "--seed", 5 + n]),
    Command("shell", lambda i, o, n: ["shell", i / "ball.stl", "-o", o / "set", "--resolution-mm", 3, "--thickness-mm", 6 + n, "--opening-mm", 20, "--points", 20]),
    Command("calibrate pivot", lambda i, o, n: ["calibrate", "pivot", "--tracker", i / f"pivot_{n}.csv", "-o", o / "tip.json"]),
    Command("calibrate rig", lambda i, o, n: ["calibrate", "rig", "-o", o / "rig", "--scale", 0.6, "--resolution", 3 + n / 2]),
    Command("motion", lambda i, o, n: ["motion", i / f"motion_{n}.csv", "-o", o / "out.igs.mha", "--rate", 40]),
    Command("save a project", lambda i, o, n: ["-c", SAVE, i / "volume_1.mha", o / "project.json", n + 1], python=True),
]
QUICK = ("convert", "calibrate pivot", "calibrate rig")


def make_inputs(folder, build):
    """Small inputs of every kind; two of those by which old and new runs differ."""
    import numpy
    os.environ.setdefault("ECHORAMA_BUILD_DIR", str(build))
    sys.path.insert(0, str(SOURCE / "Testing"))
    from program_under_test import blobs, write_sequence
    import json
    subprocess.run([program(build), "phantom", "-o", folder, "--count", "2", "--spacing", "4"], check=True, stdout=subprocess.DEVNULL)
    for n in (0, 1):
        transforms = []
        for z in range(9):
            matrix = numpy.eye(4)
            matrix[2, 3] = z * (1 + n)
            transforms.append({"ImageToWorld": (matrix, "OK")})
        write_sequence(folder / f"track_{n}.igs.mha", blobs((9, 40, 50), seed=n), transforms)
        draw = numpy.random.default_rng(n)
        for name, tool in (("pivot", "StylusToTracker"), ("motion", "ProbeToTracker")):
            lines = ["time,tool,tx,ty,tz,qw,qx,qy,qz"]
            for k in range(80):
                q = numpy.array([1, *draw.normal(0, 0.25, 3)])
                w, *v = q / numpy.linalg.norm(q)
                v = numpy.array(v)
                tip = numpy.array([3.0, -5.0, 120.0])
                place = [10, 20, -80] - (tip + 2 * numpy.cross(v, numpy.cross(v, tip) + w * tip))
                if name == "motion":
                    place, w, v = [k / 2, n, 0], 1, [0, 0, 0]
                lines.append(",".join([repr(k / 20), tool, *(repr(float(x)) for x in (*place, w, *v))]))
            (folder / f"{name}_{n}.csv").write_text("\n".join(lines) + "\n")
    (folder / "scene.json").write_text(json.dumps({
        "schema": "echorama-scene-1", "name": "small", "seed": 3,
        "probe": {"preset": "mechanical-3d", "depthMinMm": 2, "depthMaxMm": 60, "elements": 20, "sweepSteps": 12, "samples": 120},
        "background": "tissue", "tissue": [{"name": "ball", "sphere": {"centre": [0, 0, 30], "radius": 8, "material": "cyst"}}],
        "views": {"count": 2, "overlap": 0.6}, "volume": {"spacingMm": 3, "knockMm": 8, "knockDegrees": 6}}))
    facets, around, along = [], 24, 12

    def place(a, b):
        turn, down = 2 * numpy.pi * (a % around) / around, numpy.pi * b / along
        return 40 * numpy.array([numpy.sin(down) * numpy.cos(turn), numpy.sin(down) * numpy.sin(turn), numpy.cos(down)])

    for a in range(around):
        for b in range(along):
            for corners in (((a, b), (a, b + 1), (a + 1, b + 1)), ((a, b), (a + 1, b + 1), (a + 1, b))):
                points = [(0 if q in (0, along) else p, q) for p, q in corners]
                if len(set(points)) == 3:
                    facets.append("facet normal 0 0 0\nouter loop\n" + "".join(
                        "vertex {:.6f} {:.6f} {:.6f}\n".format(*place(*point)) for point in points) + "endloop\nendfacet\n")
    (folder / "ball.stl").write_text("solid ball\n" + "".join(facets) + "endsolid ball\n")


def contents(folder):
    """{relative name: bytes} of the files in a folder."""
    found = {}
    for root, _, names in os.walk(folder):
        for name in names:
            path = os.path.join(root, name)
            text = pathlib.Path(path).read_bytes()
            if name.endswith(".vdb") and len(text) > 57:
                text = text[:21] + bytes(36) + text[57:]  # without the name that OpenVDB draws for each file
            if name.endswith(".json"):
                text = re.sub(rb'"lineage": "[^"]*"', b'"lineage": ""', text)  # a project draws one when it is begun
            found[os.path.relpath(path, folder)] = text
    return found


class Wrong(Exception):
    """What a fault must not do."""


class Bench:
    """One command: its old and its new files, and the faults."""

    def __init__(self, command, scratch, build, seed, moments):
        self.command, self.scratch, self.build, self.moments = command, scratch, build, moments
        self.random = random.Random(f"{seed} {command.name}")
        self.inputs, self.out, self.log = scratch / "in", scratch / "out", scratch / "strace.log"
        self.old, self.new = self.clean(0), self.clean(1)
        if self.new != self.clean(1):
            changed = [name for name, text in contents(self.out).items() if self.new.get(name) != text]
            raise Wrong(f"two runs write different files: {changed}")
        if not self.old or all(self.old.get(name) == text for name, text in self.new.items()):
            raise Wrong("old and new files do not differ")

    def argv(self, n):
        arguments = [str(a) for a in self.command.make(self.inputs, self.out, n)]
        return [sys.executable if self.command.python else program(self.build), *arguments]

    def empty(self):
        for path in self.out.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()

    def put_old(self):
        self.empty()
        for name, text in self.old.items():
            (self.out / name).parent.mkdir(parents=True, exist_ok=True)
            (self.out / name).write_bytes(text)

    def clean(self, n):
        self.empty()
        done = self.run(n)
        if done.returncode not in self.command.statuses:
            raise Wrong(f"does not run: {done.stderr}")
        return contents(self.out)

    def start(self, argv):
        return subprocess.Popen(argv, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, errors="replace",
                                cwd=self.scratch, env={**os.environ, "PYTHONPATH": str(self.build / "python3" / "dist-packages"), "LC_ALL": "C.UTF-8"})

    def run(self, n, prefix=()):
        child = self.start([*prefix, *self.argv(n)])
        errors = child.communicate(timeout=600)[1]
        return subprocess.CompletedProcess(child.args, child.returncode, "", errors)

    def strace(self, *inject):
        # The tracer is not our child, but that of the command: so the command's exit status is the one that we get.
        return ["strace", "-D", "-f", "-qq", "-y", "-s", "0", "-o", str(self.log), "-e", "trace=" + ",".join(CHANGES),
                *(part for each in inject for part in ("-e", each))]

    def events(self):
        """The system calls that change the folder, as (call, how many-th of its thread)."""
        self.put_old()
        self.log.unlink(missing_ok=True)
        done = self.run(1, self.strace())
        if done.returncode not in self.command.statuses:
            raise Wrong(f"does not run under strace: {done.stderr}")
        counts, events = collections.Counter(), []
        for line in self.log.read_text(errors="replace").splitlines():
            call = re.match(r"(\d+) +(\w+)\((.*)", line)
            if not call:
                continue
            counts[call[1], call[2]] += 1
            if str(self.out) in call[3] and (call[2] != "openat" or "O_CREAT" in line or "O_TRUNC" in line):
                events.append((call[2], counts[call[1], call[2]]))
        if not events:
            raise Wrong("strace saw no system call that changes the folder")
        return events

    def chosen(self, events, count):
        """The first, the last write, and then those that rename or remove before the rest; the same for the same seed."""
        writes = [event for event in events if event[0] in ("write", "pwrite64", "writev")]
        names = [event for event in events if event[0].startswith(("rename", "link", "unlink"))]
        picked = list(dict.fromkeys([events[0], *writes[-1:], *names[:1], *names[-1:]]))
        rest = [event for event in names if event not in picked]
        picked += self.random.sample(rest, min(len(rest), max(0, (count - len(picked)) // 2 + 1)))
        rest = [event for event in events if event not in picked]
        picked += self.random.sample(rest, min(len(rest), max(0, count - len(picked))))
        return sorted(picked[:max(count, 2)], key=events.index)

    def outcome(self, left, hidden_may_be):
        """Whether these files are the old set, the new set, or (old and new, or parts of the new) under hidden names."""
        hidden = {name: text for name, text in left.items() if HIDDEN.search(name)}
        shown = {name: text for name, text in left.items() if name not in hidden}
        if hidden and not hidden_may_be:
            raise Wrong(f"left behind: {sorted(hidden)}")
        if shown == self.old:
            return "old"
        if shown == self.new:
            return "new"
        for name, text in shown.items():
            if text not in (self.old.get(name), self.new.get(name)):
                raise Wrong(f"{name} is half-written: {len(text)} bytes, old {len(self.old.get(name, ''))}, new {len(self.new.get(name, ''))}")
        aside, staged = ({name[:match.start()] + "/" * (match.start() > 0) + match[2]: text for name, text in hidden.items()
                          if (match := HIDDEN.search(name)) and match[1] == kind} for kind in ("old", "part"))
        for name, text in self.old.items():
            if shown.get(name) != text and aside.get(name) != text and (name not in self.new or self.new[name] != shown.get(name)):
                raise Wrong(f"{name} is lost; there are {sorted(left)}")
        if aside and all(text in (staged.get(name), shown.get(name)) for name, text in self.new.items()):
            return "aside"
        raise Wrong(f"neither the old nor the new set: {sorted(left)}")

    def refused(self, done, fault):
        if done.returncode in (0, 3) or done.returncode < 0:
            raise Wrong(f"exit status {done.returncode}")
        names = {os.path.basename(name) for name in self.new} | {str(self.out)}
        if not any(name in done.stderr for name in names) or ".part" in done.stderr:
            raise Wrong(f"the message does not name the file: {done.stderr.strip()}")
        if not re.search(REASONS[fault], done.stderr):
            raise Wrong(f"the message does not say why: {done.stderr.strip()}")

    # The faults. Each gives the outcomes, one for each time.

    def kill(self):
        outcomes = []
        for call, n in self.chosen(self.events(), self.moments):
            self.put_old()
            done = self.run(1, self.strace(f"inject={call}:signal=SIGKILL:when={n}"))
            if done.returncode != -signal.SIGKILL:
                raise Wrong(f"{call} {n}: it was not killed ({done.returncode}) {done.stderr}")
            try:
                outcomes.append(self.outcome(contents(self.out), True))
                again = self.run(1)
                if again.returncode not in self.command.statuses:
                    raise Wrong(f"the next run fails: {again.stderr}")
                if self.outcome(contents(self.out), False) != "new":
                    raise Wrong("the next run does not put its files in place")
            except Wrong as wrong:
                raise Wrong(f"killed before {call} {n}: {wrong}") from None
        return outcomes

    def mounted(self):
        self.empty()  # below
        subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64m", "tmpfs", self.out], check=True)
        self.put_old()

    def full(self):
        outcomes = []
        page = os.sysconf("SC_PAGESIZE")
        needed = sum(-(-len(text) // page) * page for text in self.new.values())
        for room in sorted({0, needed // 2 // page * page, needed - page}):
            self.mounted()
            try:
                space = os.statvfs(self.out)
                with open(self.out / "filler", "wb") as filler:
                    os.posix_fallocate(filler.fileno(), 0, max(page, space.f_bavail * space.f_frsize - room))
                done = self.run(1)
                (self.out / "filler").unlink()
                try:
                    if (outcome := self.outcome(contents(self.out), False)) == "old":
                        self.refused(done, "full")
                    elif done.returncode not in self.command.statuses:
                        raise Wrong(f"exit status {done.returncode} and files that are new")
                    outcomes.append(outcome)
                except Wrong as wrong:
                    raise Wrong(f"{room} of {needed} bytes free: {wrong}") from None
            finally:
                subprocess.run(["umount", self.out], check=True)
        if "old" not in outcomes:
            raise Wrong("the disk was never full")
        return outcomes

    def readonly(self):
        self.put_old()
        subprocess.run(["mount", "--bind", self.out, self.out], check=True)
        try:
            subprocess.run(["mount", "-o", "remount,bind,ro", self.out], check=True)
            done = self.run(1)
        finally:
            subprocess.run(["umount", self.out], check=True)
        self.refused(done, "readonly")
        return [self.outcome(contents(self.out), False)]

    def gone(self):
        outcomes = []
        events = self.events()
        # What is written by name before all that is made anew is there goes below the share, as when it had never been there.
        made = max(number for number, (call, _) in enumerate(events) if number == 0 or call in ("openat", "mkdir"))
        for call, n in self.chosen(events[made + 1:], max(2, self.moments // 3)):
            self.mounted()
            share = os.open(self.out, os.O_RDONLY | os.O_DIRECTORY)
            self.log.unlink(missing_ok=True)
            child = self.start([*self.strace(f"inject={call}:signal=SIGSTOP:when={n}"), *self.argv(1)])
            try:
                end = time.monotonic() + 60
                while not (self.log.exists() and "stopped by SIGSTOP" in self.log.read_text(errors="replace")):
                    if time.monotonic() > end or child.poll() is not None:
                        raise Wrong(f"{call} {n}: it did not stop there")
                    time.sleep(0.005)
                subprocess.run(["umount", "-l", self.out], check=True)
                child.send_signal(signal.SIGCONT)
                errors = child.communicate(timeout=600)[1]
                below, kept = contents(self.out), contents(f"/proc/self/fd/{share}/.")
                try:
                    outcome = self.outcome(kept, True)
                    if below:
                        raise Wrong(f"it wrote where the share had been: {sorted(below)}")
                    if child.returncode not in self.command.statuses:
                        self.refused(subprocess.CompletedProcess([], child.returncode, "", errors), "gone")
                    elif outcome != "new":
                        raise Wrong(f"exit status {child.returncode}, and nothing new: {errors}")
                    outcomes.append(outcome)
                except Wrong as wrong:
                    raise Wrong(f"gone before {call} {n}: {wrong}") from None
            finally:
                if child.poll() is None:
                    child.kill()
                    child.wait()
                os.close(share)
                subprocess.run(["umount", "-l", self.out], check=False, stderr=subprocess.DEVNULL)
        return outcomes


def told(outcomes):
    return ", ".join(f"{outcomes.count(kind)} {kind}" for kind in ("old", "new", "aside") if kind in outcomes)


def table(build, names, faults, moments, seed, say=print):
    """Runs them. \\returns the rows as text, and how many cells are wrong."""
    rows, wrong = [], 0
    with tempfile.TemporaryDirectory(prefix="faults-") as folder:
        scratch = pathlib.Path(folder).resolve()
        for name in ("in", "out"):
            (scratch / name).mkdir()
        make_inputs(scratch / "in", build)
        for command in COMMANDS:
            if command.name not in names:
                continue
            cells, begin = [], time.monotonic()
            try:
                bench = Bench(command, scratch, build, seed, moments)
            except Wrong as problem:
                say(f"{command.name}: {problem}", flush=True)
                rows.append(f"| {command.name} | " + " | ".join("**wrong**" for _ in faults) + " |")
                wrong += len(faults)
                continue
            for fault in faults:
                try:
                    cells.append(told(getattr(bench, fault)()))
                    say(f"{command.name}, {FAULTS[fault]}: {cells[-1]}", flush=True)
                except Wrong as problem:
                    say(f"{command.name}, {FAULTS[fault]}: {problem}", flush=True)
                    cells.append("**wrong**")
                    wrong += 1
            say(f"{command.name}: {time.monotonic() - begin:.1f} s", flush=True)
            rows.append(f"| {command.name} | " + " | ".join(cells) + " |")
    return rows, wrong


def report(rows):
    """Writes these rows into the page; those of commands that did not run stay."""
    page = PAGE.read_text()
    there = {row.split(" | ")[0]: row for row in [*re.findall(r"^\| .*", TABLE.search(page)[0], re.M), *rows]}
    lines = [there[name] for command in COMMANDS if (name := f"| {command.name}") in there]
    head = f"| command | {' | '.join(FAULTS.values())} |\n" + "| --- " * (1 + len(FAULTS)) + "|\n"
    how = f"*{datetime.date.today()}, Linux {platform.release().split('-')[0]}: `./run faults --report`*"
    PAGE.write_text(TABLE.sub(lambda match: match[1] + head + "\n".join(lines) + f"\n\n{how}\n{match[2]}", page))


def missing():
    """Why the faults cannot be made here; empty when they can."""
    if not shutil.which("strace"):
        return "strace is not installed"
    if subprocess.run([*NAMESPACE, "mount", "-t", "tmpfs", "tmpfs", "/mnt"], stderr=subprocess.DEVNULL, check=False).returncode:
        return "no mounts in a namespace of its own here (neither root nor user namespaces)"
    return ""


NAMESPACE = ["unshare", "--mount", "--propagation", "private", *([] if os.geteuid() == 0 else ["--user", "--map-root-user"])]


def main():
    parser = argparse.ArgumentParser(prog="faults", description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=pathlib.Path, default=SOURCE / "build" / "release")
    parser.add_argument("--quick", action="store_true", help=f"only {', '.join(QUICK)}, and few moments")
    parser.add_argument("--only", nargs="+", default=[command.name for command in COMMANDS], metavar="COMMAND")
    parser.add_argument("--faults", nargs="+", choices=FAULTS, default=list(FAULTS))
    parser.add_argument("--moments", type=int, default=10, help="at how many system calls each is killed (default 10)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--report", action="store_true", help="write the rows into the table of the page")
    parser.add_argument("--inside", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if not options.inside:
        if why := missing():
            print(f"faults: skipped: {why}")
            sys.exit(77)
        os.execvp(NAMESPACE[0], [*NAMESPACE, sys.executable, __file__, "--inside", *sys.argv[1:]])
    if options.report and options.faults != list(FAULTS):
        parser.error("--report needs all faults")
    names, moments = (QUICK, 4) if options.quick else (options.only, options.moments)
    rows, wrong = table(options.build.resolve(), names, options.faults, moments, options.seed)
    text = "\n".join([f"| command | {' | '.join(FAULTS[fault] for fault in options.faults)} |", "| --- " * (1 + len(options.faults)) + "|", *rows])
    print(text)
    if options.report:
        report(rows)
    print(f"{len(rows) * len(options.faults)} cells, {wrong} wrong")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
