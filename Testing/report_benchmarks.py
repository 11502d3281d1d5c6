#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fills the tables of the pages from the benchmarks that measure them (./run bench --report), and says which are out of date.

A table stands between two comments of a page. The first names the benchmarks, the kernels that they measure, and how their lines
become rows; the text in between begins with the head of the table and ends with a line that says when, where and how it was measured:

    <!-- bench distance_map
    kernels: Core/Imaging/DistanceMap.cxx
    by: case
    row: {case} | {echorama.seconds:.2g} | {vtk.seconds:.2g} | {vtk.seconds / echorama.seconds:.1f}
    -->
    | mask | ours, s | VTK, s | ratio |
    | --- | --- | --- | --- |
    <!-- end bench 0123456789ab -->

Lines with the same values of "by" make one row. In it the keys of the first of them are names, and so is each method, up to the first
character that is no letter or digit: echorama.seconds. "lines" holds them all, in order. "only: EXPRESSION" leaves lines out. There may
be several "row"s, each with what was said before it. "plot: PICTURE" also draws the lines (plot_benchmark.py) into a file beside the page.
Where no row tells of memory ("_mb", "bytes") and the lines have a "peak_mb", that of a row's first line is put into a last column of the
table, which its head gets with it; not with "peak: none", where other processes are measured. The number at the end is that of the kernels' contents and their own headers',
without comments, spaces and the paths of what they include: when it is not theirs any more, a test fails.

What a program printed on a quiet machine is kept beside it, and used again as long as the program and our libraries are the same: a
report that was stopped goes on where it was.
"""
import argparse
import datetime
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import types

source = pathlib.Path(__file__).resolve().parents[1]
TABLE = re.compile(r"<!-- bench (?P<names>[\w ]+)\n(?P<spec>.*?)-->\n(?P<head>\|[^\n]*\n\|[^\n]*\n).*?<!-- end bench(?P<stamp> \w+)? -->", re.S)

PEAK = "peak, MB"


class Table:
    def __init__(self, page, match):
        self.page, self.names = page, match["names"].split()
        self.stamp = (match["stamp"] or "").strip()
        self.begin, self.end, self.head = match.start("head"), match.end(), match["head"]
        self.kernels, self.rows, self.plot, self.peak = [], [], None, True
        by, only = ["case"], "True"
        for line in match["spec"].splitlines():
            key, _, value = line.partition(": ")
            if key == "kernels":
                self.kernels += value.split()
            elif key == "by":
                by = [name.strip() for name in value.split(",")]
            elif key == "only":
                only = value
            elif key == "row":
                self.rows.append((by, only, value.strip()))
            elif key == "plot":
                self.plot = page.parent / value
            elif (key, value) == ("peak", "none"):
                self.peak = False
            else:
                sys.exit(f"{self}: \"{line}\" is none of kernels, by, only, row, plot, peak")
        if not self.kernels or not self.rows:
            sys.exit(f"{self}: it names no kernels, or no row")

    def __str__(self):
        return f"{os.path.relpath(self.page, source)}, table of {' '.join(self.names)}"

    def digest(self):
        """Of the kernels' contents as they are now."""
        told = hashlib.sha256()
        for kernel in self.kernels:
            if not (source / kernel).is_file():
                sys.exit(f"{self}: there is no kernel {kernel}")
            for file in dict.fromkeys((source / kernel, (source / kernel).with_suffix(".h"))):
                if file.is_file():
                    told.update(re.sub(r'#include "[^\n]*|//[^\n]*|\s+', "", file.read_text()).encode())
        return told.hexdigest()[:12]

    def filled(self, lines, how):
        """The head, the rows, the line that says how they were measured, and the end."""
        text = ""
        with_peak = self.peak and not any("_mb" in row or "bytes" in row for _, _, row in self.rows) and any("peak_mb" in line for line in lines)
        lines = [line for line in lines if "case" in line]  # others are points of curves
        for by, only, row in self.rows:
            groups = {}
            for line in lines:
                if eval(only, {}, dict(line)):  # the expression is ours: it stands in the page
                    groups.setdefault(tuple(str(line.get(key, "")) for key in by), []).append(line)
            if not groups:
                sys.exit(f"{self}: the benchmark printed no line for \"{row}\"")
            for group in groups.values():
                names = {**group[0], "lines": [types.SimpleNamespace(**line) for line in group]}
                for line in group:
                    names[re.match(r"\w*", str(line.get("method", "")))[0]] = types.SimpleNamespace(**line)
                try:
                    text += "| " + eval("f" + repr(row), {}, names) + (f" | {group[0].get('peak_mb', 0):,.0f}" if with_peak else "") + " |\n"
                except Exception as problem:
                    sys.exit(f"{self}: the row \"{row}\" cannot be made ({problem})")
        head = self.head
        if with_peak and PEAK not in head:
            head = "".join(line + added for line, added in zip(head.splitlines(), (f" {PEAK} |\n", " --- |\n")))
        return f"{head}{text}\n*{how}: `./run bench --report {' '.join(self.names)}`*\n<!-- end bench {self.digest()} -->"


def tables():
    found = []
    for page in [source / "README.md", *sorted((source / "Documentation").rglob("*.md"))]:
        found += [Table(page, match) for match in TABLE.finditer(page.read_text())]
    return found


