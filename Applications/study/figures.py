# SPDX-License-Identifier: BSD-3-Clause
"""Tables and pictures of the study."""
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from cases import PLAIN, Case

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "demo"))
from volumes import Volume  # noqa: E402 (volumes in the world: the demo's)

COLOURS = {"start": "#9e9e9e", "search": "#ff6f00", "elastix-mi-250": "#7b1fa2", "elastix-mi-1000": "#4a148c",
           "elastix-ncc-250": "#c2185b", "echorama": "#00796b", "truth": "#424242"}
SPARE = ["#1976d2", "#689f38", "#5d4037", "#0097a7"]
# What is plotted against, with the value that means "none" of it and how it is written.
AGAINST = {"overlap": "overlap", "noise_db": "noise beside background, dB", "rib": "share of the fan in shadow",
           "decorrelation": "planted decorrelation", "deformation_mm": "probe deformation, mm"}


def colour_of(method, methods):
    return COLOURS.get(method) or SPARE[[m for m in methods if m not in COLOURS].index(method) % len(SPARE)]


def is_right(row):
    return row["tre_voxels"] < 1


def in_order(rows):
    """The methods that are there, the start first."""
    known = [method for method in COLOURS if any(row["method"] == method for row in rows)]
    return known + sorted({row["method"] for row in rows} - set(known))


def percent(part, whole):
    return f"{100 * part / whole:.0f}%" if whole else ""


def start_of(row):
    """A start's size as text: cases of one size are counted together."""
    if "start_degrees" not in row:
        return row["start"]
    return f"{row['start_degrees']:.0f} deg, {row['start_mm']:.0f} mm"


def median_seconds(rows, clock="seconds"):
    """Of those that gave an answer."""
    seconds = [row[clock] for row in rows if "error" not in row]
    return f"{np.median(seconds):.1f}" if seconds else ""


def tables(rows):
    """Markdown: success by start and method; and what the verdicts are worth."""
    methods = [method for method in in_order(rows) if method != "start"]
    starts = sorted({start_of(row) for row in rows}, key=lambda text: [float(w) for w in text.split() if w.isdigit()] or [1e9])
    text = ["| start | method | cases | below 1 voxel | median TRE, voxels | 95% | seconds (median) | CPU seconds (median) |",
            "| --- | --- | --- | --- | --- | --- | --- | --- |"]
    for start in starts:
        for method in methods:
            found = [row for row in rows if start_of(row) == start and row["method"] == method]
            if not found:
                continue
            errors = [row["tre_voxels"] for row in found]
            text.append(f"| {start} | {method} | {len(found)} | {percent(sum(map(is_right, found)), len(found))} | {np.median(errors):.2f} | "
                        f"{np.percentile(errors, 95):.1f} | {median_seconds(found)} | {median_seconds(found, 'cpu_seconds')} |")
    text += ["", "| method | verdict | within 1 voxel | not |", "| --- | --- | --- | --- |"]
    for method in methods:
        for verdict in ("aligned", "ambiguous", "failed", ""):
            found = [row for row in rows if row["method"] == method and row["verdict"] == verdict]
            if found:
                text.append(f"| {method} | {verdict or '(gives none)'} | {sum(map(is_right, found))} | {sum(not is_right(row) for row in found)} |")
    return "\n".join(text) + "\n"


