#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""synthesis_speckle_figures.py ECHOES.jsonl FOLDER: what speckle and the point spread are like, as a picture in FOLDER.

ECHOES.jsonl is what the benchmark `echoes` wrote (./run bench echoes: build/bench/echoes.jsonl). To the left the
signal-to-noise ratio of the envelope against the number of scatterers in the resolution cell; in the middle and to the right
the echo of a point across the beam and along it, ours and Rayleigh's integral over the aperture.
"""
import argparse
import json
import pathlib
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

COLOURS = ["#0b5e8a", "#b0763b", "#6f8f5f"]


def decibels(values):
    values = np.asarray(values)
    return 20 * np.log10(np.maximum(values / values.max(), 1e-6))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("echoes", type=pathlib.Path)
    parser.add_argument("folder", type=pathlib.Path)
    options = parser.parse_args()
    lines = [json.loads(text) for text in options.echoes.read_text().splitlines() if text.strip()]
    statistics = [line for line in lines if line.get("case") == "speckle statistics"]
    spreads = [line for line in lines if line.get("case") == "point spread"]
    if not statistics or not spreads:
        sys.exit(f"synthesis_speckle_figures: {options.echoes} has no speckle statistics or no point spread; run the benchmark echoes")

    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.4))
    left.semilogx([line["per_cell"] for line in statistics], [line["snr"] for line in statistics], "o-", color=COLOURS[0],
                  label="synthesised")
    left.axhline(1.9131, color="0.5", ls="--", lw=1, label="Rayleigh: 1.913")
    left.set(xlabel="scatterers in the resolution cell", ylabel="mean / deviation of the envelope", ylim=(0.8, 2.05))
    left.legend(fontsize=8)
    for colour, line in zip(COLOURS, spreads):
        depth = f"{line['depth_mm']:g} mm"
        middle.plot(line["across_mm"], decibels(line["lateral"]), color=colour, label=depth)
        middle.plot(line["across_mm"], decibels(line["rayleigh_lateral"]), color=colour, ls=":", lw=2)
        right.plot(line["along_mm"], decibels(line["pulse"]), color=colour, label=depth)
        right.plot(line["along_mm"], decibels(line["rayleigh_pulse"]), color=colour, ls=":", lw=2)
    middle.set(xlabel="mm beside the axis", ylabel="dB", ylim=(-40, 1), xlim=(0, None))
    right.set(xlabel="mm of depth", ylim=(-40, 1))
    middle.legend(fontsize=8, title="depth (dotted: Rayleigh)", title_fontsize=8)
    figure.tight_layout()
    options.folder.mkdir(parents=True, exist_ok=True)
    figure.savefig(options.folder / "speckle.png", dpi=90)


if __name__ == "__main__":
    main()
