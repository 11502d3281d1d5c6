#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""The study with truth: study.py make, run, plot (see Documentation/study.md).

It needs the Python package echorama and, to run, the program; ./run study provides both.
"""
import argparse
import csv
import json
import pathlib
import sys
import tempfile
import time

import numpy as np

from bodies import CONDITIONS, INDIVIDUALS, default_folder, make_bodies, make_impossible
from cases import PAIRS, Case, cases_in, make
from contestants import Answer, Echorama, Failed, contestants, run_program
from geometry import apply, degrees_of, write_poses

PROPERTIES = ["overlap", "gain_db", "noise_db", "rib", "decorrelation", "jets", "deformation_mm", "scan", "individual", "pressed_mm", "refraction", "impossible"]
COLUMNS = ["case", "start", "method", "verdict", "start_degrees", "start_mm", "tre_mm", "tre_voxels", "percentile95_mm", "landmarks_mm",
           "landmarks_max_mm", "floor_mm", "excess_mm", "beside_floor_mm", "predicted_mm", "seconds", "cpu_seconds", *PROPERTIES, "reason", "error"]


class Judge:
    """Holds a motion of the second volume against what a case knows."""

    def __init__(self, case, program, points=1000):
        self.case, self.program, self.voxel = case, program, case.voxel_mm()
        self.points = case.points(1, points)
        self.floor_mm = self.landmarks_mm(case.floor)["landmarks_mm"] if case.floor is not None else None

    def landmarks_mm(self, motion):
        with tempfile.TemporaryDirectory() as folder:
            poses = pathlib.Path(folder) / "poses.json"
            write_poses(poses, self.case.files, [np.eye(4), motion])
            done = run_program([self.program, "score", poses, "--landmarks", *self.case.landmarks, "--json"], 60)
        said = json.loads(done.stdout or "{}")
        if "landmarks" not in said:
            raise ValueError(f"{self.case.folder}: {said.get('error', 'its landmarks cannot be read')}")
        return {"landmarks_mm": said["landmarks"]["mean_mm"], "landmarks_max_mm": said["landmarks"]["max_mm"]}

    def figures(self, motion):
        found = {}
        if self.case.truth is not None:
            wrong = np.linalg.norm(apply(motion, self.points) - apply(self.case.truth, self.points), axis=1)
            found = {"tre_mm": float(wrong.mean()), "tre_rms_mm": float(np.sqrt((wrong ** 2).mean())), "percentile95_mm": float(np.percentile(wrong, 95))}
        if None not in self.case.landmarks:
            found |= self.landmarks_mm(motion)
            found.setdefault("tre_mm", found["landmarks_mm"])
        if self.floor_mm is not None:
            beside = np.linalg.norm(apply(motion, self.points) - apply(self.case.floor, self.points), axis=1)
            found |= {"floor_mm": self.floor_mm, "excess_mm": found["landmarks_mm"] - self.floor_mm,
                      "beside_floor_mm": float(np.sqrt((beside ** 2).mean()))}
        if "tre_mm" in found:
            found["tre_voxels"] = found["tre_mm"] / self.voxel
        return found

    def size_of_start(self, start):
        """How far a start is off: degrees, and mm at the middle of the volume; nothing without a truth."""
        if self.case.truth is None:
            return {}
        middle = self.points.mean(axis=0)[np.newaxis]
        return {"start_degrees": round(degrees_of(start.motion @ np.linalg.inv(self.case.truth)), 3),
                "start_mm": round(float(np.linalg.norm(apply(start.motion, middle) - apply(self.case.truth, middle))), 3)}


def results_of(folder):
    """What has been found so far: one row per case, start and method, the latest counts."""
    path = pathlib.Path(folder) / "results.jsonl"
    rows = {}
    if path.exists():
        for line in path.read_text().splitlines():
            try:
                row = json.loads(line)
                rows[row["case"], row["start"], row["method"]] = row
            except (ValueError, KeyError):
                continue  # the last line of a run that was cut off
    return list(rows.values())


def add_result(folder, row):
    """Adds a row. It begins a line of its own also where a run was cut off in one."""
    with open(folder / "results.jsonl", "a+b") as stream:
        stream.seek(max(stream.tell() - 1, 0))
        if stream.read() not in (b"", b"\n"):
            stream.write(b"\n")
        stream.write(json.dumps(row).encode() + b"\n")


def write_table(folder, rows):
    with open(pathlib.Path(folder) / "results.csv", "w", newline="") as stream:
        table = csv.DictWriter(stream, COLUMNS, extrasaction="ignore")
        table.writeheader()
        table.writerows(rows)


def run(folder, methods, program, again=False, limit=300.0, starts=None, say=print):
    """Lets every method align every start of every case, and notes what came out. What was done before is not done again."""
    folder = pathlib.Path(folder)
    done = set() if again else {(row["case"], row["start"], row["method"]) for row in results_of(folder)}
    for place in cases_in(folder):
        name = str(place.relative_to(folder)) if place != folder else place.name
        try:
            case = Case(place)
            judge = Judge(case, program)
            judge.figures(np.eye(4))  # whatever is wrong with the case shows before anything is aligned
            chosen = [start for start in case.starts() if not starts or any(text in start.name for text in starts)]
        except (OSError, ValueError, KeyError, Failed) as problem:
            say(f"{name}: left out: {problem}")
            continue
        for start in chosen:
            for method, contestant in {"start": None, **methods}.items():
                if (name, start.name, method) in done or (case.impossible and not isinstance(contestant, Echorama)):
                    continue  # there is only a verdict to judge
                row = {"case": name, "start": start.name, "method": method, **judge.size_of_start(start),
                       **{key: case.properties[key] for key in PROPERTIES if key in case.properties}}
                try:
                    answer = contestant.align(case, start, limit) if contestant else Answer(start.motion, 0.0)
                except Failed as problem:
                    # A method that gives up leaves the volumes where they were.
                    answer, row["error"] = Answer(start.motion, 0.0, 0.0, "failed"), str(problem)
                    row["reason"] = str(problem)
                try:
                    row |= judge.figures(answer.motion)
                except (OSError, ValueError, Failed) as problem:
                    say(f"{name} {start.name} {method}: not judged: {problem}")
                    continue
                row |= {"seconds": round(answer.seconds, 3), "cpu_seconds": round(answer.cpu_seconds, 3), "verdict": answer.verdict, "motion": answer.motion.tolist()}
                if np.isfinite(answer.predicted_mm):
                    row["predicted_mm"] = answer.predicted_mm
                row.setdefault("reason", answer.reason)
                add_result(folder, row)
                error = f"{row['tre_mm']:.3f} mm, " if "tre_mm" in row else ""
                say(f"{name} {start.name} {method}: {error}{row['seconds']:.1f} s {row['verdict']}"
                    + (f" ({row['error']})" if "error" in row else ""))
    rows = results_of(folder)
    write_table(folder, rows)
    return rows


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="study", description="Cases with truth, contestants that align them, tables and plots.")
    commands = parser.add_subparsers(dest="command", required=True)
    def add_command(name, about):
        command = commands.add_parser(name, help=about)
        command.add_argument("folder", type=pathlib.Path, nargs="?", help="where the cases are (default with --bodies: the user's cache)")
        command.add_argument("--bodies", action="store_true", help="the bench of bodies instead of the phantom's pairs")
        return command

    command = add_command("make", "write the cases: pairs of volumes of a phantom or of bodies, with truth and starts")
    command.add_argument("--pairs", nargs="+", choices=[*PAIRS, *CONDITIONS], metavar="NAME",
                         help=f"some of: {' '.join(PAIRS)}; of the bodies: {' '.join(CONDITIONS)}")
    command.add_argument("--individuals", nargs="+", type=int, default=INDIVIDUALS, help="seeds of the bodies (default 1 to 6)")
    command.add_argument("--repeats", type=int, default=1, help="pairs of each kind (default 1)")
    command.add_argument("--seed", type=int, default=1)
    command.add_argument("--spacing", type=float, default=1.0, help="edge of the voxels, mm (default 1)")
    command = add_command("run", "align every start of every case below a folder, ours or your own")
    command.add_argument("--methods", nargs="+", metavar="NAME", help="only these (default: all that are installed)")
    command.add_argument("--method", action="append", default=[], metavar="NAME=OPTIONS",
                         help="one more contestant: echorama align with these options; again for each")
    command.add_argument("--contestant", action="append", default=[], metavar="NAME=COMMAND",
                         help="one more: any program, called as COMMAND FIRST.mha SECOND.mha POSES.json; again for each")
    command.add_argument("--starts", nargs="+", metavar="TEXT", help="only starts whose names hold one of these texts (default: all)")
    command.add_argument("--again", action="store_true", help="also what was done before")
    command.add_argument("--limit", type=float, default=300.0, help="seconds for one alignment (default 300)")
    command.add_argument("--program", default="echorama", help="the program echorama")
    command = add_command("plot", "tables and plots of what was found")
    command.add_argument("--out", type=pathlib.Path, help="folder for the pictures (default: the folder of the cases)")
    command.add_argument("--show", metavar="CASE/START", help="the pair for the picture of slices (default: the first plain one)")
    options = parser.parse_args(arguments)

    begin = time.monotonic()
    if options.folder is None:
        if not options.bodies:
            parser.error(f"{options.command} needs a folder, or --bodies")
        options.folder = default_folder()
    try:
        if options.command == "make" and options.bodies:
            make_bodies(options.folder, options.pairs, options.individuals, options.spacing)
            make_impossible(options.folder, options.pairs, options.individuals)
        elif options.command == "make":
            make(options.folder, options.pairs, options.seed, options.repeats, options.spacing)
        elif options.command == "run":
            known = contestants(options.program, options.method, options.contestant)
            unknown = [name for name in options.methods or [] if name not in known]
            if unknown:
                raise ValueError(f"there is no method {unknown[0]}; there are {', '.join(known)}")
            wanted = [*(options.methods or []), *(text.partition("=")[0] for text in options.method + options.contestant)] or list(known)
            rows = run(options.folder, {name: known[name] for name in known if name in wanted}, options.program,
                       options.again, options.limit, options.starts)
            print(f"{len(rows)} results in {options.folder / 'results.csv'}, {time.monotonic() - begin:.0f} s")
        else:
            import figures  # matplotlib is only needed here
            figures.plot(options.folder, results_of(options.folder), options.out or options.folder, options.show)
    except (OSError, ValueError) as problem:
        sys.exit(f"study: {problem}")


if __name__ == "__main__":
    main()
