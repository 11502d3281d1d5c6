# SPDX-License-Identifier: BSD-3-Clause
"""SeedsDicom.py DIR: small DICOM files of each kind that is read, element by element."""
import struct
import sys
import zlib
from pathlib import Path

folder = Path(sys.argv[1])
UNDEFINED = 0xFFFFFFFF


def tag(group, element):
    return struct.pack("<HH", group, element)


def explicit(group, element, kind, value, length=None):
    if len(value) % 2:
        value += b"\0" if kind in ("UI", "OB") else b" "
    length = len(value) if length is None else length
    head = kind.encode() + (struct.pack("<xxI", length) if kind in ("OB", "OW", "SQ", "UN", "UT") else struct.pack("<H", length))
    return tag(group, element) + head + value


def implicit(group, element, kind, value, length=None):
    if len(value) % 2:
        value += b" "
    return tag(group, element) + struct.pack("<I", len(value) if length is None else length) + value


def item(value):
    return tag(0xFFFE, 0xE000) + struct.pack("<I", len(value)) + value


def open_item(value):
    return tag(0xFFFE, 0xE000) + struct.pack("<I", UNDEFINED) + value + tag(0xFFFE, 0xE00D) + bytes(4)


END = tag(0xFFFE, 0xE0DD) + bytes(4)


def file(syntax, data):
    return bytes(128) + b"DICM" + explicit(2, 0x10, "UI", syntax) + data