def cpu():
    with open("/proc/cpuinfo") as text:
        names = [line.split(":", 1)[1].strip() for line in text if line.startswith("model name")]
    flags = pathlib.Path("/proc/cpuinfo").read_text()
    level = "AVX-512" if "avx512f" in flags else "AVX2" if "avx2" in flags else "no AVX2"
    return f"{names[0]} ({level}), {len(names)} cores"


def busy_share(seconds=2.0):
    """How much of all processors others use now, in [0, 1]."""
    def ticks():
        numbers = [int(number) for number in pathlib.Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:]]
        return sum(numbers), numbers[3] + numbers[4]
    before = ticks()
    time.sleep(seconds)
    after = ticks()
    return 1 - (after[1] - before[1]) / max(1, after[0] - before[0])


def wait_until_quiet(limit):
    """Whether nothing else runs; waits for it as long as \"limit\" seconds."""
    end, quiet = time.monotonic() + limit, 0
    while True:
        quiet = quiet + 1 if busy_share() < 0.05 else 0
        if quiet == 3:
            return True
        if time.monotonic() > end:
            return False


Quiet = "nothing else ran"


def identity(program):
    """Of the program and the libraries of ours that it loads."""
    loaded = subprocess.run(["ldd", program], stdout=subprocess.PIPE, text=True, check=True).stdout
    told = hashlib.sha256()
    for file in [program, *sorted(set(re.findall(r"=> (\S*/libEchorama\S+)", loaded)))]:
        told.update(pathlib.Path(file).read_bytes())
    return told.hexdigest()


def commit_of_code():
    """As git describe says it; the pages, which this fills, do not make it dirty."""
    commit = subprocess.run(["git", "describe", "--always"], cwd=source, stdout=subprocess.PIPE, text=True).stdout.strip()
    code = ["git", "diff", "--quiet", "HEAD", "--", ".", ":(exclude)Documentation", ":(exclude)*.md"]
    return commit + ("-dirty" if subprocess.run(code, cwd=source).returncode == 1 else "")


def measured(program, wait, again):
    """What it prints, and when, where and how that was measured."""
    kept = program.with_suffix(".measured.json")
    if not program.is_file():
        sys.exit(f"report_benchmarks: there is no program {program}")
    if kept.is_file() and not again:
        told = json.loads(kept.read_text())
        if told["program"] == identity(program) and told["how"].endswith(Quiet):
            print(f"{program.name}: measured before, the program has not changed", file=sys.stderr)
            return told
    quiet = wait_until_quiet(wait)
    commit = commit_of_code()
    print(f"{program.name}{'' if quiet else ': the machine is not quiet'}", file=sys.stderr)
    begin = time.monotonic()
    done = subprocess.run([program], cwd=source, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        sys.exit(f"report_benchmarks: {program.name} ended with status {done.returncode}; its tables stay as they were")
    print(f"{program.name}: {time.monotonic() - begin:.0f} s", file=sys.stderr)
    told = {"program": identity(program), "lines": [json.loads(line) for line in done.stdout.splitlines()],
            "how": f"Commit {commit}, {datetime.date.today()}, {cpu()}, {Quiet if quiet else 'beside other work'}"}
    kept.write_text(json.dumps(told, indent=1))
    return told


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", nargs="*", help="benchmarks (default: all that fill a table)")
    parser.add_argument("--programs", type=pathlib.Path, default=source / "build" / "release" / "benchmarks")
    parser.add_argument("--list", action="store_true", help="print the names of the benchmarks that fill tables")
    parser.add_argument("--check", action="store_true", help="name the tables that are older than what they measure")
    parser.add_argument("--again", action="store_true", help="measure again what has not changed")
    parser.add_argument("--wait", type=float, default=600, help="how long to wait for a quiet machine, seconds")
    options = parser.parse_args()
    wanted = [table for table in tables() if not options.name or set(table.names) & set(options.name)]
    names = sorted({name for table in wanted for name in table.names})
    missing = set(options.name) - set(names)
    if missing:
        sys.exit(f"report_benchmarks: no table is filled by {', '.join(sorted(missing))}")
    if options.list:
        print("\n".join(names))
        return
    if options.check:
        old = [str(table) for table in wanted if table.stamp != table.digest()]
        if old:
            sys.exit("older than the kernels that they measure; ./run bench --report fills them:\n  " + "\n  ".join(old))
        print(f"{len(wanted)} tables are those of the kernels as they are")
        return
    results = {}
    for name in names:
        program = options.programs / ("Benchmark" + "".join(part.capitalize() for part in name.split("_")))
        results[name] = measured(program, options.wait, options.again)
    for table in reversed(wanted):  # from the end of a page: places before it stay
        text = table.page.read_text()
        lines = [line for name in table.names for line in results[name]["lines"]]
        how = "; ".join(dict.fromkeys(results[name]["how"] for name in table.names))
        table.page.write_text(text[:table.begin] + table.filled(lines, how) + text[table.end:])
        print(table, file=sys.stderr)
        if table.plot:
            with tempfile.NamedTemporaryFile("w", suffix=".jsonl") as kept:
                kept.writelines(json.dumps(line) + "\n" for line in lines)
                kept.flush()
                subprocess.run([sys.executable, source / "Testing" / "plot_benchmark.py", kept.name, table.plot], check=True)


if __name__ == "__main__":
    main()