def tables_of_bodies(rows):
    """Markdown: how far from the rigid floor, by overlap and start; and what the stated errors and verdicts are worth, for either
    half of the individuals: one served to choose what was to be chosen, the other did not."""
    impossible = [row for row in rows if "impossible" in row]
    rows = [row for row in rows if "excess_mm" in row and row["method"] != "start"]
    methods = in_order(rows)
    text = ["| overlap | start | method | pairs | beyond the floor, mm: median | 90% | worst | lost | aligned, and false | CPU seconds (median) |",
            "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"]
    for overlap in sorted({row["overlap"] for row in rows}, reverse=True):
        for start in sorted({row["start"] for row in rows}, key=lambda name: float(name.split("_")[1][:-3])):
            for method in methods:
                found = [row for row in rows if (row["overlap"], row["start"], row["method"]) == (overlap, start, method)]
                if not found:
                    continue
                excess = np.array([row["excess_mm"] for row in found])
                aligned = [row for row in found if row["verdict"] == "aligned"]
                verdicts = f"{len(aligned)}, {sum(map(is_false, aligned))}" if any(row["verdict"] for row in found) else ""
                text.append(f"| {100 * overlap:.0f}% | {start_of(found[0])} | {method} | {len(found)} | {np.median(excess):.2f} | {np.percentile(excess, 90):.2f} | "
                            f"{excess.max():.2f} | {(excess > LOST_MM).sum()} | {verdicts} | {median_seconds(found, 'cpu_seconds')} |")
    text += ["", "| individuals | method | pairs | error beside what was predicted: median | within twice of it |", "| --- | --- | --- | --- | --- |"]
    for method in methods:
        for half in (1, 0):
            found = [row for row in rows if row["method"] == method and row["individual"] % 2 == half and "predicted_mm" in row
                     and row["excess_mm"] <= LOST_MM]
            if found:
                ratio = np.array([row["tre_rms_mm"] / row["predicted_mm"] for row in found])
                text.append(f"| {'odd' if half else 'even'} | {method} | {len(found)} | {np.median(ratio):.2f} | {percent((ratio <= 2).sum(), len(ratio))} |")
    if impossible:
        text += ["", "| second view | method | pairs | aligned | ambiguous | failed |", "| --- | --- | --- | --- | --- | --- |"]
    for kind, method in sorted({(row["impossible"], row["method"]) for row in impossible}):
        verdicts = [row["verdict"] for row in impossible if (row["impossible"], row["method"]) == (kind, method)]
        text.append(f"| {kind} | {method} | {len(verdicts)} | {verdicts.count('aligned')} | {verdicts.count('ambiguous')} | {verdicts.count('failed')} |")
    return "\n".join(text) + "\n"


LOST_MM = 5.0  # beyond the floor: another pose, not a worse one
FALSE_MM = 2.0


def is_false(row):
    """Whether what was said to be aligned is not: beyond 2 mm of what both volumes show, or of twice the stated error."""
    return row["beside_floor_mm"] > FALSE_MM or row["beside_floor_mm"] > 2 * row.get("predicted_mm", np.inf)


def size_of(row):
    """Degrees and mm of the start's error; nothing where the truth is not known."""
    return (round(row["start_degrees"]), round(row["start_mm"])) if "start_degrees" in row else None


def against_start(axes, rows, methods):
    """Success and time, over the size of the start's error."""
    rows = [row for row in rows if "start_degrees" in row]
    sizes = sorted({size_of(row) for row in rows})
    for method in methods:
        groups = [[row for row in rows if row["method"] == method and size_of(row) == size] for size in sizes]
        right = [100 * np.mean([is_right(row) for row in group]) if group else np.nan for group in groups]
        colour = colour_of(method, methods)
        axes[0].plot(range(len(sizes)), right, "o-", color=colour, label=method)
        if method != "start":
            axes[1].plot(range(len(sizes)), [float(median_seconds(group, "cpu_seconds") or "nan") for group in groups], "o-", color=colour)
    for one in axes:
        one.set_xticks(range(len(sizes)), [f"{degrees}°\n{mm} mm" for degrees, mm in sizes], fontsize=8)
        one.set_xlim(-0.5, len(sizes) - 0.5)
        one.set_xlabel("error of the start")
    axes[0].set_ylabel("within 1 voxel, %")
    axes[0].set_ylim(-3, 103)
    axes[1].set_ylabel("CPU seconds, median")
    axes[1].set_ylim(bottom=0)


def usual_start(rows):
    """The size of start that most methods have met in most cases, the larger of equals."""
    sizes = {size_of(row) for row in rows} - {None}
    return max(sizes, key=lambda size: (sum(size_of(row) == size for row in rows), size), default=None)


