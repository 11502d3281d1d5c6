# SPDX-License-Identifier: BSD-3-Clause
"""SeedsSequence.py DIR: small sequences of each kind, whole and broken, for the fuzzer to start from."""
import sys
import zlib
from pathlib import Path

folder = Path(sys.argv[1])
pixels = bytes(range(24))
still = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"
frames = [("ProbeToTrackerTransform", "0.5 -8.4e-005 0 10 0 1 0 20 0 0 1 30 -0 0 -0 1"), ("ProbeToTrackerTransformStatus", "OK"),
          ("ReferenceToTrackerTransform", still), ("ReferenceToTrackerTransformStatus", "INVALID"), ("Timestamp", "12.5"),
          ("FrameNumber", "77"), ("ImageStatus", "OK")]


def lines(equals):
    return "".join(f"Seq_Frame{number:04}_{key}{equals}{value}\n" for number in range(3) for key, value in frames)


def meta(data, size="4 2 3", compressed=False, orientation="MF", element="MET_UCHAR", kinds="domain domain list", dimensions=3):
    return (f"ObjectType = Image\nNDims = {dimensions}\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
            f"CompressedData = {compressed}\nDimSize = {size}      \nKinds = {kinds}\nElementNumberOfChannels = 1\n"
            f"ElementType = {element}\nUltrasoundImageOrientation = {orientation}\nUltrasoundImageType = BRIGHTNESS\n"
            f"{lines(' = ')}ElementDataFile = LOCAL\n").encode() + data


def nrrd(data, sizes, kinds, directions, encoding="raw"):
    return (f"NRRD0004\ntype: uchar\ndimension: {len(kinds.split())}\nsizes: {sizes}\nkinds: {kinds}\n"
            f"space directions: {directions}\nspace: left-posterior-superior\nencoding: {encoding}\n"
            f"ultrasound image orientation:=UN\n{lines(':=')}\n").encode() + data


gzip = zlib.compressobj(wbits=31)
seeds = {
    "raw.mha": meta(pixels),
    "zlib.mha": meta(zlib.compress(pixels), compressed=True),
    "cut.mha": meta(zlib.compress(pixels)[:-6], compressed=True),
    "turned.mha": meta(pixels, orientation="FM"),
    "turned3.mha": meta(pixels, size="2 2 2 3", orientation="DNU", kinds="domain domain domain list", dimensions=4),
    "trackers.mha": meta(b"", size="0 0 3", orientation="XX", element="MET_OTHER"),
    "short.mha": meta(pixels, size="2 2 3", element="MET_SHORT"),
    "last.nrrd": nrrd(pixels, "4 2 3", "domain domain list", "(1,0,0) (0,1,0) none"),
    "first.nrrd": nrrd(pixels, "3 2 2 2", "list domain domain domain", "none (1,0,0) (0,1,0) (0,0,1)"),
    "gzip.nrrd": nrrd(gzip.compress(pixels) + gzip.flush(), "4 2 1 3", "domain domain domain time",
                      "(1,0,0) (0,1,0) (0,0,1) none", "gzip"),
}
for name, content in seeds.items():
    (folder / name).write_bytes(content)
