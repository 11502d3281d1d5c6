# SPDX-License-Identifier: BSD-3-Clause
"""SeedsOpenIgtLink.py DIR: messages of each kind, whole, cut and in a row, for the fuzzer to start from. Check sums are zero: the
fuzzer does not look at them when the first byte says so."""
import struct
import sys
from pathlib import Path

folder = Path(sys.argv[1])


def message(kind, content, version=1, meta=(), device="ProbeToTracker", size=None):
    if version > 1:
        index = struct.pack(">H", len(meta)) if meta else b""
        text = b""
        for key, value in meta:
            index += struct.pack(">HHI", len(key), 3, len(value))
            text += (key + value).encode()
        content = struct.pack(">HHII", 12, len(index), len(text), 5) + content + index + text
    return struct.pack(">H12s20sIIQQ", version, kind.encode(), device.encode(), 1700000000, 1 << 30,
                       len(content) if size is None else size, 0) + content


unit = struct.pack(">12f", 1, 0, 0, 0, 1, 0, 0, 0, 1, 10, 20, 30)


def image(scalar=4, endian=2, axes=1, size=(3, 2, 2), part=(3, 2, 2), offset=(0, 0, 0), steps=(1, 0, 0, 0, 1, 0, 0, 0, 1, 5, 6, 7)):
    width = {2: 1, 3: 1, 4: 2, 5: 2, 6: 4, 7: 4, 10: 4, 11: 8}[scalar]
    return message("IMAGE", struct.pack(">HBBBB3H12f3H3H", 1, 1, scalar, endian, axes, *size, *steps, *offset, *part)
                   + bytes(range(part[0] * part[1] * part[2] * width)), device="Volume")


seeds = {
    "transform": message("TRANSFORM", unit),
    "status2": message("TRANSFORM", unit, 2, [("TransformStatus", "OUT_OF_VIEW"), ("TransformValid", "False")]),
    "status3": message("TRANSFORM", unit, 3, [("TransformValid", "1")]),
    "tdata": message("TDATA", b"".join(struct.pack(">20sBB", name, 2, 0) + unit for name in (b"Probe", b"ReferenceToTracker"))),
    "position": message("POSITION", struct.pack(">7f", 1, 2, 3, 0, 0, 0, 1)),
    "position24": message("POSITION", struct.pack(">6f", 1, 2, 3, 0.6, 0, 0)),
    "position12": message("POSITION", struct.pack(">3f", 1, 2, 3)),
    "status": message("STATUS", struct.pack(">Hq20s", 13, 0, b"NotReady") + b"warming up\0"),
    "start": message("STT_TDATA", struct.pack(">i32s", 50, b"Patient")),
    "stop": message("STP_TDATA", b""),
    "get": message("GET_STATUS", b""),
    "other": message("SENSOR", bytes(40)),
    "large": message("IMAGE", unit, size=1 << 31),
    "image": image(),
    "image_big": image(scalar=5, endian=1, axes=2),
    "image_part": image(scalar=11, size=(9, 8, 7), offset=(2, 3, 4)),
    "image_mirrored": image(scalar=3, steps=(1, 0, 0, 0, 1, 0, 0, 0, -1, 5, 6, 7)),
    "image_flat": image(scalar=3, size=(3, 2, 1), part=(3, 2, 1), steps=(1, 0, 0, 0, 1, 0, 0, 0, 0, 5, 6, 7)),
}
seeds["row"] = b"".join(seeds[name] for name in ("transform", "image", "other", "status2", "tdata"))
for name, content in seeds.items():
    for how in (0x3f, 0x40):
        (folder / f"{name}_{how:02x}").write_bytes(bytes([how]) + content)
(folder / "cut").write_bytes(bytes([0x3f]) + seeds["row"][:-30])
