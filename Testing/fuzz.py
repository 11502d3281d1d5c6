#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Runs one fuzzer (./run fuzz NAME [SECONDS] [--keep]): a libFuzzer program, Fuzzing/Fuzz<Name>.cxx of a room.

It starts from the files that Seeds<Name>.py writes, from the inputs in Corpus<Name>.zip, both beside its source, and from what
earlier runs in the same build tree found. Its status is not 0 when the fuzzer broke something; the folder of the input is named then.
With --keep, the inputs that the seeds' branches do not cover are written to the archive again, as few and small as libFuzzer can
make them, and the run is added to the fuzzer's row in Testing/fuzzed.csv.
"""
import argparse
import csv
import datetime
import fcntl
import os
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import time
import zipfile

TABLE = pathlib.Path(__file__).with_name("fuzzed.csv")
FIELDS = ["fuzzer", "CPU minutes", "inputs tried", "branches", "CPU minutes since the last new branch", "last run"]
LIMITS = ["-timeout=10", "-rss_limit_mb=2048", "-malloc_limit_mb=1024"]
LARGEST_ARCHIVE = 64 << 10  # bytes; larger inputs are left out before smaller ones


def cpu_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


class Run:
    """What libFuzzer told of one run: the inputs tried, the branches covered, and when the last new one was reached."""

    def __init__(self):
        self.inputs = self.branches = 0
        self.begin = self.last_new = time.monotonic()
        self.tail = []  # of what is no progress

    def take(self, line):
        if not (told := re.match(r"#(\d+)\s+(\w+)\s.*?cov: (\d+)", line)):
            self.tail = [*self.tail[-60:], line.rstrip()]
            return
        self.inputs = int(told[1])
        if int(told[3]) > self.branches:
            self.branches = int(told[3])
            self.last_new = time.monotonic()
        if told[2] == "INITED":  # the seeds and the corpus are no news
            self.begin = self.last_new = time.monotonic()

    def __str__(self):
        now = time.monotonic()
        return (f"{self.inputs} inputs in {now - self.begin:.0f} s, {self.branches} branches, the last new one "
                f"{now - self.last_new:.0f} s before the end")


def fuzz(fuzzer, folders, broken, seconds, seed):
    """Runs it, and returns its status, what it told and the CPU seconds that it took."""
    run, before = Run(), cpu_seconds()
    memory = pathlib.Path("/dev/shm")  # a disk makes a fuzzer that writes files wait for most of its time
    environment = {**os.environ, "TMPDIR": str(memory)} if memory.is_dir() else None
    with subprocess.Popen([fuzzer, *LIMITS, f"-max_total_time={seconds}", f"-seed={seed}", "-print_final_stats=1",
                           f"-artifact_prefix={broken}/", *folders], stderr=subprocess.PIPE, text=True, errors="replace",
                          env=environment) as program:
        for line in program.stderr:
            run.take(line)
    return program.returncode, run, cpu_seconds() - before


def pack(fuzzer, seeds, inputs, archive):
    """Writes to the archive those of the inputs that reach what the seeds do not."""
    with tempfile.TemporaryDirectory(prefix="corpus-") as merged:
        known = {path.name for path in seeds.iterdir()}
        for path in seeds.iterdir():
            (pathlib.Path(merged) / path.name).write_bytes(path.read_bytes())
        subprocess.run([fuzzer, *LIMITS, "-merge=1", merged, *inputs], check=True, stderr=subprocess.DEVNULL)
        new = sorted((path for path in pathlib.Path(merged).iterdir() if path.name not in known), key=lambda path: path.stat().st_size)
        while True:
            with zipfile.ZipFile(archive, "w") as packed:
                for path in sorted(new):
                    packed.writestr(zipfile.ZipInfo(path.name), path.read_bytes(), zipfile.ZIP_DEFLATED, 9)
            if archive.stat().st_size <= LARGEST_ARCHIVE:
                break
            new = new[:-max(len(new) // 20, 1)]
    print(f"{archive}: {len(new)} inputs, {archive.stat().st_size} bytes")


def record(name, run, cpu):
    """Adds a run to the row of its fuzzer. Several fuzzers may run beside each other."""
    with open(__file__, "rb") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        add_to_row(name, run, cpu)


def add_to_row(name, run, cpu):
    rows = {}
    if TABLE.exists():
        with open(TABLE, newline="") as file:
            rows = {row["fuzzer"]: row for row in csv.DictReader(file)}
    row = rows.setdefault(name, dict.fromkeys(FIELDS, 0))
    now = time.monotonic()
    found = run.last_new > run.begin
    quiet = (now - run.last_new if found else now - run.begin) / max(now - run.begin, 1e-9) * cpu / 60
    row.update({"fuzzer": name, "CPU minutes": f"{float(row[FIELDS[1]]) + cpu / 60:.1f}", "inputs tried": int(row[FIELDS[2]]) + run.inputs,
                "branches": run.branches, FIELDS[4]: f"{quiet if found else float(row[FIELDS[4]]) + quiet:.1f}",
                "last run": datetime.date.today().isoformat()})
    with open(TABLE, "w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows[each] for each in sorted(rows))


def main():
    parser = argparse.ArgumentParser(prog="fuzz", description=__doc__.splitlines()[0])
    parser.add_argument("fuzzer", type=pathlib.Path, help="the program")
    parser.add_argument("source", type=pathlib.Path, help="its Fuzz<Name>.cxx")
    parser.add_argument("seconds", type=int, nargs="?", default=3600, help="how long (default 3600)")
    parser.add_argument("--keep", action="store_true", help="keep what was found in the sources: the archive and the table")
    parser.add_argument("--seed", type=int, default=1, help="of the random changes (default 1)")
    options = parser.parse_args()
    name = options.source.stem.removeprefix("Fuzz")
    archive = options.source.with_name(f"Corpus{name}.zip")
    work = options.fuzzer.resolve().parent / "corpus" / options.fuzzer.name
    seeds, kept, found, broken = (work / part for part in ("seeds", "kept", "found", "broken"))
    for folder in (seeds, kept, found, broken):
        folder.mkdir(parents=True, exist_ok=True)
    subprocess.run([sys.executable, options.source.with_name(f"Seeds{name}.py"), seeds], check=True)
    if archive.exists():
        with zipfile.ZipFile(archive) as packed:
            packed.extractall(kept)
    status, run, cpu = fuzz(options.fuzzer.resolve(), [found, seeds, kept], broken, options.seconds, options.seed)
    print(f"{name}: {run}; {cpu / 60:.1f} CPU minutes")
    if status:
        print("\n".join(run.tail) + f"\nthe input that did it: {broken}")
    if options.keep:
        record(name, run, cpu)
        pack(options.fuzzer.resolve(), seeds, [kept, found], archive)
    sys.exit(status)


if __name__ == "__main__":
    main()
