# SPDX-License-Identifier: BSD-3-Clause
"""SeedsImageStack.py DIR: small PNG, JPEG and TIFF images of 3 x 2 pixels, made by hand."""
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


IMAGEJ = b"ImageJ=1.53t\nimages=%d\nslices=2\nunit=mm\nspacing=0.5\n"
OME = b'<OME SizeZ="2" PhysicalSizeX="50" PhysicalSizeY="0.05" PhysicalSizeYUnit="mm" PhysicalSizeZUnit="\xc2\xb5m">'


def tiff(pages=1, bits=8, end="<", description=None, samples=1, tile=None, pixels=None, **others):
    """others: values of tags by their names in the table below; tile: its size; pixels: as they are stored."""
    description = (description or IMAGEJ % pages) + b"\0"
    pixels = pixels or bytes(samples * bits // 8 * (tile[0] * tile[1] if tile else 6))
    content = (b"II*\0" if end == "<" else b"MM\0*") + bytes(4) + pixels + description
    names = {"compression": 259, "photometric": 262, "orientation": 274, "planar": 284, "unit": 296, "format": 339}
    short = {258: bits, 259: 1, 262: 1, 277: samples, **{names[name]: value for name, value in others.items()}}
    place = {322: tile[0], 323: tile[1], 324: 8, 325: len(pixels)} if tile else {273: 8, 278: 2, 279: len(pixels)}
    long = {256: 3, 257: 2, **place}
    tags = [(tag, struct.pack(end + "HIH2x", 3, 1, value)) for tag, value in short.items()]
    tags += [(tag, struct.pack(end + "HII", 4, 1, value)) for tag, value in long.items()]
    tags.append((270, struct.pack(end + "HII", 2, len(description), 8 + len(pixels))))
    link = 4
    for _ in range(pages):
        content += bytes(len(content) % 2)
        content = content[:link] + struct.pack(end + "I", len(content)) + content[link + 4:]
        content += struct.pack(end + "H", len(tags))
        content += b"".join(struct.pack(end + "H", tag) + value for tag, value in sorted(tags))
        link = len(content)
        content += bytes(4)
    return content


def segment(kind, *data):
    content = b"".join(data)
    return struct.pack(">BBH", 0xFF, kind, 2 + len(content)) + content


def jpeg(components=1, orientation=None):
    """All grey: each block is coded by one bit of zero for its mean and another for the rest."""
    exif = b"Exif\0\0MM\0*" + struct.pack(">IHHHIHxx", 8, 1, 274, 3, 1, orientation or 1)
    bits = (1 << 8 - 2 * components) - 1
    return (b"\xff\xd8" + segment(0xE0, b"JFIF\0", struct.pack(">HBHHBB", 0x101, 2, 100, 100, 0, 0)) +
            (segment(0xE1, exif) if orientation else b"") + segment(0xDB, b"\0", b"\1" * 64) +
            segment(0xC0, struct.pack(">BHHB", 8, 2, 3, components), *(bytes([c + 1, 0x11, 0]) for c in range(components))) +
            segment(0xC4, b"\0\1", bytes(16)) + segment(0xC4, b"\x10\1", bytes(16)) +
            segment(0xDA, bytes([components]), *(bytes([c + 1, 0]) for c in range(components)), b"\0\x3f\0") +
            bytes([bits]) + b"\xff\xd9")


seeds = {"grey8.png": png(), "grey16.png": png(16), "rgb.png": png(8, 2), "rgba.png": png(8, 6), "one.tif": tiff(),
         "two.tif": tiff(2), "sixteen.tif": tiff(1, 16), "big.tif": tiff(2, 8, ">"), "ome.tif": tiff(2, description=OME),
         "channels.tif": tiff(2, description=IMAGEJ.replace(b"slices", b"channels") % 2), "rgb.tif": tiff(samples=3, photometric=2),
         "inverted.tif": tiff(1, 16, photometric=0), "signed.tif": tiff(1, 16, format=2),
         "float.tif": tiff(1, 32, ">", format=3), "long.tif": tiff(1, 32, format=2, unit=3), "tiles.tif": tiff(tile=(16, 16)), "turned.tif": tiff(orientation=6),
         "apart.tif": tiff(samples=3, photometric=2, planar=2), "packed.tif": tiff(compression=32773, pixels=b"\xfe\7" * 2),
         "deflated.tif": tiff(compression=8, pixels=zlib.compress(bytes(6))),
         "lzw.tif": tiff(compression=5, pixels=b"\x80\0\x20\x50\x38\x08"),
         "jpeg.tif": tiff(samples=3, compression=7, photometric=6, pixels=jpeg(3)), "grey.jpg": jpeg(), "colour.jpg": jpeg(3),
         "four.jpg": jpeg(4), "turned.jpg": jpeg(orientation=6), "upright.jpg": jpeg(3, 1)}
for name, content in seeds.items():
    (folder / name).write_bytes(content)
