# SPDX-License-Identifier: BSD-3-Clause
"""SeedsMesh.py DIR: small PLY and OBJ files for the fuzzer to start from."""
import struct
import sys
from pathlib import Path

folder = Path(sys.argv[1])


def ply(format_, vertex, face, body, rest=""):
    return (f"ply\nformat {format_} 1.0\ncomment a\n{vertex}element face 1\n{face}{rest}end_header\n").encode() + body


FLOATS = "element vertex 3\nproperty float x\nproperty float y\nproperty float32 z\n"
DOUBLES = "element vertex 3\nproperty uchar red\nproperty double x\nproperty float64 y\nproperty double z\n"
LIST = "property list uchar int vertex_indices\n"
points = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]
seeds = {
    "ascii.ply": ply("ascii", FLOATS, LIST, b"0 0 0\n1 0 0\n0 1e0 -0.5\n3 0 1 2\n"),
    "little.ply": ply("binary_little_endian", FLOATS, LIST, struct.pack("<9fB3i", *points, 3, 0, 1, 2)),
    "big.ply": ply("binary_big_endian", DOUBLES, "property list ushort uint vertex_index\nproperty char flags\n",
                   b"".join(struct.pack(">B3d", 9, *points[at:at + 3]) for at in (0, 3, 6)) + struct.pack(">H3Ib", 3, 2, 1, 0, 1)),
    "others.ply": ply("binary_little_endian", FLOATS, LIST, struct.pack("<9fB3i", *points, 3, 0, 1, 2) + struct.pack("<HhI", 1, -2, 3),
                      "obj_info b\nelement edge 1\nproperty ushort a\nproperty short b\nproperty uint32 c\n"),
    "triangle.obj": b"# a\no a\nv 0 0 0\nv 1 0 0 1.0\nv 0 1 0\nvn 0 0 1\nvt 0 0\nf 1/1/1 2//1 3\n",
    "backwards.obj": b"v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nv 0 0 1\r\nf -1 -2 \\\r\n -3 -4\r\ns off\r\n",
}
for name, content in seeds.items():
    (folder / name).write_bytes(content)
