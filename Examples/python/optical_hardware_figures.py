#!/usr/bin/python3
# SPDX-License-Identifier: BSD-3-Clause
"""optical_hardware_figures.py [FOLDER]: the circuit of the optical tracker's lights as a picture in FOLDER, and the numbers of its page: currents,
and what reaches an eye beside what IEC 62471 allows.
"""
import argparse
import math
import pathlib

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.patches import Polygon, Rectangle

SUPPLY, FORWARD, RESISTOR = 5.0, 1.35, 100.0  # V, V, ohm
INTENSITY = 0.020 / 0.020  # W/sr per A: a narrow 5 mm LED of 20 mW/sr at 20 mA, on its axis
SAFETY = 2.0  # by how much a better one may be brighter than typical
DOME = 5e-3  # m
SMALLEST, LARGEST = 0.011, 0.1  # rad: of a source, as IEC 62471 takes it for long times


def current(supply, forward, resistor):
    return (supply - forward) / resistor


def print_numbers():
    typical = current(SUPPLY, FORWARD, RESISTOR)
    worst = current(1.05 * SUPPLY, 1.1, 0.95 * RESISTOR)
    print(f"for 40 mA: {(SUPPLY - FORWARD) / 0.04:.1f} ohm; {RESISTOR:g} ohm: {1e3 * typical:.1f} mA, {1e3 * typical**2 * RESISTOR:.0f} mW in it;"
          f" at worst {1e3 * worst:.1f} mA, {1e3 * worst**2 * RESISTOR:.0f} mW")
    print(f"mean currents: {1e3 * typical * 6 / 9:.1f} and {1e3 * typical * 5 / 9:.1f} mA")
    intensity = SAFETY * INTENSITY * worst
    print(f"radiant intensity {1e3 * intensity:.0f} mW/sr; 100 W/m2 at {1e3 * math.sqrt(intensity / 100):.0f} mm")
    for wavelength in (920, 940, 950):
        print(f"R({wavelength} nm) = {10 ** ((700 - wavelength) / 500):.3f}")
    weight = 10 ** ((700 - 920) / 500)
    for mm in (200, 100, 50):
        irradiance = intensity / (1e-3 * mm) ** 2
        dome = DOME / (1e-3 * mm)
        # Where it looks largest, its dome; where it looks smallest, a point, which an eye that moves spreads over 0.011 rad.
        rows = [("dome", intensity / (math.pi / 4 * DOME**2), min(max(dome, SMALLEST), LARGEST)),
                ("point", irradiance / (math.pi / 4 * SMALLEST**2), SMALLEST)]
        text = ", ".join(f"{name} {weight * radiance:.0f} of {6000 / size:.0f} W/m2/sr ({6000 / size / (weight * radiance):.0f} times below)"
                         for name, radiance, size in rows)
        print(f"{mm} mm: {irradiance:.2f} W/m2, {100 / irradiance:.1f} times below 100; {text}")
    touching = typical * FORWARD / (math.pi / 4 * 7e-3**2)
    print(f"all its electrical power in a pupil of 7 mm: {touching:.0f} W/m2, allowed for {(18000 / touching) ** (4 / 3):.0f} s")


