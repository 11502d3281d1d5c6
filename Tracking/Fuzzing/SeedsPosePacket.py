# SPDX-License-Identifier: BSD-3-Clause
"""SeedsPosePacket.py DIR: pose packets as documented, written by a second hand, for the fuzzer to start from."""
import struct
import sys
import zlib
from pathlib import Path

folder = Path(sys.argv[1])


def packet(poses, doubles=1, version=1, session=7, sequence=1, time=1.5e9):
    body = b"EPPK" + struct.pack("<HHQQdH", version, doubles, session, sequence, time, len(poses))
    for name, status, numbers in poses:
        body += bytes([len(name)]) + name + bytes([status]) + struct.pack("<7d" if doubles else "<7f", *numbers)
    return body + struct.pack("<I", zlib.crc32(body))


probe = (b"ProbeToTracker", 0, [1.0, -2.0, 3.5, 0.6, 0.8, 0.0, 0.0])
stylus = (b"Stylus", 2, [1e3, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
gone = (b"Reference", 1, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
seeds = {
    "one": packet([probe]),
    "floats": packet([probe, stylus, gone], doubles=0),
    "three": packet([probe, stylus, gone]),
    "full": packet([(bytes([65 + i]), 0, probe[2]) for i in range(22)]),
    "next": packet([probe], version=2),
    "none": packet([]),
    "twice": packet([probe, probe]),
}
for name, content in seeds.items():
    (folder / name).write_bytes(content)
