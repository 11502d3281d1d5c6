#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of a benchmark: plot_benchmark.py IN.jsonl OUT.png

IN.jsonl holds one JSON object per line, as Testing/Benchmark.h writes them. Each case becomes a panel of error against
seconds, both logarithmic: the nearer to the lower left corner, the better. Lines that count successes over a minimum
overlap (keys "t" and "within_1mm") become one more panel of success against t. A case without errors becomes bars of
seconds; one with a number of "levels" per line, seconds and error against the levels; lines with an "accuracy" are joined and
labelled with it; lines with a number of "rays" become curves of error against rays, with their slopes; lines of "energy"
at times "t" for some numbers of levels two panels of curves, linear and logarithmic; and lines with a "step" for a "viscosity" curves
of the one against the other, among them the "rule" that foretells it, with what gel has for a "viscosity" at some rates of shear. Lines with a number of "units" become curves of what one costs ("ns_per_unit"), one
panel for each case: the flatter the better; the grey band is 20% to either side of the median of the first method's.
"""
import json
import math
import pathlib
import statistics
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.ticker import LogLocator, NullFormatter

OURS = "#0b5e8a"
PEERS = ["#8a8a8a", "#b0763b", "#6f8f5f", "#9a6f9a", "#5f6f8f"]
MARKERS = "osD^vP*X<>hp"
# What ours is compared with: other libraries, and the simpler ways of stitching.
PEER_WORDS = ("vtk", "itk", "scipy", "opencv", "elastix", "brute", "peer", "average", "feather", "maximum", "cascadic", "descent", "sph")


def is_ours(method):
    return not any(word in method.lower() for word in PEER_WORDS)


def number(line, key):
    """The finite number under a key, else None."""
    value = line.get(key)
    return float(value) if isinstance(value, (int, float)) and math.isfinite(value) else None


def read(path):
    lines = []
    for count, text in enumerate(pathlib.Path(path).read_text().splitlines(), 1):
        if not text.strip():
            continue
        try:
            line = json.loads(text)
        except ValueError as problem:
            sys.exit(f"plot_benchmark: {path}, line {count} is not JSON: {problem}")
        if not isinstance(line, dict):
            sys.exit(f"plot_benchmark: {path}, line {count} is not a JSON object")
        lines.append(line)
    if not lines:
        sys.exit(f"plot_benchmark: {path} holds no lines")
    return lines


def is_success(line):
    return number(line, "t") is not None and number(line, "within_1mm") is not None


def grouped(lines, key):
    groups = {}
    for line in lines:
        groups.setdefault(str(line.get(key, "")), []).append(line)
    return groups


def looks(methods):
    """One marker and colour per method, the same in every panel; ours are blue and drawn on top."""
    looks, peers = {}, 0
    for index, method in enumerate(methods):
        ours = is_ours(method)
        looks[method] = {"marker": MARKERS[index % len(MARKERS)], "color": OURS if ours else PEERS[peers % len(PEERS)],
                         "markersize": 11 if ours else 8, "zorder": 3 if ours else 2,
                         "linestyle": "none", "markeredgecolor": "white", "label": method}
        peers += not ours
    return looks


def draw_panel(axes, case, lines, looks):
    points = [(str(line.get("method", "")), number(line, "seconds"), number(line, "error")) for line in lines]
    points = [(method, seconds, abs(error)) for method, seconds, error in points if seconds and seconds > 0 and error is not None]
    positive = [error for _, _, error in points if error > 0]
    # A logarithm has no zero: exact results stand on a line of their own, below all others.
    exact = len(positive) < len(points)
    floor = min(positive) / (10 if exact else 1) if positive else 1
    for method, of_method in grouped([line for line in lines if number(line, "accuracy") is not None], "method").items():
        curve = sorted((number(line, "accuracy"), number(line, "seconds"), number(line, "error")) for line in of_method)
        axes.plot([seconds for _, seconds, _ in curve], [error for _, _, error in curve], color=looks[method]["color"], linewidth=1)
        for accuracy, seconds, error in curve[::2]:
            axes.annotate(f"{accuracy:g}", (seconds, error), xytext=(7, 3), textcoords="offset points", fontsize=8)
    for method, seconds, error in points:
        axes.plot(seconds, max(error, floor), **looks[method])
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_title(case, fontsize=10)
    axes.set_xlabel("seconds")
    units = sorted({str(line["error_unit"]) for line in lines if line.get("error_unit")})
    axes.set_ylabel("error" + (f" ({', '.join(units)})" if units else ""))
    if not points:
        axes.text(0.5, 0.5, "nothing to draw", transform=axes.transAxes, ha="center")
        return
    seconds = [point[1] for point in points]
    axes.set_xlim(min(seconds) / 3, max(seconds) * 3)
    axes.set_ylim(floor / 3, max(positive, default=floor) * 5)
    for axis, (lowest, highest) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        if highest / lowest < 300:  # so few decades need ticks between them
            axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
    if exact:
        axes.axhline(floor, color="#bbbbbb", linewidth=0.8, linestyle=":", zorder=1)
        axes.text(0.99, floor, "exact", transform=axes.get_yaxis_transform(), fontsize=9, color="#777777", ha="right", va="bottom")
    if not positive:
        axes.tick_params(axis="y", which="both", left=False, labelleft=False)


def draw_success(axes, lines):
    for index, (case, of_case) in enumerate(sorted(grouped(lines, "case").items())):
        of_case = sorted(of_case, key=lambda line: line["t"])
        runs = [number(line, "runs") or number(line, "trials") or 1 for line in of_case]
        share = [100 * line["within_1mm"] / run for line, run in zip(of_case, runs)]
        axes.plot([line["t"] for line in of_case], share, marker=MARKERS[index % len(MARKERS)], label=case,
                  color=OURS if index == 0 else PEERS[(index - 1) % len(PEERS)])
    axes.set_title("success against the minimum overlap", fontsize=10)
    axes.set_xlabel("minimum overlap t")
    axes.set_ylabel("runs within 1 mm (%)")
    axes.set_ylim(-4, 104)
    axes.legend(fontsize=8, frameon=False)


def draw_bars(axes, case, lines):
    """Seconds per method, from top to bottom; a logarithm, for they lie far apart."""
    methods = [str(line.get("method", "")) for line in lines]
    seconds = [number(line, "seconds") or 0 for line in lines]
    axes.barh(methods, seconds, color=[OURS if is_ours(method) else PEERS[0] for method in methods], zorder=2)
    axes.set_xscale("log")
    axes.set_xlim(min(seconds) / 2, max(seconds) * 4)
    axes.invert_yaxis()
    for index, value in enumerate(seconds):
        axes.text(value * 1.1, index, f"{value:.2g} s", va="center", fontsize=8)
    axes.tick_params(axis="y", labelsize=8)
    axes.set_xlabel("seconds")
    axes.set_title(case, fontsize=10)


def draw_levels(axes, case, lines):
    lines = sorted(lines, key=lambda line: line["levels"])
    levels = [line["levels"] for line in lines]
    axes.plot(levels, [number(line, "seconds") for line in lines], marker="o", color=OURS, label="seconds")
    axes.set_ylim(bottom=0)
    axes.set_xlabel("levels")
    axes.set_ylabel("seconds until it stops")
    axes.set_title(case, fontsize=10)
    errors = axes.twinx()
    errors.plot(levels, [number(line, "error") for line in lines], marker="s", color=PEERS[1], linestyle=":", label="error")
    errors.set_ylim(bottom=0)
    errors.set_ylabel("largest error then")
    errors.spines["top"].set_visible(False)
    handles = [axes.lines[0], errors.lines[0]]
    axes.legend(handles, [handle.get_label() for handle in handles], fontsize=8, frameon=False)


def draw_rays(axes, case, lines):
    for index, (method, of_method) in enumerate(grouped(lines, "method").items()):
        axes.plot([line["rays"] for line in of_method], [number(line, "error") for line in of_method],
                  marker=MARKERS[index], color=([OURS] + PEERS)[index % (len(PEERS) + 1)],
                  label=f"{method}, slope {of_method[0]['slope']:.2f}")
    axes.set_xscale("log", base=2)
    axes.set_yscale("log")
    axes.set_xlabel("rays")
    axes.set_ylabel(lines[0].get("error_unit", "error"), fontsize=8)
    axes.set_title(case, fontsize=10)
    axes.legend(fontsize=8, frameon=False)


def draw_energy(axes, lines, logarithmic):
    curves = grouped(lines, "levels")
    for index, (levels, of_levels) in enumerate(sorted(curves.items())):
        axes.plot([line["t"] for line in of_levels], [line["energy"] for line in of_levels], linewidth=1.2,
                  color=plt.cm.viridis(index / max(len(curves) - 1, 1)), label=levels)
    if logarithmic:
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_ylim(bottom=max(line["energy"] for line in lines) / 1e4)
    axes.set_title("energy of the descent" + (", logarithmic" if logarithmic else ""), fontsize=10)
    axes.set_xlabel("seconds")
    axes.set_ylabel("normalised energy")
    axes.legend(title="levels", fontsize=8, title_fontsize=8, frameon=False, ncol=2)


def is_step(line):
    return number(line, "viscosity") is not None and (number(line, "step") is not None or number(line, "shear_rate") is not None)


def draw_steps(axes, lines):
    curves = grouped([line for line in lines if number(line, "step") is not None], "method")
    for index, (method, of_method) in enumerate(sorted(curves.items(), key=lambda item: is_ours(item[0]))):
        viscosities = [line["viscosity"] for line in of_method]
        colour = OURS if is_ours(method) else PEERS[1]
        axes.plot(viscosities, [line["step"] for line in of_method], marker=MARKERS[index], color=colour,
                  label=method if is_ours(method) else f"{method}, longest stable")
        if number(of_method[0], "rule") is not None:
            axes.plot(viscosities, [line["rule"] for line in of_method], color=colour, linestyle=":", label=f"{method}, step taken")
    axes.set_xscale("log")
    axes.set_yscale("log")
    for line in lines:
        if number(line, "shear_rate") is not None:
            axes.axvline(line["viscosity"], color="#999999", linewidth=0.8, linestyle="--", zorder=1)
            axes.text(line["viscosity"], 0.98, f"gel at {line['shear_rate']:g}/s", transform=axes.get_xaxis_transform(), rotation=90,
                      fontsize=7, color="#666666", ha="right", va="top")
    axes.set_xlabel("viscosity (Pa s)")
    axes.set_ylabel("step (s)")
    axes.set_ylim(top=axes.get_ylim()[1] * 10)  # room for the names of rates
    axes.set_title("step against viscosity", fontsize=10)
    axes.legend(fontsize=8, frameon=False, loc="lower left")


def draw_scaling(axes, case, lines):
    for index, (method, of_method) in enumerate(grouped(lines, "method").items()):
        units, costs = ([line[key] for line in of_method] for key in ("units", "ns_per_unit"))
        if index == 0:
            middle = statistics.median(costs)
            axes.axhspan(middle / 1.2, middle * 1.2, color="#eeeeee", zorder=0)
            axes.set_ylim(middle / 4, middle * 4)
        axes.plot(units, costs, marker=MARKERS[index], color=([OURS] + PEERS)[index], label=method)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlabel(f"{lines[0]['unit']}s")
    axes.set_ylabel("ns each")
    axes.set_title(case, fontsize=10)
    axes.legend(fontsize=8, frameon=False)


def main():
    if len(sys.argv) != 3:
        sys.exit("usage: plot_benchmark.py IN.jsonl OUT.png")
    lines = read(sys.argv[1])
    success = [line for line in lines if is_success(line)]
    energy = [line for line in lines if number(line, "t") is not None and number(line, "energy") is not None]
    cases = grouped([line for line in lines if line not in success and line not in energy and not is_step(line)], "case")
    steps = [line for line in lines if is_step(line)]
    panels = len(cases) + bool(success) + 2 * bool(energy) + bool(steps)
    columns = min(panels, 3)
    rows = math.ceil(panels / columns)
    figure, axes = plt.subplots(rows, columns, figsize=(max(6.0, 4.5 * columns), 3.6 * rows + 0.6), squeeze=False)
    axes = list(axes.flat)
    for spare in axes[panels:]:
        spare.set_visible(False)
    shown = axes[:panels]
    if steps:
        draw_steps(axes.pop(0), steps)
    def with_levels(of_case):
        return all(number(line, "levels") is not None for line in of_case)

    def with_rays(of_case):
        return all(number(line, "rays") is not None and number(line, "error") is not None for line in of_case)

    def with_units(of_case):
        return all(number(line, "units") and number(line, "ns_per_unit") for line in of_case)

    def without_errors(of_case):
        return all(number(line, "error") is None for line in of_case)

    points = {case: of_case for case, of_case in cases.items()
              if not with_levels(of_case) and not with_rays(of_case) and not without_errors(of_case)}
    look = looks(dict.fromkeys(str(line.get("method", "")) for of_case in points.values() for line in of_case))
    for (case, of_case), panel in zip(cases.items(), axes):
        if case in points:
            draw_panel(panel, case, of_case, look)
        elif with_levels(of_case):
            draw_levels(panel, case, of_case)
        elif with_rays(of_case):
            draw_rays(panel, case, of_case)
        elif with_units(of_case):
            draw_scaling(panel, case, of_case)
        else:
            draw_bars(panel, case, of_case)
    if success:
        draw_success(axes[len(cases)], success)
    if energy:
        draw_energy(axes[len(cases) + bool(success)], energy, False)
        draw_energy(axes[len(cases) + bool(success) + 1], energy, True)
    for panel in shown:
        panel.grid(True, which="major", color="#e6e6e6", linewidth=0.8)
        panel.set_axisbelow(True)
        for side in ("top", "right"):
            panel.spines[side].set_visible(False)
    drawn = dict.fromkeys(str(line.get("method", "")) for of_case in points.values() for line in of_case)
    legend_columns = min(len(drawn), columns + 1) or 1
    legend_inches = 0.25 * math.ceil(len(drawn) / legend_columns)
    height = figure.get_figheight()
    figure.tight_layout(rect=(0, legend_inches / height, 1, 1 - 0.3 / height))
    if drawn:
        figure.legend(handles=[plt.Line2D([], [], **look[method]) for method in drawn], loc="lower center",
                      ncol=legend_columns, fontsize=9, frameon=False)
    figure.suptitle(", ".join(dict.fromkeys(str(line.get("bench", "")) for line in lines)), fontsize=12, y=1 - 0.05 / height, va="top")
    out = pathlib.Path(sys.argv[2])
    out.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(out, dpi=110)
    print(out)


if __name__ == "__main__":
    main()
