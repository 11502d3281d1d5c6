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
gzip = zlib.compressobj(wbits=31)
seeds = {
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
