#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Times of one benchmark in columns: compare_benchmarks.py NAME.COLUMN.jsonl... (./run bench NAME --cpus)

Each file is what the benchmark printed (Testing/Benchmark.h), with kernels for one CPU for instance. A row is the same line of all; a
column after the first also tells how many times as fast it is as the first.
"""
import json
import pathlib
import sys


def table(columns):
    """Rows of words, the head first. columns: name -> lines, each the same lines in the same order."""
    first = next(iter(columns.values()))
    for name, lines in columns.items():
        if [(line.get("case"), line.get("method")) for line in lines] != [(line.get("case"), line.get("method")) for line in first]:
            sys.exit(f"compare_benchmarks: {name} has other lines than {next(iter(columns))}")
    rows = [["case", "method", *columns]]
    for row in zip(*columns.values()):
        seconds = [line["seconds"] for line in row]
        rows.append([str(row[0].get("case", "")), str(row[0].get("method", "")), f"{seconds[0]:.3g} s"] +
                    [f"{value:.3g} s ({seconds[0] / value:.2f})" for value in seconds[1:]])
    return rows


def main():
    if len(sys.argv) < 2:
        sys.exit("usage: compare_benchmarks.py NAME.COLUMN.jsonl...")
    files = [pathlib.Path(name) for name in sys.argv[1:]]
    columns = {file.stem.split(".", 1)[-1]: [line for line in map(json.loads, file.read_text().splitlines()) if "seconds" in line]
               for file in files}
    rows = table(columns)
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        print("  ".join(word.ljust(width) for word, width in zip(row, widths)).rstrip())


if __name__ == "__main__":
    main()
