#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Times of one benchmark in columns: compare_benchmarks.py NAME.RUN.COLUMN.jsonl... (./run bench NAME --cpus)

Each file is what the benchmark printed (Testing/Benchmark.h) in one run, with kernels for one CPU for instance. A row is the same line
of all, in a column the fastest of its runs; a column after the first also tells how many times as fast it is as the first. Where the last column is "native" (kernels tuned for this
machine), a last line tells how much longer those of packages take: the column before it, the highest level that this machine runs.
"""
import json
import pathlib
import statistics
import sys


def check_same_rows(name, lines, first_name, first):
    if [(line.get("case"), line.get("method")) for line in lines] != [(line.get("case"), line.get("method")) for line in first]:
        sys.exit(f"compare_benchmarks: {name} has other lines than {first_name}")


def fastest(runs):
    """Columns: name -> lines, the fastest of each line. runs: (name of a column, its lines) of each run."""
    columns = {}
    for name, lines in runs:
        known = columns.setdefault(name, lines)
        check_same_rows(f"a run of {name}", lines, "another", known)
        columns[name] = [min(pair, key=lambda line: line["seconds"]) for pair in zip(known, lines)]
    return columns


def table(columns):
    """Rows of words, the head first. columns: name -> lines, each the same lines in the same order."""
    first_name, first = next(iter(columns.items()))
    for name, lines in columns.items():
        check_same_rows(name, lines, first_name, first)
    rows = [["case", "method", *columns]]
    for row in zip(*columns.values()):
        seconds = [line["seconds"] for line in row]
        rows.append([str(row[0].get("case", "")), str(row[0].get("method", "")), f"{seconds[0]:.3g} s"] +
                    [f"{value:.3g} s ({seconds[0] / value:.2f})" for value in seconds[1:]])
    return rows


def packaged(columns):
    """How much longer kernels of packages, the last column but one, take than those tuned for this machine, the last."""
    ratios = [(each["seconds"] / native["seconds"], f"{each.get('case', '')} {each.get('method', '')}".strip())
              for each, native in zip(columns[-2], columns[-1]) if native["seconds"] > 0.0]
    if not ratios:
        return "nothing was timed with both kernels of packages and those tuned for this machine"
    slow = sum(ratio > 1.1 for ratio, _ in ratios)
    most, row = max(ratios)
    return (f"kernels of packages take {statistics.median(ratio for ratio, _ in ratios):.2f} times as long as those tuned for this machine "
            f"(median), at most {most:.2f} times ({row}); {slow} of {len(ratios)} rows more than 1.1 times")


def main():
    if len(sys.argv) < 2:
        sys.exit("usage: compare_benchmarks.py NAME.RUN.COLUMN.jsonl...")
    files = [pathlib.Path(name) for name in sys.argv[1:]]
    columns = fastest([(file.stem.split(".", 2)[-1], [line for line in map(json.loads, file.read_text().splitlines()) if "seconds" in line])
                       for file in files])
    rows = table(columns)
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        print("  ".join(word.ljust(width) for word, width in zip(row, widths)).rstrip())
    if len(columns) > 1 and [*columns][-1] == "native":
        print(packaged([*columns.values()]))


if __name__ == "__main__":
    main()