def against_property(axis, rows, name, methods):
    """Each run a dot, over a property; only cases that are plain in everything else, from one size of start. The line is the
    median."""
    def plain_otherwise(row):
        return all(row.get(key, value) == value for key, value in PLAIN.items() if key not in (name, "gain_db"))

    size = usual_start(rows)
    rows = [row for row in rows if name in row and plain_otherwise(row) and (size is None or size_of(row) == size)]
    values = sorted({row[name] for row in rows})
    axis.set_xticks(range(len(values)), ["none" if name == "noise_db" and value <= -120 else f"{value:g}" for value in values])
    for number, method in enumerate(methods):
        found = [[max(row["tre_voxels"], 1e-3) for row in rows if row["method"] == method and row[name] == value] for value in values]
        shift = 0.08 * (number - (len(methods) - 1) / 2)
        colour = colour_of(method, methods)
        for place, errors in enumerate(found):
            axis.plot([place + shift] * len(errors), errors, "o", color=colour, markersize=4)
        medians = [(place + shift, np.median(errors)) for place, errors in enumerate(found) if errors]
        if medians:
            axis.plot(*zip(*medians), "-", color=colour, linewidth=1.2)
    axis.set_xlim(-0.5, len(values) - 0.5)
    axis.axhline(1, color="#bbbbbb", linewidth=0.8)
    axis.set_yscale("log")
    axis.set_xlabel(AGAINST[name])
    axis.set_ylabel("TRE, voxels" + (f" (start {size[0]}°, {size[1]} mm)" if size else ""))


