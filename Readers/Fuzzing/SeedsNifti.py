# SPDX-License-Identifier: BSD-3-Clause
"""SeedsNifti.py DIR: small NIfTI files of both versions and byte orders, with qform, sform, times, extensions, compressed."""
import gzip
import struct
import sys
from pathlib import Path

folder = Path(sys.argv[1])


def nifti1(end="<", dim=(3, 2, 2, 2, 1, 1, 1, 1), datatype=2, codes=(0, 1), slope=0.0, extension=b"", data=bytes(8), units=10, step=0.5,
           mirror=1):
    header = bytearray(348)
    struct.pack_into(end + "i", header, 0, 348)
    struct.pack_into(end + "8h", header, 40, *dim)
    struct.pack_into(end + "h", header, 70, datatype)
    struct.pack_into(end + "8f", header, 76, -1, 1, 2, 3, step, 0, 0, 0)
    struct.pack_into(end + "3f", header, 108, 352 + len(extension), slope, 1)
    header[123] = units
    struct.pack_into(end + "2h", header, 252, *codes)
    struct.pack_into(end + "6f", header, 256, 0.1, 0.2, 0.3, 1, 2, 3)
    struct.pack_into(end + "12f", header, 280, -1, 0, 0, 5, 0, 2, 0, 6, 0, 0, 3 * mirror, 7)
    header[344:348] = b"n+1\0"
    return bytes(header) + (b"\1\0\0\0" if extension else bytes(4)) + extension + data


def nifti2():
    header = bytearray(540)
    struct.pack_into("<i", header, 0, 540)
    header[4:12] = b"n+2\0\r\n\x1a\n"
    struct.pack_into("<hh8q", header, 12, 16, 32, 3, 2, 2, 2, 1, 1, 1, 1)
    struct.pack_into("<8dq", header, 104, 1, 1, 2, 3, 0, 0, 0, 0, 544)
    struct.pack_into("<2i", header, 344, 0, 1)
    struct.pack_into("<12d", header, 400, 1, 0, 0, 5, 0, 2, 0, 6, 0, 0, 3, 7)
    struct.pack_into("<i", header, 500, 2)
    return bytes(header) + bytes(4 + 32)


comment = b"Echorama volume 1 2 3 1 2 3 1 0 0 0 1 0 0 0 1\nEchorama_TimeStamp=1\n"
comment += bytes(-(len(comment) + 8) % 16)
ours = struct.pack("<ii", len(comment) + 8, 6) + comment
seeds = {
    "sform": nifti1(), "qform": nifti1(codes=(1, 0)), "neither": nifti1(codes=(0, 0)), "big": nifti1(">"),
    "times": nifti1(dim=(4, 2, 2, 2, 3, 1, 1, 1), data=bytes(24)), "scaled": nifti1(slope=0.5), "second": nifti2(),
    "milliseconds": nifti1(dim=(4, 2, 2, 2, 3, 1, 1, 1), data=bytes(24), units=18),
    "metres": nifti1(dim=(4, 2, 2, 2, 3, 1, 1, 1), data=bytes(24), units=25, step=0), "left": nifti1(mirror=-1),
    "extension": nifti1(extension=ours), "gz": gzip.compress(nifti1(extension=ours), mtime=0),
    "gzTimes": gzip.compress(nifti1(dim=(4, 2, 2, 2, 3, 1, 1, 1), data=bytes(24)), mtime=0), "cut": nifti1()[:-3],
}
for name, content in seeds.items():
    (folder / name).write_bytes(content)