class Drawing:
    def __init__(self, axes):
        self.axes = axes

    def wire(self, *points):
        self.axes.plot(*zip(*points), color="black", linewidth=1.3, solid_capstyle="round")

    def dot(self, x, y):
        self.axes.plot([x], [y], "o", color="black", markersize=4)

    def text(self, x, y, text, **options):
        self.axes.text(x, y, text, **{"ha": "left", "va": "center", "fontsize": 9, **options})

    def resistor(self, x, y, name, upright=True):
        width, height = (0.24, 0.8) if upright else (0.8, 0.24)
        self.axes.add_patch(Rectangle((x - width / 2, y - height / 2), width, height, fill=False, linewidth=1.3))
        if upright:
            self.text(x + 0.22, y, name)
        else:
            self.text(x, y + 0.32, name, ha="center")

    def ground(self, x, y):
        for i, half in enumerate((0.24, 0.15, 0.06)):
            self.wire((x - half, y - 0.09 * i), (x + half, y - 0.09 * i))

    def led(self, x, y, name):
        """Anode above."""
        self.axes.add_patch(Polygon([(x - 0.24, y + 0.22), (x + 0.24, y + 0.22), (x, y - 0.2)], closed=True, fill=False, linewidth=1.3))
        self.wire((x - 0.24, y - 0.2), (x + 0.24, y - 0.2))
        for shift in (0.12, -0.1):
            self.axes.annotate("", (x - 0.72, y + 0.24 + shift), (x - 0.36, y + 0.02 + shift), arrowprops={"arrowstyle": "->", "lw": 1})
        self.text(x + 0.36, y, name)

    def mosfet(self, x, y, name):
        """N-channel, enhancement: the gate at (x - 0.55, y), the drain above x, the source below."""
        self.wire((x - 0.55, y), (x - 0.38, y))
        self.wire((x - 0.38, y - 0.32), (x - 0.38, y + 0.32))
        for part in (-0.26, 0.0, 0.26):
            self.wire((x - 0.28, y + part - 0.1), (x - 0.28, y + part + 0.1))
        self.wire((x - 0.28, y + 0.26), (x, y + 0.26), (x, y + 0.5))
        self.wire((x - 0.28, y - 0.26), (x, y - 0.26), (x, y - 0.5))
        self.wire((x, y), (x, y - 0.26))
        self.axes.annotate("", (x - 0.28, y), (x + 0.02, y), arrowprops={"arrowstyle": "-|>", "lw": 1.2, "color": "black", "shrinkA": 0, "shrinkB": 0})
        self.text(x + 0.14, y + 0.12, name)


def draw(path):
    figure, axes = plt.subplots(figsize=(10.5, 5.4))
    d = Drawing(axes)
    top, gate, bottom = 5.0, 1.6, 0.2
    axes.add_patch(Rectangle((-0.3, bottom - 0.3), 1.5, top - bottom + 0.7, facecolor="#eef2f6", edgecolor="black", linewidth=1.3))
    d.text(0.45, top + 0.65, "Raspberry Pi", ha="center", fontsize=10, fontweight="bold")
    pins = {"5 V (2)": top, "GPIO17 (11)": gate + 1.6, "GPIO27 (13)": gate + 0.8, "GPIO22 (15)": 0.75, "GND (9)": bottom}
    for name, y in pins.items():
        d.text(1.1, y, name, ha="right", fontsize=8.5)
    d.wire((1.2, top), (9.0, top))  # +5 V
    d.wire((1.2, bottom), (9.8, bottom))  # ground
    d.ground(9.8, bottom)
    for light, (x, y) in enumerate(((5.0, gate + 1.6), (9.0, gate + 0.8))):
        # From the pin to the gate, below the drains.
        d.wire((1.2, y), (x - 2.5, y), (x - 2.5, gate), (x - 2.15, gate))
        d.resistor(x - 1.75, gate, "220 Ω", upright=False)
        d.wire((x - 1.35, gate), (x - 0.55, gate))
        d.dot(x - 1.0, gate)
        d.wire((x - 1.0, gate), (x - 1.0, 1.3))
        d.resistor(x - 1.0, 0.9, "10 kΩ")
        d.wire((x - 1.0, 0.5), (x - 1.0, bottom))
        d.dot(x - 1.0, bottom)
        d.mosfet(x, gate, "AO3400A")
        d.wire((x, gate - 0.5), (x, bottom))
        d.dot(x, bottom)
        d.wire((x, gate + 0.5), (x, 2.65))
        d.led(x, 2.85, f"light {light}, in\n{('the probe', 'the needle')[light]}\'s tip\n940 nm")
        d.wire((x, 3.07), (x, 3.7))
        d.resistor(x, 4.1, f"{RESISTOR:g} Ω, ¼ W")
        d.wire((x, 4.5), (x, top))
        d.dot(x, top)
    y = pins["GPIO22 (15)"]
    d.wire((1.2, y), (1.35, y))
    d.resistor(1.75, y, "1 kΩ", upright=False)
    d.wire((2.15, y), (2.35, y))
    d.text(2.42, y, "camera's\ntrigger\n(if it has one)", fontsize=8)
    axes.set_xlim(-0.6, 10.9)
    axes.set_ylim(-0.3, 5.9)
    axes.set_aspect("equal")
    axes.axis("off")
    figure.savefig(path, dpi=110, bbox_inches="tight")
    plt.close(figure)


def main():
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("folder", nargs="?", default=".", type=pathlib.Path)
    given = arguments.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    print_numbers()
    draw(given.folder / "optical-hardware.png")
    print(given.folder / "optical-hardware.png")


if __name__ == "__main__":
    main()
