# SPDX-License-Identifier: BSD-3-Clause
"""SeedsPolhemus.py DIR: a second of records in every form, behind the byte that chooses the form, for the fuzzer to start from."""
import math
import struct
import sys
from pathlib import Path

folder = Path(sys.argv[1])
for choice in range(64):
    ascii_, liberty, distortion, twofold, single = (choice >> bit & 1 for bit in range(5))
    stations = (1, 2) if choice & 32 else (2,)
    stream = bytes([choice])
    for frame in range(6):
        for station in stations:
            angle = 0.1 * frame
            counters = [5000 + 17 * frame] if twofold or single else []
            counters += [frame] if twofold else []
            counters += [3] if (twofold or single) and distortion else []
            position = [10.0 + frame, -5.25, 0.5]
            quaternion = [math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)]
            euler = [math.degrees(angle), 0.0, 0.0]
            if ascii_:
                line = f"{station:2d} " + "".join(f"{n} " for n in counters)
                line += "".join(f"{v:14.6E} " for v in position) + "".join(f"{v:8.5f} " for v in quaternion)
                if twofold:
                    line += "".join(f"{v:7.2f} " for v in position) + "".join(f"{v:14.6E} " for v in euler)
                stream += line.encode() + b"\r\n"
            else:
                numbers = position + quaternion + (position + euler if twofold else [])
                body = struct.pack(f"<{len(counters)}I{len(numbers)}f", *counters, *numbers) + b"\r\n"
                stream += (b"LY" if liberty else b"PA") + struct.pack("<BcBBH", station, b"C", 0, 0, len(body)) + body
    (folder / f"form{choice:02d}").write_bytes(stream)
(folder / "reply").write_bytes(b"\0PA" + struct.pack("<BBBBH", 1, 0x16, 0, 0, 4) + b"PATR")