def image(e, frames=1, kind=b"1.2.840.10008.5.1.4.1.1.6.1", before=b"", increment=b"", after=b"", photometric=b"MONOCHROME2",
          bits=8, depth=1, spacing=b"0.5\\0.25"):
    samples = 1 if photometric.startswith(b"MONO") else 3
    short = lambda n: struct.pack("<H", n)
    return (e(8, 0x16, "UI", kind) + e(8, 0x60, "CS", b"US") + before + e(0x20, 0xE, "UI", b"1.2.3") +
            e(0x28, 2, "US", short(samples)) + e(0x28, 4, "CS", photometric) +
            (e(0x28, 8, "IS", b"%d" % frames) if frames > 1 else b"") + increment + e(0x28, 0x10, "US", short(3)) +
            e(0x28, 0x11, "US", short(4)) + (e(0x28, 0x30, "DS", spacing) if spacing else b"") +
            e(0x28, 0x100, "US", short(bits)) + e(0x28, 0x101, "US", short(bits)) + e(0x28, 0x102, "US", short(bits - 1)) +
            e(0x28, 0x103, "US", short(0)) + e(0x28, 0x1052, "DS", b"1") + e(0x28, 0x1053, "DS", b"2") + after +
            e(0x7FE0, 0x10, "OB", bytes(range(12 * samples * bits // 8)) * frames * depth))


def compressed(syntax, *fragments):
    """Its table of offsets, then the fragments as they are."""
    whole = file(syntax, image(explicit, max(1, len(fragments))))
    pixels = whole.rindex(tag(0x7FE0, 0x10))
    return (whole[:pixels] + tag(0x7FE0, 0x10) + b"OB\0\0" + struct.pack("<I", UNDEFINED) + item(b"") + b"".join(map(item, fragments)) + END)


def groups(e, item, length, patient=False):
    end = END if length else b""
    sequence = lambda group, element, value: e(group, element, "SQ", item(value) + end, length)
    doubles = lambda *n: struct.pack(f"<{len(n)}d", *n)
    shared = (sequence(0x18, 0x9807, e(0x18, 0x9808, "CS", b"TISSUE_INTENSITY")) +
              sequence(0x20, 0x930F, e(0x20, 0x9302, "FD", doubles(0, 1, 0, 0, 0, 1))) +
              sequence(0x28, 0x9110, e(0x28, 0x30, "DS", b"0.5\\0.25")))
    if patient:
        shared += sequence(0x20, 0x9116, e(0x20, 0x37, "DS", b"1\\0\\0\\0\\1\\0"))
    own = [sequence(0x20, 0x930E, e(0x20, 0x9301, "FD", doubles(k // 2, 2, 3))) +
           sequence(0x20, 0x9310, e(0x20, 0x930D, "FD", doubles(k % 2))) +
           (sequence(0x20, 0x9113, e(0x20, 0x32, "DS", b"1\\2\\%d" % (k // 2))) if patient else b"") for k in range(4)]
    return (e(0x5200, 0x9229, "SQ", item(shared) + end, length) +
            e(0x5200, 0x9230, "SQ", b"".join(map(item, own)) + end, length))


SLICE = lambda e: e(0x20, 0x32, "DS", b"1\\2\\3") + e(0x20, 0x37, "DS", b"1\\0\\0\\0\\1\\0")
matrix = struct.pack("<16d", 1, 0, 0, 1, 0, 0, -1, 2, 0, 1, 0, 3, 0, 0, 0, 1)
enhanced = lambda e, item, length, patient=False: image(e, 4, b"1.2.840.10008.5.1.4.1.1.6.2", e(0x20, 0x9309, "FD", matrix),
                                                        after=groups(e, item, length, patient))
philips = (explicit(0x18, 0x602C, "FD", struct.pack("<d", 0.1)) + explicit(0x18, 0x602E, "FD", struct.pack("<d", 0.2)) +
           explicit(0x18, 0x1063, "DS", b"40"))
philips_after = (explicit(0x3001, 0x10, "LO", b"someone") + explicit(0x3001, 0x1001, "UL", struct.pack("<I", 2)) +
                 explicit(0x3001, 0x1003, "FD", struct.pack("<d", 0.3)))
region = explicit(0x18, 0x6014, "US", b"\1\0") + explicit(0x18, 0x6024, "US", b"\3\0")
region += explicit(0x18, 0x6026, "US", b"\3\0") + philips[:32]
regions = explicit(0x18, 0x6011, "SQ", open_item(region) * 2 + END, UNDEFINED)
affiniti = explicit(0x200D, 0x10, "LO", b"other") + explicit(0x200D, 0x11, "LO", b"Philips US Imaging DD 036")
affiniti += explicit(0x200D, 0x1103, "LO", b"0.5\\0.25\\2")
moment = explicit(0x18, 0x1060, "DS", b"40") + SLICE(explicit) + explicit(0x20, 0x100, "IS", b"2")
packer = zlib.compressobj(wbits=-15)
seeds = {
    "slice": file(b"1.2.840.10008.1.2.1", image(explicit, before=SLICE(explicit))),
    "implicit": file(b"1.2.840.10008.1.2", image(implicit, before=SLICE(implicit))),
    "colour": file(b"1.2.840.10008.1.2.1", image(explicit, photometric=b"YBR_FULL")),
    "enhanced": file(b"1.2.840.10008.1.2.1", enhanced(explicit, item, None)),
    "enhanced_open": file(b"1.2.840.10008.1.2.1", enhanced(explicit, open_item, UNDEFINED)),
    "enhanced_implicit": file(b"1.2.840.10008.1.2", enhanced(implicit, item, None)),
    "enhanced_patient": file(b"1.2.840.10008.1.2.1", enhanced(explicit, item, None, True)),
    "deflated": file(b"1.2.840.10008.1.2.1.99", packer.compress(enhanced(explicit, item, None)) + packer.flush()),
    "rle": compressed(b"1.2.840.10008.1.2.5", struct.pack("<16I", 1, 64, *[0] * 14) + b"\x0b" + bytes(range(12)) + b"\0"),
    "jpegs": compressed(b"1.2.840.10008.1.2.4.50", *[b"\xff\xd8\xff\xe0" + bytes(12)] * 3),
    "jpeg2000": compressed(b"1.2.840.10008.1.2.4.90", b"\xff\x4f\xff\x51" + bytes(12)),
    "cine": file(b"1.2.840.10008.1.2.1", image(explicit, 3, increment=explicit(0x28, 9, "AT", tag(0x18, 0x1063)))),
    "stack": file(b"1.2.840.10008.1.2.1", image(explicit, 3, before=explicit(0x18, 0x88, "DS", b"2"))),
    "placed": file(b"1.2.840.10008.1.2.1", image(explicit, 3, before=explicit(0x18, 0x88, "DS", b"2") + SLICE(explicit))),
    "philips": file(b"1.2.840.10008.1.2.1", image(explicit, 4, before=philips, after=philips_after, depth=2)),
    "regions": file(b"1.2.840.10008.1.2.1", image(explicit, before=regions, spacing=b"")),
    "affiniti": file(b"1.2.840.10008.1.2.1", image(explicit, 3, after=affiniti)),
    "inverted": file(b"1.2.840.10008.1.2.1", image(explicit, before=moment, photometric=b"MONOCHROME1", bits=16)),
    "subsampled": file(b"1.2.840.10008.1.2.1", image(explicit, photometric=b"YBR_FULL_422")),
    "kretz": file(b"1.2.840.10008.1.2.1", image(explicit) + explicit(0x7FE1, 0x11, "LO", b"KRETZ_US") +
                  explicit(0x7FE1, 0x1101, "OB", b"KRETZFILE 1.0   " + struct.pack("<HHI", 0xFFFF, 0xFFFF, 0))),
}
for name, content in seeds.items():
    (folder / name).write_bytes(content)
