# SPDX-License-Identifier: BSD-3-Clause
"""SeedsVolume.py DIR: small files of each format, whole and broken in one place, for the fuzzer to start from."""
import struct
import sys
import zlib
from pathlib import Path

folder = Path(sys.argv[1])
voxels = bytes(range(60))
meta = """ObjectType = Image
NDims = 3
BinaryData = True
BinaryDataByteOrderMSB = False
CompressedData = {compressed}
TransformMatrix = 0.8 0.6 0 -0.6 0.8 0 0 0 1
Offset = 1 -2 3.5
ElementSpacing = 0.5 0.5 0.7
DimSize = 5 4 3
AnatomicalOrientation = RAI
Echorama_TimeStamp = 12.5
ElementType = {type}
ElementDataFile = LOCAL
"""
nrrd = """NRRD0004
# a comment
type: {type}
dimension: 3
space: {space}
sizes: 5 4 3
space directions: (0.5,0,0) (0,0.5,0) (0,0,0.7)
space origin: (1,2,3)
endian: {endian}
encoding: {encoding}
key:=value\\nof two lines

"""
spaced = """NRRD0005
type: short
dimension: {dimension}
sizes: {sizes}
{lines}
endian: little
encoding: raw

"""
old = """ObjectType = Image
NDims = {axes}
BinaryData = {binary}
ElementByteOrderMSB = False
Rotation = {rotation}
Position = {position}
{lines}
ElementSize = {spacing}
DimSize = {sizes}
ElementType = MET_UCHAR
ElementDataFile = LOCAL
"""


def planar(lines, binary=True):
    return old.format(axes=2, binary=binary, rotation="1 0 0 1", position="1 2", lines=lines, spacing="0.5 0.7", sizes="10 6").encode()


def solid(lines, rotation):
    return old.format(axes=3, binary=True, rotation=rotation, position="1 2 3", lines=lines, spacing="0.5 0.7 1", sizes="5 4 3").encode()


def lined(lines, sizes="5 4 3"):
    return spaced.format(dimension=len(sizes.split()), sizes=sizes, lines=lines).encode() + voxels * 2


gzip = zlib.compressobj(wbits=31)
turned = "space directions: (0,0.5,0) (0.5,0,0) (0,0,0.7)"
seeds = {
    "spaced.nrrd": lined('units: "cm" "mm" "um"\nspacings: 0.5 0.5 0.7\naxis mins: 1 2 3\ncenterings: cell node cell\nbyte skip: -1'),
    "ends.nrrd": lined("axis mins: 0 0 0\naxis maxs: 4 4 3\ncenters: node cell cell\nkinds: domain space ???"),
    "one_number.nrrd": lined("kinds: vector domain domain domain\nspacings: nan 1 2 3", "1 5 4 3"),
    "fourth.nrrd": lined("spacings: 1 2 3 1", "5 4 3 1"),
    "plane.nrrd": lined("spacings: 1 2\nbyte skip: 20", "10 5"),
    "left.nrrd": lined(turned + '\nspace: LAS\nspace units: "cm" "cm" "cm"\nspace origin: (1,2,3)\nspacings: nan nan nan'),
    "skipped.nrrd": nrrd.format(type="uint8", space="LPS", endian="little", encoding="raw\nline skip: 2").encode() + b"a\nb\n" + voxels,
    "left.mha": solid("DistanceUnits = cm", "0 1 0 1 0 0 0 0 1") + voxels,
    "sized.mha": solid("HeaderSize = -1\nElementNumberOfChannels = 1", "1 0 0 0 1 0 0 0 1") + voxels,
    "plane.mha": planar("DistanceUnits = um") + voxels,
    "text.mha": planar("Comment = numbers", False) + b" ".join(b"%d" % v for v in voxels),
    "plain.mha": meta.format(compressed=False, type="MET_UCHAR").encode() + voxels,
    "zlib.mha": meta.format(compressed=True, type="MET_UCHAR").encode() + zlib.compress(voxels),
    "short.mha": meta.format(compressed=False, type="MET_SHORT").encode() + voxels * 2,
    "cut.mha": meta.format(compressed=True, type="MET_UCHAR").encode() + zlib.compress(voxels)[:20],
    "raw.nrrd": nrrd.format(type="uint8", space="left-posterior-superior", endian="little", encoding="raw").encode() + voxels,
    "gzip.nrrd": nrrd.format(type="uint8", space="right-anterior-superior", endian="little", encoding="gzip").encode()
    + gzip.compress(voxels) + gzip.flush(),
    "text.nrrd": nrrd.format(type="float", space="LPS", endian="big", encoding="text").encode()
    + b" ".join(b"%d" % v for v in voxels),
    "big.nrrd": nrrd.format(type="float", space="RAS", endian="big", encoding="raw").encode() + struct.pack(">60f", *voxels),
}
for name, content in seeds.items():
    (folder / name).write_bytes(content)
