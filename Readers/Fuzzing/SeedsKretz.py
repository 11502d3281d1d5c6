# SPDX-License-Identifier: BSD-3-Clause
"""SeedsKretz.py DIR: small GE Kretz files, whole and broken in one place."""
import struct
import sys
from pathlib import Path

folder = Path(sys.argv[1])


def item(group, element, value):
    return struct.pack("<HHI", group, element, len(value)) + value


def kretz(fan=(1.5, 1.6, 1.7), sweep=(1.4, 1.6), samples=bytes(range(24)), extra=b"", resolution=5e-4):
    text = b"KRETZFILE 1.0   " + item(0x0130, 1, b"RIC6-12-D\0") + item(0x0010, 0x22, struct.pack("<d", 0.5))
    for axis, size in enumerate((4, 3, 2)):
        text += item(0xC000, axis + 1, struct.pack("<H", size))
    text += item(0xC100, 1, struct.pack("<d", resolution))
    for element, radius in ((1, 50), (2, -8), (4, 22)):
        text += item(0xC200, element, struct.pack("<d", radius))
    if fan:
        text += item(0xC300, 1, struct.pack(f"<{len(sweep)}d", *sweep)) + item(0xC300, 2, struct.pack(f"<{len(fan)}d", *fan))
    return text + extra + (item(0xD000, 1, samples) if samples else b"") + item(0xFFFF, 0xFFFF, b"")


movie = item(0xD400, 1, struct.pack("<I", 2)) + item(0xD400, 5, struct.pack("<2d", 0, 0.1)) + item(0xD600, 1, bytes(48))
seeds = {
    "even": kretz(),
    "uneven": kretz(fan=(1.5, 1.55, 1.7)),
    "voxels": kretz(fan=()),
    "movie": kretz(samples=b"", extra=movie),
    "cut": kretz()[:-20],
    "fine": kretz(resolution=1e-7),
}
for name, content in seeds.items():
    (folder / name).write_bytes(content)