def plot_results(path, rows):
    methods = in_order(rows)
    names = [name for name in AGAINST if len({row[name] for row in rows if name in row}) > 1]
    panels = 2 + len(names)
    columns = min(panels, 4)
    figure, axes = plt.subplots(-(-panels // columns), columns, figsize=(4.0 * columns, 3.3 * -(-panels // columns)), squeeze=False)
    axes = axes.ravel()
    against_start(axes, rows, methods)
    for axis, name in zip(axes[2:], names):
        against_property(axis, rows, name, [method for method in methods if method != "start"])
    for axis in axes[panels:]:
        axis.set_axis_off()
    handles, labels = axes[0].get_legend_handles_labels()
    for axis in axes[:panels]:
        axis.spines[["top", "right"]].set_visible(False)
    figure.tight_layout(rect=(0, 0.06, 1, 1))
    figure.legend(handles, labels, loc="lower center", ncol=len(labels), frameon=False)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def plot_bodies(path, rows):
    """Of bodies: each answer a dot, beyond the floor, over the overlap, one panel for a size of start; and the median of processor time."""
    methods = [method for method in in_order(rows) if method != "start"]
    overlaps = sorted({row["overlap"] for row in rows}, reverse=True)
    sizes = sorted({size_of(row) for row in rows if row["method"] != "start"})
    figure, axes = plt.subplots(1, len(sizes) + 1, figsize=(4.6 * (len(sizes) + 1), 3.6), squeeze=False)
    for number, method in enumerate(methods):
        colour, shift = colour_of(method, methods), 0.12 * (number - (len(methods) - 1) / 2)
        for axis, size in zip(axes[0], sizes):
            groups = [[max(row["excess_mm"], 0.01) for row in rows if (row["method"], size_of(row), row["overlap"]) == (method, size, overlap)]
                      for overlap in overlaps]
            for place, errors in enumerate(groups):
                axis.plot([place + shift] * len(errors), errors, "o", color=colour, markersize=3, alpha=0.7)
            axis.plot(range(len(overlaps)), [np.median(errors) if errors else np.nan for errors in groups], "-", color=colour, label=method)
            axis.set_yscale("log")
            axis.set_ylabel("beyond the rigid floor, mm")
            axis.set_title(f"start {size[0]}°, {size[1]} mm", fontsize=10)
        seconds = [[row["cpu_seconds"] for row in rows if row["method"] == method and row["overlap"] == overlap] for overlap in overlaps]
        axes[0, -1].plot(range(len(overlaps)), [np.median(one) if one else np.nan for one in seconds], "o-", color=colour)
    axes[0, -1].set_ylabel("CPU seconds, median")
    axes[0, -1].set_ylim(bottom=0)
    for axis in axes[0]:
        axis.set_xticks(range(len(overlaps)), [f"{100 * overlap:.0f}%" for overlap in overlaps])
        axis.set_xlabel("overlap")
        axis.spines[["top", "right"]].set_visible(False)
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.tight_layout(rect=(0, 0.08, 1, 1))
    figure.legend(handles, labels, loc="lower center", ncol=len(labels), frameon=False)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def two_colours(first, second, points):
    """Orange and blue that add up to grey where both agree; what is not real is white, what only one sees keeps its colour."""
    values = [volume.at(points) for volume in (first, second)]
    picture = np.zeros(points.shape[:-1] + (3,))
    for grey, tint in zip(values, ((1.0, 0.55, 0.1), (0.0, 0.45, 0.9))):
        picture += np.where(np.isfinite(grey), np.clip(grey / 190, 0, 1), 0)[..., np.newaxis] * tint
    seen = np.isfinite(values[0]) | np.isfinite(values[1])
    return np.where(seen[..., np.newaxis], np.clip(picture, 0, 1), 1.0)


def plot_slices(path, case, rows):
    """Slices through one pair as each contestant places it (dissertation, figure 4.14), with the score."""
    first, second = (Volume.read(file) for file in case.files)
    shown = [(row["method"], np.array(row["motion"]), row["tre_mm"]) for row in rows]
    shown.append(("truth", case.truth, 0.0))
    low, high = first.real_box()
    low2, high2 = second.moved(case.truth).real_box()
    low, high = np.minimum(low, low2), np.maximum(high, high2)
    middle = 0.5 * (np.maximum(first.real_box()[0], low2) + np.minimum(first.real_box()[1], high2))
    across, down = np.arange(low[0], high[0], 0.7), np.arange(low[2], high[2], 0.7)
    x, z = np.meshgrid(across, down)
    points = np.stack([x, np.full_like(x, middle[1]), z], axis=-1)
    columns = 3
    figure, axes = plt.subplots(-(-len(shown) // columns), columns, figsize=(4.3 * columns, 3.4 * -(-len(shown) // columns)), squeeze=False)
    for axis in axes.ravel():
        axis.set_axis_off()
    for axis, (name, motion, score) in zip(axes.ravel(), shown):
        axis.imshow(two_colours(first, second.moved(motion), points), interpolation="bilinear")
        axis.set_title(f"{name}: {score:.2f} mm" if name != "truth" else "truth: 0 mm", fontsize=11)
    figure.tight_layout()
    figure.savefig(path, dpi=100)
    plt.close(figure)


def plot_scores(path, rows, truth):
    """The scores of the same pair as bars (dissertation, figure 4.15)."""
    methods = [row["method"] for row in rows] + (["truth"] if truth else [])
    scores = [row["tre_mm"] for row in rows] + ([0.0] if truth else [])
    figure, axis = plt.subplots(figsize=(6.5, 0.6 + 0.36 * len(methods)))
    bars = axis.barh(methods, scores, color=[colour_of(method, methods) for method in methods])
    axis.bar_label(bars, [f"{score:.2f}" for score in scores], fontsize=9, padding=2)
    axis.invert_yaxis()
    axis.set_xscale("log")
    axis.set_xlim(0.05, 3 * max(scores))
    axis.set_xlabel("score: mean distance, mm")
    axis.spines[["top", "right"]].set_visible(False)
    figure.tight_layout()
    figure.savefig(path, dpi=100)
    plt.close(figure)


def plot(folder, rows, out, show=None):
    """Writes table.md, results.png, and, for a pair with truth, slices.png and scores.png."""
    if not rows:
        raise ValueError(f"{folder}: there are no results; run comes first")
    out = pathlib.Path(out)
    out.mkdir(parents=True, exist_ok=True)
    bodies = [row for row in rows if "scan" in row]
    if bodies:
        (out / "bodies.md").write_text(tables_of_bodies(bodies))
    rows = [row for row in rows if "impossible" not in row]
    if not rows:
        return
    (out / "table.md").write_text(tables(rows))
    bodies = [row for row in rows if "scan" in row and "excess_mm" in row]
    if bodies:
        plot_bodies(out / "bodies.png", bodies)
    if any("scan" not in row for row in rows):
        plot_results(out / "results.png", [row for row in rows if "scan" not in row])
    pairs = [f"{row['case']}/{row['start']}" for row in rows]
    show = show or next((pair for pair in pairs if pair.startswith("plain/") and "20deg" in pair), pairs[0])
    shown = [row for row, pair in zip(rows, pairs) if pair == show]
    if not shown:
        raise ValueError(f"--show {show}: there is no such pair; there are {', '.join(sorted(set(pairs)))}")
    order = in_order(shown)
    shown.sort(key=lambda row: order.index(row["method"]))
    case = Case(pathlib.Path(folder) / shown[0]["case"]) if (pathlib.Path(folder) / shown[0]["case"]).is_dir() else Case(folder)
    if case.truth is not None:
        plot_slices(out / "slices.png", case, shown)
        plot_scores(out / "scores.png", shown, truth=True)
    print((out / "table.md").read_text())
