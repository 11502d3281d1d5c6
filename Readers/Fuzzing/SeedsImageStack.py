# SPDX-License-Identifier: BSD-3-Clause
"""SeedsImageStack.py DIR: small PNG and TIFF images made by hand, and a JPEG of 8 x 8 pixels."""
import struct
import sys
import zlib
from pathlib import Path

folder = Path(sys.argv[1])


def chunk(name, data):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def png(bits=8, color=0, interlace=0):
    row = 3 * {0: 1, 2: 3, 4: 2, 6: 4}[color] * bits // 8
    data = zlib.compress(b"".join(b"\0" + bytes(range(row)) for _ in range(2)))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 3, 2, bits, color, 0, 0, interlace)) +
            chunk(b"pHYs", struct.pack(">IIB", 5000, 5000, 1)) + chunk(b"IDAT", data) + chunk(b"IEND", b""))


def tiff(pages=1, bits=8, end="<"):
    description = b"ImageJ=1.53t\nimages=2\nslices=2\nunit=mm\nspacing=0.5\n\0"
    pixels = bytes(6 * bits // 8)
    content = (b"II*\0" if end == "<" else b"MM\0*") + bytes(4) + pixels + description
    link = 4
    for _ in range(pages):
        at = len(content) + len(content) % 2
        content = content.ljust(at, b"\0")
        tags = [(256, 4, 1, 3), (257, 4, 1, 2), (258, 3, 1, bits), (259, 3, 1, 1), (262, 3, 1, 1),
                (270, 2, len(description), 8 + len(pixels)), (273, 4, 1, 8), (277, 3, 1, 1), (278, 4, 1, 2), (279, 4, 1, len(pixels))]
        directory = struct.pack(end + "H", len(tags))
        for tag, kind, count, value in tags:
            packed = struct.pack(end + "H2x", value) if kind == 3 else struct.pack(end + "I", value)
            directory += struct.pack(end + "HHI", tag, kind, count) + packed
        content = content[:link] + struct.pack(end + "I", at) + content[link + 4:]
        link = at + len(directory)
        content += directory + bytes(4)
    return content


seeds = {"grey8.png": png(), "grey16.png": png(16), "rgb.png": png(8, 2), "rgba.png": png(8, 6), "one.tif": tiff(),
         "two.tif": tiff(2), "sixteen.tif": tiff(1, 16), "big.tif": tiff(2, 8, ">")}
try:
    import io
    from PIL import Image
    for name, kind in [("grey.jpg", "JPEG"), ("lzw.tif", "TIFF")]:
        stream = io.BytesIO()
        image = Image.frombytes("L", (8, 8), bytes(range(64)))
        image.save(stream, kind, **({"compression": "tiff_lzw"} if kind == "TIFF" else {}))
        seeds[name] = stream.getvalue()
except ImportError:
    pass  # the others suffice to begin with
for name, content in seeds.items():
    (folder / name).write_bytes(content)
